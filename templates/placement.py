"""Where the walkers of a deck begin: a grid of independent walkers on one substrate, each perturbed a little."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import atan2, ceil, cos, pi, sin, sqrt

from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import contact_loads, hop_height, horizontal_distance, reach
from walkers.templates.layout import PlacedWalker
from walkers.templates.scene import Bead, Face, Scene
from walkers.templates.sharing import surfaces_of

_FIRST_BEAD = 2  # atom 1 is the carrier of the substrate


def place_walkers(cases: Sequence[WalkerCase]) -> tuple[Scene, tuple[PlacedWalker, ...]]:
    """Place the replicates of cases that share a deck, and size the box so that none can leave it unnoticed.

    Replicates alternate between facing right and left where the case says both. Each draws its start angle and the
    gap of its contacts from its own random stream (seed, number of the walker in its case), so that walker k is the
    same whoever shares the deck.
    """
    placed = [(case, number) for case in cases for number in range(case.start.replicates)]
    surfaces = surfaces_of(cases)
    spacing = max(case.start.spacing for case in cases)
    columns = ceil(sqrt(len(placed)))
    rows = ceil(len(placed) / columns)
    walkers: list[PlacedWalker] = []
    beads: list[Bead] = []
    for place, (case, number) in enumerate(placed):
        row, column = divmod(place, columns)
        origin = ((row - (rows - 1) / 2.0) * spacing, (column - (columns - 1) / 2.0) * spacing)
        walker, pair = _place(case, number, place, origin, surface=1 + surfaces.index(case.contact))
        walkers.append(walker)
        beads += pair
    far = max(spacing / 2.0, *(reach(case) for case in cases))
    half_x = (rows - 1) / 2.0 * spacing + far
    half_y = (columns - 1) / 2.0 * spacing + far
    largest = max(max(case.beads.radii) for case in cases)
    amplitude = cases[0].drive.amplitude
    margin = 4.0 * largest + 2.0 * amplitude
    height = 10.0 * largest + max(hop_height(case) for case in cases) + 2.0 * amplitude
    scene = Scene(
        beads=tuple(beads),
        faces=(Face("z", 1, (0.0, 0.0, 0.0)),),
        # In the corner, beyond the walkers' reach and above it.
        carriers=((half_x + margin, half_y + margin, height + margin),),
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
    start = case.start
    turn, press = _draws(start.seed, number)
    return start.angle + start.angle_spread * turn, 1.0 + start.gap_spread * press


@lru_cache(maxsize=4096)
def _draws(seed: int, number: int) -> tuple[float, float]:
    from numpy.random import default_rng

    turn, press = default_rng([seed, number]).uniform(-1.0, 1.0, size=2)
    return float(turn), float(press)


def _place(
    case: WalkerCase, number: int, place: int, origin: tuple[float, float], *, surface: int
) -> tuple[PlacedWalker, tuple[Bead, Bead]]:
    """Walker ``number`` of its case, at a place of the deck."""
    radii, facing = case.beads.radii, _facing(case, number)
    angle, factor = _perturbation(case, number)
    at_rest = contact_loads(case).overlaps if case.start.gap is None else (-case.start.gap,) * 3
    overlaps = (at_rest[0] * factor, at_rest[1] * factor, at_rest[2] * factor)
    distance = horizontal_distance(radii, overlaps)
    heading = atan2(case.drive_axis[1], case.drive_axis[0]) + angle + (0.0 if facing > 0 else pi)
    # The point of contact of the two beads lies over the origin.
    lever = distance * radii[0] / sum(radii)
    arms = (lever, lever - distance)
    ids = (_FIRST_BEAD + 2 * place, _FIRST_BEAD + 2 * place + 1)
    first, second = (
        Bead(
            identifier,
            (origin[0] + arm * cos(heading), origin[1] + arm * sin(heading), radius - overlap),
            radius,
            surface=surface,
        )
        for identifier, arm, radius, overlap in zip(ids, arms, radii, overlaps[:2], strict=True)
    )
    return PlacedWalker(place, ids, facing, angle, origin), (first, second)
