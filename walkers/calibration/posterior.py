"""Posterior of the parameters: points of the prior, weighted by their likelihood."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, ndtr, softmax
from scipy.stats import multivariate_normal

from walkers.calibration.emulator import LARGEST, Emulators, FloatArray, Space
from walkers.calibration.file import Observation, SharedError

LEAST_SAMPLES = 400.0
"""Smallest effective sample size of a converged posterior."""
_ROUNDS = 8
_WIDER, _TEMPERED = 1.5, 150.0
"""Factor of the covariance of a later round, and effective sample size for which the likelihood is tempered."""
_AT_ONCE = 2048
_KEPT = 4000
_DISCREPANCY = 0.5
"""Scale of the half-Cauchy prior of a group's discrepancy, in standard deviations of its observations: most groups have
a small one, but one group may have a large one without distorting all parameters."""
_MOST = 0.998
"""Largest cumulative prior probability of a discrepancy, for 160 deviations."""
_NEWTON_STEPS, _CONVERGED = 40, 1e-4
_LEAST_DEVIATION = 1e-3


def observation_covariance(observations: Sequence[Observation], shared: Mapping[str, SharedError]) -> FloatArray:
    """Covariance of the published numbers' errors, each in its own standard deviations, shape (K, K).

    δ_jk + Σ s (1 − δ_jk) over the shared errors that both j and k have, s their share of the variance.
    """
    covariance = np.eye(len(observations))
    for error in shared.values():
        has = np.array([one.name in error.observations for one in observations])
        covariance += error.share * (np.outer(has, has) & ~np.eye(len(has), dtype=bool))
    return covariance


def log_likelihood(
    mean: FloatArray, deviation: FloatArray, correlation: FloatArray, shared: FloatArray, discrepancy: FloatArray
) -> FloatArray:
    """Logarithm of the density at residuals of zero, without ½ K ln 2π, shape (N,).

    ln ∫ N(sinh z; 0, C) N(z; m, Σ) dz, z the transformed residuals (`walkers.calibration.emulator.transformed`), by
    Laplace's approximation, −ψ(z) − ½ ln |C| − ½ ln |Σ| − ½ ln |∇∇ψ| at the z where

        ψ(z) = ½ sinh(z)ᵀ C⁻¹ sinh(z) + ½ (z − m)ᵀ Σ⁻¹ (z − m)

    is least. A linearisation at m would favour wrong parameters: no residual would exceed 1/deviation errors.

    Parameters
    ----------
    mean, deviation : ndarray, shape (N, K)
        Transformed residuals of the emulators: m, and the roots of the diagonal of Σ.
    correlation : ndarray, shape (K, K)
        Correlation of the errors of the emulators, for Σ.
    shared : ndarray, shape (K, K)
        Covariance of the observations' errors, in their standard deviations (`observation_covariance`).
    discrepancy : ndarray, shape (N, K)
        Discrepancies, in the same unit; C is ``shared`` with their squares added to the diagonal.
    """
    mean, deviation = np.clip(mean, -LARGEST, LARGEST), np.maximum(deviation, _LEAST_DEVIATION)
    covariance = shared + _diagonal(discrepancy**2)
    of_numbers: FloatArray = np.asarray(np.linalg.inv(covariance), np.float64)
    of_engine = np.linalg.inv(correlation) / deviation[:, :, None] / deviation[:, None, :]
    z = _mode(mean, of_numbers, of_engine)
    sinh, cosh, away = np.sinh(z), np.cosh(z), z - mean
    weight = _times(of_numbers, sinh)
    hessian = of_engine + of_numbers * cosh[:, :, None] * cosh[:, None, :] + _diagonal(sinh * weight)
    sign, curvature = np.linalg.slogdet(hessian)
    misfit = np.sum(sinh * weight + away * _times(of_engine, away), axis=1)
    spread = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(correlation)[1] + 2.0 * np.log(deviation).sum(axis=1)
    total = -0.5 * (misfit + curvature + spread)
    return np.where((sign > 0.0) & np.isfinite(total), total, -np.inf)  # else there is no minimum


def _mode(mean: FloatArray, of_numbers: FloatArray, of_engine: FloatArray) -> FloatArray:
    """Minimum of ψ by Newton's method, with steps of at most 1, and with the positive part of the curvature."""
    z, left = mean.copy(), np.arange(len(mean))
    for _ in range(_NEWTON_STEPS):
        sinh, cosh = np.sinh(z[left]), np.cosh(z[left])
        weight = _times(of_numbers[left], sinh)
        slope = cosh * weight + _times(of_engine[left], z[left] - mean[left])
        hessian = of_engine[left] + of_numbers[left] * cosh[:, :, None] * cosh[:, None, :]
        hessian += _diagonal(np.maximum(sinh * weight, 0.0))
        step = np.clip(np.linalg.solve(hessian, slope[:, :, None])[:, :, 0], -1.0, 1.0)
        z[left] -= step
        left = left[np.abs(step).max(axis=1) >= _CONVERGED]
        if not len(left):
            break
    return z


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _diagonal(rows: FloatArray) -> FloatArray:
    return np.asarray(rows[:, :, None] * np.eye(rows.shape[1]))


@dataclass(frozen=True)
class Posterior:
    """S samples of equal weight, drawn from points with weights w."""

    unit: FloatArray  # in the unit cube, shape (S, D)
    discrepancy: FloatArray  # of each group, in deviations of its observations, shape (S, G)
    log_density: FloatArray  # up to a constant, shape (S,)
    groups: tuple[str, ...]  # G names; those that were held out have no discrepancy of their own
    best: FloatArray  # the point of the highest density, shape (D,)
    points: int
    effective_samples: float  # (Σ w)²/Σ w²

    @property
    def converged(self) -> bool:
        """Whether the effective sample size is large enough."""
        return self.effective_samples > LEAST_SAMPLES


class Density:
    """Log density of D parameters and G discrepancies of groups (except held-out ones) in unbounded coordinates."""

    def __init__(
        self,
        emulators: Emulators,
        space: Space,
        held_out: Collection[str] = (),
        shared_errors: Mapping[str, SharedError] | None = None,
    ) -> None:
        known = [one.observation for one in emulators.each]
        self._used = [k for k, one in enumerate(known) if one.group not in held_out and not one.derived]
        observations = [known[k] for k in self._used]
        self.groups = tuple(dict.fromkeys(one.group for one in observations))
        self.dimensions = space.dimensions + len(self.groups)
        self._space, self._emulators, self._events = space, emulators, emulators.needed(self._used)
        self._group = np.array([self.groups.index(one.group) for one in observations])
        self._shared = observation_covariance(observations, shared_errors or {})
        self._correlation = emulators.correlation[np.ix_(self._used, self._used)]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Log density at points (N, D + G), shape (N,)."""
        return np.concatenate([self._of(points[at : at + _AT_ONCE]) for at in range(0, len(points), _AT_ONCE)])

    def _of(self, points: FloatArray) -> FloatArray:
        unit, discrepancy = self.places(points)
        # In these coordinates, uniform and half-Cauchy priors are standard normal.
        total: FloatArray = self._space.log_prior(unit) - 0.5 * np.sum(points**2, axis=1)
        mean, deviation = self._emulators.predict(unit, self._used)
        total += log_likelihood(mean, deviation, self._correlation, self._shared, discrepancy[:, self._group])
        # Published walkers did walk: their events occurred.
        total += self._emulators.log_probabilities(unit)[:, self._events].sum(axis=1)
        return total

    def places(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points of the unit cube, shape (N, D), and the discrepancies, shape (N, G), at coordinates (N, D + G)."""
        uniform: FloatArray = ndtr(points)
        count = self._space.dimensions
        return uniform[:, :count], _DISCREPANCY * np.tan(0.5 * np.pi * np.minimum(uniform[:, count:], _MOST))


def sample_posterior(density: Density, points: int, seed: int) -> Posterior:
    """Sample the posterior by adaptive importance sampling, starting from the prior.

    Later rounds (``points`` in each) are normal, with the mean and covariance of the points weighted so far. All points
    are weighted by the mixture of the distributions of all rounds (Cornuet et al. 2012, doi
    10.1111/j.1467-9469.2011.00756.x). `Posterior.converged` tells whether the result is reliable.
    """
    draw, count = np.random.default_rng(seed), density.dimensions
    normals = [(np.zeros(count), np.eye(count))]  # distributions of the rounds: means and covariances
    places, known = np.zeros((0, count)), np.zeros(0)
    for _ in range(_ROUNDS):
        middle, width = normals[-1]
        fresh = middle + draw.standard_normal((points, count)) @ np.linalg.cholesky(width).T
        places, known = np.concatenate([places, fresh]), np.concatenate([known, density(fresh)])
        drawn = [multivariate_normal.logpdf(places, *normal) for normal in normals]
        logarithm = known - logsumexp(drawn, axis=0) + np.log(len(normals))
        weight = tempered = softmax(logarithm)
        if _worth(weight) > LEAST_SAMPLES:
            break
        share, enough = 1.0, min(_TEMPERED, points / 2.0)
        while _worth(tempered) < enough:
            share *= 0.8
            tempered = softmax(share * logarithm)
        width = np.cov(places.T, aweights=tempered).reshape(count, count)
        normals.append((tempered @ places, _WIDER * width))
    samples = min(_KEPT, len(weight))  # each point in proportion to its weight
    steps = (np.arange(samples) + draw.random()) / samples
    chosen = np.minimum(np.searchsorted(np.cumsum(weight), steps), len(weight) - 1)
    unit, discrepancy = density.places(places[chosen])
    best = density.places(places[[np.argmax(known)]])[0][0]
    return Posterior(unit, discrepancy, known[chosen], density.groups, best, len(places), _worth(weight))


def _worth(weight: FloatArray) -> float:
    return 1.0 / float(np.sum(weight**2))
