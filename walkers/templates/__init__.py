"""Decks: the input scripts of LIGGGHTS.

Uses cases (`inputs`), not processes, files on disk or results. docs/explanation/engine.md explains
the decks.
"""

if __name__ != "walkers.templates":
    raise ImportError(
        "templates is a link to the package walkers.templates: import walkers.templates"
    )
