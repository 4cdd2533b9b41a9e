"""What the points of a sweep differ by: numbers, categories and samples, as figures want them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.axes import is_axis
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import suggestion
from walkers.sweeps.record import SweepRecord

SEEDS = ("run.seed", "seed")
_SYMBOLS = {"gamma0": "Γ0", "sin_delta": "sin δ", "mass_asymmetry": "μ"}


@dataclass(frozen=True)
class Factor:
    """Something by which the points of a sweep differ.

    Attributes
    ----------
    keys
        The keys of the case that vary with it.
    label
        With the unit, for a figure.
    values
        Of each point: a number in the unit of the label, or a text.
    is_number, is_sample
        Whether they are numbers, and such as a sampler drew.
    unit
        Of the numbers; empty where they have none.
    """

    keys: tuple[str, ...]
    label: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    unit: str = ""

    @property
    def levels(self) -> list[Any]:
        """The different values: numbers in ascending order, texts in that of the sweep."""
        different = dict.fromkeys(self.values)
        return sorted(different) if self.is_number else list(different)

    @property
    def name(self) -> str:
        """The label without the unit and without what else varies with it."""
        first = self.label.partition("\n")[0]
        return first.removesuffix(f" ({self.unit})") if self.unit else first

    def where(self, level: Any) -> npt.NDArray[np.bool_]:
        """Which of the points have a level."""
        return np.array([value == level for value in self.values], dtype=bool)

    def told(self, level: Any) -> str:
        """A level as text, with its unit."""
        return f"{level:.6g} {self.unit}".strip() if self.is_number else str(level)


def factors_of(record: SweepRecord) -> list[Factor]:
    """What a sweep's points differ by, in the order of its keys; what has one value is left out.

    Keys of a ``[[zip]]`` whose numbers rise or fall together, or that have texts or lists, are one factor. Numbers that
    go together otherwise, as those of a ``[[sample]]``, are one factor each.
    """
    columns = {key: [row[number] for row in record.values] for number, key in enumerate(record.units)}
    factors = []
    for keys in _axes(record):
        varied = {key: columns[key] for key in keys if _count(columns[key]) > 1}
        if varied:
            factors += _factors(varied, record.units)
    return factors


def _axes(record: SweepRecord) -> list[tuple[str, ...]]:
    """The keys of a sweep, those together that go together by its file."""
    together = [tuple(flatten(table, is_axis)) for table in record.file.get("zip", ())]
    together += [tuple(flatten(table["ranges"], is_axis)) for table in record.file.get("sample", ())]
    axis_of = {key: keys for keys in together for key in keys}
    return list(dict.fromkeys(axis_of.get(key, (key,)) for key in record.units))


def _count(values: Iterable[Any]) -> int:
    return len(set(map(repr, values)))


def _factors(columns: Mapping[str, list[Any]], units: Mapping[str, str | None]) -> list[Factor]:
    """The factors of keys that go together."""
    first, *others = columns
    if not all(
        isinstance(one, (int, float)) and type(one) is not bool for column in columns.values() for one in column
    ):
        return [_category(columns, units)]
    together = all(_monotone(columns[first], columns[key]) for key in others)
    found = []
    for key, rest in [(first, others)] if together else [(key, []) for key in columns]:
        unit = units[key] or ""
        label = with_unit(readable_key(key), unit) + _with(rest)
        found.append(Factor((key, *rest), label, list(map(float, columns[key])), True, not together, unit))
    return found


def _monotone(first: Sequence[float], second: Sequence[float]) -> bool:
    """Whether of two columns one rises or falls strictly with the other."""
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(sorted(set(zip(first, second, strict=True))))]
    return all(along > 0 for along, _ in steps) and (all(up > 0 for _, up in steps) or all(up < 0 for _, up in steps))


def _category(columns: Mapping[str, list[Any]], units: Mapping[str, str | None]) -> Factor:
    """A factor of texts: of the key that tells its levels apart, or of all together."""
    whole = _count(zip(*columns.values(), strict=True))
    shown = next(([key] for key, values in columns.items() if _count(values) == whole), list(columns))
    told = [[f"{value_text(value)} {units[key] or ''}".strip() for value in columns[key]] for key in shown]
    rest = [key for key in columns if key not in shown]
    label = ", ".join(map(readable_key, shown)) + _with(rest)
    return Factor((*shown, *rest), label, [", ".join(row) for row in zip(*told, strict=True)], False)


def value_text(value: Any) -> str:
    """A value of a key as text, several with strokes between them."""
    if isinstance(value, list):
        return "/".join(map(value_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _with(keys: Sequence[str]) -> str:
    if len(keys) > 2:
        return f"\n(and {len(keys)} further keys with it)"
    return f"\n(and with it {', '.join(map(readable_key, keys))})" if keys else ""


def readable_key(key: str) -> str:
    """A dotted key or a column as words: ``peak acceleration``, ``friction bead wall``, ``liquid``, ``Γ0``."""
    table, _, name = key.partition(".")
    if (name or table) in _SYMBOLS:
        return _SYMBOLS[name or table]
    words = table.partition("[")[0] if name in ("name", "material") else (name or table)
    return words.replace(".", " ").replace("_", " ")


def with_unit(words: str, unit: str) -> str:
    """A label with its unit, if there is one."""
    return f"{words} ({unit})" if unit else words


def find_name(option: str, wanted: str, names: Iterable[str]) -> str:
    """The name that is meant: itself, or the only one that ends so.

    Raises
    ------
    InputError
        If there is none, or there are several.
    """
    known = list(dict.fromkeys(names))
    found = [name for name in known if name == wanted] or [name for name in known if name.endswith(f".{wanted}")]
    if len(found) == 1:
        return found[0]
    told = f"expected one of {', '.join(found or known)}{'' if found else suggestion(wanted, known)}"
    raise InputError(option, [Problem("", None, f'"{wanted}": {told}')])
