"""Run directories: named by what determines them, finished by their manifest only, gone on with after any death."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import walkers
from tests.conftest import (
    BRIEF,
    LONG,
    PROGRAM,
    SHORT,
    call,
    document,
    engines_in,
    make_case,
    open_run,
    to_toml,
    wait_for,
)
from walkers import run as run_case
from walkers.errors import InputError
from walkers.runner.binary import find_engine
from walkers.runner.directory import (
    FIRST_SEGMENT,
    case_of,
    finished_places,
    is_finished,
    is_locked,
    layout_of,
    locked,
    run_place,
)
from walkers.runner.manifest import read_manifest
from walkers.sweeps.making import make_runs
from walkers.templates.deck import render_deck

PATIENCE_OF_LOCKS = "walkers.runner.directory._PATIENCE_SECONDS"


def _toml(folder: Path, **run: object) -> str:
    file = folder / "test.toml"
    file.write_text(to_toml(document(run=run or SHORT)))
    return str(file)


# --- what is there ----------------------------------------------------------------------------------------------------


def test_the_name_depends_on_what_determines_the_run() -> None:
    def name(**changes: object) -> str:
        return run_place(make_case(**changes), find_engine(), Path()).name

    names = {
        name(),
        name(drive={"peak_acceleration": "4.01 g"}),
        name(run={"seed": 2}),
        name(contact={"rolling_friction": 0.001}),
        name(run={"cycles": 61}),
        name(drive={"frame": "lab"}),
    }
    assert len(names) == 6
    assert name(title="another title") == name()
    other = replace(find_engine(), sha256="0" * 64)
    assert run_place(make_case(), other, Path()).name != name()
    long = run_place(make_case().but(name="a b/" * 100), other, Path()).name
    assert len(long) < 100
    assert "/" not in long


def test_contents_of_a_run_directory(tmp_path: Path) -> None:
    """And the deck can be run by hand, with the same numbers."""
    case = make_case(run=SHORT)
    run = run_case(case, tmp_path / "runs").directory
    assert is_finished(run)
    assert {path.name for path in run.iterdir()} == {
        *("case.json", "manifest.json", "result.json", "segments"),
        *("trajectory.parquet", "walkers.parquet", "bridges.parquet", "cycles.parquet"),
    }
    assert {path.name for path in (run / "segments").iterdir()} == {"0000"}
    assert {path.name for path in (run / FIRST_SEGMENT).iterdir()} == {
        *("layout.json", "walker.lig", "bridges.txt", "engine.log", "segment.json", "run.sh"),
        *("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"),
    }
    assert case_of(run) == case
    assert layout_of(run / FIRST_SEGMENT) == render_deck(case).layout
    manifest = read_manifest(run)
    assert (manifest["status"], manifest["steps"]) == ("finished", case.run.steps)
    assert manifest["steps_per_second"] > 0
    assert manifest["engine"]["sha256"] == find_engine().sha256
    assert {"host", "started", "finished", "seconds"} <= set(manifest)
    by_hand = tmp_path / "byhand"
    call("export", _toml(tmp_path), "--to", "deck", "-o", str(by_hand), check=True)
    subprocess.run(["sh", "run.sh"], cwd=by_hand, check=True)
    assert (by_hand / "beads.bin").read_bytes() == (run / FIRST_SEGMENT / "beads.bin").read_bytes()


def test_a_run_is_found_by_its_directory_its_name_or_its_case_with_other_values_too(in_folder: Path) -> None:
    case_file = _toml(in_folder)
    first, second = (json.loads(call("run", case_file, "--json", check=True).stdout) for _ in range(2))
    assert (first["cached"], second["cached"]) == (False, True)
    assert first["velocity"] == second["velocity"]
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named).directory == Path(first["run"])
        assert f"{first['velocity'] * 1e3:.3f}" in call("run", str(named), check=True).stdout
    setting = ("--set", "drive.frequency=70Hz")
    assert f"first do: walkers run {case_file} --set drive.frequency=70Hz" in call("plot", case_file, *setting).stderr
    slower = json.loads(call("run", first["run"], *setting, "--json", check=True).stdout)
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named, "runs", {"drive.frequency": "70 Hz"}).directory == Path(slower["run"])
        assert json.loads(call("run", named, *setting, "--json", check=True).stdout)["cached"]
        assert "70Hz" in call("show", named, *setting, check=True).stdout
    assert walkers.run(case_file, "runs").directory == walkers.run(first["run"]).directory == Path(first["run"])


def test_a_running_simulation_is_looked_at_stopped_and_continued(in_folder: Path) -> None:
    case_file = _toml(in_folder, **LONG)
    program = subprocess.Popen([PROGRAM, "run", case_file], stderr=subprocess.DEVNULL)
    wait_for(lambda: list(Path("runs").glob("*.incomplete/case.json")))
    (place,) = Path("runs").glob("*.lock")
    run = walkers.load(place.with_suffix(""))
    assert isinstance(run, walkers.Run)
    wait_for(lambda: run.progress and run.progress.share > 2 / run.case.run.cycles)
    assert (run.status, walkers.load(case_file).status, len(engines_in(in_folder))) == ("running", "running", 1)
    assert "running: " in call("list", check=True).stdout
    assert f"{run.directory}: the run is running: " in call("plot", case_file).stderr
    program.send_signal(signal.SIGINT)
    assert program.wait(30) == 130
    assert (run.status, run.progress, engines_in(in_folder)) == ("interrupted", None, [])
    refused = call("plot", f"{run.directory}.incomplete").stderr
    assert f"the run is interrupted; continue it with: walkers run {run.directory}" in refused
    stopped = call("run", str(run.directory), "--limit", "0.2")
    assert (stopped.returncode, "time limit of 0.2 s" in stopped.stderr) == (1, True)
    assert (run.status, "time limit of 0.2 s" in run.describe()) == ("failed", True)


def test_a_run_without_its_description_is_told(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    whole = run_directory(run=SHORT)
    for name in ("manifest.json", "case.json", "layout.json"):
        directory = Path(shutil.copytree(whole, tmp_path / name / whole.name))
        next(directory.rglob(name)).unlink()
        with pytest.raises(InputError, match="not a finished run" if name == "manifest.json" else name):
            walkers.load(directory)


def test_a_cut_dump_is_told_when_the_run_is_measured(tmp_path: Path) -> None:
    directory = run_case(make_case(run={"cycles": 8, "settling_cycles": 2}), tmp_path / "runs").directory
    os.truncate(directory / FIRST_SEGMENT / "beads.bin", 1000)
    (directory / "result.json").unlink()
    done = call("run", str(directory))
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert f"walkers: {directory}: the run cannot be read" in done.stderr


@pytest.mark.parametrize("out", ["test.toml/x", "/proc/x"])
def test_places_that_cannot_be_written(in_folder: Path, out: str) -> None:
    done = call("run", _toml(in_folder), "--out", out)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert done.stderr.startswith("walkers: ")


# --- again, and on ----------------------------------------------------------------------------------------------------


def test_a_finished_run_is_run_again_by_force_only(tmp_path: Path) -> None:
    """One by force that fails leaves the old one."""
    case = make_case(run=SHORT)
    first = run_case(case, tmp_path)
    again = run_case(case, tmp_path)
    assert (first.cached, again.cached) == (False, True)
    assert again.result == first.result
    dump = first.directory / FIRST_SEGMENT / "beads.bin"

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    with dump.open("rb") as before:  # as long as it is open no other file gets its number
        with pytest.raises(KeyboardInterrupt):
            make_runs([case], tmp_path, find_engine(), force=True, on_progress=interrupt)
        assert run_case(case, tmp_path).cached
        assert os.path.samestat(os.fstat(before.fileno()), dump.stat())
        contents = dump.read_bytes()
        assert not run_case(case, tmp_path, force=True).cached
        assert not os.path.samestat(os.fstat(before.fileno()), dump.stat())
    assert dump.read_bytes() == contents, "the same to the last bit"
    assert [path.name for path in tmp_path.iterdir()] == [first.directory.name]


def test_a_run_that_somebody_else_finished_meanwhile_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = make_case(run=SHORT)
    stamp = read_manifest(run_case(case, tmp_path).directory)["finished"]
    # It is not there at the first look, but at the second, after the run has been locked.
    answers = iter([False])
    monkeypatch.setattr("walkers.api.is_finished", lambda place: next(answers, is_finished(place)))
    outcome = run_case(case, tmp_path)
    assert outcome.cached
    assert not list(answers)  # the first look has been
    assert read_manifest(outcome.directory)["finished"] == stamp
    assert not list(tmp_path.glob("*.incomplete"))


def test_a_crash_within_a_replacement_leaves_no_trace(tmp_path: Path) -> None:
    """Between its two renames the old run is put back; after them it goes, and is no run meanwhile."""
    case = make_case(run=BRIEF)
    place = run_case(case, tmp_path).directory
    left = place.with_name(place.name + ".replaced")
    place.rename(left)
    with open_run(case, find_engine(), tmp_path):
        assert is_finished(place)
    shutil.copytree(place, left)
    assert finished_places(tmp_path) == {place.name: place}
    assert run_case(case, tmp_path).cached
    assert run_case(case, tmp_path, force=True).directory == place
    assert not left.exists()


# --- locks and kills --------------------------------------------------------------------------------------------------


def test_a_lock_that_somebody_has_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    with locked([tmp_path / "x"]) as ours, locked([tmp_path / "x", tmp_path / "y"]) as theirs:
        assert (list(ours), list(theirs)) == ([tmp_path / "x"], [tmp_path / "y"])
        assert is_locked(tmp_path / "x")
    assert not is_locked(tmp_path / "x")
    assert not list(tmp_path.iterdir())


def test_tables_are_run_as_their_file_is(tmp_path: Path, run_directory: Callable[..., Path]) -> None:
    found = walkers.run(document(run=SHORT), tmp_path)
    assert found.result["velocity"] == walkers.load(run_directory(run=SHORT)).result["velocity"]
    with pytest.raises(InputError, match=r"no finished run .*; first do: walkers run case --set run\.seed=3"):
        walkers.load(document(run=SHORT), tmp_path, {"run.seed": 3})
