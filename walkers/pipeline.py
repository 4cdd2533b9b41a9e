"""A case from file to result: what the commands do, for use from Python."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem, WalkersError

if TYPE_CHECKING:
    from walkers.inputs.case import WalkerCase
    from walkers.inputs.pile import PileCase
    from walkers.inputs.reading import AnyCase
    from walkers.runner.binary import Engine
    from walkers.runner.directory import FinishedRun

DEFAULT_OUT = Path("runs")


@dataclass(frozen=True)
class Outcome:
    """A finished run, its result (SI units), and whether it was there before."""

    run: FinishedRun
    result: dict[str, Any]
    cached: bool


def run_case(
    case: AnyCase,
    out: Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    on_progress: Callable[[Any], None] | None = None,
    time_limit: float | None = None,
    allow_failed_audit: bool = False,
) -> Outcome:
    """Run a case, unless its run is there already, and tabulate it; an interrupted pile goes on.

    Parameters
    ----------
    case
        A resolved case: of walkers (`walkers.inputs.load_case`) or of a pile (`walkers.inputs.load_pile`).
    out
        Folder of the run directories.
    engine
        Name or path of the binary; see `walkers.runner.find_engine`.
    force
        Run again; the old run is replaced only by a finished one.
    on_progress
        Called a few times a second while the engine runs, with a `walkers.runner.launch.Progress`, of a pile with a
        `walkers.runner.segments.PileProgress`.
    time_limit
        Wall time in s that the engine may take, of a pile for each segment.
    allow_failed_audit
        Run on an engine that failed its audit.

    Returns
    -------
    Outcome

    Raises
    ------
    runner.EngineFailure
        If the engine fails in one of the known ways.
    """
    from walkers.inputs.pile import PileCase
    from walkers.runner.binary import find_engine

    options = {"force": force, "on_progress": on_progress, "time_limit": time_limit}
    if isinstance(case, PileCase):
        return _run_pile(case, out, find_engine(engine), allow_failed_audit, options)
    return _run_walkers(case, out, find_engine(engine), allow_failed_audit, options)


def _run_walkers(
    case: WalkerCase, out: Path, engine: Engine, allow_failed_audit: bool, options: dict[str, Any]
) -> Outcome:
    from walkers.runner.directory import finished_run, run_place, unfinished
    from walkers.runner.ensemble import finished_place
    from walkers.runner.failures import RunBusy
    from walkers.sweeps.shared_deck import check_audit, make_together

    place = run_place(case, engine, out)
    there = finished_place(out, place.name)
    old = finished_run(there) if there and not options["force"] else None
    if old is not None:
        return Outcome(old, _result_of(old), cached=True)
    check_audit(engine, allow_failed_audit)
    # Numpy and pyarrow are loaded while the engine works; nothing else is waiting for the interpreter then.
    threading.Thread(target=_load_postprocess, daemon=True).start()
    made = make_together([case], out, engine, **options)
    if made.busy:
        raise RunBusy(unfinished(place))
    run = made.runs[place.name]
    return Outcome(run, _result_of(run), cached=place.name in made.found)


def _run_pile(case: PileCase, out: Path, engine: Engine, allow_failed_audit: bool, options: dict[str, Any]) -> Outcome:
    from walkers.postprocess.pile_result import current_pile_result
    from walkers.runner.directory import finished_run, run_place
    from walkers.runner.segments import run_pile
    from walkers.sweeps.shared_deck import check_audit

    if options["force"] or finished_run(run_place(case, engine, out)) is None:
        check_audit(engine, allow_failed_audit)
    run, found = run_pile(case, engine, out, **options)
    return Outcome(run, current_pile_result(run.directory), found)


def _load_postprocess() -> None:
    import pyarrow.parquet  # noqa: F401

    import walkers.postprocess.result  # noqa: F401


def _result_of(run: FinishedRun) -> dict[str, Any]:
    from walkers.postprocess.result import current_result

    return current_result(run.directory)


def find_run(run: str | Path, out: Path = DEFAULT_OUT) -> FinishedRun:
    """Find a finished run of a walker, a climber or a pile.

    Parameters
    ----------
    run
        A run directory; or a case (file or shipped name), whose run with the installed engine is looked up in ``out``.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is none, or its manifest, case or layout cannot be read.
    runner.EngineFailure
        If a case is given and there is no engine to look it up for.
    """
    from walkers.runner.directory import finished_run
    from walkers.runner.segments import is_pile

    path = Path(run)
    if path.is_dir():
        found = finished_run(path)
        if found is None:
            raise InputError(
                str(run), [Problem("", None, "not a finished run: expected a folder with a manifest.json")]
            )
    else:
        there = _place_of(path, out)
        found = finished_run(there) if there else None
        if found is None:
            raise InputError(str(run), [Problem("", None, f"no finished run in {out}; first do: walkers run {run}")])
    return _readable_pile(found) if is_pile(found.directory) else _readable(found)


def _place_of(case: Path, out: Path) -> Path | None:
    from walkers.inputs.reading import load_any
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import run_place
    from walkers.runner.ensemble import finished_place

    return finished_place(out, run_place(load_any(case), find_engine(), out).name)


def described(directory: Path, result: dict[str, Any], *, cached: bool = False) -> str:
    """A result as text, whatever it is of."""
    if result.get("kind") == "pile":
        from walkers.postprocess.pile_result import describe_pile

        return describe_pile(directory, result, cached=cached)
    from walkers.postprocess.report import describe_result

    return describe_result(directory, result, cached=cached)


def _readable_pile(run: FinishedRun) -> FinishedRun:
    """A pile's run, if its description can be read; its tables are made anew if need be."""
    from walkers.postprocess.pile_result import current_pile_result

    try:
        current_pile_result(run.directory)
    except (OSError, ValueError, KeyError, TypeError, WalkersError) as error:
        raise InputError(str(run.directory), [Problem("", None, f"the run cannot be read ({error})")]) from error
    return run


def _readable(run: FinishedRun) -> FinishedRun:
    """The run, if its description can be read; its tables are made anew if need be."""
    for name in ("manifest", "case", "layout"):
        try:
            getattr(run, name)
        except (OSError, ValueError, KeyError, TypeError) as error:
            problem = Problem("", None, f"the run's {name}.json cannot be read ({error})")
            raise InputError(str(run.directory), [problem]) from error
    layout = run.layout
    dump = run.directory / layout.bead_dump
    if not dump.is_file():
        raise InputError(str(run.directory), [Problem("", None, f"the run's {layout.bead_dump} is missing")])
    if dump.stat().st_size < layout.bead_dump_bytes:
        warnings.warn(f"{dump} is incomplete: what is drawn or written ends early", IncompleteRunWarning, stacklevel=3)
    _result_of(run)
    return run


class IncompleteRunWarning(UserWarning):
    """The dump of a finished run is shorter than its layout says: somebody cut it since."""
