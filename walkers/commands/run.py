"""``walkers run``: cases to results."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from walkers.commands.arguments import AllowFailedAudit, Cases, EngineName, Json, Out, check_out
from walkers.pipeline import DEFAULT_OUT

Force = Annotated[bool, typer.Option("--force", help="Run again even if the run is there.")]
Limit = Annotated[
    float | None, typer.Option("--limit", min=0.0, help="Stop a run (of a pile: a segment) after this many seconds.")
]


def command(
    cases: Cases,
    out: Out = DEFAULT_OUT,
    force: Force = False,
    as_json: Json = False,
    limit: Limit = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases, unless they have been run, and print their results (with --json an object a line)."""
    from walkers.inputs.reading import load_case
    from walkers.pipeline import run
    from walkers.progress import progress_of
    from walkers.runner.failures import EngineFailure

    loaded = [load_case(case) for case in cases]  # a mistake in the last file shows before the first run starts
    check_out(out)
    failed = 0
    for case in loaded:
        try:
            with progress_of(case.name) as advance:
                done = run(
                    case,
                    out,
                    engine=engine,
                    force=force,
                    on_progress=advance,
                    time_limit=limit,
                    allow_failed_audit=allow_failed_audit,
                )
        except EngineFailure as failure:
            print(f"walkers: {case.name}: {failure}", file=sys.stderr)
            failed += 1
            continue
        if as_json:
            print(json.dumps({**done.result, "run": str(done.directory), "cached": done.cached}))
        else:
            print(done.describe())
    return 1 if failed else 0
