"""Walkers that may meet: meetings and their outcome, clustering and jamming.

Walkers that bridges connect, directly or through others, are *joined*: they are a cluster. A cluster, or a single
walker, is *held* if a bridge joins one of its beads to a side wall. A walker is *free* if it is neither joined nor
held. A *meeting* of two walkers begins with the first bridge between them and ends when the last one breaks. *At the
end* means during the last tenth of the drive.
"""

from __future__ import annotations

from itertools import pairwise
from math import isfinite, nan, pi
from typing import Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import FLOOR
from walkers.postprocess.measure.clusters import connected
from walkers.postprocess.measure.motion import Bridges, Motion
from walkers.postprocess.measure.numbers import Measurement
from walkers.postprocess.measure.tables import columns_of

NAME = "meetings"
VERSION = 2

_SLOW = 0.1
"""Walkers below this fraction of the speed of free walkers are slow."""
_END = 0.1
"""Final fraction of the drive, over which the end is measured."""


def applies(case: Case) -> bool:
    """Whether walkers of a case may meet."""
    return case.meets


def derived(case: Case) -> dict[str, float]:
    """Coverage, rounded to three digits so that equal trays form one group in figures."""
    boundary, spacing = case.boundary, max(kind.spacing for kind in case.walkers)
    cell = spacing * (boundary.width or spacing)
    floor = (
        boundary.geometry.cross_section
        if boundary.closed
        else cell * sum(kind.replicates for kind in case.walkers)
    )
    return {"coverage": float(f"{pi * sum(radius**2 for radius in case.all_radii) / floor:.3g}")}


def measure(motion: Motion) -> Measurement:
    """Table and numbers; walkers that are joined in the first frame merge at that time."""
    (centre, heading), run = centres_and_headings(motion), motion.case.run
    frames = np.array([bridges.frame for bridges in motion.bridges])
    joined, *states = zip(*(_state_of(motion, bridges) for bridges in motion.bridges), strict=True)
    size, held = map(np.array, states)
    rows: list[tuple[int, str, int, int, int]] = []
    for number, (before, now) in enumerate(pairwise((frozenset(), *joined))):
        for event, pairs in (("merged", now - before), ("parted", before - now)):
            rows += [
                (frames[number], event, *pair, size[number, pair[0]]) for pair in sorted(pairs)
            ]
    table = columns_of(rows, {"frame": int, "event": str, "walker": int, "other": int, "size": int})
    frame, walker, partner = table.pop("frame"), table["walker"], table["other"]
    cosine = (heading[frame, walker] * heading[frame, partner]).sum(axis=-1)
    table |= {"time": motion.time[frame], "angle": np.arccos(np.clip(cosine, -1.0, 1.0))}
    merged = int(np.sum(table["event"] == "merged"))
    numbers = {"merged": merged, "parted": len(frame) - merged, "largest_group": int(size.max())}
    often = max(1, run.samples_per_cycle // run.samples_per_bridge_sample)
    chosen = np.arange(len(frames))[::-often][::-1]  # all at the same phase
    chosen = chosen[motion.time[frames[chosen]] >= 0.0]
    if len(at := frames[chosen]) > 1:
        course = (motion.time[at], centre[at], heading[at], size[chosen], held[chosen])
        numbers |= collective(*course, merged, np.array(motion.case.drive_axis)[:2])
    return Measurement({"meetings": table}, numbers)


def _state_of(
    motion: Motion, bridges: Bridges
) -> tuple[frozenset[tuple[int, ...]], IntArray, BoolArray]:
    """Pairs of walkers that bridges join in a frame; size of the cluster of each walker, and whether it is held."""
    owners = np.sort(motion.walker_of[bridges.beads], axis=1)
    between = owners[(owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])]
    labels = connected(len(motion.walkers), np.unique(between, axis=0))
    floored = motion.case.boundary.walls[0].name == FLOOR
    beads, walls = bridges.at_walls
    at_sides = motion.walker_of[beads[(walls > 0) & floored]]
    held = np.isin(labels, labels[at_sides[at_sides >= 0]])
    return frozenset(map(tuple, between.tolist())), np.bincount(labels)[labels], held


def centres_and_headings(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Centres of mass (m) and headings of all walkers in the plane of the floor, shape (F, W, 2)."""
    centre, heading = (np.zeros((len(motion.time), len(motion.walkers), 2)) for _ in range(2))
    for group in map(motion.group, range(len(motion.case.walkers))):
        numbers = [walker.walker for walker in group.walkers]
        centre[:, numbers], heading[:, numbers] = group.mass_centre[..., :2], group.heading[..., :2]
    return centre, heading


def collective(
    time: FloatArray,
    centre: FloatArray,
    heading: FloatArray,
    size: IntArray,
    held: BoolArray,
    merged: int,
    axis: FloatArray,
) -> dict[str, Any]:
    """Collective numbers of a result of W walkers in K frames, two or more, at least one per cycle; NaN if undefined.

    ``centre`` (of mass, m) and ``heading`` have the shape (K, W, 2), ``size`` (number of walkers in the cluster) and
    ``held`` (K, W); ``merged`` is the number of meetings, ``axis`` the unit vector of the drive.
    """
    begin = min(int(np.searchsorted(time, time[-1] - _END * (time[-1] - time[0]))), len(time) - 2)
    speed = np.linalg.norm(np.diff(centre, axis=0), axis=-1) / np.diff(time)[:, None]
    alone, late = size == 1, heading[begin:]

    def mean_speed(chosen: BoolArray) -> float:
        """Mean speed over the intervals at both ends of which a condition holds."""
        speeds = speed[chosen[:-1] & chosen[1:]]
        return float(speeds.mean()) if speeds.size else nan

    free, joined = mean_speed(alone & ~held), mean_speed(~alone & ~held)
    late_velocity = (centre[-1] - centre[begin]) / (time[-1] - time[begin])
    slow = np.linalg.norm(late_velocity, axis=-1) < _SLOW * free
    return {
        "meeting_rate": 2.0 * merged / (size.shape[1] * float(time[-1] - time[0])),
        "clustered_share": float((~alone[-1]).mean()),
        "largest_cluster": int(size[-1].max()),
        "held_share": float(held[-1].mean()),
        "nematic_order": float((2.0 * (late @ axis) ** 2 - 1.0).mean()),
        "polar_order": float(np.linalg.norm(late.mean(axis=1), axis=-1).mean()),
        "free_speed": free,
        "joined_speed": joined,
        "speed_ratio": joined / free if free else nan,
        "slow_share": float(slow.mean()) if isfinite(free) else nan,
    }
