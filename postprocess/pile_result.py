"""From a pile's run directory to its tables and its result: what the bed did, which clusters climbed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.postprocess.bed import Bed, bed_of, liquid_of_beads, packing_profile
from walkers.postprocess.bridges import Columns
from walkers.postprocess.clusters import (
    Climb,
    ClimbCriteria,
    Cluster,
    Track,
    bulk_of,
    classify,
    components,
    follow,
    held_clusters,
)
from walkers.postprocess.events import Event, events_of
from walkers.postprocess.pile import PileMotion, names_of_walls, read_bridges, read_pile
from walkers.postprocess.result import RESULT_NAME, read_result
from walkers.postprocess.tables import PILE_TABLES, intact, write_table
from walkers.runner.files import write_json

FloatArray = npt.NDArray[np.float64]

METHOD = 2
"""Of judging climbs: a result that was made by another one is made anew."""
_LAYERS = 0.5
"""Thickness of the layers of the packing profile, in diameters of the largest bead."""


@dataclass(frozen=True)
class PileAnalysis:
    """Everything that is measured of a pile.

    Attributes
    ----------
    motion
        Of the beads.
    beds
        One a frame.
    liquid : ndarray, shape (F, N)
        In the bridges of each bead, m³.
    bulks, held
        Of each frame, which beads were of the bulk, and the clusters that were free and held (none before the drive).
    tracks, climbs
        These clusters followed through time, and what each of them did.
    events
        When they came free, met, parted and ended.
    definition
        What counted as a climb.
    """

    motion: PileMotion
    beds: list[Bed]
    liquid: FloatArray
    bulks: list[npt.NDArray[np.bool_]]
    held: list[list[Cluster]]
    tracks: list[Track]
    climbs: list[Climb]
    events: list[Event]
    definition: ClimbCriteria


def analyse(directory: str | Path, definition: ClimbCriteria | None = None) -> PileAnalysis:
    """Measure a pile, finished or not.

    Parameters
    ----------
    directory
        A run directory with its segments.
    definition
        What counts as a climb.

    Raises
    ------
    postprocess.dump.DumpError
        If a dump cannot be read.
    """
    rule = definition or ClimbCriteria()
    motion = read_pile(directory)
    case = motion.case
    beds: list[Bed] = []
    liquid, bulks, held = [], [], []
    for frame, bridges in enumerate(read_bridges(motion)):
        labels = components(len(motion.radius), bridges)
        bulks.append(bulk_of(labels, bridges, heap=not case.beads.placed))
        liquid.append(liquid_of_beads(motion.radius, case.liquid.volume_fraction, bridges))
        beds.append(bed_of(motion, frame, bulks[-1], bridges, liquid[-1]))
        # While the pile falls and settles, most of it is free of the rest.
        driven = motion.time[frame] >= 0.0
        held.append(list(held_clusters(labels, bridges, bulks[-1])) if driven else [])
    return classified(PileAnalysis(motion, beds, np.stack(liquid), bulks, held, [], [], [], rule), rule)


def classified(found: PileAnalysis, definition: ClimbCriteria) -> PileAnalysis:
    """The same pile with another definition of a climb."""
    motion = found.motion
    tracks = follow(motion.time, found.held, definition)
    climbs = [classify(track, motion.time, motion.position[:, :, 2], motion.large, definition) for track in tracks]
    events = events_of(tracks, motion.time, found.bulks, definition, motion.first_driven)
    return replace(found, tracks=tracks, climbs=climbs, events=events, definition=definition)


def tabulate_pile(directory: str | Path, definition: ClimbCriteria | None = None) -> dict[str, Any]:
    """Write the tables and ``result.json`` of a pile.

    Parameters
    ----------
    directory, definition
        As for `analyse`.

    Returns
    -------
    dict
        The result, as in ``result.json``: SI units.
    """
    directory = Path(directory)
    found = analyse(directory, definition)
    write_table(directory, "bed", _bed_columns(found))
    write_table(directory, "clusters", _cluster_columns(found))
    write_table(directory, "events", _event_columns(found.events))
    write_table(directory, "profile", _profile_columns(found))
    outcome = _result(found)
    write_json(directory / RESULT_NAME, outcome)
    return outcome


def current_pile_result(directory: str | Path) -> dict[str, Any]:
    """The result of a pile; tabulated anew if it or a table is gone or damaged."""
    directory = Path(directory)
    try:
        result = read_result(directory)
        usual = result.get("definition") == vars(ClimbCriteria()) and result.get("method") == METHOD
        if usual and result.keys() >= {"climbs", "surface"} and intact(directory, PILE_TABLES):
            return result
    except (OSError, ValueError):
        pass
    return tabulate_pile(directory)


def _bed_columns(found: PileAnalysis) -> Columns:
    held = np.zeros(len(found.beds), dtype=np.int64)
    highest = np.array([bed.surface for bed in found.beds])
    for track in found.tracks:
        for frame, members in zip(track.frames, track.members, strict=True):
            held[frame] += 1
            highest[frame] = max(highest[frame], found.motion.position[frame, list(members), 2].max())
    columns = {name: np.array([getattr(bed, name) for bed in found.beds]) for name in vars(found.beds[0])}
    return {"time": found.motion.time, **columns, "clusters": held, "highest": highest}


def _cluster_columns(found: PileAnalysis) -> Columns:
    time, tracks, climbs = found.motion.time, found.tracks, found.climbs

    def column(values: list[Any], kind: npt.DTypeLike) -> npt.NDArray[Any]:
        return np.array(values, dtype=kind)

    surface = np.array([bed.surface for bed in found.beds])
    at_end = np.searchsorted(time, [climb.end for climb in climbs])
    columns: Columns = {
        "track": np.arange(len(tracks), dtype=np.int64),
        "first": column([time[track.frames[0]] for track in tracks], np.float64),
        "last": column([time[track.frames[-1]] for track in tracks], np.float64),
        "leader_large": column([found.motion.large[climb.leader] for climb in climbs], np.bool_),
        "above_surface": column([climb.height for climb in climbs], np.float64) - surface[at_end],
        "walls": column([len(climb.walls) for climb in climbs], np.int64),
        "merged_into": column([-1 if track.merged_into is None else track.merged_into for track in tracks], np.int64),
    }
    columns["wall_names"] = np.array(
        [names_of_walls(climb.walls, found.motion.case) for climb in climbs], dtype=np.str_
    )
    for name in ("begin", "end", "gain", "speed", "standard_error", "height"):
        columns[name] = column([getattr(climb, name) for climb in climbs], np.float64)
    for name in ("leader", "size", "large"):
        columns[name] = column([getattr(climb, name) for climb in climbs], np.int64)
    columns["climbed"] = column([climb.climbed for climb in climbs], np.bool_)
    return columns


def _event_columns(events: list[Event]) -> Columns:
    return {
        "time": np.array([event.time for event in events], dtype=np.float64),
        "event": np.array([event.kind for event in events], dtype=np.str_),
        "track": np.array([event.track for event in events], dtype=np.int64),
        "other": np.array([-1 if event.other is None else event.other for event in events], dtype=np.int64),
    }


def _profile_columns(found: PileAnalysis) -> Columns:
    motion = found.motion
    driven = motion.time >= min(motion.time[motion.first_driven :].mean(), motion.time[-1])
    layer = _LAYERS * 2.0 * float(motion.radius.max())
    names = ("height", "packing_fraction", "liquid_fraction")
    profile = packing_profile(
        motion.position[driven], motion.radius, found.liquid[driven], motion.case.container, layer
    )
    return dict(zip(names, profile, strict=True))


def _result(found: PileAnalysis) -> dict[str, Any]:
    motion, beds = found.motion, found.beds
    case = motion.case
    start = motion.first_driven
    return {
        "case": case.name,
        "kind": "pile",
        "units": "SI: m, s, m/s",
        "beads": len(motion.radius),
        "large": int(motion.large.sum()),
        "frequency": case.drive.frequency,
        "peak_acceleration": case.drive.peak_acceleration,
        "driven": float(max(motion.time[-1], 0.0)),
        "settling": float(min(motion.time[-1], 0.0) - motion.time[0]),
        "surface": {"start": beds[start].surface, "end": beds[-1].surface},
        "brazil_nut": {"start": beds[start].brazil_nut, "end": beds[-1].brazil_nut},
        "clusters": len(found.tracks),
        "events": dict(Counter(event.kind for event in found.events)),
        "climbs": [
            {
                "begin": climb.begin,
                "end": climb.end,
                "gain": climb.gain,
                "speed": climb.speed if np.isfinite(climb.speed) else None,
                "standard_error": climb.standard_error if np.isfinite(climb.standard_error) else None,
                "leader_large": bool(motion.large[climb.leader]),
                "height": climb.height,
                "size": climb.size,
                "large": climb.large,
                "walls": names_of_walls(climb.walls, case).split(),
            }
            for climb in found.climbs
            if climb.climbed
        ],
        "definition": vars(found.definition),
        "method": METHOD,
    }


def describe_pile(directory: Path, result: dict[str, Any], *, cached: bool = False) -> str:
    """The result of a pile in a few lines: did it climb, when, how fast, who led; mm and mm/s."""
    surface, nuts = result["surface"], result["brazil_nut"]
    lines = [
        f"{result['case']}: {result['beads']} beads ({result['large']} large), {result['frequency']:g} Hz, "
        f"a0 = {result['peak_acceleration']:.4g} m/s²" + (" (already run)" if cached else ""),
        f"  time       {result['driven']:.3g} s shaken, after {result['settling']:.3g} s of settling",
        f"  surface    {surface['start'] * 1e3:.2f} mm at the start, {surface['end'] * 1e3:.2f} mm at the end",
        f"  segregation (z of large - z of small)/sum: {nuts['start']:.3f} at the start, {nuts['end']:.3f} at the end",
        f"  clusters   {result['clusters']} were free of the pile and held to a wall for a while"
        + "".join(f", {count} {kind}" for kind, count in result["events"].items()),
        f"  climbs     {len(result['climbs']) or 'none'}",
    ]
    for climb in result["climbs"]:
        speed = "-" if climb["speed"] is None else f"{climb['speed'] * 1e3:.2f}"
        names = " ".join(climb["walls"])
        where = f"in the corner {names}" if len(climb["walls"]) > 1 else f"on the wall {names}"
        leader = "large" if climb["leader_large"] else "small"
        lines.append(
            f"    {climb['begin']:.2f} to {climb['end']:.2f} s: {climb['gain'] * 1e3:.2f} mm up to "
            f"{climb['height'] * 1e3:.2f} mm {where} at {speed} mm/s, led by a {leader} bead, "
            f"{climb['size']} beads ({climb['large']} large)"
        )
    return "\n".join([*lines, f"  run        {directory}"])
