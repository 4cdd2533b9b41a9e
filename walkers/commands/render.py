"""``walkers render``: a picture of a walker."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

Picture = Annotated[Path | None, typer.Option("--to", help="The PNG to write; in the run directory if left out.")]
Walker = Annotated[int, typer.Option("--walker", min=0, help="Number of the walker.")]
Images = Annotated[int, typer.Option("--images", min=1, max=20, help="How many times to show.")]


def command(run: Run, out: Out = DEFAULT_OUT, to: Picture = None, walker: Walker = 0, images: Images = 6) -> None:
    """Render a walker or a pile at several times (off-screen, no X server)."""
    from inputs.errors import InputError, Problem
    from postprocess.rendering import render_run
    from runner.parts import is_pile
    from walkers.pipeline import find_run

    found = find_run(run, out)
    if is_pile(found.directory):
        if walker:
            raise InputError("--walker", [Problem("", None, "a pile has none")])
        from postprocess.pile_figures import render_series

        for path in render_series(found.directory, to, images=images):
            print(path)
        return
    count = len(found.layout.walkers)
    if walker >= count:
        raise InputError("--walker", [Problem("", None, f"expected less than {count}, the run's number of walkers")])
    print(render_run(found.directory, to, walker=walker, images=images))
