"""Runs and sweeps of a folder: listed and removed; values of their cases as text."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import call, document, finished_places, make_case, mounted, to_toml
from walkers.runner.directory import locked
from walkers.runner.files import read_json, write_json
from walkers.sweeps.folder import weigh
from walkers.sweeps.readable import chosen, differing, flattened, readable

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
    shown = [repr(walkers.load(one)) for one in (table["run"][0], "rest")]
    assert shown == [f"Run({table['run'][0]}: finished, at rest)", "Sweep(rest: 2 points, 2 finished)"]
    head, *rows = call("list", "rest", check=True).stdout.splitlines()[2:5]
    end = head.index(" (mm/s)") + len(" (mm/s)")
    assert [row[:end].split()[-1] for row in rows] == ["0", "0"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 99}, "its format is 99, expected 4); run the sweep again: finished runs are kept"),
        ({"runs": ["base-0123456789ab"]}, "1 runs, expected the names of 6"),
        ({"runs": None}, "cannot be read"),
        ({"base": None}, "cannot be read"),
        ({"file": {"case": "base", "axes": {"drive.frequncy": [1]}}}, 'did you mean "frequency"'),
    ],
)
def test_a_sweep_of_another_format_is_refused(out: Path, change: dict[str, Any], message: str) -> None:
    record = read_json(out / "grid" / "sweep.json")
    assert record.keys() == {"format", "file", "case", "base", "runs"}
    write_json(out / "grid" / "sweep.json", {**record, **change})
    for command in ("list grid", "clean rough --yes"):
        done = call(*command.split())
        assert (done.returncode, message in done.stderr) == (2, True), done.stderr


@pytest.mark.parametrize(
    ("first", "second", "differ"),
    [
        ({}, OTHER, {"liquid.name"}),
        ({}, {"liquid.viscosity_ratio": 2.0}, {"liquid.viscosity_ratio"}),
        ({}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency", "run.time_step"}),
        ({"run.time_step": "2 us"}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency"}),
        ({}, {**OTHER, "liquid.kinematic_viscosity": "20 mm^2/s"}, {"liquid.name", "liquid.kinematic_viscosity"}),
    ],
)
def test_what_a_case_gives_is_a_difference_and_what_follows_is_none(
    first: dict[str, Any], second: dict[str, Any], differ: set[str]
) -> None:
    assert set(differing([flattened(walkers.load_case("fig1b", one)) for one in (first, second)])) == differ


def test_values_of_all_kinds_are_shown_as_they_can_be_written() -> None:
    for key, value in flattened(walkers.load_case("fig1b")).items():
        assert chosen([{key: value}], f"{key}={readable(key, value)}") == [True], key
    values = {"boundary.opening": 1.0, "environment.temperature": 293.15, "environment.gravity": 9.81}
    shown = [readable(key, value) for key, value in values.items()]
    assert shown == ["57.2958 deg", "20 degC", "9.81 m/s^2"]
    assert readable("liquid.kinematic_viscosity", 5e-6) == "5 mm^2/s"


def test_clean_removes_leftovers_alone(out: Path) -> None:
    """No run in progress, and no folder of somebody else's unless it has in it what an unfinished run has."""
    failed, interrupted, held = (
        _unfinished(name, failed=failed) for name, failed in {"slow": True, "killed": False, "held": False}.items()
    )
    begun = out / "begun-0123456789ab.incomplete"
    (begun / "segments").mkdir(parents=True)
    stale, lock = out / "gone-0123456789ab.lock", out / "poetry.lock"
    for path in (stale, lock):
        path.touch()
    before, theirs = finished_places(out), []
    for name in ("thesis.incomplete", "data.replaced", "notes-0123456789ab.incomplete", "mine"):
        (out / name).mkdir()
        theirs.append(out / name / "chapter.txt")
        theirs[-1].write_text("mine")
        if name in ("mine", "thesis.incomplete"):
            shutil.copy(next(iter(before.values())) / "case.json", out / name)
    with locked([out / held.name.removesuffix(".incomplete")]):
        refused = call("clean")  # where there is no terminal
        words = ("1 failed run", "2 interrupted runs", "1 stale lock", "stays: 1 running")
        assert all(word in refused.stdout for word in words)
        assert (refused.returncode, "no terminal" in refused.stderr) == (2, True)
        assert failed.exists()
        call("clean", "--yes", check=True)
    assert not any(path.exists() for path in (failed, interrupted, begun, stale))
    assert all(path.exists() for path in (held, lock, *theirs))
    assert finished_places(out) == before


def test_clean_keeps_runs_that_other_sweeps_have(out: Path) -> None:
    names = ("grid", "rough", "three", "beads")
    runs = {name: {Path(run).name for run in walkers.load(out / name).table()["run"]} for name in names}
    shutil.copytree(out / "rough", out / "renamed")
    before = finished_places(out)
    (out / "grid" / "notes.txt").write_text("mine")
    shown = call("clean", "grid").stdout
    assert "notes.txt, sweep.json" in shown  # what else goes
    assert "1 sweep to remove" in shown
    call("clean", "grid", "beads", "rough", "--yes", check=True)
    assert before.keys() - finished_places(out).keys() == runs["beads"] - runs["three"]
    assert runs["rough"] <= finished_places(out).keys()
    assert not any((out / name).exists() for name in ("grid", "rough", "beads"))
    one = sorted(runs["three"] - runs["rough"])[0]
    shown = call("clean", str(finished_places(out)[one]), "--yes", check=True).stdout
    assert "needed by the sweep three, which would make them again: 1" in shown
    assert walkers.load(out / "three").table()["status"].tolist().count("missing") == 1


def test_with_a_run_go_its_spread_and_its_accuracy(out: Path) -> None:
    """Here with runs that only the accuracy has: those of beads; all runs of the spread are those of a sweep too."""
    run = Path(walkers.load(out / "rough").table()["run"][0]).name
    (out / "beads").rename(out / f"{run}-accuracy")
    shutil.copytree(out / "grid", out / f"{run}-spread")
    theirs = {Path(path).name for path in walkers.load(out / f"{run}-accuracy").table()["run"]}
    others = {Path(path).name for name in ("grid", "three") for path in walkers.load(out / name).table()["run"]}
    before = finished_places(out)
    call("clean", run, "--yes", check=True)
    assert before.keys() - finished_places(out).keys() == (theirs - others) | {run}
    assert not [*out.glob(f"{run}-*")]


def test_clean_leaves_the_target_of_a_symbolic_link(out: Path, tmp_path: Path) -> None:
    name, place = next(iter(finished_places(out).items()))
    kept = place.rename(tmp_path / "elsewhere")
    (out / name).symlink_to(kept)
    before = {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()}
    shown = call("clean", name, "--yes", check=True).stdout
    assert "a symbolic link: its target stays" in shown
    assert "1 finished run to remove, 0 B" in shown
    assert not (out / name).is_symlink()
    assert {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()} == before


def test_clean_reports_what_the_system_does_not_let_it_remove(out: Path) -> None:
    name, directory = next(iter(finished_places(out).items()))
    with mounted(directory / "busy", "64k"):
        done = call("clean", name, "--yes")
        assert (done.returncode, directory.exists()) == (1, True)
        assert f"{directory}: cannot be removed whole" in done.stderr
    assert name not in finished_places(out)


def test_an_interrupted_run_of_another_folder_is_not_mistaken_for_one_of_the_same_name(tmp_path: Path) -> None:
    places = [tmp_path / folder / "killed-0123456789ab.incomplete" for folder in ("runs", "other")]
    for place in places:
        place.mkdir(parents=True)
        (place / "case.json").write_text(json.dumps(make_case().as_dict()))
    done = call("clean", str(places[1]), "--out", str(tmp_path / "runs"), "--yes")
    assert (done.returncode, [place.exists() for place in places]) == (2, [True, True])
    call("clean", places[0].name, "--out", str(tmp_path / "runs"), "--yes", check=True)
    assert [place.exists() for place in places] == [False, True]


def test_a_file_with_two_names_weighs_once(tmp_path: Path) -> None:
    (tmp_path / "table").write_bytes(b"0" * 1000)
    (tmp_path / "other").hardlink_to(tmp_path / "table")
    assert weigh(tmp_path)[0] == 1000
