"""Alignment: a dimer that rolls sideways without sliding obeys a Mathieu equation.

Rolling about the line through its contacts with the substrate, a dimer turns by ψ̇ = Ω (R1 - R2)/L with L = 2√(R1 R2).
Energy and the work of the inertial force give, with ϑ = πft,

    d²ψ/dϑ² + [U - 4V cos 2ϑ] ψ = 0,    4V = (5/7) a0/(π² f²) (R1 - R2)/L (Σ m R)/(Σ m R²)

and U = 0 on a level substrate. A steady acceleration along the axis, such as a climber's weight, gives U as the drive
gives V.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import numpy.typing as npt
from scipy.special import mathieu_a, mathieu_b

from inputs.dimer import Dimer

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Alignment:
    """Parameters of the Mathieu equation of small angles to the axis, and whether these stay small."""

    u: float
    v: float

    @property
    def stable(self) -> bool:
        """Whether small angles stay small (without friction; friction lets them decay)."""
        return bool(is_stable(self.u, self.v))


def alignment(dimer: Dimer, frequency: float, peak_acceleration: float, steady_acceleration: float = 0.0) -> Alignment:
    """U and V of a dimer.

    Parameters
    ----------
    dimer
        The beads, the large one first.
    frequency
        Of the drive, Hz.
    peak_acceleration
        Of the substrate, m/s².
    steady_acceleration
        Acceleration that pulls the beads along the axis, m/s², positive from the small bead to the large one: the
        weight of a climber with its large bead below, which hangs as from a pivot (U > 0). A climber that leads with
        its large bead stands on its head (U < 0), and only the drive keeps it upright.
    """
    (first, second), masses = dimer.radii, dimer.masses
    lever = (first - second) / (2.0 * sqrt(first * second))
    inverse_radius = (masses[0] * first + masses[1] * second) / (masses[0] * first**2 + masses[1] * second**2)
    per_acceleration = 5.0 / 7.0 * lever * inverse_radius / (pi * frequency) ** 2
    return Alignment(steady_acceleration * per_acceleration, peak_acceleration * per_acceleration / 4.0)


def is_stable(u: npt.ArrayLike, v: npt.ArrayLike, bands: int = 6) -> npt.NDArray[np.bool_]:
    """Whether all solutions of the Mathieu equation are bounded.

    They are between the characteristic values a_n(q) and b_{n+1}(q) with q = 2V, a = U.

    Parameters
    ----------
    u, v
        U and V, of shapes that broadcast.
    bands
        How many intervals of stability are looked at, from the lowest.
    """
    a, q = np.broadcast_arrays(np.asarray(u, np.float64), 2.0 * np.abs(np.asarray(v, np.float64)))
    inside = [(mathieu_a(n, q) < a) & (a < mathieu_b(n + 1, q)) for n in range(bands)]
    stable: npt.NDArray[np.bool_] = np.any(inside, axis=0)
    return stable


def largest_stable_v() -> float:
    """V at which small angles begin to grow on a level substrate: 0.454."""
    from scipy.optimize import brentq

    return float(brentq(lambda q: mathieu_b(1, q), 0.5, 1.5)) / 2.0
