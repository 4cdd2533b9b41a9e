"""Capillary bridges from the Young–Laplace equation: force as a function of the gap, and rupture.

A bridge is axisymmetric and weightless, between two spheres, or a sphere and a plane (infinite radius). Its profile
r(s), z(s) as a function of the arc length s, with the angle φ to the radius, obeys

    dr/ds = cos φ,   dz/ds = sin φ,   dφ/ds = p - sin φ / r,

where p is the excess pressure of the liquid over the surface tension. The slopes of the solids at the wetting lines are
the filling angles α. With the contact angles θ, the profile begins at φ = π - α1 - θ1 and ends at φ = α2 + θ2. It
encloses the given volume. The pull on either solid,

    F / γ = π (2 r sin φ - p r²),

has the same value at all points of the profile.

`force_curve` and `rupture_distance` use the solutions in closed form (Delaunay),

    r² = r0² + 2 (1 - p r0 sin φ0) (1 - cos ps) / p² + 2 r0 cos φ0 sin(ps) / p,

and follow the family of bridges of one volume up to the largest gap. There is no bridge at a larger gap; the rest of
the family is unstable, with thinner necks at smaller gaps.

Lengths may have any common unit, and volumes its cube; forces over the surface tension are lengths. Internally, the
unit is the cube root of the volume.

References
----------
C. Delaunay, J. Math. Pures Appl. 6 (1841) 309–314; K. Kenmotsu, Tôhoku Math. J. 32 (1980) 147–153,
doi 10.2748/tmj/1178229688 (the closed form).
F. M. Orr, L. E. Scriven, A. P. Rivas, J. Fluid Mech. 67 (1975) 723–742, doi 10.1017/S0022112075000572 (bridges without
weight, special cases).
C. D. Willett, M. J. Adams, S. A. Johnson, J. P. K. Seville, Langmuir 16 (2000) 9396–9405, doi 10.1021/la000657y (force
against gap by numerical integration; filling angles that are not monotonic).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, lru_cache
from math import cbrt, exp, inf, log, nan, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

FloatArray = npt.NDArray[np.float64]
Array = npt.NDArray[Any]
"""Real, or complex for derivatives by complex steps."""

_NODES, _WEIGHTS = (
    0.5 * (part + shift) for part, shift in zip(np.polynomial.legendre.leggauss(48), (1.0, 0.0), strict=True)
)
_PLACES = np.append(_NODES, 1.0)
"""Fractions of the profile at which it is computed: those of the integrals, and its end."""
_HALVES, _AWAY = np.array([1.0, 0.5]), np.array([-1.0, 1.0])
_POSITIVE = np.array([0, 1, 3])
"""Of a bridge: arcs and length."""
_NEWTON_STEPS = 30
_CONVERGED = 1e-12
_COMPLEX_STEP = 1e-30
_STEPS = 1j * _COMPLEX_STEP * np.eye(5)
_ARC_STEP, _MOST_STEPS, _LARGEST_TURN = 0.05, 2000, 0.2
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
_GROWTH = 1.2
_SAME_GAP, _NEAR = 1e-9, 1e-3
_TURNING = 1e-9


class NoBridgeError(ValueError):
    """The requested bridge does not exist or was not found."""


class ForceCurve(NamedTuple):
    """Stable bridges of one volume at n gaps, in the unit of length that was given."""

    forces: FloatArray  # F/γ, shape (n,)
    bridges: FloatArray  # shape (n, 4): arcs from the apex of either solid to its wetting line (at a sphere the filling
    # angle times its radius), excess pressure over the surface tension (1/length), length of the profile


def _sinc(x: Array) -> Array:
    """sin(x)/x, also for complex arguments (derivatives by complex steps)."""
    small = np.abs(x) < 1e-4
    if not small.any():
        return np.asarray(np.sin(x) / x)
    safe = np.where(small, 1.0, x)
    return np.where(small, 1.0 - x**2 / 6.0, np.sin(safe) / safe)


@dataclass(frozen=True)
class _Family:
    """Bridges of volume 1 between two solids: spheres of curvature k (0: a plane) with contact angles θ.

    A bridge is x = (arc 1, arc 2, p, length of the profile, gap), with the arcs from the apexes of the solids.
    """

    curvatures: tuple[float, float]
    contact_angles: tuple[float, float]

    def ends(self, slopes: Array, radii: Array) -> tuple[Array, Array]:
        """The profile's r sin φ and r cos φ at both solids, shape (..., 2), of filling angles and wetting lines."""
        angles = np.array([pi - self.contact_angles[0], self.contact_angles[1]]) + _AWAY * slopes
        return radii * np.sin(angles), radii * np.cos(angles)

    def misfit(self, x: Array) -> Array:
        """Residuals of the boundary conditions, shape (..., 4): end on the second solid, contact angle, volume."""
        arcs, pressure, length, curvatures = x[..., :2], x[..., 2:3], x[..., 3:4], np.array(self.curvatures)
        at, slopes = length * _PLACES, curvatures * arcs
        turns = pressure * at
        (of_slopes, of_halves), (swings, halves) = (_sinc(np.multiply.outer(_HALVES, x)) for x in (slopes, turns))
        radii, rises = arcs * of_slopes, 0.5 * curvatures * arcs**2 * of_halves**2
        caps = pi / 6.0 * rises * (3.0 * radii**2 + rises**2)
        uprights, outwards = self.ends(slopes, radii)
        upright, outward = uprights[..., :1], outwards[..., :1]
        start, bend = upright**2 + outward**2, 1.0 - pressure * upright
        squared = start + bend * at**2 * halves**2 + 2.0 * outward * at * swings
        along = upright + 0.5 * pressure * (squared - start)
        weighted, radius = _WEIGHTS * along[..., :-1], np.sqrt(squared[..., :-1])
        last = outward[..., 0] * np.cos(turns[..., -1]) + bend[..., 0] * x[..., 3] * swings[..., -1]
        misfit = np.empty_like(x[..., :4])
        misfit[..., 0] = along[..., -1] - uprights[..., 1]
        misfit[..., 1] = last - outwards[..., 1]
        misfit[..., 2] = x[..., 3] * (weighted / radius).sum(axis=-1) - x[..., 4] - rises.sum(axis=-1)
        misfit[..., 3] = pi * x[..., 3] * (weighted * radius).sum(axis=-1) - 1.0 - caps.sum(axis=-1)
        return misfit

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives of the misfit, shape (..., 4, 5), exact: by complex steps."""
        return np.swapaxes(self.misfit(x[..., None, :] + _STEPS).imag, -1, -2) / _COMPLEX_STEP

    def forces(self, x: FloatArray) -> FloatArray:
        """F/γ at the starts of the profiles."""
        slopes = np.array(self.curvatures) * x[:, :2]
        radii = x[:, :2] * _sinc(slopes)
        return pi * (2.0 * self.ends(slopes, radii)[0] - x[:, 2:3] * radii**2)[:, 0]

    def solve(self, x: FloatArray, row: FloatArray, values: FloatArray) -> FloatArray:
        """Newton's method from n bridges x, shape (n, 5), for bridges with row · x = value; NaN where it fails."""
        solved, left = np.full_like(x, nan), np.arange(len(x))
        for _ in range(_NEWTON_STEPS):
            misfit, matrices = np.empty((len(x), 5, 1)), np.empty((len(x), 5, 5))
            misfit[:, :4, 0], misfit[:, 4, 0] = self.misfit(x), x @ row - values
            matrices[:, :4], matrices[:, 4] = self.jacobian(x), row
            try:
                step = np.linalg.solve(matrices, misfit)[..., 0]
            except np.linalg.LinAlgError:
                break
            change = np.abs(step[:, _POSITIVE] / x[:, _POSITIVE]).max(axis=1)
            x = x - step * np.minimum(1.0, 0.3 / (change + 1e-300))[:, None]
            sound = (x[:, _POSITIVE] > 0.0).all(axis=1)
            good = sound & (np.abs(step).max(axis=1) < _CONVERGED * np.maximum(1.0, np.abs(x).max(axis=1)))
            solved[left[good]] = x[good]
            sound &= ~good
            if not sound.any():
                break
            x, values, left = x[sound], values[sound], left[sound]
        return solved

    def nearest(self, x: FloatArray, row: FloatArray, value: float) -> FloatArray | None:
        """One bridge by Newton's method from x; None where it fails."""
        (solved,) = self.solve(x[None], row, np.array([value]))
        return None if np.isnan(solved[0]) else solved

    def tangent(self, x: FloatArray, before: FloatArray, scale: FloatArray) -> FloatArray:
        """Direction of the family at x, of length 1 in units of `scale`, onward from `before`."""
        direction = np.linalg.svd(self.jacobian(x) * scale)[2][-1] * scale
        return direction if (direction / scale) @ (before / scale) > 0.0 else -direction  # type: ignore[no-any-return]


_GAP = np.array([0.0, 0.0, 0.0, 0.0, 1.0])


def _toroid(family: _Family) -> FloatArray:
    """An approximate bridge at contact: a circular profile between wetting lines of one radius, of volume 1."""
    # π k b⁴ / 4 = 1, between surfaces whose distance grows as k b² / 2.
    arc = np.full(2, sqrt(2.0 / sqrt(pi * sum(family.curvatures))))
    curvatures = np.array(family.curvatures)
    slopes = curvatures * arc
    height = float(sum(0.5 * curvatures * arc**2 * _sinc(0.5 * slopes) ** 2))
    angles = [angle + float(slope) for angle, slope in zip(family.contact_angles, slopes, strict=True)]
    turn = 0.5 * (pi - sum(angles))
    length = height / float(_sinc(np.array(turn)))
    return np.array([*arc, 1.0 / arc[0] - 2.0 * sin(turn) / height, length, 0.0])


def _family_of(radii: tuple[float, float], volume: float, contact_angle: float | tuple[float, float]) -> _Family:
    """The family of bridges, lengths in units of the volume's cube root."""
    if volume <= 0.0 or min(radii) <= 0.0 or not volume < inf or min(radii) == inf:
        raise ValueError(f"radii {radii}, volume {volume}: expected positive numbers, and a plane at one side at most")
    angles = contact_angle if isinstance(contact_angle, tuple) else (contact_angle, contact_angle)
    if not all(0.0 <= angle < pi for angle in angles):
        raise ValueError(f"contact angles {angles}: expected 0 to π")
    unit = cbrt(volume)
    return _Family((unit / radii[0], unit / radii[1]), angles)


def _touching(family: _Family) -> FloatArray:
    """The bridge at contact, continued from flatter solids, for which `_toroid` is a good approximation."""

    def flatter(share: float) -> _Family:
        first, second = family.curvatures
        return replace(family, curvatures=(share * first, share * second))

    for first_share in _SHARES:
        share, x = first_share, _toroid(flatter(first_share))
        while (bridge := flatter(share).nearest(x, _GAP, 0.0)) is not None:
            if share == 1.0:
                return bridge
            x, share = bridge, min(1.0, _GROWTH * share)
    raise NoBridgeError("no bridge was found at contact")


@lru_cache(maxsize=256)
def _branch(family: _Family) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stable bridges from contact to the largest gap: the arc length s of the family, x and dx/ds."""
    x = _touching(family)
    scale = np.array([1.0, 1.0, max(1.0, abs(float(x[2]))), 1.0, 1.0])
    tangent, step = family.tangent(x, _GAP, scale), _ARC_STEP
    arcs, bridges, tangents = [0.0], [x], [tangent]
    for _ in range(_MOST_STEPS):
        onward = _onward(family, x, tangent, step, scale)
        if onward is None or float(np.linalg.norm((onward[1] - tangent) / scale)) > _LARGEST_TURN:
            step *= 0.5
            continue
        if onward[1][4] <= 0.0:
            onward, step = _turning_point(family, x, tangent, step, scale)
        x, tangent = onward
        arcs.append(arcs[-1] + step)
        bridges.append(x)
        tangents.append(tangent)
        if abs(tangent[4]) < _TURNING:
            return np.array(arcs), np.array(bridges), np.array(tangents)
        step = min(_ARC_STEP, 1.5 * step)
    raise NoBridgeError("the largest gap was not reached")


def _onward(
    family: _Family, x: FloatArray, tangent: FloatArray, step: float, scale: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """The bridge one step further along the family, and the tangent of the family there."""
    row = tangent / scale**2
    bridge = family.nearest(x + step * tangent, row, float(row @ x) + step)
    return None if bridge is None else (bridge, family.tangent(bridge, tangent, scale))


def _turning_point(
    family: _Family, x: FloatArray, tangent: FloatArray, step: float, scale: FloatArray
) -> tuple[tuple[FloatArray, FloatArray], float]:
    """The bridge at the largest gap, which is less than a step along the family, and the step to it."""

    def opening(part: float) -> float:
        onward = _onward(family, x, tangent, part, scale)
        if onward is None:
            raise NoBridgeError("the family was lost at its largest gap")
        return float(onward[1][4])

    part = float(brentq(opening, 0.0, step, xtol=1e-13, rtol=1e-13))
    onward = _onward(family, x, tangent, part, scale)
    assert onward is not None
    return onward, part


def force_curve(
    radius_1: float,
    radius_2: float,
    volume: float,
    contact_angle: float | tuple[float, float],
    gaps: npt.ArrayLike,
) -> ForceCurve:
    """Pull of a bridge of constant volume at gaps, shape (n,), from 0 to the rupture distance.

    A plane has an infinite radius; the contact angle (rad) is one for both solids, or one for each. `ValueError` for
    other gaps, and for radii and volumes that are not positive; `NoBridgeError` if no bridge was found (a contact angle
    so large that the liquid is not held between them).
    """
    family = _family_of((radius_1, radius_2), volume, contact_angle)
    unit, largest = cbrt(volume), float(_branch(family)[1][-1, 4])
    scaled = np.asarray(gaps, np.float64) / unit
    if scaled.min() < 0.0 or scaled.max() > largest * (1.0 + 1e-12):
        raise ValueError(f"gaps: expected 0 to {largest * unit:.6g}, where the bridge ruptures")
    bridges = _stable(family, np.minimum(scaled, largest))
    return ForceCurve(unit * family.forces(bridges), bridges[:, :4] * [unit, unit, 1.0 / unit, unit])


def _stable(family: _Family, gaps: FloatArray) -> FloatArray:
    """The stable bridges at n gaps, shape (n, 5)."""
    along, branch, tangents = _branch(family)
    knots = branch[:, 4]
    pieces = np.clip(np.searchsorted(knots, gaps, side="right") - 1, 0, len(knots) - 2)
    cubics = CubicHermiteSpline(along, branch, tangents).c[:, pieces]
    lows, highs = along[pieces], along[pieces + 1]

    def ahead(arc: float, number: int) -> float:
        return float(_cubic(of_gaps[number], arc - lows[number]) - gaps[number])

    of_gaps, inside = cubics[:, :, 4].T.tolist(), (knots[pieces] < gaps) & (gaps < knots[-1])
    # At its left end a piece may begin above the gap by rounding.
    arcs = [brentq(ahead, lows[i], highs[i], (i,)) if inside[i] else lows[i] for i in range(len(gaps))]
    near = _cubic(cubics, (np.array(arcs) - lows)[:, None])
    bridges = family.solve(near, _GAP, gaps)
    bridges[gaps >= knots[-1]] = branch[-1]
    far = ~(np.max(np.abs(bridges - near)[:, _POSITIVE], axis=1) <= _NEAR) & (gaps < knots[-1])
    for number in np.flatnonzero(far):
        chord = branch[pieces[number] + 1] - branch[pieces[number]]
        bridges[number] = _across(family, cubics[:, number], chord, (lows[number], highs[number]), gaps[number])
    lost = ~(np.maximum(np.abs(bridges[:, 4] - gaps), np.max(np.abs(family.misfit(bridges)), axis=1)) <= _SAME_GAP)
    if lost.any():
        raise NoBridgeError(f"no bridge was found at a gap of {gaps[lost][0]:.6g} of the volume's cube root")
    return bridges


def _cubic(coefficients: Any, x: Any) -> Any:
    """The polynomials of degree 3 that begin with the first of (4, ...) coefficients."""
    first, second, third, last = coefficients
    return last + third * x + second * (x * x) + first * (x * x * x)


def _across(family: _Family, cubic: FloatArray, chord: FloatArray, ends: tuple[float, float], gap: float) -> FloatArray:
    """The bridge at a gap near the largest one, where it depends strongly on the gap: sought along the family."""

    def at(arc: float) -> FloatArray:
        near = _cubic(cubic, arc - ends[0])
        exact = family.nearest(near, chord, float(chord @ near))
        return near if exact is None else exact

    last = at(ends[1])
    return last if last[4] <= gap else at(float(brentq(lambda arc: at(arc)[4] - gap, *ends, xtol=1e-12)))


def rupture_distance(
    radius_1: float, radius_2: float, volume: float, contact_angle: float | tuple[float, float]
) -> float:
    """Largest gap at which a bridge of this volume exists; parameters and errors as for `force_curve`."""
    return cbrt(volume) * float(_branch(_family_of((radius_1, radius_2), volume, contact_angle))[1][-1, 4])


def volume_at_contact(radius_1: float, radius_2: float, contact_angle: float, meniscus_radius: float) -> float:
    """Volume of a bridge between touching solids whose pressure is that of the air minus γ/``meniscus_radius``.

    Parameters as for `force_curve`. `NoBridgeError` if bridges up to half of the smaller sphere have more suction, or
    bridges as small as 1e-9 of it have less.
    """
    ends = [log(share * 4.0 / 3.0 * pi * min(radius_1, radius_2) ** 3) for share in (1e-9, 0.5)]

    @cache
    def missing(log_volume: float) -> float:
        """Suction that is missing, over the wanted one."""
        volume = exp(log_volume)
        pressure = _touching(_family_of((radius_1, radius_2), volume, contact_angle))[2] / cbrt(volume)
        return float(1.0 + pressure * meniscus_radius)

    if not missing(ends[0]) < 0.0 < missing(ends[1]):
        radius = f"a meniscus radius of {1e6 * meniscus_radius:g} um"
        raise NoBridgeError(f"no bridge between touching surfaces has {radius}")
    return exp(brentq(missing, *ends, xtol=1e-12))
