"""The base of all shapes of boundaries, with everything that can be asked of a shape.

Each shape is a module in this folder: its sizes, its walls, and what follows from them, in SI
units. Distances from walls and their normals are questions to the walls
(`walkers.inputs.tables.shapes.walls`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import ceil, inf, sqrt
from typing import ClassVar, Self

from walkers.arrays import FloatArray, Vector
from walkers.errors import key_error
from walkers.inputs.tables.shapes.outline import faces_within
from walkers.inputs.tables.shapes.walls import FLOOR, Flat, Wall

LOOSE_PITCH = 1.03
"""Pitch of the places from which beads are poured, in diameters of the largest bead."""
_TWO_SIDES = 2.02
"""Largest distance of two opposite walls that a bead touches at once, in radii of the bead."""


@dataclass(frozen=True)
class Layer:
    """A layer of places from which beads are poured.

    Attributes
    ----------
    places : sequence of tuple
        x and y of the places, m.
    pitch : float
        Distance of neighbouring places, m.
    tight : bool
        Whether some of the places are close to walls that do not run along the lattice.
    level : float
        Height above the bodies below, m.
    """

    places: Sequence[tuple[float, float]]
    pitch: float
    tight: bool = False
    level: float = 0.0

    def play(self, radius: float, largest: float) -> float:
        """Largest displacement of a bead from its place that keeps it clear of others and of walls.

        Parameters
        ----------
        radius : float
            Radius of the bead, m.
        largest : float
            Radius of the largest bead, m.

        Returns
        -------
        float
            The displacement, m.
        """
        if self.tight:
            return (LOOSE_PITCH * largest - radius) / 2.0
        return self.pitch / 2.0 - radius


@dataclass(frozen=True)
class Shape(ABC):
    """A shape of a boundary. The fields of a shape are keys of ``[boundary]``, in SI units.

    The properties and methods here are those of a floor without ends; a shape overrides what
    differs.
    """

    name: ClassVar[str]
    """Name in case files."""
    sizes: ClassVar[tuple[str, ...]] = ()
    """Keys that a case file must give for this shape; the other sizes are refused."""
    closed: ClassVar[bool] = False
    """Whether it is a container, into which beads can be poured."""
    is_open_floor: ClassVar[bool] = False
    """Whether it is a floor at z = 0 without side walls."""
    in_a_row: ClassVar[bool] = False
    """Whether walkers stand in a single row along x."""

    @classmethod
    def from_table(cls, table: object) -> Self:
        """The shape of a table with the keys of ``[boundary]``."""
        sizes = {field.name: getattr(table, field.name) for field in fields(cls)}
        return cls(**sizes)

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
        """Ratio of the damping of a bead by all walls that it touches to that by one wall.

        It is the largest eigenvalue of the sum of n nᵀ over the unit normals n of these walls.

        Parameters
        ----------
        radius : float
            Radius of the bead, m.
        """
        return 1.0

    def rest_height(self, radius: float) -> float:
        """Height of the centre of a bead of a radius (m) that rests at the origin, m."""
        return radius

    def side_clearance(self, places: FloatArray) -> FloatArray:
        """Distances of places from their nearest side walls.

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
        """Places of walkers about the origin.

        Parameters
        ----------
        number : int
            Number of walkers.
        spacing : float
            Distance of neighbours along x and along y, m.

        Returns
        -------
        list of tuple
            x and y of each walker, m, row by row; the walkers of a row have the same x.
        """
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
            Half the extent of the paths of all beads along x and along y, m.
        height : float
            Largest height of the beads, m.
        margin : float
            Distance from these paths to the sides of the box, m; some sides are twice as far.
        largest : float
            Radius of the largest bead, m.

        Returns
        -------
        tuple of Vector
            Lower and upper corner, m.
        """
        x = half_x + 2.0 * margin
        y = half_y + 2.0 * margin
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

    def layers(self, largest: float, bodies_top: float) -> Iterator[Layer]:  # noqa: ARG002
        """Layers of places from which beads are poured, the lowest one first.

        Parameters
        ----------
        largest : float
            Radius of the largest bead, m.
        bodies_top : float
            Largest height of the bodies that are in the container already, m.

        Yields
        ------
        Layer
            None for shapes that are not containers.
        """
        yield from ()

    def check_pour(self, count: int, largest: float, bodies_top: float) -> None:  # noqa: ARG002
        """Check that the `layers` have places for all beads of a mixture.

        Parameters
        ----------
        count : int
            Number of beads.
        largest, bodies_top : float
            As for `layers`.

        Raises
        ------
        InputError
            If there are fewer places than beads, or if the shape is not a container.
        """
        expected = 'expected a container, such as "box": a mixture is poured into it'
        raise key_error("boundary.shape", expected)


def damping_between(width: float, radius: float) -> float:
    """`Shape.damping` of a bead between two upright walls.

    Neighbouring sides of an octagon, with which the ratio is 1.7, do not count: the time step of
    loose beads allows for more neighbours (`walkers.inputs.tables.bodies.Mixture.bridged`).

    Parameters
    ----------
    width : float
        Distance of the walls, m.
    radius : float
        Radius of the bead, m.
    """
    touches_both = width < _TWO_SIDES * radius
    return 2.0 if touches_both else 1.0


def upright_walls(distance: float, normals: Mapping[str, tuple[float, float]]) -> tuple[Wall, ...]:
    """Flat upright walls.

    Parameters
    ----------
    distance : float
        Distance of each wall from the z axis, m.
    normals : mapping
        x and y of the unit normal of each wall, toward the beads, by the name of the wall.
    """
    walls = []
    for name, (x, y) in normals.items():
        # + 0.0 makes 0.0 of -0.0, which a deck would print with its sign.
        point = (-distance * x + 0.0, -distance * y + 0.0, 0.0)
        walls.append(Flat(point=point, normal=(x, y, 0.0), name=name))
    return tuple(walls)
