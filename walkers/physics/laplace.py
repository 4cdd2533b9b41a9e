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
from functools import cache, cached_property, lru_cache
from math import inf, nan, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from walkers.arrays import FloatArray
from walkers.physics.portable import (
    cube_root,
    exponential,
    gauss_legendre,
    logarithm,
    sine,
    sine_and_cosine,
    solve_linear,
)

_NODES, _WEIGHTS = gauss_legendre(48)
_PLACES = np.append(0.5 * (_NODES + 1.0), 1.0)
"""Fractions of the profile at which it is computed: those of the integrals, and its end."""
_WEIGHTS = 0.5 * _WEIGHTS
_AWAY = np.array([-1.0, 1.0])
"""Signs of the filling angles in the angles of the profile at its ends."""
_POSITIVE = np.array([0, 1, 3])
"""Of a bridge: arcs and length."""
_NEWTON_STEPS = 30
_CONVERGED = 1e-12
_ARC_STEP = 0.05
_MOST_STEPS = 2000
_LARGEST_TURN = 0.2
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
_GROWTH = 1.2
_SAME_GAP = 1e-9
_NEAR = 1e-3
_TURNING = 1e-9


class NoBridgeError(ValueError):
    """The requested bridge does not exist or was not found."""


class ForceCurve(NamedTuple):
    """Stable bridges of one volume at n gaps, in the unit of length that was given."""

    forces: FloatArray  # F/γ, shape (n,)
    bridges: FloatArray  # shape (n, 4): arcs from the apex of either solid to its wetting line (at a sphere the filling
    # angle times its radius), excess pressure over the surface tension (1/length), length of the profile


@dataclass(frozen=True)
class _Trigonometry:
    """Trigonometric functions of angles x, from those of x/2 alone; all arrays have the shape of the angles."""

    sines: FloatArray  # sin x
    cosines: FloatArray  # cos x
    sincs: FloatArray  # sin(x)/x
    sinc_slopes: FloatArray  # derivative of sin(x)/x
    half_sincs: FloatArray  # sin(x/2)/(x/2)
    half_sinc_slopes: FloatArray  # derivative of sin(y)/y at y = x/2

    @classmethod
    def of(cls, angles: FloatArray) -> _Trigonometry:
        """Compute the functions of angles (rad)."""
        halves = 0.5 * angles
        sines, cosines = sine_and_cosine(halves)
        tiny = np.abs(halves) < 1e-4
        half_sincs = np.where(
            tiny, 1.0 - halves * halves / 6.0, sines / np.where(tiny, 1.0, halves)
        )
        sincs = half_sincs * cosines
        whole_cosines = 1.0 - 2.0 * sines * sines
        return cls(
            sines=2.0 * sines * cosines,
            cosines=whole_cosines,
            sincs=sincs,
            sinc_slopes=_sinc_slope(angles, whole_cosines, sincs),
            half_sincs=half_sincs,
            half_sinc_slopes=_sinc_slope(halves, cosines, half_sincs),
        )

    def part(self, columns: slice) -> _Trigonometry:
        """The functions of some columns of the angles."""
        return _Trigonometry(**{name: values[:, columns] for name, values in vars(self).items()})


def _sinc_slope(x: FloatArray, cosines: FloatArray, sincs: FloatArray) -> FloatArray:
    """Derivative of sin(x)/x, (cos x - sin(x)/x)/x; a series where both terms cancel."""
    small = np.abs(x) < 0.02
    square = x * x
    series = -x / 3.0 * (1.0 - square / 10.0 * (1.0 - square / 28.0 * (1.0 - square / 54.0)))
    return np.where(small, series, (cosines - sincs) / np.where(small, 1.0, x))


@dataclass(frozen=True)
class _Solids:
    """Both solids at their wetting lines for n bridges; each array has the shape (n, 2), a column for a solid.

    ``…_by_arc`` are derivatives with respect to the arc of the same solid.
    """

    radii: FloatArray  # of the wetting lines
    radii_by_arc: FloatArray
    rises: FloatArray  # heights of the caps below the wetting lines
    rises_by_arc: FloatArray
    uprights: FloatArray  # r sin φ of the profile
    uprights_by_arc: FloatArray
    outwards: FloatArray  # r cos φ of the profile
    outwards_by_arc: FloatArray


class _WithSlopes(NamedTuple):
    """A quantity along n profiles and its derivatives, each of shape (n, 49)."""

    values: FloatArray
    by_arc: FloatArray  # of the first solid
    by_pressure: FloatArray
    by_length: FloatArray

    @property
    def slopes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The derivatives, in the order of `_PROFILE_COLUMNS`."""
        return self.by_arc, self.by_pressure, self.by_length


_PROFILE_COLUMNS = (0, 2, 3)
"""Of a bridge, the numbers on which its profile depends: first arc, pressure, length."""


@dataclass(frozen=True)
class _Profile:
    """Profiles of n bridges at `_PLACES`, and the solids at their ends."""

    solids: _Solids
    squares: _WithSlopes  # r²
    uprights: _WithSlopes  # r sin φ
    outwards: _WithSlopes  # r cos φ


@dataclass(frozen=True)
class _Family:
    """Bridges of volume 1 between two solids: spheres of curvature k (0: a plane) with contact angles θ.

    A bridge is x = (arc 1, arc 2, p, length of the profile, gap), with the arcs from the apexes of the solids.
    """

    curvatures: tuple[float, float]
    contact_angles: tuple[float, float]

    def solids(self, arcs: FloatArray, trigonometry: _Trigonometry | None = None) -> _Solids:
        """The solids at wetting lines with these arcs, shape (n, 2); ``trigonometry``: of the filling angles."""
        curvatures = np.array(self.curvatures)
        filling_angles = curvatures * arcs
        trigonometry = trigonometry or _Trigonometry.of(filling_angles)
        radii = arcs * trigonometry.sincs
        # The angle of the profile is π - θ1 - α1 at the first solid and θ2 + α2 at the second one.
        contact_sines, contact_cosines = self.contact
        sines = contact_sines * trigonometry.cosines + _AWAY * contact_cosines * trigonometry.sines
        cosines = (
            contact_cosines * trigonometry.cosines - _AWAY * contact_sines * trigonometry.sines
        )
        turning = _AWAY * curvatures
        return _Solids(
            radii=radii,
            radii_by_arc=trigonometry.cosines,
            rises=0.5 * filling_angles * arcs * trigonometry.half_sincs**2,
            rises_by_arc=trigonometry.sines,
            uprights=radii * sines,
            uprights_by_arc=trigonometry.cosines * sines + turning * radii * cosines,
            outwards=radii * cosines,
            outwards_by_arc=trigonometry.cosines * cosines - turning * radii * sines,
        )

    @cached_property
    def contact(self) -> tuple[FloatArray, FloatArray]:
        """Sine and cosine of the angle of the profile at wetting lines on flat solids, each of shape (2,)."""
        first, second = self.contact_angles
        return sine_and_cosine([pi - first, second])

    def profile(self, x: FloatArray) -> _Profile:
        """Profiles of n bridges x, shape (n, 5), and the solids at their ends."""
        pressure, length = x[:, 2:3], x[:, 3:4]
        along = length * _PLACES
        filling_angles = np.array(self.curvatures) * x[:, :2]
        trigonometry = _Trigonometry.of(np.concatenate([pressure * along, filling_angles], axis=1))
        on_profile, at_ends = trigonometry.part(slice(0, -2)), trigonometry.part(slice(-2, None))
        solids = self.solids(x[:, :2], at_ends)
        radius, radius_by_arc = solids.radii[:, :1], solids.radii_by_arc[:, :1]
        upright, upright_by_arc = solids.uprights[:, :1], solids.uprights_by_arc[:, :1]
        outward, outward_by_arc = solids.outwards[:, :1], solids.outwards_by_arc[:, :1]

        # swing = sin(ps)/p and lift = 2 (1 - cos ps)/p², both smooth at p = 0.
        swing = along * on_profile.sincs
        swing_by_pressure = along * along * on_profile.sinc_slopes
        lift = (along * on_profile.half_sincs) ** 2
        lift_by_pressure = (
            along * along * along * on_profile.half_sincs * on_profile.half_sinc_slopes
        )
        bend = 1.0 - pressure * upright
        bend_by_arc = -pressure * upright_by_arc

        # r² = r0² + bend · lift + 2 r0 cos φ0 · swing, and r sin φ = r0 sin φ0 + p (r² - r0²)/2.
        grown = bend * lift + 2.0 * outward * swing
        grown_by_arc = bend_by_arc * lift + 2.0 * outward_by_arc * swing
        grown_by_pressure = (
            -upright * lift + bend * lift_by_pressure + 2.0 * outward * swing_by_pressure
        )
        # r cos φ is half the derivative of r² with respect to s.
        outwards = outward * on_profile.cosines + bend * swing
        outwards_by_arc = outward_by_arc * on_profile.cosines + bend_by_arc * swing
        outwards_by_pressure = (
            -outward * on_profile.sines * along - upright * swing + bend * swing_by_pressure
        )
        outwards_by_length = (
            -outward * on_profile.sines * pressure + bend * on_profile.cosines
        ) * _PLACES
        grown_by_length = 2.0 * outwards * _PLACES
        return _Profile(
            solids=solids,
            squares=_WithSlopes(
                radius * radius + grown,
                2.0 * radius * radius_by_arc + grown_by_arc,
                grown_by_pressure,
                grown_by_length,
            ),
            uprights=_WithSlopes(
                upright + 0.5 * pressure * grown,
                upright_by_arc + 0.5 * pressure * grown_by_arc,
                0.5 * grown + 0.5 * pressure * grown_by_pressure,
                0.5 * pressure * grown_by_length,
            ),
            outwards=_WithSlopes(
                outwards, outwards_by_arc, outwards_by_pressure, outwards_by_length
            ),
        )

    def misfit(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals of n bridges x, shape (n, 5), and their derivatives.

        Returns
        -------
        residuals : ndarray, shape (n, 4)
            Of r sin φ and r cos φ at the second solid, the gap, and the volume.
        jacobian : ndarray, shape (n, 4, 5)
        """
        profile = self.profile(x)
        solids, length = profile.solids, x[:, 3]
        residuals = np.zeros((len(x), 4))
        jacobian = np.zeros((len(x), 4, 5))

        residuals[:, 0] = profile.uprights.values[:, -1] - solids.uprights[:, 1]
        residuals[:, 1] = profile.outwards.values[:, -1] - solids.outwards[:, 1]
        jacobian[:, 0, 1] = -solids.uprights_by_arc[:, 1]
        jacobian[:, 1, 1] = -solids.outwards_by_arc[:, 1]
        for column, upright_slope, outward_slope in zip(
            _PROFILE_COLUMNS, profile.uprights.slopes, profile.outwards.slopes, strict=True
        ):
            jacobian[:, 0, column] = upright_slope[:, -1]
            jacobian[:, 1, column] = outward_slope[:, -1]

        # Height ∫ sin φ ds and volume π ∫ r² sin φ ds.
        squares, uprights = profile.squares.values[:, :-1], profile.uprights.values[:, :-1]
        radii = np.sqrt(squares)
        height = (_WEIGHTS * uprights / radii).sum(axis=1)
        volume = (_WEIGHTS * uprights * radii).sum(axis=1)
        caps, caps_by_arc = _caps(solids)
        residuals[:, 2] = length * height - x[:, 4] - solids.rises.sum(axis=1)
        residuals[:, 3] = pi * length * volume - 1.0 - caps.sum(axis=1)
        half = 0.5 * uprights / squares
        for column, upright_slope, square_slope in zip(
            _PROFILE_COLUMNS, profile.uprights.slopes, profile.squares.slopes, strict=True
        ):
            by_radius = half * square_slope[:, :-1]
            height_slope = (_WEIGHTS * (upright_slope[:, :-1] - by_radius) / radii).sum(axis=1)
            volume_slope = (_WEIGHTS * (upright_slope[:, :-1] + by_radius) * radii).sum(axis=1)
            jacobian[:, 2, column] = length * height_slope
            jacobian[:, 3, column] = pi * length * volume_slope
        jacobian[:, 2, :2] -= solids.rises_by_arc
        jacobian[:, 2, 3] += height
        jacobian[:, 2, 4] = -1.0
        jacobian[:, 3, :2] -= caps_by_arc
        jacobian[:, 3, 3] += pi * volume
        return residuals, jacobian

    def forces(self, x: FloatArray) -> FloatArray:
        """F/γ at the starts of the profiles."""
        solids = self.solids(x[:, :2])
        return pi * (2.0 * solids.uprights - x[:, 2:3] * solids.radii**2)[:, 0]

    def solve(self, x: FloatArray, row: FloatArray, values: FloatArray) -> FloatArray:
        """Newton's method from n bridges x, shape (n, 5), for bridges with row · x = value; NaN where it fails."""
        solved, left = np.full_like(x, nan), np.arange(len(x))
        for _ in range(_NEWTON_STEPS):
            residuals, jacobian = self.misfit(x)
            misfit = np.column_stack([residuals, (x * row).sum(axis=1) - values])
            matrices = np.concatenate([jacobian, np.tile(row, (len(x), 1, 1))], axis=1)
            step = solve_linear(matrices, misfit)
            change = np.abs(step[:, _POSITIVE] / x[:, _POSITIVE]).max(axis=1)
            x = x - step * np.minimum(1.0, 0.3 / (change + 1e-300))[:, None]
            sound = (x[:, _POSITIVE] > 0.0).all(axis=1)
            good = sound & (
                np.abs(step).max(axis=1) < _CONVERGED * np.maximum(1.0, np.abs(x).max(axis=1))
            )
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
        jacobian = self.misfit(x[None])[1][0]
        onward = before / scale
        # J t = 0 and t · onward = 1, in units of `scale`.
        matrix = np.concatenate([jacobian * scale, onward[None]])
        direction = solve_linear(matrix[None], np.array([[0.0, 0.0, 0.0, 0.0, 1.0]]))[0]
        return np.asarray(direction * scale / _norm(direction))


def _caps(solids: _Solids) -> tuple[FloatArray, FloatArray]:
    """Volumes of the caps of the solids below the wetting lines, and their slopes, both of shape (n, 2)."""
    radii, rises = solids.radii, solids.rises
    volumes = pi / 6.0 * rises * (3.0 * radii**2 + rises**2)
    by_radius = pi * rises * radii
    by_rise = 0.5 * pi * (radii**2 + rises**2)
    return volumes, by_radius * solids.radii_by_arc + by_rise * solids.rises_by_arc


def _norm(vector: FloatArray) -> float:
    """Length of a vector of 5 numbers."""
    return float(np.sqrt((vector * vector).sum()))


_GAP = np.array([0.0, 0.0, 0.0, 0.0, 1.0])


def _toroid(family: _Family) -> FloatArray:
    """An approximate bridge at contact: a circular profile between wetting lines of one radius, of volume 1."""
    # π k b⁴ / 4 = 1, between surfaces whose distance grows as k b² / 2.
    arc = np.full(2, sqrt(2.0 / sqrt(pi * sum(family.curvatures))))
    curvatures = np.array(family.curvatures)
    slopes = curvatures * arc
    height = float((0.5 * slopes * arc * _Trigonometry.of(slopes).half_sincs ** 2).sum())
    angles = [
        angle + float(slope) for angle, slope in zip(family.contact_angles, slopes, strict=True)
    ]
    turn = 0.5 * (pi - sum(angles))
    length = height / float(_Trigonometry.of(np.array(turn)).sincs)
    return np.array([*arc, 1.0 / arc[0] - 2.0 * float(sine(turn)) / height, length, 0.0])


def _family_of(
    radii: tuple[float, float], volume: float, contact_angle: float | tuple[float, float]
) -> _Family:
    """The family of bridges, lengths in units of the volume's cube root."""
    if volume <= 0.0 or min(radii) <= 0.0 or not volume < inf or min(radii) == inf:
        raise ValueError(
            f"radii {radii}, volume {volume}: expected positive numbers, and a plane at one side at most"
        )
    angles = contact_angle if isinstance(contact_angle, tuple) else (contact_angle, contact_angle)
    if not all(0.0 <= angle < pi for angle in angles):
        raise ValueError(f"contact angles {angles}: expected 0 to π")
    unit = cube_root(volume)
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
        if onward is None or _norm((onward[1] - tangent) / scale) > _LARGEST_TURN:
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
    bridge = family.nearest(x + step * tangent, row, float((row * x).sum()) + step)
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
    unit, largest = cube_root(volume), float(_branch(family)[1][-1, 4])
    scaled = np.asarray(gaps, np.float64) / unit
    if scaled.min() < 0.0 or scaled.max() > largest * (1.0 + 1e-12):
        raise ValueError(f"gaps: expected 0 to {largest * unit:.6g}, where the bridge ruptures")
    bridges = _stable(family, np.minimum(scaled, largest))
    return ForceCurve(
        unit * family.forces(bridges), bridges[:, :4] * [unit, unit, 1.0 / unit, unit]
    )


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
    arcs = [
        brentq(ahead, lows[i], highs[i], (i,)) if inside[i] else lows[i] for i in range(len(gaps))
    ]
    near = _cubic(cubics, (np.array(arcs) - lows)[:, None])
    bridges = family.solve(near, _GAP, gaps)
    bridges[gaps >= knots[-1]] = branch[-1]
    far = ~(np.max(np.abs(bridges - near)[:, _POSITIVE], axis=1) <= _NEAR) & (gaps < knots[-1])
    for number in np.flatnonzero(far):
        chord = branch[pieces[number] + 1] - branch[pieces[number]]
        bridges[number] = _across(
            family, cubics[:, number], chord, (lows[number], highs[number]), gaps[number]
        )
    lost = ~(
        np.maximum(np.abs(bridges[:, 4] - gaps), np.max(np.abs(family.misfit(bridges)[0]), axis=1))
        <= _SAME_GAP
    )
    if lost.any():
        raise NoBridgeError(
            f"no bridge was found at a gap of {gaps[lost][0]:.6g} of the volume's cube root"
        )
    return bridges


def _cubic(coefficients: Any, x: Any) -> Any:
    """The polynomials of degree 3 that begin with the first of (4, ...) coefficients."""
    first, second, third, last = coefficients
    return last + third * x + second * (x * x) + first * (x * x * x)


def _across(
    family: _Family, cubic: FloatArray, chord: FloatArray, ends: tuple[float, float], gap: float
) -> FloatArray:
    """The bridge at a gap near the largest one, where it depends strongly on the gap: sought along the family."""

    def at(arc: float) -> FloatArray:
        near = _cubic(cubic, arc - ends[0])
        exact = family.nearest(near, chord, float((chord * near).sum()))
        return near if exact is None else exact

    last = at(ends[1])
    return (
        last
        if last[4] <= gap
        else at(float(brentq(lambda arc: at(arc)[4] - gap, *ends, xtol=1e-12)))
    )


def rupture_distance(
    radius_1: float, radius_2: float, volume: float, contact_angle: float | tuple[float, float]
) -> float:
    """Largest gap at which a bridge of this volume exists; parameters and errors as for `force_curve`."""
    return cube_root(volume) * float(
        _branch(_family_of((radius_1, radius_2), volume, contact_angle))[1][-1, 4]
    )


def volume_at_contact(
    radius_1: float, radius_2: float, contact_angle: float, meniscus_radius: float
) -> float:
    """Volume of a bridge between touching solids whose pressure is that of the air minus γ/``meniscus_radius``.

    Parameters as for `force_curve`. `NoBridgeError` if bridges up to half of the smaller sphere have more suction, or
    bridges as small as 1e-9 of it have less.
    """
    sphere = 4.0 / 3.0 * pi * min(radius_1, radius_2) ** 2 * min(radius_1, radius_2)
    ends = [float(logarithm(share * sphere)) for share in (1e-9, 0.5)]

    @cache
    def missing(log_volume: float) -> float:
        """Suction that is missing, over the wanted one."""
        volume = float(exponential(log_volume))
        pressure = _touching(_family_of((radius_1, radius_2), volume, contact_angle))[
            2
        ] / cube_root(volume)
        return float(1.0 + pressure * meniscus_radius)

    if not missing(ends[0]) < 0.0 < missing(ends[1]):
        radius = f"a meniscus radius of {1e6 * meniscus_radius:g} um"
        raise NoBridgeError(f"no bridge between touching surfaces has {radius}")
    return float(exponential(brentq(missing, *ends, xtol=1e-12)))
