"""Laws of liquid bridges by name: built-in laws and laws of users.

A law is a function `Surfaces → Curve` (`walkers.physics.bridge`). A built-in law is the function ``law`` of a file in
this folder, with its equation and source, and has the name of the file. A user's law is named
``path/to/file.py:function``. It is checked whenever it is evaluated (`walkers.physics.user_law`).
"""

from __future__ import annotations

import hashlib
import warnings
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # numpy is not needed to find a law by name
    from walkers.physics.bridge import BridgeLaw

LAWS = tuple(module.name.replace("_", "-") for module in iter_modules(__path__))
"""Names of the built-in laws."""


class ExecutedLawWarning(UserWarning):
    """The program executes the file of a user's bridge law."""


def by_name(name: str) -> BridgeLaw:
    """Find a law by name: one of `LAWS`, or ``file.py:function``, a path from the working directory.

    A file is executed again only after it has changed. Raises `ValueError` if there is no law with this name, or its
    file cannot be executed.
    """
    if (file := source_of(name)) is None:
        law: BridgeLaw = import_module(f"{__name__}.{name.replace('-', '_')}").law
        return law
    return _of_user(name, file, source_sha256(name))


def source_of(name: str) -> Path | None:
    """The file of a user's law; None for a built-in law; errors as of `by_name`."""
    if name in LAWS:
        return None
    place, _, function = name.rpartition(":")
    if not place.endswith(".py") or not function or not name.isprintable():
        raise ValueError(f"bridge law {name!r}: expected one of {', '.join(LAWS)}, or file.py:function")
    return Path(place).resolve()


def source_sha256(name: str) -> str | None:
    """SHA-256 of the file of a user's law; None for a built-in law; errors as of `by_name`. Nothing is executed."""
    if (file := source_of(name)) is None:
        return None
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise ValueError(f"bridge law {name!r}: {file} cannot be read: {error.strerror}") from error


@lru_cache(maxsize=64)
def _of_user(name: str, file: Path, sha256: str | None) -> BridgeLaw:
    """A user's law with this content (``sha256``) of its file."""
    from walkers.physics.user_law import loaded

    del sha256
    if not file.is_relative_to(Path(__file__).parents[2]):
        warnings.warn(f"executes {file}, the bridge law of the case", ExecutedLawWarning, stacklevel=3)
    return loaded(name, file)
