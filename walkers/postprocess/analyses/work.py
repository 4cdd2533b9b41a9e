"""Analysis of the work of the drive on walkers, and of their cost of transport.

In the frame of the walls, which have the acceleration a(t), an inertial force -M a(t) acts at the mass centre of a
walker. Its work per cycle is W = -M ∮ a · dx along the path x of the mass centre relative to the walls. Friction,
bridges and collisions of a steady walker dissipate this work; in the laboratory it is the work of the walls' forces. If
a walker turns or is not steady, the two differ; the results are those of the inertial force.
The cost of transport is f W / (M g |v|) with the velocity v along the heading and the frequency f: the power over the
power of lifting the walker as fast as it walks.

Compared with 200 samples per cycle, the work with 20 samples is within 0.01 %, with 10 samples within 0.2 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Annotated, Any, ClassVar

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.analyses.walking import spread
from walkers.postprocess.analysis import Analysis, Quantity
from walkers.postprocess.dump import FloatArray, IntArray
from walkers.postprocess.gait import walk
from walkers.postprocess.motion import LEAST_SAMPLES, Group, Motion
from walkers.postprocess.sides import STEADY_SPEED, alike, sides
from walkers.postprocess.tables import Columns, columns_of

_PARTS = 10
"""Parts of an interval between samples; the force is evaluated in the middle of each part."""


@dataclass(frozen=True)
class Work:
    """``work.parquet``: one row per walker and cycle."""

    walker: Annotated[IntArray, "", "index of the walker, from 0"]
    cycle: Annotated[IntArray, "", "index of the cycle of the drive, from 0"]
    work: Annotated[FloatArray, "J", "work of the drive on the walker in this cycle"]


class Working(Analysis):
    """Work of the drive on walkers."""

    name = "work"
    version = 3
    tables: ClassVar[Mapping[str, type]] = {"work": Work}

    def applies(self, case: Case) -> bool:
        """Cases of walkers with enough samples per cycle."""
        return bool(case.walkers) and case.run.samples_per_cycle >= LEAST_SAMPLES

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Work in each cycle, its mean after settling, and the cost of transport."""
        groups, settled = motion.groups, motion.case.run.settled_strobes
        works = [work_of(group) for group in groups]
        means = [work[settled:].mean(axis=0) for work in works]
        costs = [mean / _lifted(group) for mean, group in zip(means, groups, strict=True)]
        walker, cycles = [one.walker for group in groups for one in group.walkers], len(works[0])
        each = np.concatenate(works, axis=1).T.reshape(-1)
        rows = Work(np.repeat(walker, cycles), np.tile(np.arange(cycles), len(walker)), each)
        facing, angle = np.array([(one.facing, one.start_angle) for group in groups for one in group.walkers]).T
        these = alike(sides(facing, angle), uphill=motion.case.goes_uphill)
        cost = np.concatenate(costs)[these]
        summary = {"work": spread(np.concatenate(means)[these]), "cost_of_transport": spread(cost[np.isfinite(cost)])}
        return {"work": columns_of(rows)}, summary

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """Work per cycle and cost of transport."""
        these = ", walkers that started facing up" if result.get("goes_uphill") else ""
        mean = "mean over the walkers (on a slope, those that started facing up)"
        text = f"work of the drive (of the inertial force in the frame of the walls) on a walker per cycle, {mean}"
        yield Quantity("work", f"inertial work of the drive per cycle{these}", "J", "work", text)
        text = f"power of the drive, without that of gravity, over weight times walking speed, {mean}"
        label = f"cost of transport{these and ' (without the work of gravity)'}"
        yield Quantity("cost_of_transport", label, "", "cost_of_transport", text)


def _mass(group: Group) -> float:
    """Mass of a walker, kg."""
    return float(4.0 / 3.0 * pi * np.sum(group.radii**3) * group.case.beads.density)


def _lifted(group: Group) -> FloatArray:
    """Work to lift each walker by its path in a cycle, J, shape (W,); NaN for walkers that hardly walk."""
    speed = np.abs(walk(group).velocity)
    speed[speed < STEADY_SPEED] = np.nan
    return _mass(group) * ACCELERATION_OF_ONE_G * speed / group.case.excitation.frequency


def work_of(group: Group) -> FloatArray:
    """Work of the drive on each walker in each cycle, J, shape (cycles, W)."""
    shares = np.linspace(0.0, 1.0, _PARTS + 1)
    ways = [Group(group.motion.between(share), group.make, group.walkers).mass_centre for share in shares]
    begin, interval = group.time[:-1], np.diff(group.time)
    work = np.zeros(ways[0].shape[:2])
    for part, (one, next_one) in enumerate(pairwise(ways)):
        time = begin + (part + 0.5) / _PARTS * interval
        for harmonic in group.case.excitation.harmonics:
            phase = harmonic.angular_frequency * time + harmonic.phase
            pull = harmonic.peak_acceleration * np.sin(phase)
            work += pull[:, None] * ((next_one - one) @ np.array(harmonic.direction))
    samples = group.case.run.samples_per_cycle
    cycles = len(work) // samples
    return np.asarray(_mass(group) * work[: cycles * samples].reshape(cycles, samples, -1).sum(axis=1))
