"""Runs that end when velocities are constant: what they give, when they go on, and that company does not matter."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import document
from walkers import run as run_case
from walkers.errors import InputError, Stopped
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.postprocess.gait import are_constant, walk
from walkers.postprocess.motion import read_motion
from walkers.postprocess.tables import read_table
from walkers.progress import Progress
from walkers.runner.binary import find_engine
from walkers.runner.directory import FIRST_SEGMENT, segment_directories
from walkers.runner.manifest import read_manifest
from walkers.sweeps.making import make_runs
from walkers.templates.scene import sharing_key


def _until_steady(**changes: Any) -> Case:
    """The reference walker with `document`'s changes, driven until its velocity is constant."""
    tables = {**document(**changes), "run": {**changes.get("run", {})}}
    return Case.read(tables, name="test")


def _shipped(angle: float = 0.0, **drive: Any) -> Case:
    """The shipped walker alone, started at an angle in degrees."""
    tables: dict[str, Any] = {
        "beads": {"material": "ruby"},
        "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1, "angle": f"{angle} deg", "spacing": "80 mm"},
        "liquid": {"name": "Si AK5"},
        "boundary": {"material": "chromium-coated glass"},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g", **drive},
    }
    return Case.read(tables, name="shipped")


def _turning() -> Case:
    """A walker that still turns to the axis after 12 cycles, and less and less after 24: little drags it."""
    case = _shipped(4.0, peak_acceleration="8 g")
    return case.put("liquid.viscosity_ratio", 1.0)


def test_a_steady_walker_ends_early_at_the_speed_of_a_long_run(runs_folder: Path) -> None:
    short = run_case(load_case("fig1b"), runs_folder)
    case = load_case("fig1b")
    full = case.but(run=case.run.but(until_steady=False, cycles_per_segment=case.run.cycles))
    long = run_case(full, runs_folder)
    assert (short.result["cycles"], short.result["settling_cycles"], short.result["ended_early"]) == (12, 4, True)
    assert (long.result["cycles"], long.result["settling_cycles"], long.result["ended_early"]) == (60, 20, False)
    speeds = [one.result["velocity"] for one in (short, long)]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.005)
    # Until then the two are the same run.
    ways = [one.motion.position[:241] for one in (short, long)]
    np.testing.assert_array_equal(ways[0], ways[1])


def test_a_restless_walker_is_driven_for_longer_at_a_stretch(tmp_path: Path) -> None:
    """Nothing of a shorter attempt is left: a restart would perturb it, and bridges that are open may be lost."""
    case = _turning()
    asked = run_case(case, tmp_path)
    assert (asked.result["cycles"], asked.result["ended_early"]) == (24, True)
    at_once = run_case(case.for_cycles(24), tmp_path)
    assert at_once.directory != asked.directory
    dumps = [(one.directory / FIRST_SEGMENT / "beads.bin").read_bytes() for one in (asked, at_once)]
    assert dumps[0] == dumps[1]


def test_a_walker_that_turns_ever_faster_is_not_steady_however_even_its_speed(tmp_path: Path) -> None:
    """On a slope of 60° with its large bead above it turns over; after 12 cycles its speed is even to 0.2 % yet."""
    tables: dict[str, Any] = {
        "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1, "angle": "0.4 deg", "facing": "up"},
        "beads": {"material": "ruby"},
        "liquid": {"name": "Si AK5"},
        "boundary": {"material": "chromium-coated glass", "tilt": "60 deg"},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "6 g"},
        "run": {"cycles": 12, "settling_cycles": 4},
    }
    directory = run_case(Case.read(tables, name="turning"), tmp_path).directory
    (group,) = read_motion(directory).groups
    found = walk(group)
    assert np.abs(found.first_half - found.second_half).max() < 0.002 * np.abs(found.velocity).max()
    assert not are_constant(directory)


def test_what_settles_slowly_runs_in_full_and_numbers_are_obeyed() -> None:
    def run_of(**changes: Any) -> tuple[bool, int, int]:
        run = _until_steady(**changes).run
        return run.until_steady, run.cycles, run.settling_cycles

    assert run_of() == (True, 60, 20)
    assert run_of(run={"cycles": "auto", "most_cycles": 24}) == (True, 24, 8)
    assert run_of(dimers={"radii": ["0.25 mm", "0.22 mm"]}) == (False, 60, 20)
    assert run_of(dimers={"angle": "30 deg"}) == (False, 60, 20)
    assert run_of(run={"cycles": 30}) == (False, 30, 10)
    assert run_of(run={"duration": "0.5 s"}) == (False, 40, 13)
    assert run_of(run={"settling_cycles": 30}) == (False, 60, 30)


@pytest.mark.parametrize(
    ("key", "run", "expected"),
    [
        ("run.most_cycles", {"cycles": 30, "most_cycles": 60}, "either cycles or most_cycles, not both"),
        ("run.settling_cycles", {"cycles": "auto", "settling_cycles": 5}, "expected none: with run.cycles"),
        ("run.segment", {"most_cycles": 60, "segment": "0.1 s"}, "expected none: with run.most_cycles"),
    ],
)
def test_a_length_said_twice_is_refused(key: str, run: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError, match=rf"(?s){re.escape(key)}.*{re.escape(expected)}"):
        _until_steady(run=run)


def _companions() -> list[Case]:
    """Walkers that feel other forces each, one of which goes on when the others are done."""
    case = _shipped()
    changes = {
        "one": ("title", ""),
        "weak": ("drive.peak_acceleration", 0.5 * case.excitation.peak_acceleration),
        "across": ("drive.axis", "y"),
        "uphill": ("boundary.tilt", 0.3),
        "light": ("environment.gravity", 5.0),
        "rough": ("contact.friction.bead_wall", 0.2),
        "thin": ("liquid.viscosity_ratio", 0.4),
    }
    others = [case.put(*change).but(name=name) for name, change in changes.items()]
    return [others[0], _turning().but(name="turning"), *others[1:]]


def test_company_does_not_matter_whatever_forces_it_feels(tmp_path: Path) -> None:
    cases, engine = _companions(), find_engine()
    assert len({sharing_key(case) for case in cases}) == 1
    together = make_runs(cases, tmp_path / "together", engine)
    decks = [read_manifest(run).get("shared_deck") for run in together.values()]
    assert len({deck["first"] if deck else None for deck in decks}) == 2  # the second has the one that went on
    cycles = {}
    for case in cases:
        alone = make_runs([case], tmp_path / "alone", engine)
        ((name, run),) = alone.items()
        tables = [read_table(one, "walkers") for one in (together[name], run)]
        motions = [read_motion(one) for one in (together[name], run)]
        ways = [one.position - one.position[0] for one in motions]
        assert ways[0].shape == ways[1].shape
        assert np.abs(ways[0] - ways[1]).max() < 2e-5 * np.abs(ways[1]).max(), case.name
        assert tables[0]["velocity"][0] == pytest.approx(tables[1]["velocity"][0], rel=1e-6, abs=1e-12), case.name
        cycles[case.name] = motions[0].case.run.cycles
    assert cycles["turning"] == 24
    assert cycles["one"] == 12


def test_an_interrupted_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    case, engine = _turning(), find_engine()

    shown = [0.0]

    def stop(progress: Progress) -> None:
        shown.append(progress.share)
        if progress.share * sum(case.run.attempts) > 13:
            raise Stopped("enough")

    with pytest.raises(Stopped):
        make_runs([case], tmp_path / "stopped", engine, on_progress=stop)
    assert shown == sorted(shown)  # the run begins again after 12 cycles, its progress does not
    assert 13 < shown[-1] * sum(case.run.attempts) < 36
    dumps = []
    for folder in ("stopped", "at-a-stretch"):
        ((_, run),) = make_runs([case], tmp_path / folder, engine).items()
        dumps.append([(path / "beads.bin").read_bytes() for path in segment_directories(run)])
    assert len(dumps[0]) == 1
    assert dumps[0] == dumps[1]
