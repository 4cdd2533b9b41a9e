"""Commands on what is there: text, tables, pictures, files for other programs, archives; listing and removing."""

from __future__ import annotations

import sys
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal

import typer
from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    Case,
    CaseName,
    Formats,
    Json,
    OlderThan,
    Out,
    Run,
    RunOrSweep,
    Set,
    SweepColumn,
    check_folder,
    load,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.completion import offering

_SWEEP = "A sweep: its directory or its name in --out"
_FOLDER = "Folder to write, replaced if it holds nothing else; RUN/vtk if left out."
_EVERY = "One of so many samples of the drive; one a cycle if left out."
_AS_PLACED = "Walkers where the deck has them, not side by side."
_SLOWDOWN = "So many times slower than in reality; for 5 to 10 s."
_INTERVAL = "Time between views of the whole, as '2 s' or 'T/4' (of a cycle)."
_WITHIN = "Climbs until then, s of drive; if left out until the shortest run's end."
_RUNS = "Runs and sweeps: names in --out, or directories."
_REPORTED = "One of them: its directory, its name in --out, or a case."
_ANY, _SWEEPS = offering("case", "run", "sweep"), offering("sweep")
_THRESHOLDS = "Instead: how many climbs there are with other thresholds of what is one."
_PILES = "Sweeps of piles, folders of runs, or runs (or their cases)."
_NULL = "Runs in which nothing can climb: print their false climbs at each threshold beside; repeatable."


def show(case: Case, settings: Set = None, as_json: Json = False) -> None:
    """Show each value of a case and where it comes from, its forces, its time step and its cost."""
    loaded = load(case, settings)
    from walkers.runner.summary import describe, summarise

    summary = summarise(loaded)
    print_as(as_json, lambda: summary, lambda: describe(summary))


def result(run: Run, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print the result of a finished run."""
    from dataclasses import replace

    found = replace(walkers.find_run(run, out), cached=False)
    print_as(as_json, lambda: found.result, found.describe)


def plot(
    run: RunOrSweep,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="Of a run the folder for its figures; of a sweep the file (.png, .pdf, .svg)."),
    x: str | None = Option(None, help="Of a sweep: a key that varies, or a column of its table."),
    y: SweepColumn = None,
    hue: str | None = Option(None, help="Of a sweep: what colours tell apart; or none."),
    panels: str | None = Option(None, help="Of a sweep: what panels tell apart; or none."),
    log_x: bool = Option(False, "--logx", help="Of a sweep: x logarithmic."),
    log_y: bool = Option(False, "--logy", help="Of a sweep: y logarithmic."),
    theory: bool = Option(False, "--theory", help="Of a sweep: what the theory predicts, too."),
    formats: Formats = None,
) -> None:
    """Draw a sweep's table; or a run: where walkers went and turned, and their gait; of a pile, what climbed."""
    from walkers.pipeline import locate, run_at

    place = locate(run, out)
    if place.kind == "sweep":
        refuse("--format", bool(formats), "is for runs: a sweep's figure has the format of --to's name")
        log = "x" * log_x + "y" * log_y
        print(walkers.plot_sweep(place.path, to, x=x, y=y, hue=hue, panels=panels, log=log, theory=theory))
        return
    given = {"--x": x, "--y": y, "--hue": hue, "--panels": panels, "--logx": log_x, "--logy": log_y, "--theory": theory}
    for option, value in given.items():
        refuse(option, bool(value), "is for sweeps")
    print_lines(run_at(place, run).plot(to, formats or ["png"]))


def render(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="The PNG to write; in the run directory if left out."),
    walker: int | None = Option(None, min=0, help="Number of a walker to show by itself."),
    images: int | None = Option(None, min=1, max=20, help="How many times to show; 6 if left out."),
    interval: str | None = Option(None, help=_INTERVAL),
) -> None:
    """Render a walker at several times, or views of a whole run (off-screen); for films: walkers film."""
    from walkers.postprocess.series import render_series, seconds_apart

    found, number = walkers.find_run(run, out), images or 6
    refuse("--interval", interval is not None and walker is not None, "is for views of the whole")
    if walker is not None:
        count = sum(make.replicates for make in found.case.walkers)
        refuse("--walker", not count, "the run has none")
        refuse("--walker", walker >= count, f"expected less than {count}, the run's number of walkers")
        print_lines(render_series(found.directory, to, images=number, walker=walker))
    elif interval is not None:
        apart = seconds_apart(interval, found.directory)
        print_lines(render_series(found.directory, to, images=number, apart=apart))
    else:
        print_lines(found.render(to, images=number))


def film(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="The .mp4 or .gif to write; film.mp4 in the run directory."),
    size: str = Option("720p", help="360p, 480p, 720p, 1080p, or pixels as 1280x720."),
    fps: int = Option(25, min=1, max=60, help="Pictures a second."),
    slowdown: float | None = Option(None, min=0.05, max=10000.0, help=_SLOWDOWN),
    walker: int | None = Option(None, min=0, help="Number of the walker to show; the first one."),
    begin: str | None = Option(None, "--from", help="Physical time of the first picture, as '0.1 s'."),
    end: str | None = Option(None, "--until", help="Physical time of the last picture."),
) -> None:
    """Film a walker, a tray, a cluster or a pile: MP4 or GIF, with time, slow motion and scale (off-screen)."""
    from walkers.postprocess.films import FilmOptions, parse_size, parse_time
    from walkers.progress import progress_of_film

    found = walkers.find_run(run, out)
    options = FilmOptions(
        size=parse_size(size),
        fps=fps,
        slowdown=slowdown,
        walker=walker,
        begin=parse_time("--from", begin) if begin else 0.0,
        end=parse_time("--until", end) if end else None,
    )
    with progress_of_film(found.case.name) as advance:
        path = found.film(to, options, on_progress=advance)
    print(path)


def vtk(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help=_FOLDER),
    as_placed: bool = Option(False, "--as-placed", help=_AS_PLACED),
    vtu: bool = Option(False, "--vtu", help="Also write the beads as .vtu."),
    every: int | None = Option(None, min=1, help=_EVERY),
) -> None:
    """Write beads, bridges and boundary as .vtp with a .pvd in seconds."""
    print(_run_to_place(run, out, as_placed).vtk(to, every=every, vtu=vtu, as_placed=as_placed))


def paraview(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help=_FOLDER),
    as_placed: bool = Option(False, "--as-placed", help=_AS_PLACED),
    every: int | None = Option(None, min=1, help=_EVERY),
    colour: str | None = Option(None, help="Array to colour the beads by; walker, else speed."),
    start: bool = Option(False, "--open", help="Start ParaView with it."),
) -> None:
    """Write what walkers vtk writes and a script that shows it in ParaView: spheres, bridges, walls, time."""
    from walkers.postprocess.paraview import open_paraview

    found = _run_to_place(run, out, as_placed)
    script = found.paraview(to, colour=colour, every=every, as_placed=as_placed)
    print(script)
    if start:
        open_paraview(script)


def _run_to_place(run: str, out: Path, as_placed: bool) -> walkers.Run:
    """A run; ``--as-placed`` is refused of walkers that are nowhere else."""
    found = walkers.find_run(run, out)
    wrong = as_placed and not found.case.apart
    refuse("--as-placed", wrong, "is for independent walkers: these stand where they are")
    return found


def export(
    run: Run,
    to: Path = Option(help="The .xyz (extended XYZ) or .lammpstrj (LAMMPS dump) to write."),
    out: Out = DEFAULT_OUT,
    every: int = Option(1, min=1, help="One of so many samples of the drive."),
) -> None:
    """Write the beads' trajectory as extended XYZ or as a LAMMPS dump: mm, s, relative to the boundary."""
    print(walkers.find_run(run, out).export(to, every=every))


def theory(case: Case, settings: Set = None, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print what the paper's model and its extensions predict, beside the engine's result if the case was run."""
    from walkers.inputs.errors import InputError, Problem
    from walkers.runner.failures import EngineMissing
    from walkers.theory.prediction import describe, predict

    try:
        loaded = load(case, settings)
        prediction = predict(loaded)
    except ValueError as error:
        key, _, told = str(error).partition(": ")
        raise InputError(case, [Problem(key, None, told)]) from error
    found: dict[str, Any] | None = None
    with suppress(InputError, EngineMissing):  # not run yet, or never to be run here
        found = walkers.find_run(loaded, out).result
    print_as(as_json, lambda: {**prediction, "engine": found}, lambda: describe(prediction, found))


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
    within: float | None = Option(None, min=0.0, help=_WITHIN),
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
    conditions = climbing.conditions_in([locate(one, out).path for one in what])
    if thresholds or null:
        for option, given in {"--within": within, "--to": to}.items():
            refuse(option, given is not None, "has no meaning with --sensitivity or --null")
        nulls = climbing.conditions_in([locate(one, out).path for one in null]) if null else []
        tried = {one.label: climbing.sensitivity(one.runs) for one in conditions}
        tried |= {f"null: {one.label}": climbing.sensitivity(one.runs) for one in nulls}
        lines = [line for label, rows in tried.items() for line in (label, climbing.describe_sensitivity(rows)) if line]
        print_as(as_json, lambda: tried, lambda: "\n".join(lines))
        return
    found = {one.label: climbing.summarise_climbs(one.runs, within) for one in conditions}
    if to is not None:
        write_climbs(conditions, list(found.values()), to)
    lines = []
    for one in conditions:
        told = found[one.label]
        told["assembly"] = climbing.summarise_origins(one.runs)
        told_origins = climbing.describe_origins(told["assembly"])
        lines += filter(None, [one.label, climbing.describe_climbs(told), told_origins])
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
