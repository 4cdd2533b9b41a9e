"""Files written beside their place and renamed: readers see the old file or the new one, never a part."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

LARGEST_TEXT = 64 << 20
"""Bytes: more than any JSON file or list of checksums has that the program wrote, but for the RO-Crates of some 4,000
runs. Files come from strangers too, and are read whole."""

_MOST_BRACKETS = 2_000_000
"""Of a JSON text: each opens what takes a hundred bytes, and 64 MB of them took 1.7 GB."""


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, is larger than `LARGEST_TEXT`, or holds something else.
    """
    with path.open("rb") as file:
        return json_object(str(path), read_text(str(path), file))


def read_text(name: str, file: IO[bytes]) -> str:
    """Read a text of at most `LARGEST_TEXT` from an open file; ``name`` is for the message."""
    contents = file.read(LARGEST_TEXT + 1)
    if len(contents) > LARGEST_TEXT:
        raise ValueError(f"{name}: expected at most {LARGEST_TEXT >> 20} MB")
    try:
        return contents.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{name}: no UTF-8 ({error})") from error


def json_object(name: str, text: str) -> dict[str, Any]:
    """The JSON object that a text is; ``name`` is for the message."""
    if text.count("[") + text.count("{") > _MOST_BRACKETS:
        raise ValueError(f"{name}: expected at most {_MOST_BRACKETS} lists and tables")
    try:
        contents = json.loads(text)
    except RecursionError as error:
        raise ValueError(f"{name}: nested too deeply") from error
    except ValueError as error:
        raise ValueError(f"{name}: no JSON ({error})") from error
    if not isinstance(contents, dict):
        raise ValueError(f"{name}: expected a JSON object")
    return contents


def write_json(path: Path, contents: Mapping[str, Any], *, at_once: bool = True) -> None:
    """Write a JSON object; not at once if the directory is put on the disk later, as a whole (`settle`)."""
    write_bytes(path, (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode("utf-8"), at_once=at_once)


def settle() -> None:
    """Put all that was written on the disk, so that a directory's new name outlives a loss of power."""
    os.sync()  # in a hundredth of the time that its files take one by one


def fsync_path(path: Path) -> None:
    """Put a file, or the names in a directory, on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, contents: bytes, *, at_once: bool = True) -> None:
    """Write a file; see `write_json`."""
    with beside(path) as new, new.open("wb") as file:
        file.write(contents)
        if at_once:
            file.flush()
            os.fsync(file.fileno())


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """Yield a name beside a file's to write it under; it gets its own at the end, or goes if the block fails."""
    # Several may write it at once; what writes pictures and films goes by the suffix.
    new = path.with_name(f".{path.stem}.{os.getpid()}.new{path.suffix}")
    try:
        yield new
        new.replace(path)
    except BaseException as error:
        if isinstance(error, OSError) and error.filename in (None, str(new)):  # a disk that is full does not say which
            error.filename = str(path)
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise
