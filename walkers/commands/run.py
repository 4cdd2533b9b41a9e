"""``walkers run``: cases to results."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from walkers.commands.arguments import Json, Out
from walkers.pipeline import DEFAULT_OUT

Cases = Annotated[list[str], typer.Argument(metavar="CASE...", help="Case files, or names of shipped cases.")]
Force = Annotated[bool, typer.Option("--force", help="Run again even if the run is there.")]
Limit = Annotated[float | None, typer.Option("--limit", min=0.0, help="Stop a run after this many seconds.")]
EngineOption = Annotated[str | None, typer.Option("--engine", help="Name or path of the liggghts binary.")]

DespiteAudit = Annotated[bool, typer.Option("--despite-audit", help="Run on an engine that failed its audit.")]


def command(
    cases: Cases,
    out: Out = DEFAULT_OUT,
    force: Force = False,
    as_json: Json = False,
    limit: Limit = None,
    engine: EngineOption = None,
    despite_audit: DespiteAudit = False,
) -> int:
    """Run cases, unless they have been run, and print their results (with --json an object a line)."""
    from inputs.errors import InputError, Problem
    from inputs.reading import load_case
    from postprocess.report import describe_result
    from runner.failures import EngineFailure
    from walkers.pipeline import run_case
    from walkers.progress import progress_of

    loaded = [load_case(case) for case in cases]  # a mistake in the last file shows before the first run starts
    if out.exists() and not out.is_dir():
        raise InputError("--out", [Problem("", None, f"expected a folder, {out} is a file")])
    failed = 0
    for case in loaded:
        try:
            with progress_of(case) as advance:
                outcome = run_case(
                    case,
                    out,
                    engine=engine,
                    force=force,
                    on_progress=advance,
                    time_limit=limit,
                    despite_audit=despite_audit,
                )
        except EngineFailure as failure:
            print(f"walkers: {case.name}: {failure}", file=sys.stderr)
            failed += 1
            continue
        if as_json:
            print(json.dumps({**outcome.result, "run": str(outcome.run.directory), "found": outcome.found}))
        else:
            print(describe_result(outcome.run.directory, outcome.result, found=outcome.found))
    return 1 if failed else 0
