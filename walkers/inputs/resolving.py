"""From a validated file to a resolved case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from math import atan2

from walkers.inputs.bodies import Placed
from walkers.inputs.body_tables import check_bodies, mixture_of, spaced, walkers_of
from walkers.inputs.boundary import Box, Channel, Cylinder, Groove, Plane, Shape
from walkers.inputs.case import Case, Run
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.matter_tables import resolve_matter
from walkers.inputs.run_tables import resolve_drive, resolve_run
from walkers.inputs.schema import BoundaryTable, CaseFile
from walkers.physics.dimer import Dimer


def resolve(file: CaseFile, name: str) -> Case:
    """Resolve a validated file.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or keys contradict each other.
    """
    boundary = _boundary(file.boundary)
    walkers = tuple(walkers_of(key, table, file.boundary) for key, table in file.walkers.items())
    mixture = mixture_of(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    if not (walkers or mixture or placed):
        raise UnusableKeyError("dimers", "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]")
    density, liquid, contact, _ = resolve_matter(file)
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), density, liquid.surface_tension) if len(first) == 2 else None
    case = Case(
        name=name,
        title=file.title,
        walkers=walkers,
        mixture=mixture,
        placed=placed,
        boundary=boundary,
        drive=resolve_drive(file.drive, boundary.drive_axis, dimer),
        gravity=file.environment.gravity,
        material=file.beads.material,
        density=density,
        liquid=liquid,
        contact=contact,
        seed=file.run.seed,
        run=Run(0.0, 1, 1, 0, False, 1, 1, 1, 1, 0.0, 0.0, 1),  # its step follows from the rest
    )
    case = replace(case, run=resolve_run(file.run, case))
    along, across, _ = case.drive_axis
    uphill = atan2(across, along) + file.boundary.uphill if boundary.tilt else 0.0
    case = replace(case, boundary=replace(boundary, uphill=uphill))
    made = zip(file.walkers, case.walkers, strict=True)
    case = replace(case, walkers=tuple(spaced(case, key, one) for key, one in made))
    check_bodies(case, file)
    return case


_SHAPES: Mapping[str, type[Shape]] = {
    "plane": Plane,
    "channel": Channel,
    "groove": Groove,
    "box": Box,
    "cylinder": Cylinder,
}
_EXAMPLES = {"opening": "120 deg", "width": "5.3 mm", "height": "5.3 mm"}


def _boundary(table: BoundaryTable) -> Shape:
    made = _SHAPES[table.shape]
    needed = {field.name for field in fields(made)} & _EXAMPLES.keys()
    for key, example in _EXAMPLES.items():
        if (getattr(table, key) is None) == (key in needed):
            missing = f'missing; expected such as "{example}"'
            raise UnusableKeyError(f"boundary.{key}", missing if key in needed else f"expected none of a {table.shape}")
    sizes = {key: getattr(table, key) for key in needed}
    return made(material=table.material, tilt=table.tilt, **sizes)
