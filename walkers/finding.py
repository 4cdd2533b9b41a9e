"""Find a run, a sweep or a case by the name that a user gives, in the same way for all commands."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers import DEFAULT_OUT, RECORDS
from walkers.errors import WalkersError, refused
from walkers.inputs.reading import find_input, is_sweep_file, load_case, shipped
from walkers.runner.binary import find_engine
from walkers.runner.directory import (
    CASE_NAME,
    UNFINISHED,
    case_of,
    is_deck_folder,
    is_finished,
    is_locked,
    is_run_name,
    layout_of,
    run_place,
    segment_directories,
    unfinished,
)
from walkers.runner.manifest import read_manifest

if TYPE_CHECKING:
    from walkers.inputs.case import Case

NOT_A_RUN = {
    "folder": "not a finished run: expected a folder with a manifest.json",
    "calibration": "a calibration's outcome: its report is calibration.md",
    "sweep": "is a sweep: expected one of its runs; walkers list, plot, report and compare take sweeps",
    "archive": "an archive: unpack it and give a run or a sweep in it; walkers check files takes it as it is",
}


class Place(NamedTuple):
    """Place of a named object: path, kind (of `RECORDS`, ``archive`` or ``folder``), and case.

    The path of an unfinished run is that of its final directory.
    """

    path: Path
    kind: str
    case: Case | None = None


def placed(name: str | Path, out: Path = DEFAULT_OUT) -> Place | None:
    """The object with a name, which is a path or a name in a folder of runs; None if there is none.

    A folder does not hide a shipped case of the same name. The folder of a deck that was run by hand becomes a run
    directory.
    """
    path = Path(name)
    with suppress(OSError):  # a name that no file system accepts
        for place in (path, out / path):
            if is_deck_folder(place) and str(name) not in shipped("case"):
                from walkers.sweeps.by_hand import take_in

                take_in(place)
            for kind, file in RECORDS.items():
                if (place / file).is_file():
                    return Place(place, kind)
            bare = place.parent / place.name.removesuffix(UNFINISHED)
            if is_run_name(bare.name) and _is_begun(bare):
                return Place(bare, "run")
        if (out / path.stem / RECORDS["sweep"]).is_file() and is_sweep_file(path):
            return Place(out / path.stem, "sweep")
        if path.suffix == ".zip" and path.is_file():
            return Place(path, "archive")
        if path.is_dir() and str(name) not in shipped("case"):
            return Place(path, "folder")
    return None


def files_of(place: Path) -> Path:
    """The directory with the files of a run, finished or not."""
    return place if is_finished(place) else unfinished(place)


def _is_begun(place: Path) -> bool:
    """Whether a place belongs to a running or interrupted run."""
    return (unfinished(place) / CASE_NAME).is_file() or is_locked(place)


def case_at(
    what: Case | str | Path | Mapping[str, Any], out: str | Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None
) -> tuple[Case, Path]:
    """The case that a user names, and the folder in which its run belongs.

    Parameters
    ----------
    what
        A case (resolved, tables, file or shipped name), or a run (directory, or name in ``out``): then its case, and
        the folder that contains the run.
    out
        Folder of the run directories.
    changes
        Values that replace those of the case, by dotted keys.
    """
    out = Path(out)
    if isinstance(what, Mapping):
        return load_case(what, changes), out
    if not isinstance(what, (str, Path)):
        return what.changed(changes or {}), out
    there = placed(what, out)
    if there and there.kind in RECORDS and there.kind != "run":
        find_input(what if is_sweep_file(Path(what)) else there.path, "case")
        raise refused(what, NOT_A_RUN[there.kind])
    if there and there.kind == "folder":
        raise refused(what, "is a folder without a run")
    if there is None or there.kind != "run":
        return load_case(what, changes), out
    with _refusing_damage(there.path, "the case of the run cannot be read"):
        case = case_of(files_of(there.path))
    return case.changed(changes or {}), there.path.parent


def find(
    what: Case | str | Path | Mapping[str, Any], out: str | Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None
) -> Place:
    """Find what a user names, in the same way for all commands. Its contents are not read.

    Parameters
    ----------
    what
        A run or a sweep: its directory, or its name in ``out``; a case (resolved, file or shipped name), whose run
        with the installed engine is looked up; a sweep file; anything else of `RECORDS`, a zip file or a folder.
    out
        Folder of the run directories.
    changes
        Values that replace those of the case, or of the case of the run, by dotted keys: finds the run with these.

    Raises
    ------
    InputError
        If it does not exist.
    runner.EngineFailure
        If a case is given and no engine is installed.
    """
    if not changes and isinstance(what, (str, Path)) and (there := placed(what, Path(out))):
        return there
    case, folder = case_at(what, out, changes)
    place = run_place(case, find_engine(), folder)
    if is_finished(place) or _is_begun(place):
        return Place(place, "run", case)
    name = what if isinstance(what, (str, Path)) else case.name
    settings = [f"--set {shlex.quote(f'{key}={value}')}" for key, value in (changes or {}).items()]
    raise refused(name, f"no finished run in {folder}; first do: walkers run {' '.join([str(name), *settings])}")


# --- checking ---------------------------------------------------------------------------------------------------------


class IncompleteRunWarning(UserWarning):
    """The dump of a finished run is shorter than its layout: it was truncated later."""


def check_run(directory: Path, *, dumps: bool = True) -> None:
    """Refuse an unreadable finished run; recompute its tables if necessary."""
    from walkers.postprocess.analysis import current_result

    readers: dict[str, Callable[[Path], object]] = {
        "manifest": read_manifest,
        "case": case_of,
        "layout": lambda run: layout_of(segment_directories(run)[0]),
    }
    for name, read in readers.items():
        with _refusing_damage(directory, f"the run's {name}.json cannot be read"):
            read(directory)
    if dumps:
        _check_dumps(directory)
    with _refusing_damage(directory, "the run cannot be read"):
        current_result(directory)


@contextmanager
def _refusing_damage(directory: Path, message: str) -> Iterator[None]:
    """Turn the errors of a damaged file into one `InputError`."""
    try:
        yield
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError, WalkersError) as error:
        raise refused(directory, f"{message} ({error})") from error


def _check_dumps(run: Path) -> None:
    """Refuse a run without a dump, unless an archive left it out; warn if the dump is cut."""
    left_out, segments = read_manifest(run).get("left_out", ()), segment_directories(run)  # of an archive
    for segment in segments:
        layout = layout_of(segment)
        dump = segment / layout.bead_dump
        if dump.relative_to(run).as_posix() in left_out:
            continue
        if not dump.is_file():
            raise refused(run, f"the run's {layout.bead_dump} is missing")
        if len(segments) == 1 and dump.stat().st_size < layout.bead_dump_bytes:
            text = f"{dump} is incomplete: what is drawn or written ends early"
            warnings.warn(text, IncompleteRunWarning, stacklevel=5)
