"""A mesh as the clean inner surface of a vessel, or the reason why it cannot be one.

Points that are nearly the same are merged, triangles are turned toward the beads, and of a solid
the inner skin is taken. Every other surface out of which beads could fall, or whose inside is
doubtful, is refused with the place of the defect.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from functools import lru_cache
from math import cos, radians
from typing import Any, NamedTuple

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.errors import InputError, key_error
from walkers.inputs.meshes.crossings import first_crossing, first_fold
from walkers.inputs.meshes.triangles import SAME_POINT, merged
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.meshes.wall_names import axis_name

_ONE_OPENING = "one, at its top: close the others"
"""What messages about several openings expect."""
_STEEPEST_OPENING = radians(45.0)
"""Largest angle between the vertical and the direction of the opening, rad."""
_DEEPEST_DIP = 0.1
"""Largest distance between points of a rim across its plane, over the height of the vessel."""
_SHALLOWEST_BASIN = 0.05
"""Smallest depth of a hollow that is looked at, over the height of the solid."""
_DEEP_BASIN = 0.5
"""Depth from which a hollow is the inside of a vessel, over the height of the solid."""
_DOUBTFUL_BASIN = 0.2
"""Depth from which a hollow may be the inside of a vessel, over the height of the solid."""
_THINNEST_ROOM = 0.5
"""Smallest volume of a closed vessel over that of its convex hull."""
_AXES = {"+x": (0, 1.0), "-x": (0, -1.0), "+y": (1, 1.0), "-y": (1, -1.0), "-z": (2, -1.0)}
"""Directions in which the inside of a vessel may open by mistake: axis and sign."""


def vessel_of(mesh: Mapping[str, Any], scale: float) -> Vessel:
    """The vessel of a mesh.

    Parameters
    ----------
    mesh : mapping
        Points and triangles, see `walkers.inputs.meshes.mesh_file.read_mesh`.
    scale : float
        Length of the unit of its points, m.

    Returns
    -------
    Vessel
        Its lowest point is at z = 0, and the middle of its extent on the z axis.

    Raises
    ------
    InputError
        If beads would fall out of it, or if the surface is not that of one vessel.
    ValueError
        If a point is not finite, or a triangle has a point that does not exist.
    """
    points = np.array(mesh["points"], dtype=float)
    triangles = np.array(mesh["triangles"], dtype=np.int64)
    if not np.isfinite(points).all() or not 0 <= triangles.min() <= triangles.max() < len(points):
        raise ValueError("expected finite points, and triangles of them")
    return _vessel_of(points.tobytes(), triangles.tobytes(), scale)


@lru_cache(maxsize=16)
def _vessel_of(point_bytes: bytes, triangle_bytes: bytes, scale: float) -> Vessel:
    """The vessel of the bytes of points and triangles, by which it is cached."""
    points = np.frombuffer(point_bytes).reshape(-1, 3)
    triangles = np.frombuffer(triangle_bytes, dtype=np.int64).reshape(-1, 3)
    vessel = _consistent(Vessel(*merged(scale * points, triangles)))
    _check_rims(vessel)
    _check_crossings(vessel)
    if not vessel.rims:
        vessel = _without_skin(vessel)
    vessel = _toward_beads(vessel)
    _check_opening(vessel)
    return _centred(_without_hollows(vessel))


def _centred(vessel: Vessel) -> Vessel:
    """The vessel with its lowest point at z = 0 and its middle on the z axis, to twelve digits."""
    low = vessel.points.min(axis=0)
    high = vessel.points.max(axis=0)
    origin = (low + high) / 2.0
    origin[2] = low[2]
    points = [_with_twelve_digits(point) for point in vessel.points - origin]
    return Vessel(np.array(points), vessel.triangles)


def _with_twelve_digits(point: FloatArray) -> list[float]:
    """The coordinates of a point, rounded."""
    return [float(f"{coordinate:.12g}") for coordinate in point]


def _mesh_error(problem: str, point: FloatArray, expected: str) -> InputError:
    """An error of a mesh with a problem at a point (m), and what is expected instead."""
    place = ", ".join(f"{1e3 * coordinate + 0.0:.4g}" for coordinate in point)
    return key_error("boundary.mesh", f"{problem} at ({place}) mm; expected {expected}")


def _restricted(vessel: Vessel, triangles: IntArray) -> Vessel:
    """A vessel of some triangles, with the points that they need."""
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Vessel(vessel.points[used], renumbered.reshape(-1, 3))


def _consistent(vessel: Vessel) -> Vessel:
    """The vessel with triangles that are all counterclockwise as seen from the same side."""
    for edge, sides in vessel.sides_at_edges.items():
        if len(sides) > 2:
            problem = f"has {len(sides)} triangles at an edge,"
            middle = vessel.points[list(edge)].mean(axis=0)
            raise _mesh_error(problem, middle, "two: give sheets a thickness")
    surface = vessel.surface.compute_normals(
        point_normals=False, split_vertices=False, auto_orient_normals=False
    )
    consistent = Vessel(vessel.points, np.asarray(surface.regular_faces, dtype=np.int64))
    for sides in consistent.sides_at_edges.values():
        if len(sides) == 2 and consistent.ends(sides[0]) == consistent.ends(sides[1]):
            triangle, _ = sides[1]
            corner = consistent.points[consistent.triangles[triangle, 0]]
            problem = "has a surface of one side alone,"
            raise _mesh_error(problem, corner, "one with an inside and an outside")
    return consistent


def _check_rims(vessel: Vessel) -> None:
    """Refuse several openings, also those that meet in a point."""
    starts: Counter[int] = Counter()
    for sides in vessel.sides_at_edges.values():
        if len(sides) == 1:
            start, _ = vessel.ends(sides[0])
            starts[start] += 1
    for point, times in starts.items():
        if times > 1:
            problem = (
                "has openings that meet in a point, or a corner within an edge of another part,"
            )
            raise _mesh_error(problem, vessel.points[point], _ONE_OPENING)
    rims = vessel.rims
    if len(rims) > 1:
        lowest_points = [_lowest(vessel.points[rim]) for rim in rims]
        lowest = min(lowest_points, key=lambda point: point[2])
        raise _mesh_error(f"has {len(rims)} openings, the lowest", lowest, _ONE_OPENING)


def _lowest(points: FloatArray) -> FloatArray:
    """The lowest of some points, shape (3,)."""
    lowest: FloatArray = points[points[:, 2].argmin()]
    return lowest


def _check_crossings(vessel: Vessel) -> None:
    """Refuse triangles that intersect or overlap."""
    crossing = first_fold(vessel) or first_crossing(vessel)
    if crossing:
        relation = "overlap in a plane" if crossing.in_plane else "intersect"
        problem = f"has triangles that {relation},"
        raise _mesh_error(problem, crossing.place, "a surface that does not cross itself")


def _toward_beads(vessel: Vessel) -> Vessel:
    """The vessel with triangles that are counterclockwise as seen from the beads.

    Beads are within the vessel itself, and around the bodies in it.
    """
    volumes = _signed_volumes(vessel.capped) / 6.0
    outer = int(vessel.parts[vessel.outer][0])
    lids = np.full(len(volumes) - len(vessel.parts), outer)
    sizes = np.bincount(np.append(vessel.parts, lids), volumes)
    is_flipped = (sizes[vessel.parts] > 0.0) == vessel.outer
    triangles = np.where(is_flipped[:, None], vessel.triangles[:, ::-1], vessel.triangles)
    return Vessel(vessel.points, triangles)


def _signed_volumes(vessel: Vessel) -> FloatArray:
    """Six times the volumes of the tetrahedra of the origin and each triangle, m³, shape (T,).

    They are positive where the triangle is seen counterclockwise from the side away from the
    origin.
    """
    corners = vessel.points[vessel.triangles]
    products = np.cross(corners[:, 1], corners[:, 2])
    return np.asarray(np.einsum("tx,tx->t", corners[:, 0], products))


def _check_opening(vessel: Vessel) -> None:
    """Refuse an opening that is not at the top, or a rim that dips."""
    if not vessel.rims:
        return
    rim = vessel.points[vessel.rims[0]]
    extent = float(np.ptp(vessel.points, axis=0).max())
    lowest = _lowest(rim)
    if lowest[2] <= vessel.points[:, 2].min() + SAME_POINT * extent:
        expected = "a closed bottom: beads would fall out"
        raise _mesh_error("is open at its lowest point,", lowest, expected)
    middle = rim.mean(axis=0)
    facing = vessel.facing
    if facing[2] < cos(_STEEPEST_OPENING):
        problem = f"has an opening that faces {axis_name(facing)},"
        expected = "one that faces +z, which is up: rotate the mesh, or close a hole in its side"
        raise _mesh_error(problem, middle, expected)
    heights = (rim - middle) @ facing
    if np.ptp(heights) > _DEEPEST_DIP * np.ptp(vessel.points[:, 2]):
        problem = f"has a rim that dips by {1e3 * np.ptp(heights):.3g} mm,"
        expected = "a rim about in one plane: close slots in the walls"
        raise _mesh_error(problem, rim[heights.argmin()], expected)


# --- parts --------------------------------------------------------------------------------------


def _without_hollows(vessel: Vessel) -> Vessel:
    """The vessel with the bodies in it, without hollows in bodies, where no bead gets."""
    numbers = sorted(set(vessel.parts[~vessel.outer].tolist()))
    if not numbers:
        return vessel
    outer = Vessel(vessel.points, vessel.triangles[vessel.outer])
    bodies = {}
    for number in numbers:
        corners = np.unique(vessel.triangles[vessel.parts == number])
        bodies[number] = vessel.points[corners]
        _check_is_within(outer, bodies[number])
    hollows = [number for number in numbers if _is_in_another(vessel, bodies, number)]
    return _restricted(vessel, vessel.triangles[~np.isin(vessel.parts, hollows)])


def _check_is_within(outer: Vessel, body: FloatArray) -> None:
    """Refuse a body, by its points (m), that is not within a vessel."""
    below_rim = body[body[:, 2] < outer.height]
    farthest = _lowest(body)
    if len(below_rim):
        clearances = outer.clearance(below_rim)
        farthest_number = np.abs(clearances).argmax()
        if clearances[farthest_number] > 0.0:
            return
        farthest = below_rim[farthest_number]
    place = "above" if body[:, 2].min() >= outer.height else "beside"
    problem = f"has a closed part {place} the vessel,"
    raise _mesh_error(problem, farthest, "parts within it: one vessel a file")


def _is_in_another(vessel: Vessel, bodies: Mapping[int, FloatArray], number: int) -> bool:
    """Whether a body in a vessel is within another one.

    Parameters
    ----------
    vessel
        The vessel with its bodies.
    bodies
        Points of the bodies, m, by the numbers of their parts.
    number
        Number of the body.
    """
    points = bodies[number]
    for other_number, other_points in bodies.items():
        reaches_lower = (points.min(axis=0) < other_points.min(axis=0)).any()
        reaches_higher = (points.max(axis=0) > other_points.max(axis=0)).any()
        if other_number == number or reaches_lower or reaches_higher:
            continue
        triangles = vessel.triangles[vessel.parts == other_number]
        body_as_vessel = Vessel(vessel.points, triangles[:, ::-1])  # a closed vessel
        if body_as_vessel.clearance(points[:1])[0] > 0.0:
            return True
    return False


# --- solids -------------------------------------------------------------------------------------


class _Basin(NamedTuple):
    """A hollow of a solid that is open to the top.

    Attributes
    ----------
    points
        Numbers of its points.
    level
        Height of its rim, m.
    depth
        Depth of its lowest point below the rim, m.
    volume
        Volume of liquid that it holds, m³.
    """

    points: frozenset[int]
    level: float
    depth: float
    volume: float


def _without_skin(vessel: Vessel) -> Vessel:
    """The vessel in a solid whose surface is closed, as CAD programs export it.

    A solid vessel has a deep hollow that is open to the top: its inner skin, up to the rim, is
    the vessel. A closed room has no such hollow: its whole surface is the vessel.
    """
    solid = _outward(_restricted(vessel, vessel.triangles[vessel.outer]))
    height = float(np.ptp(solid.points[:, 2]))
    basin = _largest_basin(solid)
    if basin and basin.depth > _DEEP_BASIN * height:
        skin = _inner_skin(solid, basin)
        bodies = vessel.triangles[~vessel.outer]
        if not len(bodies):
            return skin
        return _joined(skin, _restricted(vessel, bodies))
    if basin and basin.depth > _DOUBTFUL_BASIN * height:
        lowest = min(basin.points, key=lambda point: float(solid.points[point, 2]))
        hollow = f"with a hollow in its top, {1e3 * basin.depth:.3g} mm deep"
        problem = f"is closed, {hollow} (to a slot in its wall?),"
        expected = "the inner surface of a vessel alone, open at its top"
        raise _mesh_error(problem, solid.points[lowest], expected)
    _check_opens_nowhere(solid)
    _check_is_room(solid)
    return vessel


def _joined(first: Vessel, second: Vessel) -> Vessel:
    """A surface of the triangles of two surfaces."""
    points = np.concatenate([first.points, second.points])
    triangles = np.concatenate([first.triangles, len(first.points) + second.triangles])
    return Vessel(points, triangles)


def _outward(closed: Vessel) -> Vessel:
    """A closed surface whose triangles are counterclockwise as seen from outside."""
    if _volume(closed) > 0.0:
        return closed
    return Vessel(closed.points, closed.triangles[:, ::-1])


def _check_opens_nowhere(solid: Vessel) -> None:
    """Refuse a solid vessel that opens in another direction than up."""
    for name, (axis, sign) in _AXES.items():
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        turned_points = solid.points[:, order] * [sign, 1.0, sign]  # `name` is up
        basin = _largest_basin(Vessel(turned_points, solid.triangles))
        if basin and basin.depth > _DEEP_BASIN * np.ptp(turned_points[:, 2]):
            problem = f"is a solid whose inside opens toward {name},"
            at_opening = solid.points[turned_points[:, 2].argmax()]
            expected = "an opening toward +z, which is up: rotate the mesh"
            raise _mesh_error(problem, at_opening, expected)


def _check_is_room(solid: Vessel) -> None:
    """Refuse a closed surface that is a wall with a thickness rather than a room."""
    from scipy.spatial import ConvexHull

    share = _volume(solid) / ConvexHull(solid.points).volume
    if share < _THINNEST_ROOM:
        hull = f"{100.0 * share:.0f} % of its convex hull"
        problem = f"is closed, and {hull}, as a wall with a thickness is,"
        expected = "the inner surface of a vessel alone, open at its top"
        raise _mesh_error(problem, solid.points.mean(axis=0), expected)


def _volume(closed: Vessel) -> float:
    """Volume in a closed surface, m³; negative if its triangles are seen from within."""
    corners = closed.points[closed.triangles]
    products = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("tx,tx->", corners[:, 0], products)) / 6.0


def _largest_basin(solid: Vessel) -> _Basin | None:
    """The hollow of a solid that holds most liquid, if there is any.

    The level of a liquid rises from the lowest points of the surface. The surface below it is in
    pieces, which join at saddles. A piece that encloses air and not the solid is a hollow, which
    is full where it joins the outside.
    """
    basins = [_basin(solid, points, level) for points, level in _pieces_at_saddles(solid)]
    holding = [basin for basin in basins if basin.volume > 0.0]
    return max(holding, key=lambda basin: basin.volume, default=None)


def _pieces_at_saddles(solid: Vessel) -> list[tuple[frozenset[int], float]]:
    """Pieces of the surface below the saddles at which they join others.

    Returns
    -------
    list of tuple
        The points of each piece, and the height of its saddle, m. Shallow pieces are left out.
    """
    heights = solid.points[:, 2]
    least_depth = _SHALLOWEST_BASIN * float(np.ptp(heights))
    neighbours: dict[int, list[int]] = defaultdict(list)
    for first, second in solid.sides_at_edges:
        neighbours[first].append(second)
        neighbours[second].append(first)
    piece_of = np.full(len(heights), -1)  # -1: not below the level yet
    points_of: dict[int, list[int]] = {}
    bottoms: dict[int, float] = {}
    pieces = []
    for point in np.argsort(heights, kind="stable").tolist():
        height = float(heights[point])
        joining: set[int] = set()
        for neighbour in neighbours[point]:
            if piece_of[neighbour] >= 0:
                joining.add(int(piece_of[neighbour]))
        if len(joining) > 1:  # a saddle
            deep_pieces = [piece for piece in joining if height - bottoms[piece] > least_depth]
            pieces += [(frozenset(points_of[piece]), height) for piece in deep_pieces]
        largest = max(joining, key=lambda piece: len(points_of[piece]), default=point)
        points_of.setdefault(largest, []).append(point)
        bottoms.setdefault(largest, height)
        piece_of[point] = largest
        for piece in joining - {largest}:
            piece_of[points_of[piece]] = largest
            points_of[largest] += points_of.pop(piece)
            bottoms[largest] = min(bottoms[largest], bottoms.pop(piece))
    return pieces


def _basin(solid: Vessel, points: frozenset[int], level: float) -> _Basin:
    """A piece of the surface of a solid below a level (m) as a hollow.

    Its volume is negative if the piece encloses the solid, and 0 if it is flat.
    """
    slack = _same_point_distance(solid)
    low = frozenset(point for point in points if solid.points[point, 2] < level - slack)
    if not low:
        return _Basin(low, level, 0.0, 0.0)
    piece = Vessel(solid.points, solid.triangles[np.isin(solid.triangles, list(low)).any(axis=1)])
    # The part below the level remains.
    below = piece.surface.clip("z", origin=(0.0, 0.0, level)).triangulate()
    corners = np.asarray(below.points)[below.regular_faces]
    area_vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upward_areas = area_vectors[:, 2] / 2.0
    depths = level - corners[:, :, 2].mean(axis=1)
    depth = level - min(float(solid.points[point, 2]) for point in low)
    return _Basin(low, level, depth, float(upward_areas @ depths))


def _same_point_distance(solid: Vessel) -> float:
    """Distance within which points count as one, m."""
    return SAME_POINT * float(np.ptp(solid.points, axis=0).max())


def _inner_skin(solid: Vessel, basin: _Basin) -> Vessel:
    """The surface of a hollow up to the level at which it overflows.

    What is above this level is cut off, so that the rim is level. Raises `InputError` if the
    remaining surface is not that of a vessel (`_consistent`).
    """
    within = np.isin(solid.triangles, list(basin.points)).any(axis=1)
    skin = _restricted(solid, solid.triangles[within])
    if skin.points[:, 2].max() <= basin.level + _same_point_distance(solid):
        return skin
    # The part below the level remains.
    cut = skin.surface.clip("z", origin=(0.0, 0.0, basin.level)).triangulate()
    triangles = np.asarray(cut.regular_faces, dtype=np.int64)
    return _consistent(Vessel(*merged(np.asarray(cut.points, dtype=float), triangles)))
