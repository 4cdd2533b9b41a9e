"""Containers with a level floor, upright side walls and an open top."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count as count_from
from itertools import product
from math import ceil
from typing import ClassVar

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.errors import key_error
from walkers.inputs.tables.shapes.shape import LOOSE_PITCH, Layer, Shape, damping_between

NEAREST = (1.0 - 1e-9) * LOOSE_PITCH
"""Smallest distance of a place from the walls, in radii of the largest bead.

The factor below one is for rounding errors of places next to a wall."""
_RIM = 2e-4
"""Distance from the walls to the sides of the simulation box, m."""
_DRAWN_WIDTH = 1.01
"""Width in which walls are drawn, in widths of the container.

It is above one because the edges of the prism that is drawn for a cylinder lie beyond its wall."""


@dataclass(frozen=True)
class Container(Shape):
    """A prism about the z axis that is open at the top.

    The walls and the simulation box end at twice its height.

    Attributes
    ----------
    width : float
        Distance of opposite sides, or diameter, m.
    height : float
        Height of the rim, m.
    """

    sizes: ClassVar[tuple[str, ...]] = ("width", "height")
    closed: ClassVar[bool] = True
    area: ClassVar[float]
    """Cross-section in squares of the width."""
    tight: ClassVar[bool] = True
    """See `Layer.tight`."""

    width: float
    height: float

    @property
    def cross_section(self) -> float:
        """Inner cross-section, m²."""
        return self.width**2 * self.area

    def volume(self, level: float) -> float:
        """Volume below a level (m), m³."""
        return self.cross_section * level

    def damping(self, radius: float) -> float:
        """See `Shape.damping`; a bead as wide as the container touches two opposite sides."""
        return damping_between(self.width, radius)

    def simulation_box(
        self,
        half_x: float,  # noqa: ARG002
        half_y: float,  # noqa: ARG002
        height: float,  # noqa: ARG002
        margin: float,  # noqa: ARG002
        largest: float,
    ) -> tuple[Vector, Vector]:
        """The simulation box (see `Shape.simulation_box`), twice as high as the container."""
        half = self.width / 2.0 + _RIM
        return (-half, -half, -4.0 * largest), (half, half, 2.0 * self.height)

    def outline(
        self,
        low: FloatArray,  # noqa: ARG002
        high: FloatArray,  # noqa: ARG002
        inside: FloatArray,  # noqa: ARG002
    ) -> list[FloatArray]:
        """Polygons of the walls in pictures (see `Shape.outline`), which end at the rim."""
        half = _DRAWN_WIDTH * self.width / 2.0
        lower_corner = np.full(3, -half)
        upper_corner = np.array([half, half, self.height])
        centre = np.array([0.0, 0.0, self.height / 2.0])
        return super().outline(lower_corner, upper_corner, centre)

    def layer(self, largest: float) -> Layer:
        """A square lattice of places for beads up to a radius (m), without those close to walls."""
        columns = int(self.width / (2.0 * LOOSE_PITCH * largest))
        pitch = self.width / max(columns, 1)
        line = [(column + 0.5) * pitch - self.width / 2.0 for column in range(columns)]
        lattice = list(product(line, line))
        on_floor = np.array([(x, y, 0.0) for x, y in lattice]).reshape(-1, 3)
        clearances = self.side_clearance(on_floor)
        places = []
        for place, clearance in zip(lattice, clearances, strict=True):
            if clearance > NEAREST * largest:
                places.append(place)
        return Layer(places=places, pitch=pitch, tight=self.tight)

    def layers(self, largest: float, bodies_top: float) -> Iterator[Layer]:  # noqa: ARG002
        """Endlessly many equal layers (`layer`), one above the other (see `Shape.layers`)."""
        layer = self.layer(largest)
        for number in count_from():
            # In this order: another one changes the last digit of heights, and piles are chaotic.
            yield replace(layer, level=(number + 0.5) * 2.0 * LOOSE_PITCH * largest)

    def check_pour(self, count: int, largest: float, bodies_top: float) -> None:
        """Raise `InputError` unless the beads fit (see `Shape.check_pour`)."""
        if self.width < 4.0 * largest:
            expected = "expected at least two of the large beads side by side"
            raise key_error("boundary.width", expected)
        layer = self.layer(largest)
        if layer.tight and self.width < 8.0 * largest:
            expected = "expected at least four of the large beads side by side"
            raise key_error("boundary.width", expected)
        if not layer.places:
            expected = "expected a wider boundary"
            raise key_error("boundary.height", f"too low for {count} beads; {expected}")
        layers = ceil(count / len(layer.places))
        level = bodies_top + layers * 2.0 * LOOSE_PITCH * largest
        if level > 2.0 * self.height:  # where the walls and the simulation box end
            sufficient = ceil(level / 2.0 * 1e5) / 100.0  # mm, rounded up to two decimals
            expected = f"expected {sufficient:g} mm or more"
            raise key_error("boundary.height", f"too low for {count} beads; {expected}")
