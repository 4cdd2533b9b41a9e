"""Which properties of a sweep's points go on the x axis of its figure, into colours and into panels."""

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
"""What an option says to leave out colours or panels."""


@dataclass(frozen=True)
class FigureLayout:
    """What a figure of a sweep shows where.

    Attributes
    ----------
    along
        The factor on the x axis; of a sample, the factors on the x axes of one panel each.
    hue
        The factor that colours tell apart, if there is one.
    panels
        The factor that panels tell apart, if there is one.
    hidden
        Factors in which points differ that look alike.
    """

    along: Sequence[Factor]
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
        option says ``none``.
    """
    factors = _factors_of_rows(table, rows)
    x = _chosen("x", options.x, factors, rows)
    hue = _chosen("hue", options.hue, factors, rows)
    panels = _chosen("panels", options.panels, factors, rows)
    chosen = [factor for factor in (x, hue, panels) if factor is not None]
    left = [factor for factor in factors if not factor.is_among(chosen)]
    along = [x] if x else _default_x(left, rows)
    if len(along) > 1 and panels:
        raise input_error("panels", "expected x too: the samples have a panel for each key")
    left = [factor for factor in left if factor not in along and factor.keys[0] not in SEEDS]
    if options.hue is None:
        hue = next((factor for factor in left if not factor.is_sample), None)
    shown = [factor for factor in (hue, panels) if factor]
    shown += [factor for factor in factors if factor.is_among(along) and not factor.is_sample]
    hidden = [factor for factor in left if not _follows_from(shown, factor)]
    layout = FigureLayout(along, hue, panels, hidden)
    if NO_FACTOR not in (options.hue, options.panels):
        _check_all_shown(layout)
    return layout


def _factors_of_rows(table: pd.DataFrame, rows: pd.DataFrame) -> list[Factor]:
    """The factors of a table with the values of some of its rows.

    Those that have one value in these rows are left out, unless all have.
    """
    places = table.index.get_indexer(rows.index).tolist()
    factors = []
    for factor in factors_of(table):
        values = [factor.values[place] for place in places]
        factors.append(replace(factor, values=values))
    varying = [factor for factor in factors if len(factor.levels) > 1]
    return varying or factors


def _chosen(
    option: str, name: str | None, factors: Sequence[Factor], rows: pd.DataFrame
) -> Factor | None:
    """The factor of a key or a column that an option names; None without a name."""
    if name is None or (name == NO_FACTOR and option != "x"):
        return None
    keys = [key for factor in factors for key in factor.keys]
    column = find_name(option, name, [*keys, *rows.columns])
    for factor in factors:
        if column in factor.keys:
            return factor
    values = rows[column].tolist()
    if all(isinstance(value, str) for value in values):
        return Factor((column,), readable_key(column), values, is_number=False)
    return number_factor(rows, column, option)


def _default_x(factors: Sequence[Factor], rows: pd.DataFrame) -> list[Factor]:
    """The keys of a sample; otherwise the numbers with the most values, and no seeds if there are other keys."""
    samples = [factor for factor in factors if factor.is_sample]
    if samples:
        return samples
    candidates = [factor for factor in factors if factor.keys[0] not in SEEDS] or factors
    candidates = [factor for factor in candidates if factor.is_number] or candidates
    if not candidates:
        return [number_factor(rows, "point", "x")]
    return [max(candidates, key=lambda factor: len(factor.levels))]


def _follows_from(shown: Sequence[Factor], factor: Factor) -> bool:
    """Whether points that look alike in a figure have the same level of a factor."""
    level_of: dict[tuple[object, ...], object] = {}
    for number, level in enumerate(factor.values):
        look = tuple(visible.values[number] for visible in shown)
        if level_of.setdefault(look, level) != level:
            return False
    return True


def _check_all_shown(layout: FigureLayout) -> None:
    """Refuse a layout that hides keys of the sweep; it cannot show the keys of a sample."""
    hidden = [factor.keys[0] for factor in layout.hidden if not factor.is_sample]
    if hidden:
        raise _hides(layout, hidden)


def _hides(layout: FigureLayout, hidden: Sequence[str]) -> InputError:
    """An error that says which keys the figure does not show, and how it can."""
    shown = [f"{factor.keys[0]} (x)" for factor in layout.along]
    if layout.hue:
        shown.append(f"{layout.hue.keys[0]} (hue)")
    if layout.panels:
        shown.append(f"{layout.panels.keys[0]} (panels)")
    vary = (
        f"{', '.join(hidden)} {'varies' if len(hidden) == 1 else 'vary'} beside {', '.join(shown)}"
    )
    if layout.panels:
        return input_error(
            "hue",
            f"{vary}: expected fewer keys in the sweep file, or none to draw all values alike",
        )
    if len(hidden) > 1:
        advice = "expected one of them, with the others fixed in the sweep file"
    else:
        advice = f"expected {hidden[0]}"
    return input_error("panels", f"{vary}: {advice}, or none to draw all values alike")
