"""Decks that are run by hand: what is written, what parameters do that are edited, what is read of what they leave."""

import re
import subprocess
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import SHORT, call, document, make_case
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.drive import WAVEFORMS
from walkers.inputs.table import changed
from walkers.sweeps.by_hand import take_in, write_folder
from walkers.sweeps.readable import differing, flattened


def _edit(folder: Path, **values: str) -> None:
    """Change parameters of a deck."""
    deck = folder / "walker.lig"
    text = deck.read_text()
    for name, value in values.items():
        text, count = re.subn(rf"(?m)^(variable +{name} string) \S+", rf"\g<1> {value}", text)
        assert count == 1, name
    deck.write_text(text)


def _run(folder: Path, before: str = "") -> None:
    """Run a deck as its script says, perhaps by another program."""
    script = (folder / "run.sh").read_text().replace("exec ", f"exec {before} ", 1)
    subprocess.run(["sh", "-c", script], cwd=folder, check=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of a deck that was not run."""
    write_folder(make_case(run=SHORT), tmp_path / "hand")
    return tmp_path / "hand"


def test_a_deck_run_by_hand_is_read_and_says_so(folder: Path, run_directory: Callable[..., Path]) -> None:
    with pytest.raises(InputError, match=r"the deck was not run .*; do: cd .* && sh run\.sh"):
        run_case(folder)
    _run(folder)
    found, same = run_case(folder), run_case(run_directory(run=SHORT))
    assert found.result.about["by_hand"] == ["run by hand"]
    assert {**found.result, "by_hand": 0} == {**same.result, "by_hand": 0}
    assert ("warning: run by hand" in found.describe(), "(already run)" in found.describe()) == (True, False)
    assert found.case.document == make_case(run=SHORT).document
    for command in ("run", "plot", "export --to vtk", "check files"):
        assert call(*command.split(), str(folder)).returncode == 0, command
    written = (folder / "result.json").stat().st_mtime_ns
    run_case(folder)
    assert (folder / "result.json").stat().st_mtime_ns == written


def test_the_law_of_a_deck_is_not_executed_when_it_is_read(tmp_path: Path) -> None:
    """Neither the file that the case names, which may be anybody's by now, nor the copy beside the deck."""
    law = tmp_path / "spring.py"
    law.write_text("from walkers.physics.laws.soulie import law as spring\n")
    write_folder(make_case(run=SHORT, liquid={"law": f"{law}:spring"}), tmp_path / "hand")
    _run(tmp_path / "hand")
    for file in (law, tmp_path / "hand" / "law.py"):
        file.write_text(f"open({str(tmp_path / 'executed')!r}, 'w')\n{file.read_text()}")
    assert run_case(tmp_path / "hand").result.about["by_hand"] == ["run by hand"]
    assert not (tmp_path / "executed").exists()


TONES = [
    {"frequency": "80 Hz", "peak_acceleration": "2 g"},
    {"axis": "y", "frequency": "160 Hz", "peak_acceleration": "1 g", "phase": "90 deg"},
]
TRIANGLE = [
    {
        "frequency": f"{80 * times} Hz",
        "peak_acceleration": f"{39.2 * abs(part)} m/s^2",
        "phase": f"{pi * (part < 0)} rad",
    }
    for times, part in WAVEFORMS["triangle"]
]
WAVE = {"drive": {"frequency": "80 Hz", "peak_acceleration": "4 g", "waveform": "triangle"}}
BY_GAMMA0 = {"drive": {"frequency": "80 Hz", "gamma0": 0.4}}
PEAK = make_case().changed({"drive.gamma0": 0.4}).drive.peak_acceleration
LIQUID = {"volume_fraction": 0.01, "contact_angle": "0 deg", "surface_tension": "20 mN/m", "density": "1 g/cm^3"}
BOX = {"material": "glass", "shape": "box", "width": "2 mm", "height": "4 mm"}
LOOSE = {"duration": "0.05 s", "frames_per_second": 80, "longest_settling": "0.01 s", "settled_below": "1 m/s"}
EDITED: dict[str, tuple[dict[str, Any], dict[str, str], dict[str, Any]]] = {
    # Tables of a case, edits of its deck, the same changes of the case.
    "acceleration": ({}, {"peak_acceleration": "29.4"}, {"drive.peak_acceleration": "29.4 m/s^2"}),
    "amplitude": ({}, {"amplitude": "1.16e-4"}, {"drive.peak_acceleration": f"{1.16e-4 * (160.0 * pi) ** 2!r} m/s^2"}),
    "frictions": (
        {},
        {"friction_bead_wall": "0.2", "restitution": "0.5"},
        {"contact.friction.bead_wall": 0.2, "contact.restitution": 0.5},
    ),
    "viscosity": ({}, {"viscosity": "0.0092"}, {"liquid.dynamic_viscosity": "9.2 mPa*s"}),
    "length": ({}, {"cycles": "9"}, {"run.cycles": 9, "run.settling_cycles": 3}),
    "frequency": ({}, {"frequency": "70.0"}, {"drive.frequency": "70 Hz"}),
    "a waveform": (WAVE, {"gravity": "9.0"}, {"environment.gravity": "9 m/s^2"}),
    "sines of a waveform": (
        WAVE,
        {"peak_acceleration_1": "30.0", "phase_2": "0.5"},
        {
            "drive": {"harmonics": TRIANGLE},
            "drive.harmonics[0].peak_acceleration": "30 m/s^2",
            "drive.harmonics[1].phase": "0.5 rad",
        },
    ),
    "two tones and their cycle": (
        {"drive": {"harmonics": TONES}},
        {"frequency_1": "60.0", "frequency_2": "120.0", "cycle_frequency": "60.0"},
        {"drive.harmonics[0].frequency": "60 Hz", "drive.harmonics[1].frequency": "120 Hz"},
    ),
    "the acceleration of a Γ0": (
        BY_GAMMA0,
        {"peak_acceleration": "20.0"},
        {"drive.peak_acceleration": "20 m/s^2"},
    ),
    "Γ0 with another density": (
        BY_GAMMA0,
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
    "loose beads": (
        {
            "dimers": None,
            "placed": [{"at": ["0.3 mm", "0 mm", "0.3 mm"], "radius": "0.3 mm"}],
            "boundary": BOX,
            "run": LOOSE,
        },
        {"frequency": "150.0"},
        {"drive.frequency": "150 Hz", "run.cycles": 4, "run.frames_per_second": 150},
    ),
    "an uncertain value": (
        {"uncertain": {"contact.restitution": [0.2, 0.4]}},
        {"restitution": "0.5"},
        {"contact.restitution": 0.5, "uncertain": {}},
    ),
}


def _numbers(case: Case) -> list[float]:
    """What parameters of a deck determine; the last four are those of the run's length and samples."""
    liquid, contact, run, sines = case.liquid.of_bridges, case.contact, case.run, case.excitation.harmonics
    numbers = [number for one in sines for number in (*one.direction, one.frequency, one.peak_acceleration, one.phase)]
    numbers += [case.beads.density, case.environment.gravity, liquid.surface_tension, liquid.viscosity, run.period]
    numbers += [contact.friction.bead_bead, contact.friction.bead_wall, contact.restitution, contact.youngs_modulus]
    return [*numbers, run.cycles, run.settling_cycles, run.samples_per_cycle, run.cycles_per_sample]


@pytest.mark.parametrize("name", EDITED)
def test_an_edited_deck_is_another_case(name: str, tmp_path: Path, run_directory: Callable[..., Path]) -> None:
    tables, edits, changes = EDITED[name]
    before = {key: table for key, table in {**document(run=SHORT), **tables}.items() if table is not None}
    case, expected = (Case.read(changed(Case, before, more), name="test") for more in ({}, changes))
    folder = write_folder(case, tmp_path / "hand").parent
    _edit(folder, **edits)
    _run(folder)
    found = run_case(folder)
    assert _numbers(found.case) == pytest.approx(_numbers(expected), rel=1e-9)
    assert found.case.run.steps_per_cycle == int(edits.get("steps_per_cycle", case.run.steps_per_cycle))
    assert [one.spacing for one in found.case.walkers] == [one.spacing for one in case.walkers]
    # Its tables are those of a case file.
    assert _numbers(found.case.changed({"title": "again"}))[:-4] == pytest.approx(_numbers(expected)[:-4], rel=1e-9)
    _, told, *constant = found.result.about["by_hand"]
    assert all(re.search(rf"[ :]{parameter} \S+, was [\d.e-]+", told) for parameter in edits)
    assert told.count(", was ") == len(edits)
    assert "other line" not in told
    if not tables:
        steady = found.result["steady_walkers"] == found.result["walkers"]
        assert ["are not constant within 0.2 %" in one for one in constant] == [True] * (not steady)
        # Where the walker stands at first and its time step are those of the case as it was.
        same = run_case(run_directory(expected))
        assert found.result["velocity"] == pytest.approx(same.result["velocity"], rel=5e-3)
        # What commands show and compare: the edits, which are given, and nothing else.
        left, right = ([*map(flattened, (case, other))] for other in (found.case, expected))
        assert {*differing(left)} - {"run.settling_cycles"} == {*differing(right)} - {"run.settling_cycles"}


def test_a_deck_that_is_edited_and_run_again_is_read_again(folder: Path) -> None:
    _run(folder)
    first = run_case(folder).result["velocity"]
    _edit(folder, peak_acceleration="20.0")
    deck = folder / "walker.lig"
    deck.write_text(deck.read_text().replace("nve/sphere", "nve/sphere  # as ever").replace("delay 0", "delay 1"))
    _run(folder)
    again = run_case(folder)
    assert again.result["velocity"] < first
    assert "peak_acceleration 20, was 39.2; 1 other line(s)" in again.result.about["by_hand"][1]
    assert " finished: edited and run by hand " in call("list", "--out", str(folder.parent)).stdout
    _edit(folder, restitution="0.5")
    assert "walker.lig is newer than" in run_case(folder).result.about["by_hand"][-1]
    with pytest.raises(InputError, match=r"no finished run in .*--set 'drive.frequency=70 Hz'"):
        walkers.load(folder, changes={"drive.frequency": "70 Hz"})


LAB, HARMONICS = {"frame": "lab"}, {"harmonics": TONES}
FAILS: dict[str, tuple[dict[str, Any], dict[str, str], str, str]] = {
    # The drive, edits of parameters, a wrong command instead of pair_coeff, what is said.
    "an error of the engine": ({}, {}, "pair_coeff * * 3", "failed: the engine stopped: ERROR"),
    "a time step beyond the limits": ({}, {"steps_per_cycle": "400"}, "", "failed: .*blow-up"),
    "steps that are no cycle": ({}, {"time_step": "3e-6"}, "", "not one cycle of 80 Hz .*edit steps_per_cycle"),
    "a word for a number": ({}, {"restitution": "high"}, "", "cannot be read .*'high'"),
    "a value that no case has": ({}, {"youngs_modulus": "2e6"}, "", r"the edited deck: contact\.youngs_modulus = \"2"),
    "beads that start unlike the walls": (LAB, {"amplitude": "1.2e-4"}, "", "but the walls at .*: edit peak_accel"),
    "tones whose cycle is another": (
        HARMONICS,
        {"frequency_1": "60.0", "frequency_2": "120.0"},
        "",
        "cannot be read .*not one cycle of 60 Hz",
    ),
    "a run that was stopped": ({}, {"cycles": "4000", "peak_acceleration": "1.0"}, "", "still runs or was stopped"),
}


@pytest.mark.parametrize("name", FAILS)
def test_a_run_by_hand_that_cannot_be_read_is_told_in_one_message(name: str, tmp_path: Path) -> None:
    drive, edits, command, told = FAILS[name]
    tables = document(run=SHORT)
    tables["drive"] = drive if "harmonics" in drive else {**tables["drive"], **drive}
    folder = write_folder(Case.read(tables, name="test"), tmp_path / "hand").parent
    _edit(folder, **edits)
    deck = folder / "walker.lig"
    deck.write_text(deck.read_text().replace("pair_coeff      * *", command or "pair_coeff      * *"))
    _run(folder, "timeout 1" if name == "a run that was stopped" else "")
    with pytest.raises(InputError, match=told) as caught:
        take_in(folder)
    assert len(str(caught.value).splitlines()) == 1
    assert not (folder / "manifest.json").exists()


def test_a_run_by_hand_whose_log_was_emptied_or_cut_is_refused(folder: Path) -> None:
    _run(folder)
    log = folder / "engine.log"
    whole = log.read_text()
    for contents in ("", whole[: whole.index("Loop time")]):
        log.write_text(contents)
        with pytest.raises(InputError, match=r"engine\.log is not the whole output of an engine"):
            take_in(folder)
        assert not (folder / "manifest.json").exists()


def test_a_deck_has_the_cycles_of_the_run_that_exists(tmp_path: Path) -> None:
    """Otherwise those tried first, and what is read of it says so."""
    turning = {"dimers": {"angle": "4 deg"}, "drive": {"peak_acceleration": "8 g"}, "run": {"most_cycles": 14}}
    case = Case.read({**document(**turning), "run": turning["run"]}, name="turning")
    first = write_folder(case, tmp_path / "first").parent
    made = run_case(case, tmp_path)
    again = made.export("deck", tmp_path / "again").parent
    for folder in (first, again):
        _run(folder)
    found, same = run_case(first), run_case(again)
    assert found.result["cycles"] == 12
    assert "not constant within 0.2 % after 12 cycles; walkers run continues to 14" in found.result.about["by_hand"][-1]
    assert {**same.result, "by_hand": 0} == {**made.result, "by_hand": 0}
    compared = call("compare", str(made.directory), str(first)).stdout
    assert compared.startswith("the cases are the same, but ran 14 and 12 cycles\n")
