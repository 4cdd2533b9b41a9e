"""Calibration: parameter sets in all experiments, emulators between them, the posterior, its check by the engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from walkers.arrays import FloatArray
from walkers.calibration.emulator import Emulator, Posterior
from walkers.calibration.file import Calibration
from walkers.calibration.observations import NO_NUMBERS, Observation, numbers_in
from walkers.errors import WalkersError
from walkers.extras import require
from walkers.inputs.axes import unit_cube
from walkers.progress import progress_of
from walkers.runner.failures import BeadsLost, BlowUp
from walkers.sweeps.scheduler import Failure, SweepOptions, run_sweep
from walkers.sweeps.table import load_table

PROPOSED = (
    "highest posterior",
    "highest posterior without what is held out",
    "nearest of all sets",
)
_MISSING = 30.0
"""Distance in deviations that counts for a number that does not exist."""
FINAL = frozenset(failure.__name__ for failure in (BeadsLost, BlowUp))
"""Failures that the parameters cause: a repetition would fail again."""


class CalibrationStopped(WalkersError):
    """Points of a sweep are missing for reasons other than their parameters; later steps would be unreliable."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a calibration of D parameters to K observations.

    ``sets`` are points of the unit cube of the prior, shape (D,): those of the file, then `PROPOSED`; ``numbers`` the
    engine's observations there, shape (K,), NaN where there is none. The emulators, by the names of all but costly
    observations, are from a ``number`` of sets. ``held_out`` is the posterior without what is held out. ``failures``
    are by sweep.
    """

    calibration: Calibration
    sets: Mapping[str, FloatArray]
    numbers: Mapping[str, FloatArray]
    number: int
    emulators: Mapping[str, Emulator]
    posterior: Posterior
    held_out: Posterior
    failures: Mapping[str, list[Failure]]

    def predicted(self, observation: Observation) -> FloatArray | None:
        """5 %, median and 95 % of what was held out, from the other observations; None for others."""
        emulator = self.emulators.get(observation.name)
        if emulator is None or observation.group not in self.calibration.file.design.held_out:
            return None
        samples = self.held_out.samples
        normal = np.random.default_rng(self.held_out.seed).standard_normal(len(samples))
        return np.percentile(emulator.numbers(samples, normal), (5.0, 50.0, 95.0))


def calibrate(
    calibration: Calibration,
    out: Path,
    options: SweepOptions,
    *,
    progress: bool | None = False,
    engine: str | None = None,
) -> Outcome:
    """Start or continue a calibration; finished runs are not repeated. Runs that are made keep no dumps.

    Three sweeps in the folder ``out``: ``NAME-named``, the sets of the file; ``NAME-round``, a Sobol sequence of sets
    without the costly experiments; and ``NAME-proposed``. ``options`` and ``engine`` are as for
    `walkers.sweeps.scheduler.run_sweep`. `InputError` if a key of the file cannot be used, or a range exceeds that of
    its key; `CalibrationStopped` if points are missing for reasons other than their parameters.
    """
    require("calibrate")
    file, failures = calibration.file, dict[str, list[Failure]]()
    design, observations = file.design, file.observations
    ends = np.array([parameter.range for parameter in file.parameters.values()]).T
    list(
        calibration.sweep(calibration.name, ends).cases()
    )  # refuses ranges that exceed those of their keys

    kept = replace(options, final=FINAL, dumps=False)

    def run(part: str, unit: FloatArray, experiments: Sequence[str] = ()) -> FloatArray:
        sweep = calibration.sweep(
            f"{calibration.name}-{part}", calibration.values(unit), experiments
        )
        with progress_of(sweep.name, progress) as advance:
            record, failed = run_sweep(sweep, out, kept, engine=engine, on_progress=advance)
        failures.update({sweep.name: failed} if failed else {})
        return _numbers(
            calibration, experiments or [*calibration.experiments], record.directory, failed
        )

    named = run("named", calibration.sets) if file.sets else np.zeros((0, len(observations)))
    sobol = unit_cube(len(file.parameters), design.points, design.seed)
    cheap = [label for label in calibration.experiments if label not in calibration.costly]
    unit = np.concatenate([calibration.sets, sobol])
    numbers = np.concatenate([named, run("round", sobol, cheap)])
    columns = zip(observations, numbers.T, strict=True)
    emulators = {
        observation.name: Emulator.of(observation, unit, column, design.seed)
        for observation, column in columns
        if not observation.costly
    }
    posterior, held_out = (
        Posterior.of([*emulators.values()], design.posterior, design.seed, without)
        for without in ((), design.held_out)
    )
    proposed = np.stack([posterior.best, held_out.best, unit[nearest(observations, numbers)]])
    rows, names = np.concatenate([named, run("proposed", proposed)]), (*file.sets, *PROPOSED)
    sets = dict(zip(names, np.concatenate([calibration.sets, proposed]), strict=True))
    outcome = dict(zip(names, rows, strict=True))
    return Outcome(calibration, sets, outcome, len(unit), emulators, posterior, held_out, failures)


def _numbers(
    calibration: Calibration, labels: Sequence[str], sweep: Path, failed: list[Failure]
) -> FloatArray:
    """The observations of the sets of a sweep, shape (P, K); NaN for those of runs that failed, or are none of it."""
    table, undone = (
        load_table(sweep),
        [failure for failure in failed if failure.reason not in FINAL],
    )
    if undone or not table["status"].isin(("finished", "failed")).all():
        message = undone[0].message if undone else "another process is running them"
        raise CalibrationStopped(
            f"{sweep.name}: points are missing ({message}); call again to continue"
        )
    seen, lacking = numbers_in(table), dict.fromkeys(calibration.experiments, NO_NUMBERS)
    sets = [
        lacking | dict(zip(labels, seen[at:], strict=False))
        for at in range(0, len(seen), len(labels))
    ]
    return np.array(
        [
            [observation.of_numbers(numbers) for observation in calibration.file.observations]
            for numbers in sets
        ]
    )


def nearest(observations: Sequence[Observation], numbers: FloatArray) -> int:
    """The set with the least Σ ln(1 + r²) by its numbers (P, K), r the distances from facts with weight in deviations.

    The logarithm limits the weight of a fact that no set reproduces.
    """
    weighed = [place for place, observation in enumerate(observations) if observation.weighed]
    away = np.array(
        [[observations[place].residual(row[place]) for place in weighed] for row in numbers]
    )
    return int(np.argmin(np.log1p(np.where(np.isnan(away), _MISSING, away) ** 2).sum(axis=1)))
