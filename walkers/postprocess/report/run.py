"""Report of a run: parameters with sources, results, plots, and a 3-D player."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from walkers.extras import require
from walkers.inputs.case import Case
from walkers.inputs.keys import dotted
from walkers.inputs.origins import Origin, text_of
from walkers.postprocess.analysis import (
    Measured,
    analyses_in,
    analyses_of,
    current_result,
    quantities_of,
    uncertainty_of,
    warnings_of,
)
from walkers.postprocess.caption import caption
from walkers.postprocess.report.page import NAME, check_report, drawn, fill, packed_plots, write_page
from walkers.postprocess.report.player import MOST_PLACES, player_of
from walkers.postprocess.uncertainty import rests_on, with_bands
from walkers.runner.directory import case_of
from walkers.runner.manifest import read_manifest

Origins = tuple[Origin, ...] | None
"""Sources of the values of a case; None: as recorded in the run."""


class RunReport:
    """Contents of a section of a page; ``carried`` are the packed data, ``places`` limits the player (`player_of`)."""

    def __init__(
        self, directory: Path, section: str = "run", places: int = MOST_PLACES, origins: Origins = None
    ) -> None:
        from bokeh.layouts import column

        run = Measured(directory)
        case = run.motion.case
        self.id, self.name, self.title = section, directory.resolve().name, case.title or case.name
        rests = {"rests_on": rests_on(origins)} if origins is not None else {}
        self.shown = shown_of(case, with_bands(directory, current_result(directory) | rests), origins)
        self.manifest = read_manifest(directory)
        self.player = player_of(run.motion, places=places)
        self.carried = {f"player-{section}": base64.b64encode(self.player.plot.get_binary_snapshot(9)).decode()}
        figures = (one for analysis in analyses_of(case) for one in analysis.panels(run).values())
        if panels := [panel for figure in figures for panel in figure]:
            plots = column(*map(drawn, panels), sizing_mode="stretch_width")
            self.carried[f"plots-{section}"] = packed_plots(plots)


def report_run(directory: Path, to: Path | None = None, origins: Origins = None) -> Path:
    """Write the report of a run as a self-contained HTML file.

    Parameters
    ----------
    directory, origins
        See `RunReport`.
    to
        The file, smaller than 5 MB; None: ``report.html`` in the run directory.

    Raises
    ------
    InputError, postprocess.dump.DumpError
        If the file is no HTML file in an existing folder; if the dumps cannot be read.
    """
    require("report")
    path = to or directory / NAME
    check_report(path)
    run = RunReport(directory, origins=origins)
    return write_page(path, run.title, fill("run.html.j2", run=run), run.carried)


def shown_of(case: Case, result: dict[str, Any], origins: Origins = None) -> dict[str, Any]:
    """Warnings, quantities and uncertainties of a result; summary and parameters of a case.

    Parameters without recorded origins are in SI units. Given ``origins`` are also the source of what is uncertain.
    """
    if origins is not None:
        result = {**result, "rests_on": rests_on(origins)}
    parameters = [
        vars(one) | {"range": " … ".join(map(text_of, one.range or ())), "origin": one.word}
        for one in (case.origins if origins is None else origins)
    ]
    said = ((key, value) for key, value in dotted(case.as_dict()) if value not in (None, "", [], ()))
    as_run = [{"key": key, "text": text_of(value)} for key, value in said]
    return {
        "summary": f"{caption(case)}.",
        "uncertainty": uncertainty_of(result),
        "warnings": warnings_of(result),
        "quantities": quantities_of(result),
        "guessed": [one for one in parameters if one["origin"] == "guessed"],
        "uncertain": [one for one in parameters if one["origin"].endswith("uncertain")],
        "parameters": parameters or as_run,
    }


def result_html(directory: Path, result: dict[str, Any], origins: Origins = None) -> str:
    """A result as an HTML fragment: table with errors and units, warnings, collapsed parameters."""
    result = with_bands(directory, result)
    headline = next((line for one in analyses_in(result) for line in one.lines(result)), result["case"])
    shown = shown_of(case_of(directory), result, origins)
    return fill("result.html.j2", headline=headline, shown=shown, run=directory.name)
