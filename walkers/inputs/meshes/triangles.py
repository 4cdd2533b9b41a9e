"""Triangles of surfaces: which are the same, which are connected, and how far places are from them."""

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
"""Of the extent of a surface: points that are nearer are one."""


def groups_of(pairs: IntArray, count: int) -> IntArray:
    """Number of the group of each of a count of points or triangles that pairs join, shape (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return np.asarray(connected_components(graph)[1])


def merged(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The points, those that are nearly the same as one, and the triangles that are left, each once."""
    from scipy.spatial import cKDTree

    near = SAME_POINT * float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    _, first, same = np.unique(
        groups_of(pairs, len(points)), return_index=True, return_inverse=True
    )
    triangles = same[triangles]
    sides = points[first][triangles] - np.roll(points[first][triangles], -1, axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    wide = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > near * longest
    _, once = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    triangles = triangles[[number for number in sorted(once) if wide[number]]]
    if not len(triangles):
        raise key_error(
            "boundary.mesh", "has no triangles of any size; expected the inner surface of a vessel"
        )
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[first][used], renumbered.reshape(-1, 3)


def signed_distance(surface: pv.PolyData) -> Any:
    """VTK's signed distance from a surface, positive on the side of the beads."""
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    distance = vtkImplicitPolyDataDistance()
    distance.SetInput(surface)
    return distance


def evaluated(function: Any, places: FloatArray) -> FloatArray:
    """Values of a function of VTK at places, shape (n, 3)."""
    from vtkmodules.vtkCommonCore import vtkDoubleArray

    support: Any = import_module("vtkmodules.util.numpy_support")
    if not len(places):
        return np.zeros(0)
    values = vtkDoubleArray()
    function.EvaluateFunction(
        support.numpy_to_vtk(np.ascontiguousarray(places, dtype=np.float64), 1), values
    )
    return np.array(support.vtk_to_numpy(values))


def within_polygon(places: FloatArray, corners: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether places in a plane, shape (n, 2), are within a polygon: beside them it is crossed oddly often."""
    inside = np.zeros(len(places), dtype=bool)
    for (x, y), (end_x, end_y) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y == end_y:
            continue
        crossed = (places[:, 1] < y) != (places[:, 1] < end_y)
        inside ^= crossed & (places[:, 0] < x + (places[:, 1] - y) * (end_x - x) / (end_y - y))
    return inside
