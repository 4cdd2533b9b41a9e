"""Interface of a bridge law: capillary force and resistances as functions of the gap.

The surfaces 1 and 2 are two spheres, or a sphere and a plane. The unit vector n points from 2 to 1,
h is the gap, l1 and l2 are the distances of the centres from the middle of the contact. Three
velocities describe the relative motion::

    normal    w = (v1 - v2) · n
    sliding   s = (v1 - v2) - w n + n × (l1 ω1 + l2 ω2)       of the surfaces at the contact
    rolling   q = n × (ω1 - ω2)                               rad/s

A law gives the capillary force P (``pull``) and the resistances N, S, C and Q as functions of h.
The force on 1 and the torque are::

    F = -(P + N w) n - (S s + C q),        M = -(C s + Q q).

The torques on the bodies are -l1 n × F - n × M on 1 and -l2 n × F + n × M on 2. Momentum and
angular momentum are therefore conserved. The dissipated power N w² + S s² + 2 C s·q + Q q² is not
negative if N, S, Q ≥ 0 and C² ≤ S Q. A drag c on the velocity of a centre along a plane, v = s - l1
q, corresponds to S = c, C = -c l1 and Q = c l1².

Body 1 is the bead at a plane, or the smaller one of two beads. If the other bead is body 1, C
changes its sign.

Surfaces that overlap (h < 0) have the capillary force and the resistances of h = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Protocol

import numpy as np

from walkers.arrays import FloatArray
from walkers.physics.capillary import BridgeLiquid, bridge_volume, film_volume, share_of_bead

_COLUMNS = {
    "pull": "pull",
    "normal": "normal resistance",
    "sliding": "sliding resistance",
    "coupling": "coupling",
    "rolling": "rolling resistance",
}
"""Fields of `Forces` in the order of the columns of tables, and their names in messages."""


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

    radius: float
    """Radius of the bead, or of the smaller one of two beads, m."""
    other_radius: float
    """Radius of the other bead, infinite for a plane, m."""
    volume: float
    """Volume of the bridge, m³."""
    liquid: BridgeLiquid
    """The liquid of the bridge."""
    roughness: float
    """Gap that remains for the liquid between surfaces that touch at their asperities, m."""

    @classmethod
    def between(
        cls, radius: float, other_radius: float, liquid: BridgeLiquid, roughness: Roughness
    ) -> Surfaces:
        """The surfaces of a bead and of another bead or a plane.

        Their bridge has the volume that the liquid gives it.

        Parameters
        ----------
        radius, other_radius
            Radii in any order, m; infinite for a plane.
        liquid
            The liquid on the surfaces.
        roughness
            Roughness of pairs of beads, and of a bead at a plane.
        """
        small, large = sorted((radius, other_radius))
        gap_of_asperities = roughness.bead_wall if large == inf else roughness.bead_bead
        volume = bridge_volume(small, large, liquid)
        return cls(small, large, volume, liquid, gap_of_asperities)

    @property
    def volumes(self) -> list[Surfaces]:
        """The surfaces with each volume that their bridge may have.

        There is one volume unless liquid is conserved. Then there are volumes in steps of √2. The
        films of beads without other bridges give ``volume``. The steps begin at a sixteenth of it,
        for films from which other bridges have taken liquid, and end at √2 times it, because
        bridges that break leave films more than they took.
        """
        if not self.liquid.conserved:
            return [self]
        return [replace(self, volume=self.volume * sqrt(2.0**step)) for step in range(-8, 2)]

    @property
    def films(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """What each surface gives to a bridge if its film is full, and the full film, m³.

        A wall gives nothing, and its film is infinite.
        """
        fraction = self.liquid.volume_fraction
        shares = (
            share_of_bead(self.radius, self.other_radius, fraction),
            share_of_bead(self.other_radius, self.radius, fraction),
        )
        film = film_volume(self.radius, fraction)
        other_film = inf if self.at_wall else film_volume(self.other_radius, fraction)
        return shares, (film, other_film)

    @property
    def at_wall(self) -> bool:
        """Whether the other surface is a plane."""
        return self.other_radius == inf

    @property
    def reduced_radius(self) -> float:
        """Reduced radius R1 R2/(R1 + R2); at a plane, the radius of the bead; m."""
        if self.at_wall:
            return self.radius
        return self.radius * self.other_radius / (self.radius + self.other_radius)


@dataclass(frozen=True)
class Forces:
    """Capillary force and resistances (symbols of the module) at n gaps, each of shape (n,)."""

    pull: FloatArray
    """Capillary force P, N."""
    normal: FloatArray
    """Resistance N to normal motion, N s/m."""
    sliding: FloatArray
    """Resistance S to sliding, N s/m."""
    coupling: FloatArray
    """Coupling C of sliding and rolling, N s."""
    rolling: FloatArray
    """Resistance Q to rolling, N m s."""

    def columns(self) -> FloatArray:
        """The quantities P, N, S, C and Q as columns, shape (n, 5)."""
        return np.stack(
            [self.pull, self.normal, self.sliding, self.coupling, self.rolling], axis=-1
        )


@dataclass(frozen=True)
class Curve:
    """The law of a bridge between two given surfaces.

    Raises
    ------
    UnusableLawError
        If a gap is not a number, or if the gaps are not in the order 0 ≤ ``formation`` ≤
        ``rupture``.
    """

    forces: Callable[[FloatArray], Forces]
    """Function of gaps from 0 to ``rupture`` (m), shape (n,)."""
    rupture: float
    """Gap at which the bridge breaks, m."""
    formation: float = 0.0
    """Gap below which the bridge forms, m; 0 if the surfaces must touch."""
    scale: float = 0.0
    """Gap over which forces vary near contact, where a kink may be, m; 0 for
    `Surfaces.roughness`."""
    pull: Callable[[FloatArray], FloatArray] | None = None
    """The capillary force alone, N, for laws whose resistances are expensive to compute."""

    def __post_init__(self) -> None:
        """Check the gaps."""
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
    """Compute capillary force and resistances of a bridge, and check them.

    Parameters
    ----------
    curve
        The law of the bridge.
    gaps
        Gaps from 0 to the rupture of the bridge, m, shape (n,).

    Returns
    -------
    numpy.ndarray
        P, N, S, C and Q, SI units, shape (n, 5).

    Raises
    ------
    UnusableLawError
        If a value is not a finite number, a resistance is negative, or sliding and rolling generate
        energy (C² > S Q).
    """
    with np.errstate(all="ignore"):
        forces = curve.forces(gaps)
    if not isinstance(forces, Forces):
        raise UnusableLawError(
            f"its forces are {type(forces).__name__}; expected walkers.physics.bridge.Forces"
        )
    columns = np.empty((len(gaps), len(_COLUMNS)))
    for number, (field, name) in enumerate(_COLUMNS.items()):
        columns[:, number] = _checked(getattr(forces, field), name, gaps)
    _, normal, sliding, coupling, rolling = columns.T
    resistances = {"normal": normal, "sliding": sliding, "rolling": rolling}
    for field, values in resistances.items():
        negative = values < 0.0
        if negative.any():
            gap = gaps[negative][0]
            raise UnusableLawError(f"the {_COLUMNS[field]} is negative at a gap of {gap:g} m")
    generates = coupling**2 > (1.0 + 1e-9) * sliding * rolling  # by more than rounding errors
    if generates.any():
        gap = gaps[generates][0]
        raise UnusableLawError(
            f"sliding and rolling together generate energy at a gap of {gap:g} m: "
            "the square of the coupling exceeds the product of both resistances"
        )
    return columns


def _checked(values: object, name: str, gaps: FloatArray) -> FloatArray:
    """Values that a law gives at n gaps, shape (n,).

    Raises `UnusableLawError` if they are not finite real numbers.
    """
    numbers = np.asarray(values)
    if numbers.dtype.kind not in "fiu" or numbers.shape not in ((), gaps.shape):
        form = f"type {numbers.dtype} and shape {numbers.shape}"
        raise UnusableLawError(f"the {name} has {form}; expected real numbers (n,)")
    column = np.empty(len(gaps))
    column[:] = numbers
    unknown = ~np.isfinite(column)
    if unknown.any():
        raise UnusableLawError(f"the {name} is not a number at a gap of {gaps[unknown][0]:g} m")
    return column


BridgeLaw = Callable[[Surfaces], Curve]
"""A law: the curve of the bridge between two surfaces."""
