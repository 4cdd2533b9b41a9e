"""Decks of piles that `tests.benchmark` times, and the CPU time of their steps.

Decks for the contact model of this program and for that of the stock engine begin with the same
beads, from the end of a shaken run.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import walkers
from walkers.inputs.reading import load_case
from walkers.inputs.tables.case import Case
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of
from walkers.runner.process import ALONE
from walkers.templates import deck as deck_module
from walkers.templates.deck import Deck, Segment, compose, plan_of
from walkers.templates.placement import Bead

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
