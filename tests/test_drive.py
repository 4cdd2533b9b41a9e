"""Recorded shaking and ramps, in both frames and in both engines; thresholds of motion by a ramp."""

import re
import shutil
from dataclasses import replace
from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, document, make_case, to_toml
from walkers import load_case, run
from walkers.inputs.case_building import changed_case, stored_case
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import boundary_motion
from walkers.postprocess.measure.numbers import rows, state
from walkers.postprocess.measure.quantities import declared
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.threshold import _crossed, _thresholds, measure
from walkers.runner.binary import find_engine
from walkers.runs.making import make_runs
from walkers.second_engine.crosscheck import compare_motions
from walkers.templates.placement import sharing_key

PERIOD = 1.0 / 80.0
BRIEF = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
RAMP = [["0.01 s", 0.5], ["0.06 s", 1.25]]


def csv(time: Any, **columns: Any) -> str:
    """A record with times in ms and accelerations in g, all digits."""
    heads = ["time (ms)", *(f"{axis} (g)" for axis in columns)]
    rows = np.column_stack([1e3 * time, *columns.values()]).tolist()
    return "\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def sine(rows: int = 1000, **more: float) -> str:
    """A period of 4 g at 80 Hz along x, of which the displacement is a sine; and other columns, which are constant."""
    time = np.linspace(0.0, PERIOD, rows + 1)
    other = {axis: np.full_like(time, value) for axis, value in more.items()}
    return csv(time, x=-4.0 * np.sin(2.0 * pi * time / PERIOD), **other)


def recorded(folder: Path, text: str, run: Any = None, dimers: Any = None, **drive: Any) -> Case:
    tables = document(run=run or BRIEF, dimers=dimers or {})
    tables["drive"] = {"record": "record.csv", **drive}
    (folder / "record.csv").write_text(text)
    (folder / "case.toml").write_text(to_toml(tables))
    return load_case(folder / "case.toml")


@pytest.mark.parametrize("frame", ["container", "lab"])
@pytest.mark.parametrize("ramp", [[], RAMP], ids=["even", "ramp"])
def test_a_sine_as_a_record_is_the_sine(frame: str, ramp: list[Any], tmp_path: Path) -> None:
    """So are the bytes of its numbers to nine digits; a constant along z, such as gravity, is none of the shaking."""
    drive = {"frame": frame, **({"ramp": ramp} if ramp else {})}
    expected = run(make_case(run=BRIEF, drive=drive), tmp_path).result
    found = run(recorded(tmp_path, sine(z=1.0), repeats=True, **drive), tmp_path).result
    names = (
        "velocity",
        "work",
        "rotation_1",
        "frequency",
        "peak_acceleration",
        "amplitude",
        "peak_velocity",
        "gamma0",
    )
    assert [found[name] for name in names] == pytest.approx(
        [expected[name] for name in names], rel=1e-9
    )


def test_a_ramp_multiplies_the_displacement() -> None:
    """By a factor that is even between its times; by hand, half way and after its end, with the velocity's own part."""
    case = make_case(run=BRIEF, drive={"ramp": RAMP})
    turn = 2.0 * pi * 80.0
    for time, factor, slope in ((0.002, 0.5, 0.0), (0.035, 0.875, 15.0), (0.07, 1.25, 0.0)):
        place, speed = boundary_motion(case.excitation, np.array([time]))
        plain = 39.2 / turn**2 * np.sin(turn * time)
        assert place[0, 0] == pytest.approx(factor * plain)
        assert speed[0, 0] == pytest.approx(
            factor * 39.2 / turn * np.cos(turn * time) + slope * plain
        )


def test_largest_values_are_those_at_the_largest_factor_of_a_ramp() -> None:
    """4 g at 80 Hz; the factor is largest in the middle."""
    ramp = [["0.01 s", 0.5], ["0.03 s", 1.25], ["0.06 s", 0.75]]
    drive = make_case(run=BRIEF, drive={"ramp": ramp}).excitation
    turn = 2.0 * pi * 80.0
    assert drive.peak_acceleration == pytest.approx(1.25 * 39.2)
    assert drive.peak_velocity == pytest.approx(1.25 * 39.2 / turn)
    assert drive.amplitude == pytest.approx(1.25 * 39.2 / turn**2)
    assert drive.amplitude == pytest.approx(0.1939e-3, rel=1e-3)


def test_a_ramp_keeps_its_last_factor_for_a_slow_drive() -> None:
    """A cycle of 20 s; the factor is its mean over a cycle, at 5 s that over -5 s to 15 s."""
    ramp = [["0 s", 1], ["1 s", 0.2]]
    drive = make_case(run=BRIEF, drive={"frequency": "0.05 Hz", "ramp": ramp}).excitation
    at_5_s = (5.0 * 1.0 + 1.0 * 0.6 + 14.0 * 0.2) / 20.0
    assert drive.factor(np.array([5.0, 12.0, 100.0])) == pytest.approx([at_5_s, 0.2, 0.2])


@pytest.mark.parametrize("with_record", [False, True])
def test_frames_and_engines_agree_on_a_ramp(with_record: bool, tmp_path: Path) -> None:
    """Of harmonics, and of a record with noise in two directions that does not repeat."""
    time = np.arange(0.0, 0.1, 1e-4)
    noise = np.random.default_rng(1).normal(scale=0.02, size=(2, len(time)))
    shaken = [
        peak * np.sin(2.0 * pi * one * time + 1.0) for peak, one in ((4.0, 80.0), (0.3, 160.0))
    ]
    cases = []
    for frame in ("container", "lab"):
        case = make_case(run=BRIEF, drive={"ramp": RAMP, "frame": frame})
        if with_record:
            text = csv(time, x=shaken[0] + noise[0], z=shaken[1] + 1.0 + noise[1])
            case = recorded(tmp_path, text, ramp=RAMP, frame=frame)
        cases.append(case)
    runs = [run(case, tmp_path) for case in cases]
    assert runs[1].result["velocity"] == pytest.approx(runs[0].result["velocity"], rel=2e-5)
    assert [line for line in compare_motions([runs[0].motion]) if line.failed] == []


def test_a_run_has_its_record(tmp_path: Path) -> None:
    """It is named by the numbers, not by the file, and needs no file after: nor its deck and its changed case."""
    case = recorded(tmp_path, sine(40), repeats=True)
    first = run(case, tmp_path)
    (tmp_path / "other").mkdir()
    shutil.move(tmp_path / "record.csv", tmp_path / "other" / "renamed.csv")
    again = run(
        changed_case(case, {"drive.record": str(tmp_path / "other" / "renamed.csv")}), tmp_path
    )
    assert (again.directory, again.cached) == (first.directory, True)
    assert run(recorded(tmp_path, sine(44), repeats=True), tmp_path).directory != first.directory
    shutil.rmtree(tmp_path / "other")
    (tmp_path / "record.csv").unlink()
    kept = stored_case(first.case.as_dict())
    assert kept == first.case
    assert changed_case(kept, {"run.cycles": 7}).excitation.frequency == pytest.approx(80.0)
    assert call("show", str(first.directory), check=True).stdout.count("record") > 1


def test_a_sweep_over_records_reads_each_of_them(tmp_path: Path) -> None:
    """Also those that its base case does not name, beside the sweep."""
    case = recorded(tmp_path, sine(40), repeats=True)
    for count in (44, 48):
        (tmp_path / f"{count}.csv").write_text(sine(count))
    (tmp_path / "records.toml").write_text(
        'case = "case.toml"\n[axes]\n"drive.record" = ["44.csv", "48.csv"]\n'
    )
    expected = [
        changed_case(case, {"drive.record": str(tmp_path / f"{count}.csv")}) for count in (44, 48)
    ]
    found = load_sweep(tmp_path / "records.toml").cases()
    assert [point.determinants() for point in found] == [of.determinants() for of in expected]


def test_what_shares_a_deck_has_one_record_and_one_ramp(tmp_path: Path) -> None:
    """Walkers with other frictions do, and move as they would alone."""
    other = {"contact.friction.bead_wall": 0.2}
    case = recorded(tmp_path, sine(400), repeats=True, ramp=RAMP)
    apart = [
        changed_case(case, {"drive.ramp": [*RAMP[:1], ["0.06 s", 0.75]]}),
        recorded(tmp_path, sine(400), repeats=True),
    ]
    apart.append(recorded(tmp_path, sine(500), repeats=True, ramp=RAMP))
    assert sharing_key(changed_case(case, other)) == sharing_key(case)
    assert len({*map(sharing_key, [case, *apart])}) == 4
    both = [case, changed_case(case, other)]
    together, alone = tmp_path / "together", tmp_path / "alone"
    make_runs(both, together, find_engine())
    for one in both:
        found, expected = (run(one, place).result["velocity"] for place in (together, alone))
        assert found == pytest.approx(expected, rel=1e-6)


def test_cycles_of_records(tmp_path: Path) -> None:
    """Of one that repeats, what divides all of its lines; of another the period of the strongest, as many as it has."""
    time = np.linspace(0.0, 4.0 * PERIOD, 801)
    tones = np.sin(2.0 * pi * 160.0 * time) + 0.8 * np.sin(2.0 * pi * 240.0 * time)
    repeats = recorded(tmp_path, csv(time, y=tones), repeats=True)
    assert repeats.excitation.frequency == pytest.approx(80.0)
    assert (repeats.excitation.fastest, repeats.drive_axis) == (
        pytest.approx(240.0),
        (0.0, 1.0, 0.0),
    )
    time = np.arange(0.0, 0.3, 2e-4)
    once = recorded(tmp_path, csv(time, x=np.sin(2.0 * pi * 74.4 * time + 1.0)))
    assert once.excitation.frequency == pytest.approx(
        74.4, rel=1e-3
    )  # a third of the way between two lines
    assert once.excitation.cycle_limits == (0.0, pytest.approx(0.2998 * 74.4, rel=1e-3))
    # Left out, a run has all whole cycles of its record, or those of its ramp.
    ramped = changed_case(repeats, {"drive.ramp": RAMP})
    assert [load_case({**one.document, "run": {}}).run.cycles for one in (once, ramped)] == [22, 5]
    direction = recorded(
        tmp_path, csv(time, x=tones[0] + np.sin(500.0 * time), y=-np.sin(500.0 * time))
    ).excitation
    assert direction.direction == pytest.approx((0.5**0.5, -(0.5**0.5), 0.0))


@pytest.mark.parametrize(("ramp", "name"), [([1.2, 0.8], "stops_at"), ([0.8, 1.2], "starts_at")])
def test_a_ramp_finds_the_threshold(ramp: list[float], name: str, tmp_path: Path) -> None:
    """Where a walker that is driven at this drive all the time begins to move, at 0.9 g and not at 0.8 g."""
    points = [["0 s", ramp[0]], ["0.6 s", ramp[1]]]
    changes = {"drive.peak_acceleration": "1 g", "dimers.replicates": 1, "run.samples_per_cycle": 1}
    done = run(load_case("fig1b", {**changes, "drive.ramp": points}), tmp_path)
    found = done.result
    # By hand: the drive at the weakest end of the windows of 8 cycles in which the walker moves.
    distance = done.result.table("cycles")["distance"].to_numpy()[::8]
    moves = np.abs(np.diff(distance)) / (8.0 * PERIOD) > REST
    times = 8.0 * PERIOD * np.arange(len(distance))
    peaks = 9.8 * (ramp[0] + (ramp[1] - ramp[0]) * times / 0.6)
    weakest = np.minimum(peaks[1:], peaks[:-1])[moves].min()
    assert found[name] == pytest.approx(weakest, rel=1e-6)
    first, *others = done.describe().split("\n")
    assert first == f"fig1b: {name.replace('_', ' ')} {found[name] / 9.8:.4g} g"
    assert [
        line
        for line in others
        if re.fullmatch(rf"  {declared(name).label} .*  resolution \S+", line)
    ]
    # Means over a drive that changes say nothing, nor does it that they are not steady.
    assert (found["steady"], found.warnings) == (0, [])
    assert not {"velocity", "rotation_1", "work", "steady"} & {row.name for row in rows(found)}
    assert state({**found, name: nan}) == "no threshold within the ramp"
    assert found[name] == pytest.approx(0.9 * 9.8, abs=found[name.replace("_at", "_within")])
    assert found[name.replace("_at", "_within")] == pytest.approx(0.4 * 9.8 * 8 / 48)
    assert found[f"gamma0_{name}"] == pytest.approx(0.0857, rel=0.04)
    other = {"stops_at": "starts_at", "starts_at": "stops_at"}[name]
    assert np.isnan(found[other])
    # Whichever way it goes.
    centre = done.motion.groups[0].mass_centre
    backward = replace(done.motion, position=done.motion.position - 2.0 * (centre - centre[0]))
    assert measure(backward).numbers[name] == found[name]


def test_plateaus_of_a_ramp_neither_fall_nor_rise(tmp_path: Path) -> None:
    """A walker stops while the drive falls and starts while it rises, with 4 g and rests of 0.2 s between."""
    factors = [["0.2 s", 1], ["0.6 s", 0.1], ["0.8 s", 0.1], ["1.2 s", 1], ["1.4 s", 1]]
    changes = {"drive.ramp": factors, "dimers.replicates": 1, "run.samples_per_cycle": 1}
    found = run(load_case("fig1b", changes), tmp_path).result
    for name in ("stops", "starts"):
        assert found[f"{name}_within"] == pytest.approx(0.9 * 39.2 * 0.1 / 0.4, rel=0.02)
        assert found[f"{name}_at"] == pytest.approx(0.9 * 9.8, abs=found[f"{name}_within"])


def test_a_ramp_of_a_few_per_cent_has_a_threshold() -> None:
    """From 4.00 to 3.88 g and back, in steps of 0.02 g; the walker moves above 3.93 g."""
    falling = np.arange(400, 386, -2) / 100.0
    peaks = np.concatenate([falling, falling[-2::-1]])
    moves = ((peaks[1:] + peaks[:-1]) / 2.0 > 3.93)[:, None]
    found = _thresholds(moves, peaks, by_ramp=True)
    expected = {"stops_at": 3.94, "stops_within": 0.02, "starts_at": 3.94, "starts_within": 0.02}
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_plateau_at_the_start_does_not_rise() -> None:
    """A walker moves while the drive is held at 2, stops while it falls, and starts while it rises again."""
    peaks = np.array([2.0, 2.0, 2.0, 1.0, 0.5, 0.5, 1.0, 2.0, 2.0])
    moves = np.array([[1], [1], [1], [0], [0], [0], [1], [1]], dtype=np.bool_)
    found = _thresholds(moves, peaks, by_ramp=True)
    assert found == {"stops_at": 1.0, "stops_within": 1.0, "starts_at": 1.0, "starts_within": 1.0}


@pytest.mark.parametrize(
    ("moves", "expected"),
    [
        ([[1, 1], [1, 0], [0, 0]], (3.5, 0.5)),
        ([[1, 1], [1, 1], [1, 0]], (3.0, 0.5)),
        ([[0], [1], [0]], (3.0, 0.5)),
        ([[0], [0]], (nan, nan)),
        ([[1], [1]], (nan, nan)),
    ],
)
def test_the_last_window_in_which_a_walker_moves(
    moves: list[list[int]], expected: tuple[float, float]
) -> None:
    """Mean over walkers; one that never moves, or never rests, has none."""
    peaks = np.array([4.0, 3.0, 2.0])[: len(moves)]
    crossed = _crossed(np.array(moves, dtype=np.bool_), peaks, np.full(len(moves), 0.5))
    assert crossed == pytest.approx(expected, nan_ok=True)
