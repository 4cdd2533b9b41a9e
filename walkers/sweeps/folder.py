"""Contents of a folder of runs: runs and sweeps with their status; listing and removal.

Listing opens no dumps and no tables: a folder of ten thousand runs takes seconds.

Runs in progress are never removed: removal holds the lock of the run. The manifest of a finished run is removed first:
after an interruption the rest is no finished run, and the next removal takes it.
"""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from stat import S_ISDIR
from typing import Any

from walkers.errors import InputError, Problem, refused
from walkers.inputs.case import Case
from walkers.postprocess.numbers import in_short, is_declared
from walkers.postprocess.results import plain, read
from walkers.postprocess.uncertainty import ACCURACY, SPREAD, SPREAD_NAME
from walkers.rounding import counted, duration_text
from walkers.runner.directory import (
    CASE_NAME,
    REPLACED,
    UNFINISHED,
    holds_unfinished,
    is_locked,
    is_run_name,
    locked,
    recover,
)
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME
from walkers.sweeps.making import progress_at
from walkers.sweeps.readable import (
    FlatCase,
    agrees,
    check_wanted,
    differing,
    flattened,
    has_key,
    kind_of,
    readable,
    short_keys,
)
from walkers.sweeps.table import (
    PARSL,
    RECORD_NAME,
    read_record,
    state_at,
    states,
    worst_status,
)
from walkers.text import aligned

_SIZES = {"GB": 1e9, "MB": 1e6, "kB": 1e3}
_LOCK = ".lock"
_MOST_LINES = 40
_MARK = b"granular-walkers"
"""Text in every report and figure that the project writes."""


@dataclass(frozen=True)
class Entry:
    """A run (``case-hash``) or a sweep in a folder.

    The status is finished, running, failed, or interrupted (a run can be continued, or points of a sweep are missing).
    ``age`` (s) counts from the end of the run or from the last change, ``size`` (bytes) is that of the files, for a
    sweep of its runs. ``parameters`` are those of `walkers.sweeps.readable.flattened`, for a sweep the number of values
    of each varied key. A finished run has the ``numbers`` of its result, the main ones as text in ``result``, and for
    walkers the ``velocity`` (m/s; on a slope up); a sweep has numbers of points by
    status.
    """

    name: str
    case: str
    status: str
    directory: Path
    age: float = 0.0
    size: int = 0
    parameters: FlatCase = field(default_factory=FlatCase)
    reason: str | None = None
    message: str | None = None
    velocity: float | None = None
    result: str = "-"
    numbers: Mapping[str, Any] = field(default_factory=dict)
    points: Mapping[str, int] | None = None
    runs: Sequence[str] = ()

    @property
    def is_sweep(self) -> bool:
        """Whether it is a sweep."""
        return self.points is not None

    @property
    def place(self) -> Path:
        """Where a run belongs; beside it is its lock."""
        return self.directory.with_name(_run_name(self.directory))


def _run_name(directory: Path) -> str:
    return directory.name.removesuffix(UNFINISHED).removesuffix(REPLACED)


def inventory(out: Path) -> list[Entry]:
    """All runs and sweeps in a folder, sweeps first, sorted by name; none if there is no folder."""
    if out.exists() and not out.is_dir():
        raise refused(out, "expected a folder of runs, this is a file")
    folders = sorted(path for path in out.iterdir() if path.is_dir()) if out.exists() else []
    now = time.time()
    runs = [run for path in folders if (run := _run(path, now)) is not None]
    made = {run.place for run in runs}
    for lock in out.glob(f"*{_LOCK}"):  # runs in shared decks, and runs whose directory does not exist yet
        place = lock.with_name(lock.name.removesuffix(_LOCK))
        if place not in made and is_locked(place):
            runs.append(Entry(place.name, place.name.rpartition("-")[0], "running", place))
    sweeps = [sweep for path in folders if (sweep := _sweep(path, runs, now)) is not None]
    return [*sweeps, *sorted(runs, key=lambda run: (run.name, run.status != "finished"))]


def _run(path: Path, now: float) -> Entry | None:
    name = _run_name(path)
    finished = name == path.name and (path / MANIFEST_NAME).is_file()
    if not (finished or is_run_name(name)):  # a user's folder
        return None
    parameters = FlatCase()
    case_name = name.rpartition("-")[0]
    try:
        case = Case.from_dict(read_json(path / CASE_NAME))
        parameters, case_name = flattened(case), case.name
    except (OSError, ValueError, KeyError, TypeError):
        if not is_run_name(name) or not (finished or (name != path.name and holds_unfinished(path))):
            return None
    size, newest = weigh(path)
    if not finished:
        state = state_at(path.with_name(name), path)
        status = "interrupted" if state.status == "missing" else state.status
        age = max(now - newest, 0.0)
        reason = state.reason
        if status == "running" and (progress := progress_at(path.with_name(name))):
            reason = progress.text.partition(",")[0]
        return Entry(name, case_name, status, path, age, size, parameters, reason, state.message)
    given: dict[str, Any] = {}
    try:
        results = read(path)
        given = {"numbers": plain(results.numbers), "result": in_short(results)}
        given["velocity"] = given["numbers"].get("axial_velocity" if results["goes_uphill"] else "velocity")
        if notes := results.about["by_hand"]:
            given["reason"] = "edited and run by hand" if "edited" in " ".join(notes) else notes[0]
    except InputError as error:
        given["reason"] = error.problems[0].expected
    return Entry(name, case_name, "finished", path, _age(path / MANIFEST_NAME, now), size, parameters, **given)


def _age(path: Path, now: float) -> float:
    return max(now - path.stat().st_mtime, 0.0)


def weigh(path: Path) -> tuple[int, float]:
    """Bytes of a file or of all files in a directory, and time of the last change (s since the epoch; 0 if no file).

    Files with several names, such as tables that the segments of a pile share, count once.
    """
    size, newest = {}, 0.0
    for file in [path, *path.rglob("*")]:
        with suppress(OSError):  # just being removed
            about = file.lstat()
            if not S_ISDIR(about.st_mode):
                size[about.st_dev, about.st_ino], newest = about.st_size, max(newest, about.st_mtime)
    return sum(size.values()), newest


def _sweep(path: Path, runs: Sequence[Entry], now: float) -> Entry | None:
    try:
        record = read_record(path)
    except InputError:
        return None
    points = dict(Counter(state.status for state in states(record)))
    named = set(record.runs)
    return Entry(
        name=path.name,
        case=record.runs[0].rpartition("-")[0] if record.runs else "",
        status=worst_status(points),
        directory=path,
        age=_age(path / RECORD_NAME, now),
        size=sum(run.size for run in runs if run.name in named),
        parameters=FlatCase(
            {
                key: len({*map(str, column)})
                for key, column in zip(record.sweep.keys, zip(*record.sweep.values, strict=True), strict=True)
            }
        ),
        points=points,
        runs=record.runs,
    )


def select(entries: Sequence[Entry], where: Sequence[str]) -> list[Entry]:
    """The runs for which all conditions hold, such as ``drive.frequency=80 Hz``; without conditions all entries.

    `InputError` if a condition cannot be read, or no run has such a key.
    """
    conditions = []
    runs = [entry for entry in entries if not entry.is_sweep]
    for text in where:
        key, _, value = (part.strip() for part in text.partition("="))
        if not (key and value):
            told = 'expected KEY=VALUE, such as "drive.frequency=80 Hz"'
            raise refused("where", f'"{text}": {told}')
        if runs and not any(has_key(run.parameters, key) for run in runs):
            known = ", ".join(dict.fromkeys(one for run in runs for one in run.parameters))
            raise InputError("where", [Problem(key, None, f"no run has such a key; they have {known}")])
        # If there are no runs to compare with.
        alike = FlatCase({key: 0.0}) if kind_of(key) and "/" not in value else FlatCase()
        for parameters in [run.parameters for run in runs] or [alike]:
            try:
                check_wanted(parameters, key, value)
            except ValueError as error:
                raise refused("where", f'"{text}": {error}') from error
        conditions.append((key, value))
    return [
        entry
        for entry in (runs if conditions else entries)
        if all(agrees(entry.parameters, key, value) for key, value in conditions)
    ]


def _varied(runs: Sequence[Entry]) -> Iterator[tuple[str, list[Entry], list[str]]]:
    """The runs of each case, and the keys by which they differ, see `walkers.sweeps.readable.differing`."""
    for case in dict.fromkeys(run.case for run in runs):
        of_case = [run for run in runs if run.case == case]
        yield case, of_case, differing([run.parameters for run in of_case if run.parameters])


def as_json(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Entries as JSON objects, SI units; for a run, ``varies`` has the values by which runs of its case differ."""
    keys = {case: keys for case, _, keys in _varied([entry for entry in entries if not entry.is_sweep])}
    common = ("name", "case", "status", "age", "size")
    of_runs = ("reason", "message", "velocity", "numbers")
    rows = []
    for entry in entries:
        shown = entry.parameters if entry.is_sweep else keys[entry.case]
        names = (*common, *(("points", "runs") if entry.is_sweep else of_runs))
        told: dict[str, Any] = {"kind": "sweep" if entry.is_sweep else "run", "directory": str(entry.directory)}
        told |= {name: getattr(entry, name) for name in names}
        rows.append({**told, "varies": {key: entry.parameters.get(key) for key in shown}})
    return rows


def members(entries: Sequence[Entry]) -> list[Entry]:
    """The runs of sweeps, without those that have a spread or an accuracy of their own."""
    named = {run for entry in entries for run in entry.runs}
    named -= {entry.name.removesuffix(SPREAD).removesuffix(ACCURACY) for entry in entries if entry.is_sweep}
    return [entry for entry in entries if entry.name in named]


def as_text(entries: Sequence[Entry], hidden: int = 0) -> str:
    """Entries as text: sweeps, then the runs of each case with a column for each key by which they differ; mm/s.

    The last line states the number of ``hidden`` runs of sweeps.
    """
    sweeps = [entry for entry in entries if entry.is_sweep]
    runs = [entry for entry in entries if not entry.is_sweep]
    rows = [["sweep", "points", "age", "size", "case", "varies (values)"]]
    for sweep in sweeps:
        points = ", ".join(f"{number} {status}" for status, number in (sweep.points or {}).items())
        keys = ", ".join(f"{key} ({number})" for key, number in sweep.parameters.items())
        rows.append([sweep.name, points, duration_text(sweep.age), bytes_text(sweep.size), sweep.case, keys])
    blocks = [aligned(rows)] if sweeps else []
    for case, of_case, varied in _varied(runs):
        rows = [[f"{case} ({len(of_case)})", "status", "result", "age", "size", *short_keys(varied)]]
        for run in of_case:
            status = f"{run.status}: {run.reason}" if run.reason else run.status
            values = [readable(key, run.parameters.get(key)) for key in varied]
            rows.append([run.name, status, run.result, duration_text(run.age), bytes_text(run.size), *values])
        blocks.append(aligned(rows))
    total = [counted(len(sweeps), "sweep")] * bool(sweeps) + [counted(len(runs), "run")]
    size = bytes_text(sum(entry.size for entry in entries))
    more = f"; not shown: {hidden} runs of sweeps (--all)" if hidden else ""
    return "\n\n".join([*blocks, f"{', '.join(total)}, {size}{more}"])


def run_text(directory: Path) -> str:
    """Status and result of the run in a directory, such as ``finished, 1.08 mm/s``."""
    run = _run(directory, time.time())
    return "missing" if run is None else f"{run.status}, {run.result}".removesuffix(", -")


def bytes_text(size: int) -> str:
    """A number of bytes, such as ``1.2 MB``."""
    return next((f"{size / unit:.3g} {name}" for name, unit in _SIZES.items() if size >= unit), f"{size} B")


@dataclass(frozen=True)
class Cleaning:
    """What a cleaning removes from a folder: runs and sweeps, stale lock files; further lines to print."""

    remove: Sequence[Entry]
    locks: Sequence[Path]
    told: Sequence[str]

    def as_text(self) -> str:
        """What is removed and kept, with the total size."""
        rows, told, total = [], list(self.told), 0
        for one in self.remove:
            size, why = one.size, one.reason or ("" if one.status == "finished" else "can be continued")
            if one.directory.is_symlink():
                size, why = 0, "a symbolic link: its target stays"
            elif one.is_sweep:
                own = _own_files(one.directory)
                size, why = sum(weigh(path)[0] for path in own), ""
                theirs = ", ".join(sorted(path.name for path in one.directory.iterdir() if path not in own))
                if theirs:
                    told.append(f"kept, not written by walkers: {theirs} (in {one.directory})")
            kind = "sweep" if one.is_sweep else one.status
            rows.append([one.name, kind, duration_text(one.age), bytes_text(size), why])
            total += size
        lines = [aligned(rows[:_MOST_LINES])] if rows else []
        lines += [f"and {len(rows) - _MOST_LINES} more"] if len(rows) > _MOST_LINES else []
        kinds = Counter("sweep" if entry.is_sweep else f"{entry.status} run" for entry in self.remove)
        kinds["stale lock"] = len(self.locks)
        what = ", ".join(counted(number, kind) for kind, number in kinds.items() if number) or "nothing"
        return "\n".join([*lines, *told, f"{what} to remove, {bytes_text(total)}"])


def _own_files(directory: Path) -> list[Path]:
    """Files of the project in a sweep's directory: record, logs, bands, report and figures with default names."""
    record = read_record(directory)

    def is_page(path: Path) -> bool:
        is_figure = path.suffix == ".png" and (path.stem in record.sweep.units or is_declared(path.stem))
        return (is_figure or path.name == "report.html") and path.is_file() and not path.is_symlink()

    pages = [path for path in directory.iterdir() if is_page(path)]
    known = [path for path in (directory / RECORD_NAME, directory / PARSL, directory / SPREAD_NAME) if path.exists()]
    return [*known, *(path for path in pages if _MARK in path.read_bytes())]


def plan_cleaning(
    out: Path,
    given: Sequence[Path] = (),
    *,
    finished: bool = False,
) -> Cleaning:
    """Plan a cleaning; nothing is removed.

    If runs and sweeps are ``given`` by their directories, they are removed, with the runs of these sweeps that no other
    sweep has. Otherwise interrupted and failed runs are removed, and on request ``finished`` runs that no sweep has.
    `InputError` if a given one does not exist, or a sweep cannot be read.
    """
    entries = inventory(out)
    if finished or given:
        for sweep_file in out.glob(f"*/{RECORD_NAME}"):
            read_record(sweep_file.parent)  # its runs must be known
    sweeps_of: dict[str, list[str]] = {}
    for sweep in entries:
        for run in sweep.runs:
            sweeps_of.setdefault(run, []).append(sweep.name)
    wanted = [entry for place in given for entry in _found(place, entries)]
    going = {entry.name for entry in wanted if entry.is_sweep}
    # With sweeps go those of their runs that no other sweep has.
    wanted += [one for one in entries if one.name in sweeps_of and going.issuperset(sweeps_of[one.name])]
    if not given:
        wanted = [one for one in entries if not one.is_sweep and (finished or one.status != "finished")]
    remove, stay = [], Counter[str]()
    for entry in {one.directory: one for one in wanted}.values():
        sweeps = [] if given else sweeps_of.get(entry.name, [])
        if entry.status == "running":
            stay["running"] += 1
        elif entry.status == "finished" and sweeps:
            stay[f"finished, of the sweep {sweeps[0]} (give its name to remove it)"] += 1
        elif entry.directory.name.endswith(REPLACED) and not entry.place.exists():
            stay["about to be restored"] += 1
        else:
            remove.append(entry)
    going = {entry.name for entry in remove if entry.is_sweep}
    needing = Counter(name for run in remove for name in sweeps_of.get(run.name, ()) if name not in going)
    told = [f"needed by the sweep {name}, which would make them again: {number}" for name, number in needing.items()]
    told += [f"stays: {number} {reason}" for reason, number in stay.items()]
    locks = [] if given else sorted(out.glob("*.lock"))
    stale = [lock for lock in locks if is_run_name(lock.stem) and not is_locked(lock.with_suffix(""))]
    return Cleaning(remove, stale, told)


def _found(place: Path, entries: Sequence[Entry]) -> list[Entry]:
    place = place.resolve()
    found = [one for one in entries if place == one.directory.resolve()]
    found = found or [one for one in entries if place == one.place.resolve()]
    if not found:
        raise refused(place, "no run or sweep in the folder of runs (see walkers list)")
    return found


def clean(cleaning: Cleaning) -> dict[Path, str]:
    """Remove what `plan_cleaning` planned; return what is left, with the reason (in progress, or a system error)."""
    left = {}
    for entry in cleaning.remove:
        with locked([] if entry.is_sweep else [entry.place]) as ours:
            if not (ours or entry.is_sweep):
                left[entry.directory] = "kept: a process is computing it"
                continue
            try:
                _remove(entry)
            except OSError as error:
                left[entry.directory] = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
    with locked(lock.with_suffix("") for lock in cleaning.locks if lock.exists()):
        pass  # a lock file goes with its lock
    return left


def _remove(entry: Entry) -> None:
    """Remove a run, its manifest first, or the project's files of a sweep, its record last; of a link only the link."""
    directory = entry.directory
    if not entry.is_sweep:
        recover(entry.place)
    if directory.is_symlink():
        directory.unlink()
    elif entry.is_sweep:
        for path in reversed(_own_files(directory)):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()
        if not any(directory.iterdir()):
            directory.rmdir()
    elif directory.exists():
        (directory / MANIFEST_NAME).unlink(missing_ok=True)
        shutil.rmtree(directory)
