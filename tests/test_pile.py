"""Piles by the real engine: settled, shaken, interrupted, on two ranks, in both frames, and what is read from them."""

import json
import os
import re
import shutil
import signal
import subprocess
import threading
import tomllib
from collections.abc import Callable
from contextlib import nullcontext
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
from tests.conftest import HALF, PROGRAM, call, engines_in, open_run, to_toml, wait_for
from tests.printed import spoilt
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.sweep import expand
from walkers.inputs.toml import read_toml
from walkers.postprocess.figures import figures_of
from walkers.postprocess.motion import FLOOR, read_bridges, read_motion
from walkers.postprocess.results import measure, read
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import run_place, segment_directories
from walkers.runner.failures import EngineError, EngineKilled, RunBusy
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME
from walkers.show import notes
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


def test_a_pile_settles_is_shaken_and_is_whole(run: Path) -> None:
    case, motion = small(run=HALF), read_motion(run)
    assert case.mixture is not None
    manifest = json.loads((run / "manifest.json").read_text())
    assert manifest["settled"] < case.run.settled_below
    assert sorted(motion.radius) == pytest.approx(sorted(case.all_radii))
    assert int(motion.large.sum()) == case.mixture.counts[1]
    assert motion.time[0] < 0.0
    assert motion.time[-1] == pytest.approx(case.run.cycles / case.excitation.frequency)
    every = case.run.steps_per_sample * case.run.time_step
    np.testing.assert_allclose(np.diff(motion.time), every)
    # All beads are within the container, but for overlaps, and on its floor.
    room = case.boundary.width / 2.0 - motion.radius[:, None] + 1e-5
    assert (np.abs(motion.position[..., :2]) <= room).all()
    assert (motion.position[..., 2] >= motion.radius - 1e-5).all()
    agitation = (motion.velocity**2).sum(axis=2).mean(axis=1)
    start = int(np.searchsorted(motion.time, 0.0))
    assert agitation[start] < 6e-3**2  # it is to begin below 5 mm/s, weighed by mass
    assert agitation[start + 3 :].min() > 1e-2**2


def test_bridges_are_the_engines(run: Path) -> None:
    motion = read_motion(run)
    frames = list(read_bridges(motion))
    assert len(frames) == len(motion.time)
    bridges = frames[-1]
    position, radius = motion.position[-1], motion.radius
    apart = np.linalg.norm(position[bridges.beads[:, 0]] - position[bridges.beads[:, 1]], axis=1)
    np.testing.assert_allclose(bridges.gap, apart - radius[bridges.beads].sum(axis=1), atol=1e-9)
    on_floor = bridges.wall_beads[bridges.walls == FLOOR]
    assert len(on_floor) == len(set(on_floor.tolist())) > 3
    assert (position[on_floor, 2] - radius[on_floor] < 2e-4).all()


def test_tables_of_a_pile(run: Path) -> None:
    motion = read_motion(run)
    bed, members = read_table(run, "bed"), read_table(run, "members")
    frames = np.searchsorted(bed["time"], members["time"])
    np.testing.assert_array_equal(members["height"], motion.position[frames, members["bead"], 2])
    assert members.groupby("time")["track"].nunique().sum() == bed["clusters"].sum()
    assert len(bed) == len(motion.time)
    assert bed["bridges"].iloc[-1] > 2.0


def test_contacts_and_bridges_are_counted_at_rest_and_while_shaken(run: Path) -> None:
    """Bridges to walls and the floor count for none."""
    motion, bed, found = read_motion(run), read_table(run, "bed"), read(run)
    rest = bed[bed["time"] <= 0.0].iloc[-1]
    assert found["contacts_at_rest"] == pytest.approx(rest["contacts"])
    bridges = list(read_bridges(motion))[rest.name]
    ends = [bead for pair in bridges.beads.tolist() for bead in pair]
    assert found["bridges_at_rest"] == pytest.approx(rest["bridges"]) == pytest.approx(len(ends) / len(motion.radius))
    late = bed[bed["time"] >= bed["time"][bed["time"] >= 0.0].mean()]
    shaken = [found["contacts_shaken"], found["bridges_shaken"]]
    assert shaken == pytest.approx([late["contacts"].mean(), late["bridges"].mean()])


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


def test_both_frames_shake_alike(tmp_path: Path) -> None:
    """Until chaotic trajectories part; in the laboratory the container's motion is taken off at any phase."""
    run = {"duration": "0.03 s", "frames_per_second": 680.0, **QUICK}
    cases = [small(drive={"frame": frame}, run=run) for frame in ("container", "lab")]
    amplitude = cases[1].excitation.amplitude
    motions = [walkers.run(case, tmp_path).motion for case in cases]
    here, there = ([array[motion.first_driven :] for array in (motion.position, motion.velocity)] for motion in motions)
    assert cases[1].run.samples_per_cycle == 4
    apart = np.sqrt(((here[0] - there[0]) ** 2).sum(axis=2).mean(axis=1))
    assert apart[:12].max() < 0.05 * amplitude
    agitation = [float((velocity**2).sum(axis=2).mean()) for _, velocity in (here, there)]
    assert agitation[0] == pytest.approx(agitation[1], rel=0.1)
    # The lowest beads lie on the floor throughout the cycle.
    lowest = (motions[1].position[..., 2] - motions[1].radius).min(axis=1)
    assert np.abs(lowest).max() < 0.2 * amplitude


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


BAD: list[tuple[dict[str, dict[str, Any]], str]] = [
    ({"mixture": {"count": None}}, "mixture.count"),
    ({"mixture": {"fill_height": "3 mm"}}, "expected either count or fill_height"),
    ({"mixture": {"large": ["0.29 mm", "0.4 mm"]}}, "mixture.large"),
    ({"mixture": {"small": ["0.32 mm", "0.3 mm"]}}, "mixture.small"),
    ({"boundary": {"width": "1.5 mm"}}, "boundary.width"),
    ({"boundary": {"height": "2 mm"}}, "boundary.height"),
    ({"run": {"duration": "9000 s"}}, "run.duration"),
    ({"dimers": {"radii": ["0.5 mm", "0.3 mm"], "replicates": 1}, "liquid": {"conserved": True}}, "liquid.conserved"),
]


@pytest.mark.parametrize(("changes", "key"), BAD)
def test_a_bad_pile_is_told_by_its_key(changes: dict[str, dict[str, Any]], key: str) -> None:
    tables = document(**changes)
    tables["mixture"] = {name: value for name, value in tables["mixture"].items() if value is not None}
    with pytest.raises(InputError, match=re.escape(key)):
        Case.read(tables, source="bad.toml", name="bad")


def test_counts_of_beads_by_fill_height_mass_and_number() -> None:
    tables = document()
    del tables["mixture"]["count"]
    tables["mixture"]["fill_height"] = "2 mm"
    by_height = Case.read(tables, name="filled").mixture
    by_mass, by_number = load_case("pile-fig1a").mixture, small(mixture={"mixed_by": "number"}).mixture
    assert None not in (by_height, by_mass, by_number)
    assert 60 <= sum(by_height.counts) <= 90  # a packing fraction of 0.55, with beads of 0.24 mm³ in the mean
    volumes = [
        sum(4.0 / 3.0 * np.pi * r**3 for r in sizes) / len(sizes)
        for sizes in (by_mass.small_radii, by_mass.large_radii)
    ]
    assert by_mass.counts[0] * volumes[0] == pytest.approx(by_mass.counts[1] * volumes[1], rel=0.01)
    assert by_number.counts == (30, 30)


@pytest.mark.parametrize(("mixed_by", "counts"), [("mass", (80, 10)), ("volume", (80, 10)), ("number", (45, 45))])
def test_a_share_is_of_what_a_mixture_is_mixed_by(mixed_by: str, counts: tuple[int, int]) -> None:
    """Beads of twice the radius have eight times the volume, and the mass; the share is a half, of 90 beads."""
    case = small(mixture={"small": ["0.25 mm"] * 2, "large": ["0.5 mm"] * 2, "mixed_by": mixed_by, "count": 90})
    assert case.mixture is not None
    assert case.mixture.counts == counts


def test_the_engine_counts_the_steps_of_a_rest_too() -> None:
    """2^31 steps of at most 2 us are 4,295 s: a drive of 4,000 s fits after a rest of 100 s, not after one of 300 s."""
    run = {"duration": "4000 s", "time_step": "2 us", "longest_settling": "100 s"}
    fits = small(run=run).run
    assert 3900.0 < fits.steps * fits.time_step < 4001.0
    with pytest.raises(InputError, match=r"run\.duration.*expected at most \d+ s: the engine counts steps"):
        small(run={**run, "longest_settling": "300 s"})


def test_the_program_on_piles(run: Path, in_folder: Path) -> None:
    import imageio_ffmpeg
    import pyvista as pv

    def told(*command: str) -> str:
        return call(*command, check=True).stdout.strip()

    motion = read_motion(run)
    assert "bridges per bead, at rest" in told("run", str(run))
    assert told("plot", str(run), "--to", "here") == "here/climb.png"
    assert spoilt(figures_of(run)["climb"]) == []
    assert told("render", str(run), "--to", "here/box.png", "--images", "2") == "here/box.png"
    picture = pv.read(in_folder / "here" / "box.png")
    across, up, _ = picture.dimensions
    edges = picture.point_data.active_scalars.reshape(up, across, -1)[..., :3]
    assert all((edge == 255).all() for edge in (edges[0], edges[-1], edges[:, 0], edges[:, -1]))  # nothing is cut
    told(
        "render", "--film", str(run), "--to", "one.gif", "--fps", "10", "--size", "64x64", "--end", "8 ms"
    )  # within a frame
    film = told(
        "render", "--film", str(run), "--to", "here/box.mp4", "--fps", "10", "--size", "160x120", "--slowdown", "5"
    )
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(film)
    assert frames == int(50.0 * motion.time[-1]) + 1
    assert seconds == pytest.approx(5.0 * motion.time[-1], abs=0.1)
    whole, begun = (told("climb", str(run), *cut) for cut in ([], ["--within", "1 ms"]))
    assert float(re.findall(r"\(0 to (\S+) with", begun)[0]) > float(re.findall(r"\(0 to (\S+) with", whole)[0])
    reader = pv.get_reader(told("export", str(run), "--to", "vtk", "--every", "4", "-o", "here/vtk"))
    driven = np.flatnonzero(motion.time >= 0.0)[::4]
    np.testing.assert_allclose(reader.time_values, motion.time[driven], atol=1e-12)
    beads, bridges, box = (pv.read(f"here/vtk/{name}_{driven[1]:06d}.vtu") for name in ("beads", "bridges", "boundary"))
    np.testing.assert_allclose(beads.points, motion.position[driven[1]], rtol=1e-6, atol=1e-9)
    assert set(np.unique(beads["is_climber"])) <= {0, 1}
    assert bridges.n_cells > 50
    np.testing.assert_allclose(box.bounds, [-2e-3, 2e-3, -2e-3, 2e-3, 0.0, 20e-3], atol=1e-9)
    (in_folder / "pile-ci.toml").write_text(to_toml(document(run=HALF)))
    assert re.search(r"\n  beads +60\n", told("run", "pile-ci.toml", "--out", str(run.parent)))
    assert "in which the beads come to rest" in told("export", "pile-ci", "--to", "deck")


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


def test_a_climber_that_leaves_the_container_ends_the_run(tmp_path: Path) -> None:
    """It climbs at 4.8 mm/s; its upper bead is 3.2 mm below where the walls end; segments are of 0.05 s."""
    tables = tomllib.loads(shipped("case")["cluster"].read_text())
    tables["contact"]["friction"] = {"bead_bead": 0.3, "bead_wall": 0.3}
    places = ((0.545, 2.0), (0.3075, 1.18135))
    tables["placed"] = [{"radius": f"{r} mm", "at": [f"{2.5001 - r} mm", "0 mm", f"{z} mm"]} for r, z in places]
    tables["boundary"]["height"] = "2.6 mm"
    tables["run"] |= {"duration": "1 s", "segment": "0.05 s"}
    finished = walkers.run(Case.read(tables, name="cluster"), tmp_path)
    assert finished.result["driven"] == pytest.approx(3.2e-3 / 4.79e-3, abs=0.1)
    assert "over its walls" in read_json(finished.directory / MANIFEST_NAME)["ended"]
    assert "climbers left the container" in finished.describe()
    assert call("check", "files", str(finished.directory)).returncode == 0


def test_a_placed_dimer_climbs_like_the_climber_and_falls_the_other_way_round(tmp_path: Path) -> None:
    """The same dimer as that of `tests.test_bodies`, by the other way: a box, the pile's recording, clusters, climbs.

    On the wall across from it is one led by its small bead.
    """
    tables = tomllib.loads(shipped("case")["cluster"].read_text())
    large, small = 0.545, 0.3075
    tables["contact"]["friction"] = {"bead_bead": 0.3, "bead_wall": 0.3}
    tables["placed"] = [
        {"radius": f"{radius} mm", "at": [f"{side * (2.5001 - radius)} mm", "0 mm", f"{height} mm"]}
        for side, beads in ((1, (large, small)), (-1, (small, large)))
        for radius, height in zip(beads, (8.0, 7.18135), strict=True)
    ]
    tables["run"]["duration"] = "0.5 s"
    finished = walkers.run(Case.read(tables, name="cluster"), tmp_path)
    assert finished.result["climbs"] == 1
    clusters = finished.table("clusters")
    (climb,) = clusters[clusters["climbed"]].to_dict("records")
    assert climb["speed"] * 1e3 == pytest.approx(4.79, rel=0.03)
    assert (climb["size"], climb["large"], climb["leader_large"], climb["wall_names"]) == (2, 1, True, "+x")
    assert climb["begin"] == pytest.approx(0.0, abs=0.05)
    assert finished.motion.position[-1, 2:, 2].max() < 7e-3


def test_placed_beads_reach_the_side_of_a_cylinder() -> None:
    tables = tomllib.loads(shipped("case")["cluster"].read_text())
    tables["boundary"]["shape"] = "cylinder"
    for number, bead in enumerate(tables["placed"]):
        bead["at"] = ["0 mm", "0 mm", f"{8 - 2 * number} mm"]
    case = Case.read(tables, name="cylinder")
    assert [radius > case.border for radius in case.all_radii] == [True, False, False]
    for turn, beyond in product((0.0, 0.3), (-1e-3, 0.02)):
        reach = 2.5 - 0.545 + beyond
        place = [f"{reach * np.cos(turn)} mm", f"{reach * np.sin(turn)} mm", "8 mm"]
        tables["placed"] = [{"radius": "0.545 mm", "at": place}]
        with pytest.raises(InputError, match="within the boundary") if beyond > 0.0 else nullcontext():
            Case.read(tables, name="cylinder")


def test_ranks_take_cores_of_this_machine_and_of_a_cluster() -> None:
    site = Slurm(cores=8, nodes=2).config()
    assert Options(6, site).for_ranks(2).decks_at_once == 8
    assert Options(6).for_ranks(2).decks_at_once == 3
    with pytest.raises(InputError, match="16 MPI processes"):
        Options(6, site).for_ranks(16)


@pytest.mark.parametrize(("cores", "share"), [(1, "share 1 core of"), (2, "")])
def test_more_processes_than_cores_are_noted_before_a_run(cores: int, share: str) -> None:
    ours = os.sched_getaffinity(0)
    if len(ours) < cores:
        pytest.skip(f"this machine has less than {cores} cores")
    os.sched_setaffinity(0, sorted(ours)[:cores])
    try:
        told = notes(load_case("pile-ci", {"run.ranks": 2}))
    finally:
        os.sched_setaffinity(0, ours)
    assert [f"2 MPI processes (run.ranks) {share}" in note for note in told] == [True] * bool(share)


@pytest.mark.parametrize(("shape", "walls"), [("cylinder", 1), ("octagon", 8)])
def test_a_container_holds_its_beads(shape: str, walls: int, tmp_path: Path) -> None:
    run = {"duration": "0.03 s", "frames_per_second": 680.0, **QUICK}
    case = small(boundary={"shape": shape, "width": "5 mm"}, run=run)
    motion = walkers.run(case, tmp_path).motion
    driven = motion.position[motion.time >= 0.0]
    room = case.boundary.side_clearance(driven.reshape(-1, 3)).reshape(driven.shape[:2]) - motion.radius
    assert -1e-5 < room.min() < 0.05 * 2.5e-3
    assert driven[..., :2].std() > 0.2 * 2.5e-3
    number = 0
    for bridges in read_bridges(motion):
        held = bridges.wall_beads[bridges.walls != FLOOR]
        assert set(bridges.walls.tolist()) <= {FLOOR, *range(1, 1 + walls)}
        assert shape == "octagon" or len(held) == len(set(held.tolist()))
        number += len(held)
    assert number >= 2


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, []),
        ({"mixture.small_share": 1}, ["no large beads"]),
        ({"mixture.small_share": 0}, ["no small beads"]),
        ({"run.duration": "10 s"}, [r"climbers faster than 7\.[67] mm/s"]),
        ({"run.time_step": "4 us"}, [r"the time step is 2\.1 times the largest of auto \(0\.4 of the viscous"]),
    ],
)
def test_what_is_said_of_a_pile_before_it_is_shaken(changes: dict[str, Any], told: list[str]) -> None:
    """(2 · 40 mm - 41 µL/(0.55 (5.3 mm)²))/10 s is 7.7 mm/s."""
    found = notes(load_case("pile-small", changes))
    assert len(found) == len(told)
    assert all(re.match(one, other) for one, other in zip(told, found, strict=True))


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
