"""Containers with a level floor, upright side walls and an open top."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count as numbers_from
from math import ceil, inf
from typing import ClassVar

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.errors import key_error
from walkers.inputs.tables.shapes.shape import LOOSE, Layer, Shape, damping_between

NEAREST = (1.0 - 1e-9) * LOOSE
"""Smallest distance of a place from the walls, in radii of the largest bead."""
_RIM = 2e-4
"""m; the simulation box reaches this far beyond the walls."""
_BEYOND = 1.01
"""Extent of pictures over the width: the edges of the prism of a cylinder lie beyond the wall."""


@dataclass(frozen=True)
class Container(Shape):
    """A prism about the z axis, open above. Walls and simulation go on up to twice its height."""

    sizes: ClassVar[tuple[str, ...]] = ("width", "height")
    closed: ClassVar[bool] = True
    area: ClassVar[float]
    """Cross-section over the square of the width."""
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
        """The simulation box (see `Shape.simulation_box`): the container and as much room above it."""
        half = self.width / 2.0 + _RIM
        return (-half, -half, -4.0 * largest), (half, half, 2.0 * self.height)

    def outline(self, low: FloatArray, high: FloatArray, inside: FloatArray) -> list[FloatArray]:
        """Polygons of the walls in pictures (see `Shape.outline`), which end at the rim."""
        half = _BEYOND * self.width / 2.0
        low, high = np.full(3, -half), np.array([half, half, self.height])
        inside = np.array([0.0, 0.0, self.height / 2.0])
        return super().outline(low, high, inside)

    def layer(self, largest: float) -> Layer:
        """A square lattice of places for beads up to a radius (m), without those that walls cut."""
        across = int(self.width / (2.0 * LOOSE * largest))
        pitch = self.width / max(across, 1)
        line = [(index + 0.5) * pitch - self.width / 2.0 for index in range(across)]
        square = [(x, y) for x in line for y in line]
        clearances = self.side_clearance(np.array([(x, y, 0.0) for x, y in square]).reshape(-1, 3))
        free = clearances > NEAREST * largest
        places = [place for place, is_free in zip(square, free, strict=True) if is_free]
        return Layer(places, pitch, self.tight)

    def layers(self, largest: float, floor: float) -> Iterator[Layer]:  # noqa: ARG002
        """The same layer (`layer`) again and again, one upon the other, without end."""
        layer = self.layer(largest)
        for number in numbers_from():
            # In this order: another one changes the last digit of heights, and piles are chaotic.
            yield layer._replace(level=(number + 0.5) * 2.0 * LOOSE * largest)

    def check_pour(self, count: int, largest: float, floor: float) -> None:
        """Raise `InputError` unless the beads fit (see `Shape.check_pour`)."""
        if self.width < 4.0 * largest:
            expected = "expected at least two of the large beads side by side"
            raise key_error("boundary.width", expected)
        layer = self.layer(largest)
        if layer.tight and self.width < 8.0 * largest:
            expected = "expected at least four of the large beads side by side"
            raise key_error("boundary.width", expected)
        layers = -(-count // len(layer.places)) if layer.places else inf
        level = floor + layers * 2.0 * LOOSE * largest
        if level > 2.0 * self.height:  # walls and simulation go on to there
            expected = "expected a wider boundary"
            if layer.places:
                expected = f"expected {ceil(level / 2.0 * 1e5) / 100.0:g} mm or more"
            raise key_error("boundary.height", f"too low for {count} beads; {expected}")
