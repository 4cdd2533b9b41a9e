"""What happens to the clusters of a pile: they come free, split, merge, return to the pile or detach from the wall."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from walkers.postprocess.clusters import ClimbCriteria, Track
from walkers.postprocess.dump import FloatArray

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Event:
    """Something that happened to a track.

    Attributes
    ----------
    time
        s.
    kind
        ``freed`` (came free of the pile, or reached a wall), ``split`` (parted from another track), ``merged`` (into
        another track), ``rejoined`` (the pile), ``detached`` (of the walls, or its beads parted).
    track
        Number of the track.
    other
        Number of the other track; None where there is none.
    """

    time: float
    kind: Literal["freed", "split", "merged", "rejoined", "detached"]
    track: int
    other: int | None = None


def events_of(
    tracks: Sequence[Track], time: FloatArray, bulk: Sequence[BoolArray], definition: ClimbCriteria, first: int = 0
) -> list[Event]:
    """The events of all tracks in the order of time.

    A cluster that is free and held in the first frame that counts was so before, and one that may still be within a
    brush in the last frame goes on: these begins and ends are no events.

    Parameters
    ----------
    tracks
        From `walkers.postprocess.clusters.follow`.
    time : ndarray, shape (F,)
        s.
    bulk
        Of each frame, which beads belong to the bulk.
    definition
        That of the tracks: how long a moment is.
    first
        The first frame that counts.
    """
    events = []
    for number, track in enumerate(tracks):
        born, parent = track.frames[0], _parent(tracks, number, time, definition)
        if parent is not None:
            events.append(Event(float(time[born]), "split", number, parent))
        elif born > first:
            events.append(Event(float(time[born]), "freed", number))
        if track.merged_at is not None:
            events.append(Event(float(time[track.merged_at]), "merged", number, track.merged_into))
        elif time[-1] - time[track.frames[-1]] > definition.max_gap:
            events.append(_end(number, track, time, bulk, definition))
    return sorted(events, key=lambda event: (event.time, event.track))


def _end(number: int, track: Track, time: FloatArray, bulk: Sequence[BoolArray], definition: ClimbCriteria) -> Event:
    """How a track ended: on the pile, if most of its beads were there when it could no longer be the same."""
    after = track.frames[-1] + 1
    until = int(np.searchsorted(time, time[track.frames[-1]] + definition.max_gap, side="right"))
    members = list(track.members[-1])
    back = any(
        bulk[frame][members].mean() >= definition.min_overlap for frame in range(after, min(until, len(time) - 1) + 1)
    )
    return Event(float(time[after]), "rejoined" if back else "detached", number)


def _parent(tracks: Sequence[Track], number: int, time: FloatArray, definition: ClimbCriteria) -> int | None:
    """The track that held most of another one's beads shortly before it began."""
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
