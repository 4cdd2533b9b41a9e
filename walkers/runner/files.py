"""Write files under a temporary name and rename them: readers see the old file or the new one, never a part."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from walkers.regular_files import open_regular, read_regular


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; raises `OSError` or `ValueError` if the file is unreadable or contains something else."""
    contents = read_regular(path)
    try:
        value = json.loads(contents)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no JSON ({error})") from error
    if not isinstance(value, dict):
        raise ValueError(f"{path}: expected a JSON object")
    return value


def write_json(path: Path, contents: Mapping[str, Any], *, at_once: bool = True) -> None:
    """Write a JSON object; ``at_once`` is False if the whole directory is flushed to disk later."""
    write_bytes(path, json_bytes(contents), at_once=at_once)


def json_bytes(contents: Mapping[str, Any]) -> bytes:
    """A JSON object in the format of all JSON files of the program."""
    return (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode("utf-8")


def write_bytes(path: Path, contents: bytes, *, at_once: bool = True) -> None:
    """Write a file; see `write_json`."""
    with beside(path) as new, new.open("wb") as file:
        file.write(contents)
        if at_once:
            file.flush()
            os.fsync(file.fileno())


def checksum(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def link_or_copy(source: str | Path, to: str | Path) -> None:
    """Link a file to a second place; copy it if the file system has no links."""
    try:
        os.link(source, to)
    except OSError:
        shutil.copyfile(source, to)


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside a file; it is renamed to the file at the end, or removed if the block fails."""
    # Several processes and threads may write it at once; writers of pictures and films need the suffix.
    new = path.with_name(f".{path.stem}.{os.getpid()}-{threading.get_ident()}.new{path.suffix}")
    try:
        yield new
        new.replace(path)
    except BaseException as error:
        if isinstance(error, OSError) and error.filename in (None, str(new)):  # errors of a full disk name no file
            error.filename = str(path)
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise


def fsync_path(path: Path) -> None:
    """Flush a file, or the names in a directory, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
