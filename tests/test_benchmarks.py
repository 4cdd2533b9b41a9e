"""Published benchmarks of impacts: the second engine passes them, and they tell wrong friction from right."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi
from pathlib import Path

import numpy as np
import pytest

from tests.printed import spoilt
from walkers.check.bench import DRY, bench_case, bench_recording, bench_scene
from walkers.check.benchmarks import ALLOY, GLASS, OXIDE, STEEL, chapter, farthest_point, published
from walkers.check.impacts import Speeds, onto_plane
from walkers.check.lines import Verdict
from walkers.templates.deck import Plan, compose
from walkers.templates.scene import Bead


def test_the_chapter(tmp_path: Path) -> None:
    found = chapter(tmp_path)
    assert not found.failed
    assert len(found.numbers) > 45
    assert "doi.org/10." in found.text
    for name, figure in found.figures.items():
        assert f"figures/validation-{name}.png" in found.text
        assert spoilt(figure) == []


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_what_slides_all_the_way_loses_by_coulomb_and_no_other_friction_would_do(restitution: float) -> None:
    """Damped or not: the elastic repulsion, which limits friction, has the whole impulse of the normal force."""
    before = Speeds(np.array([5.0]), np.array([20.0]), np.zeros(1))
    after = onto_plane(STEEL, before, restitution, 0.3)
    lost, expected = 20.0 - after.tangential[0], 0.3 * (1.0 + restitution) * 5.0
    assert lost == pytest.approx(expected, rel=2e-3)
    assert lost != pytest.approx(1.01 * expected, rel=2e-3)
    assert after.rolling[0] == pytest.approx(2.5 * expected, rel=6e-3)


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9, 1.0])
def test_damping_gives_the_restitution_at_any_speed(restitution: float) -> None:
    normal = np.array([1.0, 3.0])
    after = onto_plane(OXIDE, Speeds(normal, np.zeros(2), np.zeros(2)), restitution)
    assert after.normal / normal == pytest.approx(restitution, rel=2e-3)


def test_a_point_off_the_curve_is_found_and_judged_by_the_axis() -> None:
    points = np.array([(0.0, 0.0), (1.0, 1.3), (2.0, 2.0)])
    line = farthest_point("y", points, (np.array([0.0, 2.0]), np.array([0.0, 2.0])), 10.0)
    assert line.measured == pytest.approx(-0.03)
    assert line.verdict is Verdict.FAIL
    assert replace(line, tolerance=inf).verdict is Verdict.PASS


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without an engine: Hertz's peak, spheres that slide."""
    points = {key: panel["series"][0]["points"] for key, panel in published().items()}
    assert points["glass"][:, 1].max() * 1e3 == pytest.approx(GLASS.on_equal().peak_force(20.0), rel=5e-3)
    slides = points["spin"][points["spin"][:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = points["oxide-restitution"][points["oxide-restitution"][:, 0] >= 40.0]
    assert steep[:, 1] == pytest.approx(1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0])), abs=5e-3)
    fast = points["steel-surface"][-3:]
    assert fast[:, 1] == pytest.approx(fast[:, 0] - 7.0, abs=0.1)


def test_impacts_of_spheres_on_planes_and_on_each_other() -> None:
    plane, pair = ALLOY.on_plane(), ALLOY.on_equal()
    assert plane.modulus == pytest.approx(7e10 / (1.0 - 0.33**2))
    assert plane.mass == pytest.approx(2700.0 * 4.0 / 3.0 * pi * 1e-3)
    assert (pair.modulus, pair.mass, pair.radius) == pytest.approx((plane.modulus / 2.0, plane.mass / 2.0, 0.05))
    assert plane.duration(1.0) == pytest.approx(2.868 * (plane.mass**2 / (0.1 * plane.modulus**2)) ** 0.2, rel=1e-3)


def test_only_stiff_decks_ask_for_hard_particles() -> None:
    scene = bench_scene([Bead(0, (0.0, 0.0, 5e-3), 3e-4, density=7000.0)])
    case = bench_case(liquid=DRY)
    soft, stiff = (
        compose(Plan(replace(case, contact=replace(case.contact, youngs_modulus=one)), scene, bench_recording(10))).text
        for one in (1e9, 7e10)
    )
    assert "hard_particles" not in soft
    assert stiff.index("hard_particles  yes") < stiff.index("youngsModulus")
    assert "youngsModulus peratomtype 70000000000.0 70000000000.0" in stiff
    assert [line.split()[-1] for line in soft.splitlines() if "density" in line] == ["7000.0"]
