"""The walk of walkers cycle by cycle: distance, path, orientation, and the work of the drive.

In the frame of the walls, which have the acceleration a(t), an inertial force -M a(t) acts at the mass centre of a
walker. Its work per cycle is W = -M ∮ a · dx along the path x of the mass centre relative to the walls. Friction,
bridges and collisions of a steady walker dissipate this work; in the laboratory it is the work of the walls' forces. If
a walker turns or is not steady, the two differ; the results are those of the inertial force.

Compared with 200 samples per cycle, the work with 20 samples is within 0.01 %, with 10 samples within 0.2 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Annotated

import numpy as np

from walkers.postprocess.dump import FloatArray, IntArray
from walkers.postprocess.gait import distance_walked
from walkers.postprocess.motion import Group
from walkers.postprocess.tables import Columns, columns_of

_PARTS = 10
"""Parts of an interval between samples; the force is evaluated in the middle of each part."""


@dataclass(frozen=True)
class Cycles:
    """``cycles.parquet``: one row per walker and cycle, at the beginning of the cycle; the last row is the end."""

    walker: Annotated[IntArray, "", "index of the walker, from 0"]
    cycle: Annotated[IntArray, "", "cycles of the drive since its start"]
    time: Annotated[FloatArray, "s", "time since the start of the drive"]
    distance: Annotated[FloatArray, "m", "distance along the heading, which follows a walker that turns"]
    along: Annotated[FloatArray, "m", "displacement of the centre of mass along the drive axis; on a slope uphill"]
    across: Annotated[FloatArray, "m", "displacement of the centre of mass across the drive axis, to the left"]
    orientation: Annotated[FloatArray, "rad", "angle by which the walker is turned from the direction given by facing"]
    work: Annotated[
        FloatArray, "J", "work of the drive on the walker in this cycle; NaN at the end and below 8 samples per cycle"
    ]


def cycles_of(group: Group) -> Columns:
    """Table ``cycles`` of the walkers of one make, one walker after the other."""
    run = group.case.run
    strobe = run.samples_per_cycle
    time, distance = distance_walked(group)
    way = group.mass_centre[::strobe] - group.mass_centre[0]
    work = np.full(distance.shape, np.nan)
    if group.motion.follows_cycles:
        works = work_of(group)
        work[: len(works)] = works
    count, walkers = distance.shape
    return columns_of(
        Cycles(
            np.repeat([walker.walker for walker in group.walkers], count),
            np.tile(np.arange(count) * run.cycles_per_sample, walkers),
            np.tile(time, walkers),
            *(
                values.T.reshape(-1)
                for values in (
                    distance,
                    way @ group.drive_axis,
                    way @ group.across_axis,
                    group.orientation[::strobe],
                    work,
                )
            ),
        )
    )


def mass_of(group: Group) -> float:
    """Mass of a walker, kg."""
    return float(4.0 / 3.0 * pi * np.sum(group.radii**3) * group.case.beads.density)


def work_of(group: Group) -> FloatArray:
    """Work of the drive on each walker in each cycle, J, shape (cycles, W)."""
    shares = np.linspace(0.0, 1.0, _PARTS + 1)
    ways = [Group(group.motion.between(share), group.make, group.walkers).mass_centre for share in shares]
    begin, interval = group.time[:-1], np.diff(group.time)
    work = np.zeros(ways[0].shape[:2])
    for part, (before, after) in enumerate(pairwise(ways)):
        time = begin + (part + 0.5) / _PARTS * interval
        for harmonic in group.case.excitation.harmonics:
            phase = harmonic.angular_frequency * time + harmonic.phase
            pull = harmonic.peak_acceleration * np.sin(phase)
            work += pull[:, None] * ((after - before) @ np.array(harmonic.direction))
    samples = group.case.run.samples_per_cycle
    cycles = len(work) // samples
    return np.asarray(mass_of(group) * work[: cycles * samples].reshape(cycles, samples, -1).sum(axis=1))
