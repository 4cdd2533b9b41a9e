"""What depends on what: total Sobol indices over the feasible part of the range."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from walkers.calibration.emulator import Emulators
from walkers.calibration.space import Space

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_POINTS, _LINES, _ALONG = 4096, 512, 16
_FEW = 320


def sobol_indices(emulators: Emulators, space: Space, seed: int) -> FloatArray:
    """How much of each observation's variance depends on each parameter, where the observation can be made.

    E[Var(y | all but x_i)]/Var(y), y the emulators' transformed residual at points that are uniform over the part of
    the cube in which the observation is feasible with a probability of more than one half. As that part is no cube,
    parameters depend on each other in it, and estimators that mix the coordinates of two samples (Saltelli's) do not
    hold. Taken is the variance along lines through the points in the direction of x_i, as far as they are feasible
    (Kucherenko, Tarantola and Annoni 2012, doi 10.1016/j.cpc.2011.12.020).

    Returns
    -------
    ndarray, shape (K, D)
        NaN where hardly anything is feasible.
    """
    points = qmc.Sobol(space.dimensions, rng=np.random.default_rng(seed)).random(_POINTS)
    value, feasible = _respond(emulators, points)
    whole = _variance(value, feasible)
    whole[(feasible.sum(axis=0) < _FEW) | (whole == 0.0)] = np.nan
    total = np.full((len(emulators.each), space.dimensions), np.nan)
    lines, base = np.repeat(points[:_LINES], _ALONG, axis=0), feasible[:_LINES]
    for one in range(space.dimensions):
        along = lines.copy()
        along[:, one] = np.tile((np.arange(_ALONG) + 0.5) / _ALONG, _LINES)
        found, allowed = _respond(emulators, along)
        shape = (_LINES, _ALONG, len(emulators.each))
        spread = _variance(found.reshape(shape).swapaxes(0, 1), allowed.reshape(shape).swapaxes(0, 1))
        varies = np.where(base, spread, 0.0).sum(axis=0) / np.maximum(base.sum(axis=0), 1)
        total[:, one] = varies / whole
    return np.asarray(np.clip(total, 0.0, 1.0))


def _respond(emulators: Emulators, points: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Transformed residuals, and whether they are feasible, each of shape (N, K)."""
    return emulators.predict(points)[0], emulators.feasibility.probability(points) > 0.5


def _variance(value: FloatArray, feasible: BoolArray) -> FloatArray:
    """Of the feasible values, over the first axis; zero where there are none."""
    counts = np.maximum(feasible.sum(axis=0), 1)
    mean = np.where(feasible, value, 0.0).sum(axis=0) / counts
    return np.asarray(np.where(feasible, (value - mean) ** 2, 0.0).sum(axis=0) / counts)
