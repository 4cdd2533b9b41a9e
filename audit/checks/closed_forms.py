"""Group 11: motions of one bead that have closed forms: sliding into rolling, rolling to rest, spinning, in a film.

A bead of radius R and mass m under gravity g, I = 2/5 m R²:

- sent off sliding at u0 on a floor of friction μ it has v = u0 - μ g t and R ω = 5/2 μ g t, until it rolls, from
  t = 2 u0/(7 μ g), with 5/7 u0;
- rolling against a torque μ_r R m g it slows at 5/7 μ_r g, for the floor's friction f turns it while it brakes it:
  m a = f, 2/5 m R a = μ_r R m g - R f;
- falling at v_n without damping, and spinning at ω, it is thrown sideways at 2 μ v_n while it slides, which it does to
  the end for R ω > 7 μ v_n;
- on a slope of angle α, in a film that drags it by c v, it approaches m g sin α/c: as 1 - exp(-t/τ) with τ = m/c where
  there is no friction, and with τ = 7/5 m/c where it rolls.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi, radians, sin, sqrt

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, bench_case, bench_recording, scene_on_floor
from walkers.audit.check import Check, Line
from walkers.audit.checks.benchmarks import WALLS
from walkers.audit.impacts import Launch, Sphere, onto_floor, walls_of
from walkers.audit.laws import largest_error
from walkers.audit.oblique import MODEL
from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads
from walkers.physics.contact import damping_ratio, hertz_overlap, reduced_modulus, reduced_shear_modulus
from walkers.physics.film import film_drag
from walkers.physics.impact import Motion, after_impact
from walkers.postprocess.dump import FloatArray
from walkers.templates.deck import Plan
from walkers.templates.scene import Bead

GRAVITY = 9.81
RADIUS = 3e-4
FRICTION, LAUNCH_SPEED = 0.1, 0.05
"""Of the bead that slides until it rolls, m/s."""
ROLLING_FRICTION, ROLLING_SPEED = 0.01, 5e-3
TILT = 30.0
"""Of the slope, degrees."""
FILM_VISCOSITY = 0.05
"""Pa s."""
BOUNCY = Sphere(5e7, 0.3, 4000.0, RADIUS)
SPINNING_FRICTION, FALL_SPEED = 0.3, 0.05
COURSE = 2e-3
"""Largest error along a way, over its largest value: some thousand steps, overlaps of some 1e-4 of the radius."""


@dataclass(frozen=True)
class Way:
    """A bead's way along the floor and its closed form, arrays of shape (F,): time (s), velocity and Rω (m/s)."""

    time: FloatArray
    velocity: FloatArray
    rolling: FloatArray
    expected_velocity: FloatArray
    expected_rolling: FloatArray

    @property
    def error(self) -> float:
        """Largest over the way and both velocities, over the largest of them."""
        measured = np.stack([self.velocity, self.rolling], axis=1)
        return largest_error(measured, np.stack([self.expected_velocity, self.expected_rolling], axis=1))


def _heavy_case(**contact: object) -> Case:
    return bench_case(
        liquid={"volume_fraction": 1e-9, "surface_tension": "1e-9 N/m"},
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.5}, "restitution": 0.3, **contact},
        environment={"gravity": f"{GRAVITY} m/s^2"},
        run={"time_step": "2 us"},
    )


def _on_floor(
    bench: Bench, case: Case, bead: Bead, duration: float, wall: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, velocity along x and Rω about y of a bead, recorded some hundred times."""
    every = max(1, round(duration / case.run.time_step / 200.0))
    scene, recording = scene_on_floor([bead]), bench_recording(200 * every, every)
    series = bench.run(Plan(case, scene, recording, workarounds=walls_of(bench)[wall]))
    row = series.row(FIRST_BEAD)
    time = series.steps.astype(np.float64) * case.run.time_step
    return time, series.velocity[:, row, 0], bead.radius * series.spin[:, row, 1]


def _resting(case: Case, wall: str) -> tuple[float, float]:
    """Height of the centre of a dry bead at rest on a wall, m, and its mass, kg."""
    mass = 4.0 / 3.0 * pi * RADIUS**3 * case.density
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    return RADIUS - hertz_overlap(mass * GRAVITY / WALLS[wall], RADIUS, modulus), mass


def sliding_way(bench: Bench, wall: str) -> Way:
    """A bead sent off sliding, until well after it rolls; without damping, for the sake of the first step."""
    case = _heavy_case(friction={"bead_bead": 0.0, "bead_wall": FRICTION}, restitution=1.0)
    height, _ = _resting(case, wall)
    rolls = 2.0 * LAUNCH_SPEED / (7.0 * FRICTION * GRAVITY)
    bead = Bead(0, (-5e-4, 0.0, height), RADIUS, (LAUNCH_SPEED, 0.0, 0.0))
    time, velocity, rolling = _on_floor(bench, case, bead, 1.5 * rolls, wall)
    slid = np.minimum(time, rolls)
    return Way(time, velocity, rolling, LAUNCH_SPEED - FRICTION * GRAVITY * slid, 2.5 * FRICTION * GRAVITY * slid)


def rolling_way(bench: Bench, wall: str) -> Way:
    """A bead that rolls until a constant torque has stopped it, and rests."""
    case = _heavy_case(rolling_friction=ROLLING_FRICTION)
    height, _ = _resting(case, wall)
    slowing = 5.0 / 7.0 * ROLLING_FRICTION * GRAVITY
    bead = Bead(0, (0.0, 0.0, height), RADIUS, (ROLLING_SPEED, 0.0, 0.0), (0.0, ROLLING_SPEED / RADIUS, 0.0))
    time, velocity, rolling = _on_floor(bench, case, bead, 1.3 * ROLLING_SPEED / slowing, wall)
    expected = np.maximum(ROLLING_SPEED - slowing * time, 0.0)
    return Way(time, velocity, rolling, expected, expected)


def film_way(bench: Bench, wall: str, friction: float) -> Way:
    """A wet bead on a slope in a film, from rest: without friction it slides, else it rolls.

    The bridge has no viscosity, which would drag what slides.
    """
    case = bench_case(
        contact={"friction": {"bead_bead": 0.0, "bead_wall": friction}, "restitution": 0.3},
        environment={"gravity": f"{GRAVITY} m/s^2"},
        boundary={"tilt": f"{TILT} deg"},
        run={"time_step": "2 us"},
    )
    case = replace(case, liquid=replace(case.liquid, film_viscosity=FILM_VISCOSITY))
    bead = Bead(0, (0.0, 0.0, RADIUS - contact_loads(case).overlaps[0]), RADIUS)
    mass, drag = 4.0 / 3.0 * pi * RADIUS**3 * case.density, film_drag(FILM_VISCOSITY, RADIUS)
    inertia = 1.4 if friction else 1.0
    settles, pull = inertia * mass / drag, float(np.sign(case.gravity_vector[0])) * mass * GRAVITY * sin(radians(TILT))
    time, velocity, rolling = _on_floor(bench, case, bead, 5.0 * settles, wall)
    expected = pull / drag * (1.0 - np.exp(-time / settles))
    return Way(time, velocity, rolling, expected, expected if friction else np.zeros_like(expected))


def _way_lines(name: str, wall: str, way: Way, source: str) -> Iterator[Line]:
    what = f"{name} on a {wall}"
    last = float(way.expected_velocity[-1]), float(way.velocity[-1])
    yield Line(f"{what}: velocity and spin along the way", source, *last, "m/s", COURSE, way.error)


def sliding_lines(bench: Bench) -> Iterator[Line]:
    """Sliding into rolling."""
    for wall in WALLS:
        way = sliding_way(bench, wall)
        yield from _way_lines("a bead that slides until it rolls", wall, way, "u0 - μgt, Rω = 5/2 μgt, to 5/7 u0")
        what = f"a bead that slides until it rolls on a {wall}: velocity at the end over that at the start"
        yield Line(what, "5/7", 5.0 / 7.0, float(way.velocity[-1]) / LAUNCH_SPEED, "", COURSE)


def first_step(bench: Bench, wall: str) -> tuple[float, float]:
    """What a damped bead that starts to slide loses of its velocity in its first step, and what Coulomb leaves of it.

    The friction spring is still slack then, and while it is below its limit its damping is not cut: half a step of
    2 √(5/6) β √(k_t m) at each wall, k_t = 8 G* √(Rδ). Relative to the velocity.
    """
    case = _heavy_case(friction={"bead_bead": 0.0, "bead_wall": FRICTION})
    height, mass = _resting(case, wall)
    bead = Bead(0, (0.0, 0.0, height), RADIUS, (LAUNCH_SPEED, 0.0, 0.0))
    series = bench.run(Plan(case, scene_on_floor([bead]), bench_recording(1, 1), workarounds=walls_of(bench)[wall]))
    lost = 1.0 - float(series.velocity[-1, series.row(FIRST_BEAD), 0]) / LAUNCH_SPEED
    contact, step = case.contact, case.run.time_step
    shear = reduced_shear_modulus(contact.youngs_modulus, contact.poissons_ratio)
    stiffness = 8.0 * shear * sqrt(RADIUS * (RADIUS - height))
    damping = 2.0 * sqrt(5.0 / 6.0) * damping_ratio(contact.restitution) * sqrt(stiffness * mass)
    coulomb = 0.5 * step * FRICTION * GRAVITY / LAUNCH_SPEED  # that of the step's second half
    return lost, WALLS[wall] * damping * step / (2.0 * mass) + coulomb


def first_step_lines(bench: Bench) -> Iterator[Line]:
    """The first step of a contact that starts to slide."""
    for wall in WALLS:
        lost, expected = first_step(bench, wall)
        what = f"a damped bead that starts to slide on a {wall}: lost in the first step"
        source = "½ Δt 2√(5/6) β √(k_t/m), nearly 0 by Coulomb"
        yield Line(what, source, expected, lost, "", 0.02, defect=True)


def rolling_lines(bench: Bench) -> Iterator[Line]:
    """Rolling to rest."""
    for wall in WALLS:
        yield from _way_lines("a bead that rolls to rest", wall, rolling_way(bench, wall), "u0 - 5/7 μ_r g t, then 0")


def film_lines(bench: Bench) -> Iterator[Line]:
    """Down a slope in a film."""
    for wall in WALLS:
        for name, friction in (("slides", 0.0), ("rolls", 0.5)):
            source = "m g sin α/(6πηR) (1 - exp(-t/τ)), τ = m/(6πηR)" + (", times 7/5" if friction else "")
            yield from _way_lines(
                f"a bead that {name} down a slope in a film", wall, film_way(bench, wall, friction), source
            )


@dataclass(frozen=True)
class Thrown:
    """Beads that spin as they fall, arrays of shape (N,): Rω/(μ v_n), and the velocity sideways over μ v_n.

    ``expected`` is the same for rigid beads that slide all the way, or else stick: min(2, 2/7 Rω/(μ v_n)).
    """

    spin: FloatArray
    sideways: FloatArray
    expected: FloatArray
    model: FloatArray


def thrown(bench: Bench, wall: str) -> Thrown:
    """Let spinning beads fall, without damping."""
    reduced = np.linspace(0.5, 16.0, 32)
    load = SPINNING_FRICTION * FALL_SPEED
    launches = [Launch(FALL_SPEED, 0.0, float(one) * load / RADIUS, 1.0, SPINNING_FRICTION) for one in reduced]
    rebound = onto_floor(bench, BOUNCY, launches, walls_of(bench)[wall])
    impact = BOUNCY.impact_on_plane(1.0, SPINNING_FRICTION, WALLS[wall])
    zero = np.zeros_like(reduced)
    law = after_impact(impact, Motion(zero + FALL_SPEED, zero, reduced * load))
    expected = np.minimum(2.0, 2.0 / 7.0 * reduced)
    return Thrown(reduced, rebound.tangential_speed / load, expected, law.tangential / load)


def spinning_lines(bench: Bench) -> Iterator[Line]:
    """A spinning bead's impact."""
    for wall in WALLS:
        found = thrown(bench, wall)
        slides = found.spin > 7.5
        what = f"a spinning bead thrown sideways by a {wall}"
        for name, expected, kept, source in (
            ("sliding to the end", found.expected, slides, "μ(1+e)v_n"),
            ("all spins", found.model, found.spin > 0.0, MODEL),
        ):
            error = largest_error(found.sideways[kept, None], expected[kept, None])
            ends = float(expected[kept][-1]), float(found.sideways[kept][-1])
            yield Line(f"{what}, {name}", source, *ends, "μ v_n", 5e-3, error)
        stuck = float(found.sideways[0] / found.expected[0])
        said = f"{what}, sticking: over what a rigid bead gets, 2/7 Rω"
        yield Line(said, "0 to 2, by the spring's phase as it parts (Maw, Barber, Fawcett 1976)", 1.0, stuck)


CHECKS = (
    Check("sliding-to-rolling", 11, "a bead that slides until it rolls", False, sliding_lines),
    Check("first-step", 11, "the first step of a contact that starts to slide", False, first_step_lines),
    Check("rolling-to-rest", 11, "a bead that rolls to rest", False, rolling_lines),
    Check("spinning-impact", 11, "the impact of a spinning bead", False, spinning_lines),
    Check("film-slope", 11, "a bead on a slope in a film", False, film_lines),
)
