"""Layout of the output of a deck: columns, frames, and the walker of each bead.

A run stores the layout as ``layout.json``, from which its dumps are read
(`walkers.postprocess.measure.dump`).
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AliasChoices, Field, TypeAdapter
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
"""Further columns for walkers: mean angular velocity over the steps since the last frame, rad/s."""
FILM_COLUMN = "f_film"
"""Further column where liquid is conserved: the film on the bead as a share of the bead's liquid.

Bridges take their liquid from the film.
"""
FORCE_COLUMNS = ("fx", "fy", "fz", "tqx", "tqy", "tqz")
"""Optional further columns: force (N) and torque (N m)."""

PAIR_BRIDGES = {
    "x1 y1 z1 x2 y2 z2": "pos",
    "id1 id2 periodic": "id",
    "fx fy fz": "force",
    "overlap": "delta",
}
"""Columns that the engine gives for bridges between beads, in its order, with their options."""
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
"""Columns that the fix of the walls gives for bridges to walls, in its order.

The foot of the bridge and the centre of the bead (m), the numbers of the wall and of the bead, the
force (N) and the overlap (m).
"""
PAIR_BRIDGE_COLUMNS = ("id1", "id2", "fx", "fy", "fz", "overlap")
"""Columns of the dump of bridges between beads; the force (N) acts on bead ``id1``."""
WALL_BRIDGE_COLUMNS = ("wall", "id", "fx", "fy", "fz", "overlap")
"""Columns of the dump of bridges to walls: number of the wall, force (N) on bead ``id``."""

_KIND_NAMES = AliasChoices("kind", "make")
"""Names of the field ``kind`` of `PlacedWalker` in Python, and in ``layout.json``."""


@dataclass(frozen=True)
class PlacedWalker:
    """One walker of a deck and its start.

    Attributes
    ----------
    walker
        Its number in the deck, from 0.
    kind
        Number of its kind in the case, from 0.
    beads
        Numbers of its beads in the engine.
    facing
        +1 along the drive axis (right) or −1 (left).
    start_angle
        Angle from that direction, rad.
    origin
        Its place, x and y in m.
    """

    walker: int
    kind: Annotated[int, Field(validation_alias=_KIND_NAMES, serialization_alias="make")]
    beads: tuple[int, ...]
    facing: int
    start_angle: float
    origin: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class DeckLayout:
    """Dumps of a deck, and its walkers.

    Attributes
    ----------
    bead_dump
        Name of the dump of beads.
    bead_columns
        Its columns.
    sample_every
        Steps between its frames.
    frames
        Number of its frames.
    pair_bridge_dump, wall_bridge_dump
        Names of the dumps of bridges between beads and of bridges to walls.
    pair_bridge_columns, wall_bridge_columns
        Their columns.
    bridge_every
        Steps between their frames.
    bridge_frames
        Number of their frames.
    atoms
        Number of beads.
    steps
        Last step of the deck.
    time_step
        Time step, s.
    walkers
        The walkers; empty in a pile.
    ranks
        Number of MPI processes.
    """

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
        """Size of the complete bead dump, bytes."""
        # A frame: step and number of atoms, triclinic flag, kinds and positions of six boundaries,
        # number of columns and of blocks; then for each rank the size of its block and the values.
        header = 8 + 8 + 4 + 6 * 4 + 6 * 8 + 4 + 4 + 4 * self.ranks
        return self.frames * (header + 8 * self.atoms * len(self.bead_columns))

    @property
    def dumps(self) -> tuple[str, str, str]:
        """Names of the dumps of beads and of bridges."""
        return self.bead_dump, self.pair_bridge_dump, self.wall_bridge_dump

    def bridge_terms(self) -> dict[str, Any]:
        """The words of the deck for the columns of bridges, by their names in the blocks.

        The options of the compute that gives bridges between beads, and the terms of both dumps:
        column k of the compute or of the fix is ``…[k]``.
        """
        pair_terms = " ".join(PAIR_BRIDGES).split()
        pair_numbers = [pair_terms.index(column) + 1 for column in self.pair_bridge_columns]
        wall_numbers = [WALL_BRIDGES.index(column) + 1 for column in self.wall_bridge_columns]
        return {
            "pair_bridge_options": " ".join(PAIR_BRIDGES.values()),
            "pair_bridge_terms": [f"c_pair_bridges[{number}]" for number in pair_numbers],
            "wall_bridge_terms": [f"f_walls[{number}]" for number in wall_numbers],
        }

    def as_dict(self) -> dict[str, Any]:
        """The layout in plain JSON types."""
        written: dict[str, Any] = TypeAdapter(DeckLayout).dump_python(self, by_alias=True)
        return written
