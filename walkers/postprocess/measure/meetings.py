"""Walkers that may meet: meetings and their outcome, clustering and jamming.

Walkers that bridges connect, directly or through others, are *joined*: they are a cluster. A
cluster, or a single walker, is *held* if a bridge joins one of its beads to a side wall. A walker
is *free* if it is neither joined nor held. A *meeting* of two walkers begins with the first bridge
between them and ends when the last one breaks. *At the end* means during the last tenth of the
drive.

Clusters of loose beads are the subject of `walkers.postprocess.measure.clusters`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import Any, NamedTuple

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
    """Tell whether walkers of a case may meet."""
    return case.meets


def derived(case: Case) -> dict[str, float]:
    """Compute the coverage of the substrate by the beads.

    It is rounded to three digits, so that equal trays form one group in figures.
    """
    boundary = case.boundary
    if boundary.closed:
        area = boundary.geometry.cross_section
    else:
        spacing = 0.0
        walkers = 0
        for kind in case.walkers:
            spacing = max(spacing, kind.spacing)
            walkers += kind.replicates
        spacing_across = boundary.width or spacing  # in a channel, its whole width
        area = spacing * spacing_across * walkers
    beads = pi * sum(radius**2 for radius in case.all_radii)
    return {"coverage": float(f"{beads / area:.3g}")}


def measure(motion: Motion) -> Measurement:
    """Measure meetings, and what many walkers do together.

    Parameters
    ----------
    motion
        Motion of a run whose walkers may meet.

    Returns
    -------
    Measurement
        The table ``meetings``, with a row for each time that two walkers merged or parted, and the
        numbers of the group ``meetings``. Walkers that are joined in the first frame merge at that
        time. The columns are ``event`` (``merged`` or ``parted``), ``time`` (s), the numbers of
        both walkers (``walker``, ``other``), the ``size`` of the cluster of the first one after
        the event, and the ``angle`` between their headings (rad).
    """
    centre, heading = centres_and_headings(motion)
    frames = np.array([bridges.frame for bridges in motion.bridges])
    states = [_state_of(motion, bridges) for bridges in motion.bridges]
    size = np.array([state.size for state in states])
    held = np.array([state.held for state in states])

    rows: list[tuple[int, str, int, int, int]] = []
    before: frozenset[tuple[int, int]] = frozenset()
    for number, state in enumerate(states):
        frame = frames[number]
        for event, pairs in (("merged", state.joined - before), ("parted", before - state.joined)):
            rows += [
                (frame, event, walker, partner, size[number, walker])
                for walker, partner in sorted(pairs)
            ]
        before = state.joined
    types = {"frame": int, "event": str, "walker": int, "other": int, "size": int}
    table = columns_of(rows, types)
    frame_of_event = table.pop("frame")
    first_heading = heading[frame_of_event, table["walker"]]
    second_heading = heading[frame_of_event, table["other"]]
    cosine = (first_heading * second_heading).sum(axis=-1)
    table["time"] = motion.time[frame_of_event]
    table["angle"] = np.arccos(np.clip(cosine, -1.0, 1.0))

    mergers = int(np.sum(table["event"] == "merged"))
    numbers = {
        "merged": mergers,
        "parted": len(frame_of_event) - mergers,
        "largest_group": int(size.max()),
    }
    run = motion.case.run
    # One sample of the bridges per cycle, all at the phase of the last one, after the drive began.
    bridge_samples_per_cycle = max(1, run.samples_per_cycle // run.samples_per_bridge_sample)
    once_per_cycle = np.arange(len(frames))[::-bridge_samples_per_cycle][::-1]
    once_per_cycle = once_per_cycle[motion.time[frames[once_per_cycle]] >= 0.0]
    if len(once_per_cycle) > 1:
        motion_frames = frames[once_per_cycle]
        course = TrayCourse(
            time=motion.time[motion_frames],
            centre=centre[motion_frames],
            heading=heading[motion_frames],
            size=size[once_per_cycle],
            held=held[once_per_cycle],
        )
        numbers |= collective(course, mergers, np.array(motion.case.drive_axis)[:2])
    return Measurement({"meetings": table}, numbers)


class _State(NamedTuple):
    """How W walkers are joined in a frame.

    Attributes
    ----------
    joined
        Pairs of walkers between which there is a bridge, the smaller index first.
    size : ndarray of int, shape (W,)
        Number of walkers in the cluster of each walker.
    held : ndarray of bool, shape (W,)
        Whether this cluster is held by a side wall.
    """

    joined: frozenset[tuple[int, int]]
    size: IntArray
    held: BoolArray


def _state_of(motion: Motion, bridges: Bridges) -> _State:
    """How walkers are joined in the frame of the bridges."""
    owners = np.sort(motion.walker_of[bridges.beads], axis=1)
    between_walkers = (owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])
    pairs = owners[between_walkers]
    labels = connected(len(motion.walkers), np.unique(pairs, axis=0))
    # The walls of a groove are no side walls: walkers stand on both.
    has_floor = motion.case.boundary.walls[0].name == FLOOR
    beads, walls = bridges.at_walls
    at_sides = motion.walker_of[beads[(walls > 0) & has_floor]]
    held = np.isin(labels, labels[at_sides[at_sides >= 0]])
    joined = frozenset((first, second) for first, second in pairs.tolist())
    return _State(joined=joined, size=np.bincount(labels)[labels], held=held)


def centres_and_headings(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Centres of mass and headings of all walkers in the plane of the substrate.

    Parameters
    ----------
    motion
        The motion of F frames of W walkers.

    Returns
    -------
    centre : ndarray, shape (F, W, 2)
        Centres of mass, m.
    heading : ndarray, shape (F, W, 2)
        Headings.
    """
    centre = np.zeros((len(motion.time), len(motion.walkers), 2))
    heading = np.zeros((len(motion.time), len(motion.walkers), 2))
    for number in range(len(motion.case.walkers)):
        group = motion.group(number)
        centre[:, group.walker_numbers] = group.mass_centre[..., :2]
        heading[:, group.walker_numbers] = group.heading[..., :2]
    return centre, heading


@dataclass(frozen=True)
class TrayCourse:
    """What W walkers do in K frames of the drive, two or more, at least one per cycle.

    Attributes
    ----------
    time : ndarray, shape (K,)
        Time of the frames, s.
    centre : ndarray, shape (K, W, 2)
        Centres of mass in the plane of the substrate, m.
    heading : ndarray, shape (K, W, 2)
        Headings in the plane of the substrate.
    size : ndarray of int, shape (K, W)
        Number of walkers in the cluster of each walker.
    held : ndarray of bool, shape (K, W)
        Whether this cluster is held by a side wall.
    """

    time: FloatArray
    centre: FloatArray
    heading: FloatArray
    size: IntArray
    held: BoolArray

    @property
    def duration(self) -> float:
        """Time from the first frame to the last one, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def first_frame_of_end(self) -> int:
        """First frame of the last tenth of the drive; the last but one at the latest."""
        start = self.time[-1] - _END * (self.time[-1] - self.time[0])
        return min(int(np.searchsorted(self.time, start)), len(self.time) - 2)


def collective(course: TrayCourse, meetings: int, axis: FloatArray) -> dict[str, Any]:
    """Compute the numbers that describe what many walkers do together.

    Parameters
    ----------
    course
        The walkers during the drive.
    meetings
        Number of meetings.
    axis : ndarray, shape (2,)
        Unit vector of the drive in the plane of the substrate.

    Returns
    -------
    dict of str to number
        Numbers of the group ``meetings`` in SI units; NaN where one is not defined, such as the
        speed of joined walkers if none are joined.
    """
    time = course.time
    centre = course.centre
    speed = np.linalg.norm(np.diff(centre, axis=0), axis=-1) / np.diff(time)[:, None]
    single = course.size == 1
    free_speed = _mean_speed(speed, single & ~course.held)
    joined_speed = _mean_speed(speed, ~single & ~course.held)

    begin = course.first_frame_of_end
    final_heading = course.heading[begin:]
    final_velocity = (centre[-1] - centre[begin]) / (time[-1] - time[begin])
    slow = np.linalg.norm(final_velocity, axis=-1) < _SLOW * free_speed
    speed_ratio = nan
    if free_speed:
        speed_ratio = joined_speed / free_speed
    slow_share = nan
    if isfinite(free_speed):
        slow_share = float(slow.mean())
    walkers = course.size.shape[1]
    return {
        "meeting_rate": 2.0 * meetings / (walkers * course.duration),
        "clustered_share": float((~single[-1]).mean()),
        "largest_cluster": int(course.size[-1].max()),
        "held_share": float(course.held[-1].mean()),
        "nematic_order": float((2.0 * (final_heading @ axis) ** 2 - 1.0).mean()),
        "polar_order": float(np.linalg.norm(final_heading.mean(axis=1), axis=-1).mean()),
        "free_speed": free_speed,
        "joined_speed": joined_speed,
        "speed_ratio": speed_ratio,
        "slow_share": slow_share,
    }


def _mean_speed(speed: FloatArray, chosen: BoolArray) -> float:
    """Mean speed (m/s) over intervals at both ends of which walkers are chosen; NaN without any.

    The speed has the shape (K - 1, W), the choice of walkers (K, W).
    """
    speeds = speed[chosen[:-1] & chosen[1:]]
    if speeds.size == 0:
        return nan
    return float(speeds.mean())
