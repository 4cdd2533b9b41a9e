"""The contact model of decks, a shared library that the engine loads: compiled where it is first needed, then kept.

The engine's binary interface is that of its very package: headers and library are those of this machine, and only the
version that the model was written for is served. What was compiled is kept in the user's cache.
"""

from __future__ import annotations

import hashlib
import mmap
import re
import shlex
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

from platformdirs import user_cache_path

from walkers.runner.binary import MODEL, SOURCES, Engine, parts_of
from walkers.runner.failures import ContactModelMissing, EngineFailure, OtherEngine
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME
from walkers.templates.engine import AUDITED_VERSION

PACKAGES = ("g++", "libliggghts-dev", "libopenmpi-dev")
HEADERS = Path("/usr/include/liggghts")
_VERSION = re.compile(rb"LIGGGHTS[\w-]* [\d.]+(?=, compiled)")
# Without -march the numbers are the same on all machines of an architecture: no fused operations. -O3 does not reorder.
OPTIONS = (
    "-shared",
    "-fPIC",
    "-std=gnu++11",
    "-O3",
    "-fno-math-errno",
    "-DNDEBUG",
    "-DOMPI_SKIP_MPICXX",
    "-Wall",
    "-Wextra",
)


def plugin_of(engine: Engine) -> Path:
    """The contact model for an engine, compiled if it never was.

    Raises
    ------
    OtherEngine
        If the engine is another version than the one that the model was written for.
    ContactModelMissing
        If it cannot be compiled: what is missing, or what the compiler says.
    """
    place = user_cache_path("granular-walkers") / f"bridge-{_fingerprint()}.so"
    if set(str(place)) & set(": "):
        raise ContactModelMissing(f"{place} has a space or a colon, which the system's loader takes for a separator")
    _check_version(engine)
    if not place.is_file():
        _compile(place)
    return place


def _fingerprint() -> str:
    """Of sources, options, and the library that is linked to, which is another file after an upgrade."""
    digest = hashlib.sha256("\0".join(OPTIONS).encode())
    for name in MODEL:
        digest.update((SOURCES / name).read_bytes())
    for library in sorted(Path("/usr/lib").glob("*/libliggghts.so.3")):
        digest.update(f"{library.resolve()} {library.stat().st_mtime_ns} {library.stat().st_size}".encode())
    return digest.hexdigest()[:16]


@lru_cache(maxsize=8)
def _check_version(engine: Engine) -> None:
    """Refuse a binary that says to be another version; of one that does not say it, the banner is looked at later."""
    for part in parts_of(engine.path):
        with part.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as contents:
            version = said[0].decode() if (said := _VERSION.search(contents)) else AUDITED_VERSION
        if version != AUDITED_VERSION:
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
            linked = [f"-Wl,--version-script={SOURCES / 'bridge.map'}", "-Wl,-Bsymbolic", "-l:libliggghts.so.3"]
            done = subprocess.run(
                [compiler, *OPTIONS, f"-I{SOURCES}", *included, str(SOURCES / "bridge.cpp"), "-o", str(made), *linked],
                capture_output=True, text=True, errors="replace", check=False,
            )  # fmt: skip
            if done.returncode:
                said = next((line for line in done.stderr.splitlines() if "error" in line), "nothing")
                raise ContactModelMissing(f"the compiler says: {said}")
            made.replace(place)
    except OSError as error:
        raise ContactModelMissing(f"{place} cannot be written ({error})") from error


def run_script(plugin: Path, ranks: int) -> str:
    """A shell script that runs a deck by hand: the model is loaded into the engine, its output goes to a file."""
    parallel = f"mpirun -n {ranks} " if ranks > 1 else ""
    return (
        f'# Runs {DECK_NAME} with the contact model "cohesion bridge", which is loaded into liggghts.\n'
        f"exec {parallel}env LD_PRELOAD={shlex.quote(str(plugin))} liggghts -in {DECK_NAME} > {OUTPUT_NAME}\n"
    )


def main() -> None:
    """Compile the model for the engine that is installed: ``make setup``."""
    from walkers.runner.binary import find_engine

    try:
        plugin_of(find_engine())
    except EngineFailure as failure:
        raise SystemExit(f"walkers: {failure}") from failure
