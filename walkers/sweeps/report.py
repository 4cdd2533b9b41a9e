"""Report of a sweep: its figure, and a table that links to the reports of its runs."""

from __future__ import annotations

import os
import warnings
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.errors import InputError
from walkers.postprocess.quantities import unit_shown
from walkers.postprocess.report.page import NAME, check_report, fill, page_of, svg_of
from walkers.postprocess.results import read
from walkers.postprocess.uncertainty import not_known
from walkers.rounding import rounded
from walkers.runner.files import write_text
from walkers.sweeps.figure import LeftOutWarning, figure_of, readable_key
from walkers.sweeps.table import SIDES, load, sides_differ, with_unit

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = (
    *("gamma0", "sin_delta", "velocity", "rotation_1", "rotation_2", "steady", "walkers", "cycles"),
    *("climbs", "onset", "speed", "highest", "led_by_large", "brazil_nut_end", "merged", "parted", "status"),
)
"""Columns of a sweep's table that the report shows after the varied keys, if they exist."""


def report_sweep(directory: Path, to: Path | None = None) -> Path:
    """Write the report of a sweep as one HTML file that needs no network.

    Points link to the reports of their runs (`walkers.postprocess.report.run.report_run`) where these exist. The
    default file is ``report.html`` in the sweep's directory.
    """
    path = to or directory / NAME
    check_report(path)
    frame = load(directory)
    reports = (Path(run) / NAME for run in frame["run"])
    links = [os.path.relpath(report, path.absolute().parent) if report.is_file() else "" for report in reports]
    svg, left_out = _figure(frame)
    body = fill(
        "sweep.html.j2",
        "walkers.sweeps",
        title=frame.attrs["title"],
        name=frame.attrs["sweep"],
        points=list(zip(frame["point"], links, strict=True)),
        svg=svg,
        left_out=left_out,
        uncertain=_uncertain(frame),
        **_table(frame),
    )
    write_text(path, page_of(frame.attrs["title"], body))
    return path


def _figure(frame: pd.DataFrame) -> tuple[str, list[str]]:
    """The figure as SVG, and what it leaves out; an empty text if no point can be drawn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LeftOutWarning)
        try:
            svg = svg_of(figure_of(frame))
        except InputError as error:
            return "", [str(error)]
    return svg, [str(warning.message) for warning in caught]


def _uncertain(frame: pd.DataFrame) -> list[str]:
    """A sentence about uncertain parameters that the sweep does not vary."""
    results = [read(run) for run in frame.loc[frame["status"] == "finished", "run"]]
    rests = [one for result in results for one in result.about["rests_on"] if one["key"] not in frame.columns]
    return [one.replace("run with", "run a point with") for one in not_known(rests)]


def _table(frame: pd.DataFrame) -> dict[str, Any]:
    """Heads and rows of varied keys (units of the file) and results (readable units); equal values are ``shared``."""
    varied, units = frame.attrs["varied"], frame.attrs["units"]
    apart = sides_differ(frame)
    wanted = [one for name in _SHOWN for one in (SIDES if apart and name == "velocity" else (name,))]
    results = [name for name in wanted if name in frame and name not in varied and frame[name].notna().any()]
    shown = {name: (units[name], 1.0) for name in varied} | {name: unit_shown(units[name] or "") for name in results}
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
    return {"text": rounded(number * size, unit), "value": number}
