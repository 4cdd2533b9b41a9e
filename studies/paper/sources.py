"""The sweeps that figures and comparison are made from, and the walkers of the paper as cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.calibration.file import Calibration, load_calibration
from walkers.errors import WalkersError
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import SweepDefinition, load_sweep
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.caption import liquid_text, radii_text
from walkers.postprocess.measure.motion import Group, read_motion
from walkers.sweeps.table import load_table, thresholds
from walkers.theory.prediction import threshold

if TYPE_CHECKING:
    import pandas as pd

_FRICTION_ONLY = {
    **{
        "friction_wall": 0.311,
        "friction_slide": 0.311,
        "friction_bead": 0.083,
        "rolling_friction": 0.0035,
    },
    **{"roughness": 2000.0, "meniscus_radius": 40.0},
}
"""Rough surfaces, so that bridges drag little: outside of the calibration's ranges, in the units of its file."""


@cache
def ruby() -> Calibration:
    """The calibration with the paper's measurements and statements."""
    return load_calibration("ruby")


@cache
def parameter_sets() -> dict[str, Mapping[str, float] | None]:
    """Parameter sets to compare: the cases as they are, the sets of the calibration, and one of friction alone."""
    return {"shipped": None, **ruby().file.sets, "friction only": _FRICTION_ONLY}


def facts_sweep_name(name: str) -> str:
    """The name of the sweep of all experiments of the calibration with a parameter set."""
    return f"facts-{name.replace(' ', '-')}"


def sweep_of(name: str) -> SweepDefinition:
    """A shipped sweep, or one of `facts_sweep_name`."""
    for label, values in parameter_sets().items():
        if name == facts_sweep_name(label):
            row = (
                None
                if values is None
                else np.array([[values[parameter] for parameter in ruby().file.parameters]])
            )
            return ruby().sweep(name, row)
    return load_sweep(name)


def case_title(case: Case) -> str:
    """Radii, drive and liquid of a case in a few words, for titles."""
    drive = f"{case.excitation.frequency:g} Hz, {case.excitation.peak_acceleration / ACCELERATION_OF_ONE_G:.3g} g"
    return f"R = {radii_text(case.walkers[0].radii)} mm, {drive}, {liquid_text(case)}"


class NothingFinishedError(WalkersError):
    """A sweep has no finished points."""


class Sources:
    """Sweeps in a folder: ``table`` gives the table of one by its name, ``trajectory`` the first kind of a run."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.table: Callable[[str], pd.DataFrame] = lru_cache(maxsize=None)(
            lambda sweep: load_table(out / sweep)
        )
        self.trajectory: Callable[[str], Group] = lru_cache(maxsize=32)(
            lambda run: read_motion(run).groups[0]
        )

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


@cache
def _by_theory(frequency: float) -> float:
    """Γc of the walker of Fig. 2, driven at a frequency in Hz; a second each, for the figure and the comparison."""
    return threshold(load_case("fig1b", {"drive.frequency": f"{frequency} Hz"}))


def thresholds_with_theory(sources: Sources) -> pd.DataFrame:
    """Γc of the sweep ``fig2-threshold``: the Γ0 at which walkers rest and move, and Γc of the ``theory``.

    Also Γc of the sweep ``fig2-ramp``, ``ramp``, and its resolution, ``within``.
    """
    ends = thresholds(sources.table("fig2-threshold"))
    shown = ends[["drive.frequency", "gamma0_at_rest", "gamma0_moving"]]
    ramp = (
        sources.table("fig2-ramp")
        .groupby("drive.frequency")[["gamma0_stops_at", "gamma0_stops_within"]]
        .first()
    )
    ramps = ramp.reindex(shown["drive.frequency"]).to_numpy(dtype=float).T
    return shown.assign(
        theory=[*map(_by_theory, ends["drive.frequency"])], ramp=ramps[0], within=ramps[1]
    )
