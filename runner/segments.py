"""Runs made in segments: the pile's, which take long, each segment from a restart file to the next.

A run is made in ``NAME-HASH.incomplete``, its segments in ``segments/0000``, ``segments/0001``, … there. A segment that
is being made is called ``0003.new`` and gets its name when it is whole; an interrupted run goes on after the last one.
Since the segments are the same whether the run was interrupted or not, so is all that comes out of it, bit for bit.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.errors import Stopped, WalkersError
from walkers.inputs.pile import PileCase
from walkers.runner.binary import Engine
from walkers.runner.directory import (
    CASE_NAME,
    FAILURE_NAME,
    MANIFEST_NAME,
    FinishedRun,
    finished_run,
    manifest,
    move_into_place,
    record_failure,
    recover,
    room_on_disk,
    run_place,
    unfinished,
    write_deck,
)
from walkers.runner.failures import RunBusy
from walkers.runner.files import fsync_path, read_json, settle, write_json
from walkers.runner.launch import EngineReport, Progress, launch
from walkers.runner.locks import locked
from walkers.templates.deck import OUTPUT_NAME, Deck
from walkers.templates.pile import PREVIOUS_RESTART_NAME, RESTART_NAME, Segment, render_segment, settling_steps

SEGMENTS = "segments"
SEGMENT_NAME = "segment.json"
_LEAST_BYTES = 150
"""Of a restart file, an atom: whole ones had 300 to 580."""


@dataclass(frozen=True)
class PileProgress:
    """How far a pile is: simulated time and wall time of this call (s), whether it is driven, share of the drive."""

    simulated: float
    elapsed: float
    driven: bool
    share: float


def run_pile(
    case: PileCase,
    engine: Engine,
    out: Path,
    *,
    force: bool = False,
    on_progress: Callable[[PileProgress], None] | None = None,
    time_limit: float | None = None,
) -> tuple[FinishedRun, bool]:
    """Run a pile, or go on with it.

    Parameters
    ----------
    case, engine
        What is run.
    out
        Folder of the run directories; made if need be.
    force
        Begin anew, also if the run is there.
    on_progress
        Called a few times a second.
    time_limit
        Wall time in s for each segment.

    Returns
    -------
    run
        Its segments are in ``segments/``.
    found
        Whether it was there before.

    Raises
    ------
    RunBusy
        If another process is making the same run.
    EngineFailure
        If the engine fails; the segments before stay, and the next call goes on after them.
    """
    place = run_place(case, engine, out)
    out.mkdir(parents=True, exist_ok=True)
    with locked([place]) as ours:
        if place not in ours:
            raise RunBusy(unfinished(place))
        recover(place)
        there = finished_run(place)
        if there is not None and not force:
            return there, True
        made = unfinished(place)
        if force and made.exists():
            shutil.rmtree(made)
        try:
            return _make(_Making(case, engine, made, list(ours.values()), on_progress, time_limit), place), False
        except Stopped:
            raise
        except (WalkersError, OSError) as failure:
            record_failure(made, failure)
            raise


class _Making:
    """A run that is being made or gone on with."""

    def __init__(
        self,
        case: PileCase,
        engine: Engine,
        directory: Path,
        locks: Sequence[int],
        on_progress: Callable[[PileProgress], None] | None,
        time_limit: float | None,
    ) -> None:
        self.case, self.engine, self.directory, self.locks = case, engine, directory, locks
        self.on_progress, self.time_limit = on_progress, time_limit
        self.begin = time.perf_counter()
        directory.mkdir(exist_ok=True)
        (directory / SEGMENTS).mkdir(exist_ok=True)
        write_json(directory / CASE_NAME, case.as_dict())
        (directory / FAILURE_NAME).unlink(missing_ok=True)
        self.done = [_read_segment(path) for path in segment_directories(directory)]

    def make(self, segment: Segment) -> dict[str, Any]:
        """Make the next segment and say what it was."""
        number = len(self.done)
        place = self.directory / SEGMENTS / f"{number:04d}"
        new = place.with_name(place.name + ".new")
        shutil.rmtree(new, ignore_errors=True)
        deck = render_segment(self.case, segment)
        with room_on_disk(new, deck):
            said = self._made(segment, deck, new, number)
            settle(new)
            new.rename(place)
            fsync_path(place.parent)
        # The restart before the last one is kept, should the last one prove bad.
        if number > 1:
            (place.with_name(f"{number - 2:04d}") / RESTART_NAME).unlink(missing_ok=True)
        self.done.append(said)
        return said

    def _made(self, segment: Segment, deck: Deck, new: Path, number: int) -> dict[str, Any]:
        """Run the deck of a segment in a fresh directory."""
        new.mkdir()
        write_deck(deck, new)
        if segment.begin:
            shutil.copyfile(new.with_name(f"{number - 1:04d}") / RESTART_NAME, new / PREVIOUS_RESTART_NAME)
        report = launch(
            deck, new, self.engine, on_progress=self._tell(segment), time_limit=self.time_limit, keep_open=self.locks
        )
        (new / PREVIOUS_RESTART_NAME).unlink(missing_ok=True)
        said = {**vars(segment), **vars(report), "root_mean_square_velocity": _agitation(new)}
        restart = new / RESTART_NAME
        size = restart.stat().st_size if restart.exists() else 0
        if size < _LEAST_BYTES * deck.layout.atoms:  # the engine does not look whether there was room for it
            raise DamagedSegment(f"{restart} is incomplete ({size} bytes): is the disk full?")
        write_json(new / SEGMENT_NAME, said)
        return said

    def _tell(self, segment: Segment) -> Callable[[Progress], None]:
        run, tell = self.case.run, self.on_progress

        def advance(progress: Progress) -> None:
            if tell is None:
                return
            step = max(progress.step, segment.begin)
            driven = 0 if segment.drive_from is None else step - segment.drive_from
            share = driven / (run.cycles * run.steps_per_cycle)
            elapsed = time.perf_counter() - self.begin
            tell(PileProgress(step * run.time_step, elapsed, segment.drive_from is not None, share))

        return advance


def _make(making: _Making, place: Path) -> FinishedRun:
    case, run = making.case, making.case.run
    started = time.time()
    while (start := _settled_at(making)) is None:
        begin = making.done[-1]["end"] if making.done else 0
        making.make(Segment(begin, begin + settling_steps(case), None))
    end = start + run.cycles * run.steps_per_cycle
    while (begin := making.done[-1]["end"]) < end:
        making.make(Segment(begin, min(begin + run.cycles_per_segment * run.steps_per_cycle, end), start))
    seconds = [sum(segment[name] for segment in making.done) for name in ("wall_seconds", "loop_seconds")]
    report = EngineReport(making.done[0]["version"], seconds[0], seconds[1], end)
    said = manifest(case, place.name, making.engine, report, started=started, directory=making.directory)
    settling = {"drive_from": start, "settled": making.done[_first_driven(making) - 1]["root_mean_square_velocity"]}
    for left in [making.directory / "result.json", *making.directory.glob("*.parquet")]:
        left.unlink(missing_ok=True)  # of somebody who looked before the end
    # Of all calls that it took.
    said["seconds"]["total"] = max(said["seconds"]["total"], seconds[0])
    write_json(making.directory / MANIFEST_NAME, {**said, **settling, "segments": len(making.done)})
    move_into_place(making.directory, place)
    return FinishedRun(place)


def _first_driven(making: _Making) -> int:
    driven = [number for number, segment in enumerate(making.done) if segment["drive_from"] is not None]
    return driven[0] if driven else len(making.done)


def _settled_at(making: _Making) -> int | None:
    """Step at which the drive begins: the end of the first segment that leaves the pile at rest, or the last one."""
    run = making.case.run
    for segment in making.done:
        if segment["drive_from"] is not None:
            return int(segment["drive_from"])
        at_rest = segment["root_mean_square_velocity"] < run.settled_below
        if at_rest or segment["end"] * run.time_step >= run.longest_settling:
            return int(segment["end"])
    return None


def _read_segment(directory: Path) -> dict[str, Any]:
    try:
        said = read_json(directory / SEGMENT_NAME)
        if said["end"] > said["begin"] and "drive_from" in said:
            return said
        raise ValueError("begin, end or drive_from make no sense")
    except (OSError, ValueError, KeyError, TypeError) as error:
        told = f"{directory} is damaged ({error}): delete {directory.parent.parent} to have the run made again"
        raise DamagedSegment(told) from error


class DamagedSegment(WalkersError):
    """A segment of an unfinished run that cannot be gone on from."""


def _agitation(directory: Path) -> float:
    """Root mean square velocity of the beads at the end of a segment, by mass, m/s: the deck has it printed last."""
    told = re.findall(rb"^root mean square velocity (\S+)", (directory / OUTPUT_NAME).read_bytes(), re.MULTILINE)
    return float(told[-1])


def is_pile(directory: Path) -> bool:
    """Whether a run directory is a pile's."""
    return (directory / SEGMENTS).is_dir()


def segment_directories(directory: Path) -> list[Path]:
    """The whole segments of a run, in their order."""
    return sorted(path for path in (directory / SEGMENTS).glob("[0-9]*") if not path.suffix)
