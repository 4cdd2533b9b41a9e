"""``walkers archive``: a run or a sweep as one file, to be kept and cited."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, refuse
from walkers.pipeline import DEFAULT_OUT

What = Annotated[str, typer.Argument(metavar="RUN|SWEEP", help="A run's or sweep's directory, or a case.")]
Target = Annotated[Path | None, typer.Option("--to", help="The .zip to write; NAME.zip here if left out.")]
WithoutDumps = Annotated[
    bool,
    typer.Option("--without-dumps", help="Leave out what the engine wrote of the motion: tables and results stay."),
]
Authors = Annotated[list[str] | None, typer.Option("--author", help="Name of who made the runs; may be repeated.")]
Orcids = Annotated[list[str] | None, typer.Option("--orcid", help="ORCID of the author, in the order of --author.")]
Licence = Annotated[str, typer.Option("--licence", help="CC-BY-4.0, CC0-1.0, CC-BY-SA-4.0 or BSD-3-Clause.")]


def command(
    what: What,
    out: Out = DEFAULT_OUT,
    to: Target = None,
    without_dumps: WithoutDumps = False,
    author: Authors = None,
    orcid: Orcids = None,
    licence: Licence = "CC-BY-4.0",
) -> None:
    """Pack a run, or a sweep with its runs, into an RO-Crate: cases, decks, dumps, tables, checksums, versions."""
    from walkers.archive.citation import Author
    from walkers.archive.writing import ArchiveOptions, write_archive
    from walkers.pipeline import place_of

    names, orcids = author or [], orcid or []
    refuse("--orcid", len(orcids) > len(names), "expected an --author for each")
    authors = [Author(name, number) for name, number in zip_longest(names, orcids)]
    print(write_archive(place_of(what, out), to, ArchiveOptions(not without_dumps, authors, licence)))
