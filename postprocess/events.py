"""What happens to the clusters of a pile: they come free, part, merge, return to the pile or let go of the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from postprocess.clusters import Definition, Track

FloatArray = npt.NDArray[np.float64]
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
        another track), ``rejoined`` (the pile), ``let go`` (of the walls, or its beads parted).
    track
        Number of the track.
    other
        Number of the other track; None where there is none.
    """

    time: float
    kind: Literal["freed", "split", "merged", "rejoined", "let go"]
    track: int
    other: int | None = None


def events_of(
    tracks: Sequence[Track], time: FloatArray, bulk: Sequence[BoolArray], definition: Definition
) -> list[Event]:
    """The events of all tracks in the order of time.

    A cluster that is free and held in the last frame goes on: its end is no event.

    Parameters
    ----------
    tracks
        From `postprocess.clusters.follow`.
    time : ndarray, shape (F,)
        s.
    bulk
        Of each frame, which beads belong to the bulk.
    definition
        That of the tracks: how long a moment is.
    """
    events = []
    for number, track in enumerate(tracks):
        parent = _parent(tracks, number, time, definition)
        born = float(time[track.frames[0]])
        events.append(Event(born, "freed", number) if parent is None else Event(born, "split", number, parent))
        after = track.frames[-1] + 1
        if after == len(time):
            continue
        ended = float(time[after])
        if track.merged_into is not None:
            events.append(Event(ended, "merged", number, track.merged_into))
            continue
        back = bulk[after][list(track.members[-1])]
        events.append(Event(ended, "rejoined" if back.mean() >= definition.same else "let go", number))
    return sorted(events, key=lambda event: (event.time, event.track))


def _parent(tracks: Sequence[Track], number: int, time: FloatArray, definition: Definition) -> int | None:
    """The track that held most of another one's beads shortly before it began."""
    first, members = tracks[number].frames[0], tracks[number].members[0]
    for other, track in enumerate(tracks):
        before = [place for place, frame in enumerate(track.frames) if frame < first]
        if other == number or not before or time[first] - time[track.frames[before[-1]]] > definition.brush:
            continue
        if len(track.members[before[-1]] & members) >= definition.same * len(members):
            return other
    return None
