"""The properties in which the points of a sweep differ, as axes, colours and panels of figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.errors import refused
from walkers.postprocess.measure.quantities import declared, is_declared, unit_shown
from walkers.sweeps.table import key_values, value_text
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd

_ROUNDING = 1e-12  # relative to the largest number


@dataclass(frozen=True)
class Factor:
    """A property in which points differ: its keys, its label, and a number (in its unit) or a text for each point.

    Each key of a sample is a factor. Points of a sample do not share values. Those of log-uniform ranges have an axis
    with a logarithmic scale (``is_log``).
    """

    keys: tuple[str, ...]
    label: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    is_log: bool = False
    unit: str = ""

    @property
    def levels(self) -> list[Any]:
        """The different values: numbers in ascending order, texts in the order of the sweep."""
        different = dict.fromkeys(self.values)
        return sorted(different) if self.is_number else list(different)

    @property
    def name(self) -> str:
        """The label without the unit and without further keys."""
        first = self.label.partition("\n")[0]
        return first.removesuffix(f" ({self.unit})") if self.unit else first

    def exact(self, level: float) -> float:
        """A number, or zero if it is a rounding error."""
        return 0.0 if abs(level) < _ROUNDING * max(map(abs, self.levels)) else level

    def text(self, level: Any, *, by_name: bool = False) -> str:
        """A level as text with its unit, for numbers optionally with the factor's name."""
        text = f"{self.exact(level):.6g} {self.unit}".strip() if self.is_number else str(level)
        return f"{self.name} = {text}" if by_name and self.is_number else text


def factors_of(table: pd.DataFrame) -> list[Factor]:
    """The factors of a sweep in the order of its keys, without keys that have one value.

    Keys of one axis are one factor if their numbers rise or fall together, or if they have texts or lists. Otherwise,
    as in a sample, each key is a factor.
    """
    return [factor for keys in table.attrs["axes"] for factor in _of_axis(table, keys)]


def _of_axis(table: pd.DataFrame, keys: Sequence[str]) -> list[Factor]:
    factors = []
    for key in keys:
        values, unit = key_values(table, key)
        is_number, is_log = {*map(type, values)} <= {int, float}, table.attrs.get("sampled", {}).get(key, False)
        values = [float(value) if is_number else value_text(value, unit) for value in values]
        unit = (unit or "") if is_number else ""
        factor = Factor((key,), with_unit(readable_key(key), unit), values, is_number, is_log=is_log, unit=unit)
        if len(factor.levels) > 1:
            factors.append(factor)
    if len(factors) < 2:
        return factors
    if not all(factor.is_number for factor in factors):
        # The texts of one key that distinguishes all levels, or of all keys.
        texts = [Factor(factor.keys, factor.name, [*map(factor.text, factor.values)], False) for factor in factors]
        whole = joined(texts)
        first = next((factor for factor in texts if len(factor.levels) == len(whole.levels)), whole)
        return [_with(first, factors)]
    steps = np.diff(np.unique(np.array([factor.values for factor in factors]).T, axis=0), axis=0)
    together = (steps[:, 0] > 0.0).all() and ((steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)).all()
    return [_with(factors[0], factors)] if together else [replace(factor, is_sample=True) for factor in factors]


def _with(first: Factor, factors: Sequence[Factor]) -> Factor:
    """A factor that stands for others too, which its label names."""
    rest = [key for factor in factors for key in factor.keys if key not in first.keys]
    words = f"{len(rest)} further keys" if len(rest) > 2 else ", ".join(map(readable_key, rest))
    label = f"{first.label}\n(and with it {words})" if rest else first.label
    return replace(first, keys=(*first.keys, *rest), label=label)


def readable_key(key: str) -> str:
    """A dotted key or a column as words: ``friction bead wall``, ``liquid``; numbers of results by their labels."""
    table, _, name = key.partition(".")
    if is_declared(name or table):
        return declared(name or table).label
    words = table.partition("[")[0] if name in ("name", "material") else (name or table)
    return words.replace(".", " ").replace("_", " ")


def joined(factors: Sequence[Factor]) -> Factor:
    """Several factors as one whose levels are texts; a single factor as it is."""
    if len(factors) == 1:
        return factors[0]
    columns = [[factor.text(level, by_name=not factor.unit) for level in factor.values] for factor in factors]
    keys = tuple(key for factor in factors for key in factor.keys)
    texts = [", ".join(row) for row in zip(*columns, strict=True)]
    return Factor(keys, ", ".join(factor.name for factor in factors), texts, False)


def numbers_of(rows: pd.DataFrame, name: str, option: str) -> Factor:
    """A column of numbers in its displayed unit."""
    import pandas as pd

    unit, factor = unit_shown(rows.attrs["units"].get(name) or "")
    values = pd.to_numeric(rows[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(rows) and np.isnan(values).all():
        raise refused(option, f'"{name}" has no number that could be drawn')
    return Factor((name,), with_unit(readable_key(name), unit), (values * factor).tolist(), True, unit=unit)
