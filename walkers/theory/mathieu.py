"""Alignment: whether a dimer on a substrate or a wall stays aligned with the axis of the drive.

A dimer that rolls sideways without sliding, at Ω about the line through its contacts with the
substrate, turns by ψ̇ = Ω (R1 - R2)/L with L = 2√(R1 R2). Energy and the work of the inertial force
give a Mathieu equation, with ϑ = πft,

    d²ψ/dϑ² + [U - 4V cos 2ϑ] ψ = 0,    4V = (5/7) a0/(π² f²) (R1 - R2)/L (Σ m R)/(Σ m R²)

and U = 0 on a level substrate. A steady acceleration along the axis, such as a climber's weight,
gives U as the drive gives V. Bridges to the substrate with rolling resistance Q dissipate the power
Σ Q Ω² of the energy (7/10) Σ m R² Ω², which adds 2β dψ/dϑ with 2πfβ = (5/7) (Σ Q)/(Σ m R²); the
bridge between the beads of a rigid cone dissipates nothing. For a fast drive, U + 2V²/(1 + β²)
replaces U - 4V cos 2ϑ (Kapitza's pendulum): a dimer on its head (U < 0) stands if this is positive.

The equation treats the two beads as a cone, one rigid body. In fact, each bead can spin freely
about its own normal to the substrate, and a contact that slides along the axis resists sideways
sliding only as a drag does. `turning_rate` includes this: it is the Floquet exponent of ψ, the
sideways velocities of both beads, and their spins about the drive and about the normal, linearised
about the axial motion of `walkers.theory.motion`. Dimers in the engine turn over at these rates
within a per cent (docs/explanation/climbing.md).
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
from walkers.physics.edges import SLOWEST
from walkers.theory.motion import Walker, predict_motion
from walkers.theory.quasistatic import (
    inertia_matrix,
    normal_force_matrix,
    rolling_matrix,
    translation,
)

LARGEST_STABLE_V = 0.45402316686747424
"""Largest V with stable small angles on a level substrate: the characteristic value b1(q = 2V) is
zero."""
_NEUTRAL = 1e-6
"""Growth per unit of ϑ that counts as zero."""
_SLOWEST = 1e-4
"""Speed in m/s; a contact that slides more slowly resists sideways sliding as at this speed."""
_STEPS = 256
"""Steps per cycle of the axial motion."""
_MATHIEU_STEPS = 128
"""Steps per period of the Mathieu equation, which is π; in each, U - 4V cos 2ϑ is constant."""
_ANGLE = radians(1.0)
"""Angle to the axis at which rolling friction is evaluated.

Rolling friction is larger at smaller angles: while the rolling along the axis reverses, only
sideways rolling is left.
"""


@dataclass(frozen=True)
class Alignment:
    """The Mathieu equation of small angles to the axis, d²ψ/dϑ² + 2β dψ/dϑ + [U - 4V cos 2ϑ] ψ = 0.

    Attributes
    ----------
    u, v
        U and V.
    damping
        β.
    """

    u: float
    v: float
    damping: float = 0.0

    @property
    def stable(self) -> bool:
        """Whether small angles stay small; with damping they decay."""
        return self.growth <= _NEUTRAL

    @property
    def growth(self) -> float:
        """Largest growth rate (Floquet exponent) of small angles per unit of ϑ.

        Multiplied by πf, it is in 1/s.
        """
        theta = pi * (np.arange(_MATHIEU_STEPS) + 0.5) / _MATHIEU_STEPS
        slopes = np.zeros((_MATHIEU_STEPS, 2, 2))
        slopes[:, 0, 1] = 1.0
        slopes[:, 1, 0] = 4.0 * self.v * np.cos(2.0 * theta) - self.u
        slopes[:, 1, 1] = -2.0 * self.damping
        multipliers, _ = _floquet(slopes, pi / _MATHIEU_STEPS)
        return float(np.log(np.abs(multipliers).max()) / pi)


def alignment(case: Case) -> Alignment:
    """The equation of a case's dimer, damped by its bridges to the substrate.

    A climber that leads with its large bead stands on its head (U < 0), and only the drive keeps it
    upright; with its large bead below it hangs as from a pivot (U > 0).
    """
    dimer = dimer_of(case)
    drive = case.excitation
    pi_f = pi * drive.frequency
    first, second = dimer.radii
    first_mass, second_mass = dimer.masses
    lever = (first - second) / (2.0 * sqrt(first * second))
    moment = first_mass * first**2 + second_mass * second**2  # Σ m R²
    per_acceleration = (
        5.0 / 7.0 * lever * (first_mass * first + second_mass * second) / moment / pi_f**2
    )
    rolling_resistance = float(Walker.of_case(case).resistances[2, :2].sum())
    return Alignment(
        u=-case.axial_gravity * per_acceleration,
        v=drive.peak_acceleration * per_acceleration / 4.0,
        damping=5.0 / 7.0 * rolling_resistance / moment / (2.0 * pi_f),
    )


def _floquet(
    slopes: FloatArray, step: float
) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.complex128]]:
    """Floquet multipliers of dx/dt = A(t) x, shape (n,), and their modes, one a column.

    Parameters
    ----------
    slopes
        A, constant in each of the equal steps of a period, shape (steps, n, n).
    step
        Length of a step, in the unit of t.
    """
    from scipy.linalg import expm

    propagator = np.eye(slopes.shape[-1])  # x(t + period) = propagator · x(t)
    for propagator_of_step in expm(slopes * step):
        propagator = propagator_of_step @ propagator
    multipliers, modes = np.linalg.eig(propagator)
    return multipliers.astype(np.complex128), modes.astype(np.complex128)


def time_to_turn(rate: float) -> float:
    """Seconds from 1° to 90° at dψ/dt = rate sin ψ, in 1/s: ln(tan(ψ2/2)/tan(ψ1/2))/rate."""
    return log(tan(radians(90.0) / 2.0) / tan(_ANGLE / 2.0)) / rate


def turning_rate(case: Case) -> float | None:
    """Growth rate of small angles to the axis, 1/s.

    It is negative for decay, and None if the motion is not periodic.

    Each contact resists sideways sliding by c = μ(|v|) F/|v|, because friction is opposite to the
    direction of sliding, which is almost along the axis; its bridge resists as along the axis.
    Similarly, rolling friction resists sideways rolling by μ F R/|ω|, with the engine's model of
    constant torque; it is left out of the axial motion. Edges that move with the velocity u, almost
    along the axis, resist their sideways velocity by E/|u|^(1/3) (`walkers.physics.edges`).
    """
    walker = Walker.of_case(case)
    axial = _axial_motion(case, walker)
    if axial is None:
        return None
    frequency = case.excitation.frequency
    speeds = np.maximum(np.abs(axial.sliding), _SLOWEST)
    coefficients = []
    for friction, speed in zip(case.contact.friction.of_dimer, speeds, strict=True):
        coefficients.append(friction.coefficient(speed))
    sliding_resistance = np.array(coefficients) * axial.normal / speeds
    rolling_resistance = _resistance_to_rolling(case, axial)
    slopes = _sideways_slopes(
        dimer_of(case), walker.resistances, axial, sliding_resistance, rolling_resistance
    )
    multipliers, modes = _floquet(slopes, 1.0 / (frequency * len(slopes)))
    turning = np.delete(multipliers, _mode_of_meshing_spins(dimer_of(case), modes))
    return float(np.log(np.abs(turning).max()) * frequency)


def _mode_of_meshing_spins(dimer: Dimer, modes: npt.NDArray[np.complex128]) -> int:
    """The mode in which beads spin against each other about the vertical, as two wheels in mesh.

    With R1 ω1 = -R2 ω2 the surfaces of the beads do not slide on each other, and contacts with the
    substrate do not resist spins about the vertical. Only edges of menisci damp the mode, and it
    does not turn the dimer.

    Parameters
    ----------
    dimer
        The beads.
    modes
        Modes of the variables of `_sideways_slopes`, one a column, shape (7, 7).

    Returns
    -------
    int
        The mode with the largest part of its kinetic energy in these spins.
    """
    masses = np.array(dimer.masses)
    inertias = 0.4 * masses * np.array(dimer.radii) ** 2
    # Scaled by these roots, the square of a mode is twice its kinetic energy. The first variable,
    # ψ, has none.
    root_of_energy = np.sqrt(np.concatenate([masses, inertias, inertias]))
    moving = root_of_energy[:, None] * modes[1:]
    first, second = dimer.radii
    # The spins (ω1, ω2) ∝ (R2, -R1). A share is the cosine of the angle between a mode and these
    # spins, times the same factor for all modes; its square is the share of the kinetic energy.
    in_mesh = root_of_energy * np.array([0.0, 0.0, 0.0, 0.0, second, -first])
    shares = np.abs(in_mesh @ moving) / np.linalg.norm(moving, axis=0)
    return int(np.argmax(shares))


@dataclass(frozen=True)
class _AxialMotion:
    """The periodic motion along the axis, and the forces that go with it.

    Values are those in the middle of each step of a cycle.
    """

    sliding: FloatArray
    """Sliding velocities of the contacts, m/s, shape (3, steps)."""
    normal: FloatArray
    """Normal forces, N, shape (3, steps)."""
    spin: FloatArray
    """Angular velocities of the beads about the horizontal across the axis, rad/s, shape (2,
    steps); positive for a bead that rolls along the axis."""
    force: FloatArray
    """Force along the axis of the second bead on the first, N, shape (steps,)."""
    torque: FloatArray
    """Torque of the other bead on each bead, N m, shape (2, steps), with the sign of the spin."""
    velocity: FloatArray
    """Velocity of the walker on the substrate, m/s, shape (steps,)."""
    edges: FloatArray
    """Resistances E of the edges of the three bridges, N (s/m)^(2/3), shape (3,)."""


def _axial_motion(case: Case, walker: Walker) -> _AxialMotion | None:
    """The axial motion of the dimer of a case; None if it is not periodic."""
    dimer = dimer_of(case)
    frequency = case.excitation.frequency
    peak = case.excitation.peak_acceleration
    steady = case.axial_gravity
    motion = predict_motion(
        walker, frequency, peak, steady_acceleration=steady, steps_per_cycle=_STEPS
    )
    if not (motion.periodic[0] and motion.solved[0]):
        return None
    after = motion.series[:, 0]
    steps = after.shape[1]  # more than asked for if edges resist
    before = np.roll(after, 1, axis=1)
    sliding = (before + after) / 2.0
    slope = (after - before) * frequency * steps  # dv/dt, m/s²
    inertial = peak * np.cos(2.0 * pi * (np.arange(steps) + 0.5) / steps) + steady
    gains = inertia_matrix(dimer.sin_delta) / dimer.total_mass
    rolling_rates = rolling_matrix(*dimer.radii)
    _, coupling, rolling = walker.resistances
    couples = coupling * sliding + rolling * (rolling_rates @ sliding)
    total = np.linalg.solve(gains, -slope - np.outer([1.0, 1.0, 0.0], inertial))
    velocity = translation(sliding)
    # Velocities of the surfaces of the beads, with which their edges move, and of the walker.
    turning = sliding[:2] - velocity
    edges = walker.edges[:, 0] * dimer.capillary_scale
    edge_couples = edges[:2, None] * (_two_thirds(turning) - _two_thirds(velocity))  # over R
    # F∥ + f of each contact, N
    parallel = total - rolling_rates.T @ couples - _couples_of_edges(walker, sliding)
    normal = (
        walker.normal_at_rest * dimer.capillary_scale
        + normal_force_matrix(dimer.sin_delta) @ parallel
    )
    radii = np.array(dimer.radii)[:, None]
    masses = np.array(dimer.masses)[:, None]
    acceleration = translation(slope)
    # A bead slides at v = V - Rω, so that Rω = V - v. The substrate resists by -(F∥ + f) at the
    # lowest point, which makes the bead roll forward; its couples act on -ω, hence with a plus on
    # ω. The torque of the other bead is the rest of I dω/dt, with I = 0.4 m R² of a solid sphere.
    total_torque = 0.4 * masses * radii * (acceleration - slope[:2])
    return _AxialMotion(
        sliding=sliding,
        normal=np.maximum(normal, 0.0),  # an open contact has no load
        spin=(translation(sliding) - sliding[:2]) / radii,
        force=masses[0] * (acceleration + inertial) + parallel[0],
        torque=total_torque - radii * (parallel[:2] + edge_couples) - couples[:2],
        velocity=velocity,
        edges=edges,
    )


def _couples_of_edges(walker: Walker, sliding: FloatArray) -> FloatArray:
    """The couples of edges on the sliding velocities of the contacts, N, shape (3, steps).

    They are those of `walkers.theory.stepping.edge_forces`.
    """
    from walkers.theory.stepping import edge_forces

    parameters = np.concatenate([walker.edges[:, 0], walker.radii[:, 0]])
    unused = np.zeros((3, 3))
    columns = []
    for velocities in sliding.T:
        _, _, couples = edge_forces(tuple(velocities), unused[0], unused, parameters)
        columns.append(couples)
    return np.array(columns).T * walker.force_unit


def _two_thirds(velocity: FloatArray) -> FloatArray:
    """The power 2/3 of velocities, with their signs (`walkers.theory.stepping`)."""
    return velocity * _slowing(velocity)


def _slowing(velocity: FloatArray) -> FloatArray:
    """The power -1/3 of the speeds with which edges move."""
    slowing: FloatArray = (velocity**2 + SLOWEST**2) ** (-1.0 / 6.0)
    return slowing


def _resistance_to_rolling(case: Case, axial: _AxialMotion) -> FloatArray:
    """Resistance of rolling friction to sideways rolling, N m s, shape (3, steps).

    It is that at the mean sideways speed of the beads at `_ANGLE`.
    """
    dimer = dimer_of(case)
    drive = case.excitation
    # A bead that rolls on a shaken substrate moves relative to it at 5/7 of the drive's velocity
    # a0/ω; this is the root mean square of the part across the axis.
    speed = 5.0 / 7.0 * drive.peak_acceleration / (2.0 * pi * drive.frequency) * _ANGLE / sqrt(2.0)
    radii = np.array([*dimer.radii, dimer.reduced_radius])[:, None]
    first_spin, second_spin = axial.spin
    spins = np.array([first_spin, second_spin, first_spin - second_spin])
    resistance: FloatArray = (
        case.contact.rolling_friction * axial.normal * radii / np.hypot(spins, speed / radii)
    )
    return resistance


def _sideways_slopes(
    dimer: Dimer,
    resistances: FloatArray,
    axial: _AxialMotion,
    sliding_resistance: FloatArray,
    rolling_resistance: FloatArray,
) -> FloatArray:
    """The matrices A(t) of the linear equations of sideways motion, dx/dt = A x, in SI units.

    The variables are ψ, the velocities of the beads across the drive, their spins about the drive,
    and their spins about the vertical. The force of one bead on the other along the axis has a
    component across the drive, ψ times as large; so have the torque and the spin. Contacts slide at
    v and roll at q across the dimer, with the forces -(c v + S v + C q) and the couples -(C v + Q q
    + h q) of `walkers.physics.bridge`.

    Parameters
    ----------
    dimer
        The beads.
    resistances
        S, C and Q of the bridges at the three contacts, shape (3, 3, 1).
    axial
        The motion along the axis.
    sliding_resistance
        c of friction, N s/m, shape (3, steps).
    rolling_resistance
        h of rolling friction, N m s, shape (3, steps).

    Returns
    -------
    numpy.ndarray
        A at each step, shape (steps, 7, 7).
    """
    radii = np.array(dimer.radii)
    sine = dimer.sin_delta
    cosine = sqrt(1.0 - sine**2)
    inertias = 0.4 * np.array(dimer.masses) * radii**2
    first_spin, second_spin = axial.spin
    slopes = np.zeros((len(axial.force), 7, 7))

    # Sideways v and q of each contact as rows of coefficients of the variables.
    sliding, rolling = np.zeros((2, 3, *slopes.shape[::2]))
    for bead in range(2):
        sliding[bead, :, 1 + bead] = 1.0
        sliding[bead, :, 3 + bead] = radii[bead]
        rolling[bead, :, 3 + bead] = 1.0
    sliding[2, :, 0] = sine * (radii @ axial.spin)
    sliding[2, :, 1:3] = [1.0, -1.0]
    sliding[2, :, 3:5] = radii * sine
    sliding[2, :, 5:7] = -radii * cosine
    rolling[2, :, 0] = sine * (first_spin - second_spin)
    rolling[2, :, 3:] = [sine, -sine, -cosine, cosine]

    s, c, q = resistances[..., None]
    forces = -(sliding_resistance[:, :, None] + s) * sliding - c * rolling
    couples = -c * sliding - (q + rolling_resistance[:, :, None]) * rolling
    edge_forces, edge_couples = _sideways_edges(dimer, axial)
    forces += edge_forces
    couples += edge_couples
    # Rolling friction also opposes the spin across the drive, which the torque of the other bead
    # must overcome.
    couples[:2, :, 0] -= rolling_resistance[:2] * axial.spin

    slopes[:, 0, 1:3] = np.array([1.0, -1.0]) / (2.0 * sqrt(radii[0] * radii[1]))
    for bead, side in enumerate((1.0, -1.0)):
        velocity = 1 + bead
        roll = 3 + bead
        vertical = 5 + bead
        slopes[:, velocity] = (side * forces[2] + forces[bead]) / dimer.masses[bead]
        slopes[:, velocity, 0] += side * axial.force / dimer.masses[bead]
        between_beads = radii[bead] * forces[2] + side * couples[2]
        torque = radii[bead] * forces[bead] + couples[bead] + sine * between_beads
        slopes[:, roll] = torque / inertias[bead]
        slopes[:, roll, 0] -= axial.torque[bead] / inertias[bead]
        slopes[:, vertical] = -cosine * between_beads / inertias[bead]
    return slopes


def _sideways_edges(dimer: Dimer, axial: _AxialMotion) -> tuple[FloatArray, FloatArray]:
    """The forces and couples of edges that move across the dimer, as in `_sideways_slopes`.

    The point of contact moves along the surfaces with the velocities of
    `walkers/templates/engine/forces.h`.

    Returns
    -------
    forces, couples : ndarray
        Rows of coefficients of the variables for each contact, shape (3, steps, 7).
    """
    radii = np.array(dimer.radii)
    sine = dimer.sin_delta
    cosine = sqrt(1.0 - sine**2)
    shares = radii / radii.sum()
    on_beads = _slowing(radii[:, None] * axial.spin)
    on_substrate = _slowing(axial.velocity)
    forces, couples = np.zeros((2, 3, len(axial.force), 7))
    reduced_radius = radii.prod() / radii.sum()
    for bead, side in enumerate((1.0, -1.0)):
        velocity = 1 + bead
        roll = 3 + bead
        vertical = 5 + bead
        substrate_drag = axial.edges[bead] * on_substrate
        forces[bead, :, velocity] = -substrate_drag
        # This edge resists the velocity of the bead alone: the couple cancels the torque that
        # `_sideways_slopes` gives to a force at the contact.
        couples[bead, :, velocity] = radii[bead] * substrate_drag
        couples[bead, :, roll] = -(radii[bead] ** 2) * axial.edges[bead] * on_beads[bead]

        # What the surface of this bead contributes to the sliding of the contact of both.
        motion = np.zeros((len(axial.force), 7))
        motion[:, 0] = radii[bead] * sine * axial.spin[bead]
        motion[:, 1:3] = shares[bead] * np.array([1.0, -1.0])
        motion[:, roll] = radii[bead] * sine
        motion[:, vertical] = -radii[bead] * cosine
        # The edge moves by -motion along the first bead and by +motion along the second one, and
        # drags the surface along.
        surface_force = -side * axial.edges[2] * on_beads[bead][:, None] * motion
        # The force of the contact is that on the first bead: forces on the second count negative.
        forces[2] += side * shares[bead] * surface_force
        couples[2] += reduced_radius * surface_force
    return forces, couples
