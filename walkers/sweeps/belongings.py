"""What a sweep's directory holds that was written by the project, and what is somebody's own."""

from __future__ import annotations

from pathlib import Path

from walkers.sweeps.columns import derived_columns, result_columns
from walkers.sweeps.inventory import weigh
from walkers.sweeps.record import RECORD_NAME, read_record

PARSL = "parsl"
_REPORT = "report.html"
_MARK = b"granular-walkers"
"""In every report and figure that the project writes."""


def own_files(directory: Path) -> list[Path]:
    """What the project wrote into a sweep's directory: the record, Parsl's logs, report and figures of default names.

    Parameters
    ----------
    directory
        Of the sweep.

    Raises
    ------
    InputError
        If its record cannot be read.
    """
    record = read_record(directory)
    columns = {*record.units, *derived_columns(record.analyses), *result_columns(record.analyses)}
    pages = [path for path in sorted(directory.iterdir()) if path.name == _REPORT or _is_figure(path, columns)]
    found = [directory / RECORD_NAME, directory / PARSL, *(path for path in pages if _is_marked(path))]
    return [path for path in found if path.exists() or path.is_symlink()]


def others(directory: Path) -> list[Path]:
    """What else there is in a sweep's directory."""
    return sorted(set(directory.iterdir()) - set(own_files(directory)))


def bytes_of(path: Path) -> int:
    """Of a file, or of all files in a directory; a symbolic link has none."""
    if path.is_symlink():
        return 0
    return weigh(path)[0] if path.is_dir() else path.stat().st_size


def _is_figure(path: Path, columns: set[str]) -> bool:
    return path.suffix == ".png" and path.name.removesuffix(".png") in columns


def _is_marked(path: Path) -> bool:
    return path.is_file() and not path.is_symlink() and _MARK in path.read_bytes()
