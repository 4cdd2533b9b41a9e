"""Measure what docs/explanation/performance.md states: ``make bench`` prints its tables.

Seconds depend on the machine; the shares and ratios of one run are what counts. The decks of five cases as they were
written for the stock engine's capillary model (tests/benchmark_decks.tar.xz) run in turn with today's, and each time
the ratios are written beside those of the time before.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.runner.binary import find_engine, plugin_of
from walkers.runner.directory import write_deck
from walkers.templates.deck import DECK_NAME, Segment, render_deck
from walkers.templates.engine import ALONE
from walkers.theory.motion import Friction, Walker, walk

_PROGRAM = str(Path(sys.executable).with_name("walkers"))
_REPEATS = 3
_STOCK_DECKS = Path(__file__).with_name("benchmark_decks.tar.xz")
RATIOS = Path(__file__).with_name("benchmark_ratios.json")
"""How many times faster today's decks are than those for the stock engine, as last measured."""
Decks = Mapping[str, Callable[[], tuple[Case, Segment | None]]]
DECKS: Decks = {
    "walkers-6": lambda: (load_case("fig1b", {"run.cycles": 20}), None),
    "walkers-96": lambda: (load_case("fig1b", {"dimers.replicates": 96, "run.cycles": 20}), None),
    "climber": lambda: (load_case("climber", {"run.cycles": 60, "run.settling_cycles": 10}), None),
    "pile-200": lambda: (load_case("pile-small"), Segment(0, 40_000, 0)),
    "pile-1630": lambda: (load_case("pile-fig1a", {"run.ranks": 1}), Segment(0, 12_000, 0)),
}
"""Of the same cases and steps as the stock engine's decks; piles are shaken from where they were poured."""
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


def _seconds(command: Sequence[str], folder: Path) -> float:
    begin = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - begin


def measure_decks(folder: Path) -> None:
    """Time of a step in decks for the stock engine and in today's, in turn; minima of several."""
    with tarfile.open(_STOCK_DECKS) as stored:
        stored.extractall(folder / "stock", filter="data")
    plugin, before = plugin_of(find_engine()), json.loads(RATIOS.read_text()) if RATIOS.exists() else {}
    ratios: dict[str, float] = {}
    print(
        "| deck | stock engine, µs a step | today | bead-steps/s | times faster | before |\n|---|---|---|---|---|---|"
    )
    for name, made in DECKS.items():
        case, segment = made()
        deck = render_deck(case, segment)
        (folder / name).mkdir()
        write_deck(deck, folder / name)
        pairs = [
            (_loop(folder / "stock" / name, {}), _loop(folder / name, {"LD_PRELOAD": str(plugin)}))
            for _ in range(_REPEATS)
        ]
        stock, today = (min(column) / deck.layout.steps for column in zip(*pairs, strict=True))
        ratios[name] = round(stock / today, 2)
        cells = (name, f"{stock * 1e6:.1f}", f"{today * 1e6:.1f}", f"{deck.layout.atoms / today / 1e6:.1f} M")
        print("|", " | ".join([*cells, str(ratios[name]), str(before.get(name, ""))]), "|")
    RATIOS.write_text(json.dumps(ratios, indent=2) + "\n", encoding="utf-8")


def _loop(folder: Path, environment: Mapping[str, str]) -> float:
    """Time in the engine's loop of a deck, s."""
    command = [str(find_engine().path), "-log", "none", "-in", DECK_NAME]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **ALONE, **environment}, check=True, capture_output=True, text=True
    )
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("Loop time of")]
    return float(line.split()[3])


def measure_program(folder: Path) -> None:
    """Time of ``walkers --help`` and of everything in ``walkers run fig1b`` that is not the engine process."""
    print("| | seconds |\n|---|---|")
    print(f"| `walkers --help` | {min(_seconds([_PROGRAM, '--help'], folder) for _ in range(_REPEATS)):.2f} |")
    overheads, engines = [], []
    for _ in range(_REPEATS):
        shutil.rmtree(folder / "runs", ignore_errors=True)
        total = _seconds([_PROGRAM, "run", "fig1b", "--json"], folder)
        (manifest,) = folder.glob("runs/*/manifest.json")
        engine = json.loads(manifest.read_text())["seconds"]["engine"]
        overheads.append(total - engine)
        engines.append(engine)
    print(f"| `walkers run fig1b`, the engine process | {min(engines):.2f} |")
    print(f"| `walkers run fig1b`, everything else | {min(overheads):.2f} |")
    for command in ("plot", "export --to vtk", "render"):
        print(f"| `walkers {command} fig1b` | {_seconds([_PROGRAM, *command.split(), 'fig1b'], folder):.2f} |")


def measure_figures(folder: Path) -> None:
    """Time of ``walkers paper figures`` from nothing, and of the engines within it."""
    command = [_PROGRAM, "paper", "figures", "--out", str(folder / "of-figures"), "--to", str(folder / "figures")]
    seconds, again = _seconds(command, folder), _seconds(command, folder)
    loops = _loops(folder / "of-figures")
    print("\n| | |\n|---|---|")
    print(f"| `walkers paper figures` from nothing, wall time | {seconds:.0f} s |")
    print(f"| of the engines' loops, on all cores | {sum(loops.values()):.0f} core-seconds in {len(loops)} decks |")
    print(f"| the same again, all runs finished | {again:.0f} s |")


def _loops(out: Path) -> dict[str, float]:
    """Time in the engine's loop of each deck, s."""
    manifests = {path.parent.name: json.loads(path.read_text()) for path in out.glob("*/manifest.json")}
    return {
        run.get("shared_deck", {}).get("first", name): run["seconds"]["engine_loop"] for name, run in manifests.items()
    }


def measure_sweeps(folder: Path) -> None:
    """What a point costs beside the engine, what planning ten thousand does, and the sweep of Fig. 2."""
    (folder / "grid.toml").write_text(_GRID)
    (folder / "trivial.toml").write_text(_TRIVIAL)
    print("\n| | seconds |\n|---|---|")
    for name, command in {
        "dry run of 10,000 points": ["sweep", "grid.toml", "--dry-run"],
        "1,000 points of two cycles, two decks at once": ["sweep", "trivial.toml", "-j", "2", "--out", "of-points"],
        "the same again, all finished": ["sweep", "trivial.toml", "--out", "of-points"],
        "its table": ["list", "of-points/trivial", "--json"],
        "`fig2`, 80 points of 6 walkers, two decks at once": ["sweep", "fig2", "-j", "2", "--out", "of-fig2"],
    }.items():
        print(f"| {name} | {_seconds([_PROGRAM, *command], folder):.2f} |", flush=True)
    for name in ("of-points", "of-fig2"):
        loops = _loops(folder / name)
        print(f"| {name}: the engines' loops in {len(loops)} decks | {sum(loops.values()):.2f} |")


def measure_theory() -> None:
    """How many walkers a second the theory integrates on one core, compiled."""
    print("\n| friction | walkers a second |\n|---|---|")
    case, count = load_case("fig1b"), 1000
    wet, accelerations = Walker.of_case(case), np.linspace(5.0, 60.0, count)
    dry, coulomb = replace(wet, resistances=np.zeros_like(wet.resistances)), Friction.of_cases(case)
    laws = {
        "the paper's, κ v F": (dry, Friction(linear=33.0)),
        "Coulomb and bridges": (wet, coulomb),
        "Coulomb, dry": (dry, coulomb),
    }
    for name, (walker, friction) in laws.items():
        walk(walker, friction, case.drive.frequency, 5.0)
        begin = time.perf_counter()
        walk(walker, friction, case.drive.frequency, accelerations)
        print(f"| {name} | {count / (time.perf_counter() - begin):.0f} |")


def measure_large(folder: Path) -> None:
    """A second of ten thousand beads on two ranks, and a tenth of it on one: bead-steps a second, memory, speed-up."""
    print("\n| ranks | beads | shaken | steps | bead-steps/s | largest process |\n|---|---|---|---|---|---|")
    large = {"mixture.count": 10_000, "boundary.width": "18 mm", "boundary.height": "120 mm"}
    for ranks, duration in ((1, "0.1 s"), (2, "1 s")):
        changes = {**large, "run.ranks": ranks, "run.duration": duration, "run.segment": duration}
        settings = [part for key, value in changes.items() for part in ("--set", f"{key}={value}")]
        _seconds([_PROGRAM, "run", "pile-fig1a", *settings, "--out", f"large-{ranks}"], folder)
        (run,) = (json.loads(path.read_text()) for path in folder.glob(f"large-{ranks}/*/manifest.json"))
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
        speed = run["steps"] * 10_000 / run["seconds"]["engine_loop"]
        print(
            f"| {ranks} | 10,000 | {duration} | {run['steps']} | {speed / 1e6:.1f} M | {memory / 1e6:.0f} MB |",
            flush=True,
        )


def main() -> None:
    """Print the tables, or that of ten thousand beads alone if so asked (a quarter of an hour)."""
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1:] == ["large"]:
            measure_large(Path(folder))
            return
        measure_program(Path(folder))
        measure_decks(Path(folder))
        measure_figures(Path(folder))
        measure_sweeps(Path(folder))
    measure_theory()


if __name__ == "__main__":
    main()
