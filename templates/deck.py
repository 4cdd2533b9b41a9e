"""Render a case to a LIGGGHTS deck with its STL files and its layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import degrees, inf, sqrt
from typing import TYPE_CHECKING

from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import contact_loads, dimer_of, hop_height, reach
from walkers.inputs.pile import PileCase
from walkers.physics.film import film_drag
from walkers.physics.matter import Contact
from walkers.templates.engine import ALL_WORKAROUNDS, Workarounds, contact_angle_setting, separation_cap, wall_mesh
from walkers.templates.layout import BEAD_COLUMNS, PAIR_BRIDGE_COLUMNS, WALL_BRIDGE_COLUMNS, Layout, PlacedWalker
from walkers.templates.placement import place_walkers
from walkers.templates.scene import Point, Scene, without_carriers
from walkers.templates.sharing import check_sharing, surfaces_of

if TYPE_CHECKING:
    from jinja2 import Environment

DECK_NAME = "walker.lig"
OUTPUT_NAME = "engine.log"
LAYOUT_NAME = "layout.json"
WALL_NAME = "walls.stl"
STATUS_LINES_PER_CYCLE = 4
CONTENT_VERSION = 1
"""Of what decks compute: to be raised where the same case gives another deck, comments aside. Runs are named by it."""

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


@dataclass(frozen=True)
class Checkpoint:
    """Restart files of a deck: one to write at its end, one to go on from."""

    write: str | None = None
    read: str | None = None


NO_CHECKPOINT = Checkpoint()


@dataclass(frozen=True)
class Recording:
    """Until which step a deck runs and how often it records, in steps; ``begin`` is where a restart goes on."""

    steps: int
    sample_every: int
    bridge_every: int
    status_every: int
    bead_columns: tuple[str, ...] = BEAD_COLUMNS
    begin: int = 0
    pair_bridge_columns: tuple[str, ...] = PAIR_BRIDGE_COLUMNS
    wall_bridge_columns: tuple[str, ...] = WALL_BRIDGE_COLUMNS


@dataclass(frozen=True)
class Plan:
    """What a deck is put together from.

    Attributes
    ----------
    case
        Materials, liquid, contacts, drive, gravity and time step.
    scene
        What stands in the box.
    recording
        Length and sampling.
    walkers
        Which beads are whose.
    workarounds
        Which workarounds the deck carries; without carriers those of the scene are left out.
    prescribed
        Beads keep their velocities instead of following the forces.
    ranks
        Number of MPI processes; the scene must have carriers for each.
    checkpoint
        Restart file to write or to go on from.
    surfaces
        How the beads' surfaces touch, by `walkers.templates.scene.Bead.surface`; the case's own contact if left out.
    fastest
        A speed that no bead can reach, m/s; computed from the case if left out.
    drive_from
        Step at which the drive begins; None for a segment before it.
    skin
        How far beyond contact neighbours are looked for, m; if left out, the smallest radius, and wide bins, which
        suits few beads far apart.
    title
        What the deck is of, for those who read it.
    print_rms_velocity
        Whether the root mean square velocity of the beads is printed at the end.
    """

    case: WalkerCase | PileCase
    scene: Scene
    recording: Recording
    walkers: tuple[PlacedWalker, ...] = ()
    workarounds: Workarounds = ALL_WORKAROUNDS
    prescribed: bool = False
    ranks: int = 1
    checkpoint: Checkpoint = NO_CHECKPOINT
    surfaces: tuple[Contact, ...] = ()
    fastest: float | None = None
    drive_from: int | None = 0
    skin: float | None = None
    title: str = "Wet dimers on a shaken substrate"
    print_rms_velocity: bool = False

    @property
    def shaken(self) -> bool:
        """Whether the drive is on in the deck."""
        return self.drive_from is not None

    @property
    def begins_to_shake(self) -> bool:
        """Whether the drive begins where the deck does."""
        return self.drive_from == self.recording.begin


def render_deck(case: WalkerCase, workarounds: Workarounds = ALL_WORKAROUNDS) -> Deck:
    """Render a walker case.

    Parameters
    ----------
    case
        A resolved case.
    workarounds
        Which workarounds for the engine's defects the deck carries.

    Returns
    -------
    Deck
        Numbers in full precision (the shortest text that reads back as the same double).
    """
    return compose(walker_plan(case, workarounds=workarounds))


def render_shared_deck(cases: Sequence[WalkerCase]) -> Deck:
    """Render one deck for the walkers of several cases, in their order.

    Raises
    ------
    ValueError
        If they cannot share a deck (see `walkers.templates.sharing.sharing_key`).
    """
    return compose(walker_plan(*cases))


def walker_plan(*cases: WalkerCase, workarounds: Workarounds = ALL_WORKAROUNDS) -> Plan:
    """The plan of walker cases that share a deck: their replicates on one substrate, recorded as the cases say."""
    check_sharing(cases)
    case = cases[0]
    scene, walkers = place_walkers(cases)
    run = case.run
    recording = Recording(
        steps=run.steps,
        sample_every=run.steps_per_cycle // run.samples_per_cycle,
        bridge_every=run.steps_per_cycle // run.bridge_samples_per_cycle,
        status_every=-(-run.steps_per_cycle // STATUS_LINES_PER_CYCLE),
    )
    fastest = max(fastest_of(one) for one in cases)
    return Plan(case, scene, recording, walkers, workarounds, surfaces=surfaces_of(cases), fastest=fastest)


def compose(plan: Plan) -> Deck:
    """Put a deck together from its blocks."""
    case, workarounds = plan.case, plan.workarounds
    scene, walkers = plan.scene, plan.walkers
    if not workarounds.carriers:
        gone = len(scene.carriers)
        scene = without_carriers(scene)
        walkers = tuple(replace(one, beads=(one.beads[0] - gone, one.beads[1] - gone)) for one in walkers)
    first = case.drive.harmonics[0]
    layout = replace(_layout(case, scene, plan.recording, walkers), ranks=plan.ranks)
    angle = case.liquid.contact_angle
    surfaces = plan.surfaces or (case.contact,)
    text = _environment().get_template("walker.lig.j2").render(
        case=case,
        scene=scene,
        layout=layout,
        recording=plan.recording,
        deck_name=DECK_NAME,
        output_name=OUTPUT_NAME,
        layout_name=LAYOUT_NAME,
        wall_file=WALL_NAME,
        copies=[f"walls_{number}" for number in range(1, workarounds.wall_copies + 1)],
        contact_model=_contact_model(case),
        types=len(surfaces) + 1,
        friction=_pairs([(surface.friction_bead_bead, surface.friction_bead_wall) for surface in surfaces]),
        rolling_friction=_pairs([(surface.rolling_friction,) * 2 for surface in surfaces]),
        restitution=_pairs([(surface.restitution,) * 2 for surface in surfaces]),
        contact_angle_setting=contact_angle_setting(angle) if workarounds.contact_angle else degrees(angle),
        separation_cap=separation_cap((bead.radius for bead in scene.beads), case.liquid.volume_fraction, angle),
        bounds=("xmin", "xmax", "ymin", "ymax", "zmin", "zmax"),
        down=[component / case.gravity for component in case.gravity_vector] if case.gravity else [],
        plan=plan,
        # Of a drive that moves the walls; it has one harmonic.
        amplitude=[first.amplitude * component for component in first.direction],
        peak_velocity=[first.peak_velocity * component for component in first.direction],
        films=_films(case, scene),
        prescribed=plan.prescribed,
        ranks=plan.ranks,
        checkpoint=plan.checkpoint,
        pair_bridge_terms=_terms("pair_bridges", layout.pair_bridge_columns, PAIR_BRIDGE_COLUMNS),
        wall_bridge_terms=_terms("wall_bridges", layout.wall_bridge_columns, WALL_BRIDGE_COLUMNS),
        skin=plan.skin or min(bead.radius for bead in scene.beads),
        bin_size=None if plan.skin else _bin_size(scene),
    )  # fmt: skip
    files = {WALL_NAME: wall_mesh(scene.faces, max(scene.upper))}
    fastest = plan.fastest
    if fastest is None:
        fastest = fastest_of(case) if isinstance(case, WalkerCase) else inf
    return Deck(text, files, layout, (scene.lower, scene.upper), fastest)


@dataclass(frozen=True)
class _Film:
    """Atoms of one radius and how strongly the film on the substrate drags each of them, N s/m."""

    number: int
    atoms: tuple[int, ...]
    coefficient: float


def _films(case: WalkerCase | PileCase, scene: Scene) -> list[_Film]:
    viscosity = case.liquid.film_viscosity
    radii = dict.fromkeys(bead.radius for bead in scene.beads) if viscosity else ()
    return [
        _Film(number, tuple(bead.id for bead in scene.beads if bead.radius == radius), film_drag(viscosity, radius))
        for number, radius in enumerate(radii, 1)
    ]


def _terms(compute: str, columns: Sequence[str], all_columns: Sequence[str]) -> list[str]:
    """What a dump writes for some of the columns that a compute has."""
    return [f"c_{compute}[{all_columns.index(column) + 1}]" for column in columns]


def _pairs(surfaces: Sequence[tuple[float, float]]) -> list[float]:
    """A coefficient for every pair of atom types: the surfaces of beads, then the walls.

    Parameters
    ----------
    surfaces
        Of each surface its value against itself and against the walls. Beads of different surfaces never meet.
    """
    wall = len(surfaces)
    return [
        surfaces[min(one, other, wall - 1)][int(max(one, other) == wall)]
        for one in range(wall + 1)
        for other in range(wall + 1)
    ]


def _contact_model(case: WalkerCase | PileCase) -> str:
    rolling = " rolling_friction cdt" if case.contact.rolling_friction > 0 else ""
    return f"hertz tangential history cohesion easo/capillary/viscous{rolling}"


def _bin_size(scene: Scene) -> float:
    """At most some ten thousand bins, none smaller than two beads (m)."""
    width, depth, height = (high - low for low, high in zip(scene.lower, scene.upper, strict=True))
    return float(max(4.0 * max(bead.radius for bead in scene.beads), (width * depth * height / 2e4) ** (1.0 / 3.0)))


def fastest_of(case: WalkerCase) -> float:
    """Ten times the substrate's peak velocity, plus a fall from the highest hop, plus what a bridge's pull can give."""
    loads = contact_loads(case)
    pull = sqrt(2.0 * max(loads.capillary) * max(loads.rupture) / min(dimer_of(case).masses))
    fall = sqrt(2.0 * case.gravity * (hop_height(case) if case.boundary.tilt == 0.0 else reach(case)))
    return 10.0 * case.drive.peak_velocity + fall + pull


def _layout(
    case: WalkerCase | PileCase, scene: Scene, recording: Recording, walkers: tuple[PlacedWalker, ...]
) -> Layout:
    return Layout(
        bead_dump="beads.bin",
        bead_columns=recording.bead_columns,
        sample_every=recording.sample_every,
        frames=(recording.steps - recording.begin) // recording.sample_every + 1,
        pair_bridge_dump="bridges.pairs.txt",
        pair_bridge_columns=recording.pair_bridge_columns,
        wall_bridge_dump="bridges.walls.txt",
        wall_bridge_columns=recording.wall_bridge_columns,
        bridge_every=recording.bridge_every,
        bridge_frames=(recording.steps - recording.begin) // recording.bridge_every + 1,
        atoms=len(scene.carriers) + len(scene.beads),
        steps=recording.steps,
        time_step=case.run.time_step,
        carrier=1 if scene.carriers else 0,
        carriers=len(scene.carriers),
        walkers=walkers,
    )


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("walkers.templates", "."),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )

    def number(value: float) -> str:
        return repr(float(value))

    def numbers(values: Iterable[float]) -> str:
        return " ".join([repr(float(value)) for value in values])

    environment.filters.update(number=number, numbers=numbers, any=any, zip=zip)
    return environment
