"""The capillary bridges that the engine reports: which bead holds on to what, across which gap, with what force.

Only the normal part of the reported forces is kept: the engine's tangential part is wrong for sliding contacts (see
`walkers.templates.engine`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.case import WalkerCase
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.local_dump import read_local_dump
from walkers.templates.layout import Layout

Columns = dict[str, npt.NDArray[Any]]


def bridge_columns(directory: Path, case: WalkerCase, layout: Layout) -> Columns:
    """Columns of the table ``bridges``, sorted by time, walker and contact.

    A wall that stands twice in the deck gives two rows, which are one bridge: their forces are added. Rows without
    force are pairs within reach that have no bridge; they are left out.

    Parameters
    ----------
    directory
        A run directory with the dumps of bridges.
    case, layout
        Of the run.

    Raises
    ------
    postprocess.dump.DumpError
        If a dump cannot be read.
    """
    frames = layout.bridge_frames
    pair_steps, pairs = read_local_dump(directory / layout.pair_bridge_dump, layout.pair_bridge_columns, frames)
    wall_steps, walls = read_local_dump(directory / layout.wall_bridge_dump, layout.wall_bridge_columns, frames)
    radius = {
        bead: size for walker in layout.walkers for bead, size in zip(walker.beads, case.beads.radii, strict=True)
    }
    parts = [_pairs(pair_steps, pairs, layout), _walls(wall_steps, walls, layout, radius)]
    merged = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    bead_of_walker = {bead: walker for walker in layout.walkers for bead in walker.beads}
    owners = [bead_of_walker[int(bead)] for bead in merged["bead_1"]]
    merged["walker"] = np.array([owner.walker for owner in owners], dtype=np.int64)
    on_wall = np.array(
        [owner.beads.index(int(bead)) + 1 for owner, bead in zip(owners, merged["bead_1"], strict=True)], dtype=np.int64
    )
    merged["contact"] = np.where(merged["bead_2"] == 0, on_wall, 3)
    merged["time"] = merged.pop("step") * layout.time_step
    merged["touching"] = merged["gap"] <= 0.0
    order = np.lexsort((merged["contact"], merged["walker"], merged["time"]))
    return {key: values[order] for key, values in merged.items()}


def _pairs(steps: npt.NDArray[np.int64], rows: FloatArray, layout: Layout) -> Columns:
    rows, force, steps = _held(rows, layout.pair_bridge_columns, steps)
    column = layout.pair_bridge_columns.index
    _, pull = _along(force, rows, column("x1"), column("x2"))
    return {
        "step": steps,
        "bead_1": rows[:, column("id1")].astype(np.int64),
        "bead_2": rows[:, column("id2")].astype(np.int64),
        "gap": -rows[:, column("overlap")],
        "normal_force": pull,
    }


def _walls(steps: npt.NDArray[np.int64], rows: FloatArray, layout: Layout, radius: dict[int, float]) -> Columns:
    rows, force, steps = _held(rows, layout.wall_bridge_columns, steps)
    column = layout.wall_bridge_columns.index
    distance, pull = _along(force, rows, column("bead_x"), column("x"))
    keys = np.stack([steps, rows[:, column("id")].astype(np.int64)], axis=1)
    unique, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    radii = np.array([radius[int(bead)] for bead in unique[:, 1]])
    return {
        "step": unique[:, 0],
        "bead_1": unique[:, 1],
        "bead_2": np.zeros(len(unique), dtype=np.int64),
        "gap": distance[first] - radii,
        "normal_force": np.bincount(which.reshape(-1), weights=pull, minlength=len(unique)),
    }


def _along(force: FloatArray, rows: FloatArray, start: int, end: int) -> tuple[FloatArray, FloatArray]:
    """Distance between the points whose coordinates begin at two columns, and the force along the way, both (rows,)."""
    way = rows[:, end : end + 3] - rows[:, start : start + 3]
    distance = np.linalg.norm(way, axis=1)
    return distance, np.einsum("nx,nx->n", force, way) / distance


def _held(
    rows: FloatArray, columns: tuple[str, ...], steps: npt.NDArray[np.int64]
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64]]:
    """Rows that carry a force, their forces and steps."""
    start = columns.index("fx")
    held = np.any(rows[:, start : start + 3] != 0.0, axis=1)
    return rows[held], rows[held, start : start + 3], steps[held]
