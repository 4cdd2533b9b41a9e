"""Split the output of a shared deck: each case gets its dumps as if it had run alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkers.files import write_json
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.dump import BinaryDump, local_frames, write_local_dump
from walkers.postprocess.measure.motion import NEAR, came_near
from walkers.runner.failures import WalkersMet
from walkers.templates.deck import LAYOUT_NAME
from walkers.templates.layout import DeckLayout


def split_output(directory: Path, layout: DeckLayout, cases: Mapping[Path, Case]) -> None:
    """Write the dumps and the layout of each case into its directory, and remove those of the shared deck.

    ``cases`` are in the order of the deck. Beads and walkers are renumbered; their positions are those in the shared
    deck. `WalkersMet` if two walkers came so close that they are not independent.
    """
    dump = BinaryDump(directory / layout.bead_dump, layout.bead_columns)
    frames, x = dump.stack(), dump.columns.index("x")
    sampled = frames[:: next(iter(cases.values())).run.samples_per_cycle, :, x : x + 2]
    centre = np.stack(
        [sampled[:, np.array(walker.beads) - 1].mean(axis=1) for walker in layout.walkers], axis=1
    )
    if came_near(
        centre, NEAR * max(make.length for case in cases.values() for make in case.walkers)
    ):
        raise WalkersMet(
            "walkers of different cases came close to each other in a shared deck", directory
        )
    owner, renumbered = (np.zeros(layout.atoms + 1, dtype=np.int64) for _ in range(2))
    walkers = iter(layout.walkers)
    for number, (place, case) in enumerate(cases.items()):
        walkers_of_case = [next(walkers) for make in case.walkers for _ in range(make.replicates)]
        old = np.array([bead for walker in walkers_of_case for bead in walker.beads])
        new = np.arange(1, len(old) + 1)
        owner[old], renumbered[old] = number, new
        frames_of_case = frames[:, old - 1]
        frames_of_case[..., dump.columns.index("id")] = new
        frames_of_case[..., dump.columns.index("type")] = 1
        dump.write_like(frames_of_case, place / layout.bead_dump)
        placed = tuple(
            replace(walker, walker=index, beads=tuple(renumbered[list(walker.beads)].tolist()))
            for index, walker in enumerate(walkers_of_case)
        )
        layout_of_case = replace(layout, atoms=len(old), walkers=placed, ranks=1)
        write_json(place / LAYOUT_NAME, layout_of_case.as_dict(), sync=False)
    for name, columns, ids in (
        (layout.pair_bridge_dump, layout.pair_bridge_columns, ("id1", "id2")),
        (layout.wall_bridge_dump, layout.wall_bridge_columns, ("id",)),
    ):
        bridges = list(local_frames(directory / name, columns))
        held = [columns.index(column) for column in ids]
        for number, place in enumerate(cases):
            parts = []
            for step, rows in bridges:
                part = rows[owner[rows[:, held[0]].astype(np.int64)] == number]
                part[:, held] = renumbered[part[:, held].astype(np.int64)]
                parts.append((step, part))
            write_local_dump(place / name, columns, parts)
    for name in (*layout.dumps, LAYOUT_NAME):
        (directory / name).unlink()
