"""Where the beads of a deck begin: its walkers on a grid, all else where the case has it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from walkers.inputs.boundary import Span
from walkers.inputs.case import Case
from walkers.inputs.loads import hop_height, reach
from walkers.templates.layout import PlacedWalker
from walkers.templates.scene import Bead, Scene
from walkers.templates.sharing import loading_of, loadings_of, surface_of, surfaces_of


@lru_cache(maxsize=4)  # the segments of a run begin with the same scene
def place(cases: tuple[Case, ...]) -> tuple[Scene, tuple[PlacedWalker, ...]]:
    """Place the bodies of cases that share a deck, and size the box so that no walker can leave it unnoticed.

    Each walker draws its start from its own random stream (seed, number of the walker in its case), so that walker k is
    the same whoever shares the deck.
    """
    standing = [(case, make, one) for case in cases for make, one in case.standing()]
    walking = sum(one.walks for _, _, one in standing)
    spacing = max((walkers.spacing for case in cases for walkers in case.walkers), default=0.0)
    boundary = cases[0].boundary
    grid = boundary.grid(walking, spacing) if walking else []
    surfaces, loadings = surfaces_of(cases), loadings_of(cases)
    walkers: list[PlacedWalker] = []
    beads: list[Bead] = []
    for case, make, one in standing:
        origin = grid[len(walkers)] if one.walks else (0.0, 0.0)
        first = 1 + len(beads)
        surface, loading = 1 + surfaces.index(surface_of(case)), loadings.index(loading_of(case))
        for number, bead in enumerate(one.beads, first):
            centre = (origin[0] + bead.x, origin[1] + bead.y, bead.z)
            beads.append(Bead(number, centre, bead.radius, surface=surface, loading=loading))
        if one.walks:
            ids = tuple(range(first, first + len(one.beads)))
            walkers.append(PlacedWalker(len(walkers), make, ids, one.facing, one.angle, origin))
    return Scene(tuple(beads), boundary.walls, *boundary.room(_span(cases, grid, spacing))), tuple(walkers)


def _span(cases: Sequence[Case], grid: Sequence[tuple[float, float]], spacing: float) -> Span:
    far = max(spacing / 2.0, *(reach(case) for case in cases))
    largest = max(max(case.radii) for case in cases)
    amplitude = max(case.drive.amplitude for case in cases)
    placed = [bead for case in cases if case.placed is not None for bead in case.placed.beads]
    return Span(
        half_x=max([x for x, _ in grid] + [abs(x) for x, *_ in placed], default=0.0) + far,
        half_y=max([y for _, y in grid] + [abs(y) for _, y, *_ in placed], default=0.0) + far,
        height=10.0 * largest
        + max([z for _, _, z, _ in placed], default=0.0)
        + max(hop_height(case) for case in cases)
        + 2.0 * amplitude,
        margin=4.0 * largest + 2.0 * amplitude,
        largest=largest,
    )
