"""The liquid of the bridges, as their laws and tables take it."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_LAW = "young-laplace"


@dataclass(frozen=True, kw_only=True)
class BridgeLiquid:
    """Numbers of the liquid of bridges, SI units.

    Attributes
    ----------
    surface_tension, viscosity, contact_angle
        N/m; that of the bridges, Pa s; rad.
    volume_fraction
        Volume of the liquid on a bead over that of the bead.
    conserved
        Whether bridges take their volumes from the films of their beads.
    law
        Name of the law of the bridges (`walkers.physics.laws`).
    """

    surface_tension: float
    viscosity: float
    contact_angle: float
    volume_fraction: float
    conserved: bool = False
    law: str = DEFAULT_LAW
