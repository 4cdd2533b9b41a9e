"""What became of walkers on a slope or a wall: whether they stay as they were to face, or turn over.

A walker that leads uphill with its large bead stands on its head, as a pendulum would; a velocity says nothing of it
unless it is known whether it still does. Judged once a cycle, by the angle from where it was to face:

    turned over  it was off by more than a right angle at some time
    upright      it ends within 15° and is tilting no more: in the second half of the run it came nearer, or went off by
                 less than half a degree
    leaning      anything else
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

import numpy as np

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Group

UPRIGHT = np.radians(15.0)
"""rad; how far off an upright walker may end."""
_NO_MORE = np.radians(0.5)
"""rad; what it may go off by in the second half of a run."""
POSTURES = ("upright", "leaning", "turned over")


def turned_over_at(group: Group) -> FloatArray:
    """When each walker was first off by more than a right angle, s; NaN for one that never was, shape (W,)."""
    over = np.abs(_strobed(group)) > np.pi / 2.0
    time = group.time[:: group.case.run.samples_per_cycle]
    return np.where(over.any(axis=0), time[over.argmax(axis=0)], np.nan)


def postures(group: Group) -> list[str]:
    """Of each walker one of `POSTURES`."""
    off = np.abs(_strobed(group))
    end, middle = off[-1], off[len(off) // 2]
    stands = (end <= UPRIGHT) & (end <= middle + _NO_MORE)
    turned = np.isfinite(turned_over_at(group))
    return [POSTURES[number] for number in np.select([turned, stands], [2, 0], 1)]


def _strobed(group: Group) -> FloatArray:
    strobed: FloatArray = group.orientation[:: group.case.run.samples_per_cycle]
    return strobed


def ways(*, uphill: bool) -> tuple[str, str]:
    """What the ways along the drive axis are called, the one that is positive first."""
    return ("up", "down") if uphill else ("right", "left")


def posture_summary(found: Sequence[str], turned_at: FloatArray, end: FloatArray) -> dict[str, Any]:
    """How many walkers are how, when the first and the last turned over (s), and how far off the others end (rad)."""
    counts = Counter(found)
    over = turned_at[np.isfinite(turned_at)]
    kept = np.abs(end)[np.isnan(turned_at)]
    return {
        **{name: counts[name] for name in POSTURES},
        "turned_at": [float(over.min()), float(over.max())] if len(over) else None,
        "ends_within": float(kept.max()) if len(kept) else None,
    }


def describe_posture(summary: Mapping[str, Any]) -> str:
    """The same in a few words, angles in degrees: "upright to the end, within 0.1°"."""
    count = sum(summary[name] for name in POSTURES)
    within = "" if summary["ends_within"] is None else f", within {degrees(summary['ends_within']):.1f}°"
    when = ""
    if summary["turned_at"]:
        first, last = (f"{time:.2f}" for time in summary["turned_at"])
        when = f" after {first} s" if first == last else f" after {first} to {last} s"
    told = {
        "upright": "upright to the end",
        "leaning": "leaning, and may turn over yet",
        "turned over": f"turned over{when}",
    }
    there = [name for name in POSTURES if summary[name]]
    last_kept = [name for name in there if name != "turned over"][-1:]
    return "; ".join(
        ("" if summary[name] == count else f"{summary[name]} of {count} ")
        + told[name]
        + (within if name in last_kept else "")
        for name in there
    )
