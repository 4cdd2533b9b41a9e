"""The library of materials, liquids and surface pairs (``library.toml``), each number with its source."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib import resources
from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple

from walkers.errors import InputError, Problem, expected_of, input_error, quoted
from walkers.inputs.messages import validated
from walkers.inputs.origins import SourceKind
from walkers.inputs.toml import read_toml
from walkers.inputs.units import (
    DENSITY,
    DYNAMIC_VISCOSITY,
    LENGTH,
    SURFACE_TENSION,
    parse_quantity,
    quantity_text,
)
from walkers.physics.mixtures import MIXTURES

FILE_NAME = "library.toml"
HALF = (0.5, 293.15)
_OF_MIXTURES = {
    "density": DENSITY,
    "surface_tension": SURFACE_TENSION,
    "dynamic_viscosity": DYNAMIC_VISCOSITY,
}


class LibraryNumber(NamedTuple):
    """A number as a case would write it; the ``range`` of a calibrated one has 5 to 95 % of the posterior."""

    written: Any
    source: str = ""
    range: tuple[Any, Any] | None = None
    calibrated_with: tuple[
        str, ...
    ] = ()  # names of the liquids of the experiments; empty: not calibrated
    origin: SourceKind = "library"
    logarithmic: bool = False


class Collection(NamedTuple):
    """Tables of materials, liquids and surface pairs, and the file that they are from."""

    origin: SourceKind
    place: str
    tables: Mapping[str, Any]


class Library:
    """The materials, liquids and surface pairs that a case can name: of the user's own library, and of the program."""

    def __init__(self, users: Mapping[str, Any] | None = None) -> None:
        own_library = [Collection("own library", users.get("file", ""), users)] if users else []
        self.collections = [*own_library, Collection("library", "", _contents())]

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of the ``materials`` or of the ``liquids``."""
        return tuple(
            dict.fromkeys(
                name for collection in self.collections for name in collection.tables.get(kind, ())
            )
        )

    def numbers(
        self, kind: str, name: str, mixture: tuple[float, float] | None = None
    ) -> Mapping[str, LibraryNumber]:
        """Numbers of a material or liquid; ``mixture``: mass fraction and temperature (K), if they depend on them."""
        for collection in self.collections:
            if numbers := collection.tables.get(kind, {}).get(name):
                computed = MIXTURES[name](*mixture or HALF) if name in MIXTURES else {}
                texts = {
                    key: quantity_text(float(f"{computed[key]:.4g}"), _OF_MIXTURES[key])
                    for key in computed
                }
                return {
                    key: _number({"value": texts.get(key), **entry}, collection)
                    for key, entry in numbers.items()
                }
        return {}

    def surface_pair(self, first: str | None, second: str | None) -> Mapping[str, LibraryNumber]:
        """Contact parameters of two wet surfaces (``friction``, ``contact_angle``, …); empty if there are none."""
        for collection in self.collections:
            for pair in collection.tables.get("surface_pairs", ()):
                if sorted(pair["materials"]) == sorted([first or "", second or ""]):
                    liquids = tuple(pair.get("calibrated_with", ()))
                    numbers = {
                        key: entry for key, entry in pair.items() if isinstance(entry, Mapping)
                    }
                    return {
                        key: _number(entry, collection, liquids) for key, entry in numbers.items()
                    }
        return {}

    def roughness(self, first: str | None, second: str | None) -> LibraryNumber | None:
        """Roughness of the contact of two materials, the root of the sum of both squares; None if one is unknown."""
        materials = [
            (name, self.numbers("materials", name or "").get("roughness"))
            for name in (first, second)
        ]
        entries = [(name, entry) for name, entry in materials if entry is not None]
        if len(entries) < 2:
            return None
        parts = zip(
            *((entry.written, *(entry.range or (entry.written,) * 2)) for _, entry in entries),
            strict=True,
        )
        squares = [sum(parse_quantity(text, LENGTH) ** 2 for text in pair) for pair in parts]
        value, *ends = (f"{float(f'{1e9 * sqrt(square):.3g}'):g} nm" for square in squares)
        sources = dict.fromkeys(f"{name}: {entry.source}" for name, entry in entries)
        number = max((entry for _, entry in entries), key=lambda entry: entry.origin != "library")
        return number._replace(written=value, range=(ends[0], ends[1]), source="; ".join(sources))


@cache
def _contents() -> dict[str, Any]:
    return tomllib.loads(
        resources.files("walkers.inputs").joinpath("library.toml").read_text("utf-8")
    )


def _number(
    table: Mapping[str, Any], of: Collection, liquids: tuple[str, ...] = ()
) -> LibraryNumber:
    source = table.get("source", f"calibrated with {' and '.join(liquids)}" if liquids else "")
    place, ends = ", ".join(filter(None, (of.place, source))), table.get("range")
    return LibraryNumber(
        table["value"], place, ends and tuple(ends), liquids, of.origin, table.get("log", False)
    )


def check_library(tables: object, source: str) -> None:
    """Check a library: raises `InputError` with ``source`` and the keys at fault."""
    from walkers.inputs.resolving.library_file import LibraryFile

    if not isinstance(tables, Mapping):
        raise input_error(
            source, "expected the tables of a library: materials, liquids, surface_pairs"
        )
    validated(LibraryFile, tables, source, "a library")
    shipped, text = _contents(), "is in the library of the program; expected "
    kinds = ("materials", "liquids")
    again = [
        f"{kind}.{name}" for kind in kinds for name in tables.get(kind, ()) if name in shipped[kind]
    ]
    problems = [Problem(key, None, f"{text}another name") for key in again]
    materials = Library(tables).names("materials")
    pairs = [sorted(pair["materials"]) for pair in shipped["surface_pairs"]]
    given = list(pairs)
    for number, names in enumerate(pair["materials"] for pair in tables.get("surface_pairs", ())):
        key, pair = f"surface_pairs[{number}]", sorted(names)
        if pair in given:
            why = (
                f"{text}its numbers in the case instead"
                if pair in pairs
                else "is given twice; expected one table"
            )
            problems.append(Problem(key, " on ".join(names), why))
        given.append(pair)
        for name in sorted({*names}.difference(materials)):
            why = f"not in the library; {expected_of(name, materials)}"
            problems.append(Problem(f"{key}.materials", quoted(name), why))
    if problems:
        raise InputError(source, problems)


def library_of(document: Mapping[str, Any], source: str = "") -> Library:
    """The library for a case, by its tables; raises `InputError` if its own is none."""
    users = document.get("library")
    if users is None:
        return _shipped()
    # `read_library` puts the name of its file beside its tables.
    tables = (
        {name: table for name, table in users.items() if name != "file"}
        if isinstance(users, Mapping)
        else users
    )
    try:
        check_library(tables, source)
    except InputError as error:
        problems = [replace(problem, key=f"library.{problem.key}") for problem in error.problems]
        raise InputError(source, problems) from error
    return Library(users)


@cache
def _shipped() -> Library:
    return Library()


def read_library(folder: Path) -> dict[str, Any]:
    """The user's own library in a folder; empty if there is none."""
    if not (path := folder / FILE_NAME).is_file():
        return {}
    tables = read_toml(path)
    check_library(tables, str(path))
    return {"file": str(path), **tables}


@cache
def unmeasured() -> Mapping[str, LibraryNumber]:
    """Defaults and ranges of the unmeasured values that a case may leave out, by keys of a case."""
    program = Collection("library", "", {})
    return {key: _number(entry, program) for key, entry in _contents()["unmeasured"].items()}
