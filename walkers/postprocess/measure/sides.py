"""Walkers by direction at the start: a mean over all may not be the velocity of any walker."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

SAME = 0.05
"""Mean velocities of the two directions are printed separately if their difference exceeds this share of the larger
velocity, and `STEADY_SPEED`."""
STEADY_SPEED = 1e-5
"""m/s. A walker is steady if the velocities of the two halves of its run differ by less."""
REST = 2e-6
"""m/s. Slower walkers are at rest. Velocities that differ by less are constant."""
SEPARATED = 0.1
"""Share of the time with beads beyond the rupture distance above which a walker came apart."""
_ACROSS = 0.02
"""Cosine: walkers that start across the drive axis, within about 1°, face as ``facing`` says."""


def direction_names(*, uphill: bool) -> tuple[str, str]:
    """Names of the directions along the drive axis, the positive one first."""
    return ("up", "down") if uphill else ("right", "left")


def differ(first: float, second: float) -> bool:
    """Whether the mean velocities (m/s) of the two directions differ; false for NaN."""
    return abs(first - second) > max(SAME * max(abs(first), abs(second)), STEADY_SPEED)


def sides(facing: npt.ArrayLike, start_angle: npt.ArrayLike) -> IntArray:
    """Direction in which walkers face at their start: 1 along the drive axis, −1 opposite; the angle counts."""
    return np.where(np.cos(start_angle) < -_ACROSS, np.negative(facing), facing)


def same_heading(walkers: Mapping[str, Any] | pd.DataFrame, *, uphill: bool) -> BoolArray:
    """Rows of a table ``walkers`` over which means are taken, shape (W,): on a slope those facing up, if any do."""
    up = sides(walkers["facing"], walkers["start_angle"]) > 0
    return up if uphill and up.any() else up | True
