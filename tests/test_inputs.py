"""Cases: quantities, values that a file leaves out and their sources, changes, the library, the schema for editors."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import walkers
from tests.conftest import REFERENCE, call, document, make_case, origins, to_toml
from walkers.errors import InputError
from walkers.inputs import units
from walkers.inputs.case import Case
from walkers.inputs.keys import settings_of
from walkers.inputs.library import library_of, unmeasured
from walkers.inputs.origins import Origin
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.schema import case_schema
from walkers.inputs.sweep import expand
from walkers.inputs.table import changed, keys_in
from walkers.inputs.units import parse_quantity
from walkers.physics.mixtures import water_glycerol
from walkers.postprocess.uncertainty import lines_of_rest, rests_on
from walkers.show import describe, summarise
from walkers.sweeps.spread import spread_sweep

# --- quantities -------------------------------------------------------------------------------------------------------


QUANTITIES = {
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
        assert {text: parse_quantity(text, kind) for text in texts} == pytest.approx(texts, rel=1e-14)
    for kind, wrong in NO_QUANTITIES.items():
        for text in wrong:
            with pytest.raises(ValueError, match=f"expected an? {kind.name} with its unit"):
                parse_quantity(text, kind)


def test_usual_units_are_read_as_pint_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last digit, and refused with the same words."""
    kinds = [kind for kind in vars(units).values() if isinstance(kind, units.Kind)]
    texts = [f"{number} {symbol}" for symbol in units._USUAL for number in ("1", "0.3", "-7.125e-2", "123456789.012")]

    def read(text: str, kind: units.Kind) -> float | str:
        try:
            return parse_quantity(text, kind)
        except ValueError as error:
            return str(error)

    usual = {(text, kind.name): read(text, kind) for text in texts for kind in kinds}
    monkeypatch.setattr(units, "_USUAL", {})
    assert usual == {(text, kind.name): read(text, kind) for text in texts for kind in kinds}
    assert sum(isinstance(value, float) for value in usual.values()) > 100


def test_shipped_cases_do_not_wait_for_pint() -> None:
    loads = 'from walkers.inputs.reading import load_case, shipped; [load_case(name) for name in shipped("case")]'
    script = f"import sys; {loads}; sys.exit('pint' in sys.modules)"
    subprocess.run([sys.executable, "-c", script], check=True)


# --- sources of values ------------------------------------------------------------------------------------------------


# Glass beads on polystyrene in glycol, materials that the paper names: nobody has measured how they touch.
GLASS = {
    "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
    "beads": {"material": "glass"},
    "liquid": {"name": "ethylene glycol"},
    "boundary": {"material": "polystyrene"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "10 g"},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.0, "youngs_modulus": "10 MPa"},
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
    assert found["liquid.dynamic_viscosity"].text == "4.6 mPa*s"  # 5 mm²/s times 0.92 g/cm³, not that of the bridges
    assert found["run.time_step"].source.startswith("auto: 0.4 of the rayleigh limit, ")
    assert not any(one.guessed for one in found.values())
    # What was calibrated with other liquids, or another law, is a guess.
    assert origins(load_case("fig1b", {"liquid.name": "Si AK10"}))["liquid.meniscus_radius"].origin == "calibrated"
    menisci = origins(load_case("fig1b", {"liquid.name": "glycerol 87 %"}))["liquid.meniscus_radius"]
    assert (menisci.origin, menisci.text, menisci.guessed) == ("default", "70 um", True)
    assert menisci.range == unmeasured()["liquid.meniscus_radius"].range
    assert origins(load_case("fig1b", {"liquid.law": "willett"}))["contact.rolling_friction"].guessed
    # What a case gives is guessed if it is called uncertain.
    guessed = {key: one.text for key, one in origins(Case.read(GLASS)).items() if one.guessed}
    unknown = {"contact.restitution": "0.3", "liquid.volume_fraction": "0.01", "liquid.contact_angle": "0 deg"}
    assert guessed == {**unknown, "contact.friction.bead_wall": "0.3"}


LENGTHS = {
    "fig1b": ("4 of 12, 8 of 24, 20 of 60", "derived", "checked after 12 and 24 cycles"),
    "tray": ("20", "derived", "from the duration"),
    "pile-ci": ("0", "default", "from the duration, rounded up to a multiple of 3 cycles (one sample)"),
}


@pytest.mark.parametrize("name", sorted(shipped("case")))
def test_the_origins_tell_the_numbers_of_the_case(name: str) -> None:
    """Each text, read as a file's, gives the same case: nothing is told that is not so."""
    case = load_case(name)
    matter = [one for one in case.origins if one.origin not in ("given", "derived")]
    matter = [one for one in matter if one.key.split(".")[0] in ("beads", "liquid", "contact")]
    assert len(matter) >= 10
    told = settings_of(f"{one.key} = {one.text}" for one in matter)
    again = load_case(name, told)
    assert (again.contact, again.beads) == (case.contact, case.beads)
    assert again.liquid.of_bridges == case.liquid.of_bridges
    assert {one.origin for one in again.origins if one.key in told} == {"given"}
    settling, cycles = (origins(case)[f"run.{key}"] for key in ("settling_cycles", "cycles"))
    assert settling.value == case.run.settling_cycles
    assert LENGTHS.get(name, settling.text) in ((settling.text, settling.origin, cycles.source), settling.text)


def test_what_is_called_uncertain_keeps_where_it_comes_from(tmp_path: Path) -> None:
    ranges = {"liquid.surface_tension": ["15 mN/m", "25 mN/m"], "contact.friction.bead_wall": [0.2, 0.4]}
    ranges["dimers.radii[1]"] = ["0.19 mm", "0.2 mm"]  # an end may be the value of the case
    (file := tmp_path / "ranges.toml").write_text(to_toml({**load_case("fig1b").document, "uncertain": ranges}))
    found = origins(case := load_case(file))
    tension, friction, radius = (found[key] for key in ranges)
    assert (tension.origin, tension.text, tension.range) == ("library", "19.2 mN/m", ("15 mN/m", "25 mN/m"))
    assert (friction.origin, friction.guessed, friction.range) == ("calibrated", True, (0.2, 0.4))
    assert (radius.text, radius.guessed) == ("0.2 mm", True)
    # In the same words wherever it is shown.
    words = [f"{one}, uncertain" for one in ("library", "calibrated", "given")]
    assert [one.word for one in (tension, friction, radius)] == words
    assert ", uncertain, range 0.2 to 0.4" in call("show", str(file), check=True).stdout
    assert "uncertain  surface_tension 19.2 mN/m, friction.bead_wall" in "\n".join(
        lines_of_rest(rests_on(case.origins))
    )
    assert {*ranges} < set(spread_sweep(case, 2).keys)
    # Points of sweeps may leave the range; the case itself may not.
    tables = {**GLASS, "uncertain": {"contact.friction.bead_wall": [0.4, 0.6]}}
    assert Case.read(tables).contact.friction.bead_wall == 0.3
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
    named = Case.read(tables)
    assert named != case
    assert named.determinants() == case.determinants()
    assert make_case(run={"seed": 2}).determinants() != make_case().determinants()


# --- changes, JSON, schema --------------------------------------------------------------------------------------------


def test_a_case_is_changed_as_its_file_would_be(tmp_path: Path) -> None:
    """All values follow, with their origins; the case itself stays as it was."""
    case = load_case("fig1b", {"run.cycles": 2, "run.settling_cycles": 0, "dimers.replicates": 1})
    faster = case.changed({"drive.frequency": "120 Hz", "contact.friction.bead_wall": 0.5, "liquid.name": "Si AK10"})
    assert (case.drive.frequency, case.changed({})) == (80.0, case)
    assert (faster.drive.frequency, faster.contact.friction.bead_wall, faster.name) == (120.0, 0.5, "fig1b")
    assert faster.run.period == pytest.approx(1.0 / 120.0, rel=1e-12)
    assert faster.liquid.dynamic_viscosity == pytest.approx(9.3e-3)
    assert origins(faster)["contact.friction.bead_wall"].word == "given"
    assert faster == Case.read(faster.document, name="fig1b")
    assert case.for_cycles(2).origins == case.but(name="other").origins == case.origins
    assert "drive.frequency = 80 Hz" in repr(case)
    assert "<tr><td>drive.frequency</td><td>80 Hz</td><td>given</td><td></td></tr>" in case._repr_html_()
    # What says the same in other words goes, in one of several harmonics as well.
    assert case.changed({"drive.gamma0": 0.5}).drive.peak_acceleration > 50.0
    harmonic = {"drive.harmonics[0].peak_acceleration": "4 g"}
    tables = changed(Case, {"drive": {"harmonics": [{"gamma0": 1.0}]}}, harmonic)
    assert tables["drive"]["harmonics"] == [{"peak_acceleration": "4 g"}]
    # Values that are put in without validation do not run with the steps of others.
    with pytest.raises(InputError, match=r"drive.frequency = 120 Hz: time step and sampling are of 80 Hz"):
        walkers.run(case.put("drive.frequency", 120.0), tmp_path)
    with pytest.raises(InputError, match=r"run.time_step = .* limit of the case as changed"):
        walkers.run(case.put("contact.youngs_modulus", 1e10), tmp_path)


def test_a_case_may_be_a_dictionary() -> None:
    case = load_case(REFERENCE)
    assert (case, case.name) == (Case.read(REFERENCE), "case")
    with pytest.raises(InputError, match=r'^<case>: --set drive\.frequency = "80": expected a frequency with its unit'):
        load_case(REFERENCE, {"drive.frequency": "80"})


HARMONICS = [{"frequency": "80 Hz", "gamma0": 0.2}, {"frequency": "120 Hz", "peak_acceleration": "1 g", "axis": "y"}]
ODD: dict[str, dict[str, Any]] = {
    "harmonics": {"drive": {"harmonics": HARMONICS}},
    "aslant": {"drive": {**REFERENCE["drive"], "axis": [1, 0, 2], "waveform": "sawtooth", "phase": "10 deg"}},
    "places": {"clusters": [{"diameters": ["0.6 mm", "0.4 mm"], "at": [["0.2 mm", "0 mm"], ["-0.29 mm", "0 mm"]]}]},
    "mean": {"dimers": {"mean_radius": "0.25 mm", "sin_delta": 0.2, "gap": "auto"}, "run": {"cycles": "auto"}},
    "placed": {"placed": [{"diameter": "2 mm", "at": ["19 mm", "0 mm", "1 mm"]}], "run": {"duration": "0.1 s"}},
    "uncertain": {"uncertain": {"dimers.radii[1]": ["0.1 mm", "0.3 mm"], "contact": {"restitution": [0.2, 0.4]}}},
    "slope": {"boundary": {"material": "glass", "tilt": "20 deg", "uphill": "180 deg"}},
    "mixed": {"liquid": {"name": "water-glycerol", "mass_fraction": 0.87}},
}


@pytest.mark.parametrize("name", [*sorted(shipped("case")), *ODD])
def test_a_case_is_kept_as_json(name: str) -> None:
    """With all of its values, where they are from, and its file."""
    case = Case.read({**document(), **ODD[name]}, name=name) if name in ODD else load_case(name)
    again = Case.from_dict(json.loads(json.dumps(case.as_dict())))
    assert (again, again.name, again.document) == (case, case.name, case.document)
    assert again.determinants() == case.determinants()
    assert (again.origins, again.sources) == (case.origins, case.sources)
    assert [one.value for one in again.origins] == [one.value for one in case.origins]
    for damaged in ([], {**case.as_dict(), "document": 3}, {**case.as_dict(), "beads": {}}):
        with pytest.raises(ValueError, match=":"):
            Case.from_dict(damaged)  # type: ignore[arg-type]


def test_a_new_case_names_its_schema_which_all_shipped_cases_keep(in_folder: Path) -> None:
    """And it is a case as it was without the schema."""
    assert call("new", "mine", "cluster", "--schema", check=True).stdout == "mine.toml\ncase.schema.json\n"
    first, empty, rest = Path("mine.toml").read_text().split("\n", 2)
    assert (first, empty, rest) == ("#:schema case.schema.json", "", shipped("case")["cluster"].read_text())
    assert load_case("mine").determinants() == load_case("cluster").determinants()
    schema = json.loads(Path("case.schema.json").read_text())
    assert schema["properties"].keys() == {*keys_in(Case), "library"}
    for path in shipped("case").values():
        Draft202012Validator(schema).validate(tomllib.loads(path.read_text()))
    assert "](" not in json.dumps(schema)  # links lead nowhere in an editor


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"drive.frequenzy": "80 Hz"}, "drive"),
        ({"drive.frequency": "80"}, "drive.frequency"),
        ({"drive": "80 Hz"}, "drive"),
        ({"dimers.radii": ["0.3 mm", 0.2]}, "dimers.radii.1"),
        ({"dimers.radii": ["0.3 mm"] * 3}, "dimers.radii"),
        ({"dimers.facing": "north"}, "dimers.facing"),
        ({"run.cycles": "many"}, "run.cycles"),
        ({"run.steps_per_cycle": 3}, "run"),
        ({"contact.restitution": 1.2}, "contact.restitution"),
        ({"name": "x"}, ""),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(changes: dict[str, Any], place: str) -> None:
    tables = tomllib.loads(shipped("case")["fig1b"].read_text())
    schema = Draft202012Validator(case_schema())
    schema.validate(changed(Case, tables, {"run.cycles": "auto"}))
    wrong = changed(Case, tables, changes)
    (error,) = schema.iter_errors(wrong)
    assert ".".join(map(str, error.absolute_path)) == place
    with pytest.raises(InputError):
        load_case(wrong)


# --- the library ------------------------------------------------------------------------------------------------------


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
        assert tension is None or found["surface_tension"] == pytest.approx(1e-3 * tension, rel=3e-3)

    def of(**liquid: Any) -> Case:
        return make_case(liquid={"name": "water-glycerol", "mass_fraction": 0.87, **liquid})

    case = of()
    assert case.liquid.dynamic_viscosity == pytest.approx(0.1448)  # Cheng's formula by hand
    assert case.liquid.density == pytest.approx(1227.0)
    temperature, viscosity = (origins(case)[f"liquid.{key}"] for key in ("temperature", "dynamic_viscosity"))
    assert (temperature.text, temperature.origin, "Cheng" in viscosity.source) == ("20 degC", "default", True)
    assert of(temperature="293.15 K").determinants() == case.determinants()
    assert of(temperature="25 degC").liquid.dynamic_viscosity < 0.8 * case.liquid.dynamic_viscosity


@pytest.fixture
def own(in_folder: Path) -> Path:
    """A folder with a case and the library that it takes its beads from."""
    (in_folder / "library.toml").write_text("""
[materials."my beads"]
density = { value = "2.45 g/cm^3", source = "weighed" }
youngs_modulus = { value = "2.5 GPa", source = "its data sheet" }

[[surface_pairs]]
materials = ["my beads", "glass"]
friction  = { value = 0.21, source = "tilting table", range = [0.18, 0.24] }

[[surface_pairs]]
materials = ["chrome steel", "glass"]
rolling_friction = { value = 0.0125, source = "tilting table" }
""")
    tables = document(beads={"material": "my beads"}, boundary={"material": "glass"})
    del tables["contact"]["friction"]
    (in_folder / "mine.toml").write_text(to_toml(tables))
    return in_folder


def test_a_case_takes_from_the_library_beside_it_and_keeps_what_it_took(own: Path) -> None:
    case = load_case("mine.toml")
    friction, density = (origins(case)[key] for key in ("contact.friction.bead_wall", "beads.density"))
    assert (case.beads.density, case.contact.friction.bead_wall) == (2450.0, 0.21)
    assert (density.origin, density.source) == ("own library", "library.toml, weighed")
    assert (friction.range, friction.guessed) == ((0.18, 0.24), False)
    assert origins(load_case("fig1b", {"beads.material": "my beads"}))["beads.density"].origin == "own library"
    # 50 MPa instead of its 2.5 GPa.
    assert summarise(case)["beads"]["stiffness_ratio"] == pytest.approx(0.02)
    assert "Young's modulus of the beads reduced by a factor of 50\n" in describe(summarise(case))
    (line,) = (one for one in call("library", check=True).stdout.splitlines() if "chrome steel on glass" in one)
    assert line.split("glass", 1)[1].split()[:2] == ["-", "0.0125"], "each number in its column"
    # What it took goes along: into case.json, sweeps, spreads and their archives.
    varied = spread_sweep(case, 2)
    assert "contact.friction.bead_wall" in varied.keys
    sweep = expand({"case": "mine.toml", "axes": {"dimers.replicates": [1, 2]}}, source="s", name="s", folder=own)
    (own / "library.toml").rename(own / "other.toml")
    again = Case.read(Case.from_dict(case.as_dict()).document, name="mine")
    assert (again, again.determinants()) == (case, case.determinants())
    spread = expand(varied.file, source="s", name="s", base=(varied.case_name, varied.base))
    assert {point.beads.density for points in (sweep, spread) for point in points.cases()} == {2450.0}
    with pytest.raises(InputError, match=r'beads\.material = "my beads": not in the library'):
        load_case("mine.toml")
    # A library elsewhere is named, for one call.
    assert "weighed" in call("--library", "other.toml", "show", "mine.toml", check=True).stdout
    assert "my beads  " in call("--library=other.toml", "library", check=True).stdout
    assert "my beads  " not in call("library", check=True).stdout


def test_what_a_case_describes_itself_needs_no_library() -> None:
    """By all of its numbers, whatever its name."""
    numbers = {"surface_tension": "20 mN/m", "volume_fraction": 0.02, "contact_angle": "5 deg"}
    dynamic = document(liquid={"name": "mine", **numbers, "dynamic_viscosity": "5 mPa*s"})
    kinematic = document(liquid={"name": "mine", **numbers, "kinematic_viscosity": "5 mm^2/s", "density": "1 g/cm^3"})
    for tables in (dynamic, kinematic):
        liquid = Case.read(tables).liquid.of_bridges
        assert (liquid.surface_tension, liquid.volume_fraction, liquid.viscosity) == (0.02, 0.02, 0.005)
    assert Case.read(dynamic).determinants() == Case.read(kinematic).determinants()
    assert make_case(boundary={"material": "teflon"}).boundary.material == "teflon"
