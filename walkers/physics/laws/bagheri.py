"""The fit of Bagheri et al. (2024) to solutions of the Young–Laplace equation, a rational function of the gap.

It was made for equal spheres of radius R; unequal spheres and planes use the Derjaguin radius, R = 2R*
(`walkers.physics.capillary.derjaguin_radius`). The gap is scaled by the rupture distance of Willett et al.
(`walkers.physics.laws.willett.rupture`); the resistances are those of `walkers.physics.reynolds`. Coefficients are
those in the source of MercuryDPM, by these authors.

References
----------
M. Bagheri, S. Roy, T. Pöschel, Comput. Part. Mech. 11 (2024) 2179–2190, doi 10.1007/s40571-024-00772-5.
"""

from __future__ import annotations

from math import log, pi, sin

import numpy as np

from walkers.physics import reynolds
from walkers.physics.bridge import Curve, FloatArray, Surfaces
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.laws.willett import rupture

PUBLISHED = "Bagheri 2024"
ERROR = 0.04
"""Relative error of the pull at contact against Young–Laplace."""


def pull(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Bagheri, Roy and Pöschel (2024), Eqs. 24–30; parameters and result as for `walkers.physics.laws.soulie.pull`."""
    radius = derjaguin_radius(radius_1, radius_2)
    v, t = volume / radius**3, contact_angle
    a, b = 0.4158 * v**0.2835 + 0.6474, -0.2087 * v**0.3113 + 2.267
    touching = 2.0 * pi * (1.0 - 0.3823 * v**0.2586) * (1.0 - a * sin(t) ** b)
    a_s = -0.3319 * v**0.4974 + 0.6717 * v**0.1995
    b_s = 13.84 * v**-0.3909 - 12.11 * v**-0.3945
    cubic = -0.007815 * log(v) ** 2 - 0.2105 * log(v) - 1.426
    linear = -1.78 * v**0.8351 + 0.6669 * v**-0.01391
    b_s *= cubic * t**3 + linear * t + 1.0
    s = gaps / rupture(radius_1, radius_2, volume, contact_angle)
    return np.asarray(radius * touching * (1.0 + a_s * s) / (1.0 + b_s * a_s * s + b_s * s**2))


def law(surfaces: Surfaces) -> Curve:
    """Pull of Bagheri et al., rupture distance of Willett et al., and Reynolds resistances."""
    bridge = (surfaces.radius, surfaces.other_radius, surfaces.volume, surfaces.liquid.contact_angle)
    return reynolds.curve(surfaces, lambda gaps: pull(*bridge, gaps), rupture(*bridge))
