"""The implicit steps of `walkers.theory.motion`, compiled (numba): one walker after the other, each while it needs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

FloatArray = npt.NDArray[np.float64]

_NEWTON_STEPS = 30
_TOLERANCE = 1e-8
"""Of the friction forces, in units of 4πγR̄."""
_SLIDING, _PARALLEL, _NORMAL, _MODE = range(4)
"""Rows of a walker's state: sliding velocities, friction forces, normal forces, and 0, ±1: sticking, sliding."""
_RIGHT, _START, _FREE, _NOW = range(3, 7)
"""Rows of what is worked with, after a matrix: right side, velocities that a stage starts from and coasts to; from the
last one on the walker's first seven rows as the bridges' resistance leaves them."""
_FIRST = 1.0 - np.sqrt(0.5)
"""Length of either stage of an L-stable step of second order (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006)."""
_FINER = 8
_TICKS = _FINER**2
"""A step in which a contact begins to stick or to slip is cut into 8, and of these those in which it does into 8."""
_REPEATED = 1e-6
_FAST = 3e-3
"""Mean sliding velocities of two cycles that differ by less than 1 µm/s (of each 3 mm/s) are those of one gait."""


@njit(cache=True)
def integrate(
    walkers: FloatArray, law: FloatArray, drive: FloatArray, cycles: int, steps: int
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_], npt.NDArray[np.bool_], FloatArray]:
    """Walk N walkers from rest.

    Parameters
    ----------
    walkers : ndarray, shape (N, 13, 3)
        Of each: three rows of G times 4πγR̄/M (m/s²), three rows of D, the normal forces at rest; of the bridges'
        resistance to the sliding velocities three rows of how it slows them (1/s), and three of what it adds to the
        normal forces (s/m).
    law : ndarray, shape (N, 4, 3)
        Of each, contact by contact: μk, μs, vs (m/s), κ (s/m).
    drive : ndarray, shape (N, 3)
        Frequency (Hz), peak acceleration and steady acceleration (m/s²).
    cycles, steps
        Cycles at most, and steps of time in each.

    Returns
    -------
    mean : ndarray, shape (3, N)
        Sliding velocities in the mean over the last cycle, m/s.
    least : ndarray, shape (3, N)
        Smallest normal forces in it.
    repeated : ndarray of bool, shape (N,)
        Whether the last two cycles agree; where they do not, means are over the later half of all cycles.
    solved : ndarray of bool, shape (N,)
        Whether friction forces that obey the law were found at every step.
    series : ndarray, shape (N, steps, 3)
        Sliding velocities through the last cycle.
    """
    count = walkers.shape[0]
    means, leasts = np.zeros((3, count)), np.zeros((3, count))
    repeated, solved = np.zeros(count, np.bool_), np.ones(count, np.bool_)
    series = np.zeros((count, steps, 3))
    after, work = np.zeros((4, 3)), np.zeros((_NOW + 7, 3))
    for of in range(count):
        state, totals = np.zeros((4, 3)), np.full((2, 3), np.inf)
        later = np.zeros(3)
        for cycle in range(cycles):
            before = totals[0].copy()
            totals[0], totals[1] = 0.0, np.inf
            for step in range(steps):
                begin, length = step / steps, 1.0 / steps
                if not _advance(walkers[of], law[of], drive[of], begin, length, state, totals, after, work):
                    solved[of] = False
                    break
                series[of, step] = state[_SLIDING]
            if not solved[of]:
                break
            if cycle >= cycles // 2:
                later += totals[0] / (cycles - cycles // 2)
            if np.abs(totals[0] - before).max() < _REPEATED * max(1.0, np.abs(totals[0]).max() / _FAST):
                repeated[of] = True
                break
        means[:, of] = totals[0] if repeated[of] else later
        leasts[:, of] = totals[1]
    return means, leasts, repeated, solved, series


@njit(cache=True)
def _advance(  # noqa: PLR0913, PLR0917
    walker: FloatArray,
    law: FloatArray,
    drive: FloatArray,
    begin: float,
    length: float,
    state: FloatArray,
    totals: FloatArray,
    after: FloatArray,
    work: FloatArray,
) -> bool:
    """One step of time, in shorter ones where a contact begins to stick or to slip; state and totals in place.

    Whether friction forces were found all the way.
    """
    tick, width = 0, _TICKS
    while tick < _TICKS:
        now, part = begin + tick / _TICKS * length, width / _TICKS * length
        start = work[_START]
        for at in range(3):
            start[at] = state[_SLIDING, at]
            after[_SLIDING, at], after[_PARALLEL, at] = state[_SLIDING, at], state[_PARALLEL, at]
        found = _stage(walker, law, drive, now, _FIRST * part, after, work)
        # The second stage starts from where the slope of the first one leads.
        for at in range(3):
            start[at] += (1.0 - _FIRST) / _FIRST * (after[_SLIDING, at] - state[_SLIDING, at])
        found &= _stage(walker, law, drive, now + (1.0 - _FIRST) * part, _FIRST * part, after, work)
        if width > 1 and (not found or _differ(after[_MODE], state[_MODE])):
            width //= _FINER
            continue
        if not found:
            return False
        for at in range(3):
            totals[0, at] += part / 2.0 * (state[_SLIDING, at] + after[_SLIDING, at])
            totals[1, at] = min(totals[1, at], after[_NORMAL, at])
            for row in range(4):
                state[row, at] = after[row, at]
        tick += width
        if width < _TICKS and tick % (width * _FINER) == 0:
            width *= _FINER
    return True


@njit(cache=True)
def _differ(one: FloatArray, other: FloatArray) -> bool:
    return one[0] != other[0] or one[1] != other[1] or one[2] != other[2]


@njit(cache=True)
def _stage(
    walker: FloatArray,
    law: FloatArray,
    drive: FloatArray,
    begin: float,
    length: float,
    state: FloatArray,
    work: FloatArray,
) -> bool:
    """An implicit Euler step of a part of a cycle from the sliding velocities in work; its end replaces the state."""
    seconds = length / drive[0]
    push = seconds * (drive[1] * np.cos(2.0 * np.pi * (begin + length)) + drive[2])
    free, now = work[_FREE], work[_NOW:]
    for at in range(3):
        free[at] = work[_START, at] - (push if at < 2 else 0.0)
    _resist(walker, seconds, work)
    solved = _settle(now, seconds, law, state, work)
    for at in range(3):
        slips = state[_MODE, at] != 0.0
        state[_SLIDING, at] = free[at] - seconds * _row(now, at, state[_PARALLEL]) if slips else 0.0
        state[_NORMAL, at] = now[6, at] + _row(now, 3 + at, state[_PARALLEL])
    return solved


@njit(cache=True)
def _resist(walker: FloatArray, seconds: float, work: FloatArray) -> None:
    """What the bridges' resistance leaves of a stage, implicitly, in place.

    The velocities at its end are (1 + h A) v' = v - h G F∥, and the normal forces F0 + D F∥ + B v'.
    """
    rows, free, now = work[:3], work[_FREE], work[_NOW:]
    for at in range(3):
        for by in range(3):
            rows[at, by] = seconds * walker[7 + at, by]
        rows[at, at] += 1.0
    free[0], free[1], free[2] = _solved(rows, free)
    for by in range(3):
        now[0, by], now[1, by], now[2, by] = _solved(rows, walker[:3, by])
    for at in range(3):
        for by in range(3):
            now[3 + at, by] = walker[3 + at, by] - seconds * _row(walker, 10 + at, now[:3, by])
        now[6, at] = walker[6, at] + _row(walker, 10 + at, free)


@njit(cache=True)
def _settle(walker: FloatArray, seconds: float, law: FloatArray, state: FloatArray, work: FloatArray) -> bool:
    """Find the friction forces and modes at the end of a stage, in place, by a semi-smooth Newton method.

    Whether they were found.

    A contact sticks if the force that would hold it is within the limit, else it slips (Alart and Curnier, Comput.
    Methods Appl. Mech. Eng. 92 (1991) 353).
    """
    parallel, rows, right, free = state[_PARALLEL], work[:3], work[_RIGHT], work[_FREE]
    for _ in range(_NEWTON_STEPS):
        for at in range(3):
            normal = max(walker[6, at] + _row(walker, 3 + at, parallel), 0.0)
            speed = free[at] - seconds * _row(walker, at, parallel)
            own = seconds * walker[at, at]
            wanted = parallel[at] + speed / own
            if abs(wanted) <= normal * law[1, at]:
                state[_MODE, at] = 0.0
                for by in range(3):
                    rows[at, by] = walker[at, by] / walker[at, at]
                right[at] = speed / own
            else:
                side = np.sign(wanted)
                state[_MODE, at] = side
                fade = law[1, at] - law[0, at]
                if fade != 0.0:
                    fade *= np.exp(-((speed / law[2, at]) ** 2))
                kinetic = law[0, at] + fade
                drag = normal * law[3, at]
                slope = side * kinetic + law[3, at] * speed
                # How the force at a normal force falls with the speed, after Stribeck, and grows with it by κ.
                steep = drag - 2.0 * side * normal * fade * speed / law[2, at] ** 2
                for by in range(3):
                    rows[at, by] = steep * seconds * walker[at, by] - slope * walker[3 + at, by]
                rows[at, at] += 1.0
                right[at] = side * kinetic * normal + drag * speed - parallel[at]
        change = _solved(rows, right)
        for at in range(3):
            parallel[at] += change[at]
        if max(abs(change[0]), abs(change[1]), abs(change[2])) < _TOLERANCE:
            return True
    return False


@njit(cache=True)
def _row(matrix: FloatArray, at: int, vector: FloatArray) -> float:
    """One row of a matrix times a vector."""
    return matrix[at, 0] * vector[0] + matrix[at, 1] * vector[1] + matrix[at, 2] * vector[2]


@njit(cache=True)
def _solved(rows: FloatArray, right: FloatArray) -> tuple[float, float, float]:
    """The solution of three linear equations, by Cramer's rule."""
    a, b, c = rows[0, 0], rows[0, 1], rows[0, 2]
    d, e, f = rows[1, 0], rows[1, 1], rows[1, 2]
    g, h, i = rows[2, 0], rows[2, 1], rows[2, 2]
    x, y, z = right[0], right[1], right[2]
    ei, di, dh = e * i - f * h, d * i - f * g, d * h - e * g
    yi, yh, dz, zg = y * i - f * z, y * h - e * z, d * z, y * g
    determinant = a * ei - b * di + c * dh
    return (
        (x * ei - b * yi + c * yh) / determinant,
        (a * yi - x * di + c * (dz - zg)) / determinant,
        (-a * yh - b * (dz - zg) + x * dh) / determinant,
    )
