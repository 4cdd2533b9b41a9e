"""The film on the walls: how strongly and from how near it drags each bead, as formulas of the engine.

The engine adds forces that are formulas of a bead's place and velocity (`fix addforce` with atom-style variables). A
bead is in the film of a wall where its distance from it is less than its reach, and is dragged there against its
velocity along the wall; what it does toward the wall and away from it is the lubrication's.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from walkers.inputs.boundary import Face
from walkers.physics.film import film_drag, film_thickness
from walkers.physics.matter import Liquid
from walkers.templates.scene import Bead

_LEAST = 1e-15
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Film:
    """The film in a deck.

    Attributes
    ----------
    drags
        Of each bead, by its id: force over velocity, N s/m.
    reaches
        Of each bead: distance of its centre from a wall up to which it is in that wall's film, m.
    speeds
        For each axis along which there is a drag, the engine's formula for the velocity that is dragged, m/s: along the
        wall, once for each wall in whose film the bead is.
    """

    drags: Mapping[int, float]
    reaches: Mapping[int, float]
    speeds: Mapping[str, str]


@dataclass(frozen=True)
class FilmWall:
    """A wall in the engine's formulas: the distance of a place ``x``, ``y``, ``z`` from it, and its normal.

    Two upright walls that face each other across the origin are one of these if no bead is in the films of both.
    """

    distance: str
    normal: tuple[float, float, float] | None
    """None of a round one about the vertical axis."""


def film_of(
    beads: Sequence[Bead], viscosities: Sequence[float], liquid: Liquid, faces: Sequence[Face], moving: str = ""
) -> Film | None:
    """The film that beads feel, or None where no bead does.

    Parameters
    ----------
    beads, faces
        What stands in the deck.
    viscosities
        Of the film, by the number of a bead's loading, Pa s.
    liquid
        Whose bridges' reach is that of the film.
    moving
        Axes along which the walls move, such as ``z``: the engine's variables ``wall_z`` and ``wall_vz`` say how far
        (m) and how fast (m/s).
    """
    drags = {bead.id: film_drag(viscosities[bead.loading], bead.radius) for bead in beads}
    if not any(drags.values()):
        return None
    reaches = {
        bead.id: bead.radius + film_thickness(bead.radius, liquid.volume_fraction, liquid.contact_angle)
        for bead in beads
    }
    walls = film_walls(faces, moving, max(reaches.values()))
    speeds = {axis: _dragged(walls, number, moving) for number, axis in enumerate(AXES)}
    return Film(drags, reaches, {axis: formula for axis, formula in speeds.items() if formula})


def film_walls(faces: Sequence[Face], moving: str = "", reach: float = 0.0) -> list[FilmWall]:
    """The walls that faces make up.

    Parameters
    ----------
    faces, moving
        As for `film_of`.
    reach
        The farthest that a bead's film reaches, m: walls whose middle is nearer stay apart.
    """
    place = _places(moving)
    walls = [list(group) for _, group in groupby(faces, key=lambda face: face.wall)]
    flat = [wall[0] for wall in walls if wall[0].of is None]
    found = []
    for wall in walls:
        if wall[0].of is not None:
            radius = wall[0].of.radius
            square = f"{place['x']}*{place['x']}+{place['y']}*{place['y']}"
            found.append(FilmWall(f"{radius!r}-sqrt({square})", None))
            continue
        half = _half_of_pair(wall[0], flat)
        if half is None or half < reach:
            found.append(FilmWall(_from_plane(wall[0], place), wall[0].normal))
        elif wall[0].side > 0:
            found.append(FilmWall(f"{half!r}-abs({place[wall[0].axis]})", wall[0].normal))
    return found


def _places(moving: str) -> dict[str, str]:
    return {axis: f"({axis}-v_wall_{axis})" if axis in moving else axis for axis in AXES}


def _half_of_pair(face: Face, others: Sequence[Face]) -> float | None:
    """Half the distance of an upright face from one that faces it across the origin, m; None where there is none."""
    if face.lean or face.turn:
        return None
    at = face.centroid[AXES.index(face.axis)]
    mirrored = [
        other
        for other in others
        if (other.axis, other.side, other.lean, other.turn) == (face.axis, -face.side, 0.0, 0.0)
        and abs(other.centroid[AXES.index(face.axis)] + at) < _LEAST
    ]
    return abs(at) if mirrored and at * face.side < 0.0 else None


def _from_plane(face: Face, place: Mapping[str, str]) -> str:
    """The distance n · (x - p) from a face, without what is zero."""
    offset = sum(one * at for one, at in zip(face.normal, face.centroid, strict=True))
    formula = _sum((component, place[axis]) for component, axis in zip(face.normal, AXES, strict=True))
    return formula if abs(offset) < _LEAST else f"{formula}+({-offset!r})"


def _sum(parts: Iterable[tuple[float, str]]) -> str:
    """Some numbers times some formulas, without what is zero and without factors of one."""
    terms = [
        formula if factor == 1.0 else f"({factor!r})*{formula}" for factor, formula in parts if abs(factor) > _LEAST
    ]
    return "+".join(terms)


def _dragged(walls: Sequence[FilmWall], number: int, moving: str) -> str:
    """The velocity along an axis that films drag, m/s: v - (v · n) n for each wall in whose film a bead is."""
    place = _places(moving)
    speed = {axis: f"(v{axis}-v_wall_v{axis})" if axis in moving else f"v{axis}" for axis in AXES}
    within: dict[str, list[str]] = {}
    for wall in walls:
        if wall.normal is not None:
            own = wall.normal[number]
            factors = [float(other == number) - own * one for other, one in enumerate(wall.normal)]
            along = _sum(zip(factors, speed.values(), strict=True))
        else:
            x, y = place["x"], place["y"]
            # A bead on the axis is in no film of the wall, but the engine takes no division by zero for that.
            outward = f"({x}*{speed['x']}+{y}*{speed['y']})/({x}*{x}+{y}*{y}+1e-30)"
            along = f"{speed[AXES[number]]}-{place[AXES[number]]}*{outward}" if number < 2 else speed["z"]
        if along:
            within.setdefault(along, []).append(f"({wall.distance}<v_film_reach)")
    return "+".join(f"({along})*({'+'.join(near)})" for along, near in within.items())
