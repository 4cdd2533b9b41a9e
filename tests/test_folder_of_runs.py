"""Runs and sweeps that are there: listed, compared, removed."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import call, document, make_case, mounted, to_toml
from walkers.runner.directory import finished_places, locked
from walkers.runner.files import read_json, write_json
from walkers.sweeps.folder import bytes_text, weigh
from walkers.sweeps.readable import agrees, differing, flattened, readable

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
    found: list[dict[str, Any]] = json.loads(call("list", "--json", "--all", *arguments, check=True).stdout)
    return found


def _fail(name: str) -> Path:
    """Have a run fail, and give what is left of it."""
    Path(f"{name}.toml").write_text(to_toml(document(run={**SHORTEST, "cycles": 4000})))
    assert call("run", f"{name}.toml", "--limit", "0.01").returncode == 1
    (left,) = Path("runs").glob(f"{name}-*.incomplete")
    return left


def _interrupt(name: str) -> Path:
    """What a kill leaves: the same without a word on a failure."""
    left = _fail(name)
    (left / "failure.json").unlink()
    return left


def _alone() -> str:
    """Name of a finished run that no sweep has."""
    Path("alone.toml").write_text(to_toml(document(run=SHORTEST, drive={"peak_acceleration": "3 g"})))
    call("run", "alone.toml", check=True)
    (run,) = Path("runs").glob("alone-*")
    return run.name


def test_list_has_all_runs_and_sweeps_with_what_they_gave(out: Path) -> None:
    failed, interrupted = _fail("slow"), _interrupt("killed")
    entries = _listed()
    (sweep,) = (entry for entry in entries if entry["name"] == "three")
    assert sweep["varies"] == {"contact.friction.bead_wall": 2, "drive.frequency": 2, "drive.peak_acceleration": 3}
    assert sweep["points"] == {"finished": 12}
    runs = {entry["name"]: entry for entry in entries if entry["kind"] == "run"}
    slow, killed = (path.name.removesuffix(".incomplete") for path in (failed, interrupted))
    assert runs.keys() == finished_places(out).keys() | {slow, killed}
    for _, row in walkers.load(out / "three").table().iterrows():
        entry, files = runs[Path(row["run"]).name], [path for path in Path(row["run"]).rglob("*") if path.is_file()]
        told = ("finished", row["velocity"], sum(path.stat().st_size for path in files))
        assert (entry["status"], entry["velocity"], entry["size"]) == told
    assert (runs[slow]["status"], runs[slow]["reason"]) == ("failed", "TimeLimitExceeded")
    assert runs[killed]["status"] == "interrupted"
    with locked([out / killed]):
        assert [entry["directory"] for entry in _listed() if entry["status"] == "running"] == [str(interrupted)]


def test_list_tells_by_what_runs_of_a_case_differ(out: Path) -> None:
    runs = _listed("--where", "drive.frequency=0.08 kHz", "--where", "bead_wall=0.1", "--where", "radii=0.3/0.2 mm")
    assert {entry["varies"]["drive.peak_acceleration"] for entry in runs} == {19.6, 39.2, 58.8}
    head, *lines = call("list", "--where", "bead_wall=0.2", check=True).stdout.splitlines()
    assert head.split() == ["base", "(6)", "status", "result", "age", "size", "frequency", "peak_acceleration"]
    assert all("mm/s" in line and " Hz " in line for line in lines[:6])


def test_a_resting_walker_is_called_so_everywhere(out: Path) -> None:
    Path("rest.toml").write_text('case = "base.toml"\n[axes]\ndrive.peak_acceleration = ["0.2 g", "0.3 g"]\n')
    call("sweep", "rest.toml", check=True)
    table = walkers.load(out / "rest").table()
    assert (table["velocity"].abs() > 0.0).all()
    told = call("run", table["run"][0], check=True).stdout
    assert ": at rest" in told
    assert call("list", "--all", check=True).stdout.count(" at rest ") == 2
    shown = [repr(walkers.load(one)) for one in (table["run"][0], "rest")]
    assert shown == [f"Run({table['run'][0]}: finished, at rest)", "Sweep(rest: 2 points, 2 finished)"]
    head, *rows = call("list", "rest", check=True).stdout.splitlines()[2:5]
    end = head.index(" (mm/s)") + len(" (mm/s)")
    assert [row[:end].split()[-1] for row in rows] == ["0", "0"]


def test_list_hides_runs_of_sweeps_but_those_with_a_spread(out: Path) -> None:
    run = Path(walkers.load(out / "grid").table()["run"][0]).name
    assert run not in call("list", check=True).stdout
    shutil.copytree(out / "rough", out / f"{run}-spread")
    assert f"\n{run}  finished" in call("list", check=True).stdout


def test_list_reads_neither_dumps_nor_tables(out: Path) -> None:
    def told() -> list[dict[str, Any]]:
        return [{**entry, "size": 0, "age": 0.0} for entry in _listed()]

    before = told()
    for path in [path for pattern in ("*.bin", "*.parquet", "*.txt") for path in out.rglob(pattern)]:
        path.unlink()
    assert told() == before


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
    done = call("list", "grid")
    assert (done.returncode, message in done.stderr) == (2, True), done.stderr


@pytest.mark.parametrize(
    ("first", "second", "differ"),
    [
        ({}, OTHER, {"liquid.name"}),
        ({}, {"liquid.viscosity_ratio": 2.0}, {"liquid.viscosity_ratio"}),
        ({}, {"run.time_step": "1 us"}, {"run.time_step"}),
        ({}, {**FASTER, "run.cycles": 60}, {"drive.frequency", "run.cycles"}),
        ({}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency", "run.time_step"}),
        ({"run.time_step": "2 us"}, {**FASTER, "run.time_step": "2 us"}, {"drive.frequency"}),
        ({}, {**OTHER, "liquid.viscosity_ratio": 1.0}, {"liquid.name", "liquid.viscosity_ratio"}),
        ({}, {**OTHER, "liquid.kinematic_viscosity": "20 mm^2/s"}, {"liquid.name", "liquid.kinematic_viscosity"}),
    ],
)
def test_what_a_case_gives_is_a_difference_and_what_follows_is_none(
    first: dict[str, Any], second: dict[str, Any], differ: set[str]
) -> None:
    cases = [flattened(walkers.load_case("fig1b", one)) for one in (first, second)]
    assert set(differing(cases)) == differ


def test_values_of_all_kinds_are_shown_as_they_can_be_written() -> None:
    for key, value in flattened(walkers.load_case("fig1b")).items():
        assert agrees({key: value}, key, readable(key, value)), key
    values = {"boundary.opening": 1.0, "environment.temperature": 293.15, "environment.gravity": 9.81}
    shown = [readable(key, value) for key, value in values.items()]
    assert shown == ["57.2958 deg", "293.15 K", "9.81 m/s^2"]
    assert readable("liquid.kinematic_viscosity", 5e-6) == "5 mm^2/s"


def test_compare_tells_parameters_and_results_of_two_runs(out: Path) -> None:
    table = walkers.load(out / "beads").table().set_index(["liquid.name", "dimers.radii[0]"])
    rows = [table.loc[("Si AK5", 0.3)], table.loc[("Si AK10", 0.3)]]
    names = [Path(row["run"]).name for row in rows]
    found = json.loads(call("compare", *names, "--json", check=True).stdout)
    assert found["parameters"] == {"liquid.name": ["Si AK5", "Si AK10"]}
    results = {one["quantity"]: one for one in found["results"]}
    velocity = results["velocity"]
    assert (velocity["first"], velocity["second"]) == (rows[0]["velocity"], rows[1]["velocity"])
    assert (velocity["first_scatter"], velocity["second_scatter"]) == (rows[0]["scatter"], rows[1]["scatter"])
    assert velocity["numerical_error"] is None
    of_first = walkers.load(rows[0]["run"]).walkers["sliding_2"]
    assert results["sliding_2"]["first_scatter"] == pytest.approx(of_first.std())
    text = call("compare", *names, check=True).stdout
    assert "liquid.name" in text
    assert "velocity (mm/s)" in text


def test_compare_takes_cases_and_says_what_was_not_run(out: Path) -> None:
    text = call("compare", "base.toml", "fig4a", check=True).stdout
    assert "0.6/0.3 mm" in text
    assert "fig4a: no finished run" in text
    same = call("compare", "base.toml", "base.toml", check=True).stdout
    assert "the cases are the same" in same
    assert "all results are the same" in same


@pytest.mark.parametrize("sides", [["base.toml"], ["base.toml", "base.toml"]])
def test_compare_changes_the_second_case_alone(out: Path, sides: list[str]) -> None:
    found = json.loads(call("compare", *sides, "--set", "drive.frequency=90Hz", "--json", check=True).stdout)
    assert {key: values[1] for key, values in found["parameters"].items()} == {"drive.frequency": 90.0}
    assert (found["second"], found["not_run"]) == ("base.toml drive.frequency=90Hz", ["base.toml drive.frequency=90Hz"])


def test_compare_matches_the_points_of_two_sweeps(out: Path) -> None:
    """Whatever their order; one sweep has points that the other has not."""
    keys = ["drive.frequency", "drive.peak_acceleration"]
    tables = [walkers.load(out / name).table().set_index(keys) for name in ("grid", "rough")]
    found = json.loads(call("compare", "grid", "rough", "--json", check=True).stdout)
    assert found["parameters"] == {"contact.friction.bead_wall": [0.1, 0.2]}
    assert found["unmatched"] == [2, 0]
    assert len(found["points"]) == 4
    for one in found["points"]:
        at = tuple(one["point"][key] for key in keys)
        assert (one["first"], one["second"]) == tuple(table.loc[at, "velocity"] for table in tables)
    assert "4 points in both" in call("compare", "grid", "rough", check=True).stdout


def test_clean_removes_leftovers_alone(out: Path) -> None:
    failed, interrupted, held = _fail("slow"), _interrupt("killed"), _interrupt("held")
    stale, theirs = out / "gone-0123456789ab.lock", out / "poetry.lock"
    for path in (stale, theirs):
        path.touch()
    before = finished_places(out)
    with locked([out / held.name.removesuffix(".incomplete")]):
        refused = call("clean")  # where there is no terminal
        told = refused.stdout
        assert all(word in told for word in ("1 failed run", "1 interrupted run", "1 stale lock", "stays: 1 running"))
        assert (refused.returncode, "no terminal" in refused.stderr) == (2, True)
        assert failed.exists()
        call("clean", "--yes", check=True)
        assert not any(path.exists() for path in (failed, interrupted, stale))
        assert all(path.exists() for path in (held, theirs))
    assert finished_places(out) == before


def test_clean_keeps_what_sweeps_need_unless_it_is_named(out: Path) -> None:
    runs = {
        name: {Path(run).name for run in walkers.load(out / name).table()["run"]} for name in ("grid", "three", "beads")
    }
    own, before = _alone(), finished_places(out)
    assert "stays" in call("clean", "--finished", "--yes", check=True).stdout
    assert before.keys() - finished_places(out).keys() == {own}
    call("clean", "grid", "beads", "--yes", check=True)
    gone = before.keys() - finished_places(out).keys() - {own}
    assert gone == runs["beads"] - runs["three"], "all runs of the grid are those of another sweep too"
    assert not (out / "grid").exists()
    one = sorted(runs["three"])[0]
    told = call("clean", str(finished_places(out)[one]), "--yes", check=True).stdout
    assert "needed by the sweep three, which would make them again: 1" in told
    assert walkers.load(out / "three").table()["status"].tolist().count("missing") == 1


def test_clean_keeps_the_runs_of_sweeps_that_were_renamed_or_cannot_be_read(out: Path) -> None:
    shutil.copytree(out / "grid", out / "old")
    before = finished_places(out)
    call("clean", "grid", "rough", "three", "--yes", check=True)
    runs = {Path(run).name for run in walkers.load(out / "old").table()["run"]}
    assert runs <= finished_places(out).keys() < before.keys()
    record = read_json(out / "old" / "sweep.json")
    write_json(out / "old" / "sweep.json", {key: value for key, value in record.items() if key != "runs"})
    done = call("clean", "--finished", "--yes")
    assert (done.returncode, "sweep.json cannot be read" in done.stderr) == (2, True)


def test_clean_removes_nothing_behind_a_symbolic_link(out: Path, tmp_path: Path) -> None:
    link = out / _alone()
    kept = link.rename(tmp_path / "elsewhere")
    link.symlink_to(kept)
    before = {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()}
    told = call("clean", link.name, "--yes", check=True).stdout
    assert "a symbolic link: its target stays" in told
    assert "1 finished run to remove, 0 B" in told
    assert not link.is_symlink()
    assert {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()} == before


def test_clean_reports_what_the_system_does_not_let_it_remove(out: Path) -> None:
    name, directory = next(iter(finished_places(out).items()))
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
    for name in ("mine", "thesis.incomplete"):
        shutil.copy(shipped / "case.json", out / name)
    begun = out / "killed-0123456789ab.incomplete"
    (begun / "segments").mkdir(parents=True)
    assert "1 interrupted run to remove" in call("clean", "--yes", check=True).stdout
    assert not begun.exists()
    assert all((out / name / "chapter.txt").exists() for name in theirs)


def test_clean_leaves_what_somebody_put_into_a_sweeps_directory(out: Path) -> None:
    sweep = out / "grid"
    call("plot", "grid", check=True)
    (sweep / "parsl").mkdir(exist_ok=True)
    (sweep / "parsl" / "log.txt").write_bytes(b"x" * 3000)
    written = sum(path.stat().st_size for path in sweep.rglob("*") if path.is_file())
    theirs = {"notes/idea.txt": "mine", "measured.csv": "1,2", "sliding_1.png": "no figure of walkers"}
    for name, text in theirs.items():
        (sweep / name).parent.mkdir(exist_ok=True)
        (sweep / name).write_text(text)
    told = call("clean", "grid").stdout
    assert f"1 sweep to remove, {bytes_text(written)}" in told
    assert "kept, not written by walkers: measured.csv, notes, sliding_1.png" in told
    call("clean", "grid", "--yes", check=True)
    assert {str(path.relative_to(sweep)): path.read_text() for path in sweep.rglob("*.*")} == theirs


def test_a_file_with_two_names_weighs_once(tmp_path: Path) -> None:
    (tmp_path / "table").write_bytes(b"0" * 1000)
    (tmp_path / "other").hardlink_to(tmp_path / "table")
    assert weigh(tmp_path)[0] == 1000


def test_sweeps_over_lists_of_different_lengths_are_compared_either_way(in_folder: Path) -> None:
    """Clusters of three beads and of two: the longer list has a column that the other sweep has not."""
    tables = document(run=SHORTEST)
    del tables["dimers"]
    radii = ["0.3 mm", "0.2 mm"]
    (in_folder / "base.toml").write_text(
        to_toml({**tables, "clusters": [{"radii": radii, "arrangement": "chain", "replicates": 1}]})
    )
    for name, levels in (("long", [[*radii, "0.2 mm"], radii]), ("short", [radii, ["0.3 mm", "0.25 mm"]])):
        Path(f"{name}.toml").write_text(f'case = "base.toml"\naxes."clusters[0].radii" = {json.dumps(levels)}\n')
        call("sweep", f"{name}.toml", check=True)
    for names in (["long", "short"], ["short", "long"]):
        found = json.loads(call("compare", *names, "--json", check=True).stdout)
        assert [len(one["point"]["clusters[0].radii"]) for one in found["points"]] == [2]
        assert found["points"][0]["difference"] == 0.0


def test_an_interrupted_run_of_another_folder_is_not_mistaken_for_one_of_the_same_name(tmp_path: Path) -> None:
    places = [tmp_path / folder / "killed-0123456789ab.incomplete" for folder in ("runs", "other")]
    for place in places:
        place.mkdir(parents=True)
        (place / "case.json").write_text(json.dumps(make_case().as_dict()))
    done = call("clean", str(places[1]), "--out", str(tmp_path / "runs"), "--yes")
    assert (done.returncode, [place.exists() for place in places]) == (2, [True, True])
    call("clean", places[0].name, "--out", str(tmp_path / "runs"), "--yes", check=True)
    assert [place.exists() for place in places] == [False, True]
