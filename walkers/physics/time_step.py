"""The time step: its limits, the step of ``"auto"``, and its fit into the cycle of the drive.

The time step has three limits. The first two apply to all granular simulations, the third only to wet ones. Above the
third, velocities are wrong without any warning (a glycerol climber: 10.9 mm/s at 1.2 of the limit, 1.8 converged).

    Rayleigh    π R √(ρ/G)/(0.1631 ν + 0.8766) of the smallest bead
    Hertz       2.87 (m*²/(R* E*² v))^(1/5) for an impact at the substrate's peak velocity v
    viscous     2/Σ(c/m) over the bridges of a bead, c = 6πηR*²/(σ + h_c) the largest normal drag, of surfaces in
                contact (`walkers.physics.reynolds`), and m the mass that it slows (the bead's own at a wall, the
                reduced mass between beads); two walls at an angle φ count as 1 + |cos φ|

The sum takes the bridges to other beads as parallel, which is safe for clusters: the shipped climber, at 0.86 of its
limit, has the velocity (within 0.02 %) and the kinetic energy (0.05 %) of a quarter of that step. In a groove of 60° a
dimer takes 23 times the work of shorter steps at 1.3 of its limit, and theirs within 3 % at 0.87.

Speeds of the AK5 walker agree within 0.5 % from 1 to 10 µs, the latter being its Rayleigh time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, pi, sqrt
from typing import TYPE_CHECKING

from walkers.physics.capillary import BridgeLiquid, bead_volume, largest_normal
from walkers.physics.contact import reduced_modulus

if TYPE_CHECKING:  # numpy is not needed for a time step
    from walkers.physics.bridge import Roughness

FRACTIONS: Mapping[bool, Mapping[str, float]] = {
    True: {"rayleigh": 0.2, "hertz": 0.1, "viscous": 0.4},
    False: {"rayleigh": 0.4, "hertz": 0.2, "viscous": 0.4},
}
"""Largest share of each limit for ``"auto"``, with loose beads and without. At 0.4 of the viscous limit (2 µs for
glycerol), the climber and the pile were converged. Walkers alone do not collide with each other: at 0.4 of the Rayleigh
limit, velocities are within 0.25 % of those at 0.05 (Figs. 1b, 2, 3, 4a, 4b); between 0.59 and 0.71 of the limit they
become wrong."""
LONGEST_WALKER_STEP = 4e-6
"""s; longest step of walkers, independent of their stiffness."""
Bridged = Sequence[tuple[float, Sequence[float], float]]
"""Of each bead its radius, the radii of those that bridges join to it, m, and its damping by walls over that by one."""


@dataclass(frozen=True)
class TimeStepLimits:
    """The limits in s; a limit that does not apply is infinite."""

    rayleigh: float
    hertz: float
    viscous: float

    def recommended(self, *, loose: bool) -> tuple[float, str]:
        """Largest step (s) within the shares of all limits, for loose beads or walkers; and the lowest limit."""
        shares = FRACTIONS[loose]
        steps = [
            (shares[name] * at, f"{shares[name]:g} of the {name} limit")
            for name, at in vars(self).items()
        ]
        longest = LONGEST_WALKER_STEP
        return min(
            steps if loose else [*steps, (longest, f"at most {longest * 1e6:g} us for walkers")]
        )

    def exceeded_by(self, time_step: float) -> list[str]:
        """Names of the limits below ``time_step`` (s)."""
        return [name for name, limit in vars(self).items() if time_step > limit]


def time_step_limits(
    bridged: Bridged,
    *,
    density: float,
    youngs_modulus: float,
    poissons_ratio: float,
    liquid: BridgeLiquid,
    roughness: Roughness,
    peak_velocity: float,
) -> TimeStepLimits:
    """Limits of the time step for beads on a substrate of this peak velocity; SI units; see the module."""

    def drag(reduced_radius: float, rough: float) -> float:
        """Largest normal lubrication resistance of a bridge between surfaces of this roughness, N s/m."""
        if liquid.law == "soulie":
            return 6.0 * pi * liquid.viscosity * reduced_radius**2 / rough
        return largest_normal(reduced_radius, rough, liquid)

    modulus = reduced_modulus(youngs_modulus, poissons_ratio)
    impacts, rates = [], []
    for radius, neighbours, walls in bridged:
        mass = bead_volume(radius) * density
        impacts.append((mass, radius))
        rates.append(walls * drag(radius, roughness.bead_wall) / mass)
        for neighbour in neighbours:
            neighbour_mass, reduced = (
                bead_volume(neighbour) * density,
                radius * neighbour / (radius + neighbour),
            )
            impacts.append((mass * neighbour_mass / (mass + neighbour_mass), reduced))
            rates[-1] += drag(reduced, roughness.bead_bead) * (1.0 / mass + 1.0 / neighbour_mass)
    shear_modulus = youngs_modulus / (2.0 * (1.0 + poissons_ratio))
    slowest = pi * min(radius for radius, *_ in bridged) * sqrt(density / shear_modulus)
    return TimeStepLimits(
        rayleigh=slowest / (0.1631 * poissons_ratio + 0.8766),
        hertz=min(
            2.87 * float((mass**2 / (radius * modulus**2 * peak_velocity)) ** 0.2)
            for mass, radius in impacts
        )
        if peak_velocity
        else inf,
        viscous=2.0 / max(rates) if max(rates) > 0.0 else inf,
    )


def fit_into_cycle(
    largest_time_step: float, frequency: float, samples_per_cycle: int
) -> tuple[float, int]:
    """Largest step (s) up to the given one that divides the cycle and each sampling interval into whole steps.

    Samples that drift through the phase (every 312 of 6250 steps) change a mean velocity by 3 %. Returns the step and
    the number of steps per cycle of a drive with this frequency (Hz).
    """
    # A step given as 2 us must give 6250 steps in 12.5 ms, not one interval more for the last bit of the quotient.
    intervals = ceil(1.0 / (frequency * largest_time_step * samples_per_cycle) * (1.0 - 1e-12))
    steps = intervals * samples_per_cycle
    return 1.0 / (frequency * steps), steps
