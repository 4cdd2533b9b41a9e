"""Manifests: provenance of finished runs, and checksums of their files."""

from __future__ import annotations

import platform
import time
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from walkers.errors import WalkersError
from walkers.files import checksum, read_json, write_json
from walkers.inputs.tables.case import Case
from walkers.runner.audit import read_audit
from walkers.runner.binary import Engine
from walkers.runner.compiled_model import plugin_of
from walkers.runner.launch import EngineReport
from walkers.runner.model_sources import model_version
from walkers.runner.provenance import software
from walkers.templates.deck import CONTENT_VERSION, bridge_tables_digest

MANIFEST_NAME = "manifest.json"
RESULT_NAME = "result.json"
FORMAT = 3


def write_manifest(
    case: Case,
    name: str,
    engine: Engine | None,
    report: EngineReport,
    *,
    started: float,
    directory: Path,
    **more: Any,
) -> None:
    """Write the manifest of a run, after its other files; ``started`` in s after the epoch; no engine: run by hand."""
    finished = time.time()
    plugin = plugin_of(engine) if engine else None
    model = None
    if plugin:
        model = {"path": str(plugin), "sha256": checksum(plugin), **model_version()}
    audit = read_audit(engine.sha256, model["sha256"]) if engine and model else None
    paths = [path for path in sorted(directory.rglob("*")) if path.is_file()]
    files = {path.relative_to(directory).as_posix(): path.stat().st_size for path in paths}
    contents = {
        "format": FORMAT,
        "status": "finished",
        "name": case.name,
        "run": name,
        "engine": {
            "path": str(engine.path) if engine else "",
            "version": report.version,
            "sha256": engine.sha256 if engine else "",
            "audit": audit,
        },
        "deck_version": CONTENT_VERSION,
        "bridge_tables": bridge_tables_digest(case),
        "contact_model": model,
        **software(),
        "host": platform.node(),
        "platform": platform.platform(),
        "started": iso_time(started),
        "finished": iso_time(finished),
        "seconds": {
            "total": max(finished - started, report.wall_seconds),
            "engine": report.wall_seconds,
            "engine_loop": report.loop_seconds,
        },
        "steps": report.steps,
        "steps_per_second": report.steps / report.loop_seconds if report.loop_seconds else None,
        "files": files,
        "sha256": checksums(directory, files),
        **more,
    }
    write_json(directory / MANIFEST_NAME, contents, sync=False)


def read_manifest(directory: Path) -> dict[str, Any]:
    """The manifest of a finished run; raises `OSError` or `ValueError` if it is unreadable."""
    return read_json(directory / MANIFEST_NAME)


def iso_time(seconds: float) -> str:
    """A time in seconds after the epoch, ISO 8601."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))


def checksums(directory: Path, names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of files of a directory; raises `OSError` if one is unreadable."""
    return {name: checksum(directory / name) for name in names}


class FileChanged(WalkersError, ValueError):
    """A file of a finished run has changed."""


def check_unchanged(directory: Path, names: Collection[str]) -> bool:
    """Raise `FileChanged` if files of a finished run differ from its manifest; return whether it lists all of them."""
    try:
        sums = sums_of(read_manifest(directory), directory)
    except FileNotFoundError:
        return True
    recorded = {name: sums[name] for name in names if name in sums}
    for name, now in checksums(directory, recorded).items():
        if now != recorded[name]:
            message = f"has changed since the run was finished; list all changes with: walkers check files {directory}"
            if name == "result.json" or name.endswith(".parquet"):
                message += (
                    f"; to measure the run again, delete the file and do: walkers run {directory}"
                )
            raise FileChanged(f"{directory / name} {message}")
    return len(recorded) == len(names)


def sums_of(contents: dict[str, Any], directory: Path) -> dict[str, str]:
    """The checksums in a manifest of a directory; `ValueError` if it has none."""
    if not isinstance(sums := contents.get("sha256"), dict):
        raise ValueError(f"{directory / MANIFEST_NAME}: expected a table sha256")
    return sums
