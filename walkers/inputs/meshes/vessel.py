"""Vessels of the user's own: surfaces of triangles, and the walls that beads touch.

A bead touches a surface wherever its distance has a local minimum. On a surface of flat faces
these are points within faces, and points of edges and corners that stand out toward the beads.
Each of these parts is a `Facet`, which tells whether the point nearest to a bead is in it. A
point where facets meet is in only one of them, so that no contact counts twice.

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
from walkers.inputs.meshes.facet import Facet, HalfSpace
from walkers.inputs.meshes.flat_faces import FittedPlane, FlatFaces
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

Side = tuple[int, int]
"""A side of a triangle: the number of the triangle, and 0, 1 or 2 for the side from that corner
to the next."""
SHARP = radians(44.9)
"""Smallest angle by which faces of a convex vessel turn at an edge if endless planes may replace
them, rad.

At a smaller angle, a bead near one of the planes would have a bridge to the other one behind the
edge. Its gap there is R/cos - R, at 45° 0.41 R, where no bridge reaches."""
_LEVEL = cos(1e-3)
"""Smallest vertical component of the unit normal of a level face."""
_UPRIGHT = 1e-3
"""Largest vertical component of the unit normal of an upright face."""
_WITH_BORDER = -3e-308
"""Bound of a half-space that contains its border: an offset of zero is above this bound."""
_NO_DIRECTION = (0.0, 0.0, 0.0)
"""Direction of the facet of a corner, which has none."""
_OVERLAPPING = -1e-12
"""Bound of half-spaces of neighbouring triangles of a face, which overlap, m."""
_NEAR = 0.3
"""Distance within which the engine looks for facets, in radii of a bead."""
_TOUCHING_BEADS = 200
"""Number of random beads at the surface by which facets near beads are counted."""


@dataclass(frozen=True)
class Vessel:
    """A surface around the beads.

    The part with the opening, or of a closed vessel the largest part, is the vessel itself; other
    parts are bodies in it.

    Attributes
    ----------
    points : ndarray, shape (P, 3)
        Corners of the triangles, m.
    triangles : ndarray, shape (T, 3)
        Numbers of the corners of each triangle, counterclockwise as seen from the beads.
    """

    points: FloatArray
    triangles: IntArray

    # --- triangles, edges and parts -------------------------------------------------------------

    @cached_property
    def _area_vectors(self) -> FloatArray:
        """Normals of the triangles as long as twice their areas (m²), toward the beads, (T, 3)."""
        first, second, third = self.points[self.triangles.T]
        area_vectors: FloatArray = np.cross(second - first, third - first)
        return area_vectors

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the triangles, toward the beads, shape (T, 3)."""
        lengths = np.linalg.norm(self._area_vectors, axis=1, keepdims=True)
        normals: FloatArray = self._area_vectors / lengths
        return normals

    @cached_property
    def sides_at_edges(self) -> dict[frozenset[int], list[Side]]:
        """Sides of triangles at each edge, by its two points: one at an opening, else two."""
        sides: dict[frozenset[int], list[Side]] = defaultdict(list)
        for triangle, corners in enumerate(self.triangles.tolist()):
            for side in range(3):
                edge = frozenset((corners[side], corners[(side + 1) % 3]))
                sides[edge].append((triangle, side))
        return dict(sides)

    def ends(self, side: Side) -> tuple[int, int]:
        """The two points of a side, in the order of its triangle."""
        triangle, first = side
        corners = self.triangles[triangle]
        return int(corners[first]), int(corners[(first + 1) % 3])

    @cached_property
    def neighbours(self) -> IntArray:
        """Pairs of triangles with an edge in common, shape (E, 2)."""
        inner_edges = [sides for sides in self.sides_at_edges.values() if len(sides) == 2]
        pairs = [(first[0], second[0]) for first, second in inner_edges]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def parts(self) -> IntArray:
        """Number of the part of each triangle, shape (T,).

        Triangles of a part are connected by edges.
        """
        return groups_of(self.neighbours, len(self.triangles))

    @cached_property
    def outer(self) -> npt.NDArray[np.bool_]:
        """Whether a triangle is of the vessel itself, and not of a body in it, shape (T,)."""
        for sides in self.sides_at_edges.values():
            if len(sides) == 1:
                at_opening, _ = sides[0]
                return np.asarray(self.parts == self.parts[at_opening])
        sizes = []
        for part in range(self.parts.max() + 1):
            corners = self.points[self.triangles[self.parts == part]].reshape(-1, 3)
            sizes.append(np.linalg.norm(np.ptp(corners, axis=0)))
        return np.asarray(self.parts == int(np.argmax(sizes)))

    # --- faces ----------------------------------------------------------------------------------

    @cached_property
    def _faces_and_planes(self) -> tuple[IntArray, dict[int, FittedPlane]]:
        """Number of the face of each triangle, and the plane of each face."""
        flat_faces = FlatFaces(self.points, self.triangles, self._area_vectors, self.neighbours)
        return flat_faces.grown()

    @property
    def _planes_of_faces(self) -> dict[int, FittedPlane]:
        """The plane of each face by the number of the face."""
        _, planes = self._faces_and_planes
        return planes

    @cached_property
    def faces(self) -> IntArray:
        """Number of the face of each triangle, shape (T,): that of its largest triangle.

        A face is made of connected triangles whose corners are all within 1 nm of one plane, or
        within the rounding of single precision if that is more.
        """
        faces, _ = self._faces_and_planes
        return faces

    @cached_property
    def face_normals(self) -> FloatArray:
        """Unit normal, toward the beads, of the face of each triangle, shape (T, 3).

        The normal of a narrow triangle itself can be far off, because its corners are rounded.
        """
        planes = self._planes_of_faces
        return np.array([planes[face].normal for face in self.faces.tolist()])

    @cached_property
    def _inwards(self) -> FloatArray:
        """Unit vectors in the faces of triangles across their sides, shape (T, 3 sides, 3)."""
        corners = self.points[self.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        across = np.cross(self.face_normals[:, None], sides)
        inwards: FloatArray = across / np.linalg.norm(across, axis=2, keepdims=True)
        return inwards

    def _faces_in_order(self) -> list[int]:
        """Numbers of the faces: a level one at the bottom first, if there is any."""
        faces = list(dict.fromkeys(self.faces.tolist()))
        bottom = next((face for face in faces if self._is_bottom(face)), None)
        if bottom is None:
            return faces
        return [bottom, *(face for face in faces if face != bottom)]

    def _is_bottom(self, face: int) -> bool:
        """Whether a face is level, and the lowest part of the vessel."""
        if self.face_normals[face, 2] <= _LEVEL:
            return False
        lowest = SAME_POINT * float(np.ptp(self.points, axis=0).max())
        return bool(self.points[self.triangles[self.faces == face], 2].max() < lowest)

    def _stands_out(self, first: Side, second: Side) -> bool:
        """Whether the edge of two sides stands out toward the beads."""
        triangle, _ = first
        return bool(self._inwards[second] @ self.face_normals[triangle] < 0.0)

    def planes(self) -> list[tuple[Vector, Vector]]:
        """Planes without end that are equivalent to the vessel.

        Returns
        -------
        list of tuple
            Point (m) and normal of each plane, that of the floor first. Empty if there are no
            such planes: if faces turn at an edge by less than `SHARP`, if an edge stands out
            toward the beads, or if faces are not upright at the rim, above which planes go on.
        """
        if not self._is_upright_at_rim() or self._has_unfit_edge():
            return []
        planes = []
        for face in self._faces_in_order():
            point, normal = self._planes_of_faces[face]
            planes.append((_vector((normal @ point) * normal), _vector(normal)))
        return planes

    def _is_upright_at_rim(self) -> bool:
        """Whether all faces at an opening are upright."""
        rim_points: list[int] = []
        for rim in self.rims:
            rim_points += rim
        at_rim = np.isin(self.triangles, rim_points).any(axis=1)
        leaning = np.abs(self.face_normals[at_rim, 2]) > _UPRIGHT
        return not leaning.any()

    def _has_unfit_edge(self) -> bool:
        """Whether faces turn at an edge by little, or so that it stands out (see `planes`)."""
        for sides in self.sides_at_edges.values():
            if len({self.faces[triangle] for triangle, _ in sides}) != 2:
                continue
            first, second = sides
            normal = self.face_normals[first[0]]
            if normal @ self.face_normals[second[0]] > cos(SHARP):
                return True
            if self._inwards[second] @ normal <= 0.0:
                return True
        return False

    # --- facets ---------------------------------------------------------------------------------

    @cached_property
    def facets(self) -> tuple[Facet, ...]:
        """Its faces, the floor first, then outstanding edges and those of the rim, and corners.

        Only edges and corners that may have the nearest point of the surface for a bead are facets.
        """
        return (*self._face_facets(), *self._edge_facets(), *self._corner_facets())

    def _face_facets(self) -> Iterator[Facet]:
        """The faces, the floor first."""
        faces = self._faces_in_order()
        members: dict[int, list[int]] = defaultdict(list)
        for triangle, face in enumerate(self.faces.tolist()):
            members[face].append(triangle)
        normals = []
        spans = []
        for face in faces:
            normals.append(_vector(self._planes_of_faces[face].normal))
            heights = self.points[self.triangles[members[face]], 2]
            spans.append((float(heights.min()), float(heights.max())))
        has_floor = bool(faces) and self._is_bottom(faces[0])
        names = names_of_faces(normals, spans, floor=has_floor)
        for face, name in zip(faces, names, strict=True):
            cells = tuple(self._cell(triangle) for triangle in members[face])
            point, normal = self._planes_of_faces[face]
            yield Facet("face", _vector(point), _vector(normal), cells, name)

    def _cell(self, triangle: int) -> tuple[HalfSpace, ...]:
        """Where beads are whose nearest point is in a triangle."""
        half_spaces = []
        for side in range(3):
            start, end = self.ends((triangle, side))
            sides = self.sides_at_edges[frozenset((start, end))]
            bound = _WITH_BORDER
            if len(sides) == 2 and self._is_within_face(sides):
                bound = _OVERLAPPING
            inward = _vector(self._inwards[triangle, side])
            half_spaces.append(HalfSpace(_vector(self.points[start]), inward, bound))
        return tuple(half_spaces)

    def _is_within_face(self, sides: Sequence[Side]) -> bool:
        """Whether the two triangles at an edge are of the same face."""
        (first, _), (second, _) = sides
        return bool(self.faces[first] == self.faces[second])

    def _outstanding_edges(self) -> list[list[Side]]:
        """Sides at each edge that stands out toward the beads, and at each edge of the rim."""
        edges = []
        for sides in self.sides_at_edges.values():
            if len(sides) == 2 and (self._is_within_face(sides) or not self._stands_out(*sides)):
                continue
            edges.append(sides)
        return edges

    def _edge_facets(self) -> Iterator[Facet]:
        """The edges that stand out toward the beads, and those of the rim.

        The cell of an edge is between its ends, and beyond it as seen along each of its faces.
        """
        edges = self._outstanding_edges()
        end_points = [self.points[list(self.ends(sides[0]))] for sides in edges]
        spans = [span_text(points[:, 2].tolist()) for points in end_points]
        names = numbered_names([f"edge {span}" for span in spans])
        for sides, (first, last), name in zip(edges, end_points, names, strict=True):
            half_spaces = [
                HalfSpace(_vector(first), _vector(last - first), 0.0),
                HalfSpace(_vector(last), _vector(first - last), 0.0),
            ]
            half_spaces += [self._outside_of(side) for side in sides]
            direction = _vector((last - first) / np.linalg.norm(last - first))
            yield Facet("edge", _vector(first), direction, (tuple(half_spaces),), name)

    def _outside_of(self, side: Side) -> HalfSpace:
        """The places beyond a side of a triangle, as seen along its face."""
        start, _ = self.ends(side)
        return HalfSpace(_vector(self.points[start]), _vector(-self._inwards[side]), 0.0)

    def _corner_facets(self) -> Iterator[Facet]:
        """The corners at the ends of outstanding edges and of those of the rim.

        A bead in the cell of a corner is nearer to it than to any other point of the edges there.
        """
        neighbours: dict[int, set[int]] = defaultdict(set)
        for first, second in self.sides_at_edges:
            neighbours[first].add(second)
            neighbours[second].add(first)
        ends: set[int] = set()
        for sides in self._outstanding_edges():
            ends.update(self.ends(sides[0]))
        corners = sorted(ends)
        spans = [span_text([float(self.points[corner, 2])]) for corner in corners]
        names = numbered_names([f"corner {span}" for span in spans])
        for corner, name in zip(corners, names, strict=True):
            point = self.points[corner]
            cell = []
            for neighbour in sorted(neighbours[corner]):
                away = _vector(point - self.points[neighbour])
                cell.append(HalfSpace(_vector(point), away, _WITH_BORDER))
            yield Facet("corner", _vector(point), _NO_DIRECTION, (tuple(cell),), name)

    # --- the opening, and what is within --------------------------------------------------------

    @cached_property
    def rims(self) -> list[list[int]]:
        """Points along each opening, in the order of the triangles at it."""
        next_points: dict[int, int] = {}
        for sides in self.sides_at_edges.values():
            if len(sides) == 1:
                start, end = self.ends(sides[0])
                next_points[start] = end
        rims = []
        while next_points:
            first = next(iter(next_points))
            rim = [first]
            point = next_points.pop(first)
            while point != first:
                rim.append(point)
                point = next_points.pop(point, first)
            rims.append(rim)
        return rims

    @cached_property
    def height(self) -> float:
        """Height of the lowest point of the rim, or of the top of a closed vessel, m."""
        lowest = (self.points[rim, 2].min() for rim in self.rims)
        return float(min(lowest, default=self.points[:, 2].max()))

    @cached_property
    def facing(self) -> FloatArray:
        """Unit vector out of the opening; zero of a closed vessel."""
        if not self.rims:
            return np.zeros(3)
        rim = self.points[self.rims[0]]  # clockwise, as seen from the beads
        area = np.cross(rim, np.roll(rim, -1, axis=0)).sum(axis=0)
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
        points = list(self.points)
        triangles = list(self.triangles)
        for rim in self.rims:
            middle = len(points)
            for start, end in zip(rim, [*rim[1:], rim[0]], strict=True):
                triangles.append(np.array([end, start, middle]))
            points.append(self.points[rim].mean(axis=0))
        return Vessel(np.array(points), np.array(triangles))

    def volume(self, level: float = inf) -> float:
        """Volume below a level (m), m³; liquid above the lowest point of the rim runs out."""
        capped = self.capped
        outward = Vessel(capped.points, capped.triangles[:, ::-1])
        top = min(level, self.height)
        below = outward.surface.clip_closed_surface("-z", origin=(0.0, 0.0, top))
        return float(below.volume)

    @cached_property
    def _without_bodies(self) -> Vessel:
        """The vessel itself, without the bodies in it."""
        return Vessel(self.points, self.triangles[self.outer])

    @cached_property
    def _distance_from_wall(self) -> Any:
        """VTK's signed distance from the vessel itself, without a lid."""
        return signed_distance(self._without_bodies.surface)

    @cached_property
    def _distance_from_closed(self) -> Any:
        """VTK's signed distance from the vessel itself with its lid."""
        return signed_distance(self._without_bodies.capped.surface)

    @cached_property
    def _distance_from_bodies(self) -> Any | None:
        """VTK's signed distance from the bodies in the vessel; None if there are none."""
        triangles = self.triangles[~self.outer]
        if not len(triangles):
            return None
        return signed_distance(Vessel(self.points, triangles).surface)

    def clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places from the surface.

        Parameters
        ----------
        places : ndarray, shape (n, 3)
            Places, m. Those above the rim are outside unless they are above the opening.

        Returns
        -------
        ndarray, shape (n,)
            Distances in m, negative outside of the vessel and in bodies.
        """
        # These distances are positive on the side of the beads.
        below = places[:, 2] < self.height  # the lowest point of the rim
        inside = np.zeros(len(places), dtype=bool)
        inside[below] = evaluated(self._distance_from_closed, places[below]) > 0.0
        for rim in self.rims:
            inside[~below] |= within_polygon(places[~below, :2], self.points[rim, :2])
        distances = np.abs(evaluated(self._distance_from_wall, places))
        clearance: FloatArray = np.where(inside, distances, -distances)
        bodies = self._distance_from_bodies
        if bodies is not None:
            clearance = np.minimum(clearance, evaluated(bodies, places))
        return clearance

    def facets_near_bead(self, radius: float) -> float:
        """Mean number of facets near a bead of a radius (m) that touches the surface somewhere.

        These are the facets that the engine looks at in each step: their bounding boxes are nearer
        to the surface of the bead than `_NEAR` radii. The beads are placed on the faces at random,
        always with the same seed. Vessels remember the numbers: a run asks for one in each look.
        """
        if radius not in self._facets_near:
            self._facets_near[radius] = self._mean_facets_near_bead(radius)
        return self._facets_near[radius]

    @cached_property
    def _facets_near(self) -> dict[float, float]:
        """The numbers of `facets_near_bead` so far, by the radius (m)."""
        return {}

    def _mean_facets_near_bead(self, radius: float) -> float:
        """Count the facets of `facets_near_bead`."""
        areas = np.linalg.norm(self._area_vectors, axis=1)
        draw = np.random.default_rng(0)
        touched = draw.choice(len(areas), _TOUCHING_BEADS, p=areas / areas.sum())
        shares = draw.dirichlet((1.0, 1.0, 1.0), _TOUCHING_BEADS)
        places = np.einsum("nk,nkx->nx", shares, self.points[self.triangles[touched]])
        places += radius * self.face_normals[touched]
        low, high = self._boxes
        facet_count = 0
        for place in places:
            outside = np.maximum(0.0, np.maximum(low - place, place - high))
            facet_count += int((np.linalg.norm(outside, axis=1) < (1.0 + _NEAR) * radius).sum())
        return facet_count / _TOUCHING_BEADS

    @cached_property
    def _boxes(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest corners of the bounding boxes of F facets, m, shape (F, 3) each."""
        low = []
        high = []
        for facet in self.facets:
            corners: list[Vector] = []
            for cell in facet.cells:
                corners += [half_space.point for half_space in cell]
            points = np.array(corners)
            low.append(points.min(axis=0))
            high.append(points.max(axis=0))
        return np.array(low), np.array(high)

    @property
    def surface(self) -> pv.PolyData:
        """The surface as pyvista has it."""
        import pyvista as pv

        surface: pv.PolyData = pv.PolyData.from_regular_faces(self.points, self.triangles.tolist())
        return surface


def _vector(array: FloatArray) -> Vector:
    """The three components of an array as plain numbers, with 0 for −0."""
    x, y, z = (array + 0.0).tolist()
    return (x, y, z)
