"""Two walls that meet in the x axis."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import ClassVar

from walkers.inputs.tables.shapes.shape import Shape
from walkers.inputs.tables.shapes.walls import BOTTOM, Flat, Wall


@dataclass(frozen=True)
class GrooveShape(Shape):
    """Two walls that meet in the x axis.

    Attributes
    ----------
    opening : float
        Angle between the walls, rad.
    """

    name: ClassVar[str] = "groove"
    sizes: ClassVar[tuple[str, ...]] = ("opening",)
    in_a_row: ClassVar[bool] = True

    opening: float

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The two walls, neither of which is a floor."""
        y = cos(self.opening / 2.0)
        z = sin(self.opening / 2.0)
        at_negative_y = Flat(point=BOTTOM.point, normal=(0.0, y, z), name="-y")
        at_positive_y = Flat(point=BOTTOM.point, normal=(0.0, -y, z), name="+y")
        return (at_negative_y, at_positive_y)

    def damping(self, radius: float) -> float:  # noqa: ARG002
        """See `Shape.damping`; each bead touches both walls."""
        return 1.0 + abs(cos(self.opening))

    def rest_height(self, radius: float) -> float:
        """Height above the x axis at which a bead of a radius (m) rests on both walls, m."""
        return radius / sin(self.opening / 2.0)
