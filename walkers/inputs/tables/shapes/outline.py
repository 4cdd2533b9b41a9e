"""Polygons of walls in pictures, computed from the planes of the walls; nothing is drawn here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.shapes.walls import Wall


def faces_within(
    walls: Sequence[Wall],
    low: FloatArray,
    high: FloatArray,
    inside: FloatArray,
) -> list[FloatArray]:
    """The parts of walls that bound the convex region around a place.

    Parameters
    ----------
    walls : sequence of Wall
        Each gives planes that touch it (`Wall.tangent_planes`).
    low, high : ndarray, shape (3,)
        Corners of a box in which walls without ends are drawn, m.
    inside : ndarray, shape (3,)
        A place in front of all walls, m.

    Returns
    -------
    list of ndarray, shape (K, 3)
        Corners of the part of each plane, counterclockwise as seen from the place, m.
    """
    from scipy.spatial import HalfspaceIntersection

    point_arrays = []
    normal_arrays = []
    for wall in walls:
        wall_points, wall_normals = wall.tangent_planes()
        point_arrays.append(wall_points)
        normal_arrays.append(wall_normals)
    box_points = np.repeat([low, high], 3, axis=0)
    points = np.concatenate([*point_arrays, box_points])
    normals = np.concatenate([*normal_arrays, np.eye(3), -np.eye(3)])

    # A half-space is a row (-n, n·p) for the normal n and a point p: -n·x + n·p ≤ 0 in front of it.
    half_spaces = np.column_stack([-normals, np.einsum("px,px->p", normals, points)])
    region = HalfspaceIntersection(half_spaces, inside)

    faces = []
    for number, normal in enumerate(normals[: -len(box_points)]):
        on_plane = [number in planes for planes in region.dual_facets]
        corners = region.intersections[on_plane]
        if len(corners) > 2:
            faces.append(_counterclockwise(corners, normal))
    return faces


def _counterclockwise(corners: FloatArray, normal: FloatArray) -> FloatArray:
    """Corners of a convex polygon (K, 3) in their order about its normal (3,)."""
    spokes = corners - corners.mean(axis=0)
    across = np.cross(normal, spokes[0])
    angles = np.arctan2(spokes @ across, spokes @ spokes[0])
    ordered: FloatArray = corners[np.argsort(angles)]
    return ordered
