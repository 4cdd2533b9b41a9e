"""Meshes of scenes: walls, lines on floors, and balls whose colours show how they turn.

The meshes of liquid necks are in `walkers.postprocess.show.necks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import from_the_side

if TYPE_CHECKING:
    import pyvista as pv

_LUNES = 6
"""Number of lunes of a ball, which have two colours."""


def walls_of(motion: Motion) -> list[FloatArray]:
    """Corners of each wall, counterclockwise as seen from the beads, m, each of shape (K, 3).

    The walls of a container end at its rim, unbounded walls around the beads. A cylinder is a
    prism; a vessel of the user's own is its triangles.
    """
    margin = 4.0 * float(motion.radius.max())
    low = motion.position.min(axis=(0, 1)) - margin
    high = motion.position.max(axis=(0, 1)) + margin
    return motion.case.boundary.geometry.outline(low, high, motion.position[0, 0])


def mesh_of(faces: Sequence[FloatArray]) -> pv.PolyData:
    """A mesh of polygons, given the corners of each, shape (K, 3)."""
    import pyvista as pv

    points = np.concatenate(faces)
    sizes = np.array([len(corners) for corners in faces])
    # VTK wants the number of corners of a face before their indices.
    cells = np.insert(np.arange(len(points)), np.cumsum(sizes) - sizes, sizes)
    return pv.PolyData(points, faces=cells)


def floor_lines(low: FloatArray, high: FloatArray, step: float) -> FloatArray:
    """Lines on the floor along x and y, at multiples of a step.

    Parameters
    ----------
    low, high : ndarray, shape (2,) or (3,)
        Two corners of the floor.
    step
        Distance of the lines, in the unit of the corners.

    Returns
    -------
    ndarray, shape (2 K, 3)
        Ends of K lines: the first two rows are those of the first line.
    """
    lines = []
    for direction, across in ((0, 1), (1, 0)):
        marks = step * np.arange(np.ceil(low[across] / step), np.floor(high[across] / step) + 1)
        ends = np.zeros((len(marks), 2, 3))
        ends[:, :, direction] = (low[direction], high[direction])
        ends[:, :, across] = marks[:, None]
        lines.append(ends.reshape(-1, 3))
    return np.concatenate(lines)


def round_below(value: float) -> float:
    """Largest of the numbers …, 1, 2, 5, 10, … that does not exceed a value."""
    decade = 10.0 ** np.floor(np.log10(value) + 1e-9)
    step = 1.0
    for larger in (2.0, 5.0):
        if larger * decade <= value * (1.0 + 1e-9):
            step = larger
    return float(decade * step)


def beach_ball(cells: int, motion: Motion) -> tuple[FloatArray, IntArray, IntArray]:
    """A unit ball of six lunes, whose axis is the one about which walkers roll.

    In containers the axis is y, the direction of view.

    Parameters
    ----------
    cells
        Number of cells around the ball, a multiple of six.
    motion
        The motion, for its drive axis.

    Returns
    -------
    points : ndarray, shape (V, 3)
        Points, which are also the normals.
    triangles : ndarray of int, shape (T, 3)
        Corners of the triangles.
    shade : ndarray of int, shape (V,)
        0 for the points of dark lunes, 1 for those of pale ones, as in
        `walkers.postprocess.show.scene.Scene.colours`.
    """
    import pyvista as pv

    direction = np.array(motion.case.drive_axis)
    if from_the_side(motion.case):
        direction = np.array([1.0, 0.0, 0.0])
    axis = np.cross([0.0, 0.0, 1.0], direction)
    edges = np.linspace(0.0, 360.0, _LUNES + 1)
    lunes = []
    for number in range(_LUNES):
        lune = pv.Sphere(
            radius=1.0,
            direction=axis,
            start_theta=edges[number],
            end_theta=edges[number + 1],
            theta_resolution=cells // _LUNES,
            phi_resolution=cells // 2 + 1,
        )
        lunes.append(lune)
    ball = pv.merge(lunes, merge_points=False)
    points = np.asarray(ball.points)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    shade = np.repeat(np.arange(_LUNES) % 2, len(points) // _LUNES)
    return points, ball.regular_faces, shade
