"""Make the runs of several cases with one deck; of a single case with its own."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkers.inputs.case import WalkerCase
from walkers.inputs.pile import PileCase
from walkers.inputs.reading import AnyCase
from walkers.runner.audits import read_audit
from walkers.runner.binary import Engine
from walkers.runner.directory import FinishedRun, finished_run, make_run, recover, run_place
from walkers.runner.ensemble import finished_place, make_ensemble
from walkers.runner.failures import AuditFailed, RunBusy, UnauditedEngineWarning
from walkers.runner.launch import Progress, launch
from walkers.runner.locks import locked
from walkers.runner.segments import run_pile
from walkers.templates.deck import render_deck, render_shared_deck


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


_NONE = Made({}, frozenset(), frozenset())


def make_together(
    cases: Sequence[WalkerCase],
    out: Path,
    engine: Engine,
    *,
    force: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    time_limit: float | None = None,
) -> Made:
    """Make the runs that are missing, in one deck, and tabulate them.

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
        Wall time in s that the engine may take.

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
            runs |= _make(missing, out, engine, locks, on_progress, time_limit)
    return Made(runs, found, busy)


def make_any(
    cases: Sequence[AnyCase],
    out: Path,
    engine: Engine,
    on_progress: Callable[[object], None],
    time_limit: float | None,
) -> Made:
    """`make_together` for cases of any kind: piles are made one by one, and go on where they were interrupted."""
    walkers = [case for case in cases if isinstance(case, WalkerCase)]
    made = make_together(walkers, out, engine, on_progress=on_progress, time_limit=time_limit) if walkers else _NONE
    for case in cases:
        if isinstance(case, PileCase):
            made = _with(made, _make_pile(case, out, engine, on_progress, time_limit))
    return made


def _make_pile(
    case: PileCase, out: Path, engine: Engine, on_progress: Callable[[object], None], time_limit: float | None
) -> Made:
    from walkers.postprocess.pile_result import current_pile_result

    name = run_place(case, engine, out).name
    try:
        run, found = run_pile(case, engine, out, on_progress=on_progress, time_limit=time_limit)
    except RunBusy:
        return Made({}, frozenset(), frozenset({name}))
    current_pile_result(run.directory)
    return Made({name: run}, frozenset({name} if found else ()), frozenset())


def _with(one: Made, other: Made) -> Made:
    return Made({**one.runs, **other.runs}, one.found | other.found, one.busy | other.busy)


def _finished(out: Path, name: str) -> FinishedRun | None:
    place = finished_place(out, name)
    return finished_run(place) if place else None


def _make(
    missing: Mapping[Path, WalkerCase],
    out: Path,
    engine: Engine,
    locks: Sequence[int],
    on_progress: Callable[[Progress], None] | None,
    time_limit: float | None,
) -> dict[str, FinishedRun]:
    # Numpy and pyarrow are imported after the engine has run: who is in a hurry loads them while it does.
    cases = list(missing.values())
    if len(cases) == 1:
        (place,) = missing
        with make_run(cases[0], render_deck(cases[0]), engine, place, locks) as run:
            report = launch(
                run.deck, run.directory, engine, on_progress=on_progress, time_limit=time_limit, keep_open=locks
            )
            _tabulate([run.directory])
            return {place.name: run.finish(report)}
    named = {place.name: case for place, case in missing.items()}
    with make_ensemble(named, render_shared_deck(cases), engine, out, locks) as ensemble:
        report = launch(
            ensemble.deck, ensemble.directory, engine, on_progress=on_progress, time_limit=time_limit, keep_open=locks
        )
        from walkers.postprocess.splitting import split_output

        directories = {ensemble.run_directory(name): case for name, case in named.items()}
        split_output(ensemble.directory, ensemble.deck.layout, directories)
        _tabulate(directories)
        return ensemble.finish(report)


def _tabulate(directories: Iterable[Path]) -> None:
    from walkers.postprocess.result import tabulate

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
