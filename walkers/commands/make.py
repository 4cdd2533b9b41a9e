"""Commands that have the engine, or a model, compute: runs, sweeps, what is made of many, checks of the engine."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from walkers import completion
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
from walkers.pipeline import DEFAULT_OUT

if TYPE_CHECKING:
    from walkers.check.audit import Checked
    from walkers.check.validate import Chapter
    from walkers.inputs.case import Case as Resolved
    from walkers.pipeline import Run

_MANY = 10_000
"""Points of a sweep that take seconds to be resolved."""

Cases = Annotated[
    list[str],
    typer.Argument(metavar="CASE...", help="Case files, or names of shipped cases.", autocompletion=completion.cases),
]
SweepFile = Annotated[
    str,
    typer.Argument(
        metavar="SWEEP", help="A sweep file, or a shipped sweep such as fig2.", autocompletion=completion.sweep_files
    ),
]
CalibrationFile = Annotated[
    str, typer.Argument(metavar="CALIBRATION", help="A calibration file, or a shipped calibration such as ruby.")
]
DeckFolder = Annotated[
    Path | None, typer.Option("--to", help="Write the deck and its files into this new folder, to run by hand.")
]
Force = Annotated[bool, typer.Option("--force", help="Run again even if the run is there.")]
RunLimit = Annotated[
    float | None, typer.Option("--limit", min=0.0, help="Stop a run (of a pile: a segment) after this many seconds.")
]
SpreadFlag = Annotated[
    bool,
    typer.Option("--spread", help="Also with what is guessed, calibrated or uncertain drawn from its range: a band."),
]
Points = Annotated[int | None, typer.Option("--points", min=2, max=4096, help="Of the spread; 32 if left out.")]
SitePath = Annotated[Path | None, typer.Option("--site", help="A site file: run on that cluster instead.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would be done, and its cost; write nothing.")]
Retries = Annotated[int, typer.Option("--retries", min=0, help="How often a failed point is tried again.")]
EngineLimit = Annotated[float | None, typer.Option("--limit", min=0.0, help="Stop an engine after this many seconds.")]
CalibrationFolder = Annotated[
    Path | None, typer.Option("--to", help="Folder of tables and figures; OUT/NAME if left out.")
]
FiguresFolder = Annotated[Path, typer.Option("--to", help="Folder of the figures.")]
OnlyFigures = Annotated[
    list[str] | None, typer.Option("--only", help="Name of a figure, or comparison; may be repeated.")
]
TermsFolder = Annotated[Path, typer.Option("--to", help="Folder of the tables.")]
Generations = Annotated[int, typer.Option("--generations", min=1, help="Of each search.")]
OnlyChecks = Annotated[list[str] | None, typer.Option("--only", help="Name of a check; may be repeated.")]
QuickAudit = Annotated[bool, typer.Option("--quick", help="Leave out the checks that take longest.")]
Cycles = Annotated[int | None, typer.Option("--cycles", help="Of the drive, in place of the case's own.")]
Without = Annotated[
    list[str] | None, typer.Option("--without", metavar="TERM", help="Leave a term out, such as friction.")
]
Seeds = Annotated[int, typer.Option("--seeds", min=1, help="Of a pile: so many starts, for the statistics.")]
Chapters = Annotated[list[str] | None, typer.Argument(metavar="[CHAPTER]...", help="Some chapters; all if left out.")]
QuickChapters = Annotated[bool, typer.Option("--quick", help="Of each the part that takes seconds.")]
PageFolder = Annotated[Path | None, typer.Option("--to", help="Folder of the page; OUT/validation if left out.")]
ChapterJobs = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, help="Chapters at once; all cores if left out.")
]


class _By(TypedDict):
    """What runs cases."""

    engine: str | None
    allow_failed_audit: bool


def deck(case: Case, settings: Set = None, to: DeckFolder = None) -> None:
    """Print the LIGGGHTS deck of a case (of a run in segments, the first), or write it with its files."""
    from walkers.inputs.errors import InputError, Problem
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import write_deck
    from walkers.runner.plugin import plugin_of, run_script
    from walkers.templates.deck import DECK_NAME, RUN_NAME, render_deck

    made = render_deck(load(case, settings))
    if to is None:
        print(made.text, end="")
        return
    plugin = plugin_of(find_engine())
    try:
        to.mkdir(parents=True)
    except OSError as error:
        told = f"expected a folder that can be made ({error.strerror})"
        raise InputError(str(to), [Problem("", None, told)]) from error
    write_deck(made, to)
    (to / RUN_NAME).write_text(run_script(plugin, made.layout.ranks), encoding="utf-8")
    print(f"{to / DECK_NAME}    run it there with: sh {RUN_NAME}")


def run(
    cases: Cases,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    force: Force = False,
    as_json: Json = False,
    limit: RunLimit = None,
    spread: SpreadFlag = False,
    points: Points = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run cases, unless they have been run, and print their results (with --json an object a line)."""
    from walkers import pipeline
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
                done = pipeline.run(case, out, force=force, progress=advance, time_limit=limit, **how)
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
    sweep: SweepFile,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    jobs: Jobs = None,
    site: SitePath = None,
    dry_run: DryRun = False,
    retries: Retries = 0,
    limit: EngineLimit = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run the points of a sweep that are missing, on all cores or on a cluster; exit status 1 if any failed."""
    from dataclasses import replace

    from walkers.inputs.changes import settings_of
    from walkers.inputs.sweep import load_sweep
    from walkers.postprocess.analysis import lines_of_rest, rests_on
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.run import plan_sweep, run_sweep
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
    calibration: CalibrationFile,
    out: Out = DEFAULT_OUT,
    to: CalibrationFolder = None,
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Calibrate, or go on with it: waves of runs, emulators, posterior, predictions by the engine."""
    from walkers.calibration.calibrate import calibrate
    from walkers.calibration.figures import draw
    from walkers.calibration.report import rows_of, write_tables
    from walkers.inputs.calibration import load_calibration
    from walkers.progress import progress_of_sweep

    read = load_calibration(calibration)
    check_folder("--out", out)
    folder = to or out / read.name
    check_folder("--to", folder)
    how = _By(engine=engine, allow_failed_audit=allow_failed_audit)
    found = calibrate(read, out, on_cores(jobs), progress_of=progress_of_sweep, **how)
    tell(*(f"{name}: {len(failures)} points failed" for name, failures in found.failures.items()))
    rows = rows_of(found)
    print_lines([*write_tables(found, rows, folder), *draw(found, rows, folder)])
    return 0  # a set whose run fails is an outcome: it counts as far off


def figures(
    out: Out = DEFAULT_OUT,
    to: FiguresFolder = Path("figures"),
    only: OnlyFigures = None,
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


def model_terms(to: TermsFolder = Path("figures"), generations: Generations = 120) -> int:
    """Fit the theory to the published numbers with one term after the other; no engine is needed."""
    from walkers.paper.model_terms import try_model_terms, write_model_terms

    check_folder("--to", to)
    fits = try_model_terms(generations=generations)
    print_lines(f"misfit {one.misfit:5.1f}, {one.met:2d} met: {one.name}" for one in fits)
    print_lines(write_model_terms(fits, to))
    return 0


def audit(
    only: OnlyChecks = None,
    quick: QuickAudit = False,
    as_json: Json = False,
    engine: EngineName = None,
) -> int:
    """Measure forces of engine and contact model beside a second engine and closed forms; exit 1 if a line fails."""
    from walkers.check.audit import record, run_audit, selected
    from walkers.inputs.errors import InputError, Problem
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing

    def told(checked: Checked) -> None:
        tell(f"{checked.name} ({checked.seconds:.1f} s)")

    checks = selected(only or (), quick=quick)
    try:
        binary = find_engine(engine)
    except EngineMissing as missing:
        if engine is None:
            raise
        raise InputError("--engine", [Problem("", None, str(missing))]) from missing
    report = run_audit(checks, engine=binary, on_done=told)
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
    cycles: Cycles = None,
    without: Without = None,
    settings: Set = None,
    seeds: Seeds = 1,
    as_json: Json = False,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Compare a case's run with an engine of our own, written from the published formulas; exit 1 if they differ."""
    from walkers import pipeline
    from walkers.check.comparison import crosscheck, describe, shortened
    from walkers.check.engine import TERMS
    from walkers.inputs.errors import InputError, Problem
    from walkers.progress import progress_of

    loaded = load(case, settings)
    check_folder("--out", out)
    refuse("--seeds", seeds > 1 and loaded.mixture is None, "is for piles: walkers and placed beads start but one way")
    for term in without or ():
        if term not in TERMS:
            raise InputError(f"--without {term}", [Problem("", None, f"expected one of {', '.join(TERMS)}")])
    try:
        loaded = loaded if cycles is None else shortened(loaded, cycles)
    except ValueError as error:
        raise InputError("--cycles", [Problem("", None, str(error))]) from error

    def make(one: Resolved, folder: Path) -> Run:
        with progress_of(one.name) as advance:
            return pipeline.run(one, folder, engine=engine, progress=advance, allow_failed_audit=allow_failed_audit)

    found = crosscheck(loaded, out, without or (), seeds=seeds, make=make)
    if as_json:
        print(json.dumps(found.as_dict(), ensure_ascii=False))
    else:
        print(describe(found))
        tell(*(f"{loaded.name}: differs: {one}" for one in found.disagreements))
    return 1 if found.disagreements else 0


def validate(
    chapters: Chapters = None,
    quick: QuickChapters = False,
    out: Out = DEFAULT_OUT,
    to: PageFolder = None,
    jobs: ChapterJobs = None,
    as_json: Json = False,
) -> int:
    """Check the decks against published benchmarks, exact solutions and a second engine, and write a page of it."""
    from walkers.check.validate import validate
    from walkers.sweeps.site import cores_here

    check_folder("--out", out)
    folder = to or out / "validation"
    check_folder("--to", folder)

    def told(chapter: Chapter) -> None:
        tell(f"{chapter.name} done")

    made = validate(out, folder, only=chapters or (), quick=quick, jobs=jobs or cores_here(), on_done=told)
    numbers = {chapter.name: dict(chapter.numbers) for chapter in made.chapters}
    print_as(as_json, lambda: numbers, lambda: "\n".join(map(str, made.files)))
    tell(*(f"not as expected: {statement}" for statement in made.failed))
    return 1 if made.failed else 0
