"""Walls: their protocol, planes, and the inside of upright cylinders.

A boundary consists of walls. `Wall` is all that decks, measurements, pictures and the second engine
ask of a wall; no other module depends on the kind of a wall. Facets, the walls of a surface of
triangles, are in `walkers.inputs.meshes.facet`. A new kind is a class here; the contact model
(`walkers/templates/engine`) and `walkers.second_engine.kernels.separation` need its gap and its
normal.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple, Protocol

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.inputs.meshes.wall_names import FLOOR_NAME
from walkers.text import numbers_text

FLOOR = FLOOR_NAME
"""Name of the wall that is the floor."""
_SIDES = 64
"""Sides of the prism that is drawn for a cylinder."""


class KernelRow(NamedTuple):
    """A wall in the second engine.

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
        """Words of the command ``fix wall/bridge``; empty if the wall is in the file of facets."""

    def file_rows(self) -> str:
        """Lines of the file of facets; empty if the wall stands in the command."""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """Planes that stand for the wall in pictures: points (m) and normals, (K, 3) each."""

    def kernel_row(self) -> KernelRow | None:
        """The wall in the second engine; None if the second engine does not know this kind."""


def _projected(wall: Wall, places: FloatArray) -> FloatArray:
    """Points of a wall without edges that are nearest to places, of the shape of the places, m."""
    points: FloatArray = places - wall.distances(places)[..., None] * wall.normals(places)
    return points


class Flat(NamedTuple):
    """A plane.

    Attributes
    ----------
    point : Vector
        A point of the plane, m.
    normal : Vector
        Unit normal toward the beads.
    name : str
        Name of the wall, such as ``-x``.
    """

    point: Vector
    normal: Vector
    name: str = FLOOR

    def distances(self, places: FloatArray) -> FloatArray:
        """Distances of places, shape (..., 3), from the plane, m; negative behind it."""
        distances: FloatArray = (places - self.point) @ self.normal
        return distances

    def normals(self, places: FloatArray) -> FloatArray:
        """The normal of the plane for each place, of the shape of the places."""
        return 0.0 * places + self.normal

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of the plane that are nearest to places, of the shape of the places, m."""
        return _projected(self, places)

    def deck_words(self) -> str:
        """Words of the command ``fix wall/bridge``: a point and the normal."""
        return f"plane {numbers_text(self.point)}  {numbers_text(self.normal)}"

    def file_rows(self) -> str:
        """Empty: the plane stands in the command."""
        return ""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """The plane itself, arrays of shape (1, 3)."""
        return np.array([self.point]), np.array([self.normal])

    def kernel_row(self) -> KernelRow:
        """The plane in the second engine."""
        return KernelRow(point=self.point, normal=self.normal, radius=0.0)


class Round(NamedTuple):
    """Inside of an upright cylinder about the z axis.

    Attributes
    ----------
    radius : float
        Inner radius, m.
    name : str
        Name of the wall.
    """

    radius: float
    name: str = "side"

    def distances(self, places: FloatArray) -> FloatArray:
        """Distances of places, shape (..., 3), from the cylinder, m; negative outside of it."""
        distances: FloatArray = self.radius - (places[..., 0] ** 2 + places[..., 1] ** 2) ** 0.5
        return distances

    def normals(self, places: FloatArray) -> FloatArray:
        """Unit vectors toward the axis, of the shape of the places."""
        # On the axis there is no direction: the vector is zero there.
        from_axis = np.maximum(self.radius - self.distances(places), 1e-300)
        normals: FloatArray = places * (-1.0, -1.0, 0.0) / from_axis[..., None]
        return normals

    def nearest_points(self, places: FloatArray) -> FloatArray:
        """Points of the cylinder that are nearest to places, of the shape of the places, m."""
        return _projected(self, places)

    def deck_words(self) -> str:
        """Words of the command ``fix wall/bridge``: x and y of the axis, and the radius."""
        return f"cylinder {numbers_text((0.0, 0.0, self.radius))}"

    def file_rows(self) -> str:
        """Empty: the cylinder stands in the command."""
        return ""

    def tangent_planes(self) -> tuple[FloatArray, FloatArray]:
        """The sides of a prism around the cylinder, arrays of shape (64, 3)."""
        angles = 2.0 * pi * (np.arange(_SIDES) + 0.5) / _SIDES
        outward = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
        return self.radius * outward, -outward

    def kernel_row(self) -> KernelRow:
        """The cylinder in the second engine."""
        zero = (0.0, 0.0, 0.0)
        return KernelRow(point=zero, normal=zero, radius=self.radius)


BOTTOM = Flat(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
"""The floor of all boundaries that have one, in the frame of the boundary."""
