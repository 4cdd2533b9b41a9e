"""Names for cases and commands, with their origin; ``walkers library`` and the documentation list them."""

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
from walkers.inputs.units import TEMPERATURE, quantity_text
from walkers.physics.laws import LAWS
from walkers.physics.mixtures import MIXTURES
from walkers.text import aligned

_COLUMNS: Mapping[str, tuple[str, ...]] = {
    "materials": ("density", "youngs_modulus", "poissons_ratio", "roughness"),
    "liquids": ("density", "surface_tension", "viscosity"),
    "surface pairs": ("friction", "rolling_friction", "meniscus_radius"),
    "not measured": ("default",),
    **dict.fromkeys(("bridge laws", "cases", "sweeps", "calibrations"), ()),
}
_HEADS = {"youngs_modulus": "Young's modulus", "poissons_ratio": "Poisson's ratio"}
COMMANDS = {"cases": "run", "sweeps": "sweep", "calibrations": "calibrate"}
NOT_KNOWN = """\
The friction between other pairs of wet surfaces and the values below have not been measured. A case that does not give
them uses these defaults, and walkers run --spread varies them within these ranges. Both are assumptions for hard,
smooth, wetted surfaces, not for the materials of a case. One contact angle holds at all bridges, between
beads and at the boundary. For other surfaces, give a value and its range in [uncertain]."""


@dataclass(frozen=True)
class Entry:
    """A name of a kind, with its numbers, or title and file; ``place``: its file, if not of the program."""

    kind: str
    name: str
    place: str = ""
    numbers: Mapping[str, LibraryNumber] = field(default_factory=dict)
    text: str = ""
    file: str = ""


def catalogue() -> list[Entry]:
    """All names: of the program, and of the library in the working directory; `InputError` if that cannot be used."""
    entries = list(_of_library(Library(read_library(Path()))))
    entries += [
        Entry("not measured", key, numbers={"default": number})
        for key, number in unmeasured().items()
    ]
    for name in LAWS:
        module = f"{name.replace('-', '_')}.py"
        source = resources.files("walkers.physics.laws").joinpath(module).read_text("utf-8")
        summary = str(ast.get_docstring(ast.parse(source))).splitlines()[
            0
        ]  # without its imports, which are slow
        entries.append(Entry("bridge laws", name, text=summary))
    for kind in COMMANDS:
        files = shipped(kind[:-1]).items()
        entries += [
            Entry(kind, name, "", {}, str(read_toml(file).get("title", "")), str(file))
            for name, file in files
        ]
    return entries


def _of_library(library: Library) -> Iterator[Entry]:
    for collection in library.collections:
        for name in collection.tables.get("materials", ()):
            yield Entry("materials", name, collection.place, library.numbers("materials", name))
        for name in collection.tables.get("liquids", ()):
            note = (
                f"at mass_fraction = {HALF[0]}, {quantity_text(HALF[1], TEMPERATURE)}"
                if name in MIXTURES
                else ""
            )
            yield Entry("liquids", name, collection.place, library.numbers("liquids", name), note)
        for pair in collection.tables.get("surface_pairs", ()):
            first, second = pair["materials"]
            yield Entry(
                "surface pairs",
                f"{first} on {second}",
                collection.place,
                library.surface_pair(first, second),
            )


def catalogue_text(entries: Sequence[Entry]) -> str:
    """All names as tables; names of other files are marked."""
    lines = []
    for kind, columns in _COLUMNS.items():
        if kind == "not measured":
            lines += ["", NOT_KNOWN]
        rows = [
            [
                kind.capitalize(),
                *(_HEADS.get(column, column.replace("_", " ")) for column in columns),
                "",
            ]
        ]
        for entry in entries:
            if entry.kind == kind:
                note = f"{entry.text} [{entry.place}]" if entry.place else entry.text
                rows.append(
                    [
                        f"  {entry.name}",
                        *(_cell(entry.numbers, column) for column in columns),
                        note.strip(),
                    ]
                )
        lines += ["", aligned(rows)]
    return "\n".join(lines[1:])


def _cell(numbers: Mapping[str, LibraryNumber], column: str) -> str:
    """A number with its range; of ``viscosity`` whichever of the two there is."""
    keys = ("kinematic_viscosity", "dynamic_viscosity") if column == "viscosity" else (column,)
    number = next((numbers[key] for key in keys if key in numbers), None)
    if number is None:
        return "-"
    ends = f" ({number.range[0]} to {number.range[1]})" if number.range else ""
    return f"{number.written}{ends}"


def describe_one(entries: Sequence[Entry], name: str) -> str:
    """All entries of a name: numbers with sources, titles and files; `InputError` if there is none."""
    matching = [entry for entry in entries if entry.name.casefold() == name.casefold()]
    if not matching:
        near = suggestion(name, (entry.name for entry in entries))
        raise input_error(name, f"not in the library{near or '; walkers library lists it'}")
    # A material, and the pairs that it is part of.
    pairs = [entry for entry in entries if entry.kind == "surface pairs"]
    matching += [pair for pair in pairs if matching[0].name in pair.name.split(" on ")]
    lines = []
    for entry in matching:
        lines.append(
            ": ".join(filter(None, (entry.name, entry.text)))
            + (f" [{entry.place}]" if entry.place else "")
        )
        if entry.kind in COMMANDS:
            lines += [
                f"  {entry.file}" * bool(entry.file),
                f"  walkers {COMMANDS[entry.kind]} {entry.name}",
            ]
        width = max(map(len, entry.numbers), default=0)
        lines += [
            f"  {key:{width}}  {_cell(entry.numbers, key):28}  {number.source}".rstrip()
            for key, number in entry.numbers.items()
        ]
    if matching[0].kind == "materials":
        lines.append(
            f"The friction of {matching[0].name} on other wet surfaces is not measured; see walkers library."
        )
    return "\n".join(filter(None, lines))
