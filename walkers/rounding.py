"""Rounding of printed numbers: at most four significant digits and the decimals of their unit.

Numbers in JSON files and in tables keep all of their digits.
"""

from __future__ import annotations

from math import degrees, floor, isfinite, log10

DIGITS = 4
"""Largest number of significant digits of a number that is printed for people."""
SHOWN_UNITS = {
    "J": ("nJ", 1e9),
    "m/s": ("mm/s", 1e3),
    "m": ("mm", 1e3),
    "m/s^2": ("g", 1.0 / 9.8),
    "rad": ("°", degrees(1.0)),
    "share": ("%", 100.0),
}
"""For the SI unit of a result, the displayed unit and the factor that converts a number to it."""
_DECIMALS = {"": 9, "mm/s": 3, "mm": 6, "°": 3, "deg": 3, "%": 3, "nJ": 6}
"""Largest number of decimals of a number in a displayed unit.

Values, their differences and their scatter have the same resolution, and rounding errors are
printed as 0.
"""
_LARGEST_WRITTEN_OUT = 1e7
"""Larger numbers have an exponent."""
_LONG_UNITS = {"d": 86400.0, "h": 3600.0, "min": 60.0}
"""Units of time by name, s; the longest first."""


def rounded(value: float, unit: str = "") -> str:
    """A number as text.

    Parameters
    ----------
    value
        The number.
    unit
        Its unit, one of those that are shown (`SHOWN_UNITS`).

    Returns
    -------
    str
        The number with at most four significant digits, and at most the decimals of its unit; a
        dash for NaN and infinity. Integers have all of their digits.

    Examples
    --------
    >>> rounded(18.18654, "mm/s"), rounded(-0.002164, "mm/s"), rounded(-3.2e-15, "mm/s")
    ('18.19', '-0.002', '0')
    >>> rounded(123456.0)
    '123500'
    """
    if isinstance(value, (bool, int)):
        return str(value)
    if not isfinite(value):
        return "-"
    if unit in _DECIMALS:
        value = round(value, _decimals(value, _DECIMALS[unit])) + 0.0  # not -0
    text = f"{value:.{DIGITS}g}"
    if 10**DIGITS <= abs(value) < _LARGEST_WRITTEN_OUT:
        return f"{float(text):.0f}"
    return text


def with_decimals(value: float, decimals: int) -> str:
    """A number with so many decimals; 0 if all of its digits are zero.

    It has fewer decimals where it would have more than four significant digits.

    Examples
    --------
    >>> with_decimals(1.08, 3), with_decimals(18.18654, 3), with_decimals(-2e-6, 3)
    ('1.080', '18.19', '0')
    """
    if not isfinite(value):
        return "-"
    decimals = _decimals(value, decimals)
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return "0" if float(text) == 0.0 else text


def _decimals(value: float, most: int) -> int:
    """The decimals to which a number is rounded, at most ``most``; negative for tens and hundreds.

    The number then has at most four significant digits, so that it is rounded only once.
    """
    value = float(f"{value:.{DIGITS}g}")
    exponent = floor(log10(abs(value))) if value else 0
    return min(most, DIGITS - 1 - exponent)


def to_fifteen_digits(value: float) -> float:
    """The nearest number of fifteen significant digits: the one that a person would write.

    A product of decimal numbers often differs from it in its last bit.

    Examples
    --------
    >>> 4.0 * 0.001 / 1e-6, to_fifteen_digits(4.0 * 0.001 / 1e-6)
    (4000.0000000000005, 4000.0)
    """
    return float(f"{value:.15g}")


def counted(number: int, noun: str) -> str:
    """A number with its noun, such as ``2 runs``."""
    plural = "" if number == 1 else "s"
    return f"{number} {noun}{plural}"


def duration_text(seconds: float) -> str:
    """A time in the largest unit that gives at least 2, such as ``3 d``."""
    for unit, size in _LONG_UNITS.items():
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.{DIGITS}g} %"
