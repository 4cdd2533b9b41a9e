"""Decks: what LIGGGHTS is told, and why.

Knows the cases (`inputs`); knows nothing of processes, files on disk or results. Everything that is peculiar to the
engine, and every workaround for what it gets wrong, is in `walkers.templates.engine`.
"""

from walkers.templates.deck import Deck, render_deck
from walkers.templates.layout import Layout, PlacedWalker

__all__ = ["Deck", "Layout", "PlacedWalker", "render_deck"]
