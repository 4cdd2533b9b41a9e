"""Clusters and dimers on a wall, shaken along it, against gravity."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import document
from walkers.inputs import InputError, load_case, resolve_case
from walkers.inputs.case import Case
from walkers.inputs.reading import read_toml, shipped_cases
from walkers.postprocess.analysis import describe_result, read_result
from walkers.postprocess.gait import postures, turned_over_at
from walkers.postprocess.motion import read_motion
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import finished_places, run_place
from walkers.sweeps.making import make_runs
from walkers.theory.prediction import motion_of, predict

FRICTIONS = {0.1: -9.57e-3, 0.2: -3.33e-3, 0.3: 4.77e-3}
"""Climbing speeds in m/s, as measured; the theory has those that climb a tenth faster."""


# Its speed is that of 120 cycles of 2 µs, 40 of them to settle, to three digits.
RUN = {"time_step": "4 us", "cycles": 24, "settling_cycles": 12}


def climber(friction: float = 0.3, **start: Any) -> Case:
    case = resolve_case({**read_toml(shipped_cases()["climber-dimer"]), "run": RUN}, name="climber-dimer")
    contact = replace(case.contact, friction_bead_wall=friction, friction_bead_bead=friction)
    begin = {"replicates": 1, "angle_spread": 0.0, "gap_spread": 0.0, "spacing": 0.1, **start}
    return replace(case, contact=contact, walkers=(replace(case.walkers[0], **begin),))


@pytest.fixture(scope="module")
def runs(once: Callable[..., Path]) -> dict[str, Path]:
    """Climbers of several kinds, side by side in as few decks as may be."""
    case, engine = climber(), find_engine(None)
    symmetric = replace(case, walkers=(replace(case.walkers[0], radii=(0.42625e-3, 0.42625e-3)),))
    cases = {str(friction): climber(friction) for friction in FRICTIONS}
    cases |= {f"below {friction}": climber(friction, facing="left") for friction in (0.2, 0.3)}
    cases["symmetric"] = symmetric
    out = once("climbers", lambda folder: make_runs(list(cases.values()), folder, engine))
    places = finished_places(out)
    return {name: places[run_place(case, engine, out).name] for name, case in cases.items()}


def test_a_dimer_on_a_wall_is_one_on_a_plane_at_90_degrees() -> None:
    """Facing right is facing up there: the same case, hence the same run."""
    tables = read_toml(shipped_cases()["climber-dimer"])
    assert tables["boundary"]["tilt"] == "90 deg"
    tables["dimers"]["facing"] = "right"
    assert resolve_case(tables).determinants() == load_case("climber-dimer").determinants()


@pytest.mark.parametrize("friction", list(FRICTIONS))
def test_a_dimer_on_the_axis_climbs_if_friction_suffices(runs: dict[str, Path], friction: float) -> None:
    velocity = read_result(runs[str(friction)])["velocity"]["mean"]
    assert velocity == pytest.approx(FRICTIONS[friction], rel=0.03)
    assert float(motion_of(climber(friction)).velocity[0]) == pytest.approx(velocity, rel=0.12)


@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_with_the_large_bead_below_it_falls(runs: dict[str, Path], friction: float) -> None:
    """As a symmetric one does."""
    assert read_result(runs[f"below {friction}"])["axial_velocity"]["left_facing"] < -5e-3
    assert read_result(runs["symmetric"])["axial_velocity"]["right_facing"] < -1e-3


def test_a_climbers_weight_pulls_along_the_axis() -> None:
    case = climber()
    assert (case.pressing_gravity, case.axial_gravity) == (0.0, case.gravity)
    assert predict(case)["alignment"]["u"] < 0.0  # it stands on its head
    with pytest.raises(InputError, match=r"dimers\.facing"):
        resolve_case(document(boundary={"uphill": "90 deg", "tilt": "90 deg"}, dimers={"facing": "up"}))
    with pytest.raises(InputError, match=r"dimers\.facing"):
        resolve_case(document(dimers={"facing": "up"}))


@pytest.fixture(scope="module")
def upright(once: Callable[..., Path]) -> Path:
    """The shipped climber, with its spread of starts, for a fifth of its time."""
    run = {"time_step": "2 us", "cycles": 36, "settling_cycles": 24, "samples_per_cycle": 1}
    tables = {**read_toml(shipped_cases()["climber"]), "run": run}
    case, engine = resolve_case(tables, name="climber"), find_engine(None)
    out = once("upright", lambda folder: make_runs([case], folder, engine))
    return finished_places(out)[run_place(case, engine, out).name]


def test_the_shipped_climber_comes_upright_and_climbs(upright: Path) -> None:
    result, walkers = read_result(upright), read_table(upright, "walkers")
    assert np.degrees(walkers["start_angle"].abs().max()) > 9.0
    assert np.degrees(walkers["orientation_end"].abs().max()) < 0.3
    assert result["posture"]["upright"] == result["walkers"] == 6
    assert result["velocity"]["mean"] == pytest.approx(3.62e-3, rel=0.03)
    lines = describe_result(upright, result).splitlines()
    assert lines[0].startswith("climber: upright to the end, within 0.")


def test_posture_is_that_of_the_whole_run(upright: Path) -> None:
    """Of the same motion, turned: leaning from 15° on, turned over from 90°, whatever comes after."""
    group = read_motion(upright).groups[0]
    assert postures(group) == ["upright"] * 6
    assert np.isnan(turned_over_at(group)).all()
    tilting = np.linspace(0.0, np.radians(20.0), len(group.time))[:, None]
    over = np.where(group.time == group.time[9], np.radians(100.0), 0.0)[:, None]
    low, high = (np.full((len(group.time), 1), np.radians(angle)) for angle in (14.0, 16.0))
    turns = ((low, "upright"), (high, "leaning"), (tilting, "leaning"), (0.5 * tilting, "leaning"))
    for turn, expected in (*turns, (over, "turned over")):
        turned = replace(group)
        turned.__dict__["orientation"] = np.broadcast_to(turn, group.orientation.shape)
        assert postures(turned) == [expected] * 6
    turned.__dict__["orientation"] = np.broadcast_to(over, group.orientation.shape)
    assert turned_over_at(turned) == pytest.approx(group.time[9])
