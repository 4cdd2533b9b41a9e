"""Loads of the contacts of a walker at rest, and the room that walkers need."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import combinations_with_replacement
from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case, Setup
from walkers.physics.bridge import BridgeLaw, Surfaces
from walkers.physics.capillary import bead_volume, largest_normal
from walkers.physics.contact import hertz_overlap, hertz_stiffness, reduced_modulus
from walkers.physics.dimer import Dimer


def dimer_of(case: Setup) -> Dimer:
    """The dimer of a case; raises `ValueError` unless its first walkers are dimers."""
    radii = case.walkers[0].radii if case.walkers else ()
    if len(radii) != 2:
        raise ValueError("bodies: expected dimers; the theory is for dimers only")
    return Dimer((radii[0], radii[1]), case.beads.density, case.liquid.surface_tension)


class Load(NamedTuple):
    """A contact at rest: its surfaces, pull (N) and rupture distance (m) of its bridge, and the overlap (m)."""

    surfaces: Surfaces
    pull: float
    rupture: float
    overlap: float = 0.0


def bridge_at_rest(case: Setup, radius: float, other_radius: float) -> Load:
    """The bridge of a bead to another, or to a plane (a radius of infinity), by the case's law; radii in m."""
    return _at_rest(case.law, surfaces_of(case, radius, other_radius))


def surfaces_of(case: Setup, radius: float, other_radius: float) -> Surfaces:
    """A bead of a case and another bead or a plane (a radius of infinity), with a bridge between them; radii in m."""
    return Surfaces.between(radius, other_radius, case.liquid.of_bridges, case.contact.roughness)


@lru_cache(maxsize=1024)  # points of a sweep have the same few bridges
def _at_rest(law: BridgeLaw, surfaces: Surfaces) -> Load:
    curve = law(surfaces)
    touching = np.zeros(1)
    pull = curve.pull(touching) if curve.pull else curve.forces(touching).pull
    return Load(surfaces, float(pull[0]), curve.rupture)


def resistances_at_rest(
    case: Setup, radius: float, other_radius: float
) -> tuple[float, float, float]:
    """S (N s/m), C (N s) and Q (N m s) of that bridge, the smaller bead as body 1 (`walkers.physics.bridge`)."""
    touching = case.law(surfaces_of(case, radius, other_radius)).forces(np.zeros(1))
    _, _, sliding, coupling, rolling = map(float, touching.columns()[0])
    return sliding, coupling, rolling


LARGEST_DELAY = 0.025
"""Largest delay of contacts by bridges, rad, at which velocities are within 2 % of those of rigid beads."""


_NOTICED_DELAY = 0.1
"""Smallest delay of loose beads at which a result warns of their softness, rad."""
_MEASURED_DELAYS = (0.0, 0.13, 0.34, 1.5, 3.8)
"""Delays of the shipped climbers, rad: with glycerol 87 % at 200 and 50 MPa, with glycerol at 200 and 50 MPa."""
_MEASURED_ERRORS = (0.0, 0.03, 0.09, 0.15, 1.3)
"""The largest share by which one of them (diamond, dimer, cluster in a corner) then climbs faster or
more slowly than with beads of 12.8 GPa. At the last one, the dimer goes down."""


def softness_warning(case: Setup) -> str | None:
    """How far the delay of contacts changes the speeds of the loose beads of a case.

    None below `_NOTICED_DELAY`.
    """
    phase = delay_of_loose_beads(case)
    if phase < _NOTICED_DELAY:
        return None
    soft = f"soft beads: bridges delay contacts by {phase:.2g} rad; the speeds of climbing clusters are then"
    if phase > _MEASURED_DELAYS[-1]:
        return f"{soft} wrong, even in their direction (set a higher contact.youngs_modulus)"
    error = 100.0 * float(np.interp(phase, _MEASURED_DELAYS, _MEASURED_ERRORS))
    return f"{soft} up to {error:.0f} % off those of hard beads (contact.youngs_modulus)"


def gravity_warnings(case: Setup) -> list[str]:
    """What is doubtful about bridges of beads that are large or heavy; empty for small beads or without gravity.

    The bridge laws leave out gravity. It deforms menisci as large as the capillary length √(γ/ρg), which the bridges of
    larger beads can be. A bead that is heavier than the pull of its bridge to a plane is not held by the liquid.
    """
    gravity = case.environment.gravity
    if gravity <= 0.0:
        return []
    radius, liquid = max(case.radii), case.liquid
    pull = bridge_at_rest(case, radius, inf).pull
    if pull <= 0.0:  # without liquid
        return []
    warnings = []
    beads = f"beads of R = {1e3 * radius:.3g} mm"
    if liquid.density:
        length = sqrt(liquid.surface_tension / (liquid.density * gravity))
        if radius > length:
            warnings.append(
                f"{beads} exceed the capillary length of the liquid, {1e3 * length:.2g} mm: "
                "gravity deforms their menisci, which the bridge laws leave out"
            )
    weight = bead_volume(radius) * case.beads.density * gravity
    if weight > pull:
        times = f"{weight / pull:.2g} times the pull of their bridge to a plane"
        warnings.append(f"{beads} weigh {times}: the liquid does not hold them")
    return warnings


def delay_of(case: Setup) -> float:
    """The largest phase by which bridges delay any contact of a case, rad: of its walkers and of its loose beads."""
    return max([delay_of_loose_beads(case), *(delay(case, walkers) for walkers in case.walkers)])


def delay(case: Setup, walkers: Walkers) -> float:
    """Phase by which bridges delay the contacts of walkers in the drive, ωN/k, rad.

    A contact of stiffness k, loaded by its bridge and weight, follows a changing load with the time constant N/k of the
    bridge's normal resistance N. Friction is limited by the elastic force, and follows as late. Velocities differ from
    those of rigid beads by about 0.7 of this phase, and sliding by 2.5 (Figs. 2, 4a and 4b, up to 3.2 GPa).
    """
    return _largest_delay(case, contact_loads(case, walkers))


def delay_of_loose_beads(case: Setup) -> float:
    """The same phase for the placed beads and the mixture of a case, rad: the largest of any two beads or a wall.

    The contacts are loaded by their bridges alone, as at an upright wall.
    """
    return _largest_delay(case, _loads_of_loose_beads(case))


def _loads_of_loose_beads(case: Setup) -> list[Load]:
    """Contacts of each radius of the placed beads and the mixture with the wall and with each other radius."""
    radii = {bead.radius for bead in case.placed}
    if case.mixture is not None:
        radii |= {*case.mixture.small_radii, *case.mixture.large_radii}
    pairs = combinations_with_replacement([*sorted(radii), inf], 2)
    return [
        _with_overlap(case, bridge_at_rest(case, *pair)) for pair in pairs if pair != (inf, inf)
    ]


def _with_overlap(case: Setup, bridge: Load, weight: float = 0.0) -> Load:
    """A bridge with the overlap at which the repulsion balances its pull and a weight, N."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    return bridge._replace(
        overlap=hertz_overlap(bridge.pull + weight, bridge.surfaces.reduced_radius, modulus)
    )


def _largest_delay(case: Setup, loads: Iterable[Load]) -> float:
    """The largest 2πfN/k of contacts, rad; contacts without a load have none."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    longest = 0.0
    for load in loads:
        if load.overlap:
            radius = load.surfaces.reduced_radius
            resistance = largest_normal(radius, load.surfaces.roughness, load.surfaces.liquid)
            longest = max(longest, resistance / hertz_stiffness(load.overlap, radius, modulus))
    return 2.0 * pi * case.excitation.fastest * longest


def contact_loads(case: Setup, walkers: Walkers | None = None) -> list[Load]:
    """The contacts of a case's first (or other) walkers at rest: each bead on the floor, then each pair of beads."""
    make = walkers or case.walkers[0]
    density, gravity = case.beads.density, case.pressing_gravity
    held = [(radius, inf, bead_volume(radius) * density * gravity) for radius in make.radii]
    loads = []
    pairs = [(make.radii[first], make.radii[second], 0.0) for first, second in make.pairs]
    for radius, other_radius, weight in [*held, *pairs]:
        loads.append(_with_overlap(case, bridge_at_rest(case, radius, other_radius), weight))
    return loads


def path_length(case: Case) -> float:
    """Room around the start of a walker, m (`room_of_paths`)."""
    longest = max((walkers.length for walkers in case.walkers), default=0.0)
    return room_of_paths(case.excitation.peak_velocity, case.duration, longest)


def room_of_paths(peak_velocity: float, duration: float, longest: float) -> float:
    """Room around the start of walkers, m.

    Walkers move at a few per cent of the substrate's peak velocity (0.14 of it was the fastest seen, at Γ0 = 0.76
    and friction 0.5); 0.3 of it through the whole run leaves room for those that hop, and sideways as well.

    Parameters
    ----------
    peak_velocity
        Peak velocity of the substrate, m/s.
    duration
        Duration of the drive, s.
    longest
        Length of the longest walker, m.
    """
    return 0.3 * peak_velocity * duration + 2.0 * longest


def hop_height(case: Case) -> float:
    """Height that a bead thrown up at twice the substrate's peak velocity reaches, m (its reach without gravity)."""
    if case.pressing_gravity <= 0.0:
        return path_length(case)
    return min(
        (2.0 * case.excitation.peak_velocity) ** 2 / (2.0 * case.pressing_gravity),
        path_length(case),
    )
