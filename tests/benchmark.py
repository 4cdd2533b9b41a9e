"""Measure what docs/explanation/performance.md states: ``make bench`` prints its table.

Times depend on the machine, so the ratios within one call are what counts. Decks of a pile with the
stock engine's capillary model run in turn with today's. Both begin with the same beads, from the
end of a shaken run.
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
PILES = {"pile-200": "pile-small", "pile-1630": "pile-fig1a"}
"""The case of each pile, by its name in the table."""
STEPS = {"pile-200": 40_000, "pile-1630": 12_000}
"""Number of timed steps of each pile."""
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
    """Print the CPU time of a step in today's decks and in minimal ones, and record the ratios."""
    ratios = {}
    print("| deck | µs a step: minimal | today | bead-steps/s |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, case in PILES.items():
            beads = shaken(case, Path(folder))
            of_today, of_minimal = seconds_per_step(name, beads, Path(folder))
            ratios[name] = {"minimal": round(of_minimal / of_today, 2)}
            speed = len(beads) / of_today / 1e6
            print(
                f"| {name} | {1e6 * of_minimal:.1f} | {1e6 * of_today:.1f} | {speed:.1f} M |",
                flush=True,
            )
    print(f"before: {RATIOS.read_text('utf-8')}")
    RATIOS.write_text(json.dumps(ratios, indent=2) + "\n", encoding="utf-8")


def seconds_per_step(name: str, beads: list[Bead], folder: Path) -> tuple[float, float]:
    """User CPU time of a step of a pile, s, in today's deck and in the minimal one.

    The two decks run in turn, several times; the times are medians.
    """
    case = PILES[name]
    steps = STEPS[name]
    today = compose_from(case, steps, beads)
    stock = compose_for_stock(case, steps, beads)
    stock = replace(stock, text=minimal(stock, load_case(case)))
    seconds_of_today = []
    seconds_of_stock = []
    for number in range(REPEATS):
        place = folder / f"{name}-{number}"
        seconds_of_today.append(_seconds(today, steps, place / "today", is_stock=False))
        seconds_of_stock.append(_seconds(stock, steps, place / "minimal", is_stock=True))
    return median(seconds_of_today) / steps, median(seconds_of_stock) / steps


def _seconds(deck: Deck, steps: int, place: Path, *, is_stock: bool) -> float:
    """User CPU time of the steps of a deck, s."""
    place.mkdir(parents=True)
    write_deck(deck, place)
    return cpu_time(place, ENGINE, without_steps(deck.text), steps, environment(stock=is_stock))


def environment(*, stock: bool) -> dict[str, str]:
    """The environment of an engine of one process, without or with the contact model."""
    if stock:
        return dict(ALONE)
    return ALONE | {"LD_PRELOAD": str(plugin_of(find_engine()))}


def shaken(case: str, folder: Path, **settings: object) -> list[Bead]:
    """Beads of a pile that has come to rest and was shaken for a tenth of a second."""
    settings = {"run.ranks": 1, "run.duration": "0.1 s", "run.segment": "0.1 s"} | settings
    motion = walkers.run(load_case(case, settings), folder / "starts").motion
    position = motion.position[-1].tolist()
    velocity = motion.velocity[-1].tolist()
    spin = motion.spin[-1].tolist()
    beads = []
    for place, radius in enumerate(motion.radius.tolist()):
        bead = Bead(
            place + 1, tuple(position[place]), radius, tuple(velocity[place]), tuple(spin[place])
        )
        beads.append(bead)
    return beads


def compose_from(case: str, steps: int, beads: list[Bead], **settings: object) -> Deck:
    """Today's deck of a pile from given beads, without frames between its ends."""
    plan = plan_of(load_case(case, {"run.ranks": 1} | settings), segment=Segment(0, steps, 0))
    scene = replace(plan.scene, beads=tuple(beads))
    return compose(replace(plan, scene=scene, sample_every=steps, bridge_every=steps))


def compose_for_stock(case: str, steps: int, beads: list[Bead]) -> Deck:
    """The deck of `compose_from` with beads that commands create.

    At primitive walls, the stock model reads memory before the velocities of the beads. After
    ``read_data`` there is none, and the engine dies.
    """
    most_created = deck_module.MOST_CREATED
    deck_module.MOST_CREATED = len(beads)
    try:
        return compose_from(case, steps, beads)
    finally:
        deck_module.MOST_CREATED = most_created


def minimal(deck: Deck, case: Case) -> str:
    """The deck with the stock engine's model and walls.

    The walls are planes, each of which pulls half as much as a plane does.
    """
    text = re.sub(r"&\n *", " ", deck.text)
    text = re.sub(r"(?m)^(dump|dump_modify) +(pairs|walls) .*\n", "", text)
    commands = _wall_commands(text)
    text = re.sub(r"(?m)^fix +walls all .*\n", "", text)
    ratio = case.contact.roughness.bead_wall / case.radii[0]
    liquid = _STOCK_LIQUID.format(liquid=case.liquid.of_bridges, ratio=ratio)
    model = f"pair_style {_STOCK_MODEL}\n{liquid}"
    text = re.sub(r"(?m)^pair_style .*\n", lambda _: model, text)
    return re.sub(r"(?m)^fix +motion ", lambda match: commands + match[0], text)


def _wall_commands(text: str) -> str:
    """Commands that replace the walls of a deck by primitive ones, and shaking by gravity."""
    commands = ""
    # The planes of a deck: a point, and the normal, along x, y or z.
    planes = re.findall(r"plane (\S+) (\S+) (\S+)  (\S+) (\S+) (\S+)", text)
    for number, plane in enumerate(planes):
        normal = [abs(float(component)) for component in plane[3:]]
        axis = normal.index(max(normal))
        kind = f"primitive type 2 {'xyz'[axis]}plane {plane[axis]}"
        commands += f"fix wall_{number} all wall/gran {_STOCK_MODEL[5:]} {kind}\n"
    acceleration = "${peak_acceleration}*sin(2*PI*${frequency}*${time_step}*step)"
    commands += f"variable push equal {acceleration}\n"
    commands += "fix push all gravity v_push vector 0.0 0.0 1.0\n"
    commands += "fix gravity all gravity ${gravity} vector 0.0 0.0 -1.0\n"
    return commands


def without_steps(text: str) -> str:
    """A deck with STEPS where its number of steps was."""
    return re.sub(r"(?m)^run .*", "run STEPS", text)


def cpu_time(
    folder: Path, command: Sequence[str], text: str, steps: int, environment: Mapping[str, str]
) -> float:
    """User CPU time of steps of a script, s, without that of its start.

    The script has the word STEPS for their number.
    """
    seconds = []
    for number in (0, steps):
        (folder / SCRIPT).write_text(text.replace("STEPS", str(number)), "utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run(
            [*command, SCRIPT],
            cwd=folder,
            env={**os.environ, **environment},
            capture_output=True,
            check=True,
        )
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    start, start_and_steps = seconds
    return start_and_steps - start


if __name__ == "__main__":
    main()
