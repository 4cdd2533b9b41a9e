"""Run directories: named by what determines them, finished by their manifest only."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import (
    LONG,
    PROGRAM,
    SHORT,
    call,
    document,
    engines_in,
    make_case,
    to_toml,
    wait_for,
)
from walkers import find_run
from walkers import run as run_case
from walkers.inputs import InputError
from walkers.runner import FinishedRun, Progress, find_engine, finished_run, open_run, run_name
from walkers.runner.directory import FIRST_SEGMENT
from walkers.runner.failures import RunBusy
from walkers.templates import render_deck


def _name(**changes: object) -> str:
    return run_name(make_case(**changes), find_engine())


def test_a_finished_run_is_run_again_by_force_only(tmp_path: Path) -> None:
    case = make_case(run=SHORT)
    first = run_case(case, tmp_path)
    again = run_case(case, tmp_path)
    assert (first.cached, again.cached) == (False, True)
    assert again.result == first.result
    dump = first.directory / FIRST_SEGMENT / "beads.bin"
    with dump.open("rb") as before:  # as long as it is open no other file gets its number
        assert os.path.samestat(os.fstat(before.fileno()), dump.stat())
        assert not run_case(case, tmp_path, force=True).cached
        assert not os.path.samestat(os.fstat(before.fileno()), dump.stat())
    assert [path.name for path in tmp_path.iterdir()] == [first.directory.name]


def test_a_forced_run_that_fails_leaves_the_old_one(tmp_path: Path) -> None:
    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    case = make_case(run=SHORT)
    run_case(case, tmp_path)
    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path, force=True, progress=interrupt)
    assert run_case(case, tmp_path).cached


def test_an_interrupted_run_goes_on_after_its_last_whole_segment(tmp_path: Path) -> None:
    """Walkers of six cycles in segments of two; what comes out is what a run without an interrupt gives."""
    case = make_case(run={**SHORT, "segment": "25 ms"})
    two_cycles = case.run.steps // 3

    def interrupt(progress: Progress) -> None:
        if progress.step > two_cycles:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path, progress=interrupt)
    (part,) = tmp_path.glob("*.incomplete")
    *whole, begun = sorted(part.glob("segments/*"))
    assert whole
    assert begun.suffix == ".new"
    for folder in (part, begun):
        (folder / "leftover").touch()
    node = (part / FIRST_SEGMENT / "beads.bin").stat().st_ino
    outcome = run_case(case, tmp_path)
    assert not outcome.cached
    assert not part.exists()
    assert not list(outcome.directory.rglob("leftover"))
    assert (outcome.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == node
    straight = run_case(case, tmp_path / "straight")
    segments = [sorted(run.directory.glob("segments/*/beads.bin")) for run in (outcome, straight)]
    assert [len(dumps) for dumps in segments] == [3, 3]
    for one, other in zip(*segments, strict=True):
        assert one.read_bytes() == other.read_bytes()
    assert outcome.result == straight.result


def test_the_name_depends_on_what_determines_the_run() -> None:
    names = {
        _name(),
        _name(drive={"peak_acceleration": "4.01 g"}),
        _name(run={"seed": 2}),
        _name(contact={"rolling_friction": 0.001}),
        _name(run={"cycles": 61}),
        _name(drive={"frame": "lab"}),
    }
    assert len(names) == 6
    assert _name(title="another title") == _name()
    other = replace(find_engine(), sha256="0" * 64)
    assert run_name(make_case(), other) != _name()
    long = run_name(make_case().renamed("a b/" * 100), other)
    assert len(long) < 100
    assert "/" not in long


def test_contents_of_a_run_directory(tmp_path: Path) -> None:
    case = make_case(run=SHORT)
    run = finished_run(run_case(case, tmp_path).directory)
    assert run is not None
    assert {path.name for path in run.directory.iterdir()} == {
        *("case.json", "manifest.json", "result.json", "segments"),
        *("trajectory.parquet", "walkers.parquet", "bridges.parquet"),
    }
    assert {path.name for path in (run.directory / "segments").iterdir()} == {"0000"}
    assert {path.name for path in (run.directory / FIRST_SEGMENT).iterdir()} == {
        *("layout.json", "walker.lig", "bridges.txt", "engine.log", "segment.json", "run.sh"),
        *("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"),
    }
    assert run.case == case
    assert run.layout == render_deck(case).layout
    manifest = run.manifest
    assert manifest["status"] == "finished"
    assert manifest["steps"] == case.run.steps
    assert manifest["steps_per_second"] > 0
    assert manifest["engine"]["sha256"] == find_engine().sha256
    assert {"host", "started", "finished", "seconds"} <= set(manifest)


def test_the_deck_of_a_run_can_be_run_by_hand(tmp_path: Path) -> None:
    made = run_case(make_case(run=SHORT), tmp_path / "runs")
    call("deck", _toml(tmp_path), "--to", str(tmp_path / "byhand"), check=True)
    by_hand = tmp_path / "byhand"
    subprocess.run(["sh", "run.sh"], cwd=by_hand, check=True)
    assert (by_hand / "beads.bin").read_bytes() == (made.directory / FIRST_SEGMENT / "beads.bin").read_bytes()


def _toml(folder: Path) -> str:
    file = folder / "test.toml"
    file.write_text(to_toml(document(run=SHORT)))
    return str(file)


def test_an_engine_that_outlives_its_launcher_keeps_others_away(
    front: Callable[[str], str], in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel ends an engine whose launcher dies, but not the engine's own children."""
    monkeypatch.setattr("walkers.runner.locks._PATIENCE_SECONDS", 0.5)
    (in_folder / "test.toml").write_text(to_toml(document(run=LONG)))
    engine = front('liggghts "$@"\nexit 0')
    program = subprocess.Popen([PROGRAM, "run", "test.toml", "--engine", engine], stderr=subprocess.DEVNULL)
    begun = "runs/*.incomplete/segments/0000.new/beads.bin"
    wait_for(lambda: program.poll() is not None or list(in_folder.glob(begun)))
    assert program.poll() is None
    program.kill()
    program.wait()
    case = make_case(run=LONG).renamed("test")
    try:
        with pytest.raises(RunBusy):
            run_case(case, in_folder / "runs", engine=engine)
    finally:
        for orphan in engines_in(in_folder):
            os.kill(orphan, signal.SIGKILL)
    with open_run(case, find_engine(engine), in_folder / "runs"):
        pass


def test_a_run_is_found_by_its_directory_or_its_case(in_folder: Path) -> None:
    case_file = _toml(in_folder)
    first, second = (json.loads(call("run", case_file, "--json", check=True).stdout) for _ in range(2))
    assert (first["cached"], second["cached"]) == (False, True)
    assert first["velocity"] == second["velocity"]
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert find_run(named).directory == Path(first["run"])
        assert f"{first['velocity']['mean'] * 1e3:.3f}" in call("result", str(named), check=True).stdout


def test_a_run_that_somebody_else_finished_meanwhile_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = make_case(run=SHORT)
    stamp = FinishedRun(run_case(case, tmp_path).directory).manifest["finished"]
    # It is not there at the first look, but at the second, after the run has been locked.
    answers = iter([None])
    monkeypatch.setattr("walkers.pipeline.finished_run", lambda place: next(answers, finished_run(place)))
    outcome = run_case(case, tmp_path)
    assert outcome.cached
    assert not list(answers)  # the first look has been
    assert FinishedRun(outcome.directory).manifest["finished"] == stamp
    assert not list(tmp_path.glob("*.incomplete"))


@pytest.mark.parametrize("damage", ["result.json", "walkers.parquet", "bridges.parquet", "trajectory.parquet"])
def test_damaged_tables_are_made_anew(tmp_path: Path, damage: str) -> None:
    case = make_case(run=SHORT)
    outcome = run_case(case, tmp_path)
    result, path = outcome.result, outcome.directory / damage
    for contents in (None, b"", b"{", b"[]"):
        path.unlink()
        if contents is not None:
            path.write_bytes(contents)
        assert run_case(case, tmp_path).result == result
        find_run(outcome.directory)
        assert path.stat().st_size > 100


@pytest.mark.parametrize("name", ["manifest.json", "case.json", "segments/0000/layout.json", "segments/0000/beads.bin"])
def test_a_run_without_its_description_is_told(tmp_path: Path, name: str) -> None:
    directory = run_case(make_case(run=SHORT), tmp_path / "runs").directory
    (directory / name).unlink()
    with pytest.raises(InputError, match=Path(name).name if name != "manifest.json" else "not a finished run"):
        find_run(directory)


def test_a_cut_dump_is_drawn_as_far_as_it_goes(tmp_path: Path) -> None:
    directory = run_case(make_case(run={"cycles": 8, "settling_cycles": 2}), tmp_path / "runs").directory
    dump = directory / FIRST_SEGMENT / "beads.bin"
    dump.write_bytes(dump.read_bytes()[: dump.stat().st_size // 2])
    for command in ("plot", "vtk", "result"):
        done = call(command, str(directory), check=True)
        assert "walkers: warning:" in done.stderr
        assert "is incomplete" in done.stderr
    dump.write_bytes(dump.read_bytes()[:1000])
    (directory / "result.json").unlink()
    done = call("plot", str(directory))
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert f"walkers: {directory}: the run cannot be read" in done.stderr


@pytest.mark.parametrize(
    "arguments", [["run", "test.toml", "--out", "test.toml/x"], ["run", "test.toml", "--out", "/proc/x"]]
)
def test_places_that_cannot_be_written(in_folder: Path, arguments: list[str]) -> None:
    _toml(in_folder)
    done = call(*arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("walkers: ")
