"""Run directories: write decks into them, launch and watch the engine, finish or fail the run.

Uses cases and decks (`inputs`, `templates`); does not interpret the dumps.
"""

if __name__ != "walkers.runner":
    raise ImportError("runner is a link to the package walkers.runner: import walkers.runner")
