"""From a validated file to a resolved case: what the library supplies and what follows from the rest is filled in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from math import atan2
from typing import Any

from walkers.inputs import library
from walkers.inputs.bodies import Placed
from walkers.inputs.body_tables import check_bodies, mixture_of, spaced, walkers_of
from walkers.inputs.boundary import SHAPES, Shape
from walkers.inputs.case import Case, Run
from walkers.inputs.changes import parts_of
from walkers.inputs.errors import unusable
from walkers.inputs.library import Known, suggestion
from walkers.inputs.origins import Notes, Origin, origins_of
from walkers.inputs.run_tables import resolve_drive, resolve_run
from walkers.inputs.schema import BoundaryTable, CaseFile
from walkers.inputs.units import ANGLE, DYNAMIC_VISCOSITY
from walkers.physics.dimer import Dimer
from walkers.physics.laws import LAWS, by_name
from walkers.physics.matter import DEFAULT_LAW, Contact, Liquid

_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_CONTACTS = (*_FRICTION, "contact.restitution", "contact.minimum_separation_ratio")
_OF_BRIDGES = ("liquid.viscosity_ratio", "liquid.volume_fraction", "liquid.contact_angle")
_OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", "liquid.kinematic_viscosity", "liquid.dynamic_viscosity")
_EXAMPLES = {"opening": "120 deg", "width": "5.3 mm", "height": "5.3 mm"}


def resolve(file: CaseFile, name: str, document: Mapping[str, Any]) -> Case:
    """Resolve a validated file, read from a document.

    Raises `InputError` if something is missing that the library does not know, or keys contradict each other.
    """
    notes = Notes()
    boundary = _boundary(file.boundary)
    walkers = tuple(walkers_of(key, table, file.boundary, notes) for key, table in file.walkers.items())
    mixture = mixture_of(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    if not (walkers or mixture or placed):
        raise unusable("dimers", "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]")
    matter = _matter(file, notes)
    liquid = _liquid(file, matter, notes)
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), matter["beads.density"], liquid.surface_tension) if len(first) == 2 else None
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
        density=matter["beads.density"],
        liquid=liquid,
        contact=_contact(file, matter),
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
    return case.read_from(document, origins_of(file, document, notes))


def _boundary(table: BoundaryTable) -> Shape:
    made = SHAPES[table.shape]
    needed = {field.name for field in fields(made)} & _EXAMPLES.keys()
    for key, example in _EXAMPLES.items():
        if (getattr(table, key) is None) == (key in needed):
            missing = f'missing; expected such as "{example}"'
            raise unusable(f"boundary.{key}", missing if key in needed else f"expected none of a {table.shape}")
    return made(material=table.material, tilt=table.tilt, **{key: getattr(table, key) for key in needed})


def _matter(file: CaseFile, notes: Notes) -> dict[str, float]:
    """Density of the beads and what the laws take of liquid and contacts, by keys, what is left out filled in."""
    known, loose = _known(file), library.unmeasured()
    # What was calibrated was so with one law of the bridges: with another it is a guess.
    liquid = file.liquid.name if file.liquid.law == DEFAULT_LAW else None
    values: dict[str, float] = {}
    for key in ("beads.density", *_OF_LIQUIDS, *_OF_BRIDGES, *_OF_CONTACTS):
        if (given := _said(file, key)) is not None:
            values[key] = given
        elif key == "liquid.kinematic_viscosity" and file.liquid.dynamic_viscosity is not None:
            continue
        elif key in known:
            values[key] = known[key].value
            notes[key] = _origin_of(key, known[key], liquid)
        elif key in loose and (usual := loose[key].usual) is not None:
            values[key] = usual.value
            notes[key] = _origin_of(key, usual, liquid)
    if "beads.density" not in values:
        raise unusable("beads.material", "missing; expected a material of the library, or a density")
    return values


def _said(file: CaseFile, key: str) -> Any:
    """What a file says at a dotted key."""
    value: Any = file
    for part in parts_of(key):
        value = getattr(value, str(part))
    return value


def _known(file: CaseFile) -> dict[str, Known]:
    """What the library has of the materials and the liquid of a file, which it must know, by the keys of a case."""
    bead, wall, liquid = file.beads.material, file.boundary.material, file.liquid.name
    described = all(_said(file, key) is not None for key in _FRICTION)
    named = (
        ("beads.material", bead, library.materials(), described and file.beads.density is not None),
        ("liquid.name", liquid, library.liquids(), False),
        ("boundary.material", wall, library.materials(), described),
    )
    for key, name, names, says_all_itself in named:
        if name is not None and name not in names and not says_all_itself:
            told = f"not in the library; expected one of {', '.join(names)}{suggestion(name, names)}"
            raise unusable(key, told)
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    found = {
        "beads.density": library.material(bead).get("density") if bead in library.materials() else None,
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{key: on_wall.get(key.split(".")[1]) for key in (*_OF_BRIDGES, *_OF_CONTACTS[2:])},
        **{f"liquid.{key}": known for key, known in (library.liquid(liquid) if liquid else {}).items()},
    }
    return {key: known for key, known in found.items() if known is not None}


def _origin_of(key: str, known: Known, liquid: str | None) -> Origin:
    """What was calibrated with other liquids is a guess for this one."""
    loose = library.unmeasured().get(key)
    if loose is None or (known.source and not known.calibrated_with):
        return Origin(key, known.text, "library", known.source, value=known.value)
    if liquid in known.calibrated_with:
        ends = known.range
        return Origin(key, known.text, "calibrated", known.source, ends, loose.logarithmic, value=known.value)
    return Origin(key, known.text, "default", known.source, loose.range, loose.logarithmic, value=known.value)


def _liquid(file: CaseFile, values: Mapping[str, float], notes: Notes) -> Liquid:
    """The liquid of the bridges and their law."""
    table, dynamic = file.liquid, "liquid.dynamic_viscosity"
    kinematic, viscosity = values.get("liquid.kinematic_viscosity"), values.get(dynamic)
    if table.kinematic_viscosity is not None and table.dynamic_viscosity is not None:
        raise unusable(dynamic, "expected either kinematic_viscosity or dynamic_viscosity, not both")
    if kinematic is not None:
        if "liquid.density" not in values:
            raise unusable("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        viscosity = float(f"{kinematic * values['liquid.density']:.15g}")
        notes.derived(dynamic, viscosity, "from kinematic_viscosity and density", DYNAMIC_VISCOSITY)
    for key, value in (("liquid.surface_tension", values.get("liquid.surface_tension")), (dynamic, viscosity)):
        if value is None:
            raise unusable(key, "missing; expected a liquid of the library by name, or this number")
    if table.law not in LAWS:
        try:
            by_name(table.law)
        except ValueError as error:
            raise unusable("liquid.law", str(error)) from error
    return Liquid(
        surface_tension=values["liquid.surface_tension"],
        dynamic_viscosity=float(f"{(viscosity or 0.0) * values['liquid.viscosity_ratio']:.15g}"),
        density=values.get("liquid.density"),
        volume_fraction=values["liquid.volume_fraction"],
        contact_angle=values["liquid.contact_angle"],
        name=table.name,
        law=table.law,
    )


def _contact(file: CaseFile, values: Mapping[str, float]) -> Contact:
    lacking = [key.removeprefix("contact.") for key in _OF_CONTACTS if key not in values]
    if lacking:
        pairs = "; ".join(" on ".join(pair) for pair in library.surface_pairs())
        others = f", and so are {', '.join(lacking[1:])}" if lacking[1:] else ""
        surfaces = f"{file.beads.material or 'these beads'} on {file.boundary.material}"
        told = f"missing{others}; the library has them for {pairs} only, not for {surfaces}: expected numbers"
        told += " (if they are guesses, say in [uncertain] between which ends)"
        raise unusable(f"contact.{lacking[0]}", told)
    return Contact(
        youngs_modulus=file.contact.youngs_modulus,
        poissons_ratio=file.contact.poissons_ratio,
        **{key.removeprefix("contact.").replace(".", "_"): values[key] for key in _OF_CONTACTS},
    )
