"""Make the runs of several cases with one deck, that of a single case with its own; and a worker's part of it.

A shared deck runs in the ``….incomplete`` of the first of its runs. What it wrote is parted among the runs, each of
which gets a directory like any other, with the deck and what the engine said in ``shared_deck``.
"""

from __future__ import annotations

import errno
import os
import shutil
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.errors import Stopped, WalkersError
from walkers.postprocess.analysis import current_result, tabulate
from walkers.runner import failures
from walkers.runner.binary import Engine, find_engine, read_audit
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
from walkers.runner.files import settle, write_json
from walkers.runner.launch import EngineReport, Progress, check_room, launch
from walkers.runner.locks import locked
from walkers.runner.manifest import MANIFEST_NAME, manifest
from walkers.runner.provenance import look_ahead
from walkers.runner.segments import open_locked
from walkers.sweeps.record import velocity_in
from walkers.templates.deck import Deck, first_segment, render_shared_deck

DECK_FOLDER = "shared_deck"
"""In a run directory: the deck that made it together with others, and what the engine said."""
STOPS: dict[str, threading.Event] = {}
"""Of the sweeps that this process runs: set to end their engines and to let none begin."""


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
    force
        Also make those that are there; they are replaced by finished ones only.
    on_progress, time_limit
        Called a few times a second while the engine runs: what it raises ends the engine. Wall time in s that this may
        take for each segment.

    Raises
    ------
    runner.EngineFailure
        If the engine fails. Of several cases nothing is left then: they are to be tried apart.
    """
    out.mkdir(parents=True, exist_ok=True)
    places = {run_place(case, engine, out): case for case in cases}
    watched: dict[str, Any] = {"on_progress": on_progress, "time_limit": time_limit}
    with locked(places) as ours:
        for place in ours:
            recover(place)
        runs = {} if force else {place.name: run for place in places if (run := finished_run(place))}
        found = frozenset(runs)
        busy = frozenset(place.name for place in places if place not in ours and place.name not in runs)
        missing = {place: case for place, case in places.items() if place in ours and place.name not in runs}
        locks = [ours[place] for place in missing]
        if len(missing) == 1:
            ((place, case),) = missing.items()
            with open_locked(case, engine, place, locks, anew=force) as opened:
                opened.make(is_steady=_are_steady, **watched)
                tabulate(opened.directory)
                runs[place.name] = opened.finish()
        elif missing:
            left = {place.name: case for place, case in missing.items()}
            for cycles in next(iter(left.values())).run.attempts:
                if left:
                    runs |= _make_together(left, cycles, out, engine, locks, **watched)
                left = {name: case for name, case in left.items() if name not in runs}
    return Made(runs, found, busy)


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
            check_room(out, 2 * deck.layout.bead_dump_bytes)  # the whole and its parts, side by side
            (incomplete / DECK_FOLDER).mkdir(parents=True)
            write_deck(deck, incomplete / DECK_FOLDER)
            # To others it is the first of the runs, unfinished.
            for name, case in [(".", next(iter(cases.values()))), *cases.items()]:
                (incomplete / name).mkdir(exist_ok=True)
                write_json(incomplete / name / CASE_NAME, case.as_dict(), at_once=False)
            look_ahead()
            report = launch(deck, incomplete / DECK_FOLDER, engine, keep_open=locks, **watched)
            _part(incomplete, tried, deck, report)
            done = [name for name in cases if cycles >= cases[name].run.cycles or _are_steady(incomplete / name)]
            shared = {"first": next(iter(cases)), "runs": len(done), "walkers": len(deck.layout.walkers)}
            own = {"drive_from": 0, "segments": 1, "shared_deck": shared}
            for name in done:
                tabulate(incomplete / name)
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


def _part(incomplete: Path, cases: Mapping[str, Case], deck: Deck, report: EngineReport) -> None:
    """Give each run its part of what the deck wrote, and the deck."""
    from walkers.postprocess.splitting import split_output

    places = {incomplete / name / FIRST_SEGMENT: case for name, case in cases.items()}
    for place in places:
        place.mkdir(parents=True)
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
    from walkers.postprocess.gait import are_steady  # numpy is loaded while the engine runs

    return are_steady(directory)


def check_audit(engine: Engine, allow_failed_audit: bool) -> None:
    """Refuse an engine whose audit failed (`AuditFailed`), unless told otherwise; warn of one that never had one."""
    audit = read_audit(engine.sha256)
    if audit is None:
        message = "this engine was never audited; prove what it computes with: walkers audit"
        warnings.warn(message, failures.UnauditedEngineWarning, stacklevel=3)
    elif not audit.passed and not allow_failed_audit:
        raise failures.AuditFailed(audit.failures)


class SweepStopped(Stopped):
    """Somebody stopped the sweep while an engine ran."""


@dataclass(frozen=True)
class Report:
    """What became of a deck: velocities (m/s) of its finished runs (others are busy elsewhere), or its failure.

    A failure has the name of its class, what it says, and where its remains are.
    """

    finished: Mapping[str, float] = field(default_factory=dict)
    failure: str | None = None
    message: str = ""
    directory: str | None = None


def work(
    sweep: str,
    runs: Sequence[str],
    cases: Sequence[Case],
    out: Path,
    engine: Engine,
    time_limit: float | None,
    retries: int = 0,
) -> Report:
    """Make the runs of some names of one deck, on a worker; a deck that fails is tried again so often.

    Never raises what is known to happen: see `Report`.
    """
    stop = STOPS.get(sweep, threading.Event())

    def look(_: object = None) -> None:
        if stop.is_set():
            raise SweepStopped("stopped")

    try:
        look()
        own = find_engine(str(engine.path))
        if own.sha256 != engine.sha256:
            raise failures.EngineDiffers(own.path)
        if list(runs) != [run_place(case, own, out).name for case in cases]:
            raise failures.ProgramDiffers
        made = make_runs(cases, out, own, on_progress=look, time_limit=time_limit)
        return Report({name: velocity_in(current_result(run.directory)) for name, run in made.runs.items()})
    except (OSError, WalkersError) as error:
        if retries and not isinstance(error, SweepStopped):
            return work(sweep, runs, cases, out, engine, time_limit, retries - 1)
        reason, message, directory = type(error).__name__, str(error), None
        if isinstance(error, failures.EngineFailure):
            directory = str(unfinished(out / runs[0])) if error.directory else None
        elif isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            reason, message = failures.DiskFull.__name__, f"disk full: {error.filename or out}"
        elif isinstance(error, OSError) and error.filename:
            message = f"{error.filename}: {error.strerror}"
        return Report(failure=reason, message=message, directory=directory)
