"""Impacts on a bench: many spheres at once, each by itself, against a floor or in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, pi, sqrt
from typing import Any

import numpy as np

from walkers.audit.bench import FIRST_BEAD, FLOOR, Bench, Measured, bench_case, bench_recording, free_run
from walkers.inputs.case import Case
from walkers.physics.contact import reduced_modulus, reduced_shear_modulus
from walkers.physics.impact import Impact
from walkers.postprocess.dump import FloatArray
from walkers.templates.deck import Plan
from walkers.templates.engine import Workarounds
from walkers.templates.scene import Bead, Scene

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

    def impact_on_plane(self, restitution: float = 1.0, friction: float = 0.0, copies: int = 1) -> Impact:
        """Its impact on a rigid plane, E* = E/(1-ν²) and G* = G/(2-ν), twice that of two bodies of its modulus."""
        modulus = reduced_modulus(2.0 * self.youngs_modulus, self.poissons_ratio)
        shear = reduced_shear_modulus(2.0 * self.youngs_modulus, self.poissons_ratio)
        return Impact(self.mass, self.radius, modulus, shear, restitution, friction, copies)

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
    case = bench_case(liquid={"volume_fraction": 1e-9, "surface_tension": "1e-9 N/m"})
    contact = replace(case.contact, youngs_modulus=youngs_modulus, poissons_ratio=poissons_ratio)
    return replace(case, density=density, contact=contact, run=free_run(case.run, time_step))


def _roomy_scene(beads: Sequence[Bead], radius: float) -> Scene:
    """Beads over a floor with a carrier beside them, all far apart for spheres of a radius (m)."""
    numbered = tuple(replace(bead, id=FIRST_BEAD + number) for number, bead in enumerate(beads))
    half = max(abs(coordinate) for bead in beads for coordinate in bead.centre[:2]) + 4.0 * radius
    top = max(bead.centre[2] for bead in beads) + 4.0 * radius
    edge = half + 4.0 * radius
    return Scene(
        numbered, (FLOOR,), ((edge - radius,) * 2 + (top,),), (-edge, -edge, -radius), (edge, edge, top + 4.0 * radius)
    )


def _grid(number: int, spacing: float) -> list[tuple[float, float]]:
    side = ceil(sqrt(number))
    middle = (side - 1) / 2.0
    return [((place % side - middle) * spacing, (place // side - middle) * spacing) for place in range(number)]


def _run(bench: Bench, case: Case, beads: Sequence[Bead], steps: int, **options: Any) -> Measured:
    sample = options.pop("sample_every", steps)
    radius = max(bead.radius for bead in beads)
    options.setdefault("workarounds", bench.workarounds)
    return bench.run(Plan(case, _roomy_scene(beads, radius), bench_recording(steps, sample), **options))


def _steps(impact: Impact, launches: Sequence[Launch]) -> tuple[float, int]:
    """Time step (s) and number of steps in which all of some spheres have rebounded."""
    speeds = [launch.normal_speed for launch in launches]
    step = impact.duration(max(speeds)) / _STEPS
    return step, ceil(_LONGEST * impact.duration(min(speeds)) / step)


def walls_of(bench: Bench) -> dict[str, Workarounds]:
    """Decks with walls that stand once and twice (the bench's own)."""
    return {"single wall": Workarounds(wall_copies=1), "doubled wall": bench.workarounds}


def onto_floor(bench: Bench, sphere: Sphere, launches: Sequence[Launch], workarounds: Workarounds) -> Rebound:
    """Send spheres of one kind onto the floor, each by itself."""
    time_step, steps = _steps(sphere.impact_on_plane(), launches)
    case = stiff_case(2.0 * sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    # The engine takes the harmonic mean of two moduli: twice the sphere's on both sides is the sphere on a rigid plane.
    kinds = list(dict.fromkeys((launch.restitution, launch.friction) for launch in launches))
    surfaces = tuple(replace(case.contact, restitution=e, friction_bead_wall=mu) for e, mu in kinds)
    beads = [
        Bead(
            0, (x, y, sphere.radius), sphere.radius,
            (launch.tangential_speed, 0.0, -launch.normal_speed), (0.0, launch.spin, 0.0),
            surface=1 + kinds.index((launch.restitution, launch.friction)),
        )
        for (x, y), launch in zip(_grid(len(launches), 4.0 * sphere.radius), launches, strict=True)
    ]  # fmt: skip
    series = _run(bench, case, beads, steps, surfaces=surfaces, workarounds=workarounds)
    rows = slice(series.row(FIRST_BEAD), None)
    velocity, spin = series.velocity[-1, rows], series.spin[-1, rows]
    return Rebound(velocity[:, 2], velocity[:, 0], spin[:, 1], sphere.radius)


def course_on_floor(bench: Bench, sphere: Sphere, speed: float, workarounds: Workarounds) -> Course:
    """Let a sphere fall on the floor at a speed (m/s) and record each step of its elastic contact."""
    time_step, steps = _steps(sphere.impact_on_plane(), [Launch(speed)])
    case = stiff_case(2.0 * sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    bead = Bead(0, (0.0, 0.0, sphere.radius), sphere.radius, (0.0, 0.0, -speed))
    series = _run(bench, case, [bead], steps, sample_every=1, workarounds=workarounds)
    row = series.row(FIRST_BEAD)
    overlap = sphere.radius - series.position[:, row, 2]
    rebound = float(series.velocity[-1, row, 2])
    return Course(series.steps.astype(np.float64) * time_step, overlap, series.force[:, row, 2], rebound)


def course_of_pair(bench: Bench, sphere: Sphere, speed: float) -> Course:
    """Let two equal spheres meet, each with a speed (m/s), and record each step of their elastic contact."""
    time_step, steps = _steps(sphere.impact_on_equal(), [Launch(2.0 * speed)])
    case = stiff_case(sphere.youngs_modulus, sphere.poissons_ratio, sphere.density, time_step)
    height = 5.0 * sphere.radius
    beads = [
        Bead(0, (0.0, 0.0, height), sphere.radius, (0.0, 0.0, speed)),
        Bead(0, (0.0, 0.0, height + 2.0 * sphere.radius), sphere.radius, (0.0, 0.0, -speed)),
    ]
    series = _run(bench, case, beads, steps, sample_every=1)
    row = series.row(FIRST_BEAD)
    overlap = 2.0 * sphere.radius - (series.position[:, row + 1, 2] - series.position[:, row, 2])
    rebound = float(series.velocity[-1, row + 1, 2])
    return Course(series.steps.astype(np.float64) * time_step, overlap, series.force[:, row + 1, 2], rebound)


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
    surfaces = (touch, replace(touch, youngs_modulus=lower.youngs_modulus))
    height = lower.radius + 2.0 * upper.radius
    beads = []
    for (x, y), launch in zip(_grid(len(launches), 4.0 * max(upper.radius, lower.radius)), launches, strict=True):
        spin, velocity = (0.0, launch.spin, 0.0), (launch.tangential_speed, 0.0, -launch.normal_speed)
        back = (0.0, -launch.spin if turning_back else 0.0, 0.0)
        beads += [
            Bead(0, (x, y, height + lower.radius + upper.radius), upper.radius, velocity, spin),
            Bead(0, (x, y, height), lower.radius, (0.0, 0.0, rise), back, surface=2, density=lower.density),
        ]
    series = _run(bench, case, beads, steps, surfaces=surfaces)
    rows = slice(series.row(FIRST_BEAD), None, 2)
    velocities, spins = series.velocity[-1, rows], series.spin[-1, rows]
    return Rebound(velocities[:, 2], velocities[:, 0], spins[:, 1], upper.radius)
