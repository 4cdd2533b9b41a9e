"""What a velocity is uncertain by: ranges about what is guessed, scatter of copies; and what is printed."""

from __future__ import annotations

import re
from dataclasses import replace
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
from walkers.postprocess.motion import read_motion
from walkers.postprocess.numbers import fell, headline, rows
from walkers.postprocess.results import headlines, text
from walkers.postprocess.tables import read_columns
from walkers.postprocess.uncertainty import SPREAD_NAME, spread_of
from walkers.postprocess.walking import _velocities
from walkers.rounding import rounded, with_decimals
from walkers.runner.files import write_json
from walkers.sweeps.folder import as_text, inventory
from walkers.sweeps.readable import kind_of
from walkers.sweeps.table import default_column
from walkers.theory.prediction import describe, outside_of_the_paper, predict


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
    lines = [line for line in told.splitlines() if not line.startswith("  run ")]
    numbers = re.findall(r"(?<![\w.])\d+\.?\d*(?:e-?\d+)?", "\n".join(lines))
    assert len(numbers) > 30
    assert not [one for one in numbers if len(one.partition("e")[0].replace(".", "").strip("0")) > 4]
    assert re.search(r"  velocity along the heading +1.080 mm/s  scatter 0.001\n", told)


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
    assert "plane tilted by 20°, right is up" in done.describe()
    result = done.result
    assert np.isnan([result["right_scatter"], result["left_scatter"]]).all()  # one walker a side
    assert result["facings_differ"]
    assert headline(result) == "right_facing"
    up, down = (rounded(1e3 * result[name], "mm/s") for name in ("axial_velocity", "axial_left_facing"))
    (engine,) = (line for line in describe(predict(case), result).splitlines() if line.startswith("engine"))
    assert engine.split()[:3] == ["engine,", "facing", "up"]
    assert float(engine.split()[3]) == pytest.approx(1e3 * result["right_facing"], abs=1e-3)
    shown = {row.name: row.text for row in rows(result)}
    assert "velocity" not in shown
    assert [float(shown[name]) for name in ("axial_velocity", "axial_left_facing")] == [float(up), float(down)]
    assert " mm/s facing up " in as_text(inventory(tmp_path))
    # The band of a spread is that of one side.
    own = result["right_facing"]
    spread = spread_of(done.directory.resolve())
    spread.mkdir()
    for name, low in (("right_facing", own - 1e-3), ("velocity", own - 2e-3)):
        bands = {name: {"low": low, "high": own - 1e-4, "points": 64}}
        write_json(spread / SPREAD_NAME, {"varied": result.about["rests_on"], "bands": bands})
        assert done.result[f"{name}_low"] == low
        assert done.result[f"{name}_high"] == own  # extended to the result of the case
        errors = {row.name: row.error for row in rows(done.result)}
        assert ("band" in errors["right_facing"]) == (name == "right_facing")
    write_json(spread / SPREAD_NAME, {"varied": [], "bands": bands})
    assert "velocity_low" not in done.result
    spread.joinpath(SPREAD_NAME).unlink()
    spread.rmdir()
    page = done.report(tmp_path / "report.html").read_text("utf-8")
    assert "liquid of 20 mN/m; 80 Hz" in page
    assert "plane tilted by 20°" in page
    gentle = Case.read({**tables, "boundary": {"material": "glass", "tilt": "10 deg"}}, name="gentle")
    walkers.run(gentle, tmp_path)
    text = walkers.compare(*(walkers.load(one, tmp_path).directory for one in (case, gentle))).text
    assert "\nright_facing (mm/s)" in text
    assert "\nvelocity (mm/s)" not in text  # the mean over both is no walker's
    frame = pd.DataFrame([dict(result)])
    assert default_column(frame) == "right_facing"
    assert default_column(frame.assign(facings_differ=False)) == "velocity"
    # Of walkers that turned over it is the velocity up the slope that counts.
    turned = {**result, "turned_round": 1, "upright": 1, "turned_over": 1}
    assert headline(turned) == default_column(pd.DataFrame([turned])) == "axial_velocity"
    assert default_column(pd.DataFrame([dict(result), turned])) == "axial_velocity"  # at one point is enough
    assert not fell({"goes_uphill": True, "climbs": 0})  # a pile


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
    result, each = done.result, done.walkers
    up, down = (each[each["facing"] == way] for way in (1, -1))
    climbing = int((each["axial_velocity"] > 2e-6).sum())
    assert climbing == 1
    assert (result["climbing"], result["descending"]) == (1, 1)
    assert [row.name for row in rows(result) if row.name in ("climbing", "descending")] == ["climbing", "descending"]
    assert result["velocity"] == pytest.approx(up["velocity"].mean())
    assert result["axial_velocity"] == pytest.approx(up["axial_velocity"].mean())
    assert result["axial_left_facing"] == pytest.approx(down["axial_velocity"].mean())
    # A sweep that begins on a level floor is drawn by the same walkers.
    level = walkers.run(Case.read({**FOUR_BEADS, "boundary": {"material": "glass"}}, name="level"), tmp_path)
    rightward = level.walkers[level.walkers["facing"] == 1]["axial_velocity"].mean()
    assert level.result["axial_velocity"] == pytest.approx(rightward) != 0.0


def test_a_cluster_leans_by_how_far_it_turned(tmp_path: Path) -> None:
    """Not by the angle between the way that it faces and its beads in front, which its arrangement contains."""
    steep = {**FOUR_BEADS, "boundary": {"material": "glass", "tilt": "30 deg"}}
    done = walkers.run(Case.read(steep, name="four"), tmp_path)
    begin = done.trajectory.groupby("walker")["orientation"].first()
    np.testing.assert_allclose(begin, done.walkers["start_angle"], atol=2e-3)
    heading = read_motion(done.directory).groups[0].heading[[0, -1]]
    turned = np.abs(np.diff(np.unwrap(np.arctan2(heading[..., 1], heading[..., 0]), axis=0), axis=0))
    assert done.result["ends_within"] == pytest.approx(turned.max(), abs=np.radians(2.0))


def test_walkers_that_came_apart_have_no_velocity_anywhere_in_the_text(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    columns = read_columns(done.directory, "walkers")
    columns["separated_fraction"] = columns["separated_fraction"] + 0.5
    apart = replace(done.result, numbers={**done.result.numbers, **_velocities(columns, done.case)})
    assert apart["came_apart"]
    assert headlines(apart)[0].endswith(": came apart")
    assert "velocity" in [row.name for row in rows(done.result)]
    assert not [row.name for row in rows(apart) if "velocity" in row.name or "facing" in row.name]


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
        numbers = _velocities(changed, done.case)
        assert numbers["depends_on_start"]
        assert not _velocities({**changed, "steady": ~columns["steady"]}, done.case)["depends_on_start"]


def test_texts_of_results_are_as_wide_as_a_page(runs_folder: Path) -> None:
    done = walkers.run(load_case("fig1b"), runs_folder)
    lines = text(done.result, cached=True).splitlines()
    assert lines[0].endswith("(already run)")
    assert not [line for line in lines if len(line) > 110 and str(done.directory) not in line]
