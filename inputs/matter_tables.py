"""From the tables of beads, liquid and contacts to what the laws take, the library's numbers filled in."""

from __future__ import annotations

from walkers.inputs import library
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.library import suggestion
from walkers.inputs.schema import ContactTable, LiquidTable
from walkers.physics.matter import Contact, Liquid

_CONTACT = {"restitution": 0.3, "minimum_separation_ratio": 0.01}
_LIQUID = {"volume_fraction": 0.01, "viscosity_ratio": 1.0, "film_drag_ratio": 0.0, "contact_angle": 0.0}
"""Where neither the case nor the library says more."""


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


def density_of(material: str | None, density: float | None, contact: ContactTable) -> float:
    """Density of the beads, kg/m³: as given, or their material's.

    Raises
    ------
    UnusableKeyError
        If neither says it, or the material is not in the library and the case does not say all about it.
    """
    if material is not None:
        described = density is not None and _describes_contacts(contact)
        known_name("beads.material", material, library.materials(), described=described)
    if density is None and material is not None:
        density = library.material(material)["density"]
    if density is None:
        raise UnusableKeyError("beads.material", "missing; expected a material of the library, or a density")
    return density


def resolve_liquid(table: LiquidTable, pair: dict[str, float] | None = None) -> Liquid:
    """A liquid, the library's numbers filled in, those of the two surfaces among them.

    Raises
    ------
    UnusableKeyError
        If a number is missing or said twice.
    """
    known: dict[str, float] = {}
    if table.name is not None:
        known = library.liquid(known_name("liquid.name", table.name, library.liquids()))
    if table.kinematic_viscosity is not None and table.dynamic_viscosity is not None:
        raise UnusableKeyError(
            "liquid.dynamic_viscosity", "expected either kinematic_viscosity or dynamic_viscosity, not both"
        )
    tension = table.surface_tension or known.get("surface_tension")
    density = table.density or known.get("density")
    kinematic = table.kinematic_viscosity if table.kinematic_viscosity is not None else known.get("kinematic_viscosity")
    viscosity = table.dynamic_viscosity
    if viscosity is None and kinematic is not None:
        if density is None:
            raise UnusableKeyError("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        viscosity = float(f"{kinematic * density:.15g}")
    if tension is None or viscosity is None:
        lacking = "surface_tension" if tension is None else "dynamic_viscosity"
        raise UnusableKeyError(f"liquid.{lacking}", "missing; expected a liquid of the library by name, or this number")
    chosen = _chosen(table, pair, _LIQUID)
    film, bridges = (float(f"{viscosity * chosen[f'{of}_ratio']:.15g}") for of in ("film_drag", "viscosity"))
    return Liquid(tension, bridges, density, chosen["volume_fraction"], chosen["contact_angle"], table.name, film)


def resolve_contact(table: ContactTable, bead: str | None, wall_key: str, wall: str) -> Contact:
    """How beads of a material touch each other and a wall, the library's frictions filled in.

    Parameters
    ----------
    table
        What the case says.
    bead, wall
        Materials.
    wall_key
        The key that names the wall's.

    Raises
    ------
    UnusableKeyError
        If a material or a friction is not known.
    """
    known_name(wall_key, wall, library.materials(), described=_describes_contacts(table))
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    known = {
        "friction.bead_bead": _first(table.friction.bead_bead, on_bead, "friction"),
        "friction.bead_wall": _first(table.friction.bead_wall, on_wall, "friction"),
        "rolling_friction": _first(table.rolling_friction, on_wall, "rolling_friction"),
    }
    lacking = [key for key, value in known.items() if value is None]
    if lacking:
        pairs = "; ".join(" on ".join(pair) for pair in library.surface_pairs())
        others = f", and so are {', '.join(lacking[1:])}" if lacking[1:] else ""
        raise UnusableKeyError(
            f"contact.{lacking[0]}",
            f"missing{others}; the library has them for {pairs} only, not for {bead or 'these beads'} on {wall}",
        )
    return Contact(
        youngs_modulus=table.youngs_modulus,
        poissons_ratio=table.poissons_ratio,
        friction_bead_bead=known["friction.bead_bead"] or 0.0,
        friction_bead_wall=known["friction.bead_wall"] or 0.0,
        rolling_friction=known["rolling_friction"] or 0.0,
        **_chosen(table, on_wall, _CONTACT),
    )


def _chosen(
    table: LiquidTable | ContactTable, pair: dict[str, float] | None, usual: dict[str, float]
) -> dict[str, float]:
    """What the case says, or else the library of a pair of surfaces, or else what is usual."""
    return {
        key: value if (value := _first(getattr(table, key), pair, key)) is not None else otherwise
        for key, otherwise in usual.items()
    }


def _first(given: float | None, pair: dict[str, float] | None, key: str) -> float | None:
    if given is not None:
        return given
    return pair.get(key) if pair is not None else None
