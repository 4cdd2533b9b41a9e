"""Values of the library and defaults, filled in before the document of a case is validated.

A case names materials and a liquid. What it leaves out about them is taken here from the library
(`walkers.inputs.resolving.library`). Values that follow from other values of the case are the
subject of `walkers.inputs.resolving.steps`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from walkers.errors import InputError, Problem, expected_of, key_error, quoted
from walkers.inputs.config_table import alternatives, changed, whole_table_of
from walkers.inputs.keys import MISSING, parts_of, value_at
from walkers.inputs.origins import Source
from walkers.inputs.resolving.library import Composition, Library, LibraryNumber, unmeasured
from walkers.inputs.tables.case import CaseFile
from walkers.inputs.units import TEMPERATURE, parse_quantity
from walkers.physics.capillary import DEFAULT_LAW
from walkers.physics.mixtures import MIXTURES

NAMES = ("beads.material", "boundary.material", "liquid.name")
"""Keys whose values are names of the library."""
OF_LIQUIDS = (
    "liquid.surface_tension",
    "liquid.density",
    "liquid.kinematic_viscosity",
    "liquid.dynamic_viscosity",
)
"""Keys of a case that the library gives for a liquid."""
ROUGHNESS = ("contact.roughness.bead_bead", "contact.roughness.bead_wall")
"""Keys of the roughness of contacts, which follows from the materials of both surfaces."""
_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall")
"""Keys of sliding friction, which a surface pair gives: a number, or a table of `_LAW`."""
_LAW = {"at_rest": "friction", "rise": "friction_rise", "half_rise_velocity": "half_rise_velocity"}
"""Keys of a friction that grows with the velocity, with the numbers of a surface pair."""
_KEYS_OF_LAWS = (
    "contact.friction.bead_bead.at_rest",
    "contact.friction.bead_bead.rise",
    "contact.friction.bead_bead.half_rise_velocity",
    "contact.friction.bead_wall.at_rest",
    "contact.friction.bead_wall.rise",
    "contact.friction.bead_wall.half_rise_velocity",
)
"""Keys of the tables of both frictions."""
_OF_SURFACES = (
    "liquid.meniscus_radius",
    "liquid.volume_fraction",
    "liquid.edge_ratio",
    "liquid.contact_angle",
    "contact.rolling_friction",
    "contact.restitution",
)
"""Other keys that the pair of beads and boundary gives; it names them by their last parts."""
SUPPLIED = (
    "beads.density",
    *OF_LIQUIDS,
    *_FRICTION,
    *_KEYS_OF_LAWS,
    *ROUGHNESS,
    *_OF_SURFACES,
)
"""Keys that a case may leave out because the library has values or defaults."""
_WITHOUT_USUAL_VALUES = (*_KEYS_OF_LAWS, "liquid.edge_ratio")
"""Keys that only surface pairs give: a guess has the range of the calibration."""
_DESCRIBING_SURFACES = (*_FRICTION, "contact.rolling_friction")
"""Keys that describe surfaces completely."""
_DESCRIBING_LIQUID = (
    ("liquid.surface_tension", "liquid.dynamic_viscosity"),
    ("liquid.surface_tension", "liquid.density", "liquid.kinematic_viscosity"),
)
"""Groups of keys each of which describes a liquid completely."""
_MASS_FRACTION = "liquid.mass_fraction"
"""Key of the mass fraction of a liquid that is a mixture."""
_TEMPERATURE = "liquid.temperature"
"""Key of the temperature of such a liquid."""
_DEFAULT_TEMPERATURE = "20 degC"
"""Temperature of a liquid that is a mixture, if the case gives none."""


def supplied(
    document: Mapping[str, Any], library: Library
) -> tuple[dict[str, Any], dict[str, Source], list[Problem]]:
    """Fill in the values that a case leaves out and the library has.

    Parameters
    ----------
    document
        The tables of a case as they were written.
    library
        The library for the case.

    Returns
    -------
    tables : dict
        The tables with the missing values, without the library and the contents of meshes.
    sources : dict of str to Source
        Sources of the values that were filled in, by their keys.
    problems : list of Problem
        Names that the library does not know, wrong compositions of the liquid, and keys that are
        missing because of what the library has instead.
    """
    names = {key: _name_at(document, key) for key in NAMES}
    given = {key for key in SUPPLIED if value_at(document, parts_of(key)) is not MISSING}
    problems = _unknown_names(library, given, names)
    liquid = names["liquid.name"]
    known_liquid = liquid
    composition = None
    try:
        composition = _composition(document, liquid)
    except InputError as error:
        problems += error.problems
        known_liquid = None
    values = _values(
        library, names["beads.material"], names["boundary.material"], known_liquid, composition
    )
    # Calibrations used one law of the bridges: with another law their numbers are guesses.
    law = value_at(document, ("liquid", "law"))
    calibrated = liquid if law in (MISSING, DEFAULT_LAW) else None
    tables = {name: value for name, value in document.items() if name not in ("library", "meshes")}
    tables.setdefault("contact", {})
    sources: dict[str, Source] = {}
    if composition and value_at(document, parts_of(_TEMPERATURE)) is MISSING:
        sources[_TEMPERATURE] = Source("default", text=_DEFAULT_TEMPERATURE)
    written: dict[str, Any] = {}
    problems += _incomplete_tables(document, values)
    if "liquid.edge_ratio" not in given and "liquid.edge_ratio" not in values:
        problems += _edges_of_beads_alone(
            library, names["beads.material"], names["boundary.material"]
        )
    other_forms = _keys_of_other_forms(document, values)
    for key in SUPPLIED:
        if key in other_forms:
            continue
        has_table = isinstance(tables.get(key.split(".")[0]), Mapping)
        equivalent = {key, *alternatives(CaseFile, key)}
        if key not in values or not has_table or equivalent & {*given, *written}:
            continue
        written[key] = values[key].written
        sources[key] = _source_of(key, values[key], calibrated)
    return changed(CaseFile, tables, written), sources, problems


def _keys_of_other_forms(
    document: Mapping[str, Any], values: Mapping[str, LibraryNumber]
) -> set[str]:
    """Keys of friction that a case does not take: those of the table, or that of the number.

    A case takes the form in which it gives a friction, and else the one that the library has.
    ``values`` are as from `_values`.
    """
    not_taken: set[str] = set()
    for key in _FRICTION:
        written = value_at(document, parts_of(key))
        grows = isinstance(written, Mapping)
        if written is MISSING:
            grows = f"{key}.rise" in values
        if grows:
            not_taken.add(key)
        else:
            not_taken |= {f"{key}.{part}" for part in _LAW}
    return not_taken


def _incomplete_tables(
    document: Mapping[str, Any], values: Mapping[str, LibraryNumber]
) -> list[Problem]:
    """Missing keys of tables of friction where the library has a number.

    ``values`` are as from `_values`.
    """
    problems = []
    for key in _FRICTION:
        written = value_at(document, parts_of(key))
        if not isinstance(written, Mapping) or key not in values or f"{key}.rise" in values:
            continue
        number = values[key].written
        message = f"missing; without the table, {key} is the number {number}: "
        message += whole_table_of(CaseFile, key)
        for part in _LAW:
            if part not in written:
                problems.append(Problem(f"{key}.{part}", None, message))
    return problems


def _edges_of_beads_alone(
    library: Library, bead_material: str | None, boundary_material: str | None
) -> list[Problem]:
    """The problem of a factor for edges that two beads have, but beads and boundary do not."""
    edge_ratio = library.surface_pair(bead_material, bead_material).get("edge_ratio")
    if edge_ratio is None:
        return []
    message = (
        f"missing; the library has {edge_ratio.written} for {bead_material} on {bead_material}, "
        f"but one factor holds at all menisci, that of {bead_material} on {boundary_material}: "
        "give edge_ratio there or here"
    )
    return [Problem("liquid.edge_ratio", None, message)]


def _name_at(document: Mapping[str, Any], key: str) -> str | None:
    """The name at a key of a case; None if the case has no text there."""
    name = value_at(document, parts_of(key))
    return name if isinstance(name, str) else None


def _unknown_names(
    library: Library, given: set[str], names: Mapping[str, str | None]
) -> list[Problem]:
    """Names that are not in the library, of what the case does not describe completely itself.

    ``given`` has the keys that the case gives, ``names`` the names at the keys `NAMES`.
    """
    surfaces_described = given.issuperset(_DESCRIBING_SURFACES)
    described = {
        "beads.material": surfaces_described and "beads.density" in given,
        "boundary.material": surfaces_described,
        "liquid.name": any(given.issuperset(keys) for keys in _DESCRIBING_LIQUID),
    }
    problems = []
    for key, name in names.items():
        kind = "liquids" if key == "liquid.name" else "materials"
        names_in_library = library.names(kind)
        if name is None or described[key] or name in names_in_library:
            continue
        expected = f"nor in a library.toml beside the case; {expected_of(name, names_in_library)}"
        problems.append(Problem(key, quoted(name), f"not in the library, {expected}"))
    return problems


def _composition(document: Mapping[str, Any], liquid: str | None) -> Composition | None:
    """Mass fraction and temperature (K) of a liquid that is a mixture; None for other liquids.

    The temperature is 20 °C unless the document gives it.

    Raises
    ------
    InputError
        If the mass fraction is missing or is not a number from 0 to 1, if the temperature is not a
        temperature, or if a liquid that is no mixture has either of them.
    """
    mass_fraction = value_at(document, parts_of(_MASS_FRACTION))
    temperature = value_at(document, parts_of(_TEMPERATURE))
    if liquid not in MIXTURES:
        _check_no_composition({_MASS_FRACTION: mass_fraction, _TEMPERATURE: temperature})
        return None
    # Not isinstance: true and false are no numbers here.
    is_number = type(mass_fraction) in (int, float)
    if not is_number or not 0 <= mass_fraction <= 1:
        # All `MIXTURES` are of glycerol and water.
        message = "expected the mass of the glycerol over that of the mixture, such as 0.87"
        if mass_fraction is MISSING:
            message = f"missing; {message}"
        raise key_error(_MASS_FRACTION, message)
    text = str(temperature)
    if temperature is MISSING:
        text = _DEFAULT_TEMPERATURE
    try:
        return Composition(float(mass_fraction), parse_quantity(text, TEMPERATURE))
    except ValueError as error:
        raise key_error(_TEMPERATURE, str(error)) from error


def _check_no_composition(values: Mapping[str, Any]) -> None:
    """Refuse values, by their keys, that a liquid which is no mixture must not have."""
    # There is one mixture.
    message = f'expected none: it is for name = "{next(iter(MIXTURES))}"'
    superfluous = [key for key, value in values.items() if value is not MISSING]
    if superfluous:
        raise InputError("", [Problem(key, None, message) for key in superfluous])


@lru_cache(maxsize=1024)
def _values(
    library: Library,
    bead_material: str | None,
    boundary_material: str | None,
    liquid: str | None,
    composition: Composition | None,
) -> dict[str, LibraryNumber]:
    """Defaults, and numbers of the library for materials and a liquid, by the keys of a case."""
    between_beads = library.surface_pair(bead_material, bead_material)
    at_boundary = library.surface_pair(bead_material, boundary_material)
    numbers: dict[str, LibraryNumber | None] = {
        "beads.density": library.numbers("materials", bead_material or "").get("density"),
        "contact.friction.bead_bead": between_beads.get("friction"),
        "contact.friction.bead_wall": at_boundary.get("friction"),
        "contact.roughness.bead_bead": library.roughness(bead_material, bead_material),
        "contact.roughness.bead_wall": library.roughness(bead_material, boundary_material),
    }
    # A coefficient that was found with Coulomb's law is not the friction at rest of a growing one.
    for key, pair in zip(_FRICTION, (between_beads, at_boundary), strict=True):
        for part, name in _LAW.items():
            numbers[f"{key}.{part}"] = pair.get(name) if "friction_rise" in pair else None
    for key in _OF_SURFACES:
        numbers[key] = at_boundary.get(key.split(".")[1])
    for name, number in library.numbers("liquids", liquid or "", composition).items():
        numbers[f"liquid.{name}"] = number
    values = dict(unmeasured())
    # The amount of liquid is a volume or a meniscus. Only a surface pair of the library gives a
    # meniscus; the default is a volume.
    values.pop("liquid.meniscus_radius", None)
    return values | {key: number for key, number in numbers.items() if number is not None}


def _source_of(key: str, number: LibraryNumber, liquid: str | None) -> Source:
    """The source of a number of the library that a case takes.

    Parameters
    ----------
    key
        Key of the case.
    number
        The number.
    liquid
        The liquid of the case, with which numbers may be calibrated; None if they are not for the
        law of the case. A number that was calibrated with other liquids is a guess.
    """
    default = unmeasured().get(key)
    if key in _WITHOUT_USUAL_VALUES:
        default = number  # there is no usual value: a guess keeps the range of the library
    measured = bool(number.source) and not number.calibrated_with
    ends = number.range
    if default is None or measured:
        origin = number.origin
    elif liquid in number.calibrated_with:
        origin = "calibrated" if number.range else "assumed"
    else:
        origin = "default"
        ends = default.range
    return Source(
        origin=origin,
        why=number.source,
        text=str(number.written),
        range=ends,
        logarithmic=default is not None and default.logarithmic,
    )
