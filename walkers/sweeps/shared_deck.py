"""Make the runs of several cases with one deck; that of a single case with its own.

A shared deck runs in the ``….incomplete`` of the first of its runs. What it wrote is parted among the runs, each of
which gets a directory like any other, with the deck and what the engine said in ``shared_deck``.
"""

from __future__ import annotations

import os
import shutil
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.runner.binary import Engine, read_audit
from walkers.runner.directory import (
    CASE_NAME,
    FIRST_SEGMENT,
    FinishedRun,
    finished_run,
    move_into_place,
    recover,
    room_on_disk,
    run_place,
    unfinished,
    write_deck,
    write_segment_record,
)
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning
from walkers.runner.files import settle, write_json
from walkers.runner.launch import EngineReport, Progress, check_room, launch
from walkers.runner.locks import locked
from walkers.runner.manifest import MANIFEST_NAME, manifest
from walkers.runner.provenance import look_ahead
from walkers.runner.segments import open_locked
from walkers.templates.deck import Deck, first_segment, render_shared_deck

DECK_FOLDER = "shared_deck"
"""In a run directory: the deck that made it together with others, and what the engine said."""


@dataclass(frozen=True)
class Made:
    """Runs that were wanted: the finished ones, by their names, which of these were found, and which others make."""

    runs: Mapping[str, FinishedRun]
    found: frozenset[str]
    busy: frozenset[str]


def make_runs(
    cases: Sequence[Case],
    out: Path,
    engine: Engine,
    *,
    force: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    time_limit: float | None = None,
) -> Made:
    """Make the runs that are missing, in one deck, and tabulate them; a single one goes on where it was interrupted.

    Parameters
    ----------
    cases
        Cases that may share a deck (`walkers.templates.scene`).
    out
        Folder of the run directories; made if need be.
    engine
        The binary.
    force
        Also make those that are there; they are replaced by finished ones only.
    on_progress
        Called a few times a second while the engine runs; what it raises ends the engine.
    time_limit
        Wall time in s that the engine may take, for each segment.

    Raises
    ------
    runner.EngineFailure
        If the engine fails. Of several cases nothing is left then: they are to be tried apart.
    """
    out.mkdir(parents=True, exist_ok=True)
    places = {run_place(case, engine, out): case for case in cases}
    with locked(places) as ours:
        for place in ours:
            recover(place)
        runs = {} if force else {place.name: run for place in places if (run := finished_run(place))}
        busy = frozenset(place.name for place in places if place not in ours and place.name not in runs)
        missing = {place: case for place, case in places.items() if place in ours and place.name not in runs}
        found = frozenset(runs)
        if missing:
            locks = [ours[place] for place in missing]
            runs |= _make(missing, out, engine, locks, on_progress, time_limit, anew=force)
    return Made(runs, found, busy)


def _make(
    missing: Mapping[Path, Case],
    out: Path,
    engine: Engine,
    locks: Sequence[int],
    on_progress: Callable[[Progress], None] | None,
    time_limit: float | None,
    *,
    anew: bool,
) -> dict[str, FinishedRun]:
    # Numpy and pyarrow are imported after the engine has run: who is in a hurry loads them while it does.
    if len(missing) == 1:
        ((place, case),) = missing.items()
        with open_locked(case, engine, place, locks, anew=anew) as run:
            run.make(on_progress=on_progress, time_limit=time_limit, is_steady=_are_steady)
            _tabulate(run.directory)
            return {place.name: run.finish()}
    runs: dict[str, FinishedRun] = {}
    left = {place.name: case for place, case in missing.items()}
    for attempt in next(iter(left.values())).run.attempts:
        watched = {"on_progress": on_progress, "time_limit": time_limit}
        made = _make_together(left, attempt, out, engine, locks, **watched)
        runs |= made
        left = {name: case for name, case in left.items() if name not in made}
        if not left:
            break
    return runs


def _make_together(
    cases: Mapping[str, Case], cycles: int, out: Path, engine: Engine, locks: Sequence[int], **watched: Any
) -> dict[str, FinishedRun]:
    """Make runs of so many cycles by one deck; those finished whose walkers are steady, or that take no more cycles.

    Whatever else there is of them goes: what fails together is to be made apart.
    """
    tried = {name: case.for_cycles(cycles) for name, case in cases.items()}
    deck, started = render_shared_deck(list(tried.values())), time.time()
    incomplete = unfinished(out / next(iter(cases)))
    shutil.rmtree(incomplete, ignore_errors=True)
    try:
        with room_on_disk(incomplete, deck.layout.bead_dump_bytes):
            _begin(incomplete, cases, deck)
            look_ahead()
            report = launch(deck, incomplete / DECK_FOLDER, engine, keep_open=locks, **watched)
            _part(incomplete, tried, deck, report)
            done = [name for name in cases if cycles >= cases[name].run.cycles or _are_steady(incomplete / name)]
            shared = {"first": next(iter(cases)), "runs": len(done), "walkers": len(deck.layout.walkers)}
            own = {"drive_from": 0, "segments": 1, "shared_deck": shared}
            for name in done:
                _tabulate(incomplete / name)
                said = manifest(cases[name], name, engine, report, started=started, directory=incomplete / name)
                write_json(incomplete / name / MANIFEST_NAME, {**said, **own}, at_once=False)
            settle()
            for name in done:
                move_into_place(incomplete / name, out / name)
    finally:
        shutil.rmtree(incomplete, ignore_errors=True)
    for name in done:  # what was left of a run that was once made alone, and killed
        shutil.rmtree(unfinished(out / name), ignore_errors=True)
    return {name: FinishedRun(out / name) for name in done}


def _begin(incomplete: Path, cases: Mapping[str, Case], deck: Deck) -> None:
    """Make the directories of a shared deck and of its runs; to others it is the first of the runs, unfinished."""
    check_room(incomplete.parent, 2 * deck.layout.bead_dump_bytes)  # the whole and its parts, side by side
    (incomplete / DECK_FOLDER).mkdir(parents=True)
    write_json(incomplete / CASE_NAME, next(iter(cases.values())).as_dict(), at_once=False)
    write_deck(deck, incomplete / DECK_FOLDER)
    for name, case in cases.items():
        (incomplete / name / FIRST_SEGMENT).mkdir(parents=True)
        write_json(incomplete / name / CASE_NAME, case.as_dict(), at_once=False)


def _part(incomplete: Path, cases: Mapping[str, Case], deck: Deck, report: EngineReport) -> None:
    """Give each run its part of what the deck wrote, and the deck."""
    from walkers.postprocess.splitting import split_output

    places = {incomplete / name / FIRST_SEGMENT: case for name, case in cases.items()}
    split_output(incomplete / DECK_FOLDER, deck.layout, places)
    for name, (place, case) in zip(cases, places.items(), strict=True):
        write_segment_record(place, first_segment(case), report)
        shutil.copytree(incomplete / DECK_FOLDER, incomplete / name / DECK_FOLDER, copy_function=_link)


def _link(source: str, to: str) -> None:
    """The same file in two places; a copy where the file system has no links."""
    try:
        os.link(source, to)
    except OSError:
        shutil.copyfile(source, to)


def _are_steady(directory: Path) -> bool:
    from walkers.postprocess.steady_state import are_steady

    return are_steady(directory)


def _tabulate(directory: Path) -> None:
    from walkers.postprocess.analysis import tabulate

    tabulate(directory)


def check_audit(engine: Engine, allow_failed_audit: bool) -> None:
    """Refuse an engine whose audit failed, unless told otherwise; warn of one that never had one.

    Raises
    ------
    runner.failures.AuditFailed
        If the record of the binary says so.
    """
    audit = read_audit(engine.sha256)
    if audit is None:
        message = "this engine was never audited; prove what it computes with: walkers audit"
        warnings.warn(message, UnauditedEngineWarning, stacklevel=3)
    elif not audit.passed and not allow_failed_audit:
        raise AuditFailed(audit.failures)
