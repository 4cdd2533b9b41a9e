"""The contact model of decks, a shared library that the engine loads: compiled where it is first needed, then kept.

The engine's binary interface is that of its very package: headers and compiler options are taken from this machine, and
only the version that the model was written for is served. A library is kept in the user's cache under a name that tells
of the engine, of the sources and of the options.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from platformdirs import user_cache_path

from walkers.runner.binary import Engine, version_in
from walkers.runner.failures import ContactModelMissing, EngineFailure, OtherEngine
from walkers.templates.engine import ALONE, AUDITED_VERSION

PACKAGES = ("g++", "libliggghts-dev", "libopenmpi-dev")
HEADERS = Path("/usr/include/liggghts")
# Plain -O2 keeps the numbers the same on all machines of an architecture: no fused operations, no reordering.
OPTIONS = ("-shared", "-fPIC", "-std=gnu++11", "-O2", "-DNDEBUG", "-DOMPI_SKIP_MPICXX", "-Wall", "-Wextra")
_SOURCES = ("bridge.cpp", "table.h", "bridge.map")


def plugin_of(engine: Engine) -> Path:
    """The contact model for an engine, compiled if it never was.

    Raises
    ------
    OtherEngine
        If the engine is another version than the one that the model was written for.
    ContactModelMissing
        If it cannot be compiled: what is missing, or what the compiler says.
    """
    name = hashlib.sha256("\0".join((engine.sha256, sources_sha256(), *OPTIONS)).encode()).hexdigest()[:16]
    place = user_cache_path("granular-walkers") / f"bridge-{name}.so"
    if set(str(place)) & set(": "):
        raise ContactModelMissing(f"{place} has a space or a colon, which the system's loader takes for a separator")
    if not place.is_file():
        _check_version(engine)
        _compile(place)
    return place


@lru_cache(maxsize=1)
def sources_sha256() -> str:
    """SHA-256 of the model's sources, which runs are named by."""
    digest = hashlib.sha256()
    for name in _SOURCES:
        digest.update((_folder() / name).read_bytes())
    return digest.hexdigest()


def _folder() -> Path:
    return Path(str(files("walkers.engine")))


def _check_version(engine: Engine) -> None:
    environment = {**os.environ, **ALONE}
    try:
        done = subprocess.run(
            [str(engine.path), "-log", "none"], input=b"", capture_output=True, env=environment, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ContactModelMissing(f"{engine.path} does not tell its version ({error})") from error
    if (version := version_in(done.stdout)) != AUDITED_VERSION:
        raise OtherEngine(engine.path, version)


def _compile(place: Path) -> None:
    compiler, mpi = shutil.which("g++"), shutil.which("mpicxx")
    if compiler is None or mpi is None or not HEADERS.is_dir():
        raise ContactModelMissing(f"it is compiled once; install what that needs: apt-get install {' '.join(PACKAGES)}")
    asked = subprocess.run([mpi, "--showme:incdirs"], capture_output=True, text=True, check=False)
    included = [option for folder in (str(HEADERS), *asked.stdout.split()) for option in ("-isystem", folder)]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=place.parent) as folder:
            made = Path(folder) / place.name
            linked = [f"-Wl,--version-script={_folder() / 'bridge.map'}", "-Wl,-Bsymbolic", "-l:libliggghts.so.3"]
            done = subprocess.run(
                [compiler, *OPTIONS, *included, f"-I{_folder()}", str(_folder() / "bridge.cpp"), "-o", str(made), *linked],
                capture_output=True, text=True, errors="replace", check=False,
            )  # fmt: skip
            if done.returncode:
                raise ContactModelMissing(f"the compiler says: {(done.stderr.strip().splitlines() or ['nothing'])[0]}")
            made.replace(place)
    except OSError as error:
        raise ContactModelMissing(f"{place} cannot be written ({error})") from error


def main() -> None:
    """Compile the model for the engine that is installed: ``make setup``."""
    from walkers.runner.binary import find_engine

    try:
        plugin_of(find_engine())
    except EngineFailure as failure:
        raise SystemExit(f"walkers: {failure}") from failure


if __name__ == "__main__":
    main()
