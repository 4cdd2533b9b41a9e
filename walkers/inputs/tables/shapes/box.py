"""A container of square cross-section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from walkers.inputs.tables.shapes.channel import ACROSS
from walkers.inputs.tables.shapes.container import Container
from walkers.inputs.tables.shapes.shape import upright_walls
from walkers.inputs.tables.shapes.walls import BOTTOM, Wall

FOUR_SIDES = {"-x": (1.0, 0.0), "+x": (-1.0, 0.0), **ACROSS}
"""x and y of the normals of the sides, by their names."""


@dataclass(frozen=True)
class BoxShape(Container):
    """A container of square cross-section, whose sides are ``width`` (m) long."""

    name: ClassVar[str] = "box"
    area: ClassVar[float] = 1.0
    tight: ClassVar[bool] = False

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and the four sides."""
        return (BOTTOM, *upright_walls(self.width / 2.0, FOUR_SIDES))
