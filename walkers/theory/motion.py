"""Equations of motion of a walker that stays in contact, integrated in time with sliding friction.

    M dv/dt = -M a(t) (1, 1, 0) - G (F∥ + f + Hᵀm),    F = F0 + D (F∥ + f),    F∥ = μ(|v|) F sign v

(symbols as in `walkers.theory.quasistatic`). Liquid bridges resist sliding and rolling, q = H v, by
forces and couples,

    f = S v + C q,    m = C v + Q q

(`walkers.physics.bridge`); the couples do not load contacts. The coefficient μ may grow with the
sliding velocity (`walkers.physics.friction`). At rest the law is set-valued: the friction of a
sticking contact is the force that keeps it at rest, up to μ₀ F. Steps are implicit
(`walkers.theory.stepping`) and find the friction forces by a semi-smooth Newton method. Sticking
needs no regularisation; steps are short only where a contact begins to stick or to slip. F is the
normal force of rigid beads; the Coulomb limit of the engine includes contact damping, which
vanishes while the gap is constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import inf
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, FloatArray
from walkers.extras import require
from walkers.inputs.resolving.loads import contact_loads, dimer_of, resistances_at_rest
from walkers.inputs.tables.case import Case
from walkers.physics.edges import edge_resistance
from walkers.theory.quasistatic import (
    inertia_matrix,
    normal_force_matrix,
    rolling_matrix,
    translation,
)

if TYPE_CHECKING:
    from walkers.theory.stepping import Effect

STEPS_PER_CYCLE = 64
"""Default number of steps per cycle.

Velocities differ from those with 1024 steps by up to 0.01 mm/s; without viscous bridges by up to
0.07 mm/s (80 Hz, up to 11 g).
"""
STEPS_WITH_EDGES = 512
"""Smallest number of steps per cycle if edges resist, whose forces are constant through a stage."""
CYCLES = 60
"""Default of the largest number of cycles."""


@dataclass(frozen=True)
class Walker:
    """N dimers.

    Contacts 1 and 2 are those of the beads with the substrate, 3 is that between the beads.
    """

    radii: FloatArray
    """R1 and R2, m, shape (2, N)."""
    scale: FloatArray
    """4πγR̄/M, m/s²: the acceleration that a force of 1 in the theory's unit gives, shape (N,)."""
    force_unit: FloatArray
    """4πγR̄, N, shape (N,)."""
    normal_at_rest: FloatArray
    """Normal forces at rest, in that unit, shape (3, N)."""
    friction: FloatArray
    """Coefficient μ₀ of friction at rest at the three contacts, shape (3, N)."""
    friction_rise: FloatArray
    """Rise Δμ of the coefficient at high sliding velocities, shape (3, N); 0: Coulomb's law."""
    half_rise_velocity: FloatArray
    """Sliding velocity of half of the rise, m/s, shape (3, N)."""
    resistances: FloatArray
    """S (N s/m), C (N s) and Q (N m s) of the bridges at the three contacts, shape (3, 3, N).

    Body 1 of the last contact is the first bead.
    """
    edges: FloatArray
    """Resistance of the edges of each bridge (`walkers.physics.edges`), over 4πγR̄, in (s/m)^(2/3),
    shape (3, N)."""

    @property
    def sin_delta(self) -> FloatArray:
        """The asymmetry of the radii, shape (N,)."""
        first, second = self.radii
        asymmetry: FloatArray = (first - second) / self.radii.sum(axis=0)
        return asymmetry

    @classmethod
    def of_case(cls, case: Case) -> Walker:
        """The walker of a case: friction, weight, and the forces and resistances of its bridges."""
        dimer = dimer_of(case)
        force_unit = dimer.capillary_scale
        weights = np.array([*dimer.masses, 0.0]) * case.pressing_gravity
        loads = contact_loads(case)
        normal_forces = np.array([load.pull for load in loads]) + weights
        edges = np.array([edge_resistance(load.surfaces) for load in loads])
        first, second = dimer.radii
        surfaces = ((first, inf), (second, inf), (first, second))
        resistances = np.array([resistances_at_rest(case, *pair) for pair in surfaces]).T
        if first > second:  # the coupling C is computed with the smaller bead as body 1
            resistances[1, 2] *= -1.0
        laws = np.array(case.contact.friction.of_dimer)
        at_rest, rise, half_rise_velocity = laws.T[..., None]
        return cls(
            radii=np.array(dimer.radii)[:, None],
            scale=np.array([force_unit / dimer.total_mass]),
            force_unit=np.array([force_unit]),
            normal_at_rest=(normal_forces / force_unit)[:, None],
            friction=at_rest,
            friction_rise=rise,
            half_rise_velocity=half_rise_velocity,
            resistances=resistances[..., None],
            edges=edges[:, None] / force_unit,
        )

    @classmethod
    def joined(cls, walkers: Sequence[Walker]) -> Walker:
        """Concatenate several sets of walkers."""
        arrays = {}
        for field in fields(cls):
            parts = [getattr(walker, field.name) for walker in walkers]
            arrays[field.name] = np.concatenate(parts, axis=-1)
        return cls(**arrays)


@dataclass(frozen=True)
class PredictedMotion:
    """Means of the motion of N walkers over the last cycle.

    If the last two cycles do not agree, means are over the second half of all cycles.
    """

    velocity: FloatArray
    """m/s, shape (N,), positive toward the large bead.

    NaN where a contact opened, because the model does not hold there, and where the forces have no
    solution.
    """
    rotation: FloatArray
    """Velocities -R dφ/dt of the beads, m/s, shape (2, N)."""
    sliding: FloatArray
    """Sliding velocities of the contacts, m/s, shape (3, N)."""
    smallest_normal_force: FloatArray
    """Smallest normal force of each contact in that cycle, in units of 4πγR̄, shape (3, N)."""
    periodic: BoolArray
    """Whether the cycles agree within the error of the steps, shape (N,)."""
    solved: BoolArray
    """Whether forces that obey the law of friction were found at every step, shape (N,)."""
    series: FloatArray
    """Sliding velocities at the ends of the steps of that cycle, m/s, shape (3, N, steps)."""

    @property
    def opened(self) -> BoolArray:
        """Whether a contact would have opened, shape (N,)."""
        return self.smallest_normal_force.min(axis=0) <= 0.0  # type: ignore[no-any-return]


def predict_motion(  # noqa: PLR0913
    walker: Walker,
    frequency: npt.ArrayLike,
    peak_acceleration: npt.ArrayLike,
    *,
    steady_acceleration: npt.ArrayLike = 0.0,
    cycles: int = CYCLES,
    steps_per_cycle: int = STEPS_PER_CYCLE,
    effect: tuple[Effect, FloatArray] | None = None,
) -> PredictedMotion:
    """Integrate the motion of N walkers from rest on a substrate with the acceleration a0 cos 2πft.

    Arguments with different N must broadcast.

    Parameters
    ----------
    walker
        N walkers, or one for all N drives.
    frequency
        f in Hz, a number or an array of shape (N,).
    peak_acceleration
        a0 in m/s², a number or an array of shape (N,).
    steady_acceleration
        A steady acceleration along the axis toward the small bead, m/s², a number or an array of
        shape (N,): gravity, for a walker that climbs with its large bead above.
    cycles
        Largest number of cycles; the integration ends earlier if the motion is periodic.
    steps_per_cycle
        Number of time steps per cycle; at least `STEPS_WITH_EDGES` if edges resist.
    effect
        A further force law: a function that numba can compile, and its K parameters for each
        walker, shape (N, K). A step consists of two implicit Euler stages
        (`walkers.theory.stepping.STAGE`), and at the start of each the function is called for a
        walker with four arguments: the sliding velocities of its contacts (m/s), their normal
        forces (in 4πγR̄), three numbers each; their friction, shape (3, 3), with μ₀, Δμ and the
        velocity of half of the rise (m/s) in the row of each contact; and its parameters, shape
        (K,). It returns the friction, and two arrays of shape (3,), f and Hᵀm (in 4πγR̄), which
        add to the forces of the bridges. All are constant through the stage, so that a stiff law
        needs more steps.

    Returns
    -------
    PredictedMotion
        The means over the last cycle; over the second half of all cycles if the motion is not
        periodic. The velocity is NaN if a contact opened, or if the forces have no solution.

    Raises
    ------
    ExtraMissing
        If the packages of the extra ``theory`` are not installed.
    ValueError
        If the shapes of the arguments do not broadcast, or if there is an effect and edges
        resist.
    """
    require("theory")
    from walkers.theory.stepping import compiled_effect, edge_forces, integrate

    drive_and_scale = np.broadcast_arrays(
        np.atleast_1d(frequency),
        np.atleast_1d(peak_acceleration),
        np.atleast_1d(steady_acceleration),
        np.atleast_1d(walker.scale),
    )
    drive = np.stack(drive_and_scale[:3], axis=-1).astype(np.float64)
    count = len(drive)
    if walker.edges.any():
        if effect is not None:
            raise ValueError("expected no effect beside the edges of the case")
        edges_and_radii = np.concatenate([walker.edges, walker.radii])
        effect = (edge_forces, np.broadcast_to(edges_and_radii, (5, count)).T.copy())
        steps_per_cycle = max(steps_per_cycle, STEPS_WITH_EDGES)
    laws = np.stack([walker.friction, walker.friction_rise, walker.half_rise_velocity])
    friction = np.broadcast_to(laws, (3, 3, count)).T.copy()
    tables = _tables(walker, drive[:, 0] * steps_per_cycle)
    force_law = None
    parameters = np.zeros((count, 0))
    if effect is not None:
        function, parameters = effect
        force_law = compiled_effect(function)
    sliding, smallest_normal_force, periodic, solved, series = integrate(
        tables, friction, drive, force_law, parameters, cycles, steps_per_cycle
    )
    velocity = translation(sliding)
    if not np.any(drive[:, 2]):
        # A symmetric dimer does not walk; what remains is the error of the steps.
        velocity = np.where(walker.sin_delta == 0.0, 0.0, velocity)
    rotation = velocity - sliding[:2]
    stays_closed = (smallest_normal_force > 0.0).all(axis=0)
    return PredictedMotion(
        velocity=np.where(solved & stays_closed, velocity, np.nan),
        rotation=rotation,
        sliding=sliding,
        smallest_normal_force=smallest_normal_force,
        periodic=periodic,
        solved=solved,
        series=np.moveaxis(series, -1, 0),
    )


def _tables(walker: Walker, steps_per_second: FloatArray) -> FloatArray:
    """The tables of `walkers.theory.stepping.integrate`, shape (N, 3, 13, 3).

    Numbers of steps per second have the shape (N,).

    Bridges slow the sliding velocities by A v with A = G (S + C H + Hᵀ(C + Q H)), and press
    contacts by B v with B = D (S + C H). In h seconds, velocities v0 coast to P v0 with P = (1 + h
    A)⁻¹.
    """
    from walkers.theory.stepping import FINER, LEVELS, STAGE

    inertia = inertia_matrix(walker.sin_delta) * walker.scale[:, None, None]
    pressing = normal_force_matrix(walker.sin_delta)
    rolling = rolling_matrix(*walker.radii)
    resistances = np.moveaxis(walker.resistances / walker.force_unit, -1, 1)
    s, c, q = resistances[..., None] * np.eye(3)  # diagonal matrices, shape (N, 3, 3)
    forces = s + c @ rolling
    couples = c + q @ rolling
    slowing = inertia @ (forces + np.swapaxes(rolling, 1, 2) @ couples)
    h = (STAGE / FINER ** np.arange(LEVELS) / steps_per_second[:, None])[..., None, None]
    coasting = np.linalg.inv(np.eye(3) + h * slowing[:, None])
    gains = coasting @ inertia[:, None]
    lifts = (pressing @ forces)[:, None]
    presses = pressing[:, None] - h * lifts @ gains
    normal_at_rest = walker.normal_at_rest.T[:, None, None]
    levels = coasting.shape[:2]
    parts = []
    for part in (coasting, gains, presses, lifts, normal_at_rest):
        parts.append(np.broadcast_to(part, (*levels, *part.shape[2:])))
    return np.concatenate(parts, axis=2)
