"""TOML files as users write them, and the files that they name."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from walkers.errors import refused, unusable
from walkers.files import read_limited
from walkers.inputs.keys import parts_of, value_at

_MOST_BYTES = 16 << 20
_FILES = {
    "boundary.mesh": ("meshes", "meshes.mesh_file", "read_mesh"),
    "drive.record": ("records", "records.record_file", "read_record"),
}
"""Keys that name files, the tables of their contents by these names, and their readers."""


def toml_bytes(tables: Mapping[str, Any]) -> bytes:
    """Tables as a TOML file; needs the extra that installs tomli-w."""
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; an `InputError` if it cannot be read, is no TOML, no regular file, or larger than 16 MB."""
    try:
        contents = read_limited(path, _MOST_BYTES)
    except ValueError as error:
        raise refused(path, str(error)) from error
    except OSError as error:
        raise refused(path, f"cannot be read: {error.strerror}") from error
    try:
        return tomllib.loads(contents.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        actual = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise refused(path, f"expected UTF-8 text, found {actual}") from error
    except (ValueError, RecursionError) as error:  # TOML's own errors, integers of 5000 digits, brackets without end
        raise refused(path, f"not TOML: {error}") from error


def with_files(
    document: Mapping[str, Any], folder: Path = Path(), values: Iterable[tuple[str, object]] = ()
) -> dict[str, Any]:
    """Tables of a case with the contents of the files in a folder that they name, or further values of keys."""
    tables, values = dict(document), list(values)
    for key, (table, module, reader) in _FILES.items():
        contents = dict(below) if isinstance(below := tables.get(table), Mapping) else {}
        named = (value_at(document, parts_of(key)), *(value for name, value in values if name == key))
        for file in dict.fromkeys(value for value in named if isinstance(value, str) and value not in contents):
            try:
                contents[file] = getattr(import_module(f"walkers.inputs.{module}"), reader)(folder / file)
            except ValueError as error:
                raise unusable(key, str(error), file) from error
        tables |= {table: contents} if contents else {}
    return tables
