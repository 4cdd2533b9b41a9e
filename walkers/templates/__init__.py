"""Decks: the input scripts of LIGGGHTS.

Uses cases (`inputs`), not processes, files on disk or results. docs/explanation/engine.md explains the decks.
"""

from walkers.templates.deck import Deck, render_deck
from walkers.templates.layout import Layout, PlacedWalker

__all__ = ["Deck", "Layout", "PlacedWalker", "render_deck"]
