"""The paper's model: a dimer whose beads stay in contact, under friction linear in the sliding velocity.

Symbols as in Khan et al., *Self-assembled granular walkers*: bead 1 is the large one,
sin δ = (R1 - R2)/(R1 + R2) and μ = (m1 - m2)/M. Contacts 1 and 2 are the beads on the substrate, 3 is bead on bead; x
points from bead 2 to bead 1. Forces are in units of 4πγR̄, in which the force of the drive is Γ0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray

FRICTION_OF_THE_PAPER = 33.0
"""κ of F∥ = κ v F, s/m: 0.033 s/mm, fitted in the paper to its Figs. 2 and 3."""
CONTACTS = ("bead 1 on the substrate", "bead 2 on the substrate", "bead on bead")


def mass_asymmetry(sin_delta: npt.ArrayLike) -> FloatArray:
    """μ of two beads of equal density."""
    s = np.asarray(sin_delta, dtype=np.float64)
    return (3.0 * s + s**3) / (1.0 + 3.0 * s**2)


def normal_force_matrix(sin_delta: npt.ArrayLike) -> FloatArray:
    """The matrix D of F = F0 + D F∥ (their Eq. 2), from the balance of forces with fixed distances, shape (…, 3, 3)."""
    s = np.asarray(sin_delta, np.float64)
    mu, ones = mass_asymmetry(s), np.ones_like(s)
    heavy, light = (1.0 + mu) / 2.0, (1.0 - mu) / 2.0
    rows = [[-light * s, heavy * s, -ones], [light * s, -heavy * s, ones], [light, -heavy, s]]
    matrix: FloatArray = _matrix(rows) / np.sqrt(1.0 - s**2)[..., None, None]
    return matrix


def inertia_matrix(sin_delta: npt.ArrayLike) -> FloatArray:
    """The matrix G of M dv/dt = -M a (1, 1, 0) - G F∥ (their Eq. 3), solid spheres, shape (…, 3, 3)."""
    mu = mass_asymmetry(sin_delta)
    first, second, ones = 5.0 / (1.0 + mu), 5.0 / (1.0 - mu), np.ones_like(mu)
    return _matrix(
        [[1.0 + first, ones, first], [ones, 1.0 + second, second], [first, second, first + second]]
    )


def rolling_matrix(first: npt.ArrayLike, second: npt.ArrayLike) -> FloatArray:
    """The matrix H of q = H v: rolling rates (`walkers.physics.bridge`) from sliding velocities, closed contacts.

    Beads of radii R1 and R2 (m, of shape …) that move at v = (v1 + v2 - v3)/2 and slide at v1 and v2 on the substrate
    have q1 = (v1 - v)/R1 and q2 = (v2 - v)/R2; on each other they have q3 = q1 - q2, the first bead as body 1. Shape
    (…, 3, 3), 1/m.
    """
    a, b = 0.5 / np.asarray(first, np.float64), 0.5 / np.asarray(second, np.float64)
    return _matrix([[a, -a, a], [-b, b, b], [a + b, -a - b, a - b]])


def _matrix(rows: list[list[FloatArray]]) -> FloatArray:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def forces_at_rest(sin_delta: npt.ArrayLike) -> FloatArray:
    """F0, shape (…, 3): the normal forces at rest that balance the capillary ones; perfect wetting, no weight."""
    s = np.asarray(sin_delta, np.float64)
    return np.stack([1.0 + s, 1.0 - s, (1.0 - s**2) / 2.0], axis=-1)


def translation(sliding: FloatArray) -> FloatArray:
    """Velocity of the walker from the sliding velocities (first axis: contacts)."""
    velocity: FloatArray = (sliding[0] + sliding[1] - sliding[2]) / 2.0
    return velocity


def _under_a_steady_force(sin_delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """F∥ and D F∥ under a unit force along -x, shape (…, 3), which inertia alone determines."""
    along = np.broadcast_to([[-1.0], [-1.0], [0.0]], (*sin_delta.shape, 3, 1))
    parallel = np.linalg.solve(inertia_matrix(sin_delta), along)
    return parallel[..., 0], (normal_force_matrix(sin_delta) @ parallel)[..., 0]


class Detachment(NamedTuple):
    """Limit of the model: force (unit 4πγR̄) at which a contact opens, and its index in `CONTACTS`."""

    gamma: FloatArray
    contact: npt.NDArray[np.int64]


def detachment(sin_delta: npt.ArrayLike) -> Detachment:
    """Smallest force along the axis, in either direction, that opens a contact (equal densities), shape (…).

    The friction forces under a steady force follow from inertia alone, so that this holds for any friction law that
    allows them.
    """
    s = np.asarray(sin_delta, np.float64)
    with np.errstate(divide="ignore"):
        limits = forces_at_rest(s) / np.abs(_under_a_steady_force(s)[1])
    return Detachment(limits.min(axis=-1), limits.argmin(axis=-1))


def mean_velocity(gamma0: npt.ArrayLike, sin_delta: npt.ArrayLike) -> FloatArray:
    """Mean velocity for a quasi-static drive of ±Γ0/√2 under the paper's friction, m/s, positive toward the large bead.

    Γ0 and sin δ of beads of equal density may be of any shapes that broadcast. NaN where a contact would open
    (`detachment`), for there the model does not hold.
    """
    gamma, s = np.broadcast_arrays(
        np.asarray(gamma0, np.float64), np.asarray(sin_delta, np.float64)
    )
    parallel, pressed = _under_a_steady_force(s)
    sides = []
    for force in (np.sqrt(0.5) * gamma[..., None], -np.sqrt(0.5) * gamma[..., None]):
        normal = forces_at_rest(s) + force * pressed
        sliding = (
            force * parallel / (FRICTION_OF_THE_PAPER * np.where(normal > 0.0, normal, np.nan))
        )
        sides.append(translation(np.moveaxis(sliding, -1, 0)))
    return (sides[0] + sides[1]) / 2.0
