"""The second engine and the laws of bridges against the literature."""

from __future__ import annotations

import json
from math import cos, inf, pi
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call
from walkers.check import literature
from walkers.check.benchmarks import TESTS, farthest_point, published
from walkers.check.bridges import LAWS, pulls
from walkers.check.lines import Verdict, count
from walkers.physics.capillary import derjaguin_radius
from walkers.runner.failures import EngineFailure

# --- Impacts --------------------------------------------------------------------------------------------------------


def test_a_point_off_the_curve_is_found_and_judged_by_the_axis() -> None:
    points = np.array([(0.0, 0.0), (1.0, 1.3), (2.0, 2.0)])
    line = farthest_point("y", points, (np.array([0.0, 2.0]), np.array([0.0, 2.0])), 10.0)
    assert line.measured == pytest.approx(-0.03)
    assert line.verdict is Verdict.FAIL


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without an engine: Hertz's peak, spheres that slide."""
    points = {key: panel["series"][0]["points"] for key, panel in published().items()}
    assert points["glass"][:, 1].max() * 1e3 == pytest.approx(TESTS["1: glass"].impact.peak_force(20.0), rel=5e-3)
    slides = points["spin"][points["spin"][:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = points["oxide-restitution"][points["oxide-restitution"][:, 0] >= 40.0]
    assert steep[:, 1] == pytest.approx(1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0])), abs=5e-3)


# --- Published laws of bridges --------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["Rabinovich 2005", "Lambert 2008"])
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: str, radius_2: float) -> None:
    """All but polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = LAWS[law].pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


def test_published_laws_beside_young_laplace() -> None:
    """The fit of Willett et al. is within its published error; the law of Soulié et al. is too strong at walls."""
    lines = {line.what: line for line in pulls()}
    assert [count(lines.values(), verdict) for verdict in (Verdict.PASS, Verdict.NOT_JUDGED)] == [4, 44]
    assert lines["Soulié 2006, fig1b, wall: work over Young–Laplace"].measured == pytest.approx(1.37, abs=0.01)
    assert lines["Soulié 2006, fig1b, beads: work over Young–Laplace"].measured == pytest.approx(0.96, abs=0.01)


# --- The command ------------------------------------------------------------------------------------------------------


def test_benchmarks_pass_and_a_check_that_cannot_be_computed_leaves_the_others(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(out: Path) -> None:
        raise EngineFailure("no engine here")

    monkeypatch.setitem(literature.LITERATURE, "crosscheck", fail)
    done = call("check", "literature", "benchmarks", "crosscheck", "--json")
    contents = json.loads(done.stdout)
    assert (done.returncode, contents["passed"]) == (1, False)
    *passed, failed = contents["lines"]
    assert {line["verdict"] for line in passed} == {"pass"}
    assert len(passed) > 55
    assert (failed["check"], failed["verdict"], "no engine here" in failed["what"]) == ("crosscheck", "ERROR", True)
