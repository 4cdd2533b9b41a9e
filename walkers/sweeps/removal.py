"""Removal of runs and sweeps that the user names, with what belongs to them alone."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from walkers.errors import input_error
from walkers.runs.listing import ListEntry, place_of
from walkers.runs.removal import Removal, RemovalKind, is_removable, removal_of
from walkers.sweeps.listing import inventory, run_of_sweep
from walkers.sweeps.record import RECORD_NAME, read_sweep_record


def removals_in(out: Path, places: Sequence[Path]) -> list[Removal]:
    """The removals of runs and sweeps in a folder of runs.

    Removing a sweep also removes the runs that no other sweep has and that were not asked for by
    themselves; removing a run also removes its spread and its accuracy.

    Parameters
    ----------
    out
        Folder of the runs.
    places
        Directories of runs and sweeps, or places at which unfinished runs belong.

    Raises
    ------
    InputError
        If a place has neither a run nor a sweep, a run is in progress, or a sweep in the folder
        cannot be read.
    """
    contents = inventory(out)
    for record in out.glob(f"*/{RECORD_NAME}"):
        read_sweep_record(record.parent)  # which runs it needs must be known
    directories = set()
    names = set()
    for place in places:
        for entry in _entries_at(place, contents):
            directories.add(entry.directory)
            names.add(entry.name)
    runs_of_sweeps = {}
    for entry in contents:
        if entry.kind == "sweep":
            runs_of_sweeps[entry.name] = entry.runs or ()
    asked_for = set()
    for entry in contents:
        # A draw in the directory of a spread is removed with it, whoever asked for it.
        is_in_sweep = "/" in entry.name
        if entry.requested and not is_in_sweep:
            asked_for.add(entry.name)
    removed = _with_members(names, runs_of_sweeps, asked_for)
    members = removed - names
    removals = []
    for entry in contents:
        is_removed = entry.directory in directories or entry.name in members
        if is_removed:
            removals.append(_removal_of(entry, removed, runs_of_sweeps))
    return removals


def _entries_at(place: Path, contents: Sequence[ListEntry]) -> list[ListEntry]:
    """The entry of a directory, or the entries of the run that belongs in a place."""
    resolved = place.resolve()
    in_directory = []
    of_run = []
    for entry in contents:
        if entry.directory.resolve() == resolved:
            in_directory.append(entry)
        if place_of(entry.directory).resolve() == resolved:
            of_run.append(entry)
    entries = in_directory or of_run
    if not entries:
        raise input_error(place, "no run or sweep in the folder of runs (see walkers list)")
    return entries


def _with_members(
    names: Collection[str],
    runs_of_sweeps: Mapping[str, Collection[str]],
    asked_for: Collection[str],
) -> set[str]:
    """Names of runs and sweeps, with the names of what is removed with them.

    Parameters
    ----------
    names
        Names of runs and sweeps.
    runs_of_sweeps
        Names of the runs of all sweeps in the folder, by the names of the sweeps.
    asked_for
        Names of runs that were asked for by themselves, which no sweep takes with it.
    """
    removed = set(names)
    while True:
        needed = set(asked_for)
        members: set[str] = set()
        for sweep, runs in runs_of_sweeps.items():
            if sweep in removed:
                members.update(runs)
            else:
                needed.update(runs)
            if run_of_sweep(sweep) in removed:
                members.add(sweep)
        members -= needed
        if members <= removed:
            return removed
        removed |= members


def _removal_of(
    entry: ListEntry, removed: Collection[str], runs_of_sweeps: Mapping[str, Collection[str]]
) -> Removal:
    """The removal of a run or a sweep.

    Parameters
    ----------
    entry
        The run or the sweep.
    removed
        Names of all runs and sweeps that are removed.
    runs_of_sweeps
        As for `_with_members`.

    Raises
    ------
    InputError
        If a process is computing the run.
    """
    if entry.kind == "sweep":
        remark = "a symbolic link: its target stays"
        if not entry.directory.is_symlink():
            remark = ", ".join(sorted(path.name for path in entry.directory.iterdir()))
        return Removal(entry.directory, RemovalKind.SWEEP, remark=remark)
    if not is_removable(entry):
        raise input_error(entry.name, "expected a run that is not in progress")
    removal = removal_of(entry)
    for sweep, runs in runs_of_sweeps.items():
        if sweep not in removed and entry.name in runs:
            remark = f"needed by the sweep {sweep}, which would run it again"
            return replace(removal, remark=remark)
    return removal
