"""Emulators of the engine between parameter sets, and the posterior of the parameters from them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import cho_solve
from scipy.special import logsumexp
from scipy.stats import t as student

from walkers.arrays import FloatArray
from walkers.calibration.observations import Observation
from walkers.inputs.axes import unit_cube

LARGEST = 10.0
"""Deviations at which distances from a fact end, so that sets that are far off do not shape the emulators."""
_FREEDOM = 4.0
"""Degrees of freedom of Student's t: a fact that no set reproduces does not outweigh all others."""
_KEPT, _AT_ONCE = 4000, 8192


def middle(observation: Observation) -> float:
    """The value of a fact, its only limit, or the middle of both."""
    return float(np.mean([limit for limit in observation.limits if np.isfinite(limit)]))


def distances(observation: Observation, numbers: FloatArray) -> FloatArray:
    """What an emulator learns: distances of numbers from the `middle` in deviations, at most `LARGEST`.

    A number that does not exist is as far off as one can be, on the side where no limit allows it.
    """
    away = np.clip((numbers - middle(observation)) / observation.deviation, -LARGEST, LARGEST)
    return np.where(np.isnan(numbers), -LARGEST if observation.most is None else LARGEST, away)


@dataclass(frozen=True)
class Emulator:
    """One observation as a function of D parameters: a Gaussian process of its `distances` from the fact."""

    observation: Observation
    process: Any  # of scikit-learn, fitted
    error: float  # root mean square, in deviations, of sets that are left out one after the other
    inflation: float  # factor by which the process takes these errors for smaller; at least 1

    @classmethod
    def of(
        cls, observation: Observation, unit: FloatArray, numbers: FloatArray, seed: int
    ) -> Emulator:
        """Fit sets (P, D) of the unit cube and the numbers of the engine there (P,); NaN where there is none."""
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        away = distances(observation, numbers)
        kernel = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(
            np.ones(unit.shape[1]), (5e-2, 2e1), nu=2.5
        )
        process = GaussianProcessRegressor(
            kernel + WhiteKernel(1e-2, (1e-6, 1.0)),
            normalize_y=True,
            n_restarts_optimizer=2,
            random_state=seed,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # scales at a bound, which have no influence
            process.fit(unit, away)
        # Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), eqs. 5.10 to 5.12.
        inverse = np.diag(cho_solve((process.L_, True), np.eye(len(unit))))
        miss, scale = process.alpha_ / inverse, float(np.std(away)) or 1.0
        inflation = max(1.0, float(np.sqrt(np.mean((miss * np.sqrt(inverse)) ** 2))))
        return cls(observation, process, scale * float(np.sqrt(np.mean(miss**2))), inflation)

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance from the fact and its standard error at points (N, D), in deviations."""
        with warnings.catch_warnings():
            warnings.filterwarnings(
                "ignore", "Predicted variances"
            )  # rounding errors of zero, at sets that were run
            mean, deviation = self.process.predict(unit, return_std=True)
        return mean, deviation * self.inflation

    def log_likelihood(self, unit: FloatArray) -> FloatArray:
        """Logarithm of the probability (density) of the fact at points (N, D)."""
        mean, error = self.predict(unit)
        width = np.hypot(1.0, error)
        if self.observation.value is not None:
            return np.asarray(student.logpdf(mean / width, _FREEDOM) - np.log(width))
        low, high = (
            (limit - middle(self.observation)) / self.observation.deviation
            for limit in self.observation.limits
        )
        within = student.cdf((high - mean) / width, _FREEDOM) - student.cdf(
            (low - mean) / width, _FREEDOM
        )
        return np.asarray(np.log(np.maximum(within, 1e-300)))

    def numbers(self, unit: FloatArray, normal: FloatArray) -> FloatArray:
        """Samples of the number at points (N, D), given N standard normal numbers."""
        mean, error = self.predict(unit)
        return np.asarray(
            middle(self.observation) + self.observation.deviation * (mean + error * normal)
        )


@dataclass(frozen=True)
class Posterior:
    """Points of the prior, weighted by the likelihood of the observations that were used."""

    points: FloatArray  # of a Sobol sequence in the unit cube of the prior, shape (N, D)
    log_weight: FloatArray  # normalised, shape (N,)
    seed: int

    @classmethod
    def of(
        cls, emulators: Sequence[Emulator], points: int, seed: int, without: Collection[str] = ()
    ) -> Posterior:
        """Weigh points of the prior by the observations that have a weight and are not of the groups ``without``."""
        used = [
            emulator
            for emulator in emulators
            if emulator.observation.weighed and emulator.observation.group not in without
        ]
        unit = unit_cube(used[0].process.n_features_in_, points, seed)
        parts = [unit[at : at + _AT_ONCE] for at in range(0, points, _AT_ONCE)]
        total = np.concatenate(
            [np.sum([emulator.log_likelihood(part) for emulator in used], axis=0) for part in parts]
        )
        return cls(unit, total - logsumexp(total), seed)

    @property
    def effective_samples(self) -> float:
        """1/Σ w²."""
        return float(np.exp(-logsumexp(2.0 * self.log_weight)))

    @property
    def best(self) -> FloatArray:
        """The point of the largest weight, shape (D,)."""
        return np.asarray(self.points[np.argmax(self.log_weight)])

    @cached_property
    def samples(self) -> FloatArray:
        """Points of equal weight, shape (S, D): each in proportion to its weight."""
        steps = (np.arange(_KEPT) + np.random.default_rng(self.seed).random()) / _KEPT
        chosen = np.searchsorted(np.cumsum(np.exp(self.log_weight)), steps)
        return np.asarray(self.points[np.minimum(chosen, len(self.points) - 1)])
