"""Gaussian processes that scikit-learn fitted, side by side: one pass through the linear algebra for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_solve

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Process:
    """A Gaussian process of a scaled Matérn kernel (ν = 5/2) and a constant one, conditioned on P points.

    Attributes
    ----------
    points : ndarray, shape (P, D)
        That it was fitted to, in the unit cube.
    scales : ndarray, shape (D,)
        Lengths over which it varies.
    amplitude, constant, noise
        Variances of the Matérn kernel, of the constant kernel, and of what a value has for itself.
    weights : ndarray, shape (P,)
        The mean is the kernel between a point and the fitted ones times these.
    inverse : ndarray, shape (P, P)
        The variance is less than that of the prior by the square form of the same kernel with this.
    shift, factor
        The mean is ``shift`` and ``factor`` times that of the process; the standard deviation ``factor`` times its.
    """

    points: FloatArray
    scales: FloatArray
    amplitude: float
    constant: float
    noise: float
    weights: FloatArray
    inverse: FloatArray
    shift: float
    factor: float


def knowing_nothing(dimensions: int, mean: float, deviation: float) -> Process:
    """A process without points: the same normal distribution everywhere."""
    none = np.zeros((0, dimensions))
    return Process(none, np.ones(dimensions), 0.0, 0.0, 1.0, np.zeros(0), np.zeros((0, 0)), mean, deviation)


def of_regressor(fitted: Any) -> Process:
    """scikit-learn's regressor of the kernel ``constant × Matérn + white``."""
    matern, white = fitted.kernel_.k1, fitted.kernel_.k2
    return Process(
        points=fitted.X_train_,
        scales=matern.k2.length_scale * np.ones(fitted.X_train_.shape[1]),
        amplitude=float(matern.k1.constant_value),
        constant=0.0,
        noise=float(white.noise_level),
        weights=fitted.alpha_,
        inverse=cho_solve((fitted.L_, True), np.eye(len(fitted.X_train_))),
        shift=float(fitted._y_train_mean),
        factor=float(fitted._y_train_std),
    )


def of_classifier(fitted: Any) -> Process:
    """The latent function of scikit-learn's binary classifier of the kernel ``constant × Matérn + constant``.

    By Laplace's approximation: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), Algorithm 3.2.
    """
    binary = fitted.base_estimator_
    matern, constant = binary.kernel_.k1, binary.kernel_.k2
    root = np.diag(binary.W_sr_)
    return Process(
        points=binary.X_train_,
        scales=matern.k2.length_scale * np.ones(binary.X_train_.shape[1]),
        amplitude=float(matern.k1.constant_value),
        constant=float(constant.constant_value),
        noise=0.0,
        weights=binary.y_train_ - binary.pi_,
        inverse=root @ cho_solve((binary.L_, True), root),
        shift=0.0,
        factor=1.0,
    )


class Processes:
    """K processes. Those with fewer points than the others have points that weigh nothing.

    scikit-learn's own ``predict`` checks and solves anew each time, which takes a chain ten times as long.

    Parameters
    ----------
    each
        The processes, of the same D.
    """

    def __init__(self, each: Sequence[Process]) -> None:
        most = max(max((len(one.points) for one in each), default=0), 1)
        dimensions = each[0].points.shape[1] if each else 0
        self.scales = np.array([one.scales for one in each]).reshape(len(each), 1, dimensions)
        self.points = np.zeros((len(each), most, dimensions))
        self.weights, self.inverse = np.zeros((len(each), most)), np.zeros((len(each), most, most))
        for place, one in enumerate(each):
            count = len(one.points)
            self.points[place, :count] = one.points / one.scales
            self.weights[place, :count], self.inverse[place, :count, :count] = one.weights, one.inverse
        self.amplitude, self.constant, self.noise, self.shift, self.factor = (
            np.array([getattr(one, name) for one in each])
            for name in ("amplitude", "constant", "noise", "shift", "factor")
        )
        self.square = np.sum(self.points**2, axis=2)

    def predict(self, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and standard deviations at points (N, D) of the unit cube, each of shape (N, K)."""
        if not len(self.amplitude):
            return np.zeros((len(unit), 0)), np.zeros((len(unit), 0))
        scaled = unit[None] / self.scales
        distance = -2.0 * scaled @ self.points.transpose(0, 2, 1)
        distance += np.sum(scaled**2, axis=2)[:, :, None] + self.square[:, None]
        distance = np.sqrt(5.0 * np.maximum(distance, 0.0, out=distance))
        near = np.exp(-distance)
        near *= 1.0 + distance + distance**2 / 3.0
        near *= self.amplitude[:, None, None]
        near += self.constant[:, None, None]
        mean = (near @ self.weights[:, :, None])[:, :, 0].T
        known = np.einsum("knp,knp->nk", near @ self.inverse, near)
        variance = np.maximum(self.amplitude + self.constant + self.noise - known, 0.0)
        return self.shift + self.factor * mean, self.factor * np.sqrt(variance)
