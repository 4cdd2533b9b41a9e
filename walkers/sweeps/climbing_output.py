"""Statistics of climbs (`walkers.sweeps.climbing`) as text, table and figure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import IntArray
from walkers.files import write_bytes
from walkers.postprocess.measure.uncertainty import OF_OTHERS
from walkers.postprocess.show.drawing import (
    TWO_COLUMNS,
    letter_panels,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.rounding import percent
from walkers.sweeps.climbing import CONFIDENCE, DRAWS, PARTS, WALLS_OF_CORNER
from walkers.terminal import table_width
from walkers.text import aligned_with_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class _Subset:
    """Some of the climbs, which table and figure tell apart.

    Attributes
    ----------
    label
        What the table and the legend call them.
    key
        Their key in the results of `walkers.sweeps.climbing.climb_summary`; empty for all climbs.
    marker
        Matplotlib's format: colour and marker.
    """

    label: str
    key: str
    marker: str

    def numbers_in(self, condition: Mapping[str, Any]) -> Mapping[str, Any]:
        """The statistics of these climbs in a condition."""
        if self.key:
            numbers: Mapping[str, Any] = condition[self.key]
            return numbers
        return condition


_ALL = _Subset(label="all", key="", marker="ko")
_ON_PLAIN_WALLS = _Subset(label="plain walls", key="on_plain_walls", marker="C1s")
_IN_CORNERS = _Subset(label="corners", key="in_corners", marker="C2^")
_SUBSETS = (_ALL, _ON_PLAIN_WALLS, _IN_CORNERS)
"""The subsets in the order of table and legend."""
_MISSING = "–"
"""Text of a statistic that does not exist, such as the speed if nothing climbed."""
_ROW_HEIGHT = 2.1
"""Height of the first row of panels, inches."""
_LETTERS_OF_LABEL = 44
"""Letters of a line in the labels of conditions."""


def texts_of(climbs: Mapping[str, Any]) -> dict[str, str]:
    """Statistics of the climbs in a condition as texts by their names.

    Rates are in climbs per run and second; 95 % confidence intervals are in brackets.
    """
    p_by_chance = climbs["p_among_beads"]
    if p_by_chance is not None:  # the draws show no smaller probability
        p_by_chance = max(p_by_chance, 2.0 / DRAWS)
    median_speed = None
    if climbs["speeds"]:
        median_speed = 1e3 * np.median(climbs["speeds"])
    texts = {
        "pile": climbs["condition"],
        "climbed": f"{climbs['climbed']} of {climbs['runs']}",
        "within (s)": f"{climbs['within']:.3g}",
        "ended before": f"{climbs['ended']}",
        "probability": _with_interval(climbs["probability"], climbs["interval"], ".2f"),
        "half by (s)": _two_digits(climbs["median"]),
        "climbs": f"{climbs['climbs']}",
        "rate": _with_interval(climbs["rate"], climbs["rate_interval"], ".2g"),
    }
    for part in PARTS:
        rate = _with_interval(climbs[part]["rate"], climbs[part]["rate_interval"], ".2g")
        texts[part.replace("_", " ")] = rate
    texts |= {
        "dispersion": _with_interval(climbs["dispersion"], climbs["dispersion_interval"], ".2g"),
        "led by large": f"{climbs['led_by_large']} of {climbs['climbs']}",
        "share led by large": _with_interval(
            climbs["share_led_by_large"], climbs["share_led_by_large_interval"], ".2f"
        ),
        "large beads (%)": f"{100.0 * climbs['share_of_large']:.0f}",
        "p by chance": _two_digits(p_by_chance),
        "beads": _range_text(climbs["sizes"]),
        "height (mm)": _range_text(climbs["heights"], 1e3),
        "speed (mm/s)": _range_text(climbs["speeds"], 1e3),
        "median speed (mm/s)": _two_digits(median_speed),
        "guessed": _MISSING,
    }
    if climbs.get("guessed"):
        texts["guessed"] = f"{', '.join(climbs['guessed'])} ({OF_OTHERS})"
    return texts


def _two_digits(value: float | None) -> str:
    """A number with two significant digits."""
    return _MISSING if value is None else f"{value:.2g}"


def _with_interval(value: float | None, interval: Sequence[float] | None, digits: str) -> str:
    """A number in a format, with its interval in brackets if there is one."""
    if value is None:
        return _MISSING
    text = f"{value:{digits}}"
    if interval is not None:
        low, high = interval
        text += f" ({low:{digits}} to {high:{digits}})"
    return text


def _range_text(values: Sequence[float], factor: float = 1.0) -> str:
    """The smallest and the largest value, multiplied by a factor of the unit."""
    if not values:
        return _MISSING
    return f"{factor * min(values):.2g} to {factor * max(values):.2g}"


def describe_climbs(climbs: Sequence[Mapping[str, Any]]) -> str:
    """The `texts_of` several conditions, one below the other, without what does not exist."""
    blocks = []
    for condition in climbs:
        texts = texts_of(condition)
        rows = [[name, text] for name, text in texts.items() if text != _MISSING]
        blocks.append(aligned_with_text(rows, table_width()))
    note = f"rates per run and second; in brackets {percent(CONFIDENCE)} confidence"
    return "\n\n".join([*blocks, note])


def climbing_table(climbs: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """The results of `walkers.api.climb` as a table in SI units.

    Returns
    -------
    pandas.DataFrame
        For each ``condition`` a row for all climbs, for those on plain walls and for those in
        corners (``where``). The ends of intervals have columns of their own, such as ``rate_low``
        and ``rate_high``; NaN where there is no interval. ``guessed`` has the values of the case
        that were guessed.
    """
    import pandas as pd

    rows = []
    for condition in climbs:
        for subset in _SUBSETS:
            row = {"condition": condition["condition"], "where": subset.label}
            row |= _table_row(subset.numbers_in(condition))
            row["guessed"] = ", ".join(condition.get("guessed", []))
            rows.append(row)
    return pd.DataFrame(rows)


def _table_row(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The statistics of climbs in a row: without lists, and with the ends of intervals."""
    row = {}
    for name, value in numbers.items():
        if name.endswith("interval"):
            quantity = name.removesuffix("interval").strip("_") or "probability"
            low, high = value or (np.nan, np.nan)
            row[f"{quantity}_low"] = low
            row[f"{quantity}_high"] = high
        elif not isinstance(value, (dict, list)):
            row[name] = value
    return row


@styled
def climbs_figure(climbs: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the results of `walkers.api.climb`.

    The first row shows the first condition: the share of piles that have climbed by a time (Kaplan
    and Meier's estimate), and speeds against sizes. Below are the rates of all conditions with
    their exact 95 % intervals, and the number of piles that climbed.
    """
    heights = [1.0, 0.3 + len(climbs) / 6.0]  # of the rows of panels, over `_ROW_HEIGHT`
    mosaic: list[Any] = [["survival", "climbs"], ["rates", "rates"]]
    figure = new_figure(TWO_COLUMNS, _ROW_HEIGHT * sum(heights))
    axes = figure.subplot_mosaic(mosaic, height_ratios=heights)
    draw_survival(axes["survival"], climbs[0]["curve"], "k", band={"color": "0.85"})
    axes["survival"].set(
        xlabel="time of drive (s)",
        ylabel="share that has climbed",
        ylim=(0.0, 1.02),
        xlim=(0.0, None),
    )
    _draw_speeds(axes["climbs"], climbs[0]["each"])
    _draw_rates_of_conditions(axes["rates"], climbs)
    letter_panels(axes.values())
    handles, labels = axes["rates"].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(_SUBSETS))
    return figure


def draw_survival(
    axes: Axes,
    curve: Mapping[str, Sequence[float | None]],
    colour: str,
    *,
    band: Mapping[str, Any] | None = None,
    label: str = "",
) -> None:
    """Draw the share of piles that have climbed against the time of the drive.

    Parameters
    ----------
    axes
        The axes.
    curve
        The item ``curve`` of `walkers.sweeps.climbing.survival`.
    colour
        Colour of the line.
    band
        The look of its 95 % band, for matplotlib; None: no band.
    label
        Entry of the legend; empty: none.
    """
    time = np.array(curve["time"], dtype=float)
    share = np.array(curve["probability"], dtype=float)
    axes.step(time, share, color=colour, where="post", label=label)
    if band is not None:
        low = np.array(curve["low"], dtype=float)
        high = np.array(curve["high"], dtype=float)
        axes.fill_between(time, low, high, step="post", **band)


def _draw_speeds(axes: Axes, climbs: Sequence[Mapping[str, Any]]) -> None:
    """Speeds of climbs in mm/s against their sizes, on plain walls and in corners."""
    for subset in (_ON_PLAIN_WALLS, _IN_CORNERS):
        sizes = []
        speeds = []
        for climb in climbs:
            belongs = _is_in_corner(climb) == (subset is _IN_CORNERS)
            if belongs and climb["speed"] is not None:
                sizes.append(climb["size"])
                speeds.append(climb["speed"] * 1e3)
        axes.plot(
            sizes,
            speeds,
            subset.marker,
            label=subset.label,
            markerfacecolor="none",
            clip_on=False,
            in_layout=False,  # without climbs a layout would fail
        )
    axes.set(xlabel="beads", ylabel="speed (mm/s)", xlim=(0.0, None), ylim=(0.0, None))


def _is_in_corner(climb: Mapping[str, Any]) -> bool:
    """Whether two or more side walls hold a climb."""
    return bool(climb["walls"] >= WALLS_OF_CORNER)


def draw_rates(
    axes: Axes, climbs: Sequence[Mapping[str, Any]], places: Sequence[float] | IntArray
) -> None:
    """Draw rates with their exact intervals: of all climbs, on plain walls and in corners.

    Parameters
    ----------
    axes
        The axes.
    climbs
        Results of `walkers.api.climb`.
    places
        Height of each condition; their distance is at least 1.
    """
    table = climbing_table(climbs)
    for number, subset in enumerate(_SUBSETS):
        rows = table[table["where"] == subset.label]
        rates = rows["rate"].astype(float)  # NaN without a drive
        errors = [rates - rows["rate_low"], rows["rate_high"] - rates]
        axes.errorbar(
            rates,
            np.array(places) + 0.2 * (number - 1),  # one subset below the other
            xerr=errors,
            fmt=subset.marker,
            label=subset.label,
            linestyle="none",
            markersize=3.0,
        )
    axes.set(xlabel="climbs per run and second", xlim=(0.0, None))


def _draw_rates_of_conditions(axes: Axes, climbs: Sequence[Mapping[str, Any]]) -> None:
    """Draw the rates of conditions, one below the other, with their values at the axis."""
    draw_rates(axes, climbs, np.arange(len(climbs)))
    labels = []
    for numbers in climbs:
        # The condition with the last word of each key, such as ``frequency 100 Hz``.
        condition = re.sub(r"[\w.\[\]]*?(\w+) = ", r"\1 ", numbers["condition"])
        label = f"{condition}: {numbers['climbed']}/{numbers['runs']} climbed"
        labels.append(plain_text(fill(label, _LETTERS_OF_LABEL)))
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)


def write_climbs(climbs: Sequence[Mapping[str, Any]], runs: Sequence[str], to: Path) -> None:
    """Write the results of `walkers.api.climb` to a file.

    Parameters
    ----------
    climbs
        The results.
    runs
        Names of the runs, which are recorded in a figure.
    to
        The file: a table (.csv, SI units), or a figure.
    """
    if to.suffix == ".csv":
        write_bytes(to, climbing_table(climbs).to_csv(index=False).encode())
    else:
        save_figure(climbs_figure(climbs), to, runs, [to.suffix[1:]], "How often piles climb")
