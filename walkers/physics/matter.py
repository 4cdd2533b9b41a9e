"""What the laws take of a case: the liquid of the bridges and the film, and the contacts."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_LAW = "young-laplace"


@dataclass(frozen=True)
class Liquid:
    """Surface tension (N/m), dynamic viscosity (Pa s), density (kg/m³), effective contact angle (rad).

    The viscosity is that of the bridges: the liquid's, times the case's ``viscosity_ratio``. ``volume_fraction`` is the
    liquid on a bead over the bead's volume. ``law`` names the law of the bridges (`walkers.physics.laws`).
    """

    surface_tension: float
    dynamic_viscosity: float
    density: float | None
    volume_fraction: float
    contact_angle: float
    name: str | None
    law: str = DEFAULT_LAW


@dataclass(frozen=True)
class Contact:
    """Contact model: Young's modulus (Pa) of the softened beads and walls; the rest is dimensionless."""

    youngs_modulus: float
    poissons_ratio: float
    restitution: float
    friction_bead_bead: float
    friction_bead_wall: float
    rolling_friction: float
    minimum_separation_ratio: float
