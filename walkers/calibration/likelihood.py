"""How likely the published numbers are: normal about what the engine gives, with the covariance of both's errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from walkers.calibration.emulator import LARGEST
from walkers.inputs.calibration import Observation, SharedError

FloatArray = npt.NDArray[np.float64]
_ITERATIONS = 40
_CONVERGED = 1e-4
_LEAST_DEVIATION = 1e-3


def observation_covariance(observations: Sequence[Observation], shared: Mapping[str, SharedError]) -> FloatArray:
    """Covariance of the published numbers' errors, each in its own standard deviations, shape (K, K).

    δ_jk + Σ s (1 − δ_jk) over the shared errors that both j and k have, s their share of the variance.
    """
    covariance = np.eye(len(observations))
    for error in shared.values():
        has = np.array([one.name in error.observations for one in observations])
        both = np.outer(has, has)
        np.fill_diagonal(both, False)
        covariance += error.share * both
    return covariance


def log_likelihood(
    mean: FloatArray, deviation: FloatArray, correlation: FloatArray, shared: FloatArray, discrepancy: FloatArray
) -> FloatArray:
    """Logarithm of the density of residuals of zero, but for ½ K ln 2π, shape (N,).

    ln ∫ N(sinh z; 0, C) N(z; m, Σ) dz, z the transformed residuals (`walkers.calibration.emulator.transformed`), by
    Laplace's approximation, −ψ(z) − ½ ln |C| − ½ ln |Σ| − ½ ln |∇∇ψ| at the z where

        ψ(z) = ½ sinh(z)ᵀ C⁻¹ sinh(z) + ½ (z − m)ᵀ Σ⁻¹ (z − m)

    is least. To linearise at m instead would make the hopeless cheap: no residual would be more than 1/deviation errors
    off.

    Parameters
    ----------
    mean, deviation : ndarray, shape (N, K)
        Of the transformed residuals, by the emulators: m, and the roots of the diagonal of Σ.
    correlation : ndarray, shape (K, K)
        Of the emulators' errors: that of Σ.
    shared : ndarray, shape (K, K)
        Covariance of the observations' errors, in their standard deviations (`observation_covariance`).
    discrepancy : ndarray, shape (N, K)
        What no parameters explain, in the same; C is ``shared`` with its squares added to the diagonal.
    """
    deviation = np.ascontiguousarray(np.maximum(deviation, _LEAST_DEVIATION))
    inverse = np.asarray(np.linalg.inv(correlation), dtype=np.float64)
    constant = -0.5 * np.linalg.slogdet(correlation)[1] - np.log(deviation).sum(axis=1)
    start = np.ascontiguousarray(np.clip(mean, -LARGEST, LARGEST))
    return np.asarray(constant + _laplace(start, deviation, inverse, shared, discrepancy))


@njit(cache=True)
def _laplace(
    mean: FloatArray, deviation: FloatArray, inverse: FloatArray, shared: FloatArray, discrepancy: FloatArray
) -> FloatArray:
    """The logarithms, but for ½ ln |Σ|: Newton's steps to the mode, then the determinants there.

    ``inverse`` is that of the correlation. Steps are of one at most, which is what Newton's are where sinh is an
    exponential, and take of the curvature what is positive, so that all are downhill.
    """
    total = np.full(len(mean), -np.inf)
    for n in range(len(mean)):
        covariance = shared + np.diag(discrepancy[n] ** 2)
        of_numbers = np.linalg.inv(covariance)
        of_engine = inverse / deviation[n] / deviation[n].reshape(-1, 1)
        z = mean[n].copy()
        for _ in range(_ITERATIONS):
            sinh, cosh = np.sinh(z), np.cosh(z)
            weight = of_numbers @ sinh
            step = cosh * weight + of_engine @ (z - mean[n])
            hessian = of_engine + of_numbers * cosh * cosh.reshape(-1, 1)
            hessian += np.diag(np.maximum(sinh * weight, 0.0))
            _solve(hessian, step)
            step = np.minimum(np.maximum(step, -1.0), 1.0)
            z -= step
            if np.max(np.abs(step)) < _CONVERGED:
                break
        sinh, cosh = np.sinh(z), np.cosh(z)
        weight, away = of_numbers @ sinh, z - mean[n]
        hessian = of_engine + of_numbers * cosh * cosh.reshape(-1, 1) + np.diag(sinh * weight)
        nothing = np.zeros(len(z))
        logarithm = _solve(hessian, nothing) + _solve(covariance, nothing)
        if np.isfinite(logarithm):  # else there is no minimum
            total[n] = -0.5 * (sinh @ weight + away @ (of_engine @ away) + logarithm)
    return total


@njit(cache=True)
def _solve(matrix: FloatArray, vector: FloatArray) -> float:
    """Solve in place by Cholesky's factors, which are left in the matrix, and return ln |matrix|; NaN if not positive.

    LAPACK takes three times as long for matrices of twenty rows.
    """
    count, logarithm = len(vector), 0.0
    for i in range(count):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if j < i:
                matrix[i, j] = total / matrix[j, j]
            elif total <= 0.0:
                return np.nan
            else:
                matrix[i, i] = np.sqrt(total)
                logarithm += np.log(total)
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
    return logarithm
