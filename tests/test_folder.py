"""Runs and sweeps of a folder: listed, removed, and compared."""

from __future__ import annotations

import json
import os
import pty
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
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
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.uncertainty import ACCURACY_NAME, SPREAD_NAME, spread_of
from walkers.progress import Progress
from walkers.runner.manifest import MANIFEST_NAME, checksums
from walkers.runner.run_directory import case_of, locked
from walkers.runs.case_text import FlatCase, readable
from walkers.runs.comparison import ComparedRun, Comparison, compare_runs
from walkers.runs.listing import ListEntry, RunsOfCase, bytes_text, size_and_last_change
from walkers.runs.removal import Removal, RemovalKind, removal_text, remove, unfinished_in
from walkers.sweeps.listing import without_draws, without_members
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.removal import removals_in
from walkers.sweeps.scheduler import SweepOptions, plan_sweep

PATIENCE_OF_LOCKS = "walkers.runner.run_directory._PATIENCE_SECONDS"
"""How long a lock that another process has is waited for."""
COMPUTING = "kept: a process is computing it"
"""Why a removal leaves a run or a lock."""


@pytest.fixture
def out(looked_through: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the folder, as ``runs`` of the current one, with the case of its sweeps."""
    shutil.copytree(looked_through, tmp_path / "runs")
    shutil.copy(looked_through.parent / "base.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    yield Path("runs")


@dataclass(frozen=True)
class Unfinished:
    """Directories of a run that failed and of one that was interrupted."""

    failed: Path
    interrupted: Path


@pytest.fixture(scope="session")
def unfinished_runs(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A folder with two runs that a time limit of 10 ms has ended."""

    def fill(folder: Path) -> None:
        for name in ("slow", "killed"):
            (folder / f"{name}.toml").write_text(to_toml(document(run={**TINY, "cycles": 4000})))
            ended = call("run", f"{name}.toml", "--limit", "0.01", folder=folder)
            assert ended.returncode == 1
        # A run that was killed has no file that says why it failed.
        (killed,) = folder.glob("runs/killed-*.incomplete")
        (killed / "failure.json").unlink()

    return once("unfinished-runs", fill) / "runs"


@pytest.fixture
def unfinished(out: Path, unfinished_runs: Path) -> Unfinished:
    """Two unfinished runs in the folder, beside the finished ones."""
    shutil.copytree(unfinished_runs, out, dirs_exist_ok=True)
    (failed,) = out.glob("slow-*.incomplete")
    (interrupted,) = out.glob("killed-*.incomplete")
    return Unfinished(failed, interrupted)


def _run_name(directory: Path) -> str:
    """The name of an unfinished run."""
    return directory.name.removesuffix(".incomplete")


def _first_run(out: Path) -> Path:
    """The directory of a finished run of the folder."""
    return next(iter(finished_places(out).values()))


def _names_of_points(sweep: Path) -> set[str]:
    """Names of the runs of a sweep."""
    return {Path(run).name for run in walkers.load(sweep).table()["run"]}


def _listed(*arguments: str) -> list[dict[str, Any]]:
    """Rows of ``walkers list --json --all``."""
    rows: list[dict[str, Any]] = json.loads(
        call("list", "--json", "--all", *arguments, check=True).stdout
    )
    return rows


def _listed_runs() -> dict[str, dict[str, Any]]:
    """Rows of runs by name."""
    return {row["name"]: row for row in _listed() if row["kind"] == "run"}


def _listed_numbers() -> dict[str, object]:
    """Results of runs and sweeps by name."""
    numbers = {}
    for row in _listed():
        numbers[row["name"]] = row["numbers"]
    return numbers


def _row_with(rows: list[dict[str, Any]], column: str, value: str) -> dict[str, Any]:
    """The only row that has a value in a column."""
    (row,) = (row for row in rows if row[column] == value)
    return row


def _size_of(directory: Path) -> int:
    """Bytes of all files of a directory."""
    return sum(path.stat().st_size for path in directory.rglob("*") if path.is_file())


def test_a_sweep_is_listed_with_its_axes_and_the_status_of_its_points(out: Path) -> None:
    sweep = _row_with(_listed(), "name", "three")
    assert sweep["varies"] == {
        "contact.friction.bead_wall": 2,
        "drive.frequency": 2,
        "drive.peak_acceleration": 3,
    }
    assert sweep["points"] == {"finished": 12}  # 2 frictions, 2 frequencies, 3 accelerations


def test_all_runs_are_listed_finished_or_not(out: Path, unfinished: Unfinished) -> None:
    assert _listed_runs().keys() == {
        *finished_places(out),
        _run_name(unfinished.failed),
        _run_name(unfinished.interrupted),
    }


def test_a_finished_run_is_listed_with_its_velocity_and_size(out: Path) -> None:
    rows = _listed_runs()
    for _, point in walkers.load(out / "three").table().iterrows():
        directory = Path(point["run"])
        row = rows[directory.name]
        assert row["status"] == "finished"
        assert row["velocity"] == point["velocity"]
        assert row["size"] == _size_of(directory)


def test_unfinished_runs_are_listed_as_failed_or_interrupted(
    out: Path, unfinished: Unfinished
) -> None:
    rows = _listed_runs()
    failed = rows[_run_name(unfinished.failed)]
    assert (failed["status"], failed["reason"]) == ("failed", "TimeLimitExceeded")
    assert rows[_run_name(unfinished.interrupted)]["status"] == "interrupted"


def test_the_run_that_a_process_computes_is_listed_as_running(
    out: Path, unfinished: Unfinished
) -> None:
    """A process has the lock of the run that it computes."""
    running = _run_name(unfinished.interrupted)
    with locked([out / running]):
        rows = _listed_runs()
    for name, row in rows.items():
        assert (row["status"] == "running") == (name == running)


def test_listing_reads_neither_dumps_nor_tables(out: Path) -> None:
    before = _listed_numbers()
    for pattern in ("*.bin", "*.parquet", "*.txt"):
        for path in list(out.rglob(pattern)):
            path.unlink()
    assert _listed_numbers() == before


def test_list_tells_the_values_that_differ_between_runs(out: Path) -> None:
    accelerations = set()
    for row in _listed_runs().values():
        accelerations.add(row["varies"]["drive.peak_acceleration"])
    assert accelerations == {19.6, 39.2, 58.8}  # 2 g, 4 g and 6 g with g = 9.8 m/s²


def test_list_has_a_column_for_each_value_that_differs(out: Path) -> None:
    lines = call("list", "--all", check=True).stdout.splitlines()
    (head,) = (line.split() for line in lines if line.startswith("base ("))
    assert head[2:6] == ["status", "result", "age", "size"]
    assert {"frequency", "peak_acceleration", "friction.bead_wall"} <= set(head)


def test_list_hides_runs_of_sweeps_unless_they_were_asked_for(out: Path) -> None:
    place = Path(walkers.load(out / "grid").table()["run"][0])
    assert place.name not in call("list", check=True).stdout
    walkers.run(walkers.Run(place).case, out)
    assert f"\n{place.name}  finished" in call("list", check=True).stdout


def _list_where(conditions: list[str]) -> subprocess.CompletedProcess[str]:
    """``walkers list`` of the runs that meet all conditions."""
    arguments = []
    for condition in conditions:
        arguments += ["--where", condition]
    return call("list", "--json", *arguments)


@pytest.mark.parametrize(
    ("conditions", "number"),
    [
        # 2 g, 4 g and 6 g of the sweeps grid and three, and the same walker with Si AK10.
        (["drive.frequency=0.08 kHz", "friction.bead_wall=0.1", "radii=0.3 mm, 0.2 mm"], 4),
        # 60 and 80 Hz at 2 g, 4 g and 6 g.
        (["friction.bead_wall=0.2"], 6),
        (["friction.bead_wall=0.3"], 0),
    ],
    ids=["three values in other units", "a value", "a value that no run has"],
)
def test_list_selects_by_values(out: Path, conditions: list[str], number: int) -> None:
    assert len(json.loads(_list_where(conditions).stdout)) == number


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("colour=red", '"colour=red": no run has such a key'),
        ("speed>1 mm/s", 'no run has such a key; did you mean "velocity"?'),
        ("friction.bead_wall=5 mm", 'friction.bead_wall=5 mm": expected a number without a unit'),
    ],
    ids=["unknown key", "other word", "wrong unit"],
)
def test_list_refuses_a_condition_that_no_run_can_meet(
    out: Path, condition: str, message: str
) -> None:
    ended = _list_where([condition])
    assert ended.returncode == 2
    assert message in ended.stderr


def test_draws_of_an_earlier_number_of_points_are_hidden_with_those_of_the_last() -> None:
    def run(name: str) -> ListEntry:
        return ListEntry(kind="run", name=name, case="a", status="finished", directory=Path(name))

    old = run("a-0-spread/a-1")
    new = run("a-0-spread/a-2")
    asked_for = run("a-0")
    spread = ListEntry(
        kind="sweep",
        name="a-0-spread",
        case="a",
        status="finished",
        directory=Path("a-0-spread"),
        runs=[new.name],
    )
    assert without_members([spread, asked_for, old, new]) == [spread, asked_for]
    assert without_draws([spread, asked_for, old, new]) == [spread, asked_for]


@pytest.mark.parametrize(
    ("second", "texts"),
    [
        pytest.param(7.0e-5, ["79.84 µm", "70 µm"], id="apart"),
        pytest.param(7.98356e-5, ["79.8355 µm", "79.8356 µm"], id="close"),
    ],
)
def test_values_that_no_run_gives_are_listed_with_four_digits(
    second: float, texts: list[str]
) -> None:
    runs = []
    for radius in (7.98355e-5, second):
        place = Path(f"a-{len(runs)}")
        parameters = FlatCase({"liquid.meniscus_radius": radius})
        run = ListEntry(
            kind="run",
            name=place.name,
            case="a",
            status="finished",
            directory=place,
            parameters=parameters,
        )
        runs.append(run)
    listed = RunsOfCase("a", runs, ["liquid.meniscus_radius"]).as_text()
    for line, text in zip(listed.splitlines()[1:], texts, strict=True):
        assert line.endswith(f"  {text}")


def test_a_resting_walker_is_called_so_everywhere(out: Path) -> None:
    """At 0.2 g and 0.3 g the beads stay on the substrate; the velocity is tiny, not zero."""
    Path("rest.toml").write_text(
        'case = "base.toml"\n[axes]\ndrive.peak_acceleration = ["0.2 g", "0.3 g"]\n'
    )
    call("sweep", "rest.toml", check=True)
    table = walkers.load(out / "rest").table()
    run = table["run"][0]
    assert (table["velocity"].abs() > 0.0).all()
    assert ": at rest (below 0.002 mm/s)" in call("run", run, check=True).stdout
    assert call("list", "--all", check=True).stdout.count(" at rest ") == 2
    assert repr(walkers.load(run)) == f"Run({run}: finished, at rest)"


def test_the_table_of_a_sweep_is_the_users_own_to_change(out: Path) -> None:
    sweep = walkers.load(out / "grid")
    changed = sweep.table()
    changed["velocity"] = 0.0
    assert (sweep.table()["velocity"] != 0.0).all()


def test_the_table_of_a_finished_sweep_is_read_once_until_it_is_refreshed(out: Path) -> None:
    """That of an unfinished sweep is read each time: its points may be finished meanwhile."""
    sweep = walkers.load(out / "grid")
    run = Path(sweep.table()["run"][0])
    away = run.rename(f"{run}.away")
    assert sweep.status == "finished"
    assert sweep.refresh().table()["status"].tolist().count("missing") == 1
    away.rename(run)
    assert sweep.status == "finished"


@pytest.mark.parametrize("command", ["list grid", "clean rough --yes"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(
            {"format": 99},
            "its format is 99, expected 4); run the sweep again: finished runs are kept",
            id="another_format",
        ),
        pytest.param(
            {"runs": ["base-0123456789ab"]}, "1 runs, expected the names of 6", id="too_few_runs"
        ),
        pytest.param({"base": None}, "cannot be read", id="no_base"),
        pytest.param(
            {"file": {"case": "base", "axes": {"drive.frequncy": [1]}}},
            'did you mean "frequency"',
            id="unknown_key",
        ),
    ],
)
def test_a_sweep_record_that_cannot_be_used_is_refused(
    out: Path, change: dict[str, Any], message: str, command: str
) -> None:
    """Also by removals of another sweep, which must know what the damaged one needs."""
    record = read_json(out / "grid" / "sweep.json")
    write_json(out / "grid" / "sweep.json", record | change)
    done = call(*command.split())
    assert done.returncode == 2
    assert message in done.stderr


@pytest.fixture
def leftovers(out: Path, unfinished: Unfinished) -> list[Path]:
    """What `clean` removes: two unfinished runs and a lock without a process."""
    lock = out / "gone-0123456789ab.lock"
    lock.touch()
    return [unfinished.failed, unfinished.interrupted, lock]


def test_clean_without_a_terminal_lists_leftovers_and_removes_nothing(
    leftovers: list[Path],
) -> None:
    refused = call("clean")
    total = refused.stdout.splitlines()[-1].partition(" to remove")[0]
    assert set(total.split(", ")) == {"1 failed run", "1 interrupted run", "1 stale lock"}
    assert refused.returncode == 2
    assert "no terminal" in refused.stderr
    for path in leftovers:
        assert path.exists()


def test_clean_removes_leftovers_alone(out: Path, leftovers: list[Path]) -> None:
    before = finished_places(out)
    call("clean", "--yes", check=True)
    for path in leftovers:
        assert not path.exists()
    assert finished_places(out) == before


def test_clean_keeps_an_unfinished_run_in_progress(out: Path, unfinished: Unfinished) -> None:
    with locked([out / _run_name(unfinished.interrupted)]):
        shown = call("clean", "--yes", check=True).stdout
    assert "1 failed run to remove" in shown
    assert unfinished.interrupted.is_dir()
    assert not unfinished.failed.exists()


def test_clean_keeps_files_of_users_with_similar_names(out: Path) -> None:
    """A lock of another program, and a folder ``*.incomplete`` that is no run directory."""
    lock = out / "poetry.lock"
    lock.touch()
    thesis = out / "thesis.incomplete"
    thesis.mkdir()
    (thesis / "chapter.txt").touch()
    shutil.copy(_first_run(out) / "case.json", thesis)
    assert "nothing to remove" in call("clean", "--yes", check=True).stdout
    assert lock.exists()
    assert (thesis / "chapter.txt").exists()


def test_clean_keeps_runs_that_other_sweeps_have(out: Path) -> None:
    """All runs of the sweeps grid and rough are runs of the sweep three, too."""
    before = finished_places(out)
    size_of_grid, _ = size_and_last_change(out / "grid")
    size_of_rough, _ = size_and_last_change(out / "rough")
    shown = call("clean", "grid", "rough", "--yes", check=True).stdout
    assert f"2 sweeps to remove, {bytes_text(size_of_grid + size_of_rough)}" in shown
    assert finished_places(out).keys() == before.keys()
    assert not (out / "grid").exists()
    assert not (out / "rough").exists()


def test_clean_keeps_runs_of_a_sweep_that_were_run_by_themselves(
    out: Path, run_of_three: str
) -> None:
    place = finished_places(out)[run_of_three]
    others = _names_of_points(out / "beads") - _names_of_points(out / "three")
    walkers.run(walkers.Run(place).case, out)
    call("clean", "three", "beads", "--yes", check=True)
    left = finished_places(out)
    assert run_of_three in left
    assert left.keys().isdisjoint(others)
    call("clean", run_of_three, "--yes", check=True)
    assert run_of_three not in finished_places(out)


@pytest.fixture
def run_of_three(out: Path) -> str:
    """A run that the sweep three alone has: friction 0.2, 6 g."""
    names = _names_of_points(out / "three")
    for sweep in ("grid", "rough", "beads"):
        names -= _names_of_points(out / sweep)
    return sorted(names)[0]


def test_clean_says_which_sweep_needs_a_named_run(out: Path, run_of_three: str) -> None:
    shown = call("clean", str(finished_places(out)[run_of_three]), "--yes", check=True).stdout
    assert re.search(
        rf"(?m)^{run_of_three} +finished run .*  "
        r"needed by the sweep three, which would run it again$",
        shown,
    )
    statuses = walkers.load(out / "three").table()["status"].tolist()
    assert statuses.count("missing") == 1


def test_the_total_of_a_removal_counts_draws_in_a_spread_once(tmp_path: Path) -> None:
    spread = tmp_path / "a-0-spread"
    draw = spread / "a-1"
    draw.mkdir(parents=True)
    (draw / "dumps").write_bytes(bytes(4000))
    (spread / "sweep.json").write_bytes(bytes(200))
    removals = [
        Removal(spread, RemovalKind.SWEEP),
        Removal(draw, RemovalKind.RUN, "finished"),
    ]
    total = removal_text(removals).splitlines()[-1]
    assert total == "1 sweep, 1 finished run to remove, 4.2 kB"


def test_clean_removes_with_a_run_its_spread_and_its_accuracy(out: Path, run_of_three: str) -> None:
    """And runs that only its accuracy has; runs that its spread shares with a sweep stay."""
    of_accuracy_alone = _names_of_points(out / "beads") - _names_of_points(out / "three")
    before = finished_places(out)
    (out / "beads").rename(out / f"{run_of_three}-accuracy")
    shutil.copytree(out / "three", out / f"{run_of_three}-spread")
    call("clean", str(before[run_of_three]), "--yes", check=True)
    assert before.keys() - finished_places(out).keys() == of_accuracy_alone | {run_of_three}
    assert not list(out.glob(f"{run_of_three}-*"))


@pytest.mark.parametrize(
    "names",
    ["{busy}", "beads", "{idle} {busy}"],
    ids=["the run", "its sweep", "the run and another one"],
)
def test_clean_takes_no_named_run_that_a_process_computes(out: Path, names: str) -> None:
    """Nor the sweep that alone has it, nor any other run that is named beside it."""
    places = finished_places(out)
    of_beads_alone = sorted(_names_of_points(out / "beads") - _names_of_points(out / "three"))
    busy, idle = of_beads_alone[:2]
    shutil.rmtree(places[busy])
    with locked([out / busy]):
        ended = call("clean", *names.format(busy=busy, idle=idle).split(), "--yes")
    assert ended.returncode == 2
    assert ended.stderr == f"walkers: {busy}: expected a run that is not in progress\n"
    assert finished_places(out).keys() == places.keys() - {busy}
    assert (out / "beads" / "sweep.json").is_file()


def _unfinished_at(out: Path, path: Path) -> list[Removal]:
    """What `clean` removes at a path."""
    return [removal for removal in unfinished_in(out) if removal.path == path]


def _interrupt_removal(directory: Path, *, keep: str) -> None:
    """Interrupt a removal at its start, when it holds the lock of the run."""
    assert (directory / keep).is_file()
    assert directory.with_name(f"{directory.name}.lock").is_file()
    raise KeyboardInterrupt


def test_a_removal_takes_the_manifest_first_and_can_be_repeated(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If it ends in between, what is left is no finished run."""
    run = _first_run(out)
    removals = removals_in(out, [run])
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("walkers.runs.removal._remove_contents", _interrupt_removal)
        remove(removals)
    assert (run / "case.json").is_file()
    assert not (run / MANIFEST_NAME).exists()
    assert len(_unfinished_at(out, run)) == 1
    assert remove(removals) == {}
    assert not run.exists()


def test_a_run_that_was_locked_after_the_question_stays(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    run = _first_run(out)
    removals = removals_in(out, [run])
    with locked([run]):
        assert remove(removals) == {run: COMPUTING}
    assert (run / MANIFEST_NAME).is_file()
    assert remove(removals) == {}
    assert not run.exists()


def test_a_removal_that_is_interrupted_leaves_the_case_until_the_end(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is left of a run can be found as long as its folder is there."""
    run = _first_run(out)
    assert len(list(run.iterdir())) > 3
    removals = removals_in(out, [run])
    last_names = []

    def note_contents(folder: Path) -> None:
        """Stand for the last step of a removal, which removes the folder."""
        for entry in folder.iterdir():
            last_names.append(entry.name)

    monkeypatch.setattr("walkers.runs.removal._remove_directory", note_contents)
    remove(removals)
    assert last_names == ["case.json"]


def test_a_replaced_run_is_removed_once_the_new_one_is_there(out: Path) -> None:
    """Before, it is what the run is restored from."""
    run = _first_run(out)
    replaced = run.rename(run.with_name(f"{run.name}.replaced"))
    assert _unfinished_at(out, replaced) == []
    shutil.copytree(replaced, run)
    removals = _unfinished_at(out, replaced)
    assert len(removals) == 1
    assert remove(removals) == {}
    assert run.is_dir()
    assert not replaced.exists()


def test_a_lock_that_a_process_has_taken_since_stays(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    lock = out / "gone-0123456789ab.lock"
    lock.touch()
    removals = _unfinished_at(out, lock)
    with locked([lock.with_suffix("")]):
        assert remove(removals) == {lock: COMPUTING}
        assert lock.is_file()
    lock.touch()
    assert remove(removals) == {}
    assert not lock.exists()


def _compared(*arguments: str) -> dict[str, Any]:
    """What ``walkers compare --json`` prints."""
    contents: dict[str, Any] = json.loads(call("compare", *arguments, "--json", check=True).stdout)
    return contents


def test_compare_tells_given_values_before_those_that_follow(out: Path) -> None:
    table = walkers.load(out / "beads").table().set_index(["liquid.name", "dimers.radii[0]"])
    first = Path(table.loc[("Si AK5", 0.3)]["run"])
    second = Path(table.loc[("Si AK10", 0.3)]["run"])
    contents = _compared(first.name, second.name)
    assert list(contents["sources"].items()) == [
        ("liquid.name", ["given", "given"]),
        ("liquid.surface_tension", ["library", "library"]),
        ("liquid.density", ["library", "library"]),
        ("liquid.kinematic_viscosity", ["library", "library"]),
        ("liquid.dynamic_viscosity", ["derived", "derived"]),
    ]
    assert contents["parameters"]["liquid.name"] == ["Si AK5", "Si AK10"]
    assert contents["parameters"]["liquid.density"] == [920.0, 930.0]  # of the library, kg/m³


def test_compare_tells_the_velocities_of_two_runs_and_their_scatter(out: Path) -> None:
    first, second = walkers.load(out / "beads").table().to_dict("records")[:2]
    contents = _compared(Path(first["run"]).name, Path(second["run"]).name)
    velocity = _row_with(contents["results"], "quantity", "velocity")
    assert velocity["first"] == first["velocity"]
    assert velocity["second"] == second["velocity"]
    assert velocity["first_scatter"] == first["scatter"]
    assert velocity["second_scatter"] == second["scatter"]
    assert velocity["numerical_error"] is None


def test_cases_can_be_compared_without_a_run(out: Path) -> None:
    shown = call("compare", "base.toml", "fig4a", check=True).stdout
    assert "0.6 mm, 0.3 mm" in shown
    assert "fig4a: no finished run" in shown


def test_a_run_compared_with_itself_has_the_same_results(out: Path) -> None:
    shown = call("compare", "base.toml", "base.toml", check=True).stdout
    assert "all results are the same" in shown


@pytest.mark.parametrize(
    "sides", [["base.toml"], ["base.toml", "base.toml"]], ids=["one side", "both sides"]
)
def test_values_that_are_set_are_those_of_the_second_side(out: Path, sides: list[str]) -> None:
    contents = _compared(*sides, "--set", "drive.frequency=90Hz")
    assert next(iter(contents["parameters"].items())) == ("drive.frequency", [80.0, 90.0])
    assert contents["second"] == "base.toml drive.frequency=90Hz"
    assert contents["not_run"][0] == contents["second"]


def test_compared_cases_show_what_follows_from_their_materials() -> None:
    """Friction, roughness, and liquid that only one case has."""
    ruby = load_case("fig1b")
    glass = changed_case(ruby, {"beads.material": "glass"})
    text = compare_runs(ComparedRun("a", ruby, None), ComparedRun("b", glass, None)).text
    cells = {tuple(re.split("  +", line)) for line in text.splitlines()}
    assert cells >= {
        ("beads.material", "ruby", "glass", "given"),
        (
            "contact.friction.bead_bead",
            "0.05 + 3.5 v/(v + 1000 mm/s)",
            "0.1",
            "calibrated / assumed / guessed",
        ),
        ("contact.friction.bead_wall", "0.2", "0.25", "calibrated / guessed"),
        ("contact.roughness.bead_bead", "28.3 nm", "990 nm", "library"),
        ("liquid.volume_fraction", "-", "0.01", "guessed"),
    }


def test_defaults_of_a_table_that_one_case_has_are_not_compared() -> None:
    dimer = ComparedRun("dimer", load_case("fig1b"), None)
    cluster = ComparedRun("cluster", load_case("cluster"), None)
    keys = compare_runs(dimer, cluster).contents["parameters"]
    assert "dimers.radii" in keys
    assert "dimers.replicates" not in keys


def _changed_run(run: Path, to: Path, numbers: dict[str, float], error: float = 0.0) -> ComparedRun:
    """Copy a run and give the copy other numbers of its result, and numerical errors.

    ``error`` is that of the velocity and of `right_facing`, in m/s; 0 if none was measured.
    """
    shutil.copytree(run, to)
    changed_files = ["result.json"]
    result = read_json(to / "result.json")
    result["numbers"] |= numbers
    write_json(to / "result.json", result)
    if error:
        errors = {"velocity": {"total": error}, "right_facing": {"total": error}}
        write_json(to / ACCURACY_NAME, {"errors": errors})
        changed_files.append(ACCURACY_NAME)
    manifest = read_json(to / MANIFEST_NAME)
    manifest["sha256"] |= checksums(to, changed_files)
    write_json(to / MANIFEST_NAME, manifest)
    return ComparedRun(to.name, case_of(run), to)


@pytest.fixture
def uncertain_run(run_directory: Callable[..., Path]) -> Path:
    """A run with one uncertain value, and a number of cycles that no other test has."""
    ranges = {"contact": {"friction": {"bead_wall": [0.05, 0.2]}}}
    return run_directory(run={**TINY, "cycles": 5}, uncertain=ranges)


@pytest.fixture
def fast(uncertain_run: Path, tmp_path: Path) -> ComparedRun:
    """A run of 1.05 mm/s, 1.1 mm/s of those facing right, with errors of 3 µm/s."""
    numbers = {"velocity": 1.05e-3, "right_facing": 1.1e-3, "scatter": 4e-9}
    return _changed_run(uncertain_run, tmp_path / "fast", numbers, error=3e-6)


@pytest.fixture
def slow(uncertain_run: Path, tmp_path: Path) -> ComparedRun:
    """A run of 1 mm/s, 1 mm/s of those facing right, with errors of 4 µm/s, and a band."""
    numbers = {"velocity": 1e-3, "right_facing": 1e-3}
    slow = _changed_run(uncertain_run, tmp_path / "slow", numbers, error=4e-6)
    spread = spread_of(tmp_path / "slow")
    spread.mkdir()
    varied = read_json(uncertain_run / "result.json")["rests_on"]
    bands = {"velocity": {"low": 8e-4, "high": 1.2e-3, "points": 64}}
    write_json(spread / SPREAD_NAME, {"varied": varied, "bands": bands})
    return slow


@pytest.fixture
def fast_and_slow(fast: ComparedRun, slow: ComparedRun) -> Comparison:
    return compare_runs(fast, slow)


def _notes(comparison: Comparison) -> list[str]:
    """Lines about the significance of the differences, a paragraph of their own."""
    (paragraph,) = (part for part in comparison.text.split("\n\n") if "differs by" in part)
    return paragraph.splitlines()


def test_compared_runs_have_the_error_of_their_difference(fast_and_slow: Comparison) -> None:
    """1 mm/s less 1.05 mm/s; independent errors of 3 and 4 µm/s make √(3² + 4²) = 5 µm/s."""
    velocity = _row_with(fast_and_slow.contents["results"], "quantity", "velocity")
    assert velocity["difference"] == pytest.approx(-50e-6)
    assert velocity["numerical_error"] == pytest.approx(5e-6)
    assert re.search(
        r"\nvelocity \(mm/s\) +1\.05 +1 +-0\.05 +below 0\.001 +0\.005\n", fast_and_slow.text
    )


def test_compared_runs_differ_by_so_many_times_their_numerical_error(
    fast_and_slow: Comparison,
) -> None:
    """50 µm/s and 100 µm/s are 10 and 20 times 5 µm/s."""
    assert _notes(fast_and_slow)[:2] == [
        "velocity: differs by 10 times its numerical error",
        "right_facing: differs by 20 times its numerical error",
    ]


def test_compared_runs_tell_their_bands_or_how_to_have_them(fast_and_slow: Comparison) -> None:
    assert _notes(fast_and_slow)[2:] == [
        "fast: velocity rests on 1 uncertain value, 0 guessed; "
        "the band over the ranges is not computed (--spread)",
        "slow: velocity (mm/s), band 0.8 to 1.2 (64 draws)",
        "the runs have 1 uncertain value in common, which may shift both results alike: "
        "the difference can be certain even if the bands overlap",
    ]


def test_a_comparison_counts_the_uncertain_values_that_were_guessed(
    run_directory: Callable[..., Path], fast: ComparedRun
) -> None:
    """The case gives a range of one friction; that of a wall of glass, 0.1 to 0.6, is a guess."""
    tables = document(
        run={**TINY, "cycles": 5},
        boundary={"material": "glass"},
        uncertain={"contact": {"friction": {"bead_bead": [0.05, 0.2]}}},
    )
    del tables["contact"]["friction"]["bead_wall"]
    case = build_case(tables, name="test")
    glass = ComparedRun("glass", case, run_directory(case))
    assert (
        "glass: velocity rests on 2 uncertain values, 1 guessed; "
        "the band over the ranges is not computed (--spread)"
    ) in compare_runs(fast, glass).text.splitlines()


def test_a_comparison_says_that_scatter_is_no_error(fast_and_slow: Comparison) -> None:
    assert (
        "\n\nscatter of copies: how much copies differ by their start; "
        "it is not an error of the difference\n"
    ) in fast_and_slow.text


def test_numerical_errors_are_a_column_only_if_both_runs_have_them(
    fast: ComparedRun, fast_and_slow: Comparison, uncertain_run: Path, tmp_path: Path
) -> None:
    """Else a line says how to have them."""
    rough = _changed_run(uncertain_run, tmp_path / "rough", {"velocity": 1.2e-3})
    text = compare_runs(fast, rough).text
    assert re.search(r"\nresult +fast +rough +difference +scatter of copies\n", text)
    assert f"\nto measure numerical errors: walkers run {rough.directory} --accuracy\n" in text
    assert "--accuracy" not in fast_and_slow.text


@pytest.mark.parametrize(
    ("numbers", "velocity_is_shown", "axial_velocity_is_shown"),
    [
        pytest.param({"goes_uphill": True}, True, True, id="uphill"),
        pytest.param({"goes_uphill": True, "upright": 0}, False, True, id="none upright"),
        pytest.param({"goes_uphill": False}, False, True, id="level"),
        pytest.param({"goes_uphill": True, "came_apart": True}, False, False, id="came apart"),
    ],
)
def test_runs_have_the_velocity_in_common_unless_it_says_little(
    numbers: dict[str, float],
    velocity_is_shown: bool,
    axial_velocity_is_shown: bool,
    run_directory: Callable[..., Path],
    tmp_path: Path,
) -> None:
    """A level run beside one whose walkers face both ways and walk at 1 mm/s.

    Of a slope the velocity is that of walkers that face up, and is marked; on a level substrate a
    mean over walkers of both directions says little.
    """
    run = run_directory(run=TINY)
    level = ComparedRun("level", case_of(run), run)
    both_ways = {"velocity": 1e-3, "facings_differ": True, "facing_left": 3}
    comparison = compare_runs(level, _changed_run(run, tmp_path / "both", both_ways | numbers))
    marked = re.search(r"\nvelocity \(mm/s\) +[\d.]+ +1 facing up ", comparison.text)
    assert (marked is not None) == velocity_is_shown
    rows = comparison.contents["results"]
    shared = {row["quantity"] for row in rows if row["second"] is not None}
    assert ("velocity" in shared) == velocity_is_shown
    assert ("axial_velocity" in shared) == axial_velocity_is_shown


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("boundary.opening", 1.0, "57.2958 deg"),  # 180°/π
        ("liquid.temperature", 293.15, "20 degC"),
        ("contact.friction.bead_wall", 0.2, "0.2"),  # roughness.bead_wall is a length
        ("drive.ramp", [[0.0, 1.0], [1.2, 0.5]], "(0 s, 1), (1.2 s, 0.5)"),
    ],
)
def test_values_are_shown_as_a_case_file_has_them(key: str, value: object, text: str) -> None:
    assert readable(key, value) == text


@pytest.fixture
def interrupted_pile(in_folder: Path) -> Path:
    """The folder of a pile that was killed after the first of its three segments, in a sweep."""
    brief = {
        "longest_settling": "0 s",
        "duration": "0.03 s",
        "time_step": "3 us",
        "segment": "0.01 s",
    }
    pile = read_toml(shipped("case")["pile-ci"]) | {"run": brief}
    (in_folder / "pile.toml").write_text(to_toml(pile))
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
    # The worker of the sweep ends a little later than the program that was killed.
    wait_for(lambda: "running" not in call("list", "piles").stdout)
    (directory,) = in_folder.rglob("*.incomplete")
    return directory


def test_a_pile_that_was_interrupted_says_how_much_of_it_is_done(interrupted_pile: Path) -> None:
    """It continues after its last complete segment."""
    last_segment = sorted(interrupted_pile.glob("segments/000?"))[-1]
    run = case_of(interrupted_pile).run
    simulated = read_json(last_segment / "segment.json")["end"] * run.time_step
    whole = run.cycles / 170.0  # the shipped pile is shaken at 170 Hz
    assert 0.0 < simulated < whole
    share = f"{100 * simulated / whole:.0f} % done"
    of_sweep = call("list", "piles", check=True).stdout
    assert f"piles: 2 points, 2 missing\n  interrupted  point 0: {share}\n" in of_sweep
    assert f"interrupted: {share}" in call("list", "--all", check=True).stdout
    assert f"{share}, can be continued" in call("clean").stdout


def _killed_export(folder: Path) -> Path:
    """What is left in a folder of an export that was killed."""
    export = folder / ".vtk-killed"
    (export / "new").mkdir(parents=True)
    return export


def test_the_next_export_removes_exports_that_were_killed(out: Path) -> None:
    """A user's folder with a similar name stays."""
    run = _first_run(out)
    users = run / ".vtk-mine"
    (users / "notes").mkdir(parents=True)
    _killed_export(run)
    call("export", str(run), "--format", "vtk", check=True)
    assert list(run.glob(".vtk-*")) == [users]


def test_clean_removes_exports_that_were_killed(out: Path) -> None:
    """Of runs and of the folder of runs; folders that an export fills or a user made stay."""
    run = _first_run(out)
    users = run / ".vtk-mine"
    (users / "notes").mkdir(parents=True)
    with scratch_folder(run, ".vtk-") as busy:
        in_run = _killed_export(run)
        in_runs = _killed_export(out)
        done = call("clean", "--yes", check=True)
        assert busy.exists()
    assert "2 unfinished exports to remove" in done.stdout
    assert users.exists()
    assert not in_run.exists()
    assert not in_runs.exists()


def test_a_scratch_folder_takes_the_place_of_those_that_were_killed(out: Path) -> None:
    """And is gone afterwards."""
    run = _first_run(out)
    killed = _killed_export(run)
    with scratch_folder(run, ".vtk-") as busy:
        assert busy.exists()
        assert not killed.exists()
    assert not busy.parent.exists()


def test_the_end_of_the_input_removes_nothing(out: Path) -> None:
    """Ctrl-D (the byte 4) on a terminal, as an answer to the question of `clean`."""
    run = _first_run(out)
    ours, theirs = pty.openpty()
    program = subprocess.Popen(
        [PROGRAM, "clean", run.name],
        stdin=theirs,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    os.write(ours, b"\x04")
    printed, _ = program.communicate(timeout=PATIENCE)
    os.close(ours)
    os.close(theirs)
    assert program.returncode == 0
    assert printed.splitlines()[-1] == "nothing removed"
    assert run.exists()


def test_a_large_sweep_says_how_far_it_is_before_it_runs(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here a sweep of twelve points is large, and each point is told."""
    monkeypatch.setattr("walkers.sweeps.scheduler._RESOLVED_AT_ONCE", 1)
    sweep = read_sweep_record(out / "three").sweep
    texts = []

    def note(progress: Progress) -> None:
        texts.append(progress.text.partition(",")[0])

    plan = plan_sweep(sweep, out, SweepOptions(1), on_progress=note)
    assert texts == [f"{number} of 12 points resolved" for number in range(1, 13)]
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
    assert list(Path("runs").glob("short-*")) == [run]
