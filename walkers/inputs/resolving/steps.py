"""Values that follow from others: a case of the tables of its file, in the order of the physics.

`resolve` takes a `CaseFile`, whose values may be missing, completes the tables of its bodies, drive,
liquid and contacts to a `Setup`, and adds the run, which makes it a `Case`. What the library gives is
in the tables before (`walkers.inputs.resolving.from_library`). Each step notes where its values are
from. Checks of the bodies come last.
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
from walkers.inputs.resolving.loads import LARGEST_DELAY, bridge_at_rest, delay_of
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.resolving.own_vessel import with_vessel
from walkers.inputs.resolving.standing import check_bodies
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case, CaseFile, Setup
from walkers.inputs.tables.materials import Contact, Liquid, LiquidTable
from walkers.inputs.units import LENGTH, parse_quantity
from walkers.physics.capillary import DEFAULT_LAW, bridge_volume
from walkers.physics.dimer import Dimer

_SOFTEST = 5e7
"""Lowest Young's modulus of ``"auto"``, Pa."""
_HARDEST = 4.0**5 * _SOFTEST
"""Highest one, 51.2 GPa: four times as much is beyond what a case may have."""
_ROUGHEST = 0.01
"""Largest roughness over the radius of a bead: the wedge of liquid between smooth spheres is then no model."""


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
    draft_of_mixture = None if file.mixture is None else mixture_draft(file.mixture, notes)
    placed = tuple(placed_bead(bead) for bead in file.placed)
    radii = [radius for draft in drafts.values() for radius in draft.geometry.radii]
    radii += [bead.radius for bead in placed]
    if draft_of_mixture is not None:
        radii += draft_of_mixture.small_radii + draft_of_mixture.large_radii
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
    bodies = {
        "dimers": walkers.pop("dimers", None),
        "clusters": tuple(walkers.values()),
        "mixture": mixture,
        "placed": placed,
    }
    surroundings = {"boundary": boundary, "drive": drive, "liquid": liquid, "contact": contact}
    return file.completed(Setup, {**bodies, **surroundings})


def _dimer(file: CaseFile, drafts: Mapping[str, WalkerDraft]) -> Dimer | None:
    """The first walkers of a case as a dimer; None if they are none."""
    first = next(iter(drafts.values()), None)
    if first is None or len(first.geometry.radii) != 2:
        return None
    front, back = first.geometry.radii
    return Dimer((front, back), file.beads.density, file.liquid.surface_tension)


def _liquid(liquid: LiquidTable, notes: Notes) -> Liquid:
    """The liquid with its dynamic viscosity."""
    viscosity = liquid.dynamic_viscosity
    if liquid.kinematic_viscosity is not None:
        if liquid.density is None:
            raise key_error(
                "liquid.density",
                "missing; expected the liquid's density beside its kinematic_viscosity",
            )
        viscosity = float(f"{liquid.kinematic_viscosity * liquid.density:.15g}")
        notes.add("liquid.dynamic_viscosity", "from kinematic_viscosity and density")
    return liquid.completed(Liquid, {"dynamic_viscosity": viscosity})


def _check_surfaces(case: Setup, notes: Notes) -> None:
    """Roughness is small compared with the beads, and menisci fit between them and at walls."""
    liquid, most = case.liquid.of_bridges, _ROUGHEST * min(case.radii)
    roughness = case.contact.roughness
    for key, value in zip(ROUGHNESS, (roughness.bead_bead, roughness.bead_wall), strict=True):
        if value > most * (1.0 + 1e-9):
            raise key_error(
                key, f"expected {1e6 * most:.3g} um or less, a hundredth of a bead's radius"
            )
        _end_range_at(key, most, notes)
    try:
        for radius in case.radii if liquid.meniscus_radius else ():
            for opposite in (*case.radii, inf):
                bridge_volume(radius, opposite, liquid)
    except ValueError as error:
        raise key_error(
            "liquid.meniscus_radius", f"expected menisci that fit between the surfaces: {error}"
        ) from error


def _end_range_at(key: str, most: float, notes: Notes) -> None:
    """End the range of a length, m, where the value would be refused."""
    source = notes.sources.get(key)
    if source is None or source.range is None or parse_quantity(source.range[1], LENGTH) <= most:
        return
    low, unit = source.range[0].split()
    highest = f"{most / parse_quantity(f'1 {unit}', LENGTH):.6g} {unit}"
    notes.sources[key] = source._replace(range=(f"{low} {unit}", highest))


def _check_law(case: Setup) -> None:
    """Laws but the default one may refuse the beads or the liquid of a case."""
    if case.liquid.law != DEFAULT_LAW:
        try:
            for radius in case.radii:
                bridge_at_rest(case, radius, inf)
        except ValueError as error:
            raise key_error("liquid.law", str(error)) from error


def _hardened(softened: Setup, notes: Notes) -> Setup:
    """The case with the Young's modulus of ``"auto"``, given with the lowest one.

    It is the lowest at which bridges delay contacts little (`LARGEST_DELAY`). In a mixture a higher
    modulus must not shorten the time step: hard beads would cost several times as much.
    """
    while delay_of(softened) > LARGEST_DELAY and softened.contact.youngs_modulus < _HARDEST:
        modulus = 4.0 * softened.contact.youngs_modulus
        harder = softened.with_values(contact=softened.contact.with_values(youngs_modulus=modulus))
        if softened.mixture is not None and _longest_step(harder) < _longest_step(softened):
            break
        softened = harder
    notes.add(
        "contact.youngs_modulus", f"auto: bridges delay contacts by {delay_of(softened):.1g} rad"
    )
    return softened


def _longest_step(case: Setup) -> float:
    """The time step that is recommended for a case, s."""
    return limits_of(case).recommended(loose=case.loose)[0]


def _with_uphill(case: Setup, notes: Notes) -> Boundary:
    """The boundary with the direction of the steepest way up, from the x axis toward y."""
    boundary = case.boundary
    if not boundary.tilt:
        return boundary.with_values(uphill=0.0)
    along, across, _ = case.drive_axis
    if boundary.uphill == 0.0:
        notes.add("boundary.uphill", "the direction of the drive", "default", "0 deg")
    return boundary.with_values(uphill=atan2(across, along) + boundary.uphill)
