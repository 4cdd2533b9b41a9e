"""Triangles of a surface, joined to faces that are flat."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from walkers.arrays import FloatArray, IntArray

LEAST_STEP = 1e-9
"""Distance from the plane of a face within which all of its corners are, m.

Beads overlap with walls by some 0.1 µm at rest, so a step of 1 nm between two faces is no obstacle. A limit of
angles would not do: planes of a finely meshed curve would leave it by micrometres."""
_ROUNDING = 6e-8  # of the extent of a surface: rounding of corners in single precision
_FITS = 20  # planes that are fitted to a growing face at most


class FlatFaces:
    """Triangles of a surface, joined to faces that are flat."""

    def __init__(
        self, points: FloatArray, triangles: IntArray, spans: FloatArray, neighbours: IntArray
    ) -> None:
        """Of points (m), triangles, their normals of the length of twice their areas, and pairs with an edge."""
        self.points = points
        self.triangles = triangles
        self.areas = np.linalg.norm(spans, axis=1) / 2.0
        self.normals = spans / (2.0 * self.areas[:, None])
        self.limit = max(LEAST_STEP, _ROUNDING * float(np.ptp(points, axis=0).max()))
        self.places = points.tolist()
        self.corners = triangles.tolist()
        self.normal_lists = self.normals.tolist()
        self.faces = np.full(len(self.corners), -1)
        self.beside: dict[int, list[int]] = defaultdict(list)
        for first, second in neighbours.tolist():
            self.beside[first].append(second)
            self.beside[second].append(first)

    def grown(self) -> tuple[IntArray, dict[int, tuple[FloatArray, FloatArray]]]:
        """Face of each triangle, and the planes of the faces. They grow from the largest triangles on."""
        planes = {}
        for seed in np.argsort(-self.areas, kind="stable").tolist():
            if self.faces[seed] >= 0:
                continue
            point = self.points[self.corners[seed][0]]
            normal = self.normals[seed]
            members = self._connected(seed, point, normal)
            for _ in range(_FITS):
                if len(members) == 1:
                    break
                fitted = self._fitted(members, normal)
                more = self._connected(seed, *fitted)
                if len(more) <= len(members):
                    break
                members = more
                point, normal = fitted
            self.faces[members] = seed
            planes[seed] = (point, normal)
        return self.faces, planes

    def _fitted(self, members: list[int], toward: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A point and the normal of the plane that is nearest to the corners of triangles."""
        corners = self.points[np.unique(self.triangles[members])]
        middle = corners.mean(axis=0)
        normal = np.linalg.svd(corners - middle, full_matrices=False)[2][2]
        return middle, normal if normal @ toward > 0.0 else -normal

    def _connected(self, seed: int, point: FloatArray, normal: FloatArray) -> list[int]:
        """Triangles in a plane, and of no face yet, that are connected with one of them; none if that is not in it."""
        through, along = point.tolist(), normal.tolist()
        if not self._is_in(seed, through, along):
            return []
        members = {seed}
        waiting = [seed]
        while waiting:
            for neighbour in self.beside[waiting.pop()]:
                if neighbour in members or self.faces[neighbour] >= 0:
                    continue
                if self._is_in(neighbour, through, along):
                    members.add(neighbour)
                    waiting.append(neighbour)
        return sorted(members)

    def _is_in(self, triangle: int, point: list[float], normal: list[float]) -> bool:
        """Whether all corners of a triangle are in a plane, and its normal is not turned over."""
        (x, y, z), (a, b, c) = point, normal
        for corner in self.corners[triangle]:
            px, py, pz = self.places[corner]
            if abs((px - x) * a + (py - y) * b + (pz - z) * c) > self.limit:
                return False
        triangle_normal = self.normal_lists[triangle]
        return bool(triangle_normal[0] * a + triangle_normal[1] * b + triangle_normal[2] * c > 0.0)
