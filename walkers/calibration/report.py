"""What a calibration found, as tables: observations beside predictions, parameters with their uncertainty."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.calibration.calibrate import Outcome
from walkers.calibration.emulator import Emulator, transformed
from walkers.calibration.posterior import LEAST_SAMPLES, Posterior
from walkers.calibration.waves import Wave
from walkers.inputs.calibration import QUANTITIES, Observation, Parameter
from walkers.inputs.text import rendered
from walkers.inputs.units import SPEED
from walkers.runner.files import write_bytes, write_json, write_text

FloatArray = npt.NDArray[np.float64]
RECORD_NAME = "calibration.json"
_SIGMAS = 2.0
_NARROW, _NARROWER = 1.0 / 3.0, 2.0 / 3.0
"""A parameter is identified if the posterior's interval is less than a third of the prior's and it has converged."""


@dataclass(frozen=True)
class Row:
    """An observation and what is predicted of it; speeds in mm/s, angles in degrees.

    Attributes
    ----------
    name, group, title, unit, value, deviation
        As published.
    engine
        At the best set; None where there is no walker.
    low, high, samples
        Of the engine over samples of the posterior, of those that are walkers, and how many these are.
    emulator, error, feasible
        At the best set; ``feasible`` is the probability that there is a walker, as it is learned from the waves.
    agrees
        Whether the engine lies within the deviation of the published value.
    derived
        Whether it follows from others, and does not count.
    half_step, twice_as_long
        The engine at the best set with half the time step, and for twice as long; None where there is no walker.
    held_out
        For each trial that did not see the observation's group: predicted mean and standard deviation.
    """

    name: str
    group: str
    title: str
    unit: str
    value: float
    deviation: float
    engine: float | None
    low: float | None
    high: float | None
    samples: int
    emulator: float
    error: float
    feasible: float
    agrees: bool
    derived: bool
    half_step: float | None
    twice_as_long: float | None
    held_out: dict[str, tuple[float, float]]


def unit_of(observation: Observation) -> tuple[str, float]:
    """Unit in which an observation is shown, and how many of it the SI unit is."""
    if observation.over:
        return "", 1.0
    return ("mm/s", 1e3) if QUANTITIES[observation.quantity] is SPEED else ("°", 1.0)


def labelled(parameter: Parameter) -> str:
    """A parameter's symbol, with its unit if it has one."""
    return f"{parameter.symbol} ({parameter.unit})" if parameter.unit else parameter.symbol


def rows_of(found: Outcome) -> list[Row]:
    """A row an observation."""
    rows = []
    feasible = found.emulators.feasibility.probability(found.checks["best"].unit)[0]
    for place, observation in enumerate(found.calibration.observations):
        unit, scale = unit_of(observation)
        emulated, error = found.emulators.each[place].value(found.checks["best"].unit)
        seen = _seen(found.predictive, place, scale)
        best, finer, longer = (
            next(iter(_seen(found.checks[name], place, scale)), None) for name in ("best", "half-step", "twice-as-long")
        )
        rows.append(
            Row(
                name=observation.name,
                group=observation.group,
                title=observation.title,
                unit=unit,
                value=observation.value * scale,
                deviation=observation.deviation * scale,
                engine=best,
                low=min(seen, default=None),
                high=max(seen, default=None),
                samples=len(seen),
                emulator=float(emulated[0]) * scale,
                error=float(error[0]) * scale,
                feasible=float(feasible[place]),
                agrees=best is not None and abs(best - observation.value * scale) <= observation.deviation * scale,
                derived=observation.derived,
                half_step=finer,
                twice_as_long=longer,
                held_out={
                    name: _predicted(found.emulators.each[place], posterior, scale)
                    for name, posterior in found.held_out.items()
                    if observation.group in found.calibration.file.held_out[name]
                },
            )
        )
    return rows


def _seen(wave: Wave, place: int, scale: float) -> list[float]:
    """An observation of those of a wave's sets that have a walker."""
    values = wave.outcome[:, place]
    return [float(value) * scale for value in values[~np.isnan(values)]]


def _predicted(emulator: Emulator, posterior: Posterior, scale: float) -> tuple[float, float]:
    """Median over a posterior and half of the width that holds 68 %, the emulator's error in it."""
    normal = np.random.default_rng(0).standard_normal(len(posterior.unit))
    low, middle, high = np.percentile(emulator.draw(posterior.unit, normal), (16.0, 50.0, 84.0))
    return float(middle) * scale, float(high - low) / 2.0 * scale


def emulator_checks(found: Outcome) -> FloatArray:
    """Errors of the emulators at the runs of the predictive wave, in their stated standard errors, shape (S, K).

    NaN where there was nothing to observe.
    """
    mean, deviation = found.emulators.predict(found.predictive.unit)
    seen = [
        transformed(found.predictive.outcome[:, place], observation)
        for place, observation in enumerate(found.emulators.observations)
    ]
    return np.asarray((np.stack(seen, axis=1) - mean) / deviation)


def _inside(found: Outcome) -> tuple[int, float]:
    """How many of the engine's values were there to check, and the share of those within two standard errors."""
    checks = emulator_checks(found)
    known = np.abs(checks[np.isfinite(checks)])
    return len(known), float(np.mean(known <= _SIGMAS)) if len(known) else nan


def feasibility_check(found: Outcome) -> tuple[float, float]:
    """Share of the predictive wave's outcomes that exist, and the mean of the probabilities that they were given."""
    expected = found.emulators.feasibility.probability(found.predictive.unit)
    return float(np.mean(~np.isnan(found.predictive.outcome))), float(expected.mean())


def narrowing(found: Outcome) -> dict[str, float]:
    """Of each parameter the posterior's 5 to 95 % interval over that of the prior: 1 if nothing was learned.

    In logarithms where the parameter's range is one of these.
    """
    fine, shares = np.linspace(0.0, 1.0, 2001), {}
    for place, one in enumerate(found.space.parameters):
        points = np.full((len(fine), found.space.dimensions), 0.5)
        points[:, place] = fine
        density = found.space.log_prior(points)
        below = np.cumsum(np.exp(density - density.max()))
        prior = np.interp([0.05, 0.95], below / below[-1], fine)
        shares[one.name] = float(np.ptp(np.percentile(found.posterior.unit[:, place], (5.0, 95.0))) / np.ptp(prior))
    return shares


def words_of(share: float, *, converged: bool) -> str:
    """What may be said of a parameter whose interval is so much of the prior's."""
    if not converged:
        return "not said: the posterior has not converged"
    return "identified" if share < _NARROW else "narrowed" if share < _NARROWER else "not identified"


def intervals(found: Outcome) -> dict[str, tuple[float, float, float]]:
    """Of each parameter the 5th, 50th and 95th percentile of the posterior."""
    values = found.space.values(found.posterior.unit)
    percentiles = np.percentile(values, (5.0, 50.0, 95.0), axis=0)
    return {
        one.name: (float(low), float(middle), float(high))
        for one, low, middle, high in zip(found.space.parameters, *percentiles, strict=True)
    }


def write_tables(found: Outcome, rows: list[Row], to: Path) -> list[Path]:
    """Write ``posterior.parquet``, ``calibration.json`` and ``calibration.md``; rows from `rows_of`.

    The samples' columns are the parameters (in their units), ``discrepancy_GROUP`` (in standard deviations) and
    ``log_density``.
    """
    import pandas as pd

    to.mkdir(parents=True, exist_ok=True)
    posterior = found.posterior
    samples = pd.DataFrame(found.space.values(posterior.unit), columns=[one.name for one in found.space.parameters])
    for place, group in enumerate(posterior.groups):
        samples[f"discrepancy_{group}"] = posterior.discrepancy[:, place]
    samples["log_density"] = posterior.log_density
    write_bytes(to / "posterior.parquet", samples.to_parquet(index=False))
    write_json(to / RECORD_NAME, as_dict(found, rows))
    write_text(to / "calibration.md", as_markdown(found, rows))
    return [to / name for name in ("posterior.parquet", RECORD_NAME, "calibration.md")]


def as_dict(found: Outcome, rows: list[Row]) -> dict[str, Any]:
    """What ``calibration.json`` holds."""
    posterior, parameters = found.posterior, [one.name for one in found.space.parameters]
    (checked, inside), (made, expected), narrowed = _inside(found), feasibility_check(found), narrowing(found)
    middle = np.median(posterior.discrepancy, axis=0).tolist()
    return {
        "calibration": found.calibration.name,
        "title": found.calibration.file.title,
        "settings": found.calibration.file.model_dump(mode="json"),
        "parameters": {one.name: labelled(one) for one in found.space.parameters},
        "sets": len(found.unit),
        "best": found.best,
        "intervals": intervals(found),
        "discrepancies": dict(zip(posterior.groups, middle, strict=True)),
        "narrowing": narrowed,
        "words": {name: words_of(share, converged=posterior.converged) for name, share in narrowed.items()},
        "posterior": _weights(posterior),
        "held_out_posteriors": {name: _weights(one) for name, one in found.held_out.items()},
        "emulators": {
            one.observation.name: {
                "explained": _finite(one.explained),
                "error": _finite(one.error),
                "error_inflation": one.error_inflation,
                "sets": one.sets,
            }
            for one in found.emulators.each
        },
        "emulators_checked": checked,
        "emulators_within_two_errors": _finite(inside),
        "feasible": {"seen": made, "expected": expected},
        "agree": agreeing(rows)[0],
        "of": agreeing(rows)[1],
        "observations": [asdict(row) for row in rows],
        "sobol_total": {
            one.observation.name: dict(zip(parameters, map(_finite, total), strict=True))
            for one, total in zip(found.emulators.each, found.sobol, strict=True)
        },
    }


def agreeing(rows: list[Row]) -> tuple[int, int]:
    """How many observations agree, of how many; those that are derived from others count in neither."""
    own = [row for row in rows if not row.derived]
    return sum(row.agrees for row in own), len(own)


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _weights(posterior: Posterior) -> dict[str, Any]:
    return {name: getattr(posterior, name) for name in ("converged", "points", "effective_samples")}


def as_markdown(found: Outcome, rows: list[Row]) -> str:
    """The tables as a page."""
    return rendered(
        "walkers.calibration",
        "report.md.j2",
        found=as_dict(found, rows),
        ranges={one.name: one.range for one in found.space.parameters},
        trials=list(found.held_out),
        samples=len(found.predictive.unit),
        discrepancies=np.percentile(found.posterior.discrepancy, (5.0, 50.0, 95.0), axis=0).T.tolist(),
        least=LEAST_SAMPLES,
        narrow=_NARROW,
    )
