"""``[boundary]`` of a case file; what a shape is and does is in `walkers.inputs.tables.shapes`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from math import cos, degrees, sin
from typing import Annotated, Any

from walkers.arrays import Vector
from walkers.errors import Problem
from walkers.inputs import units
from walkers.inputs.config_table import (
    SAME_RUN,
    ConfigTable,
    Derived,
    Indirect,
    key,
    key_within,
    present,
)
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.tables.shapes.registry import SHAPES, ShapeName
from walkers.inputs.tables.shapes.shape import Shape
from walkers.inputs.tables.shapes.vessel import GIVEN_BY, Plane, VesselShape
from walkers.inputs.tables.shapes.walls import Wall

_SLOPE = f'{units.NOT_NEGATIVE}; boundary.uphill = "180 deg" turns the slope'
_LEAST = 1e-13
_SIZES = ("opening", "width", "height")


class Boundary(ConfigTable):
    """``[boundary]``: the walls.

    A groove is two walls that meet in the x axis; a container is open above, its floor about the origin. A plane at 90°
    is a wall. ``uphill`` of a file is from the direction of the drive, of a resolved case from its x axis toward y.
    """

    shape: ShapeName = key("Shape of the boundary. See [](../cases.md#boundaries).", "plane")
    material: Annotated[str, SAME_RUN] = key(
        "Material, from the library, or any other name beside all friction coefficients.",
        ...,
        "glass",
    )
    opening: (
        Annotated[float, replace(units.ANGLE, smallest=0.5, largest=3.1, sign=units.POSITIVE)]
        | None
    ) = key("Angle between the two walls of a groove.", None, "120 deg")
    width: units.Length | None = key(
        "Width of a channel; inner side or diameter of a container.", None, "5.3 mm"
    )
    height: units.Length | None = key(
        "Height of a container. Beads are lost above twice this height.", None, "5.3 mm"
    )
    mesh: Indirect[str] = key(
        "File of a vessel of your own: its inner surface, or a solid, as STL, OBJ, PLY, VTP or in another format.",
        None,
        "funnel.stl",
    )
    scale: Indirect[units.Length] = key("Length of the unit of the mesh file.", None, "1 mm")
    planes: tuple[Plane, ...] = key(
        "Planes around the beads, up to the `height`, instead of a mesh.", ()
    )
    points: Derived[tuple[Vector, ...]] = ()
    triangles: Derived[tuple[tuple[int, int, int], ...]] = ()
    tilt: Annotated[float, replace(units.ANGLE, largest=1.5708, sign=_SLOPE)] = key(
        'Tilt of the floor: 0° is level, 90° is a wall. `uphill = "180 deg"` turns the slope.', 0.0
    )
    uphill: units.Angle = key(
        "Direction of the steepest ascent, measured within the floor from the drive axis.", 0.0
    )

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Sizes that the shape lacks, and sizes of other shapes."""
        named = next((name for name in ("mesh", "planes", "scale") if name in given), "")
        shape = str(given.get("shape", "vessel" if named else "plane"))
        if shape == "vessel":
            yield from cls.problems_of(GIVEN_BY, given, place)
        elif named:
            yield Problem(key_within(place, "shape"), None, f"expected none beside {place}.{named}")
            return
        if shape not in SHAPES:
            return
        sizes = ("height",) if "planes" in given else SHAPES[shape].sizes
        for name in _SIZES:
            if name in sizes and name not in given:
                yield cls.missing(name, place)
            elif name in given and name not in sizes:
                yield Problem(key_within(place, name), None, f"expected none of a {shape}")

    @property
    def geometry(self) -> Shape:
        """The shape with its sizes."""
        return _geometry_of(self)

    @property
    def inner_width(self) -> float:
        """Width of a channel or a container, m; raises `InputError` if the shape has none."""
        return present(self.width, "boundary.width")

    @property
    def inner_height(self) -> float:
        """Height of a container, m; raises `InputError` if the shape has none."""
        return present(self.height, "boundary.height")

    @property
    def closed(self) -> bool:
        """Whether the boundary is a container for poured beads."""
        return SHAPES[self.shape].closed

    @property
    def bare(self) -> bool:
        """Whether the boundary is a floor without side walls."""
        return SHAPES[self.shape].bare

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor first, if there is one, then the side walls."""
        return self.geometry.walls

    @property
    def vessel(self) -> Vessel:
        """The surface of a vessel of the user's own; raises `ValueError` for other shapes."""
        geometry = self.geometry
        if not isinstance(geometry, VesselShape):
            raise ValueError(f"a {self.shape} is no vessel")
        return geometry.vessel

    @property
    def tilted(self) -> str:
        """The tilt as text: ``plane tilted by 60°``; empty if level."""
        return f"{self.shape} tilted by {degrees(self.tilt):.4g}°" if self.tilt else ""

    def gravity(self, gravity: float) -> Vector:
        """The acceleration of gravity in the boundary's frame, m/s², of a magnitude (m/s²)."""
        down, press = gravity * _round(sin(self.tilt)), gravity * _round(cos(self.tilt))
        return (-down * _round(cos(self.uphill)), -down * _round(sin(self.uphill)), -press)


@lru_cache(maxsize=16)  # the surface of a mesh takes seconds
def _geometry_of(boundary: Boundary) -> Shape:
    return SHAPES[boundary.shape].from_table(boundary)


def _round(value: float) -> float:
    """A value, or zero if only rounding makes it differ: gravity along a wall has no normal part."""
    return 0.0 if abs(value) < _LEAST else value
