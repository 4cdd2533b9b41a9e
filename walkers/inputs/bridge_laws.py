"""Laws of liquid bridges by the names that a case gives them: built-in laws and laws of users.

A built-in law has a name of `walkers.physics.laws.LAWS`. A user's law is named
``path/to/file.py:function``. It is checked whenever it is evaluated (`walkers.inputs.user_law`).
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.physics.laws import LAWS, built_in
from walkers.warning import warn_user

if TYPE_CHECKING:  # numpy is not needed to find a law by name
    from walkers.physics.bridge import BridgeLaw


class ExecutedLawWarning(UserWarning):
    """The program executes the file of a user's bridge law."""


def by_name(name: str) -> BridgeLaw:
    """Find a law by name: one of `LAWS`, or ``path/to/file.py:function``.

    The path starts at the working directory. A file is executed again only after it has changed.

    Raises
    ------
    ValueError
        If there is no law of this name, or its file cannot be executed.
    """
    file = source_of(name)
    if file is None:
        return built_in(name)
    return _of_user(name, file, source_sha256(name))


def source_of(name: str) -> Path | None:
    """The file of a user's law, which need not exist; None for a built-in law.

    Raises
    ------
    ValueError
        If the name is neither that of a built-in law nor of the form ``file.py:function``.
    """
    if name in LAWS:
        return None
    place, _, function = name.rpartition(":")
    if not place.endswith(".py") or not function or not name.isprintable():
        expected = f"one of {', '.join(LAWS)}, or file.py:function"
        raise ValueError(f"bridge law {name!r}: expected {expected}")
    return Path(place).resolve()


def source_sha256(name: str) -> str | None:
    """SHA-256 of the file of a user's law, which is not executed; None for a built-in law.

    Raises
    ------
    ValueError
        If there is no law of this name, or its file cannot be read.
    """
    file = source_of(name)
    if file is None:
        return None
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise ValueError(f"bridge law {name!r}: {file} cannot be read: {error.strerror}") from error


@lru_cache(maxsize=64)
def _of_user(name: str, file: Path, sha256: str | None) -> BridgeLaw:
    """The law in a user's file; the digest of its contents is there for the cache alone."""
    from walkers.inputs.user_law import load_law

    del sha256
    if not file.is_relative_to(Path(__file__).parents[1]):
        message = f"executes {file}, the bridge law of the case"
        warn_user(message, ExecutedLawWarning)
    return load_law(name, file)
