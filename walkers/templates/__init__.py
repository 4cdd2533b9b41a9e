"""Decks: what LIGGGHTS is told, and why.

Knows the cases (`inputs`); knows nothing of processes, files on disk or results. Why decks look as they do is told in
docs/explanation/engine.md.
"""

from walkers.templates.deck import Deck, render_deck
from walkers.templates.layout import Layout, PlacedWalker

__all__ = ["Deck", "Layout", "PlacedWalker", "render_deck"]
