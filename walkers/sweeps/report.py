"""Report of a sweep: its figure, and a table that links to the reports of its runs."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.errors import InputError
from walkers.files import write_bytes
from walkers.postprocess.measure.results import read
from walkers.postprocess.measure.uncertainty import lines_of_rest
from walkers.postprocess.show.report.page import NAME, check_report, fill, page_of, svg_of
from walkers.sweeps.factors import readable_key
from walkers.sweeps.figure import figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.layout import NONE
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.table import cells_of, load

if TYPE_CHECKING:
    import pandas as pd


def report_sweep(directory: Path, to: Path | None = None) -> Path:
    """Write the report of a sweep as one HTML file that needs no network.

    Points link to the reports of their runs (`walkers.postprocess.show.report.run.report_run`) where these exist. The
    default file is ``report.html`` in the sweep's directory.
    """
    path = to or directory / NAME
    check_report(path)
    frame = load(directory)
    reports = (Path(run) / NAME for run in frame["run"])
    links = [os.path.relpath(report, path.absolute().parent) if report.is_file() else "" for report in reports]
    svg, left_out = _figure(frame)
    results = [read(run) for run in frame.loc[frame["status"] == "finished", "run"]]
    rests = {rest["key"]: rest for result in results for rest in result.about["rests_on"] if rest["key"] not in frame}
    cells, same = cells_of(frame.drop(columns="run"), readable_key)
    body = fill(
        "sweep.html.j2",
        "walkers.sweeps",
        title=frame.attrs["title"],
        name=frame.attrs["sweep"],
        points=list(zip(links, cells.to_numpy().tolist(), strict=True)),
        svg=svg,
        left_out=left_out,
        uncertain="\n".join(lines_of_rest([*rests.values()])),
        heads=list(cells),
        same=same,
    )
    write_bytes(path, page_of(frame.attrs["title"], body).encode())
    return path


def _figure(frame: pd.DataFrame) -> tuple[str, list[str]]:
    """The figure as SVG, and the reasons why points are left out or look alike; no SVG if no point can be drawn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LeftOutWarning)
        try:
            svg = svg_of(figure_of(frame, FigureOptions(panels=NONE)))
        except InputError as error:
            return "", [str(error)]
    return svg, [str(warning.message) for warning in caught]
