"""How likely the published numbers are: normal about what the engine gives, with the covariance of both's errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

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
    mean, deviation = np.clip(mean, -LARGEST, LARGEST), np.maximum(deviation, _LEAST_DEVIATION)
    covariance = shared + _diagonal(discrepancy**2)
    of_numbers: FloatArray = np.asarray(np.linalg.inv(covariance), np.float64)
    of_engine = np.linalg.inv(correlation) / deviation[:, :, None] / deviation[:, None, :]
    z = _mode(mean, of_numbers, of_engine)
    sinh, cosh, weight, away = np.sinh(z), np.cosh(z), _times(of_numbers, np.sinh(z)), z - mean
    hessian = of_engine + of_numbers * cosh[:, :, None] * cosh[:, None, :] + _diagonal(sinh * weight)
    sign, curvature = np.linalg.slogdet(hessian)
    misfit = np.sum(sinh * weight + away * _times(of_engine, away), axis=1)
    spread = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(correlation)[1] + 2.0 * np.log(deviation).sum(axis=1)
    total = -0.5 * (misfit + curvature + spread)
    return np.where((sign > 0.0) & np.isfinite(total), total, -np.inf)  # else there is no minimum


def _mode(mean: FloatArray, of_numbers: FloatArray, of_engine: FloatArray) -> FloatArray:
    """Where ψ is least, by Newton's steps.

    They are of one at most, which is what Newton's are where sinh is an exponential, and take of the curvature what is
    positive, so that all are downhill.
    """
    z, left = mean.copy(), np.arange(len(mean))
    for _ in range(_ITERATIONS):
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
