"""Walkers as measured: velocities, angles, means, work, results, tables; when a run is steady."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pyarrow.parquet as pq
import pytest
from matplotlib.axes import Axes

import walkers
from tests.conftest import COULOMB, document, make_case
from walkers.api import compare
from walkers.errors import InputError, Stopped
from walkers.files import read_json, write_json
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.loads import contact_loads, dimer_of
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure import meetings, piles, record_part, threshold, walking
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.gait import (
    averages,
    gait,
    measure_walk,
    settled_samples,
    turns_away_after,
)
from walkers.postprocess.measure.motion import Group, read_bridges, read_motion
from walkers.postprocess.measure.numbers import rows
from walkers.postprocess.measure.quantities import TABLES, axis, declared, matches
from walkers.postprocess.measure.results import Results, modules_of, read_results
from walkers.postprocess.measure.sides import sides
from walkers.postprocess.measure.tables import Columns, read_columns, read_table, write_table
from walkers.postprocess.measure.walking import measure, walkers_met
from walkers.postprocess.show.figures import figures_of
from walkers.progress import Progress
from walkers.runner.binary import find_engine
from walkers.runner.manifest import RESULT_NAME, read_manifest
from walkers.runner.run_directory import (
    FIRST_SEGMENT,
    case_of,
    leave_out_dumps,
    recomputed,
    segment_directories,
)
from walkers.runs.making import make_runs
from walkers.theory.mathieu import turning_rate

FloatArray = npt.NDArray[np.float64]
RunDirectory = Callable[..., Path]
Once = Callable[[str, Callable[[Path], object]], Path]
SHORT = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 20}


@pytest.fixture(scope="module")
def directory(run_directory: RunDirectory) -> Path:
    """The shipped walker of Fig. 1b: six replicates, driven until they are steady."""
    return run_directory(load_case("fig1b"))


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    """The motion of the six replicates."""
    return read_motion(directory).groups[0]


@pytest.fixture
def copied(directory: Path, tmp_path: Path) -> Path:
    """A copy of the run of the six replicates, to be changed."""
    return Path(shutil.copytree(directory, tmp_path / directory.name))


def headings(group: Group) -> npt.NDArray[np.int64]:
    """1 for each walker that faces right, -1 for one that faces left."""
    return np.array([walker.facing for walker in group.walkers])


# --- velocities -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def walked(moved: Group) -> Columns:
    """The velocities of the six replicates, as the program measures them."""
    return measure_walk(moved)


@pytest.fixture(scope="module")
def strobed(moved: Group) -> FloatArray:
    """Their displacements along x and y over time, m/s, from the first settled cycle to the last.

    Shape (6, 2).
    """
    run = moved.case.run
    places = moved.mass_centre[:: run.samples_per_cycle][run.settling_cycles :]
    seconds = (run.cycles - run.settling_cycles) / moved.case.excitation.frequency
    return (places[-1, :, :2] - places[0, :, :2]) / seconds


def test_velocity_is_the_strobed_displacement_over_time(
    moved: Group, walked: Columns, strobed: FloatArray
) -> None:
    """Along the axis, and along the heading of each walker."""
    np.testing.assert_allclose(walked["axial_velocity"], strobed[:, 0], rtol=1e-3)
    np.testing.assert_allclose(walked["velocity"], headings(moved) * strobed[:, 0], rtol=0.01)
    assert np.all(walked["steady"])


def test_lateral_velocity_is_the_strobed_displacement_across_the_axis_over_time(
    walked: Columns, strobed: FloatArray
) -> None:
    """Within two thousandths of the slowest axial velocity."""
    tolerance = 2e-3 * np.abs(strobed[:, 0]).min()
    np.testing.assert_allclose(walked["lateral_velocity"], strobed[:, 1], atol=tolerance)


def test_the_velocity_of_the_gait_is_in_the_mean_that_of_the_walker(
    moved: Group, walked: Columns
) -> None:
    """Twenty samples a cycle represent the gait."""
    settled = settled_samples(moved.case.run)
    mean = gait(moved).velocity[settled].mean(axis=0)
    np.testing.assert_allclose(mean, walked["velocity"], rtol=0.03)


def test_sliding_and_rotation_of_beads_are_the_velocity_of_the_mass_centre(moved: Group) -> None:
    """Sliding is velocity less rotation, and the mass centre weighs beads by their radii cubed."""
    motion = gait(moved)
    weights = moved.radii**3 / np.sum(moved.radii**3)
    velocity = (motion.sliding[..., :2] + motion.rotation) @ weights
    np.testing.assert_allclose(velocity, motion.velocity, atol=1e-12)


def test_sliding_between_two_beads_is_that_of_their_rotations(moved: Group) -> None:
    """Their surfaces move in opposite directions, each as fast as its bead rolls."""
    motion = gait(moved)
    np.testing.assert_allclose(motion.sliding[..., 2], -motion.rotation.sum(axis=-1), atol=1e-15)


def with_drift(group: Group, axis: int, velocity: float) -> Group:
    """Let walkers drift along x (0) or y (1) at a velocity in m/s."""
    position = group.position.copy()
    position[..., axis] += velocity * group.time[:, None, None]
    return replace(group, position=position)


@pytest.mark.parametrize("drift", [1e-3, -1e-3])
def test_walkers_of_both_headings_that_drift_to_one_side_have_one_lateral_velocity(
    moved: Group, drift: float
) -> None:
    """Along y, to the left of the drive axis; nothing else of their velocities changes."""
    before = measure_walk(moved)
    after = measure_walk(with_drift(moved, 1, drift))
    assert set(headings(moved)) == {1, -1}
    gained = after["lateral_velocity"] - before["lateral_velocity"]
    np.testing.assert_allclose(gained, drift, rtol=1e-9)
    np.testing.assert_allclose(after["axial_velocity"], before["axial_velocity"], rtol=1e-9)


def test_a_lateral_velocity_is_to_the_left_of_the_drive(moved: Group) -> None:
    """Driven along y, walkers that drift along x drift to the right."""
    along_y = replace(moved, case=moved.case.with_value_at("drive.axis", "y"))
    before = measure_walk(along_y)
    after = measure_walk(with_drift(along_y, 0, 1e-3))
    gained = after["lateral_velocity"] - before["lateral_velocity"]
    np.testing.assert_allclose(gained, -1e-3, rtol=1e-9)
    np.testing.assert_allclose(after["axial_velocity"], before["axial_velocity"], rtol=1e-9)


# --- angles -----------------------------------------------------------------------------------


def with_orientation(group: Group, angle: FloatArray, case: Case) -> Group:
    """Put walkers into a case, each turned from the direction it faces by an angle in each frame.

    Angles are in rad, shape (F,).
    """
    start = group.position[0]
    centre = group.mass_centre[0][:, None]
    turn = angle[:, None] - group.orientation[0]
    cosine = np.cos(turn)[..., None]
    sine = np.sin(turn)[..., None]
    arm = (start - centre)[None]
    position = np.broadcast_to(start, group.position.shape).copy()
    position[..., 0] = centre[..., 0] + cosine * arm[..., 0] - sine * arm[..., 1]
    position[..., 1] = centre[..., 1] + sine * arm[..., 0] + cosine * arm[..., 1]
    turned = replace(group, case=case, position=position)
    expected = np.tile(angle[:, None], len(group.walkers))
    np.testing.assert_allclose(turned.orientation, expected, atol=1e-9)
    return turned


SIGNS = pytest.mark.parametrize("sign", [1.0, -1.0], ids=["to the left", "to the right"])


@SIGNS
def test_a_walker_on_a_slope_turns_over_when_the_tangent_of_half_its_angle_is_one(
    moved: Group, sign: float
) -> None:
    """dψ/dt = 2/s · sin ψ: tan(ψ/2) = tan(0.5°) exp(2t/s), from 1° to 90°."""
    sloped = moved.case.with_value_at("boundary.tilt", 0.1)
    angle = 2.0 * np.arctan(np.tan(np.radians(0.5)) * np.exp(2.0 * moved.time))
    time_left = np.log(1.0 / np.tan(np.radians(0.5))) / 2.0 - moved.time[-1]
    predicted = turns_away_after(with_orientation(moved, sign * angle, sloped))
    np.testing.assert_allclose(predicted, time_left, rtol=0.03)


@SIGNS
def test_a_walker_on_a_level_substrate_turns_away_when_the_tangent_of_its_angle_is_one(
    moved: Group, sign: float
) -> None:
    """dψ/dt = 2/s · sin 2ψ / 2: tan ψ = tan(1°) exp(2t/s), from 1° to 45°."""
    angle = np.arctan(np.tan(np.radians(1.0)) * np.exp(2.0 * moved.time))
    time_left = np.log(1.0 / np.tan(np.radians(1.0))) / 2.0 - moved.time[-1]
    predicted = turns_away_after(with_orientation(moved, sign * angle, moved.case))
    np.testing.assert_allclose(predicted, time_left, rtol=0.03)


@pytest.mark.parametrize(
    ("rate", "degrees"),
    [
        pytest.param(-2.0, 1.0, id="shrinks"),
        pytest.param(0.0, 1.0, id="stays"),
        pytest.param(0.04, 1.0, id="grows too slowly"),
        pytest.param(2.0, 0.5, id="is too small"),
    ],
)
def test_a_walker_whose_angle_does_not_grow_turns_away_never(
    moved: Group, rate: float, degrees: float
) -> None:
    """Angles that grow exponentially at a rate in 1/s."""
    angle = np.radians(degrees) * np.exp(rate * moved.time)
    assert np.isnan(turns_away_after(with_orientation(moved, angle, moved.case))).all()


def test_the_orientation_of_a_walker_that_goes_round_does_not_jump(moved: Group) -> None:
    """All beads turn about the origin by two whole turns."""
    angle = np.linspace(0.0, 4.0 * np.pi, len(moved.time))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    position = moved.position.copy()
    position[..., :2] = np.einsum("xyf,wby->fwbx", turn, moved.position[0, ..., :2])
    orientation = replace(moved, position=position).orientation
    expected = np.tile(angle[:, None], len(moved.walkers))
    np.testing.assert_allclose(orientation - orientation[0], expected, atol=1e-9)


# --- results ----------------------------------------------------------------------------------


def test_velocities_of_a_result_follow_the_papers_protocol(directory: Path) -> None:
    """Mean, range and scatter over all walkers, and over those that face right."""
    result = read_results(directory)
    table = result.table("walkers")
    velocity = table["velocity"]
    right = velocity[table["facing"] == 1]
    assert result["velocity"] == pytest.approx(velocity.mean())
    assert result["smallest"] == pytest.approx(velocity.min())
    assert result["largest"] == pytest.approx(velocity.max())
    assert result["scatter"] == pytest.approx(velocity.std())
    assert result["right_facing"] == pytest.approx(right.mean())
    assert result["right_scatter"] == pytest.approx(right.std())


def test_a_result_counts_walkers_of_both_headings(directory: Path) -> None:
    """Of six, half face right; those that face left walk the other way."""
    result = read_results(directory)
    assert result["facing_right"] == 3
    assert result["steady"] == 6
    assert not result["walkers_met"]
    assert result["axial_left_facing"] < 0 < result["axial_velocity"]


def test_the_numbers_of_a_result_are_declared_and_can_be_written_as_json(directory: Path) -> None:
    result = read_results(directory)
    for name, number in result.items():
        assert declared(name)
        assert isinstance(number, (bool, int, float)), name
    assert json.loads(json.dumps(result.as_dict())) == result.as_dict()


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("velocity", "scatter of copies 0.01"),
        ("right_facing", "scatter of copies 0.02"),
        ("left_facing", "scatter of copies 0.03"),
    ],
)
def test_velocities_of_the_protocol_are_shown_with_the_scatter_of_their_own_walkers(
    directory: Path, name: str, error: str
) -> None:
    """In mm/s."""
    numbers = dict(read_results(directory))
    numbers["scatter"] = 1e-5
    numbers["right_scatter"] = 2e-5
    numbers["left_scatter"] = 3e-5
    (row,) = [row for row in rows(numbers) if row.name == name]
    assert row.error == error


def test_reading_a_result_writes_nothing(copied: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in copied.rglob("*")}
    read_results(copied)
    assert {path: path.stat().st_mtime_ns for path in copied.rglob("*")} == before


def test_a_result_of_an_earlier_version_is_measured_again_by_walkers_run_alone(
    copied: Path,
) -> None:
    right = read_results(copied).as_dict()
    contents = read_json(copied / RESULT_NAME)
    contents["version"] = 0
    write_json(copied / RESULT_NAME, contents)
    with pytest.raises(InputError, match=f"walkers run {copied} measures it again"):
        read_results(copied)
    assert walkers.run(copied).result.as_dict() == right


def test_a_result_without_numbers_is_measured_again_by_walkers_run_alone(copied: Path) -> None:
    right = read_results(copied).as_dict()
    write_json(copied / RESULT_NAME, {"version": 1})
    with pytest.raises(InputError, match=f"walkers run {copied} measures it again"):
        read_results(copied)
    assert walkers.run(copied).result.as_dict() == right


def test_a_result_that_was_edited_is_measured_again(copied: Path) -> None:
    right = read_results(copied).as_dict()
    contents = read_json(copied / RESULT_NAME)
    contents["numbers"]["velocity"] = 99.0
    write_json(copied / RESULT_NAME, contents)
    assert walkers.run(copied).result.as_dict() == right


def test_a_result_whose_tables_are_damaged_or_lost_is_measured_again(copied: Path) -> None:
    right = read_results(copied).as_dict()
    (copied / "walkers.parquet").write_bytes(b"")
    (copied / "bridges.parquet").unlink()
    assert walkers.run(copied).result.as_dict() == right


def test_a_result_cannot_be_measured_again_without_dumps(copied: Path) -> None:
    (copied / RESULT_NAME).unlink()
    for dump in copied.rglob("*.bin"):
        dump.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        walkers.run(copied)


# --- modules that measure ---------------------------------------------------------------------


RAMP = {"drive.ramp": [["0 s", 1], ["0.5 s", 0.2]]}


@pytest.mark.parametrize(
    ("case", "changes", "names"),
    [
        pytest.param("fig1b", {}, ["walking"], id="walkers"),
        pytest.param("fig1b", RAMP, ["walking", "threshold"], id="walkers under a ramp"),
        pytest.param("tray", {}, ["walking", "meetings"], id="walkers that meet"),
        pytest.param("pile-ci", {}, ["piles"], id="a pile"),
    ],
)
def test_modules_measure_the_cases_to_which_they_apply(
    case: str, changes: dict[str, Any], names: list[str]
) -> None:
    assert [module.NAME for module in modules_of(load_case(case, changes))] == names


def remove_versions_of_modules(run: Path) -> None:
    """Write the result of a run as it was written before modules had versions."""
    contents = read_json(run / RESULT_NAME)
    del contents["modules"]
    with recomputed(run, [RESULT_NAME]):
        write_json(run / RESULT_NAME, contents)


def outdate(monkeypatch: pytest.MonkeyPatch, *modules: Any) -> None:
    """Give modules that measure the version after theirs."""
    for module in modules:
        monkeypatch.setattr(module, "VERSION", module.VERSION + 1)


@pytest.fixture(params=[True, False], ids=["versions of modules", "one version"])
def of_modules(request: pytest.FixtureRequest, copied: Path) -> Path:
    """A copy of a run whose result has a version of each module, or was written before these."""
    if not request.param:
        remove_versions_of_modules(copied)
    return copied


@pytest.fixture
def without_dumps(of_modules: Path) -> Path:
    """The same without dumps: it cannot be measured again."""
    leave_out_dumps(of_modules)
    return of_modules


def test_a_module_outdates_only_results_that_it_measured(
    without_dumps: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run without dumps survives a change of any other module."""
    right = read_results(without_dumps).as_dict()
    written = (without_dumps / RESULT_NAME).read_bytes()
    outdate(monkeypatch, piles, meetings, threshold, record_part)
    assert read_results(without_dumps).as_dict() == right
    assert walkers.run(without_dumps).result.as_dict() == right
    assert (without_dumps / RESULT_NAME).read_bytes() == written


def test_a_module_outdates_results_without_dumps_that_it_measured(
    without_dumps: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They cannot be measured again, and stay as they are."""
    written = (without_dumps / RESULT_NAME).read_bytes()
    outdate(monkeypatch, walking)
    message = f"another version of the program; walkers run {without_dumps} measures it again"
    with pytest.raises(InputError, match=message):
        read_results(without_dumps)
    with pytest.raises(InputError, match="cannot be read"):
        walkers.run(without_dumps)
    assert (without_dumps / RESULT_NAME).read_bytes() == written


def test_a_run_with_dumps_is_measured_again_by_a_changed_module(
    of_modules: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its result contains the new version, and those of no modules that do not measure it."""
    right = read_results(of_modules).as_dict()
    outdate(monkeypatch, walking)
    assert walkers.run(of_modules).result.as_dict() == right
    assert read_json(of_modules / RESULT_NAME)["modules"] == {"walking": walking.VERSION}


def test_a_result_has_the_versions_of_the_modules_that_measured_it(directory: Path) -> None:
    assert read_json(directory / RESULT_NAME)["modules"] == {"walking": walking.VERSION}


def test_a_result_of_a_module_that_no_longer_exists_is_outdated(copied: Path) -> None:
    contents = read_json(copied / RESULT_NAME)
    contents["modules"]["ended"] = 1
    write_json(copied / RESULT_NAME, contents)
    with pytest.raises(InputError, match="was measured by another version of the program"):
        read_results(copied)


# --- which way walkers face -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("facing", "degrees", "side"),
    [(1, 0.0, 1), (1, 91.0, 1), (1, 150.0, -1), (-1, 20.0, -1), (-1, -175.0, 1)],
)
def test_walkers_that_start_turned_by_more_than_90_degrees_face_the_other_way(
    facing: int, degrees: float, side: int
) -> None:
    """At 91° a walker is across the axis, within about a degree, and faces as it did."""
    assert sides([facing], np.radians([degrees])).tolist() == [side]


@pytest.fixture
def turned_round(run_directory: RunDirectory) -> Results:
    """The result of a single walker that starts at 150° to the right."""
    return read_results(run_directory(dimers={"angle": "150 deg"}, run=SHORT))


def test_a_walker_that_starts_turned_round_is_counted_as_facing_left(
    turned_round: Results,
) -> None:
    assert turned_round["facing_right"] == 0
    assert turned_round["facing_left"] == 1


def test_a_single_walker_has_no_scatter(turned_round: Results) -> None:
    assert np.isnan(turned_round["scatter"])


def test_a_walker_that_starts_turned_round_is_drawn_as_facing_left(turned_round: Results) -> None:
    """150° from the right is -30° from the left."""
    panel = figures_of(turned_round)["walk"].axes[1]
    assert str(panel.lines[0].get_label()).startswith("0: left at -30°, ")


# --- slopes -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def on_slope(run_directory: RunDirectory) -> Results:
    """Two walkers on a slope of 10°."""
    tables = {"boundary": {"tilt": "10 deg"}, "dimers": {"replicates": 2}}
    return read_results(run_directory(**tables, run=SHORT))


@pytest.fixture(scope="module")
def on_level(run_directory: RunDirectory) -> Results:
    """The same on a level substrate."""
    tables = {"boundary": {"tilt": "0 deg"}, "dimers": {"replicates": 2}}
    return read_results(run_directory(**tables, run=SHORT))


def label_of(result: Results, name: str) -> str:
    """The label of a number where results are shown."""
    (row,) = [row for row in rows(result) if row.name == name]
    return row.label


@pytest.mark.parametrize(
    ("name", "level", "slope"),
    [
        ("right_facing", "velocity, facing right", "velocity, facing up"),
        ("sliding_1", "sliding of bead 1", "sliding of bead 1, facing up"),
        ("walkers", "walkers", "walkers"),
    ],
)
def test_on_slopes_numbers_of_walkers_that_face_up_alone_say_so(
    on_level: Results, on_slope: Results, name: str, level: str, slope: str
) -> None:
    assert label_of(on_level, name) == level
    assert label_of(on_slope, name) == slope


@pytest.fixture(scope="module")
def panels(on_slope: Results) -> list[Axes]:
    """The figure of walkers on a slope: height, orientation and path."""
    return figures_of(on_slope)["walk"].axes


@pytest.fixture(scope="module")
def first_walker(on_slope: Results) -> pd.DataFrame:
    """The cycles of the first of two walkers on a slope."""
    cycles = on_slope.table("cycles")
    return cycles[cycles["walker"] == 0]


def test_on_slopes_the_path_is_drawn_as_seen_by_who_goes_up(
    panels: list[Axes], first_walker: pd.DataFrame
) -> None:
    """In mm; what is to the left, the positive side, is drawn on the left.

    Heights are from the end of settling on, where the grey part of the panel ends.
    """
    height, _, path = panels
    line = path.lines[0]
    along = 1e3 * first_walker["along"].to_numpy()
    drawn = np.asarray(height.lines[0].get_ydata())
    np.testing.assert_allclose(np.diff(drawn), np.diff(along), rtol=0.0, atol=1e-9)
    end_of_settling = float(
        height.patches[0].get_extents().transformed(height.transData.inverted()).x1
    )
    settled = np.abs(first_walker["time"].to_numpy() - end_of_settling).argmin()
    assert drawn[settled] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(line.get_xdata(), 1e3 * first_walker["across"])
    np.testing.assert_allclose(line.get_ydata(), 1e3 * first_walker["along"])
    left, right = path.get_xlim()
    assert left > right


@pytest.mark.parametrize("panel", [0, 1], ids=["height", "orientation"])
def test_on_slopes_the_interval_in_which_walkers_settle_is_marked(
    panels: list[Axes], first_walker: pd.DataFrame, panel: int
) -> None:
    """Until the end of the second cycle."""
    axes = panels[panel]
    (settling,) = axes.patches
    ends = settling.get_extents().transformed(axes.transData.inverted())
    assert ends.x1 == pytest.approx(first_walker["time"].iloc[2])


# --- walkers that turn away after the end of a run --------------------------------------------


STEEL = {
    "beads.material": "chrome steel",
    "dimers.radii": ["0.8 mm", "0.5 mm"],
    "dimers.angle": "1 deg",
    "dimers.replicates": 1,
    "liquid.name": "ethylene glycol",
    "boundary.material": "PTFE",
    "drive.peak_acceleration": "2 g",
}
"""A heavy walker, which turns over on a gentle slope."""
STEEL_IN_GLYCEROL = {
    **STEEL,
    "dimers.angle": "10 deg",
    "dimers.angle_spread": "0 deg",
    "liquid.name": "glycerol 87 %",
    "boundary.material": "glass",
    "drive.peak_acceleration": "5 g",
    "drive.frequency": "60 Hz",
    "run.cycles": 12,
}
"""A heavy walker, which turns away from the drive axis on a level substrate."""


@pytest.fixture(scope="module")
def finished_run(run_directory: RunDirectory) -> Callable[[Case], walkers.Run]:
    """Make the run of a case, once a session."""

    def make_run(case: Case) -> walkers.Run:
        return walkers.load(run_directory(case))

    return make_run


def cycles_asked_for(warning: str) -> int:
    """The number at the end of a warning such as ``…: set run.cycles = 90``."""
    return int(warning.rpartition("= ")[2])


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_two_frames_of_a_walker_on_a_slope_say_nothing_of_its_turning_over(
    finished_run: Callable[[Case], walkers.Run],
) -> None:
    """Three are necessary to see that an angle grows faster and faster."""
    changes = {
        "boundary.tilt": "4 deg",
        "run.cycles": 8,
        "run.settling_cycles": 4,
        "run.frames_per_second": 20,
        "dimers.replicates": 1,
    }
    run = finished_run(load_case("fig1b", changes))
    assert len(run.table("cycles")["time"]) == 3
    assert not run.result.warnings


def test_a_run_that_ends_before_its_walker_turns_over_says_how_long_it_must_be(
    finished_run: Callable[[Case], walkers.Run],
) -> None:
    """Half as long again as until the walker turns over."""
    changes = {"boundary.tilt": "4 deg", "run.cycles": 40, **STEEL}
    short = finished_run(load_case("fig1b", changes))
    assert short.result["turned_over"] == 0
    (warning,) = short.result.warnings
    assert "1 of 1 walker turns faster and faster and will turn over" in warning
    cycles = cycles_asked_for(warning)
    assert 60 <= cycles <= 400
    longer = finished_run(changed_case(short.case, {"run.cycles": cycles}))
    (turned_at,) = longer.walkers["turned_at"]
    frequency = longer.case.excitation.frequency
    assert turned_at == pytest.approx(cycles / 1.5 / frequency, rel=0.1)
    assert "turn over after the end" not in " ".join(longer.result.warnings)


def test_a_walker_that_stays_on_a_gentle_slope_is_not_said_to_turn_over(
    finished_run: Callable[[Case], walkers.Run],
) -> None:
    """Of ruby."""
    changes = {"boundary.tilt": "4 deg", "run.cycles": 24, "dimers.replicates": 1}
    run = finished_run(load_case("fig1b", changes))
    assert run.result["turned_over"] == 0
    assert not run.result.warnings


@pytest.fixture(scope="module")
def turning_away(finished_run: Callable[[Case], walkers.Run]) -> walkers.Run:
    """A walker of steel in glycerol, at 10° to the drive axis and more and more, for 12 cycles."""
    return finished_run(load_case("fig1b", STEEL_IN_GLYCEROL))


@pytest.fixture(scope="module")
def turned_away(
    turning_away: walkers.Run, finished_run: Callable[[Case], walkers.Run]
) -> walkers.Run:
    """The same for as many cycles as its warning asks for."""
    (warning,) = turning_away.result.warnings
    changes = {"run.cycles": cycles_asked_for(warning)}
    return finished_run(changed_case(turning_away.case, changes))


TURNS_AWAY = "1 of 1 walker turns away from the drive axis faster and faster, by 45° after about "


def time_until_45_degrees(run: walkers.Run) -> float:
    """The time after the end of a run at which it expects its walker at 45° to the axis, s."""
    (warning,) = run.result.warnings
    assert warning.startswith(TURNS_AWAY)
    return float(warning.removeprefix(TURNS_AWAY).split()[0])


def test_a_walker_that_turns_away_is_said_to_do_so_at_the_rate_of_the_theory(
    turning_away: walkers.Run,
) -> None:
    """tan ψ grows exponentially, to 1 at 45°."""
    tangent = np.tan(abs(turning_away.result["orientation_end"]))
    expected = -np.log(tangent) / turning_rate(turning_away.case)
    assert time_until_45_degrees(turning_away) == pytest.approx(expected, rel=0.2)


def test_a_walker_that_turns_away_does_so_when_it_is_said_to(
    turning_away: walkers.Run, turned_away: walkers.Run
) -> None:
    end = turning_away.table("cycles")["time"].iloc[-1]
    cycles = turned_away.table("cycles")
    beyond = cycles["time"][cycles["orientation"].abs() > np.pi / 4.0].iloc[0]
    assert beyond - end == pytest.approx(time_until_45_degrees(turning_away), rel=0.25)


def test_a_comparison_says_of_which_run_the_walker_turns_away(
    turning_away: walkers.Run, turned_away: walkers.Run, runs_folder: Path
) -> None:
    (warning,) = turning_away.result.warnings
    name = turning_away.directory.name
    text = compare(name, turned_away.directory.name, runs_folder).text
    assert f"{name}: warning: {warning}" in text


def test_a_walker_at_less_than_a_degree_is_not_said_to_turn_away(
    turning_away: walkers.Run, finished_run: Callable[[Case], walkers.Run]
) -> None:
    """Rolling friction may hold it there."""
    run = finished_run(changed_case(turning_away.case, {"dimers.angle": "0.5 deg"}))
    assert not run.result.warnings


def test_symmetric_walkers_that_turn_away_tell_that_small_angles_grow_too(
    finished_run: Callable[[Case], walkers.Run],
) -> None:
    """All six turn in a longer run: a warning about one of them does not mean that five stay."""
    (warning,) = finished_run(load_case("symmetric", COULOMB)).result.warnings
    assert "1 of 6 walkers turns away from the drive axis" in warning
    assert "; the small angles of 5 others grow too: set run.cycles = " in warning


def test_small_angles_that_decay_are_not_said_to_grow(directory: Path) -> None:
    assert not walkers.load(directory).result.warnings


def test_progress_says_when_results_are_measured(tmp_path: Path) -> None:
    shown: list[Progress] = []
    case = make_case(run=SHORT)
    make_runs([case], tmp_path, find_engine(), on_progress=shown.append)
    assert shown[-1] == Progress(1.0, "measuring")


# --- walkers that come close ------------------------------------------------------------------


def test_walkers_far_apart_have_not_met(moved: Group) -> None:
    assert not walkers_met([moved])


def test_walkers_that_come_close_are_reported(moved: Group) -> None:
    """In the second half of the run walker 1 is beside walker 0, with 0.2 mm between them."""
    position = moved.position.copy()
    late = position[len(position) // 2 :]
    apart = late[:, 0].mean(axis=1, keepdims=True) - late[:, 1].mean(axis=1, keepdims=True)
    late[:, 1] += apart
    late[:, 1, :, 1] += 1.2e-3
    places = moved.motion.position.copy()
    places[:, moved.rows] = position
    measured = measure(replace(moved.motion, position=places))
    assert measured.numbers["walkers_met"]
    assert any("not independent" in warning for warning in measured.warnings)


def test_a_motion_none_of_whose_frames_recorded_bridges_is_refused(moved: Group) -> None:
    """The frames within the first cycle: bridges are recorded at the ends of cycles."""
    with pytest.raises(DumpError, match="none of its frames recorded bridges"):
        list(read_bridges(moved.motion.select(slice(1, 19))))


# --- work -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sliding_run(run_directory: RunDirectory) -> Path:
    """A run of equal beads that keep each other from rolling, with little friction on the wall."""
    return run_directory(
        dimers={
            "radii": ["0.25 mm", "0.25 mm"],
            "replicates": 1,
            "angle_spread": "0 deg",
            "gap_spread": 0.0,
        },
        liquid={"viscosity_ratio": 1e-4},
        contact={"friction": {"bead_wall": 0.01, "bead_bead": 1.0}, "rolling_friction": 0.0},
        run={"cycles": 60, "settling_cycles": 50, "samples_per_cycle": 20},
    )


def test_the_drive_pays_for_what_slides(sliding_run: Path) -> None:
    """4 A μ N in a cycle; N is the weight and the capillary force of both beads on the wall."""
    case = case_of(sliding_run)
    result = read_results(sliding_run)
    first, second, _ = contact_loads(case)
    normal = first.pull + second.pull + dimer_of(case).total_mass * case.pressing_gravity
    work = 4.0 * case.excitation.amplitude * 0.01 * normal
    assert result["work"] == pytest.approx(work, rel=0.02)


def test_the_work_of_a_result_is_the_mean_of_that_of_its_settled_cycles(sliding_run: Path) -> None:
    result = read_results(sliding_run)
    works = result.table("cycles").set_index("cycle")["work"]
    assert result["work"] == pytest.approx(works[50:].mean())


def test_a_walker_that_goes_nowhere_has_no_cost_of_transport(sliding_run: Path) -> None:
    assert isnan(read_results(sliding_run)["cost_of_transport"])


def test_the_cost_of_transport_is_that_of_each_kinds_own_mass(run_directory: RunDirectory) -> None:
    """The mean of f W/(M g v) of a dimer and of a fan of more than six times its mass."""
    radii_of_kinds = {0: [0.3e-3, 0.2e-3], 1: [0.6e-3, 0.3e-3, 0.3e-3]}
    fan = {"arrangement": "fan", "radii": ["0.6 mm", "0.3 mm", "0.3 mm"], "replicates": 1}
    tables = document(
        dimers={"replicates": 1}, run={"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
    )
    case = build_case({**tables, "clusters": [fan]}, name="two-kinds")
    result = read_results(run_directory(case))
    cycles = result.table("cycles").set_index("cycle")
    costs = []
    for walker in result.table("walkers").itertuples():
        radii = np.array(radii_of_kinds[walker.make])
        mass = 4.0 / 3.0 * np.pi * case.beads.density * np.sum(radii**3)
        work = cycles["work"][cycles["walker"] == walker.walker][2:6].mean()
        costs.append(80.0 * work / (mass * 9.8 * abs(walker.velocity)))
    assert len(costs) == 2
    assert result["cost_of_transport"] == pytest.approx(np.mean(costs))


def test_bridges_are_sampled_as_often_in_a_cycle_as_is_asked(run_directory: RunDirectory) -> None:
    """Four times in each of four cycles of 1/80 s, and at the end."""
    run = {
        "cycles": 4,
        "settling_cycles": 1,
        "samples_per_cycle": 20,
        "bridge_samples_per_cycle": 4,
    }
    result = read_results(run_directory(run=run))
    times = np.unique(result.table("bridges")["time"])
    np.testing.assert_allclose(times, np.arange(17) / (4.0 * 80.0), atol=1e-9)


# --- means over the steps between samples -----------------------------------------------------


def make_hopping(samples: int, **run: object) -> Case:
    """Make the case of Fig. 4b's walker, whose beads part in every cycle."""
    tables = read_toml(shipped("case")["fig4b"])
    tables["dimers"]["replicates"] = 1
    tables["run"] = {
        "time_step": "3 us",
        "cycles": 12,
        "settling_cycles": 4,
        "samples_per_cycle": samples,
        **run,
    }
    return build_case(tables, source="test", name=f"hopping-{samples}")


@pytest.fixture(scope="module")
def few_samples(trajectory: Callable[..., Group]) -> Group:
    """The hopping walker with 20 samples in a cycle."""
    return trajectory(make_hopping(20))


@pytest.fixture(scope="module")
def many_samples(trajectory: Callable[..., Group]) -> Group:
    """The hopping walker with 200 samples in a cycle."""
    return trajectory(make_hopping(200))


def largest_sliding(group: Group) -> float:
    """The largest mean sliding of a bead or a pair of beads, m/s."""
    return float(np.abs(averages(group).sliding).max())


def mean_of_samples(group: Group) -> FloatArray:
    """The mean sliding over the samples of the settled cycles, m/s."""
    return gait(group).sliding[settled_samples(group.case.run)].mean(axis=0)


def test_means_do_not_depend_on_how_often_motion_is_sampled(
    few_samples: Group, many_samples: Group
) -> None:
    """Rotation and sliding within 0.5 % of the fastest, open contacts within 0.01 of the time."""
    few = averages(few_samples)
    many = averages(many_samples)
    tolerance = 5e-3 * largest_sliding(many_samples)
    np.testing.assert_allclose(few.rotation, many.rotation, atol=tolerance)
    np.testing.assert_allclose(few.sliding, many.sliding, atol=tolerance)
    np.testing.assert_allclose(few.open, many.open, atol=0.01)


def test_the_mean_of_many_samples_is_near_the_mean_of_all_steps(many_samples: Group) -> None:
    tolerance = 1e-2 * largest_sliding(many_samples)
    expected = averages(many_samples).sliding
    np.testing.assert_allclose(mean_of_samples(many_samples), expected, atol=tolerance)


def test_the_mean_of_few_samples_is_not_the_mean_of_all_steps(
    few_samples: Group, many_samples: Group
) -> None:
    """Otherwise the tests of means could not tell one from the other."""
    error = np.abs(mean_of_samples(few_samples) - averages(many_samples).sliding).max()
    assert error > 5e-3 * largest_sliding(many_samples)


def rms(values: FloatArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def test_mean_spins_are_those_of_all_steps_between_two_samples(
    few_samples: Group, many_samples: Group
) -> None:
    """As ten times as many samples give them by trapezia, which the samples themselves do not."""
    few = few_samples.motion
    many = many_samples.motion
    assert few.mean_spin is not None
    midpoints = (many.spin[1:] + many.spin[:-1]) / 2.0
    shape = (len(few.time) - 1, 10, *few.spin.shape[1:])
    between = midpoints.reshape(shape).mean(axis=1)
    assert rms(few.mean_spin[1:] - between) < 0.01 * rms(between)
    assert rms(few.spin[1:] - between) > 0.1 * rms(between)


@pytest.fixture(scope="module")
def in_parts(trajectory: Callable[..., Group]) -> Group:
    """The hopping walker with 20 samples in a cycle, in three segments."""
    return trajectory(make_hopping(20, segment="0.05 s"))


def test_a_run_in_parts_has_mean_spins_in_all_frames(in_parts: Group) -> None:
    """The first frame of a segment, which has no mean yet, is the last one of that before."""
    motion = in_parts.motion
    assert len({segment for segment, _ in motion.frames}) == 3
    assert motion.mean_spin is not None
    assert (np.abs(motion.mean_spin[1:]).max(axis=(1, 2)) > 0.0).all()


def test_a_run_in_parts_has_the_same_means(few_samples: Group, in_parts: Group) -> None:
    whole = averages(few_samples)
    parts = averages(in_parts)
    tolerance = 1e-2 * largest_sliding(few_samples)
    np.testing.assert_allclose(parts.rotation, whole.rotation, atol=tolerance)
    np.testing.assert_allclose(parts.sliding, whole.sliding, atol=tolerance)


# --- runs that end when they are steady -------------------------------------------------------


def make_alone(angle: float = 0.0, **drive: Any) -> Case:
    """Make the shipped walker alone, at an angle in degrees, with other values of the drive."""
    tables = read_toml(shipped("case")["fig1b"])
    tables.pop("run", None)
    tables["dimers"] = {
        "radii": ["0.3 mm", "0.2 mm"],
        "replicates": 1,
        "angle": f"{angle} deg",
        "spacing": "80 mm",
    }
    tables["drive"].update(drive)
    return build_case(tables, name="shipped")


def make_turning() -> Case:
    """Make a walker that still turns to the axis after 12 cycles, and less and less after 24.

    Its liquid hardly resists, and edges of its menisci do not.
    """
    changes = {**COULOMB, "liquid.viscosity_ratio": 0.1}
    return changed_case(make_alone(4.0, peak_acceleration="8 g"), changes)


@pytest.fixture(scope="module")
def steady(directory: Path) -> walkers.Run:
    """Six walkers, driven until they are steady."""
    return walkers.load(directory)


@pytest.fixture(scope="module")
def full_length(finished_run: Callable[[Case], walkers.Run]) -> walkers.Run:
    """The same, driven in one segment for as long as the shipped case allows."""
    case = load_case("fig1b")
    run = case.run.with_values(until_steady=False, cycles_per_segment=case.run.cycles)
    return finished_run(case.with_values(run=run))


def test_a_steady_walker_ends_early_after_a_fifth_of_the_cycles(
    steady: walkers.Run, full_length: walkers.Run
) -> None:
    assert steady.result["cycles"] == 12
    assert steady.result["settling_cycles"] == 4
    assert steady.result["ended_early"]
    assert full_length.result["cycles"] == 60
    assert full_length.result["settling_cycles"] == 20
    assert not full_length.result["ended_early"]


def test_a_steady_walker_ends_early_at_the_speed_of_a_long_run(
    steady: walkers.Run, full_length: walkers.Run
) -> None:
    assert steady.result["velocity"] == pytest.approx(full_length.result["velocity"], rel=0.005)


def test_a_run_that_ends_early_is_the_start_of_a_long_run(
    steady: walkers.Run, full_length: walkers.Run
) -> None:
    """12 cycles of 20 samples, and the last one."""
    positions = full_length.motion.position[:241]
    np.testing.assert_array_equal(steady.motion.position, positions)


@dataclass
class Interrupted:
    """A run that was stopped, then continued, and a run of the same length from the start."""

    case: Case
    shown: list[float]
    """The share that was completed at each progress until the run was stopped."""
    continued: walkers.Run
    at_once: walkers.Run


def make_interrupted(folder: Path) -> None:
    """Stop a walker in its second attempt, after 12 cycles and one, then continue it."""
    case = make_turning()
    shown = [0.0]

    def stop_after_13_cycles(progress: Progress) -> None:
        shown.append(progress.share)
        if progress.share * sum(case.run.attempts) > 13:
            raise Stopped("enough")

    with pytest.raises(Stopped):
        make_runs([case], folder, find_engine(), on_progress=stop_after_13_cycles)
    (folder / "shown.json").write_text(json.dumps(shown))
    walkers.run(case, folder)
    walkers.run(case.for_cycles(24), folder)


@pytest.fixture(scope="module")
def interrupted(once: Once) -> Interrupted:
    """The runs of `make_interrupted`, made once a session."""
    folder = once("interrupted-walker", make_interrupted)
    case = make_turning()
    return Interrupted(
        case=case,
        shown=json.loads((folder / "shown.json").read_text()),
        continued=walkers.load(case, folder),
        at_once=walkers.load(case.for_cycles(24), folder),
    )


def test_the_progress_of_a_longer_attempt_goes_on_from_the_shorter_one(
    interrupted: Interrupted,
) -> None:
    """The run starts again after 12 cycles for 24 more, its progress does not."""
    cycles = interrupted.shown[-1] * sum(interrupted.case.run.attempts)
    assert interrupted.shown == sorted(interrupted.shown)
    assert 13 < cycles < 36


def test_a_restless_walker_is_driven_for_longer_at_a_stretch(interrupted: Interrupted) -> None:
    """Nothing of a shorter attempt is left, nor of an interruption: the dumps are the same.

    A restart would perturb the run, and bridges that are open may be lost.
    """
    continued = interrupted.continued
    at_once = interrupted.at_once
    assert continued.result["cycles"] == 24
    assert continued.result["ended_early"]
    assert len(segment_directories(continued.directory)) == 1
    assert at_once.directory != continued.directory
    dump = Path(FIRST_SEGMENT) / "beads.bin"
    assert (continued.directory / dump).read_bytes() == (at_once.directory / dump).read_bytes()


@pytest.mark.parametrize(
    "dimers",
    [
        pytest.param({"radii": ["0.25 mm", "0.22 mm"]}, id="nearly symmetric"),
        pytest.param({"angle": "30 deg"}, id="far from the axis"),
    ],
)
def test_what_settles_slowly_runs_in_full(dimers: dict[str, Any]) -> None:
    run = build_case({**document(dimers=dimers), "run": {}}, name="test").run
    assert not run.until_steady
    assert run.cycles == 60
    assert run.settling_cycles == 20


@pytest.mark.parametrize(
    ("angle", "until_steady"),
    [
        ("-80 deg", False),
        ("0 deg", True),
        ("80 deg", False),
    ],
)
def test_walkers_end_when_steady_only_if_they_start_near_the_axis(
    angle: str, until_steady: bool
) -> None:
    """Near is an angle below 0.1 rad to either side; 80° are 1.4 rad."""
    case = build_case({**document(dimers={"angle": angle}), "run": {}}, name="test")
    assert case.run.until_steady == until_steady


@pytest.mark.parametrize(
    ("table", "until_steady", "cycles", "settling_cycles"),
    [
        pytest.param({}, True, 60, 20, id="none"),
        pytest.param({"cycles": "auto", "most_cycles": 24}, True, 24, 8, id="most cycles"),
        pytest.param({"cycles": 30}, False, 30, 10, id="cycles"),
        pytest.param({"duration": "0.5 s"}, False, 40, 13, id="duration of 40 cycles"),
        pytest.param({"settling_cycles": 30}, False, 60, 30, id="settling cycles"),
    ],
)
def test_numbers_of_cycles_are_obeyed(
    table: dict[str, Any], until_steady: bool, cycles: int, settling_cycles: int
) -> None:
    """A third of the cycles are to settle."""
    run = build_case({**document(), "run": table}, name="test").run
    assert run.until_steady == until_steady
    assert run.cycles == cycles
    assert run.settling_cycles == settling_cycles


# --- several cases in a deck ------------------------------------------------------------------


NAMES = ["one", "turning", "across", "uphill", "thin"]


def make_company() -> list[Case]:
    """Make walkers that feel different forces; the one that turns is driven for longer."""
    alone = make_alone()
    cases = [
        alone,
        make_turning(),
        alone.with_value_at("drive.axis", "y"),
        alone.with_value_at("boundary.tilt", 0.3),
        alone.with_value_at("liquid.viscosity_ratio", 0.4),
    ]
    return [case.with_values(name=name) for case, name in zip(cases, NAMES, strict=True)]


def run_company(folder: Path) -> None:
    """Run the walkers in one deck and, in another folder, each by itself."""
    cases = make_company()
    made = make_runs(cases, folder / "together", find_engine())
    assert set(made.values()) == {True}
    for case in cases:
        make_runs([case], folder / "alone", find_engine())


@pytest.fixture(scope="module")
def company(once: Once) -> Path:
    """The folder of `run_company`, filled once a session."""
    return once("company", run_company)


def place_of(folder: Path, name: str) -> Path:
    """The directory of the run of a case in a folder."""
    (place,) = folder.glob(f"{name}-*")
    return place


def displacement(run: Path) -> FloatArray:
    """Displacements of beads from their first positions, m."""
    position = read_motion(run).position
    return position - position[0]


@pytest.mark.parametrize("name", NAMES)
def test_company_does_not_matter_whatever_forces_it_feels(company: Path, name: str) -> None:
    """Paths and velocities are those of each walker by itself, but for rounding."""
    together = place_of(company / "together", name)
    alone = place_of(company / "alone", name)
    path_together = displacement(together)
    path_alone = displacement(alone)
    assert path_together.shape == path_alone.shape
    assert np.abs(path_together - path_alone).max() < 2e-5 * np.abs(path_alone).max()
    velocity = read_results(alone).table("walkers")["velocity"][0]
    shared = read_results(together).table("walkers")["velocity"][0]
    assert shared == pytest.approx(velocity, rel=1e-6, abs=1e-12)


def test_a_walker_that_is_not_steady_goes_on_in_a_deck_of_its_own(company: Path) -> None:
    """One deck has all walkers for 12 cycles, another one that which needs 24."""
    decks = set()
    for name in NAMES:
        deck = read_manifest(place_of(company / "together", name)).get("shared_deck") or {}
        decks.add(deck.get("first"))
    assert len(decks) == 2
    assert read_motion(place_of(company / "together", "turning")).case.run.cycles == 24
    assert read_motion(place_of(company / "together", "one")).case.run.cycles == 12


# --- tables in files --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def table_files(run_directory: RunDirectory, directory: Path, pile_run: Path) -> dict[str, Path]:
    """A file of each table.

    Of dimers that may meet, of one under a ramp, of a pile, and of six dimers.
    """
    tray = run_directory(
        dimers={"replicates": 4, "spacing": "1.6 mm", "meet": True},
        run={"cycles": 4, "settling_cycles": 1},
    )
    ramped = run_directory(
        drive={"ramp": [["0 s", 1], ["0.2 s", 0]]}, run={"cycles": 30, "settling_cycles": 1}
    )
    files = {}
    for run in (tray, ramped, pile_run, directory):
        for path in run.glob("*.parquet"):
            files[path.stem] = path
    return files


def test_all_declared_tables_are_written(table_files: dict[str, Path]) -> None:
    assert table_files.keys() == TABLES.keys()


def place_in_declaration(table: str, column: str) -> int:
    """The index of the first declared quantity that a column may be."""
    for place, quantity in enumerate(TABLES[table]):
        if matches(quantity.name, column):
            return place
    raise AssertionError(f"{column} of {table} is not declared")


@pytest.mark.parametrize("table", TABLES)
def test_each_file_has_all_columns_that_are_declared_in_their_order(
    table_files: dict[str, Path], table: str
) -> None:
    columns = pq.read_schema(table_files[table]).names
    places = [place_in_declaration(table, column) for column in columns]
    assert places == sorted(places)
    assert set(places) == set(range(len(TABLES[table])))


@pytest.mark.parametrize("table", TABLES)
def test_each_column_has_its_declared_unit_label_and_meaning(
    table_files: dict[str, Path], table: str
) -> None:
    for column in pq.read_schema(table_files[table]):
        quantity = declared(column.name, table)
        assert column.metadata == {
            b"unit": quantity.si_unit.encode(),
            b"units": quantity.si_unit.encode(),
            b"long_name": quantity.label.encode(),
            b"meaning": quantity.meaning.encode(),
        }


@pytest.mark.parametrize("table", TABLES)
def test_a_table_that_is_read_has_a_unit_for_each_column(
    table_files: dict[str, Path], table: str
) -> None:
    path = table_files[table]
    units = read_table(path.parent, table).attrs["units"]
    assert units.keys() == set(pq.read_schema(path).names)


def test_the_trajectory_has_a_row_for_each_walker_and_sample(directory: Path) -> None:
    """Of six walkers, 20 samples a cycle and the first one."""
    table = read_table(directory, "trajectory")
    assert len(table) == pytest.approx(6 * (20 * table["cycle"].max() + 1))


def test_the_table_of_bridges_has_a_row_for_each_bridge_and_cycle(directory: Path) -> None:
    """Of six walkers with three bridges each, at the ends of cycles and at the start."""
    cycles = read_table(directory, "trajectory")["cycle"].max()
    assert len(read_table(directory, "bridges")) == pytest.approx(6 * 3 * (cycles + 1))


@pytest.mark.parametrize(
    ("table", "column", "label", "factor"),
    [
        ("walkers", "open_2", "bead 2 off its wall (%)", 100.0),
        ("trajectory", "sliding_pair_3", "sliding of pair 3 of beads (mm/s)", 1e3),
    ],
)
def test_a_declared_column_of_a_bead_is_labelled_with_the_number_of_the_bead(
    table: str, column: str, label: str, factor: float
) -> None:
    assert axis(table, column) == (label, factor)


@pytest.mark.parametrize("name", ["rotation_x", "gap_1_2", "speed"])
def test_a_column_that_is_not_declared_is_unknown(name: str) -> None:
    with pytest.raises(KeyError):
        declared(name, "trajectory")


def make_meetings(rows: int) -> dict[str, Any]:
    """Make columns of the table ``meetings`` of random values, and of angles that are not known."""
    draw = np.random.default_rng(rows)
    return {
        "time": draw.random(rows),
        "event": draw.choice(["merged", "parted"], rows),
        "walker": draw.integers(0, 9, rows),
        "other": draw.integers(0, 9, rows),
        "size": draw.integers(0, 9, rows),
        "angle": np.where(draw.random(rows) < 0.5, np.nan, 1.0),
    }


@pytest.mark.parametrize("rows", [0, 9])
def test_a_table_is_read_as_it_was_written(tmp_path: Path, rows: int) -> None:
    columns = make_meetings(rows)
    write_table(tmp_path, "meetings", columns)
    read = read_columns(tmp_path, "meetings")
    assert read.keys() == columns.keys()
    for name, column in read.items():
        np.testing.assert_array_equal(column, columns[name])


@pytest.mark.parametrize(
    "columns",
    [
        pytest.param({**make_meetings(3), "power": np.arange(3.0)}, id="one too many"),
        pytest.param({"time": np.arange(3.0)}, id="most of them missing"),
    ],
)
def test_a_table_is_not_written_with_other_columns_than_those_declared(
    tmp_path: Path, columns: dict[str, Any]
) -> None:
    with pytest.raises(KeyError, match="missing or not declared"):
        write_table(tmp_path, "meetings", columns)


def test_a_table_that_a_run_lacks_is_named_with_those_that_it_has(tmp_path: Path) -> None:
    write_table(tmp_path, "meetings", make_meetings(3))
    with pytest.raises(InputError, match="has no table bed; it has meetings"):
        read_columns(tmp_path, "bed")
