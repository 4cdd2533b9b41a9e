"""The analysis of loose beads in a container: what the bed did, which clusters came free of it and climbed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.postprocess.analysis import Analysis, Columns, Described
from walkers.postprocess.bed import bed_of, coordination_of_inner, liquid_of_beads, packing_profile
from walkers.postprocess.clusters import (
    Climb,
    ClimbCriteria,
    Cluster,
    Track,
    bulk_of,
    classify,
    connected,
    follow,
    held_clusters,
)
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.events import Event, events_of
from walkers.postprocess.motion import Bridges, Motion, read_bridges, read_motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LAYERS = 0.5
"""Thickness of the layers of the packing profile, in diameters of the largest bead."""


@dataclass(frozen=True)
class PileAnalysis:
    """Everything that is measured of a pile.

    Attributes
    ----------
    motion
        Of the beads.
    bed
        The columns of `walkers.postprocess.bed.bed_of`, one row a frame.
    liquid : ndarray, shape (F, N)
        In the bridges of each bead, m³.
    inner
        Contacts and bridges of the beads at no wall (`coordination_of_inner`) at rest, just before the drive.
    bulks, held
        Of each frame, which beads were of the bulk, and the clusters that were free and held (none before the drive).
    tracks, climbs, out_of_pile
        These clusters followed through time, what each of them did, and whether it came out of the pile.
    events
        When they came free, met, parted and ended.
    definition
        What counted as a climb.
    """

    motion: Motion
    bed: Columns
    liquid: FloatArray
    inner: dict[str, float | None]
    bulks: list[npt.NDArray[np.bool_]]
    held: list[list[Cluster]]
    tracks: list[Track] = field(default_factory=list)
    climbs: list[Climb] = field(default_factory=list)
    out_of_pile: list[bool] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    definition: ClimbCriteria = field(default_factory=ClimbCriteria)


def analyse(run: str | Path | Motion, definition: ClimbCriteria | None = None) -> PileAnalysis:
    """Measure a pile, finished or not.

    Parameters
    ----------
    run
        A run directory, or the motion in it.
    definition
        What counts as a climb.

    Raises
    ------
    postprocess.dump.DumpError
        If a dump cannot be read.
    """
    motion = run if isinstance(run, Motion) else read_motion(run)
    case, count = motion.case, len(motion.radius)
    beds, liquid, bulks, held = [], [], [], []
    inner: dict[str, float | None] = {}
    rest = _at_rest(motion)
    for bridges in read_bridges(motion):
        labels = connected(count, bridges.beads)
        bulks.append(bulk_of(labels, bridges, heap=case.mixture is not None))
        liquid.append(liquid_of_beads(motion.radius, case.liquid.volume_fraction, bridges))
        beds.append(bed_of(motion, bulks[-1], bridges, liquid[-1]))
        if bridges.frame == rest:
            inner = coordination_of_inner(bridges, count)
        # While the pile falls and settles, most of it is free of the rest.
        driven = motion.time[bridges.frame] >= 0.0
        held.append(list(held_clusters(labels, bridges, bulks[-1])) if driven else [])
    bed = {name: np.array([one[name] for one in beds]) for name in beds[0]}
    return classified(PileAnalysis(motion, bed, np.stack(liquid), inner, bulks, held), definition or ClimbCriteria())


def _at_rest(motion: Motion) -> int:
    """Number of the last frame before the beads are shaken, at the begin of the drive."""
    return max(int(np.searchsorted(motion.time, 0.0, side="right")) - 1, 0)


def classified(found: PileAnalysis, definition: ClimbCriteria) -> PileAnalysis:
    """The same pile with another definition of a climb."""
    motion = found.motion
    tracks = follow(motion.time, found.held, definition)
    climbs = [classify(track, motion.time, motion.position[:, :, 2], motion.large, definition) for track in tracks]
    out = [_came_out_of_pile(track, found.bulks, motion.first_driven, definition) for track in tracks]
    events = events_of(tracks, motion.time, found.bulks, definition, motion.first_driven)
    return replace(found, tracks=tracks, climbs=climbs, out_of_pile=out, events=events, definition=definition)


def _came_out_of_pile(
    track: Track, bulks: Sequence[npt.NDArray[np.bool_]], first: int, definition: ClimbCriteria
) -> bool:
    """Whether most of a cluster's first beads were in the bulk before it, from the first frame of the drive on."""
    # What was not has hung on a wall since the beads were poured.
    members = list(track.members[0])
    return any(bulk[members].mean() >= definition.min_overlap for bulk in bulks[first : track.frames[0]])


class Pile(Analysis):
    """What loose beads in a container do: the bed, and the clusters that climb."""

    name = "pile"
    version = 5
    tables = ("bed", "clusters", "events", "profile")
    headlines = ("climbs", "highest", "speed")
    derived: ClassVar[Described] = {
        "beads": ("", "number of beads"),
        "large": ("", "number of large beads"),
        "duration": ("s", "shaken"),
    }
    columns: ClassVar[Described] = {
        "climbs": ("", "clusters that climbed a wall"),
        "onset": ("s", "when the first of them began"),
        "speed": ("m/s", "mean of their speeds"),
        "highest": ("m", "height that the highest of them reached"),
        "led_by_large": ("", "how many of them were led by a large bead"),
        "clusters": ("", "clusters that were free of the pile and held to a wall for a while"),
        "surface_end": ("m", "height of the pile's surface at the end"),
        "brazil_nut_end": ("", "Brazil-nut index at the end"),
        "settling": ("s", "before the drive"),
    }
    rows = (
        ("beads", "beads"),
        ("of them large", "large"),
        ("time shaken", "driven", "s"),
        ("time to settle before", "settling", "s"),
        ("height of the surface at the start", "surface.start", "m"),
        ("Brazil-nut index at the start", "brazil_nut.start"),
        ("height of the surface at the end", "surface.end", "m"),
        ("Brazil-nut index at the end", "brazil_nut.end"),
        ("contacts per bead, at rest", "coordination.rest.contacts"),
        ("bridges per bead, at rest", "coordination.rest.bridges"),
        ("contacts per bead, at rest, beads at no wall", "coordination.rest_inner.contacts"),
        ("bridges per bead, at rest, beads at no wall", "coordination.rest_inner.bridges"),
        ("contacts per bead, while shaken", "coordination.shaken.contacts"),
        ("bridges per bead, while shaken", "coordination.shaken.bridges"),
        ("clusters free of the pile and held to a wall", "clusters"),
    )

    def applies(self, case: Case) -> bool:
        """Of loose beads in a container."""
        return case.loose and case.boundary.closed

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """The bed, the clusters, what happened to them, and the packing."""
        found = analyse(motion)
        tables = {
            "bed": _bed_columns(found),
            "clusters": _cluster_columns(found),
            "events": _event_columns(found.events),
            "profile": _profile_columns(found),
        }
        return tables, _result(found)

    def derived_of(self, case: Case) -> dict[str, float]:
        """Numbers of beads and the length of the drive."""
        return {
            "beads": case.count,
            "large": sum(radius > case.border for radius in case.all_radii),
            "duration": case.run.cycles / case.drive.frequency,
        }

    def row(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """Its climbs, and the bed at the end."""
        climbs = result["climbs"]
        speeds = [climb["speed"] for climb in climbs if climb["speed"] is not None]
        return {
            "climbs": len(climbs),
            "onset": min((climb["onset"] for climb in climbs), default=nan),
            "speed": sum(speeds) / len(speeds) if speeds else nan,
            "highest": max((climb["height"] for climb in climbs), default=nan),
            "led_by_large": sum(climb["leader_large"] for climb in climbs),
            "clusters": result["clusters"],
            "surface_end": result["surface"]["end"],
            "brazil_nut_end": result["brazil_nut"]["end"],
            "settling": result["settling"],
        }

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """Did it climb, when, how fast, who led."""
        surface, nuts = result["surface"], result["brazil_nut"]
        lines = [
            f"{result['case']}: {result['beads']} beads ({result['large']} large), {result['drive']}",
            f"  time       {result['driven']:.3g} s shaken, after {result['settling']:.3g} s of settling",
            f"  surface    {surface['start'] * 1e3:.2f} mm at the start, {surface['end'] * 1e3:.2f} mm at the end",
            f"  segregation (z of large - z of small)/sum: {nuts['start']:.3f} at the start, "
            f"{nuts['end']:.3f} at the end",
            *_told_coordination(result["coordination"]),
            f"  clusters   {result['clusters']} were free of the pile and held to a wall for a while"
            + "".join(f", {count} {kind}" for kind, count in result["events"].items()),
            f"  climbs     {len(result['climbs']) or 'none'}",
        ]
        for climb in result["climbs"]:
            speed = "-" if climb["speed"] is None else f"{climb['speed'] * 1e3:.2f}"
            names = " ".join(climb["walls"])
            where = f"in the corner {names}" if len(climb["walls"]) > 1 else f"on the wall {names}"
            lines.append(
                f"    {climb['begin']:.2f} to {climb['end']:.2f} s: {climb['gain'] * 1e3:.2f} mm up to "
                f"{climb['height'] * 1e3:.2f} mm {where} at {speed} mm/s, led by a {_leader(climb)} bead, "
                f"{climb['size']} beads ({climb['large']} large)"
                + ("" if climb["out_of_pile"] else "; it has hung on a wall since the pouring")
            )
        return lines

    def rows_of(self, result: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
        """The same as rows of a table."""
        yield from self.rows
        yield from ((f"of them {event}", f"events.{event}") for event in result["events"])
        for number, climb in enumerate(result["climbs"]):
            place = f"climbs.{number}"
            name = f"climb {number + 1} ({' '.join(climb['walls'])}, led by a {_leader(climb)} bead)"
            for what, unit in {"begin": "s", "end": "s", "gain": "m", "height": "m"}.items():
                yield f"{name}: {what}", f"{place}.{what}", unit
            yield f"{name}: speed", f"{place}.speed", "m/s", f"{place}.standard_error"
            yield f"{name}: beads", f"{place}.size"

    def point_data(self, motion: Motion) -> Callable[[Bridges], Columns]:
        """Cluster and track of each bead, the liquid in its bridges (m³), and whether it climbs."""
        found = analyse(motion)

        def of_frame(bridges: Bridges) -> Columns:
            count = len(motion.radius)
            track, climber = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=np.int64)
            for number, (one, climb) in enumerate(zip(found.tracks, found.climbs, strict=True)):
                if members := list(one.members_at(bridges.frame)):
                    track[members] = number
                    climber[members] = int(climb.climbed)
            component, liquid = connected(count, bridges.beads), found.liquid[bridges.frame].copy()
            return {"component": component, "liquid": liquid, "track": track, "is_climber": climber}

        return of_frame

    def figures(self, directory: Path) -> Mapping[str, Figure]:
        """Heights of the clusters, their events, segregation and agitation."""
        from walkers.postprocess.figures import climb_figure

        return {"climb": climb_figure(analyse(directory))}


def _bed_columns(found: PileAnalysis) -> Columns:
    held = np.zeros(len(found.motion.time), dtype=np.int64)
    highest = found.bed["surface"].copy()
    for track in found.tracks:
        for frame, members in zip(track.frames, track.members, strict=True):
            held[frame] += 1
            highest[frame] = max(highest[frame], found.motion.position[frame, list(members), 2].max())
    return {"time": found.motion.time, **found.bed, "clusters": held, "highest": highest}


_KINDS = {
    np.float64: ("begin", "end", "onset", "qualified", "gain", "speed", "standard_error", "height"),
    np.int64: ("leader", "size", "large"),
    np.bool_: ("climbed",),
}
"""Of what a climb is told by, as columns."""


def _cluster_columns(found: PileAnalysis) -> Columns:
    time, tracks, climbs = found.motion.time, found.tracks, found.climbs
    names = [names_of_walls(climb.walls, found.motion.case.boundary) for climb in climbs]
    merged = [-1 if track.merged_into is None else track.merged_into for track in tracks]
    columns: Columns = {
        name: np.array([getattr(climb, name) for climb in climbs], dtype=kind)
        for kind, keys in _KINDS.items()
        for name in keys
    }
    return columns | {
        "track": np.arange(len(tracks), dtype=np.int64),
        "first": np.array([time[track.frames[0]] for track in tracks], dtype=np.float64),
        "last": np.array([time[track.frames[-1]] for track in tracks], dtype=np.float64),
        "leader_large": found.motion.large[columns["leader"]],
        "above_surface": columns["height"] - found.bed["surface"][np.searchsorted(time, columns["end"])],
        "walls": np.array([len(climb.walls) for climb in climbs], dtype=np.int64),
        "wall_names": np.array(names, dtype=np.str_),
        "merged_into": np.array(merged, dtype=np.int64),
        "out_of_pile": np.array(found.out_of_pile, dtype=np.bool_),
    }


def _event_columns(events: list[Event]) -> Columns:
    return {
        "time": np.array([event.time for event in events], dtype=np.float64),
        "event": np.array([event.kind for event in events], dtype=np.str_),
        "track": np.array([event.track for event in events], dtype=np.int64),
        "other": np.array([-1 if event.other is None else event.other for event in events], dtype=np.int64),
    }


def _profile_columns(found: PileAnalysis) -> Columns:
    motion = found.motion
    driven = _in_second_half(motion)
    layer = _LAYERS * 2.0 * float(motion.radius.max())
    names = ("height", "packing_fraction", "liquid_fraction")
    profile = packing_profile(motion.position[driven], motion.radius, found.liquid[driven], motion.case.boundary, layer)
    return dict(zip(names, profile, strict=True))


def _in_second_half(motion: Motion) -> npt.NDArray[np.bool_]:
    """Which frames are those of the second half of the drive; the last one where it has not begun."""
    late: npt.NDArray[np.bool_] = motion.time >= min(motion.time[motion.first_driven :].mean(), motion.time[-1])
    return late


def _coordination(found: PileAnalysis) -> dict[str, Any]:
    """Contacts and bridges a bead: at rest, then those of the inner beads, and in the second half of the drive."""
    rest, late = _at_rest(found.motion), _in_second_half(found.motion)
    counts = {name: found.bed[name] for name in ("contacts", "bridges")}
    return {
        "rest": {name: float(values[rest]) for name, values in counts.items()},
        "rest_inner": found.inner,
        "shaken": {name: float(np.mean(values[late])) for name, values in counts.items()}
        if found.motion.time[-1] > 0.0
        else None,
    }


def _result(found: PileAnalysis) -> dict[str, Any]:
    motion, start = found.motion, found.motion.first_driven
    ends = {
        name: {"start": float(found.bed[name][start]), "end": float(found.bed[name][-1])}
        for name in ("surface", "brazil_nut")
    }
    return {
        "beads": len(motion.radius),
        "large": int(motion.large.sum()),
        "driven": float(max(motion.time[-1], 0.0)),
        "settling": float(min(motion.time[-1], 0.0) - motion.time[0]),
        **ends,
        "coordination": _coordination(found),
        "clusters": len(found.tracks),
        "events": dict(Counter(event.kind for event in found.events)),
        "climbs": [
            {
                **{name: getattr(climb, name) for name in ("begin", "end", "onset", "qualified", "gain")},
                "speed": climb.speed if np.isfinite(climb.speed) else None,
                "standard_error": climb.standard_error if np.isfinite(climb.standard_error) else None,
                "leader_large": bool(motion.large[climb.leader]),
                **{name: getattr(climb, name) for name in ("height", "size", "large")},
                "walls": names_of_walls(climb.walls, motion.case.boundary).split(),
                "out_of_pile": out_of_pile,
            }
            for climb, out_of_pile in zip(found.climbs, found.out_of_pile, strict=True)
            if climb.climbed
        ],
        "definition": vars(found.definition),
    }


def names_of_walls(walls: tuple[int, ...], boundary: Boundary) -> str:
    """Names of some walls, such as ``-x +y`` for a corner of a box."""
    return " ".join(boundary.walls[wall].name for wall in sorted(walls))


def _leader(climb: Mapping[str, Any]) -> str:
    return "large" if climb["leader_large"] else "small"


def _told_coordination(found: Mapping[str, Any]) -> list[str]:
    rest, inner, shaken = found["rest"], found["rest_inner"], found["shaken"]
    told = [
        f"  bridges    between beads, at rest: {rest['bridges']:.2f} a bead, {rest['contacts']:.2f} of them contacts"
    ]
    if inner["beads"]:
        told[0] += f"; {inner['beads']} beads at no wall have {inner['bridges']:.2f} and {inner['contacts']:.2f}"
    if shaken:
        told.append(
            f"             while shaken: {shaken['bridges']:.2f} a bead, {shaken['contacts']:.2f} of them contacts"
        )
    return told
