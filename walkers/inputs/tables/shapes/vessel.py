"""Vessels of the user's own: of planes, or of the triangles of a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any, ClassVar, Self

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.errors import key_error
from walkers.inputs import units
from walkers.inputs.config_table import Choice, ConfigTable, key
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.meshes.vessel_planes import vessel_between
from walkers.inputs.meshes.wall_names import names_of_faces
from walkers.inputs.tables.shapes.container import NEAREST, Container
from walkers.inputs.tables.shapes.shape import LOOSE_PITCH, Layer
from walkers.inputs.tables.shapes.walls import Flat, Wall

GIVEN_BY = Choice(("mesh", "scale"), ("planes", "height"))
"""Keys that describe a vessel."""
_PLACES_AT_ONCE = 5000
"""Largest number of places whose distances from the walls are computed together.

It limits memory, and a search for places can end early."""


class Plane(ConfigTable):
    """One of ``[[boundary.planes]]``: a point and the normal, toward the beads."""

    point: units.Position = key("A point of the plane.", example=["0 mm", "0 mm", "0 mm"])
    normal: tuple[units.Number, units.Number, units.Number] = key(
        "Direction of its normal, toward the beads.", example=[0, 0, 1]
    )


@dataclass(frozen=True)
class VesselShape(Container):
    """A vessel of planes.

    Attributes
    ----------
    width : float
        Twice the largest extent from the origin along x or y, m.
    height : float
        Height of the rim, m.
    planes : tuple of Plane
        The planes; empty for a mesh.
    points, triangles : tuple of tuple
        Corners (m) and triangles of a mesh; empty for planes.
    """

    name: ClassVar[str] = "vessel"
    sizes: ClassVar[tuple[str, ...]] = ()

    planes: tuple[Plane, ...]
    points: tuple[Vector, ...]
    triangles: tuple[tuple[int, int, int], ...]

    @classmethod
    def from_table(cls, table: Any) -> Self:
        """The vessel of a table with the keys of ``[boundary]``: of a mesh if it has triangles."""
        if table.triangles and cls is VesselShape:
            return MeshVesselShape.from_table(table)  # type: ignore[return-value]
        return super().from_table(table)

    @cached_property
    def vessel(self) -> Vessel:
        """The surface of the vessel."""
        planes = [(plane.point, plane.normal) for plane in self.planes]
        return vessel_between(planes, self.height)

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The planes; the first one is the floor if it is level and goes through the origin."""
        first = self.planes[0]
        # Both but for rounding errors, the height within 1 nm.
        first_is_floor = first.normal[2] > 1.0 - 1e-12 and abs(first.point[2]) < 1e-9
        names = names_of_faces([plane.normal for plane in self.planes], floor=first_is_floor)
        walls = []
        for plane, name in zip(self.planes, names, strict=True):
            walls.append(Flat(point=plane.point, normal=plane.normal, name=name))
        return tuple(walls)

    @property
    def cross_section(self) -> float:
        """Mean cross-section, m²."""
        return self.volume(self.height) / self.height

    def volume(self, level: float) -> float:
        """Volume below a level (m), m³."""
        return self.vessel.volume(level)

    def outline(
        self,
        low: FloatArray,  # noqa: ARG002
        high: FloatArray,  # noqa: ARG002
        inside: FloatArray,  # noqa: ARG002
    ) -> list[FloatArray]:
        """The triangles of the surface, arrays of shape (3, 3), m."""
        return list(self.vessel.points[self.vessel.triangles])

    def layers(self, largest: float, bodies_top: float) -> Iterator[Layer]:
        """Layers up to twice the height of the vessel (see ``Shape.layers``).

        A layer with many places comes in several strips along x, which have the same level.
        """
        pitch = 2.0 * LOOSE_PITCH * largest
        columns = ceil(self.width / pitch)
        line = pitch * (np.arange(columns) - (columns - 1) / 2.0)
        rows_at_once = max(1, _PLACES_AT_ONCE // columns)
        layer_count = max(int((2.0 * self.height - bodies_top) / pitch), 0)
        levels = (np.arange(layer_count) + 0.5) * pitch
        for level in levels.tolist():
            for first in range(0, columns, rows_at_once):
                strip = line[first : first + rows_at_once]
                grid = np.meshgrid(line, strip, [bodies_top + level])
                places = np.stack(grid, axis=-1).reshape(-1, 3)
                # A floor is not a side wall; the distance of places from it is their height.
                clearances = np.minimum(self.side_clearance(places), places[:, 2])
                free = places[clearances > NEAREST * largest]
                if len(free):
                    x_and_y = [(x, y) for x, y, _ in free.tolist()]
                    yield Layer(places=x_and_y, pitch=pitch, tight=True, level=level)

    def check_pour(self, count: int, largest: float, bodies_top: float) -> None:
        """Raise `InputError` unless the beads fit (see ``Shape.check_pour``)."""
        place_count = 0
        for layer in self.layers(largest, bodies_top):
            place_count += len(layer.places)
            if place_count >= count:
                return
        limit = f"up to twice its height of {1e3 * self.height:.4g} mm"
        if place_count:
            actual = f"the vessel has places for {place_count} beads to be poured from, {limit}"
            raise key_error("mixture.count", f"{actual}; expected at most {place_count}")
        diameter = f"{2e3 * largest:.4g} mm"
        actual = f"the vessel has no place to pour a bead of {diameter} from, {limit}"
        expected = "expected a larger vessel (boundary.scale) or smaller beads"
        if not self.vessel.rims:
            expected += ", or a vessel that is open at its top"
        raise key_error("mixture.count", f"{actual}; {expected}")


@dataclass(frozen=True)
class MeshVesselShape(VesselShape):
    """A vessel of triangles, for a surface that planes cannot describe. Its walls are facets."""

    @cached_property
    def vessel(self) -> Vessel:
        """The surface of the vessel."""
        return Vessel(np.array(self.points), np.array(self.triangles))

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """Faces, the floor first if there is one, then edges and corners that stand out."""
        return self.vessel.facets

    def damping(self, radius: float) -> float:  # noqa: ARG002
        """See ``Shape.damping``; a bead may touch two faces whose normals are nearly the same."""
        return 2.0

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distances (n,) of places (n, 3) from the surface, m; negative outside (see ``Shape``)."""
        return self.vessel.clearance(places)
