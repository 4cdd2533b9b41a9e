"""A sweep from its file to its directory: planned, and run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from walkers.inputs.errors import check_utf8
from walkers.inputs.sweep import Sweep
from walkers.runner.binary import find_engine
from walkers.runner.failures import OutputGone
from walkers.sweeps.record import RECORD_NAME, SweepRecord, describe_sweep, states, write_record
from walkers.sweeps.scheduler import Failure, Options, SweepPlan, SweepProgress, missing_decks, schedule
from walkers.sweeps.shared_deck import check_audit
from walkers.sweeps.site import check_path


def plan_sweep(sweep: Sweep, out: Path, options: Options, engine: str | None = None) -> SweepPlan:
    """Resolve a sweep's points and see what is missing; nothing is written.

    What it is given, and raises, is as of `run_sweep`.
    """
    check_utf8(out.absolute())
    binary = find_engine(engine)
    cases = list(sweep.cases())
    options = options.for_ranks(max(case.run.ranks for case in cases))
    record = describe_sweep(sweep, cases, binary, out)
    if options.site is not None:
        check_path(record.directory)
    found = states(record)
    final = [
        Failure(point, run, state.reason or "", state.message or "", str(state.directory))
        for point, (run, state) in enumerate(zip(record.runs, found, strict=True))
        if state.status == "failed" and state.reason in options.final
    ]
    settled = {point for point, state in enumerate(found) if state.status in ("finished", "not needed")}
    settled |= {failure.point for failure in final}
    decks = missing_decks(cases, range(len(cases)), options, settled.__contains__)
    return SweepPlan(record, cases, binary, decks, [state.status for state in found], options, final)


def run_sweep(
    sweep: Sweep,
    out: Path,
    options: Options,
    *,
    engine: str | None = None,
    allow_failed_audit: bool = False,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> tuple[SweepRecord, list[Failure]]:
    """Make all runs of a sweep that are missing.

    Parameters
    ----------
    sweep
        From `walkers.inputs.sweep.load_sweep`.
    out
        Folder of the run directories.
    options
        How it is to be run.
    engine
        Name or path of the binary; see `walkers.runner.find_engine`.
    allow_failed_audit
        Run on an engine that failed its audit.
    on_progress
        Called a few times a second.

    Returns
    -------
    record
        The sweep; `walkers.sweeps.table.load` reads the table from ``record.directory``.
    failures
        The points that failed.

    Raises
    ------
    InputError
        If a point cannot be used, or a cluster's shell would not take the folder for one.
    runner.EngineFailure
        If there is no engine, its audit failed, or somebody removed the sweep's directory meanwhile.
    sweeps.scheduler.ClusterFailed
        If the cluster's jobs end without having worked.
    """
    plan = plan_sweep(sweep, out, options, engine)
    record = plan.record
    if plan.decks:
        check_audit(plan.engine, allow_failed_audit)
    write_record(record)
    if not plan.decks:
        return record, plan.final
    failures = schedule(plan, on_progress)
    if not (record.directory / RECORD_NAME).is_file():
        raise OutputGone(record.directory)
    return record, failures
