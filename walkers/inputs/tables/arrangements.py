"""Where the beads of a walker stand beside each other: arrangements by name, and what follows from them.

How the beads of a cluster stand is one of `ARRANGEMENTS`: in the cluster's frame, seen from above, whose first axis
points where it is to face and the second to the left. The beads are taken in the order of the case, and the point over
which the first two touch is the origin. Where walkers start is the subject of `walkers.inputs.resolving.standing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import acos, asin, cos, dist, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

Apart = Callable[[int, int], float]
"""Distance of two touching beads seen from above, m, by their numbers."""
Places = list[tuple[float, float]]
Pairs = tuple[tuple[int, int], ...]
_LEAST_LEVER = 0.1
"""Smallest distance of the centroids of large and small beads that gives a heading, over the extent of a cluster."""
_TOUCHING = 0.02  # radii by which beads that are given places may be apart and still touch
_TOO_SMALL = "a bead is too small to touch two beads that touch each other; expected a larger one"


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
        raise ValueError(
            "these beads do not form a closed ring; expected more beads, or more similar radii"
        )
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


class WalkerGeometry:
    """What follows from the radii of a walker's beads and from their arrangement, or the place of each."""

    if TYPE_CHECKING:
        radii: tuple[float, ...]

        @property
        def arrangement(self) -> str: ...  # noqa: D102
        @property
        def at(self) -> tuple[tuple[float, float], ...]: ...  # noqa: D102

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
        return list(self.at) or ARRANGEMENTS[self.arrangement].places(self.radii, self.rigid_distance)

    def rigid_distance(self, bead: int, neighbour: int) -> float:
        """Distance seen from above of two beads that touch each other and the floor without overlap, m."""
        first, second = self.radii[bead], self.radii[neighbour]
        return (first + second) * cos(asin((first - second) / (first + second)))

    @cached_property
    def length(self) -> float:
        """Length of the walker seen from above, m."""
        distances = {} if self.at else {pair: self.rigid_distance(*pair) for pair in self.pairs}
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
        if (
            largest < 1e-9 * self.length
        ):  # all side by side: it faces the way that is to the right of their row
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
        overlap_of = {
            pair: overlaps[len(self.radii) + number] for number, pair in enumerate(self.pairs)
        }

        def apart(first: int, second: int) -> float:
            between = (
                self.radii[first]
                + self.radii[second]
                - overlap_of[min(first, second), max(first, second)]
            )
            if between < abs(heights[first] - heights[second]):
                message = "the radii differ too much: the beads do not touch when they rest on the boundary"
                raise ValueError(f"{message}; expected more similar radii")
            return sqrt(between**2 - (heights[first] - heights[second]) ** 2)

        return ARRANGEMENTS[self.arrangement].places(self.radii, apart)


@dataclass(frozen=True)
class BareWalker(WalkerGeometry):
    """A walker by its geometry alone."""

    radii: tuple[float, ...]
    arrangement: str
    at: tuple[tuple[float, float], ...]
