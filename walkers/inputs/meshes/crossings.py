"""Whether a surface crosses itself.

Two triangles intersect if an edge of one goes through the other. An edge that ends at a corner of
a triangle meets it there and nowhere else, unless both are in a plane and fold back over each
other. So edges are compared with triangles with which they have no corner in common, and
neighbours by their normals. A fan of thousands of triangles around one tip then costs no more
than other surfaces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.inputs.meshes.vessel import Vessel

_SLACK = 1e-7
"""Largest depth of an intersection that counts as touching, over the extent of a surface."""
_EDGES_AT_ONCE = 64
"""Number of edges that are compared with triangles at once."""
_CURVE_BITS = 10
"""Bits of each coordinate in a Morton code."""


class Crossing(NamedTuple):
    """Two triangles that have more than an edge or a corner in common.

    Attributes
    ----------
    place : ndarray, shape (3,)
        Where they meet, m.
    in_plane : bool
        Whether both are in one plane, where they overlap.
    """

    place: FloatArray
    in_plane: bool


def first_fold(vessel: Vessel) -> Crossing | None:
    """The first two neighbours that are folded onto each other; None if there are none."""
    pairs = vessel.neighbours
    if not len(pairs):
        return None
    slack = _slack(vessel)
    first = vessel.triangles[pairs[:, 0]]
    second = vessel.triangles[pairs[:, 1]]
    first_normals = vessel.normals[pairs[:, 0]]
    second_normals = vessel.normals[pairs[:, 1]]
    is_shared = (second[:, :, None] == first[:, None, :]).any(axis=2)
    apex = vessel.points[second[np.arange(len(pairs)), (~is_shared).argmax(axis=1)]]
    heights = np.einsum("nx,nx->n", apex - vessel.points[first[:, 0]], first_normals)
    cosines = np.einsum("nx,nx->n", first_normals, second_normals)
    folded = np.flatnonzero((np.abs(heights) < slack) & (cosines < 0.0))
    if not len(folded):
        return None
    pair = folded[0]
    corners = vessel.points[np.concatenate([first[pair], second[pair]])]
    return Crossing(corners.mean(axis=0), in_plane=True)


def _slack(vessel: Vessel) -> float:
    """Largest depth of an intersection of triangles that counts as touching, m."""
    return _SLACK * float(np.ptp(vessel.points, axis=0).max())


def first_crossing(vessel: Vessel) -> Crossing | None:
    """An edge and a triangle that intersect, or overlap in a plane; None if there are none."""
    slack = _slack(vessel)
    edges = np.array([sorted(edge) for edge in vessel.sides_at_edges], dtype=np.int64)
    # Small integers are compared faster.
    edge_ends = edges.T.astype(np.int32)
    triangle_corners = vessel.triangles.T.astype(np.int32)
    for edge_numbers, triangle_numbers in _near_pairs(vessel, edges):
        have_no_common_corner = np.ones(len(edge_numbers), dtype=bool)
        for end in edge_ends:
            end_points = end[edge_numbers]
            for corner in triangle_corners:
                have_no_common_corner &= corner[triangle_numbers] != end_points
        if have_no_common_corner.any():
            near_edges = edges[edge_numbers[have_no_common_corner]]
            near_triangles = triangle_numbers[have_no_common_corner]
            crossing = _crossing_of(vessel, near_edges, near_triangles, slack)
            if crossing is not None:
                return crossing
    return None


def _crossing_of(
    vessel: Vessel, edges: IntArray, triangles: IntArray, slack: float
) -> Crossing | None:
    """The first pair of an edge and a triangle that intersect or overlap, if there is any.

    Parameters
    ----------
    vessel
        The surface.
    edges : ndarray, shape (n, 2)
        Points of the edges.
    triangles : ndarray, shape (n,)
        Number of the triangle with which each edge is compared. They have no point in common.
    slack
        Depth that counts as touching, m.
    """
    line = vessel.points[edges]
    triangle = vessel.points[vessel.triangles[triangles]]
    normal = vessel.normals[triangles]
    heights = np.einsum("nkx,nx->nk", line - triangle[:, :1], normal)
    overlaps = (np.abs(heights) < slack).all(axis=1)
    intersects = (heights.min(axis=1) < -slack) & (heights.max(axis=1) > slack)
    intersects[intersects] = _goes_through(
        line[intersects],
        heights[intersects],
        triangle[intersects],
        normal[intersects],
        slack,
    )
    overlaps[overlaps] = _overlap_in_plane(
        line[overlaps], triangle[overlaps], normal[overlaps], slack
    )
    if overlaps.any():
        pair = int(overlaps.argmax())
        corners = np.concatenate([line[pair], triangle[pair]])
        return Crossing(corners.mean(axis=0), in_plane=True)
    if intersects.any():
        pair = int(intersects.argmax())
        start, end = line[pair]
        share = heights[pair, 0] / (heights[pair, 0] - heights[pair, 1])
        return Crossing(start + share * (end - start), in_plane=False)
    return None


def _near_pairs(vessel: Vessel, edges: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Pairs of an edge and a triangle whose bounding boxes overlap; no others can intersect.

    To compare each edge with few triangles, edges are taken in groups along a Morton curve.

    Parameters
    ----------
    vessel
        The surface.
    edges : ndarray, shape (n, 2)
        Points of the edges.

    Yields
    ------
    edge_numbers, triangle_numbers : ndarray, shape (pairs,)
        The pairs of a group of edges, of which there may be none.
    """
    corners = vessel.points[vessel.triangles]
    triangle_low = corners.min(axis=1)
    triangle_high = corners.max(axis=1)
    lines = vessel.points[edges]
    edge_low = lines.min(axis=1)
    edge_high = lines.max(axis=1)
    order = np.argsort(_morton_codes(lines.mean(axis=1)))
    for start in range(0, len(order), _EDGES_AT_ONCE):
        group = order[start : start + _EDGES_AT_ONCE]
        low = edge_low[group]
        high = edge_high[group]
        near_group = (triangle_low <= high.max(axis=0)) & (triangle_high >= low.min(axis=0))
        near = np.flatnonzero(near_group.all(axis=1))
        overlap = np.ones((len(group), len(near)), dtype=bool)
        for axis in range(3):
            overlap &= low[:, axis, None] <= triangle_high[near, axis]
            overlap &= high[:, axis, None] >= triangle_low[near, axis]
        rows, columns = np.nonzero(overlap)
        yield group[rows], near[columns]


def _morton_codes(places: FloatArray) -> IntArray:
    """Morton codes of places, shape (n, 3): places with similar numbers are near each other."""
    extent = max(float(np.ptp(places, axis=0).max()), 1e-300)
    cells = ((places - places.min(axis=0)) / extent * (2**_CURVE_BITS - 1)).astype(np.int64)
    codes = np.zeros(len(places), dtype=np.int64)
    for bit in range(_CURVE_BITS):
        for axis in range(3):
            codes |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return codes


def _goes_through(
    line: FloatArray, heights: FloatArray, triangle: FloatArray, normal: FloatArray, slack: float
) -> npt.NDArray[np.bool_]:
    """Whether lines go through triangles, shape (n,).

    Parameters
    ----------
    line : ndarray, shape (n, 2, 3)
        Ends of the lines, m.
    heights : ndarray, shape (n, 2)
        Heights of these ends over the planes of the triangles, m.
    triangle : ndarray, shape (n, 3, 3)
        Corners of the triangles, m.
    normal : ndarray, shape (n, 3)
        Unit normals of the triangles.
    slack : float
        Depth that counts as touching, m.
    """
    share = heights[:, 0] / (heights[:, 0] - heights[:, 1])
    place = line[:, 0] + share[:, None] * (line[:, 1] - line[:, 0])
    inward = _inwards(triangle, normal)
    offsets = np.einsum("nkx,nkx->nk", place[:, None] - triangle, inward)
    return np.asarray((offsets > -slack).all(axis=1))


def _inwards(triangle: FloatArray, normal: FloatArray) -> FloatArray:
    """Unit vectors in triangles across their sides, shape (n, 3, 3)."""
    across = np.cross(normal[:, None], np.roll(triangle, -1, axis=1) - triangle)
    inwards: FloatArray = across / np.linalg.norm(across, axis=2, keepdims=True)
    return inwards


def _overlap_in_plane(
    line: FloatArray, triangle: FloatArray, normal: FloatArray, slack: float
) -> npt.NDArray[np.bool_]:
    """Whether lines in the planes of triangles have points within them, shape (n,).

    They have such points unless a direction across a side of the triangle, or across the line,
    separates line and triangle. The arguments are those of `_goes_through`.
    """
    direction = line[:, 1] - line[:, 0]
    across = np.cross(normal, direction)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.concatenate([_inwards(triangle, normal), across[:, None]], axis=1)
    on_line = np.einsum("nkx,nax->nak", line, axes)
    on_triangle = np.einsum("nkx,nax->nak", triangle, axes)
    first = on_line.max(axis=2) - on_triangle.min(axis=2)
    second = on_triangle.max(axis=2) - on_line.min(axis=2)
    return np.asarray((np.minimum(first, second) > slack).all(axis=1))
