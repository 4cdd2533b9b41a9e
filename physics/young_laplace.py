"""The law of a bridge by the Young–Laplace equation: its pull and its rupture without a fit, Reynolds' resistances.

The pull is that of `walkers.physics.laplace`, its closed form, for the volume and the contact angle given, between
beads and at a plane; the bridge breaks at the largest gap at which the equation has a solution. There the pull falls as
the root of what is left of the gap, with a slope without bound; in t = √(1 - h/rupture) it is smooth, and a polynomial
in t through `NODES` solutions is as good as the equation.

The resistances are those of `walkers.physics.reynolds`, of the liquid's viscosity alone. The film's viscosity
(`Liquid.film_viscosity`) is not used: it stands for the drag on a rolling bead that a law without coupling and rolling
resistance leaves out, and here that drag is in C and Q.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import Chebyshev

from walkers.physics import laplace, reynolds
from walkers.physics.bridge import Curve, FloatArray, Surfaces

NODES = 96
"""Gaps at which the equation is solved: errors below 1e-7 of the pull at contact for volumes above 1e-6 R³."""


def law(surfaces: Surfaces) -> Curve:
    """Young–Laplace's pull and rupture, and Reynolds' resistances.

    Raises
    ------
    NoBridgeError
        If no bridge was found (a contact angle so large that the liquid is not held between them).
    """
    radius = surfaces.radius
    shape = (surfaces.other_radius / radius, surfaces.volume / radius**3, surfaces.liquid.contact_angle)
    farthest, smooth = _solved(*(float(f"{one:.14g}") for one in shape))
    rupture = radius * farthest

    def pull(gaps: FloatArray) -> FloatArray:
        return radius * np.asarray(smooth(np.sqrt(np.clip(1.0 - gaps / rupture, 0.0, 1.0))))

    return reynolds.curve(surfaces, pull, rupture)


@lru_cache(maxsize=1024)
def _solved(other_radius: float, volume: float, contact_angle: float) -> tuple[float, Chebyshev]:
    """Rupture distance, and F/γ as a polynomial in √(1 - h/rupture), in units of the bead's radius.

    Bridges of one shape are solved once: beads of all sizes have the same at a wall.
    """
    bridge = (1.0, other_radius, volume, contact_angle)
    rupture = laplace.rupture_distance(*bridge)
    return rupture, Chebyshev.interpolate(
        lambda part: laplace.force_curve(*bridge, rupture * (1.0 - part**2)).forces, NODES - 1, domain=[0.0, 1.0]
    )
