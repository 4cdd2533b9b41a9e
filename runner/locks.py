"""Locks on run directories: a file beside each, locked while the run is made.

The lock is the kernel's (``flock``): it ends with the last process that has the file open, however that ends. Engines
inherit it, so that one which outlives its launcher keeps others away from the directory that it writes into.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

_SUFFIX = ".lock"
_LOOK_SECONDS = 0.005


def _lock_file(place: Path) -> Path:
    return place.with_name(place.name + _SUFFIX)


@contextmanager
def locked(places: Iterable[Path]) -> Iterator[Mapping[Path, int]]:
    """Lock those of the places that nobody else has locked.

    Parameters
    ----------
    places
        Final places of run directories, in folders that exist.

    Yields
    ------
    Mapping
        From the places that are ours until the end of the block to the descriptors of their lock files.
    """
    ours: dict[Path, int] = {}
    try:
        # In the order of their names, so that of two who want the same places one gets them rather than each a half.
        for place in sorted(set(places)):
            descriptor = _lock(_lock_file(place))
            if descriptor is not None:
                ours[place] = descriptor
        yield ours
    finally:
        for place, descriptor in ours.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


def _lock(file: Path) -> int | None:
    """Lock a file that others may be removing at this moment: the lock counts only on the file that has the name."""
    patience = 1  # somebody who only looks (`is_locked`) is gone again by then
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(descriptor), file.stat()):
                return descriptor
        except BlockingIOError:
            if not patience:
                os.close(descriptor)
                return None
            patience -= 1
            time.sleep(_LOOK_SECONDS)
        except FileNotFoundError:
            pass
        os.close(descriptor)


def is_locked(place: Path) -> bool:
    """Whether somebody is making the run whose place this is."""
    try:
        descriptor = os.open(_lock_file(place), os.O_RDONLY)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False
