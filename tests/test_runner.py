"""Run directories and engines.

What is there, what is made again, and every failure, provoked for real.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import (
    BRIEF,
    LONG,
    PATIENCE,
    PROGRAM,
    SHORT,
    brief_pile,
    call,
    document,
    engines_in,
    finished_places,
    make_case,
    open_run,
    processes_in,
    to_toml,
    wait_for,
)
from walkers import run as run_case
from walkers.cache import is_trusted
from walkers.inputs.tables.case import Case
from walkers.physics.laws import young_laplace
from walkers.runner import audit, failures, model_sources, run_directory
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of
from walkers.runner.failures import EngineNeverStarted
from walkers.runner.launch import EngineReport, judge
from walkers.runner.manifest import FinishedRun, read_manifest, write_manifest
from walkers.runner.run_directory import (
    FIRST_SEGMENT,
    case_of,
    is_finished,
    is_locked,
    leave_out_dumps,
    locked,
    read_layout,
    run_place,
)
from walkers.runs.making import make_runs
from walkers.runs.names import find
from walkers.templates.deck import RESTART_NAME, Deck, Segment, render_deck, single_segment

PATIENCE_OF_LOCKS = "walkers.runner.run_directory._PATIENCE_SECONDS"
Once = Callable[[str, Callable[[Path], object]], Path]


def _case_file(folder: Path, run: dict[str, Any]) -> str:
    """Write the reference case with another table ``run``; return its path."""
    file = folder / "test.toml"
    file.write_text(to_toml(document(run=run)))
    return str(file)


def _run_of(program: subprocess.CompletedProcess[str]) -> Path:
    """The run directory that ``walkers run --json`` prints."""
    return Path(json.loads(program.stdout)["run"])


# --- names and contents of run directories --------------------------------------------------------


def _name_of(case: Case) -> str:
    """The name of the run of a case."""
    return run_place(case, find_engine(), Path()).name


@pytest.mark.parametrize(
    "changes",
    [
        {"run": {"seed": 2}},
        {"run": {"cycles": 61}},
        {"drive": {"frame": "lab"}},
        {"drive": {"peak_acceleration": "4.01 g"}},
        {"contact": {"rolling_friction": 0.001}},
    ],
    ids=str,
)
def test_the_name_depends_on_what_determines_the_run(changes: dict[str, Any]) -> None:
    assert _name_of(make_case(**changes)) != _name_of(make_case())


def test_the_name_does_not_depend_on_the_title() -> None:
    assert _name_of(make_case(title="another title")) == _name_of(make_case())


def test_the_name_of_a_run_is_a_short_name_of_a_folder() -> None:
    name = _name_of(make_case().with_values(name="a b/" * 100))
    assert len(name) < 100
    assert "/" not in name


def test_another_engine_makes_other_runs() -> None:
    engine = find_engine()
    another_engine = replace(engine, sha256="0" * 64)
    place = run_place(make_case(), engine, Path())
    assert run_place(make_case(), another_engine, Path()).name != place.name


@pytest.mark.parametrize("name", ["CONTENT_VERSION", "FORMAT"])
def test_decks_of_another_version_are_other_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = make_case()
    engine = find_engine()
    place = run_place(case, engine, tmp_path)
    assert run_place(case, engine, tmp_path) == place
    monkeypatch.setattr(run_directory, name, getattr(run_directory, name) + 1)
    assert run_place(case, engine, tmp_path) != place


def test_a_run_directory_has_the_case_the_result_and_its_tables(
    run_directory: Callable[..., Path],
) -> None:
    names = {path.name for path in run_directory(run=SHORT).iterdir()}
    assert names == {
        "bridges.parquet",
        "case.json",
        "cycles.parquet",
        "manifest.json",
        "requested",
        "result.json",
        "segments",
        "trajectory.parquet",
        "walkers.parquet",
    }


def test_a_segment_has_its_deck_and_its_dumps(run_directory: Callable[..., Path]) -> None:
    names = {path.name for path in (run_directory(run=SHORT) / FIRST_SEGMENT).iterdir()}
    assert names == {
        "beads.bin",
        "bridges.pairs.txt",
        "bridges.txt",
        "bridges.walls.txt",
        "engine.log",
        "layout.json",
        "run.sh",
        "segment.json",
        "walker.lig",
    }


def test_a_run_directory_says_what_was_run(run_directory: Callable[..., Path]) -> None:
    case = make_case(run=SHORT)
    run = run_directory(case)
    assert case_of(run) == case
    assert read_layout(run / FIRST_SEGMENT) == render_deck(case).layout
    manifest = read_manifest(run)
    assert manifest["status"] == "finished"
    assert manifest["steps"] == case.run.steps
    assert manifest["engine"]["sha256"] == find_engine().sha256


def test_a_pile_without_dumps_has_no_restart_files(pile_run: Path, tmp_path: Path) -> None:
    """The run of a pile has segments, and a file to continue from after each."""
    run = Path(shutil.copytree(pile_run, tmp_path / pile_run.name))
    assert len(list(run.rglob(RESTART_NAME))) > 1
    leave_out_dumps(run)
    assert not list(run.rglob(RESTART_NAME))
    assert walkers.load(run).result.as_dict() == walkers.load(pile_run).result.as_dict()


@pytest.fixture
def manifest_of_1000_steps(tmp_path: Path) -> dict[str, Any]:
    """The manifest of a run of 1000 steps in 2 s; the engine also took 2 s to start."""
    report = EngineReport("LIGGGHTS", wall_seconds=4.0, loop_seconds=2.0, steps=1000)
    run = FinishedRun(
        case=make_case(),
        name="test-0123456789ab",
        engine=None,
        report=report,
        started=time.time() - 5.0,
        segments=1,
        drive_from=0,
    )
    write_manifest(tmp_path, run)
    return read_manifest(tmp_path)


def test_steps_per_second_are_those_of_the_engines_loop(
    manifest_of_1000_steps: dict[str, Any],
) -> None:
    assert manifest_of_1000_steps["steps"] == 1000
    assert manifest_of_1000_steps["steps_per_second"] == 500.0


def test_a_manifest_tells_seconds_of_the_run_of_the_engine_and_of_its_loop(
    manifest_of_1000_steps: dict[str, Any],
) -> None:
    seconds = manifest_of_1000_steps["seconds"]
    assert seconds["engine_loop"] == 2.0
    assert seconds["engine"] == 4.0
    assert seconds["total"] == pytest.approx(5.0, abs=1.0)


# --- runs that are found --------------------------------------------------------------------------


SET_70_HZ = ("--set", "drive.frequency=70Hz")
AT_70_HZ = {"drive.frequency": "70 Hz"}


@dataclass(frozen=True)
class TwoRuns:
    """Finished runs of ``test.toml`` in the folder ``runs``: as it is, and at 70 Hz."""

    as_it_is: Path
    at_70_hz: Path

    def named(self, way: str) -> str:
        """The first run, named in one of the `WAYS`."""
        names = {
            "directory": str(self.as_it_is),
            "name": self.as_it_is.name,
            "case file": "test.toml",
        }
        return names[way]


WAYS = ["directory", "name", "case file"]


@pytest.fixture
def two_runs(in_folder: Path, once: Once) -> TwoRuns:
    """A copy of two runs in the current folder."""

    def make(folder: Path) -> None:
        case_file = _case_file(folder, SHORT)
        as_it_is = _run_of(call("run", case_file, "--json", check=True, folder=folder))
        at_70_hz = _run_of(call("run", case_file, *SET_70_HZ, "--json", check=True, folder=folder))
        (folder / "names.json").write_text(json.dumps([as_it_is.name, at_70_hz.name]))

    shutil.copytree(once("two-runs", make), in_folder, dirs_exist_ok=True)
    as_it_is, at_70_hz = json.loads(Path("names.json").read_text())
    return TwoRuns(Path("runs", as_it_is), Path("runs", at_70_hz))


@pytest.mark.parametrize("way", WAYS)
def test_a_run_is_found_by_its_directory_its_name_or_its_case(way: str, two_runs: TwoRuns) -> None:
    assert walkers.load(two_runs.named(way)).directory == two_runs.as_it_is


@pytest.mark.parametrize("way", WAYS)
def test_a_run_with_other_values_is_found_in_the_same_ways(way: str, two_runs: TwoRuns) -> None:
    assert walkers.load(two_runs.named(way), "runs", AT_70_HZ).directory == two_runs.at_70_hz


@pytest.mark.parametrize("way", WAYS)
def test_a_finished_run_is_not_run_again(way: str, two_runs: TwoRuns) -> None:
    first = json.loads(call("run", two_runs.named(way), "--json", check=True).stdout)
    assert first["cached"]
    assert Path(first["run"]) == two_runs.as_it_is


@pytest.mark.parametrize("way", WAYS)
def test_a_finished_run_with_other_values_is_not_run_again(way: str, two_runs: TwoRuns) -> None:
    done = call("run", two_runs.named(way), *SET_70_HZ, "--json", check=True)
    assert json.loads(done.stdout)["cached"]


def test_python_finds_a_run_by_its_case_or_its_directory(two_runs: TwoRuns) -> None:
    assert walkers.run("test.toml", "runs").directory == two_runs.as_it_is
    assert walkers.run(two_runs.as_it_is).directory == two_runs.as_it_is


def test_a_run_that_is_not_finished_is_asked_for(in_folder: Path) -> None:
    """With the command that makes it."""
    case_file = _case_file(in_folder, SHORT)
    command = f"first do: walkers run {case_file} --set drive.frequency=70Hz"
    assert command in call("plot", case_file, *SET_70_HZ).stderr


def test_a_run_with_other_values_belongs_beside_the_run(tmp_path: Path) -> None:
    """Where its path says, whatever the folder of runs is."""
    first = run_case(make_case(run=BRIEF), tmp_path / "elsewhere").directory
    named = find(first, tmp_path / "runs", AT_70_HZ)
    assert named.kind == "run"
    assert named.folder == first.parent
    assert named.finished_run is None
    second = run_case(named.case, named.folder).directory
    assert walkers.load(first, tmp_path / "runs", AT_70_HZ).directory == second


def test_a_case_with_other_values_belongs_in_the_folder_of_runs(tmp_path: Path) -> None:
    assert find("fig1b", tmp_path / "runs", AT_70_HZ).folder == tmp_path / "runs"


# --- runs in progress, and runs that are made again -----------------------------------------------


@dataclass(frozen=True)
class RunningProgram:
    """A program whose run goes on for minutes."""

    process: subprocess.Popen[bytes]
    run: walkers.Run
    case_file: str


@pytest.fixture
def running(in_folder: Path) -> Iterator[RunningProgram]:
    """A program that has simulated two of 4000 cycles in the current folder."""
    case_file = _case_file(in_folder, LONG)
    process = subprocess.Popen([PROGRAM, "run", case_file], stderr=subprocess.DEVNULL)
    try:
        wait_for(lambda: list(Path("runs").glob("*.incomplete/case.json")))
        run = walkers.load(next(Path("runs").glob("*.lock")).with_suffix(""))
        assert isinstance(run, walkers.Run)
        wait_for(lambda: run.progress and run.progress.share > 2 / run.case.run.cycles)
        yield RunningProgram(process, run, case_file)
    finally:
        process.kill()
        process.wait()


def test_a_running_simulation_is_looked_at(running: RunningProgram, in_folder: Path) -> None:
    assert running.run.status == "running"
    assert walkers.load(running.case_file).status == "running"
    assert len(engines_in(in_folder)) == 1
    refused = call("plot", running.case_file).stderr
    assert f"{running.run.directory}: the run is running: " in refused


def test_a_running_simulation_is_stopped_and_continued(
    running: RunningProgram, in_folder: Path
) -> None:
    """By Ctrl-C, after which the exit status is 130; then a time limit ends it."""
    run = running.run
    running.process.send_signal(signal.SIGINT)
    assert running.process.wait(PATIENCE) == 130
    assert run.status == "interrupted"
    assert run.progress is None
    assert engines_in(in_folder) == []
    continued = call("run", str(run.directory), "--limit", "0.2")
    assert continued.returncode == 1
    assert "time limit of 0.2 s" in continued.stderr
    assert run.status == "failed"
    assert "time limit of 0.2 s" in run.describe()


@pytest.fixture
def brief_case() -> Case:
    return make_case(run=BRIEF)


@pytest.fixture
def finished(brief_case: Case, run_directory: Callable[..., Path], tmp_path: Path) -> Path:
    """A copy of the finished run of `brief_case`, alone in the folder of runs ``tmp_path``."""
    original = run_directory(brief_case)
    return Path(shutil.copytree(original, tmp_path / original.name))


def test_the_result_of_a_finished_run_is_read(
    finished: Path, brief_case: Case, run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    run = run_case(brief_case, tmp_path)
    assert run.cached
    assert run.result == walkers.load(run_directory(brief_case)).result


def _interrupt(_: object) -> None:
    raise KeyboardInterrupt


def test_a_run_by_force_that_fails_leaves_the_old_one(
    finished: Path, brief_case: Case, tmp_path: Path
) -> None:
    dump = finished / FIRST_SEGMENT / "beads.bin"
    with dump.open("rb") as before:  # as long as it is open, no other file gets its number
        with pytest.raises(KeyboardInterrupt):
            make_runs([brief_case], tmp_path, find_engine(), force=True, on_progress=_interrupt)
        assert run_case(brief_case, tmp_path).cached
        assert os.path.samestat(os.fstat(before.fileno()), dump.stat())


def test_a_run_by_force_replaces_the_old_one_by_the_same_bits(
    finished: Path, brief_case: Case, tmp_path: Path
) -> None:
    dump = finished / FIRST_SEGMENT / "beads.bin"
    with dump.open("rb") as before:  # as long as it is open, no other file gets its number
        assert not run_case(brief_case, tmp_path, force=True).cached
        assert not os.path.samestat(os.fstat(before.fileno()), dump.stat())
        assert dump.read_bytes() == before.read()
    assert [path.name for path in tmp_path.iterdir()] == [finished.name]


def test_a_crash_between_the_renames_of_a_replacement_is_mended(
    finished: Path, brief_case: Case, tmp_path: Path
) -> None:
    """The old run is put back."""
    finished.rename(finished.with_name(f"{finished.name}.replaced"))
    with open_run(brief_case, find_engine(), tmp_path):
        assert is_finished(finished)


def test_a_crash_after_the_renames_of_a_replacement_leaves_no_trace(
    finished: Path, brief_case: Case, tmp_path: Path
) -> None:
    """The old run goes with the next replacement, and is no run meanwhile."""
    replaced = Path(shutil.copytree(finished, finished.with_name(f"{finished.name}.replaced")))
    assert finished_places(tmp_path) == {finished.name: finished}
    assert run_case(brief_case, tmp_path).cached
    assert run_case(brief_case, tmp_path, force=True).directory == finished
    assert not replaced.exists()


def test_a_lock_that_somebody_has_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    with locked([tmp_path / "x"]) as ours, locked([tmp_path / "x", tmp_path / "y"]) as theirs:
        assert list(ours) == [tmp_path / "x"]
        assert list(theirs) == [tmp_path / "y"]
        assert is_locked(tmp_path / "x")
    assert not is_locked(tmp_path / "x")
    assert not list(tmp_path.iterdir())


# --- the engine and its contact model -------------------------------------------------------------


def test_engine_missing(tmp_path: Path) -> None:
    with pytest.raises(failures.EngineMissing, match="apt-get install liggghts"):
        run_case(make_case(), tmp_path / "runs", engine="no-such-liggghts")
    assert not (tmp_path / "runs").exists()


@pytest.fixture
def bin_without_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only folder of programs, which lacks g++, beside an empty cache."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("liggghts", "mpicxx", "ldd", "sh", "bash"):
        program = shutil.which(name)
        if program:
            (folder / name).symlink_to(program)
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folder


def test_a_missing_compiler_is_reported_with_the_packages_to_install(
    bin_without_compiler: Path,
) -> None:
    packages = r"apt-get install g\+\+ libliggghts-dev libopenmpi-dev"
    with pytest.raises(failures.ContactModelMissing, match=packages):
        plugin_of(find_engine())


def test_a_contact_model_that_cannot_be_compiled_is_reported(
    bin_without_compiler: Path, tmp_path: Path
) -> None:
    """In the words of the compiler; nothing stays in the cache."""
    compiler = bin_without_compiler / "g++"
    compiler.write_text("#!/bin/sh\necho 'bridge.cpp:1: error: no such thing' >&2\nexit 1\n")
    compiler.chmod(0o755)
    with pytest.raises(failures.ContactModelMissing, match=r"the compiler says: .*no such thing"):
        plugin_of(find_engine())
    assert not list((tmp_path / "cache").rglob("*.so"))


def test_another_version_of_the_forces_is_another_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other changes of the sources are not."""
    shutil.copytree(model_sources.SOURCES, tmp_path / "engine")
    monkeypatch.setattr(model_sources, "SOURCES", tmp_path / "engine")
    before = find_engine()
    source = tmp_path / "engine" / "bridge.cpp"
    text = source.read_text()
    source.write_text(f"{text}// another line\n")
    assert find_engine() == before
    source.write_text(re.sub(r"(FORCES_VERSION) \d+", r"\1 0", text))
    assert find_engine() != before


# --- files of the cache that others can write -----------------------------------------------------


NOBODY = 65534


def _replace_by_a_link(model: Path) -> None:
    model.symlink_to(model.rename(model.with_name("other.so")))


def _record_other_sources(model: Path) -> None:
    """Change the checksum of the sources from which the model was compiled."""
    record = model.with_suffix(".json")
    checksum = f'"compiled_from": "{"0" * 64}'
    record.write_text(re.sub('"compiled_from": "\\w+', checksum, record.read_text()))


UNTRUSTED: dict[str, Callable[[Path], object]] = {
    "planted": lambda model: model.write_bytes(model.read_bytes() + b"planted"),
    "cut": lambda model: os.truncate(model, 5000),
    "a symbolic link": _replace_by_a_link,
    "of another user": lambda model: os.chown(model, NOBODY, NOBODY),
    "writable by the group": lambda model: model.chmod(0o775),
    "without a checksum": lambda model: model.with_suffix(".json").unlink(),
    "a checksum that others can write": lambda model: model.with_suffix(".json").chmod(0o666),
    "compiled from something else": _record_other_sources,
    "in a folder that others can write": lambda model: model.parent.chmod(0o777),
}
"""How a contact model in the cache can be another than the one that was compiled."""


@pytest.fixture
def small_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A contact model in a cache of the test, of sources that take a tenth of a second."""
    if os.geteuid():
        pytest.skip("only root can give files away")
    sources = tmp_path / "engine"
    sources.mkdir()
    shutil.copy(model_sources.SOURCES / "bridge.map", sources)
    (sources / "bridge.cpp").write_text("// FORCES_VERSION 1\nint small = 1;\n")
    monkeypatch.setattr(model_sources, "SOURCES", sources)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return plugin_of(find_engine())


def test_a_contact_model_of_the_cache_is_not_compiled_again(small_model: Path) -> None:
    before = small_model.stat().st_mtime_ns
    assert plugin_of(find_engine()) == small_model
    assert small_model.stat().st_mtime_ns == before


@pytest.mark.parametrize("name", UNTRUSTED)
def test_a_contact_model_that_may_not_be_the_compiled_is_compiled_anew(
    name: str, small_model: Path
) -> None:
    """And then belongs to the user, in a folder that nobody else can write."""
    contents = small_model.read_bytes()
    before = small_model.stat().st_mtime_ns
    UNTRUSTED[name](small_model)
    assert plugin_of(find_engine()) == small_model
    about = small_model.lstat()
    assert small_model.read_bytes() == contents
    assert about.st_mtime_ns != before
    assert about.st_uid == os.geteuid()
    assert about.st_mode & 0o022 == 0
    assert small_model.parent.stat().st_mode & 0o022 == 0


def test_a_contact_model_is_not_compiled_into_a_cache_of_another_user(small_model: Path) -> None:
    os.chown(small_model.parent, NOBODY, NOBODY)
    with pytest.raises(
        failures.ContactModelMissing, match=r"belongs to another user.*set XDG_CACHE_HOME"
    ):
        plugin_of(find_engine())


def _double(file: Path) -> None:
    """Double the numbers of a file of the cache, with the right checksum."""
    numbers = 2.0 * np.frombuffer(file.read_bytes()[32:])
    checksum = hashlib.sha256(file.stem.encode() + numbers.tobytes()).digest()
    file.write_bytes(checksum + numbers.tobytes())


def _folder_of_another_user(file: Path) -> None:
    os.chown(file.parent, NOBODY, NOBODY)
    os.chown(file, NOBODY, NOBODY)


def _link_of_another_user(file: Path) -> None:
    elsewhere = file.parent.rename(file.parents[1] / "elsewhere")
    file.parent.symlink_to(elsewhere)
    os.chown(file.parent, NOBODY, NOBODY, follow_symlinks=False)


PLANTED: dict[str, Callable[[Path], object]] = {
    "a file of another user": lambda file: os.chown(file, NOBODY, NOBODY),
    "a file that others can write": lambda file: file.chmod(0o666),
    "a folder that others can write": lambda file: file.parent.chmod(0o777),
    "a folder of another user": _folder_of_another_user,
    "a link of another user": _link_of_another_user,
    "a cache that others can write": lambda file: file.parents[1].chmod(0o777),
    "a cache of another user": lambda file: os.chown(file.parents[1], NOBODY, NOBODY),
}
"""How the numbers in a file of the cache can be those of another user."""


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache without contents, and a solver that has forgotten its solutions."""
    if os.geteuid():
        pytest.skip("only root can give files away")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    young_laplace._solved.cache_clear()
    return tmp_path / "cache" / "granular-walkers"


def _force_at_contact() -> float:
    """Capillary force of a bead on a substrate at contact, in units of R γ."""
    young_laplace._solved.cache_clear()
    _, force = young_laplace._solved((math.inf, 0.01, 0.0))
    return float(force(1.0))


@pytest.mark.parametrize("name", PLANTED)
def test_capillary_forces_that_another_user_wrote_are_not_believed(
    name: str, empty_cache: Path
) -> None:
    """They are computed again. A bridge at contact pulls a little less than 4 π R γ."""
    force = _force_at_contact()
    assert 9.0 < force < 4.0 * math.pi
    (file,) = empty_cache.glob("young-laplace/*.bin")
    _double(file)
    assert _force_at_contact() == 2.0 * force, "numbers of the user are read"
    PLANTED[name](file)
    assert _force_at_contact() == force


@pytest.mark.parametrize("name", PLANTED)
def test_capillary_forces_that_are_computed_again_are_kept(name: str, empty_cache: Path) -> None:
    """Unless the whole cache belongs to another user, to whom it is left."""
    force = _force_at_contact()
    (file,) = empty_cache.glob("young-laplace/*.bin")
    PLANTED[name](file)
    assert _force_at_contact() == force
    is_foreign = name == "a cache of another user"
    assert is_trusted(file) != is_foreign
    assert _force_at_contact() == force
    assert (empty_cache.stat().st_uid == NOBODY) == is_foreign


PASSED: dict[str, Any] = {
    "passed": True,
    "lines": 80,
    "failures": [],
    "date": "2026-01-01T00:00:00Z",
}
"""An audit of an engine."""


@pytest.mark.parametrize("name", PLANTED)
def test_audits_that_another_user_wrote_are_not_believed(name: str, empty_cache: Path) -> None:
    audit.write_audit("engine", {"contact_model": "0" * 64, **PASSED})
    assert audit.read_audit("engine", None) == PASSED
    (file,) = empty_cache.glob("audits/*.json")
    PLANTED[name](file)
    assert audit.read_audit("engine", None) is None


def test_an_audit_is_kept_whatever_files_others_of_the_group_may_write(empty_cache: Path) -> None:
    before = os.umask(0o002)
    try:
        audit.write_audit("engine", {"contact_model": "0", **PASSED})
    finally:
        os.umask(before)
    assert audit.read_audit("engine", "0") is not None


# --- decks and engines that fail ------------------------------------------------------------------


Front = Callable[[str], str]


def _unchanged(text: str) -> str:
    return text


def _launch(
    case: Case,
    out: Path,
    change: Callable[[str], str] = _unchanged,
    *,
    engine: str | None = None,
    time_limit: float | None = None,
    bounds: dict[str, float] | None = None,
) -> None:
    """Make a run whose deck is changed, perhaps with other bounds of the engine.

    ``bounds`` are fields of `Deck`: seconds of silence and bytes of the log after which it is
    ended.
    """

    def render(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return replace(deck, text=change(deck.text), **(bounds or {}))  # type: ignore[arg-type]

    with open_run(case, find_engine(engine), out) as run:
        run.make(render=render, time_limit=time_limit)


def _reason(out: Path) -> str:
    """Why a run failed, as the one unfinished directory says that it leaves."""
    (unfinished,) = out.glob("*.incomplete")
    assert not list(out.glob("*/manifest.json"))
    return str(json.loads((unfinished / "failure.json").read_text())["reason"])


def _misspelt(text: str) -> str:
    """A deck with an unknown command, of bytes that are no UTF-8."""
    return re.sub("run  ", "w\udcff\udcfebble  ", text)


def _half(text: str) -> str:
    """A deck of half as many steps and cycles."""
    return re.sub(
        r"(?m)^(run +|variable +cycles string )(\d+)",
        lambda match: f"{match[1]}{int(match[2]) // 2}",
        text,
    )


def _narrow(text: str) -> str:
    """A box whose wall stands half a millimetre ahead of the walker."""
    start = re.findall(r"create_atoms +1 single (\S+)", text)[0]
    return re.sub(r"(region +box block \S+) \S+", r"\1 0.0010", text).replace(start, "0.0005")


def _infinite(text: str) -> str:
    """A deck with a force that becomes infinity minus infinity after 300 steps."""
    force = "variable bad equal (step>300)*(1e308*100-1e308*100)\nfix bad all addforce v_bad 0 0"
    return re.sub("fix +motion", f"{force}\nfix motion", text)


@dataclass(frozen=True)
class BadDeck:
    """A change of a deck, and the failure to which it leads.

    Attributes
    ----------
    change
        Changes the text of the deck.
    failure, message
        The kind of the failure, and a pattern of what it says.
    tables
        Tables of the case.
    """

    change: Callable[[str], str]
    failure: type[failures.EngineFailure]
    message: str
    tables: dict[str, dict[str, Any]] = field(default_factory=lambda: {"run": SHORT})


FAST = {"drive": {"peak_acceleration": "8 g"}, "run": {"cycles": 60, "settling_cycles": 2}}
BAD_DECKS = {
    "an error": BadDeck(_misspelt, failures.EngineError, r"Unknown command: w\\xff\\xfebble"),
    # Six cycles of ten samples and the start are 61.
    "half of the steps": BadDeck(_half, failures.MissingFrames, "31 of 61 frames"),
    "beads that are lost": BadDeck(
        _narrow, failures.BeadsLost, "left the simulation box", tables=FAST
    ),
    "no numbers": BadDeck(_infinite, failures.BlowUp, "not a number"),
}


def _assert_failed(out: Path, failure: failures.EngineFailure) -> None:
    """A failure names the directory of its segment, is remembered, and leaves no engine."""
    assert failure.directory == next(out.glob("*.incomplete/segments/0000.new"))
    assert _reason(out) == type(failure).__name__
    assert not engines_in(out)


@pytest.mark.parametrize("name", BAD_DECKS)
def test_decks_that_fail(tmp_path: Path, name: str) -> None:
    deck = BAD_DECKS[name]
    with pytest.raises(deck.failure, match=deck.message) as caught:
        _launch(make_case(**deck.tables), tmp_path, deck.change)
    assert type(caught.value) is deck.failure
    _assert_failed(tmp_path, caught.value)


def test_a_run_that_takes_too_long_fails(tmp_path: Path) -> None:
    with pytest.raises(failures.TimeLimitExceeded, match=r"0\.6 s") as caught:
        _launch(make_case(run=LONG), tmp_path, time_limit=0.6)
    _assert_failed(tmp_path, caught.value)


@dataclass(frozen=True)
class StrangeEngine:
    """An engine that is a shell script, and the failure to which it leads.

    Attributes
    ----------
    script
        What is called instead of ``liggghts``.
    failure, message
        The kind of the failure, and a pattern of what it says.
    silence
        Seconds without a word after which it is ended. An engine starts within seconds even on a
        busy machine.
    """

    script: str
    failure: type[failures.EngineFailure]
    message: str
    silence: float = 60.0


STRANGE_ENGINES = {
    "another version": StrangeEngine(
        'liggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"',
        failures.OtherEngine,
        r"4\.0\.0.*3\.8\.0",
    ),
    "crashes": StrangeEngine("kill -SEGV $$", failures.EngineKilled, "SIGSEGV"),
    "is killed": StrangeEngine(
        'liggghts "$@" & sleep 0.3; kill -KILL $$', failures.EngineKilled, "SIGKILL"
    ),
    "cuts a dump": StrangeEngine(
        'liggghts "$@" && truncate -s -5 bridges.pairs.txt',
        failures.MissingFrames,
        r"wrote \d+ of",
    ),
    "ends without a word": StrangeEngine(
        "exit 7", failures.EngineFailure, "exit status 7, without output"
    ),
    # It does not care for SIGTERM.
    "says nothing": StrangeEngine(
        "trap '' TERM; while :; do sleep 0.1; done",
        failures.EngineSilent,
        r"nothing for 0\.5 s after step 0 of \d+",
        silence=0.5,
    ),
    "stops saying anything": StrangeEngine(
        "liggghts -log none -in walker.lig; exec sleep 4711",
        failures.EngineSilent,
        r"step (\d+) of \1;",
        silence=4.0,
    ),
    "writes lines without end": StrangeEngine(
        "trap '' TERM; yes | tee -i /dev/null", failures.LogTooLong, "beyond 2 MB"
    ),
    "ends after too long a log": StrangeEngine(
        'yes | head -c 2100000; exec liggghts "$@"', failures.LogTooLong, "beyond 2 MB"
    ),
}


@pytest.mark.parametrize("name", STRANGE_ENGINES)
def test_strange_engines_are_ended_and_reported(front: Front, tmp_path: Path, name: str) -> None:
    strange = STRANGE_ENGINES[name]
    with pytest.raises(strange.failure, match=strange.message) as caught:
        _launch(
            make_case(run=SHORT),
            tmp_path / "runs",
            engine=front(strange.script),
            time_limit=PATIENCE,
            bounds={"silence": strange.silence, "log_limit": 2e6},
        )
    assert "last line" not in str(caught.value)
    wait_for(lambda: not processes_in(tmp_path))
    assert _reason(tmp_path / "runs") == type(caught.value).__name__
    (log,) = tmp_path.glob("runs/*/segments/*/engine.log")
    assert log.stat().st_size <= 2_000_000


UNSTABLE = {
    "liquid": {"name": "glycerol 87 %"},
    "run": {
        "time_step": "30 us",
        "allow_unstable": True,
        "samples_per_cycle": 1,
        "cycles": 60,
        "settling_cycles": 2,
    },
}
"""Of a walker that blows up: the liquid is viscous, the time step is long."""


def test_a_failed_run_is_remembered_when_the_spread_of_the_next_one_succeeds(
    in_folder: Path,
) -> None:
    """In the exit status."""
    guessed = {"contact": {"restitution": 0.3}, "uncertain": {"contact.restitution": [0.2, 0.4]}}
    (in_folder / "hot.toml").write_text(to_toml(document(**UNSTABLE, **guessed)))
    (in_folder / "good.toml").write_text(to_toml(document(run=SHORT, **guessed)))
    spread = ("--spread", "--points", "2")
    done = call("run", "hot.toml", "good.toml", *spread, "--json")
    assert done.returncode == 1
    assert "walkers: hot: blow-up" in done.stderr
    (line,) = done.stdout.splitlines()
    printed = json.loads(line)
    assert printed["case"] == "good"
    assert "spread" in printed
    assert call("run", "good.toml", *spread).returncode == 0


def _engine_that_fails_to_start(front: Front, times: int, starts: Path) -> str:
    """An engine that writes a line into a file at each start, of which the first ones fail.

    It cannot initialise MPI, for it asks for a component that there is not.
    """
    return front(f"""
        echo start >> "{starts}"
        [ $(wc -l < "{starts}") -le {times} ] && export OMPI_MCA_coll=none-such
        exec liggghts "$@"
    """)


def test_an_engine_that_never_started_is_tried_twice_again(front: Front, tmp_path: Path) -> None:
    """The third start is a good one."""
    starts = tmp_path / "starts"
    engine = _engine_that_fails_to_start(front, 2, starts)
    run = run_case(make_case(run=SHORT), tmp_path / "runs", engine=engine)
    assert run.result["velocity"] > 0.0
    assert starts.read_text() == "start\n" * 3


def test_an_engine_that_never_started_three_times_is_reported(front: Front, tmp_path: Path) -> None:
    starts = tmp_path / "starts"
    engine = _engine_that_fails_to_start(front, 99, starts)
    with pytest.raises(EngineNeverStarted, match="never started: exit status"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=engine)
    assert starts.read_text() == "start\n" * 3


def _log_of(deck: Deck, rows: list[tuple[int, int, float]], log: Path) -> None:
    """Write a log of an engine; a row is a step, the number of lost beads and a speed in m/s."""
    lines = ["LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)"]
    for step, lost_beads, speed in rows:
        beads = deck.layout.atoms - lost_beads
        lines.append(f" {step} {beads} {speed} -1e-3 1e-3 -1e-3 1e-3 0 1e-3")
    log.write_text("\n".join([*lines, ""]))


@pytest.mark.parametrize(
    ("rows", "failure", "message"),
    [
        pytest.param(
            [(100, 0, 0.01), (100, 1, 0.01)],
            failures.EngineFailure,
            "bead",
            id="a step that is printed twice",
        ),
        pytest.param(
            [(100, 0, 0.01), (200, 0, 1000.0), (300, 0, 0.01)],
            failures.BlowUp,
            r"moves at 1e\+03 m/s after step 200",
            id="a calm line after a failure",
        ),
    ],
)
def test_lines_of_a_log_are_judged(
    rows: list[tuple[int, int, float]],
    failure: type[failures.EngineFailure],
    message: str,
    tmp_path: Path,
) -> None:
    """All lines, though they are read in one look."""
    case = make_case(run=SHORT)
    deck = render_deck(case, single_segment(case))
    log = tmp_path / "engine.log"
    _log_of(deck, rows, log)
    with pytest.raises(failure, match=message):
        judge(deck, tmp_path, log)


# --- the environment of the user ------------------------------------------------------------------


MPI_SETTINGS = {
    "OMPI_MCA_btl": "tcp",
    "OMPI_MCA_pml": "cm",
    "OMPI_MCA_mtl": "no",
    "OMPI_MCA_rmaps": "no",
    "OMPI_MCA_oob": "no",
    "OMPI_MCA_ess": "singleton",
    "OMPI_MCA_orte_default_hostfile": "/none",
}
"""Settings of Open MPI as for a cluster; none of them works on one machine."""
NOT_THERE = {"LD_PRELOAD": "/no/such/library.so", "TMPDIR": "/proc"}
"""A library and a folder for temporary files that do not exist."""


def _set_all(monkeypatch: pytest.MonkeyPatch, variables: dict[str, str]) -> None:
    """Set variables of the environment once the contact model is compiled.

    Its compiler needs temporary files.
    """
    plugin_of(find_engine())
    for variable, value in variables.items():
        monkeypatch.setenv(variable, value)
    monkeypatch.setattr(tempfile, "tempdir", None)  # Python, too, looks at TMPDIR again


@pytest.mark.parametrize(
    "variables",
    [
        pytest.param(MPI_SETTINGS, id="settings of Open MPI"),
        pytest.param(NOT_THERE, id="what is not there"),
    ],
)
def test_what_a_user_has_set_in_the_environment_does_not_matter(
    variables: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _set_all(monkeypatch, variables)
    assert not run_case(make_case(run=SHORT), tmp_path).cached


def test_an_engine_leaves_nothing_in_the_folder_for_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Open MPI 5 would leave a folder of each start."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    _set_all(monkeypatch, {"TMPDIR": str(folder)})
    assert not run_case(make_case(run=SHORT), tmp_path / "runs").cached
    assert not list(folder.iterdir())


def test_what_a_user_has_set_for_mpi_does_not_matter_to_several_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _set_all(monkeypatch, MPI_SETTINGS)
    pile = brief_pile(ranks=2, duration="0.006 s", longest_settling="0 s")
    assert not run_case(pile, tmp_path, time_limit=PATIENCE).cached


def test_tables_of_an_edited_deck_have_decimal_points_in_any_language(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine calls awk, which would write the decimal commas of the user's language."""
    (in_folder / "bin").mkdir()
    awk = in_folder / "bin" / "awk"
    awk.write_text(
        f'#!/bin/sh\necho "$LC_ALL" >> {in_folder}/language\nexec {shutil.which("awk")} "$@"\n'
    )
    awk.chmod(0o755)
    monkeypatch.setenv("PATH", f"{in_folder}/bin:{os.environ['PATH']}")
    monkeypatch.setenv("LC_ALL", "de_DE.UTF-8")
    call("export", _case_file(in_folder, SHORT), "--format", "deck", "-o", "deck", check=True)
    deck = in_folder / "deck" / "walker.lig"
    deck.write_text(re.sub(r"(variable +viscosity string) \S+", r"\1 0.01", deck.read_text()))
    subprocess.run(["sh", "run.sh"], cwd=deck.parent, check=True)
    assert (in_folder / "language").read_text() == "C\n"
