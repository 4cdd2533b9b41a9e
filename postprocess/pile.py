"""The motion of a pile and its bridges, frame by frame, over all segments of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.pile import PileCase
from walkers.postprocess.dump import BinaryDump, DumpError, FloatArray
from walkers.postprocess.local_dump import local_frames
from walkers.runner.directory import CASE_NAME
from walkers.runner.files import read_json
from walkers.runner.segments import SEGMENT_NAME, segment_directories
from walkers.templates.deck import LAYOUT_NAME
from walkers.templates.layout import Layout

IntArray = npt.NDArray[np.int64]
FLOOR = 0
"""Number of the floor among the walls; the others are the side walls."""
_WALLS = {"box": ("floor", "-x", "+x", "-y", "+y"), "cylinder": ("floor", "side")}
"""Names of the walls of a container, in the order of their numbers (`walkers.templates.pile.faces_of`)."""


@dataclass(frozen=True)
class PileMotion:
    """Positions and velocities relative to the container; F frames of N beads, SI units.

    Attributes
    ----------
    case
        Of the run.
    time : ndarray, shape (F,)
        s, from the begin of the drive; negative while the pile settles.
    position, velocity : ndarray, shape (F, N, 3)
    radius : ndarray, shape (N,)
    large : ndarray of bool, shape (N,)
        Whether a bead is of the large class.
    first_id
        The engine's id of the first bead.
    frames : list of (Path, int)
        Segment and number of each frame within it, for the bridges.
    """

    case: PileCase
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    radius: FloatArray
    large: npt.NDArray[np.bool_]
    first_id: int
    frames: list[tuple[Path, int]]

    @property
    def first_driven(self) -> int:
        """Number of the first frame of the drive; of the last one where it has not begun."""
        return min(int(np.searchsorted(self.time, 0.0)), len(self.time) - 1)


@dataclass(frozen=True)
class Bridges:
    """The bridges of one frame: K between beads, M to walls.

    Attributes
    ----------
    beads : ndarray of int, shape (K, 2)
        Numbers of the two beads, from 0.
    force : ndarray, shape (K,)
        Net normal force (capillary, viscous and elastic), positive where it pulls the two together, N.
    gap : ndarray, shape (K,)
        m, negative where they touch.
    wall_beads, walls : ndarray of int, shape (M,)
        Bead and wall, 0 being the floor; a cylinder's side is one wall.
    """

    beads: IntArray
    force: FloatArray
    gap: FloatArray
    wall_beads: IntArray
    walls: IntArray


def names_of_walls(walls: Iterable[int], case: PileCase) -> str:
    """Names of some walls, such as ``-x +y`` for a corner of a box."""
    return " ".join(_WALLS[case.container.shape][wall] for wall in sorted(walls))


def read_pile(directory: str | Path) -> PileMotion:
    """Read the beads of a run, finished or not.

    Parameters
    ----------
    directory
        A run directory with its segments.

    Raises
    ------
    DumpError
        If there is no segment, or one cannot be read.
    FileNotFoundError
        If it is no such directory.
    """
    directory = Path(directory)
    case = PileCase.from_dict(read_json(directory / CASE_NAME))
    segments = segment_directories(directory)
    if not segments:
        raise DumpError(f"{directory}: no segment of the run is finished yet")
    told = [_segment(segment) for segment in segments]
    start = next((one["drive_from"] for one in told if one["drive_from"] is not None), None)
    steps: list[int] = []
    rows: list[FloatArray] = []
    carriers: list[FloatArray] = []
    frames: list[tuple[Path, int]] = []
    for segment, one in zip(segments, told, strict=True):
        if one["begin"] != (steps[-1] if steps else 0):
            raise DumpError(f"{segment}: the segment before it is missing")
        layout, dump = _dump_of(segment)
        if dump.truncated or not len(dump.steps) or dump.steps[-1] != one["end"]:
            raise DumpError(f"{segment}: its dump is incomplete")
        for number, step in enumerate(dump.steps):
            if steps and step <= steps[-1]:
                continue  # the last frame of the segment before
            frame = dump.frame(number)
            if len(frame) != layout.carriers + sum(case.beads.counts):
                raise DumpError(f"{segment}: {len(frame)} rows, expected carriers and {sum(case.beads.counts)} beads")
            steps.append(int(step))
            carriers.append(frame[0])  # ids are dumped in their order, the carriers first
            rows.append(frame[layout.carriers :])
            frames.append((segment, number))
    data, walls = np.stack(rows), np.stack(carriers)
    x, vx = dump.column("x"), dump.column("vx")
    radius = data[0, :, dump.column("radius")]
    # Before the drive has begun it is as if it would with the next frame.
    begin = start if start is not None else steps[-1] + case.run.steps_per_frame
    time = (np.array(steps, dtype=np.float64) - begin) * case.run.time_step
    # In the laboratory frame the carriers move with the walls, in the container's they rest.
    shift, speed = walls[:, None, x : x + 3] - walls[0, x : x + 3], walls[:, None, vx : vx + 3]
    return PileMotion(
        case,
        time,
        data[:, :, x : x + 3] - shift,
        data[:, :, vx : vx + 3] - speed,
        radius,
        radius > case.beads.border,
        int(data[0, 0, dump.column("id")]),
        frames,
    )


def _segment(directory: Path) -> dict[str, Any]:
    try:
        said = read_json(directory / SEGMENT_NAME)
        return {name: said[name] for name in ("begin", "end", "drive_from")}
    except (OSError, ValueError, KeyError) as error:
        raise DumpError(f"{directory / SEGMENT_NAME}: cannot be read ({error})") from error


def _dump_of(segment: Path) -> tuple[Layout, BinaryDump]:
    try:
        layout = Layout.from_dict(read_json(segment / LAYOUT_NAME))
        return layout, BinaryDump(segment / layout.bead_dump, layout.bead_columns)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DumpError(f"{segment}: cannot be read ({error})") from error


def read_bridges(motion: PileMotion) -> Iterator[Bridges]:
    """The bridges of each frame of a motion, in their order.

    Raises
    ------
    DumpError
        If a dump cannot be read.
    """
    frame = -1
    for segment in dict.fromkeys(segment for segment, _ in motion.frames):
        wanted = [number for place, number in motion.frames if place == segment]
        layout = Layout.from_dict(read_json(segment / LAYOUT_NAME))
        pairs = local_frames(segment / layout.pair_bridge_dump, layout.pair_bridge_columns)
        walls = local_frames(segment / layout.wall_bridge_dump, layout.wall_bridge_columns)
        pair, wall = layout.pair_bridge_columns.index, layout.wall_bridge_columns.index
        for number, ((_, between), (_, against)) in enumerate(zip(pairs, walls, strict=False)):
            if number not in wanted:
                continue
            frame += 1
            force = between[:, pair("fx") : pair("fx") + 3]
            # Neighbours without a bridge are reported too, with no force.
            real, held = np.any(force != 0.0, axis=1), np.any(against[:, wall("fx") : wall("fx") + 3] != 0.0, axis=1)
            ids = between[real][:, [pair("id1"), pair("id2")]].astype(np.int64) - motion.first_id
            on_wall = against[held][:, [wall("id"), wall("triangle")]].astype(np.int64)
            if motion.case.container.shape == "cylinder":
                on_wall[:, 1] = np.minimum(on_wall[:, 1], 1)  # the faces of the prism are one wall
            # Every wall stands twice in the deck.
            on_wall = np.unique(on_wall, axis=0).reshape(-1, 2)
            gap = -between[real, pair("overlap")]
            # The tangential part of what the engine reports is wrong (templates.engine): along the line of centres.
            arm = motion.position[frame, ids[:, 1]] - motion.position[frame, ids[:, 0]]
            pull = np.einsum("kx,kx->k", force[real], arm) / np.linalg.norm(arm, axis=1)
            yield Bridges(ids, pull, gap, on_wall[:, 0] - motion.first_id, on_wall[:, 1])
