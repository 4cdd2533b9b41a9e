"""Commands on a case or a run: what it is, run it, its result, pictures, files for other programs, what theory says."""

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
    Formats,
    Json,
    Out,
    Run,
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

_OFFERED = offering("case")
_CASES = "Case files, or names of shipped cases."
_DECK = "Write the deck and its files into this new folder, to run by hand."
_LIMIT = "Stop a run (of a pile: a segment) after this many seconds."
_SPREAD = "Also with what is guessed, calibrated or uncertain drawn from its range: a band."
_FOLDER = "Folder to write, replaced if it holds nothing else; RUN/vtk if left out."
_EVERY = "One of so many samples of the drive; one a cycle if left out."
_AS_PLACED = "Walkers where the deck has them, not side by side."
_SLOWDOWN = "So many times slower than in reality; for 5 to 10 s."
_INTERVAL = "Time between views of the whole, as '2 s' or 'T/4' (of a cycle)."


def shipped() -> None:
    """List the cases, sweeps and calibrations that come with the program, by the commands that take them."""
    from walkers.inputs.reading import read_toml
    from walkers.inputs.reading import shipped as files_of

    for kind, command in (("case", "run"), ("sweep", "sweep"), ("calibration", "calibrate")):
        titles = {name: read_toml(file).get("title", "") for name, file in files_of(kind).items()}
        print_lines(f"walkers {command} {name:{30 - len(command)}} {title}" for name, title in titles.items())


def show(case: Case, settings: Set = None, as_json: Json = False) -> None:
    """Show each value of a case and where it comes from, its forces, its time step and its cost."""
    loaded = load(case, settings)
    from walkers.runner.summary import describe, summarise

    summary = summarise(loaded)
    print_as(as_json, lambda: summary, lambda: describe(summary))


def deck(case: Case, settings: Set = None, to: Path | None = Option(None, help=_DECK)) -> None:
    """Print the LIGGGHTS deck of a case, or write it with its files, to be run by hand."""
    from walkers.sweeps.by_hand import write_folder
    from walkers.templates.deck import RUN_NAME, render_deck, whole

    loaded = load(case, settings)
    if to is None:
        print(render_deck(loaded, whole(loaded)).text, end="")
        return
    print(f"{write_folder(loaded, to)}    run it there with: sh {RUN_NAME}    then: walkers run {to}")


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
    from walkers.runner.summary import notes

    refuse("--points", points is not None and not spread, "is for --spread")
    loaded = [load(case, settings) for case in cases]  # a mistake in the last file shows before the first run starts
    check_folder("--out", out)
    if spread:
        from walkers.sweeps.spread import POINTS, describe, run_spread, spread_sweep

        for case in loaded:  # and so does a range that its key does not take
            list(spread_sweep(case, points or POINTS, engine).cases())
    failed, how = False, By(engine=engine, allow_failed_audit=allow_failed_audit)
    for case in loaded:
        tell(*(f"{case.name}: {note}" for note in notes(case)))
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
