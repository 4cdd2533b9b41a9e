"""What follows from a case's two beads: loads at rest, and the room that they need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt

from walkers.inputs.case import WalkerCase
from walkers.physics import capillary
from walkers.physics.contact import hertz_overlap, hertz_overlap_at_wall, reduced_modulus
from walkers.physics.dimer import Dimer


def dimer_of(case: WalkerCase) -> Dimer:
    """The dimer of a case."""
    return Dimer(case.beads.radii, case.beads.density, case.liquid.surface_tension)


@dataclass(frozen=True)
class ContactLoads:
    """Forces and overlaps at the contacts of a dimer at rest: bead 1 and 2 on the substrate, bead on bead.

    ``capillary`` in N, ``bridge_volumes`` in m³, ``rupture`` and ``overlaps`` in m, each in that order.
    """

    bridge_volumes: tuple[float, float, float]
    capillary: tuple[float, float, float]
    rupture: tuple[float, float, float]
    overlaps: tuple[float, float, float]


@lru_cache(maxsize=16)  # asked for at every stage of a deck
def contact_loads(case: WalkerCase) -> ContactLoads:
    """Capillary load of each contact and the overlap at which the Hertz force carries it."""
    liquid, radii = case.liquid, case.beads.radii
    dimer = dimer_of(case)
    at_wall = [capillary.bridge_volume_at_wall(radius, liquid.volume_fraction) for radius in radii]
    between = capillary.bridge_volume_between_beads(*radii, liquid.volume_fraction)
    walls = [
        capillary.capillary_force_at_wall(liquid.surface_tension, radius, volume, liquid.contact_angle)
        for radius, volume in zip(radii, at_wall, strict=True)
    ]
    pair = capillary.capillary_force(liquid.surface_tension, *radii, between, liquid.contact_angle)
    modulus = reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    sunk = [
        hertz_overlap_at_wall(force + mass * case.pressing_gravity, radius, modulus)
        for force, mass, radius in zip(walls, dimer.masses, radii, strict=True)
    ]
    volumes = (at_wall[0], at_wall[1], between)
    first, second, third = (capillary.rupture_distance(volume, liquid.contact_angle) for volume in volumes)
    return ContactLoads(
        bridge_volumes=volumes,
        capillary=(walls[0], walls[1], pair),
        rupture=(first, second, third),
        overlaps=(sunk[0], sunk[1], hertz_overlap(pair, dimer.reduced_radius, modulus)),
    )


def reach(case: WalkerCase) -> float:
    """How far from its start a walker is given room to go, m.

    Walkers move at a few per cent of the substrate's peak velocity (0.14 of it was the fastest seen, at Γ0 = 0.76
    and friction 0.5); 0.3 of it through the whole run leaves room for those that hop, and sideways as well.
    """
    duration = case.run.cycles / case.drive.frequency
    return 0.3 * case.drive.peak_velocity * duration + 2.0 * dimer_of(case).length


def hop_height(case: WalkerCase) -> float:
    """Height that a bead thrown up at twice the substrate's peak velocity reaches, m (its reach without gravity)."""
    if case.pressing_gravity <= 0.0:
        return reach(case)
    return min((2.0 * case.drive.peak_velocity) ** 2 / (2.0 * case.pressing_gravity), reach(case))


def horizontal_distance(radii: tuple[float, float], overlaps: tuple[float, float, float]) -> float:
    """Distance of the two centres seen from above, for beads that overlap the substrate and each other, m."""
    height = (radii[0] - overlaps[0]) - (radii[1] - overlaps[1])
    return sqrt((sum(radii) - overlaps[2]) ** 2 - height**2)
