"""Emulators: what the engine would give, interpolated between the sets that were run, with an error."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.calibration.feasibility import Feasibility, fit_feasibility
from walkers.inputs.calibration import Observation

FloatArray = npt.NDArray[np.float64]
_FOLDS = 10
_FEW = 20
_LEAST = 5
_UNKNOWN = 3.0
"""Standard deviation of the transformed residual of an observation that fewer than five sets gave: ten deviations
either way, and the same for all parameters."""
_EXTREME = 3.0
LARGEST = 12.0
"""Of the transformed residuals: beyond, sinh overflows and nobody asks."""


def transformed(outcome: FloatArray, observation: Observation) -> FloatArray:
    """Arsinh of the residual in standard deviations: linear near the observation, logarithmic far from it.

    Walkers that are far too fast do not outweigh on this scale those that are nearly right.
    """
    return np.asarray(np.arcsinh((outcome - observation.value) / observation.deviation))


@dataclass(frozen=True)
class Emulator:
    """One observation as a function of the parameters: a Gaussian process of the transformed residual.

    It knows the sets alone in which there was something to observe (`walkers.calibration.feasibility`).

    Attributes
    ----------
    observation
        What it gives.
    process
        scikit-learn's, fitted; None if too few sets were feasible.
    error_inflation
        By how much its standard deviations are too small, from cross-validation in the later waves; at least 1.
    error
        Root mean square of the cross-validated error, in the transformed residual; NaN if too few sets were feasible.
    explained
        Share of the variance that is explained in cross-validation; NaN if too few sets were feasible.
    sets
        Number of the sets that it knows.
    """

    observation: Observation
    process: Any
    error_inflation: float
    error: float
    explained: float
    sets: int

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transformed residual and its standard deviation, widened by ``error_inflation``: shape (N,)."""
        if self.process is None:
            return np.zeros(len(unit)), np.full(len(unit), _UNKNOWN)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Predicted variances")  # at a set that was run: zero, but for rounding
            mean, deviation = self.process.predict(unit, return_std=True)
        return mean, deviation * self.error_inflation

    def draw(self, unit: FloatArray, normal: FloatArray) -> FloatArray:
        """The observation as it may be at points (N, D), SI units and degrees: shape (N,).

        Parameters
        ----------
        unit : ndarray, shape (N, D)
        normal : ndarray, shape (N,)
            Standard normal numbers, one a point.
        """
        mean, deviation = self.predict(unit)
        residual = np.sinh(np.clip(mean + deviation * normal, -LARGEST, LARGEST))
        return np.asarray(self.observation.value + self.observation.deviation * residual)

    def value(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The observation (median) and half of the width that holds 68 % at points (N, D): shape (N,)."""
        low, middle, high = (self.draw(unit, np.full(len(unit), sigmas)) for sigmas in (-1.0, 0.0, 1.0))
        return middle, (high - low) / 2.0


@dataclass(frozen=True)
class Emulators:
    """The engine, as far as sets that were run tell of it: K observations, and whether they can be made.

    Attributes
    ----------
    each
        One an observation.
    feasibility
        Of all observations.
    correlation : ndarray, shape (K, K)
        Of the emulators' errors, for observations share runs and sets; from cross-validation, shrunk toward none.
    """

    each: tuple[Emulator, ...]
    feasibility: Feasibility
    correlation: FloatArray

    @property
    def observations(self) -> list[Observation]:
        """What they give."""
        return [one.observation for one in self.each]

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transformed residuals and their standard deviations, shape (N, K)."""
        mean, deviation = zip(*(one.predict(unit) for one in self.each), strict=True)
        return np.stack(mean, axis=1), np.stack(deviation, axis=1)

    def of(self, places: list[int]) -> Emulators:
        """Those of some observations; their events are still those of all."""
        feasibility = replace(self.feasibility, event=self.feasibility.event[places])
        return Emulators(tuple(self.each[one] for one in places), feasibility, self.correlation[np.ix_(places, places)])


def fit_emulators(
    unit: FloatArray, outcome: FloatArray, observations: Sequence[Observation], seed: int, filling: int = 0
) -> Emulators:
    """Fit values where there are some, and where there are none.

    Parameters
    ----------
    unit : ndarray, shape (P, D)
        The sets that were run, in the unit cube.
    outcome : ndarray, shape (P, K)
        What they gave; NaN where there was nothing to observe.
    observations
        K of them.
    seed
        Of the restarts of the fit.
    filling
        Number of the sets that fill the range. Errors are judged by the sets after them, if there are enough: these are
        where the posterior is, and there walkers are more than elsewhere on the verge of something.
    """
    later = np.arange(len(unit)) >= filling
    fitted = [_fitted(unit, outcome[:, k], observation, seed, later) for k, observation in enumerate(observations)]
    return Emulators(
        tuple(emulator for emulator, _ in fitted),
        fit_feasibility(unit, outcome, seed),
        _correlation(np.stack([miss for _, miss in fitted], axis=1)),
    )


def _fitted(
    unit: FloatArray, outcome: FloatArray, observation: Observation, seed: int, later: npt.NDArray[np.bool_]
) -> tuple[Emulator, FloatArray]:
    """An emulator, and its cross-validated errors in stated standard errors, shape (P,); 0 where there is no value."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
    from threadpoolctl import threadpool_limits

    made, errors = np.isfinite(outcome), np.zeros(len(outcome))
    if made.sum() < _LEAST:
        return Emulator(observation, None, 1.0, np.nan, np.nan, int(made.sum())), errors
    wanted, known = transformed(outcome[made], observation), unit[made]
    scales = np.full(unit.shape[1], 0.7)
    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(scales, (5e-2, 2e1), nu=2.5) + WhiteKernel(1e-2, (1e-6, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=1, random_state=seed)
    with warnings.catch_warnings(), threadpool_limits(1):  # matrices are small: threads would wait for each other
        warnings.simplefilter("ignore", ConvergenceWarning)  # a scale at its bound: no influence
        process.fit(known, wanted)
        predicted, deviation = _cross_validated(process, known, wanted, seed)
    miss = wanted - predicted
    errors[made] = miss / deviation
    judged = made & later if (made & later).sum() >= _FEW else made
    spread = float(np.var(wanted))
    emulator = Emulator(
        observation,
        process,
        error_inflation=max(1.0, float(np.sqrt(np.mean(errors[judged] ** 2)))),
        error=float(np.sqrt(np.mean(miss**2))),
        explained=1.0 - float(np.mean(miss**2)) / spread if spread > 0.0 else 1.0,
        sets=int(made.sum()),
    )
    return emulator, errors


def _correlation(errors: FloatArray) -> FloatArray:
    """Correlation of errors (P, K) about zero, shrunk as by Ledoit and Wolf (doi 10.1016/S0047-259X(03)00096-4).

    An error that is not known counts as none, which keeps the matrix positive; one of many deviations counts as three,
    lest one set decide.
    """
    from sklearn.covariance import ledoit_wolf_shrinkage

    clipped = np.clip(errors, -_EXTREME, _EXTREME)
    size = np.sqrt(np.mean(clipped**2, axis=0))
    standard = clipped / np.where(size > 0.0, size, 1.0)
    left = 1.0 - ledoit_wolf_shrinkage(standard, assume_centered=True) if standard.any() else 0.0
    found = left * standard.T @ standard / len(standard)
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


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
