"""Runs: decks in run directories, launched, watched, and finished or failed.

Knows cases and decks (`inputs`, `templates`); knows nothing of what the dumps mean.
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
