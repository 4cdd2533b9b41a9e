"""The paper's model: a dimer in contact under friction linear in the sliding velocity.

Symbols as in Khan et al., *Self-assembled granular walkers*: bead 1 is the large one, sin δ =
(R1 - R2)/(R1 + R2), between -1 and 1, and μ = (m1 - m2)/M, so that m1/M = (1 + μ)/2. Contacts 1 and
2 are the beads on the substrate, 3 is bead on bead; x points from bead 2 to bead 1. Forces are in
units of 4πγR̄, in which the force of the drive, M a0, is Γ0. F and F∥ are the normal forces and the
friction forces at the three contacts, v the sliding velocities there, and a is the acceleration of
the substrate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray

FRICTION_OF_THE_PAPER = 33.0
"""κ of F∥ = κ v F, s/m: 0.033 s/mm, fitted in the paper to its Figs. 2 and 3."""
CONTACTS = ("bead 1 on the substrate", "bead 2 on the substrate", "bead on bead")
"""Names of the three contacts."""


def mass_asymmetry(sin_delta: npt.ArrayLike) -> FloatArray:
    """μ = (m1 - m2)/M of two beads of equal density, shape of sin δ."""
    s = np.asarray(sin_delta, dtype=np.float64)
    return (3.0 * s + s**3) / (1.0 + 3.0 * s**2)


def normal_force_matrix(sin_delta: npt.ArrayLike) -> FloatArray:
    """The matrix D of F = F0 + D F∥ (Eq. 2 of the paper), dimensionless, shape (…, 3, 3).

    It follows from the balance of forces on beads at fixed distances, and is infinite at
    sin δ = ±1.
    """
    s = np.asarray(sin_delta, np.float64)
    mu = mass_asymmetry(s)
    ones = np.ones_like(s)
    first_share = (1.0 + mu) / 2.0  # m1/M
    second_share = (1.0 - mu) / 2.0
    rows = [
        [-second_share * s, first_share * s, -ones],
        [second_share * s, -first_share * s, ones],
        [second_share, -first_share, s],
    ]
    matrix: FloatArray = _matrix(rows) / np.sqrt(1.0 - s**2)[..., None, None]
    return matrix


def inertia_matrix(sin_delta: npt.ArrayLike) -> FloatArray:
    """The matrix G of M dv/dt = -M a (1, 1, 0) - G F∥, dimensionless, shape (…, 3, 3).

    Eq. 3 of the paper, for solid spheres, in any unit of force. It is infinite at sin δ = ±1.
    """
    mu = mass_asymmetry(sin_delta)
    # (m R²/I) (M/m) of each bead: m R²/I is 5/2 for a solid sphere, and m1/M = (1 + μ)/2.
    first = 5.0 / (1.0 + mu)
    second = 5.0 / (1.0 - mu)
    ones = np.ones_like(mu)
    rows = [
        [1.0 + first, ones, first],
        [ones, 1.0 + second, second],
        [first, second, first + second],
    ]
    return _matrix(rows)


def rolling_matrix(first_radius: npt.ArrayLike, second_radius: npt.ArrayLike) -> FloatArray:
    """The matrix H of q = H v, from sliding velocities to rolling rates of closed contacts.

    `walkers.physics.bridge` defines the rolling rates.

    Parameters
    ----------
    first_radius, second_radius
        R1 and R2, m, of the same shape.

    Returns
    -------
    numpy.ndarray
        H in 1/m, shape (…, 3, 3).

    Notes
    -----
    Beads that move at v = (v1 + v2 - v3)/2 and slide at v1 and v2 on the substrate roll on it
    at q1 = (v1 - v)/R1 and q2 = (v2 - v)/R2, and on each other at q3 = q1 - q2, with the first bead
    as body 1.
    """
    a = 0.5 / np.asarray(first_radius, np.float64)
    b = 0.5 / np.asarray(second_radius, np.float64)
    return _matrix([[a, -a, a], [-b, b, b], [a + b, -a - b, a - b]])


def _matrix(rows: list[list[FloatArray]]) -> FloatArray:
    """Matrices from their entries, which are arrays of the same shape."""
    stacked_rows = [np.stack(row, axis=-1) for row in rows]
    return np.stack(stacked_rows, axis=-2)


def forces_at_rest(sin_delta: npt.ArrayLike) -> FloatArray:
    """F0, the normal forces at rest that balance the capillary ones, shape (…, 3).

    They are for perfect wetting, without weight.
    """
    s = np.asarray(sin_delta, np.float64)
    return np.stack([1.0 + s, 1.0 - s, (1.0 - s**2) / 2.0], axis=-1)


def translation(sliding: FloatArray) -> FloatArray:
    """Velocity of a walker, shape (…), from its sliding velocities, shape (3, …)."""
    velocity: FloatArray = (sliding[0] + sliding[1] - sliding[2]) / 2.0
    return velocity


def _under_a_steady_force(sin_delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """F∥ and D F∥ under a unit force along -x, shape (…, 3); inertia alone determines them."""
    force = np.broadcast_to([[-1.0], [-1.0], [0.0]], (*sin_delta.shape, 3, 1))
    parallel = np.linalg.solve(inertia_matrix(sin_delta), force)
    pressing = normal_force_matrix(sin_delta) @ parallel
    return parallel[..., 0], pressing[..., 0]


class Detachment(NamedTuple):
    """Limit of the model: the force at which a contact opens."""

    gamma: FloatArray
    """The force in units of 4πγR̄."""
    contact: npt.NDArray[np.int64]
    """Index of the contact in `CONTACTS`."""


def detachment(sin_delta: npt.ArrayLike) -> Detachment:
    """Smallest force along the axis, in either direction, that opens a contact, shape (…).

    The beads have equal density.

    The friction forces under a steady force follow from inertia alone, so that this holds for any
    friction law that allows them.
    """
    s = np.asarray(sin_delta, np.float64)
    _, pressing = _under_a_steady_force(s)
    with np.errstate(divide="ignore"):
        limits = forces_at_rest(s) / np.abs(pressing)
    return Detachment(gamma=limits.min(axis=-1), contact=limits.argmin(axis=-1))


def mean_velocity(gamma0: npt.ArrayLike, sin_delta: npt.ArrayLike) -> FloatArray:
    """Mean velocity in the paper's model, m/s, positive toward the large bead.

    The drive is quasi-static, ±Γ0/√2, and friction is the paper's.

    Parameters
    ----------
    gamma0
        Γ0 of the drive.
    sin_delta
        sin δ of beads of equal density; its shape and that of ``gamma0`` must broadcast.

    Returns
    -------
    numpy.ndarray
        NaN where a contact would open (`detachment`), because the model does not hold there.
    """
    gamma, s = np.broadcast_arrays(
        np.asarray(gamma0, np.float64), np.asarray(sin_delta, np.float64)
    )
    parallel, pressing = _under_a_steady_force(s)
    velocities = []
    for force in (np.sqrt(0.5) * gamma[..., None], -np.sqrt(0.5) * gamma[..., None]):
        normal = forces_at_rest(s) + force * pressing
        closed = np.where(normal > 0.0, normal, np.nan)
        sliding = force * parallel / (FRICTION_OF_THE_PAPER * closed)
        velocities.append(translation(np.moveaxis(sliding, -1, 0)))
    return (velocities[0] + velocities[1]) / 2.0
