"""Sliding friction of a contact: Coulomb's law, or a coefficient that grows with the velocity.

The tangential force of a contact that slides with the speed s is μ(s) times its load, with

    μ(s) = μ₀ + Δμ s/(s + s_h).

μ₀ is the friction at rest, Δμ its rise at high speed, and s_h the speed of half the rise. Well
below s_h the friction grows in proportion to the speed, by Δμ/s_h. Without a rise the law is
Coulomb's. Lubricated surfaces under small loads have a friction that grows in this way
(velocity-strengthening friction); a rise is never negative here, because a friction that falls
with the speed makes contacts stick and slip within a time step.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from walkers.arrays import FloatArray

Speed = TypeVar("Speed", float, FloatArray)


class SlidingFriction(NamedTuple):
    """The friction coefficient of a contact as a function of the speed at which it slides."""

    at_rest: float
    """μ₀, the coefficient at rest: the largest friction of a contact that sticks, over its load."""
    rise: float = 0.0
    """Δμ, the rise of the coefficient at speeds far above `half_rise_velocity`."""
    half_rise_velocity: float = 1.0
    """s_h, the speed at which half of the rise is reached, m/s; without a rise it has no effect."""

    @property
    def slope(self) -> float:
        """Largest increase of the coefficient with the speed, Δμ/s_h, s/m: that at rest."""
        return self.rise / self.half_rise_velocity

    def coefficient(self, speed: Speed) -> Speed:
        """The coefficient at a sliding speed (m/s, not negative)."""
        return self.at_rest + self.rise * speed / (speed + self.half_rise_velocity)
