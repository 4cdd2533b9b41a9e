"""How fast a dimer on a substrate or a wall turns away from the drive, its two beads free.

The Mathieu equation (`walkers.theory.mathieu`) takes the beads for one rigid cone. But each may spin about its own
normal to the substrate, against which nothing holds it, and a contact that slides along the axis resists sideways
sliding as a drag does only. `turning_rate` leaves all that to the beads: it is the Floquet exponent of ψ, both beads'
sideways velocities and their spins about the drive and about the normal, linearised about the axial motion of
`walkers.theory.motion`. The engine's dimers turn over at these rates within a per cent (docs/explanation/climbing.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, radians, sqrt, tan

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.physics.dimer import Dimer
from walkers.theory.mathieu import NEUTRAL, multipliers
from walkers.theory.motion import Friction, Walker, walk
from walkers.theory.quasistatic import FloatArray, inertia_matrix, normal_force_matrix, rolling_matrix, translation

_SLOWEST = 1e-4
"""A contact that slides more slowly, m/s, resists sideways sliding as much as one that slides at this."""
_STEPS = 256
"""Of a cycle."""
_ANGLE = radians(1.0)
"""The angle to the axis at which rolling friction is to act. It is the larger the smaller the angle, for while a bead's
rolling along the axis reverses, only its rolling sideways is left."""


def time_to_turn(rate: float) -> float:
    """Seconds from 1° to 90° at dψ/dt = rate sin ψ, in 1/s: ln(tan(ψ2/2)/tan(ψ1/2))/rate."""
    return log(tan(radians(90.0) / 2.0) / tan(_ANGLE / 2.0)) / rate


@dataclass(frozen=True)
class _AxialMotion:
    """The axial motion of a dimer through a cycle, as its sideways motion needs it; SI units, one value a step."""

    sliding: FloatArray  # velocities at the three contacts
    spin: FloatArray  # of each bead about the horizontal across the axis
    normal: FloatArray  # forces at the three contacts
    push: FloatArray  # force along the axis by which the second bead pushes the first
    torque: FloatArray  # on each bead from the other, in the sense of its spin
    resistances: FloatArray  # S, C and Q of the bridges, shape (3, 3)
    periodic: bool


def _axial_motion(case: Case, dimer: Dimer) -> _AxialMotion:
    """The axial motion of a case's walker, and the forces that go with it."""
    walker, friction, steps = Walker.of_case(case), Friction.of_cases(case), _STEPS
    frequency, peak, steady = case.drive.frequency, case.drive.peak_acceleration, case.axial_gravity
    motion = walk(walker, friction, frequency, peak, steady_acceleration=steady, steps_per_cycle=steps)
    after = motion.series[:, 0]
    before = np.roll(after, 1, axis=1)
    sliding, slope = (before + after) / 2.0, (after - before) * frequency * steps
    along, accelerated = translation(sliding), translation(slope)
    pull = peak * np.cos(2.0 * pi * (np.arange(steps) + 0.5) / steps) + steady
    gains = inertia_matrix(walker.asymmetry)[0] / dimer.total_mass
    matrix, roll = normal_force_matrix(walker.sin_delta, walker.asymmetry)[0], rolling_matrix(*dimer.radii)
    _, coupling, rolling = walker.resistances
    couples = coupling * sliding + rolling * (roll @ sliding)
    parallel = np.linalg.solve(gains, -slope - np.outer([1.0, 1.0, 0.0], pull)) - roll.T @ couples
    radii, masses = np.array(dimer.radii)[:, None], np.array(dimer.masses)[:, None]
    inertia = 2.0 / 5.0 * masses * radii**2
    on_wall = -parallel[:2]
    normal = walker.at_rest * dimer.capillary_scale + matrix @ parallel
    return _AxialMotion(
        sliding=sliding,
        spin=(along - sliding[:2]) / radii,
        normal=np.maximum(normal, 0.0),  # a contact that would open bears nothing
        push=masses[0] * (accelerated + pull) - on_wall[0],
        torque=inertia * (accelerated - slope[:2]) / radii + radii * on_wall - couples[:2],
        resistances=walker.resistances[..., 0],
        periodic=bool(motion.periodic[0] and motion.solved[0]),
    )


def turning_rate(case: Case) -> float | None:
    """How fast small angles to the axis grow, 1/s; negative where they decay, None if the motion is not periodic.

    Each contact resists sideways sliding by c = μF/|v|, for friction is against the direction of sliding, which is the
    axis but for a small angle, and its bridge as it does along the axis. Rolling friction resists sideways rolling by
    μ F R/|ω| likewise, with the engine's model of constant torque; it is left out of the axial motion.

    Parameters
    ----------
    case
        Driven along the substrate.
    """
    dimer, frequency, peak = dimer_of(case), case.drive.frequency, case.drive.peak_acceleration
    axial = _axial_motion(case, dimer)
    if not axial.periodic:
        return None
    kinetic = np.asarray(Friction.of_cases(case).kinetic)
    slopes = _sideways(axial, dimer, kinetic * axial.normal / np.maximum(np.abs(axial.sliding), _SLOWEST))
    if case.contact.rolling_friction:
        speed = 5.0 / 7.0 * peak / (2.0 * pi * frequency) * _ANGLE / sqrt(2.0)
        slopes += _rolling(axial, dimer, case.contact.rolling_friction, speed)
    found = multipliers(slopes, 1.0 / (frequency * _STEPS))
    # Beads that spin against each other about their vertical axes, as two wheels in mesh, do so for ever.
    neutral = np.abs(found - 1.0).argmin()
    if abs(found[neutral] - 1.0) < NEUTRAL:
        found = np.delete(found, neutral)
    return float(np.log(np.abs(found).max()) * frequency)


def _sideways(axial: _AxialMotion, dimer: Dimer, drags: FloatArray) -> FloatArray:
    """The linear equations of sideways motion, shape (steps, 7, 7).

    Of ψ, then of each bead the velocity across the drive, then of each the spin about the drive, then about the
    vertical. The push along the axis has a part across the drive, ψ times as large; so have the torque and the spin.
    Contacts slide and roll across the dimer, v and q; forces -(c v + S v + C q) and couples -(C v + Q q) act as
    `walkers.physics.bridge` has it.
    """
    (first, second), masses = dimer.radii, dimer.masses
    radii, sine = np.array(dimer.radii), dimer.sin_delta
    cosine, length = sqrt(1.0 - sine**2), 2.0 * sqrt(first * second)
    inertias = 2.0 / 5.0 * np.array(masses) * radii**2
    slopes = np.zeros((axial.push.shape[0], 7, 7))
    sliding, rolling = np.zeros((2, 3, *slopes.shape[::2]))  # sideways, at each contact
    for bead in range(2):
        sliding[bead, :, 1 + bead], sliding[bead, :, 3 + bead], rolling[bead, :, 3 + bead] = 1.0, radii[bead], 1.0
    sliding[2, :, 0], rolling[2, :, 0] = sine * (radii @ axial.spin), sine * (axial.spin[0] - axial.spin[1])
    sliding[2, :, 1:] = [1.0, -1.0, first * sine, second * sine, -first * cosine, -second * cosine]
    rolling[2, :, 3:] = [sine, -sine, -cosine, cosine]
    slide, couple, turned = axial.resistances[..., None, None]
    forces = -(drags[:, :, None] + slide) * sliding - couple * rolling
    couples = -couple * sliding - turned * rolling
    slopes[:, 0, 1], slopes[:, 0, 2] = 1.0 / length, -1.0 / length
    for bead, side in enumerate((1.0, -1.0)):
        velocity, roll, turn = 1 + bead, 3 + bead, 5 + bead
        slopes[:, velocity] = (side * forces[2] + forces[bead]) / masses[bead]
        slopes[:, velocity, 0] += side * axial.push / masses[bead]
        between = radii[bead] * forces[2] + side * couples[2]
        slopes[:, roll] = (radii[bead] * forces[bead] + couples[bead] + sine * between) / inertias[bead]
        slopes[:, roll, 0] -= axial.torque[bead] / inertias[bead]
        slopes[:, turn] = -cosine * between / inertias[bead]
    return slopes


def _rolling(axial: _AxialMotion, dimer: Dimer, coefficient: float, speed: float) -> FloatArray:
    """What rolling friction adds to `_sideways`, where beads roll sideways at a speed (m/s, root mean square)."""
    radii, sine = np.array(dimer.radii), dimer.sin_delta
    cosine = sqrt(1.0 - sine**2)
    inertias = 2.0 / 5.0 * np.array(dimer.masses) * radii**2
    slopes = np.zeros((axial.push.shape[0], 7, 7))
    relative = axial.spin[0] - axial.spin[1]
    between = coefficient * axial.normal[2] * dimer.reduced_radius
    between = between / np.hypot(relative, speed / dimer.reduced_radius)
    twist = np.zeros(slopes.shape[::2])  # relative spin about the line across the axis, in the plane of contact
    twist[:, 0], twist[:, 3:] = -sine * relative, [-sine, sine, cosine, -cosine]
    for bead, side in enumerate((1.0, -1.0)):
        on_wall = coefficient * axial.normal[bead] * radii[bead] / np.hypot(axial.spin[bead], speed / radii[bead])
        slopes[:, 3 + bead] = side * sine * between[:, None] * twist / inertias[bead]
        slopes[:, 5 + bead] = -side * cosine * between[:, None] * twist / inertias[bead]
        slopes[:, 3 + bead, 3 + bead] -= on_wall / inertias[bead]
        # Against the spin across the drive it acts as well, which the other bead's torque must overcome.
        slopes[:, 3 + bead, 0] -= on_wall * axial.spin[bead] / inertias[bead]
    return slopes
