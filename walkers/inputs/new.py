"""New case files."""

from __future__ import annotations

from pathlib import Path

from walkers.errors import check_utf8, expected_of, input_error
from walkers.files import write_json
from walkers.inputs.reading import shipped

_SCHEMA = "case.schema.json"


def new(path: str | Path, case: str = "fig1b", *, schema: bool = False) -> list[Path]:
    """Write a new case file, a copy of a shipped case, whose comments explain its keys.

    `InputError` if there is such a file already, or no such shipped case.

    Parameters
    ----------
    path
        The file; ``.toml`` is appended if it is left out.
    case
        The name of a shipped case.
    schema
        Whether to write the JSON schema of case files beside it too. The first line of the case names it for editors.

    Returns
    -------
    list of Path
        The files.
    """
    path = Path(path)
    check_utf8(path)
    if path.name in ("", "..") or path.stem in (".", ".."):
        raise input_error(path, "expected a name")
    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    if case not in (cases := shipped("case")):
        raise input_error(case, expected_of(case, cases))
    text = cases[case].read_text("utf-8")
    try:
        _write_new(path, f"#:schema {_SCHEMA}\n\n{text}" if schema else text)
    except FileExistsError as error:
        raise input_error(
            path, "exists already: it is not overwritten; expected another name"
        ) from error
    except OSError as error:
        raise input_error(
            path, f"cannot be written ({error.strerror}): expected a name in a folder that exists"
        ) from error
    if not schema:
        return [path]
    from walkers.inputs.schema import case_schema

    write_json(path.with_name(_SCHEMA), case_schema())
    return [path, path.with_name(_SCHEMA)]


def _write_new(path: Path, text: str) -> None:
    """Write a file that does not exist yet; after an error, such as a full disk, nothing of it is left."""
    with path.open("x", encoding="utf-8") as file:
        try:
            file.write(text)
            file.flush()
        except OSError:
            path.unlink(missing_ok=True)
            raise
