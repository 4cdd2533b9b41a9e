"""Sweeps on disk.

A sweep's directory contains ``sweep.json``: the tables of the sweep's file and of its base case,
and the names of its runs. Reading expands the file again. The status of a point is the status of
its run directory. The run directories are beside the sweep's directory, and all sweeps of a folder
share them. Those of a spread or an accuracy, for which nobody asked by name, are in its directory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.errors import InputError, input_error
from walkers.files import make_folder, read_json, write_json
from walkers.postprocess.measure.results import read_results
from walkers.runner.run_directory import is_finished
from walkers.runs.status import PointState, state_at

if TYPE_CHECKING:
    from walkers.inputs.sweep import SweepDefinition

RECORD_NAME = "sweep.json"
"""Name of the record in a sweep's directory."""
_FORMAT = 4
"""Version of the record; records of other versions are refused."""
UNREADABLE = "ResultUnreadable"
"""Reason of points whose run is finished and whose result cannot be read."""


@dataclass(frozen=True)
class SweepRecord:
    """A sweep in its directory.

    Attributes
    ----------
    directory
        The sweep's directory.
    sweep
        The sweep.
    runs
        The name of the run of each point.
    has_own_runs
        Whether its runs are made in its directory instead of beside it.
    """

    directory: Path
    sweep: SweepDefinition
    runs: Sequence[str]
    has_own_runs: bool = False

    @property
    def runs_folder(self) -> Path:
        """Folder in which missing runs are made."""
        return self.directory if self.has_own_runs else self.directory.parent

    def place_of(self, run: str) -> Path:
        """The final directory of a run.

        A finished run beside the directory of the sweep is used wherever missing runs are made.
        """
        place = self.runs_folder / run
        beside = self.directory.parent / run
        if self.has_own_runs and not is_finished(place) and is_finished(beside):
            return beside
        return place

    @property
    def places(self) -> list[Path]:
        """The final directory of the run of each point."""
        return [self.place_of(run) for run in self.runs]

    @property
    def names_in_folder(self) -> list[str]:
        """Names of the runs in the folder of the sweep: paths relative to that folder."""
        folder = self.directory.parent
        return [place.relative_to(folder).as_posix() for place in self.places]


def write_record(record: SweepRecord) -> None:
    """Write ``sweep.json`` into the sweep's directory, which is made if necessary."""
    make_folder(record.directory)
    sweep = record.sweep
    contents = {
        "format": _FORMAT,
        "file": dict(sweep.file),
        "case": sweep.case_name,
        "base": dict(sweep.base),
        "runs": list(record.runs),
    }
    if record.has_own_runs:
        contents["own_runs"] = True
    write_json(record.directory / RECORD_NAME, contents)


def read_sweep_record(directory: str | Path) -> SweepRecord:
    """Read the record in a sweep's directory, and expand the sweep.

    Raises
    ------
    InputError
        If there is no record, or it cannot be read.
    """
    try:
        return _read_record(directory)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise input_error(
            directory, f"not a sweep: expected a folder with a {RECORD_NAME}, such as runs/fig2"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise input_error(
            directory,
            f"{RECORD_NAME} cannot be read ({error}); run the sweep again: finished runs are kept",
        ) from error


def _read_record(directory: str | Path) -> SweepRecord:
    """Read a record; errors of many classes if it is damaged."""
    from walkers.inputs.sweep import expand

    resolved = Path(directory).resolve()
    contents = read_json(resolved / RECORD_NAME)
    if contents["format"] != _FORMAT:
        raise ValueError(f"its format is {contents['format']!r}, expected {_FORMAT}")
    sweep = expand(
        contents["file"],
        source=f"{directory}/{RECORD_NAME}",
        name=resolved.name,
        base=(contents["case"], contents["base"]),
    )
    runs = contents["runs"]
    if len(runs) != len(sweep.rows) or not all(isinstance(run, str) for run in runs):
        raise ValueError(f"{len(runs)} runs, expected the names of {len(sweep.rows)}")
    return SweepRecord(resolved, sweep, runs, has_own_runs=bool(contents.get("own_runs")))


def states(record: SweepRecord, *, results: bool = False) -> list[PointState]:
    """The state of each point of a sweep.

    Parameters
    ----------
    record
        The sweep.
    results
        Whether the results of finished runs are read. If they are, a finished run whose result
        cannot be read has failed.
    """
    points = []
    for place in record.places:
        state = state_at(place)
        if results:
            state = _with_result(state)
        points.append(state)
    return points


def _with_result(state: PointState) -> PointState:
    """The state of a point with its result if its run is finished; failed if it cannot be read."""
    if state.status != "finished" or state.directory is None:
        return state
    try:
        return replace(state, result=read_results(state.directory))
    except InputError as error:
        return PointState("failed", state.directory, UNREADABLE, str(error))
