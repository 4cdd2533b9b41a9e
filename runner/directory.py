"""Run directories: one a run, named by the case and by the hash of all that determines the run.

A run is made in ``<name>-<hash>.incomplete`` and renamed to ``<name>-<hash>`` when its manifest has been written, last:
a directory without a manifest is not a run, and a run that is made anew replaces the old one only when it has finished.
While it is made, the file ``<name>-<hash>.lock`` is locked, also by the engine itself (see `walkers.runner.locks`).
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from walkers.inputs.case import WalkerCase
from walkers.inputs.errors import Stopped, WalkersError
from walkers.inputs.pile import PileCase
from walkers.runner.audits import read_audit
from walkers.runner.binary import Engine
from walkers.runner.failures import DiskFull, RunBusy
from walkers.runner.files import fsync_path, read_json, settle, write_json
from walkers.runner.launch import EngineReport
from walkers.runner.locks import locked
from walkers.templates.deck import CONTENT_VERSION, DECK_NAME, LAYOUT_NAME, Deck
from walkers.templates.layout import Layout

MANIFEST_NAME = "manifest.json"
CASE_NAME = "case.json"
FAILURE_NAME = "failure.json"
UNFINISHED = ".incomplete"
REPLACED = ".replaced"
_FORMAT = 1
_LONGEST_NAME = 80


def run_name(case: WalkerCase | PileCase, engine: Engine) -> str:
    """Name of a run's directory: the case's name and 12 hex digits over resolved case, engine and the decks' version.

    The wording of a deck is not among it: a comment in a template leaves the runs that are there.
    """
    determinants = {"case": case.determinants(), "deck": CONTENT_VERSION, "engine": engine.sha256, "format": _FORMAT}
    text = json.dumps(determinants, sort_keys=True, separators=(",", ":"))
    return f"{name_of(case.name)}-{hashlib.sha256(text.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"


def name_of(case_name: str) -> str:
    """A case's name as a run's begins with it."""
    return re.sub(r"[^\w.+-]+", "_", case_name)[:_LONGEST_NAME]


def run_place(case: WalkerCase | PileCase, engine: Engine, out: Path) -> Path:
    """Where the run of a case belongs; one that shared a deck is within an ensemble."""
    return out / run_name(case, engine)


@dataclass(frozen=True)
class FinishedRun:
    """A run that has its manifest."""

    directory: Path

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest."""
        return read_json(self.directory / MANIFEST_NAME)

    @property
    def case(self) -> WalkerCase:
        """The resolved case."""
        return WalkerCase.from_dict(read_json(self.directory / CASE_NAME))

    @property
    def layout(self) -> Layout:
        """What the dumps hold."""
        return Layout.from_dict(read_json(self.directory / LAYOUT_NAME))


def finished_run(directory: Path) -> FinishedRun | None:
    """The run in a directory, or None if it has no manifest."""
    return FinishedRun(directory) if (directory / MANIFEST_NAME).is_file() else None


@dataclass
class OpenRun:
    """A run that is being made, in a directory of its own beside its final place; ``locks`` are file descriptors."""

    case: WalkerCase
    deck: Deck
    engine: Engine
    directory: Path
    place: Path
    locks: Sequence[int]
    started: float

    def finish(self, report: EngineReport) -> FinishedRun:
        """Write the manifest, last, and move the directory to its place."""
        made = self.directory
        write_json(
            made / MANIFEST_NAME,
            manifest(self.case, self.place.name, self.engine, report, started=self.started, directory=made),
        )
        move_into_place(made, self.place)
        return FinishedRun(self.place)


def move_into_place(made: Path, place: Path) -> None:
    """Give a directory that has been made its name, safe on disk, in exchange for one that has it already."""
    settle(made)
    recover(place)
    replaced = _aside(place)
    if place.exists():
        place.rename(replaced)
    made.rename(place)
    fsync_path(place.parent)
    shutil.rmtree(replaced, ignore_errors=True)


def _aside(place: Path) -> Path:
    return place.with_name(place.name + REPLACED)


@contextmanager
def open_run(case: WalkerCase, deck: Deck, engine: Engine, out: Path) -> Iterator[OpenRun]:
    """Make a fresh directory for a run, with its case, deck, files and layout in it.

    Parameters
    ----------
    case, deck, engine
        What determines the run.
    out
        Folder of the run directories; made if need be.

    Yields
    ------
    OpenRun
        Call its `OpenRun.finish` at the end. Left without that, the directory stays as ``….incomplete``, with a
        ``failure.json`` if something failed.

    Raises
    ------
    RunBusy
        If another process is making the same run.
    DiskFull
        If there is no room even for the deck.
    """
    place = run_place(case, engine, out)
    out.mkdir(parents=True, exist_ok=True)
    with locked([place]) as ours:
        if place not in ours:
            raise RunBusy(unfinished(place))
        with make_run(case, deck, engine, place, list(ours.values())) as run:
            yield run


def unfinished(place: Path) -> Path:
    """Where the run of a place is made."""
    return place.with_name(place.name + UNFINISHED)


@contextmanager
def make_run(case: WalkerCase, deck: Deck, engine: Engine, place: Path, locks: Sequence[int]) -> Iterator[OpenRun]:
    """`open_run` for somebody who has locked the place already."""
    incomplete = unfinished(place)
    recover(place)
    shutil.rmtree(incomplete, ignore_errors=True)
    run = OpenRun(case, deck, engine, incomplete, place, locks, time.time())
    try:
        with room_on_disk(incomplete, deck):
            _write_deck(run)
            yield run
    except Stopped:
        raise
    except (WalkersError, OSError) as failure:
        record_failure(incomplete, failure)
        raise


def recover(place: Path) -> None:
    """Undo a replacement that was interrupted between its two renames; end one that was interrupted after them."""
    replaced = _aside(place)
    if not replaced.exists():
        return
    if place.exists():
        shutil.rmtree(replaced)
    else:
        replaced.rename(place)


@contextmanager
def room_on_disk(incomplete: Path, deck: Deck) -> Iterator[None]:
    """Turn the system's word for a full disk into a `DiskFull`."""
    import errno

    try:
        yield
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise DiskFull(deck.layout.bead_dump_bytes, shutil.disk_usage(incomplete.parent).free, incomplete) from error


def _write_deck(run: OpenRun) -> None:
    run.directory.mkdir()
    write_deck(run.deck, run.directory)
    write_json(run.directory / CASE_NAME, run.case.as_dict())


def write_deck(deck: Deck, directory: Path) -> None:
    """Write a deck, its files and its layout into a directory."""
    for name, text in {DECK_NAME: deck.text, **deck.files}.items():
        (directory / name).write_text(text, encoding="utf-8", errors="surrogateescape")
    write_json(directory / LAYOUT_NAME, deck.layout.as_dict())


def record_failure(incomplete: Path, failure: Exception) -> None:
    """Leave word of a failure in the directory of an unfinished run."""
    said = {"reason": type(failure).__name__, "message": str(failure), "lost": getattr(failure, "lost", 0)}
    with suppress(OSError):  # a full disk: the message reaches the user all the same
        write_json(incomplete / FAILURE_NAME, said)


def manifest(
    case: WalkerCase | PileCase, name: str, engine: Engine, report: EngineReport, *, started: float, directory: Path
) -> dict[str, Any]:
    """What the manifest of a run says."""
    finished = time.time()
    try:
        own_version = version("granular-walkers")
    except PackageNotFoundError:
        own_version = "not installed"
    audit = read_audit(engine.sha256)
    return {
        "format": _FORMAT,
        "status": "finished",
        "name": case.name,
        "run": name,
        "engine": {
            "path": str(engine.path),
            "version": report.version,
            "sha256": engine.sha256,
            "audit": audit.summary() if audit else None,
        },
        "granular_walkers": own_version,
        "host": platform.node(),
        "platform": platform.platform(),
        "started": _iso(started),
        "finished": _iso(finished),
        "seconds": {
            "total": finished - started,
            "engine": report.wall_seconds,
            "engine_loop": report.loop_seconds,
        },
        "steps": report.steps,
        "steps_per_second": report.steps / report.loop_seconds if report.loop_seconds else None,
        "files": {path.name: path.stat().st_size for path in sorted(directory.iterdir()) if path.is_file()},
    }


def _iso(seconds: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))
