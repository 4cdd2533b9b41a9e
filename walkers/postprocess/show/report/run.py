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
from walkers.postprocess.measure.in_words import motion_in_words
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.measure.numbers import rows
from walkers.postprocess.measure.results import (
    BAND_NOTE,
    Results,
    has_band,
    headlines,
    main_parts,
    not_computed,
    read_results,
)
from walkers.postprocess.measure.uncertainty import fixed_values, fixed_values_text
from walkers.postprocess.show.figures import figures_of
from walkers.postprocess.show.report.page import (
    LARGEST_REPORT,
    REPORT_NAME,
    check_report,
    page_of,
    render_html,
    svg_of,
)
from walkers.postprocess.show.report.player import MOST_PLACES, player_of
from walkers.runner.manifest import read_manifest
from walkers.runner.run_directory import case_of, is_finished

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Origins = tuple[Origin, ...] | None
"""Sources of the values of a case; None: as recorded in the run."""


def report_run(
    directory: Path,
    destination: Path | None = None,
    origins: Origins = None,
    *,
    figures: Mapping[str, Figure] = {},
    largest: int = LARGEST_REPORT,
) -> Path:
    """Write the report of a run as a self-contained HTML file.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The file; None: ``report.html`` in the run directory.
    origins
        Sources of the values of the case.
    figures
        Further figures by name, such as that of the spread of the run.
    largest
        The file has fewer bytes than this; the player of a run of many beads therefore shows fewer
        frames.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the file is no HTML file, or its folder cannot be made.
    walkers.postprocess.measure.dump.DumpError
        If a dump cannot be read.
    """
    require("report")
    path = destination or directory / REPORT_NAME
    check_report(path)
    results = read_results(directory, origins)
    motion = read_motion(directory)
    drawn = figures_of(results) | dict(figures)
    run = {
        "name": directory.resolve().name,
        "title": motion.case.title or motion.case.name,
        "summary": f"{caption(motion.case)}.",
        "main": main_parts(results),
        "in_words": motion_in_words(results),
        "result": report_values(motion.case, results, origins),
        "manifest": read_manifest(directory) if is_finished(directory) else {},
        "figures": {name: svg_of(figure) for name, figure in drawn.items()},
    }
    places = MOST_PLACES
    page = _page(run, motion, places)
    while len(page) >= largest and places > len(motion.radius):
        places //= 2
        page = _page(run, motion, places)
    write_bytes(path, page)
    return path


def _page(run: Mapping[str, Any], motion: Motion, places: int) -> bytes:
    """The page of a run, with a player of at most ``places`` beads times frames."""
    plot, (begin, end), captions = player_of(motion, places=places)
    values = {
        "run": run,
        "camera": plot.camera,
        "begin": begin,
        "end": end,
        "captions": captions,
    }
    body = render_html("run.html.j2", values)
    player = base64.b64encode(plot.get_binary_snapshot(9)).decode()
    return page_of(run["title"], body, {"player": player}).encode()


def report_values(case: Case, results: Results, origins: Origins = None) -> dict[str, Any]:
    """What a report says of a result, by the names of ``pieces.html.j2``.

    Parameters
    ----------
    case
        The case of the result.
    results
        The result.
    origins
        Sources of the values of the case.

    Returns
    -------
    dict
        Warnings and rows of the result, uncertainties that are not computed, what its band
        contains, and the parameters of its case; those that are guessed or uncertain also by
        themselves.
    """
    if origins is None:
        origins = case.origins
    parameters = []
    guessed = []
    uncertain = []
    for origin in origins:
        parameter = _parameter(origin)
        parameters.append(parameter)
        if origin.word == "guessed":
            guessed.append(parameter)
        elif origin.uncertain:
            uncertain.append(parameter)
    return {
        "warnings": results.warnings,
        "rows": rows(results),
        "not_computed": not_computed(results).text,
        "band": BAND_NOTE,
        "fixed": fixed_values_text(fixed_values(origins)) if has_band(results) else "",
        "guessed": guessed,
        "uncertain": uncertain,
        "parameters": parameters,
    }


def _parameter(origin: Origin) -> dict[str, str]:
    """A row of the table of parameters.

    The ends of the range are as the case file or the library writes them, with their units.
    """
    ends = [text_of(end) for end in origin.range or ()]
    return {
        "key": origin.key,
        "text": origin.text,
        "origin": origin.word,
        "source": origin.source,
        "range": " … ".join(ends),
    }


def result_html(results: Results, origins: Origins = None) -> str:
    """A result as an HTML fragment: table with errors and units, warnings, collapsed parameters.

    ``origins`` are the sources of the values of the case; None: as recorded in the run.
    """
    values = {
        "headlines": headlines(results),
        "result": report_values(case_of(results.directory), results, origins),
        "run": results.directory.name,
    }
    return render_html("result.html.j2", values)
