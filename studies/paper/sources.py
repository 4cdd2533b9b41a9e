"""The sweeps that figures and comparison are made from, and the walkers of the paper as cases.

Nothing is run here: `studies.paper.make` makes missing runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.friction_laws import calibration_with
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

_ROUNDED = "estimated surfaces"
"""The set of the calibration that the shipped cases have, but for the roughness of each contact."""
_COULOMB = ("coulomb-two-walls", "coulomb-one-wall")
"""Laws of `studies.friction_laws` whose sets are compared with the shipped parameters."""


@dataclass(frozen=True)
class ParameterSet:
    """Values of the parameters of a calibration.

    Attributes
    ----------
    calibration
        The calibration. All have the same experiments and facts.
    values
        Its parameters by name, in the units of its file; None: the shipped cases as they are.
    """

    calibration: Calibration
    values: Mapping[str, float] | None = None


@cache
def ruby() -> Calibration:
    """The calibration with the paper's measurements and statements."""
    return load_calibration("ruby")


@cache
def parameter_sets() -> dict[str, ParameterSet]:
    """Parameter sets to compare, by name.

    They are the shipped cases as they are, another set of their calibration, and sets with
    Coulomb's law.
    """
    sets = {"shipped": ParameterSet(ruby())}
    calibrations = [ruby(), *map(calibration_with, _COULOMB)]
    for calibration in calibrations:
        for name, values in calibration.file.sets.items():
            if name != _ROUNDED:
                sets[name] = ParameterSet(calibration, values)
    return sets


def facts_sweep_name(parameter_set: str) -> str:
    """The name of the sweep of all experiments of the calibration with a parameter set."""
    words = parameter_set.lower().replace(",", "").split()
    return f"facts-{'-'.join(words)}"


def sweep_of(name: str) -> SweepDefinition:
    """A shipped sweep, or the sweep of a parameter set by its name (`facts_sweep_name`)."""
    for label, parameter_set in parameter_sets().items():
        if name != facts_sweep_name(label):
            continue
        calibration = parameter_set.calibration
        if parameter_set.values is None:
            return calibration.sweep(name)
        row = [parameter_set.values[parameter] for parameter in calibration.file.parameters]
        return calibration.sweep(name, np.array([row]))
    return load_sweep(name)


def case_title(case: Case) -> str:
    """Radii, drive and liquid of a case in a few words, for titles."""
    drive = case.excitation
    peak = drive.peak_acceleration / ACCELERATION_OF_ONE_G
    radii = radii_text(case.walkers[0].radii)
    return f"R = {radii} mm, {drive.frequency:g} Hz, {peak:.3g} g, {liquid_text(case)}"


class NothingFinishedError(WalkersError):
    """A sweep has no finished points."""


class Sources:
    """The sweeps and runs in a folder; what is read is kept.

    Parameters
    ----------
    out
        Folder of the runs.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self._read_table = lru_cache(maxsize=None)(load_table)
        self._read_motion = lru_cache(maxsize=32)(read_motion)

    def table(self, sweep: str) -> pd.DataFrame:
        """The table of a sweep, by its name."""
        return self._read_table(self.out / sweep)

    def trajectory(self, run: str) -> Group:
        """The first kind of walkers of a run, by its directory."""
        return self._read_motion(run).groups[0]

    def finished(self, sweep: str) -> pd.DataFrame:
        """The finished points of a sweep; raises `NothingFinishedError` if there are none."""
        table = self.table(sweep)
        done = table[table["status"] == "finished"]
        if done.empty:
            raise NothingFinishedError(f"no point of the sweep {sweep} is finished")
        return done

    def runs(self, sweeps: Sequence[str]) -> list[str]:
        """Names of the finished runs of sweeps."""
        names = []
        for sweep in sweeps:
            names += [Path(run).name for run in self.finished(sweep)["run"]]
        return names


@cache
def _threshold_by_theory(frequency: float) -> float:
    """Γc of the walker of Fig. 2 at a frequency in Hz; it takes a second and is needed twice."""
    return threshold(load_case("fig1b", {"drive.frequency": f"{frequency} Hz"}))


def thresholds_with_theory(sources: Sources) -> pd.DataFrame:
    """Thresholds of motion Γc by engine and theory.

    Parameters
    ----------
    sources
        The sweeps ``fig2-threshold``, runs from rest, and ``fig2-ramp``, runs with a falling drive.

    Returns
    -------
    DataFrame
        A row for each frequency, ``drive.frequency`` in Hz. ``gamma0_at_rest`` and
        ``gamma0_moving`` are the Γ0 at which walkers rest and move in runs from rest, ``theory`` is
        Γc by the theory, ``ramp`` that with a falling drive, and ``within`` the resolution of
        ``ramp``.
    """
    ends = thresholds(sources.table("fig2-threshold"))
    table = ends[["drive.frequency", "gamma0_at_rest", "gamma0_moving"]]
    by_frequency = sources.table("fig2-ramp").groupby("drive.frequency")
    stops = by_frequency[["gamma0_stops_at", "gamma0_stops_within"]].first()
    stops = stops.reindex(table["drive.frequency"])
    return table.assign(
        theory=[_threshold_by_theory(frequency) for frequency in ends["drive.frequency"]],
        ramp=stops["gamma0_stops_at"].to_numpy(dtype=float),
        within=stops["gamma0_stops_within"].to_numpy(dtype=float),
    )
