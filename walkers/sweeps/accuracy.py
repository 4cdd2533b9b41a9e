"""Numerical errors of walkers: the case at half the time step, and with harder beads.

Beads are softer than their material, so that the time step can be longer. Young's modulus is
multiplied by 4 and the time step halved, as the Rayleigh limit allows it, until the headline
velocities change by less than `SHARE`; the last increase is to the largest modulus of a case, that
of hard materials. Velocities follow no common power of the modulus (docs/explanation/physics.md),
so nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
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
from walkers.postprocess.measure.uncertainty import ACCURACY, ACCURACY_NAME, ACCURACY_TITLE
from walkers.progress import Tell
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import case_of, recomputed, run_place
from walkers.sweeps.scheduler import SweepOptions, SweepPlan, plan_sweep, run_sweep
from walkers.sweeps.table import SIDES, main_columns, sides_differ, table_of
from walkers.sweeps.workers import SweepStopped

if TYPE_CHECKING:
    import pandas as pd

SHARE = 0.01
"""Share of a velocity that the last increase of Young's modulus may change."""
_MODULUS_FACTORS = (1.0, 4.0, 16.0, 64.0, 256.0)
"""Young's moduli, divided by the modulus of the case; with the largest, a run takes 16 times as
long."""
_FIRST_FACTORS = 3
"""Number of the factors that are tried in any case, if the case allows them."""
_LEAST_INCREASE = 1.25
"""Smallest factor of a last increase of the modulus, to the largest one of a case."""
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
    """Make the runs that measure the numerical errors of a finished run, and record the errors.

    They are made in the directory of the sweep ``RUN-accuracy``. Finished runs are used again.

    Parameters
    ----------
    directory
        Directory of a finished run of walkers, beside which the further runs are made.
    options, engine, on_progress
        As for `walkers.sweeps.scheduler.run_sweep`.

    Returns
    -------
    dict
        Contents of the file ``accuracy.json`` in the run:

        - ``sweep``: name of the sweep beside the run
        - ``share``: the largest change of a headline velocity that is accepted, relative to it
        - ``reached``: whether the change is smaller
        - ``change``: the change by the last increase of Young's modulus
        - ``times``: the largest modulus, divided by the modulus of the case; 1 if its beads cannot
          be harder
        - ``errors``: for each number, in m/s, the changes at half the time step (``half_step``) and
          with the hardest beads (``stiffer``), and the root of the sum of their squares
          (``total``)

    Raises
    ------
    InputError
        If the run is not one of walkers, or was not made by the installed engine and program.
    SweepStopped
        If a run fails.
    """
    case = case_of(directory)
    possible = modulus_factors(case)
    _check_is_current(case, directory, engine)
    options = replace(options, own_runs=True)
    numbers = recorded(directory)["numbers"]
    # The modulus is increased at least twice if the case allows it, and further only if necessary.
    for last in range(min(_FIRST_FACTORS, len(possible)) - 1, len(possible)):
        sweep = _convergence_sweep(case, f"{directory.name}{ACCURACY}", possible[: last + 1])
        record, failures = run_sweep(
            sweep, directory.parent, options, engine=engine, on_progress=on_progress
        )
        if failures:
            raise SweepStopped(f"{failures[0].run}: {failures[0].message}")
        table = table_of(record).frame
        by_modulus = [numbers, *table[1:].to_dict("records")]  # row 0 has half the time step
        before = by_modulus[max(last - 1, 0)]
        hardest = by_modulus[last]
        change = _largest_change(before, hardest, _headline_velocities(case, table))
        if change < SHARE:
            break
    accuracy = {
        "sweep": record.sweep.name,
        "share": SHARE,
        "reached": change < SHARE,
        "change": change,
        "times": possible[last],
        "errors": _errors(numbers, table.iloc[0], hardest),
    }
    with recomputed(directory, [ACCURACY_NAME]):
        write_json(directory / ACCURACY_NAME, accuracy)
    return accuracy


def plan_accuracy(
    case: Case, directory: Path, options: SweepOptions, engine: str | None = None
) -> SweepPlan:
    """Plan the first runs that measure the numerical errors of a run; nothing is written.

    More follow if the velocities still change then.

    Parameters
    ----------
    case
        The case of the run.
    directory
        The final directory of the run, which need not exist.
    options, engine
        As for `measure_accuracy`.
    """
    factors = modulus_factors(case)[:_FIRST_FACTORS]
    sweep = _convergence_sweep(case, f"{directory.name}{ACCURACY}", factors)
    return plan_sweep(sweep, directory.parent, replace(options, own_runs=True), engine)


def _check_is_current(case: Case, directory: Path, engine: str | None) -> None:
    """Refuse a run that the installed engine and program would not make from its case file."""
    today = build_case(case.document, source=directory.name, name=case.name)
    if run_place(today, find_engine(engine), directory.parent).name != directory.name:
        raise input_error(
            directory.name,
            "expected a run with the installed engine and program, and with the present library "
            "and bridge law; run its case again",
        )


def modulus_factors(case: Case) -> Sequence[float]:
    """Possible Young's moduli, divided by the modulus of the case, in ascending order.

    They are those of `_MODULUS_FACTORS` up to `STIFFEST`, the largest modulus of a case, and this
    one too if it is well above the others. The first one, 1, is the case itself.

    Raises
    ------
    InputError
        If the numerical error of the case cannot be measured, because it has no walkers.
    """
    if not case.walkers:
        raise input_error(
            case.name,
            "no numerical error: loose beads are chaotic: their motion is different at any other "
            "time step; walkers climb gives the scatter over starts (run.seed)",
        )
    hardest = STIFFEST / case.contact.youngs_modulus
    limit = hardest * (1.0 + 1e-9)  # but for rounding
    possible = [factor for factor in _MODULUS_FACTORS if factor <= limit]
    if len(possible) < len(_MODULUS_FACTORS) and hardest >= _LEAST_INCREASE * possible[-1]:
        possible.append(hardest)
    return possible


def _convergence_sweep(case: Case, name: str, factors: Sequence[float]) -> SweepDefinition:
    """A sweep of the case: at half its time step, and with harder beads.

    The harder beads have shorter time steps, as the Rayleigh limit demands.

    Parameters
    ----------
    case
        The case.
    name
        Name of the sweep.
    factors
        Young's moduli, divided by the modulus of the case. The first one, 1, is the case itself,
        which has no point.
    """
    step = 1e6 * case.run.time_step
    modulus = 1e-6 * case.contact.youngs_modulus
    largest = 1e-6 * STIFFEST
    time_steps = [f"{0.5 * step!r} us"]
    moduli = [f"{min(modulus, largest)!r} MPa"]
    for factor in factors[1:]:
        shorter = factor**-0.5
        time_steps.append(f"{shorter * step!r} us")
        moduli.append(f"{min(factor * modulus, largest)!r} MPa")
    file = {
        "title": f"{case.title or case.name}{ACCURACY_TITLE}",
        "case": case.name,
        "zip": [{"run.time_step": time_steps, "contact.youngs_modulus": moduli}],
    }
    return expand(file, source=case.name, name=name, base=(case.name, case.document))


def _headline_velocities(case: Case, table: pd.DataFrame) -> list[str]:
    """The numbers that must converge: the main one, and those of both directions on a slope."""
    names = [main_columns(table)[0]]
    if case.goes_uphill or sides_differ(table):
        names += SIDES
    return names


def _largest_change(
    before: Mapping[Any, Any], after: Mapping[Any, Any], names: Iterable[str]
) -> float:
    """The largest relative change of velocities, of which at least one must be finite.

    Those that are not finite do not count, such as that of walkers that face down if all face up.
    Changes are relative to no less than `STEADY_SPEED`.
    """
    changes = []
    for name in names:
        change = abs(after[name] - before[name]) / max(abs(after[name]), STEADY_SPEED)
        if isfinite(change):
            changes.append(float(change))
    return max(changes)


def _errors(
    numbers: Mapping[str, Any], finer: pd.Series, hardest: Mapping[Any, Any]
) -> dict[str, dict[str, float]]:
    """Numerical errors of a run's numbers, from runs at half its time step and with hard beads.

    Parameters
    ----------
    numbers
        The numbers of the run.
    finer
        Those of the run at half its time step.
    hardest
        Those of the run with the hardest beads.
    """
    errors = {}
    for name, number in numbers.items():
        if not (name.startswith(_FAMILIES) and isfinite(number)):
            continue
        half_step = float(finer[name]) - number
        stiffer = float(hardest[name]) - number
        errors[name] = {
            "half_step": half_step,
            "stiffer": stiffer,
            "total": hypot(half_step, stiffer),
        }
    return errors
