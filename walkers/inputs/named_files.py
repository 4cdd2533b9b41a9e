"""Files that the keys of a case name: meshes and records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from walkers.errors import unusable
from walkers.inputs.keys import parts_of, value_at
from walkers.inputs.record import read_record


def _mesh(path: Path) -> dict[str, Any]:
    from walkers.inputs.vessel import read_mesh

    return read_mesh(path)


_FILES = {"boundary.mesh": ("meshes", _mesh), "drive.record": ("records", read_record)}
"""Keys that name files, the tables of their contents by these names, and their readers."""


def with_files(
    document: Mapping[str, Any], folder: Path = Path(), values: Iterable[tuple[str, object]] = ()
) -> dict[str, Any]:
    """The tables of a case with the contents of the files that they, or other values of keys, name in a folder.

    A case is whole without these files. Raises `InputError` if one cannot be read.
    """
    tables, values = dict(document), list(values)
    for key, (table, read) in _FILES.items():
        contents = dict(below) if isinstance(below := tables.get(table), Mapping) else {}
        named = (value_at(document, parts_of(key)), *(value for name, value in values if name == key))
        for file in dict.fromkeys(value for value in named if isinstance(value, str) and value not in contents):
            try:
                contents[file] = read(folder / file)
            except ValueError as error:
                raise unusable(key, str(error), file) from error
        tables |= {table: contents} if contents else {}
    return tables
