"""Beads of a case: walkers on the boundary, a poured mixture, beads placed one by one.

The tables of a case file (`DimersTable`, ...) may lack values that follow from others; the bodies of a resolved case
(`Dimers`, ...) have all of them. Each knows its radii and which of its beads bridges join; where they start is the
subject of `walkers.inputs.resolving.standing`.
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

_Place = tuple[SignedLength, SignedLength]
_FEW = Field(min_length=2, max_length=100)
_Radii = Annotated[tuple[Radius, ...], _FEW]
_Diameters = Annotated[tuple[Diameter, ...], _FEW]
MOST_BEADS = 200_000


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a range; raises `ValueError` if the larger one is first."""
    if ends[0] > ends[1]:
        raise ValueError("expected the smaller one first")
    return ends


_Range = Annotated[tuple[Radius, Radius], AfterValidator(_ascending)]
_DiameterRange = Annotated[tuple[Diameter, Diameter], AfterValidator(_ascending)]


class WalkersTable(ConfigTable):
    """What ``[dimers]`` and ``[[clusters]]`` share: walkers of one make, their number and initial state.

    They face along the drive axis (right, up a slope), against it (left, down), or every other one (both), but for an
    ``angle``. At the start, forces balance at all contacts. The first of the ``radii`` belongs to the leading bead.
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
        "Distance between the walkers. `auto`: they do not meet; with `meet`, they do not touch at the start.",
        None,
    )
    meet: units.Flag = key(
        "Whether the walkers may meet. If not, a meeting gives a warning.", False
    )


class Walkers(WalkerGeometry, WalkersTable):
    """Walkers of one make of a resolved case."""

    spacing: Length

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return [*self.radii] * self.replicates


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


_THREE = ["0.3 mm", "0.2 mm", "0.2 mm"], ["0.6 mm", "0.4 mm", "0.4 mm"]


class ClusterTable(WalkersTable):
    """One of ``[[clusters]]``: walkers of several beads, in an ``arrangement``, or ``at`` a place for each."""

    choices: ClassVar = (Choice(("radii",), ("diameters",)), Choice(("arrangement",), ("at",)))
    radii: _Radii | None = key("Radii of the beads. The first bead leads.", None, _THREE[0])
    diameters: Indirect[_Diameters] = key("Diameters, instead of `radii`.", None, _THREE[1])
    arrangement: str = key(
        "`chain`, `fan`, `diamond` or `ring`. See [](../cases.md#bodies).", "", "fan"
    )
    at: Annotated[tuple[_Place, ...], Field(max_length=100)] = key(
        "Place of each bead, distance ahead and to the left, instead of an arrangement.",
        (),
        [["0.2 mm", "0 mm"], ["-0.3 mm", "0 mm"]],
    )


class Cluster(Walkers, ClusterTable):
    """The clusters of one make of a resolved case."""

    radii: _Radii


class MixtureTable(ConfigTable):
    """``[mixture]``: poured beads of two classes, each of ``sizes`` radii within a range, which occur equally often."""

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
        few = round(self.count * self.small_share_by_number)
        return few, self.count - few

    @property
    def radii(self) -> tuple[float, ...]:
        """The different radii, m."""
        return self.small_radii + self.large_radii

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """A large bead beside a small one.

        Beads of a pile have more neighbours, and its viscous limit is lower; ``auto``'s share of the limit allows for
        it: a glycerol pile at 0.4 of it is agitated as at a quarter of that step, within 0.1 %, and at 0.8 it heats up.
        """
        large, small = max(self.large_radii), min(self.small_radii)
        return [(large, [small]), (small, [large])]

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m: the small ones first."""
        classes = ((self.small_radii, self.counts[0]), (self.large_radii, self.counts[1]))
        return [sizes[number % len(sizes)] for sizes, count in classes for number in range(count)]


def middles_of(ends: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = ends
    return tuple(
        dict.fromkeys(
            float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)
        )
    )


def share_and_volume(
    table: MixtureTable, small_radii: Sequence[float], large_radii: Sequence[float]
) -> tuple[float, float]:
    """Share of the small beads by number, and the mean volume of a bead, m³, from radii in m."""
    volumes = [sum(map(bead_volume, radii)) / len(radii) for radii in (small_radii, large_radii)]
    share = table.small_share
    if table.mixed_by == "mass":
        by_number = [share / volumes[0], (1.0 - share) / volumes[1]]
        share = by_number[0] / sum(by_number)
    return share, share * volumes[0] + (1.0 - share) * volumes[1]


class PlacedBeadTable(ConfigTable):
    """One of ``[[placed]]``: a bead and where it begins, from the middle of the floor."""

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
