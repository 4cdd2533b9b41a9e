"""Quantities: units of the field, and the two of pint's readings that would be wrong here."""

import subprocess
import sys

import pytest

from walkers.inputs import library, units
from walkers.inputs.units import parse_quantity


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("0.3 mm", units.LENGTH, 3e-4),
        ("300 µm", units.LENGTH, 3e-4),
        ("300um", units.LENGTH, 3e-4),
        ("3e-4 m", units.LENGTH, 3e-4),
        ("80 Hz", units.FREQUENCY, 80.0),
        ("0.08 kHz", units.FREQUENCY, 80.0),
        ("80 s^-1", units.FREQUENCY, 80.0),
        ("4 g", units.ACCELERATION, 39.2),
        ("4g", units.ACCELERATION, 39.2),
        ("39.2 m/s^2", units.ACCELERATION, 39.2),
        ("39.2 m/s²", units.ACCELERATION, 39.2),
        ("1 gravity", units.ACCELERATION, 9.80665),
        ("19.2 mN/m", units.SURFACE_TENSION, 0.0192),
        ("19.2 dyn/cm", units.SURFACE_TENSION, 0.0192),
        ("5 mm^2/s", units.KINEMATIC_VISCOSITY, 5e-6),
        ("5 cSt", units.KINEMATIC_VISCOSITY, 5e-6),
        ("4.6 mPa*s", units.DYNAMIC_VISCOSITY, 4.6e-3),
        ("4.6 cP", units.DYNAMIC_VISCOSITY, 4.6e-3),
        ("4.0 g/cm^3", units.DENSITY, 4000.0),
        ("50 MPa", units.MODULUS, 5e7),
        ("2 us", units.TIME, 2e-6),
        ("180 deg", units.ANGLE, 3.14159265358979),
        ("10 mrad", units.ANGLE, 0.01),
    ],
)
def test_quantities_in_si(text: str, kind: units.Kind, value: float) -> None:
    assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-14)


def test_g_is_the_acceleration_where_one_is_meant_and_the_gram_elsewhere() -> None:
    assert parse_quantity("1 g", units.ACCELERATION) == 9.8  # "1 g = 9.8 m/s²", the paper's Fig. 1
    assert parse_quantity("1 g/cm^3", units.DENSITY) == 1e3


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("4 kg", units.ACCELERATION),
        ("4 mg", units.ACCELERATION),
        ("4 g/s", units.ACCELERATION),
        ("4 g", units.LENGTH),
        ("4 g", units.DENSITY),
        ("500 rad/s", units.FREQUENCY),
        ("4800 rpm", units.FREQUENCY),
        ("0.5", units.ANGLE),
        ("30 percent", units.ANGLE),
        ("0,3 mm", units.LENGTH),
        ("0.3 mm 0.2 mm", units.LENGTH),
        ("__import__('os')", units.LENGTH),
        ("nan mm", units.LENGTH),
        ("", units.LENGTH),
    ],
)
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
from walkers.inputs import load_case, shipped_cases
print([load_case(name).name for name in shipped_cases()] and "pint" in sys.modules)
"""
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False"


@pytest.mark.parametrize("table", ["materials", "liquids"])
def test_every_number_of_the_library_has_a_source(table: str) -> None:
    names = getattr(library, table)()
    assert len(names) >= 4
    for name in names:
        numbers = library.material(name) if table == "materials" else library.liquid(name)
        assert all(known.value > 0 for known in numbers.values())
        assert all(len(known.source) > 8 for known in numbers.values())
