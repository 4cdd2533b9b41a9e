"""From the tables of bodies to bodies, and the checks that they fit into the boundary and beside each other."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from math import dist, pi
from typing import Literal

from walkers.inputs.arrangements import ARRANGEMENTS, gap_between
from walkers.inputs.bodies import Mixture, Placed, Standing, Walkers
from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.library import suggestion
from walkers.inputs.loads import contact_loads, reach
from walkers.inputs.schema import MOST_BEADS, CaseFile, ClusterTable, DimersTable, MixtureTable, WalkersTable

_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the count that fills a height."""
_OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_WAYS: dict[str, Literal["both", "right", "left"]] = {
    **{"both": "both", "right": "right", "left": "left"},
    **{"up": "right", "down": "left"},
}
"""What ``facing`` says; up and down are a climber's words."""


def walkers_of(file: CaseFile) -> tuple[Walkers, ...]:
    """The walkers of a file: its dimers, then its clusters."""
    made = [_made(file, "dimers", file.dimers, _radii(file.dimers))] if file.dimers else []
    for number, table in enumerate(file.clusters):
        key = f"clusters[{number}]"
        made.append(_arranged(table, key, _made(file, key, table, tuple(table.radii))))
    return tuple(made)


def _made(file: CaseFile, key: str, table: WalkersTable, radii: tuple[float, ...]) -> Walkers:
    if table.facing in ("up", "down") and (not file.boundary.tilt or file.boundary.uphill):
        told = "on a plane that is tilted along the drive alone walkers face up or down"
        raise UnusableKeyError(f"{key}.facing", f'expected "both", "right" or "left": {told}')
    return Walkers(
        radii=radii,
        replicates=table.replicates,
        facing=_WAYS[table.facing],
        angle=table.angle,
        angle_spread=table.angle_spread,
        gap=table.gap,
        gap_spread=table.gap_spread,
        spacing=table.spacing or 0.0,
        meet=table.meet,
    )


def _radii(table: DimersTable) -> tuple[float, float]:
    if table.radii is not None:
        other = "mean_radius" if table.mean_radius is not None else "sin_delta"
        if table.mean_radius is not None or table.sin_delta is not None:
            raise UnusableKeyError(
                f"dimers.{other}", "expected either the radii or mean_radius and sin_delta, not both"
            )
        return table.radii
    if table.mean_radius is None and table.sin_delta is None:
        raise UnusableKeyError("dimers.radii", 'missing; expected such as ["0.3 mm", "0.2 mm"]')
    if table.mean_radius is None or table.sin_delta is None:
        lacking, example = ("mean_radius", '"0.25 mm"') if table.mean_radius is None else ("sin_delta", "0.2")
        raise UnusableKeyError(f"dimers.{lacking}", f"missing; expected such as {example}")
    first, second = (float(f"{table.mean_radius * share:.15g}") for share in (1 + table.sin_delta, 1 - table.sin_delta))
    return first, second


def _arranged(table: ClusterTable, key: str, walkers: Walkers) -> Walkers:
    """A cluster in its arrangement, or at its places."""
    if (table.arrangement is None) == (table.at is None):
        told = f"expected either an arrangement ({', '.join(ARRANGEMENTS)}) or places (at)"
        raise UnusableKeyError(f"{key}.arrangement", told)
    if table.at is not None:
        return _at_places(table.at, key, walkers)
    name = table.arrangement or ""
    known = ARRANGEMENTS.get(name)
    if known is None:
        told = f"expected one of {', '.join(ARRANGEMENTS)}{suggestion(name, ARRANGEMENTS)}"
        raise UnusableKeyError(f"{key}.arrangement", told)
    if not known.fewest <= len(walkers.radii) <= known.most:
        bound = f"at least {known.fewest}" if known.fewest < known.most else str(known.most)
        raise UnusableKeyError(f"{key}.radii", f"expected {bound} beads in a {name}")
    walkers = replace(walkers, arrangement=name)
    try:
        overlap = _overlap(walkers)
    except ValueError as error:
        raise UnusableKeyError(f"{key}.radii", str(error)) from error
    if overlap is not None:
        told = f"beads {overlap[0] + 1} and {overlap[1] + 1} would overlap in a {name}"
        raise UnusableKeyError(f"{key}.radii", told)
    return walkers


def _at_places(places: list[tuple[float, float]], key: str, walkers: Walkers) -> Walkers:
    """A cluster whose beads are given places: they touch, do not overlap, and have a heading."""
    if len(places) != len(walkers.radii):
        raise UnusableKeyError(f"{key}.at", f"expected a place for each of the {len(walkers.radii)} beads")
    walkers = replace(walkers, arrangement="given", places=tuple(places))
    if (overlap := _overlap(walkers)) is not None:
        raise UnusableKeyError(f"{key}.at[{overlap[1]}]", f"overlaps with {key}.at[{overlap[0]}]")
    if not any(walkers.front):
        raise UnusableKeyError(f"{key}.at", "expected some beads ahead of others: this has no heading")
    joined = {0}
    for _ in walkers.radii:
        joined |= {bead for pair in walkers.pairs if joined & {*pair} for bead in pair}
    if len(joined) < len(walkers.radii):
        alone = min({*range(len(walkers.radii))} - joined)
        raise UnusableKeyError(f"{key}.at[{alone}]", "expected beads that touch: nothing joins this one to the first")
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
    small, large = _sizes("small", table.small, table.sizes), _sizes("large", table.large, table.sizes)
    if max(small) >= min(large):
        raise UnusableKeyError("mixture.large", "expected radii above those of the small beads")
    if (table.count is None) == (table.fill_height is None):
        raise UnusableKeyError("mixture.count", "expected either a count or a fill_height")
    if not boundary.closed:
        raise UnusableKeyError("boundary.shape", 'expected "box" or "cylinder": a mixture is poured into it')
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
            raise UnusableKeyError("mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
    few = round(count * share)
    return Mixture(small, large, (few, count - few))


def _sizes(key: str, bounds: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = bounds
    if low > high:
        raise UnusableKeyError(f"mixture.{key}", "expected the smaller radius first")
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


def check_bodies(case: Case, file: CaseFile) -> None:
    """Room for all bodies within the boundary, and no overlaps."""
    boundary, ranks = case.boundary, case.run.ranks
    if ranks > 1 and not boundary.closed:
        raise UnusableKeyError("run.ranks", "expected 1: walkers on a plane are slower on several")
    if case.placed is not None and case.mixture is None and "seed" in file.run.model_fields_set and not case.walkers:
        raise UnusableKeyError("run.seed", "expected none where the beads are placed: every start would be the same")
    if case.mixture is not None:
        _check_pour(case.mixture, boundary, case.tops_of_others(case.mixture))
    if case.placed is not None:
        _check_places(case.placed, boundary)
    if case.walkers and (not boundary.bare or case.placed is not None):
        _check_walkers(case, file)


def _check_walkers(case: Case, file: CaseFile) -> None:
    """Walkers between the walls and beside the beads that are placed."""
    keys = [key for number, one in enumerate(case.walkers) for key in [_key_of(file, number)] * one.replicates]
    grid = case.boundary.grid(len(keys), max(walkers.spacing for walkers in case.walkers))
    standing: list[Standing] = []
    try:
        standing.extend(one for _, one in islice(case.standing(), len(keys)))
    except ValueError as error:
        raise UnusableKeyError(f"{keys[len(standing)]}.radii", str(error)) from error
    largest = max(radius for walkers in case.walkers for radius in walkers.radii)
    if case.boundary.inner_width / 2.0 < (1.0 - _OVERLAP) * largest:
        raise UnusableKeyError("boundary.width", "expected more than a bead's diameter")
    others = case.placed.beads if case.placed is not None else ()
    for key, (x, y), walker in zip(keys, grid, standing, strict=True):
        for bead in walker.beads:
            if case.boundary.side_clearance(x + bead.x, y + bead.y, bead.z) < (1.0 - _OVERLAP) * bead.radius:
                told = f"so many walkers, or such, do not fit between the walls of the {case.boundary.shape}"
                raise UnusableKeyError(f"{key}.replicates", told)
            if bead.z + bead.radius > case.boundary.top:
                raise UnusableKeyError("boundary.height", f"too low for the walkers of {key}")
            for number, (*there, size) in enumerate(others):
                if dist((x + bead.x, y + bead.y, bead.z), there) < (1.0 - _OVERLAP) * (bead.radius + size):
                    raise UnusableKeyError(f"placed[{number}].at", f"overlaps with one of {key}")


def _check_pour(mixture: Mixture, boundary: Boundary, floor: float) -> None:
    largest = max(mixture.large)
    if boundary.side_clearance(0.0, 0.0) < 2.0 * largest:
        raise UnusableKeyError("boundary.width", "expected at least two of the large beads side by side")
    if boundary.layer(largest).tight and boundary.side_clearance(0.0, 0.0) < 4.0 * largest:
        raise UnusableKeyError("boundary.width", "expected at least four of the large beads across a cylinder")
    level = floor + mixture.level(boundary)
    if level > 2.0 * boundary.top:  # walls and simulation go on to there
        needed = f"{level / 2.0 * 1e3:.3g} mm"
        raise UnusableKeyError("boundary.height", f"too low for {mixture.count} beads; expected {needed} or more")


def _check_places(placed: Placed, boundary: Boundary) -> None:
    """Beads within the boundary that do not overlap by more than a hundredth of a radius."""
    for number, (x, y, z, radius) in enumerate(placed.beads):
        slack = _OVERLAP * radius
        if boundary.side_clearance(x, y, z) < radius - slack or z < radius - slack or z + radius > boundary.top:
            raise UnusableKeyError(f"placed[{number}].at", "expected a bead within the boundary")
        for other in range(number):
            *there, size = placed.beads[other]
            if dist((x, y, z), there) < radius + size - _OVERLAP * min(radius, size):
                raise UnusableKeyError(f"placed[{number}].at", f"overlaps with placed[{other}]")


def _key_of(file: CaseFile, number: int) -> str:
    """Key of the table of a case's walkers."""
    dimers = file.dimers is not None
    return "dimers" if dimers and number == 0 else f"clusters[{number - dimers}]"


def spaced(case: Case, number: int, file: CaseFile) -> Walkers:
    """Settle the spacing of walkers and refuse starts in which beads overlap."""
    walkers, key = case.walkers[number], _key_of(file, number)
    smallest, gap = min(walkers.radii), walkers.gap
    if gap is not None and gap > 0.0:
        raise UnusableKeyError(f"{key}.gap", "expected zero or less: a bridge forms on contact, beads apart have none")
    overlaps = contact_loads(case, walkers).overlaps if gap is None else (-gap,)
    if max(overlaps) * (1.0 + walkers.gap_spread) > 0.02 * smallest:
        blamed = f"{key}.gap" if gap is not None else "contact.youngs_modulus"
        raise UnusableKeyError(blamed, "the beads overlap by more than 2 % of the smallest radius")
    many = sum(one.replicates for one in case.walkers) > 1
    # Beads of different walkers may touch, but not overlap, if they are meant to meet.
    least = (1.0 if walkers.meet else 1.5) * walkers.length
    if walkers.spacing and many and walkers.spacing < least:
        raise UnusableKeyError(
            f"{key}.spacing",
            f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"',
        )
    if walkers.spacing:
        return walkers
    return replace(walkers, spacing=2.0 * walkers.length if walkers.meet else 2.0 * reach(case))
