"""Report of a run: parameters with sources, results, figures, and a 3-D player."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.extras import require
from walkers.files import write_bytes
from walkers.inputs.origins import Origin, text_of
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.caption import caption
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.measure.numbers import rows
from walkers.postprocess.measure.results import (
    BAND_NOTE,
    Results,
    has_band,
    headlines,
    not_computed,
    read_results,
)
from walkers.postprocess.measure.uncertainty import fixed_values, fixed_values_text
from walkers.postprocess.show.figures import figures_of
from walkers.postprocess.show.report.page import (
    LARGEST_REPORT,
    REPORT_NAME,
    check_report,
    fill,
    page_of,
    svg_of,
)
from walkers.postprocess.show.report.player import MOST_PLACES, player_of
from walkers.runner.manifest import read_manifest
from walkers.runner.run_directory import case_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Origins = tuple[Origin, ...] | None
"""Sources of the values of a case; None: as recorded in the run."""


def report_run(
    directory: Path,
    to: Path | None = None,
    origins: Origins = None,
    *,
    figures: Mapping[str, Figure] = {},
    largest: int = LARGEST_REPORT,
) -> Path:
    """Write the report of a run as a self-contained HTML file, by default ``report.html`` in the run directory.

    ``origins`` are the sources of the values of its case, ``figures`` further ones, such as that of
    its spread. The player shows fewer frames of runs of many beads, so that the file has fewer
    bytes than ``largest``. `InputError` if the file is no HTML file in an existing folder,
    `walkers.postprocess.measure.dump.DumpError` if a dump cannot be read.
    """
    require("report")
    path = to or directory / REPORT_NAME
    check_report(path)
    results, motion = read_results(directory, origins), read_motion(directory)
    title = motion.case.title or motion.case.name
    run = {
        "name": directory.resolve().name,
        "title": title,
        "summary": f"{caption(motion.case)}.",
        "shown": report_values(motion.case, results, origins),
        "manifest": read_manifest(directory),
        "figures": {
            name: svg_of(figure) for name, figure in {**figures_of(results), **figures}.items()
        },
    }
    places, page = 2 * MOST_PLACES, ""
    while not page or (len(page.encode()) >= largest and places > len(motion.radius)):
        places //= 2
        plot, times, captions = player_of(motion, places=places)
        carried = {"player": base64.b64encode(plot.get_binary_snapshot(9)).decode()}
        body = fill(
            "run.html.j2",
            run=run,
            camera=plot.camera,
            begin=times[0],
            end=times[1],
            captions=captions,
        )
        page = page_of(title, body, carried)
    write_bytes(path, page.encode())
    return path


def report_values(case: Case, results: Results, origins: Origins = None) -> dict[str, Any]:
    """Warnings and rows of a result, what of it is not computed, and parameters of its case with their origins."""
    origins = case.origins if origins is None else origins
    parameters = [
        vars(source)
        | {"range": " … ".join(map(text_of, source.range or ())), "origin": source.word}
        for source in origins
    ]
    banded = has_band(results)
    return {
        "warnings": results.warnings,
        "rows": rows(results),
        "not_computed": not_computed(results).text,
        "band": BAND_NOTE,
        "fixed": fixed_values_text(fixed_values(origins)) if banded else "",
        "guessed": [parameter for parameter in parameters if parameter["origin"] == "guessed"],
        "uncertain": [
            parameter for parameter in parameters if parameter["origin"].endswith("uncertain")
        ],
        "parameters": parameters,
    }


def result_html(results: Results, origins: Origins = None) -> str:
    """A result as an HTML fragment: table with errors and units, warnings, collapsed parameters."""
    shown = report_values(case_of(results.directory), results, origins)
    return fill(
        "result.html.j2", headlines=headlines(results), shown=shown, run=results.directory.name
    )
