"""A calibration from its file to its outcome: waves, emulators, posterior, and the engine's word on what it says."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

from walkers.calibration.emulator import LARGEST, Emulators, fit_emulators
from walkers.calibration.posterior import Posterior, sample_posterior
from walkers.calibration.sensitivity import sobol_indices
from walkers.calibration.space import Space, spread_out
from walkers.calibration.waves import Wave, run_wave, wave_sweep
from walkers.inputs.calibration import Calibration
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.paper.sources import ProgressOf
from walkers.runner.failures import BeadsLost, BlowUp
from walkers.runner.files import read_json, write_json
from walkers.sweeps.scheduler import Failure, Options

FloatArray = npt.NDArray[np.float64]
_PARENTS, _NEAR, _TRIED = 5, 0.06, 4000
"""How many of the best sets a wave looks around, how far (of the ranges), and how many sets it thinks of."""
MISSING_MISFIT = float(np.log1p(30.0**2))
"""ln(1 + r²) of an observation that cannot be made: as of one that is 30 deviations off."""
_END = 0.005
"""Of a range: a set that is so near an end of it is not taken for the best, for what is better may lie beyond."""
_QUANTILES = norm.ppf((np.arange(5) + 0.5) / 5.0)
FINAL = frozenset(failure.__name__ for failure in (BeadsLost, BlowUp))
"""Failures of a set's own making: calling again would bring the same."""


class CalibrationStopped(WalkersError):
    """Points of a wave are missing, for no fault of their parameters: what follows would be built on sand."""


@dataclass(frozen=True)
class Outcome:
    """What came out of a calibration.

    Attributes
    ----------
    calibration, space
        What was calibrated.
    unit : ndarray, shape (P, D)
        All sets of all waves, in the unit cube.
    outcome : ndarray, shape (P, K)
        What the engine made of them; NaN where there was nothing to observe.
    emulators, posterior
        Of all waves and of all observations.
    held_out
        Posteriors of the observations that each trial of the file leaves.
    predictive
        The engine at samples of the posterior, that of the highest density first.
    checks
        The engine at the best set that was run: as in the waves (``best``), with half the time step (``half-step``),
        and for twice as long (``twice-as-long``).
    sobol : ndarray, shape (K, D)
        `walkers.calibration.sensitivity.sobol_indices`.
    failures
        Points that failed, by sweep.
    """

    calibration: Calibration
    space: Space
    unit: FloatArray
    outcome: FloatArray
    emulators: Emulators
    posterior: Posterior
    held_out: dict[str, Posterior]
    predictive: Wave
    checks: dict[str, Wave]
    sobol: FloatArray
    failures: dict[str, list[Failure]]

    @property
    def best(self) -> dict[str, float]:
        """The set with which the engine gives most observations: parameter to value, in the parameter's unit."""
        values = self.space.values(self.checks["best"].unit[0])
        return dict(zip([one.name for one in self.space.parameters], map(float, values), strict=True))

    def _repr_html_(self) -> str:
        """The tables in a notebook: parameters, observations beside predictions, posteriors."""
        from walkers.calibration.page import outcome_html

        return outcome_html(self)


def calibrate(
    calibration: Calibration,
    out: Path,
    options: Options,
    *,
    engine: str | None = None,
    allow_failed_audit: bool = False,
    progress_of: ProgressOf | None = None,
) -> Outcome:
    """Calibrate, or go on with it: what is finished is not run again.

    Parameters
    ----------
    calibration
        From `walkers.inputs.calibration.load_calibration`.
    out
        Folder of the run directories; each wave is a sweep there, and the designs are kept in a folder of the
        calibration's name.
    options, engine, allow_failed_audit
        As for `walkers.sweeps.run.run_sweep`.
    progress_of
        As `walkers.paper.sources.ProgressOf`.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        If a key of the file cannot be used, or designs that are there belong to other parameters.
    CalibrationStopped
        If points of a wave are missing, for no fault of their parameters.
    runner.EngineFailure
        If there is no engine, or its audit failed.
    """
    check_ranges(calibration)
    space, design = Space(calibration.parameters), calibration.design
    folder, failures = out / calibration.name, {}
    folder.mkdir(parents=True, exist_ok=True)

    def run(name: str, unit: FloatArray, extra: Mapping[str, Mapping[str, Any]] | None = None) -> Wave:
        sweep = f"{calibration.name}-{name}"
        with progress_of(sweep) if progress_of else nullcontext() as advance:
            wave, failed = run_wave(
                calibration,
                unit,
                sweep,
                out,
                replace(options, final=FINAL),
                extra=extra,
                engine=engine,
                allow_failed_audit=allow_failed_audit,
                on_progress=advance,
            )
        if failed:
            failures[sweep] = failed
        undone = [failure for failure in failed if failure.reason not in FINAL]
        if undone or not wave.table["status"].isin(("finished", "failed")).all():
            told = undone[0].message if undone else "another process is running them"
            raise CalibrationStopped(f"{sweep}: points are missing ({told}); call again to go on")
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
    sample = partial(_posterior, calibration, emulators)
    posterior = sample()
    seen = sha256(posterior.unit.tobytes() + posterior.log_density.tobytes())
    draw, follows = partial(_drawn, posterior, design.predictive), f"{seen.hexdigest()} {design.predictive}"
    drawn = _kept(folder / "predictive.json", _determinants(calibration, 0), draw, follows)
    predictive = run("predictive", drawn)
    ranked = np.concatenate([unit, drawn])[ranking(calibration, np.concatenate([outcome, predictive.outcome]))]
    within = ((ranked > _END) & (ranked < 1.0 - _END)).all(axis=1)
    best = ranked[within][:1] if within.any() else ranked[:1]
    extras = _finer_and_longer(calibration, space.values(best))
    return Outcome(
        calibration,
        space,
        unit,
        outcome,
        emulators,
        posterior,
        held_out={name: sample(groups) for name, groups in calibration.file.held_out.items()},
        predictive=predictive,
        checks={name: run(name, best, extra) for name, extra in extras.items()},
        sobol=sobol_indices(emulators, space, design.seed),
        failures=failures,
    )


def _posterior(calibration: Calibration, emulators: Emulators, held_out: Collection[str] = ()) -> Posterior:
    space, design = Space(calibration.parameters), calibration.design
    shared = calibration.file.shared_errors
    return sample_posterior(emulators, space, design.points, design.seed, held_out, shared_errors=shared)


def check_ranges(calibration: Calibration) -> None:
    """Refuse parameters whose ranges go beyond what a case takes, before anything is written or run.

    Raises
    ------
    InputError
        If the experiments cannot be had at either end of all ranges, or at a guess.
    """
    ends = Space(calibration.parameters).values(np.array([[0.0], [1.0]]) * np.ones(len(calibration.parameters)))
    guesses = np.reshape(np.array(calibration.guesses, np.float64), (-1, len(calibration.parameters)))
    sweep = wave_sweep(calibration, np.concatenate([ends, guesses]), calibration.name)
    try:
        for _ in sweep.cases():
            pass
    except InputError as error:
        problem = error.problems[0]
        for one in calibration.parameters:
            if problem.key in one.keys:
                told = f"{problem.key} = {problem.value}: {problem.expected}"
                key, value = f"parameters.{one.name}.range", f"[{one.range[0]:g}, {one.range[1]:g}]"
                raise InputError(calibration.source, [Problem(key, value, told)]) from error
        raise


def _determinants(calibration: Calibration, wave: int) -> dict[str, Any]:
    """What the parameter sets of a wave (from 1; of none: 0) were drawn from, beside what the engine said before."""
    parameters = {one.name: [*one.range, one.log, one.unit] for one in calibration.parameters}
    if not wave:
        return {"parameters": parameters}
    seed, guesses = calibration.design.seed, [list(guess) for guess in calibration.guesses]
    return {"parameters": parameters, "seed": seed, "guesses": guesses, "waves": calibration.design.waves[:wave]}


def _kept(path: Path, determinants: dict[str, Any], make: Callable[[], FloatArray], follows: str = "") -> FloatArray:
    """The parameter sets of a wave, as written down before, or made and written down.

    A calibration that goes on must not depend on whether the libraries would draw the same points again. What
    ``follows`` from something else is made anew where that has changed.
    """
    if path.exists():
        try:
            kept = read_json(path)
            unit = np.array(kept["unit"], dtype=np.float64)
            if unit.ndim != 2 or unit.shape[1] != len(kept["parameters"]) or not ((unit >= 0.0) & (unit <= 1.0)).all():
                raise ValueError("no points of the unit cube")
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(path), [Problem("", None, f"cannot be read ({error}); delete it")]) from error
        for key, now in determinants.items():
            if key not in kept:
                raise InputError(str(path), [Problem(key, None, "missing: of an earlier version; delete the file")])
            if kept[key] != now:
                told = (
                    f"was drawn with other {key} than the file has now; delete it and the waves after it to have them "
                    "drawn again (runs that fit are kept), take the change back, or give another --out"
                )
                raise InputError(str(path), [Problem(key, None, told)])
        if kept.get("follows", "") == follows:
            return unit
    unit = make()
    write_json(path, {**determinants, "follows": follows, "unit": unit.tolist()})
    return unit


def first_wave(calibration: Calibration, space: Space) -> FloatArray:
    """The guesses, and sets that fill the ranges, shape (G + P, D)."""
    guesses = space.unit(np.reshape(np.array(calibration.guesses, np.float64), (-1, space.dimensions)))
    filling = space.design(calibration.design.waves[0], calibration.design.seed)
    return np.concatenate([np.clip(guesses, 0.0, 1.0), filling])


def next_wave(calibration: Calibration, unit: FloatArray, outcome: FloatArray, points: int, filling: int) -> FloatArray:
    """The first wave, or one where the posterior is and around the best sets that were run, shape (P, D).

    Parameters
    ----------
    calibration
        What is calibrated.
    unit : ndarray, shape (N, D)
        The sets that were run, in the unit cube; none for the first wave.
    outcome : ndarray, shape (N, K)
        What the engine made of them.
    points
        P.
    filling
        How many of the sets were the first wave.
    """
    space, seed = Space(calibration.parameters), calibration.design.seed
    if not len(unit):
        return first_wave(calibration, space)
    emulators = fit_emulators(unit, outcome, calibration.observations, seed, filling)
    posterior = _posterior(calibration, emulators)
    samples, places = np.unique(posterior.unit, axis=0, return_index=True)
    likely = samples[np.argsort(posterior.log_density[places])[::-1]][: len(samples) // 2]
    draw = np.random.default_rng([seed, len(unit)])
    # A quarter where the posterior is high, far from each other; half around the best sets that were run, for there the
    # engine is known to be good; the others wherever the posterior is, to find what is missing.
    few = points // 4
    among = spread_out(likely[: 20 * points], few, unit)
    parents = unit[ranking(calibration, outcome)[:_PARENTS]]
    near = _promising(emulators, parents, points - 2 * few, unit, draw)
    beyond = draw.choice(samples, few, replace=len(samples) < few)
    return np.concatenate([among, near, beyond])


def _promising(
    emulators: Emulators, parents: FloatArray, points: int, taken: FloatArray, draw: np.random.Generator
) -> FloatArray:
    """Of many sets around and between some those of which least misfit is expected, not too near each other.

    The misfit of an observation that may not be made is `MISSING_MISFIT`, as in `ranking`.
    """
    shares = draw.dirichlet(np.full(len(parents), 0.5), _TRIED)
    tried = np.clip(shares @ parents + draw.normal(0.0, _NEAR, (_TRIED, parents.shape[1])), 0.0, 1.0)
    own = [place for place, one in enumerate(emulators.observations) if not one.derived]
    expected = _expected_misfit(emulators.of(own), tried)
    return spread_out(tried[np.argsort(expected)[: 4 * points]], points, taken)


def _expected_misfit(emulators: Emulators, unit: FloatArray) -> FloatArray:
    """Σ ln(1 + r²) as the emulators expect it at points (N, D), shape (N,)."""
    mean, deviation = emulators.predict(unit)
    transformed = np.clip(mean[..., None] + deviation[..., None] * _QUANTILES, -LARGEST, LARGEST)
    misfit = np.log1p(np.sinh(transformed) ** 2).mean(axis=2)
    made = emulators.feasibility.probability(unit)
    return np.asarray((made * misfit + (1.0 - made) * MISSING_MISFIT).sum(axis=1))


def _drawn(posterior: Posterior, points: int) -> FloatArray:
    """The sample of the highest density, and so many others, evenly through the samples."""
    every = np.linspace(0, len(posterior.unit) - 1, points - 1).round().astype(int)
    return np.concatenate([posterior.best[None], posterior.unit[every]])


def ranking(calibration: Calibration, outcome: FloatArray) -> npt.NDArray[np.int64]:
    """Places of sets that were run: those first that give most observations within their deviations, shape (P,).

    Those that are derived from others do not count. Of several sets that with the least misfit Σ ln(1 + r²), r in
    standard deviations; the logarithm keeps an observation that none of them gives from deciding. One that could not be
    made is not given, and its misfit is `MISSING_MISFIT`. It is the engine's own word: emulators err most where they
    hope most.

    Parameters
    ----------
    calibration
        Whose observations.
    outcome : ndarray, shape (P, K)
        What the engine made of each set; NaN where there was nothing to observe.
    """
    value = np.array([one.value for one in calibration.observations])
    deviation = np.array([one.deviation for one in calibration.observations])
    own = np.array([not one.derived for one in calibration.observations])
    residual = ((outcome - value) / deviation)[:, own]
    given = (np.abs(residual) <= 1.0).sum(axis=1)
    misfit = np.where(np.isnan(residual), MISSING_MISFIT, np.log1p(residual**2)).sum(axis=1)
    return np.lexsort((misfit, -given))


def _finer_and_longer(calibration: Calibration, values: FloatArray) -> dict[str, dict[str, dict[str, Any]]]:
    """What the runs of a set have beside it: nothing; half of their time steps; twice their cycles."""
    cases = list(wave_sweep(calibration, values, "check").cases())
    finer, longer = {}, {}
    for label, case in zip(calibration.experiments, cases, strict=True):
        finer[label] = {"run.time_step": f"{case.run.time_step / 2.0 * 1e6:.6g} us"}
        longer[label] = {"run.cycles": 2 * case.run.cycles}
    return {"best": {}, "half-step": finer, "twice-as-long": longer}
