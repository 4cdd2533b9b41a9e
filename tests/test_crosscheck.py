"""The second engine: against closed forms, against LIGGGHTS, and that it can tell a difference."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from math import cos, inf, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, to_toml
from walkers import run
from walkers.check import kernels
from walkers.check.crosscheck import compare, crosscheck, full_cases, shortened, simulate
from walkers.check.engine import TERMS, SecondEngine
from walkers.check.lines import Verdict, failures
from walkers.check.scenes import (
    DRY,
    FLOOR,
    SCENES,
    Bench,
    bench_case,
    full_case,
    liquid_lines,
    over,
    prescribed,
    recording,
    second_engine,
    standing,
)
from walkers.inputs.boundary import BOTTOM, Flat, Round, Wall
from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.toml import read_toml
from walkers.physics.bridge import Surfaces
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.physics.laws import by_name
from walkers.postprocess.dump import FloatArray, local_frames
from walkers.postprocess.motion import Motion, read_motion
from walkers.runner.binary import SOURCES, find_engine
from walkers.runner.failures import EngineError
from walkers.templates.deck import Plan, Segment, compose
from walkers.templates.layout import WALL_BRIDGES
from walkers.templates.scene import Bead, loading_of

RADIUS, STILL = 3e-4, (0.0, 0.0, 0.0)
NO_BRIDGES = ("capillary", "lubrication")
DEPTH = hertz_overlap(4.0 / 3.0 * np.pi * RADIUS**3 * 4000.0 * 9.81, RADIUS, reduced_modulus(5e7, 0.3))
"""Overlap of a bead that lies on a floor."""


def matter(step: float = 1e-6, gravity: str = "0 m/s^2", tilt: str = "0 deg", **contact: float) -> Case:
    """Elastic beads without friction, but for some changes."""
    case = bench_case(environment={"gravity": gravity}, boundary={"tilt": tilt}, liquid={"law": "young-laplace"})
    case = case.put("contact.youngs_modulus", 5e7).put("contact.poissons_ratio", 0.3)
    for name, value in contact.items():
        case = case.put(f"contact.{name.replace('friction_bead', 'friction.bead')}", value)
    return case.put("run.time_step", step).put("run.steps_per_cycle", 0)


def one_bead(
    case: Case,
    place: Vector,
    velocity: Vector = STILL,
    spin: Vector = STILL,
    wall: Wall = BOTTOM,
    without: tuple[str, ...] = NO_BRIDGES,
) -> SecondEngine:
    """A bead at a wall."""
    return SecondEngine(case, np.array([RADIUS]), np.array([[*place, *velocity, *spin]]), walls=[wall], without=without)


def pile(count: int) -> dict[str, Any]:
    """The tables of the shipped pile, with fewer beads."""
    tables: dict[str, Any] = read_toml(shipped("case")["pile-ci"])
    tables["mixture"] |= {"count": count}
    return tables


@pytest.fixture(scope="module")
def fig1b(run_directory: Callable[..., Path]) -> Motion:
    """Fig. 1b for nine cycles, by LIGGGHTS."""
    return read_motion(run_directory(shortened(load_case("fig1b"), 9)))


def test_a_sliding_bead_rolls_at_five_sevenths() -> None:
    """Whatever the friction: 2/5 m R² of inertia, and friction at the rim until it rolls."""
    case = matter(gravity="9.81 m/s^2", friction_bead_wall=0.3, restitution=0.3)
    frame = one_bead(case, (0.0, 0.0, RADIUS - DEPTH), (0.02, 0.0, 0.0)).run(20_000, 20_000)[0, 0]
    assert frame[3] == pytest.approx(5.0 / 7.0 * 0.02, rel=2e-3)
    assert RADIUS * frame[7] == pytest.approx(frame[3], rel=2e-3)


def test_a_bead_rolls_to_rest_and_swings_in_a_cylinder() -> None:
    """Rolling friction slows at 5/7 μ_r g; beside the lowest line of a cylinder on its side ω² = 5/7 g/(C - R)."""
    case = matter(2e-6, "9.81 m/s^2", friction_bead_wall=0.9, restitution=0.3, rolling_friction=0.01)
    speed, slowing = 5e-3, 5.0 / 7.0 * 0.01 * 9.81
    rolling = one_bead(case, (0.0, 0.0, RADIUS - DEPTH), (speed, 0.0, 0.0), (0.0, speed / RADIUS, 0.0))
    expected = speed - slowing * 2e-3 * np.arange(1, 26)
    assert rolling.run(25_000, 1000)[:, 0, 3] == pytest.approx(expected, abs=2e-3 * speed)

    out, turn = 3e-3 - RADIUS + DEPTH, 0.05
    case = matter(1e-6, "9.81 m/s^2", "90 deg", friction_bead_wall=0.9, restitution=0.3)
    assert case.gravity_vector == pytest.approx((-9.81, 0.0, 0.0))
    place = (-out * float(np.cos(turn)), out * float(np.sin(turn)), 0.0)
    swings = one_bead(case, place, wall=Round(3e-3)).run(100_000, 500)[:, 0, 1]
    frequency = sqrt(5.0 / 7.0 * 9.81 / out) * (1.0 - turn**2 / 16.0)
    expected = out * np.sin(turn * np.cos(frequency * 5e-4 * np.arange(1, 201)))
    assert swings == pytest.approx(expected, abs=2e-3 * out * turn)


def test_bridges_are_the_law_between_its_knots() -> None:
    """Pull and resistances, at gaps that are none of the splines', to 1e-8."""
    case = matter()
    case = case.put("liquid.dynamic_viscosity", 0.01)
    bridges = one_bead(case, (0.0, 0.0, RADIUS), without=()).constants.bridges
    curve = by_name(case.liquid.law)(
        Surfaces.of(RADIUS, inf, case.liquid.of_bridges, case.contact.minimum_separation_ratio)
    )
    for gap in np.linspace(0.0, 0.999 * curve.rupture, 777):
        expected = curve.forces(np.array([gap])).columns()[0]
        assert kernels.bridge_forces(bridges, bridges.between[0, -1], gap) == pytest.approx(expected, rel=1e-8)


def test_a_bridge_forms_on_touch_and_breaks_at_rupture() -> None:
    """Between beads and at walls, whose numbers come after the beads'; what is apart at first has none."""
    start = np.zeros((2, 9))
    start[:, 2], start[1, 0], start[1, 3] = 1.0, 5e-4 - 1e-9, 0.5
    engine = SecondEngine(matter(), np.array([3e-4, 2e-4]), start, walls=[BOTTOM])
    assert engine.bridges() == [(0, 1)]
    engine.run(2000, 2000)
    assert engine.bridges() == []
    assert one_bead(matter(), (0.0, 0.0, RADIUS + 1e-6), without=()).bridges() == []
    assert one_bead(matter(), (0.0, 0.0, RADIUS - 1e-9), without=()).bridges() == [(0, 1)]


def test_the_forces_of_a_pair_conserve_momentum_and_angular_momentum() -> None:
    """With friction, rolling friction, and all resistances of a bridge."""
    engine = second_engine(full_case(), standing(SCENES["two beads separate"].beads))
    for _ in range(300):
        engine.run(1, 1)
        force, torque, places = engine.state.force, engine.state.torque, engine.state.position
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
        turn = np.cross(places, force).sum(axis=0) + torque.sum(axis=0)
        assert np.abs(turn).max() < 1e-10 * np.abs(force).max() * np.abs(places).max()


def test_fig1b_is_one_motion_in_both_engines(fig1b: Motion) -> None:
    """Velocity, rotation and sliding agree to 1e-6, and so do places: its contacts stay closed."""
    velocity, *_, together, farthest = lines = compare([fig1b])
    assert failures(lines) == []
    assert velocity.measured == pytest.approx(velocity.expected, rel=1e-6)
    assert together.measured == together.expected
    assert farthest.measured < 1e-2


@pytest.mark.parametrize("term", TERMS)
def test_without_a_term_it_disagrees(fig1b: Motion, term: str) -> None:
    """So that agreement says something of that term."""
    velocity, *_, together, _ = lines = compare([fig1b], [term])
    assert failures(lines) or together.measured < together.expected
    assert velocity.failed or term in ("damping", "gravity")  # which change it by 2 µm/s


@pytest.mark.parametrize("name", ["groove of 120°", "two tones", "fan of three", "fig4b"])
def test_other_kinds_of_cases_agree(name: str, tmp_path: Path) -> None:
    """A wall of two faces, two harmonics, four beads whose contacts open: in every line, and in every frame.

    To 0.1 nm without rolling friction, which amplifies rounding.
    """
    case = shortened(full_cases()[name], 3)
    lines = compare([run(case, tmp_path).motion])
    assert failures(lines) == []
    assert lines[-1].measured < 10.0
    free = case.put("contact.rolling_friction", 0.0)
    assert compare([run(free, tmp_path).motion])[-1].measured < 1e-4


def test_a_restart_keeps_what_is_between_beads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A settling pile follows LIGGGHTS through a restart; it would not if springs between beads were forgotten."""
    motion = run(shortened(Case.read(pile(24), name="pile"), 9), tmp_path).motion
    settling = replace(
        motion, **{name: getattr(motion, name)[:7] for name in ("time", "position", "velocity", "spin", "frames")}
    )
    assert settling.frames[6][0] != settling.frames[1][0]

    def apart() -> float:
        return float(np.abs(simulate(settling).position - settling.position).max())

    together, evaluate = apart(), SecondEngine.evaluate
    assert together < 1e-8

    def forget(engine: SecondEngine) -> None:
        engine.pairs.spring[engine.pairs.second < len(engine.radius)] = 0.0
        evaluate(engine)

    monkeypatch.setattr(SecondEngine, "evaluate", forget)
    assert apart() > 50.0 * together


def test_piles_agree_until_they_are_chaotic(in_folder: Path) -> None:
    (in_folder / "pile.toml").write_text(to_toml(pile(16)))
    done = call("check", "pile.toml", "--cycles", "9", "--seeds", "2", "--json", check=True)
    measured = {line["what"]: line["measured"] for line in json.loads(done.stdout)["lines"]}
    seed = load_case("pile-ci").run.seed
    assert all(measured[f"start {seed + number}: cycles of the same motion"] >= 1.0 for number in range(2))
    assert [*measured][:3:2] == ["height of the beads", "touching pairs per bead"]


def test_command(in_folder: Path) -> None:
    """It runs what is missing, prints both engines and exits with 1 if they differ."""
    done = call("check", "fig1b", "--cycles", "6", check=True)
    assert "velocity" in done.stdout
    assert "FAIL" not in done.stdout
    differs = call("check", "fig1b", "--cycles", "6", "--without", "lubrication", "--json")
    assert differs.returncode == 1
    told = json.loads(differs.stdout)
    assert told["without"] == ["lubrication"]
    assert "velocity" in [line["what"] for line in told["lines"] if line["verdict"] == "FAIL"]


# --- walls of the contact model ---------------------------------------------------------------------------------------


GRAVITY = 9.81


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(find_engine(), tmp_path)


def _rows(bench: Bench, plan: Plan) -> tuple[FloatArray, FloatArray]:
    """Contacts of the last step, all columns, and the beads' places then."""
    plan = replace(plan, wall_bridge_columns=WALL_BRIDGES)
    series = bench.run(plan)
    *_, (_, rows) = local_frames(series.directory / "bridges.walls.txt", WALL_BRIDGES)
    return rows, series.frames[-1, :, :3]


def test_a_bead_at_rest_in_a_cylinder_presses_with_its_weight(bench: Bench) -> None:
    """The cylinder lies on its side: the overlap is Hertz's, the nearest point on the lowest line."""
    case = bench_case(
        liquid=DRY, contact={"restitution": 0.3}, environment={"gravity": f"{GRAVITY} m/s^2"},
        boundary={"tilt": "90 deg", "uphill": "90 deg"},
    )  # fmt: skip
    wall, weight = Round(3e-3), 4.0 / 3.0 * pi * RADIUS**3 * case.beads.density * GRAVITY
    overlap = hertz_overlap(weight, RADIUS, reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio))
    bead = Bead(0, (0.0, -(wall.radius - RADIUS + overlap), 5e-3), RADIUS)
    (row,), _ = _rows(bench, Plan(case, standing([bead], [FLOOR, wall]), **recording(20_000, 20_000)))
    told = dict(zip(WALL_BRIDGES, row.tolist(), strict=True))
    assert told["overlap"] == pytest.approx(overlap, rel=1e-4)
    assert (told["fx"], told["fy"], told["fz"]) == pytest.approx((0.0, weight, 0.0), rel=1e-4, abs=1e-6 * weight)
    assert (told["x"], told["y"], told["z"]) == pytest.approx((0.0, -wall.radius, 5e-3), abs=1e-12)
    assert (told["wall"], told["id"]) == (1, 1)


def test_walls_are_as_far_as_the_boundary_says(bench: Bench) -> None:
    """Planes in any direction and a cylinder: overlaps and nearest points are those of `walkers.inputs.boundary`."""
    walls: list[Wall] = [Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning"), Round(2.5e-3)]
    turn, out = 2.0, 2.5e-3 - RADIUS + 1e-6
    beads = [over(walls[0], -1e-6, RADIUS), Bead(0, (out * cos(turn), out * sin(turn), 4e-3), RADIUS)]  # type: ignore[arg-type]
    rows, places = _rows(bench, prescribed(bench_case(), standing(beads, walls), 3))
    assert rows[:, WALL_BRIDGES.index("wall")].tolist() == [0, 1]
    for wall, row, place in zip(walls, rows, places, strict=True):
        distance, normal = float(wall.distances(place)), wall.normals(place)
        np.testing.assert_allclose(row[:3], place - distance * normal, atol=1e-12)
        np.testing.assert_allclose(row[3:6], place, atol=1e-12)
        assert row[-1] == pytest.approx(RADIUS - distance, abs=1e-13)


def test_a_wall_that_moves_meets_beads_that_do_not(bench: Bench) -> None:
    """A quarter of a cycle, 1 mm up, beads have rested: neighbours are not listed anew, and must be there at first."""
    up = {"axis": "z", "frame": "lab", "peak_acceleration": f"{1e-3 * (2.0 * pi * 80.0) ** 2!r} m/s^2"}
    case = bench_case(liquid=DRY, drive=up, run={"time_step": "2 us", "samples_per_cycle": 4})
    beads = [over(FLOOR, 1e-3 - 1e-6, RADIUS), over(FLOOR, 1e-3 + 1e-6, RADIUS, x=1e-3)]
    (row,), _ = _rows(bench, prescribed(case, standing(beads), case.run.steps_per_cycle // 4))
    told = dict(zip(WALL_BRIDGES, row.tolist(), strict=True))
    assert (told["id"], told["overlap"]) == pytest.approx((1, 1e-6), rel=1e-5)


def test_loads_of_a_bead_are_those_of_a_command(bench: Bench) -> None:
    """Gravity and drive of another case, bead by bead, give the same bytes as in a deck of that case."""
    one, other = (
        bench_case(drive={"peak_acceleration": f"{2 * n} g", "axis": [1, 0, 1]}, environment={"gravity": f"{n} m/s^2"})
        for n in (2, 3)
    )
    beads = [over(FLOOR, 1e-3, RADIUS), over(FLOOR, 1e-3, RADIUS, x=4.0 * RADIUS)]
    scene = standing([beads[0], replace(beads[1], loading=1)])
    shared = bench.run(prescribed(one, replace(scene, loadings=(loading_of(one), loading_of(other))), 50))
    alone = [bench.run(prescribed(case, standing(beads), 50)) for case in (one, other)]
    assert (shared.directory / "loads.txt").read_text("utf-8").split()[0] == "2"
    for bead, deck in enumerate(alone):
        assert shared.forces[:, bead].tobytes() == deck.forces[:, bead].tobytes()
    assert np.all(np.abs(alone[0].forces[1:, 0] - alone[1].forces[1:, 0])[:, [0, 2]] > 0.0)


REFUSED_WALLS = {
    "plane 0 0 0 0 0 1": "expected a type",
    "type 3 plane 0 0 0 0 0 1": "expected a type",
    "type 2": "expected a plane or a cylinder",
    "type 2 plane 0 0 0 0 0 0": "a normal of no length",
    "type 2 cylinder 0 0 -1": "a radius that is not above 0",
    "type 2 cylinder 0 0": "ends early",
    "type 2 plane 0 0 0 0 0 1 gravity 0 0": "ends early",
    "type 2 wobble": "unknown keyword wobble",
    "type 2 plane 0 0 0 0 0 1 frame moon": "expected lab or walls, not moon",
    "type 2 plane 0 0 0 0 0 1 frame walls loads missing.txt": "missing.txt has no loads",
    "type 2 plane 0 0 0 0 0 1 frame walls loads bridges.txt": "bridges.txt has no loads",
    "type 2 plane 0 0 0 0 0 1 loads bridges.txt": "expected frame walls",
    "type 2 plane 0 0 0 0 0 1 frame lab loads bridges.txt": "expected frame walls",
}


@pytest.mark.parametrize("command", REFUSED_WALLS)
def test_commands_that_are_refused(bench: Bench, command: str) -> None:
    deck = compose(prescribed(bench_case(), standing([over(FLOOR, 0.0, RADIUS)]), 3))
    lines = deck.text.replace("&\n", " ").splitlines()
    changed = [f"fix walls all wall/bridge {command}" if "wall/bridge" in line else line for line in lines]
    with pytest.raises(EngineError, match=REFUSED_WALLS[command]):
        bench.run(replace(deck, text="\n".join([*changed, ""])))


def test_a_dry_contact_with_a_wall_begins_without_friction(bench: Bench) -> None:
    """Sheared, lifted and put down again, where films are empty: the spring of the first contact has ended."""
    case = bench_case(liquid={"law": "willett"}, contact={"friction": {"bead_bead": 0.3, "bead_wall": 0.3}})
    case = case.put("liquid.conserved", True)
    deck = compose(prescribed(case, standing([over(FLOOR, -1e-6, RADIUS, spin=STILL)]), 60))
    empty = deck.text.replace("scalar yes yes no 1.0", "scalar yes yes no 0.0")
    assert empty != deck.text
    before, _, after = empty.partition("\nrun ")
    ways = ("1e-2 0 0", "0 0 2.0", "0 0 -2.0")  # m/s, each for 20 steps
    runs = [f"fix way all move linear {way} units box\nrun 20\nunfix way" for way in ways]
    text = "\n".join([before, *runs, after.partition("\n")[2]])
    series = bench.run(replace(deck, text=text))
    (shear, *_), height = series.forces[20, 0], series.frames[:, 0, 2]
    assert shear < -1e-6
    assert height[40] - RADIUS > 3e-5
    assert height[60] == pytest.approx(height[0], rel=1e-12)
    assert series.forces[60, 0, 2] > 1e-6
    assert np.abs(series.forces[41:, 0, :2]).max() < 1e-9 * abs(shear)


FORCES = {8: "bc6f476ac81dec9a"}


def test_a_change_of_the_contact_model_asks_for_another_version_of_its_forces() -> None:
    """Runs and audits are named by ``FORCES_VERSION`` of ``bridge.cpp``; comments and blanks do not count.

    If this fails: raise it, unless dumps of piles are the same bytes, and write it and the digest down.
    """
    texts = [(SOURCES / name).read_text("utf-8") for name in ("bridge.cpp", "table.h")]
    (version,) = re.findall(r"(?m)^// FORCES_VERSION (\d+)$", texts[0])
    code = [re.sub(r"\s+", "", re.sub(r"(?s)/\*.*?\*/|//[^\n]*", "", text)) for text in texts]
    assert {int(version): sha256("".join(code).encode()).hexdigest()[:16]} == FORCES


def test_a_restart_with_other_walls_is_refused(bench: Bench) -> None:
    case, beads = bench_case(), [over(FLOOR, -1e-6, RADIUS)]
    first = prescribed(case, standing(beads), 10, restart_to="half.restart")
    carry = bench.run(first).directory / "half.restart"
    scene = standing(beads, [FLOOR, Round(2.5e-3)])
    second = replace(first, segment=Segment(10, 20, 0), restart_to=None, restart_from="half.restart")
    with pytest.raises(EngineError, match="another number of walls"):
        bench.run(replace(second, scene=scene), carry)


@pytest.mark.parametrize("ranks", [1, 2])
def test_liquid_is_conserved(bench: Bench, ranks: int) -> None:
    """In films that are nearly empty and fuller than full; the second engine has its own rule of bridges."""
    *judged, least, most = liquid_lines(bench, ranks)
    assert [line.verdict for line in judged] == [Verdict.PASS, Verdict.PASS]
    assert least.measured < 0.5
    assert most.measured > 1.0


def test_a_pile_that_shares_its_liquid_moves_alike(tmp_path: Path) -> None:
    """Forces of bridges differ by the coarser tables of the engine."""
    tables = pile(16)
    tables["liquid"] |= {"conserved": True, "law": "willett"}
    lines = crosscheck(shortened(Case.read(tables, name="pile"), 9), tmp_path)
    assert failures(lines) == []
    assert lines[-2].measured >= 1.0
