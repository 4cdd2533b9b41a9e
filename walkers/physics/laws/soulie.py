"""The law of standard LIGGGHTS, corrected at walls: Soulié's force, lubrication of immersed spheres at all gaps.

    F = πγ √(R1 R2) (exp(A h/R2 + B) + C),        R2 the larger radius, h the gap
    N = 6πηR*/x,        S = 6πηR* (8/15 ln(1/x) + 0.9588),        x = max(ε, h/R*)

At a wall, the pull is twice that of two equal spheres, and the resistances are those of a plane (R* = R). ε is the
roughness over R*. Only the sliding force causes a torque. At gaps above εR/2 from a wall, decks of standard LIGGGHTS
have about a fifth less tangential resistance than this law. The bridge breaks at (1 + θ/2) V^(1/3).

References
----------
F. Soulié, F. Cherblanc, M. S. El Youssoufi, C. Saix, Int. J. Numer. Anal. Meth. Geomech. 30 (2006) 213, Eqs. 13, 14.
Nase et al. as in D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75, Eqs. 40, 41.
"""

from __future__ import annotations

from math import inf, pi, sqrt

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics.bridge import Curve, Forces, Surfaces
from walkers.physics.capillary import rupture_distance
from walkers.physics.portable import exponential, logarithm, power


def pull(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Pull over the surface tension, F/γ (m), at gaps (m), both of shape (n,), for a volume in m³ and an angle in rad.

    An infinite ``radius_2`` (m) is a plane. Overlapping surfaces have the pull of touching ones.
    """
    (first, second), times = (
        ((radius_1, radius_1), 2.0) if radius_2 == inf else ((radius_1, radius_2), 1.0)
    )
    larger = max(first, second)
    relative_volume = volume / (larger * larger * larger)
    scaled = float(logarithm(relative_volume))
    a = -1.1 * float(power(relative_volume, -0.53))
    b = (-0.148 * scaled - 0.96) * contact_angle**2 - 0.0082 * scaled + 0.48
    c = 0.0018 * scaled + 0.078
    return np.asarray(
        times
        * pi
        * sqrt(first * second)
        * (exponential(a * np.maximum(gaps, 0.0) / larger + b) + c)
    )


def law(surfaces: Surfaces) -> Curve:
    """Pull and resistances of decks for the stock engine."""
    liquid, reduced, shape = (
        surfaces.liquid,
        surfaces.reduced_radius,
        (surfaces.radius, surfaces.other_radius),
    )
    stokes = 6.0 * pi * liquid.viscosity * reduced

    def forces(gaps: FloatArray) -> Forces:
        near, none = np.maximum(surfaces.roughness, gaps) / reduced, np.zeros_like(gaps)
        pulled = liquid.surface_tension * pull(*shape, surfaces.volume, liquid.contact_angle, gaps)
        return Forces(
            pulled,
            stokes / near,
            stokes * (8.0 / 15.0 * logarithm(1.0 / near) + 0.9588),
            none,
            none,
        )

    return Curve(forces, rupture_distance(surfaces.volume, liquid.contact_angle))
