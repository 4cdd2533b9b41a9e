"""Wet granular walkers, simulated with LIGGGHTS: the one public name of the project.

`load_case` reads a case, `run_case` takes it to its result as ``walkers run`` does, `find_run` finds a finished run,
`load` gives the table of a sweep. The folders of the project are packages below: `walkers.physics` (the laws),
`walkers.inputs` (cases), `walkers.templates` (decks), `walkers.runner` (run directories), `walkers.postprocess` (what
runs mean), and on them `walkers.sweeps`, `walkers.audit`, `walkers.theory`, `walkers.paper`, `walkers.calibration`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from walkers.pipeline import Outcome, find_run, run_case

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.reading import AnyCase

__all__ = ["Outcome", "find_run", "load", "load_case", "run_case"]


def __dir__() -> list[str]:
    return __all__


def load_case(case: str | Path) -> AnyCase:
    """Read and resolve a case, of walkers or of a pile; see `walkers.inputs.reading.load_any`."""
    from walkers.inputs.reading import load_any

    return load_any(case)


def load(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep, one row per point; see `walkers.sweeps.table.load`."""
    from walkers.sweeps.table import load

    return load(directory)
