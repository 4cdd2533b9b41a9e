"""Alignment: a dimer that rolls sideways without sliding obeys a Mathieu equation.

Rolling about the line through its contacts with the substrate, a dimer turns by ψ̇ = Ω (R1 - R2)/L with L = 2√(R1 R2).
Energy and the work of the inertial force give, with ϑ = πft,

    d²ψ/dϑ² + [U - 4V cos 2ϑ] ψ = 0,    4V = (5/7) a0/(π² f²) (R1 - R2)/L (Σ m R)/(Σ m R²)

and U = 0 on a level substrate. A steady acceleration along the axis, such as a climber's weight, gives U as the drive
gives V. Bridges to the substrate whose resistance to rolling is Q take the power Σ Q Ω² of the energy (7/10) Σ m R² Ω²,
which adds 2β dψ/dϑ with 2πfβ = (5/7) (Σ Q)/(Σ m R²); that between the beads takes nothing of a rigid cone. Where the
drive is fast, U + 2V²/(1 + β²) takes the place of U - 4V cos 2ϑ (Kapitza's pendulum): a dimer on its head (U < 0)
stands where that is positive.

The equation takes the two beads for a cone, one rigid body. They are not: `walkers.theory.sideways` leaves them free.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import numpy.typing as npt
from scipy.special import mathieu_a, mathieu_b

from walkers.physics.dimer import Dimer
from walkers.theory.quasistatic import FloatArray

NEUTRAL = 1e-6
"""A growth per unit of ϑ, or a multiplier less one, that is the error of what is zero."""
_BANDS = 6
"""So many intervals of stability are looked at, from the lowest."""


@dataclass(frozen=True)
class Alignment:
    """Parameters of the Mathieu equation of small angles to the axis, and whether these stay small.

    Attributes
    ----------
    u, v
        U and V.
    damping
        β.
    """

    u: float
    v: float
    damping: float = 0.0

    @property
    def stable(self) -> bool:
        """Whether small angles stay small (if nothing damps them; what does lets them decay)."""
        return bool(is_stable(self.u, self.v)) if self.damping == 0.0 else self.growth <= NEUTRAL

    @property
    def growth(self) -> float:
        """How fast small angles grow, per unit of ϑ; times πf per second."""
        return growth(self.u, self.v, self.damping)


def alignment(
    dimer: Dimer,
    frequency: float,
    peak_acceleration: float,
    steady_acceleration: float = 0.0,
    rolling_resistance: float = 0.0,
) -> Alignment:
    """U, V and β of a dimer.

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
    rolling_resistance
        Σ Q of the bridges to the substrate (`walkers.physics.bridge`), N m s.
    """
    (first, second), masses = dimer.radii, dimer.masses
    lever = (first - second) / (2.0 * sqrt(first * second))
    moment = masses[0] * first**2 + masses[1] * second**2
    inverse_radius = (masses[0] * first + masses[1] * second) / moment
    per_acceleration = 5.0 / 7.0 * lever * inverse_radius / (pi * frequency) ** 2
    return Alignment(
        steady_acceleration * per_acceleration,
        peak_acceleration * per_acceleration / 4.0,
        5.0 / 7.0 * rolling_resistance / moment / (2.0 * pi * frequency),
    )


def growth(u: float, v: float, damping: float = 0.0) -> float:
    """Largest growth rate of the solutions of d²ψ/dϑ² + 2β dψ/dϑ + [U - 4V cos 2ϑ] ψ = 0 (Floquet), per unit of ϑ.

    Parameters
    ----------
    u, v, damping
        U, V and β.
    """
    steps = 128  # of a period of π, U - 4V cos 2ϑ constant in each
    theta = pi * (np.arange(steps) + 0.5) / steps
    slopes = np.zeros((steps, 2, 2))
    slopes[:, 0, 1], slopes[:, 1, 1] = 1.0, -2.0 * damping
    slopes[:, 1, 0] = 4.0 * v * np.cos(2.0 * theta) - u
    return float(np.log(np.abs(multipliers(slopes, pi / steps)).max()) / pi)


def multipliers(slopes: FloatArray, step: float) -> npt.NDArray[np.complex128]:
    """By what dx/dt = A(t) x grows in a period (Floquet's multipliers); A in each step, shape (steps, n, n)."""
    from scipy.linalg import expm

    period = np.eye(slopes.shape[-1])
    for one in expm(slopes * step):
        period = one @ period
    found: npt.NDArray[np.complex128] = np.linalg.eigvals(period).astype(np.complex128)
    return found


def is_stable(u: npt.ArrayLike, v: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Whether all solutions of the Mathieu equation are bounded.

    They are between the characteristic values a_n(q) and b_{n+1}(q) with q = 2V, a = U.

    Parameters
    ----------
    u, v
        U and V, of shapes that broadcast.
    """
    a, q = np.broadcast_arrays(np.asarray(u, np.float64), 2.0 * np.abs(np.asarray(v, np.float64)))
    inside = [(mathieu_a(n, q) < a) & (a < mathieu_b(n + 1, q)) for n in range(_BANDS)]
    stable: npt.NDArray[np.bool_] = np.any(inside, axis=0)
    return stable


def largest_stable_v() -> float:
    """V at which small angles begin to grow on a level substrate: 0.454."""
    from scipy.optimize import brentq

    return float(brentq(lambda q: mathieu_b(1, q), 0.5, 1.5)) / 2.0


def turning(parameters: Alignment, start: float, angles: npt.ArrayLike, phase: float = 0.0) -> FloatArray:
    """Orientation of a dimer that begins at rest and rolls sideways without sliding, whatever its angle to the axis.

    The Mathieu equation with sin ψ instead of ψ, a damped parametric pendulum:
    d²ψ/dϑ² = -2β dψ/dϑ - [U - 4V cos(2ϑ + phase)] sin ψ.

    Parameters
    ----------
    parameters
        U, V and β.
    start
        ψ at ϑ = 0, rad.
    angles : ndarray, shape (N,)
        ϑ = πft at which ψ is wanted, from 0 on.
    phase
        Of the drive, rad; at 0 the substrate accelerates toward the large bead first.

    Returns
    -------
    ndarray, shape (N,)
        ψ, rad.
    """
    from scipy.integrate import solve_ivp

    theta = np.asarray(angles, np.float64)

    def slope(at: float, state: FloatArray) -> list[float]:
        pull = parameters.u - 4.0 * parameters.v * np.cos(2.0 * at + phase)
        return [state[1], -2.0 * parameters.damping * state[1] - pull * np.sin(state[0])]

    solution = solve_ivp(slope, (0.0, float(theta[-1])), [start, 0.0], t_eval=theta, rtol=1e-8, atol=1e-10)
    psi: FloatArray = solution.y[0]
    return psi
