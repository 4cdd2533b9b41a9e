"""``walkers climb``: climbs over several piles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Json, refuse

Directory = Annotated[
    Path, typer.Argument(metavar="DIR", help="A sweep of piles, a folder of runs, or one run (or its case).")
]
Within = Annotated[
    float | None,
    typer.Option("--within", min=0.0, help="Climbs until then, s of drive; if left out until the shortest run's end."),
]
Sensitivity = Annotated[
    bool, typer.Option("--sensitivity", help="Instead: how many climbs there are with other thresholds of what is one.")
]


def command(
    directory: Directory, within: Within = None, thresholds: Sensitivity = False, as_json: Json = False
) -> None:
    """Print how often piles climbed, how soon, how fast, and led by whom."""
    from walkers.pipeline import DEFAULT_OUT, find_run
    from walkers.sweeps.climbing import describe_climbs, describe_sensitivity, piles_in, sensitivity, summarise_climbs

    groups = piles_in(directory if directory.exists() else find_run(str(directory), DEFAULT_OUT).directory)
    if thresholds:
        refuse("--within", within is not None, "has no meaning with --sensitivity")
        tried = {label: sensitivity(runs) for label, runs in groups.items()}
        text = [line for label, rows in tried.items() for line in (label, describe_sensitivity(rows)) if line]
        print(json.dumps(tried, indent=2, ensure_ascii=False) if as_json else "\n".join(text))
        return
    found = {label: summarise_climbs(runs, within) for label, runs in groups.items()}
    if as_json:
        print(json.dumps(found, indent=2, ensure_ascii=False))
        return
    for label, climbs in found.items():
        print("\n".join([*([label] if label else []), describe_climbs(climbs)]))
        if climbs["out_of_pile"]["climbs"] < climbs["climbs"]:
            print("of clusters that came out of the pile, and did not hang on a wall since the pouring:")
            print(describe_climbs(climbs["out_of_pile"]))
