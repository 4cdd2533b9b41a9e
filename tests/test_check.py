"""The second engine and the audit: against closed forms, against LIGGGHTS, and that they can tell a difference."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import warnings
from collections.abc import Callable
from dataclasses import replace
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
    DRY,
    OVERLAP,
    Bench,
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

RADIUS, STILL = 3e-4, (0.0, 0.0, 0.0)
NO_BRIDGES = ("capillary", "lubrication")
DEPTH = hertz_overlap(
    4.0 / 3.0 * np.pi * RADIUS**3 * 4000.0 * 9.81, RADIUS, reduced_modulus(5e7, 0.3)
)
"""Overlap of a bead that lies on a floor."""
ROLLING = {
    **{"liquid.law": "willett", "environment.gravity": "9.81 m/s^2", "contact.restitution": 0.3},
    **{"contact.friction.bead_wall": 0.9, "run.time_step": "1 us"},
}
"""Changes of a case without friction."""


def one_bead(
    case: Case, place: Vector, velocity: Vector = STILL, spin: Vector = STILL, wall: Wall = BOTTOM
) -> SecondEngine:
    """A bead without bridges at a wall."""
    case = case.with_value_at("contact.youngs_modulus", 5e7).with_value_at(
        "contact.poissons_ratio", 0.3
    )
    start = np.array([[*place, *velocity, *spin]])
    return SecondEngine(case, np.array([RADIUS]), start, walls=[wall], without=NO_BRIDGES)


@pytest.fixture
def pile(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The tables of the shipped pile, with fewer beads, which are shaken when they have fallen upon each other."""
    monkeypatch.setattr("walkers.templates.deck.SETTLING_SECONDS", 0.02)
    tables: dict[str, Any] = read_toml(shipped("case")["pile-ci"])
    tables["mixture"] |= {"count": 12}
    tables["run"] |= {"longest_settling": "0.02 s", "frames_per_second": 170, "time_step": "3 us"}
    return tables


@pytest.fixture(scope="module")
def fig1b(run_directory: Callable[..., Path]) -> Motion:
    """Two walkers of Fig. 1b for nine cycles, by LIGGGHTS."""
    return read_motion(run_directory(with_cycles(load_case("fig1b", {"dimers.replicates": 2}), 9)))


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(find_engine(), tmp_path)


# --- the second engine ------------------------------------------------------------------------------------------------


def test_a_bead_rolls_to_rest_and_swings_in_a_cylinder() -> None:
    """Rolling friction slows at 5/7 μ_r g; beside the lowest line of a cylinder on its side ω² = 5/7 g/(C - R)."""
    case = bench_case({**ROLLING, "contact.rolling_friction": 0.01})
    speed, slowing = 5e-3, 5.0 / 7.0 * 0.01 * 9.81
    rolling = one_bead(
        case, (0.0, 0.0, RADIUS - DEPTH), (speed, 0.0, 0.0), (0.0, speed / RADIUS, 0.0)
    )
    expected = speed - slowing * 2e-3 * np.arange(1, 26)
    assert rolling.run(50_000, 2000)[:, 0, 3] == pytest.approx(expected, abs=2e-3 * speed)

    out, turn = 3e-3 - RADIUS + DEPTH, 0.05
    case = bench_case({**ROLLING, "boundary.tilt": "90 deg"})
    assert case.gravity_vector == pytest.approx((-9.81, 0.0, 0.0))
    place = (-out * float(np.cos(turn)), out * float(np.sin(turn)), 0.0)
    swings = one_bead(case, place, wall=Round(3e-3)).run(100_000, 500)[:, 0, 1]
    frequency = sqrt(5.0 / 7.0 * 9.81 / out) * (1.0 - turn**2 / 16.0)
    expected = out * np.sin(turn * np.cos(frequency * 5e-4 * np.arange(1, 201)))
    assert swings == pytest.approx(expected, abs=2e-3 * out * turn)


def test_bridges_are_the_law_between_its_knots() -> None:
    """Pull and resistances, at gaps that are none of the splines', to 1e-8."""
    case = full_case({})
    bridges = second_engine(case, scene_of([bead_at_plane(BOTTOM, 0.0, RADIUS)])).constants.bridges
    surfaces = Surfaces.between(RADIUS, inf, case.liquid.of_bridges, case.contact.roughness)
    curve = by_name(case.liquid.law)(surfaces)
    for gap in np.linspace(0.0, 0.999 * curve.rupture, 777):
        expected = curve.forces(np.array([gap])).columns()[0]
        assert kernels.bridge_forces(bridges, bridges.first_bridge[0, -1], gap) == pytest.approx(
            expected, rel=1e-8
        )


def test_the_forces_of_a_pair_conserve_momentum_and_angular_momentum() -> None:
    """With friction, rolling friction, and all resistances of a bridge."""
    engine = second_engine(full_case({}), scene_of(pair(-OVERLAP, 0.043, (0.02, -0.011, 0.005))))
    for _ in range(300):
        engine.run(1, 1)
        force, torque, places = engine.state.force, engine.state.torque, engine.state.position
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
        turn = np.cross(places, force).sum(axis=0) + torque.sum(axis=0)
        assert np.abs(turn).max() < 1e-10 * np.abs(force).max() * np.abs(places).max()


def test_fig1b_is_one_motion_in_both_engines(fig1b: Motion) -> None:
    """Velocity, rotation and sliding agree to 1e-6, and so do places: its contacts stay closed."""
    velocity, *_, together, farthest = lines = compare_motions([fig1b])
    assert failures(lines) == []
    assert velocity.measured == pytest.approx(velocity.expected, rel=1e-6)
    assert together.measured == together.expected
    assert farthest.measured < 1e-2


@pytest.mark.parametrize("term", TERMS)
def test_without_a_term_it_disagrees(fig1b: Motion, term: str) -> None:
    """So that agreement says something of that term."""
    velocity, *_, together, _ = lines = compare_motions([fig1b], [term])
    assert failures(lines) or together.measured < together.expected
    assert velocity.failed or term in ("damping", "gravity")  # which change it by 2 µm/s


@pytest.mark.parametrize("name", ["groove of 120°", "two tones", "fan of three", "fig4b"])
def test_other_kinds_of_cases_agree(name: str, tmp_path: Path) -> None:
    """A wall of two faces, two harmonics, four beads whose contacts open: in every line, and in every frame.

    To 0.1 nm without rolling friction, which amplifies rounding.
    """
    case = with_cycles(example_cases()[name], 3)
    lines = compare_motions([run(case, tmp_path).motion])
    assert failures(lines) == []
    assert lines[-1].measured < 10.0
    free = case.with_value_at("contact.rolling_friction", 0.0)
    assert compare_motions([run(free, tmp_path).motion])[-1].measured < 1e-4


def test_piles_agree_until_they_are_chaotic_and_through_a_restart(
    pile: dict[str, Any], in_folder: Path
) -> None:
    """The first of the runs that are compared follows LIGGGHTS through its two restarts, while it settles and after."""
    (in_folder / "pile.toml").write_text(to_toml(pile))
    done = call("check", "pile.toml", "--cycles", "3", "--seeds", "2", "--json", check=True)
    measured = {line["quantity"]: line["measured"] for line in json.loads(done.stdout)["lines"]}
    seed = load_case("pile-ci").run.seed
    assert all(
        measured[f"start {seed + number}: cycles of the same motion"] >= 1.0 for number in range(2)
    )
    assert [*measured][:3:2] == ["height of the beads", "touching pairs per bead"]
    first = run(with_cycles(build_case(pile, name="pile"), 3), Path("runs"))
    parts = {
        name: getattr(first.motion, name)[:-1]
        for name in ("time", "position", "velocity", "spin", "frames")
    }
    shaken = replace(first.motion, **parts)
    assert first.cached
    assert len({segment for segment, _ in shaken.frames}) == 3
    assert float(np.abs(simulate(shaken).position - shaken.position).max()) < 1e-8


def test_command(in_folder: Path) -> None:
    """It runs what is missing, prints both engines and exits with 1 if they differ."""
    command = ("check", "fig1b", "--set", "dimers.replicates=2", "--cycles", "6")
    done = call(*command, check=True)
    assert "velocity" in done.stdout
    assert "FAIL" not in done.stdout
    differs = call(*command, "--without", "lubrication", "--json")
    assert differs.returncode == 1
    told = json.loads(differs.stdout)
    assert told["without"] == ["lubrication"]
    assert "velocity" in [line["quantity"] for line in told["lines"] if line["verdict"] == "FAIL"]


# --- walls of the contact model ---------------------------------------------------------------------------------------


def _rows(bench: Bench, plan: Plan) -> tuple[FloatArray, FloatArray]:
    """Contacts of the last step, all columns, and the beads' places then."""
    series = bench.run(replace(plan, wall_bridge_columns=WALL_BRIDGES))
    *_, (_, rows) = local_frames(series.directory / "bridges.walls.txt", WALL_BRIDGES)
    return rows, series.frames[-1, :, :3]


def test_walls_are_as_far_as_the_boundary_says(bench: Bench) -> None:
    """Planes in any direction and a cylinder: overlaps and nearest points are those of the case."""
    leaning, hollow = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning"), Round(2.5e-3)
    turn, out = 2.0, 2.5e-3 - RADIUS + 1e-6
    beads = [
        bead_at_plane(leaning, -1e-6, RADIUS),
        Bead(0, (out * cos(turn), out * sin(turn), 4e-3), RADIUS),
    ]
    rows, places = _rows(bench, prescribed(bench_case({}), scene_of(beads, [leaning, hollow]), 3))
    assert rows[:, WALL_BRIDGES.index("wall")].tolist() == [0, 1]
    for wall, row, place in zip((leaning, hollow), rows, places, strict=True):
        distance, normal = float(wall.distances(place)), wall.normals(place)
        np.testing.assert_allclose(row[:3], place - distance * normal, atol=1e-12)
        np.testing.assert_allclose(row[3:6], place, atol=1e-12)
        assert row[-1] == pytest.approx(RADIUS - distance, abs=1e-13)
    with np.errstate(all="raise"):  # on the axis no direction is toward it
        assert not hollow.normals(np.zeros(3)).any()


def test_a_wall_that_moves_meets_beads_that_do_not(bench: Bench) -> None:
    """A quarter of a cycle, 1 mm up, beads have rested: neighbours are not listed anew, and must be there at first."""
    up = {
        "drive.axis": "z",
        "drive.frame": "lab",
        "run.time_step": "2 us",
        "run.samples_per_cycle": 4,
    }
    peak = {"drive.peak_acceleration": f"{1e-3 * (2.0 * pi * 80.0) ** 2!r} m/s^2"}
    case = bench_case({**DRY, **up, **peak})
    beads = [
        bead_at_plane(BOTTOM, 1e-3 - 1e-6, RADIUS),
        bead_at_plane(BOTTOM, 1e-3 + 1e-6, RADIUS, x=1e-3),
    ]
    (row,), _ = _rows(bench, prescribed(case, scene_of(beads), case.run.steps_per_cycle // 4))
    told = dict(zip(WALL_BRIDGES, row.tolist(), strict=True))
    assert (told["id"], told["overlap"]) == pytest.approx((1, 1e-6), rel=1e-5)


REFUSED_WALLS = {
    "type 3 plane 0 0 0 0 0 1": "expected a type",
    "type 2": "expected a plane, a cylinder or facets",
    "type 2 plane 0 0 0 0 0 0": "a normal of no length",
    "type 2 cylinder 0 0 -1": "a radius that is not above 0",
    "type 2 cylinder 0 0": "ends early",
    "type 2 wobble": "unknown keyword wobble",
    "type 2 plane 0 0 0 0 0 1 frame walls loads bridges.txt": "bridges.txt has no loads",
    "type 2 plane 0 0 0 0 0 1 loads bridges.txt": "expected frame walls",
}


@pytest.mark.parametrize("command", REFUSED_WALLS)
def test_commands_that_are_refused(bench: Bench, command: str) -> None:
    deck = compose(prescribed(bench_case({}), scene_of([bead_at_plane(BOTTOM, 0.0, RADIUS)]), 3))
    lines = deck.text.replace("&\n", " ").splitlines()
    changed = [
        f"fix walls all wall/bridge {command}" if "wall/bridge" in line else line for line in lines
    ]
    with pytest.raises(EngineError, match=REFUSED_WALLS[command]):
        bench.run(replace(deck, text="\n".join([*changed, ""])))


def test_a_dry_contact_with_a_wall_begins_without_friction(bench: Bench) -> None:
    """Sheared, lifted and put down again, where films are empty: the spring of the first contact has ended."""
    case = bench_case({"liquid.law": "willett", "contact.friction.bead_wall": 0.3}).with_value_at(
        "liquid.conserved", True
    )
    deck = compose(
        prescribed(case, scene_of([bead_at_plane(BOTTOM, -1e-6, RADIUS, spin=STILL)]), 60)
    )
    empty = deck.text.replace("scalar yes yes no 1.0", "scalar yes yes no 0.0")
    before, _, after = empty.partition("\nrun ")
    ways = ("1e-2 0 0", "0 0 2.0", "0 0 -2.0")  # m/s, each for 20 steps
    runs = [f"fix way all move linear {way} units box\nrun 20\nunfix way" for way in ways]
    series = bench.run(replace(deck, text="\n".join([before, *runs, after.partition("\n")[2]])))
    (shear, *_), height = series.forces[20, 0], series.frames[:, 0, 2]
    assert shear < -1e-6
    assert height[40] - RADIUS > 3e-5
    assert height[60] == pytest.approx(height[0], rel=1e-12)
    assert np.abs(series.forces[41:, 0, :2]).max() < 1e-9 * abs(shear)


FORCES = {8: "5f5176340876043b"}


def test_a_change_of_the_contact_model_asks_for_another_version_of_its_forces() -> None:
    """Runs and audits are named by ``FORCES_VERSION`` of ``bridge.cpp``; comments and blanks do not count.

    If this fails: raise it, unless dumps of piles are the same bytes, and write it and the digest down.
    """
    sources = [SOURCES / "bridge.cpp", *sorted(SOURCES.glob("*.h"))]
    texts = [source.read_text("utf-8") for source in sources]
    (version,) = re.findall(r"(?m)^// FORCES_VERSION (\d+)$", texts[0])
    code = [re.sub(r"\s+", "", re.sub(r"(?s)/\*.*?\*/|//[^\n]*", "", text)) for text in texts]
    assert {int(version): sha256("".join(code).encode()).hexdigest()[:16]} == FORCES


def test_liquid_is_conserved_by_two_ranks(bench: Bench) -> None:
    """In films that are nearly empty and fuller than full; one process is what the audit looks at."""
    *judged, least, most = liquid_lines(bench, 2)
    assert [line.verdict for line in judged] == [Verdict.PASS, Verdict.PASS]
    assert least.measured < 0.5
    assert most.measured > 1.0


# --- the audit --------------------------------------------------------------------------------------------------------


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's cache of the test's own, with the contact model that is compiled already."""
    kept = plugin_of(find_engine())
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "cache" / "granular-walkers").mkdir(parents=True)
    for part in (kept, kept.with_suffix(".json")):
        shutil.copy(part, tmp_path / "cache" / "granular-walkers")
    return tmp_path


def _audit_of(made: Run) -> Any:
    """What the manifest of a run says of its engine's audit."""
    return read_manifest(made.directory)["engine"]["audit"]


def test_the_installed_engine_passes() -> None:
    lines, version = run_audit()
    assert [line.quantity for line in failures(lines)] == []
    assert [*dict.fromkeys(line.check for line in lines)] == [*CHECKS]
    assert len(lines) > 40
    assert version == "LIGGGHTS-PUBLIC 3.8.0"
    assert all(line.quantity in lines_text(lines) for line in lines)


@pytest.mark.slow
def test_a_machine_without_wide_instructions_gives_the_same_bytes(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contact model is compiled for machines with and without AVX, and chooses when it is loaded."""
    case = load_case("cluster", {"run.cycles": 8})
    wide = run(case, own_cache / "wide").motion
    sources, clones = (
        shutil.copytree(SOURCES, own_cache / "engine"),
        ', target_clones("avx512f", "avx2", "default")',
    )
    text = (SOURCES / "forces.h").read_text()
    assert text.count(clones) == 1
    (sources / "forces.h").write_text(text.replace(clones, ""))
    monkeypatch.setattr(model_sources, "SOURCES", sources)
    narrow = run(case, own_cache / "narrow").motion
    for name in ("position", "velocity", "spin"):
        assert np.array_equal(getattr(wide, name), getattr(narrow, name)), name


def test_an_engine_that_fails_in_a_check_fails_the_check(
    own_cache: Path, front: Callable[[str], str]
) -> None:
    """Whatever it is asked for, but its version. What a machine cannot run is not kept as the binary's fault."""
    broken = front(
        'echo "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)"\necho ERROR: out of order\nexit 1'
    )
    engine = find_engine(broken)
    (failed,), version = run_audit(["stock"], engine=engine)
    assert "out of order" in failed.quantity
    assert failed.verdict is Verdict.ERROR
    record([failed], engine, version)
    assert read_audit(engine.sha256, None) is None
    done = call("check", "engine", "--only", "stock", "--engine", broken)
    assert done.returncode == 1
    assert "1 could not be measured" in done.stdout


def test_runs_name_the_audit_of_their_engine_and_contact_model(own_cache: Path) -> None:
    case = make_case(run=SHORT)
    assert _audit_of(run(case, own_cache / "a")) is None
    passed = {"passed": True, "lines": 80, "failures": [], "date": "2026-01-01T00:00:00Z"}
    write_audit(find_engine().sha256, {"contact_model": "0" * 64, **passed})
    assert _audit_of(run(case, own_cache / "b")) is None
    done = call("check", "engine", "--only", "stock", "--json", check=True)
    assert {line["check"] for line in json.loads(done.stdout)["lines"]} == {"stock"}
    assert _audit_of(run(case, own_cache / "c")) is None, "a part of the audit is no audit"
    lines, version = run_audit(["stock"])
    record(lines, find_engine(), version)
    audited = _audit_of(run(case, own_cache / "d"))
    assert (audited["passed"], audited["lines"], audited["failures"]) == (True, len(lines), [])
    for contents in ("", "{", "[]", '{"lines": 1}'):
        next(own_cache.rglob("audits/*.json")).write_text(contents)
        assert read_audit(find_engine().sha256, None) is None


def test_an_engine_without_an_audit_is_warned_of_once_in_a_process(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing of it stays in the cache: the next process warns again."""
    audit._warn_unaudited.cache_clear()
    with pytest.warns(UnauditedEngineWarning, match="never audited .*: walkers check engine"):
        run(make_case(run=SHORT), own_cache / "runs")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UnauditedEngineWarning)
        run(make_case(run={**SHORT, "cycles": 5}), own_cache / "runs")
    assert not list(own_cache.rglob("audits/*"))
    (own_cache / "case.toml").write_text(to_toml(document(run=SHORT)))
    command = [PROGRAM, "run", "case.toml", "--out", "anew"]
    done = subprocess.run(command, cwd=own_cache, capture_output=True, text=True, check=True)
    assert done.stderr.count("was never audited with its contact model: walkers check engine") == 1


def test_an_engine_whose_check_failed_is_refused(own_cache: Path) -> None:
    """`walkers run` says which check failed and what to do, and makes nothing."""
    engine = find_engine()
    right, wrong = Line("right", 1.0, 1.0, 0.1), Line("Hertz force", 1.0, 2.0, 0.1)
    record([right, wrong, right], engine, "3.8.0")
    (own_cache / "case.toml").write_text(to_toml(document(run=SHORT)))
    done = call("run", "case.toml", folder=own_cache)
    assert done.returncode == 1
    (told,) = done.stderr.splitlines()
    assert "failed its audit in 1 line(s), first: Hertz force" in told
    assert f"walkers check engine --engine {engine.path}" in told
    assert "another binary by --engine or WALKERS_ENGINE" in told
    with pytest.raises(AuditFailed, match="Hertz force"):
        run(make_case(run=SHORT), own_cache / "runs")
    (own_cache / "sweep.toml").write_text(
        'case = "case.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
    )
    swept = call("sweep", "sweep.toml", folder=own_cache)
    assert (swept.returncode, "first: Hertz force" in swept.stderr) == (1, True)
    assert not (own_cache / "runs").exists()


def test_another_build_of_the_contact_model_is_audited_anew(own_cache: Path) -> None:
    """A failed audit is of a binary and a build: another one is not refused, and has an outcome of its own."""
    engine, case = find_engine(), make_case(run=SHORT)
    failed = {
        "passed": False,
        "lines": 80,
        "failures": ["Hertz force"],
        "date": "2026-01-01T00:00:00Z",
    }
    write_audit(engine.sha256, {"contact_model": "0" * 64, **failed})
    assert _audit_of(run(case, own_cache / "runs")) is None
    record([Line("right", 1.0, 1.0, 0.1)], engine, "3.8.0")
    assert _audit_of(run(case, own_cache / "audited"))["passed"]
    write_audit(engine.sha256, {"contact_model": model_sha256(engine), **failed})
    with pytest.raises(AuditFailed, match="Hertz force"):
        run(case, own_cache / "refused")
