"""Open files for reading without ever waiting for them.

Whoever opens a FIFO for reading waits until somebody writes to it, and a device such as ``/dev/zero`` never ends. The
files of a run, of the cache and of an archive are regular files; anything else in their place is refused here.
"""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path


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
    """Contents of a regular file; `OSError` as by `open_regular`."""
    with open_regular(path) as file:
        return file.read()


def read_limited(path: Path, most_bytes: int) -> bytes:
    """Contents of a file that a user names, of at most so many bytes.

    Raises
    ------
    ValueError
        If it is no regular file, or larger; the message says which.
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
    if path.is_dir():
        return IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    return OSError(errno.EINVAL, "not a regular file", str(path))
