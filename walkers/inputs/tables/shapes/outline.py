"""Polygons of walls in pictures."""

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
    """The parts of walls that bound the convex room around a place.

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

    planes = [wall.tangent_planes() for wall in walls]
    points = np.concatenate([*(points for points, _ in planes), np.repeat([low, high], 3, axis=0)])
    normals = np.concatenate([*(normals for _, normals in planes), np.eye(3), -np.eye(3)])
    spaces = np.column_stack([-normals, np.einsum("px,px->p", normals, points)])
    room = HalfspaceIntersection(spaces, inside)
    faces = []
    for number, normal in enumerate(normals[:-6]):
        corners = room.intersections[[number in meeting for meeting in room.dual_facets]]
        if len(corners) > 2:
            spokes = corners - corners.mean(axis=0)
            turns = np.arctan2(spokes @ np.cross(normal, spokes[0]), spokes @ spokes[0])
            faces.append(corners[np.argsort(turns)])
    return faces
