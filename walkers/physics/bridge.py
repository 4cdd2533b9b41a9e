"""What a law of a liquid bridge says: the pull and the resistances of two surfaces against their gap.

Two surfaces 1 and 2 (spheres, or a sphere and a plane) have the unit vector n from 2 to 1 between their centres, the
gap h, and arms l1, l2 from the centres to the middle of the contact. Three velocities describe how they move apart:

    normal    w = (v1 - v2) · n
    sliding   s = (v1 - v2) - w n + n × (l1 ω1 + l2 ω2)       of the surfaces at the contact
    rolling   q = n × (ω1 - ω2)                               rad/s

A law gives the pull P and a resistance matrix, all functions of h. The force on 1 and the couple between the two are

    F = -(P + N w) n - (S s + C q),        M = -(C s + Q q);

the torques are -l1 n × F - n × M on 1 and -l2 n × F + n × M on 2, so that momentum and angular momentum are conserved
and the dissipated power N w² + S s² + 2 C s·q + Q q² is not negative where N, S, Q ≥ 0 and C² ≤ S Q. A drag c on the
velocity of a centre along a plane, v = s - l1 q, is S = c, C = -c l1, Q = c l1².

Body 1 is `Surfaces.radius`, the bead at a plane and the smaller one of two. For the other one as body 1, n and s turn
round while q does not: C changes its sign, and nothing else.

Surfaces that overlap (h < 0) have the pull and the resistances of h = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
import numpy.typing as npt

from walkers.physics.capillary import bridge_volume_at_wall, bridge_volume_between_beads
from walkers.physics.matter import Liquid

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Surfaces:
    """Two surfaces that a bridge joins, or may join.

    ``radius`` is that of the bead, the smaller one of two, ``other_radius`` of the other one, infinity for a plane (m),
    ``volume`` the bridge's liquid (m³), ``minimum_separation_ratio`` the gap over the reduced radius below which
    resistances stop growing (roughness).
    """

    radius: float
    other_radius: float
    volume: float
    liquid: Liquid
    minimum_separation_ratio: float

    @classmethod
    def of(cls, radius: float, other_radius: float, liquid: Liquid, minimum_separation_ratio: float) -> Surfaces:
        """A bead and another or a plane (a radius of infinity), with the liquid that their bridge has."""
        if other_radius == inf:
            volume = bridge_volume_at_wall(radius, liquid.volume_fraction)
        else:
            radius, other_radius = sorted((radius, other_radius))
            volume = bridge_volume_between_beads(radius, other_radius, liquid.volume_fraction)
        return cls(radius, other_radius, volume, liquid, minimum_separation_ratio)

    @property
    def at_wall(self) -> bool:
        """Whether the other surface is a plane."""
        return self.other_radius == inf

    @property
    def reduced_radius(self) -> float:
        """R1 R2/(R1 + R2), at a plane the bead's radius, m."""
        return self.radius if self.at_wall else self.radius * self.other_radius / (self.radius + self.other_radius)

    @property
    def closest(self) -> float:
        """Gap below which resistances stop growing, m."""
        return self.minimum_separation_ratio * self.reduced_radius


@dataclass(frozen=True)
class Forces:
    """Pull (N) and resistances at some gaps, arrays of shape (N,): see the module for their meaning.

    ``normal`` (N), ``sliding`` (S) are in N s/m, ``coupling`` (C) in N s, ``rolling`` (Q) in N m s.
    """

    pull: FloatArray
    normal: FloatArray
    sliding: FloatArray
    coupling: FloatArray
    rolling: FloatArray

    def columns(self) -> FloatArray:
        """Shape (N, 5), in the order of the attributes."""
        return np.stack([self.pull, self.normal, self.sliding, self.coupling, self.rolling], axis=-1)


@dataclass(frozen=True)
class Curve:
    """A law for two given surfaces.

    Attributes
    ----------
    forces
        Of gaps from 0 to ``rupture``, m.
    rupture, formation
        Gaps at which the bridge breaks and below which it forms, m: 0 where the surfaces must touch.
    scale
        Over which forces vary near contact, m; a kink may be there. 0 is for `Surfaces.closest`.
    pull
        That of ``forces`` by itself, N, of a law whose resistances are more work than its pull.
    """

    forces: Callable[[FloatArray], Forces]
    rupture: float
    formation: float = 0.0
    scale: float = 0.0
    pull: Callable[[FloatArray], FloatArray] | None = None


BridgeLaw = Callable[[Surfaces], Curve]
