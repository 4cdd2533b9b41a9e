"""Case files: found, read as TOML, validated and resolved.

Whatever is wrong ends as one `InputError` that names the file, the key, the value and what was expected.
"""

from __future__ import annotations

import stat
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, check_utf8, each, refused, shortened
from walkers.inputs.library import FILE_NAME, library_of, read_library, suggestion

if TYPE_CHECKING:
    from walkers.inputs.case import Case

_HERE = Path(__file__).parent
_MOST_BYTES = 16 << 20
_COMMANDS = {
    "case": "a case: walkers run {}",
    "sweep": "a sweep: walkers sweep {}",
    "calibration": "a calibration: walkers calibrate {}",
    "library": "a library: cases beside it can name what is in it; walkers library prints it",
    "case.json": "a run's directory: walkers run {}, or plot, render, export",
    "sweep.json": "a sweep's directory: walkers list {}, or plot, report; its file goes to walkers sweep",
}
"""What takes which kind of input."""


def shipped(kind: str) -> dict[str, Path]:
    """The files of a kind (case, sweep, calibration) that come with the project, by name."""
    return {path.stem: path for path in sorted((_HERE / f"{kind}s").glob("*.toml"))}


def load_case(case: str | Path, changes: Mapping[str, Any] | None = None) -> Case:
    """Read and resolve a case.

    Parameters
    ----------
    case
        A TOML file, or the name of a shipped case such as ``fig1b``.
    changes
        Values that replace those of the file, by dotted keys, written as in a case file.

    Returns
    -------
    Case
        Named after the file.

    Raises
    ------
    InputError
        If the file does not exist, or the file or a change is invalid.

    Examples
    --------
    >>> case = load_case("fig1b")
    >>> case.walkers[0].radii, case.drive.frequency
    ((0.0003, 0.0002), 80.0)
    >>> load_case("fig1b", {"drive.frequency": "70 Hz", "dimers.radii[1]": "0.25 mm"}).walkers[0].radii
    (0.0003, 0.00025)
    """
    path = find_input(case, "case")
    return _changed(read_case(path), changes, str(case), path.stem)


def read_case(path: Path, folder: Path | None = None) -> dict[str, Any]:
    """The tables of a case file, the user's own library among them under ``library``.

    That is the library beside the file; beside a case that comes with the program it is that in ``folder``, the working
    directory if None. A case that has a ``[library]`` itself takes no other.
    """
    document = read_toml(path)
    if "library" not in document and path.name != FILE_NAME:
        beside = (folder or Path()) if path.parent == _HERE / "cases" else path.parent
        if own := read_library(beside):
            document["library"] = own
    return document


def with_changes(case: Case, changes: Mapping[str, Any] | None = None) -> Case:
    """A case with changed values, as by `load_case`."""
    if not changes:
        return case
    if not case.as_read:
        raise refused(case.name, "was changed in Python: expected a case as it was read")
    return _changed(case.document, changes, case.name, case.name)


def _changed(document: Mapping[str, Any], changes: Mapping[str, Any] | None, source: str, name: str) -> Case:
    """The case of tables with changes, whose keys are checked."""
    from walkers.inputs.changes import changed
    from walkers.inputs.messages import blaming, blaming_changes, check_key
    from walkers.inputs.readable import range_about

    with blaming_changes(changes or {}):
        with blaming(source):
            each(check_key, changes or {})
            tables = changed(document, changes or {})
        case = resolve_case(tables, source=source, name=name)
    with blaming(source):
        each(range_about, [one for one in case.origins if one.uncertain] if tables.get("uncertain") else [])
    return case


def is_sweep_file(path: Path) -> bool:
    """Whether a file is a sweep's."""
    return path.is_file() and _kind_of(path) == "sweep"


def find_input(name: str | Path, kind: str) -> Path:
    """A file of a kind (case, sweep, calibration) by its path, which may lack ``.toml``, or a shipped one by its name.

    Raises `InputError` if there is neither, or if it is known to be of another kind: with the command that takes it.
    """
    check_utf8(name)
    path, known = Path(name), shipped(kind)
    with suppress(OSError):
        if not path.exists() and str(name) not in known and Path(f"{name}.toml").is_file():
            path = Path(f"{name}.toml")
    found = None if str(name) in known else _kind_of(path)
    if found not in (None, kind):
        raise refused(name, f"is {_COMMANDS[str(found)].format(name)}")
    try:
        if path.is_file() or (path.exists() and str(name) not in known):
            if path.stem in (".", ".."):  # of "...toml"
                raise refused(name, "expected a name before .toml")
            return path
    except OSError as error:
        raise refused(shortened(str(name)), f"cannot be read: {error.strerror}") from error
    if str(name) in known:
        return known[str(name)]
    there = "no such file, run or sweep" if kind == "case" else "no such file"
    raise refused(name, f"{there}, nor a shipped {kind} ({', '.join(known)}){suggestion(str(name), known)}")


def _kind_of(path: Path) -> str | None:
    """Kind of the file at a path or of a shipped name; None if unknown."""
    with suppress(OSError, InputError):
        if path.is_dir():
            return next((file for file in ("sweep.json", "case.json") if (path / file).is_file()), None)
        if path.is_file():
            document = read_toml(path) if path.stem not in (".", "..") else {}  # refused for its name
            if document.keys() & {"beads", "boundary", "drive", "liquid"}:
                return "case"
            if document.keys() & {"materials", "liquids", "surface_pairs"}:
                return "library"
            of_calibrations = document.keys() & {"parameters", "experiments", "observations"}
            return ("calibration" if of_calibrations else "sweep") if "case" in document else None
    return next((kind for kind in ("case", "sweep", "calibration") if str(path) in shipped(kind)), None)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; an `InputError` if it cannot be read, is no TOML, no regular file, or larger than 16 MB."""
    try:
        about = path.stat()
        if not stat.S_ISDIR(about.st_mode) and (not stat.S_ISREG(about.st_mode) or about.st_size > _MOST_BYTES):
            raise refused(path, f"expected a file of at most {_MOST_BYTES >> 20} MB")
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        found = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise refused(path, f"expected UTF-8 text, found {found}") from error
    except (ValueError, RecursionError) as error:  # TOML's own errors, integers of 5000 digits, brackets without end
        raise refused(path, f"not TOML: {error}") from error
    except OSError as error:
        raise refused(path, f"cannot be read: {error.strerror}") from error


def resolve_case(document: Mapping[str, Any], *, source: str = "<case>", name: str = "case") -> Case:
    """A case given as the tables of a case file, quantities as strings with units.

    ``source`` is what messages call it; run directories begin with its ``name``. Raises `InputError` if anything in it
    cannot be used.
    """
    # Not above: that there is no such file is told before all that a case may say is built.
    from walkers.inputs.changes import changed
    from walkers.inputs.messages import blaming, check_key, validated
    from walkers.inputs.missing import missing_keys
    from walkers.inputs.origins import Notes
    from walkers.inputs.resolving import resolve, supplied
    from walkers.inputs.schema import CaseFile

    notes = Notes()
    with blaming(source, document):
        tables = supplied(document, library_of(document, source), notes)
        file = validated(CaseFile, tables, source, further=missing_keys(tables))
        try:
            case = resolve(file, name, document, notes)
        except ArithmeticError as error:
            raise refused(source, f"inconsistent values: {error}") from error
        for key, given in file.uncertain.items():  # it is a key of the case, which could say both ends
            try:
                check_key(key)
                for end in next(iter(given.values())):
                    validated(CaseFile, changed(tables, {key: end}), source)
            except InputError as error:
                problems = [replace(one, key=f"uncertain.{one.key}") for one in error.problems]
                raise InputError(source, problems) from error
    return case
