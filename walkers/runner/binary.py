"""The engine: identity of its binary, the contact model that it loads, and records of audits.

The contact model is a shared library. It is compiled on first use and kept in the user's cache, as are the records of
audits. It is compiled with the headers and the library of this machine, since its binary interface must match the
installed package, and only for the engine version that it was written for. The engine executes it as the user:
therefore nobody else but root may write it, and its checksum is kept beside it.
"""

from __future__ import annotations

import hashlib
import mmap
import os
import re
import shlex
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from walkers.cache import (
    ForeignCacheError,
    cache_folder,
    is_safe,
    is_trusted,
    make_cache_folder,
    secure_cache,
)
from walkers.files import checksum, read_json, write_json
from walkers.runner.failures import (
    AUDITED_VERSION,
    AuditFailed,
    ContactModelMissing,
    EngineFailure,
    EngineMissing,
    OtherEngine,
    UnauditedEngineWarning,
)
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME, RUN_NAME

ENGINE_VARIABLE = "WALKERS_ENGINE"
SOURCES = Path(str(files("walkers.templates.engine")))
_MODEL = "bridge.cpp"
"""The file of the contact model that is compiled; it includes the headers beside it."""
_FORCES_VERSION = re.compile(rb"^// FORCES_VERSION \d+$", re.MULTILINE)
"""The line of ``bridge.cpp`` that is part of the names of runs and audits; the rest of the sources is not."""
_PACKAGES = "g++ libliggghts-dev libopenmpi-dev"
_HEADERS = Path("/usr/include/liggghts")
# This code gives the same numbers on all machines of an architecture: -O3 does not reorder, and there are no fused
# operations. (The C library's sine, of the drive, differs in its last digit without fused multiply-add.) Only without
# traps does it compute several contacts at once.
_OPTIONS = (
    *("-shared", "-fPIC", "-std=gnu++11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
    *("-DNDEBUG", "-DOMPI_SKIP_MPICXX", "-Wall", "-Wextra"),
)
_LINKED = ("-Wl,-Bsymbolic", "-l:libliggghts.so.3")
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
    digest.update(b"".join(_FORCES_VERSION.findall((SOURCES / _MODEL).read_bytes())))
    return Engine(path, digest.hexdigest())


@lru_cache(maxsize=64)
def _sha256(path: Path, _modified: int, _size: int) -> str:
    return checksum(path)


@lru_cache(maxsize=8)
def _parts_of(path: Path, _modified: int) -> tuple[Path, ...]:
    """An executable and the ``libliggghts`` that it loads (Debian's executable is only a launcher of 18 kB)."""
    listing = subprocess.run(["ldd", str(path)], capture_output=True, text=True, errors="replace", check=False).stdout
    return path, *(Path(match) for match in _LIBRARY.findall(listing))


def version_in(output: bytes) -> str | None:
    """The version in the banner of the engine's output, such as ``LIGGGHTS-PUBLIC 3.8.0``; None without a banner."""
    match = _BANNER.search(output)
    return match.group(1).decode("utf-8", "replace").strip() if match else None


# --- the contact model ------------------------------------------------------------------------------------------------


def plugin_of(engine: Engine) -> Path:
    """The contact model for an engine, compiled on first use; raises `OtherEngine` or `ContactModelMissing`."""
    place, fingerprint = _place()
    if set(str(place)) & set(": "):
        raise ContactModelMissing(f"{place} has a space or a colon, which the system's loader takes for a separator")
    _check_version(engine)
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


def model_sources() -> list[Path]:
    """Files from which the contact model is built, with its licence and its manual."""
    kinds = ("*.cpp", "*.h", "*.map", "COPYING", "README.md")
    return sorted(path for kind in kinds for path in SOURCES.glob(kind))


def _compiled_sources() -> list[Path]:
    """Files of the contact model that the compiler reads."""
    return [SOURCES / _MODEL, *sorted(SOURCES.glob("*.h"))]


def model_version() -> dict[str, Any]:
    """Version of the forces of the contact model, and SHA-256 of the sources that are compiled."""
    (line,) = _FORCES_VERSION.findall((SOURCES / _MODEL).read_bytes())
    sources = {path.name: checksum(path) for path in _compiled_sources()}
    return {"forces_version": int(line.split()[-1]), "sources": sources}


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


def model_sha256(engine: Engine) -> str | None:
    """SHA-256 of the contact model for an engine, compiled on first use; None if `plugin_of` fails."""
    with suppress(EngineFailure):
        return checksum(plugin_of(engine))
    return None


def _place() -> tuple[Path, str]:
    """Path of the compiled model, and SHA-256 of options, sources and library from which it is compiled."""
    fingerprint = hashlib.sha256("\0".join(_OPTIONS).encode())
    for source in _compiled_sources():
        fingerprint.update(source.read_bytes())
    for library in sorted(Path("/usr/lib").glob("*/libliggghts.so.3")):  # another file after an upgrade
        fingerprint.update(f"{library.resolve()} {library.stat().st_mtime_ns} {library.stat().st_size}".encode())
    return cache_folder() / f"bridge-{fingerprint.hexdigest()[:16]}.so", fingerprint.hexdigest()


def _is_as_compiled(place: Path, fingerprint: str) -> bool:
    """Whether a compiled model agrees with its record, and no other user can write the two."""
    record = place.with_suffix(".json")
    with suppress(OSError, ValueError):
        return is_safe(place) and is_safe(record) and read_json(record) == _record(place, fingerprint)
    return False


def _record(library: Path, fingerprint: str) -> dict[str, str]:
    return {"compiled_from": fingerprint, "sha256": checksum(library)}


@lru_cache(maxsize=8)
def _check_version(engine: Engine) -> None:
    """Refuse a binary that contains another version; if it contains none, the banner is checked later."""
    for part in _parts_of(engine.path, engine.path.stat().st_mtime_ns):
        with part.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as contents:
            version = match[0].decode() if (match := _VERSION.search(contents)) else AUDITED_VERSION
        if version != AUDITED_VERSION:
            raise OtherEngine(engine.path, version)


def _compile(place: Path, fingerprint: str) -> None:
    """Compile the model, and write its checksum and the fingerprint of its sources beside it."""
    compiler, mpi = shutil.which("g++"), shutil.which("mpicxx")
    if compiler is None or mpi is None or not _HEADERS.is_dir():
        raise ContactModelMissing(f"it is compiled once; install what that needs: apt-get install {_PACKAGES}")
    mpi_folders = subprocess.run([mpi, "--showme:incdirs"], capture_output=True, text=True, check=False)
    included = [option for folder in (str(_HEADERS), *mpi_folders.stdout.split()) for option in ("-isystem", folder)]
    linked = [f"-Wl,--version-script={SOURCES / 'bridge.map'}", *_LINKED]
    with tempfile.TemporaryDirectory(dir=make_cache_folder()) as folder:
        library = Path(folder) / place.name
        command = [compiler, *_OPTIONS, f"-I{SOURCES}", *included, str(SOURCES / _MODEL), "-o", str(library)]
        done = subprocess.run([*command, *linked], capture_output=True, text=True, errors="replace", check=False)
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
    (directory / RUN_NAME).write_text(f"{about}\nexec {command} > {OUTPUT_NAME}\n", encoding="utf-8")


def compile_model() -> None:
    """Compile the model for the engine that is installed: ``make setup``."""
    try:
        plugin_of(find_engine())
    except EngineFailure as failure:
        raise SystemExit(f"walkers: {failure}") from failure


# --- audits -----------------------------------------------------------------------------------------------------------


def check_audit(engine: Engine) -> None:
    """Refuse an engine whose audit failed, and warn of one without an audit.

    An audit is of a binary and of a build of the contact model. Another binary or another build has none until
    ``walkers check engine`` audits it.

    Parameters
    ----------
    engine
        The engine that is to run a deck.

    Raises
    ------
    AuditFailed
        If a force of this engine with its contact model was not as expected.

    Warns
    -----
    UnauditedEngineWarning
        If the engine was never audited with its contact model; once in a process.
    """
    audit = read_audit(engine.sha256, model_sha256(engine))
    if audit is None:
        _warn_unaudited(engine)
    elif not audit["passed"]:
        failures = audit["failures"]
        raise AuditFailed(
            f"{engine.path} failed its audit in {len(failures)} line(s), first: {failures[0]}; to see them and to "
            f"audit it again: walkers check engine --engine {shlex.quote(str(engine.path))}; to run, install Debian's "
            f"package liggghts again, or name another binary by --engine or {ENGINE_VARIABLE}"
        )


@lru_cache(maxsize=8)
def _warn_unaudited(engine: Engine) -> None:
    """Warn of an engine without an audit. The cache makes this once in a process."""
    warnings.warn(
        f"{engine.path} was never audited with its contact model: walkers check engine",
        UnauditedEngineWarning,
        stacklevel=4,
    )


def read_audit(engine: str, model: str | None) -> dict[str, Any] | None:
    """Outcome of the audit of a binary, by its hash; None without one with this contact model (its hash; None: any)."""
    path = cache_folder() / "audits" / f"{engine}.json"
    if not is_trusted(path):
        return None
    with suppress(OSError, ValueError, KeyError):
        record = read_json(path)
        if model in (None, record["contact_model"]):
            return {name: record[name] for name in ("passed", "lines", "failures", "date")}
    return None


def write_audit(engine: str, record: Mapping[str, Any]) -> None:
    """Save the record of a binary in place of the one before. Raises `OSError` if the cache cannot be written."""
    path = make_cache_folder("audits") / f"{engine}.json"
    write_json(path, record)
    path.chmod(0o644)  # whatever the umask: a record that others can write is not believed
