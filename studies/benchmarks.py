"""The eight benchmark tests of Chung and Ooi: the audit's group 10 as a chapter, with the published points drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.audit import chung_ooi as published
from walkers.audit.bench import Bench
from walkers.audit.check import Line, Verdict
from walkers.audit.checks import benchmarks as tests
from walkers.audit.impacts import Course
from walkers.audit.oblique import Oblique
from walkers.inputs.text import rendered
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.studies.audited import as_numbers, failures, line_table, lines_of, table, temporary_bench
from walkers.studies.chapter import Chapter

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WALL_STYLES: dict[str, dict[str, Any]] = {
    "single wall": {"ls": "-", "color": "C1"},
    "doubled wall": {"ls": "--", "color": "C2"},
}
_SIMULATED = {"ls": "", "marker": "o", "mfc": "none", "color": "0.35", "ms": 4.5}
_OTHER_SIMULATED = {"ls": "", "marker": "s", "mfc": "none", "color": "0.6", "ms": 4.0}
_INDEPENDENT = {"ls": "", "marker": "D", "color": "C4", "ms": 4.0, "mec": "0.3", "mew": 0.5}
_CLOSED = {"ls": ":", "color": "0.3", "lw": 1.0}


@dataclass(frozen=True)
class Measured:
    """What the tests gave, by wall or material."""

    pair: Mapping[str, Course]
    plane: Mapping[str, Course]
    damped: Mapping[str, Oblique]
    by_angle: Mapping[str, Oblique]
    by_tangential_speed: Mapping[str, Oblique]
    by_spin: Mapping[str, Oblique]
    unequal: Oblique


def measure(bench: Bench) -> Measured:
    """Run the tests that are drawn."""
    return Measured(
        tests.pair(bench),
        tests.plane(bench),
        tests.damped(bench),
        tests.by_angle(bench),
        tests.by_tangential_speed(bench),
        tests.by_spin(bench),
        tests.unequal(bench),
    )


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The benchmarks on the installed engine; they take seconds, however ``quick`` it is to be, and leave no runs."""
    del out, quick
    with temporary_bench() as bench:
        measured, lines = measure(bench), lines_of(tests.CHECKS, bench)
    return Chapter(
        name="benchmarks",
        title="Published benchmarks of impacts",
        text=rendered("walkers.studies", "benchmarks.md.j2", **_contents(measured, lines)),
        figures={
            "benchmarks-normal": fig_normal(measured),
            "benchmarks-angle": fig_angle(measured.by_angle),
            "benchmarks-spin": fig_spin(measured),
        },
        numbers=as_numbers(lines),
        failed=failures(lines),
    )


def _contents(measured: Measured, lines: list[Line]) -> dict[str, Any]:
    """What the template names."""
    judged = [line for line in lines if line.verdict in (Verdict.PASS, Verdict.FAIL)]
    return {
        "judged": len(judged),
        "failed": sum(line.verdict is Verdict.FAIL for line in judged),
        "worst": line_table(_worst_of_each_test(judged)),
        "defects": line_table(line for line in lines if line.defect),
        "angles": angle_table(measured.by_angle),
        "tangential": tangential_table(measured.by_tangential_speed),
        "spins": spin_table(measured),
    }


def _worst_of_each_test(lines: Iterable[Line]) -> list[Line]:
    """Of each test the line that comes nearest to its tolerance."""
    worst: dict[str, Line] = {}
    for line in lines:
        test, share = line.what[0], line.relative_error / (line.tolerance or 1.0)
        if test not in worst or share > worst[test].relative_error / (worst[test].tolerance or 1.0):
            worst[test] = line
    return list(worst.values())


def _at(points: FloatArray, x: float, within: float) -> str:
    """The y of the point nearest to x, or nothing."""
    nearest = int(np.argmin(np.abs(points[:, 0] - x)))
    return f"{points[nearest, 1]:.3g}" if abs(points[nearest, 0] - x) < within else ""


def _ours(x: FloatArray, y: FloatArray, at: float) -> str:
    order = np.argsort(x)
    return f"{np.interp(at, x[order], y[order]):.3g}"


def angle_table(by_wall: Mapping[str, Oblique]) -> str:
    """Test 4: tangential restitution."""
    rows = [
        (
            f"{angle:g}°",
            _at(published.ANGLE_OXIDE_RESTITUTION, angle, 1.0),
            _at(published.ANGLE_MEASURED_RESTITUTION, angle, 1.2),
            *(_ours(found.angle, found.tangential_restitution, angle) for found in by_wall.values()),
        )
        for angle in (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0)
    ]
    return table(("angle", "simulated", "measured", *(f"engine, {wall}" for wall in by_wall)), rows)


def tangential_table(by_wall: Mapping[str, Oblique]) -> str:
    """Test 5: the surface's velocity, at the incidences of the finite elements."""
    rows = []
    for x, y in published.TANGENTIAL_FINITE_ELEMENTS_SURFACE:
        ours = (
            _ours(found.incidence / tests.STEEL_FRICTION, tests.reduced_rebound(found)[0], float(x))
            for found in by_wall.values()
        )
        rows.append((f"{x:.3g}", f"{y:.3g}", _at(published.TANGENTIAL_STEEL_SURFACE, float(x), 0.3), *ours))
    head = ("s/(μ vₙ)", "finite elements", "simulated (nearest)", *(f"engine, {wall}" for wall in by_wall))
    return table(head, rows)


def spin_table(measured: Measured) -> str:
    """Tests 6 and 8: what the surface's velocity becomes."""
    rows = []
    for x, alloy in published.SPIN_ALLOY_BETA:
        ours = (
            _ours(found.stickiness, found.beta, float(x)) for found in (*measured.by_spin.values(), measured.unequal)
        )
        rows.append((f"{x:.3g}", f"{alloy:.3g}", _at(published.SPIN_NYLON_BETA, float(x), 0.2), *ours))
    walls = (f"6: engine, {wall}" for wall in measured.by_spin)
    return table(("7/2 μ(1+e) vₙ/s", "6: alloy", "6: nylon", *walls, "8: engine"), rows)


@styled
def fig_normal(measured: Measured) -> Figure:
    """Tests 1 to 3."""
    figure, (one, two, three) = new_figure(TWO_COLUMNS, 3.2, ncols=3)
    glass = measured.pair["glass"]
    one.plot(*published.SPHERES_FORCE_TIME.T, label="published", **_SIMULATED)
    one.plot(glass.time * 1e6, glass.force / 1e3, color="C1", label="engine")
    one.set(xlabel="time (µs)", ylabel="force (kN)", title="test 1: glass spheres", xlim=(0.0, 45.0))
    two.plot(*published.PLANE_FORCE_TIME.T, label="published", **_SIMULATED)
    for wall, course in measured.plane.items():
        two.plot(course.time * 1e6, course.force / 1e3, label=wall, **_WALL_STYLES[wall])
    two.set(xlabel="time (µs)", ylabel="force (kN)", title="test 2: alloy on a plane", xlim=(0.0, 800.0))
    given = np.linspace(0.06, 1.0, 60)
    copies = tests.WALLS["doubled wall"]
    closed = [tests.OXIDE.impact_on_plane(float(e), copies=copies).rebound for e in given]
    three.plot([0.0, 1.0], [0.0, 1.0], **_CLOSED)
    three.plot(given, closed, label="as given, and\n√2 the damping ratio", **_CLOSED)
    for wall, found in measured.damped.items():
        style = {**_WALL_STYLES[wall], "ls": "", "marker": "o" if wall == "single wall" else "s", "ms": 5.0}
        three.plot(tests.RESTITUTIONS, found.restitution, label=wall, **style)
    three.set(xlabel="restitution given", ylabel="restitution", title="test 3: oxide on a plane")
    one.set_ylim(0.0, None)
    two.set_ylim(0.0, None)
    for axes in (one, two, three):
        legend_below(axes)
    letter_panels((one, two, three))
    return figure


@styled
def fig_angle(by_wall: Mapping[str, Oblique]) -> Figure:
    """Test 4."""
    figure, panels = new_figure(TWO_COLUMNS, 3.1, ncols=3)
    drawn = (
        ("tangential restitution", published.ANGLE_OXIDE_RESTITUTION, published.ANGLE_MEASURED_RESTITUTION),
        ("spin (rad/s)", published.ANGLE_OXIDE_SPIN, published.ANGLE_MEASURED_SPIN),
        ("rebound angle of the surface (°)", published.ANGLE_REBOUND, published.ANGLE_MEASURED_REBOUND),
    )
    for number, (axes, (label, simulated, seen)) in enumerate(zip(panels, drawn, strict=True)):
        axes.plot(*simulated.T, label="simulated, published", **_SIMULATED)
        axes.plot(*seen.T, label="measured (Kharaz et al.)", **_INDEPENDENT)
        for wall, found in by_wall.items():
            values = (found.tangential_restitution, -found.rebound.spin, found.rebound_angle)[number]
            axes.plot(found.angle, values, label=f"engine, {wall}", **_WALL_STYLES[wall])
        axes.set(xlabel="angle of incidence (°)", ylabel=label, xlim=(0.0, 90.0))
    letter_panels(panels)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


@styled
def fig_spin(measured: Measured) -> Figure:
    """Tests 5, 6 and 8."""
    figure, ((surface, turn), (six, eight)) = new_figure(TWO_COLUMNS, 7.0, nrows=2, ncols=2)
    surface.plot(*published.TANGENTIAL_STEEL_SURFACE.T, label="simulated, steel", **_SIMULATED)
    surface.plot(*published.TANGENTIAL_POLYETHYLENE_SURFACE.T, label="simulated, polyethylene", **_OTHER_SIMULATED)
    surface.plot(*published.TANGENTIAL_FINITE_ELEMENTS_SURFACE.T, label="finite elements", **_INDEPENDENT)
    turn.plot(*published.TANGENTIAL_STEEL_SPIN.T, **_SIMULATED)
    turn.plot(*published.TANGENTIAL_FINITE_ELEMENTS_SPIN.T, **_INDEPENDENT)
    for wall, found in measured.by_tangential_speed.items():
        incidence = found.incidence / tests.STEEL_FRICTION
        for axes, values in zip((surface, turn), tests.reduced_rebound(found), strict=True):
            axes.plot(incidence, values, label=f"engine, {wall}", **_WALL_STYLES[wall])
    surface.set(xlabel="s/(μ vₙ)", ylabel="s′/(μ vₙ′)", title="test 5: steel, elastic", xlim=(0.0, 13.2))
    surface.set_ylim(top=7.0)  # of what is shown
    turn.set(xlabel="s/(μ vₙ)", ylabel="-Rω′/(μ vₙ)", title="test 5: steel, elastic", xlim=(0.0, 13.2))
    legend_below(surface, ncols=2)
    six.plot(*published.SPIN_ALLOY_BETA.T, label="simulated, aluminium alloy", **_SIMULATED)
    six.plot(*published.SPIN_NYLON_BETA.T, label="simulated, nylon", **_OTHER_SIMULATED)
    for wall, found in measured.by_spin.items():
        six.plot(found.stickiness, found.beta, label=f"engine, {wall}", **_WALL_STYLES[wall])
    eight.plot(*published.UNEQUAL_A_BETA.T, label="simulated, case A", **_SIMULATED)
    eight.plot(*published.UNEQUAL_B_BETA.T, label="simulated, case B", **{**_OTHER_SIMULATED, "marker": "x"})
    eight.plot(measured.unequal.stickiness, measured.unequal.beta, color="C1", label="engine")
    slides = np.geomspace(0.15, 1.0, 40)
    for axes, title in ((six, "test 6: on a plane, e = 0.5"), (eight, "test 8: on a larger sphere, e = 0.5")):
        axes.plot(slides, slides - 1.0, label="slides all the way: x - 1", **_CLOSED)
        axes.set(xlabel="7/2 μ(1+e) vₙ/s", ylabel="-s′/s", title=title, xscale="log")
        legend_below(axes, ncols=2)
    letter_panels((surface, turn, six, eight))
    return figure
