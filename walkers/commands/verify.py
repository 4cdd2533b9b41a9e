"""``walkers verify``: whether files are what they were."""

from __future__ import annotations

from typing import Annotated

import typer

from walkers.commands.arguments import Out
from walkers.pipeline import DEFAULT_OUT

What = Annotated[
    str, typer.Argument(metavar="RUN|SWEEP|ARCHIVE", help="A run's or sweep's directory, an archive, or a case.")
]


def command(what: What, out: Out = DEFAULT_OUT) -> int:
    """Compare files of a run, a sweep or an archive with their lists; status 1 if any differ or are not listed."""
    from walkers.archive.verification import verify
    from walkers.pipeline import place_of

    found = verify(place_of(what, out, archives=True))
    for one in found:
        print(one.describe())
    return 0 if all(one.passed for one in found) else 1
