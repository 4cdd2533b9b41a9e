"""Beads of a case: walkers on the boundary, a poured mixture, beads placed one by one.

The tables of a case file (`DimersTable`, ...) may lack values that follow from others; the bodies
of a resolved case (`Dimers`, ...) have all of them. Each body knows the radii of its beads, and
which of them are joined by bridges. Where the beads start is the subject of
`walkers.inputs.resolving.standing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import pi
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from walkers.inputs import units
from walkers.inputs.config_table import Choice, ConfigTable, Indirect, key
from walkers.inputs.tables.arrangements import WalkerGeometry
from walkers.inputs.units import Diameter, Length, Number, Position, Radius, SignedLength, Whole
from walkers.physics.capillary import bead_volume

MOST_BEADS = 200_000
"""Largest number of beads of a case."""
_Place = tuple[SignedLength, SignedLength]
_FROM_2_TO_100 = Field(min_length=2, max_length=100)
_Radii = Annotated[tuple[Radius, ...], _FROM_2_TO_100]
_Diameters = Annotated[tuple[Diameter, ...], _FROM_2_TO_100]


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a range; raises `ValueError` if the larger one is first."""
    if ends[0] > ends[1]:
        raise ValueError("expected the smaller one first")
    return ends


_Range = Annotated[tuple[Radius, Radius], AfterValidator(_ascending)]
_DiameterRange = Annotated[tuple[Diameter, Diameter], AfterValidator(_ascending)]


class WalkersTable(ConfigTable):
    """Walkers of one kind: the keys that ``[dimers]`` and ``[[clusters]]`` have in common.

    They face along the drive axis (right, up a slope), against it (left, down), or in turns along
    and against it (both); an ``angle`` turns all of them. At the start, forces balance at all
    contacts. The first of the ``radii`` belongs to the leading bead.
    """

    replicates: Whole = key(
        "Number of walkers, each with a small random perturbation at the start.", 6, ge=1, le=1000
    )
    facing: Literal["both", "right", "left", "up", "down"] = key(
        "Direction along the drive axis: `right` or `up`, `left` or `down`, or alternately `both`.",
        "both",
    )
    angle: units.Angle = key("Angle at the start between the whole walker and that direction.", 0.0)
    angle_spread: units.NonNegativeAngle = key(
        "Range of the random angle at the start: `angle` ± this.", pi / 180.0
    )
    gap_spread: Number = key(
        "Range of the random factor of the overlap of each walker: 1 ± this.", 0.2, ge=0, lt=1
    )
    spacing: Annotated[Length | None, units.AUTO] = key(
        "Distance between the walkers. `auto`: they do not meet; with `meet`, they do not touch "
        "at the start.",
        None,
    )
    meet: units.Flag = key(
        "Whether the walkers may meet. If not, a meeting gives a warning.", False
    )


class Walkers(WalkerGeometry, WalkersTable):
    """Walkers of one kind of a resolved case."""

    spacing: Length

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return list(self.radii) * self.replicates


class DimersTable(WalkersTable):
    """``[dimers]``: walkers of two beads."""

    choices: ClassVar = (Choice(("radii",), ("diameters",), ("mean_radius", "sin_delta")),)
    radii: tuple[Radius, Radius] | None = key(
        "Radii of the beads. The first bead leads.", None, ["0.3 mm", "0.2 mm"]
    )
    diameters: Indirect[tuple[Diameter, Diameter]] = key(
        "Diameters, instead of `radii`.", None, ["0.6 mm", "0.4 mm"]
    )
    mean_radius: Indirect[Radius] = key(
        "Mean radius, with `sin_delta` instead of `radii`.", None, "0.25 mm"
    )
    sin_delta: Indirect[Number] = key(
        "Asymmetry of a dimer, sin δ = (R1 − R2)/(R1 + R2).", None, 0.2, gt=-0.9, lt=0.9
    )


class Dimers(Walkers, DimersTable):
    """The dimers of a resolved case."""

    arrangement: ClassVar[str] = "chain"
    at: ClassVar[tuple[_Place, ...]] = ()
    radii: tuple[Radius, Radius]


class ClusterTable(WalkersTable):
    """One of ``[[clusters]]``: walkers of several beads, in an ``arrangement`` or ``at`` places."""

    choices: ClassVar = (Choice(("radii",), ("diameters",)), Choice(("arrangement",), ("at",)))
    radii: _Radii | None = key(
        "Radii of the beads. The first bead leads.", None, ["0.3 mm", "0.2 mm", "0.2 mm"]
    )
    diameters: Indirect[_Diameters] = key(
        "Diameters, instead of `radii`.", None, ["0.6 mm", "0.4 mm", "0.4 mm"]
    )
    arrangement: str = key(
        "`chain`, `fan`, `diamond` or `ring`. See [](../cases.md#bodies).", "", "fan"
    )
    at: Annotated[tuple[_Place, ...], Field(max_length=100)] = key(
        "Place of each bead, distance ahead and to the left, instead of an arrangement.",
        (),
        [["0.2 mm", "0 mm"], ["-0.3 mm", "0 mm"]],
    )


class Cluster(Walkers, ClusterTable):
    """The clusters of one kind of a resolved case."""

    radii: _Radii


class MixtureTable(ConfigTable):
    """``[mixture]``: poured beads of two classes.

    Each class has ``sizes`` radii within a range, which are equally frequent.
    """

    choices: ClassVar = (
        Choice(("small",), ("small_diameters",)),
        Choice(("large",), ("large_diameters",)),
        Choice(("count",), ("fill_height",)),
    )
    small: _Range | None = key("Range of radii of the small beads.", None, ["0.3 mm", "0.315 mm"])
    large: _Range | None = key("Range of radii of the large beads.", None, ["0.5 mm", "0.59 mm"])
    small_diameters: Indirect[_DiameterRange] = key(
        "Diameters, instead of `small`.", None, ["0.6 mm", "0.63 mm"]
    )
    large_diameters: Indirect[_DiameterRange] = key(
        "Diameters, instead of `large`.", None, ["1 mm", "1.18 mm"]
    )
    small_share: Number = key("Share of the small beads.", 0.5, ge=0, le=1)
    mixed_by: Literal["mass", "number"] = key("Quantity that `small_share` refers to.", "mass")
    sizes: Whole = key("Number of different radii in each range.", 4, ge=1, le=20)
    count: Whole | None = key("Number of beads.", None, 200, ge=1, le=MOST_BEADS)
    fill_height: Indirect[Length] = key(
        "Height of the bed, instead of a number of beads.", None, "3 mm"
    )


class Mixture(MixtureTable):
    """The mixture of a resolved case."""

    small: _Range
    large: _Range
    count: Whole

    @cached_property
    def small_radii(self) -> tuple[float, ...]:
        """The radii of the small beads, m."""
        return middles_of(self.small, self.sizes)

    @cached_property
    def large_radii(self) -> tuple[float, ...]:
        """The radii of the large beads, m."""
        return middles_of(self.large, self.sizes)

    @cached_property
    def small_share_by_number(self) -> float:
        """Share of the small beads by number."""
        return share_and_volume(self, self.small_radii, self.large_radii)[0]

    @cached_property
    def counts(self) -> tuple[int, int]:
        """Numbers of small and of large beads."""
        small_count = round(self.count * self.small_share_by_number)
        return small_count, self.count - small_count

    @property
    def radii(self) -> tuple[float, ...]:
        """The different radii, m."""
        return self.small_radii + self.large_radii

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """Radius of a bead and radii of the beads that touch it, m: largest beside smallest.

        Beads of a pile have more neighbours than one, so that the viscous limit of their time step
        is lower. The automatic time step is a share of the limit that allows for it: a glycerol
        pile at 0.4 of the limit is agitated as at a quarter of that step, within 0.1 %, and heats
        up at 0.8.
        """
        largest = max(self.large_radii)
        smallest = min(self.small_radii)
        return [(largest, [smallest]), (smallest, [largest])]

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m: the small ones first."""
        small_count, large_count = self.counts
        return [*_in_turn(self.small_radii, small_count), *_in_turn(self.large_radii, large_count)]


def _in_turn(radii: Sequence[float], count: int) -> list[float]:
    """Radii of a number of beads, which have the given radii in turn, m."""
    return [radii[number % len(radii)] for number in range(count)]


def middles_of(ends: tuple[float, float], number: int) -> tuple[float, ...]:
    """The different middles of equal parts of a range.

    Parameters
    ----------
    ends
        Smallest and largest radius, m.
    number
        Number of parts.

    Returns
    -------
    tuple of float
        Radii in m, ascending; a single one if both ends are the same.
    """
    low, high = ends
    middles = []
    for part in range(number):
        middle = low + (high - low) * (part + 0.5) / number
        middles.append(float(f"{middle:.12g}"))
    return tuple(dict.fromkeys(middles))


def share_and_volume(
    table: MixtureTable, small_radii: Sequence[float], large_radii: Sequence[float]
) -> tuple[float, float]:
    """Share of the small beads of a mixture, and the mean volume of all beads.

    Parameters
    ----------
    table
        The mixture, with the share of the small beads by mass or by number.
    small_radii, large_radii
        Radii of the two classes, m. Within a class, all radii are equally frequent.

    Returns
    -------
    share : float
        Share of the small beads by number.
    volume : float
        Mean volume of a bead, m³.
    """
    small_volume = _mean_volume(small_radii)
    large_volume = _mean_volume(large_radii)
    share = table.small_share
    if table.mixed_by == "mass":
        small_number = share / small_volume
        large_number = (1.0 - share) / large_volume
        share = small_number / (small_number + large_number)
    return share, share * small_volume + (1.0 - share) * large_volume


def _mean_volume(radii: Sequence[float]) -> float:
    """Mean volume of beads of some radii (m), m³."""
    return sum(bead_volume(radius) for radius in radii) / len(radii)


class PlacedBeadTable(ConfigTable):
    """One of ``[[placed]]``: a bead and its place at the start, from the middle of the floor."""

    choices: ClassVar = (Choice(("radius",), ("diameter",)),)
    radius: Radius | None = key("Radius of the bead.", None, "0.3 mm")
    diameter: Indirect[Diameter] = key("Diameter of the bead, instead of `radius`.", None, "0.6 mm")
    at: Position = key(
        "Centre of the bead at the start: x, y, z from the middle of the floor.",
        example=["5 mm", "-3 mm", "0.3 mm"],
    )


class PlacedBead(PlacedBeadTable):
    """A placed bead of a resolved case."""

    radius: Radius
