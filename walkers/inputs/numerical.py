"""Numerical error of velocities, measured for shipped cases with a shorter time step and stiffer beads.

Beads in a simulation are softer than their material, and the time step is finite. The table ``numerical_errors.toml``
has, for shipped cases, how much the velocity changes at half the time step, and with beads that are `STIFFER` times as
hard. ``tests/tools/measure_numerical_errors.py`` writes it. It knows a case by a hash, so that none is resolved here.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

from walkers.inputs.case import Case

TABLE = "numerical_errors.toml"
STIFFER = 10.0
"""Young's modulus of the harder beads over that of the case …"""
INFLUENCE = "0.2 to 9 %"
"""… and how much they change the velocities of the table that are above 1 µm/s."""


@cache
def measured() -> Mapping[str, Mapping[str, Any]]:
    """By names of cases the ``velocity``, its change at ``half_step`` and with ``stiffer`` beads, m/s; and a digest."""
    table = tomllib.loads(resources.files("walkers.inputs").joinpath(TABLE).read_text("utf-8"))
    keys = ("velocity", "half_step", "stiffer")
    return {name: one | {key: 1e-3 * one[key] for key in keys} for name, one in table.items()}


def numerical_error(case: Case) -> dict[str, float] | None:
    """The numerical error of the velocity of a case, m/s; None unless it is that of a shipped case that was measured.

    ``half_step`` and ``stiffer`` are the changes of the velocity, ``total`` is the root of the sum of their squares.
    """
    asked = digest(case)
    for one in measured().values():
        if asked == one["case"]:
            half_step, stiffer = one["half_step"], one["stiffer"]
            return {"half_step": half_step, "stiffer": stiffer, "total": (half_step**2 + stiffer**2) ** 0.5}
    return None


def digest(case: Case) -> str:
    """Twelve hex digits of what the numerical error depends on: a run's determinants but length, room and sampling."""
    for key, walkers in case.walkers_by_key.items():
        case = case if walkers.meet else case.put(f"{key}.spacing", None)
    run = {"time_step": case.run.time_step, "seed": case.run.seed}
    text = json.dumps({**case.determinants(), "run": run}, sort_keys=True)
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:12]
