"""Alignment: whether a dimer on a substrate or a wall stays aligned with the axis of the drive.

A dimer that rolls sideways without sliding, at Ω about the line through its contacts with the substrate, turns by
ψ̇ = Ω (R1 - R2)/L with L = 2√(R1 R2). Energy and the work of the inertial force give a Mathieu equation, with ϑ = πft,

    d²ψ/dϑ² + [U - 4V cos 2ϑ] ψ = 0,    4V = (5/7) a0/(π² f²) (R1 - R2)/L (Σ m R)/(Σ m R²)

and U = 0 on a level substrate. A steady acceleration along the axis, such as a climber's weight, gives U as the drive
gives V. Bridges to the substrate with rolling resistance Q dissipate the power Σ Q Ω² of the energy (7/10) Σ m R² Ω²,
which adds 2β dψ/dϑ with 2πfβ = (5/7) (Σ Q)/(Σ m R²); the bridge between the beads of a rigid cone dissipates nothing.
For a fast drive, U + 2V²/(1 + β²) replaces U - 4V cos 2ϑ (Kapitza's pendulum): a dimer on its head (U < 0) stands if
this is positive.

The equation treats the two beads as a cone, one rigid body. In fact, each bead can spin freely about its own normal to
the substrate, and a contact that slides along the axis resists sideways sliding only as a drag does. `turning_rate`
includes this: it is the Floquet exponent of ψ, the sideways velocities of both beads, and their spins about the drive
and about the normal, linearised about the axial motion of `walkers.theory.motion`. Dimers in the engine turn over at
these rates within a per cent (docs/explanation/climbing.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, radians, sqrt, tan

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.physics.dimer import Dimer
from walkers.theory.motion import Walker, predict_motion
from walkers.theory.quasistatic import (
    inertia_matrix,
    normal_force_matrix,
    rolling_matrix,
    translation,
)

LARGEST_STABLE_V = 0.45402316686747424
"""Largest V with stable small angles on a level substrate: the characteristic value b1(q = 2V) is zero."""
_NEUTRAL = 1e-6
"""Growth per unit of ϑ, or multiplier minus one, that counts as zero."""
_SLOWEST = 1e-4
"""m/s; a contact that slides more slowly resists sideways sliding as at this speed."""
_STEPS = 256
"""Steps per cycle."""
_ANGLE = radians(1.0)
"""Angle to the axis at which rolling friction is evaluated. Rolling friction is larger at smaller angles: while the
rolling along the axis reverses, only sideways rolling is left."""


@dataclass(frozen=True)
class Alignment:
    """U, V and β of the Mathieu equation of small angles to the axis, and whether these stay small."""

    u: float
    v: float
    damping: float = 0.0

    @property
    def stable(self) -> bool:
        """Whether small angles stay small; with damping they decay."""
        return self.growth <= _NEUTRAL

    @property
    def growth(self) -> float:
        """Largest growth rate (Floquet exponent) of small angles per unit of ϑ; multiply by πf for 1/s."""
        steps = 128  # of a period of π, U - 4V cos 2ϑ constant in each
        theta = pi * (np.arange(steps) + 0.5) / steps
        slopes = np.zeros((steps, 2, 2))
        slopes[:, 0, 1], slopes[:, 1, 1] = 1.0, -2.0 * self.damping
        slopes[:, 1, 0] = 4.0 * self.v * np.cos(2.0 * theta) - self.u
        return float(np.log(np.abs(_multipliers(slopes, pi / steps)).max()) / pi)


def alignment(case: Case) -> Alignment:
    """The equation of a case's dimer, damped by its bridges to the substrate.

    A climber that leads with its large bead stands on its head (U < 0), and only the drive keeps it upright; with its
    large bead below it hangs as from a pivot (U > 0).
    """
    dimer, drive, pi_f = dimer_of(case), case.excitation, pi * case.excitation.frequency
    (first, second), masses = dimer.radii, dimer.masses
    lever = (first - second) / (2.0 * sqrt(first * second))
    moment = masses[0] * first**2 + masses[1] * second**2
    per_acceleration = (
        5.0 / 7.0 * lever * (masses[0] * first + masses[1] * second) / moment / pi_f**2
    )
    rolling_resistance = float(Walker.of_case(case).resistances[2, :2].sum())
    return Alignment(
        -case.axial_gravity * per_acceleration,
        drive.peak_acceleration * per_acceleration / 4.0,
        5.0 / 7.0 * rolling_resistance / moment / (2.0 * pi_f),
    )


def _multipliers(slopes: FloatArray, step: float) -> npt.NDArray[np.complex128]:
    """Floquet multipliers of dx/dt = A(t) x; A at each step, shape (steps, n, n)."""
    from scipy.linalg import expm

    period = np.eye(slopes.shape[-1])
    for change in expm(slopes * step):
        period = change @ period
    return np.linalg.eigvals(period).astype(np.complex128)


def time_to_turn(rate: float) -> float:
    """Seconds from 1° to 90° at dψ/dt = rate sin ψ, in 1/s: ln(tan(ψ2/2)/tan(ψ1/2))/rate."""
    return log(tan(radians(90.0) / 2.0) / tan(_ANGLE / 2.0)) / rate


def turning_rate(case: Case) -> float | None:
    """Growth rate of small angles to the axis, 1/s; negative for decay, None if the motion is not periodic.

    Each contact resists sideways sliding by c = μF/|v|, because friction is opposite to the direction of sliding, which
    is almost along the axis; its bridge resists as along the axis. Similarly, rolling friction resists sideways rolling
    by μ F R/|ω|, with the engine's model of constant torque; it is left out of the axial motion.
    """
    dimer, walker = dimer_of(case), Walker.of_case(case)
    frequency, peak, steady = (
        case.excitation.frequency,
        case.excitation.peak_acceleration,
        case.axial_gravity,
    )
    motion = predict_motion(
        walker, frequency, peak, steady_acceleration=steady, steps_per_cycle=_STEPS
    )
    if not (motion.periodic[0] and motion.solved[0]):
        return None
    # The axial motion in the middle of each step, and the forces that go with it.
    after = motion.series[:, 0]
    before = np.roll(after, 1, axis=1)
    sliding, slope = (before + after) / 2.0, (after - before) * frequency * _STEPS
    pull = peak * np.cos(2.0 * pi * (np.arange(_STEPS) + 0.5) / _STEPS) + steady
    gains, roll = inertia_matrix(dimer.sin_delta) / dimer.total_mass, rolling_matrix(*dimer.radii)
    _, coupling, rolling = walker.resistances
    couples = coupling * sliding + rolling * (roll @ sliding)
    parallel = np.linalg.solve(gains, -slope - np.outer([1.0, 1.0, 0.0], pull)) - roll.T @ couples
    normal = (
        walker.at_rest * dimer.capillary_scale + normal_force_matrix(dimer.sin_delta) @ parallel
    )
    normal = np.maximum(normal, 0.0)  # an open contact has no load
    radii, masses, accelerated = (
        np.array(dimer.radii)[:, None],
        np.array(dimer.masses)[:, None],
        translation(slope),
    )
    spin = (translation(sliding) - sliding[:2]) / radii  # about the horizontal across the axis
    push = (
        masses[0] * (accelerated + pull) + parallel[0]
    )  # along the axis, of the second bead on the first
    torque = (
        0.4 * masses * radii * (accelerated - slope[:2]) - radii * parallel[:2] - couples[:2]
    )  # of the other bead
    # Resistance to sideways sliding, and to rolling at the mean sideways speed of the beads at `_ANGLE`.
    drags = walker.friction * normal / np.maximum(np.abs(sliding), _SLOWEST)
    speed = 5.0 / 7.0 * peak / (2.0 * pi * frequency) * _ANGLE / sqrt(2.0)
    levers, spins = (
        np.array([*dimer.radii, dimer.reduced_radius])[:, None],
        np.array([*spin, spin[0] - spin[1]]),
    )
    hindered = case.contact.rolling_friction * normal * levers / np.hypot(spins, speed / levers)
    slopes = _sideways(dimer, walker.resistances, drags, hindered, spin, push, torque)
    multipliers = _multipliers(slopes, 1.0 / (frequency * _STEPS))
    # Beads that spin against each other about their vertical axes, as two wheels in mesh, are not damped.
    neutral = np.abs(multipliers - 1.0).argmin()
    if abs(multipliers[neutral] - 1.0) < _NEUTRAL:
        multipliers = np.delete(multipliers, neutral)
    return float(np.log(np.abs(multipliers).max()) * frequency)


def _sideways(
    dimer: Dimer,
    resistances: FloatArray,
    drags: FloatArray,
    hindered: FloatArray,
    spin: FloatArray,
    push: FloatArray,
    torque: FloatArray,
) -> FloatArray:
    """The linear equations of sideways motion, shape (steps, 7, 7).

    The variables are ψ, the velocities of the beads across the drive, their spins about the drive, and their spins
    about the vertical. The push along the axis has a component across the drive, ψ times as large, as have the torque
    and the spin. Contacts slide and roll across the dimer, v and q, with the forces -(c v + S v + C q) and couples -(C
    v + Q q + h q) of `walkers.physics.bridge`; c are the drags, h the resistances to rolling. SI units.
    """
    radii, sine = np.array(dimer.radii), dimer.sin_delta
    cosine, inertias = sqrt(1.0 - sine**2), 0.4 * np.array(dimer.masses) * radii**2
    slopes = np.zeros((len(push), 7, 7))
    sliding, rolling = np.zeros((2, 3, *slopes.shape[::2]))  # sideways, at each contact
    for bead in range(2):
        sliding[bead, :, 1 + bead], sliding[bead, :, 3 + bead], rolling[bead, :, 3 + bead] = (
            1.0,
            radii[bead],
            1.0,
        )
    sliding[2, :, 0], rolling[2, :, 0] = sine * (radii @ spin), sine * (spin[0] - spin[1])
    sliding[2, :, 1:] = [1.0, -1.0, *(radii * sine), *(-radii * cosine)]
    rolling[2, :, 3:] = [sine, -sine, -cosine, cosine]
    slide, couple, turn = resistances[..., None]
    forces = -(drags[:, :, None] + slide) * sliding - couple * rolling
    couples = -couple * sliding - (turn + hindered[:, :, None]) * rolling
    # Rolling friction also opposes the spin across the drive, which the torque of the other bead must overcome.
    couples[:2, :, 0] -= hindered[:2] * spin
    slopes[:, 0, 1:3] = np.array([1.0, -1.0]) / (2.0 * sqrt(radii[0] * radii[1]))
    for bead, side in enumerate((1.0, -1.0)):
        velocity, roll, vertical = 1 + bead, 3 + bead, 5 + bead
        slopes[:, velocity] = (side * forces[2] + forces[bead]) / dimer.masses[bead]
        slopes[:, velocity, 0] += side * push / dimer.masses[bead]
        between = radii[bead] * forces[2] + side * couples[2]
        slopes[:, roll] = (radii[bead] * forces[bead] + couples[bead] + sine * between) / inertias[
            bead
        ]
        slopes[:, roll, 0] -= torque[bead] / inertias[bead]
        slopes[:, vertical] = -cosine * between / inertias[bead]
    return slopes
