"""Walls: planes, the inside of upright cylinders, and the facets of surfaces of triangles.

A boundary is made of walls, and `Wall` is all that decks, measurements, pictures and the second engine
ask of one. No other module asks which kind of wall it has. A new kind is a class here; the contact
model (`walkers/templates/engine`) and `separation` of `walkers.second_engine.kernels` need its formula.
"""

from __future__ import annotations

from math import inf, pi
from typing import NamedTuple, Protocol

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.inputs.meshes.wall_names import FLOOR_NAME

FLOOR = FLOOR_NAME
_SIDES = 64
"""Sides of the prism that is drawn for a cylinder."""
Half = tuple[Vector, Vector, float]
"""A point, a direction and a bound: a place is in it if its offset from the point is above the bound along it."""


class KernelRow(NamedTuple):
    """A wall as the second engine takes it.

    Attributes
    ----------
    point : Vector
        A point of a plane, or of the axis of a cylinder, m.
    normal : Vector
        Unit normal of a plane, toward the beads; zero for a cylinder.
    radius : float
        Inner radius of an upright cylinder, m; zero for a plane.
    """

    point: Vector
    normal: Vector
    radius: float


class Wall(Protocol):
    """What can be asked of a wall. Places are centres of beads in the frame of the boundary, m."""

    @property
    def name(self) -> str:
        """The side where the wall is, such as ``floor`` or ``-x``."""

    def distances(self, places: FloatArray) -> FloatArray:
        """Distance of places from the wall.

        Parameters
        ----------
        places : ndarray, shape (..., 3)
            Places in m.

        Returns
        -------
        ndarray, shape (...)
            Distances in m, negative behind the wall; infinite if no contact is possible there.
        """

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors from the wall to places, shape (..., 3)."""

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of the wall that are nearest to places, shape (..., 3), m."""

    def deck_words(self) -> str:
        """Words of the command ``fix wall/bridge``; empty if the wall stands in the file of facets."""

    def file_rows(self) -> str:
        """Lines of the file of facets; empty if the wall stands in the command."""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """Planes that bound the room in front of the wall in pictures: points (m) and normals, (K, 3) each."""

    def kernel_row(self) -> KernelRow | None:
        """The wall in the second engine; None if the second engine does not know this kind."""


def _numbers(*values: float) -> str:
    """Numbers that the engine reads as the same doubles."""
    return " ".join(repr(float(value)) for value in values)


def _projected(wall: Wall, places: FloatArray) -> FloatArray:
    """The nearest points of a wall without edges."""
    points: FloatArray = places - wall.distances(places)[..., None] * wall.normals(places)
    return points


class Flat(NamedTuple):
    """A plane: point (m), unit normal toward the beads, name."""

    point: Vector
    normal: Vector
    name: str = FLOOR

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m."""
        distances: FloatArray = (places - self.point) @ self.normal
        return distances

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors away from it, of the shape of the places."""
        return 0.0 * places + self.normal

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of the plane that are nearest to places, of the shape of the places, m."""
        return _projected(self, places)

    def deck_words(self) -> str:
        """Words of the command ``fix wall/bridge``: a point and the normal."""
        return f"plane {_numbers(*self.point)}  {_numbers(*self.normal)}"

    def file_rows(self) -> str:
        """Empty: the plane stands in the command."""
        return ""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """The plane itself, arrays of shape (1, 3)."""
        return np.array([self.point]), np.array([self.normal])

    def kernel_row(self) -> KernelRow:
        """The plane in the second engine."""
        return KernelRow(self.point, self.normal, 0.0)


class Round(NamedTuple):
    """Inside of a vertical cylinder around the origin: radius (m), name."""

    radius: float
    name: str = "side"

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m."""
        distances: FloatArray = self.radius - (places[..., 0] ** 2 + places[..., 1] ** 2) ** 0.5
        return distances

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors toward the axis, of the shape of the places."""
        normals: FloatArray = (
            places * (-1.0, -1.0, 0.0) / np.maximum(self.radius - self.distances(places), 1e-300)[..., None]
        )
        return normals

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of the cylinder that are nearest to places, of the shape of the places, m."""
        return _projected(self, places)

    def deck_words(self) -> str:
        """Words of the command ``fix wall/bridge``: x and y of the axis, and the radius."""
        return f"cylinder {_numbers(0.0, 0.0, self.radius)}"

    def file_rows(self) -> str:
        """Empty: the cylinder stands in the command."""
        return ""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """The sides of a prism around the cylinder, arrays of shape (64, 3)."""
        turns = 2.0 * pi * (np.arange(_SIDES) + 0.5) / _SIDES
        outward = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        return self.radius * outward, -outward

    def kernel_row(self) -> KernelRow:
        """The cylinder in the second engine."""
        return KernelRow((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), self.radius)


class Facet(NamedTuple):
    """A part of a surface: ``face``, ``edge`` or ``corner``.

    ``point`` is in it (m); ``along`` is the normal of a face, toward the beads, the direction of an edge, zero of a
    corner. The nearest point of the surface is in it for beads that are in one of the ``cells``.
    """

    kind: str
    point: Vector
    along: Vector
    cells: tuple[tuple[Half, ...], ...]
    name: str

    def away(self, places: FloatArray) -> FloatArray:
        """Offset of places from the nearest point of its plane, line or corner, of the shape of the places, m."""
        away, along = places - self.point, np.array(self.along)
        over: FloatArray = (away @ along)[..., None] * along
        return over if self.kind == "face" else away - over

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m; infinite where another part of the surface is nearer."""
        within = np.zeros(places.shape[:-1], dtype=bool)
        for cell in self.cells:
            points, directions, bounds = (np.array(column) for column in zip(*cell, strict=True))
            within |= np.all(np.einsum("...hx,hx->...h", places[..., None, :] - points, directions) > bounds, axis=-1)
        if self.kind == "face":
            within &= (places - self.point) @ np.array(self.along) > 0.0
        return np.where(within, np.linalg.norm(self.away(places), axis=-1), inf)

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors away from it, of the shape of the places."""
        away = self.away(places)
        return np.asarray(away / np.linalg.norm(away, axis=-1, keepdims=True))

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of its plane, line or corner that are nearest to places, of the shape of the places, m."""
        return places - self.away(places)

    def deck_words(self) -> str:
        """Empty: the facet stands in the file of facets."""
        return ""

    def file_rows(self) -> str:
        """Its line of the file of facets, and one for each cell."""
        lines = [f"{self.kind} {_numbers(*self.point)}  {_numbers(*self.along)}  {len(self.cells)}\n"]
        for cell in self.cells:
            halves = "  ".join(_numbers(*point, *direction, bound) for point, direction, bound in cell)
            lines.append(f"{len(cell)}  {halves}\n")
        return "".join(lines)

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """No planes: pictures show the triangles of the surface."""
        return np.empty((0, 3)), np.empty((0, 3))

    def kernel_row(self) -> None:
        """None: the second engine knows no facets."""


BOTTOM = Flat((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""The floor of all boundaries with a floor, in their own frame."""
