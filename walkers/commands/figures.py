"""``walkers figures``: the paper's figures and published numbers, beside ours."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import AllowFailedAudit, EngineName, Formats, Out
from walkers.pipeline import DEFAULT_OUT

To = Annotated[Path, typer.Option("--to", help="Folder of the figures.")]
Only = Annotated[list[str] | None, typer.Option("--only", help="Name of a figure, or comparison; may be repeated.")]
Jobs = Annotated[int | None, typer.Option("-j", "--jobs", min=1, help="Decks at once; all cores if left out.")]


def command(
    out: Out = DEFAULT_OUT,
    to: To = Path("figures"),
    only: Only = None,
    formats: Formats = None,
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Draw the paper's figures with engine, theory and published values; runs that are missing are made first."""
    from walkers.paper.make import FORMATS, make_figures
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here

    made = make_figures(
        out,
        to,
        Options(jobs or cores_here()),
        only=only or (),
        formats=formats or FORMATS,
        engine=engine,
        allow_failed_audit=allow_failed_audit,
        progress_of=progress_of_sweep,
    )
    for sweep, failures in made.failures.items():
        for failure in failures:
            print(f"walkers: {sweep}: point {failure.point}, {failure.run}: {failure.message}", file=sys.stderr)
    for figure, reason in made.left_out.items():
        print(f"walkers: {figure} is left out: {reason}", file=sys.stderr)
    for file in made.files:
        print(file)
    if made.compared:
        print(f"{made.agree} of {made.compared} published numbers agree: {to / 'comparison.md'}")
    return 1 if made.failures or made.left_out else 0
