"""Physical quantities: a string with its unit in, a number in SI units out.

Units are pint's. Two of its readings are wrong for this field and are caught here: its ``g`` is the gram, while the
literature on shaken grains writes accelerations in g (the paper: 1 g = 9.8 m/s²); and it takes radians for pure
numbers, so that "500 rad/s" would pass for 500 Hz.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from math import pi
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

if TYPE_CHECKING:
    from pint import UnitRegistry

ACCELERATION_OF_ONE_G = 9.8
"""m/s²; "1 g = 9.8 m/s²" in the caption of Fig. 1 of Khan et al., *Self-assembled granular walkers*."""

# pint's own expression parser reads "0,3 mm" as 0 mm and "0.3 mm; 2" as 0.6 mm: only its unit parser is used.
_NUMBER_AND_UNIT = re.compile(r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s%,;][^%,;]*)")
_GRAM_SYMBOL = re.compile(r"(?<![A-Za-z_])g(?![A-Za-z_0-9])")
_ANGLE_UNITS = frozenset({"degree", "radian", "milliradian", "arcminute", "arcsecond"})


_USUAL: Mapping[str, tuple[str, float]] = {
    **{"m": ("m", 1.0), "cm": ("m", 1e-2), "mm": ("m", 1e-3), "um": ("m", 1e-6), "µm": ("m", 1e-6), "nm": ("m", 1e-9)},
    **{"mHz": ("Hz", 1e-3), "Hz": ("Hz", 1.0), "kHz": ("Hz", 1e3)},
    **{"g": ("m/s^2", ACCELERATION_OF_ONE_G), "m/s^2": ("m/s^2", 1.0), "m/s²": ("m/s^2", 1.0)},
    **{"m/s": ("m/s", 1.0), "mm/s": ("m/s", 1e-3), "um/s": ("m/s", 1e-6), "µm/s": ("m/s", 1e-6), "nm/s": ("m/s", 1e-9)},
    **{"s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6), "µs": ("s", 1e-6), "ns": ("s", 1e-9)},
    **{"rad": ("rad", 1.0), "mrad": ("rad", 1e-3), "deg": ("rad", pi / 180.0)},
    **{"kg/m^3": ("kg/m^3", 1.0), "kg/m³": ("kg/m^3", 1.0), "g/cm^3": ("kg/m^3", 1e3), "g/cm³": ("kg/m^3", 1e3)},
    **{"N/m": ("N/m", 1.0), "mN/m": ("N/m", 1e-3)},
    **{"m^2/s": ("m^2/s", 1.0), "m²/s": ("m^2/s", 1.0), "mm^2/s": ("m^2/s", 1e-6), "mm²/s": ("m^2/s", 1e-6)},
    **{"Pa*s": ("Pa*s", 1.0), "mPa*s": ("Pa*s", 1e-3)},
    **{"kB": ("byte", 1e3), "MB": ("byte", 1e6), "GB": ("byte", 1e9)},
    **{"Pa": ("Pa", 1.0), "kPa": ("Pa", 1e3), "MPa": ("Pa", 1e6), "GPa": ("Pa", 1e9)},
}
"""What the usual units are in SI units, as pint has them too: a case that has no others need not wait for pint."""


@dataclass(frozen=True)
class Kind:
    """What a quantity is: its name, its SI unit, an example to show to a user who got it wrong, and physical bounds.

    The bounds are generous; they keep slips of the exponent out of formulas that would overflow.
    """

    name: str
    unit: str
    example: str
    largest: float
    smallest: float = 0.0

    @property
    def expectation(self) -> str:
        """The end of an error message."""
        article = "an" if self.name[0] in "aeiou" else "a"
        return f'expected {article} {self.name} with its unit, such as "{self.example}"'


@cache
def registry() -> UnitRegistry[float]:
    """Pint's registry with the ``gee`` (9.8 m/s²) added.

    Pint could keep the parsed definitions in the user's cache, a tenth of a second faster; two programs that fill that
    cache at once leave it broken for good.
    """
    import pint

    units: UnitRegistry[float] = pint.UnitRegistry()
    units.define(f"gee = {ACCELERATION_OF_ONE_G} * meter / second ** 2")
    return units


def parse_quantity(text: str, kind: Kind) -> float:
    """Read a quantity.

    Parameters
    ----------
    text
        A number with its unit, such as ``"0.3 mm"``. For an acceleration ``g`` means 9.8 m/s².
    kind
        What the quantity must be.

    Returns
    -------
    float
        The value in ``kind.unit``.

    Raises
    ------
    ValueError
        If the text is no quantity, has no unit, or has the dimension of something else.
    """
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        raise ValueError(kind.expectation)
    # Rounded: 4.0 g/cm³ is 4000 kg/m³, not 3999.9999999999995.
    value = float(f"{float(match['number']) * _si_units_in(match['unit'], kind):.15g}")
    if value != 0.0 and not kind.smallest <= abs(value) <= kind.largest:
        raise ValueError(f"{kind.expectation}; it must lie within {kind.smallest:g} and {kind.largest:g} {kind.unit}")
    return value


def _si_units_in(symbol: str, kind: Kind) -> float:
    """How many of the kind's SI unit a unit is."""
    usual = _USUAL.get(symbol)
    if usual is None:
        return si_units_by_pint(symbol, kind)
    unit, factor = usual
    if unit != kind.unit:
        raise ValueError(kind.expectation)
    return factor


@lru_cache(maxsize=1024)  # a sweep reads thousands of quantities in the same few units
def si_units_by_pint(symbol: str, kind: Kind) -> float:
    """How many of the kind's SI unit a unit is, whatever unit it is.

    Raises
    ------
    ValueError
        If it is none, or one of something else.
    """
    units = registry()
    try:
        unit = units.parse_units(_GRAM_SYMBOL.sub("gee", symbol) if kind is ACCELERATION else symbol)
        factor = float(units.Quantity(1.0, unit).to(kind.unit).magnitude)
    except Exception as error:  # pint's parser raises a dozen types, the tokenizer's errors among them
        raise ValueError(kind.expectation) from error
    if kind is ANGLE and str(unit) not in _ANGLE_UNITS:
        raise ValueError(kind.expectation)
    if kind is FILE_SIZE and str(units.Quantity(1.0, unit).to_root_units().units) != "bit":
        raise ValueError(kind.expectation)  # pint takes both bits and radians for pure numbers
    if kind is FREQUENCY and "radian" in str(units.Quantity(1.0, unit).to_root_units().units):
        raise ValueError(kind.expectation + " (cycles a second, not an angular frequency)")
    return factor


def split_quantity(text: str) -> tuple[float, str]:
    """The number and the unit of a quantity, whatever the unit is.

    Raises
    ------
    ValueError
        If the text is no number with a unit.
    """
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"no quantity: {text!r}")
    return float(match["number"]), match["unit"].strip()


def quantity_text(value: float, kind: Kind) -> str:
    """A number of SI units in the unit of the kind's example, as a case could say it."""
    unit = _NUMBER_AND_UNIT.fullmatch(kind.example)["unit"]  # type: ignore[index]
    return f"{value / _USUAL[unit][1]:.6g} {unit}"


def kind_in(annotation: Any) -> Kind | None:
    """The kind of quantity that a field of a table holds, or None."""
    if isinstance(annotation, Kind):
        return annotation
    return next((kind for one in get_args(annotation) if (kind := kind_in(one)) is not None), None)


def _validator(kind: Kind, *, positive: bool, zero: bool) -> Any:
    def validate(value: object) -> float:
        if not isinstance(value, str):
            raise PydanticCustomError("quantity", "{expected}", {"expected": kind.expectation})
        try:
            number = parse_quantity(value, kind)
        except ValueError as error:
            raise PydanticCustomError("quantity", "{expected}", {"expected": str(error)}) from error
        if positive and (number < 0 or (number == 0 and not zero)):
            bound = "zero or more" if zero else "more than zero"
            raise PydanticCustomError("quantity", "{expected}", {"expected": f"{kind.expectation}; it must be {bound}"})
        return number

    return BeforeValidator(validate)


LENGTH = Kind("length", "m", "0.3 mm", 1.0, 1e-9)
RADIUS = Kind("length", "m", "0.3 mm", 0.02, 1e-6)
FREQUENCY = Kind("frequency", "Hz", "80 Hz", 1e6, 1e-2)
ACCELERATION = Kind("acceleration", "m/s^2", "4 g", 1e6, 1e-9)
SPEED = Kind("speed", "m/s", "0.02 mm/s", 1e4, 1e-12)
TIME = Kind("time", "s", "2 us", 1.0, 1e-12)
DURATION = Kind("duration", "s", "4 s", 1e4, 1e-6)
ANGLE = Kind("angle", "rad", "10 deg", 1e3)
DENSITY = Kind("density", "kg/m^3", "4.0 g/cm^3", 1e5, 1.0)
SURFACE_TENSION = Kind("surface tension", "N/m", "19.2 mN/m", 10.0, 1e-9)
KINEMATIC_VISCOSITY = Kind("kinematic viscosity", "m^2/s", "5 mm^2/s", 10.0)
DYNAMIC_VISCOSITY = Kind("dynamic viscosity", "Pa*s", "4.6 mPa*s", 1e4)
MODULUS = Kind("modulus", "Pa", "50 MPa", 1e13, 1e3)
FILE_SIZE = Kind("size of a file", "byte", "64 MB", 1e15, 1.0)

Length = Annotated[float, LENGTH, _validator(LENGTH, positive=True, zero=False)]
Radius = Annotated[float, RADIUS, _validator(RADIUS, positive=True, zero=False)]
SignedLength = Annotated[float, LENGTH, _validator(LENGTH, positive=False, zero=True)]
Frequency = Annotated[float, FREQUENCY, _validator(FREQUENCY, positive=True, zero=False)]
Acceleration = Annotated[float, ACCELERATION, _validator(ACCELERATION, positive=True, zero=True)]
Speed = Annotated[float, SPEED, _validator(SPEED, positive=True, zero=False)]
Time = Annotated[float, TIME, _validator(TIME, positive=True, zero=False)]
Duration = Annotated[float, DURATION, _validator(DURATION, positive=True, zero=False)]
NonNegativeDuration = Annotated[float, DURATION, _validator(DURATION, positive=True, zero=True)]
Angle = Annotated[float, ANGLE, _validator(ANGLE, positive=False, zero=True)]
NonNegativeAngle = Annotated[float, ANGLE, _validator(ANGLE, positive=True, zero=True)]
Density = Annotated[float, DENSITY, _validator(DENSITY, positive=True, zero=False)]
SurfaceTension = Annotated[float, SURFACE_TENSION, _validator(SURFACE_TENSION, positive=True, zero=False)]
KinematicViscosity = Annotated[float, KINEMATIC_VISCOSITY, _validator(KINEMATIC_VISCOSITY, positive=True, zero=True)]
DynamicViscosity = Annotated[float, DYNAMIC_VISCOSITY, _validator(DYNAMIC_VISCOSITY, positive=True, zero=True)]
Modulus = Annotated[float, MODULUS, _validator(MODULUS, positive=True, zero=False)]
FileSize = Annotated[float, FILE_SIZE, _validator(FILE_SIZE, positive=True, zero=False)]
