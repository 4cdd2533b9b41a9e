"""Quantities: units of the field, and the two of pint's readings that would be wrong here."""

import subprocess
import sys

import pytest

from walkers.inputs import library
from walkers.physics import units
from walkers.physics.units import parse_quantity

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
REFUSED = {
    units.ACCELERATION: ["4 kg", "4 mg", "4 g/s"],
    units.DENSITY: ["4 g"],
    units.FREQUENCY: ["500 rad/s", "4800 rpm"],
    units.ANGLE: ["0.5", "30 percent"],
    units.LENGTH: ["4 g", "0,3 mm", "0.3 mm 0.2 mm", "__import__('os')", "nan mm", ""],
}


def test_quantities_in_si() -> None:
    for kind, texts in READ.items():
        assert {text: parse_quantity(text, kind) for text in texts} == pytest.approx(texts, rel=1e-14)


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in REFUSED.items() for text in texts])
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


def test_every_number_of_the_library_has_a_source() -> None:
    materials, liquids = map(library.material, library.materials()), map(library.liquid, library.liquids())
    known = [number for numbers in (*materials, *liquids) for number in numbers.values()]
    assert len(known) >= 20
    assert all(number.value > 0 and len(number.source) > 8 for number in known)
