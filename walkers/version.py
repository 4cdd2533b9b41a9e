"""What is installed: the package, the commit of a checkout, and the engine."""

from __future__ import annotations

import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

_SECONDS = 10.0
"""How long git and the engine may take to say what they are."""


def package_version() -> str:
    """Version of the installed package."""
    try:
        return version("granular-walkers")
    except PackageNotFoundError:
        return "not installed"


def commit() -> str | None:
    """The commit of the checkout that the package is used from, and whether files differ; None if it is from none."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():  # a file in a worktree
        return None
    found = _output(["git", "-C", str(root), "describe", "--always", "--exclude", "*", "--dirty=, changed"])
    return found.decode("utf-8", "replace").strip() or None


def engine_version(path: Path) -> str | None:
    """What an engine's banner calls its version; None if it has none."""
    from walkers.runner.binary import version_in

    with TemporaryDirectory() as folder:  # it writes files where it is started
        return version_in(_output([str(path), "-log", "none", "-in", "/dev/null"], folder))


def _output(command: list[str], folder: str | None = None) -> bytes:
    """What a program says; nothing if it cannot be started or does not end."""
    try:
        done = subprocess.run(
            command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return b""
    return done.stdout


def describe_version() -> str:
    """Package, commit and engine, a line each."""
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing

    known = commit()
    lines = [f"granular-walkers {package_version()}" + (f" (commit {known})" if known else "")]
    try:
        engine = find_engine()
        lines.append(f"{engine_version(engine.path) or 'an engine that does not name its version'}, {engine.path}")
    except EngineMissing as missing:
        lines.append(str(missing))
    return "\n".join(lines)
