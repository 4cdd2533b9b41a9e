"""What of a sweep's table is drawn where: one column against what was varied, in colours and panels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.readable import readable_unit
from walkers.sweeps.factors import SEEDS, Factor, factors_of, find_name, readable_key, with_unit
from walkers.sweeps.record import SweepRecord

if TYPE_CHECKING:
    import pandas as pd

FloatArray = npt.NDArray[np.float64]
NONE = "none"
"""Instead of a column: do not tell points apart so."""
DEFAULTS = ("velocity", "climbs")
"""What is drawn if nothing else is asked for, the first that the table has."""
ERRORS = {"velocity": "standard_error"}
"""Columns with the standard errors of others."""
_LEAST_ASYMMETRIES = 3
"""Different radii are shown by sin δ from so many on."""
_MOST_PANELS = 12
"""More combinations of what is left are not told apart by panels."""


@dataclass(frozen=True)
class Layout:
    """What is drawn along x (samples have a panel for each), in colours, in panels; names of what is not told apart."""

    x: Sequence[Factor]
    hue: Factor | None
    panels: Factor | None
    untold: Sequence[str] = ()


@dataclass(frozen=True)
class Drawn:
    """A column of a table in readable units, its errors, and what models predict, row by row; the axis's label."""

    label: str
    values: FloatArray
    errors: FloatArray
    theory: Mapping[str, FloatArray] = field(default_factory=dict)


def default_column(table: pd.DataFrame) -> str:
    """The column of a table that is drawn if nothing else is asked for."""
    return next((name for name in DEFAULTS if name in table), "frequency")


def drawn_column(table: pd.DataFrame, name: str, theory: Mapping[str, FloatArray] | None = None) -> Drawn:
    """A column of a sweep's table, in readable units.

    Raises
    ------
    InputError
        If it has no numbers.
    """
    column, size = _of_numbers(table, name, "--y")
    errors = np.full(len(table), np.nan)
    if name in ERRORS:
        errors = table[ERRORS[name]].to_numpy(dtype=float, na_value=np.nan) / size
    predicted = {model: numbers / size for model, numbers in (theory or {}).items()}
    return Drawn(column.label, np.array(column.values), errors, predicted)


def _of_numbers(table: pd.DataFrame, name: str, option: str) -> tuple[Factor, float]:
    """A column of numbers in its readable unit, and the size of that."""
    import pandas as pd

    unit, size = readable_unit(table.attrs["units"].get(name, ""))
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(table) and np.isnan(values).all():
        raise InputError(option, [Problem("", None, f'"{name}" has no number that could be drawn')])
    label = with_unit(readable_key(name), unit)
    return Factor((name,), label, (values / size).tolist(), True, unit=unit), size


def layout_of(
    record: SweepRecord,
    table: pd.DataFrame,
    *,
    x: str | None = None,
    hue: str | None = None,
    panels: str | None = None,
) -> Layout:
    """What of a sweep goes where, as asked for or guessed.

    Guessed is: along x the numbers with the most values, in colours what has the most values of the rest, in panels
    all else. Samples have a panel for each key.

    Parameters
    ----------
    record
        The sweep.
    table
        Rows of its table (`walkers.sweeps.table.load`).
    x, hue, panels
        Keys that vary or columns of the table; ``none`` for neither colours nor panels.

    Raises
    ------
    InputError
        If there is no such key or column.
    """
    points = table["point"].to_numpy()
    factors = [replace(factor, values=[factor.values[point] for point in points]) for factor in factors_of(record)]

    def named(option: str, name: str) -> Factor:
        found = find_name(option, name, [*(key for factor in factors for key in factor.keys), *table.columns])
        return next((one for one in factors if found in one.keys), None) or _of_column(table, found, option)

    asked = {
        option: named(f"--{option}", name)
        for option, name in (("x", x), ("hue", hue), ("panels", panels))
        if name is not None and not (name == NONE and option != "x")
    }
    left = [one for one in factors if not any(_same(one, other) for other in asked.values())]
    samples = [factor for factor in left if factor.is_sample]
    left = [factor for factor in left if not factor.is_sample]
    untold = [one.name for one in samples] if "x" in asked else []
    if "x" in asked:
        along = [asked["x"]]
    elif samples:
        along = samples
    else:
        along = [_along(left, table) or _of_column(table, "point", "--x")]
        left = [factor for factor in left if factor.keys != along[0].keys]
    left = sorted((one for one in left if one.keys[0] not in SEEDS), key=lambda one: -len(one.levels))
    colours = asked.get("hue") or (left.pop(0) if left and hue is None else None)
    apart = asked.get("panels")
    if apart is None and panels is None and left and len(along) == 1:
        while prod(len(one.levels) for one in left) > _MOST_PANELS:
            untold.append(left.pop(0 if len(left[0].levels) > _MOST_PANELS else -1).name)
        apart, left = _joined(left) if left else None, []
    if len(along) > 1 and apart is not None:
        raise InputError("--panels", [Problem("", None, "expected --x too: the samples have a panel for each key")])
    return Layout(along, colours, apart, [*untold, *(one.name for one in left)])


def _same(one: Factor, other: Factor) -> bool:
    """Whether two factors tell the same points apart, such as Γ0 and the acceleration that it follows from."""
    pairs = len(set(zip(one.values, other.values, strict=True)))
    return one.keys == other.keys or pairs == len(one.levels) == len(other.levels)


def _along(factors: Sequence[Factor], table: pd.DataFrame) -> Factor | None:
    """What is best along x: most values, of equally many the last; categories and seeds if there is nothing else."""
    shown = [_by_asymmetry(factor, table) or factor for factor in factors]
    ranks = [(one.keys[0] not in SEEDS, one.is_number, len(one.levels), place) for place, one in enumerate(shown)]
    return shown[max(ranks)[-1]] if ranks else None


def _by_asymmetry(factor: Factor, table: pd.DataFrame) -> Factor | None:
    """A factor that is one of three or more pairs of radii as numbers, by sin δ; None if it is none."""
    if factor.is_number or "sin_delta" not in table or not any(key.endswith("radii") for key in factor.keys):
        return None
    sines = table["sin_delta"].astype(float)
    if sines.isna().any():  # of clusters
        return None
    shown = Factor(factor.keys, "asymmetry sin δ", sines.tolist(), True)
    pairs = set(zip(factor.values, sines.round(12), strict=True))
    one_each = len(pairs) == sines.round(12).nunique() == len(factor.levels)
    return shown if one_each and len(pairs) >= _LEAST_ASYMMETRIES else None


def _of_column(table: pd.DataFrame, name: str, option: str) -> Factor:
    if table[name].map(lambda value: isinstance(value, str)).all() and len(table):
        return Factor((name,), readable_key(name), list(table[name]), False)
    return _of_numbers(table, name, option)[0]


def _joined(factors: Sequence[Factor]) -> Factor:
    """Several factors as one."""
    if len(factors) == 1:
        return factors[0]

    def told(factor: Factor, level: Any) -> str:
        bare = factor.is_number and not factor.unit
        return f"{factor.name} = {factor.told(level)}" if bare else factor.told(level)

    columns = [[told(factor, level) for level in factor.values] for factor in factors]
    keys = tuple(key for factor in factors for key in factor.keys)
    texts = [", ".join(row) for row in zip(*columns, strict=True)]
    return Factor(keys, ", ".join(factor.name for factor in factors), texts, False)
