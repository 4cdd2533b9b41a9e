"""Render a case to a LIGGGHTS deck with its files and its layout."""

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
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES, Excitation
from walkers.physics.capillary import bead_volume
from walkers.physics.laws import LAWS
from walkers.templates.layout import (
    BEAD_COLUMNS,
    FILM_COLUMN,
    MEAN_SPIN_COLUMNS,
    DeckLayout,
    PlacedWalker,
)
from walkers.templates.placement import PlacedBodies, Surface, place, surface_of
from walkers.text import rendered

DECK_NAME = "walker.lig"
OUTPUT_NAME = "engine.log"
LAYOUT_NAME = "layout.json"
BRIDGES_NAME = "bridges.txt"
SCALED_BRIDGES_NAME = "bridges.scaled.txt"
"""Tables that a deck run by hand writes if its viscosity was edited."""
LOADS_NAME = "loads.txt"
FACETS_NAME = "facets.txt"
BEADS_NAME = "beads.data"
"""File of many beads in the format of ``read_data``; few are created by the deck itself."""
RUN_NAME = "run.sh"
SCALE_NAME = "scale.awk"
"""Script beside decks to be run by hand: rescales the tables for an edited viscosity."""
_NAMES = {
    **{"layout": LAYOUT_NAME, "bridges": BRIDGES_NAME, "scaled": SCALED_BRIDGES_NAME},
    **{
        "loads": LOADS_NAME,
        "facets": FACETS_NAME,
        "beads": BEADS_NAME,
        "run": RUN_NAME,
        "scale": SCALE_NAME,
    },
}
STATUS_LINES_PER_CYCLE = 4
PRINTED = "parameters:"
"""Start of the line in which the engine prints the parameters."""
CONTENT_VERSION = 10
"""Version of the numbers of decks, part of the names of runs: increase it if a case gives other numbers.

Do not increase it if decks with another text give the same numbers bit for bit.
"""

RESTART_NAME = "state.restart"
PREVIOUS_RESTART_NAME = "previous.restart"
SETTLING_SECONDS = 0.05
"""Length of the segments in which beads come to rest; at the end of each we check whether they have."""
RESTING_SEGMENTS = 3
"""Largest number of such segments that piles needed."""
MOST_CREATED = 100
"""Largest number of beads that a deck creates one by one. Each ``set atom`` walks through all atoms: 50,000 beads
take 9 s, from a file of ``read_data`` 0.1 s."""
_LEAST_NEIGHBOURS = 100
_SILENCE = 600.0  # s; piles of 200 beads write some thirty lines a second, those of 20,000 one in four seconds
_SLOWEST_STEP = (
    4e-5  # s a bead: thirty times the time with two beads alone, a hundred times the time in a pile
)
_LOG_BYTES = 64e6  # walkers write some 50 kB, a segment of a pile as much …
_LOG_BYTES_PER_CYCLE = 1e4  # … and a cycle some 500 bytes
_SKIN = 2e-4
"""m; for piles. From 0.1 to 0.3 mm, the time per step changes by a few per cent."""


@dataclass(frozen=True)
class Deck:
    """A deck that is ready to run."""

    text: str  # the input script
    files: Mapping[str, str]  # further input files, name to text
    layout: DeckLayout  # of its output
    box: tuple[Vector, Vector]  # corners of the simulation box, m
    fastest: float  # a speed that no bead can reach by the drive, gravity and the capillary forces alone, m/s
    silence: float  # how long the engine may write nothing, s
    log_limit: float  # how large its log may become, bytes
    beyond_limits: bool = False  # whether the time step exceeds a limit (`run.allow_unstable`)


class Segment(NamedTuple):
    """A segment of a run between two steps, from the restart file of the segment before, if there is one.

    ``drive_from`` is the step at which the drive begins; None while the beads come to rest.
    """

    begin: int
    end: int
    drive_from: int | None


@dataclass(frozen=True)
class Plan:
    """Contents of a deck."""

    case: Case  # materials, liquid, contacts, drive, gravity and time step
    scene: PlacedBodies
    segment: Segment
    sample_every: int  # steps between frames of beads, …
    bridge_every: int  # … of bridges …
    status_every: int  # … and lines of the engine's log
    bead_columns: tuple[str, ...] = BEAD_COLUMNS
    wall_bridge_columns: tuple[str, ...] = DeckLayout.wall_bridge_columns
    walkers: tuple[PlacedWalker, ...] = ()  # with the ids of their beads
    prescribed: bool = False  # beads keep their velocities instead of following the forces
    ranks: int = 1  # number of MPI processes
    restart_to: str | None = None  # restart file to write at the end
    restart_from: str | None = None  # restart file to continue from
    fastest: float | None = (
        None  # speed that no bead can reach, m/s; default: `fastest_of` the case
    )
    skin: float | None = (
        None  # search distance for neighbours beyond contact, m; default: the smallest radius, with
    )
    # wide bins, for few beads far apart


def next_segment(case: Case, begin: int = 0, start: int | None = None) -> Segment:
    """The segment of a run from a step on, after the start of the drive (None: not yet); empty after the last one."""
    run = case.run
    if start is None and run.rests:
        return Segment(begin, begin + settling_steps(case), None)
    start = start or 0
    end = min(
        begin + run.cycles_per_segment * run.steps_per_cycle,
        start + run.attempts[0] * run.steps_per_cycle,
    )
    return Segment(begin, end, start)


def single_segment(case: Case) -> Segment:
    """A run in one segment, as by hand: enough time to rest for most piles, and the cycles of the first attempt."""
    rest = RESTING_SEGMENTS * settling_steps(case) if case.run.rests else 0
    return Segment(0, rest + case.run.attempts[0] * case.run.steps_per_cycle, rest)


def settling_steps(case: Case) -> int:
    """Steps of a segment in which beads come to rest; it ends with a frame of beads and bridges."""
    sample = case.run.steps_per_sample * case.run.samples_per_bridge_sample
    return max(1, round(SETTLING_SECONDS / case.run.time_step / sample)) * sample


def render_deck(case: Case, segment: Segment | None = None) -> Deck:
    """Render a segment of the run of a case (default: the first one); numbers read back as the same doubles."""
    return compose(plan_of(case, segment=segment))


def plan_of(*cases: Case, segment: Segment | None = None) -> Plan:
    """The plan of a segment of cases that share a deck: their bodies on one boundary, with their sampling."""
    case, run = cases[0], cases[0].run
    segment = segment or next_segment(case)
    scene, walkers = place(cases)
    columns = [
        *BEAD_COLUMNS,
        *(MEAN_SPIN_COLUMNS if walkers else ()),
        *([FILM_COLUMN] * case.liquid.conserved),
    ]
    restart = None if run.has_one_segment else RESTART_NAME
    return Plan(
        case=case,
        scene=scene,
        segment=segment,
        sample_every=run.steps_per_sample,
        bridge_every=run.steps_per_sample * run.samples_per_bridge_sample,
        status_every=-(-run.steps_per_cycle // STATUS_LINES_PER_CYCLE),
        bead_columns=tuple(columns),
        walkers=walkers,
        ranks=run.ranks,
        restart_to=restart,
        restart_from=PREVIOUS_RESTART_NAME if restart and segment.begin else None,
        fastest=max(fastest_of(sharing, scene) for sharing in cases),
        skin=_SKIN if case.loose else None,
    )


def compose(plan: Plan) -> Deck:
    """Compose a deck from its blocks; raises `InputError` if the law of the bridges cannot be tabulated."""
    case, scene, layout, gravity = (
        plan.case,
        plan.scene,
        _layout(plan),
        plan.case.environment.gravity,
    )
    surfaces = scene.surfaces or (surface_of(case),)
    liquid, contacts = surfaces[0][1], [contact for contact, _ in surfaces]
    # Resistances of built-in laws are proportional to the viscosity.
    scalable = len(surfaces) == 1 and liquid.law in LAWS and liquid.viscosity > 0.0
    files = {BRIDGES_NAME: _tables_of_scene(case, scene)}
    record = case.excitation.record
    files |= case.excitation.course_files()
    files |= {LOADS_NAME: _loads(scene)} if len(scene.loadings) > 1 else {}
    facets = "".join(wall.file_rows() for wall in scene.walls)
    if facets:
        files[FACETS_NAME] = facets
    if len(scene.beads) > MOST_CREATED and not plan.restart_from:
        files[BEADS_NAME] = _beads_data(scene, case.beads.density, types=len(surfaces) + 1)
    limits = limits_of(case)
    values = {
        "plan": plan,
        "case": case,
        "scene": scene,
        "layout": layout,
        "names": _NAMES,
        "wall_words": [words for wall in scene.walls if (words := wall.deck_words())],
        "files": files,
        "named": {},
        "printed": PRINTED,
        "in_cycles": in_cycles,
        "along": along,
        "types": len(surfaces) + 1,
        "ends": suffixes(len(case.excitation.harmonics)),
        "down": [component / gravity for component in case.gravity_vector] if gravity else [],
        "recorded": {axis: AXES[axis] for axis in record.axes} if record else {},
        "start": _start(case.excitation),
        "shaken": plan.segment.drive_from is not None,
        "stable": min(vars(limits).values()),
        "contacts": contacts,
        "moduli": [contact.youngs_modulus for contact in (*contacts, case.contact)],
        "liquid": liquid if scalable else None,
        **layout.bridge_terms(),
        **_search(plan),
    }
    text = rendered("walkers.templates", "walker.lig.j2", values)
    fastest = plan.fastest or fastest_of(case, scene)
    beyond = bool(limits.exceeded_by(case.run.time_step))
    # The engine writes once a sample, and several times a cycle.
    slowest = (
        min(case.run.steps_per_sample, case.run.steps_per_cycle) * len(scene.beads) * _SLOWEST_STEP
    )
    bounds = (max(_SILENCE, slowest), max(_LOG_BYTES, case.run.cycles * _LOG_BYTES_PER_CYCLE))
    return Deck(text, files, layout, (scene.lower, scene.upper), fastest, *bounds, beyond)


# Texts of the named parameters of a deck (``blocks/parameters.lig.j2``), lines that a user may edit. LIGGGHTS replaces
# ``${name}`` by the text of a ``string`` variable, and computes ``$(formula)`` in double precision to 20 digits. A deck
# with names therefore gives the same results bit for bit as one with numbers. An ``equal`` variable has 15 digits.


def suffixes(count: int) -> list[str]:
    """Suffixes for the names of several parameters of a kind; empty for a single one."""
    return [""] if count == 1 else [f"_{place}" for place in range(1, count + 1)]


def in_cycles(steps: int, steps_per_cycle: int) -> str:
    """Steps as a multiple or a part of a cycle, if possible."""
    whole, rest = divmod(steps, steps_per_cycle)
    if whole and not rest:
        return "${steps_per_cycle}" if whole == 1 else f"$({whole}*v_steps_per_cycle)"
    for parts in (steps_per_cycle // steps, STATUS_LINES_PER_CYCLE):
        if parts and ceil(steps_per_cycle / parts) == steps:
            return (
                f"$(ceil(v_steps_per_cycle/{parts}))"
                if steps_per_cycle % parts
                else f"$(v_steps_per_cycle/{parts})"
            )
    return str(steps)


def along(name: str, direction: Vector) -> str:
    """A parameter times a unit vector."""
    parts = {1.0: f"${{{name}}}", 0.0: "0.0"}
    return " ".join(parts.get(part, f"$(v_{name}*({float(part)!r}))") for part in direction)


def _start(drive: Excitation) -> list[float]:
    """Velocity of the walls at the start, m/s; empty if they rest, or if it is the sine's, which has a name."""
    if drive.frame != "lab" or (drive.is_plain and not drive.ramp):
        return []
    import numpy as np

    moved = [
        (direction, float(speed[0])) for direction, (_, speed, _) in drive.motions(np.zeros(1))
    ]
    return [sum(direction[axis] * speed for direction, speed in moved) for axis in range(3)]


def bridge_tables_of(
    case: Case, surfaces: Sequence[Surface], sizes: Collection[tuple[int, float]]
) -> str:
    """`bridge_tables` of a case, or of cases with its law; raises `InputError` if the law cannot be used."""
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

    The tables follow from the case and the program. They are not part of a run's name, which must be
    known before bridges are solved; the manifest has this digest.
    """
    scene, _ = place((case,))
    tables = _tables_of_scene(case, scene)
    return hashlib.sha256(tables.encode("utf-8", "surrogateescape")).hexdigest()


def _loads(scene: PlacedBodies) -> str:
    """Gravity and the amplitude of each harmonic for beads whose loading is not the first, as the engine reads them."""
    return "".join(
        " ".join(
            [str(bead.id), *(repr(x) for vector in scene.loadings[bead.loading] for x in vector)]
        )
        + "\n"
        for bead in scene.beads
        if bead.loading
    )


def _search(plan: Plan) -> dict[str, Any]:
    """The search for neighbours: skin and width of the bins (m), neighbours of a bead, whether bins are many."""
    radii = [bead.radius for bead in plan.scene.beads]
    smallest, largest = min(radii), max(radii)
    skin = plan.skin or smallest
    sight = largest + 2.0 * smallest + skin
    space = prod(high - low for low, high in zip(plan.scene.lower, plan.scene.upper, strict=True))
    return {
        "skin": skin,
        # At least the number of the smallest beads that fit into the search distance of the largest one.
        "most_neighbours": max(_LEAST_NEIGHBOURS, ceil((sight**3 - largest**3) / smallest**3)),
        # At most about ten thousand bins, none smaller than two beads.
        "bin_size": None if plan.skin else max(4.0 * largest, (space / 2e4) ** (1.0 / 3.0)),
        # In piles, sorted beads save a tenth of the time from some ten thousand beads on.
        "sorted": plan.skin is not None,
        "grid": processor_grid(plan),
    }


def processor_grid(plan: Plan) -> tuple[int, int]:
    """Numbers of subdomains along x and y, one for each rank, with the shortest cuts through the box.

    The box is not cut along z: beads lie at its bottom, and ranks above them would wait.
    """
    (x_low, y_low, _), (x_high, y_high, _) = plan.scene.lower, plan.scene.upper
    width, depth = x_high - x_low, y_high - y_low

    def length_of_cuts(along_x: int) -> float:
        return (along_x - 1) * depth + (plan.ranks // along_x - 1) * width

    divisors = [divisor for divisor in range(plan.ranks, 0, -1) if plan.ranks % divisor == 0]
    along_x = min(divisors, key=length_of_cuts)
    return along_x, plan.ranks // along_x


def _beads_data(scene: PlacedBodies, density: float, types: int) -> str:
    """The box and the beads at the start in the format of the engine's ``read_data``, for the atom style granular."""
    lines = ["Beads at the start: id, type, diameter (m), density (kg/m^3), centre (m)", ""]
    lines += [f"{len(scene.beads)} atoms", f"{types} atom types", ""]
    for axis, low, high in zip("xyz", scene.lower, scene.upper, strict=True):
        lines.append(f"{float(low)!r} {float(high)!r} {axis}lo {axis}hi")
    lines += ["", "Atoms", ""]
    for bead in scene.beads:
        own_density = density if bead.density is None else bead.density
        numbers = (2.0 * bead.radius, own_density, *bead.centre)
        lines.append(
            " ".join([str(bead.id), str(bead.surface), *(repr(float(x)) for x in numbers)])
        )
    lines += ["", "Velocities", ""]
    for bead in scene.beads:
        motion = (*bead.velocity, *bead.spin)
        lines.append(" ".join([str(bead.id), *(repr(float(x)) for x in motion)]))
    return "\n".join(lines) + "\n"


def fastest_of(case: Case, scene: PlacedBodies) -> float:
    """Ten times the boundary's peak velocity (20 in a pile), plus the speeds of the deepest fall and a bridge, m/s."""
    sizes = sorted(bead.radius for bead in scene.beads)
    mass = bead_volume(sizes[0]) * case.beads.density
    bridge = bridge_at_rest(case, sizes[-1], inf)
    work = abs(bridge.pull) * bridge.rupture  # among loose beads, a bridge may push
    deep = hop_height(case) if case.boundary.tilt == 0.0 else path_length(case)
    fall = sqrt(
        2.0 * case.environment.gravity * (max(scene.upper[2], deep) if case.loose else deep)
    )
    return (
        (20.0 if case.loose else 10.0) * case.excitation.peak_velocity
        + fall
        + sqrt(2.0 * work / mass)
    )


def _layout(plan: Plan) -> DeckLayout:
    steps = plan.segment.end - plan.segment.begin
    same = (
        "bead_columns",
        "sample_every",
        "wall_bridge_columns",
        "bridge_every",
        "walkers",
        "ranks",
    )
    return DeckLayout(
        **{name: getattr(plan, name) for name in same},
        frames=steps // plan.sample_every + 1,
        bridge_frames=steps // plan.bridge_every + 1,
        atoms=len(plan.scene.beads),
        steps=plan.segment.end,
        time_step=plan.case.run.time_step,
    )
