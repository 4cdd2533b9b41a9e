"""``walkers check literature``: the second engine and the bridge laws beside published numbers and exact solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from walkers.check.benchmarks import benchmarks
from walkers.check.bridges import pulls, velocities
from walkers.check.crosscheck import crosschecks
from walkers.check.experiments import experiments
from walkers.check.lines import Line

LITERATURE: Mapping[str, Callable[[Path], Iterable[Line]]] = {
    "benchmarks": lambda _: benchmarks(),
    "bridges": lambda out: [*pulls(), *velocities(out)],
    "crosscheck": crosschecks,
    "experiments": experiments,
}
"""Checks by name, from the folder of runs."""
