"""What the observations say of the parameters: points of the prior, each with the weight of its likelihood."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp, ndtr

from walkers.calibration.emulator import Emulators
from walkers.calibration.likelihood import log_likelihood, observation_covariance
from walkers.calibration.space import Space
from walkers.inputs.calibration import SharedError

FloatArray = npt.NDArray[np.float64]
LEAST_SAMPLES = 400.0
"""A posterior is known well enough if its points are worth more than so many independent samples."""
_ROUNDS = 8
_WIDER, _TEMPERED = 1.5, 150.0
"""How much wider than the weighted points before them those of a later round are, and what these are to be worth, which
their likelihood is tempered for."""
_AT_ONCE = 2048
_KEPT = 4000
_DISCREPANCY = 0.5
"""Scale of the half-Cauchy prior about a group's discrepancy, in standard deviations of its observations: most groups
have little, but one may have much without bending all parameters toward it."""
_MOST = 0.998
"""Probability of the prior beyond which a discrepancy, then of 160 deviations, does not grow."""


@dataclass(frozen=True)
class Posterior:
    """S samples of equal weight.

    Attributes
    ----------
    unit : ndarray, shape (S, D)
        In the unit cube.
    discrepancy : ndarray, shape (S, G)
        Of each group, in standard deviations of its observations: what no parameters explain.
    log_density : ndarray, shape (S,)
        But for a constant.
    groups
        G names; those that were held out have no discrepancy of their own.
    best : ndarray, shape (D,)
        The point of the highest density.
    points
        How many the samples were taken from, by their weights w.
    effective_samples
        (Σ w)²/Σ w²: so many independent samples the points are worth.
    """

    unit: FloatArray
    discrepancy: FloatArray
    log_density: FloatArray
    groups: tuple[str, ...]
    best: FloatArray
    points: int
    effective_samples: float

    @property
    def converged(self) -> bool:
        """Whether enough of the points weigh something to say something of the posterior."""
        return self.effective_samples > LEAST_SAMPLES


class Density:
    """Log density of the parameters and of the groups' discrepancies, in coordinates of which all numbers are allowed.

    Parameters
    ----------
    emulators
        Of all observations.
    space
        Of the parameters.
    held_out
        Groups of observations that are not used.
    shared_errors
        Of the calibration's file.

    Attributes
    ----------
    groups
        Names of the G groups that are used.
    dimensions
        D + G.
    """

    def __init__(
        self,
        emulators: Emulators,
        space: Space,
        held_out: Collection[str] = (),
        shared_errors: Mapping[str, SharedError] | None = None,
    ) -> None:
        observations = emulators.observations
        used = [k for k, one in enumerate(observations) if one.group not in held_out and not one.derived]
        self.groups = tuple(dict.fromkeys(observations[k].group for k in used))
        self.dimensions = space.dimensions + len(self.groups)
        self._space, self._emulators = space, emulators.of(used)
        self._events = emulators.feasibility.needed(used)
        self._group = np.array([self.groups.index(observations[k].group) for k in used])
        self._shared = observation_covariance(self._emulators.observations, shared_errors or {})

    def __call__(self, points: FloatArray) -> FloatArray:
        """At points (N, D + G), shape (N,)."""
        return np.concatenate([self._of(points[at : at + _AT_ONCE]) for at in range(0, len(points), _AT_ONCE)])

    def _of(self, points: FloatArray) -> FloatArray:
        unit, discrepancy = self.places(points)
        # What is uniform in the cube, or half-Cauchy, is standard normal in these coordinates.
        total: FloatArray = self._space.log_prior(unit) - 0.5 * np.sum(points**2, axis=1)
        mean, deviation = self._emulators.predict(unit)
        total += log_likelihood(mean, deviation, self._emulators.correlation, self._shared, discrepancy[:, self._group])
        # What was published was seen, of walkers that walked.
        total += self._emulators.feasibility.log_probabilities(unit)[:, self._events].sum(axis=1)
        return total

    def places(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points of the unit cube, shape (N, D), and the discrepancies, shape (N, G), at coordinates (N, D + G)."""
        uniform: FloatArray = ndtr(points)
        count = self._space.dimensions
        return uniform[:, :count], _DISCREPANCY * np.tan(0.5 * np.pi * np.minimum(uniform[:, count:], _MOST))


def sample_posterior(
    emulators: Emulators,
    space: Space,
    points: int,
    seed: int,
    held_out: Collection[str] = (),
    *,
    shared_errors: Mapping[str, SharedError] | None = None,
) -> Posterior:
    """Weigh points by importance: those of the prior first, then, while few of them weigh anything, others nearer.

    Later rounds are normal with the mean and covariance of the points weighed so far; all points are weighed over the
    mixture of what all rounds were drawn from (Cornuet et al. 2012, doi 10.1111/j.1467-9469.2011.00756.x).

    Parameters
    ----------
    emulators, space, held_out, shared_errors
        As for `Density`.
    points
        Of each round, of which there are eight at most.
    seed
        Of the points.

    Returns
    -------
    Posterior
        Whose ``converged`` says whether it may be believed.
    """
    density, draw = Density(emulators, space, held_out, shared_errors), np.random.default_rng(seed)
    # What points were drawn from: means and roots of the covariances.
    normals: list[tuple[FloatArray, FloatArray]] = [(np.zeros(density.dimensions), np.eye(density.dimensions))]
    places, known = np.zeros((0, density.dimensions)), np.zeros(0)
    for _ in range(_ROUNDS):
        middle, root = normals[-1]
        fresh = middle + draw.standard_normal((points, density.dimensions)) @ root.T
        places, known = np.concatenate([places, fresh]), np.concatenate([known, density(fresh)])
        logarithm = known - _log_mixture(places, normals)
        weight = tempered = _weights(logarithm)
        if _worth(weight) > LEAST_SAMPLES:
            break
        share, enough = 1.0, min(_TEMPERED, points / 2.0)
        while _worth(tempered) < enough:
            share *= 0.8
            tempered = _weights(share * logarithm)
        width = np.cov(places.T, aweights=tempered).reshape(density.dimensions, density.dimensions)
        normals.append((tempered @ places, np.asarray(np.linalg.cholesky(_WIDER * width), np.float64)))
    chosen = _systematic(weight, min(_KEPT, len(weight)), draw)
    unit, discrepancy = density.places(places[chosen])
    best = density.places(places[[np.argmax(known)]])[0][0]
    return Posterior(unit, discrepancy, known[chosen], density.groups, best, len(places), _worth(weight))


def _weights(logarithm: FloatArray) -> FloatArray:
    return np.asarray(np.exp(logarithm - logsumexp(logarithm)))


def _worth(weight: FloatArray) -> float:
    return 1.0 / float(np.sum(weight**2))


def _systematic(weight: FloatArray, count: int, draw: np.random.Generator) -> npt.NDArray[np.int64]:
    """Places of so many points, each as often as it weighs."""
    steps = (np.arange(count) + draw.random()) / count
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weight), steps), len(weight) - 1))


def _log_mixture(places: FloatArray, normals: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """Log density of equal shares of normal distributions, but for a constant."""
    each = [
        -0.5 * np.sum(np.linalg.solve(root, (places - middle).T) ** 2, axis=0) - np.log(np.diag(root)).sum()
        for middle, root in normals
    ]
    return np.asarray(logsumexp(each, axis=0) - np.log(len(normals)))
