"""From the tables of beads, liquid and contacts to what the laws take, the library's numbers filled in."""

from __future__ import annotations

from collections.abc import Mapping

from walkers.inputs import library
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.library import Known, suggestion
from walkers.inputs.origins import Choices
from walkers.inputs.schema import CaseFile, ContactTable, LiquidTable
from walkers.inputs.units import DYNAMIC_VISCOSITY, quantity_text
from walkers.physics.laws import LAWS, by_name
from walkers.physics.matter import DEFAULT_LAW, Contact, Liquid

_OF_SURFACES = ("rolling_friction", "restitution", "minimum_separation_ratio")


def known_name(key: str, name: str, names: tuple[str, ...], *, described: bool = False) -> str:
    """A name of the library; another one only if the case itself says all about it and it is no misspelling."""
    if name in names:
        return name
    hint = suggestion(name, names)
    if hint or not described:
        raise UnusableKeyError(key, f"not in the library; expected one of {', '.join(names)}{hint}")
    return name


def _describes_contacts(table: ContactTable) -> bool:
    return None not in (table.friction.bead_bead, table.friction.bead_wall, table.rolling_friction)


def resolve_matter(file: CaseFile) -> tuple[float, Liquid, Contact, Choices]:
    """Density of the beads (kg/m³), liquid and contacts of a file, and where what it does not say comes from.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or is said twice.
    """
    # What was calibrated was so with one law of the bridges: with another it is a guess.
    choices = Choices(file.liquid.name if file.liquid.law == DEFAULT_LAW else None)
    bead, wall = file.beads.material, file.boundary.material
    pair = library.surface_pair(bead, wall) or {}
    density = _density(file, choices)
    return density, _liquid(file.liquid, pair, choices), _contact(file.contact, bead, wall, choices), choices


def _density(file: CaseFile, choices: Choices) -> float:
    """Density of the beads, kg/m³: as given, or their material's."""
    material, given = file.beads.material, file.beads.density
    known = None
    if material is not None:
        described = given is not None and _describes_contacts(file.contact)
        known_name("beads.material", material, library.materials(), described=described)
    if given is None and material is not None:
        known = library.material(material)["density"]
    density = choices.choose("beads.density", given, known)
    if density is None:
        raise UnusableKeyError("beads.material", "missing; expected a material of the library, or a density")
    return density


def _liquid(table: LiquidTable, pair: Mapping[str, Known], choices: Choices) -> Liquid:
    """A liquid, the library's numbers filled in, those of the two surfaces among them."""
    known: Mapping[str, Known] = {}
    if table.name is not None:
        known = library.liquid(known_name("liquid.name", table.name, library.liquids()))
    if table.kinematic_viscosity is not None and table.dynamic_viscosity is not None:
        raise UnusableKeyError(
            "liquid.dynamic_viscosity", "expected either kinematic_viscosity or dynamic_viscosity, not both"
        )
    tension = choices.choose("liquid.surface_tension", table.surface_tension, known.get("surface_tension"))
    density = choices.choose("liquid.density", table.density, known.get("density"))
    viscosity = table.dynamic_viscosity
    if viscosity is None:
        kinematic = choices.choose(
            "liquid.kinematic_viscosity", table.kinematic_viscosity, known.get("kinematic_viscosity")
        )
        if kinematic is not None and density is None:
            raise UnusableKeyError("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        if kinematic is not None and density is not None:
            viscosity = float(f"{kinematic * density:.15g}")
            choices.derive(
                "liquid.dynamic_viscosity",
                quantity_text(viscosity, DYNAMIC_VISCOSITY),
                "from kinematic_viscosity and density",
            )
    if tension is None or viscosity is None:
        lacking = "surface_tension" if tension is None else "dynamic_viscosity"
        raise UnusableKeyError(f"liquid.{lacking}", "missing; expected a liquid of the library by name, or this number")

    def chosen(key: str) -> float:
        return choices.choose(f"liquid.{key}", getattr(table, key), pair.get(key)) or 0.0

    if table.law not in LAWS:
        try:
            by_name(table.law)
        except ValueError as error:
            raise UnusableKeyError("liquid.law", str(error)) from error
    bridges = float(f"{viscosity * chosen('viscosity_ratio'):.15g}")
    fraction, angle = chosen("volume_fraction"), chosen("contact_angle")
    return Liquid(tension, bridges, density, fraction, angle, table.name, table.law)


def _contact(table: ContactTable, bead: str | None, wall: str, choices: Choices) -> Contact:
    """How beads of a material touch each other and a wall, the library's frictions filled in."""
    known_name("boundary.material", wall, library.materials(), described=_describes_contacts(table))
    on_bead, on_wall = library.surface_pair(bead, bead) or {}, library.surface_pair(bead, wall) or {}
    chosen = {
        key: choices.choose(f"contact.{key}", given, known)
        for key, given, known in (
            ("friction.bead_bead", table.friction.bead_bead, on_bead.get("friction")),
            ("friction.bead_wall", table.friction.bead_wall, on_wall.get("friction")),
            *((key, getattr(table, key), on_wall.get(key)) for key in _OF_SURFACES),
        )
    }
    lacking = [key for key, value in chosen.items() if value is None]
    if lacking:
        pairs = "; ".join(" on ".join(pair) for pair in library.surface_pairs())
        others = f", and so are {', '.join(lacking[1:])}" if lacking[1:] else ""
        raise UnusableKeyError(
            f"contact.{lacking[0]}",
            f"missing{others}; the library has them for {pairs} only, not for {bead or 'these beads'} on {wall}: "
            "expected numbers (if they are guesses, say in [uncertain] between which ends)",
        )
    values = {key: value for key, value in chosen.items() if value is not None}
    return Contact(
        youngs_modulus=table.youngs_modulus,
        poissons_ratio=table.poissons_ratio,
        friction_bead_bead=values["friction.bead_bead"],
        friction_bead_wall=values["friction.bead_wall"],
        **{key: values[key] for key in _OF_SURFACES},
    )
