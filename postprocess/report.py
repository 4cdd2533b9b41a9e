"""A run's result as text, in the units of the paper (mm/s, degrees)."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Any

_CONTACTS = {"contact_1": "bead 1", "contact_2": "bead 2", "contact_3": "bead on bead"}


def describe_result(directory: Path, result: dict[str, Any], *, cached: bool = False) -> str:
    """The result of a run in a few lines.

    Parameters
    ----------
    directory
        The run directory.
    result
        As `walkers.postprocess.result.tabulate` returns it.
    cached
        Whether the run was there before.
    """
    rotation, end = result["rotation"], result["orientation_end"]
    drive = f"{result['drive']}, Γ0 = {result['gamma0']:.3g}, sin δ = {result['sin_delta']:.3g}" + (
        " (already run)" if cached else ""
    )
    sliding = ", ".join(f"{name} {_speed(result['sliding'][contact])}" for contact, name in _CONTACTS.items())
    lines = [
        *(_of_turned(result, drive) if result["turned_round"] else _of_walkers(result, drive)),
        f"  rotation   bead 1 {_speed(rotation['bead_1'])}, bead 2 {_speed(rotation['bead_2'])} mm/s",
        f"  sliding    {sliding} mm/s",
        f"  orientation at the end {degrees(end['smallest']):.2f}° to {degrees(end['largest']):.2f}°",
    ]
    if any(result["open"].values()):
        shares = ", ".join(f"{name} {100 * result['open'][contact]:.1f} %" for contact, name in _CONTACTS.items())
        lines.append(f"  contacts open: {shares} of the time")
    lines += [f"  warning: {warning}" for warning in _warnings(result)]
    lines.append(f"  run        {directory}")
    return "\n".join(lines)


def _of_walkers(result: dict[str, Any], drive: str) -> list[str]:
    """How fast walkers are that kept their heading."""
    velocity = result["velocity"]
    error, count = velocity["standard_error"], velocity["n"]
    of_what = f"over {count} walkers" if count > 1 else "of the fit"
    doubt = f" (standard error {_speed(error)} {of_what})" if error is not None else ""
    toward = "toward the large bead" if result["sin_delta"] else "toward bead 1"
    ways = ("up", "down") if result["goes_uphill"] else ("right", "left")
    return [
        f"{result['case']}: {drive}",
        f"  velocity   {_speed(velocity['mean'])} mm/s, positive {toward}{doubt}",
        f"    smallest {_speed(velocity['smallest'])}, largest {_speed(velocity['largest'])}; {_steady(result)}",
        f"    started facing {ways[0]} {_side(result['right_facing'])}, {ways[1]} {_side(result['left_facing'])}",
    ]


def _of_turned(result: dict[str, Any], drive: str) -> list[str]:
    """What became of walkers of which some turned by more than 90°: a velocity along their heading says nothing."""
    axial, kept = result["axial_velocity"], result["kept_heading"]
    tilted = result["goes_uphill"]
    what, (first, second) = ("over", ("up", "down")) if tilted else ("round", ("right", "left"))
    return [
        f"{result['case']}: {result['turned_round']} of {result['walkers']} turned {what}, "
        f"axial velocity {_speed(axial['mean'])} mm/s",
        f"  drive      {drive}",
        f"  axial velocity, positive {'up' if tilted else 'to the right'}: started facing {first} "
        f"{_speed(axial['right_facing'])}, {second} {_speed(axial['left_facing'])} mm/s; {_steady(result)}",
        f"  velocity   {_speed(kept['mean'])} mm/s along the heading, of the {kept['n']} that kept it"
        if kept["n"]
        else "  velocity   none: no walker kept its heading",
    ]


def _steady(result: dict[str, Any]) -> str:
    return f"{result['steady']} of {result['walkers']} steady"


def _speed(value: float | None) -> str:
    """A speed in m/s as text in mm/s: three decimals, or its order of magnitude where these would all be zero."""
    if value is None:
        return "-"
    return f"{value * 1e3:.3f}" if abs(value) >= 5e-7 or value == 0.0 else f"{value * 1e3:.1e}"


def _side(side: dict[str, Any]) -> str:
    return f"{_speed(side['mean'])} ({side['n']})" if side["n"] else "none"


def _warnings(result: dict[str, Any]) -> list[str]:
    warnings = []
    if result["steady"] < result["walkers"]:
        warnings.append("some walkers are not steady: the velocity depends on the length of the run")
    if result["walkers_met"]:
        warnings.append("walkers came close to each other and are not independent: give them more start.spacing")
    if result["truncated"]:
        warnings.append("the dump ends within a frame")
    return warnings
