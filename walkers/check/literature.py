"""``walkers check literature``: the second engine and the bridge laws beside published numbers and exact solutions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from pathlib import Path

from walkers.check.benchmarks import benchmarks
from walkers.check.bridges import pulls, velocities
from walkers.check.crosscheck import crosschecks
from walkers.check.lines import Line, chosen, computed

LITERATURE: Mapping[str, Callable[[Path], Iterable[Line]]] = {
    "benchmarks": lambda _: benchmarks(),
    "bridges": lambda out: [*pulls(), *velocities(out)],
    "crosscheck": crosschecks,
}
"""Checks by name, from the folder of runs."""


def literature(out: Path, only: Collection[str] = (), *, on_done: Callable[[str], None] | None = None) -> list[Line]:
    """Lines of the named checks, default all; ``out`` is the folder of the runs, ``on_done`` is told each name."""
    names = chosen(only, LITERATURE)
    return [line for name in names for line in computed(name, partial(LITERATURE[name], out), on_done)]
