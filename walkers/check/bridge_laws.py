"""Published laws of capillary bridges: fits and closed forms for what `walkers.physics.laplace` solves.

Each gives the pull over the surface tension, F/γ, of a bridge of constant volume at gaps. Laws made for equal spheres
of radius R take unequal ones and planes in Derjaguin's way, R = 2 R1 R2 / (R1 + R2), twice the sphere's radius at a
plane; the stock engine's takes √(R1 R2), and a wall for an equal sphere, twice.

Coefficients and numbers of equations are those in the source of YADE (its ViscElCapPhys) and, for Bagheri, Roy and
Pöschel's by these authors themselves, of MercuryDPM.

References
----------
Soulié et al. (2006), Willett et al. (2000), Rabinovich et al. (2005), Lambert et al. (2008): in
`walkers.physics.capillary`, `walkers.physics.willett` and `walkers.physics.rabinovich`.
T. Weigert, S. Ripperger, Part. Part. Syst. Charact. 16 (1999) 238–242,
doi 10.1002/(SICI)1521-4117(199910)16:5<238::AID-PPSC238>3.0.CO;2-E.
M. Bagheri, S. Roy, T. Pöschel, Comput. Part. Mech. 11 (2024) 2179–2190, doi 10.1007/s40571-024-00772-5.
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147, doi 10.1006/jcis.1993.1452.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, log, pi, sin, sqrt

import numpy as np

from walkers.physics import capillary, rabinovich, soulie, willett
from walkers.physics.bridge import FloatArray
from walkers.physics.capillary import derjaguin_radius


def willett_simple(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Willett et al. (2000), Eq. 12, for small volumes: F = 2πRγ cos θ / (1 + 2.1 s + 10 s²)."""
    radius = derjaguin_radius(radius_1, radius_2)
    s = gaps / 2.0 / sqrt(volume / radius)
    return 2.0 * pi * radius * cos(contact_angle) / (1.0 + 2.1 * s + 10.0 * s**2)


def weigert(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Weigert and Ripperger (1999), Eqs. 5, 6, 15–17, 21, 22: a toroid, its filling angle by a fit."""
    radius = derjaguin_radius(radius_1, radius_2)
    spread = (1.0 + 3.0 * gaps / radius) * (1.0 + 1.1 * sin(contact_angle))
    angle = np.arcsin(np.minimum(1.0, (volume / (0.96 * radius**3 * spread)) ** 0.25))
    meridian = (2.0 * radius * (1.0 - np.cos(angle)) + gaps) / (2.0 * np.cos(angle + contact_angle))
    neck = radius * np.sin(angle) + meridian * (np.sin(angle + contact_angle) - 1.0)
    line = radius * np.sin(angle)
    pressure = 1.0 / meridian - 1.0 / neck
    return pi * line**2 * pressure + 2.0 * pi * line * np.sin(angle + contact_angle)


def bagheri(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Bagheri, Roy and Pöschel (2024), Eqs. 24–30, with the gap over `walkers.physics.willett.rupture`."""
    radius = derjaguin_radius(radius_1, radius_2)
    v, t = volume / radius**3, contact_angle
    a, b = 0.4158 * v**0.2835 + 0.6474, -0.2087 * v**0.3113 + 2.267
    touching = 2.0 * pi * (1.0 - 0.3823 * v**0.2586) * (1.0 - a * sin(t) ** b)
    a_s = -0.3319 * v**0.4974 + 0.6717 * v**0.1995
    b_s = 13.84 * v**-0.3909 - 12.11 * v**-0.3945
    cubic = -0.007815 * log(v) ** 2 - 0.2105 * log(v) - 1.426
    linear = -1.78 * v**0.8351 + 0.6669 * v**-0.01391
    b_s *= cubic * t**3 + linear * t + 1.0
    s = gaps / willett.rupture(radius_1, radius_2, volume, contact_angle)
    return np.asarray(radius * touching * (1.0 + a_s * s) / (1.0 + b_s * a_s * s + b_s * s**2))


def rupture_of_lian(radius_1: float, radius_2: float, volume: float, contact_angle: float) -> float:  # noqa: ARG001
    """Lian, Thornton and Adams (1993): (1 + θ/2) V^(1/3), whatever the radii."""
    return capillary.rupture_distance(volume, contact_angle)


@dataclass(frozen=True)
class Law:
    """A published law: its ``pull`` (radii, volume, contact angle, gaps → F/γ) and its ``rupture`` distance.

    Those that give no rupture distance have Lian et al.'s.
    """

    name: str
    pull: Callable[[float, float, float, float, FloatArray], FloatArray]
    rupture: Callable[[float, float, float, float], float]


LAWS = (
    Law("Soulié 2006 (stock engine)", soulie.pull, rupture_of_lian),
    Law("Willett 2000", willett.pull, willett.rupture),
    Law("Willett 2000, Eq. 12", willett_simple, willett.rupture),
    Law("Rabinovich 2005", rabinovich.pull, rupture_of_lian),
    Law("Lambert 2008", rabinovich.lambert, rupture_of_lian),
    Law("Weigert 1999", weigert, rupture_of_lian),
    Law("Bagheri 2024", bagheri, willett.rupture),
)
"""The stock engine's first."""
