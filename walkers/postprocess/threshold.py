"""The threshold of motion in one run: a ramp lowers the drive slowly until walkers stop, or raises it until they start.

A window is a few cycles. A walker moves in it if it is faster than `walkers.postprocess.sides.REST`. It stops at the
end of the last window in which it moves while the drive falls, and starts at the begin of the first one in which it
moves while the drive rises, if it rests in others. The resolution is the change of the drive in this window.
"""

from __future__ import annotations

from math import nan

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.postprocess.dump import BoolArray, FloatArray
from walkers.postprocess.gait import distance_walked
from walkers.postprocess.motion import Motion
from walkers.postprocess.numbers import Measured
from walkers.postprocess.sides import REST

WINDOW = 8
"""Cycles of a window."""


def applies(case: Case) -> bool:
    """Whether a case has walkers, and a drive with a ramp."""
    return bool(case.walkers and case.drive.ramp) and case.run.cycles_per_sample == 1


def derived(case: Case) -> dict[str, float]:  # noqa: ARG001
    """Nothing follows from the case alone."""
    return {}


def measure(motion: Motion) -> Measured:
    """The table ``ramp`` and the numbers: means over the walkers that stop or start."""
    drive, walked = motion.case.excitation, [distance_walked(group) for group in motion.groups]
    times, whole = walked[0][0][::WINDOW], np.concatenate([distance[::WINDOW] for _, distance in walked], axis=1)
    velocity = np.diff(whole, axis=0) / np.diff(times)[:, None]
    peaks = drive.factor(times) * drive.peak_acceleration / (drive.largest_factor or 1.0)
    middle = (peaks[1:] + peaks[:-1]) / 2.0
    owner = [walker.walker for group in motion.groups for walker in group.walkers]
    columns = {
        "walker": np.repeat(owner, len(middle)),
        "time": np.tile((times[1:] + times[:-1]) / 2.0, len(owner)),
        "peak_acceleration": np.tile(middle, len(owner)),
        "velocity": velocity.T.reshape(-1),
    }
    moves, change = np.abs(velocity) > REST, np.diff(peaks)
    stops, stops_within = _crossed(moves[change < 0.0], peaks[1:][change < 0.0], -change[change < 0.0])
    rises = np.flatnonzero(change > 0.0)[::-1]
    starts, starts_within = _crossed(moves[rises], peaks[rises], change[rises])
    numbers = {"stops_at": stops, "stops_within": stops_within, "starts_at": starts, "starts_within": starts_within}
    if len(motion.case.walkers[0].radii) == 2:
        gamma0 = dimer_of(motion.case).gamma0
        numbers |= {f"gamma0_{name}": gamma0(number) for name, number in numbers.items()}
    return Measured({"ramp": columns}, numbers)


def _crossed(moves: BoolArray, peaks: FloatArray, change: FloatArray) -> tuple[float, float]:
    """Mean drive of walkers at the end of the last window in which they move, if they rest after; and its change."""
    ends = len(moves) - 1 - np.argmax(moves[::-1], axis=0) if len(moves) else np.zeros(0, dtype=np.int64)
    ends = ends[[bool(column.any()) and end < len(moves) - 1 for column, end in zip(moves.T, ends, strict=False)]]
    return (float(peaks[ends].mean()), float(change[ends].mean())) if len(ends) else (nan, nan)
