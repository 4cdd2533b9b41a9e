"""Commands on many runs: sweeps, folders, archives; the paper, calibrations, checks of the engine."""

from __future__ import annotations

import sys
import warnings
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer
from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    AllowFailedAudit,
    By,
    Case,
    CaseName,
    EngineName,
    Formats,
    Jobs,
    Json,
    OlderThan,
    Out,
    RunOrSweep,
    Set,
    SweepColumn,
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
_SWEEP_FILE = "A sweep file, or a shipped sweep such as fig2."
_SWEEP = "A sweep: its directory or its name in --out"
_WITHIN = "Climbs until then, s of drive; if left out until the first run ends that has not climbed."
_RUNS = "Runs and sweeps: names in --out, or directories."
_REPORTED = "One of them: its directory, its name in --out, or a case."
_ANY, _SWEEPS = offering("case", "run", "sweep"), offering("sweep")
_THRESHOLDS = "Instead: how many climbs there are with other thresholds of what is one."
_PILES = "Sweeps of piles, folders of runs, or runs (or their cases)."
_NULL = "Runs in which nothing can climb: print their false climbs at each threshold beside; repeatable."


def sweep(
    sweep: str = Argument(metavar="SWEEP", help=_SWEEP_FILE, autocompletion=offering("sweep file")),
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
    from walkers.postprocess.uncertainty import lines_of_rest, rests_on
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
        how = By(engine=engine, allow_failed_audit=allow_failed_audit)
        record, failures = run_sweep(loaded, out.resolve() if site else out, options, on_progress=advance, **how)
    tell(*(f"point {failure.point}, {failure.run}: {failure.message}" for failure in failures))
    print(describe_status(record.directory))
    same = [one for one in next(loaded.cases()).origins if one.key not in loaded.keys]  # what varies is in the table
    print_lines(lines_of_rest(rests_on(same)))
    return 1 if failures else 0


def status(
    directory: str = Argument(metavar="DIR", help=f"{_SWEEP}; or the folder of several.", autocompletion=_SWEEPS),
    out: Out = DEFAULT_OUT,
) -> None:
    """Say how many points of a sweep are finished, failed, running and missing, and why they failed."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps.table import describe_status, sweeps_in

    print_lines(describe_status(one) for one in sweeps_in(find_sweep(directory, out)))


def table(
    directory: str = Argument(metavar="DIR", help=f"{_SWEEP}.", autocompletion=_SWEEPS),
    out: Out = DEFAULT_OUT,
    csv: bool = Option(False, "--csv", help="Comma-separated, units in the head."),
    parquet: bool = Option(False, "--parquet", help="Parquet, units in the field metadata."),
    json: bool = Option(False, "--json", help="JSON with units and meanings."),
    to: Path | None = Option(None, help="Write this file (.csv, .parquet, .json) instead."),
    thresholds: bool = Option(False, "--thresholds", help="Where the descents ended instead."),
) -> None:
    """Print the table of a sweep, one row per point: what varied, what follows, what came out, where the run is."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps import table as tables

    sweep = find_sweep(directory, out)
    frame = tables.thresholds(sweep) if thresholds else tables.load(sweep)
    forms = [name for name, wanted in (("csv", csv), ("parquet", parquet), ("json", json)) if wanted]
    refuse("--csv, --parquet, --json, --to", len(forms) + (to is not None) > 1, "expected one of them")
    hidden = to is None and forms == ["parquet"] and sys.stdout.isatty()
    refuse("--parquet", hidden, "is not for a terminal: use --to FILE.parquet, or redirect it")
    if to is not None:
        tables.write_table_file(frame, to)
        print(to)
    elif forms:
        sys.stdout.buffer.write(tables.encoded(frame, forms[0]))
    else:
        print(tables.short_text(frame))


def climb(
    what: list[str] = Argument(metavar="WHAT…", help=_PILES, autocompletion=_ANY),
    out: Out = DEFAULT_OUT,
    within: float | None = Option(None, min=1e-9, help=_WITHIN),
    thresholds: bool = Option(False, "--sensitivity", help=_THRESHOLDS),
    null: list[str] | None = Option(None, help=_NULL),
    to: Path | None = Option(None, help="Write the figure (.png, .svg, .pdf) or the table (.csv) into this file."),
    as_json: Json = False,
) -> None:
    """Print how often piles climbed, how soon, how fast, and led by whom: rates with exact intervals, by conditions."""
    from walkers.pipeline import locate
    from walkers.postprocess.drawing import FORMATS, check_place
    from walkers.sweeps import climbing
    from walkers.sweeps.climbing_figure import write_climbs

    if to is not None:
        check_place(to, *(f".{form}" for form in FORMATS), ".csv")
    places = [locate(one, out).path for one in what]
    conditions = climbing.conditions_in(places)
    tell(*(f"warning: {left}" for place in places if (left := climbing.unfinished_points(place))))
    lines: list[str] = []
    found: list[dict[str, Any]] = []
    if thresholds or null:
        for option, given in {"--within": within, "--to": to}.items():
            refuse(option, given is not None, "has no meaning with --sensitivity or --null")
        nulls = climbing.conditions_in([locate(one, out).path for one in null]) if null else []
        named = [(one.label, one) for one in conditions] + [(f"null: {one.label}".rstrip(), one) for one in nulls]
        for label, one in named:
            found.append({"condition": label, "thresholds": climbing.sensitivity(one.runs)})
            lines += filter(None, [label, climbing.describe_sensitivity(found[-1]["thresholds"])])
    else:
        found = [climbing.summarise(one, within) for one in conditions]
        lines += map(climbing.describe, found)
        if to is not None:
            write_climbs(conditions, found, to)
    print_as(as_json, lambda: found, lambda: "\n".join(lines))


def compare(
    first: RunOrSweep, second: RunOrSweep, out: Out = DEFAULT_OUT, y: SweepColumn = None, as_json: Json = False
) -> None:
    """Print by what two runs or cases differ, in parameters and results; or two sweeps, point by point."""
    from walkers.pipeline import find_side, placed
    from walkers.sweeps.comparison import compare_runs, compare_sweeps

    there = {one: placed(one, out) for one in (first, second)}
    sweeps = {one: place.path for one, place in there.items() if place and place.kind == "sweep"}
    if sweeps.keys() == there.keys():
        found = compare_sweeps(sweeps[first], sweeps[second], y)
    else:
        for one in sweeps:
            refuse(one, True, "is a sweep, to be compared with another sweep")
        refuse("--y", y is not None, "is for sweeps")
        found = compare_runs(find_side(first, out), find_side(second, out))
    print_as(as_json, lambda: found.contents, lambda: found.text)


def list_(
    out: Out = DEFAULT_OUT,
    case: CaseName = None,
    status: Literal["finished", "running", "interrupted", "failed"] | None = Option(
        None, help="Only runs and sweeps of this status."
    ),
    older_than: OlderThan = None,
    where: list[str] | None = Option(
        None, metavar="KEY=VALUE", help='Only runs with this, such as "drive.frequency=80 Hz".'
    ),
    sort: Literal["name", "status", "velocity", "age", "size"] = Option(
        "name", help="The fastest, youngest or largest first."
    ),
    reverse: bool = Option(False, "--reverse", help="The other way round."),
    as_json: Json = False,
) -> None:
    """List runs and sweeps: by what they differ, velocity or climbs, status, age, size."""
    from walkers.sweeps import folder

    found = folder.select(folder.inventory(out), case=case, status=status, older_than=older_than, where=where or ())
    found = folder.ordered(found, sort, reverse=reverse)
    print_as(as_json, lambda: folder.as_json(found), lambda: folder.as_text(found))


def clean(
    runs: list[str] | None = Argument(None, metavar="[RUN|SWEEP]...", help=_RUNS, autocompletion=_ANY),
    out: Out = DEFAULT_OUT,
    finished: bool = Option(False, "--finished", help="Finished runs too, but those that a sweep has."),
    case: CaseName = None,
    older_than: OlderThan = None,
    dry_run: bool = Option(False, "--dry-run", help="Say what would go; remove nothing."),
    yes: bool = Option(False, "--yes", "-y", help="Do not ask."),
) -> int:
    """Remove interrupted and failed runs, or given runs and sweeps, after asking; never what is being made."""
    from walkers.sweeps.folder import clean, plan_cleaning

    check_folder("--out", out)
    refuse("--finished", finished and bool(runs), "has no meaning with given runs")
    plan = plan_cleaning(out, runs or (), finished=finished, case=case, older_than=older_than)
    print(plan.as_text())
    if dry_run or not (plan.remove or plan.locks):
        return 0
    if not yes:
        refuse("--yes", not sys.stdin.isatty(), "expected, for there is no terminal at which to ask")
        if not typer.confirm("remove them?"):
            print("nothing removed")
            return 0
    left = clean(plan)
    tell(*(f"{directory}: {why}" for directory, why in left.items()))
    return 1 if left else 0


def report(
    what: str = Argument(metavar="RUN|SWEEP", help=_REPORTED, autocompletion=_ANY),
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="The HTML file; report.html in the directory if left out."),
) -> None:
    """Write one HTML file to mail: parameters, results, plots, and the beads to be played and turned."""
    print(walkers.report(what, to, out))


def verify(
    what: str = Argument(metavar="RUN|SWEEP|ARCHIVE", help="A run's or sweep's directory, an archive, or a case."),
    out: Out = DEFAULT_OUT,
) -> int:
    """Compare files of a run, a sweep or an archive with their lists; status 1 if any differ or are not listed."""
    from walkers.archive.verification import verify
    from walkers.pipeline import locate

    found = verify(locate(what, out).path)
    print_lines(one.describe() for one in found)
    return 0 if all(one.passed for one in found) else 1


def archive(
    what: str = Argument(metavar="RUN|SWEEP", help="A run's or sweep's directory, or a case."),
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="The .zip to write; NAME.zip here if left out."),
    without_dumps: bool = Option(
        False, "--without-dumps", help="Leave out what the engine wrote of the motion: tables and results stay."
    ),
    author: list[str] | None = Option(None, help="Name of who made the runs; may be repeated."),
    orcid: list[str] | None = Option(None, help="ORCID of the author, in the order of --author."),
    licence: str = Option("CC-BY-4.0", help="CC-BY-4.0, CC0-1.0, CC-BY-SA-4.0 or BSD-3-Clause."),
) -> None:
    """Pack a run, or a sweep with its runs, into an RO-Crate: cases, decks, dumps, tables, checksums, versions."""
    from walkers.archive.crate import Author
    from walkers.archive.writing import ArchiveOptions, write_archive
    from walkers.pipeline import locate

    names, orcids = author or [], orcid or []
    refuse("--orcid", len(orcids) > len(names), "expected an --author for each")
    authors = [Author(name, number) for name, number in zip_longest(names, orcids)]
    place = locate(what, out)
    refuse(what, place.kind == "archive", "an archive: unpack it and give a run or a sweep in it")
    print(write_archive(place.path, to, ArchiveOptions(not without_dumps, authors, licence)))


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

    how = By(engine=engine, allow_failed_audit=allow_failed_audit)
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
    how = By(engine=engine, allow_failed_audit=allow_failed_audit)
    found = calibrate(read, out, on_cores(jobs), progress_of=progress_of_sweep, **how)
    tell(*(f"{name}: {len(failures)} points failed" for name, failures in found.failures.items()))
    print_lines(write_outcome(found, folder))
    return 0  # a set whose run fails is an outcome: it counts as far off


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
