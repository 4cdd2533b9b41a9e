"""Make a run, in one segment or in several, each from a restart file to the next.

A run is made in ``NAME-HASH.incomplete``, its segments in ``segments/0000``, ``segments/0001``, … there. A segment that
is being made is called ``0003.new`` and gets its name when it is whole; an interrupted run goes on after the last one.
Since the segments are the same whether the run was interrupted or not, so is all that comes out of it, bit for bit.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.errors import Stopped, WalkersError
from walkers.runner.binary import Engine
from walkers.runner.directory import (
    CASE_NAME,
    SEGMENT_NAME,
    SEGMENTS,
    FinishedRun,
    move_into_place,
    record_failure,
    recover,
    room_on_disk,
    segment_directories,
    unfinished,
    write_deck,
    write_segment_record,
)
from walkers.runner.files import fsync_path, read_json, settle, write_json
from walkers.runner.launch import EngineReport, Progress, launch
from walkers.runner.manifest import MANIFEST_NAME, manifest
from walkers.runner.provenance import look_ahead
from walkers.templates.deck import (
    OUTPUT_NAME,
    PREVIOUS_RESTART_NAME,
    RESTART_NAME,
    Deck,
    Segment,
    first_segment,
    next_segment,
    render_deck,
    settling_steps,
)

_LEAST_BYTES = 150
"""Of a restart file, an atom: whole ones had 300 to 580."""
_RMS_VELOCITY = re.compile(rb"^root mean square velocity (\S+)", re.MULTILINE)
"""Of the beads, by mass, m/s; decks that let them come to rest have it printed."""


class DamagedSegment(WalkersError):
    """A segment of an unfinished run that cannot be gone on from."""


@dataclass
class OpenRun:
    """A run that is being made, or gone on with, in a directory of its own beside its final place (`open_locked`).

    ``done`` is what the segments that are whole say of themselves.
    """

    case: Case
    engine: Engine
    directory: Path
    place: Path
    locks: Sequence[int]
    done: list[dict[str, Any]]
    started: float = field(default_factory=time.time)

    def make(
        self,
        *,
        on_progress: Callable[[Progress], None] | None = None,
        time_limit: float | None = None,
        render: Callable[[Case, Segment], Deck] = render_deck,
        is_steady: Callable[[Path], bool] = lambda _: False,
    ) -> None:
        """Make the segments that are missing; if the engine fails, those before stay.

        Parameters
        ----------
        on_progress, time_limit
            Of each segment, as in `walkers.runner.launch.launch`.
        render
            What makes their decks.
        is_steady
            Of a run that is driven until its walkers are steady: whether they are, as its directory shows.
        """
        begun, made = time.perf_counter(), 0
        look_ahead()
        for cycles in self.case.run.attempts:
            case = self.case.for_cycles(cycles)
            if self.case.run.until_steady and self.done and self.done[-1]["end"] < case.run.steps:
                for directory in segment_directories(self.directory):  # an attempt for fewer cycles
                    shutil.rmtree(directory)
                self.done.clear()
            while (segment := self._next_segment(case)) is not None:
                tell = _teller(case, segment, on_progress, begun, made) if on_progress else None
                self._make(segment, render(case, segment), tell, time_limit)
                made += segment.end - segment.begin
            if cycles < self.case.run.cycles and is_steady(self.directory):
                return

    def _next_segment(self, case: Case) -> Segment | None:
        """The segment that is to be made next, of the run or an attempt at it; None after the last one."""
        if not self.done:
            return first_segment(case)
        begin, start = int(self.done[-1]["end"]), self._drive_from()
        if start is None:
            return Segment(begin, begin + settling_steps(case), None)
        return next_segment(case, Segment(begin, begin, start))

    def _drive_from(self) -> int | None:
        """Step at which the drive begins: the end of the first segment that leaves the beads at rest, or the last."""
        run = self.case.run
        for segment in self.done:
            if segment["drive_from"] is not None:
                return int(segment["drive_from"])
            at_rest = segment["root_mean_square_velocity"] < run.settled_below
            if at_rest or segment["end"] * run.time_step >= run.longest_settling:
                return int(segment["end"])
        return None

    def _make(
        self, segment: Segment, deck: Deck, tell: Callable[[Progress], None] | None, time_limit: float | None
    ) -> None:
        folder, number = self.directory / SEGMENTS, len(self.done)
        new, before = folder / f"{number:04d}.new", folder / f"{number - 1:04d}"
        shutil.rmtree(new, ignore_errors=True)
        with room_on_disk(new, deck.layout.bead_dump_bytes):
            new.mkdir()
            write_deck(deck, new, before if number else None)
            if segment.begin:
                shutil.copyfile(before / RESTART_NAME, new / PREVIOUS_RESTART_NAME)
            report = launch(deck, new, self.engine, on_progress=tell, time_limit=time_limit, keep_open=self.locks)
            (new / PREVIOUS_RESTART_NAME).unlink(missing_ok=True)
            restart = new / RESTART_NAME
            size = restart.stat().st_size if restart.exists() else 0
            if (
                not self.case.run.in_one and size < _LEAST_BYTES * deck.layout.atoms
            ):  # at which the engine does not look
                raise DamagedSegment(f"{restart} is incomplete ({size} bytes): is the disk full?")
            velocities = _RMS_VELOCITY.findall((new / OUTPUT_NAME).read_bytes())
            record = write_segment_record(new, segment, report, float(velocities[-1]) if velocities else None)
            settle()
            new.rename(folder / f"{number:04d}")
            fsync_path(folder)
        # The restart before the last one is kept, should the last one prove bad.
        if number > 1:
            (folder / f"{number - 2:04d}" / RESTART_NAME).unlink(missing_ok=True)
        self.done.append(record)

    def finish(self) -> FinishedRun:
        """Write the manifest, last, and move the directory to its place."""
        start = self._drive_from() or 0
        wall_seconds, loop_seconds = (
            sum(segment[name] for segment in self.done) for name in ("wall_seconds", "loop_seconds")
        )
        report = EngineReport(self.done[0]["version"], wall_seconds, loop_seconds, int(self.done[-1]["end"]))
        record = manifest(
            self.case, self.place.name, self.engine, report, started=self.started, directory=self.directory
        )
        record["seconds"]["total"] = max(record["seconds"]["total"], wall_seconds)  # of all calls that it took
        rest = [segment["root_mean_square_velocity"] for segment in self.done if segment["end"] <= start]
        settling = {"drive_from": start, "settled": rest[-1] if rest else None, "segments": len(self.done)}
        write_json(self.directory / MANIFEST_NAME, {**record, **settling}, at_once=False)
        settle()
        move_into_place(self.directory, self.place)
        return FinishedRun(self.place)


def _teller(
    case: Case, segment: Segment, tell: Callable[[Progress], None], begun: float, made: int
) -> Callable[[Progress], None]:
    """What turns the progress of a segment into that of its run."""

    def advance(progress: Progress) -> None:
        step, start = max(progress.step, segment.begin), segment.drive_from
        tell(
            replace(
                progress,
                step=0 if start is None else step - start,
                steps=case.run.steps,
                made=made + step - segment.begin,
                simulated=step * case.run.time_step,
                elapsed=time.perf_counter() - begun,
                resting=start is None,
            )
        )

    return advance


@contextmanager
def open_locked(
    case: Case, engine: Engine, place: Path, locks: Sequence[int], *, anew: bool = False
) -> Iterator[OpenRun]:
    """Make a run, whose place its caller has locked, in a directory of its own, or go on with it.

    Parameters
    ----------
    case, engine
        What determines the run.
    place, locks
        Where it belongs, and the descriptors of its locks, which the engine inherits.
    anew
        Whether what there is of an earlier call goes first.

    Yields
    ------
    OpenRun
        Call its `OpenRun.make` and `OpenRun.finish`. Left without the latter, the directory stays as ``….incomplete``,
        with a ``failure.json`` if something failed.

    Raises
    ------
    DiskFull
        If there is no room even for the deck.
    """
    directory = unfinished(place)
    recover(place)
    if anew:
        shutil.rmtree(directory, ignore_errors=True)
    try:
        with room_on_disk(directory):
            (directory / SEGMENTS).mkdir(parents=True, exist_ok=True)
            # What an earlier call left beside its whole segments: tables, and parts of files and segments.
            for path in (*directory.iterdir(), *(directory / SEGMENTS).glob("*.new")):
                if path.is_file():
                    path.unlink()
                elif path.name != SEGMENTS:
                    shutil.rmtree(path)
            write_json(directory / CASE_NAME, case.as_dict(), at_once=False)
            done = [_read_segment(path) for path in segment_directories(directory)]
            yield OpenRun(case, engine, directory, place, locks, done)
    except Stopped:
        raise
    except (WalkersError, OSError) as failure:
        record_failure(directory, failure)
        raise


def _read_segment(directory: Path) -> dict[str, Any]:
    try:
        record = read_json(directory / SEGMENT_NAME)
        if record["end"] > record["begin"] and "drive_from" in record:
            return record
        raise ValueError("begin, end or drive_from make no sense")
    except (OSError, ValueError, KeyError, TypeError) as error:
        message = f"{directory} is damaged ({error}): delete {directory.parent.parent} to have the run made again"
        raise DamagedSegment(message) from error
