"""Layout of the output of a deck: columns, frames, and the walker of each bead."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from pydantic.dataclasses import dataclass

BEAD_COLUMNS = (
    "id",
    "type",
    "radius",
    "x",
    "y",
    "z",
    "vx",
    "vy",
    "vz",
    "omegax",
    "omegay",
    "omegaz",
)
"""Columns of the bead dump, in the engine's names (m, m/s, rad/s)."""
MEAN_SPIN_COLUMNS = ("f_mean_spin[1]", "f_mean_spin[2]", "f_mean_spin[3]")
"""Further columns for walkers: angular velocity, averaged over the steps since the last frame (rad/s)."""
FILM_COLUMN = "f_film"
"""Further column where liquid is conserved: liquid on the bead (not in bridges) over its whole liquid."""
FORCE_COLUMNS = ("fx", "fy", "fz", "tqx", "tqy", "tqz")
"""Optional further columns (N, N m)."""

PAIR_BRIDGES = {
    "x1 y1 z1 x2 y2 z2": "pos",
    "id1 id2 periodic": "id",
    "fx fy fz": "force",
    "overlap": "delta",
}
"""Output of the engine for bridges between beads, in its order: columns and the option that gives them."""
WALL_BRIDGES = (
    "x",
    "y",
    "z",
    "bead_x",
    "bead_y",
    "bead_z",
    "wall",
    "id",
    "fx",
    "fy",
    "fz",
    "overlap",
)
"""Output of the fix of the walls for bridges to walls, in its order: foot, bead, number of the wall, …"""
PAIR_BRIDGE_COLUMNS = ("id1", "id2", "fx", "fy", "fz", "overlap")
"""Columns of the dump of bridges between beads; the force acts on bead ``id1``."""
WALL_BRIDGE_COLUMNS = ("wall", "id", "fx", "fy", "fz", "overlap")
"""Columns of the dump of bridges to walls: number of the wall, force on bead ``id``."""


@dataclass(frozen=True)
class PlacedWalker:
    """One walker of a deck: number of its make in the case, ids of its beads, and its start.

    ``facing`` is +1 along the drive axis (right) or −1 (left); ``start_angle`` (rad) is measured from there; ``origin``
    in m.
    """

    walker: int
    make: int
    beads: tuple[int, ...]
    facing: int
    start_angle: float
    origin: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class DeckLayout:
    """Dumps of a deck (file names, columns, steps between frames, frames expected) and its walkers."""

    bead_dump: str = "beads.bin"
    bead_columns: tuple[str, ...]
    sample_every: int
    frames: int
    pair_bridge_dump: str = "bridges.pairs.txt"
    pair_bridge_columns: tuple[str, ...] = PAIR_BRIDGE_COLUMNS
    wall_bridge_dump: str = "bridges.walls.txt"
    wall_bridge_columns: tuple[str, ...] = WALL_BRIDGE_COLUMNS
    bridge_every: int
    bridge_frames: int
    atoms: int
    steps: int
    time_step: float
    walkers: tuple[PlacedWalker, ...]
    ranks: int = 1

    @property
    def bead_dump_bytes(self) -> int:
        """Size of the complete bead dump."""
        header = 8 + 8 + 4 + 6 * 4 + 6 * 8 + 4 + 4 + 4 * self.ranks
        return self.frames * (header + 8 * self.atoms * len(self.bead_columns))

    @property
    def dumps(self) -> tuple[str, str, str]:
        """Names of the dumps of beads and of bridges."""
        return self.bead_dump, self.pair_bridge_dump, self.wall_bridge_dump

    def bridge_terms(self) -> dict[str, Any]:
        """What the engine calls the columns of bridges, and the options that give those between beads."""
        pairs = " ".join(PAIR_BRIDGES).split()
        return {
            "pair_bridge_options": " ".join(PAIR_BRIDGES.values()),
            "pair_bridge_terms": [
                f"c_pair_bridges[{pairs.index(column) + 1}]" for column in self.pair_bridge_columns
            ],
            "wall_bridge_terms": [
                f"f_walls[{WALL_BRIDGES.index(column) + 1}]" for column in self.wall_bridge_columns
            ],
        }

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return asdict(self)
