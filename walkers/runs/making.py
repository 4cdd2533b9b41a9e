"""Make runs: single runs segment by segment, or several at once in a shared deck.

A run is made in ``NAME-HASH.incomplete``. Its segments are ``segments/0000``, ``segments/0001``, …; each begins with
the restart file of the one before. A segment is called ``0003.new`` until it is complete. An interrupted run continues
after its last segment. Segments do not depend on interruptions, so the results are bit-identical.

A shared deck runs in the ``….incomplete`` of its first run. Its output is split into the run directories. These are
like any others, but contain the deck and the engine's log in ``shared_deck``.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walkers.errors import Stopped, WalkersError
from walkers.files import fsync_path, link_or_copy, make_folder, read_json, write_json
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.run import RunSettings
from walkers.postprocess.measure.results import measure
from walkers.progress import Progress, Tell
from walkers.rounding import duration_text
from walkers.runner import run_directory
from walkers.runner.binary import Engine
from walkers.runner.failures import BeadsOverTheTop
from walkers.runner.launch import EngineReport, check_free_space, last_step, launch
from walkers.runner.manifest import FinishedRun, write_manifest
from walkers.templates import deck as decks
from walkers.templates.deck import Deck, Segment

DECK_FOLDER = "shared_deck"
"""Folder in a run directory: the shared deck that made the run, and the engine's log."""
_LEAST_BYTES = 150
"""Smallest size of a complete restart file per atom; measured: 300 to 580."""
_RMS_VELOCITY = re.compile(rb"^root mean square velocity (\S+)", re.MULTILINE)
"""Mass-weighted velocity of the beads, m/s, which decks print while the beads settle."""
_STARTING_SECONDS = 1.0  # before that the start of the engine dominates the rate


class DamagedSegment(WalkersError):
    """A segment of an unfinished run from which the run cannot continue."""


class BridgeTablesDiffer(WalkersError):
    """The complete segments of an unfinished run have other bridge tables than the next one would have."""


def make_runs(
    cases: Sequence[Case],
    out: Path,
    engine: Engine,
    *,
    force: bool = False,
    dumps: bool = True,
    on_progress: Tell | None = None,
    time_limit: float | None = None,
) -> dict[str, bool]:
    """Make the missing runs of cases that may share a deck, and measure them; a single run continues.

    `EngineFailure` if the engine fails. Nothing is left of a shared deck; its cases must be tried again in smaller
    decks. With ``force`` all runs are made again; without ``dumps`` those that are made keep none. The ``time_limit``
    is the wall time in s of a segment. Returns the finished runs by name, and whether this call made them; without
    those that another process makes.
    """
    make_folder(out)
    places = {run_directory.run_place(case, engine, out): case for case in cases}
    with run_directory.locked(places) as ours:
        for place in ours:
            run_directory.recover(place)
        runs = (
            {}
            if force
            else {place.name: False for place in places if run_directory.is_finished(place)}
        )
        missing = {
            place: case
            for place, case in places.items()
            if place in ours and place.name not in runs
        }
        locks = [ours[place] for place in missing]
        if len(missing) == 1:
            ((place, case),) = missing.items()
            with open_locked(case, engine, place, locks, anew=force) as opened:
                opened.make(on_progress=on_progress, time_limit=time_limit)
                if on_progress is not None:
                    on_progress(Progress(1.0, "measuring"))
                measure(opened.directory)
                opened.finish()
            runs[place.name] = True
        elif missing:
            left = {place.name: case for place, case in missing.items()}
            for cycles in next(iter(left.values())).run.attempts:
                if left:
                    done = _make_together(left, cycles, out, engine, locks, on_progress, time_limit)
                    runs |= dict.fromkeys(done, True)
                left = {name: case for name, case in left.items() if name not in runs}
        for place in missing if not dumps else ():
            if place.name in runs:
                run_directory.leave_out_dumps(place)
    return runs


def progress_at(place: Path, case: Case | None = None) -> Progress | None:
    """Progress of a run from its files, or of the shared deck whose first run has this place; None at the start.

    The case is read as well, unless it is given.
    """
    directory = run_directory.unfinished(place)
    shared = directory / DECK_FOLDER
    try:
        if shared.is_dir():
            share = last_step(shared / decks.OUTPUT_NAME) / run_directory.read_layout(shared).steps
            percent = f"{100 * share:.0f} %"
            return Progress(share, percent, percent)
        case = case or run_directory.case_of(directory)
        done = [_read_segment(path) for path in run_directory.segment_directories(directory)]
        (folder,) = (directory / run_directory.SEGMENTS).glob("*.new")
        run = case.run
        cycles = (
            run_directory.read_layout(folder).steps // run.steps_per_cycle
            if run.until_steady
            else run.cycles
        )
        begin = int(done[-1]["end"]) if done else 0
        start = run_directory.drive_from(case, done)
        step = max(begin, last_step(folder / decks.OUTPUT_NAME))
        seconds = time.time() - (folder / decks.DECK_NAME).stat().st_mtime
    except (OSError, ValueError, KeyError, TypeError, WalkersError):
        return None
    return progress_in(run, cycles, Segment(begin, begin, start), step, seconds)


def share_kept(place: Path) -> float | None:
    """Share of an interrupted run that is complete, and from which it continues.

    Parameters
    ----------
    place
        The final directory of the run.

    Returns
    -------
    float or None
        From 0 to 1; None if there is no unfinished run, or its files cannot be read.
    """
    directory = run_directory.unfinished(place)
    try:
        case = run_directory.case_of(directory)
        segments = run_directory.segment_directories(directory)
        if not segments:
            return 0.0
        done = [_read_segment(path) for path in segments]
        cycles = case.run.cycles
        if case.run.until_steady:
            cycles = run_directory.read_layout(segments[-1]).steps // case.run.steps_per_cycle
    except (OSError, ValueError, KeyError, TypeError, WalkersError):
        return None
    end = int(done[-1]["end"])
    segment = Segment(end, end, run_directory.drive_from(case, done))
    return progress_in(case.run, cycles, segment, end, 0.0).share


def progress_in(
    run: RunSettings, cycles: int, segment: Segment, step: int, seconds: float
) -> Progress:
    """Progress at a step of a segment, ``seconds`` after its begin, in the attempt with a number of cycles."""
    before, steps, start = (
        run.steps_until(cycles - 1),
        run.steps_until(run.cycles),
        segment.drive_from,
    )
    step = max(step, segment.begin)
    done = before + (0 if start is None else step - start)
    rate = (step - segment.begin) / seconds if seconds >= _STARTING_SECONDS else 0.0
    share, simulated = done / steps, (before + step) * run.time_step
    text = "coming to rest" if start is None else f"{100 * share:.0f} %"
    if not rate:
        stage = text if step > segment.begin else "starting"
        return Progress(share, stage, stage)
    left = f"{'at most ' if run.until_steady or run.until else ''}{duration_text((steps - done) / rate)} left"
    details = f"{text}, {left}, {simulated:.3f} s simulated, {rate:.0f} steps/s"
    return Progress(share, details, text)


def _are_constant(directory: Path) -> bool:
    from walkers.postprocess.measure.gait import (
        are_constant,
    )  # numpy is loaded while the engine runs

    return are_constant(directory)


# --- one run ----------------------------------------------------------------------------------------------------------


@dataclass
class OpenRun:
    """A run in progress, in a directory beside its final place (`open_locked`).

    ``done`` are the records of the complete segments, ``ended`` is the reason why the run ended early, if it did.
    """

    case: Case
    engine: Engine
    directory: Path
    place: Path
    locks: Sequence[int]
    done: list[dict[str, Any]]
    started: float = field(default_factory=time.time)
    ended: str | None = None

    def make(
        self,
        *,
        on_progress: Tell | None = None,
        time_limit: float | None = None,
        render: Callable[[Case, Segment], Deck] = decks.render_deck,
    ) -> None:
        """Make the missing segments with decks by ``render``; ``time_limit`` (s) applies to each.

        Complete segments are kept if the engine fails.
        """
        for cycles in self.case.run.attempts:
            case = self.case.for_cycles(cycles)
            if self.case.run.until_steady and self.done and self.done[-1]["end"] < case.run.steps:
                for directory in run_directory.segment_directories(
                    self.directory
                ):  # of an attempt with fewer cycles
                    shutil.rmtree(directory)
                self.done.clear()
            while (segment := self._next_segment(case)).end > segment.begin:
                tell = _teller(self.case.run, cycles, segment, on_progress)
                try:
                    self._make(segment, render(case, segment), tell, time_limit)
                    if self.case.run.until == "climb" and self._has_climbed():
                        self.ended = "a cluster has climbed (run.until)"
                        return
                except BeadsOverTheTop as over:
                    begun_at = run_directory.drive_from(self.case, self.done)
                    if not case.boundary.closed or begun_at is None or segment.begin <= begun_at:
                        raise
                    # A climber left the container: this ends the experiment; the segments before are valid.
                    shutil.rmtree(
                        self.directory / run_directory.SEGMENTS / f"{len(self.done):04d}.new"
                    )
                    self.ended = (
                        f"{over.lost} bead(s) left the container over its walls in the next segment"
                    )
                    return
            if cycles < self.case.run.cycles and _are_constant(self.directory):
                return

    def _has_climbed(self) -> bool:
        """Whether a cluster has climbed in the complete segments."""
        from walkers.postprocess.measure.motion import (
            read_motion,
        )  # numpy is loaded while the engine runs
        from walkers.postprocess.measure.piles import has_climbed

        if (
            run_directory.drive_from(self.case, self.done[:-1]) is None
        ):  # the beads came to rest in this segment
            return False
        return has_climbed(read_motion(self.directory))

    def _next_segment(self, case: Case) -> Segment:
        return decks.next_segment(
            case,
            int(self.done[-1]["end"]) if self.done else 0,
            run_directory.drive_from(self.case, self.done),
        )

    def _make(
        self,
        segment: Segment,
        deck: Deck,
        tell: Callable[[int], None] | None,
        time_limit: float | None,
    ) -> None:
        folder, number = self.directory / run_directory.SEGMENTS, len(self.done)
        new, before = folder / f"{number:04d}.new", folder / f"{number - 1:04d}"
        shutil.rmtree(new, ignore_errors=True)
        if number and not run_directory.has_tables_of(before, deck):
            raise BridgeTablesDiffer(
                f"{before / decks.BRIDGES_NAME} has other forces than this program computes: the run was begun "
                "by another version, or on another kind of machine; "
                f"delete {self.directory} and repeat the run, or continue it there"
            )
        with run_directory.write_errors_as_failures(new, deck.layout.bead_dump_bytes):
            new.mkdir()
            run_directory.write_deck(deck, new, before if number else None)
            if segment.begin:
                shutil.copyfile(before / decks.RESTART_NAME, new / decks.PREVIOUS_RESTART_NAME)
            report = launch(
                deck, new, self.engine, on_step=tell, time_limit=time_limit, keep_open=self.locks
            )
            (new / decks.PREVIOUS_RESTART_NAME).unlink(missing_ok=True)
            restart = new / decks.RESTART_NAME
            size = restart.stat().st_size if restart.exists() else 0
            if (
                not self.case.run.has_one_segment and size < _LEAST_BYTES * deck.layout.atoms
            ):  # the engine does not check this
                raise DamagedSegment(f"{restart} is incomplete ({size} bytes): is the disk full?")
            velocities = _RMS_VELOCITY.findall((new / decks.OUTPUT_NAME).read_bytes())
            record = run_directory.write_segment_record(
                new, segment, report, float(velocities[-1]) if velocities else None
            )
            os.sync()  # so that the new name survives a loss of power; faster than file by file
            new.rename(folder / f"{number:04d}")
            fsync_path(folder)
        # The restart before the last one is kept in case the last one is damaged.
        if number > 1:
            (folder / f"{number - 2:04d}" / decks.RESTART_NAME).unlink(missing_ok=True)
        self.done.append(record)

    def finish(self) -> None:
        """Write the manifest, and move the directory to its place."""
        wall_seconds, loop_seconds = (
            sum(record[name] for record in self.done) for name in ("wall_seconds", "loop_seconds")
        )
        report = EngineReport(
            self.done[0]["version"], wall_seconds, loop_seconds, int(self.done[-1]["end"])
        )
        start = run_directory.drive_from(self.case, self.done) or 0
        rest = [
            segment["root_mean_square_velocity"] for segment in self.done if segment["end"] <= start
        ]
        finished = FinishedRun(
            case=self.case,
            name=self.place.name,
            engine=self.engine,
            report=report,
            started=self.started,
            segments=len(self.done),
            drive_from=start,
            settled=rest[-1] if rest else None,
            ended=self.ended,
        )
        write_manifest(self.directory, finished)
        os.sync()
        run_directory.move_into_place(self.directory, self.place)


def _teller(
    run: RunSettings, cycles: int, segment: Segment, tell: Tell | None
) -> Callable[[int], None] | None:
    """A function that reports the progress of the run at a step of a segment."""
    begin = time.perf_counter()
    return tell and (
        lambda step: tell(progress_in(run, cycles, segment, step, time.perf_counter() - begin))
    )


@contextmanager
def open_locked(
    case: Case, engine: Engine, place: Path, locks: Sequence[int], *, anew: bool = False
) -> Iterator[OpenRun]:
    """Open a run whose place the caller has locked, to start it, or to continue it unless ``anew``.

    Without `OpenRun.finish` the directory remains ``….incomplete``; after a failure it contains ``failure.json``.
    """
    directory = run_directory.unfinished(place)
    run_directory.recover(place)
    if anew:
        shutil.rmtree(directory, ignore_errors=True)
    try:
        with run_directory.write_errors_as_failures(directory):
            (directory / run_directory.SEGMENTS).mkdir(parents=True, exist_ok=True)
            # Left by an earlier call, besides complete segments: tables, incomplete files and segments.
            for path in (*directory.iterdir(), *(directory / run_directory.SEGMENTS).glob("*.new")):
                if path.is_file():
                    path.unlink()
                elif path.name != run_directory.SEGMENTS:
                    shutil.rmtree(path)
            run_directory.write_case(directory, case)
            done = [_read_segment(path) for path in run_directory.segment_directories(directory)]
            yield OpenRun(case, engine, directory, place, locks, done)
    except Stopped:
        raise
    except (WalkersError, OSError) as failure:
        contents = {
            "reason": type(failure).__name__,
            "message": str(failure),
            "lost": getattr(failure, "lost", 0),
        }
        with suppress(OSError):  # the disk may be full; the message reaches the user anyway
            write_json(directory / run_directory.FAILURE_NAME, contents)
        raise


def _read_segment(directory: Path) -> dict[str, Any]:
    try:
        record = read_json(directory / run_directory.SEGMENT_NAME)
        if record["end"] > record["begin"] and "drive_from" in record:
            return record
        raise ValueError("begin, end or drive_from is missing or wrong")
    except (OSError, ValueError, KeyError, TypeError) as error:
        message = (
            f"{directory} is damaged ({error}): delete {directory.parent.parent} and repeat the run"
        )
        raise DamagedSegment(message) from error


# --- several runs -----------------------------------------------------------------------------------------------------


def _make_together(
    cases: Mapping[str, Case],
    cycles: int,
    out: Path,
    engine: Engine,
    locks: Sequence[int],
    on_progress: Tell | None,
    time_limit: float | None,
) -> list[str]:
    """Make runs in one deck for a number of cycles; return those with constant velocities or all of their cycles."""
    tried = {name: case.for_cycles(cycles) for name, case in cases.items()}
    deck, started = decks.compose(decks.plan_of(*tried.values())), time.time()
    first = next(iter(cases))
    incomplete = run_directory.unfinished(out / first)
    shutil.rmtree(incomplete, ignore_errors=True)
    try:
        with run_directory.write_errors_as_failures(incomplete, deck.layout.bead_dump_bytes):
            check_free_space(
                out, 2 * deck.layout.bead_dump_bytes
            )  # the dump and its parts exist at the same time
            (incomplete / DECK_FOLDER).mkdir(parents=True)
            run_directory.write_deck(deck, incomplete / DECK_FOLDER)
            # For other processes the directory is the unfinished first run.
            for name, case in [(".", cases[first]), *cases.items()]:
                (incomplete / name).mkdir(exist_ok=True)
                run_directory.write_case(incomplete / name, case)
            tell = _teller(cases[first].run, cycles, decks.next_segment(tried[first]), on_progress)
            folder = incomplete / DECK_FOLDER
            report = launch(
                deck, folder, engine, on_step=tell, time_limit=time_limit, keep_open=locks
            )
            _part(incomplete, tried, deck, report)
            done = [
                name
                for name in cases
                if cycles >= cases[name].run.cycles or _are_constant(incomplete / name)
            ]
            shared = {"first": first, "runs": len(done), "walkers": len(deck.layout.walkers)}
            for name in done:
                measure(incomplete / name)
                finished = FinishedRun(
                    case=cases[name],
                    name=name,
                    engine=engine,
                    report=report,
                    started=started,
                    segments=1,
                    drive_from=0,
                    shared_deck=shared,
                )
                write_manifest(incomplete / name, finished)
            os.sync()
            for name in done:
                run_directory.move_into_place(incomplete / name, out / name)
    finally:
        shutil.rmtree(incomplete, ignore_errors=True)
    for name in done:  # remains of a run that was made alone and killed
        shutil.rmtree(run_directory.unfinished(out / name), ignore_errors=True)
    return done


def _part(incomplete: Path, cases: Mapping[str, Case], deck: Deck, report: EngineReport) -> None:
    """Give each run its part of the output, and the deck."""
    from walkers.runs.splitting import split_output

    places = {incomplete / name / run_directory.FIRST_SEGMENT: case for name, case in cases.items()}
    for place in places:
        place.mkdir(parents=True)
    split_output(incomplete / DECK_FOLDER, deck.layout, places)
    for name, (place, case) in zip(cases, places.items(), strict=True):
        run_directory.write_segment_record(place, decks.next_segment(case), report)
        shutil.copytree(
            incomplete / DECK_FOLDER, incomplete / name / DECK_FOLDER, copy_function=link_or_copy
        )
