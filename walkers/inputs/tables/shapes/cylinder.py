"""An upright cylindrical container."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar

from walkers.inputs.tables.shapes.container import Container
from walkers.inputs.tables.shapes.walls import BOTTOM, Round, Wall


@dataclass(frozen=True)
class CylinderShape(Container):
    """An upright cylinder of the inner diameter ``width`` (m)."""

    name: ClassVar[str] = "cylinder"
    area: ClassVar[float] = pi / 4.0

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and the round side."""
        return (BOTTOM, Round(radius=self.width / 2.0))
