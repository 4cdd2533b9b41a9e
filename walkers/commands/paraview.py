"""``walkers paraview``: a run for ParaView, with a script that shows it."""

from __future__ import annotations

from typing import Annotated

import typer

from walkers.commands.arguments import AsPlaced, Every, Out, Run, VtkFolder, refuse_as_placed
from walkers.pipeline import DEFAULT_OUT

Colour = Annotated[str | None, typer.Option("--colour", help="Array to colour the beads by; walker, else speed.")]
Open = Annotated[bool, typer.Option("--open", help="Start ParaView with it.")]


def command(
    run: Run,
    out: Out = DEFAULT_OUT,
    to: VtkFolder = None,
    as_placed: AsPlaced = False,
    every: Every = None,
    colour: Colour = None,
    start: Open = False,
) -> None:
    """Write what walkers vtk writes and a script that shows it in ParaView: spheres, bridges, walls, time."""
    from walkers.pipeline import find_run
    from walkers.postprocess.paraview_script import open_paraview

    found = find_run(run, out)
    refuse_as_placed(as_placed, found.case)
    script = found.paraview(to, colour=colour, every=every, as_placed=as_placed)
    print(script)
    if start:
        open_paraview(script)
