"""Vessels of the user's own: surfaces of triangles, and the walls that beads touch.

A bead touches a surface wherever its distance has a local minimum. Of a surface of flat faces these are
points within faces, and points of edges and corners that stand out toward the beads: each such part is a
`Facet`, and says of a bead whether the nearest point is in it. A point where facets meet is in one of them
alone, so that no contact counts twice.

How a mesh file becomes such a surface is in `walkers.inputs.meshes.mesh_surface`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, inf, radians
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray, Vector
from walkers.inputs.meshes.facet import Facet, Half
from walkers.inputs.meshes.flat_faces import FlatFaces
from walkers.inputs.meshes.triangles import (
    SAME_POINT,
    evaluated,
    groups_of,
    signed_distance,
    within_polygon,
)
from walkers.inputs.meshes.wall_names import names_of_faces, numbered_names, span_text

if TYPE_CHECKING:
    import pyvista as pv

SHARP = radians(44.9)
"""Faces of a convex vessel that turn by less at an edge cannot be planes without end: a bead near one of them would
have a bridge to the other behind the edge. Its gap there is R/cos - R, at 45° 0.41 R, beyond the reach of bridges."""
_LEVEL = cos(1e-3)
_UPRIGHT = 1e-3  # largest vertical part of a normal
_CLOSED, _ACROSS = (
    -3e-308,
    -1e-12,
)  # bounds of halves: the border is in it; triangles of one face overlap (m)
_NEAR = 0.3  # radii of a bead: how far the engine looks for facets
_TOUCHING_BEADS = 200  # that stand for all when facets near beads are counted


@dataclass(frozen=True)
class Vessel:
    """A surface around the beads: points (m), shape (P, 3), and triangles, counterclockwise as seen from the beads.

    The part with the opening, or of a closed vessel the largest part, is the vessel; other parts are bodies in it.
    """

    points: FloatArray
    triangles: IntArray

    @cached_property
    def _spans(self) -> FloatArray:
        """Normals of the triangles, toward the beads, of the length of twice their areas (m²), shape (T, 3)."""
        first, second, third = self.points[self.triangles.T]
        spans: FloatArray = np.cross(second - first, third - first)
        return spans

    @cached_property
    def normals(self) -> FloatArray:
        """Of the triangles, toward the beads, shape (T, 3)."""
        normals: FloatArray = self._spans / np.linalg.norm(self._spans, axis=1, keepdims=True)
        return normals

    @cached_property
    def sharing(self) -> dict[frozenset[int], list[tuple[int, int]]]:
        """Triangles at each edge, with the side of the triangle that it is."""
        triangles_at: dict[frozenset[int], list[tuple[int, int]]] = defaultdict(list)
        for number, corners in enumerate(self.triangles.tolist()):
            for side in range(3):
                triangles_at[frozenset((corners[side], corners[(side + 1) % 3]))].append(
                    (number, side)
                )
        return dict(triangles_at)

    def ends(self, triangle: int, side: int) -> tuple[int, int]:
        """The two points of a side of a triangle, in the order of the triangle."""
        corners = self.triangles[triangle]
        return int(corners[side]), int(corners[(side + 1) % 3])

    @cached_property
    def neighbours(self) -> IntArray:
        """Pairs of triangles with an edge in common, shape (E, 2)."""
        pairs = [
            [triangle for triangle, _ in pair] for pair in self.sharing.values() if len(pair) == 2
        ]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def parts(self) -> IntArray:
        """Number of the part of each triangle, shape (T,). Triangles of a part are connected by edges."""
        return groups_of(self.neighbours, len(self.triangles))

    @cached_property
    def outer(self) -> npt.NDArray[np.bool_]:
        """Whether a triangle is of the vessel itself, and not of a body in it, shape (T,)."""
        for shared in self.sharing.values():
            if len(shared) == 1:
                return np.asarray(self.parts == self.parts[shared[0][0]])
        sizes = []
        for part in range(self.parts.max() + 1):
            corners = self.points[self.triangles[self.parts == part]].reshape(-1, 3)
            sizes.append(np.linalg.norm(np.ptp(corners, axis=0)))
        return np.asarray(self.parts == int(np.argmax(sizes)))

    # --- faces --------------------------------------------------------------------------------------------------------

    @cached_property
    def _faces_and_planes(self) -> tuple[IntArray, dict[int, tuple[FloatArray, FloatArray]]]:
        """Number of the face of each triangle, and a point and the normal of the plane of each face."""
        return FlatFaces(self.points, self.triangles, self._spans, self.neighbours).grown()

    @cached_property
    def faces(self) -> IntArray:
        """Number of the largest triangle of the face of each, shape (T,).

        A face is made of connected triangles whose corners are all within 1 nm of one plane, or within the
        rounding of single precision if that is more.
        """
        return self._faces_and_planes[0]

    @cached_property
    def face_normals(self) -> FloatArray:
        """Unit normal, toward the beads, of the face of each triangle, shape (T, 3).

        The normal of a narrow triangle itself can be far off, because its corners are rounded.
        """
        planes = self._faces_and_planes[1]
        return np.array([planes[face][1] for face in self.faces.tolist()])

    @cached_property
    def _inwards(self) -> FloatArray:
        """Unit vectors in the faces of triangles across their sides, shape (T, 3 sides, 3)."""
        corners = self.points[self.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        across = np.cross(self.face_normals[:, None], sides)
        inwards: FloatArray = across / np.linalg.norm(across, axis=2, keepdims=True)
        return inwards

    def _in_order(self) -> list[int]:
        """The faces, first a level one at the bottom, if there is any."""
        faces = list(dict.fromkeys(self.faces.tolist()))
        level = [face for face in faces if self._is_bottom(face)]
        return [*level[:1], *(face for face in faces if face not in level[:1])]

    def _is_bottom(self, face: int) -> bool:
        """Whether a face is level, and the lowest part of the vessel."""
        if self.face_normals[face, 2] <= _LEVEL:
            return False
        lowest = SAME_POINT * float(np.ptp(self.points, axis=0).max())
        return bool(self.points[self.triangles[self.faces == face], 2].max() < lowest)

    def planes(self) -> list[tuple[Vector, Vector]]:
        """Points and normals of planes without end that are equivalent to the vessel, the floor first.

        Empty if there are none: if faces turn at an edge by less than `SHARP`, if an edge stands out
        toward the beads, or if faces are not upright at the rim, above which planes go on.
        """
        at_rim = np.isin(self.triangles, [point for rim in self.rims for point in rim]).any(axis=1)
        not_upright = (np.abs(self.face_normals[at_rim, 2]) > _UPRIGHT).any()
        edges = [
            pair
            for pair in self.sharing.values()
            if len({self.faces[triangle] for triangle, _ in pair}) == 2
        ]
        has_unfit_edge = any(
            self.face_normals[before] @ self.face_normals[after[0]] > cos(SHARP)
            or self._inwards[after] @ self.face_normals[before] <= 0.0
            for (before, _), after in edges
        )
        if not_upright or has_unfit_edge:
            return []
        planes = self._faces_and_planes[1]
        through = [planes[face] for face in self._in_order()]
        return [(_vector((normal @ point) * normal), _vector(normal)) for point, normal in through]

    @cached_property
    def facets(self) -> tuple[Facet, ...]:
        """Its faces, the floor first, then the edges and corners that stand out."""
        edges = list(self._edges())
        return (*self._face_facets(), *edges, *self._corners(edges))

    def _face_facets(self) -> Iterator[Facet]:
        order = self._in_order()
        planes = self._faces_and_planes[1]
        members: dict[int, list[int]] = defaultdict(list)
        for triangle, face in enumerate(self.faces.tolist()):
            members[face].append(triangle)
        heights = [self.points[self.triangles[members[face]], 2] for face in order]
        names = names_of_faces(
            [_vector(planes[face][1]) for face in order],
            [(float(z.min()), float(z.max())) for z in heights],
            floor=bool(order) and self._is_bottom(order[0]),
        )
        for face, name in zip(order, names, strict=True):
            cells = tuple(self._cell(triangle) for triangle in members[face])
            point, normal = planes[face]
            yield Facet("face", _vector(point), _vector(normal), cells, name)

    def _cell(self, triangle: int) -> tuple[Half, ...]:
        """Where beads are whose nearest point is in a triangle."""
        halves = []
        for side in range(3):
            begin, end = self.ends(triangle, side)
            pair = self.sharing[frozenset((begin, end))]
            within = len(pair) == 2 and self.faces[pair[0][0]] == self.faces[pair[1][0]]
            bound = _ACROSS if within else _CLOSED
            halves.append(
                (_vector(self.points[begin]), _vector(self._inwards[triangle, side]), bound)
            )
        return tuple(halves)

    def _standing_edges(self) -> list[list[tuple[int, int]]]:
        """Edges that stand out toward the beads, and those of the rim, by the sides that are there."""
        standing = []
        for shared in self.sharing.values():
            if len(shared) == 2:
                (before, _), after = shared
                same = self.faces[before] == self.faces[after[0]]
                if same or self._inwards[after] @ self.face_normals[before] >= 0.0:
                    continue
            standing.append(shared)
        return standing

    def _edges(self) -> Iterator[Facet]:
        standing = self._standing_edges()
        ends = [self.points[[*self.ends(*shared[0])]] for shared in standing]
        names = numbered_names([f"edge {span_text(points[:, 2].tolist())}" for points in ends])
        for shared, (first, last), name in zip(standing, ends, names, strict=True):
            halves = [(first, last - first), (last, first - last)]
            halves += [(self.points[self.ends(*at)[0]], -self._inwards[at]) for at in shared]
            cell = tuple((_vector(point), _vector(inward), 0.0) for point, inward in halves)
            along = _vector((last - first) / np.linalg.norm(last - first))
            yield Facet("edge", _vector(first), along, (cell,), name)

    def _corners(self, edges: Sequence[Facet]) -> Iterator[Facet]:
        """Corners at the ends of edges that stand out."""
        if not edges:
            return
        beside: dict[int, set[int]] = defaultdict(set)
        for first, second in (tuple(edge) for edge in self.sharing):
            beside[first].add(second)
            beside[second].add(first)
        corners = sorted(
            {point for shared in self._standing_edges() for point in self.ends(*shared[0])}
        )
        names = numbered_names(
            [f"corner {span_text([float(self.points[corner, 2])])}" for corner in corners]
        )
        for corner, name in zip(corners, names, strict=True):
            at = self.points[corner]
            cell = tuple(
                (_vector(at), _vector(at - self.points[neighbour]), _CLOSED)
                for neighbour in sorted(beside[corner])
            )
            yield Facet("corner", _vector(at), (0.0, 0.0, 0.0), (cell,), name)

    # --- the opening, and what is within ------------------------------------------------------------------------------

    @cached_property
    def rims(self) -> list[list[int]]:
        """Points along each opening, in the order of the triangles at it."""
        follows = dict(
            self.ends(*shared[0]) for shared in self.sharing.values() if len(shared) == 1
        )
        rims = []
        while follows:
            rims.append([first := next(iter(follows))])
            while (point := follows.pop(rims[-1][-1], first)) != first:
                rims[-1].append(point)
        return rims

    @cached_property
    def height(self) -> float:
        """Of the lowest point of the rim, or of the top of a closed vessel, m."""
        return float(
            min((self.points[rim, 2].min() for rim in self.rims), default=self.points[:, 2].max())
        )

    @cached_property
    def facing(self) -> FloatArray:
        """Unit vector out of the opening; zero of a closed vessel."""
        if not self.rims:
            return np.zeros(3)
        around = self.points[self.rims[0]]
        area = np.cross(around, np.roll(around, -1, axis=0)).sum(
            axis=0
        )  # clockwise, as seen from the beads
        facing: FloatArray = area / np.linalg.norm(area)
        return facing

    @cached_property
    def opening(self) -> tuple[float, float]:
        """Extent of the opening along x and y, m; zero of a closed vessel."""
        if not self.rims:
            return (0.0, 0.0)
        x, y = np.ptp(self.points[self.rims[0], :2], axis=0).tolist()
        return (x, y)

    @cached_property
    def capped(self) -> Vessel:
        """The vessel with a lid on each opening."""
        points, triangles = [*self.points], [*self.triangles]
        for rim in self.rims:
            sides = zip(rim, [*rim[1:], rim[0]], strict=True)
            triangles += [np.array([end, begin, len(points)]) for begin, end in sides]
            points.append(self.points[rim].mean(axis=0))
        return Vessel(np.array(points), np.array(triangles))

    def volume(self, level: float = inf) -> float:
        """Volume below a level (m), m³; a liquid higher than the lowest point of the rim runs out."""
        outward = Vessel(self.capped.points, self.capped.triangles[:, ::-1]).surface
        return float(
            outward.clip_closed_surface("-z", origin=(0.0, 0.0, min(level, self.height))).volume
        )

    @cached_property
    def _distances(self) -> tuple[Any, Any, Any]:
        """Signed distances of VTK from the vessel without its lid, from it with the lid, and from the bodies in it."""
        outer, bodies = Vessel(self.points, self.triangles[self.outer]), self.triangles[~self.outer]
        within = signed_distance(Vessel(self.points, bodies).surface) if len(bodies) else None
        return signed_distance(outer.surface), signed_distance(outer.capped.surface), within

    def clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places from the surface, shape (n,), m, negative outside.

        Above the rim, places are outside if they are not above the opening.
        """
        wall, closed, bodies = self._distances
        below = places[:, 2] < self.height
        inside = np.zeros(len(places), dtype=bool)
        inside[below] = evaluated(closed, places[below]) > 0.0
        for rim in self.rims:
            inside[~below] |= within_polygon(places[~below, :2], self.points[rim, :2])
        distances = np.abs(evaluated(wall, places))
        clearance: FloatArray = np.where(inside, distances, -distances)
        if bodies is not None:
            clearance = np.minimum(clearance, evaluated(bodies, places))
        return clearance

    def facets_near_bead(self, radius: float) -> float:
        """How many facets are near a bead of a radius (m) that touches the surface somewhere, in the mean.

        These are the facets that the engine looks at in each step: their boxes are nearer than `_NEAR` radii.
        """
        areas = np.linalg.norm(self._spans, axis=1)
        draw = np.random.default_rng(0)
        touched = draw.choice(len(areas), _TOUCHING_BEADS, p=areas / areas.sum())
        shares = draw.dirichlet((1.0, 1.0, 1.0), _TOUCHING_BEADS)
        places = np.einsum("nk,nkx->nx", shares, self.points[self.triangles[touched]])
        places += radius * self.face_normals[touched]
        low, high = self._boxes
        near = 0
        for place in places:
            apart = np.maximum(0.0, np.maximum(low - place, place - high))
            near += int((np.linalg.norm(apart, axis=1) < (1.0 + _NEAR) * radius).sum())
        return near / _TOUCHING_BEADS

    @cached_property
    def _boxes(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest corners of the boxes of the facets, shape (F, 3)."""
        low, high = [], []
        for facet in self.facets:
            corners = np.array([point for cell in facet.cells for point, _, _ in cell])
            low.append(corners.min(axis=0))
            high.append(corners.max(axis=0))
        return np.array(low), np.array(high)

    @property
    def surface(self) -> pv.PolyData:
        """The surface as pyvista has it."""
        import pyvista as pv

        surface: pv.PolyData = pv.PolyData.from_regular_faces(self.points, self.triangles.tolist())
        return surface


def _vector(array: FloatArray) -> Vector:
    x, y, z = (array + 0.0).tolist()
    return (x, y, z)
