"""The second engine: against closed forms, against LIGGGHTS, and that it can tell a difference."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call
from walkers import run
from walkers.inputs import resolve_case
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, read_toml, shipped_cases
from walkers.postprocess.motion import Motion
from walkers.studies.crosscheck import kernels
from walkers.studies.crosscheck.comparison import Quantity, compare, shortened, simulate
from walkers.studies.crosscheck.engine import Beads, Matter, SecondEngine, Surroundings
from walkers.studies.crosscheck.laws import ForceTable, Laws, laws_from
from walkers.studies.crosscheck.report import full_cases

RADIUS, DENSITY, MODULUS = 3e-4, 4000.0, 5e7
ELASTIC = Matter(DENSITY, MODULUS)
FLOOR = Surroundings(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
DRY = replace(Laws(), capillary=False, normal_lubrication=False, tangential_lubrication=False, wall_copies=1)


def one_bead(
    matter: Matter = ELASTIC,
    around: Surroundings = FLOOR,
    laws: Laws = DRY,
    step: float = 1e-6,
    height: float = RADIUS,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SecondEngine:
    """A bead above a floor."""
    beads = Beads(np.array([RADIUS]), np.array([[0.0, 0.0, height]]), np.array([velocity]), np.zeros((1, 3)))
    return SecondEngine(beads, matter, around, laws, step)


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


def test_a_rebound_has_the_restitution_that_is_given() -> None:
    """Tsuji's damping of Hertz's contact gives one restitution at all velocities."""
    for restitution in (0.3, 0.8):
        matter = replace(ELASTIC, restitution=restitution)
        engine = one_bead(matter, step=2e-7, height=RADIUS + 1e-7, velocity=(0.0, 0.0, -0.05))
        frame = engine.run(3000, 3000)[0, 0]
        assert frame[5] / 0.05 == pytest.approx(restitution, rel=0.02)


def test_a_sliding_bead_rolls_at_five_sevenths() -> None:
    """Whatever the friction: 2/5 m R² of inertia, and friction at the rim until it rolls."""
    around = replace(FLOOR, gravity=(0.0, 0.0, -9.81))
    matter = replace(ELASTIC, friction_walls=0.3, restitution=0.3)
    depth = (3.0 * 4.0 / 3.0 * pi * RADIUS**3 * DENSITY * 9.81 / (4.0 * MODULUS / 1.82 * sqrt(RADIUS))) ** (2.0 / 3.0)
    engine = one_bead(matter, around, height=RADIUS - depth, velocity=(0.02, 0.0, 0.0))
    frame = engine.run(20_000, 20_000)[0, 0]
    assert frame[3] == pytest.approx(5.0 / 7.0 * 0.02, rel=2e-3)
    assert RADIUS * frame[7] == pytest.approx(frame[3], rel=2e-3)


def test_a_bead_in_a_film_is_dragged_as_stokes_has_it() -> None:
    """It slows down by exp(-6πηR t/m), above the floor, and not beyond the film's reach."""
    matter = replace(ELASTIC, film_viscosity=0.05, volume_fraction=0.01)
    rate = 6.0 * pi * 0.05 * RADIUS / (4.0 / 3.0 * pi * RADIUS**3 * DENSITY)
    near = one_bead(matter, height=1.1 * RADIUS, velocity=(0.02, 0.0, 0.0)).run(2000, 2000)[0, 0]
    assert near[3] == pytest.approx(0.02 * np.exp(-rate * 2e-3), rel=1e-3)
    far = one_bead(matter, height=2.0 * RADIUS, velocity=(0.02, 0.0, 0.0)).run(2000, 2000)[0, 0]
    assert far[3] == 0.02


def test_a_plane_has_twice_the_normal_lubrication_of_two_halves_beyond_the_cut() -> None:
    """6πηR²v/h against half of it; within the minimum separation they are the same, with R = R/2 twice."""
    matter = replace(ELASTIC, viscosity=0.05, volume_fraction=0.01)
    wet = replace(Laws(), capillary=False)
    forces = {}
    for gap in (-1e-9, 0.1 * RADIUS):
        for lubrication in ("halves", "plane-normal", "plane"):
            laws = replace(wet, wall_lubrication=lubrication)
            engine = one_bead(matter, laws=laws, height=RADIUS + gap, velocity=(0.0, 0.0, 0.01))
            engine.state.wall_bridged[:] = True
            engine.evaluate()
            forces[gap, lubrication] = engine.state.force[0, 2]
    plane = -6.0 * pi * 0.05 * RADIUS**2 * 0.01 / (0.1 * RADIUS)
    assert forces[0.1 * RADIUS, "plane"] == pytest.approx(plane)
    assert forces[0.1 * RADIUS, "plane-normal"] == pytest.approx(plane)
    assert forces[0.1 * RADIUS, "halves"] == pytest.approx(plane / 2.0)
    touching = [forces[-1e-9, name] for name in ("halves", "plane-normal", "plane")]
    assert touching == pytest.approx([touching[0]] * 3)


def test_a_table_takes_the_place_of_the_formula() -> None:
    """Of these radii alone; the bridge breaks where it ends."""
    table = ForceTable((RADIUS, None), (0.0, 1e-5, 2e-5), (2e-3, 1e-3, 1e-3))
    matter = replace(ELASTIC, surface_tension=0.02)
    for height, pull in ((1.5e-5, 2e-5), (2.5e-5, 0.0)):
        engine = one_bead(matter, laws=replace(Laws(), capillary_tables=(table,)), height=RADIUS + height)
        engine.state.wall_bridged[:] = True
        engine.evaluate()
        assert engine.state.force[0, 2] == pytest.approx(-pull, abs=1e-12)
    with pytest.raises(ValueError, match="increase from 0"):
        ForceTable((RADIUS, None), (1e-5, 2e-5), (1.0, 1.0))


@pytest.mark.parametrize("law", ["static-friction=stick-slip", "static-friction=velocity"])
def test_static_friction_holds_up_to_its_limit_and_slides_with_less(law: str) -> None:
    """On a slope between both coefficients a block stays, unless pushed; a bead whose spin is held is one."""
    laws = replace(laws_from((), [law, "static-ratio=2", "static-velocity=1e-3"]), wall_copies=1, capillary=False)
    moved = {}
    for slope in (0.15, 0.25):
        weight = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY * 9.81
        around = replace(FLOOR, gravity=(9.81 * slope, 0.0, -9.81))
        matter = replace(ELASTIC, friction_walls=0.1, restitution=0.3)
        depth = (3.0 * weight / (4.0 * MODULUS / 1.82 * sqrt(RADIUS))) ** (2.0 / 3.0)
        engine = one_bead(matter, around, laws, height=RADIUS - depth)
        for _ in range(2000):
            engine.state.spin[:] = 0.0
            frame = engine.run(1, 1)[0, 0]
        moved[slope] = frame[3]
    assert abs(moved[0.15]) < 1e-5
    # Kinetic friction of 0.1 alone would leave 0.15 g to speed it up for two milliseconds.
    assert moved[0.25] > 0.5 * 0.15 * 9.81 * 2e-3


def test_a_bridge_between_beads_breaks_and_shares_its_liquid() -> None:
    """The volume is kept, and each bead gets a share by its volume."""
    radius = np.array([3e-4, 2e-4])
    beads = Beads(
        radius,
        np.array([[0.0, 0.0, 1.0], [5e-4 - 1e-9, 0.0, 1.0]]),
        np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]),
        np.zeros((2, 3)),
    )
    matter = replace(ELASTIC, surface_tension=0.02)
    engine = SecondEngine(beads, matter, FLOOR, Laws(), 1e-6)
    assert engine.bridges() == [(0, 1)]
    engine.run(2000, 2000)
    assert engine.bridges() == []
    liquid = engine.state.liquid * radius**3
    assert liquid.sum() == pytest.approx(0.01 * np.sum(radius**3))
    given = [kernels.caps(*radius, 0.01), kernels.caps(*radius[::-1], 0.01)]
    moved = 4.0 / 3.0 * pi * (liquid[0] - 0.01 * radius[0] ** 3)
    assert moved == pytest.approx(sum(given) * 27.0 / 35.0 - given[0])


def test_fig1b_is_one_motion_in_both_engines(fig1b: Motion) -> None:
    """Velocity, rotation and sliding agree, and so do places: rolling friction amplifies no more than rounding."""
    found = compare(fig1b, Laws(), None)
    assert found.disagreements == []
    assert found.rows[0].second == pytest.approx(found.rows[0].first, rel=5e-6)
    assert found.parting.together is None
    assert found.parting.apart.max() < 1e-6


@pytest.mark.parametrize("term", ["film", "rolling-friction", "tangential-lubrication", "tangential-spring"])
def test_without_a_term_it_disagrees(fig1b: Motion, term: str) -> None:
    """So that agreement says something of that term."""
    found = compare(fig1b, laws_from([term]), None, every_step=False)
    assert found.disagreements or found.parting.together is not None


def test_the_limit_of_friction_is_of_repulsion_and_damping(fig1b: Motion) -> None:
    """The other reading of Coulomb's law is told apart by the places of the beads, a hundred times over."""
    found = [
        compare(fig1b, laws, None, every_step=False) for laws in (Laws(), replace(Laws(), coulomb_limit="elastic"))
    ]
    assert found[1].parting.apart.max() > 50.0 * found[0].parting.apart.max()


def other_kinds() -> dict[str, Case]:
    """What fig1b has not: a wall of two faces, two harmonics, four beads whose contacts open."""
    cases = full_cases()
    return {name: shortened(cases[name](), 3) for name in ("groove of 120°", "two tones", "fan of three", "fig4b")}


@pytest.mark.parametrize("name", ["groove of 120°", "two tones", "fan of three", "fig4b"])
def test_other_kinds_of_cases_agree(name: str, tmp_path: Path) -> None:
    """In every row, and in every frame; to 0.1 nm without rolling friction, which amplifies rounding."""
    case = other_kinds()[name]
    found = compare(run(case, tmp_path).motion, Laws(), None, every_step=False)
    assert found.disagreements == []
    assert found.parting.apart.max() < 1e-5
    free = replace(case, contact=replace(case.contact, rolling_friction=0.0))
    assert compare(run(free, tmp_path).motion, Laws(), None, every_step=False).parting.apart.max() < 1e-10


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
        return float(np.abs(simulate(settling, Laws()).motion.position - settling.position).max())

    together = apart()
    assert together < 1e-9

    evaluate = SecondEngine.evaluate

    def forget(engine: SecondEngine) -> None:
        engine._pairs.spring[:] = 0.0
        evaluate(engine)

    monkeypatch.setattr(SecondEngine, "evaluate", forget)
    assert apart() > 100.0 * together


def test_distributions_that_differ_are_told_apart() -> None:
    """By the p of the test, from five starts on."""
    same = Quantity("height", "mm", (1.0, 1.1, 1.2, 1.3, 1.4), (1.05, 1.15, 1.25, 1.35, 1.45))
    assert same.p > 0.5
    assert replace(same, second=(2.0, 2.1, 2.2, 2.3, 2.4)).p < 0.01


def test_command(in_folder: Path) -> None:
    """It runs what is missing, prints both engines and exits with 1 if they differ."""
    done = call("crosscheck", "fig1b", "--cycles", "6", check=True)
    assert "velocity" in done.stdout
    assert "1.00000" in done.stdout
    differs = call("crosscheck", "fig1b", "--cycles", "6", "--without", "film", "--json")
    assert differs.returncode == 1
    told = json.loads(differs.stdout)
    assert told["laws"] == ["film=off"]
    assert "velocity" in told["disagreements"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["fig1b", "--without", "magic"], "--without magic: expected one of"),
        (["fig1b", "--law", "wall-lubrication=sphere"], "expected one of halves, plane-normal, plane"),
        (["fig1b", "--law", "static-ratio=half"], "expected a number"),
        (["fig1b", "--law", "static-ratio=1.5"], "expected static-friction=velocity or stick-slip"),
        (
            ["fig1b", "--law", "static-ratio=0.5", "--law", "static-friction=velocity"],
            "--law static-ratio: expected at least 1",
        ),
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


def test_round_walls_are_refused(in_folder: Path) -> None:
    """With the key that says so."""
    text = shipped_cases()["pile-ci"].read_text("utf-8")
    Path("round.toml").write_text(text.replace('"box"', '"cylinder"').replace('"4 mm"', '"6 mm"'), "utf-8")
    done = call("crosscheck", "round.toml")
    assert done.returncode == 2
    assert "boundary.shape" in done.stderr
