"""The law of standard LIGGGHTS, corrected at walls.

It has Soulié's force, and the lubrication of immersed spheres at all gaps.

    F = πγ √(R1 R2) (exp(A h/R2 + B) + C),        R2 the larger radius, h the gap
    N = 6πηR*/x,        S = 6πηR* (8/15 ln(1/x) + 0.9588),        x = max(ε, h/R*)

At a wall, the capillary force is twice that of two equal spheres, and the resistances are those of
a plane (R* = R). ε is the roughness over R*. Only the sliding force causes a torque. At gaps above
εR/2 from a wall, decks of standard LIGGGHTS have about a fifth less tangential resistance than this
law. The bridge breaks at (1 + θ/2) V^(1/3).

References
----------
F. Soulié, F. Cherblanc, M. S. El Youssoufi, C. Saix, Int. J. Numer. Anal. Meth. Geomech. 30 (2006)
213, Eqs. 13, 14.
Nase et al. as in D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75, Eqs. 40, 41.
"""

from __future__ import annotations

from math import inf, pi, sqrt

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics.bridge import Curve, Forces, Surfaces
from walkers.physics.capillary import rupture_distance_of_lian
from walkers.physics.portable import exponential, logarithm, power


def pull(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Capillary force over the surface tension, F/γ.

    Parameters
    ----------
    radius_1, radius_2
        Radii of the surfaces, m; an infinite ``radius_2`` is a plane.
    volume
        Volume of the bridge, m³.
    contact_angle
        In rad.
    gaps
        In m, shape (n,). Overlapping surfaces have the force of touching ones.

    Returns
    -------
    numpy.ndarray
        F/γ in m, shape (n,).
    """
    factor = 1.0
    if radius_2 == inf:  # twice the force of two equal spheres
        factor = 2.0
        radius_2 = radius_1
    larger = max(radius_1, radius_2)
    relative_volume = volume / (larger * larger * larger)
    scaled = float(logarithm(relative_volume))
    a = -1.1 * float(power(relative_volume, -0.53))
    b = (-0.148 * scaled - 0.96) * contact_angle**2 - 0.0082 * scaled + 0.48
    c = 0.0018 * scaled + 0.078
    scale = factor * pi * sqrt(radius_1 * radius_2)
    return np.asarray(scale * (exponential(a * np.maximum(gaps, 0.0) / larger + b) + c))


def law(surfaces: Surfaces) -> Curve:
    """Pull and resistances of decks for the stock engine."""
    liquid = surfaces.liquid
    reduced_radius = surfaces.reduced_radius
    stokes = 6.0 * pi * liquid.viscosity * reduced_radius

    def forces(gaps: FloatArray) -> Forces:
        x = np.maximum(surfaces.roughness, gaps) / reduced_radius
        over_tension = pull(
            surfaces.radius, surfaces.other_radius, surfaces.volume, liquid.contact_angle, gaps
        )
        return Forces(
            pull=liquid.surface_tension * over_tension,
            normal=stokes / x,
            sliding=stokes * (8.0 / 15.0 * logarithm(1.0 / x) + 0.9588),
            coupling=np.zeros_like(gaps),
            rolling=np.zeros_like(gaps),
        )

    return Curve(forces, rupture_distance_of_lian(surfaces.volume, liquid.contact_angle))
