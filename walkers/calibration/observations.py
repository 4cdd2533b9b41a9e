"""Observations: facts about walkers, and the numbers of simulations to compare them with.

A calibration weighs its free parameters with observations, and the comparison with the paper judges
the shipped ones. An observation knows no run: `Observation.number_from` takes the numbers of each
experiment. `quantities_of_run` reads them from a run, and a theory may give them as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from walkers.arrays import FloatArray, IntArray
from walkers.inputs.config_table import ConfigTable
from walkers.inputs.units import ANGLE, SPEED, WRITTEN, Number, QuantityKind, parse_quantity
from walkers.postprocess.measure.gait import settled_samples
from walkers.postprocess.measure.results import Results, read_results
from walkers.postprocess.measure.sides import SEPARATED
from walkers.runner.run_directory import case_of

if TYPE_CHECKING:
    import pandas as pd

SpeedQuantity = Literal[
    "velocity", "rotation_1", "rotation_2", "sliding_1", "sliding_2", "sliding_pair_1"
]
"""Means over the cycles and over steady walkers (`walkers.postprocess.measure.gait`), m/s."""
SlipQuantity = Literal["slip_1", "slip_2"]
"""How much a bead slides within a cycle: root mean square of its sliding velocity over that of the
walker's velocity. A bead that only rolls has 0, one that is dragged without rolling has 1."""
AngleQuantity = Literal["largest_angle", "smallest_angle"]
"""Of all walkers, angle to the drive axis at the end of the run, in either direction, 0 to 90
degrees."""
SPEED_QUANTITIES = get_args(SpeedQuantity)
"""Names of the quantities that are speeds."""
SLIP_QUANTITIES = get_args(SlipQuantity)
"""Names of the quantities that are shares of sliding, for the first and the second bead."""
ANGLE_QUANTITIES = get_args(AngleQuantity)
"""Names of the quantities that are angles."""
NO_NUMBERS: dict[str, float] = dict.fromkeys(
    (*SPEED_QUANTITIES, *SLIP_QUANTITIES, *ANGLE_QUANTITIES), nan
)
"""Quantities of a run that failed."""
LARGEST_ANGLE_ON_AXIS = np.pi / 4.0
"""Largest final angle of a walker that counts as walking along the axis, rad."""
LEAST_SPEED = 5e-5
"""Smallest speed to which a ratio has a meaning, m/s."""
Names = Annotated[list[str], Field(min_length=1)]
"""A list of at least one name."""


class Observation(ConfigTable):
    """``[[observations]]``: a fact, where it was found, and the number that it is about.

    The number is the mean of a quantity over the experiments ``of``, or the ratio of this mean to
    the mean over the experiments ``over``. Files give speeds and angles with their units, and
    other numbers plainly. Here numbers are in SI units, and angles in degrees.

    Attributes
    ----------
    name
        Name of the observation, which no other has.
    group
        Name of the group of observations that are held out together.
    title
        Name in tables and figures; default: the name.
    says
        The fact as it was said.
    source
        Where the fact was found.
    quantity
        Name of the quantity: `SpeedQuantity`, `SlipQuantity` or `AngleQuantity`.
    of
        Experiments whose mean is the number, or its numerator.
    over
        Experiments whose mean is the denominator; empty: the number is not a ratio.
    value
        The number that was found; None if the fact gives limits.
    least, most
        The number is at least or at most this; None without a limit.
    deviation
        Distance within which a number agrees: one standard deviation of the value, or the tolerance
        of a limit.
    derived
        Whether the fact follows from others. It then has no weight in a calibration.
    costly
        Whether its runs are too long for many parameter sets. It then has no weight either.
    """

    name: str
    group: str
    title: str = Field(default_factory=lambda given: str(given.get("name", "")))
    says: str = ""
    source: str = ""
    quantity: Literal[SpeedQuantity, SlipQuantity, AngleQuantity] = "velocity"
    of: Names
    over: list[str] = Field([])
    value: Number | None = None
    least: Number | None = None
    most: Number | None = None
    deviation: Annotated[Number, Field(gt=0)]
    derived: bool = False
    costly: bool = False

    @field_validator("value", "least", "most", "deviation", mode="before")
    @classmethod
    def _number(cls, value: Any, validation: ValidationInfo) -> Any:
        """Read a number of a file, with or without a unit as its quantity asks."""
        if validation.context != WRITTEN:
            return value
        kind = None
        if not validation.data.get("over"):
            kind = observation_kind(validation.data.get("quantity", "velocity"))
        if kind is None:
            if isinstance(value, str):
                raise ValueError("expected a plain number: a ratio or a share has no unit")
            return value
        if not isinstance(value, str):
            raise ValueError(kind.expectation)
        number = parse_quantity(value, kind)
        return degrees(number) if kind is ANGLE else number

    @property
    def weighed(self) -> bool:
        """Whether the observation has a weight in a calibration."""
        return not (self.derived or self.costly)

    @property
    def unit(self) -> tuple[str, float]:
        """Unit in tables, and the factor from the number to it."""
        kind = None if self.over else observation_kind(self.quantity)
        if kind is SPEED:
            return "mm/s", 1e3
        if kind is ANGLE:
            return "°", 1.0
        return "", 1.0

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest number that the fact allows, without its deviation, in its unit.

        They are infinite where the fact has no limit. Both are the value if the fact gives one.
        """
        if self.value is not None:
            return self.value, self.value
        low = -inf
        high = inf
        if self.least is not None:
            low = self.least
        if self.most is not None:
            high = self.most
        return low, high

    @property
    def text(self) -> str:
        """What is expected, such as ``2.3 ± 0.35 mm/s`` or ``at least 0.3 ± 0.1``."""
        unit, scale = self.unit
        limits = []
        if self.value is not None:
            limits.append(f"{self.value * scale:.4g}")
        if self.least is not None:
            limits.append(f"at least {self.least * scale:.4g}")
        if self.most is not None:
            limits.append(f"at most {self.most * scale:.4g}")
        return f"{' and '.join(limits)} ± {self.deviation * scale:.2g} {unit}".strip()

    def number_from(self, numbers: Mapping[str, Mapping[str, float]]) -> float:
        """The number of this observation.

        Parameters
        ----------
        numbers
            Quantities by name (as `quantities_of_run` gives them), by the names of experiments.

        Returns
        -------
        float
            The number in SI units, angles in degrees. NaN if a quantity that it needs is NaN, or if
            it is a ratio to walkers at rest.
        """
        mean = float(np.mean([numbers[experiment][self.quantity] for experiment in self.of]))
        if not self.over:
            return mean
        below = float(np.mean([numbers[experiment][self.quantity] for experiment in self.over]))
        if observation_kind(self.quantity) is SPEED and abs(below) < LEAST_SPEED:
            return nan
        return mean / below

    def residual(self, number: float) -> float:
        """Distance of a number from what the fact allows, in deviations; NaN for NaN."""
        return (number - float(np.clip(number, *self.limits))) / self.deviation

    def agrees(self, number: float) -> bool:
        """Whether a number is within a deviation of what the fact allows; NaN is not."""
        return abs(self.residual(number)) <= 1.0


def observation_kind(quantity: str) -> QuantityKind | None:
    """The kind of a quantity; None if it is a plain number."""
    if quantity in SPEED_QUANTITIES:
        return SPEED
    if quantity in ANGLE_QUANTITIES:
        return ANGLE
    return None


def quantities_of_run(run: str | Path) -> dict[str, float]:
    """All quantities of the finished run of a dimer.

    Parameters
    ----------
    run
        The run directory.

    Returns
    -------
    dict
        The quantities of `NO_NUMBERS`: speeds in m/s, angles in degrees. Speeds and slips are NaN
        if no walker is steady, and angles are NaN if no walker keeps its beads together.
    """
    results = read_results(run)
    walkers = results.table("walkers")
    steady = steady_walkers(results)
    numbers = dict(NO_NUMBERS)
    for name in SPEED_QUANTITIES:
        numbers[name] = float(steady[name].mean())
    if len(steady):
        numbers |= _slips(results, walker_count=len(walkers), rows=steady.index.to_numpy())
    angles = misalignment(walkers[keeps_beads_together(walkers)])
    if len(angles):
        numbers["largest_angle"] = float(angles.max())
        numbers["smallest_angle"] = float(angles.min())
    return numbers


def _slips(results: Results, walker_count: int, rows: IntArray) -> dict[str, float]:
    """The quantities `SlipQuantity` of a run: sliding of a bead over velocity, root mean squares.

    ``rows`` are those of the walkers in the table ``walkers``, of ``walker_count`` rows.
    """
    trajectory = results.columns("trajectory")
    cycles = round(trajectory["cycle"].max())
    # A run that ended early has fewer cycles than its case.
    run = case_of(results.directory).for_cycles(cycles).run
    samples = settled_samples(run)

    def mean_square(column: str) -> float:
        """Mean square of a column over the measured samples of these walkers, m²/s²."""
        values = trajectory[column].reshape(walker_count, -1).T
        return float(np.mean(values[samples][:, rows] ** 2))

    slips = {}
    for bead, name in enumerate(SLIP_QUANTITIES, 1):
        ratio = mean_square(f"sliding_{bead}") / mean_square("velocity")
        slips[name] = float(np.sqrt(ratio))
    return slips


def quantities_of_runs(table: pd.DataFrame) -> list[dict[str, float]]:
    """`quantities_of_run` each run in the table of a sweep; NaN for runs that are not finished."""
    numbers = []
    for run, status in zip(table["run"], table["status"], strict=True):
        if status == "finished":
            numbers.append(quantities_of_run(run))
        else:
            numbers.append(NO_NUMBERS)
    return numbers


def misalignment(walkers: pd.DataFrame) -> FloatArray:
    """Angles to the drive axis at the end of a run, in either direction.

    Parameters
    ----------
    walkers
        Rows of the table ``walkers`` of a run.

    Returns
    -------
    ndarray
        Angle of each walker, 0 to 90 degrees.
    """
    ends = np.degrees(walkers["orientation_end"].to_numpy())
    angles: FloatArray = np.abs((ends + 90.0) % 180.0 - 90.0)
    return angles


def keeps_beads_together(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the beads of each walker of a table ``walkers`` stay together."""
    return walkers["separated_fraction"] < SEPARATED


def steady_walkers(results: Results) -> pd.DataFrame:
    """Rows of the table ``walkers`` of a run whose walkers count.

    They are steady, end close to the axis, and their beads stay together. Symmetric dimers, which
    do not walk and turn across the axis, need only stay together.
    """
    walkers = results.table("walkers")
    counts = keeps_beads_together(walkers)
    if results.get("sin_delta") != 0.0:
        on_axis = walkers["orientation_end"].abs() < LARGEST_ANGLE_ON_AXIS
        counts &= walkers["steady"] & on_axis
    return walkers.loc[counts]
