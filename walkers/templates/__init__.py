"""Decks: the input scripts of LIGGGHTS.

Knows the cases (`inputs`); knows nothing of processes, files on disk or results. docs/explanation/engine.md explains
the form of the decks.
"""
