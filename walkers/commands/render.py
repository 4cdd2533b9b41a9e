"""``walkers render``: a picture of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run, refuse
from walkers.pipeline import DEFAULT_OUT

Picture = Annotated[Path | None, typer.Option("--to", help="The PNG to write; in the run directory if left out.")]
Walker = Annotated[int | None, typer.Option("--walker", min=0, help="Number of a walker to show by itself.")]
Images = Annotated[int | None, typer.Option("--images", min=1, max=20, help="How many times to show; 6 if left out.")]
Interval = Annotated[
    str | None, typer.Option("--interval", help="Time between views of the whole, as '2 s' or 'T/4' (of a cycle).")
]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Picture = None,
    walker: Walker = None,
    images: Images = None,
    interval: Interval = None,
) -> None:
    """Render a walker at several times, or views of a whole run (off-screen); for films: walkers film."""
    from walkers.pipeline import find_run
    from walkers.postprocess.series import render_series, seconds_apart

    found = find_run(run, out)
    refuse("--interval", interval is not None and walker is not None, "is for views of the whole")
    if walker is not None:
        count = sum(make.replicates for make in found.case.walkers)
        refuse("--walker", not count, "the run has none")
        refuse("--walker", walker >= count, f"expected less than {count}, the run's number of walkers")
        paths = render_series(found.directory, to, images=images or 6, walker=walker)
    elif interval is not None:
        apart = seconds_apart(interval, found.directory)
        paths = render_series(found.directory, to, images=images or 6, apart=apart)
    else:
        paths = found.render(to, images=images or 6)
    for path in paths:
        print(path)
