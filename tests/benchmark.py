"""Measure what docs/explanation/performance.md states: ``make bench`` prints its tables.

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
from math import sqrt
from pathlib import Path
from typing import Literal

import numpy as np

from walkers import run as run_case
from walkers.inputs import load_case
from walkers.inputs.case import Case
from walkers.runner import FinishedRun, find_engine
from walkers.runner.directory import write_deck
from walkers.runner.ensemble import finished_place
from walkers.sweeps.record import read_record
from walkers.templates.deck import DECK_NAME, render_deck
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
        frames: tuple[Literal["lab", "container"], ...] = ("lab", "container")
        for frame in frames:
            microseconds = _step_microseconds(_ensemble(count, frame), folder / "steps")
            print(f"| {count} | {frame} | {microseconds:.2f} | {microseconds / count:.2f} |")


def _ensemble(count: int, frame: Literal["lab", "container"] = "container") -> Case:
    case = load_case("fig1b")
    return replace(
        case,
        drive=replace(case.drive, frame=frame),
        walkers=(replace(case.walkers[0], replicates=count),),
        run=replace(case.run, cycles=20, settling_cycles=5, until_steady=False, cycles_per_segment=20),
    )


def _step_microseconds(case: Case, out: Path) -> float:
    loops = [_engine_loop(run_case(case, out, force=True).directory) for _ in range(_REPEATS)]
    return min(loops) / case.run.steps * 1e6


_YADE = """
import time
from yade import *
beads = O.materials.append(FrictMat(young={modulus}, poisson=0.23, density={density}, frictionAngle=0.3))
O.bodies.append(utils.wall(0.0, axis=2, material=beads))
for number in range({count}):
    for x, radius in ((0.0, {large}), ({apart}, {small})):
        O.bodies.append(utils.sphere((x, 0.03 * number, radius), radius, material=beads))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist={small} / 2),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.3)],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(gravity=(0, 0, -9.81), damping=0),
]
O.dt = {time_step}
O.run(1000, True)
begin = time.perf_counter()
O.run({steps}, True)
print("MICROSECONDS", (time.perf_counter() - begin) / {steps} * 1e6)
"""
"""Dimers at rest without liquid, by another engine: what its contacts alone cost a step."""


def measure_alternatives(folder: Path) -> None:
    """Wall time of the engine a step and walker: one walker in a deck or many, by hand, and YADE if it is there."""
    rows = []
    for count in (1, 96):
        case = _ensemble(count)
        directory = run_case(case, folder / "alternatives", force=True).directory
        wall = float(FinishedRun(directory).manifest["seconds"]["engine"])
        rows.append((f"`walkers run`, {count} in a deck", wall / case.run.steps * 1e6 / count))
        rows.append((f"the same deck by hand, {count}", _bare(case, folder / f"bare-{count}") / count))
        if shutil.which("yade"):
            rows.append((f"YADE, {count} dry dimers at rest", _yade(case, folder / f"yade-{count}.py", count) / count))
    print("\n| engine | µs a step and walker |\n|---|---|")
    for name, microseconds in rows:
        print(f"| {name} | {microseconds:.2f} |")


def _bare(case: Case, folder: Path) -> float:
    """Wall time of a deck run by hand, start-up and all, µs a step."""
    folder.mkdir()
    write_deck(render_deck(case), folder)
    with (folder / "out").open("wb") as out:
        begin = time.perf_counter()
        subprocess.run([str(find_engine().path), "-in", DECK_NAME], cwd=folder, stdout=out, check=True)
        return (time.perf_counter() - begin) / case.run.steps * 1e6


def _yade(case: Case, script: Path, count: int) -> float:
    large, small = case.walkers[0].radii
    values = {"modulus": case.contact.youngs_modulus, "density": case.density, "time_step": case.run.time_step}
    apart = 2.0 * sqrt(large * small)
    script.write_text(
        _YADE.format(**values, large=large, small=small, apart=apart, count=count, steps=60_000 // count + 1000)
    )
    done = subprocess.run(["yade", "-n", "-x", "-j1", str(script)], capture_output=True, text=True, check=True)
    return float(done.stdout.partition("MICROSECONDS")[2].split()[0])


def measure_figures(folder: Path) -> None:
    """Time of ``walkers figures`` from nothing, and of the engines within it."""
    program, out = str(Path(sys.executable).with_name("walkers")), folder / "figures-runs"
    seconds = _seconds([program, "figures", "--out", str(out), "--to", str(folder / "figures")], folder)
    manifests = [*out.glob("*/manifest.json"), *out.glob("ensembles/*/manifest.json")]
    decks = [json.loads(path.read_text()) for path in manifests]
    loops = {deck["run"]: deck["seconds"]["engine_loop"] for deck in decks}
    places = [finished_place(out, name) for name in read_record(out / "fig2").runs]
    fig2 = {place.parent.name if place.parent != out else place.name for place in places if place}
    print("\n| | |\n|---|---|")
    print(f"| `walkers figures` from nothing, wall time | {seconds:.0f} s |")
    print(f"| of the engines' loops, on all cores | {sum(loops.values()):.0f} core-seconds in {len(loops)} decks |")
    print(f"| of the 480 walkers of Fig. 2 | {sum(loops[name] for name in fig2):.1f} core-seconds |")
    again = _seconds([program, "figures", "--out", str(out), "--to", str(folder / "figures")], folder)
    print(f"| the same again, all runs finished | {again:.0f} s |")


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
        measure_alternatives(Path(folder))
        measure_figures(Path(folder))
    measure_theory()


if __name__ == "__main__":
    main()
