"""The audit: passes on the installed engine, fails at exactly the lines whose workaround is missing."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import (
    PATIENCE,
    PROGRAM,
    SHORT,
    call,
    document,
    engines_in,
    make_case,
    to_toml,
    wait_for_engines,
)
from walkers import Run
from walkers import run as run_case
from walkers.audit import AuditReport, Check, Line, Verdict, run_audit
from walkers.audit.bench import Bench
from walkers.audit.checks.timestep import agitation
from walkers.audit.run import CHECKS, record, selected
from walkers.audit.table import GROUPS, as_dict, as_markdown, as_text
from walkers.inputs import InputError
from walkers.runner.audits import AuditRecord, read_audit, write_audit
from walkers.runner.binary import find_engine
from walkers.runner.directory import FinishedRun
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning
from walkers.templates.engine import DEFECTS, Workarounds


@pytest.fixture(scope="session")
def report(once: Callable[[str, Callable[[Path], object]], Path]) -> AuditReport:
    """The quick audit of the installed engine."""

    def audit(folder: Path) -> None:
        (folder / "report").write_bytes(pickle.dumps(run_audit(selected(quick=True))))

    found: AuditReport = pickle.loads((once("audit", audit) / "report").read_bytes())
    return found


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def _failing(report: AuditReport) -> set[str]:
    return {line.what for line in report.failures}


def _audit_of(run: Run) -> dict[str, Any] | None:
    """What the manifest of a run says of its engine's audit."""
    audit: dict[str, Any] | None = FinishedRun(run.directory).manifest["engine"]["audit"]
    return audit


def _standing_on(report: AuditReport, workaround: str) -> set[str]:
    return {line.what for line in report.lines if workaround in line.needs}


def test_the_installed_engine_passes(report: AuditReport) -> None:
    assert not _failing(report)
    assert len(report.lines) > 60
    assert report.version == "LIGGGHTS-PUBLIC 3.8.0"


def test_all_groups_are_measured() -> None:
    assert {check.group for check in CHECKS} == set(GROUPS) == set(range(1, 12))
    assert {checked.group for checked in selected(quick=True)} >= {1, 2, 3, 4, 5, 6, 7, 9}


def test_the_surprises_are_there_in_the_raw_engine(report: AuditReport) -> None:
    found = {line.what: line for line in report.lines}
    angle = found["contactAngle of 30° acts as"]
    assert angle.measured == pytest.approx(7.85, abs=0.05)
    assert found["a single wall pulls half as hard, over πγR"].measured == pytest.approx(1.7, abs=0.05)
    assert {line.verdict for line in report.lines if line.defect} == {Verdict.PRESENT}
    assert report.count(Verdict.PRESENT) >= 3


def test_the_energy_balance_weighs_some_energy(report: AuditReport) -> None:
    """Work of forces that nobody recorded would be zero, and against zero so little energy is within the tolerance."""
    (line,) = (line for line in report.lines if line.what.startswith("energy over a cycle: work"))
    assert line.expected == pytest.approx(3.67e-9, rel=0.01)
    assert line.measured == pytest.approx(line.expected, rel=0.01)


def _quick_but(*longest: str) -> tuple[Check, ...]:
    """The quick checks without some that take long and have no line that stands on the workaround in question."""
    return tuple(check for check in selected(quick=True) if check.name not in longest)


def test_without_carriers_exactly_the_viscous_wall_lines_fail(report: AuditReport) -> None:
    longest = ("independence", "restart", "energy", "restitution", "contact-angle", "viscous-carriers")
    checks = _quick_but(*longest)
    broken = run_audit(checks, workarounds=Workarounds(carriers=False))
    assert _failing(broken) == _standing_on(report, "carriers")
    assert len(_failing(broken)) >= 9


def test_with_a_single_wall_exactly_the_wall_lines_fail(report: AuditReport) -> None:
    """The box's lines are measured on two processes; those on one fail with the carriers already."""
    checks = _quick_but("independence", "restart", "wall-motion", "viscous-carriers", "viscous-walls")
    broken = run_audit(checks, workarounds=Workarounds(wall_copies=1))
    elsewhere = {line.what for one in report.checked if one.check.name == "viscous-walls" for line in one.lines}
    assert _failing(broken) == _standing_on(report, "walls") - elsewhere
    assert len(_failing(broken)) >= 15


def test_without_the_translation_exactly_the_angle_lines_fail(report: AuditReport) -> None:
    broken = run_audit(selected(["contact-angle"]), workarounds=Workarounds(contact_angle=False))
    assert _failing(broken) == _standing_on(report, "angle")


def test_glycerol_at_eight_microseconds_fails_at_the_pile_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Six cycles of the ten, by which the pile has lost beads; against 1 µs, at which it is made once."""
    found: dict[float, float] = {}

    def once(bench: Bench, time_step: float) -> float:
        if time_step not in found:
            found[time_step] = agitation(bench, time_step)
        return found[time_step]

    for name, value in {"_CYCLES": 6, "_SETTLING": 3, "_FINEST": 1e-6, "agitation": once}.items():
        monkeypatch.setattr(f"walkers.audit.checks.timestep.{name}", value)
    broken = run_audit(selected(["step-pile"]), pile_time_step=8e-6)
    assert _failing(broken) == _standing_on(broken, "time step")
    assert len(_failing(broken)) == 1
    assert sorted(found) == [1e-6, 4e-6, 8e-6]


def test_a_line_that_is_no_number_fails() -> None:
    line = Line("x", "y", 1.0, float("nan"), tolerance=0.1)
    assert line.verdict is Verdict.FAIL
    assert replace(line, tolerance=None).verdict is Verdict.REPORT
    assert replace(line, measured=1.05).verdict is Verdict.PASS


def test_an_engine_that_fails_in_a_check_fails_the_check(tmp_path: Path) -> None:
    front = tmp_path / "liggghts-broken"
    front.write_text("#!/bin/sh\necho ERROR: out of order\nexit 1\n")
    front.chmod(0o755)
    report = run_audit(selected(["hertz"]), engine=find_engine(str(front)))
    assert len(report.failures) == 1
    assert "out of order" in report.failures[0].what
    assert report.failures[0].verdict is Verdict.ERROR
    assert record(report, quick=True) is None


def test_every_defect_is_watched_by_checks_that_exist() -> None:
    names = {check.name for check in CHECKS}
    assert len(names) == len(CHECKS)
    for defect in DEFECTS:
        assert set(defect.watched_by) <= names


def test_unknown_checks_are_refused() -> None:
    with pytest.raises(InputError, match='did you mean "friction"'):
        selected(["fricton"])


def test_tables(report: AuditReport) -> None:
    text, markdown, values = as_text(report), as_markdown(report), as_dict(report)
    for line in report.lines:
        assert line.what in text
        assert line.what in markdown
    assert values["passed"]
    json.dumps(values, allow_nan=False)
    for defect in DEFECTS:
        assert defect.name in markdown


def test_docs_engine_is_what_the_audit_writes(report: AuditReport) -> None:
    """The page is generated: all defects and all lines of the quick audit are in it, by their names."""
    written = (Path(__file__).parent.parent / "docs" / "explanation" / "engine.md").read_text("utf-8")
    for defect in DEFECTS:
        assert f"### {defect.name}\n\n{defect.shows}\n\n*Workaround.* {defect.workaround}\n" in written
    for checked in report.checked:
        for line in checked.lines:
            assert f"| `{checked.check.name}` | {line.what} |" in written


def test_runs_name_the_audit_of_their_engine(own_cache: Path) -> None:
    case = make_case(run=SHORT)
    with pytest.warns(UnauditedEngineWarning, match="walkers audit"):
        unaudited = run_case(case, own_cache / "a")
    assert _audit_of(unaudited) is None
    kept = record(run_audit(selected(["hertz"])), quick=True)
    assert kept is not None
    audited = run_case(case, own_cache / "b")
    assert _audit_of(audited) == {
        "scope": "quick", "passed": True, "lines": kept.lines, "skipped": 0, "date": kept.date
    }  # fmt: skip


def test_a_binary_that_failed_is_refused_unless_told_otherwise(own_cache: Path) -> None:
    engine = find_engine()
    write_audit(
        AuditRecord(engine.sha256, "LIGGGHTS-PUBLIC 3.8.0", "full", 80, ("Hertz force",), 0, "2026-01-01T00:00:00Z")
    )
    case = make_case(run=SHORT)
    with pytest.raises(AuditFailed, match="Hertz force"):
        run_case(case, own_cache / "runs")
    assert not (own_cache / "runs").exists()
    audit = _audit_of(run_case(case, own_cache / "runs", allow_failed_audit=True))
    assert audit is not None
    assert not audit["passed"]


def test_a_quick_audit_does_not_displace_a_full_one(own_cache: Path) -> None:
    full = AuditRecord("f" * 64, "3.8.0", "full", 90, (), 0, "2026-01-01T00:00:00Z")
    failed = replace(full, failures=("something",))
    write_audit(full)
    write_audit(replace(full, scope="quick", lines=70))
    assert read_audit("f" * 64) == full
    write_audit(replace(failed, scope="quick"))
    assert read_audit("f" * 64) == replace(failed, scope="quick")
    write_audit(full)
    assert read_audit("f" * 64) == full
    write_audit(failed)
    write_audit(replace(full, scope="quick"))
    assert read_audit("f" * 64) == failed, "what only a full audit measures is not mended by a quick one"


def test_a_gone_defect_is_no_failure() -> None:
    line = Line("x", "y", 1.0, 0.0, defect=True)
    assert line.verdict is Verdict.GONE
    assert replace(line, measured=1.0).verdict is Verdict.PRESENT


def test_without_mpirun_the_ranks_are_skipped_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None if name == "mpirun" else f"/usr/bin/{name}")
    report = run_audit(selected(["ranks"]))
    assert report.count(Verdict.SKIPPED) == 1
    assert "1 skipped" in as_text(report)


def test_an_engine_without_bridges_fails_line_by_line(tmp_path: Path) -> None:
    """The real engine behind a front that takes the surface tension out of the deck."""
    front = tmp_path / "liggghts-dry"
    front.write_text(
        "#!/bin/sh\nsed -i 's/^\\(fix.*surfaceTension.* \\)[-0-9.e]*$/\\10.0/' walker.lig\nexec liggghts \"$@\"\n"
    )
    front.chmod(0o755)
    report = run_audit(selected(["capillary-wall", "capillary-beads"]), engine=find_engine(str(front)))
    assert not report.count(Verdict.ERROR)
    assert report.count(Verdict.FAIL) >= 19


def test_only_wins_over_quick() -> None:
    assert [check.name for check in selected(["step-pile"], quick=True)] == ["step-pile"]


def test_an_audit_whose_outcome_cannot_be_kept_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    monkeypatch.setattr("walkers.audit.run.CHECKS", selected(["hertz"]))  # as if it were all: a part is not to be kept
    done = call("audit", "--quick", "--json", check=True)
    assert json.loads(done.stdout)["passed"]
    assert "cannot be kept" in done.stderr


@pytest.mark.parametrize("option", [["--markdown", "/proc/nowhere/x.md"], ["--engine", "no-such-engine"]])
def test_bad_use(option: list[str]) -> None:
    done = call("audit", *option)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_an_interrupt_ends_the_audit_and_its_engines(own_cache: Path) -> None:
    environment = {**os.environ, "TMPDIR": str(own_cache)}
    program = subprocess.Popen(
        [PROGRAM, "audit", "--only", "step-pile"],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    )
    wait_for_engines(own_cache, program)
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=PATIENCE)
    assert program.returncode == 130
    assert not engines_in(own_cache)
    assert not list(own_cache.glob("walkers-audit-*"))


def test_a_damaged_record_is_no_record(own_cache: Path) -> None:
    write_audit(AuditRecord("e" * 64, "3.8.0", "full", 90, (), 0, "2026-01-01T00:00:00Z"))
    (path,) = own_cache.rglob("*.json")
    for contents in ("", "{", "[]", '{"engine": 1}'):
        path.write_text(contents)
        assert read_audit("e" * 64) is None


def test_the_program(own_cache: Path, in_folder: Path) -> None:
    done = call("audit", "--only", "hertz", "--only", "friction", "--json", "--markdown", "engine.md", check=True)
    assert [check["name"] for check in json.loads(done.stdout)["checks"]] == ["friction", "hertz"]
    assert "Hertz force against overlap" in (in_folder / "engine.md").read_text()
    assert not list(own_cache.rglob("audits/*.json")), "a part of the audit is no audit"
    refused = call("audit", "--only", "nothing")
    assert refused.returncode == 2
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    told = call("run", "mine.toml", check=True).stderr
    assert told.count("walkers audit") == 1


def test_exit_status_of_a_failing_audit(own_cache: Path) -> None:
    front = own_cache / "liggghts-broken"
    front.write_text("#!/bin/sh\necho ERROR: out of order\nexit 1\n")
    front.chmod(0o755)
    done = call("audit", "--only", "hertz", "--engine", str(front))
    assert done.returncode == 1
    assert "1 could not be measured" in done.stdout


def test_a_check_is_one_entry() -> None:
    check = Check(
        "mine", 5, "a check of my own", True, lambda bench: [Line("1 + 1", "arithmetic", 2.0, 1.0 + 1.0, tolerance=0.0)]
    )
    assert run_audit([check]).lines[0].verdict is Verdict.PASS
