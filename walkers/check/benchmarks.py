"""The eight benchmark tests of Chung and Ooi for contact models, on the installed engine, beside their points.

What each line is judged by:

- closed forms (Hertz, sliding all the way), to the time step (a thousandth of the contact) or, where surfaces turn, to
  the overlap over the radius, by which the arm of a force is shorter;
- `walkers.physics.impact.after_impact`, the contact model integrated apart from the engine, to the step at which a
  contact begins to slip;
- published points, to two per cent of the axis that they were read from.

Lines of an infinite tolerance set finite elements and measurements beside a model that leaves out the micro-slip in the
contact, which Mindlin's spring does not have, or points on which the published simulations contradict each other.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.check import chung_ooi as published
from walkers.check.bench import Bench
from walkers.check.chapter import Chapter
from walkers.check.impacts import (
    Course,
    Launch,
    Rebound,
    Sphere,
    between_spheres,
    course_of_pair,
    course_on_floor,
    onto_floor,
)
from walkers.check.lines import Line, Verdict
from walkers.inputs.text import rendered
from walkers.physics.impact import SURFACE_OVER_CENTRE, Impact, Motion, after_impact
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.runner.binary import find_engine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

READING = 0.02
"""Of an axis: how far a point read off a printed figure may be off."""
STEP = 2e-3
"""Relative error of speeds and forces at a thousand steps a contact."""
SLIP = 5e-3
"""Of the sliding velocity: what the step at which a contact begins to slip makes of the rest, at a thousand steps."""

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
RESTITUTIONS = (0.2, 0.4, 0.6, 0.8, 1.0)
STEEL_FRICTION, STEEL_SPEED = 0.3, 5.0
_OURS = {"color": "C1", "label": "engine"}
_SIMULATED = {"ls": "", "marker": "o", "mfc": "none", "color": "0.35", "ms": 4.5}
_OTHER_SIMULATED = {"ls": "", "marker": "s", "mfc": "none", "color": "0.6", "ms": 4.0}
_INDEPENDENT = {"ls": "", "marker": "D", "color": "C4", "ms": 4.0, "mec": "0.3", "mew": 0.5}
_CLOSED = {"ls": ":", "color": "0.3", "lw": 1.0}


@dataclass(frozen=True)
class Oblique:
    """Rebounds of one series of launches, with what the closed forms need of them."""

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
    def reduced(self) -> tuple[FloatArray, FloatArray]:
        """Velocity of the surface s'/(μ v_n') and spin -Rω'/(μ v_n), as test 5 has them."""
        turn = -self.rebound.radius * self.rebound.spin / (self.impact.friction * self.motion.normal)
        return self.recoil / self.impact.friction, turn


@dataclass(frozen=True)
class Tests:
    """What the tests gave, by material where there are several."""

    pair: dict[str, tuple[Sphere, Course]]
    plane: dict[str, tuple[Sphere, Course]]
    damped: dict[str, Oblique]
    by_angle: dict[str, Oblique]
    by_tangential_speed: Oblique
    by_spin: Oblique
    turning: Oblique
    unequal: Oblique


def measure(bench: Bench) -> Tests:
    """Run the tests."""
    damped = tuple(Launch(3.9, restitution=one) for one in RESTITUTIONS)
    turns = np.tan(np.radians(np.arange(5.0, 90.0, 5.0))) * 2.0
    turning = tuple(Launch(0.2, 0.0, float(one), 0.5, 0.4) for one in turns)
    back = between_spheres(bench, ALLOY, ALLOY, turning, rise=0.2, turning_back=True)
    spinning, onto_larger = _spinning(published.SPIN_ALLOY_BETA), _spinning(published.UNEQUAL_A_BETA)
    larger = between_spheres(bench, ALLOY, RIGID, onto_larger)
    return Tests(
        pair={
            name: (one, course_of_pair(bench, one, 10.0)) for name, one in (("glass", GLASS), ("limestone", LIMESTONE))
        },
        plane={
            name: (one, course_on_floor(bench, one, 0.2))
            for name, one in (("aluminium alloy", ALLOY_OF_TEST_2), ("magnesium alloy", MAGNESIUM))
        },
        damped={name: _thrown(bench, one, damped) for name, one in (("oxide", OXIDE), ("cast iron", CAST_IRON))},
        by_angle={
            name: _thrown(bench, one, _angles())
            for name, one in (("aluminium oxide", OXIDE), ("aluminium alloy", ALLOY_OF_TEST_4))
        },
        by_tangential_speed=_thrown(bench, STEEL, _tangential()),
        by_spin=_thrown(bench, ALLOY, spinning),
        turning=Oblique(turning, ALLOY.impact_on_equal(0.5, 0.4), back),
        unequal=Oblique(onto_larger, ALLOY.impact_on_plane(0.5, 0.4), larger),
    )


def _thrown(bench: Bench, sphere: Sphere, launches: tuple[Launch, ...]) -> Oblique:
    impact = sphere.impact_on_plane(launches[0].restitution, launches[0].friction)
    return Oblique(launches, impact, onto_floor(bench, sphere, launches))


def _angles() -> tuple[Launch, ...]:
    """Test 4: at 3.9 m/s under several angles, restitution 0.98, friction 0.092."""
    measured = (published.ANGLE_MEASURED_RESTITUTION, published.ANGLE_MEASURED_SPIN, published.ANGLE_MEASURED_REBOUND)
    every = np.arange(2.5, 86.0, 2.5)
    angles = np.radians(np.unique(np.concatenate([every, *(points[:, 0] for points in measured)])))
    return tuple(Launch(3.9 * float(np.cos(one)), 3.9 * float(np.sin(one)), 0.0, 0.98, 0.092) for one in angles)


def _tangential() -> tuple[Launch, ...]:
    """Test 5: 5 m/s along the normal and several speeds along the plane, elastic."""
    curves = (
        published.TANGENTIAL_STEEL_SURFACE,
        published.TANGENTIAL_FINITE_ELEMENTS_SURFACE,
        published.TANGENTIAL_STEEL_SPIN,
        published.TANGENTIAL_FINITE_ELEMENTS_SPIN,
    )
    reduced = np.unique(np.concatenate([np.linspace(0.25, 13.0, 52), *(points[:, 0] for points in curves)]))
    speeds = [float(one) * STEEL_FRICTION * STEEL_SPEED for one in reduced]
    return tuple(Launch(STEEL_SPEED, one, 0.0, 1.0, STEEL_FRICTION) for one in speeds)


def _spinning(beta: published.Points) -> tuple[Launch, ...]:
    """Tests 6 and 8: 0.2 m/s, restitution 0.5, friction 0.4; the spins of all published points and those between."""
    incidence = SURFACE_OVER_CENTRE * 0.4 * 1.5 / beta[:, 0]
    between = np.geomspace(incidence.min(), incidence.max(), 40)
    every = np.unique(np.concatenate([between, incidence, published.SPIN_ALLOY_RECOIL[:, 0]]))
    return tuple(Launch(0.2, 0.0, -float(one) * 0.2 / ALLOY.radius, 0.5, 0.4) for one in every)


def farthest_point(
    what: str, points: published.Points, x: FloatArray, y: FloatArray, axis: float, tolerance: float = READING
) -> Line:
    """The one of some points that is farthest from a curve through (x, y); judged by the distance over the axis."""
    order = np.argsort(x)
    away = np.interp(points[:, 0], x[order], y[order]) - points[:, 1]
    worst = int(np.argmax(np.abs(away)))
    return Line(
        f"{what}: farthest point, at {points[worst, 0]:g}, over the axis", 0.0, float(away[worst]) / axis, tolerance
    )


def largest(what: str, expected: FloatArray | float, measured: FloatArray, tolerance: float) -> Line:
    """The largest of several differences."""
    away = measured - expected
    return Line(what, 0.0, float(away[np.argmax(np.abs(away))]), tolerance)


def head_on_lines(found: Tests) -> Iterator[Line]:
    """Tests 1 to 3."""
    for test, courses, closing in ((1, found.pair, 20.0), (2, found.plane, 0.2)):
        for name, (sphere, course) in courses.items():
            impact = sphere.impact_on_equal() if test == 1 else sphere.impact_on_plane()
            leaving = closing / 2.0 if test == 1 else closing
            yield Line(f"{test}: {name}, largest force", impact.peak_force(closing), course.peak, STEP, "N")
            yield Line(f"{test}: {name}, duration", impact.duration(closing), course.duration, STEP, "s")
            yield Line(f"{test}: {name}, speed after", leaving, course.rebound_speed, STEP, "m/s")
    for what, course, force in (
        ("1: limestone", found.pair["limestone"][1], 7108.0),
        ("2: magnesium alloy", found.plane["magnesium alloy"][1], 7233.0),
    ):
        yield Line(f"{what}: published largest force", force, course.peak, STEP, "N")
    for what, (_, course), time, overlap in (
        ("1: glass", found.pair["glass"], published.SPHERES_FORCE_TIME, published.SPHERES_FORCE_OVERLAP),
        ("2: alloy", found.plane["aluminium alloy"], published.PLANE_FORCE_TIME, published.PLANE_FORCE_OVERLAP),
    ):
        kilonewtons, loading = course.force / 1e3, slice(0, int(np.argmax(course.force)) + 1)
        yield farthest_point(f"{what}, force at a time in µs", time, course.time * 1e6, kilonewtons, 12.0)
        x, y = course.overlap[loading] * 1e6, kilonewtons[loading]
        yield farthest_point(f"{what}, force at an overlap in µm", overlap, x, y, 12.0)
    for name, one in found.damped.items():
        for given, measured in zip(RESTITUTIONS, one.restitution, strict=True):
            yield Line(f"3: {name}, restitution", given, float(measured), 0.01)


def as_the_model(what: str, found: Oblique) -> Line:
    """What became of the surfaces' velocities, against the model integrated apart from the engine."""
    law, before = after_impact(found.impact, found.motion), found.motion.sliding
    return largest(f"{what}, surface after over before, beside the model", law.sliding / before,
                   found.rebound.sliding / before, SLIP)  # fmt: skip


def angle_lines(found: Tests) -> Iterator[Line]:
    """Test 4."""
    simulated = {
        "aluminium oxide": (published.ANGLE_OXIDE_RESTITUTION, published.ANGLE_OXIDE_SPIN),
        "aluminium alloy": (published.ANGLE_ALLOY_RESTITUTION, published.ANGLE_ALLOY_SPIN),
    }
    for name, one in found.by_angle.items():
        what, (restitution, spin) = f"4: {name}", simulated[name]
        angle, e_t = one.angle, one.tangential_restitution
        yield as_the_model(what, one)
        slides = angle > 36.0  # well beyond where a rigid sphere begins to: tan 32.5° = 7/2 μ(1+e)
        expected = 1.0 - 0.092 * (1.0 + one.restitution) / np.tan(np.radians(angle))
        yield largest(f"{what}, e_t of what slides all the way, 1 - μ(1+e)/tan θ", expected[slides], e_t[slides], STEP)
        steep = restitution[:, 0] < 15.0  # e_t falls by 0.05 a degree there, so that it hangs on the angle's reading
        yield farthest_point(f"{what}, e_t from 15°", restitution[~steep], angle, e_t, 0.6)
        yield farthest_point(f"{what}, e_t below 15°", restitution[steep], angle, e_t, 0.6, inf)
        yield farthest_point(f"{what}, spin", spin, angle, -one.rebound.spin, 800.0)
        yield farthest_point(f"{what}, rebound angle", published.ANGLE_REBOUND, angle, one.rebound_angle, 120.0)
    one = found.by_angle["aluminium oxide"]
    for quantity, points, ours, axis in (
        ("e_t", published.ANGLE_MEASURED_RESTITUTION, one.tangential_restitution, 0.6),
        ("spin", published.ANGLE_MEASURED_SPIN, -one.rebound.spin, 800.0),
        ("rebound angle", published.ANGLE_MEASURED_REBOUND, one.rebound_angle, 120.0),
    ):
        yield farthest_point(f"4: aluminium oxide, {quantity}, measured", points, one.angle, ours, axis, inf)


def tangential_lines(found: Tests) -> Iterator[Line]:
    """Test 5."""
    one = found.by_tangential_speed
    x, (surface, turn) = one.incidence / STEEL_FRICTION, one.reduced
    yield as_the_model("5: steel", one)
    slides = x > 7.0
    # 5/2 (1+e) times half of the overlap over the radius
    arm = 2.5 * one.impact.depth(float(one.motion.normal.max())) / one.impact.radius
    yield largest("5: surface of what slides all the way, s/(μ v_n) - 7", x[slides] - 7.0, surface[slides], arm)
    yield largest("5: spin of what slides all the way, -5", -5.0, turn[slides], arm)
    steel = (published.TANGENTIAL_STEEL_SURFACE, published.TANGENTIAL_STEEL_SPIN)
    elements = (published.TANGENTIAL_FINITE_ELEMENTS_SURFACE, published.TANGENTIAL_FINITE_ELEMENTS_SPIN)
    for by, curves in (("simulated", steel), ("finite elements", elements)):
        for quantity, points, ours, axis in zip(("surface", "spin"), curves, (surface, turn), (10.0, 6.0), strict=True):
            fast = points[:, 0] > 5.5
            yield farthest_point(f"5: {quantity}, {by}, sliding", points[fast], x, ours, axis)
            yield farthest_point(f"5: {quantity}, {by}, the rest", points[~fast], x, ours, axis, inf)


def spin_lines(found: Tests) -> Iterator[Line]:
    """Tests 6 to 8."""
    for what, one, curves in (
        ("6: on a plane", found.by_spin, {"": published.SPIN_ALLOY_BETA}),
        (
            "8: on a larger sphere",
            found.unequal,
            {", case A": published.UNEQUAL_A_BETA, ", case B": published.UNEQUAL_B_BETA},
        ),
    ):
        x = one.stickiness
        yield as_the_model(what, one)
        slides = x < 0.9
        yield largest(f"{what}, -s'/s of what slides all the way, x - 1", x[slides] - 1.0, one.beta[slides], SLIP)
        for case, points in curves.items():
            sliding = points[:, 0] < 1.0
            yield farthest_point(f"{what}{case}, -s'/s, sliding", points[sliding], x, one.beta, 1.6)
            yield farthest_point(f"{what}{case}, -s'/s, the rest", points[~sliding], x, one.beta, 1.6, inf)
    yield largest("6: on a plane, restitution", 0.5, found.by_spin.restitution, 0.005)
    spin, speed = (
        found.turning.rebound.spin / found.turning.before("spin"),
        found.turning.rebound.tangential_speed / 0.2,
    )
    yield largest("7: spin after over before", 1.0, spin, 1e-6)
    yield largest("7: tangential speed over normal", 0.0, speed, 1e-6)
    yield largest("7: restitution", 0.5, found.turning.restitution, 0.005)


def lines_of(found: Tests) -> list[Line]:
    """All lines."""
    return [*head_on_lines(found), *angle_lines(found), *tangential_lines(found), *spin_lines(found)]


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The benchmarks on the installed engine; they take seconds, however ``quick`` it is to be, and leave no runs."""
    del out, quick
    with tempfile.TemporaryDirectory(prefix="walkers-study-") as folder:
        found = measure(Bench(find_engine(), Path(folder)))
    lines = lines_of(found)
    judged = [line for line in lines if line.tolerance < inf]
    failed = tuple(line.what for line in judged if line.verdict is not Verdict.PASS)
    text = rendered(
        "walkers.check",
        "benchmarks.md.j2",
        judged=len(judged),
        failed=len(failed),
        worst=line_table(_worst_of_each_test(judged)),
        angles=angle_table(found.by_angle["aluminium oxide"]),
        tangential=tangential_table(found.by_tangential_speed),
        spins=spin_table(found),
    )
    figures = {
        "benchmarks-normal": fig_normal(found),
        "benchmarks-angle": fig_angle(found.by_angle["aluminium oxide"]),
        "benchmarks-spin": fig_spin(found),
    }
    numbers = {line.what: {"expected": line.expected, "measured": line.measured} for line in lines}
    return Chapter("benchmarks", "Published benchmarks of impacts", text, figures, numbers, failed)


def _worst_of_each_test(lines: Iterable[Line]) -> list[Line]:
    """Of each test the line that comes nearest to its tolerance."""
    worst: dict[str, Line] = {}
    for line in sorted(lines, key=lambda line: line.error / line.tolerance):
        worst[line.what[0]] = line
    return [worst[test] for test in sorted(worst)]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    cells = [" | ".join(cell.replace("|", "\\|") for cell in row) for row in (head, ["---"] * len(head), *rows)]
    return "\n".join(f"| {row} |" for row in cells)


def line_table(lines: Iterable[Line]) -> str:
    """A Markdown table of lines."""
    rows = [
        (line.what, f"{line.expected:.4g} {line.unit}".strip(), f"{line.measured:.4g} {line.unit}".strip(),
         f"{line.error:.1e}", f"{line.tolerance:.0e}", str(line.verdict))
        for line in lines
    ]  # fmt: skip
    return table(("what", "expected", "engine", "error", "tolerance", ""), rows)


def _at(points: FloatArray, x: float, within: float) -> str:
    """The y of the point nearest to x, or nothing."""
    nearest = int(np.argmin(np.abs(points[:, 0] - x)))
    return f"{points[nearest, 1]:.3g}" if abs(points[nearest, 0] - x) < within else ""


def _ours(x: FloatArray, y: FloatArray, at: float) -> str:
    order = np.argsort(x)
    return f"{np.interp(at, x[order], y[order]):.3g}"


def angle_table(found: Oblique) -> str:
    """Test 4: tangential restitution."""
    rows = [
        (
            f"{angle:g}°",
            _at(published.ANGLE_OXIDE_RESTITUTION, angle, 1.0),
            _at(published.ANGLE_MEASURED_RESTITUTION, angle, 1.2),
            _ours(found.angle, found.tangential_restitution, angle),
        )
        for angle in (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0)
    ]
    return table(("angle", "simulated", "measured", "engine"), rows)


def tangential_table(found: Oblique) -> str:
    """Test 5: the surface's velocity, at the incidences of the finite elements."""
    incidence, surface = found.incidence / STEEL_FRICTION, found.reduced[0]
    rows = [
        (f"{x:.3g}", f"{y:.3g}", _at(published.TANGENTIAL_STEEL_SURFACE, float(x), 0.3), _ours(incidence, surface, x))
        for x, y in published.TANGENTIAL_FINITE_ELEMENTS_SURFACE
    ]
    return table(("s/(μ vₙ)", "finite elements", "simulated (nearest)", "engine"), rows)


def spin_table(found: Tests) -> str:
    """Tests 6 and 8: what the surface's velocity becomes."""
    both = (found.by_spin, found.unequal)
    rows = [
        (f"{x:.3g}", f"{alloy:.3g}", _at(published.SPIN_NYLON_BETA, float(x), 0.2),
         *(_ours(one.stickiness, one.beta, float(x)) for one in both))
        for x, alloy in published.SPIN_ALLOY_BETA
    ]  # fmt: skip
    return table(("7/2 μ(1+e) vₙ/s", "6: alloy", "6: nylon", "6: engine", "8: engine"), rows)


@styled
def fig_normal(found: Tests) -> Figure:
    """Tests 1 to 3."""
    figure, (one, two, three) = new_figure(TWO_COLUMNS, 3.2, ncols=3)
    for axes, points, course, title, end in (
        (one, published.SPHERES_FORCE_TIME, found.pair["glass"][1], "test 1: glass spheres", 45.0),
        (two, published.PLANE_FORCE_TIME, found.plane["aluminium alloy"][1], "test 2: alloy on a plane", 800.0),
    ):
        axes.plot(*points.T, label="published", **_SIMULATED)
        axes.plot(course.time * 1e6, course.force / 1e3, **_OURS)
        axes.set(xlabel="time (µs)", ylabel="force (kN)", title=title, xlim=(0.0, end))
        axes.set_ylim(0.0, None)
    three.plot([0.0, 1.0], [0.0, 1.0], label="as given", **_CLOSED)
    three.plot(RESTITUTIONS, found.damped["oxide"].restitution, ls="", marker="o", ms=5.0, **_OURS)
    three.set(xlabel="restitution given", ylabel="restitution", title="test 3: oxide on a plane")
    for axes in (one, two, three):
        legend_below(axes)
    letter_panels((one, two, three))
    return figure


@styled
def fig_angle(found: Oblique) -> Figure:
    """Test 4."""
    figure, panels = new_figure(TWO_COLUMNS, 3.1, ncols=3)
    drawn = (
        ("tangential restitution", published.ANGLE_OXIDE_RESTITUTION, published.ANGLE_MEASURED_RESTITUTION),
        ("spin (rad/s)", published.ANGLE_OXIDE_SPIN, published.ANGLE_MEASURED_SPIN),
        ("rebound angle of the surface (°)", published.ANGLE_REBOUND, published.ANGLE_MEASURED_REBOUND),
    )
    ours = (found.tangential_restitution, -found.rebound.spin, found.rebound_angle)
    for axes, (label, simulated, seen), values in zip(panels, drawn, ours, strict=True):
        axes.plot(*simulated.T, label="simulated, published", **_SIMULATED)
        axes.plot(*seen.T, label="measured (Kharaz et al.)", **_INDEPENDENT)
        axes.plot(found.angle, values, **_OURS)
        axes.set(xlabel="angle of incidence (°)", ylabel=label, xlim=(0.0, 90.0))
    letter_panels(panels)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


@styled
def fig_spin(found: Tests) -> Figure:
    """Tests 5, 6 and 8."""
    figure, ((surface, turn), (six, eight)) = new_figure(TWO_COLUMNS, 7.0, nrows=2, ncols=2)
    surface.plot(*published.TANGENTIAL_STEEL_SURFACE.T, label="simulated, steel", **_SIMULATED)
    surface.plot(*published.TANGENTIAL_POLYETHYLENE_SURFACE.T, label="simulated, polyethylene", **_OTHER_SIMULATED)
    surface.plot(*published.TANGENTIAL_FINITE_ELEMENTS_SURFACE.T, label="finite elements", **_INDEPENDENT)
    turn.plot(*published.TANGENTIAL_STEEL_SPIN.T, **_SIMULATED)
    turn.plot(*published.TANGENTIAL_FINITE_ELEMENTS_SPIN.T, **_INDEPENDENT)
    one = found.by_tangential_speed
    for axes, values in zip((surface, turn), one.reduced, strict=True):
        axes.plot(one.incidence / STEEL_FRICTION, values, **_OURS)
    surface.set(xlabel="s/(μ vₙ)", ylabel="s′/(μ vₙ′)", title="test 5: steel, elastic", xlim=(0.0, 13.2))
    surface.set_ylim(top=7.0)  # of what is shown
    turn.set(xlabel="s/(μ vₙ)", ylabel="-Rω′/(μ vₙ)", title="test 5: steel, elastic", xlim=(0.0, 13.2))
    legend_below(surface, ncols=2)
    six.plot(*published.SPIN_ALLOY_BETA.T, label="simulated, aluminium alloy", **_SIMULATED)
    six.plot(*published.SPIN_NYLON_BETA.T, label="simulated, nylon", **_OTHER_SIMULATED)
    eight.plot(*published.UNEQUAL_A_BETA.T, label="simulated, case A", **_SIMULATED)
    eight.plot(*published.UNEQUAL_B_BETA.T, label="simulated, case B", **{**_OTHER_SIMULATED, "marker": "x"})
    slides = np.geomspace(0.15, 1.0, 40)
    for axes, ours, title in (
        (six, found.by_spin, "test 6: on a plane, e = 0.5"),
        (eight, found.unequal, "test 8: on a larger sphere, e = 0.5"),
    ):
        axes.plot(ours.stickiness, ours.beta, **_OURS)
        axes.plot(slides, slides - 1.0, label="slides all the way: x - 1", **_CLOSED)
        axes.set(xlabel="7/2 μ(1+e) vₙ/s", ylabel="-s′/s", title=title, xscale="log")
        legend_below(axes, ncols=2)
    letter_panels((surface, turn, six, eight))
    return figure
