"""The threshold of motion: the drive at which walkers stop or start, from one run.

The drive falls slowly until walkers stop, or rises until they start, by a ramp or because the
amplitude of a record changes. Its strength is the local amplitude of its acceleration
(`walkers.inputs.tables.drive.Excitation.local_amplitude`).

A window is a few cycles. A walker moves in it if it is faster than
`walkers.postprocess.measure.sides.REST`. It stops at the end of the last window in which it moves
while the drive falls, and starts at the start of the first window in which it moves while the drive
rises, if it rests in others. The resolution is the change of the drive in this window.
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
from walkers.postprocess.measure.tables import Columns

NAME = "threshold"
VERSION = 2

WINDOW_CYCLES = 8
"""Cycles of a window."""
_COARSE = 0.3
"""Resolution over threshold above which the resolution is told as a doubt."""
_EXACT = 1e-9
"""Largest change of a constant drive with a ramp, over its strength: rounding errors."""
_REVERSAL = 0.05
"""Largest reversal of a falling or rising record that is noise, over the largest amplitude."""


def applies(case: Case) -> bool:
    """Tell whether a case has walkers, and a drive whose strength changes."""
    return bool(case.walkers and case.excitation.changes) and case.run.cycles_per_sample == 1


def derived(case: Case) -> dict[str, float]:  # noqa: ARG001
    """Nothing follows from the case alone."""
    return {}


def measure(motion: Motion) -> Measurement:
    """Measure the drives at which walkers stop and start.

    Parameters
    ----------
    motion
        Motion of walkers under a drive whose strength changes.

    Returns
    -------
    Measurement
        The table ``ramp``, and the numbers of the group ``threshold``: means over the walkers that
        stop or start. If the amplitude of a record changes, but no walker stops or starts, there
        are no numbers: the mean velocity stands, with a warning.
    """
    drive = motion.case.excitation
    distances = []
    for group in motion.groups:
        time_of_cycles, distance = distance_walked(group)
        times = time_of_cycles[::WINDOW_CYCLES]  # they are the same for all kinds
        distances.append(distance[::WINDOW_CYCLES])
    velocity = np.diff(np.concatenate(distances, axis=1), axis=0) / np.diff(times)[:, None]
    peaks = drive.local_amplitude(times)
    tables = {"ramp": _ramp_table(motion, times, peaks, velocity)}

    thresholds = _thresholds(np.abs(velocity) > REST, peaks, by_ramp=bool(drive.ramp))
    has_threshold = any(isfinite(threshold) for threshold in thresholds.values())
    if not drive.ramp and not has_threshold:
        lowest = peaks.min() / ACCELERATION_OF_ONE_G
        highest = peaks.max() / ACCELERATION_OF_ONE_G
        warning = (
            "the amplitude of the strongest line of the record lies between "
            f"{lowest:.3g} and {highest:.3g} g: the velocity is a mean over different drives"
        )
        return Measurement(tables, {}, (warning,))

    numbers = dict(thresholds)
    if len(motion.case.walkers[0].radii) == 2:
        gamma0 = dimer_of(motion.case).gamma0
        for name, threshold in thresholds.items():
            numbers[f"gamma0_{name}"] = gamma0(threshold)
    return Measurement(tables, numbers, _doubts(thresholds))


def _ramp_table(
    motion: Motion, times: FloatArray, peaks: FloatArray, velocity: FloatArray
) -> Columns:
    """Table ``ramp``: velocity of each walker in each of K windows.

    ``times`` (s) and ``peaks`` (m/s²) are at the ends of the windows, shape (K + 1,); ``velocity``
    (m/s) has the shape (K, W).
    """
    middle_times = (times[1:] + times[:-1]) / 2.0
    middle_peaks = (peaks[1:] + peaks[:-1]) / 2.0
    numbers = np.concatenate([group.walker_numbers for group in motion.groups])
    return {
        "walker": np.repeat(numbers, len(middle_times)),
        "time": np.tile(middle_times, len(numbers)),
        "peak_acceleration": np.tile(middle_peaks, len(numbers)),
        "velocity": velocity.T.reshape(-1),
    }


def _doubts(thresholds: dict[str, float]) -> tuple[str, ...]:
    """Warnings about thresholds (m/s²) whose resolution is coarse."""
    doubts = []
    for verb in ("stops", "starts"):
        resolution = thresholds[f"{verb}_within"]
        if resolution > _COARSE * thresholds[f"{verb}_at"]:
            change = f"{resolution / ACCELERATION_OF_ONE_G:.2g} g in {WINDOW_CYCLES} cycles"
            doubts.append(
                f"the drive at which a walker {verb} is uncertain: it changes by {change}"
            )
    return tuple(doubts)


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
    # Rises are taken backward in time: then a walker that starts comes to rest, as one that stops.
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
    """Tell in which windows the drive rises and falls.

    It rises from a minimum to the next maximum, and falls from a maximum to the next minimum.
    Smaller reversals than the noise count as going on: a small rise in a fall is part of the fall.
    Windows in which the drive stays exactly as it is are a plateau, where it does neither.

    Parameters
    ----------
    peaks : ndarray, shape (K + 1,)
        Amplitude of the drive at the ends of K windows, m/s².
    noise
        Largest change that does not count as a reversal, m/s².

    Returns
    -------
    ndarray of int, shape (K,)
        1 where the drive rises, -1 where it falls, 0 where it does neither.
    """
    direction = np.zeros(len(peaks) - 1, dtype=np.int64)
    current = 0  # direction since the last turn; 0 before it is known
    last_turn = 0
    highest = 0  # places of the extremes since the last turn
    lowest = 0
    for number, peak in enumerate(peaks.tolist()):
        if peak > peaks[highest]:
            highest = number
        if peak < peaks[lowest]:
            lowest = number
        if current >= 0 and peak < peaks[highest] - noise:  # the maximum is behind
            direction[last_turn:highest] = current
            last_turn = highest
            lowest = number
            current = -1
        elif current <= 0 and peak > peaks[lowest] + noise:  # the minimum is behind
            direction[last_turn:lowest] = current
            last_turn = lowest
            highest = number
            current = 1
    last_extreme = highest if current > 0 else lowest
    direction[last_turn:last_extreme] = current
    direction[np.diff(peaks) == 0.0] = 0
    return direction


def _crossed(moves: BoolArray, peaks: FloatArray, change: FloatArray) -> tuple[float, float]:
    """Mean drive in the last window in which walkers move, of those that rest afterwards.

    Parameters
    ----------
    moves : ndarray of bool, shape (K, W)
        Whether walkers move in each window.
    peaks : ndarray, shape (K,)
        Amplitude of the drive at the end of each window, m/s².
    change : ndarray, shape (K,)
        Change of the drive in each window, m/s².

    Returns
    -------
    float, float
        Mean amplitude and mean change over these walkers, m/s²; NaN if there are none.
    """
    if len(moves) == 0:
        return nan, nan
    last_moving = len(moves) - 1 - np.argmax(moves[::-1], axis=0)
    rests_afterwards = moves.any(axis=0) & (last_moving < len(moves) - 1)
    windows = last_moving[rests_afterwards]
    if len(windows) == 0:
        return nan, nan
    return float(peaks[windows].mean()), float(change[windows].mean())
