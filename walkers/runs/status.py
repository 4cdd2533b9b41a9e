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
"""Statuses of points, in the order in which texts name them."""


@dataclass(frozen=True)
class PointState:
    """State of a point of a sweep, or of another run.

    Attributes
    ----------
    status
        ``finished``, ``failed``, ``running`` or ``missing``.
    directory
        The directory of the finished or failed run.
    reason
        Name of the failure.
    message
        Description of the failure; for a missing run that was interrupted, how much of it is done.
    lost
        Number of beads that were lost in a failure.
    result
        Result of the finished run, if it was read.
    """

    status: str
    directory: Path | None = None
    reason: str | None = None
    message: str | None = None
    lost: int = 0
    result: Results | None = None


def worst_status(points: Iterable[str]) -> str:
    """Status of a sweep from the statuses of its points.

    ``running`` if a point is, else ``interrupted`` if a point is missing, else ``failed`` if a
    point has failed, else ``finished``.
    """
    statuses = set(points)
    if "running" in statuses:
        return "running"
    if "missing" in statuses:
        return "interrupted"
    if "failed" in statuses:
        return "failed"
    return "finished"


def state_at(place: Path, directory: Path | None = None) -> PointState:
    """State of the run that belongs in a place.

    A run that is neither finished, running nor failed is ``missing``, with a message on how much of
    it is done if it was interrupted.

    Parameters
    ----------
    place
        The final directory of the run.
    directory
        The directory of an unfinished run whose state is asked for, even if a finished run is in
        the place. None: the finished run if there is one, otherwise the unfinished one.
    """
    if directory is None and is_finished(place):
        return PointState("finished", place)
    if is_locked(place):
        return PointState("running")
    run = directory or unfinished(place)
    try:
        failure = read_json(run / FAILURE_NAME)
        return PointState(
            "failed",
            directory=run,
            reason=str(failure["reason"]),
            message=str(failure["message"]),
            lost=int(failure.get("lost", 0)),
        )
    except (OSError, ValueError, KeyError, TypeError):
        share = share_kept(place)
        message = None if share is None else f"{100 * share:.0f} % done"
        return PointState("missing", message=message)


def status_text(numbers: Mapping[str, int]) -> str:
    """Numbers of points by status as text, such as ``8 finished, 2 failed``."""
    present = [status for status in _STATUSES if numbers.get(status)]
    return ", ".join(f"{numbers[status]} {status}" for status in present)
