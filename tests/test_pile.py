"""Piles by the real engine: settled, shaken, interrupted, on two ranks, in both frames, and what is read from them."""

import json
import os
import shutil
import signal
import subprocess
import threading
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

import walkers
from tests.conftest import PROGRAM, call, engines_in, open_run, to_toml, wait_for
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import shipped
from walkers.inputs.sweep import expand
from walkers.inputs.toml import read_toml
from walkers.postprocess.results import measure, read
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import run_place, segment_directories
from walkers.runner.failures import EngineError, EngineKilled, RunBusy
from walkers.sweeps.climbing import Condition, conditions_in, describe_climbs, leaders, summarise_climbs, survival
from walkers.sweeps.climbing_figure import climbs_figure
from walkers.sweeps.scheduler import Options, plan_sweep, run_sweep
from walkers.sweeps.site import Slurm
from walkers.sweeps.table import load
from walkers.templates.deck import Deck, Segment, render_deck


def document(**changes: dict[str, Any]) -> dict[str, Any]:
    tables = tomllib.loads(shipped("case")["pile-ci"].read_text())
    for table, values in changes.items():
        tables.setdefault(table, {}).update(values)
    return tables


def small(**changes: dict[str, Any]) -> Case:
    return Case.read(document(**changes), name="pile-ci")


FloatArray = npt.NDArray[np.float64]
Once = Callable[[str, Callable[[Path], object]], Path]
# Two thirds of the steps of "auto"; the beads are shaken as soon as they have come down.
QUICK = {"time_step": "3 us", "longest_settling": "0.05 s"}
# Three segments of the drive, each as short as it can be and still have frames.
BRIEF = {"duration": "0.045 s", "segment": "0.015 s", **QUICK}
# Restarts must not lose how much liquid each bead has.
OF_BRIEF: dict[str, dict[str, Any]] = {"run": BRIEF, "liquid": {"conserved": True, "law": "willett"}}


@pytest.fixture
def run(pile_run: Path) -> Path:
    return pile_run


def brief() -> Case:
    return Case.read(document(**OF_BRIEF), name="brief")


@dataclass(frozen=True)
class Killed:
    """A folder of runs with a brief pile whose program was killed within its second segment, and its engine.

    Where the folder has a file such as ``halt-0002``, the engine stops in the midst of that segment, once, and the file
    is ``halted-0002`` then.
    """

    out: Path
    engine: str

    @property
    def place(self) -> Path:
        """Where the run is to be."""
        return run_place(brief(), find_engine(self.engine), self.out)

    @property
    def unfinished(self) -> Path:
        """Where it is."""
        return self.place.with_name(self.place.name + ".incomplete")

    def copied(self, out: Path) -> "Killed":
        """The same in a folder that may be changed."""
        shutil.copytree(self.out, out)
        return replace(self, out=out)


HALTING = """#!/bin/sh
segment=$(basename "$PWD" .new)
halt=../../../halt-$segment
if [ -e $halt ]; then
    sed -i 's/^\\(run *\\)[0-9]*/\\1999999999/' walker.lig  # else it may be over before it is stopped
    (while ! [ -e beads.bin ]; do sleep 0.02; done; kill -STOP $$; mv $halt ../../../halted-$segment) &
fi
exec liggghts "$@"
"""


@pytest.fixture(scope="session")
def killed(once: Once) -> Killed:
    """Somebody else calls before the kill: there is a file ``refused`` if that was refused."""

    def make(folder: Path) -> None:
        front, out = folder / "front", folder / "out"
        front.write_text(HALTING)
        front.chmod(0o755)
        out.mkdir()
        (out / "halt-0001").touch()
        (folder / "brief.toml").write_text(to_toml(document(**OF_BRIEF)))
        command = [PROGRAM, "run", str(folder / "brief.toml"), "--out", str(out), "--engine", str(front)]
        program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for((out / "halted-0001").exists)
            try:
                walkers.run(brief(), out, engine=str(front))
            except RunBusy:
                (out / "refused").touch()
        finally:
            program.kill()
            program.wait()
        wait_for(lambda: not engines_in(out))

    folder = once("killed-pile", make)
    return Killed(folder / "out", str(folder / "front"))


def test_an_interrupted_pile_goes_on_bit_for_bit(killed: Killed, tmp_path: Path) -> None:
    """Killed while it makes its second segment, and the engine alone while it makes the third.

    Nobody else made it meanwhile. Restart files are kept for the last two parts only.
    """
    assert (killed.out / "refused").exists()
    run = walkers.run(brief(), tmp_path).directory
    begun = killed.copied(tmp_path / "out")
    place, unfinished = begun.place, begun.unfinished
    assert len(segment_directories(unfinished)) == 1
    (begun.out / "halt-0002").touch()

    def kill_the_engine() -> None:
        wait_for((begun.out / "halted-0002").exists)
        for process in engines_in(unfinished):
            os.kill(process, signal.SIGKILL)

    killer = threading.Thread(target=kill_the_engine, daemon=True)
    killer.start()
    with pytest.raises(EngineKilled):
        walkers.run(brief(), begun.out, engine=begun.engine)
    killer.join()
    assert len(segment_directories(unfinished)) == 2
    assert not place.exists()
    walkers.run(brief(), begun.out, engine=begun.engine)
    assert len(segment_directories(run)) == 4
    assert [path.name for path in segment_directories(place)] == [path.name for path in segment_directories(run)]
    for here, there in zip(segment_directories(place), segment_directories(run), strict=True):
        for name in ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"):
            assert (here / name).read_bytes() == (there / name).read_bytes()
    for name in read(place).about["tables"]:
        assert read_table(place, name).equals(read_table(run, name))
    kept = [(path / "state.restart").exists() for path in segment_directories(place)]
    assert kept == [False, False, True, True]


def test_damaged_piles_are_told_in_a_line(run: Path, tmp_path: Path) -> None:
    def broken(name: str) -> Path:
        place = tmp_path / f"{name}-{run.name}"
        shutil.copytree(run, place)
        return place

    gap, cut, said, lines, lacking = (broken(name) for name in ("gap", "cut", "said", "lines", "lacking"))
    shutil.rmtree(segment_directories(gap)[1])
    dump = segment_directories(cut)[1] / "beads.bin"
    dump.write_bytes(dump.read_bytes()[:-100])
    (segment_directories(said)[1] / "segment.json").write_text("{")
    text = segment_directories(lines)[1] / "bridges.walls.txt"
    text.write_text(text.read_text()[:-200])
    (lacking / "case.json").write_text('{"name": "pile-ci"}')
    vtk = "export --to vtk"
    for command, place in (("plot", lacking), *((vtk, one) for one in (gap, cut, said, lines, lacking))):
        done = call(*command.split(), str(place))
        assert done.returncode == (2 if place == lacking else 1)
        assert str(place) in done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
    assert call("plot", str(cut)).returncode == 0  # figures are of the tables


def test_looking_before_the_end_leaves_nothing_stale(killed: Killed, tmp_path: Path) -> None:
    begun = killed.copied(tmp_path / "out")
    (begun.unfinished / "failure.json").write_text("{}")
    measure(begun.unfinished)
    assert read(begun.unfinished)["driven"] == 0.0
    assert (read_table(begun.unfinished, "bed")["time"] <= 0.0).all()
    finished = walkers.run(brief(), begun.out, engine=begun.engine)
    assert finished.result["driven"] > 0.04
    assert not (finished.directory / "failure.json").exists()


def written(run: Path) -> dict[str, int]:
    """When the engine wrote the beads of each whole segment, ns."""
    return {path.name: (path / "beads.bin").stat().st_mtime_ns for path in segment_directories(run)}


def test_an_error_of_the_engine_leaves_the_parts_before(tmp_path: Path) -> None:
    case, engine = small(run={**BRIEF, "duration": "0.015 s"}), find_engine(None)
    place = run_place(case, engine, tmp_path)

    def broken(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return deck if segment.drive_from is None else replace(deck, text=deck.text.replace("nve/sphere", "nve/cube"))

    with pytest.raises(EngineError, match="nve/cube"), open_run(case, engine, tmp_path) as opened:
        opened.make(render=broken)
    unfinished = place.with_name(place.name + ".incomplete")
    assert json.loads((unfinished / "failure.json").read_text())["reason"] == "EngineError"
    kept = written(unfinished)
    assert kept
    finished = walkers.run(case, tmp_path)
    assert kept.items() <= written(finished.directory).items()


def test_a_sweep_of_piles_has_a_table_and_chances(tmp_path: Path) -> None:
    """Two starts; the table has a pile's columns."""
    tables = document(run={"duration": "0.02 s", **QUICK})
    (tmp_path / "base.toml").write_text(to_toml(tables))
    sweep = expand({"case": "base.toml", "axes": {"run.seed": [1, 2]}}, source="test", name="test", folder=tmp_path)
    out = tmp_path / "runs"
    record, failures = run_sweep(sweep, out, Options(1))
    assert not failures
    frame = load(record.directory)
    assert (frame["beads"] == 60).all()
    assert (frame["climbs"] == 0).all()
    assert frame["surface_end"].between(1e-3, 9e-3).all()
    (condition,) = conditions_in([record.directory])
    found = summarise_climbs(condition.runs)
    assert (condition.label, found["runs"], found["climbed"], found["climbs"]) == ("", 2, 0, 0)
    assert found["interval"] == pytest.approx([0.0, 1.0 - 0.025**0.5])  # none of two, Clopper and Pearson
    upper = 3.6889 / found["seconds"]  # of no event (Garwood 1936)
    assert found["rate_interval"] == pytest.approx([0.0, upper], rel=1e-4)
    printed = call("climb", record.name, "--out", str(out), check=True).stdout
    assert printed.count(f"climbs     0: 0 per run and second (0 to {upper:.2g} with 95 % confidence)") == 1
    written = tmp_path / "climbs.csv"
    assert call("climb", str(out), "--to", str(written), check=True).stdout.count("0 of 2 runs climbed") == 1
    assert pd.read_csv(written)["rate_high"].to_list() == pytest.approx([upper] * 3, rel=1e-4)
    printed = call("climb", str(out), "--to", str(written.with_suffix(".svg")), "--within=10ms", check=True).stdout
    assert "0 of 2 runs climbed within 0.01 s" in printed
    assert "share that has climbed" in written.with_suffix(".svg").read_text()
    manifest = out / record.runs[0] / "manifest.json"
    manifest.rename(tmp_path / "manifest.json")
    done = call("climb", record.name, "--out", str(out), check=True)
    assert "0 of 1 runs climbed" in done.stdout
    assert "walkers: warning: test: 1 of 2 points are not finished and left out\n" in done.stderr
    (tmp_path / "manifest.json").rename(manifest)
    down = {"from": "3 g", "to": "1 g", "step": "1 g", "until_below": "1 mm/s"}
    descend = {"case": "base.toml", "descend": {"key": "drive.peak_acceleration", **down}}
    with pytest.raises(InputError, match="descend"):
        plan_sweep(expand(descend, source="test", name="down", folder=tmp_path), out, Options(1))


def as_results(first: FloatArray, driven: FloatArray, takes: float) -> dict[Path, dict[str, Any]]:
    """Results of runs whose first climbs began so and take so long to gain enough, where the run shows that, s."""
    climb = {"speed": 2e-3, "size": 2, "large": 1, "leader": 0, "leader_large": True, "walls": ["+x"], "height": 0.01}
    climb["out_of_pile"] = True
    return {
        Path(str(number)): {
            "beads": 20,
            "large": 3,
            "driven": float(end),
            "climbs": [climb | {"begin": begin, "onset": begin, "qualified": begin + takes}]
            if begin + takes <= end
            else [],
        }
        for number, (begin, end) in enumerate(zip(first.tolist(), driven.tolist(), strict=True))
    }


def summed_up(monkeypatch: pytest.MonkeyPatch, results: dict[Path, dict[str, Any]], **options: Any) -> dict[str, Any]:
    monkeypatch.setattr("walkers.sweeps.climbing._result_of", results.__getitem__)
    return summarise_climbs(list(results), **options)


def test_a_longer_run_does_not_make_climbs_likelier(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same piles, shaken for 2 s and for 8 s: what began within 2 s and gained enough later is no climb by then."""
    begins = np.random.default_rng(1).exponential(2.0, 40)
    short, long = (
        summed_up(monkeypatch, as_results(begins, np.full(len(begins), seconds), takes=1.0), within=2.0)
        for seconds in (2.0, 8.0)
    )
    assert short["climbed"] == (begins <= 1.0).sum() < (begins <= 2.0).sum()
    for key in ("climbed", "probability", "interval", "climbs", "onsets"):
        assert short[key] == long[key], key
    # What hung on a wall since the pouring can be left out.
    results = as_results(np.array([0.5, 1.0, 1.5, 2.0]), np.full(4, 8.0), takes=1.0)
    for number in ("0", "2"):
        results[Path(number)]["climbs"][0] |= {"out_of_pile": False}
    everything = summed_up(monkeypatch, results)
    assert (everything["climbed"], everything["out_of_pile"]["climbed"]) == (4, 2)
    assert everything["out_of_pile"]["onsets"] == [1.0, 2.0]
    assert everything["median"] == 2.0  # half have qualified then; half had begun a second before


def test_runs_of_different_lengths_tell_one_probability(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times to the first climb drawn from an exponential distribution, runs that end before it from another."""
    draw = np.random.default_rng(1)
    begins, driven = draw.exponential(2.0, 400), draw.uniform(0.5, 6.0, 400)
    results = as_results(begins, driven, takes=0.0)
    found = summed_up(monkeypatch, results, within=3.0)
    expected = 1.0 - np.exp(-3.0 / 2.0)
    assert found["probability"] == pytest.approx(expected, abs=0.06)
    assert found["climbed"] / found["runs"] < expected - 0.05  # as if those that had ended had not climbed
    assert found["median"] == pytest.approx(2.0 * np.log(2.0), abs=0.2)
    assert found["censored"] == (begins > np.minimum(driven, 3.0)).sum()
    assert found["ended"] == (begins > driven)[driven < 3.0].sum()
    assert f"{found['ended']} ended before" in describe_climbs(found)
    assert "95 % confidence, Kaplan-Meier)" in describe_climbs(found)
    assert summed_up(monkeypatch, results, within=7.0)["probability"] is None


def test_of_runs_that_begin_alike_the_longest_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless another engine, or another version of the decks, made them."""
    cases = {}
    runs = [("a-1", 1, 40, 7), ("b-2", 1, 80, 7), ("c-3", 2, 40, 7), ("d-4", 2, 20, 7), ("e-5", 1, 80, 6)]
    for name, seed, cycles, version in runs:
        (tmp_path / name).mkdir()
        told = {"run": {"seed": seed, "cycles": cycles, "cycles_per_segment": min(cycles, 30)}}
        case = SimpleNamespace(determinants=lambda told=told: told)
        manifest = {"deck_version": version, "engine": {"sha256": "0" * 64}}
        (tmp_path / name / "manifest.json").write_text(json.dumps(manifest))
        cases[tmp_path / name] = case
    monkeypatch.setattr("walkers.sweeps.climbing.case_of", cases.get)
    monkeypatch.setattr("walkers.postprocess.piles.applies", lambda case: True)
    usual, other = conditions_in([tmp_path])
    assert (usual.label, usual.runs) == ("deck version = 7", [tmp_path / "b-2", tmp_path / "c-3"])
    assert (other.label, other.runs) == ("deck version = 6", [tmp_path / "e-5"])


def test_two_keys_make_a_map_of_rates(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each value of one key with each of the other; a pair less, and the conditions are listed."""
    found = summed_up(monkeypatch, as_results(np.array([9.0]), np.array([4.0]), takes=1.0))
    grid = [Condition("", {}, {"a": a, "b": b}, []) for a, b in product(("10 g", "2 g"), ("1", "3", "2"))]
    (drawn, _) = climbs_figure(grid, [found] * 6).axes
    assert [tick.get_text() for tick in drawn.get_xticklabels()] == ["2 g", "10 g"]
    assert [tick.get_text() for tick in drawn.get_yticklabels()] == ["1", "2", "3"]
    assert [one.get_text() for one in drawn.texts] == ["0 (0 to 0.92)\n0/1"] * 6
    assert len(climbs_figure(grid[1:], [found] * 5).axes) == 4


def test_runs_that_climbers_ended_tell_of_later_times() -> None:
    """Two piles have climbed, and their climbers left. A third has not by 2.5 s: nobody knows after that."""
    left = survival(np.array([1.0, 2.0]), np.array([3.0, 3.5]), 5.0)
    assert (left["probability"], left["interval"]) == (1.0, pytest.approx([0.025**0.5, 1.0]))
    half = survival(np.array([1.0, np.inf]), np.array([1.5, 3.5]), 3.0)  # one of two, Clopper and Pearson
    assert half["interval"] == pytest.approx([1.0 - 0.975**0.5, 0.975**0.5])
    assert survival(np.array([1.0, 2.0, np.inf]), np.array([3.0, 3.5, 2.5]), 5.0)["probability"] is None


def test_leaders_by_chance() -> None:
    """Of 10 beads 3 are large: so are two leaders with 3/10 × 2/9, one that leads twice with 3/10."""
    climb = {"leader": 0, "leader_large": True, "large": 1, "size": 4}
    two = leaders([(10, 3, [climb, climb | {"leader": 1}])])
    one = leaders([(10, 3, [climb, climb]), (30, 1, [])])
    assert two["p_among_beads"] == pytest.approx(3.0 / 10.0 * 2.0 / 9.0, abs=0.01)
    assert one["p_among_beads"] == pytest.approx(3.0 / 10.0, abs=0.02)
    assert two["p_among_own"] == pytest.approx(1.0 / 16.0, abs=0.01)
    assert one["share_of_large"] == 0.1


def test_ranks_take_cores_of_this_machine_and_of_a_cluster() -> None:
    site = Slurm(cores=8, nodes=2).config()
    assert Options(6, site).for_ranks(2).decks_at_once == 8
    assert Options(6).for_ranks(2).decks_at_once == 3
    with pytest.raises(InputError, match="16 MPI processes"):
        Options(6, site).for_ranks(16)


def test_the_parts_of_climbs_are_judged_at_the_time_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three runs: two climb, on a plain wall after 6 s and in a corner after 2 s; the third ends at 8 s."""
    results = as_results(np.array([5.0, 1.0, 20.0]), np.array([9.0, 7.0, 8.0]), takes=1.0)
    results[Path("1")]["climbs"][0]["walls"] = ["+x", "+y"]
    found = summed_up(monkeypatch, results)
    parts = [found, found["on_plain_walls"], found["in_corners"]]
    assert [one["within"] for one in parts] == [8.0] * 3
    assert [one["probability"] for one in parts] == pytest.approx([2 / 3, 1 / 3, 1 / 3])


def test_a_band_of_the_share_that_has_climbed_does_not_fall(monkeypatch: pytest.MonkeyPatch) -> None:
    """Greenwood's band: both ends of it grow with time, as the share does."""
    for seed in range(40):
        random = np.random.default_rng(seed)
        found = summed_up(monkeypatch, as_results(random.exponential(4.0, 14), random.uniform(1.0, 9.0, 14), takes=0.0))
        json.dumps(found["curve"], allow_nan=False)
        curve = pd.DataFrame(found["curve"]).astype(float)
        assert curve["probability"].is_monotonic_increasing
        inside = curve.dropna()
        assert ((inside["low"] <= inside["probability"]) & (inside["probability"] <= inside["high"])).all()
        assert inside["high"].is_monotonic_increasing, seed


def test_a_run_shorter_than_a_segment_is_of_the_same_condition(run: Path) -> None:
    """And counts no more, beside the longer one with the same beginning."""
    tables = read_toml(shipped("case")["pile-ci"])
    short = Case.read({**tables, "run": {**tables["run"], **QUICK, "duration": "0.01 s"}}, name="pile-ci")
    longer = Case.read({**tables, "run": {**tables["run"], **QUICK, "duration": "0.1 s"}}, name="pile-ci")
    assert short.run.cycles_per_segment < longer.run.cycles_per_segment
    out = run.parent / "lengths"
    made = [walkers.run(case, out).directory for case in (short, longer)]
    (condition,) = conditions_in([out])
    assert condition.runs == made[1:]
