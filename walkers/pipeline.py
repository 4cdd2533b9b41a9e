"""A case from file to result, and runs and sweeps found again: what the commands do, for use from Python."""

from __future__ import annotations

import base64
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers import DEFAULT_OUT, RECORDS
from walkers.inputs.errors import InputError, Problem, WalkersError, check_utf8, refused
from walkers.inputs.reading import load_case, shipped_cases
from walkers.progress import progress_of, progress_of_sweep, shown_if
from walkers.runner.binary import find_engine
from walkers.runner.directory import (
    CASE_NAME,
    FinishedRun,
    case_of,
    finished_run,
    layout_of,
    run_place,
    unfinished,
)
from walkers.runner.failures import EngineMissing, RunBusy

if TYPE_CHECKING:
    import k3d
    import pandas as pd

    from walkers.inputs.case import Case
    from walkers.inputs.origins import Origin
    from walkers.postprocess.films import FilmOptions
    from walkers.postprocess.motion import Motion
    from walkers.runner.launch import Progress
    from walkers.sweeps.comparison import Side


class Pictures(list[Path]):
    """Paths of pictures; a notebook shows the pictures themselves."""

    def _repr_html_(self) -> str:
        """The PNGs, one below the other; of other files the names."""
        shown = []
        for path in self:
            if path.suffix.lower() == ".png" and path.is_file():
                source = f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
                shown.append(f'<img src="{source}" alt="{escape(path.stem)}" style="max-width:100%">')
            else:
                shown.append(f"<p>{escape(str(path))}</p>")
        return "\n".join(shown)


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
    origins: tuple[Origin, ...] | None = field(default=None, repr=False)

    @property
    def case(self) -> Case:
        """The resolved case."""
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

    def _repr_html_(self) -> str:
        """The result in a notebook: a table with errors and units, warnings, the parameters folded in."""
        from walkers.postprocess.report.run import result_html

        return result_html(self.directory, self.result, self.origins)

    def plot(self, to: Path | None = None, formats: Sequence[str] = ("png",)) -> Pictures:
        """Draw its figures, see `walkers.postprocess.analysis.plot_run`: a list of paths, which a notebook shows."""
        from walkers.postprocess.analysis import plot_run

        return Pictures(plot_run(self.directory, to, formats))

    def render(self, to: Path | None = None, *, images: int = 6) -> Pictures:
        """Render pictures of it, see `walkers.postprocess.series.render_run`: paths, which a notebook shows."""
        from walkers.postprocess.series import render_run

        return Pictures(render_run(self.directory, to, images=images))

    def film(
        self,
        to: Path | None = None,
        options: FilmOptions | None = None,
        *,
        on_progress: Callable[[int, int], None] | None = None,
    ) -> Path:
        """Film it, see `walkers.postprocess.films.render_film`."""
        from walkers.postprocess.films import render_film

        return render_film(self.directory, to, options, on_progress=on_progress)

    def view(self, *, height: int = 480) -> k3d.Plot:
        """Its beads in three dimensions, for a notebook, so many pixels high.

        Examples
        --------
        >>> len(walkers.run("fig1b", tmp).view().objects)  # twelve beads, the floor, the lines on it
        14
        """
        from walkers.postprocess.report.player import player_of

        return player_of(self.directory, height=height).plot

    def report(self, to: Path | None = None) -> Path:
        """Write one HTML file to mail, see `walkers.postprocess.report.run.report_run`."""
        from walkers.postprocess.report.run import report_run

        return report_run(self.directory, to, self.origins)

    def vtk(self, to: Path | None = None, **options: Any) -> Path:
        """Write it for ParaView, see `walkers.postprocess.paraview.write_vtk`."""
        from walkers.postprocess.paraview import write_vtk

        return write_vtk(self.directory, destination=to, **options)

    def paraview(self, to: Path | None = None, **options: Any) -> Path:
        """Write it with a script for ParaView, see `walkers.postprocess.paraview.write_paraview`."""
        from walkers.postprocess.paraview import write_paraview

        return write_paraview(self.directory, to, **options)

    def export(self, to: Path, *, every: int = 1) -> Path:
        """Write its trajectory for other programs, see `walkers.postprocess.trajectory_files.write_trajectory`."""
        from walkers.postprocess.trajectory_files import write_trajectory

        return write_trajectory(self.directory, to, every=every)

    def archive(self, to: Path | None = None, **options: Any) -> Path:
        """Pack it into an RO-Crate, see `walkers.archive.writing.write_archive` and its `ArchiveOptions`."""
        from walkers.archive.writing import ArchiveOptions, write_archive

        return write_archive(self.directory, to, ArchiveOptions(**options))


# --- making -----------------------------------------------------------------------------------------------------------


def run(
    case: Case | str | Path,
    out: Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    progress: Callable[[Progress], None] | bool | None = None,
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
    progress
        Whether to show how far the run is; if None, in notebooks. Or what is called a few times a second meanwhile.
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
    1.08
    >>> one.walkers[["facing", "steady"]].drop_duplicates("facing").to_dict("list")
    {'facing': [1, -1], 'steady': [True, True]}
    """
    from walkers.inputs.run_tables import limits_of
    from walkers.sweeps.making import check_audit, make_runs

    case = load_case(case) if isinstance(case, (str, Path)) else case
    for one in (Path(out).absolute(), case.name):
        check_utf8(one)
    if exceeded := [] if case.as_read else limits_of(case).exceeded_by(case.run.time_step):
        told = f"beyond the {' and the '.join(exceeded)} limit of the case as changed: use load_case(name, changes)"
        raise InputError(case.name, [Problem("run.time_step", f"{case.run.time_step:.3g} s", told)])
    binary = find_engine(engine)
    place = run_place(case, binary, out)
    if finished_run(place) is not None and not force:
        _check(place, dumps=False)
        return Run(place, origins=case.origins)
    check_audit(binary, allow_failed_audit)
    # Numpy and pyarrow are loaded while the engine works; nothing else is waiting for the interpreter then.
    threading.Thread(target=_load_postprocess, daemon=True).start()
    watch = nullcontext(progress) if callable(progress) else shown_if(progress, progress_of(case.name))
    with watch as advance:
        made = make_runs([case], out, binary, force=force, on_progress=advance, time_limit=time_limit)
    if made.busy:
        raise RunBusy(unfinished(place))
    return Run(made.runs[place.name].directory, cached=place.name in made.found, origins=case.origins)


def _load_postprocess() -> None:
    import pyarrow.parquet  # noqa: F401

    import walkers.postprocess.analyses.walking  # noqa: F401


def sweep(
    sweep: str | Path,
    out: Path = DEFAULT_OUT,
    *,
    jobs: int | None = None,
    changes: Mapping[str, Any] | None = None,
    progress: bool | None = None,
) -> pd.DataFrame:
    """Make the runs of a sweep that are missing, on this machine, and give its table.

    Parameters
    ----------
    sweep
        A sweep file, or the name of a shipped sweep.
    out
        Folder of the run directories.
    jobs
        Decks at once; all cores if left out.
    changes
        Values put beside those of its ``[set]``, by dotted keys.
    progress
        Show how far it is; if None, in notebooks.

    Returns
    -------
    DataFrame
        One row per point (`walkers.sweeps.table.load`); points that failed say so in the column ``status``.

    Raises
    ------
    InputError
        If the sweep or one of its points cannot be used.

    Examples
    --------
    >>> walkers.sweep("fig4", tmp)[["liquid.name", "status"]].to_dict("list")
    {'liquid.name': ['Si AK5', 'Si AK10'], 'status': ['finished', 'finished']}
    """
    from walkers.inputs.sweep import load_sweep
    from walkers.sweeps.scheduler import Options, run_sweep
    from walkers.sweeps.site import cores_here
    from walkers.sweeps.table import load

    read = load_sweep(sweep, changes)
    with shown_if(progress, progress_of_sweep(read.name)) as advance:
        record, _ = run_sweep(read, Path(out), Options(jobs or cores_here()), on_progress=advance)
    return load(record.directory)


# --- finding ----------------------------------------------------------------------------------------------------------

_NO_RUN = {
    "folder": "not a finished run: expected a folder with a manifest.json",
    "calibration": "a calibration's outcome: its report is calibration.md",
    "sweep": "a sweep's directory: walkers plot, table and status take it, this takes one of its runs",
    "archive": "an archive: unpack it and give a run or a sweep in it; walkers verify takes it as it is",
}


class Place(NamedTuple):
    """Where something is that a user named; what it is (of `RECORDS`, ``archive`` or ``folder``); by which case."""

    path: Path
    kind: str
    case: Case | None = None


def placed(name: str | Path, out: Path = DEFAULT_OUT) -> Place | None:
    """What there is of a name, as a path or in a folder of runs, but for the runs of cases.

    A folder shadows no shipped case by its name alone. That of a deck that was run by hand is made a run directory.
    """
    from walkers.sweeps.by_hand import is_deck_folder, take_in

    path = Path(name)
    for place in (path, out / path):
        if is_deck_folder(place) and str(name) not in shipped_cases():
            take_in(place)
        for kind, file in RECORDS.items():
            if (place / file).is_file():
                return Place(place, kind)
    if path.suffix == ".zip" and path.is_file():
        return Place(path, "archive")
    return Place(path, "folder") if path.is_dir() and str(name) not in shipped_cases() else None


def _run_of(case: Case, out: Path) -> Path | None:
    """The directory of a case's finished run with the installed engine."""
    place = run_place(case, find_engine(), out)
    return place if finished_run(place) else None


def locate(what: Case | str | Path, out: Path = DEFAULT_OUT) -> Place:
    """Find what a user names, as `find_run` does, or anything else of `RECORDS`, a zip file or a folder.

    Nothing in it is read or made anew but the folder of a deck that was run by hand.
    """
    if isinstance(what, (str, Path)):
        if there := placed(what, out):
            return there
        name, case = str(what), load_case(what)
    else:
        name, case = what.name, what
    if run := _run_of(case, out):
        return Place(run, "run", case)
    raise refused(name, f"no finished run in {out}; first do: walkers run {name}")


def find_run(run: Case | str | Path, out: Path = DEFAULT_OUT) -> Run:
    """Find a finished run.

    Parameters
    ----------
    run
        A run directory, or its name in ``out``; or a case (resolved, file or shipped name), whose run with the
        installed engine is looked up there.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    runner.EngineFailure
        If a case is given and there is no engine to look it up for.
    """
    return run_at(locate(run, out), str(run))


def run_at(place: Place, name: str) -> Run:
    """The run at a place that a user named so; refused as by `find_run` if it is none, or cannot be read."""
    if place.kind != "run":
        raise refused(name, _NO_RUN[place.kind])
    _check(place.path)
    return Run(place.path, origins=None if place.case is None else place.case.origins)


def find_sweep(sweep: str | Path, out: Path = DEFAULT_OUT) -> Path:
    """The directory of a sweep, given itself or its name in a folder of runs; of nothing there the path as it is."""
    there = placed(sweep, out)
    return there.path if there and there.kind == "sweep" else Path(sweep)


def find_side(run: str | Path, out: Path = DEFAULT_OUT) -> Side:
    """A run, which need not be finished, or a case with its run if it has one, to be compared."""
    from walkers.sweeps.comparison import Side

    there = placed(run, out)
    if there and (there.path / CASE_NAME).is_file():
        try:
            return Side(there.path.name, case_of(there.path), there.path if there.kind == "run" else None)
        except (OSError, ValueError) as error:
            raise refused(run, f"its case cannot be read ({error})") from error
    case, directory = load_case(run), None
    with suppress(EngineMissing):
        directory = _run_of(case, out)
    return Side(str(run), case, directory)


def report(what: str | Path, to: Path | None = None, out: Path = DEFAULT_OUT) -> Path:
    """Write the report of a run or a sweep: one HTML file that needs no network.

    Parameters
    ----------
    what
        The directory of one of them, or its name in ``out``; or a case, whose run is looked up there.
    to
        The file; ``report.html`` in that directory if None.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is no such thing, or the name is none of an HTML file.

    Examples
    --------
    >>> walkers.report(walkers.run("fig1b", tmp).directory, tmp / "fig1b.html").name
    'fig1b.html'
    """
    from walkers.postprocess.report.page import check_report
    from walkers.sweeps.report import report_sweep

    if to is not None:
        check_report(to)
    place = locate(what, out)
    if place.kind == "sweep":
        return report_sweep(place.path, to)
    return run_at(place, str(what)).report(to)


# --- checking ---------------------------------------------------------------------------------------------------------


class IncompleteRunWarning(UserWarning):
    """The dump of a finished run is shorter than its layout says: somebody cut it since."""


def _check(directory: Path, *, dumps: bool = True) -> None:
    """Refuse a finished run that cannot be read; its tables are made anew if need be."""
    from walkers.postprocess.analysis import current_result

    run = FinishedRun(directory)
    for name in ("manifest", "case", "layout"):
        with _told(directory, f"the run's {name}.json cannot be read"):
            getattr(run, name)
    if dumps:
        _check_dumps(run)
    with _told(directory, "the run cannot be read"):
        current_result(directory)


@contextmanager
def _told(directory: Path, message: str) -> Iterator[None]:
    """Turn what a damaged file leads to into one message of bad input."""
    try:
        yield
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError, WalkersError) as error:
        raise refused(directory, f"{message} ({error})") from error


def _check_dumps(run: FinishedRun) -> None:
    """Refuse a run without a dump that no archive left out; warn of one that was cut."""
    left_out = run.manifest.get("left_out", ())  # of an archive
    for segment in run.segments:
        layout = layout_of(segment)
        dump = segment / layout.bead_dump
        if dump.relative_to(run.directory).as_posix() in left_out:
            continue
        if not dump.is_file():
            raise refused(run.directory, f"the run's {layout.bead_dump} is missing")
        if len(run.segments) == 1 and dump.stat().st_size < layout.bead_dump_bytes:
            told = f"{dump} is incomplete: what is drawn or written ends early"
            warnings.warn(told, IncompleteRunWarning, stacklevel=5)
