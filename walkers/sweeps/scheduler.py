"""Schedule a sweep: decks handed to Parsl's workers, what they report taken in, until every point is settled."""

from __future__ import annotations

import resource
import shutil
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
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
from walkers.templates.scene import sharing_key

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


@dataclass(frozen=True, eq=False)
class _Job:
    """A deck on its way, of which group of points: how often it failed and how often its worker was lost."""

    deck: PlannedDeck
    group: int
    failures: int = 0
    losses: int = 0


def schedule(
    record: SweepRecord,
    cases: Sequence[Case],
    engine: Engine,
    options: Options,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> list[Failure]:
    """Make all runs of a sweep that are missing, as `walkers.sweeps.run.run_sweep` says.

    Returns
    -------
    list of Failure
        The points that failed; all others are finished or, below the end of a descent, not needed.

    Raises
    ------
    ClusterFailed
        If the cluster's jobs end without having worked.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):  # each point of a running deck keeps a lock open
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    record.out.mkdir(parents=True, exist_ok=True)
    with _workers(options, record) as (sweep, submit):
        return _Scheduler(record, cases, engine, options, sweep, submit, on_progress or (lambda _: None)).run()


@contextmanager
def _workers(options: Options, record: SweepRecord) -> Iterator[tuple[str, Callable[[Task], Future[Report]]]]:
    """Start Parsl; yield what the sweep is called there, and what takes tasks.

    At the end the workers and their engines have ended, however the block is left.
    """
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
        yield sweep, parsl.python_app(work, data_flow_kernel=kernel)
    finally:
        stop.set()
        kernel.cleanup()
        del STOPS[sweep]
        if options.site is None:  # threads leave nothing to look into
            shutil.rmtree(kernel.run_dir, ignore_errors=True)
            with suppress(OSError):
                folder.rmdir()


def _groups(record: SweepRecord, cases: Sequence[Case]) -> list[list[list[int]]]:
    """The points in groups that are made side by side: all points, or descents that may share decks."""
    together: dict[Any, list[list[int]]] = {}
    for chain in chains(record):
        together.setdefault(sharing_key(cases[chain[0]]) if record.descent else None, []).append(chain)
    return list(together.values())


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
        sweep: str,
        submit: Callable[[Task], Future[Report]],
        on_progress: Callable[[SweepProgress], None],
    ) -> None:
        self.record, self.cases, self.engine, self.options = record, cases, engine, options
        self.sweep, self.submit, self.on_progress = sweep, submit, on_progress
        self.groups = _groups(record, cases)
        found = states(record)
        self.finished = {run for run, state in zip(record.runs, found, strict=True) if state.status == "finished"}
        self.velocities: dict[str, float] = {}
        self.failures = final_failures(record, found, options)
        self.given_up = {failure.run for failure in self.failures}
        self.ended: SimpleQueue[tuple[_Job, Future[Report]]] = SimpleQueue()
        self.out_there: dict[_Job, None] = {}
        self.later: list[tuple[float, _Job]] = []
        self.begin = time.perf_counter()
        self.seconds_done = 0.0
        self.found = sum(state.status == "finished" for state in found)
        self.done = 0
        self.told = 0.0

    def run(self) -> list[Failure]:
        self._advance(range(len(self.groups)))
        while self.out_there or self.later:
            now = time.perf_counter()
            for due, job in [entry for entry in self.later if entry[0] <= now]:
                self.later.remove((due, job))
                self._hand_out(job)
            with suppress(Empty):
                job, future = self.ended.get(timeout=_LOOK_SECONDS)
                self._take_in(job, future)
                self._advance([job.group])
            if now - self.told > _LOOK_SECONDS:
                self.told = now
                self.on_progress(self._progress())
        self.on_progress(self._progress())
        return sorted(self.failures, key=lambda failure: failure.point)

    def _is_settled(self, point: int) -> bool:
        run = self.record.runs[point]
        return run in self.finished or run in self.given_up

    def _advance(self, groups: Iterable[int]) -> None:
        """Hand out what may be made next of the groups of which nothing is on its way."""
        busy = {job.group for job in (*self.out_there, *(job for _, job in self.later))}
        for group in groups:
            numbered = {} if group in busy else {point: self.cases[point] for point in self._batch(self.groups[group])}
            for deck in pack(numbered, self.options.decks_at_once, self.options.longest_seconds) if numbered else ():
                for part in unfinished_parts(deck.points, numbered, self._is_settled):
                    self._hand_out(_Job(part, group))

    def _batch(self, descents: Sequence[list[int]]) -> list[int]:
        """The first points of a group of which some are not settled; none if all that are needed are.

        Descents go down side by side, so many steps at once as fill a deck: those below where a descent ends are made
        in vain, but cost less than decks that are nearly empty.
        """
        step = 0
        while descents and step < len(descents[0]):
            after = step + self._steps_at_once([chain[step:] for chain in descents])
            batch = [point for chain in descents for point in chain[step:after]]
            if not all(map(self._is_settled, batch)):
                return batch
            descents = [chain for chain in descents if not any(map(self._stopped, chain[step:after]))]
            step = after
        return []

    def _steps_at_once(self, descents: Sequence[Sequence[int]]) -> int:
        """How many steps of descents can share a deck; all points of a sweep without descents go at once."""
        if self.record.descent is None:
            return len(descents[0])
        if len({sharing_key(self.cases[point]) for chain in descents for point in chain}) > 1:
            return 1
        return max(1, MOST_WALKERS // sum(pairs_of_beads(self.cases[chain[0]]) for chain in descents))

    def _stopped(self, point: int) -> bool:
        """Whether the walkers of a settled point were at rest."""
        run, descent = self.record.runs[point], self.record.descent
        if descent is None or run not in self.finished:
            return False
        if run not in self.velocities:
            self.velocities[run] = velocity_of(self.record.out / run)
        return descent.at_rest(self.velocities[run])

    def _hand_out(self, job: _Job) -> None:
        task = Task(
            sweep=self.sweep,
            runs=tuple(self.record.runs[point] for point in job.deck.points),
            cases=tuple(self.cases[point] for point in job.deck.points),
            out=self.record.out,
            engine=str(self.engine.path),
            sha256=self.engine.sha256,
            time_limit=self.options.time_limit,
        )
        self.out_there[job] = None
        self.submit(task).add_done_callback(lambda future: self.ended.put((job, future)))

    def _take_in(self, job: _Job, future: Future[Report]) -> None:
        del self.out_there[job]
        error = future.exception()
        report = self._lost(job, error) if error else future.result()
        if report is None:
            return
        self.finished |= set(report.finished)
        self.velocities |= report.finished
        left = [point for point in job.deck.points if not self._is_settled(point)]
        settled = len(job.deck.points) - len(left)
        self.seconds_done += job.deck.seconds * settled / len(job.deck.points)
        self.done += settled
        if left and report.failure:
            self._failed(job, report, left)
        elif left:
            self.later.append((time.perf_counter() + _BUSY_SECONDS, _part(job, left)))

    def _failed(self, job: _Job, report: Report, left: Sequence[int]) -> None:
        """Try the points of a deck apart, a point by itself as often as told."""
        if report.failure == SweepStopped.__name__ and STOPS[self.sweep].is_set():
            return
        if len(left) > 1:
            for half in halves(left):
                self._hand_out(_part(job, half))
        elif job.failures < self.options.retries:
            self._hand_out(replace(job, failures=job.failures + 1))
        else:
            (point,) = left
            run = self.record.runs[point]
            self.failures.append(Failure(point, run, report.failure or "", report.message, report.directory))
            self.given_up.add(run)
            self.seconds_done += job.deck.seconds

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


def _part(job: _Job, points: Sequence[int]) -> _Job:
    """Some of a deck's points as a job of their own."""
    return replace(job, deck=PlannedDeck(tuple(points), job.deck.seconds * len(points) / len(job.deck.points)))
