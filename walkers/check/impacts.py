"""Impacts on a bench: many spheres at once, each by itself, against a floor or in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, pi, sqrt
from typing import Any

import numpy as np

from walkers.check.bench import DRY, Bench, Measured, bench_case, bench_recording, bench_scene, dry, free_run
from walkers.inputs.case import Case
from walkers.physics.bridge import Surfaces
from walkers.physics.contact import reduced_modulus, reduced_shear_modulus
from walkers.physics.impact import Impact
from walkers.postprocess.dump import FloatArray
from walkers.templates.bridge_tables import tabulated
from walkers.templates.deck import BRIDGES_NAME, Plan, compose
from walkers.templates.scene import Bead

_STEPS = 1000
"""Time steps of the shortest contact."""
_LONGEST = 1.5
"""How long a deck lasts, over the longest elastic contact; damped ones last longer."""


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

    def impact_on_plane(self, restitution: float = 1.0, friction: float = 0.0) -> Impact:
        """Its impact on a rigid plane, E* = E/(1-ν²) and G* = G/(2-ν), twice that of two bodies of its modulus."""
        modulus = reduced_modulus(2.0 * self.youngs_modulus, self.poissons_ratio)
        shear = reduced_shear_modulus(2.0 * self.youngs_modulus, self.poissons_ratio)
        return Impact(self.mass, self.radius, modulus, shear, restitution, friction)

    def impact_on_equal(self, restitution: float = 1.0, friction: float = 0.0) -> Impact:
        """Its impact on another one like it."""
        modulus = reduced_modulus(self.youngs_modulus, self.poissons_ratio)
        shear = reduced_shear_modulus(self.youngs_modulus, self.poissons_ratio)
        return Impact(self.mass / 2.0, self.radius / 2.0, modulus, shear, restitution, friction)


@dataclass(frozen=True)
class Launch:
    """How a sphere is sent off: normal and tangential speed (m/s), spin (rad/s), and its contact's properties.

    The spin is about the axis that makes the sphere roll along with its tangential velocity.
    """

    normal_speed: float
    tangential_speed: float = 0.0
    spin: float = 0.0
    restitution: float = 1.0
    friction: float = 0.0


@dataclass(frozen=True)
class Rebound:
    """How N spheres went off, arrays of shape (N,): speeds away from and along the plane (m/s), spins (rad/s)."""

    normal_speed: FloatArray
    tangential_speed: FloatArray
    spin: FloatArray
    radius: float

    @property
    def sliding(self) -> FloatArray:
        """Velocity of the spheres' surfaces at the contact, m/s."""
        return self.tangential_speed - self.radius * self.spin


@dataclass(frozen=True)
class Course:
    """The course of one contact: time from the first touch (s), overlap (m) and force (N), each of shape (F,)."""

    time: FloatArray
    overlap: FloatArray
    force: FloatArray
    rebound_speed: float

    @property
    def peak(self) -> float:
        """Largest force, N."""
        return float(self.force.max())

    @property
    def duration(self) -> float:
        """Until the surfaces part, between two steps, s."""
        last = int(np.flatnonzero(self.overlap > 0.0)[-1])
        parting = self.overlap[last] / (self.overlap[last] - self.overlap[last + 1])
        return float(self.time[last] + parting * (self.time[last + 1] - self.time[last]))


def stiff_case(youngs_modulus: float, poissons_ratio: float, density: float, time_step: float) -> Case:
    """A dry case with real moduli, which no case file may have."""
    case = bench_case(liquid=DRY)
    contact = replace(case.contact, youngs_modulus=youngs_modulus, poissons_ratio=poissons_ratio)
    return replace(case, density=density, contact=contact, run=free_run(case.run, time_step))


def _grid(number: int, spacing: float) -> list[tuple[float, float]]:
    side = ceil(sqrt(number))
    middle = (side - 1) / 2.0
    return [((place % side - middle) * spacing, (place // side - middle) * spacing) for place in range(number)]


def _run(bench: Bench, case: Case, beads: Sequence[Bead], steps: int, sample_every: int, **options: Any) -> Measured:
    room = max(max(map(abs, bead.centre)) + 6.0 * bead.radius for bead in beads)
    deck = compose(Plan(case, bench_scene(beads, edge=room), bench_recording(steps, sample_every), **options))
    tables = deck.files[BRIDGES_NAME]
    if "surfaces" in options:  # decks have no tables of unlike surfaces, which never meet there
        for one, other in {(beads[0].radius, bead.radius) for bead in beads}:
            meeting = Surfaces.of(one, other, case.liquid, case.contact.minimum_separation_ratio)
            tables += f"bridge 1 2 {one!r} {other!r}\n{tabulated(dry, meeting).text()}"
    return bench.run(replace(deck, files={**deck.files, BRIDGES_NAME: tables}))


def _steps(impact: Impact, launches: Sequence[Launch]) -> tuple[float, int]:
    """Time step (s) and number of steps in which all of some spheres have rebounded."""
    speeds = [launch.normal_speed for launch in launches]
    step = impact.duration(max(speeds)) / _STEPS
    return step, ceil(_LONGEST * impact.duration(min(speeds)) / step)


def onto_floor(bench: Bench, sphere: Sphere, launches: Sequence[Launch]) -> Rebound:
    """Send spheres of one kind onto the floor, each by itself."""
    time_step, steps = _steps(sphere.impact_on_plane(), launches)
    case = stiff_case(2.0 * sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    # The engine takes the harmonic mean of two moduli: twice the sphere's on both sides is the sphere on a rigid plane.
    kinds = list(dict.fromkeys((launch.restitution, launch.friction) for launch in launches))
    surfaces = tuple((replace(case.contact, restitution=e, friction_bead_wall=mu), case.liquid) for e, mu in kinds)
    beads = [
        Bead(
            0, (x, y, sphere.radius), sphere.radius,
            (launch.tangential_speed, 0.0, -launch.normal_speed), (0.0, launch.spin, 0.0),
            surface=1 + kinds.index((launch.restitution, launch.friction)),
        )
        for (x, y), launch in zip(_grid(len(launches), 4.0 * sphere.radius), launches, strict=True)
    ]  # fmt: skip
    series = _run(bench, case, beads, steps, steps, surfaces=surfaces)
    velocity, spin = series.velocity[-1], series.spin[-1]
    return Rebound(velocity[:, 2], velocity[:, 0], spin[:, 1], sphere.radius)


def course_on_floor(bench: Bench, sphere: Sphere, speed: float) -> Course:
    """Let a sphere fall on the floor at a speed (m/s) and record each step of its elastic contact."""
    time_step, steps = _steps(sphere.impact_on_plane(), [Launch(speed)])
    case = stiff_case(2.0 * sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    bead = Bead(0, (0.0, 0.0, sphere.radius), sphere.radius, (0.0, 0.0, -speed))
    series = _run(bench, case, [bead], steps, 1)
    overlap = sphere.radius - series.position[:, 0, 2]
    return Course(series.time, overlap, series.force[:, 0, 2], float(series.velocity[-1, 0, 2]))


def course_of_pair(bench: Bench, sphere: Sphere, speed: float) -> Course:
    """Let two equal spheres meet, each with a speed (m/s), and record each step of their elastic contact."""
    time_step, steps = _steps(sphere.impact_on_equal(), [Launch(2.0 * speed)])
    case = stiff_case(sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    height = 5.0 * sphere.radius
    beads = [
        Bead(0, (0.0, 0.0, height), sphere.radius, (0.0, 0.0, speed)),
        Bead(0, (0.0, 0.0, height + 2.0 * sphere.radius), sphere.radius, (0.0, 0.0, -speed)),
    ]
    series = _run(bench, case, beads, steps, 1)
    overlap = 2.0 * sphere.radius - (series.position[:, 1, 2] - series.position[:, 0, 2])
    return Course(series.time, overlap, series.force[:, 1, 2], float(series.velocity[-1, 1, 2]))


def between_spheres(
    bench: Bench,
    upper: Sphere,
    lower: Sphere,
    launches: Sequence[Launch],
    *,
    rise: float = 0.0,
    turning_back: bool = False,
) -> Rebound:
    """Send spheres of one kind down onto spheres of another, pair by pair; all launches have the first one's contact.

    Parameters
    ----------
    rise
        How fast the lower ones come up, m/s.
    turning_back
        Whether each lower sphere spins against its partner as fast, so that equal surfaces do not slide.

    Returns
    -------
    Rebound
        Of the upper ones.
    """
    time_step, steps = _steps(upper.impact_on_equal(), launches)
    case = stiff_case(upper.youngs_modulus, upper.poissons_ratio, upper.density, time_step)
    first = launches[0]
    touch = replace(case.contact, restitution=first.restitution, friction_bead_bead=first.friction)
    surfaces = ((touch, case.liquid), (replace(touch, youngs_modulus=lower.youngs_modulus), case.liquid))
    height = lower.radius + 2.0 * upper.radius
    beads = []
    for (x, y), launch in zip(_grid(len(launches), 4.0 * max(upper.radius, lower.radius)), launches, strict=True):
        spin, velocity = (0.0, launch.spin, 0.0), (launch.tangential_speed, 0.0, -launch.normal_speed)
        back = (0.0, -launch.spin if turning_back else 0.0, 0.0)
        beads += [
            Bead(0, (x, y, height + lower.radius + upper.radius), upper.radius, velocity, spin),
            Bead(0, (x, y, height), lower.radius, (0.0, 0.0, rise), back, surface=2, density=lower.density),
        ]
    series = _run(bench, case, beads, steps, steps, surfaces=surfaces)
    velocities, spins = series.velocity[-1, ::2], series.spin[-1, ::2]
    return Rebound(velocities[:, 2], velocities[:, 0], spins[:, 1], upper.radius)
