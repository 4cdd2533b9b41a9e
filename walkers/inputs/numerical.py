"""The numerical error of a velocity: measured for shipped cases, by a shorter time step and by harder beads.

Beads in a simulation are softer than their material, and the time step is finite. The table ``numerical_errors.toml``
has, for shipped cases, how much the velocity changes at half the time step, and with beads that are `STIFFER` times as
hard. ``tests/tools/measure_numerical_errors.py`` writes it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.reading import load_case

TABLE = "numerical_errors.toml"
STIFFER = 10.0
"""Young's modulus of the harder beads over that of the case."""


@cache
def measured() -> Mapping[str, Mapping[str, float]]:
    """By the names of cases the ``velocity``, and its change at ``half_step`` and with ``stiffer`` beads, m/s."""
    table = tomllib.loads(resources.files("walkers.inputs").joinpath(TABLE).read_text("utf-8"))
    return {name: {key: 1e-3 * value for key, value in of_case.items()} for name, of_case in table.items()}


def numerical_error(case: Case) -> dict[str, float] | None:
    """The numerical error of the velocity of a case, m/s; None unless it is that of a shipped case that was measured.

    Returns
    -------
    dict
        ``half_step`` and ``stiffer``, the changes of the velocity; ``total``, the root of the sum of their squares.
    """
    asked = _determinants(case)
    for name, of_case in measured().items():
        if asked == _shipped(name):
            half_step, stiffer = of_case["half_step"], of_case["stiffer"]
            return {"half_step": half_step, "stiffer": stiffer, "total": (half_step**2 + stiffer**2) ** 0.5}
    return None


@cache
def _shipped(name: str) -> dict[str, Any]:
    return _determinants(load_case(name))


def _determinants(case: Case) -> dict[str, Any]:
    """What the numerical error depends on: all that determines a run but its length, room and sampling."""
    found = case.determinants()
    makes = [{**one, "spacing": one["spacing"] if one["meet"] else None} for one in found["walkers"]]
    return {**found, "walkers": makes, "run": found["run"]["time_step"]}
