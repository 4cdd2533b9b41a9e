"""The library of materials, liquids and surface pairs, each number with its source.

A case names materials and liquids; this module gives their numbers, from the file
``library.toml`` of the program and from the user's own library. Which of them a case takes is
decided in `walkers.inputs.resolving.from_library`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
"""Name of the file of a user's own library, beside the case."""
_KINDS_OF_PROPERTIES = {
    "density": DENSITY,
    "surface_tension": SURFACE_TENSION,
    "dynamic_viscosity": DYNAMIC_VISCOSITY,
}
"""Kinds of quantity of the properties that are computed for mixtures of liquids."""
_IN_PROGRAM = "is in the library of the program; expected "
"""Start of a message about an entry that a user's own library must not repeat."""


class Composition(NamedTuple):
    """Mass fraction of the solute, and temperature (K), of a liquid that is a mixture."""

    mass_fraction: float
    temperature: float


HALF = Composition(mass_fraction=0.5, temperature=293.15)
"""Equal masses at 20 °C: the composition for which a mixture is listed if no other is given."""


@dataclass(frozen=True)
class LibraryNumber:
    """A number of the library.

    Attributes
    ----------
    written
        The number as a case would write it, such as ``"4.0 g/cm3"``.
    source
        Where it is from; empty if it has no source.
    range
        Both ends between which it can lie, written as the number; 5 to 95 % of the posterior if
        it is calibrated. None if it is not uncertain.
    calibrated_with
        Names of the liquids of the experiments with which it was calibrated; empty if it was not.
    origin
        The library that it is from.
    logarithmic
        Whether draws from the range are uniform in the logarithm.
    """

    written: Any
    source: str = ""
    range: tuple[Any, Any] | None = None
    calibrated_with: tuple[str, ...] = ()
    origin: SourceKind = "library"
    logarithmic: bool = False


@dataclass(frozen=True)
class Collection:
    """Tables of materials, liquids and surface pairs from one file.

    Attributes
    ----------
    origin
        ``library`` for the tables of the program, or ``own library``.
    place
        Path of the file; empty for the tables of the program.
    tables
        The tables ``materials``, ``liquids`` and ``surface_pairs``.
    """

    origin: SourceKind
    place: str
    tables: Mapping[str, Any]


class Library:
    """The materials, liquids and surface pairs that a case can name.

    Parameters
    ----------
    own_tables
        The tables of the user's own library, and its path at the key ``file``; they come before
        those of the program. None or empty for the library of the program alone.
    """

    def __init__(self, own_tables: Mapping[str, Any] | None = None) -> None:
        self.collections: list[Collection] = []
        if own_tables:
            file = own_tables.get("file", "")
            self.collections.append(Collection("own library", file, own_tables))
        self.collections.append(Collection("library", "", _tables_of_program()))

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of the ``materials`` or of the ``liquids``, each once."""
        names: dict[str, None] = {}
        for collection in self.collections:
            names.update(dict.fromkeys(collection.tables.get(kind, ())))
        return tuple(names)

    def numbers(
        self, kind: str, name: str, composition: Composition | None = None
    ) -> Mapping[str, LibraryNumber]:
        """The numbers of a material or liquid by their keys.

        Parameters
        ----------
        kind
            ``materials`` or ``liquids``.
        name
            Name of the material or liquid.
        composition
            Composition of a liquid whose numbers depend on it; `HALF` if None. Other liquids and
            materials ignore it.

        Returns
        -------
        mapping of str to LibraryNumber
            Empty if the library does not know the name.
        """
        for collection in self.collections:
            entries = collection.tables.get(kind, {}).get(name)
            if not entries:
                continue
            computed = _properties_of_mixture(name, composition or HALF)
            numbers = {}
            for key, entry in entries.items():
                # Entries of mixtures have a source but no value: these values are computed. A value
                # that is written in the file comes before a computed one.
                numbers[key] = _number({"value": computed.get(key), **entry}, collection)
            return numbers
        return {}

    def surface_pair(self, first: str | None, second: str | None) -> Mapping[str, LibraryNumber]:
        """Contact parameters of wet surfaces of two materials, in either order.

        Returns
        -------
        mapping of str to LibraryNumber
            ``friction``, ``contact_angle``, …; empty if the library does not know the pair.
        """
        materials = sorted([first or "", second or ""])
        for collection in self.collections:
            for pair in collection.tables.get("surface_pairs", ()):
                if sorted(pair["materials"]) == materials:
                    return _numbers_of_pair(pair, collection)
        return {}

    def roughness(self, first: str | None, second: str | None) -> LibraryNumber | None:
        """Roughness of the contact of two materials: the root of the sum of both squares.

        Returns
        -------
        LibraryNumber or None
            In nanometres, to three digits, with the range between the roots for both lower and
            both upper ends, if one of them has a range. None if the roughness of a material is
            unknown.
        """
        first_number = self.numbers("materials", first or "").get("roughness")
        second_number = self.numbers("materials", second or "").get("roughness")
        if first_number is None or second_number is None:
            return None
        ends = None
        if first_number.range or second_number.range:
            first_low, first_high = first_number.range or [first_number.written] * 2
            second_low, second_high = second_number.range or [second_number.written] * 2
            lowest = _root_of_squares(first_low, second_low)
            highest = _root_of_squares(first_high, second_high)
            ends = (lowest, highest)
        sources = dict.fromkeys(
            [f"{first}: {first_number.source}", f"{second}: {second_number.source}"]
        )
        # The contact is from the user's own library if one of its materials is.
        template = first_number
        if first_number.origin == "library" and second_number.origin != "library":
            template = second_number
        return replace(
            template,
            written=_root_of_squares(first_number.written, second_number.written),
            range=ends,
            source="; ".join(sources),
        )


def _properties_of_mixture(name: str, composition: Composition) -> dict[str, str]:
    """Computed properties of a mixture, with four digits and unit; empty for other liquids."""
    if name not in MIXTURES:
        return {}
    texts = {}
    for key, value in MIXTURES[name](*composition).items():
        texts[key] = quantity_text(float(f"{value:.4g}"), _KINDS_OF_PROPERTIES[key])
    return texts


def _numbers_of_pair(pair: Mapping[str, Any], collection: Collection) -> dict[str, LibraryNumber]:
    """The numbers of the table of a surface pair, by their keys."""
    liquids = tuple(pair.get("calibrated_with", ()))
    numbers = {}
    for key, entry in pair.items():
        if isinstance(entry, Mapping):  # not the names of the materials and liquids
            numbers[key] = _number(entry, collection, liquids)
    return numbers


def _root_of_squares(first: str, second: str) -> str:
    """The root of the sum of the squares of two lengths, in nanometres with three digits."""
    square = parse_quantity(first, LENGTH) ** 2 + parse_quantity(second, LENGTH) ** 2
    rounded = float(f"{1e9 * sqrt(square):.3g}")
    return f"{rounded:g} nm"


@cache
def _tables_of_program() -> dict[str, Any]:
    """The tables of the library of the program."""
    file = resources.files("walkers.inputs").joinpath("library.toml")
    return tomllib.loads(file.read_text("utf-8"))


def _number(
    entry: Mapping[str, Any], collection: Collection, liquids: tuple[str, ...] = ()
) -> LibraryNumber:
    """The number of an entry such as ``{ value = …, source = "…" }``.

    ``liquids`` are the names of the liquids with which it was calibrated, if it was.
    """
    source = entry.get("source", "")
    if "source" not in entry and liquids:
        source = f"calibrated with {' and '.join(liquids)}"
    ends = entry.get("range")
    return LibraryNumber(
        written=entry["value"],
        source=", ".join(text for text in (collection.place, source) if text),
        range=tuple(ends) if ends else None,
        calibrated_with=liquids,
        origin=collection.origin,
        logarithmic=entry.get("log", False),
    )


def check_library(tables: object, source: str) -> None:
    """Check the tables of a user's own library.

    Parameters
    ----------
    tables
        What the file or the case says.
    source
        Name of the file, for messages.

    Raises
    ------
    InputError
        With all keys at fault: names or pairs that the library of the program has, pairs that are
        given twice, and pairs of unknown materials.
    """
    from walkers.inputs.resolving.library_file import LibraryFile

    if not isinstance(tables, Mapping):
        raise input_error(
            source, "expected the tables of a library: materials, liquids, surface_pairs"
        )
    validated(LibraryFile, tables, source, "a library")
    problems = [*_repeated_names(tables), *_problems_of_pairs(tables)]
    if problems:
        raise InputError(source, problems)


def _repeated_names(tables: Mapping[str, Any]) -> Iterator[Problem]:
    """Problems of materials and liquids that the library of the program has."""
    for kind in ("materials", "liquids"):
        for name in tables.get(kind, ()):
            if name in _tables_of_program()[kind]:
                yield Problem(f"{kind}.{name}", None, f"{_IN_PROGRAM}another name")


def _problems_of_pairs(tables: Mapping[str, Any]) -> Iterator[Problem]:
    """Problems of surface pairs: given before, or of materials that no library has."""
    materials = Library(tables).names("materials")
    pairs_of_program = [sorted(pair["materials"]) for pair in _tables_of_program()["surface_pairs"]]
    earlier_pairs = list(pairs_of_program)
    for number, table in enumerate(tables.get("surface_pairs", ())):
        key = f"surface_pairs[{number}]"
        pair = sorted(table["materials"])
        words = " on ".join(table["materials"])
        if pair in pairs_of_program:
            yield Problem(key, words, f"{_IN_PROGRAM}its numbers in the case instead")
        elif pair in earlier_pairs:
            yield Problem(key, words, "is given twice; expected one table")
        earlier_pairs.append(pair)
        yield from _unknown_materials(f"{key}.materials", pair, materials)


def _unknown_materials(
    key: str, pair: Sequence[str], materials: Sequence[str]
) -> Iterator[Problem]:
    """Problems of materials of a pair that are not in the library, in alphabetical order."""
    for name in sorted(set(pair).difference(materials)):
        yield Problem(key, quoted(name), f"not in the library; {expected_of(name, materials)}")


def library_of(document: Mapping[str, Any], source: str = "") -> Library:
    """The library for a case.

    Parameters
    ----------
    document
        The tables of the case; the user's own library is at the key ``library``.
    source
        Name of the case file, for messages.

    Raises
    ------
    InputError
        If the tables at ``library`` are not those of a library.
    """
    own_tables = document.get("library")
    if own_tables is None:
        return _library_of_program()
    tables = own_tables
    if isinstance(own_tables, Mapping):
        # `read_library` puts the name of the file beside the tables.
        tables = {name: table for name, table in own_tables.items() if name != "file"}
    try:
        check_library(tables, source)
    except InputError as error:
        problems = [replace(problem, key=f"library.{problem.key}") for problem in error.problems]
        raise InputError(source, problems) from error
    return Library(own_tables)


@cache
def _library_of_program() -> Library:
    """The library of the program alone; one object, so that what is computed of it is cached."""
    return Library()


def read_library(folder: Path) -> dict[str, Any]:
    """The tables of the user's own library in a folder, and its path at ``file``.

    They are empty if the folder has no library.

    Raises
    ------
    InputError
        If the file cannot be read, or is not a library.
    """
    path = folder / FILE_NAME
    if not path.is_file():
        return {}
    tables = read_toml(path)
    check_library(tables, str(path))
    return {"file": str(path), **tables}


@cache
def unmeasured() -> Mapping[str, LibraryNumber]:
    """Defaults and ranges of the unmeasured values that a case may leave out, by keys of a case."""
    program = Collection("library", "", {})
    entries = _tables_of_program()["unmeasured"]
    return {key: _number(entry, program) for key, entry in entries.items()}
