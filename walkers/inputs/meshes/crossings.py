"""Whether a surface crosses itself.

Two triangles intersect if an edge of one goes through the other. An edge that ends at a corner of a
triangle meets it there and nowhere else, unless both are in a plane and fold back over each other. So
edges are compared with triangles with which they have no corner in common, and neighbours by their
normals. A fan of thousands of triangles around one tip then costs no more than other surfaces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.inputs.meshes.vessel import Vessel

_SLACK = 1e-7  # of the extent of a surface: depth of an intersection that counts as touching
_EDGES_AT_ONCE = 64
_CURVE_BITS = 10  # of each coordinate of a Morton code


class Crossing(NamedTuple):
    """Two triangles that have more than an edge or a corner in common: a place (m), and whether they are in a plane."""

    place: FloatArray
    level: bool


def first_fold(vessel: Vessel) -> Crossing | None:
    """Two neighbours that lie upon each other, if there are any."""
    pairs = vessel.neighbours
    if not len(pairs):
        return None
    slack = _SLACK * float(np.ptp(vessel.points, axis=0).max())
    first, second = vessel.triangles[pairs[:, 0]], vessel.triangles[pairs[:, 1]]
    is_shared = (second[:, :, None] == first[:, None, :]).any(axis=2)
    apex = vessel.points[second[np.arange(len(pairs)), (~is_shared).argmax(axis=1)]]
    offset = np.einsum("nx,nx->n", apex - vessel.points[first[:, 0]], vessel.normals[pairs[:, 0]])
    turned = np.einsum("nx,nx->n", vessel.normals[pairs[:, 0]], vessel.normals[pairs[:, 1]])
    folded = np.flatnonzero((np.abs(offset) < slack) & (turned < 0.0))
    if not len(folded):
        return None
    corners = vessel.points[np.concatenate([first[folded[0]], second[folded[0]]])]
    return Crossing(corners.mean(axis=0), level=True)


def first_crossing(vessel: Vessel) -> Crossing | None:
    """An edge and a triangle that intersect, or overlap in a plane, if there are any."""
    edges = np.array([sorted(edge) for edge in vessel.sharing], dtype=np.int64)
    slack = _SLACK * float(np.ptp(vessel.points, axis=0).max())
    ends_of_edges = edges.T.astype(np.int32)
    corners_of_triangles = vessel.triangles.T.astype(np.int32)
    for edge_numbers, triangle_numbers in _near_pairs(vessel, edges):
        apart = np.ones(len(edge_numbers), dtype=bool)
        for end in ends_of_edges:
            at_end = end[edge_numbers]
            for corner in corners_of_triangles:
                apart &= corner[triangle_numbers] != at_end
        if not apart.any():
            continue
        numbers = triangle_numbers[apart]
        ends, corners = edges[edge_numbers[apart]], vessel.triangles[numbers]
        line, triangle, normal = (
            vessel.points[ends],
            vessel.points[corners],
            vessel.normals[numbers],
        )
        heights = np.einsum("nkx,nx->nk", line - triangle[:, :1], normal)
        level = (np.abs(heights) < slack).all(axis=1)
        through = (heights.min(axis=1) < -slack) & (heights.max(axis=1) > slack)
        through[through] = _goes_through(
            line[through], heights[through], triangle[through], normal[through], slack
        )
        level[level] = _overlap_in_plane(line[level], triangle[level], normal[level], slack)
        if level.any():
            at = int(level.argmax())
            return Crossing(np.concatenate([line[at], triangle[at]]).mean(axis=0), level=True)
        if through.any():
            at = int(through.argmax())
            share = heights[at, 0] / (heights[at, 0] - heights[at, 1])
            return Crossing(line[at, 0] + share * (line[at, 1] - line[at, 0]), level=False)
    return None


def _near_pairs(vessel: Vessel, edges: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Numbers of edges and triangles whose boxes overlap, in groups of edges that are near each other."""
    boxes = vessel.points[vessel.triangles]
    low, high = boxes.min(axis=1), boxes.max(axis=1)
    lines = vessel.points[edges]
    starts, ends = lines.min(axis=1), lines.max(axis=1)
    order = np.argsort(_along_a_curve(lines.mean(axis=1)))
    for first in range(0, len(order), _EDGES_AT_ONCE):
        group = order[first : first + _EDGES_AT_ONCE]
        start, end = starts[group], ends[group]
        near = np.flatnonzero(((low <= end.max(axis=0)) & (high >= start.min(axis=0))).all(axis=1))
        overlap = np.ones((len(group), len(near)), dtype=bool)
        for axis in range(3):
            overlap &= start[:, axis, None] <= high[near, axis]
            overlap &= end[:, axis, None] >= low[near, axis]
        rows, columns = np.nonzero(overlap)
        yield group[rows], near[columns]


def _along_a_curve(places: FloatArray) -> IntArray:
    """Numbers of places, shape (n, 3), of which neighbouring ones are near each other: their Morton codes."""
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
    """Whether lines, whose ends have heights over the planes of triangles, go through these triangles."""
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
    """Whether lines in the planes of triangles have points within them: no side and no line separates them."""
    direction = line[:, 1] - line[:, 0]
    across = np.cross(normal, direction)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.concatenate([_inwards(triangle, normal), across[:, None]], axis=1)
    on_line = np.einsum("nkx,nax->nak", line, axes)
    on_triangle = np.einsum("nkx,nax->nak", triangle, axes)
    first = on_line.max(axis=2) - on_triangle.min(axis=2)
    second = on_triangle.max(axis=2) - on_line.min(axis=2)
    return np.asarray((np.minimum(first, second) > slack).all(axis=1))
