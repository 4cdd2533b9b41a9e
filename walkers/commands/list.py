"""``walkers list``: what is in a folder of runs."""

from __future__ import annotations

import json
from typing import Annotated, Literal

import typer

from walkers.commands.arguments import CaseName, Json, OlderThan, Out
from walkers.pipeline import DEFAULT_OUT

Status = Annotated[
    Literal["finished", "running", "interrupted", "failed"] | None,
    typer.Option("--status", help="Only runs and sweeps of this status."),
]
Where = Annotated[
    list[str] | None,
    typer.Option("--where", metavar="KEY=VALUE", help='Only runs with this, such as "drive.frequency=80 Hz".'),
]
Sort = Annotated[
    Literal["name", "status", "velocity", "age", "size"],
    typer.Option("--sort", help="The fastest, youngest or largest first."),
]
Reverse = Annotated[bool, typer.Option("--reverse", help="The other way round.")]


def command(
    out: Out = DEFAULT_OUT,
    case: CaseName = None,
    status: Status = None,
    older_than: OlderThan = None,
    where: Where = None,
    sort: Sort = "name",
    reverse: Reverse = False,
    as_json: Json = False,
) -> None:
    """List runs and sweeps: by what they differ, velocity or climbs, status, age, size."""
    from walkers.sweeps import listing
    from walkers.sweeps.inventory import inventory, select

    found = select(inventory(out), case=case, status=status, older_than=older_than, where=where or ())
    found = listing.ordered(found, sort, reverse=reverse)
    print(json.dumps(listing.as_json(found), indent=2, ensure_ascii=False) if as_json else listing.as_text(found))
