"""Beads of a case: walkers on the boundary, a poured mixture, beads placed one by one.

Each knows its radii and which of its beads bridges join; where they start is the subject of
`walkers.inputs.resolving.standing`. How the beads of a cluster stand beside each other is one of
`ARRANGEMENTS`: in the cluster's frame, seen from above, whose first axis points where it is to face
and the second to the left. The beads are taken in the order of the case, and the point over which
the first two touch is the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import combinations
from math import acos, asin, cos, dist, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple

from pydantic import AfterValidator, Field

from walkers.inputs import units
from walkers.inputs.config_table import Choice, Filled, Indirect, Table, key
from walkers.inputs.units import Diameter, Length, Number, Position, Radius, SignedLength, Whole
from walkers.physics.capillary import bead_volume

Apart = Callable[[int, int], float]
"""Distance of two touching beads seen from above, m, by their numbers."""
Places = list[tuple[float, float]]
Pairs = tuple[tuple[int, int], ...]
_Place = tuple[SignedLength, SignedLength]
_FEW = Field(min_length=2, max_length=100)
MOST_BEADS = 200_000
_LEAST_LEVER = 0.1
"""Smallest distance of the centroids of large and small beads that gives a heading, over the extent of a cluster."""
_TOUCHING = 0.02  # radii by which beads that are given places may be apart and still touch
_TOO_SMALL = "a bead is too small to touch two beads that touch each other; expected a larger one"


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a range; raises `ValueError` if the larger one is first."""
    if ends[0] > ends[1]:
        raise ValueError("expected the smaller one first")
    return ends


_Range = Annotated[tuple[Radius, Radius], AfterValidator(_ascending)]
_DiameterRange = Annotated[tuple[Diameter, Diameter], AfterValidator(_ascending)]


class Arrangement(NamedTuple):
    """Positions of ``fewest`` to ``most`` beads, from radii and `Apart`."""

    places: Callable[[Sequence[float], Apart], Places]
    fewest: int
    most: int = 100


def _chain(radii: Sequence[float], apart: Apart) -> Places:
    """One behind the other, the first in front."""
    along = [apart(0, 1) * radii[0] / (radii[0] + radii[1])]
    for bead in range(len(radii) - 1):
        along.append(along[-1] - apart(bead, bead + 1))
    return [(place, 0.0) for place in along]


def _fan(radii: Sequence[float], apart: Apart) -> Places:
    """The first bead in front, the others behind it: all touch it, and each the next."""
    turns = [0.0]
    for bead in range(1, len(radii) - 1):
        side, next_side, between = apart(0, bead), apart(0, bead + 1), apart(bead, bead + 1)
        cosine = (side**2 + next_side**2 - between**2) / (2.0 * side * next_side)
        if abs(cosine) > 1.0:
            raise ValueError(_TOO_SMALL)
        turns.append(turns[-1] + acos(cosine))
    if turns[-1] + turns[-1] / max(len(turns) - 1, 1) > 2.0 * pi * (1.0 + 1e-9):
        raise ValueError("too many beads to fit around the first one; expected fewer")
    front = apart(0, 1) * radii[0] / (radii[0] + radii[1])
    behind = [(apart(0, bead), pi - turns[-1] / 2.0 + turn) for bead, turn in enumerate(turns, 1)]
    return [(front, 0.0), *((front + away * cos(turn), away * sin(turn)) for away, turn in behind)]


def _diamond(radii: Sequence[float], apart: Apart) -> Places:
    """One in front, two side by side behind it, one at the back that touches these two."""
    front, left, right = _fan(radii[:3], apart)
    along, across = right[0] - left[0], right[1] - left[1]
    width, reach, last_reach = apart(1, 2), apart(1, 3), apart(2, 3)
    share = (reach**2 - last_reach**2 + width**2) / (2.0 * width**2)
    if reach < abs(share) * width:
        raise ValueError(_TOO_SMALL)
    height = sqrt(reach**2 - (share * width) ** 2) / width
    back = (left[0] + share * along + height * across, left[1] + share * across - height * along)
    return [front, left, right, back]


def _ring(radii: Sequence[float], apart: Apart) -> Places:
    """All on a circle, each touching the next, the first one in front."""
    number = len(radii)
    chords = [apart(bead, (bead + 1) % number) for bead in range(number)]
    low, high = max(chords) / 2.0, sum(chords)

    def turns(radius: float) -> list[float]:
        return [2.0 * asin(min(chord / (2.0 * radius), 1.0)) for chord in chords]

    if sum(turns(low)) < 2.0 * pi:
        raise ValueError("these beads do not form a closed ring; expected more beads, or more similar radii")
    for _ in range(200):
        middle = (low + high) / 2.0
        low, high = (middle, high) if sum(turns(middle)) > 2.0 * pi else (low, middle)
    place, places = 0.0, []
    for turn in turns(high):
        places.append((high * cos(place), high * sin(place)))
        place += turn
    return places


def touching(places: Sequence[tuple[float, float]], radii: Sequence[float], slack: float) -> Pairs:
    """Pairs of beads at given positions whose gap is below a fraction of their radii."""
    pairs = []
    for (first, (x, y)), (second, (to_x, to_y)) in combinations(enumerate(places), 2):
        gap = hypot(x - to_x, y - to_y, radii[first] - radii[second]) - radii[first] - radii[second]
        if gap < slack * min(radii[first], radii[second]):
            pairs.append((first, second))
    return tuple(pairs)


ARRANGEMENTS: Mapping[str, Arrangement] = {
    "chain": Arrangement(_chain, 2),
    "fan": Arrangement(_fan, 2),
    "diamond": Arrangement(_diamond, 4, most=4),
    "ring": Arrangement(_ring, 3),
}
"""Arrangements by their names in case files."""


class Walkers(Table):
    """What ``[dimers]`` and ``[[clusters]]`` share: walkers of one make, their number and initial state.

    They face along the drive axis (right, up a slope), against it (left, down), or every other one (both), but for an
    ``angle``. At the start, forces balance at all contacts. The first of the ``radii`` belongs to the leading bead.
    """

    if TYPE_CHECKING:
        radii: tuple[float, ...]

        @property
        def arrangement(self) -> str: ...  # noqa: D102
        @property
        def at(self) -> tuple[tuple[float, float], ...]: ...  # noqa: D102

    replicates: Whole = key("Number of walkers, each with a small random perturbation at the start.", 6, ge=1, le=1000)
    facing: Literal["both", "right", "left", "up", "down"] = key(
        "Direction along the drive axis: `right` or `up`, `left` or `down`, or alternately `both`.", "both"
    )
    angle: units.Angle = key("Angle at the start between the whole walker and that direction.", 0.0)
    angle_spread: units.NonNegativeAngle = key("Range of the random angle at the start: `angle` ± this.", pi / 180.0)
    gap_spread: Number = key("Range of the random factor of the overlap of each walker: 1 ± this.", 0.2, ge=0, lt=1)
    spacing: Annotated[Filled[Length], units.AUTO] = key(
        "Distance between the walkers. `auto`: they do not meet; with `meet`, they do not touch at the start.", None
    )
    meet: units.Flag = key("Whether the walkers may meet. If not, a meeting gives a warning.", False)

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return [*self.radii] * self.replicates

    @cached_property
    def pairs(self) -> Pairs:
        """The beads of a walker that touch at the start, numbered from 0."""
        pairs, last = touching(self.design, self.radii, _TOUCHING), len(self.radii) - 1
        if self.arrangement == "ring":  # closed by the last pair
            pairs = (*(pair for pair in pairs if pair != (0, last)), (0, last))
        if self.arrangement == "fan" and last > 2:  # not closed, even by beads all around
            pairs = tuple(pair for pair in pairs if pair != (1, last))
        return pairs

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """Radius of each bead of a walker and radii of the beads that touch it, m."""
        neighbours: list[list[float]] = [[] for _ in self.radii]
        for first, second in self.pairs:
            neighbours[first].append(self.radii[second])
            neighbours[second].append(self.radii[first])
        return list(zip(self.radii, neighbours, strict=True))

    @cached_property
    def design(self) -> Places:
        """Positions of rigid beads on a plane in the frame of the walker, m."""
        return list(self.at) or ARRANGEMENTS[self.arrangement].places(self.radii, self.rigid)

    def rigid(self, bead: int, neighbour: int) -> float:
        """Distance seen from above of two beads that touch each other and the floor without overlap, m."""
        first, second = self.radii[bead], self.radii[neighbour]
        return (first + second) * cos(asin((first - second) / (first + second)))

    @cached_property
    def length(self) -> float:
        """Length of the walker seen from above, m."""
        distances = {} if self.at else {pair: self.rigid(*pair) for pair in self.pairs}
        extents = []
        for first, second in combinations(range(len(self.radii)), 2):
            distance = distances.get((first, second), dist(self.design[first], self.design[second]))
            extents.append(distance + (self.radii[first] + self.radii[second]))
        return max(extents)

    @cached_property
    def front(self) -> tuple[float, ...]:
        """Weights of bead positions in the vector along the start direction; their sum is zero."""
        along = [place[0] for place in self.design]
        middle = sum(along) / len(along)
        largest = max(abs(place - middle) for place in along)
        if largest < 1e-9 * self.length:  # all side by side: it faces the way that is to the right of their row
            return tuple(0.0 for _ in along)
        return tuple((place - middle) / largest for place in along)

    @cached_property
    def toward_large(self) -> tuple[float, ...]:
        """Weights of bead positions in the heading, from the centroid of small beads to that of large ones.

        Where all beads are alike, or the two centroids nearly coincide, the heading is where the walker was to face.
        """
        border = (min(self.radii) + max(self.radii)) / 2.0
        large = [radius > border for radius in self.radii]
        if not any(large):
            return self.front
        many = (sum(large), len(large) - sum(large))
        weights = tuple(1.0 / many[0] if is_large else -1.0 / many[1] for is_large in large)
        axes = zip(*self.design, strict=True)
        lever = [sum(weight * x for weight, x in zip(weights, axis, strict=True)) for axis in axes]
        return weights if hypot(*lever) > _LEAST_LEVER * self.length else self.front

    def places(self, heights: Sequence[float], overlaps: Sequence[float]) -> Places:
        """Positions of the beads of a walker in its frame, from heights and overlaps, m."""
        if self.at:
            return list(self.at)
        overlap_of = {pair: overlaps[len(self.radii) + number] for number, pair in enumerate(self.pairs)}

        def apart(first: int, second: int) -> float:
            between = self.radii[first] + self.radii[second] - overlap_of[min(first, second), max(first, second)]
            if between < abs(heights[first] - heights[second]):
                message = "the radii differ too much: the beads do not touch when they rest on the boundary"
                raise ValueError(f"{message}; expected more similar radii")
            return sqrt(between**2 - (heights[first] - heights[second]) ** 2)

        return ARRANGEMENTS[self.arrangement].places(self.radii, apart)


class Dimers(Walkers):
    """``[dimers]``: walkers of two beads."""

    choices: ClassVar = (Choice("radii or diameters or mean_radius and sin_delta"),)
    arrangement: ClassVar[str] = "chain"
    at: ClassVar[tuple[_Place, ...]] = ()
    radii: Filled[tuple[Radius, Radius]] = key("Radii of the beads. The first bead leads.", None, ["0.3 mm", "0.2 mm"])
    diameters: Indirect[tuple[Diameter, Diameter]] = key("Diameters, instead of `radii`.", None, ["0.6 mm", "0.4 mm"])
    mean_radius: Indirect[Radius] = key("Mean radius, with `sin_delta` instead of `radii`.", None, "0.25 mm")
    sin_delta: Indirect[Number] = key("Asymmetry of a dimer, sin δ = (R1 − R2)/(R1 + R2).", None, 0.2, gt=-0.9, lt=0.9)


_THREE = ["0.3 mm", "0.2 mm", "0.2 mm"], ["0.6 mm", "0.4 mm", "0.4 mm"]


class Cluster(Walkers):
    """One of ``[[clusters]]``: walkers of several beads, in an ``arrangement``, or ``at`` a place for each."""

    choices: ClassVar = (Choice("radii or diameters"), Choice("arrangement or at"))
    radii: Filled[Annotated[tuple[Radius, ...], _FEW]] = key(
        "Radii of the beads. The first bead leads.", None, _THREE[0]
    )
    diameters: Indirect[Annotated[tuple[Diameter, ...], _FEW]] = key("Diameters, instead of `radii`.", None, _THREE[1])
    arrangement: str = key("`chain`, `fan`, `diamond` or `ring`. See [](../cases.md#bodies).", "", "fan")
    at: Annotated[tuple[_Place, ...], Field(max_length=100)] = key(
        "Place of each bead, distance ahead and to the left, instead of an arrangement.",
        (),
        [["0.2 mm", "0 mm"], ["-0.3 mm", "0 mm"]],
    )


class Mixture(Table):
    """``[mixture]``: poured beads of two classes, each of ``sizes`` radii within a range, which occur equally often."""

    choices: ClassVar = (
        Choice("small or small_diameters"),
        Choice("large or large_diameters"),
        Choice("count or fill_height"),
    )
    small: Filled[_Range] = key("Range of radii of the small beads.", None, ["0.3 mm", "0.315 mm"])
    large: Filled[_Range] = key("Range of radii of the large beads.", None, ["0.5 mm", "0.59 mm"])
    small_diameters: Indirect[_DiameterRange] = key("Diameters, instead of `small`.", None, ["0.6 mm", "0.63 mm"])
    large_diameters: Indirect[_DiameterRange] = key("Diameters, instead of `large`.", None, ["1 mm", "1.18 mm"])
    small_share: Number = key("Share of the small beads.", 0.5, ge=0, le=1)
    mixed_by: Literal["mass", "number"] = key("Quantity that `small_share` refers to.", "mass")
    sizes: Whole = key("Number of different radii in each range.", 4, ge=1, le=20)
    count: Filled[Whole] = key("Number of beads.", None, 200, ge=1, le=MOST_BEADS)
    fill_height: Indirect[Length] = key("Height of the bed, instead of a number of beads.", None, "3 mm")

    @cached_property
    def small_radii(self) -> tuple[float, ...]:
        """The radii of the small beads, m."""
        return _middles(self.small, self.sizes)

    @cached_property
    def large_radii(self) -> tuple[float, ...]:
        """The radii of the large beads, m."""
        return _middles(self.large, self.sizes)

    @cached_property
    def share_and_volume(self) -> tuple[float, float]:
        """Share of the small beads by number, and the mean volume of a bead, m³."""
        volumes = [sum(map(bead_volume, radii)) / len(radii) for radii in (self.small_radii, self.large_radii)]
        share = self.small_share
        if self.mixed_by == "mass":
            by_number = [share / volumes[0], (1.0 - share) / volumes[1]]
            share = by_number[0] / sum(by_number)
        return share, share * volumes[0] + (1.0 - share) * volumes[1]

    @cached_property
    def counts(self) -> tuple[int, int]:
        """Numbers of small and of large beads."""
        few = round(self.count * self.share_and_volume[0])
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


def _middles(ends: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = ends
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


class PlacedBead(Table):
    """One of ``[[placed]]``: a bead and where it begins, from the middle of the floor."""

    choices: ClassVar = (Choice("radius or diameter"),)
    radius: Filled[Radius] = key("Radius of the bead.", None, "0.3 mm")
    diameter: Indirect[Diameter] = key("Diameter of the bead, instead of `radius`.", None, "0.6 mm")
    at: Position = key(
        "Centre of the bead at the start: x, y, z from the middle of the floor.", example=["5 mm", "-3 mm", "0.3 mm"]
    )
