"""Velocities, rotation, orientation and the aggregates over replicates."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import walkers
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.figures import figures_of
from walkers.postprocess.gait import Averages, averages, fit_slopes, gait, gaps, settled_samples, steady_walkers, walk
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.numbers import declared as declared_number
from walkers.postprocess.numbers import rows
from walkers.postprocess.results import read
from walkers.postprocess.sides import sides
from walkers.postprocess.tables import read_table
from walkers.postprocess.walking import measure, walkers_met
from walkers.runner.files import read_json, write_json
from walkers.runner.manifest import RESULT_NAME


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    """The shipped walker of Fig. 1b: six replicates, driven until they are steady."""
    return run_directory(load_case("fig1b"))


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    return read_motion(directory).groups[0]


def test_slopes_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(5)
    time = np.linspace(3.0, 4.0, 30)
    values = np.outer(time, [2.0, -1.0]) + 0.1 * rng.standard_normal((30, 2)) + 1e3
    slope = fit_slopes(time, values)
    for column in range(2):
        expected, _ = np.polyfit(time - 3.5, values[:, column] - 1e3, 1)
        assert slope[column] == pytest.approx(expected, rel=1e-9)
    slope = fit_slopes(time, np.outer(time, [1e-3, 0.0]))  # a walker without noise
    np.testing.assert_allclose(slope, [1e-3, 0.0], atol=1e-15)
    assert fit_slopes(np.array([0.0, 2.0]), np.array([[1.0], [5.0]])) == 2.0


def test_a_result_is_measured_again_by_walkers_run_alone(directory: Path, tmp_path: Path) -> None:
    """One that was edited, that another version measured, and one whose table is damaged; the engine does not run."""
    copy = Path(shutil.copytree(directory, tmp_path / directory.name))
    right, manifest = read(copy).as_dict(), read_json(copy / "manifest.json")
    contents = read_json(copy / RESULT_NAME)
    edited = {**contents, "numbers": {**contents["numbers"], "velocity": 99.0}}
    for wrong in ({**contents, "version": 0}, {"version": 1}, edited):
        write_json(copy / RESULT_NAME, wrong)
        if wrong is edited:
            assert read(copy)["velocity"] == 99.0
        else:
            with pytest.raises(InputError, match=f"walkers run {copy} measures it again"):
                read(copy)
        assert walkers.run(copy).result.as_dict() == right
    (copy / "walkers.parquet").write_bytes(b"")
    (copy / "bridges.parquet").unlink()
    assert walkers.run(copy).result.as_dict() == right
    assert len(read(copy).table("walkers")) == 6
    assert {**manifest, "tabulated": None} == {**read_json(copy / "manifest.json"), "tabulated": None}
    (copy / RESULT_NAME).unlink()
    with pytest.raises(InputError, match="measures it again"):
        walkers.load(copy).result  # noqa: B018
    for dump in copy.rglob("*.bin"):  # as in an archive without dumps
        dump.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        walkers.run(copy)


def test_reading_writes_nothing(directory: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in directory.rglob("*")}
    results = read(directory)
    assert [len(results.table(name)) for name in results.about["tables"]]
    assert {path: path.stat().st_mtime_ns for path in directory.rglob("*")} == before


def test_every_number_of_a_result_is_declared_and_plain(directory: Path) -> None:
    results = read(directory)
    assert set(map(declared_number, results)) and all(isinstance(one, (bool, int, float)) for one in results.values())
    assert json.loads(json.dumps(results.as_dict())) == results.as_dict()


def test_symmetric_dimers_need_not_be_on_the_axis_to_be_kept(run_directory: Callable[..., Path]) -> None:
    short = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
    aside = {"angle": "80 deg", "facing": "right"}
    kept = {
        radius: len(steady_walkers(read(run_directory(dimers={"radii": [radius, "0.25 mm"], **aside}, run=short))))
        for radius in ("0.25 mm", "0.26 mm")
    }
    assert kept == {"0.25 mm": 1, "0.26 mm": 0}


def test_velocity_is_the_strobed_displacement_over_time(moved: Group) -> None:
    run = moved.case.run
    strobed = moved.mass_centre[:: run.samples_per_cycle][run.settling_cycles :]
    seconds = (run.cycles - run.settling_cycles) / moved.case.excitation.frequency
    facing = np.array([walker.facing for walker in moved.walkers])
    crude = facing * (strobed[-1, :, 0] - strobed[0, :, 0]) / seconds
    walked = walk(moved)
    np.testing.assert_allclose(facing * walked.axial_velocity, crude, rtol=1e-3)
    np.testing.assert_allclose(walked.velocity, crude, rtol=0.01)
    assert np.abs(walked.lateral_velocity).max() < 0.1 * np.abs(walked.axial_velocity).min()
    assert np.all(walked.steady)
    # Twenty samples a cycle represent the gait: their mean velocity is the displacement a cycle.
    through = gait(moved).velocity[settled_samples(moved)].mean(axis=0)
    np.testing.assert_allclose(through, walked.velocity, rtol=0.03)


def test_the_orientation_of_a_walker_that_goes_round_does_not_jump(moved: Group) -> None:
    angle = np.linspace(0.0, 4.0 * np.pi, len(moved.time))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    position = moved.position.copy()
    position[..., :2] = np.einsum("xyf,wby->fwbx", turn, moved.position[0, ..., :2])
    round_and_round = replace(moved, position=position)
    turned = round_and_round.orientation - round_and_round.orientation[0]
    np.testing.assert_allclose(turned, np.broadcast_to(angle[:, None], turned.shape), atol=1e-9)


def test_sliding_is_velocity_less_rotation(moved: Group) -> None:
    motion = gait(moved)
    # The mass centre moves as its beads do, weighted by their masses.
    weights = moved.radii**3 / np.sum(moved.radii**3)
    carried = (motion.sliding[..., :2] + motion.rotation) @ weights
    np.testing.assert_allclose(carried, motion.velocity, atol=1e-12)
    np.testing.assert_allclose(motion.sliding[..., 2], -motion.rotation.sum(axis=-1), atol=1e-15)


def test_the_result_follows_the_papers_protocol(directory: Path) -> None:
    result, walkers = read(directory), read_table(directory, "walkers")
    velocity, right = walkers["velocity"], walkers["velocity"][walkers["facing"] == 1]
    expected = [velocity.mean(), velocity.min(), velocity.max(), velocity.std(), right.mean(), right.std()]
    names = ("velocity", "smallest", "largest", "scatter", "right_facing", "right_scatter")
    assert [result[name] for name in names] == pytest.approx(expected)
    assert result["axial_left_facing"] < 0 < result["axial_velocity"]
    assert (result["facing_right"], result["steady"], result["walkers_met"]) == (3, 6, False)


def test_velocities_of_both_directions_have_the_scatter_of_their_walkers(directory: Path) -> None:
    numbers = {**read(directory), "scatter": 1e-5, "right_scatter": 2e-5, "left_scatter": 3e-5}
    errors = {row.name: row.error for row in rows(numbers)}
    said = {name: float(errors[name].removeprefix("scatter ")) for name in ("velocity", "right_facing", "left_facing")}
    assert said == {"velocity": 0.01, "right_facing": 0.02, "left_facing": 0.03}  # mm/s


def test_a_single_walker_has_no_scatter(run_directory: Callable[..., Path]) -> None:
    directory = run_directory()
    result = read(directory)
    assert np.isnan([result[name] for name in ("scatter", "left_facing", "left_scatter")]).all()
    assert not [row for row in rows(result) if "scatter" in row.error or row.name == "left_facing"]
    assert result.as_dict()["scatter"] is None
    unsettled = run_directory(run={"cycles": 6, "settling_cycles": 0})
    result = read(unsettled)
    assert result["steady"] == 0
    assert any("not steady" in warning for warning in result.warnings)


def test_walkers_are_named_by_the_direction_in_which_they_face(run_directory: Callable[..., Path]) -> None:
    """Their orientations are from this direction, on trays from the drive."""
    degrees = np.array([0.0, 91.0, 150.0, 20.0, -175.0])
    assert sides([1, 1, 1, -1, -1], np.radians(degrees)).tolist() == [1, 1, -1, -1, 1]
    short = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 20}
    turned = run_directory(dimers={"angle": "150 deg"}, run=short)
    result, (_, orientation, _) = read(turned), figures_of(turned)["walk"].axes
    assert (result["facing_right"], result["facing_left"]) == (0, 1)
    assert str(orientation.lines[0].get_label()).startswith("0: left at -30°, ")
    assert orientation.lines[0].get_ydata()[0] == pytest.approx(-30.0)  # type: ignore[index]
    meeting = {"replicates": 2, "angle": "150 deg", "facing": "left", "meet": True}
    tray = {"shape": "box", "width": "12 mm", "height": "4 mm"}
    (_, orientation, _) = figures_of(run_directory(dimers=meeting, boundary=tray, run=short))["walk"].axes
    assert "from the drive axis" in orientation.get_title(loc="left")
    assert str(orientation.lines[0].get_label()).startswith("0: -30°, ")
    assert orientation.lines[0].get_ydata()[0] == pytest.approx(-30.0)  # type: ignore[index]


def test_figures_of_slopes_show_the_way_up_as_who_goes_up_sees_it(run_directory: Callable[..., Path]) -> None:
    slope = run_directory(boundary={"tilt": "10 deg"}, run={"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 20})
    cycles, (height, orientation, path) = read(slope).columns("cycles"), figures_of(slope)["walk"].axes
    first = {name: 1e3 * values[cycles["walker"] == 0] for name, values in cycles.items()}
    np.testing.assert_allclose(height.lines[0].get_ydata(), first["along"])
    np.testing.assert_allclose(path.lines[0].get_xydata().T, [first["across"], first["along"]])  # type: ignore[union-attr]
    left, right = path.get_xlim()
    assert left > right
    for axes in (height, orientation):
        (settling,) = axes.patches
        assert settling.get_extents().transformed(axes.transData.inverted()).x1 == pytest.approx(
            1e-3 * first["time"][2]
        )


def test_rows_name_directions_by_the_boundary(run_directory: Callable[..., Path]) -> None:
    """On a slope, all numbers of those that face up alone say so."""
    run = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 20}
    places = [run_directory(boundary={"tilt": tilt}, dimers={"replicates": 2}, run=run) for tilt in ("0 deg", "10 deg")]
    plane, sloped = ({row.name: row.label for row in rows(read(place))} for place in places)
    assert (plane["right_facing"], sloped["right_facing"]) == ("velocity, facing right", "velocity, facing up")
    assert (plane["left_facing"], sloped["left_facing"]) == ("velocity, facing left", "velocity, facing down")
    assert (plane["sliding_1"], sloped["sliding_1"]) == ("sliding of bead 1", "sliding of bead 1, facing up")
    assert sloped["axial_velocity"] == "velocity up the slope, facing up"
    assert (plane["walkers"], sloped["walkers"]) == ("walkers", "walkers")


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


# --- means of rotation, sliding and open contacts ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def groups(trajectory: Callable[..., Group]) -> dict[int, Group]:
    return {samples: trajectory(_hopping(samples)) for samples in (20, 200)}


def _hopping(samples: int, **run: object) -> Case:
    """Fig. 4b's walker, whose beads part in every cycle."""
    tables = read_toml(shipped("case")["fig4b"])
    tables["dimers"]["replicates"] = 1
    tables["run"] = {"time_step": "3 us", "cycles": 12, "settling_cycles": 4, "samples_per_cycle": samples, **run}
    return Case.read(tables, source="test", name=f"hopping-{samples}")


def _sampled(group: Group) -> Averages:
    """The same from the samples alone."""
    seen, samples = gait(group), settled_samples(group)
    means = (seen.rotation[samples], seen.sliding[samples], seen.gap[samples] > 0.0)
    return Averages(*(one.mean(axis=0) for one in means), np.zeros(0))


def test_means_do_not_depend_on_how_often_is_looked(groups: dict[int, Group]) -> None:
    """Rotation and sliding within 0.5 % of the fastest, open contacts within a sample of 200."""
    few, many = averages(groups[20]), averages(groups[200])
    scale = float(np.abs(many.sliding).max())
    np.testing.assert_allclose(few.rotation, many.rotation, atol=5e-3 * scale)
    np.testing.assert_allclose(few.sliding, many.sliding, atol=5e-3 * scale)
    np.testing.assert_allclose(few.open, many.open, atol=0.01)
    # What many samples say by themselves is near it, what few say is not.
    near, far = _sampled(groups[200]), _sampled(groups[20])
    np.testing.assert_allclose(near.sliding, many.sliding, atol=1e-2 * scale)
    assert np.abs(far.sliding - many.sliding).max() > 5e-3 * scale
    assert np.abs(far.open - many.open).max() > 5e-3


def test_mean_spins_are_those_of_all_steps_between_two_samples(groups: dict[int, Group]) -> None:
    """As ten times as many samples give them, which one sample of the twenty does not."""
    few, many = groups[20].motion, groups[200].motion
    assert few.mean_spin is not None
    between = (many.spin[1:] + many.spin[:-1]).reshape(len(few.time) - 1, 10, *few.spin.shape[1:]).mean(axis=1) / 2.0
    size = float(np.sqrt(np.mean(between**2)))
    off, sampled = (float(np.sqrt(np.mean((one[1:] - between) ** 2))) / size for one in (few.mean_spin, few.spin))
    assert off < 0.01
    assert sampled > 0.1


def test_with_few_samples_a_cycle_gaps_are_looked_at_there_alone(groups: dict[int, Group]) -> None:
    """A cubic over a quarter of a cycle or more is no way of a bead that hops."""
    few = groups[20]
    motion = replace(few.motion, case=few.case.put("run.samples_per_cycle", 4))
    names = ("time", "position", "velocity", "spin", "substrate", "substrate_velocity", "mean_spin")
    motion = replace(motion, **{name: getattr(motion, name)[::5] for name in names}, frames=motion.frames[::5])
    (thinned,) = motion.groups
    samples = settled_samples(thinned)
    np.testing.assert_array_equal(averages(thinned).open, (gaps(thinned)[samples] > 0.0).mean(axis=0))


def test_a_run_in_parts_has_the_same_means(groups: dict[int, Group], trajectory: Callable[..., Group]) -> None:
    """The first frame of a part, of which nothing is averaged yet, is the last one of the part before."""
    parts = trajectory(_hopping(20, segment="0.05 s"))
    assert len({segment for segment, _ in parts.motion.frames}) == 3
    assert parts.motion.mean_spin is not None
    assert np.abs(parts.motion.mean_spin[1:]).max(axis=(1, 2)).min() > 0.0
    whole, found = averages(groups[20]), averages(parts)
    scale = float(np.abs(whole.sliding).max())
    np.testing.assert_allclose(found.rotation, whole.rotation, atol=1e-2 * scale)
    np.testing.assert_allclose(found.sliding, whole.sliding, atol=1e-2 * scale)
