"""Bad input: one line for each mistake, with file, key, value and expectation; exit status 2; nothing is written."""

import shlex
from collections.abc import Callable
from pathlib import Path
from string import Formatter
from typing import Any

import pytest

from tests.conftest import call, document, to_toml

Files = dict[str, str | bytes]
WALKER = {"radii": ["0.3 mm", "0.2 mm"]}
MIXTURE = {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 20}
HARMONICS = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "1 g"}]}
MEETING = {"radii": ["0.4 mm", "0.25 mm"], "meet": True, "replicates": 4}


def cluster(arrangement: str, *radii: str) -> dict[str, Any]:
    """Tables with one cluster, and no dimers."""
    return {"clusters": [{"arrangement": arrangement, "radii": list(radii)}], "dimers": None}


def at(*places: list[str], radii: tuple[str, str] = ("0.3 mm", "0.2 mm")) -> dict[str, Any]:
    """Tables with a cluster whose beads are given places, and no dimers."""
    return {"clusters": [{"radii": list(radii), "at": list(places)}], "dimers": None}


def bead(radius: str, x: str, z: str = "1 mm") -> dict[str, Any]:
    """A bead that is placed."""
    return {"radius": radius, "at": [x, "0 mm", z]}


def box(width: str, height: str, **bodies: Any) -> dict[str, Any]:
    """Tables with bodies in a box."""
    return {**bodies, "boundary": {"shape": "box", "width": width, "height": height}}


def material(name: str, **density: Any) -> str:
    """A library with a density."""
    return to_toml({"materials": {name: {"density": {"value": "2 g/cm^3", "source": "x", **density}}}})


def pairs(*materials: list[str]) -> str:
    """A library with pairs of surfaces."""
    return to_toml({"surface_pairs": [{"materials": pair} for pair in materials]})


# Changed tables of a case (None: left out), and the message after the file.
CASES: list[tuple[dict[str, Any], str]] = [
    # Quantities
    ({"dimers": {"radii": ["0.3", "0.2 mm"]}}, 'dimers.radii[0] = "0.3": expected a length with its unit'),
    ({"dimers": {"radii": ["0.3 mm", "0 mm"]}}, 'dimers.radii[1] = "0 mm": expected a length with its unit, such as "'),
    ({"dimers": {"radii": ["1e999 mm", "0.2 mm"]}}, 'dimers.radii[0] = "1e999 mm": expected a length'),
    ({"beads": {"density": 4000}}, "beads.density = 4000: expected a density with its unit"),
    ({"drive": {"peak_acceleration": "-4 g"}}, "it must be zero or more"),
    ({"drive": {"peak_acceleration": "2000 g"}}, "it must lie between 1.02e-10 and 1020 g"),
    ({"drive": {"frequency": "500 rad/s"}}, "(cycles per second, not an angular frequency)"),
    ({"contact": {"youngs_modulus": "1 MPa"}}, "it must lie between 5 and 100000 MPa"),
    ({"liquid": {"name": "water-glycerol", "mass_fraction": 0.6, "temperature": "68 degF"}}, "expected a temperature"),
    # Numbers, lists, tables, names
    ({"dimers": {"radii": ["0.3 mm"]}}, '["0.3 mm"]: has 1 value; expected 2, such as ["0.3 mm", "0.2 mm"]'),
    ({"dimers": {"radii": "0.3 mm"}}, 'dimers.radii = "0.3 mm": expected a list'),
    ({"beads": {"material": 3}}, "beads.material = 3: expected text"),
    ({"liquid": {"volume_fraction": "1 %"}}, 'liquid.volume_fraction = "1 %": expected a plain number'),
    ({"liquid": {"meniscus_radius": "70 um"}}, "expected either volume_fraction or meniscus_radius, not both"),
    ({"liquid": {"volume_fraction": None, "meniscus_radius": "1 mm"}},
     'liquid.meniscus_radius = "1 mm": expected menisci that fit between the surfaces: no bridge between'),
    ({"liquid": {"volume_fraction": None, "meniscus_radius": "70 um", "law": "young-laplace-films"}},
     'liquid.law = "young-laplace-films": a meniscus radius says nothing of films on beads'),
    ({"contact": {"roughness": {"bead_wall": "0 nm"}}}, 'contact.roughness.bead_wall = "0 nm": expected'),
    ({"contact": {"roughness": {"bead_bead": "2.1 um"}}},
     'contact.roughness.bead_bead = "2.1 um": expected 2 um or less, a hundredth of a bead\'s radius'),
    ({"contact": {"restitution": 1.2}}, "contact.restitution = 1.2: expected at most 1"),
    ({"contact": {"restitution": 0}}, "contact.restitution = 0: expected more than 0.05"),
    ({"contact": {"friction": {"bead_bead": -0.1}}}, "contact.friction.bead_bead = -0.1: expected at least 0"),
    ({"drive": {"axis": "w"}}, "drive.axis = \"w\": expected 'x', 'y' or 'z'"),
    ({"drive": {"frame": "labs"}}, 'did you mean "lab"'),
    ({"run": {"cycles": "allways"}}, 'run.cycles = "allways": expected a whole number, or "auto"'),
    ({"run": {"allow_unstable": "yes"}}, 'run.allow_unstable = "yes": expected true or false'),
    ({"clusters": {**WALKER, "arrangement": "chain"}}, "expected tables [[clusters]]"),
    ({"placed": [{"radius": "1 mm", "at": ["1 mm", "1 mm"]}]}, '"1 mm"]: has 2 values; expected 3, such as ["5 mm", '),
    ({"drive": "x"}, 'drive = "x": expected a table'),
    ({"beads": {"material": "rubi"}}, 'beads.material = "rubi": not in the library'),
    ({"liquid": {"name": "Si AK 5"}}, 'did you mean "Si AK5"'),
    # Keys
    ({"liquid": {"volume_fracton": 0.01}}, 'liquid.volume_fracton = 0.01: unknown key; [liquid] takes name, '),
    ({"frequency": "80 Hz"}, 'frequency = "80 Hz": unknown key; a case takes title, beads'),
    ({"dimers": {"seed": 2}}, 'did you mean "run.seed"'),
    ({"run": {"until_steady": True}}, "run.until_steady = true: unknown key; [run] takes time_step, "),
    ({"sources": {}}, "sources = {}: unknown key; a case takes title, beads"),
    # What contradicts something else
    ({"drive": {"gamma0": 0.5}}, "drive.gamma0 = 0.5: expected either peak_acceleration or gamma0, not both"),
    ({"drive": {**HARMONICS, "peak_acceleration": None}}, "beside drive.harmonics: write drive.harmonics[0].frequency"),
    ({"run": {"duration": "1 s"}}, 'run.duration = "1 s": expected either cycles or duration, not both'),
    ({"clusters": [{**WALKER, "arrangement": "chain", "diameters": ["0.6 mm", "0.4 mm"]}]},
     'clusters[0].diameters = ["0.6 mm", "0.4 mm"]: expected either radii or diameters, not both'),
    ({"dimers": {"sin_delta": 0.2}},
     "dimers.sin_delta = 0.2: expected either radii or mean_radius and sin_delta, not both"),
    ({"drive": {"phase": "10 deg", "frame": "lab"}}, 'drive.frame = "lab": expected "container"'),
    ({"drive": {"harmonics": [{**HARMONICS["harmonics"][0], "frequency": f"{tone} Hz"} for tone in (80, 81.3)],
      "frequency": None, "peak_acceleration": None}}, "expected frequencies with a common period"),
    ({"dimers": {"facing": "up"}, "boundary": {"tilt": "90 deg", "uphill": "90 deg"}}, 'dimers.facing = "up": exp'),
    ({"liquid": {"contact_angle": "84 deg"}}, "expected a smaller angle or less liquid: at rest, the"),
    ({"liquid": {"contact_angle": "90 deg"}, "environment": {"gravity": "0 g"}}, "bead 1 and the boundary apart"),
    ({"run": {"time_step": "20 us"}}, 'run.time_step = "20 us": beyond the rayleigh'),
    ({"run": {"cycles": 10, "settling_cycles": 10}}, "run.settling_cycles = 10: expected at most"),
    ({"run": {"bridge_samples_per_cycle": 3}}, "run.bridge_samples_per_cycle = 3: expected a divisor"),
    ({"run": {"cycles": 999_999}}, f"run.cycles = 999999: expected at most {(2**31 - 1) // 3200}: "),
    ({"run": {"cycles": 20, "frames_per_second": 4.0}}, "run.frames_per_second = 4.0: expected more"),
    ({"run": {"cycles": None, "settling_cycles": None, "duration": "1e4 s"}},
     'run.duration = "1e4 s": expected at most 8388 s: the engine counts'),
    ({"run": {"ranks": 2}}, "run.ranks = 2: expected 1"),
    ({"run": {"silence": "20 s"}}, 'run.silence = "20 s": expected none: this key has ended'),
    ({"dimers": None, "placed": [bead("1 mm", "9 mm")], "run": {"seed": 3}}, "run.seed = 3: expected none with placed"),
    ({"liquid": {"name": "water-glycerol", "mass_fraction": 60}}, "liquid.mass_fraction = 60: expected the mass of"),
    ({"liquid": {"mass_fraction": 0.6}}, "liquid.mass_fraction = 0.6: expected none: it is for"),
    # Bodies and boundaries
    ({"dimers": {"gap": "1 um"}}, 'dimers.gap = "1 um": expected zero or less'),
    ({"dimers": {"gap": "-50 um"}}, "overlap by more than 2 % of the smallest radius: expected -4 um or more"),
    ({"dimers": {"radii": ["2 mm", "0.2 mm"]}, "contact": {"youngs_modulus": "5 MPa"}},
     "more than 2 % of the smallest radius: expected a larger modulus, or dimers.gap"),
    ({"dimers": {"replicates": 2, "spacing": "0.5 mm"}}, 'dimers.spacing = "0.5 mm": neighbouring walkers would touch'),
    ({"dimers": {"replicates": 9, "spacing": "1 mm", "meet": True}},
     "a bead overlaps with one of another walker by 0.188 mm; expected their centres 0.6 mm apart, where they touch"),
    (cluster("star", "0.3 mm", "0.2 mm"), 'arrangement = "star": expected one of chain, fan, diamond, ring, raft'),
    (cluster("ring", "0.3 mm", "0.2 mm"), "expected at least 3 beads in a ring"),
    (cluster("raft", "0.3 mm", "0.2 mm", "0.2 mm"), "expected the same radius for all beads of a raft"),
    (cluster("diamond", "0.3 mm", "0.2 mm", "0.2 mm"), "expected 4 beads in a diamond"),
    (cluster("chain", "0.3 mm", "0.05 mm", "0.3 mm"), "beads 1 and 3 would overlap in a chain"),
    (cluster("fan", "0.3 mm", *["0.2 mm"] * 12), "too many beads to fit around the first one"),
    (at(["0 mm", "0 mm"], ["-1 mm", "0 mm"]), "this bead is not connected to the first"),
    (at(["0 mm", "0 mm"]), "expected a place for each"),
    (at(["0 mm", "0 mm"], ["0.1 mm", "0 mm"]),
     "overlaps with clusters[0].at[0] by 0.39 mm; expected their centres 0.4899 mm apart"),
    (at(["0 mm", "0.3 mm"], ["0 mm", "-0.3 mm"], radii=("0.3 mm", "0.3 mm")), "this walker has no heading"),
    ({"dimers": {"radii": ["0.5 mm", "0.2 mm"]}, "boundary": {"shape": "groove", "opening": "30 deg"}},
     "the radii differ too much: the beads do not touch"),
    ({"boundary": {"shape": "groove"}}, "boundary.opening: missing"),
    ({"boundary": {"tilt": "-5 deg"}}, 'must be zero or more; boundary.uphill = "180 deg" turns the slope'),
    ({"boundary": {"width": "1 mm"}}, 'boundary.width = "1 mm": expected none of a plane'),
    ({**cluster("fan", "0.3 mm", "0.2 mm", "0.2 mm"), "boundary": {"shape": "channel", "width": "0.7 mm"}},
     "do not fit between the walls of the channel; expected a wider boundary"),
    (box("3.4 mm", "5 mm", dimers=MEETING),
     "dimers.replicates = 4: the walkers do not fit between the walls of the box; expected at most 2 at a spacing"),
    ({"placed": [bead("1 mm", "9 mm"), bead("0.1 mm", "30 mm"), bead("0.5 mm", "10.4 mm")]},
     "overlaps with placed[0] by 0.1 mm; expected their centres 1.5 mm apart, where they touch"),
    ({"placed": [bead("1 mm", "9 mm", "0.9 mm")]}, "expected a bead within the boundary"),
    # What is missing
    ({"dimers": None}, "dimers: missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]"),
    ({"boundary": None}, 'boundary: missing; expected a table [boundary], such as material = "'),
    ({"liquid": {"name": None, "kinematic_viscosity": "5 mm^2/s", "surface_tension": "20 mN/m"}},
     "liquid.density: missing; expected the liquid's density beside its kinematic_viscosity"),
    ({"liquid": {"name": None, "surface_tension": "19 mN/m", "density": "1 g/cm^3"}},
     'liquid.dynamic_viscosity: missing; expected such as "4.6 mPa*s", or kinematic_viscosity, or a liquid of the lib'),
    ({"liquid": {"name": "mine", "surface_tension": "19 mN/m", "kinematic_viscosity": "5 mm^2/s"}},
     'liquid.name = "mine": not in the library'),
    ({"boundary": {"material": "teflon"}, "contact": {"rolling_friction": None}},
     'boundary.material = "teflon": not in the library'),
    ({"dimers": {"radii": None}, "clusters": [{}], "mixture": {}, "beads": {"material": None}, "liquid": {"name": None},
      "boundary": {"shape": "box", "material": None}, "drive": {"frequency": None, "peak_acceleration": None},
      "run": {"cycles": None}},
     "\n".join(f"{key}: missing; expected " for key in (
         "dimers.radii", "clusters[0].radii", "clusters[0].arrangement", "mixture.small", "mixture.large",
         "mixture.count", "beads.density", "boundary.material", "boundary.width", "boundary.height", "drive.frequency",
         "drive.peak_acceleration", "run.duration", "liquid.surface_tension", "liquid.dynamic_viscosity",
     ))),
    ({"drive": {"frequency": "80 mm", "axis": "w"}, "beads": {"material": "rubi"}, "liquid": {"name": "oil"}, "no": 1},
     'drive.frequency = "80 mm": \ndrive.axis = "w": \nbeads.material = "rubi": \nliquid.name = "oil": \nno = 1: '),
    # Ranges, and a library within the case
    *(({"uncertain": {key: ends}}, f"uncertain.{key} = {told}") for key, ends, told in (
        ("contact.frictio", [0.1, 0.2], "[0.1, 0.2]: unknown key"),
        ("contact.restitution", [0.6, 0.2], "[0.6, 0.2]: expected the smaller value first"),
        ("contact.restitution", [0.2, 0.3, 0.8], "[0.2, 0.3, 0.8]: expected [low, high]: the case's own value is th"),
        ("contact.restitution", [0.3, 2.0], "2.0: expected at most 1"),
        ("drive.frequency", ["1 Hz", "2 kHz"], '["1 Hz", "2 kHz"]: expected one unit'),
        ("drive.axis", ["x", "y"], '["x", "y"]: expected a number'),
        ("liquid.contact_angle", ["1 mm", "2 mm"], '"1 mm": expected an angle'),
    )),
    ({"uncertain": {"contact.restitution": [0.4, 0.6]}}, "expected a range that holds the case's own value, 0.3"),
    ({"library": {"surface_pairs": [{"materials": ["rubby", "glass"]}]}},
     'library.surface_pairs[0].materials = "rubby": not in the library; expected one of ruby, '),
]  # fmt: skip
LIBRARIES: list[tuple[str, str]] = [
    ("materials = 3", "materials = 3: expected a table [materials]"),
    ('[materials.mine]\ndensity = "2 g/cm^3"', 'density = "2 g/cm^3": expected { value = ..., source = "..." }'),
    ('[materials.mine]\ndensity = { value = "2 g/cm^3" }', 'density.source: missing; expected such as "weighed"'),
    ("[material.mine]", 'library.toml: material = {"mine": {}}: unknown key; a library takes '),
    ('file = "/etc/passwd"', 'file = "/etc/passwd": unknown key'),
    (material("m", value=2), "density.value = 2: expected a density with its unit"),
    (material("glass"), "materials.glass: is in the library of"),
    (material("m", range=["3 g/cm^3", "1 g/cm^3"]), "expected the lower end first"),
    (material("m", range=["3 g/cm^3", "4 g/cm^3"]), "expected two ends with the value between them"),
    (material("a\x1b[31m"), "materials.a\\x1b[31m: expected printable text on one line"),
    (material("a", source="x\x1b[31m"), 'materials.a.density.source = "x\\u001b[31m": expected printable text on one'),
    (pairs(["glass", "ruby"]), "surface_pairs[0] = glass on ruby: is in the library of"),
    (pairs(["glas", "zirconia"]), 'surface_pairs[0].materials = "glas": not in the library; expected one of ruby, gl'),
    (pairs(["glass", "brass"], ["brass", "glass"]), "surface_pairs[1] = brass on glass: is given twice"),
]
LAW = """
import dataclasses, random, sys
import numpy as np
from walkers.physics.bridge import Curve, Forces

def forces(gaps, pull=4e-5):
    one = np.ones_like(gaps)
    return Forces(pull * one, 3e-3 * one, 1e-3 * one, 0.0 * one, 0.0 * one)

def changed(**forces_of):
    return lambda gaps: dataclasses.replace(forces(gaps), **{name: of(gaps) for name, of in forces_of.items()})
"""
USE_LAW = "show fig1b --set liquid.law=own.py:law"
LAWS: list[tuple[str, str]] = [
    ("def law(surfaces): raise KeyError('x')", "raises KeyError: 'x'"),
    ("def law(surfaces): yield 1", "returns generator; expected walkers.physics.bridge.Curve"),
    ("def law(surfaces): sys.exit()", "raises SystemExit"),
    ("1 / 0", "raises ZeroDivisionError"),
    ("law = 3", "has no function law"),
    ("def law(surfaces): return Curve(forces, -1.0)", "breaks at a gap of -1 m; expected a positive number"),
    ("def law(surfaces): return Curve(forces, 1e3)", "breaks at a gap of 1000 m; expected at most 0.003"),
    ("def law(surfaces): return Curve(forces, '1')", "breaks at a gap of '1'; expected a number"),
    ("def law(surfaces): return Curve(forces, 1e-4, 2e-4)", "forms at a gap of 0.0002 m; expected 0 to its rupture"),
    ("def law(surfaces): return Curve(forces, 1e-4, scale=np.nan)", "vary over a gap of nan m; expected zero or more"),
    ("def law(surfaces): return Curve(lambda gaps: gaps, 1e-4)", "forces are ndarray; expected"),
    ("def law(surfaces): return Curve(lambda gaps: forces(gaps, np.nan), 1e-4)", "the pull is not a number"),
    ("def law(surfaces): return Curve(lambda gaps: forces(gaps, 1j), 1e-4)", "the pull has type complex128"),
    ("def law(surfaces): return Curve(lambda gaps: Forces(*[np.ones(3)] * 5), 1e-4)", "and shape (3,); expected"),
    ("def law(surfaces): return Curve(forces, random.uniform(1e-5, 1e-4))", "gives other numbers"),
    ("K = random.random()\ndef law(surfaces): return Curve(lambda gaps: forces(gaps, K), 1e-4)", "other numbers"),
]
LONG = "x" * 100_000
FILES: list[tuple[Files, str, str]] = [
    # No TOML, or no case
    ({"bad.toml": "[dimers\nradii = 3"}, "show bad.toml", "bad.toml: not TOML: "),
    ({"bad.toml": b'[dimers]\nradii = ["0.3 mm", \xff]'}, "show bad.toml", "bad.toml: expected UTF-8 text"),
    ({"bad.toml": "a = " + "9" * 5000}, "show bad.toml", "bad.toml: not TOML: "),
    ({"bad.toml": "a = " + "[" * 5000}, "show bad.toml", "bad.toml: not TOML: "),
    # What is long, or has control characters
    ({}, f"show fig1b --set drive.frequency={LONG}", 'fig1b: --set drive.frequency = "xxx'),
    ({}, f"show fig1b --set {LONG}=3", "fig1b: --set xxx"),
    ({"s.toml": f'case = "fig1b"\n[axes]\n"{LONG}" = [1]\n'}, "sweep s.toml", "s.toml: xxx"),
    ({"s.toml": 'case = "one\\ntwo\\u001b[31m"\n'}, "sweep s.toml", "one two"),
    ({}, "show 'xxx\n\x1b[31m'", "xxx"),
    ({}, f"show {LONG}", "cannot be read"),
]
READING = ("plot", "render --film", "report", "export --to lammps", "export --to archive")
COMMANDS: list[tuple[str, str]] = [
    # What is of another kind, with the command for it
    ("run fig2", "fig2: is a sweep: walkers sweep fig2"),
    ("show mine.toml", "is a sweep: walkers sweep "),
    ("export --to deck {sweep}", "is a sweep's directory: walkers list"),
    ("sweep {run}", "is a run's directory: walkers run "),
    ("sweep {sweep}", "is a sweep's directory"),
    ("show --theory ruby", "ruby: is a calibration: walkers calibrate ruby"),
    ("calibrate fig2", "fig2: is a sweep"),
    ("render {sweep}", "is a sweep: expected one of its runs"),
    ("plot {archive}", "an archive: unpack it"),
    ("list {run}", "is a run: walkers run "),
    ("list {runs}", "walkers list --out "),
    ("list --to table.csv", "--to: expected a sweep"),
    ("compare {sweep} {run}", "is a sweep; expected another sweep"),
    ("compare {sweep} {other}", "vary the same keys"),
    ("compare fig1b", "fig1b: expected a second run or sweep, or changed values (--set KEY=VALUE)"),
    ("climb {sweep}", "expected a finished run of a pile"),
    ("check files .", "expected a run directory"),
    ("plot {run} --hue frequency", "--hue: is for sweeps"),
    ("list broken", ""),
    # What is not there, cannot be read or makes no sense
    *((f"{command} fig1b", "no finished run in runs; first do: walkers run fig1b") for command in READING),
    *((f"{command} .", "not a finished run") for command in READING),
    *((f"{command} folder.html", "manifest.json cannot be read") for command in READING[:-1]),
    *((f"sweep {what}", "") for what in ("bad_sweep.toml", "nosuch", "fig2 --site nosite.toml", "fig2 --out {case}")),
    *((f"{command} fig1b --set 'drive.frequency=70 mm'", 'fig1b: --set drive.frequency = "70 mm": expected a frequency')
      for command in ("show", "run", "export --to deck", "show --theory", "plot", "report", "check")),
    *((f"{command} fig1b --set 'liquid.contact_angle=88 deg'", 'fig1b: --set liquid.contact_angle = "88 deg": expected')
      for command in ("show", "run", "run --spread")),
    ("sweep fig4 --set 'liquid.name=Si AK5'", 'liquid.name = "Si AK5": varies in this sweep and cannot be set'),
    ("run nosuch fig1c", 'nosuch: no such file\nfig1c: no such file'),
    ("show fig1b --set drive.freq=2 --set beads.mat=3", '"frequency"?\nfig1b: --set beads.mat: unknown key'),
    ("show climber --set clusters.0.arrangement=fan", 'did you mean "clusters[0].arrangement"?'),
    ("show fig1b --set drive.frequency", "expected key=value"),
    ("show fig1b --set run.seed=1 --set run.seed=2", "run.seed = 2: is given twice"),
    ("show fig1b --set 'dimers.radii[2]=1 mm'", "the base case has no dimers.radii of that length"),
    ("show fig1b --set 'drive=70 Hz'", "is a table of a case"),
    ("show climber --set 'clusters.angle=45 deg'", "clusters is a list: say which one, such as clusters[0]"),
    *((f"show fig1b --set 'liquid.law=\"{law}\"'", told) for law, told in (
        ("no-such-law", "expected one of rabinovich, soulie, willett, young-laplace"),
        ("no/such.py:law", "such.py cannot be read: No such file"),
        ("own.py:law\\nrange", "expected one of"),
        ("walkers.nowhere:law", "cannot be imported"),
        ("walkers.physics.laws.willett:nothing", "has no function nothing"),
        ("os:system", "executes os\nraises TypeError"),
    )),
    # Options
    ("run", "CASE"),
    ("run fig1b --no-such-option", "--no-such-option"),
    ("run fig1b --limit -1", "--limit"),
    ("check engine --engine no-such-engine", ""),
    ("check literature benchmark", "did you mean"),
    ("check enigne", "enigne: no such file, run or sweep, nor a shipped case"),
    ("check fig1b --without magic", "--without magic: expected one of"),
    ("check fig1b --seeds 2", "--seeds: is for piles"),
    ("paper figures --only fig9", "fig9"),
    ("paper figures --only fig4 --to {case}", "base.toml"),
    # Mistyped names
    ("shw fig1b", 'Unknown command "shw". Did you mean "show"?'),
    ("--library mine.toml", "--library: expected a library file, and a command after it"),
    ("new {case}", "exists already"),
    ("new mine fig1", 'did you mean "fig1b"?'),
    *((f"new '{name}'", f"{name or '.'}: expected a name") for name in ("", ".", "/", "..")),
    ("show fig1b --set 'run.seed=3\nfoo=4'", 'fig1b: --set run.seed = "3\\nfoo=4": expected a whole number'),
    ("list --out {runs} --where frequenzy=2", "no run has such a key"),
    ("list --out {runs} --where frequency=60", '"frequency=60": expected a frequency with its unit'),
    ("list --out {runs} --where restitution=hard", '"restitution=hard": expected a number without a unit'),
    ("run {case} plain", "plain: is a folder without a run"),
    ("run mine.toml --out {runs}", "is a sweep: walkers sweep "),
    ("clean nonsense --yes --out {runs}", "nonsense: no such file, run or sweep"),
    ("plot {sweep} --y velocitty", 'did you mean "velocity"?'),
    ("plot {sweep} --y reason", '"reason" has no number'),
    ("plot {sweep} --x bead_wall", '"bead_wall": expected one of'),
    ("plot {sweep} --to figure.jpg", "figure.jpg: expected the name of a .png or .svg or .pdf file"),
    ("report {run} --to a.txt", "expected the name of a .html or .htm file"),
    ("report {run} --to nowhere/a.html", "nowhere: there is no such folder"),
    ("plot {run} --to out.png", "out.png: expected a folder"),
    ("export {run} --to lammps -o walk.dcd", "expected the name of a .lammpstrj file"),
    ("export {run} --to deck --every 2", "--every: is for --to vtk, paraview, lammps"),
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
]  # fmt: skip


def _said(tables: dict[str, Any]) -> dict[str, Any]:
    """Tables without what is None in them."""
    said = {key: _said(value) if isinstance(value, dict) else value for key, value in tables.items()}
    return {key: value for key, value in said.items() if value is not None}


ROWS: list[tuple[Files, str, str]] = [
    *(({"bad.toml": to_toml(_said(document(**tables)))}, "show bad.toml", told) for tables, told in CASES),
    *(({"library.toml": text}, "show fig1b", f"{told}") for text, told in LIBRARIES),
    *(({"own.py": f"{LAW}\n{text}\n"}, USE_LAW, f"executes \n{told}") for text, told in LAWS),
    *FILES,
    *(({}, command, told) for command, told in COMMANDS),
]
"""Files, a command, and a part of each line that it is refused with."""


@pytest.fixture
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path]:
    """What the commands of `ROWS` are given, by name."""
    for folder, file in (("broken", "sweep.json"), ("folder.html", "manifest.json"), ("plain", "")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text("{") if file else None
    for file, values in (("mine", '"60 Hz"'), ("bad_sweep", '"60 Hz", "0 Hz"')):
        (tmp_path / f"{file}.toml").write_text(f'case = "fig1b"\naxes.drive.frequency = [{values}]\n')

    def found(name: str) -> Path:
        if name in ("pile", "archive"):
            return Path(request.getfixturevalue({"pile": "pile_run"}.get(name, name)))
        if name == "run":
            run = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20}
            return Path(request.getfixturevalue("run_directory")(dimers={"replicates": 2}, run=run))
        names = {"runs": ".", "sweep": "grid", "other": "three", "case": "../base.toml"}
        return Path(request.getfixturevalue("looked_through") / names[name]).resolve()

    return found


@pytest.mark.parametrize(("files", "command", "told"), ROWS, ids=[f"{one[:50]}: {told[:50]}" for _, one, told in ROWS])
def test_bad_input(files: Files, command: str, told: str, place: Callable[[str], Path], tmp_path: Path) -> None:
    for name, contents in files.items():
        (tmp_path / name).write_bytes(contents if isinstance(contents, bytes) else contents.encode())
    places = {name: place(name) for _, name, _, _ in Formatter().parse(command) if name}
    folders = [tmp_path, *(path for path in places.values() if path.is_dir())]
    before = [sorted(folder.rglob("*")) for folder in folders]
    done = call(*shlex.split(command.format(**places)), folder=tmp_path)
    mistakes = told.split("\n")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", len(mistakes)), done.stderr
    assert all(one in done.stderr for one in mistakes), done.stderr
    assert done.stderr.replace("\n", "").isprintable()
    assert len(done.stderr) < 1500 * len(mistakes)
    assert [sorted(folder.rglob("*")) for folder in folders] == before
