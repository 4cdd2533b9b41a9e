"""``walkers clean``: remove what is not needed from a folder of runs."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from walkers.commands.arguments import CaseName, OlderThan, Out, Runs, check_out, refuse
from walkers.pipeline import DEFAULT_OUT

Finished = Annotated[bool, typer.Option("--finished", help="Finished runs too, but those that a sweep has.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would go; remove nothing.")]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")]


def command(
    runs: Runs = None,
    out: Out = DEFAULT_OUT,
    finished: Finished = False,
    case: CaseName = None,
    older_than: OlderThan = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> int:
    """Remove interrupted and failed runs, or given runs and sweeps, after asking; never what is being made."""
    from walkers.sweeps.cleaning import clean, plan_cleaning

    check_out(out)
    refuse("--finished", finished and bool(runs), "has no meaning with given runs")
    plan = plan_cleaning(out, runs or (), finished=finished, case=case, older_than=older_than)
    print(plan.as_text())
    if dry_run or not (plan.remove or plan.locks):
        return 0
    if not yes:
        refuse("--yes", not sys.stdin.isatty(), "expected, for there is no terminal at which to ask")
        if not typer.confirm("remove them?"):
            print("nothing removed")
            return 0
    left = clean(plan)
    for directory, why in left.items():
        print(f"walkers: {directory}: {why}", file=sys.stderr)
    return 1 if left else 0
