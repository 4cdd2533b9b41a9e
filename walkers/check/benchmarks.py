"""The benchmark tests of Chung and Ooi for contact models: the second engine and the published points.

What each line is judged by: closed forms (Hertz, gross sliding), to the time step (a thousandth of the contact)
or, where surfaces turn, to the overlap over the radius, by which the arm of a force is shorter; published points, to
two per cent of the axis that they were read from.

Points that are not judged (``chung_ooi.toml``) are measurements and finite elements beside a model that leaves out the
micro-slip in the contact, which Mindlin's spring does not have, or contradict each other.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from math import ceil, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from walkers.check.engine import SecondEngine
from walkers.check.kernels import FloatArray
from walkers.check.report import Chapter, Line
from walkers.check.scenes import DRY, FLOOR, bench_case
from walkers.inputs.case import Friction
from walkers.physics.contact import Impact, reduced_modulus
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

READING, STEP, SLIP = 0.02, 2e-3, 5e-3
"""How far off may be: a point read off a printed figure, of the axis; speeds and forces at a thousand steps a contact;
sliding, of its velocity, by the step at which a contact begins to slip."""
_STEPS, _LONGEST = 1000, 1.5
"""Steps of the shortest contact; how long impacts are followed, over the longest elastic one, as damped ones last."""

Curves = dict[str, tuple[FloatArray, FloatArray]]
"""x and y by panel of ``chung_ooi.toml``."""


class Sphere(NamedTuple):
    """Young's modulus (Pa), Poisson's ratio, density (kg/m³) and radius (m) of a sphere."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    radius: float

    def on_plane(self) -> Impact:
        """Its impact on a rigid plane, E* = E/(1-ν²), twice that of two bodies of its modulus."""
        mass = self.density * 4.0 / 3.0 * pi * self.radius**3
        return Impact(mass, self.radius, 2.0 * reduced_modulus(self.youngs_modulus, self.poissons_ratio))

    def on_equal(self) -> Impact:
        """Impact on an identical sphere."""
        plane = self.on_plane()
        return Impact(plane.mass / 2.0, self.radius / 2.0, plane.modulus / 2.0)

    def engine(self, start: FloatArray, step: float, restitution: float, friction: float, *, on_plane: bool) -> Any:
        """The second engine with such spheres; a modulus twice theirs is a rigid plane's other side."""
        modulus = (2.0 if on_plane else 1.0) * self.youngs_modulus
        case = bench_case(liquid=DRY)
        contact = case.contact.but(
            friction=Friction(bead_bead=friction, bead_wall=friction),
            restitution=restitution,
            youngs_modulus=modulus,
            poissons_ratio=self.poissons_ratio,
            minimum_separation_ratio=0.01,
        )
        case = case.but(contact=contact).put("beads.density", self.density).put("run.time_step", step)
        return SecondEngine(case, np.full(len(start), self.radius), start, walls=[FLOOR])


GLASS = Sphere(4.8e10, 0.20, 2800.0, 0.01)
LIMESTONE = Sphere(2.0e10, 0.25, 2500.0, 0.01)
ALLOY_OF_TEST_2 = Sphere(7.0e10, 0.30, 2699.0, 0.1)
MAGNESIUM = Sphere(4.0e10, 0.35, 1800.0, 0.1)
OXIDE = Sphere(3.8e11, 0.23, 4000.0, 2.5e-3)
CAST_IRON = Sphere(1.0e11, 0.25, 7000.0, 2.5e-3)
ALLOY_OF_TEST_4 = Sphere(7.0e10, 0.33, 2700.0, 2.5e-3)
STEEL = Sphere(2.08e11, 0.30, 7850.0, 1e-5)
ALLOY = Sphere(7.0e10, 0.33, 2700.0, 0.1)


class Speeds(NamedTuple):
    """Of N spheres at a plane, arrays of shape (N,), m/s.

    ``normal`` is that of the centre toward or away from the plane, ``tangential`` that along it, and ``rolling`` is Rω,
    so that the surface at the contact slides with the difference of the two.
    """

    normal: FloatArray
    tangential: FloatArray
    rolling: FloatArray

    @property
    def sliding(self) -> FloatArray:
        """Sliding velocity of the surfaces at the contact, m/s."""
        return self.tangential - self.rolling


def onto_plane(sphere: Sphere, before: Speeds, restitution: float = 1.0, friction: float = 0.0) -> Speeds:
    """Speeds of spheres after an impact on a rigid plane, one sphere at a time."""
    zeros, radius, impact = np.zeros_like(before.normal), sphere.radius, sphere.on_plane()
    places = [4.0 * radius * np.arange(len(zeros)), zeros, zeros + radius]
    velocities = [before.tangential, zeros, -before.normal]
    start = np.stack([*places, *velocities, zeros, before.rolling / radius, zeros], axis=-1)
    step = impact.duration(float(before.normal.max())) / _STEPS
    steps = ceil(_LONGEST * impact.duration(float(before.normal.min())) / step)
    frame = sphere.engine(start, step, restitution, friction, on_plane=True).run(steps, steps)[0]
    return Speeds(frame[:, 5], frame[:, 3], radius * frame[:, 7])


class Course(NamedTuple):
    """A head-on impact: time from the touch (s) and force (N), shape (F,), duration (s); speed and spin afterwards."""

    time: FloatArray
    force: FloatArray
    duration: float
    speed: FloatArray
    spin: FloatArray


def head_on(
    sphere: Sphere, closing: float, *, on_plane: bool = False, spin: float = 0.0,
    restitution: float = 1.0, friction: float = 0.0,
) -> Course:  # fmt: skip
    """Let a sphere and its like, or a rigid plane, meet at a closing speed (m/s), spinning against it (rad/s)."""
    radius, impact = sphere.radius, sphere.on_plane() if on_plane else sphere.on_equal()
    low, speed = (-radius, closing) if on_plane else (5.0 * radius, closing / 2.0)
    start = np.zeros((1 if on_plane else 2, 9))
    start[0, [2, 5, 7]] = low + 2.0 * radius, -speed, spin
    start[1:, [2, 5, 7]] = low, speed, -spin
    step, steps = impact.duration(closing) / _STEPS, ceil(_LONGEST * _STEPS)
    engine = sphere.engine(start, step, restitution, friction, on_plane=on_plane)
    frames, force, time = np.empty((steps, len(start), 9)), np.empty(steps), step * np.arange(1.0, steps + 1.0)
    for number in range(steps):
        frames[number], force[number] = engine.run(1, 1)[0], engine.state.force[0, 2]
    overlap = 2.0 * radius - frames[:, 0, 2] + (low if on_plane else frames[:, 1, 2])
    last = int(np.flatnonzero(overlap > 0.0)[-1])
    parting = overlap[last] / (overlap[last] - overlap[last + 1])
    return Course(time, force, float(time[last] + parting * step), frames[-1, 0, 3:6], frames[-1, 0, 6:])


def measure() -> tuple[list[Line], Curves]:
    """Run the tests: the lines with closed forms, and the curves that have published points, by panel."""
    curves: Curves = {}
    tests = (_hertz, _damped, _at_an_angle, _along_the_plane, _spinning)
    return [line for test in tests for line in test(curves)], curves


def _hertz(curves: Curves) -> Iterator[Line]:
    """Tests 1 and 2: Hertz's impact, of two spheres and on a plane, and its largest force as published."""
    for test, name, sphere, closing, published in (
        (1, "glass", GLASS, 20.0, None),
        (1, "limestone", LIMESTONE, 20.0, 7108.0),
        (2, "alloy", ALLOY_OF_TEST_2, 0.2, None),
        (2, "magnesium alloy", MAGNESIUM, 0.2, 7233.0),
    ):
        impact, leaving = (sphere.on_equal(), closing / 2.0) if test == 1 else (sphere.on_plane(), closing)
        course = head_on(sphere, closing, on_plane=test == 2)
        curves[name] = course.time * 1e6, course.force / 1e3
        what, peak = f"{test}: {name}", float(course.force.max())
        yield Line(f"{what}, largest force", impact.peak_force(closing), peak, STEP, "N")
        yield Line(f"{what}, duration", impact.duration(closing), course.duration, STEP, "s")
        yield Line(f"{what}, speed after", leaving, float(course.speed[2]), STEP, "m/s")
        if published:
            yield Line(f"{what}: published largest force", published, peak, STEP, "N")


def _damped(_: Curves) -> Iterator[Line]:
    """Test 3: the restitution is that of the case; test 7: spheres that spin without sliding keep their spin."""
    for name, sphere in (("oxide", OXIDE), ("cast iron", CAST_IRON)):
        for given in (0.2, 0.4, 0.6, 0.8, 1.0):
            after = onto_plane(sphere, Speeds(np.array([3.9]), np.zeros(1), np.zeros(1)), given)
            yield Line(f"3: {name}, restitution {given:g}", given, float(after.normal[0]) / 3.9, 0.01)
    spin = 20.0
    course = head_on(ALLOY, 0.4, spin=spin, restitution=0.5, friction=0.4)
    yield Line("7: spin after over before", 1.0, float(course.spin[1]) / spin, 1e-6)
    yield Line("7: tangential speed over normal", 0.0, float(course.speed[0]) / 0.2, 1e-6)
    yield Line("7: restitution", 0.5, float(course.speed[2]) / 0.2, 0.005)


def _at_an_angle(curves: Curves) -> Iterator[Line]:
    """Test 4: at 3.9 m/s under several angles, restitution 0.98, friction 0.092."""
    angle = np.arange(2.0, 87.5, 0.5)
    turn = np.radians(angle)
    before = Speeds(3.9 * np.cos(turn), 3.9 * np.sin(turn), np.zeros_like(turn))
    slides = angle > 36.0  # well beyond where a rigid sphere begins to: tan 32.5° = 7/2 μ(1+e)
    for name, sphere in (("oxide", OXIDE), ("alloy", ALLOY_OF_TEST_4)):
        after = onto_plane(sphere, before, 0.98, 0.092)
        kept = after.tangential / before.tangential
        curves[f"{name}-restitution"] = angle, kept
        curves[f"{name}-spin"] = angle, -after.rolling / sphere.radius
        curves[f"{name}-rebound"] = angle, np.degrees(np.arctan(after.sliding / after.normal))
        expected = 1.0 - 0.092 * (1.0 + after.normal / before.normal) / np.tan(turn)
        what = f"4: {name}, e_t in gross sliding: largest deviation from 1 - μ(1+e)/tan θ"
        yield largest(what, expected[slides], kept[slides], STEP)


def _along_the_plane(curves: Curves) -> Iterator[Line]:
    """Test 5: steel at 5 m/s along the normal and several speeds along the plane, elastic, friction 0.3."""
    speed, friction = 5.0, 0.3
    x = np.arange(0.05, 20.01, 0.05)
    after = onto_plane(STEEL, Speeds(np.full_like(x, speed), x * friction * speed, np.zeros_like(x)), 1.0, friction)
    surface, turn = after.sliding / (friction * after.normal), -after.rolling / (friction * speed)
    curves["steel-surface"], curves["steel-spin"] = (x, surface), (x, turn)
    slides = x > 7.0
    # 5/2 (1+e) times half of the overlap over the radius
    arm = 2.5 * STEEL.on_plane().depth(speed) / STEEL.radius
    expected = x[slides] - 7.0
    yield largest("5: surface in gross sliding: largest deviation from s/(μ v_n) - 7", expected, surface[slides], arm)
    yield largest("5: spin in gross sliding: largest deviation from -5", -5.0, turn[slides], arm)


def _spinning(curves: Curves) -> Iterator[Line]:
    """Test 6: 0.2 m/s, restitution 0.5, friction 0.4, spinning; test 8, a sphere so stiff and large, is the same."""
    x = np.geomspace(0.17, 25.0, 300)
    spinning = 3.5 * 0.4 * 1.5 * 0.2 / x  # an impulse changes the surface's velocity 3.5 times as much as the centre's
    before = Speeds(np.full_like(x, 0.2), np.zeros_like(x), -spinning)
    after = onto_plane(ALLOY, before, 0.5, 0.4)
    beta = -after.sliding / before.sliding
    curves["spin"] = x, beta
    slides = x < 0.9
    yield largest("6: -s'/s in gross sliding: largest deviation from x - 1", x[slides] - 1.0, beta[slides], SLIP)
    yield largest("6: restitution", 0.5, after.normal / before.normal, 0.005)


def largest(what: str, expected: FloatArray | float, measured: FloatArray, tolerance: float) -> Line:
    """The largest of several differences."""
    away = measured - expected
    return Line(what, 0.0, float(away[np.argmax(np.abs(away))]), tolerance)


def farthest_point(what: str, points: FloatArray, curve: tuple[FloatArray, FloatArray], axis: float) -> Line:
    """The point that is farthest from a curve; its error is the distance divided by the axis."""
    away = np.interp(points[:, 0], *curve) - points[:, 1]
    worst = int(np.argmax(np.abs(away)))
    words = f"{what}: largest deviation, at {points[worst, 0]:g}, over the axis"
    return Line(words, 0.0, float(away[worst]) / axis, READING)


def published() -> dict[str, Any]:
    """The panels of ``chung_ooi.toml``, points as arrays of shape (N, 2)."""
    panels = tomllib.loads(files("walkers.check").joinpath("chung_ooi.toml").read_text("utf-8"))
    for panel in panels.values():
        for series in panel["series"]:
            series["points"] = np.array(series["points"], dtype=np.float64)
    return panels


def point_lines(curves: Curves) -> Iterator[Line]:
    """Comparison of the published points with the curves."""
    for key, panel in published().items():
        for series in panel["series"]:
            points, between = series["points"], series.get("judged", [-np.inf, np.inf])
            if between:
                judged = points[(between[0] <= points[:, 0]) & (points[:, 0] < between[1])]
                what = f"{panel['title'].split()[1].rstrip(':')}: {key}, {series['name']}"
                yield farthest_point(what, judged, curves[key], panel["axis"])


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The benchmarks with the second engine, which take seconds with or without ``quick``."""
    del out, quick
    (lines, curves), panels = measure(), published()
    lines += point_lines(curves)
    worst = {line.what[0]: line for line in sorted(lines, key=lambda line: line.error / line.tolerance)}
    nearest = [worst[test] for test in sorted(worst)]
    text = rendered("walkers.check", "benchmarks.md.j2", lines=lines, worst=nearest)
    figures = {"benchmarks": draw(panels, curves)}
    return Chapter("benchmarks", "Published benchmarks of impacts", tuple(lines), text, figures)


@styled
def draw(panels: Mapping[str, Any], curves: Curves) -> Figure:
    """Every panel but those of test 4's second material: published points and the second engine's curve."""
    shown = [key for key in panels if not key.startswith("alloy-")]
    figure, grid = new_figure(TWO_COLUMNS, 11.0, nrows=4, ncols=2)
    for axes, key in zip(grid.flat, shown, strict=True):
        panel = panels[key]
        for series, marker in zip(panel["series"], "osD^"[: len(panel["series"])], strict=True):
            axes.plot(*series["points"].T, marker, mfc="none", ms=4.0, label=series["name"])
        axes.plot(*curves[key], color="k", lw=1.0, label="second engine")
        axes.set(xlabel=panel["x"], ylabel=panel["y"], title=panel["title"])
        axes.set_xscale("log" if key == "spin" else "linear")
        legend_below(axes, ncols=2)
    letter_panels(grid.flat)
    return figure
