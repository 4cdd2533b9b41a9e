"""Workers of a sweep: what they do with a deck, and where they run.

A `concurrent.futures.Executor` runs the decks: threads on this machine, Parsl's workers on a
cluster, or the caller's executor. Parsl repeats a deck whose worker was lost.
Which decks there are, and what follows from a failure, is decided in `walkers.sweeps.scheduler`.
"""

from __future__ import annotations

import errno
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from platform import node
from typing import TYPE_CHECKING, TypeAlias

from walkers.errors import Stopped, WalkersError
from walkers.inputs.tables.case import Case
from walkers.runner.binary import Engine, find_engine
from walkers.runner.failures import (
    DiskFull,
    EngineDiffers,
    EngineFailure,
    OutputGone,
    ProgramDiffers,
)
from walkers.runner.run_directory import run_place, unfinished
from walkers.runs.making import make_runs
from walkers.sweeps.site import prepare

if TYPE_CHECKING:
    from parsl.config import Config

_UNKNOWN_POINT = -1
"""Number of the point of a failure in a deck: which point failed is not known."""


class SweepStopped(WalkersError):
    """A failure that affects every point, or jobs of a cluster that end without doing any work."""


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
    affects
        Which points such a failure affects, see `walkers.runner.failures.EngineFailure`.
    cause
        The message without the directory: the same for points that fail in the same way.
    """

    point: int
    run: str
    reason: str
    message: str
    directory: str | None
    affects: str = field(default="", repr=False)
    cause: str = field(default="", repr=False)


DeckOutcome: TypeAlias = list[str] | Failure
"""Outcome of a deck: names of its finished runs, or a failure whose point is not known."""


@dataclass(frozen=True)
class DeckTask:
    """What a worker needs to make the runs of a deck.

    Attributes
    ----------
    runs, cases
        Names and cases of the runs.
    out
        Folder of the run directories.
    engine
        The engine that started the sweep.
    time_limit
        Longest wall time of an engine in s; None: no limit.
    dumps
        Whether the runs keep their dumps.
    """

    runs: Sequence[str]
    cases: Sequence[Case]
    out: Path
    engine: Engine
    time_limit: float | None
    dumps: bool


def make_deck(stop: threading.Event | None, task: DeckTask) -> DeckOutcome:
    """Make the runs of a deck on a worker, until ``stop`` is set.

    Known failures are returned, not raised.
    """

    def check_stop(_: object = None) -> None:
        if stop is not None and stop.is_set():
            raise Stopped("stopped")

    try:
        check_stop()
        engine = find_engine(str(task.engine.path))
        _check_worker(engine, task)
        runs = make_runs(
            task.cases,
            task.out,
            engine,
            dumps=task.dumps,
            on_progress=check_stop,
            time_limit=task.time_limit,
        )
    except (OSError, WalkersError) as error:
        return _failure_of_deck(error, task)
    return list(runs)


def _check_worker(engine: Engine, task: DeckTask) -> None:
    """Refuse a worker whose engine or program is not the one that started the sweep."""
    if engine.sha256 != task.engine.sha256:
        raise EngineDiffers(
            f"the engine on {node()}, {engine.path}, is not the engine that started this sweep"
        )
    runs = [run_place(case, engine, task.out).name for case in task.cases]
    if runs != list(task.runs):
        raise ProgramDiffers(
            f"the program on {node()} has another version than the one that started the sweep"
        )


def _failure_of_deck(error: OSError | WalkersError, task: DeckTask) -> Failure:
    """Describe an error on a worker as a failure of its points.

    Its directory is where the remains of the first run are kept.
    """
    kind: type[Exception] = type(error)
    message = str(error)
    cause = message
    directory = None
    if isinstance(error, EngineFailure):
        cause = error.message
        if error.directory:
            directory = str(unfinished(task.out / task.runs[0]))
    elif isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        kind = DiskFull
        message = cause = f"disk full: {error.filename or task.out}"
    elif isinstance(error, OSError) and error.filename:
        if error.errno == errno.ENOENT:
            kind = OutputGone
        message = cause = f"{error.filename}: {error.strerror}"
    return Failure(
        point=_UNKNOWN_POINT,
        run="",
        reason=kind.__name__,
        message=message,
        directory=directory,
        affects=getattr(kind, "affects", ""),
        cause=cause,
    )


def outcome_of(future: Future[DeckOutcome]) -> DeckOutcome:
    """The outcome of a deck whose future is done; a failure if the cluster lost the deck.

    Raises
    ------
    SweepStopped
        If the workers of the executor ended, or the cluster's jobs fail.
    Exception
        An error of the program.
    """
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, BrokenExecutor):
        raise SweepStopped(f"the executor's workers ended: {error}") from error
    if type(error).__module__.startswith("parsl."):
        from parsl.errors import ParslError
        from parsl.executors.errors import BadStateException

        if isinstance(error, BadStateException):
            # The other errors repeat the first.
            first, _, _ = str(error).partition("Error 2:")
            raise SweepStopped(f"the cluster's jobs fail: {' '.join(first.split())}") from error
        if isinstance(error, ParslError):
            message = str(error) or repr(error)
            return Failure(
                point=_UNKNOWN_POINT,
                run="",
                reason=type(error).__name__,
                message=message,
                directory=None,
                cause=message,
            )
    raise error


@dataclass(frozen=True)
class Workers:
    """The workers of a sweep.

    Attributes
    ----------
    executor
        What runs the decks.
    stop
        Ends the runs of threads when it is set; None for other executors.
    """

    executor: Executor
    stop: threading.Event | None = None


@contextmanager
def threads(number: int) -> Iterator[Workers]:
    """A number of threads on this machine, which stop at the end."""
    stop = threading.Event()
    with ThreadPoolExecutor(number) as executor:
        try:
            yield Workers(executor, stop)
        finally:
            stop.set()


@contextmanager
def pilots(site: Config, folder: Path, ranks: int) -> Iterator[Workers]:
    """Parsl's workers at a site, for decks of a number of MPI processes; they stop at the end.

    Parameters
    ----------
    site
        Parsl's configuration, see `walkers.sweeps.site.load_site`.
    folder
        Where Parsl writes its scripts and logs.
    ranks
        Number of MPI processes of a deck.

    Raises
    ------
    SweepStopped
        If Parsl cannot start.
    """
    from parsl import DataFlowKernel
    from parsl.concurrent import ParslPoolExecutor

    try:
        kernel = DataFlowKernel(prepare(site, folder, ranks))
    except Exception as error:  # of any class: an address that this machine lacks, ports in use
        reason = " ".join(str(error).split())
        raise SweepStopped(
            f"Parsl cannot start ({reason}); see {folder}, and the address in the site file"
        ) from error
    try:
        yield Workers(ParslPoolExecutor(dfk=kernel))
    finally:  # the executor itself would wait for the decks
        kernel.cleanup()
