"""Make runs: single runs segment by segment, or several at once in a shared deck.

A run is made in ``NAME-HASH.incomplete``. Its segments are ``segments/0000``, ``segments/0001``,
…; each begins with the restart file of the one before. A segment is called ``0003.new`` until it
is complete. An interrupted run continues after its last segment. Segments do not depend on
interruptions, so the results are bit-identical.

A shared deck runs in the ``….incomplete`` of its first run. Its output is split into the run
directories. These are like any others, but contain the deck and the engine's log in
``shared_deck``.

Which runs to make is decided in `walkers.sweeps`; how a single deck is run, in `walkers.runner`.
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
from walkers.pace import Pace
from walkers.postprocess.measure.results import measure
from walkers.progress import Progress, Tell
from walkers.rounding import duration_text
from walkers.runner import run_directory
from walkers.runner.binary import Engine
from walkers.runner.cost import predicted_seconds_of_step
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


class DamagedSegment(WalkersError):
    """A segment of an unfinished run from which the run cannot continue."""


class BridgeTablesDiffer(WalkersError):
    """The complete segments of an unfinished run have other bridge tables than the next one."""


@dataclass(frozen=True)
class _LaunchOptions:
    """How the engine is started and watched.

    Attributes
    ----------
    engine
        The engine.
    locks
        File descriptors of the locks of the runs, which the engine inherits.
    on_progress
        Called a few times per second with the progress of the runs.
    time_limit
        Wall time of a segment or a shared deck, s; None: no limit.
    """

    engine: Engine
    locks: Sequence[int]
    on_progress: Tell | None
    time_limit: float | None


def make_runs(  # noqa: PLR0913
    cases: Sequence[Case],
    out: Path,
    engine: Engine,
    *,
    force: bool = False,
    dumps: bool = True,
    on_progress: Tell | None = None,
    time_limit: float | None = None,
) -> dict[str, bool]:
    """Make the missing runs of cases, and measure them.

    A single run continues where it was interrupted. Several runs are made in a shared deck: one
    input file, with which one process of the engine computes all cases at once.

    Parameters
    ----------
    cases
        One case, or several that may share a deck.
    out
        Folder of the run directories.
    engine
        The engine.
    force
        Make all runs again.
    dumps
        Whether the runs that are made keep their dumps.
    on_progress
        Called a few times per second with the progress of the runs.
    time_limit
        Wall time of a segment, s.

    Returns
    -------
    dict
        The finished runs by name, and whether this call made them. Runs that another process makes
        are left out.

    Raises
    ------
    EngineFailure
        If the engine fails. Nothing is left of a shared deck: its cases must be tried again in
        smaller decks.
    """
    make_folder(out)
    places = {run_directory.run_place(case, engine, out): case for case in cases}
    runs: dict[str, bool] = {}
    missing: dict[Path, Case] = {}
    with run_directory.locked(places) as lock_of_place:  # without places that others have locked
        for place in lock_of_place:
            run_directory.recover(place)
        for place, case in places.items():
            if run_directory.is_finished(place) and not force:
                runs[place.name] = False
            elif place in lock_of_place:
                missing[place] = case
        locks = [lock_of_place[place] for place in missing]
        options = _LaunchOptions(engine, locks, on_progress, time_limit)
        if len(missing) == 1:
            ((place, case),) = missing.items()
            _make_alone(case, place, options, anew=force)
            completed = [place.name]
        else:  # several, or none
            completed = _make_in_shared_decks(missing, out, options)
        for name in completed:
            runs[name] = True
            if not dumps:
                run_directory.leave_out_dumps(out / name)
    return runs


# --- progress -------------------------------------------------------------------------------------


def progress_at(place: Path, case: Case | None = None) -> Progress | None:
    """Progress of an unfinished run from its files, or of the shared deck whose first run it is.

    Parameters
    ----------
    place
        The final directory of the run.
    case
        Its case; None: it is read.

    Returns
    -------
    Progress or None
        None if the engine has not started, or if the files cannot be read.
    """
    directory = run_directory.unfinished(place)
    shared = directory / DECK_FOLDER
    try:
        if shared.is_dir():
            return _progress_of_shared_deck(shared)
        return _progress_of_segment(directory, case or run_directory.case_of(directory))
    except (OSError, ValueError, KeyError, TypeError, WalkersError):
        return None


def _progress_of_shared_deck(folder: Path) -> Progress:
    """Progress of the shared deck in a folder, from the last step in its log."""
    step = last_step(folder / decks.OUTPUT_NAME)
    return _progress_of_deck(step, run_directory.read_layout(folder).steps)


def _progress_of_segment(directory: Path, case: Case) -> Progress:
    """Progress of a run whose segments are made one by one; `ValueError` if none is being made."""
    done = _complete_segments(directory)
    # `ValueError` unless there is exactly one: segments are made one after the other.
    (folder,) = (directory / run_directory.SEGMENTS).glob("*.new")
    cycles = case.run.cycles
    if case.run.until_steady:
        cycles = run_directory.read_layout(folder).steps // case.run.steps_per_cycle
    begin = int(done[-1]["end"]) if done else 0
    segment = Segment(begin, begin, run_directory.drive_from(case, done))
    step = max(begin, last_step(folder / decks.OUTPUT_NAME))
    seconds = time.time() - (folder / decks.DECK_NAME).stat().st_mtime
    return progress_in(case, cycles, segment, step, pace_in(case, done, step - begin, seconds))


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
        done = _complete_segments(directory)
        if not done:
            return 0.0
        cycles = case.run.cycles
        if case.run.until_steady:
            last = run_directory.segment_directories(directory)[-1]
            cycles = run_directory.read_layout(last).steps // case.run.steps_per_cycle
    except (OSError, ValueError, KeyError, TypeError, WalkersError):
        return None
    end = int(done[-1]["end"])
    segment = Segment(end, end, run_directory.drive_from(case, done))
    return _steps_done(case, cycles, segment, end) / _steps_in_total(case, segment)


def _steps_done(case: Case, cycles: int, segment: Segment, step: int) -> int:
    """Steps of all attempts, and while the beads came to rest, when a segment is at a step.

    A run until constant velocities is tried with growing numbers of cycles; a segment belongs to
    one of these attempts, of so many cycles.
    """
    reached = max(step, segment.begin)
    if segment.drive_from is None:
        return min(reached, _most_resting_steps(case))
    return case.run.steps_of_attempts(cycles - 1) + reached


def _most_resting_steps(case: Case) -> int:
    """Number of steps that beads need to come to rest, at most by experience."""
    return decks.RESTING_SEGMENTS * decks.settling_steps(case)


def _steps_in_total(case: Case, segment: Segment) -> int:
    """Largest number of steps of a run, with those in which its beads come to rest.

    How many these are is known when the drive has begun.
    """
    steps = case.run.steps_of_attempts(case.run.cycles)
    if segment.drive_from is None:
        return _most_resting_steps(case) + steps
    return segment.drive_from + steps


def pace_in(
    case: Case, done: Sequence[Mapping[str, Any]], steps: int = 0, seconds: float = 0.0
) -> Pace:
    """The pace of a run, from the records of its complete segments and the one that is running.

    Parameters
    ----------
    case
        The case of the run.
    done
        Records of its complete segments.
    steps
        Steps of the running segment that are done.
    seconds
        Wall time since its start, s.
    """
    seconds_of_step = predicted_seconds_of_step(case)
    pace = Pace.of_prediction(case.run.steps * seconds_of_step)
    for record in done:
        predicted = (record["end"] - record["begin"]) * seconds_of_step
        pace = pace.after(record["wall_seconds"], predicted)
    return pace.after(seconds, steps * seconds_of_step)


def progress_in(case: Case, cycles: int, segment: Segment, step: int, pace: Pace) -> Progress:
    """Progress of a run within a segment.

    Shares and times count the steps of all attempts.

    Parameters
    ----------
    case
        The case of the run.
    cycles
        Number of cycles of the current attempt.
    segment
        The segment; its ``drive_from`` is None while the beads come to rest.
    step
        The step that the engine has reached.
    pace
        The pace of the run (`pace_in`).
    """
    steps = _steps_done(case, cycles, segment, step)
    most = _steps_in_total(case, segment)
    share = steps / most
    seconds = (most - steps) * predicted_seconds_of_step(case) * pace.slowness
    left = f"{duration_text(seconds)} left"
    if case.run.until_steady or case.run.until:
        left = f"at most {left}"
    if steps == 0:
        return Progress(share, f"starting, {left}", "starting")
    stage = f"{100 * share:.0f} %"
    if segment.drive_from is None:
        stage = "coming to rest"
    return Progress(share, f"{stage}, {left}, {steps * case.run.time_step:.3f} s simulated", stage)


def _progress_of_deck(step: int, steps: int) -> Progress:
    """Progress of a shared deck that is at a step of so many."""
    percent = f"{100 * step / steps:.0f} %"
    return Progress(step / steps, percent, percent)


# --- one run --------------------------------------------------------------------------------------


@dataclass
class OpenRun:
    """A run in progress, in a directory beside its final place (`open_locked`).

    Attributes
    ----------
    case
        The case.
    engine
        The engine.
    directory
        Where the run is made.
    place
        Its final directory.
    locks
        File descriptors of its lock, which the engine inherits.
    done
        Records of the complete segments.
    started
        Start of the run, s since the epoch.
    ended
        Why the run ended early, if it did.
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
        """Make the missing segments. Complete segments are kept if the engine fails.

        Parameters
        ----------
        on_progress
            Called a few times per second with the progress of the run.
        time_limit
            Wall time of each segment, s.
        render
            Writes the deck of a segment.
        """
        for cycles in self.case.run.attempts:
            case = self.case.for_cycles(cycles)
            self._remove_shorter_attempt(case)
            segment = self._next_segment(case)
            while segment.end > segment.begin:
                on_step = self._step_callback(cycles, segment, on_progress)
                try:
                    self._make_segment(segment, render(case, segment), on_step, time_limit)
                except BeadsOverTheTop as over:
                    if not self._ends_with_lost_beads(segment):
                        raise
                    self._end_before(over)
                    return
                if self.case.run.until == "climb" and self._has_climbed():
                    self.ended = "a cluster has climbed (run.until)"
                    return
                segment = self._next_segment(case)
            if cycles < self.case.run.cycles and _are_constant(self.directory):
                return

    def _step_callback(
        self, cycles: int, segment: Segment, tell: Tell | None
    ) -> Callable[[int], None] | None:
        """A callback for the steps that `launch` sees, which tells the progress of the run."""
        if tell is None:
            return None
        start = time.perf_counter()

        def tell_step(step: int) -> None:
            seconds = time.perf_counter() - start
            pace = pace_in(self.case, self.done, max(0, step - segment.begin), seconds)
            tell(progress_in(self.case, cycles, segment, step, pace))

        return tell_step

    def _remove_shorter_attempt(self, case: Case) -> None:
        """Remove the segment of an earlier attempt, which has fewer cycles than the case."""
        if self.case.run.until_steady and self.done and self.done[-1]["end"] < case.run.steps:
            for directory in run_directory.segment_directories(self.directory):
                shutil.rmtree(directory)
            self.done.clear()

    def _ends_with_lost_beads(self, segment: Segment) -> bool:
        """Whether beads that leave the container in a segment end the experiment.

        They do in a container whose drive began before the segment: earlier segments are valid.
        Otherwise the loss of beads is a failure.
        """
        drive_from = run_directory.drive_from(self.case, self.done)
        has_begun = drive_from is not None and segment.begin > drive_from
        return self.case.boundary.closed and has_begun

    def _end_before(self, over: BeadsOverTheTop) -> None:
        """End the run before the segment in which beads left the container."""
        new = self.directory / run_directory.SEGMENTS / f"{len(self.done):04d}.new"
        shutil.rmtree(new)
        self.ended = f"{over.lost} bead(s) left the container over its walls in the next segment"

    def _has_climbed(self) -> bool:
        """Whether a cluster has climbed in the complete segments."""
        # These modules load numpy, which takes no time while the engine runs.
        from walkers.postprocess.measure.motion import read_motion
        from walkers.postprocess.measure.piles import has_climbed

        if run_directory.drive_from(self.case, self.done[:-1]) is None:
            return False  # the beads came to rest in the last segment
        return has_climbed(read_motion(self.directory))

    def _next_segment(self, case: Case) -> Segment:
        """The segment after the complete ones; empty after the last one."""
        begin = int(self.done[-1]["end"]) if self.done else 0
        return decks.next_segment(case, begin, run_directory.drive_from(self.case, self.done))

    def _make_segment(
        self,
        segment: Segment,
        deck: Deck,
        on_step: Callable[[int], None] | None,
        time_limit: float | None,
    ) -> None:
        """Run the deck of the next segment, and add the segment's record to `done`."""
        folder = self.directory / run_directory.SEGMENTS
        number = len(self.done)
        new = folder / f"{number:04d}.new"
        before = folder / f"{number - 1:04d}"
        shutil.rmtree(new, ignore_errors=True)
        if number and not run_directory.has_tables_of(before, deck):
            raise BridgeTablesDiffer(
                f"{before / decks.BRIDGES_NAME} has other forces than this program computes: "
                "the run was begun by another version, or on another kind of machine; "
                f"delete {self.directory} and repeat the run, or continue it there"
            )
        with run_directory.write_errors_as_failures(new, deck.layout.bead_dump_bytes):
            new.mkdir()
            run_directory.write_deck(deck, new, before if number else None)
            if segment.begin:
                shutil.copyfile(before / decks.RESTART_NAME, new / decks.PREVIOUS_RESTART_NAME)
            report = launch(
                deck, new, self.engine, on_step=on_step, time_limit=time_limit, keep_open=self.locks
            )
            (new / decks.PREVIOUS_RESTART_NAME).unlink(missing_ok=True)
            if not self.case.run.has_one_segment:
                _check_restart(new / decks.RESTART_NAME, deck.layout.atoms)
            velocity = _rms_velocity(new / decks.OUTPUT_NAME)
            record = run_directory.write_segment_record(new, segment, report, velocity)
            os.sync()  # so that the new name survives a loss of power; faster than file by file
            new.rename(folder / f"{number:04d}")
            fsync_path(folder)
        # The restart before the last one is kept in case the last one is damaged.
        if number > 1:
            (folder / f"{number - 2:04d}" / decks.RESTART_NAME).unlink(missing_ok=True)
        self.done.append(record)

    def finish(self) -> None:
        """Write the manifest, and move the directory to its place."""
        report = EngineReport(
            version=self.done[0]["version"],
            wall_seconds=sum(record["wall_seconds"] for record in self.done),
            loop_seconds=sum(record["loop_seconds"] for record in self.done),
            steps=int(self.done[-1]["end"]),
        )
        drive_from = run_directory.drive_from(self.case, self.done) or 0
        settled = None
        for record in self.done:
            if record["end"] <= drive_from:
                settled = record["root_mean_square_velocity"]
        finished = FinishedRun(
            case=self.case,
            name=self.place.name,
            engine=self.engine,
            report=report,
            started=self.started,
            segments=len(self.done),
            drive_from=drive_from,
            settled=settled,
            ended=self.ended,
        )
        write_manifest(self.directory, finished)
        os.sync()
        run_directory.move_into_place(self.directory, self.place)


def _make_alone(case: Case, place: Path, options: _LaunchOptions, *, anew: bool) -> None:
    """Make and measure a run whose place is locked; continue it unless it is made ``anew``."""
    with open_locked(case, options.engine, place, options.locks, anew=anew) as run:
        run.make(on_progress=options.on_progress, time_limit=options.time_limit)
        if options.on_progress is not None:
            options.on_progress(Progress(1.0, "measuring"))
        measure(run.directory)
        run.finish()


@contextmanager
def open_locked(
    case: Case, engine: Engine, place: Path, locks: Sequence[int], *, anew: bool = False
) -> Iterator[OpenRun]:
    """Open a run whose place the caller has locked, to start it, or to continue it.

    Without `OpenRun.finish` the directory remains ``….incomplete``; after a failure it contains
    ``failure.json``.

    Parameters
    ----------
    case
        The case.
    engine
        The engine.
    place
        The final directory of the run.
    locks
        File descriptors of the lock, which the engine inherits.
    anew
        Start the run again instead of continuing it.
    """
    directory = run_directory.unfinished(place)
    run_directory.recover(place)
    if anew:
        shutil.rmtree(directory, ignore_errors=True)
    try:
        with run_directory.write_errors_as_failures(directory):
            (directory / run_directory.SEGMENTS).mkdir(parents=True, exist_ok=True)
            _remove_incomplete_files(directory)
            run_directory.write_case(directory, case)
            done = _complete_segments(directory)
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


def _remove_incomplete_files(directory: Path) -> None:
    """Remove what an earlier call left besides complete segments."""
    segments = directory / run_directory.SEGMENTS
    for path in [*directory.iterdir(), *segments.glob("*.new")]:
        if path.is_file():
            path.unlink()
        elif path != segments:
            shutil.rmtree(path)


def _complete_segments(directory: Path) -> list[dict[str, Any]]:
    """The records of the complete segments of a run, in order."""
    return [_read_segment(segment) for segment in run_directory.segment_directories(directory)]


def _read_segment(directory: Path) -> dict[str, Any]:
    """The record of a complete segment; `DamagedSegment` if it cannot be read."""
    try:
        record = read_json(directory / run_directory.SEGMENT_NAME)
        if record["end"] > record["begin"] and "drive_from" in record:
            return record
        raise ValueError("begin, end or drive_from is missing or wrong")
    except (OSError, ValueError, KeyError, TypeError) as error:
        run = directory.parent.parent
        message = f"{directory} is damaged ({error}): delete {run} and repeat the run"
        raise DamagedSegment(message) from error


def _check_restart(restart: Path, atoms: int) -> None:
    """Raise `DamagedSegment` unless a restart file is complete, which the engine does not check."""
    size = restart.stat().st_size if restart.exists() else 0
    if size < _LEAST_BYTES * atoms:
        raise DamagedSegment(f"{restart} is incomplete ({size} bytes): is the disk full?")


def _rms_velocity(log: Path) -> float | None:
    """The root mean square velocity (m/s) that a deck printed last; None if it printed none."""
    velocities = _RMS_VELOCITY.findall(log.read_bytes())
    if not velocities:
        return None
    return float(velocities[-1])


def _are_constant(directory: Path) -> bool:
    """Whether the velocities of the walkers of a run are constant."""
    # This module loads numpy, which takes no time while the engine runs.
    from walkers.postprocess.measure.gait import are_constant

    return are_constant(directory)


# --- several runs ---------------------------------------------------------------------------------


def _make_in_shared_decks(
    missing: Mapping[Path, Case], out: Path, options: _LaunchOptions
) -> list[str]:
    """Make and measure runs together, in one deck for each attempt; return their names.

    After each attempt, the runs whose velocities are not constant yet are made again with more
    cycles.
    """
    left = {place.name: case for place, case in missing.items()}
    completed: list[str] = []
    if not left:
        return completed
    # Cases that share a deck have the same attempts.
    attempts = next(iter(left.values())).run.attempts
    for cycles in attempts:
        if left:
            completed += _make_together(left, cycles, out, options)
            left = {name: case for name, case in left.items() if name not in completed}
    return completed


def _make_together(
    cases: Mapping[str, Case], cycles: int, out: Path, options: _LaunchOptions
) -> list[str]:
    """Make runs in one deck for a number of cycles.

    Returns
    -------
    list of str
        Names of the runs that are finished: their velocities are constant, or they have all of
        their cycles.
    """
    attempted = {name: case.for_cycles(cycles) for name, case in cases.items()}
    deck = decks.compose(decks.plan_of(*attempted.values()))
    started = time.time()
    first = next(iter(cases))  # the deck is made in the directory of the first run
    incomplete = run_directory.unfinished(out / first)
    folder = incomplete / DECK_FOLDER
    shutil.rmtree(incomplete, ignore_errors=True)
    try:
        with run_directory.write_errors_as_failures(incomplete, deck.layout.bead_dump_bytes):
            # The dump and its parts exist at the same time.
            check_free_space(out, 2 * deck.layout.bead_dump_bytes)
            folder.mkdir(parents=True)
            run_directory.write_deck(deck, folder)
            # For other processes the directory is the unfinished first run.
            run_directory.write_case(incomplete, cases[first])
            for name, case in cases.items():
                (incomplete / name).mkdir()
                run_directory.write_case(incomplete / name, case)
            report = launch(
                deck,
                folder,
                options.engine,
                on_step=_deck_callback(deck.layout.steps, options.on_progress),
                time_limit=options.time_limit,
                keep_open=options.locks,
            )
            _distribute_output(incomplete, attempted, deck, report)
            done = []
            for name, case in cases.items():
                if cycles >= case.run.cycles or _are_constant(incomplete / name):
                    done.append(name)
            shared_deck = {"first": first, "runs": len(done), "walkers": len(deck.layout.walkers)}
            for name in done:
                measure(incomplete / name)
                finished = FinishedRun(
                    case=cases[name],
                    name=name,
                    engine=options.engine,
                    report=report,
                    started=started,
                    segments=1,
                    drive_from=0,
                    shared_deck=shared_deck,
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


def _deck_callback(steps: int, tell: Tell | None) -> Callable[[int], None] | None:
    """A callback for the steps that `launch` sees, which tells the progress of a shared deck."""
    if tell is None:
        return None
    return lambda step: tell(_progress_of_deck(step, steps))


def _distribute_output(
    incomplete: Path, cases: Mapping[str, Case], deck: Deck, report: EngineReport
) -> None:
    """Give each run its part of the output, the report of the engine, and the shared deck.

    The cases are in the order of the deck. Splitting removes the dumps from the folder of the deck,
    so that only small files remain, which the runs share by hard links.
    """
    from walkers.runs.splitting import split_output

    segments = {name: incomplete / name / run_directory.FIRST_SEGMENT for name in cases}
    for segment in segments.values():
        segment.mkdir(parents=True)
    shared = incomplete / DECK_FOLDER
    split_output(shared, deck.layout, {segments[name]: case for name, case in cases.items()})
    for name, case in cases.items():
        run_directory.write_segment_record(segments[name], decks.next_segment(case), report)
        shutil.copytree(shared, incomplete / name / DECK_FOLDER, copy_function=link_or_copy)
