"""Commands that prepare and run simulations."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    AllowFailedAudit,
    By,
    Case,
    EngineName,
    Jobs,
    Json,
    Out,
    Set,
    changes_of,
    check_folder,
    load_case,
    on_cores,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.completion import offering

_MANY = 10_000
"""Number of points that take seconds to resolve."""
_NAME = "Name of the case; the file is NAME.toml."
_COPIED = "Shipped case to copy: fig1b (a walker), climber, cluster, tray, pile-small, ... (list: walkers library)."
_OFFERED = offering("case", "run")
_CASES = "Case files, names of shipped cases, or runs (name or folder)."
_LIMIT = "Time limit in s for each run; for piles, for each segment."
_SPREAD = "Also run with uncertain values drawn from their ranges, and print the band of the result."
_SWEEP_FILE = "A sweep file, or the name of a shipped sweep such as fig2."


def new(
    name: str = Argument(metavar="NAME", help=_NAME),
    case: str = Argument("fig1b", metavar="CASE", help=_COPIED, autocompletion=offering("case")),
    schema: bool = Option(False, "--schema", help="Also write case.schema.json, which editors use."),
) -> None:
    """Write a commented case file as a starting point."""
    from walkers.new import write_case

    print(*write_case(Path(name), case, schema=schema), sep="\n")


def show(
    case: Case,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    theory: bool = Option(
        False, "--theory", help="Print the theory's prediction, with the result of the run if it exists."
    ),
    as_json: Json = False,
) -> None:
    """Show all values of a case with their sources, the forces, the time step and the predicted run time."""
    loaded = load_case(case, settings, out)
    if not theory:
        from walkers.show import describe, summarise

        summary = summarise(loaded)
        print_as(as_json, lambda: summary, lambda: describe(summary))
        return
    from walkers.errors import InputError, Problem
    from walkers.paper.published import outside_of_the_paper
    from walkers.pipeline import load_run
    from walkers.runner.failures import EngineMissing
    from walkers.theory import prediction

    try:
        predicted = {**prediction.predict(loaded), "outside": outside_of_the_paper(loaded)}
    except ValueError as error:
        key, _, why = str(error).partition(": ")
        raise InputError(case, [Problem(key, None, why)]) from error
    found: dict[str, Any] | None = None
    with suppress(InputError, EngineMissing):  # no run yet, or no engine
        found = load_run(loaded, out).result
    print_as(as_json, lambda: {**predicted, "engine": found}, lambda: prediction.describe(predicted, found))


def run(
    cases: list[str] = Argument(metavar="CASE", help=_CASES, autocompletion=_OFFERED),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    force: bool = Option(False, "--force", help="Run again if the run exists."),
    as_json: Json = False,
    limit: float | None = Option(None, min=0.0, help=_LIMIT),
    spread: bool = Option(False, "--spread", help=_SPREAD),
    points: int | None = Option(None, min=2, max=4096, help="Number of runs for --spread; default: 32."),
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases and print the results. A finished run is only printed, an interrupted run continues."""
    from walkers.errors import each
    from walkers.finding import case_at
    from walkers.pipeline import finished_at
    from walkers.progress import progress_of, progress_of_sweep
    from walkers.runner.failures import EngineFailure
    from walkers.show import notes

    refuse("--points", points is not None and not spread, "is for --spread")
    # Report a mistake in the last file before the first run starts.
    loaded = each(lambda case: case_at(case, out, changes_of(settings)), cases)
    there = [None if settings or force else finished_at(case, out) for case in cases]
    check_folder("--out", out)
    if spread:
        from walkers.sweeps.spread import POINTS, describe, run_spread, spread_sweep

        for case, _ in loaded:  # also an unusable range
            list(spread_sweep(case, points or POINTS, engine).cases())
    failed, how = False, By(engine=engine, allow_failed_audit=allow_failed_audit)
    for (case, folder), found in zip(loaded, there, strict=True):
        tell(*(f"{case.name}: {note}" for note in notes(case) if found is None))
        try:
            with progress_of(case.name) as advance:
                done = found or walkers.run(case, folder, force=force, progress=advance, time_limit=limit, **how)
        except EngineFailure as failure:
            tell(f"{case.name}: {failure}")
            failed = True
            continue
        band = None
        if spread:
            with progress_of_sweep(f"{case.name}, spread") as advance_sweep:
                options = on_cores(None)
                band = run_spread(case, folder, options, points=points or POINTS, on_progress=advance_sweep, **how)
            failed |= bool(band.failures)
        if as_json:
            ranges = {"spread": band.as_dict()} if band else {}
            print(json.dumps({**done.result, **ranges, "run": str(done.directory), "cached": done.cached}))
        else:
            print_lines([done.describe(), *([describe(band)] if band else [])])
    return 1 if failed else 0


def sweep(
    sweep: str = Argument(metavar="SWEEP", help=_SWEEP_FILE, autocompletion=offering("sweep file")),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    jobs: Jobs = None,
    site: Path | None = Option(None, help="Site file of a cluster to run on."),
    dry_run: bool = Option(False, "--dry-run", help="Print the plan and its predicted cost, and run nothing."),
    retries: int = Option(0, min=0, help="Number of retries for a failed point."),
    limit: float | None = Option(None, min=0.0, help="Time limit in s for each deck."),
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run the missing points of a sweep on all cores or on a cluster. Exit status 1 if a point fails."""
    from dataclasses import replace

    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.uncertainty import lines_of_rest, rests_on
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.scheduler import plan_sweep, run_sweep
    from walkers.sweeps.site import load_site
    from walkers.sweeps.table import describe_status

    loaded = load_sweep(sweep, changes_of(settings))
    check_folder("--out", out)
    refuse("--jobs", jobs is not None and site is not None, "the site file sets how many decks run at once")
    if len(loaded.rows) > _MANY:
        tell(f"{loaded.name}: resolving {len(loaded.rows)} points, about 2,000 per second")
    options = replace(on_cores(jobs), site=load_site(site) if site else None, retries=retries, time_limit=limit)
    if dry_run:
        print(plan_sweep(loaded, out, options, engine).as_text())
        return 0
    with progress_of_sweep(loaded.name) as advance:
        how = By(engine=engine, allow_failed_audit=allow_failed_audit)
        record, failures = run_sweep(loaded, out.resolve() if site else out, options, on_progress=advance, **how)
    tell(*(f"point {failure.point}, {failure.run}: {failure.message}" for failure in failures))
    print(f"{describe_status(record)}\n  table      walkers list {record.directory}")
    same = [one for one in next(loaded.cases()).origins if one.key not in loaded.keys]  # varied keys are in the table
    print_lines(lines_of_rest(rests_on(same)))
    return 1 if failures else 0
