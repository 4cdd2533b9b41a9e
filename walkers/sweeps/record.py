"""What a sweep's directory holds: ``sweep.json``, the list of its points, each with the name of its run.

The runs themselves are beside the sweep's directory, shared by all sweeps of that folder: what is finished, failed or
being made is read from them and from nowhere else. What a point shows in the table (`walkers.sweeps.table`) is what
varied, what follows from its case, and what its run gave.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.axes import is_axis, plain
from walkers.inputs.case import Case
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError, Problem, WalkersError, refused
from walkers.postprocess.analysis import RESULT_NAME, Described, analyses, analyses_in, analyses_of, current_result
from walkers.runner.binary import Engine
from walkers.runner.directory import FAILURE_NAME, finished_run, run_place, unfinished
from walkers.runner.files import read_json, write_json
from walkers.runner.locks import is_locked
from walkers.runner.manifest import check_unchanged

if TYPE_CHECKING:
    from walkers.inputs.sweep import Descent, Sweep

RECORD_NAME = "sweep.json"
PARSL = "parsl"
"""Folder of Parsl's scripts and logs in a sweep's directory."""
_FORMAT = 2
_DRIVE = {
    "frequency": ("Hz", "of the drive"),
    "peak_acceleration": ("m/s^2", "of the boundary"),
    "peak_velocity": ("m/s", "of the boundary"),
    "amplitude": ("m", "of the boundary's displacement"),
}
"""Columns that every case has."""


@dataclass(frozen=True)
class SweepRecord:
    """A sweep as its directory describes it.

    ``units`` has the keys that vary; of each point ``values`` has one a key, ``derived`` one a column of
    `derived_columns`, ``runs`` the name of its run. ``analyses`` are those that mean something for its cases; ``file``
    has the tables of the sweep file, if they were recorded.
    """

    directory: Path
    name: str
    title: str
    units: Mapping[str, str | None]
    values: Sequence[Sequence[Any]]
    derived: Sequence[Mapping[str, float]]
    runs: Sequence[str]
    descent: Descent | None
    analyses: Sequence[str]
    file: Mapping[str, Any]

    @property
    def out(self) -> Path:
        """Folder of the run directories."""
        return self.directory.parent

    @property
    def axes(self) -> list[tuple[str, ...]]:
        """The keys that vary, those together that its file has in one ``[[zip]]`` or ``[[sample]]``."""
        together = [flatten(table, is_axis) for table in self.file.get("zip", ())]
        together += [flatten(table["ranges"], is_axis) for table in self.file.get("sample", ())]
        axis_of = {key: tuple(keys) for keys in together for key in keys}
        return list(dict.fromkeys(axis_of.get(key, (key,)) for key in self.units))

    @property
    def chains(self) -> list[list[int]]:
        """The descents: numbers of their points, from the top. All points where there is no descent."""
        steps = self.descent.steps if self.descent else len(self.runs)
        return [list(range(start, start + steps)) for start in range(0, len(self.runs), steps or 1)]


def derived_columns(names: Sequence[str]) -> Described:
    """Columns that follow from a case, of the analyses of these names: unit and meaning."""
    return {**{key: told for one in analyses() if one.name in names for key, told in one.derived.items()}, **_DRIVE}


def result_columns(names: Sequence[str]) -> Described:
    """Columns that a run gives, of the analyses of these names: unit and meaning."""
    return {key: told for one in analyses() if one.name in names for key, told in one.columns.items()}


def analyses_of_all(cases: Iterable[Case]) -> list[str]:
    """Names of the analyses that mean something for any of several cases."""
    found = {one.name for case in cases for one in analyses_of(case)}
    return [one.name for one in analyses() if one.name in found]


def row_of(result: Mapping[str, Any]) -> dict[str, Any]:
    """The columns `result_columns` of a result."""
    return {key: value for one in analyses_in(result) for key, value in one.row(result).items()}


def describe_sweep(sweep: Sweep, cases: Sequence[Case], engine: Engine, out: Path) -> SweepRecord:
    """The record of a sweep whose points have been resolved; `InputError` if piles are to descend."""
    names = analyses_of_all(cases)
    if sweep.descent is not None and "velocity" not in result_columns(names):
        raise InputError(sweep.source, [Problem("descend", None, "expected walkers: a pile has no velocity")])
    columns, derived = derived_columns(names), []
    for case in cases:
        known = {key: value for one in analyses_of(case) for key, value in one.derived_of(case).items()}
        known |= {key: getattr(case.drive, key) for key in _DRIVE}
        derived.append({key: known.get(key, nan) for key in columns})
    return SweepRecord(
        directory=out / sweep.name,
        name=sweep.name,
        title=sweep.title,
        units=dict(zip(sweep.keys, sweep.units, strict=True)),
        values=[[list(map(plain, one)) if isinstance(one, list) else plain(one) for one in row] for row in sweep.rows],
        derived=derived,
        runs=[run_place(case, engine, out).name for case in cases],
        descent=sweep.descent,
        analyses=names,
        file=sweep.file,
    )


def write_record(record: SweepRecord) -> None:
    """Make the sweep's directory, if need be, and write its ``sweep.json``."""
    record.directory.mkdir(parents=True, exist_ok=True)
    points = [
        {"values": list(values), "derived": list(derived.values()), "run": run}
        for values, derived, run in zip(record.values, record.derived, record.runs, strict=True)
    ]
    contents = {
        "format": _FORMAT,
        "name": record.name,
        "title": record.title,
        "file": dict(record.file),
        "units": dict(record.units),
        "descent": vars(record.descent) if record.descent else None,
        "analyses": list(record.analyses),
        "derived": list(record.derived[0]) if record.derived else [],
        "points": points,
    }
    write_json(record.directory / RECORD_NAME, contents)


def read_record(directory: str | Path) -> SweepRecord:
    """Read a sweep's directory; `InputError` if it is none."""
    from walkers.inputs.sweep import Descent

    given, directory = directory, Path(directory).resolve()
    try:
        contents = read_json(directory / RECORD_NAME)
        points = contents["points"]
        return SweepRecord(
            directory=directory,
            **{key: contents[key] for key in ("name", "title", "units", "analyses")},
            values=[point["values"] for point in points],
            derived=[dict(zip(contents["derived"], point["derived"], strict=True)) for point in points],
            runs=[point["run"] for point in points],
            descent=Descent(**contents["descent"]) if contents["descent"] else None,
            file=contents.get("file", {}),
        )
    except (FileNotFoundError, NotADirectoryError) as error:
        raise refused(given, f"not a sweep: expected a folder with a {RECORD_NAME}, such as runs/fig2") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise refused(given, f"{RECORD_NAME} cannot be read ({error})") from error


@dataclass(frozen=True)
class PointState:
    """What has become of a point: finished, failed, running, missing, or not needed, below where a descent ended.

    The directory is that of the finished run, or of what is left of the failed one; the rest is of a failure.
    """

    status: str
    directory: Path | None = None
    reason: str | None = None
    message: str | None = None
    lost: int = 0


def states(record: SweepRecord) -> list[PointState]:
    """What has become of each point, as the run directories say."""
    places = [record.out / run for run in record.runs]
    found = [
        PointState("finished", place) if finished_run(place) else unfinished_state(place, unfinished(place))
        for place in places
    ]
    if record.descent is None:
        return found
    for chain in record.chains:
        stopped = False
        for number in chain:
            if stopped:
                found[number] = PointState("not needed")
            elif found[number].status == "finished":
                stopped = record.descent.at_rest(velocity_of(places[number]))
    return found


def unfinished_state(place: Path, directory: Path) -> PointState:
    """What has become of a run that is not finished, or is made anew, in a directory."""
    if is_locked(place):
        return PointState("running")
    try:
        failure = read_json(directory / FAILURE_NAME)
        reason, message = str(failure["reason"]), str(failure["message"])
        return PointState("failed", directory, reason, message, int(failure.get("lost", 0)))
    except (OSError, ValueError, KeyError, TypeError):
        return PointState("missing")


def velocity_in(result: Mapping[str, Any]) -> float:
    """Mean velocity of walkers, m/s; NaN where there are none."""
    return float(result["velocity"]["mean"]) if "velocity" in result else nan


def velocity_of(directory: Path) -> float:
    """Mean velocity of a finished run, m/s, as its result says, of whatever version; NaN if its files are damaged."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        return velocity_in(recorded_result(directory))
    with suppress(DamagedRunError):
        return velocity_in(result_in(directory))
    return nan


def recorded_result(directory: Path) -> dict[str, Any]:
    """The result that a finished run has, of whatever version; `OSError`, `ValueError` if it is not what it was."""
    check_unchanged(directory, [RESULT_NAME])
    return read_json(directory / RESULT_NAME)


class DamagedRunError(WalkersError):
    """A finished run whose files were changed or cut since, and whose result cannot be made anew from its dumps."""


def result_in(directory: Path) -> dict[str, Any]:
    """The result of a finished run; `DamagedRunError` if there is none."""
    try:
        return current_result(directory)
    except (OSError, ValueError, KeyError, TypeError, IndexError, WalkersError) as error:
        raise DamagedRunError(f"{directory} is damaged ({error}): delete it to have it made again") from error
