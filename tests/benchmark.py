"""Measure what docs/explanation/performance.md states: ``make bench`` prints its table.

Times depend on the machine; the ratios of one run are what counts. Decks for the stock engine's capillary model run in
turn with today's, and each time the ratios are written beside those of the time before. Piles begin as the end of a
shaken run, the same beads in each deck.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

import walkers
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.postprocess.dump import BinaryDump
from walkers.runner.binary import find_engine, plugin_of
from walkers.runner.directory import write_deck
from walkers.runner.launch import ALONE
from walkers.templates.deck import DECK_NAME, Deck, Segment, compose, plan_of

_PROGRAM = str(Path(sys.executable).with_name("walkers"))
_REPEATS = 3
_STOCK_DECKS = Path(__file__).with_name("benchmark_decks.tar.xz")
RATIOS = Path(__file__).with_name("benchmark_ratios.json")
"""User CPU time of the decks for the stock engine over that of today's, as last measured; contacts of piles."""
_PILES = {"pile-200": ("pile-small", 40_000), "pile-1630": ("pile-fig1a", 12_000)}
"""Case and steps of each pile."""
_WALKERS: Mapping[str, Callable[[], Case]] = {
    "walkers-6": lambda: load_case("fig1b", {"run.cycles": 20}),
    "walkers-96": lambda: load_case("fig1b", {"dimers.replicates": 96, "run.cycles": 20}),
    "climber": lambda: load_case("climber", {"run.cycles": 60, "run.settling_cycles": 10}),
}
_TIMES = {"walkers-6": 10, "walkers-96": 1, "climber": 2}
"""How often the steps of a deck are repeated, so that each takes at least a second."""
_STOCK_MODEL = "gran model hertz tangential history cohesion easo/capillary/viscous"
_STOCK_LIQUID = """
fix tension all property/global surfaceTension scalar {liquid.surface_tension!r}
fix angle all property/global contactAngle peratomtype 0.0 0.0
fix content all property/global surfaceLiquidContentInitial scalar {liquid.volume_fraction!r}
fix viscosity all property/global fluidViscosity scalar {liquid.viscosity!r}
fix nearest all property/global minSeparationDistanceRatio scalar {contact.roughness.bead_wall / case.radii[0]!r}
fix farthest all property/global maxSeparationDistanceRatio scalar 1.2
"""


def measure_decks(folder: Path) -> None:
    """CPU time of a step in decks for the stock engine and in today's, in turn; medians of several."""
    with tarfile.open(_STOCK_DECKS) as stored:
        stored.extractall(folder / "former", filter="data")
    preload = {"LD_PRELOAD": str(plugin_of(find_engine()))}
    ratios: dict[str, dict[str, float]] = {}
    print("| deck | µs a step: former | minimal | today | bead-steps/s | ratios, contacts of a bead |")
    print("|---|---|---|---|---|---|")
    for name in (*_WALKERS, *_PILES):
        deck = compose(plan_of(_WALKERS[name]())) if name in _WALKERS else _shaken_pile(name, folder)
        folders = {
            way: folder / way / name for way in ("former", "minimal", "today") if way != "minimal" or name in _PILES
        }
        _write(deck, folders["today"])
        if name in _PILES:
            _write(replace(deck, text=_minimal(deck, load_case(_PILES[name][0]))), folders["minimal"])
            _begin_as(deck, folders["former"] / DECK_NAME)
        steps = deck.layout.steps * _TIMES.get(name, 1)
        rounds = [
            {way: _cpu_time(place, preload if way == "today" else {}, steps) for way, place in folders.items()}
            for _ in range(_REPEATS)
        ]
        took = {way: median(one[way] for one in rounds) / steps for way in folders}
        ratios[name] = {way: round(took[way] / took["today"], 2) for way in folders if way != "today"}
        if name in _PILES:
            contacts = {way: _contacts(place, deck.layout.atoms) for way, place in folders.items()}
            ratios[name] |= {
                f"contacts, {way}, {when}": round(number, 1)
                for way, numbers in contacts.items()
                for when, number in zip(("begin", "end"), numbers, strict=True)
            }
        cells = [f"{took[way] * 1e6:.1f}" if way in took else "" for way in ("former", "minimal", "today")]
        print(
            "|", " | ".join([name, *cells, f"{deck.layout.atoms / took['today'] / 1e6:.1f} M", str(ratios[name])]), "|"
        )
    print(f"before: {RATIOS.read_text('utf-8')}")
    RATIOS.write_text(json.dumps(ratios, indent=2) + "\n", encoding="utf-8")


def _write(deck: Deck, folder: Path) -> None:
    folder.mkdir(parents=True)
    write_deck(deck, folder)


def _shaken_pile(name: str, folder: Path) -> Deck:
    """Today's deck of a pile that has come to rest and was shaken for a tenth of a second."""
    case, steps = _PILES[name]
    settings = {"run.ranks": 1, "run.duration": "0.1 s", "run.segment": "0.1 s"}
    motion = walkers.run(load_case(case, settings), folder / "starts").motion
    plan = plan_of(load_case(case, {"run.ranks": 1}), segment=Segment(0, steps, 0))
    now = zip(*(one[-1].tolist() for one in (motion.position, motion.velocity, motion.spin)), strict=True)
    beads = [
        replace(bead, centre=tuple(place), velocity=tuple(velocity), spin=tuple(spin))
        for bead, (place, velocity, spin) in zip(plan.scene.beads, now, strict=True)
    ]
    scene = replace(plan.scene, beads=tuple(beads))
    return compose(replace(plan, scene=scene, sample_every=steps, bridge_every=steps))


def _minimal(deck: Deck, case: Case) -> str:
    """The deck with the stock engine's model and walls: planes, of which each pulls half as much as a plane does."""
    text = re.sub(r"&\n *", " ", deck.text)
    text = re.sub(r"(?m)^(dump|dump_modify) +(pairs|walls) .*\n", "", text)
    planes = re.findall(r"plane (\S+) (\S+) (\S+)  (\S+) (\S+) (\S+)", text)
    walls = ""
    for number, plane in enumerate(planes):
        axis = max(range(3), key=lambda one: abs(float(plane[3 + one])))
        walls += (
            f"fix wall_{number} all wall/gran {_STOCK_MODEL[5:]} primitive type 2 {'xyz'[axis]}plane {plane[axis]}\n"
        )
    walls += "variable push equal ${peak_acceleration}*sin(2*PI*${frequency}*${time_step}*step)\n"
    walls += "fix push all gravity v_push vector 0.0 0.0 1.0\n"
    walls += "fix gravity all gravity ${gravity} vector 0.0 0.0 -1.0\n"
    text = re.sub(r"(?m)^fix +walls all .*\n", "", text)
    model = f"pair_style {_STOCK_MODEL}\n" + _STOCK_LIQUID.format(liquid=case.liquid.of_bridges, contact=case.contact)
    text = re.sub(r"(?m)^pair_style .*\n", lambda _: model, text)
    return re.sub(r"(?m)^fix +motion ", lambda found: walls + found[0], text)


def _begin_as(deck: Deck, former: Path) -> None:
    """Put the beads of a former deck, which come after atoms that carry the walls' velocity, where a deck has them."""
    lines = re.findall(r"(?m)^create_atoms .*\n", deck.text)
    motions = re.findall(r"(?m)^(set +atom) (\d+) (vx .*\n)", deck.text)
    before = former.read_text("utf-8").splitlines(keepends=True)
    numbers = [number for number, line in enumerate(before) if line.startswith("create_atoms ")]
    carriers = len(numbers) - len(lines)
    for number, line in zip(numbers[carriers:], lines, strict=True):
        before[number] = line
    first = next(number for number, line in enumerate(before) if line.startswith("group "))
    before[first:first] = [f"{word} {int(bead) + carriers} {rest}" for word, bead, rest in motions]
    every = re.sub(r"(?m)^(dump +beads .* custom) \d+", rf"\1 {deck.layout.steps}", "".join(before))
    former.write_text(every, "utf-8")


def _cpu_time(folder: Path, environment: Mapping[str, str], steps: int) -> float:
    """User CPU time of steps of a deck, s: without that of its start."""
    text, seconds = (folder / DECK_NAME).read_text("utf-8"), []
    for number in (0, steps):
        name = f"{number}.{DECK_NAME}"
        (folder / name).write_text(re.sub(r"(?m)^run .*", f"run {number}", text), "utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [str(find_engine().path), "-log", "none", "-in", name]
        subprocess.run(command, cwd=folder, env={**os.environ, **ALONE, **environment}, check=True, capture_output=True)
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return seconds[1] - seconds[0]


def _contacts(folder: Path, beads: int) -> list[float]:
    """Number of touching neighbours of a bead at the begin and at the end of a deck."""
    frames = BinaryDump(folder / "beads.bin", ("id", "type", "radius", "x", "y", "z", *"vwabcd")).stack()
    found = []
    for frame in (frames[0, -beads:], frames[-1, -beads:]):
        radius, place = frame[:, 2], frame[:, 3:6]
        apart = np.linalg.norm(place[:, None] - place, axis=-1)
        found.append(float((apart < radius[:, None] + radius).sum() - beads) / beads)
    return found


def measure_large(folder: Path) -> None:
    """A second of ten thousand beads on two ranks, and a tenth of it on one: bead-steps a second, memory, speed-up."""
    print("\n| ranks | beads | shaken | steps | bead-steps/s | largest process |\n|---|---|---|---|---|---|")
    large = {"mixture.count": 10_000, "boundary.width": "18 mm", "boundary.height": "120 mm"}
    for ranks, duration in ((1, "0.1 s"), (2, "1 s")):
        changes = {**large, "run.ranks": ranks, "run.duration": duration, "run.segment": duration}
        settings = [part for key, value in changes.items() for part in ("--set", f"{key}={value}")]
        command = [_PROGRAM, "run", "pile-fig1a", *settings, "--out", f"large-{ranks}"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        (run,) = (json.loads(path.read_text()) for path in folder.glob(f"large-{ranks}/*/manifest.json"))
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
        speed = run["steps"] * 10_000 / run["seconds"]["engine_loop"]
        print(
            f"| {ranks} | 10,000 | {duration} | {run['steps']} | {speed / 1e6:.1f} M | {memory / 1e6:.0f} MB |",
            flush=True,
        )


def main() -> None:
    """Print the table, or that of ten thousand beads alone if so asked (a quarter of an hour)."""
    with tempfile.TemporaryDirectory() as folder:
        measure = measure_large if sys.argv[1:] == ["large"] else measure_decks
        measure(Path(folder))


if __name__ == "__main__":
    main()
