"""What the points of a sweep differ by: numbers, categories and samples, as figures want them.

A sweep's directory lists its points, not the axes that they were made from. Keys that were varied independently have
all combinations of their values; keys of which combinations are missing went together, in a ``[[zip]]`` or a
``[[sample]]``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isnan
from typing import Any

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import suggestion
from walkers.sweeps.columns import derived_columns
from walkers.sweeps.record import SweepRecord

SEEDS = ("run.seed", "seed")
_SYMBOLS = {"gamma0": "Γ0", "sin_delta": "sin δ", "mass_asymmetry": "μ"}
_LEAST_ASYMMETRIES = 3
"""Different radii are shown by sin δ from so many on."""


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

    def told(self, level: Any) -> str:
        """A level as text, with its unit."""
        return f"{level:.6g} {self.unit}".strip() if self.is_number else str(level)


def factors_of(record: SweepRecord) -> list[Factor]:
    """What a sweep's points differ by, in the order of its keys; what has one value is left out.

    Keys whose numbers rise or fall together, and keys with texts or lists that go together, are one factor. Numbers
    that go together otherwise are samples, one factor each.
    """
    columns = {key: [row[number] for row in record.values] for number, key in enumerate(record.units)}
    columns = {key: values for key, values in columns.items() if _count([values]) > 1}
    factors = []
    for keys in _together(columns):
        factors += _factors({key: columns[key] for key in keys}, record)
    return factors


def _count(columns: Iterable[Sequence[Any]]) -> int:
    """How many different combinations columns have."""
    return len({repr(row) for row in zip(*columns, strict=True)})


def _together(columns: dict[str, list[Any]]) -> list[list[str]]:
    """Keys in groups: those of a group do not have all combinations of their values."""
    groups: list[list[str]] = []
    for key, values in columns.items():
        count = _count([values])
        joined = [
            group
            for group in groups
            if any(_count([values, columns[other]]) < count * _count([columns[other]]) for other in group)
        ]
        groups = [group for group in groups if group not in joined] + [
            [*(one for group in joined for one in group), key]
        ]
    return groups


def _factors(columns: dict[str, list[Any]], record: SweepRecord) -> list[Factor]:
    keys = tuple(columns)
    numeric = all(isinstance(value, (int, float)) and type(value) is not bool for v in columns.values() for value in v)
    if not numeric:
        return [_category(columns, record)]
    if len(keys) > 1 and not all(_monotone(columns[keys[0]], columns[key]) for key in keys[1:]):
        return [_number(key, columns[key], record, sample=True) for key in keys]
    first = _number(keys[0], columns[keys[0]], record)
    return [Factor(keys, first.label + _with(keys[1:]), first.values, True, unit=first.unit)]


def _monotone(first: Sequence[float], second: Sequence[float]) -> bool:
    """Whether of two columns one rises or falls strictly with the other."""
    pairs = sorted(set(zip(first, second, strict=True)))
    steps = [(b[0] > a[0], b[1] - a[1]) for a, b in pairwise(pairs)]
    return all(rises and (step > 0) == (steps[0][1] > 0) and step != 0 for rises, step in steps)


def _number(key: str, values: Sequence[float], record: SweepRecord, *, sample: bool = False) -> Factor:
    unit = record.units[key] or ""
    return Factor((key,), with_unit(readable_key(key), unit), [float(value) for value in values], True, sample, unit)


def _category(columns: dict[str, list[Any]], record: SweepRecord) -> Factor:
    """A factor of texts: of as few of the keys as tell its levels apart."""
    whole = _count(columns.values())
    shown: list[str] = []
    for key in columns:
        if _count([columns[one] for one in shown]) < whole if shown else True:
            shown.append(key)
    for key in [one for one in shown if len(shown) > 1]:
        others = [one for one in shown if one != key]
        if others and _count([columns[one] for one in others]) == whole:
            shown = others
    told = [[f"{_text(value)} {record.units[key] or ''}".strip() for value in columns[key]] for key in shown]
    texts = [", ".join(row) for row in zip(*told, strict=True)]
    label = ", ".join(readable_key(key) for key in shown)
    rest = tuple(key for key in columns if key not in shown)
    return Factor((*shown, *rest), label + _with(rest), texts, False)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return "/".join(_text(part) for part in value)
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


def by_asymmetry(factor: Factor, record: SweepRecord, points: Sequence[int]) -> Factor | None:
    """A factor of these points that is one of several pairs of radii as numbers, by sin δ; None if it is none."""
    names = list(derived_columns(record.analyses))
    if factor.is_number or not any(key.endswith("radii") for key in factor.keys) or "sin_delta" not in names:
        return None
    place = names.index("sin_delta")
    sines = [record.derived[point][place] for point in points]
    if any(sine is None or isnan(sine) for sine in sines):  # of clusters
        return None
    levels = {(text, round(sine, 12)) for text, sine in zip(factor.values, sines, strict=True)}
    one_each = len(levels) == len({sine for _, sine in levels}) == len(factor.levels)
    if not one_each or len(levels) < _LEAST_ASYMMETRIES:
        return None
    return Factor(factor.keys, "asymmetry sin δ", [float(sine) for sine in sines], True)


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
