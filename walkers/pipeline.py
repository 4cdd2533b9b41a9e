"""A case from file to result: what the commands do, for use from Python."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem, WalkersError

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case
    from walkers.inputs.origins import Origin
    from walkers.postprocess.motion import Motion
    from walkers.runner.launch import Progress

DEFAULT_OUT = Path("runs")


@dataclass(frozen=True)
class Run:
    """A finished run: what it was made of and what it gave.

    Attributes
    ----------
    directory
        The run directory.
    cached
        Whether it was there before.
    origins
        Where the values of the case come from by which it was asked for; None: of that by which it was made. The same
        numbers may once have been given and once be the library's.
    """

    directory: Path
    cached: bool = True
    origins: tuple[Origin, ...] | None = None

    @property
    def case(self) -> Case:
        """The resolved case."""
        from walkers.runner.directory import case_of

        return case_of(self.directory)

    @property
    def result(self) -> dict[str, Any]:
        """The result, SI units."""
        from walkers.postprocess.analysis import current_result, rests_on

        result = current_result(self.directory)
        return result if self.origins is None else {**result, "rests_on": rests_on(self.origins)}

    @property
    def motion(self) -> Motion:
        """Places, velocities and spins of all beads, as arrays."""
        from walkers.postprocess.motion import read_motion

        return read_motion(self.directory)

    @property
    def trajectory(self) -> pd.DataFrame:
        """One row per sample and walker, SI units."""
        return self.table("trajectory")

    @property
    def walkers(self) -> pd.DataFrame:
        """One row per walker, SI units."""
        return self.table("walkers")

    def table(self, name: str) -> pd.DataFrame:
        """A table of the run, see `walkers.postprocess.read_table`."""
        from walkers.postprocess.tables import read_table

        return read_table(self.directory, name)

    def describe(self) -> str:
        """The result in a few lines: mm, mm/s, degrees."""
        from walkers.postprocess.analysis import describe_result

        return describe_result(self.directory, self.result, cached=self.cached)

    def plot(self, to: Path | None = None) -> list[Path]:
        """Draw its figures, see `walkers.postprocess.analysis.plot_run`."""
        from walkers.postprocess.analysis import plot_run

        return plot_run(self.directory, to)

    def vtk(self, to: Path | None = None, **options: Any) -> Path:
        """Write it for ParaView, see `walkers.postprocess.paraview.write_vtk`."""
        from walkers.postprocess.paraview import write_vtk

        return write_vtk(self.directory, destination=to, **options)

    def archive(self, to: Path | None = None, **options: Any) -> Path:
        """Pack it into an RO-Crate, see `walkers.archive.writing.write_archive` and its `ArchiveOptions`."""
        from walkers.archive.writing import ArchiveOptions, write_archive

        return write_archive(self.directory, to, ArchiveOptions(**options))

    def render(self, to: Path | None = None, *, images: int = 6) -> list[Path]:
        """Render pictures of it, see `walkers.postprocess.pictures.render_run`."""
        from walkers.postprocess.pictures import render_run

        return render_run(self.directory, to, images=images)


def run(
    case: Case | str | Path,
    out: Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    time_limit: float | None = None,
    allow_failed_audit: bool = False,
) -> Run:
    """Run a case, unless its run is there already, and tabulate it; an interrupted run goes on.

    Parameters
    ----------
    case
        A resolved case, a case file, or the name of a shipped one.
    out
        Folder of the run directories.
    engine
        Name or path of the binary; see `walkers.runner.find_engine`.
    force
        Run again; the old run is replaced only by a finished one.
    on_progress
        Called a few times a second while the engine runs.
    time_limit
        Wall time in s that the engine may take, for each segment of the run.
    allow_failed_audit
        Run on an engine that failed its audit.

    Raises
    ------
    InputError
        If a case cannot be used.
    runner.EngineFailure
        If the engine fails in one of the known ways.

    Examples
    --------
    >>> import walkers
    >>> one = walkers.run("fig1b", tmp)
    >>> round(1e3 * one.result["velocity"]["mean"], 3)  # mm/s
    1.382
    >>> one.walkers[["facing", "steady"]].drop_duplicates("facing").to_dict("list")
    {'facing': [1, -1], 'steady': [True, True]}
    """
    from walkers.inputs.reading import load_case
    from walkers.postprocess.analysis import current_result
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import run_place, unfinished
    from walkers.runner.ensemble import finished_place
    from walkers.runner.failures import RunBusy
    from walkers.sweeps.shared_deck import check_audit, make_runs

    case = load_case(case) if isinstance(case, (str, Path)) else case
    binary = find_engine(engine)
    place = run_place(case, binary, out)
    there = finished_place(out, place.name)
    if there is not None and not force:
        current_result(there)
        return Run(there, origins=case.origins)
    check_audit(binary, allow_failed_audit)
    # Numpy and pyarrow are loaded while the engine works; nothing else is waiting for the interpreter then.
    threading.Thread(target=_load_postprocess, daemon=True).start()
    made = make_runs([case], out, binary, force=force, on_progress=on_progress, time_limit=time_limit)
    if made.busy:
        raise RunBusy(unfinished(place))
    return Run(made.runs[place.name].directory, cached=place.name in made.found, origins=case.origins)


def _load_postprocess() -> None:
    import pyarrow.parquet  # noqa: F401

    import walkers.postprocess.walking  # noqa: F401


def find_run(run: Case | str | Path, out: Path = DEFAULT_OUT) -> Run:
    """Find a finished run.

    Parameters
    ----------
    run
        A run directory; or a case (resolved, file or shipped name), whose run with the installed engine is looked up in
        ``out``.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    runner.EngineFailure
        If a case is given and there is no engine to look it up for.
    """
    from walkers.inputs.reading import load_case
    from walkers.runner.directory import finished_run

    if isinstance(run, (str, Path)) and Path(run).is_dir():
        if finished_run(Path(run)) is None:
            told = "not a finished run: expected a folder with a manifest.json"
            raise InputError(str(run), [Problem("", None, told)])
        return _readable(Path(run))
    case = load_case(run) if isinstance(run, (str, Path)) else run
    return replace(_readable(_place_of(case, out, run)), origins=case.origins)


def place_of(run: str | Path, out: Path = DEFAULT_OUT, *, archives: bool = False) -> Path:
    """Where something is: a directory as it is, for a case that of its finished run with the installed engine.

    Nothing in it is read or made anew.

    Parameters
    ----------
    run, out
        As for `find_run`.
    archives
        Take a zip file for what it is, not for a case.

    Raises
    ------
    InputError
        If a case is given and has no finished run.
    """
    path = Path(run)
    if path.is_dir() or (archives and path.suffix == ".zip" and path.is_file()):
        return path
    from walkers.inputs.reading import load_case

    return _place_of(load_case(path), out, run)


def _place_of(case: Case, out: Path, called: Case | str | Path) -> Path:
    """The finished run of a case, which messages call as it was asked for."""
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import run_place
    from walkers.runner.ensemble import finished_place

    there = finished_place(out, run_place(case, find_engine(), out).name)
    if there is None:
        name = called if isinstance(called, (str, Path)) else case.name
        raise InputError(str(name), [Problem("", None, f"no finished run in {out}; first do: walkers run {name}")])
    return there


def _readable(directory: Path) -> Run:
    """The run, if its description can be read; its tables are made anew if need be."""
    from walkers.postprocess.analysis import current_result
    from walkers.runner.directory import FinishedRun, layout_of

    run = FinishedRun(directory)
    for name in ("manifest", "case", "layout"):
        try:
            getattr(run, name)
        except (OSError, ValueError, KeyError, TypeError) as error:
            problem = Problem("", None, f"the run's {name}.json cannot be read ({error})")
            raise InputError(str(directory), [problem]) from error
    left_out = run.manifest.get("left_out", ())  # of an archive
    for segment in run.segments:
        layout = layout_of(segment)
        dump = segment / layout.bead_dump
        if dump.relative_to(directory).as_posix() in left_out:
            continue
        if not dump.is_file():
            raise InputError(str(directory), [Problem("", None, f"the run's {layout.bead_dump} is missing")])
        if len(run.segments) == 1 and dump.stat().st_size < layout.bead_dump_bytes:
            told = f"{dump} is incomplete: what is drawn or written ends early"
            warnings.warn(told, IncompleteRunWarning, stacklevel=3)
    try:
        current_result(directory)
    except (OSError, ValueError, KeyError, TypeError, WalkersError) as error:
        raise InputError(str(directory), [Problem("", None, f"the run cannot be read ({error})")]) from error
    return Run(directory)


class IncompleteRunWarning(UserWarning):
    """The dump of a finished run is shorter than its layout says: somebody cut it since."""
