"""Feasibility: with which parameters an observation can be made at all, for there is a walker that walks."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import log_expit

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Feasibility:
    """Of each of K observations the probability that it can be made, as a function of the parameters.

    Observations that are missing in the same sets are one event: they need the same walkers. A Gaussian process
    classifies each of the E events.

    Attributes
    ----------
    event : ndarray, shape (K,)
        Which of the events an observation needs.
    missing : ndarray, shape (P, E)
        Of the sets that were run, those in which an event did not come about.
    classifiers
        E of scikit-learn's, fitted; None of an event that came about in all sets, or in none.
    """

    event: npt.NDArray[np.int64]
    missing: BoolArray
    classifiers: tuple[Any, ...]

    def log_probabilities(self, unit: FloatArray) -> FloatArray:
        """Logarithms of the probabilities of the events at points (N, D), shape (N, E).

        The mean of the logistic function over the normal latent one, by MacKay's approximation
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

    def probability(self, unit: FloatArray) -> FloatArray:
        """Probabilities that each observation can be made, at points (N, D), shape (N, K)."""
        return np.asarray(np.exp(self.log_probabilities(unit))[:, self.event])

    def needed(self, places: list[int]) -> list[int]:
        """Events that some of the observations need, each once, and none that others imply.

        An event that fails just where others fail (a ratio needs the walkers of both its speeds) says nothing that
        these do not say; counted again it would weigh twice.
        """
        events = list(dict.fromkeys(self.event[places].tolist()))
        return [one for one in events if not self._implied(one, events)]

    def _implied(self, event: int, events: list[int]) -> bool:
        """Whether an event fails somewhere, and just where others fail that fail less often."""
        own = self.missing[:, event]
        smaller = [
            self.missing[:, one]
            for one in events
            if one != event and not (self.missing[:, one] & ~own).any() and (own & ~self.missing[:, one]).any()
        ]
        return bool(own.any() and smaller and np.array_equal(np.any(smaller, axis=0), own))


def fit_feasibility(unit: FloatArray, outcome: FloatArray, seed: int) -> Feasibility:
    """Learn from sets that were run where observations can be made.

    Parameters
    ----------
    unit : ndarray, shape (P, D)
        The sets, in the unit cube.
    outcome : ndarray, shape (P, K)
        What they gave; NaN where there was nothing to observe.
    seed
        Of the classifiers.
    """
    missing, event = np.unique(np.isnan(outcome), axis=1, return_inverse=True)
    return Feasibility(
        event=np.asarray(event, dtype=np.int64).reshape(-1),
        missing=missing,
        classifiers=tuple(_classified(unit, ~column, seed) for column in missing.T),
    )


def _classified(unit: FloatArray, made: BoolArray, seed: int) -> Any:
    """The classifier of an event that came about in some sets."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessClassifier
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern
    from threadpoolctl import threadpool_limits

    if made.all() or not made.any():
        return None
    # The constant kernel is the uncertainty of the share of feasible sets over the whole range: with few failures
    # most of the range is feasible, not half of it, as without. Scales below a tenth of the range cannot be learned.
    kernel = ConstantKernel(4.0, (1e-1, 1e2)) * Matern(np.full(unit.shape[1], 1.0), (1e-1, 2e1), nu=2.5)
    classifier = GaussianProcessClassifier(kernel + ConstantKernel(4.0, "fixed"), random_state=seed)
    with warnings.catch_warnings(), threadpool_limits(1):  # matrices are small: threads would wait for each other
        warnings.simplefilter("ignore", ConvergenceWarning)  # a scale at its bound: no influence
        return classifier.fit(unit, made)
