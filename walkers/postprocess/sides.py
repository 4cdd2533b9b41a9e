"""Walkers by direction at the start, and those of a tray: a mean over all may not be the velocity of any walker."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from walkers.rounding import with_decimals

if TYPE_CHECKING:
    import numpy.typing as npt

    from walkers.postprocess.dump import BoolArray, IntArray

SAME = 0.05
"""Mean velocities of the two directions are printed separately if they differ by more than this share …"""
STEADY_SPEED = 1e-5
"""… and by more than this, m/s; halves of a run that differ by less are steady."""
REST = 2e-6
"""m/s; slower walkers are at rest: velocities that count as constant may differ by as much."""
SEPARATED = 0.1
"""Share of the time with beads beyond the rupture distance above which a walker came apart."""
_ACROSS = 0.02
"""Cosine: walkers that start across the drive axis, within about 1°, face as ``facing`` says."""


def ways(*, uphill: bool) -> tuple[str, str]:
    """Names of the directions along the drive axis, the positive one first."""
    return ("up", "down") if uphill else ("right", "left")


def differ(one: float, other: float) -> bool:
    """Whether the mean velocities (m/s) of the two directions differ; false for NaN."""
    return abs(one - other) > max(SAME * max(abs(one), abs(other)), STEADY_SPEED)


def sides(facing: npt.ArrayLike, start_angle: npt.ArrayLike) -> IntArray:
    """Direction in which walkers face at their start: 1 along the drive axis, −1 opposite; the angle counts."""
    import numpy as np

    return np.where(np.cos(start_angle) < -_ACROSS, np.negative(facing), facing)


def alike(facing: IntArray, *, uphill: bool) -> BoolArray:
    """Walkers over which gait and work are averaged, shape (W,): on a slope those facing up, if there are any."""
    up = facing > 0
    return up if uphill and up.any() else up | True


def sides_apart(result: Mapping[str, Any]) -> dict[str, float]:
    """Mean velocities (m/s) of a result by direction at the start if they differ; otherwise empty.

    Empty also for walkers that may meet: the means include those that stopped (`of_tray`).
    """
    right, left = ((result.get(name) or {}).get("mean") for name in ("right_facing", "left_facing"))
    if result.get("meet") or right is None or left is None or not differ(right, left):
        return {}
    return dict(zip(ways(uphill=bool(result.get("goes_uphill"))), (right, left), strict=True))


def fell(result: Mapping[str, Any]) -> bool:
    """Whether walkers turned over or lean on a slope: then a velocity along the heading says little about their way."""
    posture = result.get("posture")  # none on level floors, and of piles
    return bool(posture and (result["turned_round"] or posture["upright"] < result["walkers"]))


def uphill_velocities(result: Mapping[str, Any]) -> dict[str, float]:
    """Mean velocities (m/s) up the slope, by direction at the start if they differ; none on level floors."""
    if not result.get("posture"):
        return {}
    axial = result["axial_velocity"]
    up, down = axial["right_facing"], axial["left_facing"]
    if up is None or down is None or not differ(up, down):
        return {"axial": axial["mean"]}
    return {"axial, started up": up, "started down": down}


def came_apart(result: Mapping[str, Any]) -> str:
    """How long beads of walkers were farther apart than bridges reach, if too long for a velocity; otherwise empty."""
    share = result.get("separated_fraction") or 0.0
    if share <= SEPARATED or result.get("meet"):
        return ""
    return f"came apart: beads beyond the rupture distance for {100.0 * share:.0f} % of the time"


def of_tray(result: Mapping[str, Any]) -> list[str]:
    """Walkers that may meet: speed of free ones, then numbers at the end, as text; empty for other walkers."""
    if not result.get("meet") or "held_share" not in result:
        return []
    free, count, joined, held = (result[key] for key in ("free_speed", "walkers", "clustered_share", "held_share"))
    by_side = "held by a side, directly or through others"
    shares = {"slow": result["slow_share"], "connected": joined, by_side: held or None}
    told = "mm/s from cycle to cycle, settling and turning included"
    speed = "" if free is None else f"free walkers {with_decimals(1e3 * free, 3)} {told}"
    return [
        speed or "no walker is free",
        *(f"{round(count * share)} of {count} {what}" for what, share in shares.items() if share is not None),
        *(["none free"] if free is not None and max(joined, held) == 1.0 else []),
    ]
