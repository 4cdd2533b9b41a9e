"""Commands that look at results."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.options import (
    FormatsOption,
    JsonOption,
    LookupOptions,
    OutOption,
    QuietOption,
    RunArgument,
    RunOrSweepArgument,
    print_as,
    print_lines,
    refuse,
    refuse_any,
    run_of,
    tell,
)
from walkers.errors import input_error, suggestion
from walkers.postprocess.measure.table_units import UnitSystem
from walkers.postprocess.show.film_options import FilmOptions, Seconds
from walkers.sweeps.figure_options import FigureOptions
from walkers.terminal import table_width


def list_(
    sweep: Annotated[str | None, Parameter(name="SWEEP")] = None,
    /,
    *,
    out: OutOption = DEFAULT_OUT,
    every: Annotated[bool, Parameter("--all")] = False,
    where: Annotated[list[str] | None, Parameter(metavar="CONDITION")] = None,
    to: Path | None = None,
    units: UnitSystem | None = None,
    as_json: JsonOption = False,
) -> None:
    """List runs and sweeps with status, result, age and size, or print the table of one sweep.

    Parameters
    ----------
    sweep
        A sweep (name or folder): print the status of its points and its table.
    every
        Include the runs of sweeps, spreads and accuracies.
    where
        Only runs with this value or result, such as "drive.frequency=80 Hz" or "velocity>1mm/s".
        Repeatable.
    to
        Write the table of the sweep, with units, to this file (.csv, .parquet, .json).
    units
        Units of --to: SI, or mm for mm, mm/s, g (9.8 m/s^2), µN, nJ and degrees; default: SI. Keys
        that vary keep the units of the sweep file.
    """
    from walkers.runs.listing import select
    from walkers.sweeps import listing

    refuse("--units", units is not None and to is None, "is for --to")
    if sweep is not None:
        refuse_any({"where": where, "all": every}, "is for folders, not for a sweep")
        _list_points(sweep, out, to, units or "SI", as_json)
        return
    refuse("--to", to is not None, "expected a sweep, whose table is written")
    entries = listing.inventory(out)
    usual = listing.without_members(entries)
    usual_names = {entry.name for entry in usual}
    shown = entries if every else usual
    hidden = len(entries) - len(shown)
    usually_hidden = 0
    if where:
        searched = entries if every else listing.without_draws(entries)
        shown = select([entry for entry in searched if entry.kind == "run"], where)
        hidden = 0
        usually_hidden = len({entry.name for entry in shown} - usual_names)
    print_as(
        as_json,
        lambda: listing.as_json(shown),
        lambda: listing.listing_text(shown, hidden, table_width(), usually_hidden=usually_hidden),
    )


def _list_points(name: str, out: Path, to: Path | None, units: UnitSystem, as_json: bool) -> None:
    """Print the points of a sweep, or write its table."""
    from walkers.api import Sweep
    from walkers.postprocess.measure.table_units import in_units
    from walkers.runs.names import find
    from walkers.sweeps import table
    from walkers.sweeps.record import RECORD_NAME

    reference = find(name, out)
    kind = reference.kind
    refuse(name, kind == "run", f"is a run: walkers run {name} prints its result")
    if kind == "case":
        sweeps = [record.parent.name for record in sorted(out.glob(f"*/{RECORD_NAME}"))]
        hint = suggestion(name, sweeps) or "; walkers list shows what is there"
        raise input_error(name, f"no sweep in {out}{hint}")
    refuse(
        name,
        kind != "sweep",
        f"not a sweep: expected a folder with a sweep.json (walkers list --runs {name}?)",
    )
    sweep = Sweep(reference.path)
    if to is not None:
        frame = sweep.table()
        table.write_table_file(in_units(frame, units, frame.attrs["varied"]), to)
        print(to)
    elif as_json:
        print(table.encoded(sweep.table(), "json").decode(), end="")
    else:
        print(sweep.describe())


def plot(
    name: RunOrSweepArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    to: Path | None = None,
    options: FigureOptions = FigureOptions(),
    formats: FormatsOption = None,
) -> None:
    """Plot a run (path, orientation and gait of walkers; climbs of piles) or a column of a sweep's
    table.

    Parameters
    ----------
    to
        Runs: folder to write the figures to. Sweeps: file to write (.png, .pdf, .svg).
    """
    loaded = lookup.load(name)
    if isinstance(loaded, walkers.Run):
        given = dict(vars(options))
        given["data"] = given.pop("data_files")  # as the option is called
        refuse_any(given, "is for sweeps")
        print_lines(loaded.plot(to, formats or ["png"]))
        return
    refuse("--format", bool(formats), "is for runs: a sweep's figure has the format of --to's name")
    print_lines(loaded.plot(to, **vars(options)))


def log(
    run: RunArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    follow: Annotated[bool, Parameter(("--follow", "-f"))] = False,
) -> None:
    """Print the engine's log of a run, finished or not; of a pile, that of all segments in order.

    Parameters
    ----------
    follow
        Also print what is added, until the run ends.
    """
    loaded = lookup.run(run)
    if not follow:
        print(loaded.log(), end="")
        return
    for piece in loaded.follow_log():
        print(piece, end="", flush=True)


def render(
    run: RunArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    to: Path | None = None,
    images: int | None = None,
    film: bool = False,
    options: FilmOptions = FilmOptions(),
    quiet: QuietOption = False,
) -> None:
    """Render pictures of a run at several times, or a film with --film; before any run, the start
    of the case.

    Parameters
    ----------
    to
        File to write: .png; films: .mp4, .gif; default: in the run's folder; the start of a case:
        CASE-start.png in the current folder.
    images
        Largest number of pictures; default: 6.
    film
        Render a film instead of pictures.
    """
    from walkers.api import has_not_begun
    from walkers.postprocess.show.start import NOTHING_HAS_RUN

    if film:
        refuse("--images", images is not None, "is for pictures, not for --film")
        print(lookup.run(run).film(to, progress=not quiet, **vars(options)))
        return
    defaults = vars(FilmOptions(walker=options.walker))
    changed = {name: value != defaults[name] for name, value in vars(options).items()}
    refuse_any(changed, "is for --film")
    reference = lookup.find(run)
    if has_not_begun(reference):
        refuse("--images", images is not None, NOTHING_HAS_RUN)
        print_lines(walkers.draw_start(reference, to, walker=options.walker))
        if not quiet:
            tell(f"{reference.case.name}: {NOTHING_HAS_RUN}")
        return
    number = 6 if images is None else images
    print_lines(run_of(reference).render(to, images=number, walker=options.walker))


def report(
    name: RunOrSweepArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    to: Path | None = None,
    opened: Annotated[bool, Parameter("--open")] = False,
) -> None:
    """Write a self-contained HTML report: parameters, results, plots and a 3-D view of the motion.

    Parameters
    ----------
    to
        HTML file to write; default: report.html in the folder of the run or sweep.
    opened
        Also open the report in a browser.
    """
    path = lookup.load(name).report(to)
    print(path)
    if opened and not webbrowser.open(path.resolve().as_uri()):
        tell(f"no browser was found; open {path} yourself")


def compare(
    first: RunOrSweepArgument,
    second: Annotated[str | None, Parameter(name="OTHER")] = None,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    as_json: JsonOption = False,
) -> None:
    """Compare two runs or cases in parameters and results, or the points of a sweep with its first;
    --set changes the second case.

    Parameters
    ----------
    second
        Another run or case, named in the same way; default: the first with the values of --set.
    """
    second_case = None
    if second is not None or lookup.changes:
        second_case = lookup.find(second or first)
    comparison = walkers.compare(first, second_case, lookup.out)
    print_as(as_json, lambda: comparison.contents, lambda: comparison.text)


def climb(
    *names: Annotated[
        RunOrSweepArgument, Parameter(required=True, help="Sweeps, runs or cases of piles.")
    ],
    lookup: LookupOptions = LookupOptions(),
    within: Seconds | None = None,
    to: Path | None = None,
    as_json: JsonOption = False,
) -> None:
    """Print probability, rate and speed of climbs in piles for each condition, with confidence
    intervals.

    Parameters
    ----------
    within
        Count climbs up to this time of the drive, such as '5 s'; default: end of the shortest run
        without a climb.
    to
        Write the figure (.png, .svg, .pdf) or the table (.csv) to this file.
    """
    from walkers.sweeps.climbing_output import describe_climbs

    references = [lookup.find(name) for name in names]
    climbs = walkers.climb(references, within=within, to=to)
    print_as(as_json, lambda: climbs, lambda: describe_climbs(climbs))
