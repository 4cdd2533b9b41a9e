"""Clusters that are free of the pile: tracks through time, events, and climbs.

Bridges, touching or open, divide the beads of a pile into connected components. The *bulk* is the largest component
together with all components that are bridged to the floor; some vessels have no floor. A *cluster* is a component of at
least two beads that is *free*, that is, not part of the bulk. It is *held* if a bridge joins one of its beads to a side
wall. A *track* follows a cluster through time: in each frame it continues with the cluster that shares most of its
beads. A track does not end if the cluster touches the pile or loses the wall for at most `MAX_GAP`.

A *climb* is a track that rises by at least `MIN_RISE` while its cluster is free and held. The rise
between two successive frames is the change of the mean height of the beads that the cluster has in both, so that beads
that join or leave do not count. A column that detaches high and sinks does not climb, nor does a bead in the air, which
is not held.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise, takewhile
from typing import Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.shapes.walls import FLOOR as FLOOR_NAME
from walkers.inputs.tables.shapes.walls import Wall
from walkers.postprocess.measure.motion import FLOOR_INDEX, Bridges
from walkers.postprocess.measure.tables import Columns, columns_of

HeldCluster = tuple[frozenset[int], frozenset[int]]
"""Beads of a cluster in a frame, and side walls that hold it."""

MIN_RISE = 2e-3
"""Smallest rise of a climb, m: about two diameters of the paper's large beads."""
MAX_REST = 5e-5
"""Heights that differ by less, m, are equal when the start and the end of a rise are sought.

Clusters that hang on a shaken wall are as high in each frame within about 5e-6 m. A climb at 3 mm/s gains 5e-5 m from
one frame to the next.
"""
MAX_GAP = 0.1
"""Longest time, s, for which a cluster may touch the pile or lose the wall within a track."""
MIN_OVERLAP = 0.5
"""Smallest share of common beads (of the smaller cluster) in successive clusters of a track."""
NO_FLOOR = -1
"""Index of the floor of a vessel whose walls are all side walls."""
EVENTS = ("freed", "split", "merged", "rejoined", "detached")
"""Events of clusters, see `events_of`."""
_FEWEST_BEADS = 2
_FEWEST_FRAMES = 3
_CORNER_COSINE = 0.7072
"""Cosine of 45°, the smallest angle between the normals of two walls that form a corner."""
_MOST_BLOCKS, _FEWEST_BLOCKS = 10, 4
"""Number of parts of a climb for the standard error of its speed."""


@dataclass
class Track:
    """A cluster through time: frames in which it is free and held, its beads and side walls; where it merged, or -1."""

    frames: list[int] = field(default_factory=list)
    members: list[frozenset[int]] = field(default_factory=list)
    walls: list[frozenset[int]] = field(default_factory=list)
    merged_into: int = -1
    merged_at: int = -1


def connected(count: int, pairs: IntArray) -> IntArray:
    """Index of the connected component of each item, shape (count,), from joined pairs, shape (K, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array(
        (np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count)
    )
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def floor_of(wall_names: Sequence[str]) -> int:
    """Index of the floor among the walls of a container; `NO_FLOOR` in a vessel without one, such as a trough."""
    return FLOOR_INDEX if wall_names[FLOOR_INDEX] == FLOOR_NAME else NO_FLOOR


def bulk_of(
    labels: IntArray, bridges: Bridges, *, heap: bool = True, floor: int = FLOOR_INDEX
) -> BoolArray:
    """Whether beads are part of the bulk, shape (N,).

    Without a ``heap`` (placed beads) the largest component may be a cluster on a wall, and does not count.
    """
    beads, walls = bridges.at_walls
    on_floor = labels[beads[walls == floor]]
    most = [np.bincount(labels).argmax()] if heap else []
    return np.isin(labels, [*most, *on_floor])


def at_sides(bridges: Bridges, count: int, floor: int = FLOOR_INDEX) -> BoolArray:
    """Whether a bridge joins a bead to a side wall, shape (count,)."""
    beads, walls = bridges.at_walls
    return np.isin(np.arange(count), beads[walls != floor])


def held_clusters(
    labels: IntArray, bridges: Bridges, bulk: BoolArray, floor: int = FLOOR_INDEX
) -> Iterator[HeldCluster]:
    """The clusters that are free and held in a frame."""
    beads, walls = bridges.at_walls[:, bridges.at_walls[1] != floor]
    for label in np.unique(labels[beads[~bulk[beads]]]):
        members = np.flatnonzero(labels == label)
        if len(members) >= _FEWEST_BEADS:
            yield frozenset(members.tolist()), frozenset(walls[np.isin(beads, members)].tolist())


def follow(time: FloatArray, clusters: Iterable[Sequence[HeldCluster]]) -> list[Track]:
    """Tracks of the clusters of all frames (`held_clusters`; time in s, shape (F,)), in the order of their begins."""
    tracks: list[Track] = []
    alive: list[int] = []
    for frame, present in enumerate(clusters):
        alive = [
            number for number in alive if time[frame] - time[tracks[number].frames[-1]] <= MAX_GAP
        ]
        # The larger overlap first: of two tracks that merge, the one with more beads continues.
        shared = []
        for number in alive:
            before = tracks[number].members[-1]
            for place, (members, _) in enumerate(present):
                common = len(before & members)
                if common >= MIN_OVERLAP * min(len(before), len(members)):
                    shared.append((common, -number, place))
        taken: dict[int, int] = {}
        ended = set()
        for _, negative, place in sorted(shared, reverse=True):
            number = -negative
            if number in taken.values() or number in ended:
                continue
            if place in taken:
                tracks[number].merged_into, tracks[number].merged_at = taken[place], frame
                ended.add(number)
            else:
                taken[place] = number
        alive = [number for number in alive if number not in ended]
        for place, (members, walls) in enumerate(present):
            if place not in taken:
                taken[place] = len(tracks)
                alive.append(len(tracks))
                tracks.append(Track())
            track = tracks[taken[place]]
            track.frames.append(frame)
            track.members.append(members)
            track.walls.append(walls)
    return tracks


@dataclass(frozen=True)
class PileBeads:
    """Beads of a pile: time (s, shape (F,)), height (m, shape (F, N)), which are large; first frame of the drive.

    ``surface`` and ``bulk`` are the height of the surface and the beads of the bulk in each frame.
    """

    time: FloatArray
    height: FloatArray
    large: BoolArray
    surface: FloatArray
    bulk: Sequence[BoolArray]
    first: int
    wall_names: Sequence[str]
    walls: Sequence[Wall] = ()
    position: FloatArray | None = None


def _left_bulk(track: Track, beads: PileBeads) -> bool:
    """Whether the first beads were in the bulk for some time; others have hung on a wall since before the drive."""
    before, members = slice(beads.first, track.frames[0]), list(track.members[0])
    in_bulk = [bulk[members].mean() >= MIN_OVERLAP for bulk in beads.bulk[before]]
    seconds = np.diff(beads.time[beads.first : track.frames[0] + 1])[in_bulk].sum()
    return bool(seconds >= MAX_GAP)


def _walls_apart(walls: Sequence[int], frame: int, members: Sequence[int], beads: PileBeads) -> int:
    """Number of walls at a cluster whose normals differ by 45° or more; two in a corner.

    A round vessel of a mesh has many faces: a cluster that touches two of them is not in a corner.
    """
    if beads.position is None:
        return len(walls)
    middle = beads.position[frame, members].mean(axis=0)
    apart: list[FloatArray] = []
    for wall in walls:
        normal = beads.walls[wall].normals(middle)
        if all(normal @ normal_before < _CORNER_COSINE for normal_before in apart):
            apart.append(normal)
    return len(apart)


def climbs_of(tracks: Sequence[Track], beads: PileBeads) -> Columns:
    """Table ``clusters``: the largest rise of each track of `follow`, and whether the track is a climb.

    The largest rise goes from the lowest height to the greatest one after it. A cluster may hang still before and after
    the rise, and this time must not count in the speed. The rise therefore begins in the last frame that is within
    `MAX_REST` of its lowest height, and ends in the first frame thereafter that is within `MAX_REST` of its top. The
    speed is the mean between these two frames; the gain is that from the lowest height to the top.

    A rise maximises the gain: the speed of a short and unsteady climb is too large. Its standard error, of the mean
    over up to ten equal parts, is too small if the speed changes more slowly. ``onset`` and ``qualified`` do not depend
    on later frames: up to a given time, records of any length contain the same climbs.
    """
    rows = [_climb_of(number, track, beads) for number, track in enumerate(tracks)]
    return {
        name: np.array([row[name] for row in rows], dtype=kind) for name, kind in _KINDS.items()
    }


_KINDS = {
    "track": int,
    **dict.fromkeys(("first", "last", "begin", "end"), float),
    "out_of_pile": bool,
    **dict.fromkeys(("onset", "qualified", "gain", "speed", "standard_error"), float),
    "climbed": bool,
    "leader": int,
    "leader_large": bool,
    **dict.fromkeys(("height", "above_surface"), float),
    **dict.fromkeys(("size", "large", "walls"), int),
    "wall_names": str,
    "merged_into": int,
}


def _climb_of(number: int, track: Track, beads: PileBeads) -> dict[str, Any]:
    frames, height = np.array(track.frames), beads.height
    gained, seconds = _gained(track, beads.time, height)
    risen = gained - np.minimum.accumulate(gained)
    top = int(np.argmax(risen))
    first = int(_starts_of_rises(gained)[top])
    last = _end_of_rise(gained, first, top)
    rise, end = slice(first, last + 1), frames[last]
    onset, qualified = (
        beads.time[frames[moments]] if (moments := _qualified(gained)) else (np.nan, np.nan)
    )
    speed, error = _speed(seconds[rise], gained[rise])
    topmost = (
        max(members, key=lambda bead: height[frame, bead])
        for frame, members in zip(track.frames[rise], track.members[rise], strict=True)
    )
    leader, walls = Counter(topmost).most_common(1)[0][0], sorted(track.walls[last])
    return {
        "track": number,
        "first": beads.time[frames[0]],
        "last": beads.time[frames[-1]],
        "begin": beads.time[frames[first]],
        "end": beads.time[end],
        "out_of_pile": _left_bulk(track, beads),
        "onset": onset,
        "qualified": qualified,
        "gain": risen[top],
        "speed": speed,
        "standard_error": error,
        "climbed": moments is not None,
        "leader": leader,
        "leader_large": beads.large[leader],
        "height": height[end, leader],
        "above_surface": height[end, leader] - beads.surface[end],
        "size": len(track.members[last]),
        "large": beads.large[list(track.members[last])].sum(),
        "walls": _walls_apart(walls, end, sorted(track.members[last]), beads),
        "wall_names": ", ".join(beads.wall_names[wall] for wall in walls),
        "merged_into": track.merged_into,
    }


def _starts_of_rises(gained: FloatArray) -> IntArray:
    """Of each frame the last one up to it that is as high as the lowest until then, within `MAX_REST`."""
    lowest = np.minimum.accumulate(gained)
    is_start = gained <= lowest + MAX_REST
    starts: IntArray = np.maximum.accumulate(np.where(is_start, np.arange(len(gained)), 0))
    return starts


def _end_of_rise(gained: FloatArray, start: int, top: int) -> int:
    """The first frame from the start of a rise on that is as high as its top, within `MAX_REST`."""
    is_high = gained[start : top + 1] >= gained[top] - MAX_REST
    return start + int(np.argmax(is_high))


def _qualified(gained: FloatArray) -> list[int] | None:
    """Start of the rise that makes a track a climb, and the frame at which it qualifies; None without a climb.

    Its height above its lowest is then a maximum so far, and at least `MIN_RISE`; a hop between two frames is no climb.
    """
    risen = gained - np.minimum.accumulate(gained)
    starts = _starts_of_rises(gained)
    is_farthest = risen == np.maximum.accumulate(risen)
    for frame in np.flatnonzero(is_farthest & (risen >= MIN_RISE)).tolist():
        start = int(starts[frame])
        frames_of_rise = _end_of_rise(gained, start, frame) - start + 1
        if frames_of_rise >= _FEWEST_FRAMES:
            return [start, frame]
    return None


def _gained(track: Track, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rise since the first frame of a track (m) and its duration (s), shape (frames of the track,).

    In gaps between frames neither a gain of height nor the time counts; a loss of height does.
    """
    rises, seconds = [0.0], [0.0]
    for place, (before, now) in enumerate(pairwise(track.frames)):
        common = list(track.members[place] & track.members[place + 1])
        rise = float((height[now, common] - height[before, common]).mean()) if common else 0.0
        follows = now == before + 1
        rises.append(rise if follows else min(rise, 0.0))
        seconds.append(float(time[now] - time[before]) if follows else 0.0)
    return np.cumsum(rises), np.cumsum(seconds)


def _speed(seconds: FloatArray, gained: FloatArray) -> tuple[float, float]:
    """Speed and its standard error from equal parts; NaN with too few frames."""
    whole = seconds[-1] - seconds[0]
    if len(gained) < _FEWEST_FRAMES or whole == 0.0:
        return np.nan, np.nan
    speed = float((gained[-1] - gained[0]) / whole)
    blocks = min(_MOST_BLOCKS, len(gained) - 1)
    edges = np.linspace(0, len(gained) - 1, blocks + 1).round().astype(int)
    lasted, risen = np.diff(seconds[edges]), np.diff(gained[edges])
    timed = lasted > 0.0
    if timed.sum() < _FEWEST_BLOCKS:
        return speed, np.nan
    speeds, shares = risen[timed] / lasted[timed], lasted[timed] / lasted[timed].sum()
    return speed, float(
        np.sqrt((shares**2 * (speeds - speed) ** 2).sum() * timed.sum() / (timed.sum() - 1))
    )


def members_of(tracks: Sequence[Track], beads: PileBeads) -> Columns:
    """Table ``members``: by frame, and in a frame in the order in which `held_clusters` gives clusters."""
    clusters = sorted(
        (frame, sorted(members), number)
        for number, track in enumerate(tracks)
        for frame, members in zip(track.frames, track.members, strict=True)
    )
    return _of_beads(
        columns_of(
            ((frame, number, bead) for frame, members, number in clusters for bead in members),
            frame=int,
            track=int,
            bead=int,
        ),
        beads,
    )


def _of_beads(columns: Columns, beads: PileBeads) -> Columns:
    """Columns with the time of their frames, and class and height of their beads."""
    frame, bead = columns.pop("frame"), columns["bead"]
    return columns | {
        "time": beads.time[frame],
        "large": beads.large[bead],
        "height": beads.height[frame, bead],
    }


def assembly_of(
    tracks: Sequence[Track], climbs: Columns, beads: PileBeads, bridges: Iterable[Bridges]
) -> Columns:
    """Table ``assembly``: state of the beads of each climb in each frame, from rest until it qualifies.

    Of the ``bridges`` of all frames those after the last of these are not asked for.
    """
    climbing = np.flatnonzero(climbs["climbed"]).tolist()
    ends = np.searchsorted(beads.time, climbs["qualified"][climbing]).tolist()
    members_of_climbs = [
        np.array(sorted(tracks[number].members[tracks[number].frames.index(until)]))
        for number, until in zip(climbing, ends, strict=True)
    ]
    rows: list[list[tuple[Any, ...]]] = [[] for _ in climbing]
    for now in takewhile(lambda now: now.frame <= max(ends), bridges if ends else ()):
        walled = at_sides(now, len(beads.large), floor_of(beads.wall_names))
        for number, until, members, of_climb in zip(
            climbing, ends, members_of_climbs, rows, strict=True
        ):
            if not max(beads.first - 1, 0) <= now.frame <= until:
                continue
            within = np.searchsorted(members, now.beads[np.isin(now.beads, members).all(axis=1)])
            labels, neighbours = (
                connected(len(members), within),
                np.bincount(within.ravel(), minlength=len(members)),
            )
            joined = (labels == np.bincount(labels).argmax()) & (neighbours > 0)
            states = (members, beads.bulk[now.frame][members], walled[members], neighbours, joined)
            of_climb += [(now.frame, number, *state) for state in zip(*states, strict=True)]
    kinds = {
        "frame": int,
        "track": int,
        "bead": int,
        "in_bulk": bool,
        "at_wall": bool,
        "neighbours": int,
    }
    return _of_beads(columns_of(chain.from_iterable(rows), **kinds, joined=bool), beads)


def events_of(tracks: Sequence[Track], climbs: Columns, beads: PileBeads) -> Columns:
    """Table ``events`` in the order of time, without clusters at the start of the drive and those that may still go on.

    A cluster is ``freed`` (it leaves the pile or reaches a wall), ``split`` from another cluster, ``merged`` into
    another cluster, ``rejoined`` (it returns to the pile) or ``detached`` (it loses the walls, or its beads separate).
    """
    time = beads.time
    rows: list[tuple[int, int, int, str]] = []
    for number, track in enumerate(tracks):
        born, last, parent = track.frames[0], track.frames[-1], _parent(tracks, number, time)
        if parent >= 0:
            rows.append((born, number, parent, "split"))
        elif born > beads.first:
            rows.append((born, number, -1, "freed"))
        if track.merged_into >= 0:
            rows.append((track.merged_at, number, track.merged_into, "merged"))
        elif time[-1] - time[last] > MAX_GAP:
            # It rejoined the pile if most of its beads were in the bulk before the track ended.
            until = min(
                int(np.searchsorted(time, time[last] + MAX_GAP, side="right")), len(time) - 1
            )
            members, after = list(track.members[-1]), beads.bulk[last + 1 : until + 1]
            back = any(bulk[members].mean() >= MIN_OVERLAP for bulk in after)
            rows.append((last + 1, number, -1, "rejoined" if back else "detached"))
    events = columns_of(sorted(rows), frame=int, track=int, other=int, event=str)
    frame = events.pop("frame")
    return events | {
        "time": time[frame],
        "height": beads.height[frame, climbs["leader"][events["track"]]],
    }


def _parent(tracks: Sequence[Track], number: int, time: FloatArray) -> int:
    """The track that had most of the beads of a track shortly before its begin; -1 for none."""
    first, members = tracks[number].frames[0], tracks[number].members[0]
    best, most = -1, MIN_OVERLAP * len(members)
    for candidate, track in enumerate(tracks):
        before = bisect_left(track.frames, first) - 1
        if candidate == number or before < 0 or time[first] - time[track.frames[before]] > MAX_GAP:
            continue
        shared = len(track.members[before] & members)
        if shared >= most:
            best, most = candidate, shared
    return best
