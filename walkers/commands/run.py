"""Commands that prepare and run simulations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import walkers
from walkers.commands.options import (
    NOT_NEGATIVE,
    CaseArgument,
    EngineOption,
    JobsOption,
    JsonOption,
    LookupOptions,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.errors import apply_all
from walkers.progress import progress_of
from walkers.rounding import duration_text

_MANY = 10_000
"""Number of points of a sweep that take long enough to say so."""
_RESOLVED_PER_SECOND = 2_000
"""Number of points that take seconds to resolve."""


def new(
    name: Annotated[str, Parameter(name="NAME")],
    case: Annotated[str, Parameter(name="CASE")] = "fig1b",
    /,
    *,
    schema: bool = False,
) -> None:
    """Write a commented case file as a starting point.

    Parameters
    ----------
    name
        Name of the case; the file is NAME.toml.
    case
        Shipped case to copy: fig1b (a walker), climber, cluster, tray, pile-small, ... (list: walkers library).
    schema
        Also write case.schema.json, which editors use.
    """
    print_lines(walkers.new(name, case, schema=schema))


def show(
    case: CaseArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    theory: bool = False,
    as_json: JsonOption = False,
) -> None:
    """Show all values of a case with their sources, the forces, the time step and the predicted run time.

    Parameters
    ----------
    theory
        Print the theory's prediction, with the result of the run if it exists.
    """
    if theory:
        from walkers.theory.prediction_text import prediction_text

        predicted = walkers.predict(case, lookup.out, lookup.values)
        print_as(
            as_json, lambda: predicted, lambda: prediction_text(predicted, predicted["engine"])
        )
        return
    from walkers.runs.names import find
    from walkers.runs.preview import preview_text, summarise

    summary = summarise(find(case, lookup.out, lookup.values).case)
    print_as(as_json, lambda: summary, lambda: preview_text(summary))


def _draws(spread: bool, points: int | None) -> int:
    """Number of runs of a spread; 0 for none."""
    from walkers.sweeps.spread import POINTS

    refuse("--points", points is not None and not spread, "is for --spread")
    return (POINTS if points is None else points) if spread else 0


def run(
    *cases: CaseArgument,
    lookup: LookupOptions = LookupOptions(),
    force: bool = False,
    as_json: JsonOption = False,
    limit: Annotated[float | None, Parameter(validator=NOT_NEGATIVE)] = None,
    spread: bool = False,
    points: int | None = None,
    accuracy: bool = False,
    engine: EngineOption = None,
) -> int:
    """Run cases and print the results. A finished run is only printed, an interrupted run continues.

    Parameters
    ----------
    force
        Run again if the run exists.
    limit
        Time limit in s for each run; for piles, for each segment.
    spread
        Also run with uncertain values drawn from their ranges, and print the band of the result.
    points
        Number of runs for --spread; default: 32.
    accuracy
        Also run with smaller time steps and harder beads, and print the numerical error of the result.
    """
    from walkers.api import case_to_run, finished_at
    from walkers.runner.failures import EngineFailure
    from walkers.runs.names import find
    from walkers.runs.preview import notes
    from walkers.sweeps.accuracy import times_of
    from walkers.sweeps.spread import spread_sweep, spread_text

    refuse("CASE", not cases, "expected a case, such as fig1b")
    draws = _draws(spread, points)
    # Report a mistake in the last file before the first run starts.
    named = [find(case, lookup.out, lookup.values) for case in cases]
    finished = [None for _ in named] if force else apply_all(finished_at, named)
    loaded = apply_all(case_to_run, zip(named, finished, strict=True))
    if accuracy:
        apply_all(times_of, loaded)
    if spread:
        for case in loaded:
            list(spread_sweep(case, draws, engine).cases())  # also an unusable range
    failed = False
    for reference, case, earlier in zip(named, loaded, finished, strict=True):
        folder = reference.folder
        tell(*(f"{case.name}: {note}" for note in notes(case) if earlier is None))
        try:
            done = earlier or walkers.run(
                case, folder, engine=engine, force=force, progress=True, time_limit=limit
            )
        except EngineFailure as failure:
            tell(f"{case.name}: {failure}")
            failed = True
            continue
        if accuracy:
            done.accuracy(progress=True, engine=engine)
        band = done.spread(draws, progress=True, engine=engine) if spread else None
        failed |= bool(band and band.failures)
        if as_json:
            ranges = {"spread": band.as_dict()} if band else {}
            print(
                json.dumps(
                    {
                        **done.result.as_dict(),
                        **ranges,
                        "run": str(done.directory),
                        "cached": done.cached,
                    }
                )
            )
        else:
            print_lines([done.describe(), *([spread_text(band)] if band else [])])
    return 1 if failed else 0


def sweep(
    sweep: Annotated[str, Parameter(name="SWEEP")],
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    jobs: JobsOption = None,
    site: Path | None = None,
    dry_run: bool = False,
    limit: Annotated[float | None, Parameter(validator=NOT_NEGATIVE)] = None,
    spread: bool = False,
    points: int | None = None,
    engine: EngineOption = None,
) -> int:
    """Run the missing points of a sweep on all cores or on a cluster. Exit status 1 if a point fails.

    Parameters
    ----------
    sweep
        A sweep file, or the name of a shipped sweep such as fig2.
    site
        Site file of a cluster to run on: TOML for SLURM, or Python with a configuration of Parsl.
    dry_run
        Print the plan and its predicted cost, and run nothing. A site file in Python is executed all the same.
    limit
        Time limit in s for each deck.
    spread
        Also run each point with its uncertain values drawn from their ranges: plots of the sweep show the bands.
    points
        Number of runs of each point for --spread; default: 32.
    """
    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.measure.uncertainty import lines_of_rest, rests_on
    from walkers.sweeps.scheduler import SweepOptions, plan_sweep
    from walkers.sweeps.site import load_site
    from walkers.sweeps.spread import spread_sweep

    draws = _draws(spread, points)
    loaded = load_sweep(sweep, lookup.values)
    refuse(
        "--jobs",
        jobs is not None and site is not None,
        "the site file sets how many decks run at once",
    )
    if len(loaded.rows) > _MANY:
        duration = duration_text(len(loaded.rows) / _RESOLVED_PER_SECOND)
        tell(f"{loaded.name}: resolving {len(loaded.rows)} points, which takes about {duration}")
    if dry_run:
        options = SweepOptions(jobs, load_site(site) if site else None)
        with progress_of(loaded.name) as advance:
            plan = plan_sweep(loaded, lookup.out, options, engine, advance)
        print(plan.as_text())
        if spread:
            sweeps = (spread_sweep(case, draws, engine) for case in loaded.cases())
            plans = [plan_sweep(drawn, lookup.out, options, engine) for drawn in sweeps]
            seconds, more = (
                sum(plan.core_seconds for plan in plans),
                sum(len(plan.missing) for plan in plans),
            )
            print(f"  spread     {more} more runs, predicted {seconds:.0f} core-seconds")
        return 0
    done = walkers.sweep(
        sweep,
        lookup.out,
        jobs=jobs,
        changes=lookup.values,
        progress=True,
        site=site,
        time_limit=limit,
        spread=draws,
        engine=engine,
    )
    tell(*(f"point {failure.point}, {failure.run}: {failure.message}" for failure in done.failures))
    print(f"{done.summary()}\n  table      walkers list {done.directory}")
    origins = next(loaded.cases()).origins  # the table has the values of varied keys
    print_lines(
        lines_of_rest(rests_on([origin for origin in origins if origin.key not in loaded.keys]))
    )
    return 1 if done.failures else 0
