"""Manifests: provenance of finished runs, and checksums of their files.

A manifest is the last file of a run: a directory with one has a finished run. What a run gave is in
its result and its tables, not here.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
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
"""Version of the format of run directories, part of the names of runs."""


class FileChanged(WalkersError, ValueError):
    """A file of a finished run has changed."""


@dataclass(frozen=True, kw_only=True)
class FinishedRun:
    """A run whose files are complete, and what its manifest tells about its course.

    Attributes
    ----------
    case
        The resolved case.
    name
        Name of the run.
    engine
        The engine that made it; None for a deck that was run by hand.
    report
        What the engine reported.
    started
        Start of the run, s after the epoch.
    segments
        Number of its segments.
    drive_from
        Step at which the drive began.
    settled
        Root mean square velocity of the beads when the drive began, m/s; None if they did not rest
        before. Not of runs that shared a deck or were made by hand.
    ended
        Reason why the run ended before its time; None if it did not.
    shared_deck
        The deck that the run shared with other runs; None if it had its own.
    by_hand
        Notes on a run that was made by hand; empty for all others.
    bridge_tables
        SHA-256 of the bridge tables that the engine read; None if they are those of the case.
    """

    case: Case
    name: str
    engine: Engine | None
    report: EngineReport
    started: float
    segments: int
    drive_from: int
    settled: float | None = None
    ended: str | None = None
    shared_deck: Mapping[str, Any] | None = None
    by_hand: Sequence[str] = ()
    bridge_tables: str | None = None


def write_manifest(directory: Path, run: FinishedRun) -> None:
    """Write the manifest of a run into its directory, after all of its other files."""
    finished = time.time()
    report = run.report
    steps_per_second = report.steps / report.loop_seconds if report.loop_seconds else None
    files = _sizes_of_files(directory)
    contents = {
        "format": FORMAT,
        "status": "finished",
        "name": run.case.name,
        "run": run.name,
        **_engine_entries(run),
        **software(),
        "host": platform.node(),
        "platform": platform.platform(),
        "started": iso_time(run.started),
        "finished": iso_time(finished),
        "seconds": {
            "total": max(finished - run.started, report.wall_seconds),
            "engine": report.wall_seconds,
            "engine_loop": report.loop_seconds,
        },
        "steps": report.steps,
        "steps_per_second": steps_per_second,
        "files": files,
        "sha256": checksums(directory, files),
        **_course_entries(run),
    }
    write_json(directory / MANIFEST_NAME, contents, sync=False)


def _engine_entries(run: FinishedRun) -> dict[str, Any]:
    """The engine, its audit, the contact model and the bridge tables."""
    engine: dict[str, Any] = {
        "path": "",
        "version": run.report.version,
        "sha256": "",
        "audit": None,
    }
    model = None
    if run.engine is not None:
        plugin = plugin_of(run.engine)
        model = {"path": str(plugin), "sha256": checksum(plugin), **model_version()}
        engine["path"] = str(run.engine.path)
        engine["sha256"] = run.engine.sha256
        engine["audit"] = read_audit(run.engine.sha256, model["sha256"])
    return {
        "engine": engine,
        "deck_version": CONTENT_VERSION,
        "bridge_tables": run.bridge_tables or bridge_tables_digest(run.case),
        "contact_model": model,
    }


def _course_entries(run: FinishedRun) -> dict[str, Any]:
    """How the run went; what is told depends on how it was made: shared, by hand or alone."""
    entries: dict[str, Any] = {"segments": run.segments, "drive_from": run.drive_from}
    if run.shared_deck is not None:
        entries["shared_deck"] = dict(run.shared_deck)
    elif run.by_hand:
        entries["by_hand"] = list(run.by_hand)
    else:
        entries["settled"] = run.settled
        if run.ended is not None:
            entries["ended"] = run.ended
    return entries


def _sizes_of_files(directory: Path) -> dict[str, int]:
    """Sizes of all files within a directory in bytes, by their paths within it, sorted."""
    sizes = {}
    for path in sorted(directory.rglob("*")):
        if path.is_file():
            sizes[path.relative_to(directory).as_posix()] = path.stat().st_size
    return sizes


def read_manifest(directory: Path) -> dict[str, Any]:
    """The manifest of a finished run; raises `OSError` or `ValueError` if it is unreadable."""
    return read_json(directory / MANIFEST_NAME)


def iso_time(seconds: float) -> str:
    """A time in seconds after the epoch as ISO 8601 text, in UTC."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))


def checksums(directory: Path, names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of files of a directory by their names; raises `OSError` if one is unreadable."""
    return {name: checksum(directory / name) for name in names}


def check_unchanged(directory: Path, names: Collection[str]) -> bool:
    """Check that files of a finished run are those of which its manifest has checksums.

    Parameters
    ----------
    directory
        The run directory. Without a manifest, nothing is checked.
    names
        Paths of the files within the directory.

    Returns
    -------
    bool
        Whether the manifest lists all of the files, or does not exist.

    Raises
    ------
    FileChanged
        If the contents of a file differ.
    OSError, ValueError
        If a file or the manifest is unreadable.
    """
    try:
        sums = sums_of(read_manifest(directory), directory)
    except FileNotFoundError:
        return True
    recorded = {name: sums[name] for name in names if name in sums}
    for name, now in checksums(directory, recorded).items():
        if now != recorded[name]:
            raise FileChanged(_change_message(directory, name))
    return len(recorded) == len(names)


def _change_message(directory: Path, name: str) -> str:
    """The message about a changed file of a run, with what the user can do."""
    message = (
        f"{directory / name} has changed since the run was finished; "
        f"list all changes with: walkers check files {directory}"
    )
    if name == RESULT_NAME or name.endswith(".parquet"):
        message += f"; to measure the run again, delete the file and do: walkers run {directory}"
    return message


def sums_of(contents: Mapping[str, Any], directory: Path) -> dict[str, str]:
    """The checksums in the manifest of a directory; raises `ValueError` if it has none."""
    sums = contents.get("sha256")
    if not isinstance(sums, dict):
        raise ValueError(f"{directory / MANIFEST_NAME}: expected a table sha256")
    return sums
