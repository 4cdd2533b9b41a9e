"""Sweeps run by the real engine: decks and their plan, failures, resumption, tables; workers of sites and of SLURM."""

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
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from tests.cluster import LOCAL, slurm_cluster, why_not
from tests.conftest import (
    PATIENCE,
    PROGRAM,
    TINY,
    bits,
    call,
    document,
    finished_places,
    make_case,
    to_toml,
    wait_for,
)
from walkers.errors import InputError
from walkers.files import write_json
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.sweep import load_sweep
from walkers.progress import Progress
from walkers.runner.binary import find_engine
from walkers.runner.failures import WalkersMet
from walkers.runner.run_directory import case_of, unfinished
from walkers.runs.making import DECK_FOLDER, make_runs, progress_at
from walkers.sweeps.packing import LONGEST_SECONDS, MOST_WALKERS, makespan, pack
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

STEP = {"time_step": "2 us"}
DONE = "finished"


@pytest.fixture
def sweep_file(in_folder: Path) -> Callable[..., str]:
    """Write a sweep of the reference case into the working directory and return its file's name."""

    def write(text: str, name: str = "test", **changes: Any) -> str:
        (in_folder / "base.toml").write_text(to_toml(document(**{"run": TINY, **changes})))
        (in_folder / f"{name}.toml").write_text(f'case = "base.toml"\n{text}\n')
        return f"{name}.toml"

    return write


def test_walkers_that_meet_are_taken_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They have room for more than they walk; so what counts as near is made larger than all of it."""
    monkeypatch.setattr("walkers.runs.splitting.NEAR", 1e3)
    with pytest.raises(WalkersMet):
        make_runs(
            [make_case(run={**TINY, "seed": seed}) for seed in (1, 2)], tmp_path, find_engine()
        )
    assert not list(tmp_path.glob("*"))


def test_what_may_differ_within_a_deck() -> None:
    """Walls that move do so for all."""
    lab, gravity = {"drive": {"frame": "lab"}}, {"environment": {"gravity": "0 m/s^2"}}
    same: list[dict[str, Any]] = [
        {},
        {
            "run": {"seed": 2},
            "dimers": {"angle": "30 deg", "replicates": 3, "radii": ["0.35 mm", "0.2 mm"]},
        },
        {"contact": {"friction": {"bead_bead": 0.2, "bead_wall": 0.05}, "restitution": 0.6}},
        {"drive": {"peak_acceleration": "5 g", "axis": "y"}, "boundary": {"tilt": "20 deg"}},
        {"liquid": {"viscosity_ratio": 2.0}, **gravity},
    ]
    other: list[dict[str, Any]] = [
        *({"drive": drive} for drive in ({"frequency": "60 Hz"}, {"phase": "90 deg"})),
        *(
            {"contact": contact}
            for contact in ({"rolling_friction": 0.003}, {"youngs_modulus": "40 MPa"})
        ),
        *({"run": run} for run in ({"cycles": 30}, {"time_step": "1 us"})),
        {"beads": {"density": "3.9 g/cm^3"}},
        *(lab, {"drive": {"frame": "lab", "peak_acceleration": "5 g"}}, lab | gravity),
    ]
    shared, apart = (
        [make_case(**{**one, "run": STEP | one.get("run", {})}) for one in of]
        for of in (same, other)
    )
    assert len({*map(sharing_key, shared)}) == 1
    assert len({sharing_key(case) for case in [shared[0], *apart]}) == 1 + len(apart)
    rough = [make_case(run=STEP, contact={"rolling_friction": value}) for value in (0.003, 0.006)]
    assert len({*map(sharing_key, rough)}) == 1
    compose(plan_of(*shared))
    with pytest.raises(ValueError, match="cannot share"):
        compose(plan_of(shared[0], apart[0]))


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_deck_of_several_processes_takes_as_many_cores(ranks: int, in_folder: Path) -> None:
    sweep = {"case": "pile-ci", "set": {"run.ranks": ranks}, "axes": {"run.seed": [1, 2]}}
    (in_folder / "piles.toml").write_text(to_toml(sweep))
    plan = plan_sweep(load_sweep("piles.toml"), Path("runs"), SweepOptions(2))
    engine_seconds = sum(deck.seconds for deck in plan.decks)
    assert engine_seconds > 0.0
    assert plan.core_seconds == pytest.approx(ranks * engine_seconds + plan.overhead)


@pytest.mark.parametrize("workers", [1, 16])
@pytest.mark.parametrize("sweep", ["fig2", "alignment"])
def test_every_point_travels_once_and_cores_finish_together(sweep: str, workers: int) -> None:
    cases = list(load_sweep(sweep).cases())
    decks = pack(cases, workers)
    assert sorted(point for deck in decks for point in deck.points) == list(range(len(cases)))
    for deck in decks:
        assert len({sharing_key(cases[point]) for point in deck.points}) == 1
        walkers = sum(cases[point].walkers[0].replicates for point in deck.points)
        assert len(deck.points) == 1 or (
            walkers <= MOST_WALKERS and deck.seconds <= LONGEST_SECONDS
        )
    seconds = [deck.seconds for deck in decks]
    assert seconds == sorted(seconds, reverse=True)
    # Within a fifth of the time in which no core would ever be idle, unless a single deck takes longer than that.
    assert makespan(seconds, workers) <= max(1.2 * sum(seconds) / workers, seconds[0])


def test_of_plans_that_take_as_long_the_smallest_decks_are_made() -> None:
    """A long point takes a core for as long as eight short ones would take together, however they are dealt."""
    run = {**STEP, "cycles": 12}
    decks = pack([*[make_case(run=run)] * 8, make_case(run=run | {"cycles": 160})], 2)
    assert [deck.points for deck in decks] == [(8,), *((number,) for number in range(8))]
    assert makespan((deck.seconds for deck in decks), 2) == decks[0].seconds


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a sweep over radii and time steps, whose last point is missing."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "base.toml").write_text(to_toml(document(run=TINY, dimers={"replicates": 2})))
    radii = [["0.3 mm", "0.2 mm"], ["0.25 mm", "0.25 mm"]]
    sweep = {
        "case": "base.toml",
        "axes": {"dimers.radii": radii, "run.time_step": ["2 us", "auto"]},
    }
    (folder / "test.toml").write_text(to_toml(sweep))
    assert (
        call("sweep", "test.toml", folder=folder).stdout.splitlines()[0]
        == "test: 4 points, 4 finished"
    )
    shutil.rmtree(load_table(folder / "runs" / "test")["run"][3])
    return folder


def test_a_plan_of_a_sweep_runs_nothing_and_counts_what_is_missing(
    sweep_file: Callable[..., str],
) -> None:
    name = sweep_file("[axes]\nrun.seed = [1, 2]")
    assert "2 points in 1 deck\n" in call("sweep", name, "-j", "1", "--dry-run", check=True).stdout
    assert not Path("runs").exists()
    call("sweep", name, check=True)
    assert "0 points in 0 decks" in call("sweep", name, "--dry-run", check=True).stdout


def test_a_table_has_the_values_of_each_point_in_the_units_of_the_sweep(swept: Path) -> None:
    frame = load_table(swept / "runs" / "test")
    expected = {
        "point": [0, 1, 2, 3],
        "dimers.radii[0]": [0.3, 0.3, 0.25, 0.25],
        "run.time_step": [2.0, "auto", 2.0, "auto"],
        "status": [DONE, DONE, DONE, "missing"],
        "lost": [0, 0, 0, 0],
    }
    assert {name: list(frame[name]) for name in expected} == expected
    units = frame.attrs["units"]
    assert (units["run.time_step"], units["dimers.radii[1]"], units["velocity"]) == (
        "us",
        "mm",
        "m/s",
    )


def test_a_table_has_the_results_of_its_runs(swept: Path) -> None:
    frame = load_table(swept / "runs" / "test")
    for row in frame[:3].itertuples():
        directory = Path(row.run)
        numbers = json.loads((directory / "result.json").read_text())["numbers"]
        assert [row.velocity, row.smallest] == [numbers["velocity"], numbers["smallest"]]
        case = case_of(directory)
        assert row.gamma0 == pytest.approx(dimer_of(case).gamma0(case.excitation.peak_acceleration))
    assert np.isnan(frame["velocity"][3])


def test_a_table_is_written_as_csv_with_the_units_in_its_header(swept: Path) -> None:
    call("list", "runs/test", "--to", "table.csv", check=True, folder=swept)
    written = pd.read_csv(swept / "table.csv")["velocity (m/s)"]
    np.testing.assert_array_equal(written, load_table(swept / "runs" / "test")["velocity"])


def test_a_table_is_written_as_parquet_with_types_for_missing_points(swept: Path) -> None:
    """Of numbers and words all become words; truths stay truths."""
    call("list", "runs/test", "--to", "table.parquet", check=True, folder=swept)
    table = pq.read_table(swept / "table.parquet")
    assert table.schema.field("velocity").metadata[b"unit"] == b"m/s"
    assert table.column("run.time_step").to_pylist() == ["2.0", "auto", "2.0", "auto"]
    assert table.column("walkers_met").to_pylist() == [False, False, False, None]


def test_a_table_is_printed_as_json_and_as_text(swept: Path) -> None:
    frame = load_table(swept / "runs" / "test")
    contents = json.loads(call("list", "runs/test", "--json", check=True, folder=swept).stdout)
    assert [point["amplitude"] for point in contents["points"]][:3] == list(frame["amplitude"][:3])
    text = call("list", "test", check=True, folder=swept).stdout
    assert "velocity (mm/s)" in text
    assert len(text.splitlines()) == 9
    assert Path(frame["run"][0]).name not in text


def test_a_descent_finds_where_the_walkers_stop(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Coulomb friction: the threshold lies where inertia of the beads overcomes it, whatever the frequency."""
    text = '[axes]\ndrive.frequency = ["60 Hz", "90 Hz"]\n'
    text += '[descend]\nfrom = "1.4 g"\nto = "0.2 g"\nstep = "0.2 g"\nuntil_below = "0.002 mm/s"'
    done = call("sweep", sweep_file(text, run={"cycles": 20, "settling_cycles": 10}))
    assert done.returncode == 0, done.stderr
    for _, descent in load_table(in_folder / "runs" / "test").groupby("drive.frequency"):
        assert list(descent["drive.peak_acceleration"]) == pytest.approx(
            [1.4 - 0.2 * n for n in range(7)]
        )
        assert list(descent["velocity"] < 2e-6) == sorted(descent["velocity"] < 2e-6)
    ends = thresholds(load_table(in_folder / "runs" / "test"))
    assert list(ends["moving"] - ends["at_rest"]) == pytest.approx([0.2, 0.2])
    assert ends["moving"].nunique() == 1
    assert "moving (g)" in done.stdout


UNSTABLE = """
set.run.allow_unstable = true
[[zip]]
run.seed = [1, 2, 3, 4, 5]
run.time_step = ["2 us", "2 us", "30 us", "2 us", "2 us"]
"""
GLYCEROL = {
    "liquid": {"name": "glycerol 87 %"},
    "run": {**TINY, "cycles": 20, "samples_per_cycle": 1},
}
LOSES = "s/^run /group gone id 2\\ndelete_atoms group gone compress no\\nrun /"
FAILING: dict[str, tuple[str, dict[str, Any], str, tuple[str, int, str]]] = {
    # A sweep whose third point fails, changes of its case, script of the engine, reason, lost beads, message.
    "a time step far beyond the viscous limit": (UNSTABLE, GLYCEROL, "", ("BlowUp", 0, "blow-up")),
    # Who has a restitution of 0.61 loses a bead, and takes all down that are in the deck.
    "lost beads": (
        "axes.contact.restitution = [0.3, 0.5, 0.61, 0.7, 0.4]",
        {},
        f'grep -qF " 0.61" walker.lig && sed -i "{LOSES}" walker.lig',
        ("BeadsLost", 1, "bead"),
    ),
}


@pytest.mark.parametrize("name", FAILING)
def test_a_failing_point_does_not_stop_the_others(
    name: str, sweep_file: Callable[..., str], in_folder: Path, front: Callable[[str], str]
) -> None:
    text, changes, script, (reason, lost, message) = FAILING[name]
    log = in_folder / "launches"
    engine = front(f'pwd >> {log}\n{script}\nexec liggghts "$@"')
    done = call("sweep", sweep_file(text, **changes), "-j", "1", "--engine", engine)
    assert (done.returncode, "point 2, base-" in done.stderr, message in done.stderr) == (
        1,
        True,
        True,
    )
    frame = load_table("runs/test")
    assert list(frame["status"]) == [DONE, DONE, "failed", DONE, DONE]
    assert (frame["reason"][2], list(frame["lost"])) == (reason, [0, 0, lost, 0, 0])
    failed = Path(frame["run"][2])
    assert (failed / "failure.json").exists()
    assert "5 points, 4 finished, 1 failed" in call("list", "runs/test", check=True).stdout
    log.unlink()
    assert call("sweep", "test.toml", "--engine", engine).returncode == 1
    launched = [
        part
        for place in log.read_text().split()
        for part in Path(place).parts
        if "incomplete" in part
    ]
    assert launched == [failed.name]


SIXTEEN = "[axes]\ncontact.restitution = { linspace = [0.3, 0.6, 16] }"
HITS_ALL = {
    # Script of an engine that is noted at each start, launches at most, message.
    "no licence": (
        "echo 'LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0'; echo 'ERROR: no licence'",
        8,
        "no licence",
    ),
    "dies at once": ("exit 7", 3, "never started"),
    "another version": (
        'liggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"',
        1,
        "4.0.0",
    ),
}


@pytest.mark.parametrize("name", HITS_ALL)
def test_a_failure_of_every_point_stops_the_sweep(
    name: str, sweep_file: Callable[..., str], in_folder: Path, front: Callable[[str], str]
) -> None:
    script, most, message = HITS_ALL[name]
    launches = in_folder / "launches"
    engine = front(f"echo >> {launches}\n{script}")
    done = call("sweep", sweep_file(SIXTEEN), "-j", "1", "--engine", engine)
    assert (done.returncode, "Traceback" in done.stderr, done.stderr.count(message)) == (
        1,
        False,
        1,
    ), done.stderr
    assert 1 <= len(launches.read_text().splitlines()) <= most
    assert (
        "16 points in" in call("sweep", "test.toml", "--dry-run").stdout
    )  # the next call makes all of them


def test_two_sweeps_over_the_same_points_share_them(
    sweep_file: Callable[..., str], in_folder: Path, front: Callable[[str], str]
) -> None:
    """One point has a deck of its own, those of 80 Hz share one: each is made once, whichever sweep comes first."""
    log = in_folder / "launches"
    engine = front(f'pwd >> {log}\nexec liggghts "$@"')
    points = {
        "first": [(70, 2), (80, 1), (80, 2), (80, 3)],
        "second": [(70, 2), (80, 2), (80, 3), (80, 4)],
    }
    for name, each in points.items():
        values = {"drive.frequency": [f"{hertz} Hz" for hertz, _ in each]}
        values |= {"drive.peak_acceleration": [f"{g} g" for _, g in each]}
        sweep_file(to_toml({"zip": [values]}), name)
    command = [PROGRAM, "sweep", "first.toml", "-j", "2", "--engine", engine]
    program = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    # The second begins while engines of the first run.
    wait_for(lambda: program.poll() is not None or log.exists())
    assert call("sweep", "second.toml", "-j", "2", "--engine", engine).returncode == 0
    assert program.wait(timeout=PATIENCE) == 0
    runs = {
        run
        for name in points
        for run in zip(points[name], load_table(f"runs/{name}")["run"], strict=True)
    }
    made = {
        str(path.parent.relative_to(in_folder))
        for path in in_folder.glob("runs/base-*/manifest.json")
    }
    assert {run for _, run in runs} == made
    assert len(made) == len(runs) == 5
    launches = log.read_text().split()
    assert len(set(launches)) == len(launches) <= 5


def test_workers_that_are_handed_over_give_the_same(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """The example of the documentation; and a pool that breaks."""
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "clusters.md").read_text("utf-8")
    _, script = re.findall(r"```python\n(.+?)```", page, re.DOTALL)
    (in_folder / "script.py").write_text(script)
    sweep_file('[axes]\nrun.time_step = ["2 us", "1 us"]', "sweep")
    done = subprocess.run([sys.executable, "script.py"], capture_output=True, text=True, check=True)
    assert "sweep: 2 points, 2 finished" in done.stdout
    call("sweep", "sweep.toml", "-j", "2", "--out", "here")
    assert bits(in_folder / "runs") == bits(in_folder / "here") != {}
    with ProcessPoolExecutor(1) as pool:
        worker = pool.submit(os.getpid).result()
        (in_folder / "front").write_text(f'#!/bin/sh\nkill -9 {worker}\nexec liggghts "$@"\n')
        (in_folder / "front").chmod(0o755)
        options, engine = SweepOptions(1, executor=pool), str(in_folder / "front")
        with pytest.raises(SweepStopped, match="executor's workers ended"):
            run_sweep(load_sweep("sweep.toml"), in_folder / "again", options, engine=engine)


def test_another_sweep_of_the_same_name_is_told(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Afterwards by a warning, at the same time by an error; an edit that keeps a point is neither."""
    axis = "[axes]\ndrive.peak_acceleration = "
    first, edited, other = (
        load_sweep(sweep_file(axis + a)) for a in ('["2 g"]', '["2 g", "3 g"]', '["4 g"]')
    )
    out = in_folder / "runs"
    with warnings.catch_warnings():
        warnings.simplefilter("error", SweepReplacedWarning)
        run_sweep(first, out, SweepOptions(1))
        run_sweep(edited, out, SweepOptions(1))
    with pytest.warns(SweepReplacedWarning, match="same name"):
        run_sweep(other, out, SweepOptions(1))
    record = plan_sweep(first, out / "new", SweepOptions(1)).record
    with pytest.raises(SweepStopped, match="same name"):
        run_sweep(edited, out / "new", SweepOptions(1), on_progress=lambda _: write_record(record))


def test_the_share_of_a_sweep_that_is_done_is_that_of_its_work(
    sweep_file: Callable[..., str], in_folder: Path
) -> None:
    """Of two points in decks of their own the first costs most: when it is done, so is most of the work, not half.

    Each deck waits until the progress before it was seen.
    """
    loaded = load_sweep(sweep_file("[axes]\nrun.cycles = [120, 20]", "uneven"))
    seen: list[Progress] = []
    gates = [threading.Event(), threading.Event()]
    waiting = iter(gates)

    class Gated(ThreadPoolExecutor):
        def submit(self, function: Any, /, *given: Any, **how: Any) -> Any:
            gate = next(waiting)
            return super().submit(lambda: gate.wait(PATIENCE) and function(*given, **how))

    def look(progress: Progress) -> None:
        seen.append(progress)
        gates[progress.text.startswith("1 of 2 points done")].set()

    with Gated(1) as executor:
        run_sweep(loaded, in_folder / "runs", SweepOptions(1, executor=executor), on_progress=look)
    shares = [progress.share for progress in seen]
    halfway = [progress for progress in seen if progress.text.startswith("1 of 2 points done")]
    assert (shares, shares[0] < 0.5, shares[-1], bool(halfway)) == (sorted(shares), True, 1.0, True)
    for progress in halfway:
        assert progress.share > 0.7
        assert ("measuring" if progress.share >= 0.995 else "of the work") in progress.text


def test_the_share_of_a_shared_deck_is_that_of_its_steps(tmp_path: Path) -> None:
    """As its engine says beside the first of its runs; before that none is known."""
    cases = [make_case(drive={"peak_acceleration": peak}) for peak in ("2 g", "4 g")]
    deck, place = compose(plan_of(*cases)), tmp_path / "first"
    assert progress_at(place) is None
    folder = unfinished(place) / DECK_FOLDER
    folder.mkdir(parents=True)
    write_json(folder / LAYOUT_NAME, deck.layout.as_dict())
    (folder / OUTPUT_NAME).write_text(f" {deck.layout.steps // 4} 4 0.05 {'0.001 ' * 6}\n")
    assert progress_at(place)[0] == pytest.approx(0.25, rel=1e-3)


def test_what_parsl_is_told(tmp_path: Path) -> None:
    file = {
        "partition": "main",
        "account": "granular",
        "walltime": "02:00:00",
        "nodes": 2,
        "jobs": 4,
        "cores": 16,
    }
    file |= {"shell": ["module load openmpi", "ulimit -c 0"], "sbatch": ["--qos=long", "--mem=4G"]}
    (tmp_path / "site.toml").write_text(
        to_toml(file | {"address": "10.1.0.1", "container": "apptainer exec w.sif"})
    )
    config = load_site(tmp_path / "site.toml")
    assert [decks_at(config, ranks) for ranks in (1, 3, 17)] == [2 * 16 * 4, 2 * 5 * 4, 0]
    assert [SweepOptions(6, site).for_ranks(3).decks_at_once for site in (config, None)] == [
        2 * 5 * 4,
        2,
    ]
    with pytest.raises(InputError, match="17 MPI processes"):
        SweepOptions(6, config).for_ranks(17)
    (executor,) = prepare(config, tmp_path / "parsl", 3).executors
    provider = executor.provider
    told = {
        "partition": "main",
        "account": "granular",
        "walltime": "02:00:00",
        "exclusive": False,
        "min_blocks": 0,
    }
    told |= {"nodes_per_block": 2, "cores_per_node": 16, "max_blocks": 4}
    assert {name: getattr(provider, name) for name in told} == told
    assert type(provider.launcher).__name__ == "SrunLauncher"
    assert provider.worker_init.splitlines()[:2] == ["module load openmpi", "ulimit -c 0"]
    assert {"#SBATCH --qos=long", "#SBATCH --mem=4G"} <= {*provider.scheduler_options.splitlines()}
    assert (executor.max_workers_per_node, executor.address, executor.encrypted) == (
        5,
        "10.1.0.1",
        True,
    )
    assert executor.launch_cmd.startswith("apptainer exec w.sif process_worker_pool.py ")


@pytest.mark.slow
def test_workers_of_another_process_give_the_same(
    sweep_file: Callable[..., str], in_folder: Path, front: Callable[[str], str]
) -> None:
    """Pilots without a scheduler. The first engine ends its worker, whose deck is repeated."""
    lost = f"grep -q spawn_main /proc/$PPID/cmdline && mkdir {in_folder}/once && kill -9 $PPID"
    engine = front(f'{lost}\nexec liggghts "$@"')
    sweep_file('[axes]\nrun.time_step = ["2 us", "1 us"]')
    (in_folder / "site.py").write_text(LOCAL)
    there = [
        PROGRAM,
        "sweep",
        "test.toml",
        "--out",
        "there",
        "--site",
        "site.py",
        "--engine",
        engine,
    ]
    program = subprocess.Popen(there, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    call(
        "sweep", "test.toml", "--out", "here", "-j", "2", "--engine", engine, check=True
    )  # meanwhile
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == 0, errors
    assert bits(in_folder / "here") == bits(in_folder / "there") != {}
    assert "WorkerLost" in "".join(
        log.read_text() for log in in_folder.glob("there/test/parsl/*/parsl.log")
    )


# Eight frequencies, a deck each; at the third the time step is far beyond the viscous limit of glycerol.
ZIP = {
    "drive.frequency": {"linspace": ["60 Hz", "67 Hz", 8]},
    "run.time_step": ["2 us"] * 2 + ["40 us"] + ["2 us"] * 5,
}


@pytest.fixture(scope="module")
def cluster() -> Iterator[dict[str, str]]:
    """The environment in which SLURM's commands speak to the cluster."""
    if reason := why_not():
        pytest.skip(reason)
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        Path(folder).chmod(0o711)
        with slurm_cluster(Path(folder)) as environment:
            yield environment


def test_a_sweep_through_slurm(
    cluster: dict[str, str],
    sweep_file: Callable[..., str],
    in_folder: Path,
    front: Callable[[str], str],
) -> None:
    """A failing point, a pilot cancelled midway, an interrupt and a resumption: bit for bit what this machine gives."""
    name = sweep_file(to_toml({"set": {"run.allow_unstable": True}, "zip": [ZIP]}), **GLYCEROL)
    site = {
        "partition": "main",
        "address": "127.0.0.1",
        "cores": 1,
        "jobs": 2,
        "sbatch": ["--comment=decks"],
    }
    (in_folder / "site.toml").write_text(to_toml(site))
    # Seven launches are enough for four points, though one fails and one is cancelled; eight points need two more.
    log, go = in_folder / "launches", in_folder / "go"
    waits = f"[ $(wc -l < {log}) -le 7 ] || while ! [ -e {go} ]; do sleep 0.1; done"
    command = [
        "sweep",
        name,
        "--engine",
        front(f'echo >> {log}\n{waits}\nexec liggghts "$@"'),
        "--out",
    ]

    def start() -> subprocess.Popen[str]:
        through = [PROGRAM, *command, "cluster", "--site", "site.toml"]
        return subprocess.Popen(
            through, env=cluster, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )

    def jobs(*options: str) -> list[str]:
        told = subprocess.run(
            ["squeue", "-h", "-o", "%A", *options], env=cluster, capture_output=True, check=True
        )
        return told.stdout.decode().split()

    def has(least: int) -> bool:
        assert first.poll() is None
        return len(finished_places(in_folder / "cluster")) >= least

    first = start()
    wait_for(lambda: has(1))
    pilot, *_ = jobs("-t", "running")
    subprocess.run(["scancel", pilot], env=cluster, check=True)
    wait_for(lambda: has(4))
    assert pilot not in jobs()
    first.send_signal(signal.SIGINT)
    _, errors = first.communicate(timeout=PATIENCE)
    assert (first.returncode, "Traceback" in errors) == (130, False)
    wait_for(lambda: not jobs())
    go.touch()
    second = start()
    assert call(*command, "local").returncode == 1  # meanwhile
    _, errors = second.communicate(timeout=PATIENCE)
    assert (second.returncode, "point 2, base-" in errors, "blow-up" in errors) == (
        1,
        True,
        True,
    ), errors
    wait_for(lambda: not jobs())
    assert (
        list(load_table("cluster/test")["status"])
        == ["finished"] * 2 + ["failed"] + ["finished"] * 5
    )
    assert bits(in_folder / "cluster") == bits(in_folder / "local") != {}


BAD = {
    'partition = "main"': "toml: cores: missing",
    "cores = 1000000000": "toml: cores = 1000000000: expected .*at most 10000",
    'cores = 2\npartitoin = "main"': 'toml: partitoin = .*did you mean "partition"',
    'cores = 2\nwalltime = "2h"': 'toml: walltime = "2h": expected hours, minutes and seconds',
    # What a shell, or SLURM, would take for more.
    **{
        f"cores = 2\n{key} = '{text}'": f"toml: {key} = .*: expected letters"
        for key in ("partition", "account", "address")
        for text in ("$(touch pwned)", "a b", "a;b", "100%N")
    },
    "import walkers": "py: expected a configuration: config = parsl.Config",
    "import parsl\nconfig = parsl.Config([1])": "py: cannot be used: AttributeError: ",
}


def test_a_site_that_makes_no_sense(tmp_path: Path) -> None:
    for text, told in BAD.items():
        name = f"site.{told.partition(':')[0]}"
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=f"site.{told}"):
            load_site(tmp_path / name)
    for odd in ("100%N", "$(touch pwned)", "a b"):
        with pytest.raises(InputError, match=r"^out: .* expected letters"):
            check_path(tmp_path / odd / "fig2")
    check_path(
        tmp_path
        / load_sweep("fig4", {"contact.rolling_friction": 0.01, "contact.restitution": 0.5}).name
    )
