"""A mesh as the clean inner surface of a vessel, or the reason why it is none.

Points that are nearly the same are merged, triangles are turned toward the beads, the inner skin of a
solid is taken. Everything else that beads could fall through, or that cannot be told, is refused with
its place.
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

_ONE_OPENING = "one, at its top: close the others"
_STEEPEST_OPENING = radians(45.0)  # between the vertical and the direction of the opening
_DEEPEST_DIP = 0.1  # of the height: how far a rim may be from one plane
_SHALLOWEST_BASIN = 0.05  # of the height: hollows that are looked at
_DEEP_BASIN = 0.5  # of the height: a hollow as deep is the inside of a vessel
_DOUBTFUL_BASIN = 0.2  # of the height
_THINNEST_ROOM = 0.5  # volume of a closed vessel over that of its convex hull
_AXES = {"+x": (0, 1.0), "-x": (0, -1.0), "+y": (1, 1.0), "-y": (1, -1.0), "-z": (2, -1.0)}
"""Directions in which the inside of a vessel may look by mistake: axis and sign."""


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
    """
    points = np.array(mesh["points"], dtype=float)
    triangles = np.array(mesh["triangles"], dtype=np.int64)
    if not np.isfinite(points).all() or not 0 <= triangles.min() <= triangles.max() < len(points):
        raise ValueError("expected finite points, and triangles of them")
    return _vessel_of(points.tobytes(), triangles.tobytes(), scale)


@lru_cache(maxsize=16)
def _vessel_of(point_bytes: bytes, triangle_bytes: bytes, scale: float) -> Vessel:
    given = np.frombuffer(point_bytes).reshape(-1, 3)
    of_triangles = np.frombuffer(triangle_bytes, dtype=np.int64).reshape(-1, 3)
    vessel = _consistent(Vessel(*merged(scale * given, of_triangles)))
    _check_rims(vessel)
    _check_crossings(vessel)
    if not vessel.rims:
        vessel = _without_skin(vessel)
    vessel = _toward_beads(vessel)
    _check_opening(vessel)
    vessel = _without_hollows(vessel)
    points = vessel.points
    low, high = points.min(axis=0), points.max(axis=0)
    middle = np.array([*(low + high)[:2] / 2.0, low[2]])
    moved = np.array([[float(f"{x:.12g}") for x in point] for point in points - middle])
    return Vessel(moved, vessel.triangles)


def _broken(problem: str, point: FloatArray, expected: str) -> InputError:
    place = ", ".join(f"{1e3 * x + 0.0:.4g}" for x in point)
    return key_error("boundary.mesh", f"{problem} at ({place}) mm; expected {expected}")


def _restricted(vessel: Vessel, triangles: IntArray) -> Vessel:
    """A vessel of some triangles, with the points that they need."""
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Vessel(vessel.points[used], renumbered.reshape(-1, 3))


def _consistent(vessel: Vessel) -> Vessel:
    """The vessel with triangles that are all seen from one side, counterclockwise."""
    for edge, pair in vessel.sharing.items():
        if len(pair) > 2:
            middle = vessel.points[[*edge]].mean(axis=0)
            raise _broken(
                f"has {len(pair)} triangles at an edge,", middle, "two: give sheets a thickness"
            )
    consistent = vessel.surface.compute_normals(
        point_normals=False, split_vertices=False, auto_orient_normals=False
    )
    turned = Vessel(vessel.points, np.asarray(consistent.regular_faces, dtype=np.int64))
    for pair in turned.sharing.values():
        if len(pair) == 2 and turned.ends(*pair[0]) == turned.ends(*pair[1]):
            where = turned.points[turned.triangles[pair[1][0], 0]]
            raise _broken(
                "has a surface of one side alone,", where, "one with an inside and an outside"
            )
    return turned


def _check_rims(vessel: Vessel) -> None:
    """Refuse several openings."""
    starts = Counter(
        vessel.ends(*shared[0])[0] for shared in vessel.sharing.values() if len(shared) == 1
    )
    for point, times in starts.items():
        if times > 1:
            message = (
                "has openings that meet in a point, or a corner within an edge of another part,"
            )
            raise _broken(message, vessel.points[point], _ONE_OPENING)
    rims = vessel.rims
    if len(rims) > 1:
        lowest = min(
            (vessel.points[rim][vessel.points[rim, 2].argmin()] for rim in rims),
            key=lambda point: point[2],
        )
        raise _broken(f"has {len(rims)} openings, the lowest", lowest, _ONE_OPENING)


def _check_crossings(vessel: Vessel) -> None:
    """Refuse triangles that intersect or overlap."""
    crossing = first_fold(vessel) or first_crossing(vessel)
    if crossing:
        problem = "overlap in a plane" if crossing.level else "intersect"
        raise _broken(
            f"has triangles that {problem},", crossing.place, "a surface that does not cross itself"
        )


def _toward_beads(vessel: Vessel) -> Vessel:
    """The vessel with triangles counterclockwise as seen from the beads: in the vessel, and around bodies in it."""
    capped = vessel.capped
    corners = capped.points[capped.triangles]
    volumes = np.einsum("tx,tx->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    outer = int(vessel.parts[vessel.outer][0])
    parts = np.append(vessel.parts, np.full(len(volumes) - len(vessel.parts), outer))
    sizes = np.bincount(parts, volumes)
    back = (sizes[vessel.parts] > 0.0) == vessel.outer
    return Vessel(
        vessel.points, np.where(back[:, None], vessel.triangles[:, ::-1], vessel.triangles)
    )


def _check_opening(vessel: Vessel) -> None:
    """Refuse an opening that is not at the top, or a rim that dips."""
    if not vessel.rims:
        return
    rim = vessel.points[vessel.rims[0]]
    extent = float(np.ptp(vessel.points, axis=0).max())
    lowest = rim[rim[:, 2].argmin()]
    if lowest[2] <= vessel.points[:, 2].min() + SAME_POINT * extent:
        raise _broken(
            "is open at its lowest point,", lowest, "a closed bottom: beads would fall out"
        )
    facing = vessel.facing
    if facing[2] < cos(_STEEPEST_OPENING):
        axis = int(np.abs(facing).argmax())
        toward = f"{'+' if facing[axis] > 0.0 else '-'}{'xyz'[axis]}"
        message = f"has an opening that faces {toward},"
        cure = "one that faces +z, which is up: rotate the mesh, or close a hole in its side"
        raise _broken(message, rim.mean(axis=0), cure)
    below = (rim - rim.mean(axis=0)) @ facing
    if np.ptp(below) > _DEEPEST_DIP * np.ptp(vessel.points[:, 2]):
        dip = rim[below.argmin()]
        message = f"has a rim that dips by {1e3 * np.ptp(below):.3g} mm,"
        raise _broken(message, dip, "a rim about in one plane: close slots in the walls")


# --- parts ------------------------------------------------------------------------------------------------------------


def _without_hollows(vessel: Vessel) -> Vessel:
    """The vessel with the bodies that are in it; a hollow in such a body is left out, as no bead gets there."""
    numbers = sorted(set(vessel.parts[~vessel.outer].tolist()))
    if not numbers:
        return vessel
    outer = Vessel(vessel.points, vessel.triangles[vessel.outer])
    corners = {number: np.unique(vessel.triangles[vessel.parts == number]) for number in numbers}
    for number in numbers:
        points = vessel.points[corners[number]]
        low = points[points[:, 2] < outer.height]
        farthest = points[points[:, 2].argmin()]
        inside = False
        if len(low):
            clear = outer.clearance(low)
            farthest = low[np.abs(clear).argmax()]
            inside = clear[np.abs(clear).argmax()] > 0.0
        if not inside:
            where = "above" if points[:, 2].min() >= outer.height else "beside"
            raise _broken(
                f"has a closed part {where} the vessel,",
                farthest,
                "parts within it: one vessel a file",
            )
    hollow = [number for number in numbers if _is_in_another(vessel, corners, number)]
    return _restricted(vessel, vessel.triangles[~np.isin(vessel.parts, hollow)])


def _is_in_another(vessel: Vessel, corners: Mapping[int, IntArray], number: int) -> bool:
    """Whether a body in a vessel is within another one."""
    points = vessel.points[corners[number]]
    for body_number, body_corners in corners.items():
        around = vessel.points[body_corners]
        apart = (points.min(axis=0) < around.min(axis=0)).any() or (
            points.max(axis=0) > around.max(axis=0)
        ).any()
        if body_number == number or apart:
            continue
        body = Vessel(vessel.points, vessel.triangles[vessel.parts == body_number][:, ::-1])
        if body.clearance(points[:1])[0] > 0.0:  # a body turned about is a closed vessel
            return True
    return False


# --- solids -----------------------------------------------------------------------------------------------------------


class _Basin(NamedTuple):
    """A hollow of a solid that is open to the top: its points, its rim and depth (m), and its volume (m³)."""

    points: frozenset[int]
    level: float
    depth: float
    volume: float


def _without_skin(vessel: Vessel) -> Vessel:
    """The vessel in a solid whose surface is closed, as CAD programs export it: its inner skin up to the rim.

    A solid vessel has a deep hollow that is open to the top. A closed room has none.
    """
    solid = _outward(_restricted(vessel, vessel.triangles[vessel.outer]))
    height = float(np.ptp(solid.points[:, 2]))
    basin = _deepest(solid)
    if basin and basin.depth > _DEEP_BASIN * height:
        skin = _inner_skin(solid, basin)
        bodies = vessel.triangles[~vessel.outer]
        if not len(bodies):
            return skin
        within = _restricted(vessel, bodies)
        points = np.concatenate([skin.points, within.points])
        return Vessel(points, np.concatenate([skin.triangles, len(skin.points) + within.triangles]))
    if basin and basin.depth > _DOUBTFUL_BASIN * height:
        lowest = solid.points[min(basin.points, key=lambda point: solid.points[point, 2])]
        hollow = f"is closed, with a hollow in its top, {1e3 * basin.depth:.3g} mm deep (to a slot in its wall?),"
        raise _broken(hollow, lowest, "the inner surface of a vessel alone, open at its top")
    _check_room(solid)
    return vessel


def _outward(closed: Vessel) -> Vessel:
    """A closed surface whose triangles look out of it."""
    corners = closed.points[closed.triangles]
    volume = np.einsum("tx,tx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return closed if volume > 0.0 else Vessel(closed.points, closed.triangles[:, ::-1])


def _check_room(solid: Vessel) -> None:
    """Refuse a closed surface that is a wall rather than a room."""
    from scipy.spatial import ConvexHull

    centre = solid.points.mean(axis=0)
    for name, (axis, sign) in _AXES.items():
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        turned = solid.points[:, order] * [sign, 1.0, sign]  # `name` is up
        basin = _deepest(Vessel(turned, solid.triangles))
        if basin and basin.depth > _DEEP_BASIN * np.ptp(turned[:, 2]):
            message = f"is a solid whose inside opens toward {name},"
            at_opening = solid.points[turned[:, 2].argmax()]
            raise _broken(message, at_opening, "an opening toward +z, which is up: rotate the mesh")
    volume = float(_volume(solid))
    share = volume / ConvexHull(solid.points).volume
    if share < _THINNEST_ROOM:
        message = f"is closed, and {100.0 * share:.0f} % of its convex hull, as a wall with a thickness is,"
        raise _broken(message, centre, "the inner surface of a vessel alone, open at its top")


def _volume(closed: Vessel) -> float:
    corners = closed.points[closed.triangles]
    return float(np.einsum("tx,tx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


def _deepest(solid: Vessel) -> _Basin | None:
    """The hollow of a solid that holds most liquid, if there is any.

    The level of liquid rises from the lowest points of the surface: the surface below it is in pieces, which join
    at saddles. A piece that encloses air and not the solid is a hollow, which is full where it joins the outside.
    """
    basins = [_basin(solid, points, level) for points, level in _joining(solid)]
    holding = [basin for basin in basins if basin.volume > 0.0]
    return max(holding, key=lambda basin: basin.volume, default=None)


def _joining(solid: Vessel) -> list[tuple[frozenset[int], float]]:
    """Pieces of the surface below the saddles where they join others: their points, and the heights of the saddles."""
    heights = solid.points[:, 2]
    least = _SHALLOWEST_BASIN * float(np.ptp(heights))
    beside: dict[int, list[int]] = defaultdict(list)
    for first, second in (tuple(edge) for edge in solid.sharing):
        beside[first].append(second)
        beside[second].append(first)
    piece = np.full(len(heights), -1)
    points: dict[int, list[int]] = {}
    bottoms: dict[int, float] = {}
    joining = []
    for point in np.argsort(heights, kind="stable").tolist():
        around = {int(piece[neighbour]) for neighbour in beside[point] if piece[neighbour] >= 0}
        if len(around) > 1:
            deep = [number for number in around if heights[point] - bottoms[number] > least]
            joining += [(frozenset(points[number]), float(heights[point])) for number in deep]
        largest = max(around, key=lambda number: len(points[number]), default=point)
        points.setdefault(largest, []).append(point)
        bottoms.setdefault(largest, float(heights[point]))
        piece[point] = largest
        for number in around - {largest}:
            piece[points[number]] = largest
            points[largest] += points.pop(number)
            bottoms[largest] = min(bottoms[largest], bottoms.pop(number))
    return joining


def _basin(solid: Vessel, points: frozenset[int], level: float) -> _Basin:
    """A piece of the surface below a level as a hollow; its volume is negative if the piece encloses the solid."""
    slack = SAME_POINT * float(np.ptp(solid.points, axis=0).max())
    low = frozenset(point for point in points if solid.points[point, 2] < level - slack)
    if not low:
        return _Basin(low, level, 0.0, 0.0)
    piece = Vessel(solid.points, solid.triangles[np.isin(solid.triangles, list(low)).any(axis=1)])
    below = piece.surface.clip("z", origin=(0.0, 0.0, level)).triangulate()
    corners = np.asarray(below.points)[below.regular_faces]
    area_up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2.0
    depths = level - corners[:, :, 2].mean(axis=1)
    depth = level - min(float(solid.points[point, 2]) for point in low)
    return _Basin(low, level, depth, float(area_up @ depths))


def _inner_skin(solid: Vessel, basin: _Basin) -> Vessel:
    """The surface of a hollow up to its rim, which is level."""
    within = np.isin(solid.triangles, list(basin.points)).any(axis=1)
    skin = _restricted(solid, solid.triangles[within])
    slack = SAME_POINT * float(np.ptp(solid.points, axis=0).max())
    if skin.points[:, 2].max() <= basin.level + slack:
        return skin
    cut = skin.surface.clip("z", origin=(0.0, 0.0, basin.level)).triangulate()
    triangles = np.asarray(cut.regular_faces, dtype=np.int64)
    return _consistent(Vessel(*merged(np.asarray(cut.points, dtype=float), triangles)))
