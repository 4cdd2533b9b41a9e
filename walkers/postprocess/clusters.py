"""Clusters that are free of the pile, followed through time, and what counts as a climb.

A *cluster* is a connected component of the beads' bridges (touching or open) of at least two beads that is *free*
of the pile's bulk: the component of most beads, and all that is bridged to the floor. It is *held* if a bridge joins
one of its beads to a side wall. A *track* is a cluster followed by its beads: from frame to frame it is the one that
shares most of them. What is no cluster for a moment only, because its tail brushes the pile or it lets go of the wall,
for no longer than `ClimbCriteria.max_gap`, stays the same track.

A *climb* is height gained while free and held: a track whose beads rose by at least `ClimbCriteria.min_rise` between
frames that follow each other and in both of which the cluster was free and held. From frame to frame the rise is that
of the mean height of the beads that it has in both, so that beads that it takes up or leaves behind count for nothing.
A column that detaches high and sinks gains none; a bead thrown into the air is not held, nor is what flies for a
moment.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import FLOOR, Bridges

IntArray = npt.NDArray[np.int64]
Cluster = tuple[frozenset[int], frozenset[int]]
"""The beads of a cluster in a frame and the side walls that hold it."""

_FEWEST_BEADS = 2
_FEWEST_FRAMES = 3
_MOST_BLOCKS, _FEWEST_BLOCKS = 10, 4
"""Parts of a climb from whose speeds the error of its speed is taken."""


@dataclass(frozen=True)
class ClimbCriteria:
    """Thresholds of what a climb is.

    Attributes
    ----------
    min_rise
        Height, m, that a cluster must gain: about two diameters of the paper's large beads.
    max_gap
        Seconds for which a cluster may touch the pile or lose the wall and still be the same.
    min_overlap
        Share of the smaller one's beads that two clusters must have in common to be one.
    """

    min_rise: float = 2e-3
    max_gap: float = 0.1
    min_overlap: float = 0.5


@dataclass
class Track:
    """A cluster through time.

    Attributes
    ----------
    frames
        Numbers of the frames in which it was free and held.
    members
        Its beads in each of these.
    walls
        The side walls that held it in each.
    merged_into, merged_at
        Number of the track that took over its beads, and the frame in which it did; None if none did.
    """

    frames: list[int] = field(default_factory=list)
    members: list[frozenset[int]] = field(default_factory=list)
    walls: list[frozenset[int]] = field(default_factory=list)
    merged_into: int | None = None
    merged_at: int | None = None

    def members_at(self, frame: int) -> frozenset[int]:
        """Its beads in a frame; none where it was not free and held."""
        return self.members[self.frames.index(frame)] if frame in self.frames else frozenset()


def connected(count: int, pairs: IntArray) -> IntArray:
    """Number of the connected component of each of so many, shape (count,), given joined pairs, shape (K, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = pairs[:, 0], pairs[:, 1]
    graph = coo_array((np.ones(len(first), dtype=np.int8), (first, second)), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def bulk_of(labels: IntArray, bridges: Bridges, *, heap: bool = True) -> npt.NDArray[np.bool_]:
    """Which beads belong to the component of most beads or to one that is bridged to the floor, shape (N,).

    Without a ``heap``, where beads were placed one by one, the component of most beads may be a cluster on a wall: then
    the floor alone decides.
    """
    on_floor = labels[bridges.wall_beads[bridges.walls == FLOOR]]
    most = [np.bincount(labels).argmax()] if heap else []
    bulk: npt.NDArray[np.bool_] = np.isin(labels, [*most, *on_floor])
    return bulk


def held_clusters(labels: IntArray, bridges: Bridges, bulk: npt.NDArray[np.bool_]) -> Iterator[Cluster]:
    """The clusters that are free and held in a frame: their beads and the side walls that hold them."""
    side = bridges.walls != FLOOR
    beads, walls = bridges.wall_beads[side], bridges.walls[side]
    for label in np.unique(labels[beads[~bulk[beads]]]):
        members = np.flatnonzero(labels == label)
        if len(members) < _FEWEST_BEADS:
            continue
        holding = walls[np.isin(beads, members)]
        yield frozenset(members.tolist()), frozenset(holding.tolist())


def follow(time: FloatArray, clusters: Iterable[Sequence[Cluster]], definition: ClimbCriteria) -> list[Track]:
    """Follow clusters from frame to frame.

    Parameters
    ----------
    time : ndarray, shape (F,)
        s.
    clusters
        Of each frame, those that are free and held (`held_clusters`).
    definition
        What is the same cluster.

    Returns
    -------
    list of Track
        In the order of their births.
    """
    tracks: list[Track] = []
    alive: list[int] = []
    for frame, found in enumerate(clusters):
        alive = [number for number in alive if time[frame] - time[tracks[number].frames[-1]] <= definition.max_gap]
        # The larger overlap first: of two tracks that meet, the one that gives more beads goes on.
        shared = sorted(
            (
                (len(tracks[number].members[-1] & members), -number, place)
                for number in alive
                for place, (members, _) in enumerate(found)
                if _same(tracks[number].members[-1], members, definition.min_overlap)
            ),
            reverse=True,
        )
        taken: dict[int, int] = {}
        ended = set()
        for _, negative, place in shared:
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


def _same(before: frozenset[int], now: frozenset[int], share: float) -> bool:
    return len(before & now) >= share * min(len(before), len(now))


@dataclass(frozen=True)
class Climb:
    """What a track did: columns of `walkers.postprocess.tables.CLUSTERS`, which says what they mean.

    Unlike ``begin``, ``onset`` and ``qualified`` do not depend on what comes later, so that a longer record has no
    other climbs up to a time than a shorter one. The error of the speed is that of a mean over up to ten equal numbers
    of frames (NaN with less than four). It is too small where the speed changes more slowly than a tenth of the climb
    takes; that begin and end are those of the greatest gain makes the speed of a short and unsteady climb too large.
    """

    begin: float
    end: float
    onset: float
    qualified: float
    gain: float
    speed: float
    standard_error: float
    leader: int
    height: float
    size: int
    large: int
    walls: tuple[int, ...]
    climbed: bool


def classify(
    track: Track,
    time: FloatArray,
    height: FloatArray,
    large: npt.NDArray[np.bool_],
    definition: ClimbCriteria,
) -> Climb:
    """What a track did, and whether it is a climb.

    Parameters
    ----------
    track
        From `follow`.
    time : ndarray, shape (F,)
    height : ndarray, shape (F, N)
        Of every bead in every frame, m.
    large : ndarray of bool, shape (N,)
    definition
        What counts.
    """
    if not track.frames:
        raise ValueError("a track without a frame")
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
    last, members = track.frames[end], track.members[end]
    return Climb(
        begin=float(time[track.frames[begin]]),
        end=float(time[last]),
        onset=onset,
        qualified=qualified,
        gain=float(risen[end]),
        speed=speed,
        standard_error=error,
        leader=leader,
        height=float(height[last, leader]),
        size=len(members),
        large=int(large[list(members)].sum()),
        walls=tuple(sorted(track.walls[end])),
        climbed=moments is not None,
    )


def _qualified(gained: FloatArray, min_rise: float) -> tuple[int, int] | None:
    """Where what makes a track a climb begins, and the first place up to which it is one; None if it never is.

    Given the height that it gained since its begin, m.

    There it is farther above its lowest than ever before, by enough, and that took frames enough: a hop between two
    frames is none.
    """
    places, least = np.arange(len(gained)), np.minimum.accumulate(gained)
    risen = gained - least
    lowest = np.maximum.accumulate(np.where(np.diff(least, prepend=np.inf) < 0.0, places, 0))
    farthest = risen == np.maximum.accumulate(risen)
    found = np.flatnonzero(farthest & (risen >= min_rise) & (places - lowest + 1 >= _FEWEST_FRAMES))
    return (int(lowest[found[0]]), int(found[0])) if len(found) else None


def _gained(track: Track, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Height gained since a track's first frame (m) and the seconds in which it was, shape (frames of the track,).

    What is gained while it is no cluster does not count, nor does the time; what is lost then does.
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
    """Gain over time, and its standard error from those of equal numbers of frames; NaN where there are too few."""
    whole = seconds[-1] - seconds[0]
    if len(gained) < _FEWEST_FRAMES or whole == 0.0:
        return float("nan"), float("nan")
    speed = float((gained[-1] - gained[0]) / whole)
    blocks = min(_MOST_BLOCKS, len(gained) - 1)
    if blocks < _FEWEST_BLOCKS:
        return speed, float("nan")
    edges = np.linspace(0, len(gained) - 1, blocks + 1).round().astype(int)
    lasted, risen = np.diff(seconds[edges]), np.diff(gained[edges])
    there = lasted > 0.0
    if there.sum() < _FEWEST_BLOCKS:
        return speed, float("nan")
    speeds, shares = risen[there] / lasted[there], lasted[there] / lasted[there].sum()
    return speed, float(np.sqrt((shares**2 * (speeds - speed) ** 2).sum() * there.sum() / (there.sum() - 1)))
