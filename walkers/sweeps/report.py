"""Report of a sweep: table, plot, and as many reports of runs as fit."""

from __future__ import annotations

from itertools import cycle
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.extras import require
from walkers.postprocess.drawing import errors_seen
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
from walkers.postprocess.uncertainty import not_known
from walkers.rounding import rounded
from walkers.sweeps.figure import drawn_column, factors_of, joined, readable_key
from walkers.sweeps.readable import readable_unit
from walkers.sweeps.table import SIDES, load, main_columns, result_in, sides_differ, varied_columns, with_unit

if TYPE_CHECKING:
    import pandas as pd
    from bokeh.models import Model

_PLACES = (
    3000  # largest number of beads times frames of a run: fewer than in a report of one run, so that more runs fit
)
_SHOWN = (
    *("gamma0", "sin_delta", "velocity", "rotation_1", "rotation_2", "steady", "walkers", "cycles"),
    *("climbs", "onset", "speed", "highest", "led_by_large", "brazil_nut_end", "merged", "parted", "status"),
)
"""Columns of a sweep's table that the report shows after the varied keys, if they exist."""
_MOST_LEGENDS = 10


def report_sweep(directory: Path, to: Path | None = None, *, largest: int = LARGEST) -> Path:
    """Write the report of a sweep as one HTML file that needs no network.

    The table has all points. Reports of runs, with parameters, results, plots and an animation, are included until the
    file has ``largest`` bytes: the first and the last point, then those halfway between. The page names the others. The
    default file is ``report.html`` in the sweep's directory.
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
        "uncertain": _uncertain(frame),
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


def _uncertain(frame: pd.DataFrame) -> list[str]:
    """A sentence about uncertain parameters that the sweep does not vary."""
    results = [result_in(Path(run)) for run in frame.loc[frame["status"] == "finished", "run"]]
    rests = [one for result in results for one in result.get("rests_on", ()) if one["key"] not in frame.columns]
    return [one.replace("run with", "run a point with") for one in not_known(rests)]


def _spread_out(numbers: list[int]) -> list[int]:
    """Numbers in the order of ends, middle, quarters, …, so that the first ones cover the range."""
    order: dict[int, None] = {}
    parts = 1
    while len(order) < len(numbers):
        order |= dict.fromkeys(numbers[round(part * (len(numbers) - 1) / parts)] for part in range(parts + 1))
        parts *= 2
    return list(order)


def _table(frame: pd.DataFrame) -> dict[str, Any]:
    """Heads and rows of varied keys (units of the file) and results (readable units); equal values are ``shared``."""
    varied, units = varied_columns(frame), frame.attrs["units"]
    apart = sides_differ(frame)
    wanted = [one for name in _SHOWN for one in (SIDES if apart and name == "velocity" else (name,))]
    results = [name for name in wanted if name in frame and name not in varied and frame[name].notna().any()]
    shown = {name: (units[name], 1.0) for name in varied} | {name: readable_unit(units[name]) for name in results}
    heads = {name: with_unit(readable_key(name), unit) for name, (unit, _) in shown.items()}
    cells = {
        name: [_cell(row[name], size, unit or "") for _, row in frame.iterrows()]
        for name, (unit, size) in shown.items()
    }
    same = [name for name in shown if len(frame) > 1 and len({str(cell) for cell in cells[name]}) == 1]
    kept = [name for name in shown if name not in same]
    return {
        "head": [heads[name] for name in kept],
        "rows": list(zip(*(cells[name] for name in kept), strict=True)) if kept else [[] for _ in frame.index],
        "shared": ", ".join(f"{readable_key(name)} {cells[name][0]['text']} {shown[name][0]}".strip() for name in same),
    }


def _cell(value: Any, size: float, unit: str) -> dict[str, Any]:
    if isinstance(value, (bool, np.bool_, str)):
        return {"text": str(value), "value": None}
    if value is None or not isfinite(value):
        return {"text": "–", "value": None}
    number = float(value)
    if number.is_integer() and size == 1.0:
        return {"text": f"{number:g}", "value": number}
    return {"text": rounded(number / size, unit), "value": number}


def _overview(frame: pd.DataFrame) -> Model | None:
    """The main result against the varied number with the most values; a colour for each value of all other keys."""
    result = next((name for name in main_columns(frame) if name in frame and frame[name].notna().any()), None)
    factors = factors_of(frame)
    numbers = [one for one in factors if one.is_number]
    if result is None or not numbers:
        return None
    x = max(numbers, key=lambda one: len(one.levels))
    others, drawn = joined([one for one in factors if one is not x]), drawn_column(frame, result)
    seen = errors_seen(drawn.errors, drawn.values)
    text = f"; {drawn.bars}" + ("" if seen else ", smaller than the symbols") if np.isfinite(drawn.errors).any() else ""
    plot = new_plot(f"{drawn.label} against {x.name}{text}", x.label.replace("\n", " "), drawn.label, height=380)
    places, known = np.array(x.values), np.isfinite(drawn.values)
    levels = others.levels if others else [None]
    for level, colour in zip(levels, cycle(COLOURS), strict=False):
        rows = np.flatnonzero(known & others.where(level) if others else known)
        rows = rows[np.argsort(places[rows], kind="stable")]
        along, values = places[rows], drawn.values[rows]
        legend: dict[str, Any] = {"legend_label": others.text(level)} if others and len(levels) <= _MOST_LEGENDS else {}
        plot.line(along, values, color=colour, line_alpha=0.4, **legend)
        plot.scatter(along, values, color=colour, size=7, **legend)
        if seen:
            error_bars(plot, along, values, drawn.errors[rows])
    if others and plot.legend:
        plot.legend.title = others.name
    return with_legend(plot)
