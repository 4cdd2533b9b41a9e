"""Forces of the walls that the engine lacks, as formulas of it: the film's drag and half of an open bridge's drag.

The engine adds forces that are formulas of a bead's place and velocity (`fix addforce` with atom-style variables). They
act on a bead where it is nearer to a wall than a bridge reaches: the film against its velocity along the wall, the
missing half of the normal lubrication (`walkers.physics.lubrication`) against that toward the wall.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import pi

from walkers.inputs.boundary import Face
from walkers.physics.capillary import rupture_distance_at_wall
from walkers.physics.film import film_drag
from walkers.physics.matter import Liquid
from walkers.templates.scene import Bead

_LEAST = 1e-15
AXES = ("x", "y", "z")
Factor = float | str
"""A number, or a formula of the engine."""


@dataclass(frozen=True)
class WallForces:
    """The forces of the walls in a deck that are formulas.

    Attributes
    ----------
    shares
        By the name of the engine's variable a number for each bead, by its id: ``reach``, the distance of its centre
        from a wall up to which a bridge reaches (m), ``film_drag``, the film's force over velocity (N s/m), and for
        open bridges ``radius`` (m) and ``open_drag``, 6πηR² (N s).
    formulas
        For each axis along which there is a force, the formula that gives it, N.
    """

    shares: Mapping[str, Mapping[int, float]]
    formulas: Mapping[str, str]


@dataclass(frozen=True)
class FormulaWall:
    """A wall in the engine's formulas: the distance of a place ``x``, ``y``, ``z`` from it, and its normal.

    Two upright walls that face each other across the origin are one of these if no bead is within reach of both.
    """

    distance: str
    normal: tuple[Factor, Factor, Factor]


def wall_forces(
    beads: Sequence[Bead],
    viscosities: Sequence[float],
    liquid: Liquid,
    faces: Sequence[Face],
    *,
    minimum_separation_ratio: float | None,
    moving: str = "",
) -> WallForces:
    """The forces that beads feel besides the engine's own; without shares and formulas where no bead feels one.

    Parameters
    ----------
    beads, faces
        What stands in the deck.
    viscosities
        Of the film, by the number of a bead's loading, Pa s.
    liquid
        Whose bridges' reach is that of the forces.
    minimum_separation_ratio
        Gap over radius below which lubrication stops growing; None leaves open bridges as the engine has them.
    moving
        Axes along which the walls move, such as ``z``: the engine's variables ``wall_z`` and ``wall_vz`` say how far
        (m) and how fast (m/s).
    """
    reaches = {
        bead.id: bead.radius + rupture_distance_at_wall(bead.radius, liquid.volume_fraction, liquid.contact_angle)
        for bead in beads
    }
    walls = formula_walls(faces, moving, max(reaches.values()))
    shares: dict[str, dict[int, float]] = {"reach": reaches}
    terms: dict[str, list[str]] = {axis: [] for axis in AXES}
    drags = {bead.id: film_drag(viscosities[bead.loading], bead.radius) for bead in beads}
    if any(drags.values()):
        shares["film_drag"] = drags
        for number, axis in enumerate(AXES):
            dragged = _dragged(walls, number, moving)
            terms[axis] += [f"-v_film_drag*({dragged})"] if dragged else []
    nearest = minimum_separation_ratio
    # Below half of the minimum separation nothing is missing.
    if nearest is not None and liquid.dynamic_viscosity > 0.0 and any(
        reaches[bead.id] > (1.0 + nearest / 2.0) * bead.radius for bead in beads
    ):  # fmt: skip
        shares["radius"] = {bead.id: bead.radius for bead in beads}
        shares["open_drag"] = {bead.id: 6.0 * pi * liquid.dynamic_viscosity * bead.radius**2 for bead in beads}
        for number, axis in enumerate(AXES):
            terms[axis] += [f"-({one})" for one in _lubricated(walls, number, nearest, moving)]
    formulas = {axis: "".join(found) for axis, found in terms.items() if found}
    return WallForces(shares if formulas else {}, formulas)


def formula_walls(faces: Sequence[Face], moving: str = "", reach: float = 0.0) -> list[FormulaWall]:
    """The walls that faces make up.

    Parameters
    ----------
    faces, moving
        As for `wall_forces`.
    reach
        The farthest that a bead's bridge reaches, m: walls whose middle is nearer stay apart.
    """
    place = _places(moving)
    walls = [list(group) for _, group in groupby(faces, key=lambda face: face.wall)]
    flat = [wall[0] for wall in walls if wall[0].of is None]
    found = []
    for wall in walls:
        if wall[0].of is not None:
            found.append(_prism(wall, place))
            continue
        half = _half_of_pair(wall[0], flat)
        if half is None or half < reach:
            found.append(FormulaWall(_from_plane(wall[0], place), wall[0].normal))
        elif wall[0].side > 0:
            found.append(FormulaWall(f"{half!r}-abs({place[wall[0].axis]})", wall[0].normal))
    return found


def _prism(sides: Sequence[Face], place: Mapping[str, str]) -> FormulaWall:
    """A round wall, which is a prism about the vertical axis: the side that faces a place, whatever its height."""
    assert sides[0].of is not None
    apart = 2.0 * pi / len(sides)
    first = sides[0].turn % apart
    turn = f"({first!r}+{apart!r}*round((atan2({place['y']},{place['x']})-{first!r})/{apart!r}))"
    outward = _sum(((f"cos({turn})", place["x"]), (f"sin({turn})", place["y"])))
    return FormulaWall(f"{sides[0].of.radius!r}-({outward})", (f"cos({turn})", f"sin({turn})", 0.0))


def _places(moving: str) -> dict[str, str]:
    return {axis: f"({axis}-v_wall_{axis})" if axis in moving else axis for axis in AXES}


def _speeds(moving: str) -> dict[str, str]:
    return {axis: f"(v{axis}-v_wall_v{axis})" if axis in moving else f"v{axis}" for axis in AXES}


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


def _sum(parts: Iterable[tuple[Factor, str]]) -> str:
    """Some factors times some formulas, without what is zero and without factors of one."""
    terms = []
    for factor, formula in parts:
        if isinstance(factor, str):
            terms.append(f"{factor}*{formula}")
        elif abs(factor) > _LEAST:
            terms.append(formula if factor == 1.0 else f"({factor!r})*{formula}")
    return "+".join(terms)


def _times(*factors: Factor) -> str:
    """The product of some factors that are not zero."""
    return "*".join(f"({factor!r})" if isinstance(factor, float) else factor for factor in factors)


def _toward(wall: FormulaWall, moving: str) -> str:
    """The velocity v · n along a wall's normal, m/s."""
    return _sum(zip(wall.normal, _speeds(moving).values(), strict=True))


def _dragged(walls: Sequence[FormulaWall], number: int, moving: str) -> str:
    """The velocity along an axis that films drag, m/s: v - (v · n) n for each wall in whose film a bead is."""
    speeds = _speeds(moving)
    within: dict[str, list[str]] = {}
    for wall in walls:
        own = wall.normal[number]
        if isinstance(own, str):
            along = f"{speeds[AXES[number]]}-{own}*({_toward(wall, moving)})"
        elif any(isinstance(one, str) for one in wall.normal):
            along = speeds[AXES[number]]  # a round wall stands upright
        else:
            factors = [float(other == number) - own * float(one) for other, one in enumerate(wall.normal)]
            along = _sum(zip(factors, speeds.values(), strict=True))
        if along:
            within.setdefault(along, []).append(f"({wall.distance}<v_reach)")
    return "+".join(f"({along})*({'+'.join(near)})" for along, near in within.items())


def _lubricated(walls: Sequence[FormulaWall], number: int, nearest: float, moving: str) -> list[str]:
    """What open bridges lack along an axis, N, with h the gap and ε the ratio ``nearest``, for each wall.

    6πηR² (1/max(εR, h) - 1/max(εR, 2h)) times the velocity along the normal. The engine's formulas have no maximum: it
    is half of the sum and the absolute difference. That is never zero, even where a bead touches.
    """
    found = []
    for wall in walls:
        own = wall.normal[number]
        if not isinstance(own, str) and abs(own) < _LEAST:
            continue

        def inverse(share: float, wall: FormulaWall = wall) -> str:
            """1/(2 max(share · R, h))."""
            low, high = f"{1.0 - share!r}*v_radius", f"{1.0 + share!r}*v_radius"
            return f"1/({wall.distance}-{low}+abs({wall.distance}-{high}))"

        missing = f"(2*{inverse(nearest)}-{inverse(nearest / 2.0)})*({wall.distance}<v_reach)"
        # Along an axis v · n n is v alone, which serves for walls that face each other.
        straight = isinstance(own, float) and abs(abs(own) - 1.0) < _LEAST
        speed = _speeds(moving)[AXES[number]] if straight else _times(own, f"({_toward(wall, moving)})")
        found.append(f"v_open_drag*{speed}*{missing}")
    return found
