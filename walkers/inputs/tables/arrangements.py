"""Where the beads of a walker stand beside each other: arrangements, and what follows from them.

An arrangement of `ARRANGEMENTS` gives the places of the beads of a cluster in the frame of the
walker, seen from above. The first axis of this frame points where the walker is to face, the second
to its left. Beads are numbered in the order of the case. The origin is the point over which the
first two touch; that of a ring is its centre. In a fan of three or more beads and in a diamond, it
is where the first two would touch if the second stood straight behind the first. Where walkers
start is the subject of `walkers.inputs.resolving.standing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import acos, asin, cos, dist, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING

TouchingDistance = Callable[[int, int], float]
"""Distance seen from above of two beads that touch, m, by their numbers."""
Places = list[tuple[float, float]]
"""Places of the beads in the frame of a walker, m."""
Pairs = tuple[tuple[int, int], ...]
"""Numbers of two beads each, the smaller one first."""
_SHORTEST_LEVER = 0.1
"""Smallest distance of the centroids of large and small beads that gives a heading.

It is in lengths of the walker."""
_TOUCHING = 0.02
"""Largest gap of beads that touch if their places are given, in radii of the smaller one."""
_TOO_SMALL = "a bead is too small to touch two beads that touch each other; expected a larger one"


@dataclass(frozen=True)
class Arrangement:
    """An arrangement of the beads of a walker.

    Attributes
    ----------
    places : callable
        Gives the `Places` for the radii of the beads (m) and a `TouchingDistance`; raises
        `ValueError` if these beads cannot be arranged so.
    fewest : int
        Smallest number of beads.
    most : int
        Largest number of beads.
    """

    places: Callable[[Sequence[float], TouchingDistance], Places]
    fewest: int
    most: int = 100


def _chain(radii: Sequence[float], distance: TouchingDistance) -> Places:
    """One behind the other, the first in front."""
    # The origin is the point over which the first two beads touch.
    x = distance(0, 1) * radii[0] / (radii[0] + radii[1])
    places = [(x, 0.0)]
    for bead in range(len(radii) - 1):
        x -= distance(bead, bead + 1)
        places.append((x, 0.0))
    return places


def _fan(radii: Sequence[float], distance: TouchingDistance) -> Places:
    """The first bead in front, the others behind it: all touch the first, and each the next."""
    angles = [0.0]  # around the first bead: from the second bead to each of those behind, rad
    for bead in range(1, len(radii) - 1):
        side = distance(0, bead)
        next_side = distance(0, bead + 1)
        between = distance(bead, bead + 1)
        cosine = (side**2 + next_side**2 - between**2) / (2.0 * side * next_side)
        if abs(cosine) > 1.0:
            raise ValueError(_TOO_SMALL)
        angles.append(angles[-1] + acos(cosine))
    opening = angles[-1]
    mean_step = opening / max(len(angles) - 1, 1)
    if opening + mean_step > 2.0 * pi * (1.0 + 1e-9):  # a full circle, with rounding errors, fits
        raise ValueError("too many beads to fit around the first one; expected fewer")
    front = distance(0, 1) * radii[0] / (radii[0] + radii[1])
    places = [(front, 0.0)]
    for bead, angle in enumerate(angles, 1):
        side = distance(0, bead)
        direction = pi - opening / 2.0 + angle
        places.append((front + side * cos(direction), side * sin(direction)))
    return places


def _diamond(radii: Sequence[float], distance: TouchingDistance) -> Places:
    """One in front, two side by side behind it, and one at the back that touches these two."""
    front, left, right = _fan(radii[:3], distance)
    width = distance(1, 2)
    to_left = distance(1, 3)
    to_right = distance(2, 3)
    # The last bead stands behind the line from left to right. Along this line, the foot of its
    # perpendicular is at a share of the width; the height is the length of the perpendicular, also
    # as a share of the width.
    foot = (to_left**2 - to_right**2 + width**2) / (2.0 * width**2)
    if to_left < abs(foot) * width:
        raise ValueError(_TOO_SMALL)
    height = sqrt(to_left**2 - (foot * width) ** 2) / width
    line_x = right[0] - left[0]
    line_y = right[1] - left[1]
    back = (left[0] + foot * line_x + height * line_y, left[1] + foot * line_y - height * line_x)
    return [front, left, right, back]


def _ring(radii: Sequence[float], distance: TouchingDistance) -> Places:
    """Centres on a circle around the origin; each bead touches the next, the first is in front."""
    number = len(radii)
    chords = [distance(bead, (bead + 1) % number) for bead in range(number)]
    smallest_radius = max(chords) / 2.0
    # The chords close where their angles add up to 2π. The angles shrink as the radius grows, so
    # that a sum below 2π at the smallest radius remains below.
    if sum(_angles_of_chords(chords, smallest_radius)) < 2.0 * pi:
        raise ValueError(
            "these beads do not form a closed ring; expected more beads, or more similar radii"
        )
    radius = _circumradius(chords, smallest_radius)
    places = []
    angle = 0.0
    for step in _angles_of_chords(chords, radius):
        places.append((radius * cos(angle), radius * sin(angle)))
        angle += step
    return places


def _circumradius(chords: Sequence[float], smallest: float) -> float:
    """Radius of the circle (m) on which chords (m) close a polygon, at least a smallest one (m)."""
    low = smallest
    high = sum(chords)
    for _ in range(200):  # bisections
        middle = (low + high) / 2.0
        if sum(_angles_of_chords(chords, middle)) > 2.0 * pi:
            low = middle
        else:
            high = middle
    return high


def _angles_of_chords(chords: Sequence[float], radius: float) -> list[float]:
    """Angles that chords (m) of a circle of a radius (m) subtend at its centre, rad."""
    return [2.0 * asin(min(chord / (2.0 * radius), 1.0)) for chord in chords]


def touching(places: Sequence[tuple[float, float]], radii: Sequence[float], slack: float) -> Pairs:
    """Pairs of beads that touch when all of them rest on a plane.

    Parameters
    ----------
    places
        Places of the beads seen from above, m.
    radii
        Radii of the beads, m.
    slack
        Beads touch if their gap is below this share of the smaller radius.
    """
    pairs = []
    for first, second in combinations(range(len(places)), 2):
        x, y = places[first]
        to_x, to_y = places[second]
        distance = hypot(x - to_x, y - to_y, radii[first] - radii[second])
        gap = distance - radii[first] - radii[second]
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
    """What follows from the radii of a walker's beads and their arrangement, or their places."""

    if TYPE_CHECKING:
        radii: tuple[float, ...]

        @property
        def arrangement(self) -> str: ...  # noqa: D102
        @property
        def at(self) -> tuple[tuple[float, float], ...]: ...  # noqa: D102

    @cached_property
    def pairs(self) -> Pairs:
        """The beads of a walker that touch at the start, numbered from 0."""
        pairs = list(touching(self.design, self.radii, _TOUCHING))
        last = len(self.radii) - 1
        if self.arrangement == "ring":
            # The first and the last bead close the ring: their pair comes last.
            if (0, last) in pairs:
                pairs.remove((0, last))
            pairs.append((0, last))
        if self.arrangement == "fan" and last > 2 and (1, last) in pairs:
            # A fan is not closed, even if its beads stand all around the first one.
            pairs.remove((1, last))
        return tuple(pairs)

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
        if self.at:
            return list(self.at)
        return ARRANGEMENTS[self.arrangement].places(self.radii, self.rigid_distance)

    def rigid_distance(self, bead: int, neighbour: int) -> float:
        """Distance seen from above of two rigid beads that touch each other and a plane, m.

        The beads are given by their numbers.
        """
        first = self.radii[bead]
        second = self.radii[neighbour]
        return (first + second) * cos(asin((first - second) / (first + second)))

    @cached_property
    def length(self) -> float:
        """Length of the walker seen from above, m: the largest one over two of its beads."""
        touching_pairs: Pairs = ()
        if not self.at:
            touching_pairs = self.pairs
        extents = []
        for first, second in combinations(range(len(self.radii)), 2):
            if (first, second) in touching_pairs:
                distance = self.rigid_distance(first, second)
            else:
                distance = dist(self.design[first], self.design[second])
            extents.append(distance + (self.radii[first] + self.radii[second]))
        return max(extents)

    @cached_property
    def front(self) -> tuple[float, ...]:
        """Weights of bead positions in the vector along the start direction.

        Their sum is zero. All are zero if the beads stand side by side; such a walker faces the way
        that is to the right of their row.
        """
        x_of_beads = [x for x, _ in self.design]
        middle = sum(x_of_beads) / len(x_of_beads)
        largest = max(abs(x - middle) for x in x_of_beads)
        if largest < 1e-9 * self.length:  # no more than a rounding error
            return (0.0,) * len(x_of_beads)
        return tuple((x - middle) / largest for x in x_of_beads)

    @cached_property
    def toward_large(self) -> tuple[float, ...]:
        """Weights of bead positions in the heading.

        The heading is the vector from the centroid of the small beads to that of the large ones. If
        all beads have the same size, or if the centroids nearly coincide, the heading is the
        direction in which the walker was to face (`front`).
        """
        border = (min(self.radii) + max(self.radii)) / 2.0
        large = [radius > border for radius in self.radii]
        if not any(large):
            return self.front
        large_count = sum(large)
        small_count = len(large) - large_count
        weights = []
        for is_large in large:
            if is_large:
                weights.append(1.0 / large_count)
            else:
                weights.append(-1.0 / small_count)
        lever = []
        for coordinates in zip(*self.design, strict=True):
            weighted = zip(weights, coordinates, strict=True)
            lever.append(sum(weight * coordinate for weight, coordinate in weighted))
        if hypot(*lever) > _SHORTEST_LEVER * self.length:
            return tuple(weights)
        return self.front

    def places(self, heights: Sequence[float], overlaps: Sequence[float]) -> Places:
        """Positions of the beads of a walker at rest in its frame.

        Parameters
        ----------
        heights
            Height of the centre of each bead, m.
        overlaps
            Overlap of each bead with the boundary, then of each of the `pairs`, m.

        Returns
        -------
        Places
            x and y of each bead, m; the given ones of a walker whose beads have places.

        Raises
        ------
        ValueError
            If two beads of a pair do not touch at these heights, or cannot be arranged.
        """
        if self.at:
            return list(self.at)
        pair_overlaps = dict(zip(self.pairs, overlaps[len(self.radii) :], strict=True))

        def distance(first: int, second: int) -> float:
            """See `TouchingDistance`."""
            overlap = pair_overlaps[min(first, second), max(first, second)]
            between_centres = self.radii[first] + self.radii[second] - overlap
            step = heights[first] - heights[second]
            if between_centres < abs(step):
                raise ValueError(
                    "the radii differ too much: the beads do not touch when they rest on the "
                    "boundary; expected more similar radii"
                )
            return sqrt(between_centres**2 - step**2)

        return ARRANGEMENTS[self.arrangement].places(self.radii, distance)


@dataclass(frozen=True)
class BareWalker(WalkerGeometry):
    """A walker by its geometry alone: the radii of its beads, and an arrangement or their places.

    Attributes
    ----------
    radii : tuple of float
        Radii of the beads, m.
    arrangement : str
        One of `ARRANGEMENTS`; empty if ``at`` is given.
    at : tuple of tuple
        Places of the beads, m; empty for an arrangement.
    """

    radii: tuple[float, ...]
    arrangement: str
    at: tuple[tuple[float, float], ...]
