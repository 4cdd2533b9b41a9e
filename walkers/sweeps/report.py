"""The report of a sweep: its table, a plot of it, and as many whole runs as fit."""

from __future__ import annotations

from itertools import cycle
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.extras import require
from walkers.inputs.readable import readable_unit
from walkers.postprocess.analysis import rounded
from walkers.postprocess.report.page import (
    COLOURS,
    LARGEST,
    NAME,
    check_report,
    error_bars,
    fill,
    new_plot,
    overhead,
    packed_plots,
    with_legend,
    write_page,
)
from walkers.postprocess.report.run import RunReport
from walkers.sweeps.table import ERRORS, RESULTS, load, varied_columns, with_unit

if TYPE_CHECKING:
    import pandas as pd
    from bokeh.models import Model

_PLACES = 3000  # beads times instants of each scene at most: less than in a report of one run, that more runs fit
_SHOWN = (
    *("gamma0", "sin_delta", "velocity", "rotation_1", "rotation_2", "steady", "walkers", "cycles"),
    *("climbs", "onset", "speed", "highest", "led_by_large", "brazil_nut_end", "merged", "parted", "status"),
)
"""Columns of a sweep's table that the report shows, of those that it has, after what varies."""
_MOST_LEGENDS = 10


def report_sweep(directory: Path, to: Path | None = None, *, largest: int = LARGEST) -> Path:
    """Write the report of a sweep: one HTML file to mail, which needs no network.

    The table has all points. Whole runs, with parameters, results, plots and beads to be played, are taken along while
    they fit into so many bytes, first and last first and then those halfway between; the page says which are left out.
    The file is ``report.html`` in the sweep's directory if no other is named.
    """
    require("report")
    frame = load(directory)
    path = to or directory / NAME
    check_report(path)
    done = frame[frame["status"] == "finished"]
    finished = {int(number): Path(run) for number, run in zip(done["point"], done["run"], strict=True)}
    plot = _overview(frame)
    carried = {} if plot is None else {"plots-sweep": packed_plots(plot)}
    values: dict[str, Any] = {
        "title": frame.attrs["title"],
        "name": frame.attrs["sweep"],
        "points": frame["point"].tolist(),
        "has_plot": plot is not None,
        **_table(frame),
    }
    bare = fill("sweep.html.j2", "walkers.sweeps", runs={}, **values)
    room = largest - overhead() - len(bare.encode()) - sum(map(len, carried.values()))
    runs: dict[int, RunReport] = {}
    for number in _spread_out(list(finished)):
        run = RunReport(finished[number], f"point-{number}", _PLACES)
        room -= sum(map(len, run.carried.values())) + len(fill("run.html.j2", run=run).encode()) + 1000
        if room < 0:
            break
        runs[number] = run
        carried |= run.carried
    body = fill("sweep.html.j2", "walkers.sweeps", runs=dict(sorted(runs.items())), **values)
    return write_page(path, values["title"], body, carried)


def _spread_out(numbers: list[int]) -> list[int]:
    """Numbers in an order of which any begin is spread over all: both ends, the middle, and so on."""
    order: dict[int, None] = {}
    parts = 1
    while len(order) < len(numbers):
        order |= dict.fromkeys(numbers[round(part * (len(numbers) - 1) / parts)] for part in range(parts + 1))
        parts *= 2
    return list(order)


def _table(frame: pd.DataFrame) -> dict[str, Any]:
    """Heads and rows of what varied, in the file's units, and what came out, in the usual ones."""
    varied, units = varied_columns(frame), frame.attrs["units"]
    results = [name for name in _SHOWN if name in frame and name not in varied and frame[name].notna().any()]
    shown = {name: (units[name], 1.0) for name in varied} | {name: readable_unit(units[name]) for name in results}
    heads = [with_unit(name if name in varied else name.replace("_", " "), unit) for name, (unit, _) in shown.items()]
    rows = [
        [_cell(row[name], size, row.get(ERRORS.get(name, ""))) for name, (_, size) in shown.items()]
        for _, row in frame.iterrows()
    ]
    return {"head": heads, "rows": rows}


def _cell(value: Any, size: float, error: Any) -> dict[str, Any]:
    """A cell of the table: a number with its error, or a text."""
    if isinstance(value, (bool, np.bool_, str)):
        return {"text": str(value), "value": None}
    if value is None or not isfinite(value):
        return {"text": "–", "value": None}
    number = float(value)
    if number.is_integer() and size == 1.0:
        return {"text": f"{number:g}", "value": number}
    if error is None or not isfinite(error):
        return {"text": rounded(number / size), "value": number}
    of_unit = error / size
    told = {"text": rounded(number / size, of_unit), "error": rounded(of_unit, of_unit)}
    return {**told, "value": number, "error_value": float(error)}


def _overview(frame: pd.DataFrame) -> Model | None:
    """What came out against the number that varies most; a colour for each value of what varies besides."""
    result = next((name for name in RESULTS if name in frame and frame[name].notna().any()), None)
    varied, units = varied_columns(frame), frame.attrs["units"]
    numeric = [name for name in varied if frame[name].map(type).isin((int, float)).all()]
    if result is None or not numeric:
        return None
    x = max(numeric, key=lambda name: frame[name].nunique())
    others = [name for name in varied if name != x]
    unit, size = readable_unit(units[result])
    label = with_unit(result, unit)
    plot = new_plot(f"{label} against {x}, with the standard error", with_unit(x, units[x]), label, height=380)
    known = frame[frame[result].notna()].sort_values(x, kind="stable")
    apart = known[others].astype(str).agg(", ".join, axis=1) if others else known["point"].map(lambda _: "")
    names = list(dict.fromkeys(apart.sort_index()))
    for name, colour in zip(names, cycle(COLOURS), strict=False):
        part = known[apart == name]
        along, values = part[x].to_numpy(float), part[result].to_numpy(float) / size
        legend: dict[str, Any] = {"legend_label": name} if name and len(names) <= _MOST_LEGENDS else {}
        plot.line(along, values, color=colour, line_alpha=0.4, **legend)
        plot.scatter(along, values, color=colour, size=7, **legend)
        if result in ERRORS:
            error_bars(plot, along, values, part[ERRORS[result]].to_numpy(float) / size)
    if plot.legend:
        plot.legend.title = ", ".join(with_unit(name, units[name]) for name in others)
    return with_legend(plot)
