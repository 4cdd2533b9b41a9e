"""Where the beads of a case start, and whether they fit into the boundary and beside each other."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from functools import lru_cache
from math import atan2, ceil, cos, dist, inf, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.random import default_rng

from walkers.errors import key_error
from walkers.inputs.resolving.loads import contact_loads
from walkers.inputs.tables.bodies import Mixture, Walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import FLOOR

OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_MOST_PARTS = 10_000_000  # of beads and walls: each bead has 32 bytes for each wall


class StandingBead(NamedTuple):
    """Centre (m) and radius (m) of a bead at the start."""

    x: float
    y: float
    z: float
    radius: float


class Standing(NamedTuple):
    """Beads that start together; positions relative to the walker's place (chosen by the deck) or to the boundary.

    ``facing`` is +1 along the drive axis or −1, and ``angle`` (rad) is measured from there; both are 0 for loose beads.
    """

    beads: tuple[StandingBead, ...]
    facing: int = 0
    angle: float = 0.0


def standing(case: Case) -> Iterator[tuple[int, Standing]]:
    """Walkers and groups of loose beads at the start, each with the number of its body; walkers come first."""
    first, keys = 0, [*case.walkers_by_key]
    for number, body in enumerate(case.bodies):
        if isinstance(body, Walkers):
            try:
                yield from ((number, walker) for walker in _walkers(case, body, first))
            except ValueError as error:  # in a groove
                raise key_error(f"{keys[number]}.radii", str(error)) from error
            first += body.replicates
        else:
            yield number, _poured(case, body)
    if case.placed:
        yield (
            len(case.bodies),
            Standing(tuple(StandingBead(*bead.at, bead.radius) for bead in case.placed)),
        )


def _walkers(case: Case, walkers: Walkers, first: int) -> Iterator[Standing]:
    """Each walker around the contact of its first two beads; ``first``: index of the first walker.

    Its angle and contacts are drawn from a stream of its own, independent of the rest of a shared deck.
    """
    x, y, _ = case.drive_axis
    resting = [load.overlap for load in contact_loads(case, walkers)]
    for number in range(first, first + walkers.replicates):
        row = number // case.shifted_rows if case.shifted_rows else 0
        facing = {"right": 1, "left": -1}.get(walkers.facing, 1 if (number + row) % 2 == 0 else -1)
        turn, press = _draws(case.run.seed, number)
        angle, factor = (
            walkers.angle + walkers.angle_spread * turn,
            1.0 + walkers.gap_spread * press,
        )
        overlaps = [overlap * factor for overlap in resting]
        heading = atan2(y, x) + angle + (0.0 if facing > 0 else pi)
        pressed = zip(
            walkers.radii, overlaps, strict=False
        )  # the first overlaps are those with the floor
        heights = [
            case.boundary.geometry.rest_height(radius - overlap) for radius, overlap in pressed
        ]
        ahead, left = cos(heading), sin(heading)
        beads = [
            StandingBead(along * ahead - aside * left, along * left + aside * ahead, *rest)
            for (along, aside), *rest in zip(
                walkers.places(heights, overlaps), heights, walkers.radii, strict=True
            )
        ]
        yield Standing(tuple(beads), facing, angle)


@lru_cache(maxsize=4096)
def _draws(seed: int, number: int) -> tuple[float, float]:
    turn, press = default_rng([seed, number]).uniform(-1.0, 1.0, size=2)
    return float(turn), float(press)


def _poured(case: Case, mixture: Mixture) -> Standing:
    """Beads on a loose lattice with random order and displacements (seed of the case); they fall and settle."""
    largest, draw = max(mixture.radii), default_rng(case.run.seed)
    floor, beads = _top_of_others(case), []
    places = (
        (layer, x, y)
        for layer in case.boundary.geometry.layers(largest, floor)
        for x, y in layer.places
    )
    radii = [float(size) for size in draw.permutation(mixture.all_radii)]
    for radius, (layer, x, y) in zip(
        radii, places, strict=False
    ):  # there are more places than beads
        shift = draw.uniform(-1.0, 1.0, 2) * 0.9 * layer.play(radius, largest)
        beads.append(
            StandingBead(x + float(shift[0]), y + float(shift[1]), floor + layer.level, radius)
        )
    return Standing(tuple(beads))


def _top_of_others(case: Case) -> float:
    """Largest height at the start of the bodies beside a mixture, m."""
    walking = [2.0 * max(walkers.radii) for walkers in case.walkers]
    return max([*walking, *(bead.at[2] + bead.radius for bead in case.placed)], default=0.0)


def check_bodies(case: Case) -> None:
    """Refuse bodies that do not fit into the boundary or beside each other."""
    boundary, mixture = case.boundary, case.mixture
    if boundary.shape == "vessel":
        _check_vessel(case)
    if case.run.ranks > 1 and not boundary.closed:
        raise key_error(
            "run.ranks", "expected 1: walkers on a plane run slower on several processes"
        )
    if not case.walkers and mixture is None and "seed" in case.document.get("run", {}):
        raise key_error(
            "run.seed", "expected none with placed beads: every start would be the same"
        )
    if case.liquid.conserved and case.liquid.meniscus_radius is not None:
        raise key_error(
            "liquid.conserved",
            "expected false: menisci of one radius exchange liquid through a film",
        )
    if case.liquid.conserved and (case.walkers or not boundary.closed):
        raise key_error(
            "liquid.conserved", "expected false: only loose beads in a container share their liquid"
        )
    if mixture is not None:
        boundary.geometry.check_pour(mixture.count, max(mixture.radii), _top_of_others(case))
    if case.placed or case.meets or (case.walkers and not boundary.bare):
        beads = _held(case)
        _check_walls(case, beads)
        if case.placed or case.meets:
            _check_overlaps(beads)


def _check_vessel(case: Case) -> None:
    """Refuse a vessel of too many faces for the beads, or without a floor for walkers."""
    boundary = case.boundary
    blamed = "boundary.mesh" if boundary.mesh else "boundary.planes"
    if (walls := len(boundary.walls)) * case.count > _MOST_PARTS:
        most = f"at most {_MOST_PARTS // case.count} for {case.count} beads: a coarser mesh"
        raise key_error(blamed, f"has {walls} faces, edges and corners; expected {most}")
    if case.walkers and boundary.walls[0].name != FLOOR:
        raise key_error(
            blamed,
            "has no level floor at its bottom, on which walkers stand; expected [[placed]] beads",
        )


class _Held(NamedTuple):
    """A bead at its start, the key that is to blame for it, and the number of its walker, -1 of a placed bead."""

    key: str
    place: tuple[float, float, float]
    radius: float
    walker: int = -1


def _held(case: Case) -> list[_Held]:
    """The beads of walkers, then those that are placed."""
    keys = [key for key, walkers in case.walkers_by_key.items() for _ in range(walkers.replicates)]
    grid = (
        case.boundary.geometry.grid(len(keys), max(walkers.spacing for walkers in case.walkers))
        if keys
        else []
    )
    beads: list[_Held] = []
    for number, (key, (x, y), (_, walker)) in enumerate(
        zip(keys, grid, standing(case), strict=False)
    ):
        beads += [
            _Held(key, (x + bead.x, y + bead.y, bead.z), bead.radius, number)
            for bead in walker.beads
        ]
    return beads + [
        _Held(f"placed[{number}]", bead.at, bead.radius) for number, bead in enumerate(case.placed)
    ]


def _cut_by_walls(case: Case, beads: list[_Held]) -> list[_Held]:
    """The beads that side walls cut, and those of walkers that stand beside the floor of a vessel."""
    places = np.array([bead.place for bead in beads])
    clearances = case.boundary.geometry.side_clearance(places)
    if case.walkers:
        clearances = np.where(
            np.isfinite(case.boundary.walls[0].distances(places)), clearances, -1.0
        )
    return [
        bead
        for bead, clear in zip(beads, clearances, strict=True)
        if clear < (1.0 - OVERLAP) * bead.radius
    ]


def _check_walls(case: Case, beads: list[_Held]) -> None:
    boundary, top = case.boundary, case.boundary.height or inf
    largest = max((max(walkers.radii) for walkers in case.walkers), default=0.0)
    if boundary.width is not None and boundary.width < 2.0 * (1.0 - OVERLAP) * largest:
        raise key_error(
            "boundary.width", f"expected more than a bead's diameter, {2e3 * largest:.4g} mm"
        )
    cut = _cut_by_walls(case, beads)
    if cut and cut[0].walker >= 0:
        number = case.walkers_by_key[
            cut[0].key
        ].replicates  # also a default, which no document quotes
        raise key_error(f"{cut[0].key}.replicates", _expected_number(case, cut[0].key), number)
    high = [bead for bead in beads if bead.place[2] + bead.radius > top]
    if walking := [bead for bead in high if bead.walker >= 0]:
        highest = max(walking, key=lambda bead: bead.place[2] + bead.radius)
        least = (
            f"{ceil(1e6 * (highest.place[2] + highest.radius)) / 1e3:g} mm"  # a number that will do
        )
        raise key_error(
            "boundary.height",
            f"too low for the walkers of {highest.key}; expected at least {least}",
        )
    low = [
        bead for bead in beads if bead.walker < 0 and bead.place[2] < (1.0 - OVERLAP) * bead.radius
    ]
    if out := [*cut, *high, *low]:
        raise key_error(f"{out[0].key}.at", "expected a bead within the boundary")


def _expected_number(case: Case, key: str) -> str:
    """How many walkers of a make fit between the walls beside the others."""

    def too_many(number: int) -> bool:
        fewer = case.with_value_at(f"{key}.replicates", number)
        return any(bead.walker >= 0 for bead in _cut_by_walls(fewer, _held(fewer)))

    walkers = case.walkers_by_key[key]
    most = bisect_left(range(1, walkers.replicates), True, key=too_many)
    fewer = f"{'at most ' * (most > 1)}{most}, a smaller {key}.spacing or "
    apart = f"the walkers, {1e3 * walkers.spacing:.3g} mm apart, do not fit between the walls"
    return f"{apart} of the {case.boundary.shape}; expected {fewer if most else ''}a wider boundary"


def _check_overlaps(beads: list[_Held]) -> None:
    from scipy.spatial import cKDTree

    near = cKDTree([bead.place for bead in beads]).query_pairs(
        2.0 * max(bead.radius for bead in beads)
    )
    strangers = (
        pair
        for pair in near
        if beads[pair[0]].walker != beads[pair[1]].walker or beads[pair[0]].walker < 0
    )
    for pair in sorted(strangers, key=lambda pair: pair[::-1]):
        first, second = (beads[number] for number in pair)
        apart, touching = dist(first.place, second.place), first.radius + second.radius
        if apart < touching - OVERLAP * min(first.radius, second.radius):
            if second.walker >= 0:
                message = f"at their start angles, a bead {overlaps('one of another walker', apart, touching)}"
                raise key_error(f"{second.key}.spacing", message)
            whom = first.key if first.walker < 0 else f"one of {first.key}"
            raise key_error(f"{second.key}.at", overlaps(whom, apart, touching))


def overlaps(whom: str, apart: float, touching: float) -> str:
    """A message about a bead at a distance (m) from another, which it touches at a larger distance (m)."""
    by, expected = (
        f"{1e3 * (touching - apart):.3g} mm",
        f"expected their centres {1e3 * touching:.4g} mm apart",
    )
    return f"overlaps with {whom} by {by}; {expected}, where they touch"
