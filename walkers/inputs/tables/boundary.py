"""The table ``[boundary]`` of a case file.

What follows from a shape is computed in `walkers.inputs.tables.shapes`.
"""

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
"""What a message expects of a tilt."""
_ROUNDING_ERROR = 1e-13
"""Sines and cosines below this are zero."""
_SIZES = ("opening", "width", "height")
"""Keys of the sizes of all shapes."""
_VESSEL_KEYS = ("mesh", "planes", "scale")
"""Keys that only vessels of the user's own have, which therefore imply this shape."""
_Opening = Annotated[float, replace(units.ANGLE, smallest=0.5, largest=3.1, sign=units.POSITIVE)]
_Tilt = Annotated[float, replace(units.ANGLE, largest=1.5708, sign=_SLOPE)]


class Boundary(ConfigTable):
    """``[boundary]``: the walls.

    A groove consists of two walls that meet in the x axis. A container is open at the top, and the
    origin is the middle of its floor. A plane that is tilted by 90° is a wall. The angle ``uphill``
    of a file starts from the direction of the drive, that of a resolved case from the x axis toward
    y.
    """

    shape: ShapeName = key("Shape of the boundary. See [](../cases.md#boundaries).", "plane")
    material: Annotated[str, SAME_RUN] = key(
        "Material, from the library, or any other name beside all friction coefficients.",
        ...,
        "glass",
    )
    opening: _Opening | None = key("Angle between the two walls of a groove.", None, "120 deg")
    width: units.Length | None = key(
        "Width of a channel; inner side or diameter of a container.", None, "5.3 mm"
    )
    height: units.Length | None = key(
        "Height of a container. Beads are lost above twice this height.", None, "5.3 mm"
    )
    mesh: Indirect[str] = key(
        "File of a vessel of your own: its inner surface, or a solid, as STL, OBJ, PLY, VTP "
        "or in another format.",
        None,
        "funnel.stl",
    )
    scale: Indirect[units.Length] = key("Length of the unit of the mesh file.", None, "1 mm")
    planes: tuple[Plane, ...] = key(
        "Planes around the beads, up to the `height`, instead of a mesh.", ()
    )
    points: Derived[tuple[Vector, ...]] = ()
    triangles: Derived[tuple[tuple[int, int, int], ...]] = ()
    tilt: _Tilt = key(
        'Tilt of the floor: 0° is level, 90° is a wall. `uphill = "180 deg"` turns the slope.', 0.0
    )
    uphill: units.Angle = key(
        "Direction of the steepest ascent, measured within the floor from the drive axis.", 0.0
    )

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Sizes that the shape lacks, sizes of other shapes, and contradictions of a vessel."""
        vessel_keys = [name for name in _VESSEL_KEYS if name in given]
        default = "vessel" if vessel_keys else "plane"
        shape = str(given.get("shape", default))
        if shape == "vessel":
            yield from cls.problems_of(GIVEN_BY, given, place)
            if "mesh" not in given and "planes" not in given:
                return  # which sizes it has depends on what it is given by
        elif vessel_keys:
            expected = f"expected none beside {place}.{vessel_keys[0]}"
            yield Problem(key_within(place, "shape"), None, expected)
            return
        if shape not in SHAPES:
            return
        sizes = SHAPES[shape].sizes
        if "planes" in given:
            sizes = ("height",)
        for name in _SIZES:
            if name in sizes and name not in given:
                yield cls.missing(name, place)
            elif name in given and name not in sizes:
                yield Problem(key_within(place, name), None, f"expected none for a {shape}")

    @classmethod
    def replaced_by(cls, name: str, value: object) -> set[str]:
        """The keys that describe another boundary than a new shape, mesh or list of planes."""
        if name == "mesh":
            return {"shape", "planes", *_SIZES}
        if name == "planes":
            return {"shape", "mesh", "scale", "opening", "width"}
        if name == "shape" and value in SHAPES and value != "vessel":
            return {*_VESSEL_KEYS, *_SIZES}.difference(SHAPES[str(value)].sizes)
        return set()

    @property
    def geometry(self) -> Shape:
        """The shape with its sizes, which answers what depends on the form of the boundary."""
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
    def is_open_floor(self) -> bool:
        """Whether the boundary is a floor without side walls."""
        return SHAPES[self.shape].is_open_floor

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor first, if there is one, then the side walls."""
        return self.geometry.walls

    @property
    def vessel(self) -> Vessel:
        """The surface of a vessel of the user's own; other shapes raise `ValueError`."""
        geometry = self.geometry
        if not isinstance(geometry, VesselShape):
            raise ValueError(f"a {self.shape} is not a vessel")
        return geometry.vessel

    @property
    def tilted(self) -> str:
        """The tilt as text: ``plane tilted by 60°``; empty if level."""
        if self.tilt == 0.0:
            return ""
        return f"{self.shape} tilted by {degrees(self.tilt):.4g}°"

    def gravity(self, gravity: float) -> Vector:
        """The acceleration of gravity in the frame of the boundary, m/s², of a magnitude (m/s²)."""
        along_slope = gravity * _without_rounding_error(sin(self.tilt))
        normal = gravity * _without_rounding_error(cos(self.tilt))
        x = -along_slope * _without_rounding_error(cos(self.uphill))
        y = -along_slope * _without_rounding_error(sin(self.uphill))
        return (x, y, -normal)


@lru_cache(maxsize=16)  # the surface of a mesh takes seconds
def _geometry_of(boundary: Boundary) -> Shape:
    """The shape of a boundary with its sizes."""
    return SHAPES[boundary.shape].from_table(boundary)


def _without_rounding_error(value: float) -> float:
    """A sine or cosine, or zero if only rounding makes a difference.

    Gravity has no component normal to a vertical wall, although cos(π/2) is 6e-17.
    """
    if abs(value) < _ROUNDING_ERROR:
        return 0.0
    return value
