"""Hertz's elastic impact of two spheres, or of a sphere and a plane, that meet at a normal speed v_n.

m* is the reduced mass and R* the reduced radius (the sphere's own at a plane):

    δ_max = (15 m* v_n²/(16 E* √R*))^(2/5),    F_max = 4/3 E* √R* δ_max^(3/2),    and the contact lasts 2.943 δ_max/v_n.

References
----------
H. Hertz, J. reine angew. Math. 92 (1882) 156, doi 10.1515/crll.1882.92.156; the duration: K. L. Johnson, Contact
Mechanics (1985), ch. 11.4, doi 10.1017/CBO9781139171731.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

_DURATION = 2.9432750
"""Duration of Hertz's impact over δ_max/v_n."""


@dataclass(frozen=True)
class Impact:
    """What meets: reduced mass (kg), radius (m) and modulus (Pa)."""

    mass: float
    radius: float
    modulus: float

    def depth(self, speed: float) -> float:
        """Largest overlap at a normal speed (m/s), m."""
        return float((15.0 * self.mass * speed**2 / (16.0 * self.modulus * sqrt(self.radius))) ** 0.4)

    def peak_force(self, speed: float) -> float:
        """Largest force, N."""
        return float(4.0 / 3.0 * self.modulus * sqrt(self.radius) * self.depth(speed) ** 1.5)

    def duration(self, speed: float) -> float:
        """How long it lasts, s."""
        return _DURATION * self.depth(speed) / speed
