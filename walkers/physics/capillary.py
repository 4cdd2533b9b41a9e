"""Capillary bridges independent of the law: their liquid, volumes, rupture distance, limits.

References
----------
D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75 (volumes).
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147, doi
10.1006/jcis.1993.1452 (rupture).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import inf, pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.cache import cached_numbers, place_of_numbers
from walkers.physics.portable import cosine, cube_root

if TYPE_CHECKING:
    from walkers.arrays import FloatArray

DEFAULT_LAW = "young-laplace"
"""Name of the bridge law of a case that names none."""
_AIR_PRESSURE = 101_325.0
"""Standard atmosphere, Pa."""


@dataclass(frozen=True, kw_only=True)
class BridgeLiquid:
    """The liquid of bridges.

    Attributes
    ----------
    surface_tension
        In N/m.
    viscosity
        Dynamic viscosity of the bridges, Pa s.
    contact_angle
        In rad.
    volume_fraction
        Volume of the liquid on a bead over the volume of the bead.
    meniscus_radius
        If it is not zero, it gives the volumes of bridges instead of ``volume_fraction``
        (`bridge_volume`), m.
    conserved
        Whether bridges take their liquid from the films of their beads.
    law
        Name of the bridge law (`walkers.physics.laws`).
    edge_ratio
        Factor of the resistance of moving edges (`walkers.physics.edges`); 0: edges do not resist.
    """

    surface_tension: float
    viscosity: float
    contact_angle: float
    volume_fraction: float
    meniscus_radius: float = 0.0
    conserved: bool = False
    law: str = DEFAULT_LAW
    edge_ratio: float = 0.0


def derjaguin_radius(radius_1: float, radius_2: float) -> float:
    """Derjaguin radius 2 R1 R2 / (R1 + R2).

    It is the radius of equal spheres with the same gap profile; a plane has an infinite radius.
    """
    return 2.0 / (1.0 / radius_1 + 1.0 / radius_2)


@lru_cache(maxsize=4096)
def bridge_volume(radius: float, other_radius: float, liquid: BridgeLiquid) -> float:
    """Volume of a bridge of a bead to a bead or a plane, m³.

    Both surfaces contribute to it (`share_of_bead`). Beads on a wetted substrate exchange liquid
    through its film instead, until all menisci have the suction γ/r of one ``meniscus_radius`` r.
    The volume is then that of the bridge between touching surfaces that has this suction by the
    Young–Laplace equation.

    Parameters
    ----------
    radius, other_radius
        Radii of the surfaces in any order, m; infinite for a plane.
    liquid
        The liquid of the bridge.

    Raises
    ------
    ValueError
        If no bridge has the suction.
    """
    if liquid.meniscus_radius:
        small, large = sorted((radius, other_radius))
        return _volume_by_suction(small, large, liquid.contact_angle, liquid.meniscus_radius)
    fraction = liquid.volume_fraction
    share = share_of_bead(radius, other_radius, fraction)
    other_share = share_of_bead(other_radius, radius, fraction)
    return share + other_share


def _volume_by_suction(
    radius: float, other_radius: float, contact_angle: float, meniscus_radius: float
) -> float:
    """Volume of a bridge between touching surfaces with a given suction, m³, from the cache.

    The suction is γ/``meniscus_radius``.
    """
    bridge = (radius, other_radius, contact_angle, meniscus_radius)

    def compute() -> FloatArray:
        import numpy as np

        from walkers.physics.laplace import volume_at_contact  # which imports scipy

        return np.array([volume_at_contact(*bridge)])

    place = place_of_numbers("menisci", solver() + repr(bridge).encode())
    return float(cached_numbers(place, compute)[0])


@cache
def solver() -> bytes:
    """Identifier of the solver of the Young–Laplace equation, for kept solutions."""
    folder = Path(__file__).parent
    return b"".join((folder / name).read_bytes() for name in ("laplace.py", "portable.py"))


def cavitation_gap(liquid: BridgeLiquid) -> float:
    """Gap 2γ cos θ/p in which the suction of a meniscus is the pressure p of the air, m.

    `walkers.physics.reynolds` uses it.
    """
    return 2.0 * liquid.surface_tension * float(cosine(liquid.contact_angle)) / _AIR_PRESSURE


def largest_normal(reduced_radius: float, roughness: float, liquid: BridgeLiquid) -> float:
    """Upper bound of the normal resistance N of a bridge, N s/m.

    It holds for much liquid between touching surfaces.

    Parameters
    ----------
    reduced_radius
        R1 R2/(R1 + R2) of the surfaces, m.
    roughness
        Gap between surfaces that touch at their asperities, m.
    liquid
        The liquid of the bridge.
    """
    return 6.0 * pi * liquid.viscosity * reduced_radius**2 / (roughness + cavitation_gap(liquid))


def share_of_bead(radius: float, other_radius: float, volume_fraction: float) -> float:
    """Volume that a bead gives to its bridge, m³.

    A bead gives half of its film in the cap that another bead covers (Shi and McCarthy 2008), and
    half of its film at a plane. A plane gives nothing.

    Parameters
    ----------
    radius, other_radius
        Radii of the bead and of the surface at the other end of the bridge, m; infinite for a
        plane.
    volume_fraction
        Volume of the liquid on the bead over the volume of the bead.
    """
    if radius == inf:
        return 0.0
    covered = 1.0
    if other_radius != inf:
        covered = 1.0 - sqrt(1.0 - (other_radius / (radius + other_radius)) ** 2)
    return 0.5 * film_volume(radius, volume_fraction) * covered


def film_volume(radius: float, volume_fraction: float) -> float:
    """Volume of the liquid on a bead without bridges, m³."""
    return bead_volume(radius) * volume_fraction


def bead_volume(radius: float) -> float:
    """Volume of a bead, m³."""
    return 4.0 / 3.0 * pi * (radius * radius * radius)


def capillary_force_limit_at_wall(surface_tension: float, radius: float) -> float:
    """Capillary force 4πγR (N) between a sphere and a plane for perfect wetting and small volumes.

    Source: McFarlane and Tabor (1950).
    """
    return 4.0 * pi * surface_tension * radius


def rupture_distance_of_lian(volume: float, contact_angle: float) -> float:
    """Gap at which a bridge breaks, (1 + θ/2) V^(1/3), m (Lian et al. 1993)."""
    return (1.0 + 0.5 * contact_angle) * cube_root(volume)
