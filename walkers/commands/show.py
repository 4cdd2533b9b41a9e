"""``walkers show``: a case resolved, and what follows from it."""

from __future__ import annotations

import json

from walkers.commands.arguments import Case, Json


def command(case: Case, as_json: Json = False) -> None:
    """Show a case in SI units with its forces, its time step and its cost."""
    from walkers.inputs.pile import PileCase
    from walkers.inputs.reading import load_any
    from walkers.runner.pile_summary import describe_pile_case, summarise_pile
    from walkers.runner.summary import describe, summarise

    loaded = load_any(case)
    if isinstance(loaded, PileCase):
        pile = summarise_pile(loaded)
        print(json.dumps(pile, indent=2, ensure_ascii=False) if as_json else describe_pile_case(pile))
        return
    summary = summarise(loaded)
    print(json.dumps(summary, indent=2, ensure_ascii=False) if as_json else describe(summary))
