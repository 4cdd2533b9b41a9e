"""The motion of a run's beads and their bridges, over all of its segments, as arrays.

A run consists of one or more *segments*, folders with dumps of their own, each of which continues
the one before. `read_motion` reads a run directory. This module does not measure: it gives
positions, velocities, headings, gaps and bridges, from which the other modules of this package
compute tables and numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
from walkers.postprocess.measure.large_arrays import empty_array
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


@dataclass(frozen=True, repr=False)
class Motion:
    """Positions and velocities relative to the boundary: F frames of N beads, SI units.

    Attributes
    ----------
    case
        The case; if the run ended at constant velocities, with the cycles that it took.
    time : ndarray, shape (F,)
        Time since the start of the drive, s; negative while the beads come to rest.
    position, velocity : ndarray, shape (F, N, 3)
        Position (m) and velocity (m/s) of the centres of the beads.
    spin : ndarray, shape (F, N, 3)
        Angular velocity of the beads, rad/s.
    substrate : ndarray, shape (F, 3)
        Displacement of the boundary in the laboratory, for both frames of reference, m; of a
        record, without its slow part (`walkers.inputs.records.record.Record.slow_course`).
    radius : ndarray, shape (N,)
        Radius of the beads, m.
    walkers
        The walkers with the indices of their beads, from 0.
    frames : list of (Path, int)
        Segment of each frame and number of the frame in it, by which bridges are found.
    truncated
        Whether the dump ends within a frame.
    ended_early
        Whether the run ended early because its velocities were constant.
    mean_spin : ndarray, shape (F, N, 3), or None
        Angular velocity averaged over the steps since the previous frame, rad/s; zero in the first
        frame, None if it was not recorded.
    bead_numbers : ndarray of int, shape (N,), or None
        Indices of the beads in the run; None if the motion has all beads of the run.
    directory : Path
        The run directory.
    first_driven : int
        Index of the first frame of the drive.
    driven : Motion
        The motion during the drive.
    averaged : Motion
        Means over the F - 1 intervals between frames.
    follows_cycles : bool
        Whether there are enough frames a cycle to resolve it.
    large : ndarray of bool, shape (N,)
        Whether a bead is of the large class.
    walker_of : ndarray of int, shape (N,)
        Index of the walker of each bead, −1 for none.
    bridges : list of Bridges
        The bridges of each frame that recorded them: pairs of beads, walls and gaps.
    groups : list of Group
        The walkers of each kind during the drive, with headings, orientations and gaps.
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
        segment, _ = self.frames[0]
        return run_of_segment(segment)

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
        if self.first_driven == 0:
            return self
        return self.select(slice(self.first_driven, None))

    def select(self, frames: slice = slice(None), beads: IntArray | None = None) -> Motion:
        """Select frames and beads.

        Parameters
        ----------
        frames
            The frames to keep.
        beads : ndarray of int, or None
            Indices of the beads to keep, in their new order; None keeps all.

        Returns
        -------
        Motion
            The motion of these frames and beads. Beads are renumbered in this order. Walkers keep
            their numbers; those that lose a bead are left out.
        """
        mean_spin = self.mean_spin
        if mean_spin is not None:
            mean_spin = mean_spin[frames]
        selected = replace(
            self,
            time=self.time[frames],
            position=self.position[frames],
            velocity=self.velocity[frames],
            spin=self.spin[frames],
            substrate=self.substrate[frames],
            frames=self.frames[frames],
            mean_spin=mean_spin,
        )
        return selected if beads is None else selected._with_beads(beads)

    def _with_beads(self, beads: IntArray) -> Motion:
        """The motion of some beads, which are renumbered."""
        new_number = {bead: number for number, bead in enumerate(beads.tolist())}
        walkers = []
        for walker in self.walkers:
            if new_number.keys() >= set(walker.beads):
                renumbered = tuple(new_number[bead] for bead in walker.beads)
                walkers.append(replace(walker, beads=renumbered))
        mean_spin = self.mean_spin
        if mean_spin is not None:
            mean_spin = mean_spin[:, beads]
        bead_numbers = beads
        if self.bead_numbers is not None:
            bead_numbers = self.bead_numbers[beads]
        return replace(
            self,
            position=self.position[:, beads],
            velocity=self.velocity[:, beads],
            spin=self.spin[:, beads],
            radius=self.radius[beads],
            walkers=tuple(walkers),
            mean_spin=mean_spin,
            bead_numbers=bead_numbers,
        )

    def of_walkers(self, walkers: Collection[PlacedWalker]) -> Motion:
        """The motion of the beads of some walkers."""
        return self.select(beads=np.concatenate([walker.beads for walker in walkers]))

    @property
    def averaged(self) -> Motion:
        """Means over the F - 1 intervals between frames: positions, velocities and spins.

        Positions are those in the middle of an interval, velocities the displacement over its
        duration. Spins are the averages of the engine over all steps, if it made them; otherwise
        they are the mean of both ends. Times and displacements of the substrate are those of the
        later frame. The motion is empty if there is one frame.
        """
        if self.mean_spin is None:
            spin = (self.spin[1:] + self.spin[:-1]) / 2.0
        else:
            spin = self.mean_spin[1:]
        position = (self.position[1:] + self.position[:-1]) / 2.0
        velocity = np.diff(self.position, axis=0) / np.diff(self.time)[:, None, None]
        intervals = self.select(slice(1, None))
        return replace(intervals, position=position, velocity=velocity, spin=spin)

    @property
    def large(self) -> BoolArray:
        """Whether a bead is of the large class, shape (N,).

        The class begins above `walkers.inputs.tables.case.Setup.border`.
        """
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
        """The bridges of all frames that recorded them; `read_bridges` needs less memory."""
        return list(read_bridges(self))

    @cached_property
    def groups(self) -> list[Group]:
        """The walkers of each kind during the drive, in the order of the kinds of the case."""
        return [self.driven.group(number) for number in range(len(self.case.walkers))]

    def group(self, number: int) -> Group:
        """The walkers of one kind in all frames.

        Parameters
        ----------
        number
            Index of the kind in the case, from 0.
        """
        walkers = [walker for walker in self.walkers if walker.kind == number]
        rows = np.array([walker.beads for walker in walkers], dtype=np.int64)
        return Group(
            motion=self,
            case=self.case,
            kind=self.case.walkers[number],
            walkers=walkers,
            rows=rows,
            time=self.time,
            position=self.position[:, rows],
            velocity=self.velocity[:, rows],
            spin=self.spin[:, rows],
        )


@dataclass(frozen=True, repr=False)
class Group:
    """The W walkers of one kind, of n beads each, in F frames of a motion; SI units.

    Attributes
    ----------
    motion
        The motion of all beads.
    case
        Its case.
    kind
        The table of these walkers in the case.
    walkers
        The walkers with the indices of their beads in the motion.
    rows : ndarray of int, shape (W, n)
        Indices of their beads in the motion.
    time : ndarray, shape (F,)
        Time since the start of the drive, s.
    position, velocity, spin : ndarray, shape (F, W, n, 3)
        Position (m), velocity (m/s) and angular velocity (rad/s) of their beads.
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
    def walker_numbers(self) -> IntArray:
        """Numbers of the walkers in the run, shape (W,)."""
        return np.array([walker.walker for walker in self.walkers])

    @property
    def facing(self) -> IntArray:
        """Direction that the walkers face, 1 along the drive axis, −1 opposite, shape (W,)."""
        return np.array([walker.facing for walker in self.walkers])

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
        """Unit vector in the plane of the substrate from which orientations are measured.

        It is the direction of the drive, or x if the drive is perpendicular to the substrate.
        """
        return np.array(self.case.drive_axis)

    @property
    def across_axis(self) -> FloatArray:
        """Unit vector in the plane of the substrate, a quarter turn to the left of `drive_axis`."""
        return np.cross([0.0, 0.0, 1.0], self.drive_axis)

    @cached_property
    def heading(self) -> FloatArray:
        """Headings: unit vectors in the plane of the substrate, shape (F, W, 3).

        They point from the centroid of the small beads to that of the large beads; with beads of
        one size, from the hindmost to the foremost beads
        (`walkers.inputs.tables.bodies.Walkers.toward_large`).
        """
        arm = np.einsum("fwbx,b->fwx", self.position, np.array(self.kind.toward_large))
        arm[..., 2] = 0.0
        heading: FloatArray = arm / np.linalg.norm(arm, axis=-1, keepdims=True)
        return heading

    @cached_property
    def gap(self) -> FloatArray:
        """Gaps, m, negative for overlap, shape (F, W, n + pairs).

        The gaps of the beads to their nearest walls come first, then those of the pairs of beads.
        """
        gaps = [self._wall_distance() - self.radii]
        for first, second in self.kind.pairs:
            arm = self.position[:, :, first] - self.position[:, :, second]
            distance = np.linalg.norm(arm, axis=-1)
            gap = distance - (self.radii[first] + self.radii[second])
            gaps.append(gap[..., None])
        return np.concatenate(gaps, axis=-1)

    def _wall_distance(self) -> FloatArray:
        """Distance of the centre of each bead from its nearest wall, m, shape (F, W, n)."""
        boundary = self.case.boundary
        if boundary.is_open_floor:  # at z = 0
            height: FloatArray = self.position[..., 2]
            return height
        first_wall, *other_walls = boundary.walls
        distance = first_wall.distances(self.position)
        for wall in other_walls:
            distance = np.minimum(distance, wall.distances(self.position))
        return distance

    @cached_property
    def orientation(self) -> FloatArray:
        """Angle ψ by which walkers are turned from the direction that they face, rad, shape (F, W).

        It is unwrapped: a walker that goes round has more than π. An arrangement that faces its
        direction has ψ = 0, even if its foremost beads are beside its middle.
        """
        front = np.array(self.kind.front)
        front_ahead, front_aside = front @ np.array(self.kind.design)
        arm = np.einsum("fwbx,b->fwx", self.position, front)
        ahead = self.facing * (arm @ self.drive_axis)
        aside = self.facing * (arm @ self.across_axis)
        turned = np.arctan2(aside, ahead)
        turned_in_design = np.arctan2(front_aside, front_ahead)
        angle: FloatArray = np.unwrap(turned - turned_in_design, axis=0)
        return angle

    @cached_property
    def turned_at(self) -> FloatArray:
        """Time at which walkers have turned by more than 90° from their start, s, shape (W,).

        It is the end of the first cycle after which the orientation differs so much from that of
        the first frame; NaN if there is none. The motion begins with the drive.
        """
        frames_per_cycle = self.case.run.samples_per_cycle
        turned = self.orientation[::frames_per_cycle] - self.orientation[0]
        has_turned = np.abs(turned) > np.pi / 2.0
        first_turned = has_turned.argmax(axis=0)
        time = self.time[::frames_per_cycle]
        return np.where(has_turned.any(axis=0), time[first_turned], np.nan)


def interpolated_positions(moved: Motion | Group, share: float) -> FloatArray:
    """Interpolate positions between frames by cubic Hermite polynomials.

    Parameters
    ----------
    moved
        A motion, or a group of walkers, of F frames.
    share
        Fraction of each interval between frames, from 0 to 1, at which positions are evaluated.

    Returns
    -------
    ndarray, shape (F - 1, …, 3)
        Positions, m.
    """
    begin = moved.position[:-1]
    end = moved.position[1:]
    rest = 1.0 - share
    interval = np.diff(moved.time)
    interval = interval.reshape(-1, *[1] * (moved.position.ndim - 1))
    position = rest**2 * (1.0 + 2.0 * share) * begin + share**2 * (3.0 - 2.0 * share) * end
    slopes = rest * moved.velocity[:-1] - share * moved.velocity[1:]
    position += share * rest * interval * slopes
    return position


def came_near(centre: FloatArray, near: float) -> bool:
    """Tell whether two points ever came within a distance of each other.

    Parameters
    ----------
    centre : ndarray, shape (F, W, 2)
        Places of W points in F frames, m.
    near
        The distance, m.
    """
    for number in range(1, centre.shape[1]):
        arm = centre[:, number:] - centre[:, number - 1, None]
        if np.linalg.norm(arm, axis=-1).min() < near:
            return True
    return False


def read_motion(directory: str | Path) -> Motion:
    """Read the beads of a run directory with its segments, finished or not.

    Parameters
    ----------
    directory
        The run directory.

    Returns
    -------
    Motion
        The motion of all beads in all frames of the segments that are complete.

    Raises
    ------
    DumpError
        If no segment is complete, or a segment cannot be read.
    FileNotFoundError
        If the directory is not a run directory.

    Examples
    --------
    >>> motion = read_motion(walkers.run("fig1b", tmp).directory)
    >>> motion.position.shape  # 24 cycles of 20 samples, six walkers of two beads
    (241, 12, 3)
    >>> motion.groups[0].heading.shape
    (241, 6, 3)
    """
    directory = Path(directory)
    case = case_of(directory)
    paths = segment_directories(directory)
    if not paths:
        raise DumpError(f"{directory}: no segment of the run is finished yet")
    try:
        return _joined(case, _read_segments(case, paths))
    except NoNumberError as error:
        # A run gets its manifest when it is finished; then its dumps contained no such numbers.
        if (directory / MANIFEST_NAME).is_file():
            reason = "the dump was damaged after the run was finished"
        else:
            reason = "the simulation blew up"
        raise DumpError(f"{error}: {reason}") from error


@dataclass(frozen=True)
class _Segment:
    """A segment of a run.

    Attributes
    ----------
    path
        Its directory.
    begin, end
        Steps of the engine at its start and its end.
    drive_from
        Step at which the drive starts; None if it has not started in this segment.
    layout
        Columns and sizes of its dumps.
    dump
        Its bead dump.
    first_new_frame
        Number of the first frame that the segment before does not have.
    """

    path: Path
    begin: int
    end: int
    drive_from: int | None
    layout: DeckLayout
    dump: BinaryDump
    first_new_frame: int

    @property
    def new_frames(self) -> range:
        """Numbers of the frames that the segment before does not have."""
        return range(self.first_new_frame, len(self.dump))


def _open_segment(path: Path, first_new_frame: int) -> _Segment:
    """Open the record, layout and bead dump of a segment; `DumpError` if one cannot be read."""
    source = path / SEGMENT_NAME
    try:
        record = read_json(source)
        begin = record["begin"]
        end = record["end"]
        drive_from = record["drive_from"]
        source = path
        layout = read_layout(path)
        bead_dump = path / layout.bead_dump
        if not bead_dump.exists():
            raise DumpError(
                f"{bead_dump} was left out, as the dumps of calibrations, spreads and some "
                f"archives; to make the run again: walkers run {run_of_segment(path)} --force"
            )
        dump = BinaryDump(bead_dump, layout.bead_columns)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DumpError(f"{source}: cannot be read ({error})") from error
    return _Segment(path, begin, end, drive_from, layout, dump, first_new_frame)


def _read_segments(case: Case, paths: Sequence[Path]) -> list[_Segment]:
    """Open the segments of a run.

    `DumpError` if a segment does not continue the one before, or a dump has the wrong size.
    """
    segments: list[_Segment] = []
    for path in paths:
        first_new_frame = 0
        end_of_previous = 0
        if segments:
            first_new_frame = 1  # the first frame repeats the last one of the segment before
            end_of_previous = segments[-1].dump.steps[-1]
        segment = _open_segment(path, first_new_frame)
        dump = segment.dump
        if segment.begin != end_of_previous:
            raise DumpError(f"{path}: the segment before it is missing")
        is_whole = len(dump) > 0 and not dump.truncated and dump.steps[-1] == segment.end
        may_be_cut_short = len(paths) == 1 and not case.run.rests
        if not is_whole and not may_be_cut_short:
            raise DumpError(f"{path}: its dump is incomplete")
        if len(dump) < 2:
            raise DumpError(f"{dump.path}: {len(dump)} complete frames, too few for a motion")
        if dump.rows != segment.layout.atoms:
            raise DumpError(f"{path}: {dump.rows} rows, expected {segment.layout.atoms}")
        segments.append(segment)
    return segments


def _read_vectors(segments: Sequence[_Segment]) -> dict[str, FloatArray]:
    """Vectors of the beads in all frames, by the names of their first columns; shape (F, N, 3).

    They are positions ``x`` (m), velocities ``vx`` (m/s), spins ``omegax`` (rad/s), and mean spins
    (rad/s) if the dumps have them.

    Each array is filled once: a stack of whole frames, and copies of parts of it, would need twice
    the memory. Large ones are on the disk (`walkers.postprocess.measure.large_arrays`).
    """
    layout = segments[-1].layout
    names = ["x", "vx", "omegax"]
    if MEAN_SPIN_COLUMNS[0] in layout.bead_columns:
        names.append(MEAN_SPIN_COLUMNS[0])
    frames = 0
    for segment in segments:
        frames += len(segment.new_frames)
    directory = run_of_segment(segments[0].path)
    vectors = {name: empty_array((frames, layout.atoms, 3), directory) for name in names}
    frame = 0
    for segment in segments:
        first_columns = {name: segment.layout.bead_columns.index(name) for name in names}
        for number in segment.new_frames:
            values = segment.dump.frame(number)
            for name, column in first_columns.items():
                vectors[name][frame] = values[:, column : column + 3]
            frame += 1
    return vectors


def _joined(case: Case, segments: Sequence[_Segment]) -> Motion:
    """The motion over all segments of a run.

    The engine's steps become times since the start of the drive, and its positions and velocities
    become relative to the walls.
    """
    run = case.run
    first = segments[0]
    last = segments[-1]
    steps_of_segments = []
    frames: list[tuple[Path, int]] = []
    drive_from = None
    for segment in segments:
        steps_of_segments.append(segment.dump.steps[segment.first_new_frame :])
        frames += [(segment.path, number) for number in segment.new_frames]
        if drive_from is None:
            drive_from = segment.drive_from
    steps = np.concatenate(steps_of_segments)
    if drive_from is None:
        # A drive that has not started yet starts in the frame after the last one.
        time = (steps - (steps[-1] + run.steps_per_sample)) * run.time_step
    else:
        time = (steps - drive_from) * run.time_step

    vectors = _read_vectors(segments)
    displacement, velocity = prescribed_motion(case.excitation, time)
    if drive_from is not None and drive_from > 0:
        velocity[time == 0.0] = 0.0  # in the last frame at rest the walls do not move yet
    if displacement.any():
        vectors["x"] -= displacement[:, None]
    if velocity.any():
        vectors["vx"] -= velocity[:, None]

    cycles = run.cycles
    completed_case = case
    if run.until_steady:
        cycles = last.end // run.steps_per_cycle
        completed_case = case.for_cycles(cycles)
    walkers = []
    for walker in last.layout.walkers:
        beads_from_zero = tuple(bead - 1 for bead in walker.beads)
        walkers.append(replace(walker, beads=beads_from_zero))
    radius_column = first.layout.bead_columns.index("radius")
    return Motion(
        case=completed_case,
        time=time,
        position=vectors["x"],
        velocity=vectors["vx"],
        spin=vectors["omegax"],
        substrate=visible_displacement(case.excitation, time),
        radius=first.dump.frame(0)[:, radius_column].copy(),
        walkers=tuple(walkers),
        frames=frames,
        truncated=last.dump.truncated,
        ended_early=cycles < run.cycles,
        mean_spin=vectors.get(MEAN_SPIN_COLUMNS[0]),
    )


def prescribed_motion(drive: Excitation, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the motion of the walls in the frame of reference of the drive.

    Parameters
    ----------
    drive
        The drive.
    time : ndarray, shape (F,)
        Time since the start of the drive, s.

    Returns
    -------
    displacement, velocity : ndarray, shape (F, 3)
        In m and m/s; zero if the frame of reference is that of the walls.
    """
    displacement, velocity = boundary_motion(drive, time)
    if drive.frame == "lab":
        return displacement, velocity
    return 0.0 * displacement, 0.0 * velocity


def boundary_motion(drive: Excitation, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the motion of the boundary in the laboratory.

    Parameters
    ----------
    drive
        The drive.
    time : ndarray, shape (F,)
        Time since the start of the drive, s.

    Returns
    -------
    displacement, velocity : ndarray, shape (F, 3)
        In m and m/s; zero before the drive.
    """
    displacement = np.zeros((len(time), 3))
    velocity = np.zeros((len(time), 3))
    driven = time >= 0.0
    for direction, (course, speed, _) in drive.motions(time):
        displacement += np.outer(course * driven, direction)
        velocity += np.outer(speed * driven, direction)
    return displacement, velocity


def visible_displacement(drive: Excitation, time: FloatArray) -> FloatArray:
    """Compute the displacement of the boundary in pictures.

    Parameters
    ----------
    drive
        The drive.
    time : ndarray, shape (F,)
        Time since the start of the drive, s.

    Returns
    -------
    ndarray, shape (F, 3)
        Displacement, m, without the slow part of a record; zero before the drive.
    """
    return drive.shaking(time) * (time >= 0.0)[:, None]


@dataclass(frozen=True)
class Bridges:
    """The bridges of one frame of a motion: K between beads, then M to walls.

    The engine reports wrong tangential forces of sliding contacts, so there are none here.

    Attributes
    ----------
    frame
        Index of the frame in the motion.
    contacts : ndarray of int, shape (K + M, 3)
        Of a bridge between beads: both beads in ascending order, from 0, and −1. Of a bridge to a
        wall: the bead, −1 and the index of the wall (0 for the floor).
    force : ndarray, shape (K + M,)
        Net normal force (capillary, viscous and elastic), N, positive for attraction.
    gap : ndarray, shape (K + M,)
        Gap, m, negative for overlap.
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
        """Columns of the table ``bridges``."""
        bead_1, bead_2, wall = self.contacts.T
        return {
            "bead_1": bead_1,
            "bead_2": bead_2,
            "wall": wall,
            "gap": self.gap,
            "normal_force": self.force,
            "touching": self.gap <= 0.0,
        }


def read_bridges(motion: Motion, frames: Collection[int] | None = None) -> Iterator[Bridges]:
    """Read the bridges between the beads of a motion, one frame after the other.

    Parameters
    ----------
    motion
        The motion; it may have some of the frames and beads of the run.
    frames
        Indices of the frames to read; None reads all.

    Yields
    ------
    Bridges
        The bridges of each of these frames that recorded them.

    Raises
    ------
    DumpError
        If a dump cannot be read or ends early; that is found after its frames. If all frames are to
        be read and none recorded bridges.
    """
    stride = motion.case.run.samples_per_bridge_sample
    frame_at = {
        place: frame
        for frame, place in enumerate(motion.frames)
        if frames is None or frame in frames
    }
    segments = dict.fromkeys(segment for segment, _ in motion.frames)
    for segment in segments:
        layout = read_layout(segment)
        pairs = local_frames(segment / layout.pair_bridge_dump, layout.pair_bridge_columns)
        walls = local_frames(segment / layout.wall_bridge_dump, layout.wall_bridge_columns)
        count = 0
        for number, (pair_frame, wall_frame) in enumerate(zip(pairs, walls, strict=False)):
            count = number + 1
            frame = frame_at.pop((segment, stride * number), None)
            if frame is not None:
                _, pair_rows = pair_frame
                _, wall_rows = wall_frame
                yield _bridges(motion, frame, pair_rows, wall_rows, layout)
        if count != layout.bridge_frames:
            raise DumpError(f"{segment}: its bridges hold {count} of {layout.bridge_frames} frames")
    if frames is None and len(frame_at) == len(motion.frames):  # none has been taken out
        raise DumpError(f"{motion.directory}: none of its frames recorded bridges")


def _bridges(
    motion: Motion, frame: int, pair_rows: FloatArray, wall_rows: FloatArray, layout: DeckLayout
) -> Bridges:
    """The bridges of a frame from the rows of both dumps of bridges."""
    number_in_motion = _numbers_in_motion(motion, layout.atoms)
    pairs, pair_force, pair_gap = _pair_bridges(
        motion.position[frame], pair_rows, layout.pair_bridge_columns, number_in_motion
    )
    beads_and_walls, wall_force, wall_gap = _wall_bridges(
        motion, frame, wall_rows, layout.wall_bridge_columns, number_in_motion
    )
    contacts = np.full((len(pairs) + len(beads_and_walls), 3), -1)
    contacts[: len(pairs), :2] = np.sort(pairs, axis=1)
    contacts[len(pairs) :, [0, 2]] = beads_and_walls
    return Bridges(
        frame=frame,
        contacts=contacts,
        force=np.concatenate([pair_force, wall_force]),
        gap=np.concatenate([pair_gap, wall_gap]),
    )


def _numbers_in_motion(motion: Motion, atoms: int) -> IntArray:
    """Index in a motion of each bead of the run, −1 for beads that the motion does not have."""
    if motion.bead_numbers is None:
        return np.arange(atoms)
    number_in_motion = np.full(atoms, -1)
    number_in_motion[motion.bead_numbers] = np.arange(len(motion.bead_numbers))
    return number_in_motion


def _with_force(rows: FloatArray, first_column: int) -> FloatArray:
    """Rows of a dump that have a bridge; the dumps also have neighbours without one and force."""
    force = rows[:, first_column : first_column + 3]
    return rows[np.any(force != 0.0, axis=1)]


def _pair_bridges(
    position: FloatArray, rows: FloatArray, columns: Sequence[str], number_in_motion: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Both beads, shape (K, 2), normal force (N) and gap (m), shape (K,), of bridges between beads.

    ``position`` is that of the beads in the frame, m, shape (N, 3).
    """
    fx = columns.index("fx")
    rows = _with_force(rows, fx)
    ids = rows[:, [columns.index("id1"), columns.index("id2")]].astype(np.int64)
    beads = number_in_motion[ids - 1]
    in_motion = np.all(beads >= 0, axis=1)
    rows = rows[in_motion]
    beads = beads[in_motion]
    arm = position[beads[:, 1]] - position[beads[:, 0]]
    force_on_first = rows[:, fx : fx + 3]
    normal_force = np.einsum("kx,kx->k", force_on_first, arm) / np.linalg.norm(arm, axis=1)
    return beads, normal_force, -rows[:, columns.index("overlap")]


def _wall_bridges(
    motion: Motion,
    frame: int,
    rows: FloatArray,
    columns: Sequence[str],
    number_in_motion: IntArray,
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Bead and wall, shape (M, 2), normal force (N) and gap (m), shape (M,), of wall bridges."""
    fx = columns.index("fx")
    rows = _with_force(rows, fx)
    beads = number_in_motion[rows[:, columns.index("id")].astype(np.int64) - 1]
    in_motion = beads >= 0
    rows = rows[in_motion]
    beads = beads[in_motion]
    walls = rows[:, columns.index("wall")].astype(np.int64)
    position = motion.position[frame, beads]
    surfaces = motion.case.boundary.walls
    normals_of_walls = np.stack([surface.normals(position) for surface in surfaces])
    normals = normals_of_walls[walls, np.arange(len(walls))]
    normal_force = -np.einsum("mx,mx->m", rows[:, fx : fx + 3], normals)
    beads_and_walls = np.stack([beads, walls], axis=1)
    return beads_and_walls, normal_force, -rows[:, columns.index("overlap")]
