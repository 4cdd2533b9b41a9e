"""Commands that prepare and run simulations."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

import walkers
from walkers.commands.options import (
    NOT_NEGATIVE,
    CaseArgument,
    EngineOption,
    JobsOption,
    JsonOption,
    LookupOptions,
    QuietOption,
    print_as,
    print_lines,
    refuse,
    tell,
    tell_replaced,
    warnings_shown,
)
from walkers.errors import apply_all
from walkers.progress import progress_of
from walkers.rounding import counted, duration_text
from walkers.terminal import text_width

if TYPE_CHECKING:
    from walkers.inputs.sweep import SweepDefinition
    from walkers.inputs.tables.case import Case
    from walkers.runs.names import Reference
    from walkers.sweeps.scheduler import SweepOptions
    from walkers.sweeps.spread import Spread

_MANY_POINTS = 10_000
"""Number of points of a sweep above which the time to resolve them is told in advance."""
_RESOLVED_PER_SECOND = 2_000
"""Number of points that are resolved in a second."""


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
        Shipped case to copy: fig1b (a walker), climber, cluster, tray, pile-small, ... (list:
        walkers library).
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
    """Show all values of a case with their sources, the forces, the time step and the predicted
    run time.

    Parameters
    ----------
    theory
        Print the theory's prediction, with the result of the run if it exists.
    """
    if theory:
        _show_theory(case, lookup, as_json)
        return
    from walkers.runs.preview import preview_text, summarise

    summary = summarise(lookup.find(case).case)
    print_as(as_json, lambda: summary, lambda: preview_text(summary))


def _show_theory(case: str, lookup: LookupOptions, as_json: bool) -> None:
    """Print the prediction of the theory, beside the result of the run if there is one."""
    from walkers.theory.prediction_text import prediction_text

    prediction = walkers.predict(lookup.find(case))
    result_of_run = prediction["engine"]
    print_as(as_json, lambda: prediction, lambda: prediction_text(prediction, result_of_run))


def _number_of_draws(spread: bool, points: int | None) -> int:
    """Number of runs of a spread; 0 without ``--spread``."""
    from walkers.sweeps.spread import POINTS, check_number_of_draws

    refuse("--points", points is not None and not spread, "is for --spread")
    if not spread:
        return 0
    if points is None:
        return POINTS
    check_number_of_draws(points)
    return points


def run(
    *cases: Annotated[CaseArgument, Parameter(required=True)],
    lookup: LookupOptions = LookupOptions(),
    force: bool = False,
    dry_run: bool = False,
    as_json: JsonOption = False,
    limit: Annotated[float | None, Parameter(validator=NOT_NEGATIVE)] = None,
    spread: bool = False,
    points: int | None = None,
    accuracy: bool = False,
    engine: EngineOption = None,
    quiet: QuietOption = False,
    verbose: Annotated[bool, Parameter(("--verbose", "-v"))] = False,
) -> int:
    """Run cases and print the results. A finished run is only printed, an interrupted run
    continues.

    Parameters
    ----------
    force
        Run again if the run exists.
    dry_run
        Print what would be run, where, whether it is there already and the predicted cost; run
        nothing.
    limit
        Time limit in s for each run; for piles, for each segment.
    spread
        Also run with uncertain values drawn from their ranges, and print the band of the result.
    points
        Number of runs for --spread; default: 32.
    accuracy
        Also run with smaller time steps and harder beads, and print the numerical error of the
        result.
    verbose
        Print all numbers of the result, and all values that have not been measured.
    """
    from walkers.api import case_to_run, finished_run_of
    from walkers.sweeps.accuracy import modulus_factors
    from walkers.sweeps.spread import spread_sweep

    draws = _number_of_draws(spread, points)
    refuse("--verbose", verbose and quiet, "prints more and --quiet less: expected one of them")
    refuse("--verbose", verbose and as_json, "prints a text: expected without --json")
    refuse("--json", as_json and dry_run, "is for results, not for --dry-run")
    # Report a mistake in the last file before the first run starts.
    references = [lookup.find(case, quiet=quiet) for case in cases]
    options = _RunOptions(
        force=force,
        limit=limit,
        draws=draws,
        accuracy=accuracy,
        engine=engine,
        as_json=as_json,
        quiet=quiet,
        verbose=verbose,
    )
    if dry_run:
        apply_all(lambda reference: _print_plan_of_run(reference, options), references)
        return 0
    finished_runs: list[walkers.Run | None] = [None] * len(references)
    if not force:
        finished_runs = apply_all(finished_run_of, references)
    loaded = apply_all(case_to_run, zip(references, finished_runs, strict=True))
    if accuracy:
        apply_all(modulus_factors, loaded)
    if spread:
        for case in loaded:
            list(spread_sweep(case, draws, engine).cases())  # refuses an unusable range
    failed = False
    with warnings_shown(not quiet):
        for reference, case, finished_run in zip(references, loaded, finished_runs, strict=True):
            failed |= _run_one(reference, case, finished_run, options)
    return 1 if failed else 0


@dataclass(frozen=True)
class _RunOptions:
    """Options of ``walkers run``, by the names of its arguments; ``draws`` is 0 without spread."""

    force: bool
    limit: float | None
    draws: int
    accuracy: bool
    engine: str | None
    as_json: bool
    quiet: bool
    verbose: bool


def _run_one(
    reference: Reference, case: Case, finished_run: walkers.Run | None, options: _RunOptions
) -> bool:
    """Run a case unless its run is finished, and print the result; return whether a run failed."""
    from walkers.runner.failures import EngineFailure

    is_told = not options.quiet
    engine = options.engine
    if finished_run is None and is_told:
        _tell_notes(case)
    try:
        done = finished_run or walkers.run(
            case,
            reference.folder,
            engine=engine,
            force=options.force,
            progress=is_told,
            time_limit=options.limit,
        )
    except EngineFailure as failure:
        tell(f"{case.name}: {failure}")
        return True
    if options.accuracy:
        done.accuracy(progress=is_told, engine=engine)
    band: Spread | None = None
    if options.draws:
        band = done.spread(options.draws, progress=is_told, engine=engine)
    _print_run(done, band or done.stored_spread(), options)
    return band is not None and bool(band.failures)


def _tell_notes(case: Case) -> None:
    """Print what a user should know about a case before it is run."""
    from walkers.runs.preview import notes

    tell(*[f"{case.name}: {note}" for note in notes(case)])


def _print_run(run: walkers.Run, band: Spread | None, options: _RunOptions) -> None:
    """Print the result of a run and, if it has one, the band of its spread; as JSON on one line."""
    from walkers.sweeps.spread import spread_text

    if not options.as_json:
        print(run.describe(verbose=options.verbose))
        if band is not None:
            print(spread_text(band))
        return
    contents = run.result.as_dict()
    if band is not None:
        contents["spread"] = band.as_dict()
    contents["run"] = str(run.directory)
    contents["cached"] = run.cached
    print(json.dumps(contents))


def _print_plan_of_run(reference: Reference, options: _RunOptions) -> None:
    """Print what a run, its spread and its accuracy would do, and predict the cost."""
    from walkers.runs.plan import plan_run
    from walkers.sweeps.accuracy import plan_accuracy
    from walkers.sweeps.scheduler import SweepOptions
    from walkers.sweeps.spread import plan_spread

    plan = plan_run(reference, options.engine, force=options.force)
    if plan.is_run and not options.quiet:
        _tell_notes(plan.case)
    print(plan.as_text())
    folder = plan.directory.parent
    further = {}
    if options.accuracy:
        further["accuracy"] = plan_accuracy(
            plan.case, plan.directory, SweepOptions(), options.engine
        )
    if options.draws:
        further["spread"] = plan_spread(
            plan.case, folder, SweepOptions(), points=options.draws, engine=options.engine
        )
    for name, sweep_plan in further.items():
        runs = counted(len(sweep_plan.missing), "more run")
        print(f"  {name:10} {runs}, predicted {sweep_plan.core_seconds:.0f} core-seconds")


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
    quiet: QuietOption = False,
    verbose: Annotated[bool, Parameter(("--verbose", "-v"))] = False,
) -> int:
    """Run the missing points of a sweep on all cores or on a cluster. Exit status 1 if a point
    fails.

    Parameters
    ----------
    sweep
        A sweep file, or the name of a shipped sweep such as fig2.
    site
        Site file of a cluster to run on: TOML for SLURM, or Python with a configuration of Parsl.
    dry_run
        Print the plan and its predicted cost, and run nothing. A site file in Python is executed
        all the same.
    limit
        Time limit in s for each deck.
    spread
        Also run each point with its uncertain values drawn from their ranges: plots of the sweep
        show the bands.
    points
        Number of runs of each point for --spread; default: 32.
    verbose
        Also print the table of the sweep.
    """
    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.measure.uncertainty import uncertain_value_lines, uncertain_values
    from walkers.sweeps.scheduler import SweepOptions
    from walkers.sweeps.site import load_site

    draws = _number_of_draws(spread, points)
    loaded = load_sweep(sweep, lookup.values)
    if not quiet:
        tell_replaced(loaded.replaced_by(lookup.values))
    refuse(
        "--jobs",
        jobs is not None and site is not None,
        "the site file sets how many decks run at once",
    )
    refuse("--verbose", verbose and quiet, "prints more and --quiet less: expected one of them")
    if len(loaded.rows) > _MANY_POINTS and not quiet:
        duration = duration_text(len(loaded.rows) / _RESOLVED_PER_SECOND)
        tell(f"{loaded.name}: resolving {len(loaded.rows)} points, which takes about {duration}")
    if dry_run:
        options = SweepOptions(jobs, load_site(site) if site else None)
        _print_plan(loaded, lookup.out, options, engine, draws if spread else None)
        return 0
    with warnings_shown(not quiet):
        done = walkers.sweep(
            sweep,
            lookup.out,
            jobs=jobs,
            changes=lookup.values,
            progress=not quiet,
            site=site,
            time_limit=limit,
            spread=draws,
            engine=engine,
        )
    for failure in done.failures:
        tell(f"point {failure.point}, {failure.run}: {failure.message}")
    print(done.describe() if verbose else done.summary())
    print(f"  table      walkers list {done.directory}")
    # The table has the values of the keys that vary.
    origins = next(loaded.cases()).origins
    of_all_points = [origin for origin in origins if origin.key not in loaded.keys]
    print_lines(uncertain_value_lines(uncertain_values(of_all_points), text_width()))
    return 1 if done.failures else 0


def _print_plan(
    sweep: SweepDefinition, out: Path, options: SweepOptions, engine: str | None, draws: int | None
) -> None:
    """Print what a sweep would run, and predict its cost.

    With ``draws``, also print the cost of the spread of each point: so many runs of the point with
    its uncertain values drawn from their ranges. None: no spread is asked for.
    """
    from walkers.sweeps.scheduler import plan_sweep
    from walkers.sweeps.spread import plan_spread

    with progress_of(sweep.name) as advance:
        plan = plan_sweep(sweep, out, options, engine, advance)
    print(plan.as_text())
    if draws is None:
        return
    seconds = 0.0
    missing = 0
    for case in sweep.cases():
        plan_of_spread = plan_spread(case, out, options, points=draws, engine=engine)
        seconds += plan_of_spread.core_seconds
        missing += len(plan_of_spread.missing)
    print(f"  spread     {missing} more runs, predicted {seconds:.0f} core-seconds")
