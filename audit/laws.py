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


def capillary_law(case: WalkerCase, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Attraction at each gap, N: Soulié et al. (2006); at a wall twice that of equal spheres; zero past rupture."""
    liquid = case.liquid
    if partner.wall:
        volume = forces.bridge_volume_at_wall(radius, liquid.volume_fraction)
    else:
        volume = forces.bridge_volume_between_beads(radius, partner.radius, liquid.volume_fraction)
    rupture = forces.rupture_distance(volume, liquid.contact_angle)
    copies = 2.0 if partner.wall else 1.0
    other = radius if partner.wall else partner.radius
    values = [
        copies * forces.capillary_force(liquid.surface_tension, radius, other, volume, liquid.contact_angle, float(h))
        for h in gap
    ]
    return np.where(gap < rupture, values, 0.0)


def hertz_law(case: WalkerCase, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Repulsion 4/3 E* √R* δ^(3/2), N; a wall stands twice."""
    modulus = forces.reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    reduced = radius if partner.wall else radius * partner.radius / (radius + partner.radius)
    copies = 2.0 if partner.wall else 1.0
    law: FloatArray = copies * 4.0 / 3.0 * modulus * np.sqrt(reduced) * np.maximum(-gap, 0.0) ** 1.5
    return law


def bridge_law(
    case: WalkerCase,
    radius: float,
    partner: Partner,
    normal: FloatArray,
    gap: FloatArray,
    velocity: FloatArray,
    turning: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Force on a bead and torque about its centre by capillarity, viscosity and elasticity, N and N m, shape (F, 3).

    Viscous forces after Nase et al. as in Shi and McCarthy, Powder Technology 184 (2008) 65, Eqs. 40, 41: normal
    6πηR* v_n/max(ε, h/R*), tangential (8/15 ln(1/max(ε, h/R*)) + 0.9588) 6πηR* v_t. At a wall R* = R/2, twice.

    Parameters
    ----------
    velocity
        Relative velocity of the centres.
    turning
        R1 ω1 + R2 ω2 (at a wall R ω), m/s.
    """
    reduced = radius / 2.0 if partner.wall else radius * partner.radius / (radius + partner.radius)
    copies = 2.0 if partner.wall else 1.0
    bound = capillary_law(case, radius, partner, gap)
    stokes = 6.0 * np.pi * case.liquid.dynamic_viscosity * reduced * copies * (bound > 0.0)
    nearness = np.maximum(case.contact.minimum_separation_ratio, gap / reduced)
    normal_speed = np.einsum("fx,fx->f", velocity, normal)
    sliding = velocity - normal_speed[:, None] * normal - np.cross(turning, normal)
    tangential = -(stokes * (8.0 / 15.0 * np.log(1.0 / nearness) + 0.9588))[:, None] * sliding
    along = hertz_law(case, radius, partner, gap) - bound - stokes * normal_speed / nearness
    return along[:, None] * normal + tangential, -radius * np.cross(normal, tangential)


def largest_error(measured: FloatArray, expected: FloatArray) -> float:
    """Largest deviation over a series, relative to the largest expected magnitude."""
    scale = np.linalg.norm(np.atleast_2d(expected), axis=-1).max()
    deviation = np.linalg.norm(np.atleast_2d(measured - expected), axis=-1).max()
    return float(deviation / scale) if scale > 0.0 else float(deviation)
