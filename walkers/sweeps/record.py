"""What a sweep's directory holds: ``sweep.json``, the list of its points, each with the name of its run.

The runs themselves are beside the sweep's directory, shared by all sweeps of that folder: what is finished, failed or
being made is read from them and from nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.axes import plain
from walkers.inputs.case import Case
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.postprocess.analysis import RESULT_NAME, current_result
from walkers.runner.binary import Engine
from walkers.runner.directory import FAILURE_NAME, finished_run, run_place, unfinished
from walkers.runner.files import read_json, write_json
from walkers.runner.locks import is_locked
from walkers.runner.manifest import check_unchanged
from walkers.sweeps.columns import analyses_of_all, derived_columns, derived_of, result_columns, velocity_in

if TYPE_CHECKING:
    from walkers.inputs.sweep import Descent, Sweep

RECORD_NAME = "sweep.json"
PARSL = "parsl"
"""Folder of Parsl's scripts and logs in a sweep's directory."""
_FORMAT = 2


@dataclass(frozen=True)
class SweepRecord:
    """A sweep as its directory describes it.

    Attributes
    ----------
    directory
        Of the sweep; the folder of the runs is its parent.
    name, title
        Of the sweep.
    units
        From the keys that vary to their units, None where one has none.
    values
        Of each point, one a key.
    derived
        Of each point, one a column of `walkers.sweeps.columns.derived_columns`.
    runs
        Name of each point's run.
    descent
        How the points depend on each other, if they do.
    analyses
        Names of the analyses that mean something for its cases.
    file
        Tables of the sweep file; empty for one that was recorded before they were.
    """

    directory: Path
    name: str
    title: str
    units: Mapping[str, str | None]
    values: Sequence[Sequence[Any]]
    derived: Sequence[Sequence[float]]
    runs: Sequence[str]
    descent: Descent | None
    analyses: Sequence[str]
    file: Mapping[str, Any]

    @property
    def out(self) -> Path:
        """Folder of the run directories."""
        return self.directory.parent


def describe_sweep(sweep: Sweep, cases: Sequence[Case], engine: Engine, out: Path) -> SweepRecord:
    """The record of a sweep whose points have been resolved.

    Raises
    ------
    InputError
        If piles are to descend.
    """
    names = analyses_of_all(cases)
    if sweep.descent is not None and "velocity" not in result_columns(names):
        raise InputError(sweep.source, [Problem("descend", None, "expected walkers: a pile has no velocity")])
    return SweepRecord(
        directory=out / sweep.name,
        name=sweep.name,
        title=sweep.title,
        units=dict(zip(sweep.keys, sweep.units, strict=True)),
        values=[[_plain(value) for value in row] for row in sweep.rows],
        derived=[derived_of(case, names) for case in cases],
        runs=[run_place(case, engine, out).name for case in cases],
        descent=sweep.descent,
        analyses=names,
        file=sweep.file,
    )


def _plain(value: Any) -> Any:
    return [plain(part) for part in value] if isinstance(value, list) else plain(value)


def write_record(record: SweepRecord) -> None:
    """Make the sweep's directory, if need be, and write its ``sweep.json``."""
    record.directory.mkdir(parents=True, exist_ok=True)
    descent = record.descent
    write_json(
        record.directory / RECORD_NAME,
        {
            "format": _FORMAT,
            "name": record.name,
            "title": record.title,
            "file": dict(record.file),
            "units": dict(record.units),
            "descent": vars(descent) if descent else None,
            "analyses": list(record.analyses),
            "derived": list(derived_columns(record.analyses)),
            "points": [
                {"values": list(values), "derived": list(derived), "run": run}
                for values, derived, run in zip(record.values, record.derived, record.runs, strict=True)
            ],
        },
    )


def read_record(directory: str | Path) -> SweepRecord:
    """Read a sweep's directory.

    Raises
    ------
    InputError
        If it is none.
    """
    from walkers.inputs.sweep import Descent

    given, directory = directory, Path(directory).resolve()
    try:
        contents = read_json(directory / RECORD_NAME)
        points = contents["points"]
        return SweepRecord(
            directory=directory,
            name=contents["name"],
            title=contents["title"],
            units=contents["units"],
            values=[point["values"] for point in points],
            derived=[point["derived"] for point in points],
            runs=[point["run"] for point in points],
            descent=Descent(**contents["descent"]) if contents["descent"] else None,
            analyses=contents["analyses"],
            file=contents.get("file", {}),
        )
    except (FileNotFoundError, NotADirectoryError) as error:
        told = f"not a sweep: expected a folder with a {RECORD_NAME}, such as runs/fig2"
        raise InputError(str(given), [Problem("", None, told)]) from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(str(given), [Problem("", None, f"{RECORD_NAME} cannot be read ({error})")]) from error


@dataclass(frozen=True)
class PointState:
    """What has become of a point.

    Attributes
    ----------
    status
        ``finished``, ``failed``, ``running``, ``missing``, or ``not needed``: below where a descent ended.
    directory
        Of the finished run, or of what is left of the failed one; None if there is none.
    reason, message, lost
        Of a failure; the number of beads lost.
    """

    status: str
    directory: Path | None = None
    reason: str | None = None
    message: str | None = None
    lost: int = 0


def states(record: SweepRecord) -> list[PointState]:
    """What has become of each point, as the run directories say."""
    found = [_state(record.out / run) for run in record.runs]
    if record.descent is None:
        return found
    for chain in chains(record):
        stopped = False
        for number in chain:
            if stopped:
                found[number] = PointState("not needed")
            directory = found[number].directory
            if found[number].status == "finished" and directory is not None:
                stopped = record.descent.at_rest(velocity_of(directory))
    return found


def _state(place: Path) -> PointState:
    if finished_run(place) is not None:
        return PointState("finished", place)
    if is_locked(place):
        return PointState("running")
    incomplete = unfinished(place)
    try:
        failure = read_json(incomplete / FAILURE_NAME)
        return PointState(
            "failed", incomplete, str(failure["reason"]), str(failure["message"]), int(failure.get("lost", 0))
        )
    except (OSError, ValueError, KeyError, TypeError):
        return PointState("missing")


def chains(record: SweepRecord) -> list[list[int]]:
    """The descents of a sweep: numbers of their points, from the top."""
    steps = record.descent.steps if record.descent else len(record.runs)
    return [list(range(start, start + steps)) for start in range(0, len(record.runs), steps or 1)]


def velocity_of(directory: Path) -> float:
    """Mean velocity of a finished run, m/s, as its result says, of whatever version; NaN if its files are damaged."""
    try:
        check_unchanged(directory, [RESULT_NAME])
        return velocity_in(read_json(directory / RESULT_NAME))
    except (OSError, ValueError, KeyError, TypeError):
        with suppress(DamagedRunError):
            return velocity_in(result_in(directory))
        return nan


class DamagedRunError(WalkersError):
    """A finished run whose files were changed or cut since."""


def result_in(directory: Path) -> dict[str, Any]:
    """The result of a finished run.

    Raises
    ------
    DamagedRunError
        If it can neither be read nor be made anew from the dumps.
    """
    try:
        return current_result(directory)
    except (OSError, ValueError, KeyError, TypeError, IndexError, WalkersError) as error:
        raise DamagedRunError(f"{directory} is damaged ({error}): delete it to have it made again") from error
