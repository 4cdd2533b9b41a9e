"""``walkers status``: how far a sweep is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers import completion

Directory = Annotated[
    Path,
    typer.Argument(
        metavar="DIR", help="A sweep's directory, or the folder of several.", autocompletion=completion.sweeps
    ),
]


def command(directory: Directory) -> None:
    """Say how many points of a sweep are finished, failed, running and missing, and why they failed."""
    from walkers.pipeline import find_sweep
    from walkers.sweeps.summary import describe_status, sweeps_in

    print("\n".join(describe_status(one) for one in sweeps_in(find_sweep(directory) or directory)))
