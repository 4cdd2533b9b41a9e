"""``walkers deck``: the LIGGGHTS deck of a case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Case, Set, load

Folder = Annotated[
    Path | None, typer.Option("--to", help="Write the deck and its files into this new folder, to run by hand.")
]


def command(case: Case, settings: Set = None, to: Folder = None) -> None:
    """Print the LIGGGHTS deck of a case (of a run in segments, the first), or write it with its files."""
    from walkers.inputs.errors import InputError, Problem
    from walkers.templates.deck import DECK_NAME, RUN_NAME, render_deck

    deck = render_deck(load(case, settings))
    if to is None:
        print(deck.text, end="")
        return
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import write_deck
    from walkers.runner.plugin import plugin_of, run_script

    plugin = plugin_of(find_engine())

    try:
        to.mkdir(parents=True)
    except OSError as error:
        raise InputError(
            str(to), [Problem("", None, f"expected a folder that can be made ({error.strerror})")]
        ) from error
    write_deck(deck, to)
    (to / RUN_NAME).write_text(run_script(plugin, deck.layout.ranks), encoding="utf-8")
    print(f"{to / DECK_NAME}    run it there with: sh {RUN_NAME}")
