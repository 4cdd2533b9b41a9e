"""A container whose cross-section is a regular octagon."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

from walkers.inputs.tables.shapes.box import FOUR_SIDES
from walkers.inputs.tables.shapes.container import Container
from walkers.inputs.tables.shapes.shape import upright_walls
from walkers.inputs.tables.shapes.walls import BOTTOM, Wall

_CUT = sqrt(0.5)
"""Sine and cosine of 45°."""
_CORNERS = {
    "+x+y": (-_CUT, -_CUT),
    "+x-y": (-_CUT, _CUT),
    "-x+y": (_CUT, -_CUT),
    "-x-y": (_CUT, _CUT),
}
"""x and y of the normals of the sides that cut the corners of a box, by their names."""


@dataclass(frozen=True)
class OctagonShape(Container):
    """A container with eight sides; ``width`` (m) is the distance of opposite sides."""

    name: ClassVar[str] = "octagon"
    area: ClassVar[float] = 2.0 * (sqrt(2.0) - 1.0)

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and the eight sides."""
        normals = FOUR_SIDES | _CORNERS
        return (BOTTOM, *upright_walls(self.width / 2.0, normals))
