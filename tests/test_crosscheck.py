"""The second engine: against closed forms, against LIGGGHTS, and that it can tell a difference."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call
from walkers import run
from walkers.check import kernels
from walkers.check.comparison import compare, probability, shortened, simulate
from walkers.check.crosscheck import full_cases
from walkers.check.engine import TERMS, Beads, Matter, SecondEngine, Surroundings
from walkers.check.scenes import SCENES, full_case, second_engine
from walkers.inputs import resolve_case
from walkers.inputs.boundary import BOTTOM, Round
from walkers.inputs.reading import load_case, read_toml, shipped_cases
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import law_of
from walkers.physics.matter import Contact, Liquid
from walkers.postprocess.motion import Motion

RADIUS = 3e-4
LIQUID = Liquid(0.02, 0.0, None, 0.01, 0.0, None)
ELASTIC = Matter(4000.0, Contact(5e7, 0.3, 1.0, 0.0, 0.0, 0.0, 0.01), LIQUID)
FLOOR = Surroundings([BOTTOM])
DRY = ("capillary", "lubrication")


def one_bead(
    matter: Matter = ELASTIC,
    around: Surroundings = FLOOR,
    without: tuple[str, ...] = DRY,
    step: float = 1e-6,
    height: float = RADIUS,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SecondEngine:
    """A bead above a floor."""
    beads = Beads(np.array([RADIUS]), np.array([[0.0, 0.0, height]]), np.array([velocity]), np.zeros((1, 3)))
    return SecondEngine(beads, matter, around, step, without=without)


@pytest.fixture(scope="module")
def fig1b(tmp_path_factory: pytest.TempPathFactory) -> Motion:
    """Fig. 1b for nine cycles, by LIGGGHTS."""
    return run(shortened(load_case("fig1b"), 9), tmp_path_factory.mktemp("runs")).motion


def test_an_elastic_bounce_keeps_its_energy_to_the_order_of_the_step() -> None:
    """Velocity Verlet is of second order: the rebound's error falls to a quarter with half the step."""
    errors = []
    for halvings in range(3):
        step = 2e-6 / 2**halvings
        engine = one_bead(step=step, height=RADIUS + 1e-6, velocity=(0.0, 0.0, -0.05))
        frame = engine.run(round(3e-4 / step), round(3e-4 / step))[0, 0]
        assert frame[5] > 0.0
        errors.append(abs(frame[5] / 0.05 - 1.0))
    assert errors[0] < 1e-3
    assert errors[2] < errors[0] / 8.0


def test_a_sliding_bead_rolls_at_five_sevenths() -> None:
    """Whatever the friction: 2/5 m R² of inertia, and friction at the rim until it rolls."""
    around = replace(FLOOR, gravity=(0.0, 0.0, -9.81))
    depth = (3.0 * 4.0 / 3.0 * pi * RADIUS**3 * 4000.0 * 9.81 / (4.0 * 5e7 / 1.82 * sqrt(RADIUS))) ** (2.0 / 3.0)
    matter = replace(ELASTIC, contact=replace(ELASTIC.contact, friction_bead_wall=0.3, restitution=0.3))
    engine = one_bead(matter, around, height=RADIUS - depth, velocity=(0.02, 0.0, 0.0))
    frame = engine.run(20_000, 20_000)[0, 0]
    assert frame[3] == pytest.approx(5.0 / 7.0 * 0.02, rel=2e-3)
    assert RADIUS * frame[7] == pytest.approx(frame[3], rel=2e-3)


def test_a_bead_rolls_to_rest_and_swings_in_a_cylinder() -> None:
    """Rolling friction slows at 5/7 μ_r g; beside the lowest line of a cylinder on its side ω² = 5/7 g/(C - R)."""
    depth = (3.0 * 4.0 / 3.0 * pi * RADIUS**3 * 4000.0 * 9.81 / (4.0 * 5e7 / 1.82 * sqrt(RADIUS))) ** (2.0 / 3.0)
    contact = replace(ELASTIC.contact, friction_bead_wall=0.9, restitution=0.3)
    rough = replace(ELASTIC, contact=replace(contact, rolling_friction=0.01))
    speed, slowing, none = 5e-3, 5.0 / 7.0 * 0.01 * 9.81, np.zeros((1, 3))
    rolls = Beads(np.array([RADIUS]), np.array([[0.0, 0.0, RADIUS - depth]]), np.array([[speed, 0.0, 0.0]]),
                  np.array([[0.0, speed / RADIUS, 0.0]]))  # fmt: skip
    engine = SecondEngine(rolls, rough, replace(FLOOR, gravity=(0.0, 0.0, -9.81)), 2e-6, without=DRY)
    frames = engine.run(25_000, 1000)[:, 0, 3]
    expected = speed - slowing * 2e-3 * np.arange(1, 26)
    assert frames == pytest.approx(expected, abs=2e-3 * speed)

    out, turn = 3e-3 - RADIUS + depth, 0.05
    place = np.array([[-out * np.cos(turn), out * np.sin(turn), 0.0]])
    around = Surroundings([Round(3e-3)], gravity=(-9.81, 0.0, 0.0))
    matter = replace(ELASTIC, contact=contact)
    engine = SecondEngine(Beads(np.array([RADIUS]), place, none, none), matter, around, 1e-6, without=DRY)
    swings = engine.run(100_000, 500)[:, 0, 1]
    frequency = sqrt(5.0 / 7.0 * 9.81 / out) * (1.0 - turn**2 / 16.0)
    expected = out * np.sin(turn * np.cos(frequency * 5e-4 * np.arange(1, 201)))
    assert swings == pytest.approx(expected, abs=2e-3 * out * turn)


def test_bridges_are_the_law_between_its_knots() -> None:
    """Pull and resistances, at gaps that are none of the splines', to 1e-8."""
    matter = replace(ELASTIC, liquid=replace(LIQUID, dynamic_viscosity=0.01))
    engine = one_bead(matter, without=())
    bridges, curve = engine.constants.bridges, law_of(matter.liquid)(Surfaces.of(RADIUS, inf, matter.liquid, 0.01))
    for gap in np.linspace(0.0, 0.999 * curve.rupture, 777):
        expected = curve.forces(np.array([gap])).columns()[0]
        assert kernels.bridge_forces(bridges, bridges.between[0, -1], gap) == pytest.approx(expected, rel=1e-8)


def test_a_bridge_forms_on_touch_and_breaks_at_rupture() -> None:
    """Between beads and at walls; what is apart at first has none."""
    radius = np.array([3e-4, 2e-4])
    places = np.array([[0.0, 0.0, 1.0], [5e-4 - 1e-9, 0.0, 1.0]])
    beads = Beads(radius, places, np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), np.zeros((2, 3)))
    engine = SecondEngine(beads, ELASTIC, FLOOR, 1e-6)
    assert engine.bridges() == [(0, 1)]
    engine.run(2000, 2000)
    assert engine.bridges() == []
    assert not one_bead(without=(), height=RADIUS + 1e-6).state.wall_bridged.any()
    assert one_bead(without=(), height=RADIUS - 1e-9).state.wall_bridged.all()


def test_the_forces_of_a_pair_conserve_momentum_and_angular_momentum() -> None:
    """With friction, rolling friction, and all resistances of a bridge."""
    case = full_case()
    scene = SCENES["two beads part"][1]
    engine = second_engine(case, scene)
    places = np.array([bead.centre for bead in scene.beads])
    for _ in range(300):
        engine.run(1, 1)
        force, torque = engine.state.force, engine.state.torque
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
        places = engine.state.position
        turn = np.cross(places, force).sum(axis=0) + torque.sum(axis=0)
        assert np.abs(turn).max() < 1e-10 * np.abs(force).max() * np.abs(places).max()


def test_fig1b_is_one_motion_in_both_engines(fig1b: Motion) -> None:
    """Velocity, rotation and sliding agree to 1e-6, and so do places: its contacts stay closed."""
    found = compare([fig1b])
    assert found.disagreements == []
    assert found.rows[0].second == pytest.approx(found.rows[0].first, rel=1e-6)
    assert found.starts[0].together is None
    assert found.starts[0].apart.max() < 1e-8


@pytest.mark.parametrize("term", TERMS)
def test_without_a_term_it_disagrees(fig1b: Motion, term: str) -> None:
    """So that agreement says something of that term."""
    found = compare([fig1b], [term])
    assert found.disagreements or found.starts[0].together is not None


@pytest.mark.parametrize("name", ["groove of 120°", "two tones", "fan of three", "fig4b"])
def test_other_kinds_of_cases_agree(name: str, tmp_path: Path) -> None:
    """A wall of two faces, two harmonics, four beads whose contacts open: in every row, and in every frame.

    To 0.1 nm without rolling friction, which amplifies rounding.
    """
    case = shortened(full_cases()[name], 3)
    found = compare([run(case, tmp_path).motion])
    assert found.disagreements == []
    assert found.starts[0].apart.max() < 1e-5
    free = replace(case, contact=replace(case.contact, rolling_friction=0.0))
    assert compare([run(free, tmp_path).motion]).starts[0].apart.max() < 1e-10


def test_a_restart_keeps_what_is_between_beads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A settling pile follows LIGGGHTS through a restart; it would not if springs between beads were forgotten."""
    document = read_toml(shipped_cases()["pile-ci"])
    document["mixture"] |= {"count": 24}
    motion = run(shortened(resolve_case(document, name="pile"), 9), tmp_path).motion
    settling = replace(
        motion, **{name: getattr(motion, name)[:7] for name in ("time", "position", "velocity", "spin", "frames")}
    )
    assert settling.frames[6][0] != settling.frames[1][0]

    def apart() -> float:
        return float(np.abs(simulate(settling).position - settling.position).max())

    together = apart()
    assert together < 1e-8

    evaluate = SecondEngine.evaluate

    def forget(engine: SecondEngine) -> None:
        engine.pairs.spring[:] = 0.0
        evaluate(engine)

    monkeypatch.setattr(SecondEngine, "evaluate", forget)
    assert apart() > 50.0 * together


def test_distributions_that_differ_are_told_apart() -> None:
    """By the p of the test, from five starts on."""
    heights = [1.0, 1.1, 1.2, 1.3, 1.4]
    assert probability(heights, [one + 0.05 for one in heights]) > 0.5
    assert probability(heights, [one + 1.0 for one in heights]) < 0.01


def test_piles_agree_until_they_are_chaotic(in_folder: Path) -> None:
    done = call("crosscheck", "pile-ci", "--cycles", "9", "--seeds", "2", "--json", check=True)
    told = json.loads(done.stdout)
    assert [start["seed"] for start in told["starts"]] == [load_case("pile-ci").seed + number for number in (0, 1)]
    assert {row["name"] for row in told["rows"]} > {"height of the beads", "touching pairs a bead"}
    assert all(0.0 < row["p"] <= 1.0 for row in told["rows"])


def test_command(in_folder: Path) -> None:
    """It runs what is missing, prints both engines and exits with 1 if they differ."""
    done = call("crosscheck", "fig1b", "--cycles", "6", check=True)
    assert "velocity" in done.stdout
    assert "1.00000" in done.stdout
    differs = call("crosscheck", "fig1b", "--cycles", "6", "--without", "lubrication", "--json")
    assert differs.returncode == 1
    told = json.loads(differs.stdout)
    assert told["laws"] == ["lubrication=off"]
    assert "velocity" in told["disagreements"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["fig1b", "--without", "magic"], "--without magic: expected one of"),
        (["fig1b", "--cycles", "1"], "expected at least 3"),
        (["fig1b", "--seeds", "2"], "--seeds: is for piles"),
    ],
)
def test_bad_input_is_told_once(in_folder: Path, arguments: list[str], told: str) -> None:
    """One line, exit 2."""
    done = call("crosscheck", *arguments)
    assert done.returncode == 2
    assert told in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
