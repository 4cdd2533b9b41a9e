"""The contact model ``cohesion bridge``, compiled: a shared library, which is loaded into the engine.

It is compiled on first use and kept in the user's cache. It is compiled with the headers and the library of this
machine, since its binary interface must match the installed package, and only for the engine version that it was
written for. The engine executes it as the user: therefore nobody else but root may write it, and its checksum is kept
beside it.
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
_HEADERS = Path("/usr/include/liggghts")
# This code gives the same numbers on all machines of an architecture: -O3 does not reorder, and there are no fused
# operations. (The C library's sine, of the drive, differs in its last digit without fused multiply-add.) Only without
# traps does it compute several contacts at once.
_OPTIONS = (
    *(
        "-shared",
        "-fPIC",
        "-std=gnu++11",
        "-O3",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fno-trapping-math",
    ),
    *("-DNDEBUG", "-DOMPI_SKIP_MPICXX", "-Wall", "-Wextra"),
)
_LINKED = ("-Wl,-Bsymbolic", "-l:libliggghts.so.3")


def plugin_of(engine: Engine) -> Path:
    """The contact model for an engine, compiled on first use; raises `OtherEngine` or `ContactModelMissing`."""
    place, fingerprint = _place()
    if set(str(place)) & set(": "):
        raise ContactModelMissing(
            f"{place} has a space or a colon, which the system's loader takes for a separator"
        )
    check_version(engine)
    try:
        secure_cache()
        if not _is_as_compiled(place, fingerprint):
            _compile(place, fingerprint)
    except ForeignCacheError as error:
        why = f"{place.parent} belongs to another user, whose code the engine would run"
        raise ContactModelMissing(f"{why}; set XDG_CACHE_HOME to a folder of your own") from error
    except OSError as error:
        why = f"{place} cannot be written ({error.strerror}); set XDG_CACHE_HOME to a folder in which files can be"
        raise ContactModelMissing(why) from error
    return place


def model_sha256(engine: Engine) -> str | None:
    """SHA-256 of the contact model for an engine, compiled on first use; None if `plugin_of` fails."""
    with suppress(EngineFailure):
        return checksum(plugin_of(engine))
    return None


def build_script() -> str:
    """A shell script that compiles the contact model in its own folder, as `plugin_of` does."""
    options = " ".join(option for option in _OPTIONS if not option.startswith("-W"))
    return f"""#!/bin/sh
# Compiles the contact model "cohesion bridge" for the liggghts of this machine: bridge.so, beside this script.
# Needs: apt-get install {_PACKAGES}
set -eu
cd "$(dirname "$0")"
g++ {options} -I. -isystem {_HEADERS} \\
    $(mpicxx --showme:incdirs | sed 's/[^ ]*/-isystem &/g') bridge.cpp -o bridge.so \\
    -Wl,--version-script=bridge.map {" ".join(_LINKED)}
"""


def _place() -> tuple[Path, str]:
    """Path of the compiled model, and SHA-256 of options, sources and library from which it is compiled."""
    fingerprint = hashlib.sha256("\0".join(_OPTIONS).encode())
    for source in model_sources.compiled_sources():
        fingerprint.update(source.read_bytes())
    for library in sorted(
        Path("/usr/lib").glob("*/libliggghts.so.3")
    ):  # another file after an upgrade
        fingerprint.update(
            f"{library.resolve()} {library.stat().st_mtime_ns} {library.stat().st_size}".encode()
        )
    return cache_folder() / f"bridge-{fingerprint.hexdigest()[:16]}.so", fingerprint.hexdigest()


def _is_as_compiled(place: Path, fingerprint: str) -> bool:
    """Whether a compiled model agrees with its record, and no other user can write the two."""
    record = place.with_suffix(".json")
    with suppress(OSError, ValueError):
        return (
            is_safe(place) and is_safe(record) and read_json(record) == _record(place, fingerprint)
        )
    return False


def _record(library: Path, fingerprint: str) -> dict[str, str]:
    return {"compiled_from": fingerprint, "sha256": checksum(library)}


def _compile(place: Path, fingerprint: str) -> None:
    """Compile the model, and write its checksum and the fingerprint of its sources beside it."""
    compiler, mpi = shutil.which("g++"), shutil.which("mpicxx")
    if compiler is None or mpi is None or not _HEADERS.is_dir():
        raise ContactModelMissing(
            f"it is compiled once; install what that needs: apt-get install {_PACKAGES}"
        )
    mpi_folders = subprocess.run(
        [mpi, "--showme:incdirs"], capture_output=True, text=True, check=False
    )
    included = [
        option
        for folder in (str(_HEADERS), *mpi_folders.stdout.split())
        for option in ("-isystem", folder)
    ]
    linked = [f"-Wl,--version-script={model_sources.SOURCES / 'bridge.map'}", *_LINKED]
    with tempfile.TemporaryDirectory(dir=make_cache_folder()) as folder:
        library = Path(folder) / place.name
        source = model_sources.SOURCES / model_sources.MODEL
        command = [
            compiler,
            *_OPTIONS,
            f"-I{source.parent}",
            *included,
            str(source),
            "-o",
            str(library),
        ]
        done = subprocess.run(
            [*command, *linked], capture_output=True, text=True, errors="replace", check=False
        )
        if done.returncode:
            error = next((line for line in done.stderr.splitlines() if "error" in line), "nothing")
            raise ContactModelMissing(f"the compiler says: {error}")
        library.chmod(0o755)
        record = Path(folder) / "record.json"
        write_json(record, _record(library, fingerprint))
        record.chmod(0o644)
        library.replace(place)
        record.replace(place.with_suffix(".json"))


def write_run_script(directory: Path, engine: Engine, plugin: Path, ranks: int) -> None:
    """Write a shell script that runs a deck by hand: it loads the model into the engine and writes the output."""
    parallel = f"mpirun -n {ranks} " if ranks > 1 else ""
    command = f"{parallel}env LD_PRELOAD={shlex.quote(str(plugin))} {shlex.quote(str(engine.path))} -in {DECK_NAME}"
    about = f'# Runs {DECK_NAME} with the contact model "cohesion bridge", which is loaded into the engine.'
    (directory / RUN_NAME).write_text(
        f"{about}\nexec {command} > {OUTPUT_NAME}\n", encoding="utf-8"
    )


def compile_model() -> None:
    """Compile the model for the engine that is installed: ``make setup``."""
    try:
        plugin_of(find_engine())
    except EngineFailure as failure:
        raise SystemExit(f"walkers: {failure}") from failure
