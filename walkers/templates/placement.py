"""Contents of the simulation box: beads and walls of one case, or of cases that share a deck.

A deck has one time step and one shape of boundary; its walls do not move if walkers of several
cases stand on them. The walkers may differ in radii and in how they start; in surfaces (friction,
restitution) and liquid, which become atom types; and in their loads: tilt of the boundary, axes and
acceleration of the drive. Frequencies and phases of the drive are the same for all.

How the beads of one walker or of one pile stand is decided in
`walkers.inputs.resolving.standing.starting_groups`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from walkers.arrays import Vector
from walkers.inputs.resolving.loads import hop_height, path_length
from walkers.inputs.resolving.standing import StartingGroup, starting_groups
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES
from walkers.inputs.tables.materials import Contact
from walkers.inputs.tables.shapes.walls import Wall
from walkers.physics.capillary import BridgeLiquid
from walkers.templates.layout import PlacedWalker

Surface = tuple[Contact, BridgeLiquid]
"""Contact parameters and liquid of beads: an atom type of a deck."""

Loading = tuple[Vector, ...]
"""Loads on a bead: gravity (m/s²), then the amplitude of each harmonic of the drive (m)."""


@dataclass(frozen=True)
class Bead:
    """A bead at the start.

    Attributes
    ----------
    id
        Its number in the engine, from 1.
    centre
        Position, m.
    radius
        Radius, m.
    velocity
        Velocity, m/s.
    spin
        Angular velocity, rad/s.
    surface
        Number of its surface in the scene, from 1: its atom type.
    loading
        Index of its loading in the scene, from 0.
    density
        Density, kg/m³; None: that of the case.
    """

    id: int
    centre: Vector
    radius: float
    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    surface: int = 1
    loading: int = 0
    density: float | None = None


@dataclass(frozen=True)
class PlacedBodies:
    """Beads and walls in the simulation box.

    Attributes
    ----------
    beads
        The beads at the start, in the order of their numbers.
    walls
        The walls of the boundary.
    lower, upper
        Corners of the box, m.
    surfaces
        The different surfaces of the beads; empty: one, that of the case.
    loadings
        The different loads on the beads; empty: one, that of the case.
    """

    beads: tuple[Bead, ...]
    walls: tuple[Wall, ...]
    lower: Vector
    upper: Vector
    surfaces: tuple[Surface, ...] = ()
    loadings: tuple[Loading, ...] = ()


def surface_of(case: Case) -> Surface:
    """Contact parameters and liquid of the beads of a case."""
    return case.contact, case.liquid.of_bridges


def loading_of(case: Case) -> Loading:
    """Loads on the beads of a case.

    A record has the amplitude 1 along each of its axes: its displacement is in a file of the deck.
    """
    drive = case.excitation
    loads = [case.gravity_vector]
    loads += [_scaled(harmonic.amplitude, harmonic.direction) for harmonic in drive.harmonics]
    if drive.record is not None:
        loads += [_scaled(1.0, AXES[axis]) for axis in drive.record.axes]
    return tuple(loads)


def _scaled(factor: float, vector: Vector) -> Vector:
    """A vector times a factor."""
    x, y, z = vector
    return factor * x, factor * y, factor * z


def sharing_key(case: Case) -> Hashable:
    """The properties of a case of which a deck has only one: cases with equal keys may share it.

    The time step is one of them: the step of a case does not depend on the others.
    """
    if not case.independent:
        return case
    crowded_case = None
    if min(walkers.spacing for walkers in case.walkers) < 2.0 * path_length(case):
        # Walkers that stand so close would meet other neighbours in a shared deck.
        crowded_case = case
    # The deck either has the model of rolling friction or not.
    rolling = float(case.contact.rolling_friction > 0.0)
    # A deck may have several of all values that are set to the same here.
    contact = case.contact.with_values(
        friction=None, roughness=None, restitution=0.0, rolling_friction=rolling
    )
    boundary = case.boundary.with_values(material="", tilt=0.0, uphill=0.0)
    run = tuple(case.run.with_values(seed=0).determinants().items())
    return (boundary, contact, _drive_key(case), run, case.beads.density, crowded_case)


def _drive_key(case: Case) -> Hashable:
    """The properties of the drive of which a deck has only one.

    Walls that move (frame ``lab``) have one displacement; in the frame of the walls, each bead has
    amplitudes of its own.
    """
    if case.drive.frame == "lab":
        return case.excitation, loading_of(case)
    tones = tuple((harmonic.frequency, harmonic.phase) for harmonic in case.excitation.harmonics)
    return (
        tones,
        case.drive.record,
        case.drive.repeats,
        case.drive.ramp,
    )


@lru_cache(maxsize=4)  # the segments of a run begin with the same scene
def place(cases: tuple[Case, ...]) -> tuple[PlacedBodies, tuple[PlacedWalker, ...]]:
    """Place the bodies of cases that share a deck, in a box that no walker can leave unnoticed.

    Each walker draws its start from its own random stream (seed, number of the walker in its case),
    so that walker k does not depend on the other cases.

    Parameters
    ----------
    cases
        Cases with the same `sharing_key`.

    Returns
    -------
    PlacedBodies
        The beads of all cases, their walls and the box.
    tuple of PlacedWalker
        The walkers, in the order in which their beads are placed.

    Raises
    ------
    ValueError
        If the cases cannot share a deck.
    """
    if len({sharing_key(case) for case in cases}) != 1:
        raise ValueError("these cases cannot share a deck")
    surfaces = tuple(dict.fromkeys(surface_of(case) for case in cases))
    loadings = tuple(dict.fromkeys(loading_of(case) for case in cases))
    spacing = _largest_spacing(cases)
    bodies = _standing_bodies(cases)
    places = _places_of_walkers(bodies, spacing)
    walkers: list[PlacedWalker] = []
    beads: list[Bead] = []
    for case, kind, body in bodies:
        is_walker = bool(body.facing)
        x, y = places[len(walkers)] if is_walker else (0.0, 0.0)
        surface = 1 + surfaces.index(surface_of(case))
        loading = loadings.index(loading_of(case))
        first_id = 1 + len(beads)
        ids = tuple(range(first_id, first_id + len(body.beads)))
        for number, bead in zip(ids, body.beads, strict=True):
            centre = (x + bead.x, y + bead.y, bead.z)
            beads.append(Bead(number, centre, bead.radius, surface=surface, loading=loading))
        if is_walker:
            walker = PlacedWalker(
                walker=len(walkers),
                kind=kind,
                beads=ids,
                facing=body.facing,
                start_angle=body.angle,
                origin=(x, y),
            )
            walkers.append(walker)
    lower, upper = _box(cases, places, spacing)
    scene = PlacedBodies(
        beads=tuple(beads),
        walls=cases[0].boundary.walls,
        lower=lower,
        upper=upper,
        surfaces=surfaces,
        loadings=loadings,
    )
    return scene, tuple(walkers)


def _largest_spacing(cases: Sequence[Case]) -> float:
    """The largest spacing of walkers of the cases, m; 0 without walkers."""
    spacings = [0.0]
    for case in cases:
        spacings.extend(walkers.spacing for walkers in case.walkers)
    return max(spacings)


def _standing_bodies(cases: Sequence[Case]) -> list[tuple[Case, int, StartingGroup]]:
    """The bodies of all cases at the start, each with its case and the number of its kind there."""
    bodies = []
    for case in cases:
        for kind, body in starting_groups(case):
            bodies.append((case, kind, body))
    return bodies


def _places_of_walkers(
    bodies: Sequence[tuple[Case, int, StartingGroup]], spacing: float
) -> list[tuple[float, float]]:
    """The places of the walkers on the boundary, x and y in m, for their spacing (m)."""
    walkers = 0
    for _, _, body in bodies:
        if body.facing:
            walkers += 1
    if walkers == 0:
        return []
    case, _, _ = bodies[0]
    return case.boundary.geometry.grid(walkers, spacing)


def _box(
    cases: Sequence[Case], places: Sequence[tuple[float, float]], spacing: float
) -> tuple[Vector, Vector]:
    """Lower and upper corner of the simulation box, m.

    It contains the paths of all walkers. Above the beads that a case places, it has room for ten
    radii of the largest bead, the highest hop of a walker, and the drive in both directions.

    Parameters
    ----------
    cases
        The cases that share the deck.
    places
        Places of the walkers, x and y in m.
    spacing
        Largest spacing of the walkers, m.
    """
    path = max(spacing / 2.0, *(path_length(case) for case in cases))
    largest = max(max(case.radii) for case in cases)
    amplitude = max(case.excitation.farthest for case in cases)
    farthest_x = [x for x, _ in places]
    farthest_y = [y for _, y in places]
    heights = []
    for case in cases:
        for bead in case.placed:
            x, y, z = bead.at
            farthest_x.append(abs(x))
            farthest_y.append(abs(y))
            heights.append(z)
    hop = max(hop_height(case) for case in cases)
    return cases[0].boundary.geometry.simulation_box(
        half_x=max(farthest_x, default=0.0) + path,
        half_y=max(farthest_y, default=0.0) + path,
        height=10.0 * largest + max(heights, default=0.0) + hop + 2.0 * amplitude,
        margin=4.0 * largest + 2.0 * amplitude,
        largest=largest,
    )
