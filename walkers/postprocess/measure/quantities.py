"""Name, unit, label and meaning of each column of a table and of each number of a result.

They are declared once, in ``quantities.toml``. Files, axes and the reference take them from here.
`walkers.postprocess.measure.numbers` formats the numbers of results.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from walkers.rounding import SHOWN_UNITS

_FILE = tomllib.loads(Path(__file__).with_name("quantities.toml").read_text("utf-8"))
_BAND = "of the draws over the ranges of uncertain values"
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
"""Ends of names of bands and of numerical errors, as in ``velocity_low``: words of their labels, meaning."""
_PLAIN = ("draws", "approximate")
"""Ends of names of numbers without a unit."""


@dataclass(frozen=True)
class Quantity:
    """A column or a number: name, SI unit, label of axes and rows, definition, name of its error or scatter if any.

    With a ``*`` in its name there is one per bead or contact: ``rotation_1``, ``rotation_2``, …. The unit ``share`` is
    that of numbers that are shown in per cent.
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


def _quantities(entries: Mapping[str, str | list[str]]) -> tuple[Quantity, ...]:
    """Quantities from their entries: lists, or what a table adds to the meaning of a shared column."""
    quantities = []
    for name, entry in entries.items():
        unit, label, *more = _FILE["shared"][name] if isinstance(entry, str) else entry
        more = [more[0] + entry] if isinstance(entry, str) else more or [label]
        quantities.append(Quantity(name, unit, label, *more))
    return tuple(quantities)


TABLES: Mapping[str, tuple[Quantity, ...]] = {
    name: _quantities(columns) for name, columns in _FILE["tables"].items()
}
"""The columns of the tables of runs, in their order."""
GROUPS: Mapping[str, tuple[Quantity, ...]] = {
    name: _quantities(group) for name, group in _FILE["numbers"].items()
}
"""The numbers of results: of each module of `walkers.postprocess.measure.results.MODULES`, and of all."""
SHOWN: Mapping[str, frozenset[str]] = {
    name: frozenset(names) for name, names in _FILE["shown"].items()
}
"""Which numbers are shown (`walkers.postprocess.measure.numbers.rows`), and which are of walkers that face up."""
LABELS: Mapping[str, Mapping[str, str]] = _FILE["labels"]
"""Labels of numbers of walkers that face up or down: on a ``level`` boundary, on a ``slope``, and of ``both``."""
_NUMBERS = [
    quantity
    for number in (number for group in GROUPS.values() for number in group)
    for quantity in (
        number,
        *(
            Quantity(
                f"{number.name}_{end}",
                "" if end in _PLAIN else number.unit,
                f"{number.label}, {words}",
                f"{meaning}: {number.meaning}",
            )
            for end, (words, meaning) in ENDS.items()
        ),
    )
]
"""The numbers of results, each with its band and its numerical error."""


def matches(pattern: str, name: str) -> bool:
    """Whether a name is the pattern, or has a number in place of its ``*``: ``rotation_2`` of ``rotation_*``."""
    if "*" not in pattern:  # most have none, and a pattern takes long to compile
        return pattern == name
    return bool(re.fullmatch(pattern.replace("*", r"\d+"), name))


@cache
def declared(name: str, table: str = "") -> Quantity:
    """The quantity of a number of a result, or of a column of a table; `KeyError` if there is none.

    Examples
    --------
    >>> declared("sliding_pair_2", "walkers").label, declared("rotation_1_low").label
    ('sliding of pair 2 of beads', 'rotation of bead 1, 5 %')
    """
    for quantity in TABLES[table] if table else _NUMBERS:
        if matches(quantity.name, name):
            number = re.search(r"_(\d+)", name) if "*" in quantity.name else None
            return replace(
                quantity, name=name, label=quantity.label.replace("*", number[1] if number else "*")
            )
    raise KeyError(name)


def is_declared(name: str) -> bool:
    """Whether a name is that of a number of a result."""
    with suppress(KeyError):
        return bool(declared(name))
    return False


def is_error(name: str) -> bool:
    """Whether a number belongs to the band of another, or is its numerical error."""
    return name.rpartition("_")[2] in ENDS


def scatter_of(name: str) -> str:
    """Name of the number that is the scatter or the error of another; empty if there is none."""
    return declared(name).error if is_declared(name) else ""


def ordered(names: Iterable[str]) -> list[str]:
    """Names of numbers in the order of their declarations; both ends of a band follow the number."""
    places = {quantity.name: place for place, quantity in enumerate(_NUMBERS)}
    return sorted(
        names,
        key=lambda name: (
            places.get(re.sub(r"_\d+(?=_|$)", "_*", name), places.get(name, -1)),
            name,
        ),
    )


def described_columns(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of numbers of results, in the order of their declarations."""
    quantities = [declared(name) for name in ordered(names)]
    return {quantity.name: (quantity.si_unit, quantity.meaning) for quantity in quantities}


def unit_shown(unit: str) -> tuple[str, float]:
    """The displayed unit of an SI unit, and how many of it one SI unit is."""
    return SHOWN_UNITS.get(unit, (unit, 1.0))


def axis(table: str, name: str) -> tuple[str, float]:
    """Label of an axis with the displayed unit, and the factor from SI units.

    Examples
    --------
    >>> axis("members", "height"), axis("walkers", "open_2")
    (('height (mm)', 1000.0), ('bead 2 off its wall (%)', 100.0))
    """
    quantity = declared(name, table)
    unit, factor = unit_shown(quantity.unit)
    return f"{quantity.label} ({unit})" if unit else quantity.label, factor
