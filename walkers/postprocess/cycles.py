"""The walk of walkers cycle by cycle: distance, path, orientation, and the work of the drive.

In the frame of the walls, which have the acceleration a(t), an inertial force -M a(t) acts at the mass centre of a
walker. Its work per cycle is W = -M ∮ a · dx along the path x of the mass centre relative to the walls. Friction,
bridges and collisions of a steady walker dissipate this work; in the laboratory it is the work of the walls' forces. If
a walker turns or is not steady, the two differ; the results are those of the inertial force.

Compared with 200 samples per cycle, the work with 20 samples is within 0.01 %, with 10 samples within 0.2 %.
"""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import distance_walked
from walkers.postprocess.motion import Group
from walkers.postprocess.tables import Columns


def cycles_of(group: Group, centre: FloatArray) -> Columns:
    """Table ``cycles`` of the walkers of one make, one walker after the other; for ``centre`` see `work_of`."""
    run = group.case.run
    strobe = run.samples_per_cycle
    time, distance = distance_walked(group)
    way = group.mass_centre[::strobe] - group.mass_centre[0]
    work = np.full(distance.shape, np.nan)
    if group.motion.follows_cycles:
        works = work_of(group, centre)
        work[: len(works)] = works
    count, walkers = distance.shape
    of_walkers = {
        "distance": distance,
        "along": way @ group.drive_axis,
        "across": way @ group.across_axis,
        "orientation": group.orientation[::strobe],
        "work": work,
    }
    return {
        "walker": np.repeat([walker.walker for walker in group.walkers], count),
        "cycle": np.tile(np.arange(count) * run.cycles_per_sample, walkers),
        "time": np.tile(time, walkers),
        **{name: values.T.reshape(-1) for name, values in of_walkers.items()},
    }


def mass_of(group: Group) -> float:
    """Mass of a walker, kg."""
    return float(4.0 / 3.0 * pi * np.sum(group.radii**3) * group.case.beads.density)


def work_of(group: Group, centre: FloatArray) -> FloatArray:
    """Work of the drive on each walker in each cycle, J, shape (cycles, W).

    The force is evaluated in the middle of each part of the intervals between samples; ``centre`` is that of
    `walkers.postprocess.gait.Averages`.
    """
    begin, interval, parts = group.time[:-1], np.diff(group.time), len(centre) - 1
    work = np.zeros(centre.shape[1:3])
    for part, (before, after) in enumerate(pairwise(centre)):
        time = begin + (part + 0.5) / parts * interval
        for harmonic in group.case.excitation.harmonics:
            phase = harmonic.angular_frequency * time + harmonic.phase
            pull = harmonic.peak_acceleration * np.sin(phase)
            work += pull[:, None] * ((after - before) @ np.array(harmonic.direction))
    samples = group.case.run.samples_per_cycle
    cycles = len(work) // samples
    return np.asarray(mass_of(group) * work[: cycles * samples].reshape(cycles, samples, -1).sum(axis=1))
