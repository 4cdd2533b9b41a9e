"""The engine: finding its binary, and what identifies it."""

from __future__ import annotations

import hashlib
import mmap
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from walkers.errors import check_text_or_path
from walkers.files import checksum
from walkers.runner.failures import AUDITED_VERSION, EngineMissing, OtherEngine
from walkers.runner.model_sources import forces_version_line

ENGINE_VARIABLE = "WALKERS_ENGINE"
"""Variable of the environment with the name or path of the engine."""
_BANNER = re.compile(rb"\(Version ([^,\n]+),")
"""The version in the engine's output."""
_VERSION = re.compile(rb"LIGGGHTS[\w-]* [\d.]+(?=, compiled)")
"""The version in the engine's binary."""
_LIBRARY = re.compile(r"libliggghts\S* => (\S+)")
"""The path of the engine's library in the output of ``ldd``."""


@dataclass(frozen=True)
class Engine:
    """A liggghts binary.

    Attributes
    ----------
    path
        Path of the executable.
    sha256
        SHA-256 of the executable, of its library and of the version of the contact model.
    """

    path: Path
    sha256: str


def find_engine(name_or_path: str | None = None) -> Engine:
    """Find the engine.

    Parameters
    ----------
    name_or_path
        Name or path of the binary; None: the environment variable ``WALKERS_ENGINE``, or
        ``liggghts`` if it is not set.

    Raises
    ------
    EngineMissing
        If there is no such executable.
    InputError
        If the name is not text.
    """
    if name_or_path is not None:
        check_text_or_path("engine", name_or_path, "the name or path of a liggghts binary")
    name = name_or_path or os.environ.get(ENGINE_VARIABLE) or "liggghts"
    executable = shutil.which(name)
    if executable is None:
        advice = "install it with: sudo apt-get install liggghts"
        raise EngineMissing(
            f"no engine: {name} is not an executable file on this machine; {advice}"
        )
    path = Path(executable).resolve()
    digest = hashlib.sha256()
    for part in _parts_of(path, path.stat().st_mtime_ns):
        status = part.stat()
        digest.update(bytes.fromhex(_sha256(part, status.st_mtime_ns, status.st_size)))
    digest.update(forces_version_line())
    return Engine(path, digest.hexdigest())


@lru_cache(maxsize=64)
def _sha256(path: Path, _modified: int, _size: int) -> str:
    """SHA-256 of a file, computed once for each time of modification and size."""
    return checksum(path)


@lru_cache(maxsize=8)
def _parts_of(path: Path, _modified: int) -> tuple[Path, ...]:
    """An executable and the ``libliggghts`` that it loads.

    Debian's executable is only a launcher of 18 kB.
    """
    listing = subprocess.run(
        ["ldd", str(path)], capture_output=True, text=True, errors="replace", check=False
    ).stdout
    libraries = [Path(match) for match in _LIBRARY.findall(listing)]
    return (path, *libraries)


def version_in(output: bytes) -> str | None:
    """The version in the banner of the engine's output; None without a banner.

    Examples
    --------
    >>> version_in(b"LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled 2024-01-01)")
    'LIGGGHTS-PUBLIC 3.8.0'
    """
    match = _BANNER.search(output)
    return match.group(1).decode("utf-8", "replace").strip() if match else None


@lru_cache(maxsize=8)
def check_version(engine: Engine) -> None:
    """Raise `OtherEngine` if a binary contains another version than the audited one.

    If it contains none, the version in its output is checked later.
    """
    for part in _parts_of(engine.path, engine.path.stat().st_mtime_ns):
        version = _version_in_binary(part)
        if version is not None and version != AUDITED_VERSION:
            raise OtherEngine(engine.path, version)


def _version_in_binary(path: Path) -> str | None:
    """The version that a binary contains; None if it contains none."""
    with (
        path.open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as contents,
    ):
        match = _VERSION.search(contents)
        return match[0].decode() if match else None
