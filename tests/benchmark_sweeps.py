"""Measure what docs/explanation/performance.md states of sweeps: ``make bench-sweeps`` prints its tables.

It takes a quarter of an hour. Seconds depend on the machine; the shares and ratios of one run are what counts.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from walkers import run as run_case
from walkers.inputs.sweep import load_sweep
from walkers.runner.cost import START_UP_SECONDS

_PROGRAM = str(Path(sys.executable).with_name("walkers"))
_WORKERS = 2
_GRID = """
case = "fig1b"
[axes]
drive.frequency         = { linspace = ["60 Hz", "90 Hz", 100] }
drive.peak_acceleration = { linspace = ["0.5 g", "10 g", 100] }
"""
_TRIVIAL = """
case = "fig1b"
[set]
dimers.replicates   = 1
run.cycles          = 2
run.settling_cycles = 0
[axes]
dimers.angle = { linspace = ["0 deg", "90 deg", 1000] }
"""


@dataclass(frozen=True)
class _Cost:
    """Wall time in s and largest memory in MB of a command."""

    seconds: float
    megabytes: float


def _run(folder: Path, *arguments: str) -> _Cost:
    begin = time.perf_counter()
    process = subprocess.Popen([_PROGRAM, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, arguments
    return _Cost(time.perf_counter() - begin, usage.ru_maxrss / 1024.0)


def _engine_seconds(manifests: Iterable[Path]) -> tuple[int, float, float]:
    """Number of decks, time in the engines' loops and of the engines as a whole, s."""
    runs = [json.loads(manifest.read_text()) for manifest in manifests]
    decks = {run.get("shared_deck", {}).get("first", run["run"]): run["seconds"] for run in runs}
    seconds = list(decks.values())
    return len(seconds), sum(one["engine_loop"] for one in seconds), sum(one["engine"] for one in seconds)


def measure_machinery(folder: Path) -> None:
    """What a point costs beside the engine, and what planning ten thousand does."""
    (folder / "grid.toml").write_text(_GRID)
    (folder / "trivial.toml").write_text(_TRIVIAL)
    print("| | seconds | MB |\n|---|---|---|")
    dry = _run(folder, "sweep", "grid.toml", "--dry-run")
    print(f"| dry run of 10,000 points | {dry.seconds:.2f} | {dry.megabytes:.0f} |")
    real = _run(folder, "sweep", "trivial.toml", "-j", str(_WORKERS))
    decks, _, engine = _engine_seconds(folder.glob("runs/*/manifest.json"))
    name = f"1,000 points of two cycles in {decks} decks, {_WORKERS} at once"
    print(f"| {name} | {real.seconds:.2f} | {real.megabytes:.0f} |")
    overhead = (real.seconds - engine / _WORKERS) / 1000
    print(f"| of that beside the engines, a point | {overhead * 1e3:.1f} ms | |")
    again = _run(folder, "sweep", "trivial.toml")
    print(f"| the same again, all finished | {again.seconds:.2f} | {again.megabytes:.0f} |")
    table = _run(folder, "table", "runs/trivial", "--csv")
    print(f"| its table | {table.seconds:.2f} | {table.megabytes:.0f} |")


def measure_fig2(folder: Path) -> None:
    """The sweep of Fig. 2 against the time of its engines, and against a deck for each walker."""
    print("\n| fig2, 80 points of 6 walkers | decks | engines' loops + start-up | wall time × cores | ratio |")
    print("|---|---|---|---|---|")
    swept = _run(folder, "sweep", "fig2", "-j", str(_WORKERS))
    decks, loops, _ = _engine_seconds(folder.glob("runs/fig1b-*/manifest.json"))
    _row("as a sweep", decks, loops + START_UP_SECONDS * decks, swept.seconds * _WORKERS)
    apart = [
        replace(case, walkers=(replace(case.walkers[0], replicates=1),), seed=seed)
        for case in load_sweep("fig2").cases()
        for seed in range(6)
    ]
    begin = time.perf_counter()
    with ThreadPoolExecutor(_WORKERS) as pool:
        list(pool.map(lambda case: run_case(case, folder / "apart"), apart))
    seconds = time.perf_counter() - begin
    decks, loops, _ = _engine_seconds((folder / "apart").glob("*/manifest.json"))
    _row("a deck for each walker", decks, loops + START_UP_SECONDS * decks, seconds * _WORKERS)


def _row(name: str, decks: int, needed: float, taken: float) -> None:
    print(f"| {name} | {decks} | {needed:.0f} s | {taken:.0f} s | {taken / needed:.3f} |", flush=True)


def main() -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as folder:
        measure_machinery(Path(folder))
        measure_fig2(Path(folder))


if __name__ == "__main__":
    main()
