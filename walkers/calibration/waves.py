"""Waves: sets of the free parameters, as points of a unit cube, run through all experiments; each wave is a sweep."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist
from scipy.stats import norm, qmc

from walkers.inputs.axes import flatten
from walkers.inputs.calibration import Calibration, Parameter
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.schema import ALTERNATIVES
from walkers.inputs.sweep import Sweep, expand
from walkers.paper.sensitivity import misalignment
from walkers.postprocess.steady_state import steady_walkers, together
from walkers.postprocess.tables import read_table
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Failure, Options
from walkers.sweeps.table import load

if TYPE_CHECKING:
    import pandas as pd

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_DIGITS = 9
_LEAST_SPEED = 5e-5


@dataclass(frozen=True)
class Space:
    """D free parameters, in the order of the coordinates of the unit cube; logarithms where a parameter says so."""

    parameters: tuple[Parameter, ...]

    @property
    def dimensions(self) -> int:
        """D."""
        return len(self.parameters)

    @cached_property
    def logarithmic(self) -> BoolArray:
        """Which parameters are scaled by their logarithms, shape (D,)."""
        return np.array([one.log for one in self.parameters])

    @cached_property
    def _ends(self) -> FloatArray:
        """Of the ranges, scaled, shape (2, D)."""
        return self._scaled(np.array([one.range for one in self.parameters], np.float64).T)

    def _scaled(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.log(values, out=np.array(values, np.float64), where=self.logarithmic))

    def values(self, unit: FloatArray) -> FloatArray:
        """Values of the parameters at points of the unit cube, shape (..., D)."""
        scaled = self._ends[0] + np.asarray(unit) * (self._ends[1] - self._ends[0])
        return np.asarray(np.exp(scaled, out=scaled, where=self.logarithmic))

    def unit(self, values: FloatArray) -> FloatArray:
        """Points of the unit cube at values of the parameters, shape (..., D)."""
        return np.asarray((self._scaled(values) - self._ends[0]) / (self._ends[1] - self._ends[0]))

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
    """So many of some candidates (C, D), each the farthest from those before it and from points that are taken."""
    distance = cdist(candidates, taken).min(axis=1, initial=np.inf)
    chosen: list[int] = []
    for _ in range(min(points, len(candidates))):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(candidates - candidates[chosen[-1]], axis=1))
    return candidates[chosen]


@dataclass(frozen=True)
class Wave:
    """P parameter sets and what the engine made of them."""

    unit: FloatArray  # the sets, in the unit cube, shape (P, D)
    outcome: FloatArray  # each observation, SI units and degrees, shape (P, K); NaN where there is none
    table: pd.DataFrame  # the sweep's, P times the number of experiments long
    failures: list[Failure]  # of its points


def wave_sweep(
    calibration: Calibration, values: FloatArray, name: str, extra: Mapping[str, Mapping[str, Any]] | None = None
) -> Sweep:
    """The sweep of a wave: every parameter set (P, D) with every experiment, set by set.

    Experiments may have ``extra`` keys in these runs alone.

    Raises
    ------
    InputError
        If a key of the calibration is none of a case.
    """
    points = []
    for row in values:
        for label, keys in calibration.experiments.items():
            more = (extra or {}).get(label, {})
            replaced = {other for key in more for other in ALTERNATIVES.get(key, ())}
            point = {**{key: value for key, value in keys.items() if key not in replaced}, **more}
            for parameter, value in zip(calibration.parameters, row, strict=True):
                if label in parameter.experiments:
                    digits = f"{value:.{_DIGITS}g}"
                    given = f"{digits} {parameter.unit}" if parameter.unit else float(digits)
                    point |= dict.fromkeys(parameter.keys, given)
            points.append(point)
    settings = flatten(calibration.file.set, lambda _: False)
    document = {
        "title": calibration.file.title,
        "case": calibration.file.case,
        # What the runs have beside it, such as twice the cycles, stands in for what is set.
        "set": {key: value for key, value in settings.items() if key not in points[0]},
        "zip": [{key: [point[key] for point in points] for key in points[0]}],
    }
    sweep = expand(document, source=calibration.source, name=name, folder=calibration.folder)
    if "dimers" not in sweep.document:
        problem = Problem("case", f'"{calibration.file.case}"', "expected a case of dimers")
        raise InputError(calibration.source, [problem])
    return sweep


def run_wave(calibration: Calibration, unit: FloatArray, sweep: Sweep, out: Path, options: Options, **how: Any) -> Wave:
    """Run what is missing of the sweep of a wave (P, D); the rest is as for `walkers.sweeps.run.run_sweep`."""
    record, failures = run_sweep(sweep, out, options, **how)
    table = load(record.directory)
    return Wave(unit, _observed(calibration, table), table, failures)


def _observed(calibration: Calibration, table: pd.DataFrame) -> FloatArray:
    """What a wave's table says of each observation, shape (P, K); NaN where there is none, or the run failed."""
    labels = list(calibration.experiments)
    seen = seen_in(calibration, table, {observation.quantity for observation in calibration.observations})

    def mean(quantity: str, chosen: list[str]) -> FloatArray:
        return np.asarray(seen[quantity][:, [labels.index(label) for label in chosen]].mean(axis=1))

    columns = []
    for one in calibration.observations:
        value = mean(one.quantity, one.of)
        if one.over:  # a ratio of two speeds says nothing where the lower one is none
            below = mean(one.quantity, one.over)
            value = value / np.where(np.abs(below) > _LEAST_SPEED, below, np.nan)
        columns.append(value)
    return np.stack(columns, axis=1)


def seen_in(calibration: Calibration, table: pd.DataFrame, quantities: Collection[str]) -> dict[str, FloatArray]:
    """Quantities of each run of a wave, each of shape (P, number of experiments).

    Speeds are means over the walkers that are some until the end (`walkers.postprocess.steady_state.steady_walkers`);
    NaN where there is none, or the run failed.
    """
    found = {quantity: np.full(len(table), np.nan) for quantity in quantities}
    for place in np.flatnonzero(table["status"] == "finished"):
        run = table["run"].iloc[place]
        kept = steady_walkers(run)
        for quantity, values in found.items():
            if quantity == "misalignment":
                values[place] = misalignment(run).max() if together(read_table(run, "walkers")).all() else np.nan
            elif len(kept):
                values[place] = kept[quantity].mean()
    return {quantity: values.reshape(-1, len(calibration.experiments)) for quantity, values in found.items()}
