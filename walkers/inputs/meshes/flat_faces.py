"""Triangles of a surface, joined to faces that are flat."""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple

import numpy as np

from walkers.arrays import FloatArray, IntArray

LEAST_STEP = 1e-9
"""Distance from the plane of a face within which all of its corners are, m.

Beads overlap with walls by some 0.1 µm at rest, so a step of 1 nm between two faces is no
obstacle. A limit of angles would not do: planes of a finely meshed curve would leave it by
micrometres."""
_ROUNDING = 6e-8
"""Rounding of corners in single precision, over the extent of a surface."""
_MOST_FITS = 20
"""Largest number of planes that are fitted to a growing face."""


class FittedPlane(NamedTuple):
    """The plane of a face: a point (m), and its unit normal toward the beads, shape (3,) each."""

    point: FloatArray
    normal: FloatArray


class FlatFaces:
    """Triangles of a surface, joined to faces that are flat.

    Parameters
    ----------
    points : ndarray, shape (P, 3)
        Corners of the triangles, m.
    triangles : ndarray, shape (T, 3)
        Numbers of the corners of each triangle.
    area_vectors : ndarray, shape (T, 3)
        Normals of the triangles, toward the beads, as long as twice their areas, m².
    neighbours : ndarray, shape (E, 2)
        Pairs of triangles with an edge in common.
    """

    def __init__(
        self,
        points: FloatArray,
        triangles: IntArray,
        area_vectors: FloatArray,
        neighbours: IntArray,
    ) -> None:
        self.points = points
        self.triangles = triangles
        self.areas = np.linalg.norm(area_vectors, axis=1) / 2.0
        self.normals = area_vectors / (2.0 * self.areas[:, None])
        self.limit = max(LEAST_STEP, _ROUNDING * float(np.ptp(points, axis=0).max()))
        # Lists of numbers are faster than arrays where triangles are looked at one by one.
        self.point_list = points.tolist()
        self.corner_lists = triangles.tolist()
        self.normal_list = self.normals.tolist()
        self.faces = np.full(len(self.corner_lists), -1)
        self.neighbours_of: dict[int, list[int]] = defaultdict(list)
        for first, second in neighbours.tolist():
            self.neighbours_of[first].append(second)
            self.neighbours_of[second].append(first)

    def grown(self) -> tuple[IntArray, dict[int, FittedPlane]]:
        """Let faces grow from triangles, the largest ones first. Call it once.

        Returns
        -------
        faces : ndarray, shape (T,)
            Number of the face of each triangle. A face has the number of its largest triangle.
        planes : dict of int to Plane
            Planes of the faces by their numbers.
        """
        planes = {}
        for seed in np.argsort(-self.areas, kind="stable").tolist():
            if self.faces[seed] >= 0:
                continue
            plane = FittedPlane(self.points[self.corner_lists[seed][0]], self.normals[seed])
            members = self._connected(seed, plane)
            for _ in range(_MOST_FITS):
                if len(members) == 1:
                    break
                # The plane through all members is more exact than that of the first triangle.
                # It replaces the plane only if that adds triangles: faces that are exactly flat
                # keep the plane of their largest triangle.
                fitted_plane = self._fitted_plane(members, plane.normal)
                more_members = self._connected(seed, fitted_plane)
                if len(more_members) <= len(members):
                    break
                members = more_members
                plane = fitted_plane
            self.faces[members] = seed
            planes[seed] = plane
        return self.faces, planes

    def _fitted_plane(self, members: list[int], toward: FloatArray) -> FittedPlane:
        """The plane nearest to the corners of triangles, with a normal toward a direction."""
        corners = self.points[np.unique(self.triangles[members])]
        middle = corners.mean(axis=0)
        normal = np.linalg.svd(corners - middle, full_matrices=False)[2][2]
        return FittedPlane(middle, normal if normal @ toward > 0.0 else -normal)

    def _connected(self, seed: int, plane: FittedPlane) -> list[int]:
        """Triangles in a plane, and of no face yet, that are connected with one of them.

        There are none if the triangle ``seed`` itself is not in the plane.
        """
        point = plane.point.tolist()
        normal = plane.normal.tolist()
        if not self._is_in(seed, point, normal):
            return []
        members = {seed}
        waiting = [seed]
        while waiting:
            for neighbour in self.neighbours_of[waiting.pop()]:
                if neighbour in members or self.faces[neighbour] >= 0:
                    continue
                if self._is_in(neighbour, point, normal):
                    members.add(neighbour)
                    waiting.append(neighbour)
        return sorted(members)

    def _is_in(self, triangle: int, point: list[float], normal: list[float]) -> bool:
        """Whether all corners of a triangle are in a plane, and its normal is not turned over."""
        x, y, z = point
        a, b, c = normal
        for corner in self.corner_lists[triangle]:
            corner_x, corner_y, corner_z = self.point_list[corner]
            offset = (corner_x - x) * a + (corner_y - y) * b + (corner_z - z) * c
            if abs(offset) > self.limit:
                return False
        triangle_a, triangle_b, triangle_c = self.normal_list[triangle]
        return bool(triangle_a * a + triangle_b * b + triangle_c * c > 0.0)
