"""Impacts of spheres by the second engine: on a rigid plane, many at once, and of two equal ones, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from walkers.check.engine import Beads, Matter, SecondEngine, Surroundings
from walkers.check.kernels import FloatArray
from walkers.inputs.boundary import BOTTOM
from walkers.physics.contact import reduced_modulus
from walkers.physics.impact import Impact
from walkers.physics.matter import Contact, Liquid

_STEPS = 1000
"""Time steps of the shortest contact."""
_LONGEST = 1.5
"""How long impacts are followed, over the longest elastic contact; damped ones last longer."""
_PLANE = Surroundings([BOTTOM])
_DRY = Liquid(0.0, 0.0, None, 0.01, 0.0, None, law="walkers.check.bench:dry")


@dataclass(frozen=True)
class Sphere:
    """What a sphere is made of: Young's modulus (Pa), Poisson's ratio, density (kg/m³), and its radius (m)."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    radius: float

    @property
    def mass(self) -> float:
        """Of the sphere, kg."""
        return self.density * 4.0 / 3.0 * pi * self.radius**3

    def on_plane(self) -> Impact:
        """Its impact on a rigid plane, E* = E/(1-ν²), twice that of two bodies of its modulus."""
        return Impact(self.mass, self.radius, 2.0 * reduced_modulus(self.youngs_modulus, self.poissons_ratio))

    def on_equal(self) -> Impact:
        """Its impact on another one like it."""
        return Impact(self.mass / 2.0, self.radius / 2.0, reduced_modulus(self.youngs_modulus, self.poissons_ratio))

    def matter(self, stiffer: float, restitution: float, friction: float) -> Matter:
        """Of the second engine, with a modulus so many times its own: twice that is a rigid plane's other side."""
        modulus = stiffer * self.youngs_modulus
        contact = Contact(modulus, self.poissons_ratio, restitution, friction, friction, 0.0, 0.01)
        return Matter(self.density, contact, _DRY)


@dataclass(frozen=True)
class Speeds:
    """Of N spheres at a plane, arrays of shape (N,), m/s.

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


def onto_plane(sphere: Sphere, before: Speeds, restitution: float = 1.0, friction: float = 0.0) -> Speeds:
    """Send spheres onto a rigid plane, each by itself: their speeds afterwards."""
    zeros, radius = np.zeros_like(before.normal), sphere.radius
    places = np.stack([4.0 * radius * np.arange(len(zeros)), zeros, zeros + radius], axis=-1)
    velocities = np.stack([before.tangential, zeros, -before.normal], axis=-1)
    spins = np.stack([zeros, before.rolling / radius, zeros], axis=-1)
    step, steps = _steps(sphere.on_plane(), before.normal)
    matter = sphere.matter(2.0, restitution, friction)
    engine = SecondEngine(Beads(zeros + radius, places, velocities, spins), matter, _PLANE, step)
    frame = engine.run(steps, steps)[0]
    return Speeds(frame[:, 5], frame[:, 3], radius * frame[:, 7])


@dataclass(frozen=True)
class Course:
    """A head-on impact: time from the touch (s), overlap (m), force (N), shape (F,); speed and spin afterwards."""

    time: FloatArray
    overlap: FloatArray
    force: FloatArray
    speed: FloatArray
    spin: FloatArray

    @property
    def duration(self) -> float:
        """Until the surfaces part, between two steps, s."""
        last = int(np.flatnonzero(self.overlap > 0.0)[-1])
        parting = self.overlap[last] / (self.overlap[last] - self.overlap[last + 1])
        return float(self.time[last] + parting * (self.time[last + 1] - self.time[last]))


def course_on_plane(sphere: Sphere, speed: float) -> Course:
    """Let a sphere fall on a rigid plane at a speed (m/s), and follow the elastic impact."""
    beads = Beads(np.array([sphere.radius]), np.array([[0.0, 0.0, sphere.radius]]),
                  np.array([[0.0, 0.0, -speed]]), np.zeros((1, 3)))  # fmt: skip
    return _course(sphere, sphere.on_plane(), beads, sphere.matter(2.0, 1.0, 0.0), speed)


def course_of_pair(
    sphere: Sphere, speed: float, spin: float = 0.0, restitution: float = 1.0, friction: float = 0.0
) -> Course:
    """Let two equal spheres meet, each with a speed (m/s), spinning against each other (rad/s), and follow them."""
    high = 5.0 * sphere.radius
    beads = Beads(
        np.full(2, sphere.radius),
        np.array([[0.0, 0.0, high + 2.0 * sphere.radius], [0.0, 0.0, high]]),
        np.array([[0.0, 0.0, -speed], [0.0, 0.0, speed]]),
        np.array([[0.0, spin, 0.0], [0.0, -spin, 0.0]]),
    )
    return _course(sphere, sphere.on_equal(), beads, sphere.matter(1.0, restitution, friction), 2.0 * speed)


def _course(sphere: Sphere, impact: Impact, beads: Beads, matter: Matter, closing: float) -> Course:
    step, steps = _steps(impact, np.array([closing]))
    engine = SecondEngine(beads, matter, _PLANE, step)
    rows = [(engine.run(1, 1)[0], engine.state.force[0, 2]) for _ in range(steps)]
    frames = np.stack([frame for frame, _ in rows])
    low = frames[:, 1, 2] + sphere.radius if len(beads.radius) > 1 else 0.0
    overlap = np.asarray(sphere.radius - (frames[:, 0, 2] - low))
    force = np.array([force for _, force in rows], dtype=np.float64)
    return Course(step * np.arange(1.0, steps + 1.0), overlap, force, frames[-1, 0, 3:6], frames[-1, 0, 6:])


def _steps(impact: Impact, speeds: FloatArray) -> tuple[float, int]:
    """Time step (s) and number of steps in which all of some spheres have rebounded."""
    step = impact.duration(float(speeds.max())) / _STEPS
    return step, ceil(_LONGEST * impact.duration(float(speeds.min())) / step)
