"""Bad input: one line for each mistake, with file, key, value and expectation; exit status 2; nothing is written."""

import shlex
from collections.abc import Callable
from itertools import pairwise
from math import pi, sin
from pathlib import Path
from string import Formatter
from typing import Any

import pytest

from tests.conftest import call, document, to_toml

Files = dict[str, str | bytes]
MIXTURE = {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 20}
HARMONICS = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "1 g"}]}
NO_SINE = {"frequency": None, "peak_acceleration": None, "record": "record.csv"}


def cluster(arrangement: str, *radii: str) -> dict[str, Any]:
    return {"clusters": [{"arrangement": arrangement, "radii": list(radii)}], "dimers": None}


def at(*places: list[str], radii: tuple[str, str] = ("0.3 mm", "0.2 mm")) -> dict[str, Any]:
    return {"clusters": [{"radii": list(radii), "at": list(places)}], "dimers": None}


def bead(radius: str, x: str, z: str = "1 mm") -> dict[str, Any]:
    return {"radius": radius, "at": [x, "0 mm", z]}


def material(name: str, **density: Any) -> str:
    return to_toml(
        {"materials": {name: {"density": {"value": "2 g/cm^3", "source": "x", **density}}}}
    )


def pairs(*materials: list[str]) -> str:
    return to_toml({"surface_pairs": [{"materials": pair} for pair in materials]})


# Changed tables of a case (None: left out), and the message after the file.
CASES: list[tuple[dict[str, Any], str]] = [
    # Quantities
    ({"dimers": {"radii": ["0.3", "0.2 mm"]}}, 'dimers.radii[0] = "0.3": expected a length with its unit'),
    ({"beads": {"density": 4000}}, "beads.density = 4000: expected a density with its unit"),
    ({"drive": {"peak_acceleration": "-4 g"}}, "it must be zero or more"),
    ({"drive": {"frequency": "500 rad/s"}}, "(cycles per second, not an angular frequency)"),
    ({"drive": {"axis": [10**400, 0, 1]}}, "expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]"),
    ({"drive": {"axis": [1e-200, 0, 0]}}, "expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]"),
    ({"contact": {"youngs_modulus": "1 MPa"}}, "it must lie between 5 and 100000 MPa"),
    # Numbers, lists, tables, names
    ({"dimers": {"radii": ["0.3 mm"]}}, '["0.3 mm"]: has 1 value; expected 2, such as ["0.3 mm", "0.2 mm"]'),
    ({"liquid": {"meniscus_radius": "70 um"}}, "expected either volume_fraction or meniscus_radius, not both"),
    ({"liquid": {"volume_fraction": None, "meniscus_radius": "70 um"},
      "uncertain": {"liquid.volume_fraction": [0.1, 0.2]}},
     "uncertain.liquid.volume_fraction = [0.1, 0.2]: expected liquid.meniscus_radius, which the case has instead"),
    ({"liquid": {"volume_fraction": None, "meniscus_radius": "1 mm"}},
     'liquid.meniscus_radius = "1 mm": expected menisci that fit between the surfaces: no bridge between'),
    ({"contact": {"roughness": {"bead_bead": "2.1 um"}}},
     'contact.roughness.bead_bead = "2.1 um": expected 2 um or less, a hundredth of a bead\'s radius'),
    ({"contact": {"restitution": 1.2}}, "contact.restitution = 1.2: expected at most 1"),
    ({"run": {"cycles": "allways"}}, 'run.cycles = "allways": expected a whole number, or "auto"'),
    # Keys
    ({"liquid": {"volume_fracton": 0.01}}, 'liquid.volume_fracton = 0.01: unknown key; [liquid] takes name, '),
    ({"dimers": {"seed": 2}}, 'did you mean "run.seed"'),
    ({"run": {"until_steady": True}}, "run.until_steady = true: unknown key; [run] takes time_step, "),
    ({"boundary": {"points": [[0, 0, 0]]}}, "boundary.points = [[0, 0, 0]]: unknown key; [boundary] takes shape, "),
    *(({name: {"own": {}}}, f'{name} = {{"own": {{}}}}: unknown key: the program reads this table from a file')
      for name in ("meshes", "records")),
    # What contradicts something else
    ({"drive": {"gamma0": 0.5}}, "drive.gamma0 = 0.5: expected either peak_acceleration or gamma0, not both"),
    ({"drive": {**HARMONICS, "peak_acceleration": None}}, "beside drive.harmonics: write drive.harmonics[0].frequency"),
    ({"drive": {"phase": "10 deg", "frame": "lab"}}, 'drive.frame = "lab": expected "container"'),
    ({"drive": {"harmonics": [{**HARMONICS["harmonics"][0], "frequency": f"{tone} Hz"} for tone in (80, 81.3)],
      "frequency": None, "peak_acceleration": None}}, "expected frequencies with a common period"),
    ({"dimers": {"facing": "up"}, "boundary": {"tilt": "90 deg", "uphill": "90 deg"}}, 'dimers.facing = "up": exp'),
    ({"liquid": {"contact_angle": "84 deg"}}, "expected a smaller angle or less liquid: at rest, the"),
    ({"liquid": {"contact_angle": "90 deg"}, "environment": {"gravity": "0 g"}}, "bead 1 and the boundary apart"),
    ({"run": {"time_step": "20 us"}}, 'run.time_step = "20 us": beyond the rayleigh'),
    ({"run": {"until": "climb"}}, 'run.until = "climb": expected none: only clusters of a [mixture] climb'),
    ({"run": {"cycles": 10, "settling_cycles": 10}}, "run.settling_cycles = 10: expected at most"),
    ({"mixture": {**MIXTURE, "count": 200_001}}, "mixture.count = 200001: expected at most 200000"),
    ({"run": {"cycles": None, "settling_cycles": None, "duration": "1e4 s"}},
     'run.duration = "1e4 s": expected at most 8388 s: the engine counts'),
    ({"dimers": None, "placed": [bead("1 mm", "9 mm")], "run": {"seed": 3}}, "run.seed = 3: expected none with placed"),
    ({"liquid": {"name": "water-glycerol", "mass_fraction": 60}}, "liquid.mass_fraction = 60: expected the mass of"),
    ({"drive": {**NO_SINE, "record": {"rows": [[0, 1]]}}}, "expected text: a file of comma-separated values"),
    ({"drive": {"repeats": True}}, "drive.repeats = true: expected none without drive.record"),
    *(({"drive": {"ramp": ramp}, **more}, told) for ramp, more, told in (
        ([["0 s", 1], ["0 s", 0.5]], {}, "drive.ramp = [[\"0 s\", 1], [\"0 s\", 0.5]]: expected times that increase"),
        ([["0 s", -1]], {}, "drive.ramp[0][1] = -1: expected at least 0"),
        ([["0 s", 1], ["2 s", 0.5]], {}, "run.cycles = 24: expected at least 160 cycles, 2 s, of drive.ramp"),
        ([["0 s", 1], ["2 s", 0.5]], {"run": {"cycles": "auto", "settling_cycles": None}},
         'run.cycles = "auto": expected a number of cycles: with drive.ramp no velocity is constant'),
    )),
    # Bodies and boundaries
    ({"mixture": MIXTURE, "boundary": {"shape": "box", "width": "1.5 mm", "height": "9 mm"}}, "boundary.width = "),
    ({"dimers": None, "mixture": MIXTURE, "boundary": {"shape": "box", "width": "9 mm", "height": "9 mm"},
      "run": {"longest_settling": "1e4 s"}}, 'run.longest_settling = "1e4 s": expected less than'),
    ({"liquid": {"conserved": True}}, "liquid.conserved = true: "),
    ({"mixture": {**MIXTURE, "small": None, "small_diameters": ["0.63 mm", "0.6 mm"]}},
     'mixture.small_diameters = ["0.63 mm", "0.6 mm"]: expected the smaller one first'),
    ({"contact": {"youngs_modulus": "5 MPa"}, "liquid": {"surface_tension": "9 N/m"}},
     'contact.youngs_modulus = "5 MPa": expected a larger one: at rest the beads overlap by more than 2 %'),
    ({"dimers": {"replicates": 2, "spacing": "0.5 mm"}}, 'dimers.spacing = "0.5 mm": neighbouring walkers would touch'),
    ({"dimers": {"replicates": 9, "spacing": "1 mm", "meet": True}},
     "a bead overlaps with one of another walker by 0.188 mm; expected their centres 0.6 mm apart, where they touch"),
    (cluster("chain", "0.3 mm", "0.05 mm", "0.3 mm"), "beads 1 and 3 would overlap in a chain"),
    (cluster("fan", "0.3 mm", *["0.2 mm"] * 12), "too many beads to fit around the first one"),
    (at(["0 mm", "0 mm"], ["-1 mm", "0 mm"]), "this bead is not connected to the first"),
    (at(["0 mm", "0 mm"], ["0.1 mm", "0 mm"]), "clusters[0].at[0] by 0.39 mm; expected their centres 0.4899 mm apart"),
    (at(["0 mm", "0.3 mm"], ["0 mm", "-0.3 mm"], radii=("0.3 mm", "0.3 mm")), "this walker has no heading"),
    ({"dimers": {"radii": ["0.5 mm", "0.2 mm"]}, "boundary": {"shape": "groove", "opening": "30 deg"}},
     "the radii differ too much: the beads do not touch"),
    ({"boundary": {"tilt": "-5 deg"}}, 'must be zero or more; boundary.uphill = "180 deg" turns the slope'),
    ({**cluster("fan", "0.3 mm", "0.2 mm", "0.2 mm"), "boundary": {"shape": "channel", "width": "0.7 mm"}},
     "do not fit between the walls of the channel; expected a wider boundary"),
    ({"dimers": {"radii": ["0.2 mm", "0.37 mm"]}, "boundary": {"shape": "box", "width": "9 mm", "height": "0.3 mm"}},
     'boundary.height = "0.3 mm": too low for the walkers of dimers; expected at least 0.74 mm'),
    ({"placed": [bead("1 mm", "9 mm"), bead("0.1 mm", "30 mm"), bead("0.5 mm", "10.4 mm")]},
     "overlaps with placed[0] by 0.1 mm; expected their centres 1.5 mm apart, where they touch"),
    # What is missing
    ({"dimers": None}, "dimers: missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]"),
    ({"boundary": None}, 'boundary: missing; expected a table [boundary]'),
    ({"liquid": {"name": None, "kinematic_viscosity": "5 mm^2/s", "surface_tension": "20 mN/m"}},
     "liquid.density: missing; expected the liquid's density beside its kinematic_viscosity"),
    ({"dimers": {"radii": None}, "clusters": [{}], "mixture": {}, "beads": {"material": None}, "liquid": {"name": None},
      "boundary": {"shape": "box", "material": None}, "drive": {"frequency": None, "peak_acceleration": None},
      "run": {"cycles": None}},
     "\n".join(f"{key}: missing; expected " for key in (
         "dimers.radii", "clusters[0].radii", "clusters[0].arrangement", "mixture.small", "mixture.large",
         "mixture.count", "beads.density", "boundary.material", "boundary.width", "boundary.height", "drive.frequency",
         "drive.peak_acceleration", "run.duration", "liquid.surface_tension", "liquid.dynamic_viscosity",
     ))),
    ({"drive": {"frequency": "80 mm", "axis": "w"}, "beads": {"material": "rubi"}, "liquid": {"name": "oil"}, "no": 1,
      "dimers": {"radii": None}},
     'drive.frequency = "80 mm": \ndrive.axis = "w": \nbeads.material = "rubi": \nliquid.name = "oil": \nno = 1: \n'
     "dimers.radii: missing; "),
    # Ranges, and a library within the case
    *(({"uncertain": {key: ends}}, f"uncertain.{key} = {told}") for key, ends, told in (
        ("contact.frictio", [0.1, 0.2], "[0.1, 0.2]: unknown key"),
        ("contact.restitution", [0.2, 0.3, 0.8], "[0.2, 0.3, 0.8]: expected [low, high]: the case's own value is th"),
    )),
    ({"uncertain": {"contact.restitution": 0.1, "contact.rolling_friction": [0.2, 0.1]}},
     "uncertain.contact.restitution = 0.1: expected [low, high] or { loguniform = [low, high] }\n"
     "uncertain.contact.rolling_friction = [0.2, 0.1]: "),
    ({"library": {"surface_pairs": [{"materials": ["rubby", "glass"]}]}},
     'library.surface_pairs[0].materials = "rubby": not in the library; expected one of ruby, '),
]  # fmt: skip
LIBRARIES: list[tuple[str, str]] = [
    (
        '[materials.mine]\ndensity = "2 g/cm^3"',
        'density = "2 g/cm^3": expected { value = ..., source = "..." }',
    ),
    (
        '[materials.mine]\ndensity = { value = "2 g/cm^3" }',
        'source: missing; expected a value such as "weighed"',
    ),
    ("[material.mine]", 'library.toml: material = {"mine": {}}: unknown key; a library takes '),
    (material("glass"), "materials.glass: is in the library of"),
    (
        material("m", range=["3 g/cm^3", "4 g/cm^3"]),
        "expected two ends with the value between them",
    ),
    (material("a\x1b[31m"), "materials.a\\x1b[31m: expected printable text on one line"),
    (
        pairs(["glass", "ruby"], ["ruby", "glass"]),
        "surface_pairs[1] = ruby on glass: is given twice; expected one",
    ),
    (
        pairs(["chromium-coated glass", "ruby"]),
        "[0] = chromium-coated glass on ruby: is in the library of",
    ),
]
SQUARE = [(x, y, z) for z in (0, 4) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))]
FLIPPED = [(x, -y, -z) for x, y, z in SQUARE]
FLOOR, SIDES = [(1, 2, 3, 4)], [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
OPEN_BOX = [*FLOOR, *SIDES]


def obj(points: list[tuple[float, ...]], faces: list[tuple[int, ...]]) -> str:
    lines = [f"v {' '.join(map(str, point))}" for point in points]
    corners = [(one[0], *pair) for one in faces for pair in pairwise(one[1:])]
    return "\n".join([*lines, *(f"f {' '.join(map(str, face))}" for face in corners), ""])


OF_MESH = {"mesh": "own.obj", "scale": "1 mm"}
BALL = {"dimers": None, "placed": [bead("0.3 mm", "0 mm")], "run": {"cycles": 10}}
BALL_IN_WALL = {**BALL, "placed": [bead("0.3 mm", "1.8 mm")]}
INNER = [(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 1.0, 1.0), (0.0, 0.0, 2.0)]
TETRAHEDRON = [(1, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]


def beside(points: list[tuple[float, ...]]) -> str:
    """A box, and a tetrahedron of given points with it."""
    return obj(
        [*SQUARE, *points], [*OPEN_BOX, *(tuple(8 + k for k in face) for face in TETRAHEDRON)]
    )


def plane(*normal: float, at: tuple[str, str, str] = ("0 mm", "0 mm", "0 mm")) -> dict[str, Any]:
    return {"point": list(at), "normal": list(normal)}


CUP = [plane(0, 0, 1), *(plane(-x, -y, 0, at=(f"{2 * x} mm", f"{2 * y} mm", "0 mm"))
                        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)))]  # fmt: skip
VESSELS: list[tuple[str | None, dict[str, Any], dict[str, Any], str]] = [
    (None, OF_MESH, {}, 'boundary.mesh = "own.obj": no such file; expected a mesh'),
    ("v a b c", OF_MESH, {}, 'boundary.mesh = "own.obj": cannot be read: Failed to parse 0th vertex'),
    (obj(SQUARE, []), OF_MESH, {}, 'boundary.mesh = "own.obj": has 0 triangles; expected the inner surface'),
    (obj([(0.0, 0.0, 0.0)] * 8, OPEN_BOX), OF_MESH, {}, "has no triangles of any size"),
    (obj(SQUARE, OPEN_BOX), {"mesh": "own.obj"}, {}, 'boundary.scale: missing; expected a value such as "1 mm"'),
    (obj(SQUARE, OPEN_BOX), {**OF_MESH, "shape": "box"}, {}, "expected none beside boundary.mesh"),
    (obj(SQUARE, OPEN_BOX), {**OF_MESH, "height": "3 mm"}, {}, 'boundary.height = "3 mm": expected none for a vessel'),
    (obj(SQUARE, SIDES), OF_MESH, {}, "has 2 openings, the lowest at (-2, -2, 0) mm; expected one, at its top"),
    (obj(FLIPPED, OPEN_BOX), OF_MESH, {}, "is open at its lowest point, at (-2, 2, -4) mm; expected a closed"),
    (obj(SQUARE[:2] + SQUARE[4:6] + [(0.0, 3.0, 1.0), (0.0, 3.0, 3.0)],
         [(1, 2, 4, 3), (2, 6, 5, 4), (6, 3, 1, 5)]), OF_MESH, {}, "has a surface of one side alone, at ("),
    (obj(SQUARE, [*OPEN_BOX, (1, 3, 7, 5)]), OF_MESH, {}, "has 3 triangles at an edge, at (0, 0, 0) mm; expected two"),
    (beside([(x + 1.5, y, z) for x, y, z in INNER]), OF_MESH, {}, "has triangles that intersect, at (2, 0"),
    (beside([(x, y, z - 1.0) for x, y, z in INNER]), OF_MESH, {}, "has triangles that overlap in a plane, at ("),
    (obj(SQUARE, OPEN_BOX), {**OF_MESH, "scale": "1 m"}, {},
     'boundary.scale = "1 m": the vessel is 4 m wide and the beads 0.6 mm; expected 1 to 1000 beads across'),
    (obj(SQUARE, OPEN_BOX), OF_MESH, BALL_IN_WALL, "placed[0].at = "),
    (obj([*SQUARE[4:], (0, 0, 0)], [(1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 1, 5)]), OF_MESH, {},
     "has no level floor at its bottom, on which walkers stand"),
    (None, {"planes": CUP}, {}, "boundary.height: missing"),
    (None, {"planes": [plane(0, 0, 1, at=("0 mm", "0 mm", "1 mm")), *CUP[1:]], "height": "5 mm"}, {},
     "have their lowest point at z = 1 mm; expected 0 mm"),
    (None, {"planes": CUP[1:], "height": "5 mm"}, {}, ": are open toward -z"),
    (None, {"planes": [*CUP, plane(0, 0, -1)], "height": "5 mm"}, {}, ": enclose nothing"),
    (None, {"planes": [*CUP, plane(0, 0, 0)], "height": "5 mm"}, {}, "planes[5].normal = [0, 0, 0]: expected a"),
    (None, {"planes": [*CUP, plane(0, 1, 2)], "height": "5 mm"}, {},
     "boundary.planes[5].normal = [0, 1, 2]: turns by 26.6 deg from planes[0]; expected 45 deg or more"),
    (None, {"planes": [*CUP, plane(-1, 1, 0, at=("9 mm", "0 mm", "0 mm"))], "height": "5 mm"}, {}, ": is behind the"),
]  # fmt: skip
"""Mesh, boundary, other tables, and what is said."""
LAW = """
import dataclasses, sys
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
    ("law = 3", "has no function law"),
    (
        "def law(surfaces): return Curve(forces, -1.0)",
        "breaks at a gap of -1 m; expected a positive number",
    ),
    (
        "def law(surfaces): return Curve(forces, 1e-4, 2e-4)",
        "forms at a gap of 0.0002 m; expected 0 to its rupture",
    ),
    ("def law(surfaces): return Curve(lambda gaps: gaps, 1e-4)", "forces are ndarray; expected"),
    (
        "def law(surfaces): return Curve(lambda gaps: forces(gaps, np.nan), 1e-4)",
        "the pull is not a number",
    ),
]
LONG = "x" * 100_000


def trace(head: str = "time (ms), x (g)", rows: int = 100, step: float = 0.5, **odd: str) -> str:
    """A record of 4 g at 80 Hz, with some odd rows by number."""
    lines = [f"{step * row!r}, {4.0 * sin(160e-3 * pi * step * row)!r}" for row in range(rows)]
    return "\n".join(
        [head, *(odd.get(f"row_{number}", line) for number, line in enumerate(lines, 1))]
    )


STAMPS = "\n".join(
    ["time (ms), x (g)", *(f"{row // 5}, {4.0 * sin(0.1 * row)!r}" for row in range(1000))]
)
GAP = "\n".join(
    line for number, line in enumerate(trace(rows=200).split("\n")) if number not in (51, 52, 53)
)
HOLES = "\n".join(
    line for number, line in enumerate(trace(rows=200).split("\n")) if number not in (6, 60, 90)
)
DEAD = "\n".join(["time (ms), x (g)", *(f"{0.2 * row!r}, 1.0" for row in range(1000))])
FAINT = "\n".join(
    ["time (ms), x (g)", *(f"{0.5 * row!r}, {4e-310 * sin(0.25 * row)!r}" for row in range(1000))]
)
# A record, what else the drive and the run say, and the message after the key.
RECORDS: list[tuple[str | bytes, dict[str, Any], str]] = [
    (
        trace("time, x (g)"),
        {},
        'drive.record = "record.csv": column "time": expected a time with its unit',
    ),
    (
        trace("time (ms), ax"),
        {},
        'column "ax": expected an acceleration with its unit, such as "4 g", in brackets',
    ),
    (
        trace("time (ms), x (mm)"),
        {},
        'record = "record.csv": column "x (mm)": expected an acceleration with its unit',
    ),
    (
        trace("time (ms), acceleration (g)"),
        {},
        '"time (ms), acceleration (g)" names no acceleration along x, y or z',
    ),
    (trace("count, x (g)"), {}, '"count, x (g)" names no time'),
    (
        trace("LabVIEW Measurement"),
        {},
        'found "LabVIEW Measurement": replace all lines above the numbers by a header',
    ),
    (
        trace("time (ms), x (g), acc_x (g)"),
        {},
        'columns "x (g)" and "acc_x (g)" are both the acceleration along x',
    ),
    (
        trace("time (ms), t (ms), x (g)"),
        {},
        'columns "time (ms)" and "t (ms)" are both the time; expected one',
    ),
    ("", {}, "is empty; expected a header that names the time and accelerations along x, y or z"),
    (b"\xff\xfe", {}, "expected UTF-8 text, found byte 0xff in line 1: save the file as UTF-8"),
    (
        "time (s), x (m/s²)\n0, 1\n".encode("latin-1"),
        {},
        "found byte 0xb2 in line 1: save the file as UTF-8",
    ),
    (trace().encode("utf-16-le"), {}, "found zero bytes: save the file as UTF-8"),
    (
        trace(row_7="3.0, 1.0, 2.0"),
        {},
        "row 7 has 3 values, the header 2 names: decimal commas? Then separate the",
    ),
    (
        trace(row_1="0,0,0,02"),
        {},
        "row 1 has 4 values, the header 2 names: decimal commas? Then separate the columns",
    ),
    (
        trace("time (ms); x (g)", row_7="3; 1; 2").replace(", ", "; "),
        {},
        "row 7 has 3 values, the header 2 names; exp",
    ),
    (
        trace("time (ms); x (g)", row_7="3; 1,5").replace(", ", "; "),
        {},
        'a comma, "1,5", and with a point, "0.0"; exp',
    ),
    (trace(row_7="3.0"), {}, 'row 7: column "x (g)" is ""; expected a number'),
    (trace(row_7="3.0, nan"), {}, 'row 7: column "x (g)" is "nan"; expected a number'),
    (trace(row_7="3.0, 1_0"), {}, 'row 7: column "x (g)" is "1_0"; expected a number'),
    (
        trace(row_7="3.0, 1e5"),
        {},
        "row 7: expected a number in each column, accelerations up to 10000 m/s²",
    ),
    (
        trace(row_7="2.5, 1.0"),
        {},
        "row 7 is 0 ms after the one before; expected times that increase without gaps",
    ),
    (
        GAP,
        {},
        "row 51 is 2 ms after the one before; expected times that increase without gaps, about 0.5 ms apart",
    ),
    (
        HOLES,
        {},
        "row 6 is 1 ms after the one before; expected times that increase without gaps, about 0.5 ms apart",
    ),
    (
        trace(row_7="-3.0, 1.0"),
        {},
        "row 7 is -5.5 ms after the one before; expected times that increase without gaps",
    ),
    (
        trace(step=-0.5),
        {},
        "times decrease from row to row; expected the first measurement in the first row",
    ),
    (STAMPS, {}, "times repeat: rows 1 and 2 are both at 0 ms; expected times with more digits"),
    (DEAD, {}, "the acceleration is constant, as from a dead sensor; expected one that changes"),
    (FAINT, {}, "expected an acceleration of 1e-09 m/s² or more, found 3.9e-309 m/s²"),
    (trace(rows=9), {}, "has 9 rows; expected 16 to 100000"),
    (
        trace(rows=40, step=4.0),
        {},
        "rows are too far apart, or too noisy: leaving out every second one changes the ac",
    ),
    (
        trace(rows=20),
        {},
        "expected at least 3 periods of its strongest line, found 1: the offset of the sensor",
    ),
    (trace(), {}, "run.cycles = 24: expected at most 3 cycles: drive.record has no more"),
    (
        trace(),
        {"ramp": [["0 s", 0], ["0.01 s", 0]]},
        'drive.ramp = [["0 s", 0], ["0.01 s", 0]]: expected a factor abo',
    ),
    (trace(rows=14_000, step=3e-3), {}, "its rows, 3 us apart, are closer than the time step, 3.9"),
    (
        trace(),
        {"repeats": True},
        "repeats = true: expected a record that ends with the first row of the next period",
    ),
    (
        trace(),
        {"frequency": "80 Hz"},
        'drive.record = "record.csv": expected either frequency or record, not both',
    ),
    (trace(), HARMONICS, 'drive.record = "record.csv": expected none beside drive.harmonics'),
    (
        trace(),
        {"record": "none.csv"},
        'drive.record = "none.csv": cannot be read: No such file or directory',
    ),
]
FILES: list[tuple[Files, str, str]] = [
    # No TOML, or no case
    ({"bad.toml": "[dimers\nradii = 3"}, "show bad.toml", "bad.toml: not TOML: "),
    (
        {"bad.toml": b'[dimers]\nradii = ["0.3 mm", \xff]'},
        "show bad.toml",
        "bad.toml: expected UTF-8 text",
    ),
    ({"bad.toml": "a = " + "[" * 5000}, "show bad.toml", "bad.toml: not TOML: "),
    # What is long, or has control characters
    ({}, f"show fig1b --set drive.frequency={LONG}", 'fig1b: drive.frequency = "xxx'),
    ({}, f"show fig1b --set {LONG}=3", "fig1b: xxx"),
    ({"s.toml": f'case = "fig1b"\n[axes]\n"{LONG}" = [1]\n'}, "sweep s.toml", "s.toml: xxx"),
    ({"s.toml": 'case = "one\\ntwo\\u001b[31m"\n'}, "sweep s.toml", "one two"),
    ({}, "show 'xxx\n\x1b[31m'", "xxx"),
    ({}, f"show {LONG}", "cannot be read"),
]
READING = ("plot", "render --film", "report", "export --to lammps", "export --to archive")
COMMANDS: list[tuple[str, str]] = [
    # What is of another kind, with the command for it
    ("run fig2", "fig2: is a sweep: walkers sweep fig2"),
    ("export --to deck {sweep}", "is a sweep's directory: walkers list"),
    ("show --theory ruby", "ruby: is a calibration: walkers calibrate ruby"),
    ("render {sweep}", "is a sweep: expected one of its runs"),
    ("plot {archive}", "an archive: unpack it"),
    ("run {archive}", "an archive: unpack it"),
    ("compare {archive} fig1b", "an archive: unpack it"),
    ("list {run}", "is a run: walkers run "),
    ("compare {sweep} {run}", "is a sweep's directory: walkers list"),
    ("climb {sweep}", "expected a finished run of a pile"),
    ("check files .", "expected a run directory"),
    # What is not there, cannot be read or makes no sense
    *((f"{command} fig1b", "no finished run in runs; first do: walkers run fig1b") for command in READING),
    ("plot .", "not a finished run"),
    ("plot folder.html", "manifest.json cannot be read"),
    *((f"sweep {what}", "")
      for what in ("bad_sweep.toml", "nosuch", "mine.toml --site nosite.toml", "mine.toml --out {case}")),
    *((f"{command} fig1b --set 'drive.frequency=70 mm'", 'fig1b: drive.frequency = "70 mm": expected a frequency')
      for command in ("show", "run", "plot", "check")),
    *((f"{command} fig1b --set liquid.volume_fraction=0.02 --set 'liquid.contact_angle=88 deg'",
       'fig1b: liquid.contact_angle = "88 deg": expected')
      for command in ("show", "run", "run --spread")),
    ("sweep fig4 --set 'liquid.name=Si AK5'", 'liquid.name = "Si AK5": varies in this sweep and cannot be set'),
    ("show fig1b --set drive.freq=2 --set beads.mat=3", '"frequency" or "frame"?\nfig1b: beads.mat: unknown key'),
    ("show fig1b --set run.seed=1 --set run.seed=2", "run.seed = 2: is given twice"),
    ("show climber --set 'clusters.angle=45 deg'", "clusters is a list: say which one, such as clusters[0]"),
    *((f"show fig1b --set 'liquid.law=\"{law}\"'", told) for law, told in (
        ("no-such-law", "expected one of rabinovich, soulie, willett, young-laplace"),
        ("no/such.py:law", "such.py cannot be read: No such file"),
        ("own.py:law\\nrange", "expected one of"),
        ("os:system", "expected one of"),
    )),
    ("show fig1b --set beads.material=steel", 'did you mean "chrome steel" or "stainless steel"?'),
    ("show fig1b --set liquid.name=Glycerol", 'did you mean "glycerol" or "glycerol 87 %" or "water-glycerol"?'),
    ("show fig1b --set 'liquid.name=glycerol 99 %'", 'did you mean "glycerol" or "glycerol 87 %"?'),
    ("library steel", 'steel: not in the library; did you mean "chrome steel" or "stainless steel"?'),
    # Options
    ("run", "CASE"),
    ("export fig1b", "--to requires an argument. Choose from: deck, vtk, lammps, archive. See: walkers export --help"),
    ("check fig1b --without magic", "--without magic: expected one of"),
    *((f"{command} --engine /nowhere", "--engine /nowhere: expected the name or path of a liggghts binary")
      for command in ("run fig1b", "check engine", "sweep mine.toml")),
    # Mistyped names
    ("--libary", 'Unknown command "--libary"'),
    ("new {case}", "exists already"),
    *((f"new '{name}'", f"{name or '.'}: expected a name") for name in ("", "..")),
    ("show fig1b --set 'run.seed=3\nfoo=4'", 'fig1b: run.seed = "3\\nfoo=4": expected a whole number'),
    ("run {case} plain", "plain: is a folder without a run"),
    ("clean nonsense --yes --out {runs}", "nonsense: no such file, run or sweep"),
    ("plot {sweep} --y velocitty", 'did you mean "velocity"?'),
    ("plot {sweep} --to figure.jpg", "figure.jpg: expected the name of a .png or .svg or .pdf file"),
    ("report {run} --to a.txt", "expected the name of a .html or .htm file"),
    ("plot {run} --to out.png", "out.png: expected a folder"),
    ("export {run} --to vtk --licence MIT", "--licence: is for --to archive"),
    ("export {sweep} --to archive --every 2", "--every: is for --to vtk, lammps"),
    ("export {run} --to vtk --every 0", "--every: 0: expected 1 or more"),
    *((f"export {{run}} --to archive {words}", told) for words, told in (
        ("-o run.tar", "-o: expected the name of a .zip file"),
        ("--licence ' '", "--licence: expected a licence such as CC-BY-4.0"),
        ("--author N --author ''", "--author: expected names that are not empty"),
    )),
    ("render {run} --fps 10", "--fps: is for --film"),
    *((f"render --film {{run}} {words}", told) for words, told in (
        ("--to walk.avi", "expected the name of a .mp4 or .gif file"),
        ("--to walk.gif --fps 30", "expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF"),
        ("--size 333x201", "expected even numbers for an MP4"),
        ("--walker 2", "walker: 2: expected 0 to 1"),
        ("--begin '0.2 s'", "expected times within the drive, 0 to 0.1 s"),
    )),
    ("render --film {run} --size wide", "--size: 'wide': expected 360p, 480p, 720p, 1080p"),
]  # fmt: skip


def _said(tables: dict[str, Any]) -> dict[str, Any]:
    said = {
        key: _said(value) if isinstance(value, dict) else value for key, value in tables.items()
    }
    return {key: value for key, value in said.items() if value is not None}


def _bad(told: str, files: Files, **tables: Any) -> tuple[Files, str, str]:
    return {**files, "bad.toml": to_toml(_said(document(**tables)))}, "show bad.toml", told


ROWS: list[tuple[Files, str, str]] = [
    *(_bad(told, {}, **tables) for tables, told in CASES),
    *(
        _bad(told, {"record.csv": text}, drive={**NO_SINE, **drive})
        for text, drive, told in RECORDS
    ),
    *(
        _bad(
            told,
            {"own.obj": mesh} if mesh else {},
            **others,
            boundary={"material": "glass", **boundary},
        )
        for mesh, boundary, others, told in VESSELS
    ),
    *(({"library.toml": text}, "show fig1b", told) for text, told in LIBRARIES),
    *(({"own.py": f"{LAW}\n{text}\n"}, USE_LAW, f"executes \n{told}") for text, told in LAWS),
    *FILES,
    *(({}, command, told) for command, told in COMMANDS),
]
"""Files, a command, and a part of each line that it is refused with."""


@pytest.fixture
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path]:
    """What the commands of `ROWS` are given, by name."""
    for folder, file in (("folder.html", "manifest.json"), ("plain", "")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text("{") if file else None
    for file, values in (("mine", '"60 Hz"'), ("bad_sweep", '"60 Hz", "0 Hz"')):
        (tmp_path / f"{file}.toml").write_text(
            f'case = "fig1b"\naxes.drive.frequency = [{values}]\n'
        )

    def found(name: str) -> Path:
        if name in ("pile", "archive"):
            return Path(request.getfixturevalue({"pile": "pile_run"}.get(name, name)))
        if name == "run":
            run = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20}
            return Path(request.getfixturevalue("run_directory")(dimers={"replicates": 2}, run=run))
        names = {"runs": ".", "sweep": "grid", "case": "../base.toml"}
        return Path(request.getfixturevalue("looked_through") / names[name]).resolve()

    return found


@pytest.mark.parametrize(
    ("files", "command", "told"), ROWS, ids=[f"{one[:50]}: {told[:50]}" for _, one, told in ROWS]
)
def test_bad_input(
    files: Files, command: str, told: str, place: Callable[[str], Path], tmp_path: Path
) -> None:
    for name, contents in files.items():
        (tmp_path / name).write_bytes(
            contents if isinstance(contents, bytes) else contents.encode()
        )
    places = {name: place(name) for _, name, _, _ in Formatter().parse(command) if name}
    folders = [tmp_path, *(path for path in places.values() if path.is_dir())]
    before = [sorted(folder.rglob("*")) for folder in folders]
    done = call(*shlex.split(command.format(**places)), folder=tmp_path)
    mistakes = told.split("\n")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", len(mistakes)), (
        done.stderr
    )
    assert all(one in done.stderr for one in mistakes), done.stderr
    assert done.stderr.replace("\n", "").isprintable()
    assert len(done.stderr) < 1500 * len(mistakes)
    assert [sorted(folder.rglob("*")) for folder in folders] == before
