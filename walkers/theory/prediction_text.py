"""A prediction of the theory as a table for people, beside the result of the engine."""

from __future__ import annotations

from collections.abc import Mapping
from math import log
from typing import Any

from walkers.rounding import with_decimals
from walkers.terminal import table_width
from walkers.text import aligned_blocks, aligned_with_text

_HEAD = ["mm/s", "velocity", "rotation 1", "rotation 2", "sliding 1", "Γc", ""]
"""Columns of the table of velocities."""
_SPEEDS = 4
"""Number of velocities in a row of the table."""


def prediction_text(prediction: Mapping[str, Any], result: Mapping[str, Any] | None) -> str:
    """Word a prediction.

    Parameters
    ----------
    prediction
        What `walkers.theory.prediction.predict` returns, optionally with a sentence ``outside``
        about the range of the paper's measurements.
    result
        The numbers of the finished run of the case (m/s), on a slope those of the walkers that face
        up; None if the case has not been run.

    Returns
    -------
    str
        The velocities of each model and of the engine in mm/s, then when contacts open, and whether
        the walker stays aligned with the axis of the drive.
    """
    paper = prediction["paper"]
    lines = [f"Γ0 = {prediction['gamma0']:.3g}, sin δ = {prediction['sin_delta']:.3g}"]
    if prediction.get("outside"):
        lines.append(prediction["outside"])
    rows = [
        _HEAD,
        _row(f"paper's fit, κ = {paper['friction'] * 1e-3:g} s/mm", paper),
        _row("friction and drag", prediction["viscous"]),
        _engine_row(result),
    ]
    notes = [
        ["contacts", _contacts_text(prediction["detachment"])],
        ["alignment", _alignment_if_rolling_text(prediction["alignment"])],
        ["with slip", _alignment_if_slipping_text(prediction["alignment"])],
    ]
    lines.append(aligned_blocks(rows, table_width(), right=range(1, 6)))
    lines.append(aligned_with_text(notes, table_width()))
    return "\n".join(lines)


def _engine_row(result: Mapping[str, Any] | None) -> list[str]:
    """The row of the engine; without a result it says how to get one."""
    if not result:
        return _row("engine", {"velocity": None, "reason": "run it: walkers run CASE"})
    name = "engine"
    if result["goes_uphill"] and result["facing_right"] and result["facing_left"]:
        name = "engine, facing up"
    numbers = {
        "velocity": result["velocity"],
        "rotation": [result["rotation_1"], result["rotation_2"]],
        "sliding": [result["sliding_1"]],
    }
    return _row(name, numbers)


def _row(name: str, model: Mapping[str, Any]) -> list[str]:
    """The row of a model: velocities in mm/s, threshold Γc, reason for a missing velocity."""
    velocity = model["velocity"]
    speeds = []
    if velocity is None:
        speeds.append("-")
    else:
        speeds.append(with_decimals(velocity * 1e3, 3))
        first_sliding = model.get("sliding", [])[:1]
        for speed in (*model.get("rotation", []), *first_sliding):
            speeds.append(with_decimals(speed * 1e3, 2))
    while len(speeds) < _SPEEDS:
        speeds.append("")
    threshold = model.get("threshold")
    threshold_text = "" if threshold is None else f"{threshold:.3f}"
    return [name, *speeds, threshold_text, model.get("reason") or ""]


def _contacts_text(opening: Mapping[str, Any]) -> str:
    """Up to which drive the contacts stay closed."""
    closed = f"with friction and drag stay closed up to about Γ0 = {opening['gamma']:.2g}"
    if opening["reason"]:
        return f"{closed}; beyond, {opening['reason']}"
    return f"{closed}, the strongest drive tried"


def _alignment_if_rolling_text(alignment: Mapping[str, Any]) -> str:
    """What small angles ψ to the axis do if the beads roll without sliding.

    They obey the Mathieu equation of `walkers.theory.mathieu`, with ϑ = πft and dimensionless
    U (a steady acceleration), V (the drive) and β (damping by the bridges):

        d²ψ/dϑ² + 2β dψ/dϑ + (U - 4V cos 2ϑ) ψ = 0
    """
    u, v = alignment["u"], alignment["v"]
    equation = f"Mathieu U = {u:.3g}, V = {v:.3g}, β = {alignment['damping']:.3g}"
    if not u:  # on a level substrate, a single number tells where angles are stable
        equation += f" (stable for V < {alignment['largest_stable_v']:.3g})"
    if not u and not v:
        outcome = "no torque toward the axis"
    elif alignment["stable"]:
        outcome = "small angles stay small"
    else:
        outcome = "small angles grow"
    return f"{equation}: {outcome} if the beads roll"


def _alignment_if_slipping_text(alignment: Mapping[str, Any]) -> str:
    """What small angles to the axis do if contacts slip and beads spin.

    Angles grow or decay exponentially, at the ``rate`` of
    `walkers.theory.prediction.alignment_of`, 1/s.
    """
    rate = alignment["rate"]
    if rate is None:
        return "unknown: the axial motion is not periodic"
    change = "grow" if rate > 0.0 else "decay"
    text = f"small angles {change} by {abs(rate):.3g}/s"
    if alignment["rolling_friction"]:
        text += " at 1° (with rolling friction, smaller ones may grow)"
    if alignment["turns_over_after"]:
        text += f"; turns over after about {alignment['turns_over_after']:.2g} s (from 1° to 90°)"
    elif not alignment["stands"]:
        text += f"; turns away from the axis, from 1° to 10° in about {log(10.0) / rate:.2g} s"
    return text
