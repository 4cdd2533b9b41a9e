"""The engine's binary: where it is and what exactly it is."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from walkers.runner.failures import EngineMissing

ENGINE_VARIABLE = "WALKERS_ENGINE"
SOURCES = Path(str(files("walkers.engine")))
MODEL = ("bridge.cpp", "table.h")
"""Folder and files of the contact model that decks need (`walkers.runner.plugin`)."""
_BANNER = re.compile(rb"\(Version ([^,\n]+),")
_LIBRARY = re.compile(r"libliggghts\S* => (\S+)")


@dataclass(frozen=True)
class Engine:
    """A liggghts binary.

    Attributes
    ----------
    path
        The executable.
    sha256
        Of the executable, of the ``libliggghts`` that it loads, where it is a thin front, and of the sources of the
        contact model.
    """

    path: Path
    sha256: str


def find_engine(wanted: str | None = None) -> Engine:
    """Find the engine.

    Parameters
    ----------
    wanted
        A name or path; else the environment variable ``WALKERS_ENGINE``, else ``liggghts``.

    Raises
    ------
    EngineMissing
        If there is no such executable.
    """
    name = wanted or os.environ.get(ENGINE_VARIABLE) or "liggghts"
    found = shutil.which(name)
    if found is None:
        raise EngineMissing(name)
    path = Path(found).resolve()
    return Engine(path, _identity(path, path.stat().st_mtime_ns))


@lru_cache(maxsize=8)
def _identity(path: Path, _modified: int) -> str:
    digest = hashlib.sha256()
    for part in [*parts_of(path), *(SOURCES / name for name in MODEL)]:
        with part.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def parts_of(path: Path) -> tuple[Path, ...]:
    """An executable and the ``libliggghts`` that it loads: Debian's is a front of 18 kB."""
    listing = subprocess.run(["ldd", str(path)], capture_output=True, text=True, errors="replace", check=False).stdout
    return path, *(Path(match) for match in _LIBRARY.findall(listing))


def version_in(output: bytes) -> str | None:
    """The version that a banner in the engine's output names, such as ``LIGGGHTS-PUBLIC 3.8.0``; None without one."""
    match = _BANNER.search(output)
    return match.group(1).decode("utf-8", "replace").strip() if match else None
