"""The equations of motion of a walker that stays in contact, integrated in time under any law of friction.

    M dv/dt = -M a(t) (1, 1, 0) - G F∥,    F = F0 + D F∥,    F∥ = law(v, F)

(symbols as in `theory.quasistatic`). Coulomb's law is set-valued: a contact that sticks is held by whatever force
keeps it at rest. Each step is implicit, its friction forces found by a semi-smooth Newton method, so that sticking
needs no regularisation and the step may be as long as a hundredth of a cycle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from inputs.case import WalkerCase
from inputs.dimer import Dimer, contact_loads, dimer_of
from theory.friction import Friction
from theory.quasistatic import forces_at_rest, inertia_matrix, normal_force_matrix

FloatArray = npt.NDArray[np.float64]

STEPS_PER_CYCLE = 400
CYCLES = 60
_REPEATED = 1e-6
_NEWTON_STEPS = 30
_TOLERANCE = 1e-8
_EACH = np.arange(3)


@dataclass(frozen=True)
class Walker:
    """N walkers, each array of shape (N,) unless said otherwise.

    Attributes
    ----------
    sin_delta, asymmetry
        sin δ and μ.
    scale
        4πγR̄/M, m/s²: the acceleration that a force of 1 in the theory's unit gives.
    force_unit
        4πγR̄, N.
    at_rest : ndarray, shape (3, N)
        Normal forces at rest, in that unit.
    """

    sin_delta: FloatArray
    asymmetry: FloatArray
    scale: FloatArray
    force_unit: FloatArray
    at_rest: FloatArray

    @classmethod
    def of_dimer(cls, dimer: Dimer, gravity: float = 0.0) -> Walker:
        """The paper's walker: perfect wetting; on a substrate that gravity (m/s²) presses it to."""
        weights = np.array([*dimer.masses, 0.0]) * gravity / dimer.capillary_scale
        return cls(
            sin_delta=np.array([dimer.sin_delta]),
            asymmetry=np.array([dimer.mass_asymmetry]),
            scale=np.array([dimer.capillary_scale / dimer.total_mass]),
            force_unit=np.array([dimer.capillary_scale]),
            at_rest=(forces_at_rest(dimer.sin_delta) + weights)[:, None],
        )

    @classmethod
    def of_case(cls, case: WalkerCase) -> Walker:
        """A case's walker with the capillary forces that its bridges have in the engine, and its weight."""
        dimer = dimer_of(case)
        forces = np.array(contact_loads(case).capillary) + np.array([*dimer.masses, 0.0]) * case.gravity
        return replace(cls.of_dimer(dimer), at_rest=(forces / dimer.capillary_scale)[:, None])


@dataclass(frozen=True)
class Motion:
    """Means over the last cycle of N walkers, m/s.

    Attributes
    ----------
    velocity : ndarray, shape (N,)
        Of the walker, positive toward the large bead; NaN where a contact opened, for there the model does not hold.
    rotation : ndarray, shape (2, N)
        Rotation velocities -R dφ/dt of the beads.
    sliding : ndarray, shape (3, N)
        Sliding velocities at the contacts.
    smallest_normal_force : ndarray, shape (3, N)
        Of each contact through the last cycle, in units of 4πγR̄; below zero it would have opened.
    periodic : ndarray of bool, shape (N,)
        Whether the last two cycles agree within 1 µm/s.
    """

    velocity: FloatArray
    rotation: FloatArray
    sliding: FloatArray
    smallest_normal_force: FloatArray
    periodic: npt.NDArray[np.bool_]

    @property
    def opened(self) -> npt.NDArray[np.bool_]:
        """Whether a contact would have opened, shape (N,)."""
        return self.smallest_normal_force.min(axis=0) <= 0.0  # type: ignore[no-any-return]


def walk(
    walker: Walker,
    friction: Friction,
    frequency: npt.ArrayLike,
    peak_acceleration: npt.ArrayLike,
    *,
    steady_acceleration: npt.ArrayLike = 0.0,
    cycles: int = CYCLES,
    steps_per_cycle: int = STEPS_PER_CYCLE,
) -> Motion:
    """Integrate from rest under the substrate's acceleration a0 cos 2πft and average over the last cycle.

    Parameters
    ----------
    walker, friction
        N walkers and their contacts.
    frequency, peak_acceleration
        f in Hz and a0 in m/s², each a number or of shape (N,).
    steady_acceleration
        A pull along the axis toward the small bead, m/s²: the weight of a walker that climbs with its large bead above.
    cycles
        Of the drive, at most; fewer if all gaits repeat themselves sooner.
    steps_per_cycle
        Steps of time.

    Returns
    -------
    Motion
    """
    f, a0, pull, _ = np.broadcast_arrays(
        *(np.asarray(value, np.float64) for value in (frequency, peak_acceleration, steady_acceleration, walker.scale))
    )
    solver = _Solver(walker, friction, 1.0 / (f.reshape(-1) * steps_per_cycle), a0.size)
    drive = [
        a0.reshape(-1) * np.cos(2.0 * np.pi * step / steps_per_cycle) + pull.reshape(-1)
        for step in range(1, steps_per_cycle + 1)
    ]
    sliding, parallel = np.zeros((3, a0.size)), np.zeros((3, a0.size))
    mean = np.full((3, a0.size), np.inf)
    for _ in range(cycles):
        before, total, least = mean, np.zeros_like(sliding), np.full_like(sliding, np.inf)
        for substrate in drive:
            sliding, parallel, normal = solver.step(sliding, parallel, substrate)
            total += sliding
            np.minimum(least, normal, out=least)
        mean = total / steps_per_cycle
        periodic = (np.abs(mean - before) < _REPEATED).all(axis=0)
        if periodic.all():
            break
    velocity = (mean[0] + mean[1] - mean[2]) / 2.0
    opened = (least <= 0.0).any(axis=0)
    return Motion(np.where(opened, np.nan, velocity), velocity - mean[:2], mean, least, periodic)


class _Solver:
    """One implicit step of N walkers."""

    def __init__(self, walker: Walker, friction: Friction, seconds: FloatArray, count: int) -> None:
        def wide(values: npt.ArrayLike) -> FloatArray:
            return np.ascontiguousarray(np.broadcast_to(np.asarray(values, np.float64), (3, count)))

        asymmetry = np.broadcast_to(walker.asymmetry, (count,))
        gains = np.moveaxis(inertia_matrix(asymmetry), 0, -1)
        self.gains = np.ascontiguousarray(gains * (walker.scale * seconds))
        matrix = normal_force_matrix(np.broadcast_to(walker.sin_delta, (count,)), asymmetry)
        self.matrix = np.ascontiguousarray(np.moveaxis(matrix, 0, -1))
        self.seconds = seconds
        self.rest = wide(walker.at_rest)
        self.kinetic = wide(friction.kinetic)
        self.static = wide(friction.kinetic if friction.static is None else friction.static)
        self.stribeck = friction.stribeck_velocity
        self.has_stribeck = friction.static is not None
        self.linear = wide(friction.linear)
        self.viscous = wide(np.asarray(friction.viscous, np.float64) / walker.force_unit)

    def step(
        self, sliding: FloatArray, parallel: FloatArray, substrate: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sliding velocities, friction forces and normal forces at the end of a step, each of shape (3, N)."""
        free = sliding.copy()
        free[:2] -= self.seconds * substrate
        parallel = parallel.copy()
        left = np.arange(parallel.shape[1])
        for _ in range(_NEWTON_STEPS):
            parallel[:, left], done = self._improved(left, free[:, left], parallel[:, left], sliding[:, left])
            left = left[~done]
            if not len(left):
                break
        normal = self.rest + _product(self.matrix, parallel)
        return free - _product(self.gains, parallel), parallel, normal

    def _improved(
        self, of: npt.NDArray[np.int64], free: FloatArray, parallel: FloatArray, sliding: FloatArray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """A Newton step of some walkers toward forces that obey the law, and whether these do already.

        A contact sticks if the force that would hold it is within the limit, else it slips (Alart and Curnier, Comput.
        Methods Appl. Mech. Eng. 92 (1991) 353).
        """
        gains, matrix = self.gains[..., of], self.matrix[..., of]
        normal = np.maximum(self.rest[:, of] + _product(matrix, parallel), 0.0)
        speed = free - _product(gains, parallel)
        wanted = parallel + speed / gains[_EACH, _EACH]
        coefficient = self.kinetic[:, of]
        limit = normal * self.static[:, of]
        if self.has_stribeck:
            fade = np.exp(-((sliding / self.stribeck) ** 2))
            coefficient = coefficient + (self.static[:, of] - coefficient) * fade
        sticks, side = np.abs(wanted) <= limit, np.sign(wanted)
        drag = normal * self.linear[:, of] + self.viscous[:, of]
        slips = parallel - side * coefficient * normal - drag * speed
        slope = -(side * coefficient + self.linear[:, of] * speed)[:, None] * matrix + drag[:, None] * gains
        slope[_EACH, _EACH] += 1.0
        scale = gains[_EACH, _EACH]
        rows = np.where(sticks[:, None], gains / scale[:, None], slope)
        change = _solved(rows, np.where(sticks, speed / scale, -slips))
        return parallel + change, np.abs(change).max(axis=0) < _TOLERANCE


def _product(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """N matrices, shape (3, 3, N), times N vectors, shape (3, N)."""
    product: FloatArray = (matrices * vectors).sum(axis=1)
    return product


def _solved(rows: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions of N systems of three equations, shapes (3, 3, N) and (3, N), by Cramer's rule."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    x, y, z = right
    ei, di, dh = e * i - f * h, d * i - f * g, d * h - e * g
    determinant = a * ei - b * di + c * dh
    solution = np.empty_like(right)
    yi, yh, zd, zg = y * i - f * z, y * h - e * z, d * z, g * y
    solution[0] = x * ei - b * yi + c * yh
    solution[1] = a * yi - x * di + c * (zd - zg)
    solution[2] = -a * yh - b * (zd - zg) + x * dh
    solution /= determinant
    return solution
