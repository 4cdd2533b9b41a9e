"""Walkers by direction at the start: the mean over both directions may not be the velocity of any walker."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from walkers.postprocess.dump import BoolArray, IntArray

SAME = 0.05
"""Mean velocities of the two directions are printed separately if they differ by more than this share …"""
STEADY_SPEED = 1e-5
"""… and by more than this, m/s; halves of a run that differ by less are steady."""
REST = 2e-6
"""m/s; slower walkers are at rest: velocities that count as constant may differ by as much."""


def ways(*, uphill: bool) -> tuple[str, str]:
    """Names of the directions along the drive axis, the positive one first."""
    return ("up", "down") if uphill else ("right", "left")


def differ(one: float, other: float) -> bool:
    """Whether the mean velocities (m/s) of the two directions differ; false for NaN."""
    return abs(one - other) > max(SAME * max(abs(one), abs(other)), STEADY_SPEED)


def alike(facing: IntArray, *, uphill: bool) -> BoolArray:
    """Walkers over which gait and work are averaged, shape (W,): on a slope those facing up, if there are any."""
    up = facing > 0
    return up if uphill and up.any() else up | True


def sides_apart(result: Mapping[str, Any]) -> dict[str, float]:
    """Mean velocities (m/s) of a result by direction at the start if they differ; otherwise empty."""
    right, left = ((result.get(name) or {}).get("mean") for name in ("right_facing", "left_facing"))
    if right is None or left is None or not differ(right, left):
        return {}
    return dict(zip(ways(uphill=bool(result.get("goes_uphill"))), (right, left), strict=True))
