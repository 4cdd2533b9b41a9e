"""Walkers as measured: velocities, means, work, results, tables; runs that end when they are steady."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import walkers
from tests.conftest import document
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
from walkers.postprocess.measure.results import modules_of, read_results
from walkers.postprocess.measure.sides import sides
from walkers.postprocess.measure.tables import read_columns, read_table, write_table
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

RunDirectory = Callable[..., Path]
SHORT = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 20}


@pytest.fixture(scope="module")
def directory(run_directory: RunDirectory) -> Path:
    """The shipped walker of Fig. 1b: six replicates, driven until they are steady."""
    return run_directory(load_case("fig1b"))


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    return read_motion(directory).groups[0]


def test_velocity_is_the_strobed_displacement_over_time(moved: Group) -> None:
    run = moved.case.run
    strobed = moved.mass_centre[:: run.samples_per_cycle][run.settling_cycles :]
    seconds = (run.cycles - run.settling_cycles) / moved.case.excitation.frequency
    facing = np.array([walker.facing for walker in moved.walkers])
    crude = facing * (strobed[-1, :, 0] - strobed[0, :, 0]) / seconds
    walked = measure_walk(moved)
    np.testing.assert_allclose(facing * walked["axial_velocity"], crude, rtol=1e-3)
    np.testing.assert_allclose(walked["velocity"], crude, rtol=0.01)
    lateral = (strobed[-1, :, 1] - strobed[0, :, 1]) / seconds
    np.testing.assert_allclose(walked["lateral_velocity"], lateral, atol=2e-3 * np.abs(crude).min())
    assert np.all(walked["steady"])
    # Twenty samples a cycle represent the gait: their mean velocity is the displacement a cycle.
    motion = gait(moved)
    settled = settled_samples(moved.case.run)
    np.testing.assert_allclose(motion.velocity[settled].mean(axis=0), walked["velocity"], rtol=0.03)
    # Sliding is velocity less rotation: the mass centre moves as its beads do, weighted by their masses.
    weights = moved.radii**3 / np.sum(moved.radii**3)
    np.testing.assert_allclose(
        (motion.sliding[..., :2] + motion.rotation) @ weights, motion.velocity, atol=1e-12
    )
    np.testing.assert_allclose(motion.sliding[..., 2], -motion.rotation.sum(axis=-1), atol=1e-15)


@pytest.mark.parametrize("drift", [1e-3, -1e-3])
def test_walkers_of_both_headings_that_drift_to_one_side_have_one_lateral_velocity(
    moved: Group, drift: float
) -> None:
    """Along y, to the left of the drive axis; nothing else of their velocities changes."""
    position = moved.position.copy()
    position[..., 1] += drift * moved.time[:, None, None]
    before, after = measure_walk(moved), measure_walk(replace(moved, position=position))
    assert {walker.facing for walker in moved.walkers} == {1, -1}
    np.testing.assert_allclose(
        after["lateral_velocity"] - before["lateral_velocity"], drift, rtol=1e-9
    )
    np.testing.assert_allclose(after["axial_velocity"], before["axial_velocity"], rtol=1e-9)


def test_a_lateral_velocity_is_to_the_left_of_the_drive(moved: Group) -> None:
    """Driven along y, walkers that drift along x drift to the right."""
    position = moved.position.copy()
    position[..., 0] += 1e-3 * moved.time[:, None, None]
    case = moved.case.with_value_at("drive.axis", "y")
    before, after = (
        measure_walk(replace(moved, case=case, position=places))
        for places in (moved.position, position)
    )
    np.testing.assert_allclose(
        after["lateral_velocity"] - before["lateral_velocity"], -1e-3, rtol=1e-9
    )
    np.testing.assert_allclose(after["axial_velocity"], before["axial_velocity"], rtol=1e-9)


def _turned(moved: Group, angle: np.ndarray[Any, Any], case: Case) -> Group:
    """The walkers in a case, each turned from the direction that it faces by an angle (rad) in each frame."""
    start = moved.position[0]
    centre = moved.mass_centre[0][:, None]
    turn = angle[:, None] - moved.orientation[0]
    cosine, sine = np.cos(turn)[..., None], np.sin(turn)[..., None]
    arm = (start - centre)[None]
    position = np.broadcast_to(start, moved.position.shape).copy()
    position[..., 0] = centre[..., 0] + cosine * arm[..., 0] - sine * arm[..., 1]
    position[..., 1] = centre[..., 1] + sine * arm[..., 0] + cosine * arm[..., 1]
    turned = replace(moved, case=case, position=position)
    np.testing.assert_allclose(
        turned.orientation, np.tile(angle[:, None], len(moved.walkers)), atol=1e-9
    )
    return turned


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_walker_on_a_slope_turns_over_when_the_tangent_of_half_its_angle_is_one(
    moved: Group, sign: float
) -> None:
    """dψ/dt = 2/s · sin ψ: tan(ψ/2) = tan(0.5°) exp(2t/s), from 1° to 90°."""
    sloped = moved.case.with_value_at("boundary.tilt", 0.1)
    angle = 2.0 * np.arctan(np.tan(np.radians(0.5)) * np.exp(2.0 * moved.time))
    left = np.log(1.0 / np.tan(np.radians(0.5))) / 2.0 - moved.time[-1]
    found = turns_away_after(_turned(moved, sign * angle, sloped))
    np.testing.assert_allclose(found, left, rtol=0.03)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_walker_on_a_level_floor_turns_away_when_the_tangent_of_its_angle_is_one(
    moved: Group, sign: float
) -> None:
    """dψ/dt = 2/s · sin 2ψ / 2: tan ψ = tan(1°) exp(2t/s), from 1° to 45°."""
    angle = np.arctan(np.tan(np.radians(1.0)) * np.exp(2.0 * moved.time))
    left = np.log(1.0 / np.tan(np.radians(1.0))) / 2.0 - moved.time[-1]
    found = turns_away_after(_turned(moved, sign * angle, moved.case))
    np.testing.assert_allclose(found, left, rtol=0.03)


@pytest.mark.parametrize(
    ("rate", "degrees"),
    [(-2.0, 1.0), (0.0, 1.0), (0.04, 1.0), (2.0, 0.5)],
    ids=["shrinks", "stays", "grows too slowly", "is too small"],
)
def test_a_walker_whose_angle_does_not_grow_turns_away_never(
    moved: Group, rate: float, degrees: float
) -> None:
    angle = np.radians(degrees) * np.exp(rate * moved.time)
    assert np.isnan(turns_away_after(_turned(moved, angle, moved.case))).all()


def test_the_orientation_of_a_walker_that_goes_round_does_not_jump(moved: Group) -> None:
    angle = np.linspace(0.0, 4.0 * np.pi, len(moved.time))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    position = moved.position.copy()
    position[..., :2] = np.einsum("xyf,wby->fwbx", turn, moved.position[0, ..., :2])
    orientation = replace(moved, position=position).orientation
    np.testing.assert_allclose(
        orientation - orientation[0], np.tile(angle[:, None], len(moved.walkers)), atol=1e-9
    )


def test_the_result_follows_the_papers_protocol(directory: Path) -> None:
    result = read_results(directory)
    each = result.table("walkers")
    velocity, right = each["velocity"], each["velocity"][each["facing"] == 1]
    expected = [
        velocity.mean(),
        velocity.min(),
        velocity.max(),
        velocity.std(),
        right.mean(),
        right.std(),
    ]
    names = ("velocity", "smallest", "largest", "scatter", "right_facing", "right_scatter")
    assert [result[name] for name in names] == pytest.approx(expected)
    assert result["axial_left_facing"] < 0 < result["axial_velocity"]
    assert (result["facing_right"], result["steady"], result["walkers_met"]) == (3, 6, False)
    assert set(map(declared, result)) and all(
        isinstance(number, (bool, int, float)) for number in result.values()
    )
    assert json.loads(json.dumps(result.as_dict())) == result.as_dict()
    # Velocities of both directions have the scatter of their walkers, in mm/s.
    errors = {
        row.name: row.error
        for row in rows({**result, "scatter": 1e-5, "right_scatter": 2e-5, "left_scatter": 3e-5})
    }
    said = {
        name: float(errors[name].removeprefix("scatter of copies "))
        for name in ("velocity", "right_facing", "left_facing")
    }
    assert said == {"velocity": 0.01, "right_facing": 0.02, "left_facing": 0.03}


def test_a_result_is_measured_again_by_walkers_run_alone(directory: Path, tmp_path: Path) -> None:
    """One that was edited, that another version measured, and one whose table is damaged; the engine does not run."""
    copy = Path(shutil.copytree(directory, tmp_path / directory.name))
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
    right, contents = read_results(copy).as_dict(), read_json(copy / RESULT_NAME)
    assert before == {
        path: path.stat().st_mtime_ns for path in copy.rglob("*")
    }  # reading writes nothing
    edited = {**contents, "numbers": {**contents["numbers"], "velocity": 99.0}}
    for wrong in ({**contents, "version": 0}, {"version": 1}, edited):
        write_json(copy / RESULT_NAME, wrong)
        if wrong is not edited:
            with pytest.raises(InputError, match=f"walkers run {copy} measures it again"):
                read_results(copy)
        assert walkers.run(copy).result.as_dict() == right
    (copy / "walkers.parquet").write_bytes(b"")
    (copy / "bridges.parquet").unlink()
    assert walkers.run(copy).result.as_dict() == right
    (copy / RESULT_NAME).unlink()
    for dump in copy.rglob("*.bin"):  # as in an archive without dumps
        dump.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        walkers.run(copy)


@pytest.mark.parametrize(
    ("case", "changes", "names"),
    [
        ("fig1b", {}, ["walking"]),
        ("fig1b", {"drive.ramp": [["0 s", 1], ["0.5 s", 0.2]]}, ["walking", "threshold"]),
        ("tray", {}, ["walking", "meetings"]),
        ("pile-ci", {}, ["piles"]),
    ],
)
def test_modules_measure_the_cases_to_which_they_apply(
    case: str, changes: dict[str, Any], names: list[str]
) -> None:
    assert [module.NAME for module in modules_of(load_case(case, changes))] == names


def _without_versions_of_modules(run: Path) -> None:
    """Write the result of a run as it was written before modules had versions."""
    contents = read_json(run / RESULT_NAME)
    del contents["modules"]
    with recomputed(run, [RESULT_NAME]):
        write_json(run / RESULT_NAME, contents)


@pytest.mark.parametrize("has_versions", [True, False], ids=["versions of modules", "one version"])
def test_a_module_outdates_only_results_that_it_measured(
    has_versions: bool, directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run without dumps, which cannot be measured again, survives a change of any other module."""
    run = Path(shutil.copytree(directory, tmp_path / directory.name))
    leave_out_dumps(run)
    if not has_versions:
        _without_versions_of_modules(run)
    right, written = read_results(run).as_dict(), (run / RESULT_NAME).read_bytes()
    for module in (piles, meetings, threshold, record_part):
        monkeypatch.setattr(module, "VERSION", module.VERSION + 1)
    assert read_results(run).as_dict() == right
    assert walkers.run(run).result.as_dict() == right
    assert (run / RESULT_NAME).read_bytes() == written
    monkeypatch.setattr(walking, "VERSION", walking.VERSION + 1)
    with pytest.raises(
        InputError, match=f"another version of the program; walkers run {run} measures it again"
    ):
        read_results(run)
    with pytest.raises(InputError, match="cannot be read"):
        walkers.run(run)
    assert (run / RESULT_NAME).read_bytes() == written


@pytest.mark.parametrize("has_versions", [True, False], ids=["versions of modules", "one version"])
def test_a_run_with_dumps_is_measured_again_by_a_changed_module(
    has_versions: bool, directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its result contains the new version, and those of no modules that do not measure it."""
    run = Path(shutil.copytree(directory, tmp_path / directory.name))
    assert read_json(run / RESULT_NAME)["modules"] == {"walking": walking.VERSION}
    if not has_versions:
        _without_versions_of_modules(run)
    right = read_results(run).as_dict()
    monkeypatch.setattr(walking, "VERSION", walking.VERSION + 1)
    assert walkers.run(run).result.as_dict() == right
    assert read_json(run / RESULT_NAME)["modules"] == {"walking": walking.VERSION}


def test_a_result_of_a_module_that_has_ended_is_outdated(directory: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(directory, tmp_path / directory.name))
    contents = read_json(run / RESULT_NAME)
    contents["modules"]["ended"] = 1
    write_json(run / RESULT_NAME, contents)
    with pytest.raises(InputError, match="was measured by another version of the program"):
        read_results(run)


def test_walkers_are_named_by_the_direction_in_which_they_face(run_directory: RunDirectory) -> None:
    degrees = np.array([0.0, 91.0, 150.0, 20.0, -175.0])
    assert sides([1, 1, 1, -1, -1], np.radians(degrees)).tolist() == [1, 1, -1, -1, 1]
    turned = read_results(run_directory(dimers={"angle": "150 deg"}, run=SHORT))
    assert [turned[name] for name in ("facing_right", "facing_left")] == [0, 1]
    assert np.isnan(turned["scatter"])  # a single walker
    assert str(figures_of(turned)["walk"].axes[1].lines[0].get_label()).startswith(
        "0: left at -30°, "
    )


def test_on_slopes_rows_and_figures_are_by_the_way_up(run_directory: RunDirectory) -> None:
    """All numbers of those that face up alone say so; who goes up sees the path as it is drawn."""
    plane, sloped = (
        read_results(run_directory(boundary={"tilt": tilt}, dimers={"replicates": 2}, run=SHORT))
        for tilt in ("0 deg", "10 deg")
    )
    labels = [{row.name: row.label for row in rows(result)} for result in (plane, sloped)]
    for name, of_plane, of_slope in (
        ("right_facing", "velocity, facing right", "velocity, facing up"),
        ("sliding_1", "sliding of bead 1", "sliding of bead 1, facing up"),
        ("walkers", "walkers", "walkers"),
    ):
        assert [one[name] for one in labels] == [of_plane, of_slope]
    cycles, (height, orientation, path) = sloped.columns("cycles"), figures_of(sloped)["walk"].axes
    first = {name: 1e3 * values[cycles["walker"] == 0] for name, values in cycles.items()}
    np.testing.assert_allclose(height.lines[0].get_ydata(), first["along"])
    np.testing.assert_allclose(path.lines[0].get_xydata().T, [first["across"], first["along"]])  # type: ignore[union-attr]
    left, right = path.get_xlim()
    assert left > right
    for axes in (height, orientation):
        (settling,) = axes.patches
        ends = settling.get_extents().transformed(axes.transData.inverted())
        assert ends.x1 == pytest.approx(1e-3 * first["time"][2])


_STEEL = {
    **{
        "beads.material": "chrome steel",
        "dimers.radii": ["0.8 mm", "0.5 mm"],
        "liquid.name": "ethylene glycol",
    },
    **{
        "boundary.material": "PTFE",
        "drive.peak_acceleration": "2 g",
        "dimers.angle": "1 deg",
        "dimers.replicates": 1,
    },
}


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_two_frames_of_a_walker_on_a_slope_say_nothing_of_its_turning_over(
    runs_folder: Path,
) -> None:
    """Three are necessary to see that an angle grows faster and faster."""
    few = {
        "run.cycles": 8,
        "run.settling_cycles": 4,
        "run.frames_per_second": 20,
        "dimers.replicates": 1,
    }
    done = walkers.run(load_case("fig1b", {"boundary.tilt": "4 deg", **few}), runs_folder)
    assert len(done.table("cycles")["time"]) == 3
    assert not done.result.warnings


def test_a_run_that_ends_before_its_walker_turns_over_says_how_long_it_must_be(
    runs_folder: Path,
) -> None:
    """Of steel on PTFE; ruby stands on a gentle slope."""
    shorts = [
        walkers.run(
            load_case("fig1b", {"boundary.tilt": "4 deg", "run.cycles": cycles, **changes}),
            runs_folder,
        )
        for cycles, changes in ((40, _STEEL), (24, {"dimers.replicates": 1}))
    ]
    assert [run.result["turned_over"] for run in shorts] == [0, 0]
    (warning,) = shorts[0].result.warnings
    assert "1 of 1 walker turns faster and faster and will turn over" in warning
    assert not shorts[1].result.warnings
    cycles = int(warning.rpartition("= ")[2])
    assert 60 <= cycles <= 400
    longer = walkers.run(changed_case(shorts[0].case, {"run.cycles": cycles}), runs_folder)
    (turned,) = longer.walkers["turned_at"]
    # A run is to be half as long again as until then.
    assert turned == pytest.approx(cycles / 1.5 / longer.case.excitation.frequency, rel=0.1)
    assert "turn over after the end" not in " ".join(longer.result.warnings)


def test_a_walker_on_a_level_plate_that_turns_away_says_when(runs_folder: Path) -> None:
    """Of steel in glycerol, at the theory's rate, from 10° to 45° as tan ψ grows exponentially; ruby stays."""
    drive = {"drive.peak_acceleration": "5 g", "drive.frequency": "60 Hz", "run.cycles": 12}
    steel = {
        **_STEEL,
        **drive,
        "liquid.name": "glycerol 87 %",
        "boundary.material": "glass",
        "dimers.angle": "10 deg",
    }
    case = load_case("fig1b", {**steel, "dimers.angle_spread": "0 deg"})
    done = walkers.run(case, runs_folder)
    (warning,) = done.result.warnings
    assert warning.startswith(
        "1 of 1 walker turns away from the drive axis faster and faster, by 45° after about "
    )
    seconds, cycles = (
        float(warning.partition("about ")[2].split()[0]),
        int(warning.rpartition("= ")[2]),
    )
    angle = abs(done.result["orientation_end"])
    assert seconds == pytest.approx(-np.log(np.tan(angle)) / turning_rate(case), rel=0.2)
    longer = walkers.run(changed_case(case, {"run.cycles": cycles}), runs_folder)
    table = longer.table("cycles")
    names = [run.directory.name for run in (done, longer)]
    assert f"{names[0]}: warning: {warning}" in compare(*names, runs_folder).text
    # Rolling friction may hold walkers at less than a degree.
    assert not walkers.run(
        changed_case(case, {"dimers.angle": "0.5 deg"}), runs_folder
    ).result.warnings
    away = table["time"][table["orientation"].abs() > np.pi / 4.0].iloc[0]
    assert away - done.table("cycles")["time"].iloc[-1] == pytest.approx(seconds, rel=0.25)
    assert not walkers.run(load_case("fig1b"), runs_folder).result.warnings


def test_symmetric_walkers_that_turn_away_tell_that_small_angles_grow_too(
    runs_folder: Path,
) -> None:
    """All six turn in a longer run: a warning about one of them does not mean that five stay."""
    done = walkers.run("symmetric", runs_folder)
    (warning,) = done.result.warnings
    assert "1 of 6 walkers turns away from the drive axis" in warning
    assert "; the small angles of 5 others grow too: set run.cycles = " in warning


def test_small_angles_that_decay_are_not_said_to_grow(runs_folder: Path) -> None:
    assert not walkers.run(load_case("fig1b"), runs_folder).result.warnings


def test_progress_says_when_results_are_measured(tmp_path: Path) -> None:
    told: list[Progress] = []
    make_runs(
        [build_case(document(run=SHORT), name="short")],
        tmp_path,
        find_engine(),
        on_progress=told.append,
    )
    assert told[-1] == Progress(1.0, "measuring")


def test_walkers_that_come_close_are_reported(moved: Group) -> None:
    assert not walkers_met([moved])
    position = moved.position.copy()
    late = position[len(position) // 2 :]
    late[:, 1] += late[:, 0].mean(axis=1, keepdims=True) - late[:, 1].mean(axis=1, keepdims=True)
    late[:, 1, :, 1] += 1.2e-3  # beside walker 0, a fifth of a millimetre between them
    places = moved.motion.position.copy()
    places[:, moved.rows] = position
    met = measure(replace(moved.motion, position=places))
    assert met.numbers["walkers_met"]
    assert any("not independent" in warning for warning in met.warnings)
    with pytest.raises(DumpError, match="none of its frames recorded bridges"):
        list(read_bridges(moved.motion.select(slice(1, 19))))


def test_the_drive_pays_for_what_slides(run_directory: RunDirectory) -> None:
    """Equal beads that keep each other from rolling, hardly held by friction: 4 A μ N in a cycle, to no end."""
    directory = run_directory(
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
    case, result = case_of(directory), read_results(directory)
    pressed = (
        sum(load.pull for load in contact_loads(case)[:2])
        + dimer_of(case).total_mass * case.pressing_gravity
    )
    assert result["work"] == pytest.approx(
        4.0 * case.excitation.amplitude * 0.01 * pressed, rel=0.02
    )
    assert isnan(result["cost_of_transport"])
    works = result.table("cycles").set_index("cycle")["work"]
    assert works[50:].mean() == pytest.approx(result["work"])


def test_the_cost_of_transport_is_that_of_each_kinds_own_mass(run_directory: RunDirectory) -> None:
    """Of a dimer and of a fan whose mass is more than six times as large: the mean of f W / (M g v)."""
    radii = {0: [0.3e-3, 0.2e-3], 1: [0.6e-3, 0.3e-3, 0.3e-3]}
    fan = {"arrangement": "fan", "radii": ["0.6 mm", "0.3 mm", "0.3 mm"], "replicates": 1}
    tables = document(
        dimers={"replicates": 1}, run={"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
    )
    case = build_case({**tables, "clusters": [fan]}, name="two-kinds")
    result = read_results(run_directory(case))
    cycles = result.table("cycles").set_index("cycle")
    costs = []
    for walker in result.table("walkers").itertuples():
        mass = 4.0 / 3.0 * np.pi * case.beads.density * np.sum(np.array(radii[walker.make]) ** 3)
        work = cycles["work"][cycles["walker"] == walker.walker][2:6].mean()
        costs.append(80.0 * work / (mass * 9.8 * abs(walker.velocity)))
    assert len(costs) == 2
    assert result["cost_of_transport"] == pytest.approx(np.mean(costs))


def test_bridges_are_sampled_as_often_in_a_cycle_as_is_asked(run_directory: RunDirectory) -> None:
    run = {
        "cycles": 4,
        "settling_cycles": 1,
        "samples_per_cycle": 20,
        "bridge_samples_per_cycle": 4,
    }
    result = read_results(run_directory(run=run))
    times = np.unique(result.table("bridges")["time"])
    np.testing.assert_allclose(times, np.arange(17) / (4.0 * 80.0), atol=1e-9)


@pytest.fixture(scope="module")
def groups(trajectory: Callable[..., Group]) -> dict[int, Group]:
    return {samples: trajectory(_hopping(samples)) for samples in (20, 200)}


def _hopping(samples: int, **run: object) -> Case:
    """Fig. 4b's walker, whose beads part in every cycle."""
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


def test_means_do_not_depend_on_how_often_is_looked(groups: dict[int, Group]) -> None:
    """Rotation and sliding within 0.5 % of the fastest, open contacts within a sample of 200."""
    few, many = averages(groups[20]), averages(groups[200])
    scale = float(np.abs(many.sliding).max())
    np.testing.assert_allclose(few.rotation, many.rotation, atol=5e-3 * scale)
    np.testing.assert_allclose(few.sliding, many.sliding, atol=5e-3 * scale)
    np.testing.assert_allclose(few.open, many.open, atol=0.01)
    # What many samples say by themselves is near it, what few say is not.
    sampled = {
        samples: gait(group).sliding[settled_samples(group.case.run)].mean(axis=0)
        for samples, group in groups.items()
    }
    np.testing.assert_allclose(sampled[200], many.sliding, atol=1e-2 * scale)
    assert np.abs(sampled[20] - many.sliding).max() > 5e-3 * scale


def test_mean_spins_are_those_of_all_steps_between_two_samples(groups: dict[int, Group]) -> None:
    """As ten times as many samples give them, which one sample of the twenty does not."""
    few, many = groups[20].motion, groups[200].motion
    assert few.mean_spin is not None
    between = (many.spin[1:] + many.spin[:-1]).reshape(
        len(few.time) - 1, 10, *few.spin.shape[1:]
    ).mean(axis=1) / 2.0
    size = float(np.sqrt(np.mean(between**2)))
    off, sampled = (
        float(np.sqrt(np.mean((one[1:] - between) ** 2))) / size
        for one in (few.mean_spin, few.spin)
    )
    assert off < 0.01
    assert sampled > 0.1


def test_a_run_in_parts_has_the_same_means(
    groups: dict[int, Group], trajectory: Callable[..., Group]
) -> None:
    """The first frame of a part, of which nothing is averaged yet, is the last one of the part before."""
    parts = trajectory(_hopping(20, segment="0.05 s"))
    assert len({segment for segment, _ in parts.motion.frames}) == 3
    assert parts.motion.mean_spin is not None
    assert np.abs(parts.motion.mean_spin[1:]).max(axis=(1, 2)).min() > 0.0
    whole, found = averages(groups[20]), averages(parts)
    scale = float(np.abs(whole.sliding).max())
    np.testing.assert_allclose(found.rotation, whole.rotation, atol=1e-2 * scale)
    np.testing.assert_allclose(found.sliding, whole.sliding, atol=1e-2 * scale)


def _shipped(angle: float = 0.0, **drive: Any) -> Case:
    """The shipped walker alone, started at an angle in degrees, with other values of the drive."""
    start = {
        "radii": ["0.3 mm", "0.2 mm"],
        "replicates": 1,
        "angle": f"{angle} deg",
        "spacing": "80 mm",
    }
    tables = {
        name: table for name, table in read_toml(shipped("case")["fig1b"]).items() if name != "run"
    }
    return build_case(
        {**tables, "dimers": start, "drive": {**tables["drive"], **drive}}, name="shipped"
    )


def _turning() -> Case:
    """A walker that still turns to the axis after 12 cycles, and less and less after 24: little drags it."""
    return _shipped(4.0, peak_acceleration="8 g").with_value_at("liquid.viscosity_ratio", 0.1)


def test_a_steady_walker_ends_early_at_the_speed_of_a_long_run(
    directory: Path, runs_folder: Path
) -> None:
    case = load_case("fig1b")
    full = case.with_values(
        run=case.run.with_values(until_steady=False, cycles_per_segment=case.run.cycles)
    )
    both = [walkers.load(directory), walkers.run(full, runs_folder)]
    lengths = [
        [run.result[name] for name in ("cycles", "settling_cycles", "ended_early")] for run in both
    ]
    assert lengths == [[12, 4, True], [60, 20, False]]
    assert both[0].result["velocity"] == pytest.approx(both[1].result["velocity"], rel=0.005)
    # Until then the two are the same run.
    np.testing.assert_array_equal(*(run.motion.position[:241] for run in both))


def test_a_restless_walker_is_driven_for_longer_at_a_stretch(tmp_path: Path) -> None:
    """Nothing of a shorter attempt is left: a restart would perturb it, and bridges that are open may be lost.

    Nor does an interruption change what it does, or the progress that is shown.
    """
    case, shown = _turning(), [0.0]

    def stop(progress: Progress) -> None:
        shown.append(progress.share)
        if progress.share * sum(case.run.attempts) > 13:
            raise Stopped("enough")

    with pytest.raises(Stopped):
        make_runs([case], tmp_path, find_engine(), on_progress=stop)
    assert shown == sorted(shown)  # the run begins again after 12 cycles, its progress does not
    assert 13 < shown[-1] * sum(case.run.attempts) < 36
    asked, at_once = (walkers.run(one, tmp_path) for one in (case, case.for_cycles(24)))
    assert at_once.directory != asked.directory
    assert (asked.result["cycles"], asked.result["ended_early"]) == (24, True)
    assert len(segment_directories(asked.directory)) == 1
    dumps = [(run.directory / FIRST_SEGMENT / "beads.bin").read_bytes() for run in (asked, at_once)]
    assert dumps[0] == dumps[1]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, (True, 60, 20)),
        ({"run": {"cycles": "auto", "most_cycles": 24}}, (True, 24, 8)),
        ({"dimers": {"radii": ["0.25 mm", "0.22 mm"]}}, (False, 60, 20)),
        ({"dimers": {"angle": "30 deg"}}, (False, 60, 20)),
        ({"run": {"cycles": 30}}, (False, 30, 10)),
        ({"run": {"duration": "0.5 s"}}, (False, 40, 13)),
        ({"run": {"settling_cycles": 30}}, (False, 60, 30)),
    ],
)
def test_what_settles_slowly_runs_in_full_and_numbers_are_obeyed(
    changes: dict[str, Any], expected: Any
) -> None:
    run = build_case({**document(**changes), "run": changes.get("run", {})}, name="test").run
    assert (run.until_steady, run.cycles, run.settling_cycles) == expected


def test_company_does_not_matter_whatever_forces_it_feels(tmp_path: Path) -> None:
    """Walkers that feel other forces each, one of which goes on when the others are done."""
    case = _shipped()
    changes = {
        "one": ("title", ""),
        "across": ("drive.axis", "y"),
        "uphill": ("boundary.tilt", 0.3),
        "thin": ("liquid.viscosity_ratio", 0.4),
    }
    cases = [case.with_value_at(*change).with_values(name=name) for name, change in changes.items()]
    cases.insert(1, _turning().with_values(name="turning"))
    together = make_runs(cases, tmp_path / "together", find_engine())
    assert {*together.values()} == {True}
    decks = [read_manifest(tmp_path / "together" / name).get("shared_deck") for name in together]
    assert (
        len({deck["first"] if deck else None for deck in decks}) == 2
    )  # the second has the one that went on
    cycles = {}
    for one in cases:
        (name,) = make_runs([one], tmp_path / "alone", find_engine())
        places = [tmp_path / folder / name for folder in ("together", "alone")]
        velocities = [read_results(place).table("walkers")["velocity"][0] for place in places]
        ways = [(motion := read_motion(place)).position - motion.position[0] for place in places]
        assert ways[0].shape == ways[1].shape
        assert np.abs(ways[0] - ways[1]).max() < 2e-5 * np.abs(ways[1]).max(), one.name
        assert velocities[0] == pytest.approx(velocities[1], rel=1e-6, abs=1e-12), one.name
        cycles[one.name] = motion.case.run.cycles
    assert (cycles["turning"], cycles["one"]) == (24, 12)


def test_each_file_has_what_is_declared(run_directory: Callable[..., Path], pile_run: Path) -> None:
    """Of six dimers, of dimers that may meet, of one with a ramp, and of a pile."""
    meeting = {"replicates": 4, "spacing": "1.6 mm", "meet": True}
    tray = run_directory(dimers=meeting, run={"cycles": 4, "settling_cycles": 1})
    ramped = run_directory(
        drive={"ramp": [["0 s", 1], ["0.2 s", 0]]}, run={"cycles": 30, "settling_cycles": 1}
    )
    runs = (run_directory(load_case("fig1b")), tray, ramped, pile_run)
    files = {path.stem: path for run in runs for path in run.glob("*.parquet")}
    assert files.keys() == TABLES.keys()
    for name, path in files.items():
        schema, known = pq.read_schema(path), TABLES[name]
        places = [
            next(place for place, one in enumerate(known) if matches(one.name, column))
            for column in schema.names
        ]
        assert places == sorted(places)
        assert set(places) == set(range(len(known)))
        for field in schema:
            quantity = declared(field.name, name)
            unit, label = quantity.si_unit.encode(), quantity.label.encode()
            expected = {
                b"unit": unit,
                b"units": unit,
                b"long_name": label,
                b"meaning": quantity.meaning.encode(),
            }
            assert field.metadata == expected
        assert read_table(path.parent, name).attrs["units"].keys() == set(schema.names)
    # Of a walker there are rows of 20 samples and 3 bridges a cycle.
    table = read_table(runs[0], "trajectory")
    assert len(table) == pytest.approx(6 * (20 * table["cycle"].max() + 1))
    assert len(read_table(runs[0], "bridges")) == pytest.approx(6 * 3 * (table["cycle"].max() + 1))
    assert axis("walkers", "open_2") == ("bead 2 off its wall (%)", 100.0)
    assert axis("trajectory", "sliding_pair_3") == ("sliding of pair 3 of beads (mm/s)", 1e3)
    for name in ("rotation_x", "gap_1_2", "speed"):
        with pytest.raises(KeyError):
            declared(name, "trajectory")


@pytest.mark.parametrize("rows", [0, 9])
def test_a_table_is_read_as_it_was_written(tmp_path: Path, rows: int) -> None:
    draw = np.random.default_rng(rows)
    names = ("walker", "other", "size")
    columns = {"time": draw.random(rows), "event": draw.choice(["merged", "parted"], rows)}
    columns |= {name: draw.integers(0, 9, rows) for name in names}
    columns["angle"] = np.where(draw.random(rows) < 0.5, np.nan, 1.0)
    write_table(tmp_path, "meetings", columns)
    for name, column in read_columns(tmp_path, "meetings").items():
        np.testing.assert_array_equal(column, columns[name])
    for wrong in (columns | {"power": np.arange(3.0)}, {"time": np.arange(3.0)}):
        with pytest.raises(KeyError, match="missing or not declared"):
            write_table(tmp_path, "meetings", wrong)
    with pytest.raises(InputError, match="has no table bed; it has meetings"):
        read_columns(tmp_path, "bed")
