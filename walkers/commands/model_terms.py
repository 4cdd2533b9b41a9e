"""``walkers model-terms``: which physics the published numbers ask for beyond what the engine has."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import check_folder

To = Annotated[Path, typer.Option("--to", help="Folder of the tables.")]
Generations = Annotated[int, typer.Option("--generations", min=1, help="Of each search.")]


def command(to: To = Path("figures"), generations: Generations = 120) -> int:
    """Fit the theory to the published numbers with one term after the other; no engine is needed."""
    from walkers.paper.model_terms import try_model_terms, write_model_terms

    check_folder("--to", to)
    fits = try_model_terms(generations=generations)
    for one in fits:
        print(f"misfit {one.misfit:5.1f}, {one.met:2d} met: {one.name}")
    for file in write_model_terms(fits, to):
        print(file)
    return 0
