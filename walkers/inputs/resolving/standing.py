"""Where the beads of a case start, and whether they fit into the boundary and beside each other.

How the beads of one walker stand beside each other is the subject of
`walkers.inputs.tables.arrangements`; the deck chooses the places of walkers on the substrate
(`walkers.templates.placement`). *Loose beads* belong to no walker: they are poured as a mixture, or
placed one by one.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, ceil, cos, dist, inf, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.random import default_rng

from walkers.errors import key_error
from walkers.inputs.resolving.loads import contact_loads
from walkers.inputs.resolving.ranks import check_ranks
from walkers.inputs.tables.bodies import Mixture, Walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.shape import Layer
from walkers.inputs.tables.shapes.walls import FLOOR

OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_MOST_DISTANCES = 10_000_000
"""Largest number of beads times walls of a vessel: each bead takes 32 bytes for each wall."""


class StartingBead(NamedTuple):
    """Centre (m) and radius (m) of a bead at the start."""

    x: float
    y: float
    z: float
    radius: float


class StartingGroup(NamedTuple):
    """Beads that start together: a walker, or a group of loose beads.

    Attributes
    ----------
    beads
        The beads. Positions of a walker are relative to its place on the substrate, which the deck
        chooses, those of loose beads to the boundary.
    facing
        +1 for a walker that faces along the drive axis, −1 for one that faces against it, 0 for
        loose beads.
    angle
        Angle between the heading of a walker and this direction, rad; 0 for loose beads.
    """

    beads: tuple[StartingBead, ...]
    facing: int = 0
    angle: float = 0.0


def starting_groups(case: Case) -> Iterator[tuple[int, StartingGroup]]:
    """Walkers and groups of loose beads at the start.

    Yields
    ------
    number : int
        Number of the body in `Case.bodies`; the number after the last one for placed beads.
    group : StartingGroup
        The walkers come first, each alone, then the mixture, then the placed beads.

    Raises
    ------
    InputError
        If the beads of a walker cannot stand on the boundary, as in a groove.
    """
    keys = list(case.walkers_by_key)
    walkers_before = 0
    for number, body in enumerate(case.bodies):
        if not isinstance(body, Walkers):
            yield number, _poured(case, body)
            continue
        try:
            for walker in _walkers_at_start(case, body, walkers_before):
                yield number, walker
        except ValueError as error:  # in a groove
            raise key_error(f"{keys[number]}.radii", str(error)) from error
        walkers_before += body.replicates
    if case.placed:
        placed = tuple(StartingBead(*bead.at, bead.radius) for bead in case.placed)
        yield len(case.bodies), StartingGroup(placed)


def _walkers_at_start(case: Case, walkers: Walkers, walkers_before: int) -> Iterator[StartingGroup]:
    """The walkers of a kind; ``walkers_before`` is the number of walkers of the kinds before it."""
    overlaps_at_rest = [load.overlap for load in contact_loads(case, walkers)]
    for number in range(walkers_before, walkers_before + walkers.replicates):
        yield _walker_at_start(case, walkers, number, overlaps_at_rest)


def _walker_at_start(
    case: Case, walkers: Walkers, number: int, overlaps_at_rest: Sequence[float]
) -> StartingGroup:
    """A walker of a kind around the contact of its first two beads.

    Its angle and the overlaps of its contacts are drawn from a random stream of its own, so that
    they do not depend on the rest of a shared deck.

    Parameters
    ----------
    case
        The case.
    walkers
        The kind.
    number
        Number of the walker among all walkers of the case.
    overlaps_at_rest
        Overlaps of its contacts at rest, m: those of its beads with the substrate, then those of
        its pairs of beads.
    """
    facing = _facing(case, walkers, number)
    turn, press = _draws(case.run.seed, number)
    angle = walkers.angle + walkers.angle_spread * turn
    factor = 1.0 + walkers.gap_spread * press
    overlaps = [overlap * factor for overlap in overlaps_at_rest]
    shape = case.boundary.geometry
    heights = []
    for radius, overlap in zip(walkers.radii, overlaps, strict=False):  # with the substrate alone
        heights.append(shape.rest_height(radius - overlap))
    drive_x, drive_y, _ = case.drive_axis
    heading = atan2(drive_y, drive_x) + angle + (0.0 if facing > 0 else pi)
    heading_x = cos(heading)
    heading_y = sin(heading)
    places = walkers.places(heights, overlaps)
    beads = []
    for (ahead, left), height, radius in zip(places, heights, walkers.radii, strict=True):
        x = ahead * heading_x - left * heading_y
        y = ahead * heading_y + left * heading_x
        beads.append(StartingBead(x, y, height, radius))
    return StartingGroup(tuple(beads), facing, angle)


def _facing(case: Case, walkers: Walkers, number: int) -> int:
    """Whether a walker faces along the drive axis (+1) or against it (−1), by its number."""
    if walkers.facing == "right":
        return 1
    if walkers.facing == "left":
        return -1
    row = number // case.shifted_rows if case.shifted_rows else 0
    return 1 if (number + row) % 2 == 0 else -1


@lru_cache(maxsize=4096)
def _draws(seed: int, number: int) -> tuple[float, float]:
    """Two random numbers of a walker, from −1 to 1: for its angle, and for its overlaps."""
    turn, press = default_rng([seed, number]).uniform(-1.0, 1.0, size=2)
    return float(turn), float(press)


def _poured(case: Case, mixture: Mixture) -> StartingGroup:
    """The beads of a mixture on a loose lattice above the other bodies; they fall and settle.

    Their order and their displacements from the places of the lattice are random (seed of the
    case).
    """
    largest = max(mixture.radii)
    draw = default_rng(case.run.seed)
    floor = _top_of_others(case)
    radii = [float(radius) for radius in draw.permutation(mixture.all_radii)]
    places = _lattice_places(case.boundary.geometry.layers(largest, floor))
    beads = []
    for radius, (layer, x, y) in zip(radii, places, strict=False):  # there are more places
        # Less than the play: beads do not touch each other or a wall.
        shift = draw.uniform(-1.0, 1.0, 2) * 0.9 * layer.play(radius, largest)
        beads.append(
            StartingBead(x + float(shift[0]), y + float(shift[1]), floor + layer.level, radius)
        )
    return StartingGroup(tuple(beads))


def _lattice_places(layers: Iterable[Layer]) -> Iterator[tuple[Layer, float, float]]:
    """All places of layers, each with its layer and its x and y, m."""
    for layer in layers:
        for x, y in layer.places:
            yield layer, x, y


def _top_of_others(case: Case) -> float:
    """Largest height at the start of the bodies beside a mixture, m; 0 without any."""
    tops = [2.0 * max(walkers.radii) for walkers in case.walkers]
    tops += [bead.at[2] + bead.radius for bead in case.placed]
    return max(tops, default=0.0)


def check_bodies(case: Case) -> None:
    """Check that the bodies of a case fit into the boundary and beside each other.

    Raises
    ------
    InputError
        If they do not, if a vessel has too many walls or no floor for walkers, or if the number of
        processes, the seed or the exchange of liquid does not suit the bodies.
    """
    if case.boundary.shape == "vessel":
        _check_vessel(case)
    check_ranks(case)
    _check_seed(case)
    _check_conserved_liquid(case)
    mixture = case.mixture
    if mixture is not None:
        shape = case.boundary.geometry
        shape.check_pour(mixture.count, max(mixture.radii), _top_of_others(case))
    may_overlap = bool(case.placed) or case.meets
    if may_overlap or (case.walkers and not case.boundary.is_open_floor):
        beads = _beads_at_start(case)
        _check_walls(case, beads)
        if may_overlap:
            _check_overlaps(beads)


def _check_seed(case: Case) -> None:
    """Refuse a seed without anything that is drawn."""
    drawn = bool(case.walkers) or case.mixture is not None
    if not drawn and "seed" in case.document.get("run", {}):
        raise key_error(
            "run.seed", "expected none with placed beads: every start would be the same"
        )


def _check_conserved_liquid(case: Case) -> None:
    """Refuse bridges that share a constant amount of liquid where they do not."""
    if not case.liquid.conserved:
        return
    if case.liquid.meniscus_radius is not None:
        message = "menisci of one radius exchange liquid through a film"
        raise key_error("liquid.conserved", f"expected false: {message}")
    if case.walkers or not case.boundary.closed:
        message = "only loose beads in a container share their liquid"
        raise key_error("liquid.conserved", f"expected false: {message}")


def _check_vessel(case: Case) -> None:
    """Refuse a vessel of too many walls for the beads, or without a floor for walkers."""
    walls = case.boundary.walls
    key = "boundary.mesh" if case.boundary.mesh else "boundary.planes"
    if len(walls) * case.count > _MOST_DISTANCES:
        most = f"at most {_MOST_DISTANCES // case.count} for {case.count} beads: a coarser mesh"
        raise key_error(key, f"has {len(walls)} faces, edges and corners; expected {most}")
    if case.walkers and walls[0].name != FLOOR:
        message = "has no level floor at its bottom, on which walkers stand"
        raise key_error(key, f"{message}; expected [[placed]] beads")


@dataclass(frozen=True)
class _BeadAtStart:
    """A bead at its start, relative to the boundary.

    Attributes
    ----------
    key
        Key of the table of the bead, or of its kind of walkers.
    place
        Its centre, m.
    radius
        Its radius, m.
    walker
        Number of its walker; None for a placed bead.
    """

    key: str
    place: tuple[float, float, float]
    radius: float
    walker: int | None = None

    @property
    def top(self) -> float:
        """Height of its highest point, m."""
        return self.place[2] + self.radius


def _beads_at_start(case: Case) -> list[_BeadAtStart]:
    """The beads of walkers, then those that are placed; not those of a mixture."""
    beads: list[_BeadAtStart] = []
    keys: list[str] = []
    for key, walkers in case.walkers_by_key.items():
        keys += [key] * walkers.replicates
    if keys:
        spacing = max(walkers.spacing for walkers in case.walkers)
        grid = case.boundary.geometry.grid(len(keys), spacing)
        groups = starting_groups(case)  # the walkers come first
        for number, (key, (x, y)) in enumerate(zip(keys, grid, strict=True)):
            _, walker = next(groups)
            for bead in walker.beads:
                place = (x + bead.x, y + bead.y, bead.z)
                beads.append(_BeadAtStart(key, place, bead.radius, number))
    for number, placed in enumerate(case.placed):
        beads.append(_BeadAtStart(f"placed[{number}]", placed.at, placed.radius))
    return beads


def _cut_by_walls(case: Case, beads: Sequence[_BeadAtStart]) -> list[_BeadAtStart]:
    """The beads that overlap with side walls by more than `OVERLAP`.

    If there are walkers, also the beads that are not above the floor of a vessel.
    """
    places = np.array([bead.place for bead in beads])
    clearances = case.boundary.geometry.side_clearance(places)
    if case.walkers:
        above_floor = np.isfinite(case.boundary.walls[0].distances(places))
        clearances = np.where(above_floor, clearances, -1.0)
    cut = []
    for bead, clearance in zip(beads, clearances, strict=True):
        if clearance < (1.0 - OVERLAP) * bead.radius:
            cut.append(bead)
    return cut


def _check_walls(case: Case, beads: Sequence[_BeadAtStart]) -> None:
    """Refuse beads that stand in or behind the walls, or higher than they are."""
    _check_width(case)
    cut = _cut_by_walls(case, beads)
    if cut and cut[0].walker is not None:
        key = cut[0].key
        replicates = case.walkers_by_key[key].replicates  # may be a default, which no file quotes
        raise key_error(f"{key}.replicates", _expected_number(case, key), replicates)
    top = case.boundary.height or inf
    high = [bead for bead in beads if bead.top > top]
    high_walkers = [bead for bead in high if bead.walker is not None]
    if high_walkers:
        highest = max(high_walkers, key=lambda bead: bead.top)
        sufficient = ceil(1e6 * highest.top) / 1e3  # mm, rounded up to whole micrometres
        message = f"too low for the walkers of {highest.key}"
        raise key_error("boundary.height", f"{message}; expected at least {sufficient:g} mm")
    placed = [bead for bead in beads if bead.walker is None]
    low = [bead for bead in placed if bead.place[2] < (1.0 - OVERLAP) * bead.radius]
    outside = [*cut, *high, *low]
    if outside:
        raise key_error(f"{outside[0].key}.at", "expected a bead within the boundary")


def _check_width(case: Case) -> None:
    """Refuse a boundary that is narrower than the largest bead of the walkers."""
    width = case.boundary.width
    largest = max((max(walkers.radii) for walkers in case.walkers), default=0.0)
    if width is not None and width < 2.0 * (1.0 - OVERLAP) * largest:
        diameter = f"{2e3 * largest:.4g} mm"
        raise key_error("boundary.width", f"expected more than a bead's diameter, {diameter}")


def _expected_number(case: Case, key: str) -> str:
    """A message with the number of walkers of a kind that fit between the walls."""

    def too_many(number: int) -> bool:
        fewer = case.with_value_at(f"{key}.replicates", number)
        cut = _cut_by_walls(fewer, _beads_at_start(fewer))
        return any(bead.walker is not None for bead in cut)

    walkers = case.walkers_by_key[key]
    most = bisect_left(range(1, walkers.replicates), True, key=too_many)
    spacing = f"{1e3 * walkers.spacing:.3g} mm"
    problem = f"the walkers, {spacing} apart, do not fit between the walls"
    expected = "a wider boundary"
    if most == 1:
        expected = f"1, a smaller {key}.spacing or {expected}"
    elif most > 1:
        expected = f"at most {most}, a smaller {key}.spacing or {expected}"
    return f"{problem} of the {case.boundary.shape}; expected {expected}"


def _check_overlaps(beads: Sequence[_BeadAtStart]) -> None:
    """Refuse placed beads, and beads of different walkers, that overlap."""
    from scipy.spatial import cKDTree

    largest = max(bead.radius for bead in beads)
    near_pairs = cKDTree([bead.place for bead in beads]).query_pairs(2.0 * largest)
    for first_number, second_number in sorted(near_pairs, key=lambda pair: pair[::-1]):
        first = beads[first_number]
        second = beads[second_number]
        if first.walker is not None and first.walker == second.walker:
            continue
        distance = dist(first.place, second.place)
        at_contact = first.radius + second.radius
        if distance >= at_contact - OVERLAP * min(first.radius, second.radius):
            continue
        if second.walker is not None:
            message = overlap_message("one of another walker", distance, at_contact)
            raise key_error(f"{second.key}.spacing", f"at their start angles, a bead {message}")
        neighbour = first.key if first.walker is None else f"one of {first.key}"
        raise key_error(f"{second.key}.at", overlap_message(neighbour, distance, at_contact))


def overlap_message(neighbour: str, distance: float, at_contact: float) -> str:
    """A message about a bead that overlaps with a neighbour.

    Parameters
    ----------
    neighbour
        The other bead in words.
    distance
        Distance of the centres, m.
    at_contact
        Distance of the centres at which the beads would touch, m.
    """
    overlap = f"{1e3 * (at_contact - distance):.3g} mm"
    expected = f"expected their centres {1e3 * at_contact:.4g} mm apart, where they touch"
    return f"overlaps with {neighbour} by {overlap}; {expected}"
