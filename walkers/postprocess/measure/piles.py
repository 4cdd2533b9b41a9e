"""Loose beads in a container: the bed, and the clusters that leave it and climb."""

from __future__ import annotations

from collections.abc import Sequence
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


def applies(case: Case) -> bool:
    """Whether a case has loose beads in a container."""
    return case.loose and case.boundary.closed


def derived(case: Case) -> dict[str, float]:
    """Numbers of beads and duration of the drive."""
    return {"beads": case.count, "large": case.large, "duration": case.duration}


def has_climbed(motion: Motion) -> bool:
    """Whether a cluster of a pile has climbed so far."""
    return bool(measure(motion).numbers["climbs"])


def measure(motion: Motion) -> Measurement:
    """Tables and numbers of the bed and of the clusters."""
    case = motion.case
    wall_names = [wall.name for wall in case.boundary.walls]
    floor = clusters.floor_of(wall_names)
    heap = case.mixture is not None
    rows, bulks, held = [], [], []
    for bridges in read_bridges(motion):
        labels = clusters.connected(len(motion.radius), bridges.beads)
        bulks.append(clusters.bulk_of(labels, bridges, heap=heap, floor=floor))
        # While the pile settles, most beads are free of the bulk.
        driven = motion.time[bridges.frame] >= 0.0
        present = clusters.held_clusters(labels, bridges, bulks[-1], floor)
        held.append(list(present) if driven else [])
        rows.append(_state_of(motion, bridges, bulks[-1], held[-1], floor))
    bed = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    beads = PileBeads(
        time=motion.time,
        height=motion.position[..., 2],
        large=motion.large,
        surface=bed["surface"],
        bulk=bulks,
        first=motion.first_driven,
        wall_names=wall_names,
        walls=case.boundary.walls,
        position=motion.position,
    )
    tracks = clusters.follow(motion.time, held)
    climbs = clusters.climbs_of(tracks, beads)
    events = clusters.events_of(tracks, climbs, beads)
    tables = {
        "bed": bed,
        "clusters": climbs,
        "events": events,
        "members": clusters.members_of(tracks, beads),
        "assembly": clusters.assembly_of(tracks, climbs, beads, read_bridges(motion)),
    }
    counts = {f"events_{event}": int(np.sum(events["event"] == event)) for event in clusters.EVENTS}
    numbers = {"clusters": len(tracks), **counts, **_of_climbs(climbs), **_of_bed(motion, bed)}
    ended_by_climb = case.run.until == "climb" and numbers["climbs"] > 0
    if numbers["driven"] < _WHOLE * case.duration and not ended_by_climb:
        early = f"shaken for {numbers['driven']:.3g} s of {case.duration:.3g} s: climbers left the container"
        return Measurement(tables, numbers, (early,))
    return Measurement(tables, numbers)


def _of_climbs(clusters: Columns) -> dict[str, Any]:
    """Numbers of all climbs; NaN without climbs."""
    climbs = {name: column[clusters["climbed"]] for name, column in clusters.items()}
    speeds = climbs["speed"][np.isfinite(climbs["speed"])].tolist()
    return {
        "climbs": len(climbs["track"]),
        "onset": float(min(climbs["onset"], default=nan)),
        "speed": sum(speeds) / len(speeds) if speeds else nan,
        "highest": float(max(climbs["height"], default=nan)),
        "led_by_large": int(climbs["leader_large"].sum()),
    }


def _of_bed(motion: Motion, bed: Columns) -> dict[str, Any]:
    """Numbers of the bed at the start and the end of the drive, at rest, and in the second half of the drive."""
    time, end = motion.time, motion.time[-1]
    rest = max(int(np.searchsorted(time, 0.0, side="right")) - 1, 0)
    late = time >= min(time[motion.first_driven :].mean(), end)
    numbers = {"driven": float(max(end, 0.0)), "settling": float(min(end, 0.0) - time[0])}
    for name in ("surface", "brazil_nut"):
        numbers |= {
            f"{name}_start": float(bed[name][motion.first_driven]),
            f"{name}_end": float(bed[name][-1]),
        }
    for name in ("contacts", "bridges"):
        numbers[f"{name}_at_rest"] = float(bed[name][rest])
        numbers[f"{name}_shaken"] = float(np.mean(bed[name][late])) if end > 0.0 else nan
    return numbers


def tracks_of(motion: Motion) -> tuple[IntArray, BoolArray]:
    """Track of each bead of a pile, -1 for none, and whether it climbs; shape (F, N)."""
    members = read_columns(motion.directory, "members")
    climbed = read_columns(motion.directory, "clusters")["climbed"]
    track = np.full((len(motion.time), motion.case.count), -1, dtype=np.int64)
    frame = np.searchsorted(motion.time, members["time"]).clip(max=len(motion.time) - 1)
    in_motion = motion.time[frame] == members["time"]  # a motion need not have all frames
    track[frame[in_motion], members["bead"][in_motion]] = members["track"][in_motion]
    track = (
        track if motion.bead_numbers is None else track[:, motion.bead_numbers]
    )  # a motion need not have all beads
    return track, np.append(climbed, False)[track]


def _state_of(
    motion: Motion, bridges: Bridges, bulk: BoolArray, held: Sequence[HeldCluster], floor: int
) -> dict[str, Any]:
    """The columns of ``bed`` in a frame."""
    frame = bridges.frame
    at_wall = clusters.at_sides(bridges, len(motion.radius), floor)
    position, radius, large = motion.position[frame], motion.radius, motion.large
    # Cells of the cross-section are about four large radii wide. Without a bulk the floor is the surface.
    tops = _surface_cells(
        position[bulk], radius[bulk], motion.case.boundary, 4.0 * float(radius.max())
    )
    low, middle, high = (
        float(value) for value in np.percentile(tops if len(tops) else [0.0], (10.0, 50.0, 90.0))
    )
    pairs = len(bridges.beads)
    touching = int((bridges.gap[:pairs] <= 0.0).sum())
    return {
        "time": float(motion.time[frame]),
        "surface": middle,
        "surface_low": low,
        "surface_high": high,
        "brazil_nut": segregation(position[:, 2], large),
        "brazil_nut_of_bulk": segregation(position[bulk, 2], large[bulk]),
        "mean_square_velocity": float(np.mean(np.sum(motion.velocity[frame] ** 2, axis=1))),
        "contacts": 2.0 * touching / len(position),
        "bridges": 2.0 * pairs / len(position),
        "touching": touching,
        "opened": pairs - touching,
        "mean_force": float(bridges.force[:pairs].mean()) if pairs else 0.0,
        "bulk": int(bulk.sum()),
        "at_wall": int(at_wall.sum()),
        "large_at_wall": int((at_wall & large).sum()),
        "clusters": len(held),
        "highest": max(
            [middle, *(float(position[bead, 2]) for members, _ in held for bead in members)]
        ),
    }


def _surface_cells(
    position: FloatArray, radius: FloatArray, container: Boundary, cell: float
) -> FloatArray:
    """Height of the highest bead top in each x-y cell with beads, m."""
    across = max(1, int(container.inner_width / cell))
    place = np.clip(
        ((position[:, :2] / container.inner_width + 0.5) * across).astype(int), 0, across - 1
    )
    tops = np.full(across * across, -np.inf)
    np.maximum.at(tops, place[:, 0] * across + place[:, 1], position[:, 2] + radius)
    highest: FloatArray = tops[np.isfinite(tops)]
    return highest


def segregation(height: FloatArray, large: BoolArray) -> float:
    """Brazil-nut index: ⟨z⟩ of large minus ⟨z⟩ of small beads, over their sum; 0 if a class is missing."""
    if not large.any() or large.all():
        return 0.0
    above, below = float(height[large].mean()), float(height[~large].mean())
    return (above - below) / (above + below)
