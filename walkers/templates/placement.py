"""Contents of the simulation box: beads and walls of one case, or of several cases that share a deck.

A deck has one time step and one shape of boundary; its walls do not move if walkers of several cases stand on them.
Walkers may differ in radii, start, surfaces (friction, restitution) and liquid, which become atom types, and in their
loads: tilt of the boundary, axes and acceleration of the drive. Frequencies and phases of the drive are the same for
all.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from walkers.arrays import Vector
from walkers.inputs.resolving.loads import hop_height, path_length
from walkers.inputs.resolving.standing import standing
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES
from walkers.inputs.tables.materials import Contact
from walkers.inputs.tables.shapes.walls import Wall
from walkers.physics.capillary import BridgeLiquid
from walkers.templates.layout import PlacedWalker

Surface = tuple[Contact, BridgeLiquid]
"""Contact parameters of beads: an atom type of a deck."""


@dataclass(frozen=True)
class Bead:
    """A bead at the start; m, m/s, rad/s, kg/m³."""

    id: int
    centre: Vector
    radius: float
    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    surface: int = 1  # number of its surface in the scene, from 1
    loading: int = 0  # index of its loading in the scene, from 0
    density: float | None = None  # None: as in the case


Loading = tuple[Vector, ...]
"""Loads on a bead: gravity (m/s²), and the amplitude (m) of each harmonic of the drive."""


@dataclass(frozen=True)
class PlacedBodies:
    """Beads, walls and corners of the box, in m; and the different surfaces and loadings."""

    beads: tuple[Bead, ...]
    walls: tuple[Wall, ...]
    lower: Vector
    upper: Vector
    surfaces: tuple[Surface, ...] = ()  # empty: one, of the case
    loadings: tuple[Loading, ...] = ()


def surface_of(case: Case) -> Surface:
    """Contact parameters of the beads of a case."""
    return case.contact, case.liquid.of_bridges


def loading_of(case: Case) -> Loading:
    """Loads on the beads of a case."""
    drive = case.excitation
    amplitudes = [(harmonic.amplitude, harmonic.direction) for harmonic in drive.harmonics]
    amplitudes += [(1.0, AXES[axis]) for axis in (drive.record.axes if drive.record else ())]
    return case.gravity_vector, *((a * x, a * y, a * z) for a, (x, y, z) in amplitudes)


def sharing_key(case: Case) -> Hashable:
    """All properties of a case that a deck has only once: cases with equal keys may share a deck.

    The time step is one of them: the step of a case does not depend on the others.
    """
    if not case.independent:
        return case
    # Walkers with a spacing below their own reach would meet other neighbours in a shared deck.
    crowded = (
        case if min(walkers.spacing for walkers in case.walkers) < 2.0 * path_length(case) else None
    )
    # The model of rolling friction is in the deck or not.
    rolling = float(case.contact.rolling_friction > 0.0)
    contact = case.contact.with_values(
        friction=None, roughness=None, restitution=0.0, rolling_friction=rolling
    )
    boundary = case.boundary.with_values(material="", tilt=0.0, uphill=0.0)
    times: Hashable = (
        *((harmonic.frequency, harmonic.phase) for harmonic in case.excitation.harmonics),
        case.drive.record,
        case.drive.repeats,
        case.drive.ramp,
    )
    driven = (case.excitation, loading_of(case)) if case.drive.frame == "lab" else times
    run = tuple(case.run.with_values(seed=0).determinants().items())
    return (boundary, contact, driven, run, case.beads.density, crowded)


@lru_cache(maxsize=4)  # the segments of a run begin with the same scene
def place(cases: tuple[Case, ...]) -> tuple[PlacedBodies, tuple[PlacedWalker, ...]]:
    """Place the bodies of cases that share a deck, and size the box so that no walker can leave it unnoticed.

    Each walker draws its start from its own random stream (seed, number of the walker in its case), so that walker k
    does not depend on the other cases.
    """
    if len({sharing_key(case) for case in cases}) != 1:
        raise ValueError("these cases cannot share a deck")
    surfaces = tuple(dict.fromkeys(surface_of(case) for case in cases))
    loadings = tuple(dict.fromkeys(loading_of(case) for case in cases))
    bodies = [(case, make, body) for case in cases for make, body in standing(case)]
    walking = sum(bool(body.facing) for _, _, body in bodies)
    spacing = max((walkers.spacing for case in cases for walkers in case.walkers), default=0.0)
    boundary = cases[0].boundary
    grid = boundary.geometry.grid(walking, spacing) if walking else []
    walkers: list[PlacedWalker] = []
    beads: list[Bead] = []
    for case, make, body in bodies:
        x, y = origin = grid[len(walkers)] if body.facing else (0.0, 0.0)
        surface, loading = 1 + surfaces.index(surface_of(case)), loadings.index(loading_of(case))
        ids = tuple(range(1 + len(beads), 1 + len(beads) + len(body.beads)))
        for number, bead in zip(ids, body.beads, strict=True):
            centre = (x + bead.x, y + bead.y, bead.z)
            beads.append(Bead(number, centre, bead.radius, surface=surface, loading=loading))
        if body.facing:
            walkers.append(PlacedWalker(len(walkers), make, ids, body.facing, body.angle, origin))
    room = _room(cases, grid, spacing)
    return PlacedBodies(tuple(beads), boundary.walls, *room, surfaces, loadings), tuple(walkers)


def _room(
    cases: Sequence[Case], grid: Sequence[tuple[float, float]], spacing: float
) -> tuple[Vector, Vector]:
    far = max(spacing / 2.0, *(path_length(case) for case in cases))
    largest = max(max(case.radii) for case in cases)
    amplitude = max(case.excitation.farthest for case in cases)
    placed = [bead.at for case in cases for bead in case.placed]
    return cases[0].boundary.geometry.simulation_box(
        half_x=max([x for x, _ in grid] + [abs(x) for x, _, _ in placed], default=0.0) + far,
        half_y=max([y for _, y in grid] + [abs(y) for _, y, _ in placed], default=0.0) + far,
        height=10.0 * largest
        + max([z for _, _, z in placed], default=0.0)
        + max(hop_height(case) for case in cases)
        + 2.0 * amplitude,
        margin=4.0 * largest + 2.0 * amplitude,
        largest=largest,
    )
