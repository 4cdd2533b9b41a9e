"""Capillary bridges independent of the law: their liquid, volumes, rupture distance, limits.

References
----------
D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75 (volumes).
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147, doi 10.1006/jcis.1993.1452 (rupture).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import inf, pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.cache import kept_numbers, place_of_numbers
from walkers.physics.portable import cosine, cube_root

if TYPE_CHECKING:
    from walkers.arrays import FloatArray

DEFAULT_LAW = "young-laplace"
_AIR_PRESSURE = 101_325.0
"""Standard atmosphere, Pa."""


@dataclass(frozen=True, kw_only=True)
class BridgeLiquid:
    """Numbers of the liquid of bridges, SI units; ``law`` is the name of their law (`walkers.physics.laws`).

    ``viscosity`` belongs to the bridges; ``volume_fraction`` is the liquid on a bead over the volume of the bead.
    If ``meniscus_radius`` (m) is not zero, it gives the volumes of bridges instead (`bridge_volume`).
    Bridges take ``conserved`` liquid from the films of their beads.
    """

    surface_tension: float
    viscosity: float
    contact_angle: float
    volume_fraction: float
    meniscus_radius: float = 0.0
    conserved: bool = False
    law: str = DEFAULT_LAW


def derjaguin_radius(radius_1: float, radius_2: float) -> float:
    """Derjaguin radius 2 R1 R2 / (R1 + R2): radius of equal spheres with the same gap profile; plane: infinity."""
    return 2.0 / (1.0 / radius_1 + 1.0 / radius_2)


@lru_cache(maxsize=4096)
def bridge_volume(radius: float, other_radius: float, liquid: BridgeLiquid) -> float:
    """Volume of a bridge of a bead to a bead or a plane (infinite radius), m³; raises `ValueError` if there is none.

    Both surfaces contribute to it (`share_of_bead`). Beads on a wetted plate exchange liquid through its film instead,
    until all menisci have the suction γ/r of one ``meniscus_radius`` r: the touching bridge with this suction has
    the volume, by the Young–Laplace equation.
    """
    if liquid.meniscus_radius:
        shape = (*sorted((radius, other_radius)), liquid.contact_angle, liquid.meniscus_radius)
        place = place_of_numbers("menisci", solver() + repr(shape).encode())
        return float(kept_numbers(place, lambda: _volume_by_suction(*shape))[0])
    fraction = liquid.volume_fraction
    return share_of_bead(radius, other_radius, fraction) + share_of_bead(
        other_radius, radius, fraction
    )


def _volume_by_suction(*shape: float) -> FloatArray:
    import numpy as np

    from walkers.physics.laplace import volume_at_contact  # which imports scipy

    return np.array([volume_at_contact(*shape)])


@cache
def solver() -> bytes:
    """Identifier of the solver of the Young–Laplace equation, for kept solutions."""
    folder = Path(__file__).parent
    return b"".join((folder / name).read_bytes() for name in ("laplace.py", "portable.py"))


def cavitation_gap(liquid: BridgeLiquid) -> float:
    """Gap 2γ cos θ/p in which a meniscus has the suction p of the air's pressure, m (`walkers.physics.reynolds`)."""
    return 2.0 * liquid.surface_tension * float(cosine(liquid.contact_angle)) / _AIR_PRESSURE


def largest_normal(reduced_radius: float, roughness: float, liquid: BridgeLiquid) -> float:
    """Upper bound of a bridge's N, for much liquid between touching surfaces, N s/m; radius and roughness in m."""
    return 6.0 * pi * liquid.viscosity * reduced_radius**2 / (roughness + cavitation_gap(liquid))


def share_of_bead(radius: float, other_radius: float, volume_fraction: float) -> float:
    """Volume that a bead gives to its bridge, m³: radii in m (infinite: a plane), volume of its liquid over its own.

    A bead gives half of its film in the cap that another bead covers (Shi and McCarthy 2008), half of its film at a
    plane. A plane gives nothing.
    """
    if radius == inf:
        return 0.0
    cap = (
        1.0
        if other_radius == inf
        else 1.0 - sqrt(1.0 - (other_radius / (radius + other_radius)) ** 2)
    )
    return 0.5 * film_volume(radius, volume_fraction) * cap


def film_volume(radius: float, volume_fraction: float) -> float:
    """Volume of the liquid on a bead without bridges, m³."""
    return bead_volume(radius) * volume_fraction


def bead_volume(radius: float) -> float:
    """Volume of a bead, m³."""
    return 4.0 / 3.0 * pi * (radius * radius * radius)


def capillary_force_limit_at_wall(surface_tension: float, radius: float) -> float:
    """Attraction of a sphere and a plane at perfect wetting, limit of small volume, 4πγR, N (McFarlane, Tabor 1950)."""
    return 4.0 * pi * surface_tension * radius


def rupture_distance(volume: float, contact_angle: float) -> float:
    """Gap at which a bridge breaks, (1 + θ/2) V^(1/3), m (Lian et al. 1993)."""
    return (1.0 + 0.5 * contact_angle) * cube_root(volume)
