"""Group 10: the eight benchmark tests of Chung and Ooi for contact models, on walls that stand once and twice.

What each line is judged by:

- closed forms (Hertz, sliding all the way), to the time step (a thousandth of the contact) or, where surfaces turn, to
  the overlap over the radius, by which the engine shortens the arm of a force;
- `walkers.physics.impact.after_impact`, the engine's own model integrated apart from it, to the step at which a contact
  begins to slip;
- published points, to two per cent of the axis that they were read from.

Lines without a tolerance set finite elements and measurements beside a model that leaves out the micro-slip in the
contact, which Mindlin's spring does not have, or points on which the published simulations contradict each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from walkers.audit import chung_ooi as published
from walkers.audit.bench import Bench
from walkers.audit.check import Check, Line
from walkers.audit.impacts import (
    Course,
    Launch,
    Sphere,
    between_spheres,
    course_of_pair,
    course_on_floor,
    onto_floor,
    walls_of,
)
from walkers.audit.oblique import Oblique, as_the_model, excess_line, farthest, largest
from walkers.physics.impact import SURFACE_OVER_CENTRE, Impact, sliding_loss
from walkers.physics.wall import WALL_COPIES
from walkers.postprocess.dump import FloatArray

READING = 0.02
"""Of an axis: how far a point read off a printed figure may be off."""
STEP = 2e-3
"""Relative error of speeds and forces at a thousand steps a contact."""
_PAPER = "Chung, Ooi 2011, doi 10.1007/s10035-011-0277-0, "
_HERTZ = "Hertz: "
_WALL = frozenset({"walls"})

GLASS = Sphere(4.8e10, 0.20, 2800.0, 0.01)
LIMESTONE = Sphere(2.0e10, 0.25, 2500.0, 0.01)
ALLOY_OF_TEST_2 = Sphere(7.0e10, 0.30, 2699.0, 0.1)
MAGNESIUM = Sphere(4.0e10, 0.35, 1800.0, 0.1)
OXIDE = Sphere(3.8e11, 0.23, 4000.0, 2.5e-3)
CAST_IRON = Sphere(1.0e11, 0.25, 7000.0, 2.5e-3)
ALLOY_OF_TEST_4 = Sphere(7.0e10, 0.33, 2700.0, 2.5e-3)
STEEL = Sphere(2.08e11, 0.30, 7850.0, 1e-5)
ALLOY = Sphere(7.0e10, 0.33, 2700.0, 0.1)
RIGID = Sphere(7.0e13, 0.33, 2.7e6, 0.5)
"""The larger sphere of test 8: a thousand times stiffer and denser."""
ANGLES = np.arange(5.0, 90.0, 5.0)
"""Angles of incidence of the simulated points, degrees from the normal."""


def _course_lines(name: str, course: Course, impact: Impact, closing: float, leaving: float) -> Iterator[Line]:
    needs = _WALL if impact.copies > 1 else frozenset[str]()
    peak, lasts = impact.peak_force(closing), impact.duration(closing)
    yield Line(f"{name}: largest force", _HERTZ + "4/3 E* √R* δ^(3/2)", peak, course.peak, "N", STEP, None, needs)
    yield Line(f"{name}: duration", _HERTZ + "2.943 δ/v_n", lasts, course.duration, "s", STEP, None, needs)
    yield Line(f"{name}: speed after", "elastic: that before", leaving, course.rebound_speed, "m/s", STEP)


def pair(bench: Bench) -> dict[str, Course]:
    """Test 1: two equal spheres, 10 m/s each."""
    return {name: course_of_pair(bench, one, 10.0) for name, one in (("glass", GLASS), ("limestone", LIMESTONE))}


def pair_lines(bench: Bench) -> Iterator[Line]:
    """Test 1."""
    courses = pair(bench)
    for name, sphere in (("glass", GLASS), ("limestone", LIMESTONE)):
        yield from _course_lines(f"1: two spheres, {name}", courses[name], sphere.impact_on_equal(), 20.0, 10.0)
    source = _PAPER + "read off by Kratos"
    yield Line(
        "1: two spheres, limestone: published largest force", source, 7108.0, courses["limestone"].peak, "N", STEP
    )
    glass, time, overlap = courses["glass"], published.SPHERES_FORCE_TIME, published.SPHERES_FORCE_OVERLAP
    yield from _force_lines("1: two spheres, glass", glass, time, overlap, 12.0)


def _force_lines(
    what: str, course: Course, time: published.Points, overlap: published.Points, axis: float
) -> Iterator[Line]:
    force, loading = course.force / 1e3, slice(0, int(np.argmax(course.force)) + 1)
    source = _PAPER + "force in kN"
    yield farthest(f"{what}, force at a time in µs", source, time, course.time * 1e6, force, axis, READING)
    x, y = course.overlap[loading] * 1e6, force[loading]
    yield farthest(f"{what}, force at an overlap in µm", source, overlap, x, y, axis, READING)


def plane(bench: Bench) -> dict[str, Course]:
    """Test 2: a sphere on a rigid plane, 0.2 m/s; by wall."""
    return {wall: course_on_floor(bench, ALLOY_OF_TEST_2, 0.2, deck) for wall, deck in walls_of(bench).items()}


def plane_lines(bench: Bench) -> Iterator[Line]:
    """Test 2."""
    courses = plane(bench)
    for wall, copies in WALLS.items():
        impact = ALLOY_OF_TEST_2.impact_on_plane(copies=copies)
        yield from _course_lines(f"2: aluminium alloy on a {wall}", courses[wall], impact, 0.2, 0.2)
    single, time, overlap = courses["single wall"], published.PLANE_FORCE_TIME, published.PLANE_FORCE_OVERLAP
    yield from _force_lines("2: aluminium alloy on a single wall", single, time, overlap, 12.0)
    for wall, deck in walls_of(bench).items():
        impact = MAGNESIUM.impact_on_plane(copies=WALLS[wall])
        course = course_on_floor(bench, MAGNESIUM, 0.2, deck)
        if wall == "single wall":
            source, what = _PAPER + "read off by Kratos", "2: magnesium alloy: published largest force"
            yield Line(what, source, 7233.0, course.peak, "N", STEP)
        yield from _course_lines(f"2: magnesium alloy on a {wall}", course, impact, 0.2, 0.2)


WALLS = {"single wall": 1, "doubled wall": WALL_COPIES}
"""How often each stands in its deck."""
RESTITUTIONS = (0.2, 0.4, 0.6, 0.8, 1.0)


def damped(bench: Bench, sphere: Sphere = OXIDE) -> dict[str, Oblique]:
    """Test 3: a sphere on a plane at 3.9 m/s with several restitutions; by wall."""
    launches = tuple(Launch(3.9, restitution=restitution) for restitution in RESTITUTIONS)
    return {
        wall: Oblique(launches, sphere.impact_on_plane(copies=WALLS[wall]), onto_floor(bench, sphere, launches, deck))
        for wall, deck in walls_of(bench).items()
    }


def restitution_lines(bench: Bench) -> Iterator[Line]:
    """Test 3."""
    for name, sphere in (("aluminium oxide", OXIDE), ("cast iron", CAST_IRON)):
        for wall, found in damped(bench, sphere).items():
            copies = WALLS[wall]
            expected = [sphere.impact_on_plane(one, copies=copies).rebound for one in RESTITUTIONS]
            source = _PAPER + "as given" if copies == 1 else "of √2 times the damping ratio, Antypov, Elliott 2011"
            for given, one, measured in zip(RESTITUTIONS, expected, found.restitution, strict=True):
                what = f"3: restitution {given:g}, {name} on a {wall}"
                needs = _WALL if copies > 1 and given < 1.0 else frozenset[str]()
                yield Line(what, source, one, float(measured), "", 0.01, None, needs)


def by_angle(bench: Bench, sphere: Sphere = OXIDE) -> dict[str, Oblique]:
    """Test 4: at 3.9 m/s under several angles, restitution 0.98, friction 0.092; by wall."""
    measured = (published.ANGLE_MEASURED_RESTITUTION, published.ANGLE_MEASURED_SPIN, published.ANGLE_MEASURED_REBOUND)
    angles = np.radians(np.unique(np.concatenate([ANGLES, ANGLES - 2.5, *(points[:, 0] for points in measured)])))
    launches = tuple(
        Launch(float(normal), float(along), 0.0, 0.98, 0.092)
        for normal, along in zip(3.9 * np.cos(angles), 3.9 * np.sin(angles), strict=True)
    )
    return {wall: _oblique(bench, sphere, launches, wall) for wall in WALLS}


def _oblique(bench: Bench, sphere: Sphere, launches: tuple[Launch, ...], wall: str) -> Oblique:
    impact = sphere.impact_on_plane(launches[0].restitution, launches[0].friction, WALLS[wall])
    return Oblique(launches, impact, onto_floor(bench, sphere, launches, walls_of(bench)[wall]))


def angle_lines(bench: Bench) -> Iterator[Line]:
    """Test 4."""
    simulated = {
        "aluminium oxide": (OXIDE, published.ANGLE_OXIDE_RESTITUTION, published.ANGLE_OXIDE_SPIN),
        "aluminium alloy": (ALLOY_OF_TEST_4, published.ANGLE_ALLOY_RESTITUTION, published.ANGLE_ALLOY_SPIN),
    }
    for name, (sphere, restitution, spin) in simulated.items():
        for wall, found in by_angle(bench, sphere).items():
            what, source = f"4: {name} on a {wall}", _PAPER + "simulated"
            angle, back = found.angle, -found.rebound.spin
            yield as_the_model(what, found)
            loss = sliding_loss(0.092, 0.0, 1.0 + found.restitution) / np.tan(np.radians(angle))
            slides = angle > 36.0  # well beyond where a rigid sphere begins to: tan 32.5° = 7/2 μ(1+e)
            e_t = found.tangential_restitution
            kinematic = f"{what}, e_t of what slides all the way"
            yield largest(kinematic, "1 - μ(1+e)/tan θ", (1.0 - loss)[slides], e_t[slides], STEP)
            steep = (
                restitution[:, 0] < 15.0
            )  # e_t falls by 0.05 a degree there, so that it hangs on the angle's reading
            yield farthest(f"{what}, e_t from 15°", source, restitution[~steep], angle, e_t, 0.6, READING)
            yield farthest(f"{what}, e_t below 15°", source, restitution[steep], angle, e_t, 0.6, None)
            yield farthest(f"{what}, spin in rad/s", source, spin, angle, back, 800.0, READING)
            rebound = f"{what}, rebound angle in degrees"
            yield farthest(rebound, source, published.ANGLE_REBOUND, angle, found.rebound_angle, 120.0, READING)
            if sphere is OXIDE:
                yield from _measured_angle_lines(what, found)


def _measured_angle_lines(what: str, found: Oblique) -> Iterator[Line]:
    source = "measured, Kharaz et al. 2001, doi 10.1016/S0032-5910(01)00283-2"
    for quantity, points, ours, axis in (
        ("e_t", published.ANGLE_MEASURED_RESTITUTION, found.tangential_restitution, 0.6),
        ("spin in rad/s", published.ANGLE_MEASURED_SPIN, -found.rebound.spin, 800.0),
        ("rebound angle in degrees", published.ANGLE_MEASURED_REBOUND, found.rebound_angle, 120.0),
    ):
        yield farthest(f"{what}, {quantity}, measured", source, points, found.angle, ours, axis, None)


STEEL_FRICTION, STEEL_SPEED = 0.3, 5.0


def by_tangential_speed(bench: Bench) -> dict[str, Oblique]:
    """Test 5: a steel sphere at 5 m/s along the normal and several speeds along the plane, elastic; by wall."""
    curves = (
        published.TANGENTIAL_STEEL_SURFACE,
        published.TANGENTIAL_FINITE_ELEMENTS_SURFACE,
        published.TANGENTIAL_STEEL_SPIN,
        published.TANGENTIAL_FINITE_ELEMENTS_SPIN,
    )
    reduced = np.unique(np.concatenate([np.linspace(0.25, 13.0, 52), *(points[:, 0] for points in curves)]))
    launches = tuple(
        Launch(STEEL_SPEED, float(one) * STEEL_FRICTION * STEEL_SPEED, 0.0, 1.0, STEEL_FRICTION) for one in reduced
    )
    return {wall: _oblique(bench, STEEL, launches, wall) for wall in WALLS}


def tangential_lines(bench: Bench) -> Iterator[Line]:
    """Test 5."""
    for wall, found in by_tangential_speed(bench).items():
        what, x = f"5: steel on a {wall}", found.incidence / STEEL_FRICTION
        surface, turn = reduced_rebound(found)
        yield as_the_model(what, found)
        slides = x > 7.0
        arm = 2.5 * found.deepest  # 5/2 (1+e) times half of the overlap over the radius
        kinematic = "s/(μ v_n) - 7 (1+e = 2)"
        yield largest(f"{what}, surface of what slides all the way", kinematic, x[slides] - 7.0, surface[slides], arm)
        yield largest(
            f"{what}, spin of what slides all the way", "-5/2 (1+e)", np.full(slides.sum(), -5.0), turn[slides], arm
        )
        for by, surfaces, spins in (
            ("simulated", published.TANGENTIAL_STEEL_SURFACE, published.TANGENTIAL_STEEL_SPIN),
            (
                "finite elements",
                published.TANGENTIAL_FINITE_ELEMENTS_SURFACE,
                published.TANGENTIAL_FINITE_ELEMENTS_SPIN,
            ),
        ):
            for quantity, points, ours, axis in (("surface", surfaces, surface, 10.0), ("spin", spins, turn, 6.0)):
                fast = points[:, 0] > 5.5
                source = _PAPER + by
                yield farthest(f"{what}, {quantity}, {by}, sliding", source, points[fast], x, ours, axis, READING)
                yield farthest(f"{what}, {quantity}, {by}, the rest", source, points[~fast], x, ours, axis, None)


def reduced_rebound(found: Oblique) -> tuple[FloatArray, FloatArray]:
    """Velocity of the surface s'/(μ v_n') and spin -Rω'/(μ v_n) of test 5."""
    turn = -found.rebound.radius * found.rebound.spin / (found.impact.friction * found.motion.normal)
    return found.recoil / found.impact.friction, turn


def by_spin(bench: Bench) -> dict[str, Oblique]:
    """Test 6: a spinning sphere of aluminium alloy at 0.2 m/s, restitution 0.5, friction 0.4; by wall."""
    launches = tuple(Launch(0.2, 0.0, -spin, 0.5, 0.4) for spin in _spins(published.SPIN_ALLOY_BETA))
    return {wall: _oblique(bench, ALLOY, launches, wall) for wall in WALLS}


def _spins(beta: published.Points) -> list[float]:
    """Of all published points and those between, rad/s."""
    incidence = SURFACE_OVER_CENTRE * 0.4 * 1.5 / beta[:, 0]
    between = np.geomspace(incidence.min(), incidence.max(), 40)
    every = np.unique(np.concatenate([between, incidence, published.SPIN_ALLOY_RECOIL[:, 0]]))
    return [float(one) * 0.2 / ALLOY.radius for one in every]


def spin_lines(bench: Bench) -> Iterator[Line]:
    """Test 6."""
    for wall, found in by_spin(bench).items():
        what = f"6: aluminium alloy on a {wall}"
        needs = _WALL if found.impact.copies > 1 else frozenset[str]()
        yield as_the_model(what, found, needs)
        expected = found.impact.rebound
        line = largest(f"{what}, restitution", "of the damping", np.full(1, expected), found.restitution[:1], 0.01)
        yield replace(line, needs=needs)
        yield excess_line(what, found)
        if found.impact.copies == 1:
            yield from _spin_points("6", what, found, published.SPIN_ALLOY_BETA)
            yield farthest(
                f"{what}, recoil s'/v_n' at s/v_n", _PAPER + "simulated", published.SPIN_ALLOY_RECOIL,
                found.incidence, found.recoil, 10.0, None,
            )  # fmt: skip


def _spin_points(test: str, what: str, found: Oblique, points: published.Points) -> Iterator[Line]:
    sliding = points[:, 0] < 1.0
    source = f"{_PAPER}test {test}, simulated"
    x = found.stickiness
    yield farthest(f"{what}, -s'/s, sliding", source, points[sliding], x, found.beta, 1.6, None)
    yield farthest(f"{what}, -s'/s, the rest", source, points[~sliding], x, found.beta, 1.6, None)


def turning_together(bench: Bench) -> Oblique:
    """Test 7: two equal spheres that spin against each other, 0.2 m/s each, restitution 0.5, friction 0.4."""
    launches = tuple(Launch(0.2, 0.0, float(np.tan(np.radians(one))) * 2.0, 0.5, 0.4) for one in ANGLES)
    rebound = between_spheres(bench, ALLOY, ALLOY, launches, rise=0.2, turning_back=True)
    return Oblique(launches, ALLOY.impact_on_equal(0.5, 0.4), rebound)


def turning_lines(bench: Bench) -> Iterator[Line]:
    """Test 7."""
    found = turning_together(bench)
    spin = found.before("spin")
    source = _PAPER + "surfaces do not slide"
    turned = found.rebound.spin / spin
    yield largest("7: two spheres, spin after over before", source, np.ones_like(spin), turned, 1e-6)
    speed = found.rebound.tangential_speed / 0.2
    yield largest("7: two spheres, tangential speed over normal", source, np.zeros_like(spin), speed, 1e-6)
    yield largest("7: two spheres, restitution", "as given", np.full_like(spin, 0.5), found.restitution, 0.01)


def unequal(bench: Bench) -> Oblique:
    """Test 8: a spinning sphere at 0.2 m/s on a larger one, stiffer and heavier, restitution 0.5, friction 0.4."""
    launches = tuple(Launch(0.2, 0.0, -spin, 0.5, 0.4) for spin in _spins(published.UNEQUAL_A_BETA))
    rebound = between_spheres(bench, ALLOY, RIGID, launches)
    return Oblique(launches, ALLOY.impact_on_plane(0.5, 0.4), rebound)


def unequal_lines(bench: Bench) -> Iterator[Line]:
    """Test 8."""
    found = unequal(bench)
    what = "8: on a large sphere"
    yield as_the_model(f"{what}, as on a plane", found)
    yield excess_line(what, found)
    for case, points in (("case A", published.UNEQUAL_A_BETA), ("case B", published.UNEQUAL_B_BETA)):
        yield from _spin_points("8", f"{what}, {case}", found, points)


CHECKS = (
    Check("impact-pair", 10, "test 1: elastic impact of two equal spheres", False, pair_lines),
    Check("impact-plane", 10, "test 2: elastic impact of a sphere on a plane", False, plane_lines),
    Check("impact-restitution", 10, "test 3: damped impacts of a sphere on a plane", False, restitution_lines),
    Check("impact-angle", 10, "test 4: oblique impact under several angles", False, angle_lines),
    Check("impact-tangential", 10, "test 5: oblique impact at several tangential speeds", False, tangential_lines),
    Check("impact-spin", 10, "test 6: impact of a spinning sphere on a plane", False, spin_lines),
    Check("impact-counter-spin", 10, "test 7: two equal spheres that spin against each other", False, turning_lines),
    Check("impact-unequal", 10, "test 8: a spinning sphere on a larger one", False, unequal_lines),
)
