"""Locks on run directories: a file beside each, locked while the run is made.

The lock is the kernel's (``flock``): it ends with the last process that has the file open, however that ends. Engines
inherit it, so that one which outlives its launcher keeps others away from the directory that it writes into. It does so
for moments only, for the kernel ends it with its launcher: whoever meets a lock waits that long.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

_LOOK_SECONDS = 0.01
_PATIENCE_SECONDS = 2.0
"""Before locks are taken for another's: engines whose launcher was killed end within a fraction of a second."""


def _lock_file(place: Path) -> Path:
    return place.with_name(f"{place.name}.lock")


@contextmanager
def locked(places: Iterable[Path]) -> Iterator[Mapping[Path, int]]:
    """Lock those of the places that nobody else has locked, two seconds later at the latest.

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
    end = time.monotonic() + _PATIENCE_SECONDS
    try:
        # In the order of their names, so that of two who want the same places one gets them rather than each a half.
        for place in sorted(set(places)):
            if (descriptor := _lock(_lock_file(place), end)) is not None:
                ours[place] = descriptor
        yield ours
    finally:
        for place, descriptor in ours.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


def _lock(file: Path, end: float) -> int | None:
    """Lock a file that others may be removing at this moment: the lock counts only on the file that has the name."""
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), file.stat()):
                    return descriptor
        except BlockingIOError:
            if time.monotonic() > end:
                os.close(descriptor)
                return None
            time.sleep(_LOOK_SECONDS)
        os.close(descriptor)


def is_locked(place: Path) -> bool:
    """Whether somebody is making the run whose place this is."""
    try:
        with _lock_file(place).open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False
