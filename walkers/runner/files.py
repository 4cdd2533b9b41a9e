"""Files written beside their place and renamed: readers see the old file or the new one, never a part."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; `OSError`, `ValueError` if the file cannot be read, or holds something else."""
    contents = path.read_bytes()
    try:
        found = json.loads(contents)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no JSON ({error})") from error
    if not isinstance(found, dict):
        raise ValueError(f"{path}: expected a JSON object")
    return found


def write_json(path: Path, contents: Mapping[str, Any], *, at_once: bool = True) -> None:
    """Write a JSON object; not at once if the directory is put on the disk later, as a whole (`settle`)."""
    write_bytes(path, json_bytes(contents), at_once=at_once)


def json_bytes(contents: Mapping[str, Any]) -> bytes:
    """A JSON object as our files have it."""
    return (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode("utf-8")


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


def link_or_copy(source: str | Path, to: str | Path) -> None:
    """The same file in two places; a copy where the file system has no links."""
    try:
        os.link(source, to)
    except OSError:
        shutil.copyfile(source, to)


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
