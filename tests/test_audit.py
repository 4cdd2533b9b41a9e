"""The audit: passes on the installed engine and contact model, and finds what is wrong in a contact model."""

from __future__ import annotations

import json
import pickle
import shutil
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import SHORT, call, document, make_case, to_toml
from walkers import Run
from walkers import run as run_case
from walkers.check.audit import CHECKS, Audit, Line, Verdict, count, record, run_audit, selected
from walkers.check.scenes import SCENES, Bench, full_case, in_walls, law, prescribed, second_engine, standing
from walkers.errors import InputError
from walkers.inputs.reading import load_case
from walkers.physics.bridge import Surfaces
from walkers.runner import binary
from walkers.runner.binary import AuditRecord, find_engine, read_audit, write_audit
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning
from walkers.runner.manifest import read_manifest


@pytest.fixture(scope="session")
def audit(once: Callable[[str, Callable[[Path], object]], Path]) -> Audit:
    """The audit of the installed engine."""

    def run(folder: Path) -> None:
        (folder / "audit").write_bytes(pickle.dumps(run_audit()))

    found: Audit = pickle.loads((once("audit", run) / "audit").read_bytes())
    return found


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's cache of the test's own, with the contact model that is compiled already."""
    kept = binary.plugin_of(find_engine())
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "cache" / "granular-walkers").mkdir(parents=True)
    for part in (kept, kept.with_suffix(".json")):
        shutil.copy(part, tmp_path / "cache" / "granular-walkers")
    return tmp_path


def _change_model(folder: Path, monkeypatch: pytest.MonkeyPatch, right: str, other: str) -> None:
    """Have another text in the contact model."""
    sources = folder / "engine"
    shutil.copytree(binary.SOURCES, sources)
    text = (sources / "bridge.cpp").read_text()
    assert text.count(right) == 1
    (sources / "bridge.cpp").write_text(text.replace(right, other))
    monkeypatch.setattr(binary, "SOURCES", sources)


def _audit_of(run: Run) -> dict[str, Any] | None:
    """What the manifest of a run says of its engine's audit."""
    audit: dict[str, Any] | None = read_manifest(run.directory)["engine"]["audit"]
    return audit


def test_the_installed_engine_passes(audit: Audit) -> None:
    assert [line.what for line in audit.failures] == []
    assert [*dict.fromkeys(line.check for line in audit.lines)] == [*CHECKS]
    assert count(audit.lines, Verdict.PASS) > 60
    assert audit.version == "LIGGGHTS-PUBLIC 3.8.0"
    text, values = audit.as_text(), audit.as_dict()
    assert all(line.what in text for line in audit.lines)
    assert values["passed"]
    json.dumps(values, allow_nan=False)


WRONG = {
    "the sign of the coupling": (
        "two beads separate",
        "* sliding + coupling * rolling;",
        "* sliding - coupling * rolling;",
    ),
    "the couple's reaction": ("two beads separate", "arm_j * t - couple", "arm_j * t + couple"),
    "the arm of open bridges to walls": (
        "a bead leaves the floor",
        "b.radius_i[k] + 0.5 * gap",
        "b.radius_i[k] + 0.5 * (gap < 0. ? gap : 0.)",
    ),
    "a spring that does not turn with the contact": (
        "beads leave a cylindrical wall",
        "stretch = stretch - dot(stretch, n) * n;",
        "",
    ),
    "a spring stiffer by 1e-4": ("a bead slides", "= of.shear_stiffness", "= 1.0001 * of.shear_stiffness"),
    "a limit that leaves out the damping": (
        "a bead slides",
        "std::sqrt(slips ? held : dot(hold, hold))",
        "std::sqrt(held)",
    ),
    "a rupture later by 1 %": (
        "a bead leaves the floor",
        "if (gap < table->rupture) return",
        "if (gap < 1.01 * table->rupture) return",
    ),
    "the coupling's order": (
        "two beads separate, the smaller first",
        "std::copysign(1., history[TABLE]) * f[c]",
        "f[c]",
    ),
    "walls at rest": (
        "the floor oscillates horizontally",
        "vec(atom->v[i]) - velocity_,",
        "vec(atom->v[i]) - 0. * velocity_,",
    ),
    "the damping": ("a bead approaches the floor", "std::sqrt(5. / 6.)", "0.913"),
}
"""Faults of the contact model: the scene that shows each, the right and the wrong text."""


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_contact_model_is_found(wrong: str, own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, right, other = WRONG[wrong]
    monkeypatch.setattr("walkers.check.scenes.SCENES", {scene: SCENES[scene]})
    _change_model(own_cache, monkeypatch, right, other)
    monkeypatch.setattr(binary, "_OPTIONS", [*binary._OPTIONS, "-O1"])  # it is compiled in half the time
    audit = run_audit(["scenes"])
    assert count(audit.lines, Verdict.FAIL)
    assert not count(audit.lines, Verdict.ERROR)


@pytest.mark.parametrize("rolling_friction", [0.0, 0.01])
def test_a_machine_without_wide_instructions_gives_the_same_bytes(
    rolling_friction: float, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contact model is compiled for machines with and without AVX, and chooses when it is loaded."""
    case = load_case("cluster", {"run.cycles": 8, "contact.rolling_friction": rolling_friction})
    wide = run_case(case, own_cache / "wide").motion
    _change_model(own_cache, monkeypatch, ', target_clones("avx512f", "avx2", "default")', "")
    narrow = run_case(case, own_cache / "narrow").motion
    for name in ("position", "velocity", "spin"):
        assert np.array_equal(getattr(wide, name), getattr(narrow, name)), name


def test_the_scenes_cover_contacts_and_bridges_closed_and_open_with_all_terms(tmp_path: Path) -> None:
    """So that their agreement says something of each: forms, gaps at which a bridge forms, and rupture."""
    curve = law(Surfaces.of(3e-4, 2e-4, full_case().liquid.of_bridges, 0.01))
    assert np.all(curve.forces(np.linspace(0.0, curve.rupture, 50)).columns() != 0.0)
    bench, seen = Bench(find_engine(), tmp_path), set()
    for name in ("a bead approaches the floor", "a bead leaves the floor", "two beads separate", "two beads approach"):
        case, scene = full_case(), standing(SCENES[name].beads)
        engine = second_engine(case, scene)
        for frame in in_walls(case, bench.run(prescribed(case, scene)))[::20]:
            engine.follow(frame)
            seen |= {(name, bool(engine.bridges())), (name, "touches" if np.any(engine.pairs.spring) else "apart")}
    assert len(seen) == 4 * 4


def test_an_engine_that_fails_in_a_check_fails_the_check(own_cache: Path, front: Callable[[str], str]) -> None:
    """Whatever it is asked for, but its version."""
    broken = front('echo "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)"\necho ERROR: out of order\nexit 1')
    audit = run_audit(["stock"], engine=find_engine(broken))
    (failed,) = audit.failures
    assert "out of order" in failed.what
    assert failed.verdict is Verdict.ERROR
    assert record(audit, quick=True) is None
    done = call("check", "engine", "--only", "stock", "--engine", broken)
    assert done.returncode == 1
    assert "1 could not be measured" in done.stdout


def test_a_quick_audit_leaves_the_long_checks_out() -> None:
    with pytest.raises(InputError, match='did you mean "stock"'):
        selected(["stok"])
    assert selected(["step"], quick=True) == ("step",)
    assert {*selected(quick=True)} == {*CHECKS} - {"step"}


def test_runs_name_the_audit_of_their_engine(own_cache: Path) -> None:
    case = make_case(run=SHORT)
    with pytest.warns(UnauditedEngineWarning, match="walkers check engine"):
        unaudited = run_case(case, own_cache / "a")
    assert _audit_of(unaudited) is None
    with warnings.catch_warnings():  # it is said once
        warnings.simplefilter("error", UnauditedEngineWarning)
        run_case(make_case(run={**SHORT, "cycles": 5}), own_cache / "a")
    kept = record(run_audit(["stock"]), quick=True)
    assert kept is not None
    audited = run_case(case, own_cache / "b")
    assert _audit_of(audited) == {
        "scope": "quick", "passed": True, "lines": kept.lines, "skipped": 0, "date": kept.date
    }  # fmt: skip


def test_a_binary_that_failed_is_refused_unless_told_otherwise(own_cache: Path) -> None:
    engine = find_engine()
    write_audit(
        AuditRecord(
            engine.sha256,
            binary.model_sha256(engine) or "",
            *("LIGGGHTS-PUBLIC 3.8.0", "full", 80, ("Hertz force",), 0, "2026-01-01T00:00:00Z"),
        )
    )
    case = make_case(run=SHORT)
    with pytest.raises(AuditFailed, match="Hertz force"):
        run_case(case, own_cache / "runs")
    assert not (own_cache / "runs").exists()
    audit = _audit_of(run_case(case, own_cache / "runs", allow_failed_audit=True))
    assert audit is not None
    assert not audit["passed"]


def test_a_check_that_failed_is_recorded_as_failed(own_cache: Path, tmp_path: Path) -> None:
    """`walkers run` refuses the engine, and says which check failed."""
    engine = find_engine()
    lines = (Line("right", 1.0, 1.0, 0.1), Line("Hertz force", 1.0, 2.0, 0.1))
    audit = Audit(engine, binary.model_sha256(engine) or "", "3.8.0", (lines[0], *lines))
    assert [line.what for line in audit.failures] == ["Hertz force"]
    kept = record(audit, quick=True)
    assert kept is not None
    assert kept == read_audit(engine.sha256, audit.contact_model)
    assert (kept.failures, kept.passed, kept.lines, kept.scope) == (("Hertz force",), False, 3, "quick")
    (tmp_path / "case.toml").write_text(to_toml(document(run=SHORT)))
    done = call("run", "case.toml", folder=tmp_path)
    assert done.returncode == 1
    assert "this engine failed its audit in 1 line(s), first: Hertz force" in done.stderr
    assert not (tmp_path / "runs").exists()


def test_a_run_with_another_contact_model_than_the_audited_is_not_audited(own_cache: Path) -> None:
    case, engine = make_case(run=SHORT), find_engine()
    write_audit(AuditRecord(engine.sha256, "0" * 64, "3.8.0", "full", 80, (), 0, "2026-01-01T00:00:00Z"))
    with pytest.warns(UnauditedEngineWarning, match="never audited with its contact model"):
        run = run_case(case, own_cache / "a")
    assert _audit_of(run) is None
    audit = replace(run_audit(["stock"]), lines=())
    assert audit.contact_model == read_manifest(run.directory)["contact_model"]["sha256"]
    record(audit, quick=False)
    assert _audit_of(run_case(case, own_cache / "b")) is not None


def test_a_quick_audit_does_not_displace_a_full_one(own_cache: Path) -> None:
    full = AuditRecord("f" * 64, "m", "3.8.0", "full", 90, (), 0, "2026-01-01T00:00:00Z")
    failed = replace(full, failures=("something",))
    write_audit(full)
    write_audit(replace(full, scope="quick", lines=70))
    assert read_audit("f" * 64, "m") == full
    write_audit(replace(failed, scope="quick"))
    assert read_audit("f" * 64, "m") == replace(failed, scope="quick")
    write_audit(full)
    assert read_audit("f" * 64, "m") == full
    write_audit(failed)
    write_audit(replace(full, scope="quick"))
    assert read_audit("f" * 64, "m") == failed, "what only a full audit measures is not mended by a quick one"


def test_a_damaged_record_is_no_record(own_cache: Path) -> None:
    write_audit(AuditRecord("e" * 64, "m", "3.8.0", "full", 90, (), 0, "2026-01-01T00:00:00Z"))
    (path,) = own_cache.rglob("audits/*.json")
    for contents in ("", "{", "[]", '{"engine": 1}'):
        path.write_text(contents)
        assert read_audit("e" * 64, "m") is None


def test_without_mpirun_the_ranks_are_skipped_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    which = shutil.which
    monkeypatch.setattr("walkers.check.scenes.shutil.which", lambda name: None if name == "mpirun" else which(name))
    audit = run_audit(["ranks"])
    assert count(audit.lines, Verdict.SKIPPED) == 1
    assert "1 skipped" in audit.as_text()


def test_an_audit_whose_outcome_cannot_be_kept_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: AuditRecord) -> None:
        raise OSError("no room")

    monkeypatch.setattr("walkers.check.audit.write_audit", full)
    one = {"stock": CHECKS["stock"]}  # as if it were all: a part is not to be kept
    monkeypatch.setattr("walkers.check.audit.CHECKS", one)
    done = call("check", "engine", "--quick", "--json", check=True)
    assert json.loads(done.stdout)["passed"]
    assert "cannot be kept" in done.stderr


def test_a_part_of_the_audit_is_no_audit(own_cache: Path) -> None:
    done = call("check", "engine", "--only", "stock", "--only", "restart", "--json", check=True)
    assert [*dict.fromkeys(line["check"] for line in json.loads(done.stdout)["lines"])] == ["restart", "stock"]
    assert not list(own_cache.rglob("audits/*.json"))
