"""Emulators of the engine between parameter sets: predictions with errors, and probabilities of feasibility."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist
from scipy.special import log_expit
from scipy.stats import truncnorm, uniform

from walkers.calibration.file import Observation, Parameter
from walkers.inputs.axes import unit_cube

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_FOLDS = 10
_FEW = 20
_LEAST = 5
_UNKNOWN = 3.0
"""Standard deviation of the transformed residual of an observation with fewer than five values: ten deviations."""
_EXTREME = 3.0
LARGEST = 12.0
"""Largest transformed residual; sinh overflows beyond."""


@dataclass(frozen=True)
class Space:
    """D free parameters as coordinates of the unit cube, on a logarithmic scale where the parameter demands it."""

    parameters: tuple[Parameter, ...]

    @property
    def dimensions(self) -> int:
        """D."""
        return len(self.parameters)

    @cached_property
    def logarithmic(self) -> BoolArray:
        """Which parameters are scaled by their logarithms, shape (D,)."""
        return np.array([one.log for one in self.parameters])

    @cached_property
    def _ends(self) -> FloatArray:
        return self._scaled(np.array([one.range for one in self.parameters], np.float64).T)

    def _scaled(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.log(values, out=np.array(values, np.float64), where=self.logarithmic))

    def values(self, unit: FloatArray) -> FloatArray:
        """Values of the parameters at points of the unit cube, shape (..., D)."""
        scaled = self._ends[0] + np.asarray(unit) * (self._ends[1] - self._ends[0])
        return np.asarray(np.exp(scaled, out=scaled, where=self.logarithmic))

    def unit(self, values: FloatArray) -> FloatArray:
        """Points of the unit cube at values of the parameters, shape (..., D)."""
        return np.asarray((self._scaled(values) - self._ends[0]) / (self._ends[1] - self._ends[0]))

    @cached_property
    def priors(self) -> list[Any]:
        """Prior distributions (scipy) of each coordinate on the unit interval."""
        found = []
        for one, low, width in zip(self.parameters, self._ends[0], self._ends[1] - self._ends[0], strict=True):
            if one.normal is None:
                found.append(uniform())
                continue
            mean, deviation = one.normal
            middle, scale = ((np.log(mean) if one.log else mean) - low) / width, deviation / width
            found.append(truncnorm(-middle / scale, (1.0 - middle) / scale, middle, scale))
        return found

    def log_prior(self, unit: FloatArray) -> FloatArray:
        """Logarithm of the prior density at points of the unit cube, shape (...); -inf outside."""
        return np.asarray(np.sum([one.logpdf(unit[..., place]) for place, one in enumerate(self.priors)], axis=0))

    def design(self, points: int, seed: int) -> FloatArray:
        """A space-filling first wave, shape (points, D): a scrambled Sobol sequence."""
        return unit_cube("sobol", self.dimensions, points, seed)


def spread_out(candidates: FloatArray, points: int, taken: FloatArray) -> FloatArray:
    """Choose candidates (C, D), each one farthest from the earlier ones and from the points ``taken``."""
    distance = cdist(candidates, taken).min(axis=1, initial=np.inf)
    chosen: list[int] = []
    for _ in range(min(points, len(candidates))):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(candidates - candidates[chosen[-1]], axis=1))
    return candidates[chosen]


def transformed(outcome: FloatArray, observation: Observation) -> FloatArray:
    """Arsinh of the residual in standard deviations, so that walkers that are far too fast do not dominate the fit."""
    return np.asarray(np.arcsinh((outcome - observation.value) / observation.deviation))


@dataclass(frozen=True)
class Emulator:
    """One observation as a function of the parameters: a Gaussian process of the transformed residual.

    Its errors are from cross-validation.
    """

    observation: Observation
    sets: int  # number of sets with this observation
    process: Any = None  # fitted, of scikit-learn; None if there are too few sets
    error_inflation: float = 1.0  # factor by which its standard deviations are too small in later waves; at least 1
    error: float = np.nan  # root mean square, of the transformed residual
    explained: float = np.nan  # share of the variance

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Transformed residual and its standard deviation, widened by ``error_inflation``, at points (N, D)."""
        if self.process is None:
            return np.zeros(len(unit)), np.full(len(unit), _UNKNOWN)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Predicted variances")  # rounding errors of zero, at sets that were run
            mean, deviation = self.process.predict(unit, return_std=True)
        return mean, deviation * self.error_inflation

    def draw(self, unit: FloatArray, normal: FloatArray) -> FloatArray:
        """Samples of the observation at points (N, D), SI units and degrees; ``normal``: N standard normal numbers."""
        mean, deviation = self.predict(unit)
        residual = np.sinh(np.clip(mean + deviation * normal, -LARGEST, LARGEST))
        return np.asarray(self.observation.value + self.observation.deviation * residual)


@dataclass(frozen=True)
class Emulators:
    """Emulators of K observations, and of their feasibility.

    Observations that are missing in the same sets form one of E events: they need the same walkers.
    """

    each: tuple[Emulator, ...]  # one an observation
    correlation: FloatArray  # of their errors, shape (K, K), since observations share runs and sets; shrunk toward zero
    event: npt.NDArray[np.int64]  # event that each observation needs, shape (K,)
    missing: BoolArray  # sets in which an event did not occur, shape (P, E)
    classifiers: tuple[Any, ...]  # E Gaussian processes; None for an event that occurred in all sets, or in none

    def predict(self, unit: FloatArray, places: Sequence[int] | None = None) -> tuple[FloatArray, FloatArray]:
        """Transformed residuals of all observations (or those at ``places``) and their standard deviations, (N, K)."""
        chosen = range(len(self.each)) if places is None else places
        mean, deviation = zip(*(self.each[one].predict(unit) for one in chosen), strict=True)
        return np.stack(mean, axis=1), np.stack(deviation, axis=1)

    def log_probabilities(self, unit: FloatArray) -> FloatArray:
        """Logarithms of the probabilities of the events at points (N, D), shape (N, E).

        Mean of the logistic function over the normal latent function, in MacKay's approximation
        (doi 10.1162/neco.1992.4.5.720).
        """
        latent = np.empty((len(unit), len(self.classifiers)))
        for place, (one, missing) in enumerate(zip(self.classifiers, self.missing.T, strict=True)):
            if one is None:  # Laplace's rule of succession
                latent[:, place] = np.log(((~missing).sum() + 1.0) / (missing.sum() + 1.0))
            else:
                mean, variance = one.latent_mean_and_variance(unit)
                latent[:, place] = mean / np.sqrt(1.0 + np.pi / 8.0 * np.maximum(variance, 0.0))
        return np.asarray(log_expit(latent))

    def feasible(self, unit: FloatArray) -> FloatArray:
        """Probabilities that each observation exists, at points (N, D), shape (N, K)."""
        return np.asarray(np.exp(self.log_probabilities(unit))[:, self.event])

    def needed(self, places: Sequence[int]) -> list[int]:
        """Events that observations need, without events that others imply.

        An event is implied if it is missing exactly where others are (a ratio needs the walkers of both its speeds).
        """
        events, kept = dict.fromkeys(self.event[list(places)].tolist()), []
        for one in events:
            own, others = self.missing[:, one], [self.missing[:, other] for other in events if other != one]
            within = [other for other in others if not (other & ~own).any()]
            if not within or not np.array_equal(np.any(within, axis=0), own):
                kept.append(one)
        return kept


def fit_emulators(
    unit: FloatArray, outcome: FloatArray, observations: Sequence[Observation], seed: int, filling: int = 0
) -> Emulators:
    """Fit emulators to the values, and classifiers to their existence.

    Parameters
    ----------
    unit, outcome : ndarray, shape (P, D) and (P, K)
        Sets that were run, in the unit cube, and their observations; NaN where there is none.
    observations, seed
        K observations; seed of the restarts of the fit.
    filling
        Number of space-filling sets. Errors are estimated from the later sets, if there are enough: these are near the
        posterior, where walkers are more often close to a transition.
    """
    from sklearn.covariance import LedoitWolf

    fitted = [_fitted(unit, outcome[:, k], one, seed, filling) for k, one in enumerate(observations)]
    # Unknown errors count as zero, which keeps the matrix positive; large ones are limited, so that no set dominates.
    errors = np.clip(np.stack([errors for _, errors in fitted], axis=1), -_EXTREME, _EXTREME)
    size = np.sqrt(np.mean(errors**2, axis=0))
    correlation = LedoitWolf(assume_centered=True).fit(errors / np.where(size > 0.0, size, 1.0)).covariance_
    np.fill_diagonal(correlation, 1.0)
    missing, event = np.unique(np.isnan(outcome), axis=1, return_inverse=True)
    classifiers = tuple(_classifier(unit, ~column, seed) for column in missing.T)
    return Emulators(tuple(one for one, _ in fitted), correlation, event.reshape(-1), missing, classifiers)


def _fitted(
    unit: FloatArray, outcome: FloatArray, observation: Observation, seed: int, filling: int
) -> tuple[Emulator, FloatArray]:
    """An emulator, and its cross-validated errors divided by the predicted ones, shape (P,); 0 without a value."""
    from sklearn.base import clone
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
    from sklearn.model_selection import KFold

    made, errors = np.isfinite(outcome), np.zeros(len(outcome))
    sets = int(made.sum())
    if sets < _LEAST:
        return Emulator(observation, sets), errors
    wanted, known = transformed(outcome[made], observation), unit[made]
    scales = np.full(unit.shape[1], 0.7)
    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(scales, (5e-2, 2e1), nu=2.5) + WhiteKernel(1e-2, (1e-6, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=1, random_state=seed)
    predicted, deviation = np.zeros(sets), np.zeros(sets)
    with _quietly():
        process.fit(known, wanted)
        for others, fold in KFold(min(_FOLDS, sets), shuffle=True, random_state=seed).split(known):
            partial = clone(process).set_params(kernel=process.kernel_, optimizer=None)
            partial.fit(known[others], wanted[others])
            predicted[fold], deviation[fold] = partial.predict(known[fold], return_std=True)
    miss = wanted - predicted
    errors[made] = miss / deviation
    later = made & (np.arange(len(unit)) >= filling)
    judged = later if later.sum() >= _FEW else made
    inflation = max(1.0, float(np.sqrt(np.mean(errors[judged] ** 2))))
    square, spread = float(np.mean(miss**2)), float(np.var(wanted))
    explained = 1.0 - square / spread if spread > 0.0 else 1.0
    return Emulator(observation, sets, process, inflation, float(np.sqrt(square)), explained), errors


def _classifier(unit: FloatArray, made: BoolArray, seed: int) -> Any:
    from sklearn.gaussian_process import GaussianProcessClassifier
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    if made.all() or not made.any():
        return None
    # The constant kernel is the uncertainty of the share of feasible sets over the whole range: with few failures,
    # most of the range is feasible; without it, half. Scales below a tenth of the range cannot be learned.
    kernel = ConstantKernel(4.0, (1e-1, 1e2)) * Matern(np.full(unit.shape[1], 1.0), (1e-1, 2e1), nu=2.5)
    with _quietly():
        return GaussianProcessClassifier(kernel + ConstantKernel(4.0, "fixed"), random_state=seed).fit(unit, made)


@contextmanager
def _quietly() -> Iterator[None]:
    """Fit in one thread (matrices are small) and without warnings about scales at a bound, which have no influence."""
    from sklearn.exceptions import ConvergenceWarning
    from threadpoolctl import threadpool_limits

    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", ConvergenceWarning)
        yield
