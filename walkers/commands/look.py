"""Commands that look at results."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    CaseName,
    Formats,
    Json,
    OlderThan,
    Out,
    Run,
    RunOrSweep,
    Set,
    SweepColumn,
    changes_of,
    load_any,
    load_run,
    print_as,
    print_lines,
    refuse,
    refuse_given,
)
from walkers.completion import offering

_ANY = offering("case", "run", "sweep")
_LISTED = "A sweep (name or folder): print the status of its points and its table."
_SWEEPS = offering("sweep")
_ALL = "Include the runs of sweeps."
_WHERE = 'Only runs with this value, such as "drive.frequency=80 Hz". Repeatable.'
_TABLE = "Write the table of the sweep, with units, to this file (.csv, .parquet, .json)."
_WITHIN = "Count climbs up to this time of the drive, such as '5 s'; default: end of the shortest run without a climb."
_PILES = "Sweeps, folders of runs, runs or cases of piles."
_SECOND = "Another run or sweep, named in the same way; default: the first with the values of --set."
_SECOND_SET = "Replace a value of the second case, such as drive.frequency=70Hz. Repeatable."
_SLOWDOWN = "Film: slow motion factor; default: chosen so that the film lasts 5 to 10 s."


def list_(
    sweep: str | None = Argument(None, metavar="SWEEP", help=_LISTED, autocompletion=_SWEEPS),
    out: Out = DEFAULT_OUT,
    every: bool = Option(False, "--all", help=_ALL),
    case: CaseName = None,
    status: Literal["finished", "running", "interrupted", "failed"] | None = Option(
        None, help="Only runs and sweeps with this status."
    ),
    older_than: OlderThan = None,
    where: list[str] | None = Option(None, metavar="KEY=VALUE", help=_WHERE),
    sort: Literal["name", "status", "velocity", "age", "size"] = Option(
        "name", help="Sort by this; the fastest, youngest or largest comes first."
    ),
    reverse: bool = Option(False, "--reverse", help="Reverse the order."),
    to: Path | None = Option(None, help=_TABLE),
    as_json: Json = False,
) -> None:
    """List runs and sweeps with status, result, age and size, or print the table of one sweep."""
    from walkers.sweeps import folder

    if sweep is not None:
        given = {"--case": case, "--status": status, "--older-than": older_than, "--where": where, "--all": every}
        refuse_given({**given, "--sort": sort != "name", "--reverse": reverse}, "is for folders, not for a sweep")
        _list_points(sweep, out, to, as_json)
        return
    refuse("--to", to is not None, "expected a sweep, whose table is written")
    found = folder.inventory(out)
    hidden = [] if every or where else folder.members(found)
    shown = folder.select(found, case=case, status=status, older_than=older_than, where=where or ())
    shown = folder.ordered([one for one in shown if one not in hidden], sort, reverse=reverse)
    print_as(as_json, lambda: folder.as_json(shown), lambda: folder.as_text(shown, hidden=len(hidden)))


def _list_points(sweep: str, out: Path, to: Path | None, as_json: bool) -> None:
    from walkers.api import Sweep, find
    from walkers.errors import refused
    from walkers.sweeps import table

    kind, place = find(sweep, out)
    refuse(sweep, kind == "run", f"is a run: walkers run {sweep} prints its result")
    if kind == "case":
        raise refused(sweep, f"no sweep in {out}; walkers list shows what is there")
    refuse(sweep, kind != "sweep", f"not a sweep: expected a folder with a sweep.json (walkers list --out {sweep}?)")
    found = Sweep(place)
    if to is not None:
        table.write_table_file(found.table(), to)
        print(to)
    elif as_json:
        print(table.encoded(found.table(), "json").decode(), end="")
    else:
        print(found.describe())


def plot(
    run: RunOrSweep,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="Runs: folder of the figures. Sweeps: file to write (.png, .pdf, .svg)."),
    x: str | None = Option(None, help="Sweeps: key or column on the x axis."),
    y: SweepColumn = None,
    hue: str | None = Option(None, help="Sweeps: key or column that sets the colour, or none."),
    panels: str | None = Option(None, help="Sweeps: key or column that sets the panel, or none."),
    log_x: bool = Option(False, "--logx", help="Sweeps: logarithmic x axis."),
    log_y: bool = Option(False, "--logy", help="Sweeps: logarithmic y axis."),
    theory: bool = Option(False, "--theory", help="Sweeps: also draw the theory."),
    formats: Formats = None,
) -> None:
    """Plot a run (path, orientation and gait of walkers; climbs of piles) or a column of a sweep's table."""
    found = load_any(run, settings, out)
    if isinstance(found, walkers.Sweep):
        refuse("--format", bool(formats), "is for runs: a sweep's figure has the format of --to's name")
        log = "x" * log_x + "y" * log_y
        print_lines(found.plot(to, x=x, y=y, hue=hue, panels=panels, log=log, theory=theory))
        return
    given = {"--x": x, "--y": y, "--hue": hue, "--panels": panels, "--logx": log_x, "--logy": log_y, "--theory": theory}
    refuse_given(given, "is for sweeps")
    print_lines(found.plot(to, formats or ["png"]))


def render(
    run: Run,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="File to write: .png; films: .mp4, .gif; default: in the run's folder."),
    walker: int | None = Option(None, min=0, help="Walker to show, counted from 0; default: the first, or all beads."),
    images: int | None = Option(None, min=1, max=20, help="Largest number of pictures; default: 6."),
    film: bool = Option(False, "--film", help="Render a film instead of pictures."),
    size: str | None = Option(None, help="Film: 360p, 480p, 720p, 1080p, or pixels such as 1280x720; default: 720p."),
    fps: int | None = Option(None, min=1, max=60, help="Film: frames per second; default: 25."),
    slowdown: float | None = Option(None, min=0.05, max=10000.0, help=_SLOWDOWN),
    begin: str | None = Option(None, help="Film: physical time of the first frame, such as '0.1 s'."),
    end: str | None = Option(None, help="Film: physical time of the last frame."),
) -> None:
    """Render pictures of a run at several times, or a film with --film."""
    from walkers.postprocess.films import FilmOptions, parse_size, parse_time
    from walkers.progress import progress_of_film

    of_films = {"--size": size, "--fps": fps, "--slowdown": slowdown, "--begin": begin, "--end": end}
    if film:
        refuse_given({"--images": images}, "is for pictures, not for --film")
    else:
        refuse_given(of_films, "is for --film")
    found = load_run(run, settings, out)
    if film:
        options = FilmOptions(
            size=parse_size(size or "720p"),
            fps=fps or 25,
            slowdown=slowdown,
            walker=walker,
            begin=parse_time("--begin", begin) if begin else 0.0,
            end=parse_time("--end", end) if end else None,
        )
        with progress_of_film(found.case.name) as advance:
            path = found.film(to, options, on_progress=advance)
        print(path)
        return
    print_lines(found.render(to, images=images or 6, walker=walker))


def report(
    what: RunOrSweep,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="HTML file to write; default: report.html in the folder of the run or sweep."),
) -> None:
    """Write a self-contained HTML report: parameters, results, plots and a 3-D view of the motion."""
    from walkers.postprocess.report.page import check_report

    if to is not None:
        check_report(to)
    print(load_any(what, settings, out).report(to))


def compare(
    first: RunOrSweep,
    second: str | None = Argument(None, metavar="RUN|SWEEP", help=_SECOND, autocompletion=_ANY),
    settings: list[str] | None = Option(None, "--set", metavar="KEY=VALUE", help=_SECOND_SET),
    out: Out = DEFAULT_OUT,
    y: SweepColumn = None,
    as_json: Json = False,
) -> None:
    """Compare two runs or cases in parameters and results, or two sweeps point by point."""
    refuse(first, second is None and not settings, "expected a second run or sweep, or --set KEY=VALUE")
    found = walkers.compare(first, second, out, changes_of(settings), y)
    print_as(as_json, lambda: found.contents, lambda: found.text)


def climb(
    what: list[str] = Argument(metavar="WHAT", help=_PILES, autocompletion=_ANY),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    within: str | None = Option(None, help=_WITHIN),
    to: Path | None = Option(None, help="Write the figure (.png, .svg, .pdf) or the table (.csv) to this file."),
    as_json: Json = False,
) -> None:
    """Print probability, rate and speed of climbs in piles for each condition, with confidence intervals."""
    from walkers.postprocess.films import parse_time
    from walkers.sweeps.climbing import describe

    until = parse_time("--within", within) if within else None
    found = walkers.climb(what, out, changes_of(settings), within=until, to=to)
    print_as(as_json, lambda: found, lambda: "\n".join(map(describe, found)))
