"""The program's folder in the user's cache, and numbers there that take long to compute.

The cache also contains the compiled contact model, and audits: whether an engine agrees with the
second engine. What the cache contains is executed (the model) or believed (numbers, audits).
Therefore only contents are used that nobody but the user and root can have written. A cache that
others can write is closed, and all of its contents are forgotten.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np
import numpy.typing as npt
from platformdirs import user_cache_path

from walkers.files import read_regular

_NOWHERE = Path("/proc/no-home")
"""A folder that nobody can make."""
_CHECKSUM_BYTES = 32
"""Length of the checksum before the numbers in a file."""
_securing = threading.Lock()
"""Held while contents are forgotten, so that no thread writes what another one removes."""


class ForeignCacheError(PermissionError):
    """The folder of the cache belongs to another user."""


def cache_folder() -> Path:
    """Path of the folder, without symbolic links; it may not exist, or be impossible to make."""
    try:
        return user_cache_path("granular-walkers").resolve()
    except RuntimeError:
        # Neither XDG_CACHE_HOME nor HOME is set, and the system does not know the user.
        return _NOWHERE


def make_cache_folder(name: str = "") -> Path:
    """Make the folder of the cache, or a folder in it, which only the user and root can write.

    A new folder is also closed to reading by others. A folder in the cache that others could have
    written is removed and made anew (`secure_cache` does the same with the whole cache).

    Parameters
    ----------
    name
        Name of a folder within the cache; empty: the folder of the cache itself.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OSError
        If the folder cannot be made or secured (`secure_cache`), or is a link to nothing.
    """
    secure_cache()
    folder = cache_folder()
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not name:
        return folder
    inner = folder / name
    with _securing:
        if inner.is_symlink() and not inner.exists():
            target = inner.readlink()
            raise OSError(f"{inner} is a link to {target}, which does not exist: remove the link")
        if os.path.lexists(inner) and not _is_safe_folder(inner):
            _forget(inner)
    inner.mkdir(mode=0o700, exist_ok=True)
    return inner


# --- trust ----------------------------------------------------------------------------------------


def secure_cache() -> None:
    """Close the cache to other users, and forget all of its contents if others could write them.

    Raises
    ------
    ForeignCacheError
        If the cache belongs to another user.
    OSError
        If the cache cannot be closed.
    """
    folder = cache_folder()
    with _securing:
        if not folder.exists() or is_safe(folder):
            return
        if folder.stat().st_uid != os.geteuid():
            raise ForeignCacheError(f"{folder} belongs to another user")
        folder.chmod(0o700)
        for path in folder.iterdir():
            _forget(path)


def is_safe(path: Path) -> bool:
    """Whether only the user and root can write a file or a folder, which is not a symbolic link."""
    status = path.lstat()
    is_link = stat.S_ISLNK(status.st_mode)
    others_can_write = bool(status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
    return _is_ours(status) and not is_link and not others_can_write


def is_trusted(path: Path) -> bool:
    """Whether a file of the cache exists and only the user or root can have written it."""
    try:
        return is_safe(cache_folder()) and _is_safe_folder(path.parent) and is_safe(path)
    except OSError:
        return False


def _is_safe_folder(folder: Path) -> bool:
    """Whether a folder is safe; it may be a link of the user's own to a safe folder."""
    return _is_ours(folder.lstat()) and is_safe(folder.resolve())


def _is_ours(status: os.stat_result) -> bool:
    """Whether a file belongs to the user or to root."""
    return status.st_uid in (0, os.geteuid())


def _forget(path: Path) -> None:
    """Remove a file, a link or a folder of the cache, or at least its name."""
    if path.is_symlink() or not path.is_dir():
        path.unlink(missing_ok=True)
        return
    shutil.rmtree(path, ignore_errors=True)
    if path.exists():  # files of another user, in a folder of that user
        path.rename(tempfile.mkdtemp(prefix="forgotten-", dir=path.parent))


# --- numbers --------------------------------------------------------------------------------------


def place_of_numbers(kind: str, key: bytes) -> Path:
    """Path of numbers in the cache; the file need not exist.

    Parameters
    ----------
    kind
        Name of a folder in the cache.
    key
        All from which the numbers follow.
    """
    return cache_folder() / kind / f"{sha256(key).hexdigest()[:24]}.bin"


def cached_numbers(
    place: Path, compute: Callable[[], npt.NDArray[np.float64]]
) -> npt.NDArray[np.float64]:
    """Numbers from the cache; if it has none, they are computed and kept there.

    Parameters
    ----------
    place
        Path of the numbers (`place_of_numbers`).
    compute
        Computes the numbers; called if the place has none, if they are damaged, or if another user
        can have written them.

    Returns
    -------
    ndarray, shape (n,)
        The numbers.
    """
    if is_trusted(place):
        with suppress(OSError):
            contents = read_regular(place)
            numbers_read = contents[_CHECKSUM_BYTES:]
            if contents[:_CHECKSUM_BYTES] == _checksum(place, numbers_read):
                return np.frombuffer(numbers_read)
    numbers = compute()
    with suppress(OSError):  # renamed, because other processes may write it too
        make_cache_folder(place.parent.name)
        with tempfile.NamedTemporaryFile(dir=place.parent, suffix=".part", delete=False) as file:
            file.write(_checksum(place, numbers.tobytes()) + numbers.tobytes())
        Path(file.name).replace(place)
    return numbers


def _checksum(place: Path, numbers: bytes) -> bytes:
    """SHA-256 of numbers and of the name of their file."""
    return sha256(place.stem.encode() + numbers).digest()
