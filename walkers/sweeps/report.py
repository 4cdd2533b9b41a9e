"""The report of a sweep: its table, small pictures of all runs beside each other, and as many whole runs as fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import cycle
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.readable import readable_unit
from walkers.postprocess.analysis import rounded
from walkers.postprocess.gait import distance_walked
from walkers.postprocess.motion import read_motion
from walkers.postprocess.report.page import LARGEST, NAME, check_report, fill, overhead, packed_plots, write_page
from walkers.postprocess.report.plots import COLOURS, error_bars, new_plot, with_legend
from walkers.postprocess.report.run import RunReport
from walkers.postprocess.tables import read_table
from walkers.sweeps.factors import value_text, with_unit
from walkers.sweeps.figure_layout import DEFAULTS, ERRORS
from walkers.sweeps.record import read_record
from walkers.sweeps.table import load, varied_columns

if TYPE_CHECKING:
    import pandas as pd
    from bokeh.models import Model

FloatArray = npt.NDArray[np.float64]

_PLACES = 3000
"""Beads times instants of each scene at most: less than in a report of one run, that more runs fit."""
_SHOWN = (
    *("gamma0", "sin_delta", "velocity", "rotation_1", "rotation_2", "steady", "walkers", "cycles"),
    *("climbs", "onset", "speed", "highest", "led_by_large", "brazil_nut_end", "merged", "parted", "status"),
)
"""Columns of a sweep's table that the report shows, of those that it has, after what varies."""
_MOST_LEGENDS = 10
_MOST_MULTIPLES = 60
"""Small pictures; of more points some are left out, and the page says so."""
_WIDE, _TALL, _EDGE = 200.0, 120.0, 8.0
"""Of a small picture, in its own units."""
_MOST_CORNERS = 80
"""Of a line in it."""


@dataclass(frozen=True)
class Cell:
    """A cell of the table: a number with its error, or a text."""

    text: str
    value: float | None = None
    error: str = ""
    error_value: float | None = None


@dataclass(frozen=True)
class Multiple:
    """A small picture of a run: what it is of, and its lines in its own units, with their colours."""

    point: int
    name: str
    lines: list[tuple[str, str]]


def report_sweep(directory: Path, to: Path | None = None, *, largest: int = LARGEST) -> Path:
    """Write the report of a sweep: one HTML file to mail, which needs no network.

    The table has all points. Whole runs, with parameters, results, plots and beads to be played, are taken along while
    they fit, first and last first and then those halfway between; the page says which are left out.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.
    to
        The file; ``report.html`` in that directory if None.
    largest
        Bytes that it may have.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If it is no sweep's directory, or the name is none of an HTML file.
    """
    record, frame = read_record(directory), load(directory)
    path = to or directory / NAME
    check_report(path)
    rows = zip(frame["point"], frame["run"], frame["status"], strict=True)
    finished = {int(number): Path(run) for number, run, status in rows if status == "finished"}
    in_order = _spread_out(list(finished))
    plot = _overview(frame)
    carried = {} if plot is None else {"plots-sweep": packed_plots(plot)}
    curves = {number: _curves(finished[number]) for number in in_order[:_MOST_MULTIPLES]}
    head, cells = _table(frame)
    values: dict[str, Any] = {
        "title": record.title or record.name,
        "name": record.name,
        "head": head,
        "rows": cells,
        "points": frame["point"].tolist(),
        "has_plot": plot is not None,
        "multiples": _multiples(curves, frame),
    }
    bare = fill("sweep.html.j2", "walkers.sweeps", runs={}, **values)
    room = largest - overhead() - len(bare.encode()) - sum(map(len, carried.values()))
    runs: dict[int, RunReport] = {}
    for number in in_order:
        run = RunReport(finished[number], f"point-{number}", _PLACES)
        needed = sum(map(len, run.carried.values())) + len(fill("run.html.j2", run=run).encode()) + 1000
        if needed > room:
            break
        room -= needed
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


def _table(frame: pd.DataFrame) -> tuple[list[str], list[list[Cell]]]:
    """Heads and rows of what varied, in the file's units, and what came out, in the usual ones."""
    varied, units = varied_columns(frame), frame.attrs["units"]
    results = [name for name in _SHOWN if name in frame and name not in varied]
    results = [name for name in results if name == "status" or frame[name].notna().any()]
    shown = {name: (units[name], 1.0) for name in varied} | {name: readable_unit(units[name]) for name in results}
    heads = [with_unit(name if name in varied else name.replace("_", " "), unit) for name, (unit, _) in shown.items()]
    rows = [
        [_cell(row[name], size, row.get(ERRORS.get(name, ""))) for name, (_, size) in shown.items()]
        for _, row in frame.iterrows()
    ]
    return heads, rows


def _cell(value: Any, size: float, error: Any) -> Cell:
    if isinstance(value, (bool, np.bool_, str)):
        return Cell(str(value))
    if value is None or not isfinite(value):
        return Cell("–")
    number = float(value)
    if number.is_integer() and size == 1.0:
        return Cell(f"{number:g}", number)
    if error is None or not isfinite(error):
        return Cell(rounded(number / size), number)
    return Cell(rounded(number / size, error / size), number, rounded(error / size, error / size), float(error))


def _overview(frame: pd.DataFrame) -> Model | None:
    """What came out against the first number that varies; a colour for each value of what varies besides."""
    result = next((name for name in DEFAULTS if name in frame and frame[name].notna().any()), None)
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


def _curves(directory: Path) -> list[FloatArray]:
    """Distances walked, or heights of a pile's surface and of the highest bead: time in s and mm, shape (2, N)."""
    try:
        bed = read_table(directory, "bed")
    except FileNotFoundError:
        ways = [distance_walked(group) for group in read_motion(directory).groups]
        return [np.stack([time, 1e3 * one]) for time, way in ways for one in way.T]
    return [np.stack([bed["time"], 1e3 * bed[name]]) for name in ("surface", "highest")]


def _multiples(curves: Mapping[int, list[FloatArray]], frame: pd.DataFrame) -> dict[str, Any]:
    """What the page needs to draw the small pictures, all on one scale."""
    every = [curve for one in curves.values() for curve in one]
    if not every:
        return {"pictures": []}
    values = np.concatenate(every, axis=1)
    low, high = np.minimum(values.min(axis=1), 0.0), values.max(axis=1)
    begin, end = np.array([_EDGE, _TALL - _EDGE]), np.array([_WIDE - _EDGE, _EDGE])
    size = (end - begin) / np.where(high > low, high - low, 1.0)

    def drawn(curve: FloatArray) -> str:
        places = begin + (curve.T[:: -(-curve.shape[1] // _MOST_CORNERS)] - low) * size
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)

    names = _names(frame)
    pictures = [
        Multiple(number, names[number], list(zip(map(drawn, ones), cycle(COLOURS))))
        for number, ones in sorted(curves.items())
    ]
    what = "height of the surface and of the highest bead" if "climbs" in frame else "distance walked"
    scale = f"{what}, {low[1]:.3g} to {high[1]:.3g} mm, against time, {low[0]:.3g} to {high[0]:.3g} s"
    zero = f"{(begin - low * size)[1]:.1f}"
    return {"pictures": pictures, "scale": scale, "zero": zero, "wide": _WIDE, "tall": _TALL}


def _names(frame: pd.DataFrame) -> dict[int, str]:
    """What each point is, in words: the values that vary."""
    units, varied = frame.attrs["units"], varied_columns(frame)
    return {
        int(row["point"]): f"point {row['point']}: "
        + ", ".join(f"{value_text(row[name])} {units[name]}".strip() for name in varied)
        for _, row in frame.iterrows()
    }
