"""Decks: the input scripts of LIGGGHTS.

Uses cases (`inputs`), not processes, files on disk or results. docs/explanation/engine.md explains the decks.
"""
