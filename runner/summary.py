"""What a case amounts to before it is run: its numbers in SI, its forces, its time step and its cost."""

from __future__ import annotations

from math import isfinite
from typing import Any

from walkers.inputs import library
from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import contact_loads, dimer_of
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.physics.capillary import capillary_force_limit_at_wall
from walkers.physics.time_step import AUTO_FRACTIONS, TimeStepLimits, time_step_limits
from walkers.runner.cost import predicted_seconds

_CONTACTS = ("bead 1 on substrate", "bead 2 on substrate", "bead on bead")


def summarise(case: WalkerCase) -> dict[str, Any]:
    """Everything that ``walkers show`` prints, SI units.

    Returns
    -------
    dict
        ``case`` (resolved), ``dimer`` (M, R̄, Γ0, sin δ, μ), ``contacts`` (forces, bridges, overlaps), ``time_step``
        (limits, the chosen step and its share of each), ``run`` (steps, frames, predicted seconds).
    """
    dimer, loads, run = dimer_of(case), contact_loads(case), case.run
    limits = time_step_limits(dimer, case.contact, case.liquid, case.drive.peak_velocity)
    planes = [capillary_force_limit_at_wall(case.liquid.surface_tension, radius) for radius in case.beads.radii]
    return {
        "case": case.as_dict(),
        "dimer": {
            "masses": list(dimer.masses),
            "total_mass": dimer.total_mass,
            "mean_radius": dimer.mean_radius,
            "gamma0": dimer.gamma0(case.drive.peak_acceleration),
            "sin_delta": dimer.sin_delta,
            "mass_asymmetry": dimer.mass_asymmetry,
            "peak_acceleration": case.drive.peak_acceleration,
            "amplitude": case.drive.amplitude,
            "peak_velocity": case.drive.peak_velocity,
            "stiffness_ratio": _stiffness_ratio(case),
        },
        "contacts": [
            {
                "contact": name,
                "bridge_volume": loads.bridge_volumes[number],
                "capillary_force": loads.capillary[number],
                "capillary_force_limit": planes[number] if number < 2 else None,
                "rupture_distance": loads.rupture[number],
                "overlap_at_rest": loads.overlaps[number],
            }
            for number, name in enumerate(_CONTACTS)
        ],
        "time_step": step_against(run.time_step, limits),
        "run": {
            "steps_per_cycle": run.steps_per_cycle,
            "steps": run.steps,
            "simulated_seconds": run.steps * run.time_step,
            "samples": run.cycles * run.samples_per_cycle + 1,
            "predicted_seconds": predicted_seconds(case),
        },
    }


def step_against(time_step: float, limits: TimeStepLimits) -> dict[str, Any]:
    """A time step (s) with the limits, None where one does not apply, and its share of each."""
    known = limits.as_dict()
    return {
        "step": time_step,
        "limits": {name: limit if isfinite(limit) else None for name, limit in known.items()},
        "share": {name: time_step / limit for name, limit in known.items()},
    }


def _stiffness_ratio(case: WalkerCase) -> float | None:
    """Young's modulus of the simulation over that of the beads' material."""
    if case.beads.material not in library.materials():
        return None
    return case.contact.youngs_modulus / library.material(case.beads.material)["youngs_modulus"]


def describe(summary: dict[str, Any]) -> str:
    """The summary as text."""
    parts = [
        text_of_case(summary["case"]),
        _text_of_dimer(summary),
        _text_of_contacts(summary),
        _text_of_step(summary),
    ]
    return "\n".join(parts)


def text_of_case(case: dict[str, Any]) -> str:
    """A resolved case, one line per table."""
    lines = [f"{case['name']}: {case['title']}".rstrip(": ")]
    for table, values in case.items():
        if isinstance(values, dict):
            shown = ", ".join(f"{key} {_short(value)}" for key, value in values.items())
            lines.append(f"  {table:10} {shown}")
        elif table not in ("name", "title", "kind"):
            lines.append(f"  {table:10} {_short(values)}")
    return "\n".join(lines) + "\n  (SI units: m, kg, s, N, Pa, rad)"


def _short(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return "[" + ", ".join(_short(entry) for entry in value) + "]"
    if isinstance(value, dict):
        return " ".join(f"{key} {_short(entry)}" for key, entry in value.items())
    return str(value)


def _text_of_dimer(summary: dict[str, Any]) -> str:
    dimer = summary["dimer"]
    ratio = dimer["stiffness_ratio"]
    softened = f"; beads {1 / ratio:.3g} times softer than their material" if ratio else ""
    order = "" if dimer["sin_delta"] >= 0 else "\n           bead 1 is the smaller one"
    return (
        f"dimer      M = {dimer['total_mass'] * 1e6:.4g} mg, mean radius {dimer['mean_radius'] * 1e3:.4g} mm, "
        f"sin δ = {dimer['sin_delta']:.4g}, μ = {dimer['mass_asymmetry']:.4g}{softened}\n"
        f"drive      a0 = {dimer['peak_acceleration'] / ACCELERATION_OF_ONE_G:.4g} g "
        f"(the paper's, {ACCELERATION_OF_ONE_G:g} m/s²; gravity is {summary['case']['gravity']:g} m/s²), "
        f"Γ0 = {dimer['gamma0']:.4g}, amplitude {dimer['amplitude'] * 1e3:.4g} mm, "
        f"peak velocity {dimer['peak_velocity'] * 1e3:.4g} mm/s{order}"
    )


def _text_of_contacts(summary: dict[str, Any]) -> str:
    lines = ["contact                capillary force   4πγR limit   bridge    rupture   overlap at rest"]
    for contact in summary["contacts"]:
        limit = contact["capillary_force_limit"]
        lines.append(
            f"  {contact['contact']:20} {contact['capillary_force'] * 1e6:11.4g} µN "
            f"{f'{limit * 1e6:.4g} µN' if limit else '-':>12} {contact['bridge_volume'] * 1e12:8.3g} nL "
            f"{contact['rupture_distance'] * 1e6:6.3g} µm {contact['overlap_at_rest'] * 1e9:10.4g} nm"
        )
    return "\n".join(lines)


def _text_of_step(summary: dict[str, Any]) -> str:
    step, run = summary["time_step"], summary["run"]
    lines = [f"time step  {step['step'] * 1e6:.5g} µs, {run['steps_per_cycle']} a cycle"]
    lines += lines_of_limits(step)
    lines.append(
        f"run        {run['steps']} steps, {run['simulated_seconds']:.4g} s simulated, {run['samples']} samples, "
        f"about {run['predicted_seconds']:.1f} s on one core"
    )
    return "\n".join(lines)


def lines_of_limits(step: dict[str, Any]) -> list[str]:
    """What `step_against` says, one line per limit."""
    lines = []
    for name, limit in step["limits"].items():
        shown = f"{limit * 1e6:.4g} µs" if limit is not None else "none"
        share = f"{step['share'][name]:.3f} of it (auto: up to {AUTO_FRACTIONS[name]:g})"
        lines.append(f"  {name:10} limit {shown:>10}, the step is {share}")
    return lines
