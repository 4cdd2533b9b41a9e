"""Files that users name: found and, if they are cases, read and resolved.

How a case follows from its tables is in `walkers.inputs.case_building`.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import (
    InputError,
    check_changes,
    check_text_or_path,
    check_utf8,
    input_error,
    key_error,
    quoted,
    shortened,
    suggestion,
)
from walkers.inputs.keys import MISSING, parts_of, value_at
from walkers.inputs.messages import attributed_to
from walkers.inputs.resolving.library import FILE_NAME, read_library
from walkers.inputs.toml import FILE_KEYS, read_toml, with_files

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case

_HERE = Path(__file__).parent
_COMMANDS = {
    "case": "a case: walkers run {}",
    "sweep": "a sweep: walkers sweep {}",
    "calibration": "a calibration: walkers calibrate {}",
    "library": "a library: cases beside it can name what is in it; walkers library prints it",
    "case.json": "a run's directory: walkers run {}, or plot, render, export",
    "sweep.json": "a sweep's directory: walkers list {}, or plot, report; "
    "its file goes to walkers sweep",
}
"""What each kind of input is, and the commands for it; directories are told by a file in them."""
_CALLS = {
    "case": 'a case: walkers.run("{}")',
    "sweep": 'a sweep: walkers.sweep("{}")',
    "calibration": 'a calibration: walkers.calibrate("{}")',
    "library": "a library: cases beside it can name what is in it",
    "case.json": 'a run\'s directory: walkers.load("{}")',
    "sweep.json": 'a sweep\'s directory: walkers.load("{}"); its file goes to walkers.sweep',
}
"""The same with the calls of Python."""
_NO_NAMES = (".", "..")
"""Stems of files that have no name before their ``.toml``."""


def shipped(kind: str) -> dict[str, Path]:
    """The files of a kind (case, sweep, calibration) that come with the program, by their names."""
    return {path.stem: path for path in sorted((_HERE / f"{kind}s").glob("*.toml"))}


def load_case(
    case: Case | str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Case:
    """Read and resolve a case.

    Parameters
    ----------
    case
        A TOML file, the name of a shipped case such as ``fig1b``, the tables of a case file, or a
        resolved case, which keeps its name.
    changes
        Values that replace those of the file, by dotted keys, written as in a case file. A key also
        replaces those that say the same in other words, such as ``drive.gamma0`` a
        ``drive.peak_acceleration`` and ``boundary.mesh`` a ``boundary.shape`` with its sizes. Files
        that changes name are looked for in the working directory; those that they replace need not
        exist.

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
    >>> load_case("fig1b", {"dimers.radii[1]": "0.25 mm"}).walkers[0].radii
    (0.0003, 0.00025)
    """
    check_changes(changes)
    if not isinstance(case, (str, Path, Mapping)):
        return _changed(case, changes or {})
    if isinstance(case, Mapping):
        document: Mapping[str, Any] = deepcopy(case)  # the caller may change its tables later
        source = "<case>"
        name = "case"
    else:
        path = find_input(case, "case")
        document = read_case(path, changes=changes)
        source = str(case)
        name = path.stem
    # Not above: a missing file is reported before the models of a case are built, which takes time.
    from walkers.inputs.case_building import build_case

    return build_case(document, source=source, name=name, changes=changes, check_ranges=True)


def _changed(case: object, changes: Mapping[str, Any]) -> Case:
    """A resolved case with other values; `InputError` for what is none."""
    from walkers.inputs.case_building import changed_case
    from walkers.inputs.tables.case import Case

    if not isinstance(case, Case):
        raise input_error("case", f"{quoted(case)}: expected a case, its file, name or tables")
    return changed_case(case, changes)


def read_case(
    path: Path, folder: Path | None = None, changes: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The tables of a case file, with the contents of the files beside it.

    These are the mesh and the record that it names, and the user's own library. A case that has a
    ``[library]`` itself takes no other.

    Parameters
    ----------
    path
        The case file.
    folder
        Where the library is for a case that comes with the program; the working directory if None.
        For another case, it is beside the file.
    changes
        Values by dotted keys that will replace some of the case. They are not made here, but files
        that the case will no longer name are not read.

    Returns
    -------
    dict
        The tables, with ``meshes``, ``records`` and ``library`` if there are any.

    Raises
    ------
    InputError
        If a file cannot be read, or the case has a table that only the program adds.
    """
    document = read_toml(path)
    with attributed_to(str(path), document):
        _check_added_tables(document)
        keys = keys_of_files(document, changes) if changes else FILE_KEYS
        document = with_files(document, path.parent, keys=keys)
    if "library" not in document and path.name != FILE_NAME:
        library_folder = path.parent
        if path.parent == _HERE / "cases":
            library_folder = folder or Path()
        library = read_library(library_folder)
        if library:
            document["library"] = library
    return document


def keys_of_files(document: Mapping[str, Any], changes: Mapping[str, Any]) -> list[str]:
    """The keys whose files a case still names after changes (a part of `FILE_KEYS`).

    Parameters
    ----------
    document
        The tables of the case.
    changes
        Values by dotted keys. If they cannot be made, no key is lost.
    """
    # Not above: the models of a case take time to build.
    from walkers.inputs.config_table import changed
    from walkers.inputs.tables.case import CaseFile

    tables: Mapping[str, Any] = document
    with suppress(InputError):  # told where the changes are made
        tables = changed(CaseFile, document, changes)
    remaining = []
    for key in FILE_KEYS:
        if key not in changes and value_at(tables, parts_of(key)) is not MISSING:
            remaining.append(key)
    return remaining


def _check_added_tables(document: Mapping[str, Any]) -> None:
    """Refuse tables that the program makes of the files that a case names."""
    added = ["records"]
    mesh = value_at(document, ("boundary", "mesh"))
    if value_at(document, ("meshes", mesh)) is MISSING:  # the case of an archive contains its mesh
        added.append("meshes")
    for table in added:
        if table in document:
            message = "unknown key: the program reads this table from a file that the case names"
            raise key_error(table, message)


def is_sweep_file(path: Path) -> bool:
    """Whether there is a sweep file at a path."""
    return path.is_file() and _kind_of(path) == "sweep"


def find_input(name: str | Path, kind: str) -> Path:
    """Find a file that a user names.

    Parameters
    ----------
    name
        Its path, with or without ``.toml``, or the name of a shipped file.
    kind
        ``case``, ``sweep`` or ``calibration``.

    Returns
    -------
    Path
        The file. It may be of a kind that cannot be told: reading it says what is wrong.

    Raises
    ------
    InputError
        If there is no such file, or it is of another kind. The message suggests names or commands.
    """
    check_text_or_path(kind, name, f"a {kind}: its file, name or tables")
    check_utf8(name)
    text = str(name)
    path = Path(name)
    shipped_files = shipped(kind)
    try:
        if text in shipped_files and not path.is_file():
            return shipped_files[text]
        if not path.exists() and Path(f"{name}.toml").is_file():
            path = Path(f"{name}.toml")
        actual_kind = _kind_of(path)
        if actual_kind not in (None, kind):
            call = _CALLS[str(actual_kind)].format(name)
            command = _COMMANDS[str(actual_kind)].format(name)
            raise input_error(name, f"is {call}", f"is {command}")
        if path.exists():
            if path.stem in _NO_NAMES:
                raise input_error(name, "expected a name before .toml")
            return path
    except OSError as error:
        raise input_error(shortened(text), f"cannot be read: {error.strerror}") from error
    missing = "no such file"
    if kind == "case":
        missing = "no such file, run or sweep"
    names = ", ".join(shipped_files)
    hint = suggestion(path.stem, [*_files_beside(path), *shipped_files])
    raise input_error(name, f"{missing}, nor a shipped {kind} ({names}){hint}")


def _files_beside(path: Path) -> list[str]:
    """Names of the TOML files in the folder of a path, without their ending.

    Empty if the folder cannot be read.
    """
    with suppress(OSError):
        return sorted(file.stem for file in path.parent.glob("*.toml"))
    return []


def _kind_of(path: Path) -> str | None:
    """Kind of input at a path or of a shipped name (a key of `_COMMANDS`); None if unknown."""
    with suppress(OSError, InputError):
        if path.is_dir():
            return _kind_of_directory(path)
        if path.is_file():
            return _kind_of_file(path)
    for kind in ("case", "sweep", "calibration"):
        if str(path) in shipped(kind):
            return kind
    return None


def _kind_of_directory(path: Path) -> str | None:
    """The file that makes a directory one of a sweep or of a run; None for another directory."""
    for file in ("sweep.json", "case.json"):
        if (path / file).is_file():
            return file
    return None


def _kind_of_file(path: Path) -> str | None:
    """Kind of a TOML file by its tables; None if they do not tell."""
    if path.stem in _NO_NAMES:
        return None
    tables = read_toml(path).keys()
    if tables & {"beads", "boundary", "drive", "liquid"}:
        return "case"
    if tables & {"materials", "liquids", "surface_pairs"}:
        return "library"
    if "case" not in tables:
        return None
    if tables & {"parameters", "experiments", "observations"}:
        return "calibration"
    return "sweep"
