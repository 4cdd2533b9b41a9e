"""Decks that are run by hand: what is written, what parameters do that are edited, what is read of what they leave."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import SHORT, call, document, make_case
from walkers import load
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.case import Case
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
        load(folder)
    _run(folder)
    found, same = load(folder), load(run_directory(run=SHORT))
    assert found.result["by_hand"] == ["run by hand"]
    assert {**found.result, "by_hand": 0} == {**same.result, "by_hand": 0}
    assert "warning: run by hand" in found.describe()
    assert "(already run)" not in found.describe()
    assert found.case.document == make_case(run=SHORT).document
    for command in ("run", "plot", "report", "export --to vtk", "check files"):
        assert call(*command.split(), str(folder)).returncode == 0, command
    written = (folder / "result.json").stat().st_mtime_ns
    load(folder)
    assert (folder / "result.json").stat().st_mtime_ns == written


EDITED = {
    "acceleration": ({"peak_acceleration": "29.4"}, {"drive": {"peak_acceleration": "29.4 m/s^2"}}),
    "amplitude": ({"amplitude": "1.1636e-4"}, {"drive": {"peak_acceleration": "29.4 m/s^2"}}),
    "friction": (
        {"friction_bead_wall": "0.2", "restitution": "0.5"},
        {"contact": {"friction": {"bead_bead": 0.1, "bead_wall": 0.2}, "restitution": 0.5}},
    ),
    "viscosity": ({"viscosity": "0.0092"}, {"liquid": {"viscosity_ratio": 2.0}}),
    "tension": ({"surface_tension": "0.03"}, {"liquid": {"surface_tension": "30 mN/m"}}),
    "density": ({"density": "4200.0"}, {"beads": {"density": "4.2 g/cm^3"}}),
    "length": ({"cycles": "9"}, {"run": {**SHORT, "cycles": 9, "settling_cycles": 3}}),
    "frequency": ({"frequency": "70.0"}, {"drive": {"frequency": "70 Hz"}}),
}


@pytest.mark.parametrize("name", EDITED)
def test_an_edited_parameter_is_another_case(name: str, folder: Path, run_directory: Callable[..., Path]) -> None:
    edits, changes = EDITED[name]
    _edit(folder, **edits)
    _run(folder)
    found, same = load(folder), load(run_directory(**{"run": SHORT, **changes}))
    # Where the walker stands at first and its time step are those of the case as it was.
    assert found.result["velocity"]["mean"] == pytest.approx(same.result["velocity"]["mean"], rel=5e-3)
    assert found.case.excitation.peak_acceleration == pytest.approx(same.case.excitation.peak_acceleration, rel=1e-3)
    assert found.case.contact == same.case.contact
    # What has another number is no longer what the library calls so.
    assert found.case.liquid.name == (None if "liquid" in changes else "Si AK5")
    assert found.case.beads.material == (None if "beads" in changes else "ruby")
    assert found.case.run.period == pytest.approx(same.case.run.period)
    told, *constant = found.result["by_hand"][1:]
    assert told.startswith("the deck was edited: ")
    assert len(constant) == (name != "tension")  # the others need more cycles
    assert all("are not constant within 0.2 %" in one for one in constant)
    assert all(re.search(rf"{parameter} \S+, was [\d.e-]+", told) for parameter in edits)
    assert "other line" not in told
    # What commands show and compare.
    values = flattened(found.case.as_dict())
    assert values["drive.peak_acceleration"] == found.case.excitation.peak_acceleration
    assert values["run.time_step"] == found.case.run.time_step
    assert differing([flattened(make_case(run=SHORT).as_dict()), values])


def test_a_deck_that_is_edited_and_run_again_is_read_again(folder: Path) -> None:
    _run(folder)
    first = load(folder).result["velocity"]["mean"]
    _edit(folder, peak_acceleration="20.0")
    deck = folder / "walker.lig"
    deck.write_text(deck.read_text().replace("nve/sphere", "nve/sphere  # as ever").replace("delay 0", "delay 1"))
    _run(folder)
    again = load(folder)
    assert again.result["velocity"]["mean"] < first
    assert "peak_acceleration 20, was 39.2; 1 other line(s)" in again.result["by_hand"][1]
    assert "is newer than" not in again.describe()
    assert " finished: edited and run by hand " in call("list", "--out", str(folder.parent)).stdout
    _edit(folder, restitution="0.5")
    assert "walker.lig is newer than" in load(folder).result["by_hand"][-1]
    with pytest.raises(InputError, match="hand: its deck was edited and run by hand: changes are for cases"):
        load(folder, changes={"drive.frequency": "70 Hz"})


FAILS = {
    "an error of the engine": ({}, "pair_coeff      * *", "pair_coeff * * 3", "failed: the engine stopped: ERROR"),
    "a time step beyond the limits": ({"steps_per_cycle": "400"}, "", "", "failed: .*blow-up"),
    "steps that are no cycle": (
        {"time_step": "3e-6"},
        "",
        "",
        "cannot be read .*not one cycle of 80 Hz .*edit steps_per_cycle",
    ),
    "a word for a number": ({"restitution": "high"}, "", "", 'variable restitution: expected a number, found "high"'),
    "a run that was stopped": (
        {"cycles": "4000", "peak_acceleration": "1.0"},
        "",
        "",
        "still runs or was stopped, or its dump was cut later: the engine wrote",
    ),
}


@pytest.mark.parametrize("name", FAILS)
def test_a_run_by_hand_that_failed_is_told_in_one_message(name: str, folder: Path) -> None:
    edits, old, new, told = FAILS[name]
    _edit(folder, **edits)
    deck = folder / "walker.lig"
    deck.write_text(deck.read_text().replace(old, new))
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


def test_an_amplitude_with_which_beads_would_start_unlike_the_walls_is_refused(tmp_path: Path) -> None:
    folder = write_folder(make_case(run=SHORT, drive={"frame": "lab"}), tmp_path / "hand").parent
    _edit(folder, amplitude="1.2e-4")
    _run(folder)
    with pytest.raises(InputError, match=r"but the walls at .*: edit peak_acceleration or frequency"):
        load(folder)


LENGTHS = {
    "fig1b": ("12", "# of the drive; walkers run continues to 60 if the velocities are not constant within 0.2 %"),
    "pile-ci": ("36", "below 0.005 m/s"),
}


@pytest.mark.parametrize("name", LENGTHS)
def test_a_deck_says_how_a_run_would_go_on(name: str, tmp_path: Path) -> None:
    cycles, told = LENGTHS[name]
    deck = call("export", "--to", "deck", name, "--out", str(tmp_path)).stdout
    assert re.search(rf"^variable +cycles string {cycles} ", deck, re.MULTILINE)
    assert told in deck


def test_a_deck_has_the_cycles_of_the_run_that_exists(tmp_path: Path) -> None:
    """Otherwise those tried first, and what is read of it says so."""
    turning = {"dimers": {"angle": "4 deg"}, "drive": {"peak_acceleration": "8 g"}, "run": {"most_cycles": 14}}
    case = Case.read({**document(**turning), "run": turning["run"]}, name="turning")
    first = write_folder(case, tmp_path / "first").parent
    made = run_case(case, tmp_path)
    again = made.export("deck", tmp_path / "again").parent
    for folder in (first, again):
        _run(folder)
    found, same = load(first), load(again)
    assert found.result["cycles"] == 12
    assert "not constant within 0.2 % after 12 cycles; walkers run continues to 14" in found.result["by_hand"][-1]
    assert {**same.result, "by_hand": 0} == {**made.result, "by_hand": 0}
    compared = call("compare", str(made.directory), str(first)).stdout
    assert compared.startswith("the cases are the same, but ran 14 and 12 cycles\n")
