"""Uncertain values and numerical errors of velocities, and slopes, on which headings differ."""

from __future__ import annotations

import copy
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest

import walkers
from tests.conftest import FillOnce, call, make_case
from walkers.arrays import FloatArray
from walkers.commands.catalogue import catalogue
from walkers.files import read_json, write_json
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.library import LibraryNumber, unmeasured
from walkers.inputs.tables.case import Case
from walkers.inputs.units import parse_quantity
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.measure.numbers import headline, not_all_upright, rows
from walkers.postprocess.measure.quantities import declared, ordered
from walkers.postprocess.measure.results import (
    NotComputed,
    Results,
    headlines,
    not_computed,
    text,
)
from walkers.postprocess.measure.tables import read_columns
from walkers.postprocess.measure.uncertainty import (
    ACCURACY,
    ACCURACY_NAME,
    SPREAD_NAME,
    spread_of,
)
from walkers.postprocess.measure.walking import _velocities
from walkers.rounding import rounded
from walkers.runs.case_text import quantity_kind
from walkers.sweeps.accuracy import measure_accuracy, modulus_factors
from walkers.sweeps.listing import inventory, listing_text
from walkers.sweeps.scheduler import SweepOptions
from walkers.sweeps.table import default_column
from walkers.theory.prediction import predict
from walkers.theory.prediction_text import prediction_text

DOCS = Path(__file__).parents[1] / "docs"


def names_of_rows(result: Results) -> list[str]:
    """Names of the numbers of a result that are printed."""
    return [row.name for row in rows(result)]


def printed_error(result: Results, name: str) -> str:
    """What is printed behind a number of a result: its scatter, band or numerical error."""
    errors = {row.name: row.error for row in rows(result)}
    return errors[name]


def with_values(result: Results, **values: Any) -> Results:
    """A copy of a result with other numbers."""
    changed = copy.copy(result)
    changed.update(values)
    return changed


# --- ranges of the library --------------------------------------------------------------------


def numbers_with_ranges() -> dict[str, tuple[str, LibraryNumber]]:
    """The numbers of the library that have a range, with the key that takes them, by name."""
    numbers = {}
    for key, number in unmeasured().items():
        numbers[key] = (key, number)
    for entry in catalogue():
        if entry.kind != "surface pairs":
            continue
        for key, number in entry.numbers.items():
            if number.range:
                # A meniscus belongs to a pair of surfaces, but a case has it in its liquid.
                table = "liquid" if key.startswith("meniscus") else "contact"
                numbers[f"{key} of {entry.name}"] = (f"{table}.{key}", number)
    return numbers


@pytest.mark.parametrize(
    ("key", "number"), numbers_with_ranges().values(), ids=numbers_with_ranges()
)
def test_the_default_of_the_library_lies_within_its_range(key: str, number: LibraryNumber) -> None:
    """Strictly, except for a contact angle of 0°, which cannot be smaller."""
    written = [number.written, *number.range]
    kind = quantity_kind(key)
    if kind:
        written = [parse_quantity(value, kind) for value in written]
    default, low, high = written
    assert default < high
    if key == "liquid.contact_angle":
        assert default == low == 0.0
    else:
        assert low < default


def test_many_numbers_of_the_library_have_ranges() -> None:
    assert len(numbers_with_ranges()) > 10


# --- walkers on a slope -----------------------------------------------------------------------

SLOPE: dict[str, Any] = {
    "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
    "beads": {"material": "ruby"},
    "liquid": {
        "surface_tension": "20 mN/m",
        "kinematic_viscosity": "5 mm^2/s",
        "density": "0.9 g/cm^3",
    },
    "boundary": {"material": "glass", "tilt": "20 deg"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
    "contact": {"rolling_friction": 0.0},
    "run": {"cycles": 4},
}


@pytest.fixture(scope="module")
def steep(once: FillOnce) -> walkers.Run:
    """Two dimers on a slope of 20°, one faces up and one down; the only run of its folder."""

    def run_case(folder: Path) -> None:
        walkers.run(build_case(SLOPE, name="steep"), folder)

    (directory,) = once("steep", run_case).glob("steep-*")
    return walkers.load(directory)


def test_walkers_that_face_up_and_down_a_slope_differ(steep: walkers.Run) -> None:
    """Both go down, the one that faces up backward; the result has the velocity of each."""
    velocity = steep.walkers.set_index("facing")["velocity"]
    assert steep.result["right_facing"] == velocity[1]
    assert steep.result["left_facing"] == velocity[-1]
    assert velocity[1] < 0.0 < velocity[-1]
    assert steep.result["facings_differ"]


def test_one_walker_a_heading_has_no_scatter(steep: walkers.Run) -> None:
    assert np.isnan(steep.result["right_scatter"])
    assert np.isnan(steep.result["left_scatter"])


def test_a_slope_is_in_the_headline_of_a_run(steep: walkers.Run) -> None:
    assert "plane tilted by 20°, right is up" in steep.describe()


def test_a_slope_is_in_the_report_of_a_run(steep: walkers.Run, tmp_path: Path) -> None:
    report = steep.report(tmp_path / "report.html").read_text("utf-8")
    assert "plane tilted by 20°" in report


def test_the_theory_is_beside_the_engines_walkers_that_face_up(steep: walkers.Run) -> None:
    table = prediction_text(predict(steep.case), steep.result)
    (line,) = re.findall("^engine.*", table, re.MULTILINE)
    words = line.split()
    assert words[:3] == ["engine,", "facing", "up"]
    assert float(words[3]) == pytest.approx(1e3 * steep.result["right_facing"], abs=1e-3)


def test_the_printed_result_of_a_slope_has_the_velocities_of_both_ways(steep: walkers.Run) -> None:
    """Instead of a single one."""
    printed = {row.name: row.text for row in rows(steep.result)}
    assert "velocity" not in printed
    for name in ("axial_velocity", "axial_left_facing"):
        assert float(printed[name]) == float(rounded(1e3 * steep.result[name], "mm/s"))


def test_the_inventory_has_the_velocities_of_both_ways(steep: walkers.Run) -> None:
    up = rounded(1e3 * steep.result["right_facing"], "mm/s")
    down = rounded(1e3 * steep.result["left_facing"], "mm/s")
    listing = listing_text(inventory(steep.directory.parent))
    assert f" {up} mm/s facing up, {down} facing down " in listing


@pytest.fixture
def banded(steep: walkers.Run, tmp_path: Path) -> Callable[[str], walkers.Run]:
    """Give a copy of the run on a slope a spread of 64 draws for one of its numbers.

    Its band, in m/s, ends just below the velocity of the walker that faces up.
    """

    def with_band(name: str) -> walkers.Run:
        directory = tmp_path / steep.directory.name
        shutil.copytree(steep.directory, directory)
        velocity = steep.result["right_facing"]
        band = {"low": velocity - 1e-3, "high": velocity - 1e-4, "points": 64}
        spread = spread_of(directory.resolve())
        spread.mkdir()
        contents = {"varied": steep.result.about["rests_on"], "bands": {name: band}}
        write_json(spread / SPREAD_NAME, contents)
        return walkers.load(directory)

    return with_band


@pytest.mark.parametrize("name", ["right_facing", "velocity"])
def test_the_band_of_a_spread_is_widened_to_the_result(
    name: str, banded: Callable[[str], walkers.Run]
) -> None:
    """On a slope, `velocity` is the velocity of walkers that face up."""
    result = banded(name).result
    assert result[f"{name}_low"] == result["right_facing"] - 1e-3
    assert result[f"{name}_high"] == result["right_facing"]


def test_on_a_slope_the_band_of_the_walkers_that_face_up_is_printed(
    banded: Callable[[str], walkers.Run],
) -> None:
    assert printed_error(banded("right_facing").result, "right_facing").endswith("(64 draws)")


def test_on_a_slope_a_band_of_the_velocity_is_not_printed(
    banded: Callable[[str], walkers.Run],
) -> None:
    """What is printed there are the velocities of both headings."""
    assert not printed_error(banded("velocity").result, "right_facing").endswith("(64 draws)")


def test_slopes_are_compared_by_the_walkers_that_face_up(
    steep: walkers.Run, tmp_path: Path
) -> None:
    tables = {**SLOPE, "boundary": {"material": "glass", "tilt": "10 deg"}}
    gentle = walkers.run(build_case(tables, name="gentle"), tmp_path)
    comparison = walkers.compare(steep.directory, gentle.directory).text
    assert "\nright_facing (mm/s)" in comparison
    assert "\nvelocity (mm/s)" not in comparison


TURNED_OVER = {"turned_round": 1, "upright": 1, "turned_over": 1}
"""Numbers of two walkers, of which one turned over."""


def test_the_main_number_on_a_slope_is_the_velocity_of_walkers_that_face_up(
    steep: walkers.Run,
) -> None:
    result = dict(steep.result)
    assert headline(result) == "right_facing"
    assert default_column(pd.DataFrame([result])) == "right_facing"


def test_the_main_number_is_the_velocity_if_headings_do_not_differ(steep: walkers.Run) -> None:
    result = {**steep.result, "facings_differ": False}
    assert headline(result) == "velocity"
    assert default_column(pd.DataFrame([result])) == "velocity"


def test_the_main_number_is_the_velocity_up_the_slope_if_walkers_turn_over_at_any_point(
    steep: walkers.Run,
) -> None:
    """A sweep has one main column; a velocity along a heading means nothing for such walkers."""
    result = dict(steep.result)
    turned = {**steep.result, **TURNED_OVER}
    assert headline(turned) == "axial_velocity"
    assert default_column(pd.DataFrame([result, turned])) == "axial_velocity"


def test_a_pile_that_climbs_has_not_fallen() -> None:
    """A pile has no numbers of walkers that are upright."""
    assert not not_all_upright({"goes_uphill": True, "climbs": 0})


def test_the_final_angle_is_printed(steep: walkers.Run) -> None:
    assert "orientation_end" in names_of_rows(steep.result)


def test_no_final_angle_is_printed_if_some_walkers_turned_over(steep: walkers.Run) -> None:
    """A mean over those that turned over and those that did not is no walker's angle."""
    turned = with_values(steep.result, **TURNED_OVER)
    assert "orientation_end" not in names_of_rows(turned)


def test_the_final_angle_of_two_walkers_has_their_range(steep: walkers.Run) -> None:
    low, high = np.degrees(sorted(steep.walkers["orientation_end"]))
    error = printed_error(with_values(steep.result, walkers=2), "orientation_end")
    assert error == f"from {rounded(low, '°')} to {rounded(high, '°')} among walkers"


def test_the_final_angle_of_one_walker_has_no_range(steep: walkers.Run) -> None:
    assert printed_error(with_values(steep.result, walkers=1), "orientation_end") == ""


FOUR_BEADS: dict[str, Any] = {
    "clusters": [
        {
            "radii": ["0.5 mm", "0.3 mm", "0.3 mm", "0.3 mm"],
            "at": [
                ["0 mm", "0 mm"],
                ["-0.67075 mm", "0.38726 mm"],
                ["-0.7461 mm", "-0.20777 mm"],
                ["-0.37418 mm", "-0.6782 mm"],
            ],
            "replicates": 2,
        }
    ],
    "beads": {"material": "glass"},
    "boundary": {"material": "glass", "tilt": "30 deg"},
    "liquid": {"name": "glycerol 87 %", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.005},
    "drive": {"frequency": "170 Hz", "peak_acceleration": "10 g"},
    "run": {"cycles": 24, "settling_cycles": 8},
}
"""Two clusters on a slope. Their front beads are 13° beside the direction that they face."""


@pytest.fixture(scope="module")
def four_beads(once: FillOnce) -> walkers.Run:
    """The two clusters of `FOUR_BEADS`, one faces up and one down."""

    def run_case(folder: Path) -> None:
        walkers.run(build_case(FOUR_BEADS, name="four"), folder)

    (directory,) = once("four-beads", run_case).glob("four-*")
    return walkers.load(directory)


def test_of_two_clusters_on_a_slope_the_one_that_faces_up_climbs(four_beads: walkers.Run) -> None:
    """A cluster climbs if it goes up faster than 2 µm/s."""
    assert four_beads.result["climbing"] == 1
    assert four_beads.result["descending"] == 1
    assert (four_beads.walkers["axial_velocity"] > 2e-6).sum() == 1


def test_clusters_on_a_slope_are_averaged_by_the_way_they_face(four_beads: walkers.Run) -> None:
    result = four_beads.result
    each = four_beads.walkers.set_index("facing")
    assert result["velocity"] == pytest.approx(each["velocity"][1])
    assert result["axial_velocity"] == pytest.approx(each["axial_velocity"][1])
    assert result["axial_left_facing"] == pytest.approx(each["axial_velocity"][-1])


def test_the_orientation_of_a_cluster_is_that_of_the_way_it_faces(four_beads: walkers.Run) -> None:
    """It begins with the angle at which the cluster starts, not 13° (0.23 rad) beside it."""
    first = four_beads.trajectory.groupby("walker")["orientation"].first()
    np.testing.assert_allclose(first, four_beads.walkers["start_angle"], atol=2e-3)


def test_a_cluster_leans_by_the_angle_that_it_turned(four_beads: walkers.Run) -> None:
    """Not by the angle between its front beads and the direction that it faces."""
    heading = read_motion(four_beads.directory).groups[0].heading
    angle = np.unwrap(np.arctan2(heading[..., 1], heading[..., 0]), axis=0)
    turned = np.abs(angle[-1] - angle[0])
    assert four_beads.result["ends_within"] == pytest.approx(turned.max(), abs=np.radians(2.0))


# --- what is printed about uncertainty --------------------------------------------------------


@pytest.fixture(scope="module")
def fig1b(run_directory: Callable[..., Path]) -> walkers.Run:
    """The walkers of Fig. 1b, without a spread and without measured accuracy."""
    return walkers.load(run_directory(load_case("fig1b")))


@pytest.fixture
def came_apart(fig1b: walkers.Run) -> Results:
    """The result of Fig. 1b if the beads of its walkers were apart for half of the time."""
    columns = read_columns(fig1b.directory, "walkers")
    columns["separated_fraction"] = columns["separated_fraction"] + 0.5
    return with_values(fig1b.result, **_velocities(columns, fig1b.case))


def test_the_headline_says_that_walkers_came_apart(came_apart: Results) -> None:
    assert came_apart["came_apart"]
    assert headlines(came_apart)[0].endswith(": came apart")


def test_walkers_that_came_apart_have_no_velocity_and_are_not_steady(
    fig1b: walkers.Run, came_apart: Results
) -> None:
    assert "velocity" in names_of_rows(fig1b.result)
    for name in names_of_rows(came_apart):
        assert not re.search("velocity|facing|steady", name)


def test_walkers_that_came_apart_have_no_uncertainty_to_be_computed(
    fig1b: walkers.Run, came_apart: Results
) -> None:
    assert not_computed(fig1b.result)
    assert not not_computed(came_apart)


def test_what_is_not_computed_stands_right_below_the_head_of_a_result(fig1b: walkers.Run) -> None:
    """Eight values of Fig. 1b have a range, and neither option has been used."""
    assert not_computed(fig1b.result) == NotComputed(uncertain_values=8, numerical_error=True)
    _, second, third, *_ = fig1b.describe().splitlines()
    missing = "8 uncertain values (--spread), numerical error (--accuracy)"
    assert f"{second} {third.strip()}" == f"  uncertainty not computed: {missing}"


def test_scatter_of_copies_is_named_as_such(fig1b: walkers.Run) -> None:
    assert printed_error(fig1b.result, "velocity") == "scatter of copies below 0.001"


MODEL_NOTE = "of uncertain values only; the error of the model is not in it"


def test_a_result_without_a_band_has_no_note_about_bands(fig1b: walkers.Run) -> None:
    assert MODEL_NOTE not in " ".join(fig1b.describe().split())


def test_a_band_tells_that_it_leaves_out_the_error_of_the_model(fig1b: walkers.Run) -> None:
    result = with_values(
        fig1b.result,
        velocity_low=1e-3,
        velocity_high=3e-3,
        velocity_draws=32,
        velocity_approximate=False,
    )
    assert MODEL_NOTE in " ".join(text(result).split())
    assert "uncertain values (--spread)" not in text(result)


def numbers_if_some_are_faster(
    run: walkers.Run, is_faster: np.ndarray, *, steady: bool = True
) -> dict[str, Any]:
    """The numbers of walkers of which some are faster by 40 %."""
    columns = read_columns(run.directory, "walkers")
    columns["velocity"] = np.where(is_faster, 1.4, 1.0) * columns["velocity"]
    if not steady:
        columns["steady"] = np.zeros_like(columns["steady"])
    return _velocities(columns, run.case)


def test_a_result_of_equal_copies_does_not_depend_on_the_start(fig1b: walkers.Run) -> None:
    assert not fig1b.result["depends_on_start"]


def test_a_result_depends_on_the_start_if_one_heading_is_faster(fig1b: walkers.Run) -> None:
    """On a level floor, where both should be equal."""
    faces_left = read_columns(fig1b.directory, "walkers")["facing"] < 0
    assert numbers_if_some_are_faster(fig1b, faces_left)["depends_on_start"]


def test_a_result_depends_on_the_start_if_copies_of_one_heading_differ(fig1b: walkers.Run) -> None:
    is_first = fig1b.walkers.index == 0
    assert numbers_if_some_are_faster(fig1b, is_first)["depends_on_start"]


def test_copies_that_are_not_steady_do_not_show_that_a_result_depends_on_the_start(
    fig1b: walkers.Run,
) -> None:
    """They may still become equal."""
    is_first = fig1b.walkers.index == 0
    numbers = numbers_if_some_are_faster(fig1b, is_first, steady=False)
    assert not numbers["depends_on_start"]


def test_the_plan_of_a_sweep_has_the_runs_of_its_spread(in_folder: Path) -> None:
    """Two points with two draws each."""
    plan = call("sweep", "fig4", "--dry-run", "--spread", "--points", "2", check=True).stdout
    assert "points     2: " in plan
    assert "4 more runs, predicted " in plan
    assert not Path("runs").exists()


# --- numerical errors -------------------------------------------------------------------------

QUICK = {"time_step": "4 us", "cycles": 6, "settling_cycles": 2, "samples_per_cycle": 5}


def with_step_and_modulus(case: Case, step_factor: float, modulus_factor: float) -> Case:
    """A case with a part of its time step and a multiple of its Young's modulus."""
    microseconds = 1e6 * case.run.time_step * step_factor
    megapascals = 1e-6 * case.contact.youngs_modulus * modulus_factor
    return changed_case(
        case,
        {
            "run.time_step": f"{microseconds!r} us",
            "contact.youngs_modulus": f"{megapascals!r} MPa",
        },
    )


def harder(case: Case, factor: float) -> Case:
    """A case with harder beads; the Rayleigh limit of the time step falls as their root."""
    return with_step_and_modulus(case, factor**-0.5, factor)


@dataclass(frozen=True)
class MeasuredRun:
    """A run whose numerical errors are measured."""

    run: walkers.Run
    accuracy: dict[str, Any]

    @property
    def folder(self) -> Path:
        """The folder with the run."""
        return self.run.directory.parent

    @property
    def further_runs(self) -> Path:
        """The folder with the runs that measured its errors."""
        return self.run.directory.with_name(f"{self.run.directory.name}{ACCURACY}")


def measured_once(once: FillOnce, name: str, case: Case) -> MeasuredRun:
    """Run a case and measure its errors, once a session."""

    def measure(folder: Path) -> None:
        run = walkers.run(case, folder)
        assert "velocity_error" not in run.result
        run.accuracy()

    run = walkers.run(case, once(name, measure))
    assert run.cached
    return MeasuredRun(run, read_json(run.directory / ACCURACY_NAME))


def fig1b_at_90_hz() -> Case:
    """The walker of Fig. 1b at a frequency and an acceleration where softness matters."""
    return load_case("fig1b", {"drive.frequency": "90 Hz", "drive.peak_acceleration": "10 g"})


@pytest.fixture(scope="module")
def fast_walker(once: FillOnce) -> MeasuredRun:
    """`fig1b_at_90_hz` with its measured errors."""
    return measured_once(once, "fast-walker", fig1b_at_90_hz())


@pytest.mark.slow
def test_the_error_is_the_distance_from_far_harder_beads_at_a_far_smaller_step(
    fast_walker: MeasuredRun, tmp_path: Path
) -> None:
    """100 times as hard, at half of the step that this modulus allows: within the asked share."""
    limit_case = with_step_and_modulus(fig1b_at_90_hz(), 0.05, 100.0)
    limit = walkers.run(limit_case, tmp_path).result["velocity"]
    velocity = fast_walker.run.result["velocity"]
    change = fast_walker.accuracy["errors"]["velocity"]["stiffer"]
    assert fast_walker.accuracy["reached"]
    assert abs(velocity + change - limit) < fast_walker.accuracy["share"] * limit


@pytest.mark.slow
def test_harder_beads_walk_slower_because_the_large_one_slides_more(
    fast_walker: MeasuredRun,
) -> None:
    """The velocity falls by 0.7 %, sliding of the large bead by over twice as much.

    With Coulomb's law and edges that do not resist, both fall by three times as much.
    """
    errors = fast_walker.accuracy["errors"]
    assert errors["velocity"]["stiffer"] < -0.005 * fast_walker.run.result["velocity"]
    assert errors["sliding_1"]["stiffer"] < 2.0 * errors["velocity"]["stiffer"]


@pytest.mark.slow
def test_the_error_of_the_time_step_is_the_change_at_half_of_it(fast_walker: MeasuredRun) -> None:
    half_case = with_step_and_modulus(fig1b_at_90_hz(), 0.5, 1.0)
    half = walkers.run(half_case, fast_walker.further_runs)
    assert half.cached  # it is one of the runs that measured the errors
    error = fast_walker.accuracy["errors"]["velocity"]
    change = half.result["velocity"] - fast_walker.run.result["velocity"]
    assert error["half_step"] == pytest.approx(change)


@pytest.mark.slow
def test_the_printed_result_has_the_numerical_error(fast_walker: MeasuredRun) -> None:
    result = fast_walker.run.result
    total = fast_walker.accuracy["errors"]["velocity"]["total"]
    assert result["velocity_error"] == total
    assert result["numerical_error"] == total
    printed = printed_error(result, "velocity")
    assert f"numerical error {1e3 * total:.2g}" in printed
    assert printed in fast_walker.run.describe(verbose=True)
    first, *_ = fast_walker.run.describe().splitlines()
    assert f"mm/s, numerical error {1e3 * total:.2g}" in first


@pytest.mark.slow
def test_the_page_about_the_physics_has_the_velocities_of_harder_beads(
    fast_walker: MeasuredRun,
) -> None:
    """Of the case itself and of its harder beads; the first point of the sweep is the half step."""
    table = walkers.load(fast_walker.folder / fast_walker.accuracy["sweep"]).table()
    velocities = [fast_walker.run.result["velocity"], *table["velocity"][1:]]
    cells = " | ".join(f"{1e3 * velocity:.3f}" for velocity in velocities)
    page = (DOCS / "explanation" / "physics.md").read_text("utf-8")
    assert f"| `fig1b`, 10 g and 90 Hz | {cells} |" in page


@pytest.mark.slow
def test_a_run_is_listed_beside_the_sweep_of_its_accuracy(fast_walker: MeasuredRun) -> None:
    listing = call("list", "--out", str(fast_walker.folder), check=True).stdout
    assert f"\n{fast_walker.run.directory.name} " in listing


@pytest.mark.slow
def test_the_archive_of_a_run_has_its_accuracy(fast_walker: MeasuredRun, tmp_path: Path) -> None:
    with ZipFile(fast_walker.run.export("archive", tmp_path / "run.zip")) as archive:
        names = archive.namelist()
    assert f"runs/{fast_walker.run.directory.name}/accuracy.json" in names


@pytest.mark.slow
def test_the_files_of_a_run_with_accuracy_are_sound(fast_walker: MeasuredRun) -> None:
    call("check", "files", str(fast_walker.run.directory), check=True)


def test_numerical_errors_have_labels_and_stand_beside_their_numbers() -> None:
    assert declared("rotation_2_error").label == "rotation of bead 2, numerical error"
    in_order = ordered(["sliding_1", "rotation_2_error", "velocity"])
    assert in_order == ["velocity", "rotation_2_error", "sliding_1"]


def test_an_interrupted_accuracy_continues(tmp_path: Path) -> None:
    """It is interrupted when some of its runs are finished, which are not made again."""
    run = walkers.run(make_case(run=QUICK), tmp_path)
    manifests = f"{run.directory.name}{ACCURACY}/*/manifest.json"

    def interrupt(_: object) -> None:
        if len(list(tmp_path.glob(manifests))) > 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_accuracy(run.directory, SweepOptions(1), on_progress=interrupt)
    assert "velocity_error" not in run.result
    times = {}
    for manifest in tmp_path.glob(manifests):
        times[manifest] = manifest.stat().st_mtime_ns
    assert times
    run.accuracy()
    assert "velocity_error" in run.result
    for manifest, time in times.items():
        assert manifest.stat().st_mtime_ns == time


@pytest.fixture(scope="module")
def slope_walkers(once: FillOnce) -> MeasuredRun:
    """A walker that goes up a slope and one that goes down it, with their measured errors."""
    case = make_case(
        run=QUICK,
        boundary={"material": "glass", "tilt": "20 deg"},
        dimers={"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
    )
    return measured_once(once, "slope-walkers", case)


def velocities_with_harder_beads(measured: MeasuredRun, factor: float) -> FloatArray:
    """Velocities of both headings with harder beads, m/s."""
    result = walkers.run(harder(measured.run.case, factor), measured.folder).result
    return np.array([result["right_facing"], result["left_facing"]])


def test_walkers_up_and_down_a_slope_both_converge(slope_walkers: MeasuredRun) -> None:
    """The modulus increases fourfold until both headings change by less than 1 %."""
    previous = velocities_with_harder_beads(slope_walkers, 4.0)
    for factor in (16.0, 64.0):
        velocities = velocities_with_harder_beads(slope_walkers, factor)
        change = np.abs(velocities / previous - 1.0).max()
        if change < 0.01:
            break
        previous = velocities
    assert change < 0.01
    assert slope_walkers.accuracy["times"] == factor
    assert slope_walkers.accuracy["change"] == pytest.approx(change, rel=0.02)


@pytest.fixture
def damaged_accuracy(slope_walkers: MeasuredRun, tmp_path: Path) -> Path:
    """A copy of the run on a slope, whose accuracy.json somebody edited."""
    shutil.copytree(slope_walkers.folder, tmp_path / "runs")
    directory = tmp_path / "runs" / slope_walkers.run.directory.name
    (directory / ACCURACY_NAME).write_text('{"errors": {}}')
    return directory


def test_an_edited_accuracy_is_told_in_one_line(damaged_accuracy: Path) -> None:
    process = call("run", str(damaged_accuracy))
    assert process.returncode == 2
    assert process.stderr.count("\n") == 1
    assert process.stderr.endswith(
        f"damaged; measure it again with: walkers run {damaged_accuracy} --accuracy\n"
    )


def test_an_edited_accuracy_can_be_measured_again(
    damaged_accuracy: Path, slope_walkers: MeasuredRun
) -> None:
    """Its runs are finished, so the numbers are the same as before."""
    process = call("run", str(damaged_accuracy), "--accuracy", "--json", check=True)
    numbers = json.loads(process.stdout.splitlines()[-1])
    errors = slope_walkers.accuracy["errors"]
    assert numbers["right_facing_error"] == errors["right_facing"]["total"]
    assert numbers["left_facing_error"] == errors["left_facing"]["total"]


def make_steel_case(megapascals: float) -> Case:
    """Two steel beads with a Young's modulus, which may be at most 100 GPa."""
    return build_case(
        {
            "dimers": {"diameters": ["10 mm", "7 mm"], "replicates": 1},
            "beads": {"material": "chrome steel"},
            "liquid": {"name": "glycerol"},
            "boundary": {"material": "glass"},
            "contact": {"youngs_modulus": f"{megapascals} MPa"},
            "drive": {"frequency": "60 Hz", "peak_acceleration": "5 g"},
            "run": {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5},
        },
        name="steel",
    )


@pytest.mark.parametrize(
    ("megapascals", "factors"),
    [
        (200.0, [1.0, 4.0, 16.0, 64.0, 256.0]),
        (800.0, [1.0, 4.0, 16.0, 64.0, 125.0]),  # 125 · 800 MPa = 100 GPa
        (6250.0, [1.0, 4.0, 16.0]),
        (51200.0, [1.0, 1.953125]),
        (90000.0, [1.0]),  # 100 GPa is an increase by less than a quarter
    ],
)
def test_beads_are_compared_with_the_hardest_possible(
    megapascals: float, factors: list[float]
) -> None:
    """Factors of four, at most 256, and at last the one that leads to 100 GPa."""
    assert modulus_factors(make_steel_case(megapascals)) == factors


@pytest.fixture(scope="module")
def steel(once: FillOnce) -> MeasuredRun:
    """Beads of 51.2 GPa, which can be 1.95 times as hard."""
    return measured_once(once, "steel", make_steel_case(51200.0))


@pytest.fixture(scope="module")
def hardest_steel(once: FillOnce) -> MeasuredRun:
    """Beads of 90 GPa, which cannot be harder."""
    return measured_once(once, "hardest-steel", make_steel_case(90000.0))


def test_errors_are_changes_at_half_the_step_and_with_harder_beads(steel: MeasuredRun) -> None:
    half = walkers.run(with_step_and_modulus(steel.run.case, 0.5, 1.0), steel.further_runs)
    hard = walkers.run(harder(steel.run.case, 1.953125), steel.further_runs)
    assert half.cached
    assert hard.cached
    velocity = steel.run.result["velocity"]
    error = steel.accuracy["errors"]["velocity"]
    assert velocity + error["half_step"] == pytest.approx(half.result["velocity"], rel=1e-12)
    assert velocity + error["stiffer"] == pytest.approx(hard.result["velocity"], rel=1e-12)
    change = abs(error["stiffer"]) / hard.result["velocity"]
    assert steel.accuracy["change"] == pytest.approx(change)
    assert steel.accuracy["times"] == 1.953125


def test_the_total_error_is_the_root_of_the_sum_of_squares(steel: MeasuredRun) -> None:
    error = steel.accuracy["errors"]["velocity"]
    assert error["total"] == pytest.approx(hypot(error["half_step"], error["stiffer"]))


def test_the_error_of_beads_that_cannot_be_harder_is_that_of_the_time_step(
    hardest_steel: MeasuredRun,
) -> None:
    half_case = with_step_and_modulus(hardest_steel.run.case, 0.5, 1.0)
    half = walkers.run(half_case, hardest_steel.further_runs)
    assert half.cached
    change = half.result["velocity"] - hardest_steel.run.result["velocity"]
    error = hardest_steel.accuracy["errors"]["velocity"]
    assert error["half_step"] == pytest.approx(change, rel=1e-9)
    assert error["stiffer"] == 0.0
    assert hardest_steel.accuracy["times"] == 1.0
    assert hardest_steel.accuracy["change"] == 0.0


WARNING = "warning: the beads cannot be harder"


def test_a_result_of_beads_that_cannot_be_harder_warns(hardest_steel: MeasuredRun) -> None:
    assert WARNING in hardest_steel.run.describe()


def test_a_result_of_beads_that_can_be_harder_does_not_warn(steel: MeasuredRun) -> None:
    assert WARNING not in steel.run.describe()
