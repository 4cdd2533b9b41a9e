"""TOML files as users write them, and the files that they name."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from walkers.errors import input_error, key_error
from walkers.files import read_limited
from walkers.inputs.keys import parts_of, value_at

_MOST_BYTES = 16 << 20
"""Largest size of a TOML file."""
FILE_KEYS = ("boundary.mesh", "drive.record")
"""Keys of a case whose values are names of files."""


def toml_bytes(tables: Mapping[str, Any]) -> bytes:
    """Tables as a TOML file; needs the extra that installs tomli-w."""
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, not a regular file, or larger than 16 MB.
    """
    try:
        contents = read_limited(path, _MOST_BYTES)
    except ValueError as error:
        raise input_error(path, str(error)) from error
    except OSError as error:
        raise input_error(path, f"cannot be read: {error.strerror}") from error
    try:
        return tomllib.loads(contents.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        byte = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise input_error(path, f"expected UTF-8 text, found {byte}") from error
    except (ValueError, RecursionError) as error:
        # Errors of TOML, but also integers of 5000 digits, and brackets that nest without end.
        raise input_error(path, f"not TOML: {error}") from error


def with_files(
    document: Mapping[str, Any],
    folder: Path = Path(),
    values: Iterable[tuple[str, object]] = (),
    keys: Collection[str] = FILE_KEYS,
) -> dict[str, Any]:
    """Add the contents of the files that a case names to its tables.

    Parameters
    ----------
    document
        The tables of a case.
    folder
        Where the files are.
    values
        Further keys and values that may name files, such as those of the axes of a sweep.
    keys
        The keys of the case itself whose files are read, of `FILE_KEYS`.

    Returns
    -------
    dict
        The tables; ``meshes`` and ``records`` have the contents of the files by their names.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    tables = dict(document)
    values_to_search = [(key, value_at(tables, parts_of(key))) for key in keys]
    values_to_search += values
    meshes = _unread(tables, "boundary.mesh", "meshes", values_to_search)
    if meshes:
        from walkers.inputs.meshes.mesh_file import read_mesh

        contents = _read("boundary.mesh", meshes, folder, read_mesh)
        tables["meshes"] = _contents(tables, "meshes") | contents
    records = _unread(tables, "drive.record", "records", values_to_search)
    if records:
        from walkers.inputs.records.record_file import read_record

        contents = _read("drive.record", records, folder, read_record)
        tables["records"] = _contents(tables, "records") | contents
    return tables


def _contents(tables: Mapping[str, Any], table: str) -> dict[str, Any]:
    """The contents of files that tables already have, by the names of the files."""
    contents = tables.get(table)
    return dict(contents) if isinstance(contents, Mapping) else {}


def _unread(
    tables: Mapping[str, Any],
    key: str,
    table: str,
    values: Sequence[tuple[str, object]],
) -> list[str]:
    """Names of files that a key has, or may have, and whose contents are not in a table yet.

    Parameters
    ----------
    tables
        The tables of a case.
    key
        The dotted key whose values are names of files.
    table
        The table that has the contents of such files.
    values
        Keys and their values.
    """
    candidates = [value for value_key, value in values if value_key == key]
    read = _contents(tables, table)
    unread: list[str] = []
    for name in candidates:
        if isinstance(name, str) and name not in read and name not in unread:
            unread.append(name)
    return unread


def _read(
    key: str,
    names: Iterable[str],
    folder: Path,
    read: Callable[[Path], Any],
) -> dict[str, Any]:
    """The contents of files in a folder, by name; an unusable file is a problem of the key."""
    contents: dict[str, Any] = {}
    for name in names:
        try:
            contents[name] = read(folder / name)
        except ValueError as error:
            raise key_error(key, str(error), name) from error
    return contents
