"""Analysis of runs: tables, velocities, pictures, ParaView files. Reads run directories, never starts the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkers.exporting import exporting

if TYPE_CHECKING:
    from walkers.postprocess.analysis import current_result, read_result, tabulate
    from walkers.postprocess.motion import Group, Motion, read_motion
    from walkers.postprocess.tables import read_table

__all__ = ["Group", "Motion", "current_result", "read_motion", "read_result", "read_table", "tabulate"]

__getattr__ = exporting(
    __name__,
    analysis=["current_result", "read_result", "tabulate"],
    motion=["Group", "Motion", "read_motion"],
    tables=["read_table"],
)
