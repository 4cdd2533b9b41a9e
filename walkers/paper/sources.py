"""The sweeps that the figures are made from, read once."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.inputs.errors import WalkersError
from walkers.postprocess.motion import Group, read_motion
from walkers.sweeps.scheduler import SweepProgress
from walkers.sweeps.table import load

if TYPE_CHECKING:
    import pandas as pd

ProgressOf = Callable[[str], AbstractContextManager[Callable[[SweepProgress], None]]]
"""Gives, for the name of a sweep, a context whose value is told of its progress."""


class NothingFinishedError(WalkersError):
    """A sweep of which nothing is there to be shown."""


class Sources:
    """Finished sweeps in a folder of run directories: ``table`` gives the table of one, by its name, ``trajectory`` the
    motion of the (first) walkers of a run, by its directory.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self.table: Callable[[str], pd.DataFrame] = lru_cache(maxsize=None)(lambda sweep: load(out / sweep))
        self.trajectory: Callable[[str], Group] = lru_cache(maxsize=32)(lambda run: read_motion(run).groups[0])

    def finished(self, sweep: str) -> pd.DataFrame:
        """The points of a sweep that are finished; a `NothingFinishedError` if there is none."""
        table = self.table(sweep)
        done = table[table["status"] == "finished"]
        if done.empty:
            raise NothingFinishedError(f"no point of the sweep {sweep} is finished")
        return done

    def runs(self, *sweeps: str) -> list[str]:
        """Names of the finished runs of sweeps."""
        return [Path(run).name for sweep in sweeps for run in self.finished(sweep)["run"]]
