"""Observations: facts about walkers, measured or stated, and the numbers of simulations to compare them with.

A calibration weighs its free parameters with them, and the comparison with the paper judges the shipped ones. An
observation knows no run: `Observation.of_numbers` takes the numbers of each experiment, which `numbers_of` reads from a
run, and which a theory may give as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from walkers.arrays import FloatArray
from walkers.inputs.config_table import ConfigTable
from walkers.inputs.units import ANGLE, SPEED, WRITTEN, Number, QuantityKind, parse_quantity
from walkers.postprocess.measure.gait import settled_samples
from walkers.postprocess.measure.results import Results, read_results
from walkers.postprocess.measure.sides import SEPARATED
from walkers.runner.run_directory import case_of

if TYPE_CHECKING:
    import pandas as pd

Speed = Literal["velocity", "rotation_1", "rotation_2", "sliding_1", "sliding_2", "sliding_pair_1"]
"""Means over the cycles and over steady walkers (`walkers.postprocess.measure.gait`), m/s."""
Slip = Literal["slip_1", "slip_2"]
"""How much a bead slides within a cycle: root mean square of its sliding velocity over that of the walker's velocity.

A bead that only rolls has 0, one that is dragged without rolling has 1.
"""
ASTRAY = np.pi / 4.0
"""Largest final angle of a walker that is on the axis, rad."""
Angle = Literal["largest_angle", "smallest_angle"]
"""Of all walkers to the drive axis at the end of the run, in either direction, 0 to 90 degrees."""
NO_NUMBERS: dict[str, float] = dict.fromkeys(
    (*get_args(Speed), *get_args(Slip), *get_args(Angle)), nan
)
"""Quantities of a run that failed."""
LEAST_SPEED = 5e-5
"""m/s; a ratio to a smaller speed has no meaning."""
Names = Annotated[list[str], Field(min_length=1)]


class Observation(ConfigTable):
    """``[[observations]]``: a fact, where it was found, and the number that it is about.

    The number is the mean of a quantity (`Speed`, `Slip` or `Angle`) over the experiments ``of``, or its ratio to the
    mean over those ``over``. The fact gives its ``value``, or that it is at ``least`` or at ``most`` so large, and the
    ``deviation`` within which a number agrees: one standard deviation of the value, the tolerance of a limit. They are
    in SI units, angles in degrees; a file gives speeds and angles with their unit, other numbers plainly.

    Observations of a ``group`` are held out together; ``says`` is the fact as it was said. One that is ``derived`` from
    others, or ``costly`` (its runs are too long for many parameter sets), has no weight in a calibration.
    """

    name: str
    group: str
    title: str = Field(default_factory=lambda given: str(given.get("name", "")))
    says: str = ""
    source: str = ""
    quantity: Literal[Speed, Slip, Angle] = "velocity"
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
        if validation.context != WRITTEN:
            return value
        kind = (
            None
            if validation.data.get("over")
            else observation_kind(validation.data.get("quantity", "velocity"))
        )
        if isinstance(value, str) == (kind is None):
            raise ValueError(
                kind.expectation
                if kind
                else "expected a plain number: a ratio or a share has no unit"
            )
        number = parse_quantity(value, kind) if kind else value
        return degrees(number) if kind is ANGLE else number

    @property
    def weighed(self) -> bool:
        """Whether it has a weight in a calibration."""
        return not (self.derived or self.costly)

    @property
    def unit(self) -> tuple[str, float]:
        """Unit for tables, and the factor to it."""
        kind = None if self.over else observation_kind(self.quantity)
        return ("mm/s", 1e3) if kind is SPEED else ("°" if kind is ANGLE else "", 1.0)

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest number that the fact allows, without its deviation; both are the value if it has one."""
        if self.value is not None:
            return self.value, self.value
        return (-inf if self.least is None else self.least), (
            inf if self.most is None else self.most
        )

    @property
    def text(self) -> str:
        """What is expected, such as ``2.3 ± 0.35 mm/s`` or ``at least 0.3 ± 0.1``."""
        unit, scale = self.unit
        named = {"": self.value, "at least ": self.least, "at most ": self.most}
        limits = " and ".join(
            f"{word}{number * scale:.4g}" for word, number in named.items() if number is not None
        )
        return f"{limits} ± {self.deviation * scale:.2g} {unit}".strip()

    def of_numbers(self, numbers: Mapping[str, Mapping[str, float]]) -> float:
        """The number of this observation, from quantities by experiment (`numbers_of`).

        NaN if one that it needs is NaN, or its ratio is to walkers at rest.
        """
        mean = float(np.mean([numbers[label][self.quantity] for label in self.of]))
        if not self.over:
            return mean
        below = float(np.mean([numbers[label][self.quantity] for label in self.over]))
        return (
            nan
            if observation_kind(self.quantity) is SPEED and abs(below) < LEAST_SPEED
            else mean / below
        )

    def residual(self, number: float) -> float:
        """How far a number is from what the fact allows, in deviations; NaN for NaN."""
        return (number - float(np.clip(number, *self.limits))) / self.deviation

    def agrees(self, number: float) -> bool:
        """Whether a number is within a deviation of what the fact allows; NaN is not."""
        return abs(self.residual(number)) <= 1.0


def observation_kind(quantity: str) -> QuantityKind | None:
    """The kind of a quantity; None if it is a plain number."""
    return SPEED if quantity in get_args(Speed) else ANGLE if quantity in get_args(Angle) else None


def numbers_of(run: str | Path) -> dict[str, float]:
    """All quantities of the finished run of a dimer; NaN where no walker is steady and keeps its beads together."""
    results = read_results(run)
    walkers, kept = results.table("walkers"), steady_walkers(results)
    numbers = NO_NUMBERS | {name: float(kept[name].mean()) for name in get_args(Speed)}
    if len(kept):
        trajectory = results.columns("trajectory")
        run_made = case_of(results.directory).for_cycles(round(trajectory["cycle"].max())).run

        def square(column: str) -> float:
            """Mean square over the measured samples of the walkers that count."""
            course = trajectory[column].reshape(len(walkers), -1).T
            return float(np.mean(course[settled_samples(run_made)][:, kept.index] ** 2))

        for bead, name in enumerate(get_args(Slip), 1):
            numbers[name] = float(np.sqrt(square(f"sliding_{bead}") / square("velocity")))
    if len(angles := misalignment(walkers[keeps_beads_together(walkers)])):
        numbers |= {"largest_angle": float(angles.max()), "smallest_angle": float(angles.min())}
    return numbers


def numbers_in(table: pd.DataFrame) -> list[dict[str, float]]:
    """`numbers_of` the runs of a sweep's table; NaN for those that are not finished."""
    points = zip(table["run"], table["status"], strict=True)
    return [numbers_of(run) if status == "finished" else NO_NUMBERS for run, status in points]


def misalignment(walkers: pd.DataFrame) -> FloatArray:
    """Angles to the drive axis at the end, in either direction, 0 to 90 degrees, of a table ``walkers``."""
    ends = np.degrees(walkers["orientation_end"].to_numpy())
    angles: FloatArray = np.abs((ends + 90.0) % 180.0 - 90.0)
    return angles


def keeps_beads_together(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the beads of walkers of a table ``walkers`` stay together."""
    return walkers["separated_fraction"] < SEPARATED


def steady_walkers(results: Results) -> pd.DataFrame:
    """Rows of a run's table ``walkers`` that are steady, on the axis and whose beads stay together.

    Symmetric dimers, which do not walk and turn across the axis, need only stay together.
    """
    walkers = results.table("walkers")
    kept = keeps_beads_together(walkers)
    if results.get("sin_delta") != 0.0:
        kept &= walkers["steady"] & (walkers["orientation_end"].abs() < ASTRAY)
    return walkers.loc[kept]
