"""A level or tilted floor without side walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from walkers.arrays import Vector
from walkers.inputs.tables.shapes.shape import Shape
from walkers.inputs.tables.shapes.walls import BOTTOM, Wall


@dataclass(frozen=True)
class PlaneShape(Shape):
    """A floor without side walls; at a tilt of 90° it is a wall."""

    name: ClassVar[str] = "plane"
    is_open_floor: ClassVar[bool] = True

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor."""
        return (BOTTOM,)

    def simulation_box(
        self,
        half_x: float,
        half_y: float,
        height: float,
        margin: float,
        largest: float,
    ) -> tuple[Vector, Vector]:
        """The simulation box (see `Shape.simulation_box`), from one margin below the floor."""
        low, high = super().simulation_box(half_x, half_y, height, margin, largest)
        return (low[0], low[1], -margin), high
