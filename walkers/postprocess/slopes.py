"""Slopes of what walkers cumulate, such as the distance walked, and their standard errors."""

from __future__ import annotations

import numpy as np

from walkers.postprocess.dump import FloatArray

_PARTLY = np.linspace(-0.95, -0.1, 9)
_LASTING = np.linspace(0.1, 0.9, 9)
_MODELS = np.array(
    [
        (0.0, 0.0, 2.0),
        (0.0, -1.0, 1.0),
        *((0.0, theta, 1.0 / len(_PARTLY)) for theta in _PARTLY),
        *((phi, 0.0, 1.0 / len(_LASTING)) for phi in _LASTING),
    ]
).T
"""What steps may be, φ, θ and a weight beforehand: independent; differences of independent positions; some of both;
autocorrelated. The first is twice as likely as each of the others."""
_TINY = 1e-300


def fit_slopes(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes of the columns of ``values`` against time (least squares) and their standard errors.

    Values are cumulated step by step, so that their residuals are anything but independent, as the textbook's error
    takes them: of forty random steps it is eight times too small. The slope is Σ c_s d_s of the steps d_s,
    c_s = Σ_{t > s} (t − t̄)/Σ (t − t̄)², its variance cᵀ Γ c. Γ is that of an autoregressive moving average,
    d_s − v = φ (d_{s−1} − v) + e_s + θ e_{s−1}, averaged over φ and θ with their restricted likelihoods (v and the
    variance of e integrated out; Patterson and Thompson 1971, doi 10.1093/biomet/58.3.545), which the innovations give
    (Brockwell and Davis 1991, doi 10.1007/978-1-4419-0320-4, chapter 5). Few steps do not tell random ones from noise
    about a steady walk; the error is then nearer to that of random steps, the larger one.

    Parameters
    ----------
    time : ndarray, shape (N,)
        s; equally spaced.
    values : ndarray, shape (N, K)

    Returns
    -------
    slope, standard_error : ndarray, shape (K,)
        The error is NaN for fewer than three points.
    """
    # Moving the origin keeps rounding out of the sums: positions reach metres, steps micrometres.
    time, values = time - time.mean(), values - values.mean(axis=0)
    square = float(np.sum(time**2))
    slope = time @ values / square
    if len(time) < 3:
        return slope, np.full(slope.shape, np.nan)
    weights = np.cumsum(time[::-1])[::-1][1:] / square
    return slope, np.sqrt(_variance(np.diff(values, axis=0), weights))


def _variance(steps: FloatArray, weights: FloatArray) -> FloatArray:
    """Of sums of steps (N, K), weighted (N,), averaged over the models: shape (K,)."""
    phi, theta, before = _MODELS
    squares, logarithm = _innovations(steps - steps.mean(axis=0), phi, theta)
    likelihood = np.log(before)[:, None] + logarithm[:, None] - 0.5 * (len(steps) - 1) * np.log(squares)
    share = np.exp(likelihood - likelihood.max(axis=0))
    share /= share.sum(axis=0)
    # Autocovariances of steps whose e has a variance of one, times those of the weights.
    own = np.correlate(weights, weights, "full")[len(weights) - 1 :]
    next_one = (1.0 + phi * theta) * (phi + theta) / (1.0 - phi**2)
    later = phi[:, None] ** np.arange(len(steps) - 1) @ own[1:]
    variance = _of_one_step(phi, theta) * own[0] + 2.0 * next_one * later
    return np.asarray((share * variance[:, None] * squares).sum(axis=0) / (len(steps) - 1))


def _of_one_step(phi: FloatArray, theta: FloatArray) -> FloatArray:
    """The variance of a step if that of e is one."""
    return np.asarray((1.0 + 2.0 * phi * theta + theta**2) / (1.0 - phi**2))


def _innovations(steps: FloatArray, phi: FloatArray, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squares of standardised innovations, shape (M, K), and the likelihoods' logarithms without them, shape (M,).

    The common mean of the steps is taken out by generalised least squares: a column of ones goes with them.
    """
    columns = np.concatenate([steps, np.ones((len(steps), 1))], axis=1)
    variance, expected = _of_one_step(phi, theta), np.zeros((len(phi), columns.shape[1]))
    squares, cross, logarithm = np.zeros_like(expected), np.zeros_like(expected), np.zeros(len(phi))
    for row in columns:
        innovation = row - expected
        squares += innovation**2 / variance[:, None]
        cross += innovation * innovation[:, -1:] / variance[:, None]
        logarithm -= 0.5 * np.log(variance)
        expected = phi[:, None] * row + (theta / variance)[:, None] * innovation
        variance = 1.0 + theta**2 - theta**2 / variance
    ones = squares[:, -1]
    left = squares[:, :-1] - cross[:, :-1] ** 2 / ones[:, None]
    return np.maximum(left, _TINY), logarithm - 0.5 * np.log(ones)
