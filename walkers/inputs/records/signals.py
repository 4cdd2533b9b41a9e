"""Numerics of sampled signals: Hann-weighted means, slow parts and local amplitudes.

The functions take evenly spaced samples, one signal a column. They know nothing of records and
their files.

A Hann window weights with sin²(πt/T) over its width T. It suppresses a sine of n periods in the
window by 1/(π n (n² - 1)) at worst, and entirely if n is a whole number above one. A plain mean
only suppresses it by 1/(π n).
"""

from __future__ import annotations

from math import pi
from typing import TypeVar, cast

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray

ComplexArray = npt.NDArray[np.complex128]
Samples = TypeVar("Samples", FloatArray, ComplexArray)


def hann(points: int) -> FloatArray:
    """Weights of a Hann window, shape (points,), with a sum of one and no zeros at its ends."""
    weights = np.sin(pi * np.arange(1, points + 1) / (points + 1)) ** 2
    return np.asarray(weights / weights.sum())


def leakage(periods: FloatArray) -> FloatArray:
    """Largest share of the amplitude of a sine in its Hann-weighted mean.

    Parameters
    ----------
    periods : ndarray
        Number of periods of the sine over which the mean is taken, at least two.

    Returns
    -------
    ndarray
        A share for each number.
    """
    return np.asarray(1.0 / (pi * periods * (periods**2 - 1.0)))


def hann_mean(samples: FloatArray) -> FloatArray:
    """Hann-weighted mean of samples, shape (N, K), over time: shape (K,)."""
    return np.asarray(hann(len(samples)) @ samples)


def slow_part(samples: FloatArray, width: int) -> FloatArray:
    """The part of signals that changes slowly compared with a window.

    This is the Hann-weighted mean in a window around each sample. Closer than half a window to an
    end, it is the straight line that fits the first or last whole window with Hann weights. What
    is left of the signals is smoothed in the same way and added, so that a parabola comes out
    exactly, away from the ends.

    Parameters
    ----------
    samples : ndarray, shape (N, K)
        Evenly spaced signals.
    width
        Number of samples in a window. It is reduced to an odd number, and to all samples if there
        are fewer.

    Returns
    -------
    ndarray, shape (N, K)
        It contains nothing of a motion with two or more periods in a window, three quarters of a
        motion with one period, and slower motions entirely.
    """
    first = _smoothed(samples, width)
    return first + _smoothed(samples - first, width)


def _smoothed(samples: FloatArray, width: int) -> FloatArray:
    """Hann-weighted means around each sample, and straight lines near both ends, shape (N, K).

    ``samples`` (N, K) are evenly spaced; ``width`` is the number of samples in a window.
    """
    weights = _centred_window(samples, width)
    points = len(weights)
    middle = _convolved(samples, weights)
    offset = np.arange(points) - (points - 1) / 2.0
    slope = weights * offset / np.sum(weights * offset**2)
    first = middle[0] + np.outer(offset, slope @ samples[:points])
    last = middle[-1] + np.outer(offset, slope @ samples[-points:])
    before = points // 2
    after = len(samples) - len(middle) - before
    return np.concatenate([first[:before], middle, last[points - after :]])


def _centred_window(samples: FloatArray, width: int) -> FloatArray:
    """Weights of the widest Hann window of an odd number of samples, one of them in its middle."""
    points = min(width, len(samples))
    if points % 2 == 0:
        points -= 1
    return hann(points)


def local_amplitude(samples: FloatArray, frequency: float, width: int) -> FloatArray:
    """Amplitude of the component at one frequency in a Hann window around each sample.

    Parameters
    ----------
    samples : ndarray, shape (N, K)
        Evenly spaced components of one vector.
    frequency
        In cycles per sample.
    width
        Number of samples in a window. It is reduced to an odd number, and to all samples if there
        are fewer. Closer than half of it to an end, the amplitude is that of the first or last
        whole window.

    Returns
    -------
    ndarray, shape (N,)
        Largest length of the vector in a cycle.
    """
    weights = _centred_window(samples, width)
    demodulated = samples * np.exp(-2j * pi * frequency * np.arange(len(samples)))[:, None]
    phasor = 2.0 * _convolved(demodulated, weights)
    amplitude = longest(phasor)
    before = len(weights) // 2
    return np.pad(amplitude, (before, len(samples) - len(amplitude) - before), "edge")


def periods_by_phase(samples: FloatArray, periods: float) -> float:
    """Number of periods of a line in all samples, from the change of its phase between both halves.

    Parameters
    ----------
    samples : ndarray, shape (N, K)
        Evenly spaced components of one vector.
    periods
        An estimate that is off by less than one.

    Returns
    -------
    float
        The number, which need not be whole.
    """
    half = len(samples) // 2
    weights = hann(half)
    start_of_second = len(samples) - half
    number = np.arange(len(samples))
    for _ in range(2):
        demodulated = samples * np.exp(-2j * pi * periods / len(samples) * number)[:, None]
        first = weights @ demodulated[:half]
        second = weights @ demodulated[start_of_second:]
        turn = float(np.angle(np.vdot(first, second)))
        periods += turn / (2.0 * pi) * len(samples) / start_of_second
    return periods


def longest(phasor: ComplexArray) -> FloatArray:
    """Largest length of vectors Re(phasor exp(iωt)) in a cycle.

    Such a vector describes an ellipse, and is longest along its semi-major axis.

    Parameters
    ----------
    phasor : ndarray, shape (N, K)
        Complex components of each vector.

    Returns
    -------
    ndarray, shape (N,)
        In the unit of the phasors.
    """
    squares = np.sum(np.abs(phasor) ** 2, axis=1)
    return np.asarray(np.sqrt((squares + np.abs(np.sum(phasor**2, axis=1))) / 2.0))


def _convolved(samples: Samples, weights: FloatArray) -> Samples:
    """Weighted means of all whole windows, shape (N - width + 1, K)."""
    from scipy.signal import oaconvolve

    return cast(Samples, oaconvolve(samples, weights[:, None], mode="valid", axes=0))
