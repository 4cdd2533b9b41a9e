"""What stands in the simulation box: beads, and walls."""

from __future__ import annotations

from dataclasses import dataclass

from walkers.inputs.boundary import Wall
from walkers.inputs.drive import Vector


@dataclass(frozen=True)
class Bead:
    """A bead at the start.

    Attributes
    ----------
    id, centre, radius, velocity, spin
        m, m/s, rad/s.
    surface
        Which of the deck's ways to touch is its, from 1.
    loading
        Which of the deck's loadings it feels, from 0 (`walkers.templates.sharing.Loading`).
    density
        kg/m³; None for that of the case.
    """

    id: int
    centre: Vector
    radius: float
    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    surface: int = 1
    loading: int = 0
    density: float | None = None


@dataclass(frozen=True)
class Scene:
    """Beads, walls and the box's corners, all in m."""

    beads: tuple[Bead, ...]
    walls: tuple[Wall, ...]
    lower: Vector
    upper: Vector
