"""Bad input: one message that names file, key, value and what was expected; exit status 2; no traceback."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import call, document, make_case, to_toml
from walkers.inputs import InputError, resolve_case
from walkers.templates import render_deck

# name: (changed tables, key in the message, value in the message, expectation in the message)
BAD: dict[str, tuple[dict[str, Any], str, str, str]] = {
    "radius without unit": (
        {"dimers": {"radii": ["0.3", "0.2 mm"]}},
        "dimers.radii[0]",
        '"0.3"',
        "length with its unit",
    ),
    "radius as number": ({"dimers": {"radii": [0.3, "0.2 mm"]}}, "dimers.radii[0]", "0.3", '"0.3 mm"'),
    "radius in the wrong unit": ({"dimers": {"radii": ["0.3 g", "0.2 mm"]}}, "dimers.radii[0]", '"0.3 g"', "length"),
    "negative radius": ({"dimers": {"radii": ["-0.3 mm", "0.2 mm"]}}, "dimers.radii[0]", '"-0.3 mm"', "more than zero"),
    "zero radius": ({"dimers": {"radii": ["0.3 mm", "0 mm"]}}, "dimers.radii[1]", '"0 mm"', "more than zero"),
    "decimal comma": ({"dimers": {"radii": ["0,3 mm", "0.2 mm"]}}, "dimers.radii[0]", '"0,3 mm"', "length"),
    "misspelt unit": ({"dimers": {"radii": ["0.3 mmm", "0.2 mm"]}}, "dimers.radii[0]", '"0.3 mmm"', "length"),
    "unit without number": ({"dimers": {"radii": ["mm", "0.2 mm"]}}, "dimers.radii[0]", '"mm"', "length"),
    "two quantities": ({"dimers": {"radii": ["0.3 mm; 2", "0.2 mm"]}}, "dimers.radii[0]", '"0.3 mm; 2"', "length"),
    "infinite radius": ({"dimers": {"radii": ["1e999 mm", "0.2 mm"]}}, "dimers.radii[0]", '"1e999 mm"', "finite"),
    "one radius": ({"dimers": {"radii": ["0.3 mm"]}}, "dimers.radii", '["0.3 mm"]', "two radii"),
    "three radii": ({"dimers": {"radii": ["0.3 mm"] * 3}}, "dimers.radii", '["0.3 mm"', "two radii"),
    "radii not a list": ({"dimers": {"radii": "0.3 mm"}}, "dimers.radii", '"0.3 mm"', "list"),
    "unknown material": ({"beads": {"material": "rubi"}}, "beads.material", '"rubi"', 'did you mean "ruby"'),
    "material not text": ({"beads": {"material": 3}}, "beads.material", "3", "text"),
    "density as number": ({"beads": {"density": 4000}}, "beads.density", "4000", "density with its unit"),
    "unknown liquid": ({"liquid": {"name": "Si AK 5"}}, "liquid.name", '"Si AK 5"', 'did you mean "Si AK5"'),
    "fraction in per cent": ({"liquid": {"volume_fraction": "1 %"}}, "liquid.volume_fraction", '"1 %"', "plain number"),
    "fraction zero": ({"liquid": {"volume_fraction": 0}}, "liquid.volume_fraction", "0", "at least "),
    "fraction too large": ({"liquid": {"volume_fraction": 1.0}}, "liquid.volume_fraction", "1.0", "at most 0.5"),
    "angle without unit": ({"liquid": {"contact_angle": "0.5"}}, "liquid.contact_angle", '"0.5"', "angle"),
    "angle too large": ({"liquid": {"contact_angle": "120 deg"}}, "liquid.contact_angle", '"120 deg"', "at most"),
    "negative tension": (
        {"liquid": {"surface_tension": "-19 mN/m"}},
        "liquid.surface_tension",
        '"-19 mN/m"',
        "more than zero",
    ),
    "two viscosities": (
        {"liquid": {"dynamic_viscosity": "5 mPa*s", "kinematic_viscosity": "5 mm^2/s"}},
        "liquid.dynamic_viscosity",
        '"5 mPa*s"',
        "not both",
    ),
    "unknown key": ({"liquid": {"volume_fracton": 0.01}}, "liquid.volume_fracton", "0.01", '"volume_fraction"?'),
    "unknown table": ({"boundry": {"material": "glass"}}, "boundry", "glass", 'did you mean "boundary"'),
    "key in the wrong table": ({"frequency": "80 Hz"}, "frequency", '"80 Hz"', 'did you mean "drive.frequency"'),
    "negative friction": (
        {"contact": {"friction": {"bead_wall": -0.1}}},
        "contact.friction.bead_wall",
        "-0.1",
        "at least 0",
    ),
    "friction as text": (
        {"contact": {"friction": {"bead_wall": "0.1"}}},
        "contact.friction.bead_wall",
        '"0.1"',
        "plain number",
    ),
    "friction not a table": ({"contact": {"friction": 0.1}}, "contact.friction", "0.1", "table"),
    "restitution above one": ({"contact": {"restitution": 1.2}}, "contact.restitution", "1.2", "at most 1"),
    "restitution zero": ({"contact": {"restitution": 0}}, "contact.restitution", "0", "more than 0.05"),
    "modulus as density": (
        {"contact": {"youngs_modulus": "50 kg/m^3"}},
        "contact.youngs_modulus",
        '"50 kg/m^3"',
        "modulus",
    ),
    "modulus too soft": (
        {"contact": {"youngs_modulus": "1 MPa"}},
        "contact.youngs_modulus",
        '"1 MPa"',
        "at least 5e+06 Pa",
    ),
    "separation zero": (
        {"contact": {"minimum_separation_ratio": 0}},
        "contact.minimum_separation_ratio",
        "0",
        "at least ",
    ),
    "mass for an acceleration": (
        {"drive": {"peak_acceleration": "4 kg"}},
        "drive.peak_acceleration",
        '"4 kg"',
        '"4 g"',
    ),
    "acceleration without unit": (
        {"drive": {"peak_acceleration": "4"}},
        "drive.peak_acceleration",
        '"4"',
        "acceleration",
    ),
    "negative acceleration": (
        {"drive": {"peak_acceleration": "-4 g"}},
        "drive.peak_acceleration",
        '"-4 g"',
        "zero or more",
    ),
    "acceleration and gamma0": ({"drive": {"gamma0": 0.5}}, "drive.gamma0", "0.5", "not both"),
    "frequency in mm": ({"drive": {"frequency": "80 mm"}}, "drive.frequency", '"80 mm"', '"80 Hz"'),
    "angular frequency": ({"drive": {"frequency": "500 rad/s"}}, "drive.frequency", '"500 rad/s"', "cycles a second"),
    "unknown axis": ({"drive": {"axis": "w"}}, "drive.axis", '"w"', "'x', 'y' or 'z'"),
    "unknown frame": ({"drive": {"frame": "labs"}}, "drive.frame", '"labs"', 'did you mean "lab"'),
    "no replicates": ({"dimers": {"replicates": 0}}, "dimers.replicates", "0", "at least 1"),
    "half a replicate": ({"dimers": {"replicates": 1.5}}, "dimers.replicates", "1.5", "whole number"),
    "true replicates": ({"dimers": {"replicates": True}}, "dimers.replicates", "true", "whole number"),
    "unknown facing": ({"dimers": {"facing": "north"}}, "dimers.facing", '"north"', "'both', 'right', 'left'"),
    "beads apart": ({"dimers": {"gap": "1 um"}}, "dimers.gap", '"1 um"', "zero or less"),
    "beads overlap": ({"dimers": {"gap": "-50 um"}}, "dimers.gap", '"-50 um"', "overlap"),
    "walkers overlap": ({"dimers": {"replicates": 2, "spacing": "0.5 mm"}}, "dimers.spacing", '"0.5 mm"', "overlap"),
    "step over the limit": ({"run": {"time_step": "20 us"}}, "run.time_step", '"20 us"', "rayleigh"),
    "step not a time": ({"run": {"time_step": "2"}}, "run.time_step", '"2"', "time with its unit"),
    "settling too long": ({"run": {"cycles": 10, "settling_cycles": 10}}, "run.settling_cycles", "10", "at most"),
    "uneven bridges": ({"run": {"bridge_samples_per_cycle": 3}}, "run.bridge_samples_per_cycle", "3", "divisor"),
    "unstable not a truth": (
        {"run": {"allow_unstable": "yes please"}},
        "run.allow_unstable",
        "yes please",
        "true or false",
    ),
    "seed of a start": ({"dimers": {"seed": 2}}, "dimers.seed", "2", 'did you mean "run.seed"'),
    "tilt of a number": ({"boundary": {"tilt": 30}}, "boundary.tilt", "30", "angle with its unit"),
    "tilt too far": ({"boundary": {"tilt": "100 deg"}}, "boundary.tilt", '"100 deg"', "at most"),
    "direction of nothing": ({"drive": {"axis": [0, 0, 0]}}, "drive.axis", "[0, 0, 0]", "[1, 0, 1]"),
    "direction of two": ({"drive": {"axis": [1, 0]}}, "drive.axis", "[1, 0]", "[1, 0, 1]"),
    "harmonics and a frequency": (
        {"drive": {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "1 g"}]}},
        "drive.frequency",
        '"80 Hz"',
        "write drive.harmonics[0].frequency",
    ),
    "a phase in the laboratory": (
        {"drive": {"phase": "10 deg", "frame": "lab"}},
        "drive.frame",
        '"lab"',
        '"container"',
    ),
    "table given as text": ({"drive": "x"}, "drive", '"x"', "table"),
}


def _message(*arguments: str) -> str:
    done = call(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.stderr


@pytest.mark.parametrize("name", BAD)
def test_bad_value(name: str, tmp_path: Path) -> None:
    changes, key, value, expected = BAD[name]
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(document(**changes)), encoding="utf-8")
    message = _message("show", str(file))
    assert message.count("\n") == 1, "one problem, one line"
    for part in (str(file), key, value, expected):
        assert part in message


EXTREME: dict[str, dict[str, Any]] = {
    "dimers.radii[0]": {"dimers": {"radii": ["1e200 m", "0.2 mm"]}},
    "dimers.radii[1]": {"dimers": {"radii": ["0.3 mm", "1e-120 mm"]}},
    "beads.density": {"beads": {"density": "1e300 g/cm^3"}},
    "liquid.volume_fraction": {"liquid": {"volume_fraction": 1e-320}},
    "liquid.dynamic_viscosity": {"liquid": {"dynamic_viscosity": "1e305 Pa*s"}},
    "contact.youngs_modulus": {"contact": {"youngs_modulus": "1e200 Pa"}},
    "contact.minimum_separation_ratio": {"contact": {"minimum_separation_ratio": 1e-310}},
    "drive.peak_acceleration": {"drive": {"peak_acceleration": "1e300 g"}},
    "drive.frequency": {"drive": {"frequency": "1e-200 Hz"}},
    "run.time_step": {"run": {"time_step": "1e-320 s"}},
    "run.cycles": {"run": {"cycles": 10**30}},
    "dimers.spacing": {"dimers": {"spacing": "1e300 m"}},
}


@pytest.mark.parametrize("key", EXTREME)
def test_numbers_beyond_anything_physical(key: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(document(**EXTREME[key])), encoding="utf-8")
    message = _message("show", str(file))
    assert f"{key} = " in message
    assert message.count("\n") == 1


def test_more_steps_than_the_engine_can_count(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(document(run={"cycles": 999_999})))
    most = (2**31 - 1) // make_case().run.steps_per_cycle
    assert f"run.cycles = 999999: expected at most {most}: " in _message("show", str(file))


def test_a_right_angle_is_a_contact_angle() -> None:
    assert make_case(liquid={"contact_angle": "90 deg"}).liquid.contact_angle == pytest.approx(1.5707963)


@pytest.mark.parametrize("name", ["teflon", "rough glass"])
def test_a_substrate_of_ones_own_needs_its_friction(name: str) -> None:
    values = document(boundary={"material": name})
    assert resolve_case(values).boundary.material == name
    del values["contact"]["rolling_friction"]
    with pytest.raises(InputError, match=rf'boundary\.material = "{name}": not in the library'):
        resolve_case(values)


def test_a_liquid_may_have_no_viscosity() -> None:
    case = make_case(liquid={"viscosity_ratio": 0})
    assert case.liquid.dynamic_viscosity == 0.0
    resistances = [[float(x) for x in line.split()[2:]] for line in _rows(render_deck(case).files["bridges.txt"])]
    assert len(resistances) > 100
    assert not any(map(any, resistances))


def _rows(tables: str) -> list[str]:
    """The lines of numbers of a deck's bridge tables."""
    return [line for line in tables.splitlines() if line[0] in "0123456789"]


MISSING = {
    "beads": "beads: missing",
    "liquid": "liquid: missing",
    "boundary": "boundary: missing",
    "drive": "drive: missing",
    "dimers": "dimers: missing; expected bodies",
    "dimers.radii": "dimers.radii: missing",
    "beads.material": "beads.material: missing",
    "liquid.name": "liquid.surface_tension: missing",
    "boundary.material": "boundary.material: missing",
    "drive.frequency": "drive.frequency: missing",
    "drive.peak_acceleration": "drive.peak_acceleration: missing",
}


@pytest.mark.parametrize("key", MISSING)
def test_missing_key(key: str, tmp_path: Path) -> None:
    values = document()
    table, _, name = key.partition(".")
    if name:
        del values[table][name]
    else:
        del values[table]
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(values), encoding="utf-8")
    assert MISSING[key] in _message("show", str(file))


def test_friction_that_the_library_does_not_know(tmp_path: Path) -> None:
    values = document(beads={"material": "polystyrene"})
    del values["contact"]["friction"]
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(values))
    assert "contact.friction.bead_bead: missing" in _message("show", str(file))


@pytest.mark.parametrize(
    ("contents", "expected"),
    [
        (b"[dimers\nradii = 3", "line 1"),
        (b'[dimers]\nradii = ["0.3 mm", \xff]', "UTF-8"),
        (b"[dimers]\nradii = 1\nradii = 2", "not TOML"),
        (b"", "beads: missing"),
        (b"\x00\x01\x02", "not TOML"),
        (b"a = " + b"9" * 5000, "not TOML"),
        (b"a = " + b"[" * 5000, "not TOML"),
    ],
)
def test_files_that_are_no_cases(contents: bytes, expected: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(contents)
    message = _message("show", str(file))
    assert str(file) in message
    assert expected in message


def test_files_that_are_not_there(tmp_path: Path) -> None:
    assert "no such file" in _message("show", str(tmp_path / "nothing.toml"))
    assert 'did you mean "fig1b"' in _message("show", "fig1")
    assert "cannot be read" in _message("show", str(tmp_path))
    assert "cannot be read" in _message("show", "x" * 300)


def test_several_mistakes_are_told_at_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(to_toml(document(drive={"frequency": "80 mm", "axis": "w"})))
    message = _message("show", str(file))
    assert "drive.frequency" in message
    assert "drive.axis" in message


def test_a_mistake_in_the_last_file_stops_before_the_first_run(in_folder: Path) -> None:
    (in_folder / "bad.toml").write_text(to_toml(document(drive={"frequency": "80 mm"})))
    _message("run", "fig1b", "bad.toml")
    assert not (in_folder / "runs").exists()


@pytest.mark.parametrize("command", ["result", "plot", "vtk", "render", "film", "paraview"])
def test_runs_that_are_not_there(command: str, in_folder: Path) -> None:
    assert "no finished run in runs; first do: walkers run fig1b" in _message(command, "fig1b")
    (in_folder / "empty").mkdir()
    assert "not a finished run" in _message(command, "empty")
    (in_folder / "broken").mkdir()
    (in_folder / "broken" / "manifest.json").write_text("{")
    assert "manifest.json cannot be read" in _message(command, "broken")


@pytest.mark.parametrize(
    "arguments",
    [["show"], ["shw", "fig1b"], ["run", "fig1b", "--limit", "-1"], ["run", "fig1b", "--no-such-option"], ["run"]],
)
def test_misuse_of_the_program(arguments: list[str]) -> None:
    assert _message(*arguments).strip()


LONG = "x" * 100_000


@pytest.mark.parametrize(
    "words",
    [
        ("show", "base.toml", "--set", f"drive.frequency={LONG}"),
        ("show", "base.toml", "--set", f"{LONG}=3"),
        ("show", "base.toml", "--set", f"liquid.name={LONG}"),
        ("sweep", "value.toml"),
        ("sweep", "key.toml"),
        ("plot", "base.toml", "--format", LONG),
    ],
)
def test_long_values_are_quoted_in_part(words: tuple[str, ...], in_folder: Path) -> None:
    (in_folder / "base.toml").write_text(to_toml(document()))
    (in_folder / "value.toml").write_text(f'case = "base.toml"\n[axes]\ndrive.frequency = ["{LONG}"]\n')
    (in_folder / "key.toml").write_text(f'case = "base.toml"\n[axes]\n"{LONG}" = [1]\n')
    message = _message(*words)
    assert message.count("\n") == 1
    assert "xxx" in message or "no finished run" in message
    assert len(message) < 1500


def test_a_value_of_several_lines_is_one_line_of_a_message(in_folder: Path) -> None:
    (in_folder / "sweep.toml").write_text('case = "one\\ntwo\\u001b[31m"\n')
    message = _message("sweep", "sweep.toml")
    assert message.count("\n") == 1
    assert message.rstrip("\n").isprintable()


def test_misuse_of_the_program_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "walkers.main", "show"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()


def test_a_step_over_the_limit_is_taken_if_the_case_insists() -> None:
    assert make_case(run={"time_step": "20 us", "allow_unstable": True}).run.time_step > 19e-6
