"""Software of a run: versions of the program, of Python and of the required packages."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

PROJECT = "granular-walkers"
"""Name of the program as a Python package."""
_NAME_END = re.compile(r"[^\w.-]")
"""What ends the name of a package in a requirement, such as ``numpy>=2``."""
_PATIENCE_SECONDS = 20.0
"""Longest time that git may take."""


@cache
def software() -> dict[str, Any]:
    """Versions of the program, of Python and of the required packages; looked up once.

    Returns
    -------
    dict
        Entries of a manifest. ``commit`` is that of the checkout from which the program runs or was
        built; None if it is unknown.
    """
    try:
        version = metadata.version(PROJECT)
        requirements = metadata.requires(PROJECT) or []
    except metadata.PackageNotFoundError:
        version = "not installed"
        requirements = []
    version, _, built_from = version.partition("+")
    checkout = Path(__file__).resolve().parents[2]
    commit = commit_of(checkout) or built_from.removeprefix("g") or None
    return {
        "granular_walkers": version,
        "commit": commit,
        "python": platform.python_version(),
        "packages": _versions_of(requirements),
    }


def _versions_of(requirements: list[str]) -> dict[str, str]:
    """Versions of the packages that requirements name, such as ``numpy>=2``, by their names.

    Requirements of extras and packages that are not installed are left out.
    """
    versions = {}
    for requirement in requirements:
        if "extra ==" in requirement:
            continue
        name = _NAME_END.split(requirement)[0]
        with suppress(metadata.PackageNotFoundError):
            versions[name] = metadata.version(name)
    return versions


def commit_of(checkout: Path) -> str | None:
    """The commit of a checkout, with ``+changes`` if tracked files differ from it.

    None if the folder is not a checkout, git is missing, or the file system does not answer.
    """
    if not (checkout / ".git").exists():
        return None
    # A git hook may set another repository.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = [
        "git",
        "--no-optional-locks",  # nothing is written, because many processes may ask at once
        "describe",
        "--always",
        "--abbrev=40",
        "--exclude=*",
        "--dirty=+changes",
    ]
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(
            command,
            check=True,
            capture_output=True,
            text=True,
            cwd=checkout,
            env=environment,
            timeout=_PATIENCE_SECONDS,
        )
        return done.stdout.strip()
    return None
