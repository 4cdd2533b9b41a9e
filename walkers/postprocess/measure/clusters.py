"""Clusters that are free of the pile: tracks through time, events, and climbs.

Bridges, touching or open, divide the beads of a pile into connected components. The *bulk* is the
largest component together with all components that are bridged to the floor; some vessels have no
floor. A *cluster* is a component of at least two beads that is *free*, that is, not part of the
bulk. It is *held* if a bridge joins one of its beads to a side wall. A *track* follows a cluster
through time: in each frame it continues with the cluster that shares most of its beads. A track
does not end if the cluster touches the pile or loses the wall for at most `MAX_GAP`.

A *climb* is a track that rises by at least `MIN_RISE` while its cluster is free and held. The rise
between two successive frames is the change of the mean height of the beads that the cluster has in
both, so that beads that join or leave do not count. A column that detaches high and sinks does not
climb, nor does a bead in the air, which is not held.

`walkers.postprocess.measure.piles` finds the clusters of each frame with these functions, and
measures the bed.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.shapes.walls import FLOOR as FLOOR_NAME
from walkers.inputs.tables.shapes.walls import Wall
from walkers.postprocess.measure.motion import FLOOR_INDEX, Bridges
from walkers.postprocess.measure.tables import Columns, columns_of

MIN_RISE = 2e-3
"""Smallest rise of a climb, m: about two diameters of the paper's large beads."""
MAX_REST = 5e-5
"""Heights that differ by less, m, are equal when the start and the end of a rise are sought.

Clusters that hang on a shaken wall are as high in each frame within about 5e-6 m. A climb at 3 mm/s
gains 5e-5 m from one frame to the next.
"""
MAX_GAP = 0.1
"""Longest time, s, for which a cluster may touch the pile or lose the wall within a track."""
MIN_OVERLAP = 0.5
"""Smallest share of the beads of one cluster that are also in another one, if they are related.

For successive clusters of a track, it is a share of the smaller one; for a cluster that splits from
another or rejoins the pile, of its own beads."""
NO_FLOOR = -1
"""Index of the floor of a vessel whose walls are all side walls."""
EVENTS = ("freed", "split", "merged", "rejoined", "detached")
"""Events of clusters, see `events_of`."""
_FEWEST_BEADS = 2
"""Smallest number of beads of a cluster."""
_FEWEST_FRAMES = 3
"""Smallest number of frames of the rise of a climb."""
_CORNER_COSINE = 0.7072
"""Cosine of the smallest angle between the normals of two walls that form a corner.

It is slightly above the cosine of 45°, so that 45° counts in spite of rounding.
"""
_MOST_BLOCKS = 10
"""Largest number of parts of a climb for the standard error of its speed."""
_FEWEST_BLOCKS = 4
"""Smallest number of parts of a climb for the standard error of its speed."""


class HeldCluster(NamedTuple):
    """A cluster that is free and held in a frame: its beads, and the side walls that hold it."""

    members: frozenset[int]
    walls: frozenset[int]


@dataclass
class Track:
    """A cluster through time.

    Attributes
    ----------
    frames
        Frames in which it is free and held.
    members
        Its beads in each of these frames.
    walls
        The side walls that hold it in each of these frames.
    merged_into
        Index of the track into which it merged; -1 if it did not merge.
    merged_at
        Frame in which it merged; -1 if it did not merge.
    """

    frames: list[int] = field(default_factory=list)
    members: list[frozenset[int]] = field(default_factory=list)
    walls: list[frozenset[int]] = field(default_factory=list)
    merged_into: int = -1
    merged_at: int = -1


def connected(count: int, pairs: IntArray) -> IntArray:
    """Find the connected components of items of which pairs are joined.

    Parameters
    ----------
    count
        Number of items.
    pairs : ndarray of int, shape (K, 2)
        Indices of the items of each joined pair.

    Returns
    -------
    ndarray of int, shape (count,)
        Index of the component of each item.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((joined, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, component = connected_components(graph, directed=False)
    labels: IntArray = component.astype(np.int64)
    return labels


def floor_of(wall_names: Sequence[str]) -> int:
    """Index of the floor among the walls; `NO_FLOOR` in a vessel without one, such as a trough."""
    return FLOOR_INDEX if wall_names[FLOOR_INDEX] == FLOOR_NAME else NO_FLOOR


def bulk_of(
    labels: IntArray, bridges: Bridges, *, heap: bool = True, floor: int = FLOOR_INDEX
) -> BoolArray:
    """Find the beads of the bulk.

    Parameters
    ----------
    labels : ndarray of int, shape (N,)
        Connected component of each bead.
    bridges
        The bridges of the frame.
    heap
        Whether the beads were poured. Of placed beads, the largest component may be a cluster on a
        wall, and is no part of the bulk.
    floor
        Index of the floor among the walls (`floor_of`).

    Returns
    -------
    ndarray of bool, shape (N,)
        Whether a bead is part of the bulk.
    """
    beads, walls = bridges.at_walls
    bulk_labels = labels[beads[walls == floor]].tolist()
    if heap:
        bulk_labels.append(np.bincount(labels).argmax())
    return np.isin(labels, bulk_labels)


def at_sides(bridges: Bridges, count: int, floor: int = FLOOR_INDEX) -> BoolArray:
    """Find the beads that a bridge joins to a side wall.

    Parameters
    ----------
    bridges
        The bridges of a frame.
    count
        Number of beads.
    floor
        Index of the floor among the walls (`floor_of`).

    Returns
    -------
    ndarray of bool, shape (count,)
    """
    beads, walls = bridges.at_walls
    return np.isin(np.arange(count), beads[walls != floor])


def held_clusters(
    labels: IntArray, bridges: Bridges, bulk: BoolArray, floor: int = FLOOR_INDEX
) -> Iterator[HeldCluster]:
    """Find the clusters that are free and held in a frame.

    Parameters
    ----------
    labels : ndarray of int, shape (N,)
        Connected component of each bead.
    bridges
        The bridges of the frame.
    bulk : ndarray of bool, shape (N,)
        Whether a bead is part of the bulk.
    floor
        Index of the floor among the walls (`floor_of`).

    Yields
    ------
    HeldCluster
        In the order of their labels.
    """
    beads, walls = bridges.at_walls[:, bridges.at_walls[1] != floor]
    for label in np.unique(labels[beads[~bulk[beads]]]):
        members = np.flatnonzero(labels == label)
        if len(members) >= _FEWEST_BEADS:
            holding_walls = walls[np.isin(beads, members)]
            yield HeldCluster(frozenset(members.tolist()), frozenset(holding_walls.tolist()))


def follow(time: FloatArray, clusters: Iterable[Sequence[HeldCluster]]) -> list[Track]:
    """Follow clusters through time.

    Parameters
    ----------
    time : ndarray, shape (F,)
        Time of the frames, s.
    clusters
        The clusters of each frame (`held_clusters`).

    Returns
    -------
    list of Track
        In the order in which they start.
    """
    tracks: list[Track] = []
    alive: list[int] = []
    for frame, clusters_now in enumerate(clusters):
        now = time[frame]
        alive = [number for number in alive if now - time[tracks[number].frames[-1]] <= MAX_GAP]
        track_at: dict[int, int] = {}  # number of the track that continues with each cluster
        ended = set()
        for number, place in _overlaps(tracks, alive, clusters_now):
            if number in track_at.values() or number in ended:
                continue
            if place in track_at:
                tracks[number].merged_into = track_at[place]
                tracks[number].merged_at = frame
                ended.add(number)
            else:
                track_at[place] = number
        alive = [number for number in alive if number not in ended]
        for place, cluster in enumerate(clusters_now):
            if place not in track_at:
                track_at[place] = len(tracks)
                alive.append(len(tracks))
                tracks.append(Track())
            track = tracks[track_at[place]]
            track.frames.append(frame)
            track.members.append(cluster.members)
            track.walls.append(cluster.walls)
    return tracks


def _overlaps(
    tracks: Sequence[Track], alive: Iterable[int], clusters_now: Sequence[HeldCluster]
) -> list[tuple[int, int]]:
    """Numbers of tracks, and indices of the clusters of a frame that share enough beads with them.

    The largest overlap comes first: of two tracks that merge, the one with more beads continues.
    """
    overlaps = []
    for number in alive:
        before = tracks[number].members[-1]
        for place, cluster in enumerate(clusters_now):
            common = len(before & cluster.members)
            if common >= MIN_OVERLAP * min(len(before), len(cluster.members)):
                overlaps.append((common, -number, place))
    overlaps.sort(reverse=True)
    return [(-negative_number, place) for _, negative_number, place in overlaps]


@dataclass(frozen=True)
class PileBeads:
    """The N beads of a pile in F frames.

    Attributes
    ----------
    time : ndarray, shape (F,)
        Time since the start of the drive, s.
    height : ndarray, shape (F, N)
        Height of the centres of the beads, m.
    large : ndarray of bool, shape (N,)
        Whether a bead is large.
    surface : ndarray, shape (F,)
        Height of the surface of the bulk, m.
    bulk : sequence of ndarray of bool, shape (N,)
        Whether a bead is part of the bulk, for each frame.
    first
        First frame of the drive.
    wall_names
        Names of the walls of the container.
    walls
        The walls of the container; needed with ``position`` alone.
    position : ndarray, shape (F, N, 3), or None
        Position of the beads, m. Without it, all walls at a cluster count as different ones.
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
    """Tell whether the first beads of a track were in the bulk for some time.

    Others have hung on a wall since before the drive.
    """
    start = track.frames[0]
    members = list(track.members[0])
    in_bulk = [bulk[members].mean() >= MIN_OVERLAP for bulk in beads.bulk[beads.first : start]]
    intervals = np.diff(beads.time[beads.first : start + 1])
    return bool(intervals[in_bulk].sum() >= MAX_GAP)


def _walls_apart(walls: Sequence[int], frame: int, members: Sequence[int], beads: PileBeads) -> int:
    """Number of walls at a cluster whose normals differ by 45° or more; in a corner it is 2.

    A round vessel of a mesh has many faces: a cluster that touches two of them is not in a corner.
    """
    if beads.position is None:
        return len(walls)
    middle = beads.position[frame, members].mean(axis=0)
    normals_apart: list[FloatArray] = []
    for wall in walls:
        normal = beads.walls[wall].normals(middle)
        if all(normal @ counted_normal < _CORNER_COSINE for counted_normal in normals_apart):
            normals_apart.append(normal)
    return len(normals_apart)


def climbs_of(tracks: Sequence[Track], beads: PileBeads) -> Columns:
    """Make the table ``clusters``: the largest rise of each track, and whether it is a climb.

    Parameters
    ----------
    tracks
        The tracks of `follow`.
    beads
        The beads of the pile.

    Returns
    -------
    dict of str to ndarray, shape (tracks,)
        The columns of `_CLUSTERS_COLUMNS`, in SI units. Their meanings are those of the table
        ``clusters`` in ``quantities.toml``; ``onset`` and ``qualified`` are NaN without a climb.

    Notes
    -----
    The largest rise goes from the lowest height to the greatest one after it. A cluster may hang
    still before and after the rise, and this time must not count in the speed. The rise therefore
    begins in the last frame that is within `MAX_REST` of its lowest height, and ends in the first
    frame thereafter that is within `MAX_REST` of its top. The speed is the mean between these two
    frames; the gain is that from the lowest height to the top.

    A rise maximises the gain: the speed of a short and unsteady climb is too large. Its standard
    error, of the mean over up to ten equal parts, is too small if the speed changes more slowly.
    ``onset`` and ``qualified`` do not depend on later frames: up to a given time, records of any
    length contain the same climbs.
    """
    rows = [_climb_of(number, track, beads) for number, track in enumerate(tracks)]
    columns: Columns = {}
    for name, column_type in _CLUSTERS_COLUMNS.items():
        columns[name] = np.array([row[name] for row in rows], dtype=column_type)
    return columns


_CLUSTERS_COLUMNS = {
    "track": int,
    "first": float,
    "last": float,
    "begin": float,
    "end": float,
    "out_of_pile": bool,
    "onset": float,
    "qualified": float,
    "gain": float,
    "speed": float,
    "standard_error": float,
    "climbed": bool,
    "leader": int,
    "leader_large": bool,
    "height": float,
    "above_surface": float,
    "size": int,
    "large": int,
    "walls": int,
    "wall_names": str,
    "merged_into": int,
}
"""Names and types of the columns of the table ``clusters``."""


def _climb_of(number: int, track: Track, beads: PileBeads) -> dict[str, Any]:
    """The row of a track in the table ``clusters``."""
    frames = np.array(track.frames)
    height = beads.height
    gained, seconds = _gained(track, beads.time, height)
    risen = gained - np.minimum.accumulate(gained)
    top = int(np.argmax(risen))
    first = int(_starts_of_rises(gained)[top])
    last = _end_of_rise(gained, first, top)
    rise = slice(first, last + 1)
    end = frames[last]
    members = sorted(track.members[last])
    walls = sorted(track.walls[last])
    leader = _leader_of(track, rise, height)
    speed, standard_error = _speed(seconds[rise], gained[rise])
    onset = np.nan
    qualified = np.nan
    qualifying = _qualifying_rise(gained)
    if qualifying is not None:
        start, qualifies = qualifying
        onset = beads.time[frames[start]]
        qualified = beads.time[frames[qualifies]]
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
        "standard_error": standard_error,
        "climbed": qualifying is not None,
        "leader": leader,
        "leader_large": beads.large[leader],
        "height": height[end, leader],
        "above_surface": height[end, leader] - beads.surface[end],
        "size": len(members),
        "large": beads.large[members].sum(),
        "walls": _walls_apart(walls, end, members, beads),
        "wall_names": ", ".join(beads.wall_names[wall] for wall in walls),
        "merged_into": track.merged_into,
    }


def _leader_of(track: Track, rise: slice, height: FloatArray) -> int:
    """The bead that is most often topmost during a rise; height in m, shape (F, N)."""
    times_topmost: Counter[int] = Counter()
    for frame, members in zip(track.frames[rise], track.members[rise], strict=True):
        topmost = max(members, key=height[frame].__getitem__)
        times_topmost[topmost] += 1
    leader, _ = times_topmost.most_common(1)[0]
    return leader


def _starts_of_rises(gained: FloatArray) -> IntArray:
    """For each frame, the last frame up to it that is at the lowest height so far.

    Heights within `MAX_REST` of the lowest one count as the lowest.
    """
    lowest = np.minimum.accumulate(gained)
    is_start = gained <= lowest + MAX_REST
    starts: IntArray = np.maximum.accumulate(np.where(is_start, np.arange(len(gained)), 0))
    return starts


def _end_of_rise(gained: FloatArray, start: int, top: int) -> int:
    """The first frame from the start of a rise on that is as high as its top, within `MAX_REST`."""
    is_high = gained[start : top + 1] >= gained[top] - MAX_REST
    return start + int(np.argmax(is_high))


def _qualifying_rise(gained: FloatArray) -> tuple[int, int] | None:
    """Start of the rise that makes a track a climb, and the frame in which it qualifies.

    In this frame, the height above the lowest is the largest so far, and at least `MIN_RISE`. None
    if the track does not climb; a hop between two frames is no climb.
    """
    risen = gained - np.minimum.accumulate(gained)
    starts = _starts_of_rises(gained)
    is_farthest = risen == np.maximum.accumulate(risen)
    for frame in np.flatnonzero(is_farthest & (risen >= MIN_RISE)).tolist():
        start = int(starts[frame])
        frames_of_rise = _end_of_rise(gained, start, frame) - start + 1
        if frames_of_rise >= _FEWEST_FRAMES:
            return start, frame
    return None


def _gained(track: Track, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rise since the first frame of a track (m) and its duration (s), shape (frames of the track,).

    In gaps between frames neither a gain of height nor the time counts; a loss of height does.
    """
    rises = [0.0]
    seconds = [0.0]
    for place, (before, now) in enumerate(pairwise(track.frames)):
        common = list(track.members[place] & track.members[place + 1])
        rise = 0.0
        if common:
            rise = float((height[now, common] - height[before, common]).mean())
        if now == before + 1:
            rises.append(rise)
            seconds.append(float(time[now] - time[before]))
        else:
            rises.append(min(rise, 0.0))
            seconds.append(0.0)
    return np.cumsum(rises), np.cumsum(seconds)


def _speed(seconds: FloatArray, gained: FloatArray) -> tuple[float, float]:
    """Mean speed of a rise and its standard error, m/s; NaN if there are too few frames.

    The standard error is that of the mean over equal parts of the rise, weighted by duration.
    """
    duration = seconds[-1] - seconds[0]
    if len(gained) < _FEWEST_FRAMES or duration == 0.0:
        return np.nan, np.nan
    speed = float((gained[-1] - gained[0]) / duration)
    blocks = min(_MOST_BLOCKS, len(gained) - 1)
    edges = np.linspace(0, len(gained) - 1, blocks + 1).round().astype(int)
    lasted = np.diff(seconds[edges])
    risen = np.diff(gained[edges])
    timed = lasted > 0.0
    count = timed.sum()
    if count < _FEWEST_BLOCKS:
        return speed, np.nan
    speeds = risen[timed] / lasted[timed]
    shares = lasted[timed] / lasted[timed].sum()
    variance = (shares**2 * (speeds - speed) ** 2).sum() * count / (count - 1)
    return speed, float(np.sqrt(variance))


def members_of(tracks: Sequence[Track], beads: PileBeads) -> Columns:
    """Make the table ``members``: the beads of the clusters in each frame.

    Parameters
    ----------
    tracks
        The tracks of `follow`.
    beads
        The beads of the pile.

    Returns
    -------
    dict of str to ndarray
        A row for each bead of a cluster and frame: ``track`` and ``bead`` are indices, ``time`` is
        in s, ``large`` tells whether the bead is of the large class, and ``height`` is in m. Sorted
        by frame; in a frame, clusters are in the order of `held_clusters`.
    """
    clusters = []
    for number, track in enumerate(tracks):
        clusters += [
            (frame, sorted(members), number)
            for frame, members in zip(track.frames, track.members, strict=True)
        ]
    rows: list[tuple[int, int, int]] = []
    for frame, members, number in sorted(clusters):
        rows += [(frame, number, bead) for bead in members]
    columns = columns_of(rows, {"frame": int, "track": int, "bead": int})
    return _with_time_and_height(columns, beads)


def _with_time_and_height(columns: Columns, beads: PileBeads) -> Columns:
    """Replace the column ``frame`` by the time; add the class and the height of the beads."""
    frame = columns["frame"]
    bead = columns["bead"]
    completed = dict(columns)
    del completed["frame"]
    completed["time"] = beads.time[frame]
    completed["large"] = beads.large[bead]
    completed["height"] = beads.height[frame, bead]
    return completed


@dataclass(frozen=True)
class _Climber:
    """A climbing cluster: its track, the frame in which the climb qualifies, its beads then."""

    track: int
    until: int
    members: IntArray


_ASSEMBLY_COLUMNS = {
    "frame": int,
    "track": int,
    "bead": int,
    "in_bulk": bool,
    "at_wall": bool,
    "neighbours": int,
    "joined": bool,
}
"""Names and types of the columns from which the table ``assembly`` is made."""


def assembly_of(
    tracks: Sequence[Track], climbs: Columns, beads: PileBeads, bridges: Iterable[Bridges]
) -> Columns:
    """Make the table ``assembly``: how the clusters that climb come together.

    Parameters
    ----------
    tracks
        The tracks of `follow`.
    climbs
        The table ``clusters`` of these tracks.
    beads
        The beads of the pile.
    bridges
        The bridges of the frames in their order. Those of frames after the last climb has qualified
        are not read.

    Returns
    -------
    dict of str to ndarray
        A row for each bead of each climb in each frame, from the last frame before the drive until
        the climb qualifies; climb by climb, and frame by frame within each. The beads of a climb
        are those that its cluster has when it qualifies. Without climbs the columns are empty:

        - ``track``: index of the climb's track in ``tracks``
        - ``bead``: index of the bead in the pile
        - ``in_bulk``: whether the bead belongs to the bulk
        - ``at_wall``: whether it has a bridge to a side wall
        - ``neighbours``: number of its bridges to other beads of the climb
        - ``joined``: whether such bridges connect it to the largest connected part of the climb
        - ``time``: time of the frame, s
        - ``large``: whether the bead is of the large class
        - ``height``: its height, m
    """
    climbers = _climbers(tracks, climbs, beads)
    parts_of_climbers: list[list[Columns]] = [[] for _ in climbers]
    last_frame_at_rest = max(beads.first - 1, 0)
    last_frame = max((climber.until for climber in climbers), default=-1)
    if climbers:
        for bridges_now in bridges:
            if bridges_now.frame > last_frame:
                break
            at_wall = at_sides(bridges_now, len(beads.large), floor_of(beads.wall_names))
            for climber, parts in zip(climbers, parts_of_climbers, strict=True):
                if last_frame_at_rest <= bridges_now.frame <= climber.until:
                    parts.append(_assembly_in_frame(climber, bridges_now, at_wall, beads))
    columns: Columns = {}
    for name, column_type in _ASSEMBLY_COLUMNS.items():
        values: list[npt.NDArray[Any]] = [np.zeros(0, dtype=column_type)]
        for parts in parts_of_climbers:
            values += [part[name] for part in parts]
        columns[name] = np.concatenate(values)
    return _with_time_and_height(columns, beads)


def _climbers(tracks: Sequence[Track], climbs: Columns, beads: PileBeads) -> list[_Climber]:
    """The clusters that climb."""
    climbers = []
    for number in np.flatnonzero(climbs["climbed"]).tolist():
        until = int(np.searchsorted(beads.time, climbs["qualified"][number]))
        track = tracks[number]
        members = np.array(sorted(track.members[track.frames.index(until)]))
        climbers.append(_Climber(number, until, members))
    return climbers


def _assembly_in_frame(
    climber: _Climber, bridges: Bridges, at_wall: BoolArray, beads: PileBeads
) -> Columns:
    """State of the beads of a climbing cluster in the frame of the bridges."""
    members = climber.members
    size = len(members)
    between_members = bridges.beads[np.isin(bridges.beads, members).all(axis=1)]
    pairs = np.searchsorted(members, between_members)
    labels = connected(size, pairs)
    neighbours = np.bincount(pairs.ravel(), minlength=size)
    in_largest_part = labels == np.bincount(labels).argmax()
    return {
        "frame": np.full(size, bridges.frame),
        "track": np.full(size, climber.track),
        "bead": members,
        "in_bulk": beads.bulk[bridges.frame][members],
        "at_wall": at_wall[members],
        "neighbours": neighbours,
        "joined": in_largest_part & (neighbours > 0),
    }


class _Event(NamedTuple):
    """An event of a cluster: its frame and track, a second track (-1 for none), its name."""

    frame: int
    track: int
    second_track: int
    event: str


def events_of(tracks: Sequence[Track], climbs: Columns, beads: PileBeads) -> Columns:
    """Make the table ``events``, in the order of time.

    Parameters
    ----------
    tracks
        The tracks of `follow`.
    climbs
        The table ``clusters`` of these tracks.
    beads
        The beads of the pile.

    Returns
    -------
    dict of str to ndarray
        A cluster is ``freed`` (it leaves the pile or reaches a wall), ``split`` from another
        cluster, ``merged`` into another cluster, ``rejoined`` (it returns to the pile) or
        ``detached`` (it loses the walls, or its beads separate). Clusters at the start of the drive
        and clusters that may still go on at the end have no such event. Besides ``event``, the
        columns are ``track``, ``other`` (the track of the other cluster, −1 for none), ``time`` in
        s, and ``height`` in m: that of the leader, as the table ``clusters`` has it.
    """
    events = []
    for number, track in enumerate(tracks):
        born = track.frames[0]
        parent = _parent(tracks, number, beads.time)
        if parent >= 0:
            events.append(_Event(born, number, parent, "split"))
        elif born > beads.first:
            events.append(_Event(born, number, -1, "freed"))
        if track.merged_into >= 0:
            events.append(_Event(track.merged_at, number, track.merged_into, "merged"))
        elif beads.time[-1] - beads.time[track.frames[-1]] > MAX_GAP:
            name = "rejoined" if _rejoined(track, beads) else "detached"
            events.append(_Event(track.frames[-1] + 1, number, -1, name))
    types = {"frame": int, "track": int, "other": int, "event": str}
    columns = columns_of(sorted(events), types)
    frame = columns.pop("frame")
    leader = climbs["leader"][columns["track"]]
    return columns | {"time": beads.time[frame], "height": beads.height[frame, leader]}


def _rejoined(track: Track, beads: PileBeads) -> bool:
    """Tell whether a cluster rejoined the bulk when its track ended.

    At least `MIN_OVERLAP` of its last beads are in the bulk in one of the frames after the last
    one, up to the first frame that is later by more than `MAX_GAP`, in which the track is given up.
    """
    time = beads.time
    last = track.frames[-1]
    given_up = int(np.searchsorted(time, time[last] + MAX_GAP, side="right"))
    until = min(given_up, len(time) - 1)
    members = list(track.members[-1])
    return any(bulk[members].mean() >= MIN_OVERLAP for bulk in beads.bulk[last + 1 : until + 1])


def _parent(tracks: Sequence[Track], number: int, time: FloatArray) -> int:
    """Index of the track from which the track ``number`` split; -1 if it split from none.

    At most `MAX_GAP` before that track starts, the other one had at least `MIN_OVERLAP` of its
    first beads. If several had, it is the one that had the most.
    """
    first = tracks[number].frames[0]
    members = tracks[number].members[0]
    parent = -1
    most_shared = MIN_OVERLAP * len(members)
    for candidate, track in enumerate(tracks):
        before = bisect_left(track.frames, first) - 1
        if candidate == number or before < 0:
            continue
        if time[first] - time[track.frames[before]] > MAX_GAP:
            continue
        shared = len(track.members[before] & members)
        if shared >= most_shared:
            parent = candidate
            most_shared = shared
    return parent
