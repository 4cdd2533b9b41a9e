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
from walkers.inputs.tables.shapes.shape import LOOSE, Layer
from walkers.inputs.tables.shapes.walls import Flat, Wall

GIVEN_BY = Choice(("mesh", "scale"), ("planes", "height"))
"""Keys that describe a vessel."""
_PLACES_AT_ONCE = 5000
"""Places from which beads are poured whose distances from the walls are computed together."""


class Plane(ConfigTable):
    """One of ``[[boundary.planes]]``: a point and the normal, toward the beads."""

    point: units.Position = key("A point of the plane.", example=["0 mm", "0 mm", "0 mm"])
    normal: tuple[units.Number, units.Number, units.Number] = key(
        "Direction of its normal, toward the beads.", example=[0, 0, 1]
    )


@dataclass(frozen=True)
class VesselShape(Container):
    """A vessel of planes. ``width`` (m) is twice its extent from the origin along x or y."""

    name: ClassVar[str] = "vessel"
    sizes: ClassVar[tuple[str, ...]] = ()

    planes: tuple[Plane, ...]
    points: tuple[Vector, ...]
    triangles: tuple[tuple[int, int, int], ...]

    @classmethod
    def from_table(cls, table: Any) -> Self:
        """The vessel of a table with the keys of ``[boundary]``, of facets if it has triangles."""
        if table.triangles and cls is VesselShape:
            return MeshVesselShape.from_table(table)  # type: ignore[return-value]
        return super().from_table(table)

    @cached_property
    def vessel(self) -> Vessel:
        """Its surface."""
        return vessel_between([(plane.point, plane.normal) for plane in self.planes], self.height)

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The planes; the first one is the floor if it is level and goes through the origin."""
        first = self.planes[0]
        level = first.normal[2] > 1.0 - 1e-12 and abs(first.point[2]) < 1e-9
        names = names_of_faces([plane.normal for plane in self.planes], floor=level)
        named = zip(self.planes, names, strict=True)
        return tuple(Flat(plane.point, plane.normal, name) for plane, name in named)

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
        return [*self.vessel.points[self.vessel.triangles]]

    def layers(self, largest: float, floor: float) -> Iterator[Layer]:
        """Layers up to twice the height of the vessel (see `Container.layers`), wide ones in strips."""
        pitch = 2.0 * LOOSE * largest
        columns = ceil(self.width / pitch)
        line = pitch * (np.arange(columns) - (columns - 1) / 2.0)
        rows_at_once = max(1, _PLACES_AT_ONCE // columns)
        levels = (np.arange(max(int((2.0 * self.height - floor) / pitch), 0)) + 0.5) * pitch
        for level in levels.tolist():
            for first in range(0, columns, rows_at_once):
                strip = line[first : first + rows_at_once]
                places = np.stack(np.meshgrid(line, strip, [floor + level]), axis=-1).reshape(-1, 3)
                clear = np.minimum(self.side_clearance(places), places[:, 2])
                free = places[clear > NEAREST * largest]
                if len(free):
                    yield Layer([(x, y) for x, y, _ in free.tolist()], pitch, True, level)

    def check_pour(self, count: int, largest: float, floor: float) -> None:
        """Raise `InputError` unless the beads fit (see `Container.check_pour`); stops when they do."""
        room = 0
        for layer in self.layers(largest, floor):
            room += len(layer.places)
            if room >= count:
                return
        upto = f"up to twice its height of {1e3 * self.height:.4g} mm"
        if room:
            fits = f"the vessel has places for {room} beads to be poured from, {upto}"
            raise key_error("mixture.count", f"{fits}; expected at most {room}")
        across = f"{2e3 * largest:.4g} mm"
        none = f"the vessel has no place to pour a bead of {across} from, {upto}"
        cure = "expected a larger vessel (boundary.scale) or smaller beads"
        if not self.vessel.rims:
            cure += ", or a vessel that is open at its top"
        raise key_error("mixture.count", f"{none}; {cure}")


@dataclass(frozen=True)
class MeshVesselShape(VesselShape):
    """A vessel of triangles, where planes cannot describe the surface. Its walls are facets."""

    @cached_property
    def vessel(self) -> Vessel:
        """Its surface."""
        return Vessel(np.array(self.points), np.array(self.triangles))

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """Faces, the floor first if there is one, then edges and corners that stand out."""
        return self.vessel.facets

    def damping(self, radius: float) -> float:  # noqa: ARG002
        """See `Container.damping`; normals of neighbouring faces are nearly the same."""
        return 2.0

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places, shape (n, 3), from the surface, shape (n,), m; negative outside."""
        return self.vessel.clearance(places)
