"""Summary of a case before it is run: values in SI units, forces, time step and cost.

Nothing is written, and no engine is started. The summary is JSON; `preview_text` makes text of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import acos, degrees, isfinite
from typing import Any

from walkers.inputs.origins import accelerations_in_g
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.library import library_of
from walkers.inputs.resolving.loads import contact_loads, dimer_of
from walkers.inputs.resolving.plausibility import implausible
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.run import CONSTANT
from walkers.inputs.units import (
    ACCELERATION_OF_ONE_G,
    MODULUS,
    parse_quantity,
    with_symbols,
)
from walkers.physics.capillary import bead_volume, capillary_force_limit_at_wall
from walkers.physics.time_step import recommended_fractions
from walkers.rounding import counted, percent
from walkers.runner.cost import PROGRAM_SECONDS, predicted_overhead, predicted_seconds
from walkers.runner.process import cores_here
from walkers.terminal import (
    ASIDE,
    HEADING,
    WARNING,
    styled,
    table_width,
    text_width,
    wrapped,
    wrapped_after,
)
from walkers.text import aligned_blocks, printable

_BOX_HEIGHT = 2.0
"""Height of the simulation box over the height of the container (``boundary.height``) in it."""
_LOOSE_PACKING = 0.55
"""Share of the volume of a container that loosely packed beads fill."""
_FASTEST_CLIMB = 12e-3
"""Speed of the fastest of about a hundred climbs in glycerol at the drive of the paper, m/s."""
_NEEDLESSLY_SHORT = 1e-2
"""Time step over the longest recommended one, below which a note says so."""
_LONGER_THAN_RECOMMENDED = 1.01
"""Time step over the longest recommended one, above which a note says so."""
_OBLIQUE = 1.0
"""Angle of an opening to the horizontal, degrees, above which it is called oblique."""
_KEY_WIDTH = 19
"""Width of the keys of values, characters; longer ones shift what follows."""
_VALUE_WIDTH = 16
"""Width of the values, characters; longer ones shift what follows."""
_INDENT = " " * 11
"""Start of the further lines of a text with a head."""
_LONGEST_IN_SECONDS = 120.0
"""Longest predicted run time that is printed in seconds, s."""


# --- notes ----------------------------------------------------------------------------------------


def notes(case: Case) -> list[str]:
    """What a user should know about a case before it is run.

    Notes are about a time step that is long or needlessly short, heavy beads, drives whose unit may
    be wrong, records and few cores; for piles also about beads of a single size and low walls.
    """
    lines = _time_step_notes(case)
    lines += implausible(case)
    if case.excitation.record:
        lines += case.excitation.record.notes
    cores = cores_here()
    if case.run.ranks > cores:
        processes = f"{case.run.ranks} MPI processes (run.ranks)"
        lines.append(
            f"{processes} share {counted(cores, 'core')} of this machine: "
            "the run takes many times longer than predicted"
        )
    # Loose beads that are drawn from a mixture and poured into a container.
    if case.loose and case.boundary.closed and case.mixture:
        lines += _pile_notes(case)
    return lines


def _time_step_notes(case: Case) -> list[str]:
    """A note on a time step that is much shorter than needed, or longer than ``"auto"`` allows."""
    longest, reason = limits_of(case).recommended(loose=case.loose)
    ratio = case.run.time_step / longest
    if ratio < _NEEDLESSLY_SHORT:
        return [f"the time step is {_two_digits(1.0 / ratio)} times smaller than needed ({reason})"]
    if ratio > _LONGER_THAN_RECOMMENDED:
        return [f"the time step is {ratio:.2g} times the largest of auto ({reason})"]
    return []


def _pile_notes(case: Case) -> list[str]:
    """Notes on a pile of beads of a single size, and on climbers that may leave the box at its top.

    Climbers may leave it if the mean speed from the top of the loosely packed pile to that of the
    box, within the run, is below that of the fastest climb.
    """
    lines = []
    counts = {"large": case.large, "small": case.count - case.large}
    for size, count in counts.items():
        if count == 0:
            lines.append(f"no {size} beads; in the paper, large beads lead small ones")
    cross_section = case.boundary.geometry.cross_section
    pile_height = _volume(case) / (_LOOSE_PACKING * cross_section)
    free_height = _BOX_HEIGHT * case.boundary.inner_height - pile_height
    if not case.run.until:  # a run until a climb ends before a climber reaches the top
        speed = free_height / case.duration
        if speed < _FASTEST_CLIMB:
            end = "rise above twice boundary.height, and end the run early"
            lines.append(f"climbers faster than {speed * 1e3:.1f} mm/s {end}")
    return lines


def _two_digits(number: float) -> str:
    """A number rounded to two significant digits, with commas between thousands."""
    rounded = float(f"{number:.2g}")
    return f"{rounded:,.0f}"


def _volume(case: Case) -> float:
    """Volume of all beads, m³."""
    return sum(bead_volume(radius) for radius in case.all_radii)


# --- summary --------------------------------------------------------------------------------------


def summarise(case: Case) -> dict[str, Any]:
    """Everything that ``walkers show`` prints, as JSON in SI units.

    Returns
    -------
    dict
        ``case``
            The resolved case, with the origins of its values.
        ``drive``
            Peak acceleration, amplitude and peak velocity.
        ``beads``
            Numbers, mass, volume, liquid; the reduced over the real Young's modulus.
        ``notes``
            Texts (`notes`).
        ``contacts``
            Forces, bridges and overlaps at rest, for each kind of walkers.
        ``time_step``
            The step, the limits (None if one does not apply), the shares of the limits that the
            step has, and the largest shares of ``"auto"``.
        ``run``
            Steps, samples, segments, predicted seconds.
        ``vessel``
            Of a vessel: numbers of its planes, triangles and faces; whether it is open; extent of
            the opening and direction out of it; height; volume.
        ``dimer``
            Of dimers: masses, mean radius, sin δ, mass asymmetry, and Γ0, the peak inertial force
            over the capillary force 4πγR̄.
    """
    drive = case.excitation
    origins = [asdict(origin) for origin in case.origins]
    contacts = []
    for walkers in case.walkers:
        contacts += _contacts(case, walkers)
    summary: dict[str, Any] = {
        "case": {**case.as_dict(), "origins": origins},
        "drive": {
            "peak_acceleration": drive.peak_acceleration,
            "amplitude": drive.amplitude,
            "peak_velocity": drive.peak_velocity,
        },
        "beads": _beads(case),
        "notes": notes(case),
        "contacts": contacts,
        "time_step": _time_step(case),
        "run": _run(case),
    }
    if case.boundary.shape == "vessel":
        summary["vessel"] = _vessel(case)
    if case.walkers and len(case.walkers[0].radii) == 2:
        summary["dimer"] = _dimer(case)
    return summary


def _beads(case: Case) -> dict[str, Any]:
    """Numbers, mass (kg) and volume (m³) of the beads, their liquid (m³), and their softness.

    The last is the reduced over the real Young's modulus; None if the library does not have it.
    """
    volume = _volume(case)
    materials = library_of(case.document).numbers("materials", case.beads.material or "")
    modulus = materials.get("youngs_modulus")
    stiffness_ratio = None
    if modulus is not None:
        real_modulus = parse_quantity(modulus.written, MODULUS)
        stiffness_ratio = case.contact.youngs_modulus / real_modulus
    return {
        "small": case.count - case.large,
        "large": case.large,
        "mass": volume * case.beads.density,
        "volume": volume,
        "liquid": _liquid(case, volume),
        "stiffness_ratio": stiffness_ratio,
    }


def _liquid(case: Case, volume: float) -> float:
    """Volume of the liquid, m³, with the ``volume`` of all beads.

    It is the liquid on all beads, or, if their menisci are given, that in the bridges of the
    walkers.
    """
    if case.liquid.meniscus_radius is None:
        return volume * case.liquid.of_bridges.volume_fraction
    liquid = 0.0
    for walkers in case.walkers:
        for load in contact_loads(case, walkers):
            liquid += load.surfaces.volume * walkers.replicates
    return liquid


def _contacts(case: Case, walkers: Walkers) -> list[dict[str, Any]]:
    """Contacts of a walker at rest: each bead on the substrate, then each pair of beads.

    Bridge volume in m³, forces in N, rupture distance and overlap in m.
    """
    tension = case.liquid.surface_tension
    names = []
    limits: list[float | None] = []
    for bead, radius in enumerate(walkers.radii, 1):
        names.append(f"bead {bead} on substrate")
        limits.append(capillary_force_limit_at_wall(tension, radius))
    for first, second in walkers.pairs:
        names.append(f"bead {second + 1} on bead {first + 1}")
        limits.append(None)
    loads = contact_loads(case, walkers)
    contacts = []
    for name, load, limit in zip(names, loads, limits, strict=True):
        contact = {
            "contact": name,
            "bridge_volume": load.surfaces.volume,
            "capillary_force": load.pull,
            "capillary_force_limit": limit,
            "rupture_distance": load.rupture,
            "overlap_at_rest": load.overlap,
        }
        contacts.append(contact)
    return contacts


def _time_step(case: Case) -> dict[str, Any]:
    """The time step and its limits in s, and the shares of the limits."""
    step = case.run.time_step
    limits: dict[str, float | None] = {}
    shares = {}
    for name, limit in vars(limits_of(case)).items():
        if name == "friction" and not isfinite(limit):
            continue  # friction does not grow with the velocity
        limits[name] = limit if isfinite(limit) else None
        shares[name] = step / limit
    return {
        "step": step,
        "limits": limits,
        "share": shares,
        "auto": dict(recommended_fractions(loose=case.loose)),
    }


def _run(case: Case) -> dict[str, Any]:
    """Length and predicted cost of the run; times in s."""
    run = case.run
    seconds = PROGRAM_SECONDS + predicted_seconds(case) + predicted_overhead([case])
    return {
        "steps_per_cycle": run.steps_per_cycle,
        "steps": run.steps,
        "simulated_seconds": run.steps * run.time_step,
        "samples": run.steps // run.steps_per_sample + 1,
        "until_steady": run.until_steady,
        "segments": -(-run.cycles // run.cycles_per_segment),
        "predicted_seconds": seconds,
    }


def _vessel(case: Case) -> dict[str, Any]:
    """A vessel: its walls, opening, height (m) and volume (m³).

    ``planes`` is the number of planes that are equivalent to the vessel, and 0 if there are none,
    so that its ``triangles`` are the walls. ``triangles_of_file`` may differ: triangles of the mesh
    that are no wall of the inside are left out. ``opening`` is the extent of the opening along x
    and y, m; ``facing`` is the unit vector that points out of it, zero for a closed vessel.
    """
    vessel = case.boundary.vessel
    mesh = case.document.get("meshes", {}).get(case.boundary.mesh or "")
    return {
        "planes": len(case.boundary.planes),
        "triangles": len(vessel.triangles),
        "triangles_of_file": len(mesh["triangles"]) if mesh else None,
        "faces": len(set(vessel.faces.tolist())),
        "open": bool(vessel.rims),
        "opening": list(vessel.opening),
        "facing": vessel.facing.tolist(),
        "height": case.boundary.height,
        "volume": vessel.volume(),
    }


def _dimer(case: Case) -> dict[str, Any]:
    """Masses (kg), mean radius (m) and numbers without a unit of the first walkers of a case.

    They are dimers, or clusters of two beads.
    """
    dimer = dimer_of(case)
    return {
        "total_mass": dimer.total_mass,
        "mean_radius": dimer.mean_radius,
        "sin_delta": dimer.sin_delta,
        "mass_asymmetry": dimer.mass_asymmetry,
        "masses": list(dimer.masses),
        "gamma0": dimer.gamma0(case.excitation.peak_acceleration),
    }


# --- text -----------------------------------------------------------------------------------------


def preview_text(summary: Mapping[str, Any]) -> str:
    """The summary of `summarise` as text, in usual units, in lines that fit the terminal."""
    gravity = summary["case"]["environment"]["gravity"]
    texts = {origin["key"]: origin["text"] for origin in summary["case"]["origins"]}
    paragraphs = [_text_of_beads(summary["beads"])]
    if "vessel" in summary:
        paragraphs.append(_text_of_vessel(summary["vessel"]))
    if "dimer" in summary:
        paragraphs += _text_of_dimer(summary["dimer"], gravity)
    drive = summary["drive"]
    paragraphs.append(_text_of_drive(drive, gravity, in_g=accelerations_in_g(texts)))
    lines = _text_of_case(summary["case"])
    for paragraph in paragraphs:
        lines += wrapped(paragraph, _INDENT)
    if summary["contacts"]:
        lines.append(_text_of_contacts(summary["contacts"]))
    for line in _text_of_time_step(summary["time_step"], summary["run"]["steps_per_cycle"]):
        lines += wrapped(line, _INDENT)
    lines += wrapped(_text_of_run(summary["run"]), _INDENT)
    for note in summary["notes"]:
        lines += wrapped_after("note", f"       {note}", WARNING, _INDENT)
    return "\n".join(lines)


def _text_of_case(case: Mapping[str, Any]) -> list[str]:
    """A resolved case, a line for each value: key, value as in a case file, and origin.

    Sources that do not fit into the lines stand below all values.
    """
    title = printable(f"{case['name']}: {case['title']}").rstrip(": ")
    lines = [styled(line, HEADING) for line in wrapped(title, "  ")]
    footnotes = _Footnotes()
    current_table = None
    for origin in case["origins"]:
        table, _, key = origin["key"].rpartition(".")
        if table != current_table:
            lines.append(styled(f"  [{table}]", HEADING))
            current_table = table
        lines += _lines_of_value(key, origin, footnotes)
    return lines + footnotes.lines()


class _Footnotes:
    """Sources that stand below all values, each once."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def mark_of(self, text: str) -> str:
        """The mark of a source, such as ``[2]``."""
        if text not in self.texts:
            self.texts.append(text)
        return f"[{self.texts.index(text) + 1}]"

    def lines(self) -> list[str]:
        """The sources with their marks."""
        lines = []
        for text in self.texts:
            mark = self.mark_of(text)
            lines += wrapped(f"  {mark:4} {text}", " " * 7)
        return [styled(line, ASIDE) for line in lines]


def _lines_of_value(key: str, origin: Mapping[str, Any], footnotes: _Footnotes) -> list[str]:
    """The lines of a value; its source is a footnote if it does not fit into the first one."""
    value = with_symbols(str(origin["text"]))
    line = f"    {key:{_KEY_WIDTH}} {value:{_VALUE_WIDTH}}  "
    space = text_width() - len(line)
    text = _origin_text(origin)
    if len(text) <= space:
        return [line + text]
    source = str(origin["source"])
    if source:
        text = _origin_text({**origin, "source": ""}, footnotes.mark_of(source))
        if len(text) <= space:
            return [line + text]
    indent = " " * (4 + _KEY_WIDTH + 1)
    return [line.rstrip(), *wrapped(indent + text, indent)]


def _origin_text(origin: Mapping[str, Any], mark: str = "") -> str:
    """Origin of a value as text, such as ``library: …`` or ``guessed (not measured), …``.

    Parameters
    ----------
    origin
        The origin. Both ends of a range are texts, as in a case file.
    mark
        Mark of the footnote that has the source; empty if the source is in the text.
    """
    kind = str(origin["origin"])
    source = str(origin["source"])
    limits = ""
    if origin["range"]:
        low, high = origin["range"]
        limits = with_symbols(f"range {low} to {high}")
    # A default with a range that the case does not declare in [uncertain]: nobody measured it, and
    # the range is that of all materials.
    if kind == "default" and limits and not origin["uncertain"]:
        return f"guessed ({source or mark or 'not measured'}), general {limits}"
    if source and kind in ("calibrated", "assumed"):  # their sources begin with this word
        text = source
    elif source:
        text = f"{kind}: {source}"
    else:
        text = f"{kind} {mark}".rstrip()
    if origin["uncertain"]:
        text += ", uncertain"
    if limits:
        text += f", {limits}"
    return text


def _text_of_beads(beads: Mapping[str, Any]) -> str:
    """Numbers, mass, volume and liquid of the beads, and how much softer than real they are."""
    numbers = f"{beads['small']} small and {beads['large']} large, {beads['mass'] * 1e6:.4g} mg"
    volumes = f"{beads['volume'] * 1e9:.4g} µL with {beads['liquid'] * 1e9:.3g} µL of liquid"
    text = f"beads      {numbers}, {volumes}"
    ratio = beads["stiffness_ratio"]
    if ratio and ratio < 1:
        factor = _two_digits(1.0 / ratio)
        text += f"; Young's modulus of the beads reduced by a factor of {factor}"
    return text


def _text_of_vessel(vessel: Mapping[str, Any]) -> str:
    """Walls, opening, height and volume of a vessel, from the numbers of `_vessel`."""
    if vessel["planes"]:
        walls = counted(vessel["planes"], "plane")
    else:
        walls = f"{counted(vessel['triangles'], 'triangle')} in {counted(vessel['faces'], 'face')}"
    triangles_of_file = vessel["triangles_of_file"]
    if triangles_of_file is not None and triangles_of_file != vessel["triangles"]:
        walls += f" (the mesh has {triangles_of_file} triangles)"
    height = f"{1e3 * vessel['height']:.4g} mm high"
    volume = f"{1e6 * vessel['volume']:.3g} cm³"
    if not vessel["open"]:
        within = "beads are within this surface"
        return f"vessel     {walls}, closed: {within}, {height}, {volume} inside"
    x, y = (f"{1e3 * extent:.3g}" for extent in vessel["opening"])
    opening = f"open toward +z, {x} mm × {y} mm wide"
    tilt = degrees(acos(min(1.0, vessel["facing"][2])))
    if tilt > _OBLIQUE:
        opening += f", oblique by {tilt:.2g}°"
    return f"vessel     {walls}, {opening}, {height}, {volume}"


def _text_of_dimer(dimer: Mapping[str, Any], gravity: float) -> list[str]:
    """Mass, weight, geometry and Γ0 of a dimer."""
    mass = dimer["total_mass"]
    parts = [
        f"M = {mass * 1e6:.4g} mg",
        f"weight {mass * gravity * 1e6:.4g} µN",
        f"mean radius {dimer['mean_radius'] * 1e3:.4g} mm",
        f"sin δ = {dimer['sin_delta']:.4g}",
        f"mass asymmetry (m1 - m2)/M = {dimer['mass_asymmetry']:.4g}",
        f"Γ0 = {dimer['gamma0']:.4g}",
    ]
    lines = [f"dimer      {', '.join(parts)}"]
    if dimer["sin_delta"] < 0:
        lines.append("           bead 1 is the smaller bead")
    return lines


def _text_of_drive(drive: Mapping[str, Any], gravity: float, *, in_g: bool) -> str:
    """Peak acceleration, in g or m/s², amplitude and peak velocity of the walls."""
    acceleration = f"a0 = {drive['peak_acceleration']:.4g} m/s²"
    if in_g:
        acceleration = (
            f"a0 = {drive['peak_acceleration'] / ACCELERATION_OF_ONE_G:.4g} g "
            f"(g = {ACCELERATION_OF_ONE_G:g} m/s², as in the paper; gravity is {gravity:g} m/s²)"
        )
    amplitude = f"amplitude {drive['amplitude'] * 1e3:.4g} mm"
    velocity = f"peak velocity {drive['peak_velocity'] * 1e3:.4g} mm/s"
    return f"drive      {acceleration}, {amplitude}, {velocity}"


def _text_of_contacts(contacts: list[Mapping[str, Any]]) -> str:
    """A table of the contacts of walkers at rest."""
    heads = [
        "contact",
        "capillary force",
        "4πγR of a plane",
        "bridge volume",
        "rupture gap",
        "overlap at rest",
    ]
    rows = [heads]
    for contact in contacts:
        limit = contact["capillary_force_limit"]
        cells = [
            f"  {contact['contact']}",
            f"{contact['capillary_force'] * 1e6:.4g} µN",
            f"{limit * 1e6:.4g} µN" if limit else "-",
            f"{contact['bridge_volume'] * 1e12:.3g} nL",
            f"{contact['rupture_distance'] * 1e6:.3g} µm",
            f"{contact['overlap_at_rest'] * 1e9:.4g} nm",
        ]
        rows.append(cells)
    return aligned_blocks(rows, table_width(), right=range(1, len(heads)))


def _text_of_time_step(time_step: Mapping[str, Any], steps_per_cycle: int) -> list[str]:
    """The time step against its limits."""
    lines = [f"time step  {time_step['step'] * 1e6:.5g} µs, {steps_per_cycle} per cycle"]
    for name, limit in time_step["limits"].items():
        limit_text = "none" if limit is None else f"{limit * 1e6:.4g} µs"
        share = f"{time_step['share'][name]:.3f} of it"
        auto = f'"auto": at most {time_step["auto"][name]:g}'
        lines.append(f"  {name:10} limit {limit_text:>10}; time step = {share} ({auto})")
    return lines


def _text_of_run(run: Mapping[str, Any]) -> str:
    """The length of the run and its cost."""
    length = f"{run['steps']} steps, {run['simulated_seconds']:.4g} s simulated"
    if run["segments"] > 1:
        length += f" in {run['segments']} segments"
    length += f", {run['samples']} samples"
    if run["until_steady"]:
        end = f"ends when the velocity is constant within {percent(CONSTANT)}"
        length = f"at most {length}; {end}"
    seconds = run["predicted_seconds"]
    cost = f"{seconds:.1f} s"
    if seconds >= _LONGEST_IN_SECONDS:
        cost = f"{seconds / 60.0:.1f} min"
    return f"run        {length}; predicted run time {cost}"
