"""Which properties of a sweep's points go on the x axis of its figure, into colours and into panels."""

from __future__ import annotations

from dataclasses import replace
from math import prod
from typing import TYPE_CHECKING

from walkers.errors import refused
from walkers.sweeps.factors import Factor, factors_of, joined, numbers_of, readable_key
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.table import SEEDS, find_name

if TYPE_CHECKING:
    import pandas as pd

_MOST_PANELS = 12


def layout_of(
    table: pd.DataFrame, rows: pd.DataFrame, options: FigureOptions = FigureOptions()
) -> tuple[list[Factor], Factor | None, Factor | None, list[str]]:
    """Choose the factors on the x axis (of samples one for each panel), in colours and in panels for some rows.

    By default the x axis has the numbers with the most values, colours have the other factor with the most values, and
    panels have all further factors. Samples have a panel for each key. `InputError` if there is no key or column of an
    option. The last value has the names of keys that the figure does not distinguish.
    """
    places = table.index.get_indexer(rows.index).tolist()
    left = factors = [
        replace(factor, values=[factor.values[place] for place in places]) for factor in factors_of(table)
    ]
    chosen = {}
    for option, name in (("x", options.x), ("hue", options.hue), ("panels", options.panels)):
        if name is not None and not (name == "none" and option != "x"):
            column = find_name(option, name, [*(key for factor in factors for key in factor.keys), *table.columns])
            given = next((factor for factor in factors if column in factor.keys), None)
            if given is None and rows[column].map(lambda value: isinstance(value, str)).all():
                given = Factor((column,), readable_key(column), rows[column].tolist(), False)
            chosen[option] = given or numbers_of(rows, column, option)
            left = [factor for factor in left if not _same(factor, chosen[option])]
    samples = [factor for factor in left if factor.is_sample]
    left = [factor for factor in left if not factor.is_sample]
    undistinguished = [factor.name for factor in samples] if "x" in chosen else []
    along = [chosen["x"]] if "x" in chosen else samples
    if not along:
        ranked = [factor for factor in left if factor.is_number] or left or [numbers_of(rows, "point", "x")]
        along = [max(ranked, key=lambda factor: (factor.keys[0] not in SEEDS, len(factor.levels)))]
    left = [factor for factor in left if factor not in along and factor.keys[0] not in SEEDS]
    left.sort(key=lambda factor: -len(factor.levels))
    colours = chosen.get("hue") or (left.pop(0) if left and options.hue is None else None)
    apart = chosen.get("panels")
    if len(along) > 1 and apart is not None:
        raise refused("panels", "expected x too: the samples have a panel for each key")
    if options.panels is None and left and len(along) == 1:
        while prod(len(factor.levels) for factor in left) > _MOST_PANELS:
            undistinguished.append(left.pop(0 if len(left[0].levels) > _MOST_PANELS else -1).name)
        apart, left = joined(left) if left else None, []
    return along, colours, apart, [*undistinguished, *(factor.name for factor in left)]


def _same(first: Factor, second: Factor) -> bool:
    """Whether two factors distinguish the same points, such as Γ0 and the acceleration."""
    pairs = len(set(zip(first.values, second.values, strict=True)))
    return first.keys == second.keys or pairs == len(first.levels) == len(second.levels)
