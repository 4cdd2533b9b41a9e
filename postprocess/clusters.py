"""Clusters that are free of the pile, followed through time, and what counts as a climb.

A *cluster* is a connected component of the beads' bridges (touching or open) of at least two beads that is *free*
of the pile's bulk: the component of most beads, and all that is bridged to the floor. It is *held* if a bridge joins
one of its beads to a side wall. A *track* is a cluster followed by its beads: from frame to frame it is the one that
shares most of them. What is no cluster for a moment only, because its tail brushes the pile or it lets go of the wall,
for no longer than `Definition.brush`, stays the same track.

A *climb* is height gained while free and held: a track whose leader, one of its topmost beads, rose by at least
`Definition.least_gain` between frames that follow each other and in both of which the cluster was free and held. A
column that detaches high and sinks gains none; a bead thrown into the air is not held, nor is what flies for a moment.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from postprocess.pile import FLOOR, Bridges

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Cluster = tuple[frozenset[int], frozenset[int]]
"""The beads of a cluster in a frame and the side walls that hold it."""

_FEWEST_BEADS = 2
_FEWEST_FRAMES = 3
_MOST_BLOCKS, _FEWEST_BLOCKS = 10, 4
"""Shares of a climb from whose speeds the error of its speed is taken."""


@dataclass(frozen=True)
class Definition:
    """Thresholds of what a climb is.

    Attributes
    ----------
    least_gain
        Height, m, that a cluster must gain: about two diameters of the paper's large beads.
    brush
        Seconds for which a cluster may touch the pile or lose the wall and still be the same.
    same
        Share of the smaller one's beads that two clusters must have in common to be one.
    """

    least_gain: float = 2e-3
    brush: float = 0.1
    same: float = 0.5


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
    merged_into
        Number of the track that took over its beads, or None.
    """

    frames: list[int] = field(default_factory=list)
    members: list[frozenset[int]] = field(default_factory=list)
    walls: list[frozenset[int]] = field(default_factory=list)
    merged_into: int | None = None

    def members_at(self, frame: int) -> frozenset[int]:
        """Its beads in a frame; none where it was not free and held."""
        return self.members[self.frames.index(frame)] if frame in self.frames else frozenset()


def components(count: int, bridges: Bridges) -> IntArray:
    """Number of the connected component of each bead, shape (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = bridges.beads[:, 0], bridges.beads[:, 1]
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


def follow(time: FloatArray, clusters: Iterable[Sequence[Cluster]], definition: Definition) -> list[Track]:
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
        alive = [number for number in alive if time[frame] - time[tracks[number].frames[-1]] <= definition.brush]
        # The larger overlap first: of two tracks that meet, the one that gives more beads goes on.
        shared = sorted(
            (
                (len(tracks[number].members[-1] & members), -number, place)
                for number in alive
                for place, (members, _) in enumerate(found)
                if _same(tracks[number].members[-1], members, definition.same)
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
                tracks[number].merged_into = taken[place]
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
    """What a track did.

    Attributes
    ----------
    begin, end : float
        Of the greatest gain of height, s.
    gain : float
        m.
    speed, standard_error : float
        Slope of the leader's height against time within it, m/s; its error from the speeds in up to ten equal shares of
        that time, which are independent where the frames are not (NaN with less than four of them).
    leader : int
        The bead that gained most among those that were topmost at the end or at one of ten moments before.
    height : float
        Of the leader at the end, m.
    size, large : int
        Beads at the end, and how many of them are of the large class.
    walls : tuple of int
        Side walls that held it at the end.
    climbed : bool
        Whether it counts as a climb.
    """

    begin: float
    end: float
    gain: float
    speed: float
    standard_error: float
    leader: int
    height: float
    size: int
    large: int
    walls: tuple[int, ...]
    climbed: bool


def judge(
    track: Track,
    time: FloatArray,
    height: FloatArray,
    large: npt.NDArray[np.bool_],
    definition: Definition,
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
    best: tuple[float, int, int, int] | None = None
    for leader in {max(members, key=lambda bead: height[frame, bead]) for frame, members in _ends(track)}:
        places = [place for place, members in enumerate(track.members) if leader in members]
        z = height[[track.frames[place] for place in places], leader]
        # Height gained: what is gained while it is no cluster does not count.
        adjacent = np.diff([track.frames[place] for place in places]) == 1
        gained = np.concatenate([[0.0], np.cumsum(np.where(adjacent, np.diff(z), np.minimum(np.diff(z), 0.0)))])
        lowest = np.minimum.accumulate(gained)
        end = int(np.argmax(gained - lowest))
        found = (float(gained[end] - lowest[end]), leader, places[int(np.argmin(gained[: end + 1]))], places[end])
        best = found if best is None else max(best, found)
    if best is None:
        raise ValueError("a track without a frame")
    gain, leader, begin, end = best
    span = [track.frames[place] for place in range(begin, end + 1) if leader in track.members[place]]
    speed, error = _slope(time[span], height[span, leader])
    members = track.members[end]
    return Climb(
        begin=float(time[span[0]]),
        end=float(time[span[-1]]),
        gain=gain,
        speed=speed,
        standard_error=error,
        leader=leader,
        height=float(height[span[-1], leader]),
        size=len(members),
        large=int(large[list(members)].sum()),
        walls=tuple(sorted(track.walls[end])),
        climbed=gain >= definition.least_gain and len(span) >= _FEWEST_FRAMES,
    )


def _ends(track: Track) -> list[tuple[int, frozenset[int]]]:
    """A few frames of a track from which leaders are taken: every tenth and the last."""
    places = {*range(0, len(track.frames), max(1, len(track.frames) // 10)), len(track.frames) - 1}
    return [(track.frames[place], track.members[place]) for place in sorted(places)]


def _slope(time: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Slope of a line through points and its standard error; NaN where there are too few points."""
    if len(time) < _FEWEST_FRAMES or np.ptp(time) == 0.0:
        return float("nan"), float("nan")
    slope = float(np.polynomial.Polynomial.fit(time, values, 1).convert().coef[1])
    blocks = min(_MOST_BLOCKS, len(time) - 1)
    if blocks < _FEWEST_BLOCKS:
        return slope, float("nan")
    edges = np.linspace(0, len(time) - 1, blocks + 1).round().astype(int)
    speeds = np.diff(values[edges]) / np.diff(time[edges])
    return slope, float(speeds.std(ddof=1) / np.sqrt(blocks))
