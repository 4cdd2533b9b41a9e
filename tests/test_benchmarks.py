"""Published benchmarks of impacts: they pass on the installed engine, and the closed forms fit each other."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi
from pathlib import Path

import numpy as np
import pytest

from tests.printed import spoilt
from walkers.check import Verdict, chung_ooi
from walkers.check.bench import Bench, bench_recording, bench_scene
from walkers.check.benchmarks import ALLOY, GLASS, OXIDE, STEEL, chapter, farthest_point, table
from walkers.check.impacts import Launch, onto_floor, stiff_case
from walkers.physics.impact import Motion, after_impact, sliding_loss
from walkers.runner.binary import find_engine
from walkers.templates.deck import Plan, compose
from walkers.templates.scene import Bead


def test_the_chapter(tmp_path: Path) -> None:
    found = chapter(tmp_path)
    assert not found.failed
    assert len(found.numbers) >= 60
    assert "doi.org/10." in found.text
    for name, figure in found.figures.items():
        assert f"figures/validation-{name}.png" in found.text
        assert spoilt(figure) == []


def test_what_slides_loses_by_coulomb_and_no_other_friction_would_do(tmp_path: Path) -> None:
    """The engine's impact, against a friction that is 1 % off."""
    launch = Launch(0.2, 2.0, 0.0, 0.5, 0.1)
    rebound = onto_floor(Bench(find_engine(), tmp_path), GLASS, [launch])
    lost = 2.0 - rebound.tangential_speed
    assert lost == pytest.approx(sliding_loss(0.1, 0.5, np.array([0.2])), rel=2e-3)
    assert lost != pytest.approx(sliding_loss(0.101, 0.5, np.array([0.2])), rel=2e-3)


def test_hertz_impact_is_that_of_the_integrated_model() -> None:
    impact = OXIDE.impact_on_plane()
    after = after_impact(impact, Motion(np.array([3.9]), np.zeros(1), np.zeros(1)))
    assert after.normal == pytest.approx(3.9, rel=1e-4)
    assert impact.duration(1.0) == pytest.approx(
        2.868 * (impact.mass**2 / (impact.radius * impact.modulus**2)) ** 0.2, rel=1e-3
    )


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
def test_damping_gives_the_restitution_of_the_closed_form(restitution: float) -> None:
    impact = OXIDE.impact_on_plane(restitution)
    after = after_impact(impact, Motion(np.array([0.1, 3.0]), np.zeros(2), np.zeros(2)))
    assert after.normal / np.array([0.1, 3.0]) == pytest.approx(restitution, rel=2e-3)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_what_slides_all_the_way_is_thrown_by_coulomb(restitution: float) -> None:
    """Damped or not: the elastic repulsion, which limits friction, has the whole impulse of the normal force."""
    impact = STEEL.impact_on_plane(restitution, friction=0.3)
    fast = Motion(np.array([5.0]), np.array([20.0]), np.zeros(1))
    after = after_impact(impact, fast)
    assert fast.tangential - after.tangential == pytest.approx(sliding_loss(0.3, restitution, fast.normal), rel=2e-3)
    assert after.rolling == pytest.approx(2.5 * sliding_loss(0.3, restitution, fast.normal), rel=6e-3)


def test_a_point_off_the_curve_is_found_and_judged_by_the_axis() -> None:
    points = np.array([(0.0, 0.0), (1.0, 1.3), (2.0, 2.0)])
    x = np.array([2.0, 0.0])
    line = farthest_point("y", points, x, x, 10.0)
    assert line.measured == pytest.approx(-0.03)
    assert line.verdict is Verdict.FAIL
    assert replace(line, tolerance=inf).verdict is Verdict.PASS


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
    scene = bench_scene([Bead(0, (0.0, 0.0, 5e-3), 3e-4, density=7000.0)])
    decks = {
        modulus: compose(Plan(stiff_case(modulus, 0.3, 4000.0, 1e-7), scene, bench_recording(10))).text
        for modulus in (1e9, 7e10)
    }
    assert "hard_particles" not in decks[1e9]
    assert decks[7e10].index("hard_particles  yes") < decks[7e10].index("youngsModulus")
    assert "youngsModulus peratomtype 70000000000.0 70000000000.0" in decks[7e10]
    assert [line.split()[-1] for line in decks[1e9].splitlines() if "density" in line] == ["7000.0"]


def test_impacts_of_spheres_on_planes_and_on_each_other() -> None:
    plane, pair = ALLOY.impact_on_plane(), ALLOY.impact_on_equal()
    assert plane.modulus == pytest.approx(7e10 / (1.0 - 0.33**2))
    assert plane.mass == pytest.approx(2700.0 * 4.0 / 3.0 * pi * 1e-3)
    assert (pair.modulus, pair.mass, pair.radius) == pytest.approx((plane.modulus / 2.0, plane.mass / 2.0, 0.05))


def test_a_table_keeps_bars_within_its_cells() -> None:
    assert table(("a", "b"), [("|x|", "1")]) == "| a | b |\n| --- | --- |\n| \\|x\\| | 1 |"
