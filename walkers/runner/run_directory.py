"""Run directories: one per run, named by the case and a hash of everything that determines the run.

A run is made in ``<name>-<hash>.incomplete``. Its manifest is written last, then the directory is
renamed to ``<name>-<hash>``: a directory without a manifest is not a finished run, and a repeated
run replaces the old one only when it has finished. Input and output of the engine are in
``segments/0000``, ``segments/0001``, …; walkers have one segment unless their case asks for more.

During the run, the file ``<name>-<hash>.lock`` is locked with ``flock``. Engines inherit the lock:
an engine that outlives its launcher keeps other processes away from its directory until the kernel
ends it, within moments.

The steps in which a run is made are in `walkers.runs.making`.
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
"""The resolved case."""
LAW_NAME = "law.py"
"""Copy of the file of a user's law."""
FAILURE_NAME = "failure.json"
"""The failure of the last attempt, in the directory of an unfinished run."""
REQUESTED_NAME = "requested"
"""Note of a run that was asked for by itself (`mark_as_requested`)."""
SEGMENTS = "segments"
"""Folder of the segments."""
FIRST_SEGMENT = Path(SEGMENTS) / "0000"
"""The first segment within a run directory."""
SEGMENT_NAME = "segment.json"
"""Steps and cost of a segment, in its folder."""
DECK_RECORD_NAME = "deck.json"
"""File beside a deck to be run by hand: the case and the text of the deck as written."""
UNFINISHED = ".incomplete"
"""End of the name of the directory in which a run is made."""
REPLACED = ".replaced"
"""End of the name of a run directory while it is replaced."""
_LONGEST_NAME = 80
"""Largest number of letters of the name of a case in the name of its run."""
_LOOK_SECONDS = 0.01
"""Time between two looks at a lock."""
_PATIENCE_SECONDS = 2.0
"""Waiting time for a lock: engines whose launcher was killed end within a fraction of a second."""


# --- names ----------------------------------------------------------------------------------------


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
    """The final directory of a run.

    Its name is that of the case, and 12 hexadecimal digits of a hash of the case, the engine, the
    file of a user's law, and the versions of decks and run directories. The text of the deck is not
    hashed, so that a comment in a template does not rename runs.

    Parameters
    ----------
    case
        The case.
    engine
        The engine.
    out
        The folder of runs.
    """
    determinants = {
        "case": case.determinants(),
        "deck": CONTENT_VERSION,
        "engine": engine.sha256,
        "format": FORMAT,
    }
    law_sha256 = _sha256_of_law(case)
    if law_sha256:
        determinants["law"] = law_sha256
    text = json.dumps(determinants, sort_keys=True, separators=(",", ":"))
    digest = hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
    return out / f"{name_of(case.name)}-{digest[:12]}"


def _sha256_of_law(case: Case) -> str | None:
    """SHA-256 of the file of a user's law; None for a built-in law."""
    if case.recorded_law:
        sha256: str | None = case.recorded_law.sha256
        return sha256
    return source_sha256(case.liquid.law)


def name_of(case_name: str) -> str:
    """The name of a case as the names of its runs begin: without spaces and odd letters."""
    return re.sub(r"[^\w.+-]+", "_", case_name)[:_LONGEST_NAME]


def is_run_name(name: str) -> bool:
    """Whether a name can be that of a run directory: it ends in twelve hexadecimal digits."""
    return re.fullmatch(r".+-[0-9a-f]{12}", name) is not None


def unfinished(place: Path) -> Path:
    """The directory in which a run is made, for its final directory."""
    return place.with_name(place.name + UNFINISHED)


def holds_unfinished(directory: Path) -> bool:
    """Whether a directory has an unfinished run.

    It contains a case, or nothing but files that are written earlier.
    """
    try:
        names = {path.name for path in directory.iterdir()}
    except OSError:  # unreadable
        return False
    return CASE_NAME in names or all(_is_written_before_case(name) for name in names)


def _is_written_before_case(name: str) -> bool:
    """Whether a file may exist before the case does; ``.case.…`` is the case being written."""
    return name in (SEGMENTS, FAILURE_NAME) or name.startswith(".case.")


# --- reading --------------------------------------------------------------------------------------


def case_of(directory: Path) -> Case:
    """The resolved case of a run directory.

    Raises
    ------
    OSError, ValueError
        If the case is unreadable, or its file has changed (`walkers.runner.manifest.FileChanged`).
    """
    status = (directory / CASE_NAME).stat()
    identity = (status.st_ino, status.st_mtime_ns, status.st_size)
    case = _case_in(directory.resolve(), identity)
    return with_recorded_law(case, directory)


@lru_cache(maxsize=4)
def _case_in(directory: Path, _identity: tuple[int, ...]) -> Case:
    """The case of a directory, which is read once as long as its file stays the same."""
    check_unchanged(directory, [CASE_NAME])
    return stored_case(read_json(directory / CASE_NAME))


def with_recorded_law(case: Case, directory: Path) -> Case:
    """A case with the bridges of a user's law as a run directory has recorded them.

    The user's file is not executed. Cases with a built-in law stay as they are.
    """
    if case.liquid.law in LAWS:
        return case
    from walkers.templates.bridge_tables import RecordedLaw

    tables = ""
    for place in (directory, *segment_directories(directory)):
        file = place / BRIDGES_NAME
        if file.is_file():
            check_unchanged(directory, [file.relative_to(directory).as_posix()])
            tables = file.read_text("utf-8")
            break
    source = None
    if (directory / LAW_NAME).is_file():
        check_unchanged(directory, [LAW_NAME])
        source = (directory / LAW_NAME).read_bytes()
    return case.with_values(recorded_law=RecordedLaw(tables, source))


def write_case(directory: Path, case: Case) -> None:
    """Write the resolved case of a run; for a user's law also its file and its bridge tables."""
    write_json(directory / CASE_NAME, case.as_dict(), sync=False)
    if case.liquid.law in LAWS:
        return
    surface = (case.contact, case.liquid.of_bridges)
    tables = bridge_tables_of(case, [surface], {(1, radius) for radius in case.radii})
    write_bytes(directory / BRIDGES_NAME, tables.encode("utf-8"), sync=False)
    source = _source_of_law(case)
    if source is not None:
        write_bytes(directory / LAW_NAME, source, sync=False)


def _source_of_law(case: Case) -> bytes | None:
    """Contents of the file of a user's law; None if the law was recorded without its file."""
    if case.recorded_law:
        source: bytes | None = getattr(case.recorded_law, "source", None)
        return source
    file = source_of(case.liquid.law)
    return file.read_bytes() if file else None


def read_layout(segment: Path) -> DeckLayout:
    """Layout of the dumps of a segment.

    Raises `OSError`, `ValueError`, `KeyError` or `TypeError` if it is unreadable.
    """
    return DeckLayout(**read_json(segment / LAYOUT_NAME))


def segment_directories(directory: Path) -> list[Path]:
    """The complete segments of a run, in order.

    For a deck that was run by hand, that is the directory itself. Segments that are not complete
    have a suffix.
    """
    segments = sorted(path for path in (directory / SEGMENTS).glob("[0-9]*") if not path.suffix)
    if not segments and (directory / SEGMENT_NAME).is_file():
        return [directory]
    return segments


def run_of_segment(segment: Path) -> Path:
    """The run directory of a segment; of a deck that was run by hand, the directory itself."""
    if segment.parent.name == SEGMENTS:
        return segment.parent.parent
    return segment


def files_of_segments(directory: Path) -> list[str]:
    """Input and output files of the engine for a run, as paths within its directory."""
    segments = segment_directories(directory)
    if segments == [directory]:  # run by hand: tables and pictures are in the same folder
        return [name for name in read_layout(directory).dumps if (directory / name).is_file()]
    names = []
    for segment in segments:
        files = [path for path in segment.iterdir() if path.is_file()]
        names += [path.relative_to(directory).as_posix() for path in files]
    return names


def leave_out_dumps(directory: Path) -> None:
    """Remove dumps, restart files and tables of bridges of a finished run.

    The run must be locked (`locked`). Its manifest lists what was left out.
    """
    contents = read_manifest(directory)
    dumps = {*read_layout(segment_directories(directory)[0]).dumps, RESTART_NAME, BRIDGES_NAME}
    names = [name for name in contents["files"] if "/" in name and Path(name).name in dumps]
    write_json(directory / MANIFEST_NAME, {**contents, "left_out": names})
    for name in names:
        (directory / name).unlink(missing_ok=True)


def is_deck_folder(folder: Path) -> bool:
    """Whether a folder contains a deck to be run by hand."""
    return (folder / DECK_RECORD_NAME).is_file() and (folder / DECK_NAME).is_file()


def mark_as_requested(directory: Path) -> None:
    """Note in a finished run that it was asked for by itself, not only as a point of a sweep.

    Nothing is written if the folder cannot be written, as in an archive: listings alone read it.
    """
    note = directory / REQUESTED_NAME
    if not note.exists():
        with suppress(OSError):
            write_bytes(note, b"walkers list shows this run: it was asked for by itself\n")


def is_requested(directory: Path) -> bool:
    """Whether a run was asked for by itself."""
    return (directory / REQUESTED_NAME).is_file()


def is_finished(directory: Path) -> bool:
    """Whether a directory has a finished run, that is a manifest."""
    return (directory / MANIFEST_NAME).is_file()


def drive_from(case: Case, done: Iterable[Mapping[str, Any]]) -> int | None:
    """Step at which the drive begins: the end of the first segment that leaves the beads at rest.

    The drive also begins if the beads do not rest within ``run.longest_settling``. It begins at
    step 0 if the case does not let the beads come to rest before.

    Parameters
    ----------
    case
        The case of the run.
    done
        Records of its complete segments, in order.

    Returns
    -------
    int or None
        The step; None if the beads do not rest yet.
    """
    settled_below = case.run.settled_below
    longest_settling = case.run.longest_settling
    if settled_below is None or longest_settling is None:  # the beads do not rest before the drive
        return 0
    for segment in done:
        if segment["drive_from"] is not None:
            return int(segment["drive_from"])
        at_rest = segment["root_mean_square_velocity"] < settled_below
        if at_rest or segment["end"] * case.run.time_step >= longest_settling:
            return int(segment["end"])
    return None


# --- writing --------------------------------------------------------------------------------------


def write_deck(deck: Deck, directory: Path, before: Path | None = None) -> None:
    """Write a deck, its files and its layout into a directory.

    Parameters
    ----------
    deck
        The deck.
    directory
        The folder of the new segment.
    before
        The folder of the segment before, from which files with the same contents are linked; None:
        there is none.
    """
    for name, text in {DECK_NAME: deck.text, **deck.files}.items():
        contents = text.encode("utf-8", "surrogateescape")
        if before is not None and _has_contents(before / name, contents):
            link_or_copy(before / name, directory / name)
        else:
            (directory / name).write_bytes(contents)
    write_json(directory / LAYOUT_NAME, deck.layout.as_dict(), sync=False)


def _has_contents(file: Path, contents: bytes) -> bool:
    """Whether a file exists and has these contents."""
    return file.is_file() and file.read_bytes() == contents


def write_segment_record(
    directory: Path,
    segment: Segment,
    report: EngineReport,
    rms_velocity: float | None = None,
    by_hand: ByHand | None = None,
) -> dict[str, Any]:
    """Write the steps and the cost of a segment into its directory.

    Parameters
    ----------
    directory
        Folder of the segment.
    segment
        Its steps.
    report
        What the engine reported.
    rms_velocity
        Root mean square velocity of the beads at the end, m/s; None if the engine did not print it.
    by_hand
        What the record tells of a run by hand; None for other runs.

    Returns
    -------
    dict
        The record.
    """
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
        # The directory may still exist: somebody may be removing it, file by file.
        missing = Path(error.filename or "").absolute()
        if error.errno == errno.ENOENT and missing.is_relative_to(incomplete.absolute()):
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
        # The case file of an unpacked archive may be the file that was run.
        for case_file in place.glob("*.toml"):
            if not (complete / case_file.name).exists():
                link_or_copy(case_file, complete / case_file.name)
        place.rename(replaced)
    complete.rename(place)
    fsync_path(place.parent)
    shutil.rmtree(replaced, ignore_errors=True)


def recover(place: Path) -> None:
    """Mend a replacement that was interrupted (`move_into_place`).

    If it was interrupted between its two renames, the old run returns to its place; if after them,
    the old run is removed.
    """
    replaced = place.with_name(place.name + REPLACED)
    if not place.exists() and replaced.exists():
        replaced.rename(place)
    elif replaced.exists():
        shutil.rmtree(replaced)


# --- locks ----------------------------------------------------------------------------------------


def _lock_file(place: Path) -> Path:
    """The file that is locked while the run of a place is made."""
    return place.with_name(f"{place.name}.lock")


@contextmanager
def locked(places: Iterable[Path]) -> Iterator[Mapping[Path, int]]:
    """Lock places of runs.

    Parameters
    ----------
    places
        Final directories of runs.

    Yields
    ------
    dict
        File descriptors of the locks by place. Places that another process still has locked after
        `_PATIENCE_SECONDS` are left out.

    Raises
    ------
    InputError
        If the file system has no locks.
    """
    descriptors: dict[Path, int] = {}
    deadline = time.monotonic() + _PATIENCE_SECONDS
    try:
        # Sorted, so that one of two processes that lock the same places gets all of them, instead
        # of each process a part.
        for place in sorted(set(places)):
            descriptor = _lock(_lock_file(place), deadline)
            if descriptor is not None:
                descriptors[place] = descriptor
        yield descriptors
    finally:
        for place, descriptor in descriptors.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


@contextmanager
def recomputed(directory: Path, names: Collection[str]) -> Iterator[None]:
    """Record in the manifest of a finished run that a ``with`` block recomputes files.

    During the block, a finished run is locked, and its manifest has no checksums of the files: if
    the process is killed, or the block raises an error, half-written files are not reported as
    damaged. After the block, the manifest has their checksums and sizes, and under ``tabulated``
    the program and the time.

    Parameters
    ----------
    directory
        The run directory; without a manifest, nothing is locked or recorded.
    names
        Paths of the files within the directory.

    Raises
    ------
    RunBusy
        If another process has locked the run.
    """
    if not is_finished(directory):
        yield
        return
    place = directory.resolve()
    with locked([place]) as descriptors:
        if not descriptors:
            raise RunBusy("another process is measuring this run", directory)
        contents = read_manifest(directory)
        sums = sums_of(contents, directory)  # a part of the contents, which changes with them
        removed = [sums.pop(name, None) for name in names]
        if any(removed):
            write_json(directory / MANIFEST_NAME, contents)
        yield
        sums |= checksums(directory, names)
        sizes = {name: (directory / name).stat().st_size for name in names}
        contents.setdefault("files", {}).update(sizes)
        contents["tabulated"] = {**software(), "date": iso_time(time.time()), "files": list(names)}
        write_json(directory / MANIFEST_NAME, contents)


def _lock(file: Path, deadline: float) -> int | None:
    """Lock a file that other processes may be removing.

    The lock counts only if the file still has the name. Raises `InputError` if the file system has
    no locks.

    Parameters
    ----------
    file
        The file, which is made if it does not exist.
    deadline
        Time until which to wait, s of the monotonic clock.

    Returns
    -------
    int or None
        The file descriptor; None if another process holds the lock until the deadline.
    """
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), file.stat()):
                    return descriptor
        except BlockingIOError:
            if time.monotonic() > deadline:
                os.close(descriptor)
                return None
            time.sleep(_LOOK_SECONDS)
        except OSError as error:
            os.close(descriptor)
            file.unlink(missing_ok=True)
            message = (
                f"files cannot be locked ({error.strerror}): expected a folder on a file system "
                "with locks (flock); choose another one with --runs, or out= in Python"
            )
            raise input_error(file.parent, message) from error
        os.close(descriptor)


def is_locked(place: Path) -> bool:
    """Whether a process is making the run of a place.

    False on a file system without locks, on which no run can be made.
    """
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
