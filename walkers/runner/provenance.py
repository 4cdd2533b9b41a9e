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
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

PROJECT = "granular-walkers"
COMMIT_NAME = "commit.txt"
"""File with the commit, in a wheel that was built in a checkout."""
_PATIENCE_SECONDS = 20.0


@cache
def software() -> dict[str, Any]:
    """Versions of the program, of Python and of the required packages, as manifests have them; looked up once (30 ms).

    ``commit`` is that of the checkout from which the program runs or was built (`commit_of`); None if unknown.
    """
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
    python = platform.python_version()
    return {"granular_walkers": version, "commit": commit, "python": python, "packages": packages}


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
    ours["GIT_OPTIONAL_LOCKS"] = "0"
    how: dict[str, Any] = {"cwd": checkout, "env": ours, "timeout": _PATIENCE_SECONDS, "text": True}
    command = ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty=+changes"]
    try:
        commit: str = subprocess.check_output(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **how)
    except (OSError, subprocess.SubprocessError):  # no git here, or a file system that does not answer
        return None
    return commit.strip() or None
