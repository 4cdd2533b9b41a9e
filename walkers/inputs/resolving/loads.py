"""Loads of the contacts of beads at rest, and how far walkers move from their starts.

The laws themselves are in `walkers.physics`: here they are applied to the beads of a case.

*Loose beads* belong to no walker: they are placed one by one, or poured as a mixture. The *delay*
of a contact is the phase (rad) by which its overlap lags behind a changing load, because the bridge
damps it (`delay_of_walkers`). It grows with the softness of the beads.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import combinations_with_replacement
from math import inf, pi
from typing import NamedTuple

import numpy as np

from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Case, Setup
from walkers.physics.bridge import BridgeLaw, Surfaces
from walkers.physics.capillary import bead_volume, largest_normal
from walkers.physics.contact import hertz_overlap, hertz_stiffness, reduced_modulus
from walkers.physics.dimer import Dimer

DELAY_LIMIT = 0.025
"""Delay of contacts, rad, up to which velocities are within 2 % of those of rigid beads."""
_NOTICED_DELAY = 0.1
"""Smallest delay of loose beads at which a result warns of their softness, rad."""
_MEASURED_DELAYS = (0.0, 0.13, 0.34, 1.5, 3.8)
"""Delays of the shipped climbers, rad: none of rigid beads; then with glycerol 87 % at 200 and
50 MPa, and with glycerol at 200 and 50 MPa."""
_MEASURED_ERRORS = (0.0, 0.03, 0.09, 0.15, 1.3)
"""Relative errors of the speed of climbing at these delays: the largest for a diamond, a dimer
and a cluster in a corner, compared with beads of 12.8 GPa. At the last delay, the dimer goes
down."""
_SPHERE = 3.5
"""Acceleration of the surface of a sphere by a tangential force, over that of its centre."""
_LARGEST_SPEED = 0.3
"""Speed of walkers for which there is space, over the peak velocity of the substrate.

Walkers move at a few per cent of this velocity; the fastest that was seen, at Γ0 = 0.76 and
friction 0.5, at 0.14 of it. The rest is for walkers that hop, and for those that turn aside."""


class Load(NamedTuple):
    """A contact at rest.

    Attributes
    ----------
    surfaces
        The two surfaces, and the bridge between them.
    pull
        Capillary force of the bridge, N; negative if it pushes.
    rupture
        Rupture distance of the bridge, m.
    overlap
        Overlap of the surfaces, m.
    """

    surfaces: Surfaces
    pull: float
    rupture: float
    overlap: float = 0.0


def dimer_of(case: Setup) -> Dimer:
    """The dimer of a case; raises `ValueError` unless its first walkers are dimers."""
    if not case.walkers or len(case.walkers[0].radii) != 2:
        raise ValueError("bodies: expected dimers; the theory is for dimers only")
    front, back = case.walkers[0].radii
    return Dimer((front, back), case.beads.density, case.liquid.surface_tension)


def surfaces_of(case: Setup, radius: float, other_radius: float) -> Surfaces:
    """A bead of a case and another bead or a plane, with the bridge between them.

    Parameters
    ----------
    case
        The case.
    radius
        Radius of the bead, m.
    other_radius
        Radius of the other bead, m; infinite for a plane.
    """
    return Surfaces.between(radius, other_radius, case.liquid.of_bridges, case.contact.roughness)


def bridge_at_rest(case: Setup, radius: float, other_radius: float) -> Load:
    """The bridge of a case between surfaces that touch; radii as for `surfaces_of`, m."""
    return _bridge_in_contact(case.law, surfaces_of(case, radius, other_radius))


@lru_cache(maxsize=1024)  # points of a sweep have the same few bridges
def _bridge_in_contact(law: BridgeLaw, surfaces: Surfaces) -> Load:
    """The bridge of a law between surfaces that touch, without overlap."""
    curve = law(surfaces)
    gap = np.zeros(1)
    pull = curve.pull(gap) if curve.pull else curve.forces(gap).pull
    return Load(surfaces, float(pull[0]), curve.rupture)


def friction_rate(case: Setup, bridged: Iterable[tuple[float, Sequence[float]]]) -> float:
    """The rate of the friction limit of the time step (`walkers.physics.time_step`).

    Parameters
    ----------
    case
        The case.
    bridged
        Beads that touch the boundary, with the radius of each and the radii of the beads that it
        touches, m.

    Returns
    -------
    float
        Σ(7/2 μ'N/m) of the bead for which it is largest, 1/s; 0 if no friction grows with the
        velocity. Loads are those of a bead alone, without beads above it.
    """
    friction = case.contact.friction
    if not friction.grows:
        return 0.0
    at_walls = friction.at_walls.slope
    between_beads = friction.between_beads.slope
    acceleration = case.environment.gravity + case.excitation.peak_acceleration
    largest = 0.0
    damping = case.boundary.geometry.damping
    for radius, neighbours in bridged:
        walls = damping(radius)
        mass = bead_volume(radius) * case.beads.density
        load = max(bridge_at_rest(case, radius, inf).pull, 0.0) + mass * acceleration
        rate = walls * at_walls * load / mass
        for neighbour in neighbours:
            neighbour_mass = bead_volume(neighbour) * case.beads.density
            load = max(bridge_at_rest(case, radius, neighbour).pull, 0.0) + mass * acceleration
            rate += between_beads * load * (1.0 / mass + 1.0 / neighbour_mass)
        largest = max(largest, rate)
    return _SPHERE * largest


def resistances_at_rest(
    case: Setup, radius: float, other_radius: float
) -> tuple[float, float, float]:
    """Resistances of the bridge between surfaces that touch.

    Parameters
    ----------
    case, radius, other_radius
        As for `surfaces_of`. The smaller bead, or the bead at a plane, is body 1
        (`walkers.physics.bridge`).

    Returns
    -------
    sliding : float
        S, N s/m.
    coupling : float
        C, N s.
    rolling : float
        Q, N m s.
    """
    forces = case.law(surfaces_of(case, radius, other_radius)).forces(np.zeros(1))
    _, _, sliding, coupling, rolling = forces.columns()[0]
    return float(sliding), float(coupling), float(rolling)


def softness_warning(case: Setup) -> str | None:
    """How far the delay of contacts changes the speeds of the loose beads of a case.

    Returns
    -------
    str or None
        A sentence; None for a delay below 0.1 rad.
    """
    delay = delay_of_loose_beads(case)
    if delay < _NOTICED_DELAY:
        return None
    problem = f"soft beads: bridges delay contacts by {delay:.2g} rad"
    if delay > _MEASURED_DELAYS[-1]:
        error = "wrong, even in their direction (set a higher contact.youngs_modulus)"
    else:
        percentage = 100.0 * float(np.interp(delay, _MEASURED_DELAYS, _MEASURED_ERRORS))
        error = f"up to {percentage:.0f} % off those of hard beads (contact.youngs_modulus)"
    return f"{problem}; the speeds of climbing clusters are then {error}"


def largest_delay(case: Setup) -> float:
    """The largest phase by which bridges delay any contact of walkers or loose beads, rad."""
    delays = [delay_of_walkers(case, walkers) for walkers in case.walkers]
    delays.append(delay_of_loose_beads(case))
    return max(delays)


def delay_of_walkers(case: Setup, walkers: Walkers) -> float:
    """The largest phase by which bridges delay the contacts of walkers, ωN/k, rad.

    A bridge damps its contact with the normal resistance N, so a contact of stiffness k lags
    behind a changing load by the time N/k. Friction is limited by the elastic force, and lags as
    much.

    Velocities differ from those of rigid beads by about 0.7 of this phase, and sliding by 2.5 of it
    (Figs. 2, 4a and 4b, up to 3.2 GPa).
    """
    return _delay_of_contacts(case, contact_loads(case, walkers))


def delay_of_loose_beads(case: Setup) -> float:
    """The same phase for the placed beads and the mixture of a case, rad.

    It is the largest of any two beads, and of a bead at a wall. The contacts are loaded by their
    bridges alone, as at an upright wall.
    """
    return _delay_of_contacts(case, _loads_of_loose_beads(case))


def _loads_of_loose_beads(case: Setup) -> list[Load]:
    """Contacts of each radius of the placed beads and the mixture with the wall and each radius."""
    radii = {bead.radius for bead in case.placed}
    if case.mixture is not None:
        radii.update(case.mixture.small_radii, case.mixture.large_radii)
    loads = []
    for radius, other_radius in combinations_with_replacement([*sorted(radii), inf], 2):
        if radius < inf:
            loads.append(_with_overlap(case, bridge_at_rest(case, radius, other_radius)))
    return loads


def _with_overlap(case: Setup, bridge: Load, weight: float = 0.0) -> Load:
    """A bridge with the overlap at which repulsion balances its force and a weight (N)."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    overlap = hertz_overlap(bridge.pull + weight, bridge.surfaces.reduced_radius, modulus)
    return bridge._replace(overlap=overlap)


def _delay_of_contacts(case: Setup, loads: Iterable[Load]) -> float:
    """The largest 2πfN/k of contacts, rad; contacts without a load have none."""
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    longest = 0.0  # s
    for load in loads:
        if load.overlap:
            surfaces = load.surfaces
            radius = surfaces.reduced_radius
            resistance = largest_normal(radius, surfaces.roughness, surfaces.liquid)
            stiffness = hertz_stiffness(load.overlap, radius, modulus)
            longest = max(longest, resistance / stiffness)
    return 2.0 * pi * case.excitation.fastest * longest


def contact_loads(case: Setup, walkers: Walkers | None = None) -> list[Load]:
    """The contacts of a walker at rest.

    Parameters
    ----------
    case
        The case.
    walkers
        The kind of the walker; the first one of the case if None.

    Returns
    -------
    list of Load
        The contact of each bead with the substrate, then that of each pair of beads.
    """
    kind = walkers or case.walkers[0]
    density = case.beads.density
    gravity = case.pressing_gravity
    loads = []
    for radius in kind.radii:
        weight = bead_volume(radius) * density * gravity
        loads.append(_with_overlap(case, bridge_at_rest(case, radius, inf), weight))
    for first, second in kind.pairs:
        bridge = bridge_at_rest(case, kind.radii[first], kind.radii[second])
        loads.append(_with_overlap(case, bridge))
    return loads


def path_length(case: Case) -> float:
    """Distance from its start within which a walker of a case stays, m (`longest_path`)."""
    longest = max((walkers.length for walkers in case.walkers), default=0.0)
    return longest_path(case.excitation.peak_velocity, case.duration, longest)


def longest_path(peak_velocity: float, duration: float, length: float) -> float:
    """Distance from their starts within which walkers stay, also those that hop, m.

    Parameters
    ----------
    peak_velocity
        Peak velocity of the substrate, m/s.
    duration
        Duration of the drive, s.
    length
        Length of the longest walker, m.
    """
    return _LARGEST_SPEED * peak_velocity * duration + 2.0 * length


def hop_height(case: Case) -> float:
    """Height that a bead thrown up at twice the peak velocity of the substrate reaches, m.

    It is at most `path_length`, which is its value without gravity.
    """
    if case.pressing_gravity <= 0.0:
        return path_length(case)
    speed = 2.0 * case.excitation.peak_velocity
    return min(speed**2 / (2.0 * case.pressing_gravity), path_length(case))
