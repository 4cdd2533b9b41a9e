"""Decks of piles: the beads' places at the start, the container, and the segments that a run is made in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, sin, sqrt

from walkers.inputs.pile import LOOSE, PileCase, lattice, lattice_pitch, turns_of_sides
from walkers.physics.capillary import bridge_volume_at_wall, capillary_force_at_wall, rupture_distance
from walkers.templates.deck import Checkpoint, Deck, Plan, Recording, compose
from walkers.templates.scene import Bead, Face, Point, Scene

RESTART_NAME = "state.restart"
PREVIOUS_RESTART_NAME = "previous.restart"
BEAD_COLUMNS = ("id", "type", "radius", "x", "y", "z", "vx", "vy", "vz")
PAIR_COLUMNS = ("id1", "id2", "fx", "fy", "fz", "overlap")
WALL_COLUMNS = ("x", "y", "z", "triangle", "id", "fx", "fy", "fz")
_SKIN = 2e-4
"""m; between 0.1 and 0.3 mm it makes no difference of more than some per cent to the time of a step."""
_STATUS_LINES_PER_CYCLE = 2
SETTLING_SECONDS = 0.05
"""Length of the segments in which a pile settles; at the end of each we check whether it has."""


@dataclass(frozen=True)
class Segment:
    """A segment of a run: from a step to a step, from a restart file (unless it is the first) to the next.

    ``drive_from`` is the step at which the drive begins; None while the pile settles.
    """

    begin: int
    end: int
    drive_from: int | None


def faces_of(case: PileCase) -> tuple[Face, ...]:
    """The floor first, then the side walls; centroids off the middle, where ranks may meet.

    A cylinder is a prism around it: its faces touch it, and beads never meet an edge from outside.
    """
    half, aside = case.container.width / 2.0, 0.0137 * case.container.width
    level = case.container.height / 4.0
    floor = Face("z", 1, (aside, 0.0, 0.0))
    if case.container.shape == "cylinder":
        sides = [((half * cos(turn), half * sin(turn), level), turn) for turn in turns_of_sides()]
        return (floor, *(Face("x", -1, place, turn) for place, turn in sides))
    return (
        floor,
        Face("x", 1, (-half, 0.0, level)),
        Face("x", -1, (half, 0.0, level)),
        Face("y", 1, (aside, -half, level)),
        Face("y", -1, (aside, half, level)),
    )


def render_segment(case: PileCase, segment: Segment) -> Deck:
    """Render the deck of a segment."""
    run = case.run
    recording = Recording(
        steps=segment.end,
        sample_every=run.steps_per_frame,
        bridge_every=run.steps_per_frame,
        status_every=-(-run.steps_per_cycle // _STATUS_LINES_PER_CYCLE),
        bead_columns=BEAD_COLUMNS,
        begin=segment.begin,
        pair_bridge_columns=PAIR_COLUMNS,
        wall_bridge_columns=WALL_COLUMNS,
    )
    return compose(
        Plan(
            case,
            place_pile(case),
            recording,
            ranks=run.ranks,
            checkpoint=Checkpoint(write=RESTART_NAME, read=PREVIOUS_RESTART_NAME if segment.begin else None),
            fastest=_fastest(case),
            drive_from=segment.drive_from,
            skin=_SKIN,
            title="A wet bidisperse pile in a shaken container",
            print_rms_velocity=True,
        )
    )


def _fastest(case: PileCase) -> float:
    """Twenty times the container's peak velocity, plus a fall through the box, plus what a bridge's pull gives, m/s."""
    liquid, small = case.liquid, min(case.beads.small + case.beads.large)
    mass = 4.0 / 3.0 * pi * small**3 * case.beads.density
    volume = bridge_volume_at_wall(small, liquid.volume_fraction)
    pull = capillary_force_at_wall(liquid.surface_tension, small, volume, liquid.contact_angle)
    reach = rupture_distance(volume, liquid.contact_angle)
    fall = sqrt(2.0 * case.gravity * 2.0 * case.container.height)
    return 20.0 * case.drive.peak_velocity + fall + sqrt(2.0 * pull * reach / mass)


def settling_steps(case: PileCase) -> int:
    """Steps of a segment in which the pile settles."""
    frame = case.run.steps_per_frame
    return max(1, round(SETTLING_SECONDS / case.run.time_step / frame)) * frame


def render_first_segment(case: PileCase) -> Deck:
    """The deck that a run begins with: the beads fall and settle."""
    return render_segment(case, Segment(0, settling_steps(case), None))


@lru_cache(maxsize=4)
def place_pile(case: PileCase) -> Scene:
    """Beads on a loose lattice, the sizes shuffled and the places jittered by the case's seed, to fall and settle.

    Carriers come first: for each MPI rank one a face, under the floor of its part of the box.
    """
    faces, ranks = faces_of(case), case.run.ranks
    half = case.container.width / 2.0
    largest = max(case.beads.large + case.beads.small)
    edge, below = half + 2e-4, 4.0 * largest
    lower: Point = (-edge, -edge, -(len(faces) + 2) * below)
    # Climbers may rise above the rim: the walls go on, and no bead is lost there before it has fallen off for long.
    upper: Point = (edge, edge, 2.0 * case.container.height)
    width = (upper[0] - lower[0]) / ranks
    carriers = tuple(
        (lower[0] + (rank + 0.5) * width, 0.0, -(number + 1.5) * below)
        for rank in range(ranks)
        for number in range(len(faces))
    )
    places = _places(case, largest)
    beads = tuple(Bead(len(carriers) + 1 + number, place, radius) for number, (place, radius) in enumerate(places))
    return Scene(beads, faces, carriers, lower, upper)


def _places(case: PileCase, largest: float) -> list[tuple[Point, float]]:
    """Centre and radius of each bead."""
    if case.beads.placed:
        return [((x, y, z), radius) for x, y, z, radius in case.beads.placed]
    from numpy.random import default_rng

    draw = default_rng(case.seed)
    radii = [float(radius) for radius in draw.permutation(case.beads.radii)]
    grid, _ = lattice(case.beads, case.container)
    pitch = lattice_pitch(case.container, largest)
    places: list[tuple[Point, float]] = []
    for number, radius in enumerate(radii):
        layer, place = divmod(number, len(grid))
        x, y = grid[place]
        # Within its cell; in a cylinder less, for its wall cuts cells.
        free = pitch / 2.0 - radius if case.container.shape == "box" else LOOSE * largest - radius
        shift = draw.uniform(-1.0, 1.0, 2) * 0.9 * free / (1.0 if case.container.shape == "box" else 2.0)
        height = (layer + 0.5) * 2.0 * LOOSE * largest
        places.append(((x + float(shift[0]), y + float(shift[1]), height), radius))
    return places
