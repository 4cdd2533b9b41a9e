"""Beads of a case: walkers on the boundary, a poured mixture, beads placed one by one.

Each knows how to place itself (``stand``) and which of its beads bridges join; nothing else asks what it is. How the
beads of a cluster stand beside each other is one of `ARRANGEMENTS`: in the cluster's own frame, seen from above, whose
first axis points where it is to face and the second to the left. The beads are taken in the order of the case, and the
point over which the first two touch is the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations
from math import acos, asin, atan2, cos, dist, hypot, inf, pi, sin, sqrt
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from walkers.inputs.boundary import LOOSE, Boundary
from walkers.inputs.loads import contact_loads
from walkers.physics import units

if TYPE_CHECKING:
    from walkers.inputs.case import Case

Apart = Callable[[int, int], float]
"""Distance of two touching beads seen from above, m, by their numbers."""
Places = list[tuple[float, float]]
Pairs = tuple[tuple[int, int], ...]
_Place = tuple[units.SignedLength, units.SignedLength]
_LEAST_LEVER = 0.1
"""Of a cluster's extent: large and small beads whose centroids are nearer than that give no heading."""
_TOUCHING = 0.02
"""Radii by which beads that are given places may be apart and still touch."""
_TOO_SMALL = "a bead is too small to touch two beads that touch each other; expected a larger one"


@dataclass(frozen=True)
class Arrangement:
    """Arrangement of ``fewest`` to ``most`` beads: touching pairs, and positions from radii and `Apart`."""

    pairs: Callable[[int], Pairs]
    places: Callable[[Sequence[float], Apart], Places]
    fewest: int
    meaning: str
    most: int = 100


def _row(number: int) -> Pairs:
    return tuple((bead, bead + 1) for bead in range(number - 1))


def _chain(radii: Sequence[float], apart: Apart) -> Places:
    along = [apart(0, 1) * radii[0] / (radii[0] + radii[1])]
    for bead in range(len(radii) - 1):
        along.append(along[-1] - apart(bead, bead + 1))
    return [(place, 0.0) for place in along]


def _spokes(number: int) -> Pairs:
    return (*((0, bead) for bead in range(1, number)), *((bead, bead + 1) for bead in range(1, number - 1)))


def _fan(radii: Sequence[float], apart: Apart) -> Places:
    """The first bead in front, the others behind it: all touch it, and each the next."""
    turns = [0.0]
    for bead in range(1, len(radii) - 1):
        one, other, between = apart(0, bead), apart(0, bead + 1), apart(bead, bead + 1)
        cosine = (one**2 + other**2 - between**2) / (2.0 * one * other)
        if abs(cosine) > 1.0:
            raise ValueError(_TOO_SMALL)
        turns.append(turns[-1] + acos(cosine))
    if turns[-1] + turns[-1] / max(len(turns) - 1, 1) > 2.0 * pi * (1.0 + 1e-9):
        raise ValueError("too many beads to fit around the first one; expected fewer")
    front = apart(0, 1) * radii[0] / (radii[0] + radii[1])
    behind = [(apart(0, bead), pi - turns[-1] / 2.0 + turn) for bead, turn in enumerate(turns, 1)]
    return [(front, 0.0), *((front + away * cos(turn), away * sin(turn)) for away, turn in behind)]


def _crossed(number: int) -> Pairs:
    del number
    return ((0, 1), (0, 2), (1, 2), (1, 3), (2, 3))


def _diamond(radii: Sequence[float], apart: Apart) -> Places:
    """One in front, two side by side behind it, one at the back that touches these two."""
    front, left, right = _fan(radii[:3], apart)
    along, across = right[0] - left[0], right[1] - left[1]
    width, reach, other = apart(1, 2), apart(1, 3), apart(2, 3)
    share = (reach**2 - other**2 + width**2) / (2.0 * width**2)
    if reach < abs(share) * width:
        raise ValueError(_TOO_SMALL)
    height = sqrt(reach**2 - (share * width) ** 2) / width
    back = (left[0] + share * along + height * across, left[1] + share * across - height * along)
    return [front, left, right, back]


def _closed(number: int) -> Pairs:
    return (*_row(number), (0, number - 1)) if number > 2 else _row(number)


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
    found = []
    for (one, (x, y)), (other, (to_x, to_y)) in combinations(enumerate(places), 2):
        gap = hypot(x - to_x, y - to_y, radii[one] - radii[other]) - radii[one] - radii[other]
        if gap < slack * min(radii[one], radii[other]):
            found.append((one, other))
    return tuple(found)


def _sites(number: int) -> Places:
    """So many sites of a hexagonal lattice: the origin, the one behind it, and on around it; their distance is 1."""
    reach = range(-10, 11)  # of 100 sites the outermost is six away
    sites = [(one + other / 2.0, other * sqrt(0.75)) for one in reach for other in reach]
    return sorted(sites, key=lambda at: (round(hypot(*at), 6), round(atan2(-at[1], -at[0]) % (2.0 * pi), 6)))[:number]


def _neighbours(number: int) -> Pairs:
    return touching(_sites(number), [0.5] * number, _TOUCHING)


def _raft(radii: Sequence[float], apart: Apart) -> Places:
    if len(set(radii)) > 1:
        raise ValueError("expected the same radius for all beads of a raft")
    size = apart(0, 1)
    return [(size * (0.5 + along), size * aside) for along, aside in _sites(len(radii))]


ARRANGEMENTS: Mapping[str, Arrangement] = {
    "chain": Arrangement(_row, _chain, 2, "one behind the other, the first in front"),
    "fan": Arrangement(_spokes, _fan, 2, "the first in front, the others side by side behind it"),
    "diamond": Arrangement(_crossed, _diamond, 4, "one in front, two side by side behind it, one at the back", most=4),
    "ring": Arrangement(_closed, _ring, 3, "in a ring, the first in front"),
    "raft": Arrangement(_neighbours, _raft, 3, "of one radius, on a hexagonal lattice, the first in the middle"),
}
"""Arrangements by their names in case files."""


@dataclass(frozen=True)
class StandingBead:
    """Centre (m) and radius (m) of a bead at the start."""

    x: float
    y: float
    z: float
    radius: float


@dataclass(frozen=True)
class Standing:
    """Beads that start together; positions relative to the walker's place (chosen by the deck) or to the boundary.

    ``facing`` is +1 along the drive axis or −1, and ``angle`` that to it (rad); 0 and 0 of what is no walker.
    """

    beads: tuple[StandingBead, ...]
    facing: int = 0
    angle: float = 0.0
    walks: bool = False


@dataclass(frozen=True, kw_only=True)
class Walkers:
    """``[dimers]`` or one of ``[[clusters]]``: walkers of one make, their number and initial state.

    ``meet = true`` says that they may stand and come as near as they like; without it they are replicates. They face
    along the drive axis (right, up a slope), against it (left, down), or every other one (both), but for an ``angle``.
    The ``gap`` is that of all contacts at the start (negative: touching), where forces balance unless it is given.

    Radii are those of the beads, first the one that leads (the large one, as in the paper). Those of dimers may be
    given by their mean and the asymmetry parameter sin δ = (R1 - R2)/(R1 + R2). The beads of clusters stand in an
    ``arrangement``, or ``at`` a place for each, ahead and to the left, in the direction that the walker faces.
    """

    replicates: Annotated[units.Whole, Field(ge=1, le=1000)] = 6
    facing: Literal["both", "right", "left", "up", "down"] = "both"
    angle: units.Angle = 0.0
    angle_spread: units.NonNegativeAngle = pi / 180.0
    gap: Annotated[units.SignedLength | None, units.AUTO] = None
    gap_spread: Annotated[units.Number, Field(ge=0, lt=1)] = 0.2
    spacing: Annotated[units.Length, units.AUTO_FAR] = inf
    meet: units.Flag = False
    radii: tuple[units.Radius, ...] = ()
    mean_radius: Annotated[units.Radius | None, Field(exclude=True)] = None
    sin_delta: Annotated[units.Number | None, Field(gt=-0.9, lt=0.9, exclude=True)] = None
    arrangement: str = ""
    places: Annotated[tuple[_Place, ...], Field(max_length=100, alias="at")] = ()

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return [*self.radii] * self.replicates

    @cached_property
    def pairs(self) -> Pairs:
        """The beads of a walker that touch at the start, numbered from 0."""
        if self.places:
            return touching(self.places, self.radii, _TOUCHING)
        return ARRANGEMENTS[self.arrangement].pairs(len(self.radii))

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """Radius of each bead of a walker and radii of the beads that touch it, m."""
        neighbours: list[list[float]] = [[] for _ in self.radii]
        for one, other in self.pairs:
            neighbours[one].append(self.radii[other])
            neighbours[other].append(self.radii[one])
        return list(zip(self.radii, neighbours, strict=True))

    @cached_property
    def design(self) -> Places:
        """Positions of rigid beads on a plane in the frame of the walker, m."""
        return list(self.places) or ARRANGEMENTS[self.arrangement].places(self.radii, self._rigid)

    def _rigid(self, one: int, other: int) -> float:
        """Distance seen from above of two beads that touch each other and the floor without overlap, m."""
        first, second = self.radii[one], self.radii[other]
        return (first + second) * cos(asin((first - second) / (first + second)))

    @cached_property
    def length(self) -> float:
        """Length of the walker seen from above, m."""
        known = {} if self.places else {pair: self._rigid(*pair) for pair in self.pairs}
        extents = []
        for one, other in combinations(range(len(self.radii)), 2):
            apart = known.get((one, other), dist(self.design[one], self.design[other]))
            extents.append(apart + (self.radii[one] + self.radii[other]))
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
        """Weights of bead positions in the heading, from the centroid of the small beads to that of the large beads.

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

    def stand(self, case: Case, first: int) -> list[Standing]:
        """Place each walker around the contact of its first two beads; ``first``: index of the first walker.

        Its angle and contacts are drawn from a stream of its own, whoever shares the deck.
        """
        standing, (x, y, _) = [], case.drive_axis
        for number in range(first, first + self.replicates):
            row = number // case.shifted_rows if case.shifted_rows else 0
            facing = {"right": 1, "left": -1}.get(self.facing, 1 if (number + row) % 2 == 0 else -1)
            turn, press = _draws(case.seed, number)
            angle, factor = self.angle + self.angle_spread * turn, 1.0 + self.gap_spread * press
            resting = contact_loads(case, self).overlaps
            overlaps = [(overlap if self.gap is None else -self.gap) * factor for overlap in resting]
            heading = atan2(y, x) + angle + (0.0 if facing > 0 else pi)
            on_floor = zip(self.radii, overlaps[: len(self.radii)], strict=True)
            heights = [case.boundary.rest_height(radius - overlap) for radius, overlap in on_floor]
            ahead, left = cos(heading), sin(heading)
            beads = tuple(
                StandingBead(along * ahead - aside * left, along * left + aside * ahead, *rest)
                for (along, aside), *rest in zip(self._places(heights, overlaps), heights, self.radii, strict=True)
            )
            standing.append(Standing(beads, facing, angle, walks=True))
        return standing

    def _places(self, heights: Sequence[float], overlaps: Sequence[float]) -> Places:
        """Positions of the beads of a walker in its frame, from heights and overlaps, m."""
        if self.places:
            return list(self.places)
        known = {pair: overlaps[len(self.radii) + number] for number, pair in enumerate(self.pairs)}

        def apart(one: int, other: int) -> float:
            between = self.radii[one] + self.radii[other] - known[min(one, other), max(one, other)]
            if between < abs(heights[one] - heights[other]):
                message = "the radii differ too much: the beads do not touch when they rest on the boundary"
                raise ValueError(f"{message}; expected more similar radii")
            return sqrt(between**2 - (heights[one] - heights[other]) ** 2)

        return ARRANGEMENTS[self.arrangement].places(self.radii, apart)


@lru_cache(maxsize=4096)
def _draws(seed: int, number: int) -> tuple[float, float]:
    from numpy.random import default_rng

    turn, press = default_rng([seed, number]).uniform(-1.0, 1.0, size=2)
    return float(turn), float(press)


def _beside(one: float, other: float) -> list[tuple[float, list[float]]]:
    """`Walkers.bridged` of two beads, radii in m."""
    return [(one, [other]), (other, [one])]


@dataclass(frozen=True)
class Mixture:
    """Poured beads of two size classes: radii of each class, m, and numbers of beads.

    Each of its radii occurs equally often (the engine is given no distributions).
    """

    small: tuple[float, ...]
    large: tuple[float, ...]
    counts: tuple[int, int]

    @property
    def count(self) -> int:
        """Number of beads."""
        return sum(self.counts)

    @property
    def radii(self) -> tuple[float, ...]:
        """The different radii, m."""
        return self.small + self.large

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """A large bead beside a small one.

        Beads of a pile have more neighbours, and its viscous limit is lower; ``auto``'s share of the limit allows for
        it: a glycerol pile at 0.4 of it is agitated as at a quarter of that step, within 0.1 %, and at 0.8 it heats up.
        """
        return _beside(max(self.large), min(self.small))

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m: the small ones first."""
        classes = ((self.small, self.counts[0]), (self.large, self.counts[1]))
        return [sizes[number % len(sizes)] for sizes, count in classes for number in range(count)]

    def level(self, boundary: Boundary) -> float:
        """Height of the layers from which beads are poured, m; infinite if there is no room."""
        places = len(boundary.layer(max(self.radii)).places)
        return -(-self.count // places) * 2.0 * LOOSE * max(self.radii) if places else inf

    def stand(self, case: Case, first: int) -> list[Standing]:
        """Beads on a loose lattice with random order and displacements (seed of the case); they fall and settle."""
        del first
        from numpy.random import default_rng

        largest, draw = max(self.radii), default_rng(case.seed)
        layer = case.boundary.layer(largest)
        floor = case.tops_of_others(self)
        beads = []
        for number, radius in enumerate(float(one) for one in draw.permutation(self.all_radii)):
            level, place = divmod(number, len(layer.places))
            x, y = layer.places[place]
            shift = draw.uniform(-1.0, 1.0, 2) * 0.9 * layer.play(radius, largest)
            height = (level + 0.5) * 2.0 * LOOSE * largest
            beads.append(StandingBead(x + float(shift[0]), y + float(shift[1]), floor + height, radius))
        return [Standing(tuple(beads))]


@dataclass(frozen=True)
class Placed:
    """Beads placed one by one: x, y, z (m, from the middle of the floor) and radius (m) of each."""

    beads: tuple[tuple[float, float, float, float], ...]

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return [bead[3] for bead in self.beads]

    @property
    def radii(self) -> tuple[float, ...]:
        """The different radii, m."""
        return tuple(sorted({bead[3] for bead in self.beads}))

    @property
    def bridged(self) -> list[tuple[float, list[float]]]:
        """The largest bead beside the smallest."""
        return _beside(self.radii[-1], self.radii[0])

    def stand(self, case: Case, first: int) -> list[Standing]:
        """The beads at their given positions."""
        del case, first
        return [Standing(tuple(StandingBead(*bead) for bead in self.beads))]


Body = Walkers | Mixture | Placed
"""Kinds of bodies."""
