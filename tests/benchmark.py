"""Measure what docs/explanation/performance.md states: ``make bench`` prints its table.

Times depend on the machine; the ratios of one run are what counts. Decks of a pile with the stock engine's capillary
model run in turn with today's, from the end of a shaken run: the same beads in each deck.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

import walkers
from walkers.inputs.reading import load_case
from walkers.inputs.tables.case import Case
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of
from walkers.runner.process import ALONE
from walkers.runner.run_directory import write_deck
from walkers.templates import deck as deck_module
from walkers.templates.deck import Deck, Segment, compose, plan_of
from walkers.templates.placement import Bead

REPEATS = 3
RATIOS = Path(__file__).with_name("benchmark_ratios.json")
"""User CPU time of decks for the stock engine's model over that of today's, as last measured."""
PILES = {"pile-200": ("pile-small", 40_000), "pile-1630": ("pile-fig1a", 12_000)}
"""Case and steps of each pile."""
ENGINE = ("liggghts", "-log", "none", "-in")
SCRIPT = "script.py"
_STOCK_MODEL = "gran model hertz tangential history cohesion easo/capillary/viscous"
_STOCK_LIQUID = """
fix tension all property/global surfaceTension scalar {liquid.surface_tension!r}
fix angle all property/global contactAngle peratomtype 0.0 0.0
fix content all property/global surfaceLiquidContentInitial scalar {liquid.volume_fraction!r}
fix viscosity all property/global fluidViscosity scalar {liquid.viscosity!r}
fix nearest all property/global minSeparationDistanceRatio scalar {ratio!r}
fix farthest all property/global maxSeparationDistanceRatio scalar 1.2
"""


def main() -> None:
    """CPU time of a step in today's decks and in minimal ones, in turn; medians of several."""
    ratios = {}
    print("| deck | µs a step: minimal | today | bead-steps/s |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (case, steps) in PILES.items():
            beads = shaken(case, Path(folder))
            deck, stock = compose_from(case, steps, beads), compose_for_stock(case, steps, beads)
            decks = {"today": deck, "minimal": replace(stock, text=minimal(stock, load_case(case)))}
            took: dict[str, list[float]] = {way: [] for way in decks}
            for way in [*decks] * REPEATS:
                place = Path(folder) / way / f"{name}-{len(took[way])}"
                place.mkdir(parents=True)
                write_deck(decks[way], place)
                text = without_steps(decks[way].text)
                took[way].append(
                    cpu_time(place, ENGINE, text, steps, environment(stock=way == "minimal"))
                    / steps
                )
            of_today, of_minimal = median(took["today"]), median(took["minimal"])
            ratios[name] = {"minimal": round(of_minimal / of_today, 2)}
            speed = deck.layout.atoms / of_today / 1e6
            print(
                f"| {name} | {1e6 * of_minimal:.1f} | {1e6 * of_today:.1f} | {speed:.1f} M |",
                flush=True,
            )
    print(f"before: {RATIOS.read_text('utf-8')}")
    RATIOS.write_text(json.dumps(ratios, indent=2) + "\n", encoding="utf-8")


def environment(*, stock: bool) -> dict[str, str]:
    """That of one process of the engine, with or without the contact model."""
    return ALONE | ({} if stock else {"LD_PRELOAD": str(plugin_of(find_engine()))})


def shaken(case: str, folder: Path, **settings: object) -> list[Bead]:
    """Beads of a pile that has come to rest and was shaken for a tenth of a second."""
    settings = {"run.ranks": 1, "run.duration": "0.1 s", "run.segment": "0.1 s"} | settings
    run = walkers.run(load_case(case, settings), folder / "starts")
    motion = run.motion
    now = zip(
        *(one[-1].tolist() for one in (motion.position, motion.velocity, motion.spin)), strict=True
    )
    return [
        Bead(number, tuple(place), radius, tuple(velocity), tuple(spin))
        for number, ((place, velocity, spin), radius) in enumerate(
            zip(now, motion.radius.tolist(), strict=True), 1
        )
    ]


def compose_from(case: str, steps: int, beads: list[Bead], **settings: object) -> Deck:
    """Today's deck of a pile from given beads, without frames between its ends."""
    plan = plan_of(load_case(case, {"run.ranks": 1} | settings), segment=Segment(0, steps, 0))
    scene = replace(plan.scene, beads=tuple(beads))
    return compose(replace(plan, scene=scene, sample_every=steps, bridge_every=steps))


def compose_for_stock(case: str, steps: int, beads: list[Bead]) -> Deck:
    """The deck of `compose_from` with beads that commands create.

    The stock model reads memory before the velocities of the beads at primitive walls. After ``read_data`` there is
    none, and the engine dies.
    """
    most_created = deck_module.MOST_CREATED
    deck_module.MOST_CREATED = len(beads)
    try:
        return compose_from(case, steps, beads)
    finally:
        deck_module.MOST_CREATED = most_created


def minimal(deck: Deck, case: Case) -> str:
    """The deck with the stock engine's model and walls: planes, of which each pulls half as much as a plane does."""
    text = re.sub(r"&\n *", " ", deck.text)
    text = re.sub(r"(?m)^(dump|dump_modify) +(pairs|walls) .*\n", "", text)
    walls = ""
    for number, plane in enumerate(re.findall(r"plane (\S+) (\S+) (\S+)  (\S+) (\S+) (\S+)", text)):
        axis = max(range(3), key=lambda one: abs(float(plane[3 + one])))
        kind = f"primitive type 2 {'xyz'[axis]}plane {plane[axis]}"
        walls += f"fix wall_{number} all wall/gran {_STOCK_MODEL[5:]} {kind}\n"
    walls += "variable push equal ${peak_acceleration}*sin(2*PI*${frequency}*${time_step}*step)\n"
    walls += "fix push all gravity v_push vector 0.0 0.0 1.0\n"
    walls += "fix gravity all gravity ${gravity} vector 0.0 0.0 -1.0\n"
    text = re.sub(r"(?m)^fix +walls all .*\n", "", text)
    ratio = case.contact.roughness.bead_wall / case.radii[0]
    model = f"pair_style {_STOCK_MODEL}\n" + _STOCK_LIQUID.format(
        liquid=case.liquid.of_bridges, ratio=ratio
    )
    text = re.sub(r"(?m)^pair_style .*\n", lambda _: model, text)
    return re.sub(r"(?m)^fix +motion ", lambda found: walls + found[0], text)


def without_steps(text: str) -> str:
    """A deck with STEPS where its number of steps was."""
    return re.sub(r"(?m)^run .*", "run STEPS", text)


def cpu_time(
    folder: Path, command: Sequence[str], text: str, steps: int, environment: Mapping[str, str]
) -> float:
    """User CPU time of steps of a script, s: without that of its start. The script has STEPS for their number."""
    seconds = []
    for number in (0, steps):
        (folder / SCRIPT).write_text(text.replace("STEPS", str(number)), "utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        how = {"env": {**os.environ, **environment}, "capture_output": True}
        subprocess.run([*command, SCRIPT], cwd=folder, check=True, **how)
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return seconds[1] - seconds[0]


if __name__ == "__main__":
    main()
