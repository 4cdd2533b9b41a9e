"""What is in a folder of runs: runs, finished or not, and sweeps, as their files say.

Nothing is tabulated, no dump is opened and no table: a folder of ten thousand runs takes seconds.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.readable import agrees, flattened, has_key
from walkers.inputs.units import Kind, parse_quantity
from walkers.postprocess.analysis import RESULT_NAME
from walkers.runner.directory import CASE_NAME, FAILURE_NAME, REPLACED, UNFINISHED, holds_unfinished, is_run_name
from walkers.runner.files import read_json
from walkers.runner.locks import is_locked
from walkers.runner.manifest import MANIFEST_NAME, check_unchanged
from walkers.sweeps.record import RECORD_NAME, read_record, states

STATUSES = ("finished", "running", "interrupted", "failed")
AGE = Kind("age", "s", "7 d", 1e12)
_LOCK = ".lock"


@dataclass(frozen=True)
class Entry:
    """A run or a sweep in a folder.

    Attributes
    ----------
    name
        Of the run (``case-hash``) or of the sweep's directory.
    case
        Name of the (base) case.
    status
        One of `STATUSES`. Interrupted is what was begun and is neither finished, failed nor being made: a run goes on
        where it was; of a sweep points are missing.
    directory
        Where its files are.
    age
        Since it was finished, or something was last written to it, s.
    size
        Of its files, of a sweep those of its runs, bytes.
    parameters
        Of a run `walkers.inputs.readable.flattened`; of a sweep, for each key that varies, how many values it has.
    reason, message
        Of a failure: its name (`walkers.runner.failures`) and what was said.
    velocity, standard_error
        Mean over its walkers, m/s; None where there is none.
    climbs
        Of a pile how many; None where it is none.
    points
        Of a sweep: how many points have which status.
    runs
        Of a sweep: names of its runs.
    """

    name: str
    case: str
    status: str
    directory: Path
    age: float
    size: int
    parameters: Mapping[str, Any] = field(default_factory=dict)
    reason: str | None = None
    message: str | None = None
    velocity: float | None = None
    standard_error: float | None = None
    climbs: int | None = None
    points: Mapping[str, int] | None = None
    runs: Sequence[str] = ()

    @property
    def is_sweep(self) -> bool:
        """Whether it is a sweep."""
        return self.points is not None

    @property
    def place(self) -> Path:
        """Where a run belongs; beside it is its lock."""
        return self.directory.with_name(_place_name(self.directory))


def inventory(out: Path) -> list[Entry]:
    """All runs and sweeps in a folder, sweeps first, each kind by name.

    Parameters
    ----------
    out
        Folder of the run directories; what is not there is empty.

    Raises
    ------
    InputError
        If it is a file.
    """
    if out.exists() and not out.is_dir():
        raise InputError(str(out), [Problem("", None, "expected a folder of runs, this is a file")])
    now = time.time()
    runs = list(_runs(out, now))
    sweeps = [sweep for path in _folders(out) if (sweep := _sweep(path, runs, now)) is not None]
    return [*sweeps, *sorted(runs, key=lambda run: (run.name, run.status != "finished"))]


def _folders(out: Path) -> list[Path]:
    try:
        with os.scandir(out) as entries:
            return sorted(Path(entry) for entry in entries if entry.is_dir())
    except OSError:
        return []


def _runs(out: Path, now: float) -> Iterator[Entry]:
    seen = set()
    for path in _folders(out):
        if (run := _run(path, now)) is not None:
            seen.add(run.place)
            yield run
    for lock in out.glob(f"*{_LOCK}"):  # a run whose directory is about to be made, or that is made with others
        place = lock.with_name(lock.name.removesuffix(_LOCK))
        if place not in seen and is_locked(place):
            yield Entry(place.name, place.name.rpartition("-")[0], "running", place, 0.0, 0)


def _place_name(path: Path) -> str:
    return path.name.removesuffix(UNFINISHED).removesuffix(REPLACED)


def _run(path: Path, now: float) -> Entry | None:
    """The run in a directory; None if there is none."""
    name = _place_name(path)
    finished = name == path.name and (path / MANIFEST_NAME).is_file()
    if not (finished or is_run_name(name)):  # a folder of somebody's, whatever is in it
        return None
    parameters: Mapping[str, Any]
    try:
        case = read_json(path / CASE_NAME)
        parameters, case_name = flattened(case), str(case["name"])
    except (OSError, ValueError, KeyError, TypeError):
        if not is_run_name(name) or not (finished or (name != path.name and holds_unfinished(path))):
            return None
        parameters, case_name = {}, name.rpartition("-")[0]
    size, newest = weigh(path)
    if finished:
        age = _age(path / MANIFEST_NAME, now)
        return Entry(name, case_name, "finished", path, age, size, parameters, **_outcome(path))
    status, failure = ("running", {}) if is_locked(path.with_name(name)) else _failure(path)
    return Entry(name, case_name, status, path, max(now - newest, 0.0), size, parameters, **failure)


def _age(path: Path, now: float) -> float:
    return max(now - path.stat().st_mtime, 0.0)


def _failure(path: Path) -> tuple[str, dict[str, Any]]:
    try:
        failure = read_json(path / FAILURE_NAME)
        return "failed", {"reason": str(failure["reason"]), "message": str(failure["message"])}
    except (OSError, ValueError, KeyError, TypeError):
        return "interrupted", {}


def _outcome(path: Path) -> dict[str, Any]:
    """Velocity and climbs as the result says that is there, of whatever version of the analyses."""
    try:
        check_unchanged(path, [RESULT_NAME])
        result = read_json(path / RESULT_NAME)
        velocity, climbs = result.get("velocity") or {}, result.get("climbs")
        return {
            "velocity": velocity.get("mean"),
            "standard_error": velocity.get("standard_error"),
            "climbs": None if climbs is None else len(climbs),
        }
    except (OSError, ValueError, AttributeError, TypeError):
        return {}


def weigh(path: Path) -> tuple[int, float]:
    """Bytes of all files in a directory, and when one was last written (s since the epoch; 0 if there is none)."""
    size, newest = 0, 0.0
    try:
        with os.scandir(path) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    below, latest = weigh(Path(entry))
                else:
                    about = entry.stat(follow_symlinks=False)
                    below, latest = about.st_size, about.st_mtime
                size, newest = size + below, max(newest, latest)
    except OSError:  # just being removed, or not ours to read
        pass
    return size, newest


def _sweep(path: Path, runs: Sequence[Entry], now: float) -> Entry | None:
    if not (path / RECORD_NAME).is_file():
        return None
    try:
        record = read_record(path)
    except InputError:
        return None
    points = Counter(state.status for state in states(record))
    named = set(record.runs)
    values = {key: {str(row[number]) for row in record.values} for number, key in enumerate(record.units)}
    return Entry(
        name=path.name,
        case=record.runs[0].rpartition("-")[0] if record.runs else "",
        status=_status_of(points),
        directory=path,
        age=_age(path / RECORD_NAME, now),
        size=sum(run.size for run in runs if run.name in named),
        parameters={key: len(different) for key, different in values.items()},
        points=points,
        runs=record.runs,
    )


def _status_of(points: Mapping[str, int]) -> str:
    statuses = {"running": "running", "missing": "interrupted", "failed": "failed"}
    return next((status for found, status in statuses.items() if points.get(found)), "finished")


def select(
    entries: Sequence[Entry],
    *,
    case: str | None = None,
    status: str | None = None,
    older_than: str | None = None,
    where: Sequence[str] = (),
) -> list[Entry]:
    """Those of a folder's entries that a user asks for.

    Parameters
    ----------
    entries
        From `inventory`.
    case
        Name of the case.
    status
        One of `STATUSES`.
    older_than
        An age with its unit, such as ``7 d``.
    where
        Conditions such as ``drive.frequency=80 Hz``, all of which hold; sweeps are left out then.

    Raises
    ------
    InputError
        If an age or a condition cannot be read, or no run has such a key.
    """
    conditions = [_condition(text, entries) for text in where]
    oldest = 0.0 if older_than is None else seconds_of(older_than)
    return [
        entry
        for entry in entries
        if (case is None or entry.case == case)
        and (status is None or entry.status == status)
        and (older_than is None or entry.age > oldest)
        and not (conditions and entry.is_sweep)
        and all(agrees(entry.parameters, key, value) for key, value in conditions)
    ]


def seconds_of(age: str) -> float:
    """An age such as ``7d``, ``12 h`` or ``30 min``, s.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return parse_quantity(age, AGE)
    except ValueError as error:
        raise InputError("--older-than", [Problem("", None, f'"{age}": {error}')]) from error


def _condition(text: str, entries: Sequence[Entry]) -> tuple[str, str]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals and value):
        told = 'expected KEY=VALUE, such as "drive.frequency=80 Hz"'
        raise InputError("--where", [Problem("", None, f'"{text}": {told}')])
    runs = [entry for entry in entries if not entry.is_sweep]
    if runs and not any(has_key(run.parameters, key) for run in runs):
        known = ", ".join(dict.fromkeys(one for run in runs for one in run.parameters))
        raise InputError("--where", [Problem(key, None, f"no run has such a key; they have {known}")])
    return key, value
