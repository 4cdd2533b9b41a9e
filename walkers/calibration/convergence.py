"""Whether chains have converged: R-hat and effective sample size.

Vehtari, Gelman, Simpson, Carpenter, Bürkner, Rank-normalization, folding, and localization: an improved R-hat for
assessing convergence of MCMC, Bayesian Analysis 16 (2021), 667 (doi 10.1214/20-BA1221).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft
from scipy.stats import norm, rankdata

FloatArray = npt.NDArray[np.float64]
LARGEST_RHAT = 1.05
LEAST_SAMPLES = 400.0
"""Starts have converged if of every coordinate R-hat is below the one and the effective sample size above the other."""


def rhat(chains: FloatArray) -> float:
    """The larger of split R-hat of the ranks and of the folded ranks: 1 where all starts are of one distribution.

    All walkers of a start are taken together, for they are not independent: its halves are the chains that are
    compared, as in the nested R-hat of Margossian et al. (2024, doi 10.1214/24-BA1453).

    Parameters
    ----------
    chains : ndarray, shape (S, M, N)
        S starts of M chains of N steps of one coordinate.
    """
    halves = _split(chains).reshape(2 * len(chains), -1)
    return max(_rhat(_normal_ranks(halves)), _rhat(_normal_ranks(np.abs(halves - np.median(halves)))))


def effective_samples(chains: FloatArray) -> float:
    """Effective sample size of the bulk: from the ranks, as `rhat`; autocorrelations by Geyer's monotone sequence.

    Each of the M chains of each start counts as one, so that chains that stay apart are few samples.

    Parameters
    ----------
    chains : ndarray, shape (S, M, N)
        As for `rhat`.
    """
    ranks = _normal_ranks(_split(chains).reshape(-1, chains.shape[2] // 2))
    count, steps = ranks.shape
    covariance = _autocovariance(ranks).mean(axis=0)
    within = covariance[0] * steps / (steps - 1.0)
    total = covariance[0] + float(np.var(ranks.mean(axis=1), ddof=1))
    if total <= 0.0:
        return float(count * steps)
    correlation = 1.0 - (within - covariance) / total
    correlation[0] = 1.0
    pairs = correlation[: steps // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs < 0.0)
    pairs = np.minimum.accumulate(pairs[: negative[0] if len(negative) else None])
    time = max(-1.0 + 2.0 * float(pairs.sum()), 1.0 / np.log10(count * steps))
    return float(count * steps / time)


def _split(chains: FloatArray) -> FloatArray:
    """The halves of all chains, shape (2 S, M, N // 2)."""
    half = chains.shape[2] // 2
    return np.concatenate([chains[..., :half], chains[..., -half:]])


def _normal_ranks(chains: FloatArray) -> FloatArray:
    """Ranks among all samples, as quantiles of a normal distribution."""
    ranks = rankdata(chains).reshape(chains.shape)
    return np.asarray(norm.ppf((ranks - 0.375) / (chains.size + 0.25)))


def _rhat(chains: FloatArray) -> float:
    steps = chains.shape[1]
    within = float(np.var(chains, axis=1, ddof=1).mean())
    between = float(np.var(chains.mean(axis=1), ddof=1))
    if within <= 0.0:  # nothing moved
        return np.inf if between > 0.0 else 1.0
    return float(np.sqrt((steps - 1.0) / steps + between / within))


def _autocovariance(chains: FloatArray) -> FloatArray:
    """Of each chain about its own mean, shape (M, N)."""
    steps = chains.shape[1]
    length = next_fast_len(2 * steps)
    transformed = rfft(chains - chains.mean(axis=1, keepdims=True), length, axis=1)
    return np.asarray(irfft(np.abs(transformed) ** 2, length, axis=1)[:, :steps] / steps)
