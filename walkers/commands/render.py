"""``walkers render``: a picture or a film of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

Picture = Annotated[
    Path | None, typer.Option("--to", help="The PNG or MP4 to write; in the run directory if left out.")
]
Walker = Annotated[int, typer.Option("--walker", min=0, help="Number of the walker.")]
Images = Annotated[int, typer.Option("--images", min=1, max=20, help="How many times to show.")]
Apart = Annotated[
    str | None, typer.Option("--apart", help="Of a pile: time between the pictures, as '2 s' or 'T/4' (of a cycle).")
]
Film = Annotated[bool, typer.Option("--film", help="Of a pile: an MP4 of all frames instead.")]
Slower = Annotated[float, typer.Option("--slower", min=0.01, help="Of a film: so many times slower than in reality.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Picture = None,
    walker: Walker = 0,
    images: Images = 6,
    apart: Apart = None,
    film: Film = False,
    slower: Slower = 1.0,
) -> None:
    """Render a walker or a pile at several times, or film a pile (off-screen, no X server)."""
    from inputs.errors import InputError, Problem
    from postprocess.rendering import render_run
    from runner.parts import is_pile
    from walkers.pipeline import find_run

    found = find_run(run, out)
    if is_pile(found.directory):
        from postprocess.pile_pictures import render_film, render_series, seconds_apart

        if walker:
            raise InputError("--walker", [Problem("", None, "a pile has none")])
        if film:
            print(render_film(found.directory, to, slower=slower))
            return
        seconds = None if apart is None else seconds_apart(apart, found.directory)
        for path in render_series(found.directory, to, images=images, apart=seconds):
            print(path)
        return
    if film or apart is not None:
        raise InputError("--film" if film else "--apart", [Problem("", None, "is for piles")])
    count = len(found.layout.walkers)
    if walker >= count:
        raise InputError("--walker", [Problem("", None, f"expected less than {count}, the run's number of walkers")])
    print(render_run(found.directory, to, walker=walker, images=images))
