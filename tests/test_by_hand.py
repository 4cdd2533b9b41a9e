"""Decks that are run by hand: what is written, what parameters do that are edited, what is read of what they leave."""

import re
import subprocess
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import REFERENCE, SHORT, call, document, make_case, wait_for
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.config_table import changed
from walkers.inputs.tables.case import Case, CaseFile
from walkers.runner.run_directory import FIRST_SEGMENT
from walkers.runs.by_hand import take_in, write_folder
from walkers.runs.case_text import differing, flattened


def _edit(folder: Path, **values: str) -> None:
    """Change parameters of a deck."""
    deck = folder / "walker.lig"
    text = deck.read_text()
    for name, value in values.items():
        text, count = re.subn(rf"(?m)^(variable +{name} string) \S+", rf"\g<1> {value}", text)
        assert count == 1, name
    deck.write_text(text)


def _run(folder: Path, *, stopped: bool = False) -> None:
    """Run a deck as its script says, to its end or until it has written frames."""
    engine = subprocess.Popen(["sh", "run.sh"], cwd=folder)
    if stopped:
        wait_for(
            lambda: (
                (folder / "beads.bin").exists() and (folder / "beads.bin").stat().st_size > 10_000
            )
        )
        engine.kill()
    engine.wait()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of a deck that was not run."""
    write_folder(make_case(run=SHORT), tmp_path / "hand")
    return tmp_path / "hand"


def test_a_deck_run_by_hand_is_read_and_says_so(
    folder: Path, run_directory: Callable[..., Path]
) -> None:
    with pytest.raises(InputError, match=r"the deck was not run .*; do: cd .* && sh run\.sh"):
        run_case(folder)
    _run(folder)
    found, same = run_case(folder), run_case(run_directory(run=SHORT))
    assert found.result.about["by_hand"] == ["run by hand"]
    assert {**found.result, "by_hand": 0} == {**same.result, "by_hand": 0}
    assert (folder / "beads.bin").read_bytes() == (
        same.directory / FIRST_SEGMENT / "beads.bin"
    ).read_bytes()
    assert ("warning: run by hand" in found.describe(), "(already run)" in found.describe()) == (
        True,
        False,
    )
    assert found.case.document == make_case(run=SHORT).document
    for command in ("run", "plot", "export --to vtk", "check files"):
        assert call(*command.split(), str(folder)).returncode == 0, command
    written = (folder / "result.json").stat().st_mtime_ns
    run_case(folder)
    assert (folder / "result.json").stat().st_mtime_ns == written


TONES = [
    {"frequency": "80 Hz", "peak_acceleration": "2 g"},
    {"axis": "y", "frequency": "160 Hz", "peak_acceleration": "1 g", "phase": "90 deg"},
]
PEAK = changed_case(make_case(), {"drive.gamma0": 0.4}).drive.peak_acceleration
LIQUID = {
    "volume_fraction": 0.01,
    "contact_angle": "0 deg",
    "surface_tension": "20 mN/m",
    "density": "1 g/cm^3",
}
EDITED: dict[str, tuple[dict[str, Any], dict[str, str], dict[str, Any]]] = {
    # Tables of a case, edits of its deck, the same changes of the case.
    "amplitude": (
        {},
        {"amplitude": "1.16e-4"},
        {"drive.peak_acceleration": f"{1.16e-4 * (160.0 * pi) ** 2!r} m/s^2"},
    ),
    "frictions": (
        {},
        {"friction_bead_wall": "0.2", "restitution": "0.5"},
        {"contact.friction.bead_wall": 0.2, "contact.restitution": 0.5},
    ),
    "length": ({}, {"cycles": "9"}, {"run.cycles": 9, "run.settling_cycles": 3}),
    "frequency of a ramp": (
        {"drive": {**REFERENCE["drive"], "ramp": [["0.01 s", 0.5], ["0.06 s", 1.25]]}},
        {"frequency": "70.0"},
        {"drive.frequency": "70 Hz"},
    ),
    "two tones and their cycle": (
        {"drive": {"harmonics": TONES}},
        {"frequency_1": "60.0", "frequency_2": "120.0", "cycle_frequency": "60.0"},
        {"drive.harmonics[0].frequency": "60 Hz", "drive.harmonics[1].frequency": "120 Hz"},
    ),
    "Γ0 with another density": (
        {"drive": {"frequency": "80 Hz", "gamma0": 0.4}},
        {"density": "4200.0"},
        {"beads.density": "4.2 g/cm^3", "drive.peak_acceleration": f"{PEAK!r} m/s^2"},
    ),
    "a kinematic viscosity": (
        {"liquid": {**LIQUID, "kinematic_viscosity": "5 mm^2/s", "viscosity_ratio": 2.0}},
        {"viscosity": "0.004"},
        {"liquid.dynamic_viscosity": "4 mPa*s", "liquid.viscosity_ratio": 1.0},
    ),
    "a time step beyond the limits": (
        {"run": {**SHORT, "time_step": "2 us"}},
        {"steps_per_cycle": "2000"},
        {"run.time_step": "6.25 us", "run.allow_unstable": True},
    ),
    "an uncertain value": (
        {"uncertain": {"contact.restitution": [0.2, 0.4]}},
        {"restitution": "0.5"},
        {"contact.restitution": 0.5, "uncertain": {}},
    ),
}


def _numbers(case: Case) -> list[float]:
    """What parameters of a deck determine; the last four are those of the run's length and samples."""
    liquid, contact, run, sines = (
        case.liquid.of_bridges,
        case.contact,
        case.run,
        case.excitation.harmonics,
    )
    numbers = [
        number
        for one in sines
        for number in (*one.direction, one.frequency, one.peak_acceleration, one.phase)
    ]
    numbers += [
        case.beads.density,
        case.environment.gravity,
        liquid.surface_tension,
        liquid.viscosity,
        run.period,
    ]
    numbers += [
        contact.friction.bead_bead,
        contact.friction.bead_wall,
        contact.restitution,
        contact.youngs_modulus,
    ]
    return [*numbers, run.cycles, run.settling_cycles, run.samples_per_cycle, run.cycles_per_sample]


@pytest.mark.parametrize("name", EDITED)
def test_an_edited_deck_is_another_case(
    name: str, tmp_path: Path, run_directory: Callable[..., Path]
) -> None:
    tables, edits, changes = EDITED[name]
    case, expected = (
        build_case(changed(CaseFile, {**document(run=SHORT), **tables}, more), name="test")
        for more in ({}, changes)
    )
    folder = write_folder(case, tmp_path / "hand").parent
    _edit(folder, **edits)
    _run(folder)
    found = run_case(folder)
    assert _numbers(found.case) == pytest.approx(_numbers(expected), rel=1e-9)
    assert found.case.run.steps_per_cycle == int(
        edits.get("steps_per_cycle", case.run.steps_per_cycle)
    )
    assert [one.spacing for one in found.case.walkers] == [one.spacing for one in case.walkers]
    assert found.case.drive.ramp == expected.drive.ramp
    # Its tables are those of a case file.
    assert _numbers(changed_case(found.case, {"title": "again"}))[:-4] == pytest.approx(
        _numbers(expected)[:-4], rel=1e-9
    )
    _, told, *_ = found.result.about["by_hand"]
    assert all(re.search(rf"[ :]{parameter} \S+, was [\d.e-]+", told) for parameter in edits)
    assert told.count(", was ") == len(edits)
    if not tables or expected.drive.ramp:
        # Where the walker stands at first, its time step and how a ramp is rounded are those of the case as it was.
        same = run_case(run_directory(expected))
        assert found.result["velocity"] == pytest.approx(same.result["velocity"], rel=1e-2)
        # What commands list: the edits, which are given, and nothing else.
        (left, _), (right, _) = (
            differing([*map(flattened, (case, other))]) for other in (found.case, expected)
        )
        assert {*left} - {"run.settling_cycles"} == {*right} - {"run.settling_cycles"}


def test_a_deck_that_is_edited_and_run_again_is_read_again(folder: Path) -> None:
    _run(folder)
    first = run_case(folder).result["velocity"]
    _edit(folder, peak_acceleration="20.0")
    deck = folder / "walker.lig"
    deck.write_text(
        deck.read_text()
        .replace("nve/sphere", "nve/sphere  # as ever")
        .replace("delay 0", "delay 1")
    )
    _run(folder)
    again = run_case(folder)
    assert again.result["velocity"] < first
    assert "peak_acceleration 20, was 39.2; 1 other line(s)" in again.result.about["by_hand"][1]
    assert " finished: edited and run by hand " in call("list", "--out", str(folder.parent)).stdout
    _edit(folder, restitution="0.5")
    assert "walker.lig is newer than" in run_case(folder).result.about["by_hand"][-1]
    with pytest.raises(InputError, match=r"no finished run in .*--set 'drive.frequency=70 Hz'"):
        walkers.load(folder, changes={"drive.frequency": "70 Hz"})


FAILS: dict[str, tuple[dict[str, str], str, str]] = {
    # Edits of parameters, a wrong command instead of pair_coeff, what is said.
    "an error of the engine": ({}, "pair_coeff * * 3", "failed: the engine stopped: ERROR"),
    "steps that are no cycle": (
        {"time_step": "3e-6"},
        "",
        "not one cycle of 80 Hz .*edit steps_per_cycle",
    ),
    "a word for a number": ({"restitution": "high"}, "", "cannot be read .*'high'"),
    "a value that no case has": (
        {"youngs_modulus": "2e6"},
        "",
        r"the edited deck: contact\.youngs_modulus = \"2",
    ),
    "a run that was stopped": (
        {"cycles": "4000", "peak_acceleration": "1.0"},
        "",
        "still runs or was stopped",
    ),
}


@pytest.mark.parametrize("name", FAILS)
def test_a_run_by_hand_that_cannot_be_read_is_told_in_one_message(name: str, folder: Path) -> None:
    edits, command, told = FAILS[name]
    _edit(folder, **edits)
    deck = folder / "walker.lig"
    deck.write_text(
        deck.read_text().replace("pair_coeff      * *", command or "pair_coeff      * *")
    )
    _run(folder, stopped=name == "a run that was stopped")
    with pytest.raises(InputError, match=told) as caught:
        take_in(folder)
    assert len(str(caught.value).splitlines()) == 1
    assert not (folder / "manifest.json").exists()
