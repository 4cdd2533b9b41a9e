"""``walkers sweep``: all points of a sweep file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import AllowFailedAudit, EngineName, Out, Set, SweepFile, check_out, refuse
from walkers.pipeline import DEFAULT_OUT

Jobs = Annotated[int | None, typer.Option("-j", "--jobs", min=1, help="Decks at once; all cores if left out.")]
SitePath = Annotated[Path | None, typer.Option("--site", help="A site file: run on that cluster instead.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would be done, and its cost; write nothing.")]
Retries = Annotated[int, typer.Option("--retries", min=0, help="How often a failed point is tried again.")]
_MANY = 10_000
Limit = Annotated[float | None, typer.Option("--limit", min=0.0, help="Stop an engine after this many seconds.")]


def command(
    sweep: SweepFile,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    jobs: Jobs = None,
    site: SitePath = None,
    dry_run: DryRun = False,
    retries: Retries = 0,
    limit: Limit = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run the points of a sweep that are missing, on all cores or on a cluster; exit status 1 if any failed."""
    from walkers.inputs.changes import settings_of
    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.analysis import lines_of_rest, rests_on
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.run import plan_sweep, run_sweep
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here, load_site
    from walkers.sweeps.summary import describe_status

    loaded = load_sweep(sweep, settings_of(settings or ()))
    check_out(out)
    refuse("--jobs", jobs is not None and site is not None, "a site says by itself how many decks run at once")
    if len(loaded.rows) > _MANY:
        print(f"{loaded.name}: resolving {len(loaded.rows)} points, some 2,000 a second", file=sys.stderr)
    options = Options(jobs or cores_here(), load_site(site) if site else None, retries, limit)
    if dry_run:
        print(plan_sweep(loaded, out, options, engine).as_text())
        return 0
    with progress_of_sweep(loaded.name) as advance:
        record, failures = run_sweep(
            loaded,
            out.resolve() if site else out,
            options,
            engine=engine,
            allow_failed_audit=allow_failed_audit,
            on_progress=advance,
        )
    for failure in failures:
        print(f"walkers: point {failure.point}, {failure.run}: {failure.message}", file=sys.stderr)
    print(describe_status(record.directory))
    same = [one for one in next(loaded.cases()).origins if one.key not in loaded.keys]  # what varies is in the table
    for line in lines_of_rest(rests_on(same)):
        print(line)
    return 1 if failures else 0
