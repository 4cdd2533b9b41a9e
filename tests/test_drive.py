"""Recorded shaking and ramps, in both frames and both engines; thresholds of motion by a ramp."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, document, make_case, to_toml
from walkers import Run, load_case, run
from walkers.arrays import FloatArray
from walkers.inputs.case_building import changed_case, stored_case
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import boundary_motion, read_motion
from walkers.postprocess.measure.numbers import rows, state
from walkers.postprocess.measure.quantities import declared
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.threshold import _crossed, _thresholds, measure
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.runs.making import make_runs
from walkers.second_engine.crosscheck import compare_motions
from walkers.templates.placement import sharing_key

RunCase = Callable[..., Path]
PERIOD = 1.0 / 80.0
"""Of the drive of the reference case, 80 Hz, s."""
TURN = 2.0 * pi * 80.0
"""Its angular frequency, rad/s."""
PEAK = 4.0 * 9.8
"""Its acceleration, 4 g, m/s²."""
BRIEF = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
RAMP = [["0.01 s", 0.5], ["0.06 s", 1.25]]


def csv(time: Any, **columns: Any) -> str:
    """A record with times in ms and accelerations in g, all digits; columns by axis."""
    heads = ["time (ms)"]
    for axis in columns:
        heads.append(f"{axis} (g)")
    lines = [",".join(heads)]
    for row in np.column_stack([1e3 * time, *columns.values()]).tolist():
        lines.append(",".join(map(repr, row)))
    return "\n".join(lines) + "\n"


def sine(rows: int) -> str:
    """A record of a period of 4 g at 80 Hz along x whose displacement is a sine."""
    time = np.linspace(0.0, PERIOD, rows + 1)
    return csv(time, x=-4.0 * np.sin(TURN * time))


def sine_and_gravity() -> str:
    """The record of a sine by a sensor that also shows 1 g along z."""
    time = np.linspace(0.0, PERIOD, 1001)
    return csv(time, x=-4.0 * np.sin(TURN * time), z=np.full_like(time, 1.0))


def recorded(folder: Path, text: str, run: Any = None, dimers: Any = None, **drive: Any) -> Case:
    """The reference case with a drive that is a record; its files are in a folder."""
    tables = document(run=run or BRIEF, dimers=dimers or {})
    tables["drive"] = {"record": "record.csv", **drive}
    (folder / "record.csv").write_text(text)
    (folder / "case.toml").write_text(to_toml(tables))
    return load_case(folder / "case.toml")


# --- records that are a sine --------------------------------------------------------------------
@dataclass
class SameDrive:
    """Run directories of a record of a sine and of the sine itself."""

    of_record: Path
    of_sine: Path


@pytest.fixture(params=["container", "lab"])
def same_drive(
    request: pytest.FixtureRequest, run_directory: RunCase, ramp: list[Any], tmp_path: Path
) -> SameDrive:
    drive: dict[str, Any] = {"frame": request.param}
    if ramp:
        drive["ramp"] = ramp
    record = recorded(tmp_path, sine_and_gravity(), repeats=True, **drive)
    return SameDrive(run_directory(record), run_directory(run=BRIEF, drive=drive))


@pytest.mark.parametrize("ramp", [[], RAMP], ids=["even", "ramp"])
def test_walkers_move_by_a_record_of_a_sine_as_by_the_sine(same_drive: SameDrive) -> None:
    """To nine digits; a constant acceleration along z, such as gravity, is none of the shaking."""
    result = read_results(same_drive.of_record)
    expected = read_results(same_drive.of_sine)
    for name in ("velocity", "work", "rotation_1"):
        assert result[name] == pytest.approx(expected[name], rel=1e-9)


@pytest.mark.parametrize("ramp", [[], RAMP], ids=["even", "ramp"])
def test_a_record_of_a_sine_has_the_numbers_of_the_sine(same_drive: SameDrive) -> None:
    result = read_results(same_drive.of_record)
    expected = read_results(same_drive.of_sine)
    for name in ("frequency", "peak_acceleration", "amplitude", "peak_velocity", "gamma0"):
        assert result[name] == pytest.approx(expected[name], rel=1e-9)


# --- ramps --------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("time", "factor", "slope"),
    [
        pytest.param(0.002, 0.5, 0.0, id="before the ramp"),
        # The factor rises from 0.5 to 1.25 in 50 ms, by 15 per second.
        pytest.param(0.035, 0.875, 15.0, id="half way"),
        pytest.param(0.07, 1.25, 0.0, id="after its end"),
    ],
)
def test_a_ramp_multiplies_the_displacement(time: float, factor: float, slope: float) -> None:
    """By a factor f that changes evenly: x = f a sin ωt and v = f a ω cos ωt + f' a sin ωt."""
    case = make_case(run=BRIEF, drive={"ramp": RAMP})
    displacement, velocity = boundary_motion(case.excitation, np.array([time]))
    unchanged = PEAK / TURN**2 * np.sin(TURN * time)
    assert displacement[0, 0] == pytest.approx(factor * unchanged)
    expected = factor * PEAK / TURN * np.cos(TURN * time) + slope * unchanged
    assert velocity[0, 0] == pytest.approx(expected)


def test_largest_values_are_those_at_the_largest_factor_of_a_ramp() -> None:
    """4 g at 80 Hz; the factor is largest in the middle, 1.25."""
    ramp = [["0.01 s", 0.5], ["0.03 s", 1.25], ["0.06 s", 0.75]]
    drive = make_case(run=BRIEF, drive={"ramp": ramp}).excitation
    assert drive.peak_acceleration == pytest.approx(1.25 * PEAK)
    assert drive.peak_velocity == pytest.approx(1.25 * PEAK / TURN)
    assert drive.amplitude == pytest.approx(1.25 * PEAK / TURN**2)
    assert drive.amplitude == pytest.approx(0.1939e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("time", "factor"),
    [
        # Over -5 s to 15 s: 1 for 5 s, from 1 to 0.2 for 1 s, and 0.2 for 14 s.
        pytest.param(5.0, (5.0 * 1.0 + 1.0 * 0.6 + 14.0 * 0.2) / 20.0, id="soon"),
        pytest.param(12.0, 0.2, id="a cycle around is after the end of the ramp"),
        pytest.param(100.0, 0.2, id="long after"),
    ],
)
def test_a_ramp_keeps_its_last_factor_for_a_slow_drive(time: float, factor: float) -> None:
    """The factor is the mean of the ramp over a cycle, here of 20 s."""
    ramp = [["0 s", 1], ["1 s", 0.2]]
    drive = make_case(run=BRIEF, drive={"frequency": "0.05 Hz", "ramp": ramp}).excitation
    assert drive.factor(np.array([time])) == pytest.approx([factor])


def case_with_ramp(folder: Path, kind: str, frame: str) -> Case:
    """The reference case with `RAMP`, by harmonics or by a record of two tones.

    The record has noise along x and z and does not repeat.
    """
    if kind == "harmonics":
        return make_case(run=BRIEF, drive={"ramp": RAMP, "frame": frame})
    time = np.arange(0.0, 0.1, 1e-4)
    noise_x, noise_z = np.random.default_rng(1).normal(scale=0.02, size=(2, len(time)))
    x = 4.0 * np.sin(2.0 * pi * 80.0 * time + 1.0) + noise_x
    z = 0.3 * np.sin(2.0 * pi * 160.0 * time + 1.0) + noise_z
    return recorded(folder, csv(time, x=x, z=1.0 + z), ramp=RAMP, frame=frame)


@pytest.mark.parametrize("kind", ["harmonics", "record"])
def test_frames_agree_on_a_ramp(run_directory: RunCase, kind: str, tmp_path: Path) -> None:
    in_container = read_results(run_directory(case_with_ramp(tmp_path, kind, "container")))
    in_lab = read_results(run_directory(case_with_ramp(tmp_path, kind, "lab")))
    assert in_lab["velocity"] == pytest.approx(in_container["velocity"], rel=2e-5)


@pytest.mark.parametrize("kind", ["harmonics", "record"])
def test_engines_agree_on_a_ramp(run_directory: RunCase, kind: str, tmp_path: Path) -> None:
    motion = read_motion(run_directory(case_with_ramp(tmp_path, kind, "container")))
    failed = [line for line in compare_motions([motion]) if line.failed]
    assert failed == []


# --- files of records ---------------------------------------------------------------------------
def test_a_run_is_named_by_the_numbers_of_its_record_not_by_the_file(tmp_path: Path) -> None:
    case = recorded(tmp_path, sine(40), repeats=True)
    (tmp_path / "elsewhere").mkdir()
    moved = (tmp_path / "record.csv").rename(tmp_path / "elsewhere" / "renamed.csv")
    first = run(case, tmp_path)
    again = run(changed_case(case, {"drive.record": str(moved)}), tmp_path)
    assert again.directory == first.directory
    assert again.cached


def test_another_record_is_another_run(tmp_path: Path) -> None:
    engine = find_engine()
    first = run_place(recorded(tmp_path, sine(40), repeats=True), engine, tmp_path)
    second = run_place(recorded(tmp_path, sine(44), repeats=True), engine, tmp_path)
    assert second != first


def test_a_case_has_its_record(tmp_path: Path) -> None:
    """Neither the stored case nor a changed one needs the file."""
    case = recorded(tmp_path, sine(40), repeats=True)
    (tmp_path / "record.csv").unlink()
    stored = stored_case(case.as_dict())
    assert stored == case
    changed = changed_case(stored, {"run.cycles": 7})
    assert changed.excitation.frequency == pytest.approx(80.0)


def test_a_run_has_its_record(run_directory: RunCase, tmp_path: Path) -> None:
    """It is shown without the file."""
    directory = run_directory(recorded(tmp_path, sine(40), repeats=True))
    (tmp_path / "record.csv").unlink()
    shown = call("show", str(directory), check=True).stdout
    assert shown.count("record") > 1


def test_a_sweep_over_records_reads_each_of_them(tmp_path: Path) -> None:
    """Also those that its base case does not name, beside the sweep."""
    case = recorded(tmp_path, sine(40), repeats=True)
    names = ["44.csv", "48.csv"]
    (tmp_path / "44.csv").write_text(sine(44))
    (tmp_path / "48.csv").write_text(sine(48))
    (tmp_path / "records.toml").write_text(
        f'case = "case.toml"\n[axes]\n"drive.record" = {names}\n'
    )
    points = load_sweep(tmp_path / "records.toml").cases()
    for name, point in zip(names, points, strict=True):
        expected = changed_case(case, {"drive.record": str(tmp_path / name)})
        assert point.determinants() == expected.determinants()


# --- decks that several cases share -------------------------------------------------------------
OTHER_FRICTION = {"contact.friction.bead_wall": 0.2}


def test_a_case_with_another_friction_shares_the_deck(tmp_path: Path) -> None:
    case = recorded(tmp_path, sine(400), repeats=True, ramp=RAMP)
    assert sharing_key(changed_case(case, OTHER_FRICTION)) == sharing_key(case)


def test_a_case_shares_no_deck_with_another_record_or_ramp(tmp_path: Path) -> None:
    case = recorded(tmp_path, sine(400), repeats=True, ramp=RAMP)
    lower_ramp = [RAMP[0], ["0.06 s", 0.75]]
    keys = {
        sharing_key(case),
        sharing_key(changed_case(case, {"drive.ramp": lower_ramp})),
        sharing_key(recorded(tmp_path, sine(400), repeats=True)),
        sharing_key(recorded(tmp_path, sine(500), repeats=True, ramp=RAMP)),
    }
    assert len(keys) == 4


def test_a_walker_that_shares_a_deck_moves_as_alone(tmp_path: Path) -> None:
    case = recorded(tmp_path, sine(400), repeats=True, ramp=RAMP)
    cases = [case, changed_case(case, OTHER_FRICTION)]
    make_runs(cases, tmp_path / "shared", find_engine())
    for member in cases:
        shared = run(member, tmp_path / "shared").result["velocity"]
        alone = run(member, tmp_path / "alone").result["velocity"]
        assert shared == pytest.approx(alone, rel=1e-6)


# --- frequencies, cycles and directions of records ----------------------------------------------
@pytest.fixture
def two_tones(tmp_path: Path) -> Case:
    """A record of 160 and 240 Hz along y that repeats after 50 ms."""
    time = np.linspace(0.0, 4.0 * PERIOD, 801)
    y = np.sin(2.0 * pi * 160.0 * time) + 0.8 * np.sin(2.0 * pi * 240.0 * time)
    return recorded(tmp_path, csv(time, y=y), repeats=True)


ONCE = np.arange(0.0, 0.3, 2e-4)
"""Times of a record of 0.2998 s, s."""


@pytest.fixture
def off_line(tmp_path: Path) -> Case:
    """A record of 74.4 Hz that does not repeat: a third of the way between two of its lines."""
    return recorded(tmp_path, csv(ONCE, x=np.sin(2.0 * pi * 74.4 * ONCE + 1.0)))


def test_cycles_of_a_record_that_repeats_hold_whole_periods_of_all_lines(two_tones: Case) -> None:
    """80 Hz is the largest frequency that divides 160 and 240 Hz."""
    assert two_tones.excitation.frequency == pytest.approx(80.0)
    assert two_tones.excitation.fastest == pytest.approx(240.0)


def test_a_record_along_y_shakes_along_y(two_tones: Case) -> None:
    assert two_tones.drive_axis == (0.0, 1.0, 0.0)


def test_the_frequency_of_a_record_may_lie_between_lines(off_line: Case) -> None:
    assert off_line.excitation.frequency == pytest.approx(74.4, rel=1e-3)


def test_cycles_of_a_record_are_limited_by_its_length(off_line: Case) -> None:
    fewest, most = off_line.excitation.cycle_limits
    assert fewest == 0.0
    assert most == pytest.approx(0.2998 * 74.4, rel=1e-3)


def test_a_run_has_all_whole_cycles_of_its_record(off_line: Case) -> None:
    """0.2998 s · 74.4 Hz = 22.3."""
    assert load_case({**off_line.document, "run": {}}).run.cycles == 22


def test_a_run_has_the_cycles_of_its_ramp(two_tones: Case) -> None:
    """The ramp ends after 0.06 s · 80 Hz = 4.8 cycles."""
    ramped = changed_case(two_tones, {"drive.ramp": RAMP})
    assert load_case({**ramped.document, "run": {}}).run.cycles == 5


def test_the_direction_of_a_record_is_that_of_its_largest_acceleration(tmp_path: Path) -> None:
    """Equal and opposite sines along x and y; the constant along x is an offset of the sensor."""
    x = 0.5 + np.sin(500.0 * ONCE)
    y = -np.sin(500.0 * ONCE)
    case = recorded(tmp_path, csv(ONCE, x=x, y=y))
    assert case.excitation.direction == pytest.approx((0.5**0.5, -(0.5**0.5), 0.0))


# --- thresholds by a ramp -----------------------------------------------------------------------
WINDOW = 8
"""Number of cycles over which a walker moves or rests."""


@dataclass
class ThresholdRun:
    """The walker of Fig. 1b with a ramp between 0.3 g and 0.9 g within 0.9 s, 72 cycles."""

    name: str
    """``stops_at`` or ``starts_at``."""
    factors: tuple[float, float]
    """At the start and the end of the ramp; the drive is 1 g."""
    done: Run

    @property
    def threshold(self) -> float:
        """Drive at which the walker stops or starts, m/s²."""
        return float(self.done.result[self.name])

    @property
    def resolution(self) -> float:
        """Of the threshold, m/s²."""
        return float(self.done.result[self.name.replace("_at", "_within")])


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(("stops_at", (0.9, 0.3)), id="falling"),
        pytest.param(("starts_at", (0.3, 0.9)), id="rising"),
    ],
)
def threshold_run(request: pytest.FixtureRequest, run_directory: RunCase) -> ThresholdRun:
    name, factors = request.param
    changes = {
        "drive.peak_acceleration": "1 g",
        "drive.ramp": [["0 s", factors[0]], ["0.9 s", factors[1]]],
        "dimers.replicates": 1,
        "run.samples_per_cycle": 1,
    }
    directory = run_directory(load_case("fig1b", changes))
    return ThresholdRun(name, factors, Run(directory, cached=False))


def test_a_ramp_finds_the_threshold_in_the_weakest_window_of_motion(
    threshold_run: ThresholdRun,
) -> None:
    """By hand: the drive at the weaker end of each window of eight cycles in which it moves."""
    distance = threshold_run.done.result.table("cycles")["distance"].to_numpy()[::WINDOW]
    moves = np.abs(np.diff(distance)) / (WINDOW * PERIOD) > REST
    first, last = threshold_run.factors
    time = WINDOW * PERIOD * np.arange(len(distance))
    peaks = 9.8 * (first + (last - first) * time / 0.9)
    weaker = np.minimum(peaks[1:], peaks[:-1])
    assert threshold_run.threshold == pytest.approx(weaker[moves].min(), rel=1e-6)


def test_a_ramp_finds_the_threshold_of_walkers_at_a_constant_drive(
    threshold_run: ThresholdRun,
) -> None:
    """A walker that is driven evenly creeps at 0.3 µm/s at 0.45 g, and walks at 13 at 0.55 g."""
    assert threshold_run.threshold == pytest.approx(0.5 * 9.8, abs=threshold_run.resolution)


def test_the_resolution_of_a_threshold_is_the_change_of_the_drive_in_a_window(
    threshold_run: ThresholdRun,
) -> None:
    assert threshold_run.resolution == pytest.approx(0.6 * 9.8 * WINDOW / 72)


def test_a_threshold_is_also_a_dimensionless_force(threshold_run: ThresholdRun) -> None:
    """Γ0 = a0 M / (4πγR̄) is 0.0476 at 0.5 g."""
    gamma0 = threshold_run.done.result[f"gamma0_{threshold_run.name}"]
    assert gamma0 == pytest.approx(0.0476, rel=0.04)


def test_only_the_threshold_of_the_direction_of_a_ramp_is_found(
    threshold_run: ThresholdRun,
) -> None:
    opposite = {"stops_at": "starts_at", "starts_at": "stops_at"}[threshold_run.name]
    assert np.isnan(threshold_run.done.result[opposite])


def test_a_run_with_a_ramp_is_described_by_its_threshold(threshold_run: ThresholdRun) -> None:
    words = threshold_run.name.replace("_", " ")
    first_line = threshold_run.done.describe().split("\n")[0]
    assert first_line == f"fig1b: {words} {threshold_run.threshold / 9.8:.4g} g"


def test_a_threshold_is_described_with_its_resolution(threshold_run: ThresholdRun) -> None:
    label = declared(threshold_run.name).label
    described = threshold_run.done.describe()
    assert re.search(rf"^  {label} .*  resolution \S+$", described, re.MULTILINE)


def test_a_run_with_a_ramp_is_not_steady_and_need_not_be(threshold_run: ThresholdRun) -> None:
    assert threshold_run.done.result["steady"] == 0
    assert threshold_run.done.result.warnings == []


def test_means_over_a_ramp_are_not_shown(threshold_run: ThresholdRun) -> None:
    """Over a drive that changes they say nothing."""
    shown = {row.name for row in rows(threshold_run.done.result)}
    assert not shown & {"velocity", "rotation_1", "work", "steady"}


def test_a_ramp_without_a_threshold_is_described_so(threshold_run: ThresholdRun) -> None:
    result = {**threshold_run.done.result, threshold_run.name: nan}
    assert state(result) == "no threshold within the ramp"


def test_a_ramp_finds_the_same_threshold_of_a_walker_that_goes_backward(
    threshold_run: ThresholdRun,
) -> None:
    motion = threshold_run.done.motion
    centre = motion.groups[0].mass_centre
    backward = replace(motion, position=motion.position - 2.0 * (centre - centre[0]))
    assert measure(backward).numbers[threshold_run.name] == threshold_run.threshold


@pytest.mark.parametrize("name", ["stops", "starts"])
def test_plateaus_of_a_ramp_neither_fall_nor_rise(run_directory: RunCase, name: str) -> None:
    """The drive falls from 4 g to 0.4 g and rises again, in 0.4 s each, with plateaus of 0.2 s.

    It changes by a quarter of that in a window of eight cycles, 0.1 s.
    """
    factors = [["0.2 s", 1], ["0.6 s", 0.1], ["0.8 s", 0.1], ["1.2 s", 1], ["1.4 s", 1]]
    changes = {"drive.ramp": factors, "dimers.replicates": 1, "run.samples_per_cycle": 1}
    result = read_results(run_directory(load_case("fig1b", changes)))
    resolution = result[f"{name}_within"]
    assert resolution == pytest.approx(0.9 * PEAK * 0.1 / 0.4, rel=0.02)
    assert result[f"{name}_at"] == pytest.approx(0.5 * 9.8, abs=resolution)


def thresholds_of_one_walker(moves: list[bool], peaks: FloatArray) -> dict[str, float]:
    """Thresholds by a ramp of a walker that moves or rests in each window between two peaks."""
    return _thresholds(np.array(moves)[:, None], peaks, by_ramp=True)


def test_a_ramp_of_a_few_per_cent_has_a_threshold() -> None:
    """From 4.00 to 3.88 g and back, in steps of 0.02 g; the walker moves above 3.93 g."""
    falling = np.arange(400, 386, -2) / 100.0
    peaks = np.concatenate([falling, falling[-2::-1]])
    moves = (peaks[1:] + peaks[:-1]) / 2.0 > 3.93
    expected = {"stops_at": 3.94, "stops_within": 0.02, "starts_at": 3.94, "starts_within": 0.02}
    assert thresholds_of_one_walker(moves.tolist(), peaks) == pytest.approx(expected, abs=1e-9)


def test_a_plateau_at_the_start_does_not_rise() -> None:
    """A walker moves while the drive is held at 2, stops while it falls, and starts as it rises."""
    peaks = np.array([2.0, 2.0, 2.0, 1.0, 0.5, 0.5, 1.0, 2.0, 2.0])
    moves = [True, True, True, False, False, False, True, True]
    expected = {"stops_at": 1.0, "stops_within": 1.0, "starts_at": 1.0, "starts_within": 1.0}
    assert thresholds_of_one_walker(moves, peaks) == expected


@pytest.mark.parametrize(
    ("moves", "expected"),
    [
        # Walkers in columns, windows in rows, at 4, 3 and 2 m/s².
        pytest.param([[1, 1], [1, 0], [0, 0]], (3.5, 0.5), id="mean over walkers"),
        pytest.param([[1, 1], [1, 1], [1, 0]], (3.0, 0.5), id="one that never rests"),
        pytest.param([[0], [1], [0]], (3.0, 0.5), id="one that rests before"),
        pytest.param([[0], [0]], (nan, nan), id="one that never moves"),
        pytest.param([[1], [1]], (nan, nan), id="one that always moves"),
    ],
)
def test_the_last_window_in_which_a_walker_moves(
    moves: list[list[int]], expected: tuple[float, float]
) -> None:
    """A walker that never moves, or never rests, has no threshold."""
    peaks = np.array([4.0, 3.0, 2.0])[: len(moves)]
    crossed = _crossed(np.array(moves, dtype=np.bool_), peaks, np.full(len(moves), 0.5))
    assert crossed == pytest.approx(expected, nan_ok=True)
