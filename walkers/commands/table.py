"""``walkers table``: the table of a sweep."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers import completion
from walkers.commands.arguments import refuse

Directory = Annotated[
    Path,
    typer.Argument(
        metavar="DIR",
        help="A sweep's directory, or its name in runs.",
        autocompletion=completion.sweeps,
    ),
]
Csv = Annotated[bool, typer.Option("--csv", help="Comma-separated, units in the head.")]
Parquet = Annotated[bool, typer.Option("--parquet", help="Parquet, units in the field metadata.")]
Json = Annotated[bool, typer.Option("--json", help="JSON with units and meanings.")]
Target = Annotated[Path | None, typer.Option("--to", help="Write this file (.csv, .parquet, .json) instead.")]
Thresholds = Annotated[bool, typer.Option("--thresholds", help="Where the descents ended instead.")]


def command(
    directory: Directory,
    csv: Csv = False,
    parquet: Parquet = False,
    json: Json = False,
    to: Target = None,
    thresholds: Thresholds = False,
) -> None:
    """Print the table of a sweep, one row per point: what varied, what follows, what came out, where the run is."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps.table import encoded, load, short_text, write_table_file
    from walkers.sweeps.table import thresholds as thresholds_of

    directory = find_sweep(directory) or directory
    frame = thresholds_of(directory) if thresholds else load(directory)
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
