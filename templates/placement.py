"""Where the walkers of a deck begin: a grid of independent walkers on one substrate, each perturbed a little."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi, sin, sqrt

from inputs.case import WalkerCase
from inputs.dimer import contact_loads, hop_height, horizontal_distance, reach
from templates.layout import PlacedWalker

Point = tuple[float, float, float]


@dataclass(frozen=True)
class PlacedBead:
    """A bead at its start: id, centre and radius in m."""

    id: int
    centre: Point
    radius: float


@dataclass(frozen=True)
class Scene:
    """Walkers, beads, the rider's place and the simulation box (lower and upper corner), all in m."""

    walkers: tuple[PlacedWalker, ...]
    beads: tuple[PlacedBead, ...]
    rider: Point
    lower: Point
    upper: Point


FIRST_BEAD = 2
"""Id of the first bead; the rider is atom 1."""


def place_walkers(case: WalkerCase) -> Scene:
    """Place a case's replicates and size the simulation box so that none can leave it unnoticed.

    Replicates alternate between facing right and left where the case says both. Each draws its start angle and the
    gap of its contacts from its own random stream (seed, number of the walker), so that walker k is the same whether
    it shares the deck or not.
    """
    start = case.start
    columns = ceil(sqrt(start.replicates))
    rows = ceil(start.replicates / columns)
    walkers: list[PlacedWalker] = []
    beads: list[PlacedBead] = []
    for number in range(start.replicates):
        row, column = divmod(number, columns)
        origin = ((row - (rows - 1) / 2.0) * start.spacing, (column - (columns - 1) / 2.0) * start.spacing)
        walker, pair = _place(case, number, origin)
        walkers.append(walker)
        beads += pair
    far = reach(case)
    half_x = (rows - 1) / 2.0 * start.spacing + far
    half_y = (columns - 1) / 2.0 * start.spacing + far
    largest = max(case.beads.radii)
    margin = 4.0 * largest + 2.0 * case.drive.amplitude
    height = 10.0 * largest + hop_height(case) + 2.0 * case.drive.amplitude
    return Scene(
        walkers=tuple(walkers),
        beads=tuple(beads),
        # In the corner, beyond the walkers' reach and above it.
        rider=(half_x + margin, half_y + margin, height + margin),
        lower=(-half_x - 2.0 * margin, -half_y - 2.0 * margin, -margin),
        upper=(half_x + 2.0 * margin, half_y + 2.0 * margin, height + 2.0 * margin),
    )


def axis_vector(axis: str) -> Point:
    """Unit vector of a drive axis."""
    return (float(axis == "x"), float(axis == "y"), float(axis == "z"))


def _facing(case: WalkerCase, number: int) -> int:
    if case.start.facing == "both":
        return 1 if number % 2 == 0 else -1
    return 1 if case.start.facing == "right" else -1


def _perturbation(case: WalkerCase, number: int) -> tuple[float, float]:
    """Start angle (rad) and the factor on the equilibrium overlap of one walker."""
    from numpy.random import default_rng

    start = case.start
    turn, press = default_rng([start.seed, number]).uniform(-1.0, 1.0, size=2)
    return start.angle + start.angle_spread * float(turn), 1.0 + start.gap_spread * float(press)


def _place(
    case: WalkerCase, number: int, origin: tuple[float, float]
) -> tuple[PlacedWalker, tuple[PlacedBead, PlacedBead]]:
    radii, facing = case.beads.radii, _facing(case, number)
    angle, factor = _perturbation(case, number)
    at_rest = contact_loads(case).overlaps if case.start.gap is None else (-case.start.gap,) * 3
    overlaps = (at_rest[0] * factor, at_rest[1] * factor, at_rest[2] * factor)
    distance = horizontal_distance(radii, overlaps)
    heading = (pi / 2.0 if case.drive.axis == "y" else 0.0) + angle + (0.0 if facing > 0 else pi)
    # The point of contact of the two beads lies over the origin.
    lever = distance * radii[0] / sum(radii)
    arms = (lever, lever - distance)
    ids = (FIRST_BEAD + 2 * number, FIRST_BEAD + 2 * number + 1)
    first, second = (
        PlacedBead(
            identifier,
            (origin[0] + arm * cos(heading), origin[1] + arm * sin(heading), radius - overlap),
            radius,
        )
        for identifier, arm, radius, overlap in zip(ids, arms, radii, overlaps[:2], strict=True)
    )
    return PlacedWalker(number, ids, facing, angle, origin), (first, second)
