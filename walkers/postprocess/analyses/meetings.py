"""The analysis of walkers that are meant to meet: when bridges join two of them, and when the last one breaks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from walkers.inputs.case import Case
from walkers.postprocess.analysis import Analysis, Quantity
from walkers.postprocess.clusters import connected
from walkers.postprocess.motion import Motion, read_bridges
from walkers.postprocess.tables import Columns, columns_of_rows


@dataclass(frozen=True)
class Meeting:
    """``meetings.parquet``: one row per event between two walkers that are meant to meet."""

    time: Annotated[float, "s", "from the begin of the drive"]
    event: Annotated[str, "", "merged: the first bridge between two walkers is there; parted: the last one is gone"]
    walker: Annotated[int, "", "number of one of the two"]
    other: Annotated[int, "", "number of the other"]
    size: Annotated[int, "", "walkers that are joined by bridges, directly or by others, with the first one after that"]


class Meetings(Analysis):
    """Who met whom, how long they stuck, how many were together."""

    order = 1
    name = "meetings"
    tables: ClassVar[Mapping[str, type]] = {"meetings": Meeting}

    def applies(self, case: Case) -> bool:
        """Where walkers are meant to meet."""
        return case.meets

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Events from one recorded frame of bridges to the next; who stands together from the first has merged then."""
        rows: list[Meeting] = []
        before: frozenset[tuple[int, int]] = frozenset()
        groups: list[list[int]] = []
        largest = 1
        for bridges in read_bridges(motion):
            owners = np.sort(motion.walker_of[bridges.beads], axis=1)
            apart = (owners[:, 0] >= 0) & (owners[:, 0] != owners[:, 1])
            now = frozenset((int(one), int(other)) for one, other in owners[apart])
            labels = connected(len(motion.walkers), np.array(sorted(now), dtype=np.int64).reshape(-1, 2))
            groups = [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]
            size = {walker: len(group) for group in groups for walker in group}
            largest = max([largest, *size.values()])
            seconds = float(motion.time[bridges.frame])
            for event, pairs in (("merged", now - before), ("parted", before - now)):
                rows += [Meeting(seconds, event, one, other, size[one]) for one, other in sorted(pairs)]
            before = now
        events = [row.event for row in rows]
        return {"meetings": columns_of_rows(Meeting, rows)}, {
            "merged": events.count("merged"),
            "parted": events.count("parted"),
            "largest_group": largest,
            "groups_at_end": sorted((group for group in groups if len(group) > 1), key=len, reverse=True),
        }

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """How often, and how many together."""
        del result
        label = "meetings of walkers"
        yield Quantity("merged", f"{label}: merged", "", "merged", "how often two walkers stuck together")
        yield Quantity("parted", f"{label}: parted", "", "parted", "how often two of them parted again")
        told = "walkers in the largest group that bridges ever joined"
        yield Quantity("largest_group", "most walkers together", "", "largest_group", told)

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """How often, and who is together at the end."""
        together = "; ".join(", ".join(map(str, group)) for group in result["groups_at_end"])
        return [
            f"  meetings   {result['merged']} merged, {result['parted']} parted, at most {result['largest_group']} "
            f"together; at the end {f'walkers {together}' if together else 'all are alone'}"
        ]
