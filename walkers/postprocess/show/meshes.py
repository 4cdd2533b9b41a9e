"""Meshes of scenes: walls, lines on floors, and balls whose colours show how they turn."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import from_the_side

if TYPE_CHECKING:
    import pyvista as pv


_LUNES = 6


def walls_of(motion: Motion) -> list[FloatArray]:
    """Corners of each wall, counterclockwise as seen from the beads, m, shape (K, 3).

    The walls of a container end at its rim, unbounded walls around the beads. A cylinder is a prism; a vessel of the
    user's own is its triangles.
    """
    margin = 4.0 * float(motion.radius.max())
    low, high = motion.position.min(axis=(0, 1)) - margin, motion.position.max(axis=(0, 1)) + margin
    return motion.case.boundary.geometry.outline(low, high, motion.position[0, 0])


def mesh_of(faces: Sequence[FloatArray]) -> pv.PolyData:
    """A mesh of polygons, given their corners."""
    import pyvista as pv

    points, sizes = np.concatenate(faces), np.array([len(corners) for corners in faces])
    cells = np.insert(np.arange(len(points)), np.cumsum(sizes) - sizes, sizes)
    return pv.PolyData(points, faces=cells)


def floor_lines(low: FloatArray, high: FloatArray, step: float) -> FloatArray:
    """Ends of K lines on the floor between two corners, along x and y at multiples of a step, shape (2 K, 3)."""
    lines = []
    for along, across in ((0, 1), (1, 0)):
        marks = step * np.arange(np.ceil(low[across] / step), np.floor(high[across] / step) + 1)
        ends = np.zeros((len(marks), 2, 3))
        ends[:, :, along], ends[:, :, across] = (low[along], high[along]), marks[:, None]
        lines.append(ends.reshape(-1, 3))
    return np.concatenate(lines)


def round_below(value: float) -> float:
    """Largest of the numbers …, 1, 2, 5, 10, … that does not exceed a value."""
    decade = 10.0 ** np.floor(np.log10(value) + 1e-9)
    return float(
        decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= value * (1.0 + 1e-9))
    )


def beach_ball(
    rounds: int, motion: Motion
) -> tuple[FloatArray, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Points (shape (V, 3), also the normals), triangles (shape (T, 3)) and colours of a unit ball of six lunes.

    ``rounds``, a multiple of six, is the number of cells around it. Colours are 1 in pale lunes and 0 in dark ones. The
    axis is the one about which walkers roll; in containers it is y, the direction of view.
    """
    import pyvista as pv

    axis = np.cross(
        [0.0, 0.0, 1.0], [1.0, 0.0, 0.0] if from_the_side(motion.case) else motion.case.drive_axis
    )
    look: dict[str, Any] = {"theta_resolution": rounds // _LUNES, "phi_resolution": rounds // 2 + 1}
    ends = pairwise(np.linspace(0.0, 360.0, _LUNES + 1))
    lunes = [
        pv.Sphere(radius=1.0, direction=axis, start_theta=begin, end_theta=end, **look)
        for begin, end in ends
    ]
    ball = pv.merge(lunes, merge_points=False)
    points = np.asarray(ball.points)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return points, ball.regular_faces, np.repeat(np.arange(_LUNES) % 2, len(points) // _LUNES)
