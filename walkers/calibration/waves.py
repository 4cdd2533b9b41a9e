"""Waves: parameter sets run through all experiments, each wave a sweep like any other; what they give."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.calibration.space import Space
from walkers.inputs.calibration import Calibration
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.schema import ALTERNATIVES
from walkers.inputs.sweep import Sweep, expand
from walkers.paper.sensitivity import misalignment
from walkers.postprocess.steady_state import steady_walkers, together
from walkers.postprocess.tables import read_table
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Failure, Options, SweepProgress
from walkers.sweeps.table import load

if TYPE_CHECKING:
    import pandas as pd

FloatArray = npt.NDArray[np.float64]
_DIGITS = 9
_LEAST_SPEED = 5e-5


@dataclass(frozen=True)
class Wave:
    """P parameter sets and what the engine made of them.

    Attributes
    ----------
    unit : ndarray, shape (P, D)
        The sets, in the unit cube.
    outcome : ndarray, shape (P, K)
        Each observation, SI units and degrees; NaN where there is none.
    table
        The sweep's, P times the number of experiments long.
    """

    unit: FloatArray
    outcome: FloatArray
    table: pd.DataFrame


def wave_sweep(
    calibration: Calibration, values: FloatArray, name: str, extra: Mapping[str, Mapping[str, Any]] | None = None
) -> Sweep:
    """The sweep of a wave: every parameter set with every experiment, set by set.

    Parameters
    ----------
    calibration
        What is calibrated.
    values : ndarray, shape (P, D)
        Values of the parameters.
    name
        Of the sweep.
    extra
        Keys by experiment that these runs alone have.

    Raises
    ------
    InputError
        If a key of the calibration is none of a case.
    """
    columns: dict[str, list[Any]] = {}
    for row in np.atleast_2d(values):
        for label, keys in calibration.experiments.items():
            more = (extra or {}).get(label, {})
            replaced = {other for key in more for other in ALTERNATIVES.get(key, ())}
            point = {**{key: value for key, value in keys.items() if key not in replaced}, **more}
            for parameter, value in zip(calibration.parameters, row, strict=True):
                if label in parameter.experiments:
                    digits = f"{value:.{_DIGITS}g}"
                    point |= dict.fromkeys(
                        parameter.keys, f"{digits} {parameter.unit}" if parameter.unit else float(digits)
                    )
            for key, value in point.items():
                columns.setdefault(key, []).append(value)
    settings = flatten(calibration.file.set, lambda _: False)
    document = {
        "title": calibration.file.title,
        "case": calibration.file.case,
        # What the runs have beside it, such as twice the cycles, stands in for what is set.
        "set": {key: value for key, value in settings.items() if key not in columns},
        "zip": [columns],
    }
    sweep = expand(document, source=calibration.source, name=name, folder=calibration.folder)
    if "dimers" not in sweep.document:
        raise InputError(
            calibration.source, [Problem("case", f'"{calibration.file.case}"', "expected a case of dimers")]
        )
    return sweep


def observed(calibration: Calibration, table: pd.DataFrame) -> FloatArray:
    """What a wave's table says of each observation, shape (P, K).

    Speeds are means over the walkers that are some until the end (`walkers.postprocess.steady_state.steady_walkers`).
    Where there is none, or the run failed, nothing was observed: NaN.

    Parameters
    ----------
    calibration
        What is calibrated.
    table
        Of a wave's sweep (`walkers.sweeps.table.load`).
    """
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
    """Quantities of each run of a wave, NaN where there is none, each of shape (P, number of experiments)."""
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


def run_wave(  # noqa: PLR0913
    calibration: Calibration,
    unit: FloatArray,
    name: str,
    out: Path,
    options: Options,
    *,
    extra: Mapping[str, Mapping[str, Any]] | None = None,
    engine: str | None = None,
    allow_failed_audit: bool = False,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> tuple[Wave, list[Failure]]:
    """Run what is missing of a wave.

    Parameters
    ----------
    calibration, extra
        As for `wave_sweep`.
    unit : ndarray, shape (P, D)
        The parameter sets, in the unit cube.
    name
        Of the sweep.
    out, options, engine, allow_failed_audit, on_progress
        As for `walkers.sweeps.run.run_sweep`.
    """
    space = Space(calibration.parameters)
    sweep = wave_sweep(calibration, space.values(unit), name, extra)
    record, failures = run_sweep(
        sweep, out, options, engine=engine, allow_failed_audit=allow_failed_audit, on_progress=on_progress
    )
    table = load(record.directory)
    return Wave(unit, observed(calibration, table), table), failures
