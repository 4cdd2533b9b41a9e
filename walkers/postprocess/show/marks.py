"""Marks in pictures that are drawn with matplotlib: directions of the drive, and scale bars.

Lengths are in mm along the axes of a picture. Films draw theirs in pixels
(`walkers.postprocess.show.films`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRIVE_COLOUR = "#b0203c"
"""Colour of the arrows of the drive."""
SEEN_SHARE = 0.2
"""Smallest share of the length of a direction that a picture shows of it."""


def drive_directions(case: Case) -> list[FloatArray]:
    """Unit vectors of the different directions in which the drive shakes the boundary."""
    drive = case.excitation
    if drive.record is not None:
        return [np.array(AXES[axis]) for axis in drive.record.axes]
    directions: list[FloatArray] = []
    for harmonic in drive.harmonics:
        direction = np.array(harmonic.direction)
        cosines = np.abs(np.array([*directions, np.zeros(3)]) @ direction)
        if harmonic.amplitude and cosines.max() < 1.0 - 1e-9:
            directions.append(direction)
    return directions


def seen_directions(case: Case, axes: FloatArray) -> list[FloatArray]:
    """The directions of the drive in a picture.

    Parameters
    ----------
    case
        The case.
    axes : ndarray, shape (3, 3)
        The axes of the view, as rows.

    Returns
    -------
    list of ndarray, each of shape (2,)
        The directions to the right and up in the picture; those along the view are left out.
    """
    seen = [(axes @ direction)[:2] for direction in drive_directions(case)]
    return [direction for direction in seen if np.linalg.norm(direction) > SEEN_SHARE]


def draw_drive(
    panel: Axes, directions: Sequence[FloatArray], middle: FloatArray, half_length: float
) -> None:
    """Draw an arrow with two heads for each direction of the drive.

    Parameters
    ----------
    panel
        The axes of the picture.
    directions
        Directions in the picture, each of shape (2,) (`seen_directions`).
    middle : ndarray, shape (2,)
        The middle of the arrows.
    half_length
        Half of the length of the arrow of a direction that lies in the picture.
    """
    for direction in directions:
        half = half_length * direction
        style = {"arrowstyle": "<|-|>", "color": DRIVE_COLOUR, "linewidth": 2.0}
        tip_x, tip_y = middle + half
        tail_x, tail_y = middle - half
        panel.annotate("", (tip_x, tip_y), (tail_x, tail_y), arrowprops=style)


def draw_scale_bar(
    panel: Axes, place: tuple[float, float], drawn_length: float, text: str, size: float
) -> None:
    """Draw a scale bar with its text above.

    Parameters
    ----------
    panel
        The axes of the picture.
    place
        Place of its right end.
    drawn_length
        Its length along the axes of the picture.
    text
        The length that it stands for.
    size
        Size of the text, points.
    """
    right, level = place
    left = right - drawn_length
    panel.plot([left, right], [level, level], color="black", linewidth=2.0)
    panel.annotate(
        text,
        (right, level),
        (0.0, 3.0),  # points
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=size,
    )
