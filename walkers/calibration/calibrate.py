"""Calibration: waves (sweeps of parameter sets in all experiments), emulators, posterior, check by the engine."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

from walkers.calibration.emulator import LARGEST, Emulators, FloatArray, Space, fit_emulators, spread_out
from walkers.calibration.file import QUANTITIES, Calibration, Speed
from walkers.calibration.posterior import Density, Posterior, sample_posterior
from walkers.errors import InputError, Problem, WalkersError, refused
from walkers.extras import require
from walkers.inputs.case import Case
from walkers.inputs.keys import flatten
from walkers.inputs.sweep import Sweep, expand
from walkers.inputs.table import alternatives
from walkers.postprocess.gait import misalignment, steady_walkers, together
from walkers.postprocess.results import read
from walkers.postprocess.tables import read_table
from walkers.progress import progress_of
from walkers.runner.failures import BeadsLost, BlowUp
from walkers.runner.files import read_json, write_json
from walkers.sweeps.scheduler import Failure, Options, run_sweep
from walkers.sweeps.table import load

if TYPE_CHECKING:
    import pandas as pd

_DIGITS = 9
_LEAST_SPEED = 5e-5
_PARENTS, _NEAR, _TRIED = 5, 0.06, 4000
"""Number of best sets around which a wave samples, its radius (share of the ranges), and number of candidates."""
MISSING_MISFIT = float(np.log1p(30.0**2))
"""ln(1 + r²) of an observation that does not exist: a residual r of 30 standard deviations."""
_END = 0.005
"""Share of a range: sets closer to its ends are never the best set, since a better one may lie outside."""
_QUANTILES = norm.ppf((np.arange(5) + 0.5) / 5.0)
FINAL = frozenset(failure.__name__ for failure in (BeadsLost, BlowUp))
"""Failures that the parameters cause: a repetition would fail again."""


class CalibrationStopped(WalkersError):
    """Points of a wave are missing for reasons other than their parameters; later steps would be unreliable."""


@dataclass(frozen=True)
class Wave:
    """P parameter sets and the results of the engine."""

    unit: FloatArray  # the sets, in the unit cube, shape (P, D)
    outcome: FloatArray  # each observation, shape (P, K); NaN where there is none
    table: pd.DataFrame  # of the sweep; one row per set and experiment
    failures: list[Failure]  # of its points


def wave_sweep(
    calibration: Calibration, values: FloatArray, name: str, extra: Mapping[str, Mapping[str, Any]] | None = None
) -> Sweep:
    """The sweep of a wave: every parameter set (P, D) with every experiment, set by set.

    ``extra`` are keys of experiments for this sweep only. `InputError` if a key of the calibration is no key of a case.
    """
    points = []
    for row in values:
        for label, keys in calibration.experiments.items():
            more = (extra or {}).get(label, {})
            replaced = {other for key in more for other in alternatives(Case, key)}
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
        # Extra keys, such as twice the cycles, replace those that are set.
        "set": {key: value for key, value in settings.items() if key not in points[0]},
        "zip": [{key: [point[key] for point in points] for key in points[0]}],
    }
    sweep = expand(document, source=calibration.source, name=name, folder=calibration.folder)
    if "dimers" not in sweep.document:
        problem = Problem("case", f'"{calibration.file.case}"', "expected a case of dimers")
        raise InputError(calibration.source, [problem])
    return sweep


def run_wave(calibration: Calibration, unit: FloatArray, sweep: Sweep, out: Path, options: Options, **how: Any) -> Wave:
    """Run the missing points of a wave (P, D); other parameters as for `walkers.sweeps.scheduler.run_sweep`."""
    record, failures = run_sweep(sweep, out, options, **how)
    table, labels = load(record.directory), list(calibration.experiments)
    seen = _seen(table, len(labels))

    def mean(quantity: str, chosen: list[str]) -> FloatArray:
        return np.asarray(seen[quantity][:, [labels.index(label) for label in chosen]].mean(axis=1))

    columns = []
    for one in calibration.observations:
        value = mean(one.quantity, one.of)
        if one.over:  # a ratio to a vanishing speed is meaningless
            below = mean(one.quantity, one.over)
            value = value / np.where(np.abs(below) > _LEAST_SPEED, below, np.nan)
        columns.append(value)
    return Wave(unit, np.stack(columns, axis=1), table, failures)


def _seen(table: pd.DataFrame, experiments: int) -> dict[str, FloatArray]:
    """Quantities of each run of a wave (speeds: means of steady walkers); NaN if there is none, or the run failed."""
    rows: list[dict[str, float]] = []
    for run, status in zip(table["run"], table["status"], strict=True):
        rows.append(dict.fromkeys(QUANTITIES, np.nan))
        if status == "finished":
            kept = steady_walkers(read(run))
            rows[-1] |= {name: float(kept[name].mean()) for name in get_args(Speed)}
            walkers = read_table(run, "walkers")
            if together(walkers).all():
                rows[-1]["misalignment"] = float(misalignment(walkers).max())
    return {name: np.reshape([row[name] for row in rows], (-1, experiments)) for name in QUANTITIES}


@dataclass(frozen=True)
class Outcome:
    """Outcome of a calibration."""

    calibration: Calibration
    space: Space
    unit: FloatArray  # all sets of all waves, in the unit cube, shape (P, D)
    emulators: Emulators  # from all waves and observations, as the posterior
    posterior: Posterior
    held_out: dict[str, Posterior]  # from the observations that each trial of the file keeps
    predictive: Wave  # the engine at samples of the posterior; first the one of highest density
    checks: dict[str, Wave]  # at the best set that was run: as in the waves, with half the time step, for twice as long
    failures: dict[str, list[Failure]]  # points that failed, by sweep


def calibrate(
    calibration: Calibration, out: Path, options: Options, *, progress: bool | None = False, **how: Any
) -> Outcome:
    """Start or continue a calibration; finished runs are not repeated.

    Parameters
    ----------
    calibration, options, how
        From `walkers.calibration.file.load_calibration`; as for `walkers.sweeps.scheduler.run_sweep`.
    out
        Folder of the run directories; each wave is a sweep there, and its design is in a folder with the name of the
        calibration.
    progress
        See `walkers.progress.progress_of`.

    Raises
    ------
    InputError
        If a key of the file cannot be used, or existing designs belong to other parameters.
    CalibrationStopped
        If points of a wave are missing for reasons other than their parameters.
    runner.EngineFailure
        If there is no engine, or its audit failed.
    """
    require("calibrate")
    _check_ranges(calibration)
    space, design = Space(calibration.parameters), calibration.design
    folder, failures = out / calibration.name, {}
    folder.mkdir(parents=True, exist_ok=True)

    def run(name: str, unit: FloatArray, extra: Mapping[str, Mapping[str, Any]] | None = None) -> Wave:
        sweep = wave_sweep(calibration, space.values(unit), f"{calibration.name}-{name}", extra)
        with progress_of(sweep.name, progress) as advance:
            final = replace(options, final=FINAL)
            wave = run_wave(calibration, unit, sweep, out, final, on_progress=advance, **how)
        if wave.failures:
            failures[sweep.name] = wave.failures
        undone = [failure for failure in wave.failures if failure.reason not in FINAL]
        if undone or not wave.table["status"].isin(("finished", "failed")).all():
            message = undone[0].message if undone else "another process is running them"
            raise CalibrationStopped(f"{sweep.name}: points are missing ({message}); call again to continue")
        return wave

    unit, outcome = np.zeros((0, space.dimensions)), np.zeros((0, len(calibration.observations)))
    filling = 0
    for number, points in enumerate(design.waves, 1):
        make = partial(next_wave, calibration, unit, outcome, points, filling)
        sets = _kept(folder / f"wave-{number}.json", _determinants(calibration, number), make)
        wave = run(f"wave-{number}", sets)
        unit, outcome = np.concatenate([unit, sets]), np.concatenate([outcome, wave.outcome])
        filling = filling or len(sets)
    emulators = fit_emulators(unit, outcome, calibration.observations, design.seed, filling)
    posterior = _posterior(calibration, emulators)
    # The sample of the highest density, and evenly spaced samples.
    every = np.linspace(0, len(posterior.unit) - 1, design.predictive - 1).round().astype(int)
    drawn = np.concatenate([posterior.best[None], posterior.unit[every]])
    predictive = run("predictive", drawn)
    ranked = np.concatenate([unit, drawn])[ranking(calibration, np.concatenate([outcome, predictive.outcome]))]
    within = ((ranked > _END) & (ranked < 1.0 - _END)).all(axis=1)
    best = ranked[within][:1] if within.any() else ranked[:1]
    held_out = {name: _posterior(calibration, emulators, groups) for name, groups in calibration.file.held_out.items()}
    extras = _finer_and_longer(calibration, space.values(best))
    checks = {name: run(name, best, extra) for name, extra in extras.items()}
    return Outcome(calibration, space, unit, emulators, posterior, held_out, predictive, checks, failures)


def _posterior(calibration: Calibration, emulators: Emulators, held_out: Collection[str] = ()) -> Posterior:
    density = Density(emulators, Space(calibration.parameters), held_out, calibration.file.shared_errors)
    return sample_posterior(density, calibration.design.points, calibration.design.seed)


def _check_ranges(calibration: Calibration) -> None:
    """Resolve the cases at the ends of all ranges and at the guesses: refuse ranges that exceed those of a case."""
    ends = Space(calibration.parameters).values(np.array([[0.0], [1.0]]) * np.ones(len(calibration.parameters)))
    sweep = wave_sweep(calibration, np.concatenate([ends, _guesses(calibration)]), calibration.name)
    try:
        list(sweep.cases())
    except InputError as error:
        problem = error.problems[0]
        for one in calibration.parameters:
            if problem.key in one.keys:
                message = f"{problem.key} = {problem.value}: {problem.expected}"
                key, value = f"parameters.{one.name}.range", f"[{one.range[0]:g}, {one.range[1]:g}]"
                raise InputError(calibration.source, [Problem(key, value, message)]) from error
        raise


def _guesses(calibration: Calibration) -> FloatArray:
    return np.reshape(np.array(calibration.guesses, np.float64), (-1, len(calibration.parameters)))


def _determinants(calibration: Calibration, wave: int) -> dict[str, Any]:
    """Inputs that determine the parameter sets of a wave (from 1), together with earlier results of the engine."""
    parameters = {one.name: [*one.range, one.log, one.unit] for one in calibration.parameters}
    seed, guesses = calibration.design.seed, [list(guess) for guess in calibration.guesses]
    return {"parameters": parameters, "seed": seed, "guesses": guesses, "waves": calibration.design.waves[:wave]}


def _kept(path: Path, determinants: dict[str, Any], make: Callable[[], FloatArray]) -> FloatArray:
    """The parameter sets of a wave, read from its file, or drawn and written."""
    if path.exists():  # other versions of the libraries may draw other points
        try:
            kept = read_json(path)
            unit = np.array(kept["unit"], dtype=np.float64)
            if unit.ndim != 2 or unit.shape[1] != len(kept["parameters"]) or not ((unit >= 0.0) & (unit <= 1.0)).all():
                raise ValueError("points outside of the unit cube")
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise refused(path, f"cannot be read ({error}); delete it") from error
        for key, now in determinants.items():
            if key not in kept:
                raise InputError(str(path), [Problem(key, None, "missing (earlier version): delete the file")])
            if kept[key] != now:
                message = (
                    f"was drawn with other {key} than in the calibration file; delete this and later waves "
                    "to draw them again (matching runs are kept), undo the change, or choose another folder of runs"
                )
                raise InputError(str(path), [Problem(key, None, message)])
        return unit
    unit = make()
    write_json(path, {**determinants, "unit": unit.tolist()})
    return unit


def next_wave(calibration: Calibration, unit: FloatArray, outcome: FloatArray, points: int, filling: int) -> FloatArray:
    """Parameter sets (P, D) of a wave: guesses and a space-filling design, or samples near posterior and best sets.

    Parameters
    ----------
    calibration, points
        The calibration; P (the first wave has the guesses in addition).
    unit, outcome : ndarray, shape (N, D) and (N, K)
        Sets that were run, in the unit cube, and the engine's observations; none for the first wave.
    filling
        Number of sets of the first wave.
    """
    space, seed = Space(calibration.parameters), calibration.design.seed
    if not len(unit):
        guesses = np.clip(space.unit(_guesses(calibration)), 0.0, 1.0)
        return np.concatenate([guesses, space.design(points, seed)])
    emulators = fit_emulators(unit, outcome, calibration.observations, seed, filling)
    posterior = _posterior(calibration, emulators)
    samples, places = np.unique(posterior.unit, axis=0, return_index=True)
    likely = samples[np.argsort(posterior.log_density[places])[::-1]][: len(samples) // 2]
    draw = np.random.default_rng([seed, len(unit)])
    # A quarter where the posterior is high, far from each other; half around and between the best sets that were run,
    # where the engine is known to agree; the others from the whole posterior, to find other regions.
    few = points // 4
    among = spread_out(likely[: 20 * points], few, unit)
    parents = unit[ranking(calibration, outcome)[:_PARENTS]]
    shares = draw.dirichlet(np.full(len(parents), 0.5), _TRIED)
    tried = np.clip(shares @ parents + draw.normal(0.0, _NEAR, (_TRIED, space.dimensions)), 0.0, 1.0)
    wanted = points - 2 * few
    near = spread_out(tried[np.argsort(_expected_misfit(emulators, tried))[: 4 * wanted]], wanted, unit)
    beyond = draw.choice(samples, few, replace=len(samples) < few)
    return np.concatenate([among, near, beyond])


def _expected_misfit(emulators: Emulators, unit: FloatArray) -> FloatArray:
    """Misfit of `ranking` that the emulators expect at points (N, D), shape (N,)."""
    own = [place for place, one in enumerate(emulators.each) if not one.observation.derived]
    mean, deviation = emulators.predict(unit, own)
    transformed = np.clip(mean[..., None] + deviation[..., None] * _QUANTILES, -LARGEST, LARGEST)
    misfit = np.log1p(np.sinh(transformed) ** 2).mean(axis=2)
    made = emulators.feasible(unit)[:, own]
    return np.asarray((made * misfit + (1.0 - made) * MISSING_MISFIT).sum(axis=1))


def ranking(calibration: Calibration, outcome: FloatArray) -> npt.NDArray[np.int64]:
    """Order of sets by their outcome (P, K): those with most observations within their deviations come first.

    Derived observations do not count. Sets with equal numbers are ordered by the misfit Σ ln(1 + r²), r in standard
    deviations; the logarithm limits the weight of an observation that no set gives. The misfit of a missing observation
    is `MISSING_MISFIT`. Only results of the engine count: emulators err most at their optimum.
    """
    own = [place for place, one in enumerate(calibration.observations) if not one.derived]
    value, deviation = np.array([(one.value, one.deviation) for one in calibration.observations])[own].T
    residual = (outcome[:, own] - value) / deviation
    given = (np.abs(residual) <= 1.0).sum(axis=1)
    misfit = np.where(np.isnan(residual), MISSING_MISFIT, np.log1p(residual**2)).sum(axis=1)
    return np.lexsort((misfit, -given))


def _finer_and_longer(calibration: Calibration, values: FloatArray) -> dict[str, dict[str, dict[str, Any]]]:
    """Changes of a parameter set: none; half the time step; twice the cycles."""
    cases = wave_sweep(calibration, values, "check").cases()
    runs = {label: case.run for label, case in zip(calibration.experiments, cases, strict=True)}
    finer = {label: {"run.time_step": f"{run.time_step / 2.0 * 1e6:.6g} us"} for label, run in runs.items()}
    longer = {label: {"run.cycles": 2 * run.cycles} for label, run in runs.items()}
    return {"best": {}, "half-step": finer, "twice-as-long": longer}
