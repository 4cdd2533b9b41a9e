"""Make the runs of several cases with one deck; that of a single case with its own."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.runner.audits import read_audit
from walkers.runner.binary import Engine
from walkers.runner.directory import FIRST_SEGMENT, FinishedRun, finished_run, recover, run_place
from walkers.runner.ensemble import finished_place, make_ensemble
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning
from walkers.runner.launch import Progress, launch
from walkers.runner.locks import locked
from walkers.runner.segments import open_locked
from walkers.templates.deck import first_segment, render_shared_deck


@dataclass(frozen=True)
class Made:
    """What has become of cases whose runs were wanted, by the names of the runs.

    Attributes
    ----------
    runs
        Finished.
    found
        Names of those that were there before.
    busy
        Names of those that somebody else is making.
    """

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
        Cases that may share a deck (`walkers.templates.sharing`).
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
        runs = {} if force else {place.name: run for place in places if (run := _finished(out, place.name))}
        busy = frozenset(place.name for place in places if place not in ours and place.name not in runs)
        missing = {place: case for place, case in places.items() if place in ours and place.name not in runs}
        found = frozenset(runs)
        if missing:
            locks = [ours[place] for place in missing]
            runs |= _make(missing, out, engine, locks, on_progress, time_limit, anew=force)
    return Made(runs, found, busy)


def _finished(out: Path, name: str) -> FinishedRun | None:
    place = finished_place(out, name)
    return finished_run(place) if place else None


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
            _tabulate([run.directory])
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
    cases: Mapping[str, Case],
    cycles: int,
    out: Path,
    engine: Engine,
    locks: Sequence[int],
    **watched: Any,
) -> dict[str, FinishedRun]:
    """Make runs of so many cycles by one deck; those finished whose walkers are steady, or that take no more cycles."""
    tried = [case.for_cycles(cycles) for case in cases.values()]
    with make_ensemble(cases, render_shared_deck(tried), engine, out, locks) as ensemble:
        report = launch(ensemble.deck, ensemble.directory, engine, keep_open=locks, **watched)
        from walkers.postprocess.splitting import split_output

        ensemble.record(report, first_segment(tried[0]))
        places = [ensemble.run_directory(name) / FIRST_SEGMENT for name in cases]
        split_output(ensemble.directory, ensemble.deck.layout, dict(zip(places, tried, strict=True)))
        done = [
            name
            for name, case in cases.items()
            if cycles >= case.run.cycles or _are_steady(ensemble.run_directory(name))
        ]
        if not done:
            return {}
        ensemble.keep(done)
        _tabulate(ensemble.run_directory(name) for name in done)
        return ensemble.finish(report)


def _are_steady(directory: Path) -> bool:
    from walkers.postprocess.steady_state import are_steady

    return are_steady(directory)


def _tabulate(directories: Iterable[Path]) -> None:
    from walkers.postprocess.analysis import tabulate

    for directory in directories:
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
