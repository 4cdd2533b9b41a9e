"""Commands that look at cases, runs and sweeps: text, tables, pictures, files for other programs."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from walkers import completion
from walkers.commands.arguments import (
    Case,
    Formats,
    Json,
    Out,
    Run,
    RunOrSweep,
    Set,
    SweepColumn,
    load,
    print_as,
    print_lines,
    refuse,
)
from walkers.pipeline import DEFAULT_OUT

PlotTarget = Annotated[
    Path | None,
    typer.Option("--to", help="Of a run the folder for its figures; of a sweep the file (.png, .pdf, .svg)."),
]
X = Annotated[str | None, typer.Option("--x", help="Of a sweep: a key that varies, or a column of its table.")]
Hue = Annotated[str | None, typer.Option("--hue", help="Of a sweep: what colours tell apart; or none.")]
Panels = Annotated[str | None, typer.Option("--panels", help="Of a sweep: what panels tell apart; or none.")]
LogX = Annotated[bool, typer.Option("--logx", help="Of a sweep: x logarithmic.")]
LogY = Annotated[bool, typer.Option("--logy", help="Of a sweep: y logarithmic.")]
WithTheory = Annotated[bool, typer.Option("--theory", help="Of a sweep: what the theory predicts, too.")]
Picture = Annotated[Path | None, typer.Option("--to", help="The PNG to write; in the run directory if left out.")]
OneWalker = Annotated[int | None, typer.Option("--walker", min=0, help="Number of a walker to show by itself.")]
Images = Annotated[int | None, typer.Option("--images", min=1, max=20, help="How many times to show; 6 if left out.")]
Interval = Annotated[
    str | None, typer.Option("--interval", help="Time between views of the whole, as '2 s' or 'T/4' (of a cycle).")
]
FilmFile = Annotated[
    Path | None, typer.Option("--to", help="The .mp4 or .gif to write; film.mp4 in the run directory.")
]
Size = Annotated[str, typer.Option("--size", help="360p, 480p, 720p, 1080p, or pixels as 1280x720.")]
Fps = Annotated[int, typer.Option("--fps", min=1, max=60, help="Pictures a second.")]
Slowdown = Annotated[
    float | None,
    typer.Option("--slowdown", min=0.05, max=10000.0, help="So many times slower than in reality; for 5 to 10 s."),
]
FilmedWalker = Annotated[
    int | None, typer.Option("--walker", min=0, help="Number of the walker to show; the first one.")
]
From = Annotated[str | None, typer.Option("--from", help="Physical time of the first picture, as '0.1 s'.")]
Until = Annotated[str | None, typer.Option("--until", help="Physical time of the last picture.")]
VtkFolder = Annotated[
    Path | None, typer.Option("--to", help="Folder to write, replaced if it holds nothing else; RUN/vtk if left out.")
]
AsPlaced = Annotated[bool, typer.Option("--as-placed", help="Walkers where the deck has them, not side by side.")]
Every = Annotated[
    int | None, typer.Option("--every", min=1, help="One of so many samples of the drive; one a cycle if left out.")
]
Vtu = Annotated[bool, typer.Option("--vtu", help="Also write the beads as .vtu.")]
Colour = Annotated[str | None, typer.Option("--colour", help="Array to colour the beads by; walker, else speed.")]
Open = Annotated[bool, typer.Option("--open", help="Start ParaView with it.")]
TrajectoryFile = Annotated[
    Path, typer.Option("--to", help="The .xyz (extended XYZ) or .lammpstrj (LAMMPS dump) to write.")
]
EachOf = Annotated[int, typer.Option("--every", min=1, help="One of so many samples of the drive.")]
Sweeps = Annotated[
    str,
    typer.Argument(
        metavar="DIR", help="A sweep: its directory or its name in --out.", autocompletion=completion.sweeps
    ),
]
SweepOrFolder = Annotated[
    str,
    typer.Argument(
        metavar="DIR",
        help="A sweep: its directory or its name in --out; or the folder of several.",
        autocompletion=completion.sweeps,
    ),
]
Csv = Annotated[bool, typer.Option("--csv", help="Comma-separated, units in the head.")]
Parquet = Annotated[bool, typer.Option("--parquet", help="Parquet, units in the field metadata.")]
JsonTable = Annotated[bool, typer.Option("--json", help="JSON with units and meanings.")]
TableFile = Annotated[Path | None, typer.Option("--to", help="Write this file (.csv, .parquet, .json) instead.")]
Thresholds = Annotated[bool, typer.Option("--thresholds", help="Where the descents ended instead.")]
Piles = Annotated[
    str,
    typer.Argument(metavar="DIR", help="A sweep of piles, a folder of runs, or one run (or its case)."),
]
Within = Annotated[
    float | None,
    typer.Option("--within", min=0.0, help="Climbs until then, s of drive; if left out until the shortest run's end."),
]
Sensitivity = Annotated[
    bool, typer.Option("--sensitivity", help="Instead: how many climbs there are with other thresholds of what is one.")
]


def show(case: Case, settings: Set = None, as_json: Json = False) -> None:
    """Show each value of a case and where it comes from, its forces, its time step and its cost."""
    loaded = load(case, settings)
    from walkers.runner.summary import describe, summarise

    summary = summarise(loaded)
    print_as(as_json, lambda: summary, lambda: describe(summary))


def result(run: Run, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print the result of a finished run."""
    from dataclasses import replace

    from walkers.pipeline import find_run

    found = replace(find_run(run, out), cached=False)
    print_as(as_json, lambda: found.result, found.describe)


def plot(
    run: RunOrSweep,
    out: Out = DEFAULT_OUT,
    to: PlotTarget = None,
    x: X = None,
    y: SweepColumn = None,
    hue: Hue = None,
    panels: Panels = None,
    log_x: LogX = False,
    log_y: LogY = False,
    theory: WithTheory = False,
    formats: Formats = None,
) -> None:
    """Draw a sweep's table; or a run: where walkers went and turned, and their gait; of a pile, what climbed."""
    from walkers.pipeline import find_run, find_sweep

    sweep = find_sweep(run, out)
    if sweep is not None:
        from walkers.plotting import plot_sweep

        refuse("--format", bool(formats), "is for runs: a sweep's figure has the format of --to's name")
        log = "x" * log_x + "y" * log_y
        print(plot_sweep(sweep, to, x=x, y=y, hue=hue, panels=panels, log=log, theory=theory))
        return
    given = {"--x": x, "--y": y, "--hue": hue, "--panels": panels, "--logx": log_x, "--logy": log_y, "--theory": theory}
    for option, value in given.items():
        refuse(option, bool(value), "is for sweeps")
    print_lines(find_run(run, out).plot(to, formats or ["png"]))


def render(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Picture = None,
    walker: OneWalker = None,
    images: Images = None,
    interval: Interval = None,
) -> None:
    """Render a walker at several times, or views of a whole run (off-screen); for films: walkers film."""
    from walkers.pipeline import find_run
    from walkers.postprocess.series import render_series, seconds_apart

    found, number = find_run(run, out), images or 6
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
    to: FilmFile = None,
    size: Size = "720p",
    fps: Fps = 25,
    slowdown: Slowdown = None,
    walker: FilmedWalker = None,
    begin: From = None,
    end: Until = None,
) -> None:
    """Film a walker, a tray, a cluster or a pile: MP4 or GIF, with time, slow motion and scale (off-screen)."""
    from walkers.pipeline import find_run
    from walkers.postprocess.films import FilmOptions, parse_size, parse_time
    from walkers.progress import progress_of_film

    found = find_run(run, out)
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


def _refuse_as_placed(as_placed: bool, apart: bool) -> None:
    """Refuse ``--as-placed`` of walkers that are nowhere else."""
    refuse("--as-placed", as_placed and not apart, "is for independent walkers: these stand where they are")


def vtk(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: VtkFolder = None,
    as_placed: AsPlaced = False,
    vtu: Vtu = False,
    every: Every = None,
) -> None:
    """Write beads, bridges and boundary as .vtp with a .pvd in seconds."""
    from walkers.pipeline import find_run

    found = find_run(run, out)
    _refuse_as_placed(as_placed, found.case.apart)
    print(found.vtk(to, every=every, vtu=vtu, as_placed=as_placed))


def paraview(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: VtkFolder = None,
    as_placed: AsPlaced = False,
    every: Every = None,
    colour: Colour = None,
    start: Open = False,
) -> None:
    """Write what walkers vtk writes and a script that shows it in ParaView: spheres, bridges, walls, time."""
    from walkers.pipeline import find_run
    from walkers.postprocess.paraview_script import open_paraview

    found = find_run(run, out)
    _refuse_as_placed(as_placed, found.case.apart)
    script = found.paraview(to, colour=colour, every=every, as_placed=as_placed)
    print(script)
    if start:
        open_paraview(script)


def export(run: Run, to: TrajectoryFile, out: Out = DEFAULT_OUT, every: EachOf = 1) -> None:
    """Write the beads' trajectory as extended XYZ or as a LAMMPS dump: mm, s, relative to the boundary."""
    from walkers.pipeline import find_run

    print(find_run(run, out).export(to, every=every))


def theory(case: Case, settings: Set = None, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print what the paper's model and its extensions predict, beside the engine's result if the case was run."""
    from walkers.inputs.errors import InputError, Problem
    from walkers.pipeline import find_run
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
        found = find_run(loaded, out).result
    print_as(as_json, lambda: {**prediction, "engine": found}, lambda: describe(prediction, found))


def status(directory: SweepOrFolder, out: Out = DEFAULT_OUT) -> None:
    """Say how many points of a sweep are finished, failed, running and missing, and why they failed."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps.table import describe_status, sweeps_in

    print_lines(describe_status(one) for one in sweeps_in(find_sweep(directory, out) or Path(directory)))


def table(
    directory: Sweeps,
    out: Out = DEFAULT_OUT,
    csv: Csv = False,
    parquet: Parquet = False,
    json: JsonTable = False,
    to: TableFile = None,
    thresholds: Thresholds = False,
) -> None:
    """Print the table of a sweep, one row per point: what varied, what follows, what came out, where the run is."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps.table import encoded, load, short_text, write_table_file
    from walkers.sweeps.table import thresholds as thresholds_of

    sweep = find_sweep(directory, out) or Path(directory)
    frame = thresholds_of(sweep) if thresholds else load(sweep)
    forms = [name for name, wanted in (("csv", csv), ("parquet", parquet), ("json", json)) if wanted]
    refuse("--csv, --parquet, --json, --to", len(forms) + (to is not None) > 1, "expected one of them")
    hidden = to is None and forms == ["parquet"] and sys.stdout.isatty()
    refuse("--parquet", hidden, "is not for a terminal: use --to FILE.parquet, or redirect it")
    if to is not None:
        write_table_file(frame, to)
        print(to)
    elif forms:
        sys.stdout.buffer.write(encoded(frame, forms[0]))
    else:
        print(short_text(frame))


def climb(
    directory: Piles,
    out: Out = DEFAULT_OUT,
    within: Within = None,
    thresholds: Sensitivity = False,
    as_json: Json = False,
) -> None:
    """Print how often piles climbed, how soon, how fast, and led by whom."""
    from walkers.pipeline import locate
    from walkers.sweeps.climbing import describe_climbs, describe_sensitivity, piles_in, sensitivity, summarise_climbs

    groups = piles_in(locate(directory, out).path)
    if thresholds:
        refuse("--within", within is not None, "has no meaning with --sensitivity")
        tried = {label: sensitivity(runs) for label, runs in groups.items()}
        lines = [line for label, rows in tried.items() for line in (label, describe_sensitivity(rows)) if line]
        print_as(as_json, lambda: tried, lambda: "\n".join(lines))
        return
    found = {label: summarise_climbs(runs, within) for label, runs in groups.items()}
    lines = []
    for label, climbs in found.items():
        lines += [*([label] if label else []), describe_climbs(climbs)]
        if climbs["out_of_pile"]["climbs"] < climbs["climbs"]:
            lines.append("of clusters that came out of the pile, and did not hang on a wall since the pouring:")
            lines.append(describe_climbs(climbs["out_of_pile"]))
    print_as(as_json, lambda: found, lambda: "\n".join(lines))


def compare(
    first: RunOrSweep, second: RunOrSweep, out: Out = DEFAULT_OUT, y: SweepColumn = None, as_json: Json = False
) -> None:
    """Print by what two runs or cases differ, in parameters and results; or two sweeps, point by point."""
    from walkers.pipeline import find_side, find_sweep
    from walkers.sweeps.comparison import compare_runs, compare_sweeps

    sweeps = [find_sweep(one, out) for one in (first, second)]
    if sweeps[0] is not None and sweeps[1] is not None:
        found = compare_sweeps(sweeps[0], sweeps[1], y)
    else:
        for one, sweep in zip((first, second), sweeps, strict=True):
            refuse(one, sweep is not None, "is a sweep, to be compared with another sweep")
        refuse("--y", y is not None, "is for sweeps")
        found = compare_runs(find_side(first, out), find_side(second, out))
    print_as(as_json, lambda: found.contents, lambda: found.text)
