"""``walkers render``: a picture or a film of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run, refuse
from walkers.pipeline import DEFAULT_OUT

Picture = Annotated[
    Path | None, typer.Option("--to", help="The PNG or MP4 to write; in the run directory if left out.")
]
Walker = Annotated[int, typer.Option("--walker", min=0, help="Number of the walker.")]
Images = Annotated[int | None, typer.Option("--images", min=1, max=20, help="How many times to show; 6 if left out.")]
Interval = Annotated[
    str | None, typer.Option("--interval", help="Of a pile: time between the pictures, as '2 s' or 'T/4' (of a cycle).")
]
Film = Annotated[bool, typer.Option("--film", help="Of a pile: an MP4 of all frames instead.")]
Slowdown = Annotated[
    float | None,
    typer.Option("--slowdown", min=0.05, max=1000.0, help="Of a film: so many times slower than in reality."),
]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Picture = None,
    walker: Walker = 0,
    images: Images = None,
    interval: Interval = None,
    film: Film = False,
    slowdown: Slowdown = None,
) -> None:
    """Render a walker or a pile at several times, or film a pile (off-screen, no X server)."""
    from walkers.pipeline import find_run
    from walkers.postprocess.pile_pictures import render_film, render_series, seconds_apart
    from walkers.postprocess.rendering import render_run
    from walkers.runner.segments import is_pile

    found = find_run(run, out)
    pile = is_pile(found.directory)
    refuse("--walker", bool(walker) and pile, "a pile has none")
    for option, given in (("--film", film), ("--interval", interval is not None), ("--slowdown", slowdown is not None)):
        refuse(option, given and not pile, "is for piles")
    for option, given in (("--interval", interval is not None), ("--images", images is not None)):
        refuse(option, given and film, "has no meaning for a film")
    refuse("--slowdown", slowdown is not None and not film, "is for films (--film)")
    if film:
        print(render_film(found.directory, to, slowdown=slowdown or 1.0))
    elif pile:
        seconds = None if interval is None else seconds_apart(interval, found.directory)
        for path in render_series(found.directory, to, images=images or 6, apart=seconds):
            print(path)
    else:
        count = len(found.layout.walkers)
        refuse("--walker", walker >= count, f"expected less than {count}, the run's number of walkers")
        print(render_run(found.directory, to, walker=walker, images=images or 6))
