"""Part the output of a deck that several cases shared: to each its own dumps, as if it had run alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkers.inputs.case import Case
from walkers.postprocess.dump import BinaryDump, FloatArray
from walkers.postprocess.walking import NEAR, came_near
from walkers.runner.failures import WalkersMet
from walkers.runner.files import write_json
from walkers.templates.deck import LAYOUT_NAME
from walkers.templates.layout import Layout, PlacedWalker


def split_output(directory: Path, layout: Layout, cases: Mapping[Path, Case]) -> None:
    """Write the dumps and the layout of each case into its directory, and remove those of the shared deck.

    Beads and walkers are numbered anew in each; they stay where they were in the shared deck.

    Parameters
    ----------
    directory
        Where the deck ran.
    layout
        What it wrote.
    cases
        From each case's directory to the case, in the order of the deck.

    Raises
    ------
    runner.failures.WalkersMet
        If two walkers came near each other, so that they are not what they would be alone.
    postprocess.dump.DumpError
        If a dump cannot be read.
    """
    dump = BinaryDump(directory / layout.bead_dump, layout.bead_columns)
    frames = dump.stack()
    _check_apart(frames, layout, cases, directory)
    texts = {
        layout.pair_bridge_dump: [layout.pair_bridge_columns.index(name) for name in ("id1", "id2")],
        layout.wall_bridge_dump: [layout.wall_bridge_columns.index("id")],
    }
    walkers = iter(layout.walkers)
    owners: dict[str, tuple[int, str]] = {}
    for number, (place, case) in enumerate(cases.items()):
        own = [next(walkers) for make in case.walkers for _ in range(make.replicates)]
        old = [layout.carrier, *(bead for walker in own for bead in walker.beads)]
        new = np.arange(1, len(old) + 1)
        owners |= {str(one): (number, str(other)) for one, other in zip(old, new, strict=True)}
        own_frames = frames[:, np.array(old) - 1]
        own_frames[..., dump.column("id")] = new
        own_frames[..., dump.column("type")] = 1
        dump.write_like(own_frames, place / layout.bead_dump)
        write_json(place / LAYOUT_NAME, _own_layout(layout, own).as_dict())
    for name, columns in texts.items():
        _split_local_dump(directory / name, columns, owners, [place / name for place in cases])
    for name in (layout.bead_dump, *texts, LAYOUT_NAME):
        (directory / name).unlink()


def _own_layout(layout: Layout, walkers: list[PlacedWalker]) -> Layout:
    renumbered, bead = [], layout.carrier + 1
    for number, walker in enumerate(walkers):
        after = bead + len(walker.beads)
        renumbered.append(replace(walker, walker=number, beads=tuple(range(bead, after))))
        bead = after
    return replace(layout, atoms=bead - 1, walkers=tuple(renumbered), ranks=1)


def _check_apart(frames: FloatArray, layout: Layout, cases: Mapping[Path, Case], directory: Path) -> None:
    x, sampled = layout.bead_columns.index("x"), frames[:: next(iter(cases.values())).run.samples_per_cycle]
    rows = [np.array(walker.beads) - 1 for walker in layout.walkers]
    centre = np.stack([sampled[:, beads, x : x + 2].mean(axis=1) for beads in rows], axis=1)
    if came_near(centre, NEAR * max(make.length for case in cases.values() for make in case.walkers)):
        raise WalkersMet(directory)


def _split_local_dump(path: Path, columns: list[int], owners: dict[str, tuple[int, str]], places: list[Path]) -> None:
    """Give each row of a local dump to the owner of its bead; ``columns`` hold ids, ``owners`` their new ones."""
    lines = path.read_text("ascii").split("\n")
    parts: list[list[str]] = [[] for _ in places]
    position = 0
    while position + 9 <= len(lines):
        head = lines[position : position + 9]
        rows: list[list[str]] = [[] for _ in places]
        for line in lines[position + 9 : position + 9 + int(head[3])]:
            words = line.split()
            owner = owners[words[columns[0]]][0]
            for column in columns:
                words[column] = owners[words[column]][1]
            rows[owner].append(" ".join(words) + " ")
        for part, own in zip(parts, rows, strict=True):
            part += [*head[:3], str(len(own)), *head[4:], *own]
        position += 9 + int(head[3])
    for place, part in zip(places, parts, strict=True):
        place.write_text("\n".join(part) + "\n", "ascii")
