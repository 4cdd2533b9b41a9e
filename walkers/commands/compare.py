"""``walkers compare``: two runs, cases or sweeps side by side."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from walkers.commands.arguments import Json, Out, RunOrSweep, refuse
from walkers.pipeline import DEFAULT_OUT

Y = Annotated[str | None, typer.Option("--y", help="Of sweeps: a column; velocity, of piles climbs if left out.")]


def command(first: RunOrSweep, second: RunOrSweep, out: Out = DEFAULT_OUT, y: Y = None, as_json: Json = False) -> None:
    """Print by what two runs or cases differ, in parameters and results; or two sweeps, point by point."""
    from walkers.pipeline import find_side, find_sweep
    from walkers.sweeps.comparison import Comparison, SweepComparison, compare_runs, compare_sweeps

    sweeps = [find_sweep(one, out) for one in (first, second)]
    found: Comparison | SweepComparison
    if sweeps[0] is not None and sweeps[1] is not None:
        found = compare_sweeps(sweeps[0], sweeps[1], y)
    else:
        for one, sweep in zip((first, second), sweeps, strict=True):
            refuse(one, sweep is not None, "is a sweep, to be compared with another sweep")
        refuse("--y", y is not None, "is for sweeps")
        found = compare_runs(find_side(first, out), find_side(second, out))
    print(json.dumps(found.as_dict(), indent=2, ensure_ascii=False) if as_json else found.as_text())
