"""The closed form of Rabinovich et al. (2005) for small volumes.

    F = 2πRγ (cos θ / (1 + h/2d) + sin α sin(θ + α))

It was made for equal spheres of radius R; unequal spheres and planes use the Derjaguin radius, R =
2R* (`walkers.physics.capillary.derjaguin_radius`). At a volume of 0.09 R³ on a plane its pull at
contact is twice Young–Laplace's. They give no rupture distance; Lian et al. (1993) do
(`walkers.physics.capillary.rupture_distance_of_lian`). `walkers.physics.reynolds` gives the
resistances. Equations are numbered as in the source of YADE (its ViscElCapPhys).

References
----------
Y. I. Rabinovich, M. S. Esayanur, B. M. Moudgil, Langmuir 21 (2005) 10992–10997, doi
10.1021/la0517639.
P. Lambert, A. Chau, A. Delchambre, S. Régnier, Langmuir 24 (2008) 3157–3163, doi 10.1021/la7036444.
"""

from __future__ import annotations

from math import pi

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics import reynolds
from walkers.physics.bridge import Curve, Surfaces
from walkers.physics.capillary import derjaguin_radius, rupture_distance_of_lian
from walkers.physics.portable import cosine, sine


def lambert(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """The first term as corrected by Lambert et al. (2008): 2πRγ cos θ / (1 + h / 2d).

    d, half the immersed height, from the volume: 2d/h = -1 + √(1 + 2V / πRh²) (Rabinovich et al.,
    Eq. 20). Parameters and result as for `walkers.physics.laws.soulie.pull`.
    """
    radius = derjaguin_radius(radius_1, radius_2)
    # h / 2d without a division by h.
    immersed = np.sqrt(gaps**2 + 2.0 * volume / (pi * radius)) - gaps  # 2d
    return 2.0 * pi * radius * float(cosine(contact_angle)) / (1.0 + gaps / immersed)


def pull(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Rabinovich et al. (2005), Eq. 19.

    The second term, in addition to `lambert`, is 2πRγ sin α sin(θ + α) with α² = 2d/R (Eq. A3).
    """
    radius = derjaguin_radius(radius_1, radius_2)
    immersed = np.sqrt(gaps**2 + 2.0 * volume / (pi * radius)) - gaps
    alpha = np.sqrt(immersed / radius)
    first_term = lambert(radius_1, radius_2, volume, contact_angle, gaps)
    return first_term + 2.0 * pi * radius * sine(alpha) * sine(contact_angle + alpha)


def law(surfaces: Surfaces) -> Curve:
    """Force of Rabinovich et al., rupture distance of Lian et al., Reynolds resistances."""
    contact_angle = surfaces.liquid.contact_angle

    def pull_at(gaps: FloatArray) -> FloatArray:
        return pull(surfaces.radius, surfaces.other_radius, surfaces.volume, contact_angle, gaps)

    breaks_at = rupture_distance_of_lian(surfaces.volume, contact_angle)
    return reynolds.curve(surfaces, pull_at, breaks_at)
