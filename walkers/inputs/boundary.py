"""What beads stand on and lie in: planes, channels, containers. To add one, write a class, name it in `Shape`.

Most have a floor, the plane z = 0 in their own frame, and may have side walls.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, cos, inf, pi, sin, sqrt
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

from walkers.inputs.drive import Vector

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.floating[Any]]

FLOOR = "floor"
LOOSE = 1.03
"""Pitch of the places from which beads are poured, in diameters of the largest bead."""
_LEAST = 1e-13
_RIM = 2e-4
"""m; the simulation box of a container reaches this far beyond its walls."""


@dataclass(frozen=True)
class Flat:
    """A plane: a point of it (m), its unit normal into the space where the beads are, its name."""

    point: Vector
    normal: Vector
    name: str = FLOOR

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m."""
        found: FloatArray = (places - self.point) @ self.normal
        return found

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors away from it, of the shape of the places."""
        return 0.0 * places + self.normal


@dataclass(frozen=True)
class Round:
    """The inside of an upright cylinder about the origin: its radius (m), its name."""

    radius: float
    name: str = "side"

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m."""
        found: FloatArray = self.radius - (places[..., 0] ** 2 + places[..., 1] ** 2) ** 0.5
        return found

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors toward the axis, of the shape of the places."""
        found: FloatArray = places * (-1.0, -1.0, 0.0) / (self.radius - self.distances(places))[..., None]
        return found


Wall = Flat | Round
BOTTOM = Flat((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""The floor of every boundary that has one."""


@dataclass(frozen=True)
class Span:
    """What the beads need of room, m: half the extent of their ways, their height, a margin, the largest radius."""

    half_x: float
    half_y: float
    height: float
    margin: float
    largest: float


Room = tuple[Vector, Vector]
"""Lower and upper corner of the simulation box, m."""


@dataclass(frozen=True)
class Layer:
    """A layer of places from which beads are poured: the places (m), their pitch (m), and how far beads may stray."""

    places: Sequence[tuple[float, float]]
    pitch: float
    tight: bool = False

    def play(self, radius: float, largest: float) -> float:
        """How far a bead of a radius may be moved from its place, m."""
        return (LOOSE * largest - radius) / 2.0 if self.tight else self.pitch / 2.0 - radius


@dataclass(frozen=True, kw_only=True)
class Boundary:
    """A boundary of a material, leaning or not.

    ``tilt`` is the angle of the floor to the horizontal (rad: 0 level, π/2 a wall), ``uphill`` the direction of the
    steepest way up within the floor (rad, from its x axis toward y).
    """

    material: str
    tilt: float = 0.0
    uphill: float = 0.0

    drive_axis: ClassVar[Literal["x", "z"]] = "x"
    """Along which it is shaken if a case does not say."""
    closed: ClassVar[bool] = False
    """Whether beads can be poured into it."""

    def gravity(self, gravity: float) -> Vector:
        """The acceleration of gravity in the boundary's frame, m/s², of a magnitude (m/s²)."""
        down, press = gravity * _round(sin(self.tilt)), gravity * _round(cos(self.tilt))
        return (-down * _round(cos(self.uphill)), -down * _round(sin(self.uphill)), -press)

    @property
    @abstractmethod
    def walls(self) -> tuple[Wall, ...]:
        """The floor first, if there is one, then the side walls."""

    @abstractmethod
    def room(self, span: Span) -> Room:
        """The simulation box for beads that need so much."""

    @property
    def bare(self) -> bool:
        """Whether it is a floor without any side walls."""
        return self.walls == (BOTTOM,)

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distance of each place, shape (n, 3), from the nearest side wall, shape (n,), m."""
        found = places[:, 0] + inf
        for wall in self.walls:
            if wall.name != FLOOR:
                found = found.clip(max=wall.distances(places))
        return found

    def grid(self, number: int, spacing: float) -> list[tuple[float, float]]:
        """Places for walkers that stand ``spacing`` (m) apart: a square grid about the origin."""
        columns = ceil(sqrt(number))
        rows = ceil(number / columns)
        cells = (divmod(place, columns) for place in range(number))
        return [((row - (rows - 1) / 2.0) * spacing, (column - (columns - 1) / 2.0) * spacing) for row, column in cells]

    def rest_height(self, radius: float) -> float:
        """Height above the origin at which a bead of a radius (m) rests, m."""
        return radius

    @property
    def inner_width(self) -> float:
        """Between upright side walls, m."""
        return inf

    @property
    def top(self) -> float:
        """Height up to which beads may be placed, m."""
        return inf

    @property
    def cross_section(self) -> float:
        """Inner area, m²."""
        return inf

    def layer(self, largest: float) -> Layer:
        """Places from which beads up to a radius (m) are poured."""
        del largest
        raise ValueError(f"nothing can be poured into a {type(self).__name__}")


@dataclass(frozen=True, kw_only=True)
class Plane(Boundary):
    """A plane without end."""

    shape: Literal["plane"] = "plane"

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The plane."""
        return (BOTTOM,)

    def room(self, span: Span) -> Room:
        """A box about the ways of all walkers."""
        wide = 2.0 * span.margin
        x, y = span.half_x + wide, span.half_y + wide
        return (-x, -y, -span.margin), (x, y, span.height + wide)


class _Row(Boundary):
    """What has no end along x."""

    def grid(self, number: int, spacing: float) -> list[tuple[float, float]]:
        """A row along x."""
        return [((place - (number - 1) / 2.0) * spacing, 0.0) for place in range(number)]


@dataclass(frozen=True, kw_only=True)
class Channel(_Row):
    """A floor between two upright walls, ``width`` (m) apart, without end along x."""

    width: float
    shape: Literal["channel"] = "channel"

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and two walls."""
        return (BOTTOM, *_facing_walls("y", self.width))

    @property
    def inner_width(self) -> float:
        """Between the walls, m."""
        return self.width

    def room(self, span: Span) -> Room:
        """A box about the walkers' ways."""
        half_x, half_y = span.half_x + 2.0 * span.margin, self.width / 2.0 + span.margin
        return _room_above((half_x, half_y), max(span.height + 2.0 * span.margin, self.width), span.largest)


@dataclass(frozen=True, kw_only=True)
class Groove(_Row):
    """A V-shaped channel: two walls that meet in the x axis, without end along it; ``opening`` is their angle (rad)."""

    opening: float
    shape: Literal["groove"] = "groove"

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The wall to the right and that to the left."""
        across, up = cos(self.opening / 2.0), sin(self.opening / 2.0)
        return (Flat(BOTTOM.point, (0.0, across, up), "-y"), Flat(BOTTOM.point, (0.0, -across, up), "+y"))

    def rest_height(self, radius: float) -> float:
        """Height at which a bead touches both walls, m."""
        return radius / sin(self.opening / 2.0)

    def room(self, span: Span) -> Room:
        """A box about the walkers' ways."""
        half_x, half_y = span.half_x + 2.0 * span.margin, span.half_y + 2.0 * span.margin
        return _room_above((half_x, half_y), span.height + 2.0 * span.margin, span.largest)


@dataclass(frozen=True, kw_only=True)
class Container(Boundary):
    """An upright container, open above, its floor about the origin; ``width`` is its inner side or diameter (m).

    The walls of the simulation go on above its ``height`` (m), to twice that height, where beads are lost.
    """

    width: float
    height: float

    drive_axis: ClassVar[Literal["x", "z"]] = "z"
    closed: ClassVar[bool] = True
    cuts: ClassVar[bool] = True
    """Whether its walls cut a square lattice of places."""

    @property
    def inner_width(self) -> float:
        """Between the walls, m."""
        return self.width

    @property
    def top(self) -> float:
        """The height, m."""
        return self.height

    def room(self, span: Span) -> Room:
        """The container and a little more; climbers may rise above the rim."""
        edge = self.width / 2.0 + _RIM
        return _room_above((edge, edge), 2.0 * self.height, span.largest)

    def layer(self, largest: float) -> Layer:
        """A square lattice as wide as the container, where walls that cut it leave room; beads stray less then."""
        import numpy as np

        across = int(self.width / (2.0 * LOOSE * largest))
        pitch = self.width / max(across, 1)
        line = [(index + 0.5) * pitch - self.width / 2.0 for index in range(across)]
        square = [(x, y) for x in line for y in line]
        near = (1.0 - 1e-9) * LOOSE * largest
        room = self.side_clearance(np.array([(x, y, 0.0) for x, y in square]).reshape(-1, 3))
        places = [place for place, clear in zip(square, room, strict=True) if clear > near]
        return Layer(places, pitch, tight=self.cuts)


@dataclass(frozen=True, kw_only=True)
class Box(Container):
    """A container with a square cross-section."""

    shape: Literal["box"] = "box"
    cuts: ClassVar[bool] = False

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and four walls."""
        return (BOTTOM, *_facing_walls("x", self.width), *_facing_walls("y", self.width))

    @property
    def cross_section(self) -> float:
        """Inner area, m²."""
        return self.width**2


@dataclass(frozen=True, kw_only=True)
class Cylinder(Container):
    """A round container."""

    shape: Literal["cylinder"] = "cylinder"

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor and the side."""
        return (BOTTOM, Round(self.width / 2.0))

    @property
    def cross_section(self) -> float:
        """Inner area, m²."""
        return self.width**2 * (pi / 4.0)


@dataclass(frozen=True, kw_only=True)
class Octagon(Container):
    """A box whose corners are cut: a regular octagon, the angles between its walls are 135°."""

    shape: Literal["octagon"] = "octagon"

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The floor, four walls as of a box, and four across its corners."""
        half, across = self.width / 2.0, sqrt(0.5)
        ways = {
            "+x+y": (across, across),
            "+x-y": (across, -across),
            "-x+y": (-across, across),
            "-x-y": (-across, -across),
        }
        corners = [Flat((half * x, half * y, 0.0), (-x, -y, 0.0), name) for name, (x, y) in ways.items()]
        return (BOTTOM, *_facing_walls("x", self.width), *_facing_walls("y", self.width), *corners)

    @property
    def cross_section(self) -> float:
        """Inner area, m²."""
        return self.width**2 * 2.0 * (sqrt(2.0) - 1.0)


Shape = Plane | Channel | Groove | Box | Cylinder | Octagon
"""The boundaries that there are."""
SHAPES: Mapping[str, type[Shape]] = {one.shape: one for one in get_args(Shape)}
"""By the names that case files use."""


def _facing_walls(axis: Literal["x", "y"], apart: float) -> tuple[Flat, Flat]:
    """Two upright walls across an axis, so far apart (m)."""
    half = apart / 2.0
    if axis == "x":
        return Flat((-half, 0.0, 0.0), (1.0, 0.0, 0.0), "-x"), Flat((half, 0.0, 0.0), (-1.0, 0.0, 0.0), "+x")
    return Flat((0.0, -half, 0.0), (0.0, 1.0, 0.0), "-y"), Flat((0.0, half, 0.0), (0.0, -1.0, 0.0), "+y")


def _room_above(half: tuple[float, float], top: float, largest: float) -> Room:
    """A box from below the floor."""
    return (-half[0], -half[1], -4.0 * largest), (half[0], half[1], top)


def _round(value: float) -> float:
    """Zero for what is zero but for rounding: a wall's weight does not press at all."""
    return 0.0 if abs(value) < _LEAST else value
