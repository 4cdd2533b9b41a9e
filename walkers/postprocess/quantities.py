"""Name, unit, label and meaning of each column of a table and of each number of a result.

They are declared once, in ``quantities.toml``. Files, axes and the reference take them from here.
`walkers.postprocess.numbers` formats the numbers of results.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from walkers.rounding import SHOWN_UNITS

_FILE = tomllib.loads(Path(__file__).with_name("quantities.toml").read_text("utf-8"))


@dataclass(frozen=True)
class Quantity:
    """A column or a number.

    Attributes
    ----------
    name
        Its name; one that ends in ``_*`` has one per bead or contact: ``rotation_1``, ``rotation_2``, …
    unit
        SI unit; ``share`` for a number that is shown in per cent.
    label
        Label of axes and rows, without the unit; ``*`` is the number of the bead or contact.
    meaning
        Definition, for the reference and the files.
    error
        Name of the number that is its error or scatter, if there is one.
    """

    name: str
    unit: str
    label: str
    meaning: str
    error: str = ""

    def names(self, name: str) -> bool:
        """Whether it is the column or number of this name."""
        return matches(self.name, name)

    @property
    def si_unit(self) -> str:
        """The unit of the stored number: a share has none."""
        return "" if self.unit == "share" else self.unit


def matches(pattern: str, name: str) -> bool:
    """Whether a name is the pattern, or has a number in place of its ``*``: ``rotation_2`` of ``rotation_*``."""
    return name == pattern or (pattern.endswith("_*") and name.removeprefix(pattern[:-1]).isdigit())


def unit_shown(unit: str) -> tuple[str, float]:
    """The displayed unit of an SI unit, and how many of it one SI unit is."""
    return SHOWN_UNITS.get(unit, (unit, 1.0))


def _quantities(entries: Mapping[str, str | list[str]]) -> tuple[Quantity, ...]:
    """Quantities from their entries: lists, or what a table adds to the meaning of a shared column."""

    def quantity_of(name: str, entry: str | list[str]) -> Quantity:
        if isinstance(entry, str):
            unit, label, meaning = _FILE["shared"][name]
            return Quantity(name, unit, label, meaning + entry)
        unit, label, *more = entry
        return Quantity(name, unit, label, *(more or [label]))

    return tuple(quantity_of(name, entry) for name, entry in entries.items())


TABLES: Mapping[str, tuple[Quantity, ...]] = {name: _quantities(columns) for name, columns in _FILE["tables"].items()}
"""The columns of the tables of runs, in their order."""
GROUPS: Mapping[str, tuple[Quantity, ...]] = {name: _quantities(group) for name, group in _FILE["numbers"].items()}
"""The numbers of results: of each module of `walkers.postprocess.results.modules_of`, and of all."""
NUMBERS: Mapping[str, Quantity] = {quantity.name: quantity for group in GROUPS.values() for quantity in group}
"""The numbers of results by name."""


def declared(name: str, quantities: Iterable[Quantity]) -> Quantity:
    """The quantity of a name; ``rotation_2`` is found as ``rotation_*``, and its label has the number.

    `KeyError` if there is none.

    Examples
    --------
    >>> declared("sliding_pair_2", TABLES["walkers"]).label
    'sliding of pair 2 of beads'
    """
    quantity = next((quantity for quantity in quantities if quantity.names(name)), None)
    if quantity is None:
        raise KeyError(name)
    return replace(quantity, name=name, label=quantity.label.replace("*", name.rpartition("_")[2]))


def axis(table: str, name: str) -> tuple[str, float]:
    """Label of an axis with the displayed unit, and the factor from SI units.

    Examples
    --------
    >>> axis("members", "height"), axis("walkers", "open_2")
    (('height (mm)', 1000.0), ('bead 2 off its wall (%)', 100.0))
    """
    quantity = declared(name, TABLES[table])
    unit, factor = unit_shown(quantity.unit)
    return f"{quantity.label} ({unit})" if unit else quantity.label, factor
