"""Calibration: parameter sets in all experiments, emulators between them, the posterior, its check by the engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.calibration.emulator import Emulator, Posterior
from walkers.calibration.file import Calibration
from walkers.calibration.observations import NO_NUMBERS, FloatArray, Observation, numbers_of
from walkers.errors import InputError, Problem, WalkersError
from walkers.extras import require
from walkers.inputs.axes import unit_cube
from walkers.progress import progress_of
from walkers.runner.failures import BeadsLost, BlowUp
from walkers.sweeps.scheduler import Failure, Options, run_sweep
from walkers.sweeps.table import load

BEST, HELD_OUT = "highest posterior", "without what is held out"
"""Names of the sets that the emulators propose: from all observations, and from those that are not held out."""
MISSING = 30.0
"""Distance in deviations that counts for a number that does not exist."""
FINAL = frozenset(failure.__name__ for failure in (BeadsLost, BlowUp))
"""Failures that the parameters cause: a repetition would fail again."""


class CalibrationStopped(WalkersError):
    """Points of a sweep are missing for reasons other than their parameters; later steps would be unreliable."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a calibration.

    Attributes
    ----------
    calibration
        What was asked.
    unit, numbers : ndarray, shape (P, D) and (P, K)
        All sets that were run, in the unit cube of the prior, and the K observations of the engine; NaN where there is
        none. First the sets that the file names, last those that the emulators propose.
    names
        Names of sets, by their places.
    emulators, posterior, held_out
        Of the observations, from the sets before the proposed ones; the posterior from all, and from those that are
        not held out (None if nothing is).
    failures
        Points that failed, by sweep.
    """

    calibration: Calibration
    unit: FloatArray
    numbers: FloatArray
    names: Mapping[str, int]
    emulators: tuple[Emulator, ...]
    posterior: Posterior
    held_out: Posterior | None
    failures: Mapping[str, list[Failure]]

    @property
    def best(self) -> int:
        """The set with most agreeing facts by the engine; with equal numbers, the one nearest to them."""
        return int(ranking(self.calibration.file.observations, self.numbers)[0])


def calibrate(
    calibration: Calibration, out: Path, options: Options, *, progress: bool | None = False, **how: Any
) -> Outcome:
    """Start or continue a calibration; finished runs are not repeated.

    The named sets and a Sobol sequence of sets are a sweep, ``NAME-sets``. Two further sets, of the highest posterior
    from all observations and from those that are not held out, are another one, ``NAME-proposed``.

    Parameters
    ----------
    calibration, options, how
        From `walkers.calibration.file.load_calibration`; as for `walkers.sweeps.scheduler.run_sweep`.
    out
        Folder of the run directories.
    progress
        See `walkers.progress.progress_of`.

    Raises
    ------
    InputError
        If a key of the file cannot be used, or a range exceeds that of its key.
    CalibrationStopped
        If points are missing for reasons other than their parameters.
    runner.EngineFailure
        If there is no engine, or its audit failed.
    """
    require("calibrate")
    _check_ranges(calibration)
    design, observations = calibration.file.design, calibration.file.observations
    failures: dict[str, list[Failure]] = {}

    def run(part: str, unit: FloatArray) -> FloatArray:
        sweep = calibration.sweep(f"{calibration.name}-{part}", calibration.values(unit))
        with progress_of(sweep.name, progress) as advance:
            record, failed = run_sweep(sweep, out, replace(options, final=FINAL), on_progress=advance, **how)
        failures.update({sweep.name: failed} if failed else {})
        return _numbers(calibration, record.directory, failed)

    sobol = unit_cube("sobol", len(calibration.file.parameters), design.points, design.seed)
    unit = np.concatenate([calibration.sets, sobol])
    numbers, names = run("sets", unit), dict(zip(calibration.file.sets, range(len(unit)), strict=False))
    emulators = tuple(
        Emulator.of(one, unit, column, design.seed) for one, column in zip(observations, numbers.T, strict=True)
    )
    posteriors = [Posterior.of(emulators, design.posterior, design.seed)]
    if design.held_out:
        posteriors.append(Posterior.of(emulators, design.posterior, design.seed, design.held_out))
    proposed = np.stack([one.best for one in posteriors])
    names |= {name: len(unit) + place for place, name in enumerate((BEST, HELD_OUT)[: len(proposed)])}
    numbers, unit = np.concatenate([numbers, run("proposed", proposed)]), np.concatenate([unit, proposed])
    held_out = posteriors[1] if design.held_out else None
    return Outcome(calibration, unit, numbers, names, emulators, posteriors[0], held_out, failures)


def _numbers(calibration: Calibration, sweep: Path, failed: list[Failure]) -> FloatArray:
    """The observations of the sets of a sweep, shape (P, K); NaN for those of runs that failed for good."""
    table, labels = load(sweep), list(calibration.experiments)
    undone = [failure for failure in failed if failure.reason not in FINAL]
    if undone or not table["status"].isin(("finished", "failed")).all():
        message = undone[0].message if undone else "another process is running them"
        raise CalibrationStopped(f"{sweep.name}: points are missing ({message}); call again to continue")
    states = zip(table["run"], table["status"], strict=True)
    seen = [numbers_of(run) if status == "finished" else NO_NUMBERS for run, status in states]
    sets = [dict(zip(labels, seen[at : at + len(labels)], strict=True)) for at in range(0, len(seen), len(labels))]
    return np.array([[one.of_numbers(numbers) for one in calibration.file.observations] for numbers in sets])


def _check_ranges(calibration: Calibration) -> None:
    """Resolve the cases at the ends of all ranges: refuse ranges that exceed those of a case."""
    ends = np.array([parameter.range for parameter in calibration.file.parameters.values()]).T
    try:
        list(calibration.sweep(calibration.name, ends).cases())
    except InputError as error:
        problem = error.problems[0]
        for name, one in calibration.file.parameters.items():
            if problem.key in one.keys:
                message = f"{problem.key} = {problem.value}: {problem.expected}"
                key, value = f"parameters.{name}.range", f"[{one.range[0]:g}, {one.range[1]:g}]"
                raise InputError(calibration.source, [Problem(key, value, message)]) from error
        raise


def ranking(observations: list[Observation], numbers: FloatArray) -> npt.NDArray[np.int64]:
    """Order of sets by their numbers (P, K): those with most agreeing facts come first.

    Derived observations do not count. Sets with equal counts are ordered by Σ ln(1 + r²), r the distances from the
    facts in deviations; the logarithm limits the weight of a fact that no set reproduces.
    """
    own = [place for place, one in enumerate(observations) if not one.derived]
    away = np.array([[observations[place].residual(row[place]) for place in own] for row in numbers])
    misfit = np.log1p(np.where(np.isnan(away), MISSING, away) ** 2).sum(axis=1)
    return np.lexsort((misfit, -(np.abs(away) <= 1.0).sum(axis=1)))
