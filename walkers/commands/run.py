"""Commands that prepare and run simulations."""

from __future__ import annotations

import json
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
_ACCURACY = "Also run with smaller time steps and harder beads, and print the numerical error of the result."
_SHARE = "For --accuracy: share of the velocity that the last increase of Young's modulus may change; default: 0.01."
_SWEEP_FILE = "A sweep file, or the name of a shipped sweep such as fig2."


def new(
    name: str = Argument(metavar="NAME", help=_NAME),
    case: str = Argument("fig1b", metavar="CASE", help=_COPIED, autocompletion=offering("case")),
    schema: bool = Option(False, "--schema", help="Also write case.schema.json, which editors use."),
) -> None:
    """Write a commented case file as a starting point."""
    print(*walkers.new(name, case, schema=schema), sep="\n")


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
    from walkers.theory.prediction import describe as describe_prediction

    predicted = walkers.predict(loaded, out)
    print_as(as_json, lambda: predicted, lambda: describe_prediction(predicted, predicted["engine"]))


def run(
    cases: list[str] = Argument(metavar="CASE", help=_CASES, autocompletion=_OFFERED),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    force: bool = Option(False, "--force", help="Run again if the run exists."),
    as_json: Json = False,
    limit: float | None = Option(None, min=0.0, help=_LIMIT),
    spread: bool = Option(False, "--spread", help=_SPREAD),
    points: int | None = Option(None, min=2, max=4096, help="Number of runs for --spread; default: 32."),
    accuracy: bool = Option(False, "--accuracy", help=_ACCURACY),
    share: float | None = Option(None, min=1e-6, max=1.0, help=_SHARE),
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases and print the results. A finished run is only printed, an interrupted run continues."""
    from walkers.api import case_at, finished_at
    from walkers.errors import each
    from walkers.runner.failures import EngineFailure
    from walkers.show import notes

    refuse("--points", points is not None and not spread, "is for --spread")
    refuse("--share", share is not None and not accuracy, "is for --accuracy")
    # Report a mistake in the last file before the first run starts.
    there = each(lambda case: None if settings or force else finished_at(case, out), cases)
    loaded = each(lambda case: case_at(case, out, changes_of(settings)), cases)
    check_folder("--out", out)
    if accuracy:
        from walkers.sweeps.accuracy import SHARE, times_of

        each(lambda one: times_of(one[0]), loaded)
    if spread:
        from walkers.sweeps.spread import POINTS, describe, spread_sweep

        for case, _ in loaded:  # also an unusable range
            list(spread_sweep(case, points or POINTS, engine).cases())
    failed, how = False, By(engine=engine, allow_failed_audit=allow_failed_audit)
    for (case, folder), found in zip(loaded, there, strict=True):
        tell(*(f"{case.name}: {note}" for note in notes(case) if found is None))
        try:
            done = found or walkers.run(case, folder, force=force, progress=True, time_limit=limit, **how)
        except EngineFailure as failure:
            tell(f"{case.name}: {failure}")
            failed = True
            continue
        if accuracy:
            done.accuracy(share or SHARE, progress=True, **how)
        band = None
        if spread:
            band = done.spread(points or POINTS, progress=True, **how)
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
    from walkers.sweeps.scheduler import plan_sweep
    from walkers.sweeps.site import load_site

    changes = changes_of(settings)
    loaded = load_sweep(sweep, changes)
    check_folder("--out", out)
    refuse("--jobs", jobs is not None and site is not None, "the site file sets how many decks run at once")
    if len(loaded.rows) > _MANY:
        tell(f"{loaded.name}: resolving {len(loaded.rows)} points, about 2,000 per second")
    if dry_run:
        options = replace(on_cores(jobs), site=load_site(site) if site else None)
        print(plan_sweep(loaded, out, options, engine).as_text())
        return 0
    how: dict[str, Any] = {"retries": retries, "time_limit": limit, "site": site, "jobs": jobs}
    by = By(engine=engine, allow_failed_audit=allow_failed_audit)
    done = walkers.sweep(sweep, out, changes=changes, progress=True, **how, **by)
    tell(*(f"point {failure.point}, {failure.run}: {failure.message}" for failure in done.failures))
    print(f"{done.summary()}\n  table      walkers list {done.directory}")
    same = [one for one in next(loaded.cases()).origins if one.key not in loaded.keys]  # varied keys are in the table
    print_lines(lines_of_rest(rests_on(same)))
    return 1 if done.failures else 0
