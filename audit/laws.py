"""The published laws as vectors: what a bead must feel from a bridge or a contact, for given gap, velocity and spin.

Symbols: n the unit vector from the other surface toward the bead, h the gap, v the velocity of the bead relative to the
other surface's body, ω its angular velocity; vectors have shape (F, 3), scalars (F,).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputs import forces
from inputs.case import WalkerCase
from postprocess.dump import FloatArray


@dataclass(frozen=True)
class Partner:
    """The other side of a contact: its radius (that of the bead itself for a wall), and whether it is a wall."""

    radius: float
    wall: bool = False

    @property
    def copies(self) -> float:
        """How often it stands in the deck."""
        return 2.0 if self.wall else 1.0

    def reduced_radius(self, radius: float) -> float:
        """R* of the elastic contact with a bead, m."""
        return radius if self.wall else radius * self.radius / (radius + self.radius)

    def viscous_radius(self, radius: float) -> float:
        """R* of the lubrication forces, m: a wall counts as an equal sphere."""
        return radius / 2.0 if self.wall else self.reduced_radius(radius)


def capillary_law(case: WalkerCase, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Attraction at each gap, N: Soulié et al. (2006); at a wall twice that of equal spheres; zero past rupture."""
    liquid = case.liquid
    if partner.wall:
        volume = forces.bridge_volume_at_wall(radius, liquid.volume_fraction)
    else:
        volume = forces.bridge_volume_between_beads(radius, partner.radius, liquid.volume_fraction)
    rupture = forces.rupture_distance(volume, liquid.contact_angle)
    other = radius if partner.wall else partner.radius
    values = [
        partner.copies
        * forces.capillary_force(liquid.surface_tension, radius, other, volume, liquid.contact_angle, float(h))
        for h in gap
    ]
    return np.where(gap < rupture, values, 0.0)


def hertz_law(case: WalkerCase, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Repulsion 4/3 E* √R* δ^(3/2), N; a wall stands twice."""
    modulus = forces.reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    root = np.sqrt(partner.reduced_radius(radius))
    law: FloatArray = partner.copies * 4.0 / 3.0 * modulus * root * np.maximum(-gap, 0.0) ** 1.5
    return law


def lubrication_drags(case: WalkerCase, reduced: float, gap: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the normal and the tangential viscous force of one bridge, N s/m, at each gap.

    6πηR*/max(ε, h/R*) and (8/15 ln(1/max(ε, h/R*)) + 0.9588) 6πηR*, after Nase et al. as in Shi and McCarthy, Powder
    Technology 184 (2008) 65, Eqs. 40, 41.
    """
    stokes = 6.0 * np.pi * case.liquid.dynamic_viscosity * reduced
    nearness = np.maximum(case.contact.minimum_separation_ratio, gap / reduced)
    return stokes / nearness, stokes * (8.0 / 15.0 * np.log(1.0 / nearness) + 0.9588)


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
    case: WalkerCase,
    radius: float,
    partner: Partner,
    normal: FloatArray,
    gap: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    partner_spin: FloatArray | None = None,
) -> Exerted:
    """Force on a bead and torque about its centre by capillarity, viscosity and elasticity, without friction.

    The viscous forces are those of `lubrication_drags`, at a wall twice. The arms of overlapping surfaces end half way
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
    drags = lubrication_drags(case, partner.viscous_radius(radius), gap)
    normal_drag, tangential_drag = (partner.copies * drag * (bound > 0.0) for drag in drags)
    normal_speed = np.einsum("fx,fx->f", velocity, normal)
    sliding = velocity - normal_speed[:, None] * normal - np.cross(turning, normal)
    tangential = -tangential_drag[:, None] * sliding
    return Exerted(
        normal=normal,
        steady=(hertz_law(case, radius, partner, gap) - bound)[:, None] * normal,
        viscous=-(normal_drag * normal_speed)[:, None] * normal + tangential,
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
