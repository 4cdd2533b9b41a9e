"""``walkers run``: cases to results."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from walkers.commands.arguments import AllowFailedAudit, Cases, EngineName, Json, Out, Set, check_out, load, refuse
from walkers.pipeline import DEFAULT_OUT

if TYPE_CHECKING:
    from walkers.inputs.case import Case
    from walkers.sweeps.spread import Spread

Force = Annotated[bool, typer.Option("--force", help="Run again even if the run is there.")]
Limit = Annotated[
    float | None, typer.Option("--limit", min=0.0, help="Stop a run (of a pile: a segment) after this many seconds.")
]

SpreadFlag = Annotated[
    bool,
    typer.Option(
        "--spread",
        help="Also with what is guessed, calibrated or uncertain drawn from its range: a band.",
    ),
]
Points = Annotated[int | None, typer.Option("--points", min=2, max=4096, help="Of the spread; 32 if left out.")]


def command(
    cases: Cases,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    force: Force = False,
    as_json: Json = False,
    limit: Limit = None,
    spread: SpreadFlag = False,
    points: Points = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases, unless they have been run, and print their results (with --json an object a line)."""
    from walkers.pipeline import run
    from walkers.progress import progress_of
    from walkers.runner.failures import EngineFailure

    refuse("--points", points is not None and not spread, "is for --spread")
    loaded = [load(case, settings) for case in cases]  # a mistake in the last file shows before the first run starts
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
                    progress=advance,
                    time_limit=limit,
                    allow_failed_audit=allow_failed_audit,
                )
        except EngineFailure as failure:
            print(f"walkers: {case.name}: {failure}", file=sys.stderr)
            failed += 1
            continue
        band = _spread(case, out, points, engine, allow_failed_audit) if spread else None
        if as_json:
            found = {"spread": band.as_dict()} if band else {}
            print(json.dumps({**done.result, **found, "run": str(done.directory), "cached": done.cached}))
        else:
            print(done.describe())
        if band and not as_json:
            print(_described(band, done.result))
        failed += bool(band and band.failures)
    return 1 if failed else 0


def _spread(case: Case, out: Path, points: int | None, engine: str | None, allow_failed_audit: bool) -> Spread:
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here
    from walkers.sweeps.spread import POINTS, run_spread

    with progress_of_sweep(f"{case.name}, spread") as advance:
        return run_spread(
            case,
            out,
            Options(cores_here()),
            points=points or POINTS,
            engine=engine,
            allow_failed_audit=allow_failed_audit,
            on_progress=advance,
        )


def _described(band: Spread, result: dict[str, Any]) -> str:
    from walkers.sweeps.spread import describe

    return describe(band, result)
