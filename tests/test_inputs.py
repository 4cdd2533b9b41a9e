"""Cases: quantities, origins of values, changes, storage, the schema, libraries, warnings."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from copy import deepcopy
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.conftest import REFERENCE, call, document, make_case, origins, to_toml
from walkers.errors import InputError
from walkers.inputs import units
from walkers.inputs.case_building import build_case, changed_case, stored_case
from walkers.inputs.config_table import changed
from walkers.inputs.origins import Origin
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.library import library_of, unmeasured
from walkers.inputs.resolving.plausibility import drive_warnings, gravity_warnings
from walkers.inputs.sweep import expand
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.units import parse_quantity, quantity_text
from walkers.physics.mixtures import water_glycerol
from walkers.postprocess.measure.uncertainty import uncertain_value_lines, uncertain_values
from walkers.runs.preview import preview_text, summarise
from walkers.sweeps.spread import spread_sweep

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (units.LENGTH, "0.3 mm", 3e-4),
        (units.LENGTH, "300 µm", 3e-4),
        (units.LENGTH, "300um", 3e-4),
        (units.LENGTH, "3e-4 m", 3e-4),
        (units.FREQUENCY, "80 Hz", 80.0),
        (units.FREQUENCY, "0.08 kHz", 80.0),
        (units.FREQUENCY, "80 s^-1", 80.0),
        # "1 g = 9.8 m/s²", the paper's Fig. 1
        (units.ACCELERATION, "1 g", 9.8),
        (units.ACCELERATION, "4g", 39.2),
        (units.ACCELERATION, "39.2 m/s^2", 39.2),
        (units.ACCELERATION, "39.2 m/s²", 39.2),
        (units.ACCELERATION, "1 gravity", 9.80665),
        (units.SURFACE_TENSION, "19.2 mN/m", 0.0192),
        (units.SURFACE_TENSION, "19.2 dyn/cm", 0.0192),
        (units.KINEMATIC_VISCOSITY, "5 mm^2/s", 5e-6),
        (units.KINEMATIC_VISCOSITY, "5 cSt", 5e-6),
        (units.DYNAMIC_VISCOSITY, "4.6 mPa*s", 4.6e-3),
        (units.DYNAMIC_VISCOSITY, "4.6 cP", 4.6e-3),
        (units.DENSITY, "4.0 g/cm^3", 4000.0),
        (units.DENSITY, "1 g/cm^3", 1e3),
        (units.MODULUS, "50 MPa", 5e7),
        (units.TIME, "2 us", 2e-6),
        (units.ANGLE, "180 deg", pi),
        (units.ANGLE, "10 mrad", 0.01),
        (units.TEMPERATURE, "20 °C", 293.15),
        (units.TEMPERATURE, "293.15 K", 293.15),
    ],
)
def test_quantities_are_read_in_si_units(kind: units.QuantityKind, text: str, value: float) -> None:
    assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (units.ACCELERATION, "4 kg"),
        (units.ACCELERATION, "4 mg"),
        (units.ACCELERATION, "4 g/s"),
        (units.DENSITY, "4 g"),
        (units.FREQUENCY, "500 rad/s"),
        (units.FREQUENCY, "4800 rpm"),
        (units.ANGLE, "0.5"),
        (units.ANGLE, "30 percent"),
        (units.LENGTH, "4 g"),
        (units.LENGTH, "0,3 mm"),
        (units.LENGTH, "0.3 mm 0.2 mm"),
        (units.LENGTH, "__import__('os')"),
        (units.LENGTH, "nan mm"),
        (units.LENGTH, ""),
    ],
)
def test_a_text_that_is_no_quantity_of_its_kind_is_refused(
    kind: units.QuantityKind, text: str
) -> None:
    with pytest.raises(ValueError, match=f"expected an? {kind.name} with its unit"):
        parse_quantity(text, kind)


def test_quantities_are_shown_in_units_of_the_laboratory() -> None:
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
        # 1e-9 and 1e4 m/s² over 9.8
        ("2000 g", units.ACCELERATION, "1.02e-10 and 1020 g"),
        # 1e-9 and 1 m over 2.54 cm
        ("1e30 inch", units.LENGTH, "3.937e-08 and 39.37 inch"),
    ],
)
def test_bounds_of_a_quantity_are_told_in_its_unit(
    text: str, kind: units.QuantityKind, bounds: str
) -> None:
    with pytest.raises(ValueError, match=f"it must lie between {re.escape(bounds)}$"):
        parse_quantity(text, kind)


# Glass beads on polystyrene in glycol, materials that the paper names: nobody has measured how they
# touch.
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


def test_a_value_of_the_file_is_given_as_it_is_written() -> None:
    frequency = origins(load_case("fig1b"))["drive.frequency"]
    assert frequency.origin == "given"
    assert frequency.text == "80 Hz"


def test_a_value_of_a_material_is_of_the_library_with_its_source() -> None:
    source = library_of({}).numbers("materials", "ruby")["density"].source
    density = origins(load_case("fig1b"))["beads.density"]
    assert density == Origin("beads.density", "4.0 g/cm^3", "library", source)


def test_a_friction_that_was_calibrated_lies_in_its_range() -> None:
    friction = origins(load_case("fig1b"))["contact.friction.bead_wall"]
    assert friction.origin == "calibrated"
    assert friction.range is not None
    low, high = friction.range
    assert low < float(friction.text) < high


def test_a_value_that_nothing_determines_is_assumed_or_a_default() -> None:
    by_key = origins(load_case("fig1b"))
    assert by_key["contact.restitution"].origin == "assumed"
    assert by_key["dimers.replicates"] == Origin("dimers.replicates", "6", "default")


def test_derived_values_say_how_they_are_derived() -> None:
    by_key = origins(load_case("fig1b"))
    # 5 mm²/s times 0.92 g/cm³: the liquid's own viscosity, not that of the bridges
    assert by_key["liquid.dynamic_viscosity"].text == "4.6 mPa*s"
    assert by_key["run.time_step"].source.startswith("auto: 0.4 of the rayleigh limit, ")


def test_no_value_of_the_calibrated_case_is_guessed() -> None:
    assert [key for key, origin in origins(load_case("fig1b")).items() if origin.guessed] == []


def test_what_was_calibrated_with_a_silicone_oil_holds_for_another_one() -> None:
    by_key = origins(load_case("fig1b", {"liquid.name": "Si AK10"}))
    assert by_key["liquid.meniscus_radius"].origin == "calibrated"
    assert by_key["liquid.edge_ratio"].origin == "calibrated"
    assert not by_key["liquid.edge_ratio"].guessed


def test_what_was_calibrated_with_silicone_oil_is_a_guess_for_glycerol() -> None:
    by_key = origins(load_case("fig1b", {"liquid.name": "glycerol 87 %"}))
    menisci = by_key["liquid.meniscus_radius"]
    assert menisci.origin == "default"
    assert menisci.text == "70 um"
    assert menisci.guessed
    assert menisci.range == unmeasured()["liquid.meniscus_radius"].range


def test_a_factor_for_edges_that_was_calibrated_with_silicone_oil_is_a_guess_for_glycerol() -> None:
    """No factor is usual: the guess has the number and the range of the calibration."""
    edges = origins(load_case("fig1b", {"liquid.name": "glycerol 87 %"}))["liquid.edge_ratio"]
    assert edges.origin == "default"
    assert edges.text == "1.5"
    assert edges.guessed
    assert edges.range == (0.91, 2.9)


def test_what_was_calibrated_with_a_bridge_law_is_a_guess_for_another_one() -> None:
    by_key = origins(load_case("fig1b", {"liquid.law": "willett"}))
    assert by_key["contact.rolling_friction"].guessed


def test_unmeasured_values_and_what_a_case_calls_uncertain_are_guessed() -> None:
    guessed = {}
    for key, origin in origins(build_case(GLASS)).items():
        if origin.guessed:
            guessed[key] = origin.text
    assert guessed == {
        "contact.restitution": "0.3",
        "liquid.volume_fraction": "0.01",
        "liquid.contact_angle": "0 deg",
        "contact.friction.bead_wall": "0.3",
    }


RANGES = {
    "liquid.surface_tension": ["15 mN/m", "25 mN/m"],
    "contact.friction.bead_wall": [0.1, 0.4],
    # An end may be the value of the case.
    "dimers.radii[1]": ["0.19 mm", "0.2 mm"],
}


@pytest.fixture
def uncertain_case(tmp_path: Path) -> Case:
    """The shipped case with ranges of a value of the library, a calibrated one and a given one."""
    tables = {**load_case("fig1b").document, "uncertain": RANGES}
    (tmp_path / "ranges.toml").write_text(to_toml(tables))
    return load_case(tmp_path / "ranges.toml")


def test_what_is_called_uncertain_keeps_where_it_comes_from(uncertain_case: Case) -> None:
    by_key = origins(uncertain_case)
    tension = by_key["liquid.surface_tension"]
    assert tension.origin == "library"
    assert tension.text == "19.2 mN/m"
    assert tension.range == ("15 mN/m", "25 mN/m")
    friction = by_key["contact.friction.bead_wall"]
    assert friction.origin == "calibrated"
    assert friction.guessed
    assert friction.range == (0.1, 0.4)


def test_one_bead_of_a_walker_may_be_called_uncertain(uncertain_case: Case) -> None:
    radius = origins(uncertain_case)["dimers.radii[1]"]
    assert radius.text == "0.2 mm"
    assert radius.guessed


def test_what_is_called_uncertain_is_printed_with_its_range(
    uncertain_case: Case, tmp_path: Path
) -> None:
    shown = call("show", str(tmp_path / "ranges.toml"), check=True).stdout
    assert ", uncertain, range 0.1 to 0.4" in shown
    lines = uncertain_value_lines(uncertain_values(uncertain_case.origins))
    assert "uncertain  surface_tension 19.2 mN/m" in "\n".join(lines)


def test_a_spread_varies_what_is_called_uncertain(uncertain_case: Case) -> None:
    assert RANGES.keys() < set(spread_sweep(uncertain_case, 2).keys)


def test_a_changed_value_may_leave_the_range_of_its_case() -> None:
    """As points of sweeps do."""
    tables = {**GLASS, "uncertain": {"contact.friction.bead_wall": [0.4, 0.6]}}
    assert build_case(tables).contact.friction.bead_wall == 0.3
    case = load_case(tables, {"contact.friction.bead_wall": 0.4})
    assert case.contact.friction.bead_wall == 0.4


def test_names_and_what_no_law_asks_for_do_not_determine_a_run() -> None:
    """Values in place of the names of materials, a title, and a viscosity beside the library's."""
    case = make_case(liquid={"dynamic_viscosity": "4.6 mPa*s"})
    tables = document(
        title="other",
        beads={"material": "rubies", "density": "4.0 g/cm^3"},
        boundary={"material": "chromium"},
        liquid={"surface_tension": "19.2 mN/m", "dynamic_viscosity": "4.6 mPa*s"},
        run={"settled_below": "1 mm/s"},
    )
    del tables["liquid"]["name"]
    same_by_values = build_case(tables)
    assert same_by_values != case
    assert same_by_values.determinants() == case.determinants()


def test_the_seed_determines_a_run() -> None:
    assert make_case(run={"seed": 2}).determinants() != make_case().determinants()


@pytest.fixture
def short_case() -> Case:
    """The shipped case, shortened."""
    changes = {"run.cycles": 2, "run.settling_cycles": 0, "dimers.replicates": 1}
    return load_case("fig1b", changes)


@pytest.fixture
def faster_case(short_case: Case) -> Case:
    """That case at another frequency, in another liquid."""
    return changed_case(
        short_case,
        {
            "drive.frequency": "120 Hz",
            "contact.friction.bead_wall": 0.5,
            "liquid.name": "Si AK10",
        },
    )


def test_a_case_is_changed_as_its_file_would_be(faster_case: Case) -> None:
    assert faster_case == build_case(faster_case.document, name="fig1b")
    assert faster_case.drive.frequency == 120.0
    assert faster_case.contact.friction.bead_wall == 0.5
    assert faster_case.name == "fig1b"
    assert origins(faster_case)["contact.friction.bead_wall"].word == "given"


def test_values_follow_the_changes_of_a_case(faster_case: Case) -> None:
    """Si AK10: 10 mm²/s times 0.93 g/cm³."""
    assert faster_case.run.period == pytest.approx(1.0 / 120.0, rel=1e-12)
    assert faster_case.liquid.dynamic_viscosity == pytest.approx(9.3e-3)


def test_changing_a_case_leaves_the_case_itself_as_it_was(
    short_case: Case, faster_case: Case
) -> None:
    assert short_case.drive.frequency == 80.0
    assert changed_case(short_case, {}) == short_case


def test_a_notebook_shows_a_case_as_a_table_of_values_and_origins(short_case: Case) -> None:
    row = "<tr><td>drive.frequency</td><td>80 Hz</td><td>given</td><td></td></tr>"
    assert row in short_case._repr_html_()


def test_a_changed_gamma0_replaces_the_peak_acceleration(short_case: Case) -> None:
    """Γ0 = 0.381 at 4 g, says the paper, so it is 0.5 at 39.2 m/s² × 0.5 / 0.381."""
    case = changed_case(short_case, {"drive.gamma0": 0.5})
    assert case.drive.peak_acceleration == pytest.approx(51.4, rel=5e-3)


TWO_HARMONICS = {"drive": {"harmonics": [{"gamma0": 0.4, "axis": "x"}, {"gamma0": 0.2}]}}


def test_a_changed_acceleration_replaces_the_gamma0_of_its_harmonic() -> None:
    changes = {"drive.harmonics[1].peak_acceleration": "2 g"}
    first, second = changed(CaseFile, TWO_HARMONICS, changes)["drive"]["harmonics"]
    assert first == {"gamma0": 0.4, "axis": "x"}
    assert second == {"peak_acceleration": "2 g"}


def test_two_changes_that_say_the_same_are_both_kept() -> None:
    """So that the message about the changed case can name both."""
    changes = {
        "drive.harmonics[0].peak_acceleration": "2 g",
        "drive.harmonics[0].gamma0": 0.3,
    }
    first, _ = changed(CaseFile, TWO_HARMONICS, changes)["drive"]["harmonics"]
    assert first == {"gamma0": 0.3, "axis": "x", "peak_acceleration": "2 g"}


HARMONICS = [
    {"frequency": "80 Hz", "gamma0": 0.2},
    {"frequency": "120 Hz", "peak_acceleration": "1 g", "axis": "y"},
]
TILTED_SAWTOOTH = {"axis": [1, 0, 2], "waveform": "sawtooth", "phase": "10 deg"}
PAIR_AT_PLACES = {
    "diameters": ["0.6 mm", "0.4 mm"],
    "at": [["0.2 mm", "0 mm"], ["-0.29 mm", "0 mm"]],
}
UNUSUAL_TABLES: dict[str, dict[str, Any]] = {
    "harmonics": {"drive": {"harmonics": HARMONICS}},
    "aslant": {"drive": REFERENCE["drive"] | TILTED_SAWTOOTH},
    "places": {"clusters": [PAIR_AT_PLACES]},
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
"""Tables that replace those of the reference case, to store what no shipped case has."""


@pytest.fixture(params=[*sorted(shipped("case")), *UNUSUAL_TABLES])
def any_case(request: pytest.FixtureRequest) -> Case:
    """Each shipped case, and the reference case with each of the `UNUSUAL_TABLES`."""
    if request.param in UNUSUAL_TABLES:
        return build_case({**document(), **UNUSUAL_TABLES[request.param]}, name=request.param)
    return load_case(request.param)


def test_a_case_is_kept_as_json(any_case: Case) -> None:
    """With all of its values, where they are from, and its file."""
    again = stored_case(json.loads(json.dumps(any_case.as_dict())))
    assert again == any_case
    assert again.name == any_case.name
    assert again.document == any_case.document
    assert again.determinants() == any_case.determinants()
    assert again.origins == any_case.origins
    assert again.sources == any_case.sources
    # An `Origin` is compared without its value.
    for stored, origin in zip(again.origins, any_case.origins, strict=True):
        assert stored.value == origin.value


def test_a_damaged_json_is_no_case(any_case: Case) -> None:
    values = any_case.as_dict()
    for damaged in ([], {**values, "document": 3}, {**values, "beads": {}}):
        with pytest.raises(ValueError, match=":"):
            stored_case(damaged)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("fig1b", "run.time_step"),
        ("fig1b", "run.cycles"),
        ("fig1b", "contact.youngs_modulus"),
        ("fig1b", "dimers.radii"),
        ("fig1b", "dimers.spacing"),
        ("pile-ci", "run.settling_cycles"),
        ("pile-ci", "run.samples_per_cycle"),
        ("pile-ci", "mixture.small"),
        ("pile-ci", "liquid.dynamic_viscosity"),
    ],
)
def test_a_resolved_case_lacks_no_value(name: str, key: str) -> None:
    """A file may leave it out; stored values without it are those of no case."""
    case = load_case(name)
    assert case.value_of(key) is not None
    values = case.as_dict()
    table, last = key.split(".")
    values[table][last] = None
    with pytest.raises(ValueError, match=key):
        stored_case(values)


def test_a_harmonic_without_a_direction_gets_one() -> None:
    case = build_case({**document(), **UNUSUAL_TABLES["harmonics"]})
    assert [harmonic.axis for harmonic in case.drive.harmonics] == ["x", "y"]


def test_a_stored_harmonic_has_a_direction() -> None:
    values = build_case({**document(), **UNUSUAL_TABLES["harmonics"]}).as_dict()
    values["drive"]["harmonics"][0]["axis"] = None
    with pytest.raises(ValueError, match=r"drive\.harmonics\.0\.axis"):
        stored_case(values)


@pytest.fixture
def schema(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Draft202012Validator:
    """The schema that the program writes beside a new case, ``mine.toml``."""
    # jsonschema imports a grammar of addresses, which takes three seconds.
    monkeypatch.setitem(sys.modules, "rfc3987_syntax", None)
    from jsonschema import Draft202012Validator

    printed = call("new", "mine", "cluster", "--schema", check=True).stdout
    assert printed == "mine.toml\ncase.schema.json\n"
    return Draft202012Validator(json.loads(Path("case.schema.json").read_text()))


def test_a_case_that_names_its_schema_is_a_case_as_without(schema: Draft202012Validator) -> None:
    assert Path("mine.toml").read_text().startswith("#:schema case.schema.json\n\n")
    assert load_case("mine").determinants() == load_case("cluster").determinants()


def test_the_schema_accepts_all_shipped_cases(schema: Draft202012Validator) -> None:
    for path in shipped("case").values():
        schema.validate(tomllib.loads(path.read_text()))


@pytest.mark.parametrize(
    ("key", "value", "place"),
    [
        ("drive.frequenzy", "80 Hz", "drive"),
        ("drive.frequency", "80", "drive.frequency"),
        ("dimers.radii", ["0.3 mm", 0.2], "dimers.radii.1"),
        ("dimers.radii", ["0.3 mm"] * 3, "dimers.radii"),
        ("dimers.facing", "north", "dimers.facing"),
        ("run.cycles", "many", "run.cycles"),
        ("contact.restitution", 1.2, "contact.restitution"),
        ("name", "x", ""),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(
    schema: Draft202012Validator, key: str, value: Any, place: str
) -> None:
    tables = tomllib.loads(shipped("case")["fig1b"].read_text())
    wrong = changed(CaseFile, tables, {key: value})
    (error,) = schema.iter_errors(wrong)
    assert ".".join(map(str, error.absolute_path)) == place
    with pytest.raises(InputError):
        load_case(wrong)


# Viscosity: Segur and Oberstar (1951); density: Bosart and Snoddy (1928), both as in the tables of
# the Glycerine Producers' Association (1963); surface tension: water by IAPWS, glycerol by CRC.
@pytest.mark.parametrize(
    ("mass_fraction", "celsius", "viscosity_mpa_s", "density_g_cm3"),
    [
        (0.0, 20.0, 1.005, 0.99823),
        (0.1, 20.0, 1.31, 1.02210),
        (0.5, 20.0, 6.00, 1.12630),
        (0.8, 20.0, 60.1, 1.20850),
        (0.9, 20.0, 219.0, 1.23510),
        (1.0, 20.0, 1410.0, 1.26108),
        (0.0, 25.0, 0.893, 0.99705),
    ],
)
def test_viscosity_and_density_of_water_and_glycerol_are_as_tabulated(
    mass_fraction: float, celsius: float, viscosity_mpa_s: float, density_g_cm3: float
) -> None:
    mixture = water_glycerol(mass_fraction, celsius + 273.15)
    assert mixture["dynamic_viscosity"] == pytest.approx(1e-3 * viscosity_mpa_s, rel=0.03)
    assert mixture["density"] == pytest.approx(1e3 * density_g_cm3, rel=5e-4)


@pytest.mark.parametrize(
    ("mass_fraction", "celsius", "tension_mn_m"),
    [(0.0, 20.0, 72.74), (0.0, 25.0, 71.97), (1.0, 20.0, 63.0)],
)
def test_the_surface_tension_of_water_and_glycerol_is_as_tabulated(
    mass_fraction: float, celsius: float, tension_mn_m: float
) -> None:
    mixture = water_glycerol(mass_fraction, celsius + 273.15)
    assert mixture["surface_tension"] == pytest.approx(1e-3 * tension_mn_m, rel=3e-3)


def glycerol_case(**liquid: Any) -> Case:
    """The reference case in water with glycerol, 87 % of its mass."""
    return make_case(liquid={"name": "water-glycerol", "mass_fraction": 0.87, **liquid})


def test_a_mixture_of_water_and_glycerol_has_the_values_of_its_fraction() -> None:
    """The viscosity is Cheng's formula by hand."""
    case = glycerol_case()
    assert case.liquid.dynamic_viscosity == pytest.approx(0.1448)
    assert case.liquid.density == pytest.approx(1227.0)
    assert "Cheng" in origins(case)["liquid.dynamic_viscosity"].source


def test_a_mixture_of_water_and_glycerol_is_at_20_degrees_unless_the_case_says_otherwise() -> None:
    case = glycerol_case()
    temperature = origins(case)["liquid.temperature"]
    assert temperature.text == "20 degC"
    assert temperature.origin == "default"
    assert glycerol_case(temperature="293.15 K").determinants() == case.determinants()


def test_warm_glycerol_is_thinner() -> None:
    """By more than a fifth from 20 to 25 °C."""
    cold = glycerol_case().liquid.dynamic_viscosity
    warm = glycerol_case(temperature="25 degC").liquid.dynamic_viscosity
    assert warm < 0.8 * cold


@pytest.mark.parametrize("key", ["density", "dynamic_viscosity", "surface_tension"])
def test_the_glycerol_of_the_library_is_the_mixture_without_water(key: str) -> None:
    library_value = getattr(make_case(liquid={"name": "glycerol"}).liquid, key)
    mixture_value = getattr(glycerol_case(mass_fraction=1.0).liquid, key)
    assert library_value == pytest.approx(mixture_value, rel=3e-3)


OWN_LIBRARY = """
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


@pytest.fixture
def library_file(in_folder: Path) -> Path:
    """A library of one's own in the working directory."""
    file = in_folder / "library.toml"
    file.write_text(OWN_LIBRARY)
    return file


@pytest.fixture
def case_with_own_beads(library_file: Path) -> Case:
    """A case of the user's beads on glass, ``mine.toml``, beside the library."""
    tables = document(beads={"material": "my beads"}, boundary={"material": "glass"})
    del tables["contact"]["friction"]
    Path("mine.toml").write_text(to_toml(tables))
    return load_case("mine.toml")


def test_a_case_takes_values_from_the_library_beside_it(case_with_own_beads: Case) -> None:
    by_key = origins(case_with_own_beads)
    assert case_with_own_beads.beads.density == 2450.0
    assert by_key["beads.density"].origin == "own library"
    assert by_key["beads.density"].source == "library.toml, weighed"
    assert case_with_own_beads.contact.friction.bead_wall == 0.21
    assert by_key["contact.friction.bead_wall"].range == (0.18, 0.24)
    assert not by_key["contact.friction.bead_wall"].guessed


def test_a_shipped_case_takes_values_from_the_library_of_the_working_directory(
    library_file: Path,
) -> None:
    case = load_case("fig1b", {"beads.material": "my beads"})
    assert origins(case)["beads.density"].origin == "own library"


def test_the_roughness_of_a_contact_with_a_material_beside_it_is_of_its_own_library(
    library_file: Path,
) -> None:
    """40 nm of the plate and 20 nm of ruby add to √(40² + 20²) = 44.7 nm."""
    case = load_case("fig1b", {"boundary.material": "my plate"})
    roughness = origins(case)["contact.roughness.bead_wall"]
    assert roughness.text == "44.7 nm"
    assert roughness.origin == "own library"
    assert "by a profiler" in roughness.source


def test_a_preview_compares_the_stiffness_with_the_library_beside_it(
    case_with_own_beads: Case,
) -> None:
    """50 MPa in the place of 2.5 GPa."""
    summary = summarise(case_with_own_beads)
    assert summary["beads"]["stiffness_ratio"] == pytest.approx(0.02)
    assert "Young's modulus of the beads reduced by a factor of 50\n" in preview_text(summary)


def test_a_stored_case_keeps_what_it_took_from_the_library_beside_it(
    case_with_own_beads: Case, library_file: Path
) -> None:
    stored = case_with_own_beads.as_dict()
    library_file.unlink()
    again = build_case(stored_case(stored).document, name="mine")
    assert again == case_with_own_beads
    assert again.determinants() == case_with_own_beads.determinants()


def test_a_sweep_keeps_what_its_case_took_from_the_library_beside_it(
    case_with_own_beads: Case, library_file: Path, in_folder: Path
) -> None:
    definition = {"case": "mine.toml", "axes": {"dimers.replicates": [1, 2]}}
    sweep = expand(definition, source="s", name="s", folder=in_folder)
    library_file.unlink()
    assert [point.beads.density for point in sweep.cases()] == [2450.0, 2450.0]


def test_a_spread_keeps_what_its_case_took_from_the_library_beside_it(
    case_with_own_beads: Case, library_file: Path
) -> None:
    """The friction of the pair has a range in the library."""
    varied = spread_sweep(case_with_own_beads, 2)
    assert "contact.friction.bead_wall" in varied.keys
    library_file.unlink()
    again = expand(varied.file, source="s", name="s", base=(varied.case_name, varied.base))
    assert [point.beads.density for point in again.cases()] == [2450.0, 2450.0]


def test_a_case_cannot_be_read_without_the_library_that_was_beside_it(
    case_with_own_beads: Case, library_file: Path
) -> None:
    library_file.unlink()
    with pytest.raises(InputError, match=r'beads\.material = "my beads": not in the library'):
        load_case("mine.toml")
    assert "my beads  " not in call("library", check=True).stdout


@pytest.mark.parametrize("pair", [["my beads", "glass"], ["glass", "my beads"]])
@pytest.mark.parametrize(("bead", "wall"), [("my beads", "glass"), ("glass", "my beads")])
def test_a_pair_of_surfaces_is_found_in_either_order(pair: list[str], bead: str, wall: str) -> None:
    library = tomllib.loads(OWN_LIBRARY)
    library["surface_pairs"][0]["materials"] = pair
    tables = document(beads={"material": bead}, boundary={"material": wall}, library=library)
    del tables["contact"]["friction"]
    assert build_case(tables, name="pair").contact.friction.bead_wall == 0.21


def test_a_range_of_roughness_ends_where_a_case_is_refused() -> None:
    """At a hundredth of the radius of the smallest bead, 0.2 mm."""
    case = load_case("fig1b", {"boundary.material": "polystyrene"})
    assert origins(case)["contact.roughness.bead_wall"].range == ("22.4 nm", "2000 nm")
    assert len(list(spread_sweep(case, 2).cases())) == 2


def test_other_ranges_of_roughness_are_those_of_the_library() -> None:
    """Two surfaces of 10 to 100 nm each add to 14.1 to 141 nm."""
    roughness = origins(load_case("fig1b"))["contact.roughness.bead_wall"]
    assert roughness.range == ("14.1 nm", "141 nm")


@pytest.mark.parametrize("name", sorted(shipped("case")))
def test_beads_of_shipped_cases_are_light_and_small_enough_for_bridges_without_gravity(
    name: str,
) -> None:
    assert gravity_warnings(load_case(name)) == []


@pytest.fixture
def heavy_case() -> Case:
    """Ruby beads of 3 mm in silicone oil, whose capillary length is √(γ/ρg) = 1.46 mm."""
    return load_case("fig1b", {"dimers.radii": ["3 mm", "2 mm"]})


def test_beads_beyond_the_capillary_length_are_reported(heavy_case: Case) -> None:
    length, _ = gravity_warnings(heavy_case)
    assert "R = 3 mm exceed the capillary length of the liquid, 1.5 mm" in length


def test_beads_that_the_liquid_does_not_hold_are_reported(heavy_case: Case) -> None:
    """The capillary force of a perfectly wetted bead on a plane is 4πγR at most."""
    _, weight = gravity_warnings(heavy_case)
    mass = 4.0e3 * 4.0 / 3.0 * pi * 3e-3**3
    capillary_force = 4.0 * pi * 19.2e-3 * 3e-3
    ratio = re.search(r"weigh ([\d.]+)", weight)
    assert ratio is not None
    assert float(ratio[1]) == pytest.approx(mass * 9.81 / capillary_force, rel=0.1)


def test_heavy_beads_are_not_reported_without_gravity(heavy_case: Case) -> None:
    assert gravity_warnings(changed_case(heavy_case, {"environment.gravity": "0 m/s^2"})) == []


@pytest.mark.parametrize(("radius_mm", "warnings"), [(1.1, 0), (1.4, 1)])
def test_beads_that_are_heavier_than_the_force_of_their_bridge_alone_are_reported(
    radius_mm: float, warnings: int
) -> None:
    """The weight grows as R³ and the force as R: for ruby in silicone oil they equal at 1.2 mm."""
    case = load_case("fig1b", {"dimers.radii": [f"{radius_mm} mm", "1 mm"]})
    assert len(gravity_warnings(case)) == warnings


SLOPE = {"boundary.tilt": "90 deg", "boundary.uphill": "0 deg"}
"""A wall."""


def hanging(radius_mm: float, **changes: str) -> Case:
    """A dimer of ruby beads of similar size in silicone oil."""
    radii = [f"{radius_mm} mm", f"{0.95 * radius_mm} mm"]
    return load_case("fig1b", {"dimers.radii": radii, **changes})


def test_walkers_on_a_slope_that_cannot_hang_from_one_bead_are_reported() -> None:
    """A bridge between equal beads pulls with 2πγR at most, half of that to a plane.

    Both beads are lighter than the pull of their bridges to the wall.
    """
    (warning,) = gravity_warnings(hanging(1.0, **SLOPE))
    ratio = re.search(r"is ([\d.]+) times the pull", warning)
    assert ratio is not None
    weight = 4.0e3 * 9.81 * 4.0 / 3.0 * pi * 1e-3**3
    assert float(ratio[1]) == pytest.approx(weight / (2.0 * pi * 19.2e-3 * 0.975e-3), rel=0.15)


def test_the_slope_counts_by_the_sine_of_its_tilt() -> None:
    assert gravity_warnings(hanging(1.0, **{"boundary.tilt": "10 deg"})) == []


@pytest.mark.parametrize("radius_mm", [0.5, 0.7])
def test_light_walkers_on_a_wall_are_not_reported(radius_mm: float) -> None:
    assert gravity_warnings(hanging(radius_mm, **SLOPE)) == []


def test_heavy_walkers_on_a_level_floor_do_not_hang() -> None:
    assert gravity_warnings(hanging(1.0)) == []


def test_loose_beads_that_cannot_hang_from_one_another_are_reported() -> None:
    tables = document(run={"duration": "0.1 s"})
    del tables["dimers"]
    del tables["run"]["cycles"], tables["run"]["settling_cycles"]
    placed = [
        {"radius": "1 mm", "at": ["-3 mm", "0 mm", "1 mm"]},
        {"radius": "1 mm", "at": ["3 mm", "0 mm", "1 mm"]},
    ]
    (warning,) = gravity_warnings(load_case({**tables, "placed": placed}))
    assert "none hangs from another" in warning


@pytest.mark.parametrize("name", sorted(shipped("case")))
def test_drives_of_shipped_cases_are_plausible(name: str) -> None:
    assert drive_warnings(load_case(name)) == []


@pytest.mark.parametrize(
    ("frequency", "texts"),
    [
        ("900 Hz", []),
        ("2 kHz", ["2 kHz"]),
        ("80 kHz", ["80 kHz", "0.155 nm to either side, less than the roughness"]),
        ("0.08 Hz", ["155 m to either side"]),
        ("4 Hz", []),
    ],
)
def test_a_frequency_in_another_unit_is_reported_with_its_consequence(
    frequency: str, texts: list[str]
) -> None:
    """The amplitude of 4 g at 80 Hz is 155 um; it falls with the square of the frequency."""
    warnings = drive_warnings(load_case("fig1b", {"drive.frequency": frequency}))
    assert len(warnings) == len(texts)
    for warning, text in zip(warnings, texts, strict=True):
        assert text in warning


def test_a_slow_drive_below_the_roughness_is_reported() -> None:
    case = load_case("fig1b", {"drive.peak_acceleration": "0.001 g"})
    (warning,) = drive_warnings(case)
    assert "38.8 nm to either side, less than the roughness of the surfaces, 39.4 nm" in warning


def test_a_case_keeps_its_tables_if_the_caller_changes_them() -> None:
    tables = deepcopy(document())
    del tables["contact"]["rolling_friction"]
    case = load_case(tables)
    tables["contact"]["rolling_friction"] = 0.02
    assert origins(case)["contact.rolling_friction"].word != "given"
