"""Physical quantities: strings with units are read as numbers in SI units.

Units are those of pint, with two exceptions. Accelerations in ``g`` are in units of 9.8 m/s² (the paper), not grams.
Radians are not pure numbers, so that "500 rad/s" is not read as 500 Hz.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from math import isfinite, pi
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema
from pydantic_core.core_schema import (
    no_info_before_validator_function,
    with_info_before_validator_function,
)

if TYPE_CHECKING:
    from pint import UnitRegistry

ACCELERATION_OF_ONE_G = 9.8
"""m/s²; "1 g = 9.8 m/s²" in the caption of Fig. 1 of Khan et al., *Self-assembled granular walkers*."""

# pint's own expression parser reads "0,3 mm" as 0 mm and "0.3 mm; 2" as 0.6 mm: only its unit parser is used.
_NUMBER_AND_UNIT = re.compile(
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s%,;][^%,;]*)"
)
_PATTERN = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[^\d\s%,;]"  # the begin of a quantity, for editors
_GRAM_SYMBOL = re.compile(r"(?<![A-Za-z_])g(?![A-Za-z_0-9])")
_ANGLE_UNITS = frozenset({"degree", "radian", "milliradian", "arcminute", "arcsecond"})
_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_PREFIXED = ("m", "Hz", "m/s", "s", "rad", "N/m", "Pa*s", "Pa")
_USUAL: Mapping[str, tuple[str, float]] = {
    **{
        f"{prefix}{unit}": (unit, factor)
        for unit in _PREFIXED
        for prefix, factor in _PREFIXES.items()
    },
    **{"cm": ("m", 1e-2), "deg": ("rad", pi / 180.0)},
    **{"g": ("m/s^2", ACCELERATION_OF_ONE_G), "m/s^2": ("m/s^2", 1.0), "m/s²": ("m/s^2", 1.0)},
    **{
        "kg/m^3": ("kg/m^3", 1.0),
        "kg/m³": ("kg/m^3", 1.0),
        "g/cm^3": ("kg/m^3", 1e3),
        "g/cm³": ("kg/m^3", 1e3),
    },
    **{
        "m^2/s": ("m^2/s", 1.0),
        "m²/s": ("m^2/s", 1.0),
        "mm^2/s": ("m^2/s", 1e-6),
        "mm²/s": ("m^2/s", 1e-6),
    },
}
"""Usual units in SI units, as in pint; cases with only these units do not import pint."""
_ZEROS: Mapping[str, float] = {"K": 0.0, "degC": 273.15, "°C": 273.15}
"""Zero points of temperature units, K."""


@dataclass(frozen=True)
class QuantityKind:
    """Kind of a quantity: name, SI unit, example for messages, and wide physical bounds of its magnitude.

    ``sign`` is the accepted one in files: ``more than zero``, ``zero or more``, or anything. As an annotation of a
    float, a kind makes pydantic read text with a unit.
    """

    name: str
    unit: str
    example: str
    largest: float
    smallest: float = 0.0
    sign: str = ""

    @property
    def expectation(self) -> str:
        """The end of an error message."""
        article = "an" if self.name[0] in "aeiou" else "a"
        return f'expected {article} {self.name} with its unit, such as "{self.example}"'

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return with_info_before_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """A text with a unit, for editors that check case files."""
        return {
            "type": "string",
            "pattern": _PATTERN,
            "description": self.expectation,
            "examples": [self.example],
        }

    def _read(self, value: object, validation: ValidationInfo) -> object:
        if not isinstance(value, str):
            if validation.context == WRITTEN:
                raise ValueError(self.expectation)
            return value
        number = parse_quantity(value, self)
        if (self.sign and number < 0.0) or (number == 0.0 and self.sign == POSITIVE):
            raise ValueError(f"{self.expectation}; it must be {self.sign}")
        return number


def parse_quantity(text: str, kind: QuantityKind) -> float:
    """Read a quantity of a kind, such as ``"0.3 mm"``, in SI units; raises `ValueError` if it is something else."""
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        raise ValueError(kind.expectation)
    symbol, zero = match["unit"], _ZEROS.get(match["unit"], 0.0)
    of_temperature = kind.unit == TEMPERATURE.unit and symbol in _ZEROS
    usual = (kind.unit, 1.0) if of_temperature else _USUAL.get(symbol)
    unit, factor = usual or (kind.unit, _by_pint(symbol, kind))
    if unit != kind.unit:
        raise ValueError(kind.expectation)
    # Rounded: 4.0 g/cm³ is 4000 kg/m³, not 3999.9999999999995.
    value = float(f"{float(match['number']) * factor + zero:.15g}")
    if value != 0.0 and not kind.smallest <= abs(value) <= kind.largest:
        low, high = (
            f"{float(f'{(bound - zero) / factor:.4g}'):g}"
            for bound in (kind.smallest, kind.largest)
        )
        raise ValueError(f"{kind.expectation}; it must lie between {low} and {high} {symbol}")
    return value


@cache
def _registry() -> UnitRegistry[float]:
    """Pint's registry with the ``gee`` (9.8 m/s²) added.

    Not cached in files: two programs that fill pint's cache at once break it permanently.
    """
    import pint

    units: UnitRegistry[float] = pint.UnitRegistry()
    units.define(f"gee = {ACCELERATION_OF_ONE_G} * meter / second ** 2")
    return units


@lru_cache(maxsize=1024)  # a sweep reads thousands of quantities in the same few units
def _by_pint(symbol: str, kind: QuantityKind) -> float:
    """Conversion factor of an unusual unit to the SI unit of the kind."""
    if kind.unit == TEMPERATURE.unit:
        raise ValueError(kind.expectation)
    units = _registry()
    try:
        unit = units.parse_units(
            _GRAM_SYMBOL.sub("gee", symbol) if kind.unit == ACCELERATION.unit else symbol
        )
        factor = float(units.Quantity(1.0, unit).to(kind.unit).magnitude)
        root = str(units.Quantity(1.0, unit).to_root_units().units)
    except (
        Exception
    ) as error:  # pint's parser raises a dozen types, the tokenizer's errors among them
        raise ValueError(kind.expectation) from error
    # Pint treats radians as pure numbers.
    if kind.unit == ANGLE.unit and str(unit) not in _ANGLE_UNITS:
        raise ValueError(kind.expectation)
    if kind.unit == FREQUENCY.unit and "radian" in root:
        raise ValueError(kind.expectation + " (cycles per second, not an angular frequency)")
    return factor


def as_quantity(value: Any) -> tuple[float, str | None] | None:
    """A value as number and unit (None: a plain number); None if it is not a finite number."""
    match = _NUMBER_AND_UNIT.fullmatch(value.strip()) if isinstance(value, str) else None
    if not match and (isinstance(value, bool) or not isinstance(value, (int, float))):
        return None
    with suppress(OverflowError):  # an integer of hundreds of digits
        number, unit = (
            (float(match["number"]), match["unit"].strip()) if match else (float(value), None)
        )
        return (number, unit) if isfinite(number) else None
    return None


def quantity_text(value: float, kind: QuantityKind) -> str:
    """A number in SI units as text in the unit of the kind's example."""
    unit = _NUMBER_AND_UNIT.fullmatch(kind.example)["unit"]  # type: ignore[index]
    return f"{(value - _ZEROS.get(unit, 0.0)) / _USUAL.get(unit, ('', 1.0))[1]:.6g} {unit}"


def kind_in(annotations: Iterable[Any]) -> QuantityKind | None:
    """The kind of quantity that a field of a table holds, by its metadata and annotation; or None."""
    for annotation in annotations:
        if (
            kind := annotation
            if isinstance(annotation, QuantityKind)
            else kind_in(get_args(annotation))
        ) is not None:
            return kind
    return None


POSITIVE, NOT_NEGATIVE = "more than zero", "zero or more"
WRITTEN = "written"
"""Context for the validation of user input, which refuses quantities without units."""

LENGTH = QuantityKind("length", "m", "0.3 mm", 1.0, 1e-9, POSITIVE)
FREQUENCY = QuantityKind("frequency", "Hz", "80 Hz", 1e6, 1e-2, POSITIVE)
ACCELERATION = QuantityKind("acceleration", "m/s^2", "4 g", 1e4, 1e-9, NOT_NEGATIVE)
SPEED = QuantityKind("speed", "m/s", "0.02 mm/s", 1e4, 1e-12, POSITIVE)
TIME = QuantityKind("time", "s", "2 us", 1.0, 1e-12, POSITIVE)
DURATION = QuantityKind("duration", "s", "4 s", 1e4, 1e-6, POSITIVE)
ANGLE = QuantityKind("angle", "rad", "10 deg", 1e3)
DENSITY = QuantityKind("density", "kg/m^3", "4.0 g/cm^3", 1e5, 1.0, POSITIVE)
SURFACE_TENSION = QuantityKind("surface tension", "N/m", "19.2 mN/m", 10.0, 1e-9, POSITIVE)
KINEMATIC_VISCOSITY = QuantityKind(
    "kinematic viscosity", "m^2/s", "5 mm^2/s", 10.0, sign=NOT_NEGATIVE
)
DYNAMIC_VISCOSITY = QuantityKind("dynamic viscosity", "Pa*s", "4.6 mPa*s", 1e4, sign=NOT_NEGATIVE)
MODULUS = QuantityKind("modulus", "Pa", "50 MPa", 1e13, 1e3, POSITIVE)
TEMPERATURE = QuantityKind("temperature", "K", "20 degC", 373.15, 273.15)

Length = Annotated[float, LENGTH]
Radius = Annotated[float, replace(LENGTH, largest=0.02, smallest=1e-6)]
Diameter = Annotated[float, replace(LENGTH, largest=0.04, smallest=2e-6)]
SignedLength = Annotated[float, replace(LENGTH, sign="")]
Position = tuple[SignedLength, SignedLength, SignedLength]
Frequency = Annotated[float, FREQUENCY]
Acceleration = Annotated[float, ACCELERATION]
Speed = Annotated[float, SPEED]
Time = Annotated[float, TIME]
Duration = Annotated[float, DURATION]
NonNegativeDuration = Annotated[float, replace(DURATION, sign=NOT_NEGATIVE)]
Angle = Annotated[float, ANGLE]
NonNegativeAngle = Annotated[float, replace(ANGLE, sign=NOT_NEGATIVE)]
UpToRightAngle = Annotated[float, replace(ANGLE, largest=1.5708, sign=NOT_NEGATIVE)]
Density = Annotated[float, DENSITY]
SurfaceTension = Annotated[float, SURFACE_TENSION]
KinematicViscosity = Annotated[float, KINEMATIC_VISCOSITY]
DynamicViscosity = Annotated[float, DYNAMIC_VISCOSITY]
Temperature = Annotated[float, TEMPERATURE]


def is_auto(value: object) -> bool:
    """Whether a value is the word "auto"."""
    return isinstance(value, str) and value.strip().lower() == "auto"


class _Auto:
    """Reads "auto" as None."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return no_info_before_validator_function(
            lambda value: None if is_auto(value) else value, handler(source)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [handler(schema), {"const": "auto"}]}


AUTO = _Auto()
Flag = Annotated[bool, Field(strict=True)]
Whole = Annotated[int, Field(strict=True)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""TOML's integers and floats only: neither "0.3" nor true is a coefficient."""
Coefficient = Annotated[Number, Field(ge=0, le=1e3)]
