"""``walkers export``: a run's trajectory for OVITO, ASE, MDAnalysis and LAMMPS tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Out, Run
from walkers.pipeline import DEFAULT_OUT

To = Annotated[Path, typer.Option("--to", help="The .xyz (extended XYZ) or .lammpstrj (LAMMPS dump) to write.")]
Every = Annotated[int, typer.Option("--every", min=1, help="One of so many samples of the drive.")]


def command(run: Run, to: To, out: Out = DEFAULT_OUT, every: Every = 1) -> None:
    """Write the beads' trajectory as extended XYZ or as a LAMMPS dump: mm, s, relative to the boundary."""
    from walkers.pipeline import find_run

    print(find_run(run, out).export(to, every=every))
