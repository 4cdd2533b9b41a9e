"""Files of recorded shaking, the offset and the slow drift of sensors, and amplitudes that change."""

import os
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, document, to_toml
from tests.test_drive import BRIEF, RAMP, csv, recorded
from walkers import load_case, run
from walkers.errors import InputError
from walkers.inputs.records.record import Record, record_of
from walkers.inputs.records.record_file import read_record
from walkers.inputs.records.signals import slow_part
from walkers.postprocess.measure.motion import boundary_motion, read_motion
from walkers.postprocess.measure.threshold import applies, drive_changes
from walkers.postprocess.show.scene import Scene
from walkers.runs.preview import notes

G = 9.8
F = 80.0
PEAK = 4.0 * G
AMPLITUDE = PEAK / (2.0 * pi * F) ** 2
"""Of 4 g at 80 Hz, m."""
TIME = np.arange(0.0, 2.0, 1e-4)


def record(time: Any, x: Any, y: Any = 0.0, z: Any = 0.0, *, repeats: bool = False) -> Record:
    """A record of accelerations in m/s² at times in s."""
    columns = np.broadcast_arrays(time, x, y, z)
    made = record_of({"rows": np.column_stack(columns).tolist()})
    assert isinstance(made, Record)
    return made.with_values(repeats=repeats)


def sine_of(periods: float, rate: float = 4000.0, phase: float = 0.0) -> tuple[Any, Any]:
    """Times, s, and accelerations, in g, of some periods of the drive."""
    time = np.arange(round(periods / F * rate) + 1) / rate
    return time, -4.0 * np.sin(2.0 * pi * F * time + phase)


# --- files ------------------------------------------------------------------------------------------------------------
ROWS = [(0.5 * number, round(4.0 * np.sin(160e-3 * pi * 0.5 * number), 6)) for number in range(100)]
"""Time, ms, and acceleration along x, g."""


def text_of(header: str, separator: str = ", ", end: str = "", comma: str = ".") -> str:
    lines = [f"{time}{separator}{x}{end}".replace(".", comma) for time, x in ROWS]
    return "\n".join([header, *lines]) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        text_of("time (ms), x (g)"),
        text_of("Time [ms],Acc X [g],", ",", end=","),
        text_of("t (ms);ax (g)", ";"),
        text_of("t (ms);ax (g)", ";", comma=","),
        text_of("TIME (ms)\ta_x (g)", "\t", comma=","),
        text_of('"Time (ms)","Acceleration x (g)"', ","),
        text_of("timestamp (ms), Linear Acceleration x (g)"),
        text_of("# a logger\n#\n# 2 kHz\ntime (ms), acc_x (g)"),
        text_of("# a logger\n# time (ms), x-acceleration (g)"),
        text_of("\n\ntime (ms), x (g)").replace("\n", "\r\n"),
        "\ufeff" + text_of("time (ms), x (g)"),
    ],
)
def test_a_file_is_read_as_loggers_write_it(text: str, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text, newline="")
    contents = read_record(tmp_path / "record.csv")
    assert contents["ignored_columns"] == []
    expected = [[1e-3 * time, G * x, 0.0, 0.0] for time, x in ROWS]
    np.testing.assert_allclose(contents["rows"], expected, rtol=1e-12)


@pytest.mark.parametrize("unit", ["m/s^2", "m/s2", "m/s²", "m/s**2", "m s-2"])
def test_an_acceleration_may_be_in_metres_per_second_squared(unit: str, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text_of(f"t [ms];Z [{unit}]", ";"))
    rows = read_record(tmp_path / "record.csv")["rows"]
    assert rows[7] == pytest.approx([3.5e-3, 0.0, 0.0, ROWS[7][1]])


def test_columns_of_other_quantities_are_left_out_with_a_note(tmp_path: Path) -> None:
    lines = [f"{time},21.5,{x},-,9.81" for time, x in ROWS]
    header = "Time (ms),temperature (degC),Acceleration x (g),state,Gyroscope z (rad/s)"
    case = recorded(tmp_path, "\n".join([header, *lines]), {"cycles": 3, "settling_cycles": 1})
    assert case.excitation.record is not None
    assert case.excitation.record.rows[1][1:] == pytest.approx((G * ROWS[1][1], 0.0, 0.0))
    said = [note for note in notes(case) if "left out" in note]
    names = ': "temperature (degC)", "state", "Gyroscope z (rad/s)"'
    assert said == [
        f"drive.record: columns that are no acceleration along x, y or z are left out{names}"
    ]
    shown = call("show", "case.toml", folder=tmp_path, check=True).stdout
    assert f"note       {said[0]}" in shown
    assert "ignored" not in shown


def test_the_names_of_other_columns_rename_no_run(tmp_path: Path) -> None:
    run_of = {"cycles": 3, "settling_cycles": 1}
    alone = recorded(tmp_path, text_of("t (ms), x (g)"), run_of)
    beside = recorded(tmp_path, text_of("t (ms), x (g), state", end=", 1"), run_of)
    assert beside.determinants() == alone.determinants()


def test_a_lost_row_is_bridged_with_a_note(tmp_path: Path) -> None:
    time, x = sine_of(20)
    kept = np.arange(len(time)) != 321
    case = recorded(tmp_path, csv(time[kept], x=x[kept]))
    assert [note for note in notes(case) if "lacks" in note] == [
        "drive.record lacks 1 row: the spline goes over the gaps"
    ]
    assert case.excitation.record is not None
    found = case.excitation.record.course(time[321], 2)[0]
    assert found == pytest.approx(G * x[321], abs=1e-3 * PEAK)


@pytest.mark.parametrize(("factor", "told"), [(1e-3, True), (1.0, False), (1e3, True)])
def test_an_impossible_displacement_is_told(factor: float, told: bool) -> None:
    """As of times in seconds that are called milliseconds, or the other way round."""
    time, x = sine_of(20)
    assert any("unit of the time" in note for note in record(factor * time, G * x).notes) == told


@pytest.mark.parametrize(("sigma", "refused"), [(0.06, False), (0.12, True)])
def test_noise_of_a_tenth_is_refused(sigma: float, refused: bool) -> None:
    """Without every second row, a sine with white noise of σ, over its peak, changes by more than σ."""
    time, x = sine_of(20)
    noise = np.random.default_rng(4).normal(scale=sigma * 4.0, size=len(time))
    if refused:
        with pytest.raises(ValueError, match=r"changes the acceleration by 1\d%"):
            record(time, G * (x + noise))
    else:
        assert record(time, G * (x + noise)).length == pytest.approx(0.25)


def test_the_largest_number_of_rows() -> None:
    time = np.arange(100_001) * 1e-4
    x = PEAK * np.sin(2.0 * pi * F * time)
    assert len(record(time[:-1], x[:-1]).rows) == 100_000
    with pytest.raises(ValueError, match="has 100001 rows; expected 16 to 100000"):
        record(time, x)


# --- offset -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("periods", "phase"), [(20.0, 0.0), (20.25, 0.0), (20.5, 0.0), (20.25, pi / 2.0)]
)
def test_a_record_that_ends_within_a_period_tilts_no_plate(
    periods: float, phase: float, tmp_path: Path
) -> None:
    """Walkers of the published drive walk at 1.981 mm/s either way.

    If the plain mean of 20.5 periods is taken for the offset, they walk at 1.1 and 2.8 mm/s.
    """
    time, x = sine_of(periods, phase=phase)
    (tmp_path / "record.csv").write_text(csv(time, x=x + 0.3))
    changes = {"drive.record": str(tmp_path / "record.csv"), "dimers.replicates": 2}
    result = run(load_case("fig1b", changes), tmp_path).result
    assert result["facing_right"] == result["facing_left"] == 1
    for facing in ("right_facing", "left_facing"):
        assert result[facing] == pytest.approx(1.981e-3, rel=2e-3)
    assert result.warnings == []


@pytest.mark.parametrize("periods", [8.4, 12.3, 20.5, 80.25])
@pytest.mark.parametrize("lines", [1, 2])
def test_the_offset_is_within_its_uncertainty(periods: float, lines: int) -> None:
    time, x = sine_of(periods, rate=10_000.0, phase=0.4)
    if lines == 2:
        x = x + 1.5 * np.cos(2.0 * pi * 150.0 * time)
    made = record(time, G * (x + 0.7), z=G * (1.0 + 0.0 * time))
    offsets = made.course(time, 2)[:, 0] - G * x
    assert np.ptp(offsets) < 1e-4 * PEAK
    assert abs(offsets.mean()) < 1.2 * made.uncertain_offset
    assert made.uncertain_offset < 1.5 * lines * PEAK / (pi * periods**3)
    assert made.course(time, 2)[:, 2] == pytest.approx(0.0, abs=1e-9)


def test_a_period_that_repeats_keeps_its_plain_mean() -> None:
    """With the weights of a window, a period that begins at its peak would have an offset of half its peak."""
    time = np.linspace(0.0, 1.0 / F, 1001)
    made = record(time, PEAK * np.cos(2.0 * pi * F * time) + 3.0, repeats=True)
    assert made.course(time, 2)[:, 0] == pytest.approx(
        PEAK * np.cos(2.0 * pi * F * time), abs=1e-6 * PEAK
    )
    assert made.course(0.0, 1) == pytest.approx(made.course(made.length, 1), abs=1e-12)


def test_a_record_begins_and_ends_at_no_displacement() -> None:
    """Its velocities at both ends differ as those of the sine do."""
    time, x = sine_of(20.5)
    made = record(time, G * x)
    assert made.course(time[[0, -1]])[:, 0] == pytest.approx(0.0, abs=1e-9)
    change = float(np.ptp(made.course(time[[0, -1]], 1)[:, 0]))
    assert change == pytest.approx(2.0 * PEAK / (2.0 * pi * F), rel=1e-2)


@pytest.mark.parametrize(
    ("periods", "slope", "told"),
    [
        (
            5.25,
            0.0,
            "only 5 periods of its slowest line: its offset is uncertain by 0.01 g, like a tilt of 0.5",
        ),
        (20.25, 0.0, None),
        (
            80.25,
            0.02,
            "offset of drive.record changes from its first to its second half: the rest acts as 0.005 g",
        ),
        (80.25, -0.02, "like a tilt of 0.29°, first one way, then the other"),
        (80.25, 0.005, None),
    ],
)
def test_an_offset_that_acts_as_a_tilt_is_told(
    periods: float, slope: float, told: str | None, tmp_path: Path
) -> None:
    """In notes before the run, and as a warning of its result; slopes in g per second."""
    time, x = sine_of(periods)
    few = {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 4}
    case = recorded(tmp_path, csv(time, x=x + slope * time), few)
    said = [note for note in notes(case) if "tilt" in note]
    assert len(said) == (told is not None)
    if told:
        assert told in said[0]
        result = run(case, tmp_path).result
        assert said[0] in result.warnings


# --- length of a run --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("length", "cycles"), [({}, 159), ({"duration": "2 s"}, 159), ({"duration": "1.995 s"}, 159),
                                                ({"duration": "0.5 s"}, 40), ({"cycles": 30}, 30)])  # fmt: skip
def test_a_whole_record_is_run_by_default(
    length: dict[str, Any], cycles: int, tmp_path: Path
) -> None:
    """Or up to a duration; 2 s are 159.6 cycles of this record."""
    time = np.arange(0.0, 2.0001, 2e-4)
    case = recorded(tmp_path, csv(time, x=4.0 * np.sin(2.0 * pi * 79.8 * time)))
    tables = {**case.document, "run": {"samples_per_cycle": 1, **length}}
    made = load_case(tables)
    assert (made.run.cycles, made.run.until_steady) == (cycles, False)


def test_a_duration_beyond_the_record_is_refused(tmp_path: Path) -> None:
    time = np.arange(0.0, 0.5, 2e-4)
    case = recorded(tmp_path, csv(time, x=4.0 * np.sin(2.0 * pi * 79.8 * time)))
    with pytest.raises(InputError, match=r'run.duration = "0.6 s": expected at most 39 cycles'):
        load_case({**case.document, "run": {"duration": "0.6 s"}})


def test_a_ramp_may_end_with_its_record(tmp_path: Path) -> None:
    time = np.arange(0.0, 0.5001, 2e-4)
    text = csv(time, x=4.0 * np.sin(2.0 * pi * 79.8 * time))
    ramped = recorded(tmp_path, text, {"cycles": 39}, ramp=[["0 s", 1], ["0.5 s", 0.2]])
    assert load_case({**ramped.document, "run": {}}).run.cycles == 39


def test_a_result_says_which_part_of_its_record_was_run(tmp_path: Path) -> None:
    time, x = sine_of(20.5)
    done = run(recorded(tmp_path, csv(time, x=x)), tmp_path)
    assert done.result["record_run"] == pytest.approx(6 / F, rel=1e-5)
    assert done.result["record_share"] == pytest.approx(6 / 20.5, rel=1e-5)
    assert done.result["record_length"] == pytest.approx(20.5 / F)
    assert "part of the record that was run" in done.describe()
    time, x = sine_of(1.0)
    again = run(recorded(tmp_path, csv(time, x=x), repeats=True), tmp_path)
    assert "record_run" not in again.result


# --- slow displacement ------------------------------------------------------------------------------------------------
def test_a_drifting_sensor_does_not_change_the_amplitude() -> None:
    """An error of 20 mg in a second displaces the boundary by millimetres."""
    noise = np.random.default_rng(5).normal(scale=0.02 * G, size=len(TIME))
    error = 0.02 * G * np.sin(2.0 * pi * 0.7 * TIME)
    made = record(TIME, -PEAK * np.sin(2.0 * pi * F * TIME + 1.0) + error + noise)
    assert made.farthest > 5e-3
    assert made.largest(0) == pytest.approx(AMPLITUDE, rel=0.01)
    assert made.largest(1) == pytest.approx(2.0 * pi * F * AMPLITUDE, rel=0.01)


def test_slow_lines_stay_in_the_amplitude() -> None:
    """Of 20 and 80 Hz, whose displacements add up where both have their peaks."""
    x = 20.0 * np.cos(2.0 * pi * F * TIME) + 5.0 * np.cos(2.0 * pi * 20.0 * TIME)
    expected = 20.0 / (2.0 * pi * F) ** 2 + 5.0 / (2.0 * pi * 20.0) ** 2
    assert record(TIME, x).largest(0) == pytest.approx(expected, rel=0.01)


def test_the_slow_part_of_a_parabola_is_the_parabola() -> None:
    time = np.linspace(-1.0, 1.0, 2001)
    parabola = (3.0 + 2.0 * time + time**2)[:, None]
    fast = 0.01 * np.sin(2.0 * pi * 50.0 * time)[:, None]
    middle = slice(200, -200)
    assert slow_part(parabola + fast, 160)[middle] == pytest.approx(parabola[middle], abs=1e-5)


@pytest.mark.parametrize(
    ("periods", "share"), [(0.25, 0.0), (1.0, 0.25), (2.0, 1.0), (2.5, 1.0), (4.0, 1.0)]
)
def test_the_slow_part_has_a_stated_limit(periods: float, share: float) -> None:
    """What is left of a motion of some periods in a window of 400 samples."""
    motion = np.sin(2.0 * pi * periods / 400.0 * np.arange(8000))[:, None]
    left = motion - slow_part(motion, 400)
    assert np.abs(left[800:-800]).max() == pytest.approx(share, abs=0.06)


def test_pictures_do_not_show_the_drift_of_a_sensor(tmp_path: Path) -> None:
    """The boundary of a film shakes in place; the walls of a run in the laboratory follow the record."""
    time = np.arange(0.0, 0.5, 2e-4)
    text = csv(time, x=-4.0 * np.sin(2.0 * pi * F * time) + 0.1 * np.sin(2.0 * pi * 3.0 * time))
    for frame in ("container", "lab"):
        done = run(
            recorded(tmp_path, text, {"samples_per_cycle": 20, "settling_cycles": 2}, frame=frame),
            tmp_path,
        )
        motion = done.motion
        drift = boundary_motion(motion.case.excitation, motion.time)[0]
        assert np.ptp(drift[:, 0]) > 2e-3
        assert np.abs(motion.substrate[40:-40, 0]).max() == pytest.approx(AMPLITUDE, rel=0.05)
        seen = Scene.around(motion, np.eye(3))
        assert seen.high[0] - seen.low[0] < 4.0  # mm, of which the walker has 1 and its path 2
        assert done.result["amplitude"] == pytest.approx(AMPLITUDE, rel=0.02)


def test_the_largest_values_of_a_record_are_lengths_of_vectors() -> None:
    """Equal sines along x and y are a sine along the diagonal, of √2 of the peak."""
    time, x = sine_of(20, rate=6400.0)
    made = record(time, G * x, G * x)
    assert made.largest(2) == pytest.approx(2.0**0.5 * PEAK, rel=1e-5)
    assert made.largest(0) == pytest.approx(2.0**0.5 * AMPLITUDE, rel=5e-3)
    assert made.direction == pytest.approx((0.5**0.5, 0.5**0.5, 0.0))


def test_the_direction_is_that_of_the_acceleration() -> None:
    """Not of the displacement, which is larger along y."""
    x = 3.0 * np.sin(2.0 * pi * 160.0 * TIME)
    y = 2.0 * np.sin(2.0 * pi * 40.0 * TIME)
    assert record(TIME, x, y).direction == pytest.approx((1.0, 0.0, 0.0), abs=1e-3)


# --- amplitudes that change -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "points", [(2.0, 0.2), (0.2, 2.0), (2.0, 2.0, 1.0, 1.0, 0.3, 0.3), (1.5, 0.3, 0.3, 1.5)]
)
@pytest.mark.parametrize("other", [0.0, 0.5])
def test_the_local_amplitude_is_the_envelope_of_the_strongest_line(
    points: tuple[float, ...], other: float
) -> None:
    """Beside noise, an offset and other lines, of which one beats with the strongest."""
    envelope = np.interp(TIME, np.linspace(0.0, 2.0, len(points)), points)
    x = envelope * np.sin(2.0 * pi * F * TIME + 0.5)
    x += other * (0.5 * np.sin(2.0 * pi * 160.0 * TIME) + 0.3 * np.sin(2.0 * pi * 95.0 * TIME))
    x += 0.03 + np.random.default_rng(6).normal(scale=0.02, size=len(TIME))
    made = record(TIME, G * x)
    width = 0.5 * 8.0 / F if not other else 0.5 * max(8.0 / F, 2.0 / 15.0)
    inside = np.abs(TIME - 1.0) < 1.0 - width
    # By definition, the mean of the envelope with the weights of the window.
    window = np.hanning(round(2.0 * width / 1e-4) + 2)[1:-1]
    expected = np.convolve(envelope, window / window.sum(), mode="same")[inside]
    assert made.local_amplitude(TIME)[inside] / G == pytest.approx(expected, abs=0.02 * max(points))
    assert made.is_stationary is False


def test_the_local_amplitude_of_a_circle_is_its_radius() -> None:
    made = record(TIME, 3.0 * np.cos(2.0 * pi * F * TIME), 3.0 * np.sin(2.0 * pi * F * TIME))
    assert made.amplitude_range == pytest.approx((3.0, 3.0), rel=1e-3)


@pytest.mark.parametrize("second", [90.0, 95.0, 160.0])
def test_beats_are_no_change_of_the_amplitude(second: float) -> None:
    x = 12.0 * np.sin(2.0 * pi * F * TIME) + 8.0 * np.sin(2.0 * pi * second * TIME)
    made = record(TIME, x)
    assert made.is_stationary
    assert made.amplitude_range == pytest.approx((12.0, 12.0), rel=0.01)


def test_a_record_that_repeats_has_one_amplitude() -> None:
    """That of its strongest line."""
    time = np.linspace(0.0, 4.0 / F, 801)
    made = record(
        time, 5.0 * np.sin(4.0 * pi * F * time) + 3.0 * np.sin(6.0 * pi * F * time), repeats=True
    )
    assert made.amplitude_range == pytest.approx((5.0, 5.0), rel=1e-5)
    assert made.is_stationary


@pytest.mark.parametrize(("ends", "name"), [((1.2, 0.8), "stops_at"), ((0.8, 1.2), "starts_at")])
def test_a_record_that_falls_or_rises_is_a_ramp(
    ends: tuple[float, float], name: str, tmp_path: Path
) -> None:
    """Its threshold is that of a sine with a ramp, 0.9 g, within the resolution."""
    time = np.arange(0.0, 0.7, 1e-4)
    envelope = np.interp(time, [0.0, 0.7], ends)
    noise = np.random.default_rng(7).normal(scale=0.01, size=len(time))
    (tmp_path / "record.csv").write_text(
        csv(time, x=-envelope * np.sin(2.0 * pi * F * time) + noise + 0.05)
    )
    changes = {"dimers.replicates": 1, "run.samples_per_cycle": 1}
    done = run(
        load_case("fig1b", {**changes, "drive.record": str(tmp_path / "record.csv")}), tmp_path
    )
    within = done.result[name.replace("_at", "_within")]
    assert within == pytest.approx(0.4 * G * 0.1 / 0.7, rel=0.1)
    assert done.result[name] == pytest.approx(0.9 * G, abs=within)
    assert done.result.warnings == []
    assert done.describe().split("\n")[0].startswith(f"fig1b: {name.replace('_', ' ')} 0.")


def test_a_record_that_changes_without_a_threshold_has_a_velocity(tmp_path: Path) -> None:
    """With a warning."""
    time = np.arange(0.0, 0.7, 1e-4)
    envelope = np.interp(time, [0.0, 0.7], [4.0, 3.4])
    (tmp_path / "record.csv").write_text(csv(time, x=-envelope * np.sin(2.0 * pi * F * time)))
    changes = {"dimers.replicates": 1, "run.samples_per_cycle": 1}
    done = run(
        load_case("fig1b", {**changes, "drive.record": str(tmp_path / "record.csv")}), tmp_path
    )
    assert "stops_at" not in done.result
    assert done.result.warnings == [
        "the amplitude of the strongest line of the record lies between 3.49 and 3.96 g: "
        "the velocity is a mean over different drives"
    ]
    assert len(done.result.table("ramp")) == 6


def test_a_threshold_needs_walkers(pile_run: Path) -> None:
    """A ramp of a pile has none."""
    case = read_motion(pile_run).case
    assert not applies(
        case.with_values(drive=case.drive.with_values(ramp=((0.0, 1.0), (0.1, 0.5))))
    )


@pytest.mark.parametrize(
    ("peaks", "expected"),
    [
        ([3.0, 2.9, 2.95, 2.0, 1.5, 1.52, 1.5, 2.5, 3.0], [-1, -1, -1, -1, 1, 1, 1, 1]),
        ([1.0, 1.02, 0.98, 0.5, 0.2, 0.21, 0.19, 1.0, 1.02], [0, -1, -1, -1, -1, -1, 1, 1]),
        ([2.0, 2.0, 1.0, 1.0, 2.0, 2.0], [0, -1, 0, 1, 0]),
        ([1.0, 1.05, 0.95, 1.0], [0, 0, 0]),
    ],
)
def test_noise_of_an_amplitude_has_no_direction(peaks: list[float], expected: list[int]) -> None:
    assert drive_changes(np.array(peaks), 0.2).tolist() == expected


# --- refused ----------------------------------------------------------------------------------------------------------
def test_a_ramp_beside_a_record_that_changes_is_refused(tmp_path: Path) -> None:
    envelope = np.interp(TIME, [0.0, 2.0], [2.0, 0.2])
    text = csv(TIME, x=envelope * np.sin(2.0 * pi * F * TIME))
    told = "drive.ramp.*: expected none: the amplitude of drive.record changes by itself, from 0.245 to 1.96 g"
    with pytest.raises(InputError, match=told):
        recorded(tmp_path, text, ramp=RAMP)


@pytest.mark.parametrize("with_record", [True, False])
def test_limits_of_accelerations_include_the_ramp(with_record: bool, tmp_path: Path) -> None:
    ramp = [["0 s", 1], ["0.05 s", 1000]]
    with pytest.raises(
        InputError,
        match=r"expected factors that give accelerations up to 10000 m/s²; .* 39[12]\d\d",
    ):
        if with_record:
            time, x = sine_of(20)
            recorded(tmp_path, csv(time, x=x), BRIEF, ramp=ramp)
        else:
            load_case({**document(drive={"ramp": ramp})})


@pytest.mark.parametrize("periods", [1.3, 2.4])
def test_a_record_of_few_periods_is_refused(periods: float, tmp_path: Path) -> None:
    time, x = sine_of(periods)
    with pytest.raises(
        InputError, match="expected at least 3 periods of its strongest line, found"
    ):
        recorded(tmp_path, csv(time, x=x), {"cycles": 2, "settling_cycles": 0})


def test_a_case_written_to_a_file_is_refused_in_one_line(tmp_path: Path) -> None:
    """A record of which no frequency is that of a shaker."""
    time, x = sine_of(20)
    tables = document()
    tables["drive"] = {"record": "record.csv"}
    (tmp_path / "record.csv").write_text(csv(1e-6 * time, x=x))
    (tmp_path / "case.toml").write_text(to_toml(tables))
    done = call("show", "case.toml", folder=tmp_path)
    told = "expected frequencies up to 1e+06 Hz; found 8.4e+07 Hz: is the unit of the time right?"
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert told in done.stderr


def test_a_comment_below_the_numbers_is_no_header(tmp_path: Path) -> None:
    """Loggers write a line such as ``# end`` when they stop."""
    file = tmp_path / "log.csv"
    rows = "\n".join(f"{number},{number % 3}" for number in range(20))
    file.write_text(f"# a logger\n# time (ms), x (g)\n{rows}\n# end\n", encoding="utf-8")
    contents = read_record(file)
    assert len(contents["rows"]) == 20
    assert contents["rows"][2][:2] == pytest.approx([2e-3, 2.0 * 9.8])


@pytest.mark.parametrize("width", [20, 21])
def test_windows_are_around_their_samples(width: int) -> None:
    """A straight line and the middle of a parabola are their own slow parts, for even and odd widths."""
    time = np.arange(200.0)
    signals = np.stack([3.0 * time - 7.0, (time - 100.0) ** 2], axis=1)
    slow = slow_part(signals, width)
    np.testing.assert_allclose(slow[:, 0], signals[:, 0], atol=1e-9)
    np.testing.assert_allclose(slow[60:140, 1], signals[60:140, 1], atol=1e-8)


def test_a_header_behind_a_hash_may_stand_above_decimal_commas(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = [
        f"{number / 1e3:.4f};{9.81 * (number % 3):.3f}".replace(".", ",") for number in range(20)
    ]
    file.write_text("\n".join(["# time (s);z (m/s^2)", *rows]) + "\n", encoding="utf-8")
    contents = read_record(file)
    assert len(contents["rows"]) == 20
    assert contents["rows"][5] == pytest.approx([5e-3, 0.0, 0.0, 19.62])


@pytest.mark.parametrize(("unit", "factor"), [("mg", 9.8e-3), ("G", 9.8), ("m/s2", 1.0)])
def test_units_of_accelerometers(unit: str, factor: float, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = "\n".join(f"{number},{number % 3}" for number in range(20))
    file.write_text(f"time (ms),Acc X ({unit})\n{rows}\n", encoding="utf-8")
    assert read_record(file)["rows"][2][1] == pytest.approx(2.0 * factor)


def test_the_largest_acceleration_is_that_of_the_spline() -> None:
    """With six rows a period at 30°, 90°, … rows meet the peak of a sine; at 0°, 60°, … they miss it by 13 %."""
    time = np.arange(0.0, 61.0) / 6.0 / F
    sine = 39.2 * np.sin(2.0 * np.pi * F * time)
    record = Record(
        rows=tuple((t, a, 0.0, 0.0) for t, a in zip(time.tolist(), sine.tolist(), strict=True))
    )
    assert np.abs(sine).max() == pytest.approx(0.866 * 39.2, rel=1e-3)
    assert record.largest(2) == pytest.approx(39.2, rel=0.01)


def test_a_record_that_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "record.csv")
    with pytest.raises(ValueError, match="is a pipe, a socket or a device; expected a file"):
        read_record(tmp_path / "record.csv")
