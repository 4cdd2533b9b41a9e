"""The published laws as vectors: what a bead must feel from a bridge or a contact, for given gap, velocity and spin.

Symbols: n the unit vector from the other surface toward the bead, h the gap, v the velocity of the bead relative to the
other surface's body, ω its angular velocity; vectors have shape (F, 3), scalars (F,).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walkers.inputs.case import Case
from walkers.physics.capillary import (
    bridge_volume_at_wall,
    bridge_volume_between_beads,
    capillary_force,
    capillary_force_at_wall,
    rupture_distance,
)
from walkers.physics.contact import (
    damping_ratio,
    hertz_repulsion,
    hertz_repulsion_at_wall,
    normal_damping,
    normal_damping_at_wall,
    reduced_modulus,
)
from walkers.physics.lubrication import normal_drag, normal_drag_at_wall, tangential_drag, tangential_drag_at_wall
from walkers.physics.wall import WALL_COPIES
from walkers.postprocess.dump import FloatArray


@dataclass(frozen=True)
class Partner:
    """The other side of a contact: its radius (that of the bead itself for a wall), and whether it is a wall."""

    radius: float
    wall: bool = False

    @property
    def copies(self) -> int:
        """How often it stands in the deck."""
        return WALL_COPIES if self.wall else 1

    def reduced_radius(self, radius: float) -> float:
        """R* of the elastic contact with a bead, m."""
        return radius if self.wall else radius * self.radius / (radius + self.radius)


def capillary_law(case: Case, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Attraction at each gap, N (`walkers.physics.capillary`); zero past rupture."""
    liquid = case.liquid
    tension, angle = liquid.surface_tension, liquid.contact_angle
    if partner.wall:
        volume = bridge_volume_at_wall(radius, liquid.volume_fraction)
        values = [capillary_force_at_wall(tension, radius, volume, angle, float(h)) for h in gap]
    else:
        volume = bridge_volume_between_beads(radius, partner.radius, liquid.volume_fraction)
        values = [capillary_force(tension, radius, partner.radius, volume, angle, float(h)) for h in gap]
    return np.where(gap < rupture_distance(volume, angle), values, 0.0)


def hertz_law(case: Case, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Repulsion, N (`walkers.physics.contact`)."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    if partner.wall:
        return np.array([hertz_repulsion_at_wall(-float(h), radius, modulus) for h in gap])
    return np.array([hertz_repulsion(-float(h), partner.reduced_radius(radius), modulus) for h in gap])


def damping_law(case: Case, radius: float, partner: Partner, gap: FloatArray, mass: float) -> FloatArray:
    """Coefficient of the damping along the normal (`walkers.physics.contact`), N s/m; reduced mass in kg."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    law, size = (normal_damping_at_wall, radius) if partner.wall else (normal_damping, partner.reduced_radius(radius))
    ratio = damping_ratio(case.contact.restitution)
    return np.array([law(-float(h), size, modulus, mass, ratio) for h in gap])


def lubrication_drags(case: Case, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Normal and tangential coefficients of the viscous force (`walkers.physics.lubrication`), N s/m, (2, F)."""
    size = partner.reduced_radius(radius)
    laws = (normal_drag_at_wall, tangential_drag_at_wall) if partner.wall else (normal_drag, tangential_drag)
    viscosity, nearest = case.liquid.dynamic_viscosity, case.contact.minimum_separation_ratio
    return np.array([[law(viscosity, size, nearest, float(h)) for h in gap] for law in laws])


@dataclass(frozen=True)
class Exerted:
    """What a contact exerts on a bead, arrays of shape (F, 3): elastic and capillary force, viscous force, torque.

    N and N m; ``normal`` is the unit vector toward the bead.
    """

    normal: FloatArray
    steady: FloatArray
    viscous: FloatArray
    torque: FloatArray

    @property
    def force(self) -> FloatArray:
        """All of the force."""
        return self.steady + self.viscous


def bridge_law(  # noqa: PLR0913, PLR0917, the kinematics of a contact
    case: Case,
    radius: float,
    partner: Partner,
    normal: FloatArray,
    gap: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    partner_spin: FloatArray | None = None,
) -> Exerted:
    """Force on a bead and torque about its centre by capillarity, viscosity and elasticity, without friction.

    The viscous forces are those of `lubrication_drags`. The arms of overlapping surfaces end half way
    into the overlap.

    Parameters
    ----------
    velocity
        Relative velocity of the centres, m/s.
    spin, partner_spin
        Angular velocities, rad/s.
    """
    inside = np.minimum(gap, 0.0) * 0.5
    arm, other_arm = radius + inside, partner.radius + inside
    turning = arm[:, None] * spin + (0.0 if partner_spin is None else other_arm[:, None] * partner_spin)
    bound = capillary_law(case, radius, partner, gap)
    along_normal, along_surface = lubrication_drags(case, radius, partner, gap) * (bound > 0.0)
    normal_speed = np.einsum("fx,fx->f", velocity, normal)
    sliding = velocity - normal_speed[:, None] * normal - np.cross(turning, normal)
    tangential = -along_surface[:, None] * sliding
    return Exerted(
        normal=normal,
        steady=(hertz_law(case, radius, partner, gap) - bound)[:, None] * normal,
        viscous=-(along_normal * normal_speed)[:, None] * normal + tangential,
        torque=-arm[:, None] * np.cross(normal, tangential),
    )


def frame_by_frame_error(measured: FloatArray, expected: FloatArray) -> float:
    """Largest over the frames of |measured − expected|/|expected|; infinite where something is measured for nothing."""
    scale = np.linalg.norm(expected, axis=-1)
    deviation = np.linalg.norm(measured - expected, axis=-1)
    nothing = scale == 0.0
    if np.any(deviation[nothing] > 0.0):
        return float("inf")
    return float((deviation[~nothing] / scale[~nothing]).max()) if np.any(~nothing) else 0.0


def largest_error(measured: FloatArray, expected: FloatArray) -> float:
    """Largest deviation over a series, relative to the largest expected magnitude."""
    scale = np.linalg.norm(np.atleast_2d(expected), axis=-1).max()
    deviation = np.linalg.norm(np.atleast_2d(measured - expected), axis=-1).max()
    return float(deviation / scale) if scale > 0.0 else float(deviation)
