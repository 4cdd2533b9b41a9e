"""What a velocity is uncertain by: ranges about what is guessed, scatter of copies; and what is printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import walkers
from tests.conftest import make_case
from walkers.commands.catalogue import catalogue
from walkers.errors import InputError
from walkers.inputs import library
from walkers.inputs.axes import ranges_of
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.inputs.units import parse_quantity
from walkers.paper.published import outside_of_the_paper
from walkers.postprocess.analyses.walking import _summary
from walkers.postprocess.analysis import describe_result, quantities_of
from walkers.postprocess.motion import read_motion
from walkers.postprocess.sides import fell, sides_apart, uphill_velocities
from walkers.postprocess.tables import read_columns
from walkers.postprocess.uncertainty import band_text
from walkers.rounding import rounded, with_decimals
from walkers.sweeps.folder import as_text, inventory
from walkers.sweeps.readable import kind_of
from walkers.sweeps.table import default_column, row_of
from walkers.theory.prediction import describe, predict


def test_what_is_usual_lies_within_its_range() -> None:
    """Strictly, but for a contact angle of 0°, the end of what is possible."""
    numbers = {key: (one, one.range) for key, one in library.unmeasured().items()}
    for entry in catalogue(of_others=False):
        if entry.kind == "surface pairs":
            known = {key: one for key, one in entry.numbers.items() if one.range}
            numbers |= {f"contact.{key} of {entry.name}": (one, one.range) for key, one in known.items()}
    assert len(numbers) > 15
    for key, (known, ends) in numbers.items():
        assert known is not None
        assert ends is not None
        kind = kind_of(key) if key == "liquid.contact_angle" else None
        value, low, high = (parse_quantity(one, kind) if kind else one for one in (known.written, *ends))
        assert low < value < high or (key == "liquid.contact_angle" and value == low == 0.0), key


@pytest.mark.parametrize(
    ("given", "quartiles"),
    [
        ({"uniform": [0.0, 4.0]}, [1.0, 2.0, 3.0]),
        ({"uniform": [0.0, 1.0, 4.0]}, [0.5, 1.0, 2.5]),
        ({"loguniform": [0.01, 1.0, 100.0]}, [0.1, 1.0, 10.0]),
        ({"uniform": ["0 deg", "0 deg", "60 deg"]}, [0.0, 0.0, 30.0]),
    ],
)
def test_half_of_the_draws_are_below_the_median(given: dict[str, list[object]], quartiles: list[float]) -> None:
    (one,) = ranges_of({"key": given}).values()
    np.testing.assert_allclose(one.at(np.array([0.25, 0.5, 0.75])), quartiles)


@pytest.mark.parametrize("given", [[1.0, 3.0, 2.0], [1.0, 0.5, 2.0], [1.0, 1.2, 1.5, 2.0], [2.0, 1.0]])
def test_a_median_is_between_the_ends(given: list[float]) -> None:
    with pytest.raises(InputError, match="expected"):
        ranges_of({"key": {"uniform": given}})


def test_people_read_four_digits_and_each_number_by_its_name(runs_folder: Path) -> None:
    told = walkers.run(load_case("fig1b"), runs_folder).describe()
    assert "±" not in told
    assert "standard error" not in told
    lines = [line for line in told.splitlines() if not line.startswith("  run ")]
    numbers = re.findall(r"(?<![\w.])\d+\.?\d*(?:e-?\d+)?", "\n".join(lines))
    assert len(numbers) > 30
    assert not [one for one in numbers if len(one.partition("e")[0].replace(".", "").strip("0")) > 4]
    assert "scatter of the 6 copies 0.001 mm/s (standard deviation; 1.079 to 1.082 mm/s)" in told


def test_a_slope_is_in_the_headline_and_its_walkers_face_up(tmp_path: Path) -> None:
    tables = {
        "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
        "beads": {"material": "ruby"},
        "liquid": {"surface_tension": "20 mN/m", "kinematic_viscosity": "5 mm^2/s", "density": "0.9 g/cm^3"},
        "boundary": {"material": "glass", "tilt": "20 deg"},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        "contact": {"rolling_friction": 0.0},
        "run": {"cycles": 4},
    }
    case = Case.read(tables, name="steep")
    done = walkers.run(case, tmp_path)
    told = done.describe()
    assert "plane tilted by 20°, right is up" in told
    assert "scatter of" not in told  # of one walker a side there is none
    sides = sides_apart(done.result)
    up, down = (rounded(1e3 * speed, "mm/s") for speed in uphill_velocities(done.result).values())
    assert list(sides) == ["up", "down"]
    (engine,) = (line for line in describe(predict(case), done.result).splitlines() if line.startswith("engine"))
    assert engine.split()[:3] == ["engine,", "facing", "up"]
    assert float(engine.split()[3]) == pytest.approx(1e3 * sides["up"], abs=1e-3)
    assert f"facing up {up}, facing down {down} mm/s, positive up the slope" in told
    assert f"started up {up}, started down {down} mm/s" in as_text(inventory(tmp_path))
    # The band of a spread is that of one side, or is left out.
    band = {"low": sides["up"] - 1e-3, "high": sides["up"] + 1e-3, "points": 64}
    of_up, of_mean = (
        describe_result(done.directory, {**done.result, "bands": {name: band}}) for name in ("right_facing", "velocity")
    )
    assert f" mm/s ({band_text((band['low'], band['high']), 'm/s')}, 5 to 95 % over" in of_up
    assert "5 to 95 %" not in of_mean
    assert "no band: the spread has that of the mean over both ways" in of_mean
    page = done.report(tmp_path / "report.html").read_text("utf-8")
    assert "liquid of 20 mN/m; 80 Hz" in page
    assert "plane tilted by 20°" in page
    gentle = Case.read({**tables, "boundary": {"material": "glass", "tilt": "10 deg"}}, name="gentle")
    walkers.run(gentle, tmp_path)
    text = walkers.compare(*(walkers.load(one, tmp_path).directory for one in (case, gentle))).text
    assert "along the heading, facing up (mm/s)" in text
    assert "right_facing" not in text
    assert "\nvelocity (mm/s)" not in text  # the mean over both is no walker's
    frame = pd.DataFrame([row_of(done.result)])
    assert default_column(frame) == "right_facing"
    assert default_column(frame.drop(columns="upright")) == "velocity"
    # Of walkers that turned over it is the velocity up the slope that counts.
    result = {**done.result, "turned_round": 1, "posture": {**done.result["posture"], "upright": 1, "turned over": 1}}
    up, down = (done.result["axial_velocity"][f"{way}_facing"] for way in ("right", "left"))
    assert uphill_velocities(result) == {"axial, started up": up, "started down": down}
    assert default_column(pd.DataFrame([row_of(result)])) == "axial_velocity"
    assert not fell({"goes_uphill": True, "climbs": []})  # a pile
    band = {"low": -1e-2, "high": 1e-2, "points": 64}
    text = describe_result(done.directory, {**result, "bands": {"axial_velocity": band, "right_facing": band}})
    assert "velocity up the slope -10 to 10 mm/s over the ranges" in text
    assert "mm/s, positive toward" not in text


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, None),
        ({"drive.peak_acceleration": "40 g"}, "Γ0 = 3.81 (measured up to 3.5), 40 g (up to 10 g)"),
        ({"drive.frequency": "170 Hz"}, "170 Hz (60 to 90 Hz)"),
    ],
)
def test_theory_says_where_the_paper_measured_nothing(changes: dict[str, str], told: str | None) -> None:
    case = load_case("fig1b", changes)
    found = outside_of_the_paper(case)
    assert found is None if told is None else told in (found or "")
    described = describe({**predict(case), "outside": found}, None)
    assert ("outside the paper's measurements" in described) == (told is not None)


def test_theory_says_nothing_of_the_papers_fit_to_other_beads() -> None:
    case = make_case(liquid={"name": "ethylene glycol"})
    told = describe(predict(case), None)
    assert re.search(r"paper's fit, κ = 0.033 s/mm\s+-\s+the fit is to ruby on level", told)


FOUR_BEADS = {
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
    "liquid": {"name": "glycerol 87 %", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.005},
    "drive": {"frequency": "170 Hz", "peak_acceleration": "10 g"},
    "run": {"cycles": 24, "settling_cycles": 8},
}
"""A cluster whose beads in front are 13° beside the way that it faces."""


def test_no_mean_over_clusters_that_face_up_and_down_a_slope(tmp_path: Path) -> None:
    steep = {**FOUR_BEADS, "boundary": {"material": "glass", "tilt": "30 deg"}}
    done = walkers.run(Case.read(steep, name="four"), tmp_path)
    told, result, each = done.describe(), done.result, done.walkers
    up, down = (each[each["facing"] == way] for way in (1, -1))
    climbing = int((each["axial_velocity"] > 2e-6).sum())
    assert climbing == 1
    assert told.startswith("four: 1 climbs, 1 goes down; ")
    posture = {**result["posture"], "climb": 0, "down": 2}
    assert describe_result(done.directory, {**result, "posture": posture}).startswith("four: all 2 go down; ")
    assert result["velocity"]["mean"] == pytest.approx(up["velocity"].mean())
    assert result["axial_velocity"]["mean"] == pytest.approx(up["axial_velocity"].mean())
    assert result["axial_velocity"]["left_facing"] == pytest.approx(down["axial_velocity"].mean())
    speeds = [rounded(1e3 * one["axial_velocity"].mean(), "mm/s") for one in (up, down)]
    assert re.search("velocity +facing up {}0*, facing down {}0* mm/s, positive up the slope".format(*speeds), told)
    assert "along the heading" not in told
    # A sweep that begins on a level floor is drawn by the same walkers.
    level = walkers.run(Case.read({**FOUR_BEADS, "boundary": {"material": "glass"}}, name="level"), tmp_path)
    rightward = level.walkers[level.walkers["facing"] == 1]["axial_velocity"].mean()
    assert row_of(level.result)["axial_velocity"] == pytest.approx(rightward) != 0.0


def test_a_cluster_leans_by_how_far_it_turned(tmp_path: Path) -> None:
    """Not by the angle between the way that it faces and its beads in front, which its arrangement contains."""
    steep = {**FOUR_BEADS, "boundary": {"material": "glass", "tilt": "30 deg"}}
    done = walkers.run(Case.read(steep, name="four"), tmp_path)
    begin = done.trajectory.groupby("walker")["orientation"].first()
    np.testing.assert_allclose(begin, done.walkers["start_angle"], atol=2e-3)
    heading = read_motion(done.directory).groups[0].heading[[0, -1]]
    turned = np.abs(np.diff(np.unwrap(np.arctan2(heading[..., 1], heading[..., 0]), axis=0), axis=0))
    assert done.result["posture"]["ends_within"] == pytest.approx(turned.max(), abs=np.radians(2.0))


def test_walkers_that_came_apart_have_no_velocity_anywhere_in_the_text(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    told = describe_result(done.directory, {**done.result, "separated_fraction": 0.5})
    assert "velocity   none: walkers came apart: beads beyond the rupture distance for 50 % of the time" in told
    for words in ("started facing", "steady (", "scatter", "numerical error"):
        assert words in done.describe()
        assert words not in told
    names = [row.name for row in quantities_of({**done.result, "separated_fraction": 0.5})]
    assert not [name for name in names if name.startswith("velocity")]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.21351388, "0.214"), (12.3446, "12.34"), (0.0124996, "0.012"), (9.9996, "10"), (99.996, "100")],
)
def test_a_number_is_rounded_once(value: float, text: str) -> None:
    assert rounded(value, "mm/s") == text
    assert float(with_decimals(value, 3)) == float(text)


def test_a_result_that_depends_on_the_start_says_so(runs_folder: Path) -> None:
    """Of steady copies on a level floor those that face left are faster by 40 %, or those of one side differ."""
    done = walkers.run(load_case("fig1b"), runs_folder)
    assert not done.result["depends_on_start"]
    columns = read_columns(done.directory, "walkers")
    left = columns["facing"] < 0
    for faster in (left, np.arange(len(left)) == 0):
        changed = {**columns, "velocity": np.where(faster, 1.4, 1.0) * columns["velocity"]}
        found = {**done.result, **_summary(changed, done.case)}
        assert found["depends_on_start"]
        told = describe_result(done.directory, found)
        assert "; depends on the start\n" in told
        assert "warning: steady copies differ by more than 5 %: the velocity depends on the start" in told
        assert not _summary({**changed, "steady": ~columns["steady"]}, done.case)["depends_on_start"]


def test_the_velocity_says_how_many_walkers_turned(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    assert "turned by" not in done.describe()
    told = describe_result(done.directory, {**done.result, "turned_round": 2})
    assert "1.080 mm/s, positive toward the large bead; 2 of 6 turned by more than 90°" in told


def test_shares_of_open_contacts_say_their_resolution_and_work_whose_it_is(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    open_ones = dict.fromkeys(done.result["open"], 0.229)
    told = describe_result(done.directory, {**done.result, "open": open_ones})
    assert "22.9 % of the time, in steps of 0.5 %" in told
    assert "inertial work of the drive per cycle" in told


def test_texts_of_results_are_as_wide_as_a_page(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    long = {**done.result, "goes_uphill": True, "drive": "plane tilted by 20°, right is up, " * 5}
    told = describe_result(done.directory, long, cached=True).splitlines()
    assert "(already run)" in "".join(told[:3])
    assert not [line for line in told if len(line) > 110 and str(done.directory) not in line]
