"""What a worker does: make the runs of one deck and tell what has become of them, in plain types that travel."""

from __future__ import annotations

import errno
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from walkers.inputs.case import Case
from walkers.inputs.errors import Stopped, WalkersError
from walkers.postprocess.analysis import current_result
from walkers.runner.binary import find_engine
from walkers.runner.directory import run_place, unfinished
from walkers.runner.failures import DiskFull, EngineDiffers, EngineFailure, ProgramDiffers
from walkers.sweeps.columns import velocity_in
from walkers.sweeps.shared_deck import make_runs

STOPS: dict[str, threading.Event] = {}
"""Of the sweeps that this process runs, by `Task.sweep`: set to end their engines and to let none begin."""


class SweepStopped(Stopped):
    """Somebody stopped the sweep while an engine ran."""


@dataclass(frozen=True)
class Task:
    """One deck's worth of work: its scheduler, names and cases of its runs, their folder, the engine by path and sum.

    The time limit is the wall time in s that the engine may take, or None.
    """

    sweep: str
    runs: tuple[str, ...]
    cases: tuple[Case, ...]
    out: Path
    engine: str
    sha256: str
    time_limit: float | None


@dataclass(frozen=True)
class Report:
    """What became of a task: velocities (m/s) of its finished runs (others are busy elsewhere), or the deck's failure.

    A failure has the name of its class, what it says, and where its remains are.
    """

    finished: Mapping[str, float] = field(default_factory=dict)
    failure: str | None = None
    message: str = ""
    directory: str | None = None


def work(task: Task) -> Report:
    """Make the runs of a task's cases. Never raises what is known to happen: see `Report`."""
    stop = STOPS.get(task.sweep, threading.Event())

    def look(_: object) -> None:
        if stop.is_set():
            raise SweepStopped("stopped")

    try:
        if stop.is_set():
            raise SweepStopped("stopped")
        return _made(task, look)
    except EngineFailure as failure:
        directory = str(unfinished(task.out / task.runs[0])) if failure.directory else None
        return Report(failure=failure.reason, message=str(failure), directory=directory)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            return Report(failure=DiskFull.__name__, message=f"disk full: {error.filename or task.out}")
        told = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        return Report(failure=type(error).__name__, message=told)
    except WalkersError as error:
        return Report(failure=type(error).__name__, message=str(error))


def _made(task: Task, look: Callable[[object], None]) -> Report:
    engine = find_engine(task.engine)
    if engine.sha256 != task.sha256:
        raise EngineDiffers(engine.path)
    if task.runs != tuple(run_place(case, engine, task.out).name for case in task.cases):
        raise ProgramDiffers
    made = make_runs(task.cases, task.out, engine, on_progress=look, time_limit=task.time_limit)
    return Report({name: velocity_in(current_result(run.directory)) for name, run in made.runs.items()})
