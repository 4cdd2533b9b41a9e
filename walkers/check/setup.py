"""A case for the second engine: its numbers as they stand in the resolved case, its beads from where its run began."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walkers.check.engine import Beads, Matter, SecondEngine, Surroundings
from walkers.check.laws import Laws
from walkers.inputs.boundary import Flat, Wall
from walkers.inputs.case import Case
from walkers.postprocess.motion import Motion


def matter_of(case: Case) -> Matter:
    """What a case's beads, walls and liquid are made of."""
    return Matter(case.density, case.contact, case.liquid)


def surroundings_of(case: Case, walls: Sequence[Wall] = ()) -> Surroundings:
    """A case's walls (or some others), weight and drive."""
    walls = walls or case.boundary.walls
    none = (0.0, 0.0, 0.0)
    return Surroundings(
        point=np.array([wall.point if isinstance(wall, Flat) else none for wall in walls]),
        normal=np.array([wall.normal if isinstance(wall, Flat) else none for wall in walls]),
        radius=np.array([0.0 if isinstance(wall, Flat) else wall.radius for wall in walls]),
        gravity=case.gravity_vector,
        harmonics=np.array(
            [(*one.direction, one.angular_frequency, one.peak_acceleration, one.phase) for one in case.drive.harmonics]
        ),
    )


def engine_of(motion: Motion, laws: Laws) -> SecondEngine:
    """The second engine at the first frame of a motion."""
    beads = Beads(motion.radius, motion.position[0], motion.velocity[0], motion.spin[0])
    return engine_at(motion.case, beads, laws, round(float(motion.time[0]) / motion.case.run.time_step))


def engine_at(case: Case, beads: Beads, laws: Laws, clock: int = 0, walls: Sequence[Wall] = ()) -> SecondEngine:
    """The second engine with a case's matter, walls (or some others) and drive, and some beads, at a step."""
    return SecondEngine(beads, matter_of(case), surroundings_of(case, walls), laws, case.run.time_step, clock)
