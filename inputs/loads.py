"""What the contacts of a walker carry at rest, and the room that walkers need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import TYPE_CHECKING

from walkers.physics import capillary
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.physics.dimer import Dimer

if TYPE_CHECKING:
    from walkers.inputs.bodies import Walkers
    from walkers.inputs.case import Case


def dimer_of(case: Case) -> Dimer:
    """The dimer of a case whose first walkers are such.

    Raises
    ------
    ValueError
        If they are not.
    """
    radii = case.walkers[0].radii if case.walkers else ()
    if len(radii) != 2:
        raise ValueError("bodies: expected dimers")
    return Dimer((radii[0], radii[1]), case.density, case.liquid.surface_tension)


@dataclass(frozen=True)
class ContactLoads:
    """Forces and overlaps at the contacts of a walker at rest: its beads on the floor, then its pairs of beads.

    ``capillary`` in N, ``bridge_volumes`` in m³, ``rupture`` and ``overlaps`` in m, each in that order.
    """

    bridge_volumes: tuple[float, ...]
    capillary: tuple[float, ...]
    rupture: tuple[float, ...]
    overlaps: tuple[float, ...]


@lru_cache(maxsize=16)  # asked for at every stage of a deck
def contact_loads(case: Case, walkers: Walkers | None = None) -> ContactLoads:
    """Capillary load of each contact of a case's first (or other) walkers, and the overlap at which it is carried."""
    walkers = walkers or case.walkers[0]
    liquid, radii = case.liquid, walkers.radii
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    volumes, forces, overlaps = [], [], []
    for radius in radii:
        volumes.append(capillary.bridge_volume_at_wall(radius, liquid.volume_fraction))
        forces.append(
            capillary.capillary_force_at_wall(liquid.surface_tension, radius, volumes[-1], liquid.contact_angle)
        )
        weight = 4.0 / 3.0 * pi * radius**3 * case.density * case.pressing_gravity
        overlaps.append(hertz_overlap(forces[-1] + weight, radius, modulus))
    for one, other in walkers.pairs:
        pair = (radii[one], radii[other])
        volumes.append(capillary.bridge_volume_between_beads(*pair, liquid.volume_fraction))
        forces.append(capillary.capillary_force(liquid.surface_tension, *pair, volumes[-1], liquid.contact_angle))
        overlaps.append(hertz_overlap(forces[-1], pair[0] * pair[1] / sum(pair), modulus))
    rupture = tuple(capillary.rupture_distance(volume, liquid.contact_angle) for volume in volumes)
    return ContactLoads(tuple(volumes), tuple(forces), rupture, tuple(overlaps))


def reach(case: Case) -> float:
    """How far from its start a walker is given room to go, m.

    Walkers move at a few per cent of the substrate's peak velocity (0.14 of it was the fastest seen, at Γ0 = 0.76
    and friction 0.5); 0.3 of it through the whole run leaves room for those that hop, and sideways as well.
    """
    duration = case.run.cycles / case.drive.frequency
    longest = max((walkers.length for walkers in case.walkers), default=0.0)
    return 0.3 * case.drive.peak_velocity * duration + 2.0 * longest


def hop_height(case: Case) -> float:
    """Height that a bead thrown up at twice the substrate's peak velocity reaches, m (its reach without gravity)."""
    if case.pressing_gravity <= 0.0:
        return reach(case)
    return min((2.0 * case.drive.peak_velocity) ** 2 / (2.0 * case.pressing_gravity), reach(case))
