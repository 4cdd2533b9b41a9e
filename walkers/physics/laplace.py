"""Capillary bridges from the Young–Laplace equation: force as a function of the gap, and rupture.

A bridge is axisymmetric and weightless, between two spheres, or a sphere and a plane (infinite
radius). Its profile r(s), z(s) as a function of the arc length s, with the angle φ to the radius,
obeys

    dr/ds = cos φ,   dz/ds = sin φ,   dφ/ds = p - sin φ / r,

where p is the excess pressure of the liquid over the surface tension. The slopes of the solids at
the wetting lines are the filling angles α. With the contact angles θ, the profile begins at φ = π -
α1 - θ1 and ends at φ = α2 + θ2. It encloses the given volume. The capillary force on either solid,

    F / γ = π (2 r sin φ - p r²),

has the same value at all points of the profile.

`force_curve` and `rupture_distance` use the solutions in closed form (Delaunay),

    r² = r0² + 2 (1 - p r0 sin φ0) (1 - cos ps) / p² + 2 r0 cos φ0 sin(ps) / p,

and follow the family of bridges of one volume up to the largest gap. There is no bridge at a larger
gap; the rest of the family is unstable, with thinner necks at smaller gaps.

Lengths may have any common unit, and volumes its cube; forces over the surface tension are lengths.
Internally, the unit is the cube root of the volume.

References
----------
C. Delaunay, J. Math. Pures Appl. 6 (1841) 309–314; K. Kenmotsu, Tôhoku Math. J. 32 (1980) 147–153,
doi 10.2748/tmj/1178229688 (the closed form).
F. M. Orr, L. E. Scriven, A. P. Rivas, J. Fluid Mech. 67 (1975) 723–742, doi
10.1017/S0022112075000572 (bridges without weight, special cases).
C. D. Willett, M. J. Adams, S. A. Johnson, J. P. K. Seville, Langmuir 16 (2000) 9396–9405, doi
10.1021/la000657y (force against gap by numerical integration; filling angles that are not
monotonic).
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
_SIGNS = np.array([-1.0, 1.0])
"""Signs of the filling angles in the angles of the profile at its ends."""
_POSITIVE = np.array([0, 1, 3])
"""Places of the positive numbers of a bridge: both arcs and the length."""
_NEWTON_STEPS = 30
"""Largest number of steps of Newton's method."""
_LARGEST_CHANGE = 0.3
"""Largest relative change of arcs and length in a step."""
_CONVERGED = 1e-12
"""Relative size of the last of these steps."""
_ARC_STEP = 0.05
"""Largest step along the family of bridges."""
_MOST_STEPS = 2000
"""Largest number of steps along the family."""
_LARGEST_TURN = 0.2
"""Largest change of the tangent of the family in a step; a step that turns more is halved."""
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
"""Shares of the curvatures of the solids from which the bridge at contact is continued, in the
order of the trials."""
_GROWTH = 1.2
"""Factor by which this share grows in a step of the continuation."""
_SAME_GAP = 1e-9
"""Largest error of the gap and of the equations of a solution, in units of the volume's cube
root."""
_NEAR = 1e-3
"""Largest difference between a bridge and its interpolation; beyond it, Newton's method found
another bridge."""
_TURNING = 1e-9
"""Slope of the gap along the family at which the gap counts as the largest one."""


class NoBridgeError(ValueError):
    """The requested bridge does not exist or was not found."""


class ForceCurve(NamedTuple):
    """Stable bridges of one volume at n gaps, in the unit of length that was given."""

    forces: FloatArray
    """F/γ, shape (n,)."""
    bridges: FloatArray
    """Shape of each bridge, shape (n, 4).

    The columns are the arcs from the apex of either solid to its wetting line (at a sphere the
    filling angle times its radius), the excess pressure over the surface tension (1/length), and
    the length of the profile.
    """


@dataclass(frozen=True)
class _Trigonometry:
    """Trigonometric functions of angles x, from those of x/2 alone.

    All arrays have the shape of the angles.
    """

    sines: FloatArray
    """sin x."""
    cosines: FloatArray
    """cos x."""
    sincs: FloatArray
    """sin(x)/x."""
    sinc_slopes: FloatArray
    """Derivative of sin(x)/x."""
    half_sincs: FloatArray
    """sin(x/2)/(x/2)."""
    half_sinc_slopes: FloatArray
    """Derivative of sin(y)/y at y = x/2."""

    @classmethod
    def at(cls, angles: FloatArray) -> _Trigonometry:
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

    def in_columns(self, columns: slice) -> _Trigonometry:
        """The functions of some columns of the angles."""
        return _Trigonometry(
            sines=self.sines[:, columns],
            cosines=self.cosines[:, columns],
            sincs=self.sincs[:, columns],
            sinc_slopes=self.sinc_slopes[:, columns],
            half_sincs=self.half_sincs[:, columns],
            half_sinc_slopes=self.half_sinc_slopes[:, columns],
        )


def _sinc_slope(x: FloatArray, cosines: FloatArray, sincs: FloatArray) -> FloatArray:
    """Derivative of sin(x)/x, (cos x - sin(x)/x)/x; a series where both terms cancel."""
    small = np.abs(x) < 0.02
    square = x * x
    series = -x / 3.0 * (1.0 - square / 10.0 * (1.0 - square / 28.0 * (1.0 - square / 54.0)))
    return np.where(small, series, (cosines - sincs) / np.where(small, 1.0, x))


@dataclass(frozen=True)
class _Solids:
    """Both solids at their wetting lines for n bridges.

    Each array has the shape (n, 2), a column for a solid.

    ``…_by_arc`` are derivatives with respect to the arc of the same solid.
    """

    radii: FloatArray
    """Radii r of the wetting lines."""
    radii_by_arc: FloatArray
    cap_heights: FloatArray
    """Heights of the caps below the wetting lines."""
    cap_heights_by_arc: FloatArray
    r_sin_phi: FloatArray
    """r sin φ of the profile at the wetting lines."""
    r_sin_phi_by_arc: FloatArray
    r_cos_phi: FloatArray
    """r cos φ of the profile at the wetting lines."""
    r_cos_phi_by_arc: FloatArray


class _WithSlopes(NamedTuple):
    """A quantity along n profiles and its derivatives, each of shape (n, 49)."""

    values: FloatArray
    by_arc: FloatArray
    """Derivative with respect to the arc of the first solid."""
    by_pressure: FloatArray
    by_length: FloatArray
    """Derivative with respect to the length of the profile."""

    @property
    def slopes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The derivatives, in the order of `_PROFILE_COLUMNS`."""
        return self.by_arc, self.by_pressure, self.by_length


_PROFILE_COLUMNS = (0, 2, 3)
"""Places of the numbers of a bridge on which its profile depends: first arc, pressure, length."""


@dataclass(frozen=True)
class _Profile:
    """Profiles of n bridges at `_PLACES`, and the solids at their ends."""

    solids: _Solids
    r_squared: _WithSlopes
    r_sin_phi: _WithSlopes
    r_cos_phi: _WithSlopes


@dataclass(frozen=True)
class _Family:
    """Bridges of volume 1 between two solids.

    The solids are spheres of curvature k (0: a plane) with contact angles θ.

    A bridge is x = (arc 1, arc 2, p, length of the profile, gap), with the arcs from the apexes of
    the solids.
    """

    curvatures: tuple[float, float]
    contact_angles: tuple[float, float]

    def solids(self, arcs: FloatArray, trigonometry: _Trigonometry | None = None) -> _Solids:
        """The solids at wetting lines with these arcs, shape (n, 2).

        The functions of the filling angles are computed unless they are given.
        """
        curvatures = np.array(self.curvatures)
        filling_angles = curvatures * arcs
        if trigonometry is None:
            trigonometry = _Trigonometry.at(filling_angles)
        radii = arcs * trigonometry.sincs
        # The angle of the profile is π - θ1 - α1 at the first solid and θ2 + α2 at the second one.
        contact_sines, contact_cosines = self.contact
        sines = contact_sines * trigonometry.cosines + _SIGNS * contact_cosines * trigonometry.sines
        cosines = (
            contact_cosines * trigonometry.cosines - _SIGNS * contact_sines * trigonometry.sines
        )
        turning = _SIGNS * curvatures
        return _Solids(
            radii=radii,
            radii_by_arc=trigonometry.cosines,
            cap_heights=0.5 * filling_angles * arcs * trigonometry.half_sincs**2,
            cap_heights_by_arc=trigonometry.sines,
            r_sin_phi=radii * sines,
            r_sin_phi_by_arc=trigonometry.cosines * sines + turning * radii * cosines,
            r_cos_phi=radii * cosines,
            r_cos_phi_by_arc=trigonometry.cosines * cosines - turning * radii * sines,
        )

    @cached_property
    def contact(self) -> tuple[FloatArray, FloatArray]:
        """Sine and cosine of the angle of the profile at wetting lines on flat solids.

        Each has the shape (2,).
        """
        first, second = self.contact_angles
        return sine_and_cosine([pi - first, second])

    def profile(self, x: FloatArray) -> _Profile:
        """Profiles of n bridges x, shape (n, 5), and the solids at their ends."""
        pressure, length = x[:, 2:3], x[:, 3:4]
        s = length * _PLACES
        filling_angles = np.array(self.curvatures) * x[:, :2]
        # The functions of all angles are computed at once, which is faster.
        trigonometry = _Trigonometry.at(np.concatenate([pressure * s, filling_angles], axis=1))
        on_profile = trigonometry.in_columns(slice(0, -2))
        at_ends = trigonometry.in_columns(slice(-2, None))
        solids = self.solids(x[:, :2], at_ends)
        radius, radius_by_arc = solids.radii[:, :1], solids.radii_by_arc[:, :1]
        r0_sin_phi0, r0_sin_phi0_by_arc = solids.r_sin_phi[:, :1], solids.r_sin_phi_by_arc[:, :1]
        r0_cos_phi0, r0_cos_phi0_by_arc = solids.r_cos_phi[:, :1], solids.r_cos_phi_by_arc[:, :1]

        # The sine part is sin(ps)/p, the cosine part 2 (1 - cos ps)/p²; both are smooth at p = 0.
        sine_part = s * on_profile.sincs
        sine_part_by_pressure = s * s * on_profile.sinc_slopes
        cosine_part = (s * on_profile.half_sincs) ** 2
        cosine_part_by_pressure = s * s * s * on_profile.half_sincs * on_profile.half_sinc_slopes
        factor = 1.0 - pressure * r0_sin_phi0
        factor_by_arc = -pressure * r0_sin_phi0_by_arc

        # The growth is r² - r0² = (1 - p r0 sin φ0) · cosine part + 2 r0 cos φ0 · sine part,
        # and r sin φ = r0 sin φ0 + p (r² - r0²)/2.
        growth = factor * cosine_part + 2.0 * r0_cos_phi0 * sine_part
        growth_by_arc = factor_by_arc * cosine_part + 2.0 * r0_cos_phi0_by_arc * sine_part
        growth_by_pressure = (
            -r0_sin_phi0 * cosine_part
            + factor * cosine_part_by_pressure
            + 2.0 * r0_cos_phi0 * sine_part_by_pressure
        )
        # r cos φ is half the derivative of r² with respect to s.
        r_cos_phi = r0_cos_phi0 * on_profile.cosines + factor * sine_part
        r_cos_phi_by_arc = r0_cos_phi0_by_arc * on_profile.cosines + factor_by_arc * sine_part
        r_cos_phi_by_pressure = (
            -r0_cos_phi0 * on_profile.sines * s
            - r0_sin_phi0 * sine_part
            + factor * sine_part_by_pressure
        )
        r_cos_phi_by_length = (
            -r0_cos_phi0 * on_profile.sines * pressure + factor * on_profile.cosines
        ) * _PLACES
        growth_by_length = 2.0 * r_cos_phi * _PLACES
        return _Profile(
            solids=solids,
            r_squared=_WithSlopes(
                radius * radius + growth,
                2.0 * radius * radius_by_arc + growth_by_arc,
                growth_by_pressure,
                growth_by_length,
            ),
            r_sin_phi=_WithSlopes(
                r0_sin_phi0 + 0.5 * pressure * growth,
                r0_sin_phi0_by_arc + 0.5 * pressure * growth_by_arc,
                0.5 * growth + 0.5 * pressure * growth_by_pressure,
                0.5 * pressure * growth_by_length,
            ),
            r_cos_phi=_WithSlopes(
                r_cos_phi, r_cos_phi_by_arc, r_cos_phi_by_pressure, r_cos_phi_by_length
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

        residuals[:, 0] = profile.r_sin_phi.values[:, -1] - solids.r_sin_phi[:, 1]
        residuals[:, 1] = profile.r_cos_phi.values[:, -1] - solids.r_cos_phi[:, 1]
        jacobian[:, 0, 1] = -solids.r_sin_phi_by_arc[:, 1]
        jacobian[:, 1, 1] = -solids.r_cos_phi_by_arc[:, 1]
        for column, r_sin_phi_slope, r_cos_phi_slope in zip(
            _PROFILE_COLUMNS, profile.r_sin_phi.slopes, profile.r_cos_phi.slopes, strict=True
        ):
            jacobian[:, 0, column] = r_sin_phi_slope[:, -1]
            jacobian[:, 1, column] = r_cos_phi_slope[:, -1]

        # Height ∫ sin φ ds and volume π ∫ r² sin φ ds.
        r_squared, r_sin_phi = profile.r_squared.values[:, :-1], profile.r_sin_phi.values[:, :-1]
        radii = np.sqrt(r_squared)
        height = (_WEIGHTS * r_sin_phi / radii).sum(axis=1)
        volume = (_WEIGHTS * r_sin_phi * radii).sum(axis=1)
        caps, caps_by_arc = _caps(solids)
        residuals[:, 2] = length * height - x[:, 4] - solids.cap_heights.sum(axis=1)
        residuals[:, 3] = pi * length * volume - 1.0 - caps.sum(axis=1)
        half = 0.5 * r_sin_phi / r_squared
        for column, r_sin_phi_slope, r_squared_slope in zip(
            _PROFILE_COLUMNS, profile.r_sin_phi.slopes, profile.r_squared.slopes, strict=True
        ):
            by_radius = half * r_squared_slope[:, :-1]
            height_slope = (_WEIGHTS * (r_sin_phi_slope[:, :-1] - by_radius) / radii).sum(axis=1)
            volume_slope = (_WEIGHTS * (r_sin_phi_slope[:, :-1] + by_radius) * radii).sum(axis=1)
            jacobian[:, 2, column] = length * height_slope
            jacobian[:, 3, column] = pi * length * volume_slope
        jacobian[:, 2, :2] -= solids.cap_heights_by_arc
        jacobian[:, 2, 3] += height
        jacobian[:, 2, 4] = -1.0
        jacobian[:, 3, :2] -= caps_by_arc
        jacobian[:, 3, 3] += pi * volume
        return residuals, jacobian

    def forces(self, x: FloatArray) -> FloatArray:
        """F/γ at the starts of the profiles."""
        solids = self.solids(x[:, :2])
        return pi * (2.0 * solids.r_sin_phi - x[:, 2:3] * solids.radii**2)[:, 0]

    def solve(self, x: FloatArray, row: FloatArray, values: FloatArray) -> FloatArray:
        """Solve the equations of n bridges and row · x = value by Newton's method.

        The equations are those of `misfit`.

        Parameters
        ----------
        x
            Bridges from which the method starts, shape (n, 5).
        row
            Coefficients of the fifth equation, shape (5,).
        values
            Its right sides, shape (n,).

        Returns
        -------
        numpy.ndarray
            The bridges, shape (n, 5); NaN where the method fails.
        """
        solved = np.full_like(x, nan)
        unsolved = np.arange(len(x))
        for _ in range(_NEWTON_STEPS):
            residuals, jacobian = self.misfit(x)
            misfit = np.column_stack([residuals, (x * row).sum(axis=1) - values])
            matrices = np.concatenate([jacobian, np.tile(row, (len(x), 1, 1))], axis=1)
            step = solve_linear(matrices, misfit)
            change = np.abs(step[:, _POSITIVE] / x[:, _POSITIVE]).max(axis=1)
            # A long step is shortened, so that arcs and lengths remain positive.
            x = x - step * np.minimum(1.0, _LARGEST_CHANGE / (change + 1e-300))[:, None]
            sound = (x[:, _POSITIVE] > 0.0).all(axis=1)
            tolerance = _CONVERGED * np.maximum(1.0, np.abs(x).max(axis=1))
            converged = sound & (np.abs(step).max(axis=1) < tolerance)
            solved[unsolved[converged]] = x[converged]
            remaining = sound & ~converged
            if not remaining.any():
                break
            x = x[remaining]
            values = values[remaining]
            unsolved = unsolved[remaining]
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
    """Volumes of the caps of the solids below the wetting lines, and their slopes.

    Both have the shape (n, 2).
    """
    radii, cap_heights = solids.radii, solids.cap_heights
    volumes = pi / 6.0 * cap_heights * (3.0 * radii**2 + cap_heights**2)
    by_radius = pi * cap_heights * radii
    by_rise = 0.5 * pi * (radii**2 + cap_heights**2)
    return volumes, by_radius * solids.radii_by_arc + by_rise * solids.cap_heights_by_arc


def _norm(vector: FloatArray) -> float:
    """Length of a vector of 5 numbers."""
    return float(np.sqrt((vector * vector).sum()))


_GAP = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
"""The row · x = gap of `_Family.solve`."""


def _toroid(family: _Family) -> FloatArray:
    """An approximate bridge of volume 1 at contact.

    Its profile is an arc of a circle between wetting lines of one radius.
    """
    # π k b⁴ / 4 = 1, between surfaces whose distance grows as k b² / 2.
    arc = np.full(2, sqrt(2.0 / sqrt(pi * sum(family.curvatures))))
    curvatures = np.array(family.curvatures)
    slopes = curvatures * arc
    height = float((0.5 * slopes * arc * _Trigonometry.at(slopes).half_sincs ** 2).sum())
    first_angle, second_angle = family.contact_angles
    first_slope, second_slope = slopes.tolist()
    angles = (first_angle + first_slope) + (second_angle + second_slope)
    turn = 0.5 * (pi - angles)
    length = height / float(_Trigonometry.at(np.array(turn)).sincs)
    return np.array([*arc, 1.0 / arc[0] - 2.0 * float(sine(turn)) / height, length, 0.0])


def _family_of(
    radii: tuple[float, float], volume: float, contact_angle: float | tuple[float, float]
) -> _Family:
    """The family of bridges, lengths in units of the volume's cube root."""
    if volume <= 0.0 or min(radii) <= 0.0 or not volume < inf or min(radii) == inf:
        expected = "expected positive numbers, and a plane at one side at most"
        raise ValueError(f"radii {radii}, volume {volume}: {expected}")
    angles = contact_angle if isinstance(contact_angle, tuple) else (contact_angle, contact_angle)
    if not all(0.0 <= angle < pi for angle in angles):
        raise ValueError(f"contact angles {angles}: expected 0 to π")
    unit = cube_root(volume)
    return _Family((unit / radii[0], unit / radii[1]), angles)


def _flatter(family: _Family, share: float) -> _Family:
    """The family between solids with a share of the curvatures."""
    first, second = family.curvatures
    return replace(family, curvatures=(share * first, share * second))


def _touching(family: _Family) -> FloatArray:
    """The bridge at contact.

    It is continued from flatter solids, for which `_toroid` is a good approximation.
    """
    for first_share in _SHARES:
        share = first_share
        bridge: FloatArray | None = _toroid(_flatter(family, share))
        while bridge is not None:
            bridge = _flatter(family, share).nearest(bridge, _GAP, 0.0)
            if bridge is not None and share == 1.0:
                return bridge
            share = min(1.0, _GROWTH * share)
    raise NoBridgeError("no bridge was found at contact")


@lru_cache(maxsize=256)
def _branch(family: _Family) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stable bridges from contact to the largest gap: the arc length s of the family, x and dx/ds.

    Their shapes are (m,), (m, 5) and (m, 5), for m bridges.
    """
    x = _touching(family)
    scale = np.array([1.0, 1.0, max(1.0, abs(float(x[2]))), 1.0, 1.0])
    tangent = family.tangent(x, _GAP, scale)
    step = _ARC_STEP
    arcs = [0.0]
    bridges = [x]
    tangents = [tangent]
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
    if bridge is None:
        return None
    return bridge, family.tangent(bridge, tangent, scale)


def _turning_point(
    family: _Family, x: FloatArray, tangent: FloatArray, step: float, scale: FloatArray
) -> tuple[tuple[FloatArray, FloatArray], float]:
    """The bridge at the largest gap, and the step to it.

    It is less than a given step along the family.
    """

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
    """Capillary force of a bridge of constant volume as a function of the gap.

    Parameters
    ----------
    radius_1, radius_2
        Radii of the solids in any unit of length; infinite for a plane.
    volume
        Volume of the bridge, in the cube of that unit.
    contact_angle
        One for both solids, or one for each, rad.
    gaps
        From 0 to the rupture distance, in the unit of length, shape (n,).

    Returns
    -------
    ForceCurve
        The forces and the shapes of the bridges.

    Raises
    ------
    ValueError
        If a gap is outside this range, or a radius or the volume is not positive.
    NoBridgeError
        If no bridge was found: the contact angle is so large that the liquid is not held between
        the solids.
    """
    family = _family_of((radius_1, radius_2), volume, contact_angle)
    unit = cube_root(volume)
    largest = _largest_gap(family)
    scaled = np.asarray(gaps, np.float64) / unit
    if scaled.min() < 0.0 or scaled.max() > largest * (1.0 + 1e-12):
        raise ValueError(f"gaps: expected 0 to {largest * unit:.6g}, where the bridge ruptures")
    bridges = _stable(family, np.minimum(scaled, largest))
    return ForceCurve(
        unit * family.forces(bridges), bridges[:, :4] * [unit, unit, 1.0 / unit, unit]
    )


def _stable(family: _Family, gaps: FloatArray) -> FloatArray:
    """The stable bridges at n gaps, shape (n, 5)."""
    arcs, branch, tangents = _branch(family)
    gaps_of_branch = branch[:, 4]
    largest_gap = gaps_of_branch[-1]
    last_piece = len(gaps_of_branch) - 2
    pieces = np.clip(np.searchsorted(gaps_of_branch, gaps, side="right") - 1, 0, last_piece)
    cubics = CubicHermiteSpline(arcs, branch, tangents).c[:, pieces]
    starts = arcs[pieces]
    ends = arcs[pieces + 1]

    # Where the interpolated family has the gaps. By rounding, a piece may begin above its gap.
    interpolated_arcs = starts.copy()
    inside = (gaps_of_branch[pieces] < gaps) & (gaps < largest_gap)
    for number in np.flatnonzero(inside):
        interpolated_arcs[number] = _arc_at_gap(
            cubics[:, number, 4].tolist(), starts[number], ends[number], gaps[number]
        )
    interpolated = _cubic(cubics, (interpolated_arcs - starts)[:, None])

    bridges = family.solve(interpolated, _GAP, gaps)
    bridges[gaps >= largest_gap] = branch[-1]
    differences = np.max(np.abs(bridges - interpolated)[:, _POSITIVE], axis=1)
    strayed = ~(differences <= _NEAR) & (gaps < largest_gap)  # also those that are NaN
    for number in np.flatnonzero(strayed):
        chord = branch[pieces[number] + 1] - branch[pieces[number]]
        ends_of_piece = (starts[number], ends[number])
        bridges[number] = _across(family, cubics[:, number], chord, ends_of_piece, gaps[number])

    residuals, _ = family.misfit(bridges)
    gap_errors = np.abs(bridges[:, 4] - gaps)
    errors = np.maximum(gap_errors, np.max(np.abs(residuals), axis=1))
    lost = ~(errors <= _SAME_GAP)
    if lost.any():
        raise NoBridgeError(
            f"no bridge was found at a gap of {gaps[lost][0]:.6g} of the volume's cube root"
        )
    return bridges


def _arc_at_gap(cubic: list[float], start: float, end: float, gap: float) -> float:
    """Arc of the family at which an interpolated gap has a value.

    The gap is a polynomial of degree 3 from ``start`` on.
    """

    def difference(arc: float) -> float:
        return float(_cubic(cubic, arc - start) - gap)

    return float(brentq(difference, start, end))


def _cubic(coefficients: Any, x: Any) -> Any:
    """The polynomials of degree 3 that begin with the first of (4, ...) coefficients."""
    first, second, third, last = coefficients
    return last + third * x + second * (x * x) + first * (x * x * x)


def _across(
    family: _Family, cubic: FloatArray, chord: FloatArray, ends: tuple[float, float], gap: float
) -> FloatArray:
    """The bridge at a gap near the largest one, where it depends strongly on the gap.

    It is sought along the family between the ends of a piece.
    """

    def bridge_at(arc: float) -> FloatArray:
        interpolated: FloatArray = _cubic(cubic, arc - ends[0])
        exact = family.nearest(interpolated, chord, float((chord * interpolated).sum()))
        return interpolated if exact is None else exact

    def excess(arc: float) -> float:
        return float(bridge_at(arc)[4] - gap)

    last = bridge_at(ends[1])
    if last[4] <= gap:
        return last
    return bridge_at(float(brentq(excess, *ends, xtol=1e-12)))


def rupture_distance(
    radius_1: float, radius_2: float, volume: float, contact_angle: float | tuple[float, float]
) -> float:
    """Largest gap at which a bridge of a volume exists.

    Parameters and errors are as for `force_curve`.
    """
    family = _family_of((radius_1, radius_2), volume, contact_angle)
    return cube_root(volume) * _largest_gap(family)


def _largest_gap(family: _Family) -> float:
    """Largest gap of a family of bridges, in units of the volume's cube root."""
    _, bridges, _ = _branch(family)
    return float(bridges[-1, 4])


def volume_at_contact(
    radius_1: float, radius_2: float, contact_angle: float, meniscus_radius: float
) -> float:
    """Volume of a bridge between touching solids by its suction, γ/``meniscus_radius``.

    Parameters
    ----------
    radius_1, radius_2
        Radii of the solids, m; infinite for a plane.
    contact_angle
        Contact angle at both solids, rad.
    meniscus_radius
        In m.

    Returns
    -------
    float
        In m³.

    Raises
    ------
    NoBridgeError
        If bridges as large as half of the smaller sphere have more suction, or bridges as small as
        1e-9 of it have less.
    """
    smaller = min(radius_1, radius_2)
    sphere = 4.0 / 3.0 * pi * smaller**2 * smaller
    smallest = float(logarithm(1e-9 * sphere))
    largest = float(logarithm(0.5 * sphere))

    @cache
    def missing_suction(log_volume: float) -> float:
        """The wanted suction minus that of a bridge, over the wanted one."""
        volume = float(exponential(log_volume))
        bridge = _touching(_family_of((radius_1, radius_2), volume, contact_angle))
        pressure = bridge[2] / cube_root(volume)
        return float(1.0 + pressure * meniscus_radius)

    if not missing_suction(smallest) < 0.0 < missing_suction(largest):
        radius = f"a meniscus radius of {1e6 * meniscus_radius:g} um"
        raise NoBridgeError(f"no bridge between touching surfaces has {radius}")
    return float(exponential(brentq(missing_suction, smallest, largest, xtol=1e-12)))
