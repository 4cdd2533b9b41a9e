"""Values that follow from others, in the order of the physics: from a file to a case.

`resolve` takes a `CaseFile`, in which values may be missing. It completes the tables of the
bodies, the drive, the liquid and the contacts to a `Setup`, and adds the run, which makes it a
`Case`. Each step notes where its values are from. Checks of the bodies come last. Values of the
library are in the tables already (`walkers.inputs.resolving.from_library`).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, inf
from typing import Any

from walkers.errors import key_error
from walkers.inputs.origins import Source
from walkers.inputs.resolving.bodies import (
    WalkerDraft,
    automatic_spacing,
    check_walkers_at_rest,
    facing_of,
    mixture_draft,
    mixture_of,
    placed_bead,
    walker_drafts,
    walkers_of,
)
from walkers.inputs.resolving.driving import drive_of
from walkers.inputs.resolving.from_library import ROUGHNESS
from walkers.inputs.resolving.length import limits_of, resolved_run
from walkers.inputs.resolving.loads import DELAY_LIMIT, bridge_at_rest, largest_delay
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.resolving.own_vessel import with_vessel
from walkers.inputs.resolving.standing import check_bodies
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case, CaseFile, Setup
from walkers.inputs.tables.materials import Contact, Liquid, LiquidTable
from walkers.inputs.units import LENGTH, parse_quantity
from walkers.physics.capillary import DEFAULT_LAW, bridge_volume
from walkers.physics.dimer import Dimer
from walkers.rounding import to_fifteen_digits

_SOFTEST = 5e7
"""Lowest Young's modulus of ``"auto"``, Pa."""
_HARDEST = 4.0**5 * _SOFTEST
"""Highest Young's modulus of ``"auto"``, 51.2 GPa: four times as much is beyond what a case may
have."""
_LARGEST_ROUGHNESS = 0.01
"""Largest roughness over the radius of the smallest bead. Beyond it, the surfaces are no longer
the smooth spheres that the bridge laws assume."""


def resolve(
    file: CaseFile,
    *,
    name: str,
    document: Mapping[str, Any],
    sources: Mapping[str, Source],
) -> Case:
    """Complete a case by all that its file leaves out.

    Parameters
    ----------
    file
        The tables of the case, with the values of the library.
    name
        Name of the case.
    document
        The tables as they were written, with the contents of the files that they name.
    sources
        Sources of the values of the library.

    Returns
    -------
    Case
        The case with all values, and with the sources of those that the document does not give.

    Raises
    ------
    InputError
        If keys of the case contradict each other, or its bodies do not fit into the boundary.
    """
    notes = Notes(sources)
    setup = _setup(file, document, notes)
    _check_surfaces(setup, notes)
    _check_law(setup)
    if file.contact.youngs_modulus is None:
        setup = _hardened(setup, notes)
    run, sources_of_run = resolved_run(setup)
    notes.sources |= sources_of_run
    setup = setup.with_values(boundary=_with_uphill(setup, notes))
    case = setup.completed(Case, {"run": run, "name": name, "document": document})
    check_walkers_at_rest(case, file, notes)
    case = case.with_values(sources=notes.sources)
    check_bodies(case)
    return case


def _setup(file: CaseFile, document: Mapping[str, Any], notes: Notes) -> Setup:
    """The case with all values but those of its run; a modulus of ``"auto"`` is the lowest one."""
    drafts = walker_drafts(file, notes)
    draft_of_mixture = None
    if file.mixture is not None:
        draft_of_mixture = mixture_draft(file.mixture, notes)
    placed = tuple(placed_bead(bead) for bead in file.placed)
    radii = [bead.radius for bead in placed]
    for draft in drafts.values():
        radii += draft.geometry.radii
    if draft_of_mixture is not None:
        radii += draft_of_mixture.small_radii
        radii += draft_of_mixture.large_radii
    boundary = with_vessel(file.boundary, document, max(radii), notes)
    liquid = _liquid(file.liquid, notes)
    mixture = None
    if draft_of_mixture is not None:
        mixture = mixture_of(draft_of_mixture, boundary, notes)
    facings = {key: facing_of(draft, key, boundary) for key, draft in drafts.items()}
    drive = drive_of(file.drive, boundary, _dimer(file, drafts), notes)
    spacing = automatic_spacing(file, drive.excitation, drafts)
    walkers = {key: walkers_of(draft, facings[key], spacing) for key, draft in drafts.items()}
    modulus = file.contact.youngs_modulus or _SOFTEST
    contact = file.contact.completed(Contact, {"youngs_modulus": modulus})
    dimers = walkers.pop("dimers", None)
    return file.completed(
        Setup,
        {
            "dimers": dimers,
            "clusters": tuple(walkers.values()),
            "mixture": mixture,
            "placed": placed,
            "boundary": boundary,
            "drive": drive,
            "liquid": liquid,
            "contact": contact,
        },
    )


def _dimer(file: CaseFile, drafts: Mapping[str, WalkerDraft]) -> Dimer | None:
    """The first walkers of a case as a dimer; None if there are no walkers, or not of two beads."""
    first = next(iter(drafts.values()), None)
    if first is None or len(first.geometry.radii) != 2:
        return None
    front, back = first.geometry.radii
    return Dimer((front, back), file.beads.density, file.liquid.surface_tension)


def _liquid(liquid: LiquidTable, notes: Notes) -> Liquid:
    """The liquid with its dynamic viscosity, Pa s.

    The table gives either the dynamic or the kinematic viscosity (m²/s). The latter is multiplied
    by the density (kg/m³), and refused without one.
    """
    viscosity = liquid.dynamic_viscosity
    if liquid.kinematic_viscosity is not None:
        if liquid.density is None:
            message = "missing; expected the liquid's density beside its kinematic_viscosity"
            raise key_error("liquid.density", message)
        viscosity = to_fifteen_digits(liquid.kinematic_viscosity * liquid.density)
        notes.add("liquid.dynamic_viscosity", "from kinematic_viscosity and density")
    return liquid.completed(Liquid, {"dynamic_viscosity": viscosity})


def _check_surfaces(case: Setup, notes: Notes) -> None:
    """Refuse roughness that is large compared with the beads, and menisci that do not fit.

    Ranges of uncertain roughness are made to end at the largest value that is not refused.
    """
    largest = _LARGEST_ROUGHNESS * min(case.radii)
    contact_roughness = case.contact.roughness
    values = (contact_roughness.bead_bead, contact_roughness.bead_wall)
    for key, roughness in zip(ROUGHNESS, values, strict=True):
        if roughness > largest * (1.0 + 1e-9):  # more than a rounding error
            expected = f"{1e6 * largest:.3g} um or less, a hundredth of a bead's radius"
            raise key_error(key, f"expected {expected}")
        _end_range_at(key, largest, notes)
    if case.liquid.meniscus_radius:
        _check_menisci(case)


def _check_menisci(case: Setup) -> None:
    """Refuse menisci of a radius that do not fit between beads, or between a bead and a wall."""
    try:
        for radius in case.radii:
            for other_radius in (*case.radii, inf):
                bridge_volume(radius, other_radius, case.liquid.of_bridges)
    except ValueError as error:
        message = f"expected menisci that fit between the surfaces: {error}"
        raise key_error("liquid.meniscus_radius", message) from error


def _end_range_at(key: str, largest: float, notes: Notes) -> None:
    """End the range of a length at the largest value (m) that is not refused."""
    source = notes.sources.get(key)
    if source is None or source.range is None:
        return
    if parse_quantity(source.range[1], LENGTH) <= largest:
        return
    low, unit = source.range[0].split()
    highest = f"{largest / parse_quantity(f'1 {unit}', LENGTH):.6g} {unit}"
    notes.sources[key] = source._replace(range=(f"{low} {unit}", highest))


def _check_law(case: Setup) -> None:
    """Refuse beads or a liquid for which the law of the bridges does not hold.

    The default law holds for all of them.
    """
    if case.liquid.law == DEFAULT_LAW:
        return
    try:
        for radius in case.radii:
            bridge_at_rest(case, radius, inf)
    except ValueError as error:
        raise key_error("liquid.law", str(error)) from error


def _hardened(softest: Setup, notes: Notes) -> Setup:
    """The case with the Young's modulus of ``"auto"``, from the case with the lowest modulus.

    The modulus is the lowest at which bridges delay contacts little (`DELAY_LIMIT`). In a mixture
    it is raised only as long as this does not shorten the time step: hard beads would cost several
    times as much.
    """
    case = softest
    while largest_delay(case) > DELAY_LIMIT and case.contact.youngs_modulus < _HARDEST:
        modulus = 4.0 * case.contact.youngs_modulus
        harder = case.with_values(contact=case.contact.with_values(youngs_modulus=modulus))
        if case.mixture is not None and _longest_step(harder) < _longest_step(case):
            break
        case = harder
    why = f"auto: bridges delay contacts by {largest_delay(case):.1g} rad"
    notes.add("contact.youngs_modulus", why)
    return case


def _longest_step(case: Setup) -> float:
    """The time step that is recommended for a case, s."""
    step, _ = limits_of(case).recommended(loose=case.loose)
    return step


def _with_uphill(case: Setup, notes: Notes) -> Boundary:
    """The boundary with the direction of its steepest ascent, from the x axis toward y, rad.

    The case file gives it from the direction of the drive.
    """
    boundary = case.boundary
    if not boundary.tilt:
        return boundary.with_values(uphill=0.0)
    if boundary.uphill == 0.0:
        notes.add("boundary.uphill", "the direction of the drive", "default", "0 deg")
    x, y, _ = case.drive_axis
    return boundary.with_values(uphill=atan2(y, x) + boundary.uphill)
