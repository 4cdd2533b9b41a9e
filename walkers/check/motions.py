"""Motions with closed forms: impacts, friction, rolling, falling; and that a walker's way converges with the step.

A bead of radius R and mass m, I = 2/5 m R²:

- two surfaces that meet at v_n have Hertz's largest force and duration, and part with the restitution;
- while it slides the floor takes μ (1 + e) m v_n of its momentum, however it is damped;
- sent off sliding at u on a floor of friction μ it has v = u - μ g t and Rω = 5/2 μ g t, until it rolls with 5/7 u;
- rolling to and fro in a cylinder of radius C that lies on its side it has ω² = 5/7 g/(C - R);
- rolling against a torque μ_r R m g it slows at 5/7 μ_r g, for friction turns it while it brakes it;
- in the air it falls at g, and the frame of the shaken walls adds a0 sin ωt.

References are in `walkers.physics.impact`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np

from walkers.check.bench import DRY, Bench, Measured, bench_case, bench_recording, bench_scene, farthest, free_run
from walkers.check.impacts import Course, Launch, Sphere, course_of_pair, course_on_floor, onto_floor
from walkers.check.lines import Check, Line
from walkers.inputs.boundary import Round
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.physics.impact import Impact
from walkers.templates.deck import Plan, plan_of
from walkers.templates.layout import BEAD_COLUMNS, FORCE_COLUMNS
from walkers.templates.scene import Bead

GRAVITY, RADIUS = 9.81, 3e-4
_GLASS = Sphere(4.8e10, 0.20, 2800.0, 0.01)
_STEP = 2e-3
"""Relative error of speeds and forces at a thousand steps a contact."""


def _course(name: str, course: Course, impact: Impact, closing: float, leaving: float) -> Iterator[Line]:
    yield Line(f"{name}: largest force, 4/3 E* √R* δ^(3/2)", impact.peak_force(closing), course.peak, _STEP, "N")
    yield Line(f"{name}: duration, 2.943 δ/v_n", impact.duration(closing), course.duration, _STEP, "s")
    yield Line(f"{name}: speed after, that before", leaving, course.rebound_speed, _STEP, "m/s")


def impact_lines(bench: Bench) -> Iterator[Line]:
    """Head on, elastic and damped; and sliding all the way, elastic and damped."""
    yield from _course("two spheres", course_of_pair(bench, _GLASS, 10.0), _GLASS.impact_on_equal(), 20.0, 10.0)
    yield from _course("a sphere on a plane", course_on_floor(bench, _GLASS, 0.2), _GLASS.impact_on_plane(), 0.2, 0.2)
    friction, speed, fast = 0.1, 0.2, 2.0
    for given in (0.3, 0.6, 0.9):
        rebound = onto_floor(bench, _GLASS, [Launch(speed, fast, 0.0, given, friction)])
        e = float(rebound.normal_speed[0]) / speed
        yield Line(f"restitution, {given:g}", given, e, 0.01)
        lost = (fast - float(rebound.tangential_speed[0])) / (friction * (1.0 + e) * speed)
        yield Line(f"momentum lost by sliding over μ(1+e)m v_n, restitution {given:g}", 1.0, lost, _STEP)
        turned = 0.4 * _GLASS.radius * float(rebound.spin[0]) / (friction * (1.0 + e) * speed)
        yield Line(f"its moment over R times that, restitution {given:g}", 1.0, turned, _STEP)


def _heavy_case(**contact: object) -> Case:
    return bench_case(
        liquid=DRY,
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.5}, "restitution": 0.3, **contact},
        environment={"gravity": f"{GRAVITY} m/s^2"},
        run={"time_step": "2 us"},
    )


def _height(case: Case) -> float:
    """Of a bead in balance on a floor, m."""
    mass = 4.0 / 3.0 * pi * RADIUS**3 * case.density
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    return RADIUS - hertz_overlap(mass * GRAVITY, RADIUS, modulus)


def _way(bench: Bench, case: Case, velocity: float, spin: float, duration: float) -> Measured:
    """A bead in balance on the floor that is sent off along x, turning about y."""
    bead = Bead(0, (0.0, 0.0, _height(case)), RADIUS, (velocity, 0.0, 0.0), (0.0, spin, 0.0))
    every = max(1, round(duration / case.run.time_step / 200.0))
    return bench.run(Plan(case, bench_scene([bead]), bench_recording(200 * every, every)))


def rolling_lines(bench: Bench) -> Iterator[Line]:
    """Sliding into rolling, and rolling to rest."""
    friction, speed = 0.1, 0.05
    case = _heavy_case(friction={"bead_bead": 0.0, "bead_wall": friction})
    rolls = 2.0 * speed / (7.0 * friction * GRAVITY)
    series = _way(bench, case, speed, 0.0, 1.5 * rolls)
    slid = np.minimum(series.time, rolls)
    error = farthest(series.velocity[:, 0, 0, None], speed - friction * GRAVITY * slid[:, None])
    yield Line("a bead slides until it rolls: u - μgt, at most off by", 0.0, error, _STEP)
    error = farthest(RADIUS * series.spin[:, 0, 1, None], 2.5 * friction * GRAVITY * slid[:, None])
    yield Line("its Rω: 5/2 μgt, at most off by", 0.0, error, _STEP)
    yield Line(
        "its velocity at the end over that at the start", 5.0 / 7.0, float(series.velocity[-1, 0, 0]) / speed, _STEP
    )
    yield _trough_line(bench)
    rolling, speed = 0.01, 5e-3
    slowing = 5.0 / 7.0 * rolling * GRAVITY
    series = _way(bench, _heavy_case(rolling_friction=rolling), speed, speed / RADIUS, 1.3 * speed / slowing)
    error = farthest(series.velocity[:, 0, 0, None], np.maximum(speed - slowing * series.time, 0.0)[:, None])
    yield Line("a bead rolls to rest: u - 5/7 μ_r g t, at most off by", 0.0, error, _STEP)


def _trough_line(bench: Bench) -> Line:
    """A bead that is let go a little beside the lowest line of a cylinder on its side."""
    case = bench_case(
        liquid=DRY,
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.9}, "restitution": 0.3},
        environment={"gravity": f"{GRAVITY} m/s^2"},
        boundary={"tilt": "90 deg", "uphill": "0 deg"},
        run={"time_step": "1 us"},
    )
    wall, turn = Round(3e-3), 0.05
    depth = RADIUS - _height(case)
    out = wall.radius - RADIUS + depth
    bead = Bead(0, (-out * cos(turn), out * sin(turn), 0.0), RADIUS)
    frequency = sqrt(5.0 / 7.0 * GRAVITY / out) * (1.0 - turn**2 / 16.0)
    series = bench.run(Plan(case, bench_scene([bead], [wall]), bench_recording(200 * 500, 500)))
    swings = out * np.sin(turn * np.cos(frequency * series.time))
    return Line(
        "a bead rolls to and fro in a cylinder: ω² = 5/7 g/(C - R), at most off by",
        0.0, farthest(series.position[:, 0, 1, None], swings[:, None]), _STEP,
    )  # fmt: skip


def flight_lines(bench: Bench) -> Iterator[Line]:
    """A bead in the air, in the frame of walls that are shaken."""
    case = bench_case(
        drive={"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": "x"},
        environment={"gravity": f"{GRAVITY} m/s^2"},
    )
    bead = Bead(0, (0.0, 0.0, 5e-3), RADIUS, (0.1, 0.2, 0.0), (1.0, 2.0, 3.0))
    series = bench.run(Plan(case, bench_scene([bead]), bench_recording(10_000, 100)))
    wave, t = case.drive.harmonics[0], series.time
    shaken = wave.peak_acceleration / wave.angular_frequency * (1.0 - np.cos(wave.angular_frequency * t))
    expected = np.stack([0.1 + shaken, 0.2 + 0.0 * t, -GRAVITY * t], axis=-1)
    yield Line("free flight: velocity, at most off by", 0.0, farthest(series.velocity[:, 0], expected), 1e-5)
    expected = np.broadcast_to((1.0, 2.0, 3.0), (len(t), 3))
    yield Line("free flight: spin, at most off by", 0.0, farthest(series.spin[:, 0], expected), 1e-12)


def _walker(cycles: int) -> Case:
    """The walker of Fig. 1b, alone, for so many cycles."""
    case = load_case("fig1b")
    run = replace(case.run, cycles=cycles, cycles_per_segment=cycles, until_steady=False)
    return replace(case, walkers=(replace(case.walkers[0], replicates=1),), run=run)


def _recorded(*cases: Case) -> Plan:
    """The plan of cases that share a deck, with forces."""
    plan = plan_of(*cases)
    return replace(plan, recording=replace(plan.recording, bead_columns=(*BEAD_COLUMNS, *FORCE_COLUMNS)))


def step_lines(bench: Bench) -> Iterator[Line]:
    """A walker's way in four cycles, with the step that ``auto`` takes, its half and its quarter."""
    case = _walker(4)
    ways = []
    for finer in (1, 2, 4):
        plan = plan_of(replace(case, run=free_run(case.run, case.run.time_step / finer)))
        steps = round(4.0 / case.drive.frequency / case.run.time_step) * finer
        series = bench.run(replace(plan, recording=bench_recording(steps, steps)))
        ways.append(series.position[-1] - series.position[0])
    coarse, fine = farthest(ways[0], ways[2]), farthest(ways[1], ways[2])
    yield Line("a walker's way with half a step, off that with a quarter by", 0.0, fine, 2e-3)
    yield Line("the same with a whole step", 0.0, coarse, 5e-3)


def company_lines(bench: Bench) -> Iterator[Line]:
    """A walker among others of its deck, driven otherwise or not, beside the same one alone; and a rerun."""
    alone = _walker(10)
    alone = replace(alone, contact=replace(alone.contact, rolling_friction=0.0))  # which amplifies rounding
    other = replace(alone, drive=alone.drive.with_peak(2.0 * alone.drive.peak_acceleration))
    sloping = replace(alone, boundary=replace(alone.boundary, tilt=0.3))
    first, again = (bench.run(_recorded(alone)) for _ in range(2))
    together = bench.run(_recorded(other, alone, sloping))
    ways = (first.position[:, :2] - first.position[0, :2], together.position[:, 2:4] - together.position[0, 2:4])
    yield Line("a walker's way among others beside that alone, off by", 0.0, farthest(ways[1], ways[0]), 1e-9)
    dumps = [(series.directory / "beads.bin").read_bytes() for series in (first, again)]
    yield Line("a rerun is the same to the last bit: 0", 0.0, float(dumps[0] != dumps[1]), 0.0)


CHECKS = (
    Check("impacts", "impacts: Hertz, restitution, Coulomb", impact_lines),
    Check("rolling", "a bead that slides until it rolls, and one that rolls to rest", rolling_lines),
    Check("flight", "a bead in the air", flight_lines),
    Check("company", "a walker among others, and a rerun", company_lines),
    Check("step", "a walker's way with smaller steps", step_lines, quick=False),
)
