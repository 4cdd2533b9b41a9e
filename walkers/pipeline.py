"""A case from file to result: what the commands do, for use from Python."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from walkers.inputs.errors import InputError, Problem, WalkersError, check_utf8
from walkers.notebook import Pictures

if TYPE_CHECKING:
    import k3d
    import pandas as pd

    from walkers.inputs.case import Case
    from walkers.inputs.origins import Origin
    from walkers.postprocess.films import FilmOptions
    from walkers.postprocess.motion import Motion
    from walkers.runner.directory import FinishedRun
    from walkers.runner.launch import Progress
    from walkers.sweeps.comparison import Side

Kind = Literal["run", "sweep", "calibration", "archive", "folder"]
DEFAULT_OUT = Path("runs")
RECORDS: dict[Kind, str] = {"run": "manifest.json", "sweep": "sweep.json", "calibration": "calibration.json"}
"""Files by which directories are known, without the imports of those that write them."""


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

    def _repr_html_(self) -> str:
        """The result in a notebook: a table with errors and units, warnings, the parameters folded in."""
        from walkers.postprocess.report.run import result_html

        return result_html(self.directory, self.result, self.origins)

    def plot(self, to: Path | None = None, formats: Sequence[str] = ("png",)) -> Pictures:
        """Draw its figures, see `walkers.postprocess.analysis.plot_run`: a list of paths, which a notebook shows."""
        from walkers.postprocess.analysis import plot_run

        return Pictures(plot_run(self.directory, to, formats))

    def view(self, *, height: int = 480) -> k3d.Plot:
        """Its beads in three dimensions, for a notebook; see `walkers.postprocess.report.player.player_of`.

        Parameters
        ----------
        height
            Pixels.

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

    def archive(self, to: Path | None = None, **options: Any) -> Path:
        """Pack it into an RO-Crate, see `walkers.archive.writing.write_archive` and its `ArchiveOptions`."""
        from walkers.archive.writing import ArchiveOptions, write_archive

        return write_archive(self.directory, to, ArchiveOptions(**options))

    def paraview(self, to: Path | None = None, **options: Any) -> Path:
        """Write it with a script for ParaView, see `walkers.postprocess.paraview.write_paraview`."""
        from walkers.postprocess.paraview import write_paraview

        return write_paraview(self.directory, to, **options)

    def export(self, to: Path, *, every: int = 1) -> Path:
        """Write its trajectory for other programs, see `walkers.postprocess.trajectory_files.write_trajectory`."""
        from walkers.postprocess.trajectory_files import write_trajectory

        return write_trajectory(self.directory, to, every=every)

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

    def render(self, to: Path | None = None, *, images: int = 6) -> Pictures:
        """Render pictures of it, see `walkers.postprocess.series.render_run`: paths, which a notebook shows."""
        from walkers.postprocess.series import render_run

        return Pictures(render_run(self.directory, to, images=images))


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
    from walkers.inputs.reading import load_case
    from walkers.progress import progress_of, shown_if
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import finished_run, run_place, unfinished
    from walkers.runner.failures import RunBusy
    from walkers.sweeps.shared_deck import check_audit, make_runs

    case = load_case(case) if isinstance(case, (str, Path)) else case
    for one in (Path(out).absolute(), case.name):
        check_utf8(one)
    _check_changed(case)
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


def _check_changed(case: Case) -> None:
    """Refuse a case that was changed after it was read and whose time step no longer suits it."""
    from walkers.inputs.run_tables import limits_of

    exceeded = [] if case.as_read else limits_of(case).exceeded_by(case.run.time_step)
    if exceeded:
        told = f"beyond the {' and the '.join(exceeded)} limit of the case as changed: use load_case(name, changes)"
        raise InputError(case.name, [Problem("run.time_step", f"{case.run.time_step:.3g} s", told)])


def _load_postprocess() -> None:
    import pyarrow.parquet  # noqa: F401

    import walkers.postprocess.walking  # noqa: F401


_NO_RUN = {
    "folder": "not a finished run: expected a folder with a manifest.json",
    "calibration": "a calibration's outcome: walkers report takes it",
    "sweep": "a sweep's directory: walkers plot, table and status take it, this takes one of its runs",
    "archive": "an archive: unpack it and give a run or a sweep in it; walkers verify takes it as it is",
}


@dataclass(frozen=True)
class Place:
    """Where something is that a user named, what it is, and the case by which it was found, if it was by one."""

    path: Path
    kind: Kind
    case: Case | None = None


def locate(what: Case | str | Path, out: Path = DEFAULT_OUT) -> Place:
    """Find what a user names; nothing in it is read or made anew.

    Parameters
    ----------
    what
        A directory, or its name in ``out``; a zip file; or a case (resolved, file or shipped name), whose finished run
        with the installed engine is looked up there.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is no such thing, or a case has no finished run.
    runner.EngineFailure
        If a case is given and there is no engine to look its run up for.
    """
    from walkers.inputs.reading import load_case

    if isinstance(what, (str, Path)):
        if (there := _placed(what, out)) is not None:
            return there
        case = load_case(what)
    else:
        case = what
    run = _run_of(case, out)
    if run is None:
        name = what if isinstance(what, (str, Path)) else case.name
        raise InputError(str(name), [Problem("", None, f"no finished run in {out}; first do: walkers run {name}")])
    return Place(run, "run", case)


def _placed(name: str | Path, out: Path) -> Place | None:
    """What there is of a name, but for the runs of cases: a folder shadows no shipped case by its name alone."""
    from walkers.inputs.reading import shipped_cases

    path = Path(name)
    for place in (path, out / path):
        for kind, file in RECORDS.items():
            if (place / file).is_file():
                return Place(place, kind)
    if path.suffix == ".zip" and path.is_file():
        return Place(path, "archive")
    return Place(path, "folder") if path.is_dir() and str(name) not in shipped_cases() else None


def find_run(run: Case | str | Path, out: Path = DEFAULT_OUT) -> Run:
    """Find a finished run.

    Parameters
    ----------
    run
        A run directory, or its name in ``out``; or a case (resolved, file or shipped name),
        whose run with the installed engine is looked up there.
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    runner.EngineFailure
        If a case is given and there is no engine to look it up for.
    """
    place = locate(run, out)
    if place.kind != "run":
        raise InputError(str(run), [Problem("", None, _NO_RUN[place.kind])])
    _check(place.path)
    return Run(place.path, origins=None if place.case is None else place.case.origins)


def find_side(run: str | Path, out: Path = DEFAULT_OUT) -> Side:
    """A run, or a case with its run if it has one, for `walkers.sweeps.comparison.compare_runs`.

    Parameters
    ----------
    run
        A run directory, also of a run that is not finished; its name in ``out``; or a case (file or shipped name).
    out
        Folder of the run directories.

    Raises
    ------
    InputError
        If it is none of them.
    """
    from walkers.inputs.reading import load_case
    from walkers.runner.directory import CASE_NAME, case_of, finished_run
    from walkers.runner.failures import EngineMissing
    from walkers.sweeps.comparison import Side

    directory = Path(run) if (Path(run) / CASE_NAME).is_file() else _named(run, out)
    if directory is not None:
        try:
            return Side(directory.name, case_of(directory), directory if finished_run(directory) else None)
        except (OSError, ValueError) as error:
            raise InputError(str(run), [Problem("", None, f"its case cannot be read ({error})")]) from error
    case, there = load_case(run), None
    with suppress(EngineMissing):
        there = _run_of(case, out)
    return Side(str(run), case, there)


def find_sweep(sweep: str | Path, out: Path = DEFAULT_OUT) -> Path | None:
    """The directory of a sweep, given itself or its name in the folder ``out``; None if there is none."""
    return next((path for path in (Path(sweep), out / sweep) if (path / RECORDS["sweep"]).is_file()), None)


def _named(run: str | Path, out: Path) -> Path | None:
    """The directory of the finished run of this name in a folder."""
    from walkers.runner.directory import finished_run

    return out / run if Path(run).name == str(run) and finished_run(out / run) else None


def _run_of(case: Case, out: Path) -> Path | None:
    """The directory of a case's finished run with the installed engine."""
    from walkers.runner.binary import find_engine
    from walkers.runner.directory import run_name

    return _named(run_name(case, find_engine()), out)


def _check(directory: Path, *, dumps: bool = True) -> None:
    """Refuse a finished run that cannot be read; its tables are made anew if need be."""
    from walkers.postprocess.analysis import current_result
    from walkers.runner.directory import FinishedRun

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
        raise InputError(str(directory), [Problem("", None, f"{message} ({error})")]) from error


def _check_dumps(run: FinishedRun) -> None:
    """Refuse a run without a dump that no archive left out; warn of one that was cut."""
    from walkers.runner.directory import layout_of

    left_out = run.manifest.get("left_out", ())  # of an archive
    for segment in run.segments:
        layout = layout_of(segment)
        dump = segment / layout.bead_dump
        if dump.relative_to(run.directory).as_posix() in left_out:
            continue
        if not dump.is_file():
            raise InputError(str(run.directory), [Problem("", None, f"the run's {layout.bead_dump} is missing")])
        if len(run.segments) == 1 and dump.stat().st_size < layout.bead_dump_bytes:
            told = f"{dump} is incomplete: what is drawn or written ends early"
            warnings.warn(told, IncompleteRunWarning, stacklevel=4)


class IncompleteRunWarning(UserWarning):
    """The dump of a finished run is shorter than its layout says: somebody cut it since."""
