"""New case files."""

from __future__ import annotations

import json
import re
from pathlib import Path

from walkers.errors import check_text_or_path, check_utf8, expected_of, input_error
from walkers.files import write_json
from walkers.inputs.reading import shipped

_TITLE = re.compile("^title += .*", re.MULTILINE)
"""The line of a shipped case with its title."""
_SCHEMA = "case.schema.json"
"""Name of the JSON schema beside a new case file."""


def new(path: str | Path, case: str = "fig1b", *, schema: bool = False) -> list[Path]:
    """Write a new case file, a copy of a shipped case, whose comments explain its keys.

    Its title names the file, because pictures and reports of the new case show it.

    Parameters
    ----------
    path
        The file; ``.toml`` is appended if it is left out.
    case
        The name of a shipped case.
    schema
        Whether to write the JSON schema of case files beside it too. The first line of the case
        names it for editors.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        If the file exists already or cannot be written, or if there is no such shipped case.
    """
    check_text_or_path("path", path)
    path = Path(path)
    check_utf8(path)
    if path.name in ("", "..") or path.stem in (".", ".."):
        raise input_error(path, "expected a name")
    if path.suffix != ".toml":
        path = path.with_name(f"{path.name}.toml")
    cases = shipped("case")
    if case not in cases:
        raise input_error(case, expected_of(str(case), cases))
    title = json.dumps(f"{path.stem}, from {case}", ensure_ascii=False)
    text = _TITLE.sub(lambda _: f"title = {title}", cases[case].read_text("utf-8"), count=1)
    if schema:
        text = f"#:schema {_SCHEMA}\n\n{text}"
    try:
        _write_new(path, text)
    except FileExistsError as error:
        message = "exists already and is not overwritten; expected another name"
        raise input_error(path, message) from error
    except OSError as error:
        message = f"cannot be written ({error.strerror}): expected a name in a folder that exists"
        raise input_error(path, message) from error
    if not schema:
        return [path]
    from walkers.inputs.schema import case_schema

    schema_path = path.with_name(_SCHEMA)
    write_json(schema_path, case_schema())
    return [path, schema_path]


def _write_new(path: Path, text: str) -> None:
    """Write a file that does not exist yet; an error, as of a full disk, leaves nothing of it."""
    with path.open("x", encoding="utf-8") as file:
        try:
            file.write(text)
            file.flush()
        except OSError:
            path.unlink(missing_ok=True)
            raise
