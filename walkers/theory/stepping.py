"""The implicit time steps of `walkers.theory.motion`, compiled by numba.

Walkers are integrated one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numba import cfunc, float64, njit, types

from walkers.arrays import BoolArray, FloatArray
from walkers.physics.edges import SLOWEST

PerContact = tuple[float, float, float]
"""A value for each of the three contacts."""
Effect = Callable[
    [PerContact, FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]
]
"""A further force law, as `walkers.theory.motion.predict_motion` describes it."""

_VECTOR = types.Array(float64, 1, "C")
_MATRIX = types.Array(float64, 2, "C")
_RESULTS = types.Tuple((_MATRIX, _VECTOR, _VECTOR))  # type: ignore[no-untyped-call]
_OF_EFFECT = _RESULTS(types.UniTuple(float64, 3), _VECTOR, _MATRIX, _VECTOR)  # type: ignore[no-untyped-call]
"""Types of the results and arguments of an `Effect`."""

FINER = 8
"""Number of parts into which a step is divided in which a contact begins to stick or to slip."""
LEVELS = 3
"""Number of lengths of steps: whole steps, their parts, and the parts of these."""
STAGE = 1.0 - np.sqrt(0.5)
"""Length of each stage of an L-stable step of second order, as a part of the step.

Alexander, SIAM J. Numer. Anal. 14 (1977) 1006.
"""
_NEWTON_STEPS = 30
"""Largest number of Newton steps of a stage."""
_TOLERANCE = 1e-8
"""Tolerance of the friction forces, in units of 4πγR̄."""
_SLIDING, _PARALLEL, _NORMAL, _MODE = range(4)
"""Rows of a walker's state: sliding velocities, friction forces, normal forces, and modes.

The mode is 0 for a contact that sticks, and the sign of the sliding of others. The work array
contains such a state, then a matrix (three rows) and a right side.
"""
_COAST = 0
"""First row of the matrix P in a walker's table."""
_GAIN = 3
"""First row of G."""
_PRESS = 6
"""First row of D."""
_LIFT = 9
"""First row of B."""
_REST = 12
"""Row of F0."""
_REPEATED = 1e-6
"""Difference of the mean sliding velocities of two cycles below which cycles repeat, m/s."""
_FAST = 3e-3
"""Velocity above which the allowed difference grows in proportion to the velocity, m/s."""
_SCATTER = 10.0
"""Error of the steps, as a multiple of that difference.

The cycles of one gait may differ by it; then their mean is used.
"""


@njit(cache=True)
def integrate(  # noqa: PLR0913, PLR0917
    tables: FloatArray,
    friction: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    parameters: FloatArray,
    cycles: int,
    steps: int,
) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, FloatArray]:
    """Integrate N walkers from rest; see `walkers.theory.motion.predict_motion`.

    Parameters
    ----------
    tables
        Shape (N, 3, 13, 3): for the stages (of h seconds) of a step, of an 8th and of a 64th of it,
        three rows each of P, G (m/s²), D and B (s/m), and a row F0. In a stage, velocities v0
        become P v0 - h G F∥, and normal forces are F0 + B P v0 + D F∥.
    friction
        Friction of each contact, shape (N, 3, 3): the coefficient at rest, its rise, and the
        sliding velocity of half of the rise (m/s).
    drive
        Frequency (Hz), peak acceleration and steady acceleration (m/s²), shape (N, 3).
    effect
        A further force law, or None.
    parameters
        The K parameters of that law for each walker, shape (N, K).
    cycles
        Largest number of cycles.
    steps
        Number of steps per cycle.

    Returns
    -------
    means : numpy.ndarray
        Mean sliding velocities over the last cycle, m/s, shape (3, N); over the second half of the
        cycles if the last two do not agree.
    smallest : numpy.ndarray
        Smallest normal forces over the last cycle, shape (3, N), in units of 4πγR̄.
    repeated : numpy.ndarray
        Whether the last two cycles agree, or all cycles of the second half within the error of the
        steps, shape (N,).
    solved : numpy.ndarray
        Whether friction forces that obey the law were found at every step, shape (N,).
    series : numpy.ndarray
        Sliding velocities at the end of each step of the last cycle, m/s, shape (N, steps, 3).
    """
    count = len(drive)
    means = np.zeros((3, count))
    smallest = np.zeros((3, count))
    repeated = np.zeros(count, np.bool_)
    solved = np.ones(count, np.bool_)
    series = np.zeros((count, steps, 3))
    work = np.zeros((8, 3))
    first_later_cycle = cycles // 2
    # For a literal 0, numba compiles a version that its cache cannot load.
    whole_step = int(np.int64(0))
    for walker in range(count):
        state = np.zeros((4, 3))
        totals = np.full((2, 3), np.inf)  # mean sliding velocities, smallest normal forces
        tolerance = 0.0
        later_mean = np.zeros(3)
        lowest_mean = np.full(3, np.inf)
        highest_mean = np.full(3, -np.inf)
        for cycle in range(cycles):
            before = totals[0].copy()
            totals[0] = 0.0
            totals[1] = np.inf
            for step in range(steps):
                if not _advance(
                    tables[walker],
                    friction[walker],
                    drive[walker],
                    effect,
                    parameters[walker],
                    step / steps,
                    1.0 / steps,
                    whole_step,
                    state,
                    totals,
                    work,
                ):
                    solved[walker] = False
                    break
                series[walker, step] = state[_SLIDING]
            if not solved[walker]:
                break
            if cycle >= first_later_cycle:
                later_mean += totals[0] / (cycles - first_later_cycle)
                for mean in (before, totals[0]):
                    lowest_mean = np.minimum(lowest_mean, mean)
                    highest_mean = np.maximum(highest_mean, mean)
            tolerance = _REPEATED * max(1.0, np.abs(totals[0]).max() / _FAST)
            if np.abs(totals[0] - before).max() < tolerance:
                repeated[walker] = True
                break
        if repeated[walker]:
            means[:, walker] = totals[0]
        else:
            means[:, walker] = later_mean
            scatter = (highest_mean - lowest_mean).max()
            repeated[walker] = solved[walker] and scatter < _SCATTER * tolerance
        smallest[:, walker] = totals[1]
    return means, smallest, repeated, solved, series


@cache
def compiled_effect(effect: Effect) -> Effect:
    """Compile a force law so that `integrate` depends on its types alone.

    With the function itself, numba would compile `integrate` anew in each process; and its cache
    would name the module of the function, and could not be loaded where that module is missing.
    """
    # What `njit` returns, such as `edge_forces`, has its Python function as `py_func`: `cfunc`
    # compiles nothing else.
    function = getattr(effect, "py_func", effect)
    is_ours = effect is edge_forces
    compiled: Effect = cfunc(_OF_EFFECT, cache=is_ours)(function)
    return compiled


@njit(cache=True)
def edge_forces(
    sliding: PerContact, _normal: FloatArray, friction: FloatArray, edges: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The forces of edges of menisci that move, as an `Effect` (`walkers.physics.edges`).

    ``edges`` has the resistances E of the three bridges in 4πγR̄, then R1 and R2 (m).

    The edges of the bridge of a bead to the substrate move with the velocity V of the walker on the
    substrate, and with the velocity -R dφ/dt of its surface on the bead. Those of the bridge
    between the beads move with the latter on both beads; their forces f and couples m at that
    contact conserve the angular momentum of the two.
    """
    forces = np.zeros(3)
    couples = np.zeros(3)
    velocity = 0.5 * (sliding[0] + sliding[1] - sliding[2])
    of_walker = _two_thirds(velocity)
    of_first = _two_thirds(sliding[0] - velocity)  # at R1 dφ1/dt
    of_second = _two_thirds(sliding[1] - velocity)
    for bead in range(2):
        forces[bead] = edges[bead] * of_walker
        turned = of_first if bead == 0 else of_second
        # The couple over R, on q = (v - V)/R: its parts act on v and on V = (v1 + v2 - v3)/2.
        couple = edges[bead] * (turned - of_walker)
        couples[bead] += couple
        _add_to_velocity(couples, -couple)
    first_share = edges[3] / (edges[3] + edges[4])
    second_share = 1.0 - first_share
    forces[2] = edges[2] * (first_share * of_first + second_share * of_second)
    couple = edges[2] * (of_first - of_second)  # over R1 R2/(R1 + R2), on q3 = q1 - q2
    couples[0] += second_share * couple
    couples[1] -= first_share * couple
    _add_to_velocity(couples, (first_share - second_share) * couple)
    return friction, forces, couples


@njit(cache=True)
def _add_to_velocity(couples: FloatArray, force: float) -> None:
    """Add a force on the velocity of the walker, (v1 + v2 - v3)/2, to those on v1, v2 and v3."""
    couples[0] += 0.5 * force
    couples[1] += 0.5 * force
    couples[2] -= 0.5 * force


@njit(cache=True)
def _two_thirds(velocity: float) -> float:
    """The power 2/3 of a velocity (m/s), with its sign; it is linear at the lowest velocities."""
    return float(velocity * (velocity**2 + SLOWEST**2) ** (-1.0 / 6.0))


@njit(cache=True)
def _advance(  # noqa: PLR0913, PLR0917
    tables: FloatArray,
    friction: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    parameters: FloatArray,
    start: float,
    length: float,
    level: int,
    state: FloatArray,
    totals: FloatArray,
    work: FloatArray,
) -> bool:
    """One time step, divided where a contact begins to stick or to slip.

    State and totals change in place.

    Times are parts of a cycle. Returns whether friction forces were found at every stage.
    """
    table = tables[level]
    stage = STAGE * length
    after = work[:4]
    velocity = (state[0, 0], state[0, 1], state[0, 2])
    after[:] = state
    solved = _stage(
        table, friction, drive, effect, parameters, start + stage, stage, velocity, work
    )
    # The second stage starts from where the slope of the first one leads.
    change = _less((after[0, 0], after[0, 1], after[0, 2]), 1.0, velocity)
    velocity = _less(velocity, 1.0 - 1.0 / STAGE, change)
    solved &= _stage(
        table, friction, drive, effect, parameters, start + length, stage, velocity, work
    )
    if level < LEVELS - 1 and (not solved or (after[_MODE] != state[_MODE]).any()):
        part = length / FINER
        for number in range(FINER):
            if not _advance(
                tables,
                friction,
                drive,
                effect,
                parameters,
                start + number * part,
                part,
                level + 1,
                state,
                totals,
                work,
            ):
                return False
        return True
    if solved:
        for contact in range(3):
            mean = state[_SLIDING, contact] + after[_SLIDING, contact]
            totals[0, contact] += length / 2.0 * mean
            totals[1, contact] = min(totals[1, contact], after[_NORMAL, contact])
        state[:] = after
    return solved


@njit(cache=True)
def _stage(  # noqa: PLR0913, PLR0917
    table: FloatArray,
    friction: FloatArray,
    drive: FloatArray,
    effect: Effect | None,
    parameters: FloatArray,
    end: float,
    length: float,
    velocity: PerContact,
    work: FloatArray,
) -> bool:
    """An implicit Euler step from sliding velocities to the end of a stage, in place.

    Times are parts of a cycle. Returns whether friction forces were found.
    """
    seconds = length / drive[0]
    state = work[:4]
    push = seconds * (drive[1] * np.cos(2.0 * np.pi * end) + drive[2])
    free = _times(table, _COAST, (velocity[0] - push, velocity[1] - push, velocity[2]))
    if effect is not None:
        friction, forces, couples = effect(velocity, state[_NORMAL], friction, parameters)
        free = _less(free, seconds, _times(table, _GAIN, couples))
    x, y, z = _times(table, _LIFT, free)
    rest = (table[_REST, 0] + x, table[_REST, 1] + y, table[_REST, 2] + z)
    if effect is not None:
        rest = _less(rest, -1.0, _times(table, _PRESS, forces))
        free = _less(free, seconds, _times(table, _GAIN, forces))
    solved = _settle(table, friction, seconds, free, rest, work)
    for contact in range(3):
        if state[_MODE, contact] == 0.0:
            state[_SLIDING, contact] = 0.0
        else:
            slowing = _row(table, _GAIN + contact, state[_PARALLEL])
            state[_SLIDING, contact] = free[contact] - seconds * slowing
        state[_NORMAL, contact] = rest[contact] + _row(table, _PRESS + contact, state[_PARALLEL])
    return solved


@njit(cache=True)
def _settle(  # noqa: PLR0913, PLR0917
    table: FloatArray,
    friction: FloatArray,
    seconds: float,
    free: PerContact,
    rest: PerContact,
    work: FloatArray,
) -> bool:
    """Find the friction forces and modes at the end of a stage, in place.

    The method is a semi-smooth Newton method.

    ``free`` and ``rest`` are the sliding velocities and normal forces without friction. A contact
    sticks if the force that keeps it at rest is within the limit, else it slips (Alart and Curnier,
    Comput. Methods Appl. Mech. Eng. 92 (1991) 353). Returns whether they were found.
    """
    modes = work[_MODE]
    parallel = work[_PARALLEL]
    rows = work[4:7]
    right = work[7]
    for _ in range(_NEWTON_STEPS):
        for contact in range(3):
            normal = max(rest[contact] + _row(table, _PRESS + contact, parallel), 0.0)
            speed = free[contact] - seconds * _row(table, _GAIN + contact, parallel)
            scale = seconds * table[_GAIN + contact, contact]
            trial = parallel[contact] + speed / scale
            at_rest = friction[contact, 0]
            if abs(trial) <= normal * at_rest:
                modes[contact] = 0.0
                for column in range(3):
                    rows[contact, column] = (
                        table[_GAIN + contact, column] / table[_GAIN + contact, contact]
                    )
                right[contact] = speed / scale
                continue
            modes[contact] = np.sign(trial)
            rise = friction[contact, 1]
            half_rise_velocity = friction[contact, 2]
            # An iterate may slide the wrong way: it then has the friction at rest.
            sliding = max(modes[contact] * speed, 0.0)
            coefficient = at_rest + rise * sliding / (sliding + half_rise_velocity)
            growth = rise * half_rise_velocity / (sliding + half_rise_velocity) ** 2
            slope = modes[contact] * coefficient
            resistance = seconds * growth * normal
            for column in range(3):
                rows[contact, column] = (
                    resistance * table[_GAIN + contact, column]
                    - slope * table[_PRESS + contact, column]
                )
            rows[contact, contact] += 1.0
            right[contact] = slope * normal - parallel[contact]
        change = _solved(rows, right)
        for contact in range(3):
            parallel[contact] += change[contact]
        if max(abs(change[0]), abs(change[1]), abs(change[2])) < _TOLERANCE:
            return True
    return False


@njit(cache=True)
def _less(vector: PerContact, factor: float, change: PerContact) -> PerContact:
    """A vector minus a multiple of another one."""
    return (
        vector[0] - factor * change[0],
        vector[1] - factor * change[1],
        vector[2] - factor * change[2],
    )


@njit(cache=True)
def _times(table: FloatArray, first: int, vector: FloatArray | PerContact) -> PerContact:
    """A matrix of a table, from its first row on, times a vector."""
    return (
        _row(table, first, vector),
        _row(table, first + 1, vector),
        _row(table, first + 2, vector),
    )


@njit(cache=True)
def _row(matrix: FloatArray, row: int, vector: FloatArray | PerContact) -> float:
    """One row of a matrix times a vector."""
    return matrix[row, 0] * vector[0] + matrix[row, 1] * vector[1] + matrix[row, 2] * vector[2]


@njit(cache=True)
def _solved(rows: FloatArray, right: FloatArray) -> PerContact:
    """The solution of three linear equations, by Cramer's rule."""
    a, b, c = rows[0, 0], rows[0, 1], rows[0, 2]
    d, e, f = rows[1, 0], rows[1, 1], rows[1, 2]
    g, h, i = rows[2, 0], rows[2, 1], rows[2, 2]
    x, y, z = right[0], right[1], right[2]
    ei = e * i - f * h
    di = d * i - f * g
    dh = d * h - e * g
    yi = y * i - f * z
    yh = y * h - e * z
    dz = d * z
    zg = y * g
    determinant = a * ei - b * di + c * dh
    return (
        (x * ei - b * yi + c * yh) / determinant,
        (a * yi - x * di + c * (dz - zg)) / determinant,
        (-a * yh - b * (dz - zg) + x * dh) / determinant,
    )
