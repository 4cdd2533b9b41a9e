"""Figure of `walkers climb`: waiting times and rates of climbs against the conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, plain_text, save_figure, styled
from walkers.runner.files import write_bytes
from walkers.sweeps.climbing import Condition

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ACROSS = 3
_ROW = 2.1  # inches
_MOST_LETTERS = 40  # in labels side by side below a panel
_RATE = "climbs per run and second"
_KINDS = (("all", "", "ko"), ("plain walls", "on_plain_walls", "C1s"), ("corners", "in_corners", "C2^"))
"""All climbs and their parts: label, key of `walkers.sweeps.climbing.summarise_climbs`, colour, marker."""


@styled
def climbs_figure(conditions: Sequence[Condition], found: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the results of `walkers.sweeps.climbing.summarise_climbs` for each condition.

    The first row shows the usual condition, or the first one: the share of piles that have climbed by a time (Kaplan
    and Meier's estimate), speeds against sizes, rates. Below is a panel for each varied key: rates against its values,
    for conditions that differ only in this key, with the number of piles that climbed. If conditions differ in several
    keys or come from several sweeps, one panel lists them all. If the conditions are all pairs of values of two keys,
    the figure is a map of the rates.
    """
    usual = next((number for number, one in enumerate(conditions) if not one.differs), 0)
    keys = list(dict.fromkeys(key for one in conditions for key in one.differs))
    first = ["survival", "climbs", "rates"]
    if grid := _grid(conditions, keys):
        figure, axes = new_figure(TWO_COLUMNS, _ROW * (0.3 + 0.35 * len(grid[1])), mosaic=[["map"]])
        _draw_map(axes["map"], keys, grid, found)
        return figure
    if any(len(one.differs) > 1 or one.source for one in conditions):
        mosaic, heights = [first, ["conditions"] * _ACROSS], [1.0, 0.3 + len(conditions) / 6.0]
    else:
        blank = ["."] * (-len(keys) % _ACROSS)
        panels = [*keys, *blank]
        mosaic = [first, *(panels[start : start + _ACROSS] for start in range(0, len(panels), _ACROSS))]
        heights = [1.0] * len(mosaic)
    figure, axes = new_figure(TWO_COLUMNS, _ROW * sum(heights), mosaic=mosaic, height_ratios=heights)
    _draw_survival(axes["survival"], found[usual])
    _draw_climbs(axes["climbs"], found[usual])
    _draw_rates(axes["rates"], [""], [found[usual]])
    axes["rates"].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    if "conditions" in axes:
        labels = [_in_short(one) for one in conditions]
        _draw_rates(axes["conditions"], labels[::-1], found[::-1], across=True)
    for name in keys if "conditions" not in axes else ():
        labels, numbers = _at(conditions, name)
        some = [found[number] for number in numbers]
        climbed = [f"{label}\n{one['climbed']}/{one['runs']}" for label, one in zip(labels, some, strict=True)]
        _draw_rates(axes[name], climbed, some)
        axes[name].set_xlabel(plain_text(name))
    letter_panels(axes.values())
    return figure


def _in_short(one: Condition) -> str:
    """A short label of a condition: one line per key, with the last word of the key."""
    return "\n".join(f"{key.rpartition('.')[2]} {told}" for key, told in one.differs.items()) or one.source or "usual"


def _at(conditions: Sequence[Condition], key: str) -> tuple[list[str], list[int]]:
    """Sorted values of a key in conditions that differ only in this key, and the numbers of these conditions."""
    alone = {one.value(key): number for number, one in enumerate(conditions) if one.differs.keys() <= {key}}
    labels = sorted(alone, key=_by_number)
    return labels, [alone[label] for label in labels]


def _by_number(text: str) -> tuple[float, str]:
    try:
        return float(text.partition(" ")[0].partition("/")[0]), text
    except ValueError:
        return float("inf"), text


def _grid(conditions: Sequence[Condition], keys: Sequence[str]) -> tuple[list[str], list[str], list[list[int]]] | None:
    """Values of two keys, and numbers of conditions (a row per second value); None unless all pairs are conditions."""
    at = {tuple(map(one.value, keys)): number for number, one in enumerate(conditions)}
    if len(keys) != 2:
        return None
    columns, rows = (sorted({pair[place] for pair in at}, key=_by_number) for place in (0, 1))
    if not len(at) == len(conditions) == len(columns) * len(rows) or min(len(columns), len(rows)) < 2:
        return None
    return columns, rows, [[at[column, row] for column in columns] for row in rows]


def _draw_survival(panel: Axes, found: Mapping[str, Any]) -> None:
    curve = {name: np.array(values, dtype=float) for name, values in found["curve"].items()}
    panel.step(curve["time"], curve["probability"], "k", where="post")
    panel.fill_between(curve["time"], curve["low"], curve["high"], step="post", color="0.85")
    panel.set(xlabel="time of drive (s)", ylabel="share that has climbed", ylim=(0.0, 1.02), xlim=(0.0, None))


def _draw_climbs(panel: Axes, found: Mapping[str, Any]) -> None:
    for corner, (label, _, look) in enumerate(_KINDS[1:]):
        some = [one for one in found["each"] if one["speed"] is not None and (len(one["walls"]) > 1) == bool(corner)]
        sizes, speeds = [one["size"] for one in some], [one["speed"] * 1e3 for one in some]
        panel.plot(sizes, speeds, look, markerfacecolor="none", label=label, clip_on=False)
    panel.set(xlabel="beads", ylabel="speed (mm/s)", xlim=(0.0, None), ylim=(0.0, None))


def _draw_rates(
    panel: Axes, labels: Sequence[str], found: Sequence[Mapping[str, Any]], *, across: bool = False
) -> None:
    """Rates with their exact intervals, vertical, or horizontal (``across``) one above the other."""
    for place, (label, key, look) in enumerate(_KINDS):
        some = [one[key] if key else one for one in found]
        rates = np.array([one["rate"] for one in some], dtype=float)  # NaN without a drive
        ends = np.array([one["rate_interval"] or (np.nan, np.nan) for one in some])
        at, errors = np.arange(len(found)) + 0.15 * (place - 1), np.abs(ends.T - rates)
        given: dict[str, Any] = {"xerr": errors} if across else {"yerr": errors}
        x, y = (rates, at) if across else (at, rates)
        panel.errorbar(x, y, fmt=look, label=label, linestyle="none", markersize=3.0, **given)
    told, places, sides = [plain_text(label) for label in labels], np.arange(len(labels)), (-0.5, len(labels) - 0.5)
    if across:
        panel.set_yticks(places, told)
        panel.set(xlabel=_RATE, xlim=(0.0, None), ylim=sides)
    else:
        crowded = sum(map(len, told)) > _MOST_LETTERS
        panel.set_xticks(places, told, rotation=30 if crowded else 0, ha="right" if crowded else "center")
        panel.set(ylabel=_RATE, ylim=(0.0, None), xlim=sides)


def _draw_map(
    panel: Axes,
    keys: Sequence[str],
    grid: tuple[list[str], list[str], list[list[int]]],
    found: Sequence[Mapping[str, Any]],
) -> None:
    """Rates over two keys; each cell has the rate with its interval, and the number of piles that climbed."""
    columns, rows, numbers = grid
    rates = np.array([[found[number]["rate"] for number in row] for row in numbers], dtype=float)
    shown = panel.imshow(rates, cmap="Blues", vmin=0.0, aspect="auto", origin="lower")
    for place, number in np.ndenumerate(np.array(numbers)):
        one, ends = found[number], found[number]["rate_interval"] or (np.nan, np.nan)
        text = f"{rates[place]:.2g} ({ends[0]:.2g} to {ends[1]:.2g})\n{one['climbed']}/{one['runs']}"
        colour = "w" if rates[place] > 0.6 * np.nanmax(rates) else "k"
        panel.text(place[1], place[0], text, ha="center", va="center", color=colour)
    panel.set_xticks(range(len(columns)), list(map(plain_text, columns)))
    panel.set_yticks(range(len(rows)), list(map(plain_text, rows)))
    panel.set(xlabel=plain_text(keys[0]), ylabel=plain_text(keys[1]))
    panel.grid(visible=False)
    panel.figure.colorbar(shown, ax=panel, label=_RATE)


_COLUMNS = (
    *("condition", "where", "runs", "seconds", "within", "climbed", "probability", "probability_low"),
    *("probability_high", "estimator", "median", "climbs", "rate", "rate_low", "rate_high", "dispersion"),
    *("led_by_large", "share_of_large", "p_among_beads", "p_among_own"),
)


def write_climbs(conditions: Sequence[Condition], found: Sequence[Mapping[str, Any]], to: Path) -> None:
    """Write the results for each condition as a table (one row per condition and part of the climbs) or as a figure.

    Parameters
    ----------
    conditions, found
        The conditions, and the results of `walkers.sweeps.climbing.summarise_climbs` for each.
    to
        A .csv file for the table (SI units), or a figure (`walkers.postprocess.drawing.FORMATS`).
    """
    if to.suffix != ".csv":
        runs = [run.name for one in conditions for run in one.runs]
        save_figure(climbs_figure(conditions, found), to, runs, [to.suffix[1:]], "How often piles climb")
        return
    import pandas as pd

    rows = []
    for one, all_of_it in zip(conditions, found, strict=True):
        for label, key, _ in _KINDS:
            told = all_of_it[key] if key else all_of_it
            sides: dict[str, Any] = {"condition": one.label, "where": label}
            for name, ends in (("probability", told["interval"]), ("rate", told["rate_interval"])):
                sides[f"{name}_low"], sides[f"{name}_high"] = ends or (None, None)
            rows.append({**told, **sides})
    write_bytes(to, pd.DataFrame(rows, columns=_COLUMNS).to_csv(index=False).encode())
