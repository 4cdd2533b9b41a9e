"""What the observations say of the parameters: a posterior, walked through by emcee from several starts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from walkers.calibration.convergence import LARGEST_RHAT, LEAST_SAMPLES, effective_samples, rhat
from walkers.calibration.emulator import Emulators
from walkers.calibration.likelihood import log_likelihood, observation_covariance
from walkers.calibration.space import Space
from walkers.inputs.calibration import SharedError

FloatArray = npt.NDArray[np.float64]
STARTS = 4
_PARTS = 8
"""Of the most steps; after each it is seen whether the chains have converged."""
_BURN = 0.4
_KEPT = 4000
_DISCREPANCY = 0.5
"""Scale of the half-Cauchy prior about a group's discrepancy, in standard deviations of its observations: most groups
have little, but one may have much without bending all parameters toward it."""
_MOST = 0.998
"""Probability of the prior beyond which a discrepancy, then of 160 deviations, does not grow."""


@dataclass(frozen=True)
class Posterior:
    """S samples.

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
    starts
        Number of ensembles that were started independently of each other.
    steps
        Of each ensemble, after those that were thrown away.
    walkers
        Of each ensemble.
    acceptance
        Mean share of accepted moves.
    rhat
        The largest of all coordinates (`walkers.calibration.convergence.rhat`).
    effective_samples
        The fewest of all coordinates (`walkers.calibration.convergence.effective_samples`).
    """

    unit: FloatArray
    discrepancy: FloatArray
    log_density: FloatArray
    groups: tuple[str, ...]
    starts: int
    steps: int
    walkers: int
    acceptance: float
    rhat: float
    effective_samples: float

    @property
    def best(self) -> FloatArray:
        """The sample of the highest density, shape (D,)."""
        best: FloatArray = self.unit[int(np.argmax(self.log_density))]
        return best

    @property
    def converged(self) -> bool:
        """Whether the starts agree and the chains are long enough to say something of the posterior."""
        return self.rhat < LARGEST_RHAT and self.effective_samples > LEAST_SAMPLES


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
        unit, discrepancy = self.places(points)
        # Chains know no ends: what is uniform in the cube, or half-Cauchy, is standard normal in their coordinates.
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

    def beginnings(self, walkers: int, draw: np.random.Generator) -> FloatArray:
        """The likelier of many points, so that a chain need not look for the posterior, shape (walkers, D + G)."""
        tried = draw.standard_normal((40 * walkers, self.dimensions))
        density = np.concatenate([self(part) for part in np.array_split(tried, walkers)])  # for the memory's sake
        likely = np.argsort(density)[::-1][: 2 * walkers]
        chosen: FloatArray = tried[draw.choice(likely, walkers, replace=False)]
        return chosen


def sample_posterior(
    emulators: Emulators,
    space: Space,
    steps: int,
    seed: int,
    held_out: Collection[str] = (),
    *,
    shared_errors: Mapping[str, SharedError] | None = None,
) -> Posterior:
    """Walk through the posterior until the chains have converged, or for so many steps.

    Parameters
    ----------
    emulators, space, held_out, shared_errors
        As for `Density`.
    steps
        Of each ensemble, at most; the first two fifths of those made are thrown away.
    seed
        Of the chains.

    Returns
    -------
    Posterior
        Whose ``converged`` says whether it may be believed.
    """
    from threadpoolctl import threadpool_limits

    density = Density(emulators, space, held_out, shared_errors)
    walkers = 2 * (density.dimensions + 1)
    part = max(steps // _PARTS, 1)
    with threadpool_limits(1):  # matrices are small: threads would wait for each other
        samplers = [_ensemble(density, walkers, seed, start) for start in range(STARTS)]
        states = [density.beginnings(walkers, np.random.default_rng([seed, start])) for start in range(STARTS)]
        while (left := steps - samplers[0].iteration) > 0:
            states = [sampler.run_mcmc(state, min(part, left)) for sampler, state in zip(samplers, states, strict=True)]
            found = _posterior(density, samplers)
            if found.converged:
                break
    return found


def _ensemble(density: Density, walkers: int, seed: int, start: int) -> Any:
    """A sampler of emcee. A tenth of the moves are as long as from one walker to another: from peak to peak."""
    import emcee
    from emcee.moves import DEMove, DESnookerMove, StretchMove

    moves = [(DEMove(), 0.6), (DEMove(gamma0=1.0), 0.1), (DESnookerMove(), 0.1), (StretchMove(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, density.dimensions, density, vectorize=True, moves=moves)
    sampler.random_state = np.random.RandomState(np.random.SeedSequence([seed, start]).generate_state(8)).get_state()
    return sampler


def _posterior(density: Density, samplers: Sequence[Any]) -> Posterior:
    """What the ensembles have said so far."""
    gone = int(_BURN * samplers[0].iteration)
    # Starts, steps, walkers, coordinates.
    chains = np.stack([sampler.get_chain(discard=gone) for sampler in samplers])
    log_density = np.stack([sampler.get_log_prob(discard=gone) for sampler in samplers])
    starts, steps, walkers, coordinates = chains.shape
    apart = chains.transpose(3, 0, 2, 1)
    thin = max(1, starts * steps * walkers // _KEPT)
    unit, discrepancy = density.places(chains[:, ::thin].reshape(-1, coordinates))
    return Posterior(
        unit=unit,
        discrepancy=discrepancy,
        log_density=log_density[:, ::thin].reshape(-1),
        groups=density.groups,
        starts=starts,
        steps=steps,
        walkers=walkers,
        acceptance=float(np.mean([sampler.acceptance_fraction.mean() for sampler in samplers])),
        rhat=max(map(rhat, apart)),
        effective_samples=min(map(effective_samples, apart)),
    )
