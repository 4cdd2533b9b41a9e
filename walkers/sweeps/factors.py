"""The properties in which the points of a sweep differ, as axes, colours and panels of figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.errors import input_error
from walkers.inputs.units import unit_with_symbols
from walkers.postprocess.measure.quantities import declared, is_declared, unit_shown
from walkers.sweeps.table import key_values, value_text
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd

ROUNDING = 1e-12
"""Share of the largest number below which a number is a rounding error."""
_SURFACES = {"bead_bead", "bead_wall"}
"""Last words of the keys of a property of both pairs of surfaces."""


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
    scope
        What it is a property of, for labels of axes.
    """

    keys: tuple[str, ...]
    name: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    is_log: bool = False
    unit: str = ""
    further_keys: tuple[str, ...] = ()
    scope: str = ""

    @property
    def levels(self) -> list[Any]:
        """The different values: numbers in ascending order, texts in the order of the sweep."""
        different = list(dict.fromkeys(self.values))
        if self.is_number:
            different.sort()
        return different

    @property
    def label(self) -> str:
        """The name with the unit, and below it the keys that change together with it."""
        name = f"{self.name} ({self.scope})" if self.scope else self.name
        label = with_unit(name, unit_with_symbols(self.unit))
        if not self.further_keys:
            return label
        if len(self.further_keys) > 2:
            words = f"{len(self.further_keys)} further keys"
        else:
            words = ", ".join(map(readable_key, self.further_keys))
        return f"{label}\n(and with it {words})"

    def is_among(self, factors: Sequence[Factor]) -> bool:
        """Whether one of several factors has the same keys, or tells the same points apart."""
        for factor in factors:
            pairs = set(zip(self.values, factor.values, strict=True))
            if self.keys == factor.keys or len(pairs) == len(self.levels) == len(factor.levels):
                return True
        return False

    def without_rounding(self, level: float) -> float:
        """A number; zero if it is a rounding error, compared with the largest number."""
        largest = max(abs(number) for number in self.levels)
        return 0.0 if abs(level) < ROUNDING * largest else level

    def text(self, level: Any) -> str:
        """A level as text, with its unit."""
        if not self.is_number:
            return str(level)
        return f"{self.without_rounding(level):.6g} {unit_with_symbols(self.unit)}".strip()

    def has_level(self, level: Any) -> npt.NDArray[np.bool_]:
        """Which points have a level, shape (N,)."""
        return np.array([value == level for value in self.values])

    @property
    def texts(self) -> list[str]:
        """The values as texts."""
        return [self.text(value) for value in self.values]

    def text_with_name(self, level: Any) -> str:
        """A level as text with its unit; a number also with the name of the factor."""
        text = self.text(level)
        return f"{self.name} = {text}" if self.is_number else text


def factors_of(table: pd.DataFrame) -> list[Factor]:
    """The factors of a sweep in the order of its keys, without keys that have one value.

    The keys of an axis are one factor if their numbers rise or fall together, or if some have texts
    or lists. Otherwise, as in a sample, each key is a factor.
    """
    factors: list[Factor] = []
    for keys in table.attrs["axes"]:
        factors += _factors_of_axis(table, keys)
    return factors


def _factors_of_axis(table: pd.DataFrame, keys: Sequence[str]) -> list[Factor]:
    """The factors of keys that vary together."""
    factors = []
    for key in keys:
        factor = _factor_of_key(table, key)
        if len(factor.levels) > 1:
            factors.append(factor)
    if len(factors) < 2:
        return factors
    if not all(factor.is_number for factor in factors):
        return [_named_points(factors)]
    if _change_together(factors):
        return [_with_further_keys(factors[0], factors)]
    return [replace(factor, is_sample=True) for factor in factors]


def _factor_of_key(table: pd.DataFrame, key: str) -> Factor:
    """The factor of a key: of numbers if all of its values are numbers, otherwise of texts."""
    values, unit = key_values(table, key)
    if not all(type(value) in (int, float) for value in values):
        texts = [value_text(value, unit) for value in values]
        return Factor(keys=(key,), name=readable_key(key), values=texts, is_number=False)
    return Factor(
        keys=(key,),
        name=readable_key(key),
        values=list(map(float, values)),
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
    points = set(zip(*(factor.values for factor in factors), strict=True))
    for factor in factors:
        if len(factor.levels) == len(points):
            named = Factor(keys=factor.keys, name=factor.name, values=factor.texts, is_number=False)
            return _with_further_keys(named, factors)
    texts_of_points = zip(*(factor.texts for factor in factors), strict=True)
    return Factor(
        keys=_keys_of(factors),
        name=", ".join(factor.name for factor in factors),
        values=[", ".join(texts) for texts in texts_of_points],
        is_number=False,
    )


def _with_further_keys(first: Factor, factors: Sequence[Factor]) -> Factor:
    """The first of several factors that change together; its label names the others."""
    further = tuple(key for key in _keys_of(factors) if key not in first.keys)
    keys = first.keys + further
    property_of_surfaces = _property_of_surfaces(factors)
    if property_of_surfaces:
        name = readable_key(property_of_surfaces)
        return replace(first, keys=keys, name=name, scope="walls and beads")
    return replace(first, keys=keys, further_keys=further)


def _property_of_surfaces(factors: Sequence[Factor]) -> str:
    """The key of a property, such as friction, that is equal on walls and between beads.

    Empty if the factors are not those of one property of both, or if their values differ.
    """
    properties = set()
    surfaces = set()
    for factor in factors:
        name, _, surface = factor.keys[0].rpartition(".")
        properties.add(name)
        surfaces.add(surface)
    values = [list(factor.values) for factor in factors]
    if surfaces != _SURFACES or len(properties) != 1 or values[0] != values[1]:
        return ""
    return properties.pop()


def _keys_of(factors: Sequence[Factor]) -> tuple[str, ...]:
    """The keys of several factors."""
    keys: tuple[str, ...] = ()
    for factor in factors:
        keys += factor.keys
    return keys


def readable_key(key: str) -> str:
    """A dotted key, or a column of results, as words for a reader.

    ``contact.friction.bead_wall`` becomes ``friction bead wall``, and ``liquid.name`` becomes
    ``liquid``. A column of results becomes its declared label
    (`walkers.postprocess.measure.quantities.declared`), and so does a key whose name without the
    table is that of a column, such as ``drive.frequency``.
    """
    table, _, name_in_table = key.partition(".")
    name = name_in_table or table
    if is_declared(name):
        return declared(name).label
    words = name
    if name_in_table in ("name", "material"):  # the table says more, without an index: walkers[0]
        words, _, _ = table.partition("[")
    return words.replace(".", " ").replace("_", " ")


def number_factor(rows: pd.DataFrame, name: str, option: str) -> Factor:
    """The factor of a column of numbers, in its displayed unit.

    Parameters
    ----------
    rows
        Rows of a sweep's table.
    name
        The column.
    option
        The option or argument that names the column, for the message of the error.

    Raises
    ------
    InputError
        If there are rows, and the column has no number.
    """
    import pandas as pd

    unit, units_per_si = unit_shown(rows.attrs["units"].get(name) or "")
    values = pd.to_numeric(rows[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(rows) and np.isnan(values).all():
        raise input_error(option, f'"{name}" has no number that could be drawn')
    return Factor(
        keys=(name,),
        name=readable_key(name),
        values=(values * units_per_si).tolist(),
        is_number=True,
        unit=unit,
    )
