"""Status of runs on disk: finished, failed, running or missing, with reasons and shares of work."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from walkers.files import read_json
from walkers.postprocess.measure.results import Results
from walkers.runner.run_directory import FAILURE_NAME, is_finished, is_locked, unfinished
from walkers.runs.making import share_kept

_STATUSES = ("finished", "running", "failed", "missing")


@dataclass(frozen=True)
class PointState:
    """State of a point: finished, failed, running or missing.

    ``directory`` is the directory of the finished or failed run, ``result`` its result if it was read. ``reason``,
    ``message`` and ``lost`` describe a failure. The ``message`` of a missing point whose run was interrupted says how
    much of it is done.
    """

    status: str
    directory: Path | None = None
    reason: str | None = None
    message: str | None = None
    lost: int = 0
    result: Results | None = None


def worst_status(points: Iterable[str]) -> str:
    """Status of a sweep from its points: running, interrupted or failed if one is, in this order, or finished."""
    statuses = set(points)
    worst = {"running": "running", "missing": "interrupted", "failed": "failed"}
    return next(
        (status for status_of_point, status in worst.items() if status_of_point in statuses),
        "finished",
    )


def state_at(place: Path, directory: Path | None = None) -> PointState:
    """State of the run that belongs in a place, or with a ``directory`` of the unfinished run in it."""
    if directory is None and is_finished(place):
        return PointState("finished", place)
    if is_locked(place):
        return PointState("running")
    directory = directory or unfinished(place)
    try:
        failure = read_json(directory / FAILURE_NAME)
        reason, message = str(failure["reason"]), str(failure["message"])
        return PointState("failed", directory, reason, message, int(failure.get("lost", 0)))
    except (OSError, ValueError, KeyError, TypeError):
        share = share_kept(place)
        done = None if share is None else f"{100 * share:.0f} % done"
        return PointState("missing", message=done)


def status_text(numbers: Mapping[str, int]) -> str:
    """Numbers of points by status as text: ``8 finished, 2 failed``."""
    return ", ".join(f"{numbers[status]} {status}" for status in _STATUSES if numbers.get(status))
