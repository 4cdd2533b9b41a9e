"""Published numbers of the paper (``published.toml``) and their walkers, as rows of sweeps and as cases.

`walkers.paper.comparison` evaluates them by the engine, from sweeps (`Sources`), and by the theory.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from walkers.errors import WalkersError
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.caption import liquid_text, radii_text
from walkers.postprocess.motion import Group, read_motion
from walkers.sweeps.table import load
from walkers.theory.prediction import predicted_column

if TYPE_CHECKING:
    import pandas as pd

    from walkers.theory.quasistatic import FloatArray

GRAVITY = ACCELERATION_OF_ONE_G
"""The value of g in the paper, m/s²."""


class Point(NamedTuple):
    """Walkers of the paper: a sweep that contains them, radii (mm), frequency (Hz), peak acceleration (g) or Γ0.

    ``angle`` is the start angle, degrees; None stands for any value of the sweep.
    """

    sweep: str
    radii: tuple[float, float]
    frequency: float | None = None
    peak: float | None = None
    gamma0: float | None = None
    angle: float | None = None

    def rows(self, table: pd.DataFrame) -> pd.DataFrame:
        """The points of a sweep with these walkers."""
        peak = None if self.peak is None else self.peak * GRAVITY
        wanted = {
            **{f"radius_{number}": radius * 1e-3 for number, radius in enumerate(self.radii, start=1)},
            **{"frequency": self.frequency, "peak_acceleration": peak, "gamma0": self.gamma0},
            "dimers.angle": self.angle,
        }
        chosen = np.ones(len(table), dtype=bool)
        for column, value in wanted.items():
            if value is not None and column in table:
                chosen &= np.isclose(table[column], value, rtol=1e-4)
        return table[chosen]

    def case(self) -> Case:
        """The shipped case with these walkers, for the theory."""
        if self.sweep == "fig4":
            return load_case("fig4a" if self.peak == FIG4_PEAKS[0] else "fig4b")
        if self.gamma0 is not None:
            large, small = self.radii
            return of_radii(shipped(), (large * 1e-3, small * 1e-3), self.gamma0)
        return driven(shipped(), self.frequency or 0.0, [(self.peak or 0.0) * GRAVITY])[0]


@dataclass(frozen=True)
class Observation:
    """A published observation, usually a number, and its walkers.

    Attributes
    ----------
    key, what, unit
        Name, description and unit.
    value, bounds
        Published value, and range that the paper states. Rounding is no range (Γ0 = 0.74 is 0.735); ranges of angles
        are ours. A statement in words has bounds and no value, and does not count in the comparison.
    depends_on
        A sentence: what a disagreement of the engine depends on.
    measured
        Whether it tests the engine: Γ0 and Mathieu's V follow from beads and drive alone.
    of, over, quantity
        The observation is the mean of a quantity over walkers, or its ratio to that over others, pair by pair; see
        `walkers.paper.comparison.evaluate`. Without a quantity, `walkers.paper.comparison` has a function for it.
    compared
        Whether it is part of the comparison.
    """

    key: str
    what: str
    value: float | None = None
    unit: str = "mm/s"
    bounds: tuple[float, float] | None = None
    depends_on: str = ""
    measured: bool = True
    of: tuple[Point, ...] = ()
    over: tuple[Point, ...] = ()
    quantity: str = ""
    compared: bool = True

    @property
    def si(self) -> float:
        """The value in SI units, with the published digits."""
        return float(f"{self.value or 0.0}e-3") if self.unit == "mm/s" else self.value or 0.0


def _read(given: dict[str, Any], reasons: Mapping[str, str]) -> Observation:
    for name in {"of", "over"} & given.keys():
        walkers = {**given[name], "radii": tuple(given[name]["radii"])}
        frequencies = walkers.pop("frequencies", [None])
        given[name] = tuple(Point(**walkers, frequency=frequency) for frequency in frequencies)
    if "bounds" in given:
        given["bounds"] = tuple(given["bounds"])
    return Observation(**{**given, "depends_on": reasons.get(given.get("depends_on", ""), "")})


_FILE = tomllib.loads(Path(__file__).with_name("published.toml").read_text("utf-8"))
OBSERVATIONS = {given["key"]: _read(given, _FILE["reasons"]) for given in _FILE["numbers"]}
"""All published observations, and quantities derived from them, by key."""
FIT = {float(g): OBSERVATIONS[f"fig2_{g}g"].si for g in range(2, 7)}
"""Fig. 2: the paper's fitted curve below the plateau, m/s, at peak accelerations in g."""
FIG3_FIT = {one.of[0].radii: one.si for key, one in OBSERVATIONS.items() if key.startswith("fig3_") and one.value}
"""Fig. 3: the same curve at Γ0 = 0.5, m/s, by the radii in mm."""
FIG4_PEAKS = tuple(OBSERVATIONS[f"fig4{letter}_velocity"].of[0].peak or 0.0 for letter in "ab")
"""Fig. 4a and b: peak acceleration, g."""


def outside_of_the_paper(case: Case) -> str | None:
    """How a case of a dimer lies outside the range of the paper's velocities; None if it is within, or no dimer."""
    if not case.walkers or len(case.walkers[0].radii) != 2:
        return None
    points = [point for one in OBSERVATIONS.values() for point in one.of]
    most = max(one.value or 0.0 for one in OBSERVATIONS.values() if one.quantity == "gamma0")
    strongest = max(point.peak or 0.0 for point in points)
    frequencies = [point.frequency for point in points if point.frequency is not None]
    low, high = min(frequencies), max(frequencies)
    peak, frequency = case.excitation.peak_acceleration / GRAVITY, case.excitation.frequency
    gamma0 = dimer_of(case).gamma0(case.excitation.peak_acceleration)
    found = {
        f"Γ0 = {gamma0:.3g} (measured up to {most:g})": gamma0 > most,
        f"{peak:.3g} g (up to {strongest:g} g)": peak > (1.0 + 1e-9) * strongest,
        f"{frequency:g} Hz ({low:g} to {high:g} Hz)": not low <= frequency <= high,
    }
    beyond = [one for one, outside in found.items() if outside]
    return f"outside the paper's measurements: {', '.join(beyond)}; no model is tested there" if beyond else None


def predicted(cases: Sequence[Case], column: str) -> tuple[Mapping[str, FloatArray], Mapping[str, int]]:
    """`walkers.theory.prediction.predicted_column`; the remarks also say which cases no model is tested for."""
    predictions, reasons = predicted_column(cases, column)
    beyond = [sentence for case in cases if (sentence := outside_of_the_paper(case))]
    if predictions and beyond:
        reasons |= {beyond[0] + (", …" if len(beyond) > 1 else ""): len(beyond)}
    return predictions, reasons


# --- its walkers as cases, with the shipped parameters ----------------------------------------------------------------


def shipped() -> Case:
    """The case with the beads, liquid and contacts of Figs. 1b and 2."""
    return load_case("fig1b")


def driven(case: Case, frequency: float, accelerations: Iterable[float]) -> list[Case]:
    """A case with another frequency (Hz) and peak accelerations (m/s²), for the theory: without a time step."""
    drives = (case.drive.but(frequency=float(frequency), peak_acceleration=float(peak)) for peak in accelerations)
    return [case.but(drive=drive) for drive in drives]


def of_radii(case: Case, radii: tuple[float, float], gamma0: float) -> Case:
    """A case with other radii (m), driven at a Γ0."""
    dimer = case.put("dimers.radii", radii)
    return dimer.put("drive.peak_acceleration", dimer_of(dimer).peak_acceleration(gamma0))


def of_asymmetry(case: Case, sin_delta: float, gamma0: float) -> Case:
    """A case with beads of the same mean radius and another asymmetry, driven at a Γ0."""
    mean = dimer_of(case).mean_radius
    return of_radii(case, (mean * (1.0 + sin_delta), mean * (1.0 - sin_delta)), gamma0)


def described(case: Case) -> str:
    """Radii, drive and liquid of a case in a few words, for titles."""
    drive = f"{case.excitation.frequency:g} Hz, {case.excitation.peak_acceleration / GRAVITY:.3g} g"
    return f"R = {radii_text(case.walkers[0].radii)} mm, {drive}, {liquid_text(case)}"


# --- the sweeps that figures are made from ----------------------------------------------------------------------------


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

    def runs(self, *sweeps: str) -> list[str]:
        """Names of the finished runs of sweeps."""
        return [Path(run).name for sweep in sweeps for run in self.finished(sweep)["run"]]
