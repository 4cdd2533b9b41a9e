"""Read and write files without waiting for them and without leaving parts of them.

Whoever opens a FIFO for reading waits until somebody writes to it, and a device such as
``/dev/zero`` never ends. The files of a run, of the cache and of an archive are regular files;
anything else in their place is refused here. Files are written under a temporary name and renamed:
readers see the old file or the new one, never a part.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import shutil
import stat
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path
from typing import Any

from walkers.errors import input_error


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file, or a link to one, for reading bytes.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    io.BufferedReader
        The open file. Close it, or use it in a ``with`` statement.

    Raises
    ------
    OSError
        If the file cannot be opened, or is a FIFO, a socket, a device or a folder.
    """
    # Without O_NONBLOCK, opening a FIFO waits for a writer. It changes nothing for regular files.
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        if error.errno == errno.ENXIO:  # a socket, or a device without a driver
            raise _not_regular(path) from error
        raise
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise _not_regular(path)
    return os.fdopen(descriptor, "rb")


def read_regular(path: Path) -> bytes:
    """Contents of a regular file; raises `OSError` as `open_regular` does."""
    with open_regular(path) as file:
        return file.read()


def read_limited(path: Path, most_bytes: int) -> bytes:
    """Contents of a file that a user names.

    Parameters
    ----------
    path
        The file.
    most_bytes
        Largest size of the file, bytes.

    Raises
    ------
    ValueError
        If it is not a regular file, or larger; the message tells which.
    OSError
        If it is a folder, or cannot be read.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise _not_regular(path)
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("is a pipe, a socket or a device; expected a file")
    if status.st_size > most_bytes:
        raise ValueError(f"expected a file of at most {most_bytes >> 20} MB")
    return read_regular(path)


def _not_regular(path: Path) -> OSError:
    """The error of a path that is not a regular file."""
    if path.is_dir():
        return IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    return OSError(errno.EINVAL, "not a regular file", str(path))


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it contains anything but a JSON object.
    """
    contents = read_regular(path)
    try:
        value = json.loads(contents)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no JSON ({error})") from error
    if not isinstance(value, dict):
        raise ValueError(f"{path}: expected a JSON object")
    return value


def write_json(path: Path, contents: Mapping[str, Any], *, sync: bool = True) -> None:
    """Write a JSON object.

    Parameters
    ----------
    path
        The file.
    contents
        The object.
    sync
        Whether to flush the file to disk; False if the whole directory is flushed later.
    """
    write_bytes(path, json_bytes(contents), sync=sync)


def json_bytes(contents: Mapping[str, Any]) -> bytes:
    """A JSON object in the format of all JSON files of the program."""
    return (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode("utf-8")


def write_bytes(path: Path, contents: bytes, *, sync: bool = True) -> None:
    """Write a file; ``sync`` is as in `write_json`."""
    with replacing(path) as new, new.open("wb") as file:
        file.write(contents)
        if sync:
            file.flush()
            os.fsync(file.fileno())


def checksum(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def link_or_copy(source: str | Path, to: str | Path) -> None:
    """Give a file a second path ``to``, by a hard link; copy it if the file system has no links."""
    try:
        os.link(source, to)
    except OSError:
        shutil.copyfile(source, to)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside a file for its new contents.

    At the end of the ``with`` block it is renamed to the file; if the block fails, it is removed.
    """
    # Several processes and threads may write the file at once. Writers of pictures and films need
    # its suffix.
    new = path.with_name(f".{path.stem}.{os.getpid()}-{threading.get_ident()}.new{path.suffix}")
    try:
        yield new
        new.replace(path)
    except BaseException as error:
        # Errors of a full disk name no file.
        if isinstance(error, OSError) and error.filename in (None, str(new)):
            error.filename = str(path)
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise


def make_folder(folder: Path) -> None:
    """Make a folder that is to contain runs, if it does not exist; `InputError` if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = (
            f"cannot create the folder ({error.strerror}): "
            "expected a folder in which files can be written"
        )
        raise input_error(folder, message) from error


# --- folders that are filled before they get their name -------------------------------------------

VTK_SCRATCH = ".vtk-"
"""Start of the names of the scratch folders of exports to VTK."""
CSV_SCRATCH = ".csv-"
"""Start of the names of the scratch folders of exports to CSV."""
SO_FAR_SCRATCH = ".so-far-"
"""Start of the names of the scratch folders with the complete part of an unfinished run."""
_FILLED = "new"
"""The only entry of a scratch folder: what is to be renamed."""
_FILLED_BEFORE = "vtk"
"""This entry in scratch folders of earlier versions."""


@contextmanager
def scratch_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Yield a new folder to be filled and renamed, and remove what is left of it at the end.

    It is in a folder ``parent/PREFIX…`` that is locked with ``flock``, so that others recognise
    what a process that was killed has left behind (`abandoned`); such folders in the same place are
    removed first.

    Parameters
    ----------
    parent
        A folder on the file system of the final place.
    prefix
        Start of the name of the locked folder.
    """
    for left in abandoned(parent, prefix):
        shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True) as name:
        descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY)
        try:
            with suppress(OSError):  # a file system without locks
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            new = Path(name, _FILLED)
            new.mkdir()
            yield new
        finally:
            os.close(descriptor)


def abandoned(parent: Path, prefix: str) -> list[Path]:
    """Folders of `scratch_folder` that no process fills any more."""
    folders = []
    for folder in sorted(parent.glob(f"{prefix}*")):
        if folder.is_symlink() or not folder.is_dir():
            continue
        names = [path.name for path in folder.iterdir()]
        if names not in ([_FILLED], [_FILLED_BEFORE]):
            continue  # a user's folder, or one that is just being made
        if not _is_in_use(folder):
            folders.append(folder)
    return folders


def _is_in_use(folder: Path) -> bool:
    """Whether a process holds the lock of a folder; True if the file system has no locks."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return False
        finally:
            os.close(descriptor)
    return True


def fsync_path(path: Path) -> None:
    """Flush a file, or the names in a directory, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
