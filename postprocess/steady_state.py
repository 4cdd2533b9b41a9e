"""Which walkers of a run are walkers until its end: speeds of others say how long the run was, not how they walk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.analysis import read_result
from walkers.postprocess.tables import read_table
from walkers.postprocess.walking import SEPARATED

if TYPE_CHECKING:
    import pandas as pd

ASTRAY = np.pi / 4.0
"""rad; a walker that ends farther from where it was to face has left the axis."""


def on_axis(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether walkers of a table `walkers` end near the direction that they started to face."""
    return walkers["orientation_end"].abs() < ASTRAY


def together(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the beads of walkers of a table ``walkers`` stay where a bridge can hold them."""
    return walkers["separated_fraction"] < SEPARATED


def steady_walkers(run: str | Path) -> pd.DataFrame:
    """Rows of a run's table ``walkers`` that are steady, have not left the axis and whose beads stay together.

    Symmetric dimers turn across the axis and need only stay together: they have no way to walk.

    Parameters
    ----------
    run
        A finished run directory.
    """
    walkers = read_table(run, "walkers")
    kept = together(walkers)
    if read_result(run)["sin_delta"] != 0.0:
        kept &= walkers["steady"] & on_axis(walkers)
    chosen: pd.DataFrame = walkers[kept]
    return chosen
