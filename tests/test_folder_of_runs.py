"""Runs and sweeps that are there: listed, compared, removed."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import walkers
from tests.conftest import call, document, mounted, to_toml
from walkers.inputs.readable import differing, flattened
from walkers.runner.directory import MANIFEST_NAME, finished_places
from walkers.runner.files import read_json, write_json
from walkers.runner.locks import locked
from walkers.sweeps.comparison import _matched
from walkers.sweeps.listing import bytes_text
from walkers.sweeps.record import SweepRecord, write_record
from walkers.sweeps.table import varied_columns

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
    found: list[dict[str, Any]] = json.loads(call("list", "--json", *arguments, check=True).stdout)
    return found


def _fail(name: str) -> Path:
    """Have a run fail, and give what is left of it."""
    Path(f"{name}.toml").write_text(to_toml(document(run={**SHORTEST, "cycles": 4000})))
    done = call("run", f"{name}.toml", "--limit", "0.01")
    assert done.returncode == 1
    assert "time limit" in done.stderr
    (left,) = Path("runs").glob(f"{name}-*.incomplete")
    return left


def _interrupt(name: str) -> Path:
    """What a kill leaves: the same without a word on a failure."""
    left = _fail(name)
    (left / "failure.json").unlink()
    return left


def test_list_has_all_runs_and_sweeps_with_what_they_gave(out: Path) -> None:
    failed, interrupted = _fail("slow"), _interrupt("killed")
    entries = _listed()
    sweeps = {entry["name"]: entry for entry in entries if entry["kind"] == "sweep"}
    assert sweeps["three"]["varies"] == {
        "contact.friction.bead_wall": 2,
        "drive.frequency": 2,
        "drive.peak_acceleration": 3,
    }
    assert sweeps["three"]["points"] == {"finished": 12}
    runs = {entry["name"]: entry for entry in entries if entry["kind"] == "run"}
    places = finished_places(out)
    assert runs.keys() == places.keys() | {path.name.removesuffix(".incomplete") for path in (failed, interrupted)}
    table = walkers.load(out / "three")
    for run, velocity, error in zip(table["run"], table["velocity"], table["standard_error"], strict=True):
        entry = runs[Path(run).name]
        assert (entry["status"], entry["velocity"], entry["standard_error"]) == ("finished", velocity, error)
        files = [path for path in Path(run).rglob("*") if path.is_file()]
        assert entry["size"] == sum(path.stat().st_size for path in files)
    about = runs[failed.name.removesuffix(".incomplete")]
    assert (about["status"], about["reason"]) == ("failed", "TimeLimitExceeded")
    assert runs[interrupted.name.removesuffix(".incomplete")]["status"] == "interrupted"
    with locked([out / interrupted.name.removesuffix(".incomplete")]):
        assert [entry["directory"] for entry in _listed("--status", "running")] == [str(interrupted)]


def test_list_tells_by_what_runs_of_a_case_differ(out: Path) -> None:
    runs = _listed("--where", "liquid.name=Si AK10")
    assert len(runs) == 3
    assert {key for entry in runs for key in entry["varies"]} == {"dimers.radii"}
    runs = _listed("--where", "drive.frequency=0.08 kHz", "--where", "bead_wall=0.1", "--where", "radii=0.3/0.2 mm")
    assert {entry["varies"]["drive.peak_acceleration"] for entry in runs} == {19.6, 39.2, 58.8}
    text = call("list", "--where", "bead_wall=0.2", check=True).stdout
    head, *lines = text.splitlines()
    assert head.split() == ["base", "(6)", "status", "result", "age", "size", "frequency", "peak_acceleration"]
    assert all("mm/s" in line and " Hz " in line for line in lines[:6])


def test_list_filters_and_sorts(out: Path) -> None:
    runs = sorted(finished_places(out).values())
    for days, run in ((30, runs[0]), (2, runs[1])):
        os.utime(run / MANIFEST_NAME, (time.time() - days * 86400.0,) * 2)
    then = time.time() - 3600.0
    for number, run in enumerate(runs[2:]):  # of a shared deck the manifests are microseconds apart
        os.utime(run / MANIFEST_NAME, (then + 1e-6 * number,) * 2)
    assert {entry["name"] for entry in _listed("--older-than", "7d")} == {runs[0].name}
    assert {entry["name"] for entry in _listed("--older-than", "24 h")} == {run.name for run in runs[:2]}
    assert _listed("--case", "other") == []
    order = [entry["age"] for entry in _listed("--sort", "age", "--reverse") if entry["kind"] == "run"]
    assert order == sorted(order, reverse=True)
    speeds = [entry["velocity"] for entry in _listed("--sort", "velocity") if entry["kind"] == "run"]
    assert speeds == sorted(speeds, reverse=True)
    for arguments, told in (
        (["--older-than", "soon"], "expected an age with its unit"),
        (["--where", "frequency"], "expected KEY=VALUE"),
        (["--where", "frequenzy=2"], "no run has such a key"),
    ):
        done = call("list", *arguments)
        assert (done.returncode, told in done.stderr) == (2, True)


def test_list_reads_neither_dumps_nor_tables(out: Path) -> None:
    def told() -> list[dict[str, Any]]:
        return [{**entry, "size": 0, "age": 0.0} for entry in _listed()]

    before = told()
    for pattern in ("*.bin", "*.parquet", "*.txt"):
        for path in out.rglob(pattern):
            path.unlink()
    assert told() == before
    script = f"import sys; sys.argv[1:] = ['list', '--out', {str(out)!r}]\nimport walkers.main as m\ntry: m.main()\n"
    script += "finally: print([n for n in ('numpy', 'pandas', 'pyarrow', 'matplotlib') if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("first", "second", "differ"),
    [
        ({}, OTHER, {"liquid.name"}),
        ({}, FASTER, {"drive.frequency"}),
        ({}, {"liquid.viscosity_ratio": 2.0}, {"liquid.viscosity_ratio"}),
        ({}, {"run.time_step": "1 us"}, {"run.time_step"}),
        ({}, {**FASTER, "run.cycles": 60}, {"drive.frequency", "run.cycles"}),
        ({}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency", "run.time_step"}),
        ({"run.time_step": "2 us"}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency"}),
        ({}, {**OTHER, "liquid.viscosity_ratio": 1.0}, {"liquid.name", "liquid.viscosity_ratio"}),
        ({}, {**OTHER, "liquid.kinematic_viscosity": "20 mm^2/s"}, {"liquid.name", "liquid.kinematic_viscosity"}),
        ({}, {**OTHER, "liquid.surface_tension": "30 mN/m"}, {"liquid.name", "liquid.surface_tension"}),
    ],
)
def test_what_a_case_gives_is_a_difference_and_what_follows_is_none(
    first: dict[str, Any], second: dict[str, Any], differ: set[str]
) -> None:
    cases = [flattened(walkers.load_case("fig1b", one).as_dict()) for one in (first, second)]
    assert set(differing(cases)) == differ


def test_compare_tells_parameters_and_results_of_two_runs(out: Path) -> None:
    table = walkers.load(out / "beads").set_index(["liquid.name", "dimers.radii[0]"])
    rows = [table.loc[("Si AK5", 0.3)], table.loc[("Si AK10", 0.3)]]
    names = [Path(row["run"]).name for row in rows]
    found = json.loads(call("compare", *names, "--json", check=True).stdout)
    assert found["parameters"] == {"liquid.name": ["Si AK5", "Si AK10"]}
    results = {one["quantity"]: one for one in found["results"]}
    velocity = results["velocity"]
    assert (velocity["first"], velocity["second"]) == (rows[0]["velocity"], rows[1]["velocity"])
    error = (rows[0]["standard_error"] ** 2 + rows[1]["standard_error"] ** 2) ** 0.5
    assert velocity["difference"] == pytest.approx(rows[1]["velocity"] - rows[0]["velocity"])
    assert velocity["in_standard_errors"] == pytest.approx(velocity["difference"] / error)
    of_first = walkers.find_run(rows[0]["run"]).walkers["sliding_2"]
    assert results["sliding_2"]["first"] == pytest.approx(of_first.mean())
    assert results["sliding_2"]["first_standard_error"] == pytest.approx(of_first.std() / 2**0.5)
    text = call("compare", *names, check=True).stdout
    assert "liquid.name" in text
    assert "velocity (mm/s)" in text


def test_compare_takes_cases_and_says_what_was_not_run(out: Path) -> None:
    text = call("compare", "base.toml", "fig4a", check=True).stdout
    assert "dimers.radii" in text
    assert "0.6/0.3 mm" in text
    assert "fig4a: no finished run" in text
    assert "the cases are the same" in call("compare", "base.toml", "base.toml", check=True).stdout


def test_compare_matches_the_points_of_two_sweeps(out: Path) -> None:
    """Whatever their order; one sweep has points that the other has not."""
    tables = [
        walkers.load(out / name).set_index(["drive.frequency", "drive.peak_acceleration"]) for name in ("grid", "rough")
    ]
    found = json.loads(call("compare", "grid", "rough", "--json", check=True).stdout)
    assert found["parameters"] == {"contact.friction.bead_wall": [0.1, 0.2]}
    assert found["unmatched"] == [2, 0]
    assert len(found["points"]) == 4
    for one in found["points"]:
        at = (one["point"]["drive.frequency"], one["point"]["drive.peak_acceleration"])
        assert (one["first"], one["second"]) == tuple(table.loc[at, "velocity"] for table in tables)
    assert "4 points in both" in call("compare", "grid", "rough", check=True).stdout
    for other, told in (("three", "vary the same keys"), ("fig1b", "is a sweep, to be compared")):
        done = call("compare", "grid", other)
        assert (done.returncode, told in done.stderr) == (2, True)


def test_points_of_sweeps_match_by_what_their_numbers_are() -> None:
    first = pd.DataFrame({"key": [0, 1.0, "auto"], "point": range(3)})
    second = pd.DataFrame({"key": ["auto", 0.0, 2], "point": range(3)})
    found = _matched([first, second], ["key"])
    assert list(zip(found["point_first"], found["point_second"], strict=True)) == [(0, 1), (2, 0)]


def test_one_number_of_a_list_is_a_key_like_any_other(tmp_path: Path) -> None:
    """Sweeps over it are matched by it, and their reports show it."""
    key = "dimers.radii[0]"
    values, derived, runs = [[0.2], [0.3]], [[0.0] * 4] * 2, ["base-0", "base-1"]
    record = SweepRecord(tmp_path / "test", "test", "", {key: "mm"}, values, derived, runs, None, [], {})
    write_record(record)
    assert varied_columns(walkers.load(record.directory)) == [key]


def test_clean_removes_leftovers_alone(out: Path) -> None:
    failed, interrupted, held = _fail("slow"), _interrupt("killed"), _interrupt("held")
    stale, theirs = out / "gone-0123456789ab.lock", out / "poetry.lock"
    for path in (stale, theirs):
        path.touch()
    before = finished_places(out)
    place = out / held.name.removesuffix(".incomplete")
    with locked([place]):
        told = call("clean", "--dry-run", check=True).stdout
        assert "1 failed run, 1 interrupted run" in told or "1 interrupted run, 1 failed run" in told
        assert "stays: 1 running" in told
        assert failed.exists()
        refused = call("clean")  # where there is no terminal
        assert (refused.returncode, "no terminal" in refused.stderr) == (2, True)
        assert failed.exists()
        call("clean", "--yes", check=True)
        assert not any(path.exists() for path in (failed, interrupted, stale))
        assert all(path.exists() for path in (held, theirs))
    assert finished_places(out) == before
    assert "nothing to remove" in call("clean", "--case", "other", check=True).stdout


def test_clean_keeps_what_sweeps_need_unless_it_is_named(out: Path) -> None:
    runs = {name: {Path(run).name for run in walkers.load(out / name)["run"]} for name in ("grid", "three", "beads")}
    call("run", "base.toml", check=True)  # 80 Hz, 4 g: a run of sweeps
    alone = Path("alone.toml")
    alone.write_text(to_toml(document(run=SHORTEST, drive={"peak_acceleration": "3 g"})))
    call("run", "alone.toml", check=True)
    before = finished_places(out)
    (own,) = (name for name in before if name.startswith("alone-"))
    told = call("clean", "--finished", "--yes", check=True).stdout
    assert "stays" in told
    assert before.keys() - finished_places(out).keys() == {own}
    told = call("clean", "grid", "beads", "--yes", check=True).stdout
    gone = before.keys() - finished_places(out).keys() - {own}
    assert gone == runs["beads"] - runs["three"], "all runs of the grid are those of another sweep too"
    assert not (out / "grid").exists()
    one = sorted(runs["three"])[0]
    told = call("clean", str(finished_places(out)[one]), "--yes", check=True).stdout
    assert "needed by the sweep three, which would make them again: 1" in told
    assert walkers.load(out / "three")["status"].tolist().count("missing") == 1
    done = call("clean", "nonsense", "--yes")
    assert (done.returncode, "no run or sweep" in done.stderr) == (2, True)


def test_clean_takes_no_run_while_a_sweep_cannot_be_read(out: Path) -> None:
    record = read_json(out / "grid" / "sweep.json")
    write_json(out / "grid" / "sweep.json", {key: value for key, value in record.items() if key != "points"})
    done = call("clean", "--finished", "--yes")
    assert (done.returncode, "sweep.json cannot be read" in done.stderr) == (2, True)


def test_what_is_left_of_a_shared_deck_is_an_unfinished_run(out: Path) -> None:
    """It lies in the directory of the first of its runs, and is kept while that is locked."""
    before = finished_places(out)
    runs = [path for path in before.values() if (path / "shared_deck").is_dir()]
    left = out / f"{runs[0].name}.incomplete"
    left.mkdir()
    for run in runs:
        shutil.copytree(run, left / run.name)
        shutil.rmtree(run)
    shutil.copy(left / runs[0].name / "case.json", left)
    shutil.copytree(left / runs[0].name / "shared_deck", left / "shared_deck")
    with locked([runs[0]]):
        assert "stays: 1 running" in call("clean", "--yes", check=True).stdout
    assert "1 interrupted run" in call("clean", "--yes", check=True).stdout
    assert not left.exists()
    assert before.keys() - finished_places(out).keys() == {run.name for run in runs}


def test_clean_keeps_the_runs_of_a_sweep_whose_directory_was_renamed(out: Path) -> None:
    shutil.copytree(out / "grid", out / "old")
    before = finished_places(out)
    call("clean", "grid", "rough", "three", "--yes", check=True)
    runs = {Path(run).name for run in walkers.load(out / "old")["run"]}
    assert runs <= finished_places(out).keys() < before.keys()


def test_clean_removes_nothing_behind_a_symbolic_link(out: Path, tmp_path: Path) -> None:
    alone = Path("alone.toml")
    alone.write_text(to_toml(document(run=SHORTEST, drive={"peak_acceleration": "3 g"})))
    call("run", "alone.toml", check=True)
    (link,) = out.glob("alone-*")
    kept = link.rename(tmp_path / "elsewhere")
    link.symlink_to(kept)
    before = {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()}
    told = call("clean", link.name, "--yes", check=True).stdout
    assert "a symbolic link: what it leads to stays" in told
    assert "1 finished run to remove, 0 B" in told
    assert not link.is_symlink()
    assert {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()} == before


def test_clean_reports_what_the_system_does_not_let_it_remove(out: Path) -> None:
    places = finished_places(out)
    name, directory = next(iter(places.items()))
    with mounted(directory / "busy", "64k"):
        done = call("clean", name, "--yes")
        assert (done.returncode, directory.exists()) == (1, True)
        assert f"{directory}: cannot be removed whole" in done.stderr
    assert name not in finished_places(out)


def test_clean_takes_no_folder_of_somebody_elses(out: Path) -> None:
    """Unless it has a run's name and nothing in it but what an unfinished run has."""
    shipped = next(iter(finished_places(out).values()))
    theirs = ["thesis.incomplete", "data.replaced", "notes-0123456789ab.incomplete", "mine"]
    for name in theirs:
        (out / name).mkdir()
        (out / name / "chapter.txt").write_text("mine")
    shutil.copy(shipped / "case.json", out / "mine")
    shutil.copy(shipped / "case.json", out / "thesis.incomplete")
    begun = out / "killed-0123456789ab.incomplete"
    (begun / "segments").mkdir(parents=True)
    told = call("clean", "--yes", check=True).stdout
    assert "1 interrupted run to remove" in told
    assert not begun.exists()
    assert all((out / name / "chapter.txt").exists() for name in theirs)
    done = call("clean", "thesis.incomplete", "--yes")
    assert (done.returncode, "no run or sweep" in done.stderr) == (2, True)


def test_clean_leaves_what_somebody_put_into_a_sweeps_directory(out: Path) -> None:
    sweep = out / "grid"
    call("plot", "grid", check=True)
    assert (sweep / "velocity.png").exists()
    (sweep / "parsl").mkdir(exist_ok=True)
    (sweep / "parsl" / "log.txt").write_bytes(b"x" * 3000)
    written = sum(path.stat().st_size for path in sweep.rglob("*") if path.is_file())
    theirs = {"notes/idea.txt": "mine", "measured.csv": "1,2", "sliding_1.png": "no figure of walkers"}
    for name, text in theirs.items():
        (sweep / name).parent.mkdir(exist_ok=True)
        (sweep / name).write_text(text)
    told = call("clean", "grid", "--dry-run", check=True).stdout
    assert f"1 sweep to remove, {bytes_text(written)}" in told
    assert "stays, for walkers did not write it: measured.csv, notes, sliding_1.png" in told
    call("clean", "grid", "--yes", check=True)
    assert {str(path.relative_to(sweep)): path.read_text() for path in sweep.rglob("*.*")} == theirs
    call("clean", "rough", "--yes", check=True)
    assert not (out / "rough").exists()
