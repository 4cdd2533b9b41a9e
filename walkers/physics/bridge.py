"""Interface of a bridge law: the pull and the resistances between two surfaces as functions of their gap.

The surfaces 1 and 2 are two spheres, or a sphere and a plane. The unit vector n points from 2 to 1, h is the gap, l1
and l2 are the distances of the centres from the middle of the contact. Three velocities describe the relative motion::

    normal    w = (v1 - v2) · n
    sliding   s = (v1 - v2) - w n + n × (l1 ω1 + l2 ω2)       of the surfaces at the contact
    rolling   q = n × (ω1 - ω2)                               rad/s

A law gives the pull P and the resistances N, S, C and Q as functions of h. The force on 1 and the torque are::

    F = -(P + N w) n - (S s + C q),        M = -(C s + Q q).

The torques on the bodies are -l1 n × F - n × M on 1 and -l2 n × F + n × M on 2. Momentum and angular momentum are
therefore conserved. The dissipated power N w² + S s² + 2 C s·q + Q q² is not negative if N, S, Q ≥ 0 and C² ≤ S Q. A
drag c on the velocity of a centre along a plane, v = s - l1 q, corresponds to S = c, C = -c l1 and Q = c l1².

Body 1 is the bead at a plane, or the smaller one of two beads. If the other bead is body 1, C changes its sign.

Surfaces that overlap (h < 0) have the pull and the resistances of h = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Protocol

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics.capillary import BridgeLiquid, bridge_volume, film_volume, share_of_bead

_COLUMNS = ("pull", "normal resistance", "sliding resistance", "coupling", "rolling resistance")


class UnusableLawError(ValueError):
    """A law cannot be used; the message says why."""


class Roughness(Protocol):
    """Roughness of a case's contacts, m."""

    @property
    def bead_bead(self) -> float:
        """Between two beads."""

    @property
    def bead_wall(self) -> float:
        """Between a bead and the boundary."""


@dataclass(frozen=True)
class Surfaces:
    """Two surfaces with a bridge between them."""

    radius: float  #: of the bead, or of the smaller one of two beads, m
    other_radius: float  #: of the other bead, infinite for a plane, m
    volume: float  #: of the bridge, m³
    liquid: BridgeLiquid
    roughness: (
        float  #: gap that remains for the liquid between surfaces that touch at their asperities, m
    )

    @classmethod
    def of(
        cls, radius: float, other_radius: float, liquid: BridgeLiquid, roughness: Roughness
    ) -> Surfaces:
        """Make the surfaces of a bead and another bead or a plane (infinite radius), and the volume of their bridge."""
        small, large = sorted((radius, other_radius))
        rough = roughness.bead_wall if large == inf else roughness.bead_bead
        return cls(small, large, bridge_volume(small, large, liquid), liquid, rough)

    @property
    def volumes(self) -> list[Surfaces]:
        """The pair with each volume that its bridge may have: one, or where liquid is conserved, steps of √2.

        The films of beads without other bridges give ``volume``; steps end at a sixteenth of it, and at √2 times it for
        films that are fuller, because bridges that break leave them more than they took.
        """
        steps = range(-8, 2) if self.liquid.conserved else (0,)
        return [replace(self, volume=self.volume * sqrt(2.0**step)) for step in steps]

    @property
    def films(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """What each surface contributes to a bridge of full films, and its liquid, m³ (a wall has none)."""
        fraction, small, large = self.liquid.volume_fraction, self.radius, self.other_radius
        shares = share_of_bead(small, large, fraction), share_of_bead(large, small, fraction)
        return shares, (
            film_volume(small, fraction),
            inf if self.at_wall else film_volume(large, fraction),
        )

    @property
    def at_wall(self) -> bool:
        """Whether the other surface is a plane."""
        return self.other_radius == inf

    @property
    def reduced_radius(self) -> float:
        """Reduced radius R1 R2/(R1 + R2); at a plane, the radius of the bead; m."""
        return (
            self.radius
            if self.at_wall
            else self.radius * self.other_radius / (self.radius + self.other_radius)
        )


@dataclass(frozen=True)
class Forces:
    """Pull and resistances of the module at given gaps, each of shape (n,)."""

    pull: FloatArray  #: P, N
    normal: FloatArray  #: N, N s/m
    sliding: FloatArray  #: S, N s/m
    coupling: FloatArray  #: C, N s
    rolling: FloatArray  #: Q, N m s

    def columns(self) -> FloatArray:
        """Shape (N, 5), in the order of the attributes."""
        return np.stack(list(vars(self).values()), axis=-1)


@dataclass(frozen=True)
class Curve:
    """The law for two given surfaces; raises `UnusableLawError` if its gaps are none."""

    forces: Callable[[FloatArray], Forces]  #: at gaps from 0 to ``rupture``, m
    rupture: float  #: gap at which the bridge breaks, m
    formation: float = 0.0  #: gap below which it forms, m; 0: the surfaces must touch
    scale: float = 0.0  #: gap over which forces vary near contact, where a kink may be, m; 0: `Surfaces.roughness`
    pull: Callable[[FloatArray], FloatArray] | None = (
        None  #: alone, N, if resistances are expensive to compute
    )

    def __post_init__(self) -> None:
        """Refuse gaps that are not in their order."""
        if not 0.0 < self.rupture < inf:
            raise UnusableLawError(
                f"the bridge breaks at a gap of {self.rupture:g} m; expected a positive number"
            )
        if not 0.0 <= self.formation <= self.rupture:
            expected = f"expected 0 to its rupture, {self.rupture:g} m"
            raise UnusableLawError(f"the bridge forms at a gap of {self.formation:g} m; {expected}")
        if not 0.0 <= self.scale < inf:
            raise UnusableLawError(
                f"its forces vary over a gap of {self.scale:g} m; expected zero or more (scale)"
            )


def columns_at(curve: Curve, gaps: FloatArray) -> FloatArray:
    """Pull and resistances at gaps (m), shape (n, 5); raises `UnusableLawError` if they are unusable."""
    with np.errstate(all="ignore"):
        forces = curve.forces(gaps)
    if not isinstance(forces, Forces):
        raise UnusableLawError(
            f"its forces are {type(forces).__name__}; expected walkers.physics.bridge.Forces"
        )
    columns = np.empty((len(gaps), len(_COLUMNS)))
    for number, (name, given) in enumerate(zip(_COLUMNS, vars(forces).values(), strict=True)):
        column = np.asarray(given)
        if column.dtype.kind not in "fiu" or column.shape not in ((), gaps.shape):
            kind = f"type {column.dtype} and shape {column.shape}"
            raise UnusableLawError(f"the {name} has {kind}; expected real numbers (n,)")
        columns[:, number] = column
        if not np.isfinite(column := columns[:, number]).all():
            raise UnusableLawError(
                f"the {name} is not a number at a gap of {gaps[~np.isfinite(column)][0]:g} m"
            )
        if name.endswith("resistance") and (column < 0.0).any():
            raise UnusableLawError(
                f"the {name} is negative at a gap of {gaps[column < 0.0][0]:g} m"
            )
    _, _, sliding, coupling, rolling = columns.T
    gains = coupling**2 > (1.0 + 1e-9) * sliding * rolling
    if gains.any():
        why = "the square of the coupling exceeds the product of both resistances"
        at = f"at a gap of {gaps[gains][0]:g} m"
        raise UnusableLawError(f"sliding and rolling together generate energy {at}: {why}")
    return columns


BridgeLaw = Callable[[Surfaces], Curve]
