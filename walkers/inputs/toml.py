"""TOML files as users write them, and the files that they name."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from walkers.errors import input_error, key_error
from walkers.files import read_limited
from walkers.inputs.keys import parts_of, value_at

_MOST_BYTES = 16 << 20


def toml_bytes(tables: Mapping[str, Any]) -> bytes:
    """Tables as a TOML file; needs the extra that installs tomli-w."""
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; an `InputError` if it cannot be read, is no TOML, no regular file, or larger than 16 MB."""
    try:
        contents = read_limited(path, _MOST_BYTES)
    except ValueError as error:
        raise input_error(path, str(error)) from error
    except OSError as error:
        raise input_error(path, f"cannot be read: {error.strerror}") from error
    try:
        return tomllib.loads(contents.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        actual = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise input_error(path, f"expected UTF-8 text, found {actual}") from error
    except (
        ValueError,
        RecursionError,
    ) as error:  # TOML's own errors, integers of 5000 digits, brackets without end
        raise input_error(path, f"not TOML: {error}") from error


def with_files(
    document: Mapping[str, Any], folder: Path = Path(), values: Iterable[tuple[str, object]] = ()
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
    values = list(values)
    meshes = _unread(tables, "boundary.mesh", "meshes", values)
    if meshes:
        from walkers.inputs.meshes.mesh_file import read_mesh

        contents = _read("boundary.mesh", meshes, folder, read_mesh)
        tables["meshes"] = _contents(tables, "meshes") | contents
    records = _unread(tables, "drive.record", "records", values)
    if records:
        from walkers.inputs.records.record_file import read_record

        contents = _read("drive.record", records, folder, read_record)
        tables["records"] = _contents(tables, "records") | contents
    return tables


def _contents(tables: Mapping[str, Any], table: str) -> dict[str, Any]:
    """Contents of files that tables already have, by the names of the files."""
    contents = tables.get(table)
    return dict(contents) if isinstance(contents, Mapping) else {}


def _unread(
    tables: Mapping[str, Any],
    key: str,
    table: str,
    values: Sequence[tuple[str, object]],
) -> list[str]:
    """Names of files that a key has, or may have, and whose contents are not in a table yet."""
    named = [value_at(tables, parts_of(key))]
    named += [value for name, value in values if name == key]
    contents = _contents(tables, table)
    unread = (name for name in named if isinstance(name, str) and name not in contents)
    return list(dict.fromkeys(unread))


def _read(
    key: str,
    names: Iterable[str],
    folder: Path,
    read: Callable[[Path], Any],
) -> dict[str, Any]:
    """Contents of files in a folder by their names; an unusable file is a problem of the key."""
    contents: dict[str, Any] = {}
    for name in names:
        try:
            contents[name] = read(folder / name)
        except ValueError as error:
            raise key_error(key, str(error), name) from error
    return contents
