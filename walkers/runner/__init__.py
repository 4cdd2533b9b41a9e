"""Run directories: write decks into them, launch and watch the engine, finish or fail the run.

Uses cases and decks (`inputs`, `templates`); does not interpret the dumps.
"""

from walkers.runner.binary import Engine, find_engine
from walkers.runner.directory import FinishedRun, finished_run, run_name
from walkers.runner.failures import EngineFailure
from walkers.runner.launch import Progress, launch

__all__ = [
    "Engine",
    "EngineFailure",
    "FinishedRun",
    "Progress",
    "find_engine",
    "finished_run",
    "launch",
    "run_name",
]
