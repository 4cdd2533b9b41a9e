"""From a validated file to a resolved case: what the library supplies and what follows from the rest is filled in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from math import atan2
from typing import Any

from walkers.inputs.bodies import Placed
from walkers.inputs.body_tables import check_bodies, mixture_of, spaced, walkers_of
from walkers.inputs.boundary import SHAPES, Shape
from walkers.inputs.case import Case, Run
from walkers.inputs.errors import unusable
from walkers.inputs.matter import contact_of, liquid_of
from walkers.inputs.origins import Notes, Origin, origins_of
from walkers.inputs.run_tables import resolve_drive, resolve_run
from walkers.inputs.schema import BoundaryTable, CaseFile
from walkers.inputs.units import ANGLE
from walkers.physics.dimer import Dimer

_EXAMPLES = {"opening": "120 deg", "width": "5.3 mm", "height": "5.3 mm"}


def resolve(file: CaseFile, name: str, document: Mapping[str, Any], notes: Notes) -> Case:
    """Resolve a validated file, read from a document; ``notes`` are on what it leaves out.

    Raises `InputError` if something is missing that the library does not know, or keys contradict each other.
    """
    boundary = _boundary(file.boundary)
    walkers = tuple(walkers_of(key, table, file.boundary, notes) for key, table in file.walkers.items())
    mixture = mixture_of(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    if not (walkers or mixture or placed):
        raise unusable("dimers", "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]")
    liquid, density = liquid_of(file.liquid, notes), file.beads.density
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), density, liquid.surface_tension) if len(first) == 2 else None
    case = Case(
        name=name,
        title=file.title,
        walkers=walkers,
        mixture=mixture,
        placed=placed,
        boundary=boundary,
        drive=resolve_drive(file.drive, boundary, dimer, notes),
        gravity=file.environment.gravity,
        material=file.beads.material,
        density=density,
        liquid=liquid,
        contact=contact_of(file.contact),
        seed=file.run.seed,
        run=Run(0.0, 1, 1, 0, False, 1, 1, 1, 1, 0.0, 0.0, 1),  # its step follows from the rest
    )
    case = replace(case, run=resolve_run(file.run, case, notes))
    if boundary.tilt:
        along, across, _ = case.drive_axis
        case = replace(case, boundary=replace(boundary, uphill=atan2(across, along) + file.boundary.uphill))
    made = zip(file.walkers, case.walkers, strict=True)
    case = replace(case, walkers=tuple(spaced(case, key, one, notes) for key, one in made))
    check_bodies(case, file)
    if boundary.tilt and file.boundary.uphill == 0.0:
        notes.default("boundary.uphill", 0.0, ANGLE, "the direction of the drive")
    gravity = case.gravity
    notes["environment.gravity"] = Origin("environment.gravity", f"{gravity:g} m/s^2", "default", value=gravity)
    return case.read_from(document, partial(origins_of, file, document, notes))


def _boundary(table: BoundaryTable) -> Shape:
    made = SHAPES[table.shape]
    needed = {field.name for field in fields(made)} & _EXAMPLES.keys()
    for key, example in _EXAMPLES.items():
        if (getattr(table, key) is None) == (key in needed):
            missing = f'missing; expected such as "{example}"'
            raise unusable(f"boundary.{key}", missing if key in needed else f"expected none of a {table.shape}")
    return made(material=table.material, tilt=table.tilt, **{key: getattr(table, key) for key in needed})
