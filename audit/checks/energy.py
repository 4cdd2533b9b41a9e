"""Group 9: over a cycle of steady walking, the work of the substrate is what the contacts dissipate.

The engine's own bookkeeping does not serve: its dissipation settings (``computeDissipatedEnergy``) know nothing of the
bridges, and the tangential forces that ``compute pair/gran/local`` and ``wall/gran/local`` report are wrong for sliding
contacts. What permits the balance is the bead dump, taken every step: its total forces give the work of the substrate,
W = ∮ (Σ f − M g)·v_wall dt, and its positions, velocities and spins give, through the published laws of friction,
damping and viscosity alone, what each contact takes out. Forces enter the first side, kinematics the second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from walkers.audit.bench import Bench, bench_plan
from walkers.audit.check import Check, Line
from walkers.audit.checks.drive import reference_walker
from walkers.audit.laws import Partner, damping_law, lubrication_drags
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.physics.contact import damping_ratio, reduced_modulus, reduced_shear_modulus
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import prescribed_motion

_CYCLES = 14
_LEAD = 2
"""Cycles before the balanced one in which the friction springs, unknown at first, find their state."""


@dataclass(frozen=True)
class Touch:
    """Kinematics of a contact in the plane of motion, arrays of shape (F,), and its constants.

    ``radius`` is the bead's and ``mass`` the one that the contact slows. Speeds are positive for parting and along the
    tangent.
    """

    gap: FloatArray
    normal_speed: FloatArray
    sliding_speed: FloatArray
    radius: float
    partner: Partner
    mass: float
    friction: float


@dataclass(frozen=True)
class Dissipated:
    """Energy taken out by friction, viscosity and damping, J."""

    friction: float
    viscosity: float
    damping: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.friction + self.viscosity + self.damping


def dissipation(case: Case, touch: Touch, begin: int) -> Dissipated:
    """Integrate what a contact takes out from frame ``begin`` on (one frame a step).

    Hertz–Mindlin springs with the Coulomb limit and the damping of the engine's ``hertz`` and ``history`` models,
    lubrication after Nase et al.
    """
    contact, step = case.contact, case.run.time_step
    overlap = np.maximum(-touch.gap, 0.0)
    root = np.sqrt(touch.partner.reduced_radius(touch.radius) * overlap)
    modulus = reduced_modulus(contact.youngs_modulus, contact.poissons_ratio)
    shear_modulus = reduced_shear_modulus(contact.youngs_modulus, contact.poissons_ratio)
    damping = damping_ratio(contact.restitution)
    normal_damping = damping_law(case, touch.radius, touch.partner, touch.gap, touch.mass) / touch.partner.copies
    stiffness = 8.0 * shear_modulus * root
    tangential_damping = 2.0 * sqrt(5.0 / 6.0) * damping * np.sqrt(stiffness * touch.mass)
    limit = touch.friction * np.abs(4.0 / 3.0 * modulus * root * overlap - normal_damping * touch.normal_speed)
    power = _friction_power(touch.sliding_speed, stiffness, tangential_damping, limit, step)
    normal_drag, tangential_drag = lubrication_drags(case, touch.radius, touch.partner, touch.gap)
    viscous = normal_drag * touch.normal_speed**2 + tangential_drag * touch.sliding_speed**2
    damped, copies = normal_damping * touch.normal_speed**2, touch.partner.copies
    total = step * np.array([copies * power[begin:].sum(), viscous[begin:].sum(), copies * damped[begin:].sum()])
    return Dissipated(*map(float, total))


def _friction_power(
    sliding: FloatArray, stiffness: FloatArray, damping: FloatArray, limit: FloatArray, step: float
) -> FloatArray:
    """Power that the tangential spring with Coulomb's limit takes, W, step by step."""
    power = np.zeros_like(sliding)
    spring = 0.0
    for number in range(len(sliding)):
        if stiffness[number] == 0.0:
            spring = 0.0
            continue
        spring += sliding[number] * step
        pull = stiffness[number] * spring
        if abs(pull) > limit[number]:
            pull = np.copysign(limit[number], pull)
            spring = pull / stiffness[number]
        else:
            pull += damping[number] * sliding[number]
        power[number] = pull * sliding[number]
    return power


def balance(bench: Bench) -> Iterator[Line]:
    """The reference walker, recorded every step, its last cycle balanced."""
    case = reference_walker(drive={"frame": "lab"}, run={"cycles": _CYCLES, "settling_cycles": 2, "time_step": "auto"})
    cycle = case.run.steps_per_cycle
    plan = bench_plan(case, bench.workarounds)
    every_step = replace(plan.recording, sample_every=1, bridge_every=cycle, status_every=cycle)
    series = bench.run(replace(plan, recording=every_step))
    kept = slice((_CYCLES - 1 - _LEAD) * cycle, _CYCLES * cycle)
    pair = slice(series.row(2), series.row(4))
    time = series.steps[kept] * case.run.time_step
    wall_speed = prescribed_motion(case.drive, time)[1][:, 0]
    position, velocity, spin, force = (
        values[kept, pair] for values in (series.position, series.velocity, series.spin, series.force)
    )
    begin = _LEAD * cycle
    # Gravity has no part along the drive: the sum of the beads' forces there is what the substrate exerts.
    work = float(np.sum(force[begin:, :, 0].sum(axis=1) * wall_speed[begin:]) * case.run.time_step)
    touches = _touches(case, position, velocity, spin, wall_speed)
    parts = [dissipation(case, touch, begin) for touch in touches]
    dissipated = sum(part.total for part in parts)
    source = "W = ∮ (Σ f - M g) · v_wall dt against the laws of friction, viscosity and damping"
    needs = frozenset({"walls"})
    yield Line(
        "energy over a cycle: work of the substrate against what the contacts dissipate",
        source,
        work,
        dissipated,
        "J",
        0.01,
        None,
        needs,
    )
    for what in ("friction", "viscosity", "damping"):
        yield Line(
            f"energy over a cycle: share of {what}",
            "of the dissipated energy",
            1.0,
            sum(getattr(part, what) for part in parts) / dissipated,
        )


def _touches(
    case: Case, position: FloatArray, velocity: FloatArray, spin: FloatArray, wall_speed: FloatArray
) -> list[Touch]:
    radii, masses = case.walkers[0].radii, dimer_of(case).masses
    contact = case.contact
    touches = [
        Touch(
            gap=position[:, bead, 2] - radius,
            normal_speed=velocity[:, bead, 2],
            sliding_speed=velocity[:, bead, 0] - wall_speed - radius * spin[:, bead, 1],
            radius=radius,
            partner=Partner(radius, wall=True),
            mass=masses[bead],
            friction=contact.friction_bead_wall,
        )
        for bead, radius in enumerate(radii)
    ]
    arm = position[:, 0] - position[:, 1]
    distance = np.linalg.norm(arm, axis=1)
    normal = arm / distance[:, None]
    tangent = np.stack([normal[:, 2], np.zeros(len(arm)), -normal[:, 0]], axis=1)
    relative = velocity[:, 0] - velocity[:, 1]
    touches.append(
        Touch(
            gap=distance - sum(radii),
            normal_speed=np.einsum("fx,fx->f", relative, normal),
            sliding_speed=np.einsum("fx,fx->f", relative, tangent) - spin[:, :, 1] @ np.array(radii),
            radius=radii[0],
            partner=Partner(radii[1]),
            mass=masses[0] * masses[1] / sum(masses),
            friction=contact.friction_bead_bead,
        )
    )
    return touches


CHECKS = (Check("energy", 9, "energy balance over a cycle of steady walking", True, balance),)
