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
EverySample = Annotated[bool, typer.Option("--every-sample", help="All samples instead of one frame a cycle.")]
AsPlaced = Annotated[bool, typer.Option("--as-placed", help="Walkers where the deck has them, not side by side.")]
Every = Annotated[int, typer.Option("--every", min=1, help="Of a pile: one of so many frames.")]
Vtu = Annotated[bool, typer.Option("--vtu", help="Also write the beads as .vtu.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: Folder = None,
    every_sample: EverySample = False,
    as_placed: AsPlaced = False,
    vtu: Vtu = False,
    every: Every = 1,
) -> None:
    """Write beads, bridges and substrate as .vtp with a .pvd in seconds."""
    from walkers.pipeline import find_run
    from walkers.postprocess.paraview import write_vtk
    from walkers.postprocess.pile_paraview import write_pile_vtk
    from walkers.runner.segments import is_pile

    directory = find_run(run, out).directory
    pile = is_pile(directory)
    for option, given in (("--every-sample", every_sample), ("--as-placed", as_placed)):
        refuse(option, given and pile, "is for walkers; of a pile --every says which frames")
    refuse("--every", every != 1 and not pile, "is for piles; of walkers --every-sample takes all samples")
    if pile:
        print(write_pile_vtk(directory, every=every, vtu=vtu, destination=to))
        return
    print(write_vtk(directory, every_sample=every_sample, vtu=vtu, as_placed=as_placed, destination=to))
