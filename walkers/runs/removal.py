"""Removal of runs, and of what killed processes left in a folder of runs.

Runs in progress are never removed: removal holds the lock of the run. The manifest of a finished
run is removed first and its case last: after an interruption the rest is an interrupted run, and
the next removal takes it.
"""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from walkers.files import CSV_SCRATCH, SO_FAR_SCRATCH, VTK_SCRATCH, abandoned
from walkers.rounding import counted, duration_text
from walkers.runner import run_directory
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runner.run_directory import CASE_NAME
from walkers.runs.listing import ListEntry, bytes_text, place_of, runs_in, size_and_last_change
from walkers.terminal import table_width
from walkers.text import aligned_with_text

_MOST_LINES = 40
"""Largest number of removals that are listed one by one."""
_IN_PROGRESS = "kept: a process is computing it"
"""Why a run in progress is not removed."""


class RemovalKind(Enum):
    """What is removed.

    An unfinished export is a folder that a killed export to VTK left.
    """

    RUN = "run"
    SWEEP = "sweep"
    LOCK = "stale lock"
    EXPORT = "unfinished export"


@dataclass(frozen=True)
class Removal:
    """A directory or a lock file to remove.

    Attributes
    ----------
    path
        The directory or the file.
    kind
        What it is.
    status
        Of a run: finished, interrupted or failed.
    remark
        What the user should know before it is removed.
    """

    path: Path
    kind: RemovalKind
    status: str = ""
    remark: str = ""

    @property
    def label(self) -> str:
        """Its kind as text, such as ``failed run``."""
        return f"{self.status} {self.kind.value}".lstrip()


def unfinished_in(out: Path) -> list[Removal]:
    """Unfinished work in a folder of runs, without runs in progress.

    These are interrupted and failed runs, locks without a process, and folders of killed exports.
    """
    runs = runs_in(out)
    unfinished = [run for run in runs if run.status != "finished" and is_removable(run)]
    removals = [removal_of(run) for run in unfinished]
    removals += [Removal(lock, RemovalKind.LOCK) for lock in _stale_locks(out)]
    removals += [Removal(folder, RemovalKind.EXPORT) for folder in _abandoned_exports(out, runs)]
    return removals


def is_removable(run: ListEntry) -> bool:
    """Whether a run is not in progress, and no run is about to be restored from its directory."""
    if run.status == "running":
        return False
    is_replaced = run.directory.name.endswith(run_directory.REPLACED)
    return not is_replaced or place_of(run.directory).exists()


def removal_of(run: ListEntry) -> Removal:
    """The removal of a run."""
    remark = run.reason or ""
    if run.directory.is_symlink():
        remark = "a symbolic link: its target stays"
    elif run.status == "interrupted":
        remark = f"{remark}, can be continued".removeprefix(", ")
    return Removal(run.directory, RemovalKind.RUN, run.status, remark)


def _stale_locks(out: Path) -> list[Path]:
    """Lock files of runs that no process is computing, in a folder of runs and in its sweeps."""
    locks = []
    for lock in sorted([*out.glob("*.lock"), *out.glob("*/*.lock")]):
        place = lock.with_suffix("")
        if run_directory.is_run_name(place.name) and not run_directory.is_locked(place):
            locks.append(lock)
    return locks


def _abandoned_exports(out: Path, runs: Sequence[ListEntry]) -> list[Path]:
    """Folders that killed exports left in the folder of runs and in finished runs."""
    parents = [run.directory for run in runs if run.status == "finished"]
    if out.is_dir():
        parents.insert(0, out)
    exports = []
    for parent in parents:
        for prefix in (VTK_SCRATCH, CSV_SCRATCH, SO_FAR_SCRATCH):
            exports += abandoned(parent, prefix)
    return exports


def removal_text(removals: Sequence[Removal]) -> str:
    """What is to be removed, and its total size.

    Each of the first `_MOST_LINES` removals has a line with the time since its last change. Of a
    symbolic link, only the link is removed, which has no size. The total counts a draw in the
    directory of a spread that is removed too once.
    """
    now = time.time()
    removed_paths = {removal.path for removal in removals}
    lines = []
    numbers = Counter[str]()
    total = 0
    for removal in removals:
        size, changed = size_and_last_change(removal.path)
        if removal.path.is_symlink():
            size = 0
        age = duration_text(max(now - changed, 0.0))
        lines.append([removal.path.name, removal.label, age, bytes_text(size), removal.remark])
        numbers[removal.label] += 1
        if removed_paths.isdisjoint(removal.path.parents):
            total += size
    texts = []
    if lines:
        texts.append(aligned_with_text(lines[:_MOST_LINES], table_width()))
    if len(lines) > _MOST_LINES:
        texts.append(f"and {len(lines) - _MOST_LINES} more")
    kinds = [counted(number, label) for label, number in numbers.items()]
    texts.append(f"{', '.join(kinds) or 'nothing'} to remove, {bytes_text(total)}")
    return "\n".join(texts)


def remove(removals: Sequence[Removal]) -> dict[Path, str]:
    """Remove all that no process uses.

    Returns
    -------
    dict
        Paths that are left, with the reason: a run in progress, or an error of the system.
    """
    left: dict[Path, str] = {}
    # The directory of a sweep may contain runs.
    runs_first = sorted(removals, key=lambda removal: removal.kind is RemovalKind.SWEEP)
    for removal in runs_first:
        if any(removal.path in path.parents for path in left):
            left[removal.path] = "kept: it contains a run that is left"
            continue
        try:
            reason = _remove(removal)
        except OSError as error:
            reason = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
        if reason:
            left[removal.path] = reason
    return left


def _remove(removal: Removal) -> str:
    """Remove a directory or a file; return why it is left, or an empty text."""
    if removal.kind is RemovalKind.RUN:
        return _remove_run(removal.path)
    if removal.kind is RemovalKind.LOCK:
        with run_directory.locked([removal.path.with_suffix("")]) as ours:
            return "" if ours else _IN_PROGRESS  # a lock file goes with its lock
    _remove_directory(removal.path)
    return ""


def _remove_run(directory: Path) -> str:
    """Remove a run directory under the lock of the run; return why it is left, or an empty text.

    The directory is the place of the run, or one beside it of an unfinished or replaced run.
    """
    place = place_of(directory)
    with run_directory.locked([place]) as own_locks:
        if not own_locks:
            return _IN_PROGRESS
        run_directory.recover(place)
        # `recover` has removed the directory already if it was that of a replaced run.
        if directory.is_dir() and not directory.is_symlink():
            (directory / MANIFEST_NAME).unlink(missing_ok=True)
            _remove_contents(directory, keep=CASE_NAME)
        _remove_directory(directory)
    return ""


def _remove_contents(directory: Path, *, keep: str) -> None:
    """Remove everything in a directory except the entry with the name ``keep``."""
    for entry in sorted(directory.iterdir()):
        if entry.name == keep:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()


def _remove_directory(directory: Path) -> None:
    """Remove a directory; of a symbolic link, the link alone."""
    if directory.is_symlink():
        directory.unlink()
    elif directory.exists():
        shutil.rmtree(directory)
