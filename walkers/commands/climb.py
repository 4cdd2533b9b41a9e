"""``walkers climb``: climbs over several piles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Json

Directory = Annotated[Path, typer.Argument(metavar="DIR", help="A sweep of piles, a folder of runs, or one run.")]
Within = Annotated[float | None, typer.Option("--within", min=0.0, help="Seconds of drive; all of the shortest run.")]


def command(directory: Directory, within: Within = None, as_json: Json = False) -> None:
    """Print how often piles climbed, how soon, how fast, and led by whom."""
    from sweeps.climbing import describe_climbs, piles_in, summarise_climbs

    found = {label: summarise_climbs(runs, within) for label, runs in piles_in(directory).items()}
    if as_json:
        print(json.dumps(found, indent=2, ensure_ascii=False))
        return
    for label, climbs in found.items():
        print("\n".join([*([label] if label else []), describe_climbs(climbs)]))
