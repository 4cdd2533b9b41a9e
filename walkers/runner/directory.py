"""Run directories: one per run, named by the case and a hash of everything that determines the run.

A run is made in ``<name>-<hash>.incomplete`` and renamed to ``<name>-<hash>`` when its manifest has been written, last:
a directory without a manifest is not a run, and a run that is made anew replaces the old one only when it has finished.
Input and output of the engine are in ``segments/0000``, ``segments/0001``, …; walkers have one unless their case
asks for more.

While it is made, the file ``<name>-<hash>.lock`` is locked. The lock is the kernel's (``flock``): it ends with the last
process that has the file open, however that ends. Engines inherit it, so that one which outlives its launcher keeps
others away from the directory that it writes into. It does so for moments only, for the kernel ends it with its
launcher: whoever meets a lock waits that long.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import re
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.physics.laws import source_sha256
from walkers.runner.binary import Engine
from walkers.runner.failures import DiskFull, OutputGone
from walkers.runner.files import fsync_path, link_or_copy, read_json, write_json
from walkers.runner.launch import EngineReport
from walkers.runner.manifest import FORMAT, MANIFEST_NAME, check_unchanged
from walkers.templates.deck import CONTENT_VERSION, DECK_NAME, LAYOUT_NAME, Deck, Segment
from walkers.templates.layout import Layout

CASE_NAME = "case.json"
FAILURE_NAME = "failure.json"
SEGMENTS = "segments"
FIRST_SEGMENT = Path(SEGMENTS) / "0000"
SEGMENT_NAME = "segment.json"
DECK_RECORD_NAME = "deck.json"
"""In the folder of a deck to be run by hand: its case and its text as they were written."""
UNFINISHED = ".incomplete"
REPLACED = ".replaced"
_LONGEST_NAME = 80
_LOOK_SECONDS = 0.01
_PATIENCE_SECONDS = 2.0
"""Before locks are taken for another's: engines whose launcher was killed end within a fraction of a second."""


# --- names ------------------------------------------------------------------------------------------------------------


def run_name(case: Case, engine: Engine) -> str:
    """Name of a run's directory: the case's name and 12 hex digits over resolved case, engine and the decks' version.

    The wording of a deck is not among it: a comment in a template leaves the runs that are there. The file of a law of
    the user's own is.
    """
    determinants = {"case": case.determinants(), "deck": CONTENT_VERSION, "engine": engine.sha256, "format": FORMAT}
    if own := source_sha256(case.liquid.law):
        determinants["law"] = own
    text = json.dumps(determinants, sort_keys=True, separators=(",", ":"))
    return f"{name_of(case.name)}-{hashlib.sha256(text.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"


def name_of(case_name: str) -> str:
    """A case's name as a run's begins with it."""
    return re.sub(r"[^\w.+-]+", "_", case_name)[:_LONGEST_NAME]


def is_run_name(name: str) -> bool:
    """Whether a directory may be a run's by its name: twelve hex digits at the end."""
    return re.fullmatch(r".+-[0-9a-f]{12}", name) is not None


def run_place(case: Case, engine: Engine, out: Path) -> Path:
    """Where the run of a case belongs."""
    return out / run_name(case, engine)


def unfinished(place: Path) -> Path:
    """Where the run of a place is made."""
    return place.with_name(place.name + UNFINISHED)


def holds_unfinished(directory: Path) -> bool:
    """Whether a directory has what that of an unfinished run has: its case, or nothing but what is there before it."""
    try:
        names = {path.name for path in directory.iterdir()}
    except OSError:  # not ours to read
        return False
    return CASE_NAME in names or all(name in (SEGMENTS, FAILURE_NAME) or name.startswith(".case.") for name in names)


# --- reading ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FinishedRun:
    """A run that has its manifest: its directory, and what that holds."""

    directory: Path

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest."""
        return read_json(self.directory / MANIFEST_NAME)

    @property
    def case(self) -> Case:
        """The resolved case."""
        return case_of(self.directory)

    @property
    def segments(self) -> list[Path]:
        """Directories of the segments, in their order."""
        return segment_directories(self.directory)

    @property
    def layout(self) -> Layout:
        """What the dumps of the first segment hold."""
        return layout_of(self.segments[0])


def case_of(directory: Path) -> Case:
    """The resolved case of a run directory; `OSError`, `ValueError` if it cannot be read, or was changed since."""
    check_unchanged(directory, [CASE_NAME])
    return Case.from_dict(read_json(directory / CASE_NAME))


def layout_of(segment: Path) -> Layout:
    """What the dumps of a segment hold; `OSError`, `ValueError`, `KeyError`, `TypeError` if it cannot be read."""
    return Layout.from_dict(read_json(segment / LAYOUT_NAME))


def segment_directories(directory: Path) -> list[Path]:
    """The whole segments of a run, in their order; that of a deck that was run by hand is the directory itself."""
    found = sorted(path for path in (directory / SEGMENTS).glob("[0-9]*") if not path.suffix)
    return found or ([directory] if (directory / SEGMENT_NAME).is_file() else [])


def run_of(segment: Path) -> Path:
    """The run directory that a segment is of."""
    return segment.parent.parent if segment.parent.name == SEGMENTS else segment


def files_of_segments(directory: Path) -> list[str]:
    """Input and output files of the engine for a run, as paths within its directory."""
    found = [path for segment in segment_directories(directory) for path in segment.iterdir() if path.is_file()]
    layouts = (layout_of(segment) for segment in segment_directories(directory)[:1])
    dumps = {name for one in layouts for name in (one.bead_dump, one.pair_bridge_dump, one.wall_bridge_dump)}
    by_hand = [directory] == segment_directories(directory)  # with tables and pictures beside
    return [path.relative_to(directory).as_posix() for path in found if not by_hand or path.name in dumps]


def is_deck_folder(folder: Path) -> bool:
    """Whether a deck to be run by hand was written into a folder."""
    return (folder / DECK_RECORD_NAME).is_file() and (folder / DECK_NAME).is_file()


def finished_run(directory: Path) -> FinishedRun | None:
    """The run in a directory, or None if it has no manifest."""
    return FinishedRun(directory) if (directory / MANIFEST_NAME).is_file() else None


def finished_places(out: Path) -> dict[str, Path]:
    """All finished runs of a folder: from their names to their directories."""
    places = [path.parent for path in sorted(out.glob(f"*/{MANIFEST_NAME}"))]
    return {place.name: place for place in places if not place.name.endswith((UNFINISHED, REPLACED))}


def drive_from(case: Case, done: Iterable[Mapping[str, Any]]) -> int | None:
    """Step at which the drive begins, given the records of the segments that are whole; None if that is not known yet.

    It is the end of the first segment that leaves the beads at rest, or that is the last in which they may come to it.
    """
    if not case.run.rests:
        return 0
    for segment in done:
        if segment["drive_from"] is not None:
            return int(segment["drive_from"])
        at_rest = segment["root_mean_square_velocity"] < case.run.settled_below
        if at_rest or segment["end"] * case.run.time_step >= case.run.longest_settling:
            return int(segment["end"])
    return None


# --- writing ----------------------------------------------------------------------------------------------------------


def write_deck(deck: Deck, directory: Path, before: Path | None = None) -> None:
    """Write a deck, its files and its layout into a directory.

    A file that is the same in that of the segment ``before`` is linked to: the tables of a pile's bridges are larger
    than what a segment of it computes.
    """
    for name, text in {DECK_NAME: deck.text, **deck.files}.items():
        contents = text.encode("utf-8", "surrogateescape")
        if before is not None and (before / name).is_file() and (before / name).read_bytes() == contents:
            link_or_copy(before / name, directory / name)
        else:
            (directory / name).write_bytes(contents)
    write_json(directory / LAYOUT_NAME, deck.layout.as_dict(), at_once=False)


def write_segment_record(
    directory: Path, segment: Segment, report: EngineReport, rms_velocity: float | None = None
) -> dict[str, Any]:
    """Write what a segment is and what it took into its directory, and return it."""
    record = {**vars(segment), **vars(report), "root_mean_square_velocity": rms_velocity}
    write_json(directory / SEGMENT_NAME, record, at_once=False)
    return record


@contextmanager
def room_on_disk(incomplete: Path, needed: int | None = None) -> Iterator[None]:
    """Turn the system's word for a full disk, to which so many bytes are still to be written, into a `DiskFull`.

    And that for a directory that was removed into an `OutputGone`.
    """
    try:
        yield
    except OSError as error:
        if error.errno == errno.ENOENT and not incomplete.exists():
            raise OutputGone(incomplete) from error
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise DiskFull(needed, shutil.disk_usage(incomplete.parent).free, incomplete) from error


def move_into_place(made: Path, place: Path) -> None:
    """Give a directory that has been made, and is safe on disk, its name, in exchange for one that has it already."""
    recover(place)
    replaced = place.with_name(place.name + REPLACED)
    if place.exists():
        place.rename(replaced)
    made.rename(place)
    fsync_path(place.parent)
    shutil.rmtree(replaced, ignore_errors=True)


def recover(place: Path) -> None:
    """Undo a replacement that was interrupted between its two renames; end one that was interrupted after them."""
    replaced = place.with_name(place.name + REPLACED)
    if not place.exists() and replaced.exists():
        replaced.rename(place)
    elif replaced.exists():
        shutil.rmtree(replaced)


# --- locks ------------------------------------------------------------------------------------------------------------


def _lock_file(place: Path) -> Path:
    return place.with_name(f"{place.name}.lock")


@contextmanager
def locked(places: Iterable[Path]) -> Iterator[Mapping[Path, int]]:
    """Lock those of the final places of runs that nobody else has locked, two seconds later at the latest.

    Yields those that are ours until the end of the block, with the descriptors of their lock files.
    """
    ours: dict[Path, int] = {}
    end = time.monotonic() + _PATIENCE_SECONDS
    try:
        # In the order of their names, so that of two who want the same places one gets them rather than each a half.
        for place in sorted(set(places)):
            if (descriptor := _lock(_lock_file(place), end)) is not None:
                ours[place] = descriptor
        yield ours
    finally:
        for place, descriptor in ours.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


def _lock(file: Path, end: float) -> int | None:
    """Lock a file that others may be removing at this moment: the lock counts only on the file that has the name."""
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), file.stat()):
                    os.ftruncate(descriptor, 0)  # nobody has asked us to stop
                    return descriptor
        except BlockingIOError:
            if time.monotonic() > end:
                os.close(descriptor)
                return None
            time.sleep(_LOOK_SECONDS)
        os.close(descriptor)


def is_locked(place: Path) -> bool:
    """Whether a process is making the run of this place."""
    try:
        with _lock_file(place).open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def ask_to_stop(place: Path) -> None:
    """Ask the process that makes a run to stop, by a word in the lock file."""
    if is_locked(place):
        with suppress(FileNotFoundError), _lock_file(place).open("r+b") as file:
            file.write(b"stop")


def is_to_stop(descriptor: int) -> bool:
    """Whether a stop of the run with this open lock file was requested."""
    return os.fstat(descriptor).st_size > 0
