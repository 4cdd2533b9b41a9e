"""``walkers check literature``: the second engine and the bridge laws beside published numbers and exact solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from walkers.second_engine.benchmarks import benchmarks
from walkers.second_engine.bridges import pulls, velocities
from walkers.second_engine.crosscheck import crosschecks
from walkers.second_engine.experiments import experiments
from walkers.second_engine.lines import Line

LITERATURE: Mapping[str, Callable[[Path], Iterable[Line]]] = {
    "benchmarks": lambda _: benchmarks(),
    "bridges": lambda out: [*pulls(), *velocities(out)],
    "crosscheck": crosschecks,
    "experiments": experiments,
}
"""Checks by name, from the folder of runs."""
