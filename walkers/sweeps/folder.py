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
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISDIR
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, refused
from walkers.inputs.case import Case
from walkers.postprocess.numbers import headline, in_short
from walkers.postprocess.results import plain, read
from walkers.postprocess.uncertainty import ACCURACY, SPREAD
from walkers.rounding import counted, duration_text
from walkers.runner import directory as on_disk
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME
from walkers.sweeps.making import progress_at
from walkers.sweeps.readable import FlatCase, chosen, differing, flattened, readable, short_keys
from walkers.sweeps.table import RECORD_NAME, read_record, state_at, states, status_text, worst_status
from walkers.text import aligned

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    *("kind", "name", "case", "status", "directory", "age", "size", "reason", "message"),
    *("velocity", "result", "numbers", "points", "runs", "parameters"),
)
_SIZES = {"GB": 1e9, "MB": 1e6, "kB": 1e3}
_MOST_LINES = 40


def inventory(out: Path) -> pd.DataFrame:
    """All runs and sweeps in a folder, sweeps first, sorted by name.

    Returns
    -------
    DataFrame
        One row per run (``case-hash``) or sweep, with None for missing values. Columns are ``kind``, ``name``,
        ``case``, ``status`` (finished, running, failed, or interrupted: a run can be continued, or points of a sweep
        are missing), ``directory``, ``age`` (s, since the end of the run or the last change), ``size`` (bytes of the
        files, for a sweep of its runs), ``reason`` and ``message`` of a failure. A finished run has the ``numbers`` of
        its result (SI units), the main ones as text in ``result``, and for walkers the main ``velocity`` (m/s). A sweep
        has numbers of ``points`` by status and the names of its ``runs``. ``parameters`` are the values of the case
        (`walkers.sweeps.readable.flattened`), for a sweep the number of values of each varied key.
    """
    import pandas as pd

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
    runs.sort(key=lambda run: (run["name"], run["status"] != "finished"))
    return pd.DataFrame([*sweeps, *runs], columns=list(COLUMNS), dtype=object)


def _row(kind: str, name: str, directory: Path, status: str, **values: Any) -> dict[str, Any]:
    blank = dict.fromkeys(COLUMNS) | {"result": "-", "parameters": FlatCase(), "case": name.rpartition("-")[0]}
    return blank | {"kind": kind, "name": name, "directory": directory, "status": status} | values


def _place(directory: Path) -> Path:
    """Where a run belongs; beside it is its lock."""
    return directory.with_name(directory.name.removesuffix(on_disk.UNFINISHED).removesuffix(on_disk.REPLACED))


def _run(path: Path, now: float) -> dict[str, Any] | None:
    place = _place(path)
    finished = place == path and (path / MANIFEST_NAME).is_file()
    if not (finished or on_disk.is_run_name(place.name)):  # a user's folder
        return None
    values: dict[str, Any] = {}
    try:
        case = Case.from_dict(read_json(path / on_disk.CASE_NAME))
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
    values |= {"age": max(now - newest, 0.0), "reason": reason, "message": state.message}
    return _row("run", place.name, path, status, **values)


def _result(path: Path) -> dict[str, Any]:
    """Columns of a finished run."""
    try:
        results = read(path)
    except InputError as error:
        return {"reason": error.problems[0].expected}
    notes, numbers, main = results.about["by_hand"], plain(results.numbers), headline(results)
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


def _sweep(path: Path, runs: Sequence[Mapping[str, Any]], now: float) -> dict[str, Any] | None:
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


def select(contents: pd.DataFrame, where: Sequence[str]) -> pd.DataFrame:
    """The runs for which all conditions hold, such as ``drive.frequency=80 Hz``; without conditions all rows.

    `InputError` if a condition cannot be read, or no run has such a key.
    """
    for text in where:
        contents = contents[contents["kind"] == "run"]
        contents = contents[chosen([*contents["parameters"]], text)]
    return contents


def members(contents: pd.DataFrame) -> pd.Series[bool]:
    """Whether a row is a run of a sweep, and has no spread and no accuracy of its own."""
    runs = {run for names in contents["runs"].dropna() for run in names}
    return contents["name"].isin(runs - {_beside(name) for name in contents["name"]})


def _beside(name: str) -> str:
    """Name of the run of a sweep that is its spread or accuracy; empty for other sweeps."""
    return name.removesuffix(SPREAD).removesuffix(ACCURACY) if name.endswith((SPREAD, ACCURACY)) else ""


def _by_case(contents: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame, list[str]]]:
    """The runs of each case, and the keys by which they differ."""
    for case, runs in contents[contents["kind"] == "run"].groupby("case", sort=False):
        yield str(case), runs, differing([parameters for parameters in runs["parameters"] if parameters])


def as_json(contents: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as JSON objects, SI units; for a run, ``varies`` has the values by which runs of its case differ."""
    keys = {case: keys for case, _, keys in _by_case(contents)}
    return [
        {str(name): str(value) if name == "directory" else value for name, value in row.items() if name != "parameters"}
        | {"varies": {key: values.get(key) for key in (values if row["kind"] == "sweep" else keys[row["case"]])}}
        for row, values in zip(contents.to_dict("records"), contents["parameters"], strict=True)
    ]


def as_text(contents: pd.DataFrame, hidden: int = 0) -> str:
    """Rows as text: sweeps, then the runs of each case with a column for each key by which they differ; mm/s.

    The last line states the number of ``hidden`` runs of sweeps.
    """
    sweeps = contents[contents["kind"] == "sweep"]
    points = sweeps["points"].map(status_text)
    varied = sweeps["parameters"].map(lambda keys: ", ".join(f"{key} ({number})" for key, number in keys.items()))
    columns = {"sweep": sweeps["name"], "points": points, **_weight(sweeps), "case": sweeps["case"]}
    blocks = [_lines({**columns, "varies (values)": varied})] if len(sweeps) else []
    for case, runs, keys in _by_case(contents):
        status = runs["status"] + runs["reason"].map(lambda reason: f": {reason}" if reason else "")
        columns = {f"{case} ({len(runs)})": runs["name"], "status": status, "result": runs["result"], **_weight(runs)}
        for key, head in zip(keys, short_keys(keys), strict=True):
            columns[head] = runs["parameters"].map(lambda values, key=key: readable(key, values.get(key)))
        blocks.append(_lines(columns))
    total = [counted(len(sweeps), "sweep")] * bool(len(sweeps)) + [counted(len(contents) - len(sweeps), "run")]
    more = f"; not shown: {hidden} runs of sweeps (--all)" if hidden else ""
    return "\n\n".join([*blocks, f"{', '.join(total)}, {bytes_text(sum(contents['size']))}{more}"])


def _weight(rows: pd.DataFrame) -> dict[str, pd.Series[Any]]:
    return {"age": rows["age"].map(duration_text), "size": rows["size"].map(bytes_text)}


def _lines(columns: Mapping[str, pd.Series[Any]]) -> str:
    return aligned([list(columns), *map(list, zip(*columns.values(), strict=True))])


def bytes_text(size: int) -> str:
    """A number of bytes, such as ``1.2 MB``."""
    return next((f"{size / unit:.3g} {name}" for name, unit in _SIZES.items() if size >= unit), f"{size} B")


# --- removal ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cleaning:
    """The plan of a cleaning: the rows of the `inventory` and the stale lock files to remove; remarks to print."""

    remove: pd.DataFrame
    locks: Sequence[Path]
    remarks: Sequence[str]

    def as_text(self) -> str:
        """The removed runs and sweeps with the total size, and the remarks."""
        rows, kinds, total = [], Counter[str](), 0
        for row in self.remove.to_dict("records"):
            kind = "sweep" if row["kind"] == "sweep" else f"{row['status']} run"
            size, why = row["size"], row["reason"] or ("" if row["status"] == "finished" else "can be continued")
            if row["directory"].is_symlink():
                size, why = 0, "a symbolic link: its target stays"
            elif row["kind"] == "sweep":
                size = weigh(row["directory"])[0]
                why = ", ".join(sorted(path.name for path in row["directory"].iterdir()))
            rows.append([row["name"], kind, duration_text(row["age"]), bytes_text(size), why])
            kinds[kind] += 1
            total += size
        kinds["stale lock"] = len(self.locks)
        lines = [aligned(rows[:_MOST_LINES])] if rows else []
        lines += [f"and {len(rows) - _MOST_LINES} more"] if len(rows) > _MOST_LINES else []
        removed = ", ".join(counted(number, kind) for kind, number in kinds.items() if number) or "nothing"
        return "\n".join([*lines, *self.remarks, f"{removed} to remove, {bytes_text(total)}"])


def plan_cleaning(out: Path, given: Sequence[Path] = ()) -> Cleaning:
    """Plan a cleaning; nothing is removed.

    Without ``given`` directories, interrupted and failed runs are removed. Otherwise the given runs and sweeps are
    removed, with the runs that no other sweep has, and with spreads and accuracies of the removed runs. `InputError` if
    a given directory does not exist, or a sweep in the folder cannot be read.
    """
    import pandas as pd

    contents = inventory(out)
    is_sweep = contents["kind"] == "sweep"
    runs_of = dict(zip(contents.loc[is_sweep, "name"], contents.loc[is_sweep, "runs"], strict=True))
    doomed = ~is_sweep & (contents["status"] != "finished")
    if given:
        for sweep_file in out.glob(f"*/{RECORD_NAME}"):
            read_record(sweep_file.parent)  # its runs must be known
        named = pd.Series(contents.index.isin([row for place in given for row in _rows_at(place, contents)]))
        names = {*contents["name"][named]}
        doomed = named | contents["name"].isin(_with_theirs(names, runs_of) - names)
    stays = {
        "running": doomed & ~is_sweep & (contents["status"] == "running"),
        "about to be restored": doomed & contents["directory"].map(_waits),
    }
    remove = contents[doomed & ~stays["running"] & ~stays["about to be restored"]]
    going = {*remove["name"]}
    needed = {name: len(going & {*runs}) for name, runs in runs_of.items() if name not in going}
    remarks = [
        f"needed by the sweep {name}, which would run them again: {count}" for name, count in needed.items() if count
    ]
    remarks += [f"stays: {rows.sum()} {why}" for why, rows in stays.items() if rows.any()]
    locks = [] if given else sorted(out.glob("*.lock"))
    stale = [lock for lock in locks if on_disk.is_run_name(lock.stem) and not on_disk.is_locked(lock.with_suffix(""))]
    return Cleaning(remove, stale, remarks)


def _rows_at(place: Path, contents: pd.DataFrame) -> list[Any]:
    """Rows of a directory, or of a place at which a run belongs."""
    for find in (Path, _place):
        places = contents["directory"].map(lambda path, find=find: find(path).resolve())
        if (rows := places == place.resolve()).any():
            return list(contents.index[rows])
    raise refused(place, "no run or sweep in the folder of runs (see walkers list)")


def _with_theirs(names: set[str], runs_of: Mapping[str, Sequence[str]]) -> set[str]:
    """Names, with the names of runs that no other sweep has, and of spreads and accuracies of runs."""
    needed = {run for sweep, runs in runs_of.items() if sweep not in names for run in runs}
    further = {run for sweep in names & runs_of.keys() for run in runs_of[sweep]} - needed
    further |= {sweep for sweep in runs_of if _beside(sweep) in names}
    return names if further <= names else _with_theirs(names | further, runs_of)


def _waits(directory: Path) -> bool:
    """Whether a run was moved aside, and the one that replaces it does not exist."""
    return directory.name.endswith(on_disk.REPLACED) and not _place(directory).exists()


def clean(cleaning: Cleaning) -> dict[Path, str]:
    """Carry out a plan; return the directories that are left, with the reason (in progress, or a system error)."""
    left = {}
    for row in cleaning.remove.to_dict("records"):
        place = _place(row["directory"])
        with on_disk.locked([] if row["kind"] == "sweep" else [place]) as ours:
            if not (ours or row["kind"] == "sweep"):
                left[row["directory"]] = "kept: a process is computing it"
                continue
            try:
                if row["kind"] == "run":
                    on_disk.recover(place)
                if row["directory"].is_symlink():
                    row["directory"].unlink()
                elif row["directory"].exists():
                    (row["directory"] / MANIFEST_NAME).unlink(missing_ok=True)
                    shutil.rmtree(row["directory"])
            except OSError as error:
                left[row["directory"]] = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
    with on_disk.locked(lock.with_suffix("") for lock in cleaning.locks if lock.exists()):
        pass  # a lock file goes with its lock
    return left
