"""Run directories: one per run, named by the case and a hash of everything that determines the run.

A run is made in ``<name>-<hash>.incomplete``. Its manifest is written last, then the directory is renamed to
``<name>-<hash>``: a directory without a manifest is not a finished run, and a repeated run replaces the old one only
when it has finished. Input and output of the engine are in ``segments/0000``, ``segments/0001``, …; walkers have one
segment unless their case asks for more.

During the run, the file ``<name>-<hash>.lock`` is locked with ``flock``. Engines inherit the lock: an engine that
outlives its launcher keeps other processes away from its directory until the kernel ends it, within moments.
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
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from walkers.errors import input_error
from walkers.files import fsync_path, link_or_copy, open_regular, read_json, write_bytes, write_json
from walkers.inputs.bridge_laws import source_of, source_sha256
from walkers.inputs.case_building import stored_case
from walkers.inputs.tables.case import Case
from walkers.physics.laws import LAWS
from walkers.runner.binary import Engine
from walkers.runner.failures import DiskFull, FileTooLarge, OutputGone, RunBusy
from walkers.runner.launch import EngineReport
from walkers.runner.manifest import (
    FORMAT,
    MANIFEST_NAME,
    check_unchanged,
    checksums,
    iso_time,
    read_manifest,
    sums_of,
)
from walkers.runner.provenance import software
from walkers.templates.deck import (
    BRIDGES_NAME,
    CONTENT_VERSION,
    DECK_NAME,
    LAYOUT_NAME,
    RESTART_NAME,
    Deck,
    Segment,
    bridge_tables_of,
)
from walkers.templates.layout import DeckLayout

CASE_NAME = "case.json"
LAW_NAME = "law.py"
"""Copy of the file of a user's law."""
FAILURE_NAME = "failure.json"
SEGMENTS = "segments"
FIRST_SEGMENT = Path(SEGMENTS) / "0000"
SEGMENT_NAME = "segment.json"
DECK_RECORD_NAME = "deck.json"
"""File beside a deck to be run by hand: the case and the text of the deck as written."""
UNFINISHED = ".incomplete"
REPLACED = ".replaced"
_LONGEST_NAME = 80
_LOOK_SECONDS = 0.01
_PATIENCE_SECONDS = 2.0
"""Waiting time for a lock: engines whose launcher was killed end within a fraction of a second."""


# --- names ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ByHand:
    """What the record of a run tells that was made by hand.

    Attributes
    ----------
    notes
        Sentences for the user about the run.
    deck_edited
        Whether its deck was edited.
    """

    notes: Sequence[str]
    deck_edited: bool


def run_place(case: Case, engine: Engine, out: Path) -> Path:
    """The final directory of a run: name of the case, and 12 hex digits of a hash of case, engine and version of decks.

    The text of the deck is not hashed (a comment in a template renames no runs); the file of a user's law is.
    """
    determinants = {
        "case": case.determinants(),
        "deck": CONTENT_VERSION,
        "engine": engine.sha256,
        "format": FORMAT,
    }
    if (
        law_sha256 := case.recorded_law.sha256
        if case.recorded_law
        else source_sha256(case.liquid.law)
    ):
        determinants["law"] = law_sha256
    text = json.dumps(determinants, sort_keys=True, separators=(",", ":"))
    return (
        out
        / f"{name_of(case.name)}-{hashlib.sha256(text.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"
    )


def name_of(case_name: str) -> str:
    """The name of a case at the beginning of the name of a run."""
    return re.sub(r"[^\w.+-]+", "_", case_name)[:_LONGEST_NAME]


def is_run_name(name: str) -> bool:
    """Whether a run directory may have a name: it ends in twelve hex digits."""
    return re.fullmatch(r".+-[0-9a-f]{12}", name) is not None


def unfinished(place: Path) -> Path:
    """The directory in which the run of a place is made."""
    return place.with_name(place.name + UNFINISHED)


def holds_unfinished(directory: Path) -> bool:
    """Whether a directory has an unfinished run: it contains a case, or only files that are written earlier."""
    try:
        names = {path.name for path in directory.iterdir()}
    except OSError:  # unreadable
        return False
    return CASE_NAME in names or all(
        name in (SEGMENTS, FAILURE_NAME) or name.startswith(".case.") for name in names
    )


# --- reading ----------------------------------------------------------------------------------------------------------


def case_of(directory: Path) -> Case:
    """The resolved case of a run directory; raises `OSError` or `ValueError` if it is unreadable or was changed."""
    file = (directory / CASE_NAME).stat()
    return with_recorded_law(
        _case_in(directory.resolve(), file.st_ino, file.st_mtime_ns, file.st_size), directory
    )


@lru_cache(maxsize=4)
def _case_in(directory: Path, *_file: int) -> Case:
    """The case in a file, which is read once as long as the file stays the same."""
    check_unchanged(directory, [CASE_NAME])
    return stored_case(read_json(directory / CASE_NAME))


def with_recorded_law(case: Case, directory: Path) -> Case:
    """A case with the bridges of a user's law as a directory has recorded them; the user's file is not executed."""
    if case.liquid.law in LAWS:
        return case
    from walkers.templates.bridge_tables import RecordedLaw

    places = (directory, *segment_directories(directory))
    tables = next(
        (place / BRIDGES_NAME for place in places if (place / BRIDGES_NAME).is_file()), None
    )
    source = directory / LAW_NAME if (directory / LAW_NAME).is_file() else None
    files = [file for file in (tables, source) if file]
    check_unchanged(directory, [file.relative_to(directory).as_posix() for file in files])
    law = RecordedLaw(
        tables.read_text("utf-8") if tables else "", source.read_bytes() if source else None
    )
    return case.with_values(recorded_law=law)


def write_case(directory: Path, case: Case) -> None:
    """Write the resolved case of a run, and of a user's law its file and the tables of its bridges."""
    write_json(directory / CASE_NAME, case.as_dict(), sync=False)
    if case.liquid.law in LAWS:
        return
    tables = bridge_tables_of(
        case, [(case.contact, case.liquid.of_bridges)], {(1, radius) for radius in case.radii}
    )
    write_bytes(directory / BRIDGES_NAME, tables.encode("utf-8"), sync=False)
    file = None if case.recorded_law else source_of(case.liquid.law)
    if (
        source := file.read_bytes() if file else getattr(case.recorded_law, "source", None)
    ) is not None:
        write_bytes(directory / LAW_NAME, source, sync=False)


def read_layout(segment: Path) -> DeckLayout:
    """Layout of the dumps of a segment; raises `OSError`, `ValueError`, `KeyError` or `TypeError` if unreadable."""
    return DeckLayout(**read_json(segment / LAYOUT_NAME))


def segment_directories(directory: Path) -> list[Path]:
    """The complete segments of a run, in order; for a deck that was run by hand, the directory itself."""
    segments = sorted(path for path in (directory / SEGMENTS).glob("[0-9]*") if not path.suffix)
    return segments or ([directory] if (directory / SEGMENT_NAME).is_file() else [])


def run_of_segment(segment: Path) -> Path:
    """The run directory of a segment."""
    return segment.parent.parent if segment.parent.name == SEGMENTS else segment


def files_of_segments(directory: Path) -> list[str]:
    """Input and output files of the engine for a run, as paths within its directory."""
    segments = segment_directories(directory)
    dumps = {name for segment in segments[:1] for name in read_layout(segment).dumps}
    files = [path for segment in segments for path in segment.iterdir() if path.is_file()]
    by_hand = [directory] == segments  # with tables and pictures beside
    return [
        path.relative_to(directory).as_posix()
        for path in files
        if not by_hand or path.name in dumps
    ]


def leave_out_dumps(directory: Path) -> None:
    """Remove dumps, restart files and tables of bridges of a finished run that is locked; its manifest says so."""
    contents = read_manifest(directory)
    dumps = {*read_layout(segment_directories(directory)[0]).dumps, RESTART_NAME, BRIDGES_NAME}
    names = [name for name in contents["files"] if "/" in name and Path(name).name in dumps]
    write_json(directory / MANIFEST_NAME, {**contents, "left_out": names})
    for name in names:
        (directory / name).unlink(missing_ok=True)


def is_deck_folder(folder: Path) -> bool:
    """Whether a folder contains a deck to be run by hand."""
    return (folder / DECK_RECORD_NAME).is_file() and (folder / DECK_NAME).is_file()


def is_finished(directory: Path) -> bool:
    """Whether a directory has a finished run: it has a manifest."""
    return (directory / MANIFEST_NAME).is_file()


def drive_from(case: Case, done: Iterable[Mapping[str, Any]]) -> int | None:
    """Step at which the drive begins: the end of the first segment that leaves the beads at rest; None: unknown yet."""
    settled_below, longest_settling = case.run.settled_below, case.run.longest_settling
    if settled_below is None or longest_settling is None:  # the beads do not rest before the drive
        return 0
    for segment in done:
        if segment["drive_from"] is not None:
            return int(segment["drive_from"])
        at_rest = segment["root_mean_square_velocity"] < settled_below
        if at_rest or segment["end"] * case.run.time_step >= longest_settling:
            return int(segment["end"])
    return None


# --- writing ----------------------------------------------------------------------------------------------------------


def write_deck(deck: Deck, directory: Path, before: Path | None = None) -> None:
    """Write a deck, its files and its layout into a directory; files that are the same in ``before`` are linked."""
    for name, text in {DECK_NAME: deck.text, **deck.files}.items():
        contents = text.encode("utf-8", "surrogateescape")
        if (
            before is not None
            and (before / name).is_file()
            and (before / name).read_bytes() == contents
        ):
            link_or_copy(before / name, directory / name)
        else:
            (directory / name).write_bytes(contents)
    write_json(directory / LAYOUT_NAME, deck.layout.as_dict(), sync=False)


def write_segment_record(
    directory: Path,
    segment: Segment,
    report: EngineReport,
    rms_velocity: float | None = None,
    by_hand: ByHand | None = None,
) -> dict[str, Any]:
    """Write the steps and the cost of a segment into its directory, and return this record."""
    record = {
        **segment._asdict(),
        **vars(report),
        "root_mean_square_velocity": rms_velocity,
    }
    if by_hand is not None:
        record["by_hand"] = list(by_hand.notes)
        record["deck_edited"] = by_hand.deck_edited
    write_json(directory / SEGMENT_NAME, record, sync=False)
    return record


def has_tables_of(segment: Path, deck: Deck) -> bool:
    """Whether the bridge tables of a complete segment are those of a deck, byte for byte."""
    return (segment / BRIDGES_NAME).read_bytes() == deck.files[BRIDGES_NAME].encode("utf-8")


@contextmanager
def write_errors_as_failures(incomplete: Path, needed: int | None = None) -> Iterator[None]:
    """Turn errors of the system while a run is written into failures of the run.

    Parameters
    ----------
    incomplete
        The directory of the unfinished run.
    needed
        Bytes that are still to be written, for the message; None: unknown.

    Raises
    ------
    DiskFull, FileTooLarge, OutputGone
        For a full disk, a limit of the size of files, and a directory that was removed.
    """
    try:
        yield
    except OSError as error:
        # Whoever removes the directory may not have come to the end.
        if error.errno == errno.ENOENT and Path(error.filename or "").absolute().is_relative_to(
            incomplete.absolute()
        ):
            raise OutputGone(incomplete) from error
        if error.errno == errno.EFBIG:
            raise FileTooLarge(incomplete) from error
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise DiskFull(needed, shutil.disk_usage(incomplete.parent).free, incomplete) from error


def move_into_place(complete: Path, place: Path) -> None:
    """Rename a complete directory to its final place, and replace one that exists there."""
    recover(place)
    replaced = place.with_name(place.name + REPLACED)
    if place.exists():
        for case_file in place.glob(
            "*.toml"
        ):  # of an unpacked archive: it may be the file that was run
            if not (complete / case_file.name).exists():
                link_or_copy(case_file, complete / case_file.name)
        place.rename(replaced)
    complete.rename(place)
    fsync_path(place.parent)
    shutil.rmtree(replaced, ignore_errors=True)


def recover(place: Path) -> None:
    """Undo a replacement that was interrupted between its two renames; finish one that was interrupted after them."""
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
    """Lock places of runs; yield the descriptors of those that no other process keeps locked for two more seconds."""
    ours: dict[Path, int] = {}
    end = time.monotonic() + _PATIENCE_SECONDS
    try:
        # Sorted, so that one of two processes that want the same places gets all of them, not each process a part.
        for place in sorted(set(places)):
            if (descriptor := _lock(_lock_file(place), end)) is not None:
                ours[place] = descriptor
        yield ours
    finally:
        for place, descriptor in ours.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


@contextmanager
def recomputed(directory: Path, names: Collection[str]) -> Iterator[None]:
    """Record in the manifest of a finished run that the block recomputes files: program, time, checksums.

    During the block the run is locked, and the manifest does not list the files, so that a kill gives no false alarm.
    """
    if not is_finished(directory):
        yield
        return
    place = directory.resolve()
    with locked([place]) as ours:
        if not ours:
            raise RunBusy("another process is measuring this run", directory)
        contents = read_manifest(directory)
        sums = sums_of(contents, directory)
        if [name for name in names if sums.pop(name, None)]:
            write_json(directory / MANIFEST_NAME, contents)
        yield
        sums |= checksums(directory, names)
        contents.setdefault("files", {}).update(
            {name: (directory / name).stat().st_size for name in names}
        )
        contents["tabulated"] = {**software(), "date": iso_time(time.time()), "files": list(names)}
        write_json(directory / MANIFEST_NAME, contents)


def _lock(file: Path, end: float) -> int | None:
    """Lock a file that other processes may be removing: the lock counts only if the file still has the name.

    None if another process holds the lock until ``end``; `InputError` if the file system has no locks.
    """
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), file.stat()):
                    return descriptor
        except BlockingIOError:
            if time.monotonic() > end:
                os.close(descriptor)
                return None
            time.sleep(_LOOK_SECONDS)
        except OSError as error:
            os.close(descriptor)
            file.unlink(missing_ok=True)
            needed = "expected a folder on a file system with locks (flock)"
            advice = "choose another one with --out, or out= in Python"
            message = f"files cannot be locked ({error.strerror}): {needed}; {advice}"
            raise input_error(file.parent, message) from error
        os.close(descriptor)


def is_locked(place: Path) -> bool:
    """Whether a process is making the run of this place; on a file system without locks none can."""
    file = _lock_file(place)
    if not file.is_file():
        return False
    with suppress(FileNotFoundError), open_regular(file) as opened:
        try:
            fcntl.flock(opened, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
    return False
