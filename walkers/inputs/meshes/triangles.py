"""Triangles of surfaces: merging, connection, and distances of places from them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.errors import key_error

if TYPE_CHECKING:
    import pyvista as pv

SAME_POINT = 1e-6
"""Distance within which points count as one, over the extent of a surface."""


def groups_of(pairs: IntArray, count: int) -> IntArray:
    """Groups of points or triangles that pairs join.

    Parameters
    ----------
    pairs : ndarray, shape (n, 2)
        Pairs of numbers that are in the same group.
    count : int
        How many points or triangles there are.

    Returns
    -------
    ndarray, shape (count,)
        Number of the group of each.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return np.asarray(connected_components(graph)[1])


def merged(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Merge points that are nearly the same, and leave out triangles without area or given twice.

    Parameters
    ----------
    points : ndarray, shape (P, 3)
        Points, in any unit.
    triangles : ndarray, shape (T, 3)
        Numbers of their corners.

    Returns
    -------
    points : ndarray
        The points of the remaining triangles.
    triangles : ndarray
        The remaining triangles.

    Raises
    ------
    InputError
        If no triangle remains.
    """
    from scipy.spatial import cKDTree

    same_point_distance = SAME_POINT * float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(same_point_distance, output_type="ndarray")
    groups = groups_of(pairs, len(points))
    _, first_of_group, group_numbers = np.unique(groups, return_index=True, return_inverse=True)
    points = points[first_of_group]
    triangles = group_numbers[triangles]
    sides = points[triangles] - np.roll(points[triangles], -1, axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    area_vectors = np.cross(sides[:, 0], sides[:, 1])
    # Twice the area of a triangle over its longest side is its height.
    is_wide = np.linalg.norm(area_vectors, axis=1) > same_point_distance * longest
    _, first_of_triangle = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    triangles = triangles[[number for number in sorted(first_of_triangle) if is_wide[number]]]
    if not len(triangles):
        message = "has no triangles of any size; expected the inner surface of a vessel"
        raise key_error("boundary.mesh", message)
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)


def signed_distance(surface: pv.PolyData) -> Any:
    """VTK's signed distance from a surface, positive on the side of the beads."""
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    distance = vtkImplicitPolyDataDistance()
    distance.SetInput(surface)
    return distance


def evaluated(function: Any, places: FloatArray) -> FloatArray:
    """Values of a function of VTK at places of shape (n, 3); their shape is (n,)."""
    from vtkmodules.vtkCommonCore import vtkDoubleArray

    support: Any = import_module("vtkmodules.util.numpy_support")
    if not len(places):
        return np.zeros(0)
    values = vtkDoubleArray()
    vtk_places = support.numpy_to_vtk(np.ascontiguousarray(places, dtype=np.float64), 1)
    function.EvaluateFunction(vtk_places, values)
    return np.array(support.vtk_to_numpy(values))


def within_polygon(places: FloatArray, corners: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether places in a plane are within a polygon.

    A place is within the polygon if a line from it along x crosses the sides an odd number of
    times.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        The places.
    corners : ndarray, shape (K, 2)
        Corners of the polygon, in order.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    inside = np.zeros(len(places), dtype=bool)
    for (x, y), (end_x, end_y) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y == end_y:
            continue
        is_level_with_side = (places[:, 1] < y) != (places[:, 1] < end_y)
        crossing_x = x + (places[:, 1] - y) * (end_x - x) / (end_y - y)
        inside ^= is_level_with_side & (places[:, 0] < crossing_x)
    return inside
