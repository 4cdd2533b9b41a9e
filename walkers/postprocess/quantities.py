"""The numbers of a result as rows of a table: what each is, its error and extremes, in the units that one reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, floor, isfinite, log10
from typing import Any

_UNITS = {"m/s": ("mm/s", 1e3), "m": ("mm", 1e3), "rad": ("°", degrees(1.0)), "share": ("%", 100.0)}
"""For units of the result, those that are shown, and how many of them one is."""
_DIGITS = 4
"""Significant, of a number without an error; with one, so many that two digits of the error are seen."""


@dataclass(frozen=True)
class Number:
    """A number of a result.

    Attributes
    ----------
    key
        Its place in the result, such as ``velocity.mean``.
    value
        SI.
    unit, factor
        In which it is shown, and how many of it the SI unit is.
    error
        What gives its digits: its standard error, or that of the number beside which it stands; None if unknown.
    """

    key: str
    value: float
    unit: str = ""
    factor: float = 1.0
    error: float | None = None

    @property
    def text(self) -> str:
        """The number in its unit, without it."""
        return rounded(self.value * self.factor, None if self.error is None else self.error * self.factor)


@dataclass(frozen=True)
class Quantity:
    """A row: what it is called, its number, its standard error, and the smallest and largest of those that it is of."""

    name: str
    value: Number | None
    error: Number | None = None
    smallest: Number | None = None
    largest: Number | None = None

    @property
    def unit(self) -> str:
        """In which all of them are shown."""
        return next((one.unit for one in (self.value, self.smallest) if one is not None), "")


def rounded(value: float, error: float | None = None) -> str:
    """A number with the digits that its error leaves (two of the error's), or four."""
    if isinstance(value, (bool, int)):
        return str(value)
    if not isfinite(value):
        return "-"
    if error and isfinite(error):
        decimals = max(0, 1 - floor(log10(abs(error))))
        if decimals <= 9:
            return f"{value:.{decimals}f}"
    return f"{value:.{_DIGITS}g}"


def number_of(result: Mapping[str, Any], key: str, unit: str = "", error: float | None = None) -> Number | None:
    """The number at a place in a result; None where it has none."""
    value: Any = result
    for part in key.split("."):
        value = value[int(part)] if isinstance(value, list) else value.get(part) if isinstance(value, dict) else None
        if value is None:
            return None
    shown, factor = _UNITS.get(unit, (unit, 1.0))
    # A whole number stays one.
    return Number(key, value, shown, 1 if factor == 1.0 else factor, error)


def quantity(result: Mapping[str, Any], name: str, key: str, unit: str = "", error_key: str = "") -> Quantity:
    """The row of a number with its error, which stands elsewhere, or of a mean over replicates with its extremes."""
    keys = [key, error_key]
    if number_of(result, f"{key}.n") is not None:
        keys = [f"{key}.{what}" for what in ("mean", "standard_error", "smallest", "largest")]
    error = number_of(result, keys[1], unit)
    doubt = None if error is None else error.value
    return Quantity(name, *(number_of(result, one, unit, None if one == error_key else doubt) for one in keys))
