"""The second engine and the law of bridges against the literature: the pages of `walkers check literature`."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, inf, pi
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tests.conftest import call
from tests.printed import spoilt
from walkers.check import benchmarks, bridges
from walkers.check.benchmarks import GLASS, farthest_point, published
from walkers.check.bridges import LAWS, Law
from walkers.check.report import CHAPTERS, PAGE, Chapter, Verdict
from walkers.physics.capillary import derjaguin_radius
from walkers.runner.failures import EngineFailure

# --- Impacts --------------------------------------------------------------------------------------------------------


def test_a_point_off_the_curve_is_found_and_judged_by_the_axis() -> None:
    points = np.array([(0.0, 0.0), (1.0, 1.3), (2.0, 2.0)])
    line = farthest_point("y", points, (np.array([0.0, 2.0]), np.array([0.0, 2.0])), 10.0)
    assert line.measured == pytest.approx(-0.03)
    assert line.verdict is Verdict.FAIL
    assert replace(line, tolerance=inf).verdict is Verdict.NOT_JUDGED


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without an engine: Hertz's peak, spheres that slide."""
    points = {key: panel["series"][0]["points"] for key, panel in published().items()}
    assert points["glass"][:, 1].max() * 1e3 == pytest.approx(GLASS.on_equal().peak_force(20.0), rel=5e-3)
    slides = points["spin"][points["spin"][:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = points["oxide-restitution"][points["oxide-restitution"][:, 0] >= 40.0]
    assert steep[:, 1] == pytest.approx(1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0])), abs=5e-3)


# --- Published laws of bridges --------------------------------------------------------------------------------------


POLYNOMIALS = (bridges.SOULIE.name, "Willett 2000")


@pytest.mark.parametrize("law", [law for law in LAWS if law.name not in POLYNOMIALS], ids=lambda law: law.name)
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: Law, radius_2: float) -> None:
    """All but polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = law.pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


# --- Pages ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [benchmarks, bridges])
def test_chapters(module: ModuleType, in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has a page of its own when it is quick; one that cannot be made leaves the others."""
    found: Chapter = module.chapter(in_folder, quick=True)
    assert found.failures == []
    assert len(found.lines) > 45
    assert "doi" in found.text
    for name, figure in found.figures.items():
        assert f"figures/validation-{name}.png" in found.text
        assert spoilt(figure) == []

    def fail(out: Path, *, quick: bool = False) -> Chapter:
        raise EngineFailure("no engine here")

    monkeypatch.setattr(benchmarks, "chapter", fail)
    monkeypatch.setattr(bridges, "chapter", fail)
    monkeypatch.setattr(module, "chapter", lambda out, *, quick=False: found)
    done = call("check", "literature", "benchmarks", "bridges", "--quick", "-j", "1", "--json")
    assert (done.returncode, json.loads(done.stdout)["passed"]) == (1, False)
    (page,) = Path("runs/validation").glob("validation-quick-*.md")
    assert f"## {found.title}" in page.read_text()
    assert "no engine here" in page.read_text()
    assert all((page.parent / "figures" / f"validation-{name}.png").exists() for name in found.figures)
    assert not (page.parent / PAGE).exists()


def test_docs_have_all_chapters() -> None:
    page = (Path(__file__).parent.parent / "docs" / "explanation" / PAGE).read_text()
    assert page.count("\n## ") == len(CHAPTERS)
    assert "Not as expected" not in page
