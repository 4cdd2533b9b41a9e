"""Vessels of the user's own: a mesh file becomes a clean surface, and the surface becomes walls.

A bead touches a surface wherever its distance has a local minimum. Of a surface of flat faces these are points within
faces, and points of edges and corners that stand out toward the beads: each such part is a `Facet`, and says of a bead
whether the nearest point is in it. A point where facets meet is in one of them alone, so that no contact counts twice.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cached_property, lru_cache
from io import StringIO
from itertools import pairwise
from math import cos, inf, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.errors import InputError, unusable
from walkers.inputs.drive import Vector
from walkers.physics.bridge import FloatArray

if TYPE_CHECKING:
    import pyvista as pv

IntArray = npt.NDArray[np.int64]
Half = tuple[Vector, Vector, float]
"""A point, a direction and a bound: a place is in it if its offset from the point is above the bound along it."""
SHARP = radians(44.9)
"""Faces of a convex vessel that turn by less at an edge cannot be planes without end: a bead near one of them would
have a bridge to the other behind the edge. Its gap there is R/cos - R, at 45° 0.41 R, beyond the reach of bridges."""
MOST_TRIANGLES = 20_000
_SAME = 1e-6  # of the extent of a surface: points that are nearer are one
_COPLANAR = cos(1e-3)
_UPRIGHT = 1e-3  # largest vertical part of a normal
_CLOSED, _ACROSS = -3e-308, -1e-12  # bounds of halves: the border is in it; triangles of one face overlap (m)


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


def read_mesh(path: Path) -> dict[str, Any]:
    """Points (in the file's unit) and triangles of a mesh file; raises `ValueError` if it has none."""
    import meshio

    if not path.is_file():
        raise ValueError("no such file; expected a mesh, a path from the case file")
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            mesh = meshio.read(path)
        points = np.asarray(mesh.points)
        digits = 7 if points.dtype.itemsize == 4 else 15  # 2.65, not 2.6500000953; of either byte order
        parts = []
        for block in mesh.cells:
            sides = {"triangle": 3, "quad": 4}.get(block.type.rstrip("0123456789"), 0)
            sides = len(block.data[0]) if block.type == "polygon" else sides
            corners = np.array(block.data, dtype=np.int64)[:, :sides]
            parts += [corners[:, [0, side - 1, side]] for side in range(2, sides)]
        given = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
        triangles = np.concatenate([np.empty((0, 3), dtype=np.int64), *parts])
        exact = [[float(f"{x:.{digits}g}") for x in point] for point in given.tolist()]
    except (Exception, SystemExit) as error:  # meshio ends the process where a file is not of its format
        raise ValueError("cannot be read: expected a mesh that meshio reads (STL, OBJ, PLY, …)") from error
    if not 3 < len(triangles) <= MOST_TRIANGLES:
        expected = f"expected the inner surface of a vessel, 4 to {MOST_TRIANGLES}"
        raise ValueError(f"has {len(triangles)} triangles; {expected}")
    return {"points": exact, "triangles": triangles.tolist()}


def _broken(problem: str, point: FloatArray, expected: str) -> InputError:
    place = ", ".join(f"{1e3 * x + 0.0:.4g}" for x in point)
    return unusable("boundary.mesh", f"{problem} at ({place}) mm; expected {expected}")


@dataclass(frozen=True)
class Vessel:
    """A surface around the beads: points (m), shape (P, 3), and triangles, counterclockwise as seen from the beads."""

    points: FloatArray
    triangles: IntArray

    @cached_property
    def normals(self) -> FloatArray:
        """Of the triangles, toward the beads, shape (T, 3)."""
        first, second, third = self.points[self.triangles.T]
        area = np.cross(second - first, third - first)
        normals: FloatArray = area / np.linalg.norm(area, axis=1, keepdims=True)
        return normals

    @cached_property
    def sharing(self) -> dict[frozenset[int], list[tuple[int, int]]]:
        """Triangles at each edge, with the side of the triangle that it is."""
        triangles_at: dict[frozenset[int], list[tuple[int, int]]] = defaultdict(list)
        for number, corners in enumerate(self.triangles.tolist()):
            for side in range(3):
                triangles_at[frozenset((corners[side], corners[(side + 1) % 3]))].append((number, side))
        return dict(triangles_at)

    def _ends(self, triangle: int, side: int) -> tuple[int, int]:
        corners = self.triangles[triangle]
        return int(corners[side]), int(corners[(side + 1) % 3])

    @cached_property
    def _neighbours(self) -> IntArray:
        """Pairs of triangles with an edge in common, shape (E, 2)."""
        pairs = [[triangle for triangle, _ in pair] for pair in self.sharing.values() if len(pair) == 2]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def parts(self) -> IntArray:
        """Number of the connected part of each triangle, shape (T,)."""
        return _joined(self._neighbours, len(self.triangles))

    @cached_property
    def faces(self) -> IntArray:
        """Number of the first triangle of the face of each: connected ones in the plane of the first.

        Not of neighbours: triangles of a shallow dish turn by little from one to the next, and are no plane.
        """
        beside: dict[int, list[int]] = defaultdict(list)
        for first, second in self._neighbours.tolist():
            beside[first].append(second)
            beside[second].append(first)
        faces = np.full(len(self.triangles), -1)
        for seed in range(len(faces)):
            todo = [seed] if faces[seed] < 0 else []
            while todo:
                faces[triangle := todo.pop()] = seed
                new = [neighbour for neighbour in beside[triangle] if faces[neighbour] < 0]
                todo += [neighbour for neighbour in new if self.normals[seed] @ self.normals[neighbour] > _COPLANAR]
        return faces

    @cached_property
    def rims(self) -> list[list[int]]:
        """Points along each opening."""
        follows = dict(self._ends(*shared[0]) for shared in self.sharing.values() if len(shared) == 1)
        rims = []
        while follows:
            rims.append([first := next(iter(follows))])
            while (point := follows.pop(rims[-1][-1], first)) != first:
                rims[-1].append(point)
        return rims

    @cached_property
    def height(self) -> float:
        """Of the lowest point of the rim, or of the top of a closed vessel, m."""
        return float(min((self.points[rim, 2].min() for rim in self.rims), default=self.points[:, 2].max()))

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
        """Volume below a level (m), m³."""
        outward = Vessel(self.capped.points, self.capped.triangles[:, ::-1]).surface
        return float(outward.clip_closed_surface("-z", origin=(0.0, 0.0, min(level, self.height))).volume)

    def clearance(self, places: FloatArray) -> FloatArray:
        """Distance of places from the surface, shape (n,), m, negative outside; above the rim it is open."""
        import pyvista as pv

        def distances(vessel: Vessel, of: FloatArray) -> FloatArray:
            return np.array(pv.PolyData(of).compute_implicit_distance(vessel.surface)["implicit_distance"])

        below = places.copy()
        below[:, 2] = np.minimum(below[:, 2], self.height - 1e-3 * np.ptp(self.points[:, 2]))
        return np.copysign(distances(self, places), distances(self.capped, below))

    @property
    def surface(self) -> pv.PolyData:
        """The surface as pyvista has it."""
        import pyvista as pv

        surface: pv.PolyData = pv.PolyData.from_regular_faces(self.points, self.triangles.tolist())
        return surface

    def planes(self) -> list[tuple[Vector, Vector]]:
        """Points and normals of the planes that are the same vessel, the floor first; empty if there are none.

        There are none if faces turn at an edge by less than `SHARP`, or flare at the rim: planes go on above it.
        """
        at_rim = np.isin(self.triangles, [point for rim in self.rims for point in rim]).any(axis=1)
        flared = (np.abs(self.normals[at_rim, 2]) > _UPRIGHT).any()
        edges = [pair for pair in self.sharing.values() if len({self.faces[triangle] for triangle, _ in pair}) == 2]
        obtuse = any(
            self.normals[before] @ self.normals[after[0]] > cos(SHARP)
            or self._inward(*after) @ self.normals[before] <= 0.0
            for (before, _), after in edges
        )
        if flared or obtuse:
            return []
        faces = self._in_order()
        through = zip(self.normals[faces], self.points[self.triangles[faces, 0]], strict=True)
        return [(_vector((normal @ point) * normal), _vector(normal)) for normal, point in through]

    def _in_order(self) -> list[int]:
        """The faces, first a level one at the bottom, if there is any."""
        faces = list(dict.fromkeys(self.faces.tolist()))
        bottom = _SAME * float(np.ptp(self.points, axis=0).max())
        upward = [face for face in faces if self.normals[face, 2] > _COPLANAR]
        level = [face for face in upward if self.points[self.triangles[self.faces == face], 2].max() < bottom]
        return [*level[:1], *(face for face in faces if face not in level[:1])]

    def _inward(self, triangle: int, side: int) -> FloatArray:
        """Unit vector in a triangle across one of its sides."""
        begin, end = self.points[[*self._ends(triangle, side)]]
        across = np.cross(self.normals[triangle], end - begin)
        unit: FloatArray = across / np.linalg.norm(across)
        return unit

    @cached_property
    def facets(self) -> tuple[Facet, ...]:
        """Its faces, the floor first, then the edges and corners that stand out."""
        return (*self._faces(), *self._edges_and_corners())

    def _edges_and_corners(self) -> Iterator[Facet]:
        standing: list[frozenset[int]] = []
        for edge, shared in self.sharing.items():
            if len(shared) == 2:
                (before, _), after = shared
                if self.faces[before] == self.faces[after[0]] or self._inward(*after) @ self.normals[before] >= 0.0:
                    continue
            standing.append(edge)
            begin, end = self._ends(*shared[0])
            first, last = self.points[begin], self.points[end]
            halves = [(first, last - first), (last, first - last)]
            halves += [(self.points[self._ends(*at)[0]], -self._inward(*at)) for at in shared]
            cell = tuple((_vector(point), _vector(inward), 0.0) for point, inward in halves)
            along = _vector((last - first) / np.linalg.norm(last - first))
            yield Facet("edge", _vector(first), along, (cell,), f"edge {len(standing)}")
        corners = sorted({point for edge in standing for point in edge})
        for number, corner in enumerate(corners, 1):
            neighbours = sorted(neighbour for edge in self.sharing if corner in edge for neighbour in edge - {corner})
            at = self.points[corner]
            cell = tuple((_vector(at), _vector(at - self.points[neighbour]), _CLOSED) for neighbour in neighbours)
            yield Facet("corner", _vector(at), (0.0, 0.0, 0.0), (cell,), f"corner {number}")

    def _faces(self) -> Iterator[Facet]:
        for number, face in enumerate(self._in_order()):
            cells = []
            for triangle in np.flatnonzero(self.faces == face).tolist():
                halves = []
                for side in range(3):
                    begin, end = self._ends(triangle, side)
                    pair = self.sharing[frozenset((begin, end))]
                    within = len(pair) > 1 and all(self.faces[neighbour] == face for neighbour, _ in pair)
                    inward = _vector(self._inward(triangle, side))
                    halves.append((_vector(self.points[begin]), inward, _ACROSS if within else _CLOSED))
                cells.append(tuple(halves))
            point, normal = _vector(self.points[self.triangles[face, 0]]), _vector(self.normals[face])
            yield Facet("face", point, normal, tuple(cells), named(normal, number))


def _vector(array: FloatArray) -> Vector:
    x, y, z = (array + 0.0).tolist()
    return (x, y, z)


def named(normal: Vector, number: int) -> str:
    """Name of a wall by its side, or by its number in the vessel: the first is the floor if it is level."""
    level = {(0.0, 0.0, 1.0): "floor"} if number == 0 else {}
    sides = {(1.0, 0.0, 0.0): "-x", (-1.0, 0.0, 0.0): "+x", (0.0, 1.0, 0.0): "-y", (0.0, -1.0, 0.0): "+y"}
    return (sides | level).get(tuple(round(x, 9) + 0.0 for x in normal), f"face {number + 1}")  # type: ignore[arg-type]


# --- from a file ------------------------------------------------------------------------------------------------------


def vessel_of(mesh: Mapping[str, Any], scale: float) -> Vessel:
    """A vessel of a mesh (`read_mesh`) in units of a length (m), its lowest point at z = 0, about the z axis."""
    return _vessel_of(*(np.array(mesh[name]).tobytes() for name in ("points", "triangles")), scale)


@lru_cache(maxsize=16)
def _vessel_of(point_bytes: bytes, triangle_bytes: bytes, scale: float) -> Vessel:
    given = np.frombuffer(point_bytes).reshape(-1, 3), np.frombuffer(triangle_bytes, dtype=np.int64).reshape(-1, 3)
    points, triangles = _merged(scale * given[0], given[1])
    vessel = _oriented(Vessel(points, triangles))
    _check_crossings(vessel)
    if vessel.height <= points[:, 2].min() + _SAME * np.ptp(points):
        lowest = vessel.points[vessel.rims[0]]
        lowest = lowest[lowest[:, 2].argmin()]
        raise _broken("is open at its lowest point,", lowest, "a closed bottom: beads would fall out")
    low, high = points.min(axis=0), points.max(axis=0)
    middle = np.array([*(low + high)[:2] / 2.0, low[2]])
    return Vessel(np.array([[float(f"{x:.12g}") for x in point] for point in points - middle]), vessel.triangles)


def _joined(pairs: IntArray, count: int) -> IntArray:
    """Number of the group of each of a count of points or triangles that pairs join, shape (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return np.asarray(connected_components(graph)[1])


def _merged(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The points, those that are nearly the same as one, and the triangles that are left, each once."""
    from scipy.spatial import cKDTree

    near = _SAME * float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    _, first, same = np.unique(_joined(pairs, len(points)), return_index=True, return_inverse=True)
    triangles = same[triangles]
    sides = points[first][triangles] - np.roll(points[first][triangles], -1, axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    wide = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > near * longest
    _, once = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    triangles = triangles[[number for number in sorted(once) if wide[number]]]
    if not len(triangles):
        raise unusable("boundary.mesh", "has no triangles of any size; expected the inner surface of a vessel")
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[first][used], renumbered.reshape(-1, 3)


def _oriented(vessel: Vessel) -> Vessel:
    """The vessel with all triangles counterclockwise as seen from the beads: within the largest part, about others."""
    for edge, pair in vessel.sharing.items():
        if len(pair) > 2:
            middle = vessel.points[[*edge]].mean(axis=0)
            raise _broken(f"has {len(pair)} triangles at an edge,", middle, "two: give sheets a thickness")
    consistent = vessel.surface.compute_normals(point_normals=False, split_vertices=False, auto_orient_normals=False)
    turned = Vessel(vessel.points, consistent.regular_faces)
    for pair in turned.sharing.values():
        if len(pair) == 2 and turned._ends(*pair[0]) == turned._ends(*pair[1]):
            where = turned.points[turned.triangles[pair[1][0], 0]]
            raise _broken("has a surface of one side alone,", where, "one with an inside and an outside")
    rims, parts = turned.rims, turned.parts
    if len(rims) > 1:
        lowest = min((turned.points[rim][turned.points[rim, 2].argmin()] for rim in rims), key=lambda point: point[2])
        raise _broken(f"has {len(rims)} openings, the lowest", lowest, "one, at its top: close the others")
    corners = turned.capped.points[turned.capped.triangles]
    volumes = np.einsum("tx,tx->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    at_rim = parts[turned.sharing[frozenset(rims[0][:2])][0][0]] if rims else 0
    sizes = np.bincount(np.append(parts, np.full(len(volumes) - len(parts), at_rim)), volumes)
    outer = int(np.abs(sizes).argmax())
    if rims and at_rim != outer:
        raise _broken("has an opening in an inner part", turned.points[rims[0][0]], "closed parts within the vessel")
    back = (sizes[parts] > 0.0) == (parts == outer)
    return Vessel(turned.points, np.where(back[:, None], turned.triangles[:, ::-1], turned.triangles))


def _check_crossings(vessel: Vessel) -> None:
    """Refuse triangles that intersect, by separating axes: normals, sides across them, and sides across sides."""
    corners = vessel.points[vessel.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = 1e-7 * float(np.ptp(vessel.points, axis=0).max())
    rows = np.arange(len(corners))
    for some in np.array_split(rows, 1 + len(rows) ** 2 // 1_000_000):
        near = np.all((low[some, None] <= high) & (high[some, None] >= low), axis=2) & (some[:, None] < rows)
        rows_1, rows_2 = (of[at] for of, at in zip((some, rows), np.nonzero(near), strict=True))
        first, second, sides = corners[rows_1], corners[rows_2], np.roll(corners, -1, axis=1) - corners
        normal, normals = vessel.normals[rows_1][:, None], vessel.normals[rows_2][:, None]
        level = np.abs(np.einsum("nkx,nx->nk", second - first[:, :1], normal[:, 0])).max(axis=1) < slack
        across = np.cross(sides[rows_1][:, :, None], sides[rows_2][:, None]).reshape(-1, 9, 3)
        out = np.concatenate([normal, normals, across], axis=1)
        out[level] = 0.0  # of triangles in a plane only axes in it separate
        axes = np.concatenate([out, np.cross(sides[rows_1], normal), np.cross(sides[rows_2], normals)], axis=1)
        size = np.linalg.norm(axes, axis=2)
        none = size < 1e-6 * size.max(axis=1, keepdims=True, initial=0.0)
        axes /= np.where(none, 1.0, size)[..., None]
        spans = [np.einsum("nkx,nax->nak", corners_of, axes) for corners_of in (first, second)]
        apart = np.maximum(spans[0].min(2) - spans[1].max(2), spans[1].min(2) - spans[0].max(2))
        for pair in np.flatnonzero(np.where(none, -inf, apart).max(axis=1, initial=-inf) < -slack):
            middle = np.concatenate([first[pair], second[pair]]).mean(axis=0)
            overlap = "overlap in a plane" if level[pair] else "intersect"
            raise _broken(f"has triangles that {overlap},", middle, "a surface that does not cross itself")


# --- from planes ------------------------------------------------------------------------------------------------------


def vessel_between(planes: Sequence[tuple[Vector, Vector]], height: float) -> Vessel:
    """The vessel that planes enclose up to a height (m); raises `InputError` if they enclose none."""
    from scipy.optimize import linprog
    from scipy.spatial import HalfspaceIntersection

    far = 1e3 * height
    ends = [((0.0, 0.0, height), (0.0, 0.0, -1.0))]
    ends += [(tuple(-far * axis), tuple(axis)) for axis in np.array([*np.eye(3), *-np.eye(3)[:2]])]
    points, normals = (np.array(column) for column in zip(*planes, *ends, strict=True))
    offsets = np.einsum("px,px->p", normals, points)
    spheres = np.column_stack([-normals, np.ones(len(normals))])  # the largest one between them is in the middle
    best = linprog([0, 0, 0, -1], spheres, -offsets, bounds=[(None, None)] * 3 + [(0, None)])
    if best.status or best.x[3] < 1e-9:
        raise unusable("boundary.planes", "enclose nothing; expected normals toward the beads, and a height above them")
    room = HalfspaceIntersection(np.column_stack([-normals, offsets]), best.x[:3])
    corners = room.intersections
    if np.abs(corners).max() > 0.999 * far:
        out = corners[np.abs(corners).max(axis=1).argmax()]
        side = f"{'-+'[int(out[abs(out).argmax()] > 0.0)]}{'xyz'[int(abs(out).argmax())]}"
        raise unusable("boundary.planes", f"are open toward {side}; expected planes that close the vessel")
    triangles: list[list[int]] = []
    for number, normal in enumerate(normals[: len(planes)]):
        held = np.array([place for place, meeting in enumerate(room.dual_facets) if number in meeting])
        if len(held) < 3:
            raise unusable(f"boundary.planes[{number}]", "is behind the others; expected planes that beads can touch")
        spokes = corners[held] - corners[held].mean(axis=0)
        around = held[np.argsort(np.arctan2(spokes @ np.cross(normal, spokes[0]), spokes @ spokes[0]))]
        triangles += [[around[0], *pair] for pair in pairwise(around[1:])]
    merged, kept = _merged(corners, np.array(triangles))
    return Vessel(merged, kept)
