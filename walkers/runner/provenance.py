"""Software of a run: version and commit of the program, versions of Python and of required packages."""

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
_PATIENCE_SECONDS = 20.0


@cache
def software() -> dict[str, Any]:
    """Versions of the program, of Python and of the required packages, as manifests have them; looked up once.

    ``commit`` is that of the checkout from which the program runs or was built; None if unknown.
    """
    try:
        version, required = metadata.version(PROJECT), metadata.requires(PROJECT) or []
    except metadata.PackageNotFoundError:
        version, required = "not installed", []
    needed = [re.split(r"[^\w.-]", line)[0] for line in required if "extra ==" not in line]
    packages = {}
    for name in needed:
        with suppress(metadata.PackageNotFoundError):
            packages[name] = metadata.version(name)
    version, _, built = version.partition("+")
    commit = commit_of(Path(__file__).resolve().parents[2]) or built.removeprefix("g") or None
    return {
        "granular_walkers": version,
        "commit": commit,
        "python": platform.python_version(),
        "packages": packages,
    }


def commit_of(checkout: Path) -> str | None:
    """The commit of a checkout, with ``+changes`` if tracked files differ from it; None if it is no checkout."""
    if not (checkout / ".git").exists():
        return None
    # A git hook may set another repository. Nothing is written, because many processes may ask at once.
    ours = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = [
        "git",
        "--no-optional-locks",
        "describe",
        "--always",
        "--abbrev=40",
        "--exclude=*",
        "--dirty=+changes",
    ]
    how: dict[str, Any] = {"cwd": checkout, "env": ours, "timeout": _PATIENCE_SECONDS, "text": True}
    with suppress(
        OSError, subprocess.SubprocessError
    ):  # no git here, or a file system that does not answer
        return str(subprocess.run(command, check=True, capture_output=True, **how).stdout).strip()
    return None
