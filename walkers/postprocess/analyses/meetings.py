"""Analysis of walkers that may meet: meetings and their outcome, clustering and jamming.

Walkers that bridges connect, directly or through others, are *joined*: they are a cluster. A cluster, or a single
walker, is *held* if a bridge joins one of its beads to a side wall. A walker is *free* if it is neither joined nor
held. A *meeting* of two walkers begins with the first bridge between them and ends when the last one breaks. *At the
end* means during the last tenth of the drive.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from walkers.inputs.boundary import FLOOR
from walkers.inputs.case import Case
from walkers.postprocess.analysis import Analysis, Described, Quantity
from walkers.postprocess.clusters import connected
from walkers.postprocess.dump import BoolArray, FloatArray, IntArray
from walkers.postprocess.motion import Group, Motion, read_bridges
from walkers.postprocess.tables import Columns

if TYPE_CHECKING:
    pass

_GREY = "#5b6770"
_SLOW = 0.1
"""Walkers below this fraction of the speed of free walkers are slow."""
_END = 0.1
"""Final fraction of the drive, over which the end is measured."""
_NUMBERS = {
    "meeting_rate": ("meeting rate", "1/s", "number of meetings of a walker per second"),
    "clustered_share": ("walkers in clusters", "share", "share of walkers joined to others in the last frame"),
    "largest_cluster": ("walkers in the largest cluster", "", "cluster size in the last frame; 1 if none are joined"),
    "held_share": (
        "walkers held by side walls",
        "share",
        "share of walkers joined to a side wall in the last frame, directly or through others",
    ),
    "nematic_order": (
        "nematic order along the drive axis",
        "",
        "mean of cos 2θ over all walkers and the last tenth of the drive, θ: angle from the drive axis to the heading; "
        "1 if all are along the axis, 0 if random, -1 if all are across it",
    ),
    "polar_order": (
        "polar order",
        "",
        "length of the mean heading vector of all walkers, averaged over the last tenth of the drive: 1 if all "
        "headings are equal, 0.89/√N for N random headings",
    ),
    "free_speed": (
        "speed of free walkers",
        "m/s",
        "mean speed from cycle to cycle, settling included, of walkers that are not joined to a walker or a side wall",
    ),
    "joined_speed": (
        "speed of joined walkers",
        "m/s",
        "mean speed, from cycle to cycle, of walkers in clusters that are not joined to a side wall",
    ),
    "speed_ratio": ("speed of joined walkers over speed of free walkers", "", "joined_speed over free_speed"),
    "slow_share": (
        "slow walkers at the end",
        "share",
        "share of walkers whose net speed over the last tenth of the drive is below a tenth of free_speed",
    ),
}
"""Numbers of the result that have a column: label in reports, unit, meaning."""


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


class Meetings(Analysis):
    """Meetings of walkers: partners, duration, size of groups."""

    order = 1
    name = "meetings"
    tables = ("meetings",)
    derived: ClassVar[Described] = {
        "coverage": (
            "",
            "projected area of the beads over the floor area of the container; on an open substrate, over the area of "
            "the squares on which the walkers start",
        )
    }

    def applies(self, case: Case) -> bool:
        """Cases whose walkers may meet."""
        return case.meets

    def derived_of(self, case: Case) -> dict[str, float]:
        """Coverage, rounded to three digits so that equal trays form one group in figures."""
        boundary, spacing = case.boundary, max(one.spacing for one in case.walkers)
        cell = spacing * (boundary.width or spacing)
        floor = boundary.cross_section if boundary.closed else cell * sum(one.replicates for one in case.walkers)
        return {"coverage": float(f"{pi * sum(radius**2 for radius in case.all_radii) / floor:.3g}")}

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Events between recorded frames of bridges; walkers that are joined in the first frame merge at that time."""
        rows: list[tuple[float, str, int, int, int, float]] = []
        before: frozenset[tuple[int, int]] = frozenset()
        centre, heading = _places(motion)
        floored = motion.case.boundary.walls[0].name == FLOOR
        frames, sizes, held = [], [], []
        for bridges in read_bridges(motion):
            owners = np.sort(motion.walker_of[bridges.beads], axis=1)
            apart = (owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])
            now = frozenset((int(one), int(other)) for one, other in owners[apart])
            labels = connected(len(motion.walkers), np.array(sorted(now), dtype=np.int64).reshape(-1, 2))
            size = np.bincount(labels)[labels]
            at_sides = motion.walker_of[bridges.wall_beads[(bridges.walls > 0) & floored]]
            held.append(np.isin(labels, labels[at_sides[at_sides >= 0]]))
            sizes.append(size)
            frames.append(bridges.frame)
            seconds = float(motion.time[bridges.frame])
            for event, pairs in (("merged", now - before), ("parted", before - now)):
                for one, other in sorted(pairs):
                    cosine = float(heading[bridges.frame, one] @ heading[bridges.frame, other])
                    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
                    rows.append((seconds, event, one, other, int(size[one]), angle))
            before = now
        groups = [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]
        table = _table(rows)
        events = table["event"].tolist()
        run = motion.case.run
        often = max(1, run.samples_per_cycle // run.samples_per_bridge_sample)
        # The same phase of each cycle of the drive.
        kept = np.arange(len(frames) - 1, -1, -often)[::-1]
        kept = kept[motion.time[frames][kept] >= 0.0]
        strobed = np.array(frames)[kept]
        course = Course(
            motion.time[strobed], centre[strobed], heading[strobed], np.array(sizes)[kept], np.array(held)[kept]
        )
        return {"meetings": table}, {
            "merged": events.count("merged"),
            "parted": events.count("parted"),
            "largest_group": int(np.max(sizes)),
            "groups_at_end": sorted((group for group in groups if len(group) > 1), key=len, reverse=True),
            **collective(course, events.count("merged"), np.array(motion.case.drive_axis)[:2]),
        }

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """Numbers and outcomes of meetings, sizes of clusters, orientational order, speeds."""
        del result
        label = "meetings of walkers"
        yield Quantity("merged", f"{label}: merged", "", "merged", "number of events in which two walkers merge")
        yield Quantity("parted", f"{label}: parted", "", "parted", "number of events in which two walkers separate")
        text = "largest number of walkers joined by bridges at any time"
        yield Quantity("largest_group", "largest group of walkers", "", "largest_group", text)
        for name, (label, unit, text) in _NUMBERS.items():
            yield Quantity(name, label, unit, name, text)


def _table(rows: Sequence[tuple[float, str, int, int, int, float]]) -> Columns:
    """Table ``meetings``; there may be no rows."""
    columns = list(zip(*rows, strict=True)) or [()] * 6
    kinds = {"time": float, "event": str, "walker": int, "other": int, "size": int, "angle": float}
    return {name: np.array(values, dtype=kind) for (name, kind), values in zip(kinds.items(), columns, strict=True)}


def _places(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Centres of mass (m) and headings of all walkers in the plane of the floor, shape (F, W, 2)."""
    centre, heading = (np.zeros((len(motion.time), len(motion.walkers), 2)) for _ in range(2))
    for number, make in enumerate(motion.case.walkers):
        group = Group(motion, make, [walker for walker in motion.walkers if walker.make == number])
        own = [walker.walker for walker in group.walkers]
        centre[:, own], heading[:, own] = group.mass_centre[..., :2], group.heading[..., :2]
    return centre, heading


def collective(course: Course, merged: int, axis: FloatArray) -> dict[str, Any]:
    """Collective quantities of a result, defined by the columns of `Meetings`; None for undefined quantities.

    ``merged`` is the number of meetings, ``axis`` the unit vector of the drive.
    """
    time, last = course.time, len(course.time) - 1
    begin = min(int(np.searchsorted(time, time[-1] - _END * (time[-1] - time[0]))), last - 1)
    steps = np.diff(time)[:, None]
    speed = np.linalg.norm(np.diff(course.centre, axis=0), axis=-1) / steps

    def mean_speed(there: BoolArray) -> float:
        """Mean speed over the intervals at both ends of which a condition holds."""
        found = speed[there[:-1] & there[1:]]
        return float(found.mean()) if found.size else nan

    alone = course.size == 1
    free, joined = mean_speed(alone & ~course.held), mean_speed(~alone & ~course.held)
    way = (course.centre[-1] - course.centre[begin]) / (time[-1] - time[begin])
    slow = np.linalg.norm(way, axis=-1) < _SLOW * free
    heading = course.heading[begin:]
    numbers = {
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
    return {name: one if isfinite(one) else None for name, one in numbers.items()}
