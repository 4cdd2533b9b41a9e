"""Liquid necks: the shapes of bridges in pictures, films and the three-dimensional view.

A neck is as wide as the liquid of its bridge fills it. With the parabolic profile of the gap
h(r) = s + r²/2R between two spheres, R = R₁R₂/(R₁ + R₂), or between a sphere and a plane, R = R₁,
and a straight meniscus of radius b, its volume is V = πb²s + πb⁴/4R, hence
b² = 2R (√(s² + V/πR) − s). Necks of longer gaps are thinner. V is the volume of the bridges of the
case (`walkers.physics.capillary.bridge_volume`). Forces do not depend on these shapes.

Y. I. Rabinovich, M. S. Esayanur, B. M. Moudgil, Langmuir 21 (2005) 10992–10997,
doi 10.1021/la0517639 (volume).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.case import Case
from walkers.physics.capillary import bridge_volume
from walkers.postprocess.measure.motion import Motion, read_bridges

NECK_COLOUR = 0x3FA0FF
"""Colour of necks: red, green, blue."""
NECK_OPACITY = 0.8
"""Opacity of necks."""
NECK_LEGEND = "blue: liquid bridges"
"""What the colour of necks means."""
NO_BRIDGES: IntArray = np.empty((0, 3), dtype=np.int64)
"""Contacts of a frame without bridges."""
_END_WIDTH = 1.12
"""Width of a curved meniscus at its ends over that of the straight one."""
_WAIST_WIDTH = 0.92
"""Width of a curved meniscus in its middle over that of the straight one."""
_LARGEST_WIDTH = 0.9
"""Largest width of a neck over that of the smaller bead."""


class Ends(NamedTuple):
    """Where K bridges begin and end.

    Attributes
    ----------
    first : ndarray, shape (K, 3)
        Centres of the first beads, m.
    second : ndarray, shape (K, 3)
        Centres of the second beads, or the nearest points of walls, m.
    """

    first: FloatArray
    second: FloatArray


class NeckGrid(NamedTuple):
    """How finely necks are drawn.

    Attributes
    ----------
    rings
        Number of rings of points along a neck.
    sides
        Number of points of a ring.
    """

    rings: int
    sides: int


def bridges_at(motion: Motion, frames: npt.ArrayLike) -> list[IntArray]:
    """Contacts with bridges, as recorded in the frame nearest to each of some frames.

    Parameters
    ----------
    motion
        The motion.
    frames : array_like, shape (F,)
        Numbers of frames of the motion, with fractions between two frames.

    Returns
    -------
    list of ndarray, each of shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`: both beads and -1, or the bead,
        -1 and the wall.
    """
    frames = np.asarray(frames)
    sample_numbers = np.array([number for _, number in motion.frames])
    samples_per_record = motion.case.run.samples_per_bridge_sample
    recorded = np.flatnonzero(sample_numbers % samples_per_record == 0)
    if not len(recorded):
        return [NO_BRIDGES] * len(frames)
    distances = np.abs(np.subtract.outer(frames, recorded))
    nearest = recorded[distances.argmin(axis=1)].tolist()
    contacts = {bridges.frame: bridges.contacts for bridges in read_bridges(motion, set(nearest))}
    return [contacts[frame] for frame in nearest]


def bridges_text(case: Case) -> str:
    """What is blue, and how often the bridges were recorded if not in every frame."""
    stride = case.run.samples_per_bridge_sample
    if stride == 1:
        return NECK_LEGEND
    per_cycle = case.run.samples_per_cycle // stride
    times = "once" if per_cycle == 1 else f"{per_cycle} times"
    return f"{NECK_LEGEND}, recorded {times} per cycle"


def bridge_ends(motion: Motion, position: FloatArray, contacts: IntArray) -> Ends:
    """Ends of the bridges of contacts.

    Parameters
    ----------
    motion
        The motion, for its walls.
    position : ndarray, shape (N, 3)
        Centres of all beads relative to the boundary, m.
    contacts : ndarray of int, shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`.
    """
    first = position[contacts[:, 0]]
    second = position[contacts[:, 1]]
    for number, wall in enumerate(motion.case.boundary.walls):
        is_at_wall = contacts[:, 2] == number
        second[is_at_wall] = wall.nearest_points(first[is_at_wall])
    return Ends(first, second)


def at_front_walls(motion: Motion, contacts: IntArray, ends: Ends, toward: FloatArray) -> BoolArray:
    """Which contacts are with walls between the beads and the camera.

    Pictures do not draw these walls, so that the beads are visible.

    Parameters
    ----------
    motion
        The motion.
    contacts : ndarray of int, shape (K, 3)
        Contacts.
    ends
        Their ends.
    toward : ndarray, shape (3,)
        Unit vector toward the camera.

    Returns
    -------
    ndarray of bool, shape (K,)
    """
    is_at_wall = contacts[:, 2] >= 0
    nearer = (ends.second - ends.first) @ toward
    # Side walls seen edge-on are about as far from the camera as the beads: they do not count.
    return np.asarray(is_at_wall & (nearer > 0.5 * motion.radius[contacts[:, 0]]))


def neck_surfaces(
    motion: Motion,
    contacts: IntArray,
    ends: Ends,
    grid: NeckGrid,
    share: FloatArray | float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Surfaces of the necks of contacts.

    A neck begins at the surface of its first bead and ends at that of the second, or at the wall.

    Parameters
    ----------
    motion
        The motion.
    contacts : ndarray of int, shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`.
    ends
        Their ends (`bridge_ends`).
    grid
        Number of rings and of points of each ring.
    share : float or ndarray, shape (K,)
        The width that is drawn over the width of the neck.

    Returns
    -------
    points : ndarray, shape (K, rings × sides, 3)
        Points of the surfaces, mm.
    normals : ndarray, shape (K, rings × sides, 3)
        Unit vectors across the axes of the necks, to the outside.
    """
    radius = motion.radius[contacts[:, 0]]
    second_radius = np.where(contacts[:, 1] < 0, np.inf, motion.radius[contacts[:, 1]])
    radius_beyond = np.where(np.isfinite(second_radius), second_radius, 0.0)
    length = np.linalg.norm(ends.second - ends.first, axis=1)
    gap = np.maximum(length - radius - radius_beyond, 0.0)
    neck_radius = _neck_radius(motion, radius, second_radius, gap)
    widest = _LARGEST_WIDTH * np.minimum(radius, second_radius)
    end_radius = share * np.minimum(_END_WIDTH * neck_radius, widest)

    # Heights are distances from the centre of the first bead along the axis.
    low = np.sqrt(radius**2 - end_radius**2)
    depth = np.where(np.isfinite(second_radius), radius_beyond**2 - end_radius**2, 0.0)
    high = length - np.sqrt(depth)
    step = np.linspace(-1.0, 1.0, grid.rings)
    height = (low + high)[:, None] / 2.0 + (high - low)[:, None] / 2.0 * step
    profile = _WAIST_WIDTH + (_END_WIDTH - _WAIST_WIDTH) * step**2
    ring_radius = end_radius[:, None] * profile / _END_WIDTH

    axis = (ends.second - ends.first) / length[:, None]
    outward = _across(axis, grid.sides)[:, None]
    points = ends.first[:, None, None] + height[..., None, None] * axis[:, None, None]
    points = points + ring_radius[..., None, None] * outward
    normals = np.broadcast_to(outward, points.shape)
    shape = (len(contacts), grid.rings * grid.sides, 3)
    return 1e3 * points.reshape(shape), normals.reshape(shape)


def _neck_radius(
    motion: Motion, radius: FloatArray, second_radius: FloatArray, gap: FloatArray
) -> FloatArray:
    """Radius b of straight necks (see the module), m; a wall has an infinite ``second_radius``."""
    liquid = motion.case.liquid.of_bridges
    volume_of = np.vectorize(bridge_volume, [float], excluded=[2])
    volume = volume_of(radius, second_radius, liquid)
    reduced = 1.0 / (1.0 / radius + 1.0 / second_radius)
    neck_radius: FloatArray = np.sqrt(
        2.0 * reduced * (np.hypot(gap, np.sqrt(volume / (np.pi * reduced))) - gap)
    )
    return neck_radius


def _across(axis: FloatArray, count: int) -> FloatArray:
    """Unit vectors across axes, evenly around them.

    Parameters
    ----------
    axis : ndarray, shape (K, 3)
        Unit vectors.
    count
        Number of vectors around each axis.

    Returns
    -------
    ndarray, shape (K, count, 3)
    """
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axis, first)
    angle = 2.0 * np.pi * np.arange(count) / count
    across: FloatArray = (
        np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    )
    return across


def neck_triangles(count: int, grid: NeckGrid) -> npt.NDArray[Any]:
    """Triangles of a number of necks, as indices of their points in the order of `neck_surfaces`.

    Parameters
    ----------
    count
        Number of necks.
    grid
        Number of rings and of points of each ring.

    Returns
    -------
    ndarray of int, shape (T, 3)
        Corners of triangles, counterclockwise as seen from outside.
    """
    rings, sides = grid
    corner = np.arange((rings - 1) * sides)  # of all rings but the last
    side = corner % sides
    neighbour = corner - side + (side + 1) % sides  # the next point of the same ring
    lower = np.stack([corner, neighbour, corner + sides], 1)
    upper = np.stack([neighbour, neighbour + sides, corner + sides], 1)
    corners = np.concatenate([lower, upper])
    first_points = rings * sides * np.arange(count)
    triangles: npt.NDArray[Any] = (corners + first_points[:, None, None]).reshape(-1, 3)
    return triangles
