"""What is installed: the package, its commit if that is known, and the engine."""

from __future__ import annotations

import subprocess
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

_SECONDS = 10.0
"""How long the engine may take to say what it is."""


def engine_version(path: Path) -> str | None:
    """What an engine's banner calls its version; None if it has none or does not start or end."""
    from walkers.runner.binary import version_in

    command = [str(path), "-log", "none", "-in", "/dev/null"]
    with TemporaryDirectory() as folder, suppress(OSError, subprocess.TimeoutExpired):  # it writes files there
        done = subprocess.run(
            command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=_SECONDS, check=False
        )
        return version_in(done.stdout)
    return None


def describe_version() -> str:
    """Package, commit and engine, a line each."""
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing
    from walkers.runner.provenance import PROJECT, software

    ours = software()
    lines = [f"{PROJECT} {ours.version}" + (f" (commit {ours.commit})" if ours.commit else "")]
    try:
        engine = find_engine()
        lines.append(f"{engine_version(engine.path) or 'an engine that does not name its version'}, {engine.path}")
    except EngineMissing as missing:
        lines.append(str(missing))
    return "\n".join(lines)
