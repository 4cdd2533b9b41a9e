"""Viscous resistance of the edges of a meniscus that moves over wet surfaces.

A meniscus that moves with the velocity U over a surface with a film deforms at its front and its
rear. Together they resist with 4.70 γ Ca^(2/3) per length (Bretherton), Ca = ηU/γ, along the normal
of the edge. A round edge of the radius r_w moves along its normal with U cos φ, so that the force
is

    E U^(2/3),    E = 4.70 · 1.682 γ r_w (η/γ)^(2/3),

where 1.682 is the integral of cos^(5/3) φ over half of the edge. The wetted radius is r_w =
(4 R* V/π)^(1/4) for a bridge of the volume V between surfaces that touch, R* their reduced radius;
at most 0.8 of the radius of the smaller bead.

Each of the two surfaces of a bridge has an edge. The point of contact moves along a surface with
the velocity of a bead that rolls on it: the force acts on a bead that moves along a wall, and as a
torque on a bead that rotates. `walkers/templates/engine/forces.h` has the velocities for two beads.

The term is an estimate: it is derived for Ca → 0, a film ahead of the meniscus, and an edge in
steady motion. Its factor, the ``edge_ratio`` of a liquid, may lie between 0.5 and 2.

References
----------
F. P. Bretherton, J. Fluid Mech. 10 (1961) 166, doi 10.1017/S0022112061000160.
I. Cantat, Phys. Fluids 25 (2013) 031303, doi 10.1063/1.4793544 (review).
"""

from __future__ import annotations

from math import cbrt, pi

from walkers.physics.bridge import Surfaces

ROUND_EDGE = 4.70 * 1.682
"""Force on a round edge over γ r_w Ca^(2/3).

It is that of front and rear per length, times the integral of cos^(5/3) φ from -π/2 to π/2.
"""
_LARGEST_WETTED_RADIUS = 0.8
"""Largest wetted radius, over the radius of the smaller bead."""
SLOWEST = 1e-5
"""U₀, m/s: the resistance is E/(U² + U₀²)^(1/6), which is constant at much lower velocities."""


def wetted_radius(surfaces: Surfaces) -> float:
    """The wetted radius r_w of a bridge between surfaces that touch, m.

    It is that of `walkers.physics.reynolds` at a gap of 0, unless it is limited by the bead.
    """
    radius = (4.0 * surfaces.reduced_radius * surfaces.volume / pi) ** 0.25
    return float(min(radius, _LARGEST_WETTED_RADIUS * surfaces.radius))


def edge_resistance(surfaces: Surfaces) -> float:
    """The resistance E of the edge of a bridge on each of its surfaces, N (s/m)^(2/3).

    It is 0 for a liquid without an ``edge_ratio``.
    """
    liquid = surfaces.liquid
    if not liquid.edge_ratio:
        return 0.0
    tension = liquid.surface_tension
    capillary = cbrt(liquid.viscosity / tension) ** 2
    ideal = ROUND_EDGE * tension * wetted_radius(surfaces) * capillary
    return liquid.edge_ratio * ideal
