"""Render a case to a LIGGGHTS deck with its files and its layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, pi, prod, sqrt

from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.loads import bridge_at_rest, hop_height, reach
from walkers.inputs.run_tables import limits_of
from walkers.inputs.text import rendered
from walkers.templates.layout import (
    BEAD_COLUMNS,
    MEAN_SPIN_COLUMNS,
    PAIR_BRIDGE_COLUMNS,
    PAIR_BRIDGES,
    WALL_BRIDGE_COLUMNS,
    WALL_BRIDGES,
    Layout,
    PlacedWalker,
)
from walkers.templates.placement import place
from walkers.templates.scene import Scene
from walkers.templates.sharing import Loading, Surface, check_sharing, loadings_of, surface_of, surfaces_of

DECK_NAME = "walker.lig"
OUTPUT_NAME = "engine.log"
LAYOUT_NAME = "layout.json"
BRIDGES_NAME = "bridges.txt"
LOADS_NAME = "loads.txt"
RUN_NAME = "run.sh"
STATUS_LINES_PER_CYCLE = 4
CONTENT_VERSION = 7
"""Of what decks compute: to be raised where the same case gives another deck, comments aside. Runs are named by it."""

RESTART_NAME = "state.restart"
PREVIOUS_RESTART_NAME = "previous.restart"
SETTLING_SECONDS = 0.05
"""Length of the segments in which beads come to rest; at the end of each we check whether they have."""
_STIFFEST = 1e9
"""Pa; no case has stiffer contacts, but a check may."""
_SKIN = 2e-4
"""m; of piles: between 0.1 and 0.3 mm it makes no difference of more than some per cent to the time of a step."""


@dataclass(frozen=True)
class Deck:
    """A deck ready to run.

    Attributes
    ----------
    text, files, layout
        What LIGGGHTS reads; the files that it reads in turn, name to text; what it will write.
    box, fastest
        Corners of the simulation box, m; a speed that no bead can reach by the drive, gravity and the capillary forces
        alone, m/s.
    silence, log_limit
        How long the engine may write nothing, s, and how large its log may become, bytes.
    beyond_limits
        Whether the time step is beyond a limit, as a case may insist.
    """

    text: str
    files: Mapping[str, str]
    layout: Layout
    box: tuple[Vector, Vector]
    fastest: float
    silence: float
    log_limit: float
    beyond_limits: bool = False


@dataclass(frozen=True)
class Checkpoint:
    """Restart files of a deck: one to write at its end, one to go on from."""

    write: str | None = None
    read: str | None = None


@dataclass(frozen=True)
class Recording:
    """Until which step a deck runs and how often it records, in steps; ``begin`` is where a restart goes on."""

    steps: int
    sample_every: int
    bridge_every: int
    status_every: int
    bead_columns: tuple[str, ...] = BEAD_COLUMNS
    wall_bridge_columns: tuple[str, ...] = WALL_BRIDGE_COLUMNS
    begin: int = 0


@dataclass(frozen=True)
class Segment:
    """A segment of a run: from a step to a step, from a restart file (unless it is the first) to the next.

    ``drive_from`` is the step at which the drive begins; None while the beads come to rest.
    """

    begin: int
    end: int
    drive_from: int | None


@dataclass(frozen=True)
class Plan:
    """What a deck is put together from.

    Attributes
    ----------
    case, scene, recording, walkers
        Materials, liquid, contacts, drive, gravity and time step; what stands in the box; length and sampling; which
        beads are whose.
    prescribed
        Beads keep their velocities instead of following the forces.
    ranks, checkpoint
        Number of MPI processes; restart file to write or to go on from.
    surfaces, loadings
        How the beads' surfaces touch and what loads them, by `walkers.templates.scene.Bead.surface` and
        ``Bead.loading``; the case's own if left out.
    fastest
        Speed that no bead can reach, m/s; if left out, what `fastest_of` says of the case.
    drive_from
        Step at which the drive begins; None for a segment before it.
    skin
        How far beyond contact neighbours are looked for, m; if left out, the smallest radius, and wide bins, which
        suits few beads far apart.
    """

    case: Case
    scene: Scene
    recording: Recording
    walkers: tuple[PlacedWalker, ...] = ()
    prescribed: bool = False
    ranks: int = 1
    checkpoint: Checkpoint = Checkpoint()
    surfaces: tuple[Surface, ...] = ()
    loadings: tuple[Loading, ...] = ()
    fastest: float | None = None
    drive_from: int | None = 0
    skin: float | None = None

    @property
    def shaken(self) -> bool:
        """Whether the drive is on in the deck."""
        return self.drive_from is not None

    @property
    def several(self) -> bool:
        """Whether not all beads have the same gravity and drive."""
        return len({(one.gravity, one.harmonics) for one in self.loadings}) > 1

    @property
    def begins_to_shake(self) -> bool:
        """Whether the drive begins where the deck does."""
        return self.drive_from == self.recording.begin


def first_segment(case: Case) -> Segment:
    """The segment that a run begins with: all of it, or the first cycles, or that in which the beads come to rest."""
    run = case.run
    if run.rests:
        return Segment(0, settling_steps(case), None)
    return Segment(0, min(run.cycles_per_segment, run.cycles) * run.steps_per_cycle, 0)


def next_segment(case: Case, segment: Segment) -> Segment | None:
    """The segment of the drive after one of the drive; None after the last one."""
    run, start = case.run, segment.drive_from or 0
    end = min(segment.end + run.cycles_per_segment * run.steps_per_cycle, start + run.steps)
    return Segment(segment.end, end, start) if end > segment.end else None


def settling_steps(case: Case) -> int:
    """Steps of a segment in which beads come to rest; it ends with a frame of beads and bridges."""
    sample = case.run.steps_per_sample * case.run.samples_per_bridge_sample
    return max(1, round(SETTLING_SECONDS / case.run.time_step / sample)) * sample


def render_deck(case: Case, segment: Segment | None = None) -> Deck:
    """Render a segment of a case's run, the first one if left out.

    Numbers are in full precision: the shortest text that reads back as the same double.
    """
    return compose(plan_of(case, segment=segment))


def render_shared_deck(cases: Sequence[Case]) -> Deck:
    """Render one deck for the walkers of several cases, in their order.

    Raises
    ------
    ValueError
        If they cannot share a deck (see `walkers.templates.sharing.sharing_key`).
    """
    return compose(plan_of(*cases))


def plan_of(*cases: Case, segment: Segment | None = None) -> Plan:
    """The plan of a segment of cases that share a deck: their bodies on one boundary, recorded as the cases say."""
    check_sharing(cases)
    case, run = cases[0], cases[0].run
    segment = segment or first_segment(case)
    scene, walkers = place(cases)
    recording = Recording(
        steps=segment.end,
        sample_every=run.steps_per_sample,
        bridge_every=run.steps_per_sample * run.samples_per_bridge_sample,
        status_every=-(-run.steps_per_cycle // STATUS_LINES_PER_CYCLE),
        bead_columns=(*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS) if walkers else BEAD_COLUMNS,
        begin=segment.begin,
    )
    restart = None if run.in_one else RESTART_NAME
    return Plan(
        case=case,
        scene=scene,
        recording=recording,
        walkers=walkers,
        ranks=run.ranks,
        checkpoint=Checkpoint(restart, PREVIOUS_RESTART_NAME if restart and segment.begin else None),
        surfaces=surfaces_of(cases),
        loadings=loadings_of(cases),
        fastest=max(fastest_of(one, scene) for one in cases),
        drive_from=segment.drive_from,
        skin=_SKIN if case.loose else None,
    )


def compose(plan: Plan) -> Deck:
    """Put a deck together from its blocks.

    Raises
    ------
    InputError
        If the law of the bridges cannot be tabulated.
    """
    from walkers.templates.bridge_tables import UnusableLawError, bridge_tables

    case, scene = plan.case, plan.scene
    first = case.drive.harmonics[0]
    layout = _layout(plan)
    surfaces = plan.surfaces or (surface_of(case),)
    contacts = [contact for contact, _ in surfaces]
    largest = max(bead.radius for bead in scene.beads)
    space = prod(high - low for low, high in zip(scene.lower, scene.upper, strict=True))
    rolling = " rolling_friction cdt" if case.contact.rolling_friction > 0 else ""
    pair_columns = " ".join(PAIR_BRIDGES).split()
    moduli = [*(contact.youngs_modulus for contact in contacts), case.contact.youngs_modulus]
    text = rendered(
        "walkers.templates",
        "walker.lig.j2",
        case=case,
        scene=scene,
        layout=layout,
        recording=plan.recording,
        deck_name=DECK_NAME,
        output_name=OUTPUT_NAME,
        layout_name=LAYOUT_NAME,
        bridges_name=BRIDGES_NAME,
        run_name=RUN_NAME,
        contact_model=f"hertz tangential history cohesion bridge{rolling}",
        types=len(surfaces) + 1,
        moduli=moduli,
        stiff=max(moduli) > _STIFFEST,
        friction=_pairs([(one.friction_bead_bead, one.friction_bead_wall) for one in contacts]),
        rolling_friction=_pairs([(one.rolling_friction,) * 2 for one in contacts]),
        restitution=_pairs([(one.restitution,) * 2 for one in contacts]),
        bounds=("xmin", "xmax", "ymin", "ymax", "zmin", "zmax"),
        down=[component / case.gravity for component in case.gravity_vector] if case.gravity else [],
        plan=plan,
        # Of a drive that moves the walls; it has one harmonic.
        peak_velocity=[first.peak_velocity * component for component in first.direction],
        loads_name=LOADS_NAME,
        pair_bridge_terms=[f"c_pair_bridges[{pair_columns.index(one) + 1}]" for one in layout.pair_bridge_columns],
        wall_bridge_terms=[f"f_walls[{WALL_BRIDGES.index(one) + 1}]" for one in layout.wall_bridge_columns],
        pair_bridge_options=" ".join(PAIR_BRIDGES.values()),
        skin=plan.skin or min(bead.radius for bead in scene.beads),
        most_neighbours=_most_neighbours(scene, plan.skin),
        # At most some ten thousand bins, none smaller than two beads (m).
        bin_size=None if plan.skin else max(4.0 * largest, (space / 2e4) ** (1.0 / 3.0)),
        wide=not plan.skin and space > _MOST_BINS * largest**3,
    )  # fmt: skip
    files = {LOADS_NAME: _loads(plan)} if plan.several else {}
    try:
        files[BRIDGES_NAME] = bridge_tables(surfaces, scene.beads)
    except UnusableLawError as error:
        raise InputError(case.name, [Problem("liquid.law", case.liquid.law, str(error))]) from error
    fastest = plan.fastest or fastest_of(case, scene)
    beyond = bool(limits_of(case).exceeded_by(case.run.time_step))
    bounds = (case.run.longest_silence(len(scene.beads)), case.run.most_log)
    return Deck(text, files, layout, (scene.lower, scene.upper), fastest, *bounds, beyond)


def _loads(plan: Plan) -> str:
    """Gravity and the amplitude of the inertial acceleration of each harmonic, bead by bead, as the engine reads it."""
    rows = ((bead.id, plan.loadings[bead.loading]) for bead in plan.scene.beads)
    vectors = ((number, (load.gravity, *load.harmonics)) for number, load in rows)
    return "".join(f"{number} {' '.join(repr(x) for one in of for x in one)}\n" for number, of in vectors)


def _pairs(surfaces: Sequence[tuple[float, float]]) -> list[float]:
    """A coefficient for every pair of atom types, of each surface's value against itself and against the walls.

    The walls come last. Beads of different surfaces never meet.
    """
    wall = len(surfaces)
    return [
        surfaces[min(one, other, wall - 1)][int(max(one, other) == wall)]
        for one in range(wall + 1)
        for other in range(wall + 1)
    ]


_MOST_BINS = 3e7
"""Of the largest bead's radius, into which atoms are sorted every 1,000 steps.

60 beads in a box of 1.5e9 took 50 times as long with the sorting as without; above 2^31 the engine refuses.
"""


_LEAST_NEIGHBOURS = 100


def _most_neighbours(scene: Scene, skin: float | None) -> int:
    """How many of the smallest beads there is room for within sight of the largest one, and some more."""
    radii = [bead.radius for bead in scene.beads]
    small, large = min(radii), max(radii)
    sight = large + 2.0 * small + (skin or small)
    return max(_LEAST_NEIGHBOURS, ceil((sight**3 - large**3) / small**3))


def fastest_of(case: Case, scene: Scene) -> float:
    """Ten times the boundary's peak velocity (20 in a pile), the deepest fall, and what a bridge can give, m/s."""
    sizes = sorted(bead.radius for bead in scene.beads)
    mass = 4.0 / 3.0 * pi * sizes[0] ** 3 * case.density
    bridge = bridge_at_rest(case, sizes[-1], inf)
    work = bridge.pull * bridge.rupture
    deep = hop_height(case) if case.boundary.tilt == 0.0 else reach(case)
    fall = sqrt(2.0 * case.gravity * (max(scene.upper[2], deep) if case.loose else deep))
    return (20.0 if case.loose else 10.0) * case.drive.peak_velocity + fall + sqrt(2.0 * work / mass)


def _layout(plan: Plan) -> Layout:
    recording = plan.recording
    return Layout(
        bead_dump="beads.bin",
        bead_columns=recording.bead_columns,
        sample_every=recording.sample_every,
        frames=(recording.steps - recording.begin) // recording.sample_every + 1,
        pair_bridge_dump="bridges.pairs.txt",
        pair_bridge_columns=PAIR_BRIDGE_COLUMNS,
        wall_bridge_dump="bridges.walls.txt",
        wall_bridge_columns=recording.wall_bridge_columns,
        bridge_every=recording.bridge_every,
        bridge_frames=(recording.steps - recording.begin) // recording.bridge_every + 1,
        atoms=len(plan.scene.beads),
        steps=recording.steps,
        time_step=plan.case.run.time_step,
        walkers=plan.walkers,
        ranks=plan.ranks,
    )
