"""Walkers that may meet: meetings and their outcome, clustering and jamming.

Walkers that bridges connect, directly or through others, are *joined*: they are a cluster. A cluster, or a single
walker, is *held* if a bridge joins one of its beads to a side wall. A walker is *free* if it is neither joined nor
held. A *meeting* of two walkers begins with the first bridge between them and ends when the last one breaks. *At the
end* means during the last tenth of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, nan, pi
from typing import Any, NamedTuple

import numpy as np

from walkers.inputs.boundary import FLOOR
from walkers.inputs.case import Case
from walkers.postprocess.clusters import connected
from walkers.postprocess.dump import BoolArray, FloatArray, IntArray
from walkers.postprocess.motion import Bridges, Motion
from walkers.postprocess.numbers import Measured
from walkers.postprocess.tables import Columns

NAME = "meetings"
"""Group of its numbers, see `walkers.postprocess.quantities.GROUPS`."""
_SLOW = 0.1
"""Walkers below this fraction of the speed of free walkers are slow."""
_END = 0.1
"""Final fraction of the drive, over which the end is measured."""


class _State(NamedTuple):
    """Pairs of walkers that bridges join in a frame; size of the cluster of each walker, and whether it is held."""

    frame: int
    pairs: frozenset[tuple[int, int]]
    size: IntArray
    held: BoolArray


@dataclass(frozen=True)
class Course:
    """W walkers in K frames, at least one per cycle.

    ``time`` (s) has the shape (K,), ``centre`` (centre of mass, m) and ``heading`` have the shape (K, W, 2); ``size``
    (number of walkers in the cluster) and ``held`` have the shape (K, W).
    """

    time: FloatArray
    centre: FloatArray
    heading: FloatArray
    size: IntArray
    held: BoolArray


def applies(case: Case) -> bool:
    """Whether walkers of a case may meet."""
    return case.meets


def derived(case: Case) -> dict[str, float]:
    """Coverage, rounded to three digits so that equal trays form one group in figures."""
    boundary, spacing = case.boundary, max(make.spacing for make in case.walkers)
    cell = spacing * (boundary.width or spacing)
    floor = boundary.cross_section if boundary.closed else cell * sum(make.replicates for make in case.walkers)
    return {"coverage": float(f"{pi * sum(radius**2 for radius in case.all_radii) / floor:.3g}")}


def measure(motion: Motion) -> Measured:
    """Table and numbers; walkers that are joined in the first frame merge at that time."""
    centre, heading = places_of(motion)
    states = [_state_of(motion, bridges) for bridges in motion.bridges]
    table = _events(motion.time, heading, states)
    merged = int(np.sum(table["event"] == "merged"))
    run = motion.case.run
    often = max(1, run.samples_per_cycle // run.samples_per_bridge_sample)
    same_phase = [state for state in states[::-often][::-1] if motion.time[state.frame] >= 0.0]
    frames = [state.frame for state in same_phase]
    size, held = (np.array([getattr(state, name) for state in same_phase]) for name in ("size", "held"))
    course = Course(motion.time[frames], centre[frames], heading[frames], size, held)
    numbers = {
        "merged": merged,
        "parted": len(table["event"]) - merged,
        "largest_group": int(max(state.size.max() for state in states)),
    }
    return Measured({"meetings": table}, numbers | collective(course, merged, np.array(motion.case.drive_axis)[:2]))


def _state_of(motion: Motion, bridges: Bridges) -> _State:
    owners = np.sort(motion.walker_of[bridges.beads], axis=1)
    between = owners[(owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])]
    labels = connected(len(motion.walkers), np.unique(between, axis=0))
    floored = motion.case.boundary.walls[0].name == FLOOR
    at_sides = motion.walker_of[bridges.wall_beads[(bridges.walls > 0) & floored]]
    held = np.isin(labels, labels[at_sides[at_sides >= 0]])
    return _State(bridges.frame, frozenset(map(tuple, between.tolist())), np.bincount(labels)[labels], held)


def _events(time: FloatArray, heading: FloatArray, states: Sequence[_State]) -> Columns:
    """Table ``meetings``: how joined pairs change from frame to frame."""
    rows: list[tuple[int, int, int, int]] = []
    events: list[str] = []
    for before, now in pairwise([states[0]._replace(pairs=frozenset()), *states]):
        for event, pairs in (("merged", now.pairs - before.pairs), ("parted", before.pairs - now.pairs)):
            rows += [(now.frame, first, second, now.size[first]) for first, second in sorted(pairs)]
            events += [event] * len(pairs)
    frame, first, second, size = np.array(rows, dtype=np.int64).reshape(-1, 4).T
    cosine = (heading[frame, first] * heading[frame, second]).sum(axis=-1)
    return {
        "time": time[frame],
        "event": np.array(events, dtype=np.str_),
        "walker": first,
        "other": second,
        "size": size,
        "angle": np.arccos(np.clip(cosine, -1.0, 1.0)),
    }


def places_of(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Centres of mass (m) and headings of all walkers in the plane of the floor, shape (F, W, 2)."""
    centre, heading = (np.zeros((len(motion.time), len(motion.walkers), 2)) for _ in range(2))
    for group in map(motion.group, range(len(motion.case.walkers))):
        numbers = [walker.walker for walker in group.walkers]
        centre[:, numbers], heading[:, numbers] = group.mass_centre[..., :2], group.heading[..., :2]
    return centre, heading


def collective(course: Course, merged: int, axis: FloatArray) -> dict[str, Any]:
    """Collective numbers of a result (`walkers.postprocess.quantities`); NaN for undefined ones.

    ``merged`` is the number of meetings, ``axis`` the unit vector of the drive.
    """
    time, last = course.time, len(course.time) - 1
    begin = min(int(np.searchsorted(time, time[-1] - _END * (time[-1] - time[0]))), last - 1)
    steps = np.diff(time)[:, None]
    speed = np.linalg.norm(np.diff(course.centre, axis=0), axis=-1) / steps

    def mean_speed(chosen: BoolArray) -> float:
        """Mean speed over the intervals at both ends of which a condition holds."""
        speeds = speed[chosen[:-1] & chosen[1:]]
        return float(speeds.mean()) if speeds.size else nan

    alone = course.size == 1
    free, joined = mean_speed(alone & ~course.held), mean_speed(~alone & ~course.held)
    way = (course.centre[-1] - course.centre[begin]) / (time[-1] - time[begin])
    slow = np.linalg.norm(way, axis=-1) < _SLOW * free
    heading = course.heading[begin:]
    return {
        "meeting_rate": 2.0 * merged / (course.size.shape[1] * float(time[-1] - time[0])),
        "clustered_share": float((~alone[-1]).mean()),
        "largest_cluster": int(course.size[-1].max()),
        "held_share": float(course.held[-1].mean()),
        "nematic_order": float((2.0 * (heading @ axis) ** 2 - 1.0).mean()),
        "polar_order": float(np.linalg.norm(heading.mean(axis=1), axis=-1).mean()),
        "free_speed": free,
        "joined_speed": joined,
        "speed_ratio": joined / free if free else nan,
        "slow_share": float(slow.mean()) if isfinite(free) else nan,
    }
