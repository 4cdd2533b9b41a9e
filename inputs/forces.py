"""Forces at the contacts of a wet bead: capillary, viscous and elastic.

A flat wall is treated as the limit that the walker's theory uses, with the forces that the engine can give: capillary
bridges as between two equal spheres, taken twice (a sphere on a plane is pulled by 4πγR, two equal spheres by 2πγR),
and lubrication drag with the sphere–plane reduced radius R.

References
----------
F. Soulié, F. Cherblanc, M. S. El Youssoufi, C. Saix, Int. J. Numer. Anal. Meth. Geomech. 30 (2006) 213–228.
D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65–75 (bridge volumes; viscous forces after Nase et al.).
G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138–147 (rupture).
"""

from __future__ import annotations

from math import cbrt, exp, log, pi, sqrt


def bridge_volume_between_beads(radius_1: float, radius_2: float, volume_fraction: float) -> float:
    """Liquid in the bridge between two beads, m³ (Shi and McCarthy 2008).

    Each bead gives half of its liquid film that lies in the cap that the other one covers.

    Parameters
    ----------
    radius_1, radius_2
        Radii, m.
    volume_fraction
        Liquid on a bead over the bead's volume.
    """

    def share(own: float, other: float) -> float:
        film = 4.0 / 3.0 * pi * own**3 * volume_fraction
        return 0.5 * film * (1.0 - sqrt(1.0 - (other / (own + other)) ** 2))

    return share(radius_1, radius_2) + share(radius_2, radius_1)


def bridge_volume_at_wall(radius: float, volume_fraction: float) -> float:
    """Liquid in the bridge between a bead and a wall, m³: half of the bead's liquid."""
    return 0.5 * 4.0 / 3.0 * pi * radius**3 * volume_fraction


def capillary_force(
    surface_tension: float, radius_1: float, radius_2: float, volume: float, contact_angle: float, gap: float = 0.0
) -> float:
    """Attraction by the bridge between two beads, N (Soulié et al. 2006, Eqs. 13 and 14).

    Parameters
    ----------
    surface_tension
        N/m.
    radius_1, radius_2
        Radii, m.
    volume
        Volume of the bridge, m³.
    contact_angle
        Effective contact angle, rad.
    gap
        Distance of the surfaces, m; overlapping surfaces (gap < 0) pull as touching ones.
    """
    larger = max(radius_1, radius_2)
    scaled = volume / larger**3
    a = -1.1 * scaled**-0.53
    b = (-0.148 * log(scaled) - 0.96) * contact_angle**2 - 0.0082 * log(scaled) + 0.48
    c = 0.0018 * log(scaled) + 0.078
    return pi * surface_tension * sqrt(radius_1 * radius_2) * (exp(a * max(gap, 0.0) / larger + b) + c)


def capillary_force_at_wall(
    surface_tension: float, radius: float, volume: float, contact_angle: float, gap: float = 0.0
) -> float:
    """Attraction by the bridge between a bead and a wall, N: twice that of two equal beads (see the module)."""
    return 2.0 * capillary_force(surface_tension, radius, radius, volume, contact_angle, gap)


def capillary_force_limit_at_wall(surface_tension: float, radius: float) -> float:
    """Attraction of a sphere to a plane by a vanishing bridge that wets perfectly, 4πγR, N (McFarlane, Tabor 1950)."""
    return 4.0 * pi * surface_tension * radius


def rupture_distance(volume: float, contact_angle: float) -> float:
    """Gap at which a bridge breaks, (1 + θ/2) V^(1/3), m (Lian et al. 1993)."""
    return (1.0 + 0.5 * contact_angle) * cbrt(volume)


def largest_normal_drag(dynamic_viscosity: float, reduced_radius: float, minimum_separation_ratio: float) -> float:
    """Coefficient of the normal viscous force of a touching bridge, 6πηR*/ε, N s/m.

    Parameters
    ----------
    dynamic_viscosity
        Pa s.
    reduced_radius
        R1 R2/(R1 + R2) between beads, R at a wall, m.
    minimum_separation_ratio
        ε, the gap over R* below which the lubrication force stops growing (surface roughness).
    """
    return 6.0 * pi * dynamic_viscosity * reduced_radius / minimum_separation_ratio


def largest_tangential_drag(dynamic_viscosity: float, reduced_radius: float, minimum_separation_ratio: float) -> float:
    """Coefficient of the tangential viscous force of a touching bridge, 6πηR* (8/15 ln(1/ε) + 0.9588), N s/m.

    Parameters
    ----------
    dynamic_viscosity, reduced_radius, minimum_separation_ratio
        As for `largest_normal_drag`.
    """
    stokes = 6.0 * pi * dynamic_viscosity * reduced_radius
    return stokes * (8.0 / 15.0 * log(1.0 / minimum_separation_ratio) + 0.9588)


def film_drag(film_viscosity: float, radius: float) -> float:
    """Coefficient of the drag that a film on the substrate has on a bead's translation, 6πηR (Stokes), N s/m.

    Parameters
    ----------
    film_viscosity, radius
        η in Pa s, R in m.
    """
    return 6.0 * pi * film_viscosity * radius


def hertz_overlap(force: float, reduced_radius: float, reduced_modulus: float) -> float:
    """Overlap at which the Hertz force 4/3 E* √R* δ^(3/2) carries a load, m.

    Parameters
    ----------
    force
        Load, N.
    reduced_radius, reduced_modulus
        R* in m, E* in Pa.
    """
    return float((3.0 * force / (4.0 * reduced_modulus * sqrt(reduced_radius))) ** (2.0 / 3.0))


def reduced_shear_modulus(youngs_modulus: float, poissons_ratio: float) -> float:
    """G* of two bodies of the same modulus, E/(4(1 + ν)(2 − ν)), Pa (Mindlin)."""
    return youngs_modulus / (4.0 * (1.0 + poissons_ratio) * (2.0 - poissons_ratio))


def damping_ratio(restitution: float) -> float:
    """β of the damped Hertz contact that rebounds with a coefficient e, −ln e/√(ln²e + π²)."""
    return -log(restitution) / sqrt(log(restitution) ** 2 + pi**2)


def reduced_modulus(youngs_modulus: float, poissons_ratio: float) -> float:
    """E* of two bodies of the same modulus, E/(2(1 − ν²)), Pa."""
    return youngs_modulus / (2.0 * (1.0 - poissons_ratio**2))
