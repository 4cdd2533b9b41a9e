"""From a validated file to a resolved case."""

from __future__ import annotations

from dataclasses import replace
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
    boundary, beads = _boundary(file.boundary), file.beads
    walkers = walkers_of(file)
    mixture = mixture_of(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    if not (walkers or mixture or placed):
        raise UnusableKeyError("dimers", "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]")
    density, liquid, contact, _ = resolve_matter(file)
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), density, liquid.surface_tension) if len(first) == 2 else None
    drive = resolve_drive(file.drive, boundary.drive_axis, dimer)
    case = Case(
        name=name,
        title=file.title,
        walkers=walkers,
        mixture=mixture,
        placed=placed,
        boundary=boundary,
        drive=drive,
        gravity=file.environment.gravity,
        material=beads.material,
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
    case = replace(case, walkers=tuple(spaced(case, number, file) for number in range(len(walkers))))
    check_bodies(case, file)
    return case


def _boundary(table: BoundaryTable) -> Shape:
    material, tilt = table.material, table.tilt
    for key, of in (
        ("opening", ("groove",)),
        ("width", ("channel", "box", "cylinder")),
        ("height", ("box", "cylinder")),
    ):
        given = getattr(table, key)
        if (given is None) == (table.shape in of):
            example = "120 deg" if key == "opening" else "5.3 mm"
            expected = (
                f'missing; expected such as "{example}"' if given is None else f"expected none of a {table.shape}"
            )
            raise UnusableKeyError(f"boundary.{key}", expected)
    width, height, opening = (value or 0.0 for value in (table.width, table.height, table.opening))
    shapes: dict[str, Shape] = {
        "plane": Plane(material=material, tilt=tilt),
        "channel": Channel(material=material, tilt=tilt, width=width),
        "groove": Groove(material=material, tilt=tilt, opening=opening),
        "box": Box(material=material, tilt=tilt, width=width, height=height),
        "cylinder": Cylinder(material=material, tilt=tilt, width=width, height=height),
    }
    return shapes[table.shape]
