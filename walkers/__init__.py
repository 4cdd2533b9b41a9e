"""Wet granular walkers, simulated with LIGGGHTS: the front door to the four rooms of the project.

`run_case` takes a case from file to result as ``walkers run`` does, `load` gives the table of a sweep. The rooms are
`inputs` (cases), `templates` (decks), `runner` (run directories) and `postprocess` (what runs mean), and `sweeps` (many
cases at once) stands on them; each can be used by itself.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from walkers.pipeline import Outcome, find_run, run_case

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Outcome", "find_run", "load", "run_case"]


def load(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep, a row a point; see `sweeps.table.load`."""
    from sweeps.table import load

    return load(directory)
