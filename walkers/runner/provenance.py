"""Software of a run: version and commit of the program, versions of Python and of required packages.

Uses only the standard library: the build of a wheel (``setup.py``) runs this file to find the commit.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import threading
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

PROJECT = "granular-walkers"
COMMIT_NAME = "commit.txt"
"""File with the commit, in a wheel that was built in a checkout."""
_PATIENCE_SECONDS = 20.0


@dataclass(frozen=True)
class Software:
    """Versions of the program, of Python and of the required packages, by name.

    ``commit`` is that of the checkout from which the program runs or was built, with ``+changes`` if tracked files
    differ; None if unknown.
    """

    version: str
    commit: str | None
    python: str
    packages: dict[str, str]


@cache
def software() -> Software:
    """The software of this process, looked up once (30 ms)."""
    try:
        version, required = metadata.version(PROJECT), metadata.requires(PROJECT) or []
    except metadata.PackageNotFoundError:
        version, required = "not installed", []
    needed = [match[0] for one in required if "extra ==" not in one and (match := re.match(r"[\w.-]+", one))]
    packages = {}
    for name in needed:
        with suppress(metadata.PackageNotFoundError):
            packages[name] = metadata.version(name)
    package = Path(__file__).resolve().parents[1]
    commit = commit_of(package.parent)
    if commit is None and (package / COMMIT_NAME).is_file():
        commit = (package / COMMIT_NAME).read_text("utf-8").strip() or None
    return Software(version, commit, platform.python_version(), packages)


def look_ahead() -> None:
    """Look up `software` in a thread while the program waits for an engine."""
    threading.Thread(target=software, daemon=True).start()


def commit_of(checkout: Path) -> str | None:
    """The commit of a checkout, with ``+changes`` if tracked files differ from it; None if it is no checkout.

    Untracked files do not count, because runs are made in the folder.
    """
    if not (checkout / ".git").exists():
        return None
    # A git hook may set another repository. Nothing is written, because many processes may ask at once.
    ours = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty=+changes"]
    try:
        done = subprocess.run(
            command,
            cwd=checkout,
            env={**ours, "GIT_OPTIONAL_LOCKS": "0"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
            timeout=_PATIENCE_SECONDS,
        )
    except (OSError, subprocess.SubprocessError):  # no git here, or a file system that does not answer
        return None
    return done.stdout.strip() or None
