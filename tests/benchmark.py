"""Measure what docs/performance.md states: ``make bench`` prints its tables.

Seconds depend on the machine; the shares and ratios of one run are what counts.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkers import run as run_case
from walkers.inputs import load_case
from walkers.inputs.case import Case
from walkers.runner import FinishedRun
from walkers.theory.friction import Friction
from walkers.theory.motion import Walker, walk
from walkers.theory.prediction import friction_of

_REPEATS = 3


def _seconds(command: Sequence[str], folder: Path) -> float:
    begin = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - begin


def measure_program(folder: Path) -> None:
    """Time of ``walkers --help`` and of everything in ``walkers run fig1b`` that is not the engine process."""
    program = str(Path(sys.executable).with_name("walkers"))
    print("| | seconds |\n|---|---|")
    print(f"| `walkers --help` | {min(_seconds([program, '--help'], folder) for _ in range(_REPEATS)):.2f} |")
    overheads, engines = [], []
    for _ in range(_REPEATS):
        shutil.rmtree(folder / "runs", ignore_errors=True)
        total = _seconds([program, "run", "fig1b", "--json"], folder)
        (manifest,) = folder.glob("runs/*/manifest.json")
        engine = json.loads(manifest.read_text())["seconds"]["engine"]
        overheads.append(total - engine)
        engines.append(engine)
    print(f"| `walkers run fig1b`, the engine process | {min(engines):.2f} |")
    print(f"| `walkers run fig1b`, everything else | {min(overheads):.2f} |")
    for command in ("plot", "vtk", "render"):
        print(f"| `walkers {command} fig1b` | {_seconds([program, command, 'fig1b'], folder):.2f} |")


def measure_steps(folder: Path) -> None:
    """Cost of a step against the number of walkers in a deck, in both frames."""
    print("\n| walkers in a deck | frame | µs a step | µs a step and walker |\n|---|---|---|---|")
    for count in (1, 6, 24, 96):
        for frame in ("lab", "container"):
            microseconds = _step_microseconds(_ensemble(count, frame), folder / "steps")
            print(f"| {count} | {frame} | {microseconds:.2f} | {microseconds / count:.2f} |")


def _ensemble(count: int, frame: str) -> Case:
    case = load_case("fig1b")
    return replace(
        case,
        drive=replace(case.drive, frame="lab" if frame == "lab" else "container"),
        walkers=(replace(case.walkers[0], replicates=count),),
        run=replace(case.run, cycles=20, settling_cycles=5),
    )


def _step_microseconds(case: Case, out: Path) -> float:
    loops = [_engine_loop(run_case(case, out, force=True).directory) for _ in range(_REPEATS)]
    return min(loops) / case.run.steps * 1e6


def _engine_loop(directory: Path) -> float:
    return float(FinishedRun(directory).manifest["seconds"]["engine_loop"])


def measure_theory() -> None:
    """How many walkers a second the theory integrates on one core, compiled."""
    print("\n| friction | walkers a second |\n|---|---|")
    case, count = load_case("fig1b"), 1000
    walker, accelerations = Walker.of_case(case), np.linspace(5.0, 60.0, count)
    laws = {
        "the paper's, κ v F": Friction(linear=33.0),
        "Coulomb and bridges": friction_of(case, viscous=True),
        "Coulomb, dry": friction_of(case, viscous=False),
    }
    for name, friction in laws.items():
        walk(walker, friction, case.drive.frequency, 5.0)
        begin = time.perf_counter()
        walk(walker, friction, case.drive.frequency, accelerations)
        print(f"| {name} | {count / (time.perf_counter() - begin):.0f} |")


def main() -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as folder:
        measure_program(Path(folder))
        measure_steps(Path(folder))
    measure_theory()


if __name__ == "__main__":
    main()
