"""The fit of Willett et al. (2000) to their solutions of the Young–Laplace equation.

    F = 2πRγ exp(f1 - f2 exp(…))

It was made for equal spheres of radius R, volumes of 0.1 to 10 per cent of R³ and contact angles up
to 50°; unequal spheres and planes use the Derjaguin radius, R = 2R*
(`walkers.physics.capillary.derjaguin_radius`). `walkers.physics.reynolds` gives the resistances.
Coefficients are as in the source of YADE (its ViscElCapPhys).

References
----------
C. D. Willett, M. J. Adams, S. A. Johnson, J. P. K. Seville, Langmuir 16 (2000) 9396–9405, doi
10.1021/la000657y.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, sqrt

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics import reynolds
from walkers.physics.bridge import Curve, Surfaces
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.portable import cube_root, exponential, logarithm

_F1 = (
    (-0.44507, 0.050832, -1.1466),
    (-0.1119, -0.000411, -0.1490),
    (-0.012101, -0.0036456, -0.01255),
    (-0.0005, -0.0003505, -0.00029076),
)
"""Coefficients of f1 in the appendix: a row for each power of ln(V/R³), a column for each power of
θ."""
_F2 = (
    (1.9222, -0.57473, -1.2918),
    (-0.0668, -0.1201, -0.22574),
    (-0.0013375, -0.0068988, -0.01137),
)
"""Coefficients of f2 in the appendix: a row for each power of ln(V/R³), a column for each power of
θ."""
_F3 = (
    (1.268, -0.01396, -0.23566),
    (0.198, 0.092, -0.06418),
    (0.02232, 0.02238, -0.009853),
    (0.0008585, 0.001318, -0.00053),
)
"""Coefficients of f3 in the appendix: a row for each power of ln(V/R³), a column for each power of
θ."""
_F4 = (
    (-0.010703, 0.073776, -0.34742),
    (0.03345, 0.04543, -0.09056),
    (0.0018574, 0.004456, -0.006257),
)
"""Coefficients of f4 in the appendix: a row for each power of ln(V/R³), a column for each power of
θ."""


def _by_volume_and_angle(
    coefficients: Sequence[tuple[float, float, float]], log_volume: float, contact_angle: float
) -> float:
    """A polynomial in ln(V/R³) whose coefficients are polynomials in the contact angle, rad."""
    value = 0.0
    for constant, linear, quadratic in reversed(coefficients):
        at_angle = constant + linear * contact_angle + quadratic * (contact_angle * contact_angle)
        value = value * log_volume + at_angle
    return value


def pull(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Willett et al. (2000), appendix: ln(F / 2πRγ) = f1 - f2 exp(f3 ln s + f4 ln² s).

    s is half the gap over √(V/R).

    Parameters and result as for `walkers.physics.laws.soulie.pull`.
    """
    radius = derjaguin_radius(radius_1, radius_2)
    v = float(logarithm(volume / (radius * radius * radius)))
    f1 = _by_volume_and_angle(_F1, v, contact_angle)
    f2 = _by_volume_and_angle(_F2, v, contact_angle)
    f3 = _by_volume_and_angle(_F3, v, contact_angle)
    f4 = _by_volume_and_angle(_F4, v, contact_angle)
    # At contact ln s is -∞; a very small gap gives the same force.
    s = logarithm(np.maximum(gaps, 1e-9 * radius) / 2.0 / sqrt(volume / radius))
    decay = np.where(gaps > 0.0, exponential(f3 * s + f4 * s**2), 0.0)
    return 2.0 * pi * radius * exponential(f1 - f2 * decay)


def rupture(radius_1: float, radius_2: float, volume: float, contact_angle: float) -> float:
    """Rupture distance (1 + θ/2) (V^(1/3) + 0.1 V^(2/3) / R), m.

    Willett et al. (2000), Eq. 15, for equal spheres.
    """
    radius = derjaguin_radius(radius_1, radius_2)
    return (1.0 + 0.5 * contact_angle) * (cube_root(volume) + 0.1 * cube_root(volume) ** 2 / radius)


def law(surfaces: Surfaces) -> Curve:
    """Pull (appendix) and rupture distance (Eq. 15) of Willett et al., and Reynolds resistances."""
    contact_angle = surfaces.liquid.contact_angle

    def pull_at(gaps: FloatArray) -> FloatArray:
        return pull(surfaces.radius, surfaces.other_radius, surfaces.volume, contact_angle, gaps)

    breaks_at = rupture(surfaces.radius, surfaces.other_radius, surfaces.volume, contact_angle)
    return reynolds.curve(surfaces, pull_at, breaks_at)
