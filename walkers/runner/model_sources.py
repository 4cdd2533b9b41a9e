"""Sources of the contact model ``cohesion bridge``: their files, and the version of its forces."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

from walkers.files import checksum

SOURCES = Path(str(files("walkers.templates.engine")))
"""Folder of the sources."""
MODEL = "bridge.cpp"
"""The file of the contact model that is compiled; it includes the headers beside it."""
_KINDS = ("*.cpp", "*.h", "*.map", "COPYING", "README.md")
"""Patterns of the files from which the model is built, with its licence and its manual."""
_FORCES_VERSION = re.compile(rb"^// FORCES_VERSION \d+$", re.MULTILINE)
"""The line of ``bridge.cpp`` that is part of the names of runs and audits.

The rest of the sources is not.
"""


def model_sources() -> list[Path]:
    """Files from which the contact model is built, with its licence and its manual, sorted."""
    paths: list[Path] = []
    for kind in _KINDS:
        paths.extend(SOURCES.glob(kind))
    return sorted(paths)


def compiled_sources() -> list[Path]:
    """Files of the contact model that the compiler reads."""
    return [SOURCES / MODEL, *sorted(SOURCES.glob("*.h"))]


def forces_version_line() -> bytes:
    """The line with the version of the forces, which is part of the identity of an engine."""
    return b"".join(_FORCES_VERSION.findall((SOURCES / MODEL).read_bytes()))


def model_version() -> dict[str, Any]:
    """Version of the forces of the contact model, and SHA-256 of the sources that are compiled."""
    (line,) = _FORCES_VERSION.findall((SOURCES / MODEL).read_bytes())
    sources = {path.name: checksum(path) for path in compiled_sources()}
    return {"forces_version": int(line.split()[-1]), "sources": sources}
