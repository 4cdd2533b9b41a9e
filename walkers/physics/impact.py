"""Impacts of spheres: Hertz's elastic one, a damped one, one that slides all the way, and Mindlin's with friction.

Two spheres, or a sphere and a plane, meet at a normal speed v_n and a sliding speed s of their surfaces at the contact;
m* is the reduced mass and R* the reduced radius (the sphere's own at a plane). Tangential impulses turn solid spheres
as well, which makes the mass that resists sliding 2/7 m*.

- Elastic: δ_max = (15 m* v_n²/(16 E* √R*))^(2/5), F_max = 4/3 E* √R* δ_max^(3/2), and the contact lasts
  2.9432750 δ_max/v_n.
- Damped by 2 √(5/6) β √(S_n m*) δ', S_n = 2 E* √(R*δ), it rebounds with e = exp(-πβ/√(1-β²)) at any speed.
- Sliding all the way, the friction's impulse is μ (1+e) m* v_n: the centre of a sphere on a plane is slowed by
  μ (1+e) v_n, its surface by 7/2 of that, if the surface was faster.
- Mindlin's tangential spring 8 G* √(R*δ), cut at μ times the elastic repulsion, is integrated in time.

References
----------
H. Hertz, J. reine angew. Math. 92 (1882) 156, doi 10.1515/crll.1882.92.156; the duration: K. L. Johnson, Contact
Mechanics (1985), ch. 11.4, doi 10.1017/CBO9781139171731.
D. Antypov, J. A. Elliott, EPL 94 (2011) 50004, doi 10.1209/0295-5075/94/50004 (damping and restitution).
N. Maw, J. R. Barber, J. N. Fawcett, Wear 38 (1976) 101, doi 10.1016/0043-1648(76)90201-5 (oblique impact, and what the
spring leaves out: the micro-slip within the contact).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

from walkers.physics.contact import damping_ratio

FloatArray = npt.NDArray[np.float64]
_DURATION = 2.9432750
"""Duration of Hertz's impact over δ_max/v_n."""
SURFACE_OVER_CENTRE = 3.5
"""How much more a tangential impulse changes the velocity of a solid sphere's surface than that of its centre."""


@dataclass(frozen=True)
class Impact:
    """What meets: reduced mass (kg), radius (m) and moduli (Pa), restitution and friction."""

    mass: float
    radius: float
    modulus: float
    shear_modulus: float
    restitution: float = 1.0
    friction: float = 0.0

    def depth(self, speed: float) -> float:
        """Largest overlap of the elastic impact at a normal speed (m/s), m."""
        return float((15.0 * self.mass * speed**2 / (16.0 * self.modulus * sqrt(self.radius))) ** 0.4)

    def peak_force(self, speed: float) -> float:
        """Largest force of the elastic impact, N."""
        return float(4.0 / 3.0 * self.modulus * sqrt(self.radius) * self.depth(speed) ** 1.5)

    def duration(self, speed: float) -> float:
        """How long the elastic impact lasts, s."""
        return _DURATION * self.depth(speed) / speed


def sliding_loss(friction: float, restitution: float, normal_speed: FloatArray) -> FloatArray:
    """Tangential velocity that a sphere's centre loses at a plane on which it slides all the way, μ(1+e)v_n, m/s."""
    return friction * (1.0 + restitution) * normal_speed


@dataclass(frozen=True)
class Motion:
    """Speeds of N spheres at a plane, arrays of shape (N,), m/s.

    ``normal`` is that of the centre toward or away from the plane, ``tangential`` that along it, and ``rolling`` is Rω,
    so that the surface at the contact slides with the difference of the two.
    """

    normal: FloatArray
    tangential: FloatArray
    rolling: FloatArray

    @property
    def sliding(self) -> FloatArray:
        """Of the surfaces at the contact, m/s."""
        return self.tangential - self.rolling


def after_impact(impact: Impact, before: Motion, steps: int = 4000) -> Motion:
    """Integrate a sphere's damped Hertz impact on a plane with Mindlin's spring, cut at Coulomb's limit.

    The spring is damped in like manner while it holds, its arm ends half way into the overlap, and the limit is μ times
    the elastic repulsion, for the spring and its damping together: the engine's model, integrated apart from it.

    Parameters
    ----------
    steps
        Time steps of the shortest contact.
    """
    approach, along, rolling = (
        np.array(one, dtype=np.float64) for one in (before.normal, before.tangential, before.rolling)
    )
    step = impact.duration(float(approach.max())) / steps
    damping = 2.0 * sqrt(5.0 / 6.0) * damping_ratio(impact.restitution)
    overlap, spring, touching = np.zeros_like(approach), np.zeros_like(approach), np.ones(len(approach), dtype=bool)
    while touching.any():
        overlap = overlap + approach * step
        touching &= overlap > 0.0
        root = np.sqrt(impact.radius * np.where(touching, overlap, 0.0))
        elastic = 4.0 / 3.0 * impact.modulus * root * overlap
        push = elastic + damping * np.sqrt(2.0 * impact.modulus * root * impact.mass) * approach
        arm = 1.0 - overlap / (2.0 * impact.radius)
        slide = along - arm * rolling
        spring = spring + slide * step
        stiffness = 8.0 * impact.shear_modulus * root
        limit = impact.friction * np.maximum(elastic, 0.0)
        slips = np.abs(stiffness * spring) > limit
        spring = np.where(slips, np.sign(spring) * limit / np.where(stiffness > 0.0, stiffness, 1.0), spring)
        pull = stiffness * spring + np.where(slips, 0.0, damping * np.sqrt(stiffness * impact.mass) * slide)
        pull = np.clip(pull, -limit, limit)
        gained = step / impact.mass * touching
        approach, along = approach - gained * push, along - gained * pull
        rolling = rolling + 2.5 * gained * arm * pull
    return Motion(-approach, along, rolling)
