"""Ensembles: the runs of several cases made by one deck, each a run directory of its own within the ensemble's.

An ensemble is made in ``ensembles/<name>-<hash>.incomplete`` and renamed at the end, which finishes all of its runs.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from walkers.inputs.case import Case
from walkers.runner.binary import Engine
from walkers.runner.directory import (
    CASE_NAME,
    FIRST_SEGMENT,
    REPLACED,
    UNFINISHED,
    FinishedRun,
    move_into_place,
    recover,
    room_on_disk,
    unfinished,
    write_deck,
    write_segment_record,
)
from walkers.runner.files import write_json
from walkers.runner.launch import EngineReport, check_room
from walkers.runner.locks import locked
from walkers.runner.manifest import MANIFEST_NAME, manifest
from walkers.runner.provenance import look_ahead
from walkers.templates.deck import Deck, Segment

FOLDER = "ensembles"


@dataclass
class OpenEnsemble:
    """Runs that are being made by one deck.

    Attributes
    ----------
    cases
        From the name of each run to its case, in the order of the deck.
    deck, engine
        What makes them.
    directory, place
        Where the ensemble is made and where it belongs.
    locks
        Descriptors of the lock files of the runs.
    started
        Seconds since the epoch.
    """

    cases: Mapping[str, Case]
    deck: Deck
    engine: Engine
    directory: Path
    place: Path
    locks: Sequence[int]
    started: float

    def run_directory(self, name: str) -> Path:
        """Where a run of the ensemble is made."""
        return self.directory / name

    def record(self, report: EngineReport, segment: Segment) -> None:
        """Say in each run what its segment is."""
        for name in self.cases:
            write_segment_record(self.run_directory(name) / FIRST_SEGMENT, segment, report)

    def keep(self, names: Collection[str]) -> None:
        """Leave out the runs that are not among these: they are to be made again, for longer."""
        for name in self.cases.keys() - set(names):
            shutil.rmtree(self.run_directory(name))
        self.cases = {name: case for name, case in self.cases.items() if name in names}

    def finish(self, report: EngineReport) -> dict[str, FinishedRun]:
        """Write the manifests and move the ensemble to its place; its runs by name."""
        walkers = len(self.deck.layout.walkers)  # those of runs that are made again among them
        shared = {"ensemble": self.place.name, "runs": len(self.cases), "walkers": walkers}
        for name, case in self.cases.items():
            made = self.run_directory(name)
            said = manifest(case, name, self.engine, report, started=self.started, directory=made)
            own = {"drive_from": 0, "segments": 1, "shared_deck": shared}
            write_json(made / MANIFEST_NAME, {**said, **own}, at_once=False)
        first = next(iter(self.cases.values()))
        said = manifest(
            first,
            self.place.name,
            self.engine,
            report,
            started=self.started,
            directory=self.directory,
            described=self.cases.keys(),
        )
        named = {**said, "shared_deck": {**shared, "names": list(self.cases)}}
        write_json(self.directory / MANIFEST_NAME, named, at_once=False)
        move_into_place(self.directory, self.place)
        for name in self.cases:  # what was left of a run that was once made alone, and killed
            shutil.rmtree(unfinished(self.place.parent.parent / name), ignore_errors=True)
        return {name: FinishedRun(self.place / name) for name in self.cases}


@contextmanager
def make_ensemble(
    cases: Mapping[str, Case], deck: Deck, engine: Engine, out: Path, locks: Sequence[int]
) -> Iterator[OpenEnsemble]:
    """Make a fresh directory for an ensemble whose runs are locked, with its deck and the cases of its runs.

    Left without `OpenEnsemble.finish`, nothing stays: what fails together is to be made apart.
    """
    digest = hashlib.sha256("\n".join(cases).encode()).hexdigest()[:12]
    place = out / FOLDER / f"{next(iter(cases)).rpartition('-')[0]}-{digest}"
    incomplete = unfinished(place)
    recover(place)
    shutil.rmtree(incomplete, ignore_errors=True)
    ensemble = OpenEnsemble(cases, deck, engine, incomplete, place, locks, time.time())
    try:
        with room_on_disk(incomplete, deck.layout.bead_dump_bytes):
            place.parent.mkdir(exist_ok=True)
            check_room(place.parent, 2 * deck.layout.bead_dump_bytes)  # the whole and its parts, side by side
            incomplete.mkdir()
            write_deck(deck, incomplete)
            for name, case in cases.items():
                (ensemble.run_directory(name) / FIRST_SEGMENT).mkdir(parents=True)
                write_json(ensemble.run_directory(name) / CASE_NAME, case.as_dict(), at_once=False)
            look_ahead()
            yield ensemble
    finally:
        shutil.rmtree(incomplete, ignore_errors=True)


def finished_places(out: Path) -> dict[str, Path]:
    """All finished runs of a folder, alone and in ensembles: from their names to their directories."""
    found: dict[str, Path] = {}
    for folder in (out, *_folders(out / FOLDER)):
        for entry in _folders(folder):
            if (entry / MANIFEST_NAME).is_file():
                found.setdefault(entry.name, entry)
    return found


def finished_place(out: Path, name: str) -> Path | None:
    """The directory of a finished run, alone or in an ensemble; None if there is none."""
    if (out / name / MANIFEST_NAME).is_file():
        return out / name
    try:
        ensembles = [path for path in (out / FOLDER).iterdir() if path.suffix not in (UNFINISHED, REPLACED)]
    except FileNotFoundError:
        return None
    places = (ensemble / name for ensemble in ensembles if name in _runs_in(ensemble))
    return next((place for place in places if (place / MANIFEST_NAME).is_file()), None)


@lru_cache(maxsize=100_000)
def _runs_in(ensemble: Path) -> frozenset[str]:
    """Names of the runs of an ensemble, which is never changed once it has its name."""
    return frozenset(path.name for path in _folders(ensemble))


def _folders(out: Path) -> list[Path]:
    try:
        with os.scandir(out) as entries:
            return sorted(
                Path(entry) for entry in entries if entry.is_dir() and not entry.name.endswith((UNFINISHED, REPLACED))
            )
    except (FileNotFoundError, NotADirectoryError):
        return []


def remove_remains(out: Path) -> None:
    """Remove ensembles that were being made when their makers were killed, unless engines still write into them."""
    for incomplete in (out / FOLDER).glob(f"*{UNFINISHED}"):
        places = [out / path.name for path in _folders(incomplete)]
        with locked(places) as ours:
            # Whoever makes an ensemble has its runs locked before its directory is there.
            if places and len(ours) == len(places):
                shutil.rmtree(incomplete, ignore_errors=True)
