"""Case files: found, read as TOML, validated and resolved."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, check_utf8, input_error, key_error, shortened, suggestion
from walkers.inputs.keys import MISSING, value_at
from walkers.inputs.messages import attributed_to
from walkers.inputs.resolving.library import FILE_NAME, read_library
from walkers.inputs.toml import read_toml, with_files

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case

_HERE = Path(__file__).parent
_COMMANDS = {
    "case": "a case: walkers run {}",
    "sweep": "a sweep: walkers sweep {}",
    "calibration": "a calibration: walkers calibrate {}",
    "library": "a library: cases beside it can name what is in it; walkers library prints it",
    "case.json": "a run's directory: walkers run {}, or plot, render, export",
    "sweep.json": "a sweep's directory: walkers list {}, or plot, report; its file goes to walkers sweep",
}
"""The commands for each kind of input."""


def shipped(kind: str) -> dict[str, Path]:
    """The files of a kind (case, sweep, calibration) that come with the project, by name."""
    return {path.stem: path for path in sorted((_HERE / f"{kind}s").glob("*.toml"))}


def load_case(
    case: str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Case:
    """Read and resolve a case.

    Parameters
    ----------
    case
        A TOML file, the name of a shipped case such as ``fig1b``, or the tables of a case file.
    changes
        Values that replace those of the file, by dotted keys, written as in a case file.

    Returns
    -------
    Case
        Named after the file; ``case`` if there is none.

    Raises
    ------
    InputError
        If the file does not exist, or the file or a change is invalid.

    Examples
    --------
    >>> case = load_case("fig1b")
    >>> case.dimers.radii, case.drive.frequency
    ((0.0003, 0.0002), 80.0)
    >>> load_case("fig1b", {"drive.frequency": "70 Hz", "dimers.radii[1]": "0.25 mm"}).walkers[0].radii
    (0.0003, 0.00025)
    """
    path = Path("case.toml") if isinstance(case, Mapping) else find_input(case, "case")
    document = case if isinstance(case, Mapping) else read_case(path)
    # Not above: a missing file is reported before the models of a case are built, which takes time.
    from walkers.inputs.case_building import build_case

    source = "<case>" if isinstance(case, Mapping) else str(case)
    return build_case(document, source=source, name=path.stem, changes=changes, check_ranges=True)


def read_case(path: Path, folder: Path | None = None) -> dict[str, Any]:
    """The tables of a case file, with the mesh and the record that it names, and the user's own library.

    That is the library beside the file; beside a case that comes with the program it is that in ``folder``, the working
    directory if None. A case that has a ``[library]`` itself takes no other.
    """
    document = read_toml(path)
    with attributed_to(str(path), document):
        mesh = value_at(document, ("boundary", "mesh"))
        of_archive = value_at(document, ("meshes", mesh)) is not MISSING  # whose case has its mesh
        for table in {"records", "meshes"} - ({"meshes"} if of_archive else set()):
            if table in document:
                raise key_error(
                    table,
                    "unknown key: the program reads this table from a file that the case names",
                )
        document = with_files(document, path.parent)
    if "library" not in document and path.name != FILE_NAME:
        beside = (folder or Path()) if path.parent == _HERE / "cases" else path.parent
        if library := read_library(beside):
            document["library"] = library
    return document


def is_sweep_file(path: Path) -> bool:
    """Whether a file is a sweep's."""
    return path.is_file() and _kind_of(path) == "sweep"


def find_input(name: str | Path, kind: str) -> Path:
    """A file of a kind (case, sweep, calibration) by its path, with or without ``.toml``, or by its shipped name."""
    check_utf8(name)
    text, path, of_kind = str(name), Path(name), shipped(kind)
    try:
        if text in of_kind and not path.is_file():
            return of_kind[text]
        if not path.exists() and Path(f"{name}.toml").is_file():
            path = Path(f"{name}.toml")
        if (actual := _kind_of(path)) not in (None, kind):
            raise input_error(name, f"is {_COMMANDS[str(actual)].format(name)}")
        if path.exists():
            if path.stem in (".", ".."):  # of "...toml"
                raise input_error(name, "expected a name before .toml")
            return path
    except OSError as error:
        raise input_error(shortened(text), f"cannot be read: {error.strerror}") from error
    missing = "no such file, run or sweep" if kind == "case" else "no such file"
    raise input_error(
        name, f"{missing}, nor a shipped {kind} ({', '.join(of_kind)}){suggestion(text, of_kind)}"
    )


def _kind_of(path: Path) -> str | None:
    """Kind of the file at a path or of a shipped name; None if unknown."""
    with suppress(OSError, InputError):
        if path.is_dir():
            return next(
                (file for file in ("sweep.json", "case.json") if (path / file).is_file()), None
            )
        if path.is_file():
            document = (
                read_toml(path) if path.stem not in (".", "..") else {}
            )  # refused for its name
            if document.keys() & {"beads", "boundary", "drive", "liquid"}:
                return "case"
            if document.keys() & {"materials", "liquids", "surface_pairs"}:
                return "library"
            of_calibrations = document.keys() & {"parameters", "experiments", "observations"}
            return ("calibration" if of_calibrations else "sweep") if "case" in document else None
    return next(
        (kind for kind in ("case", "sweep", "calibration") if str(path) in shipped(kind)), None
    )
