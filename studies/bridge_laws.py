"""Published laws of capillary bridges, the engine's among them.

Each law gives the pull over the surface tension, F/γ, of a bridge of constant volume at gaps. Laws made for equal
spheres of radius R take unequal ones and planes in Derjaguin's way, R = 2 R1 R2 / (R1 + R2), twice the sphere's radius
at a plane; the engine's own takes √(R1 R2), and a wall for an equal sphere, twice (`walkers.physics.wall`). What
they approximate is in `walkers.studies.laplace`.

Coefficients and numbers of equations are those in the source of YADE (its ViscElCapPhys) and, for Bagheri, Roy and
Pöschel's by these authors themselves, of MercuryDPM.

References
----------
F. Soulié, F. Cherblanc, M. S. El Youssoufi, C. Saix, Int. J. Numer. Anal. Meth. Geomech. 30 (2006) 213–228,
doi 10.1002/nag.476.
C. D. Willett, M. J. Adams, S. A. Johnson, J. P. K. Seville, Langmuir 16 (2000) 9396–9405, doi 10.1021/la000657y.
Y. I. Rabinovich, M. S. Esayanur, B. M. Moudgil, Langmuir 21 (2005) 10992–10997, doi 10.1021/la0517639.
P. Lambert, A. Chau, A. Delchambre, S. Régnier, Langmuir 24 (2008) 3157–3163, doi 10.1021/la7036444.
T. Weigert, S. Ripperger, Part. Part. Syst. Charact. 16 (1999) 238–242,
doi 10.1002/(SICI)1521-4117(199910)16:5<238::AID-PPSC238>3.0.CO;2-E.
M. Bagheri, S. Roy, T. Pöschel, Comput. Part. Mech. 11 (2024) 2179–2190, doi 10.1007/s40571-024-00772-5.
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147, doi 10.1006/jcis.1993.1452.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cbrt, cos, inf, log, pi, sin, sqrt

import numpy as np

from walkers.physics import capillary
from walkers.studies.laplace import FloatArray


def derjaguin_radius(radius_1: float, radius_2: float) -> float:
    """Radius of the equal spheres whose surfaces part as these do, 2 R1 R2 / (R1 + R2); infinity is a plane."""
    return 2.0 / (1.0 / radius_1 + 1.0 / radius_2)


def soulie(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """The engine's law (Soulié et al. 2006, Eqs. 13 and 14), at a plane that of two equal spheres, twice."""
    if radius_2 == inf:
        return np.array(
            [capillary.capillary_force_at_wall(1.0, radius_1, volume, contact_angle, float(gap)) for gap in gaps]
        )
    pair = (radius_1, radius_2)
    return np.array([capillary.capillary_force(1.0, *pair, volume, contact_angle, float(gap)) for gap in gaps])


def willett(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Willett et al. (2000), appendix: ln(F / 2πRγ) = f1 - f2 exp(f3 ln s + f4 ln² s), s half the gap over √(V/R)."""
    radius = derjaguin_radius(radius_1, radius_2)
    v, t = log(volume / radius**3), np.array([1.0, contact_angle, contact_angle**2])
    f1 = (
        t @ [-0.44507, 0.050832, -1.1466]
        + t @ [-0.1119, -0.000411, -0.1490] * v
        + t @ [-0.012101, -0.0036456, -0.01255] * v**2
        + t @ [-0.0005, -0.0003505, -0.00029076] * v**3
    )
    f2 = (
        t @ [1.9222, -0.57473, -1.2918]
        + t @ [-0.0668, -0.1201, -0.22574] * v
        + t @ [-0.0013375, -0.0068988, -0.01137] * v**2
    )
    f3 = (
        t @ [1.268, -0.01396, -0.23566]
        + t @ [0.198, 0.092, -0.06418] * v
        + t @ [0.02232, 0.02238, -0.009853] * v**2
        + t @ [0.0008585, 0.001318, -0.00053] * v**3
    )
    f4 = (
        t @ [-0.010703, 0.073776, -0.34742]
        + t @ [0.03345, 0.04543, -0.09056] * v
        + t @ [0.0018574, 0.004456, -0.006257] * v**2
    )
    # At contact ln s is -∞: a gap so small that the force is the one there.
    s = np.log(np.maximum(gaps, 1e-9 * radius) / 2.0 / sqrt(volume / radius))
    apart = np.where(gaps > 0.0, np.exp(f3 * s + f4 * s**2), 0.0)
    return 2.0 * pi * radius * np.exp(f1 - f2 * apart)


def willett_simple(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Willett et al. (2000), Eq. 12, for small volumes: F = 2πRγ cos θ / (1 + 2.1 s + 10 s²)."""
    radius = derjaguin_radius(radius_1, radius_2)
    s = gaps / 2.0 / sqrt(volume / radius)
    return 2.0 * pi * radius * cos(contact_angle) / (1.0 + 2.1 * s + 10.0 * s**2)


def lambert(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Rabinovich et al.'s without its second term, as Lambert et al. (2008) correct it: 2πRγ cos θ / (1 + h / 2d).

    d, half the immersed height, from the volume: 2d/h = -1 + √(1 + 2V / πRh²) (Rabinovich et al., Eq. 20).
    """
    radius = derjaguin_radius(radius_1, radius_2)
    # h / 2d without a division by h.
    immersed = np.sqrt(gaps**2 + 2.0 * volume / (pi * radius)) - gaps
    return 2.0 * pi * radius * cos(contact_angle) / (1.0 + gaps / immersed)


def rabinovich(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Rabinovich et al. (2005), Eq. 19: `lambert`, and 2πRγ sin α sin(θ + α) with α² = 2d/R (their Eq. A3)."""
    radius = derjaguin_radius(radius_1, radius_2)
    immersed = np.sqrt(gaps**2 + 2.0 * volume / (pi * radius)) - gaps
    embracing = np.sqrt(immersed / radius)
    pressed = lambert(radius_1, radius_2, volume, contact_angle, gaps)
    return pressed + 2.0 * pi * radius * np.sin(embracing) * np.sin(contact_angle + embracing)


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
    """Bagheri, Roy and Pöschel (2024), Eqs. 24–30, with the gap over `rupture_of_willett`."""
    radius = derjaguin_radius(radius_1, radius_2)
    v, t = volume / radius**3, contact_angle
    a, b = 0.4158 * v**0.2835 + 0.6474, -0.2087 * v**0.3113 + 2.267
    touching = 2.0 * pi * (1.0 - 0.3823 * v**0.2586) * (1.0 - a * sin(t) ** b)
    a_s = -0.3319 * v**0.4974 + 0.6717 * v**0.1995
    b_s = 13.84 * v**-0.3909 - 12.11 * v**-0.3945
    cubic = -0.007815 * log(v) ** 2 - 0.2105 * log(v) - 1.426
    linear = -1.78 * v**0.8351 + 0.6669 * v**-0.01391
    b_s *= cubic * t**3 + linear * t + 1.0
    s = gaps / rupture_of_willett(radius_1, radius_2, volume, contact_angle)
    return np.asarray(radius * touching * (1.0 + a_s * s) / (1.0 + b_s * a_s * s + b_s * s**2))


def rupture_of_lian(radius_1: float, radius_2: float, volume: float, contact_angle: float) -> float:  # noqa: ARG001
    """Lian, Thornton and Adams (1993), the engine's: (1 + θ/2) V^(1/3), whatever the radii."""
    return capillary.rupture_distance(volume, contact_angle)


def rupture_of_willett(radius_1: float, radius_2: float, volume: float, contact_angle: float) -> float:
    """Willett et al. (2000), Eq. 15, for equal spheres: (1 + θ/2) (V^(1/3) + 0.1 V^(2/3) / R)."""
    radius = derjaguin_radius(radius_1, radius_2)
    return (1.0 + 0.5 * contact_angle) * (cbrt(volume) + 0.1 * cbrt(volume) ** 2 / radius)


@dataclass(frozen=True)
class Law:
    """A published law: its ``force`` (radii, volume, contact angle, gaps → F/γ) and its ``rupture`` distance.

    Those that give no rupture distance are taken as far as the engine's law.
    """

    name: str
    force: Callable[[float, float, float, float, FloatArray], FloatArray]
    rupture: Callable[[float, float, float, float], float]


LAWS = (
    Law("Soulié 2006 (engine)", soulie, rupture_of_lian),
    Law("Willett 2000", willett, rupture_of_willett),
    Law("Willett 2000, Eq. 12", willett_simple, rupture_of_willett),
    Law("Rabinovich 2005", rabinovich, rupture_of_lian),
    Law("Lambert 2008", lambert, rupture_of_lian),
    Law("Weigert 1999", weigert, rupture_of_lian),
    Law("Bagheri 2024", bagheri, rupture_of_willett),
)
ENGINE = LAWS[0]
