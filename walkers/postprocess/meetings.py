"""The analysis of walkers that are meant to meet: when bridges join two of them, and when the last one breaks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from walkers.inputs.case import Case
from walkers.postprocess.analysis import Analysis, Columns, Described
from walkers.postprocess.clusters import connected
from walkers.postprocess.motion import Motion, read_bridges

Pair = tuple[int, int]


class Meetings(Analysis):
    """Who met whom, how long they stuck, how many were together."""

    name = "meetings"
    version = 1
    tables = ("meetings",)
    columns: ClassVar[Described] = {
        "merged": ("", "how often two walkers stuck together"),
        "parted": ("", "how often two of them parted again"),
        "largest_group": ("", "walkers in the largest group that bridges ever joined"),
    }
    rows = (
        ("meetings of walkers: merged", "merged"),
        ("meetings of walkers: parted", "parted"),
        ("most walkers together", "largest_group"),
    )

    def applies(self, case: Case) -> bool:
        """Where walkers are meant to meet."""
        return case.meets

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Events from one recorded frame of bridges to the next; who stands together from the first has merged then."""
        rows: list[tuple[float, str, int, int, int]] = []
        before: frozenset[Pair] = frozenset()
        groups: list[list[int]] = []
        largest = 1
        for bridges in read_bridges(motion):
            owners = np.sort(motion.walker_of[bridges.beads], axis=1)
            apart = (owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])
            now = frozenset((int(one), int(other)) for one, other in owners[apart])
            groups = groups_of(now, len(motion.walkers))
            size = {walker: len(group) for group in groups for walker in group}
            largest = max([largest, *size.values()])
            seconds = float(motion.time[bridges.frame])
            rows += [(seconds, "merged", one, other, size[one]) for one, other in sorted(now - before)]
            rows += [(seconds, "parted", one, other, size[one]) for one, other in sorted(before - now)]
            before = now
        kinds = [row[1] for row in rows]
        summary = {
            "merged": kinds.count("merged"),
            "parted": kinds.count("parted"),
            "largest_group": largest,
            "groups_at_end": sorted((group for group in groups if len(group) > 1), key=len, reverse=True),
        }
        return {"meetings": _columns(rows)}, summary

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """How often, and who is together at the end."""
        together = "; ".join(", ".join(map(str, group)) for group in result["groups_at_end"])
        return [
            f"  meetings   {result['merged']} merged, {result['parted']} parted, at most {result['largest_group']} "
            f"together; at the end {f'walkers {together}' if together else 'all are alone'}"
        ]


def groups_of(joined: frozenset[Pair], count: int) -> list[list[int]]:
    """Connected components of so many walkers, given which pairs are joined."""
    labels = connected(count, np.array(sorted(joined), dtype=np.int64).reshape(-1, 2))
    return [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]


def _columns(rows: list[tuple[float, str, int, int, int]]) -> Columns:
    kinds = {"time": np.float64, "event": np.str_, "walker": np.int64, "other": np.int64, "size": np.int64}
    columns = zip(*rows, strict=True) if rows else ([] for _ in kinds)
    return {
        name: np.array(list(values), dtype=kind) for (name, kind), values in zip(kinds.items(), columns, strict=True)
    }
