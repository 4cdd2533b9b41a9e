"""Resistances of a bridge from the Reynolds equation in the wetted disc, with ambient pressure at its edge.

Between surfaces 1 and 2 (spheres of radii R1 ≤ R2, or a sphere and a plane; `walkers.physics.bridge` has the signs and
the velocities w, s, q) the gap is H = h + r²/2R*. With κ = (1/R1 - 1/R2)/2, the curvature of the disc's mid-surface,
the pressure obeys

    ∇ · (H³ ∇p) = 12η (w + r · (q - κ s)),        p = 0 at the wetted radius r_w,

because q tilts the surfaces against each other, and sliding closes the gap if the disc is curved. Force and couple
follow from the pressure and the shear stress of sliding,

    F = -∫ ηs/H dA - κ ∫ p r dA,                  M = ∫ p r dA = -K (q - κ s).

The disc contains the volume of the bridge, π r_w² h + π r_w⁴/4R* (Pitois et al. 2000):

    H_w = h + r_w²/2R* = √(h² + V/πR*).

With y = H_w/h - 1, the resistances in closed form are

    N = 6πηR*²/h (1 - h/H_w)²                     (their X²)
    S = 2πηR* ln(1 + y) + κ² K,    C = -κ K,      Q = K = 96πηR*³ J(y).

J (`_tilted`) follows from the profile f of the pressure along a radius, x² = r²/2R*h. f = -x/10(1 + x²)² solves the
equation (Goldman et al. 1967, O'Neill and Stewartson 1967). A multiple of x ₂F₁(2 - √10/2, 2 + √10/2; 2; -x²), which
solves ∇ · (H³ ∇p) = 0, makes it zero at r_w.

The matrix of S, C, Q is symmetric (Onsager), and S Q - C² = 2πηR* ln(1 + y) K is positive. A motion of the pair as one
rigid body has w = s = q = 0. If the disc is wide compared with the gap, all three are proportional to ln(H_w/h). At a
plane, S = 6πηR 8/15, C = -6πηR² 2/5 and Q = 6πηR³ 4/5 times this logarithm: a translating sphere has the force 8/15 and
the torque 2/15, a rotating sphere 2/5 · 4/3 (Goldman et al.). Between spheres, the coefficients are those of Jeffrey
and Onishi (1984). For a thin bridge, r_w → 0, all vanish: N as y², S as y, C and Q as y³.

Surfaces are rough: they touch at asperities of height σ (`Surfaces.roughness`), and liquid fills the gap between them.
S, C and Q are those of smooth surfaces at the gap h + σ (Smart and Leighton 1989). N is bounded by the liquid too. When
surfaces separate, the suction in the gap cannot exceed the pressure p of the air: the liquid cavitates. A gas-filled
gap h is held by the suction 2γ cos θ/h of the meniscus across it, which exceeds p where h < h_c,

    h_c = 2γ cos θ/p          (0.4 µm for silicone oil, 1.2 µm for glycerol: `cavitation_gap`).

Gas that asperities trap opens no gap that is narrower, and the liquid there passes on no more than p. N is therefore
that at h + σ + h_c. This is an estimate, and it is also used for approach, where liquid does not cavitate.

Left out are the shear of liquid outside the wedge (for immersed spheres 0.9588 in addition to 8/15 ln; a small bridge
has no such liquid); moving contact lines; a pressure at the edge other than that of the air (the capillary pressure is
part of the pull, as long as the edge is round); and cavitation where the pressure is below that of the air.

References
----------
O. Pitois, P. Moucheront, X. Chateau, J. Colloid Interface Sci. 231 (2000) 26-31, doi 10.1006/jcis.2000.7096.
A. J. Goldman, R. G. Cox, H. Brenner, Chem. Eng. Sci. 22 (1967) 637-651, doi 10.1016/0009-2509(67)80047-2.
M. E. O'Neill, K. Stewartson, J. Fluid Mech. 27 (1967) 705-724, doi 10.1017/S0022112067002551.
D. J. Jeffrey, Y. Onishi, J. Fluid Mech. 139 (1984) 261-290, doi 10.1017/S0022112084000355.
J. R. Smart, D. T. Leighton, Phys. Fluids A 1 (1989) 52-60, doi 10.1063/1.857523 (roughness as the smallest gap).
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt

import numpy as np

from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces
from walkers.physics.capillary import cavitation_gap

_A, _B = 2.0 - sqrt(2.5), 2.0 + sqrt(2.5)
_THIN = 1e-5


def curve(surfaces: Surfaces, pull: Callable[[FloatArray], FloatArray], rupture: float) -> Curve:
    """The curve of a law with Reynolds resistances; the bridge forms on contact and breaks at a gap ``rupture``, m.

    ``pull`` gives the pull over the surface tension (m) at gaps (m), both of shape (n,).
    """

    def pulled(gaps: FloatArray) -> FloatArray:
        return surfaces.liquid.surface_tension * pull(gaps)

    def forces(gaps: FloatArray) -> Forces:
        return Forces(pulled(gaps), *resistances(surfaces, gaps))

    return Curve(forces, rupture, pull=pulled)


def resistances(surfaces: Surfaces, gaps: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """N and S (N s/m), C (N s), Q (N m s) of a bridge at gaps, m, each of shape (n,)."""
    viscosity, reduced = surfaces.liquid.viscosity, surfaces.reduced_radius
    liquid_gaps = np.maximum(gaps, 0.0) + surfaces.roughness
    wide = liquid_gaps + cavitation_gap(surfaces.liquid)
    spread = surfaces.volume / (pi * reduced)
    normal = 6.0 * pi * viscosity * reduced**2 / wide * (1.0 - wide / np.sqrt(wide**2 + spread)) ** 2
    deep = np.sqrt(liquid_gaps**2 + spread) / liquid_gaps - 1.0  # y
    bend = 0.5 * (1.0 / surfaces.radius - 1.0 / surfaces.other_radius)
    tilting = 96.0 * pi * viscosity * reduced**3 * _tilted(deep)
    shear = 2.0 * pi * viscosity * reduced * np.log1p(deep)
    return normal, shear + bend**2 * tilting, -bend * tilting, tilting


def _tilted(deep: FloatArray) -> FloatArray:
    """J(y) = -∫ f x² dx from 0 to √y, for x⁻¹ (x (1 + x²)³ f')' - (1 + x²)³ f/x² = x, f = 0 at both ends.

    With the particular solution and the homogeneous one, of logarithmic slope L = d ln f/d ln x at the edge,

        J = (ln(1 + y) - y/(1 + y)) / 20 + y/(100 (1 + y)) ((1 - 3y)/(1 + y) - L),

    the second term by Green's identity; y³/96 where y is small and the terms cancel.
    """
    from scipy.special import hyp2f1  # takes half a second, which `walkers show` does not need

    lifted = hyp2f1(_A, _B, 2.0, -deep)
    slope = 1.0 - _A * _B * deep * hyp2f1(_A + 1.0, _B + 1.0, 3.0, -deep) / lifted
    wide = 1.0 + deep
    exact = (np.log1p(deep) - deep / wide) / 20.0 + deep / (100.0 * wide) * ((1.0 - 3.0 * deep) / wide - slope)
    return np.where(deep < _THIN, deep**3 / 96.0, exact)
