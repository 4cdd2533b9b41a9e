"""Split the output of a shared deck: each case gets its dumps as if it had run alone.

Decks are composed of several cases in `walkers.templates`, and started in `walkers.runs.making`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.files import write_json
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.dump import BinaryDump, local_frames, write_local_dump
from walkers.postprocess.measure.motion import NEAR, came_near
from walkers.runner.failures import WalkersMet
from walkers.templates.deck import LAYOUT_NAME
from walkers.templates.layout import DeckLayout, PlacedWalker

_ID_COLUMNS = ("id", "id1", "id2")
"""Columns of the dumps of bridges that are ids of beads."""


@dataclass(frozen=True)
class _Part:
    """The part of a shared deck that belongs to one case.

    Attributes
    ----------
    directory
        Where the dumps and the layout of the case are written.
    walkers
        Its walkers, as the layout of the shared deck has them.
    bead_ids
        Ids of its beads in the shared deck, in the order of their new ids 1, 2, ….
    """

    directory: Path
    walkers: Sequence[PlacedWalker]
    bead_ids: IntArray


@dataclass(frozen=True)
class _Renumbering:
    """For each bead id of the shared deck, the number of its case and its new id there.

    Both arrays have the shape (beads + 1,), because ids begin with 1.
    """

    case_number: IntArray
    new_id: IntArray


def split_output(directory: Path, layout: DeckLayout, cases: Mapping[Path, Case]) -> None:
    """Write dumps and layout of each case into its directory, and remove those of the shared deck.

    Beads and walkers are renumbered from 1 and 0 in each case; their positions remain those in the
    shared deck.

    Parameters
    ----------
    directory
        Where the shared deck ran.
    layout
        Layout of its dumps.
    cases
        The cases by their directories, in the order of the deck.

    Raises
    ------
    WalkersMet
        If two walkers came so close that they are not independent.
    """
    dump = BinaryDump(directory / layout.bead_dump, layout.bead_columns)
    frames = dump.stack()
    # Cases that share a deck have the same samples.
    samples_per_cycle = next(iter(cases.values())).run.samples_per_cycle
    lengths = []
    for case in cases.values():
        lengths += [kind.length for kind in case.walkers]
    centres = _walker_centres(layout, dump, frames[::samples_per_cycle])
    if came_near(centres, NEAR * max(lengths)):
        raise WalkersMet(
            "walkers of different cases came close to each other in a shared deck", directory
        )
    parts = _parts_of(layout, cases)
    renumbering = _renumbering(layout, parts)
    for part in parts:
        _write_beads(part, layout, dump, frames)
        _write_layout(part, layout, renumbering)
    pairs = directory / layout.pair_bridge_dump
    _split_bridges(pairs, layout.pair_bridge_columns, parts, renumbering)
    walls = directory / layout.wall_bridge_dump
    _split_bridges(walls, layout.wall_bridge_columns, parts, renumbering)
    for name in (*layout.dumps, LAYOUT_NAME):
        (directory / name).unlink()


def _walker_centres(layout: DeckLayout, dump: BinaryDump, frames: FloatArray) -> FloatArray:
    """Horizontal position of the middle of each walker in m, shape (frames, walkers, 2)."""
    x = dump.columns.index("x")
    positions = frames[:, :, x : x + 2]
    centres = [positions[:, np.array(walker.beads) - 1].mean(axis=1) for walker in layout.walkers]
    return np.stack(centres, axis=1)


def _parts_of(layout: DeckLayout, cases: Mapping[Path, Case]) -> list[_Part]:
    """The parts of a shared deck, whose walkers are in the order of the cases."""
    first = 0
    parts = []
    for directory, case in cases.items():
        count = sum(kind.replicates for kind in case.walkers)
        walkers = layout.walkers[first : first + count]
        first += count
        bead_ids: list[int] = []
        for walker in walkers:
            bead_ids += walker.beads
        parts.append(_Part(directory, walkers, np.array(bead_ids)))
    return parts


def _renumbering(layout: DeckLayout, parts: Sequence[_Part]) -> _Renumbering:
    """Case and new id of each bead of a shared deck, from the parts of all cases."""
    case_number = np.zeros(layout.atoms + 1, dtype=np.int64)
    new_id = np.zeros(layout.atoms + 1, dtype=np.int64)
    for number, part in enumerate(parts):
        case_number[part.bead_ids] = number
        new_id[part.bead_ids] = np.arange(1, len(part.bead_ids) + 1)
    return _Renumbering(case_number, new_id)


def _write_beads(part: _Part, layout: DeckLayout, dump: BinaryDump, frames: FloatArray) -> None:
    """Write the bead dump of a case from the frames of the shared deck."""
    beads = frames[:, part.bead_ids - 1]  # frames are sorted by id
    beads[..., dump.columns.index("id")] = np.arange(1, len(part.bead_ids) + 1)
    beads[..., dump.columns.index("type")] = 1
    dump.write_like(beads, part.directory / layout.bead_dump)


def _write_layout(part: _Part, layout: DeckLayout, renumbering: _Renumbering) -> None:
    """Write the layout of the dumps of a case."""
    walkers = []
    for number, walker in enumerate(part.walkers):
        new_ids = renumbering.new_id[list(walker.beads)]
        walkers.append(replace(walker, walker=number, beads=tuple(new_ids.tolist())))
    layout_of_case = replace(layout, atoms=len(part.bead_ids), walkers=tuple(walkers), ranks=1)
    write_json(part.directory / LAYOUT_NAME, layout_of_case.as_dict(), sync=False)


def _split_bridges(
    dump: Path, columns: tuple[str, ...], parts: Sequence[_Part], renumbering: _Renumbering
) -> None:
    """Write the bridges of each case to a dump of the same name in its directory.

    Both beads of a bridge belong to the same case.
    """
    id_columns = [index for index, column in enumerate(columns) if column in _ID_COLUMNS]
    frames = list(local_frames(dump, columns))
    for number, part in enumerate(parts):
        frames_of_case = []
        for step, bridges in frames:
            first_ids = bridges[:, id_columns[0]].astype(np.int64)
            bridges_of_case = bridges[renumbering.case_number[first_ids] == number]
            ids = bridges_of_case[:, id_columns].astype(np.int64)
            bridges_of_case[:, id_columns] = renumbering.new_id[ids]
            frames_of_case.append((step, bridges_of_case))
        write_local_dump(part.directory / dump.name, columns, frames_of_case)
