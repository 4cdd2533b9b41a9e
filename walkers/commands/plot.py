"""``walkers plot``: the figures of a run, or the figure of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Formats, Out, RunOrSweep, refuse
from walkers.pipeline import DEFAULT_OUT

To = Annotated[
    Path | None,
    typer.Option("--to", help="Of a run the folder for its figures; of a sweep the file (.png, .pdf, .svg)."),
]
X = Annotated[str | None, typer.Option("--x", help="Of a sweep: a key that varies, or a column of its table.")]
Y = Annotated[str | None, typer.Option("--y", help="Of a sweep: a column; velocity, of piles climbs if left out.")]
Hue = Annotated[str | None, typer.Option("--hue", help="Of a sweep: what colours tell apart; or none.")]
Panels = Annotated[str | None, typer.Option("--panels", help="Of a sweep: what panels tell apart; or none.")]
LogX = Annotated[bool, typer.Option("--logx", help="Of a sweep: x logarithmic.")]
LogY = Annotated[bool, typer.Option("--logy", help="Of a sweep: y logarithmic.")]
Theory = Annotated[bool, typer.Option("--theory", help="Of a sweep: what the theory predicts, too.")]


def command(
    run: RunOrSweep,
    out: Out = DEFAULT_OUT,
    to: To = None,
    x: X = None,
    y: Y = None,
    hue: Hue = None,
    panels: Panels = None,
    log_x: LogX = False,
    log_y: LogY = False,
    theory: Theory = False,
    formats: Formats = None,
) -> None:
    """Draw a sweep's table; or a run: where walkers went and turned, and their gait; of a pile, what climbed."""
    from walkers.pipeline import find_run, find_sweep

    sweep = find_sweep(run, out)
    if sweep is not None:
        from walkers.plotting import plot_sweep

        refuse("--format", bool(formats), "is for runs: a sweep's figure has the format of --to's name")
        log = "x" * log_x + "y" * log_y
        print(plot_sweep(sweep, to, x=x, y=y, hue=hue, panels=panels, log=log, theory=theory))
        return
    given = {"--x": x, "--y": y, "--hue": hue, "--panels": panels, "--logx": log_x, "--logy": log_y, "--theory": theory}
    for option, value in given.items():
        refuse(option, bool(value), "is for sweeps")
    for path in find_run(run, out).plot(to, formats or ["png"]):
        print(path)
