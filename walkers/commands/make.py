"""Commands that have the engine, or a model, compute: runs, sweeps, what is made of many, checks of the engine."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    AllowFailedAudit,
    Case,
    EngineName,
    Formats,
    Jobs,
    Json,
    Out,
    Set,
    check_folder,
    load,
    on_cores,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.completion import offering

if TYPE_CHECKING:
    from walkers.check.report import Chapter
    from walkers.inputs.case import Case as Resolved

_MANY = 10_000
"""Points of a sweep that take seconds to be resolved."""
_OFFERED = offering("case")
_CASES = "Case files, or names of shipped cases."
_SWEEP = "A sweep file, or a shipped sweep such as fig2."
_DECK = "Write the deck and its files into this new folder, to run by hand."
_LIMIT = "Stop a run (of a pile: a segment) after this many seconds."
_SPREAD = "Also with what is guessed, calibrated or uncertain drawn from its range: a band."


class _By(TypedDict):
    """What runs cases."""

    engine: str | None
    allow_failed_audit: bool


def deck(case: Case, settings: Set = None, to: Path | None = Option(None, help=_DECK)) -> None:
    """Print the LIGGGHTS deck of a case (of a run in segments, the first), or write it with its files."""
    from walkers.inputs.errors import refused
    from walkers.runner.binary import find_engine, plugin_of, run_script
    from walkers.runner.directory import write_deck
    from walkers.templates.deck import DECK_NAME, RUN_NAME, render_deck

    made = render_deck(load(case, settings))
    if to is None:
        print(made.text, end="")
        return
    plugin = plugin_of(find_engine())
    try:
        to.mkdir(parents=True)
    except OSError as error:
        raise refused(to, f"expected a folder that can be made ({error.strerror})") from error
    write_deck(made, to)
    (to / RUN_NAME).write_text(run_script(plugin, made.layout.ranks), encoding="utf-8")
    print(f"{to / DECK_NAME}    run it there with: sh {RUN_NAME}")


def run(
    cases: list[str] = Argument(metavar="CASE...", help=_CASES, autocompletion=_OFFERED),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    force: bool = Option(False, "--force", help="Run again even if the run is there."),
    as_json: Json = False,
    limit: float | None = Option(None, min=0.0, help=_LIMIT),
    spread: bool = Option(False, "--spread", help=_SPREAD),
    points: int | None = Option(None, min=2, max=4096, help="Of the spread; 32 if left out."),
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases, unless they have been run, and print their results (with --json an object a line)."""
    from walkers.progress import progress_of, progress_of_sweep
    from walkers.runner.failures import EngineFailure

    refuse("--points", points is not None and not spread, "is for --spread")
    loaded = [load(case, settings) for case in cases]  # a mistake in the last file shows before the first run starts
    check_folder("--out", out)
    if spread:
        from walkers.sweeps.spread import POINTS, describe, run_spread, spread_sweep

        for case in loaded:  # and so does a range that its key does not take
            list(spread_sweep(case, points or POINTS, engine).cases())
    failed, how = False, _By(engine=engine, allow_failed_audit=allow_failed_audit)
    for case in loaded:
        try:
            with progress_of(case.name) as advance:
                done = walkers.run(case, out, force=force, progress=advance, time_limit=limit, **how)
        except EngineFailure as failure:
            tell(f"{case.name}: {failure}")
            failed = True
            continue
        band = None
        if spread:
            with progress_of_sweep(f"{case.name}, spread") as advance_sweep:
                options = on_cores(None)
                band = run_spread(case, out, options, points=points or POINTS, on_progress=advance_sweep, **how)
            failed |= bool(band.failures)
        if as_json:
            found = {"spread": band.as_dict()} if band else {}
            print(json.dumps({**done.result, **found, "run": str(done.directory), "cached": done.cached}))
        else:
            print_lines([done.describe(), *([describe(band, done.result)] if band else [])])
    return 1 if failed else 0


def sweep(
    sweep: str = Argument(metavar="SWEEP", help=_SWEEP, autocompletion=offering("sweep file")),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    jobs: Jobs = None,
    site: Path | None = Option(None, help="A site file: run on that cluster instead."),
    dry_run: bool = Option(False, "--dry-run", help="Say what would be done, and its cost; write nothing."),
    retries: int = Option(0, min=0, help="How often a failed point is tried again."),
    limit: float | None = Option(None, min=0.0, help="Stop an engine after this many seconds."),
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run the points of a sweep that are missing, on all cores or on a cluster; exit status 1 if any failed."""
    from dataclasses import replace

    from walkers.inputs.changes import settings_of
    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.analysis import lines_of_rest, rests_on
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.scheduler import plan_sweep, run_sweep
    from walkers.sweeps.site import load_site
    from walkers.sweeps.table import describe_status

    loaded = load_sweep(sweep, settings_of(settings or ()))
    check_folder("--out", out)
    refuse("--jobs", jobs is not None and site is not None, "a site says by itself how many decks run at once")
    if len(loaded.rows) > _MANY:
        tell(f"{loaded.name}: resolving {len(loaded.rows)} points, some 2,000 a second")
    options = replace(on_cores(jobs), site=load_site(site) if site else None, retries=retries, time_limit=limit)
    if dry_run:
        print(plan_sweep(loaded, out, options, engine).as_text())
        return 0
    with progress_of_sweep(loaded.name) as advance:
        how = _By(engine=engine, allow_failed_audit=allow_failed_audit)
        record, failures = run_sweep(loaded, out.resolve() if site else out, options, on_progress=advance, **how)
    tell(*(f"point {failure.point}, {failure.run}: {failure.message}" for failure in failures))
    print(describe_status(record.directory))
    same = [one for one in next(loaded.cases()).origins if one.key not in loaded.keys]  # what varies is in the table
    print_lines(lines_of_rest(rests_on(same)))
    return 1 if failures else 0


def calibrate(
    calibration: str = Argument(
        metavar="CALIBRATION", help="A calibration file, or a shipped calibration such as ruby."
    ),
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="Folder of tables and figures; OUT/NAME if left out."),
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Calibrate, or go on with it: waves of runs, emulators, posterior, predictions by the engine."""
    from walkers.calibration.calibrate import calibrate
    from walkers.calibration.report import write_outcome
    from walkers.inputs.calibration import load_calibration
    from walkers.progress import progress_of_sweep

    read = load_calibration(calibration)
    check_folder("--out", out)
    folder = to or out / read.name
    check_folder("--to", folder)
    how = _By(engine=engine, allow_failed_audit=allow_failed_audit)
    found = calibrate(read, out, on_cores(jobs), progress_of=progress_of_sweep, **how)
    tell(*(f"{name}: {len(failures)} points failed" for name, failures in found.failures.items()))
    print_lines(write_outcome(found, folder))
    return 0  # a set whose run fails is an outcome: it counts as far off


def figures(
    out: Out = DEFAULT_OUT,
    to: Path = Option(Path("figures"), help="Folder of the figures."),
    only: list[str] | None = Option(None, help="Name of a figure, or comparison; may be repeated."),
    formats: Formats = None,
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Draw the paper's figures with engine, theory and published values; runs that are missing are made first."""
    from walkers.paper.make import FORMATS, make_figures
    from walkers.progress import progress_of_sweep

    how = _By(engine=engine, allow_failed_audit=allow_failed_audit)
    wanted, shown = only or (), formats or FORMATS
    made = make_figures(out, to, on_cores(jobs), only=wanted, formats=shown, progress_of=progress_of_sweep, **how)
    for name, failures in made.failures.items():
        tell(*(f"{name}: point {failure.point}, {failure.run}: {failure.message}" for failure in failures))
    tell(*(f"{figure} is left out: {reason}" for figure, reason in made.left_out.items()))
    print_lines(made.files)
    if made.compared:
        print(f"{made.agree} of {made.compared} published numbers agree: {to / 'comparison.md'}")
    return 1 if made.failures or made.left_out else 0


def model_terms(to: Path = Option(Path("figures"), help="Folder of the table.")) -> None:
    """Fit the theory to the published numbers with one term after the other; no engine is needed."""
    from walkers.paper.model_terms import PAGE_NAME, try_model_terms

    check_folder("--to", to)
    print_lines(f"misfit {one.misfit:5.1f}, {one.met:2d} met: {one.name}" for one in try_model_terms(to))
    print(to / PAGE_NAME)


def audit(
    only: list[str] | None = Option(None, help="Name of a check; may be repeated."),
    quick: bool = Option(False, "--quick", help="Leave out the checks that take longest."),
    as_json: Json = False,
    engine: EngineName = None,
) -> int:
    """Measure forces of engine and contact model beside a second engine and closed forms; exit 1 if a line fails."""
    from walkers.check.audit import record, run_audit, selected
    from walkers.inputs.errors import refused
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing

    checks = selected(only or (), quick=quick)
    try:
        binary = find_engine(engine)
    except EngineMissing as missing:
        if engine is None:
            raise
        raise refused("--engine", str(missing)) from missing
    report = run_audit(checks, engine=binary, on_done=_tell_seconds)
    print_as(as_json, report.as_dict, report.as_text)
    if not only:
        try:
            record(report, quick=quick)
        except OSError as error:
            warnings.warn(f"the outcome cannot be kept: {error}", stacklevel=1)
    return 1 if report.failures else 0


def crosscheck(
    case: Case,
    out: Out = DEFAULT_OUT,
    cycles: int | None = Option(None, help="Of the drive, in place of the case's own."),
    without: list[str] | None = Option(None, metavar="TERM", help="Leave a term out, such as friction."),
    settings: Set = None,
    seeds: int = Option(1, min=1, help="Of a pile: so many starts, for the statistics."),
    as_json: Json = False,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Compare a case's run with an engine of our own, written from the published formulas; exit 1 if they differ."""
    from walkers.check.crosscheck import crosscheck, shortened
    from walkers.check.engine import TERMS
    from walkers.check.report import as_dict
    from walkers.inputs.errors import refused
    from walkers.progress import progress_of

    loaded = load(case, settings)
    check_folder("--out", out)
    refuse("--seeds", seeds > 1 and loaded.mixture is None, "is for piles: walkers and placed beads start but one way")
    for term in without or ():
        refuse(f"--without {term}", term not in TERMS, f"expected one of {', '.join(TERMS)}")
    try:
        loaded = loaded if cycles is None else shortened(loaded, cycles)
    except ValueError as error:
        raise refused("--cycles", str(error)) from error

    def make(one: Resolved, folder: Path) -> walkers.Run:
        with progress_of(one.name) as advance:
            return walkers.run(one, folder, engine=engine, progress=advance, allow_failed_audit=allow_failed_audit)

    found = crosscheck(loaded, out, without or (), seeds=seeds, make=make)
    chapter = found.chapter()
    print_as(as_json, lambda: as_dict([chapter], case=loaded.name, without=list(found.without)), chapter.as_text)
    if not as_json:
        tell(*(f"{loaded.name}: differs: {line.what}" for line in chapter.failures))
    return 1 if chapter.failures else 0


def validate(
    chapters: list[str] | None = Argument(None, metavar="[CHAPTER]...", help="Some chapters; all if left out."),
    quick: bool = Option(False, "--quick", help="Of each the part that takes seconds."),
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="Folder of the page; OUT/validation if left out."),
    jobs: int | None = Option(None, "-j", "--jobs", min=1, help="Chapters at once; all cores if left out."),
    as_json: Json = False,
) -> int:
    """Check the decks against published benchmarks, exact solutions and a second engine, and write a page of it."""
    from walkers.check.report import as_dict, validate

    check_folder("--out", out)
    folder, cores = to or out / "validation", on_cores(jobs).workers
    check_folder("--to", folder)
    made = validate(out, folder, only=chapters or (), quick=quick, jobs=cores, on_done=_tell_seconds)
    print_as(as_json, lambda: as_dict(made.chapters), lambda: "\n".join(map(str, made.files)))
    tell(*(f"not as expected: {statement}" for statement in made.failed))
    return 1 if made.failed else 0


def _tell_seconds(chapter: Chapter) -> None:
    tell(f"{chapter.name} ({chapter.seconds:.1f} s)")
