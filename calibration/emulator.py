"""Emulators: what the engine would give, interpolated between the sets that were run, with an error."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.calibration import Observation

FloatArray = npt.NDArray[np.float64]
_FOLDS = 10
_FEW = 20
LARGEST = 12.0
"""Of the transformed residuals: beyond, sinh overflows and nobody asks."""


def transformed(outcome: FloatArray, observation: Observation) -> FloatArray:
    """Arsinh of the residual in standard deviations: linear near the observation, logarithmic far from it.

    A walker that came apart may run at any speed; on this scale it does not outweigh those that walk.
    """
    return np.asarray(np.arcsinh((outcome - observation.value) / observation.deviation))


@dataclass(frozen=True)
class Emulator:
    """One observation as a function of the parameters: a Gaussian process of the transformed residual.

    Attributes
    ----------
    observation
        What it gives.
    process
        scikit-learn's regressor.
    inverse : ndarray, shape (P, P)
        Of its covariance matrix.
    error_inflation
        By how much its standard deviations are too small, from cross-validation in the later waves; at least 1.
    error
        Root mean square of the cross-validated error, in the transformed residual.
    explained
        Share of the variance that is explained in cross-validation.
    """

    observation: Observation
    process: Any
    inverse: FloatArray
    error_inflation: float
    error: float
    explained: float

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transformed residual and its standard deviation, as the process gives them: shape (N,).

        The process's own ``predict`` checks and solves anew each time, which takes a chain ten times as long.
        """
        process = self.process
        near = process.kernel_(unit, process.X_train_)
        mean = near @ process.alpha_ * process._y_train_std + process._y_train_mean
        variance = process.kernel_.diag(unit) - np.einsum("np,np->n", near @ self.inverse, near)
        return mean, np.sqrt(np.maximum(variance, 0.0)) * process._y_train_std

    def draw(self, unit: FloatArray, normal: FloatArray) -> FloatArray:
        """The observation as it may be at points (N, D), SI units and degrees: shape (N,).

        Parameters
        ----------
        unit : ndarray, shape (N, D)
        normal : ndarray, shape (N,)
            Standard normal numbers, one a point.
        """
        mean, deviation = self.predict(unit)
        residual = np.sinh(np.clip(mean + deviation * self.error_inflation * normal, -LARGEST, LARGEST))
        return np.asarray(self.observation.value + self.observation.deviation * residual)

    def value(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The observation (median) and half of the width that holds 68 % at points (N, D): shape (N,)."""
        low, middle, high = (self.draw(unit, np.full(len(unit), sigmas)) for sigmas in (-1.0, 0.0, 1.0))
        return middle, (high - low) / 2.0


def fit_emulators(
    unit: FloatArray, outcome: FloatArray, observations: Sequence[Observation], seed: int, filling: int = 0
) -> list[Emulator]:
    """One emulator an observation.

    Parameters
    ----------
    unit : ndarray, shape (P, D)
        The sets that were run, in the unit cube.
    outcome : ndarray, shape (P, K)
        What they gave.
    observations
        K of them.
    seed
        Of the restarts of the fit.
    filling
        Number of the sets that fill the range. Errors are judged by the sets after them, if there are enough: these are
        where the posterior is, and there walkers are more than elsewhere on the verge of something.
    """
    judged = slice(filling if len(unit) - filling >= _FEW else 0, None)
    return [_fitted(unit, outcome[:, k], observation, seed, judged) for k, observation in enumerate(observations)]


def _fitted(unit: FloatArray, outcome: FloatArray, observation: Observation, seed: int, judged: slice) -> Emulator:
    from scipy.linalg import cho_solve
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
    from threadpoolctl import threadpool_limits

    wanted = transformed(outcome, observation)
    scales = np.full(unit.shape[1], 0.7)
    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(scales, (5e-2, 2e1), nu=2.5) + WhiteKernel(1e-2, (1e-6, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=1, random_state=seed)
    with warnings.catch_warnings(), threadpool_limits(1):  # matrices are small: threads would wait for each other
        warnings.simplefilter("ignore", ConvergenceWarning)  # a scale at its bound: no influence
        process.fit(unit, wanted)
    predicted, deviation = _cross_validated(process, unit, wanted, seed)
    miss = wanted - predicted
    spread = float(np.var(wanted))
    return Emulator(
        observation,
        process,
        inverse=cho_solve((process.L_, True), np.eye(len(unit))),
        error_inflation=max(1.0, float(np.sqrt(np.mean((miss / deviation)[judged] ** 2)))),
        error=float(np.sqrt(np.mean(miss**2))),
        explained=1.0 - float(np.mean(miss**2)) / spread if spread > 0.0 else 1.0,
    )


def _cross_validated(process: Any, unit: FloatArray, wanted: FloatArray, seed: int) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation at each run from those of other folds, with the kernel that all of them gave."""
    from sklearn.base import clone
    from sklearn.model_selection import KFold

    mean, deviation = np.zeros(len(wanted)), np.zeros(len(wanted))
    for others, fold in KFold(min(_FOLDS, len(wanted)), shuffle=True, random_state=seed).split(unit):
        partial = clone(process).set_params(kernel=process.kernel_, optimizer=None)
        partial.fit(unit[others], wanted[others])
        mean[fold], deviation[fold] = partial.predict(unit[fold], return_std=True)
    return mean, deviation
