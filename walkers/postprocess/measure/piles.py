"""Loose beads in a container: the bed, and the clusters that leave it and climb.

`walkers.postprocess.measure.clusters` defines clusters and climbs. This module finds them in each
frame, describes the bed, and makes the tables and numbers of a pile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure import clusters
from walkers.postprocess.measure.clusters import HeldCluster, PileBeads
from walkers.postprocess.measure.motion import Bridges, Motion, read_bridges
from walkers.postprocess.measure.numbers import Measurement
from walkers.postprocess.measure.tables import Columns, read_columns

NAME = "piles"
VERSION = 2

_WHOLE = 1.0 - 1e-6
"""Fraction of the duration below which a run ended early."""
_CELL_SIZE = 4.0
"""Width of the cells in which the surface is measured, over the largest radius."""


def applies(case: Case) -> bool:
    """Tell whether a case has loose beads in a container."""
    return case.loose and case.boundary.closed


def derived(case: Case) -> dict[str, float]:
    """Numbers of beads and duration of the drive (s)."""
    return {"beads": case.count, "large": case.large, "duration": case.duration}


def has_climbed(motion: Motion) -> bool:
    """Tell whether a cluster of a pile has climbed so far."""
    return bool(measure(motion).numbers["climbs"])


def measure(motion: Motion) -> Measurement:
    """Measure the bed and the clusters of a pile.

    Parameters
    ----------
    motion
        Motion of loose beads in a container.

    Returns
    -------
    Measurement
        Tables ``bed``, ``clusters``, ``events``, ``members`` and ``assembly``, and the numbers of
        the group ``piles``.
    """
    case = motion.case
    frames = _measure_frames(motion)
    beads = PileBeads(
        time=motion.time,
        height=motion.position[..., 2],
        large=motion.large,
        surface=frames.bed["surface"],
        bulk=frames.bulks,
        first=motion.first_driven,
        wall_names=[wall.name for wall in case.boundary.walls],
        walls=case.boundary.walls,
        position=motion.position,
    )
    tracks = clusters.follow(motion.time, frames.clusters)
    climbs = clusters.climbs_of(tracks, beads)
    events = clusters.events_of(tracks, climbs, beads)
    tables = {
        "bed": frames.bed,
        "clusters": climbs,
        "events": events,
        "members": clusters.members_of(tracks, beads),
        "assembly": clusters.assembly_of(tracks, climbs, beads, read_bridges(motion)),
    }
    numbers: dict[str, Any] = {"clusters": len(tracks)}
    for event in clusters.EVENTS:
        numbers[f"events_{event}"] = int(np.sum(events["event"] == event))
    numbers |= _of_climbs(climbs)
    numbers |= _of_bed(motion, frames.bed)

    warnings = []
    ended_by_climb = case.run.until == "climb" and numbers["climbs"] > 0
    if numbers["driven"] < _WHOLE * case.duration and not ended_by_climb:
        warnings.append(
            f"shaken for {numbers['driven']:.3g} s of {case.duration:.3g} s: "
            "climbers left the container"
        )
    return Measurement(tables, numbers, tuple(warnings))


@dataclass(frozen=True)
class _Frames:
    """What is measured in each frame of a pile.

    Attributes
    ----------
    bed
        The table ``bed``.
    bulks : list of ndarray of bool, shape (N,)
        Whether a bead is part of the bulk.
    clusters
        The clusters that are free and held; none while the pile settles.
    """

    bed: Columns
    bulks: list[BoolArray]
    clusters: list[list[HeldCluster]]


def _measure_frames(motion: Motion) -> _Frames:
    """Find bulk and clusters, and describe the bed, in each frame."""
    wall_names = [wall.name for wall in motion.case.boundary.walls]
    floor = clusters.floor_of(wall_names)
    heap = motion.case.mixture is not None
    rows = []
    bulks = []
    clusters_of_frames = []
    for bridges in read_bridges(motion):
        labels = clusters.connected(len(motion.radius), bridges.beads)
        bulk = clusters.bulk_of(labels, bridges, heap=heap, floor=floor)
        clusters_now: list[HeldCluster] = []
        # While the pile settles, most beads are free of the bulk.
        if motion.time[bridges.frame] >= 0.0:
            clusters_now = list(clusters.held_clusters(labels, bridges, bulk, floor))
        rows.append(_state_of(motion, bridges, bulk, clusters_now, floor))
        bulks.append(bulk)
        clusters_of_frames.append(clusters_now)
    bed: Columns = {}
    for name in rows[0]:
        bed[name] = np.array([row[name] for row in rows])
    return _Frames(bed, bulks, clusters_of_frames)


def _of_climbs(clusters: Columns) -> dict[str, Any]:
    """Numbers of all climbs in the table ``clusters``.

    They are the number of ``climbs``, the first ``onset`` (s), the mean ``speed`` (m/s), the height
    of the ``highest`` (m), and how many are ``led_by_large`` beads. Without climbs, both counts are
    0 and the others NaN.
    """
    climbs = {name: column[clusters["climbed"]] for name, column in clusters.items()}
    speeds = climbs["speed"][np.isfinite(climbs["speed"])].tolist()
    mean_speed = nan
    if speeds:
        mean_speed = sum(speeds) / len(speeds)
    return {
        "climbs": len(climbs["track"]),
        "onset": float(min(climbs["onset"], default=nan)),
        "speed": mean_speed,
        "highest": float(max(climbs["height"], default=nan)),
        "led_by_large": int(climbs["leader_large"].sum()),
    }


def _of_bed(motion: Motion, bed: Columns) -> dict[str, Any]:
    """Numbers of the bed at the start and the end of the drive, at rest, and while it is shaken.

    ``…_at_rest`` is in the last frame before the drive, ``…_shaken`` the mean over the second half
    of the drive, NaN without a drive. ``driven`` and ``settling`` are durations, s; the surface is
    in m, the others are without unit.
    """
    time = motion.time
    end = time[-1]
    frame_at_rest = max(int(np.searchsorted(time, 0.0, side="right")) - 1, 0)
    second_half = time >= min(time[motion.first_driven :].mean(), end)
    numbers = {"driven": float(max(end, 0.0)), "settling": float(min(end, 0.0) - time[0])}
    for name in ("surface", "brazil_nut"):
        numbers[f"{name}_start"] = float(bed[name][motion.first_driven])
        numbers[f"{name}_end"] = float(bed[name][-1])
    for name in ("contacts", "bridges"):
        numbers[f"{name}_at_rest"] = float(bed[name][frame_at_rest])
        numbers[f"{name}_shaken"] = nan
        if end > 0.0:
            numbers[f"{name}_shaken"] = float(np.mean(bed[name][second_half]))
    return numbers


def tracks_of(motion: Motion) -> tuple[IntArray, BoolArray]:
    """Read to which track the beads of a pile belong.

    Parameters
    ----------
    motion
        The motion; it may have some of the frames and beads of a run that has been measured.

    Returns
    -------
    track : ndarray of int, shape (F, N)
        Track of each bead in each frame; -1 for none.
    climbs : ndarray of bool, shape (F, N)
        Whether this track is a climb.
    """
    members = read_columns(motion.directory, "members")
    climbed = read_columns(motion.directory, "clusters")["climbed"]
    track = np.full((len(motion.time), motion.case.count), -1, dtype=np.int64)
    frame = np.searchsorted(motion.time, members["time"]).clip(max=len(motion.time) - 1)
    in_motion = motion.time[frame] == members["time"]
    track[frame[in_motion], members["bead"][in_motion]] = members["track"][in_motion]
    if motion.bead_numbers is not None:
        track = track[:, motion.bead_numbers]
    climbs_of_tracks = np.append(climbed, False)  # the last one is that of track -1
    return track, climbs_of_tracks[track]


def _state_of(
    motion: Motion, bridges: Bridges, bulk: BoolArray, held: Sequence[HeldCluster], floor: int
) -> dict[str, Any]:
    """The row of the table ``bed`` of the frame of the bridges.

    ``held`` are the clusters that are free of the bulk and held by a side wall. Values are in SI
    units; ``contacts`` and ``bridges`` are numbers per bead, without those at walls.
    """
    frame = bridges.frame
    position = motion.position[frame]
    radius = motion.radius
    large = motion.large
    at_wall = clusters.at_sides(bridges, len(radius), floor)
    cell = _CELL_SIZE * float(radius.max())
    tops = _surface_cells(position[bulk], radius[bulk], motion.case.boundary, cell)
    if len(tops) == 0:
        tops = np.zeros(1)  # without a bulk, the floor is the surface
    surface_low, surface, surface_high = np.percentile(tops, (10.0, 50.0, 90.0)).tolist()
    highest = surface
    for cluster in held:
        highest = max(highest, float(position[list(cluster.members), 2].max()))
    pairs = len(bridges.beads)
    mean_force = 0.0
    if pairs:
        mean_force = float(bridges.force[:pairs].mean())
    touching = int((bridges.gap[:pairs] <= 0.0).sum())
    return {
        "time": float(motion.time[frame]),
        "surface": surface,
        "surface_low": surface_low,
        "surface_high": surface_high,
        "brazil_nut": segregation(position[:, 2], large),
        "brazil_nut_of_bulk": segregation(position[bulk, 2], large[bulk]),
        "mean_square_velocity": float(np.mean(np.sum(motion.velocity[frame] ** 2, axis=1))),
        "contacts": 2.0 * touching / len(position),
        "bridges": 2.0 * pairs / len(position),
        "touching": touching,
        "opened": pairs - touching,
        "mean_force": mean_force,
        "bulk": int(bulk.sum()),
        "at_wall": int(at_wall.sum()),
        "large_at_wall": int((at_wall & large).sum()),
        "clusters": len(held),
        "highest": highest,
    }


def _surface_cells(
    position: FloatArray, radius: FloatArray, container: Boundary, cell: float
) -> FloatArray:
    """Height of the highest bead top in each x-y cell with beads, m.

    The cells are squares of the container's cross-section, at least as wide as ``cell`` (m).
    """
    cells_across = max(1, int(container.inner_width / cell))
    share_of_width = position[:, :2] / container.inner_width + 0.5
    place = np.clip((share_of_width * cells_across).astype(int), 0, cells_across - 1)
    tops = np.full(cells_across * cells_across, -np.inf)
    np.maximum.at(tops, place[:, 0] * cells_across + place[:, 1], position[:, 2] + radius)
    highest: FloatArray = tops[np.isfinite(tops)]
    return highest


def segregation(height: FloatArray, large: BoolArray) -> float:
    """Compute the Brazil-nut index (⟨z⟩ of large − ⟨z⟩ of small beads) over the sum of both.

    Parameters
    ----------
    height : ndarray, shape (N,)
        Height z of the centres of beads, m.
    large : ndarray of bool, shape (N,)
        Whether a bead is large.

    Returns
    -------
    float
        The index; 0 if there are no large or no small beads.
    """
    if not large.any() or large.all():
        return 0.0
    above = float(height[large].mean())
    below = float(height[~large].mean())
    return (above - below) / (above + below)
