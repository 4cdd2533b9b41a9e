"""Commands for what is kept: folders of runs, one file to mail or to cite, whether files are what they were."""

from __future__ import annotations

import sys
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Literal

import typer

from walkers import completion
from walkers.commands.arguments import (
    CaseName,
    Json,
    OlderThan,
    Out,
    check_folder,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.pipeline import DEFAULT_OUT

Runs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[RUN|SWEEP]...",
        help="Runs and sweeps: names in --out, or directories.",
        autocompletion=completion.runs_and_sweeps,
    ),
]
Status = Annotated[
    Literal["finished", "running", "interrupted", "failed"] | None,
    typer.Option("--status", help="Only runs and sweeps of this status."),
]
Where = Annotated[
    list[str] | None,
    typer.Option("--where", metavar="KEY=VALUE", help='Only runs with this, such as "drive.frequency=80 Hz".'),
]
Sort = Annotated[
    Literal["name", "status", "velocity", "age", "size"],
    typer.Option("--sort", help="The fastest, youngest or largest first."),
]
Reverse = Annotated[bool, typer.Option("--reverse", help="The other way round.")]
Finished = Annotated[bool, typer.Option("--finished", help="Finished runs too, but those that a sweep has.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would go; remove nothing.")]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")]
Reported = Annotated[
    str,
    typer.Argument(
        metavar="RUN|SWEEP|CALIBRATION",
        help="One of them: its directory, its name in --out, or a case.",
        autocompletion=completion.runs_and_sweeps,
    ),
]
Page = Annotated[Path | None, typer.Option("--to", help="The HTML file; report.html in the directory if left out.")]
Archived = Annotated[str, typer.Argument(metavar="RUN|SWEEP", help="A run's or sweep's directory, or a case.")]
Zip = Annotated[Path | None, typer.Option("--to", help="The .zip to write; NAME.zip here if left out.")]
WithoutDumps = Annotated[
    bool,
    typer.Option("--without-dumps", help="Leave out what the engine wrote of the motion: tables and results stay."),
]
Authors = Annotated[list[str] | None, typer.Option("--author", help="Name of who made the runs; may be repeated.")]
Orcids = Annotated[list[str] | None, typer.Option("--orcid", help="ORCID of the author, in the order of --author.")]
Licence = Annotated[str, typer.Option("--licence", help="CC-BY-4.0, CC0-1.0, CC-BY-SA-4.0 or BSD-3-Clause.")]
Verified = Annotated[
    str, typer.Argument(metavar="RUN|SWEEP|ARCHIVE", help="A run's or sweep's directory, an archive, or a case.")
]


def list_(
    out: Out = DEFAULT_OUT,
    case: CaseName = None,
    status: Status = None,
    older_than: OlderThan = None,
    where: Where = None,
    sort: Sort = "name",
    reverse: Reverse = False,
    as_json: Json = False,
) -> None:
    """List runs and sweeps: by what they differ, velocity or climbs, status, age, size."""
    from walkers.sweeps import folder

    found = folder.select(folder.inventory(out), case=case, status=status, older_than=older_than, where=where or ())
    found = folder.ordered(found, sort, reverse=reverse)
    print_as(as_json, lambda: folder.as_json(found), lambda: folder.as_text(found))


def clean(
    runs: Runs = None,
    out: Out = DEFAULT_OUT,
    finished: Finished = False,
    case: CaseName = None,
    older_than: OlderThan = None,
    dry_run: DryRun = False,
    yes: Yes = False,
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


def report(what: Reported, out: Out = DEFAULT_OUT, to: Page = None) -> None:
    """Write one HTML file to mail: parameters, results, plots, and the beads to be played and turned."""
    from walkers.reports import report

    print(report(what, to, out))


def verify(what: Verified, out: Out = DEFAULT_OUT) -> int:
    """Compare files of a run, a sweep or an archive with their lists; status 1 if any differ or are not listed."""
    from walkers.archive.verification import verify
    from walkers.pipeline import locate

    found = verify(locate(what, out).path)
    print_lines(one.describe() for one in found)
    return 0 if all(one.passed for one in found) else 1


def archive(
    what: Archived,
    out: Out = DEFAULT_OUT,
    to: Zip = None,
    without_dumps: WithoutDumps = False,
    author: Authors = None,
    orcid: Orcids = None,
    licence: Licence = "CC-BY-4.0",
) -> None:
    """Pack a run, or a sweep with its runs, into an RO-Crate: cases, decks, dumps, tables, checksums, versions."""
    from walkers.archive.citation import Author
    from walkers.archive.writing import ArchiveOptions, write_archive
    from walkers.pipeline import locate

    names, orcids = author or [], orcid or []
    refuse("--orcid", len(orcids) > len(names), "expected an --author for each")
    authors = [Author(name, number) for name, number in zip_longest(names, orcids)]
    place = locate(what, out)
    refuse(what, place.kind == "archive", "an archive: unpack it and give a run or a sweep in it")
    print(write_archive(place.path, to, ArchiveOptions(not without_dumps, authors, licence)))
