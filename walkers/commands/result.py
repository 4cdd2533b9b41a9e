"""``walkers result``: the result of a run."""

from __future__ import annotations

import json

from walkers.commands.arguments import Json, Out, Run
from walkers.pipeline import DEFAULT_OUT


def command(run: Run, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print the result of a finished run."""
    from dataclasses import replace

    from walkers.pipeline import find_run

    found = replace(find_run(run, out), cached=False)
    print(json.dumps(found.result, indent=2) if as_json else found.describe())
