"""Summary of a case before it is run: values in SI units, forces, time step and cost."""

from __future__ import annotations

from dataclasses import asdict
from math import acos, degrees, isfinite
from typing import Any

from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.library import library_of
from walkers.inputs.resolving.loads import contact_loads, dimer_of, gravity_warnings
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.run import CONSTANT
from walkers.inputs.units import ACCELERATION_OF_ONE_G, MODULUS, parse_quantity
from walkers.physics.capillary import bead_volume, capillary_force_limit_at_wall
from walkers.physics.time_step import FRACTIONS
from walkers.rounding import counted, percent
from walkers.runner.cost import PROGRAM_SECONDS, predicted_overhead, predicted_seconds
from walkers.runner.process import cores_here
from walkers.text import aligned, printable

_LOOSE_PACKING = 0.55
_FASTEST_CLIMB = (
    12e-3  # m/s; none of about a hundred climbs in glycerol at the drive of the paper was faster
)


def notes(case: Case) -> list[str]:
    """Notes on a case before it is run.

    About a long time step, heavy beads and few cores; of a pile, about beads of one size and low walls.
    """
    largest, reason = limits_of(case).recommended(loose=case.loose)
    times, lines = case.run.time_step / largest, []
    if times < 1e-2:
        lines = [
            f"the time step is {_two_digits(1.0 / times)} times smaller than needed ({reason})"
        ]
    elif times > 1.01:
        lines = [f"the time step is {times:.2g} times the largest of auto ({reason})"]
    lines += gravity_warnings(case)
    if case.excitation.record:
        lines += case.excitation.record.notes
    if case.run.ranks > (cores := cores_here()):
        share = f"{case.run.ranks} MPI processes (run.ranks) share {counted(cores, 'core')} of this machine"
        lines.append(f"{share}: the run takes many times longer than predicted")
    if not (case.loose and case.boundary.closed and case.mixture):
        return lines
    numbers = {"large": case.large, "small": case.count - case.large}
    lines += [
        f"no {name} beads; in the paper, large beads lead small ones"
        for name in numbers
        if not numbers[name]
    ]
    filled = _volume(case) / (_LOOSE_PACKING * case.boundary.geometry.cross_section)
    room = 2.0 * case.boundary.inner_height - filled
    if not case.run.until and (fastest := room / case.duration) < _FASTEST_CLIMB:
        end = "rise above twice boundary.height, and end the run early"
        lines.append(f"climbers faster than {fastest * 1e3:.1f} mm/s {end}")
    return lines


def _two_digits(number: float) -> str:
    return f"{float(f'{number:.2g}'):,.0f}"


def _volume(case: Case) -> float:
    """Volume of all beads, m³."""
    return sum(map(bead_volume, case.all_radii))


def summarise(case: Case) -> dict[str, Any]:
    """Everything that ``walkers show`` prints, SI units.

    Returns
    -------
    dict
        ``case`` (resolved), ``drive`` (its largest harmonic, the sum of all), ``beads`` (numbers, mass, liquid),
        ``dimer`` (M, R̄, Γ0, sin δ, mass asymmetry; of dimers),
        ``vessel`` (numbers of its planes, triangles and faces; whether it is open; extent of the opening and
        direction out of it; height; volume), ``contacts`` (forces, bridges, overlaps of each make of walkers),
        ``time_step`` (limits, None if one does not apply; the chosen step; its shares of the limits and those of
        ``"auto"``), ``run`` (steps, samples, predicted
        seconds).
    """
    run, drive, limits = case.run, case.excitation, vars(limits_of(case))
    volume = _volume(case)
    modulus = (
        library_of(case.document)
        .numbers("materials", case.beads.material or "")
        .get("youngs_modulus")
    )
    summary: dict[str, Any] = {
        "case": {**case.as_dict(), "origins": [asdict(origin) for origin in case.origins]},
        "drive": {
            name: getattr(drive, name)
            for name in ("peak_acceleration", "amplitude", "peak_velocity")
        },
        "beads": {
            "small": case.count - case.large,
            "large": case.large,
            "mass": volume * case.beads.density,
            "volume": volume,
            "liquid": _liquid(case, volume),
            "stiffness_ratio": modulus
            and case.contact.youngs_modulus / parse_quantity(modulus.written, MODULUS),
        },
        "notes": notes(case),
        "contacts": [contact for walkers in case.walkers for contact in _contacts(case, walkers)],
        "time_step": {
            "step": run.time_step,
            "limits": {name: limit if isfinite(limit) else None for name, limit in limits.items()},
            "share": {name: run.time_step / limit for name, limit in limits.items()},
            "auto": dict(FRACTIONS[case.loose]),
        },
        "run": {
            "steps_per_cycle": run.steps_per_cycle,
            "steps": run.steps,
            "simulated_seconds": run.steps * run.time_step,
            "samples": run.steps // run.steps_per_sample + 1,
            "until_steady": run.until_steady,
            "segments": -(-run.cycles // run.cycles_per_segment),
            "predicted_seconds": PROGRAM_SECONDS
            + predicted_seconds(case)
            + predicted_overhead([case]),
        },
    }
    if case.boundary.shape == "vessel":
        summary["vessel"] = _vessel(case)
    if case.walkers and len(case.walkers[0].radii) == 2:
        dimer = dimer_of(case)
        numbers = ("total_mass", "mean_radius", "sin_delta", "mass_asymmetry")
        summary["dimer"] = {name: getattr(dimer, name) for name in numbers}
        summary["dimer"] |= {
            "masses": list(dimer.masses),
            "gamma0": dimer.gamma0(drive.peak_acceleration),
        }
    return summary


def _vessel(case: Case) -> dict[str, Any]:
    """The vessel of the user's own: its walls, opening (m), height (m) and volume (m³)."""
    vessel = case.boundary.vessel
    mesh = case.document.get("meshes", {}).get(case.boundary.mesh or "")
    return {
        "planes": len(case.boundary.planes),
        "triangles": len(vessel.triangles),
        "triangles_of_file": len(mesh["triangles"]) if mesh else None,
        "faces": len({*vessel.faces.tolist()}),
        "open": bool(vessel.rims),
        "opening": list(vessel.opening),
        "facing": vessel.facing.tolist(),
        "height": case.boundary.height,
        "volume": vessel.volume(),
    }


def _text_of_vessel(vessel: dict[str, Any]) -> str:
    """Walls, opening, height and volume of a vessel as text."""
    if vessel["planes"]:
        walls = counted(vessel["planes"], "plane")
    else:
        walls = f"{counted(vessel['triangles'], 'triangle')} in {counted(vessel['faces'], 'face')}"
    of_file = vessel["triangles_of_file"]
    if of_file is not None and of_file != vessel["triangles"]:
        walls += f" (the mesh has {of_file} triangles)"
    size = f"{1e3 * vessel['height']:.4g} mm high"
    volume = f"{1e6 * vessel['volume']:.3g} cm³"
    if not vessel["open"]:
        return f"vessel     {walls}, closed: beads are within this surface, {size}, {volume} inside"
    x, y = (f"{1e3 * extent:.3g}" for extent in vessel["opening"])
    tilt = degrees(acos(min(1.0, vessel["facing"][2])))
    oblique = f", oblique by {tilt:.2g}°" if tilt > 1.0 else ""
    return f"vessel     {walls}, open toward +z, {x} mm × {y} mm wide{oblique}, {size}, {volume}"


def _liquid(case: Case, volume: float) -> float:
    """Volume of the liquid on all beads, or, if their menisci give it, in the bridges of the walkers, m³."""
    if case.liquid.meniscus_radius is None:
        return volume * case.liquid.of_bridges.volume_fraction
    loads = (
        (load, walkers.replicates)
        for walkers in case.walkers
        for load in contact_loads(case, walkers)
    )
    return sum(load.surfaces.volume * replicates for load, replicates in loads)


def _contacts(case: Case, walkers: Walkers) -> list[dict[str, Any]]:
    """Loads of the contacts of a walker at rest."""
    contacts = [f"bead {bead} on substrate" for bead, _ in enumerate(walkers.radii, 1)]
    contacts += [f"bead {second + 1} on bead {first + 1}" for first, second in walkers.pairs]
    planes = [
        capillary_force_limit_at_wall(case.liquid.surface_tension, radius)
        for radius in walkers.radii
    ]
    limits = [*planes, *(None for _ in walkers.pairs)]
    return [
        {
            "contact": contact,
            "bridge_volume": load.surfaces.volume,
            "capillary_force": load.pull,
            "capillary_force_limit": limit,
            "rupture_distance": load.rupture,
            "overlap_at_rest": load.overlap,
        }
        for contact, load, limit in zip(contacts, contact_loads(case, walkers), limits, strict=True)
    ]


def preview_text(summary: dict[str, Any]) -> str:
    """The summary as text."""
    beads, drive, dimer = summary["beads"], summary["drive"], summary.get("dimer")
    ratio, gravity = beads["stiffness_ratio"], summary["case"]["environment"]["gravity"]
    factor = _two_digits(1.0 / ratio) if ratio and ratio < 1 else ""
    softened = f"; Young's modulus of the beads reduced by a factor of {factor}" if factor else ""
    lines = [
        *_text_of_case(summary["case"]),
        f"beads      {beads['small']} small and {beads['large']} large, {beads['mass'] * 1e6:.4g} mg, "
        f"{beads['volume'] * 1e9:.4g} µL with {beads['liquid'] * 1e9:.3g} µL of liquid{softened}",
    ]
    if vessel := summary.get("vessel"):
        lines.append(_text_of_vessel(vessel))
    if dimer:
        lines.append(
            f"dimer      M = {dimer['total_mass'] * 1e6:.4g} mg, weight {dimer['total_mass'] * gravity * 1e6:.4g} µN, "
            f"mean radius {dimer['mean_radius'] * 1e3:.4g} mm, "
            f"sin δ = {dimer['sin_delta']:.4g}, mass asymmetry (m1 - m2)/M = {dimer['mass_asymmetry']:.4g}, "
            f"Γ0 = {dimer['gamma0']:.4g}"
        )
        if dimer["sin_delta"] < 0:
            lines.append("           bead 1 is the smaller bead")
    lines.append(
        f"drive      a0 = {drive['peak_acceleration'] / ACCELERATION_OF_ONE_G:.4g} g "
        f"(g = {ACCELERATION_OF_ONE_G:g} m/s², as in the paper; gravity is {gravity:g} m/s²), "
        f"amplitude {drive['amplitude'] * 1e3:.4g} mm, peak velocity {drive['peak_velocity'] * 1e3:.4g} mm/s"
    )
    rows = [
        [
            "contact",
            "capillary force",
            "4πγR of a plane",
            "bridge volume",
            "rupture gap",
            "overlap at rest",
        ]
    ]
    for contact in summary["contacts"]:
        limit = contact["capillary_force_limit"]
        cells = [
            f"{contact['capillary_force'] * 1e6:.4g} µN",
            f"{limit * 1e6:.4g} µN" if limit else "-",
        ]
        cells += [
            f"{contact['bridge_volume'] * 1e12:.3g} nL",
            f"{contact['rupture_distance'] * 1e6:.3g} µm",
        ]
        rows.append(
            [f"  {contact['contact']}", *cells, f"{contact['overlap_at_rest'] * 1e9:.4g} nm"]
        )
    lines += [aligned(rows, right=range(1, 6))] if summary["contacts"] else []
    notes = [f"note       {note}" for note in summary["notes"]]
    return "\n".join([*lines, *_text_of_run(summary["time_step"], summary["run"]), *notes])


def _text_of_case(case: dict[str, Any]) -> list[str]:
    """A resolved case, one line per value: key, value in the units of a case file, and origin."""
    lines, table = [printable(f"{case['name']}: {case['title']}").rstrip(": ")], None
    for value in case["origins"]:
        within, _, key = value["key"].rpartition(".")
        if within != table:
            table = within
            lines.append(f"  [{table}]")
        lines.append(f"    {key:24} {value['text']:24} {_origin_text(value)}".rstrip())
    return lines


def _origin_text(value: dict[str, Any]) -> str:
    """Origin of a value as text."""
    origin, source = str(value["origin"]), str(value["source"])
    ends = f", range {value['range'][0]} to {value['range'][1]}" if value["range"] else ""
    if origin == "default" and ends and not value["uncertain"]:
        return f"guessed ({source or 'not measured'}){ends.replace('range', 'general range')}"
    ends = f", uncertain{ends}" if value["uncertain"] else ends
    if origin in ("calibrated", "assumed"):
        return source + ends
    return (f"{origin}: {source}" if source else origin) + ends


def _text_of_run(step: dict[str, Any], run: dict[str, Any]) -> list[str]:
    """The time step against its limits, the length of the run and its cost."""
    lines = [f"time step  {step['step'] * 1e6:.5g} µs, {run['steps_per_cycle']} per cycle"]
    for name, limit in step["limits"].items():
        shown = f"{limit * 1e6:.4g} µs" if limit is not None else "none"
        share = f'{step["share"][name]:.3f} of the limit ("auto": at most {step["auto"][name]:g})'
        lines.append(f"  {name:10} limit {shown:>10}; time step = {share}")
    seconds = run["predicted_seconds"]
    cost = f"{seconds:.1f} s" if seconds < 120.0 else f"{seconds / 60.0:.1f} min"
    segments = f" in {run['segments']} segments" if run["segments"] > 1 else ""
    most = "at most " if run["until_steady"] else ""
    end = f"; ends when the velocity is constant within {percent(CONSTANT)}" if most else ""
    simulated = f"{run['steps']} steps, {run['simulated_seconds']:.4g} s simulated{segments}, {run['samples']} samples"
    return [*lines, f"run        {most}{simulated}{end}; predicted run time {cost}"]
