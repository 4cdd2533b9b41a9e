"""Whether a run, the runs of a sweep, or an archive are what they were."""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO

from walkers.inputs.errors import InputError, Problem
from walkers.runner.ensemble import FOLDER
from walkers.runner.manifest import MANIFEST_NAME, checksum
from walkers.runner.verification import Verification, verify_run
from walkers.sweeps.record import RECORD_NAME, read_record, states

SUMS_NAME = "sha256sums.txt"
"""In an archive: as ``sha256sum -c`` reads it."""


def verify(path: Path) -> list[Verification]:
    """Compare files with what manifests, or the checksums of an archive, say of them.

    Parameters
    ----------
    path
        A run directory, a sweep's directory, an archive (.zip), or a folder that one was unpacked into.

    Returns
    -------
    list of Verification
        One a run or archive; of a sweep that of its points, those of its finished runs and of the decks that they
        shared.

    Raises
    ------
    InputError
        If it is none of these, or cannot be read.
    """
    if path.is_dir():
        if (path / RECORD_NAME).is_file():
            return _verify_sweep(path)
        if (path / SUMS_NAME).is_file():
            return [_verify_unpacked(path)]
        if (path / MANIFEST_NAME).is_file():
            return [verify_run(path)]
    elif path.is_file():
        return [_verify_zip(path)]
    told = f"expected a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), or an archive ({SUMS_NAME})"
    raise InputError(str(path), [Problem("", None, told)])


def _verify_sweep(directory: Path) -> list[Verification]:
    record = read_record(directory)
    found = states(record)
    lacking = [
        f"{run} ({state.status}: point {number})"
        for number, (run, state) in enumerate(zip(record.runs, found, strict=True))
        if state.status not in ("finished", "not needed")
    ]
    finished = sum(state.status == "finished" for state in found)
    points = Verification(record.name, finished, missing=tuple(lacking), of_points=True)
    runs = list(dict.fromkeys(state.directory for state in found if state.directory and state.status == "finished"))
    decks = dict.fromkeys(run.parent for run in runs if run.parent.parent.name == FOLDER)
    return [points, *(verify_run(deck, own=True) for deck in decks), *(verify_run(run) for run in runs)]


def _verify_unpacked(folder: Path) -> Verification:
    def sum_of(place: str) -> str | None:
        return checksum(folder / place) if (folder / place).is_file() else None

    try:
        return _compared(folder.resolve().name, (folder / SUMS_NAME).read_bytes(), sum_of)
    except (OSError, ValueError) as error:
        raise InputError(str(folder), [Problem("", None, f"cannot be read ({error})")]) from error


def _verify_zip(path: Path) -> Verification:
    try:
        with zipfile.ZipFile(path) as archive:
            there = set(archive.namelist())

            def sum_of(place: str) -> str | None:
                if place not in there:
                    return None
                try:
                    with archive.open(place) as file:
                        return _digest(file)
                except (zipfile.BadZipFile, zlib.error, EOFError):  # its own check failed
                    return ""

            return _compared(path.name, archive.read(SUMS_NAME), sum_of)
    except KeyError as error:
        raise InputError(str(path), [Problem("", None, f"no archive of runs: it has no {SUMS_NAME}")]) from error
    except (OSError, ValueError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(str(path), [Problem("", None, f"not a zip file that can be read ({error})")]) from error


def _digest(file: IO[bytes]) -> str:
    digest = hashlib.sha256()
    while chunk := file.read(1 << 20):
        digest.update(chunk)
    return digest.hexdigest()


def _compared(name: str, listing: bytes, sum_of: Callable[[str], str | None]) -> Verification:
    wanted = {}
    for line in listing.decode("utf-8").splitlines():
        one, _, place = line.partition("  ")
        if not place or Path(place).is_absolute() or ".." in Path(place).parts:
            raise ValueError(f"{SUMS_NAME}: expected a checksum and a path in {line[:80]!r}")
        wanted[place] = one
    now = {place: sum_of(place) for place in wanted}
    missing = tuple(place for place, one in now.items() if one is None)
    changed = tuple(place for place, one in now.items() if one is not None and one != wanted[place])
    return Verification(name, len(wanted) - len(missing) - len(changed), changed, missing)
