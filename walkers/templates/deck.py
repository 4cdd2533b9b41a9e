"""Render a case to a LIGGGHTS deck with its files and its layout.

The commands of a deck are in ``walker.lig.j2`` and ``blocks/``; this module computes what they
need. It does not start the engine (`walkers.runner.launch`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, prod, sqrt
from typing import Any, NamedTuple

from walkers.arrays import Vector
from walkers.errors import InputError, Problem
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.loads import bridge_at_rest, hop_height, path_length
from walkers.inputs.resolving.ranks import SKIN, processor_grid
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES, Excitation
from walkers.inputs.tables.materials import Contact
from walkers.physics.capillary import BridgeLiquid, bead_volume
from walkers.physics.laws import LAWS
from walkers.templates.layout import (
    BEAD_COLUMNS,
    FILM_COLUMN,
    MEAN_SPIN_COLUMNS,
    DeckLayout,
    PlacedWalker,
)
from walkers.templates.parameters import (
    PRINTED,
    STATUS_LINES_PER_CYCLE,
    DeckParameter,
    contact_values,
    derived_parameters,
    drive_parameters,
    in_cycles,
    length_parameters,
    material_parameters,
    suffixes,
    vector_along,
)
from walkers.templates.placement import PlacedBodies, Surface, place, surface_of
from walkers.text import numbers_text, rendered

CONTENT_VERSION = 10
"""Version of the numbers of decks, part of the names of runs.

Increase it if a case gives other numbers. Do not increase it if decks with another text give the
same numbers bit for bit.
"""

# --- names of files -------------------------------------------------------------------------------

DECK_NAME = "walker.lig"
OUTPUT_NAME = "engine.log"
LAYOUT_NAME = "layout.json"
BRIDGES_NAME = "bridges.txt"
SCALED_BRIDGES_NAME = "bridges.scaled.txt"
"""Tables that a deck run by hand writes if its viscosity was edited."""
LOADS_NAME = "loads.txt"
FACETS_NAME = "facets.txt"
BEADS_NAME = "beads.data"
"""File of many beads in the format of ``read_data``; few beads are created by the deck itself."""
RUN_NAME = "run.sh"
SCALE_NAME = "scale.awk"
"""Script beside decks to be run by hand: rescales the tables for an edited viscosity."""
RESTART_NAME = "state.restart"
PREVIOUS_RESTART_NAME = "previous.restart"
_NAMES = {
    "layout": LAYOUT_NAME,
    "bridges": BRIDGES_NAME,
    "scaled": SCALED_BRIDGES_NAME,
    "loads": LOADS_NAME,
    "facets": FACETS_NAME,
    "beads": BEADS_NAME,
    "run": RUN_NAME,
    "scale": SCALE_NAME,
}
"""Names of files by the words of the blocks."""

# --- settling -------------------------------------------------------------------------------------

SETTLING_SECONDS = 0.05
"""Length of the segments in which beads come to rest, s.

At the end of each segment we check whether they have.
"""
RESTING_SEGMENTS = 3
"""Largest number of such segments that piles needed."""

# --- beads and neighbours -------------------------------------------------------------------------

MOST_CREATED = 100
"""Largest number of beads that a deck creates one by one.

Each ``set atom`` walks through all atoms: 50,000 beads take 9 s, and 0.1 s from a file of
``read_data``.
"""
_LEAST_NEIGHBOURS = 100
"""Smallest number of neighbours of a bead for which the engine has room."""
_MOST_BINS = 2e4
"""Number of bins of the neighbour search into which the box of a few beads is divided at most."""

# --- limits beyond which a running engine is stopped (`walkers.runner.launch`) --------------------

_SILENCE = 600.0
"""Shortest silence of the engine that counts as a failure, s.

Piles of 200 beads write some thirty lines a second, those of 20,000 one line in four seconds.
"""
_SLOWEST_STEP = 4e-5
"""Longest time of a step for each bead, s.

It is thirty times the time with two beads alone, and a hundred times that in a pile.
"""
_LOG_BYTES = 64e6
"""Smallest limit of the engine's log, bytes.

Runs of walkers and segments of piles write some 50 kB.
"""
_LOG_BYTES_PER_CYCLE = 1e4
"""Limit of the engine's log for each cycle, bytes; a cycle writes some 500 bytes."""


@dataclass(frozen=True)
class Deck:
    """A deck that is ready to run.

    Attributes
    ----------
    text
        The input script.
    files
        Further input files: their texts by name.
    layout
        Layout of the output.
    box
        Lower and upper corner of the simulation box, m.
    fastest
        A speed that no bead can reach by the drive, gravity and the capillary forces alone, m/s.
    silence
        How long the engine may write nothing, s.
    log_limit
        Largest size of its log, bytes.
    beyond_limits
        Whether the time step exceeds a limit (key ``run.allow_unstable``).
    """

    text: str
    files: Mapping[str, str]
    layout: DeckLayout
    box: tuple[Vector, Vector]
    fastest: float
    silence: float
    log_limit: float
    beyond_limits: bool = False


class Segment(NamedTuple):
    """A segment of a run, which continues from the restart file of the segment before.

    Attributes
    ----------
    begin, end
        First and last step.
    drive_from
        Step at which the drive begins; None while the beads come to rest.
    """

    begin: int
    end: int
    drive_from: int | None


@dataclass(frozen=True)
class Plan:
    """Contents of a deck.

    Attributes
    ----------
    case
        Materials, liquid, contacts, drive, gravity and time step.
    scene
        Beads, walls and box.
    segment
        The steps of the deck.
    sample_every, bridge_every, status_every
        Steps between frames of beads, between frames of bridges, and between lines of the log.
    bead_columns, wall_bridge_columns
        Columns of the dumps.
    walkers
        The walkers, with the numbers of their beads.
    prescribed
        Whether beads keep their velocities instead of following the forces.
    ranks
        Number of MPI processes.
    restart_to
        Restart file to write at the end; None: none.
    restart_from
        Restart file to continue from; None: the deck places the beads.
    fastest
        Speed that no bead can reach, m/s; None: `fastest_of` the case.
    skin
        Search distance for neighbours beyond contact, m; None: the smallest radius, with wide bins,
        for few beads far apart.
    """

    case: Case
    scene: PlacedBodies
    segment: Segment
    sample_every: int
    bridge_every: int
    status_every: int
    bead_columns: tuple[str, ...] = BEAD_COLUMNS
    wall_bridge_columns: tuple[str, ...] = DeckLayout.wall_bridge_columns
    walkers: tuple[PlacedWalker, ...] = ()
    prescribed: bool = False
    ranks: int = 1
    restart_to: str | None = None
    restart_from: str | None = None
    fastest: float | None = None
    skin: float | None = None

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """Contact parameters and liquid of each atom type of beads."""
        return self.scene.surfaces or (surface_of(self.case),)

    @property
    def atom_types(self) -> int:
        """Number of atom types: the surfaces of the beads, and the walls."""
        return len(self.surfaces) + 1

    @property
    def shaken(self) -> bool:
        """Whether the walls move in this deck."""
        return self.segment.drive_from is not None

    @property
    def reads_beads(self) -> bool:
        """Whether the beads are in a file of ``read_data``, because they are many."""
        return len(self.scene.beads) > MOST_CREATED and not self.restart_from

    @property
    def rest_steps(self) -> int | None:
        """Steps from the start of the run to the start of the drive, if the deck contains both."""
        return None if self.segment.begin else self.segment.drive_from

    @property
    def drive_steps(self) -> int | None:
        """Steps from the start of the drive to the end of the deck, if it contains both."""
        if self.rest_steps is None:
            return None
        return self.segment.end - self.rest_steps


@dataclass(frozen=True)
class NeighbourSearch:
    """How the engine searches for neighbours.

    Attributes
    ----------
    skin
        Search distance beyond contact, m.
    most_neighbours
        Largest number of neighbours of a bead.
    bin_size
        Width of the bins, m; None: the engine's default.
    sorted
        Whether the engine sorts the beads by their places.
    processor_grid
        Numbers of subdomains along x and y.
    """

    skin: float
    most_neighbours: int
    bin_size: float | None
    sorted: bool
    processor_grid: tuple[int, int]


# --- segments -------------------------------------------------------------------------------------


def next_segment(case: Case, begin: int = 0, start: int | None = None) -> Segment:
    """The segment of a run that begins at a step.

    Parameters
    ----------
    case
        The case of the run.
    begin
        First step of the segment.
    start
        Step at which the drive began; None: not yet.

    Returns
    -------
    Segment
        The segment; after the last one, it has no steps.
    """
    run = case.run
    if start is None and run.rests:
        return Segment(begin, begin + settling_steps(case), None)
    drive_from = start or 0
    end_of_segment = begin + run.cycles_per_segment * run.steps_per_cycle
    end_of_run = drive_from + run.attempts[0] * run.steps_per_cycle
    return Segment(begin, min(end_of_segment, end_of_run), drive_from)


def single_segment(case: Case) -> Segment:
    """A whole run in one segment, as by hand.

    It has enough time to rest for most piles, and the cycles of the first attempt.
    """
    rest = RESTING_SEGMENTS * settling_steps(case) if case.run.rests else 0
    return Segment(0, rest + case.run.attempts[0] * case.run.steps_per_cycle, rest)


def settling_steps(case: Case) -> int:
    """Steps of a segment in which beads come to rest; it ends with a frame of beads and bridges."""
    sample = case.run.steps_per_sample * case.run.samples_per_bridge_sample
    return max(1, round(SETTLING_SECONDS / case.run.time_step / sample)) * sample


# --- decks ----------------------------------------------------------------------------------------


def render_deck(case: Case, segment: Segment | None = None) -> Deck:
    """Render a segment of the run of a case (None: the first one).

    The numbers of the deck read back as the same doubles.
    """
    return compose(plan_of(case, segment=segment))


def plan_of(*cases: Case, segment: Segment | None = None) -> Plan:
    """The plan of a deck that cases share: their bodies on one boundary, with their sampling.

    Parameters
    ----------
    *cases
        One case, or several that may share a deck (`walkers.templates.placement.sharing_key`).
    segment
        The steps of the deck; None: the first segment.
    """
    case = cases[0]
    run = case.run
    segment = segment or next_segment(case)
    scene, walkers = place(cases)
    columns = list(BEAD_COLUMNS)
    if walkers:
        columns += MEAN_SPIN_COLUMNS
    if case.liquid.conserved:
        columns.append(FILM_COLUMN)
    restart_to = None if run.has_one_segment else RESTART_NAME
    restart_from = PREVIOUS_RESTART_NAME if restart_to and segment.begin else None
    return Plan(
        case=case,
        scene=scene,
        segment=segment,
        sample_every=run.steps_per_sample,
        bridge_every=run.steps_per_sample * run.samples_per_bridge_sample,
        status_every=ceil(run.steps_per_cycle / STATUS_LINES_PER_CYCLE),
        bead_columns=tuple(columns),
        walkers=walkers,
        ranks=run.ranks,
        restart_to=restart_to,
        restart_from=restart_from,
        fastest=max(fastest_of(sharing, scene) for sharing in cases),
        skin=SKIN if case.loose else None,
    )


def compose(plan: Plan) -> Deck:
    """Compose a deck from its blocks; raises `InputError` if the law cannot be tabulated."""
    case = plan.case
    scene = plan.scene
    layout = _layout(plan)
    files = _files(plan)
    text = rendered("walkers.templates", "walker.lig.j2", _template_values(plan, layout, files))
    # The engine writes once a sample, and several times a cycle.
    steps_of_silence = min(case.run.steps_per_sample, case.run.steps_per_cycle)
    slowest = steps_of_silence * len(scene.beads) * _SLOWEST_STEP
    return Deck(
        text=text,
        files=files,
        layout=layout,
        box=(scene.lower, scene.upper),
        fastest=plan.fastest or fastest_of(case, scene),
        silence=max(_SILENCE, slowest),
        log_limit=max(_LOG_BYTES, case.run.cycles * _LOG_BYTES_PER_CYCLE),
        beyond_limits=bool(limits_of(case).exceeded_by(case.run.time_step)),
    )


def fastest_of(case: Case, scene: PlacedBodies) -> float:
    """A speed that no bead of a case can reach by the drive, gravity and the capillary forces, m/s.

    It is ten times the boundary's peak velocity (20 times in a pile), plus the speeds that the
    lightest bead gains in the deepest fall and by the work of a bridge.
    """
    radii = sorted(bead.radius for bead in scene.beads)
    smallest_mass = bead_volume(radii[0]) * case.beads.density
    bridge = bridge_at_rest(case, radii[-1], inf)
    work = abs(bridge.pull) * bridge.rupture  # among loose beads, a bridge may push
    depth = hop_height(case) if case.boundary.tilt == 0.0 else path_length(case)
    peak_velocities = 10.0
    if case.loose:
        depth = max(scene.upper[2], depth)
        peak_velocities = 20.0
    fall_speed = sqrt(2.0 * case.environment.gravity * depth)
    bridge_speed = sqrt(2.0 * work / smallest_mass)
    return peak_velocities * case.excitation.peak_velocity + fall_speed + bridge_speed


def _layout(plan: Plan) -> DeckLayout:
    """The layout of the output of a deck."""
    steps = plan.segment.end - plan.segment.begin
    return DeckLayout(
        bead_columns=plan.bead_columns,
        sample_every=plan.sample_every,
        frames=steps // plan.sample_every + 1,
        wall_bridge_columns=plan.wall_bridge_columns,
        bridge_every=plan.bridge_every,
        bridge_frames=steps // plan.bridge_every + 1,
        atoms=len(plan.scene.beads),
        steps=plan.segment.end,
        time_step=plan.case.run.time_step,
        walkers=plan.walkers,
        ranks=plan.ranks,
    )


# --- values for the blocks ------------------------------------------------------------------------


def _template_values(plan: Plan, layout: DeckLayout, files: Mapping[str, str]) -> dict[str, Any]:
    """The values that the blocks of a deck use, by the names that they have there."""
    case = plan.case
    contacts = [contact for contact, _ in plan.surfaces]
    frictions = [contact.friction for contact in contacts]
    liquid = _scalable_liquid(plan)
    start_velocity = _start_velocity(case.excitation)
    parameters = _parameters(plan, contacts, liquid)
    derived = derived_parameters(case, shaken=plan.shaken, start_velocity=start_velocity)
    return {
        "plan": plan,
        "case": case,
        "scene": plan.scene,
        "layout": layout,
        "names": _NAMES,
        "files": files,
        "parameters": parameters,
        "derived_parameters": derived,
        "parameter_names": [parameter.name for parameter in parameters + derived],
        "printed": PRINTED,
        "in_cycles": in_cycles,
        "vector_along": vector_along,
        "suffixes": suffixes(len(case.excitation.harmonics)),
        "contacts": [contact_values(contact) for contact in contacts],
        "friction_grows": any(friction.grows for friction in frictions),
        "moduli": [contact.youngs_modulus for contact in (*contacts, case.contact)],
        "scalable_liquid": liquid,
        "search": _neighbour_search(plan),
        "wall_words": _wall_words(plan.scene),
        "gravity_direction": _gravity_direction(case),
        "record_axes": _record_axes(case.excitation),
        "start_velocity": start_velocity,
        **layout.bridge_terms(),
    }


def _parameters(
    plan: Plan, contacts: Sequence[Contact], scalable_liquid: BridgeLiquid | None
) -> list[DeckParameter]:
    """The parameters of a deck that a user may edit, in the order of its lines."""
    case = plan.case
    stable_step = min(vars(limits_of(case)).values())
    return [
        *drive_parameters(case, shaken=plan.shaken),
        *length_parameters(case, stable_step, plan.rest_steps, plan.drive_steps),
        *material_parameters(
            case, contacts, scalable_liquid, with_density=plan.restart_from is None
        ),
    ]


def _scalable_liquid(plan: Plan) -> BridgeLiquid | None:
    """The liquid, if a deck may rescale the resistances of its bridges for another viscosity.

    The resistances of built-in laws are proportional to the viscosity; None for other laws, and for
    surfaces with several liquids.
    """
    surfaces = plan.surfaces
    _, liquid = surfaces[0]
    scalable = len(surfaces) == 1 and liquid.law in LAWS and liquid.viscosity > 0.0
    return liquid if scalable else None


def _start_velocity(drive: Excitation) -> list[float]:
    """Velocity of the walls at the start, m/s; empty if they rest, or if it is the sine's.

    The velocity of a sine is a parameter with a name.
    """
    if drive.frame != "lab" or (drive.is_plain and not drive.ramp):
        return []
    import numpy as np

    velocity = [0.0, 0.0, 0.0]
    for direction, (_, speeds, _) in drive.motions(np.zeros(1)):
        for axis in range(3):
            velocity[axis] += direction[axis] * float(speeds[0])
    return velocity


def _record_axes(drive: Excitation) -> dict[str, Vector]:
    """Unit vectors of the axes along which a record shakes the walls; empty without a record."""
    if drive.record is None:
        return {}
    return {axis: AXES[axis] for axis in drive.record.axes}


def _gravity_direction(case: Case) -> list[float]:
    """Unit vector of gravity in the frame of the boundary; empty without gravity."""
    gravity = case.environment.gravity
    if not gravity:
        return []
    return [component / gravity for component in case.gravity_vector]


def _wall_words(scene: PlacedBodies) -> list[str]:
    """Words of the command ``fix wall/bridge`` for each wall that is not in the file of facets."""
    words = [wall.deck_words() for wall in scene.walls]
    return [text for text in words if text]


def _neighbour_search(plan: Plan) -> NeighbourSearch:
    """The search for neighbours of a deck."""
    radii = [bead.radius for bead in plan.scene.beads]
    smallest = min(radii)
    largest = max(radii)
    skin = plan.skin or smallest
    width = plan.scene.upper[0] - plan.scene.lower[0]
    depth = plan.scene.upper[1] - plan.scene.lower[1]
    # At least as many of the smallest beads as fit into the search distance of the largest one.
    distance = largest + 2.0 * smallest + skin
    fitting = ceil((distance**3 - largest**3) / smallest**3)
    bin_size = None
    if plan.skin is None:
        # At most `_MOST_BINS` bins, none narrower than two of the largest beads.
        sides = zip(plan.scene.lower, plan.scene.upper, strict=True)
        volume = prod(high - low for low, high in sides)
        bin_size = max(4.0 * largest, (volume / _MOST_BINS) ** (1.0 / 3.0))
    return NeighbourSearch(
        skin=skin,
        most_neighbours=max(_LEAST_NEIGHBOURS, fitting),
        bin_size=bin_size,
        # In piles, sorted beads save a tenth of the time from some ten thousand beads on.
        sorted=plan.skin is not None,
        processor_grid=processor_grid(plan.ranks, width, depth),
    )


# --- further input files --------------------------------------------------------------------------


def _files(plan: Plan) -> dict[str, str]:
    """The further input files of a deck, name to text."""
    case = plan.case
    scene = plan.scene
    files = {BRIDGES_NAME: _tables_of_scene(case, scene)}
    files |= case.excitation.course_files()
    if len(scene.loadings) > 1:
        files[LOADS_NAME] = _loads(scene)
    facets = "".join(wall.file_rows() for wall in scene.walls)
    if facets:
        files[FACETS_NAME] = facets
    if plan.reads_beads:
        files[BEADS_NAME] = _beads_data(scene, case.beads.density, types=plan.atom_types)
    return files


def bridge_tables_of(
    case: Case, surfaces: Sequence[Surface], sizes: Collection[tuple[int, float]]
) -> str:
    """The bridge tables of a case, or of cases that share its law, as the engine reads them.

    Parameters
    ----------
    case
        The case; its recorded law is used, if it has one.
    surfaces
        Contact parameters and liquid of each atom type of beads.
    sizes
        Atom type (from 1) and radius (m) of the beads.

    Returns
    -------
    str
        The text of the file (`walkers.templates.bridge_tables.bridge_tables`).

    Raises
    ------
    InputError
        If the law of the bridges cannot be tabulated.
    """
    from walkers.templates.bridge_tables import bridge_tables

    try:
        return bridge_tables(surfaces, sizes, case.recorded_law)
    except ValueError as error:
        raise InputError(case.name, [Problem("liquid.law", case.liquid.law, str(error))]) from error


def _tables_of_scene(case: Case, scene: PlacedBodies) -> str:
    """The bridge tables of the beads of a scene, whose cases have the law of this one."""
    sizes = {(bead.surface, bead.radius) for bead in scene.beads}
    return bridge_tables_of(case, scene.surfaces or (surface_of(case),), sizes)


def bridge_tables_digest(case: Case) -> str:
    """SHA-256 of the bridge tables that the engine reads for a case, hexadecimal.

    The tables follow from the case and the program. They are not part of a run's name, which must
    be known before bridges are solved; the manifest has this digest.
    """
    scene, _ = place((case,))
    tables = _tables_of_scene(case, scene)
    return hashlib.sha256(tables.encode("utf-8", "surrogateescape")).hexdigest()


def _loads(scene: PlacedBodies) -> str:
    """Loads of the beads whose loading is not the first, as the engine reads them.

    A line has the number of the bead, gravity and the amplitude of each harmonic.
    """
    lines = []
    for bead in scene.beads:
        if bead.loading == 0:
            continue
        words = [str(bead.id)]
        for load in scene.loadings[bead.loading]:
            words += [repr(component) for component in load]
        lines.append(" ".join(words) + "\n")
    return "".join(lines)


def _beads_data(scene: PlacedBodies, density: float, types: int) -> str:
    """The box and the beads at the start in the format of the engine's ``read_data``.

    Parameters
    ----------
    scene
        The beads and the box.
    density
        Density of the beads that have no density of their own, kg/m³.
    types
        Number of atom types.

    Returns
    -------
    str
        The text of the file, for the atom style ``granular``.
    """
    lines = [
        "Beads at the start: id, type, diameter (m), density (kg/m^3), centre (m)",
        "",
        f"{len(scene.beads)} atoms",
        f"{types} atom types",
        "",
    ]
    for axis, low, high in zip("xyz", scene.lower, scene.upper, strict=True):
        lines.append(f"{float(low)!r} {float(high)!r} {axis}lo {axis}hi")
    lines += ["", "Atoms", ""]
    for bead in scene.beads:
        own_density = density if bead.density is None else bead.density
        numbers = (2.0 * bead.radius, own_density, *bead.centre)
        lines.append(f"{bead.id} {bead.surface} {numbers_text(numbers)}")
    lines += ["", "Velocities", ""]
    for bead in scene.beads:
        lines.append(f"{bead.id} {numbers_text((*bead.velocity, *bead.spin))}")
    return "\n".join(lines) + "\n"
