"""``walkers check literature``: the second engine and the bridge laws beside published numbers and exact solutions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from walkers.check.benchmarks import benchmarks
from walkers.check.bridges import bridges
from walkers.check.crosscheck import crosschecks
from walkers.check.lines import Line, Verdict
from walkers.errors import WalkersError, expected_of, refused

LITERATURE: Mapping[str, Callable[[Path, bool], Iterable[Line]]] = {
    "benchmarks": lambda _out, _quick: benchmarks(),
    "bridges": lambda out, quick: bridges(out, quick=quick),
    "crosscheck": lambda out, quick: crosschecks(out, quick=quick),
}
"""Checks by name, from the folder of runs and whether only the fast part is wanted."""


def literature(
    out: Path, only: Collection[str] = (), *, quick: bool = False, on_done: Callable[[str], None] | None = None
) -> list[Line]:
    """Lines of the named checks, default all; a check that cannot be computed is a line, and the others follow.

    ``out`` is the folder of the runs; ``on_done`` is told each name. `InputError` for unknown names.
    """
    for name in only:
        if name not in LITERATURE:
            raise refused("walkers check literature", f"no check {name!r}; {expected_of(name, LITERATURE)}")
    lines: list[Line] = []
    for name, compute in LITERATURE.items():
        if name in only or not only:
            try:
                part = list(compute(out, quick))
            except WalkersError as error:
                part = [Line.without_number(f"could not be computed: {error}", Verdict.ERROR)]
            lines += [replace(line, check=name) for line in part]
            if on_done:
                on_done(name)
    return lines
