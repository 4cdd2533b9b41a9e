"""Bodies of a case with all values: radii, directions, spacings, and numbers of poured beads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import dist
from typing import NamedTuple

from walkers.errors import expected_of, key_error
from walkers.inputs.config_table import present
from walkers.inputs.resolving.length import cycles_of, samples_of
from walkers.inputs.resolving.loads import contact_loads, room_of_paths
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.resolving.standing import OVERLAP, overlap_message
from walkers.inputs.tables.arrangements import ARRANGEMENTS, BareWalker, WalkerGeometry, touching
from walkers.inputs.tables.bodies import (
    MOST_BEADS,
    Cluster,
    ClusterTable,
    Dimers,
    DimersTable,
    Mixture,
    MixtureTable,
    PlacedBead,
    PlacedBeadTable,
    Walkers,
    middles_of,
    share_and_volume,
)
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.tables.drive import Excitation

_PACKING = 0.55  # packing fraction of a settled wet pile, for the count that fills a height
_FACING = {"up": "right", "down": "left"}  # the words for climbers


class WalkerDraft(NamedTuple):
    """Walkers of one make as the file says them, with the geometry that follows from it."""

    table: DimersTable | ClusterTable
    geometry: BareWalker


class MixtureDraft(NamedTuple):
    """A mixture as the file says it, with the ranges of the radii of its beads, m."""

    table: MixtureTable
    small: tuple[float, float]
    large: tuple[float, float]

    @property
    def small_radii(self) -> tuple[float, ...]:
        """The radii of the small beads, m."""
        return middles_of(self.small, self.table.sizes)

    @property
    def large_radii(self) -> tuple[float, ...]:
        """The radii of the large beads, m."""
        return middles_of(self.large, self.table.sizes)


def walker_drafts(file: CaseFile, notes: Notes) -> dict[str, WalkerDraft]:
    """The walkers of a file by their keys, dimers first, with their radii."""
    drafts: dict[str, WalkerDraft] = {}
    if file.dimers is not None:
        radii = _radii_of_dimers(file.dimers, notes)
        geometry = BareWalker(radii, Dimers.arrangement, Dimers.at)
        drafts["dimers"] = WalkerDraft(file.dimers, geometry)
    for number, cluster in enumerate(file.clusters):
        key = f"clusters[{number}]"
        radii = _radii(cluster.radii, cluster.diameters, f"{key}.radii", notes)
        drafts[key] = WalkerDraft(cluster, BareWalker(radii, cluster.arrangement, cluster.at))
    return drafts


def _radii_of_dimers(dimers: DimersTable, notes: Notes) -> tuple[float, ...]:
    """The radii of dimers, m, by their radii, diameters, or mean radius and asymmetry."""
    if dimers.mean_radius is None or dimers.sin_delta is None:
        return _radii(dimers.radii, dimers.diameters, "dimers.radii", notes)
    notes.add("dimers.radii", "from mean_radius and sin_delta")
    first = float(f"{dimers.mean_radius * (1.0 + dimers.sin_delta):.15g}")
    second = float(f"{dimers.mean_radius * (1.0 - dimers.sin_delta):.15g}")
    return first, second


def _radii(
    radii: Sequence[float] | None, diameters: Sequence[float] | None, key: str, notes: Notes
) -> tuple[float, ...]:
    """Radii that a table gives, or half of its diameters, m."""
    if diameters is None:
        return tuple(present(radii, key))
    notes.add(key, "from the diameters")
    return tuple(diameter / 2.0 for diameter in diameters)


def mixture_draft(table: MixtureTable, notes: Notes) -> MixtureDraft:
    """A mixture with the ranges of its radii."""
    small, small_end = _radii(table.small, table.small_diameters, "mixture.small", notes)
    large, large_end = _radii(table.large, table.large_diameters, "mixture.large", notes)
    return MixtureDraft(table, (small, small_end), (large, large_end))


def placed_bead(table: PlacedBeadTable) -> PlacedBead:
    """A placed bead with its radius."""
    radius = table.radius if table.diameter is None else table.diameter / 2.0
    return table.completed(PlacedBead, {"radius": radius})


def mixture_of(draft: MixtureDraft, boundary: Boundary, notes: Notes) -> Mixture:
    """Complete a mixture by its number of beads.

    Raises
    ------
    InputError
        If its small beads are not the smaller ones, its boundary is no container, or a given height
        takes no beads, or too many.
    """
    table = draft.table
    if max(draft.small_radii) >= min(draft.large_radii):
        raise key_error("mixture.large", "expected radii above those of the small beads")
    if not boundary.closed:
        raise key_error(
            "boundary.shape", 'expected a container, such as "box": a mixture is poured into it'
        )
    count = table.count
    if count is None:
        bed = boundary.geometry.volume(present(table.fill_height, "mixture.fill_height"))
        _, volume_of_bead = share_and_volume(table, draft.small_radii, draft.large_radii)
        count = round(_PACKING * bed / volume_of_bead)
        if not 1 <= count <= MOST_BEADS:
            raise key_error(
                "mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}"
            )
        notes.add("mixture.count", "from the fill_height")
    return table.completed(Mixture, {"small": draft.small, "large": draft.large, "count": count})


def walkers_of(draft: WalkerDraft, facing: str, automatic: float) -> Dimers | Cluster:
    """Walkers with all values.

    Parameters
    ----------
    draft
        The walkers with their radii.
    facing
        Their direction along the drive axis: ``right``, ``left`` or ``both``.
    automatic
        Spacing at which walkers do not meet, m, for those whose file gives none.
    """
    table, geometry = draft
    spacing = table.spacing
    if spacing is None:
        spacing = 2.0 * geometry.length if table.meet else automatic
    values = {"radii": geometry.radii, "facing": facing, "spacing": spacing}
    if isinstance(table, DimersTable):
        return table.completed(Dimers, values)
    return table.completed(Cluster, values)


def facing_of(draft: WalkerDraft, key: str, boundary: Boundary) -> str:
    """The direction of walkers along the drive axis; impossible arrangements are refused."""
    facing: str = draft.table.facing
    if facing in _FACING:
        if not boundary.tilt or boundary.uphill:
            message = "on a plane that is tilted along the drive alone walkers face up or down"
            raise key_error(f"{key}.facing", f'expected "both", "right" or "left": {message}')
        facing = _FACING[facing]
    if isinstance(draft.table, ClusterTable):
        if draft.geometry.at:
            _check_places(draft.geometry, f"{key}.at")
        else:
            _check_arrangement(draft.geometry, key)
    return facing


def _check_arrangement(cluster: WalkerGeometry, key: str) -> None:
    name, arrangement = cluster.arrangement, ARRANGEMENTS.get(cluster.arrangement)
    if arrangement is None:
        raise key_error(f"{key}.arrangement", expected_of(name, ARRANGEMENTS))
    key = f"{key}.radii"
    if not arrangement.fewest <= len(cluster.radii) <= arrangement.most:
        least = f"at least {arrangement.fewest}"
        bound = least if arrangement.fewest < arrangement.most else str(arrangement.most)
        raise key_error(key, f"expected {bound} beads in a {name}")
    try:
        overlapping = touching(cluster.design, cluster.radii, -OVERLAP)
    except ValueError as error:
        raise key_error(key, str(error)) from error
    if overlapping:
        first, second = (bead + 1 for bead in overlapping[0])
        raise key_error(
            key, f"beads {first} and {second} would overlap in a {name}; expected similar radii"
        )


def _check_places(cluster: WalkerGeometry, key: str) -> None:
    """Beads that are given places touch, do not overlap, and have a heading."""
    everyone, places = set(range(len(cluster.radii))), cluster.at
    if len(places) != len(everyone):
        raise key_error(key, f"expected a place for each of the {len(everyone)} beads")
    if overlapping := touching(places, cluster.radii, -OVERLAP):
        first, second = overlapping[0]
        distances = dist(places[first], places[second]), cluster.rigid_distance(first, second)
        raise key_error(f"{key}[{second}]", overlap_message(f"{key}[{first}]", *distances))
    if not any(cluster.front):
        raise key_error(key, "expected some beads ahead of others: this walker has no heading")
    joined = {0}
    for _ in everyone:
        joined |= {bead for pair in cluster.pairs if joined & {*pair} for bead in pair}
    if alone := everyone - joined:
        raise key_error(
            f"{key}[{min(alone)}]",
            "expected beads that touch: this bead is not connected to the first",
        )


def automatic_spacing(
    file: CaseFile,
    drive: Excitation,
    drafts: Mapping[str, WalkerDraft],
) -> float:
    """Spacing at which walkers of a case do not meet during its run, m."""
    loose = file.mixture is not None or bool(file.placed)
    _, cycles_per_sample = samples_of(file.run, drive, loose=loose)
    duration = cycles_of(file.run, drive, cycles_per_sample) / drive.frequency
    longest = max((draft.geometry.length for draft in drafts.values()), default=0.0)
    return 2.0 * room_of_paths(drive.peak_velocity, duration, longest)


def check_walkers_at_rest(case: Case, file: CaseFile, notes: Notes) -> None:
    """Refuse starts in which beads overlap, and note spacings that the file does not give."""
    given = {"dimers": None if file.dimers is None else file.dimers.spacing}
    for number, cluster in enumerate(file.clusters):
        given[f"clusters[{number}]"] = cluster.spacing
    for key, walkers in case.walkers_by_key.items():
        _check_held(case, walkers)
        overlap = max(load.overlap for load in contact_loads(case, walkers))
        if overlap * (1.0 + walkers.gap_spread) > 0.02 * min(walkers.radii):
            message = "expected a larger one: at rest the beads overlap by more than 2 % of the smallest radius"
            raise key_error("contact.youngs_modulus", message)
        if given[key] is None:
            avoided = "touch at the start" if walkers.meet else "meet"
            notes.add(f"{key}.spacing", f"so that walkers do not {avoided}")
            continue
        # Beads of different walkers may touch, but not overlap, if they are meant to meet.
        least = (1.0 if walkers.meet else 1.5) * walkers.length
        if walkers.spacing < least and sum(make.replicates for make in case.walkers) > 1:
            message = f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"'
            raise key_error(f"{key}.spacing", message)


def _check_held(case: Case, walkers: Walkers) -> None:
    """Refuse walkers that would not stay in contact at rest, because bridges push by more than weights press."""
    names = [f"bead {bead} and the boundary" for bead in range(1, len(walkers.radii) + 1)]
    names += [f"beads {first + 1} and {second + 1}" for first, second in walkers.pairs]
    for name, load in zip(names, contact_loads(case, walkers), strict=True):
        if load.pull < 0.0 == load.overlap:  # no overlap: the load is tensile
            angle = case.liquid.contact_angle
            key, remedy = (
                ("contact_angle", "a smaller angle or less liquid")
                if angle
                else ("law", "a law that pulls")
            )
            pushed = f"at rest, the bridge pushes {name} apart ({-1e6 * load.pull:.3g} uN)"
            raise key_error(f"liquid.{key}", f"expected {remedy}: {pushed}")
