"""What the paper publishes of the walker as numbers: ``published.toml``, and of which walkers each is."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

GRAVITY = 9.8
"""The paper's g, m/s²."""
_DEVIATION = 0.15
FIG4_PEAKS = (2.0, 10.0)
"""Fig. 4a and b: peak acceleration, g."""


class Point(NamedTuple):
    """A walker of the paper's: the sweep that has it, its radii (mm), its frequency (Hz) and peak acceleration (g).

    Where no acceleration is given Γ0 is 0.5.
    """

    sweep: str
    radii: tuple[float, float]
    frequency: float
    peak: float | None

    @property
    def name(self) -> str:
        """What the walker differs from others of its figure in."""
        if self.sweep == "fig4":
            return f"4{'ab'[FIG4_PEAKS.index(self.peak or 0.0)]}"
        return "{:g}/{:g} mm".format(*self.radii) if self.peak is None else f"{self.frequency:g} Hz, {self.peak:g} g"


@dataclass(frozen=True)
class Published:
    """A published number, and of what it is one.

    Attributes
    ----------
    key
        Names it.
    what
        In words.
    value
        As published, in ``unit``; None where the paper states it in words only. Such a one has bounds, and does not
        count among those that agree or disagree.
    unit
        Shown with it.
    bounds
        Between which a value is what the paper says, if it says so: the rounding of its digits (0.735, of which Γ0 =
        0.74 is made, is on its edge) is none. Those of angles are ours.
    depends_on
        A sentence: what a disagreement of the engine depends on.
    measured
        Whether it tests the engine: Γ0 and Mathieu's V follow from beads and drive alone.
    of, over
        The number is a mean over walkers, or its ratio to one over others, pair by pair.
    quantity
        Of these: ``velocity``, ``rotation_1`` or ``sliding_1`` of those that walk; ``gamma0``; ``velocity_of_all``,
        whichever way they turn. Empty where `walkers.paper.comparison` has a function for the number.
    fitted
        What it is called among those that the theory is fitted to (`walkers.paper.model_terms`), if it is one.
    deviation
        Its error there, in ``unit``; 15 % if None.
    compared
        Whether it is one of the comparison.
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
    fitted: str = ""
    deviation: float | None = None
    compared: bool = True

    @property
    def si(self) -> float:
        """The value in SI units, to the digits that it was published with."""
        return float(f"{self.value or 0.0}e-3") if self.unit == "mm/s" else self.value or 0.0

    @property
    def si_deviation(self) -> float:
        """Its error among those that the theory is fitted to, in SI units."""
        if self.deviation is None:
            return _DEVIATION * abs(self.si)
        return self.deviation * (1.0 if self.over else 1e-3)


def _points(given: Mapping[str, Any]) -> tuple[Point, ...]:
    large, small = given["radii"]
    return tuple(Point(given["sweep"], (large, small), one, given.get("peak")) for one in given["frequencies"])


def _read(given: Mapping[str, Any], reasons: Mapping[str, str]) -> Published:
    points = {name: _points(given[name]) for name in ("of", "over") if name in given}
    bounds = {"bounds": tuple(given["bounds"])} if "bounds" in given else {}
    return Published(**{**given, **points, **bounds, "depends_on": reasons.get(given.get("depends_on", ""), "")})


_FILE = tomllib.loads(Path(__file__).with_name("published.toml").read_text("utf-8"))
NUMBERS = tuple(_read(given, _FILE["reasons"]) for given in _FILE["numbers"])
"""Every number that the paper publishes of walkers, and others that follow from what it says."""
COMPARED = tuple(number for number in NUMBERS if number.compared)
BY_KEY = {number.key: number for number in NUMBERS}
FIT = {float(g): BY_KEY[f"fig2_{g}g"].si for g in range(2, 7)}
"""Fig. 2: the paper's fitted curve below the plateau, m/s, at peak accelerations in g."""
FIG3_FIT = {one.of[0].radii: one.si for one in NUMBERS if one.key.startswith("fig3_") and one.value}
"""Fig. 3: the same curve at Γ0 = 0.5, m/s, by the radii in mm."""
_FITTED = (
    *(f"fig2_{g}g" for g in range(2, 7)),
    *("fig2_plateau", "fig2_frequency_4g", "fig2_frequency", "fig2_rest"),
    *(number.key for number in NUMBERS if number.fitted and number.key.startswith(("fig3", "fig4"))),
)
FITTED = tuple(BY_KEY[key] for key in _FITTED)
"""Those that the theory is fitted to: of walkers on the axis whose contacts stay closed."""
