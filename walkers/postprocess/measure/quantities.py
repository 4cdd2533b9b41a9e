"""Name, unit, label and meaning of each column of a table and of each number of a result.

They are declared once, in ``quantities.toml``. Files, axes and the reference take them from here.
`walkers.postprocess.measure.numbers` formats the numbers of results.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from walkers.rounding import SHOWN_UNITS

_FILE = tomllib.loads(Path(__file__).with_name("quantities.toml").read_text("utf-8"))
"""The declarations."""
_BAND = "of the draws over the ranges of uncertain values"
"""Words of the meanings of the numbers of a band."""
ENDS = {
    "low": ("5 %", f"5 % {_BAND}"),
    "high": ("95 %", f"95 % {_BAND}"),
    "draws": ("draws of the band", f"number {_BAND}"),
    "approximate": (
        "band approximate",
        "whether these draws are too few for more than an approximate band",
    ),
    "error": ("numerical error", "numerical error, of time step and stiffness"),
}
"""Ends of the names of the numbers of a band and of numerical errors, as in ``velocity_low``.

The values are the words that the label of the number gets, and the meaning."""
_ENDS_WITHOUT_UNIT = ("draws", "approximate")
"""Ends of names of numbers without a unit."""


@dataclass(frozen=True)
class Quantity:
    """A column of a table or a number of a result.

    With a ``*`` in its name there is one per bead or contact: ``rotation_1``, ``rotation_2``, ….

    Attributes
    ----------
    name
        Name of the column or number.
    unit
        SI unit; ``share`` for numbers that are shown in per cent.
    label
        What axes and rows call it.
    meaning
        Its definition.
    error
        Name of the number that is its error or scatter; empty if there is none.
    """

    name: str
    unit: str
    label: str
    meaning: str
    error: str = ""

    @property
    def si_unit(self) -> str:
        """The unit of the stored number: a share has none."""
        return "" if self.unit == "share" else self.unit


def _quantity(name: str, entry: str | list[str]) -> Quantity:
    """A quantity from its entry in the file.

    A list has the unit, the label, the meaning (the label if it is missing) and the name of the
    error. A text belongs to a column of several tables, which stands under ``[shared]`` in the
    file; it is added to the meaning of this column.
    """
    if isinstance(entry, str):
        unit, label, *rest = _FILE["shared"][name]
        meaning, *_ = rest
        return Quantity(name, unit, label, meaning + entry)
    unit, label, *rest = entry
    if not rest:
        return Quantity(name, unit, label, label)
    return Quantity(name, unit, label, *rest)


def _quantities(entries: Mapping[str, str | list[str]]) -> tuple[Quantity, ...]:
    """Quantities from their entries in a table of the file."""
    return tuple(_quantity(name, entry) for name, entry in entries.items())


TABLES: Mapping[str, tuple[Quantity, ...]] = {
    name: _quantities(columns) for name, columns in _FILE["tables"].items()
}
"""The columns of the tables of runs, in their order."""
GROUPS: Mapping[str, tuple[Quantity, ...]] = {
    name: _quantities(group) for name, group in _FILE["numbers"].items()
}
"""The numbers of results, by the names of the modules that measure them; ``drive`` are of all.

The modules are those of `walkers.postprocess.measure.results.MODULES`."""
SHOWN: Mapping[str, frozenset[str]] = {
    name: frozenset(names) for name, names in _FILE["shown"].items()
}
"""Names of numbers, with ``*``, by why they are shown or not.

``walkers.postprocess.measure.numbers.rows`` never shows those of ``aside`` and ``hidden``, those of
``not_of_a_ramp`` under a ramp, those of ``not_of_parts`` if walkers came apart, and those of
``if_any`` if they are zero. Short texts have only those of ``important``. On a slope, those of
``facing_up`` leave out walkers that face down."""
LABELS: Mapping[str, Mapping[str, str]] = _FILE["labels"]
"""Labels of numbers of walkers that face up or down: on a ``level`` boundary, on a ``slope``, and
of ``both`` directions."""


def _with_ends(number: Quantity) -> list[Quantity]:
    """A number of results, the numbers of its band, and its numerical error."""
    quantities = [number]
    for end, (words, meaning) in ENDS.items():
        quantities.append(
            Quantity(
                name=f"{number.name}_{end}",
                unit="" if end in _ENDS_WITHOUT_UNIT else number.unit,
                label=f"{number.label}, {words}",
                meaning=f"{meaning}: {number.meaning}",
            )
        )
    return quantities


def _all_numbers() -> tuple[Quantity, ...]:
    """The numbers of results, each with its band and its numerical error."""
    quantities: list[Quantity] = []
    for group in GROUPS.values():
        for number in group:
            quantities += _with_ends(number)
    return tuple(quantities)


_NUMBERS = _all_numbers()
"""The numbers of results, each with its band and its numerical error."""


def matches(pattern: str, name: str) -> bool:
    """Tell whether a name is a pattern, or has a number in place of its ``*``.

    Parameters
    ----------
    pattern
        Name of a quantity, such as ``rotation_*``.
    name
        Name of a column or number, such as ``rotation_2``.
    """
    if "*" not in pattern:  # most have none, and a pattern takes long to compile
        return pattern == name
    return bool(re.fullmatch(pattern.replace("*", r"\d+"), name))


@cache
def declared(name: str, table: str = "") -> Quantity:
    """Find the quantity of a number of a result, or of a column of a table.

    Parameters
    ----------
    name
        Name of the number or column.
    table
        Name of the table; empty for a number of a result.

    Returns
    -------
    Quantity
        With this name, and the number of the bead or contact in its label.

    Raises
    ------
    KeyError
        If no such number or column is declared.

    Examples
    --------
    >>> declared("sliding_pair_2", "walkers").label, declared("rotation_1_low").label
    ('sliding of pair 2 of beads', 'rotation of bead 1, 5 %')
    """
    for quantity in TABLES[table] if table else _NUMBERS:
        if matches(quantity.name, name):
            label = quantity.label
            if "*" in quantity.name:
                number = re.search(r"_(\d+)", name)
                label = label.replace("*", number[1] if number else "*")
            return replace(quantity, name=name, label=label)
    raise KeyError(name)


def is_declared(name: str) -> bool:
    """Tell whether a name is that of a number of a result."""
    try:
        declared(name)
    except KeyError:
        return False
    return True


def is_error(name: str) -> bool:
    """Tell whether a number belongs to the band of another, or is its numerical error."""
    _, _, end = name.rpartition("_")
    return end in ENDS


def scatter_of(name: str) -> str:
    """Name of the number that is the scatter or the error of another; empty if there is none."""
    return declared(name).error if is_declared(name) else ""


def ordered(names: Iterable[str]) -> list[str]:
    """Sort names of numbers by their declarations; the ends of a band follow the number."""
    places = {quantity.name: place for place, quantity in enumerate(_NUMBERS)}

    def place_and_name(name: str) -> tuple[int, str]:
        """Place of the declaration; numbers of one declaration are sorted by their names."""
        pattern = re.sub(r"_\d+(?=_|$)", "_*", name)
        place = places.get(pattern, places.get(name, -1))
        return place, name

    return sorted(names, key=place_and_name)


def described_columns(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of numbers of results, in the order of their declarations."""
    quantities = [declared(name) for name in ordered(names)]
    return {quantity.name: (quantity.si_unit, quantity.meaning) for quantity in quantities}


def unit_shown(unit: str) -> tuple[str, float]:
    """The displayed unit for an SI unit, and the factor that converts a number to it."""
    return SHOWN_UNITS.get(unit, (unit, 1.0))


def axis(table: str, name: str) -> tuple[str, float]:
    """Label an axis of a figure.

    Parameters
    ----------
    table
        Name of the table; empty for a number of a result.
    name
        Name of the column or number.

    Returns
    -------
    label : str
        With the displayed unit.
    factor : float
        How many displayed units one SI unit is.

    Examples
    --------
    >>> axis("members", "height"), axis("walkers", "open_2")
    (('height (mm)', 1000.0), ('bead 2 off its wall (%)', 100.0))
    """
    quantity = declared(name, table)
    unit, factor = unit_shown(quantity.unit)
    label = f"{quantity.label} ({unit})" if unit else quantity.label
    return label, factor
