"""The time step: its limits, the step of ``"auto"``, and its fit into the cycle of the drive.

The time step has four limits. The first two apply to all granular simulations, the third only to
wet ones, the fourth where friction grows with the velocity. Above the third, velocities are wrong
without any warning (a glycerol climber: 10.9 mm/s at 1.2 of the limit, 1.8 converged).

    Rayleigh    π R √(ρ/G)/(0.1631 ν + 0.8766) of the smallest bead
    Hertz       2.87 (m*²/(R* E*² v))^(1/5) for an impact at the substrate's peak velocity v
    viscous     2/Σ(c/m) over the bridges of a bead
    friction    20/Σ(7/2 μ'N/m) over the contacts of a bead

In the viscous one, c = 6πηR*²/(σ + h_c) is the largest normal resistance of surfaces in contact
(`walkers.physics.reynolds`), and m is the mass that it slows: the bead's own at a wall, the reduced
mass between beads. Two walls at an angle φ count as 1 + |cos φ|.

The sum takes the bridges to other beads as parallel, which is safe for clusters: the shipped
climber, at 0.86 of its limit, has the velocity (within 0.02 %) and the kinetic energy (0.05 %) of a
quarter of that step. In a groove of 60° a dimer takes 23 times the work of shorter steps at 1.3 of
its limit, and theirs within 3 % at 0.87.

In the last one, μ' is the largest increase of the friction coefficient with the velocity
(`walkers.physics.friction`), N the load of a contact at rest under the peak acceleration, and m as
for the viscous limit; 7/2 because friction also turns a sphere. A contact whose friction grows by
μ'N v is as stiff as a bridge of that resistance, but the elongation of the tangential spring limits
its force, so that a longer step does not make it unstable: the walker of Fig. 2, with
a friction at rest of 0.11 and without edges, is within 0.01 % of its velocity with short steps at
0.3 of the limit (μ' of 1000 s/m), and within 0.15 % at 3.

Speeds of the AK5 walker agree within 0.5 % from 1 to 10 µs, the latter being its Rayleigh time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, pi, sqrt
from typing import TYPE_CHECKING, NamedTuple

from walkers.physics.capillary import BridgeLiquid, bead_volume, largest_normal
from walkers.physics.contact import reduced_modulus

if TYPE_CHECKING:  # numpy is not needed for a time step
    from walkers.physics.bridge import Roughness

FRACTIONS_OF_LOOSE_BEADS: Mapping[str, float] = {
    "rayleigh": 0.2,
    "hertz": 0.1,
    "viscous": 0.4,
    "friction": 0.4,
}
"""Largest share of each limit for ``"auto"`` with loose beads, which belong to no walker."""
FRACTIONS_OF_WALKERS: Mapping[str, float] = {
    "rayleigh": 0.4,
    "hertz": 0.2,
    "viscous": 0.4,
    "friction": 0.4,
}
"""The same if all beads belong to walkers.

At 0.4 of the viscous limit (2 µs for glycerol), the climber and the pile were converged. Walkers
alone do not collide with each other: at 0.4 of the Rayleigh limit, velocities are within 0.25 % of
those at 0.05 (Figs. 1b, 2, 3, 4a, 4b); between 0.59 and 0.71 of the limit they become wrong.
"""
LONGEST_WALKER_STEP = 4e-6
"""Longest step of walkers, whatever their stiffness, s."""


def recommended_fractions(*, loose: bool) -> Mapping[str, float]:
    """Largest share of each limit for ``"auto"``, by the names of the limits.

    Parameters
    ----------
    loose
        Whether there are loose beads, which belong to no walker.
    """
    if loose:
        return FRACTIONS_OF_LOOSE_BEADS
    return FRACTIONS_OF_WALKERS


class BridgedBead(NamedTuple):
    """A bead and the surfaces to which bridges join it."""

    radius: float
    """In m."""
    neighbours: Sequence[float]
    """Radii of the beads that bridges join to it, m."""
    walls: float
    """Damping of the bead by its bridges to walls, over that by one bridge to a wall."""


@dataclass(frozen=True)
class TimeStepLimits:
    """The limits in s; a limit that does not apply is infinite."""

    rayleigh: float
    hertz: float
    viscous: float
    friction: float

    def recommended(self, *, loose: bool) -> tuple[float, str]:
        """Largest step within the shares (`recommended_fractions`) of all limits.

        Parameters
        ----------
        loose
            Whether there are loose beads, which belong to no walker. Without them the step is also
            at most `LONGEST_WALKER_STEP`.

        Returns
        -------
        step : float
            In s.
        reason : str
            The bound that determines the step: ``0.4 of the viscous limit``, for example, or ``at
            most 4 us for walkers``.
        """
        steps = []
        for name, share in recommended_fractions(loose=loose).items():
            steps.append((share * getattr(self, name), f"{share:g} of the {name} limit"))
        if not loose:
            longest = LONGEST_WALKER_STEP
            steps.append((longest, f"at most {longest * 1e6:g} us for walkers"))
        return min(steps)  # the smallest step; of equal ones, the first reason in the alphabet

    def exceeded_by(self, time_step: float) -> list[str]:
        """Names of the limits below ``time_step`` (s)."""
        return [name for name, limit in vars(self).items() if time_step > limit]


def time_step_limits(  # noqa: PLR0913
    beads: Sequence[BridgedBead],
    *,
    density: float,
    youngs_modulus: float,
    poissons_ratio: float,
    liquid: BridgeLiquid,
    roughness: Roughness,
    peak_velocity: float,
    friction_rate: float = 0.0,
) -> TimeStepLimits:
    """Compute the limits of the time step; the equations are those of the module.

    Parameters
    ----------
    beads
        The beads and their bridges.
    density
        Density of the beads, kg/m³.
    youngs_modulus
        Young's modulus of beads and walls in the engine, Pa.
    poissons_ratio
        Poisson's ratio of beads and walls.
    liquid
        The liquid of the bridges.
    roughness
        Roughness of the contacts.
    peak_velocity
        Largest velocity of the substrate, m/s; without a velocity there is no limit by impacts.
    friction_rate
        Σ(7/2 μ'N/m) of the bead for which it is largest, 1/s; 0 if friction does not grow with the
        velocity.
    """
    modulus = reduced_modulus(youngs_modulus, poissons_ratio)
    impact_times = []
    rates = []
    for radius, neighbours, walls in beads:
        mass = bead_volume(radius) * density
        impact_times.append(_impact_time(mass, radius, modulus, peak_velocity))
        rate = walls * _normal_resistance(radius, roughness.bead_wall, liquid) / mass
        for neighbour in neighbours:
            neighbour_mass = bead_volume(neighbour) * density
            reduced_mass = mass * neighbour_mass / (mass + neighbour_mass)
            reduced_radius = radius * neighbour / (radius + neighbour)
            impact_times.append(_impact_time(reduced_mass, reduced_radius, modulus, peak_velocity))
            resistance = _normal_resistance(reduced_radius, roughness.bead_bead, liquid)
            rate += resistance * (1.0 / mass + 1.0 / neighbour_mass)
        rates.append(rate)
    smallest_radius = min(bead.radius for bead in beads)
    shear_modulus = youngs_modulus / (2.0 * (1.0 + poissons_ratio))
    rayleigh = pi * smallest_radius * sqrt(density / shear_modulus)
    largest_rate = max(rates)
    return TimeStepLimits(
        rayleigh=rayleigh / (0.1631 * poissons_ratio + 0.8766),
        hertz=min(impact_times),
        viscous=2.0 / largest_rate if largest_rate > 0.0 else inf,
        friction=20.0 / friction_rate if friction_rate > 0.0 else inf,
    )


def _impact_time(mass: float, radius: float, modulus: float, peak_velocity: float) -> float:
    """Duration of an impact at the substrate's peak velocity, s; infinite without a velocity."""
    if peak_velocity == 0.0:
        return inf
    return 2.87 * float((mass**2 / (radius * modulus**2 * peak_velocity)) ** 0.2)


def _normal_resistance(reduced_radius: float, roughness: float, liquid: BridgeLiquid) -> float:
    """Largest normal resistance of a bridge between surfaces of a roughness (m), N s/m."""
    if liquid.law == "soulie":
        return 6.0 * pi * liquid.viscosity * reduced_radius**2 / roughness
    return largest_normal(reduced_radius, roughness, liquid)


def fit_into_cycle(
    largest_time_step: float, frequency: float, samples_per_cycle: int
) -> tuple[float, int]:
    """Largest time step that divides the cycle and each sampling interval into whole steps.

    Samples that drift through the phase (every 312 of 6250 steps) change a mean velocity by 3 %.

    Parameters
    ----------
    largest_time_step
        Upper bound of the step, s.
    frequency
        Frequency of the drive, Hz.
    samples_per_cycle
        Number of sampling intervals per cycle.

    Returns
    -------
    step : float
        In s.
    steps_per_cycle : int
        Number of steps per cycle.
    """
    # A step given as 2 us must give 6250 steps in 12.5 ms, not one interval more for the last bit
    # of the quotient.
    intervals = ceil(1.0 / (frequency * largest_time_step * samples_per_cycle) * (1.0 - 1e-12))
    steps = intervals * samples_per_cycle
    return 1.0 / (frequency * steps), steps
