"""The runs in a folder with their status, and as text.

Listing opens no dumps and no tables, and does without pandas: a folder of ten thousand runs takes
seconds. Sweeps are listed by `walkers.sweeps.listing`.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from stat import S_ISDIR
from typing import Any

from walkers import RECORDS
from walkers.errors import InputError, input_error, suggestion
from walkers.files import read_json
from walkers.inputs.case_building import stored_case
from walkers.inputs.tables.case import Case
from walkers.inputs.units import with_symbols
from walkers.postprocess.measure.numbers import headline, short_text
from walkers.postprocess.measure.results import Results, json_numbers, read_results
from walkers.rounding import DIGITS, duration_text
from walkers.runner import run_directory
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runs.case_text import (
    FlatCase,
    differing,
    flattened,
    short_keys,
    value_text,
    without_parts,
)
from walkers.runs.conditions import Condition
from walkers.runs.making import progress_at
from walkers.runs.status import state_at
from walkers.text import fitted_table

_SIZES = {"GB": 1e9, "MB": 1e6, "kB": 1e3}
"""Bytes in the units of sizes, the largest first."""
_USUAL_NAMES = {"speed": "velocity"}
"""Names of numbers of results, by other words that a user may look for."""


@dataclass(frozen=True, kw_only=True)
class ListEntry:
    """A run or a sweep in a folder of runs.

    Attributes
    ----------
    kind
        ``run`` or ``sweep``.
    name
        Name of the directory without the ending of unfinished runs, such as ``fig1b-9845e7cce370``;
        of a run in the directory of a sweep, after the name of the sweep and a slash.
    case
        Name of the case; of a sweep, of its base case.
    status
        finished, running, failed, or interrupted: a run can be continued, or points are missing.
    directory
        Where the files are now.
    age
        Time since the end of the run, or since the last change of an unfinished one, s.
    size
        Size of the files in bytes; of a sweep, of its runs.
    reason, message
        Why a run failed, how far it is, or a remark on a finished run; None if there is none.
    velocity
        Main velocity of walkers, m/s; None if there is none.
    result
        The main numbers as text.
    numbers
        All numbers of the result, SI units; None for unfinished runs and sweeps.
    points
        Numbers of points of a sweep by status.
    runs
        Names of the runs of a sweep.
    parameters
        Values of the case (`flattened`); of a sweep, the number of values of each varied key.
    title
        What a sweep is about; empty for a run.
    requested
        Whether a run was asked for by itself, not only as a point of a sweep.
    """

    kind: str
    name: str
    case: str
    status: str
    directory: Path
    age: float = 0.0
    size: int = 0
    reason: str | None = None
    message: str | None = None
    velocity: float | None = None
    result: str = "-"
    numbers: Mapping[str, Any] | None = None
    points: Mapping[str, int] | None = None
    runs: Sequence[str] | None = None
    parameters: FlatCase = field(default_factory=FlatCase)
    title: str = ""
    requested: bool = False

    @property
    def age_and_size(self) -> list[str]:
        """Age and size as text."""
        return [duration_text(self.age), bytes_text(self.size)]


def runs_in(out: Path) -> list[ListEntry]:
    """The runs in a folder and in the sweeps in it, finished or not, sorted by name.

    Of two runs with the same name, the finished one comes first. Runs in progress without a
    directory, such as those in a shared deck, are among them.

    Raises
    ------
    InputError
        If the path is a file. A folder that does not exist has no runs.
    """
    runs = _runs_in_one_folder(out)
    for path in folders_in(out):
        if (path / RECORDS["sweep"]).is_file():  # of a spread, whose draws are in it
            for run in _runs_in_one_folder(path):
                runs.append(replace(run, name=f"{path.name}/{run.name}"))
    return sorted(runs, key=lambda run: (run.name, run.status != "finished"))


def _runs_in_one_folder(folder: Path) -> list[ListEntry]:
    """The runs in a folder, without those in sweeps."""
    runs = []
    for path in folders_in(folder):
        run = entry_of(path)
        if run is not None:
            runs.append(run)
    return runs + _without_directory(folder, {place_of(run.directory) for run in runs})


def folders_in(out: Path) -> list[Path]:
    """The folders in a folder of runs, sorted; `InputError` if it is a file."""
    if not out.exists():
        return []
    if not out.is_dir():
        raise input_error(out, "expected a folder of runs, this is a file")
    return sorted(path for path in out.iterdir() if path.is_dir())


def place_of(directory: Path) -> Path:
    """The final directory of a run, for the directory in which it is now.

    That may have the ending of an unfinished or of a replaced run, which the final name lacks.
    """
    name = directory.name.removesuffix(run_directory.UNFINISHED)
    return directory.with_name(name.removesuffix(run_directory.REPLACED))


def _without_directory(out: Path, listed: set[Path]) -> list[ListEntry]:
    """Runs in progress that have a lock, but no directory.

    They are in a shared deck, or their directory is about to be made.
    """
    runs = []
    for lock in out.glob("*.lock"):
        place = lock.with_suffix("")
        if place not in listed and run_directory.is_locked(place):
            entry = ListEntry(
                kind="run",
                name=place.name,
                case=_case_name_of(place),
                status="running",
                directory=place,
            )
            runs.append(entry)
    return runs


def entry_of(path: Path) -> ListEntry | None:
    """The run in a directory; None if the directory is none that this program has made.

    The directory must be that of a finished run, or have the name of a run. If its case cannot be
    read, it must have the name of a run, and be a finished run or certainly an unfinished one.
    """
    place = place_of(path)
    has_final_name = path == place
    # A manifest counts only in the final directory: a replaced run, which is not listed as
    # finished, still has its own.
    finished = has_final_name and run_directory.is_finished(path)
    has_run_name = run_directory.is_run_name(place.name)
    if not finished and not has_run_name:
        return None
    case = _case_in(path)
    if case is not None:
        case_name = case.name
        parameters = flattened(case)
    elif has_run_name and (finished or _is_certainly_unfinished(path)):
        case_name = _case_name_of(place)
        parameters = FlatCase()
    else:
        return None
    if finished:
        return _finished(path, case_name, parameters)
    return _unfinished(path, case_name, parameters)


def _is_certainly_unfinished(path: Path) -> bool:
    """Whether a directory has the ending of the name of an unfinished run, and the files of one."""
    return path != place_of(path) and run_directory.holds_unfinished(path)


def _case_name_of(place: Path) -> str:
    """The name of the case in the name of a run directory."""
    return place.name.rpartition("-")[0]


def _case_in(path: Path) -> Case | None:
    """The case of a run directory; None if it cannot be read."""
    try:
        return stored_case(read_json(path / run_directory.CASE_NAME))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _finished(path: Path, case: str, parameters: FlatCase) -> ListEntry:
    """A finished run; without numbers if its result cannot be read, and with the reason."""
    size, _ = size_and_last_change(path)
    numbers = None
    velocity = None
    text = "-"
    reason: str | None
    try:
        results = read_results(path)
    except InputError as error:
        reason = error.problems[0].expected
    else:
        numbers = json_numbers(results)
        text = short_text(results)
        main = headline(results)
        if main != "climbs":
            velocity = numbers.get(main)
        reason = _remark(results)
    return ListEntry(
        kind="run",
        name=path.name,
        case=case,
        status="finished",
        directory=path,
        age=max(time.time() - (path / MANIFEST_NAME).stat().st_mtime, 0.0),
        size=size,
        reason=reason,
        velocity=velocity,
        result=text,
        numbers=numbers,
        parameters=parameters,
        requested=run_directory.is_requested(path),
    )


def _remark(results: Results) -> str | None:
    """A short remark on the run of a deck that was run by hand; None on other runs."""
    if results.about["deck_edited"]:
        return "edited and run by hand"
    return next(iter(results.about["by_hand"]), None)


def _unfinished(path: Path, case: str, parameters: FlatCase) -> ListEntry:
    """A run in progress, an interrupted run or a failed run."""
    place = place_of(path)
    size, changed = size_and_last_change(path)
    state = state_at(place, path)
    status = state.status
    reason = state.reason
    if status == "missing":
        status = "interrupted"
        reason = state.message
    elif status == "running":
        progress = progress_at(place)
        if progress:
            reason = progress.stage
    return ListEntry(
        kind="run",
        name=place.name,
        case=case,
        status=status,
        directory=path,
        age=max(time.time() - changed, 0.0),
        size=size,
        reason=reason,
        message=state.message,
        parameters=parameters,
    )


def run_text(directory: Path) -> str:
    """Status and result of the run in a directory, such as ``finished, 1.08 mm/s``."""
    run = entry_of(directory)
    if run is None:
        return "missing"
    return f"{run.status}, {run.result}".removesuffix(", -")


def size_and_last_change(path: Path) -> tuple[int, float]:
    """Size and time of the last change of a file, or of all files in a directory.

    Files with several names, such as tables that the segments of a pile share, count once.

    Returns
    -------
    size : int
        In bytes.
    changed : float
        Time of the last change in s since the epoch; 0 if there is no file.
    """
    sizes = {}
    changed = 0.0
    for file in [path, *path.rglob("*")]:
        with suppress(OSError):  # just being removed
            about = file.lstat()
            if not S_ISDIR(about.st_mode):
                sizes[about.st_dev, about.st_ino] = about.st_size
                changed = max(changed, about.st_mtime)
    return sum(sizes.values()), changed


def bytes_text(size: int) -> str:
    """A number of bytes, such as ``1.2 MB``."""
    for name, unit in _SIZES.items():
        if size >= unit:
            return f"{size / unit:.3g} {name}"
    return f"{size} B"


def select(runs: Sequence[ListEntry], where: Iterable[str]) -> list[ListEntry]:
    """The runs that meet all conditions (`walkers.runs.conditions.Condition`).

    Raises
    ------
    InputError
        If a condition cannot be read, or no run has its key or number.
    """
    selected = list(runs)
    for text in where:
        condition = Condition.read(text)
        answers = [condition.holds(run.parameters, run.numbers) for run in selected]
        if selected and all(answer is None for answer in answers):
            raise _no_such_key(condition, selected)
        selected = [run for run, answer in zip(selected, answers, strict=True) if answer]
    return selected


def _no_such_key(condition: Condition, runs: Sequence[ListEntry]) -> InputError:
    """The error for a condition whose key no run has, with the keys and numbers that runs have."""
    keys: set[str] = set()
    numbers: set[str] = set()
    for run in runs:
        keys.update(run.parameters)
        numbers.update(run.numbers or ())
    names = short_keys(sorted(keys))
    near = suggestion(condition.key, [*names, *sorted(numbers)])
    usual_name = _USUAL_NAMES.get(condition.key)
    if usual_name in numbers:
        near = f'; did you mean "{usual_name}"?'
    text = f'"{condition.text}": no run has such a key{near}; runs have {", ".join(names)}'
    if numbers:
        text += ", and the numbers of their results, such as velocity"
    return input_error("where", text)


@dataclass(frozen=True)
class RunsOfCase:
    """The runs of a case.

    Attributes
    ----------
    case
        Name of the case.
    runs
        Its runs.
    keys
        Keys in which the runs differ. Those that follow from others are left out, unless the runs
        differ only in them.
    """

    case: str
    runs: Sequence[ListEntry]
    keys: Sequence[str]

    def as_text(self, width: int | None = None) -> str:
        """A line for each run, with a column for each key by which the runs differ.

        If the columns are wider than ``width``, the values stand below each run.
        """
        heads = [f"{self.case} ({len(self.runs)})", "status", "result", "age", "size"]
        lines = [[*heads, *self._headings]]
        columns = [self._value_texts(key) for key in self.keys]
        for number, run in enumerate(self.runs):
            status = run.status
            if run.reason:
                status = f"{run.status}: {run.reason}"
            values = [with_symbols(texts[number]) for texts in columns]
            lines.append([run.name, status, run.result, *run.age_and_size, *values])
        return fitted_table(lines, len(heads), width, styled_column=1)

    @property
    def _headings(self) -> list[str]:
        """The headings of the keys: their last parts, or the last two if a table is in a table.

        ``bead_wall`` alone may be a friction or a roughness.
        """
        headings = short_keys(self.keys)
        for number, key in enumerate(self.keys):
            if key.count(".") > 1:
                _, _, headings[number] = key.partition(".")
        return headings

    def _value_texts(self, key: str) -> list[str]:
        """The value of a key in each run.

        Numbers that no run gives itself have `DIGITS` digits if these distinguish all of them.
        """
        texts = [value_text(run.parameters, key) for run in self.runs]
        for run in self.runs:
            if run.parameters.origin_words.get(key, "").startswith("given"):
                return texts
        rounded_texts = []
        for run in self.runs:
            parameters = dict(run.parameters)
            if isinstance(parameters.get(key), float):
                parameters[key] = float(f"{parameters[key]:.{DIGITS}g}")
            rounded_texts.append(value_text(parameters, key))
        if len(set(rounded_texts)) < len(set(texts)):
            return texts
        return rounded_texts


def by_case(runs: Sequence[ListEntry]) -> list[RunsOfCase]:
    """The runs of each case, in the order in which the cases first occur."""
    runs_of: dict[str, list[ListEntry]] = {}
    for run in runs:
        runs_of.setdefault(run.case, []).append(run)
    groups = []
    for case, members in runs_of.items():
        given, derived = differing([run.parameters for run in members if run.parameters])
        groups.append(RunsOfCase(case, members, without_parts(given or derived)))
    return groups
