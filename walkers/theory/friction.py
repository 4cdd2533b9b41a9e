"""Laws of friction at a contact: how large the tangential force is at a sliding velocity and a normal force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Friction:
    """F∥ = F (μ(v) sign v + κ v) at each of the three contacts; at v = 0 whatever up to F μs holds it.

    μ(v) = μk + (μs - μk) exp(-(v/vs)²), after Stribeck. Each is a number, or an array that broadcasts to (3, N) for N
    parameter sets: contacts 1, 2 (beads on the substrate) and 3 (bead on bead). F is that of rigid beads; the engine's
    Coulomb limit has the damping of the contact besides, which is nothing while beads neither approach nor part.

    Attributes
    ----------
    kinetic
        μk, Coulomb's coefficient.
    static
        μs; μk where it is None.
    stribeck_velocity
        vs, m/s.
    linear
        κ, s/m: the paper's law.
    """

    kinetic: npt.ArrayLike = 0.0
    static: npt.ArrayLike | None = None
    stribeck_velocity: float = 1e-3
    linear: npt.ArrayLike = 0.0

    @classmethod
    def coulomb(cls, bead_wall: npt.ArrayLike, bead_bead: npt.ArrayLike) -> Friction:
        """Coulomb's law with one coefficient on the substrate and one between the beads."""
        wall, bead = np.broadcast_arrays(np.asarray(bead_wall, np.float64), np.asarray(bead_bead, np.float64))
        return cls(kinetic=np.stack([wall, wall, bead]).reshape(3, -1))
