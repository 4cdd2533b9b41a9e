"""The properties in which the points of a sweep differ, as axes, colours and panels of figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.errors import input_error
from walkers.postprocess.measure.quantities import declared, is_declared, unit_shown
from walkers.sweeps.table import key_values, value_text
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd

ROUNDING = 1e-12
"""Share of the largest number below which a number is a rounding error."""


@dataclass(frozen=True)
class Factor:
    """A property in which the points of a sweep differ.

    Attributes
    ----------
    keys
        The keys, or the column, that it is made of.
    name
        What axes and legends call it, without a unit.
    values
        For each point a number, in the unit, or a text.
    is_number
        Whether the values are numbers.
    is_sample
        Whether it is one of the keys of a sample, whose points do not share values.
    is_log
        Whether its range is log-uniform, so that its axis has a logarithmic scale.
    unit
        Displayed unit of the numbers.
    further_keys
        Keys that change together with it.
    """

    keys: tuple[str, ...]
    name: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    is_log: bool = False
    unit: str = ""
    further_keys: tuple[str, ...] = ()

    @property
    def levels(self) -> list[Any]:
        """The different values: numbers in ascending order, texts in the order of the sweep."""
        different = dict.fromkeys(self.values)
        return sorted(different) if self.is_number else list(different)

    @property
    def label(self) -> str:
        """The name with the unit, and below it the keys that change together with it."""
        label = with_unit(self.name, self.unit)
        if not self.further_keys:
            return label
        words = ", ".join(readable_key(key) for key in self.further_keys)
        if len(self.further_keys) > 2:
            words = f"{len(self.further_keys)} further keys"
        return f"{label}\n(and with it {words})"

    def is_among(self, factors: Sequence[Factor]) -> bool:
        """Whether one of several factors has the keys of this one, or distinguishes the same points."""
        for factor in factors:
            pairs = len(set(zip(self.values, factor.values, strict=True)))
            if self.keys == factor.keys or pairs == len(self.levels) == len(factor.levels):
                return True
        return False

    def exact(self, level: float) -> float:
        """A number, or zero if it is a rounding error."""
        return 0.0 if abs(level) < ROUNDING * max(map(abs, self.levels)) else level

    def text(self, level: Any, *, by_name: bool = False) -> str:
        """A level as text with its unit, for numbers optionally with the factor's name."""
        text = f"{self.exact(level):.6g} {self.unit}".strip() if self.is_number else str(level)
        return f"{self.name} = {text}" if by_name and self.is_number else text


def factors_of(table: pd.DataFrame) -> list[Factor]:
    """The factors of a sweep in the order of its keys, without keys that have one value.

    The keys of an axis are one factor if their numbers rise or fall together, or if some have texts
    or lists. Otherwise, as in a sample, each key is a factor.
    """
    factors = []
    for keys in table.attrs["axes"]:
        factors += _factors_of_axis(table, keys)
    return factors


def _factors_of_axis(table: pd.DataFrame, keys: Sequence[str]) -> list[Factor]:
    factors = [_factor_of_key(table, key) for key in keys]
    factors = [factor for factor in factors if len(factor.levels) > 1]
    if len(factors) < 2:
        return factors
    if not all(factor.is_number for factor in factors):
        return [_named_points(factors)]
    if _change_together(factors):
        return [_with_further_keys(factors[0], factors)]
    return [replace(factor, is_sample=True) for factor in factors]


def _factor_of_key(table: pd.DataFrame, key: str) -> Factor:
    values, unit = key_values(table, key)
    is_number = all(type(value) in (int, float) for value in values)
    if not is_number:
        texts = [value_text(value, unit) for value in values]
        return Factor((key,), readable_key(key), texts, is_number=False)
    return Factor(
        keys=(key,),
        name=readable_key(key),
        values=[float(value) for value in values],
        is_number=True,
        is_log=table.attrs.get("sampled", {}).get(key, False),
        unit=unit or "",
    )


def _change_together(factors: Sequence[Factor]) -> bool:
    """Whether numbers of all factors rise, or fall, wherever those of the first rise."""
    points = np.unique(np.array([factor.values for factor in factors]).T, axis=0)
    steps = np.diff(points, axis=0)
    rise = np.all(steps > 0.0, axis=0)
    fall = np.all(steps < 0.0, axis=0)
    return bool(np.all(steps[:, 0] > 0.0) and np.all(rise | fall))


def _named_points(factors: Sequence[Factor]) -> Factor:
    """The factor of an axis whose points have names.

    The names are the values of the first key that tells all points apart, or those of all keys.
    """
    points = list(zip(*(factor.values for factor in factors), strict=True))
    for factor in factors:
        if len(factor.levels) == len(set(points)):
            texts = [factor.text(value) for value in factor.values]
            named = Factor(factor.keys, factor.name, texts, is_number=False)
            return _with_further_keys(named, factors)
    texts = []
    for point in points:
        values = [factor.text(value) for factor, value in zip(factors, point, strict=True)]
        texts.append(", ".join(values))
    keys = tuple(key for factor in factors for key in factor.keys)
    name = ", ".join(factor.name for factor in factors)
    return Factor(keys, name, texts, is_number=False)


def _with_further_keys(first: Factor, factors: Sequence[Factor]) -> Factor:
    """The first of several factors that change together; its label names the others."""
    further = tuple(key for factor in factors for key in factor.keys if key not in first.keys)
    return replace(first, keys=(*first.keys, *further), further_keys=further)


def readable_key(key: str) -> str:
    """A dotted key or a column as words: ``friction bead wall``, ``liquid``; numbers of results by their labels."""
    table, _, name = key.partition(".")
    if is_declared(name or table):
        return declared(name or table).label
    words = table.partition("[")[0] if name in ("name", "material") else (name or table)
    return words.replace(".", " ").replace("_", " ")


def number_factor(rows: pd.DataFrame, name: str, option: str) -> Factor:
    """A column of numbers in its displayed unit."""
    import pandas as pd

    unit, factor = unit_shown(rows.attrs["units"].get(name) or "")
    values = pd.to_numeric(rows[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(rows) and np.isnan(values).all():
        raise input_error(option, f'"{name}" has no number that could be drawn')
    return Factor(
        (name,), readable_key(name), (values * factor).tolist(), is_number=True, unit=unit
    )
