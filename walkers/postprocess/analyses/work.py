"""Analysis of the work of the drive on walkers (`walkers.postprocess.cycles`), and of their cost of transport.

The cost of transport is f W / (M g |v|) with the work W per cycle, the velocity v along the heading and the frequency
f: the power over the power of lifting the walker as fast as it walks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.analyses.walking import spread
from walkers.postprocess.analysis import Analysis, Quantity
from walkers.postprocess.cycles import mass_of, work_of
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import walk
from walkers.postprocess.motion import LEAST_SAMPLES, Group, Motion
from walkers.postprocess.sides import STEADY_SPEED, alike, sides
from walkers.postprocess.tables import Columns


class Working(Analysis):
    """Work of the drive on walkers."""

    name = "work"
    version = 4
    tables = ()

    def applies(self, case: Case) -> bool:
        """Cases of walkers with enough samples per cycle."""
        return bool(case.walkers) and case.run.samples_per_cycle >= LEAST_SAMPLES

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Mean work per cycle after settling, and the cost of transport."""
        groups, settled = motion.groups, motion.case.run.settled_strobes
        works = [work_of(group) for group in groups]
        means = [work[settled:].mean(axis=0) for work in works]
        costs = [mean / _lifted(group) for mean, group in zip(means, groups, strict=True)]
        facing, angle = np.array([(one.facing, one.start_angle) for group in groups for one in group.walkers]).T
        these = alike(sides(facing, angle), uphill=motion.case.goes_uphill)
        cost = np.concatenate(costs)[these]
        summary = {"work": spread(np.concatenate(means)[these]), "cost_of_transport": spread(cost[np.isfinite(cost)])}
        return {}, summary

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """Work per cycle and cost of transport."""
        these = ", walkers that started facing up" if result.get("goes_uphill") else ""
        mean = "mean over the walkers (on a slope, those that started facing up)"
        text = f"work of the drive (of the inertial force in the frame of the walls) on a walker per cycle, {mean}"
        yield Quantity("work", f"inertial work of the drive per cycle{these}", "J", "work", text)
        text = f"power of the drive, without that of gravity, over weight times walking speed, {mean}"
        label = f"cost of transport{these and ' (without the work of gravity)'}"
        yield Quantity("cost_of_transport", label, "", "cost_of_transport", text)


def _lifted(group: Group) -> FloatArray:
    """Work to lift each walker by its path in a cycle, J, shape (W,); NaN for walkers that hardly walk."""
    speed = np.abs(walk(group).velocity)
    speed[speed < STEADY_SPEED] = np.nan
    return mass_of(group) * ACCELERATION_OF_ONE_G * speed / group.case.excitation.frequency
