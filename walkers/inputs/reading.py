"""Case files: found, read as TOML, validated and resolved.

Whatever is wrong ends as one `InputError` that names the file, the key, the value and what was expected.
"""

from __future__ import annotations

import stat
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem, check_utf8, shortened
from walkers.inputs.library import suggestion

if TYPE_CHECKING:
    from walkers.inputs.case import Case
    from walkers.inputs.schema import CaseFile

_HERE = Path(__file__).parent
_MOST_BYTES = 16 << 20
_COMMANDS = {
    "case": "a case: walkers run {}",
    "sweep": "a sweep: walkers sweep {}",
    "calibration": "a calibration: walkers calibrate {}",
    "case.json": "a run's directory: walkers result {}, or plot, render, vtk",
    "sweep.json": "a sweep's directory: walkers table {}, or plot, status; its file goes to walkers sweep",
}
"""What takes which kind of input."""


def shipped(kind: str) -> dict[str, Path]:
    """The files of a kind (case, sweep, calibration) that come with the project, by name."""
    return {path.stem: path for path in sorted((_HERE / f"{kind}s").glob("*.toml"))}


def shipped_cases() -> dict[str, Path]:
    """The cases that come with the project: name to file."""
    return shipped("case")


def check_kind(name: str | Path, wanted: str) -> None:
    """Refuse what is known to be another kind of input (case, sweep, calibration) than is wanted.

    Raises
    ------
    InputError
        With what it is, and the command that takes it.
    """
    found = _kind_of(name)
    if found not in (None, wanted):
        raise InputError(str(name), [Problem("", None, f"is {_COMMANDS[str(found)].format(name)}")])


def _kind_of(name: str | Path) -> str | None:
    """The kind, None where it is not known; files come before shipped names."""
    path = Path(name)
    with suppress(OSError, InputError):
        if path.is_dir():
            return next((file for file in ("sweep.json", "case.json") if (path / file).is_file()), None)
        if path.is_file():
            document = read_toml(path) if path.stem not in (".", "..") else {}  # refused for its name
            if document.keys() & {"beads", "boundary", "drive", "liquid"}:
                return "case"
            of_calibrations = document.keys() & {"parameters", "experiments", "observations"}
            return ("calibration" if of_calibrations else "sweep") if "case" in document else None
    return next((kind for kind in ("case", "sweep", "calibration") if str(name) in shipped(kind)), None)


def load_case(case: str | Path, changes: Mapping[str, Any] | None = None) -> Case:
    """Read and resolve a case.

    Parameters
    ----------
    case
        A TOML file, or the name of a shipped case such as ``fig1b``.
    changes
        Values put in place of the file's, by dotted keys, as a file would say them.

    Returns
    -------
    Case
        Named after the file.

    Raises
    ------
    InputError
        If there is no such file or anything in it, or a change, cannot be used.

    Examples
    --------
    >>> case = load_case("fig1b")
    >>> case.walkers[0].radii, case.drive.frequency
    ((0.0003, 0.0002), 80.0)
    >>> load_case("fig1b", {"drive.frequency": "70 Hz", "dimers.radii[1]": "0.25 mm"}).walkers[0].radii
    (0.0003, 0.00025)
    """
    if str(case) not in shipped_cases():
        check_kind(case, "case")
    path = find_input(case, "case")
    document = read_toml(path)
    if changes:
        from walkers.inputs.changes import changed, check_key
        from walkers.inputs.messages import blaming

        with blaming(str(case)):
            for key in changes:
                check_key(key)
            document = changed(document, changes)
    return resolve_case(document, source=str(case), name=path.stem)


def find_input(name: str | Path, kind: str) -> Path:
    """A file of a kind (case, sweep, calibration) by its path, or a shipped one by its name.

    Raises
    ------
    InputError
        If there is neither.
    """
    check_utf8(name)
    path, known = Path(name), shipped(kind)
    try:
        if path.is_file() or (path.exists() and str(name) not in known):
            if path.stem in (".", ".."):  # of "...toml"
                raise InputError(str(name), [Problem("", None, "expected a name before .toml")])
            return path
    except OSError as error:
        raise InputError(shortened(str(name)), [Problem("", None, f"cannot be read: {error.strerror}")]) from error
    if str(name) in known:
        return known[str(name)]
    told = f"no such file, nor a shipped {kind} ({', '.join(known)}){suggestion(str(name), known)}"
    raise InputError(str(name), [Problem("", None, told)])


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    InputError
        If it cannot be read, is no TOML, no regular file, or larger than 16 MB.
    """
    try:
        about = path.stat()
        if not stat.S_ISDIR(about.st_mode) and (not stat.S_ISREG(about.st_mode) or about.st_size > _MOST_BYTES):
            raise InputError(str(path), [Problem("", None, f"expected a file of at most {_MOST_BYTES >> 20} MB")])
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        found = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise InputError(str(path), [Problem("", None, f"expected UTF-8 text, found {found}")]) from error
    except (ValueError, RecursionError) as error:  # TOML's own errors, integers of 5000 digits, brackets without end
        raise InputError(str(path), [Problem("", None, f"not TOML: {error}")]) from error
    except OSError as error:
        raise InputError(str(path), [Problem("", None, f"cannot be read: {error.strerror}")]) from error


def resolve_case(document: Mapping[str, Any], *, source: str = "<case>", name: str = "case") -> Case:
    """Validate a case given as nested tables and fill in what the library supplies.

    Parameters
    ----------
    document
        The tables of a case file, quantities as strings with units.
    source, name
        What an error message calls the input, and the name of the case, with which its run directory begins.

    Raises
    ------
    InputError
        If anything in it cannot be used.
    """
    # Not above: that there is no such file is told before all that a case may say is built.
    from walkers.inputs.messages import blaming, validated
    from walkers.inputs.resolving import resolve
    from walkers.inputs.schema import CaseFile

    file = validated(CaseFile, document, source)
    try:
        with blaming(source, document):
            case = resolve(file, name).read_from(document)
    except ArithmeticError as error:
        raise InputError(source, [Problem("", None, f"inconsistent values: {error}")]) from error
    _check_uncertain(file, document, source)
    return case


def _check_uncertain(file: CaseFile, document: Mapping[str, Any], source: str) -> None:
    """Refuse ranges of what is no key of the case, or whose ends it could not say."""
    from walkers.inputs.changes import changed, check_key
    from walkers.inputs.messages import blaming, validated

    for key, given in file.uncertain.items():
        (ends,) = given.values()
        for end in ends:
            try:
                with blaming(source):
                    check_key(key)
                    document = changed(document, {key: end})
                validated(type(file), document, source)
            except InputError as error:
                told = [Problem(f"uncertain.{one.key}", one.value, one.expected) for one in error.problems]
                raise InputError(source, told) from error
