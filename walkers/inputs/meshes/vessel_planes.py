"""Vessels of the user's own that are given by planes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from walkers.arrays import FloatArray, IntArray, Vector
from walkers.errors import key_error
from walkers.inputs.meshes.triangles import merged
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.meshes.wall_names import axis_name

_MOST_EXTENT = 1e3
"""Extent of a vessel over its height from which it counts as open to a side."""
_AT_FAR_PLANE = 0.999
"""Coordinate of a corner over the distance of the far planes above which it is on one of them."""
_SMALLEST_SPHERE = 1e-9
"""Radius of the largest sphere between planes below which they enclose nothing, m."""


def vessel_between(planes: Sequence[tuple[Vector, Vector]], height: float) -> Vessel:
    """The vessel that planes enclose up to a height.

    Parameters
    ----------
    planes
        Point (m) and unit normal, toward the beads, of each plane.
    height
        Height at which the vessel ends, m.

    Raises
    ------
    InputError
        If the planes enclose nothing, are open to a side, or if beads cannot touch one of them.
    """
    from scipy.spatial import HalfspaceIntersection

    far_distance = _MOST_EXTENT * height
    ends = _end_planes(height, far_distance)
    points = np.array([point for point, _ in (*planes, *ends)])
    normals = np.array([normal for _, normal in (*planes, *ends)])
    offsets = np.einsum("px,px->p", normals, points)
    inside = _place_inside(normals, offsets)
    intersection = HalfspaceIntersection(np.column_stack([-normals, offsets]), inside)
    corners = intersection.intersections
    _check_closed(corners, far_distance)
    triangles: list[list[int]] = []
    for number, normal in enumerate(normals[: len(planes)]):
        at_plane = []
        for corner, meeting_planes in enumerate(intersection.dual_facets):
            if number in meeting_planes:
                at_plane.append(corner)
        if len(at_plane) < 3:
            message = "is behind the others; expected planes that beads can touch"
            raise key_error(f"boundary.planes[{number}]", message)
        polygon = _in_order(np.array(at_plane), corners, normal)
        triangles += [[polygon[0], *pair] for pair in pairwise(polygon[1:])]
    return Vessel(*merged(corners, np.array(triangles)))


def _end_planes(height: float, far_distance: float) -> list[tuple[Vector, Vector]]:
    """Planes that end the vessel: at its height (m), and far away on the other sides."""
    ends: list[tuple[Vector, Vector]] = [((0.0, 0.0, height), (0.0, 0.0, -1.0))]
    inward_axes = [*np.eye(3), *-np.eye(3)[:2]]
    ends += [(_vector(-far_distance * axis), _vector(axis)) for axis in inward_axes]
    return ends


def _vector(array: FloatArray) -> Vector:
    """The three components of an array."""
    x, y, z = array.tolist()
    return (x, y, z)


def _place_inside(normals: FloatArray, offsets: FloatArray) -> FloatArray:
    """The centre of the largest sphere between planes, m, shape (3,); refuses planes without any.

    Parameters
    ----------
    normals : ndarray, shape (n, 3)
        Unit normals of the planes.
    offsets : ndarray, shape (n,)
        Distances of the planes from the origin along their normals, m.
    """
    from scipy.optimize import linprog

    # The unknowns are the centre and the radius, which is maximised.
    conditions = np.column_stack([-normals, np.ones(len(normals))])
    bounds = [(None, None), (None, None), (None, None), (0, None)]
    best = linprog([0, 0, 0, -1], conditions, -offsets, bounds=bounds)
    if best.status or best.x[3] < _SMALLEST_SPHERE:
        message = "enclose nothing; expected normals toward the beads, and a height above them"
        raise key_error("boundary.planes", message)
    return np.asarray(best.x[:3])


def _check_closed(corners: FloatArray, far_distance: float) -> None:
    """Refuse planes of which some corners, shape (n, 3), are on the far planes."""
    if np.abs(corners).max() <= _AT_FAR_PLANE * far_distance:
        return
    farthest = corners[np.abs(corners).max(axis=1).argmax()]
    problem = f"are open toward {axis_name(farthest)}"
    raise key_error("boundary.planes", f"{problem}; expected planes that close the vessel")


def _in_order(numbers: IntArray, corners: FloatArray, normal: FloatArray) -> IntArray:
    """Numbers of the corners of a polygon, counterclockwise about its normal."""
    spokes = corners[numbers] - corners[numbers].mean(axis=0)
    angles = np.arctan2(spokes @ np.cross(normal, spokes[0]), spokes @ spokes[0])
    ordered: IntArray = numbers[np.argsort(angles)]
    return ordered
