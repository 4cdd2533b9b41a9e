"""Walkers by their direction at the start: a mean over all may not be the velocity of any walker.

This module holds the rules and tolerances by which velocities are compared. It measures nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

SAME = 0.05
"""Largest difference between two velocities that count as the same, over the larger one.

Differences up to `STEADY_SPEED` count as none. Mean velocities of the two directions that differ by
more are printed separately."""
STEADY_SPEED = 1e-5
"""Largest difference between the velocities of both halves of a run of a steady walker, m/s.

A larger difference is allowed for a fast walker
(`walkers.postprocess.measure.gait.STEADY_DIFFERENCE`)."""
REST = 2e-6
"""Speed below which a walker is at rest, m/s. Velocities that differ by less are constant."""
SEPARATED = 0.1
"""Share of the time with beads beyond the rupture distance above which a walker came apart."""
_ACROSS = 0.02
"""Cosine of the angle to the drive axis below which a walker starts across it, within about 1°.

Such a walker faces as its column ``facing`` says."""


def direction_names(*, uphill: bool) -> tuple[str, str]:
    """Names of the directions along the drive axis, the positive one first."""
    return ("up", "down") if uphill else ("right", "left")


def differ(first: float, second: float) -> bool:
    """Tell whether two mean velocities (m/s) differ; false for NaN."""
    larger = max(abs(first), abs(second))
    return abs(first - second) > max(SAME * larger, STEADY_SPEED)


def sides(facing: npt.ArrayLike, start_angle: npt.ArrayLike) -> IntArray:
    """Tell in which direction walkers face at their start.

    Parameters
    ----------
    facing : array, shape (W,)
        1 along the drive axis, −1 opposite, before they are turned.
    start_angle : array, shape (W,)
        Angle by which they are turned at the start, rad.

    Returns
    -------
    ndarray of int, shape (W,)
        1 along the drive axis, −1 opposite. Walkers that are turned by more than 90° face the other
        way.
    """
    turned_round = np.cos(start_angle) < -_ACROSS
    return np.where(turned_round, np.negative(facing), facing)


def same_heading(walkers: Mapping[str, Any] | pd.DataFrame, *, uphill: bool) -> BoolArray:
    """Choose the walkers over which means are taken.

    Parameters
    ----------
    walkers
        The table ``walkers`` of W walkers.
    uphill
        Whether the drive axis goes up a slope.

    Returns
    -------
    ndarray of bool, shape (W,)
        On a slope those that face up, if any do; otherwise all.
    """
    faces_up = sides(walkers["facing"], walkers["start_angle"]) > 0
    if uphill and faces_up.any():
        return faces_up
    return np.ones_like(faces_up)
