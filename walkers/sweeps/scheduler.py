"""Schedule a sweep: decks handed to Parsl's workers, what they report taken in, until every point is settled."""

from __future__ import annotations

import resource
import shutil
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from math import nan
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from walkers.inputs.case import Case
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.runner.binary import Engine
from walkers.runner.cost import pairs_of_beads
from walkers.runner.locks import is_locked
from walkers.sweeps.packing import LONGEST_SECONDS, MOST_WALKERS, PlannedDeck, halves, pack, unfinished_parts
from walkers.sweeps.record import PARSL, PointState, SweepRecord, chains, states, velocity_of
from walkers.sweeps.site import Site, pilots, threads
from walkers.sweeps.worker import STOPS, Report, SweepStopped, Task, work
from walkers.templates.sharing import sharing_key

if TYPE_CHECKING:
    from concurrent.futures import Future

_LOOK_SECONDS = 0.25
_BUSY_SECONDS = 2.0
_MOST_LOSSES = 5
"""How often a deck is given out again after its worker was lost (a cancelled job, a node gone down)."""


class ClusterFailed(WalkersError):
    """The cluster's jobs end without having worked."""


@dataclass(frozen=True)
class Options:
    """How a sweep is run.

    Attributes
    ----------
    workers
        How many decks run at once on this machine; on a site its own number counts.
    site
        The cluster, or None for this machine.
    retries
        How often a point that failed is tried again.
    time_limit
        Wall time in s that an engine may take, or None.
    final
        Names of failures after which a point is not run again, not by a later call either: the engine would meet them
        again. They are told as failures each time.
    """

    workers: int
    site: Site | None = None
    retries: int = 0
    time_limit: float | None = None
    final: frozenset[str] = frozenset()

    @property
    def decks_at_once(self) -> int:
        """How many decks run at once, here or on the site."""
        return self.site.workers if self.site else self.workers

    def for_ranks(self, ranks: int) -> Options:
        """The same for decks of so many MPI processes each: fewer of them at once, so that each has its cores."""
        site = replace(self.site, ranks=ranks) if self.site else None
        if site is not None and ranks > site.file.cores:
            told = f"a deck has {ranks} MPI processes (run.ranks), more than the {site.file.cores} cores of a node"
            raise InputError("cores", [Problem("", None, told)])
        return replace(self, workers=max(1, self.workers // ranks), site=site)

    @property
    def longest_seconds(self) -> float:
        """Predicted time that no shared deck may exceed: well below the limit, for a point by itself could be."""
        return min(LONGEST_SECONDS, 0.5 * self.time_limit) if self.time_limit else LONGEST_SECONDS


@dataclass(frozen=True)
class Failure:
    """A point that failed: its number, its run, the name of the failure, what it says, where its remains are."""

    point: int
    run: str
    reason: str
    message: str
    directory: str | None


@dataclass(frozen=True)
class SweepProgress:
    """How far a sweep is: numbers of points, wall time in s since the start, time left in s as far as one can say."""

    points: int
    found: int
    done: int
    failed: int
    running: int
    elapsed: float
    left: float | None
    worst_failure: Failure | None


_WORST_FIRST = (
    # Threaten all points.
    *("EngineMissing", "EngineDiffers", "ProgramDiffers", "DiskFull", "OutputGone", "EngineNeverStarted"),
    *("EngineError", "MissingFrames", "EngineKilled", "EngineSilent", "LogTooLong"),
    "",  # what is not in this list
    *("BlowUp", "BeadsLost", "WalkersMet", "TimeLimitExceeded", "RunBusy"),
)


def _severity(failure: Failure) -> int:
    return _WORST_FIRST.index(failure.reason if failure.reason in _WORST_FIRST else "")


@dataclass(eq=False)
class _Chain:
    """Batches of points of which each waits for the one before."""

    batches: Generator[list[int], None, None]
    unsettled: set[int] = field(default_factory=set)


@dataclass(frozen=True, eq=False)
class _Job:
    """A deck on its way: how often it failed and how often its worker was lost."""

    deck: PlannedDeck
    chain: _Chain
    failures: int = 0
    losses: int = 0


def schedule(
    record: SweepRecord,
    cases: Sequence[Case],
    engine: Engine,
    options: Options,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> list[Failure]:
    """Make all runs of a sweep that are missing.

    Parameters
    ----------
    record
        The sweep.
    cases
        Of its points.
    engine
        The binary.
    options
        How.
    on_progress
        Called whenever a deck has ended, and a few times a second.

    Returns
    -------
    list of Failure
        The points that failed; all others are finished or, below the end of a descent, not needed.

    Raises
    ------
    ClusterFailed
        If the cluster's jobs end without having worked.
    """
    _raise_file_limit()
    out = record.out
    out.mkdir(parents=True, exist_ok=True)
    with _workers(options, record) as workers:
        return _Scheduler(record, cases, engine, options, workers, on_progress).run()


def _raise_file_limit() -> None:
    """Each point of a running deck keeps a lock open."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


@dataclass(frozen=True)
class _Workers:
    """Where tasks are handed in, and what the sweep is called there."""

    submit: Callable[[Task], Future[Report]]
    sweep: str


@contextmanager
def _workers(options: Options, record: SweepRecord) -> Iterator[_Workers]:
    """Start Parsl; at the end its workers and their engines have ended, however the block is left."""
    import parsl

    folder = record.directory / PARSL
    sweep = uuid4().hex
    stop = STOPS[sweep] = threading.Event()
    config = threads(options.workers, folder) if options.site is None else pilots(options.site, folder)
    try:
        kernel = parsl.DataFlowKernel(config)
    except Exception as error:  # whatever Parsl raises: an address that this machine does not have, ports in use
        del STOPS[sweep]
        told = " ".join(str(error).split())
        raise ClusterFailed(
            f"Parsl cannot start ({told}); see {folder}, and [executor] address in the site file"
        ) from error
    try:
        yield _Workers(parsl.python_app(work, data_flow_kernel=kernel), sweep)
    finally:
        stop.set()
        kernel.cleanup()
        del STOPS[sweep]
        if options.site is None:  # threads leave nothing to look into
            shutil.rmtree(kernel.run_dir, ignore_errors=True)
            with suppress(OSError):
                folder.rmdir()


def batches(
    record: SweepRecord, cases: Sequence[Case], stopped: Callable[[int], bool]
) -> list[Generator[list[int], None, None]]:
    """The order in which points may be made.

    Parameters
    ----------
    record, cases
        The sweep.
    stopped
        Whether the walkers of a settled point were at rest.

    Returns
    -------
    list of generators
        Each yields batches of points; the next is to be asked for when the last is settled. A sweep without a descent
        is one batch. Descents go down side by side where their points can share a deck, and so many steps at once as
        fill one: those below where a descent ends are made in vain, but cost less than decks that are nearly empty.
    """
    if record.descent is None:
        return [(numbers for numbers in [list(range(len(cases)))])]
    together: dict[Any, list[list[int]]] = {}
    for chain in chains(record):
        together.setdefault(sharing_key(cases[chain[0]]), []).append(chain)

    def descend(descents: list[list[int]]) -> Generator[list[int], None, None]:
        step = 0
        while descents and step < len(descents[0]):
            after = step + _steps_at_once([[cases[point] for point in chain[step:]] for chain in descents])
            yield [point for chain in descents for point in chain[step:after]]
            descents = [chain for chain in descents if not any(map(stopped, chain[step:after]))]
            step = after

    return [descend(group) for group in together.values()]


def _steps_at_once(descents: Sequence[Sequence[Case]]) -> int:
    """How many steps of descents can share a deck."""
    if len({sharing_key(case) for chain in descents for case in chain}) > 1:
        return 1
    return max(1, MOST_WALKERS // sum(pairs_of_beads(chain[0]) for chain in descents))


def final_failures(record: SweepRecord, found: Sequence[PointState], options: Options) -> list[Failure]:
    """The points that failed before for one of the reasons that are final."""
    return [
        Failure(point, run, state.reason or "", state.message or "", str(state.directory))
        for point, (run, state) in enumerate(zip(record.runs, found, strict=True))
        if state.status == "failed" and state.reason in options.final
    ]


class _Scheduler:
    """Hands out decks and takes in reports."""

    def __init__(
        self,
        record: SweepRecord,
        cases: Sequence[Case],
        engine: Engine,
        options: Options,
        workers: _Workers,
        on_progress: Callable[[SweepProgress], None] | None,
    ) -> None:
        self.record, self.options, self.parsl, self.engine = record, options, workers, engine
        self.cases: Mapping[int, Case] = dict(enumerate(cases))
        self.on_progress = on_progress or (lambda _: None)
        found = states(record)
        known = zip(record.runs, found, strict=True)
        finished = [(run, state.directory) for run, state in known if state.status == "finished"]
        self.places = {run: directory for run, directory in finished if directory is not None}
        self.finished = set(self.places)
        self.velocities: dict[str, float] = {}
        self.failures = final_failures(record, found, options)
        self.given_up = {failure.run for failure in self.failures}
        self.ended: SimpleQueue[tuple[_Job, Future[Report]]] = SimpleQueue()
        self.out_there: dict[_Job, None] = {}
        self.later: list[tuple[float, _Job]] = []
        self.begin = time.perf_counter()
        self.seconds_done = 0.0
        self.found = len(finished)
        self.done = 0
        self.told = 0.0

    def run(self) -> list[Failure]:
        for batch in batches(self.record, list(self.cases.values()), self._stopped):
            self._advance(_Chain(batch))
        while self.out_there or self.later:
            now = time.perf_counter()
            for due, job in [entry for entry in self.later if entry[0] <= now]:
                self.later.remove((due, job))
                self._hand_out(job)
            with suppress(Empty):
                self._take_in(*self.ended.get(timeout=_LOOK_SECONDS))
            self._tell(now)
        self.on_progress(self._progress())
        return sorted(self.failures, key=lambda failure: failure.point)

    def _stopped(self, point: int) -> bool:
        run = self.record.runs[point]
        if run in self.places and run not in self.velocities:
            self.velocities[run] = velocity_of(self.places[run])
        return self.record.descent is not None and self.record.descent.at_rest(self.velocities.get(run, nan))

    def _is_settled(self, point: int) -> bool:
        run = self.record.runs[point]
        return run in self.finished or run in self.given_up

    def _advance(self, chain: _Chain) -> None:
        """Hand out the next batch of which anything is missing."""
        while not chain.unsettled:
            batch = next(chain.batches, None)
            if batch is None:
                return
            chain.unsettled = {point for point in batch if not self._is_settled(point)}
            if chain.unsettled:
                for deck in pack(
                    {point: self.cases[point] for point in batch},
                    self.options.decks_at_once,
                    self.options.longest_seconds,
                ):
                    for part in unfinished_parts(deck.points, self.cases, self._is_settled):
                        self._hand_out(_Job(part, chain))

    def _hand_out(self, job: _Job) -> None:
        task = Task(
            sweep=self.parsl.sweep,
            runs=tuple(self.record.runs[point] for point in job.deck.points),
            cases=tuple(self.cases[point] for point in job.deck.points),
            out=self.record.out,
            engine=str(self.engine.path),
            sha256=self.engine.sha256,
            time_limit=self.options.time_limit,
        )
        self.out_there[job] = None
        self.parsl.submit(task).add_done_callback(lambda future: self.ended.put((job, future)))

    def _take_in(self, job: _Job, future: Future[Report]) -> None:
        del self.out_there[job]
        error = future.exception()
        report = self._lost(job, error) if error else future.result()
        if report is None:
            return
        self.finished |= set(report.finished)
        self.velocities |= {run: velocity for run, (_, velocity) in report.finished.items()}
        settled = [point for point in job.deck.points if self._is_settled(point)]
        left = [point for point in job.deck.points if not self._is_settled(point)]
        self.seconds_done += job.deck.seconds * len(settled) / len(job.deck.points)
        if report.failure:
            self._failed(job, report, left)
        elif left:
            self.later.append((time.perf_counter() + _BUSY_SECONDS, replace(job, deck=self._deck_of(left, job))))
        self.done += len(settled)
        job.chain.unsettled -= set(settled)
        self._advance(job.chain)

    def _deck_of(self, points: Sequence[int], job: _Job) -> PlannedDeck:
        return PlannedDeck(tuple(points), job.deck.seconds * len(points) / len(job.deck.points))

    def _failed(self, job: _Job, report: Report, left: Sequence[int]) -> None:
        """Try the points of a deck apart, a point by itself as often as told."""
        if not left or (report.failure == SweepStopped.__name__ and STOPS[self.parsl.sweep].is_set()):
            return
        if len(left) > 1:
            for half in halves(left):
                self._hand_out(replace(job, deck=self._deck_of(half, job)))
        elif job.failures < self.options.retries:
            self._hand_out(replace(job, failures=job.failures + 1))
        else:
            (point,) = left
            run = self.record.runs[point]
            failure = Failure(point, run, report.failure or "", report.message, report.directory)
            self.failures.append(failure)
            self.seconds_done += job.deck.seconds
            job.chain.unsettled -= {point}
            self._advance(job.chain)

    def _lost(self, job: _Job, error: BaseException) -> Report | None:
        """An exception out of a worker: lost with its job or node, or something that nobody foresaw."""
        from parsl.executors.errors import BadStateException
        from parsl.executors.high_throughput.errors import ManagerLost, WorkerLost

        if isinstance(error, BadStateException):
            first = " ".join(str(error).partition("Error 2:")[0].split())  # the others say the same
            raise ClusterFailed(f"the cluster's jobs fail: {first}") from error
        if isinstance(error, (ManagerLost, WorkerLost)) and job.losses < _MOST_LOSSES:
            self._hand_out(replace(job, losses=job.losses + 1))
            return None
        return Report(failure=type(error).__name__, message=str(error) or repr(error))

    def _tell(self, now: float) -> None:
        if now - self.told > _LOOK_SECONDS:
            self.told = now
            self.on_progress(self._progress())

    def _progress(self) -> SweepProgress:
        running = sum(
            len(job.deck.points)
            for job in list(self.out_there)[: 4 * self.options.decks_at_once]
            if is_locked(self.record.out / self.record.runs[job.deck.points[0]])
        )
        waiting = sum(job.deck.seconds for job in [*self.out_there, *(job for _, job in self.later)])
        elapsed = time.perf_counter() - self.begin
        return SweepProgress(
            points=len(self.record.runs),
            found=self.found,
            done=self.found + self.done,
            failed=len(self.failures),
            running=running,
            elapsed=elapsed,
            left=waiting / self.seconds_done * elapsed if self.seconds_done else None,
            worst_failure=min(self.failures, key=_severity, default=None),
        )
