"""The numbers of a result as rows of a table: what each is, its error and extremes, in the units that one reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees, floor, isfinite, log10
from typing import Any

from walkers.postprocess.posture import POSTURES, ways

_UNITS = {"m/s": ("mm/s", 1e3), "m": ("mm", 1e3), "rad": ("°", degrees(1.0)), "share": ("%", 100.0)}
"""For units of the result, those that are shown, and how many of them one is."""
_DIGITS = 4
"""Significant, of a number without an error; with one, so many that two digits of the error are seen."""


@dataclass(frozen=True)
class Number:
    """A number of a result.

    Attributes
    ----------
    key
        Its place in the result, such as ``velocity.mean``.
    value
        SI.
    unit, factor
        In which it is shown, and how many of it the SI unit is.
    error
        What gives its digits: its standard error, or that of the number beside which it stands; None if unknown.
    """

    key: str
    value: float
    unit: str = ""
    factor: float = 1.0
    error: float | None = None

    @property
    def text(self) -> str:
        """The number in its unit, without it."""
        return rounded(self.value * self.factor, None if self.error is None else self.error * self.factor)


@dataclass(frozen=True)
class Quantity:
    """A row: what it is called, its number, its standard error, and the smallest and largest of those that it is of."""

    name: str
    value: Number | None
    error: Number | None = None
    smallest: Number | None = None
    largest: Number | None = None

    @property
    def unit(self) -> str:
        """In which all of them are shown."""
        return next((one.unit for one in (self.value, self.smallest) if one is not None), "")


def rounded(value: float, error: float | None = None) -> str:
    """A number with the digits that its error leaves (two of the error's), or four."""
    if isinstance(value, (bool, int)):
        return str(value)
    if not isfinite(value):
        return "-"
    if error and isfinite(error):
        decimals = max(0, 1 - floor(log10(abs(error))))
        if decimals <= 9:
            return f"{value:.{decimals}f}"
    return f"{value:.{_DIGITS}g}"


def number_of(result: Mapping[str, Any], key: str, unit: str = "", error: float | None = None) -> Number | None:
    """The number at a place in a result; None where it has none."""
    value: Any = result
    for part in key.split("."):
        value = value[int(part)] if isinstance(value, list) else value.get(part)
        if value is None:
            return None
    shown, factor = _UNITS.get(unit, (unit, 1.0))
    # A whole number stays one.
    return Number(key, value, shown, 1 if factor == 1.0 else factor, error)


def quantity(result: Mapping[str, Any], name: str, key: str, unit: str = "") -> Quantity:
    """The row of a single number."""
    return Quantity(name, number_of(result, key, unit))


def spread(result: Mapping[str, Any], name: str, key: str, unit: str) -> Quantity:
    """The row of a mean over replicates with its standard error and extremes."""
    known = number_of(result, f"{key}.standard_error", unit)
    doubt = None if known is None else known.value
    mean, error, smallest, largest = (
        number_of(result, f"{key}.{what}", unit, doubt) for what in ("mean", "standard_error", "smallest", "largest")
    )
    return Quantity(name, mean, error, smallest, largest)


def of_walkers(result: Mapping[str, Any]) -> Iterator[Quantity]:
    """What the analysis of walkers gives."""
    first, second = ways(uphill=result["goes_uphill"])
    yield spread(result, "velocity along the heading, positive toward the large bead", "velocity", "m/s")
    yield spread(result, f"velocity of those that started facing {first}", "right_facing", "m/s")
    yield spread(result, f"velocity of those that started facing {second}", "left_facing", "m/s")
    if result["turned_round"]:
        yield spread(result, "velocity of those that kept their heading", "kept_heading", "m/s")
    yield quantity(result, "velocity along the drive axis", "axial_velocity.mean", "m/s")
    yield quantity(result, "velocity across the drive axis", "lateral_velocity.mean", "m/s")
    for bead in result["rotation"]:
        yield quantity(result, f"rotation of {bead.replace('_', ' ')}, −R dφ/dt", f"rotation.{bead}", "m/s")
    for contact, name in result["contacts"].items():
        yield quantity(result, f"sliding, {name}", f"sliding.{contact}", "m/s")
    for contact, name in result["contacts"].items():
        yield quantity(result, f"contact open, {name}", f"open.{contact}", "share")
    yield spread(result, "orientation at the end", "orientation_end", "rad")
    for number, make in enumerate(result.get("makes", [])):
        radii = "/".join(f"{radius * 1e3:g}" for radius in make["radii"])
        yield spread(result, f"velocity of those of {radii} mm", f"makes.{number}.velocity", "m/s")
    if result["posture"] is not None:
        for posture in POSTURES:
            yield quantity(result, f"walkers that are {posture}", f"posture.{posture}")
    yield quantity(result, "walkers", "walkers")
    yield quantity(result, "of them steady", "steady")
    yield quantity(result, "of them turned round by more than 90°", "turned_round")
    yield quantity(result, "beads farther apart than a bridge reaches", "separated_fraction", "share")
    yield quantity(result, "cycles driven", "cycles")
    yield quantity(result, "of them to settle", "settling_cycles")
    yield quantity(result, "dimensionless peak force Γ0", "gamma0")
    yield quantity(result, "asymmetry sin δ", "sin_delta")


def of_piles(result: Mapping[str, Any]) -> Iterator[Quantity]:
    """What the analysis of piles gives."""
    yield quantity(result, "beads", "beads")
    yield quantity(result, "of them large", "large")
    yield quantity(result, "time shaken", "driven", "s")
    yield quantity(result, "time to settle before", "settling", "s")
    for when in ("start", "end"):
        yield quantity(result, f"height of the surface at the {when}", f"surface.{when}", "m")
        yield quantity(result, f"Brazil-nut index at the {when}", f"brazil_nut.{when}")
    names = {"rest": "at rest", "rest_inner": "at rest, beads at no wall", "shaken": "while shaken"}
    for where, told in names.items():
        for what in ("contacts", "bridges"):
            if result["coordination"][where] is not None:
                yield quantity(result, f"{what} per bead, {told}", f"coordination.{where}.{what}")
    yield quantity(result, "clusters free of the pile and held to a wall", "clusters")
    for event in result["events"]:
        yield quantity(result, f"of them {event}", f"events.{event}")
    for number, climb in enumerate(result["climbs"]):
        leader = "large" if climb["leader_large"] else "small"
        name = f"climb {number + 1} ({' '.join(climb['walls'])}, led by a {leader} bead)"
        for what, unit in {"begin": "s", "end": "s", "gain": "m", "height": "m"}.items():
            yield quantity(result, f"{name}: {what}", f"climbs.{number}.{what}", unit)
        error = number_of(result, f"climbs.{number}.standard_error", "m/s")
        speed = number_of(result, f"climbs.{number}.speed", "m/s", None if error is None else error.value)
        yield Quantity(f"{name}: speed", speed, error)
        yield quantity(result, f"{name}: beads", f"climbs.{number}.size")


def of_meetings(result: Mapping[str, Any]) -> Iterator[Quantity]:
    """What the analysis of meetings gives."""
    yield quantity(result, "meetings of walkers: merged", "merged")
    yield quantity(result, "meetings of walkers: parted", "parted")
    yield quantity(result, "most walkers together", "largest_group")
