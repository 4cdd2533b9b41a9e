"""``walkers plot``: the figures of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Formats, Out, Run
from walkers.pipeline import DEFAULT_OUT

Folder = Annotated[Path | None, typer.Option("--to", help="Folder for the figures; the run directory if left out.")]


def command(run: Run, out: Out = DEFAULT_OUT, to: Folder = None, formats: Formats = None) -> None:
    """Draw where the walkers went and turned, and their gait through two cycles; of a pile, what climbed."""
    from walkers.pipeline import find_run

    for path in find_run(run, out).plot(to, formats or ["png"]):
        print(path)
