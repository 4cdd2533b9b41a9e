"""The program's folder in the user's cache, and numbers that are kept there because they take long to compute."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np
import numpy.typing as npt
from platformdirs import user_cache_path

_NOWHERE = Path("/proc/no-home")  # a folder that nobody can make


def cache_folder() -> Path:
    """Path of the folder, without symbolic links; it may not exist, or be impossible to make."""
    try:
        return user_cache_path("granular-walkers").resolve()
    except RuntimeError:  # neither XDG_CACHE_HOME nor HOME, and a user whom the system does not know
        return _NOWHERE


def make_cache_folder(name: str = "") -> Path:
    """Make the folder, which nobody but the user can enter, or a folder in it; `OSError` if that is not possible."""
    folder = cache_folder()
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    (folder / name).mkdir(exist_ok=True)
    return folder / name


def place_of_numbers(kind: str, key: bytes) -> Path:
    """Path of the numbers of a kind that follow from ``key``; there may be none yet."""
    return cache_folder() / kind / f"{sha256(key).hexdigest()[:24]}.bin"


def kept_numbers(place: Path, compute: Callable[[], npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
    """The numbers at a place of the cache, shape (n,); they are computed if there are none, or others than written."""
    with suppress(OSError):
        contents = place.read_bytes()
        if contents[:32] == _checksum(place, contents[32:]):
            return np.frombuffer(contents[32:])
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
