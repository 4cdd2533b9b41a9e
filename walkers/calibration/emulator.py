"""Emulators of the engine between parameter sets, and the posterior of the parameters from them.

Parameter sets are points of the unit cube of the prior: a coordinate is the share of the prior
below the value of a parameter (`walkers.calibration.file.Parameter.values`). The runs are made in
`walkers.calibration.calibrate`.
"""

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

LARGEST_DISTANCE = 10.0
"""Distance from a fact, in deviations, to which larger ones are reduced, so that sets that are far
off do not shape the emulators."""
_DEGREES_OF_FREEDOM = 4.0
"""Degrees of freedom of Student's t, whose long tails keep a fact that no set reproduces from
outweighing all others."""
_SAMPLES = 4000
"""Number of samples of equal weight of a posterior."""
_POINTS_AT_ONCE = 8192
"""Number of points for which emulators are evaluated at once, to limit the memory."""


def middle(observation: Observation) -> float:
    """The value of a fact, its only limit, or the middle of both limits."""
    return float(np.mean([limit for limit in observation.limits if np.isfinite(limit)]))


def distances(observation: Observation, numbers: FloatArray) -> FloatArray:
    """Distances of numbers from the `middle` of a fact, which are what an emulator learns.

    Parameters
    ----------
    observation
        The fact.
    numbers : ndarray, shape (P,)
        Numbers of the engine in SI units, angles in degrees; NaN where a number does not exist.

    Returns
    -------
    ndarray, shape (P,)
        Distances in deviations, at most `LARGEST_DISTANCE`. A number that does not exist counts as
        far too large; for a fact that is only a lower limit, as far too small.
    """
    scaled = (numbers - middle(observation)) / observation.deviation
    clipped = np.clip(scaled, -LARGEST_DISTANCE, LARGEST_DISTANCE)
    missing = LARGEST_DISTANCE
    if observation.most is None:
        missing = -LARGEST_DISTANCE
    return np.where(np.isnan(numbers), missing, clipped)


@dataclass(frozen=True)
class Emulator:
    """One observation as a function of D parameters.

    Attributes
    ----------
    observation
        The fact and its number.
    process
        A fitted Gaussian process of scikit-learn for the `distances` from the fact.
    error
        Root mean square error of the process at sets that are left out of it, one after the other,
        in deviations.
    inflation
        Factor by which these errors are larger than the process states, at least 1.
    """

    observation: Observation
    process: Any
    error: float
    inflation: float

    @classmethod
    def fit(
        cls, observation: Observation, points: FloatArray, numbers: FloatArray, seed: int
    ) -> Emulator:
        """Fit an emulator to numbers of the engine.

        Parameters
        ----------
        observation
            The fact and its number.
        points : ndarray, shape (P, D)
            Parameter sets, points of the unit cube of the prior.
        numbers : ndarray, shape (P,)
            Numbers of the engine there, in SI units; NaN where a number does not exist.
        seed
            Seed of the search for the scales of the process.

        References
        ----------
        C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning (2006), eqs.
        5.10 to 5.12 (errors of points that are left out).
        """
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        learned = distances(observation, numbers)
        # Start values and limits of the search: amplitude and noise of standardised distances, and
        # lengths in the unit cube.
        amplitude = ConstantKernel(1.0, (1e-2, 1e2))
        smooth = Matern(np.ones(points.shape[1]), (5e-2, 2e1), nu=2.5)
        noise = WhiteKernel(1e-2, (1e-6, 1.0))
        process = GaussianProcessRegressor(
            amplitude * smooth + noise,
            normalize_y=True,
            n_restarts_optimizer=2,
            random_state=seed,
        )
        with warnings.catch_warnings():
            # Scales at a bound belong to parameters without influence.
            warnings.simplefilter("ignore")
            process.fit(points, learned)
        inverse_variance = np.diag(cho_solve((process.L_, True), np.eye(len(points))))
        misses = process.alpha_ / inverse_variance
        standardised = misses * np.sqrt(inverse_variance)
        inflation = max(1.0, float(np.sqrt(np.mean(standardised**2))))
        scale = float(np.std(learned))
        if scale == 0.0:
            scale = 1.0
        error = scale * float(np.sqrt(np.mean(misses**2)))
        return cls(observation, process, error, inflation)

    def predict(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Predict distances from the fact.

        Parameters
        ----------
        points : ndarray, shape (N, D)
            Points of the unit cube of the prior.

        Returns
        -------
        mean, error : ndarray, shape (N,)
            Distance and its standard error, in deviations.
        """
        with warnings.catch_warnings():
            # Variances at sets that were run are zero but for rounding.
            warnings.filterwarnings("ignore", "Predicted variances")
            mean, deviation = self.process.predict(points, return_std=True)
        return mean, deviation * self.inflation

    def log_likelihood(self, points: FloatArray) -> FloatArray:
        """Logarithm of the probability (of a value: of its density) of the fact at points.

        Parameters
        ----------
        points : ndarray, shape (N, D)
            Points of the unit cube of the prior.

        Returns
        -------
        ndarray, shape (N,)
            For a value, the density of Student's t at its distance; for limits, the probability of
            the interval between them. The width is that of the fact and of the emulator together.
        """
        mean, error = self.predict(points)
        width = np.hypot(1.0, error)
        if self.observation.value is not None:
            density = student.logpdf(mean / width, _DEGREES_OF_FREEDOM)
            return np.asarray(density - np.log(width))
        least, most = self.observation.limits
        centre = middle(self.observation)
        low = (least - centre) / self.observation.deviation
        high = (most - centre) / self.observation.deviation
        below_high = student.cdf((high - mean) / width, _DEGREES_OF_FREEDOM)
        below_low = student.cdf((low - mean) / width, _DEGREES_OF_FREEDOM)
        probability = np.maximum(below_high - below_low, 1e-300)  # its logarithm must be finite
        return np.asarray(np.log(probability))

    def numbers(self, points: FloatArray, normal: FloatArray) -> FloatArray:
        """Sample the number of the observation.

        Parameters
        ----------
        points : ndarray, shape (N, D)
            Points of the unit cube of the prior.
        normal : ndarray, shape (N,)
            Standard normal numbers, which choose the errors of the emulator.

        Returns
        -------
        ndarray, shape (N,)
            Numbers in SI units, angles in degrees.
        """
        mean, error = self.predict(points)
        sampled = mean + error * normal
        return np.asarray(middle(self.observation) + self.observation.deviation * sampled)


@dataclass(frozen=True)
class Posterior:
    """Points of the prior, weighted by the likelihood of observations.

    Attributes
    ----------
    points : ndarray, shape (N, D)
        Points of a Sobol sequence in the unit cube of the prior.
    log_weight : ndarray, shape (N,)
        Logarithms of their weights, whose sum is 1.
    seed
        Seed of the sequence and of the samples.
    """

    points: FloatArray
    log_weight: FloatArray
    seed: int

    @classmethod
    def from_emulators(
        cls, emulators: Sequence[Emulator], count: int, seed: int, without: Collection[str] = ()
    ) -> Posterior:
        """Weight points of the prior by the likelihood of observations.

        Parameters
        ----------
        emulators
            Emulators of the observations. Those without a weight in a calibration are not used.
        count
            Number of points.
        seed
            Seed of the points.
        without
            Groups of observations that are not used either.
        """
        used = []
        for emulator in emulators:
            observation = emulator.observation
            if observation.weighed and observation.group not in without:
                used.append(emulator)
        points = unit_cube(used[0].process.n_features_in_, count, seed)
        log_likelihoods = []
        for start in range(0, count, _POINTS_AT_ONCE):
            part = points[start : start + _POINTS_AT_ONCE]
            of_observations = [emulator.log_likelihood(part) for emulator in used]
            log_likelihoods.append(np.sum(of_observations, axis=0))
        log_weight = np.concatenate(log_likelihoods)
        return cls(points, log_weight - logsumexp(log_weight), seed)

    @property
    def effective_samples(self) -> float:
        """Effective number of samples, 1/Σ w² with the weights w."""
        return float(np.exp(-logsumexp(2.0 * self.log_weight)))

    @property
    def best(self) -> FloatArray:
        """The point of the largest weight, shape (D,)."""
        return np.asarray(self.points[np.argmax(self.log_weight)])

    @cached_property
    def samples(self) -> FloatArray:
        """Points of equal weight, shape (4000, D): each point in proportion to its weight."""
        offset = np.random.default_rng(self.seed).random()
        quantiles = (np.arange(_SAMPLES) + offset) / _SAMPLES
        chosen = np.searchsorted(np.cumsum(np.exp(self.log_weight)), quantiles)
        last = len(self.points) - 1
        return np.asarray(self.points[np.minimum(chosen, last)])
