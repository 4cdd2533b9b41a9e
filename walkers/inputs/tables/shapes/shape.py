"""What a boundary asks its shape: the base of all shapes.

Each shape is a module in this folder: its sizes, walls, and what follows from them. SI units.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import ceil, inf, sqrt
from typing import ClassVar, NamedTuple, Self

from walkers.arrays import FloatArray, Vector
from walkers.errors import key_error
from walkers.inputs.tables.shapes.outline import faces_within
from walkers.inputs.tables.shapes.walls import FLOOR, Flat, Wall

LOOSE = 1.03
"""Pitch of the places from which beads are poured, in diameters of the largest bead."""
_TWO_SIDES = 2.02
"""A bead of this many radii touches both of two sides that are no farther apart."""


class Layer(NamedTuple):
    """A layer of places from which beads are poured.

    Attributes
    ----------
    places : sequence of tuple
        x and y of the places, m.
    pitch : float
        Distance of neighbouring places, m.
    tight : bool
        Whether walls that are not square to the lattice stand close to some of the places.
    level : float
        Height above the bodies below, m.
    """

    places: Sequence[tuple[float, float]]
    pitch: float
    tight: bool = False
    level: float = 0.0

    def play(self, radius: float, largest: float) -> float:
        """Largest displacement of a bead from its place, m, for its radius and the largest, m."""
        return (LOOSE * largest - radius) / 2.0 if self.tight else self.pitch / 2.0 - radius


@dataclass(frozen=True)
class Shape(ABC):
    """A shape of a boundary. The fields of a shape are keys of ``[boundary]``, in SI units.

    The answers here are those of a floor without ends; a shape overrides what is different.
    """

    name: ClassVar[str]
    """As in case files."""
    sizes: ClassVar[tuple[str, ...]] = ()
    """Keys that a case file must give for this shape; the other sizes are refused."""
    closed: ClassVar[bool] = False
    """Whether it is a container, into which beads can be poured."""
    bare: ClassVar[bool] = False
    """Whether it is a floor without side walls."""
    in_a_row: ClassVar[bool] = False
    """Whether walkers stand one after the other along x."""

    @classmethod
    def from_table(cls, table: object) -> Self:
        """The shape of a table with the keys of ``[boundary]``."""
        return cls(*(getattr(table, field.name) for field in fields(cls)))

    @property
    @abstractmethod
    def walls(self) -> tuple[Wall, ...]:
        """The floor first, if there is one, then the side walls."""

    @property
    def cross_section(self) -> float:
        """Inner cross-section, m²."""
        return inf

    def volume(self, level: float) -> float:  # noqa: ARG002
        """Volume below a level (m), m³."""
        return inf

    def damping(self, radius: float) -> float:  # noqa: ARG002
        """Damping of a bead of a radius (m) by all walls that it touches, over that by one wall.

        It is the largest eigenvalue of the sum of n nᵀ over the normals n of these walls.
        """
        return 1.0

    def rest_height(self, radius: float) -> float:
        """Height of the centre of a bead of a radius (m) that rests above the origin, m."""
        return radius

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places from the nearest side wall.

        Parameters
        ----------
        places : ndarray, shape (n, 3)
            Places in m.

        Returns
        -------
        ndarray, shape (n,)
            Distances in m, negative behind a wall; infinite without side walls.
        """
        clearances = places[:, 0] + inf
        for wall in self.walls:
            if wall.name != FLOOR:
                clearances = clearances.clip(max=wall.distances(places))
        return clearances

    def grid(self, number: int, spacing: float) -> list[tuple[float, float]]:
        """Places about the origin for walkers that stand ``spacing`` apart, x and y in m."""
        columns = 1 if self.in_a_row else ceil(sqrt(number))
        rows = ceil(number / columns)
        places = []
        for place in range(number):
            row, column = divmod(place, columns)
            x = (row - (rows - 1) / 2.0) * spacing
            y = (column - (columns - 1) / 2.0) * spacing
            places.append((x, y))
        return places

    def simulation_box(
        self,
        half_x: float,
        half_y: float,
        height: float,
        margin: float,
        largest: float,
    ) -> tuple[Vector, Vector]:
        """The simulation box.

        Parameters
        ----------
        half_x, half_y : float
            Half the extent of the paths of the beads along x and y, m.
        height : float
            Largest height of the beads, m.
        margin : float
            Distance that the box reaches beyond, m.
        largest : float
            Radius of the largest bead, m.

        Returns
        -------
        tuple of Vector
            Lower and upper corner, m.
        """
        x, y = half_x + 2.0 * margin, half_y + 2.0 * margin
        return (-x, -y, -4.0 * largest), (x, y, height + 2.0 * margin)

    def outline(self, low: FloatArray, high: FloatArray, inside: FloatArray) -> list[FloatArray]:
        """Polygons of the walls in pictures.

        Parameters
        ----------
        low, high : ndarray, shape (3,)
            Corners of a box around the beads, in which walls without ends are drawn, m.
        inside : ndarray, shape (3,)
            A place of a bead, m.

        Returns
        -------
        list of ndarray, shape (K, 3)
            Corners of each polygon, counterclockwise as seen from the beads, m.
        """
        return faces_within(self.walls, low, high, inside)

    def layers(self, largest: float, floor: float) -> Iterator[Layer]:  # noqa: ARG002
        """Layers of places from which beads are poured, the lowest one first.

        Parameters
        ----------
        largest : float
            Radius of the largest bead, m.
        floor : float
            Largest height of the bodies that are there already, m.
        """
        yield from ()

    def check_pour(self, count: int, largest: float, floor: float) -> None:  # noqa: ARG002
        """Check that there are places for all beads (`layers`).

        Parameters
        ----------
        count : int
            Number of beads.
        largest, floor : float
            As for `layers`.

        Raises
        ------
        InputError
            If there are fewer places than beads.
        """
        expected = 'expected a container, such as "box": a mixture is poured into it'
        raise key_error("boundary.shape", expected)


def damping_between(width: float, radius: float) -> float:
    """`Shape.damping` between upright walls at a distance (m).

    Neighbouring sides of an octagon (1.7) do not count: the time step of loose beads allows for
    more neighbours (`walkers.inputs.tables.bodies.Mixture.bridged`).
    """
    return 2.0 if width < _TWO_SIDES * radius else 1.0


def upright_walls(half: float, normals: Mapping[str, tuple[float, float]]) -> tuple[Wall, ...]:
    """Flat walls at a distance ``half`` (m) from the z axis; x and y of normals by name."""
    walls = []
    for name, (x, y) in normals.items():
        point = (-half * x + 0.0, -half * y + 0.0, 0.0)
        walls.append(Flat(point, (x, y, 0.0), name))
    return tuple(walls)
