"""The report of a sweep: its table, small pictures of all runs beside each other, and as many whole runs as fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.postprocess.gait import distance_walked
from walkers.postprocess.motion import read_motion
from walkers.postprocess.quantities import Number, rounded
from walkers.postprocess.report.page import LARGEST, NAME, check_report, fill, overhead, packed_plots, write_page
from walkers.postprocess.report.plots import COLOURS, error_bars, new_plot, with_legend
from walkers.postprocess.report.run import RunReport
from walkers.postprocess.tables import read_table
from walkers.sweeps.figure_layout import DEFAULTS, ERRORS
from walkers.sweeps.record import SweepRecord, read_record, states
from walkers.sweeps.table import load

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


@dataclass(frozen=True)
class Cell:
    """A cell of the table: a number with its error, or a text."""

    text: str
    value: float | None = None
    error: str = ""
    error_value: float | None = None


@dataclass(frozen=True)
class Multiple:
    """A small picture of a run: lines in its own units, what it is of, and whether the whole run can be opened."""

    point: int
    name: str
    lines: list[tuple[str, str]]
    opens: bool


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
    whole = set(frame["point"][frame["status"] == "finished"])  # what was damaged since is not
    finished = {
        number: state.directory
        for number, state in enumerate(states(record))
        if number in whole and state.directory is not None
    }
    plot = _overview(frame, record)
    carried = {} if plot is None else {"plots-sweep": packed_plots(plot)}
    curves = {number: _curves(finished[number]) for number in _spread_out(list(finished))[:_MOST_MULTIPLES]}
    head, rows = _table(frame, record)
    values: dict[str, Any] = {
        "title": record.title or record.name,
        "name": record.name,
        "head": head,
        "rows": rows,
        "points": [int(number) for number in frame["point"]],
        "has_plot": plot is not None,
    }
    bare = fill("sweep.html.j2", "walkers.sweeps", runs={}, multiples=_multiples(curves, {}, frame, record), **values)
    room = largest - overhead() - len(bare.encode()) - sum(map(len, carried.values()))
    runs: dict[int, RunReport] = {}
    for number in _spread_out(list(finished)):
        run = RunReport(finished[number], f"point-{number}", _PLACES)
        needed = sum(map(len, run.carried.values())) + len(fill("run.html.j2", run=run).encode()) + 1000
        if needed > room:
            break
        room -= needed
        runs[number] = run
    carried |= {key: value for run in runs.values() for key, value in run.carried.items()}
    body = fill(
        "sweep.html.j2",
        "walkers.sweeps",
        runs=dict(sorted(runs.items())),
        multiples=_multiples(curves, runs, frame, record),
        **values,
    )
    return write_page(path, record.title or record.name, body, carried)


def _spread_out(numbers: list[int]) -> list[int]:
    """Numbers in an order of which any begin is spread over all: both ends, the middle, and so on."""
    order: list[int] = []
    count = len(numbers)
    parts = 1
    while len(order) < count:
        places = (round(part * (count - 1) / parts) for part in range(parts + 1))
        order += [numbers[place] for place in dict.fromkeys(places) if numbers[place] not in order]
        parts *= 2
    return order


def _varied(record: SweepRecord, frame: pd.DataFrame) -> list[str]:
    """The columns of what varies."""
    return [name for name in frame.columns if name.partition("[")[0] in record.units]


def _label(name: str, units: Mapping[str, str]) -> tuple[str, float]:
    """What a column is called, with its unit, and by what its numbers are multiplied."""
    unit = units.get(name, "")
    known = {"m/s": ("mm/s", 1e3), "m": ("mm", 1e3)}
    shown, factor = known.get(unit, (unit, 1.0))
    return f"{name.replace('_', ' ')} ({shown})" if shown else name.replace("_", " "), factor


def _table(frame: pd.DataFrame, record: SweepRecord) -> tuple[list[str], list[list[Cell]]]:
    """Heads and rows of what varied and what came out."""
    varied = _varied(record, frame)
    columns = varied + [name for name in _SHOWN if name in frame and name not in varied]
    columns = [name for name in columns if name in varied or name == "status" or frame[name].notna().any()]
    units = frame.attrs["units"]
    # What is varied is in the file's unit already.
    labels = [
        (f"{name} ({units[name]})" if units[name] else name, 1.0) if name in varied else _label(name, units)
        for name in columns
    ]
    rows = []
    for _, row in frame.iterrows():
        cells = []
        for name, (_, factor) in zip(columns, labels, strict=True):
            error = row.get(ERRORS.get(name, ""))
            cells.append(_cell(row[name], factor, error))
        rows.append(cells)
    return [label for label, _ in labels], rows


def _cell(value: Any, factor: float, error: Any) -> Cell:
    if value is None or isinstance(value, (bool, np.bool_, str)):
        return Cell("–" if value is None else str(value))
    number = float(value)
    if not isfinite(number):
        return Cell("–")
    doubt = float(error) if error is not None and isfinite(float(error)) else None
    if number.is_integer() and factor == 1.0:
        return Cell(f"{number:g}", number)
    shown = Number("", number, "", factor, doubt).text
    if doubt is None:
        return Cell(shown, number)
    return Cell(shown, number, rounded(doubt * factor, doubt * factor), doubt)


def _overview(frame: pd.DataFrame, record: SweepRecord) -> Model | None:
    """What came out against the first number that varies; a colour for each value of what varies besides."""
    result = next((name for name in DEFAULTS if name in frame and frame[name].notna().any()), None)
    numeric = [name for name in _varied(record, frame) if frame[name].map(type).isin((int, float)).all()]
    if result is None or not numeric:
        return None
    x = max(numeric, key=lambda name: frame[name].nunique())
    others = [name for name in _varied(record, frame) if name != x]
    units = frame.attrs["units"]
    label, factor = _label(result, units)
    plot = new_plot(
        f"{label} against {x}, with the standard error", f"{x} ({units[x]})" if units[x] else x, label, height=380
    )
    known = frame[frame[result].notna()]
    groups: list[tuple[Any, pd.DataFrame]] = [((), known)]
    if others:
        groups = list(known.groupby([known[name].astype(str) for name in others], sort=False))
    for number, (key, part) in enumerate(groups):
        ordered = part.sort_values(x)
        along, values = ordered[x].to_numpy(float), ordered[result].to_numpy(float) * factor
        legend: dict[str, Any] = (
            {"legend_label": ", ".join(map(str, key))} if key and len(groups) <= _MOST_LEGENDS else {}
        )
        colour = COLOURS[number % len(COLOURS)]
        plot.line(along, values, color=colour, line_alpha=0.4, **legend)
        plot.scatter(along, values, color=colour, size=7, **legend)
        if result in ERRORS:
            error_bars(plot, along, values, ordered[ERRORS[result]].to_numpy(float) * factor)
    if plot.legend:
        plot.legend.title = ", ".join(f"{name} ({units[name]})" if units[name] else name for name in others)
    return with_legend(plot)


def _curves(directory: Path) -> list[tuple[FloatArray, FloatArray]]:
    """Distances walked, or heights of a pile's surface and of the highest bead: time in s, mm."""
    try:
        bed = read_table(directory, "bed")
    except FileNotFoundError:
        motion = read_motion(directory)
        return [(time, 1e3 * one) for group in motion.groups for time, way in [distance_walked(group)] for one in way.T]
    return [(bed["time"].to_numpy(), 1e3 * bed[name].to_numpy()) for name in ("surface", "highest")]


def _multiples(
    curves: Mapping[int, list[tuple[FloatArray, FloatArray]]],
    runs: Mapping[int, RunReport],
    frame: pd.DataFrame,
    record: SweepRecord,
) -> dict[str, Any]:
    """The small pictures, on one scale."""
    every = [curve for one in curves.values() for curve in one]
    if not every:
        return {"pictures": []}
    time, height = (np.concatenate(values) for values in zip(*every, strict=True))
    low = np.array([min(time.min(), 0.0), min(height.min(), 0.0)])
    high = np.array([time.max(), height.max()])
    span = np.where(high > low, high - low, 1.0)

    def drawn(time: FloatArray, values: FloatArray) -> str:
        x = _EDGE + (time - low[0]) / span[0] * (_WIDE - 2.0 * _EDGE)
        y = _TALL - _EDGE - (values - low[1]) / span[1] * (_TALL - 2.0 * _EDGE)
        thin = slice(None, None, -(-len(x) // 80))
        return " ".join(f"{one:.1f},{other:.1f}" for one, other in zip(x[thin], y[thin], strict=True))

    names = dict(_names(frame, record))
    pictures = [
        Multiple(
            number,
            names[number],
            [(drawn(*curve), COLOURS[place % len(COLOURS)]) for place, curve in enumerate(curves[number])],
            number in runs,
        )
        for number in sorted(curves)
    ]
    what = "height of the surface and of the highest bead" if "pile" in record.analyses else "distance walked"
    scale = f"{what}, {low[1]:.3g} to {high[1]:.3g} mm, against time, {low[0]:.3g} to {high[0]:.3g} s"
    zero = _TALL - _EDGE + low[1] / span[1] * (_TALL - 2.0 * _EDGE)
    return {"pictures": pictures, "scale": scale, "zero": f"{zero:.1f}", "wide": _WIDE, "tall": _TALL}


def _names(frame: pd.DataFrame, record: SweepRecord) -> Iterator[tuple[int, str]]:
    """What each point is, in words: the values that vary."""
    units = frame.attrs["units"]
    for _, row in frame.iterrows():
        values = [
            f"{row[name]:g}" if isinstance(row[name], (int, float)) else str(row[name])
            for name in _varied(record, frame)
        ]
        told = [f"{value} {units[name]}".strip() for value, name in zip(values, _varied(record, frame), strict=True)]
        yield int(row["point"]), f"point {row['point']}: {', '.join(told)}"
