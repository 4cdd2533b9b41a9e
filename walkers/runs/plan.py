"""What ``walkers run`` would do for a case: where its run belongs, whether it is there, its cost.

Nothing is written, and no engine is started.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from walkers.inputs.tables.case import Case
from walkers.rounding import duration_text
from walkers.runner.binary import find_engine
from walkers.runner.cost import PROGRAM_SECONDS, predicted_overhead, predicted_seconds
from walkers.runner.run_directory import is_finished, run_place
from walkers.runs.listing import run_text
from walkers.runs.making import share_kept
from walkers.runs.names import Reference
from walkers.runs.status import state_at
from walkers.terminal import HEADING, styled, styled_status
from walkers.text import printable


@dataclass(frozen=True)
class RunPlan:
    """What a run of a case would do.

    Attributes
    ----------
    case
        The case.
    directory
        The final directory of the run.
    status
        ``finished``, ``running``, ``failed``, ``interrupted`` or ``missing``.
    result
        The status and the main number of a finished run as text; of others, the status with how
        much of the run is done.
    seconds
        Predicted run time of what is missing, s; 0 of a finished run.
    again
        Whether a finished run would be made again.
    """

    case: Case
    directory: Path
    status: str
    result: str
    seconds: float
    again: bool = False

    def as_text(self) -> str:
        """The plan in a few lines."""
        title = printable(f"{self.case.name}: {self.case.title}").rstrip(": ")
        return "\n".join(
            [
                styled(title, HEADING),
                f"  status     {styled_status(self.result)}",
                f"  to do      {self._task}",
                f"  directory  {self.directory}",
            ]
        )

    @property
    def is_run(self) -> bool:
        """Whether the engine would be started."""
        if self.status == "finished":
            return self.again
        return self.status != "running"

    @property
    def _task(self) -> str:
        """What would be done, with the predicted time."""
        if self.status == "running":
            return "nothing: another process is running it"
        if not self.is_run:
            return "nothing: the result is printed"
        verb = "run"
        if self.status == "interrupted":
            verb = "continue the run"
        elif self.again:
            verb = "run again and replace the result"
        return f"{verb}, predicted {duration_text(self.seconds)}"


def plan_run(named: Reference, engine: str | None = None, *, force: bool = False) -> RunPlan:
    """Plan the run of a case; nothing is written.

    Parameters
    ----------
    named
        The case, or a run.
    engine
        Name or path of the binary; default: the installed one.
    force
        Whether a finished run would be made again.

    Raises
    ------
    InputError
        If the case cannot be used.
    EngineFailure
        If there is no engine, and the name is not that of a run.
    """
    case = named.case
    place = named.path
    if named.kind != "run" or named.changes:
        place = run_place(case, find_engine(engine), named.folder)
    seconds = PROGRAM_SECONDS + predicted_seconds(case) + predicted_overhead([case])
    if is_finished(place):
        missing_seconds = seconds if force else 0.0
        return RunPlan(case, place, "finished", run_text(place), missing_seconds, again=force)
    state = state_at(place)
    share = None if force else share_kept(place)
    if state.status == "missing" and share is not None:
        return RunPlan(
            case, place, "interrupted", f"interrupted, {state.message}", seconds * (1.0 - share)
        )
    return RunPlan(case, place, state.status, _status_text(state.status, state.message), seconds)


def _status_text(status: str, message: str | None) -> str:
    """A status with the message of a failure."""
    return f"{status}: {message}" if message else status
