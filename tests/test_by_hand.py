"""Decks that are run by hand.

What is written, what parameters do that are edited, and what is read of what the engine leaves.
"""

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import REFERENCE, SHORT, call, document, make_case, wait_for
from walkers import Run
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.config_table import changed
from walkers.inputs.tables.case import Case, CaseFile
from walkers.runner.run_directory import FIRST_SEGMENT
from walkers.runs.by_hand import take_in, write_folder
from walkers.runs.case_text import differing, flattened

Once = Callable[[str, Callable[[Path], object]], Path]


def _edit(folder: Path, parameters: dict[str, str]) -> None:
    """Change parameters of a deck."""
    deck = folder / "walker.lig"
    text = deck.read_text()
    for name, value in parameters.items():
        text, count = re.subn(rf"(?m)^(variable +{name} string) \S+", rf"\g<1> {value}", text)
        assert count == 1, name
    deck.write_text(text)


def _replace(folder: Path, old: str, new: str) -> None:
    """Change a command of a deck."""
    deck = folder / "walker.lig"
    text = deck.read_text()
    assert old in text
    deck.write_text(text.replace(old, new))


def _run(folder: Path) -> None:
    """Run a deck as its script says."""
    subprocess.run(["sh", "run.sh"], cwd=folder, check=False)


def _run_and_kill(folder: Path) -> None:
    """Run a deck until it has written frames."""
    beads = folder / "beads.bin"
    engine = subprocess.Popen(["sh", "run.sh"], cwd=folder)
    wait_for(lambda: beads.exists() and beads.stat().st_size > 10_000)
    engine.kill()
    engine.wait()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a deck that was not run."""
    return write_folder(make_case(run=SHORT), tmp_path / "hand").parent


@pytest.fixture(scope="session")
def deck_after_its_run(once: Once) -> Path:
    """The folder of a deck that was run by hand, and that granular-walkers has not read."""

    def fill(folder: Path) -> None:
        write_folder(make_case(run=SHORT), folder / "hand")
        _run(folder / "hand")

    return once("run-by-hand", fill) / "hand"


@pytest.fixture
def finished(deck_after_its_run: Path, tmp_path: Path) -> Path:
    """A copy of the folder of a deck that was run by hand, to be read and changed."""
    return Path(shutil.copytree(deck_after_its_run, tmp_path / "hand"))


def test_a_deck_that_was_not_run_is_refused_with_the_command(folder: Path) -> None:
    with pytest.raises(InputError, match=r"the deck was not run .*; do: cd .* && sh run\.sh"):
        run_case(folder)


def test_a_deck_run_by_hand_has_the_dump_of_the_program(
    finished: Path, run_directory: Callable[..., Path]
) -> None:
    dump = run_directory(run=SHORT) / FIRST_SEGMENT / "beads.bin"
    assert (finished / "beads.bin").read_bytes() == dump.read_bytes()


def test_a_deck_run_by_hand_has_the_result_of_the_program(
    finished: Path, run_directory: Callable[..., Path]
) -> None:
    by_hand = run_case(finished)
    by_program = run_case(run_directory(run=SHORT))
    assert {**by_hand.result, "by_hand": 0} == {**by_program.result, "by_hand": 0}
    assert by_hand.case.document == make_case(run=SHORT).document


def test_a_deck_run_by_hand_says_so(finished: Path) -> None:
    run = run_case(finished)
    assert run.result.about["by_hand"] == ["run by hand"]
    assert "warning: run by hand" in run.describe()
    assert "(already run)" not in run.describe()


@pytest.mark.parametrize("command", ["run", "plot", "export --format vtk", "check files"])
def test_a_deck_run_by_hand_is_a_run_for_commands(finished: Path, command: str) -> None:
    run_case(finished)
    assert call(*command.split(), str(finished)).returncode == 0


def test_a_deck_run_by_hand_is_measured_once(finished: Path) -> None:
    run_case(finished)
    written = (finished / "result.json").stat().st_mtime_ns
    run_case(finished)
    assert (finished / "result.json").stat().st_mtime_ns == written


@dataclass(frozen=True)
class Edit:
    """Parameters of a deck that are edited, and what the case is by then.

    Attributes
    ----------
    parameters
        Parameters of the deck with their new values.
    changes
        The same as changes of the case.
    tables
        Tables of the case whose deck is edited, beside those of the reference.
    """

    parameters: dict[str, str]
    changes: dict[str, Any]
    tables: dict[str, Any] = field(default_factory=dict)

    @property
    def original(self) -> Case:
        """The case of the deck as it was written."""
        return build_case({**document(run=SHORT), **self.tables}, name="test")

    @property
    def expected(self) -> Case:
        """The case of the edited deck."""
        tables = changed(CaseFile, {**document(run=SHORT), **self.tables}, self.changes)
        return build_case(tables, name="test")


RAMP = {**REFERENCE["drive"], "ramp": [["0.01 s", 0.5], ["0.06 s", 1.25]]}
TONES = [
    {"frequency": "80 Hz", "peak_acceleration": "2 g"},
    {"axis": "y", "frequency": "160 Hz", "peak_acceleration": "1 g", "phase": "90 deg"},
]
PEAK = changed_case(make_case(), {"drive.gamma0": 0.4}).drive.peak_acceleration
"""Of Γ0 = 0.4 with beads of the density as it was, in m/s²."""
LIQUID = {
    "volume_fraction": 0.01,
    "contact_angle": "0 deg",
    "surface_tension": "20 mN/m",
    "density": "1 g/cm^3",
    "kinematic_viscosity": "5 mm^2/s",
    "viscosity_ratio": 2.0,
}
GROWING = {
    "bead_bead": {"at_rest": 0.05, "rise": 0.4, "half_rise_velocity": "80 mm/s"},
    "bead_wall": 0.25,
}
EDITS: dict[str, Edit] = {
    # A ω² with A = 0.116 mm and ω = 2π · 80 Hz.
    "amplitude": Edit(
        parameters={"amplitude": "1.16e-4"},
        changes={"drive.peak_acceleration": f"{1.16e-4 * (160.0 * pi) ** 2!r} m/s^2"},
    ),
    "frictions": Edit(
        parameters={"friction_bead_wall": "0.2", "restitution": "0.5"},
        changes={"contact.friction.bead_wall": 0.2, "contact.restitution": 0.5},
    ),
    "a friction that grows with the velocity": Edit(
        tables={"contact": {**REFERENCE["contact"], "friction": GROWING}},
        parameters={
            "friction_bead_bead": "0.04",
            "friction_rise_bead_bead": "0.3",
            "friction_velocity_bead_bead": "0.05",
        },
        changes={
            "contact.friction.bead_bead": {
                "at_rest": 0.04,
                "rise": 0.3,
                "half_rise_velocity": "50 mm/s",
            },
        },
    ),
    # A third of the cycles settles, as before.
    "length": Edit(
        parameters={"cycles": "9"},
        changes={"run.cycles": 9, "run.settling_cycles": 3},
    ),
    "frequency of a ramp": Edit(
        tables={"drive": RAMP},
        parameters={"frequency": "70.0"},
        changes={"drive.frequency": "70 Hz"},
    ),
    "two tones and their cycle": Edit(
        tables={"drive": {"harmonics": TONES}},
        parameters={"frequency_1": "60.0", "frequency_2": "120.0", "cycle_frequency": "60.0"},
        changes={
            "drive.harmonics[0].frequency": "60 Hz",
            "drive.harmonics[1].frequency": "120 Hz",
        },
    ),
    # The deck has the acceleration, which an edited density does not change, but Γ0.
    "Γ0 with another density": Edit(
        tables={"drive": {"frequency": "80 Hz", "gamma0": 0.4}},
        parameters={"density": "4200.0"},
        changes={"beads.density": "4.2 g/cm^3", "drive.peak_acceleration": f"{PEAK!r} m/s^2"},
    ),
    # The deck has the viscosity of bridges, which is that of the liquid times the ratio.
    "a kinematic viscosity": Edit(
        tables={"liquid": LIQUID},
        parameters={"viscosity": "0.004"},
        changes={"liquid.dynamic_viscosity": "4 mPa*s", "liquid.viscosity_ratio": 1.0},
    ),
    # 1 / (80 Hz · 2000) = 6.25 µs.
    "a time step beyond the limits": Edit(
        tables={"run": {**SHORT, "time_step": "2 us"}},
        parameters={"steps_per_cycle": "2000"},
        changes={"run.time_step": "6.25 us", "run.allow_unstable": True},
    ),
    "an uncertain value": Edit(
        tables={"uncertain": {"contact.restitution": [0.2, 0.4]}},
        parameters={"restitution": "0.5"},
        changes={"contact.restitution": 0.5, "uncertain": {}},
    ),
}
SAME_START = ["amplitude", "frictions", "length", "frequency of a ramp"]
"""Edits after which walkers start, and the engine steps, as in the case with these values."""


def _physical_numbers(case: Case) -> list[float]:
    """What parameters of a deck determine, but for the length of the run."""
    liquid = case.liquid.of_bridges
    numbers = [
        case.beads.density,
        case.environment.gravity,
        liquid.surface_tension,
        liquid.viscosity,
        case.run.period,
        *case.contact.friction.between_beads,
        *case.contact.friction.at_walls,
        case.contact.restitution,
        case.contact.youngs_modulus,
    ]
    for sine in case.excitation.harmonics:
        numbers += [*sine.direction, sine.frequency, sine.peak_acceleration, sine.phase]
    return numbers


def _length_of_run(case: Case) -> list[int]:
    """Cycles and samples of a run."""
    run = case.run
    return [run.cycles, run.settling_cycles, run.samples_per_cycle, run.cycles_per_sample]


@pytest.fixture(scope="session")
def edited_run(once: Once) -> Callable[[str], Run]:
    """Runs of edited decks, by the name of the edit."""

    def made(name: str) -> Run:
        edit = EDITS[name]

        def fill(folder: Path) -> None:
            hand = write_folder(edit.original, folder / "hand").parent
            _edit(hand, edit.parameters)
            _run(hand)
            run_case(hand)

        return run_case(once(f"edited-{list(EDITS).index(name)}", fill) / "hand")

    return made


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_deck_is_another_case(name: str, edited_run: Callable[[str], Run]) -> None:
    case = edited_run(name).case
    expected = EDITS[name].expected
    assert _physical_numbers(case) == pytest.approx(_physical_numbers(expected), rel=1e-9)
    assert _length_of_run(case) == _length_of_run(expected)
    assert case.drive.ramp == expected.drive.ramp


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_deck_has_the_steps_per_cycle_that_it_says(
    name: str, edited_run: Callable[[str], Run]
) -> None:
    """Unless they are edited, those of the deck as it was written."""
    steps = EDITS[name].original.run.steps_per_cycle
    if name == "a time step beyond the limits":
        steps = 2000
    assert edited_run(name).case.run.steps_per_cycle == steps


@pytest.mark.parametrize("name", EDITS)
def test_walkers_of_an_edited_deck_start_where_they_stood(
    name: str, edited_run: Callable[[str], Run]
) -> None:
    """Their spacing depends on the drive, but no parameter moves them."""
    spacings = [kind.spacing for kind in edited_run(name).case.walkers]
    assert spacings == [kind.spacing for kind in EDITS[name].original.walkers]


@pytest.mark.parametrize("name", EDITS)
def test_the_case_of_an_edited_deck_can_be_changed(
    name: str, edited_run: Callable[[str], Run]
) -> None:
    """Its tables are those of a case file."""
    again = changed_case(edited_run(name).case, {"title": "again"})
    expected = _physical_numbers(EDITS[name].expected)
    assert _physical_numbers(again) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", EDITS)
def test_the_result_of_an_edited_deck_names_the_edits(
    name: str, edited_run: Callable[[str], Run]
) -> None:
    parameters = EDITS[name].parameters
    edits = edited_run(name).result.about["by_hand"][1]
    for parameter in parameters:
        assert re.search(rf"[ :]{parameter} \S+, was [\d.e-]+", edits)
    assert edits.count(", was ") == len(parameters)


@pytest.mark.parametrize("name", SAME_START)
def test_an_edited_deck_has_the_velocity_of_its_case(
    name: str, edited_run: Callable[[str], Run], run_directory: Callable[..., Path]
) -> None:
    """Within 1 %: the walker starts, and a ramp is rounded, as in the case as it was."""
    expected = run_case(run_directory(EDITS[name].expected)).result["velocity"]
    assert edited_run(name).result["velocity"] == pytest.approx(expected, rel=1e-2)


def _given_keys(case: Case, original: Case) -> set[str]:
    """Keys of given values that differ between two cases; the settling follows the length."""
    keys, _ = differing([flattened(case), flattened(original)])
    return set(keys) - {"run.settling_cycles"}


@pytest.mark.parametrize("name", SAME_START)
def test_the_case_of_an_edited_deck_gives_the_edits_alone(
    name: str, edited_run: Callable[[str], Run]
) -> None:
    """Commands list what differs from the case as it was."""
    edit = EDITS[name]
    keys = _given_keys(edited_run(name).case, edit.original)
    assert keys == _given_keys(edit.expected, edit.original)


def test_a_deck_that_is_edited_and_run_again_is_read_again(finished: Path) -> None:
    """At 20 m/s² instead of 39.2 m/s² (4 g) the walker is slower. A comment is no edit."""
    first = run_case(finished).result["velocity"]
    _edit(finished, {"peak_acceleration": "20.0"})
    _replace(finished, "nve/sphere", "nve/sphere  # as ever")
    _replace(finished, "delay 0", "delay 1")
    _run(finished)
    again = run_case(finished).result
    assert again["velocity"] < first
    assert "peak_acceleration 20, was 39.2; 1 other line(s)" in again.about["by_hand"][1]
    listed = call("list", "--out", str(finished.parent)).stdout
    assert " finished: edited and run by hand " in listed


def test_a_deck_that_is_edited_after_its_run_is_reported(finished: Path) -> None:
    run_case(finished)
    _edit(finished, {"restitution": "0.5"})
    assert "walker.lig is newer than" in run_case(finished).result.about["by_hand"][-1]


def test_a_deck_run_by_hand_is_not_taken_for_a_run_with_other_values(finished: Path) -> None:
    run_case(finished)
    with pytest.raises(InputError, match=r"no finished run in .*'drive.frequency': '70 Hz'"):
        walkers.load(finished, changes={"drive.frequency": "70 Hz"})


def _assert_refused(folder: Path, message: str) -> None:
    """A deck is refused in one line, and is no finished run."""
    with pytest.raises(InputError, match=message) as caught:
        take_in(folder)
    assert len(str(caught.value).splitlines()) == 1
    assert not (folder / "manifest.json").exists()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        pytest.param(
            {"time_step": "3e-6"},
            "not one cycle of 80 Hz .*edit steps_per_cycle",
            id="steps that are no cycle",
        ),
        pytest.param({"restitution": "high"}, "cannot be read .*'high'", id="a word for a number"),
        pytest.param(
            {"youngs_modulus": "2e6"},
            r"the edited deck: contact\.youngs_modulus = \"2",
            id="a value that no case has",
        ),
    ],
)
def test_a_parameter_that_no_case_can_have_is_refused(
    parameters: dict[str, str], message: str, folder: Path
) -> None:
    _edit(folder, parameters)
    _run(folder)
    _assert_refused(folder, message)


def test_an_error_of_the_engine_in_a_run_by_hand_is_reported(folder: Path) -> None:
    """A command of the deck has an argument too many."""
    _replace(folder, "pair_coeff      * *", "pair_coeff * * 3")
    _run(folder)
    _assert_refused(folder, "failed: the engine stopped: ERROR")


def test_a_run_by_hand_that_was_stopped_is_reported(folder: Path) -> None:
    _edit(folder, {"cycles": "4000", "peak_acceleration": "1.0"})
    _run_and_kill(folder)
    _assert_refused(folder, "still runs or was stopped")
