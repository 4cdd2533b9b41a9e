"""Run a sweep: pack its points into decks, and have workers run the decks until every point is finished or failed.

Each deck has a start-up time and a cost per step that do not depend on its contents: few decks are cheaper. Many decks
use the cores more evenly and give results sooner. Decks are packed by their predicted cost, so that all cores finish
together. The packing depends on the whole sweep and the number of workers, not on the finished points: an interrupted
sweep continues with the same decks.

A `concurrent.futures.Executor` runs the decks: threads on this machine, Parsl's workers on a cluster, or the caller's
executor. Parsl repeats a deck whose worker was lost. A deck that fails is repeated here, as two halves; until a point
is finished, the second half waits for the first. A failure that hits every point stops the sweep.
"""

from __future__ import annotations

import errno
import heapq
import resource
import threading
import time
import warnings
from collections import Counter
from collections.abc import Collection, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, inf
from pathlib import Path
from platform import node
from typing import TYPE_CHECKING, TypeAlias

from walkers.errors import InputError, Problem, Stopped, WalkersError, check_utf8, input_error
from walkers.inputs.sweep import SweepDefinition
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.results import ensure_measured
from walkers.progress import Progress, Tell
from walkers.rounding import counted, duration_text
from walkers.runner.audit import check_audit
from walkers.runner.binary import Engine, find_engine
from walkers.runner.cost import (
    PROGRAM_SECONDS,
    pairs_of_beads,
    predicted_overhead,
    predicted_seconds,
)
from walkers.runner.failures import (
    DiskFull,
    EngineDiffers,
    EngineFailure,
    OutputGone,
    ProgramDiffers,
)
from walkers.runner.process import cores_here
from walkers.runner.run_directory import is_finished, is_locked, run_place, unfinished
from walkers.runs.making import make_runs, progress_at
from walkers.runs.status import PointState, status_text
from walkers.sweeps.record import (
    RECORD_NAME,
    UNREADABLE,
    SweepRecord,
    read_sweep_record,
    states,
    write_record,
)
from walkers.sweeps.site import check_path, decks_at, prepare
from walkers.templates.placement import sharing_key
from walkers.text import with_unit

if TYPE_CHECKING:
    from parsl.config import Config

MOST_WALKERS = 96
"""Limit for a deck; with 96 walkers the cost of the deck itself is 4 % of the total."""
MOST_POINTS = 64
LONGEST_SECONDS = 60.0
"""Limit of the predicted time of a deck of several points, so that results appear regularly."""
_TRIALS = 24
_AS_GOOD = 1.02
_RESOLVED_AT_ONCE = 1_000
"""Number of points after which the progress of resolving them is reported."""
_LOOK_SECONDS = 0.25
_MEASURING = 0.995
"""Share of the work of the engine from which on running points count as being measured."""
_MOST_ALIKE = 3  # points that fail alone in the same way, before any point is finished


class SweepReplacedWarning(UserWarning):
    """Another sweep file of the same name had the directory of a sweep."""


class SweepStopped(WalkersError):
    """A failure that hits every point, or jobs of a cluster that end without doing any work."""


@dataclass(frozen=True)
class SweepOptions:
    """Options of a sweep: cores of this machine (``workers``, None: all), or a cluster; MPI processes of a deck.

    An ``executor`` that is handed over runs as many decks at once as there are ``workers``. Failures with the names
    ``final`` are never repeated. An engine may take the ``time_limit``, s. Without ``dumps`` runs keep no dumps.
    """

    workers: int | None = None
    site: Config | None = None
    executor: Executor | None = None
    time_limit: float | None = None
    final: frozenset[str] = frozenset()
    ranks: int = 1
    dumps: bool = True

    @property
    def decks_at_once(self) -> int:
        """Number of decks that run at the same time."""
        if self.executor is None and self.site is not None:
            return decks_at(self.site, self.ranks)
        workers = self.workers or cores_here()
        return workers if self.executor is not None else max(1, workers // self.ranks)

    def for_ranks(self, ranks: int) -> SweepOptions:
        """The same options for decks with a number of MPI processes; `InputError` if a node has fewer cores."""
        options = replace(self, ranks=ranks)
        if not options.decks_at_once:
            raise input_error(
                "cores",
                f"a deck has {ranks} MPI processes (run.ranks), more than the cores of a node",
            )
        return options


@dataclass(frozen=True)
class Failure:
    """A failed point of a sweep.

    Attributes
    ----------
    point
        Number of the point.
    run
        Name of its run.
    reason
        Name of the failure, such as ``BlowUp``.
    message
        What failed, and where its files are.
    directory
        Directory of the unfinished run; None if there is none.
    hits
        Which points such a failure affects, see `walkers.runner.failures.EngineFailure`.
    cause
        The message without the directory: the same of points that fail alike.
    """

    point: int
    run: str
    reason: str
    message: str
    directory: str | None
    hits: str = field(default="", repr=False)
    cause: str = field(default="", repr=False)


@dataclass(frozen=True)
class PlannedDeck:
    """Numbers of the points of a deck, in order, and its predicted time in s on one core."""

    points: tuple[int, ...]
    seconds: float


def pack(
    cases: Sequence[Case], workers: int, longest_seconds: float = LONGEST_SECONDS
) -> list[PlannedDeck]:
    """Pack points into decks for a number of workers; the longest decks come first.

    The predicted time of a deck of several points is at most ``longest_seconds``.
    """
    groups: dict[Hashable, list[int]] = {}
    for number, case in enumerate(cases):
        groups.setdefault(sharing_key(case), []).append(number)
    whole = sum(_deck(group, cases).seconds for group in groups.values())
    longest = max(_deck([number], cases).seconds for number in range(len(cases)))
    plans = []
    for trial in range(_TRIALS if len(groups) < len(cases) else 1):
        length = min(2.0 * max(whole / workers, longest) * 2.0 ** (-trial / 4), longest_seconds)
        plans.append([deck for group in groups.values() for deck in _parted(group, cases, length)])
    spans = [makespan((deck.seconds for deck in plan), workers) for plan in plans]
    # Among plans that take equally long, choose the smallest decks.
    good = max(number for number, span in enumerate(spans) if span <= _AS_GOOD * min(spans))
    return sorted(plans[good], key=lambda deck: -deck.seconds)


def _parted(group: Sequence[int], cases: Sequence[Case], longest: float) -> list[PlannedDeck]:
    """The smallest number of decks for a group within the limits, which do not apply to a deck of one point."""
    most_walkers = max(pairs_of_beads(cases[number]) for number in group)

    def is_possible(points: int) -> bool:
        walkers = points * most_walkers
        seconds = predicted_seconds(cases[group[0]], walkers)  # a group shares the number of steps
        return points == 1 or (
            points <= MOST_POINTS and walkers <= MOST_WALKERS and seconds <= longest
        )

    parts = next(
        parts for parts in range(1, len(group) + 1) if is_possible(ceil(len(group) / parts))
    )
    return [_deck(part, cases) for part in _parts(group, parts)]


def _parts(group: Sequence[int], count: int) -> list[Sequence[int]]:
    """Split a sequence into consecutive parts whose lengths differ by at most one."""
    edges = [len(group) * number // count for number in range(count + 1)]
    return [group[start:end] for start, end in pairwise(edges)]


def _deck(points: Sequence[int], cases: Sequence[Case]) -> PlannedDeck:
    walkers = sum(pairs_of_beads(cases[number]) for number in points)
    return PlannedDeck(tuple(points), predicted_seconds(cases[points[0]], walkers))


def makespan(seconds: Iterable[float], workers: int) -> float:
    """Time in s until all decks are done, if each free worker takes the longest deck that is left."""
    durations = sorted(seconds, reverse=True)
    ends = [0.0] * max(1, min(workers, len(durations)))
    for duration in durations:
        heapq.heapreplace(ends, ends[0] + duration)
    return max(ends)


def unfinished_parts(
    points: Sequence[int], cases: Sequence[Case], finished: Collection[int]
) -> list[PlannedDeck]:
    """The unfinished part of a deck: the deck itself, or its largest halves, quarters, … without a finished point.

    A deck that fails is repeated as two halves. So the same decks are left whenever the sweep is interrupted.
    """
    done = [number in finished for number in points]
    if not any(done):
        return [_deck(points, cases)]
    return (
        []
        if all(done)
        else [
            deck for half in _parts(points, 2) for deck in unfinished_parts(half, cases, finished)
        ]
    )


@dataclass(frozen=True)
class SweepPlan:
    """Plan of a sweep: points with their status, missing decks, failures that are not repeated."""

    record: SweepRecord
    cases: Sequence[Case]
    engine: Engine
    decks: Sequence[PlannedDeck]
    statuses: Sequence[str]
    options: SweepOptions
    final: list[Failure]

    @cached_property
    def missing(self) -> list[Case]:
        """The cases of the points that are made."""
        return [self.cases[point] for deck in self.decks for point in deck.points]

    @cached_property
    def overhead(self) -> float:
        """Predicted CPU time of Python for the missing points, s."""
        return predicted_overhead(self.missing)

    @property
    def core_seconds(self) -> float:
        """Predicted CPU time of all processes for the missing points, s."""
        decks = (
            deck.seconds * max(self.cases[point].run.ranks for point in deck.points)
            for deck in self.decks
        )
        return sum(decks) + self.overhead

    def as_text(self) -> str:
        """The plan in a few lines."""
        record, at_once, missing = self.record, self.options.decks_at_once, self.missing
        besides = PROGRAM_SECONDS + self.overhead
        whole = PROGRAM_SECONDS + self.core_seconds
        apart = besides + sum(predicted_seconds(case) * case.run.ranks for case in missing)
        # Python works for one deck at a time, while other engines run.
        until = max(
            makespan((deck.seconds for deck in self.decks), at_once) + PROGRAM_SECONDS, besides
        )
        keys = ", ".join(with_unit(key, unit) for key, unit in record.sweep.units.items())
        return "\n".join(
            [
                f"{record.sweep.name}: {record.sweep.title}".rstrip(": "),
                f"  varied     {keys or 'nothing'}",
                f"  points     {len(record.runs)}: {status_text(Counter(self.statuses))}",
                f"  to do      {counted(len(missing), 'point')} in {counted(len(self.decks), 'deck')}",
                f"  predicted  {whole:.0f} core-seconds ({apart:.0f} without shared decks), "
                f"{duration_text(until)} with {counted(at_once, 'deck')} in parallel",
                f"  directory  {record.directory}",
            ]
        )


def _resolved(sweep: SweepDefinition, tell: Tell) -> list[Case]:
    """The cases of all points, which take a second for two thousand."""
    cases: list[Case] = []
    points = len(sweep.rows)
    begin = time.perf_counter()
    for case in sweep.cases():
        cases.append(case)
        if len(cases) % _RESOLVED_AT_ONCE == 0:
            share = len(cases) / points
            left = duration_text((1.0 / share - 1.0) * (time.perf_counter() - begin))
            tell(Progress(share, f"{len(cases)} of {points} points resolved, {left} left"))
    return cases


def plan_sweep(
    sweep: SweepDefinition,
    out: Path,
    options: SweepOptions,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> SweepPlan:
    """Resolve the points of a sweep and find the missing ones; nothing is written. Arguments: see `run_sweep`."""
    check_utf8(out.absolute())
    binary = find_engine(engine)
    cases = _resolved(sweep, on_progress or (lambda _: None))
    options = options.for_ranks(max(case.run.ranks for case in cases))
    if sweep.until_below is not None and not any(case.walkers for case in cases):
        raise InputError(
            sweep.source, [Problem("descend", None, "expected walkers: a pile has no velocity")]
        )
    record = SweepRecord(
        out / sweep.name, sweep, [run_place(case, binary, out).name for case in cases]
    )
    if options.site is not None:
        check_path(record.directory)
    point_states = states(record)
    final = _failures(record, point_states, options.final)
    settled = {point for point, state in enumerate(point_states) if state.status == "finished"}
    settled |= {failure.point for failure in final}
    # A shared deck stays well below the time limit, because a single point may be close to it.
    longest = min(LONGEST_SECONDS, 0.5 * (options.time_limit or inf))
    packed = pack(cases, options.decks_at_once, longest)
    decks = [part for deck in packed for part in unfinished_parts(deck.points, cases, settled)]
    return SweepPlan(
        record, cases, binary, decks, [state.status for state in point_states], options, final
    )


def _failures(
    record: SweepRecord, states: Sequence[PointState], reasons: Collection[str]
) -> list[Failure]:
    points = enumerate(zip(record.runs, states, strict=True))
    return [
        Failure(point, run, state.reason or "", state.message or "", str(state.directory))
        for point, (run, state) in points
        if state.reason in reasons
    ]


def run_sweep(
    sweep: SweepDefinition,
    out: Path,
    options: SweepOptions,
    *,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> tuple[SweepRecord, list[Failure]]:
    """Make the missing runs of a sweep, and return its record and the failed points.

    `InputError` if a point is invalid, or the path of the folder cannot be used in the shell scripts of a cluster;
    `EngineFailure` if there is no engine, its audit failed, or the sweep's directory was removed during the sweep;
    `SweepStopped` if a failure hits every point, or the jobs of the cluster end without doing any work.
    """
    plan = plan_sweep(sweep, out, options, engine, on_progress)
    record = plan.record
    if plan.decks:
        check_audit(plan.engine)
    with suppress(InputError):  # no sweep of this name, or none that can be read
        if not set(read_sweep_record(record.directory).runs) & set(record.runs):
            text = "replaces a sweep of the same name without common runs; figures and reports there show the old one"
            warnings.warn(f"{record.directory}: {text}", SweepReplacedWarning, stacklevel=2)
    write_record(record)
    for place in {record.out / run for run in record.runs}:
        if is_finished(place):
            with suppress(WalkersError, OSError, ValueError):  # it is among the failures
                ensure_measured(place)
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):  # each point of a running deck keeps a lock file open
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    failures = plan.final
    if plan.decks:
        with _workers(plan.options, record) as (executor, stop):
            failures = _Loop(plan, executor, stop).run(on_progress or (lambda _: None))
    if not (record.directory / RECORD_NAME).is_file():
        raise OutputGone(record.directory)
    if list(read_sweep_record(record.directory).runs) != list(record.runs):
        raise SweepStopped(
            f"{record.directory} was replaced by another sweep of the same name; the runs are kept"
        )
    return record, [*failures, *_failures(record, states(record, results=True), [UNREADABLE])]


# --- workers ----------------------------------------------------------------------------------------------------------


Report: TypeAlias = list[str] | Failure
"""Outcome of a deck: names of its finished runs, or a failure of a point that is not known."""


def work(
    stop: threading.Event | None,
    runs: Sequence[str],
    cases: Sequence[Case],
    out: Path,
    engine: Engine,
    time_limit: float | None,
    dumps: bool = True,
) -> Report:
    """Make the runs of a deck on a worker, until ``stop`` is set. Known failures are returned, not raised."""

    def look(_: object = None) -> None:
        if stop is not None and stop.is_set():
            raise Stopped("stopped")

    try:
        look()
        local = find_engine(str(engine.path))
        if local.sha256 != engine.sha256:
            raise EngineDiffers(
                f"the engine on {node()}, {local.path}, is not the engine that started this sweep"
            )
        if list(runs) != [run_place(case, local, out).name for case in cases]:
            raise ProgramDiffers(
                f"the program on {node()} has another version than the one that started the sweep"
            )
        return [*make_runs(cases, out, local, dumps=dumps, on_progress=look, time_limit=time_limit)]
    except (OSError, WalkersError) as error:
        kind: type[Exception] = type(error)
        message = cause = str(error)
        directory = None
        if isinstance(error, EngineFailure):
            cause = error.message
            directory = str(unfinished(out / runs[0])) if error.directory else None
        elif isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            kind = DiskFull
            message = cause = f"disk full: {error.filename or out}"
        elif isinstance(error, OSError) and error.filename:
            kind = OutputGone if error.errno == errno.ENOENT else kind
            message = cause = f"{error.filename}: {error.strerror}"
        return Failure(
            -1, "", kind.__name__, message, directory, getattr(kind, "affects", ""), cause
        )


@contextmanager
def _workers(
    options: SweepOptions, record: SweepRecord
) -> Iterator[tuple[Executor, threading.Event | None]]:
    """The executor of a sweep, and the event that stops its threads; threads and Parsl's workers end with it."""
    if options.executor is not None:
        yield options.executor, None
        return
    if options.site is None:
        stop = threading.Event()
        with ThreadPoolExecutor(options.decks_at_once) as threads:
            try:
                yield threads, stop
            finally:
                stop.set()
        return
    from parsl import DataFlowKernel
    from parsl.concurrent import ParslPoolExecutor

    folder = record.directory / "parsl"  # its scripts and logs
    try:
        kernel = DataFlowKernel(prepare(options.site, folder, options.ranks))
    except (
        Exception
    ) as error:  # any class: an address that this machine does not have, ports in use
        text = " ".join(str(error).split())
        text = f"Parsl cannot start ({text}); see {folder}, and the address in the site file"
        raise SweepStopped(text) from error
    try:
        yield ParslPoolExecutor(dfk=kernel), None
    finally:  # the executor would wait for the decks
        kernel.cleanup()


def _report_of(future: Future[Report]) -> Report:
    """The report of a deck, or a failure if the cluster lost it; an error of the program is raised."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, BrokenExecutor):
        raise SweepStopped(f"the executor's workers ended: {error}") from error
    if type(error).__module__.startswith("parsl."):
        from parsl.errors import ParslError
        from parsl.executors.errors import BadStateException

        if isinstance(error, BadStateException):
            first = " ".join(
                str(error).partition("Error 2:")[0].split()
            )  # the other errors repeat the first
            raise SweepStopped(f"the cluster's jobs fail: {first}") from error
        if isinstance(error, ParslError):
            text = str(error) or repr(error)
            return Failure(-1, "", type(error).__name__, text, None, cause=text)
    raise error


class _Loop:
    def __init__(self, plan: SweepPlan, executor: Executor, stop: threading.Event | None) -> None:
        self.plan, self.record, self.executor, self.stop = plan, plan.record, executor, stop
        self.failures = list(plan.final)
        self.decks: dict[Future[Report], PlannedDeck] = {}  # submitted
        self.halves: list[
            PlannedDeck
        ] = []  # second halves of failed decks, while no point is finished
        self.shares: dict[PlannedDeck, float] = {}  # of running decks, that are done
        self.alone: Counter[tuple[str, str]] = (
            Counter()
        )  # failures of points alone, by name and message
        self.begin, self.seconds = time.perf_counter(), sum(deck.seconds for deck in plan.decks)
        self.finished_before = self.done = plan.statuses.count("finished")

    def run(self, on_progress: Tell) -> list[Failure]:
        """Work until every point is finished or failed; return the failures in the order of the points."""
        shown = 0.0
        try:
            for deck in self.plan.decks:
                self._submit(deck)
            while self.decks or self.halves:
                if self.halves and (self.done > self.finished_before or not self.decks):
                    self._submit(self.halves.pop())
                    continue
                for future in wait(self.decks, _LOOK_SECONDS, FIRST_COMPLETED).done:
                    self._take_in(self.decks.pop(future), _report_of(future))
                if time.perf_counter() - shown > _LOOK_SECONDS:
                    shown = time.perf_counter()
                    on_progress(self._progress())
        finally:
            for future in self.decks:
                with suppress(NotImplementedError):  # Parsl's
                    future.cancel()
        on_progress(self._progress())
        return sorted(self.failures, key=lambda failure: failure.point)

    def _submit(self, deck: PlannedDeck) -> None:
        plan = self.plan
        runs, cases = (
            [self.record.runs[point] for point in deck.points],
            [plan.cases[point] for point in deck.points],
        )
        how = (self.record.out, plan.engine, plan.options.time_limit, plan.options.dumps)
        self.decks[self.executor.submit(work, self.stop, runs, cases, *how)] = deck

    def _take_in(self, deck: PlannedDeck, report: Report) -> None:
        """Count finished points, and submit the others again: in halves if the deck failed."""
        failure, finished = (report, []) if isinstance(report, Failure) else (None, report)
        left = [point for point in deck.points if self.record.runs[point] not in finished]
        self.done += len(deck.points) - len(left)
        if failure:
            self._check_hits(failure, alone=len(left) == 1)
        if failure and len(left) == 1:
            self.failures.append(replace(failure, point=left[0], run=self.record.runs[left[0]]))
        elif left:  # without a failure another process was making these points
            first, *second = (
                _deck(part, self.plan.cases) for part in _parts(left, 2 if failure else 1)
            )
            self._submit(first)
            self.halves += second

    def _check_hits(self, failure: Failure, *, alone: bool) -> None:
        """Raise `SweepStopped` if a failure hits every point, or the first points alone in the same way."""
        at_first = self.done == self.finished_before
        alike = (failure.reason, failure.cause)
        if failure.hits == "every point" or (failure.hits == "all at first" and at_first):
            raise SweepStopped(
                f"{failure.message}; this would hit every point, and the sweep is stopped"
            )
        self.alone[alike] += alone
        if (
            self.alone[alike] >= _MOST_ALIKE and at_first and failure.hits != "one point"
        ):  # not by its parameters
            text = (
                f"the first {_MOST_ALIKE} points failed in the same way, and the sweep is stopped"
            )
            raise SweepStopped(f"{failure.cause}; {text}")

    def _progress(self) -> Progress:
        first = list(self.decks.values())[
            : 4 * self.plan.options.decks_at_once
        ]  # later decks have not started
        decks = [
            deck for deck in first if is_locked(self.record.out / self.record.runs[deck.points[0]])
        ]
        running, points, failed = (
            sum(len(deck.points) for deck in decks),
            len(self.record.runs),
            len(self.failures),
        )
        words = [f"{self.done} of {points} points done, {running} running, {failed} failed"]
        for deck in decks:  # between the segments of a run nothing is known
            first_point = deck.points[0]
            at = progress_at(
                self.record.out / self.record.runs[first_point], self.plan.cases[first_point]
            )
            self.shares[deck] = max(self.shares.get(deck, 0.0), at.share if at else 0.0)
        left = [
            deck.seconds * (1.0 - self.shares.get(deck, 0.0))
            for deck in (*self.decks.values(), *self.halves)
        ]
        share = max(0.0, 1.0 - sum(left) / self.seconds) if self.seconds else 1.0
        words.append(
            "measuring" if running and share >= _MEASURING else f"{100.0 * share:.0f} % of the work"
        )
        if 0.0 < share < 1.0:
            words.append(
                f"{duration_text((1.0 / share - 1.0) * (time.perf_counter() - self.begin))} left"
            )
        return Progress(share, ", ".join(words))
