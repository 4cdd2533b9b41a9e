"""Names for cases and commands, with their origin: the text of ``walkers library``.

The pages of the reference that list these names are made from the same entries.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

from walkers.errors import input_error, suggestion
from walkers.inputs.reading import shipped
from walkers.inputs.resolving.library import HALF, Library, LibraryNumber, read_library, unmeasured
from walkers.inputs.toml import read_toml
from walkers.inputs.units import TEMPERATURE, quantity_text, with_symbols
from walkers.physics.laws import LAWS
from walkers.physics.mixtures import MIXTURES
from walkers.terminal import HEADING, fitted_lines, styled, table_width, wrapped
from walkers.text import aligned_with_text

_COLUMNS: Mapping[str, tuple[str, ...]] = {
    "materials": ("density", "youngs_modulus", "poissons_ratio", "roughness"),
    "liquids": ("density", "surface_tension", "viscosity"),
    "surface pairs": ("friction", "rolling_friction", "meniscus_radius"),
    "not measured": ("default",),
    "bridge laws": (),
    "cases": (),
    "sweeps": (),
    "calibrations": (),
}
"""Kinds of entries, in the order of the text, with the numbers in the columns of their tables."""
_HEADS = {"youngs_modulus": "Young's modulus", "poissons_ratio": "Poisson's ratio"}
"""Headings of columns that are not the name of the number."""
_VISCOSITIES = ("kinematic_viscosity", "dynamic_viscosity")
"""Numbers in the column ``viscosity``: a liquid has one of the two."""
COMMANDS = {"cases": "run", "sweeps": "sweep", "calibrations": "calibrate"}
"""For kinds of shipped files, the command that takes them."""
NOT_KNOWN = """\
The friction between other pairs of wet surfaces and the values below have not been measured. A
case that does not give them uses these defaults, and walkers run --spread varies them within these
ranges. Both are assumptions for hard, smooth, wetted surfaces, not for the materials of a case. One
contact angle holds at all bridges, between beads and at the boundary. For other surfaces, give a
value and its range in [uncertain]."""
"""What precedes the table of values that are not measured."""


@dataclass(frozen=True)
class Entry:
    """A name that a case or a command may have.

    Attributes
    ----------
    kind
        One of the kinds of names, such as ``materials`` or ``cases``.
    name
        The name.
    place
        The file that defines it; empty for those of the program.
    numbers
        Numbers of a material, a liquid, a pair of surfaces or a default.
    text
        Title of a file, summary of a law, or a note on a liquid.
    file
        A shipped file.
    """

    kind: str
    name: str
    place: str = ""
    numbers: Mapping[str, LibraryNumber] = field(default_factory=dict)
    text: str = ""
    file: str = ""


def catalogue() -> list[Entry]:
    """All names of the program, and of the library in the working directory.

    Raises
    ------
    InputError
        If that library cannot be used.
    """
    entries = list(_library_entries(Library(read_library(Path()))))
    for key, number in unmeasured().items():
        entries.append(Entry("not measured", key, numbers={"default": number}))
    entries += [Entry("bridge laws", name, text=_summary_of_law(name)) for name in LAWS]
    for kind in COMMANDS:
        for name, file in shipped(kind.removesuffix("s")).items():
            title = str(read_toml(file).get("title", ""))
            entries.append(Entry(kind, name, text=title, file=str(file)))
    return entries


def _summary_of_law(name: str) -> str:
    """The first line of the docstring of a law; the module is not imported, which is slow."""
    module = f"{name.replace('-', '_')}.py"
    source = resources.files("walkers.physics.laws").joinpath(module).read_text("utf-8")
    docstring = ast.get_docstring(ast.parse(source))
    return str(docstring).splitlines()[0]


def _library_entries(library: Library) -> Iterator[Entry]:
    """Materials, liquids and pairs of surfaces of a library."""
    for collection in library.collections:
        for name in collection.tables.get("materials", ()):
            yield Entry("materials", name, collection.place, library.numbers("materials", name))
        for name in collection.tables.get("liquids", ()):
            numbers = library.numbers("liquids", name)
            note = ""
            if name in MIXTURES:
                mass_fraction, temperature = HALF
                kelvins = quantity_text(temperature, TEMPERATURE)
                note = f"at mass_fraction = {mass_fraction}, {kelvins}"
            yield Entry("liquids", name, collection.place, numbers, note)
        for pair in collection.tables.get("surface_pairs", ()):
            first, second = pair["materials"]
            numbers = library.surface_pair(first, second)
            yield Entry("surface pairs", f"{first} on {second}", collection.place, numbers)


def catalogue_text(entries: Sequence[Entry]) -> str:
    """All names as tables; names of other files than the program's are marked."""
    blocks = []
    for kind in _COLUMNS:
        if kind == "not measured":
            blocks.append("\n".join(wrapped(NOT_KNOWN.replace("\n", " "))))
        entries_of_kind = [entry for entry in entries if entry.kind == kind]
        blocks.append(_table(kind, entries_of_kind))
    return "\n\n".join(blocks)


def _table(kind: str, entries: Sequence[Entry]) -> str:
    """A table of the entries of a kind, with their notes in the last column."""
    columns = _COLUMNS[kind]
    heads = [_HEADS.get(column, column.replace("_", " ")) for column in columns]
    rows = [[styled(head, HEADING) for head in (kind.capitalize(), *heads, "")]]
    for entry in entries:
        cells = [_cell(entry.numbers, column) for column in columns]
        note = entry.text
        if entry.place:
            note += f" [{entry.place}]"
        rows.append([f"  {entry.name}", *cells, note.strip()])
    return aligned_with_text(rows, table_width())


def _cell(numbers: Mapping[str, LibraryNumber], column: str) -> str:
    """The number of a column with its range; a dash if there is none."""
    names = _VISCOSITIES if column == "viscosity" else (column,)
    for name in names:
        if name in numbers:
            number = numbers[name]
            text = str(number.written)
            if number.range:
                low, high = number.range
                text += f" ({low} to {high})"
            return with_symbols(text)
    return "-"


def entry_text(entries: Sequence[Entry], name: str) -> str:
    """All entries of a name: numbers with sources, titles and files.

    Raises
    ------
    InputError
        If no entry has the name.
    """
    matching = [entry for entry in entries if entry.name.casefold() == name.casefold()]
    if not matching:
        near = suggestion(name, [entry.name for entry in entries])
        raise input_error(name, f"not in the library{near or '; walkers library lists it'}")
    first = matching[0]
    pairs = [entry for entry in entries if entry.kind == "surface pairs"]
    matching += [pair for pair in pairs if first.name in pair.name.split(" on ")]
    lines = []
    for entry in matching:
        lines += _entry_lines(entry)
    if first.kind == "materials":
        unknown = f"The friction of {first.name} on other wet surfaces is not measured"
        lines.append(f"{unknown}; see walkers library.")
    return "\n".join(lines)


def _entry_lines(entry: Entry) -> list[str]:
    """The name of an entry with its text and origin, how to use it, and its numbers."""
    heading = entry.name
    if entry.text:
        heading += f": {entry.text}"
    if entry.place:
        heading += f" [{entry.place}]"
    lines = [fitted_lines([heading])]
    if entry.file:
        lines.append(f"  {entry.file}")
    if entry.kind in COMMANDS:
        lines.append(f"  walkers {COMMANDS[entry.kind]} {entry.name}")
    rows = []
    for key, number in entry.numbers.items():
        rows.append([f"  {key}", _cell(entry.numbers, key), number.source])
    if rows:
        lines.append(aligned_with_text(rows, table_width()))
    return lines
