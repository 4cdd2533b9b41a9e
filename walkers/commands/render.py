"""``walkers render``: a picture of a walker."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

Picture = Annotated[Path | None, typer.Option("--to", help="The PNG to write; RUN/walker.png if left out.")]
Walker = Annotated[int, typer.Option("--walker", min=0, help="Number of the walker.")]
Images = Annotated[int, typer.Option("--images", min=1, max=20, help="How many times to show.")]


def command(run: Run, out: Out = DEFAULT_OUT, to: Picture = None, walker: Walker = 0, images: Images = 4) -> None:
    """Render a walker at several times of its way, one below the other (off-screen, no X server)."""
    from inputs.errors import InputError, Problem
    from postprocess.rendering import render_run
    from walkers.pipeline import find_run

    found = find_run(run, out)
    count = len(found.layout.walkers)
    if walker >= count:
        raise InputError("--walker", [Problem("", None, f"expected less than {count}, the run's number of walkers")])
    print(render_run(found.directory, to, walker=walker, images=images))
