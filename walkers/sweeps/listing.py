"""The sweeps and the runs in a folder with their status, as text and as JSON."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from walkers.errors import InputError
from walkers.postprocess.measure.uncertainty import (
    ACCURACY,
    ACCURACY_TITLE,
    SPREAD,
    SPREAD_TITLE,
)
from walkers.rounding import counted
from walkers.runs.case_text import FlatCase
from walkers.runs.listing import ListEntry, by_case, bytes_text, folders_in, runs_in
from walkers.runs.status import status_text, worst_status
from walkers.sweeps.record import RECORD_NAME, read_sweep_record, states
from walkers.terminal import wrapped
from walkers.text import fitted_table


def inventory(out: Path) -> list[ListEntry]:
    """All sweeps and runs in a folder, sweeps first, each sorted by name.

    Raises
    ------
    InputError
        If the path is a file.
    """
    runs = runs_in(out)
    sizes = Counter[str]()
    for run in runs:  # a run that is made again has two directories
        sizes[run.name] += run.size
    sweeps = []
    for path in folders_in(out):
        sweep = _entry_of_sweep(path, sizes)
        if sweep is not None:
            sweeps.append(sweep)
    return [*sweeps, *runs]


def _entry_of_sweep(path: Path, sizes: Mapping[str, int]) -> ListEntry | None:
    """The sweep in a directory; None if there is none, or its record cannot be read.

    Parameters
    ----------
    path
        The directory.
    sizes
        Sizes of all runs in the folder in bytes, by their names.
    """
    try:
        record = read_sweep_record(path)
    except InputError:
        return None
    points = Counter(state.status for state in states(record))
    size = 0
    runs = record.names_in_folder
    for run in set(runs):
        size += sizes.get(run, 0)
    sweep = record.sweep
    numbers_of_values = FlatCase()
    values_by_key = zip(*sweep.values, strict=True)
    for key, values in zip(sweep.keys, values_by_key, strict=True):
        numbers_of_values[key] = len(set(map(str, values)))
    return ListEntry(
        kind="sweep",
        name=path.name,
        case=sweep.case_name,
        status=worst_status(points),
        directory=path,
        age=max(time.time() - (path / RECORD_NAME).stat().st_mtime, 0.0),
        size=size,
        points=dict(points),
        runs=runs,
        parameters=numbers_of_values,
        title=sweep.title,
    )


def run_of_sweep(sweep: str) -> str:
    """Name of the run whose spread or accuracy a sweep is; empty for other sweeps."""
    for ending in (SPREAD, ACCURACY):
        if sweep.endswith(ending):
            return sweep.removesuffix(ending)
    return ""


def without_members(contents: Sequence[ListEntry]) -> list[ListEntry]:
    """Contents of a folder without the runs of sweeps that nobody has asked for by themselves.

    Spreads and accuracies of the hidden runs are left out, too.
    """
    members: set[str] = set()
    for sweep in contents:
        members.update(sweep.runs or ())
    for entry in contents:
        if _is_in_companion(entry):  # a draw of now or of an earlier number of draws
            members.add(entry.name)
        if entry.requested:
            members.discard(entry.name)
    left = [entry for entry in contents if entry.name not in members]
    return [entry for entry in left if run_of_sweep(entry.name) not in members]


def without_draws(contents: Sequence[ListEntry]) -> list[ListEntry]:
    """Contents of a folder without the runs that spreads and accuracies alone have made."""
    draws: set[str] = set()
    asked_for: set[str] = set()
    for entry in contents:
        if run_of_sweep(entry.name):
            draws.update(entry.runs or ())
        else:
            asked_for.update(entry.runs or ())
        if _is_in_companion(entry):
            draws.add(entry.name)
        if entry.requested:
            asked_for.add(entry.name)
    return [entry for entry in contents if entry.name not in draws - asked_for]


def _is_in_companion(entry: ListEntry) -> bool:
    """Whether a run is in the directory of a spread or an accuracy."""
    folder, _, _ = entry.name.rpartition("/")
    return bool(run_of_sweep(folder))


def as_json(contents: Sequence[ListEntry]) -> list[dict[str, Any]]:
    """Entries as JSON objects, in SI units.

    They have ``varies`` instead of ``parameters``: for a sweep the number of values of each varied
    key, for a run its values of the keys in which the runs of its case differ.
    """
    keys_by_case = {group.case: group.keys for group in by_case(_of_kind("run", contents))}
    rows = []
    for entry in contents:
        if entry.kind == "sweep":
            keys: Iterable[str] = entry.parameters
        else:
            keys = keys_by_case[entry.case]
        row = vars(entry) | {"directory": str(entry.directory)}
        for name in ("parameters", "title", "requested"):
            del row[name]
        row["varies"] = {key: entry.parameters.get(key) for key in keys}
        rows.append(row)
    return rows


def listing_text(
    contents: Sequence[ListEntry],
    hidden: int = 0,
    width: int | None = None,
    *,
    usually_hidden: int = 0,
) -> str:
    """Entries as text: sweeps, then the runs of each case; velocities in mm/s.

    Spreads and accuracies are named by the condition of their run.

    Parameters
    ----------
    contents
        The entries.
    hidden
        Number of runs of sweeps that are not among them, for the last line.
    width
        Width to which the tables are fitted, characters; None: a line for each entry.
    usually_hidden
        Number of the entries that a list without a condition hides, for the last line.
    """
    sweeps = [entry for entry in _of_kind("sweep", contents) if not run_of_sweep(entry.name)]
    companions = [entry for entry in _of_kind("sweep", contents) if run_of_sweep(entry.name)]
    runs = _of_kind("run", contents)
    blocks = []
    totals = [counted(len(runs), "run")]
    if sweeps:
        blocks.append(_sweeps_text(sweeps, width))
        totals.insert(0, counted(len(sweeps), "sweep"))
    if companions:
        blocks.append(_companions_text(companions, width))
        names = "spread or accuracy" if len(companions) == 1 else "spreads and accuracies"
        totals.append(f"{len(companions)} {names}")
    blocks += [group.as_text(width) for group in by_case(runs)]
    total = f"{', '.join(totals)}, {bytes_text(sum(entry.size for entry in contents))}"
    if hidden:
        total += f"; not shown: {hidden} runs of sweeps (--all)"
    if usually_hidden:
        total += f"; {usually_hidden} of them made by sweeps alone"
    last_lines = [total] if width is None else wrapped(total, width=width)
    return "\n\n".join([*blocks, "\n".join(last_lines)])


def _sweeps_text(sweeps: Sequence[ListEntry], width: int | None) -> str:
    """Sweeps as text, a line each, with the number of values of each varied key."""
    lines = [["sweep", "points", "age", "size", "case", "varies (values)"]]
    for sweep in sweeps:
        varied = [f"{key} ({count})" for key, count in sweep.parameters.items()]
        status = status_text(sweep.points or {})
        lines.append([sweep.name, status, *sweep.age_and_size, sweep.case, ", ".join(varied)])
    return fitted_table(lines, len(lines[0]) - 1, width, styled_column=1)


def _companions_text(companions: Sequence[ListEntry], width: int | None) -> str:
    """Spreads and accuracies as text, a line each, with the condition whose runs they are."""
    lines = [["spread or accuracy", "points", "age", "size", "of"]]
    for sweep in companions:
        condition = sweep.title.removesuffix(SPREAD_TITLE).removesuffix(ACCURACY_TITLE)
        status = status_text(sweep.points or {})
        lines.append([sweep.name, status, *sweep.age_and_size, condition or sweep.case])
    return fitted_table(lines, len(lines[0]) - 1, width, styled_column=1)


def _of_kind(kind: str, contents: Sequence[ListEntry]) -> list[ListEntry]:
    """The entries that are sweeps, or those that are runs."""
    return [entry for entry in contents if entry.kind == kind]
