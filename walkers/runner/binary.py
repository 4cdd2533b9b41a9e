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

from walkers.files import checksum
from walkers.runner.failures import AUDITED_VERSION, EngineMissing, OtherEngine
from walkers.runner.model_sources import forces_version_line

ENGINE_VARIABLE = "WALKERS_ENGINE"
"""Variable of the environment with the name or path of the engine."""
_BANNER = re.compile(rb"\(Version ([^,\n]+),")
_VERSION = re.compile(rb"LIGGGHTS[\w-]* [\d.]+(?=, compiled)")
_LIBRARY = re.compile(r"libliggghts\S* => (\S+)")


@dataclass(frozen=True)
class Engine:
    """A liggghts binary: its path, and the SHA-256 of it, of its library and of the version of the contact model."""

    path: Path
    sha256: str


def find_engine(name_or_path: str | None = None) -> Engine:
    """Find the engine by a name or path, else by the environment variable ``WALKERS_ENGINE``, else ``liggghts``."""
    name = name_or_path or os.environ.get(ENGINE_VARIABLE) or "liggghts"
    if (executable := shutil.which(name)) is None:
        text = "is not an executable file on this machine; install it with: sudo apt-get install liggghts"
        raise EngineMissing(f"no engine: {name} {text}")
    path, digest = Path(executable).resolve(), hashlib.sha256()
    for part in _parts_of(path, path.stat().st_mtime_ns):
        about = part.stat()
        digest.update(bytes.fromhex(_sha256(part, about.st_mtime_ns, about.st_size)))
    digest.update(forces_version_line())
    return Engine(path, digest.hexdigest())


@lru_cache(maxsize=64)
def _sha256(path: Path, _modified: int, _size: int) -> str:
    return checksum(path)


@lru_cache(maxsize=8)
def _parts_of(path: Path, _modified: int) -> tuple[Path, ...]:
    """An executable and the ``libliggghts`` that it loads (Debian's executable is only a launcher of 18 kB)."""
    listing = subprocess.run(
        ["ldd", str(path)], capture_output=True, text=True, errors="replace", check=False
    ).stdout
    return path, *(Path(match) for match in _LIBRARY.findall(listing))


def version_in(output: bytes) -> str | None:
    """The version in the banner of the engine's output, such as ``LIGGGHTS-PUBLIC 3.8.0``; None without a banner."""
    match = _BANNER.search(output)
    return match.group(1).decode("utf-8", "replace").strip() if match else None


@lru_cache(maxsize=8)
def check_version(engine: Engine) -> None:
    """Refuse a binary that contains another version; if it contains none, the banner is checked later."""
    for part in _parts_of(engine.path, engine.path.stat().st_mtime_ns):
        with (
            part.open("rb") as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as contents,
        ):
            version = match[0].decode() if (match := _VERSION.search(contents)) else AUDITED_VERSION
        if version != AUDITED_VERSION:
            raise OtherEngine(engine.path, version)
