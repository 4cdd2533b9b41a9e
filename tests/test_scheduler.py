"""Sweeps run by the real engine: decks, failures, resumption, tables, sites and SLURM."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from tests.cluster import LOCAL, slurm_cluster, why_not
from tests.conftest import (
    PATIENCE,
    PROGRAM,
    TINY,
    FillOnce,
    bits,
    call,
    document,
    finished_places,
    make_case,
    to_toml,
    wait_for,
    write_engine,
)
from walkers.errors import InputError
from walkers.files import read_json, write_json
from walkers.inputs.resolving.loads import dimer_of, path_length
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.progress import Progress
from walkers.runner.binary import find_engine
from walkers.runner.failures import WalkersMet
from walkers.runner.run_directory import case_of, unfinished
from walkers.runs.making import DECK_FOLDER, make_runs, progress_at
from walkers.sweeps.packing import (
    LONGEST_SECONDS,
    MOST_WALKERS,
    PlannedDeck,
    makespan,
    pack,
)
from walkers.sweeps.record import write_record
from walkers.sweeps.scheduler import (
    SweepOptions,
    SweepReplacedWarning,
    plan_sweep,
    run_sweep,
)
from walkers.sweeps.site import check_path, decks_at, load_site, prepare
from walkers.sweeps.table import load_table, thresholds
from walkers.sweeps.workers import SweepStopped
from walkers.templates.deck import LAYOUT_NAME, OUTPUT_NAME, compose, plan_of
from walkers.templates.placement import sharing_key

if TYPE_CHECKING:
    from parsl.config import Config

STEP = {"time_step": "2 us"}


def write_sweep(folder: Path, text: str, name: str = "test", **changes: Any) -> str:
    """Write a sweep of the changed reference case, of four cycles, and return its file's name."""
    tables = document(**({"run": TINY} | changes))
    (folder / "base.toml").write_text(to_toml(tables))
    (folder / f"{name}.toml").write_text(f'case = "base.toml"\n{text}\n')
    return f"{name}.toml"


@pytest.fixture
def sweep_file(in_folder: Path) -> Callable[..., str]:
    """`write_sweep` into the working directory."""

    def write(text: str, name: str = "test", **changes: Any) -> str:
        return write_sweep(in_folder, text, name, **changes)

    return write


# --- decks and their plan ---------------------------------------------------------------------


def test_walkers_that_meet_are_taken_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They have more room than they need, so the distance that counts as near is made larger."""
    monkeypatch.setattr("walkers.runs.splitting.NEAR", 1e3)
    first = make_case(run={**TINY, "seed": 1})
    second = make_case(run={**TINY, "seed": 2})
    with pytest.raises(WalkersMet):
        make_runs([first, second], tmp_path, find_engine())
    assert not list(tmp_path.glob("*"))


def make_deck_case(changes: dict[str, Any]) -> Case:
    """The changed reference case; all such cases have the time step of 2 µs."""
    return make_case(**{**changes, "run": STEP | changes.get("run", {})})


MAY_DIFFER: dict[str, dict[str, Any]] = {
    "nothing": {},
    "seed": {"run": {"seed": 2}},
    "dimers": {"dimers": {"angle": "30 deg", "replicates": 3, "radii": ["0.35 mm", "0.2 mm"]}},
    "friction": {"contact": {"friction": {"bead_bead": 0.2, "bead_wall": 0.05}}},
    "restitution": {"contact": {"restitution": 0.6}},
    "drive": {"drive": {"peak_acceleration": "5 g", "axis": "y"}},
    "tilt": {"boundary": {"tilt": "20 deg"}},
    "liquid": {"liquid": {"viscosity_ratio": 2.0}},
    "gravity": {"environment": {"gravity": "0 m/s^2"}},
}
MAY_NOT_DIFFER: dict[str, dict[str, Any]] = {
    "frequency": {"drive": {"frequency": "60 Hz"}},
    "phase": {"drive": {"phase": "90 deg"}},
    "with rolling friction": {"contact": {"rolling_friction": 0.003}},
    "modulus": {"contact": {"youngs_modulus": "40 MPa"}},
    "cycles": {"run": {"cycles": 30}},
    "time step": {"run": {"time_step": "1 us"}},
    "density": {"beads": {"density": "3.9 g/cm^3"}},
    # Walls that move, as seen from the laboratory, do so for all walkers of a deck.
    "moving walls": {"drive": {"frame": "lab"}},
    "faster walls": {"drive": {"frame": "lab", "peak_acceleration": "5 g"}},
    "moving walls, no gravity": {
        "drive": {"frame": "lab"},
        "environment": {"gravity": "0 m/s^2"},
    },
}


@pytest.mark.parametrize("name", MAY_DIFFER)
def test_what_may_differ_within_a_deck(name: str) -> None:
    changed = make_deck_case(MAY_DIFFER[name])
    assert sharing_key(changed) == sharing_key(make_deck_case({}))


def test_a_deck_is_composed_of_all_that_may_differ_within_it() -> None:
    compose(plan_of(*[make_deck_case(changes) for changes in MAY_DIFFER.values()]))


@pytest.mark.parametrize("name", MAY_NOT_DIFFER)
def test_what_may_not_differ_within_a_deck(name: str) -> None:
    """Neither from the reference case nor from any of the other changes."""
    key = sharing_key(make_deck_case(MAY_NOT_DIFFER[name]))
    assert key != sharing_key(make_deck_case({}))
    for other_name, changes in MAY_NOT_DIFFER.items():
        if other_name != name:
            assert sharing_key(make_deck_case(changes)) != key, other_name


def test_two_rolling_frictions_may_differ_within_a_deck() -> None:
    """What a deck cannot mix are contacts with rolling friction and contacts without it."""
    low = make_deck_case({"contact": {"rolling_friction": 0.003}})
    high = make_deck_case({"contact": {"rolling_friction": 0.006}})
    assert sharing_key(low) == sharing_key(high)


@pytest.mark.parametrize(
    ("spacing", "shared"),
    [
        pytest.param("17.1 mm", False, id="1.9 path lengths"),
        pytest.param("18.9 mm", True, id="2.1 path lengths"),
    ],
)
def test_walkers_share_a_deck_from_a_spacing_of_two_path_lengths(
    spacing: str, shared: bool
) -> None:
    """Walkers that stand closer could meet, and would have other neighbours in a shared deck.

    The path length is that of 0.3 s at 0.3 times the peak velocity of 78.0 mm/s, plus twice the
    length of a dimer, 0.99 mm: 9.00 mm.
    """
    dimers = {"replicates": 2, "spacing": spacing}
    first = make_deck_case({"dimers": dimers, "run": {"seed": 1}})
    second = make_deck_case({"dimers": dimers, "run": {"seed": 2}})
    assert path_length(first) == pytest.approx(9.0e-3, rel=1e-3)
    assert (sharing_key(first) == sharing_key(second)) == shared


def test_no_deck_is_composed_of_cases_that_may_not_share_it() -> None:
    with pytest.raises(ValueError, match="cannot share"):
        compose(plan_of(make_deck_case({}), make_deck_case(MAY_NOT_DIFFER["frequency"])))


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_deck_of_several_processes_takes_as_many_cores(ranks: int, in_folder: Path) -> None:
    sweep = {"case": "pile-ci", "set": {"run.ranks": ranks}, "axes": {"run.seed": [1, 2]}}
    (in_folder / "piles.toml").write_text(to_toml(sweep))
    plan = plan_sweep(load_sweep("piles.toml"), Path("runs"), SweepOptions(2))
    engine_seconds = sum(deck.seconds for deck in plan.decks)
    assert engine_seconds > 0.0
    assert plan.core_seconds == pytest.approx(ranks * engine_seconds + plan.overhead)


@cache
def cases_of(sweep: str) -> list[Case]:
    """The cases of a shipped sweep."""
    return list(load_sweep(sweep).cases())


@cache
def decks_of(sweep: str, workers: int) -> list[PlannedDeck]:
    """The decks into which a shipped sweep is packed."""
    return pack(cases_of(sweep), workers)


shipped_sweeps = pytest.mark.parametrize("sweep", ["fig2", "alignment"])
numbers_of_workers = pytest.mark.parametrize("workers", [1, 16])


@numbers_of_workers
@shipped_sweeps
def test_every_point_is_in_one_deck(sweep: str, workers: int) -> None:
    points: list[int] = []
    for deck in decks_of(sweep, workers):
        points += deck.points
    assert sorted(points) == list(range(len(cases_of(sweep))))


@numbers_of_workers
@shipped_sweeps
def test_points_of_a_planned_deck_may_share_it(sweep: str, workers: int) -> None:
    for deck in decks_of(sweep, workers):
        keys = {sharing_key(cases_of(sweep)[point]) for point in deck.points}
        assert len(keys) == 1


@numbers_of_workers
@shipped_sweeps
def test_a_deck_of_several_points_is_not_too_large(sweep: str, workers: int) -> None:
    for deck in decks_of(sweep, workers):
        walkers = sum(cases_of(sweep)[point].walkers[0].replicates for point in deck.points)
        if len(deck.points) > 1:
            assert walkers <= MOST_WALKERS
            assert deck.seconds <= LONGEST_SECONDS


@numbers_of_workers
@shipped_sweeps
def test_the_longest_decks_come_first_and_cores_finish_together(sweep: str, workers: int) -> None:
    """Within a fifth of the time in which no core would ever be idle.

    A single deck may take longer than that.
    """
    seconds = [deck.seconds for deck in decks_of(sweep, workers)]
    assert seconds == sorted(seconds, reverse=True)
    without_idle_cores = sum(seconds) / workers
    assert makespan(seconds, workers) <= max(1.2 * without_idle_cores, seconds[0])


def test_of_plans_that_take_as_long_the_smallest_decks_are_made() -> None:
    """On two cores, one point of 160 cycles takes longer than eight of 12 cycles together.

    However these are dealt, the plan takes as long, so each has a deck of its own.
    """
    short_case = make_case(run={**STEP, "cycles": 12})
    long_case = make_case(run={**STEP, "cycles": 160})
    decks = pack([short_case] * 8 + [long_case], 2)
    points = [deck.points for deck in decks]
    assert points == [(8,), (0,), (1,), (2,), (3,), (4,), (5,), (6,), (7,)]
    assert makespan((deck.seconds for deck in decks), 2) == decks[0].seconds


def test_a_plan_of_a_sweep_runs_nothing(sweep_file: Callable[..., str]) -> None:
    name = sweep_file("[axes]\nrun.seed = [1, 2]")
    plan = call("sweep", name, "-j", "1", "--dry-run", check=True).stdout
    assert "2 points in 1 deck\n" in plan
    assert not Path("runs").exists()


# --- tables -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def swept(once: FillOnce) -> Path:
    """Folder of a sweep over radii and time steps, whose last point is missing."""

    def run_and_remove_one(folder: Path) -> None:
        (folder / "base.toml").write_text(to_toml(document(run=TINY, dimers={"replicates": 2})))
        radii = [["0.3 mm", "0.2 mm"], ["0.25 mm", "0.25 mm"]]
        axes = {"dimers.radii": radii, "run.time_step": ["2 us", "auto"]}
        (folder / "test.toml").write_text(to_toml({"case": "base.toml", "axes": axes}))
        output = call("sweep", "test.toml", folder=folder).stdout
        (folder / "printed.txt").write_text(output, "utf-8")
        shutil.rmtree(load_table(folder / "runs" / "test")["run"][3])

    return once("swept", run_and_remove_one)


@pytest.fixture
def swept_table(swept: Path) -> pd.DataFrame:
    """The table of the sweep, in SI units but for its keys."""
    return load_table(swept / "runs" / "test")


def test_a_sweep_begins_its_output_with_the_number_of_finished_points(swept: Path) -> None:
    output = (swept / "printed.txt").read_text("utf-8")
    assert output.splitlines()[0] == "test: 4 points, 4 finished"


def test_a_plan_counts_the_points_that_are_missing(swept: Path) -> None:
    plan = call("sweep", "test.toml", "--dry-run", check=True, folder=swept).stdout
    assert "1 point in 1 deck" in plan


def test_a_table_has_the_values_of_each_point(swept_table: pd.DataFrame) -> None:
    assert list(swept_table["point"]) == [0, 1, 2, 3]
    assert list(swept_table["dimers.radii[0]"]) == [0.3, 0.3, 0.25, 0.25]
    assert list(swept_table["run.time_step"]) == [2.0, "auto", 2.0, "auto"]


def test_values_of_a_table_have_the_units_of_the_sweep(swept_table: pd.DataFrame) -> None:
    units = swept_table.attrs["units"]
    assert units["run.time_step"] == "us"
    assert units["dimers.radii[1]"] == "mm"
    assert units["velocity"] == "m/s"


def test_a_table_has_the_state_of_each_point(swept_table: pd.DataFrame) -> None:
    assert list(swept_table["status"]) == ["finished", "finished", "finished", "missing"]
    assert list(swept_table["lost"]) == [0, 0, 0, 0]
    assert np.isnan(swept_table["velocity"][3])


def test_a_table_has_the_results_of_its_runs(swept_table: pd.DataFrame) -> None:
    for row in swept_table[:3].itertuples():
        directory = Path(row.run)
        numbers = json.loads((directory / "result.json").read_text())["numbers"]
        assert row.velocity == numbers["velocity"]
        assert row.smallest == numbers["smallest"]
        case = case_of(directory)
        gamma0 = dimer_of(case).gamma0(case.excitation.peak_acceleration)
        assert row.gamma0 == pytest.approx(gamma0)


def test_a_table_is_written_as_csv_with_the_units_in_its_header(
    swept: Path, swept_table: pd.DataFrame, tmp_path: Path
) -> None:
    file = tmp_path / "table.csv"
    call("list", "runs/test", "--to", str(file), check=True, folder=swept)
    np.testing.assert_array_equal(pd.read_csv(file)["velocity (m/s)"], swept_table["velocity"])


def test_a_table_is_written_as_parquet_with_types_for_missing_points(
    swept: Path, tmp_path: Path
) -> None:
    """Where a column has numbers and words, all become words; truths stay truths."""
    file = tmp_path / "table.parquet"
    call("list", "runs/test", "--to", str(file), check=True, folder=swept)
    table = pq.read_table(file)
    assert table.schema.field("velocity").metadata[b"unit"] == b"m/s"
    assert table.column("run.time_step").to_pylist() == ["2.0", "auto", "2.0", "auto"]
    assert table.column("walkers_met").to_pylist() == [False, False, False, None]


def test_a_table_is_printed_as_json(swept: Path, swept_table: pd.DataFrame) -> None:
    output = call("list", "runs/test", "--json", check=True, folder=swept).stdout
    amplitudes = [point["amplitude"] for point in json.loads(output)["points"]]
    assert amplitudes[:3] == list(swept_table["amplitude"][:3])


def test_a_table_is_printed_as_text(swept: Path, swept_table: pd.DataFrame) -> None:
    """In displayed units, without the names of runs."""
    text = call("list", "test", check=True, folder=swept).stdout
    assert "velocity (mm/s)" in text
    assert len(text.splitlines()) == 9
    assert Path(swept_table["run"][0]).name not in text


# --- descents ---------------------------------------------------------------------------------

DESCENT = """
[axes]
drive.frequency = ["60 Hz", "90 Hz"]
[descend]
from = "1.4 g"
to = "0.2 g"
step = "0.2 g"
until_below = "0.002 mm/s"
"""


@pytest.fixture(scope="module")
def descended(once: FillOnce) -> Path:
    """Folder of a sweep whose acceleration falls at two frequencies until the walkers stop."""

    def run_descent(folder: Path) -> None:
        name = write_sweep(folder, DESCENT, run={"cycles": 20, "settling_cycles": 10})
        output = call("sweep", name, folder=folder, check=True).stdout
        (folder / "printed.txt").write_text(output, "utf-8")

    return once("descended", run_descent)


def test_a_plan_of_a_finished_sweep_has_no_points(descended: Path) -> None:
    plan = call("sweep", "test.toml", "--dry-run", check=True, folder=descended).stdout
    assert "0 points in 0 decks" in plan


@pytest.mark.parametrize("frequency", [60.0, 90.0])
def test_a_descent_has_all_steps_and_walkers_that_stop_stay_at_rest(
    frequency: float, descended: Path
) -> None:
    """From 1.4 g to 0.2 g; a walker is at rest below 2 µm/s."""
    table = load_table(descended / "runs" / "test")
    points = table[table["drive.frequency"] == frequency]
    accelerations = [1.4, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2]
    assert list(points["drive.peak_acceleration"]) == pytest.approx(accelerations)
    is_at_rest = list(points["velocity"] < 2e-6)
    assert is_at_rest == sorted(is_at_rest)


def test_a_descent_finds_where_the_walkers_stop(descended: Path) -> None:
    """With Coulomb friction, where inertia overcomes it, whatever the frequency."""
    ends = thresholds(load_table(descended / "runs" / "test"))
    assert list(ends["moving"] - ends["at_rest"]) == pytest.approx([0.2, 0.2])  # one step, g
    assert ends["moving"].nunique() == 1


def test_the_thresholds_of_a_descent_are_printed(descended: Path) -> None:
    assert "moving (g)" in (descended / "printed.txt").read_text("utf-8")


# --- failures ---------------------------------------------------------------------------------

GLYCEROL = {
    "liquid": {"name": "glycerol 87 %"},
    "run": {**TINY, "cycles": 20, "samples_per_cycle": 1},
}
LOSES_BEAD = r"s/^run /group gone id 2\ndelete_atoms group gone compress no\nrun /"


@dataclass(frozen=True)
class FailingSweep:
    """A sweep of five points, of which the third fails."""

    text: str
    """Contents of the sweep file."""
    changes: dict[str, Any]
    """Changes of its case."""
    script: str
    """What the engine does before it starts."""
    reason: str
    """The class of the failure."""
    lost: int
    """The number of lost beads."""
    message: str
    """A part of the message."""


FAILING = {
    "blow-up": FailingSweep(
        text="""
            set.run.allow_unstable = true
            [[zip]]
            run.seed = [1, 2, 3, 4, 5]
            # The third is far beyond the viscous limit.
            run.time_step = ["2 us", "2 us", "30 us", "2 us", "2 us"]
            """,
        changes=GLYCEROL,
        script="",
        reason="BlowUp",
        lost=0,
        message="blow-up",
    ),
    # The walker with a restitution of 0.61 loses a bead, and so fails each deck that it is in.
    "lost bead": FailingSweep(
        text="axes.contact.restitution = [0.3, 0.5, 0.61, 0.7, 0.4]",
        changes={},
        script=f"grep -qF ' 0.61' walker.lig && sed -i '{LOSES_BEAD}' walker.lig",
        reason="BeadsLost",
        lost=1,
        message="bead",
    ),
}


def observe_failing_sweep(failing: FailingSweep, folder: Path) -> None:
    """Run a failing sweep twice in a folder, and write there what is seen of it."""
    log = folder / "launches"
    script = f'pwd >> {log}\n{failing.script}\nexec liggghts "$@"'
    engine = write_engine(folder / "engine", script)
    sweep = write_sweep(folder, failing.text, **failing.changes)
    first = call("sweep", sweep, "-j", "1", "--engine", engine, folder=folder)
    table = load_table(folder / "runs" / "test")
    listing = call("list", "runs/test", check=True, folder=folder).stdout
    log.unlink()
    second = call("sweep", sweep, "--engine", engine, folder=folder)
    seen = {
        "first status": first.returncode,
        "first errors": first.stderr,
        "table": table[["status", "reason", "lost"]].to_dict("list"),
        "run of the failed point": table["run"][2],
        "listing": listing,
        "second status": second.returncode,
        "launches of the second": log.read_text().split(),
    }
    write_json(folder / "seen.json", seen)


@pytest.fixture(scope="module")
def failed_sweep(once: FillOnce) -> Callable[[str], dict[str, Any]]:
    """What is seen of a sweep of `FAILING`, each of which is run once a session."""

    def seen_of(name: str) -> dict[str, Any]:
        def fill(folder: Path) -> None:
            observe_failing_sweep(FAILING[name], folder)

        folder = once(f"failing-{name.replace(' ', '-')}", fill)
        seen: dict[str, Any] = read_json(folder / "seen.json")
        return seen

    return seen_of


@pytest.mark.parametrize("name", FAILING)
def test_a_failing_point_does_not_stop_the_others(
    name: str, failed_sweep: Callable[[str], dict[str, Any]]
) -> None:
    seen = failed_sweep(name)
    states = ["finished", "finished", "failed", "finished", "finished"]
    assert seen["table"]["status"] == states
    assert "5 points, 4 finished, 1 failed" in seen["listing"]


@pytest.mark.parametrize("name", FAILING)
def test_a_failing_point_is_told(name: str, failed_sweep: Callable[[str], dict[str, Any]]) -> None:
    seen = failed_sweep(name)
    assert seen["first status"] == 1
    assert "point 2, base-" in seen["first errors"]
    assert FAILING[name].message in seen["first errors"]


@pytest.mark.parametrize("name", FAILING)
def test_the_reason_of_a_failing_point_is_kept(
    name: str, failed_sweep: Callable[[str], dict[str, Any]]
) -> None:
    seen = failed_sweep(name)
    assert seen["table"]["reason"][2] == FAILING[name].reason
    assert seen["table"]["lost"] == [0, 0, FAILING[name].lost, 0, 0]
    assert (Path(seen["run of the failed point"]) / "failure.json").exists()


@pytest.mark.parametrize("name", FAILING)
def test_a_second_call_makes_the_failing_point_alone(
    name: str, failed_sweep: Callable[[str], dict[str, Any]]
) -> None:
    """The engine works in the folder of the failed run, which ends in `.incomplete`."""
    seen = failed_sweep(name)
    assert seen["second status"] == 1
    launched = []
    for place in seen["launches of the second"]:
        launched += [part for part in Path(place).parts if "incomplete" in part]
    assert launched == [Path(seen["run of the failed point"]).name]


SIXTEEN_POINTS = "[axes]\ncontact.restitution = { linspace = [0.3, 0.6, 16] }"


@pytest.mark.parametrize(
    ("script", "most_launches", "message"),
    [
        pytest.param(
            "echo 'LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0'; echo 'ERROR: no licence'",
            8,
            "no licence",
            id="no licence",
        ),
        pytest.param("exit 7", 3, "never started", id="dies at once"),
        pytest.param(
            'liggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"',
            1,
            "4.0.0",
            id="another version",
        ),
    ],
)
def test_a_failure_of_every_point_stops_the_sweep(
    script: str,
    most_launches: int,
    message: str,
    sweep_file: Callable[..., str],
    in_folder: Path,
) -> None:
    """After a few launches of the engine, with one message; the next call makes all points."""
    log = in_folder / "launches"
    engine = write_engine(in_folder / "engine", f"echo >> {log}\n{script}")
    process = call("sweep", sweep_file(SIXTEEN_POINTS), "-j", "1", "--engine", engine)
    assert process.returncode == 1, process.stderr
    assert "Traceback" not in process.stderr
    assert process.stderr.count(message) == 1
    assert 1 <= len(log.read_text().splitlines()) <= most_launches
    assert "16 points in" in call("sweep", "test.toml", "--dry-run").stdout


# --- sweeps beside each other -----------------------------------------------------------------

FIRST_POINTS = [(70, 2), (80, 1), (80, 2), (80, 3)]
SECOND_POINTS = [(70, 2), (80, 2), (80, 3), (80, 4)]
"""Frequencies, Hz, and accelerations, g: those of 80 Hz share a deck, the other has its own."""


def zip_of(points: list[tuple[int, int]]) -> str:
    """The text of a sweep over frequencies (Hz) and accelerations (g)."""
    axis = {
        "drive.frequency": [f"{frequency} Hz" for frequency, _ in points],
        "drive.peak_acceleration": [f"{acceleration} g" for _, acceleration in points],
    }
    return to_toml({"zip": [axis]})


def test_two_sweeps_over_the_same_points_share_them(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Of eight points three are in both, so five are made, each once, whoever comes first."""
    log = in_folder / "launches"
    engine = write_engine(in_folder / "engine", f'pwd >> {log}\nexec liggghts "$@"')
    sweep_file(zip_of(FIRST_POINTS), "first")
    sweep_file(zip_of(SECOND_POINTS), "second")
    command = [PROGRAM, "sweep", "first.toml", "-j", "2", "--engine", engine]
    first = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    # The second sweep begins while engines of the first one run.
    wait_for(lambda: first.poll() is not None or log.exists())
    call("sweep", "second.toml", "-j", "2", "--engine", engine, check=True)
    assert first.wait(timeout=PATIENCE) == 0
    runs = dict(zip(FIRST_POINTS, load_table("runs/first")["run"], strict=True))
    for point, run in zip(SECOND_POINTS, load_table("runs/second")["run"], strict=True):
        assert runs.setdefault(point, run) == run
    made = [str(Path("runs") / name) for name in finished_places(in_folder / "runs")]
    assert sorted(runs.values()) == sorted(made)
    assert len(made) == 5
    launches = log.read_text().split()
    assert len(launches) == len(set(launches))
    assert len(launches) <= 5


ONE_POINT = '[axes]\ndrive.peak_acceleration = ["2 g"]'
ONE_MORE_POINT = '[axes]\ndrive.peak_acceleration = ["2 g", "3 g"]'
ANOTHER_POINT = '[axes]\ndrive.peak_acceleration = ["4 g"]'


def test_a_sweep_that_keeps_a_point_replaces_no_other(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """It is an edit of the sweep that was there."""
    out = in_folder / "runs"
    write_record(plan_sweep(load_sweep(sweep_file(ONE_POINT)), out, SweepOptions(1)).record)
    edited = load_sweep(sweep_file(ONE_MORE_POINT))
    with warnings.catch_warnings():
        warnings.simplefilter("error", SweepReplacedWarning)
        run_sweep(edited, out, SweepOptions(1))


def test_another_sweep_of_the_same_name_is_replaced_with_a_warning(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    out = in_folder / "runs"
    write_record(plan_sweep(load_sweep(sweep_file(ONE_POINT)), out, SweepOptions(1)).record)
    other_sweep = load_sweep(sweep_file(ANOTHER_POINT))
    with pytest.warns(SweepReplacedWarning, match="same name"):
        run_sweep(other_sweep, out, SweepOptions(1))


def test_another_sweep_of_the_same_name_at_the_same_time_is_an_error(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """It writes its record while the first one runs, even if it has points of it."""
    out = in_folder / "runs"
    record = plan_sweep(load_sweep(sweep_file(ONE_POINT)), out, SweepOptions(1)).record
    edited = load_sweep(sweep_file(ONE_MORE_POINT))

    def write_other_record(_: Progress) -> None:
        write_record(record)

    with pytest.raises(SweepStopped, match="same name"):
        run_sweep(edited, out, SweepOptions(1), on_progress=write_other_record)


# --- progress ---------------------------------------------------------------------------------


class GatedExecutor(ThreadPoolExecutor):
    """One thread, which begins each of two decks only when its gate is open."""

    def __init__(self) -> None:
        super().__init__(1)
        self.gates = [threading.Event(), threading.Event()]
        self._decks = 0

    def submit(self, function: Any, /, *arguments: Any, **keywords: Any) -> Future[Any]:
        gate = self.gates[self._decks]
        self._decks += 1

        def wait_and_run() -> Any:
            assert gate.wait(PATIENCE)
            return function(*arguments, **keywords)

        return super().submit(wait_and_run)


def test_the_share_of_a_sweep_that_is_done_is_that_of_its_work(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Two points of 120 and 20 cycles: with the first, most of the work is done, not half.

    Each deck waits until the progress before it was seen.
    """
    sweep = load_sweep(sweep_file("[axes]\nrun.cycles = [120, 20]", "uneven"))
    seen: list[Progress] = []
    halfway: list[Progress] = []
    with GatedExecutor() as executor:

        def look(progress: Progress) -> None:
            seen.append(progress)
            if progress.text.startswith("1 of 2 points done"):
                halfway.append(progress)
                executor.gates[1].set()
            else:
                executor.gates[0].set()

        options = SweepOptions(1, executor=executor)
        run_sweep(sweep, in_folder / "runs", options, on_progress=look)
    shares = [progress.share for progress in seen]
    assert shares == sorted(shares)
    assert shares[0] < 0.5
    assert shares[-1] == 1.0
    assert halfway
    for progress in halfway:
        assert progress.share > 0.7
        # Above 99.5 % the engines are done, and results are measured.
        words = "measuring" if progress.share >= 0.995 else "of the work"
        assert words in progress.text


def test_the_share_of_a_shared_deck_is_that_of_its_steps(tmp_path: Path) -> None:
    """The engine writes its step into the folder of the deck, beside the first of its runs."""
    cases = [make_case(drive={"peak_acceleration": peak}) for peak in ("2 g", "4 g")]
    deck = compose(plan_of(*cases))
    place = tmp_path / "first"
    folder = unfinished(place) / DECK_FOLDER
    folder.mkdir(parents=True)
    write_json(folder / LAYOUT_NAME, deck.layout.as_dict())
    a_quarter = deck.layout.steps // 4
    (folder / OUTPUT_NAME).write_text(f" {a_quarter} 4 0.05 {'0.001 ' * 6}\n")
    assert progress_at(place)[0] == pytest.approx(0.25, rel=1e-3)


def test_the_share_of_a_deck_that_has_not_begun_is_not_known(tmp_path: Path) -> None:
    assert progress_at(tmp_path / "first") is None


# --- executors and sites ----------------------------------------------------------------------

TWO_STEPS = '[axes]\nrun.time_step = ["2 us", "1 us"]'
"""Two points with decks of their own."""


def test_the_executor_of_a_script_gives_the_same(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """The second example of the documentation, which hands an executor over."""
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "clusters.md").read_text("utf-8")
    _, script = re.findall(r"```python\n(.+?)```", page, re.DOTALL)
    (in_folder / "script.py").write_text(script)
    sweep_file(TWO_STEPS, "sweep")
    command = [sys.executable, "script.py"]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "sweep: 2 points, 2 finished" in process.stdout
    call("sweep", "sweep.toml", "-j", "2", "--out", "here")
    assert bits(in_folder / "here") != {}
    assert bits(in_folder / "runs") == bits(in_folder / "here")


def test_a_sweep_stops_if_the_workers_of_an_executor_end(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """The engine kills the only worker of a pool."""
    sweep = load_sweep(sweep_file(TWO_STEPS))
    with ProcessPoolExecutor(1) as pool:
        worker = pool.submit(os.getpid).result()
        engine = write_engine(in_folder / "engine", f'kill -9 {worker}\nexec liggghts "$@"')
        options = SweepOptions(1, executor=pool)
        with pytest.raises(SweepStopped, match="executor's workers ended"):
            run_sweep(sweep, in_folder / "runs", options, engine=engine)


SITE = {
    "partition": "main",
    "account": "granular",
    "walltime": "02:00:00",
    "nodes": 2,
    "jobs": 4,
    "cores": 16,
    "shell": ["module load openmpi", "ulimit -c 0"],
    "sbatch": ["--qos=long", "--mem=4G"],
    "address": "10.1.0.1",
    "container": "apptainer exec w.sif",
}


@pytest.fixture
def site(tmp_path: Path) -> Config:
    """The site of `SITE`: four jobs of two nodes with 16 cores each."""
    (tmp_path / "site.toml").write_text(to_toml(SITE))
    return load_site(tmp_path / "site.toml")


@pytest.mark.parametrize(
    ("ranks", "decks"),
    [
        (1, 16 * 2 * 4),
        (3, 5 * 2 * 4),  # five decks of three processes on a node, one core is idle
        (17, 0),
    ],
)
def test_a_site_runs_as_many_decks_as_have_room_on_its_nodes(
    ranks: int, decks: int, site: Config
) -> None:
    assert decks_at(site, ranks) == decks


def test_a_sweep_gives_a_site_as_many_decks_as_have_room(site: Config) -> None:
    """The six workers are those of this machine, which are not used."""
    assert SweepOptions(6, site).for_ranks(3).decks_at_once == 5 * 2 * 4


def test_this_machine_runs_as_many_decks_as_have_room_on_its_workers() -> None:
    assert SweepOptions(6).for_ranks(3).decks_at_once == 2


def test_a_deck_must_have_room_on_a_node(site: Config) -> None:
    with pytest.raises(InputError, match="17 MPI processes"):
        SweepOptions(6, site).for_ranks(17)


@pytest.fixture
def parsl_executor(site: Config, tmp_path: Path) -> Any:
    """The executor that parsl gets for decks of three processes."""
    (executor,) = prepare(site, tmp_path / "parsl", 3).executors
    return executor


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("partition", "main"),
        ("account", "granular"),
        ("walltime", "02:00:00"),
        ("exclusive", False),
        ("min_blocks", 0),
        ("max_blocks", 4),
        ("nodes_per_block", 2),
        ("cores_per_node", 16),
    ],
)
def test_what_parsl_is_told_about_jobs(name: str, value: Any, parsl_executor: Any) -> None:
    assert getattr(parsl_executor.provider, name) == value


def test_what_parsl_is_told_about_scripts_of_jobs(parsl_executor: Any) -> None:
    provider = parsl_executor.provider
    assert type(provider.launcher).__name__ == "SrunLauncher"
    assert provider.worker_init.splitlines()[:2] == SITE["shell"]
    options = provider.scheduler_options.splitlines()
    assert "#SBATCH --qos=long" in options
    assert "#SBATCH --mem=4G" in options


def test_what_parsl_is_told_about_workers(parsl_executor: Any) -> None:
    assert parsl_executor.max_workers_per_node == 5
    assert parsl_executor.address == "10.1.0.1"
    assert parsl_executor.encrypted
    pool = "apptainer exec w.sif process_worker_pool.py "
    assert parsl_executor.launch_cmd.startswith(pool)


BAD_SITE_FILES = [
    pytest.param('partition = "main"', "cores: missing", id="no cores"),
    pytest.param(
        "cores = 1000000000", "cores = 1000000000: expected .*at most 10000", id="too many cores"
    ),
    pytest.param(
        'cores = 2\npartitoin = "main"', 'partitoin = .*did you mean "partition"', id="misspelt key"
    ),
    pytest.param(
        'cores = 2\nwalltime = "2h"',
        'walltime = "2h": expected hours, minutes and seconds',
        id="wall time in words",
    ),
]
BAD_SITE_SCRIPTS = [
    pytest.param(
        "import walkers", "expected a configuration: config = parsl.Config", id="no configuration"
    ),
    pytest.param(
        "import parsl\nconfig = parsl.Config([1])",
        "cannot be used: AttributeError: ",
        id="number for an executor",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD_SITE_FILES)
def test_a_site_file_that_makes_no_sense_is_an_input_error(
    text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "site.toml").write_text(text)
    with pytest.raises(InputError, match=f"site.toml: {message}"):
        load_site(tmp_path / "site.toml")


@pytest.mark.parametrize("text", ["$(touch pwned)", "a b", "a;b", "100%N"])
@pytest.mark.parametrize("key", ["partition", "account", "address"])
def test_a_site_has_no_letters_that_a_shell_or_slurm_would_take_for_more(
    key: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / "site.toml").write_text(f"cores = 2\n{key} = '{text}'")
    with pytest.raises(InputError, match=f"site.toml: {key} = .*: expected letters"):
        load_site(tmp_path / "site.toml")


@pytest.mark.parametrize(("text", "message"), BAD_SITE_SCRIPTS)
def test_a_site_script_that_makes_no_sense_is_an_input_error(
    text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "site.py").write_text(text)
    with pytest.raises(InputError, match=f"site.py: {message}"):
        load_site(tmp_path / "site.py")


@pytest.mark.parametrize("folder", ["100%N", "$(touch pwned)", "a b"])
def test_a_folder_of_runs_has_no_letters_that_a_shell_or_slurm_would_take_for_more(
    folder: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"^out: .* expected letters"):
        check_path(tmp_path / folder / "fig2")


def test_the_name_of_a_changed_sweep_can_be_a_folder_at_a_site(tmp_path: Path) -> None:
    sweep = load_sweep("fig4", {"contact.rolling_friction": 0.01, "contact.restitution": 0.5})
    check_path(tmp_path / sweep.name)


@pytest.mark.slow
def test_workers_of_another_process_give_the_same(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Pilots without a scheduler; the first engine kills its worker, whose deck is repeated."""
    kill_worker_once = (
        f"grep -q spawn_main /proc/$PPID/cmdline && mkdir {in_folder}/once && kill -9 $PPID"
    )
    engine = write_engine(in_folder / "engine", f'{kill_worker_once}\nexec liggghts "$@"')
    command = ["sweep", sweep_file(TWO_STEPS), "--engine", engine]
    (in_folder / "site.py").write_text(LOCAL)
    through_pilots = [PROGRAM, *command, "--out", "there", "--site", "site.py"]
    program = subprocess.Popen(
        through_pilots, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    call(*command, "--out", "here", "-j", "2", check=True)  # meanwhile
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == 0, errors
    assert bits(in_folder / "here") != {}
    assert bits(in_folder / "here") == bits(in_folder / "there")
    log = "".join(path.read_text() for path in in_folder.glob("there/test/parsl/*/parsl.log"))
    assert "WorkerLost" in log


# --- SLURM ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Slurm:
    """A SLURM cluster of one node."""

    environment: dict[str, str]
    """The environment in which the commands of SLURM speak to it."""

    def start_sweep(self, command: list[str]) -> subprocess.Popen[str]:
        """Start the program with a command."""
        return subprocess.Popen(
            [PROGRAM, *command],
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def jobs(self, *options: str) -> list[str]:
        """Ids of the jobs, chosen by options of ``squeue``."""
        command = ["squeue", "-h", "-o", "%A", *options]
        process = subprocess.run(
            command, env=self.environment, capture_output=True, text=True, check=True
        )
        return process.stdout.split()

    def has_no_jobs(self) -> bool:
        """Whether all jobs have ended."""
        return not self.jobs()

    def cancel(self, job: str) -> None:
        """Cancel a job."""
        subprocess.run(["scancel", job], env=self.environment, check=True)


@pytest.fixture(scope="module")
def slurm() -> Iterator[Slurm]:
    """A throw-away cluster; without root or SLURM, its tests are skipped."""
    reason = why_not()
    if reason:
        pytest.skip(reason)
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        Path(folder).chmod(0o711)
        with slurm_cluster(Path(folder)) as environment:
            yield Slurm(environment)


def write_slurm_site(folder: Path, jobs: int) -> str:
    """Write a site of the throw-away cluster, with pilots of one core, and return its name."""
    site = {
        "partition": "main",
        "address": "127.0.0.1",
        "cores": 1,
        "jobs": jobs,
        "sbatch": ["--comment=decks"],
    }
    (folder / "site.toml").write_text(to_toml(site))
    return "site.toml"


def test_a_sweep_through_slurm_gives_the_same(
    slurm: Slurm, sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """As this machine, bit for bit; and its pilots end with it."""
    command = ["sweep", sweep_file(TWO_STEPS), "--out"]
    site = write_slurm_site(in_folder, jobs=1)
    program = slurm.start_sweep([*command, "cluster", "--site", site])
    call(*command, "local", check=True)  # meanwhile
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == 0, errors
    assert bits(in_folder / "local") != {}
    assert bits(in_folder / "cluster") == bits(in_folder / "local")
    wait_for(slurm.has_no_jobs)


# Eight frequencies, a deck each. Point 2 is far beyond the viscous limit of glycerol.
EIGHT_POINTS = {
    "drive.frequency": {"linspace": ["60 Hz", "67 Hz", 8]},
    "run.time_step": ["2 us", "2 us", "40 us", "2 us", "2 us", "2 us", "2 us", "2 us"],
}


@pytest.mark.slow
def test_a_sweep_through_slurm_survives_a_cancelled_pilot_and_an_interrupt(
    slurm: Slurm, sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """It is resumed, and gives the same as this machine, bit for bit, also for a failing point."""
    text = to_toml({"set": {"run.allow_unstable": True}, "zip": [EIGHT_POINTS]})
    log = in_folder / "launches"
    go = in_folder / "go"
    # Seven launches suffice for four points, though one fails and one is cancelled; eight points
    # take two more. So later launches wait, and the sweep cannot end before it is interrupted.
    waits = f"[ $(wc -l < {log}) -le 7 ] || while ! [ -e {go} ]; do sleep 0.1; done"
    engine = write_engine(in_folder / "engine", f'echo >> {log}\n{waits}\nexec liggghts "$@"')
    command = ["sweep", sweep_file(text, **GLYCEROL), "--engine", engine, "--out"]
    through_slurm = [*command, "cluster", "--site", write_slurm_site(in_folder, jobs=2)]
    program = slurm.start_sweep(through_slurm)

    def wait_for_points(number: int) -> None:
        def are_finished() -> bool:
            assert program.poll() is None
            return len(finished_places(in_folder / "cluster")) >= number

        wait_for(are_finished)

    wait_for_points(1)
    pilot, *_ = slurm.jobs("-t", "running")
    slurm.cancel(pilot)
    wait_for_points(4)
    assert pilot not in slurm.jobs()
    program.send_signal(signal.SIGINT)
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == 130
    assert "Traceback" not in errors
    wait_for(slurm.has_no_jobs)
    go.touch()
    resumed = slurm.start_sweep(through_slurm)
    assert call(*command, "local").returncode == 1  # meanwhile
    _, errors = resumed.communicate(timeout=PATIENCE)
    assert resumed.returncode == 1, errors
    assert "point 2, base-" in errors
    assert "blow-up" in errors
    wait_for(slurm.has_no_jobs)
    states = ["finished"] * 8
    states[2] = "failed"
    assert list(load_table("cluster/test")["status"]) == states
    assert bits(in_folder / "cluster") == bits(in_folder / "local")
