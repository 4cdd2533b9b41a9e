"""YADE beside LIGGGHTS: what is added to YADE against the second engine, what YADE is told, and YADE itself."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call
from walkers import run
from walkers.inputs.reading import load_case, shipped_cases
from walkers.postprocess.motion import Motion
from walkers.studies.crosscheck import yade_script
from walkers.studies.crosscheck.comparison import shortened
from walkers.studies.crosscheck.engine import Beads, Matter, SecondEngine, Surroundings
from walkers.studies.crosscheck.laws import Laws, laws_from
from walkers.studies.crosscheck.yade import (
    YadeFailure,
    compare_with_yade,
    find_program,
    first_walkers,
    frames_by,
    numbers_of,
)
from walkers.studies.crosscheck.yade_script import STEEPER, AddedTerms, acceleration, damping_ratio

RADIUS = np.array([3e-4, 2e-4, 2.5e-4])
WET = Matter(
    density=4000.0,
    youngs_modulus=5e7,
    restitution=0.3,
    friction_beads=0.1,
    friction_walls=0.2,
    rolling_friction=0.05,
    surface_tension=0.02,
    viscosity=0.05,
    film_viscosity=0.01,
    contact_angle=0.1,
)
AROUND = Surroundings(np.array([[0.0, 0.0, 0.0], [0.0, 4e-4, 0.0]]), np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
WALLS = [{"axis": 2, "place": 0.0, "side": 1}, {"axis": 1, "place": 4e-4, "side": -1}]
NOT_ADDED = laws_from(["capillary", "normal-lubrication", "tangential-lubrication", "rolling-friction", "film"])
YADE = find_program()
needs_yade = pytest.mark.skipif(YADE is None, reason="YADE is not installed: apt-get install yade")


def beads(apart: float) -> Beads:
    """One touches a floor and the second bead; that hangs over the floor, the third is ``apart`` (m) from it."""
    height = RADIUS[1] + 5e-6
    rise = height - (RADIUS[0] - 2e-7)
    along = sqrt((RADIUS[0] + RADIUS[1] - 1e-7) ** 2 - rise**2)
    position = [[0.0, 0.0, height - rise], [along, 0.0, height], [along, RADIUS[1] + RADIUS[2] + apart, height]]
    random = np.random.default_rng(1)
    velocity, spin = random.normal(0.0, 0.02, (3, 3)), random.normal(0.0, 50.0, (3, 3))
    return Beads(RADIUS, np.array(position), velocity, spin)


def both(start: Beads, laws: Laws = Laws()) -> tuple[SecondEngine, AddedTerms]:  # noqa: B008
    """The second engine and YADE's added terms, with bridges to all walls and along the chain."""
    engine = SecondEngine(start, WET, AROUND, laws, 1e-6)
    engine.state.wall_bridged[:] = True
    engine._pairs.bridged[:] = engine._pairs.second - engine._pairs.first == 1
    engine.evaluate()
    terms = AddedTerms({**asdict(WET), "radius": RADIUS.tolist(), "walls": WALLS, "wall_copies": 2})
    terms.at_wall = [[True, True] for _ in RADIUS]
    terms.between = [True, False, True]
    evaluate(terms, start)
    return engine, terms


def evaluate(terms: AddedTerms, start: Beads) -> None:
    """The added terms where the beads are."""
    position, velocity, spin = (
        [tuple(one) for one in part.tolist()] for part in (start.position, start.velocity, start.spin)
    )
    terms.evaluate(position, velocity, spin)


@pytest.fixture(scope="module")
def fig1b(tmp_path_factory: pytest.TempPathFactory) -> Motion:
    """Fig. 1b for six cycles, by LIGGGHTS."""
    return run(shortened(load_case("fig1b"), 6), tmp_path_factory.mktemp("runs")).motion


@pytest.mark.parametrize("apart", [1e-6, 2e-5])
def test_added_terms_are_those_of_the_second_engine(apart: float) -> None:
    """Its forces and torques less those without the terms that YADE has not; two writings of the same formulas."""
    start = beads(apart)
    engine, terms = both(start)
    dry, _ = both(start, NOT_ADDED)
    force, torque = engine.state.force - dry.state.force, engine.state.torque - dry.state.torque
    assert np.abs(force).min(axis=0).max() > 1e-9
    np.testing.assert_allclose(terms.force, force, rtol=1e-9, atol=1e-16)
    np.testing.assert_allclose(terms.torque, torque, rtol=1e-9, atol=1e-19)


def test_a_bridge_that_breaks_shares_its_liquid_as_in_the_second_engine() -> None:
    """And all bridges are of the new volumes from then on."""
    start = beads(1e-4)
    engine, terms = both(start)
    assert terms.between == [True, False, False]
    np.testing.assert_allclose(terms.content, engine.state.liquid, rtol=1e-12)
    assert np.ptp(terms.content) > 1e-4
    np.testing.assert_allclose([one.rupture for one in terms.wall_bridge], engine.state.wall_bridge[:, 4], rtol=1e-12)


def test_walls_are_stiffer_by_what_makes_them_planes() -> None:
    """YADE has R* = R/2 at a wall: bead and wall in series are √2 times as stiff as two beads, E/2."""
    modulus = 1.0 / (1.0 + 1.0 / STEEPER)
    assert modulus * sqrt(0.5) == pytest.approx(0.5)


def test_damping_is_the_decks() -> None:
    """e = 0.3: β = 0.358, YADE's share of the critical damping √(5/6) of it."""
    assert damping_ratio(0.3) == pytest.approx(sqrt(5.0 / 6.0) * 0.35786, rel=1e-4)
    assert damping_ratio(1.0) == 0.0


def test_numbers_are_those_of_the_run(fig1b: Motion) -> None:
    """One walker, each frame after the first, plain JSON; the drive as the case has it."""
    alone = first_walkers(fig1b)
    assert alone.position.shape[1] == 2
    assert len(alone.groups[0].walkers) == 1
    np.testing.assert_array_equal(alone.groups[0].position[:, 0], fig1b.groups[0].position[:, 0])
    numbers = json.loads(json.dumps(numbers_of(alone)))
    assert numbers["walls"] == [{"axis": 2, "place": 0.0, "side": 1}]
    assert len(numbers["records"]) == len(fig1b.time) - 1
    assert numbers["records"][-1] == 6 * fig1b.case.run.steps_per_cycle
    quarter = fig1b.case.run.steps_per_cycle // 4
    peak = fig1b.case.drive.harmonics[0]
    largest = max(abs(acceleration(numbers, step)[0]) for step in range(4 * quarter))
    assert largest == pytest.approx(peak.peak_acceleration, rel=1e-4)
    assert acceleration(numbers, -1) == pytest.approx((0.0, 0.0, -9.81), abs=0.01)


def test_the_script_needs_nothing_but_yade(fig1b: Motion, tmp_path: Path) -> None:
    """Not this project, nor any other package: what is missing in a bare Python is YADE."""
    (tmp_path / "numbers.json").write_text(json.dumps(numbers_of(first_walkers(fig1b))), "utf-8")
    (tmp_path / "script.py").write_text(Path(yade_script.__file__).read_text("utf-8"), "utf-8")
    bare = [sys.executable, "-I", "-S", "script.py"]
    done = subprocess.run(bare, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr.strip().endswith("No module named 'yade'")


@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("echo 'no such law' >&2; exit 1", "status 1; its last words: no such law"),
        ("exit 0", "status 0; its last words: nothing"),
        ("printf 12345678 > frames.bin", "left 1 numbers where"),
    ],
)
def test_a_yade_that_fails_is_told(fig1b: Motion, tmp_path: Path, does: str, told: str) -> None:
    """With what it said last."""
    program = tmp_path / "yade"
    program.write_text(f"#!/bin/sh\n{does}\n", "utf-8")
    program.chmod(0o755)
    with pytest.raises(YadeFailure, match=told):
        frames_by(str(program), numbers_of(first_walkers(fig1b)))


def test_without_yade_it_says_how_to_get_it(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit 2, before anything is run."""
    monkeypatch.setenv("PATH", "")
    done = call("crosscheck", "fig1b", "--with", "yade")
    assert done.returncode == 2
    assert "YADE is not installed" in done.stderr
    assert "apt-get install yade" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert list(in_folder.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["fig1b", "--without", "film"], "has the decks' laws alone"),
        (["fig1b", "--law", "wall-lubrication=plane"], "has the decks' laws alone"),
        (["pile-ci"], "expected walkers that do not meet"),
        (["groove.toml"], "expected flat walls that are normal to x, y or z"),
    ],
)
def test_what_yade_is_not_asked_for_is_refused(in_folder: Path, arguments: list[str], told: str) -> None:
    """One line, exit 2, whether YADE is installed or not."""
    text = shipped_cases()["fig1b"].read_text("utf-8")
    groove = '[boundary]\nshape = "groove"\nopening = "120 deg"'
    Path("groove.toml").write_text(text.replace("[boundary]", groove), "utf-8")
    done = call("crosscheck", *arguments, "--with", "yade")
    assert done.returncode == 2
    assert told in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
@needs_yade
def test_yade_agrees_and_tells_other_friction_apart(fig1b: Motion) -> None:
    """Well within the tolerances; with a tenth more friction at the wall beyond them, or it would be no check."""
    assert YADE is not None
    found = compare_with_yade(fig1b, YADE)
    assert found.disagreements == []
    assert found.rows[0].second == pytest.approx(found.rows[0].first, rel=1e-3)
    assert found.parting.apart.max() < 1e-7
    contact = replace(fig1b.case.contact, friction_bead_wall=1.1 * fig1b.case.contact.friction_bead_wall)
    other = replace(fig1b, case=replace(fig1b.case, contact=contact))
    assert compare_with_yade(other, YADE).disagreements


@pytest.mark.slow
@needs_yade
def test_command_with_yade(in_folder: Path) -> None:
    """Both engines and the tolerances are printed; JSON has them, too."""
    done = call("crosscheck", "fig1b", "--cycles", "3", "--with", "yade", check=True)
    assert "YADE" in done.stdout
    assert "allowed: velocity" in done.stdout
    told: dict[str, Any] = json.loads(call("crosscheck", "fig1b", "--cycles", "3", "--with", "yade", "--json").stdout)
    assert told["disagreements"] == []
    assert told["tolerances"]["speed"] > 0.0
