"""``walkers vtk``: a run for ParaView."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

Folder = Annotated[
    Path | None, typer.Option("--to", help="Folder to write, replaced if it holds nothing else; RUN/vtk if left out.")
]
EverySample = Annotated[bool, typer.Option("--every-sample", help="All samples instead of one frame a cycle.")]
AsPlaced = Annotated[bool, typer.Option("--as-placed", help="Walkers where the deck has them, not side by side.")]
Vtu = Annotated[bool, typer.Option("--vtu", help="Also write the beads as .vtu.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Folder = None,
    every_sample: EverySample = False,
    as_placed: AsPlaced = False,
    vtu: Vtu = False,
) -> None:
    """Write beads, bridges and substrate as .vtp with a .pvd in seconds."""
    from postprocess.paraview import write_vtk
    from walkers.pipeline import find_run

    directory = find_run(run, out).directory
    print(write_vtk(directory, every_sample=every_sample, vtu=vtu, as_placed=as_placed, destination=to))
