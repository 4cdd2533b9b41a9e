"""Published benchmarks of impacts and closed forms: they pass on the installed engine, and fail where they should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.printed import spoilt
from walkers.audit import AuditReport, Verdict, chung_ooi, run_audit
from walkers.audit.bench import FIRST_BEAD, bench_recording, scene_on_floor
from walkers.audit.checks import benchmarks, closed_forms
from walkers.audit.checks.benchmarks import ALLOY, GLASS, OXIDE, STEEL
from walkers.audit.impacts import stiff_case
from walkers.audit.oblique import farthest
from walkers.audit.run import selected
from walkers.physics.impact import Impact, Motion, after_impact, friction_excess, sliding_loss
from walkers.studies import benchmarks as benchmark_study
from walkers.studies import closed_forms as closed_form_study
from walkers.studies.audited import table
from walkers.studies.chapter import Chapter
from walkers.templates.deck import Plan, compose
from walkers.templates.engine import Workarounds
from walkers.templates.scene import Bead

NORMAL = ("impact-plane", "impact-restitution")
SOME = (*NORMAL, "impact-counter-spin", "impact-spin", "sliding-to-rolling", "first-step", "film-slope")


@pytest.fixture(scope="module")
def report() -> AuditReport:
    return run_audit(selected(SOME))


def _failing(report: AuditReport) -> set[str]:
    return {line.what for line in report.failures}


def test_the_installed_engine_passes(report: AuditReport) -> None:
    assert not _failing(report)
    assert report.count(Verdict.PRESENT) == 4
    assert report.count(Verdict.GONE) == 0


@pytest.mark.slow
def test_the_installed_engine_passes_the_rest() -> None:
    names = {check.name for check in (*benchmarks.CHECKS, *closed_forms.CHECKS)}
    rest = run_audit(selected(sorted(names - set(SOME))))
    assert not _failing(rest)
    assert rest.count(Verdict.PASS) > 40


def test_they_are_no_part_of_the_quick_audit() -> None:
    assert not {check.group for check in selected(quick=True)} & {10, 11}


def test_with_a_single_wall_exactly_the_lines_of_the_doubled_one_fail(report: AuditReport) -> None:
    broken = run_audit(selected((*NORMAL, "impact-spin")), workarounds=Workarounds(wall_copies=1))
    standing = {line.what for line in report.lines if "walls" in line.needs}
    assert _failing(broken) == standing
    assert len(standing) == 14


def test_a_doubled_wall_judged_as_a_single_one_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmarks, "WALLS", {"single wall": 1, "doubled wall": 1})
    failing = _failing(run_audit(selected(NORMAL)))
    assert failing
    assert all("doubled wall" in what for what in failing)
    assert sum("largest force" in what for what in failing) == 2
    assert sum("3: restitution" in what for what in failing) == 8


def test_another_friction_fails_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """The closed form of a bead that slides is made with a friction that is 2 % off."""
    true = closed_forms.sliding_way

    def off(bench: closed_forms.Bench, wall: str) -> closed_forms.Way:
        way = true(bench, wall)
        return replace(way, expected_rolling=1.02 * way.expected_rolling)

    monkeypatch.setattr(closed_forms, "sliding_way", off)
    failing = _failing(run_audit(selected(["sliding-to-rolling"])))
    assert {what.split(": ")[1] for what in failing} == {"velocity and spin along the way"}


def test_hertz_impact_is_that_of_the_integrated_model() -> None:
    impact = OXIDE.impact_on_plane()
    assert impact.copies == 1
    after = after_impact(impact, Motion(np.array([3.9]), np.zeros(1), np.zeros(1)))
    assert after.normal == pytest.approx(3.9, rel=1e-4)
    twice = replace(impact, copies=2)
    assert twice.peak_force(1.0) / impact.peak_force(1.0) == pytest.approx(2.0**0.4)
    assert twice.duration(1.0) / impact.duration(1.0) == pytest.approx(2.0**-0.4)
    assert impact.duration(1.0) == pytest.approx(
        2.868 * (impact.mass**2 / (impact.radius * impact.modulus**2)) ** 0.2, rel=1e-3
    )


@pytest.mark.parametrize("copies", [1, 2])
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
def test_damping_gives_the_restitution_of_the_closed_form(restitution: float, copies: int) -> None:
    impact = OXIDE.impact_on_plane(restitution, copies=copies)
    after = after_impact(impact, Motion(np.array([0.1, 3.0]), np.zeros(2), np.zeros(2)))
    assert after.normal / np.array([0.1, 3.0]) == pytest.approx(impact.rebound, rel=2e-3)
    assert copies == 2 or impact.rebound == pytest.approx(restitution)


def test_what_slides_all_the_way_is_thrown_by_coulomb_unless_it_is_damped() -> None:
    impact = STEEL.impact_on_plane(friction=0.3)
    fast = Motion(np.array([5.0]), np.array([20.0]), np.zeros(1))
    after = after_impact(impact, fast)
    assert fast.tangential - after.tangential == pytest.approx(sliding_loss(0.3, 1.0, fast.normal), rel=1e-4)
    assert after.rolling == pytest.approx(2.5 * sliding_loss(0.3, 1.0, fast.normal), rel=4e-3)
    assert friction_excess(impact, 1000) == pytest.approx(1.0, abs=1e-9)
    assert friction_excess(replace(impact, restitution=0.5)) == pytest.approx(1.167, abs=0.01)


def test_a_point_off_the_curve_is_found_and_judged_by_the_axis() -> None:
    points = np.array([(0.0, 0.0), (1.0, 1.3), (2.0, 2.0)])
    x = np.array([2.0, 0.0])
    line = farthest("y", "x", points, x, x, 10.0, 0.02)
    assert (line.expected, line.measured) == (1.3, 1.0)
    assert line.relative_error == pytest.approx(0.03)
    assert line.verdict is Verdict.FAIL


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without the engine: Hertz's peak, spheres that slide."""
    assert chung_ooi.SPHERES_FORCE_TIME[:, 1].max() * 1e3 == pytest.approx(
        GLASS.impact_on_equal().peak_force(20.0), rel=5e-3
    )
    slides = chung_ooi.SPIN_ALLOY_BETA[chung_ooi.SPIN_ALLOY_BETA[:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = chung_ooi.ANGLE_OXIDE_RESTITUTION[chung_ooi.ANGLE_OXIDE_RESTITUTION[:, 0] >= 40.0]
    expected = 1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0]))
    assert steep[:, 1] == pytest.approx(expected, abs=5e-3)
    fast = chung_ooi.TANGENTIAL_FINITE_ELEMENTS_SURFACE[-3:]
    assert fast[:, 1] == pytest.approx(fast[:, 0] - 7.0, abs=0.1)


def test_only_stiff_decks_ask_for_hard_particles() -> None:
    recording = bench_recording(10, 10)
    bead = Bead(FIRST_BEAD, (0.0, 0.0, 5e-3), 3e-4, density=7000.0)
    decks = {
        modulus: compose(Plan(stiff_case(modulus, 0.3, 4000.0, 1e-7), scene_on_floor([bead]), recording)).text
        for modulus in (1e9, 7e10)
    }
    assert "hard_particles" not in decks[1e9]
    assert decks[7e10].index("hard_particles  yes") < decks[7e10].index("youngsModulus")
    assert "youngsModulus peratomtype 70000000000.0 70000000000.0" in decks[7e10]
    sizes = [line for line in decks[1e9].splitlines() if "density" in line]
    assert [line.split()[-1] for line in sizes] == ["4000.0", "7000.0"]


def test_impacts_of_spheres_on_planes_and_on_each_other() -> None:
    plane, pair = ALLOY.impact_on_plane(), ALLOY.impact_on_equal()
    assert plane.modulus == pytest.approx(7e10 / (1.0 - 0.33**2))
    assert plane.mass == pytest.approx(2700.0 * 4.0 / 3.0 * pi * 1e-3)
    assert (pair.modulus, pair.mass, pair.radius) == pytest.approx((plane.modulus / 2.0, plane.mass / 2.0, 0.05))
    reduced = Impact(1.0, 1.0, 1.0, 1.0, restitution=0.5, copies=2)
    assert reduced.rebound == pytest.approx(np.exp(-pi * 0.3047 / sqrt(1.0 - 0.3047**2)), rel=1e-3)


def test_a_table_keeps_bars_within_its_cells() -> None:
    assert table(("a", "b"), [("|x|", "1")]) == "| a | b |\n| --- | --- |\n| \\|x\\| | 1 |"


@pytest.mark.slow
@pytest.mark.parametrize("chapter", [benchmark_study.chapter, closed_form_study.chapter], ids=["impacts", "closed"])
def test_chapters(chapter: Callable[[Path], Chapter], tmp_path: Path) -> None:
    found = chapter(tmp_path)
    assert not found.failed
    assert found.numbers
    assert "doi.org/10." in found.text
    for name, figure in found.figures.items():
        assert f"figures/validation-{name}.png" in found.text
        assert spoilt(figure) == []
