"""``walkers vtk``: a run for ParaView."""

from __future__ import annotations

from typing import Annotated

import typer

from walkers.commands.arguments import AsPlaced, Every, Out, Run, VtkFolder, refuse_as_placed
from walkers.pipeline import DEFAULT_OUT

Vtu = Annotated[bool, typer.Option("--vtu", help="Also write the beads as .vtu.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: VtkFolder = None,
    as_placed: AsPlaced = False,
    vtu: Vtu = False,
    every: Every = None,
) -> None:
    """Write beads, bridges and boundary as .vtp with a .pvd in seconds."""
    from walkers.pipeline import find_run

    found = find_run(run, out)
    refuse_as_placed(as_placed, found.case)
    print(found.vtk(to, every=every, vtu=vtu, as_placed=as_placed))
