"""What a worker does: make the runs of one deck and tell what has become of them, in plain types that travel."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from inputs.case import WalkerCase
from inputs.errors import WalkersError
from runner.binary import find_engine
from runner.failures import EngineDiffers, EngineFailure
from runner.launch import Progress
from sweeps.together import make_together

STOP = threading.Event()
"""Set to end the engines of this process's workers and to let those that wait begin nothing."""


class SweepStopped(WalkersError):
    """Somebody stopped the sweep while an engine ran."""


@dataclass(frozen=True)
class Task:
    """One deck's worth of work.

    Attributes
    ----------
    cases
        May share a deck.
    out
        Folder of the run directories.
    engine, sha256
        The binary: its path or name, and what it must be.
    time_limit
        Wall time in s that the engine may take, or None.
    """

    cases: tuple[WalkerCase, ...]
    out: Path
    engine: str
    sha256: str
    time_limit: float | None


@dataclass(frozen=True)
class Report:
    """What became of a task: runs that are finished, or busy elsewhere, or the failure of the deck.

    Attributes
    ----------
    finished
        From names of runs to their directories.
    busy
        Names of runs that somebody else is making.
    failure
        Name of the failure's class, None if there was none.
    message, directory
        What it says and where its remains are.
    """

    finished: Mapping[str, str] = field(default_factory=dict)
    busy: tuple[str, ...] = ()
    failure: str | None = None
    message: str = ""
    directory: str | None = None


def work(task: Task) -> Report:
    """Make the runs of a task's cases. Never raises what is known to happen: see `Report`."""

    def look(_: Progress) -> None:
        if STOP.is_set():
            raise SweepStopped("stopped")

    if STOP.is_set():
        return Report(failure=SweepStopped.__name__)
    try:
        engine = find_engine(task.engine)
        if engine.sha256 != task.sha256:
            raise EngineDiffers(engine.path)
        made = make_together(task.cases, task.out, engine, on_progress=look, time_limit=task.time_limit)
    except EngineFailure as failure:
        directory = str(failure.directory) if failure.directory else None
        return Report(failure=failure.reason, message=str(failure), directory=directory)
    except (WalkersError, OSError) as error:
        return Report(failure=type(error).__name__, message=str(error))
    finished = {name: str(run.directory) for name, run in made.runs.items()}
    return Report(finished=finished, busy=tuple(sorted(made.busy)))
