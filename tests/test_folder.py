"""Runs and sweeps of a folder: listed, removed, and compared."""

from __future__ import annotations

import json
import os
import pty
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from math import hypot
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import (
    PATIENCE,
    PROGRAM,
    SHORT,
    TINY,
    call,
    document,
    engines_in,
    finished_places,
    to_toml,
    wait_for,
)
from walkers import load_case
from walkers.files import read_json, scratch_folder, write_json
from walkers.inputs.case_building import changed_case
from walkers.inputs.reading import shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.uncertainty import ACCURACY_NAME, SPREAD_NAME, spread_of
from walkers.runner.manifest import MANIFEST_NAME, checksums
from walkers.runner.run_directory import case_of, locked
from walkers.runs.case_text import readable
from walkers.runs.comparison import Side, compare_runs
from walkers.runs.listing import bytes_text, size_and_last_change
from walkers.runs.removal import remove, unfinished_in
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.removal import removals_in
from walkers.sweeps.scheduler import SweepOptions, plan_sweep


@pytest.fixture
def out(looked_through: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the folder, as ``runs`` of the current one, with the case of its sweeps."""
    shutil.copytree(looked_through, tmp_path / "runs")
    shutil.copy(looked_through.parent / "base.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    yield Path("runs")


def _listed(*arguments: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads(
        call("list", "--json", "--all", *arguments, check=True).stdout
    )
    return rows


def _unfinished(name: str, *, failed: bool) -> Path:
    """What is left of a run that failed, or was killed: the same without a word on a failure."""
    Path(f"{name}.toml").write_text(to_toml(document(run={**TINY, "cycles": 4000})))
    assert call("run", f"{name}.toml", "--limit", "0.01").returncode == 1
    (left,) = Path("runs").glob(f"{name}-*.incomplete")
    if not failed:
        (left / "failure.json").unlink()
    return left


def test_list_has_all_runs_and_sweeps_with_their_results(out: Path) -> None:
    failed, interrupted = (_unfinished(name, failed=name == "slow") for name in ("slow", "killed"))
    rows = _listed()
    (sweep,) = (row for row in rows if row["name"] == "three")
    assert sweep["varies"] == {
        "contact.friction.bead_wall": 2,
        "drive.frequency": 2,
        "drive.peak_acceleration": 3,
    }
    assert sweep["points"] == {"finished": 12}
    runs = {row["name"]: row for row in rows if row["kind"] == "run"}
    slow, killed = (path.name.removesuffix(".incomplete") for path in (failed, interrupted))
    assert runs.keys() == finished_places(out).keys() | {slow, killed}
    for _, point in walkers.load(out / "three").table().iterrows():
        row, files = (
            runs[Path(point["run"]).name],
            [path for path in Path(point["run"]).rglob("*") if path.is_file()],
        )
        expected = ("finished", point["velocity"], sum(path.stat().st_size for path in files))
        assert (row["status"], row["velocity"], row["size"]) == expected
    assert (runs[slow]["status"], runs[slow]["reason"]) == ("failed", "TimeLimitExceeded")
    assert runs[killed]["status"] == "interrupted"
    with locked([out / killed]):
        assert [row["directory"] for row in _listed() if row["status"] == "running"] == [
            str(interrupted)
        ]
    # It reads neither dumps nor tables.
    for path in [
        path for pattern in ("*.bin", "*.parquet", "*.txt") for path in out.rglob(pattern)
    ]:
        path.unlink()
    again = {row["name"]: row for row in _listed()}
    assert [again[row["name"]]["numbers"] for row in rows] == [row["numbers"] for row in rows]


def test_list_has_a_column_for_each_value_that_differs(out: Path) -> None:
    runs = [row for row in _listed() if row["kind"] == "run"]
    assert {row["varies"]["drive.peak_acceleration"] for row in runs} == {19.6, 39.2, 58.8}
    lines = call("list", "--all", check=True).stdout.splitlines()
    (head,) = (line.split() for line in lines if line.startswith("base ("))
    assert head[2:6] == ["status", "result", "age", "size"]
    assert {"frequency", "peak_acceleration", "bead_wall"} <= {*head}
    # Runs of sweeps are hidden, but not a run with a spread.
    run = Path(walkers.load(out / "grid").table()["run"][0]).name
    assert run not in call("list", check=True).stdout
    shutil.copytree(out / "rough", out / f"{run}-spread")
    assert f"\n{run}  finished" in call("list", check=True).stdout


@pytest.mark.parametrize(
    ("where", "number"),
    [
        (("drive.frequency=0.08 kHz", "friction.bead_wall=0.1", "radii=0.3 mm, 0.2 mm"), 4),
        (("friction.bead_wall=0.2",), 6),
        (("friction.bead_wall=0.3",), 0),
        (("colour=red",), '"colour=red": no run has such a key'),
        (
            ("friction.bead_wall=5 mm",),
            'friction.bead_wall=5 mm": expected a number without a unit',
        ),
    ],
    ids=str,
)
def test_list_selects_by_values(out: Path, where: tuple[str, ...], number: int | str) -> None:
    ended = call(
        "list", "--json", *(word for condition in where for word in ("--where", condition))
    )
    if isinstance(number, str):
        assert number in ended.stderr
        assert ended.returncode == 2
    else:
        assert len(json.loads(ended.stdout)) == number


def test_a_resting_walker_is_called_so_everywhere(out: Path) -> None:
    Path("rest.toml").write_text(
        'case = "base.toml"\n[axes]\ndrive.peak_acceleration = ["0.2 g", "0.3 g"]\n'
    )
    call("sweep", "rest.toml", check=True)
    table = walkers.load(out / "rest").table()
    assert (table["velocity"].abs() > 0.0).all()
    assert ": at rest" in call("run", table["run"][0], check=True).stdout
    assert call("list", "--all", check=True).stdout.count(" at rest ") == 2
    assert repr(walkers.load(table["run"][0])) == f"Run({table['run'][0]}: finished, at rest)"


def test_the_table_of_a_finished_sweep_is_read_once_until_it_is_refreshed(out: Path) -> None:
    """That of an unfinished sweep is read each time: its points may be finished meanwhile."""
    sweep = walkers.load(out / "grid")
    first, *_ = sweep.table()["run"]
    changed = sweep.table()
    changed["velocity"] = 0.0  # the user's table, not that of the sweep
    assert (sweep.table()["velocity"] != 0.0).all()
    away = Path(f"{first}.away")
    Path(first).rename(away)
    assert sweep.status == "finished"
    assert sweep.refresh().table()["status"].tolist().count("missing") == 1
    away.rename(first)
    assert sweep.status == "finished"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"format": 99},
            "its format is 99, expected 4); run the sweep again: finished runs are kept",
        ),
        ({"runs": ["base-0123456789ab"]}, "1 runs, expected the names of 6"),
        ({"base": None}, "cannot be read"),
        ({"file": {"case": "base", "axes": {"drive.frequncy": [1]}}}, 'did you mean "frequency"'),
    ],
)
def test_a_sweep_of_another_format_is_refused(
    out: Path, change: dict[str, Any], message: str
) -> None:
    write_json(out / "grid" / "sweep.json", {**read_json(out / "grid" / "sweep.json"), **change})
    for command in ("list grid", "clean rough --yes"):
        done = call(*command.split())
        assert (done.returncode, message in done.stderr) == (2, True), done.stderr


def test_clean_removes_leftovers_alone(out: Path) -> None:
    """No run in progress, and no folder of somebody else's unless it has in it what an unfinished run has."""
    failed, interrupted, held = (
        _unfinished(name, failed=failed)
        for name, failed in {"slow": True, "killed": False, "held": False}.items()
    )
    stale, lock, thesis = (
        out / "gone-0123456789ab.lock",
        out / "poetry.lock",
        out / "thesis.incomplete",
    )
    before = finished_places(out)
    thesis.mkdir()
    for path in (stale, lock, thesis / "chapter.txt"):
        path.touch()
    shutil.copy(next(iter(before.values())) / "case.json", thesis)
    with locked([out / held.name.removesuffix(".incomplete")]):
        refused = call("clean")  # where there is no terminal
        total = refused.stdout.splitlines()[-1].partition(" to remove")[0]
        assert {*total.split(", ")} == {"1 failed run", "1 interrupted run", "1 stale lock"}
        assert (refused.returncode, "no terminal" in refused.stderr, failed.exists()) == (
            2,
            True,
            True,
        )
        call("clean", "--yes", check=True)
    assert not any(path.exists() for path in (failed, interrupted, stale))
    assert all(path.exists() for path in (held, lock, thesis / "chapter.txt"))
    assert finished_places(out) == before


def test_clean_keeps_runs_that_other_sweeps_have(out: Path) -> None:
    """With a run go its spread and its accuracy: here runs that only the accuracy has, those of beads."""
    names = ("grid", "rough", "three", "beads")
    runs = {
        name: {Path(run).name for run in walkers.load(out / name).table()["run"]} for name in names
    }
    before = finished_places(out)
    size = bytes_text(sum(size_and_last_change(out / name)[0] for name in ("grid", "rough")))
    assert (
        f"2 sweeps to remove, {size}" in call("clean", "grid", "rough", "--yes", check=True).stdout
    )
    assert before.keys() == finished_places(out).keys()
    assert not any((out / name).exists() for name in ("grid", "rough"))
    one = sorted(runs["three"] - runs["beads"])[0]
    (out / "beads").rename(out / f"{one}-accuracy")
    shutil.copytree(out / "three", out / f"{one}-spread")
    shown = call("clean", str(finished_places(out)[one]), "--yes", check=True).stdout
    assert re.search(
        rf"(?m)^{one} +finished run .*  needed by the sweep three, which would run it again$", shown
    )
    assert before.keys() - finished_places(out).keys() == (runs["beads"] - runs["three"]) | {one}
    assert not [*out.glob(f"{one}-*")]
    assert walkers.load(out / "three").table()["status"].tolist().count("missing") == 1


def test_clean_takes_no_named_run_that_a_process_computes(out: Path) -> None:
    """Nor the sweep that alone has it, nor any other run that is named beside it."""
    places = finished_places(out)
    runs = {
        name: {Path(run).name for run in walkers.load(out / name).table()["run"]}
        for name in ("beads", "three")
    }
    busy, other = sorted(runs["beads"] - runs["three"])[:2]
    shutil.rmtree(places[busy])
    with locked([out / busy]):
        for names in ((busy,), ("beads",), (other, busy)):
            ended = call("clean", *names, "--yes")
            message = f"walkers: {busy}: expected a run that is not in progress\n"
            assert (ended.returncode, ended.stderr) == (2, message)
    assert finished_places(out).keys() == places.keys() - {busy}
    assert (out / "beads" / "sweep.json").is_file()


def test_clean_holds_the_lock_and_takes_the_manifest_first(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A removal that ends in between leaves no finished run, and a run that was locked after the question stays."""
    first, second = list(finished_places(out).values())[:2]
    removals = removals_in(out, [first, second])
    with locked([second]):
        with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
            patched.setattr("walkers.runs.removal._remove_contents", _interrupted)
            remove(removals[:1])
        assert (first / "case.json").is_file() and not (first / MANIFEST_NAME).exists()
        assert first in [removal.path for removal in unfinished_in(out)]
        (kept,) = remove(removals[1:]).items()
        assert kept == (second, "kept: a process is computing it")
    assert (second / MANIFEST_NAME).is_file()
    assert remove(removals) == {}
    assert not first.exists() and not second.exists()


def _interrupted(directory: Path, *, keep: str) -> None:
    """As a removal that is interrupted at its start; the lock of the run is held."""
    assert (directory / keep).is_file()
    assert directory.with_name(f"{directory.name}.lock").is_file()
    raise KeyboardInterrupt


def test_a_removal_that_is_interrupted_leaves_the_case_until_the_end(out: Path) -> None:
    """What is left of a run can be found as long as its folder is there."""
    place = next(iter(finished_places(out).values()))
    names = {entry.name for entry in place.iterdir()}
    left = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            "walkers.runs.removal._remove_directory", lambda folder: left.extend(folder.iterdir())
        )
        remove(removals_in(out, [place]))
    assert len(names) > 3
    assert [entry.name for entry in left] == ["case.json"]


def test_a_replaced_run_is_removed_once_the_new_one_is_there(out: Path) -> None:
    """Before, it is what the run is restored from."""
    place = next(iter(finished_places(out).values()))
    left = place.with_name(f"{place.name}.replaced")
    place.rename(left)
    assert left not in [removal.path for removal in unfinished_in(out)]
    shutil.copytree(left, place)
    removals = [removal for removal in unfinished_in(out) if removal.path == left]
    assert len(removals) == 1
    assert remove(removals) == {}
    assert place.is_dir() and not left.exists()


def test_a_lock_that_a_process_has_taken_since_stays(out: Path) -> None:
    lock = out / "gone-0123456789ab.lock"
    lock.touch()
    removals = [removal for removal in unfinished_in(out) if removal.path == lock]
    with locked([lock.with_suffix("")]):
        assert remove(removals) == {lock: "kept: a process is computing it"}
        assert lock.is_file()
    lock.touch()
    assert remove(removals) == {}
    assert not lock.exists()


def test_compare_tells_parameters_and_results_of_two_runs(out: Path) -> None:
    table = walkers.load(out / "beads").table().set_index(["liquid.name", "dimers.radii[0]"])
    rows = [table.loc[("Si AK5", 0.3)], table.loc[("Si AK10", 0.3)]]
    found = json.loads(
        call("compare", *(Path(row["run"]).name for row in rows), "--json", check=True).stdout
    )
    # What is given, then what follows from it.
    assert [*found["sources"].items()] == [
        ("liquid.name", ["given"] * 2),
        *(
            (f"liquid.{name}", ["library"] * 2)
            for name in ("surface_tension", "density", "kinematic_viscosity")
        ),
        ("liquid.dynamic_viscosity", ["derived"] * 2),
    ]
    assert found["parameters"]["liquid.name"] == ["Si AK5", "Si AK10"]
    assert found["parameters"]["liquid.density"] == [920.0, 930.0]
    results = {one["quantity"]: one for one in found["results"]}
    for name, number in {"": "velocity", "_scatter": "scatter"}.items():
        sides = [results["velocity"][f"{side}{name}"] for side in ("first", "second")]
        assert sides == [row[number] for row in rows]
    assert results["velocity"]["numerical_error"] is None
    # Cases may be named, and one that was not run; changes are of the second side.
    told = call("compare", "base.toml", "fig4a", check=True).stdout
    assert "0.6 mm, 0.3 mm" in told and "fig4a: no finished run" in told
    assert (
        "all results are the same" in call("compare", "base.toml", "base.toml", check=True).stdout
    )
    for sides in (["base.toml"], ["base.toml", "base.toml"]):
        found = json.loads(
            call("compare", *sides, "--set", "drive.frequency=90Hz", "--json", check=True).stdout
        )
        assert next(iter(found["parameters"].items())) == ("drive.frequency", [80.0, 90.0])
        assert found["second"] == "base.toml drive.frequency=90Hz" == found["not_run"][0]


def test_compared_cases_show_what_follows_from_their_materials() -> None:
    """Friction, roughness, and liquid that only one case has; no defaults of a table that only one has."""
    ruby, cluster = load_case("fig1b"), load_case("cluster")
    glass = changed_case(ruby, {"beads.material": "glass"})
    text = compare_runs(Side("a", ruby, None), Side("b", glass, None)).text
    cells = {tuple(re.split("  +", line)) for line in text.splitlines()}
    assert cells >= {
        ("beads.material", "ruby", "glass", "given"),
        ("contact.friction.bead_bead", "0.11", "0.1", "calibrated / guessed"),
        ("contact.roughness.bead_bead", "28.3 nm", "990 nm", "library"),
        ("liquid.volume_fraction", "-", "0.01", "guessed"),
    }
    keys = compare_runs(Side("a", ruby, None), Side("c", cluster, None)).contents["parameters"]
    assert "dimers.radii" in keys and "dimers.replicates" not in keys


def _changed(run: Path, to: Path, name: str, error: float = 0.0, **numbers: float) -> Side:
    """A copy of a run whose result has other numbers and a numerical error of the velocity (SI), as if measured so."""
    shutil.copytree(run, to / name)
    result = read_json(to / name / "result.json")
    result["numbers"] |= numbers
    write_json(to / name / "result.json", result)
    if error:
        errors = {name: {"total": error} for name in ("velocity", "right_facing")}
        write_json(to / name / ACCURACY_NAME, {"errors": errors})
    manifest = read_json(to / name / MANIFEST_NAME)
    manifest["sha256"] |= checksums(to / name, ["result.json", *([ACCURACY_NAME] if error else [])])
    write_json(to / name / MANIFEST_NAME, manifest)
    return Side(name, case_of(run), to / name)


def test_compared_runs_differ_by_so_many_times_both_their_numerical_errors(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    """Errors of 3 and 4 µm/s make 5 µm/s of a difference of -50 µm/s; each run has its band beside it."""
    heads = {"velocity": 10, "right_facing": 20}
    settings = {**TINY, "cycles": 5}  # no other test's run
    run = run_directory(
        run=settings, uncertain={"contact": {"friction": {"bead_wall": [0.05, 0.2]}}}
    )
    fast = _changed(
        run, tmp_path, "fast", 3e-6, velocity=1.05e-3, right_facing=1.1e-3, scatter=4e-9
    )
    slow = _changed(run, tmp_path, "slow", 4e-6, velocity=1e-3, right_facing=1e-3)
    (spread := spread_of(tmp_path / "slow")).mkdir()
    band = {"velocity": {"low": 8e-4, "high": 1.2e-3, "points": 64}}
    write_json(
        spread / SPREAD_NAME, {"varied": read_json(run / "result.json")["rests_on"], "bands": band}
    )
    found = compare_runs(fast, slow)
    (velocity,) = (one for one in found.contents["results"] if one["quantity"] == "velocity")
    assert velocity["difference"] == pytest.approx(-5e-5)
    assert velocity["numerical_error"] == pytest.approx(hypot(3e-6, 4e-6))
    lines = [
        f"{name}: differs by {times} times its numerical error" for name, times in heads.items()
    ]
    lines += [
        "fast: velocity rests on 1 uncertain value, 0 guessed; the band over the ranges is not computed (--spread)",
        "slow: velocity (mm/s), band 0.8 to 1.2 (64 draws)",
        "1 uncertain value belongs to both runs and may be equal in both: "
        "the bands may overlap although the difference is certain",
    ]
    assert "\n".join(["\n", *lines, ""]) in found.text and "--accuracy" not in found.text
    assert re.search(r"\nvelocity \(mm/s\) +1\.05 +1 +-0\.05 +below 0\.001 +0\.005\n", found.text)
    assert (
        "\n\nscatter of copies: how much copies differ by their start; no error of the difference\n"
        in found.text
    )
    # Without them the table has no column for them, and a line says how to have them.
    rough = _changed(run, tmp_path, "rough", velocity=1.2e-3)
    found = compare_runs(fast, rough)
    assert (
        f"\nto measure numerical errors: walkers run {rough.directory} --accuracy\n" in found.text
    )
    assert re.search(r"\nresult +fast +rough +difference +scatter of copies\n", found.text)


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        *(
            ({"goes_uphill": True}, True),
            ({"goes_uphill": True, "upright": 0}, False),
            ({"goes_uphill": False}, False),
        ),
        ({"goes_uphill": True, "came_apart": True}, False),
    ],
)
def test_a_level_run_and_others_have_the_velocity_in_common_unless_it_says_little(
    numbers: dict[str, float], shown: bool, run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    """Of a slope it is that of walkers that face up, and is marked; on a level plate a mean over two says little."""
    run = run_directory(run=TINY)
    other = _changed(
        run, tmp_path, "other", velocity=1e-3, facings_differ=True, facing_left=3, **numbers
    )
    found = compare_runs(Side("level", case_of(run), run), other)
    shared = {row["quantity"] for row in found.contents["results"] if row["second"] is not None}
    assert bool(re.search(r"\nvelocity \(mm/s\) +[\d.]+ +1 facing up ", found.text)) == shown
    assert ("velocity" in shared) == shown and ("axial_velocity" in shared) == (
        "came_apart" not in numbers
    )


def test_values_are_shown_as_a_case_file_has_them() -> None:
    """Keys with the same last part too: of friction and of roughness."""
    values = {
        "boundary.opening": 1.0,
        "liquid.temperature": 293.15,
        "contact.friction.bead_wall": 0.2,
    }
    texts = [
        readable(key, value)
        for key, value in {**values, "drive.ramp": [[0.0, 1.0], [1.2, 0.5]]}.items()
    ]
    assert texts == ["57.2958 deg", "20 degC", "0.2", "(0 s, 1), (1.2 s, 0.5)"]


def test_a_pile_that_was_interrupted_says_how_much_of_it_is_done(in_folder: Path) -> None:
    """It continues after its last complete segment, of which there is one of three here."""
    short = {
        "longest_settling": "0 s",
        "duration": "0.03 s",
        "time_step": "3 us",
        "segment": "0.01 s",
    }
    tables = {**read_toml(shipped("case")["pile-ci"]), "run": short}
    (in_folder / "pile.toml").write_text(to_toml(tables))
    (in_folder / "piles.toml").write_text('case = "pile.toml"\n[axes]\nrun.seed = [1, 2]\n')
    program = subprocess.Popen(
        [PROGRAM, "sweep", "piles.toml", "-j", "1"],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    try:
        wait_for(lambda: list(in_folder.rglob("segments/0000/segment.json")))
    finally:
        program.kill()
        program.wait(PATIENCE)
    wait_for(lambda: not engines_in(in_folder))
    (begun,) = in_folder.rglob("*.incomplete")
    *_, last = sorted(begun.glob("segments/000?"))
    run = case_of(begun).run
    simulated = read_json(last / "segment.json")["end"] * run.time_step
    whole = run.cycles / 170.0
    assert 0.0 < simulated < whole
    share = f"{100 * simulated / whole:.0f} % done"
    told = call("list", "piles", check=True).stdout
    assert "piles: 2 points, 2 missing\n  interrupted  point 0: " + share + "\n" in told
    assert f"interrupted: {share}" in call("list", "--all", check=True).stdout
    assert f"{share}, can be continued" in call("clean").stdout


def test_exports_that_were_killed_are_removed_later(out: Path) -> None:
    """By the next export and by `clean`; a folder that an export fills and a user's folder stay."""
    run = next(iter(finished_places(out).values()))
    users, filled = run / ".vtk-mine", out / ".vtk-killed" / "new"
    (users / "notes").mkdir(parents=True)
    filled.mkdir(parents=True)
    (run / ".vtk-killed" / "new").mkdir(parents=True)
    with scratch_folder(run, ".vtk-") as busy:
        assert not (run / ".vtk-killed").exists()
        done = call("clean", "--yes", check=True)
        assert "1 unfinished export to remove" in done.stdout
        assert (busy.exists(), users.exists(), filled.exists()) == (True, True, False)
    assert not busy.parent.exists()
    (run / ".vtk-killed" / "new").mkdir(parents=True)
    call("export", str(run), "--to", "vtk", check=True)
    assert [path.name for path in run.glob(".vtk-*")] == [users.name]


def test_the_end_of_the_input_removes_nothing(out: Path) -> None:
    run = next(iter(finished_places(out).values()))
    ours, theirs = pty.openpty()
    command = [PROGRAM, "clean", run.name]
    program = subprocess.Popen(
        command, stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    os.write(ours, b"\x04")
    told, _ = program.communicate(timeout=PATIENCE)
    os.close(ours)
    os.close(theirs)
    assert (program.returncode, told.splitlines()[-1], run.exists()) == (0, "nothing removed", True)


def test_a_large_sweep_says_how_far_it_is_before_it_runs(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here of twelve points, each of which is told."""
    monkeypatch.setattr("walkers.sweeps.scheduler._RESOLVED_AT_ONCE", 1)
    sweep, told = read_sweep_record(out / "three").sweep, list[str]()
    plan = plan_sweep(
        sweep, out, SweepOptions(1), on_progress=lambda progress: told.append(progress.text)
    )
    assert [text.partition(",")[0] for text in told] == [
        f"{n} of 12 points resolved" for n in range(1, 13)
    ]
    assert len(plan.cases) == 12


def test_a_case_file_in_the_folder_of_its_run_survives_the_run(in_folder: Path) -> None:
    """As in an unpacked archive, whose case files are in the folders of their runs."""
    Path("short.toml").write_text(to_toml(document(run=SHORT)), encoding="utf-8")
    call("run", "short.toml", check=True)
    (run,) = Path("runs").glob("short-*")
    inside = Path("short.toml").rename(run / "short.toml")
    for _ in range(2):
        call("run", str(inside), "--force", check=True)
    assert inside.is_file()
    assert [path.name for path in Path("runs").glob("short-*")] == [run.name]
