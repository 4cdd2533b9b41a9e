"""What a velocity is uncertain by: guesses, scatter of copies, numerical errors; and what is printed."""

from __future__ import annotations

import json
import re
import shutil
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest

import walkers
from tests.conftest import call, make_case
from walkers.commands.catalogue import catalogue
from walkers.files import write_json
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving import library
from walkers.inputs.tables.case import Case
from walkers.inputs.units import parse_quantity
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.measure.numbers import headline, not_all_upright, rows
from walkers.postprocess.measure.quantities import declared, ordered
from walkers.postprocess.measure.results import NotComputed, headlines, not_computed, text
from walkers.postprocess.measure.tables import read_columns
from walkers.postprocess.measure.uncertainty import SPREAD_NAME, spread_of
from walkers.postprocess.measure.walking import _velocities
from walkers.rounding import rounded
from walkers.runs.case_text import quantity_kind
from walkers.sweeps.accuracy import measure_accuracy, modulus_factors
from walkers.sweeps.listing import inventory, listing_text
from walkers.sweeps.scheduler import SweepOptions
from walkers.sweeps.table import default_column
from walkers.theory.prediction import predict
from walkers.theory.prediction_text import prediction_text


def test_what_is_usual_lies_within_its_range() -> None:
    """Strictly, but for a contact angle of 0°, the end of what is possible."""
    numbers = {key: (one, one.range) for key, one in library.unmeasured().items()}
    for entry in catalogue():
        if entry.kind == "surface pairs":
            known = {key: one for key, one in entry.numbers.items() if one.range}
            numbers |= {
                f"contact.{key} of {entry.name}": (one, one.range) for key, one in known.items()
            }
    assert len(numbers) > 10
    for key, (known, ends) in numbers.items():
        assert known is not None
        assert ends is not None
        kind = quantity_kind(
            key.partition(" of ")[0].replace("contact.meniscus", "liquid.meniscus")
        )
        value, low, high = (
            parse_quantity(one, kind) if kind else one for one in (known.written, *ends)
        )
        assert low < value < high or (key == "liquid.contact_angle" and value == low == 0.0), key


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
def steep(tmp_path_factory: pytest.TempPathFactory) -> walkers.Run:
    """Two dimers on a slope of 20°, one that faces up and one that faces down; the only run of its folder."""
    return walkers.run(build_case(SLOPE, name="steep"), tmp_path_factory.mktemp("steep"))


def test_walkers_that_face_up_and_down_a_slope_differ(steep: walkers.Run) -> None:
    """Each of both has one velocity, and the mean over both is no walker's."""
    result = steep.result
    up, down = steep.walkers.sort_values("facing", ascending=False)["velocity"]
    assert (result["right_facing"], result["left_facing"]) == (up, down)
    assert up < down
    assert result["facings_differ"]
    assert np.isnan([result["right_scatter"], result["left_scatter"]]).all()


def test_a_slope_is_in_the_headline_of_a_run_and_of_its_report(
    steep: walkers.Run, tmp_path: Path
) -> None:
    assert "plane tilted by 20°, right is up" in steep.describe()
    assert "plane tilted by 20°" in steep.report(tmp_path / "report.html").read_text("utf-8")


def test_the_theory_is_beside_the_engines_walkers_that_face_up(steep: walkers.Run) -> None:
    lines = prediction_text(predict(steep.case), steep.result).splitlines()
    (engine,) = [line.split() for line in lines if line.startswith("engine")]
    assert engine[:3] == ["engine,", "facing", "up"]
    assert float(engine[3]) == pytest.approx(1e3 * steep.result["right_facing"], abs=1e-3)


def test_the_printed_result_of_a_slope_has_the_velocities_of_both_ways(steep: walkers.Run) -> None:
    shown = {row.name: row.text for row in rows(steep.result)}
    assert "velocity" not in shown
    for name in ("axial_velocity", "axial_left_facing"):
        assert float(shown[name]) == float(rounded(1e3 * steep.result[name], "mm/s"))


def test_the_inventory_has_the_velocities_of_both_ways(steep: walkers.Run) -> None:
    up, down = (
        rounded(1e3 * steep.result[name], "mm/s") for name in ("right_facing", "left_facing")
    )
    assert f" {up} mm/s facing up, {down} facing down " in listing_text(
        inventory(steep.directory.parent)
    )


@pytest.mark.parametrize(("name", "shown"), [("right_facing", True), ("velocity", False)])
def test_on_a_slope_the_band_of_a_spread_is_that_of_one_way(
    steep: walkers.Run, name: str, shown: bool
) -> None:
    """It is widened to the result of the case itself; that of the mean over both ways is not printed."""
    own = steep.result["right_facing"]
    spread = spread_of(steep.directory.resolve())
    spread.mkdir()
    try:
        band = {"low": own - 1e-3, "high": own - 1e-4, "points": 64}
        write_json(
            spread / SPREAD_NAME, {"varied": steep.result.about["rests_on"], "bands": {name: band}}
        )
        assert (steep.result[f"{name}_low"], steep.result[f"{name}_high"]) == (own - 1e-3, own)
        errors = {row.name: row.error for row in rows(steep.result)}
        assert errors["right_facing"].endswith("(64 draws)") == shown
    finally:
        shutil.rmtree(spread)


def test_slopes_are_compared_by_the_walkers_that_face_up(
    steep: walkers.Run, tmp_path: Path
) -> None:
    tables = {**SLOPE, "boundary": {"material": "glass", "tilt": "10 deg"}}
    gentle = walkers.run(build_case(tables, name="gentle"), tmp_path)
    text = walkers.compare(steep.directory, gentle.directory).text
    assert "\nright_facing (mm/s)" in text
    assert "\nvelocity (mm/s)" not in text


def test_the_main_number_of_points_depends_on_what_their_walkers_do(steep: walkers.Run) -> None:
    """Of walkers that turned over it is the velocity up the slope, at one point of a sweep for all."""
    result = dict(steep.result)
    level = {**result, "facings_differ": False}
    turned = {**result, "turned_round": 1, "upright": 1, "turned_over": 1}
    for points, column in (
        ([result], "right_facing"),
        ([level], "velocity"),
        ([result, turned], "axial_velocity"),
    ):
        assert default_column(pd.DataFrame(points)) == column
        assert headline(points[-1]) == column


def test_a_pile_that_climbs_has_not_fallen() -> None:
    assert not not_all_upright({"goes_uphill": True, "climbs": 0})


def test_the_final_angle_is_printed_unless_some_walkers_turned_over(steep: walkers.Run) -> None:
    """A mean over those that did and those that did not is no walker's; of one walker there is no range."""
    result = dict(steep.result)
    turned = {**result, "turned_round": 1, "upright": 1, "turned_over": 1}
    assert "orientation_end" in {row.name for row in rows(result)}
    assert "orientation_end" not in {row.name for row in rows(turned)}
    low, high = (rounded(np.degrees(end), "°") for end in sorted(steep.walkers["orientation_end"]))
    for number, expected in ((2, f"walkers {low} to {high}"), (1, "")):
        errors = {row.name: row.error for row in rows({**result, "walkers": number})}
        assert errors["orientation_end"] == expected


def test_clusters_on_a_slope_are_averaged_by_the_way_they_face_and_lean_by_how_far_they_turned(
    tmp_path: Path,
) -> None:
    """Not by the angle between the way that they face and their beads in front, which the arrangement contains."""
    steep = {**FOUR_BEADS, "boundary": {"material": "glass", "tilt": "30 deg"}}
    done = walkers.run(build_case(steep, name="four"), tmp_path)
    result, each = done.result, done.walkers
    up, down = (each[each["facing"] == way] for way in (1, -1))
    assert (result["climbing"], result["descending"]) == (1, 1)
    assert int((each["axial_velocity"] > 2e-6).sum()) == 1
    assert result["velocity"] == pytest.approx(up["velocity"].mean())
    assert result["axial_velocity"] == pytest.approx(up["axial_velocity"].mean())
    assert result["axial_left_facing"] == pytest.approx(down["axial_velocity"].mean())
    np.testing.assert_allclose(
        done.trajectory.groupby("walker")["orientation"].first(), each["start_angle"], atol=2e-3
    )
    heading = read_motion(done.directory).groups[0].heading[[0, -1]]
    turned = np.abs(
        np.diff(np.unwrap(np.arctan2(heading[..., 1], heading[..., 0]), axis=0), axis=0)
    )
    assert result["ends_within"] == pytest.approx(turned.max(), abs=np.radians(2.0))


FOUR_BEADS = {
    "clusters": [
        {
            "radii": ["0.5 mm", "0.3 mm", "0.3 mm", "0.3 mm"],
            "at": [
                *(["0 mm", "0 mm"], ["-0.67075 mm", "0.38726 mm"]),
                *(["-0.7461 mm", "-0.20777 mm"], ["-0.37418 mm", "-0.6782 mm"]),
            ],
            "replicates": 2,
        }
    ],
    "beads": {"material": "glass"},
    "liquid": {"name": "glycerol 87 %", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.005},
    "drive": {"frequency": "170 Hz", "peak_acceleration": "10 g"},
    "run": {"cycles": 24, "settling_cycles": 8},
}
"""A cluster whose beads in front are 13° beside the way that it faces."""


def test_walkers_that_came_apart_have_no_velocity_and_are_not_steady_anywhere_in_the_text(
    runs_folder: Path,
) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    columns = read_columns(done.directory, "walkers")
    columns["separated_fraction"] = columns["separated_fraction"] + 0.5
    apart = done.result
    apart |= _velocities(columns, done.case)
    assert apart["came_apart"]
    assert headlines(apart)[0].endswith(": came apart")
    assert "velocity" in [row.name for row in rows(done.result)]
    assert not [row.name for row in rows(apart) if re.search("velocity|facing|steady", row.name)]
    assert not_computed(done.result)
    assert not not_computed(apart)


def test_what_is_not_computed_stands_right_below_the_head_of_a_result(runs_folder: Path) -> None:
    """Six values of Fig. 1b have a range; no option has been used."""
    done = walkers.run(load_case("fig1b"), runs_folder)
    lines = done.describe().splitlines()
    assert (
        lines[1]
        == "  uncertainty not computed: 6 uncertain values (--spread), numerical error (--accuracy)"
    )
    assert not_computed(done.result) == NotComputed(uncertain_values=6, numerical_error=True)


def test_scatter_of_copies_is_named_as_such(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    (velocity,) = [row for row in rows(done.result) if row.name == "velocity"]
    assert velocity.error == "scatter of copies below 0.001"


def test_a_band_tells_that_it_leaves_out_the_error_of_the_model(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    note = "of uncertain values only; the error of the model is not in it"
    assert note not in done.describe()
    result = done.result
    result |= {
        "velocity_low": 1e-3,
        "velocity_high": 3e-3,
        "velocity_draws": 32,
        "velocity_approximate": False,
    }
    described = text(result)
    assert note in described
    assert "uncertain values (--spread)" not in described


def test_a_result_that_depends_on_the_start_says_so(runs_folder: Path) -> None:
    """Of steady copies on a level floor those that face left are faster by 40 %, or those of one side differ."""
    done = walkers.run(load_case("fig1b"), runs_folder)
    assert not done.result["depends_on_start"]
    columns = read_columns(done.directory, "walkers")
    left = columns["facing"] < 0
    for faster in (left, np.arange(len(left)) == 0):
        changed = {**columns, "velocity": np.where(faster, 1.4, 1.0) * columns["velocity"]}
        numbers = _velocities(changed, done.case)
        assert numbers["depends_on_start"]
        assert not _velocities({**changed, "steady": ~columns["steady"]}, done.case)[
            "depends_on_start"
        ]


ROOT = Path(__file__).parent.parent
QUICK = {"time_step": "4 us", "cycles": 6, "settling_cycles": 2, "samples_per_cycle": 5}
PAIR = {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}


def changed(case: Case, shorter: float, harder: float) -> Case:
    """A case with a part of its time step and a multiple of its modulus."""
    step, modulus = 1e6 * case.run.time_step * shorter, 1e-6 * case.contact.youngs_modulus * harder
    return changed_case(
        case, {"run.time_step": f"{step!r} us", "contact.youngs_modulus": f"{modulus!r} MPa"}
    )


@pytest.mark.slow
def test_the_error_is_the_distance_from_far_harder_beads_at_a_far_smaller_step(
    tmp_path: Path,
) -> None:
    """100 times as hard, at half the step that the modulus allows: within the share that was asked for."""
    case = load_case("fig1b", {"drive.frequency": "90 Hz", "drive.peak_acceleration": "10 g"})
    done, reference = (walkers.run(one, tmp_path) for one in (case, changed(case, 0.05, 100.0)))
    own, limit = (run.result["velocity"] for run in (done, reference))
    assert "velocity_error" not in done.result
    found = done.accuracy()
    error = found["errors"]["velocity"]
    assert found["reached"]
    assert abs(own + error["stiffer"] - limit) < found["share"] * limit
    assert error["stiffer"] < -0.01 * own  # the limit is slower …
    half = walkers.run(changed(case, 0.5, 1.0), tmp_path)
    assert half.cached  # it is one of the runs
    assert error["half_step"] == pytest.approx(half.result["velocity"] - own)
    assert error["total"] == pytest.approx(hypot(error["half_step"], error["stiffer"]))
    # … because the large bead slides more.
    assert found["errors"]["sliding_1"]["stiffer"] < 2.0 * error["stiffer"]
    assert done.result["velocity_error"] == done.result["numerical_error"] == error["total"]
    speeds = walkers.load(tmp_path / found["sweep"]).table()["velocity"]
    cells = " | ".join(f"{1e3 * one:.3f}" for one in (own, *speeds[1:]))
    assert f"| `fig1b`, 10 g and 90 Hz | {cells} |" in (
        ROOT / "docs/explanation/physics.md"
    ).read_text("utf-8")
    assert (
        declared("rotation_2_error").label == "rotation of bead 2, numerical error"
    )  # also in the table of a sweep
    assert ordered(["sliding_1", "rotation_2_error", "velocity"]) == [
        "velocity",
        "rotation_2_error",
        "sliding_1",
    ]
    (row,) = (row for row in rows(done.result) if row.name == "velocity")
    assert f"numerical error {1e3 * error['total']:.2g}" in row.error
    assert row.error in done.describe()
    assert (
        f"\n{done.directory.name} " in call("list", "--out", str(tmp_path), check=True).stdout
    )  # beside the sweep
    with ZipFile(done.export("archive", tmp_path / "run.zip")) as archive:
        assert f"runs/{done.directory.name}/accuracy.json" in archive.namelist()
    call("check", "files", str(done.directory), check=True)


def test_an_interrupted_accuracy_continues_and_an_edited_one_can_be_measured_again(
    tmp_path: Path,
) -> None:
    done = walkers.run(make_case(run=QUICK), tmp_path)

    def stop(_: object) -> None:
        if len([*tmp_path.glob("*/manifest.json")]) > 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_accuracy(done.directory, SweepOptions(1), on_progress=stop)
    assert "velocity_error" not in done.result
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/manifest.json")}
    assert len(before) >= 2
    kept = done.accuracy()
    del before[done.directory / "manifest.json"]  # it lists the new file
    assert before == {path: path.stat().st_mtime_ns for path in before}
    (done.directory / "accuracy.json").write_text('{"errors": {}}')
    told = call("run", str(done.directory))
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert told.stderr.endswith(
        f"damaged; measure it again with: walkers run {done.directory} --accuracy\n"
    )
    again = call("run", str(done.directory), "--accuracy", "--json", check=True)
    assert (
        json.loads(again.stdout.splitlines()[-1])["velocity_error"]
        == kept["errors"]["velocity"]["total"]
    )


def test_walkers_up_and_down_a_slope_both_converge(tmp_path: Path) -> None:
    case = make_case(run=QUICK, boundary={"material": "glass", "tilt": "20 deg"}, dimers=PAIR)
    done = walkers.run(case, tmp_path)
    found = done.accuracy()
    speeds = [
        [run[f"{way}_facing"] for way in ("right", "left")]
        for run in (
            walkers.run(changed(case, times**-0.5, times), tmp_path).result
            for times in (4.0, 16.0, 64.0)
        )
    ]
    changes = [
        max(abs(after / before - 1.0) for before, after in zip(*pair, strict=True))
        for pair in pairwise(speeds)
    ]
    times, change = next(
        (16.0 * 4.0**place, one) for place, one in enumerate(changes) if one < 0.01
    )
    assert found["times"] == times
    assert found["change"] == pytest.approx(change, rel=0.02)


@pytest.mark.parametrize(
    ("modulus", "times"),
    [
        *((200.0, [1.0, 4.0, 16.0, 64.0, 256.0]), (800.0, [1.0, 4.0, 16.0, 64.0, 125.0])),
        *((6250.0, [1.0, 4.0, 16.0]), (51200.0, [1.0, 1.953125]), (90000.0, [1.0])),
    ],
)
def test_beads_are_compared_with_the_hardest_possible(
    modulus: float, times: list[float], tmp_path: Path
) -> None:
    """Those of 90 GPa cannot be harder: their error is that of the time step alone, and the result says so."""
    case = build_case(
        {
            "dimers": {"diameters": ["10 mm", "7 mm"], "replicates": 1},
            "beads": {"material": "chrome steel"},
            "liquid": {"name": "glycerol"},
            "boundary": {"material": "glass"},
            "contact": {"youngs_modulus": f"{modulus} MPa"},
            "drive": {"frequency": "60 Hz", "peak_acceleration": "5 g"},
            "run": {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5},
        },
        name="steel",
    )
    assert modulus_factors(case) == times
    if len(times) > 2:
        return
    done = walkers.run(case, tmp_path)
    own, found = done.result["velocity"], done.accuracy()
    error = found["errors"]["velocity"]
    half, harder = (
        walkers.run(changed(case, *how), tmp_path)
        for how in ((0.5, 1.0), (times[-1] ** -0.5, times[-1]))
    )
    assert half.cached and harder.cached
    assert (own + error["half_step"], own + error["stiffer"]) == pytest.approx(
        (half.result["velocity"], harder.result["velocity"]), rel=1e-12
    )
    assert found["times"] == times[-1]
    assert found["change"] == pytest.approx(abs(error["stiffer"]) / harder.result["velocity"])
    assert ("warning: the beads cannot be harder" in done.describe()) == (times == [1.0])


def test_the_plan_of_a_sweep_has_the_runs_of_its_spread(in_folder: Path) -> None:
    plan = call("sweep", "fig4", "--dry-run", "--spread", "--points", "2", check=True).stdout
    assert "points     2: " in plan
    assert "4 more runs, predicted " in plan
    assert not Path("runs").exists()
