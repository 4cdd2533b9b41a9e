"""The sweeps that figures and comparison are made from, and the walkers of the paper as cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.calibration.file import Calibration, load_calibration
from walkers.errors import WalkersError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import Sweep, load_sweep
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.caption import liquid_text, radii_text
from walkers.postprocess.motion import Group, read_motion
from walkers.sweeps.table import load, thresholds
from walkers.theory.prediction import threshold

if TYPE_CHECKING:
    import pandas as pd

SETS = "ruby-sets"
"""The sweep of all named sets of the calibration ``ruby`` in all of its experiments, set by set."""


@cache
def ruby() -> Calibration:
    """The calibration with what the paper measured and states; the first of its sets is the shipped one."""
    return load_calibration("ruby")


def sweep_of(name: str) -> Sweep:
    """A shipped sweep, or `SETS`."""
    return ruby().sweep(SETS, ruby().values(ruby().sets)) if name == SETS else load_sweep(name)


def described(case: Case) -> str:
    """Radii, drive and liquid of a case in a few words, for titles."""
    drive = f"{case.excitation.frequency:g} Hz, {case.excitation.peak_acceleration / ACCELERATION_OF_ONE_G:.3g} g"
    return f"R = {radii_text(case.walkers[0].radii)} mm, {drive}, {liquid_text(case)}"


class NothingFinishedError(WalkersError):
    """A sweep has no finished points."""


class Sources:
    """Sweeps in a folder: ``table`` gives the table of one by its name, ``trajectory`` the first make of a run."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.table: Callable[[str], pd.DataFrame] = lru_cache(maxsize=None)(lambda sweep: load(out / sweep))
        self.trajectory: Callable[[str], Group] = lru_cache(maxsize=32)(lambda run: read_motion(run).groups[0])

    def finished(self, sweep: str) -> pd.DataFrame:
        """The finished points of a sweep; raises `NothingFinishedError` if there is none."""
        table = self.table(sweep)
        done = table[table["status"] == "finished"]
        if done.empty:
            raise NothingFinishedError(f"no point of the sweep {sweep} is finished")
        return done

    def runs(self, sweeps: Sequence[str]) -> list[str]:
        """Names of the finished runs of sweeps."""
        return [Path(run).name for sweep in sweeps for run in self.finished(sweep)["run"]]


def thresholds_with_theory(sources: Sources) -> pd.DataFrame:
    """Γc of the sweep ``fig2-threshold``: the Γ0 at which walkers rest and move, and that of the ``theory``."""
    ends = thresholds(sources.table("fig2-threshold"))
    cases = [load_case("fig1b", {"drive.frequency": f"{one} Hz"}) for one in ends["drive.frequency"]]
    shown = ends[["drive.frequency", "gamma0_at_rest", "gamma0_moving"]]
    return shown.assign(theory=[threshold(case) for case in cases])
