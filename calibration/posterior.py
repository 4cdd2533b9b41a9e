"""What the observations say of the parameters: a posterior, walked through by emcee."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from walkers.calibration.emulator import LARGEST, Emulator
from walkers.calibration.space import Space

FloatArray = npt.NDArray[np.float64]
_WALKERS_PER_DIMENSION = 8
_BURN = 0.4
_KEPT = 4000
_DISCREPANCY = 0.5
"""Scale of the half-Cauchy prior about a group's discrepancy, in standard deviations of its observations: most groups
have little, but one may have much without bending all parameters toward it."""
_LOG_DISCREPANCY = (-5.0, 5.0)
_NODES, _WEIGHTS = np.polynomial.hermite.hermgauss(21)


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
    autocorrelation
        Longest autocorrelation time of the chain, in its steps.
    steps
        Of the chain, after those that were thrown away.
    acceptance
        Mean share of accepted moves.
    """

    unit: FloatArray
    discrepancy: FloatArray
    log_density: FloatArray
    groups: tuple[str, ...]
    autocorrelation: float
    steps: int
    acceptance: float

    @property
    def best(self) -> FloatArray:
        """The sample of the highest density, shape (D,)."""
        best: FloatArray = self.unit[int(np.argmax(self.log_density))]
        return best


def log_likelihood(mean: FloatArray, deviation: FloatArray, variance: FloatArray) -> FloatArray:
    """Logarithm of what a residual of 0 is worth if its arsinh is normally distributed, but for a constant.

    ln ∫ N(sinh z; 0, variance) N(z; mean, deviation²) dz, by Gauss and Hermite. Taking the residual's own error for
    cosh(mean) deviation instead would make the hopeless cheap: no residual would be more than 1/deviation errors off.

    Parameters
    ----------
    mean, deviation
        Of the transformed residual (`walkers.calibration.emulator.transformed`).
    variance
        Of the residual: 1, and the square of the discrepancy.
    """
    places = np.clip(mean[..., None] + np.sqrt(2.0) * deviation[..., None] * _NODES, -LARGEST, LARGEST)
    exponents = -0.5 * np.sinh(places) ** 2 / variance[..., None] + np.log(_WEIGHTS)
    largest = exponents.max(axis=-1, keepdims=True)
    total = np.log(np.exp(exponents - largest).sum(axis=-1)) + largest[..., 0]
    return np.asarray(total - 0.5 * np.log(variance))


class _Density:
    """Log density of the parameters and of the logarithms of the discrepancies."""

    def __init__(self, emulators: Sequence[Emulator], space: Space, groups: tuple[str, ...]) -> None:
        self.emulators, self.space = emulators, space
        self.group = np.array([groups.index(one.observation.group) for one in emulators])
        self.error_inflation = np.array([one.error_inflation for one in emulators])
        self.dimensions = space.dimensions

    def __call__(self, points: FloatArray) -> FloatArray:
        unit, logs = points[:, : self.dimensions], points[:, self.dimensions :]
        total = self.space.log_prior(unit)
        low, high = _LOG_DISCREPANCY
        total = np.where(np.all((logs >= low) & (logs <= high), axis=1), total, -np.inf)
        inside = np.isfinite(total)
        if not inside.any():
            return total
        logs = logs[inside]
        variance = 1.0 + np.exp(2.0 * logs)[:, self.group]
        mean, deviation = np.stack([one.predict(unit[inside]) for one in self.emulators], axis=2)
        likelihood = log_likelihood(mean, deviation * self.error_inflation, variance).sum(axis=1)
        # Half-Cauchy, with the Jacobian of the logarithm.
        prior = (logs - np.log1p((np.exp(logs) / _DISCREPANCY) ** 2)).sum(axis=1)
        total[inside] += likelihood + prior
        return total


def sample_posterior(
    emulators: Sequence[Emulator], space: Space, steps: int, seed: int, held_out: Collection[str] = ()
) -> Posterior:
    """Walk through the posterior.

    Parameters
    ----------
    emulators
        Of all observations.
    space
        Of the parameters.
    steps
        Of the chain; the first two fifths are thrown away.
    seed
        Of the chain.
    held_out
        Groups of observations that are not used.

    Returns
    -------
    Posterior
    """
    import emcee
    from threadpoolctl import threadpool_limits

    used = [one for one in emulators if one.observation.group not in held_out and not one.observation.derived]
    groups = tuple(dict.fromkeys(one.observation.group for one in used))
    density = _Density(used, space, groups)
    dimensions = space.dimensions + len(groups)
    walkers = 2 * ((_WALKERS_PER_DIMENSION * dimensions + 1) // 2)
    draw = np.random.default_rng(seed)
    sampler = emcee.EnsembleSampler(
        walkers,
        dimensions,
        density,
        vectorize=True,
        moves=[(emcee.moves.DEMove(), 0.7), (emcee.moves.DESnookerMove(), 0.1), (emcee.moves.StretchMove(), 0.2)],
    )
    sampler.random_state = np.random.RandomState(seed).get_state()
    with threadpool_limits(1):  # matrices are small: threads would wait for each other
        sampler.run_mcmc(_beginnings(density, walkers, dimensions, draw), steps)
    gone = int(_BURN * steps)
    chain, log_density = sampler.get_chain(discard=gone), sampler.get_log_prob(discard=gone)
    thin = max(1, chain.shape[0] * walkers // _KEPT)
    samples = chain[::thin].reshape(-1, dimensions)
    times = emcee.autocorr.integrated_time(chain, tol=0, has_walkers=True)
    return Posterior(
        unit=samples[:, : space.dimensions],
        discrepancy=np.exp(samples[:, space.dimensions :]),
        log_density=log_density[::thin].reshape(-1),
        groups=groups,
        autocorrelation=float(np.max(times)),
        steps=chain.shape[0],
        acceptance=float(np.mean(sampler.acceptance_fraction)),
    )


def _beginnings(density: _Density, walkers: int, dimensions: int, draw: np.random.Generator) -> FloatArray:
    """The likeliest of many points of the cube, so that the chain need not look for the posterior."""
    tried = draw.uniform(0.02, 0.98, (40 * walkers, dimensions))
    tried[:, density.dimensions :] = draw.normal(0.0, 1.0, (len(tried), dimensions - density.dimensions))
    likely = np.argsort(density(tried))[::-1][: 2 * walkers]
    chosen: FloatArray = tried[draw.choice(likely, walkers, replace=False)]
    return chosen
