"""The space of the free parameters, as a unit cube: designs in it, priors about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.stats import norm, qmc

from walkers.inputs.calibration import Parameter

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Space:
    """D free parameters.

    Attributes
    ----------
    parameters
        In the order of the coordinates.
    """

    parameters: tuple[Parameter, ...]

    @property
    def dimensions(self) -> int:
        """D."""
        return len(self.parameters)

    @cached_property
    def _log(self) -> npt.NDArray[np.bool_]:
        return np.array([one.log for one in self.parameters])

    @cached_property
    def _ends(self) -> FloatArray:
        """Lower and upper ends of the coordinates before they are scaled, shape (2, D)."""
        return self._scaled(np.array([one.range for one in self.parameters]).T)

    def _scaled(self, values: FloatArray) -> FloatArray:
        """Logarithms where a parameter says so."""
        return np.where(self._log, np.log(np.where(self._log, values, 1.0)), values)

    def values(self, unit: FloatArray) -> FloatArray:
        """Values of the parameters at points of the unit cube, shape (..., D)."""
        scaled = self._ends[0] + np.asarray(unit) * np.diff(self._ends, axis=0)[0]
        return np.where(self._log, np.exp(np.where(self._log, scaled, 0.0)), scaled)

    def unit(self, values: FloatArray) -> FloatArray:
        """Points of the unit cube at values of the parameters, shape (..., D)."""
        return np.asarray((self._scaled(np.asarray(values)) - self._ends[0]) / np.diff(self._ends, axis=0)[0])

    def log_prior(self, unit: FloatArray) -> FloatArray:
        """Logarithm of the density that is assumed beforehand, but for a constant, shape (...); -inf outside."""
        unit = np.asarray(unit)
        total = np.where(np.all((unit >= 0.0) & (unit <= 1.0), axis=-1), 0.0, -np.inf)
        scaled = self._scaled(self.values(unit))
        for place, one in enumerate(self.parameters):
            if one.normal is not None:
                mean, deviation = one.normal
                total = total + norm.logpdf(scaled[..., place], np.log(mean) if one.log else mean, deviation)
        return total

    def design(self, points: int, seed: int) -> FloatArray:
        """A space-filling first wave, shape (points, D): a scrambled Sobol sequence (`scipy.stats.qmc`)."""
        sampler = qmc.Sobol(self.dimensions, rng=np.random.default_rng(seed))
        return np.asarray(sampler.random_base2(int(np.ceil(np.log2(points))))[:points], dtype=np.float64)


def spread_out(candidates: FloatArray, points: int, taken: FloatArray) -> FloatArray:
    """So many of some candidates, each the farthest from those before it and from points that are taken already.

    Parameters
    ----------
    candidates : ndarray, shape (C, D)
    points
        How many, at most C.
    taken : ndarray, shape (T, D)
    """
    distance = np.full(len(candidates), np.inf)
    for one in taken:
        distance = np.minimum(distance, np.linalg.norm(candidates - one, axis=1))
    chosen = []
    for _ in range(min(points, len(candidates))):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(candidates - candidates[chosen[-1]], axis=1))
    return candidates[chosen]
