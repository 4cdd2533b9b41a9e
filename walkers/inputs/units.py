"""Physical quantities: strings with units are read as numbers in SI units.

Units are those of pint, with two exceptions. Accelerations in ``g`` are in units of 9.8 m/s² (the
paper), not grams. Radians are not pure numbers, so that "500 rad/s" is not read as 500 Hz.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
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

from walkers.rounding import to_fifteen_digits

if TYPE_CHECKING:
    from pint import UnitRegistry

ACCELERATION_OF_ONE_G = 9.8
"""m/s²; "1 g = 9.8 m/s²" (caption of Fig. 1 of Khan et al., *Self-assembled granular walkers*)."""

# Only pint's unit parser is used: its parser of expressions reads "0,3 mm" as 0 mm and "0.3 mm; 2"
# as 0.6 mm.
_NUMBER_AND_UNIT = re.compile(
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s%,;][^%,;]*)"
)
_PATTERN = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*[^\d\s%,;]"
"""Start of a quantity, for editors."""
_GRAM_SYMBOL = re.compile(r"(?<![A-Za-z_])g(?![A-Za-z_0-9])")
"""The unit g alone, as in "g" or "m*g", but not in "kg"."""
_EXPONENT = re.compile(r"([A-Za-z])([23])\b")
"""An exponent without its sign, as in "m/s2"."""
_ANGLE_UNITS = frozenset({"degree", "radian", "milliradian", "arcminute", "arcsecond"})
"""Pint's names of the units of angles."""
_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
"""Prefixes of units and their factors."""
_PREFIXED = ("m", "Hz", "m/s", "s", "rad", "N/m", "Pa*s", "Pa")
"""Units that usually have prefixes."""


def _usual_units() -> dict[str, tuple[str, float]]:
    """Usual units with their SI units and their values in these, as in pint."""
    units = {
        "cm": ("m", 1e-2),
        "deg": ("rad", pi / 180.0),
        "g": ("m/s^2", ACCELERATION_OF_ONE_G),
        "m/s^2": ("m/s^2", 1.0),
        "m/s²": ("m/s^2", 1.0),
        "kg/m^3": ("kg/m^3", 1.0),
        "kg/m³": ("kg/m^3", 1.0),
        "g/cm^3": ("kg/m^3", 1e3),
        "g/cm³": ("kg/m^3", 1e3),
        "m^2/s": ("m^2/s", 1.0),
        "m²/s": ("m^2/s", 1.0),
        "mm^2/s": ("m^2/s", 1e-6),
        "mm²/s": ("m^2/s", 1e-6),
    }
    for unit in _PREFIXED:
        for prefix, factor in _PREFIXES.items():
            units[f"{prefix}{unit}"] = (unit, factor)
            units[f"{prefix}{unit.replace('*', ' ')}"] = (unit, factor)
    return units


_USUAL: Mapping[str, tuple[str, float]] = _usual_units()
"""Usual units; a case with only these units does not import pint, which takes time."""
_ZEROS: Mapping[str, float] = {"K": 0.0, "degC": 273.15, "°C": 273.15}
"""Zero points of temperature units, K."""


_SYMBOLS: Mapping[re.Pattern[str], str] = {
    re.compile(r"(?<=\d )u(?=(m|s|N|g|J)\b)"): "µ",
    re.compile(r"(?<=[ /])([a-z]{1,2})\^2\b"): r"\1²",
    re.compile(r"(?<=[ /])([a-z]{1,2})\^3\b"): r"\1³",
    re.compile(r"(?<=Pa)\*(?=s\b)"): " ",
}
"""What stands for symbols in case files, and the symbols (`with_symbols`)."""


@dataclass(frozen=True)
class QuantityKind:
    """Kind of a quantity. As an annotation of a float, it makes pydantic read text with a unit.

    Attributes
    ----------
    name
        Its name in messages.
    unit
        Its SI unit.
    example
        An example for messages.
    largest
        Wide physical bound of its magnitude, in the SI unit.
    smallest
        Lower bound of its magnitude, except for zero.
    sign
        The sign that files may have: `POSITIVE`, `NOT_NEGATIVE`, or empty for any.
    """

    name: str
    unit: str
    example: str
    largest: float
    smallest: float = 0.0
    sign: str = ""

    @property
    def expectation(self) -> str:
        """What a message says is expected."""
        article = "an" if self.name[0] in "aeiou" else "a"
        return f'expected {article} {self.name} with its unit, such as "{self.example}"'

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return with_info_before_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The JSON schema, for editors that check case files: text with a unit."""
        return {
            "type": "string",
            "pattern": _PATTERN,
            "description": self.expectation,
            "examples": [self.example],
        }

    def _read(self, value: object, validation: ValidationInfo) -> object:
        """Text with a unit as a number; a number stays as it is, but a user must give a unit."""
        if not isinstance(value, str):
            if validation.context == WRITTEN:
                raise ValueError(self.expectation)
            return value
        number = parse_quantity(value, self)
        if (self.sign and number < 0.0) or (number == 0.0 and self.sign == POSITIVE):
            raise ValueError(f"{self.expectation}; it must be {self.sign}")
        return number


def parse_quantity(text: str, kind: QuantityKind) -> float:
    """Read a quantity of a kind, such as ``"0.3 mm"``.

    Parameters
    ----------
    text
        A number with its unit.
    kind
        The kind that it must have.

    Returns
    -------
    float
        The number in SI units.

    Raises
    ------
    ValueError
        If the text is not a quantity of this kind, or is beyond the bounds of the kind.
    """
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None:
        raise ValueError(kind.expectation)
    symbol = match["unit"]
    factor = _factor_of(symbol, kind)
    zero = _ZEROS.get(symbol, 0.0)
    # Rounded: 4.0 g/cm³ is 4000 kg/m³, not 3999.9999999999995.
    value = to_fifteen_digits(float(match["number"]) * factor + zero)
    if value != 0.0 and not kind.smallest <= abs(value) <= kind.largest:
        low = _bound_text(kind.smallest, factor, zero)
        high = _bound_text(kind.largest, factor, zero)
        raise ValueError(f"{kind.expectation}; it must lie between {low} and {high} {symbol}")
    return value


def _factor_of(symbol: str, kind: QuantityKind) -> float:
    """The value of a unit in the SI unit of a kind; `ValueError` for a unit of another kind.

    It is 1 for kelvins and degrees Celsius, whose zero points are in `_ZEROS`.
    """
    if kind.unit == TEMPERATURE.unit and symbol in _ZEROS:
        return 1.0
    usual = _USUAL.get(symbol)
    if usual is None:
        return _factor_by_pint(symbol, kind)
    unit, factor = usual
    if unit != kind.unit:
        raise ValueError(kind.expectation)
    return factor


def unit_factor(unit: str, target: str) -> float:
    """How many of a target unit one unit is, such as 1000 mm/s in a m/s.

    Parameters
    ----------
    unit
        A unit as a user writes it, such as ``um/s``, ``m/s2`` or ``°``; empty for pure numbers.
    target
        A unit of the same kind. If it is an acceleration, g is 9.8 m/s², not the gram.

    Raises
    ------
    ValueError
        If the unit does not exist or is of another kind, or both are temperatures with different
        zeros.

    Examples
    --------
    >>> unit_factor("cm/s", "mm/s"), unit_factor("m/s2", "m/s^2"), unit_factor("%", "")
    (10.0, 1.0, 0.01)
    """
    unit = _EXPONENT.sub(r"\1^\2", unit.strip())
    if unit == target:
        return 1.0
    if _ZEROS.get(unit) != _ZEROS.get(target):
        raise ValueError(f"expected {target}")
    usual = _USUAL.get(unit)
    usual_target = _USUAL.get(target)
    if usual and usual_target and usual[0] == usual_target[0]:
        return to_fifteen_digits(usual[1] / usual_target[1])
    return _ratio_by_pint(unit, target)


def _ratio_by_pint(unit: str, target: str) -> float:
    """The value of an unusual unit in another one; errors are those of `unit_factor`."""
    units = _registry()
    expected = f"expected {target or 'no unit'}, or a unit of the same kind"
    symbols = [unit, target]
    if _USUAL.get(target, ("", 1.0))[0] == ACCELERATION.unit:
        symbols = [_GRAM_SYMBOL.sub("gee", symbol) for symbol in symbols]
    try:
        source, goal = [units.Quantity(1.0, units.parse_units(symbol)) for symbol in symbols]
        factor = float(source.to(goal.units).magnitude)
        roots = [str(quantity.to_root_units().units) for quantity in (source, goal)]
    except Exception as error:
        # As in `_factor_by_pint`.
        raise ValueError(expected) from error
    # Pint treats radians as pure numbers.
    if ("radian" in roots[0]) != ("radian" in roots[1]):
        raise ValueError(expected)
    return to_fifteen_digits(factor)


def _bound_text(bound: float, factor: float, zero: float) -> str:
    """A bound in SI units as text in another unit, rounded to four digits."""
    rounded = f"{(bound - zero) / factor:.4g}"
    return f"{float(rounded):g}"


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
def _factor_by_pint(symbol: str, kind: QuantityKind) -> float:
    """The value of an unusual unit in the SI unit of a kind."""
    if kind.unit == TEMPERATURE.unit:
        raise ValueError(kind.expectation)
    units = _registry()
    if kind.unit == ACCELERATION.unit:
        symbol = _GRAM_SYMBOL.sub("gee", symbol)
    try:
        unit = units.parse_units(symbol)
        factor = float(units.Quantity(1.0, unit).to(kind.unit).magnitude)
        root = str(units.Quantity(1.0, unit).to_root_units().units)
    except Exception as error:
        # Pint's parser raises a dozen types of errors, those of Python's tokenizer among them.
        raise ValueError(kind.expectation) from error
    # Pint treats radians as pure numbers.
    if kind.unit == ANGLE.unit and str(unit) not in _ANGLE_UNITS:
        raise ValueError(kind.expectation)
    if kind.unit == FREQUENCY.unit and "radian" in root:
        raise ValueError(kind.expectation + " (cycles per second, not an angular frequency)")
    return factor


def as_quantity(value: Any) -> tuple[float, str | None] | None:
    """A value as number and unit (None: a plain number); None if it is not a finite number."""
    unit = None
    if isinstance(value, str):
        match = _NUMBER_AND_UNIT.fullmatch(value.strip())
        if match is None:
            return None
        number = float(match["number"])
        unit = match["unit"].strip()
    elif isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    else:
        try:
            number = float(value)
        except OverflowError:  # an integer of hundreds of digits
            return None
    if not isfinite(number):
        return None
    return number, unit


def quantity_text(value: float, kind: QuantityKind) -> str:
    """A number in SI units as text in the unit of the kind's example."""
    unit = _NUMBER_AND_UNIT.fullmatch(kind.example)["unit"]  # type: ignore[index]
    zero = _ZEROS.get(unit, 0.0)
    _, factor = _USUAL.get(unit, ("", 1.0))
    return f"{(value - zero) / factor:.6g} {unit}"


def with_symbols(text: str) -> str:
    """Quantities as a physicist writes them, for people; `parse_quantity` reads both forms.

    Examples
    --------
    >>> with_symbols("70 um, 0.92 g/cm^3, 4.6 mPa*s, 9.8 m/s^2")
    '70 µm, 0.92 g/cm³, 4.6 mPa s, 9.8 m/s²'
    """
    for written, symbol in _SYMBOLS.items():
        text = written.sub(symbol, text)
    return text


def unit_with_symbols(unit: str) -> str:
    """A unit of case files as a physicist writes it.

    Examples
    --------
    >>> unit_with_symbols("um"), unit_with_symbols("g/cm^3"), unit_with_symbols("Hz")
    ('µm', 'g/cm³', 'Hz')
    """
    return with_symbols(f"1 {unit}").removeprefix("1 ")


def kind_in(annotations: Iterable[Any]) -> QuantityKind | None:
    """The kind of quantity of a field, by its metadata and annotation; None if it has none."""
    for annotation in annotations:
        if isinstance(annotation, QuantityKind):
            return annotation
        kind = kind_in(get_args(annotation))
        if kind is not None:
            return kind
    return None


POSITIVE = "more than zero"
"""Sign of a quantity, as messages say it."""
NOT_NEGATIVE = "zero or more"
"""Sign of a quantity, as messages say it."""
WRITTEN = "written"
"""Context for the validation of user input, which refuses quantities without units."""

LENGTH = QuantityKind("length", "m", "0.3 mm", largest=1.0, smallest=1e-9, sign=POSITIVE)
FREQUENCY = QuantityKind("frequency", "Hz", "80 Hz", largest=1e6, smallest=1e-2, sign=POSITIVE)
ACCELERATION = QuantityKind(
    "acceleration", "m/s^2", "4 g", largest=1e4, smallest=1e-9, sign=NOT_NEGATIVE
)
SPEED = QuantityKind("speed", "m/s", "0.02 mm/s", largest=1e4, smallest=1e-12, sign=POSITIVE)
TIME = QuantityKind("time", "s", "2 us", largest=1.0, smallest=1e-12, sign=POSITIVE)
DURATION = QuantityKind("duration", "s", "4 s", largest=1e4, smallest=1e-6, sign=POSITIVE)
ANGLE = QuantityKind("angle", "rad", "10 deg", largest=1e3)
DENSITY = QuantityKind("density", "kg/m^3", "4.0 g/cm^3", largest=1e5, smallest=1.0, sign=POSITIVE)
SURFACE_TENSION = QuantityKind(
    "surface tension", "N/m", "19.2 mN/m", largest=10.0, smallest=1e-9, sign=POSITIVE
)
KINEMATIC_VISCOSITY = QuantityKind(
    "kinematic viscosity", "m^2/s", "5 mm^2/s", largest=10.0, sign=NOT_NEGATIVE
)
DYNAMIC_VISCOSITY = QuantityKind(
    "dynamic viscosity", "Pa*s", "4.6 mPa*s", largest=1e4, sign=NOT_NEGATIVE
)
MODULUS = QuantityKind("modulus", "Pa", "50 MPa", largest=1e13, smallest=1e3, sign=POSITIVE)
TEMPERATURE = QuantityKind("temperature", "K", "20 degC", largest=373.15, smallest=273.15)

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
