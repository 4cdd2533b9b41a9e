"""Where the walkers of a deck begin: a grid of independent walkers on one substrate, each perturbed a little."""

from __future__ import annotations

from math import ceil, cos, pi, sin, sqrt

from inputs.case import WalkerCase
from inputs.dimer import contact_loads, hop_height, horizontal_distance, reach
from templates.layout import PlacedWalker
from templates.scene import Bead, Face, Scene

_FIRST_BEAD = 2  # atom 1 is the rider of the substrate


def place_walkers(case: WalkerCase) -> tuple[Scene, tuple[PlacedWalker, ...]]:
    """Place a case's replicates and size the simulation box so that none can leave it unnoticed.

    Replicates alternate between facing right and left where the case says both. Each draws its start angle and the
    gap of its contacts from its own random stream (seed, number of the walker), so that walker k is the same whether
    it shares the deck or not.
    """
    start = case.start
    columns = ceil(sqrt(start.replicates))
    rows = ceil(start.replicates / columns)
    walkers: list[PlacedWalker] = []
    beads: list[Bead] = []
    for number in range(start.replicates):
        row, column = divmod(number, columns)
        origin = ((row - (rows - 1) / 2.0) * start.spacing, (column - (columns - 1) / 2.0) * start.spacing)
        walker, pair = _place(case, number, origin)
        walkers.append(walker)
        beads += pair
    far = max(reach(case), start.spacing / 2.0)
    half_x = (rows - 1) / 2.0 * start.spacing + far
    half_y = (columns - 1) / 2.0 * start.spacing + far
    largest = max(case.beads.radii)
    margin = 4.0 * largest + 2.0 * case.drive.amplitude
    height = 10.0 * largest + hop_height(case) + 2.0 * case.drive.amplitude
    scene = Scene(
        beads=tuple(beads),
        faces=(Face("z", 1, (0.0, 0.0, 0.0)),),
        # In the corner, beyond the walkers' reach and above it.
        riders=((half_x + margin, half_y + margin, height + margin),),
        lower=(-half_x - 2.0 * margin, -half_y - 2.0 * margin, -margin),
        upper=(half_x + 2.0 * margin, half_y + 2.0 * margin, height + 2.0 * margin),
    )
    return scene, tuple(walkers)


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


def _place(case: WalkerCase, number: int, origin: tuple[float, float]) -> tuple[PlacedWalker, tuple[Bead, Bead]]:
    radii, facing = case.beads.radii, _facing(case, number)
    angle, factor = _perturbation(case, number)
    at_rest = contact_loads(case).overlaps if case.start.gap is None else (-case.start.gap,) * 3
    overlaps = (at_rest[0] * factor, at_rest[1] * factor, at_rest[2] * factor)
    distance = horizontal_distance(radii, overlaps)
    heading = (pi / 2.0 if case.drive.axis == "y" else 0.0) + angle + (0.0 if facing > 0 else pi)
    # The point of contact of the two beads lies over the origin.
    lever = distance * radii[0] / sum(radii)
    arms = (lever, lever - distance)
    ids = (_FIRST_BEAD + 2 * number, _FIRST_BEAD + 2 * number + 1)
    first, second = (
        Bead(
            identifier,
            (origin[0] + arm * cos(heading), origin[1] + arm * sin(heading), radius - overlap),
            radius,
        )
        for identifier, arm, radius, overlap in zip(ids, arms, radii, overlaps[:2], strict=True)
    )
    return PlacedWalker(number, ids, facing, angle, origin), (first, second)
