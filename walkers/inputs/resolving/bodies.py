"""Bodies of a case with all values: radii, directions, spacings, and numbers of poured beads.

Where the beads start is the subject of `walkers.inputs.resolving.standing`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import dist
from typing import NamedTuple

from walkers.errors import expected_of, key_error
from walkers.inputs.config_table import present
from walkers.inputs.resolving.length import cycles_of, samples_of
from walkers.inputs.resolving.loads import contact_loads, longest_path
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
from walkers.rounding import to_fifteen_digits

_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the number of beads that fill a height."""
_FACING_ALONG_DRIVE = {"up": "right", "down": "left"}
"""Directions along the drive axis of walkers that face uphill and downhill."""
_LARGEST_OVERLAP = 0.02
"""Largest overlap of a contact at rest, in radii of the smallest bead."""


class WalkerDraft(NamedTuple):
    """Walkers of one kind as the file says them.

    Attributes
    ----------
    table
        Their table in the case file.
    geometry
        What follows from their radii and their arrangement.
    """

    table: DimersTable | ClusterTable
    geometry: BareWalker


class MixtureDraft(NamedTuple):
    """A mixture as the file says it.

    Attributes
    ----------
    table
        Its table in the case file.
    small, large
        Smallest and largest radius of the small beads, and of the large beads, m.
    """

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
    """The radii of dimers, m, from their radii, diameters, or mean radius and asymmetry.

    The table (`DimersTable.choices`) has refused a mean radius without asymmetry.
    """
    if dimers.mean_radius is None or dimers.sin_delta is None:
        return _radii(dimers.radii, dimers.diameters, "dimers.radii", notes)
    notes.add("dimers.radii", "from mean_radius and sin_delta")
    first = dimers.mean_radius * (1.0 + dimers.sin_delta)
    second = dimers.mean_radius * (1.0 - dimers.sin_delta)
    return to_fifteen_digits(first), to_fifteen_digits(second)


def _radii(
    radii: Sequence[float] | None, diameters: Sequence[float] | None, key: str, notes: Notes
) -> tuple[float, ...]:
    """The radii that a table gives, or half of its diameters, m; ``key`` is that of the radii."""
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
    radius = table.radius
    if table.diameter is not None:
        radius = table.diameter / 2.0
    return table.completed(PlacedBead, {"radius": radius})


def mixture_of(draft: MixtureDraft, boundary: Boundary, notes: Notes) -> Mixture:
    """Complete a mixture by its number of beads.

    Parameters
    ----------
    draft
        The mixture as the file says it.
    boundary
        The container into which it is poured.
    notes
        Get the source of the number of beads if it follows from a height.

    Raises
    ------
    InputError
        If its small beads are not the smaller ones, if its boundary is no container, or if a given
        height takes no beads, or too many.
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
        Spacing at which walkers do not meet, m. It holds if the file gives none, unless the walkers
        are meant to meet: their spacing is then twice their length.
    """
    table = draft.table
    spacing = table.spacing
    if spacing is None and table.meet:
        spacing = 2.0 * draft.geometry.length
    elif spacing is None:
        spacing = automatic
    values = {"radii": draft.geometry.radii, "facing": facing, "spacing": spacing}
    if isinstance(table, DimersTable):
        return table.completed(Dimers, values)
    return table.completed(Cluster, values)


def facing_of(draft: WalkerDraft, key: str, boundary: Boundary) -> str:
    """The direction of walkers along the drive axis: ``right``, ``left`` or ``both``.

    Parameters
    ----------
    draft
        The walkers with their radii.
    key
        Key of their table.
    boundary
        The boundary on which they stand.

    Raises
    ------
    InputError
        If walkers face up or down on a plane that is not tilted along the drive, or if the beads of
        a cluster cannot be arranged as the file says.
    """
    facing: str = draft.table.facing
    if facing in _FACING_ALONG_DRIVE:
        if not boundary.tilt or boundary.uphill:
            message = "on a plane that is tilted along the drive alone walkers face up or down"
            raise key_error(f"{key}.facing", f'expected "both", "right" or "left": {message}')
        facing = _FACING_ALONG_DRIVE[facing]
    if isinstance(draft.table, ClusterTable):
        if draft.geometry.at:
            _check_places(draft.geometry, f"{key}.at")
        else:
            _check_arrangement(draft.geometry, key)
    return facing


def _check_arrangement(cluster: WalkerGeometry, key: str) -> None:
    """Refuse an unknown arrangement, and beads that do not fit it; ``key`` of the cluster."""
    name = cluster.arrangement
    arrangement = ARRANGEMENTS.get(name)
    if arrangement is None:
        raise key_error(f"{key}.arrangement", expected_of(name, ARRANGEMENTS))
    if not arrangement.fewest <= len(cluster.radii) <= arrangement.most:
        number = f"at least {arrangement.fewest}"
        if arrangement.fewest == arrangement.most:
            number = str(arrangement.most)
        raise key_error(f"{key}.radii", f"expected {number} beads in a {name}")
    try:
        overlapping = touching(cluster.design, cluster.radii, -OVERLAP)
    except ValueError as error:
        raise key_error(f"{key}.radii", str(error)) from error
    if overlapping:
        first, second = overlapping[0]
        beads = f"beads {first + 1} and {second + 1} would overlap in a {name}"
        raise key_error(f"{key}.radii", f"{beads}; expected similar radii")


def _check_places(cluster: WalkerGeometry, key: str) -> None:
    """Refuse given places of beads that overlap or do not touch, or that have no heading.

    ``key`` is that of the places.
    """
    places = cluster.at
    count = len(cluster.radii)
    if len(places) != count:
        raise key_error(key, f"expected a place for each of the {count} beads")
    overlapping = touching(places, cluster.radii, -OVERLAP)
    if overlapping:
        first, second = overlapping[0]
        distance = dist(places[first], places[second])
        message = overlap_message(
            f"{key}[{first}]", distance, cluster.rigid_distance(first, second)
        )
        raise key_error(f"{key}[{second}]", message)
    if not any(cluster.front):
        raise key_error(key, "expected some beads ahead of others: this walker has no heading")
    separate = set(range(count)) - _connected_to_first(cluster)
    if separate:
        message = "expected beads that touch: this bead is not connected to the first"
        raise key_error(f"{key}[{min(separate)}]", message)


def _connected_to_first(cluster: WalkerGeometry) -> set[int]:
    """Numbers of the beads that contacts connect to the first bead, and of the first bead."""
    connected = {0}
    for _ in cluster.radii:  # each round reaches one contact farther
        for pair in cluster.pairs:
            if connected.intersection(pair):
                connected.update(pair)
    return connected


def automatic_spacing(
    file: CaseFile,
    drive: Excitation,
    drafts: Mapping[str, WalkerDraft],
) -> float:
    """Spacing at which walkers of a case do not meet during its run, m.

    Parameters
    ----------
    file
        The case file, with the length of its run.
    drive
        The oscillations of the drive.
    drafts
        The walkers by their keys.
    """
    loose = file.mixture is not None or bool(file.placed)
    _, cycles_per_sample = samples_of(file.run, drive, loose=loose)
    duration = cycles_of(file.run, drive, cycles_per_sample) / drive.frequency
    length = max((draft.geometry.length for draft in drafts.values()), default=0.0)
    return 2.0 * longest_path(drive.peak_velocity, duration, length)


def check_walkers_at_rest(case: Case, file: CaseFile, notes: Notes) -> None:
    """Check the walkers of a case as they start, and note the spacings that the file does not give.

    Parameters
    ----------
    case
        The case with all values.
    file
        The file that it was read from.
    notes
        Get the sources of the spacings.

    Raises
    ------
    InputError
        If contacts at rest overlap too much or are pushed apart, or if neighbouring walkers would
        touch.
    """
    given_spacings = {}
    if file.dimers is not None:
        given_spacings["dimers"] = file.dimers.spacing
    for number, cluster in enumerate(file.clusters):
        given_spacings[f"clusters[{number}]"] = cluster.spacing
    for key, walkers in case.walkers_by_key.items():
        _check_contact_at_rest(case, walkers)
        _check_overlap_at_rest(case, walkers)
        if given_spacings[key] is None:
            avoided = "touch at the start" if walkers.meet else "meet"
            notes.add(f"{key}.spacing", f"so that walkers do not {avoided}")
        else:
            _check_spacing(case, walkers, key)


def _check_contact_at_rest(case: Case, walkers: Walkers) -> None:
    """Refuse walkers whose bridges push beads apart with more than their weight."""
    contacts = [f"bead {bead} and the boundary" for bead in range(1, len(walkers.radii) + 1)]
    contacts += [f"beads {first + 1} and {second + 1}" for first, second in walkers.pairs]
    for contact, load in zip(contacts, contact_loads(case, walkers), strict=True):
        if load.pull >= 0.0 or load.overlap != 0.0:
            continue
        problem = f"at rest, the bridge pushes {contact} apart ({-1e6 * load.pull:.3g} uN)"
        if case.liquid.contact_angle:
            expected = "expected a smaller angle or less liquid"
            raise key_error("liquid.contact_angle", f"{expected}: {problem}")
        raise key_error("liquid.law", f"expected a law that pulls: {problem}")


def _check_overlap_at_rest(case: Case, walkers: Walkers) -> None:
    """Refuse beads so soft that they overlap by a visible part of their radius."""
    overlap = max(load.overlap for load in contact_loads(case, walkers))
    if overlap * (1.0 + walkers.gap_spread) > _LARGEST_OVERLAP * min(walkers.radii):
        problem = "at rest the beads overlap by more than 2 % of the smallest radius"
        raise key_error("contact.youngs_modulus", f"expected a larger one: {problem}")


def _check_spacing(case: Case, walkers: Walkers, key: str) -> None:
    """Refuse a given spacing at which neighbours would touch; ``key`` is that of the walkers.

    Walkers that are meant to meet may touch, but not overlap.
    """
    least = (1.0 if walkers.meet else 1.5) * walkers.length
    count = sum(kind.replicates for kind in case.walkers)
    if walkers.spacing < least and count > 1:
        expected = f'expected at least {1e3 * least:.3g} mm, or "auto"'
        message = f"neighbouring walkers would touch or overlap; {expected}"
        raise key_error(f"{key}.spacing", message)
