"""Run cases and sweeps, and find their results: the commands as Python functions."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers import DEFAULT_OUT
from walkers.errors import InputError, Problem, check_utf8, refused
from walkers.finding import NOT_A_RUN, Place, case_at, check_run, find, placed
from walkers.handles import Run, Sweep
from walkers.progress import progress_of, progress_of_sweep, shown_if
from walkers.runner.binary import find_engine
from walkers.runner.directory import is_finished, run_place, unfinished
from walkers.runner.failures import EngineMissing, RunBusy

if TYPE_CHECKING:
    from walkers.inputs.case import Case
    from walkers.runner.launch import Progress
    from walkers.sweeps.comparison import Side


# --- making -----------------------------------------------------------------------------------------------------------


def run(
    case: Case | str | Path,
    out: str | Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    progress: Callable[[Progress], None] | bool | None = None,
    time_limit: float | None = None,
    allow_failed_audit: bool = False,
) -> Run:
    """Run a case unless a finished run exists. An interrupted run continues.

    Parameters
    ----------
    case
        A resolved case, a case file, the name of a shipped case, or a run, by its name or directory.
    out
        Folder of the run directories.
    engine
        Name or path of the binary; see `walkers.runner.binary.find_engine`.
    force
        Run again. The old run is replaced when the new one is finished.
    progress
        Show the progress; None: only in notebooks. Or a function that is called with it a few times per second.
    time_limit
        Limit of the wall time in s for each segment of the run.
    allow_failed_audit
        Use an engine that failed ``walkers check engine``.

    Raises
    ------
    InputError
        If the case cannot be used.
    runner.EngineFailure
        If the engine fails.

    Examples
    --------
    >>> import walkers
    >>> one = walkers.run("fig1b", tmp)
    >>> round(1e3 * one.result["velocity"]["mean"], 3)  # mm/s
    1.08
    >>> one.walkers[["facing", "steady"]].drop_duplicates("facing").to_dict("list")
    {'facing': [1, -1], 'steady': [True, True]}
    """
    from walkers.inputs.run import limits_of
    from walkers.sweeps.making import check_audit, make_runs

    out = Path(out)
    if not force and (there := finished_at(case, out)):
        return there
    case, out = case_at(case, out)
    for one in (out.absolute(), case.name):
        check_utf8(one)
    if exceeded := [] if case.run.allow_unstable else limits_of(case).exceeded_by(case.run.time_step):
        message = f"beyond the {' and the '.join(exceeded)} limit of the case as changed: use case.changed(changes)"
        raise InputError(case.name, [Problem("run.time_step", f"{case.run.time_step:.3g} s", message)])
    if not isclose(case.run.period * case.excitation.frequency, 1.0, rel_tol=1e-9):
        message = f"time step and sampling are of {1.0 / case.run.period:g} Hz: use case.changed(changes)"
        raise InputError(case.name, [Problem("drive.frequency", f"{case.excitation.frequency:g} Hz", message)])
    binary = find_engine(engine)
    place = run_place(case, binary, out)
    if is_finished(place) and not force:
        check_run(place, dumps=False)
        return Run(place, origins=case.origins)
    check_audit(binary, allow_failed_audit)
    # Numpy and pyarrow are loaded while the engine works and the interpreter is idle.
    threading.Thread(target=_load_postprocess, daemon=True).start()
    watch = nullcontext(progress) if callable(progress) else shown_if(progress, progress_of(case.name))
    with watch as advance:
        made = make_runs([case], out, binary, force=force, on_progress=advance, time_limit=time_limit)
    if made.busy:
        raise RunBusy("another process is still running this case", unfinished(place))
    return Run(made.runs[place.name], cached=place.name in made.found, origins=case.origins)


def _load_postprocess() -> None:
    import pyarrow.parquet  # noqa: F401

    import walkers.postprocess.analyses.walking  # noqa: F401


def sweep(
    sweep: str | Path | Mapping[str, Any],
    out: str | Path = DEFAULT_OUT,
    *,
    jobs: int | None = None,
    changes: Mapping[str, Any] | None = None,
    progress: bool | None = None,
) -> Sweep:
    """Run the missing points of a sweep on this machine.

    Parameters
    ----------
    sweep
        A sweep file, the name of a shipped sweep, or the tables of a sweep file.
    out
        Folder of the run directories.
    jobs
        Number of parallel decks; default: one per core.
    changes
        Values that replace those in ``[set]``, by dotted keys.
    progress
        Show the progress; None: only in notebooks.

    Returns
    -------
    Sweep
        The column ``status`` of its table marks failed points.

    Raises
    ------
    InputError
        If the sweep or one of its points cannot be used.

    Examples
    --------
    >>> walkers.sweep("fig4", tmp).table()[["liquid.name", "status"]].to_dict("list")
    {'liquid.name': ['Si AK5', 'Si AK10'], 'status': ['finished', 'finished']}
    """
    from walkers.inputs.sweep import load_sweep
    from walkers.runner.launch import cores_here
    from walkers.sweeps.scheduler import Options, run_sweep

    read = load_sweep(sweep, changes)
    with shown_if(progress, progress_of_sweep(read.name)) as advance:
        record, _ = run_sweep(read, Path(out), Options(jobs or cores_here()), on_progress=advance)
    return Sweep(record.directory)


# --- finding ----------------------------------------------------------------------------------------------------------


def load(
    what: Case | str | Path | Mapping[str, Any], out: str | Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None
) -> Run | Sweep:
    """Find a sweep, or a run, finished or not.

    Parameters
    ----------
    what
        The directory of a run or a sweep, its name in ``out``, or a case (resolved, file or shipped name). The run of a
        case is the one with the installed engine.
    out
        Folder of the run directories.
    changes
        Values that replace those of the case, by dotted keys.

    Raises
    ------
    InputError
        If it does not exist or cannot be read.
    runner.EngineFailure
        If a case is given and no engine is installed.

    Examples
    --------
    >>> walkers.run("fig1b", tmp).directory == walkers.load("fig1b", tmp).directory
    True
    """
    place = find(what, out, changes)
    return Sweep(place.path) if place.kind == "sweep" else run_at(place, str(what))


def load_finished(
    what: Case | str | Path | Mapping[str, Any], out: str | Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None
) -> Run | Sweep:
    """Find a sweep or a finished run; otherwise `InputError`."""
    found = load(what, out, changes)
    return found if isinstance(found, Sweep) else replace(found, directory=found.finished_directory)


def load_run(
    what: Case | str | Path | Mapping[str, Any], out: str | Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None
) -> Run:
    """Find a finished run; otherwise `InputError`."""
    found = load_finished(what, out, changes)
    if isinstance(found, Sweep):
        raise refused(what, NOT_A_RUN["sweep"])
    return found


def load_sweep(what: str | Path, out: str | Path = DEFAULT_OUT) -> Sweep:
    """Find a sweep; otherwise `InputError`."""
    if there := placed(what, Path(out)):
        if there.kind == "run":
            raise refused(what, f"is a run: walkers run {what} prints its result")
        if there.kind == "folder":
            raise refused(what, f"not a sweep: expected a folder with a sweep.json (walkers list --out {what}?)")
        return Sweep(there.path)
    raise refused(what, f"no sweep in {out}; walkers list shows what is there")


def finished_at(what: Case | str | Path | Mapping[str, Any], out: Path = DEFAULT_OUT) -> Run | None:
    """The finished run with a name or a directory; None for a case."""
    there = placed(what, out) if isinstance(what, (str, Path)) else None
    return run_at(there, str(what)) if there and there.kind == "run" and is_finished(there.path) else None


def run_at(place: Place, name: str) -> Run:
    """The run at a place with the user's name for it; `InputError` if it is no run, or finished and unreadable."""
    if place.kind != "run":
        raise refused(name, NOT_A_RUN[place.kind])
    if is_finished(place.path):
        check_run(place.path)
    return Run(place.path, origins=None if place.case is None else place.case.origins)


def find_side(what: str | Path, out: Path = DEFAULT_OUT, changes: Mapping[str, Any] | None = None) -> Side:
    """One side of a comparison: a run, finished or not, or a case with its run if it exists."""
    from walkers.sweeps.comparison import Side

    case, folder = case_at(what, out, changes)
    there, directory = None if changes else placed(what, out), None
    if there and there.kind == "run":
        directory = there.path
    else:
        with suppress(EngineMissing):
            directory = run_place(case, find_engine(), folder)
    name = directory.name if directory and there and there.kind == "run" else str(what)
    name = " ".join([name, *(f"{key}={value}" for key, value in (changes or {}).items())])
    return Side(name, case, directory if directory and is_finished(directory) else None)
