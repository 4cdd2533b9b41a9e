"""What beads, liquid and contacts are made of: what a case leaves out is the library's, or what is usual."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from walkers.inputs import library
from walkers.inputs.changes import MISSING, changed, parts_of, value_at
from walkers.inputs.errors import unusable
from walkers.inputs.library import Known, suggestion
from walkers.inputs.origins import Notes, Origin
from walkers.inputs.schema import ContactTable, LiquidTable
from walkers.inputs.units import DYNAMIC_VISCOSITY
from walkers.physics.laws import LAWS, by_name
from walkers.physics.matter import DEFAULT_LAW, Contact, Liquid

_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_SURFACES = (
    *("liquid.viscosity_ratio", "liquid.volume_fraction", "liquid.contact_angle"),
    *("contact.rolling_friction", "contact.restitution", "contact.minimum_separation_ratio"),
)
_OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", "liquid.kinematic_viscosity")
SUPPLIED = ("beads.density", *_OF_LIQUIDS, *_FRICTION[:2], *_OF_SURFACES)
"""Keys that a case may leave out because the library has them, or says what is usual."""


def supplied(document: Mapping[str, Any], notes: Notes) -> dict[str, Any]:
    """The tables of a case with what they leave out and the library has of the materials and the liquid they name.

    Raises `InputError` if they name what the library has not, and do not say all about it themselves.
    """
    said = {key: value_at(document, parts_of(key)) for key in (*SUPPLIED, "liquid.dynamic_viscosity", "liquid.law")}
    given = {key for key, value in said.items() if value is not MISSING}
    named = {key: value_at(document, parts_of(key)) for key in ("beads.material", "boundary.material", "liquid.name")}
    for key, name in named.items():
        if name is not MISSING and not isinstance(name, str):
            raise unusable(key, "expected text in quotes")
    bead, wall, liquid = (None if name is MISSING else str(name) for name in named.values())
    described = given.issuperset(_FRICTION)
    for key, name, names, says_all in (
        ("beads.material", bead, library.materials(), described and "beads.density" in given),
        ("liquid.name", liquid, library.liquids(), False),
        ("boundary.material", wall, library.materials(), described),
    ):
        if name is not None and name not in names and not says_all:
            told = f"not in the library; expected one of {', '.join(names)}{suggestion(name, names)}"
            raise unusable(key, told)
    known, settings = _known(bead, wall, liquid), {}
    # What was calibrated was so with one law of the bridges: with another it is a guess.
    calibrated = liquid if said["liquid.law"] in (MISSING, DEFAULT_LAW) else None
    for key in SUPPLIED:
        there = isinstance(document.get(key.split(".")[0]), Mapping) or key.startswith("contact")
        instead = key == "liquid.kinematic_viscosity" and "liquid.dynamic_viscosity" in given
        if there and key in known and not (key in given or instead):
            settings[key] = known[key].written
            notes[key] = _origin_of(key, known[key], calibrated)
    return changed({"contact": {"friction": {}}, **document}, settings)


@cache
def _known(bead: str | None, wall: str | None, liquid: str | None) -> dict[str, Known]:
    """What is usual, and what the library has of materials and a liquid, by the keys of a case."""
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    found = {
        "beads.density": library.material(bead).get("density") if bead in library.materials() else None,
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{key: on_wall.get(key.split(".")[1]) for key in _OF_SURFACES},
        **{f"liquid.{key}": known for key, known in (library.liquid(liquid) if liquid else {}).items()},
    }
    usual = {key: loose.usual for key, loose in library.unmeasured().items()}
    return {key: known for key, known in (usual | {key: one for key, one in found.items() if one}).items() if known}


@cache
def _origin_of(key: str, known: Known, liquid: str | None) -> Origin:
    """What was calibrated with other liquids is a guess for this one."""
    loose, text = library.unmeasured().get(key), str(known.written)
    if loose is None or (known.source and not known.calibrated_with):
        return Origin(key, text, "library", known.source, value=known.value)
    if liquid in known.calibrated_with:
        return Origin(key, text, "calibrated", known.source, known.range, loose.logarithmic, value=known.value)
    return Origin(key, text, "default", known.source, loose.range, loose.logarithmic, value=known.value)


def liquid_of(table: LiquidTable, notes: Notes) -> Liquid:
    """The liquid of the bridges and their law; raises `InputError` if its viscosity is missing or said twice."""
    dynamic, kinematic = table.dynamic_viscosity, table.kinematic_viscosity
    if dynamic is not None and kinematic is not None:
        told = "expected either kinematic_viscosity or dynamic_viscosity, not both"
        raise unusable("liquid.dynamic_viscosity", told)
    if kinematic is not None:
        if table.density is None:
            raise unusable("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        dynamic = float(f"{kinematic * table.density:.15g}")
        notes.derived("liquid.dynamic_viscosity", dynamic, "from kinematic_viscosity and density", DYNAMIC_VISCOSITY)
    if dynamic is None:
        told = "missing; expected a liquid of the library by name, or this number"
        raise unusable("liquid.dynamic_viscosity", told)
    if table.law not in LAWS:
        try:
            by_name(table.law)
        except ValueError as error:
            raise unusable("liquid.law", str(error)) from error
    return Liquid(
        surface_tension=table.surface_tension,
        dynamic_viscosity=float(f"{dynamic * table.viscosity_ratio:.15g}"),
        density=table.density,
        volume_fraction=table.volume_fraction,
        contact_angle=table.contact_angle,
        name=table.name,
        law=table.law,
    )


def contact_of(table: ContactTable) -> Contact:
    """The model of the contacts."""
    return Contact(
        friction_bead_bead=table.friction.bead_bead,
        friction_bead_wall=table.friction.bead_wall,
        **table.model_dump(exclude={"friction"}),
    )
