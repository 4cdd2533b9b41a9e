"""What shared decks, long steps and runs that end early cost in accuracy: ``make bench-accuracy`` prints the table.

Every number of the comparison with the paper, as ``walkers figures`` makes it, against the same from a deck a point in
the laboratory frame, with 2 µs and 60 cycles (20 to settle). The latter takes a quarter of an hour on two cores; what
is finished in the folder is not run again.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from walkers.inputs.reading import read_toml
from walkers.inputs.sweep import Sweep, expand, load_sweep, shipped_sweeps
from walkers.paper.comparison import compare
from walkers.paper.make import COMPARED
from walkers.paper.sources import Sources
from walkers.runner import find_engine
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Options
from walkers.sweeps.shared_deck import make_runs

_WORKERS = 2
_FULL = {"drive.frame": "lab", "run.time_step": "2 us", "run.cycles": 60, "run.settling_cycles": 20}
_SMALL = {"°": 0.1, "mm/s": 0.01}
"""Differences that are none, by unit: a sliding velocity of a bead that rolls is all but zero."""


def in_full(name: str) -> Sweep:
    """A shipped sweep whose points are run for 60 cycles or what it says, with 2 µs, in the laboratory frame."""
    place = shipped_sweeps()[name]
    document: dict[str, Any] = dict(read_toml(place))
    document["zip"] = [
        {key: values for key, values in table.items() if key != "run.time_step"} for table in document.get("zip", [])
    ]
    given = _flat(document.get("set", {}))
    document["set"] = {**_FULL, **given}
    return expand(document, source=name, name=name, folder=place.parent)


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in table.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {prefix + key: value}
    return flat


def make_in_full(out: Path) -> Sources:
    """The compared sweeps, a deck a point."""
    engine = find_engine()
    for name in COMPARED:
        sweep = in_full(name)
        with ThreadPoolExecutor(_WORKERS) as pool:
            list(pool.map(lambda case: make_runs([case], out, engine), sweep.cases()))
        run_sweep(sweep, out, Options(_WORKERS))
        print(f"{name}: in full", file=sys.stderr)
    return Sources(out)


def table(fast: list[dict[str, Any]], full: list[dict[str, Any]]) -> str:
    """The numbers of the comparison, both ways."""
    lines = ["| number | unit | in full | as shipped | difference |", "|---|---|---|---|---|"]
    worst = 0.0
    for one, other in zip(fast, full, strict=True):
        if (
            one["engine"] is None
            or other["engine"] is None
            or one["key"].startswith(("fig2_gamma", "fig4a_gamma", "fig4b_gamma"))
        ):
            continue
        difference = abs(one["engine"] - other["engine"])
        if difference <= _SMALL.get(one["unit"], 0.0) and abs(other["engine"]) < 10.0 * _SMALL.get(one["unit"], 0.0):
            told = f"{difference:.1g} {one['unit']}"
        else:
            share = difference / abs(other["engine"])
            worst, told = max(worst, share), f"{share:.2%}"
        lines.append(f"| {one['what']} | {one['unit']} | {other['engine']:.5g} | {one['engine']:.5g} | {told} |")
    return "\n".join([*lines, "", f"Largest difference: {worst:.2%}."])


def main() -> None:
    """Print the table."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "runs")
    full = compare(make_in_full(out / "in-full"))
    for name in COMPARED:
        run_sweep(load_sweep(name), out, Options(_WORKERS))
    fast = compare(Sources(out))
    print(table(fast, full))


if __name__ == "__main__":
    main()
