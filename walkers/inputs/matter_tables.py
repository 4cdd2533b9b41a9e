"""From the tables of beads, liquid and contacts to what the laws take, the library's numbers filled in."""

from __future__ import annotations

from functools import reduce
from typing import Any

from walkers.inputs import library
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.library import Known, suggestion
from walkers.inputs.origins import Origin
from walkers.inputs.schema import CaseFile, LiquidTable
from walkers.inputs.units import DYNAMIC_VISCOSITY, quantity_text
from walkers.physics.laws import LAWS, by_name
from walkers.physics.matter import DEFAULT_LAW, Contact, Liquid

_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_CONTACTS = (*_FRICTION, "contact.restitution", "contact.minimum_separation_ratio")
_OF_BRIDGES = ("liquid.viscosity_ratio", "liquid.volume_fraction", "liquid.contact_angle")
_OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", "liquid.kinematic_viscosity", "liquid.dynamic_viscosity")


def _check_name(key: str, name: str | None, names: tuple[str, ...], *, described: bool = False) -> None:
    """Refuse a name that the library does not have, unless the case says all about it itself."""
    if name is not None and name not in names and not described:
        told = f"not in the library; expected one of {', '.join(names)}{suggestion(name, names)}"
        raise UnusableKeyError(key, told)


def _known(file: CaseFile) -> dict[str, Known]:
    """What the library has of the materials and the liquid of a file, by the keys of a case.

    Raises
    ------
    UnusableKeyError
        If it has not what the file names.
    """
    bead, wall, liquid = file.beads.material, file.boundary.material, file.liquid.name
    described = all(_at(file, key) is not None for key in _FRICTION)
    described_beads = described and file.beads.density is not None
    _check_name("beads.material", bead, library.materials(), described=described_beads)
    _check_name("liquid.name", liquid, library.liquids())
    _check_name("boundary.material", wall, library.materials(), described=described)
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    of_beads = library.material(bead) if bead in library.materials() else {}
    found = {
        "beads.density": of_beads.get("density"),
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{key: on_wall.get(key.split(".")[1]) for key in (*_OF_BRIDGES, *_OF_CONTACTS[2:])},
        **{f"liquid.{key}": known for key, known in (library.liquid(liquid) if liquid else {}).items()},
    }
    return {key: known for key, known in found.items() if known is not None}


def _at(file: CaseFile, key: str) -> Any:
    return reduce(getattr, key.split("."), file)


def resolve_matter(file: CaseFile) -> tuple[float, Liquid, Contact, dict[str, Origin]]:
    """Density of the beads (kg/m³), liquid and contacts of a file, and where what it does not say comes from.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or is said twice.
    """
    known, loose = _known(file), library.unmeasured()
    # What was calibrated was so with one law of the bridges: with another it is a guess.
    liquid = file.liquid.name if file.liquid.law == DEFAULT_LAW else None
    values: dict[str, float] = {}
    origins: dict[str, Origin] = {}
    for key in ("beads.density", *_OF_LIQUIDS, *_OF_BRIDGES, *_OF_CONTACTS):
        if (given := _at(file, key)) is not None:
            values[key] = given
        elif key == "liquid.kinematic_viscosity" and file.liquid.dynamic_viscosity is not None:
            continue
        elif key in known:
            values[key] = known[key].value
            origins[key] = _origin_of(key, known[key], liquid)
        elif key in loose and (usual := loose[key].usual) is not None:
            values[key] = usual.value
            origins[key] = Origin(key, usual.text, "default", "", loose[key].range, loose[key].logarithmic)
    if "beads.density" not in values:
        raise UnusableKeyError("beads.material", "missing; expected a material of the library, or a density")
    _add_viscosity(file.liquid, values, origins)
    _check_contacts(file, values)
    bridges = float(f"{values['liquid.dynamic_viscosity'] * values['liquid.viscosity_ratio']:.15g}")
    return (
        values["beads.density"],
        Liquid(
            surface_tension=values["liquid.surface_tension"],
            dynamic_viscosity=bridges,
            density=values.get("liquid.density"),
            volume_fraction=values["liquid.volume_fraction"],
            contact_angle=values["liquid.contact_angle"],
            name=file.liquid.name,
            law=file.liquid.law,
        ),
        Contact(
            youngs_modulus=file.contact.youngs_modulus,
            poissons_ratio=file.contact.poissons_ratio,
            **{key.removeprefix("contact.").replace(".", "_"): values[key] for key in _OF_CONTACTS},
        ),
        origins,
    )


def _origin_of(key: str, known: Known, liquid: str | None) -> Origin:
    """What was calibrated with other liquids is a guess for this one."""
    loose = library.unmeasured().get(key)
    if loose is None or not known.calibrated_with:
        return Origin(key, known.text, "library", known.source)
    if liquid in known.calibrated_with:
        return Origin(key, known.text, "calibrated", known.source, known.range, loose.logarithmic)
    return Origin(key, known.text, "default", known.source, loose.range, loose.logarithmic)


def _add_viscosity(table: LiquidTable, values: dict[str, float], origins: dict[str, Origin]) -> None:
    """Check what a file says of the liquid and its law, and add the dynamic viscosity."""
    dynamic, kinematic = "liquid.dynamic_viscosity", values.get("liquid.kinematic_viscosity")
    if table.kinematic_viscosity is not None and table.dynamic_viscosity is not None:
        raise UnusableKeyError(dynamic, "expected either kinematic_viscosity or dynamic_viscosity, not both")
    if kinematic is not None:
        if "liquid.density" not in values:
            raise UnusableKeyError("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        values[dynamic] = float(f"{kinematic * values['liquid.density']:.15g}")
        text = quantity_text(values[dynamic], DYNAMIC_VISCOSITY)
        origins[dynamic] = Origin(dynamic, text, "derived", "from kinematic_viscosity and density")
    for key in ("liquid.surface_tension", dynamic):
        if key not in values:
            raise UnusableKeyError(key, "missing; expected a liquid of the library by name, or this number")
    if table.law not in LAWS:
        try:
            by_name(table.law)
        except ValueError as error:
            raise UnusableKeyError("liquid.law", str(error)) from error


def _check_contacts(file: CaseFile, values: dict[str, float]) -> None:
    lacking = [key.removeprefix("contact.") for key in _OF_CONTACTS if key not in values]
    if not lacking:
        return
    pairs = "; ".join(" on ".join(pair) for pair in library.surface_pairs())
    others = f", and so are {', '.join(lacking[1:])}" if lacking[1:] else ""
    surfaces = f"{file.beads.material or 'these beads'} on {file.boundary.material}"
    told = f"missing{others}; the library has them for {pairs} only, not for {surfaces}: expected numbers"
    raise UnusableKeyError(
        f"contact.{lacking[0]}", f"{told} (if they are guesses, say in [uncertain] between which ends)"
    )
