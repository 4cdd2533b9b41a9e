"""Boundaries: planes, channels, grooves, containers, vessels of the user's own (`walkers.inputs.meshes.vessel`)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import count
from math import ceil, cos, degrees, inf, pi, sin, sqrt
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.errors import Problem
from walkers.inputs import units
from walkers.inputs.config_table import SAME_RUN, Choice, Derived, Filled, Indirect, Table, key, within
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.meshes.vessel_planes import vessel_between
from walkers.inputs.meshes.wall_names import names_of_faces
from walkers.inputs.tables.shapes.walls import BOTTOM, FLOOR, Flat, Round, Wall

LOOSE = 1.03
"""Pitch of the places from which beads are poured, in diameters of the largest bead."""
_SLOPE = f'{units.NOT_NEGATIVE}; boundary.uphill = "180 deg" turns the slope'
_LEAST = 1e-13
_PLACES_AT_ONCE = 5000  # from which beads are poured, whose distances from walls are found together
_RIM = 2e-4  # m; the simulation box of a container reaches this far beyond its walls


class Layer(NamedTuple):
    """A layer of positions from which beads are poured: positions (m), pitch (m), largest displacement; height (m)."""

    places: Sequence[tuple[float, float]]
    pitch: float
    tight: bool = False
    level: float = 0.0

    def play(self, radius: float, largest: float) -> float:
        """Largest displacement of a bead from its position, m."""
        return (LOOSE * largest - radius) / 2.0 if self.tight else self.pitch / 2.0 - radius


Shape = Literal["plane", "channel", "groove", "box", "cylinder", "octagon", "vessel"]
SIZES: Mapping[str, Collection[str]] = {
    "plane": (),
    "channel": ("width",),
    "groove": ("opening",),
    **dict.fromkeys(("box", "cylinder", "octagon"), ("width", "height")),
    "vessel": (),
}
"""Size keys of each shape."""
_VESSEL = Choice("mesh and scale or planes and height")
_AREAS = {"box": 1.0, "cylinder": pi / 4.0, "octagon": 2.0 * (sqrt(2.0) - 1.0)}
"""Of the cross-sections of containers, in squares of their width."""
_ACROSS = {"-y": (0.0, 1.0), "+y": (0.0, -1.0)}
_BOX = {"-x": (1.0, 0.0), "+x": (-1.0, 0.0), **_ACROSS}
_CUT = sqrt(0.5)
_CORNERS = {"+x+y": (-_CUT, -_CUT), "+x-y": (-_CUT, _CUT), "-x+y": (_CUT, -_CUT), "-x-y": (_CUT, _CUT)}
_SIDES_OF = {"channel": _ACROSS, "box": _BOX, "octagon": {**_BOX, **_CORNERS}}
"""Flat side walls by their names: normals in the plane of the floor, from which each is half of the width."""


class Plane(Table):
    """One of ``[[boundary.planes]]``: a point and the normal, toward the beads."""

    point: units.Position = key("A point of the plane.", example=["0 mm", "0 mm", "0 mm"])
    normal: tuple[units.Number, units.Number, units.Number] = key(
        "Direction of its normal, toward the beads.", example=[0, 0, 1]
    )


class Boundary(Table):
    """``[boundary]``: the walls.

    A groove is two walls that meet in the x axis; a container is open above, its floor about the origin. A plane at 90°
    is a wall. ``uphill`` of a file is from the direction of the drive, of a resolved case from its x axis toward y.
    """

    shape: Shape = key("Shape of the boundary. See [](../cases.md#boundaries).", "plane")
    material: Annotated[str, SAME_RUN] = key(
        "Material, from the library, or any other name beside all friction coefficients.", ..., "glass"
    )
    opening: Filled[Annotated[float, replace(units.ANGLE, smallest=0.5, largest=3.1, sign=units.POSITIVE)]] = key(
        "Angle between the two walls of a groove.", None, "120 deg"
    )
    width: Filled[units.Length] = key("Width of a channel; inner side or diameter of a container.", None, "5.3 mm")
    height: Filled[units.Length] = key("Height of a container. Beads are lost above twice this height.", None, "5.3 mm")
    mesh: Indirect[str] = key(
        "File of a vessel of your own: its inner surface, or a solid, as STL, OBJ, PLY, VTP or in another format.",
        None,
        "funnel.stl",
    )
    scale: Indirect[units.Length] = key("Length of the unit of the mesh file.", None, "1 mm")
    planes: tuple[Plane, ...] = key("Planes around the beads, up to the `height`, instead of a mesh.", ())
    points: Derived[tuple[Vector, ...]] = ()
    triangles: Derived[tuple[tuple[int, int, int], ...]] = ()
    tilt: Annotated[float, replace(units.ANGLE, largest=1.5708, sign=_SLOPE)] = key(
        'Tilt of the floor: 0° is level, 90° is a wall. `uphill = "180 deg"` turns the slope.', 0.0
    )
    uphill: units.Angle = key("Direction of the steepest ascent, measured within the floor from the drive axis.", 0.0)

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Sizes that the shape lacks, and sizes of other shapes."""
        named = next((name for name in ("mesh", "planes", "scale") if name in given), "")
        shape = str(given.get("shape", "vessel" if named else "plane"))
        if shape == "vessel":
            yield from cls.problems_of(_VESSEL, given, place)
        elif named:
            yield Problem(within(place, "shape"), None, f"expected none beside {place}.{named}")
            return
        sizes = ("height",) if "planes" in given else SIZES.get(shape, ())
        for name in ("opening", "width", "height") if shape in SIZES else ():
            if name in sizes and name not in given:
                yield cls.missing(name, place)
            elif name in given and name not in sizes:
                yield Problem(within(place, name), None, f"expected none of a {shape}")

    @property
    def closed(self) -> bool:
        """Whether the boundary is a container for poured beads."""
        return self.shape == "vessel" or self.shape in _AREAS

    @property
    def vessel(self) -> Vessel:
        """The surface of a vessel of the user's own."""
        return _vessel_of(self)

    @property
    def bare(self) -> bool:
        """Whether the boundary is a floor without side walls."""
        return self.shape == "plane"

    @property
    def tilted(self) -> str:
        """The tilt as text: ``plane tilted by 60°``; empty if level."""
        return f"{self.shape} tilted by {degrees(self.tilt):.4g}°" if self.tilt else ""

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor first, if there is one, then the side walls."""
        if self.triangles:
            return self.vessel.facets
        if self.shape == "vessel":
            first = self.planes[0]
            level = first.normal[2] > 1.0 - 1e-12 and abs(first.point[2]) < 1e-9
            names = names_of_faces([plane.normal for plane in self.planes], floor=level)
            return tuple(Flat(plane.point, plane.normal, name) for plane, name in zip(self.planes, names, strict=True))
        if self.shape == "groove":
            across, up = cos(self.opening / 2.0), sin(self.opening / 2.0)
            return (Flat(BOTTOM.point, (0.0, across, up), "-y"), Flat(BOTTOM.point, (0.0, -across, up), "+y"))
        half = (self.width or inf) / 2.0
        if self.shape == "cylinder":
            return BOTTOM, Round(half)
        sides = _SIDES_OF.get(self.shape, {})
        normals = ((name, x, y) for name, (x, y) in sides.items())
        return BOTTOM, *(Flat((-half * x + 0.0, -half * y + 0.0, 0.0), (x, y, 0.0), name) for name, x, y in normals)

    def damping(self, radius: float) -> float:
        """Damping of a bead of a radius (m) by the walls that it touches at once, over that by one of them.

        It is the largest eigenvalue of the sum of n nᵀ over their normals n. Neighbouring sides of an octagon (1.7) do
        not count: the step of loose beads allows for more neighbours (`walkers.inputs.tables.bodies.Mixture.bridged`).
        """
        if self.shape == "groove":
            return 1.0 + abs(cos(self.opening))
        if self.triangles:  # neighbouring faces turn by a small angle: their normals are nearly the same
            return 2.0
        return 2.0 if (self.width or inf) < 2.02 * radius else 1.0

    def room(self, half_x: float, half_y: float, height: float, margin: float, largest: float) -> tuple[Vector, Vector]:
        """Corners of the simulation box, from half the extent of the paths of beads, height, margin and radius; m."""
        x, y = half_x + 2.0 * margin, half_y + 2.0 * margin
        top, below = height + 2.0 * margin, 4.0 * largest
        if self.shape == "plane":
            below = margin
        if self.shape == "channel":
            y, top = self.width / 2.0 + margin, max(top, self.width)
        if self.closed:
            x = y = self.width / 2.0 + _RIM
            top = 2.0 * self.height
        return (-x, -y, -below), (x, y, top)

    def gravity(self, gravity: float) -> Vector:
        """The acceleration of gravity in the boundary's frame, m/s², of a magnitude (m/s²)."""
        down, press = gravity * _round(sin(self.tilt)), gravity * _round(cos(self.tilt))
        return (-down * _round(cos(self.uphill)), -down * _round(sin(self.uphill)), -press)

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places, (n, 3), from the nearest side wall, (n,), m; in a vessel of facets, negative outside."""
        if self.triangles:
            return self.vessel.clearance(places)
        clearances = places[:, 0] + inf
        for wall in self.walls:
            if wall.name != FLOOR:
                clearances = clearances.clip(max=wall.distances(places))
        return clearances

    def grid(self, number: int, spacing: float) -> list[tuple[float, float]]:
        """Places about the origin for walkers that stand ``spacing`` (m) apart: a square grid, or a row along x."""
        columns = 1 if self.shape in ("channel", "groove") else ceil(sqrt(number))
        rows = ceil(number / columns)
        cells = (divmod(place, columns) for place in range(number))
        return [((row - (rows - 1) / 2.0) * spacing, (column - (columns - 1) / 2.0) * spacing) for row, column in cells]

    def rest_height(self, radius: float) -> float:
        """Height above the origin at which a bead of a radius (m) rests on the floor or on both walls, m."""
        return radius / sin((self.opening or pi) / 2.0)

    @property
    def cross_section(self) -> float:
        """Inner cross-section of a container, m²; of a vessel of the user's own, its mean."""
        return self.volume(self.height) / self.height if self.shape == "vessel" else self.width**2 * _AREAS[self.shape]

    def volume(self, level: float) -> float:
        """Volume of a container below a level (m), m³."""
        return self.vessel.volume(level) if self.shape == "vessel" else self.cross_section * level

    def layer(self, largest: float) -> Layer:
        """Places from which beads up to a radius (m) are poured: a square lattice, without those that walls cut."""
        across = int(self.width / (2.0 * LOOSE * largest))
        pitch = self.width / max(across, 1)
        line = [(index + 0.5) * pitch - self.width / 2.0 for index in range(across)]
        square = [(x, y) for x in line for y in line]
        near = (1.0 - 1e-9) * LOOSE * largest
        room = self.side_clearance(np.array([(x, y, 0.0) for x, y in square]).reshape(-1, 3))
        places = [place for place, clear in zip(square, room, strict=True) if clear > near]
        return Layer(places, pitch, tight=self.shape != "box")

    def layers(self, largest: float, floor: float) -> Iterator[Layer]:
        """Layers of such places above a height (m), one upon the other; of a vessel of the user's own up to the top."""
        if self.shape == "vessel":
            yield from _layers_in(self, largest, floor)
            return
        layer = self.layer(largest)
        # In this order: another one changes the last digit of heights, and piles are chaotic.
        yield from (layer._replace(level=(number + 0.5) * 2.0 * LOOSE * largest) for number in count())


@lru_cache(maxsize=16)
def _vessel_of(boundary: Boundary) -> Vessel:
    if boundary.triangles:
        return Vessel(np.array(boundary.points), np.array(boundary.triangles))
    return vessel_between([(plane.point, plane.normal) for plane in boundary.planes], boundary.height)


def _layers_in(boundary: Boundary, largest: float, floor: float) -> Iterator[Layer]:
    """Layers of a vessel of the user's own, see `Boundary.layers`; a wide layer comes in several strips."""
    pitch = 2.0 * LOOSE * largest
    columns = ceil(boundary.width / pitch)
    line = pitch * (np.arange(columns) - (columns - 1) / 2.0)
    rows_at_once = max(1, _PLACES_AT_ONCE // columns)
    levels = (np.arange(max(int((2.0 * boundary.height - floor) / pitch), 0)) + 0.5) * pitch
    for level in levels.tolist():
        for first in range(0, columns, rows_at_once):
            strip = line[first : first + rows_at_once]
            places = np.stack(np.meshgrid(line, strip, [floor + level]), axis=-1).reshape(-1, 3)
            clear = np.minimum(boundary.side_clearance(places), places[:, 2])
            free = places[clear > (1.0 - 1e-9) * LOOSE * largest]
            if len(free):
                yield Layer([(x, y) for x, y, _ in free.tolist()], pitch, True, level)


def _round(value: float) -> float:
    """A value, or zero if it differs from zero by rounding only: gravity along a wall has no normal component."""
    return 0.0 if abs(value) < _LEAST else value
