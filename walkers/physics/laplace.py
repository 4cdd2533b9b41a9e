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

from dataclasses import dataclass
from functools import cache, lru_cache
from math import cbrt, exp, inf, log, pi, sin, sqrt
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
_NEWTON_STEPS = 30
_CONVERGED = 1e-12
_COMPLEX_STEP = 1e-30
_ARC_STEP, _MOST_STEPS, _LARGEST_TURN = 0.05, 2000, 0.2
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
_GROWTH = 1.2
_SAME_GAP, _NEAR = 1e-9, 1e-3
_TURNING = 1e-9


class NoBridgeError(ValueError):
    """The requested bridge does not exist or was not found."""


class ForceCurve(NamedTuple):
    """Stable bridges of one volume at n gaps.

    Attributes
    ----------
    forces : ndarray, shape (n,)
        F/γ, in the unit of length that was given.
    bridges : ndarray, shape (n, 4)
        Arcs from the apex of either solid to its wetting line (at a sphere the filling angle times its radius), excess
        pressure over the surface tension (1/length), and length of the profile.
    """

    forces: FloatArray
    bridges: FloatArray


@dataclass(frozen=True)
class _Solid:
    """A sphere of curvature k (0: a plane) with contact angle θ; arcs t are measured from its apex."""

    curvature: float
    contact_angle: float

    def slope(self, arc: Array) -> Array:
        """Filling angle."""
        return self.curvature * arc

    def radius(self, arc: Array) -> Array:
        return np.asarray(arc * _sinc(self.curvature * arc))

    def rise(self, arc: Array) -> Array:
        """Height of the wetted cap."""
        return np.asarray(0.5 * self.curvature * arc**2 * _sinc(0.5 * self.curvature * arc) ** 2)

    def cap_volume(self, arc: Array) -> Array:
        rise = self.rise(arc)
        return np.asarray(pi / 6.0 * rise * (3.0 * self.radius(arc) ** 2 + rise**2))


def _sinc(x: Array) -> Array:
    """sin(x)/x, also for complex arguments (derivatives by complex steps)."""
    small = np.abs(x) < 1e-4
    safe = np.where(small, 1.0, x)
    return np.where(small, 1.0 - x**2 / 6.0, np.sin(safe) / safe)


@dataclass(frozen=True)
class _Family:
    """Bridges of volume 1 between two solids; a bridge is x = (arc 1, arc 2, p, length of the profile, gap)."""

    first: _Solid
    second: _Solid

    def start(self, arc: Array) -> tuple[Array, Array]:
        """The profile's r sin φ and r cos φ at the first solid."""
        slope = pi - self.first.contact_angle - self.first.slope(arc)
        radius = self.first.radius(arc)
        return radius * np.sin(slope), radius * np.cos(slope)

    def profile(self, x: Array, fractions: FloatArray) -> tuple[Array, Array]:
        """Radii r and r sin φ at fractions of the length, shape (..., n), of bridges of shape (..., 5)."""
        pressure, length = x[..., 2, None], x[..., 3, None]
        upright, outward = (part[..., None] for part in self.start(x[..., 0]))
        at, start = length * fractions, upright**2 + outward**2
        squared = (
            start
            + (1.0 - pressure * upright) * at**2 * _sinc(0.5 * pressure * at) ** 2
            + 2.0 * outward * at * _sinc(pressure * at)
        )
        return np.sqrt(squared), upright + 0.5 * pressure * (squared - start)

    def misfit(self, x: Array) -> Array:
        """Residuals of the boundary conditions, shape (..., 4): end on the second solid, contact angle, volume."""
        radius, upright = self.profile(x, _NODES)
        pressure, length = x[..., 2], x[..., 3]
        solids = ((self.first, x[..., 0]), (self.second, x[..., 1]))
        rise = length * np.sum(_WEIGHTS * upright / radius, axis=-1)
        volume = pi * length * np.sum(_WEIGHTS * upright * radius, axis=-1)
        slope, end = self.second.contact_angle + self.second.slope(x[..., 1]), self.second.radius(x[..., 1])
        start_upright, start_outward = self.start(x[..., 0])
        turn = pressure * length
        outward = start_outward * np.cos(turn) + (1.0 - pressure * start_upright) * length * _sinc(turn)
        return np.stack(
            [
                self.profile(x, np.ones(1))[1][..., 0] - end * np.sin(slope),
                outward - end * np.cos(slope),
                rise - x[..., 4] - sum(solid.rise(arc) for solid, arc in solids),
                volume - 1.0 - sum(solid.cap_volume(arc) for solid, arc in solids),
            ],
            axis=-1,
        )

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives of the misfit, shape (4, 5), exact: by complex steps."""
        steps = x + 1j * _COMPLEX_STEP * np.eye(5)
        return self.misfit(steps).imag.T / _COMPLEX_STEP

    def force(self, x: FloatArray) -> float:
        """F/γ at the start of the profile."""
        upright = self.start(x[0])[0]
        return float(pi * (2.0 * upright - x[2] * self.first.radius(x[0]) ** 2))

    def solve(self, x: FloatArray, row: FloatArray, value: float) -> FloatArray | None:
        """Newton's method from x for a bridge with row · x = value; None where it fails."""
        for _ in range(_NEWTON_STEPS):
            misfit = np.append(self.misfit(x), row @ x - value)
            matrix = np.vstack([self.jacobian(x), row])
            try:
                step = np.linalg.solve(matrix, misfit)
            except np.linalg.LinAlgError:
                return None
            x = x - step * min(1.0, 0.3 / float(np.max(np.abs(step[[0, 1, 3]] / x[[0, 1, 3]])) + 1e-300))
            if not np.all(np.isfinite(x)) or np.any(x[[0, 1, 3]] <= 0.0):
                return None
            if np.max(np.abs(step)) < _CONVERGED * max(1.0, float(np.max(np.abs(x)))):
                return x
        return None

    def at_gap(self, x: FloatArray, gap: float) -> FloatArray | None:
        return self.solve(x, _GAP, gap)

    def tangent(self, x: FloatArray, before: FloatArray, scale: FloatArray) -> FloatArray:
        """Direction of the family at x, of length 1 in units of `scale`, onward from `before`."""
        direction = np.linalg.svd(self.jacobian(x) * scale)[2][-1] * scale
        return direction if (direction / scale) @ (before / scale) > 0.0 else -direction  # type: ignore[no-any-return]


_GAP = np.array([0.0, 0.0, 0.0, 0.0, 1.0])


def _toroid(family: _Family, gap: float) -> FloatArray:
    """An approximate bridge: a circular profile between wetting lines of one radius, which enclose the volume 1."""
    curvature = family.first.curvature + family.second.curvature
    # π b² (gap + k b² / 4) = 1, between surfaces whose distance grows as k b² / 2.
    squared = 2.0 / (pi * gap + sqrt((pi * gap) ** 2 + pi * curvature))
    arc = np.full(2, sqrt(squared))
    height = gap + float(family.first.rise(arc)[0] + family.second.rise(arc)[0])
    angles = [solid.contact_angle + float(solid.slope(arc)[0]) for solid in (family.first, family.second)]
    turn = 0.5 * (pi - sum(angles))
    length = height / float(_sinc(np.array(turn)))
    return np.array([*arc, 1.0 / arc[0] - 2.0 * sin(turn) / height, length, gap])


def _family_of(radii: tuple[float, float], volume: float, contact_angle: float | tuple[float, float]) -> _Family:
    """The family of bridges, lengths in units of the volume's cube root."""
    if volume <= 0.0 or min(radii) <= 0.0 or not volume < inf or min(radii) == inf:
        raise ValueError(f"radii {radii}, volume {volume}: expected positive numbers, and a plane at one side at most")
    angles = contact_angle if isinstance(contact_angle, tuple) else (contact_angle, contact_angle)
    if not all(0.0 <= angle < pi for angle in angles):
        raise ValueError(f"contact angles {angles}: expected 0 to π")
    unit = cbrt(volume)
    first, second = (_Solid(unit / radius, angle) for radius, angle in zip(radii, angles, strict=True))
    return _Family(first, second)


def _shrunk(family: _Family, share: float) -> _Family:
    """The same liquid between solids whose curvature is reduced by a factor."""
    first, second = (_Solid(share * one.curvature, one.contact_angle) for one in (family.first, family.second))
    return _Family(first, second)


def _touching(family: _Family) -> FloatArray:
    """The bridge at contact, continued from flatter solids, for which `_toroid` is a good approximation.

    Raises
    ------
    NoBridgeError
        If Newton's method does not find it.
    """
    for first_share in _SHARES:
        share, x = first_share, _toroid(_shrunk(family, first_share), 0.0)
        while (found := _shrunk(family, share).at_gap(x, 0.0)) is not None:
            if share == 1.0:
                return found
            x, share = found, min(1.0, _GROWTH * share)
    raise NoBridgeError("no bridge was found at contact")


@dataclass(frozen=True)
class _Branch:
    """Stable bridges from contact to the largest gap: x and dx/ds against the arc length s of the family."""

    arcs: FloatArray
    bridges: FloatArray
    tangents: FloatArray


@lru_cache(maxsize=256)
def _branch(family: _Family) -> _Branch:
    """Follow a family along its arc length until its gap decreases.

    Raises
    ------
    NoBridgeError
        If there is none at contact, or the end is not reached.
    """
    x = _touching(family)
    scale = np.array([1.0, 1.0, max(1.0, abs(float(x[2]))), 1.0, 1.0])
    tangent, step = family.tangent(x, _GAP, scale), _ARC_STEP
    arcs, bridges, tangents = [0.0], [x], [tangent]
    for _ in range(_MOST_STEPS):
        found = _onward(family, x, tangent, step, scale)
        if found is None or float(np.linalg.norm((found[1] - tangent) / scale)) > _LARGEST_TURN:
            step *= 0.5
            continue
        if found[1][4] <= 0.0:
            found, step = _turning_point(family, x, tangent, step, scale)
        x, tangent = found
        arcs.append(arcs[-1] + step)
        bridges.append(x)
        tangents.append(tangent)
        if abs(tangent[4]) < _TURNING:
            return _Branch(np.array(arcs), np.array(bridges), np.array(tangents))
        step = min(_ARC_STEP, 1.5 * step)
    raise NoBridgeError("the largest gap was not reached")


def _onward(
    family: _Family, x: FloatArray, tangent: FloatArray, step: float, scale: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """The bridge one step further along the family, and the tangent of the family there."""
    row = tangent / scale**2
    found = family.solve(x + step * tangent, row, float(row @ x) + step)
    return None if found is None else (found, family.tangent(found, tangent, scale))


def _turning_point(
    family: _Family, x: FloatArray, tangent: FloatArray, step: float, scale: FloatArray
) -> tuple[tuple[FloatArray, FloatArray], float]:
    """The bridge at the largest gap, which is less than a step along the family, and the step to it."""

    def opening(part: float) -> float:
        found = _onward(family, x, tangent, part, scale)
        if found is None:
            raise NoBridgeError("the family was lost at its largest gap")
        return float(found[1][4])

    part = float(brentq(opening, 0.0, step, xtol=1e-13, rtol=1e-13))
    found = _onward(family, x, tangent, part, scale)
    assert found is not None
    return found, part


def force_curve(
    radius_1: float,
    radius_2: float,
    volume: float,
    contact_angle: float | tuple[float, float],
    gaps: npt.ArrayLike,
) -> ForceCurve:
    """Pull of a bridge of constant volume at gaps.

    Parameters
    ----------
    radius_1, radius_2
        Radii of the spheres; infinity for a plane.
    volume
        Volume of the liquid, in the cube of the unit of the radii.
    contact_angle
        rad; one for both solids, or one for each.
    gaps
        From 0 to the rupture distance, shape (n,).

    Raises
    ------
    ValueError
        If a gap is negative or beyond rupture, or radii or volume are not positive.
    NoBridgeError
        If no bridge was found (a contact angle so large that the liquid is not held between them).
    """
    family = _family_of((radius_1, radius_2), volume, contact_angle)
    unit, branch = cbrt(volume), _branch(family)
    largest = float(branch.bridges[-1, 4])
    wanted = np.asarray(gaps, np.float64) / unit
    if wanted.min() < 0.0 or wanted.max() > largest * (1.0 + 1e-12):
        raise ValueError(f"gaps: expected 0 to {largest * unit:.6g}, where the bridge ruptures")
    bridges = [_stable(family, branch, min(float(gap), largest)) for gap in wanted]
    forces = unit * np.array([family.force(x) for x in bridges])
    return ForceCurve(forces, np.array(bridges)[:, :4] * [unit, unit, 1.0 / unit, unit])


def _stable(family: _Family, branch: _Branch, gap: float) -> FloatArray:
    """The stable bridge at a gap."""
    gaps = branch.bridges[:, 4]
    if gap >= gaps[-1]:
        return branch.bridges[-1]  # type: ignore[no-any-return]
    index = min(int(np.searchsorted(gaps, gap, side="right")) - 1, len(gaps) - 2)
    piece = slice(index, index + 2)
    between = CubicHermiteSpline(branch.arcs[piece], branch.bridges[piece], branch.tangents[piece])
    low, high = branch.arcs[piece]
    # At its left end the piece may begin above the gap by rounding.
    at = low if gap <= gaps[index] else float(brentq(lambda arc: between(arc)[4] - gap, low, high))
    found = family.at_gap(between(at), gap)
    if found is None or np.max(np.abs(found - between(at))[[0, 1, 3]]) > _NEAR:
        # Near the largest gap, bridges depend strongly on it, or the unstable one is found: search along the family.
        chord = branch.bridges[index + 1] - branch.bridges[index]

        def across(arc: float) -> FloatArray:
            near = between(arc)
            other = family.solve(near, chord, float(chord @ near))
            return near if other is None else other

        last = across(high)[4] <= gap
        found = across(high if last else float(brentq(lambda arc: across(arc)[4] - gap, low, high, xtol=1e-12)))
    if abs(found[4] - gap) > _SAME_GAP or np.max(np.abs(family.misfit(found))) > _SAME_GAP:
        raise NoBridgeError(f"no bridge was found at a gap of {gap:.6g} of the volume's cube root")
    return found


def rupture_distance(
    radius_1: float, radius_2: float, volume: float, contact_angle: float | tuple[float, float]
) -> float:
    """Largest gap at which a bridge of this volume exists; parameters and errors as for `force_curve`."""
    family = _family_of((radius_1, radius_2), volume, contact_angle)
    return cbrt(volume) * float(_branch(family).bridges[-1, 4])


def volume_at_contact(radius_1: float, radius_2: float, contact_angle: float, meniscus_radius: float) -> float:
    """Volume of a bridge between touching solids whose pressure is that of the air minus γ/``meniscus_radius``.

    Parameters
    ----------
    radius_1, radius_2
        Radii of the spheres; infinity for a plane.
    contact_angle
        rad.
    meniscus_radius
        Inverse of the suction over the surface tension, in the unit of the radii.

    Raises
    ------
    NoBridgeError
        If bridges up to half of the smaller sphere have more suction, or bridges as small as 1e-9 of it have less.
    """
    ends = [log(share * 4.0 / 3.0 * pi * min(radius_1, radius_2) ** 3) for share in (1e-9, 0.5)]

    @cache
    def missing(log_volume: float) -> float:
        """Suction that is missing, over the wanted one."""
        volume = exp(log_volume)
        pressure = _touching(_family_of((radius_1, radius_2), volume, contact_angle))[2] / cbrt(volume)
        return float(1.0 + pressure * meniscus_radius)

    if not missing(ends[0]) < 0.0 < missing(ends[1]):
        raise NoBridgeError(
            f"no bridge between touching surfaces has a meniscus radius of {1e6 * meniscus_radius:g} um"
        )
    return exp(brentq(missing, *ends, xtol=1e-12))
