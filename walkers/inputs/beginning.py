"""Commented case files as starting points."""

from __future__ import annotations

from pathlib import Path

from walkers.errors import check_utf8, refused
from walkers.inputs.bodies import ARRANGEMENTS
from walkers.inputs.reading import shipped
from walkers.text import printable

_FOLDER = Path(__file__).with_name("beginnings")


def write_case(path: Path, kind: str = "walker", source: str | None = None) -> Path:
    """Write a new case file, with comments.

    Parameters
    ----------
    path
        The file; ``.toml`` is appended if it is left out.
    kind
        ``walker``, ``cluster``, ``tray`` or ``pile``.
    source
        A shipped case whose file is copied instead.

    Returns
    -------
    Path
        The file. `InputError` if there is such a file already, or no such shipped case.
    """
    from walkers.errors import expected_of

    check_utf8(path)
    if path.name in ("", "..") or path.stem in (".", ".."):
        raise refused(path, "expected a name")
    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    if source is not None:
        known = shipped("case")
        if source not in known:
            raise refused("--from", f"{source}: {expected_of(source, known)}")
        text = known[source].read_text("utf-8")
    else:
        text = (_FOLDER / f"{kind}.toml").read_text("utf-8")
        title = printable(path.stem).replace("\\", "").replace('"', "")
        for name, value in {"name": path, "title": title, "arrangements": ", ".join(ARRANGEMENTS)}.items():
            text = text.replace(f"{{{name}}}", str(value))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:
        raise refused(path, "exists already: it is not overwritten") from error
    return path
