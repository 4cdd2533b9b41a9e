"""Warnings about cases that can be run, but for which the model does not hold or a unit is wrong.

What cannot be run is refused where it is resolved. Warnings about recorded shaking are in
`walkers.inputs.records.record`.
"""

from __future__ import annotations

from math import inf, sin, sqrt

from walkers.inputs.resolving.loads import bridge_at_rest
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case, Setup
from walkers.physics.capillary import bead_volume
from walkers.rounding import counted

FASTEST_USUAL_DRIVE = 1e3
"""Highest frequency of a drive without a warning, Hz. Published walkers are shaken at 40 to 200
Hz."""
WIDEST_USUAL_DRIVE = 0.1
"""Largest amplitude of a drive without a warning, m: about four times that of large shakers."""


def implausible(case: Case) -> list[str]:
    """Warnings about the beads and the drive of a case: sentences, none for a usual case."""
    return [*gravity_warnings(case), *drive_warnings(case)]


# --- beads ----------------------------------------------------------------------------------------


def gravity_warnings(case: Setup) -> list[str]:
    """Warnings about bridges of beads that are large or heavy.

    The bridge laws leave out gravity. It deforms menisci as large as the capillary length
    √(γ/ρg), which the bridges of larger beads can be. The liquid does not hold a bead that is
    heavier than the capillary force of its bridge to a plane, nor a chain of beads that is heavier
    than that of the bridge from which it hangs.

    Returns
    -------
    list of str
        Sentences; none for small beads, without liquid or without gravity.
    """
    gravity = case.environment.gravity
    if gravity <= 0.0:
        return []
    radius = max(case.radii)
    pull = bridge_at_rest(case, radius, inf).pull
    if pull <= 0.0:  # without liquid
        return []
    warnings = []
    beads = f"beads of R = {1e3 * radius:.3g} mm"
    liquid = case.liquid
    if liquid.density:
        length = sqrt(liquid.surface_tension / (liquid.density * gravity))
        if radius > length:
            warnings.append(
                f"{beads} exceed the capillary length of the liquid, {1e3 * length:.2g} mm: "
                "gravity deforms their menisci, which the bridge laws leave out"
            )
    weight = _weight(case, radius)
    if weight > pull:
        times = f"{weight / pull:.2g} times the pull of their bridge to a plane"
        warnings.append(f"{beads} weigh {times}: the liquid does not hold them")
    elif case.loose:
        pull_of_bead = bridge_at_rest(case, radius, radius).pull
        if weight > pull_of_bead:
            times = f"{weight / pull_of_bead:.2g} times the pull of a bridge between two of them"
            warnings.append(f"{beads} weigh {times}: none hangs from another")
    for walkers in case.walkers:
        warnings += _hanging_chain_warnings(case, walkers)
    return warnings


def _weight(case: Setup, radius: float) -> float:
    """Weight of a bead of a radius (m), N."""
    return bead_volume(radius) * case.beads.density * case.environment.gravity


def _hanging_chain_warnings(case: Setup, walkers: Walkers) -> list[str]:
    """A warning if walkers on a slope cannot hang from one of their beads; empty on level floors.

    They hang from a bead if all others have lost the wall. The weakest bridge between two beads
    then carries the component of their weight along the slope; the lightest bead is the one that
    holds in the worst case.
    """
    slope = sin(case.boundary.tilt)
    pairs = [(walkers.radii[first], walkers.radii[second]) for first, second in walkers.pairs]
    if slope <= 0.0 or not pairs:
        return []
    weights = [_weight(case, radius) for radius in walkers.radii]
    load = slope * (sum(weights) - min(weights))
    weakest = min(bridge_at_rest(case, *pair).pull for pair in pairs)
    if not 0.0 < weakest < load:
        return []
    times = f"{load / weakest:.2g} times the pull of a bridge between two of its beads"
    return [
        "a walker on this slope does not hang from one of its beads: the weight of the others "
        f"along the slope is {times}"
    ]


# --- drive ----------------------------------------------------------------------------------------


def drive_warnings(case: Case) -> list[str]:
    """Warnings about a frequency or an amplitude that no shaker has, so that a unit may be wrong.

    Returns
    -------
    list of str
        Sentences; none for a usual drive, and none for a record, which has its own
        (`Record.notes <walkers.inputs.records.record.Record.notes>`).
    """
    drive = case.excitation
    if drive.record:
        return []
    warnings = []
    frequency = _frequency_text(drive.fastest)
    amplitude = _length_text(drive.amplitude)
    if drive.fastest > FASTEST_USUAL_DRIVE:
        step = f"a time step of {1e6 * case.run.time_step:.2g} us"
        cycle = f"{1e3 * case.duration:.3g} ms of shaking in {counted(case.run.cycles, 'cycle')}"
        warnings.append(
            f"the drive has {frequency}, an amplitude of {amplitude}, {step} and {cycle}: "
            "is the unit of the frequency right, kHz or Hz?"
        )
    roughness = case.contact.roughness.bead_wall
    if 0.0 < drive.amplitude < roughness:
        warnings.append(
            f"the boundary moves by {amplitude} to either side, less than the roughness of the "
            f"surfaces, {_length_text(roughness)}: the laws of contacts do not resolve this "
            f"({frequency}, {drive.peak_acceleration:.3g} m/s²)"
        )
    if drive.amplitude > WIDEST_USUAL_DRIVE:
        warnings.append(
            f"the boundary moves by {amplitude} to either side at {frequency}, farther than "
            "shakers do: is the unit of the frequency right, Hz or kHz?"
        )
    return warnings


def _frequency_text(frequency: float) -> str:
    """A frequency (Hz) as text."""
    if frequency >= 1e6:
        return f"{1e-6 * frequency:.4g} MHz"
    if frequency >= 1e3:
        return f"{1e-3 * frequency:.4g} kHz"
    return f"{frequency:.4g} Hz"


def _length_text(length: float) -> str:
    """A length (m) as text, in a unit from nm to m."""
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
        if length >= 0.1 * size:
            return f"{length / size:.3g} {unit}"
    return f"{1e9 * length:.3g} nm"
