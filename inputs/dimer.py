"""What follows from a case's two beads: masses, asymmetry, Γ0, loads at rest, and the room that they need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import asin, cos, pi, sqrt

from inputs import forces
from inputs.case import WalkerCase


@dataclass(frozen=True)
class Dimer:
    """What follows from a case's two beads: the paper's symbols, SI units.

    Bead 1 is the case's first. Khan et al.: sin δ = (R1 − R2)/(R1 + R2), μ = (m1 − m2)/M, R̄ = (R1 + R2)/2,
    Γ0 = a0 M/(4πγR̄) (their Eq. 1).
    """

    radii: tuple[float, float]
    density: float
    surface_tension: float

    @property
    def masses(self) -> tuple[float, float]:
        """m1, m2, kg."""
        first, second = (4.0 / 3.0 * pi * radius**3 * self.density for radius in self.radii)
        return first, second

    @property
    def total_mass(self) -> float:
        """M, kg."""
        return sum(self.masses)

    @property
    def mean_radius(self) -> float:
        """R̄, m."""
        return sum(self.radii) / 2.0

    @property
    def sin_delta(self) -> float:
        """The asymmetry parameter sin δ."""
        return (self.radii[0] - self.radii[1]) / sum(self.radii)

    @property
    def mass_asymmetry(self) -> float:
        """μ."""
        return (self.masses[0] - self.masses[1]) / self.total_mass

    @property
    def capillary_scale(self) -> float:
        """4πγR̄, the mean capillary force on the substrate in the limit of perfect wetting, N."""
        return forces.capillary_force_limit_at_wall(self.surface_tension, self.mean_radius)

    @property
    def reduced_radius(self) -> float:
        """R1 R2/(R1 + R2), m."""
        return self.radii[0] * self.radii[1] / sum(self.radii)

    @property
    def length(self) -> float:
        """From the outermost point of one bead to that of the other, seen from above, m."""
        return sum(self.radii) * cos(asin(self.sin_delta)) + sum(self.radii)

    def gamma0(self, peak_acceleration: float) -> float:
        """Γ0 for a peak acceleration in m/s²."""
        return peak_acceleration * self.total_mass / self.capillary_scale

    def peak_acceleration(self, gamma0: float) -> float:
        """The peak acceleration in m/s² that gives a Γ0."""
        return gamma0 * self.capillary_scale / self.total_mass


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
    at_wall = [forces.bridge_volume_at_wall(radius, liquid.volume_fraction) for radius in radii]
    between = forces.bridge_volume_between_beads(*radii, liquid.volume_fraction)
    walls = [
        forces.capillary_force_at_wall(liquid.surface_tension, radius, volume, liquid.contact_angle)
        for radius, volume in zip(radii, at_wall, strict=True)
    ]
    pair = forces.capillary_force(liquid.surface_tension, *radii, between, liquid.contact_angle)
    modulus = forces.reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    # The wall stands twice in the deck, so that each of the two carries half of the load.
    sunk = [
        forces.hertz_overlap(0.5 * (force + mass * case.pressing_gravity), radius, modulus)
        for force, mass, radius in zip(walls, dimer.masses, radii, strict=True)
    ]
    volumes = (at_wall[0], at_wall[1], between)
    first, second, third = (forces.rupture_distance(volume, liquid.contact_angle) for volume in volumes)
    return ContactLoads(
        bridge_volumes=volumes,
        capillary=(walls[0], walls[1], pair),
        rupture=(first, second, third),
        overlaps=(sunk[0], sunk[1], forces.hertz_overlap(pair, dimer.reduced_radius, modulus)),
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
    if case.pressing_gravity == 0.0:
        return reach(case)
    return min((2.0 * case.drive.peak_velocity) ** 2 / (2.0 * case.pressing_gravity), reach(case))


def horizontal_distance(radii: tuple[float, float], overlaps: tuple[float, float, float]) -> float:
    """Distance of the two centres seen from above, for beads that overlap the substrate and each other, m."""
    height = (radii[0] - overlaps[0]) - (radii[1] - overlaps[1])
    return sqrt((sum(radii) - overlaps[2]) ** 2 - height**2)
