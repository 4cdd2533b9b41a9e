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
    """The removal of runs and sweeps in a folder of runs.

    With a sweep go the runs that no other sweep has; with a run go its spread and its accuracy.

    Parameters
    ----------
    out
        Folder of the runs.
    places
        Directories of runs and sweeps, or places at which unfinished runs belong.

    Raises
    ------
    InputError
        If a place has neither a run nor a sweep, a run is in progress, or a sweep in the folder cannot be read.
    """
    contents = inventory(out)
    for record in out.glob(f"*/{RECORD_NAME}"):
        read_sweep_record(record.parent)  # which runs it needs must be known
    directories = set()
    names = set()
    for place in places:
        for entry in _at(place, contents):
            directories.add(entry.directory)
            names.add(entry.name)
    runs_of = {entry.name: entry.runs or () for entry in contents if entry.kind == "sweep"}
    going = _with_members(names, runs_of)
    members = going - names
    removed = [
        entry for entry in contents if entry.directory in directories or entry.name in members
    ]
    return [_removal_of(entry, going, runs_of) for entry in removed]


def _at(place: Path, contents: Sequence[ListEntry]) -> list[ListEntry]:
    """The entry of a directory, or the entries of the run that belongs in a place."""
    resolved = place.resolve()
    entries = [entry for entry in contents if entry.directory.resolve() == resolved]
    if not entries:
        entries = [entry for entry in contents if place_of(entry.directory).resolve() == resolved]
    if not entries:
        raise input_error(place, "no run or sweep in the folder of runs (see walkers list)")
    return entries


def _with_members(names: Collection[str], runs_of: Mapping[str, Collection[str]]) -> set[str]:
    """Names of runs and sweeps, with the names of what goes with them.

    Parameters
    ----------
    names
        Names of runs and sweeps.
    runs_of
        Names of the runs of all sweeps in the folder, by the names of the sweeps.
    """
    going = set(names)
    while True:
        needed: set[str] = set()
        members: set[str] = set()
        for sweep, runs in runs_of.items():
            if sweep in going:
                members.update(runs)
            else:
                needed.update(runs)
            if run_of_sweep(sweep) in going:
                members.add(sweep)
        members -= needed
        if members <= going:
            return going
        going |= members


def _removal_of(
    entry: ListEntry, going: Collection[str], runs_of: Mapping[str, Collection[str]]
) -> Removal:
    """The removal of a run or a sweep; `InputError` if a process is computing the run."""
    if entry.kind == "sweep":
        remark = "a symbolic link: its target stays"
        if not entry.directory.is_symlink():
            remark = ", ".join(sorted(path.name for path in entry.directory.iterdir()))
        return Removal(entry.directory, RemovalKind.SWEEP, remark=remark)
    if not is_removable(entry):
        raise input_error(entry.name, "expected a run that is not in progress")
    removal = removal_of(entry)
    needed_by = [
        sweep for sweep, runs in runs_of.items() if sweep not in going and entry.name in runs
    ]
    if needed_by:
        text = f"needed by the sweep {needed_by[0]}, which would run it again"
        removal = replace(removal, remark=text)
    return removal
