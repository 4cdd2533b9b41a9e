"""The library: its numbers, a user's own, what packages bring, and how all of it is listed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.conftest import call, document, origins, to_toml
from walkers.errors import InputError
from walkers.inputs.axes import number_of
from walkers.inputs.case import Case
from walkers.inputs.library import library_of
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import expand
from walkers.inputs.units import TEMPERATURE, parse_quantity
from walkers.physics.mixtures import water_glycerol
from walkers.show import describe, summarise
from walkers.sweeps.spread import spread_sweep

SHIPPED = library_of({})
OWN = """
[materials."my beads"]
density = { value = "2.45 g/cm^3", source = "weighed" }

[[surface_pairs]]
materials = ["my beads", "glass"]
friction  = { value = 0.21, source = "tilting table", range = [0.18, 0.24] }
"""


# --- the numbers ------------------------------------------------------------------------------------------------------


def test_every_number_of_the_library_has_a_source_and_defaults_lie_within_their_ranges() -> None:
    materials, liquids = SHIPPED.names("materials"), SHIPPED.names("liquids")
    known = [number for name in materials for number in SHIPPED.numbers("materials", name).values()]
    known += [number for name in liquids for number in SHIPPED.numbers("liquids", name).values()]
    assert len(known) >= 90
    assert all(number_of("", number.written) > 0 and len(number.source) > 8 for number in known)
    densities = {name: number_of("", SHIPPED.numbers("materials", name)["density"].written) for name in materials}
    assert sorted(densities, key=lambda name: densities[name])[:: len(densities) - 1] == ["polystyrene", "brass"]


# Mass fraction, °C, viscosity (mPa s; Segur and Oberstar 1951), density (g/cm³; Bosart and Snoddy 1928), both as in the
# tables of the Glycerine Producers' Association (1963), surface tension (mN/m; water by IAPWS, glycerol by CRC).
TABULATED = [
    (0.0, 20.0, 1.005, 0.99823, 72.74),
    (0.1, 20.0, 1.31, 1.02210, None),
    (0.5, 20.0, 6.00, 1.12630, None),
    (0.6, 20.0, 10.8, 1.15380, None),
    (0.8, 20.0, 60.1, 1.20850, None),
    (0.9, 20.0, 219.0, 1.23510, None),
    (1.0, 20.0, 1410.0, 1.26108, 63.0),
    (0.0, 25.0, 0.893, 0.99705, 71.97),
]


@pytest.mark.parametrize(("share", "celsius", "viscosity", "density", "tension"), TABULATED)
def test_water_and_glycerol_as_tabulated(
    share: float, celsius: float, viscosity: float, density: float, tension: float | None
) -> None:
    found = water_glycerol(share, celsius + 273.15)
    assert found["dynamic_viscosity"] == pytest.approx(1e-3 * viscosity, rel=0.03)
    assert found["density"] == pytest.approx(1e3 * density, rel=5e-4)
    if tension is not None:
        assert found["surface_tension"] == pytest.approx(1e-3 * tension, rel=3e-3)


def test_a_mixture_follows_its_fraction_and_temperature() -> None:
    def of(**liquid: Any) -> Case:
        tables = document(liquid={"name": "water-glycerol", "mass_fraction": 0.87, **liquid})
        return Case.read(tables, name="mixed")

    case = of()
    assert case.liquid.dynamic_viscosity == pytest.approx(0.1448)  # Cheng's formula by hand
    assert case.liquid.density == pytest.approx(1227.0)
    temperature, viscosity = (origins(case)[f"liquid.{key}"] for key in ("temperature", "dynamic_viscosity"))
    assert (temperature.text, temperature.origin) == ("20 degC", "default")
    assert "Cheng" in viscosity.source
    assert of(temperature="293.15 K").determinants() == case.determinants()
    assert of(temperature="25 degC").liquid.dynamic_viscosity < 0.8 * case.liquid.dynamic_viscosity
    assert Case.from_dict(case.as_dict()) == case
    assert parse_quantity("20 °C", TEMPERATURE) == 293.15
    for liquid, told in (
        ({"mass_fraction": 87}, "liquid.mass_fraction = 87: expected the mass of the glycerol over"),
        ({"temperature": 20}, 'liquid.temperature = 20: expected a temperature with its unit, such as "20 degC"'),
        ({"temperature": "68 degF"}, "expected a temperature"),
        ({"name": "water"}, 'liquid.mass_fraction = 0.87: expected none: it is for name = "water-glycerol"'),
    ):
        with pytest.raises(InputError) as caught:
            of(**liquid)
        assert told in str(caught.value)


# --- a user's own -----------------------------------------------------------------------------------------------------


@pytest.fixture
def own(in_folder: Path) -> Path:
    """A folder with a case and the library that it takes its beads from."""
    (in_folder / "library.toml").write_text(OWN)
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
    # What it took goes along: into case.json, sweeps, spreads and their archives.
    varied = spread_sweep(case, 2)
    assert "contact.friction.bead_wall" in varied.keys
    sweep = expand({"case": "mine.toml", "axes": {"dimers.replicates": [1, 2]}}, source="s", name="s", folder=own)
    (own / "library.toml").unlink()
    again = Case.read(Case.from_dict(case.as_dict()).document, name="mine")
    assert (again, again.determinants()) == (case, case.determinants())
    assert [point.beads.density for point in sweep.cases()] == [2450.0, 2450.0]
    spread = expand({**varied.file, "case": "mine.toml"}, source="s", name="s", folder=own)
    assert [point.beads.density for point in spread.cases()] == [2450.0, 2450.0]
    with pytest.raises(InputError, match=r'beads\.material = "my beads": not in the library'):
        load_case("mine.toml")


def test_beads_are_as_much_softer_as_their_own_library_says() -> None:
    """50 MPa instead of the 2.5 GPa of a material of one's own: a factor of 50."""
    own = {"materials": {"resin": {"density": {"value": "1.2 g/cm^3", "source": "weighed"}}}}
    own["materials"]["resin"]["youngs_modulus"] = {"value": "2.5 GPa", "source": "its data sheet"}
    tables = {**document(beads={"material": "resin"}), "library": own}
    summary = summarise(Case.read(tables, name="soft"))
    assert summary["beads"]["stiffness_ratio"] == pytest.approx(0.02)
    assert "Young's modulus of the beads reduced by a factor of 50\n" in describe(summary)


def test_a_liquid_of_ones_own_is_described_in_the_case() -> None:
    """By all of its numbers, whatever its name; each that is missing is told."""
    numbers = {"surface_tension": "20 mN/m", "volume_fraction": 0.02, "contact_angle": "5 deg"}
    dynamic = document(liquid={"name": "mine", **numbers, "dynamic_viscosity": "5 mPa*s"})
    kinematic = document(liquid={"name": "mine", **numbers, "kinematic_viscosity": "5 mm^2/s", "density": "1 g/cm^3"})
    for tables in (dynamic, kinematic):
        liquid = Case.read(tables).liquid.of_bridges
        assert (liquid.surface_tension, liquid.volume_fraction, liquid.viscosity) == (0.02, 0.02, 0.005)
    assert Case.read(dynamic).determinants() == Case.read(kinematic).determinants()
    for missing in ("surface_tension", "dynamic_viscosity"):
        del dynamic["liquid"][missing]
        with pytest.raises(InputError, match=r'liquid\.name = "mine": not in the library'):
            Case.read(dynamic)
    del dynamic["liquid"]["name"]
    with pytest.raises(InputError) as caught:
        Case.read(dynamic)
    assert [one.key for one in caught.value.problems] == ["liquid.surface_tension", "liquid.dynamic_viscosity"]


def test_a_library_elsewhere_is_named(own: Path) -> None:
    (own / "library.toml").rename(own / "other.toml")
    assert "weighed" in call("--library", "other.toml", "show", "mine.toml", check=True).stdout
    assert "my beads  " in call("--library=other.toml", "library", check=True).stdout
    assert "my beads  " not in call("library", check=True).stdout, "it is for one call"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("materials = 3", "materials = 3: expected a table [materials]"),
        ('[materials.mine]\ndensity = "2 g/cm^3"', 'density = "2 g/cm^3": expected { value = ..., source = "..." }'),
        ('[materials.mine]\ndensity = { value = "2 g/cm^3" }', 'density.source: missing; expected such as "weighed"'),
        ('[materials.mine]\ndensity = { value = 2, source = "x" }', "density.value = 2: expected a density with its"),
        ("[material.mine]", 'material = {"mine": {}}: unknown key'),
        ('[materials.glass]\ndensity = { value = "2 g/cm^3", source = "x" }', "materials.glass: is in the library of"),
        ('[[surface_pairs]]\nmaterials = ["glass", "ruby"]', "surface_pairs[0] = glass on ruby: is in the library of"),
        (
            '[materials.m]\ndensity = { value = "2 g/cm^3", source = "x", range = ["3 g/cm^3", "1 g/cm^3"] }',
            'materials.m.density.range = ["3 g/cm^3", "1 g/cm^3"]: expected the lower end first',
        ),
        (
            '[materials.m]\ndensity = { value = "2 g/cm^3", source = "x", range = ["3 g/cm^3", "4 g/cm^3"] }',
            'materials.m.density.range = ["3 g/cm^3", "4 g/cm^3"]: expected two ends with the value between them',
        ),
        (
            '[materials.m]\ndensity = { value = "2 g/cm^3", source = "x", range = ["1 g/cm^3"] }',
            'materials.m.density.range = ["1 g/cm^3"]: has 1 value; expected 2, such as "4.0 g/cm^3"',
        ),
        (
            '[[surface_pairs]]\nmaterials = ["glas", "zirconia"]',
            'surface_pairs[0].materials = "glas": not in the library; expected one of ruby, glass',
        ),
        (
            '[[surface_pairs]]\nmaterials = ["glass", "brass"]\n[[surface_pairs]]\nmaterials = ["brass", "glass"]',
            "surface_pairs[1] = brass on glass: is given twice",
        ),
        (
            'file = "/etc/passwd"',
            'file = "/etc/passwd": unknown key; a library takes materials, liquids, surface_pairs',
        ),
        (
            '[materials."a\\u001b[31m"]\ndensity = { value = "2 g/cm^3", source = "x" }',
            "materials.a\\x1b[31m: expected printable text on one line",
        ),
        (
            '[materials.a]\ndensity = { value = "2 g/cm^3", source = "" }',
            'materials.a.density.source = "": expected printable text on one line',
        ),
        (
            '[materials.a]\ndensity = { value = "2 g/cm^3", source = "x\\u001b[31m" }',
            'materials.a.density.source = "x\\u001b[31m": expected printable text on one line',
        ),
    ],
)
def test_a_library_that_is_none_is_one_message(own: Path, text: str, told: str) -> None:
    (own / "library.toml").write_text(text)
    for command in (("show", "mine.toml"), ("library",)):
        done = call(*command)
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
        assert "library.toml: " in done.stderr
        assert done.stderr.rstrip("\n").isprintable()
        assert told in done.stderr


def test_a_library_within_a_case_is_checked_as_a_file_is() -> None:
    pair = {"materials": ["rubby", "chromium-coated glass"], "friction": {"value": 0.2, "source": "measured"}}
    told = r'library\.surface_pairs\[0\]\.materials = "rubby": not in the library.*did you mean "ruby"'
    with pytest.raises(InputError, match=told):
        Case.read(document(library={"surface_pairs": [pair]}))


@pytest.mark.parametrize(
    "viscosity", [{"dynamic_viscosity": "5 mPa*s"}, {"kinematic_viscosity": "5 mm^2/s", "density": "1 g/cm^3"}]
)
def test_a_liquid_of_ones_own_needs_no_library(viscosity: dict[str, str]) -> None:
    case = Case.read(document(liquid={"name": "mine", "surface_tension": "30 mN/m", **viscosity}))
    assert case.liquid.name == "mine"
    assert (case.liquid.surface_tension, case.liquid.dynamic_viscosity) == pytest.approx((0.03, 5e-3))


def test_each_number_stands_in_its_column(in_folder: Path) -> None:
    number = '{ value = 0.0125, source = "tilting table" }'
    pair = f'[[surface_pairs]]\nmaterials = ["chrome steel", "glass"]\nrolling_friction = {number}\n'
    (in_folder / "library.toml").write_text(pair)
    (line,) = (one for one in call("library", check=True).stdout.splitlines() if "chrome steel on glass" in one)
    assert line.split("glass", 1)[1].split()[:2] == ["-", "0.0125"]
