"""The units of tables that are written for people: SI units, or those of printed results."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Literal

from walkers.errors import expected_of, input_error
from walkers.rounding import SHOWN_UNITS, to_fifteen_digits

if TYPE_CHECKING:
    import pandas as pd

UnitSystem = Literal["SI", "mm"]
"""Systems of units: SI, or mm, mm/s, g (9.8 m/s²), µN, nJ and degrees."""
_UNITS: Mapping[str, Mapping[str, tuple[str, float]]] = {
    "SI": {},
    "mm": {**SHOWN_UNITS, "N": ("µN", 1e6), "m^2/s^2": ("mm^2/s^2", 1e6)},
}
"""For each system, the unit in place of an SI unit, and how many of it one SI unit is."""


def check_units(units: str) -> None:
    """Raise `InputError` unless a system of units exists."""
    if units not in _UNITS:
        raise input_error("units", f"{units!r}: {expected_of(units, _UNITS)}")


def unit_in(units: UnitSystem, unit: str) -> tuple[str, float]:
    """The unit of a system in place of an SI unit, and how many of it one SI unit is.

    Examples
    --------
    >>> unit_in("mm", "N"), unit_in("mm", "Hz"), unit_in("SI", "N")
    (('µN', 1000000.0), ('Hz', 1.0), ('N', 1.0))
    """
    return _UNITS[units].get(unit, (unit, 1.0))


def in_units(
    frame: pd.DataFrame, units: UnitSystem, unchanged: Collection[str] = ()
) -> pd.DataFrame:
    """A table with its numbers in another system of units.

    Parameters
    ----------
    frame
        A table in SI units, whose ``attrs["units"]`` has the units of its columns.
    units
        The system.
    unchanged
        Columns that keep their units.

    Returns
    -------
    pandas.DataFrame
        A new table with its ``attrs["units"]``. Converted numbers have fifteen digits.
    """
    converted = frame.copy()
    new_units = dict(frame.attrs["units"])
    for name in frame.columns:
        if name in unchanged:
            continue
        unit, factor = unit_in(units, new_units[name])
        new_units[name] = unit
        if factor != 1.0:
            numbers = frame[name].astype(float) * factor
            converted[name] = numbers.map(to_fifteen_digits, na_action="ignore")
    converted.attrs["units"] = new_units
    return converted
