"""Files of recorded shaking, the offset and the drift of sensors, and amplitudes that change."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, document, to_toml
from tests.test_drive import BRIEF, RAMP, csv, recorded
from walkers import Run, load_case, run
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.records.record import Record, record_of
from walkers.inputs.records.record_file import read_record
from walkers.inputs.records.signals import slow_part
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion, boundary_motion, read_motion
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.threshold import applies, drive_changes
from walkers.postprocess.show.scene import Scene
from walkers.runs.preview import notes

RunCase = Callable[..., Path]
G = 9.8
F = 80.0
TURN = 2.0 * pi * F
"""Angular frequency, rad/s."""
PEAK = 4.0 * G
AMPLITUDE = PEAK / TURN**2
"""Of 4 g at 80 Hz, m."""
TIME = np.arange(0.0, 2.0, 1e-4)


def record(time: Any, x: Any, y: Any = 0.0, z: Any = 0.0, *, repeats: bool = False) -> Record:
    """A record of accelerations in m/s² at times in s."""
    columns = np.broadcast_arrays(time, x, y, z)
    made = record_of({"rows": np.column_stack(columns).tolist()})
    assert isinstance(made, Record)
    return made.with_values(repeats=repeats)


def sine_of(
    periods: float, rate: float = 4000.0, phase: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Times, s, and accelerations, in g, of some periods of 4 g at 80 Hz."""
    time = np.arange(round(periods / F * rate) + 1) / rate
    return time, -4.0 * np.sin(TURN * time + phase)


def notes_with(word: str, case: Case) -> list[str]:
    """Notes of a case, before it is run, in which a word occurs."""
    return [note for note in notes(case) if word in note]


# --- files --------------------------------------------------------------------------------------
TIMES_IN_MS = 0.5 * np.arange(100)
X_IN_G = np.round(4.0 * np.sin(TURN * 1e-3 * TIMES_IN_MS), 6)


def text_of(header: str, separator: str = ", ", end: str = "", comma: str = ".") -> str:
    """A file of 100 times in ms and accelerations along x in g.

    Numbers are written with a decimal comma, and each row has an end, such as further columns.
    """
    lines = [header]
    for time, x in zip(TIMES_IN_MS.tolist(), X_IN_G.tolist(), strict=True):
        lines.append(f"{time}{separator}{x}{end}".replace(".", comma))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(text_of("time (ms), x (g)"), id="plain"),
        pytest.param(text_of("Time [ms],Acc X [g],", ",", end=","), id="comma at the end"),
        pytest.param(text_of("t (ms);ax (g)", ";"), id="semicolon"),
        pytest.param(text_of("t (ms);ax (g)", ";", comma=","), id="decimal comma"),
        pytest.param(text_of("TIME (ms)\ta_x (g)", "\t", comma=","), id="tab"),
        pytest.param(text_of('"Time (ms)","Acceleration x (g)"', ","), id="quotes"),
        pytest.param(text_of("timestamp (ms), Linear Acceleration x (g)"), id="phone"),
        pytest.param(text_of("# a logger\n#\n# 2 kHz\ntime (ms), acc_x (g)"), id="comments"),
        pytest.param(
            text_of("# a logger\n# time (ms), x-acceleration (g)"), id="header in comment"
        ),
        pytest.param(text_of("\n\ntime (ms), x (g)").replace("\n", "\r\n"), id="Windows"),
        pytest.param("\ufeff" + text_of("time (ms), x (g)"), id="byte order mark"),
    ],
)
def test_a_file_is_read_as_loggers_write_it(text: str, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text, newline="")
    contents = read_record(tmp_path / "record.csv")
    expected = np.zeros((100, 4))
    expected[:, 0] = 1e-3 * TIMES_IN_MS
    expected[:, 1] = G * X_IN_G
    np.testing.assert_allclose(contents["rows"], expected, rtol=1e-12)
    assert contents["ignored_columns"] == []


def test_a_comment_below_the_numbers_is_no_header(tmp_path: Path) -> None:
    """Loggers write a line such as ``# end`` when they stop."""
    file = tmp_path / "log.csv"
    rows = "\n".join(f"{number},{number % 3}" for number in range(20))
    file.write_text(f"# a logger\n# time (ms), x (g)\n{rows}\n# end\n", encoding="utf-8")
    contents = read_record(file)
    assert len(contents["rows"]) == 20
    assert contents["rows"][2][:2] == pytest.approx([2e-3, 2.0 * 9.8])


def test_a_header_behind_a_hash_may_stand_above_decimal_commas(tmp_path: Path) -> None:
    lines = ["# time (s);z (m/s^2)"]
    for number in range(20):
        line = f"{number / 1e3:.4f};{9.81 * (number % 3):.3f}"
        lines.append(line.replace(".", ","))
    file = tmp_path / "log.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    contents = read_record(file)
    assert len(contents["rows"]) == 20
    assert contents["rows"][5] == pytest.approx([5e-3, 0.0, 0.0, 19.62])


@pytest.mark.parametrize("unit", ["m/s^2", "m/s2", "m/s²", "m/s**2", "m s-2"])
def test_an_acceleration_may_be_in_metres_per_second_squared(unit: str, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text_of(f"t [ms];Z [{unit}]", ";"))
    rows = read_record(tmp_path / "record.csv")["rows"]
    assert rows[7] == pytest.approx([3.5e-3, 0.0, 0.0, X_IN_G[7]])


@pytest.mark.parametrize(("unit", "factor"), [("mg", 9.8e-3), ("G", 9.8), ("m/s2", 1.0)])
def test_units_of_accelerometers(unit: str, factor: float, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = "\n".join(f"{number},{number % 3}" for number in range(20))
    file.write_text(f"time (ms),Acc X ({unit})\n{rows}\n", encoding="utf-8")
    assert read_record(file)["rows"][2][1] == pytest.approx(2.0 * factor)


def test_a_record_that_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "record.csv")
    with pytest.raises(ValueError, match="is a pipe, a socket or a device; expected a file"):
        read_record(tmp_path / "record.csv")


# --- columns and rows ---------------------------------------------------------------------------
THREE_CYCLES = {"cycles": 3, "settling_cycles": 1}
NOTE_OF_COLUMNS = (
    "drive.record: columns that are no acceleration along x, y or z are left out: "
    '"temperature (degC)", "state", "Gyroscope z (rad/s)"'
)


@pytest.fixture
def with_other_columns(tmp_path: Path) -> Case:
    """A record of x among columns of a temperature, a state (no numbers) and a gyroscope."""
    lines = ["Time (ms),temperature (degC),Acceleration x (g),state,Gyroscope z (rad/s)"]
    for time, x in zip(TIMES_IN_MS.tolist(), X_IN_G.tolist(), strict=True):
        lines.append(f"{time},21.5,{x},-,9.81")
    return recorded(tmp_path, "\n".join(lines), THREE_CYCLES)


def test_columns_of_other_quantities_are_left_out(with_other_columns: Case) -> None:
    record = with_other_columns.excitation.record
    assert record is not None
    assert record.rows[1][1:] == pytest.approx((G * X_IN_G[1], 0.0, 0.0))


def test_columns_that_are_left_out_are_noted(with_other_columns: Case) -> None:
    assert notes_with("left out", with_other_columns) == [NOTE_OF_COLUMNS]


def test_show_notes_columns_that_are_left_out(with_other_columns: Case, tmp_path: Path) -> None:
    shown = call("show", "case.toml", folder=tmp_path, check=True).stdout
    assert f"note {NOTE_OF_COLUMNS}" in " ".join(shown.split())
    assert "ignored" not in shown


def test_the_names_of_other_columns_rename_no_run(tmp_path: Path) -> None:
    alone = recorded(tmp_path, text_of("t (ms), x (g)"), THREE_CYCLES)
    with_state = recorded(tmp_path, text_of("t (ms), x (g), state", end=", 1"), THREE_CYCLES)
    assert with_state.determinants() == alone.determinants()


LOST = 321
"""Number of the row that is missing in a record."""


@pytest.fixture
def with_lost_row(tmp_path: Path) -> Case:
    time, x = sine_of(20)
    return recorded(tmp_path, csv(np.delete(time, LOST), x=np.delete(x, LOST)))


def test_a_lost_row_is_noted(with_lost_row: Case) -> None:
    assert notes_with("lacks", with_lost_row) == [
        "drive.record lacks 1 row: the spline goes over the gaps"
    ]


def test_a_lost_row_is_bridged(with_lost_row: Case) -> None:
    time, x = sine_of(20)
    record = with_lost_row.excitation.record
    assert record is not None
    acceleration_x = record.course(time[LOST], 2)[0]
    assert acceleration_x == pytest.approx(G * x[LOST], abs=1e-3 * PEAK)


@pytest.mark.parametrize(
    "factor",
    [
        pytest.param(1e-3, id="seconds called milliseconds"),
        pytest.param(1e3, id="milliseconds called seconds"),
    ],
)
def test_an_impossible_displacement_is_noted(factor: float) -> None:
    """The unit of the time may be wrong."""
    time, x = sine_of(20)
    assert any("unit of the time" in note for note in record(factor * time, G * x).notes)


@pytest.mark.parametrize(
    ("factor", "cause"),
    [
        (1e-3, "seconds are taken for milliseconds"),
        (1e3, "milliseconds are taken for seconds"),
    ],
)
def test_the_likely_cause_of_a_wrong_unit_of_time_is_named(factor: float, cause: str) -> None:
    time, x = sine_of(20)
    made = record(factor * time, G * x)
    (note,) = [note for note in made.notes if "unit of the time" in note]
    assert cause in note
    assert note in made.doubts  # of which the result warns


def test_a_record_of_few_rows_a_second_is_noted() -> None:
    """Of 0.4 g at 1 Hz, whose amplitude of 0.1 m a shaker might have."""
    time = np.arange(0.0, 20.0, 1.0 / 15.0)
    slow = record(time, 0.4 * G * np.sin(2.0 * pi * time))
    assert any("15 rows a second" in note for note in slow.notes)


def test_a_possible_displacement_is_not_noted() -> None:
    time, x = sine_of(20)
    assert not any("unit of the time" in note for note in record(time, G * x).notes)


def noisy_sine(sigma: float) -> Record:
    """A sine with white noise of a standard deviation, as a share of the peak.

    Without every second row, such a record changes by more than this share.
    """
    time, x = sine_of(20)
    noise = np.random.default_rng(4).normal(scale=sigma * 4.0, size=len(time))
    return record(time, G * (x + noise))


def test_noise_of_more_than_a_tenth_is_refused() -> None:
    with pytest.raises(ValueError, match=r"changes the acceleration by 1\d%"):
        noisy_sine(0.12)


def test_noise_of_less_than_a_tenth_is_accepted() -> None:
    """20 periods of 80 Hz take 0.25 s."""
    assert noisy_sine(0.06).length == pytest.approx(0.25)


def rows_of_sine(count: int) -> tuple[FloatArray, FloatArray]:
    """Times, s, and accelerations, m/s², of so many rows at 10 kHz."""
    time = np.arange(count) * 1e-4
    return time, PEAK * np.sin(TURN * time)


def test_a_record_of_100000_rows_is_accepted() -> None:
    assert len(record(*rows_of_sine(100_000)).rows) == 100_000


def test_a_record_of_more_rows_is_refused() -> None:
    with pytest.raises(ValueError, match="has 100001 rows; expected 16 to 100000"):
        record(*rows_of_sine(100_001))


# --- offset -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("periods", "phase"), [(20.0, 0.0), (20.25, 0.0), (20.5, 0.0), (20.25, pi / 2.0)]
)
def test_a_record_that_ends_within_a_period_does_not_tilt_the_substrate(
    periods: float, phase: float, tmp_path: Path
) -> None:
    """Walkers of the published drive walk at 1.459 mm/s either way, as by a sine.

    If the plain mean of 20.5 periods is taken for the offset, they walk at 1.1 and 1.9 mm/s.
    """
    time, x = sine_of(periods, phase=phase)
    (tmp_path / "record.csv").write_text(csv(time, x=x + 0.3))
    changes = {"drive.record": str(tmp_path / "record.csv"), "dimers.replicates": 2}
    result = run(load_case("fig1b", changes), tmp_path).result
    assert result["facing_right"] == 1
    assert result["facing_left"] == 1
    assert result["right_facing"] == pytest.approx(1.459e-3, rel=2e-3)
    assert result["left_facing"] == pytest.approx(1.459e-3, rel=2e-3)
    assert result.warnings == []


@dataclass
class OffsetRecord:
    """A record of some lines with an offset of 0.7 g along x, and of 1 g along z."""

    periods: float
    lines: int
    """Number of lines: 80 Hz alone, or 150 Hz too."""
    time: FloatArray
    x: FloatArray
    """Accelerations along x without the offset, m/s²."""
    record: Record

    def left_offsets(self) -> FloatArray:
        """What the record has left of its offset along x at each time, m/s²."""
        return self.record.course(self.time, 2)[:, 0] - self.x


@pytest.fixture(params=[8.4, 12.3, 20.5, 80.25])
def periods(request: pytest.FixtureRequest) -> float:
    return float(request.param)


@pytest.fixture(params=[1, 2], ids=["one line", "two lines"])
def offset_record(request: pytest.FixtureRequest, periods: float) -> OffsetRecord:
    time, x = sine_of(periods, rate=10_000.0, phase=0.4)
    if request.param == 2:
        x = x + 1.5 * np.cos(2.0 * pi * 150.0 * time)
    made = record(time, G * (x + 0.7), z=G * np.ones_like(time))
    return OffsetRecord(periods, request.param, time, G * x, made)


def test_the_same_offset_is_taken_off_all_times(offset_record: OffsetRecord) -> None:
    assert np.ptp(offset_record.left_offsets()) < 1e-4 * PEAK


def test_the_offset_is_within_its_uncertainty(offset_record: OffsetRecord) -> None:
    error = abs(offset_record.left_offsets().mean())
    assert error < 1.2 * offset_record.record.uncertain_offset


def test_the_uncertainty_of_an_offset_falls_with_the_periods(offset_record: OffsetRecord) -> None:
    """About as a₀ / (π n³) for each line of n periods, by the window of Hann."""
    limit = 1.5 * offset_record.lines * PEAK / (pi * offset_record.periods**3)
    assert offset_record.record.uncertain_offset < limit


def test_a_constant_acceleration_is_taken_off(offset_record: OffsetRecord) -> None:
    along_z = offset_record.record.course(offset_record.time, 2)[:, 2]
    assert along_z == pytest.approx(0.0, abs=1e-9)


def test_a_period_that_repeats_keeps_its_plain_mean() -> None:
    """By a window, a period that begins at its peak would have an offset of half its peak."""
    time = np.linspace(0.0, 1.0 / F, 1001)
    cosine = PEAK * np.cos(TURN * time)
    made = record(time, cosine + 3.0, repeats=True)
    assert made.course(time, 2)[:, 0] == pytest.approx(cosine, abs=1e-6 * PEAK)


def test_a_period_that_repeats_ends_at_the_velocity_of_its_start() -> None:
    time = np.linspace(0.0, 1.0 / F, 1001)
    made = record(time, PEAK * np.cos(TURN * time) + 3.0, repeats=True)
    assert made.course(0.0, 1) == pytest.approx(made.course(made.length, 1), abs=1e-12)


def test_a_record_begins_and_ends_at_no_displacement() -> None:
    time, x = sine_of(20.5)
    displacement = record(time, G * x).course(time[[0, -1]])[:, 0]
    assert displacement == pytest.approx(0.0, abs=1e-9)


def test_velocities_at_the_ends_of_a_record_differ_as_those_of_the_sine_do() -> None:
    """After 20.5 periods, by twice the peak velocity, a₀ / ω."""
    time, x = sine_of(20.5)
    velocity = record(time, G * x).course(time[[0, -1]], 1)[:, 0]
    assert float(np.ptp(velocity)) == pytest.approx(2.0 * PEAK / TURN, rel=1e-2)


def drifting_case(folder: Path, periods: float, slope: float) -> Case:
    """A case whose record has an offset that changes by a slope in g per second."""
    time, x = sine_of(periods)
    few = {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 4}
    return recorded(folder, csv(time, x=x + slope * time), few)


TILTING = [
    pytest.param(
        5.25,
        0.0,
        "only 5 periods of its slowest line: its offset is uncertain by 0.01 g, like a tilt of 0.5",
        id="few periods",
    ),
    pytest.param(
        80.25,
        0.02,
        "offset of drive.record changes from its first to its second half: "
        "the rest acts as 0.005 g",
        id="growing offset",
    ),
    pytest.param(
        80.25,
        -0.02,
        "like a tilt of 0.29°, first one way, then the other",
        id="falling offset",
    ),
]
"""Periods of a record, the slope of its offset, and a part of the note."""


@pytest.mark.parametrize(("periods", "slope", "message"), TILTING)
def test_an_offset_that_acts_as_a_tilt_is_noted_before_the_run(
    periods: float, slope: float, message: str, tmp_path: Path
) -> None:
    """1 s of 0.02 g/s leaves ±0.005 g on average in the halves, as a tilt of 0.005 rad = 0.29°."""
    (note,) = notes_with("tilt", drifting_case(tmp_path, periods, slope))
    assert message in note


@pytest.mark.parametrize(("periods", "slope", "message"), TILTING)
def test_a_result_warns_of_an_offset_that_acts_as_a_tilt(
    periods: float, slope: float, message: str, tmp_path: Path
) -> None:
    case = drifting_case(tmp_path, periods, slope)
    result = run(case, tmp_path).result
    assert notes_with("tilt", case)[0] in result.warnings


@pytest.mark.parametrize(("periods", "slope"), [(20.25, 0.0), (80.25, 0.005)])
def test_a_small_offset_is_not_noted(periods: float, slope: float, tmp_path: Path) -> None:
    assert notes_with("tilt", drifting_case(tmp_path, periods, slope)) == []


# --- length of a run ----------------------------------------------------------------------------
def case_of_79_8_hz(folder: Path, seconds: float, run: Any = None, **drive: Any) -> Case:
    """A case whose record has 4 g at 79.8 Hz for some seconds."""
    time = np.arange(0.0, seconds, 2e-4)
    text = csv(time, x=4.0 * np.sin(2.0 * pi * 79.8 * time))
    return recorded(folder, text, run, **drive)


@pytest.mark.parametrize(
    ("length", "cycles"),
    [
        pytest.param({}, 159, id="by default"),
        pytest.param({"duration": "2 s"}, 159, id="the whole record"),
        pytest.param({"duration": "1.995 s"}, 159, id="a third of a cycle less"),
        pytest.param({"duration": "0.5 s"}, 40, id="a part"),
        pytest.param({"cycles": 30}, 30, id="cycles"),
    ],
)
def test_a_whole_record_is_run_by_default(
    length: dict[str, Any], cycles: int, tmp_path: Path
) -> None:
    """Or up to a duration; 2 s are 159.6 cycles of this record."""
    case = case_of_79_8_hz(tmp_path, 2.0001)
    made = load_case({**case.document, "run": {"samples_per_cycle": 1, **length}})
    assert made.run.cycles == cycles
    assert not made.run.until_steady


def test_a_duration_beyond_the_record_is_refused(tmp_path: Path) -> None:
    """0.5 s are 39.9 cycles."""
    case = case_of_79_8_hz(tmp_path, 0.5)
    with pytest.raises(InputError, match=r'run.duration = "0.6 s": expected at most 39 cycles'):
        load_case({**case.document, "run": {"duration": "0.6 s"}})


def test_a_ramp_may_end_with_its_record(tmp_path: Path) -> None:
    ramped = case_of_79_8_hz(tmp_path, 0.5001, {"cycles": 39}, ramp=[["0 s", 1], ["0.5 s", 0.2]])
    assert load_case({**ramped.document, "run": {}}).run.cycles == 39


def test_a_result_says_which_part_of_its_record_was_run(tmp_path: Path) -> None:
    """The run has 6 of 20.5 cycles."""
    time, x = sine_of(20.5)
    done = run(recorded(tmp_path, csv(time, x=x)), tmp_path)
    assert done.result["record_run"] == pytest.approx(6 / F, rel=1e-5)
    assert done.result["record_share"] == pytest.approx(6 / 20.5, rel=1e-5)
    assert done.result["record_length"] == pytest.approx(20.5 / F)
    assert "part of the record that was run" in done.describe()


def test_a_record_that_repeats_is_run_in_no_part(tmp_path: Path) -> None:
    time, x = sine_of(1.0)
    done = run(recorded(tmp_path, csv(time, x=x), repeats=True), tmp_path)
    assert "record_run" not in done.result


# --- slow displacement --------------------------------------------------------------------------
def test_a_drifting_sensor_does_not_change_the_amplitude() -> None:
    """An error of 20 mg in a second displaces the boundary by millimetres."""
    noise = np.random.default_rng(5).normal(scale=0.02 * G, size=len(TIME))
    error = 0.02 * G * np.sin(2.0 * pi * 0.7 * TIME)
    made = record(TIME, -PEAK * np.sin(TURN * TIME + 1.0) + error + noise)
    assert made.farthest > 5e-3
    assert made.largest(0) == pytest.approx(AMPLITUDE, rel=0.01)
    assert made.largest(1) == pytest.approx(TURN * AMPLITUDE, rel=0.01)


def test_slow_lines_stay_in_the_amplitude() -> None:
    """Of 20 and 80 Hz, whose displacements add up where both have their peaks."""
    x = 20.0 * np.cos(TURN * TIME) + 5.0 * np.cos(2.0 * pi * 20.0 * TIME)
    expected = 20.0 / TURN**2 + 5.0 / (2.0 * pi * 20.0) ** 2
    assert record(TIME, x).largest(0) == pytest.approx(expected, rel=0.01)


def test_the_slow_part_of_a_parabola_is_the_parabola() -> None:
    time = np.linspace(-1.0, 1.0, 2001)
    parabola = (3.0 + 2.0 * time + time**2)[:, None]
    fast = 0.01 * np.sin(2.0 * pi * 50.0 * time)[:, None]
    middle = slice(200, -200)
    assert slow_part(parabola + fast, 160)[middle] == pytest.approx(parabola[middle], abs=1e-5)


@pytest.mark.parametrize("width", [20, 21], ids=["even", "odd"])
def test_windows_are_around_their_samples(width: int) -> None:
    """A straight line and the middle of a parabola are their own slow parts."""
    time = np.arange(200.0)
    line = 3.0 * time - 7.0
    parabola = (time - 100.0) ** 2
    slow = slow_part(np.stack([line, parabola], axis=1), width)
    np.testing.assert_allclose(slow[:, 0], line, atol=1e-9)
    np.testing.assert_allclose(slow[60:140, 1], parabola[60:140], atol=1e-8)


@pytest.mark.parametrize(
    ("periods", "share"), [(0.25, 0.0), (1.0, 0.25), (2.0, 1.0), (2.5, 1.0), (4.0, 1.0)]
)
def test_the_slow_part_has_a_stated_limit(periods: float, share: float) -> None:
    """What is left of a motion of some periods in a window of 400 samples."""
    motion = np.sin(2.0 * pi * periods / 400.0 * np.arange(8000))[:, None]
    left = motion - slow_part(motion, 400)
    assert np.abs(left[800:-800]).max() == pytest.approx(share, abs=0.06)


@pytest.fixture(params=["container", "lab"])
def drifting_motion(
    request: pytest.FixtureRequest, run_directory: RunCase, tmp_path: Path
) -> Motion:
    """A run by 4 g at 80 Hz, recorded by a sensor that drifts by 0.1 g at 3 Hz."""
    time = np.arange(0.0, 0.5, 2e-4)
    x = -4.0 * np.sin(TURN * time) + 0.1 * np.sin(2.0 * pi * 3.0 * time)
    settings = {"samples_per_cycle": 20, "settling_cycles": 2}
    case = recorded(tmp_path, csv(time, x=x), settings, frame=request.param)
    return read_motion(run_directory(case))


def test_the_record_of_a_drifting_sensor_drifts(drifting_motion: Motion) -> None:
    """0.1 g at 3 Hz is an amplitude of 2.8 mm."""
    drift = boundary_motion(drifting_motion.case.excitation, drifting_motion.time)[0]
    assert np.ptp(drift[:, 0]) > 2e-3


def test_pictures_do_not_show_the_drift_of_a_sensor(drifting_motion: Motion) -> None:
    """The boundary shakes in place, away from the ends of the run."""
    displacement = np.abs(drifting_motion.substrate[40:-40, 0]).max()
    assert displacement == pytest.approx(AMPLITUDE, rel=0.05)


def test_pictures_show_no_more_than_the_path_of_a_walker(drifting_motion: Motion) -> None:
    """In mm, of which the walker has 1 and its path 2."""
    scene = Scene.around(drifting_motion, np.eye(3))
    assert scene.high[0] - scene.low[0] < 4.0


def test_the_amplitude_of_a_result_is_without_the_drift(drifting_motion: Motion) -> None:
    result = read_results(drifting_motion.directory)
    assert result["amplitude"] == pytest.approx(AMPLITUDE, rel=0.02)


# --- largest values and direction ---------------------------------------------------------------
def test_the_largest_values_of_a_record_are_lengths_of_vectors() -> None:
    """Equal sines along x and y are a sine along the diagonal, of √2 of the peak."""
    time, x = sine_of(20, rate=6400.0)
    made = record(time, G * x, G * x)
    assert made.largest(2) == pytest.approx(2.0**0.5 * PEAK, rel=1e-5)
    assert made.largest(0) == pytest.approx(2.0**0.5 * AMPLITUDE, rel=5e-3)
    assert made.direction == pytest.approx((0.5**0.5, 0.5**0.5, 0.0))


def test_the_largest_acceleration_is_that_of_the_spline() -> None:
    """Six rows a period at 0°, 60°, … miss the peak of a sine by 13 %: sin 60° is 0.866."""
    time = np.arange(0.0, 61.0) / 6.0 / F
    sine = PEAK * np.sin(TURN * time)
    assert np.abs(sine).max() == pytest.approx(0.866 * PEAK, rel=1e-3)
    rows = np.column_stack([time, sine, 0.0 * time, 0.0 * time]).tolist()
    made = Record(rows=tuple(map(tuple, rows)))
    assert made.largest(2) == pytest.approx(PEAK, rel=0.01)


def test_the_direction_is_that_of_the_acceleration() -> None:
    """Not of the displacement, which is larger along y."""
    x = 3.0 * np.sin(2.0 * pi * 160.0 * TIME)
    y = 2.0 * np.sin(2.0 * pi * 40.0 * TIME)
    assert record(TIME, x, y).direction == pytest.approx((1.0, 0.0, 0.0), abs=1e-3)


# --- amplitudes that change ---------------------------------------------------------------------
@dataclass
class ChangingRecord:
    """A record of 2 s whose strongest line has an envelope."""

    envelope: FloatArray
    """In g, at `TIME`."""
    width: float
    """Half the width of the window over which the amplitude is a mean, s."""
    record: Record


@pytest.fixture(
    params=[
        pytest.param((2.0, 0.2), id="falls"),
        pytest.param((0.2, 2.0), id="rises"),
        pytest.param((2.0, 2.0, 1.0, 1.0, 0.3, 0.3), id="plateaus"),
        pytest.param((1.5, 0.3, 0.3, 1.5), id="falls and rises"),
    ]
)
def envelope(request: pytest.FixtureRequest) -> FloatArray:
    """Amplitudes in g at `TIME`, between points that are evenly spaced in time."""
    return np.interp(TIME, np.linspace(0.0, 2.0, len(request.param)), request.param)


@pytest.fixture(params=[0.0, 0.5], ids=["one line", "three lines"])
def changing_record(request: pytest.FixtureRequest, envelope: FloatArray) -> ChangingRecord:
    """With noise, an offset and, in half of the cases, other lines.

    The window has eight periods, but at least two beats with the line of 95 Hz.
    """
    x = envelope * np.sin(TURN * TIME + 0.5)
    octave = 0.5 * np.sin(2.0 * pi * 160.0 * TIME)
    beating = 0.3 * np.sin(2.0 * pi * 95.0 * TIME)
    x += request.param * (octave + beating)
    x += 0.03 + np.random.default_rng(6).normal(scale=0.02, size=len(TIME))
    width = 0.5 * 8.0 / F
    if request.param:
        width = 0.5 * max(8.0 / F, 2.0 / 15.0)
    return ChangingRecord(envelope, width, record(TIME, G * x))


def test_the_local_amplitude_is_the_envelope_of_the_strongest_line(
    changing_record: ChangingRecord,
) -> None:
    """By definition, the mean of the envelope with the weights of a window of Hann."""
    window = np.hanning(round(2.0 * changing_record.width / 1e-4) + 2)[1:-1]
    expected = np.convolve(changing_record.envelope, window / window.sum(), mode="same")
    inside = np.abs(TIME - 1.0) < 1.0 - changing_record.width
    amplitude = changing_record.record.local_amplitude(TIME) / G
    tolerance = 0.02 * changing_record.envelope.max()
    assert amplitude[inside] == pytest.approx(expected[inside], abs=tolerance)


def test_a_record_that_changes_is_not_stationary(changing_record: ChangingRecord) -> None:
    assert changing_record.record.is_stationary is False


def test_the_local_amplitude_of_a_circle_is_its_radius() -> None:
    made = record(TIME, 3.0 * np.cos(TURN * TIME), 3.0 * np.sin(TURN * TIME))
    assert made.amplitude_range == pytest.approx((3.0, 3.0), rel=1e-3)


@pytest.mark.parametrize("second", [90.0, 95.0, 160.0])
def test_beats_are_no_change_of_the_amplitude(second: float) -> None:
    x = 12.0 * np.sin(TURN * TIME) + 8.0 * np.sin(2.0 * pi * second * TIME)
    made = record(TIME, x)
    assert made.is_stationary
    assert made.amplitude_range == pytest.approx((12.0, 12.0), rel=0.01)


def test_a_record_that_repeats_has_one_amplitude() -> None:
    """That of its strongest line."""
    time = np.linspace(0.0, 4.0 / F, 801)
    x = 5.0 * np.sin(2.0 * TURN * time) + 3.0 * np.sin(3.0 * TURN * time)
    made = record(time, x, repeats=True)
    assert made.amplitude_range == pytest.approx((5.0, 5.0), rel=1e-5)
    assert made.is_stationary


def one_walker_by_record(folder: Path, x: FloatArray) -> Case:
    """A walker of Fig. 1b, driven by accelerations along x in g at 10 kHz."""
    time = 1e-4 * np.arange(len(x))
    (folder / "record.csv").write_text(csv(time, x=x))
    changes = {
        "drive.record": str(folder / "record.csv"),
        "dimers.replicates": 1,
        "run.samples_per_cycle": 1,
    }
    return load_case("fig1b", changes)


@dataclass
class ThresholdRun:
    """A walker driven by a record that falls or rises between 0.3 g and 0.7 g in 0.7 s."""

    name: str
    """``stops_at`` or ``starts_at``."""
    done: Run

    @property
    def resolution(self) -> float:
        """Of the threshold, m/s²."""
        return float(self.done.result[self.name.replace("_at", "_within")])


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(("stops_at", (0.7, 0.3)), id="falling"),
        pytest.param(("starts_at", (0.3, 0.7)), id="rising"),
    ],
)
def threshold_run(
    request: pytest.FixtureRequest,
    run_directory: RunCase,
    tmp_path_factory: pytest.TempPathFactory,
) -> ThresholdRun:
    """With noise and an offset."""
    name, ends = request.param
    time = np.arange(0.0, 0.7, 1e-4)
    noise = np.random.default_rng(7).normal(scale=0.01, size=len(time))
    x = -np.interp(time, [0.0, 0.7], ends) * np.sin(TURN * time) + noise + 0.05
    case = one_walker_by_record(tmp_path_factory.mktemp("ramp"), x)
    return ThresholdRun(name, Run(run_directory(case)))


def test_a_record_that_falls_or_rises_is_a_ramp(threshold_run: ThresholdRun) -> None:
    """Its threshold is that of a sine with a ramp, 0.5 g, within the resolution."""
    threshold = threshold_run.done.result[threshold_run.name]
    assert threshold == pytest.approx(0.5 * G, abs=threshold_run.resolution)


def test_the_resolution_by_a_record_is_its_change_in_a_window(
    threshold_run: ThresholdRun,
) -> None:
    """A window of eight cycles is 0.1 s."""
    assert threshold_run.resolution == pytest.approx(0.4 * G * 0.1 / 0.7, rel=0.1)


def test_a_threshold_by_a_record_is_described(threshold_run: ThresholdRun) -> None:
    words = threshold_run.name.replace("_", " ")
    assert threshold_run.done.describe().startswith(f"fig1b: {words} 0.")


def test_a_threshold_by_a_record_needs_no_warning(threshold_run: ThresholdRun) -> None:
    assert threshold_run.done.result.warnings == []


@pytest.fixture(scope="module")
def weakening(run_directory: RunCase, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A walker driven by a record that falls from 4 g to 3.4 g, far above the threshold."""
    time = np.arange(0.0, 0.7, 1e-4)
    x = -np.interp(time, [0.0, 0.7], [4.0, 3.4]) * np.sin(TURN * time)
    return Run(run_directory(one_walker_by_record(tmp_path_factory.mktemp("weakening"), x)))


def test_a_record_that_stays_above_the_threshold_finds_none(weakening: Run) -> None:
    """But the table of the ramp has a row for each of the six windows of eight cycles."""
    assert "stops_at" not in weakening.result
    assert len(weakening.result.table("ramp")) == 6


def test_a_velocity_over_a_record_that_changes_has_a_warning(weakening: Run) -> None:
    assert weakening.result.warnings == [
        "the amplitude of the strongest line of the record lies between 3.49 and 3.96 g: "
        "the velocity is a mean over different drives"
    ]


def test_a_threshold_needs_walkers(pile_run: Path) -> None:
    """A ramp of a pile has none."""
    case = read_motion(pile_run).case
    ramped = case.drive.with_values(ramp=((0.0, 1.0), (0.1, 0.5)))
    assert not applies(case.with_values(drive=ramped))


@pytest.mark.parametrize(
    ("peaks", "expected"),
    [
        pytest.param(
            [3.0, 2.9, 2.95, 2.0, 1.5, 1.52, 1.5, 2.5, 3.0],
            [-1, -1, -1, -1, 1, 1, 1, 1],
            id="falls and rises",
        ),
        pytest.param(
            [1.0, 1.02, 0.98, 0.5, 0.2, 0.21, 0.19, 1.0, 1.02],
            [0, -1, -1, -1, -1, -1, 1, 1],
            id="noise at the start",
        ),
        pytest.param([2.0, 2.0, 1.0, 1.0, 2.0, 2.0], [0, -1, 0, 1, 0], id="plateaus"),
        pytest.param([1.0, 1.05, 0.95, 1.0], [0, 0, 0], id="noise alone"),
    ],
)
def test_noise_of_an_amplitude_has_no_direction(peaks: list[float], expected: list[int]) -> None:
    """Of changes between windows: -1 where the drive falls, 1 where it rises; the noise is 0.2."""
    assert drive_changes(np.array(peaks), 0.2).tolist() == expected


# --- refused ------------------------------------------------------------------------------------
def test_a_ramp_beside_a_record_that_changes_is_refused(tmp_path: Path) -> None:
    envelope = np.interp(TIME, [0.0, 2.0], [2.0, 0.2])
    text = csv(TIME, x=envelope * np.sin(TURN * TIME))
    message = (
        "drive.ramp.*: expected none: the amplitude of drive.record changes by itself, "
        "from 0.245 to 1.96 g"
    )
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, text, ramp=RAMP)


STRONG_RAMP = [["0 s", 1], ["0.05 s", 1000]]
TOO_STRONG = r"expected factors that give accelerations up to 10000 m/s²; .* 39[12]\d\d"
"""1000 times 39.2 m/s²."""


def test_the_limit_of_accelerations_includes_the_ramp_of_a_record(tmp_path: Path) -> None:
    time, x = sine_of(20)
    with pytest.raises(InputError, match=TOO_STRONG):
        recorded(tmp_path, csv(time, x=x), BRIEF, ramp=STRONG_RAMP)


def test_the_limit_of_accelerations_includes_the_ramp_of_a_sine() -> None:
    with pytest.raises(InputError, match=TOO_STRONG):
        load_case(document(drive={"ramp": STRONG_RAMP}))


@pytest.mark.parametrize("periods", [1.3, 2.4])
def test_a_record_of_few_periods_is_refused(periods: float, tmp_path: Path) -> None:
    time, x = sine_of(periods)
    message = "expected at least 3 periods of its strongest line, found"
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, csv(time, x=x), {"cycles": 2, "settling_cycles": 0})


def test_a_case_written_to_a_file_is_refused_in_one_line(tmp_path: Path) -> None:
    """A record of which no frequency is that of a shaker."""
    time, x = sine_of(20)
    tables = document()
    tables["drive"] = {"record": "record.csv"}
    (tmp_path / "record.csv").write_text(csv(1e-6 * time, x=x))
    (tmp_path / "case.toml").write_text(to_toml(tables))
    done = call("show", "case.toml", folder=tmp_path)
    message = (
        "expected frequencies up to 1e+06 Hz; found 8.4e+07 Hz: is the unit of the time right?"
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert message in done.stderr
