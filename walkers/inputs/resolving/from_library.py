"""Values of the library and defaults, filled in before the document of a case is validated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from walkers.errors import Problem, expected_of, quoted
from walkers.inputs.config_table import alternatives, changed
from walkers.inputs.keys import MISSING, parts_of, value_at
from walkers.inputs.origins import Source
from walkers.inputs.resolving.library import Library, LibraryNumber, unmeasured
from walkers.inputs.tables.case import CaseFile
from walkers.inputs.units import TEMPERATURE, parse_quantity
from walkers.physics.capillary import DEFAULT_LAW
from walkers.physics.mixtures import MIXTURES

NAMES = ("beads.material", "boundary.material", "liquid.name")
"""Keys whose values are names of the library."""
_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_SURFACES = (
    *("liquid.meniscus_radius", "liquid.volume_fraction", "liquid.contact_angle"),
    *("contact.rolling_friction", "contact.restitution"),
)
ROUGHNESS = ("contact.roughness.bead_bead", "contact.roughness.bead_wall")
_VISCOSITIES = ("liquid.kinematic_viscosity", "liquid.dynamic_viscosity")
OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", *_VISCOSITIES)
_LIQUIDS = ((OF_LIQUIDS[0], _VISCOSITIES[1]), OF_LIQUIDS[:3])
"""Keys that describe a liquid completely: surface tension, and dynamic viscosity or density and kinematic viscosity."""
SUPPLIED = ("beads.density", *OF_LIQUIDS, *_FRICTION[:2], *ROUGHNESS, *_OF_SURFACES)
"""Keys that a case may leave out because the library has values or defaults."""


def supplied(
    document: Mapping[str, Any], library: Library
) -> tuple[dict[str, Any], dict[str, Source], list[Problem]]:
    """The tables of a case with missing values from the library, their sources, and names that it does not know."""
    given = {key for key in SUPPLIED if value_at(document, parts_of(key)) is not MISSING}
    named = (value_at(document, parts_of(key)) for key in NAMES)
    bead, wall, liquid = (name if isinstance(name, str) else None for name in named)
    problems = _unknown(library, given, (bead, wall, liquid))
    mixture, sources, problem = _mixture(document, liquid)
    problems += problem
    values = _values(library, bead, wall, None if problem else liquid, mixture)
    # Calibrations used one law of the bridges: with another law their numbers are guesses.
    calibrated = liquid if value_at(document, ("liquid", "law")) in (MISSING, DEFAULT_LAW) else None
    tables = {name: value for name, value in document.items() if name not in ("library", "meshes")}
    tables.setdefault("contact", {})
    written: dict[str, Any] = {}
    for key in SUPPLIED:
        replaced = {key, *alternatives(CaseFile, key)} & {*given, *written}
        if key in values and not replaced and isinstance(tables.get(key.split(".")[0]), Mapping):
            written[key], sources[key] = (
                values[key].written,
                _source_of(key, values[key], calibrated),
            )
    return changed(CaseFile, tables, written), sources, problems


def _unknown(library: Library, given: set[str], names: Sequence[str | None]) -> list[Problem]:
    """Names that are not in the library and that the case does not describe completely itself."""
    described, problems = given.issuperset(_FRICTION), []
    complete = (
        described and "beads.density" in given,
        described,
        any(given.issuperset(keys) for keys in _LIQUIDS),
    )
    for key, name, says_all in zip(NAMES, names, complete, strict=True):
        kind = "liquids" if key == "liquid.name" else "materials"
        if name is not None and not says_all and name not in library.names(kind):
            expected = (
                f"nor in a library.toml beside the case; {expected_of(name, library.names(kind))}"
            )
            problems.append(Problem(key, quoted(name), f"not in the library, {expected}"))
    return problems


def _mixture(
    document: Mapping[str, Any], liquid: str | None
) -> tuple[tuple[float, float] | None, dict[str, Source], list[Problem]]:
    """Mass fraction and temperature (K) of a liquid whose numbers depend on them, with sources, or problems."""
    keys = ("liquid.mass_fraction", "liquid.temperature")
    share, temperature = (value_at(document, parts_of(key)) for key in keys)
    if liquid not in MIXTURES:
        extra = [
            key
            for key, value in zip(keys, (share, temperature), strict=True)
            if value is not MISSING
        ]
        message = f'expected none: it is for name = "{next(iter(MIXTURES))}"'
        return None, {}, [Problem(key, None, message) for key in extra]
    if type(share) not in (int, float) or not 0 <= share <= 1:
        missing = "missing; " if share is MISSING else ""
        message = (
            f"{missing}expected the mass of the glycerol over that of the mixture, such as 0.87"
        )
        return None, {}, [Problem(keys[0], None, message)]
    text = "20 degC" if temperature is MISSING else str(temperature)
    sources = {keys[1]: Source("default", text=text)} if temperature is MISSING else {}
    try:
        return (float(share), parse_quantity(text, TEMPERATURE)), sources, []
    except ValueError as error:
        return None, {}, [Problem(keys[1], None, str(error))]


@lru_cache(maxsize=1024)
def _values(
    library: Library,
    bead: str | None,
    wall: str | None,
    liquid: str | None,
    mixture: tuple[float, float] | None,
) -> dict[str, LibraryNumber]:
    """Defaults, and numbers of the library for materials and a liquid, by the keys of a case."""
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    of_liquid = library.numbers("liquids", liquid or "", mixture)
    values = {
        "beads.density": library.numbers("materials", bead or "").get("density"),
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{
            key: library.roughness(bead, material)
            for key, material in zip(ROUGHNESS, (bead, wall), strict=True)
        },
        **{key: on_wall.get(key.split(".")[1]) for key in _OF_SURFACES},
        **{f"liquid.{key}": number for key, number in of_liquid.items()},
    }
    # Of the two that give the liquid, the library's own is taken; without one it is a volume.
    usual = {key: number for key, number in unmeasured().items() if key != "liquid.meniscus_radius"}
    return usual | {key: number for key, number in values.items() if number}


def _source_of(key: str, entry: LibraryNumber, liquid: str | None) -> Source:
    """The source of a number of the library; a number that was calibrated with other liquids is a guess."""
    usual, text = unmeasured().get(key), str(entry.written)
    logarithmic = usual is not None and usual.logarithmic
    if usual is None or (entry.source and not entry.calibrated_with):
        return Source(entry.origin, entry.source, text, entry.range, logarithmic)
    if liquid in entry.calibrated_with:
        return Source(
            "calibrated" if entry.range else "assumed", entry.source, text, entry.range, logarithmic
        )
    return Source("default", entry.source, text, usual.range, logarithmic)
