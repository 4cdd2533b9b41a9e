"""Facets: the walls of a surface of triangles (`walkers.inputs.tables.shapes.walls.Wall`)."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.text import numbers_text


class HalfSpace(NamedTuple):
    """The places whose offset from a point along a direction is above a bound.

    Attributes
    ----------
    point
        The point, m.
    direction
        The direction, a vector of any length.
    bound
        The bound of the scalar product of offset and direction, in m times the length of the
        direction.
    """

    point: Vector
    direction: Vector
    bound: float


class Facet(NamedTuple):
    """A part of a surface: a face, an edge or a corner.

    Attributes
    ----------
    kind
        ``face``, ``edge`` or ``corner``.
    point
        A point of it, m.
    direction
        A unit vector: of a face the normal toward the beads, of an edge its direction. Zero for a
        corner.
    cells
        Groups of half-spaces. The facet has the nearest point of the surface for the beads that
        are in all half-spaces of one of the cells.
    name
        Its name in messages and tables.
    """

    kind: str
    point: Vector
    direction: Vector
    cells: tuple[tuple[HalfSpace, ...], ...]
    name: str

    def offsets(self, places: FloatArray) -> FloatArray:
        """Offsets of places from the plane, line or corner of the facet, shape (..., 3), m."""
        from_point = places - self.point
        direction = np.array(self.direction)
        parallel: FloatArray = (from_point @ direction)[..., None] * direction
        if self.kind == "face":
            return parallel
        return from_point - parallel

    def distances(self, places: FloatArray) -> FloatArray:
        """Distances of places from the facet.

        Parameters
        ----------
        places : ndarray, shape (..., 3)
            Places, m.

        Returns
        -------
        ndarray, shape (...)
            Distances in m; infinite where another facet of the surface is nearer, and behind a
            face.
        """
        within = np.zeros(places.shape[:-1], dtype=bool)
        for cell in self.cells:
            points = np.array([half_space.point for half_space in cell])
            directions = np.array([half_space.direction for half_space in cell])
            bounds = np.array([half_space.bound for half_space in cell])
            offsets = np.einsum("...hx,hx->...h", places[..., None, :] - points, directions)
            within |= np.all(offsets > bounds, axis=-1)
        if self.kind == "face":
            within &= (places - self.point) @ np.array(self.direction) > 0.0
        return np.where(within, np.linalg.norm(self.offsets(places), axis=-1), inf)

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors from the facet to places, shape (..., 3)."""
        offsets = self.offsets(places)
        return np.asarray(offsets / np.linalg.norm(offsets, axis=-1, keepdims=True))

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """The points of its plane, line or corner nearest to places, shape (..., 3), m."""
        return places - self.offsets(places)

    def deck_words(self) -> str:
        """Empty: the deck does not name the facet, which stands in the file of facets."""
        return ""

    def file_rows(self) -> str:
        """Its lines in the file of facets, which the engine reads; lengths in m.

        The first line has the kind, the point and the direction (three numbers each) and the number
        of cells. A line for each cell follows: the number of its half-spaces, and for each of them
        its point, its direction and its bound, seven numbers.
        """
        place = f"{numbers_text(self.point)}  {numbers_text(self.direction)}"
        lines = [f"{self.kind} {place}  {len(self.cells)}\n"]
        for cell in self.cells:
            texts = []
            for point, direction, bound in cell:
                texts.append(numbers_text((*point, *direction, bound)))
            lines.append(f"{len(cell)}  {'  '.join(texts)}\n")
        return "".join(lines)

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """No planes: pictures show the triangles of the surface."""
        return np.empty((0, 3)), np.empty((0, 3))

    def kernel_row(self) -> None:
        """None: the second engine does not know facets."""
