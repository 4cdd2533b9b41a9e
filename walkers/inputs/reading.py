"""Case files: found, read as TOML, validated and resolved.

Whatever is wrong ends as one `InputError` that names the file, the key, the value and what was expected.
"""

from __future__ import annotations

import re
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem, UnusableKeyError, check_utf8, shortened
from walkers.inputs.kinds import check_kind
from walkers.inputs.library import suggestion

if TYPE_CHECKING:
    from walkers.inputs.case import Case

_SHIPPED = Path(__file__).parent / "cases"
_MOST_BYTES = 16 << 20


def shipped_cases() -> dict[str, Path]:
    """The cases that come with the project: name to file."""
    return {path.stem: path for path in sorted(_SHIPPED.glob("*.toml"))}


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
    path = find_input(case, shipped_cases(), "case")
    document = read_toml(path)
    if changes:
        document = _with_changes(document, changes, str(case))
    return resolve_case(document, source=str(case), name=path.stem)


def _with_changes(document: Mapping[str, Any], changes: Mapping[str, Any], source: str) -> dict[str, Any]:
    from walkers.inputs.axes import UnusableAxisError
    from walkers.inputs.changes import changed, check_key
    from walkers.inputs.messages import quoted

    try:
        for key in changes:
            check_key(key)
        return changed(document, changes)
    except UnusableAxisError as unusable:
        value = quoted({"value": changes.get(unusable.key)}, ["value"])
        raise InputError(source, [Problem(unusable.key, value, unusable.expected)]) from unusable


def find_input(name: str | Path, shipped: Mapping[str, Path], kind: str) -> Path:
    """A file by its path, or a shipped one by its name.

    Raises
    ------
    InputError
        If there is neither; ``kind`` is what the message calls it.
    """
    check_utf8(name)
    path = Path(name)
    try:
        if path.is_file() or (path.exists() and str(name) not in shipped):
            if path.stem in (".", ".."):  # of "...toml"
                raise InputError(str(name), [Problem("", None, "expected a name before .toml")])
            return path
    except OSError as error:
        raise InputError(shortened(str(name)), [Problem("", None, f"cannot be read: {error.strerror}")]) from error
    if str(name) in shipped:
        return shipped[str(name)]
    told = f"no such file, nor a shipped {kind} ({', '.join(shipped)}){suggestion(str(name), shipped)}"
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
    source
        What an error message calls the input.
    name
        Name of the case; its run directory begins with it.

    Raises
    ------
    InputError
        If anything in it cannot be used.
    """
    # Not above: that there is no such file is told before all that a case may say is built.
    from walkers.inputs.messages import quoted, validated
    from walkers.inputs.resolving import resolve
    from walkers.inputs.schema import CaseFile

    _refuse_old_words(document, source)
    file = validated(CaseFile, document, source)
    try:
        return resolve(file, name).read_from(document)
    except ArithmeticError as error:
        raise InputError(source, [Problem("", None, f"inconsistent values: {error}")]) from error
    except UnusableKeyError as unusable:
        parts = re.findall(r"[^.\[\]]+", unusable.key)
        value = quoted(document, [int(part) if part.isdigit() else part for part in parts])
        raise InputError(source, [Problem(unusable.key, value, unusable.expected)]) from unusable


_OLD_WORDS = {
    "kind": "there are no kinds any more: [boundary] says where the beads are (a climber's tilt is 90 deg, a pile's "
    'shape "box" or "cylinder")',
    "substrate": "[substrate] is now [boundary]: its material, and its tilt if it is not level",
    "container": "[container] is now [boundary], with its shape",
    "start": "[start] is part of the bodies now: [dimers] has replicates, facing, angle, gap, spacing; [run] the seed",
    **dict.fromkeys(
        ("beads.radii", "beads.mean_radius", "beads.sin_delta"),
        "[beads] says what beads are made of; the radii of dimers are in [dimers]",
    ),
    **dict.fromkeys(
        ("beads.small", "beads.large", "beads.count", "beads.fill_height", "beads.small_share", "beads.mixed_by"),
        "[beads] says what beads are made of; what is poured is a [mixture]",
    ),
    "beads.placed": "[[beads.placed]] is now [[placed]]",
}


def _refuse_old_words(document: Mapping[str, Any], source: str) -> None:
    """Say what the words of older case files are called now."""
    from walkers.inputs.messages import quoted

    problems = []
    for key, told in _OLD_WORDS.items():
        table, _, name = key.rpartition(".")
        within = document.get(table, {}) if table else document
        if isinstance(within, Mapping) and name in within:
            problems.append(Problem(key, quoted(document, key.split(".")), told))
    if problems:
        raise InputError(source, problems)
