"""Run a sweep: have workers run its decks until every point is finished or failed.

`walkers.sweeps.packing` packs the points into decks; `walkers.sweeps.workers` says what a worker
does with a deck, and where workers run.

A deck that fails is repeated as two halves; until a point is finished, the second half waits for
the first. A failure that affects every point stops the sweep.
"""

from __future__ import annotations

import resource
import time
from collections import Counter
from collections.abc import Collection, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.errors import InputError, Problem, WalkersError, check_utf8, input_error
from walkers.inputs.sweep import SweepDefinition
from walkers.inputs.tables.case import Case
from walkers.pace import Pace
from walkers.postprocess.measure.results import ensure_measured
from walkers.progress import Progress, Tell
from walkers.rounding import counted, duration_text
from walkers.runner.audit import check_audit
from walkers.runner.binary import Engine, find_engine
from walkers.runner.cost import PROGRAM_SECONDS, predicted_overhead, predicted_seconds
from walkers.runner.failures import OutputGone
from walkers.runner.process import cores_here
from walkers.runner.run_directory import is_finished, is_locked, run_place
from walkers.runs.making import progress_at
from walkers.runs.status import PointState, status_text
from walkers.sweeps.packing import (
    LONGEST_SECONDS,
    PlannedDeck,
    makespan,
    pack,
    parts_of,
    seconds_of,
    unfinished_parts,
)
from walkers.sweeps.record import (
    RECORD_NAME,
    UNREADABLE,
    SweepRecord,
    read_sweep_record,
    states,
    write_record,
)
from walkers.sweeps.site import check_path, decks_at
from walkers.sweeps.workers import (
    DeckOutcome,
    DeckTask,
    Failure,
    SweepStopped,
    Workers,
    make_deck,
    outcome_of,
    pilots,
    threads,
)
from walkers.terminal import fitted_lines
from walkers.text import with_unit
from walkers.warning import warn_user

if TYPE_CHECKING:
    from parsl.config import Config

_RESOLVED_AT_ONCE = 1_000
"""Number of points after which the progress of resolving them is reported."""
_LOOK_SECONDS = 0.25
"""Time in s between two reports of the progress, and longest time of a look at the decks."""
_MEASURING = 0.995
"""Share of the work of the engine from which on running points count as being measured."""
_MOST_SAME_FAILURES = 3
"""Points that may fail alone in the same way before any point is finished."""
_DECKS_LOOKED_AT = 4
"""Submitted decks whose progress is read, per deck that runs at once; later ones have not begun."""


class SweepReplacedWarning(UserWarning):
    """Another sweep file of the same name had the directory of a sweep."""


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is run.

    Attributes
    ----------
    workers
        Number of cores of this machine; None: all. An ``executor`` runs as many decks at once.
    site
        The cluster on which the sweep runs instead of this machine.
    executor
        The caller's executor, which runs the decks instead of this machine or a cluster.
    time_limit
        Longest wall time of an engine in s; None: no limit.
    final
        Names of failures that are never repeated.
    ranks
        Number of MPI processes of a deck.
    dumps
        Whether runs keep their dumps.
    own_runs
        Whether the runs are made in the directory of the sweep instead of beside it.
    """

    workers: int | None = None
    site: Config | None = None
    executor: Executor | None = None
    time_limit: float | None = None
    final: frozenset[str] = frozenset()
    ranks: int = 1
    dumps: bool = True
    own_runs: bool = False

    @property
    def decks_at_once(self) -> int:
        """Number of decks that run at the same time."""
        if self.executor is not None:
            return self.workers or cores_here()
        if self.site is not None:
            return decks_at(self.site, self.ranks)
        workers = self.workers or cores_here()
        return max(1, workers // self.ranks)

    def for_ranks(self, ranks: int) -> SweepOptions:
        """The same options for decks with a number of MPI processes.

        Raises
        ------
        InputError
            If a node of the cluster has fewer cores.
        """
        options = replace(self, ranks=ranks)
        if not options.decks_at_once:
            raise input_error(
                "cores",
                f"a deck has {ranks} MPI processes (run.ranks), more than the cores of a node",
            )
        return options


@dataclass(frozen=True)
class SweepPlan:
    """Plan of a sweep.

    Attributes
    ----------
    record
        The sweep in its directory, with the name of the run of each point.
    cases
        The cases of all points.
    engine
        The engine that makes the runs.
    decks
        The missing decks, the longest first.
    statuses
        The status of each point.
    options
        How the sweep is run.
    final
        Failures that are not repeated.
    """

    record: SweepRecord
    cases: Sequence[Case]
    engine: Engine
    decks: Sequence[PlannedDeck]
    statuses: Sequence[str]
    options: SweepOptions
    final: list[Failure]

    @cached_property
    def missing(self) -> list[Case]:
        """The cases of the points that will be made."""
        cases: list[Case] = []
        for deck in self.decks:
            cases += [self.cases[point] for point in deck.points]
        return cases

    @cached_property
    def overhead(self) -> float:
        """Predicted CPU time of Python for the missing points, s."""
        return predicted_overhead(self.missing)

    @property
    def core_seconds(self) -> float:
        """Predicted CPU time of all processes for the missing points, s."""
        engines = 0.0
        for deck in self.decks:
            processes = max(self.cases[point].run.ranks for point in deck.points)
            engines += deck.seconds * processes
        return engines + self.overhead

    @property
    def wall_seconds(self) -> float:
        """Predicted time until the sweep is done, s.

        Python works for one deck at a time, while engines of other decks run.
        """
        engines = makespan(seconds_of(self.decks), self.options.decks_at_once)
        return max(engines + PROGRAM_SECONDS, PROGRAM_SECONDS + self.overhead)

    @property
    def core_seconds_apart(self) -> float:
        """Predicted CPU time in s, of the program too, if each missing point had its own deck."""
        engines = 0.0
        for case in self.missing:
            engines += predicted_seconds(case) * case.run.ranks
        return PROGRAM_SECONDS + self.overhead + engines

    def as_text(self) -> str:
        """The plan in a few lines."""
        sweep = self.record.sweep
        keys = ", ".join(with_unit(key, unit) for key, unit in sweep.units.items())
        points = counted(len(self.missing), "point")
        decks = counted(len(self.decks), "deck")
        core_seconds = PROGRAM_SECONDS + self.core_seconds
        at_once = counted(self.options.decks_at_once, "deck")
        lines = [
            f"{sweep.name}: {sweep.title}".rstrip(": "),
            f"  varied     {keys or 'nothing'}",
            f"  points     {len(self.record.runs)}: {status_text(Counter(self.statuses))}",
            f"  to do      {points} in {decks}",
            f"  predicted  {core_seconds:.0f} core-seconds "
            f"({self.core_seconds_apart:.0f} without shared decks), "
            f"{duration_text(self.wall_seconds)} with {at_once} in parallel",
            f"  directory  {self.record.directory}",
        ]
        return fitted_lines(lines)


def plan_sweep(
    sweep: SweepDefinition,
    out: Path,
    options: SweepOptions,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> SweepPlan:
    """Resolve the points of a sweep and find the missing ones; nothing is written.

    The arguments are those of `run_sweep`.

    Raises
    ------
    InputError
        If a point cannot be resolved, or the sweep descends without walkers.
    WalkersError
        If there is no engine (`find_engine`).
    """
    check_utf8(out.absolute())
    binary = find_engine(engine)
    cases = _resolved_cases(sweep, on_progress or _ignore)
    options = options.for_ranks(max(case.run.ranks for case in cases))
    if sweep.until_below is not None and not any(case.walkers for case in cases):
        problem = Problem("descend", None, "expected walkers: a pile has no velocity")
        raise InputError(sweep.source, [problem])
    runs = [run_place(case, binary, out).name for case in cases]
    record = SweepRecord(out / sweep.name, sweep, runs, has_own_runs=options.own_runs)
    if options.site is not None:
        check_path(record.directory)
    point_states = states(record)
    final = recorded_failures(record, point_states, options.final)
    # Points that need no run: those that have failed for good, and the finished ones.
    settled = {failure.point for failure in final}
    statuses = []
    for point, state in enumerate(point_states):
        statuses.append(state.status)
        if state.status == "finished":
            settled.add(point)
    return SweepPlan(
        record=record,
        cases=cases,
        engine=binary,
        decks=_missing_decks(cases, settled, options),
        statuses=statuses,
        options=options,
        final=final,
    )


def _missing_decks(
    cases: Sequence[Case], settled: Collection[int], options: SweepOptions
) -> list[PlannedDeck]:
    """The decks of the points that are not settled: neither finished nor failed for good."""
    longest = LONGEST_SECONDS
    if options.time_limit:
        # A shared deck stays well below the time limit, because a single point may be close to it.
        longest = min(longest, 0.5 * options.time_limit)
    decks: list[PlannedDeck] = []
    for deck in pack(cases, options.decks_at_once, longest):
        decks += unfinished_parts(deck.points, cases, settled)
    return decks


def _ignore(_: Progress) -> None:
    """Show no progress."""


def _resolved_cases(sweep: SweepDefinition, tell: Tell) -> list[Case]:
    """The cases of all points; this takes a second for two thousand."""
    cases: list[Case] = []
    points = len(sweep.rows)
    start = time.perf_counter()
    for case in sweep.cases():
        cases.append(case)
        if len(cases) % _RESOLVED_AT_ONCE == 0:
            share = len(cases) / points
            left = duration_text((1.0 / share - 1.0) * (time.perf_counter() - start))
            tell(Progress(share, f"{len(cases)} of {points} points resolved, {left} left"))
    return cases


def recorded_failures(
    record: SweepRecord, point_states: Sequence[PointState], reasons: Collection[str]
) -> list[Failure]:
    """The failures of points with some reasons, as their run directories have recorded them."""
    failures = []
    for point, state in enumerate(point_states):
        if state.reason in reasons:
            failure = Failure(
                point=point,
                run=record.runs[point],
                reason=state.reason or "",
                message=state.message or "",
                directory=str(state.directory),
            )
            failures.append(failure)
    return failures


def run_sweep(
    sweep: SweepDefinition,
    out: Path,
    options: SweepOptions,
    *,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> tuple[SweepRecord, list[Failure]]:
    """Make the missing runs of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    out
        Folder of the run directories and of the sweep's directory.
    options
        How the sweep is run.
    engine
        Path or name of the engine; None: the installed one.
    on_progress
        Called with the progress a few times per second; its exceptions stop the sweep.

    Returns
    -------
    record : SweepRecord
        The sweep in its directory.
    failures : list of Failure
        The failed points, in order.

    Raises
    ------
    InputError
        If a point is invalid, or the path of the folder cannot be used in the shell scripts of a
        cluster.
    EngineFailure
        If there is no engine, its audit failed, or the sweep's directory was removed during the
        sweep.
    SweepStopped
        If a failure affects every point, or the jobs of the cluster end without doing any work.
    """
    plan = plan_sweep(sweep, out, options, engine, on_progress)
    record = plan.record
    if plan.decks:
        check_audit(plan.engine)
    _warn_if_replaced(record)
    write_record(record)
    _measure_finished(record)
    _allow_many_files()
    failures = plan.final
    if plan.decks:
        with _workers_of(plan) as workers:
            failures = _SweepLoop(plan, workers).run(on_progress or _ignore)
    if not (record.directory / RECORD_NAME).is_file():
        raise OutputGone(record.directory)
    if list(read_sweep_record(record.directory).runs) != list(record.runs):
        raise SweepStopped(
            f"{record.directory} was replaced by another sweep of the same name; the runs are kept"
        )
    unreadable = recorded_failures(record, states(record, results=True), [UNREADABLE])
    return record, [*failures, *unreadable]


def _warn_if_replaced(record: SweepRecord) -> None:
    """Warn if the directory has another sweep, which has no run in common with this one."""
    with suppress(InputError):  # no sweep of this name, or none that can be read
        earlier = read_sweep_record(record.directory)
        if set(earlier.runs).isdisjoint(record.runs):
            warn_user(
                f"{record.directory}: replaces a sweep of the same name without common runs; "
                "figures and reports there show the old one",
                SweepReplacedWarning,
            )


def _measure_finished(record: SweepRecord) -> None:
    """Measure finished runs again whose results are out of date."""
    for place in set(record.places):
        if is_finished(place):
            # A run that cannot be measured is among the failures.
            with suppress(WalkersError, OSError, ValueError):
                ensure_measured(place)


def _allow_many_files() -> None:
    """Raise the limit of open files: each point of a running deck keeps a lock file open."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _workers_of(plan: SweepPlan) -> AbstractContextManager[Workers]:
    """The workers of a sweep; those that are not the caller's stop at the end of the context."""
    options = plan.options
    if options.executor is not None:
        return nullcontext(Workers(options.executor))
    if options.site is not None:
        return pilots(options.site, plan.record.directory / "parsl", options.ranks)
    return threads(options.decks_at_once)


class _SweepLoop:
    """Submits decks to workers until every point is finished or failed.

    Attributes
    ----------
    failures
        Failures of points, which are not repeated.
    decks
        The submitted decks.
    seconds_left
        Predicted time on one core of what is left of all decks at the last look, s.
    looked
        Time of this look, s.
    waiting
        Second halves of failed decks, while no point is finished.
    shares
        Shares of the work of running decks that are done.
    pace
        How fast workers are, compared with the predicted times.
    same_failures
        Numbers of failures of points alone, by the name and the cause of the failure.
    done
        Number of finished points.
    """

    def __init__(self, plan: SweepPlan, workers: Workers) -> None:
        self.plan = plan
        self.record = plan.record
        self.workers = workers
        self.failures = list(plan.final)
        self.decks: dict[Future[DeckOutcome], PlannedDeck] = {}
        self.waiting: list[PlannedDeck] = []
        self.shares: dict[PlannedDeck, float] = {}
        self.same_failures: Counter[tuple[str, str]] = Counter()
        self.seconds = sum(seconds_of(plan.decks))
        self.pace = Pace.of_prediction(self.seconds)
        self.looked = time.perf_counter()
        self.seconds_left = self.seconds
        self.finished_before = plan.statuses.count("finished")
        self.done = self.finished_before

    def run(self, on_progress: Tell) -> list[Failure]:
        """Work until every point is finished or failed; return the failures by their points."""
        last_report = 0.0
        try:
            for deck in self.plan.decks:
                self._submit(deck)
            while self.decks or self.waiting:
                if self.waiting and (self._has_finished_point or not self.decks):
                    self._submit(self.waiting.pop())
                    continue
                for future in wait(self.decks, _LOOK_SECONDS, FIRST_COMPLETED).done:
                    self._handle(self.decks.pop(future), outcome_of(future))
                if time.perf_counter() - last_report > _LOOK_SECONDS:
                    last_report = time.perf_counter()
                    on_progress(self._progress())
        finally:
            for future in self.decks:
                with suppress(NotImplementedError):  # Parsl's
                    future.cancel()
        on_progress(self._progress())
        return sorted(self.failures, key=lambda failure: failure.point)

    @property
    def _has_finished_point(self) -> bool:
        """Whether this sweep has finished a point since it was started."""
        return self.done > self.finished_before

    def _submit(self, deck: PlannedDeck) -> None:
        task = DeckTask(
            runs=[self.record.runs[point] for point in deck.points],
            cases=[self.plan.cases[point] for point in deck.points],
            out=self.record.runs_folder,
            engine=self.plan.engine,
            time_limit=self.plan.options.time_limit,
            dumps=self.plan.options.dumps,
        )
        future = self.workers.executor.submit(make_deck, self.workers.stop, task)
        self.decks[future] = deck

    def _handle(self, deck: PlannedDeck, outcome: DeckOutcome) -> None:
        """Count the points of a deck that has ended, and submit again those that are left.

        The outcome is the failure of the deck, or the names of the runs that are finished now.
        """
        if isinstance(outcome, Failure):
            self._handle_failure(deck, outcome)
            return
        left = [point for point in deck.points if self.record.runs[point] not in outcome]
        self.done += len(deck.points) - len(left)
        if left:  # another process was making these points
            self._submit(PlannedDeck.of_points(left, self.plan.cases))

    def _handle_failure(self, deck: PlannedDeck, failure: Failure) -> None:
        """Repeat a failed deck as two halves; a point that fails alone has failed."""
        is_alone = len(deck.points) == 1
        self._check_affected_points(failure, is_alone=is_alone)
        if is_alone:
            (point,) = deck.points
            self.failures.append(replace(failure, point=point, run=self.record.runs[point]))
            return
        first, second = parts_of(deck.points, 2)
        self._submit(PlannedDeck.of_points(first, self.plan.cases))
        self.waiting.append(PlannedDeck.of_points(second, self.plan.cases))

    def _check_affected_points(self, failure: Failure, *, is_alone: bool) -> None:
        """Raise `SweepStopped` if a failure affects every point.

        It does if its class says so, or if the first points fail alone in the same way, which is
        not due to their parameters.
        """
        at_first = not self._has_finished_point
        if failure.affects == "every point" or (failure.affects == "all at first" and at_first):
            raise SweepStopped(
                f"{failure.message}; this would hit every point, and the sweep is stopped"
            )
        kind = (failure.reason, failure.cause)
        if is_alone:
            self.same_failures[kind] += 1
        are_many = self.same_failures[kind] >= _MOST_SAME_FAILURES
        if are_many and at_first and failure.affects != "one point":
            raise SweepStopped(
                f"{failure.cause}; the first {_MOST_SAME_FAILURES} points failed in the same way, "
                "and the sweep is stopped"
            )

    def _progress(self) -> Progress:
        """The progress of the sweep, by the files of the runs and the predicted times."""
        decks = self._running_decks()
        self._look_at(decks)
        share = 1.0
        if self.seconds:
            share = max(0.0, 1.0 - self.seconds_left / self.seconds)
        running = sum(len(deck.points) for deck in decks)
        points = len(self.record.runs)
        words = [f"{self.done} of {points} points done"]
        if running and share >= _MEASURING:
            words.append("measuring")
        else:
            words.append(f"{100.0 * share:.0f} % of the work")
        if share < 1.0:
            words.append(f"{duration_text(self._wall_seconds_left())} left")
        words.append(f"{running} running")
        if self.failures:
            words.append(f"{len(self.failures)} failed")
        return Progress(share, ", ".join(words))

    def _running_decks(self) -> list[PlannedDeck]:
        """The decks that a process is running."""
        submitted = list(self.decks.values())
        first = submitted[: _DECKS_LOOKED_AT * self.plan.options.decks_at_once]
        return [deck for deck in first if is_locked(self._place_of(deck))]

    def _look_at(self, running: Sequence[PlannedDeck]) -> None:
        """Read what running decks have done, and compare it with the time since the last look."""
        left_before = self.seconds_left
        for deck in running:
            progress = progress_at(self._place_of(deck), self.plan.cases[deck.points[0]])
            share = progress.share if progress else 0.0  # between segments nothing is known
            if deck not in self.shares:
                left_before -= share * deck.seconds  # an interrupted run had done it before
            self.shares[deck] = max(self.shares.get(deck, 0.0), share)
        self.seconds_left = sum(self._seconds_left_of_decks())
        now = time.perf_counter()
        # More is left than before if a deck has failed and is repeated.
        done = max(0.0, left_before - self.seconds_left)
        self.pace = self.pace.after(len(running) * (now - self.looked), done)
        self.looked = now

    def _wall_seconds_left(self) -> float:
        """Estimated time until the sweep is done, s."""
        predicted = makespan(self._seconds_left_of_decks(), self.plan.options.decks_at_once)
        return predicted * self.pace.slowness

    def _seconds_left_of_decks(self) -> list[float]:
        """For each deck that is not done, the predicted time of what is left of it, s."""
        left = []
        for deck in [*self.decks.values(), *self.waiting]:
            left.append(deck.seconds * (1.0 - self.shares.get(deck, 0.0)))
        return left

    def _place_of(self, deck: PlannedDeck) -> Path:
        """The run directory of the first point of a deck."""
        return self.record.runs_folder / self.record.runs[deck.points[0]]
