"""The second engine and the audit: against closed forms and LIGGGHTS, and what they can tell."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import sha256
from math import cos, inf, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import PROGRAM, SHORT, call, document, make_case, to_toml
from walkers import Run, run
from walkers.arrays import FloatArray, Vector
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import BOTTOM, Flat, Round, Wall
from walkers.inputs.toml import read_toml
from walkers.physics.bridge import Surfaces
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.postprocess.measure.dump import local_frames
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.runner import audit, model_sources
from walkers.runner.audit import read_audit, write_audit
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import model_sha256, plugin_of
from walkers.runner.failures import AuditFailed, EngineError, UnauditedEngineWarning
from walkers.runner.manifest import read_manifest
from walkers.runner.model_sources import SOURCES
from walkers.second_engine import kernels
from walkers.second_engine.audit import CHECKS, record, run_audit
from walkers.second_engine.crosscheck import compare_motions, example_cases, simulate, with_cycles
from walkers.second_engine.engine import TERMS, SecondEngine
from walkers.second_engine.lines import Line, Verdict, failures, lines_text
from walkers.second_engine.scenes import (
    AT_REST,
    DRY,
    OVERLAP,
    Bench,
    SceneOutput,
    bead_at_plane,
    bench_case,
    full_case,
    liquid_lines,
    pair,
    prescribed,
    scene_of,
    second_engine,
)
from walkers.templates.deck import Plan, compose
from walkers.templates.layout import WALL_BRIDGES
from walkers.templates.placement import Bead

RADIUS = 3e-4
"""Radius of the beads, m."""
DENSITY = 4000.0
"""Of the beads, kg/m³."""
GRAVITY = 9.81
"""m/s²."""
YOUNGS_MODULUS = 5e7
"""Of the beads, Pa."""
POISSONS_RATIO = 0.3


def depth_of_a_bead_at_rest() -> float:
    """Overlap of a bead that lies on a floor, m."""
    weight = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY * GRAVITY
    return hertz_overlap(weight, RADIUS, reduced_modulus(YOUNGS_MODULUS, POISSONS_RATIO))


# --- the second engine alone ------------------------------------------------------------------

ROLLING = {
    "liquid.law": "willett",
    "environment.gravity": f"{GRAVITY} m/s^2",
    "contact.restitution": 0.3,
    "contact.friction.bead_wall": 0.9,
    "run.time_step": "1 us",
}
"""Changes of a case without friction."""


def bead_without_bridges(
    case: Case,
    place: Vector,
    velocity: Vector = AT_REST,
    spin: Vector = AT_REST,
    wall: Wall = BOTTOM,
) -> SecondEngine:
    """The second engine with a bead at a wall."""
    case = case.with_value_at("contact.youngs_modulus", YOUNGS_MODULUS)
    case = case.with_value_at("contact.poissons_ratio", POISSONS_RATIO)
    start = np.array([[*place, *velocity, *spin]])
    return SecondEngine(
        case, np.array([RADIUS]), start, walls=[wall], without=("capillary", "lubrication")
    )


def test_rolling_friction_slows_a_bead_evenly() -> None:
    """A sphere that rolls loses 5/7 μ_r g: seen every 2 ms for 50 ms."""
    case = bench_case({**ROLLING, "contact.rolling_friction": 0.01})
    speed = 5e-3
    place = (0.0, 0.0, RADIUS - depth_of_a_bead_at_rest())
    bead = bead_without_bridges(case, place, (speed, 0.0, 0.0), (0.0, speed / RADIUS, 0.0))
    speeds = bead.run(50_000, 2000)[:, 0, 3]
    times = 2e-3 * np.arange(1, 26)
    expected = speed - 5.0 / 7.0 * 0.01 * GRAVITY * times
    assert speeds == pytest.approx(expected, abs=2e-3 * speed)


def test_a_bead_swings_in_a_cylinder_on_its_side() -> None:
    """Beside the lowest line of a cylinder of radius C, ω² = 5/7 g/(C - R).

    A pendulum of amplitude φ is slower by φ²/16. It is seen every 0.5 ms for 100 ms.
    """
    case = bench_case({**ROLLING, "boundary.tilt": "90 deg"})
    assert case.gravity_vector == pytest.approx((-GRAVITY, 0.0, 0.0))
    amplitude = 0.05
    distance = 3e-3 - RADIUS + depth_of_a_bead_at_rest()
    place = (-distance * cos(amplitude), distance * sin(amplitude), 0.0)
    bead = bead_without_bridges(case, place, wall=Round(3e-3))
    swings = bead.run(100_000, 500)[:, 0, 1]
    frequency = sqrt(5.0 / 7.0 * GRAVITY / distance) * (1.0 - amplitude**2 / 16.0)
    times = 5e-4 * np.arange(1, 201)
    expected = distance * np.sin(amplitude * np.cos(frequency * times))
    assert swings == pytest.approx(expected, abs=2e-3 * distance * amplitude)


def test_bridges_are_the_law_between_its_knots() -> None:
    """Pull and resistances, at gaps that are none of the knots of the splines, to 1e-8."""
    case = full_case({})
    bridges = second_engine(case, scene_of([bead_at_plane(BOTTOM, 0.0, RADIUS)])).constants.bridges
    surfaces = Surfaces.between(RADIUS, inf, case.liquid.of_bridges, case.contact.roughness)
    curve = by_name(case.liquid.law)(surfaces)
    of_bead_and_wall = bridges.first_bridge[0, -1]
    for gap in np.linspace(0.0, 0.999 * curve.rupture, 777):
        expected = curve.forces(np.array([gap])).columns()[0]
        forces = kernels.bridge_forces(bridges, of_bead_and_wall, gap)
        assert forces == pytest.approx(expected, rel=1e-8)


@pytest.fixture(scope="module")
def forces_of_a_pair() -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Forces, torques and places of two beads in 300 steps.

    They have friction, rolling friction, and all resistances of a bridge.
    """
    engine = second_engine(full_case({}), scene_of(pair(-OVERLAP, 0.043, (0.02, -0.011, 0.005))))
    steps = []
    for _ in range(300):
        engine.run(1, 1)
        state = engine.state
        steps.append((state.force.copy(), state.torque.copy(), state.position.copy()))
    return steps


def test_the_forces_of_a_pair_conserve_momentum(
    forces_of_a_pair: list[tuple[FloatArray, FloatArray, FloatArray]],
) -> None:
    for force, _, _ in forces_of_a_pair:
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()


def test_the_forces_of_a_pair_conserve_angular_momentum(
    forces_of_a_pair: list[tuple[FloatArray, FloatArray, FloatArray]],
) -> None:
    for force, torque, places in forces_of_a_pair:
        sum_of_torques = np.cross(places, force).sum(axis=0) + torque.sum(axis=0)
        largest = np.abs(force).max() * np.abs(places).max()
        assert np.abs(sum_of_torques).max() < 1e-10 * largest


# --- runs in both engines ---------------------------------------------------------------------


@dataclass(frozen=True)
class Comparison:
    """The lines of `compare_motions` for one run."""

    lines: list[Line]

    @property
    def velocity(self) -> Line:
        return self.lines[0]

    @property
    def same_motion(self) -> Line:
        """Cycles through which the motions are the same, of how many."""
        return self.lines[-2]

    @property
    def farthest(self) -> float:
        """The largest distance between the places of a bead in both engines, µm."""
        return self.lines[-1].measured


def compared(motion: Motion, *without: str) -> Comparison:
    """Compare a motion by LIGGGHTS with that of the second engine, which leaves out some terms."""
    return Comparison(compare_motions([motion], without))


@pytest.fixture(scope="module")
def fig1b(run_directory: Callable[..., Path]) -> Motion:
    """Two walkers of Fig. 1b for nine cycles, by LIGGGHTS."""
    return read_motion(run_directory(with_cycles(load_case("fig1b", {"dimers.replicates": 2}), 9)))


def test_fig1b_is_one_motion_in_both_engines(fig1b: Motion) -> None:
    """Velocity, rotation and sliding agree to 1e-6, and so do places: its contacts stay closed."""
    comparison = compared(fig1b)
    assert failures(comparison.lines) == []
    velocity = comparison.velocity
    assert velocity.measured == pytest.approx(velocity.expected, rel=1e-6)
    same_motion = comparison.same_motion
    assert same_motion.measured == same_motion.expected
    assert comparison.farthest < 1e-2


@pytest.mark.parametrize("term", TERMS)
def test_without_a_term_it_disagrees(fig1b: Motion, term: str) -> None:
    """So that agreement says something of that term."""
    comparison = compared(fig1b, term)
    same_motion = comparison.same_motion
    assert failures(comparison.lines) or same_motion.measured < same_motion.expected
    # These two change the velocity by 2 µm/s alone, which passes.
    assert comparison.velocity.failed or term in ("damping", "gravity")


EXAMPLES = ["groove of 120°", "two tones", "fan of three", "fig4b"]
"""A wall of two faces, two harmonics, four beads, and beads whose contacts open."""


@pytest.mark.parametrize("name", EXAMPLES)
def test_other_kinds_of_cases_agree(name: str, tmp_path: Path) -> None:
    """In every line, and in places to 10 µm."""
    case = with_cycles(example_cases()[name], 3)
    comparison = compared(run(case, tmp_path).motion)
    assert failures(comparison.lines) == []
    assert comparison.farthest < 10.0


@pytest.mark.parametrize("name", EXAMPLES)
def test_other_kinds_of_cases_agree_in_every_frame(name: str, tmp_path: Path) -> None:
    """In places to 0.1 nm, without rolling friction, which amplifies rounding."""
    case = with_cycles(example_cases()[name], 3).with_value_at("contact.rolling_friction", 0.0)
    assert compared(run(case, tmp_path).motion).farthest < 1e-4


@pytest.fixture(scope="module")
def small_pile() -> dict[str, Any]:
    """The tables of the shipped pile, with fewer beads."""
    tables: dict[str, Any] = read_toml(shipped("case")["pile-ci"])
    tables["mixture"] |= {"count": 12}
    tables["run"] |= {"longest_settling": "0.02 s", "frames_per_second": 170, "time_step": "3 us"}
    return tables


@dataclass(frozen=True)
class CheckedPile:
    """A pile that ``walkers check`` has run from two starts, and what it says."""

    lines: list[dict[str, Any]]
    first_run: Run
    motion: Motion
    """Of the first run, without the last frame."""
    simulated: Motion
    """The same by the second engine."""


@pytest.fixture(scope="module")
def checked_pile(
    small_pile: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> CheckedPile:
    """Its beads are shaken when they have fallen upon each other."""
    folder = tmp_path_factory.mktemp("pile")
    (folder / "pile.toml").write_text(to_toml(small_pile))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("walkers.templates.deck.SETTLING_SECONDS", 0.02)
        command = ("check", "pile.toml", "--cycles", "3", "--seeds", "2", "--json")
        done = call(*command, check=True, folder=folder)
        first_run = run(with_cycles(build_case(small_pile, name="pile"), 3), folder / "runs")
        motion = first_run.motion
        motion = replace(
            motion,
            time=motion.time[:-1],
            position=motion.position[:-1],
            velocity=motion.velocity[:-1],
            spin=motion.spin[:-1],
            frames=motion.frames[:-1],
        )
        return CheckedPile(json.loads(done.stdout)["lines"], first_run, motion, simulate(motion))


def test_the_check_of_a_pile_compares_heights_and_contacts(checked_pile: CheckedPile) -> None:
    quantities = [line["quantity"] for line in checked_pile.lines]
    assert quantities[0] == "height of the beads"
    assert quantities[2] == "touching pairs per bead"


@pytest.mark.parametrize("number", [0, 1])
def test_piles_agree_until_they_are_chaotic(checked_pile: CheckedPile, number: int) -> None:
    """For a cycle or more from each of two starts, whose seeds follow each other."""
    measured = {line["quantity"]: line["measured"] for line in checked_pile.lines}
    seed = load_case("pile-ci").run.seed + number
    assert measured[f"start {seed}: cycles of the same motion"] >= 1.0


def test_piles_agree_through_a_restart(checked_pile: CheckedPile) -> None:
    """While they settle and after, up to the last frame but one: to 10 nm in three segments."""
    assert checked_pile.first_run.cached  # it is one of those that were compared
    segments = {segment for segment, _ in checked_pile.motion.frames}
    assert len(segments) == 3
    difference = checked_pile.simulated.position - checked_pile.motion.position
    assert float(np.abs(difference).max()) < 1e-8


CHECK_FIG1B = ("check", "fig1b", "--set", "dimers.replicates=2", "--cycles", "6")


def test_command_that_checks_a_case_runs_it_and_prints_that_the_engines_agree(
    in_folder: Path,
) -> None:
    done = call(*CHECK_FIG1B, check=True)
    assert "velocity" in done.stdout
    assert "FAIL" not in done.stdout


def test_command_that_checks_a_case_exits_with_1_if_the_engines_differ(in_folder: Path) -> None:
    done = call(*CHECK_FIG1B, "--without", "lubrication", "--json")
    assert done.returncode == 1
    contents = json.loads(done.stdout)
    assert contents["without"] == ["lubrication"]
    failed = [line["quantity"] for line in contents["lines"] if line["verdict"] == "FAIL"]
    assert "velocity" in failed


# --- walls of the contact model ---------------------------------------------------------------


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """Runs decks with the installed engine."""
    return Bench(find_engine(), tmp_path)


def wall_contacts(output: SceneOutput) -> FloatArray:
    """Contacts with walls in the last step, a row each, of the columns `WALL_BRIDGES`."""
    *_, (_, rows) = local_frames(output.directory / "bridges.walls.txt", WALL_BRIDGES)
    return rows


def run_with_wall_contacts(bench: Bench, plan: Plan) -> SceneOutput:
    """Run a deck that dumps all columns of contacts with walls."""
    return bench.run(replace(plan, wall_bridge_columns=WALL_BRIDGES))


def test_walls_are_as_far_as_the_boundary_says(bench: Bench) -> None:
    """A plane in any direction and a cylinder: overlaps and nearest points are those of the case.

    Beads overlap with them by 1 µm.
    """
    leaning = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning")
    hollow = Round(2.5e-3)
    distance_from_axis = 2.5e-3 - RADIUS + 1e-6
    place_in_cylinder = (distance_from_axis * cos(2.0), distance_from_axis * sin(2.0), 4e-3)
    beads = [bead_at_plane(leaning, -1e-6, RADIUS), Bead(0, place_in_cylinder, RADIUS)]
    plan = prescribed(bench_case({}), scene_of(beads, [leaning, hollow]), 3)
    output = run_with_wall_contacts(bench, plan)
    rows = wall_contacts(output)
    assert rows[:, WALL_BRIDGES.index("wall")].tolist() == [0, 1]
    for wall, row, place in zip((leaning, hollow), rows, output.frames[-1, :, :3], strict=True):
        distance = float(wall.distances(place))
        nearest_point = place - distance * wall.normals(place)
        np.testing.assert_allclose(row[:3], nearest_point, atol=1e-12)
        np.testing.assert_allclose(row[3:6], place, atol=1e-12)
        assert row[-1] == pytest.approx(RADIUS - distance, abs=1e-13)


def test_on_the_axis_of_a_cylinder_no_direction_is_toward_it() -> None:
    with np.errstate(all="raise"):
        normal = Round(2.5e-3).normals(np.zeros(3))
    assert not normal.any()


def test_a_wall_that_moves_meets_beads_that_do_not(bench: Bench) -> None:
    """In a quarter of a cycle it rises by 1 mm, into the first of two beads alone, by 1 µm.

    Beads at rest do not let neighbours be listed anew: those must be listed at first.
    """
    peak_acceleration = 1e-3 * (2.0 * pi * 80.0) ** 2
    case = bench_case(
        {
            **DRY,
            "drive.axis": "z",
            "drive.frame": "lab",
            "drive.peak_acceleration": f"{peak_acceleration!r} m/s^2",
            "run.time_step": "2 us",
            "run.samples_per_cycle": 4,
        }
    )
    beads = [
        bead_at_plane(BOTTOM, 1e-3 - 1e-6, RADIUS),
        bead_at_plane(BOTTOM, 1e-3 + 1e-6, RADIUS, x=1e-3),
    ]
    plan = prescribed(case, scene_of(beads), case.run.steps_per_cycle // 4)
    (row,) = wall_contacts(run_with_wall_contacts(bench, plan))
    assert row[WALL_BRIDGES.index("id")] == 1
    assert row[WALL_BRIDGES.index("overlap")] == pytest.approx(1e-6, rel=1e-5)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("type 3 plane 0 0 0 0 0 1", "expected a type"),
        ("type 2", "expected a plane, a cylinder or facets"),
        ("type 2 plane 0 0 0 0 0 0", "a normal of no length"),
        ("type 2 cylinder 0 0 -1", "a radius that is not above 0"),
        ("type 2 cylinder 0 0", "ends early"),
        ("type 2 wobble", "unknown keyword wobble"),
        (
            "type 2 plane 0 0 0 0 0 1 frame walls loads bridges.txt",
            "bridges.txt has no loads",
        ),
        ("type 2 plane 0 0 0 0 0 1 loads bridges.txt", "expected frame walls"),
    ],
)
def test_commands_that_are_refused(bench: Bench, command: str, message: str) -> None:
    deck = compose(prescribed(bench_case({}), scene_of([bead_at_plane(BOTTOM, 0.0, RADIUS)]), 3))
    lines = []
    for line in deck.text.replace("&\n", " ").splitlines():
        if "wall/bridge" in line:
            lines.append(f"fix walls all wall/bridge {command}\n")
        else:
            lines.append(f"{line}\n")
    with pytest.raises(EngineError, match=message):
        bench.run(replace(deck, text="".join(lines)))


def test_a_dry_contact_with_a_wall_begins_without_friction(bench: Bench) -> None:
    """Sheared, lifted and put down again, where films are empty: the first spring has ended."""
    case = bench_case({"liquid.law": "willett", "contact.friction.bead_wall": 0.3})
    case = case.with_value_at("liquid.conserved", True)
    bead = bead_at_plane(BOTTOM, -1e-6, RADIUS, spin=AT_REST)
    deck = compose(prescribed(case, scene_of([bead]), 60))
    with_empty_films = deck.text.replace("scalar yes yes no 1.0", "scalar yes yes no 0.0")
    before, _, after = with_empty_films.partition("\nrun ")
    after = after.partition("\n")[2]
    commands = [before]
    for velocity in ("1e-2 0 0", "0 0 2.0", "0 0 -2.0"):  # m/s: sheared, lifted, put down
        commands.append(f"fix way all move linear {velocity} units box\nrun 20\nunfix way")
    output = bench.run(replace(deck, text="\n".join([*commands, after])))

    height = output.frames[:, 0, 2]
    assert height[40] - RADIUS > 3e-5
    assert height[60] == pytest.approx(height[0], rel=1e-12)
    shear = output.forces[20, 0, 0]
    assert shear < -1e-6
    assert np.abs(output.forces[41:, 0, :2]).max() < 1e-9 * abs(shear)


FORCES = {8: "fbac36197c2faf45"}
"""Digest of the code of the contact model, for the version of its forces."""


def code_of(source: Path) -> str:
    """A file of C++ without comments, blanks and line ends."""
    without_comments = re.sub(r"(?s)/\*.*?\*/|//[^\n]*", "", source.read_text("utf-8"))
    return re.sub(r"\s+", "", without_comments)


def test_a_change_of_the_contact_model_asks_for_another_version_of_its_forces() -> None:
    """Runs and audits are named by ``FORCES_VERSION`` of ``bridge.cpp``.

    If this fails: raise it, unless dumps of piles are the same bytes, and write it and the digest
    down in `FORCES`.
    """
    model = SOURCES / "bridge.cpp"
    (version,) = re.findall(r"(?m)^// FORCES_VERSION (\d+)$", model.read_text("utf-8"))
    code = "".join(map(code_of, [model, *sorted(SOURCES.glob("*.h"))]))
    assert {int(version): sha256(code.encode()).hexdigest()[:16]} == FORCES


def test_liquid_is_conserved_by_two_ranks(bench: Bench) -> None:
    """In films that are nearly empty and fuller than full; the audit looks at one process."""
    *judged, emptiest, fullest = liquid_lines(bench, 2)
    assert [line.verdict for line in judged] == [Verdict.PASS, Verdict.PASS]
    assert emptiest.measured < 0.5
    assert fullest.measured > 1.0


# --- the audit --------------------------------------------------------------------------------

LINES_OF_CHECKS = {
    "scenes": 30,
    "restart": 4,
    "ranks": 2,
    "stock": 1,
    "liquid": 4,
    "company": 2,
}
"""Least number of lines of each check of the audit."""


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, in whose ``cache`` a user has only the contact model, compiled already."""
    model = plugin_of(find_engine())
    cache = tmp_path / "cache" / "granular-walkers"
    cache.mkdir(parents=True)
    for file in (model, model.with_suffix(".json")):
        shutil.copy(file, cache)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def audit_of(finished: Run) -> Any:
    """What the manifest of a run says of its engine's audit."""
    return read_manifest(finished.directory)["engine"]["audit"]


def write_outcome(contact_model: str, failed: list[str]) -> None:
    """Write the outcome of an audit of the installed engine with a contact model (SHA-256)."""
    outcome = {
        "contact_model": contact_model,
        "passed": not failed,
        "lines": 80,
        "failures": failed,
        "date": "2026-01-01T00:00:00Z",
    }
    write_audit(find_engine().sha256, outcome)


def record_audit_that_fails() -> None:
    """Record an audit of the installed engine in which one of three lines fails."""
    passed = Line("right", 1.0, 1.0, 0.1)
    failed = Line("Hertz force", 1.0, 2.0, 0.1)
    record([passed, failed, passed], find_engine(), "3.8.0")


def test_each_check_of_the_audit_is_tested() -> None:
    assert [*LINES_OF_CHECKS] == [*CHECKS]


@pytest.mark.parametrize("check", LINES_OF_CHECKS)
def test_the_installed_engine_passes(check: str) -> None:
    lines, version = run_audit([check])
    assert [line.quantity for line in failures(lines)] == []
    assert {line.check for line in lines} == {check}
    assert len(lines) >= LINES_OF_CHECKS[check]
    assert version == "LIGGGHTS-PUBLIC 3.8.0"


def test_an_audit_prints_the_lines_of_all_checks() -> None:
    lines = [
        Line("Hertz force", 1.0, 1.0, 0.1, check="stock"),
        Line("volume", 1.0, 1.0, 0.1, check="liquid"),
    ]
    text = lines_text(lines)
    assert "Hertz force" in text
    assert "volume" in text


@pytest.mark.slow
def test_a_machine_without_wide_instructions_gives_the_same_bytes(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contact model is compiled for machines with and without AVX, and chooses when loaded."""
    case = load_case("cluster", {"run.cycles": 8})
    wide = run(case, own_cache / "wide").motion
    sources = shutil.copytree(SOURCES, own_cache / "engine")
    clones = ', target_clones("avx512f", "avx2", "default")'
    text = (SOURCES / "forces.h").read_text()
    assert text.count(clones) == 1
    (sources / "forces.h").write_text(text.replace(clones, ""))
    monkeypatch.setattr(model_sources, "SOURCES", sources)
    narrow = run(case, own_cache / "narrow").motion
    np.testing.assert_array_equal(narrow.position, wide.position)
    np.testing.assert_array_equal(narrow.velocity, wide.velocity)
    np.testing.assert_array_equal(narrow.spin, wide.spin)


@pytest.fixture
def broken_engine(front: Callable[[str], str]) -> str:
    """An engine that prints its version and fails in whatever else it is asked for."""
    return front(
        'echo "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)"\necho ERROR: out of order\nexit 1'
    )


def test_an_engine_that_fails_in_a_check_gives_a_line_of_its_own(
    own_cache: Path, broken_engine: str
) -> None:
    """What a machine cannot run is not recorded as the fault of the binary."""
    engine = find_engine(broken_engine)
    (failed,), version = run_audit(["stock"], engine=engine)
    assert "out of order" in failed.quantity
    assert failed.verdict is Verdict.ERROR
    record([failed], engine, version)
    assert read_audit(engine.sha256, None) is None


def test_an_engine_that_fails_in_a_check_fails_the_check(
    own_cache: Path, broken_engine: str
) -> None:
    done = call("check", "engine", "--only", "stock", "--engine", broken_engine)
    assert done.returncode == 1
    assert "1 could not be measured" in done.stdout


def test_a_run_names_no_audit_if_there_was_none(own_cache: Path) -> None:
    assert audit_of(run(make_case(run=SHORT), own_cache / "runs")) is None


def test_a_run_names_no_audit_of_another_contact_model(own_cache: Path) -> None:
    write_outcome(contact_model="0" * 64, failed=[])
    assert audit_of(run(make_case(run=SHORT), own_cache / "runs")) is None


def test_a_part_of_the_audit_is_no_audit(own_cache: Path) -> None:
    done = call("check", "engine", "--only", "stock", "--json", check=True)
    assert {line["check"] for line in json.loads(done.stdout)["lines"]} == {"stock"}
    assert read_audit(find_engine().sha256, None) is None
    assert not list(own_cache.rglob("audits/*"))


def test_a_run_names_the_audit_of_its_engine_and_contact_model(own_cache: Path) -> None:
    record([Line("right", 1.0, 1.0, 0.1)], find_engine(), "3.8.0")
    audit_in_manifest = audit_of(run(make_case(run=SHORT), own_cache / "runs"))
    assert audit_in_manifest["passed"]
    assert audit_in_manifest["lines"] == 1
    assert audit_in_manifest["failures"] == []


@pytest.mark.parametrize("contents", ["", "{", "[]", '{"lines": 1}'])
def test_a_damaged_record_of_an_audit_is_none(own_cache: Path, contents: str) -> None:
    record([Line("right", 1.0, 1.0, 0.1)], find_engine(), "3.8.0")
    next(own_cache.rglob("audits/*.json")).write_text(contents)
    assert read_audit(find_engine().sha256, None) is None


def test_an_engine_without_an_audit_is_warned_of_once_in_a_process(own_cache: Path) -> None:
    audit._warn_unaudited.cache_clear()
    with pytest.warns(UnauditedEngineWarning, match="never audited .*: walkers check engine"):
        run(make_case(run=SHORT), own_cache / "runs")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UnauditedEngineWarning)
        run(make_case(run={**SHORT, "cycles": 5}), own_cache / "runs")
    assert not list(own_cache.rglob("audits/*"))


def test_the_program_warns_of_an_engine_without_an_audit_once(own_cache: Path) -> None:
    """Once on a machine: the second process warns no more."""
    (own_cache / "case.toml").write_text(to_toml(document(run=SHORT)))
    warnings_of_processes = []
    for folder in ("anew", "again"):
        command = [PROGRAM, "run", "case.toml", "--out", folder]
        done = subprocess.run(command, cwd=own_cache, capture_output=True, text=True, check=True)
        warning = "was never audited with its contact model: walkers check engine"
        warnings_of_processes.append(done.stderr.count(warning))
    assert warnings_of_processes == [1, 0]


def test_an_engine_whose_check_failed_is_refused(own_cache: Path) -> None:
    record_audit_that_fails()
    with pytest.raises(AuditFailed, match="Hertz force"):
        run(make_case(run=SHORT), own_cache / "runs")
    assert not (own_cache / "runs").exists()


def test_the_program_says_why_an_engine_is_refused_and_what_to_do(own_cache: Path) -> None:
    record_audit_that_fails()
    (own_cache / "case.toml").write_text(to_toml(document(run=SHORT)))
    done = call("run", "case.toml", folder=own_cache)
    assert done.returncode == 1
    (message,) = done.stderr.splitlines()
    assert "failed its audit in 1 line(s), first: Hertz force" in message
    assert f"walkers check engine --engine {find_engine().path}" in message
    assert "another binary by --engine (in Python engine=) or WALKERS_ENGINE" in message
    assert not (own_cache / "runs").exists()


def test_an_engine_whose_check_failed_is_refused_for_sweeps(own_cache: Path) -> None:
    record_audit_that_fails()
    (own_cache / "case.toml").write_text(to_toml(document(run=SHORT)))
    sweep = {"case": "case.toml", "axes": {"dimers.angle": ["0 deg", "10 deg"]}}
    (own_cache / "sweep.toml").write_text(to_toml(sweep))
    done = call("sweep", "sweep.toml", folder=own_cache)
    assert done.returncode == 1
    assert "first: Hertz force" in done.stderr
    assert not (own_cache / "runs").exists()


def test_another_build_of_the_contact_model_is_not_refused(own_cache: Path) -> None:
    """A failed audit is of a binary and a build, and so another build has an outcome of its own."""
    write_outcome(contact_model="0" * 64, failed=["Hertz force"])
    case = make_case(run=SHORT)
    assert audit_of(run(case, own_cache / "runs")) is None
    record([Line("right", 1.0, 1.0, 0.1)], find_engine(), "3.8.0")
    assert audit_of(run(case, own_cache / "audited"))["passed"]


def test_a_build_of_the_contact_model_is_refused_by_its_own_audit(own_cache: Path) -> None:
    write_outcome(contact_model=model_sha256(find_engine()), failed=["Hertz force"])
    with pytest.raises(AuditFailed, match="Hertz force"):
        run(make_case(run=SHORT), own_cache / "runs")
