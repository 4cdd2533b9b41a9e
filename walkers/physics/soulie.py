"""The law of the stock engine, mended at walls: Soulié's pull, and lubrication between immersed spheres at all gaps.

The pull is that of `walkers.physics.capillary`, the bridge breaks at (1 + θ/2) V^(1/3), and the resistances are those
of `walkers.physics.lubrication`, which take the solids for immersed: no torque but by the sliding force. At a wall the
pull is twice that of two equal spheres; the resistances are a plane's, of R* = R. Such a deck's doubled wall has less
of the tangential one at gaps above εR/2, by about a fifth: there this law differs from it.
"""

from __future__ import annotations

from math import inf

import numpy as np

from walkers.physics import capillary
from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces
from walkers.physics.lubrication import normal_drag, tangential_drag


def pull(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Pull over the surface tension, F/γ (Soulié et al. 2006, Eqs. 13 and 14), at a plane that of spheres, twice.

    Parameters
    ----------
    radius_1, radius_2
        m; infinity is a plane.
    volume, contact_angle
        m³ and rad.
    gaps
        m, shape (n,).

    Returns
    -------
    ndarray, shape (n,), m.
    """
    pair, times = ((radius_1, radius_1), 2.0) if radius_2 == inf else ((radius_1, radius_2), 1.0)
    return np.array([times * capillary.capillary_force(1.0, *pair, volume, contact_angle, float(gap)) for gap in gaps])


def law(surfaces: Surfaces) -> Curve:
    """Pull and resistances as decks for the stock engine have them."""
    liquid, radius = surfaces.liquid, surfaces.radius
    lubricated = (liquid.dynamic_viscosity, surfaces.reduced_radius, surfaces.minimum_separation_ratio)

    def forces(gaps: FloatArray) -> Forces:
        pair, none = (radius, surfaces.other_radius), np.zeros_like(gaps)
        return Forces(
            pull=liquid.surface_tension * pull(*pair, surfaces.volume, liquid.contact_angle, gaps),
            normal=np.array([normal_drag(*lubricated, float(gap)) for gap in gaps]),
            sliding=np.array([tangential_drag(*lubricated, float(gap)) for gap in gaps]),
            coupling=none,
            rolling=none,
        )

    return Curve(forces, capillary.rupture_distance(surfaces.volume, liquid.contact_angle))
