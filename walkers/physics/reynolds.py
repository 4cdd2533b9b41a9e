"""Resistances of a bridge from the Reynolds equation in the wetted disc.

The pressure at the edge of the disc is that of the air.

Between surfaces 1 and 2 (spheres of radii R1 ≤ R2, or a sphere and a plane;
`walkers.physics.bridge` has the signs and the velocities w, s, q) the gap is H = h + r²/2R*. With κ
= (1/R1 - 1/R2)/2, the curvature of the disc's mid-surface, the pressure obeys

    ∇ · (H³ ∇p) = 12η (w + r · (q - κ s)),        p = 0 at the wetted radius r_w,

because q tilts the surfaces against each other, and sliding closes the gap if the disc is curved.
Force and couple follow from the pressure and the shear stress of sliding,

    F = -∫ ηs/H dA - κ ∫ p r dA,                  M = ∫ p r dA = -K (q - κ s).

The disc contains the volume of the bridge, π r_w² h + π r_w⁴/4R* (Pitois et al. 2000):

    H_w = h + r_w²/2R* = √(h² + V/πR*).

With y = H_w/h - 1, the resistances in closed form are

    N = 6πηR*²/h (1 - h/H_w)²                     (their X²)
    S = 2πηR* ln(1 + y) + κ² K,    C = -κ K,      Q = K = 96πηR*³ J(y).

J (`_tilted`) follows from the profile f of the pressure along a radius, x² = r²/2R*h. f = -x/10(1 +
x²)² solves the equation (Goldman et al. 1967, O'Neill and Stewartson 1967). A multiple of x ₂F₁(2 -
√10/2, 2 + √10/2; 2; -x²), which solves ∇ · (H³ ∇p) = 0, makes it zero at r_w.

The matrix of S, C, Q is symmetric (Onsager), and S Q - C² = 2πηR* ln(1 + y) K is positive. A motion
of the pair as one rigid body has w = s = q = 0. If the disc is wide compared with the gap, all
three are proportional to ln(H_w/h). At a plane, S = 6πηR 8/15, C = -6πηR² 2/5 and Q = 6πηR³ 4/5
times this logarithm: a translating sphere has the force 8/15 and the torque 2/15, a rotating sphere
2/5 · 4/3 (Goldman et al.). Between spheres, the coefficients are those of Jeffrey and Onishi
(1984). For a thin bridge, r_w → 0, all vanish: N as y², S as y, C and Q as y³.

Surfaces are rough: they touch at asperities of height σ (`Surfaces.roughness`), and liquid fills
the gap between them. S, C and Q are those of smooth surfaces at the gap h + σ (Smart and Leighton
1989). N is bounded by the liquid too. When surfaces separate, the suction in the gap cannot exceed
the pressure p of the air: the liquid cavitates. A gas-filled gap h is held by the suction 2γ cos
θ/h of the meniscus across it, which exceeds p where h < h_c,

    h_c = 2γ cos θ/p          (0.4 µm for silicone oil, 1.2 µm for glycerol: `cavitation_gap`).

Gas that asperities trap opens no gap that is narrower, and the liquid there passes on no more than
p. N is therefore that at h + σ + h_c. This is an estimate, and it is also used for approach, where
liquid does not cavitate.

Left out are the shear of liquid outside the wedge (for immersed spheres 0.9588 in addition to 8/15
ln; a small bridge has no such liquid); moving edges (`walkers.physics.edges`); a pressure at the
edge other than that of the air (the capillary pressure is part of the pull, as long as the edge is
round); and cavitation where the pressure is below that of the air.

References
----------
O. Pitois, P. Moucheront, X. Chateau, J. Colloid Interface Sci. 231 (2000) 26-31, doi
10.1006/jcis.2000.7096.
A. J. Goldman, R. G. Cox, H. Brenner, Chem. Eng. Sci. 22 (1967) 637-651, doi
10.1016/0009-2509(67)80047-2.
M. E. O'Neill, K. Stewartson, J. Fluid Mech. 27 (1967) 705-724, doi 10.1017/S0022112067002551.
D. J. Jeffrey, Y. Onishi, J. Fluid Mech. 139 (1984) 261-290, doi 10.1017/S0022112084000355.
J. R. Smart, D. T. Leighton, Phys. Fluids A 1 (1989) 52-60, doi 10.1063/1.857523 (roughness as the
smallest gap).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi, sqrt

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics.bridge import Curve, Forces, Surfaces
from walkers.physics.capillary import cavitation_gap
from walkers.physics.portable import logarithm_of_one_plus, polynomial, power

_A = 2.0 - sqrt(2.5)
"""a = 2 - √10/2 of the hypergeometric function."""
_THIN = 1e-5
"""y below which J is y³/96."""


def curve(surfaces: Surfaces, pull: Callable[[FloatArray], FloatArray], rupture: float) -> Curve:
    """The curve of a law with the resistances of the Reynolds equation.

    The bridge forms on contact.

    Parameters
    ----------
    surfaces
        The surfaces.
    pull
        Function that gives the capillary force over the surface tension (m) at gaps (m), both of
        shape (n,).
    rupture
        Gap at which the bridge breaks, m.
    """

    def capillary_force(gaps: FloatArray) -> FloatArray:
        return surfaces.liquid.surface_tension * pull(gaps)

    def forces(gaps: FloatArray) -> Forces:
        normal, sliding, coupling, rolling = resistances(surfaces, gaps)
        return Forces(
            pull=capillary_force(gaps),
            normal=normal,
            sliding=sliding,
            coupling=coupling,
            rolling=rolling,
        )

    return Curve(forces, rupture, pull=capillary_force)


def resistances(
    surfaces: Surfaces, gaps: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """N and S (N s/m), C (N s), Q (N m s) of a bridge at gaps, m, each of shape (n,).

    The liquid fills a gap that is wider by the roughness. Surfaces that overlap count as touching.
    """
    eta = surfaces.liquid.viscosity
    radius = surfaces.reduced_radius
    gap = np.maximum(gaps, 0.0) + surfaces.roughness
    spread = surfaces.volume / (pi * radius)  # V/πR*
    cavitated = gap + cavitation_gap(surfaces.liquid)
    share = 1.0 - cavitated / np.sqrt(cavitated**2 + spread)
    normal = 6.0 * pi * eta * radius**2 / cavitated * share**2
    y = np.sqrt(gap**2 + spread) / gap - 1.0
    kappa = 0.5 * (1.0 / surfaces.radius - 1.0 / surfaces.other_radius)
    rolling = 96.0 * pi * eta * (radius * radius * radius) * _tilted(y)
    shear = 2.0 * pi * eta * radius * logarithm_of_one_plus(y)
    return normal, shear + kappa**2 * rolling, -kappa * rolling, rolling


def _tilted(y: FloatArray) -> FloatArray:
    """J(y), the negative integral of f x² from 0 to √y.

    f solves x⁻¹ (x (1 + x²)³ f')' - (1 + x²)³ f/x² = x and is zero at both ends.

    With the particular solution and the homogeneous one, of logarithmic slope L = d ln f/d ln x at
    the edge,

        J = (ln(1 + y) - y/(1 + y)) / 20 + y/(100 (1 + y)) ((1 - 3y)/(1 + y) - L),

    the second term by Green's identity; y³/96 where y is small and the terms cancel.
    """
    slope = _logarithmic_slope(y)
    exact = (logarithm_of_one_plus(y) - y / (1.0 + y)) / 20.0
    exact += y / (100.0 * (1.0 + y)) * ((1.0 - 3.0 * y) / (1.0 + y) - slope)
    return np.where(y < _THIN, y * y * y / 96.0, exact)


def _logarithmic_slope(y: FloatArray) -> FloatArray:
    """L = d ln f/d ln x of the homogeneous solution f at y = x².

    f = x ₂F₁(a, 4 - a; 2; -y) with a = 2 - √10/2.

    By Pfaff's transformation ₂F₁ is (1 + y)^-a G(w) with G = ₂F₁(a, a - 2; 2; w) and w = y/(1 + y),
    so that L = 1 - 2 a w + 2 w (1 - w) G'/G. G is a power series in w up to w = 1/2, and two series
    in 1 - w above it.
    """
    w = y / (1.0 + y)
    one_minus_w = 1.0 / (1.0 + y)
    near = np.minimum(w, 0.5)
    near_value = polynomial(_NEAR, near)
    near_slope = polynomial(_slopes(_NEAR), near)
    far = np.minimum(one_minus_w, 0.5)
    scale = _SECOND * power(far, _EXPONENT)
    second = polynomial(_FAR_SECOND, far)
    second_slope = _EXPONENT / far * second + polynomial(_slopes(_FAR_SECOND), far)
    far_value = polynomial(_FAR_FIRST, far) + scale * second
    far_slope = -(polynomial(_slopes(_FAR_FIRST), far) + scale * second_slope)
    slope_over_value = np.where(w <= 0.5, near_slope / near_value, far_slope / far_value)
    return np.asarray(1.0 - 2.0 * _A * w + 2.0 * w * one_minus_w * slope_over_value)


def _hypergeometric(a: float, b: float, c: float) -> tuple[float, ...]:
    """Coefficients of ₂F₁(a, b; c; x) from the highest power to the constant.

    For x up to 1/2, what is left out is below 1e-18 of the constant.
    """
    terms = [1.0]
    for number in range(_TERMS):
        terms.append(terms[-1] * (a + number) * (b + number) / ((c + number) * (1.0 + number)))
    return tuple(reversed(terms))


def _slopes(coefficients: Sequence[float]) -> list[float]:
    """Coefficients of the derivative of a polynomial, from the highest power to the constant."""
    degree = len(coefficients) - 1
    slopes = []
    for place, coefficient in enumerate(coefficients[:-1]):
        slopes.append((degree - place) * coefficient)
    return slopes


_TERMS = 56
"""Highest power of the series."""
_EXPONENT = 4.0 - 2.0 * _A
"""Power of 1 - w by which the second series in 1 - w is multiplied."""
_SECOND = 0.24851522586732902
"""Factor of the second series over that of the first one, Γ(2a - 4) Γ(2 - a) Γ(4 - a) / (Γ(4 - 2a)
Γ(a) Γ(a - 2))."""
_NEAR = _hypergeometric(_A, _A - 2.0, 2.0)
"""The series in w."""
_FAR_FIRST = _hypergeometric(_A, _A - 2.0, 2.0 * _A - 3.0)
"""The first series in 1 - w."""
_FAR_SECOND = _hypergeometric(2.0 - _A, 4.0 - _A, 5.0 - 2.0 * _A)
"""The second series in 1 - w."""
