"""Liquid necks: shapes of the bridges in pictures, films and the three-dimensional view.

A neck is as wide as the liquid of its bridge fills it. With the parabolic profile of the gap h(r) = s + r²/2R between
two spheres, R = R₁R₂/(R₁ + R₂), or between a sphere and a plane, R = R₁, and a straight meniscus, its volume is
V = πb²s + πb⁴/4R, hence b² = 2R (√(s² + V/πR) − s). Necks of longer gaps are thinner. V is the volume of the
bridges of the case (`walkers.physics.capillary.bridge_volume`).

Y. I. Rabinovich, M. S. Esayanur, B. M. Moudgil, Langmuir 21 (2005) 10992–10997, doi 10.1021/la0517639 (volume).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.inputs.tables.case import Case
from walkers.physics.capillary import bridge_volume
from walkers.postprocess.measure.motion import Motion, read_bridges

NECK_COLOUR, NECK_OPACITY = 0x3FA0FF, 0.8
"""Colour of necks; they are translucent."""
NECK_LEGEND = "blue: liquid bridges"
Ends = tuple[FloatArray, FloatArray]
NO_BRIDGES: IntArray = np.empty((0, 3), dtype=np.int64)
_ENDS, _WAIST = (
    1.12,
    0.92,
)  # width of a curved meniscus at its ends and in its middle over that of the straight one
_WIDEST = 0.9  # largest width of a neck over that of the smaller bead


def bridges_at(motion: Motion, frames: npt.ArrayLike) -> list[IntArray]:
    """Contacts of the recorded bridges that are nearest in time to each of some frames."""
    frames, stride = np.asarray(frames), motion.case.run.samples_per_bridge_sample
    recorded = np.array(
        [frame for frame, (_, number) in enumerate(motion.frames) if number % stride == 0]
    )
    if not len(recorded):
        return [NO_BRIDGES] * len(frames)
    nearest = recorded[np.abs(np.subtract.outer(frames, recorded)).argmin(axis=1)].tolist()
    contacts = {bridges.frame: bridges.contacts for bridges in read_bridges(motion, set(nearest))}
    return [contacts[frame] for frame in nearest]


def bridges_text(case: Case) -> str:
    """What is blue, and how often the bridges were recorded if not in every frame."""
    every = case.run.samples_per_cycle // case.run.samples_per_bridge_sample
    often = "once" if every == 1 else f"{every} times"
    return NECK_LEGEND + (
        f", recorded {often} per cycle" if case.run.samples_per_bridge_sample > 1 else ""
    )


def bridge_ends(motion: Motion, place: FloatArray, contacts: IntArray) -> Ends:
    """Centres of the first beads of contacts, and of the second beads or the nearest points of walls, m, shape (K, 3).

    ``place`` are the centres of all beads relative to the boundary, m, shape (N, 3).
    """
    begins, ends = place[contacts[:, 0]], place[contacts[:, 1]]
    for number, wall in enumerate(motion.case.boundary.walls):
        held = contacts[:, 2] == number
        ends[held] = wall.nearest_points(begins[held])
    return begins, ends


def at_front_walls(
    motion: Motion, contacts: IntArray, ends: Ends, toward: FloatArray
) -> npt.NDArray[np.bool_]:
    """Which contacts are with walls between the beads and a camera in the direction ``toward``, shape (K,).

    Pictures do not draw these walls, so that the beads are visible.
    """
    begins, second_ends = ends
    to_walls = contacts[:, 2] >= 0
    return np.asarray(
        to_walls & ((second_ends - begins) @ toward > 0.5 * motion.radius[contacts[:, 0]])
    )


def neck_surfaces(
    motion: Motion,
    contacts: IntArray,
    between: Ends,
    rings: int,
    sides: int,
    share: FloatArray | float = 1.0,
) -> Ends:
    """Points and normals of the necks of contacts, mm, shape (K, rings × sides, 3), ``between`` their ends (`bridge_ends`).

    ``share`` is the width that is drawn over the width of the neck.
    """
    begins, ends = between
    radius = motion.radius[contacts[:, 0]]
    second_radius = np.where(contacts[:, 1] < 0, np.inf, motion.radius[contacts[:, 1]])
    volume = np.vectorize(bridge_volume, [float], excluded=[2])(
        radius, second_radius, motion.case.liquid.of_bridges
    )
    reduced = 1.0 / (1.0 / radius + 1.0 / second_radius)
    length = np.linalg.norm(ends - begins, axis=1)
    beyond = np.where(np.isfinite(second_radius), second_radius, 0.0)
    gap = np.maximum(length - radius - beyond, 0.0)
    wide = np.sqrt(2.0 * reduced * (np.hypot(gap, np.sqrt(volume / (np.pi * reduced))) - gap))
    wide = share * np.minimum(_ENDS * wide, _WIDEST * np.minimum(radius, second_radius))
    along = (ends - begins) / length[:, None]
    first = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    around = 2.0 * np.pi * np.arange(sides) / sides
    out = (
        np.cos(around)[:, None] * first[:, None]
        + np.sin(around)[:, None] * np.cross(along, first)[:, None]
    )
    # From the surface of the first bead to that of the second, or to the wall.
    low = np.sqrt(radius**2 - wide**2)
    high = length - np.sqrt(np.where(np.isfinite(second_radius), beyond**2 - wide**2, 0.0))
    step = np.linspace(-1.0, 1.0, rings)
    height = (low + high)[:, None] / 2.0 + (high - low)[:, None] / 2.0 * step
    width = wide[:, None] * (_WAIST + (_ENDS - _WAIST) * step**2) / _ENDS
    points = begins[:, None, None] + height[..., None, None] * along[:, None, None]
    points = points + width[..., None, None] * out[:, None]
    normals = np.broadcast_to(out[:, None], points.shape)
    return 1e3 * points.reshape(len(contacts), rings * sides, 3), normals.reshape(
        len(contacts), rings * sides, 3
    )


def neck_triangles(count: int, rings: int, sides: int) -> npt.NDArray[Any]:
    """Corners of the triangles of ``count`` necks, shape (T, 3), counterclockwise as seen from outside."""
    low, side = np.arange((rings - 1) * sides), np.arange((rings - 1) * sides) % sides
    beside = low - side + (side + 1) % sides
    corners = np.concatenate(
        [
            np.stack([low, beside, low + sides], 1),
            np.stack([beside, beside + sides, low + sides], 1),
        ]
    )
    return (corners + rings * sides * np.arange(count)[:, None, None]).reshape(-1, 3)
