"""``walkers show``: a case resolved, and what follows from it."""

from __future__ import annotations

import json

from walkers.commands.arguments import Case, Json, Set, load


def command(case: Case, settings: Set = None, as_json: Json = False) -> None:
    """Show each value of a case and where it comes from, its forces, its time step and its cost."""
    loaded = load(case, settings)
    from walkers.runner.summary import describe, summarise

    summary = summarise(loaded)
    print(json.dumps(summary, indent=2, ensure_ascii=False) if as_json else describe(summary))
