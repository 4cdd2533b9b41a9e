"""The comparisons with the literature, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from studies.literature.benchmarks import benchmarks
from studies.literature.bridges import pulls, velocities
from studies.literature.experiments import experiments
from walkers.second_engine.crosscheck import crosscheck_examples
from walkers.second_engine.lines import Line


def _benchmarks(_out: Path) -> Iterable[Line]:
    return benchmarks()


def _bridges(out: Path) -> Iterator[Line]:
    yield from pulls()
    yield from velocities(out)


LITERATURE: Mapping[str, Callable[[Path], Iterable[Line]]] = {
    "benchmarks": _benchmarks,
    "bridges": _bridges,
    "crosscheck": crosscheck_examples,
    "experiments": experiments,
}
"""Functions that give the lines of a comparison from the folder of runs.

Runs that are not in the folder are made there.
"""
