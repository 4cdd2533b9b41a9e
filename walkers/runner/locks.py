"""Locks on run directories: a file beside each, locked while the run is made.

The lock is the kernel's (``flock``): it ends with the last process that has the file open, however that ends. Engines
inherit it, so that one which outlives its launcher keeps others away from the directory that it writes into; it does so
for moments only, for the kernel ends it with its launcher. Who meets such a lock waits that long.
"""

from __future__ import annotations

import fcntl
import os
import platform
import re
import signal
import time
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

_SUFFIX = ".lock"
_LOOK_SECONDS = 0.005
_LOOKS = 6
"""Before a lock is taken for another's: by then somebody who only looks (`is_locked`) is gone again, and a process that
is being killed is seen to be."""
_PATIENCE_SECONDS = 10.0
"""How long the lock of an owner that has ended is waited for; its engines end within a fraction of a second."""
_SILENT_SECONDS = 0.5
_SIGNATURE_BYTES = 200
_EXITING = 0x4
"""PF_EXITING of the kernel's flags: the process is being torn down, and cannot be seen as a zombie yet."""


def _lock_file(place: Path) -> Path:
    return place.with_name(place.name + _SUFFIX)


@contextmanager
def locked(places: Iterable[Path]) -> Iterator[Mapping[Path, int]]:
    """Lock those of the places that nobody else has locked.

    A lock whose owner has ended is waited for, ten seconds in all: the owner's engines are just ending.

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
    patience = _Patience()
    try:
        # In the order of their names, so that of two who want the same places one gets them rather than each a half.
        for place in sorted(set(places)):
            descriptor = _lock(_lock_file(place), patience)
            if descriptor is not None:
                ours[place] = descriptor
        yield ours
    finally:
        for place, descriptor in ours.items():
            _lock_file(place).unlink(missing_ok=True)
            os.close(descriptor)


class OrphanLockWarning(UserWarning):
    """A run is still locked by what is left of a killed one."""


class _Patience:
    """How long locks of owners that have ended are waited for, all together."""

    def __init__(self) -> None:
        self.begin: float | None = None
        self.told = False

    def is_left(self, file: Path) -> bool:
        """Whether to wait on; says so once."""
        now = time.monotonic()
        if self.begin is None:
            self.begin = now
        if now - self.begin > _SILENT_SECONDS and not self.told:
            self.told = True
            message = f"waiting for what is left of a run that was killed ({file})"
            warnings.warn(message, OrphanLockWarning, stacklevel=6)
        return now - self.begin < _PATIENCE_SECONDS


def _lock(file: Path, patience: _Patience) -> int | None:
    """Lock a file that others may be removing at this moment: the lock counts only on the file that has the name."""
    looks = _LOOKS
    while True:
        descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(descriptor), file.stat()):
                _sign(descriptor)
                return descriptor
        except BlockingIOError:
            looks -= 1
            if looks <= 0 and not (_owner_has_ended(descriptor) and patience.is_left(file)):
                os.close(descriptor)
                return None
            time.sleep(_LOOK_SECONDS)
        except FileNotFoundError:
            pass
        os.close(descriptor)


def _sign(descriptor: int) -> None:
    """Say in a lock file who has it: machine, process, and when that began."""
    with suppress(OSError):  # a full disk: the lock is the kernel's and needs no room
        signature = f"{platform.node()} {os.getpid()} {_process(os.getpid()).begin}"
        os.pwrite(descriptor, signature.ljust(_SIGNATURE_BYTES).encode(), 0)  # at once, for somebody may be reading


def _owner_has_ended(descriptor: int) -> bool:
    """Whether the process that has a lock file is known to be none any more: only its engines keep the lock."""
    signature = os.pread(descriptor, _SIGNATURE_BYTES, 0).decode("utf-8", "replace").split()
    if len(signature) != 3 or signature[0] != platform.node():
        return False
    try:
        owner = _process(int(signature[1]))
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False
    return owner.is_ending or owner.begin != signature[2]  # a number that was given to another process since


@dataclass(frozen=True)
class _Process:
    """What the kernel says of a process: when it began (ticks since the boot), whether it is ending or has ended."""

    begin: str
    is_ending: bool


def _process(number: int) -> _Process:
    """A process, by ``/proc/PID/stat`` and ``status`` (proc(5))."""
    fields = Path(f"/proc/{number}/stat").read_text("utf-8", "replace").rpartition(") ")[2].split()
    state, flags, begin = fields[0], int(fields[6]), fields[19]
    pending = re.findall(r"^(?:SigPnd|ShdPnd):\s*(\w+)", Path(f"/proc/{number}/status").read_text(), re.MULTILINE)
    killed = any(int(one, 16) >> (signal.SIGKILL - 1) & 1 for one in pending)
    return _Process(begin, killed or bool(flags & _EXITING) or state in "ZX")


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
