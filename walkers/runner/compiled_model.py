"""The contact model ``cohesion bridge``, compiled: a shared library for the engine.

It is compiled on first use and kept in the user's cache. It is compiled with the headers and the
library of this machine, since its binary interface must match the installed package, and only for
the engine version for which it was written. The engine executes it as the user: therefore only
the user and root may be able to write it, and its checksum is kept beside it.
"""

from __future__ import annotations

import hashlib
import shlex
import shutil
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

from walkers.cache import ForeignCacheError, cache_folder, is_safe, make_cache_folder, secure_cache
from walkers.files import checksum, read_json, write_json
from walkers.runner import model_sources
from walkers.runner.binary import Engine, check_version, find_engine
from walkers.runner.failures import ContactModelMissing, EngineFailure
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME, RUN_NAME

_PACKAGES = "g++ libliggghts-dev libopenmpi-dev"
"""Debian packages that the compilation needs."""
_HEADERS = Path("/usr/include/liggghts")
"""Folder of the engine's headers."""
_OPTIONS = (
    "-shared",
    "-fPIC",
    "-std=gnu++11",
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-DNDEBUG",
    "-DOMPI_SKIP_MPICXX",
    "-Wall",
    "-Wextra",
)
"""Options of the compiler: the code gives the same numbers on all machines of an architecture.

-O3 does not reorder operations, and there are no fused ones. (The C library's sine, of the drive,
differs in its last digit without fused multiply-add.) Only without traps does the code compute
several contacts at once.
"""
_LINKED = ("-Wl,-Bsymbolic", "-l:libliggghts.so.3")
"""Options of the linker."""


def plugin_of(engine: Engine) -> Path:
    """The contact model for an engine, compiled on first use.

    Parameters
    ----------
    engine
        The engine into which it is to be loaded.

    Returns
    -------
    Path
        The shared library.

    Raises
    ------
    OtherEngine
        If the engine has another version than that for which the model is written.
    ContactModelMissing
        If the model cannot be compiled or kept.
    """
    place, fingerprint = _place()
    if ":" in str(place) or " " in str(place):
        raise ContactModelMissing(
            f"{place} has a space or a colon, which the system's loader takes for a separator"
        )
    check_version(engine)
    try:
        secure_cache()
        if not _is_as_compiled(place, fingerprint):
            _compile(place, fingerprint)
    except ForeignCacheError as error:
        raise ContactModelMissing(
            f"{place.parent} belongs to another user, whose code the engine would run; "
            "set XDG_CACHE_HOME to a folder of your own"
        ) from error
    except OSError as error:
        raise ContactModelMissing(
            f"{place} cannot be written ({error.strerror}); "
            "set XDG_CACHE_HOME to a folder in which files can be"
        ) from error
    return place


def model_sha256(engine: Engine) -> str | None:
    """SHA-256 of the contact model for an engine, compiled on first use; None if that fails."""
    with suppress(EngineFailure):
        return checksum(plugin_of(engine))
    return None


def build_script() -> str:
    """A shell script for decks that are run elsewhere: it compiles the sources beside it.

    It compiles as `plugin_of` does, but without warnings, which tell its user nothing.
    """
    options = " ".join(option for option in _OPTIONS if not option.startswith("-W"))
    return f"""#!/bin/sh
# Compiles the contact model "cohesion bridge" for the liggghts of this machine: \
bridge.so, beside this script.
# Needs: apt-get install {_PACKAGES}
set -eu
cd "$(dirname "$0")"
g++ {options} -I. -isystem {_HEADERS} \\
    $(mpicxx --showme:incdirs | sed 's/[^ ]*/-isystem &/g') bridge.cpp -o bridge.so \\
    -Wl,--version-script=bridge.map {" ".join(_LINKED)}
"""


def _place() -> tuple[Path, str]:
    """Path of the compiled model, and SHA-256 of all from which it is compiled.

    That is options, sources and the engine's library, which is another file after an upgrade.
    """
    fingerprint = hashlib.sha256("\0".join(_OPTIONS).encode())
    for source in model_sources.compiled_sources():
        fingerprint.update(source.read_bytes())
    for library in sorted(Path("/usr/lib").glob("*/libliggghts.so.3")):
        status = library.stat()
        identity = f"{library.resolve()} {status.st_mtime_ns} {status.st_size}"
        fingerprint.update(identity.encode())
    name = f"bridge-{fingerprint.hexdigest()[:16]}.so"
    return cache_folder() / name, fingerprint.hexdigest()


def _is_as_compiled(place: Path, fingerprint: str) -> bool:
    """Whether a compiled model agrees with its record, and no other user can write the two."""
    record = place.with_suffix(".json")
    with suppress(OSError, ValueError):
        if is_safe(place) and is_safe(record):
            return read_json(record) == _record(place, fingerprint)
    return False


def _record(library: Path, fingerprint: str) -> dict[str, str]:
    """The record of a compiled model: the fingerprint of its sources, and its checksum."""
    return {"compiled_from": fingerprint, "sha256": checksum(library)}


def _compile(place: Path, fingerprint: str) -> None:
    """Compile the model, and write its record beside it; the two are renamed to their place."""
    compiler, mpi_compiler = _compilers()
    with tempfile.TemporaryDirectory(dir=make_cache_folder()) as folder:
        library = Path(folder) / place.name
        _run_compiler(compiler, mpi_compiler, library)
        library.chmod(0o755)  # for any umask: a file that others can write is not loaded
        record = Path(folder) / "record.json"
        write_json(record, _record(library, fingerprint))
        record.chmod(0o644)
        library.replace(place)
        record.replace(place.with_suffix(".json"))


def _compilers() -> tuple[str, str]:
    """Paths of the compiler and of that of MPI; `ContactModelMissing` without them or headers."""
    compiler = shutil.which("g++")
    mpi_compiler = shutil.which("mpicxx")
    if compiler is None or mpi_compiler is None or not _HEADERS.is_dir():
        raise ContactModelMissing(
            f"it is compiled once; install what that needs: apt-get install {_PACKAGES}"
        )
    return compiler, mpi_compiler


def _run_compiler(compiler: str, mpi_compiler: str, library: Path) -> None:
    """Compile the model to a shared library; raises `ContactModelMissing` if that fails."""
    mpi_folders = subprocess.run(
        [mpi_compiler, "--showme:incdirs"], capture_output=True, text=True, check=False
    ).stdout.split()
    included: list[str] = []
    for folder in (str(_HEADERS), *mpi_folders):
        included += ["-isystem", folder]
    command = [
        compiler,
        *_OPTIONS,
        f"-I{model_sources.SOURCES}",
        *included,
        str(model_sources.SOURCES / model_sources.MODEL),
        "-o",
        str(library),
        f"-Wl,--version-script={model_sources.SOURCES / 'bridge.map'}",
        *_LINKED,
    ]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        errors = [line for line in done.stderr.splitlines() if "error" in line]
        first_error = errors[0] if errors else "nothing"
        raise ContactModelMissing(f"the compiler says: {first_error}")


def write_run_script(directory: Path, engine: Engine, plugin: Path, ranks: int) -> None:
    """Write a shell script that runs a deck by hand: it loads the model and writes the output.

    Parameters
    ----------
    directory
        Folder of the deck.
    engine
        The engine.
    plugin
        The compiled contact model.
    ranks
        Number of MPI processes.
    """
    parallel = f"mpirun -n {ranks} " if ranks > 1 else ""
    preload = f"env LD_PRELOAD={shlex.quote(str(plugin))}"
    command = f"{parallel}{preload} {shlex.quote(str(engine.path))} -in {DECK_NAME}"
    comment = (
        f'# Runs {DECK_NAME} with the contact model "cohesion bridge", '
        "which is loaded into the engine."
    )
    script = f"{comment}\nexec {command} > {OUTPUT_NAME}\n"
    (directory / RUN_NAME).write_text(script, encoding="utf-8")


def compile_model() -> None:
    """Compile the model for the engine that is installed: ``make setup``."""
    try:
        plugin_of(find_engine())
    except EngineFailure as failure:
        raise SystemExit(f"walkers: {failure}") from failure
