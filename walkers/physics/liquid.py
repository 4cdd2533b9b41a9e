"""The liquid of the bridges, as their laws and tables take it."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_LAW = "young-laplace"


@dataclass(frozen=True, kw_only=True)
class BridgeLiquid:
    """Numbers of the liquid of bridges, SI units; ``law`` is the name of their law (`walkers.physics.laws`).

    ``viscosity`` is that of the bridges, ``volume_fraction`` the volume of the liquid on a bead over that of the bead.
    Bridges take ``conserved`` liquid from the films of their beads.
    """

    surface_tension: float
    viscosity: float
    contact_angle: float
    volume_fraction: float
    conserved: bool = False
    law: str = DEFAULT_LAW
