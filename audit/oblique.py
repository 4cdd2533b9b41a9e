"""Oblique impacts: what was launched beside how it rebounded, and the lines that such series and curves give."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from walkers.audit.check import Line
from walkers.audit.chung_ooi import Points
from walkers.audit.impacts import Launch, Rebound
from walkers.physics.impact import SURFACE_OVER_CENTRE, Impact, Motion, after_impact, friction_excess
from walkers.postprocess.dump import FloatArray

SLIP = 5e-3
"""Of the sliding velocity: what the step at which a contact begins to slip makes of the rest, at a thousand steps."""
EXCESS = 0.02
"""Of friction's impulse: what a thousand steps make of the end of a damped contact, where stiffness vanishes."""
MODEL = "the engine's model, integrated apart from it"


@dataclass(frozen=True)
class Oblique:
    """Rebounds of one series of launches from walls of one kind, with what the closed forms need of them."""

    launches: tuple[Launch, ...]
    impact: Impact
    rebound: Rebound

    def before(self, name: str) -> FloatArray:
        """An attribute of the launches, shape (N,)."""
        return np.array([getattr(launch, name) for launch in self.launches])

    @property
    def motion(self) -> Motion:
        """At the launch; tangential speeds as the engine has them."""
        rolling = self.impact.radius * self.before("spin")
        return Motion(self.before("normal_speed"), self.before("tangential_speed"), rolling)

    @property
    def restitution(self) -> FloatArray:
        """Measured."""
        return self.rebound.normal_speed / self.before("normal_speed")

    @property
    def tangential_restitution(self) -> FloatArray:
        """Of the centres' velocities."""
        return self.rebound.tangential_speed / self.before("tangential_speed")

    @property
    def angle(self) -> FloatArray:
        """Of incidence, degrees from the normal."""
        return np.degrees(np.arctan2(self.before("tangential_speed"), self.before("normal_speed")))

    @property
    def rebound_angle(self) -> FloatArray:
        """Of the surfaces, degrees."""
        return np.degrees(np.arctan(self.rebound.sliding / self.rebound.normal_speed))

    @property
    def incidence(self) -> FloatArray:
        """Of the surfaces: s/v_n."""
        return self.motion.sliding / self.motion.normal

    @property
    def recoil(self) -> FloatArray:
        """Of the surfaces: s'/v_n'."""
        return self.rebound.sliding / self.rebound.normal_speed

    @property
    def beta(self) -> FloatArray:
        """-s'/s."""
        return -self.rebound.sliding / self.motion.sliding

    @property
    def stickiness(self) -> FloatArray:
        """7/2 μ(1+e) v_n/s with the restitution as given; below one a rigid sphere slides all the way."""
        return SURFACE_OVER_CENTRE * self.impact.friction * (1.0 + self.impact.restitution) / self.incidence

    @property
    def deepest(self) -> float:
        """Overlap over the radius."""
        return self.impact.depth(float(self.motion.normal.max())) / self.impact.radius


def farthest(
    what: str, source: str, points: Points, x: FloatArray, y: FloatArray, axis: float, tolerance: float | None
) -> Line:
    """The one of some points that is farthest from a curve through (x, y); judged by the distance over the axis."""
    order = np.argsort(x)
    ours = np.interp(points[:, 0], x[order], y[order])
    worst = int(np.argmax(np.abs(ours - points[:, 1])))
    expected, measured = float(points[worst, 1]), float(ours[worst])
    what = f"{what}: farthest point, at {points[worst, 0]:g}"
    return Line(what, source, expected, measured, "", tolerance, abs(measured - expected) / axis)


def largest(what: str, source: str, expected: FloatArray, measured: FloatArray, tolerance: float) -> Line:
    """The one of several numbers that is farthest, judged absolutely."""
    worst = int(np.argmax(np.abs(measured - expected)))
    error = abs(float(measured[worst] - expected[worst]))
    return Line(what, source, float(expected[worst]), float(measured[worst]), "", tolerance, error)


def as_the_model(what: str, found: Oblique, needs: frozenset[str] = frozenset()) -> Line:
    """What became of the surfaces' velocities, against the engine's model."""
    law = after_impact(found.impact, found.motion)
    before = found.motion.sliding
    line = largest(
        f"{what}, surface after over before", MODEL, law.sliding / before, found.rebound.sliding / before, SLIP
    )
    return replace(line, needs=needs)


def excess_line(what: str, found: Oblique) -> Line:
    """By how much friction's impulse exceeds μ times the normal one in the fastest of the launches: a defect."""
    fastest = int(np.argmax(found.incidence))
    lost = float(found.rebound.tangential_speed[fastest] - found.before("tangential_speed")[fastest])
    normal = found.impact.friction * (1.0 + found.restitution[fastest]) * found.before("normal_speed")[fastest]
    source = "1 by Coulomb; the number is the engine's model's, integrated apart from it"
    said = f"{what}, friction beyond its limit: impulse over μ(1+e)"
    return Line(said, source, friction_excess(found.impact), abs(lost) / float(normal), "", EXCESS, defect=True)
