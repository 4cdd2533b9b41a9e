"""Which moments of a run a film shows, and where the beads are then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion
from walkers.postprocess.rolling import follows_cycles
from walkers.postprocess.scene import round_below

_SECONDS = 10.0
"""A film lasts so long, or less, if no slowdown is given."""
_LEAST_SEEN = 10.0
"""Recorded frames a second of a film whose slowdown is not given, where moments between them are not known."""


@dataclass(frozen=True)
class FilmTimes:
    """The moments of a film.

    Attributes
    ----------
    time : ndarray, shape (K,)
        Physical time of each picture, s.
    frame : ndarray of int, shape (K,)
        Number of the frame of the motion that it shows, or that comes before it.
    share : ndarray, shape (K,)
        How far it is from there to the next one, 0 to 1; 0 where the motion between frames is not known.
    slowdown
        How many times slower than in reality the film runs.
    stroboscopic
        Whether all pictures are at one phase of the drive.
    """

    time: FloatArray
    frame: np.ndarray[tuple[int], np.dtype[np.int64]]
    share: FloatArray
    slowdown: float
    stroboscopic: bool


def film_times(
    motion: Motion, fps: float, slowdown: float | None = None, begin: float = 0.0, end: float | None = None
) -> FilmTimes:
    """Spread the pictures of a film over a motion.

    Pictures that are half a cycle apart or more are moved to whole cycles, as a stroboscope would show them; else the
    shaking would beat with the pictures. Where frames are so rare that they do not follow a cycle each picture is the
    nearest frame.

    Parameters
    ----------
    motion
        While it is driven.
    fps
        Pictures a second.
    slowdown
        How many times slower than in reality; if None, 1, 2, 5, 10 … such that the film lasts 5 to 10 s.
    begin, end
        Physical time, s; to the end of the run if None.

    Raises
    ------
    InputError
        If nothing of the run is between begin and end.
    """
    last = float(motion.time[-1])
    if not (0.0 <= begin < last and begin < (last if end is None else end)):
        message = f"nothing to show: expected times within the drive, 0 to {last:.4g} s, --from before --until"
        raise InputError("--from, --until", [Problem("", None, message)])
    end = last if end is None else min(end, last)
    follows = follows_cycles(motion)
    if slowdown is None:
        slowdown = _usual_slowdown(end - begin, None if follows else float(np.median(np.diff(motion.time))))
    interval, cycle = 1.0 / (fps * slowdown), 1.0 / motion.case.drive.frequency
    time = begin + interval * np.arange(int((end - begin) / interval + 1e-9) + 1)
    strobed = interval >= cycle / 2.0
    if strobed:
        time = np.round(time / cycle) * cycle
    time = np.clip(time, motion.time[0], last)
    if follows:
        frame = np.clip(np.searchsorted(motion.time, time + 1e-12, side="right") - 1, 0, len(motion.time) - 2)
        share = (time - motion.time[frame]) / (motion.time[frame + 1] - motion.time[frame])
    else:
        frame = np.abs(motion.time[:, None] - time).argmin(axis=0)
        time, share = motion.time[frame], np.zeros(len(frame))
    one_phase = strobed or motion.case.run.samples_per_cycle == 1
    return FilmTimes(time, frame.astype(np.int64), np.clip(share, 0.0, 1.0), slowdown, one_phase)


def _usual_slowdown(seconds: float, between: float | None) -> float:
    """The largest of 1, 2, 5, 10 … that makes no film of more than 10 s; less if too few frames were recorded."""
    largest = _SECONDS / seconds
    if between is not None:
        largest = min(largest, 1.0 / (_LEAST_SEEN * between))
    return max(1.0, round_below(largest))


def positions_at(motion: Motion, frame: int, share: float) -> FloatArray:
    """Centres between a frame and the next one, m, shape (N, 3): the cubic through their places and velocities."""
    part = motion.select(slice(frame, frame + 2)).between(share) if share else motion.select(slice(frame, frame + 1))
    place: FloatArray = part.position[0]
    return place
