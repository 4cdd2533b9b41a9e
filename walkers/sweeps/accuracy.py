"""Numerical error of walkers: the same case at half the time step, and with harder beads until nothing changes.

Beads in a simulation are softer than their material, so that the time step can be longer. The Young's modulus is
multiplied by `STIFFER` and the time step halved, as its limits allow it, again and again until the headline velocities
change by less than a share. No power law of the modulus fits all cases, and some velocities turn round on the way:
nothing is extrapolated. The changes shrink by at least half from one modulus to the next, so what remains is about the
last one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import count, takewhile
from math import hypot, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, Problem, WalkersError, refused
from walkers.inputs.case import STIFFEST, Case
from walkers.inputs.sweep import Sweep, settings_in
from walkers.postprocess.sides import STEADY_SPEED
from walkers.postprocess.uncertainty import ACCURACY, ACCURACY_NAME
from walkers.runner.binary import find_engine
from walkers.runner.directory import case_of, run_place
from walkers.runner.files import write_json
from walkers.runner.manifest import recomputed
from walkers.sweeps.scheduler import Options, run_sweep
from walkers.sweeps.table import load, main_columns

if TYPE_CHECKING:
    import pandas as pd

SHARE = 0.01
"""Share of a velocity that the last increase of the modulus may change."""
STIFFER = 4.0
_MOST_TIMES = 256.0
"""Largest Young's modulus over that of the case. A run with it takes 16 times as long."""
_KEYS = ("run.time_step", "contact.youngs_modulus")
_FAMILIES = ("velocity", "right_facing", "left_facing", "axial_", "lateral_", "rotation_", "sliding_")
"""Beginnings of the names of numbers that have a numerical error, all in m/s."""


class FailedVariant(WalkersError):
    """A run that an accuracy needs failed."""


@dataclass(frozen=True)
class Accuracy:
    """Numerical errors of a run, as in its ``accuracy.json``.

    Attributes
    ----------
    sweep
        Name of the sweep of the runs, beside the run.
    share, reached, change
        Share asked for, whether the last increase of the modulus changed less, and what it changed.
    times
        The largest Young's modulus over that of the case.
    errors
        By names of numbers, m/s: the change at ``half_step``, with the ``stiffer`` beads, and the root of the sum of
        their squares, ``total``.
    """

    sweep: str
    share: float
    reached: bool
    change: float
    times: float
    errors: Mapping[str, Mapping[str, float]]


def measure_accuracy(
    directory: Path, options: Options, *, share: float = SHARE, engine: str | None = None, **how: Any
) -> Accuracy:
    """Make the runs beside a finished run that measure its numerical errors, and record the errors in the run.

    Finished runs are used again. Other arguments: see `walkers.sweeps.scheduler.run_sweep`. `InputError` if the run is
    none of walkers, or is not of the installed engine; `FailedVariant` if a run fails.
    """
    case = case_of(directory)
    times = times_of(case)
    if run_place(case, find_engine(engine), directory.parent) != directory:
        raise refused(directory.name, "expected a run of the installed engine and program; run its case again")
    for last in range(2, len(times)):
        sweep = _sweep(case, f"{directory.name}{ACCURACY}", times[: last + 1])
        record, failures = run_sweep(sweep, directory.parent, options, engine=engine, **how)
        if failures:
            raise FailedVariant(f"{failures[0].run}: {failures[0].message}")
        table = load(record.directory)
        if (change := _change(table, case)) < share:
            break
    found = Accuracy(record.name, share, change < share, change, times[last], _errors(table))
    with recomputed(directory, [ACCURACY_NAME]):
        write_json(directory / ACCURACY_NAME, asdict(found))
    return found


def times_of(case: Case) -> list[float]:
    """Young's moduli over that of the case, from 1; `InputError` if it has no numerical error to be measured."""
    if not case.walkers:
        text = "no numerical error: loose beads are chaotic, and climb otherwise at any other time step"
        raise refused(case.name, f"{text}; walkers climb gives the scatter over starts (run.seed)")
    most = min(_MOST_TIMES, STIFFEST / case.contact.youngs_modulus * (1.0 + 1e-9))
    times = list(takewhile(lambda times: times <= most, (STIFFER**power for power in count())))
    if len(times) < 3:
        text = f"expected at most {1e-6 * STIFFEST / STIFFER**2:g} MPa, so that beads can be harder"
        raise InputError(case.name, [Problem("contact.youngs_modulus", None, text)])
    return times


def _sweep(case: Case, name: str, times: list[float]) -> Sweep:
    """The case itself, at half its time step, and with harder beads at steps as much smaller as the Rayleigh limit."""
    factors = [(1.0, times[0]), (0.5, times[0]), *((1.0 / one**0.5, one) for one in times[1:])]
    step, modulus = 1e6 * case.run.time_step, 1e-6 * case.contact.youngs_modulus
    rows = [(f"{shorter * step!r} us", f"{harder * modulus!r} MPa") for shorter, harder in factors]
    title = f"{case.title or case.name}: smaller time steps and harder beads"
    points = {key: list(values) for key, values in zip(_KEYS, zip(*rows, strict=True), strict=True)}
    file = {"case": case.name, "title": title, "set": settings_in(case.document), "zip": [points]}
    return Sweep(name, title, case.name, case.name, case.document, _KEYS, ("us", "MPa"), rows, None, file)


def _change(table: pd.DataFrame, case: Case) -> float:
    """The largest share of a headline velocity that the last increase of the modulus changes."""
    names = {main_columns(table)[0], *(("right_facing", "left_facing") if case.goes_uphill else ())}
    pairs = table[[*names & set(table)]].dropna(axis="columns", how="any").iloc[-2:].to_numpy(float)
    return float(max(abs(pairs[1] - pairs[0]) / abs(pairs[1]).clip(STEADY_SPEED)))


def _errors(table: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Numerical errors of the first point: the second has half its step, the last one has the hardest beads."""
    errors = {}
    for name in table.columns:
        if name.startswith(_FAMILIES) and all(map(isfinite, values := table[name].astype(float).tolist())):
            half, stiffer = values[1] - values[0], values[-1] - values[0]
            errors[name] = {"half_step": half, "stiffer": stiffer, "total": hypot(half, stiffer)}
    return errors
