"""Facets: the walls of a surface of triangles (`walkers.inputs.tables.shapes.walls.Wall`)."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from walkers.arrays import FloatArray, Vector

Half = tuple[Vector, Vector, float]
"""A point, a direction and a bound: a place is in it if its offset from the point along the
direction is above the bound."""


def numbers_text(*values: float) -> str:
    """Numbers that the engine reads as the same doubles."""
    return " ".join(repr(float(value)) for value in values)


class Facet(NamedTuple):
    """A part of a surface: ``face``, ``edge`` or ``corner``.

    ``point`` is in it (m); ``along`` is the normal of a face, toward the beads, the direction of an
    edge, zero of a corner. The nearest point of the surface is in it for beads that are in one of
    the ``cells``.
    """

    kind: str
    point: Vector
    along: Vector
    cells: tuple[tuple[Half, ...], ...]
    name: str

    def away(self, places: FloatArray) -> FloatArray:
        """Offset of places from its plane, line or corner, shape (..., 3), m."""
        away, along = places - self.point, np.array(self.along)
        over: FloatArray = (away @ along)[..., None] * along
        return over if self.kind == "face" else away - over

    def distances(self, places: FloatArray) -> FloatArray:
        """Of places, shape (..., 3), m; infinite where another part of the surface is nearer."""
        within = np.zeros(places.shape[:-1], dtype=bool)
        for cell in self.cells:
            points, directions, bounds = (np.array(column) for column in zip(*cell, strict=True))
            offsets = np.einsum("...hx,hx->...h", places[..., None, :] - points, directions)
            within |= np.all(offsets > bounds, axis=-1)
        if self.kind == "face":
            within &= (places - self.point) @ np.array(self.along) > 0.0
        return np.where(within, np.linalg.norm(self.away(places), axis=-1), inf)

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors away from it, of the shape of the places."""
        away = self.away(places)
        return np.asarray(away / np.linalg.norm(away, axis=-1, keepdims=True))

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of its plane, line or corner that are nearest to places, shape (..., 3), m."""
        return places - self.away(places)

    def deck_words(self) -> str:
        """Empty: the facet stands in the file of facets."""
        return ""

    def file_rows(self) -> str:
        """Its line of the file of facets, and one for each cell."""
        place = f"{numbers_text(*self.point)}  {numbers_text(*self.along)}"
        lines = [f"{self.kind} {place}  {len(self.cells)}\n"]
        for cell in self.cells:
            halves = [numbers_text(*point, *direction, bound) for point, direction, bound in cell]
            lines.append(f"{len(cell)}  {'  '.join(halves)}\n")
        return "".join(lines)

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """No planes: pictures show the triangles of the surface."""
        return np.empty((0, 3)), np.empty((0, 3))

    def kernel_row(self) -> None:
        """None: the second engine knows no facets."""
