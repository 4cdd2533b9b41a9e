"""Numerical errors of walkers: the same case at half the time step, and with harder beads until nothing changes.

Beads are softer than their material, so that the time step can be longer. Young's modulus is multiplied by 4 and the
time step halved, as the Rayleigh limit allows it, until the headline velocities change by less than a share; the last
increase is to the largest modulus of a case, that of hard materials. Velocities follow no common power of the modulus
(docs/explanation/physics.md), so nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import input_error
from walkers.files import write_json
from walkers.inputs.case_building import build_case
from walkers.inputs.sweep import SweepDefinition, expand
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.materials import STIFFEST
from walkers.postprocess.measure.results import recorded
from walkers.postprocess.measure.sides import STEADY_SPEED
from walkers.postprocess.measure.uncertainty import ACCURACY, ACCURACY_NAME
from walkers.progress import Tell
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import case_of, recomputed, run_place
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.table import SIDES, main_columns, sides_differ, table_of
from walkers.sweeps.workers import SweepStopped

if TYPE_CHECKING:
    import pandas as pd

SHARE = 0.01
"""Share of a velocity that the last increase of Young's modulus may change."""
_TIMES = (1.0, 4.0, 16.0, 64.0, 256.0)
"""Young's moduli, divided by the modulus of the case. A run with the largest one takes 16 times as long."""
_LEAST_INCREASE = 1.25
"""Of the modulus, to the largest of a case."""
_FAMILIES = (
    "velocity",
    "right_facing",
    "left_facing",
    "axial_",
    "lateral_",
    "rotation_",
    "sliding_",
)
"""Beginnings of the names of numbers that have a numerical error, all in m/s."""


def measure_accuracy(
    directory: Path,
    options: SweepOptions,
    *,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> dict[str, Any]:
    """Make the runs that measure the numerical errors of a finished run, and record the errors in the run.

    Finished runs are used again. Other arguments: see `walkers.sweeps.scheduler.run_sweep`. `InputError` if the run is
    none of walkers or not of the installed engine; `SweepStopped` if a run fails.

    Returns
    -------
    dict
        Contents of ``accuracy.json``: ``sweep``, its name beside the run; ``times``, the largest modulus divided by the
        modulus of the case, 1 if its beads cannot be harder; ``change``, the relative change of a velocity by the last
        increase, and whether it is below the ``share`` (``reached``). ``errors`` has for each number, in m/s, the
        changes at ``half_step`` and with the ``stiffer`` beads, and the root of the sum of their squares, ``total``.
    """
    case = case_of(directory)
    possible = modulus_factors(case)
    today = build_case(case.document, source=directory.name, name=case.name)
    if run_place(today, find_engine(engine), directory.parent).name != directory.name:
        text = "expected a run with the installed engine and program, and with the present library and bridge law"
        raise input_error(directory.name, f"{text}; run its case again")
    numbers = recorded(directory)["numbers"]
    for last in range(min(2, len(possible) - 1), len(possible)):
        sweep = _sweep(case, f"{directory.name}{ACCURACY}", possible[: last + 1])
        record, failures = run_sweep(
            sweep, directory.parent, options, engine=engine, on_progress=on_progress
        )
        if failures:
            raise SweepStopped(f"{failures[0].run}: {failures[0].message}")
        table = table_of(record).frame
        # The largest share of a headline velocity that the last increase of the modulus changes.
        names = {
            main_columns(table)[0],
            *(SIDES if case.goes_uphill or sides_differ(table) else ()),
        }
        harder = [numbers, *table[1:].to_dict("records")]
        before, after = harder[max(last - 1, 0)], harder[last]
        changes = (
            abs(after[name] - before[name]) / max(abs(after[name]), STEADY_SPEED) for name in names
        )
        if (change := float(max(filter(isfinite, changes)))) < SHARE:
            break
    accuracy = {
        "sweep": record.sweep.name,
        "share": SHARE,
        "reached": change < SHARE,
        "change": change,
    }
    accuracy |= {"times": possible[last], "errors": _errors(numbers, table.iloc[0], harder[last])}
    with recomputed(directory, [ACCURACY_NAME]):
        write_json(directory / ACCURACY_NAME, accuracy)
    return accuracy


def modulus_factors(case: Case) -> Sequence[float]:
    """Possible Young's moduli, divided by the modulus of the case; `InputError` if its error cannot be measured."""
    if not case.walkers:
        text = "no numerical error: loose beads are chaotic: their motion is different at any other time step"
        raise input_error(
            case.name, f"{text}; walkers climb gives the scatter over starts (run.seed)"
        )
    hardest = STIFFEST / case.contact.youngs_modulus
    possible = [times for times in _TIMES if times <= hardest * (1.0 + 1e-9)]
    further = len(possible) < len(_TIMES) and hardest >= _LEAST_INCREASE * possible[-1]
    return [*possible, hardest] if further else possible


def _sweep(case: Case, name: str, possible: Sequence[float]) -> SweepDefinition:
    """The case at half its time step, and with harder beads at steps as much smaller as the Rayleigh limit."""
    step, modulus = 1e6 * case.run.time_step, 1e-6 * case.contact.youngs_modulus
    factors = [(0.5, 1.0), *((times**-0.5, times) for times in possible[1:])]
    points = {
        "run.time_step": [f"{shorter * step!r} us" for shorter, _ in factors],
        "contact.youngs_modulus": [
            f"{min(harder * modulus, 1e-6 * STIFFEST)!r} MPa" for _, harder in factors
        ],
    }
    title = f"{case.title or case.name}: smaller time steps and harder beads"
    file = {"title": title, "case": case.name, "zip": [points]}
    return expand(file, source=case.name, name=name, base=(case.name, case.document))


def _errors(
    row: Mapping[str, Any], finer: pd.Series, hardest: Mapping[Any, Any]
) -> dict[str, dict[str, float]]:
    """Numerical errors of a row, by one with half its step and one with the hardest beads."""
    errors = {}
    for name in row:
        if name.startswith(_FAMILIES) and isfinite(row[name]):
            half, stiffer = (float(run[name]) - row[name] for run in (finer, hardest))
            errors[name] = {"half_step": half, "stiffer": stiffer, "total": hypot(half, stiffer)}
    return errors
