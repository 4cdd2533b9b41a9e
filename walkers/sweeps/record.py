"""Sweeps on disk.

A sweep's directory contains ``sweep.json``: the tables of the sweep's file and of its base case, and the names of its
runs. Reading expands the file again. The status of a point is the status of its run directory. The run directories are
beside the sweep's directory, and all sweeps of a folder share them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from walkers.errors import InputError, input_error
from walkers.files import make_folder, read_json, write_json
from walkers.postprocess.measure.results import read_results
from walkers.runs.status import PointState, state_at

if TYPE_CHECKING:
    from walkers.inputs.sweep import SweepDefinition

RECORD_NAME = "sweep.json"
_FORMAT = 4
UNREADABLE = "ResultUnreadable"
"""Reason of points whose run is finished and whose result cannot be read."""


@dataclass(frozen=True)
class SweepRecord:
    """A sweep in its directory, with the name of the run of each point."""

    directory: Path
    sweep: SweepDefinition
    runs: Sequence[str]

    @property
    def out(self) -> Path:
        """Folder of the run directories."""
        return self.directory.parent


def write_record(record: SweepRecord) -> None:
    """Write ``sweep.json`` into the sweep's directory, which is made if necessary."""
    make_folder(record.directory)
    sweep = record.sweep
    contents = {
        "format": _FORMAT,
        "file": dict(sweep.file),
        "case": sweep.case_name,
        "base": dict(sweep.base),
    }
    write_json(record.directory / RECORD_NAME, {**contents, "runs": list(record.runs)})


def read_sweep_record(directory: str | Path) -> SweepRecord:
    """Read the record in a sweep's directory, and expand the sweep; `InputError` if there is none."""
    from walkers.inputs.sweep import expand

    named, directory = directory, Path(directory).resolve()
    try:
        contents = read_json(directory / RECORD_NAME)
        if contents["format"] != _FORMAT:
            raise ValueError(f"its format is {contents['format']!r}, expected {_FORMAT}")
        base = contents["case"], contents["base"]
        sweep = expand(
            contents["file"], source=f"{named}/{RECORD_NAME}", name=directory.name, base=base
        )
        runs = contents["runs"]
        if len(runs) != len(sweep.rows) or not all(isinstance(run, str) for run in runs):
            raise ValueError(f"{len(runs)} runs, expected the names of {len(sweep.rows)}")
        return SweepRecord(directory, sweep, runs)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise input_error(
            named, f"not a sweep: expected a folder with a {RECORD_NAME}, such as runs/fig2"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        text = (
            f"{RECORD_NAME} cannot be read ({error}); run the sweep again: finished runs are kept"
        )
        raise input_error(named, text) from error


def states(record: SweepRecord, *, results: bool = False) -> list[PointState]:
    """State of each point; with ``results``, runs are read, and finished runs without a readable result have failed."""
    points = [state_at(record.out / run) for run in record.runs]
    for number, state in enumerate(points if results else ()):
        if state.status == "finished" and state.directory is not None:
            try:
                points[number] = replace(state, result=read_results(state.directory))
            except InputError as error:
                points[number] = PointState("failed", state.directory, UNREADABLE, str(error))
    return points
