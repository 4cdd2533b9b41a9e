"""``walkers result``: the result of a run."""

from __future__ import annotations

import json

from walkers.commands.arguments import Json, Out, Run
from walkers.pipeline import DEFAULT_OUT


def command(run: Run, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print the result of a finished run."""
    from walkers.pipeline import described, find_run
    from walkers.postprocess.result import read_result

    directory = find_run(run, out).directory
    result = read_result(directory)
    print(json.dumps(result, indent=2) if as_json else described(directory, result))
