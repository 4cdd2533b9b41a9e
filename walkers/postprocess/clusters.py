"""Clusters that are free of the pile: tracks through time, events, and climbs.

Bridges, touching or open, divide the beads of a pile into connected components. The *bulk* is the largest component
together with all components that are bridged to the floor. A *cluster* is a component of at least two beads that is
*free*, that is, not part of the bulk. It is *held* if a bridge joins one of its beads to a side wall. A *track* follows
a cluster through time: in each frame it continues with the cluster that shares most of its beads. A track does not end
if the cluster touches the pile or loses the wall for at most `ClimbCriteria.max_gap`.

A *climb* is a track that rises by at least `ClimbCriteria.min_rise` while its cluster is free and held. The rise
between two successive frames is the change of the mean height of the beads that the cluster has in both, so that beads
that join or leave do not count. A column that detaches high and sinks does not climb, nor does a bead in the air, which
is not held.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated

import numpy as np

from walkers.postprocess.dump import BoolArray, FloatArray, IntArray
from walkers.postprocess.motion import FLOOR, Bridges

Cluster = tuple[frozenset[int], frozenset[int]]
"""Beads of a cluster in a frame, and side walls that hold it."""

Joined = tuple[IntArray, BoolArray]
"""Pairs of joined beads of a frame, shape (K, 2), and whether each bead is joined to a side wall, shape (N,)."""

_FEWEST_BEADS = 2
_FEWEST_FRAMES = 3
_MOST_BLOCKS, _FEWEST_BLOCKS = 10, 4
"""Number of parts of a climb for the standard error of its speed."""


@dataclass(frozen=True)
class ClimbCriteria:
    """Definition of a climb by thresholds."""

    min_rise: float = 2e-3
    """Smallest rise of a climb, m: about two diameters of the paper's large beads."""
    max_gap: float = 0.1
    """Longest time, s, for which a cluster may touch the pile or lose the wall within a track."""
    min_overlap: float = 0.5
    """Smallest share of common beads (of the smaller cluster) in successive clusters of a track."""


@dataclass
class Track:
    """A cluster through time: frames in which it is free and held, its beads and side walls.

    ``merged_into`` and ``merged_at`` are the track into which it merged and the frame in which it did, or None.
    """

    frames: list[int] = field(default_factory=list)
    members: list[frozenset[int]] = field(default_factory=list)
    walls: list[frozenset[int]] = field(default_factory=list)
    merged_into: int | None = None
    merged_at: int | None = None


def connected(count: int, pairs: IntArray) -> IntArray:
    """Index of the connected component of each item, shape (count,), from joined pairs, shape (K, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def bulk_of(labels: IntArray, bridges: Bridges, *, heap: bool = True) -> BoolArray:
    """Whether beads are part of the bulk, shape (N,).

    Without a ``heap`` (beads placed one by one) the largest component may be a cluster on a wall; then the bulk is what
    is bridged to the floor.
    """
    on_floor = labels[bridges.wall_beads[bridges.walls == FLOOR]]
    most = [np.bincount(labels).argmax()] if heap else []
    bulk: BoolArray = np.isin(labels, [*most, *on_floor])
    return bulk


def held_clusters(labels: IntArray, bridges: Bridges, bulk: BoolArray) -> Iterator[Cluster]:
    """The clusters that are free and held in a frame."""
    side = bridges.walls != FLOOR
    beads, walls = bridges.wall_beads[side], bridges.walls[side]
    for label in np.unique(labels[beads[~bulk[beads]]]):
        members = np.flatnonzero(labels == label)
        if len(members) >= _FEWEST_BEADS:
            yield frozenset(members.tolist()), frozenset(walls[np.isin(beads, members)].tolist())


def follow(time: FloatArray, clusters: Iterable[Sequence[Cluster]], definition: ClimbCriteria) -> list[Track]:
    """Tracks of the clusters of all frames (`held_clusters`; time in s, shape (F,)), in the order of their begins."""
    tracks: list[Track] = []
    alive: list[int] = []
    for frame, found in enumerate(clusters):
        alive = [number for number in alive if time[frame] - time[tracks[number].frames[-1]] <= definition.max_gap]
        # The larger overlap first: of two tracks that merge, the one with more beads continues.
        shared = []
        for number in alive:
            before = tracks[number].members[-1]
            for place, (members, _) in enumerate(found):
                common = len(before & members)
                if common >= definition.min_overlap * min(len(before), len(members)):
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
        for place, (members, walls) in enumerate(found):
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
class Beads:
    """Beads of a pile: time (s, shape (F,)), height (m, shape (F, N)), and which are large.

    ``surface`` and ``bulk`` are the height of the surface and the beads of the bulk in each frame, ``first`` is the
    first frame of the drive.
    """

    time: FloatArray
    height: FloatArray
    large: BoolArray
    surface: FloatArray
    bulk: Sequence[BoolArray]
    first: int
    wall_names: Sequence[str]


@dataclass(frozen=True)
class Climb:
    """``clusters.parquet``: one row per cluster of a pile.

    Unlike ``begin``, ``onset`` and ``qualified`` do not depend on later frames: up to a given time, records of any
    length contain the same climbs. The standard error of the speed is that of the mean over up to ten equal parts of
    the rise. It is too small if the speed changes more slowly than over a tenth of the climb. Begin and end maximise
    the gain, so the speed of a short and unsteady climb is too large.
    """

    track: Annotated[int, "", "index of the cluster, followed through time"]
    first: Annotated[float, "s", "first time at which the cluster is free of the bulk and held by a side wall"]
    last: Annotated[float, "s", "last time at which the cluster is free of the bulk and held by a side wall"]
    begin: Annotated[float, "s", "start of the largest rise"]
    end: Annotated[float, "s", "end of the largest rise"]
    out_of_pile: Annotated[
        bool,
        "",
        "whether most of the cluster's first beads were in the bulk for 0.1 s or longer after the start of the drive",
    ]
    onset: Annotated[float, "s", "start of the first rise that counts as a climb; NaN if there is none"]
    qualified: Annotated[
        float, "s", "time at which this rise reaches the minimum rise of a climb; NaN if there is none"
    ]
    gain: Annotated[float, "m", "largest rise: increase of the mean height of the cluster's beads"]
    speed: Annotated[float, "m/s", "gain over the duration of the rise"]
    standard_error: Annotated[float, "m/s", "standard error of the speed, from ten parts of the rise"]
    climbed: Annotated[bool, "", "whether a rise of the cluster counts as a climb"]
    leader: Annotated[int, "", "index of the bead that is most often topmost during the rise, from 0"]
    leader_large: Annotated[bool, "", "whether the leader is large"]
    height: Annotated[float, "m", "height of the leader at the end of the rise"]
    above_surface: Annotated[float, "m", "height of the leader above the surface of the bulk at the end of the rise"]
    size: Annotated[int, "", "number of beads at the end of the rise"]
    large: Annotated[int, "", "number of large beads at the end of the rise"]
    walls: Annotated[int, "", "number of side walls that hold the cluster at the end of the rise: two in a corner"]
    wall_names: Annotated[str, "", "names of these walls: -x, +x, -y, +y; side for a cylinder"]
    merged_into: Annotated[int, "", "index of the cluster into which this cluster merged, -1 for none"]


def classify(number: int, track: Track, beads: Beads, definition: ClimbCriteria) -> Climb:
    """The largest rise of a track of `follow`, and whether the track is a climb."""
    time, height = beads.time, beads.height
    gained, seconds = _gained(track, time, height)
    risen = gained - np.minimum.accumulate(gained)
    moments = _qualified(gained, definition.min_rise)
    onset, qualified = (float(time[track.frames[place]]) for place in moments) if moments else (np.nan, np.nan)
    end = int(np.argmax(risen))
    begin = int(np.argmin(gained[: end + 1]))
    span = range(begin, end + 1)
    topmost = Counter(max(track.members[place], key=lambda bead: height[track.frames[place], bead]) for place in span)
    leader = topmost.most_common(1)[0][0]
    speed, error = _speed(seconds[begin : end + 1], gained[begin : end + 1])
    last, members, walls, first = track.frames[end], track.members[end], sorted(track.walls[end]), track.members[0]
    # Beads that were hardly in the bulk have hung on a wall since before the drive.
    bulk = [one[list(first)].mean() >= definition.min_overlap for one in beads.bulk[beads.first : track.frames[0]]]
    in_bulk = float(np.diff(time[beads.first : track.frames[0] + 1])[bulk].sum())
    return Climb(
        track=number,
        first=float(time[track.frames[0]]),
        last=float(time[track.frames[-1]]),
        begin=float(time[track.frames[begin]]),
        end=float(time[last]),
        out_of_pile=in_bulk >= definition.max_gap,
        onset=onset,
        qualified=qualified,
        gain=float(risen[end]),
        speed=speed,
        standard_error=error,
        climbed=moments is not None,
        leader=leader,
        leader_large=bool(beads.large[leader]),
        height=float(height[last, leader]),
        above_surface=float(height[last, leader] - beads.surface[last]),
        size=len(members),
        large=int(beads.large[list(members)].sum()),
        walls=len(walls),
        wall_names=" ".join(beads.wall_names[wall] for wall in walls),
        merged_into=-1 if track.merged_into is None else track.merged_into,
    )


def _qualified(gained: FloatArray, min_rise: float) -> tuple[int, int] | None:
    """Begin of the rise that makes a track a climb, and the frame at which it qualifies; None without a climb.

    It qualifies where its height above its lowest is a maximum so far, at least ``min_rise``, and the rise has enough
    frames: a hop between two frames is not a climb.
    """
    places, least = np.arange(len(gained)), np.minimum.accumulate(gained)
    risen = gained - least
    lowest = np.maximum.accumulate(np.where(np.diff(least, prepend=np.inf) < 0.0, places, 0))
    farthest = risen == np.maximum.accumulate(risen)
    found = np.flatnonzero(farthest & (risen >= min_rise) & (places - lowest + 1 >= _FEWEST_FRAMES))
    return (int(lowest[found[0]]), int(found[0])) if len(found) else None


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
    there = lasted > 0.0
    if there.sum() < _FEWEST_BLOCKS:
        return speed, np.nan
    speeds, shares = risen[there] / lasted[there], lasted[there] / lasted[there].sum()
    return speed, float(np.sqrt((shares**2 * (speeds - speed) ** 2).sum() * there.sum() / (there.sum() - 1)))


@dataclass(frozen=True)
class Assembly:
    """``assembly.parquet``: history of the beads of each climb, from rest until the climb qualifies.

    One row per climb, bead and frame, for the beads of the cluster at that time.
    """

    time: Annotated[float, "s", "time since the start of the drive; the first frame is the last frame before the drive"]
    track: Annotated[int, "", "index of the cluster that climbed"]
    bead: Annotated[int, "", "index of the bead, from 0"]
    large: Annotated[bool, "", "whether the bead is large"]
    height: Annotated[float, "m", "height of the bead's centre"]
    in_bulk: Annotated[bool, "", "whether the bead belongs to the bulk"]
    at_wall: Annotated[bool, "", "whether the bead has a bridge to a side wall"]
    neighbours: Annotated[int, "", "number of bridges to other beads of the later climbing cluster"]
    joined: Annotated[
        bool, "", "whether bridges within the later climbing cluster connect the bead to most of the other beads"
    ]


def assembly_of(
    tracks: Sequence[Track], climbs: Sequence[Climb], beads: Beads, bridges: Sequence[Joined]
) -> list[Assembly]:
    """State of the beads of each climb in each frame."""
    rows = []
    rest = max(beads.first - 1, 0)
    for climb in climbs:
        if not climb.climbed:
            continue
        track = tracks[climb.track]
        until = int(np.searchsorted(beads.time, climb.qualified))
        own = sorted(track.members[track.frames.index(until)])
        for frame in range(rest, until + 1):
            pairs, walled = bridges[frame]
            within = np.searchsorted(own, pairs[np.isin(pairs, own).all(axis=1)])
            labels = connected(len(own), within)
            most = np.bincount(labels).argmax()
            neighbours = np.bincount(within.ravel(), minlength=len(own))
            for place, bead in enumerate(own):
                rows.append(
                    Assembly(
                        time=float(beads.time[frame]),
                        track=climb.track,
                        bead=bead,
                        large=bool(beads.large[bead]),
                        height=float(beads.height[frame, bead]),
                        in_bulk=bool(beads.bulk[frame][bead]),
                        at_wall=bool(walled[bead]),
                        neighbours=int(neighbours[place]),
                        joined=bool(labels[place] == most and neighbours[place]),
                    )
                )
    return rows


@dataclass(frozen=True)
class Event:
    """``events.parquet``: one row per event of a pile's clusters.

    Events are ``freed`` (the cluster leaves the pile or reaches a wall), ``split`` (it separates from another cluster),
    ``merged`` (it merges into another cluster), ``rejoined`` (it returns to the pile) and ``detached`` (it loses the
    walls, or its beads separate).
    """

    time: Annotated[float, "s", "time since the start of the drive"]
    event: Annotated[str, "", "freed, split, merged, rejoined or detached"]
    track: Annotated[int, "", "index of the cluster"]
    other: Annotated[int, "", "index of the cluster from which it split or into which it merged, -1 for none"]
    height: Annotated[float, "m", "height of the cluster's leader at the event"]


def events_of(tracks: Sequence[Track], climbs: Sequence[Climb], beads: Beads, definition: ClimbCriteria) -> list[Event]:
    """The events of all tracks in the order of time.

    The begin of a track in the first frame of the drive is not an event, nor is the end of a track that may still
    continue after the last frame.
    """
    time, events = beads.time, []

    def add(frame: int, kind: str, number: int, other: int = -1) -> None:
        height = float(beads.height[frame, climbs[number].leader])
        events.append(Event(float(time[frame]), kind, number, other, height))

    for number, track in enumerate(tracks):
        born, last, parent = track.frames[0], track.frames[-1], _parent(tracks, number, time, definition)
        if parent is not None:
            add(born, "split", number, parent)
        elif born > beads.first:
            add(born, "freed", number)
        if track.merged_at is not None and track.merged_into is not None:
            add(track.merged_at, "merged", number, track.merged_into)
        elif time[-1] - time[last] > definition.max_gap:
            # It rejoined the pile if most of its beads were in the bulk before the track ended.
            until = min(int(np.searchsorted(time, time[last] + definition.max_gap, side="right")), len(time) - 1)
            members, after = list(track.members[-1]), beads.bulk[last + 1 : until + 1]
            back = any(bulk[members].mean() >= definition.min_overlap for bulk in after)
            add(last + 1, "rejoined" if back else "detached", number)
    return sorted(events, key=lambda event: (event.time, event.track))


def _parent(tracks: Sequence[Track], number: int, time: FloatArray, definition: ClimbCriteria) -> int | None:
    """The track that had most of the beads of a track shortly before its begin."""
    first, members = tracks[number].frames[0], tracks[number].members[0]
    best, most = None, definition.min_overlap * len(members)
    for other, track in enumerate(tracks):
        before = bisect_left(track.frames, first) - 1
        if other == number or before < 0 or time[first] - time[track.frames[before]] > definition.max_gap:
            continue
        shared = len(track.members[before] & members)
        if shared >= most:
            best, most = other, shared
    return best
