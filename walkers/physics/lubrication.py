"""Viscous forces of a bridge: normal 6πηR*/max(ε, h/R*) and tangential 6πηR* (8/15 ln(1/max(ε, h/R*)) + 0.9588).

η is the viscosity, R* = R1 R2/(R1 + R2), at a plane the radius, h the gap and
ε the gap over R* below which the forces stop growing (surface
roughness). Both are coefficients of a velocity, N s/m. After Nase et al. as in D. Shi, J. J. McCarthy, Powder
Technology 184 (2008) 65–75, Eqs. 40, 41.
"""

from __future__ import annotations

from math import log, pi


def normal_drag(
    dynamic_viscosity: float, reduced_radius: float, minimum_separation_ratio: float, gap: float = 0.0
) -> float:
    """Coefficient of the normal viscous force between two beads, N s/m.

    Parameters
    ----------
    dynamic_viscosity
        η, Pa s.
    reduced_radius
        R*, m.
    minimum_separation_ratio
        ε.
    gap
        h, m; touching surfaces have the largest drag.
    """
    nearness = max(minimum_separation_ratio, gap / reduced_radius)
    return 6.0 * pi * dynamic_viscosity * reduced_radius / nearness


def tangential_drag(
    dynamic_viscosity: float, reduced_radius: float, minimum_separation_ratio: float, gap: float = 0.0
) -> float:
    """Coefficient of the tangential viscous force between two beads, N s/m; parameters as for `normal_drag`."""
    nearness = max(minimum_separation_ratio, gap / reduced_radius)
    stokes = 6.0 * pi * dynamic_viscosity * reduced_radius
    return stokes * (8.0 / 15.0 * log(1.0 / nearness) + 0.9588)
