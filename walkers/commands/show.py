"""``walkers show``: a case resolved, and what follows from it."""

from __future__ import annotations

import json

from walkers.commands.arguments import Case, Json


def command(case: Case, as_json: Json = False) -> None:
    """Show a case in SI units with its forces, its time step and its cost."""
    from walkers.inputs.reading import load_case

    loaded = load_case(case)
    from walkers.runner.summary import describe, summarise

    summary = summarise(loaded)
    print(json.dumps(summary, indent=2, ensure_ascii=False) if as_json else describe(summary))
