"""The implicit time steps of `walkers.theory.motion`, compiled by numba; walkers are integrated one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

from walkers.arrays import BoolArray, FloatArray

Three = tuple[float, float, float]
Effect = Callable[
    [Three, FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]
]

FINER, LEVELS = 8, 3
"""A step in which a contact begins to stick or to slip is divided into 8 parts, and such a part into 8 again."""
STAGE = 1.0 - np.sqrt(0.5)
"""Length of each stage of an L-stable step of second order (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006)."""
_NEWTON_STEPS = 30
_TOLERANCE = 1e-8
"""Tolerance of the friction forces, in units of 4πγR̄."""
_SLIDING, _PARALLEL, _NORMAL, _MODE = range(4)
"""Rows of a walker's state: sliding velocities, friction forces, normal forces, and modes (0: sticks, ±1: slides). The
work array contains such a state, then a matrix and a right side."""
_COAST, _GAIN, _PRESS, _LIFT, _REST = 0, 3, 6, 9, 12
"""First rows of the matrices of a walker's table."""
_REPEATED = 1e-6
_FAST = 3e-3
"""m/s. Cycles repeat if their mean sliding velocities differ by less than 1 µm/s, or at higher speeds by 1 µm/s per
3 mm/s."""
_SCATTER = 10.0
"""Error of the steps, as a multiple of that difference: cycles of one gait may differ by it; their mean is used."""


@njit(cache=True)
def integrate(
    tables: FloatArray,
    mu: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    terms: FloatArray,
    cycles: int,
    steps: int,
) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, FloatArray]:
    """Walk N walkers from rest; see `walkers.theory.motion.predict_motion`.

    ``tables`` (N, 3, 13, 3) have for stages (of h seconds) of a step, of an 8th and of a 64th of it: velocities v0
    become P v0 - h G F∥, normal forces are F0 + B P v0 + D F∥; three rows of P, G (m/s²), D and B (s/m), and F0.
    ``mu`` (N, 3) is Coulomb's coefficient of each contact; ``drive`` (N, 3) has frequency (Hz), peak acceleration and
    steady acceleration (m/s²).

    Returns mean sliding velocities (m/s) and smallest normal forces over the last cycle, of shape (3, N); whether the
    last two cycles agree, or all cycles of the second half within the error of the steps (then means are over that
    half); whether friction forces that obey the law were found at every step; and the sliding velocities through the
    last cycle, shape (N, steps, 3).
    """
    count = len(drive)
    means, leasts = np.zeros((3, count)), np.zeros((3, count))
    repeated, solved = np.zeros(count, np.bool_), np.ones(count, np.bool_)
    series, work = np.zeros((count, steps, 3)), np.zeros((8, 3))
    for walker in range(count):
        state, totals = np.zeros((4, 3)), np.full((2, 3), np.inf)
        same, later, low, high = 0.0, np.zeros(3), np.full(3, np.inf), np.full(3, -np.inf)
        for cycle in range(cycles):
            before = totals[0].copy()
            totals[0], totals[1] = 0.0, np.inf
            for step in range(steps):
                of_walker = (tables[walker], mu[walker], drive[walker], effect, terms[walker])
                if not _advance(*of_walker, step / steps, 1.0 / steps, 0, state, totals, work):
                    solved[walker] = False
                    break
                series[walker, step] = state[_SLIDING]
            if not solved[walker]:
                break
            if cycle >= cycles // 2:
                later += totals[0] / (cycles - cycles // 2)
                for mean in (before, totals[0]):
                    low, high = np.minimum(low, mean), np.maximum(high, mean)
            same = _REPEATED * max(1.0, np.abs(totals[0]).max() / _FAST)
            if np.abs(totals[0] - before).max() < same:
                repeated[walker] = True
                break
        means[:, walker] = totals[0] if repeated[walker] else later
        repeated[walker] |= solved[walker] and (high - low).max() < _SCATTER * same
        leasts[:, walker] = totals[1]
    return means, leasts, repeated, solved, series


@njit(cache=True)
def _advance(  # noqa: PLR0913, PLR0917
    tables: FloatArray,
    mu: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    terms: FloatArray,
    begin: float,
    length: float,
    level: int,
    state: FloatArray,
    totals: FloatArray,
    work: FloatArray,
) -> bool:
    """One time step, divided where a contact begins to stick or to slip; changes state and totals in place.

    Times are parts of a cycle. Returns whether friction forces were found at every stage.
    """
    after, start = work[:4], (state[0, 0], state[0, 1], state[0, 2])
    after[:] = state
    solved = _stage(
        tables[level], mu, drive, effect, terms, begin + STAGE * length, STAGE * length, start, work
    )
    # The second stage starts from where the slope of the first one leads.
    start = _less(
        start, 1.0 - 1.0 / STAGE, _less((after[0, 0], after[0, 1], after[0, 2]), 1.0, start)
    )
    solved &= _stage(
        tables[level], mu, drive, effect, terms, begin + length, STAGE * length, start, work
    )
    if level < LEVELS - 1 and (not solved or (after[_MODE] != state[_MODE]).any()):
        part = length / FINER
        for number in range(FINER):
            now = begin + number * part
            if not _advance(
                tables, mu, drive, effect, terms, now, part, level + 1, state, totals, work
            ):
                return False
        return True
    if solved:
        for contact in range(3):
            totals[0, contact] += (
                length / 2.0 * (state[_SLIDING, contact] + after[_SLIDING, contact])
            )
            totals[1, contact] = min(totals[1, contact], after[_NORMAL, contact])
        state[:] = after
    return solved


@njit(cache=True)
def _stage(  # noqa: PLR0913, PLR0917
    table: FloatArray,
    mu: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    terms: FloatArray,
    end: float,
    length: float,
    start: Three,
    work: FloatArray,
) -> bool:
    """An implicit Euler step from the velocities ``start``, in place; returns whether forces were found."""
    seconds, state = length / drive[0], work[:4]
    push = seconds * (drive[1] * np.cos(2.0 * np.pi * end) + drive[2])
    free = _times(table, _COAST, (start[0] - push, start[1] - push, start[2]))
    if effect is not None:
        mu, forces, couples = effect(start, state[_NORMAL], mu, terms)
        free = _less(free, seconds, _times(table, _GAIN, couples))
    x, y, z = _times(table, _LIFT, free)
    rest = (table[_REST, 0] + x, table[_REST, 1] + y, table[_REST, 2] + z)
    if effect is not None:
        rest = _less(rest, -1.0, _times(table, _PRESS, forces))
        free = _less(free, seconds, _times(table, _GAIN, forces))
    solved = _settle(table, mu, seconds, free, rest, work)
    for contact in range(3):
        slips = state[_MODE, contact] != 0.0
        state[_SLIDING, contact] = (
            free[contact] - seconds * _row(table, _GAIN + contact, state[_PARALLEL])
            if slips
            else 0.0
        )
        state[_NORMAL, contact] = rest[contact] + _row(table, _PRESS + contact, state[_PARALLEL])
    return solved


@njit(cache=True)
def _settle(
    table: FloatArray, mu: FloatArray, seconds: float, free: Three, rest: Three, work: FloatArray
) -> bool:
    """Find the friction forces and modes at the end of a stage, in place, by a semi-smooth Newton method.

    A contact sticks if the force that holds it is within the limit, else it slips (Alart and Curnier, Comput. Methods
    Appl. Mech. Eng. 92 (1991) 353). Returns whether they were found.
    """
    modes, parallel, rows, right = work[_MODE], work[_PARALLEL], work[4:7], work[7]
    for _ in range(_NEWTON_STEPS):
        for contact in range(3):
            normal = max(rest[contact] + _row(table, _PRESS + contact, parallel), 0.0)
            speed = free[contact] - seconds * _row(table, _GAIN + contact, parallel)
            scale = seconds * table[_GAIN + contact, contact]
            trial = parallel[contact] + speed / scale
            if abs(trial) <= normal * mu[contact]:
                modes[contact] = 0.0
                for column in range(3):
                    rows[contact, column] = (
                        table[_GAIN + contact, column] / table[_GAIN + contact, contact]
                    )
                right[contact] = speed / scale
                continue
            modes[contact] = np.sign(trial)
            slope = modes[contact] * mu[contact]
            for column in range(3):
                rows[contact, column] = -slope * table[_PRESS + contact, column]
            rows[contact, contact] += 1.0
            right[contact] = slope * normal - parallel[contact]
        change = _solved(rows, right)
        for contact in range(3):
            parallel[contact] += change[contact]
        if max(abs(change[0]), abs(change[1]), abs(change[2])) < _TOLERANCE:
            return True
    return False


@njit(cache=True)
def _less(vector: Three, factor: float, change: Three) -> Three:
    return (
        vector[0] - factor * change[0],
        vector[1] - factor * change[1],
        vector[2] - factor * change[2],
    )


@njit(cache=True)
def _times(table: FloatArray, first: int, vector: FloatArray | Three) -> Three:
    """A matrix of a table, from its first row on, times a vector."""
    return (
        _row(table, first, vector),
        _row(table, first + 1, vector),
        _row(table, first + 2, vector),
    )


@njit(cache=True)
def _row(matrix: FloatArray, row: int, vector: FloatArray | Three) -> float:
    """One row of a matrix times a vector."""
    return matrix[row, 0] * vector[0] + matrix[row, 1] * vector[1] + matrix[row, 2] * vector[2]


@njit(cache=True)
def _solved(rows: FloatArray, right: FloatArray) -> Three:
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
