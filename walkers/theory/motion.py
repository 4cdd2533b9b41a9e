"""Equations of motion of a walker that stays in contact, integrated in time with Coulomb friction.

    M dv/dt = -M a(t) (1, 1, 0) - G (F∥ + f + Hᵀm),    F = F0 + D (F∥ + f),    F∥ = μ F sign v

(symbols as in `walkers.theory.quasistatic`). Liquid bridges resist sliding and rolling, q = H v, by forces and couples,

    f = S v + C q,    m = C v + Q q

(`walkers.physics.bridge`); the couples do not load contacts. Coulomb's law is set-valued: the friction of a sticking
contact is the force that keeps it at rest. Steps are implicit (`walkers.theory.stepping`) and find the friction forces
by a semi-smooth Newton method. Sticking needs no regularisation; steps are short only where a contact begins to stick
or to slip. F is the normal force of rigid beads; the Coulomb limit of the engine includes contact damping, which
vanishes while the gap is constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.extras import require
from walkers.inputs.resolving.loads import contact_loads, dimer_of, resistances_at_rest
from walkers.inputs.tables.case import Case
from walkers.theory.quasistatic import (
    inertia_matrix,
    normal_force_matrix,
    rolling_matrix,
    translation,
)

if TYPE_CHECKING:
    from walkers.theory.stepping import Effect

STEPS_PER_CYCLE = 64
"""Velocities differ from those with 1024 steps by up to 0.01 mm/s, 0.07 without bridge drag (80 Hz, up to 11 g)."""
CYCLES = 60


@dataclass(frozen=True)
class Walker:
    """N walkers, each array of shape (N,) unless said otherwise."""

    radii: FloatArray  # R1 and R2, m, shape (2, N)
    scale: FloatArray  # 4πγR̄/M, m/s²: the acceleration that a force of 1 in the theory's unit gives
    force_unit: FloatArray  # 4πγR̄, N
    at_rest: FloatArray  # normal forces at rest, in that unit, shape (3, N)
    friction: FloatArray  # Coulomb's coefficient μ at contacts 1, 2 and 3, shape (3, N)
    resistances: FloatArray  # S (N s/m), C (N s), Q (N m s) of the bridges at contacts 1, 2 and 3, the first bead as
    # body 1 of the last, shape (3, 3, N)

    @property
    def sin_delta(self) -> FloatArray:
        """The asymmetry of the radii, shape (N,)."""
        return (self.radii[0] - self.radii[1]) / self.radii.sum(axis=0)  # type: ignore[no-any-return]

    @classmethod
    def of_case(cls, case: Case) -> Walker:
        """The walker of a case: friction, weight, and pulls and resistances of its bridges."""
        dimer, unit = dimer_of(case), dimer_of(case).capillary_scale
        pulls = np.array([load.pull for load in contact_loads(case)])
        forces = pulls + np.array([*dimer.masses, 0.0]) * case.pressing_gravity
        first, second = dimer.radii
        meeting = ((first, inf), (second, inf), (first, second))
        resistances = np.array([resistances_at_rest(case, *pair) for pair in meeting]).T
        resistances[1, 2] *= (
            -1.0 if first > second else 1.0
        )  # computed with the smaller bead as body 1
        law = case.contact.friction
        return cls(
            radii=np.array(dimer.radii)[:, None],
            scale=np.array([unit / dimer.total_mass]),
            force_unit=np.array([unit]),
            at_rest=(forces / unit)[:, None],
            friction=np.array([law.bead_wall, law.bead_wall, law.bead_bead])[:, None],
            resistances=resistances[..., None],
        )

    @classmethod
    def joined(cls, walkers: Sequence[Walker]) -> Walker:
        """Concatenate several sets of walkers."""
        values = zip(*(vars(walker).values() for walker in walkers), strict=True)
        return cls(*(np.concatenate(value, axis=-1) for value in values))


@dataclass(frozen=True)
class PredictedMotion:
    """Means of N walkers over the last cycle, m/s; over the second half of all cycles if the last two do not agree.

    The velocity, positive toward the large bead, is NaN where a contact opened (the model does not hold) and where the
    forces have no solution.
    """

    velocity: FloatArray  # shape (N,)
    rotation: FloatArray  # velocities -R dφ/dt of the beads, shape (2, N)
    sliding: FloatArray  # at the contacts, shape (3, N)
    smallest_normal_force: (
        FloatArray  # of each contact in that cycle, in units of 4πγR̄, shape (3, N)
    )
    periodic: npt.NDArray[
        np.bool_
    ]  # whether the cycles agree within the error of the steps, shape (N,)
    solved: npt.NDArray[
        np.bool_
    ]  # whether forces that obey the law of friction were found all the way, shape (N,)
    series: FloatArray  # sliding velocities through that cycle, at the ends of its steps, shape (3, N, steps)

    @property
    def opened(self) -> npt.NDArray[np.bool_]:
        """Whether a contact would have opened, shape (N,)."""
        return self.smallest_normal_force.min(axis=0) <= 0.0  # type: ignore[no-any-return]


def predict_motion(
    walker: Walker,
    frequency: npt.ArrayLike,
    peak_acceleration: npt.ArrayLike,
    *,
    steady_acceleration: npt.ArrayLike = 0.0,
    cycles: int = CYCLES,
    steps_per_cycle: int = STEPS_PER_CYCLE,
    effect: tuple[Effect, FloatArray] | None = None,
) -> PredictedMotion:
    """Integrate from rest under the substrate's acceleration a0 cos 2πft and average over the last cycle.

    There are N walkers, or one for all drives; f (Hz), a0 and a steady pull along the axis toward the small bead (m/s²:
    the weight of a walker that climbs with its large bead above) are numbers or of shape (N,). ``cycles`` is their
    largest number: a periodic motion ends earlier.

    A further ``effect`` is a function compiled by numba, and its K parameters of each walker, shape (N, K). It takes
    the sliding velocities (m/s), the normal forces (unit 4πγR̄) and μ of the three contacts at the beginning of each
    stage of a step, and a walker's parameters. It returns μ, f and Hᵀm in that unit; f and Hᵀm add to the forces of the
    bridges, and all are constant through the stage; take as many steps as they need.
    """
    require("theory")
    from walkers.theory.stepping import integrate

    quantities = map(
        np.atleast_1d, (frequency, peak_acceleration, steady_acceleration, walker.scale)
    )
    drive = np.stack(np.broadcast_arrays(*quantities)[:3], axis=-1).astype(np.float64)
    friction = np.broadcast_to(walker.friction, (3, len(drive))).T.copy()
    tables = _tables(walker, drive[:, 0] * steps_per_cycle)
    acts, terms = effect or (None, np.zeros((len(drive), 0)))
    ended = integrate(tables, friction, drive, acts, terms, cycles, steps_per_cycle)
    mean, least, repeated, solved, series = ended
    velocity = translation(mean)
    if not np.any(drive[:, 2]):  # by symmetry; the rest is the error of the steps
        velocity = np.where(walker.sin_delta == 0.0, 0.0, velocity)
    holds = solved & (least > 0.0).all(axis=0)
    return PredictedMotion(
        velocity=np.where(holds, velocity, np.nan),
        rotation=velocity - mean[:2],
        sliding=mean,
        smallest_normal_force=least,
        periodic=repeated,
        solved=solved,
        series=np.moveaxis(series, -1, 0),
    )


def _tables(walker: Walker, steps_per_second: FloatArray) -> FloatArray:
    """The tables of `walkers.theory.stepping.integrate` for N numbers of steps a second, shape (N, 3, 13, 3).

    Bridges slow the sliding velocities by A v, A = G (S + C H + Hᵀ(C + Q H)), and press contacts by B v,
    B = D (S + C H): velocities v0 coast in h seconds to P v0, P = (1 + h A)⁻¹.
    """
    from walkers.theory.stepping import FINER, LEVELS, STAGE

    gains = inertia_matrix(walker.sin_delta) * walker.scale[:, None, None]
    presses, roll = normal_force_matrix(walker.sin_delta), rolling_matrix(*walker.radii)
    slide, couple, turn = np.moveaxis(walker.resistances / walker.force_unit, -1, 1)[
        ..., None
    ] * np.eye(3)
    forces, couples = slide + couple @ roll, couple + turn @ roll
    slowed = gains @ (forces + np.swapaxes(roll, 1, 2) @ couples)
    seconds = (STAGE / FINER ** np.arange(LEVELS) / steps_per_second[:, None])[..., None, None]
    coast = np.linalg.inv(np.eye(3) + seconds * slowed[:, None])
    gains, lifts = coast @ gains[:, None], (presses @ forces)[:, None]
    presses = presses[:, None] - seconds * lifts @ gains
    rest = walker.at_rest.T[:, None, None]
    shape = coast.shape[:2]
    parts = [
        np.broadcast_to(part, (*shape, *part.shape[2:]))
        for part in (coast, gains, presses, lifts, rest)
    ]
    return np.concatenate(parts, axis=2)
