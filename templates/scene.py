"""What stands in the simulation box: beads, the faces of walls, and the carriers that move with them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin
from typing import Literal

Point = tuple[float, float, float]
Axis = Literal["x", "y", "z"]
AXES: tuple[Axis, Axis, Axis] = ("x", "y", "z")


@dataclass(frozen=True)
class Bead:
    """A bead at the start: id, centre (m), radius (m), velocity (m/s), angular velocity (rad/s), surface (from 1)."""

    id: int
    centre: Point
    radius: float
    velocity: Point = (0.0, 0.0, 0.0)
    spin: Point = (0.0, 0.0, 0.0)
    surface: int = 1


@dataclass(frozen=True)
class Face:
    """A flat wall: the axis that it is normal to, the side to which its normal points, its centroid (m).

    ``turn`` (rad) turns an upright one about the vertical.
    """

    axis: Axis
    side: Literal[1, -1]
    centroid: Point
    turn: float = 0.0

    @property
    def normal(self) -> Point:
        """Unit vector into the space where the beads are."""
        return turned(vector_along(self.axis, float(self.side)), self.turn)


@dataclass(frozen=True)
class Scene:
    """Beads, faces, the carriers' places (one a face, in the order of the faces) and the box's corners, all in m."""

    beads: tuple[Bead, ...]
    faces: tuple[Face, ...]
    carriers: tuple[Point, ...]
    lower: Point
    upper: Point


def turned(vector: Point, angle: float) -> Point:
    """A vector turned about the vertical, rad."""
    if angle == 0.0:
        return vector
    x, y, z = vector
    return (x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle), z)


def without_carriers(scene: Scene) -> Scene:
    """The scene with its carriers left out, the beads numbered from 1."""
    gone = len(scene.carriers)
    return replace(scene, carriers=(), beads=tuple(replace(bead, id=bead.id - gone) for bead in scene.beads))


def vector_along(axis: Axis, length: float = 1.0) -> Point:
    """A vector along an axis."""
    return (length * (axis == "x"), length * (axis == "y"), length * (axis == "z"))
