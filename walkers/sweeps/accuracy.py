"""Numerical errors of walkers: the same case at half the time step, and with harder beads until nothing changes.

Beads are softer than their material, so that the time step can be longer. Young's modulus is multiplied by 4 and the
time step halved, as the Rayleigh limit allows it, until the headline velocities change by less than a share. They
follow no common power of the modulus (docs/explanation/physics.md), so nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, Problem, refused
from walkers.inputs.case import STIFFEST, Case
from walkers.inputs.sweep import Sweep, expand
from walkers.postprocess.results import recorded
from walkers.postprocess.sides import STEADY_SPEED
from walkers.postprocess.uncertainty import ACCURACY, ACCURACY_NAME
from walkers.runner.binary import find_engine
from walkers.runner.directory import case_of, recomputed, run_place
from walkers.runner.files import write_json
from walkers.sweeps.scheduler import Options, SweepStopped, run_sweep
from walkers.sweeps.table import SIDES, load, main_columns, sides_differ

if TYPE_CHECKING:
    import pandas as pd

SHARE = 0.01
"""Share of a velocity that the last increase of Young's modulus may change."""
_TIMES = (1.0, 4.0, 16.0, 64.0, 256.0)
"""Young's moduli, divided by the modulus of the case. A run with the largest one takes 16 times as long."""
_FAMILIES = ("velocity", "right_facing", "left_facing", "axial_", "lateral_", "rotation_", "sliding_")
"""Beginnings of the names of numbers that have a numerical error, all in m/s."""


def measure_accuracy(directory: Path, options: Options, *, engine: str | None = None, **how: Any) -> dict[str, Any]:
    """Make the runs that measure the numerical errors of a finished run, and record the errors in the run.

    Finished runs are used again. Other arguments: see `walkers.sweeps.scheduler.run_sweep`. `InputError` if the run is
    none of walkers or not of the installed engine; `SweepStopped` if a run fails.

    Returns
    -------
    dict
        Contents of ``accuracy.json``: ``sweep``, its name beside the run; ``times``, the largest modulus divided by the
        modulus of the case; ``change``, the relative change of a velocity by the last increase, and whether it is below
        the ``share`` (``reached``). ``errors`` has for each number, in m/s, the changes at ``half_step`` and with the
        ``stiffer`` beads, and the root of the sum of their squares, ``total``.
    """
    case = case_of(directory)
    possible = times_of(case)
    today = Case.read(case.document, source=directory.name, name=case.name)
    if run_place(today, find_engine(engine), directory.parent).name != directory.name:
        text = "expected a run with the installed engine and program, and with the present library and bridge law"
        raise refused(directory.name, f"{text}; run its case again")
    for last in range(2, len(possible)):
        sweep = _sweep(case, f"{directory.name}{ACCURACY}", possible[: last + 1])
        record, failures = run_sweep(sweep, directory.parent, options, engine=engine, **how)
        if failures:
            raise SweepStopped(f"{failures[0].run}: {failures[0].message}")
        table = load(record.directory)
        # The largest share of a headline velocity that the last increase of the modulus changes.
        names = {main_columns(table)[0], *(SIDES if case.goes_uphill or sides_differ(table) else ())}
        before, after = table[[*names]].iloc[-2:].dropna(axis="columns").to_numpy(float)
        if (change := float(max(abs(after - before) / abs(after).clip(STEADY_SPEED)))) < SHARE:
            break
    accuracy = {"sweep": record.sweep.name, "share": SHARE, "reached": change < SHARE, "change": change}
    accuracy |= {"times": possible[last], "errors": _errors(recorded(directory)["numbers"], table)}
    with recomputed(directory, [ACCURACY_NAME]):
        write_json(directory / ACCURACY_NAME, accuracy)
    return accuracy


def times_of(case: Case) -> Sequence[float]:
    """Possible Young's moduli, divided by the modulus of the case; `InputError` if its error cannot be measured."""
    if not case.walkers:
        text = "no numerical error: loose beads are chaotic: their motion is different at any other time step"
        raise refused(case.name, f"{text}; walkers climb gives the scatter over starts (run.seed)")
    possible = [times for times in _TIMES if times * case.contact.youngs_modulus <= STIFFEST * (1.0 + 1e-9)]
    if len(possible) < 3:
        text = f"expected at most {1e-6 * STIFFEST / _TIMES[2]:g} MPa, so that beads can be harder"
        raise InputError(case.name, [Problem("contact.youngs_modulus", None, text)])
    return possible


def _sweep(case: Case, name: str, possible: Sequence[float]) -> Sweep:
    """The case at half its time step, and with harder beads at steps as much smaller as the Rayleigh limit."""
    step, modulus = 1e6 * case.run.time_step, 1e-6 * case.contact.youngs_modulus
    factors = [(0.5, 1.0), *((times**-0.5, times) for times in possible[1:])]
    points = {
        "run.time_step": [f"{shorter * step!r} us" for shorter, _ in factors],
        "contact.youngs_modulus": [f"{harder * modulus!r} MPa" for _, harder in factors],
    }
    title = f"{case.title or case.name}: smaller time steps and harder beads"
    file = {"title": title, "case": case.name, "zip": [points]}
    return expand(file, source=case.name, name=name, base=(case.name, case.document))


def _errors(row: Mapping[str, Any], table: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Numerical errors of a row: the first of the table has half its step, the last one has the hardest beads."""
    errors = {}
    for name in row:
        if name.startswith(_FAMILIES) and row[name] is not None and isfinite(row[name]):
            half, stiffer = (float(table[name].iloc[place]) - row[name] for place in (0, -1))
            errors[name] = {"half_step": half, "stiffer": stiffer, "total": hypot(half, stiffer)}
    return errors
