"""Bad input: one line for each mistake, with its file, key, value and what is expected instead.

Each test states a mistake and a part of its message, most often with the expected value. What all
refusals have in common (exit status 2, no other output, no file written) is checked by
`assert_refused`.
"""

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from math import pi, sin
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import call, document, to_toml

Changes = dict[str, Any]
"""Changed tables of the reference case; a key that is None is left out."""
Point = tuple[float, float, float]
Face = tuple[int, ...]

pytestmark = pytest.mark.usefixtures("in_folder")


def files_below(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


def assert_refused(command: str, *messages: str, folders: Sequence[Path] = ()) -> None:
    """Check that the program answers a command by one line for each mistake.

    Each message is a part of a line. No file appears in the working directory or in the other
    folders.
    """
    watched = [Path.cwd(), *folders]
    before = [files_below(folder) for folder in watched]
    done = call(*shlex.split(command))
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == len(messages), done.stderr
    for message in messages:
        assert message in done.stderr
    for line in done.stderr.split("\n"):
        assert line.isprintable()
        assert len(line) < 1500
    assert [files_below(folder) for folder in watched] == before


def without_none(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables without the keys that are None."""
    present: dict[str, Any] = {}
    for key, value in tables.items():
        if isinstance(value, dict):
            present[key] = without_none(value)
        elif value is not None:
            present[key] = value
    return present


def assert_case_refused(changes: Changes, *messages: str) -> None:
    """Check what the program says of the reference case with changed tables."""
    Path("bad.toml").write_text(to_toml(without_none(document(**changes))), "utf-8")
    assert_refused("show bad.toml", *messages)


def cluster(arrangement: str, *radii: str) -> Changes:
    """A cluster in an arrangement by name, in place of the dimers."""
    return {"clusters": [{"arrangement": arrangement, "radii": list(radii)}], "dimers": None}


def cluster_at(*places: list[str], radii: tuple[str, str] = ("0.3 mm", "0.2 mm")) -> Changes:
    """A cluster of two beads at places x, y, in place of the dimers."""
    return {"clusters": [{"radii": list(radii), "at": list(places)}], "dimers": None}


def bead(radius: str, x: str) -> dict[str, Any]:
    """A placed bead, 1 mm above the origin of z."""
    return {"radius": radius, "at": [x, "0 mm", "1 mm"]}


MIXTURE = {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 20}
HARMONIC = {"frequency": "80 Hz", "peak_acceleration": "1 g"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"dimers": {"radii": ["0.3", "0.2 mm"]}},
            'dimers.radii[0] = "0.3": expected a length with its unit',
            id="radius without a unit",
        ),
        pytest.param(
            {"beads": {"density": 4000}},
            "beads.density = 4000: expected a density with its unit",
            id="number in place of a density",
        ),
        pytest.param(
            {"drive": {"peak_acceleration": "-4 g"}},
            "it must be zero or more",
            id="negative acceleration",
        ),
        pytest.param(
            {"drive": {"frequency": "500 rad/s"}},
            "(cycles per second, not an angular frequency)",
            id="angular frequency",
        ),
        pytest.param(
            {"drive": {"axis": [10**400, 0, 1]}},
            "expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]",
            id="axis with a component beyond all floats",
        ),
        pytest.param(
            {"drive": {"axis": [1e-200, 0, 0]}},
            "expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]",
            id="axis whose square underflows",
        ),
        pytest.param(
            {"contact": {"youngs_modulus": "1 MPa"}},
            "it must lie between 5 and 100000 MPa",
            id="modulus below its bounds",
        ),
        pytest.param(
            {"dimers": {"radii": ["0.3 mm"]}},
            '["0.3 mm"]: has 1 value; expected 2, such as ["0.3 mm", "0.2 mm"]',
            id="one radius for two beads",
        ),
        pytest.param(
            {"contact": {"restitution": 1.2}},
            "contact.restitution = 1.2: expected at most 1",
            id="restitution above 1",
        ),
        pytest.param(
            {"run": {"cycles": "allways"}},
            'run.cycles = "allways": expected a whole number, or "auto"',
            id="word in place of a number",
        ),
        pytest.param(
            {"drive": {"ramp": [["0 s", -1]]}},
            "drive.ramp[0][1] = -1: expected at least 0",
            id="negative factor of a ramp",
        ),
    ],
)
def test_a_value_that_is_none_of_its_kind(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"liquid": {"volume_fracton": 0.01}},
            "liquid.volume_fracton = 0.01: unknown key; [liquid] takes name, ",
            id="mistyped key",
        ),
        pytest.param(
            {"dimers": {"seed": 2}},
            'did you mean "run.seed"',
            id="key of another table",
        ),
        pytest.param(
            {"run": {"until_steady": True}},
            "run.until_steady = true: unknown key; [run] takes time_step, ",
            id="former key",
        ),
        pytest.param(
            {"boundary": {"points": [[0, 0, 0]]}},
            "boundary.points = [[0, 0, 0]]: unknown key; [boundary] takes shape, ",
            id="boundary.points, which the program derives",
        ),
        pytest.param(
            {"meshes": {"own": {}}},
            'meshes = {"own": {}}: unknown key: the program reads this table from a file',
            id="table of meshes",
        ),
        pytest.param(
            {"records": {"own": {}}},
            'records = {"own": {}}: unknown key: the program reads this table from a file',
            id="table of records",
        ),
    ],
)
def test_an_unknown_key(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"liquid": {"meniscus_radius": "70 um"}},
            "expected either volume_fraction or meniscus_radius, not both",
            id="volume and radius of menisci",
        ),
        pytest.param(
            {
                "liquid": {"volume_fraction": None, "meniscus_radius": "70 um"},
                "uncertain": {"liquid.volume_fraction": [0.1, 0.2]},
            },
            "uncertain.liquid.volume_fraction = [0.1, 0.2]: "
            "expected liquid.meniscus_radius, which the case has instead",
            id="range of a volume that the case does not have",
        ),
        pytest.param(
            {"liquid": {"volume_fraction": None, "meniscus_radius": "1 mm"}},
            'liquid.meniscus_radius = "1 mm": '
            "expected menisci that fit between the surfaces: no bridge between",
            id="menisci larger than the beads",
        ),
        pytest.param(
            # The smaller bead has a radius of 0.2 mm.
            {"contact": {"roughness": {"bead_bead": "2.1 um"}}},
            'contact.roughness.bead_bead = "2.1 um": '
            "expected 2 um or less, a hundredth of a bead's radius",
            id="roughness above a hundredth of a radius",
        ),
        pytest.param(
            {"liquid": {"contact_angle": "84 deg"}},
            "expected a smaller angle or less liquid: at rest, the",
            id="bridges that push at rest",
        ),
        pytest.param(
            {"liquid": {"contact_angle": "90 deg"}, "environment": {"gravity": "0 g"}},
            "bead 1 and the boundary apart",
            id="beads that nothing presses to the substrate",
        ),
        pytest.param(
            {"contact": {"youngs_modulus": "5 MPa"}, "liquid": {"surface_tension": "9 N/m"}},
            'contact.youngs_modulus = "5 MPa": '
            "expected a larger one: at rest the beads overlap by more than 2 %",
            id="beads too soft for their bridges",
        ),
        pytest.param(
            # A share of mass lies between 0 and 1, so 60 is a percentage.
            {"liquid": {"name": "water-glycerol", "mass_fraction": 60}},
            "liquid.mass_fraction = 60: expected the mass of",
            id="mass fraction in percent",
        ),
        pytest.param(
            {"liquid": {"conserved": True}},
            "liquid.conserved = true: ",
            id="conserved liquid without a pile",
        ),
    ],
)
def test_a_liquid_or_contact_that_contradicts_the_rest_of_the_case(
    changes: Changes, message: str
) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        pytest.param(
            {"gamma0": 0.5},
            "drive.gamma0 = 0.5: expected either peak_acceleration or gamma0, not both",
            id="peak_acceleration and gamma0",
        ),
        pytest.param(
            {"harmonics": [HARMONIC], "peak_acceleration": None},
            "beside drive.harmonics: write drive.harmonics[0].frequency",
            id="frequency beside harmonics",
        ),
        pytest.param(
            {"phase": "10 deg", "frame": "lab"},
            'drive.frame = "lab": expected "container"',
            id="phase in the frame of the laboratory",
        ),
        pytest.param(
            {
                "harmonics": [HARMONIC, HARMONIC | {"frequency": "81.3 Hz"}],
                "frequency": None,
                "peak_acceleration": None,
            },
            "expected frequencies with a common period",
            id="harmonics of 80 and 81.3 Hz",
        ),
        pytest.param(
            {
                "frequency": None,
                "peak_acceleration": None,
                "record": {"rows": [[0, 1]]},
            },
            "expected text: a file of comma-separated values",
            id="rows in place of the file of a record",
        ),
        pytest.param(
            {"repeats": True},
            "drive.repeats = true: expected none without drive.record",
            id="repeats without a record",
        ),
        pytest.param(
            {"ramp": [["0 s", 1], ["0 s", 0.5]]},
            'drive.ramp = [["0 s", 1], ["0 s", 0.5]]: expected times that increase',
            id="ramp with two factors at a time",
        ),
        pytest.param(
            # 2 s of 80 Hz are 160 cycles; the case has 24.
            {"ramp": [["0 s", 1], ["2 s", 0.5]]},
            "run.cycles = 24: expected at least 160 cycles, 2 s, of drive.ramp",
            id="ramp longer than the run",
        ),
    ],
)
def test_a_drive_that_contradicts_itself(drive: dict[str, Any], message: str) -> None:
    assert_case_refused({"drive": drive}, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"run": {"time_step": "20 us"}},
            'run.time_step = "20 us": beyond the rayleigh',
            id="time step beyond the Rayleigh limit",
        ),
        pytest.param(
            {"run": {"until": "climb"}},
            'run.until = "climb": expected none: only clusters of a [mixture] climb',
            id="waiting for the climb of a dimer",
        ),
        pytest.param(
            {"run": {"cycles": 10, "settling_cycles": 10}},
            "run.settling_cycles = 10: expected at most",
            id="nothing left to measure after settling",
        ),
        pytest.param(
            # Steps are counted in 32 bits: 2³¹ steps of 3.9 us are 8388 s.
            {"run": {"cycles": None, "settling_cycles": None, "duration": "1e4 s"}},
            'run.duration = "1e4 s": expected at most 8388 s: the engine counts',
            id="more steps than the engine counts",
        ),
        pytest.param(
            {
                "dimers": None,
                "mixture": MIXTURE,
                "boundary": {"shape": "box", "width": "9 mm", "height": "9 mm"},
                "run": {"longest_settling": "1e4 s"},
            },
            'run.longest_settling = "1e4 s": expected less than',
            id="more steps of settling than the engine counts",
        ),
        pytest.param(
            {"dimers": None, "placed": [bead("1 mm", "9 mm")], "run": {"seed": 3}},
            "run.seed = 3: expected none with placed",
            id="seed where nothing is random",
        ),
        pytest.param(
            {
                "drive": {"ramp": [["0 s", 1], ["2 s", 0.5]]},
                "run": {"cycles": "auto", "settling_cycles": None},
            },
            'run.cycles = "auto": '
            "expected a number of cycles: with drive.ramp no velocity is constant",
            id="waiting for a constant velocity under a ramp",
        ),
    ],
)
def test_a_length_or_step_of_a_run_that_cannot_be(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"dimers": {"facing": "up"}, "boundary": {"tilt": "90 deg", "uphill": "90 deg"}},
            'dimers.facing = "up": exp',
            id="facing up on a vertical wall",
        ),
        pytest.param(
            {"dimers": {"replicates": 2, "spacing": "0.5 mm"}},
            'dimers.spacing = "0.5 mm": neighbouring walkers would touch',
            id="spacing smaller than the walkers",
        ),
        pytest.param(
            # 0.3 mm + 0.3 mm = 0.6 mm
            {"dimers": {"replicates": 9, "spacing": "1 mm", "meet": True}},
            "a bead overlaps with one of another walker by 0.188 mm; "
            "expected their centres 0.6 mm apart, where they touch",
            id="walkers that meet and overlap",
        ),
        pytest.param(
            cluster("chain", "0.3 mm", "0.05 mm", "0.3 mm"),
            "beads 1 and 3 would overlap in a chain",
            id="chain around a bead that is too small",
        ),
        pytest.param(
            cluster("fan", "0.3 mm", *["0.2 mm"] * 12),
            "too many beads to fit around the first one",
            id="fan of 12 beads",
        ),
        pytest.param(
            cluster_at(["0 mm", "0 mm"], ["-1 mm", "0 mm"]),
            "this bead is not connected to the first",
            id="cluster in two parts",
        ),
        pytest.param(
            # Touching beads of 0.3 and 0.2 mm on a substrate: 2√(0.3 × 0.2) = 0.4899 mm along it
            cluster_at(["0 mm", "0 mm"], ["0.1 mm", "0 mm"]),
            "clusters[0].at[0] by 0.39 mm; expected their centres 0.4899 mm apart",
            id="cluster whose beads overlap",
        ),
        pytest.param(
            cluster_at(["0 mm", "0.3 mm"], ["0 mm", "-0.3 mm"], radii=("0.3 mm", "0.3 mm")),
            "this walker has no heading",
            id="cluster without a heading",
        ),
        pytest.param(
            # 1 mm + 0.5 mm = 1.5 mm, and the centres are 1.4 mm apart.
            {"placed": [bead("1 mm", "9 mm"), bead("0.1 mm", "30 mm"), bead("0.5 mm", "10.4 mm")]},
            "overlaps with placed[0] by 0.1 mm; "
            "expected their centres 1.5 mm apart, where they touch",
            id="placed beads that overlap",
        ),
        pytest.param(
            {"mixture": {**MIXTURE, "count": 200_001}},
            "mixture.count = 200001: expected at most 200000",
            id="200001 beads",
        ),
        pytest.param(
            {
                "mixture": {
                    **MIXTURE,
                    "small": None,
                    "small_diameters": ["0.63 mm", "0.6 mm"],
                }
            },
            'mixture.small_diameters = ["0.63 mm", "0.6 mm"]: expected the smaller one first',
            id="small_diameters that descend",
        ),
    ],
)
def test_bodies_that_cannot_be_placed(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {
                "mixture": MIXTURE,
                "boundary": {"shape": "box", "width": "1.5 mm", "height": "9 mm"},
            },
            "boundary.width = ",
            id="box too narrow for a mixture",
        ),
        pytest.param(
            {
                "dimers": {"radii": ["0.5 mm", "0.2 mm"]},
                "boundary": {"shape": "groove", "opening": "30 deg"},
            },
            "the radii differ too much: the beads do not touch",
            id="groove in which the beads lie apart",
        ),
        pytest.param(
            {"boundary": {"tilt": "-5 deg"}},
            'must be zero or more; boundary.uphill = "180 deg" turns the slope',
            id="negative tilt",
        ),
        pytest.param(
            {
                "clusters": [{"arrangement": "fan", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"]}],
                "dimers": None,
                "boundary": {"shape": "channel", "width": "0.7 mm"},
            },
            "do not fit between the walls of the channel; expected a wider boundary",
            id="channel narrower than a cluster",
        ),
        pytest.param(
            # The larger bead has a diameter of 0.74 mm.
            {
                "dimers": {"radii": ["0.2 mm", "0.37 mm"]},
                "boundary": {"shape": "box", "width": "9 mm", "height": "0.3 mm"},
            },
            'boundary.height = "0.3 mm": too low for the walkers of dimers; '
            "expected at least 0.74 mm",
            id="height of a box that is too low",
        ),
    ],
)
def test_a_boundary_that_the_bodies_do_not_fit(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"dimers": None},
            "dimers: missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]",
            id="bodies",
        ),
        pytest.param(
            {"boundary": None},
            "boundary: missing; expected a table [boundary]",
            id="boundary",
        ),
        pytest.param(
            {
                "liquid": {
                    "name": None,
                    "kinematic_viscosity": "5 mm^2/s",
                    "surface_tension": "20 mN/m",
                }
            },
            "liquid.density: missing; expected the liquid's density beside its kinematic_viscosity",
            id="density beside a kinematic viscosity",
        ),
    ],
)
def test_something_missing(changes: Changes, message: str) -> None:
    assert_case_refused(changes, message)


def test_every_missing_key_has_a_line() -> None:
    changes: Changes = {
        "dimers": {"radii": None},
        "clusters": [{}],
        "mixture": {},
        "beads": {"material": None},
        "liquid": {"name": None},
        "boundary": {"shape": "box", "material": None},
        "drive": {"frequency": None, "peak_acceleration": None},
        "run": {"cycles": None},
    }
    assert_case_refused(
        changes,
        "dimers.radii: missing; expected ",
        "clusters[0].radii: missing; expected ",
        "clusters[0].arrangement: missing; expected ",
        "mixture.small: missing; expected ",
        "mixture.large: missing; expected ",
        "mixture.count: missing; expected ",
        "beads.density: missing; expected ",
        "boundary.material: missing; expected ",
        "boundary.width: missing; expected ",
        "boundary.height: missing; expected ",
        "drive.frequency: missing; expected ",
        "drive.peak_acceleration: missing; expected ",
        "run.duration: missing; expected ",
        "liquid.surface_tension: missing; expected ",
        "liquid.dynamic_viscosity: missing; expected ",
    )


def test_every_wrong_value_has_a_line() -> None:
    changes: Changes = {
        "drive": {"frequency": "80 mm", "axis": "w"},
        "beads": {"material": "rubi"},
        "liquid": {"name": "oil"},
        "no": 1,
        "dimers": {"radii": None},
    }
    assert_case_refused(
        changes,
        'drive.frequency = "80 mm": ',
        'drive.axis = "w": ',
        'beads.material = "rubi": ',
        'liquid.name = "oil": ',
        "no = 1: ",
        "dimers.radii: missing; ",
    )


def test_a_range_of_an_unknown_key() -> None:
    assert_case_refused(
        {"uncertain": {"contact.frictio": [0.1, 0.2]}},
        "uncertain.contact.frictio = [0.1, 0.2]: unknown key",
    )


def test_a_range_with_three_values() -> None:
    assert_case_refused(
        {"uncertain": {"contact.restitution": [0.2, 0.3, 0.8]}},
        "uncertain.contact.restitution = [0.2, 0.3, 0.8]: "
        "expected [low, high]: the case's own value is th",
    )


def test_a_number_in_place_of_a_range_and_a_range_that_descends() -> None:
    assert_case_refused(
        {"uncertain": {"contact.restitution": 0.1, "contact.rolling_friction": [0.2, 0.1]}},
        "uncertain.contact.restitution = 0.1: expected [low, high] or { loguniform = [low, high] }",
        "uncertain.contact.rolling_friction = [0.2, 0.1]: ",
    )


def test_a_library_within_a_case_with_a_material_that_is_in_no_library() -> None:
    assert_case_refused(
        {"library": {"surface_pairs": [{"materials": ["rubby", "glass"]}]}},
        'library.surface_pairs[0].materials = "rubby": not in the library; expected one of ruby, ',
    )


def material(name: str, **density: Any) -> str:
    """A library with the density of a material, 2 g/cm³."""
    value = {"value": "2 g/cm^3", "source": "x"}
    return to_toml({"materials": {name: {"density": value | density}}})


def surface_pairs(*pairs: list[str]) -> str:
    """A library with pairs of materials."""
    return to_toml({"surface_pairs": [{"materials": pair} for pair in pairs]})


@pytest.mark.parametrize(
    ("library", "message"),
    [
        pytest.param(
            '[materials.mine]\ndensity = "2 g/cm^3"',
            'density = "2 g/cm^3": expected { value = ..., source = "..." }',
            id="value without a table",
        ),
        pytest.param(
            '[materials.mine]\ndensity = { value = "2 g/cm^3" }',
            'source: missing; expected a value such as "weighed"',
            id="value without a source",
        ),
        pytest.param(
            "[material.mine]",
            'library.toml: material = {"mine": {}}: unknown key; a library takes ',
            id="unknown table",
        ),
        pytest.param(
            material("glass"),
            "materials.glass: is in the library of",
            id="material of the program",
        ),
        pytest.param(
            material("m", range=["3 g/cm^3", "4 g/cm^3"]),
            "expected two ends with the value between them",
            id="range beside the value",
        ),
        pytest.param(
            material("a\x1b[31m"),
            "materials.a\\x1b[31m: expected printable text on one line",
            id="name with control characters",
        ),
        pytest.param(
            surface_pairs(["glass", "ruby"], ["ruby", "glass"]),
            "surface_pairs[1] = ruby on glass: is given twice; expected one",
            id="pair in both orders",
        ),
        pytest.param(
            surface_pairs(["chromium-coated glass", "ruby"]),
            "[0] = chromium-coated glass on ruby: is in the library of",
            id="pair of the program",
        ),
    ],
)
def test_a_library_beside_the_case(library: str, message: str) -> None:
    Path("library.toml").write_text(library, "utf-8")
    assert_refused("show fig1b", message)


def obj(points: Iterable[Point], faces: Iterable[Face]) -> str:
    """A mesh as an OBJ file; polygons are split into triangles around their first corner."""
    lines = []
    for x, y, z in points:
        lines.append(f"v {x} {y} {z}")
    for first, *corners in faces:
        for second, third in pairwise(corners):
            lines.append(f"f {first} {second} {third}")
    return "\n".join([*lines, ""])


BOX = [
    (-2, -2, 0),
    (2, -2, 0),
    (2, 2, 0),
    (-2, 2, 0),
    (-2, -2, 4),
    (2, -2, 4),
    (2, 2, 4),
    (-2, 2, 4),
]
"""Corners of a box of 4 × 4 × 4 mm; those of its floor first."""
FLOOR = [(1, 2, 3, 4)]
SIDES = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
OPEN_BOX = FLOOR + SIDES
UPSIDE_DOWN = [(x, -y, -z) for x, y, z in BOX]
ONE_PLACE = [(0.0, 0.0, 0.0)] * 8
MOEBIUS_BAND = obj(
    [(-2, -2, 0), (2, -2, 0), (-2, -2, 4), (2, -2, 4), (0, 3, 1), (0, 3, 3)],
    [(1, 2, 4, 3), (2, 6, 5, 4), (6, 3, 1, 5)],
)
PYRAMID = obj(
    [(-2, -2, 4), (2, -2, 4), (2, 2, 4), (-2, 2, 4), (0, 0, 0)],
    [(1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 1, 5)],
)


def box_and_tetrahedron(x: float, z: float) -> str:
    """The open box, and a tetrahedron whose right-angled corner is on the axis or beside it."""
    corners = [(x, 0.0, z), (x + 1.0, 0.0, z), (x, 1.0, z), (x, 0.0, z + 1.0)]
    return obj(BOX + corners, [*OPEN_BOX, (9, 11, 10), (9, 10, 12), (10, 11, 12), (11, 9, 12)])


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        pytest.param(
            "v a b c",
            'boundary.mesh = "own.obj": cannot be read: Failed to parse 0th vertex',
            id="text in place of numbers",
        ),
        pytest.param(
            obj(BOX, []),
            'boundary.mesh = "own.obj": has 0 triangles; expected the inner surface',
            id="no triangles",
        ),
        pytest.param(obj(ONE_PLACE, OPEN_BOX), "has no triangles of any size", id="one point"),
        pytest.param(
            obj(BOX, SIDES),
            "has 2 openings, the lowest at (-2, -2, 0) mm; expected one, at its top",
            id="box without a floor",
        ),
        pytest.param(
            obj(UPSIDE_DOWN, OPEN_BOX),
            "is open at its lowest point, at (-2, 2, -4) mm; expected a closed",
            id="box upside down",
        ),
        pytest.param(MOEBIUS_BAND, "has a surface of one side alone, at (", id="Möbius band"),
        pytest.param(
            obj(BOX, [*OPEN_BOX, (1, 3, 7, 5)]),
            "has 3 triangles at an edge, at (0, 0, 0) mm; expected two",
            id="box with a partition",
        ),
        pytest.param(
            # From x = 1.5 to 2.5 mm; the side of the box is at 2 mm.
            box_and_tetrahedron(x=1.5, z=1.0),
            "has triangles that intersect, at (2, 0",
            id="tetrahedron through a side",
        ),
        pytest.param(
            box_and_tetrahedron(x=0.0, z=0.0),
            "has triangles that overlap in a plane, at (",
            id="tetrahedron on the floor",
        ),
        pytest.param(
            PYRAMID,
            "has no level floor at its bottom, on which walkers stand",
            id="pyramid on its tip",
        ),
    ],
)
def test_a_mesh_that_is_no_vessel(mesh: str, message: str) -> None:
    Path("own.obj").write_text(mesh, "utf-8")
    boundary = {"material": "glass", "mesh": "own.obj", "scale": "1 mm"}
    assert_case_refused({"boundary": boundary}, message)


@pytest.mark.parametrize(
    ("boundary", "message"),
    [
        pytest.param(
            {"scale": None},
            'boundary.scale: missing; expected a value such as "1 mm"',
            id="no scale",
        ),
        pytest.param({"shape": "box"}, "expected none beside boundary.mesh", id="shape"),
        pytest.param(
            {"height": "3 mm"},
            'boundary.height = "3 mm": expected none for a vessel',
            id="height",
        ),
        pytest.param(
            # The box is 4 units wide, and the larger bead of the dimer 0.6 mm.
            {"scale": "1 m"},
            'boundary.scale = "1 m": the vessel is 4 m wide and the beads 0.6 mm; '
            "expected 1 to 1000 beads across",
            id="scale of a building",
        ),
    ],
)
def test_keys_that_do_not_go_with_a_sound_mesh(boundary: dict[str, Any], message: str) -> None:
    Path("own.obj").write_text(obj(BOX, OPEN_BOX), "utf-8")
    vessel = {"material": "glass", "mesh": "own.obj", "scale": "1 mm", **boundary}
    assert_case_refused({"boundary": vessel}, message)


def test_a_mesh_that_is_not_there() -> None:
    vessel = {"material": "glass", "mesh": "own.obj", "scale": "1 mm"}
    message = 'boundary.mesh = "own.obj": no such file; expected a mesh'
    assert_case_refused({"boundary": vessel}, message)


def test_a_bead_in_the_wall_of_a_mesh() -> None:
    """Its centre is 0.2 mm from the side of the box at 2 mm, and its radius is 0.3 mm."""
    Path("own.obj").write_text(obj(BOX, OPEN_BOX), "utf-8")
    changes: Changes = {
        "boundary": {"material": "glass", "mesh": "own.obj", "scale": "1 mm"},
        "dimers": None,
        "placed": [bead("0.3 mm", "1.8 mm")],
        "run": {"cycles": 10},
    }
    assert_case_refused(changes, "placed[0].at = ")


def plane(*normal: float, at: tuple[str, str, str] = ("0 mm", "0 mm", "0 mm")) -> dict[str, Any]:
    """A plane of a vessel; its normal points inwards."""
    return {"point": list(at), "normal": list(normal)}


CUP_SIDES = [
    plane(-1, 0, 0, at=("2 mm", "0 mm", "0 mm")),
    plane(1, 0, 0, at=("-2 mm", "0 mm", "0 mm")),
    plane(0, -1, 0, at=("0 mm", "2 mm", "0 mm")),
    plane(0, 1, 0, at=("0 mm", "-2 mm", "0 mm")),
]
CUP = [plane(0, 0, 1), *CUP_SIDES]
"""A floor at z = 0 and four sides, 4 mm apart."""


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        pytest.param(
            [plane(0, 0, 1, at=("0 mm", "0 mm", "1 mm")), *CUP_SIDES],
            "have their lowest point at z = 1 mm; expected 0 mm",
            id="floor at 1 mm",
        ),
        pytest.param(CUP_SIDES, ": are open toward -z", id="no floor"),
        pytest.param([*CUP, plane(0, 0, -1)], ": enclose nothing", id="lid on the floor"),
        pytest.param(
            [*CUP, plane(0, 0, 0)],
            "planes[5].normal = [0, 0, 0]: expected a",
            id="normal of no length",
        ),
        pytest.param(
            # atan(1/2) = 26.6°
            [*CUP, plane(0, 1, 2)],
            "boundary.planes[5].normal = [0, 1, 2]: "
            "turns by 26.6 deg from planes[0]; expected 45 deg or more",
            id="two planes nearly parallel",
        ),
        pytest.param(
            [*CUP, plane(-1, 1, 0, at=("9 mm", "0 mm", "0 mm"))],
            ": is behind the",
            id="plane outside of the others",
        ),
    ],
)
def test_planes_that_are_no_vessel(planes: list[dict[str, Any]], message: str) -> None:
    boundary = {"material": "glass", "planes": planes, "height": "5 mm"}
    assert_case_refused({"boundary": boundary}, message)


def test_planes_without_a_height() -> None:
    boundary = {"material": "glass", "planes": CUP}
    assert_case_refused({"boundary": boundary}, "boundary.height: missing")


LAW = """
import dataclasses, sys
import numpy as np
from walkers.physics.bridge import Curve, Forces

def forces(gaps, pull=4e-5):
    ones = np.ones_like(gaps)
    return Forces(pull * ones, 3e-3 * ones, 1e-3 * ones, 0.0 * ones, 0.0 * ones)

def changed(**forces_of):
    def changed_forces(gaps):
        changes = {name: force_of(gaps) for name, force_of in forces_of.items()}
        return dataclasses.replace(forces(gaps), **changes)
    return changed_forces
"""
"""The start of a file with a bridge law: a capillary force of 40 µN at any gap."""


@pytest.mark.parametrize(
    ("law", "message"),
    [
        pytest.param(
            "def law(surfaces): raise KeyError('x')", "raises KeyError: 'x'", id="law that raises"
        ),
        pytest.param("law = 3", "has no function law", id="number"),
        pytest.param(
            "def law(surfaces): return Curve(forces, -1.0)",
            "breaks at a gap of -1 m; expected a positive number",
            id="negative rupture gap",
        ),
        pytest.param(
            "def law(surfaces): return Curve(forces, 1e-4, 2e-4)",
            "forms at a gap of 0.0002 m; expected 0 to its rupture",
            id="bridges that form beyond their rupture",
        ),
        pytest.param(
            "def law(surfaces): return Curve(lambda gaps: gaps, 1e-4)",
            "forces are ndarray; expected",
            id="array in place of forces",
        ),
        pytest.param(
            "def law(surfaces): return Curve(lambda gaps: forces(gaps, np.nan), 1e-4)",
            "the pull is not a number",
            id="pull that is not a number",
        ),
    ],
)
def test_a_bridge_law_of_ones_own(law: str, message: str) -> None:
    """The first line warns that the file of the law is executed."""
    Path("own.py").write_text(f"{LAW}\n{law}\n", "utf-8")
    assert_refused("show fig1b --set liquid.law=own.py:law", "executes ", message)


def record(
    header: str = "time (ms), x (g)",
    *,
    rows: int = 100,
    step: float = 0.5,
    changed_rows: Mapping[int, str] | None = None,
    missing_rows: Iterable[int] = (),
) -> str:
    """A record of 4 g at 80 Hz.

    Parameters
    ----------
    header
        The first line.
    rows
        Number of rows before any are left out.
    step
        Time from row to row, ms.
    changed_rows
        Rows that stand in place of others, by number from 1.
    missing_rows
        Numbers of the rows that are left out.
    """
    lines = [header]
    for row in range(rows):
        time = step * row
        lines.append(f"{time!r}, {4.0 * sin(2.0 * pi * 0.080 * time)!r}")
    for number, line in (changed_rows or {}).items():
        lines[number] = line
    for number in sorted(missing_rows, reverse=True):
        del lines[number]
    return "\n".join(lines)


def with_semicolons(text: str) -> str:
    return text.replace(", ", "; ")


def assert_record_refused(
    text: str | bytes, message: str, drive: dict[str, Any] | None = None
) -> None:
    """Check what the program says of a case that is shaken by a record."""
    contents = text.encode() if isinstance(text, str) else text
    Path("record.csv").write_bytes(contents)
    recorded = {"frequency": None, "peak_acceleration": None, "record": "record.csv"}
    assert_case_refused({"drive": recorded | (drive or {})}, message)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        pytest.param(
            "time, x (g)",
            'drive.record = "record.csv": column "time": expected a time with its unit',
            id="time without a unit",
        ),
        pytest.param(
            "time (ms), ax",
            'column "ax": expected an acceleration with its unit, such as "4 g", in brackets',
            id="acceleration without a unit",
        ),
        pytest.param(
            "time (ms), x (mm)",
            'record = "record.csv": column "x (mm)": expected an acceleration with its unit',
            id="displacement",
        ),
        pytest.param(
            "time (ms), acceleration (g)",
            '"time (ms), acceleration (g)" names no acceleration along x, y or z',
            id="acceleration without an axis",
        ),
        pytest.param("count, x (g)", '"count, x (g)" names no time', id="no time"),
        pytest.param(
            "LabVIEW Measurement",
            'found "LabVIEW Measurement": replace all lines above the numbers by a header',
            id="header of a program",
        ),
        pytest.param(
            "time (ms), x (g), acc_x (g)",
            'columns "x (g)" and "acc_x (g)" are both the acceleration along x',
            id="two accelerations along an axis",
        ),
        pytest.param(
            "time (ms), t (ms), x (g)",
            'columns "time (ms)" and "t (ms)" are both the time; expected one',
            id="two times",
        ),
    ],
)
def test_the_header_of_a_record(header: str, message: str) -> None:
    assert_record_refused(record(header), message)


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        pytest.param(
            b"",
            "is empty; expected a header that names the time and accelerations along x, y or z",
            id="empty",
        ),
        pytest.param(
            b"\xff\xfe",
            "expected UTF-8 text, found byte 0xff in line 1: save the file as UTF-8",
            id="bytes of no text",
        ),
        pytest.param(
            "time (s), x (m/s²)\n0, 1\n".encode("latin-1"),
            "found byte 0xb2 in line 1: save the file as UTF-8",
            id="Latin-1",
        ),
        pytest.param(
            record().encode("utf-16-le"),
            "found zero bytes: save the file as UTF-8",
            id="UTF-16",
        ),
    ],
)
def test_a_record_that_is_not_utf_8(contents: bytes, message: str) -> None:
    assert_record_refused(contents, message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(
            record(changed_rows={7: "3.0, 1.0, 2.0"}),
            "row 7 has 3 values, the header 2 names: decimal commas? Then separate the",
            id="a value too many",
        ),
        pytest.param(
            record(changed_rows={1: "0,0,0,02"}),
            "row 1 has 4 values, the header 2 names: decimal commas? Then separate the columns",
            id="decimal commas between commas",
        ),
        pytest.param(
            with_semicolons(record(changed_rows={7: "3, 1, 2"})),
            "row 7 has 3 values, the header 2 names; exp",
            id="a value too many between semicolons",
        ),
        pytest.param(
            with_semicolons(record(changed_rows={7: "3, 1,5"})),
            'a comma, "1,5", and with a point, "0.0"; exp',
            id="decimal commas and points",
        ),
        pytest.param(
            record(changed_rows={7: "3.0"}),
            'row 7: column "x (g)" is ""; expected a number',
            id="a value too few",
        ),
        pytest.param(
            record(changed_rows={7: "3.0, nan"}),
            'row 7: column "x (g)" is "nan"; expected a number',
            id="not a number",
        ),
        pytest.param(
            # Python reads it as 10.
            record(changed_rows={7: "3.0, 1_0"}),
            'row 7: column "x (g)" is "1_0"; expected a number',
            id="number of Python alone",
        ),
        pytest.param(
            record(changed_rows={7: "3.0, 1e5"}),
            "row 7: expected a number in each column, accelerations up to 10000 m/s²",
            id="acceleration of 100000 g",
        ),
    ],
)
def test_a_row_of_a_record(text: str, message: str) -> None:
    assert_record_refused(text, message)


def repeated_times() -> str:
    """A record whose clock counts whole milliseconds; five rows have the same time."""
    lines = ["time (ms), x (g)"]
    for row in range(1000):
        lines.append(f"{row // 5}, {4.0 * sin(0.1 * row)!r}")
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(
            # As row 6.
            record(changed_rows={7: "2.5, 1.0"}),
            "row 7 is 0 ms after the one before; expected times that increase without gaps",
            id="row at the time of the one before",
        ),
        pytest.param(
            record(rows=200, missing_rows=[51, 52, 53]),
            "row 51 is 2 ms after the one before; "
            "expected times that increase without gaps, about 0.5 ms apart",
            id="gap of three rows",
        ),
        pytest.param(
            record(rows=200, missing_rows=[6, 60, 90]),
            "row 6 is 1 ms after the one before; "
            "expected times that increase without gaps, about 0.5 ms apart",
            id="three gaps of a row",
        ),
        pytest.param(
            # Row 6 is at 2.5 ms.
            record(changed_rows={7: "-3.0, 1.0"}),
            "row 7 is -5.5 ms after the one before; expected times that increase without gaps",
            id="row before the others",
        ),
        pytest.param(
            record(step=-0.5),
            "times decrease from row to row; expected the first measurement in the first row",
            id="last measurement first",
        ),
        pytest.param(
            repeated_times(),
            "times repeat: rows 1 and 2 are both at 0 ms; expected times with more digits",
            id="clock of too few digits",
        ),
    ],
)
def test_times_of_a_record(text: str, message: str) -> None:
    assert_record_refused(text, message)


def constant_acceleration() -> str:
    """A record of 1 g that never changes."""
    lines = ["time (ms), x (g)"]
    for row in range(1000):
        lines.append(f"{0.2 * row!r}, 1.0")
    return "\n".join(lines)


def tiny_acceleration() -> str:
    """A record whose peak acceleration of 4e-310 g is below the smallest normal float."""
    lines = ["time (ms), x (g)"]
    for row in range(1000):
        lines.append(f"{0.5 * row!r}, {4e-310 * sin(0.25 * row)!r}")
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(
            constant_acceleration(),
            "the acceleration is constant, as from a dead sensor; expected one that changes",
            id="constant acceleration",
        ),
        pytest.param(
            tiny_acceleration(),
            "expected an acceleration of 1e-09 m/s² or more, found 3.9e-309 m/s²",
            id="acceleration near the smallest float",
        ),
        pytest.param(record(rows=9), "has 9 rows; expected 16 to 100000", id="9 rows"),
        pytest.param(
            # A period of 80 Hz is 12.5 ms.
            record(rows=40, step=4.0),
            "rows are too far apart, or too noisy: leaving out every second one changes the ac",
            id="three rows a period",
        ),
        pytest.param(
            # 20 rows last 9.5 ms, less than a period of 12.5 ms, which rounds to 1.
            record(rows=20),
            "expected at least 3 periods of its strongest line, found 1: the offset of the sensor",
            id="one period",
        ),
        pytest.param(
            # 99 × 0.5 ms are 3.96 periods of 12.5 ms.
            record(),
            "run.cycles = 24: expected at most 3 cycles: drive.record has no more",
            id="shorter than the run",
        ),
        pytest.param(
            record(rows=14_000, step=3e-3),
            "its rows, 3 us apart, are closer than the time step, 3.9",
            id="rows closer than time steps",
        ),
    ],
)
def test_a_record_that_cannot_shake_the_run(text: str, message: str) -> None:
    assert_record_refused(text, message)


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        pytest.param(
            {"ramp": [["0 s", 0], ["0.01 s", 0]]},
            'drive.ramp = [["0 s", 0], ["0.01 s", 0]]: expected a factor abo',
            id="ramp of zeros",
        ),
        pytest.param(
            # The record ends within a period.
            {"repeats": True},
            "repeats = true: expected a record that ends with the first row of the next period",
            id="repetition with a jump",
        ),
        pytest.param(
            {"frequency": "80 Hz"},
            'drive.record = "record.csv": expected either frequency or record, not both',
            id="frequency",
        ),
        pytest.param(
            {"harmonics": [HARMONIC]},
            'drive.record = "record.csv": expected none beside drive.harmonics',
            id="harmonics",
        ),
        pytest.param(
            {"record": "none.csv"},
            'drive.record = "none.csv": cannot be read: No such file or directory',
            id="file that is not there",
        ),
    ],
)
def test_keys_of_a_drive_that_do_not_go_with_its_record(
    drive: dict[str, Any], message: str
) -> None:
    assert_record_refused(record(), message, drive)


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        pytest.param(b"[dimers\nradii = 3", "bad.toml: not TOML: ", id="open bracket"),
        pytest.param(
            b'[dimers]\nradii = ["0.3 mm", \xff]', "bad.toml: expected UTF-8 text", id="no UTF-8"
        ),
        # The parser of Python's library recurses once for each bracket.
        pytest.param(b"a = " + b"[" * 5000, "bad.toml: not TOML: ", id="5000 brackets"),
    ],
)
def test_a_file_that_is_not_toml(contents: bytes, message: str) -> None:
    Path("bad.toml").write_bytes(contents)
    assert_refused("show bad.toml", message)


LONG = "x" * 100_000
"""A text that no message repeats in full."""


@pytest.mark.parametrize(
    ("command", "message"),
    [
        pytest.param(
            f"show fig1b --set drive.frequency={LONG}",
            'fig1b: drive.frequency = "xxx',
            id="value",
        ),
        pytest.param(f"show fig1b --set {LONG}=3", "fig1b: xxx", id="key"),
        pytest.param(f"show {LONG}", "cannot be read", id="name of a case"),
    ],
)
def test_a_long_text_is_cut_in_the_message(command: str, message: str) -> None:
    assert_refused(command, message)


def test_a_long_key_of_a_sweep_is_cut_in_the_message() -> None:
    Path("s.toml").write_text(f'case = "fig1b"\n[axes]\n"{LONG}" = [1]\n', "utf-8")
    assert_refused("sweep s.toml", "s.toml: xxx")


def test_control_characters_of_a_file_are_not_printed() -> None:
    Path("s.toml").write_text('case = "one\\ntwo\\u001b[31m"\n', "utf-8")
    assert_refused("sweep s.toml", "one two")


def test_control_characters_of_an_argument_are_not_printed() -> None:
    assert_refused("show 'xxx\n\x1b[31m'", "xxx")


@pytest.fixture
def sweep_directory(looked_through: Path) -> Path:
    """The directory of a finished sweep."""
    return looked_through / "grid"


@pytest.fixture
def finished_run(run_directory: Callable[..., Path]) -> Path:
    """A run of two walkers for 8 cycles of 80 Hz, 0.1 s."""
    run = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20}
    return run_directory(dimers={"replicates": 2}, run=run)


@pytest.fixture
def base_case() -> None:
    """A sound case, ``base.toml``."""
    Path("base.toml").write_text(to_toml(document()), "utf-8")


def write_sweep(file: str, frequencies: list[str]) -> None:
    """Write a sweep of the shipped case over frequencies."""
    axes = {"drive": {"frequency": frequencies}}
    Path(file).write_text(to_toml({"case": "fig1b", "axes": axes}), "utf-8")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("run fig2", "fig2: is a sweep: walkers sweep fig2"),
        ("show --theory ruby", "ruby: is a calibration: walkers calibrate ruby"),
        ("check files .", "expected a run directory"),
        ("plot .", "not a finished run"),
    ],
)
def test_a_name_of_another_kind(command: str, message: str) -> None:
    assert_refused(command, message)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("export --format deck {sweep}", "is a sweep's directory: walkers list"),
        ("render {sweep}", "is a sweep: expected one of its runs"),
        ("climb {sweep}", "expected a finished run of a pile"),
        ("export {sweep} --format archive --every 2", "--every: is for --format vtk, lammps"),
    ],
)
def test_the_directory_of_a_sweep_in_place_of_a_run(
    command: str, message: str, sweep_directory: Path
) -> None:
    assert_refused(command.format(sweep=sweep_directory), message, folders=[sweep_directory])


def test_a_run_is_not_compared_with_a_sweep(sweep_directory: Path, finished_run: Path) -> None:
    assert_refused(
        f"compare {sweep_directory} {finished_run}",
        "is a sweep's directory: walkers list",
        folders=[sweep_directory, finished_run],
    )


def test_a_run_in_place_of_a_folder_of_runs(finished_run: Path) -> None:
    assert_refused(f"list {finished_run}", "is a run: walkers run ", folders=[finished_run])


@pytest.mark.parametrize("command", ["plot {archive}", "run {archive}", "compare {archive} fig1b"])
def test_an_archive_in_place_of_a_run(command: str, archive: Path) -> None:
    assert_refused(command.format(archive=archive), "an archive: unpack it")


@pytest.mark.parametrize(
    "command",
    ["plot", "render --film", "report", "export --format lammps", "export --format archive"],
)
def test_what_needs_a_finished_run_names_the_command_that_makes_it(command: str) -> None:
    assert_refused(f"{command} fig1b", "no finished run in runs; first do: walkers run fig1b")


def test_a_folder_with_a_damaged_manifest() -> None:
    Path("folder.html").mkdir()
    Path("folder.html", "manifest.json").write_text("{", "utf-8")
    assert_refused("plot folder.html", "manifest.json cannot be read")


def test_a_folder_without_a_run_beside_a_case(base_case: None) -> None:
    Path("plain").mkdir()
    assert_refused("run base.toml plain", "plain: is a folder without a run")


def test_a_name_of_nothing_to_clean(looked_through: Path) -> None:
    assert_refused(
        f"clean nonsense --yes --out {looked_through}",
        "nonsense: no such file, run or sweep",
        folders=[looked_through],
    )


def test_a_sweep_that_is_not_there() -> None:
    assert_refused("sweep nosuch", "nosuch: no such file, nor a shipped sweep (alignment, ")


def test_a_sweep_with_an_impossible_point() -> None:
    write_sweep("bad_sweep.toml", ["60 Hz", "0 Hz"])
    assert_refused(
        "sweep bad_sweep.toml",
        "bad_sweep.toml: point 1 (drive.frequency = 0 Hz): "
        'drive.frequency = "0 Hz": expected a frequency',
    )


def test_a_sweep_on_a_site_that_is_not_there() -> None:
    write_sweep("mine.toml", ["60 Hz"])
    assert_refused(
        "sweep mine.toml --site nosite.toml", "nosite.toml: cannot be read: No such file"
    )


def test_a_file_in_place_of_the_folder_of_a_sweep(base_case: None) -> None:
    write_sweep("mine.toml", ["60 Hz"])
    assert_refused("sweep mine.toml --out base.toml", '"base.toml" is a file')


def test_a_key_that_varies_in_a_sweep_cannot_be_set() -> None:
    assert_refused(
        "sweep fig4 --set 'liquid.name=Si AK5'",
        'liquid.name = "Si AK5": varies in this sweep and cannot be set',
    )


@pytest.mark.parametrize("command", ["show", "run", "plot", "check"])
def test_every_command_refuses_a_length_in_place_of_a_frequency(command: str) -> None:
    assert_refused(
        f"{command} fig1b --set 'drive.frequency=70 mm'",
        'fig1b: drive.frequency = "70 mm": expected a frequency',
    )


@pytest.mark.parametrize("command", ["show", "run", "run --spread"])
def test_every_command_refuses_bridges_that_push_at_rest(command: str) -> None:
    assert_refused(
        f"{command} fig1b --set liquid.volume_fraction=0.02 --set 'liquid.contact_angle=88 deg'",
        'fig1b: liquid.contact_angle = "88 deg": expected',
    )


@pytest.mark.parametrize(
    ("command", "message"),
    [
        pytest.param(
            "show fig1b --set run.seed=1 --set run.seed=2",
            "run.seed = 2: is given twice",
            id="key given twice",
        ),
        pytest.param(
            "show climber --set 'clusters.angle=45 deg'",
            "clusters is a list: say which one, such as clusters[0]",
            id="key of a list",
        ),
        pytest.param(
            "show fig1b --set 'run.seed=3\nfoo=4'",
            'fig1b: run.seed = "3\\nfoo=4": expected a whole number',
            id="value of two lines",
        ),
    ],
)
def test_a_value_that_is_set_by_an_option(command: str, message: str) -> None:
    assert_refused(command, message)


def test_every_unknown_key_that_is_set_has_a_line() -> None:
    assert_refused(
        "show fig1b --set drive.freq=2 --set beads.mat=3",
        '"frequency" or "frame"?',
        "fig1b: beads.mat: unknown key",
    )


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("no-such-law", "expected one of rabinovich, soulie, willett, young-laplace"),
        ("no/such.py:law", "such.py cannot be read: No such file"),
        ("own.py:law\\nrange", "expected one of"),
        ("os:system", "expected one of"),
    ],
)
def test_a_name_of_a_bridge_law(law: str, message: str) -> None:
    assert_refused(f"show fig1b --set 'liquid.law=\"{law}\"'", message)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (
            "show fig1b --set beads.material=steel",
            'did you mean "chrome steel" or "stainless steel"?',
        ),
        (
            "show fig1b --set liquid.name=Glycerol",
            'did you mean "glycerol" or "glycerol 87 %" or "water-glycerol"?',
        ),
        (
            "show fig1b --set 'liquid.name=glycerol 99 %'",
            'did you mean "glycerol" or "glycerol 87 %"?',
        ),
        (
            "library steel",
            'steel: not in the library; did you mean "chrome steel" or "stainless steel"?',
        ),
    ],
)
def test_names_of_the_library_that_are_similar_are_proposed(command: str, message: str) -> None:
    assert_refused(command, message)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("run", "CASE"),
        (
            "export fig1b",
            "--format requires an argument. Choose from: deck, vtk, lammps, csv, archive. "
            "See: walkers export --help",
        ),
        ("check fig1b --without magic", "--without magic: expected one of"),
        ("--libary", 'Unknown command "--libary"'),
        ("new ''", ".: expected a name"),
        ("new ..", "..: expected a name"),
    ],
)
def test_an_argument(command: str, message: str) -> None:
    assert_refused(command, message)


def test_a_new_case_does_not_overwrite_a_file(base_case: None) -> None:
    assert_refused("new base.toml", "exists already")


@pytest.mark.parametrize("command", ["run fig1b", "check engine", "sweep mine.toml"])
def test_every_command_that_starts_engines_refuses_one_that_is_not_there(command: str) -> None:
    write_sweep("mine.toml", ["60 Hz"])
    assert_refused(
        f"{command} --engine /nowhere",
        "--engine /nowhere: expected the name or path of a liggghts binary",
    )


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("plot {sweep} --y velocitty", 'did you mean "velocity"?'),
        (
            "plot {sweep} --to figure.jpg",
            "figure.jpg: expected the name of a .png or .svg or .pdf file",
        ),
    ],
)
def test_a_plot_of_a_sweep(command: str, message: str, sweep_directory: Path) -> None:
    assert_refused(command.format(sweep=sweep_directory), message, folders=[sweep_directory])


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("report {run} --to a.txt", "expected the name of a .html or .htm file"),
        ("plot {run} --to out.png", "out.png: expected a folder"),
        ("render {run} --fps 10", "--fps: is for --film"),
    ],
)
def test_a_picture_or_report_of_a_run(command: str, message: str, finished_run: Path) -> None:
    assert_refused(command.format(run=finished_run), message, folders=[finished_run])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--format vtk --licence MIT", "--licence: is for --format archive"),
        ("--format vtk --every 0", "--every: 0: expected 1 or more"),
        ("--format archive -o run.tar", "--to: expected the name of a .zip file"),
        ("--format archive --licence ' '", "--licence: expected a licence such as CC-BY-4.0"),
        ("--format archive --author N --author ''", "--author: expected names that are not empty"),
    ],
)
def test_options_of_an_export(options: str, message: str, finished_run: Path) -> None:
    assert_refused(f"export {finished_run} {options}", message, folders=[finished_run])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--to walk.avi", "expected the name of a .mp4 or .gif file"),
        # Delays of a GIF are whole hundredths of a second.
        ("--to walk.gif --fps 30", "expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF"),
        ("--size 333x201", "expected even numbers for an MP4"),
        ("--walker 2", "walker: 2: expected 0 to 1"),
        ("--begin '0.2 s'", "expected times within the drive, 0 to 0.1 s"),
        ("--size wide", "--size: 'wide': expected 360p, 480p, 720p, 1080p"),
    ],
)
def test_options_of_a_film(options: str, message: str, finished_run: Path) -> None:
    assert_refused(f"render --film {finished_run} {options}", message, folders=[finished_run])


def test_a_list_of_tables_cannot_be_set_whole() -> None:
    problem = (
        "boundary.planes: is a list of tables, which only a case file has: [[boundary.planes]]"
    )
    assert_refused("show fig1b --set boundary.planes=[]", problem)


def test_a_vessel_without_planes_says_only_how_to_give_them() -> None:
    """Its height is not wrong: a vessel of planes has one."""
    boundary = {"shape": "vessel", "height": "5 mm", "planes": []}
    Path("mine.toml").write_text(to_toml(document(boundary=boundary)))
    problem = "boundary.planes = []: missing; expected at least one table [[boundary.planes]]"
    assert_refused("show mine.toml", f"mine.toml: {problem}")


def test_an_entry_of_a_list_that_the_case_lacks_says_what_the_case_has() -> None:
    problem = "the base case has no dimers.diameters but dimers.radii; expected the whole list"
    example = "such as dimers.diameters=[0.6 mm, 0.4 mm]"
    assert_refused('show fig1b --set "dimers.diameters[0]=1 mm"', f"{problem}, {example}")


@pytest.mark.parametrize(
    ("command", "suggested"),
    [
        pytest.param("show mien.toml", "mine", id="a file"),
        pytest.param("show mien", "mine", id="a file without its ending"),
        pytest.param("sweep figg2.toml", "fig2", id="a shipped sweep"),
        pytest.param("list speeed", "speed", id="a sweep in the folder"),
    ],
)
def test_a_misspelt_name_is_answered_by_the_name_that_is_there(
    command: str, suggested: str
) -> None:
    Path("mine.toml").write_text(to_toml(document()))
    Path("runs/speed").mkdir(parents=True)
    Path("runs/speed/sweep.json").write_text("{}")
    assert_refused(command, f'did you mean "{suggested}"?')
