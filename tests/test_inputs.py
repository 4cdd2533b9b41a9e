"""Cases: quantities, values that a file leaves out and their sources, changes, the library, the schema for editors."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import REFERENCE, call, document, make_case, origins, to_toml
from walkers.errors import InputError
from walkers.inputs import units
from walkers.inputs.case_building import build_case, changed_case, stored_case
from walkers.inputs.config_table import changed
from walkers.inputs.origins import Origin
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.library import library_of, unmeasured
from walkers.inputs.resolving.loads import gravity_warnings
from walkers.inputs.sweep import expand
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.units import parse_quantity, quantity_text
from walkers.physics.mixtures import water_glycerol
from walkers.postprocess.measure.uncertainty import uncertain_value_lines, uncertain_values
from walkers.runs.preview import preview_text, summarise
from walkers.sweeps.spread import spread_sweep

QUANTITIES = {
    units.LENGTH: {"0.3 mm": 3e-4, "300 µm": 3e-4, "300um": 3e-4, "3e-4 m": 3e-4},
    units.FREQUENCY: {"80 Hz": 80.0, "0.08 kHz": 80.0, "80 s^-1": 80.0},
    # "1 g = 9.8 m/s²", the paper's Fig. 1
    units.ACCELERATION: {
        "1 g": 9.8,
        "4g": 39.2,
        "39.2 m/s^2": 39.2,
        "39.2 m/s²": 39.2,
        "1 gravity": 9.80665,
    },
    units.SURFACE_TENSION: {"19.2 mN/m": 0.0192, "19.2 dyn/cm": 0.0192},
    units.KINEMATIC_VISCOSITY: {"5 mm^2/s": 5e-6, "5 cSt": 5e-6},
    units.DYNAMIC_VISCOSITY: {"4.6 mPa*s": 4.6e-3, "4.6 cP": 4.6e-3},
    units.DENSITY: {"4.0 g/cm^3": 4000.0, "1 g/cm^3": 1e3},
    units.MODULUS: {"50 MPa": 5e7},
    units.TIME: {"2 us": 2e-6},
    units.ANGLE: {"180 deg": 3.14159265358979, "10 mrad": 0.01},
    units.TEMPERATURE: {"20 °C": 293.15, "293.15 K": 293.15},
}
NO_QUANTITIES = {
    units.ACCELERATION: ["4 kg", "4 mg", "4 g/s"],
    units.DENSITY: ["4 g"],
    units.FREQUENCY: ["500 rad/s", "4800 rpm"],
    units.ANGLE: ["0.5", "30 percent"],
    units.LENGTH: ["4 g", "0,3 mm", "0.3 mm 0.2 mm", "__import__('os')", "nan mm", ""],
}


def test_quantities_are_read_in_si_and_nothing_else_is() -> None:
    for kind, texts in QUANTITIES.items():
        assert {text: parse_quantity(text, kind) for text in texts} == pytest.approx(
            texts, rel=1e-14
        )
    for kind, wrong in NO_QUANTITIES.items():
        for text in wrong:
            with pytest.raises(ValueError, match=f"expected an? {kind.name} with its unit"):
                parse_quantity(text, kind)
    assert quantity_text(293.15, units.TEMPERATURE) == "20 degC"
    assert quantity_text(39.2, units.ACCELERATION) == "4 g"


@pytest.mark.parametrize(
    ("text", "kind", "bounds"),
    [
        ("150 degC", units.TEMPERATURE, "0 and 100 degC"),
        ("-10 °C", units.TEMPERATURE, "0 and 100 °C"),
        ("3 K", units.TEMPERATURE, "273.1 and 373.1 K"),
        ("1 um", replace(units.LENGTH, smallest=2e-6, largest=0.04), "2 and 40000 um"),
        ("5 cm", replace(units.LENGTH, smallest=2e-6, largest=0.04), "0.0002 and 4 cm"),
        ("2000 g", units.ACCELERATION, "1.02e-10 and 1020 g"),
        ("1e30 inch", units.LENGTH, "3.937e-08 and 39.37 inch"),
    ],
)
def test_bounds_of_a_quantity_are_told_in_its_unit(
    text: str, kind: units.QuantityKind, bounds: str
) -> None:
    with pytest.raises(ValueError, match=f"it must lie between {re.escape(bounds)}$"):
        parse_quantity(text, kind)


# Glass beads on polystyrene in glycol, materials that the paper names: nobody has measured how they touch.
GLASS = {
    "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
    "beads": {"material": "glass"},
    "liquid": {"name": "ethylene glycol"},
    "boundary": {"material": "polystyrene"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "10 g"},
    "contact": {
        "friction": {"bead_bead": 0.3, "bead_wall": 0.3},
        "rolling_friction": 0.0,
        "youngs_modulus": "10 MPa",
    },
    "uncertain": {"contact": {"friction": {"bead_wall": {"loguniform": [0.1, 0.6]}}}},
}


def test_values_know_where_they_come_from() -> None:
    found = origins(load_case("fig1b"))
    assert (found["drive.frequency"].origin, found["drive.frequency"].text) == ("given", "80 Hz")
    source = library_of({}).numbers("materials", "ruby")["density"].source
    assert found["beads.density"] == Origin("beads.density", "4.0 g/cm^3", "library", source)
    friction, restitution = found["contact.friction.bead_wall"], found["contact.restitution"]
    assert (friction.origin, restitution.origin) == ("calibrated", "assumed")
    assert friction.range is not None
    assert friction.range[0] < float(friction.text) < friction.range[1]
    assert found["dimers.replicates"] == Origin("dimers.replicates", "6", "default")
    assert (
        found["liquid.dynamic_viscosity"].text == "4.6 mPa*s"
    )  # 5 mm²/s times 0.92 g/cm³, not that of the bridges
    assert found["run.time_step"].source.startswith("auto: 0.4 of the rayleigh limit, ")
    assert not any(one.guessed for one in found.values())
    # What was calibrated with other liquids, or another law, is a guess.
    assert (
        origins(load_case("fig1b", {"liquid.name": "Si AK10"}))["liquid.meniscus_radius"].origin
        == "calibrated"
    )
    menisci = origins(load_case("fig1b", {"liquid.name": "glycerol 87 %"}))[
        "liquid.meniscus_radius"
    ]
    assert (menisci.origin, menisci.text, menisci.guessed) == ("default", "70 um", True)
    assert menisci.range == unmeasured()["liquid.meniscus_radius"].range
    assert origins(load_case("fig1b", {"liquid.law": "willett"}))[
        "contact.rolling_friction"
    ].guessed
    # What a case gives is guessed if it is called uncertain.
    guessed = {key: one.text for key, one in origins(build_case(GLASS)).items() if one.guessed}
    unknown = {
        "contact.restitution": "0.3",
        "liquid.volume_fraction": "0.01",
        "liquid.contact_angle": "0 deg",
    }
    assert guessed == {**unknown, "contact.friction.bead_wall": "0.3"}


def test_what_is_called_uncertain_keeps_where_it_comes_from(tmp_path: Path) -> None:
    ranges = {
        "liquid.surface_tension": ["15 mN/m", "25 mN/m"],
        "contact.friction.bead_wall": [0.1, 0.4],
    }
    ranges["dimers.radii[1]"] = ["0.19 mm", "0.2 mm"]  # an end may be the value of the case
    (file := tmp_path / "ranges.toml").write_text(
        to_toml({**load_case("fig1b").document, "uncertain": ranges})
    )
    found = origins(case := load_case(file))
    tension, friction, radius = (found[key] for key in ranges)
    assert (tension.origin, tension.text, tension.range) == (
        "library",
        "19.2 mN/m",
        ("15 mN/m", "25 mN/m"),
    )
    assert (friction.origin, friction.guessed, friction.range) == ("calibrated", True, (0.1, 0.4))
    assert (radius.text, radius.guessed) == ("0.2 mm", True)
    assert ", uncertain, range 0.1 to 0.4" in call("show", str(file), check=True).stdout
    assert "uncertain  surface_tension 19.2 mN/m" in "\n".join(
        uncertain_value_lines(uncertain_values(case.origins))
    )
    assert {*ranges} < set(spread_sweep(case, 2).keys)
    # Points of sweeps may leave the range; the case itself may not.
    tables = {**GLASS, "uncertain": {"contact.friction.bead_wall": [0.4, 0.6]}}
    assert build_case(tables).contact.friction.bead_wall == 0.3
    assert load_case(tables, {"contact.friction.bead_wall": 0.4}).contact.friction.bead_wall == 0.4


def test_names_and_what_no_law_asks_for_do_not_determine_a_run() -> None:
    case = make_case(liquid={"dynamic_viscosity": "4.6 mPa*s"})
    tables = document(
        title="other",
        beads={"material": "rubies", "density": "4.0 g/cm^3"},
        boundary={"material": "chromium"},
        liquid={"surface_tension": "19.2 mN/m", "dynamic_viscosity": "4.6 mPa*s"},
        run={"settled_below": "1 mm/s"},
    )
    del tables["liquid"]["name"]
    named = build_case(tables)
    assert named != case
    assert named.determinants() == case.determinants()
    assert make_case(run={"seed": 2}).determinants() != make_case().determinants()


def test_a_case_is_changed_as_its_file_would_be() -> None:
    """All values follow, with their origins; the case itself stays as it was."""
    case = load_case("fig1b", {"run.cycles": 2, "run.settling_cycles": 0, "dimers.replicates": 1})
    faster = changed_case(
        case,
        {"drive.frequency": "120 Hz", "contact.friction.bead_wall": 0.5, "liquid.name": "Si AK10"},
    )
    assert (case.drive.frequency, changed_case(case, {})) == (80.0, case)
    assert (faster.drive.frequency, faster.contact.friction.bead_wall, faster.name) == (
        120.0,
        0.5,
        "fig1b",
    )
    assert faster.run.period == pytest.approx(1.0 / 120.0, rel=1e-12)
    assert faster.liquid.dynamic_viscosity == pytest.approx(9.3e-3)
    assert origins(faster)["contact.friction.bead_wall"].word == "given"
    assert faster == build_case(faster.document, name="fig1b")
    assert (
        "<tr><td>drive.frequency</td><td>80 Hz</td><td>given</td><td></td></tr>"
        in case._repr_html_()
    )
    # What says the same in other words goes, in one of several harmonics as well.
    assert changed_case(case, {"drive.gamma0": 0.5}).drive.peak_acceleration > 50.0
    first, last = ({f"drive.harmonics[{number}].peak_acceleration": "2 g"} for number in (0, 1))
    tables = {"drive": {"harmonics": [{"gamma0": 0.4, "axis": "x"}, {"gamma0": 0.2}]}}
    assert changed(CaseFile, tables, last)["drive"]["harmonics"][1] == {"peak_acceleration": "2 g"}
    both = {"gamma0": 0.3, "axis": "x", "peak_acceleration": "2 g"}  # each as it is said
    assert (
        changed(CaseFile, tables, {**first, "drive.harmonics[0].gamma0": 0.3})["drive"][
            "harmonics"
        ][0]
        == both
    )


HARMONICS = [
    {"frequency": "80 Hz", "gamma0": 0.2},
    {"frequency": "120 Hz", "peak_acceleration": "1 g", "axis": "y"},
]
ODD: dict[str, dict[str, Any]] = {
    "harmonics": {"drive": {"harmonics": HARMONICS}},
    "aslant": {
        "drive": {
            **REFERENCE["drive"],
            "axis": [1, 0, 2],
            "waveform": "sawtooth",
            "phase": "10 deg",
        }
    },
    "places": {
        "clusters": [
            {"diameters": ["0.6 mm", "0.4 mm"], "at": [["0.2 mm", "0 mm"], ["-0.29 mm", "0 mm"]]}
        ]
    },
    "mean": {
        "dimers": {"mean_radius": "0.25 mm", "sin_delta": 0.2, "spacing": "auto"},
        "run": {"cycles": "auto"},
    },
    "placed": {
        "placed": [{"diameter": "2 mm", "at": ["19 mm", "0 mm", "1 mm"]}],
        "run": {"duration": "0.1 s"},
    },
    "uncertain": {
        "uncertain": {
            "dimers.radii[1]": ["0.1 mm", "0.3 mm"],
            "contact": {"restitution": [0.2, 0.4]},
        }
    },
    "slope": {"boundary": {"material": "glass", "tilt": "20 deg", "uphill": "180 deg"}},
    "mixed": {"liquid": {"name": "water-glycerol", "mass_fraction": 0.87}},
}


@pytest.mark.parametrize("name", [*sorted(shipped("case")), *ODD])
def test_a_case_is_kept_as_json(name: str) -> None:
    """With all of its values, where they are from, and its file."""
    case = build_case({**document(), **ODD[name]}, name=name) if name in ODD else load_case(name)
    again = stored_case(json.loads(json.dumps(case.as_dict())))
    assert (again, again.name, again.document) == (case, case.name, case.document)
    assert again.determinants() == case.determinants()
    assert (again.origins, again.sources) == (case.origins, case.sources)
    assert [one.value for one in again.origins] == [one.value for one in case.origins]
    for damaged in ([], {**case.as_dict(), "document": 3}, {**case.as_dict(), "beads": {}}):
        with pytest.raises(ValueError, match=":"):
            stored_case(damaged)  # type: ignore[arg-type]


RESOLVED = {
    "fig1b": (
        "run.time_step",
        "run.cycles",
        "contact.youngs_modulus",
        "dimers.radii",
        "dimers.spacing",
    ),
    "pile-ci": (
        "run.settling_cycles",
        "run.samples_per_cycle",
        "mixture.small",
        "liquid.dynamic_viscosity",
    ),
}


@pytest.mark.parametrize(
    ("name", "key"), [(name, key) for name, keys in RESOLVED.items() for key in keys]
)
def test_a_resolved_case_lacks_no_value(name: str, key: str) -> None:
    """A file may leave it out; stored values without it are those of no case."""
    case = load_case(name)
    table, last = key.split(".")
    assert case.value_of(key) is not None
    values = case.as_dict()
    values[table][last] = None
    with pytest.raises(ValueError, match=key):
        stored_case(values)


def test_a_harmonic_has_a_direction() -> None:
    """Where its table leaves it out, resolving gives it."""
    case = build_case({**document(), **ODD["harmonics"]})
    assert [harmonic.axis for harmonic in case.drive.harmonics] == ["x", "y"]
    values = case.as_dict()
    values["drive"]["harmonics"][0]["axis"] = None
    with pytest.raises(ValueError, match=r"drive\.harmonics\.0\.axis"):
        stored_case(values)


def test_the_schema_refuses_what_the_program_refuses(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And keeps all shipped cases; a new case may name it, and is a case as it was without."""
    monkeypatch.setitem(
        sys.modules, "rfc3987_syntax", None
    )  # a grammar of addresses, which takes three seconds
    from jsonschema import Draft202012Validator

    assert (
        call("new", "mine", "cluster", "--schema", check=True).stdout
        == "mine.toml\ncase.schema.json\n"
    )
    assert Path("mine.toml").read_text().startswith("#:schema case.schema.json\n\n")
    assert load_case("mine").determinants() == load_case("cluster").determinants()
    schema = Draft202012Validator(json.loads(Path("case.schema.json").read_text()))
    for path in shipped("case").values():
        schema.validate(tomllib.loads(path.read_text()))
    tables = tomllib.loads(shipped("case")["fig1b"].read_text())
    changes: list[tuple[str, Any, str]] = [
        ("drive.frequenzy", "80 Hz", "drive"),
        ("drive.frequency", "80", "drive.frequency"),
        ("dimers.radii", ["0.3 mm", 0.2], "dimers.radii.1"),
        ("dimers.radii", ["0.3 mm"] * 3, "dimers.radii"),
        ("dimers.facing", "north", "dimers.facing"),
        ("run.cycles", "many", "run.cycles"),
        ("contact.restitution", 1.2, "contact.restitution"),
        ("name", "x", ""),
    ]
    for key, value, place in changes:
        wrong = changed(CaseFile, tables, {key: value})
        (error,) = schema.iter_errors(wrong)
        assert ".".join(map(str, error.absolute_path)) == place
        with pytest.raises(InputError):
            load_case(wrong)


# Mass fraction, °C, viscosity (mPa s; Segur and Oberstar 1951), density (g/cm³; Bosart and Snoddy 1928), both as in the
# tables of the Glycerine Producers' Association (1963), surface tension (mN/m; water by IAPWS, glycerol by CRC).
TABULATED = [
    (0.0, 20.0, 1.005, 0.99823, 72.74),
    (0.1, 20.0, 1.31, 1.02210, None),
    (0.5, 20.0, 6.00, 1.12630, None),
    (0.8, 20.0, 60.1, 1.20850, None),
    (0.9, 20.0, 219.0, 1.23510, None),
    (1.0, 20.0, 1410.0, 1.26108, 63.0),
    (0.0, 25.0, 0.893, 0.99705, 71.97),
]


def test_water_and_glycerol_are_as_tabulated_and_follow_fraction_and_temperature() -> None:
    for share, celsius, viscosity, density, tension in TABULATED:
        found = water_glycerol(share, celsius + 273.15)
        assert found["dynamic_viscosity"] == pytest.approx(1e-3 * viscosity, rel=0.03)
        assert found["density"] == pytest.approx(1e3 * density, rel=5e-4)
        assert tension is None or found["surface_tension"] == pytest.approx(
            1e-3 * tension, rel=3e-3
        )

    def of(**liquid: Any) -> Case:
        return make_case(liquid={"name": "water-glycerol", "mass_fraction": 0.87, **liquid})

    case = of()
    assert case.liquid.dynamic_viscosity == pytest.approx(0.1448)  # Cheng's formula by hand
    assert case.liquid.density == pytest.approx(1227.0)
    temperature, viscosity = (
        origins(case)[f"liquid.{key}"] for key in ("temperature", "dynamic_viscosity")
    )
    assert (temperature.text, temperature.origin, "Cheng" in viscosity.source) == (
        "20 degC",
        "default",
        True,
    )
    assert of(temperature="293.15 K").determinants() == case.determinants()
    assert of(temperature="25 degC").liquid.dynamic_viscosity < 0.8 * case.liquid.dynamic_viscosity
    pure, computed = make_case(liquid={"name": "glycerol"}).liquid, of(mass_fraction=1.0).liquid
    for key in ("density", "dynamic_viscosity", "surface_tension"):
        assert getattr(pure, key) == pytest.approx(getattr(computed, key), rel=3e-3)


OWN = """
[materials."my beads"]
density = { value = "2.45 g/cm^3", source = "weighed" }
youngs_modulus = { value = "2.5 GPa", source = "its data sheet" }

[materials."my plate"]
density = { value = "2.5 g/cm^3", source = "weighed" }
roughness = { value = "40 nm", source = "by a profiler" }

[[surface_pairs]]
materials = ["my beads", "glass"]
friction  = { value = 0.21, source = "tilting table", range = [0.18, 0.24] }
"""


def test_a_case_takes_from_the_library_beside_it_and_keeps_what_it_took(in_folder: Path) -> None:
    (in_folder / "library.toml").write_text(OWN)
    tables = document(beads={"material": "my beads"}, boundary={"material": "glass"})
    del tables["contact"]["friction"]
    (in_folder / "mine.toml").write_text(to_toml(tables))
    case = load_case("mine.toml")
    friction, density = (
        origins(case)[key] for key in ("contact.friction.bead_wall", "beads.density")
    )
    assert (case.beads.density, case.contact.friction.bead_wall) == (2450.0, 0.21)
    assert (density.origin, density.source) == ("own library", "library.toml, weighed")
    assert (friction.range, friction.guessed) == ((0.18, 0.24), False)
    assert (
        origins(load_case("fig1b", {"beads.material": "my beads"}))["beads.density"].origin
        == "own library"
    )
    # Of a contact with a material of one's own.
    roughness = origins(load_case("fig1b", {"boundary.material": "my plate"}))[
        "contact.roughness.bead_wall"
    ]
    assert (roughness.text, roughness.origin, "by a profiler" in roughness.source) == (
        "44.7 nm",
        "own library",
        True,
    )
    assert summarise(case)["beads"]["stiffness_ratio"] == pytest.approx(
        0.02
    )  # 50 MPa instead of its 2.5 GPa
    assert "Young's modulus of the beads reduced by a factor of 50\n" in preview_text(
        summarise(case)
    )
    # What it took goes along: into case.json, sweeps, spreads and their archives.
    varied = spread_sweep(case, 2)
    assert "contact.friction.bead_wall" in varied.keys
    sweep = expand(
        {"case": "mine.toml", "axes": {"dimers.replicates": [1, 2]}},
        source="s",
        name="s",
        folder=in_folder,
    )
    (in_folder / "library.toml").rename("other.toml")
    again = build_case(stored_case(case.as_dict()).document, name="mine")
    assert (again, again.determinants()) == (case, case.determinants())
    spread = expand(varied.file, source="s", name="s", base=(varied.case_name, varied.base))
    assert {point.beads.density for points in (sweep, spread) for point in points.cases()} == {
        2450.0
    }
    with pytest.raises(InputError, match=r'beads\.material = "my beads": not in the library'):
        load_case("mine.toml")
    assert "my beads  " not in call("library", check=True).stdout


@pytest.mark.parametrize("materials", [["my beads", "glass"], ["glass", "my beads"]])
def test_a_pair_of_surfaces_is_found_in_either_order(materials: list[str]) -> None:
    """Each is the material of the beads once, and that of the substrate once."""
    library = tomllib.loads(OWN)
    library["surface_pairs"][0]["materials"] = materials
    for bead, wall in (("my beads", "glass"), ("glass", "my beads")):
        tables = {
            **document(beads={"material": bead}, boundary={"material": wall}),
            "library": library,
        }
        del tables["contact"]["friction"]
        assert build_case(tables, name="pair").contact.friction.bead_wall == 0.21


def test_ranges_of_roughness_end_where_a_case_is_refused() -> None:
    """At a hundredth of the radius of the smallest bead, 0.2 mm; the spread of such a case can be drawn."""
    case = load_case("fig1b", {"boundary.material": "polystyrene"})
    assert origins(case)["contact.roughness.bead_wall"].range == ("22.4 nm", "2000 nm")
    assert origins(load_case("fig1b"))["contact.roughness.bead_wall"].range == ("14.1 nm", "141 nm")
    assert len(list(spread_sweep(case, 2).cases())) == 2


@pytest.mark.parametrize("name", sorted(shipped("case")))
def test_beads_of_shipped_cases_are_light_and_small_enough_for_bridges_without_gravity(
    name: str,
) -> None:
    assert gravity_warnings(load_case(name)) == []


def test_beads_beyond_the_capillary_length_that_the_liquid_does_not_hold_are_reported() -> None:
    """Ruby beads of 3 mm in silicone oil, whose capillary length is √(γ/ρg) = 1.46 mm."""
    case = load_case("fig1b", {"dimers.radii": ["3 mm", "2 mm"]})
    length, weight = gravity_warnings(case)
    assert "R = 3 mm exceed the capillary length of the liquid, 1.5 mm" in length
    mass = 4.0e3 * 4.0 / 3.0 * pi * 3e-3**3
    pull = 4.0 * pi * 19.2e-3 * 3e-3  # of a perfectly wetted bead on a plane, at most
    assert float(weight.partition("weigh ")[2].split()[0]) == pytest.approx(
        mass * 9.81 / pull, rel=0.1
    )
    assert gravity_warnings(changed_case(case, {"environment.gravity": "0 m/s^2"})) == []


def test_beads_that_are_heavier_than_the_pull_of_their_bridge_alone_are_reported() -> None:
    """The weight grows as R³ and the pull as R: ruby in silicone oil has equal ones near R = 1.2 mm."""
    for radius, reported in ((1.1, 0), (1.4, 1)):
        case = load_case("fig1b", {"dimers.radii": [f"{radius} mm", "1 mm"]})
        assert len(gravity_warnings(case)) == reported
