"""Runs and sweeps of a folder: listed and removed; values of their cases as text."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import call, document, to_toml
from walkers.runner.directory import finished_places, locked
from walkers.runner.files import read_json, write_json
from walkers.sweeps.readable import chosen, flattened, readable

OTHER, FASTER = {"liquid.name": "Si AK10"}, {"drive.frequency": "90 Hz"}
SHORTEST = {"time_step": "2 us", "cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5}


@pytest.fixture
def out(looked_through: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the folder, as ``runs`` of the current one, with the case of its sweeps."""
    shutil.copytree(looked_through, tmp_path / "runs")
    shutil.copy(looked_through.parent / "base.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    yield Path("runs")


def _listed(*arguments: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads(call("list", "--json", "--all", *arguments, check=True).stdout)
    return rows


def _unfinished(name: str, *, failed: bool) -> Path:
    """What is left of a run that failed, or was killed: the same without a word on a failure."""
    Path(f"{name}.toml").write_text(to_toml(document(run={**SHORTEST, "cycles": 4000})))
    assert call("run", f"{name}.toml", "--limit", "0.01").returncode == 1
    (left,) = Path("runs").glob(f"{name}-*.incomplete")
    if not failed:
        (left / "failure.json").unlink()
    return left


def test_list_has_all_runs_and_sweeps_with_their_results(out: Path) -> None:
    failed, interrupted = (_unfinished(name, failed=name == "slow") for name in ("slow", "killed"))
    rows = _listed()
    (sweep,) = (row for row in rows if row["name"] == "three")
    assert sweep["varies"] == {"contact.friction.bead_wall": 2, "drive.frequency": 2, "drive.peak_acceleration": 3}
    assert sweep["points"] == {"finished": 12}
    runs = {row["name"]: row for row in rows if row["kind"] == "run"}
    slow, killed = (path.name.removesuffix(".incomplete") for path in (failed, interrupted))
    assert runs.keys() == finished_places(out).keys() | {slow, killed}
    for _, point in walkers.load(out / "three").table().iterrows():
        row, files = runs[Path(point["run"]).name], [path for path in Path(point["run"]).rglob("*") if path.is_file()]
        expected = ("finished", point["velocity"], sum(path.stat().st_size for path in files))
        assert (row["status"], row["velocity"], row["size"]) == expected
    assert (runs[slow]["status"], runs[slow]["reason"]) == ("failed", "TimeLimitExceeded")
    assert runs[killed]["status"] == "interrupted"
    with locked([out / killed]):
        assert [row["directory"] for row in _listed() if row["status"] == "running"] == [str(interrupted)]
    # It reads neither dumps nor tables.
    for path in [path for pattern in ("*.bin", "*.parquet", "*.txt") for path in out.rglob(pattern)]:
        path.unlink()
    again = {row["name"]: row for row in _listed()}
    assert [again[row["name"]]["numbers"] for row in rows] == [row["numbers"] for row in rows]


def test_list_selects_by_values_and_has_a_column_for_each_that_differs(out: Path) -> None:
    runs = _listed("--where", "drive.frequency=0.08 kHz", "--where", "bead_wall=0.1", "--where", "radii=0.3/0.2 mm")
    assert {row["varies"]["drive.peak_acceleration"] for row in runs} == {19.6, 39.2, 58.8}
    head, *lines = call("list", "--where", "bead_wall=0.2", check=True).stdout.splitlines()
    assert head.split() == ["base", "(6)", "status", "result", "age", "size", "frequency", "peak_acceleration"]
    assert all("mm/s" in line and " Hz " in line for line in lines[:6])
    # Runs of sweeps are hidden, but not a run with a spread.
    run = Path(walkers.load(out / "grid").table()["run"][0]).name
    assert run not in call("list", check=True).stdout
    shutil.copytree(out / "rough", out / f"{run}-spread")
    assert f"\n{run}  finished" in call("list", check=True).stdout


def test_a_resting_walker_is_called_so_everywhere(out: Path) -> None:
    Path("rest.toml").write_text('case = "base.toml"\n[axes]\ndrive.peak_acceleration = ["0.2 g", "0.3 g"]\n')
    call("sweep", "rest.toml", check=True)
    table = walkers.load(out / "rest").table()
    assert (table["velocity"].abs() > 0.0).all()
    assert ": at rest" in call("run", table["run"][0], check=True).stdout
    assert call("list", "--all", check=True).stdout.count(" at rest ") == 2
    assert repr(walkers.load(table["run"][0])) == f"Run({table['run'][0]}: finished, at rest)"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 99}, "its format is 99, expected 4); run the sweep again: finished runs are kept"),
        ({"runs": ["base-0123456789ab"]}, "1 runs, expected the names of 6"),
        ({"base": None}, "cannot be read"),
        ({"file": {"case": "base", "axes": {"drive.frequncy": [1]}}}, 'did you mean "frequency"'),
    ],
)
def test_a_sweep_of_another_format_is_refused(out: Path, change: dict[str, Any], message: str) -> None:
    write_json(out / "grid" / "sweep.json", {**read_json(out / "grid" / "sweep.json"), **change})
    for command in ("list grid", "clean rough --yes"):
        done = call(*command.split())
        assert (done.returncode, message in done.stderr) == (2, True), done.stderr


def test_values_of_all_kinds_are_shown_as_they_can_be_written() -> None:
    for key, value in flattened(walkers.load_case("fig1b")).items():
        assert chosen([{key: value}], f"{key}={readable(key, value)}") == [True], key
    values = {"boundary.opening": 1.0, "environment.temperature": 293.15, "environment.gravity": 9.81}
    shown = [readable(key, value) for key, value in values.items()]
    assert shown == ["57.2958 deg", "293.15 K", "9.81 m/s^2"]
    assert readable("liquid.kinematic_viscosity", 5e-6) == "5 mm^2/s"


def test_clean_removes_leftovers_alone(out: Path) -> None:
    """No run in progress, and no folder of somebody else's unless it has in it what an unfinished run has."""
    failed, interrupted, held = (
        _unfinished(name, failed=failed) for name, failed in {"slow": True, "killed": False, "held": False}.items()
    )
    stale, lock, thesis = out / "gone-0123456789ab.lock", out / "poetry.lock", out / "thesis.incomplete"
    before = finished_places(out)
    thesis.mkdir()
    for path in (stale, lock, thesis / "chapter.txt"):
        path.touch()
    shutil.copy(next(iter(before.values())) / "case.json", thesis)
    with locked([out / held.name.removesuffix(".incomplete")]):
        refused = call("clean")  # where there is no terminal
        words = ("1 failed run", "1 interrupted run", "1 stale lock", "stays: 1 running")
        assert all(word in refused.stdout for word in words)
        assert (refused.returncode, "no terminal" in refused.stderr, failed.exists()) == (2, True, True)
        call("clean", "--yes", check=True)
    assert not any(path.exists() for path in (failed, interrupted, stale))
    assert all(path.exists() for path in (held, lock, thesis / "chapter.txt"))
    assert finished_places(out) == before


def test_clean_keeps_runs_that_other_sweeps_have(out: Path) -> None:
    """With a run go its spread and its accuracy: here runs that only the accuracy has, those of beads."""
    names = ("grid", "rough", "three", "beads")
    runs = {name: {Path(run).name for run in walkers.load(out / name).table()["run"]} for name in names}
    shutil.copytree(out / "rough", out / "renamed")
    before = finished_places(out)
    call("clean", "grid", "rough", "--yes", check=True)
    assert before.keys() == finished_places(out).keys()
    assert not any((out / name).exists() for name in ("grid", "rough"))
    one = sorted(runs["rough"] - runs["three"])[0]
    (out / "beads").rename(out / f"{one}-accuracy")
    shutil.copytree(out / "three", out / f"{one}-spread")
    shown = call("clean", str(finished_places(out)[one]), "--yes", check=True).stdout
    assert "needed by the sweep renamed, which would make them again: 1" in shown
    assert before.keys() - finished_places(out).keys() == (runs["beads"] - runs["three"] - runs["rough"]) | {one}
    assert not [*out.glob(f"{one}-*")]
    assert walkers.load(out / "renamed").table()["status"].tolist().count("missing") == 1
