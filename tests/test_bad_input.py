"""Bad input: one message that names file, key, value and what was expected; exit status 2; no traceback."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import call, document, make_case, to_toml
from walkers.inputs import InputError, resolve_case
from walkers.templates import render_deck

GLASS = {"material": "glass"}
WALKER = {"radii": ["0.3 mm", "0.2 mm"]}


def cluster(arrangement: str, *radii: str) -> dict[str, Any]:
    """Tables with one cluster, and no dimers."""
    return {"clusters": [{"arrangement": arrangement, "radii": list(radii)}], "dimers": None}


def at(*places: list[str], radii: tuple[str, str] = ("0.3 mm", "0.2 mm")) -> dict[str, Any]:
    """Tables with a cluster whose beads are given places, and no dimers."""
    return {"clusters": [{"radii": list(radii), "at": list(places)}], "dimers": None}


def bead(radius: str, x: str, z: str = "1 mm") -> dict[str, Any]:
    """A bead that is placed."""
    return {"radius": radius, "at": [x, "0 mm", z]}


HARMONICS = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "1 g"}]}
# Changed tables (None: left out), and what the message says after the file.
BAD: list[tuple[dict[str, Any], str]] = [
    # Quantities
    ({"dimers": {"radii": ["0.3", "0.2 mm"]}}, 'dimers.radii[0] = "0.3": expected a length with its unit'),
    ({"dimers": {"radii": ["0.3 mm", "0 mm"]}}, "must be more than zero"),
    ({"dimers": {"radii": ["1e999 mm", "0.2 mm"]}}, 'dimers.radii[0] = "1e999 mm": expected a length'),
    ({"beads": {"density": 4000}}, "beads.density = 4000: expected a density with its unit"),
    ({"drive": {"peak_acceleration": "-4 g"}}, "must be zero or more"),
    ({"drive": {"frequency": "500 rad/s"}}, "(cycles a second, not an angular frequency)"),
    ({"contact": {"youngs_modulus": "1 MPa"}}, "must lie within 5e+06 and 1e+09 Pa"),
    ({"liquid": {"contact_angle": "120 deg"}}, "must lie within 0 and 1.5708 rad"),
    # Numbers, lists, tables, names
    ({"dimers": {"radii": ["0.3 mm"]}}, 'dimers.radii = ["0.3 mm"]: too short; expected two radii'),
    ({"dimers": {"radii": "0.3 mm"}}, 'dimers.radii = "0.3 mm": expected a list'),
    ({"beads": {"material": 3}}, "beads.material = 3: expected text"),
    ({"liquid": {"volume_fraction": "1 %"}}, 'liquid.volume_fraction = "1 %": expected a plain number'),
    ({"contact": {"friction": 0.1}}, "contact.friction = 0.1: expected a table"),
    ({"contact": {"restitution": 1.2}}, "contact.restitution = 1.2: expected at most 1"),
    ({"contact": {"restitution": 0}}, "expected more than 0.05"),
    ({"drive": {"axis": "w"}}, "drive.axis = \"w\": expected 'x', 'y' or 'z'"),
    ({"drive": {"frame": "labs"}}, 'did you mean "lab"'),
    ({"dimers": {"replicates": 1.5}}, "expected a whole number"),
    ({"run": {"allow_unstable": "yes please"}}, "expected true or false"),
    ({"drive": "x"}, 'drive = "x": expected a table'),
    ({"beads": {"material": "rubi"}}, 'beads.material = "rubi": not in the library'),
    ({"liquid": {"name": "Si AK 5"}}, 'did you mean "Si AK5"'),
    # Keys
    ({"liquid": {"volume_fracton": 0.01}}, 'liquid.volume_fracton = 0.01: unknown key; [liquid] takes name, '),
    ({"frequency": "80 Hz"}, 'frequency = "80 Hz": unknown key; a case takes '),
    ({"dimers": {"seed": 2}}, 'did you mean "run.seed"'),
    # What contradicts something else
    ({"liquid": {"dynamic_viscosity": "5 mPa*s", "kinematic_viscosity": "5 mm^2/s"}}, "not both"),
    ({"drive": {"gamma0": 0.5}}, "drive.gamma0 = 0.5: expected either peak_acceleration or gamma0, not both"),
    ({"drive": HARMONICS}, 'drive.frequency = "80 Hz": expected none beside drive.harmonics: write drive.harmonics['),
    ({"drive": {"phase": "10 deg", "frame": "lab"}}, 'drive.frame = "lab": expected "container"'),
    ({"run": {"time_step": "20 us"}}, 'run.time_step = "20 us": beyond the rayleigh'),
    ({"run": {"cycles": 10, "settling_cycles": 10}}, "run.settling_cycles = 10: expected at most"),
    ({"run": {"bridge_samples_per_cycle": 3}}, "run.bridge_samples_per_cycle = 3: expected a divisor"),
    ({"run": {"cycles": 999_999}}, f"run.cycles = 999999: expected at most {(2**31 - 1) // 3200}: "),
    ({"run": {"cycles": 20, "frames_per_second": 4.0}}, "run.frames_per_second"),
    ({"run": {"ranks": 2}}, "run.ranks = 2"),
    # Bodies and boundaries
    ({"dimers": {"radii": None, "mean_radius": "0.2 mm"}}, "dimers.sin_delta: missing"),
    ({"dimers": {"sin_delta": 0.2}}, "dimers.sin_delta = 0.2: expected either the radii or"),
    ({"dimers": {"gap": "1 um"}}, 'dimers.gap = "1 um": expected zero or less'),
    ({"dimers": {"gap": "-50 um"}}, "overlap by more than 2 %"),
    ({"dimers": {"replicates": 2, "spacing": "0.5 mm"}}, 'dimers.spacing = "0.5 mm": neighbouring walkers would touch'),
    ({"dimers": {"replicates": 4, "spacing": "0.9 mm", "meet": True}}, "expected at least 0.99 mm"),
    (cluster("star", "0.3 mm", "0.2 mm"), 'arrangement = "star": expected one of chain, fan, diamond, ring, raft'),
    (cluster("ring", "0.3 mm", "0.2 mm"), "clusters[0].radii"),
    (cluster("raft", "0.3 mm", "0.2 mm", "0.2 mm"), "a raft takes beads of one radius"),
    (cluster("diamond", "0.3 mm", "0.2 mm", "0.2 mm"), "expected 4 beads in a diamond"),
    (cluster("chain", "0.3 mm", "0.05 mm", "0.3 mm"), "beads 1 and 3 would overlap in a chain"),
    (cluster("fan", "0.3 mm", *["0.2 mm"] * 12), "so many beads do not fit around the first one"),
    ({"clusters": [WALKER]}, "expected either an arrangement"),
    (at(["0 mm", "0 mm"], ["-1 mm", "0 mm"]), "nothing joins this one to the first"),
    (at(["0 mm", "0 mm"]), "expected a place for each"),
    (at(["0 mm", "0 mm"], ["0.1 mm", "0 mm"]), "clusters[0].at[1]"),
    (at(["0 mm", "0.3 mm"], ["0 mm", "-0.3 mm"], radii=("0.3 mm", "0.3 mm")), "this has no heading"),
    ({"dimers": {"radii": ["0.5 mm", "0.2 mm"]}, "boundary": {"shape": "groove", "opening": "30 deg"}},
     "so unlike beads rest at heights at which they do not touch"),
    ({"boundary": {"shape": "groove", **GLASS}}, "boundary.opening: missing"),
    ({"boundary": {"width": "1 mm", **GLASS}}, 'boundary.width = "1 mm": expected none of a plane'),
    ({**cluster("fan", "0.3 mm", "0.2 mm", "0.2 mm"), "boundary": {"shape": "channel", "width": "0.7 mm"}},
     "do not fit between the walls"),
    ({"placed": [bead("1 mm", "9 mm"), bead("0.1 mm", "30 mm"), bead("0.5 mm", "10.4 mm")]}, "overlaps with placed[0]"),
    ({"placed": [bead("1 mm", "9 mm", "0.9 mm")]}, "expected a bead within the boundary"),
    # What is missing
    ({"dimers": None}, "dimers: missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]"),
    ({"beads": {"material": None}}, "beads.density: missing; expected such as"),
    ({"drive": {"frequency": None}}, "drive.frequency: missing"),
    ({"drive": {"peak_acceleration": None}}, "drive.peak_acceleration: missing"),
    ({"beads": {"material": "polystyrene"}, "contact": {"friction": None}}, "contact.friction: missing"),
]  # fmt: skip


def _said(tables: dict[str, Any]) -> dict[str, Any]:
    """Tables without what is None in them."""
    said = {key: _said(value) if isinstance(value, dict) else value for key, value in tables.items()}
    return {key: value for key, value in said.items() if value is not None}


@pytest.mark.parametrize(("changes", "told"), BAD)
def test_bad_values(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as caught:
        resolve_case(_said(document(**changes)), source="bad.toml")
    message = str(caught.value)
    assert told in message
    assert message.startswith("bad.toml: ")
    assert message.count("\n") == 0, "one problem, one line"


def _message(*arguments: str) -> str:
    done = call(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.stderr


def test_several_mistakes_are_told_at_once_and_before_the_first_run(in_folder: Path) -> None:
    (in_folder / "bad.toml").write_text(to_toml(document(drive={"frequency": "80 mm", "axis": "w"})))
    message = _message("run", "fig1b", "bad.toml")
    assert 'bad.toml: drive.frequency = "80 mm"' in message
    assert "bad.toml: drive.axis" in message
    assert not (in_folder / "runs").exists()


@pytest.mark.parametrize("name", ["teflon", "rough glass"])
def test_a_substrate_of_ones_own_needs_its_friction(name: str) -> None:
    values = document(boundary={"material": name})
    assert resolve_case(values).boundary.material == name
    del values["contact"]["rolling_friction"]
    with pytest.raises(InputError, match=rf'boundary\.material = "{name}": not in the library'):
        resolve_case(values)


def test_a_liquid_may_have_no_viscosity_and_wet_no_better_than_to_90_degrees() -> None:
    assert make_case(liquid={"contact_angle": "90 deg"}).liquid.contact_angle == pytest.approx(1.5707963)
    assert make_case(run={"time_step": "20 us", "allow_unstable": True}).run.time_step > 19e-6
    case = make_case(liquid={"viscosity_ratio": 0})
    assert case.liquid.dynamic_viscosity == 0.0
    tables = render_deck(case).files["bridges.txt"].splitlines()
    resistances = [[float(number) for number in line.split()[2:]] for line in tables if line[0] in "0123456789"]
    assert len(resistances) > 100
    assert not any(map(any, resistances))


CONTENTS = {
    b"[dimers\nradii = 3": "line 1",
    b'[dimers]\nradii = ["0.3 mm", \xff]': "UTF-8",
    b"": "beads: missing",
    b"\x00\x01\x02": "not TOML",
    b"a = " + b"9" * 5000: "not TOML",
    b"a = " + b"[" * 5000: "not TOML",
}


def test_files_that_are_no_cases_or_not_there(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    for contents, expected in CONTENTS.items():
        file.write_bytes(contents)
        message = _message("show", str(file))
        assert message.startswith(f"walkers: {file}: ")
        assert expected in message
    for name, told in (
        (str(tmp_path / "nothing.toml"), "no such file"),
        ("fig1", 'did you mean "fig1b"'),
        (str(tmp_path), "cannot be read"),
        ("x" * 300, "cannot be read"),
    ):
        assert told in _message("show", name)


@pytest.mark.parametrize("command", ["result", "plot", "vtk", "render", "film", "paraview"])
def test_runs_that_are_not_there(command: str, in_folder: Path) -> None:
    assert "no finished run in runs; first do: walkers run fig1b" in _message(command, "fig1b")
    (in_folder / "empty").mkdir()
    assert "not a finished run" in _message(command, "empty")
    (in_folder / "empty" / "manifest.json").write_text("{")
    assert "manifest.json cannot be read" in _message(command, "empty")


def test_misuse_of_the_program() -> None:
    for arguments in (
        ["shw", "fig1b"],
        ["run", "fig1b", "--limit", "-1"],
        ["run", "fig1b", "--no-such-option"],
        ["run"],
    ):
        assert _message(*arguments).strip()
    done = subprocess.run([sys.executable, "-m", "walkers.main", "show"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, "Traceback" in done.stderr) == (2, "", False)


def test_long_values_and_those_of_several_lines_are_quoted_on_one(in_folder: Path) -> None:
    long = "x" * 100_000
    (in_folder / "base.toml").write_text(to_toml(document()))
    (in_folder / "value.toml").write_text(f'case = "base.toml"\n[axes]\ndrive.frequency = ["{long}"]\n')
    (in_folder / "key.toml").write_text(f'case = "base.toml"\n[axes]\n"{long}" = [1]\n')
    (in_folder / "lines.toml").write_text('case = "one\\ntwo\\u001b[31m"\n')
    settings = (f"drive.frequency={long}", f"{long}=3", f"liquid.name={long}")
    words = [("show", "base.toml", "--set", one) for one in settings]
    words += [("sweep", f"{name}.toml") for name in ("value", "key", "lines")]
    for arguments in (*words, ("plot", "base.toml", "--format", long)):
        message = _message(*arguments)
        assert message.count("\n") == 1
        assert message.rstrip("\n").isprintable()
        assert any(part in message for part in ("xxx", "one two", "no finished run"))
        assert len(message) < 1500
