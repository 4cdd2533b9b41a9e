"""From the tables of bodies to bodies, and the checks that they fit into the boundary and beside each other."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from math import dist, pi
from typing import Literal

from walkers.inputs.arrangements import ARRANGEMENTS, gap_between
from walkers.inputs.bodies import Mixture, Standing, Walkers
from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.inputs.errors import unusable
from walkers.inputs.library import suggestion
from walkers.inputs.loads import contact_loads, reach
from walkers.inputs.origins import Notes
from walkers.inputs.schema import MOST_BEADS, BoundaryTable, CaseFile, ClusterTable, DimersTable, MixtureTable
from walkers.inputs.units import LENGTH

_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the count that fills a height."""
_OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_WAYS: dict[str, Literal["both", "right", "left"]] = {
    **{"both": "both", "right": "right", "left": "left"},
    **{"up": "right", "down": "left"},
}
"""What ``facing`` says; up and down are a climber's words."""


def walkers_of(key: str, table: DimersTable | ClusterTable, boundary: BoundaryTable, notes: Notes) -> Walkers:
    """The walkers of a table, which stands under a key."""
    if table.facing in ("up", "down") and (not boundary.tilt or boundary.uphill):
        told = "on a plane that is tilted along the drive alone walkers face up or down"
        raise unusable(f"{key}.facing", f'expected "both", "right" or "left": {told}')
    if table.gap is None:
        notes.derived(f"{key}.gap", "auto", "where the forces at rest balance")
    walkers = Walkers(
        radii=_radii(table, notes) if isinstance(table, DimersTable) else tuple(table.radii),
        replicates=table.replicates,
        facing=_WAYS[table.facing],
        angle=table.angle,
        angle_spread=table.angle_spread,
        gap=table.gap,
        gap_spread=table.gap_spread,
        spacing=table.spacing or 0.0,
        meet=table.meet,
    )
    if isinstance(table, DimersTable):
        return walkers
    if (table.arrangement is None) == (table.at is None):
        told = f"expected either an arrangement ({', '.join(ARRANGEMENTS)}) or places (at)"
        raise unusable(f"{key}.arrangement", told)
    if table.arrangement is not None:
        return _arranged(walkers, key, table.arrangement)
    return _at_places(walkers, key, tuple(table.at or ()))


def _radii(table: DimersTable, notes: Notes) -> tuple[float, float]:
    given = {name: getattr(table, name) for name in ("mean_radius", "sin_delta") if getattr(table, name) is not None}
    if table.radii is not None:
        if given:
            told = "expected either the radii or mean_radius and sin_delta, not both"
            raise unusable(f"dimers.{next(iter(given))}", told)
        return table.radii
    if table.mean_radius is None or table.sin_delta is None:
        examples = {"mean_radius": '"0.25 mm"', "sin_delta": "0.2"} if given else {"radii": '["0.3 mm", "0.2 mm"]'}
        lacking = next(name for name in examples if name not in given)
        raise unusable(f"dimers.{lacking}", f"missing; expected such as {examples[lacking]}")
    first, second = (float(f"{table.mean_radius * share:.15g}") for share in (1 + table.sin_delta, 1 - table.sin_delta))
    notes.derived("dimers.radii", (first, second), "from mean_radius and sin_delta", LENGTH)
    return first, second


def _arranged(walkers: Walkers, key: str, name: str) -> Walkers:
    """A cluster in an arrangement."""
    known = ARRANGEMENTS.get(name)
    if known is None:
        told = f"expected one of {', '.join(ARRANGEMENTS)}{suggestion(name, ARRANGEMENTS)}"
        raise unusable(f"{key}.arrangement", told)
    key = f"{key}.radii"
    if not known.fewest <= len(walkers.radii) <= known.most:
        bound = f"at least {known.fewest}" if known.fewest < known.most else str(known.most)
        raise unusable(key, f"expected {bound} beads in a {name}")
    walkers = replace(walkers, arrangement=name)
    try:
        overlapping = _overlap(walkers)
    except ValueError as error:
        raise unusable(key, str(error)) from error
    if overlapping:
        raise unusable(key, f"beads {overlapping[0] + 1} and {overlapping[1] + 1} would overlap in a {name}")
    return walkers


def _at_places(walkers: Walkers, key: str, places: tuple[tuple[float, float], ...]) -> Walkers:
    """A cluster whose beads are given places: they touch, do not overlap, and have a heading."""
    key, everyone = f"{key}.at", set(range(len(walkers.radii)))
    if len(places) != len(everyone):
        raise unusable(key, f"expected a place for each of the {len(everyone)} beads")
    walkers = replace(walkers, arrangement="given", places=places)
    if overlapping := _overlap(walkers):
        raise unusable(f"{key}[{overlapping[1]}]", f"overlaps with {key}[{overlapping[0]}]")
    if not any(walkers.front):
        raise unusable(key, "expected some beads ahead of others: this has no heading")
    joined = {0}
    for _ in everyone:
        joined |= {bead for pair in walkers.pairs if joined & {*pair} for bead in pair}
    if alone := everyone - joined:
        raise unusable(f"{key}[{min(alone)}]", "expected beads that touch: nothing joins this one to the first")
    return walkers


def _overlap(walkers: Walkers) -> tuple[int, int] | None:
    """Two beads of a walker that overlap by more than a share of their radii, if there are any."""
    radii, places = walkers.radii, walkers.design
    for other in range(len(radii)):
        for one in range(other):
            if gap_between(places, radii, one, other) < -_OVERLAP * min(radii[one], radii[other]):
                return one, other
    return None


def mixture_of(table: MixtureTable, boundary: Boundary) -> Mixture:
    """A mixture, its numbers of beads from shares, count or height."""
    small, large = (_sizes(key, getattr(table, key), table.sizes) for key in ("small", "large"))
    if max(small) >= min(large):
        raise unusable("mixture.large", "expected radii above those of the small beads")
    if (table.count is None) == (table.fill_height is None):
        raise unusable("mixture.count", "expected either a count or a fill_height")
    if not boundary.closed:
        raise unusable("boundary.shape", 'expected "box" or "cylinder": a mixture is poured into it')
    volumes = [sum(4.0 / 3.0 * pi * radius**3 for radius in sizes) / len(sizes) for sizes in (small, large)]
    share = table.small_share
    if table.mixed_by != "number":  # one density: by mass is by volume
        by_number = [share / volumes[0], (1.0 - share) / volumes[1]]
        share = by_number[0] / sum(by_number)
    count = table.count
    if count is None:
        mean = share * volumes[0] + (1.0 - share) * volumes[1]
        count = round(_PACKING * boundary.cross_section * (table.fill_height or 0.0) / mean)
        if not 1 <= count <= MOST_BEADS:
            raise unusable("mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
    few = round(count * share)
    return Mixture(small, large, (few, count - few))


def _sizes(key: str, bounds: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = bounds
    if low > high:
        raise unusable(f"mixture.{key}", "expected the smaller radius first")
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


def spaced(case: Case, key: str, walkers: Walkers, notes: Notes) -> Walkers:
    """Settle the spacing of the walkers under a key and refuse starts in which beads overlap."""
    gap = walkers.gap
    if gap is not None and gap > 0.0:
        raise unusable(f"{key}.gap", "expected zero or less: a bridge forms on contact, beads apart have none")
    overlaps = contact_loads(case, walkers).overlaps if gap is None else (-gap,)
    if max(overlaps) * (1.0 + walkers.gap_spread) > 0.02 * min(walkers.radii):
        blamed = f"{key}.gap" if gap is not None else "contact.youngs_modulus"
        raise unusable(blamed, "the beads overlap by more than 2 % of the smallest radius")
    if not walkers.spacing:
        spacing = 2.0 * (walkers.length if walkers.meet else reach(case))
        notes.derived(f"{key}.spacing", spacing, "so that walkers do not meet", LENGTH)
        return replace(walkers, spacing=spacing)
    # Beads of different walkers may touch, but not overlap, if they are meant to meet.
    least = (1.0 if walkers.meet else 1.5) * walkers.length
    if walkers.spacing < least and sum(one.replicates for one in case.walkers) > 1:
        told = f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"'
        raise unusable(f"{key}.spacing", told)
    return walkers


def check_bodies(case: Case, file: CaseFile) -> None:
    """Refuse bodies for which there is no room within the boundary or beside each other."""
    boundary, mixture = case.boundary, case.mixture
    if case.run.ranks > 1 and not boundary.closed:
        raise unusable("run.ranks", "expected 1: walkers on a plane are slower on several")
    if not case.walkers and mixture is None and "seed" in file.run.model_fields_set:
        raise unusable("run.seed", "expected none where the beads are placed: every start would be the same")
    if mixture is not None:
        _check_pour(mixture, boundary, case.tops_of_others(mixture))
    if case.placed is not None or (case.walkers and not boundary.bare):
        _check_places(case, [key for key, table in file.walkers.items() for _ in range(table.replicates)])


def _check_pour(mixture: Mixture, boundary: Boundary, floor: float) -> None:
    largest = max(mixture.large)
    if boundary.inner_width < 4.0 * largest:
        raise unusable("boundary.width", "expected at least two of the large beads side by side")
    if boundary.layer(largest).tight and boundary.inner_width < 8.0 * largest:
        raise unusable("boundary.width", "expected at least four of the large beads across a cylinder")
    level = floor + mixture.level(boundary)
    if level > 2.0 * boundary.top:  # walls and simulation go on to there
        needed = f"{level / 2.0 * 1e3:.3g} mm"
        raise unusable("boundary.height", f"too low for {mixture.count} beads; expected {needed} or more")


def _check_places(case: Case, keys: list[str]) -> None:
    """Walkers (each with its table's key) and beads that are placed: between the walls, and not within each other."""
    boundary = case.boundary
    standing: list[Standing] = []
    try:
        standing.extend(one for _, one in islice(case.standing(), len(keys)))
    except ValueError as error:
        raise unusable(f"{keys[len(standing)]}.radii", str(error)) from error
    if boundary.inner_width < 2.0 * (1.0 - _OVERLAP) * max((max(one.radii) for one in case.walkers), default=0.0):
        raise unusable("boundary.width", "expected more than a bead's diameter")
    grid = boundary.grid(len(keys), max(one.spacing for one in case.walkers)) if keys else []
    of_walkers = zip(keys, grid, standing, strict=True)
    beads = [
        (key, (x + one.x, y + one.y, one.z), one.radius) for key, (x, y), walker in of_walkers for one in walker.beads
    ]
    placed = case.placed.beads if case.placed is not None else ()
    walking = len(beads)
    beads += [(f"placed[{number}]", (x, y, z), radius) for number, (x, y, z, radius) in enumerate(placed)]
    for number, (key, (x, y, z), radius) in enumerate(beads):
        least = (1.0 - _OVERLAP) * radius
        beside = boundary.side_clearance(x, y, z) < least
        if number < walking and beside:
            told = f"so many walkers, or such, do not fit between the walls of the {boundary.shape}"
            raise unusable(f"{key}.replicates", told)
        if number < walking and z + radius > boundary.top:
            raise unusable("boundary.height", f"too low for the walkers of {key}")
        if number >= walking and (beside or z < least or z + radius > boundary.top):
            raise unusable(f"{key}.at", "expected a bead within the boundary")
    if not placed:
        return
    from scipy.spatial import cKDTree

    near = cKDTree([place for _, place, _ in beads]).query_pairs(2.0 * max(radius for *_, radius in beads))
    for one, other in sorted((pair for pair in near if pair[1] >= walking), key=lambda pair: pair[::-1]):
        (key, place, first), (other_key, other_place, second) = beads[one], beads[other]
        if dist(place, other_place) < first + second - _OVERLAP * min(first, second):
            raise unusable(f"{other_key}.at", f"overlaps with {key if one >= walking else f'one of {key}'}")
