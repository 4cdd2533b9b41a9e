"""The second engine and the law of bridges against the literature: the pages of `walkers validate`."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, inf, pi, radians
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call
from tests.printed import spoilt
from walkers.check import benchmarks, bridges
from walkers.check.benchmarks import ALLOY, GLASS, OXIDE, STEEL, Speeds, farthest_point, onto_plane, published
from walkers.check.bridges import LAWS, SOULIE, Law, deviation
from walkers.check.report import Chapter, Verdict
from walkers.check.scenes import DRY, bench_case, recording, standing
from walkers.check.validate import CHAPTERS, PAGE, validate
from walkers.inputs.reading import load_case
from walkers.physics.bridge import Surfaces
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.laplace import force_curve, rupture_distance
from walkers.runner.failures import EngineFailure
from walkers.templates.deck import Plan, compose
from walkers.templates.scene import Bead

# --- Impacts --------------------------------------------------------------------------------------------------------


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
    assert replace(line, tolerance=inf).verdict is Verdict.TOLD


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without an engine: Hertz's peak, spheres that slide."""
    points = {key: panel["series"][0]["points"] for key, panel in published().items()}
    assert points["glass"][:, 1].max() * 1e3 == pytest.approx(GLASS.on_equal().peak_force(20.0), rel=5e-3)
    slides = points["spin"][points["spin"][:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = points["oxide-restitution"][points["oxide-restitution"][:, 0] >= 40.0]
    assert steep[:, 1] == pytest.approx(1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0])), abs=5e-3)


def test_impacts_of_spheres_on_planes_and_on_each_other() -> None:
    plane, pair = ALLOY.on_plane(), ALLOY.on_equal()
    assert plane.modulus == pytest.approx(7e10 / (1.0 - 0.33**2))
    assert plane.mass == pytest.approx(2700.0 * 4.0 / 3.0 * pi * 1e-3)
    assert pair == pytest.approx((plane.mass / 2.0, 0.05, plane.modulus / 2.0))
    assert plane.duration(1.0) == pytest.approx(2.868 * (plane.mass**2 / (0.1 * plane.modulus**2)) ** 0.2, rel=1e-3)


def test_only_stiff_decks_ask_for_hard_particles() -> None:
    scene = standing([Bead(0, (0.0, 0.0, 5e-3), 3e-4, density=7000.0)])
    case = bench_case(liquid=DRY)
    soft, stiff = (
        compose(Plan(replace(case, contact=replace(case.contact, youngs_modulus=one)), scene, recording(10))).text
        for one in (1e9, 7e10)
    )
    assert "hard_particles" not in soft
    assert stiff.index("hard_particles  yes") < stiff.index("youngsModulus")
    assert "youngsModulus peratomtype 70000000000.0 70000000000.0" in stiff
    assert [line.split()[-1] for line in soft.splitlines() if "density" in line] == ["7000.0"]


# --- Published laws of bridges --------------------------------------------------------------------------------------


POLYNOMIALS = (SOULIE.name, "Willett 2000")


def with_liquid(radius: float, other: float, volume_fraction: float, contact_angle: float) -> Surfaces:
    liquid = replace(load_case("fig1b").liquid, volume_fraction=volume_fraction, contact_angle=contact_angle)
    return Surfaces.of(radius, other, liquid, 0.01)


@pytest.mark.parametrize("law", [law for law in LAWS if law.name not in POLYNOMIALS], ids=lambda law: law.name)
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: Law, radius_2: float) -> None:
    """All but polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = law.pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


def test_laws_for_small_volumes_and_a_toroid() -> None:
    """A millionth of the radius cubed until the bridge is near its end; Weigert's toroid at contact."""
    by_name = {law.name.split()[0]: law for law in LAWS}
    gaps = np.linspace(0.0, 0.5 * rupture_distance(1.0, 1.0, 1e-6, 0.0), 20)
    exact = force_curve(1.0, 1.0, 1e-6, 0.0, gaps).forces
    for name in ("Lambert", "Rabinovich"):
        assert by_name[name].pull(1.0, 1.0, 1e-6, 0.0, gaps) == pytest.approx(exact, abs=0.025 * exact[0])
    for volume in (1e-3, 1e-2, 1e-1):
        pull = by_name["Weigert"].pull(1.0, 1.0, volume, 0.0, np.zeros(1))[0]
        assert pull == pytest.approx(force_curve(1.0, 1.0, volume, 0.0, [0.0]).forces[0], rel=0.08)


def test_what_is_wrong_with_soulies_law() -> None:
    """Doubling is right at walls at contact, not beyond; dimers are held too strongly at large contact angles."""
    wall, unequal, equal = (
        deviation(SOULIE, with_liquid(one, other, 0.171, radians(38.2)))
        for one, other in ((3e-4, inf), (6e-4, 3e-4), (3e-4, 3e-4))
    )
    assert wall.pull == pytest.approx(1.07, abs=0.01)
    assert wall.work > 1.3
    assert wall.rupture > 1.3
    assert unequal.pull == pytest.approx(1.40, abs=0.02)
    assert equal.pull == pytest.approx(1.2, abs=0.02)


# --- Pages ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [benchmarks, bridges])
def test_chapters(module: object, tmp_path: Path) -> None:
    found: Chapter = module.chapter(tmp_path, quick=True)  # type: ignore[attr-defined]
    assert found.failures == []
    assert len(found.lines) > 45
    assert "doi" in found.text
    for name, figure in found.figures.items():
        assert f"figures/validation-{name}.png" in found.text
        assert spoilt(figure) == []


def test_a_quick_chapter_has_a_page_of_its_own(in_folder: Path) -> None:
    done = call("validate", "benchmarks", "--quick", "-j", "1", "--json", check=True)
    assert json.loads(done.stdout)["passed"]
    page = Path("runs/validation/validation-quick-benchmarks.md")
    assert "## Published benchmarks of impacts" in page.read_text()
    assert (page.parent / "figures" / "validation-benchmarks.png").exists()
    assert not (page.parent / PAGE).exists()


def test_a_chapter_that_cannot_be_made_leaves_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(out: Path, *, quick: bool = False) -> Chapter:
        raise EngineFailure("no engine here")

    monkeypatch.setattr(bridges, "chapter", fail)
    made = validate(tmp_path, tmp_path, only=("bridges", "benchmarks"), quick=True)
    assert made.failed == ["bridges: could not be made: no engine here"]
    page = made.files[0].read_text()
    assert "no engine here" in page
    assert "## Published benchmarks of impacts" in page


def test_docs_have_all_chapters() -> None:
    page = (Path(__file__).parent.parent / "docs" / "explanation" / PAGE).read_text()
    assert page.count("\n## ") == len(CHAPTERS)
    assert "Not as expected" not in page


def test_an_unknown_chapter_is_told() -> None:
    done = call("validate", "benchmark")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "did you mean" in done.stderr
