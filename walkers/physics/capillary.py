"""Capillary bridges independent of the law: their liquid, volumes, rupture distance, limits.

References
----------
D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75 (volumes).
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147, doi 10.1006/jcis.1993.1452 (rupture).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cbrt, inf, pi, sqrt

DEFAULT_LAW = "young-laplace"


@dataclass(frozen=True, kw_only=True)
class BridgeLiquid:
    """Numbers of the liquid of bridges, SI units; ``law`` is the name of their law (`walkers.physics.laws`).

    ``viscosity`` is that of the bridges, ``volume_fraction`` the volume of the liquid on a bead over that of the bead.
    Bridges take ``conserved`` liquid from the films of their beads.
    """

    surface_tension: float
    viscosity: float
    contact_angle: float
    volume_fraction: float
    conserved: bool = False
    law: str = DEFAULT_LAW


def derjaguin_radius(radius_1: float, radius_2: float) -> float:
    """Derjaguin radius 2 R1 R2 / (R1 + R2): radius of equal spheres with the same gap profile; plane: infinity."""
    return 2.0 / (1.0 / radius_1 + 1.0 / radius_2)


def share_of_bead(radius: float, other_radius: float, volume_fraction: float) -> float:
    """Volume that a bead gives to its bridge, m³: radii in m (infinite: a plane), volume of its liquid over its own.

    A bead gives half of its film in the cap that another bead covers (Shi and McCarthy 2008), half of its film at a
    plane. A plane gives nothing.
    """
    if radius == inf:
        return 0.0
    cap = 1.0 if other_radius == inf else 1.0 - sqrt(1.0 - (other_radius / (radius + other_radius)) ** 2)
    return 0.5 * film_volume(radius, volume_fraction) * cap


def film_volume(radius: float, volume_fraction: float) -> float:
    """Volume of the liquid on a bead without bridges, m³."""
    return bead_volume(radius) * volume_fraction


def bead_volume(radius: float) -> float:
    """Volume of a bead, m³."""
    return 4.0 / 3.0 * pi * radius**3


def capillary_force_limit_at_wall(surface_tension: float, radius: float) -> float:
    """Attraction of a sphere and a plane at perfect wetting, limit of small volume, 4πγR, N (McFarlane, Tabor 1950)."""
    return 4.0 * pi * surface_tension * radius


def rupture_distance(volume: float, contact_angle: float) -> float:
    """Gap at which a bridge breaks, (1 + θ/2) V^(1/3), m (Lian et al. 1993)."""
    return (1.0 + 0.5 * contact_angle) * cbrt(volume)
