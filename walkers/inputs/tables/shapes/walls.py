"""Walls: planes, the inside of upright cylinders, and the facets of surfaces of triangles."""

from __future__ import annotations

from math import inf
from typing import NamedTuple, TypeAlias

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.inputs.meshes.wall_names import FLOOR_NAME

FLOOR = FLOOR_NAME
Half = tuple[Vector, Vector, float]
"""A point, a direction and a bound: a place is in it if its offset from the point is above the bound along it."""


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


Wall: TypeAlias = Flat | Round | Facet
BOTTOM = Flat((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""The floor of all boundaries with a floor, in their own frame."""
