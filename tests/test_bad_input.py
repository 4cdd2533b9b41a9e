"""Bad input: one message that names file, key, value and what was expected; exit status 2; no traceback."""

import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import SHORT, call, document, make_case, to_toml
from walkers.errors import InputError
from walkers.inputs import units
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.inputs.units import parse_quantity
from walkers.postprocess.results import read
from walkers.templates.deck import render_deck

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


MIXTURE = {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 20}
HARMONICS = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "1 g"}]}
# Changed tables (None: left out), and what the message says after the file.
BAD: list[tuple[dict[str, Any], str]] = [
    # Quantities
    ({"dimers": {"radii": ["0.3", "0.2 mm"]}}, 'dimers.radii[0] = "0.3": expected a length with its unit'),
    ({"dimers": {"radii": ["0.3 mm", "0 mm"]}}, "must be more than zero"),
    ({"dimers": {"radii": ["1e999 mm", "0.2 mm"]}}, 'dimers.radii[0] = "1e999 mm": expected a length'),
    ({"beads": {"density": 4000}}, "beads.density = 4000: expected a density with its unit"),
    ({"drive": {"peak_acceleration": "-4 g"}}, "must be zero or more"),
    ({"drive": {"peak_acceleration": "1e6 m/s^2"}}, "must lie between 1e-09 and 10000 m/s^2"),
    ({"drive": {"peak_acceleration": "2000 g"}}, "must lie between 1.02e-10 and 1020 g"),
    ({"drive": {"frequency": "500 rad/s"}}, "(cycles per second, not an angular frequency)"),
    ({"contact": {"youngs_modulus": "1 MPa"}}, "must lie between 5 and 100000 MPa"),
    ({"liquid": {"contact_angle": "120 deg"}}, "must lie between 0 and 90 deg"),
    # Numbers, lists, tables, names
    ({"dimers": {"radii": ["0.3 mm"]}}, '["0.3 mm"]: has 1 value; expected 2, such as ["0.3 mm", "0.2 mm"]'),
    ({"dimers": {"radii": "0.3 mm"}}, 'dimers.radii = "0.3 mm": expected a list'),
    ({"beads": {"material": 3}}, "beads.material = 3: expected text"),
    ({"liquid": {"volume_fraction": "1 %"}}, 'liquid.volume_fraction = "1 %": expected a plain number'),
    ({"contact": {"friction": 0.1}}, "contact.friction = 0.1: expected a table"),
    ({"contact": {"restitution": 1.2}}, "contact.restitution = 1.2: expected at most 1"),
    ({"contact": {"restitution": 0}}, "expected more than 0.05"),
    ({"contact": {"friction": {"bead_bead": -0.1}}}, "contact.friction.bead_bead = -0.1: expected "),
    ({"drive": {"axis": "w"}}, "drive.axis = \"w\": expected 'x', 'y' or 'z'"),
    ({"drive": {"frame": "labs"}}, 'did you mean "lab"'),
    ({"run": {"cycles": "allways"}}, 'run.cycles = "allways": expected a whole number, or "auto"'),
    ({"dimers": {"replicates": 1.5}}, "expected a whole number"),
    ({"run": {"allow_unstable": "yes"}}, 'run.allow_unstable = "yes": expected true or false'),
    ({"dimers": {"meet": 1}}, "dimers.meet = 1: expected true or false"),
    ({"clusters": {**WALKER, "arrangement": "chain"}}, ": expected tables [[clusters]]"),
    ({"dimers": None, "placed": [], "clusters": []}, "dimers: missing; expected bodies: "),
    ({"placed": [{"radius": "1 mm", "at": ["1 mm", "1 mm"]}]}, '"1 mm"]: has 2 values; expected 3, such as ["5 mm", '),
    ({"liquid": {"conserved": 1}}, "liquid.conserved = 1: expected true or false"),
    ({"drive": "x"}, 'drive = "x": expected a table'),
    ({"beads": {"material": "rubi"}}, 'beads.material = "rubi": not in the library'),
    ({"liquid": {"name": "Si AK 5"}}, 'did you mean "Si AK5"'),
    # Keys
    ({"liquid": {"volume_fracton": 0.01}}, 'liquid.volume_fracton = 0.01: unknown key; [liquid] takes name, '),
    ({"frequency": "80 Hz"}, 'frequency = "80 Hz": unknown key; a case takes '),
    ({"dimers": {"seed": 2}}, 'did you mean "run.seed"'),
    ({"run": {"steps_per_cycle": 3}}, "run.steps_per_cycle = 3: unknown key; [run] takes time_step, "),
    ({"run": {"until_steady": True}}, "run.until_steady = true: unknown key"),
    *(({name: value}, ": unknown key; a case takes title, beads")
      for name, value in (("name", "x"), ("document", {}), ("sources", {}), ("recorded_law", 1))),
    # What contradicts something else
    ({"liquid": {"dynamic_viscosity": "5 mPa*s", "kinematic_viscosity": "5 mm^2/s"}}, "not both"),
    ({"drive": {"gamma0": 0.5}}, "drive.gamma0 = 0.5: expected either peak_acceleration or gamma0, not both"),
    ({"drive": {**HARMONICS, "peak_acceleration": None}}, "beside drive.harmonics: write drive.harmonics[0].frequency"),
    ({"drive": {"frequency": None, "harmonics": []}}, 'drive.frequency: missing; expected such as "80 Hz", or harm'),
    ({"run": {"duration": "1 s"}}, 'run.duration = "1 s": expected either cycles or duration, not both'),
    ({"dimers": {"diameters": ["0.6 mm", "0.4 mm"]}}, "expected either radii or diameters, not both"),
    ({"clusters": [{**WALKER, "arrangement": "chain", "diameters": ["0.6 mm", "0.4 mm"]}]},
     'clusters[0].diameters = ["0.6 mm", "0.4 mm"]: expected either radii or diameters, not both'),
    ({"placed": [{**bead("1 mm", "9 mm"), "diameter": "2 mm"}]},
     'placed[0].diameter = "2 mm": expected either radius or diameter, not both'),
    ({"dimers": None, "mixture": {**MIXTURE, "small_diameters": ["0.6 mm", "0.63 mm"]}},
     'mixture.small_diameters = ["0.6 mm", "0.63 mm"]: expected either small or small_diameters, not both'),
    ({"drive": {"phase": "10 deg", "frame": "lab"}}, 'drive.frame = "lab": expected "container"'),
    ({"liquid": {"contact_angle": "84 deg"}}, "expected a smaller angle or less liquid: at rest, the"),
    ({"liquid": {"contact_angle": "84 deg"}, "dimers": {"gap": "-1 nm"}}, 'liquid.contact_angle = "84 deg": exp'),
    ({"liquid": {"contact_angle": "90 deg"}, "environment": {"gravity": "0 g"}}, "bead 1 and the boundary apart"),
    ({"run": {"time_step": "20 us"}}, 'run.time_step = "20 us": beyond the rayleigh'),
    ({"run": {"time_step": "3 us"}, "liquid": {"name": "glycerol 87 %"},
      "boundary": {"shape": "groove", "opening": "60 deg"}}, "beyond the viscous limit; expected less than 2.59 us"),
    ({"run": {"cycles": 10, "settling_cycles": 10}}, "run.settling_cycles = 10: expected at most"),
    ({"run": {"bridge_samples_per_cycle": 3}}, "run.bridge_samples_per_cycle = 3: expected a divisor"),
    ({"run": {"cycles": 999_999}}, f"run.cycles = 999999: expected at most {(2**31 - 1) // 3200}: "),
    ({"run": {"cycles": 20, "frames_per_second": 4.0}}, "run.frames_per_second"),
    ({"run": {"ranks": 2}}, "run.ranks = 2"),
    ({"run": {"silence": "20 s"}}, 'run.silence = "20 s": expected none: this key has ended'),
    # Bodies and boundaries
    ({"dimers": {"radii": None, "mean_radius": "0.2 mm"}}, "dimers.sin_delta: missing"),
    ({"dimers": {"sin_delta": 0.2}},
     "dimers.sin_delta = 0.2: expected either radii or mean_radius and sin_delta, not both"),
    ({"dimers": {"gap": "1 um"}}, 'dimers.gap = "1 um": expected zero or less'),
    ({"dimers": {"gap": "-50 um"}}, "overlap by more than 2 % of the smallest radius: expected -4 um or more"),
    ({"dimers": {"radii": ["2 mm", "0.2 mm"]}, "contact": {"youngs_modulus": "5 MPa"}},
     "more than 2 % of the smallest radius: expected a larger modulus, or dimers.gap"),
    ({"dimers": {"replicates": 2, "spacing": "0.5 mm"}}, 'dimers.spacing = "0.5 mm": neighbouring walkers would touch'),
    ({"dimers": {"replicates": 4, "spacing": "0.9 mm", "meet": True}}, "expected at least 0.99 mm"),
    ({"dimers": {"replicates": 9, "spacing": "1 mm", "meet": True}},
     "a bead overlaps with one of another walker by 0.188 mm; expected their centres 0.6 mm apart, where they touch"),
    (cluster("star", "0.3 mm", "0.2 mm"), 'arrangement = "star": expected one of chain, fan, diamond, ring, raft'),
    (cluster("ring", "0.3 mm", "0.2 mm"), "clusters[0].radii"),
    (cluster("raft", "0.3 mm", "0.2 mm", "0.2 mm"), "expected the same radius for all beads of a raft"),
    (cluster("diamond", "0.3 mm", "0.2 mm", "0.2 mm"), "expected 4 beads in a diamond"),
    (cluster("chain", "0.3 mm", "0.05 mm", "0.3 mm"), "beads 1 and 3 would overlap in a chain"),
    (cluster("fan", "0.3 mm", *["0.2 mm"] * 12), "too many beads to fit around the first one"),
    ({"clusters": [WALKER]}, "missing; expected such as \"fan\""),
    (at(["0 mm", "0 mm"], ["-1 mm", "0 mm"]), "this bead is not connected to the first"),
    (at(["0 mm", "0 mm"]), "expected a place for each"),
    (at(["0 mm", "0 mm"], ["0.1 mm", "0 mm"]),
     "overlaps with clusters[0].at[0] by 0.39 mm; expected their centres 0.4899 mm apart"),
    (at(["0 mm", "0.3 mm"], ["0 mm", "-0.3 mm"], radii=("0.3 mm", "0.3 mm")), "this walker has no heading"),
    ({"dimers": {"radii": ["0.5 mm", "0.2 mm"]}, "boundary": {"shape": "groove", "opening": "30 deg"}},
     "the radii differ too much: the beads do not touch"),
    ({"boundary": {"shape": "groove", **GLASS}}, "boundary.opening: missing"),
    ({"boundary": {"tilt": "-5 deg", **GLASS}}, 'must be zero or more; boundary.uphill = "180 deg" turns the slope'),
    ({"boundary": {"width": "1 mm", **GLASS}}, 'boundary.width = "1 mm": expected none of a plane'),
    ({**cluster("fan", "0.3 mm", "0.2 mm", "0.2 mm"), "boundary": {"shape": "channel", "width": "0.7 mm"}},
     "do not fit between the walls of the channel; expected a wider boundary"),
    ({"dimers": {"replicates": 9, "spacing": "1 mm", "meet": True},
      "boundary": {"shape": "box", "width": "3 mm", "height": "9 mm"}},
     "dimers.replicates = 9: the walkers do not fit between the walls of the box; expected at most 6 at a spacing"),
    ({"placed": [bead("1 mm", "9 mm"), bead("0.1 mm", "30 mm"), bead("0.5 mm", "10.4 mm")]},
     "overlaps with placed[0] by 0.1 mm; expected their centres 1.5 mm apart, where they touch"),
    ({"placed": [bead("1 mm", "9 mm", "0.9 mm")]}, "expected a bead within the boundary"),
    ({"dimers": None, "placed": [bead("1 mm", "9 mm")], "run": {"seed": 3}}, "run.seed = 3: expected none with placed"),
    ({"run": {"cycles": None, "settling_cycles": None, "duration": "1e4 s"}},
     'run.duration = "1e4 s": expected at most 8388 s: the engine counts'),
    ({"liquid": {"name": "water-glycerol", "mass_fraction": 60}}, "liquid.mass_fraction = 60: expected the mass of"),
    ({"liquid": {"mass_fraction": 0.6}}, "liquid.mass_fraction = 0.6: expected none: it is for"),
    ({"uncertain": {"contact.restitution": [0.8, 0.2]}}, "uncertain.contact.restitution = [0.8, 0.2]: expected the"),
    ({"uncertain": {"contact.restitution": [0.2, 0.3, 0.8]}}, "the case's own value is the median"),
    ({"dimers": {"radii": ["0.4 mm", "0.25 mm"], "meet": True, "replicates": 4},
      "boundary": {"shape": "box", "width": "3.4 mm", "height": "5 mm", **GLASS}},
     "dimers.replicates = 4: the walkers do not fit between the walls of the box; expected at most 2 at a spacing"),
    # What is missing
    ({"dimers": None}, "dimers: missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]"),
    ({"beads": {"material": None}}, 'beads.density: missing; expected such as "4.0 g/cm^3", or a material of the'),
    ({"boundary": None}, 'boundary: missing; expected a table [boundary], such as material = "'),
    ({"liquid": {"name": None, "kinematic_viscosity": "5 mm^2/s", "surface_tension": "20 mN/m"}},
     "liquid.density: missing; expected the liquid's density beside its kinematic_viscosity"),
    ({"drive": {"frequency": None}}, "drive.frequency: missing"),
    ({"drive": {"peak_acceleration": None}}, "drive.peak_acceleration: missing"),
    ({"liquid": {"name": None, "surface_tension": "19 mN/m", "density": "1 g/cm^3"}},
     'liquid.dynamic_viscosity: missing; expected such as "4.6 mPa*s", or kinematic_viscosity, or a liquid of the lib'),
    ({"liquid": {"name": "mine", "surface_tension": "19 mN/m", "kinematic_viscosity": "5 mm^2/s"}},
     'liquid.name = "mine": not in the library'),
]  # fmt: skip


def _said(tables: dict[str, Any]) -> dict[str, Any]:
    """Tables without what is None in them."""
    said = {key: _said(value) if isinstance(value, dict) else value for key, value in tables.items()}
    return {key: value for key, value in said.items() if value is not None}


@pytest.mark.parametrize(("changes", "told"), BAD)
def test_bad_values(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as caught:
        Case.read(_said(document(**changes)), source="bad.toml")
    message = str(caught.value)
    assert told in message, message
    assert message.startswith("bad.toml: ")
    assert message.count("\n") == 0, "one problem, one line"
    assert "expected" in message or "unknown key" in message


READING = (
    "plot",
    "render",
    "render --film",
    "report",
    *(f"export --to {form}" for form in ("vtk", "lammps", "archive")),
)
REFUSED: list[tuple[str, str]] = [
    # What is of another kind, with the command for it
    ("run fig2", "fig2: is a sweep: walkers sweep fig2"),
    ("show {file}", "is a sweep: walkers sweep "),
    ("export --to deck {sweep}", "is a sweep's directory: walkers list"),
    ("sweep {run}", "is a run's directory: walkers run "),
    ("sweep fig1b", "fig1b: is a case: walkers run fig1b"),
    ("sweep {case}", "is a case: walkers run "),
    ("sweep {sweep}", "is a sweep's directory"),
    ("show --theory ruby", "ruby: is a calibration: walkers calibrate ruby"),
    ("show --theory pile-ci", ""),
    ("calibrate fig2", "fig2: is a sweep"),
    ("run {sweep}", "is a sweep's directory: walkers list"),
    ("render {sweep}", "is a sweep: expected one of its runs"),
    ("export --to vtk {sweep}", "is a sweep: expected one of its runs"),
    ("plot {archive}", "an archive: unpack it"),
    ("list {archive}", "not a sweep: expected a folder"),
    ("list {run}", "is a run: walkers run "),
    ("list {runs}", "walkers list --out "),
    ("list {sweep} --all", "--all: is for folders"),
    ("list --to table.csv", "--to: expected a sweep"),
    ("plot {sweep} --set run.seed=2", "is a sweep's directory"),
    ("compare {sweep} {run}", "is a sweep; expected another sweep"),
    ("compare {sweep} fig1b", "is a sweep; expected another"),
    ("compare {sweep} {other}", "vary the same keys"),
    ("compare fig1b", "fig1b: expected a second run or sweep, or changed values (--set KEY=VALUE)"),
    ("compare {sweep} --set run.seed=2", "--set: is for runs and cases"),
    ("climb {sweep}", "expected a finished run of a pile"),
    ("check files .", "expected a run directory"),
    ("plot {run} --hue frequency", "--hue: is for sweeps"),
    *((f"list {folder}", "") for folder in ("empty", "{broken}")),
    # What is not there, cannot be read or makes no sense
    *((f"{command} fig1b", "no finished run in runs; first do: walkers run fig1b") for command in READING),
    *((f"{command} .", "not a finished run") for command in READING),
    *((f"{command} {{folder}}", "manifest.json cannot be read") for command in READING[:-1]),
    *((f"sweep {what}", "") for what in ("{bad}", "nosuch", "fig2 --site nosite.toml", "fig2 --out {case}")),
    *((f"{command} fig1b --set 'drive.frequency=70 mm'", 'fig1b: --set drive.frequency = "70 mm": expected a frequency')
      for command in ("show", "run", "export --to deck", "show --theory", "plot", "report", "check")),
    *((f"{command} fig1b --set 'liquid.contact_angle=88 deg'", 'fig1b: --set liquid.contact_angle = "88 deg": expected')
      for command in ("show", "run", "run --spread")),
    ("sweep fig4 --set 'liquid.name=Si AK5'", 'liquid.name = "Si AK5": varies in this sweep and cannot be set'),
    ("run fig1b --points 2", ""),
    ("run nosuch fig1c", 'nosuch: no such file\nfig1c: no such file'),
    ("show fig1b --set drive.freq=2 --set beads.mat=3", '"frequency"?\nfig1b: --set beads.mat: unknown key'),
    ("sweep fig4 --set drive.freq=2", 'fig4: --set drive.freq: unknown key'),
    ("show climber --set clusters.0.arrangement=fan", 'did you mean "clusters[0].arrangement"?'),
    # Options
    ("check engine --engine no-such-engine", ""),
    ("check engine --only nothing", ""),
    ("check literature benchmark", "did you mean"),
    ("check enigne", "enigne: no such file, run or sweep, nor a shipped case"),
    ("check fig1b --without magic", "--without magic: expected one of"),
    ("check fig1b --cycles 1", "expected at least 3"),
    ("check fig1b --seeds 2", "--seeds: is for piles"),
    ("paper figures --only fig9", "fig9"),
    ("paper figures --only fig4 --format jpeg", "jpeg"),
    ("paper figures --only fig4 --to {case}", "base.toml"),
    # Mistyped names
    ("shw fig1b", 'Unknown command "shw". Did you mean "show"?'),
    ("list a b", "Unexpected: b. See: walkers list --help"),
    ("--library mine.toml", "--library: expected a library file, and a command after it"),
    ("new {case}", "exists already"),
    ("new mine fig1", 'did you mean "fig1b"?'),
    *((f"new '{name}'", f"{name or '.'}: expected a name") for name in ("", ".", "/", "..")),
    ("show fig1b --set 'run.seed=3\nfoo=4'", 'fig1b: --set run.seed = "3\\nfoo=4": expected a whole number'),
    ("list --out {runs} --where frequency", "expected KEY=VALUE"),
    ("list --out {runs} --where frequenzy=2", "no run has such a key"),
    ("list --out {runs} --where status=interrupted", "no run has such a key"),
    ("list --out {runs} --where frequency=60", '"frequency=60": expected a frequency with its unit'),
    ("list --out {runs} --where 'frequency=60 Hzz'", '"frequency=60 Hzz": expected a frequency with its unit'),
    ("list --out {runs} --where restitution=hard", '"restitution=hard": expected a number without a unit'),
    ("run {case} {plain}", "plain: is a folder without a run"),
    ("run {sweep_file} --out {runs}", "is a sweep: walkers sweep "),
    ("clean nonsense --yes --out {runs}", "nonsense: no such file, run or sweep"),
    ("plot {sweep} --y velocitty", 'did you mean "velocity"?'),
    ("plot {sweep} --y reason", '"reason" has no number'),
    ("plot {sweep} --x bead_wall", '"bead_wall": expected one of'),
    ("plot {sweep} --to figure.jpg", "figure.jpg: expected the name of a .png or .svg or .pdf file"),
    *((f"report {{run}} --to {place}", "expected the name of a .html or .htm file") for place in ("a.txt", "{folder}")),
    ("report {run} --to nowhere/a.html", "nowhere: there is no such folder"),
    ("plot {run} --to out.png", "out.png: expected a folder"),
    ("export {run} --to lammps -o walk.dcd", "expected the name of a .lammpstrj file"),
    ("export {run} --to vtk --open", "--open: is for --to paraview"),
    ("export {run} --to deck --every 2", "--every: is for --to vtk, paraview, lammps"),
    ("export {run} --to paraview -o vtk --colour beauty", "expected one of bead, large, omega, radius"),
    *((f"export {{run}} --to archive {words}", told) for words, told in (
        ("-o run.tar", "-o: expected the name of a .zip file"),
        ("-o nowhere/run.zip", "No such file"),
        ("--licence 'the public'", "licence: expected an SPDX identifier such as CC-BY-4.0"),
        ("--author=", "author: expected a name"),
        ("--orcid 0000-0002-1825-0097", "--orcid: expected an --author for each"),
        ("--author N --orcid 0000-0002-1825-009", "orcid: expected an ORCID"),
    )),
    ("climb {pile} --within 5mm", "--within: '5mm': expected a time"),
    ("render {run} --fps 10", "--fps: is for --film"),
    *((f"render --film {{run}} {words}", told) for words, told in (
        ("--to walk.avi", "expected the name of a .mp4 or .gif file"),
        ("--to walk.gif --fps 30", "expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF"),
        ("--size 333x201", "expected even numbers for an MP4"),
        ("--size wide", "expected 360p, 480p, 720p, 1080p"),
        ("--walker 2", "walker: 2: expected 0 to 1"),
        ("--images 2", "--images: is for pictures"),
        ("--begin soon", 'expected a time such as "0.1 s"'),
        ("--begin '0.2 s'", "expected times within the drive, 0 to 0.1 s"),
        ("--begin '0.05 s' --end '0.05 s'", "expected times within the drive, 0 to 0.1 s"),
    )),
    ("--library own.toml render --film {run} --size wide", "--size: 'wide': expected 360p, 480p, 720p, 1080p"),
    *((f"{what} {{pile}} --walker 0", "") for what in ("render", "render --film")),
    ("render --film {pile} --to box.png", ""),
    ("render {pile} --to box.jpg", ""),
    *(
        (f"export {{pile}} --to {form} --as-placed", "--as-placed: is for independent walkers")
        for form in ("vtk", "paraview")
    ),
    ("export {sweep} --to vtk", "expected one of its runs for vtk, or archive"),
]  # fmt: skip
"""Commands, and a part of the line that they are refused with."""


@pytest.fixture
def there(
    looked_through: Path, run_directory: Callable[..., Path], pile_run: Path, archive: Path, tmp_path: Path
) -> dict[str, Path]:
    """What the commands of `REFUSED` are given."""
    run = run_directory(dimers={"replicates": 2}, run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20})
    names = {
        "broken": "broken",
        "folder": "folder.html",
        "file": "mine.toml",
        "bad": "bad.toml",
        "plain": "plain",
        "sweep_file": "grid.toml",
    }
    found = {name: tmp_path / place for name, place in names.items()}
    for folder, file in (("broken", "sweep.json"), ("folder", "manifest.json")):
        found[folder].mkdir()
        (found[folder] / file).write_text("{")
    found["plain"].mkdir()
    for file, values in (("file", '"60 Hz"'), ("sweep_file", '"60 Hz"'), ("bad", '"60 Hz", "0 Hz"')):
        found[file].write_text(f'case = "fig1b"\naxes.drive.frequency = [{values}]\n')
    found |= {"runs": looked_through, "sweep": looked_through / "grid", "other": looked_through / "three"}
    return {**found, "run": run, "pile": pile_run, "archive": archive, "case": looked_through.parent / "base.toml"}


@pytest.mark.parametrize(("command", "told"), REFUSED)
def test_commands_that_are_refused(command: str, told: str, there: dict[str, Path], tmp_path: Path) -> None:
    """In a line for each mistake, before anything is written."""
    before = {path: sorted(path.rglob("*")) for path in (tmp_path, there["run"])}
    done = call(*shlex.split(command.format(**there)), folder=tmp_path)
    mistakes = told.split("\n")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", len(mistakes)), done.stderr
    assert all(one in done.stderr for one in mistakes), done.stderr
    assert before == {path: sorted(path.rglob("*")) for path in before}


def _message(*arguments: str) -> str:
    done = call(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.stderr


def test_all_that_is_missing_is_told_at_once(in_folder: Path) -> None:
    heads = ("[dimers]", "[[clusters]]", "[mixture]", "[beads]", "[liquid]", "[[drive.harmonics]]")
    (in_folder / "bad.toml").write_text("\n".join([*heads, '[boundary]\nshape = "box"']))
    told = {line.split(": ")[-2] for line in _message("run", "bad.toml").splitlines()}
    missing = {"dimers.radii", "clusters[0].radii", "clusters[0].arrangement", "mixture.small", "mixture.large"}
    missing |= {"mixture.count", "beads.density", "boundary.material", "boundary.width", "boundary.height"}
    missing |= {"drive.harmonics[0].frequency", "drive.harmonics[0].peak_acceleration", "run.duration"}
    missing |= {"liquid.surface_tension", "liquid.dynamic_viscosity"}
    assert missing <= told


def test_several_mistakes_are_told_at_once_and_before_the_first_run(in_folder: Path) -> None:
    wrong = document(drive={"frequency": "80 mm", "axis": "w"}, beads={"material": "rubi"}, liquid={"name": "oil"})
    (in_folder / "bad.toml").write_text(to_toml(wrong | {"titel": "x"}))
    told = _message("run", "fig1b", "bad.toml").removeprefix("walkers: ").splitlines()
    keys = ("beads.material", "drive.axis", "drive.frequency", "liquid.name", "titel")
    assert sorted(line.partition(" = ")[0] for line in told) == [f"bad.toml: {key}" for key in keys]
    assert not (in_folder / "runs").exists()


@pytest.mark.parametrize("name", ["teflon", "rough glass"])
def test_a_substrate_of_ones_own_needs_its_friction(name: str) -> None:
    values = document(boundary={"material": name})
    assert Case.read(values).boundary.material == name
    del values["contact"]["rolling_friction"]
    with pytest.raises(InputError, match=rf'boundary\.material = "{name}": not in the library'):
        Case.read(values)


def test_bridges_may_push_loose_beads_but_hold_walkers(run_directory: Callable[..., Path]) -> None:
    pile = load_case("pile-ci", {"liquid.contact_angle": "90 deg"})
    assert pile.liquid.contact_angle == pytest.approx(1.5707963)
    assert render_deck(pile).fastest > render_deck(load_case("pile-ci", {"liquid.contact_angle": "84 deg"})).fastest
    run = run_directory(liquid={"contact_angle": "82.5 deg"}, run=SHORT)
    assert abs(read(run)["velocity"]) > 0.0


def test_a_liquid_may_have_no_viscosity() -> None:
    assert make_case(run={"time_step": "20 us", "allow_unstable": True}).run.time_step > 19e-6
    case = make_case(liquid={"viscosity_ratio": 0})
    assert case.liquid.of_bridges.viscosity == 0.0
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
        (str(tmp_path), "is a folder without a run"),
        ("x" * 300, "cannot be read"),
    ):
        assert told in _message("show", name)


def test_misuse_of_the_program() -> None:
    for arguments in (
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
    odd = "xxx\n\x1b[31m"
    words += [("plot", "base.toml", "--format", long), ("new", "mine", odd), ("show", odd)]
    for arguments in words:
        message = _message(*arguments)
        assert message.count("\n") == 1
        assert message.rstrip("\n").isprintable()
        assert any(part in message for part in ("xxx", "one two", "no finished run"))
        assert len(message) < 1500


# --- quantities, in the units of the field ----------------------------------------------------------------------------


READ = {
    units.LENGTH: {"0.3 mm": 3e-4, "300 µm": 3e-4, "300um": 3e-4, "3e-4 m": 3e-4},
    units.FREQUENCY: {"80 Hz": 80.0, "0.08 kHz": 80.0, "80 s^-1": 80.0},
    # "1 g = 9.8 m/s²", the paper's Fig. 1
    units.ACCELERATION: {"1 g": 9.8, "4g": 39.2, "39.2 m/s^2": 39.2, "39.2 m/s²": 39.2, "1 gravity": 9.80665},
    units.SURFACE_TENSION: {"19.2 mN/m": 0.0192, "19.2 dyn/cm": 0.0192},
    units.KINEMATIC_VISCOSITY: {"5 mm^2/s": 5e-6, "5 cSt": 5e-6},
    units.DYNAMIC_VISCOSITY: {"4.6 mPa*s": 4.6e-3, "4.6 cP": 4.6e-3},
    units.DENSITY: {"4.0 g/cm^3": 4000.0, "1 g/cm^3": 1e3},
    units.MODULUS: {"50 MPa": 5e7},
    units.TIME: {"2 us": 2e-6},
    units.ANGLE: {"180 deg": 3.14159265358979, "10 mrad": 0.01},
}
NOT_READ = {
    units.ACCELERATION: ["4 kg", "4 mg", "4 g/s"],
    units.DENSITY: ["4 g"],
    units.FREQUENCY: ["500 rad/s", "4800 rpm"],
    units.ANGLE: ["0.5", "30 percent"],
    units.LENGTH: ["4 g", "0,3 mm", "0.3 mm 0.2 mm", "__import__('os')", "nan mm", ""],
}


def test_quantities_in_si() -> None:
    for kind, texts in READ.items():
        assert {text: parse_quantity(text, kind) for text in texts} == pytest.approx(texts, rel=1e-14)


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in NOT_READ.items() for text in texts])
def test_what_is_no_such_quantity(text: str, kind: units.Kind) -> None:
    with pytest.raises(ValueError, match=f"expected an? {kind.name} with its unit"):
        parse_quantity(text, kind)


KINDS = [kind for kind in vars(units).values() if isinstance(kind, units.Kind)]


@pytest.mark.parametrize("symbol", units._USUAL)
def test_usual_units_are_read_as_pint_reads_them(symbol: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last digit, and refused with the same words."""
    texts = [f"{number} {symbol}" for number in ("1", "0.3", "4.0", "19.2", "-7.125e-2", "123456789.012", "1e-5")]

    def read(text: str, kind: units.Kind) -> float | str:
        try:
            return parse_quantity(text, kind)
        except ValueError as error:
            return str(error)

    usual = [read(text, kind) for text in texts for kind in KINDS]
    assert any(isinstance(value, float) for value in usual)
    monkeypatch.setattr(units, "_USUAL", {})
    assert usual == [read(text, kind) for text in texts for kind in KINDS]


def test_shipped_cases_do_not_wait_for_pint() -> None:
    script = """
import sys
from walkers.inputs.reading import load_case, shipped
print([load_case(name).name for name in shipped("case")] and "pint" in sys.modules)
"""
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False"
