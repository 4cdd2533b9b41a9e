"""``walkers film``: a film of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

To = Annotated[Path | None, typer.Option("--to", help="The .mp4 or .gif to write; film.mp4 in the run directory.")]
Size = Annotated[str, typer.Option("--size", help="360p, 480p, 720p, 1080p, or pixels as 1280x720.")]
Fps = Annotated[int, typer.Option("--fps", min=1, max=60, help="Pictures a second.")]
Slowdown = Annotated[
    float | None,
    typer.Option("--slowdown", min=0.05, max=10000.0, help="So many times slower than in reality; for 5 to 10 s."),
]
Walker = Annotated[int | None, typer.Option("--walker", min=0, help="Number of the walker to show; the first one.")]
From = Annotated[str | None, typer.Option("--from", help="Physical time of the first picture, as '0.1 s'.")]
Until = Annotated[str | None, typer.Option("--until", help="Physical time of the last picture.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: To = None,
    size: Size = "720p",
    fps: Fps = 25,
    slowdown: Slowdown = None,
    walker: Walker = None,
    begin: From = None,
    end: Until = None,
) -> None:
    """Film a walker, a tray, a cluster or a pile: MP4 or GIF, with time, slow motion and scale (off-screen)."""
    from walkers.pipeline import find_run
    from walkers.postprocess.films import FilmOptions, parse_size, parse_time
    from walkers.progress import progress_of_film

    found = find_run(run, out)
    options = FilmOptions(
        size=parse_size(size),
        fps=fps,
        slowdown=slowdown,
        walker=walker,
        begin=parse_time("--from", begin) if begin else 0.0,
        end=parse_time("--until", end) if end else None,
    )
    with progress_of_film(found.case.name) as advance:
        path = found.film(to, options, on_progress=advance)
    print(path)
