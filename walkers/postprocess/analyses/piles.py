"""Analysis of loose beads in a container: the bed, and the clusters that leave it and climb."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import nan
from typing import Any, ClassVar

import numpy as np

from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.postprocess.analysis import Analysis, Described, Quantity
from walkers.postprocess.clusters import (
    Beads,
    ClimbCriteria,
    Cluster,
    Joined,
    assembly_of,
    bulk_of,
    climbs_of,
    connected,
    events_of,
    follow,
    held_clusters,
    members_of,
)
from walkers.postprocess.dump import BoolArray, FloatArray, IntArray
from walkers.postprocess.motion import FLOOR, Bridges, Motion, read_bridges
from walkers.postprocess.tables import Columns, read_columns


class Pile(Analysis):
    """Piles of loose beads in a container: the bed, and the clusters that climb."""

    order = 2
    name = "pile"
    tables = ("bed", "clusters", "events", "members", "assembly")
    derived: ClassVar[Described] = {
        "beads": ("", "number of beads"),
        "large": ("", "number of large beads"),
        "duration": ("s", "duration of the drive"),
    }

    def applies(self, case: Case) -> bool:
        """Cases with loose beads in a container."""
        return case.loose and case.boundary.closed

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Tables and result: bed, clusters, events."""
        case, first, definition = motion.case, motion.first_driven, ClimbCriteria()
        rows, bulks, held, joined = [], [], [], []
        for bridges in read_bridges(motion):
            labels = connected(len(motion.radius), bridges.beads)
            bulks.append(bulk_of(labels, bridges, heap=case.mixture is not None))
            # While the pile settles, most beads are free of the bulk.
            driven = motion.time[bridges.frame] >= 0.0
            held.append(list(held_clusters(labels, bridges, bulks[-1])) if driven else [])
            joined.append(_joined(bridges, len(motion.radius)))
            rows.append(_bed(motion, bridges, joined[-1], bulks[-1], held[-1]))
        bed = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        names = [wall.name for wall in case.boundary.walls]
        beads = Beads(motion.time, motion.position[..., 2], motion.large, bed["surface"], bulks, first, names)
        tracks = follow(motion.time, held, definition)
        climbs = climbs_of(tracks, beads, definition)
        tables = {
            "bed": bed,
            "clusters": climbs,
            "events": events_of(tracks, climbs, beads, definition),
            "members": members_of(tracks, beads),
            "assembly": assembly_of(tracks, climbs, beads, joined),
        }
        return tables, {
            **_bed_result(motion, bed),
            "clusters": len(tracks),
            "events": dict(Counter(tables["events"]["event"].tolist())),
            "climbs": [_climb_row(climbs, place) for place in np.flatnonzero(climbs["climbed"]).tolist()],
            "rim": case.boundary.height,
            "duration": case.duration,
            "definition": vars(definition),
        }

    def derived_of(self, case: Case) -> dict[str, float]:
        """Numbers of beads and duration of the drive."""
        return {"beads": case.count, "large": case.large, "duration": case.duration}

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """Quantities of all climbs, of the bed, and of each climb."""

        def of_climbs(fold: Callable[[list[Any]], Any], key: str) -> Callable[[Mapping[str, Any]], Any]:
            """A function that reduces a number of all climbs; NaN without climbs."""

            def folded(result: Mapping[str, Any]) -> Any:
                values = [climb[key] for climb in result["climbs"] if climb[key] is not None]
                return fold(values) if values or fold is sum else nan

            return folded

        yield Quantity("climbs", "", "", "climbs", "number of climbs", of=lambda one: len(one["climbs"]))
        yield Quantity("climbs", "", "s", "onset", "start of the first climb", of=of_climbs(min, "onset"))
        mean = of_climbs(lambda speeds: sum(speeds) / len(speeds), "speed")
        yield Quantity("climbs", "", "m/s", "speed", "mean speed of the climbs", of=mean)
        highest = of_climbs(max, "height")
        yield Quantity("climbs", "", "m", "highest", "largest height of a climb", of=highest)
        text, led = "number of climbs led by a large bead", of_climbs(sum, "leader_large")
        yield Quantity("climbs", "", "", "led_by_large", text, of=led)
        yield Quantity("beads", "beads")
        yield Quantity("large", "large beads")
        yield Quantity("driven", "time of shaking", "s")
        text = "number of clusters that are free of the pile and held by a wall"
        yield Quantity("clusters", "clusters free of the pile and held by a wall", "", "clusters", text)
        for event in result.get("events", ()):
            yield Quantity(f"events.{event}", f"clusters {event}")
        yield Quantity("surface.start", "height of the surface at the start", "m")
        label = "height of the surface at the end"
        yield Quantity("surface.end", label, "m", "surface_end", "height of the pile's surface at the end")
        yield Quantity("brazil_nut.start", "Brazil-nut index at the start")
        label = "Brazil-nut index at the end"
        yield Quantity("brazil_nut.end", label, "", "brazil_nut_end", label)
        yield Quantity("settling", "settling time", "s", "settling", "settling time before the drive")
        whens = {"rest": "at rest", "shaken": "while shaken"}
        for when, text in whens.items():
            for what in ("contacts", "bridges"):
                yield Quantity(f"coordination.{when}.{what}", f"{what} per bead, {text}")
        for number, climb in enumerate(result.get("climbs", ())):
            place = f"climbs.{number}"
            name = f"climb {number + 1} ({' '.join(climb['walls'])}, led by a {_leader(climb)} bead)"
            for what, unit in {"begin": "s", "end": "s", "gain": "m", "height": "m"}.items():
                yield Quantity(f"{place}.{what}", f"{name}: {what}", unit)
            yield Quantity(f"{place}.speed", f"{name}: speed", "m/s")
            yield Quantity(f"{place}.size", f"{name}: beads")

    def point_data(self, motion: Motion) -> Callable[[Bridges], Columns]:
        """Cluster and track of each bead, and whether it climbs."""
        track, climber = tracks_of(motion)

        def of_frame(bridges: Bridges) -> Columns:
            component = connected(len(motion.radius), bridges.beads)
            own = {"track": track[bridges.frame], "is_climber": climber[bridges.frame].astype(np.int64)}
            return {"component": component, **own}

        return of_frame


def _late(motion: Motion) -> BoolArray:
    """Frames of the second half of the drive; the last frame if the drive has not begun."""
    late: BoolArray = motion.time >= min(motion.time[motion.first_driven :].mean(), motion.time[-1])
    return late


def _bed_result(motion: Motion, bed: Columns) -> dict[str, Any]:
    """The bed in a result."""
    first, end = motion.first_driven, motion.time[-1]
    rest = max(int(np.searchsorted(motion.time, 0.0, side="right")) - 1, 0)
    ends = ("surface", "brazil_nut")
    counts = {name: bed[name] for name in ("contacts", "bridges")}
    shaken = {name: float(np.mean(values[_late(motion)])) for name, values in counts.items()}
    return {
        "beads": len(motion.radius),
        "large": int(motion.large.sum()),
        "driven": float(max(end, 0.0)),
        "settling": float(min(end, 0.0) - motion.time[0]),
        **{name: {"start": float(bed[name][first]), "end": float(bed[name][-1])} for name in ends},
        "coordination": {
            "rest": {name: float(values[rest]) for name, values in counts.items()},
            "shaken": shaken if end > 0.0 else None,
        },
    }


def _climb_row(climbs: Columns, place: int) -> dict[str, Any]:
    names = ("begin", "end", "onset", "qualified", "gain", "speed", "standard_error", "leader_large", "height")
    known = {name: climbs[name][place].item() for name in (*names, "size", "large")}
    finite = {name: value if np.isfinite(value) else None for name, value in known.items()}
    last = {"leader": int(climbs["leader"][place]), "walls": str(climbs["wall_names"][place]).split()}
    return {**finite, **last, "out_of_pile": bool(climbs["out_of_pile"][place])}


def tracks_of(motion: Motion) -> tuple[IntArray, BoolArray]:
    """Track of each bead of a pile, -1 for none, and whether it climbs; shape (F, N)."""
    members = read_columns(motion.directory, "members")
    climbed = read_columns(motion.directory, "clusters")["climbed"]
    track = np.full(motion.position.shape[:2], -1, dtype=np.int64)
    frame = np.searchsorted(motion.time, members["time"]).clip(max=len(motion.time) - 1)
    there = motion.time[frame] == members["time"]  # a motion need not have all frames
    track[frame[there], members["bead"][there]] = members["track"][there]
    return track, np.append(climbed, False)[track]


def _leader(climb: Mapping[str, Any]) -> str:
    return "large" if climb["leader_large"] else "small"


def _joined(bridges: Bridges, count: int) -> Joined:
    """The joined beads of a frame."""
    at_wall = np.zeros(count, dtype=np.bool_)
    at_wall[bridges.wall_beads[bridges.walls != FLOOR]] = True
    return bridges.beads.astype(np.int32), at_wall


def _bed(motion: Motion, bridges: Bridges, joined: Joined, bulk: BoolArray, held: Sequence[Cluster]) -> dict[str, Any]:
    """State of a pile in a frame from its bulk and the held clusters."""
    frame = bridges.frame
    position, radius, large = motion.position[frame], motion.radius, motion.large
    # Cells of the cross-section are about four large radii wide. Without a bulk the floor is the surface.
    tops = _surface_cells(position[bulk], radius[bulk], motion.case.boundary, 4.0 * float(radius.max()))
    low, middle, high = (float(value) for value in np.percentile(tops if len(tops) else [0.0], (10.0, 50.0, 90.0)))
    touching = int((bridges.gap <= 0.0).sum())
    return {
        "time": float(motion.time[frame]),
        "surface": middle,
        "surface_low": low,
        "surface_high": high,
        "brazil_nut": segregation(position[:, 2], large),
        "brazil_nut_of_bulk": segregation(position[bulk, 2], large[bulk]),
        "mean_square_velocity": float(np.mean(np.sum(motion.velocity[frame] ** 2, axis=1))),
        "contacts": 2.0 * touching / len(position),
        "bridges": 2.0 * len(bridges.beads) / len(position),
        "touching": touching,
        "opened": len(bridges.gap) - touching,
        "mean_force": float(bridges.force.mean()) if len(bridges.force) else 0.0,
        "bulk": int(bulk.sum()),
        "at_wall": int(joined[1].sum()),
        "large_at_wall": int((joined[1] & large).sum()),
        "clusters": len(held),
        "highest": max([middle, *(float(position[bead, 2]) for members, _ in held for bead in members)]),
    }


def _surface_cells(position: FloatArray, radius: FloatArray, container: Boundary, cell: float) -> FloatArray:
    """Height of the highest bead top in each x-y cell with beads, m."""
    across = max(1, int(container.width / cell))
    place = np.clip(((position[:, :2] / container.width + 0.5) * across).astype(int), 0, across - 1)
    tops = np.full(across * across, -np.inf)
    np.maximum.at(tops, place[:, 0] * across + place[:, 1], position[:, 2] + radius)
    found: FloatArray = tops[np.isfinite(tops)]
    return found


def segregation(height: FloatArray, large: BoolArray) -> float:
    """Brazil-nut index: ⟨z⟩ of large minus ⟨z⟩ of small beads, over their sum; 0 if a class is missing."""
    if not large.any() or large.all():
        return 0.0
    above, below = float(height[large].mean()), float(height[~large].mean())
    return (above - below) / (above + below)
