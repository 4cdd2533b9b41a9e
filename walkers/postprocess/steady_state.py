"""Whether walkers are steady, so that a run may end, and which of a run are walkers until its end.

Speeds of others say how long the run was, not how they walk.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.analysis import read_result
from walkers.postprocess.gait import walk
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.tables import read_table
from walkers.postprocess.walking import SEPARATED

if TYPE_CHECKING:
    import pandas as pd

ASTRAY = np.pi / 4.0
"""rad; a walker that ends farther from where it was to face has left the axis."""
AGREEING = 0.002
"""Share by which the velocities of the halves of a steady walker's cycles may differ."""
_LEAST_SPEED = 2e-6
"""m/s; what velocities may differ by however slow the walkers are."""
_LITTLE, _FADING, _NO_MORE = 0.005, 0.9, 1e-4
"""A steady walker turns by less rad in a cycle, and not by so much more than before; or by so much of what it did."""


def are_steady(directory: Path) -> bool:
    """Whether the walkers of a run, made or being made, walk as they would go on to: they need no more cycles.

    After a third of the cycles, at most 20, the velocities of both halves of the others agree, and no walker turns ever
    faster. Of 362 dimers of the shipped sweeps that ran for 60 cycles, those that are steady so after 12, 24 … had
    speeds within 0.2 % of the final ones; by their velocities alone some were 4 % off (they had begun to turn, faster
    and faster).
    """
    return all(_is_steady(group) for group in read_motion(directory).groups)


def _is_steady(group: Group) -> bool:
    found, run = walk(group), group.case.run
    turned = np.abs(np.diff(group.orientation[:: run.samples_per_cycle][run.settled_strobes :], axis=0))
    before, after = turned[: len(turned) // 2].max(axis=0), turned[len(turned) // 2 :].max(axis=0)
    little = (after < _LITTLE) & (after < before + _NO_MORE)
    allowed = max(AGREEING * float(np.abs(found.velocity).max()), _LEAST_SPEED)
    agree = np.abs(found.first_half - found.second_half).max() <= allowed
    return bool(agree and np.all(little | (after < _FADING * before)))


def on_axis(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether walkers of a table ``walkers`` end near the direction that they started to face."""
    return walkers["orientation_end"].abs() < ASTRAY


def together(walkers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the beads of walkers of a table ``walkers`` stay where a bridge can hold them."""
    return walkers["separated_fraction"] < SEPARATED


def steady_walkers(run: str | Path) -> pd.DataFrame:
    """Rows of a finished run's table ``walkers`` that are steady, on the axis and whose beads stay together.

    Symmetric dimers turn across the axis and need only stay together: they have no way to walk.
    """
    walkers = read_table(run, "walkers")
    kept = together(walkers)
    if read_result(run)["sin_delta"] != 0.0:
        kept &= walkers["steady"] & on_axis(walkers)
    chosen: pd.DataFrame = walkers[kept]
    return chosen
