"""Names of the walls of a vessel: by the side where they are, and their height.

Names of walls of shapes that the program knows are in `walkers.inputs.tables.shapes`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import acos, atan2, degrees

import numpy as np

from walkers.arrays import FloatArray, Vector

FLOOR_NAME = "floor"
"""Name of a level face at the lowest point."""
_SIDES_AT_AXES = {0.0: "+x", 90.0: "+y", 180.0: "-x", 270.0: "-y"}
"""Names of the sides by their azimuths, degrees; other azimuths are their own names."""


def names_of_faces(
    normals: Sequence[Vector], heights: Sequence[tuple[float, float]] = (), *, floor: bool = False
) -> list[str]:
    """Names of the flat walls of a vessel.

    Walls are named by the side where they are, and by their height where that is not enough.

    Parameters
    ----------
    normals : sequence of Vector
        Unit normals of the walls, toward the beads.
    heights : sequence of tuple
        Lowest and highest point of each, m; empty of planes without end.
    floor : bool
        Whether the first wall is level and at the lowest point.

    Returns
    -------
    list of str
        ``floor``; ``-x``, ``+x``, ``-y``, ``+y`` for upright walls on these sides; ``60°`` for an
        upright wall at this azimuth from the x axis toward y; ``60° slope 45°`` for one that
        rises by 45° there, above 90° for one that hangs over; ``level`` and ``lid`` for level
        ones above the floor that look up and down. Walls of the same name are told apart by their
        height, ``+x 2–5 mm``, and those of the same height by numbers.
    """
    names = [_side(normal) for normal in normals]
    if floor:
        names[0] = FLOOR_NAME
    if heights:
        times = Counter(names)
        for number, (low, high) in enumerate(heights):
            if times[names[number]] > 1:
                names[number] += f" {span_text([low, high])}"
    return numbered_names(names)


def _side(normal: Vector) -> str:
    """Name of a wall by its normal, toward the beads."""
    x, y, z = normal
    slope = round(degrees(acos(max(-1.0, min(1.0, z)))), 1)
    if slope == 0.0:
        return "level"
    if slope == 180.0:
        return "lid"
    azimuth = round(degrees(atan2(-y, -x)), 1) % 360.0
    side = _SIDES_AT_AXES.get(azimuth, f"{azimuth:g}°")
    if slope == 90.0:
        return side
    return f"{side} slope {slope:g}°"


def axis_name(direction: FloatArray) -> str:
    """The axis that is nearest to a direction, with its sign, such as ``-x``."""
    axis = int(np.abs(direction).argmax())
    sign = "+" if direction[axis] > 0.0 else "-"
    return f"{sign}{'xyz'[axis]}"


def span_text(heights: Sequence[float]) -> str:
    """The range of some heights (m) as text: ``2–5 mm``."""
    low = _millimetres(min(heights))
    high = _millimetres(max(heights))
    if low == high:
        return f"{low} mm"
    return f"{low}–{high} mm"


def _millimetres(height: float) -> str:
    """A height (m) in millimetres, without its unit; 0 for −0."""
    return f"{1e3 * height + 0.0:.3g}"


def numbered_names(names: Sequence[str]) -> list[str]:
    """The names; those that are given several times get numbers."""
    times = Counter(names)
    used: Counter[str] = Counter()
    numbered = []
    for name in names:
        used[name] += 1
        if times[name] > 1:
            numbered.append(f"{name} no. {used[name]}")
        else:
            numbered.append(name)
    return numbered
