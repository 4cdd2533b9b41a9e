"""The plane that walkers stand on: level, tilted, or a wall. In its own frame it is z = 0, the beads above it."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

from walkers.inputs.drive import Vector

_LEAST = 1e-13


@dataclass(frozen=True)
class Plane:
    """A plane of a material, tilted.

    Attributes
    ----------
    material
        Name.
    tilt
        Angle to the horizontal, rad: 0 level, π/2 a wall.
    uphill
        Direction of the steepest way up within the plane, rad from its x axis toward y.
    """

    material: str
    tilt: float = 0.0
    uphill: float = 0.0

    def gravity(self, gravity: float) -> Vector:
        """The acceleration of gravity in the plane's frame, m/s², of a magnitude (m/s²)."""
        down, press = gravity * _round(sin(self.tilt)), gravity * _round(cos(self.tilt))
        return (-down * _round(cos(self.uphill)), -down * _round(sin(self.uphill)), -press)


def _round(value: float) -> float:
    """Zero for what is zero but for rounding: a wall's weight does not press at all."""
    return 0.0 if abs(value) < _LEAST else value
