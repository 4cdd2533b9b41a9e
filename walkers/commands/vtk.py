"""``walkers vtk``: a run for ParaView."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run, refuse
from walkers.pipeline import DEFAULT_OUT

Folder = Annotated[
    Path | None, typer.Option("--to", help="Folder to write, replaced if it holds nothing else; RUN/vtk if left out.")
]
AsPlaced = Annotated[bool, typer.Option("--as-placed", help="Walkers where the deck has them, not side by side.")]
Every = Annotated[
    int | None, typer.Option("--every", min=1, help="One of so many samples of the drive; one a cycle if left out.")
]
Vtu = Annotated[bool, typer.Option("--vtu", help="Also write the beads as .vtu.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Folder = None,
    as_placed: AsPlaced = False,
    vtu: Vtu = False,
    every: Every = None,
) -> None:
    """Write beads, bridges and boundary as .vtp with a .pvd in seconds."""
    from walkers.pipeline import find_run

    found = find_run(run, out)
    refuse(
        "--as-placed",
        as_placed and not found.case.independent,
        "is for independent walkers: these stand where they are",
    )
    print(found.vtk(to, every=every, vtu=vtu, as_placed=as_placed))
