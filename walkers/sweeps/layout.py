"""Which factors of a sweep go on the x axis of its figure, into colours and into panels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from walkers.errors import InputError, input_error
from walkers.sweeps.factors import Factor, factors_of, number_factor, readable_key
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.table import SEEDS, find_name

if TYPE_CHECKING:
    import pandas as pd

NO_FACTOR = "none"
"""Value of the options ``hue`` and ``panels`` that leaves out colours or panels."""


@dataclass(frozen=True)
class FigureLayout:
    """What a figure of a sweep shows where.

    Attributes
    ----------
    x_factors
        The factor on the x axis; of a sample, the factors on the x axes of one panel each.
    hue
        The factor that colours tell apart, if there is one.
    panels
        The factor that panels tell apart, if there is one.
    hidden
        Factors that the figure does not show: points with different values look the same.
    """

    x_factors: Sequence[Factor]
    hue: Factor | None = None
    panels: Factor | None = None
    hidden: Sequence[Factor] = ()


def figure_layout(
    table: pd.DataFrame, rows: pd.DataFrame, options: FigureOptions = FigureOptions()
) -> FigureLayout:
    """The layout of a figure of some rows of a sweep's table.

    Without options, the x axis has the key with the most numbers, or of a sample each key in a
    panel of its own; colours have the first other key. Random seeds are shown on the x axis or not
    at all.

    Parameters
    ----------
    table
        The table of the sweep.
    rows
        The rows to draw.
    options
        ``x``, ``hue`` and ``panels``: a key, a column, or ``none`` (not for x).

    Raises
    ------
    InputError
        If there is no key or column of a name, or more keys vary than the figure shows and no
        option is ``none``.
    """
    factors = _factors_of_rows(table, rows)
    x = _chosen("x", options.x, factors, rows)
    hue = _chosen("hue", options.hue, factors, rows)
    panels = _chosen("panels", options.panels, factors, rows)
    chosen = _existing(x, hue, panels)
    unplaced = [factor for factor in factors if not factor.is_among(chosen)]
    x_factors = [x] if x else _default_x(unplaced, rows)
    if len(x_factors) > 1 and panels:
        raise input_error("panels", "expected x too: the samples have a panel for each key")
    unplaced = [factor for factor in unplaced if not (factor in x_factors or _is_seed(factor))]
    if options.hue is None:
        hue = _first_not_sampled(unplaced)
    hidden = _hidden_factors(unplaced, factors, FigureLayout(x_factors, hue, panels))
    layout = FigureLayout(x_factors, hue, panels, hidden)
    if NO_FACTOR not in (options.hue, options.panels):
        _check_all_shown(layout)
    return layout


def _factors_of_rows(table: pd.DataFrame, rows: pd.DataFrame) -> list[Factor]:
    """The factors of a table with the values of some of its rows.

    Factors that have one value in these rows are left out, unless all have.
    """
    places = table.index.get_indexer(rows.index).tolist()
    factors = []
    varying = []
    for factor_of_table in factors_of(table):
        values = [factor_of_table.values[place] for place in places]
        factor = replace(factor_of_table, values=values)
        factors.append(factor)
        if len(factor.levels) > 1:
            varying.append(factor)
    return varying or factors


def _chosen(
    option: str, name: str | None, factors: Sequence[Factor], rows: pd.DataFrame
) -> Factor | None:
    """The factor of a key or a column that an option names; None without a name."""
    if name is None or (name == NO_FACTOR and option != "x"):
        return None
    names: list[str] = []
    for factor in factors:
        names += factor.keys
    names.extend(rows.columns)
    column = find_name(option, name, names)
    for factor in factors:
        if column in factor.keys:
            return factor
    values = rows[column].tolist()
    if all(isinstance(value, str) for value in values):
        return Factor(keys=(column,), name=readable_key(column), values=values, is_number=False)
    return number_factor(rows, column, option)


def _existing(*factors: Factor | None) -> list[Factor]:
    """The factors that are not None."""
    return [factor for factor in factors if factor is not None]


def _is_seed(factor: Factor) -> bool:
    return factor.keys[0] in SEEDS


def _first_not_sampled(factors: Sequence[Factor]) -> Factor | None:
    """The first factor that is not one of the keys of a sample, if there is one."""
    for factor in factors:
        if not factor.is_sample:
            return factor
    return None


def _default_x(factors: Sequence[Factor], rows: pd.DataFrame) -> list[Factor]:
    """The factors on x axes if no option names one: those of a sample, otherwise a single one.

    Seeds come last, numbers come before texts, and many values before few.
    """
    samples = [factor for factor in factors if factor.is_sample]
    if samples:
        return samples
    if not factors:
        return [number_factor(rows, "point", "x")]

    def priority(factor: Factor) -> tuple[bool, bool, int]:
        return not _is_seed(factor), factor.is_number, len(factor.levels)

    return [max(factors, key=priority)]


def _hidden_factors(
    unplaced: Sequence[Factor], factors: Sequence[Factor], layout: FigureLayout
) -> list[Factor]:
    """The factors that a figure does not show, and that do not follow from those that it shows.

    Parameters
    ----------
    unplaced
        Factors that have no place in the figure.
    factors
        All factors.
    layout
        The figure.
    """
    shown = _existing(layout.hue, layout.panels)
    for factor in factors:
        is_on_x = factor.is_among(layout.x_factors)
        if is_on_x and not factor.is_sample:
            shown.append(factor)
    return [factor for factor in unplaced if not _follows_from(shown, factor)]


def _follows_from(shown: Sequence[Factor], factor: Factor) -> bool:
    """Whether points with the same levels of the shown factors have the same level of a factor."""
    level_by_shown: dict[tuple[object, ...], object] = {}
    for number, level in enumerate(factor.values):
        shown_levels = tuple(visible.values[number] for visible in shown)
        if level_by_shown.setdefault(shown_levels, level) != level:
            return False
    return True


def _check_all_shown(layout: FigureLayout) -> None:
    """Refuse a layout that hides keys, except for those of a sample, which no layout can show."""
    hidden = [factor.keys[0] for factor in layout.hidden if not factor.is_sample]
    if hidden:
        raise _hidden_error(layout, hidden)


def _hidden_error(layout: FigureLayout, hidden: Sequence[str]) -> InputError:
    """The error that names the keys that the figure does not show, and how it can show them."""
    shown = [f"{factor.keys[0]} (x)" for factor in layout.x_factors]
    if layout.hue:
        shown.append(f"{layout.hue.keys[0]} (hue)")
    if layout.panels:
        shown.append(f"{layout.panels.keys[0]} (panels)")
    verb = "varies" if len(hidden) == 1 else "vary"
    reason = f"{', '.join(hidden)} {verb} beside {', '.join(shown)}"
    if layout.panels:
        return input_error(
            "hue",
            f"{reason}: expected fewer keys in the sweep file, or none to draw all values alike",
        )
    if len(hidden) > 1:
        advice = "expected one of them, with the others fixed in the sweep file"
    else:
        advice = f"expected {hidden[0]}"
    return input_error("panels", f"{reason}: {advice}, or none to draw all values alike")
