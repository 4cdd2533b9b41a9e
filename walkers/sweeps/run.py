"""A sweep from its file to its directory: planned, and run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkers.inputs.case import Case
from walkers.inputs.errors import check_utf8
from walkers.inputs.sweep import Sweep
from walkers.runner.binary import Engine, find_engine
from walkers.runner.cost import predicted_seconds
from walkers.runner.failures import OutputGone
from walkers.sweeps.packing import PlannedDeck, makespan, pack, unfinished_parts
from walkers.sweeps.record import RECORD_NAME, SweepRecord, describe_sweep, states, write_record
from walkers.sweeps.scheduler import Failure, Options, SweepProgress, final_failures, schedule
from walkers.sweeps.shared_deck import check_audit
from walkers.sweeps.site import check_path

_SETTLED = ("finished", "not needed")


@dataclass(frozen=True)
class SweepPlan:
    """What a sweep would do.

    Attributes
    ----------
    record, cases
        The sweep, and the cases of its points.
    engine, options
        The binary, and how it is to be run.
    decks
        Those that are missing. Of a sweep with a descent all down to its bottom: it may end earlier.
    statuses
        Of the points, see `walkers.sweeps.record.PointState`.
    final
        Points that failed before and are not run again.
    """

    record: SweepRecord
    cases: Sequence[Case]
    engine: Engine
    decks: Sequence[PlannedDeck]
    statuses: Sequence[str]
    options: Options
    final: list[Failure]

    @property
    def core_seconds(self) -> float:
        """Predicted time of the engines, over all of their MPI processes, s."""
        return sum(deck.seconds * max(self.cases[point].run.ranks for point in deck.points) for deck in self.decks)

    @property
    def wall_seconds(self) -> float:
        """Predicted time until all is done, s."""
        return makespan((deck.seconds for deck in self.decks), self.options.decks_at_once)

    @property
    def core_seconds_apart(self) -> float:
        """What the same points would cost with one deck a point, s."""
        missing = {point for deck in self.decks for point in deck.points}
        return sum(predicted_seconds(self.cases[point]) * self.cases[point].run.ranks for point in missing)

    def as_text(self) -> str:
        """The plan in a few lines."""
        record = self.record
        told = ", ".join(f"{count} {status}" for status, count in sorted(Counter(self.statuses).items()))
        keys = ", ".join(f"{key} ({unit})" if unit else key for key, unit in record.units.items())
        atmost = "at most " if record.descent else ""
        lines = [
            f"{record.name}: {record.title}".rstrip(": "),
            f"  varied     {keys}" if keys else "  varied     nothing",
            f"  points     {len(record.runs)}: {told}",
            f"  to do      {atmost}{sum(len(deck.points) for deck in self.decks)} points in {len(self.decks)} decks",
            f"  predicted  {atmost}{self.core_seconds:.0f} core-seconds ({self.core_seconds_apart:.0f} with a deck a "
            f"point), {self.wall_seconds:.0f} s with {self.options.decks_at_once} at once",
            f"  directory  {record.directory}",
        ]
        return "\n".join(lines)


def plan_sweep(sweep: Sweep, out: Path, options: Options, engine: str | None = None) -> SweepPlan:
    """Resolve a sweep's points and see what is missing; nothing is written.

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

    Raises
    ------
    InputError
        If a point cannot be used, or a cluster's shell would not take the folder for one.
    runner.EngineFailure
        If there is no engine.
    """
    check_utf8(out.absolute())
    binary = find_engine(engine)
    cases = list(sweep.cases())
    options = options.for_ranks(max(case.run.ranks for case in cases))
    record = describe_sweep(sweep, cases, binary, out)
    if options.site is not None:
        check_path(record.directory)
    found = states(record)
    statuses = [state.status for state in found]
    final = final_failures(record, found, options)
    settled = {point for point, status in enumerate(statuses) if status in _SETTLED}
    settled |= {failure.point for failure in final}
    numbered = dict(enumerate(cases))
    packed = pack(numbered, options.decks_at_once, options.longest_seconds)
    decks = [part for deck in packed for part in unfinished_parts(deck.points, numbered, settled.__contains__)]
    return SweepPlan(record, cases, binary, decks, statuses, options, final)


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
    sweep, out, options, engine
        As for `plan_sweep`.
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
        If a point cannot be used.
    runner.EngineFailure
        If there is no engine, its audit failed, or somebody removed the sweep's directory meanwhile.
    sweeps.scheduler.ClusterFailed
        If the cluster's jobs end without having worked.
    """
    plan = plan_sweep(sweep, out, options, engine)
    if plan.decks:
        check_audit(plan.engine, allow_failed_audit)
    write_record(plan.record)
    if not plan.decks:
        return plan.record, plan.final
    failures = schedule(plan.record, plan.cases, plan.engine, plan.options, on_progress)
    if not (plan.record.directory / RECORD_NAME).is_file():
        raise OutputGone(plan.record.directory)
    return plan.record, failures
