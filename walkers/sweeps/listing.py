"""Contents of a folder of runs: runs and sweeps with their status; listing and removal.

Listing opens no dumps and no tables, and does without pandas: a folder of ten thousand runs takes seconds.

Runs in progress are never removed: removal holds the lock of the run. The manifest of a finished run is removed first:
after an interruption the rest is no finished run, and the next removal takes it.
"""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISDIR
from typing import Any, TypeAlias

from walkers.errors import InputError, refused, suggestion
from walkers.files import VTK_SCRATCH, abandoned, read_json
from walkers.inputs.case_building import stored_case
from walkers.postprocess.measure.numbers import headline, in_short
from walkers.postprocess.measure.results import plain, read
from walkers.postprocess.measure.uncertainty import ACCURACY, SPREAD
from walkers.rounding import counted, duration_text
from walkers.runner import directory as on_disk
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runs.case_text import FlatCase, differing, flattened, has_value, readable, short_keys
from walkers.runs.making import progress_at
from walkers.runs.status import state_at, status_text, worst_status
from walkers.sweeps.record import RECORD_NAME, read_record, states
from walkers.text import aligned

Row: TypeAlias = dict[str, Any]
"""A run or a sweep, see `inventory`."""
_COLUMNS = (
    *("kind", "name", "case", "status", "directory", "age", "size", "reason", "message"),
    *("velocity", "result", "numbers", "points", "runs", "parameters"),
)
_SIZES = {"GB": 1e9, "MB": 1e6, "kB": 1e3}
_MOST_LINES = 40


def inventory(out: Path) -> list[Row]:
    """All runs (``case-hash``) and sweeps in a folder, sweeps first, sorted by name; None for missing values.

    ``status`` is finished, running, failed, or interrupted: a run can be continued, or points of a sweep are missing.
    ``age`` is in s, since the end of the run or the last change, ``size`` in bytes of the files, for a sweep of its
    runs. A finished run has the ``numbers`` of its result (SI units), the main ones as text in ``result``, and for
    walkers the main ``velocity`` (m/s). A sweep has numbers of ``points`` by status and the names of its ``runs``.
    ``parameters`` are the values of the case (`flattened`), for a sweep the number of values of each varied key.
    """
    if out.exists() and not out.is_dir():
        raise refused(out, "expected a folder of runs, this is a file")
    folders = sorted(path for path in out.iterdir() if path.is_dir()) if out.exists() else []
    now = time.time()
    runs = [run for path in folders if (run := _run(path, now)) is not None]
    listed = {_place(run["directory"]) for run in runs}
    for lock in out.glob("*.lock"):  # runs in shared decks, and runs whose directory does not exist yet
        place = lock.with_suffix("")
        if place not in listed and on_disk.is_locked(place):
            runs.append(_row("run", place.name, place, "running", age=0.0, size=0))
    sweeps = [sweep for path in folders if (sweep := _sweep(path, runs, now)) is not None]
    return [*sweeps, *sorted(runs, key=lambda run: (run["name"], run["status"] != "finished"))]


def _row(kind: str, name: str, directory: Path, status: str, **values: Any) -> Row:
    blank = dict.fromkeys(_COLUMNS) | {"result": "-", "parameters": FlatCase(), "case": name.rpartition("-")[0]}
    return blank | {"kind": kind, "name": name, "directory": directory, "status": status} | values


def _place(directory: Path) -> Path:
    """Where a run belongs; beside it is its lock."""
    return directory.with_name(directory.name.removesuffix(on_disk.UNFINISHED).removesuffix(on_disk.REPLACED))


def _run(path: Path, now: float) -> Row | None:
    place = _place(path)
    finished = place == path and (path / MANIFEST_NAME).is_file()
    if not (finished or on_disk.is_run_name(place.name)):  # a user's folder
        return None
    values: dict[str, Any] = {}
    try:
        case = stored_case(read_json(path / on_disk.CASE_NAME))
        values = {"case": case.name, "parameters": flattened(case)}
    except (OSError, ValueError, KeyError, TypeError):
        if not on_disk.is_run_name(place.name) or not (finished or (place != path and on_disk.holds_unfinished(path))):
            return None
    values["size"], newest = weigh(path)
    if finished:
        age = max(now - (path / MANIFEST_NAME).stat().st_mtime, 0.0)
        return _row("run", place.name, path, "finished", age=age, **values, **_result(path))
    state = state_at(place, path)
    reason, status = state.reason, "interrupted" if state.status == "missing" else state.status
    if status == "running" and (progress := progress_at(place)):
        reason = progress.text.partition(",")[0]
    if status == "interrupted":
        reason = state.message
    values |= {"age": max(now - newest, 0.0), "reason": reason, "message": state.message}
    return _row("run", place.name, path, status, **values)


def _result(path: Path) -> dict[str, Any]:
    try:
        results = read(path)
    except InputError as error:
        return {"reason": error.problems[0].expected}
    notes, numbers, main = results.about["by_hand"], plain(results), headline(results)
    return {
        "numbers": numbers,
        "result": in_short(results),
        "velocity": None if main == "climbs" else numbers.get(main),
        "reason": "edited and run by hand" if "edited" in " ".join(notes) else next(iter(notes), None),
    }


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


def _sweep(path: Path, runs: Sequence[Row], now: float) -> Row | None:
    try:
        record = read_record(path)
    except InputError:
        return None
    points = dict(Counter(state.status for state in states(record)))
    sweep, named = record.sweep, set(record.runs)
    columns = zip(sweep.keys, zip(*sweep.values, strict=True), strict=True)
    return _row(
        *("sweep", path.name, path, worst_status(points)),
        case=sweep.case_name,
        age=max(now - (path / RECORD_NAME).stat().st_mtime, 0.0),
        size=sum(run["size"] for run in runs if run["name"] in named),
        parameters=FlatCase({key: len({*map(str, values)}) for key, values in columns}),
        points=points,
        runs=list(record.runs),
    )


def run_text(directory: Path) -> str:
    """Status and result of the run in a directory, such as ``finished, 1.08 mm/s``."""
    run = _run(directory, time.time())
    return f"{run['status']}, {run['result']}".removesuffix(", -") if run else "missing"


# --- listing ----------------------------------------------------------------------------------------------------------


def without_members(contents: Sequence[Row]) -> list[Row]:
    """Contents without runs of sweeps, unless they have a spread or an accuracy of their own."""
    runs = {run for row in contents for run in row["runs"] or ()} - {_beside(row["name"]) for row in contents}
    return [row for row in contents if row["name"] not in runs]


def select(contents: Sequence[Row], where: Iterable[str]) -> list[Row]:
    """The runs with all values (`has_value`); `InputError` if a condition cannot be read, or no run has its key."""
    runs = [row for row in contents if row["kind"] == "run"]
    for condition in where:
        answers = [has_value(row["parameters"], condition) for row in runs]
        if runs and all(answer is None for answer in answers):
            keys = short_keys(sorted({key for row in runs for key in row["parameters"]}))
            near = suggestion(condition.partition("=")[0].strip(), keys)
            raise refused("where", f'"{condition}": no run has such a key{near}; runs have {", ".join(keys)}')
        runs = [row for row, answer in zip(runs, answers, strict=True) if answer]
    return runs


def _beside(name: str) -> str:
    """Name of the run of a sweep that is its spread or accuracy; empty for other sweeps."""
    return name.removesuffix(SPREAD).removesuffix(ACCURACY) if name.endswith((SPREAD, ACCURACY)) else ""


def _by_case(contents: Sequence[Row]) -> Iterator[tuple[str, list[Row], list[str]]]:
    """The runs of each case, and the keys by which they differ, without those that follow from given ones."""
    by_case: dict[str, list[Row]] = {}
    for row in contents:
        if row["kind"] == "run":
            by_case.setdefault(row["case"], []).append(row)
    for case, runs in by_case.items():
        given, derived = differing([row["parameters"] for row in runs if row["parameters"]])
        yield case, runs, given or derived


def as_json(contents: Sequence[Row]) -> list[dict[str, Any]]:
    """Rows as JSON objects, SI units; for a run, ``varies`` has the values by which runs of its case differ."""
    differ, rows = {case: keys for case, _, keys in _by_case(contents)}, []
    for row in contents:
        values = row["parameters"]
        varies = {key: values.get(key) for key in (values if row["kind"] == "sweep" else differ[row["case"]])}
        rows.append({**row, "directory": str(row["directory"]), "varies": varies})
        del rows[-1]["parameters"]
    return rows


def as_text(contents: Sequence[Row], hidden: int = 0) -> str:
    """Rows as text: sweeps, then the runs of each case with a column for each key by which they differ; mm/s.

    The last line states the number of ``hidden`` runs of sweeps.
    """
    sweeps, blocks = [row for row in contents if row["kind"] == "sweep"], []
    if sweeps:
        heads, rows = ["sweep", "points", "age", "size", "case", "varies (values)"], []
        for row in sweeps:
            varied = ", ".join(f"{key} ({number})" for key, number in row["parameters"].items())
            rows.append([row["name"], status_text(row["points"]), *_weight(row), row["case"], varied])
        blocks.append(aligned([heads, *rows]))
    for case, runs, keys in _by_case(contents):
        heads, rows = [f"{case} ({len(runs)})", "status", "result", "age", "size", *short_keys(keys)], []
        for row in runs:
            status = ": ".join(filter(None, (row["status"], row["reason"])))
            values = [readable(key, row["parameters"].get(key)) for key in keys]
            rows.append([row["name"], status, row["result"], *_weight(row), *values])
        blocks.append(aligned([heads, *rows]))
    total = [counted(len(sweeps), "sweep")] * bool(sweeps) + [counted(len(contents) - len(sweeps), "run")]
    more = f"; not shown: {hidden} runs of sweeps (--all)" if hidden else ""
    size = bytes_text(sum(row["size"] for row in contents))
    return "\n\n".join([*blocks, f"{', '.join(total)}, {size}{more}"])


def _weight(row: Row) -> list[str]:
    return [duration_text(row["age"]), bytes_text(row["size"])]


def bytes_text(size: int) -> str:
    """A number of bytes, such as ``1.2 MB``."""
    return next((f"{size / unit:.3g} {name}" for name, unit in _SIZES.items() if size >= unit), f"{size} B")


# --- removal ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cleaning:
    """The plan of a cleaning.

    Attributes
    ----------
    remove
        Rows of the `inventory`: the runs and sweeps to remove.
    locks
        Lock files without a process.
    exports
        Folders that exports left behind when they were killed.
    remarks
        Lines to print.
    """

    remove: Sequence[Row]
    locks: Sequence[Path]
    exports: Sequence[Path]
    remarks: Sequence[str]

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to remove."""
        return not (self.remove or self.locks or self.exports)

    def as_text(self) -> str:
        """The removed runs and sweeps with the total size, and the remarks."""
        rows, kinds, total = [], Counter[str](), 0
        for row in self.remove:
            kind = "sweep" if row["kind"] == "sweep" else f"{row['status']} run"
            size, why = row["size"], row["reason"] or ""
            if row["status"] == "interrupted":
                why = ", ".join(filter(None, [row["reason"], "can be continued"]))
            if row["directory"].is_symlink():
                size, why = 0, "a symbolic link: its target stays"
            elif row["kind"] == "sweep":
                size = weigh(row["directory"])[0]
                why = ", ".join(sorted(path.name for path in row["directory"].iterdir()))
            rows.append([row["name"], kind, duration_text(row["age"]), bytes_text(size), why])
            kinds[kind] += 1
            total += size
        kinds["stale lock"] = len(self.locks)
        kinds["unfinished export"] = len(self.exports)
        total += sum(weigh(path)[0] for path in self.exports)
        lines = [aligned(rows[:_MOST_LINES])] if rows else []
        lines += [f"and {len(rows) - _MOST_LINES} more"] if len(rows) > _MOST_LINES else []
        removed = ", ".join(counted(number, kind) for kind, number in kinds.items() if number) or "nothing"
        return "\n".join([*lines, *self.remarks, f"{removed} to remove, {bytes_text(total)}"])


def plan_cleaning(out: Path, given: Sequence[Path] = ()) -> Cleaning:
    """Plan to remove interrupted and failed runs, or ``given`` ones; nothing is removed yet.

    With given runs and sweeps go the runs that no other sweep has, and the spreads and accuracies of these runs.
    `InputError` if a given directory does not exist, or a sweep in the folder cannot be read.
    """
    contents = inventory(out)
    runs_of = {row["name"]: row["runs"] for row in contents if row["kind"] == "sweep"}
    doomed = [row for row in contents if row["kind"] == "run" and row["status"] != "finished"]
    if given:
        for sweep_file in out.glob(f"*/{RECORD_NAME}"):
            read_record(sweep_file.parent)  # its runs must be known
        named = {row["directory"]: row["name"] for place in given for row in _rows_at(place, contents)}
        theirs = _with_theirs({*named.values()}, runs_of) - {*named.values()}
        doomed = [row for row in contents if row["directory"] in named or row["name"] in theirs]
    stays: dict[str, list[Row]] = {"running": [], "about to be restored": []}
    remove = []
    for row in doomed:
        if row["kind"] == "run" and row["status"] == "running":
            stays["running"].append(row)
        elif row["directory"].name.endswith(on_disk.REPLACED) and not _place(row["directory"]).exists():
            stays["about to be restored"].append(row)  # there is no run yet that replaces it
        else:
            remove.append(row)
    going = {row["name"] for row in remove}
    needed = {name: len(going & {*runs}) for name, runs in runs_of.items() if name not in going}
    remarks = [
        f"needed by the sweep {name}, which would run them again: {count}" for name, count in needed.items() if count
    ]
    remarks += [f"stays: {len(rows)} {why}" for why, rows in stays.items() if rows]
    locks = [] if given else sorted(out.glob("*.lock"))
    stale = [lock for lock in locks if on_disk.is_run_name(lock.stem) and not on_disk.is_locked(lock.with_suffix(""))]
    exports = [] if given else _abandoned_exports(out, contents)
    return Cleaning(remove, stale, exports, remarks)


def _abandoned_exports(out: Path, contents: Sequence[Row]) -> list[Path]:
    """Folders that killed exports left in the folder of runs and in finished runs."""
    folders = [out] if out.is_dir() else []
    folders += [row["directory"] for row in contents if row["status"] == "finished"]
    exports = []
    for folder in folders:
        exports += abandoned(folder, VTK_SCRATCH)
    return exports


def _rows_at(place: Path, contents: Sequence[Row]) -> list[Row]:
    """Rows of a directory, or of a place at which a run belongs."""
    for find in (Path, _place):
        if rows := [row for row in contents if find(row["directory"]).resolve() == place.resolve()]:
            return rows
    raise refused(place, "no run or sweep in the folder of runs (see walkers list)")


def _with_theirs(names: set[str], runs_of: Mapping[str, Collection[str]]) -> set[str]:
    """Names, with the names of runs that no other sweep has, and of spreads and accuracies of runs."""
    needed = {run for sweep, runs in runs_of.items() if sweep not in names for run in runs}
    further = {run for sweep in names & runs_of.keys() for run in runs_of[sweep]} - needed
    further |= {sweep for sweep in runs_of if _beside(sweep) in names}
    return names if further <= names else _with_theirs(names | further, runs_of)


def clean(cleaning: Cleaning) -> dict[Path, str]:
    """Carry out a plan; return the directories that are left, with the reason (in progress, or a system error)."""
    left = {}
    for row in cleaning.remove:
        directory, is_sweep = row["directory"], row["kind"] == "sweep"
        place = _place(directory)
        with on_disk.locked([] if is_sweep else [place]) as ours:
            if not (ours or is_sweep):
                left[directory] = "kept: a process is computing it"
                continue
            try:
                if not is_sweep:
                    on_disk.recover(place)
                if directory.is_symlink():
                    directory.unlink()
                elif directory.exists():
                    (directory / MANIFEST_NAME).unlink(missing_ok=True)
                    shutil.rmtree(directory)
            except OSError as error:
                left[directory] = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
    for export in cleaning.exports:
        try:
            shutil.rmtree(export)
        except OSError as error:
            left[export] = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
    with on_disk.locked(lock.with_suffix("") for lock in cleaning.locks if lock.exists()):
        pass  # a lock file goes with its lock
    return left
