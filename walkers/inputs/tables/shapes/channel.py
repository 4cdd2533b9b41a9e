"""A floor between two upright walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from walkers.arrays import Vector
from walkers.inputs.tables.shapes.shape import Shape, damping_between, upright_walls
from walkers.inputs.tables.shapes.walls import BOTTOM, Wall

ACROSS = {"-y": (0.0, 1.0), "+y": (0.0, -1.0)}
"""x and y of the normals of the walls that stand across the y axis, by their names."""


@dataclass(frozen=True)
class ChannelShape(Shape):
    """A floor between two upright walls along x.

    Attributes
    ----------
    width : float
        Distance of the walls, m.
    """

    name: ClassVar[str] = "channel"
    sizes: ClassVar[tuple[str, ...]] = ("width",)
    in_a_row: ClassVar[bool] = True

    width: float

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and the two walls."""
        return (BOTTOM, *upright_walls(self.width / 2.0, ACROSS))

    def damping(self, radius: float) -> float:
        """See `Shape.damping`; a bead as wide as the channel touches both walls."""
        return damping_between(self.width, radius)

    def simulation_box(
        self,
        half_x: float,
        half_y: float,
        height: float,
        margin: float,
        largest: float,
    ) -> tuple[Vector, Vector]:
        """The simulation box (see `Shape.simulation_box`).

        It is as wide as the channel with a margin, and at least as high as the channel is wide.
        """
        low, high = super().simulation_box(half_x, half_y, height, margin, largest)
        y = self.width / 2.0 + margin
        top = max(high[2], self.width)
        return (low[0], -y, low[2]), (high[0], y, top)
