"""Texts of the named parameters of a deck (``blocks/parameters.lig.j2``), lines that a user may edit.

LIGGGHTS replaces ``${name}`` by the text of a ``string`` variable, and computes ``$(formula)`` in double precision to
20 digits. A deck with names therefore gives the same results bit for bit as one with numbers. The value of an ``equal``
variable would have 15 digits.
"""

from __future__ import annotations

from math import ceil

from walkers.inputs.drive import Vector

STATUS_LINES_PER_CYCLE = 4
PRINTED = "parameters:"
"""Start of the line in which the engine prints the parameters."""


def suffixes(count: int) -> list[str]:
    """Suffixes for the names of several parameters of a kind; empty for a single one."""
    return [""] if count == 1 else [f"_{place}" for place in range(1, count + 1)]


def in_cycles(steps: int, steps_per_cycle: int) -> str:
    """Steps as a multiple or a part of a cycle, if possible."""
    whole, rest = divmod(steps, steps_per_cycle)
    if whole and not rest:
        return "${steps_per_cycle}" if whole == 1 else f"$({whole}*v_steps_per_cycle)"
    for parts in (steps_per_cycle // steps, STATUS_LINES_PER_CYCLE):
        if parts and ceil(steps_per_cycle / parts) == steps:
            return f"$(ceil(v_steps_per_cycle/{parts}))" if steps_per_cycle % parts else f"$(v_steps_per_cycle/{parts})"
    return str(steps)


def along(name: str, direction: Vector) -> str:
    """A parameter times a unit vector."""
    parts = {1.0: f"${{{name}}}", 0.0: "0.0"}
    return " ".join(parts.get(part, f"$(v_{name}*({float(part)!r}))") for part in direction)
