"""Render a case to a LIGGGHTS deck with its STL files and its layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import TYPE_CHECKING

from inputs.case import WalkerCase
from inputs.dimer import contact_loads, dimer_of, hop_height
from templates.engine import WALL_COPIES, contact_angle_setting, separation_cap, substrate_triangle
from templates.layout import BEAD_COLUMNS, PAIR_BRIDGE_COLUMNS, WALL_BRIDGE_COLUMNS, Layout, PlacedWalker
from templates.placement import Point, Scene, axis_vector, place_walkers

if TYPE_CHECKING:
    from jinja2 import Environment

DECK_NAME = "walker.lig"
OUTPUT_NAME = "engine.log"
LAYOUT_NAME = "layout.json"
SUBSTRATE_NAME = "substrate.stl"
STATUS_LINES_PER_CYCLE = 4

__all__ = ["DECK_NAME", "LAYOUT_NAME", "OUTPUT_NAME", "Deck", "Layout", "PlacedWalker", "render_deck"]


@dataclass(frozen=True)
class Deck:
    """A deck ready to run.

    Attributes
    ----------
    text
        What LIGGGHTS reads.
    files
        The files that it reads in turn, name to text.
    layout
        What it will write.
    box
        Lower and upper corner of the simulation box, m.
    fastest
        A speed that no bead can reach by the drive, gravity and the capillary forces alone, m/s.
    """

    text: str
    files: Mapping[str, str]
    layout: Layout
    box: tuple[Point, Point]
    fastest: float


def render_deck(case: WalkerCase) -> Deck:
    """Render a walker case.

    Parameters
    ----------
    case
        A resolved case.

    Returns
    -------
    Deck
        Numbers in full precision (the shortest text that reads back as the same double).
    """
    scene = place_walkers(case)
    loads = contact_loads(case)
    drive = case.drive
    axis = axis_vector(drive.axis)
    layout = _layout(case, scene)
    text = (
        _environment()
        .get_template("walker.lig.j2")
        .render(
            case=case,
            scene=scene,
            layout=layout,
            deck_name=DECK_NAME,
            output_name=OUTPUT_NAME,
            layout_name=LAYOUT_NAME,
            substrate_file=SUBSTRATE_NAME,
            copies=[f"substrate_{number}" for number in range(1, WALL_COPIES + 1)],
            contact_model=_contact_model(case),
            contact_angle_setting=contact_angle_setting(case.liquid.contact_angle),
            separation_cap=separation_cap(case.beads.radii, loads.rupture[:2], loads.rupture[2]),
            bounds=("xmin", "xmax", "ymin", "ymax", "zmin", "zmax"),
            status_every=-(-case.run.steps_per_cycle // STATUS_LINES_PER_CYCLE),
            axis=axis,
            amplitude=[drive.amplitude * component for component in axis],
            peak_velocity=[drive.peak_velocity * component for component in axis],
            pair_bridge_terms=[f"c_pair_bridges[{number + 1}]" for number in range(len(layout.pair_bridge_columns))],
            wall_bridge_terms=[f"c_wall_bridges[{number + 1}]" for number in range(len(layout.wall_bridge_columns))],
            skin=min(case.beads.radii),
            bin_size=_bin_size(case, scene),
        )
    )
    files = {SUBSTRATE_NAME: substrate_triangle(max(scene.upper[:2]))}
    return Deck(text, files, layout, (scene.lower, scene.upper), _fastest(case))


def _contact_model(case: WalkerCase) -> str:
    rolling = " rolling_friction cdt" if case.contact.rolling_friction > 0 else ""
    return f"hertz tangential history cohesion easo/capillary/viscous{rolling}"


def _bin_size(case: WalkerCase, scene: Scene) -> float:
    """At most some ten thousand bins, none smaller than two beads (m)."""
    width, depth, height = (high - low for low, high in zip(scene.lower, scene.upper, strict=True))
    return float(max(4.0 * max(case.beads.radii), (width * depth * height / 2e4) ** (1.0 / 3.0)))


def _fastest(case: WalkerCase) -> float:
    """Ten times the substrate's peak velocity, plus a fall from the highest hop, plus what a bridge's pull can give."""
    loads = contact_loads(case)
    pull = sqrt(2.0 * max(loads.capillary) * max(loads.rupture) / min(dimer_of(case).masses))
    fall = sqrt(2.0 * case.gravity * hop_height(case))
    return 10.0 * case.drive.peak_velocity + fall + pull


def _layout(case: WalkerCase, scene: Scene) -> Layout:
    run = case.run
    return Layout(
        bead_dump="beads.bin",
        bead_columns=BEAD_COLUMNS,
        sample_every=run.steps_per_cycle // run.samples_per_cycle,
        frames=run.cycles * run.samples_per_cycle + 1,
        pair_bridge_dump="bridges.pairs.txt",
        pair_bridge_columns=PAIR_BRIDGE_COLUMNS,
        wall_bridge_dump="bridges.walls.txt",
        wall_bridge_columns=WALL_BRIDGE_COLUMNS,
        bridge_every=run.steps_per_cycle // run.bridge_samples_per_cycle,
        bridge_frames=run.cycles * run.bridge_samples_per_cycle + 1,
        atoms=1 + len(scene.beads),
        steps=run.steps,
        time_step=run.time_step,
        rider=1,
        walkers=scene.walkers,
    )


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("templates", "."),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def number(value: float) -> str:
        return repr(float(value))

    def numbers(values: Iterable[float]) -> str:
        return " ".join(number(value) for value in values)

    environment.filters["number"] = number
    environment.filters["numbers"] = numbers
    return environment
