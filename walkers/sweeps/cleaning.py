"""What may go from a folder of runs, and removing it: never what a process is making.

Who removes a run holds its lock meanwhile, as who makes it does. A finished run loses its manifest first: should the
removal be interrupted, what is left is no run, and goes the next time.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkers.inputs.errors import InputError, Problem
from walkers.runner.directory import REPLACED, is_run_name, recover
from walkers.runner.locks import is_locked, locked
from walkers.runner.manifest import MANIFEST_NAME
from walkers.sweeps.columns import derived_columns, result_columns
from walkers.sweeps.inventory import Entry, inventory, select, weigh
from walkers.sweeps.listing import age_text, aligned, bytes_text
from walkers.sweeps.record import PARSL, RECORD_NAME, read_record

LEFTOVERS = ("interrupted", "failed")
_MOST_LINES = 40
_REPORT = "report.html"
_MARK = b"granular-walkers"
"""In every report and figure that the project writes."""


@dataclass(frozen=True)
class Cleaning:
    """What is to be removed from a folder.

    Attributes
    ----------
    remove
        Runs and sweeps.
    locks
        Lock files that lock nothing.
    needed
        From the names of sweeps that stay to how many of their runs go.
    kept
        Why something that was asked for stays, and how much of it.
    """

    remove: Sequence[Entry]
    locks: Sequence[Path]
    needed: Mapping[str, int]
    kept: Mapping[str, int]

    def as_text(self) -> str:
        """What goes, what of sweeps, what stays, and how much it is."""
        rows = [
            [one.name, "sweep" if one.is_sweep else one.status, age_text(one.age), bytes_text(_bytes(one)), _why(one)]
            for one in self.remove[:_MOST_LINES]
        ]
        lines = [aligned(rows)] if rows else []
        if len(self.remove) > _MOST_LINES:
            lines.append(f"and {len(self.remove) - _MOST_LINES} more")
        lines += [f"needed by the sweep {sweep}, which would make them again: {n}" for sweep, n in self.needed.items()]
        lines += [f"stays: {number} {reason}" for reason, number in self.kept.items()]
        for sweep in self.remove:
            if sweep.is_sweep and not sweep.directory.is_symlink():
                theirs = sorted(set(sweep.directory.iterdir()) - set(_own_files(sweep.directory)))
                names = ", ".join(path.name for path in theirs)
                lines += [f"stays, for walkers did not write it: {names} (in {sweep.directory})"] if theirs else []
        kinds = Counter("sweep" if entry.is_sweep else f"{entry.status} run" for entry in self.remove)
        kinds.update(["stale lock"] * len(self.locks))
        told = ", ".join(f"{number} {kind}{'s' if number > 1 else ''}" for kind, number in kinds.items())
        return "\n".join([*lines, f"{told or 'nothing'} to remove, {bytes_text(sum(map(_bytes, self.remove)))}"])


def _bytes(entry: Entry) -> int:
    """What its removal frees: nothing behind a symbolic link, and of a sweep none of its runs."""
    if entry.directory.is_symlink():
        return 0
    return sum(map(_bytes_of, _own_files(entry.directory))) if entry.is_sweep else entry.size


def _bytes_of(path: Path) -> int:
    if path.is_symlink():
        return 0
    return weigh(path)[0] if path.is_dir() else path.stat().st_size


def _own_files(directory: Path) -> list[Path]:
    """What the project wrote into a sweep's directory: record, Parsl's logs, report and figures of default names."""
    record = read_record(directory)
    columns = {*record.units, *derived_columns(record.analyses), *result_columns(record.analyses)}
    names = {_REPORT, *(f"{column}.png" for column in columns)}
    pages = [path for path in sorted(directory.iterdir()) if path.name in names and _is_marked(path)]
    found = [directory / RECORD_NAME, directory / PARSL, *pages]
    return [path for path in found if path.exists() or path.is_symlink()]


def _is_marked(path: Path) -> bool:
    return path.is_file() and not path.is_symlink() and _MARK in path.read_bytes()


def _why(entry: Entry) -> str:
    if entry.directory.is_symlink():
        return "a symbolic link: what it leads to stays"
    if entry.status == "interrupted" and not entry.is_sweep:
        return "would go on where it was"
    return entry.reason or ""


def plan_cleaning(
    out: Path,
    given: Sequence[str] = (),
    *,
    finished: bool = False,
    case: str | None = None,
    older_than: str | None = None,
) -> Cleaning:
    """See what may go; nothing is removed.

    Parameters
    ----------
    out
        Folder of the run directories.
    given
        Runs (names or directories), and sweeps: these go with those of their runs that no other sweep has. If left out
        what is interrupted or failed.
    finished
        Without ``given``: finished runs too, but those that a sweep has.
    case, older_than
        Of all that only what is of a case, or older than an age such as ``7 d``.

    Raises
    ------
    InputError
        If there is no such run or sweep, or no such age; or if finished runs are to go and a sweep cannot be read.
    """
    entries = inventory(out)
    if finished or given:
        for sweep_file in out.glob(f"*/{RECORD_NAME}"):
            read_record(sweep_file.parent)  # of one that cannot be read nobody knows which runs it has
    sweeps_of: dict[str, list[str]] = {}
    for sweep in entries:
        for run in sweep.runs:
            sweeps_of.setdefault(run, []).append(sweep.name)
    statuses = {*LEFTOVERS, "running", *(["finished"] if finished else [])}
    wanted = [one for one in entries if not one.is_sweep and one.status in statuses]
    wanted = select(_given(given, entries, sweeps_of) if given else wanted, case=case, older_than=older_than)
    reasons = {
        entry.directory: _reason_to_stay(entry, [] if given else sweeps_of.get(entry.name, [])) for entry in wanted
    }
    remove = [entry for entry in wanted if reasons[entry.directory] is None]
    going = {entry.name for entry in remove if entry.is_sweep}
    needing = [name for entry in remove if not entry.is_sweep for name in sweeps_of.get(entry.name, ())]
    return Cleaning(
        remove,
        [] if given or case or older_than else _stale_locks(out),
        Counter(name for name in needing if name not in going),
        Counter(reason for reason in reasons.values() if reason is not None),
    )


def _reason_to_stay(entry: Entry, sweeps: Sequence[str]) -> str | None:
    """Why a run or a sweep stays, which of these sweeps have; None if it goes."""
    if entry.status == "running":
        return "running"
    if entry.status == "finished" and sweeps:
        return f"finished, of the sweep {sweeps[0]} (give its name to remove it)"
    if entry.directory.name.endswith(REPLACED) and not entry.place.exists():
        return "about to be put back in its place"
    return None


def _given(given: Sequence[str], entries: Sequence[Entry], sweeps_of: Mapping[str, Sequence[str]]) -> list[Entry]:
    """The entries of these names or directories, and the runs that go with sweeps."""
    found: dict[Path, Entry] = {}
    for name in given:
        path = Path(name).resolve()
        matches = [one for one in entries if name in (one.name, one.directory.name) or path == one.directory.resolve()]
        if not matches:
            told = "no run or sweep in the folder of runs (see walkers list; another folder is given by --out)"
            raise InputError(name, [Problem("", None, told)])
        exact = [one for one in matches if name == one.directory.name]
        found |= {one.directory: one for one in exact or matches}
    going = {one.name for one in found.values() if one.is_sweep}
    for one in entries:
        if not one.is_sweep and one.name in sweeps_of and going.issuperset(sweeps_of[one.name]):
            found[one.directory] = one
    return list(found.values())


def _stale_locks(out: Path) -> list[Path]:
    return [path for path in sorted(out.glob("*.lock")) if is_run_name(path.stem) and not is_locked(_place(path))]


def _place(lock: Path) -> Path:
    return lock.with_name(lock.name.removesuffix(".lock"))


def clean(cleaning: Cleaning) -> dict[Path, str]:
    """Remove what `plan_cleaning` named; what is still there, and why: somebody makes it now, or the system refused."""
    left = {}
    for entry in cleaning.remove:
        with locked([] if entry.is_sweep else [entry.place]) as ours:
            if not (ours or entry.is_sweep):
                left[entry.directory] = "a process has begun to make it, it stays"
                continue
            try:
                if entry.is_sweep:
                    _remove_sweep(entry.directory)
                else:
                    recover(entry.place)
                    _remove(entry.directory)
            except OSError as error:
                left[entry.directory] = f"cannot be removed whole: {error.strerror or error} ({error.filename})"
    with locked(_place(lock) for lock in cleaning.locks if lock.exists()):
        pass  # a lock file goes with its lock
    return left


def _remove_sweep(directory: Path) -> None:
    """Remove what the project wrote into a sweep's directory, the record last, and the directory if that is all."""
    if directory.is_symlink():
        directory.unlink()
        return
    for path in reversed(_own_files(directory)):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
    if not any(directory.iterdir()):
        directory.rmdir()


def _remove(directory: Path) -> None:
    """Remove a run's directory, its manifest before all else; of a symbolic link the link alone."""
    if directory.is_symlink():
        directory.unlink()
    elif directory.exists():
        (directory / MANIFEST_NAME).unlink(missing_ok=True)
        shutil.rmtree(directory)
