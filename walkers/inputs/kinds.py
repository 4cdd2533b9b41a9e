"""What kind of input a name or a file is, for whoever gave one kind where another was expected."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Literal

from walkers.inputs.errors import InputError, Problem

Kind = Literal["case", "sweep", "calibration"]
_COMMANDS = {
    "case": "a case: walkers run {}",
    "sweep": "a sweep: walkers sweep {}",
    "calibration": "a calibration: walkers calibrate {}",
    "run": "a run's directory: walkers result {}, or plot, render, vtk",
    "made sweep": "a sweep's directory: walkers table {}, or plot, status; its file goes to walkers sweep",
}
_OF_CASES = ("beads", "boundary", "drive", "liquid")
_OF_CALIBRATIONS = ("parameters", "experiments", "observations")


def check_kind(name: str | Path, wanted: Kind) -> None:
    """Refuse what is known to be another kind of input than is wanted.

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
    with suppress(OSError):
        if path.is_dir():
            known = {"sweep.json": "made sweep", "manifest.json": "run", "case.json": "run"}
            return next((kind for file, kind in known.items() if (path / file).is_file()), None)
        if path.is_file():
            return None if path.stem in (".", "..") else _kind_of_file(path)  # refused for its name
    from walkers.inputs.calibration import shipped_calibrations
    from walkers.inputs.reading import shipped_cases
    from walkers.inputs.sweep import shipped_sweeps

    shipped = {"case": shipped_cases, "sweep": shipped_sweeps, "calibration": shipped_calibrations}
    return next((kind for kind, names in shipped.items() if str(name) in names()), None)


def _kind_of_file(path: Path) -> str | None:
    from walkers.inputs.reading import read_toml

    with suppress(InputError):
        document = read_toml(path)
        if any(table in document for table in _OF_CASES):
            return "case"
        if "case" in document:
            return "calibration" if any(table in document for table in _OF_CALIBRATIONS) else "sweep"
    return None
