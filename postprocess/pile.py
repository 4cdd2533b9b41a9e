"""The motion of a pile and its bridges, frame by frame, over all parts of a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from inputs.pile import PileCase
from postprocess.dump import BinaryDump, DumpError, FloatArray
from runner.directory import CASE_NAME
from runner.files import read_json
from runner.parts import PART_NAME, part_directories
from templates.deck import LAYOUT_NAME
from templates.layout import Layout

IntArray = npt.NDArray[np.int64]
_HEAD_LINES = 9
FLOOR = 0
"""Number of the floor among the walls; the others are the side walls."""


@dataclass(frozen=True)
class PileMotion:
    """Positions and velocities relative to the container; F frames of N beads, SI units.

    Attributes
    ----------
    case
        Of the run.
    time : ndarray, shape (F,)
        From the begin of the drive; negative while the pile settles.
    position, velocity : ndarray, shape (F, N, 3)
    radius : ndarray, shape (N,)
    large : ndarray of bool, shape (N,)
        Whether a bead is of the large class.
    first_id
        The engine's id of the first bead.
    frames : list of (Path, int)
        Part and number of each frame within it, for the bridges.
    """

    case: PileCase
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    radius: FloatArray
    large: npt.NDArray[np.bool_]
    first_id: int
    frames: list[tuple[Path, int]]


@dataclass(frozen=True)
class Bridges:
    """The bridges of one frame: K between beads, M to walls.

    Attributes
    ----------
    beads : ndarray of int, shape (K, 2)
        Numbers of the two beads, from 0.
    force : ndarray, shape (K,)
        Magnitude of the net force (capillary, viscous and elastic), N.
    gap : ndarray, shape (K,)
        m, negative where they touch.
    wall_beads, walls : ndarray of int, shape (M,)
        Bead and wall, 0 being the floor.
    """

    beads: IntArray
    force: FloatArray
    gap: FloatArray
    wall_beads: IntArray
    walls: IntArray


def read_pile(directory: str | Path) -> PileMotion:
    """Read the beads of a run, finished or not.

    Parameters
    ----------
    directory
        A run directory with its parts.

    Raises
    ------
    DumpError
        If there is no part, or one cannot be read.
    FileNotFoundError
        If it is no such directory.
    """
    directory = Path(directory)
    case = PileCase.from_dict(read_json(directory / CASE_NAME))
    parts = part_directories(directory)
    if not parts:
        raise DumpError(f"{directory}: no part of the run is finished yet")
    start = next((int(said["drive_from"]) for said in map(_part, parts) if said["drive_from"] is not None), None)
    steps: list[int] = []
    rows: list[FloatArray] = []
    frames: list[tuple[Path, int]] = []
    for part in parts:
        layout = Layout.from_dict(read_json(part / LAYOUT_NAME))
        dump = BinaryDump(part / layout.bead_dump, layout.bead_columns)
        for number, step in enumerate(dump.steps):
            if steps and step <= steps[-1]:
                continue  # the last frame of the part before
            steps.append(int(step))
            rows.append(dump.frame(number)[layout.riders :])
            frames.append((part, number))
    # Ids are dumped in their order, the riders first.
    data = np.stack(rows)
    column, layout_columns = dump.column, dump.columns
    x, vx = layout_columns.index("x"), layout_columns.index("vx")
    radius = data[0, :, column("radius")]
    time = (np.array(steps, dtype=np.float64) - (start if start is not None else steps[-1])) * case.run.time_step
    return PileMotion(
        case,
        time,
        data[:, :, x : x + 3],
        data[:, :, vx : vx + 3],
        radius,
        radius > case.beads.border,
        int(data[0, 0, column("id")]),
        frames,
    )


def _part(directory: Path) -> dict[str, Any]:
    return read_json(directory / PART_NAME)


def read_bridges(motion: PileMotion) -> Iterator[Bridges]:
    """The bridges of each frame of a motion, in their order."""
    for part in dict.fromkeys(part for part, _ in motion.frames):
        wanted = [number for place, number in motion.frames if place == part]
        layout = Layout.from_dict(read_json(part / LAYOUT_NAME))
        pairs = _local_frames(part / layout.pair_bridge_dump, len(layout.pair_bridge_columns))
        walls = _local_frames(part / layout.wall_bridge_dump, len(layout.wall_bridge_columns))
        pair, wall = layout.pair_bridge_columns.index, layout.wall_bridge_columns.index
        for number, (between, against) in enumerate(zip(pairs, walls, strict=True)):
            if number not in wanted:
                continue
            force = np.linalg.norm(between[:, pair("fx") : pair("fx") + 3], axis=1)
            # Neighbours without a bridge are reported too, with no force.
            real, held = force > 0.0, np.any(against[:, wall("fx") : wall("fx") + 3] != 0.0, axis=1)
            ids = between[real][:, [pair("id1"), pair("id2")]].astype(np.int64) - motion.first_id
            on_wall = against[held][:, [wall("id"), wall("triangle")]].astype(np.int64)
            # Every wall stands twice in the deck.
            on_wall = np.unique(on_wall, axis=0).reshape(-1, 2)
            gap = -between[real, pair("overlap")]
            yield Bridges(ids, force[real], gap, on_wall[:, 0] - motion.first_id, on_wall[:, 1])


def _local_frames(path: Path, columns: int) -> Iterator[FloatArray]:
    """Rows of each frame of a local dump, shape (rows, columns)."""
    with path.open("rb") as file:
        while line := file.readline():
            if not line.startswith(b"ITEM: TIMESTEP"):
                raise DumpError(f"{path}: not a local dump")
            head = [file.readline() for _ in range(_HEAD_LINES - 1)]
            count = int(head[2])
            body = b"".join(file.readline() for _ in range(count))
            values = np.fromstring(body, dtype=np.float64, sep=" ")
            if len(values) != count * columns:
                raise DumpError(f"{path}: a frame of {count} rows is incomplete")
            yield values.reshape(count, columns)
