"""Rounding of printed numbers: at most four significant digits and the decimals of their unit, in usual units."""

from __future__ import annotations

from math import degrees, floor, isfinite, log10

DIGITS = 4
"""Significant, of any number that is printed for people; JSON and tables have all of them."""
SHOWN_UNITS = {
    "J": ("nJ", 1e9),
    "m/s": ("mm/s", 1e3),
    "m": ("mm", 1e3),
    "m/s^2": ("g", 1.0 / 9.8),
    "rad": ("°", degrees(1.0)),
    "share": ("%", 100.0),
}
"""For units of a result, those that are shown, and how many of them one is."""
_DECIMALS = {"": 9, "mm/s": 3, "mm": 6, "°": 3, "deg": 3, "%": 3, "nJ": 6}
"""Most decimals of a number in a displayed unit: values, their differences and their scatter have the same resolution,
and rounding errors are printed as 0."""
_LARGEST_WRITTEN_OUT = 1e7
_LONGER = {"d": 86400.0, "h": 3600.0, "min": 60.0}


def rounded(value: float, unit: str = "") -> str:
    """A number as text: at most four significant digits, and the decimals of its unit; a dash for NaN.

    Examples
    --------
    >>> rounded(18.18654, "mm/s"), rounded(-0.002164, "mm/s"), rounded(-3.2e-15, "mm/s"), rounded(123456.0)
    ('18.19', '-0.002', '0', '123500')
    """
    if isinstance(value, (bool, int)):
        return str(value)
    if not isfinite(value):
        return "-"
    if unit in _DECIMALS:
        value = round(value, _decimals(value, _DECIMALS[unit])) + 0.0  # not -0
    text = f"{value:.{DIGITS}g}"
    return f"{float(text):.0f}" if 10**DIGITS <= abs(value) < _LARGEST_WRITTEN_OUT else text


def with_decimals(value: float, decimals: int) -> str:
    """A number with so many decimals, fewer where it would have more than four significant digits; 0 if all are zero.

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
    """Decimals of a number with at most four significant digits, so that it is rounded once."""
    value = float(f"{value:.{DIGITS}g}")
    return min(most, DIGITS - 1 - (floor(log10(abs(value))) if value else 0))


def counted(number: int, noun: str) -> str:
    """A number with its noun, such as ``2 runs``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def duration_text(seconds: float) -> str:
    """A time in the largest unit that gives at least 2, such as ``3 d``."""
    texts = (
        f"{seconds / size:.0f} {unit}" for unit, size in _LONGER.items() if seconds >= 2 * size
    )
    return next(texts, f"{seconds:.0f} s")


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.{DIGITS}g} %"
