"""How the beads of a cluster stand beside each other, seen from above. To add an arrangement, add it to `ARRANGEMENTS`.

Places are in the cluster's own frame: the first axis points where it is to face, the second to the left. The beads are
taken in the order of the case, and the point over which the first two touch is the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import acos, asin, cos, hypot, pi, sin, sqrt

Apart = Callable[[int, int], float]
"""Distance of two touching beads seen from above, m, by their numbers."""
Places = list[tuple[float, float]]
Pairs = tuple[tuple[int, int], ...]
_TOO_SMALL = "a bead is too small to touch two that touch each other"


@dataclass(frozen=True)
class Arrangement:
    """Which beads touch, of so many (``fewest`` to ``most``), and where they stand, given their radii and `Apart`."""

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
        raise ValueError("so many beads do not fit around the first one")
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
        raise ValueError("these beads close no ring")
    for _ in range(200):
        middle = (low + high) / 2.0
        low, high = (middle, high) if sum(turns(middle)) > 2.0 * pi else (low, middle)
    place, places = 0.0, []
    for turn in turns(high):
        places.append((high * cos(place), high * sin(place)))
        place += turn
    return places


ARRANGEMENTS: Mapping[str, Arrangement] = {
    "chain": Arrangement(_row, _chain, 2, "one behind the other, the first in front"),
    "fan": Arrangement(_spokes, _fan, 2, "the first in front, the others side by side behind it"),
    "diamond": Arrangement(_crossed, _diamond, 4, "one in front, two side by side behind it, one at the back", most=4),
    "ring": Arrangement(_closed, _ring, 3, "in a ring, the first in front"),
}
"""By the names that case files use."""


def touching(places: Sequence[tuple[float, float]], radii: Sequence[float], slack: float) -> Pairs:
    """The beads, at given places, on a plane, that touch or are nearer than a share of their radii."""
    return tuple(
        (one, other)
        for one in range(len(radii))
        for other in range(one + 1, len(radii))
        if gap_between(places, radii, one, other) < slack * min(radii[one], radii[other])
    )


def gap_between(places: Sequence[tuple[float, float]], radii: Sequence[float], one: int, other: int) -> float:
    """Gap of two beads that stand on a plane at given places, m."""
    (x, y), (to_x, to_y) = places[one], places[other]
    return hypot(x - to_x, y - to_y, radii[one] - radii[other]) - radii[one] - radii[other]
