"""Report of a sweep: its figure, and a table that links to the reports of its runs."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

from walkers.errors import InputError
from walkers.files import write_bytes
from walkers.postprocess.measure.results import Results
from walkers.postprocess.measure.uncertainty import uncertain_value_lines
from walkers.postprocess.show.report.page import (
    REPORT_NAME,
    check_report,
    page_of,
    render_html,
    svg_of,
)
from walkers.sweeps.factors import readable_key
from walkers.sweeps.figure import figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.layout import NO_FACTOR
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.table import SweepTable, cells_of


def report_sweep(table: SweepTable, path: Path) -> Path:
    """Write the report of a sweep as one HTML file that needs no network.

    Points link to the reports of their runs (`walkers.postprocess.show.report.run.report_run`)
    where these exist.

    Parameters
    ----------
    table
        The table of the sweep.
    path
        The file to write.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the path is not that of an HTML file, or its folder cannot be made.
    """
    check_report(path)
    frame = table.frame
    links = [_link(table.results.get(point), path) for point in frame["point"]]
    svg, left_out = _figure(table)
    cells, same = cells_of(frame.drop(columns="run"), readable_key)
    values = {
        "title": frame.attrs["title"],
        "name": frame.attrs["sweep"],
        "points": list(zip(links, cells.to_numpy().tolist(), strict=True)),
        "svg": svg,
        "left_out": left_out,
        "uncertain": "\n".join(uncertain_value_lines(_uncertain_values(table))),
        "heads": list(cells),
        "same": same,
    }
    body = render_html("sweep.html.j2", values, "walkers.sweeps")
    write_bytes(path, page_of(frame.attrs["title"], body).encode())
    return path


def _uncertain_values(table: SweepTable) -> list[dict[str, Any]]:
    """The uncertain values on which the runs rest, without those that the sweep varies.

    Each is a dict with the ``key``, the value and its range
    (`walkers.postprocess.measure.uncertainty.uncertain_values`). What a sweep does not vary is the
    same in all of its runs, so that one entry for each key is enough.
    """
    varied_keys = table.frame.columns
    values = {}
    for result in table.results.values():
        for value in result.about["rests_on"]:
            if value["key"] not in varied_keys:
                values[value["key"]] = value
    return list(values.values())


def _link(result: Results | None, path: Path) -> str:
    """The relative link from a page to the report of a run; empty if there is none."""
    if result is None or not (result.directory / REPORT_NAME).is_file():
        return ""
    return os.path.relpath(result.directory / REPORT_NAME, path.absolute().parent)


def _figure(table: SweepTable) -> tuple[str, list[str]]:
    """The figure as SVG, and sentences about what it leaves out; no SVG if nothing can be drawn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LeftOutWarning)
        try:
            svg = svg_of(figure_of(table, FigureOptions(panels=NO_FACTOR)))
        except InputError as error:
            return "", [str(error)]
    return svg, [str(warning.message) for warning in caught]
