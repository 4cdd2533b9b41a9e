"""The motion of a run's beads and their bridges, over all of its segments, as arrays."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.files import read_json
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import Excitation
from walkers.postprocess.measure.dump import BinaryDump, DumpError, NoNumberError, local_frames
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runner.run_directory import (
    SEGMENT_NAME,
    case_of,
    read_layout,
    run_of_segment,
    segment_directories,
)
from walkers.templates.layout import MEAN_SPIN_COLUMNS, DeckLayout, PlacedWalker

FLOOR_INDEX = 0
"""Index of the floor among the walls of a container; the others are side walls."""
LEAST_SAMPLES = 8
"""Smallest number of samples per cycle that resolves the motion within a cycle."""
NEAR = 1.5
"""Walkers whose centres of mass come closer than this multiple of their length have met."""
_OF_BEADS = ("position", "velocity", "spin", "mean_spin")
_OF_FRAMES = (*_OF_BEADS, "time", "substrate", "frames")


@dataclass(frozen=True, repr=False)
class Motion:
    """Positions and velocities relative to the boundary; F frames of N beads, SI units.

    Attributes
    ----------
        case
            The case; if the run ended at constant velocities, with the cycles that it took.
        time : ndarray, shape (F,)
            Time since the start of the drive, s; negative while the beads come to rest.
        position, velocity, spin : ndarray, shape (F, N, 3)
            Position and velocity of the centres; angular velocity, rad/s.
        substrate : ndarray, shape (F, 3)
            Displacement of the boundary in the laboratory, for both frames of the drive, m; of a record, without its
            slow part (`walkers.inputs.records.record.Record.slow_course`).
        radius : ndarray, shape (N,)
        walkers
            The walkers with the indices of their beads, from 0.
        frames : list of (Path, int)
            Segment of each frame and its number there, for the bridges.
        truncated, ended_early
            Whether the dump ends within a frame; whether the run ended early because its velocities were constant.
        mean_spin : ndarray, shape (F, N, 3), or None
            Angular velocity averaged over the steps since the previous frame (zero in the first frame), if recorded.
    bead_numbers : ndarray of int, shape (N,), or None
        Indices of the beads in the run; None: all beads of the run.
    """

    case: Case
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    substrate: FloatArray
    radius: FloatArray
    walkers: tuple[PlacedWalker, ...]
    frames: list[tuple[Path, int]]
    truncated: bool
    ended_early: bool = False
    mean_spin: FloatArray | None = None
    bead_numbers: IntArray | None = None

    def __repr__(self) -> str:
        return f"<Motion of {self.case.name}: {len(self.time)} frames of {len(self.radius)} beads>"

    @property
    def directory(self) -> Path:
        """The run directory."""
        return run_of_segment(self.frames[0][0])

    @property
    def first_driven(self) -> int:
        """Index of the first frame of the drive; of the last frame if the drive has not begun."""
        return min(int(np.searchsorted(self.time, 0.0)), len(self.time) - 1)

    @property
    def follows_cycles(self) -> bool:
        """Whether the frames resolve the motion within a cycle of the drive."""
        return self.case.run.samples_per_cycle >= LEAST_SAMPLES

    @property
    def driven(self) -> Motion:
        """The motion during the drive."""
        return self.select(slice(self.first_driven, None)) if self.first_driven else self

    def select(
        self, frames: slice = slice(None), beads: IntArray | None = None, **changes: Any
    ) -> Motion:
        """The motion of selected frames and beads, with changes; beads are renumbered, walkers are not."""
        parts = {
            name: part[frames] for name in _OF_FRAMES if (part := getattr(self, name)) is not None
        } | changes
        if beads is None:
            return replace(self, **parts)
        parts |= {name: part[:, beads] for name, part in parts.items() if name in _OF_BEADS}
        place = {bead: number for number, bead in enumerate(beads.tolist())}
        walkers = tuple(
            replace(walker, beads=tuple(place[bead] for bead in walker.beads))
            for walker in self.walkers
            if place.keys() >= set(walker.beads)
        )
        numbers = beads if self.bead_numbers is None else self.bead_numbers[beads]
        return replace(
            self, **parts, radius=self.radius[beads], bead_numbers=numbers, walkers=walkers
        )

    def of_walkers(self, walkers: Collection[PlacedWalker]) -> Motion:
        """The motion of the beads of some walkers."""
        return self.select(beads=np.array([bead for walker in walkers for bead in walker.beads]))

    @property
    def averaged(self) -> Motion:
        """Means over the F - 1 intervals between frames: positions, velocities and spins.

        Velocities are displacements over time, the average over all steps. Spins are those that the engine averaged, if
        any, otherwise the mean of both ends.
        """
        spin = (
            (self.spin[1:] + self.spin[:-1]) / 2.0 if self.mean_spin is None else self.mean_spin[1:]
        )
        position = (self.position[1:] + self.position[:-1]) / 2.0
        velocity = np.diff(self.position, axis=0) / np.diff(self.time)[:, None, None]
        return self.select(slice(1, None), position=position, velocity=velocity, spin=spin)

    @property
    def large(self) -> BoolArray:
        """Whether a bead is of the large class, shape (N,)."""
        return self.radius > self.case.border

    @cached_property
    def walker_of(self) -> IntArray:
        """Index of the walker of each bead, −1 for none, shape (N,)."""
        owner = np.full(len(self.radius), -1, dtype=np.int64)
        for walker in self.walkers:
            owner[list(walker.beads)] = walker.walker
        return owner

    @cached_property
    def bridges(self) -> list[Bridges]:
        """The bridges of all frames of `read_bridges`; those of piles are read one frame after the other."""
        return list(read_bridges(self))

    @cached_property
    def groups(self) -> list[Group]:
        """The walkers by kind, during the drive."""
        return [self.driven.group(number) for number in range(len(self.case.walkers))]

    def group(self, number: int) -> Group:
        """The walkers of a kind, in all frames."""
        walkers = [walker for walker in self.walkers if walker.kind == number]
        rows = np.array([walker.beads for walker in walkers], dtype=np.int64)
        moved = (array[:, rows] for array in (self.position, self.velocity, self.spin))
        return Group(self, self.case, self.case.walkers[number], walkers, rows, self.time, *moved)


@dataclass(frozen=True, repr=False)
class Group:
    """The W walkers of one kind, of n beads each, in F frames of a motion of all beads; SI units.

    ``rows`` are the indices of their beads in the motion, shape (W, n); positions, velocities and spins have the shape
    (F, W, n, 3).
    """

    motion: Motion
    case: Case
    kind: Walkers
    walkers: list[PlacedWalker]
    rows: IntArray
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray

    @property
    def radii(self) -> FloatArray:
        """Radii of the beads of each walker, m, shape (n,)."""
        return np.array(self.kind.radii)

    @cached_property
    def mass_centre(self) -> FloatArray:
        """Centres of mass, m, shape (F, W, 3)."""
        weights = self.radii**3
        centre: FloatArray = np.einsum("fwbx,b->fwx", self.position, weights / weights.sum())
        return centre

    @property
    def drive_axis(self) -> FloatArray:
        """Reference direction of orientations in the plane of the floor: that of the drive, or x."""
        return np.array(self.case.drive_axis)

    @property
    def across_axis(self) -> FloatArray:
        """Direction in the plane of the floor, a quarter turn to the left of `drive_axis`."""
        return np.cross([0.0, 0.0, 1.0], self.drive_axis)

    @cached_property
    def heading(self) -> FloatArray:
        """Headings: unit vectors in the plane of the floor, shape (F, W, 3).

        They point from the centroid of the small beads to that of the large beads; with beads of one size, from the
        hindmost to the foremost beads (`walkers.inputs.tables.bodies.Walkers.toward_large`).
        """
        arm = np.einsum("fwbx,b->fwx", self.position, np.array(self.kind.toward_large))
        arm[..., 2] = 0.0
        heading: FloatArray = arm / np.linalg.norm(arm, axis=-1, keepdims=True)
        return heading

    @cached_property
    def gap(self) -> FloatArray:
        """Gaps of beads to their nearest walls, then of pairs, m, negative for overlap, shape (F, W, n + pairs)."""
        position, boundary = self.position, self.case.boundary
        heights = (
            [position[..., 2]]
            if boundary.bare
            else [wall.distances(position) for wall in boundary.walls]
        )
        gaps = [reduce(np.minimum, heights) - self.radii]
        for first, second in self.kind.pairs:
            distance = np.linalg.norm(position[:, :, first] - position[:, :, second], axis=-1)
            gaps.append((distance - (self.radii[first] + self.radii[second]))[..., None])
        return np.concatenate(gaps, axis=-1)

    @cached_property
    def orientation(self) -> FloatArray:
        """ψ, rad, shape (F, W): by how much walkers are turned from the direction that they face, unwrapped.

        An arrangement that faces this direction has ψ = 0, also if its beads in front are beside its middle.
        """
        ahead, aside = np.array(self.kind.front) @ np.array(self.kind.design)
        arm = np.einsum("fwbx,b->fwx", self.position, np.array(self.kind.front))
        facing = np.array([walker.facing for walker in self.walkers])
        turned = np.arctan2(facing * (arm @ self.across_axis), facing * (arm @ self.drive_axis))
        angle: FloatArray = np.unwrap(turned - np.arctan2(aside, ahead), axis=0)
        return angle

    @cached_property
    def turned_at(self) -> FloatArray:
        """End of the first cycle with a heading more than 90° from that at the start, s; NaN if none; shape (W,)."""
        strobe = self.case.run.samples_per_cycle
        over = np.abs(self.orientation[::strobe] - self.orientation[0]) > np.pi / 2.0
        return np.where(over.any(axis=0), self.time[::strobe][over.argmax(axis=0)], np.nan)


def interpolated_positions(moved: Motion | Group, share: float) -> FloatArray:
    """Positions at a fraction of each of the F - 1 intervals between frames, by cubic Hermite interpolation."""
    interval = np.diff(moved.time).reshape(-1, *[1] * (moved.position.ndim - 1))
    begin, end, left = moved.position[:-1], moved.position[1:], 1.0 - share
    position = left**2 * (1.0 + 2.0 * share) * begin + share**2 * (3.0 - 2.0 * share) * end
    position += share * left * interval * (left * moved.velocity[:-1] - share * moved.velocity[1:])
    return position


def came_near(centre: FloatArray, near: float) -> bool:
    """Whether two of W points, shape (F, W, 2), ever came within a distance of each other."""
    return any(
        np.linalg.norm(centre[:, number:] - centre[:, number - 1, None], axis=-1).min() < near
        for number in range(1, centre.shape[1])
    )


def read_motion(directory: str | Path) -> Motion:
    """Read the beads of a run directory with its segments, finished or not.

    `DumpError` if there is no segment, or a segment cannot be read; `FileNotFoundError` if the
    directory is not a run directory.

    Examples
    --------
    >>> motion = read_motion(walkers.run("fig1b", tmp).directory)
    >>> motion.position.shape  # 24 cycles of 20 samples, six walkers of two beads
    (241, 12, 3)
    >>> motion.groups[0].heading.shape
    (241, 6, 3)
    """
    directory = Path(directory)
    case, paths = case_of(directory), segment_directories(directory)
    if not paths:
        raise DumpError(f"{directory}: no segment of the run is finished yet")
    try:
        return _joined(case, paths)
    except NoNumberError as error:
        finished = (directory / MANIFEST_NAME).is_file()  # then its dumps contained no such numbers
        message = (
            "the dump was damaged after the run was finished"
            if finished
            else "the simulation blew up"
        )
        raise DumpError(f"{error}: {message}") from error


def _opened(path: Path) -> tuple[dict[str, Any], DeckLayout, BinaryDump]:
    """Record, layout and bead dump of a segment."""
    place = path / SEGMENT_NAME
    try:
        record = read_json(place)
        record = {name: record[name] for name in ("begin", "end", "drive_from")}
        place = path
        layout = read_layout(path)
        if not (path / layout.bead_dump).exists():
            why = "was left out, as the dumps of calibrations, spreads and some archives; to make the run again"
            raise DumpError(
                f"{path / layout.bead_dump} {why}: walkers run {run_of_segment(path)} --force"
            )
        return record, layout, BinaryDump(path / layout.bead_dump, layout.bead_columns)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DumpError(f"{place}: cannot be read ({error})") from error


@dataclass(frozen=True)
class _Part:
    """A segment of a run: its record, layout and dump, and the number of the first frame that is new in it."""

    path: Path
    record: dict[str, Any]
    layout: DeckLayout
    dump: BinaryDump
    first: int

    @property
    def frames(self) -> range:
        """Numbers of the frames that the segment before does not have."""
        return range(self.first, len(self.dump))


def _parts_of(case: Case, paths: Sequence[Path]) -> list[_Part]:
    """The segments of a run; `DumpError` if they do not continue each other, or a dump has the wrong size."""
    parts: list[_Part] = []
    steps: list[int] = []
    for path in paths:
        record, layout, dump = _opened(path)
        if record["begin"] != (steps[-1] if steps else 0):
            raise DumpError(f"{path}: the segment before it is missing")
        is_whole = len(dump) and not dump.truncated and dump.steps[-1] == record["end"]
        if not is_whole and (len(paths) > 1 or case.run.rests):
            raise DumpError(f"{path}: its dump is incomplete")
        if len(dump) < 2:
            raise DumpError(f"{dump.path}: {len(dump)} complete frames, too few for a motion")
        if dump.rows != layout.atoms:
            raise DumpError(f"{path}: {dump.rows} rows, expected {layout.atoms}")
        first = 1 if steps else 0  # the first frame repeats the last one of the previous segment
        parts.append(_Part(path, record, layout, dump, first))
        steps += dump.steps[first:].tolist()
    return parts


def _vectors(parts: Sequence[_Part]) -> dict[str, FloatArray]:
    """Vectors of the beads in all frames, by the names of their first columns; shape (F, N, 3).

    Each array is filled once: a stack of whole frames, and copies of parts of it, would need twice the memory.
    """
    names = ["x", "vx", "omegax"]
    if MEAN_SPIN_COLUMNS[0] in parts[-1].layout.bead_columns:
        names.append(MEAN_SPIN_COLUMNS[0])
    frames = sum(len(part.frames) for part in parts)
    vectors = {name: np.empty((frames, parts[-1].layout.atoms, 3)) for name in names}
    place = 0
    for part in parts:
        columns = {name: part.layout.bead_columns.index(name) for name in names}
        for number in part.frames:
            values = part.dump.frame(number)
            for name, column in columns.items():
                vectors[name][place] = values[:, column : column + 3]
            place += 1
    return vectors


def _joined(case: Case, paths: Sequence[Path]) -> Motion:
    """The motion over all segments of a run."""
    parts, run = _parts_of(case, paths), case.run
    last = parts[-1]
    steps = np.concatenate([part.dump.steps[part.first :] for part in parts])
    starts = [part.record["drive_from"] for part in parts]
    start = next((step for step in starts if step is not None), None)
    # Without a drive yet, it begins in the frame after the last one.
    begin = steps[-1] + run.steps_per_sample if start is None else start
    time = (steps - begin) * run.time_step
    vectors = _vectors(parts)
    shift, speed = prescribed_motion(case.excitation, time)
    if start:  # in the last frame at rest the walls do not move yet
        speed[time == 0.0] = 0.0
    vectors["x"] -= shift[:, None]
    vectors["vx"] -= speed[:, None]
    cycles = last.record["end"] // run.steps_per_cycle if run.until_steady else run.cycles
    return Motion(
        case=case.for_cycles(cycles) if run.until_steady else case,
        time=time,
        position=vectors["x"],
        velocity=vectors["vx"],
        spin=vectors["omegax"],
        substrate=visible_displacement(case.excitation, time),
        radius=parts[0].dump.frame(0)[:, parts[0].layout.bead_columns.index("radius")].copy(),
        walkers=tuple(
            replace(walker, beads=tuple(bead - 1 for bead in walker.beads))
            for walker in last.layout.walkers
        ),
        frames=[(part.path, number) for part in parts for number in part.frames],
        truncated=last.dump.truncated,
        ended_early=cycles < run.cycles,
        mean_spin=vectors.get(MEAN_SPIN_COLUMNS[0]),
    )


def prescribed_motion(drive: Excitation, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of the walls in the frame of the drive, m and m/s, shape (F, 3)."""
    displacement, velocity = boundary_motion(drive, time)
    return (
        (displacement, velocity) if drive.frame == "lab" else (0.0 * displacement, 0.0 * velocity)
    )


def boundary_motion(drive: Excitation, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of the boundary in the laboratory, m and m/s, shape (F, 3); zero before 0 s."""
    displacement, velocity = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    driven = time >= 0.0
    for direction, (place, speed, _) in drive.motions(time):
        displacement += np.outer(place * driven, direction)
        velocity += np.outer(speed * driven, direction)
    return displacement, velocity


def visible_displacement(drive: Excitation, time: FloatArray) -> FloatArray:
    """Displacement of the boundary in pictures, m, shape (F, 3): without the slow part of a record, zero before 0 s."""
    return drive.shaking(time) * (time >= 0.0)[:, None]


@dataclass(frozen=True)
class Bridges:
    """The bridges of one frame of a motion (index ``frame``): K between beads, then M to walls.

    ``contacts``, shape (K + M, 3), are both beads, from 0, in ascending order, and -1; of a bridge to a wall the bead,
    -1 and the wall (0: floor). ``force`` is the net normal force (capillary, viscous and elastic, N, positive for
    attraction), ``gap`` (m) is negative for overlap. The engine reports wrong tangential forces of sliding contacts.
    """

    frame: int
    contacts: IntArray
    force: FloatArray
    gap: FloatArray

    def __len__(self) -> int:
        return len(self.contacts)

    @cached_property
    def beads(self) -> IntArray:
        """Both beads of bridges between beads, shape (K, 2)."""
        return self.contacts[self.contacts[:, 2] < 0, :2]

    @cached_property
    def at_walls(self) -> IntArray:
        """Beads and walls of bridges to walls, shape (2, M)."""
        return self.contacts[self.contacts[:, 2] >= 0][:, [0, 2]].T

    def rows(self) -> dict[str, npt.NDArray[Any]]:
        """Columns of a table."""
        ends = dict(zip(("bead_1", "bead_2", "wall"), self.contacts.T, strict=True))
        return {**ends, "gap": self.gap, "normal_force": self.force, "touching": self.gap <= 0.0}


def read_bridges(motion: Motion, frames: Collection[int] | None = None) -> Iterator[Bridges]:
    """The bridges between the beads of a motion in each frame that recorded them, or in some of these frames.

    Raises a `DumpError` if a dump cannot be read or ends early, or if no frame recorded bridges.
    """
    stride = motion.case.run.samples_per_bridge_sample
    frame_at = {
        place: frame
        for frame, place in enumerate(motion.frames)
        if frames is None or frame in frames
    }
    for segment in dict.fromkeys(segment for segment, _ in motion.frames):
        layout = read_layout(segment)
        pairs = local_frames(segment / layout.pair_bridge_dump, layout.pair_bridge_columns)
        walls = local_frames(segment / layout.wall_bridge_dump, layout.wall_bridge_columns)
        number = -1
        for number, ((_, between), (_, against)) in enumerate(zip(pairs, walls, strict=False)):
            frame = frame_at.pop((segment, stride * number), None)
            if frame is not None:
                yield _bridges(motion, frame, between, against, layout)
        if number + 1 != layout.bridge_frames:
            raise DumpError(
                f"{segment}: its bridges hold {number + 1} of {layout.bridge_frames} frames"
            )
    if frames is None and len(frame_at) == len(motion.frames):
        raise DumpError(f"{motion.directory}: none of its frames recorded bridges")


def _bridges(
    motion: Motion, frame: int, between: FloatArray, against: FloatArray, layout: DeckLayout
) -> Bridges:
    place, pair, wall = (
        motion.position[frame],
        layout.pair_bridge_columns.index,
        layout.wall_bridge_columns.index,
    )
    index = np.full(layout.atoms, -1)  # in the motion, which may hold some of the beads
    index[slice(None) if motion.bead_numbers is None else motion.bead_numbers] = np.arange(
        len(place)
    )
    # The dumps also contain neighbours without a bridge; their force is zero.
    between = between[np.any(between[:, pair("fx") : pair("fx") + 3] != 0.0, axis=1)]
    against = against[np.any(against[:, wall("fx") : wall("fx") + 3] != 0.0, axis=1)]
    ids = index[between[:, [pair("id1"), pair("id2")]].astype(np.int64) - 1]
    beads = index[against[:, wall("id")].astype(np.int64) - 1]
    held, kept = np.all(ids >= 0, axis=1), beads >= 0
    between, against, ids, beads = between[held], against[kept], ids[held], beads[kept]
    arm = place[ids[:, 1]] - place[ids[:, 0]]
    pull = np.einsum("kx,kx->k", between[:, pair("fx") : pair("fx") + 3], arm) / np.linalg.norm(
        arm, axis=1
    )
    walls = against[:, wall("wall")].astype(np.int64)
    normals = np.stack([surface.normals(place[beads]) for surface in motion.case.boundary.walls])
    normals = normals[walls, np.arange(len(walls))]
    wall_pull = -np.einsum("mx,mx->m", against[:, wall("fx") : wall("fx") + 3], normals)
    contacts = np.full((len(ids) + len(walls), 3), -1)
    contacts[: len(ids), :2] = np.sort(ids, axis=1)
    contacts[len(ids) :, [0, 2]] = np.stack([beads, walls], axis=1)
    gap = -np.concatenate([between[:, pair("overlap")], against[:, wall("overlap")]])
    return Bridges(frame, contacts, np.concatenate([pull, wall_pull]), gap)
