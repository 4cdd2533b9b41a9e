"""The threshold of motion in one run: the drive falls slowly until walkers stop, or rises until they start.

The drive changes by a ramp, or because the amplitude of a record changes. Its strength is the local
amplitude of its acceleration (`walkers.inputs.tables.drive.Excitation.local_amplitude`).

A window is a few cycles. A walker moves in it if it is faster than
`walkers.postprocess.measure.sides.REST`. It stops at the end of the last window in which it moves while the
drive falls, and starts at the begin of the first one in which it moves while the drive rises, if it
rests in others. The resolution is the change of the drive in this window.
"""

from __future__ import annotations

from math import isfinite, nan

import numpy as np

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.gait import distance_walked
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.measure.numbers import Measurement
from walkers.postprocess.measure.sides import REST

NAME = "threshold"
VERSION = 2

WINDOW_CYCLES = 8
"""Cycles of a window."""
_COARSE = 0.3
"""Share of a threshold above which its resolution is told as a doubt."""
_EXACT = 1e-9
"""Largest change of a constant drive with a ramp, over its strength: rounding errors."""
_REVERSAL = 0.05
"""Largest reversal of a falling or rising record that is noise, over the largest amplitude."""


def applies(case: Case) -> bool:
    """Whether a case has walkers, and a drive whose strength changes."""
    return bool(case.walkers and case.excitation.changes) and case.run.cycles_per_sample == 1


def derived(case: Case) -> dict[str, float]:  # noqa: ARG001
    """Nothing follows from the case alone."""
    return {}


def measure(motion: Motion) -> Measurement:
    """The table ``ramp`` and the numbers: means over the walkers that stop or start.

    If the amplitude of a record changes, but no walker stops or starts, there are no numbers: the
    mean velocity stands, with a warning.
    """
    case, drive = motion.case, motion.case.excitation
    walked = [distance_walked(group) for group in motion.groups]
    times = walked[0][0][::WINDOW_CYCLES]
    whole = np.concatenate([distance[::WINDOW_CYCLES] for _, distance in walked], axis=1)
    velocity = np.diff(whole, axis=0) / np.diff(times)[:, None]
    peaks = drive.local_amplitude(times)
    middle = (peaks[1:] + peaks[:-1]) / 2.0
    owner = [walker.walker for group in motion.groups for walker in group.walkers]
    columns = {
        "walker": np.repeat(owner, len(middle)),
        "time": np.tile((times[1:] + times[:-1]) / 2.0, len(owner)),
        "peak_acceleration": np.tile(middle, len(owner)),
        "velocity": velocity.T.reshape(-1),
    }
    numbers = _thresholds(np.abs(velocity) > REST, peaks, by_ramp=bool(drive.ramp))
    if not drive.ramp and not any(map(isfinite, numbers.values())):
        low, high = (amplitude / ACCELERATION_OF_ONE_G for amplitude in (peaks.min(), peaks.max()))
        changing = f"the amplitude of the strongest line of the record lies between {low:.3g} and {high:.3g} g"
        return Measurement(
            {"ramp": columns}, {}, (f"{changing}: the velocity is a mean over different drives",)
        )
    doubts = []
    for verb in ("stops", "starts"):
        within = numbers[f"{verb}_within"]
        if within > _COARSE * numbers[f"{verb}_at"]:
            change = f"{within / ACCELERATION_OF_ONE_G:.2g} g in {WINDOW_CYCLES} cycles"
            doubts.append(
                f"the drive at which a walker {verb} is uncertain: it changes by {change}"
            )
    if len(case.walkers[0].radii) == 2:
        gamma0 = dimer_of(case).gamma0
        numbers |= {f"gamma0_{name}": gamma0(number) for name, number in numbers.items()}
    return Measurement({"ramp": columns}, numbers, tuple(doubts))


def _thresholds(moves: BoolArray, peaks: FloatArray, *, by_ramp: bool) -> dict[str, float]:
    """Drive at which walkers stop and start, m/s², and resolutions; NaN if they do not.

    Parameters
    ----------
    moves : ndarray of bool, shape (K, W)
        Whether walkers move in each window.
    peaks : ndarray, shape (K + 1,)
        Local amplitude of the drive at the ends of the windows, m/s².
    by_ramp
        Whether a ramp changes the drive, so that its amplitude has no noise.
    """
    change = np.diff(peaks)
    noise = (_EXACT if by_ramp else _REVERSAL) * float(peaks.max())
    direction = drive_changes(peaks, noise)
    falls = np.flatnonzero(direction < 0)
    rises = np.flatnonzero(direction > 0)[::-1]
    stops, stops_within = _crossed(moves[falls], peaks[falls + 1], np.abs(change[falls]))
    starts, starts_within = _crossed(moves[rises], peaks[rises], np.abs(change[rises]))
    return {
        "stops_at": stops,
        "stops_within": stops_within,
        "starts_at": starts,
        "starts_within": starts_within,
    }


def drive_changes(peaks: FloatArray, noise: float) -> IntArray:
    """Whether the drive rises (1), falls (-1) or neither (0) in each window, shape (K,) for K windows.

    It rises from a minimum to the next maximum, and falls from a maximum to the next minimum.
    Reversals by ``noise`` or less count as going on: a small rise in a fall is part of the fall.
    Windows in which the drive stays exactly as it is are a plateau: it does neither.

    Parameters
    ----------
    peaks : ndarray, shape (K + 1,)
        Amplitude of the drive at the ends of the windows, m/s².
    noise
        Largest change that is no reversal, m/s².
    """
    direction = np.zeros(len(peaks) - 1, dtype=np.int64)
    highest = lowest = last_turn = 0
    current = 0
    for number, peak in enumerate(peaks.tolist()):
        if peak > peaks[highest]:
            highest = number
        if peak < peaks[lowest]:
            lowest = number
        if current >= 0 and peak < peaks[highest] - noise:  # the maximum is behind
            direction[last_turn:highest] = current
            last_turn, lowest, current = highest, number, -1
        elif current <= 0 and peak > peaks[lowest] + noise:
            direction[last_turn:lowest] = current
            last_turn, highest, current = lowest, number, 1
    direction[last_turn : highest if current > 0 else lowest] = current
    direction[np.diff(peaks) == 0.0] = 0
    return direction


def _crossed(moves: BoolArray, peaks: FloatArray, change: FloatArray) -> tuple[float, float]:
    """Mean drive of walkers at the end of the last window in which they move, if they rest after; and its change."""
    ends = (
        len(moves) - 1 - np.argmax(moves[::-1], axis=0)
        if len(moves)
        else np.zeros(0, dtype=np.int64)
    )
    ends = ends[
        [
            bool(column.any()) and end < len(moves) - 1
            for column, end in zip(moves.T, ends, strict=False)
        ]
    ]
    return (float(peaks[ends].mean()), float(change[ends].mean())) if len(ends) else (nan, nan)
