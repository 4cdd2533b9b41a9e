"""What depends on what: Sobol indices over the feasible part of the range."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from walkers.calibration.emulator import Emulators
from walkers.calibration.space import Space

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_POINTS, _ALONG, _BINS, _AT_ONCE = 4096, 16, 32, 1024
_FEW = 10 * _BINS


def sobol_indices(emulators: Emulators, space: Space, seed: int) -> FloatArray:
    """How much of each observation's variance depends on each parameter, where the observation can be made.

    Points X are uniform over the part of the cube in which the observation is feasible with a probability of more than
    one half, and y is the emulators' transformed residual there. As that part is no cube, parameters depend on each
    other in it, and estimators that mix the coordinates of two samples (Saltelli's) do not hold. Taken are

    - first order, Var(E[y | x_i])/Var(y): the variance of the means in 32 parts of equal probability of x_i, less what
      as many means of nothing would vary (Plischke, Borgonovo and Smith 2013, doi 10.1016/j.ejor.2012.11.047);
    - total order, E[Var(y | all but x_i)]/Var(y): the variance along lines through the points in the direction of x_i,
      as far as they are feasible (Kucherenko, Tarantola and Annoni 2012, doi 10.1016/j.cpc.2011.12.020).

    With dependent parameters neither bounds the other: what two of them say alike counts in both first orders and in no
    total.

    Returns
    -------
    ndarray, shape (2, K, D)
        First order: alone; total order: with all others known. NaN where hardly anything is feasible.
    """
    points = qmc.Sobol(space.dimensions, rng=np.random.default_rng(seed)).random(_POINTS)
    value, feasible = _respond(emulators, points)
    first = _first_order(points, value, feasible)
    total = np.full(first.shape, np.nan)
    # Through the first of the points only: each line is of sixteen.
    base = points[: _POINTS // 8]
    places = (np.arange(_ALONG) + 0.5) / _ALONG
    for one in range(space.dimensions):
        lines = np.repeat(base, _ALONG, axis=0)
        lines[:, one] = np.tile(places, len(base))
        along, allowed = _respond(emulators, lines)
        shape = (len(base), _ALONG, len(emulators))
        varies = _mean_variance(along.reshape(shape), allowed.reshape(shape), feasible[: len(base)])
        total[:, one] = varies / _variance(value, feasible)
    return np.asarray(np.clip(np.stack([first, total]), 0.0, 1.0))


def _respond(emulators: Emulators, points: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Transformed residuals, and whether they are feasible, each of shape (N, K)."""
    parts = [points[start : start + _AT_ONCE] for start in range(0, len(points), _AT_ONCE)]
    value = np.concatenate([emulators.predict(part)[0] for part in parts])
    return value, np.concatenate([emulators.feasibility.probability(part) > 0.5 for part in parts])


def _variance(value: FloatArray, feasible: BoolArray) -> FloatArray:
    """Of the feasible values of each observation, shape (K,); NaN where these are few or all the same."""
    counts = feasible.sum(axis=0)
    mean = np.where(feasible, value, 0.0).sum(axis=0) / np.maximum(counts, 1)
    variance = np.where(feasible, (value - mean) ** 2, 0.0).sum(axis=0) / np.maximum(counts, 1)
    return np.where((counts >= _FEW) & (variance > 0.0), variance, np.nan)


def _first_order(points: FloatArray, value: FloatArray, feasible: BoolArray) -> FloatArray:
    """Shape (K, D)."""
    found = np.full((value.shape[1], points.shape[1]), np.nan)
    for k, variance in enumerate(_variance(value, feasible)):
        if np.isnan(variance):
            continue
        known, y = points[feasible[:, k]], value[feasible[:, k], k]
        for i in range(points.shape[1]):
            parts = np.array_split(y[np.argsort(known[:, i])], _BINS)
            means, counts = np.array([part.mean() for part in parts]), np.array([len(part) for part in parts])
            within = np.mean([part.var(ddof=1) for part in parts])
            between = np.sum(counts * (means - y.mean()) ** 2) / len(y)
            found[k, i] = (between - (_BINS - 1) / len(y) * within) / variance
    return found


def _mean_variance(along: FloatArray, allowed: BoolArray, base: BoolArray) -> FloatArray:
    """Mean over lines (L, A, K) of the variance along each, over the feasible lines through base points (L, K)."""
    counts = allowed.sum(axis=1)
    mean = np.where(allowed, along, 0.0).sum(axis=1) / np.maximum(counts, 1)
    variance = np.where(allowed, (along - mean[:, None]) ** 2, 0.0).sum(axis=1) / np.maximum(counts, 1)
    return np.asarray(np.where(base, variance, 0.0).sum(axis=0) / np.maximum(base.sum(axis=0), 1))
