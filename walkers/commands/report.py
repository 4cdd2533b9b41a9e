"""``walkers report``: one HTML file to mail."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers import completion
from walkers.commands.arguments import Out
from walkers.pipeline import DEFAULT_OUT

What = Annotated[
    str,
    typer.Argument(
        metavar="RUN|SWEEP|CALIBRATION",
        help="One of them: its directory, its name in --out, or a case.",
        autocompletion=completion.runs_and_sweeps,
    ),
]
File = Annotated[Path | None, typer.Option("--to", help="The HTML file; report.html in the directory if left out.")]


def command(what: What, out: Out = DEFAULT_OUT, to: File = None) -> None:
    """Write one HTML file to mail: parameters, results, plots, and the beads to be played and turned."""
    from walkers.reports import report

    print(report(what, to, out))
