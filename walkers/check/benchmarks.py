"""The benchmark tests of Chung and Ooi for contact models, by the second engine, beside their points.

What each line is judged by: closed forms (Hertz, sliding all the way), to the time step (a thousandth of the contact)
or, where surfaces turn, to the overlap over the radius, by which the arm of a force is shorter; published points, to
two per cent of the axis that they were read from.

Points that are not judged (``chung_ooi.toml``) are measurements and finite elements beside a model that leaves out the
micro-slip in the contact, which Mindlin's spring does not have, or contradict each other.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.check.impacts import Course, Speeds, Sphere, course_of_pair, course_on_plane, onto_plane
from walkers.check.kernels import FloatArray
from walkers.check.lines import Line, Verdict
from walkers.check.validate import Chapter
from walkers.inputs.text import rendered
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

READING = 0.02
"""Of an axis: how far a point read off a printed figure may be off."""
STEP = 2e-3
"""Relative error of speeds and forces at a thousand steps a contact."""
SLIP = 5e-3
"""Of the sliding velocity: what the step at which a contact begins to slip makes of the rest, at a thousand steps."""
SURFACE_OVER_CENTRE = 3.5
"""How much more a tangential impulse changes the velocity of a solid sphere's surface than that of its centre."""

GLASS = Sphere(4.8e10, 0.20, 2800.0, 0.01)
LIMESTONE = Sphere(2.0e10, 0.25, 2500.0, 0.01)
ALLOY_OF_TEST_2 = Sphere(7.0e10, 0.30, 2699.0, 0.1)
MAGNESIUM = Sphere(4.0e10, 0.35, 1800.0, 0.1)
OXIDE = Sphere(3.8e11, 0.23, 4000.0, 2.5e-3)
CAST_IRON = Sphere(1.0e11, 0.25, 7000.0, 2.5e-3)
ALLOY_OF_TEST_4 = Sphere(7.0e10, 0.33, 2700.0, 2.5e-3)
STEEL = Sphere(2.08e11, 0.30, 7850.0, 1e-5)
ALLOY = Sphere(7.0e10, 0.33, 2700.0, 0.1)


Curves = dict[str, tuple[FloatArray, FloatArray]]
"""x and y by panel of ``chung_ooi.toml``."""


def measure() -> tuple[list[Line], Curves]:
    """Run the tests: the lines with closed forms, and the curves that have published points, by panel."""
    lines: list[Line] = []
    curves: Curves = {}
    for test in (_head_on, _damped, _at_an_angle, _along_the_plane, _spinning, _turning):
        lines += test(curves)
    return lines, curves


def _head_on(curves: Curves) -> Iterator[Line]:
    """Tests 1 and 2: Hertz's impact."""
    for name, sphere, published in (("glass", GLASS, None), ("limestone", LIMESTONE, 7108.0)):
        course = course_of_pair(sphere, 10.0)
        curves[name] = course.time * 1e6, course.force / 1e3
        yield from _hertz(f"1: {name}", sphere.on_equal(), course, 20.0, published)
    for name, sphere, published in (("alloy", ALLOY_OF_TEST_2, None), ("magnesium alloy", MAGNESIUM, 7233.0)):
        course = course_on_plane(sphere, 0.2)
        curves[name] = course.time * 1e6, course.force / 1e3
        yield from _hertz(f"2: {name}", sphere.on_plane(), course, 0.2, published)


def _hertz(what: str, impact: Any, course: Course, closing: float, published: float | None) -> Iterator[Line]:
    peak = float(course.force.max())
    yield Line(f"{what}, largest force", impact.peak_force(closing), peak, STEP, "N")
    yield Line(f"{what}, duration", impact.duration(closing), course.duration, STEP, "s")
    leaving = closing if what.startswith("2") else closing / 2.0
    yield Line(f"{what}, speed after", leaving, float(course.speed[2]), STEP, "m/s")
    if published:
        yield Line(f"{what}: published largest force", published, peak, STEP, "N")


def _damped(_: Curves) -> Iterator[Line]:
    """Test 3: the restitution is the one that was given."""
    for name, sphere in (("oxide", OXIDE), ("cast iron", CAST_IRON)):
        for given in (0.2, 0.4, 0.6, 0.8, 1.0):
            after = onto_plane(sphere, Speeds(np.array([3.9]), np.zeros(1), np.zeros(1)), given)
            yield Line(f"3: {name}, restitution {given:g}", given, float(after.normal[0]) / 3.9, 0.01)


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
        what = f"4: {name}, e_t of what slides all the way, 1 - μ(1+e)/tan θ"
        yield largest(what, expected[slides], kept[slides], STEP)


def _along_the_plane(curves: Curves) -> Iterator[Line]:
    """Test 5: steel at 5 m/s along the normal and several speeds along the plane, elastic, friction 0.3."""
    speed, friction = 5.0, 0.3
    x = np.arange(0.05, 20.01, 0.05)
    before = Speeds(np.full_like(x, speed), x * friction * speed, np.zeros_like(x))
    after = onto_plane(STEEL, before, 1.0, friction)
    surface, turn = after.sliding / (friction * after.normal), -after.rolling / (friction * speed)
    curves["steel-surface"], curves["steel-spin"] = (x, surface), (x, turn)
    slides = x > 7.0
    # 5/2 (1+e) times half of the overlap over the radius
    arm = 2.5 * STEEL.on_plane().depth(speed) / STEEL.radius
    yield largest("5: surface of what slides all the way, s/(μ v_n) - 7", x[slides] - 7.0, surface[slides], arm)
    yield largest("5: spin of what slides all the way, -5", -5.0, turn[slides], arm)


def _spinning(curves: Curves) -> Iterator[Line]:
    """Test 6: 0.2 m/s, restitution 0.5, friction 0.4, spinning; test 8, a sphere so stiff and large, is the same."""
    x = np.geomspace(0.17, 25.0, 300)
    spinning = SURFACE_OVER_CENTRE * 0.4 * 1.5 * 0.2 / x
    before = Speeds(np.full_like(x, 0.2), np.zeros_like(x), -spinning)
    after = onto_plane(ALLOY, before, 0.5, 0.4)
    beta = -after.sliding / before.sliding
    curves["spin"] = x, beta
    slides = x < 0.9
    yield largest("6: -s'/s of what slides all the way, x - 1", x[slides] - 1.0, beta[slides], SLIP)
    yield largest("6: restitution", 0.5, after.normal / before.normal, 0.005)


def _turning(_: Curves) -> Iterator[Line]:
    """Test 7: two equal spheres that spin against each other, so that their surfaces do not slide."""
    spin = 20.0
    course = course_of_pair(ALLOY, 0.2, spin, 0.5, 0.4)
    yield Line("7: spin after over before", 1.0, float(course.spin[1]) / spin, 1e-6)
    yield Line("7: tangential speed over normal", 0.0, float(course.speed[0]) / 0.2, 1e-6)
    yield Line("7: restitution", 0.5, float(course.speed[2]) / 0.2, 0.005)


def largest(what: str, expected: FloatArray | float, measured: FloatArray, tolerance: float) -> Line:
    """The largest of several differences."""
    away = measured - expected
    return Line(what, 0.0, float(away[np.argmax(np.abs(away))]), tolerance)


def farthest_point(what: str, points: FloatArray, curve: tuple[FloatArray, FloatArray], axis: float) -> Line:
    """The one of some points that is farthest from a curve; judged by the distance over the axis."""
    away = np.interp(points[:, 0], *curve) - points[:, 1]
    worst = int(np.argmax(np.abs(away)))
    told = f"{what}: farthest point, at {points[worst, 0]:g}, over the axis"
    return Line(told, 0.0, float(away[worst]) / axis, READING)


def published() -> dict[str, Any]:
    """The panels of ``chung_ooi.toml``, points as arrays of shape (N, 2)."""
    panels = tomllib.loads(files("walkers.check").joinpath("chung_ooi.toml").read_text("utf-8"))
    for panel in panels.values():
        for series in panel["series"]:
            series["points"] = np.array(series["points"], dtype=np.float64)
    return panels


def point_lines(curves: Curves) -> Iterator[Line]:
    """The published points that are judged, beside the curves."""
    for key, panel in published().items():
        for series in panel["series"]:
            points, between = series["points"], series.get("judged", [-np.inf, np.inf])
            if between:
                judged = points[(between[0] <= points[:, 0]) & (points[:, 0] < between[1])]
                what = f"{panel['title'].split()[1].rstrip(':')}: {key}, {series['name']}"
                yield farthest_point(what, judged, curves[key], panel["axis"])


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The benchmarks by the second engine; they take seconds, however ``quick`` it is to be, and no runs."""
    del out, quick
    (lines, curves), panels = measure(), published()
    lines += point_lines(curves)
    failed = tuple(line.what for line in lines if line.verdict is not Verdict.PASS)
    tables = {key.replace("-", "_"): panel_table(panels[key], curves[key]) for key in _TABLES}
    text = rendered(
        "walkers.check",
        "benchmarks.md.j2",
        judged=len(lines),
        failed=len(failed),
        worst=_worst_of_each_test(lines),
        **tables,
    )
    numbers = {line.what: {"expected": line.expected, "measured": line.measured} for line in lines}
    return Chapter(
        "benchmarks",
        "Published benchmarks of impacts",
        text,
        {"benchmarks": draw(panels, curves)},
        numbers,
        failed,
    )


_TABLES = ("oxide-restitution", "steel-surface", "spin")


def _worst_of_each_test(lines: Iterable[Line]) -> list[Line]:
    """Of each test the line that comes nearest to its tolerance."""
    worst: dict[str, Line] = {}
    for line in sorted(lines, key=lambda line: line.error / line.tolerance):
        worst[line.what[0]] = line
    return [worst[test] for test in sorted(worst)]


def panel_table(panel: Mapping[str, Any], curve: tuple[FloatArray, FloatArray]) -> list[list[str]]:
    """Rows of a panel at the points of its first series: x, each series at the point nearest to it, and the curve."""
    first = panel["series"][0]["points"][:, 0]
    rows = [[panel["x"], *(series["name"] for series in panel["series"]), "second engine"]]
    for x in first.tolist():
        near = [series["points"][np.argmin(np.abs(series["points"][:, 0] - x))] for series in panel["series"]]
        told = [f"{y:.3g}" if abs(at - x) < max(0.3, 0.02 * x) else "" for at, y in near]
        rows.append([f"{x:.3g}", *told, f"{np.interp(x, *curve):.3g}"])
    return rows


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
