"""Table and figure of `walkers climb`: how often, how fast and where piles climb in each condition."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, plain_text, save_figure, styled
from walkers.runner.files import write_bytes

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 2.1  # inches
_LETTERS = 44  # of a line in labels of conditions
_KINDS = {"all": ("", "ko"), "plain walls": ("on_plain_walls", "C1s"), "corners": ("in_corners", "C2^")}
"""All climbs and their parts: key of `walkers.sweeps.climbing.summarise_climbs`, colour and marker."""
_COLUMNS = (
    *("condition", "where", "runs", "seconds", "within", "climbed", "probability", "probability_low"),
    *("probability_high", "estimator", "median", "climbs", "rate", "rate_low", "rate_high", "dispersion"),
    *("led_by_large", "share_of_large", "p_among_beads", "p_among_own"),
)


def table_of(climbs: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """The results of `walkers.api.climb` as a table, SI units: a row for each condition and part of its climbs."""
    import pandas as pd

    rows = []
    for condition in climbs:
        for where, (key, _) in _KINDS.items():
            row = {**(condition[key] if key else condition), "condition": condition["condition"], "where": where}
            for name, ends in (("probability", row["interval"]), ("rate", row["rate_interval"])):
                row |= dict(zip((f"{name}_low", f"{name}_high"), ends or (np.nan, np.nan), strict=True))
            rows.append(row)
    return pd.DataFrame(rows, columns=_COLUMNS)


@styled
def climbs_figure(climbs: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the results of `walkers.api.climb`.

    The first row shows the first condition: the share of piles that have climbed by a time (Kaplan and Meier's
    estimate), and speeds against sizes. Below are the rates of all conditions with their exact 95 % intervals, and the
    number of piles that climbed.
    """
    heights = [1.0, 0.3 + len(climbs) / 6.0]
    mosaic = [["survival", "climbs"], ["rates", "rates"]]
    figure, axes = new_figure(TWO_COLUMNS, _ROW * sum(heights), mosaic=mosaic, height_ratios=heights)
    _draw_survival(axes["survival"], climbs[0]["curve"])
    _draw_climbs(axes["climbs"], climbs[0]["each"])
    _draw_rates(axes["rates"], table_of(climbs))
    letter_panels(axes.values())
    figure.legend(*axes["rates"].get_legend_handles_labels(), loc="outside lower center", ncols=len(_KINDS))
    return figure


def _draw_survival(panel: Axes, curve: Mapping[str, Sequence[float | None]]) -> None:
    time, share, low, high = (np.array(curve[name], dtype=float) for name in ("time", "probability", "low", "high"))
    panel.step(time, share, "k", where="post")
    panel.fill_between(time, low, high, step="post", color="0.85")
    panel.set(xlabel="time of drive (s)", ylabel="share that has climbed", ylim=(0.0, 1.02), xlim=(0.0, None))


def _draw_climbs(panel: Axes, climbs: Sequence[Mapping[str, Any]]) -> None:
    for where, (key, look) in list(_KINDS.items())[1:]:
        some = [
            one for one in climbs if one["speed"] is not None and (" " in one["wall_names"]) == (key == "in_corners")
        ]
        sizes, speeds = [one["size"] for one in some], [one["speed"] * 1e3 for one in some]
        panel.plot(sizes, speeds, look, markerfacecolor="none", label=where, clip_on=False)
    panel.set(xlabel="beads", ylabel="speed (mm/s)", xlim=(0.0, None), ylim=(0.0, None))


def _draw_rates(panel: Axes, table: pd.DataFrame) -> None:
    """Rates with their exact intervals, one condition above the other."""
    first = table[table["where"] == "all"]
    for number, (where, (_, look)) in enumerate(_KINDS.items()):
        rows = table[table["where"] == where]
        at, rates = np.arange(len(rows)) + 0.2 * (number - 1), rows["rate"].astype(float)  # NaN without a drive
        errors = [rates - rows["rate_low"], rows["rate_high"] - rates]
        panel.errorbar(rates, at, xerr=errors, fmt=look, label=where, linestyle="none", markersize=3.0)
    labels = [
        fill(f"{_in_short(one['condition']) or 'usual'}: {one['climbed']}/{one['runs']} climbed", _LETTERS)
        for one in first.to_dict("records")
    ]
    panel.set_yticks(range(len(labels)), list(map(plain_text, labels)))
    panel.set(xlabel="climbs per run and second", xlim=(0.0, None), ylim=(len(labels) - 0.5, -0.5))


def _in_short(condition: str) -> str:
    """The label of a condition with the last word of each key, such as ``frequency 100 Hz``."""
    return re.sub(r"[\w.\[\]]*?(\w+) = ", r"\1 ", condition)


def write_climbs(climbs: Sequence[Mapping[str, Any]], runs: Sequence[str], to: Path) -> None:
    """Write the results of `walkers.api.climb` as a table or as a figure.

    Parameters
    ----------
    climbs, runs
        The results for each condition; the names of their runs.
    to
        A .csv file for the table (SI units), or a figure (`walkers.postprocess.drawing.FORMATS`).
    """
    if to.suffix == ".csv":
        write_bytes(to, table_of(climbs).to_csv(index=False).encode())
    else:
        save_figure(climbs_figure(climbs), to, runs, [to.suffix[1:]], "How often piles climb")
