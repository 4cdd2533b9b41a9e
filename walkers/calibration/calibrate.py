"""Run a calibration: parameter sets in all experiments, emulators, the posterior, and its check.

The sets, the experiments and the facts are those of a calibration file
(`walkers.calibration.file`). Tables and figures of the outcome are made in
`walkers.calibration.report`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.calibration.emulator import Emulator, Posterior
from walkers.calibration.file import Calibration
from walkers.calibration.observations import NO_NUMBERS, Observation, quantities_of_runs
from walkers.errors import WalkersError
from walkers.extras import require
from walkers.inputs.axes import unit_cube
from walkers.progress import progress_of
from walkers.runner.failures import BeadsLost, BlowUp
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.table import load_table
from walkers.sweeps.workers import Failure

if TYPE_CHECKING:
    import pandas as pd

PROPOSED = (
    "highest posterior",
    "highest posterior without what is held out",
    "nearest of all sets",
)
"""Names of the sets that a calibration proposes, and that the engine checks."""
FINAL = frozenset((BeadsLost.__name__, BlowUp.__name__))
"""Failures that the parameters cause: a repetition would fail again."""
_MISSING_DISTANCE = 30.0
"""Distance from a fact, in deviations, that counts for a number that does not exist."""


class CalibrationStopped(WalkersError):
    """Points of a sweep are missing for reasons other than their parameters.

    Later steps would be unreliable without them.
    """


@dataclass(frozen=True)
class Outcome:
    """Outcome of a calibration of D parameters to K observations.

    Attributes
    ----------
    calibration
        The calibration.
    sets
        Sets as points of the unit cube of the prior, shape (D,), by name: those of the file, then
        `PROPOSED`.
    numbers
        Observations of the engine at these sets, shape (K,), in SI units, angles in degrees; NaN
        where a number does not exist.
    number_of_fitted_sets
        Number of sets to which the emulators are fitted.
    emulators
        Emulators of all but costly observations, by the names of the observations.
    posterior
        The posterior from all observations with a weight.
    held_out
        The posterior without the groups that are held out.
    failures
        Failed points, by the names of the sweeps.
    """

    calibration: Calibration
    sets: Mapping[str, FloatArray]
    numbers: Mapping[str, FloatArray]
    number_of_fitted_sets: int
    emulators: Mapping[str, Emulator]
    posterior: Posterior
    held_out: Posterior
    failures: Mapping[str, list[Failure]]

    def predicted(self, observation: Observation) -> FloatArray | None:
        """Prediction of an observation that was held out, from the other observations.

        Returns
        -------
        ndarray, shape (3,), or None
            5 %, median and 95 % of the number in SI units, angles in degrees; None for observations
            that were not held out.
        """
        emulator = self.emulators.get(observation.name)
        if emulator is None or observation.group not in self.calibration.file.design.held_out:
            return None
        samples = self.held_out.samples
        normal = np.random.default_rng(self.held_out.seed).standard_normal(len(samples))
        return np.percentile(emulator.numbers(samples, normal), (5.0, 50.0, 95.0))


@dataclass
class _Sweeps:
    """Runs the sweeps of a calibration in a folder, and collects their failures."""

    calibration: Calibration
    out: Path
    options: SweepOptions
    progress: bool | None
    engine: str | None
    failures: dict[str, list[Failure]] = field(default_factory=dict)

    def run(self, part: str, sets: FloatArray, experiments: Sequence[str]) -> FloatArray:
        """Run sets in experiments, if they are not finished.

        Parameters
        ----------
        part
            End of the name of the sweep.
        sets : ndarray, shape (P, D)
            Points of the unit cube of the prior.
        experiments
            Names of the experiments.

        Returns
        -------
        ndarray, shape (P, K)
            The observations of the sets; NaN for those of runs that failed, and for those that need
            other experiments.
        """
        name = f"{self.calibration.name}-{part}"
        sweep = self.calibration.sweep(name, self.calibration.values(sets), experiments)
        with progress_of(sweep.name, self.progress) as advance:
            record, failed = run_sweep(
                sweep, self.out, self.options, engine=self.engine, on_progress=advance
            )
        if failed:
            self.failures[sweep.name] = failed
        table = load_table(record.directory)
        _check_complete(name, table, failed)
        return _observed(self.calibration, experiments, quantities_of_runs(table))


def calibrate(
    calibration: Calibration,
    out: Path,
    options: SweepOptions,
    *,
    progress: bool | None = False,
    engine: str | None = None,
) -> Outcome:
    """Start or continue a calibration; finished runs are not repeated.

    It makes three sweeps: ``NAME-named``, the sets of the file; ``NAME-round``, a Sobol sequence of
    sets without the costly experiments; and ``NAME-proposed``. Their runs keep no dumps.

    Parameters
    ----------
    calibration
        The calibration.
    out
        Folder of the sweeps and of the run directories.
    options
        As for `walkers.sweeps.scheduler.run_sweep`.
    progress
        Whether to show the progress; None: only in notebooks.
    engine
        As for `walkers.sweeps.scheduler.run_sweep`.

    Returns
    -------
    Outcome
        Sets, their numbers, emulators and posteriors.

    Raises
    ------
    InputError
        If a key of the file cannot be used, or a range exceeds that of its key.
    CalibrationStopped
        If points are missing for reasons other than their parameters.
    """
    require("calibrate")
    _check_ranges(calibration)
    file = calibration.file
    design = file.design
    experiments = list(calibration.experiments)
    costly = calibration.costly
    cheap = [name for name in experiments if name not in costly]
    without_dumps = replace(options, final=FINAL, dumps=False)
    sweeps = _Sweeps(calibration, out, without_dumps, progress, engine)

    named = calibration.sets
    numbers_of_named = np.zeros((0, len(file.observations)))
    if file.sets:
        numbers_of_named = sweeps.run("named", named, experiments)
    sobol = unit_cube(len(file.parameters), design.points, design.seed)
    points = np.concatenate([named, sobol])
    numbers = np.concatenate([numbers_of_named, sweeps.run("round", sobol, cheap)])

    emulators = {}
    for observation, column in zip(file.observations, numbers.T, strict=True):
        if not observation.costly:
            emulators[observation.name] = Emulator.fit(observation, points, column, design.seed)
    all_emulators = list(emulators.values())
    posterior = Posterior.from_emulators(all_emulators, design.posterior, design.seed)
    held_out = Posterior.from_emulators(
        all_emulators, design.posterior, design.seed, design.held_out
    )

    best_of_all = points[nearest(file.observations, numbers)]
    proposed = np.stack([posterior.best, held_out.best, best_of_all])
    numbers_of_proposed = sweeps.run("proposed", proposed, experiments)
    names = (*file.sets, *PROPOSED)
    sets = np.concatenate([named, proposed])
    numbers_of_sets = np.concatenate([numbers_of_named, numbers_of_proposed])
    return Outcome(
        calibration=calibration,
        sets=dict(zip(names, sets, strict=True)),
        numbers=dict(zip(names, numbers_of_sets, strict=True)),
        number_of_fitted_sets=len(points),
        emulators=emulators,
        posterior=posterior,
        held_out=held_out,
        failures=sweeps.failures,
    )


def _check_ranges(calibration: Calibration) -> None:
    """Refuse ranges of parameters that exceed those of their keys.

    It resolves the cases at both ends of the ranges, which raise `InputError`.
    """
    ranges = [parameter.range for parameter in calibration.file.parameters.values()]
    ends = np.array(ranges).T
    for _case in calibration.sweep(calibration.name, ends).cases():
        pass


def _check_complete(sweep: str, table: pd.DataFrame, failed: Sequence[Failure]) -> None:
    """Raise `CalibrationStopped` if points are missing for reasons other than their parameters."""
    repeatable = [failure for failure in failed if failure.reason not in FINAL]
    if repeatable:
        reason = repeatable[0].message
    elif not table["status"].isin(("finished", "failed")).all():
        reason = "another process is running them"
    else:
        return
    raise CalibrationStopped(f"{sweep}: points are missing ({reason}); call again to continue")


def _observed(
    calibration: Calibration,
    experiments: Sequence[str],
    numbers_of_runs: Sequence[Mapping[str, float]],
) -> FloatArray:
    """The observations of sets, shape (P, K).

    ``numbers_of_runs`` has the numbers of all experiments of the first set, then of the second, ….
    Experiments that were not run give NaN.
    """
    rows = []
    for start in range(0, len(numbers_of_runs), len(experiments)):
        numbers: dict[str, Mapping[str, float]] = dict.fromkeys(calibration.experiments, NO_NUMBERS)
        for number, experiment in enumerate(experiments):
            numbers[experiment] = numbers_of_runs[start + number]
        observations = calibration.file.observations
        rows.append([observation.number_from(numbers) for observation in observations])
    return np.array(rows)


def nearest(observations: Sequence[Observation], numbers: FloatArray) -> int:
    """Index of the set that is nearest to the facts.

    Parameters
    ----------
    observations
        The K facts. Those without a weight in a calibration are not used.
    numbers : ndarray, shape (P, K)
        Observations of the sets in SI units, angles in degrees; NaN where a number does not exist.

    Returns
    -------
    int
        The set with the least Σ ln(1 + r²), r the distances from the facts in deviations. The
        logarithm limits the weight of a fact that no set reproduces.
    """
    columns = []
    for observation, column in zip(observations, numbers.T, strict=True):
        if observation.weighed:
            columns.append([observation.residual(number) for number in column])
    distances = np.stack(columns, axis=1)
    distances = np.where(np.isnan(distances), _MISSING_DISTANCE, distances)
    return int(np.argmin(np.log1p(distances**2).sum(axis=1)))
