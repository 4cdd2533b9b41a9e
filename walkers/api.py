"""The commands as functions: run cases and sweeps, find them, and draw, film and export them.

The package `walkers` has the public names of this module. It holds no physics and no formats of
files: each function calls the room that does the work.
"""

from __future__ import annotations

import shlex
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from mimetypes import guess_type
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from walkers import DEFAULT_OUT
from walkers.errors import (
    InputError,
    Problem,
    apply_all,
    check_limits,
    check_text_or_path,
    check_utf8,
    expected_of,
    input_error,
)
from walkers.files import read_json
from walkers.inputs.keys import written
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.measure.results import Results, ensure_measured, read_results
from walkers.postprocess.measure.results import text as result_text
from walkers.postprocess.measure.table_units import UnitSystem
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.drawing import FORMATS, check_place, save_figure
from walkers.postprocess.show.figures import plot_run
from walkers.postprocess.show.film_options import FilmOptions
from walkers.postprocess.show.films import render_film
from walkers.postprocess.show.report.page import REPORT_NAME
from walkers.postprocess.show.report.player import player_of
from walkers.postprocess.show.report.run import report_run, result_html
from walkers.postprocess.show.series import SERIES_NAME, render_series
from walkers.postprocess.show.start import render_start
from walkers.progress import Progress, in_notebook, progress_of
from walkers.runner import run_directory
from walkers.runner.audit import check_audit
from walkers.runner.binary import find_engine
from walkers.runner.failures import EngineMissing, RunBusy
from walkers.runs.by_hand import as_run, take_in, write_folder
from walkers.runs.comparison import ComparedRun, Comparison, compare_runs
from walkers.runs.engine_log import follow_log, read_log
from walkers.runs.listing import run_text
from walkers.runs.making import make_runs, progress_at
from walkers.runs.names import (
    Changes,
    Given,
    InDirectory,
    Reference,
    find,
    is_begun,
    not_a_run,
    readable_case,
    refusing,
)
from walkers.runs.so_far import complete_part
from walkers.runs.status import state_at, worst_status
from walkers.sweeps.accuracy import measure_accuracy
from walkers.sweeps.against_first import compare_points
from walkers.sweeps.climbing import conditions_in, summarise_climbs
from walkers.sweeps.climbing_output import write_climbs
from walkers.sweeps.figure import column_of, figure_of
from walkers.sweeps.figure_options import FigureOptions, Log
from walkers.sweeps.record import SweepRecord, read_sweep_record
from walkers.sweeps.report import report_sweep
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.site import load_site
from walkers.sweeps.spread import (
    Spread,
    check_number_of_draws,
    draws_of,
    figures_of_spread,
    read_spread,
    run_spread,
)
from walkers.sweeps.table import SweepTable, aligned_table, describe_status, table_of
from walkers.sweeps.workers import Failure
from walkers.terminal import table_width
from walkers.warning import warn_user

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import k3d
    import pandas as pd
    from matplotlib.figure import Figure

    from walkers.calibration.calibrate import Outcome
    from walkers.inputs.origins import Origin

Export = Literal["deck", "vtk", "lammps", "csv", "archive"]
"""Forms of exports."""

_OPTIONS_OF_FORMS: Mapping[str, tuple[str, ...]] = {
    "deck": (),
    "vtk": ("every", "follow"),
    "lammps": ("every",),
    "csv": ("units",),
    "archive": ("dumps", "authors", "licence"),
}
"""Options of `Run.export` that each form takes."""


# --- names ----------------------------------------------------------------------------------------


def load(
    reference: Given | InDirectory | Reference,
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
) -> Run | Sweep:
    """Find a sweep, or a run, finished or not.

    Parameters
    ----------
    reference
        The directory of a run or a sweep, its name in the folder ``out``, a `Run` or a `Sweep`, or
        a case (resolved, tables, file or shipped name), which means its run with the installed
        engine.
    out
        Folder of the run directories.
    changes
        Other values of the case, by dotted keys.

    Returns
    -------
    Run or Sweep
        What the reference means. Nothing is run.

    Raises
    ------
    InputError
        If it does not exist or cannot be read.
    EngineFailure
        If a case is given and no engine is installed.

    Examples
    --------
    >>> walkers.run("fig1b", tmp).directory == walkers.load("fig1b", tmp).directory
    True
    """
    named = find(reference, out, changes)
    if named.kind == "case" or named.changes:
        run = _run_of_case(named)
    elif named.kind == "sweep":
        return Sweep(named.path)
    elif named.kind == "run":
        run = Run(named.path)
    else:
        raise not_a_run(named.given, named.kind)
    if run_directory.is_finished(run.check().directory):
        read_results(run.directory)  # refuses a result that cannot be read
    return run


def _run_of_case(named: Reference) -> Run:
    """The run of a case, finished or begun; `InputError` if there is none."""
    case = named.case
    place = run_directory.run_place(case, find_engine(), named.folder)
    if run_directory.is_finished(place) or is_begun(place):
        return Run(place, requested=case)
    name = str(named.given) if isinstance(named.given, (str, Path)) else case.name
    missing = f"no finished run in {named.folder}; first do"
    command = f"walkers run {name}"
    for key, value in named.changes.items():
        command += f" --set {shlex.quote(f'{key}={written(value)}')}"
    raise input_error(name, f"{missing}: {_call_that_runs(named)}", f"{missing}: {command}")


def _call_that_runs(named: Reference) -> str:
    """The call of Python that runs the case of a name, with its changes."""
    case = "case"  # the name of a variable of the user, which has the case or its tables
    if named.kind == "run":
        case = f'walkers.load("{named.path}").case'
    elif isinstance(named.given, (str, Path)):
        case = f'"{named.given}"'
    if named.changes:
        case = f"walkers.load_case({case}, {dict(named.changes)})"
    folder = "" if named.folder == DEFAULT_OUT else f', "{named.folder}"'
    return f"walkers.run({case}{folder})"


def directory_of(
    reference: str | Path | Reference, out: str | Path = DEFAULT_OUT, changes: Changes = None
) -> Path:
    """The directory that a user names, whatever it contains.

    For a case, it is the directory of its run. The arguments and errors are those of `load`.
    """
    named = find(reference, out, changes)
    if named.means_case:
        return load(named).directory
    return named.path


# --- runs -----------------------------------------------------------------------------------------


class Pictures(list[Path]):
    """Files of pictures, which a notebook shows."""

    def _repr_html_(self) -> str:
        """Show the pictures; the notebook keeps their contents. A PDF is shown by its name."""
        page = ""
        for path in self:
            name = escape(path.name)
            kind = guess_type(path)[0]
            content = b64encode(path.read_bytes()).decode()
            page += f'<p><img alt="{name}" src="data:{kind};base64,{content}">'
        return page


@dataclass(frozen=True)
class Run:
    """A run: finished, running, interrupted or failed.

    Its results and tables raise `InputError` until it is finished. Figures, pictures, views and
    reports of an unfinished run in several segments, such as a pile, show its complete segments,
    and say so.

    Attributes
    ----------
    directory
        The run directory. A run that is not finished is in the folder of this name with
        ``.incomplete`` appended.
    cached
        Whether the run existed before.
    requested
        The case that was asked for. None: the case that made the run, whose numbers may have other
        sources.
    status : str
        ``finished``, ``running``, ``interrupted`` or ``failed``.
    progress : Progress or None
        Completed ``share``, from 0 to 1, and ``text`` of a running run.
    case : Case
        The resolved case; its values are in SI units (``run.case.drive.frequency``, Hz).
    origins : tuple of Origin or None
        Sources of the values of the requested case.
    result : Results
        Numbers in SI units by name, and ``warnings``; a dictionary.
    motion : Motion
        Positions (m), velocities (m/s) and spins (rad/s) of all beads, arrays of shape (F, N, 3) of
        F frames and N beads.
    trajectory, walkers : pandas.DataFrame
        Tables of the run in SI units: a row per sample and walker, and a row per walker. `table`
        reads the others.
    finished_directory : Path
        The directory; `InputError` unless the run is finished.
    """

    directory: Path
    cached: bool = True
    requested: Case | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Make a path of the name of a directory."""
        object.__setattr__(self, "directory", Path(self.directory))

    def __repr__(self) -> str:
        """Directory, status and result in a line."""
        return f"Run({self.directory}: {run_text(self._files)})"

    def check(self) -> Run:
        """Return the run itself; raise `InputError` if a file that describes it cannot be read."""
        readable_case(self.directory)
        return self

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``interrupted`` or ``failed``."""
        return worst_status([state_at(self.directory).status])

    @property
    def progress(self) -> Progress | None:
        """Progress of a running run, in any process.

        None between segments, and if the run is not running.
        """
        if not run_directory.is_locked(self.directory):
            return None
        return progress_at(self.directory)

    @property
    def finished_directory(self) -> Path:
        """The directory of a finished run; otherwise `InputError`."""
        if not run_directory.is_finished(self.directory):
            state = f"the run is {self._state}"
            call = f'walkers.run("{self.directory}")'
            command = f"walkers run {self.directory}"
            if self.status == "running":
                raise input_error(self.directory, state)
            again = "continue it with"
            raise input_error(
                self.directory, f"{state}; {again}: {call}", f"{state}; {again}: {command}"
            )
        return self.directory

    @contextmanager
    def _pictured(self) -> Iterator[tuple[Path, Path | None]]:
        """The directory of which pictures are made, and the folder of those of an unfinished run.

        Of a run in several segments that is not finished, it has the complete segments
        (`walkers.runs.so_far.complete_part`). The folder is None for a finished run: its pictures
        are in its directory.
        """
        if run_directory.is_finished(self.directory) or self.case.run.has_one_segment:
            yield self.finished_directory, None
            return
        with complete_part(self.directory, self.status) as directory:
            yield directory, Path(f"{run_directory.name_of(self.case.name)}-so-far")

    @property
    def _files(self) -> Path:
        """The directory that holds the files now."""
        if run_directory.is_finished(self.directory):
            return self.directory
        return run_directory.unfinished(self.directory)

    @property
    def _state(self) -> str:
        """The status of an unfinished run, with its progress or the reason of its failure."""
        status = self.status
        if status == "running":
            progress = self.progress
            return f"running: {progress.text}" if progress else "running"
        failure = self._files / run_directory.FAILURE_NAME
        reason = f": {read_json(failure).get('message')}" if failure.is_file() else ""
        return f"{status}{reason}"

    @cached_property
    def case(self) -> Case:
        """The resolved case."""
        return run_directory.case_of(self._files)

    @property
    def origins(self) -> tuple[Origin, ...] | None:
        """Sources of the values of the requested case; None: of the case that made the run.

        Each has the dotted ``key``, the ``value`` in SI units, its ``text``, and where it is from
        (``origin``, ``source``, ``range``).
        """
        return None if self.requested is None else self.requested.origins

    @property
    def result(self) -> Results:
        """The result: numbers in SI units by name, with bands and numerical errors if measured.

        Returns
        -------
        walkers.postprocess.measure.results.Results
            A dictionary; its ``warnings`` are reasons to doubt the numbers. The reference of tables
            says what each number means.
        """
        return read_results(self.finished_directory, self.origins)

    @property
    def motion(self) -> Motion:
        """Positions, velocities and spins of all beads as arrays; also of an unfinished run.

        Returns
        -------
        walkers.postprocess.measure.motion.Motion
            Arrays of shape (F, N, 3) of F frames and N beads, in m, m/s and rad/s, and ``time``,
            shape (F,), s.

        Raises
        ------
        DumpError
            If a dump was left out, as in spreads and calibrations, or cannot be read.
        """
        return read_motion(self._files)

    @property
    def trajectory(self) -> pd.DataFrame:
        """The table ``trajectory``: one row per sample and walker, in SI units."""
        return self.table("trajectory")

    @property
    def walkers(self) -> pd.DataFrame:
        """The table ``walkers``: one row per walker, in SI units."""
        return self.table("walkers")

    def table(self, name: str) -> pd.DataFrame:
        """Read a table of the run in SI units.

        Parameters
        ----------
        name
            Name of the table, such as ``cycles``, ``meetings`` or ``bed``.

        Raises
        ------
        InputError
            If the run is not finished or has no such table.
        """
        return read_table(self.finished_directory, name)

    def log(self) -> str:
        """The engine's log, also of an unfinished run: of all segments, in order.

        Returns
        -------
        str
            The log. A line such as ``==> segments/0001/engine.log <==`` begins each segment.

        Raises
        ------
        InputError
            If there is no log.

        Examples
        --------
        >>> "LIGGGHTS" in walkers.run("fig1b", tmp).log()
        True
        """
        return read_log(self.directory)

    def follow_log(self) -> Iterator[str]:
        """Yield the engine's log in pieces as it grows, until the run ends.

        Yields
        ------
        str
            What has been added to the log; see `log`.

        Raises
        ------
        InputError
            If the run has ended without a log.
        """
        return follow_log(self.directory)

    def describe(self, *, verbose: bool = False) -> str:
        """The result as text in mm, mm/s and degrees; of an unfinished run, its progress.

        Parameters
        ----------
        verbose
            Whether to write all numbers, and all values that have not been measured.
        """
        if not run_directory.is_finished(self.directory):
            return f"{self.directory.name}: {self._state}"
        return result_text(self.result, cached=self.cached, verbose=verbose)

    def _repr_html_(self) -> str:
        """The result in a notebook: a table with errors, units and warnings, and the parameters."""
        if not run_directory.is_finished(self.directory):
            return f"<p>{escape(self.describe())}</p>"
        return result_html(self.result, self.origins)

    def plot(
        self, to: str | Path | None = None, formats: str | Sequence[str] = ("png",)
    ) -> Pictures:
        """Draw the figures of the run: path, orientation and gait, or climbs.

        Parameters
        ----------
        to
            Folder of the figures; default: the run directory.
        formats
            Formats of the figures: png, svg or pdf.

        Returns
        -------
        Pictures
            The written files, which a notebook shows.

        Raises
        ------
        InputError
            If a format does not exist, or ``to`` is the name of a picture.
        """
        with self._pictured() as (directory, folder):
            return Pictures(plot_run(directory, _path(to) or folder, formats))

    def render(
        self, to: str | Path | None = None, *, images: int = 6, walker: int | None = None
    ) -> Pictures:
        """Render pictures of the beads at several times in one file.

        Parameters
        ----------
        to
            The file, a PNG; default: ``series.png`` or, of one walker, ``walker.png`` in the run
            directory.
        images
            Largest number of pictures, evenly spaced through the drive.
        walker
            Number of the walker to show by itself, from 0; default: the first of independent
            walkers, otherwise all beads.

        Returns
        -------
        Pictures
            The written file, which a notebook shows.

        Raises
        ------
        InputError
            If the file is not a PNG, or the run has no such walker.
        """
        with self._pictured() as (directory, folder):
            place = _path_or(to, folder, SERIES_NAME)
            return Pictures(render_series(directory, place, images=images, walker=walker))

    def film(
        self,
        to: str | Path | None = None,
        *,
        size: tuple[int, int] | None = None,
        fps: int = FilmOptions.fps,
        slowdown: float | None = None,
        walker: int | None = None,
        begin: float = 0.0,
        end: float | None = None,
        progress: bool | None = None,
    ) -> Path:
        """Render a film.

        Parameters
        ----------
        to
            The file, .mp4 or .gif; default: ``film.mp4`` in the run directory.
        size
            Width and height in pixels; default: 1280 and 720, or as many pixels in the shape of the
            container.
        fps
            Frames per second.
        slowdown
            Slow motion factor; default: 1, 2, 5, 10, ..., chosen so that the film lasts 5 to 10 s.
        walker
            Number of the walker to show by itself, from 0; default: the first of independent
            walkers, otherwise all beads.
        begin
            Physical time of the first frame since the start of the drive, s.
        end
            Physical time of the last frame, s; default: the end of the run.
        progress
            Show the progress; None: only in notebooks.

        Returns
        -------
        Path
            The written file.

        Raises
        ------
        InputError
            If the format cannot hold such a film, the run has no such walker, or no frame is
            between ``begin`` and ``end``.
        WalkersError
            If ffmpeg fails.
        """
        options = FilmOptions(
            size=size, fps=fps, slowdown=slowdown, walker=walker, begin=begin, end=end
        )
        with progress_of(self.case.name, progress) as advance:
            return render_film(self.finished_directory, _path(to), options, on_progress=advance)

    def view(self, *, height: int = 480) -> k3d.Plot:
        """Make an interactive 3-D view of the beads for a notebook.

        Parameters
        ----------
        height
            Height in pixels.

        Examples
        --------
        >>> len(walkers.run("fig1b", tmp).view().objects)  # beads, necks, substrate, its lines
        5
        """
        with self._pictured() as (directory, _):
            return player_of(read_motion(directory), height=height)[0]

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report, with the figure of the run's spread if it has one.

        Parameters
        ----------
        to
            The file; default: ``report.html`` in the run directory. Missing folders are made.

        Returns
        -------
        Path
            The written file.

        Raises
        ------
        InputError
            If the file is not an HTML file, or its folder cannot be made.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).report(tmp / "fig1b.html").name
        'fig1b.html'
        """
        with self._pictured() as (directory, folder):
            place = _path_or(to, folder, REPORT_NAME)
            figures = figures_of_spread(directory)
            return report_run(directory, place, self.origins, figures=figures)

    def spread(
        self, points: int = 32, *, progress: bool | None = None, engine: str | None = None
    ) -> Spread:
        """Run the case with uncertain values drawn from their ranges.

        From then on, the texts and reports of the run contain the bands.

        Parameters
        ----------
        points
            Number of draws.
        progress
            Show the progress; None: only in notebooks.
        engine
            Name or path of the binary; default: the installed one.

        Returns
        -------
        walkers.sweeps.spread.Spread
            The bands of the result, 5 to 95 %.

        Raises
        ------
        InputError
            If no value of the case is uncertain, or the number of draws is out of its limits.
        SweepStopped
            If a failure affects every draw.
        """
        case = self.requested or self.case
        with progress_of(f"{case.name}, spread", progress) as advance:
            return run_spread(
                case,
                self.directory.parent,
                SweepOptions(),
                points=points,
                engine=engine,
                on_progress=advance,
            )

    def stored_spread(self) -> Spread | None:
        """The spread of the run that `spread` has made before; None if there is none.

        Examples
        --------
        >>> walkers.run("fig4a", tmp).stored_spread() is None
        True
        """
        return read_spread(self.finished_directory)

    def accuracy(
        self, *, progress: bool | None = None, engine: str | None = None
    ) -> dict[str, Any]:
        """Measure the numerical errors of the result, at half the time step and with harder beads.

        From then on, the texts and reports of the run contain the errors.

        Parameters
        ----------
        progress
            Show the progress; None: only in notebooks.
        engine
            Name or path of the binary; default: the installed one.

        Returns
        -------
        dict
            The contents of ``accuracy.json``, as `walkers.sweeps.accuracy.measure_accuracy` lists
            them.

        Raises
        ------
        InputError
            If the run has no walkers, or is not of the installed engine and program.
        SweepStopped
            If a run fails.

        Examples
        --------
        >>> error = walkers.run("fig4a", tmp).accuracy()["errors"]["velocity"]["total"]
        >>> round(1e3 * error, 3)  # mm/s
        0.002
        """
        with progress_of(f"{self.case.name}, accuracy", progress) as advance:
            return measure_accuracy(
                self.finished_directory, SweepOptions(), engine=engine, on_progress=advance
            )

    def export(
        self,
        form: Export,
        to: str | Path | None = None,
        *,
        every: int | None = None,
        units: UnitSystem | None = None,
        dumps: bool = True,
        authors: Sequence[str] = (),
        licence: str | None = None,
        follow: bool = False,
        progress: bool | None = None,
    ) -> Path:
        """Write the run for other programs.

        Parameters
        ----------
        form
            ``deck``: the LIGGGHTS deck of the case. ``vtk``: files for ParaView. ``lammps``: the
            trajectory as a LAMMPS dump. ``csv``: all tables and the numbers of the result as CSV
            files, with units in their headers. ``archive``: a zip file with checksums, to publish.
        to
            The file, for ``vtk``, ``csv`` and ``deck`` a folder. Default: in the run directory, for
            ``archive`` and ``deck`` in the current folder.
        every
            ``vtk``, ``lammps``: write every Nth sample; default: one per cycle; for ``lammps`` and
            piles all.
        units
            ``csv``: ``SI``, or ``mm`` for mm, mm/s, g (9.8 m/s²), µN, nJ and degrees; default: SI.
        dumps
            ``archive``: whether to include the dumps of the engine.
        authors
            ``archive``: names of the authors of the run.
        licence
            ``archive``: licence of the data, such as ``CC-BY-4.0``.
        follow
            ``vtk``: of a run that goes on, write the complete segments, and each further one, until
            the run ends; by default into the folder ``NAME-vtk``.
        progress
            With ``follow``: show the progress; None: only in notebooks.

        Returns
        -------
        Path
            The written file; for ``deck`` and ``vtk`` the main file in the folder, for ``csv`` the
            folder.

        Raises
        ------
        InputError
            If the form does not exist or does not take an option, or the place cannot be written.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).export("lammps", tmp / "walk.lammpstrj", every=20).name
        'walk.lammpstrj'
        """
        options = {
            "every": every is not None,
            "units": units is not None,
            "dumps": not dumps,
            "authors": bool(authors),
            "licence": licence is not None,
            "follow": follow,
        }
        check_export(form, [name for name, is_given in options.items() if is_given])
        place = _path(to)
        if form == "deck":
            case = as_run(self.case, self.directory)
            return write_folder(case, place or Path(f"{self.directory.name}-deck"))
        if follow and self.status != "finished":
            return self._follow(place or Path(f"{self.directory.name}-vtk"), every, progress)
        directory = self.finished_directory
        if form == "vtk":
            from walkers.postprocess.show.paraview import write_vtk

            return write_vtk(directory, place, every=every)
        if form == "lammps":
            from walkers.postprocess.show.lammps import write_trajectory

            return write_trajectory(directory, place, every=every)
        if form == "csv":
            from walkers.postprocess.show.csv_tables import write_csv

            return write_csv(directory, place, units=units or "SI")
        from walkers.archive.writing import write_archive

        return write_archive(directory, place, dumps=dumps, authors=authors, licence=licence)

    def _follow(self, place: Path, every: int | None, progress: bool | None) -> Path:
        """Write the segments of an unfinished run for ParaView as they are completed."""
        from walkers.runs.following import follow_vtk

        with progress_of(str(place), progress) as advance:
            return follow_vtk(self.directory, place, every=every, on_progress=advance)


def check_export(form: str, options: Sequence[str] = ()) -> None:
    """Refuse a form of exports that does not exist, and options that the form does not take.

    Parameters
    ----------
    form
        The form, such as ``vtk``.
    options
        Names of the options of `Run.export` that are given.

    Raises
    ------
    InputError
        If the form is not one of `Export`, or does not take one of the options.
    """
    if form not in _OPTIONS_OF_FORMS:
        raise input_error("form", f"{form!r}: {expected_of(form, _OPTIONS_OF_FORMS)}")
    for option in options:
        if option not in _OPTIONS_OF_FORMS[form]:
            forms = [name for name, taken in _OPTIONS_OF_FORMS.items() if option in taken]
            names = ", ".join(forms)
            raise input_error(option, f"is for the form {names}", f"is for --format {names}")


def _path(to: str | Path | None) -> Path | None:
    """The path of an argument ``to``; raises `InputError` if it is neither text nor a path."""
    if to is None:
        return None
    check_text_or_path("to", to)
    return Path(to)


def _path_or(to: str | Path | None, folder: Path | None, name: str) -> Path | None:
    """The path of an argument ``to``, or else a file of a folder, if there is a folder."""
    place = _path(to)
    if place is None and folder is not None:
        return folder / name
    return place


def run(
    case: Given | InDirectory,
    out: str | Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    progress: bool | None = None,
    time_limit: float | None = None,
) -> Run:
    """Run a case unless a finished run exists.

    An interrupted run continues. A deck that was run by hand becomes a run.

    Parameters
    ----------
    case : Case, str, Path or mapping
        A case (resolved by `load_case`, the tables of a case file, a file or the name of a shipped
        case), a run (`Run`, or its name or directory), or the folder of a deck that was run by
        hand.
    out : str or Path
        Folder of the run directories; it is made if it does not exist.
    engine : str, optional
        Name or path of the binary; default: the environment variable ``WALKERS_ENGINE``, or the
        installed one.
    force : bool
        Run again although a finished run exists. The old run is replaced when the new one is
        finished.
    progress : bool, optional
        Show the progress; default: only in notebooks.
    time_limit : float, optional
        Limit of the wall time in s for each segment of the run; default: none.

    Returns
    -------
    Run
        The finished run. Its ``cached`` tells whether it existed before.

    Raises
    ------
    InputError
        If the case or another argument cannot be used.
    EngineFailure
        If the engine fails or is missing, or another process is running the case. The classes that
        derive from it tell the reason; `TimeLimitExceeded`, for example, is one.
    KeyboardInterrupt
        If the user stops the run, which the same call continues.

    Warns
    -----
    UnauditedEngineWarning
        If nobody has compared the forces of this engine with the expected ones.
    ExecutedLawWarning
        If the case has a bridge law of the user, whose file is executed.

    Examples
    --------
    >>> import walkers
    >>> one = walkers.run("fig1b", tmp)
    >>> round(1e3 * one.result["velocity"], 3)  # mm/s
    1.459
    >>> one.walkers[["facing", "steady"]].drop_duplicates("facing").to_dict("list")
    {'facing': [1, -1], 'steady': [True, True]}
    """
    named = find(case, out)
    check_limits("time_limit", time_limit, 0.0)
    if not force:
        finished = finished_run_of(named)
        if finished:
            return finished
    requested = named.case
    folder = named.folder
    check_utf8(folder.absolute())
    check_utf8(requested.name)
    binary = find_engine(engine)
    place = run_directory.run_place(requested, binary, folder)
    if run_directory.is_finished(place) and not force:
        run_directory.mark_as_requested(place)
        return _measured(Run(place, requested=requested))
    check_audit(binary)
    with progress_of(requested.name, progress) as advance:
        runs = make_runs(
            [requested], folder, binary, force=force, on_progress=advance, time_limit=time_limit
        )
    if not runs:
        raise RunBusy("another process is still running this case", run_directory.unfinished(place))
    run_directory.mark_as_requested(place)
    return Run(place, cached=not runs[place.name], requested=requested)


def finished_run_of(named: Reference) -> Run | None:
    """The finished run that a name means; None for a case, and for a run that is not finished.

    A deck that was run by hand first becomes a run (`walkers.runs.by_hand.take_in`). The run is
    measured again if its result or a table cannot be read.

    Raises
    ------
    InputError
        If a deck that was run by hand has not ended well, or files of the run cannot be read.
    """
    if named.means_case or named.kind not in ("run", "deck"):
        return None
    if run_directory.is_deck_folder(named.path):
        take_in(named.path)
    if not run_directory.is_finished(named.path):
        return None
    return _measured(Run(named.path))


def case_to_run(named: tuple[Reference, Run | None]) -> Case:
    """The case of a name, or of the finished run that it means.

    A deck that was run by hand has no other case than that of its run.
    """
    reference, run = named
    return reference.case if run is None else run.case


def _measured(run: Run) -> Run:
    """The run; a finished run is measured again if its result or a table cannot be read."""
    if run_directory.is_finished(run.check().directory):
        with refusing(run.directory, "the run"):
            ensure_measured(run.directory)
    return run


# --- sweeps ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sweep:
    """A sweep in its directory; its runs are in the same folder.

    Attributes
    ----------
    directory
        The directory of the sweep.
    failures
        The points that failed in the call of `sweep` that gave this object, in order; empty for a
        sweep of `load`, whose table has their ``status``. Each has the number of its ``point``, the
        name of its ``run``, the ``reason`` (the name of a class such as ``BlowUp``), the
        ``message`` and the ``directory`` of the unfinished run
        (`walkers.sweeps.workers.Failure`).
    """

    directory: Path
    failures: tuple[Failure, ...] = field(default=(), repr=False, compare=False)
    _record: SweepRecord = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Make a path of the name of a directory; `InputError` if it has no sweep."""
        object.__setattr__(self, "directory", Path(self.directory))
        object.__setattr__(self, "_record", read_sweep_record(self.directory))

    def __repr__(self) -> str:
        """Name and numbers of points by status in a line."""
        return f"Sweep({self.summary().splitlines()[0]})"

    def summary(self) -> str:
        """The status of the points and their failures."""
        return describe_status(self._table.frame)

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``failed`` (some points) or ``interrupted`` (others)."""
        return worst_status(self._table.frame["status"])

    @cached_property
    def runs(self) -> list[Run]:
        """The runs of all points, finished or not."""
        return [Run(place) for place in self._record.places]

    def table(self) -> pd.DataFrame:
        """The table of the sweep, one row per point.

        Returns
        -------
        pandas.DataFrame
            Columns are ``point``, the keys that vary (in the unit of the sweep file), and in SI
            units the numbers of the results (NaN for unfinished points) and of the state of the
            points. The table is read again until all points are finished; see `refresh`.
        """
        return self._table.frame.copy()

    def refresh(self) -> Sweep:
        """Read the table of a finished sweep again when it is needed, and return the sweep.

        This is necessary after its runs were measured again or removed.
        """
        self.__dict__.pop("_finished_table", None)
        return self

    @property
    def _table(self) -> SweepTable:
        """The table with its results, read again as long as points are not finished."""
        table: SweepTable | None = self.__dict__.get("_finished_table")
        if table is None:
            table = table_of(self._record)
            if len(table.finished) == len(table.frame):
                self.__dict__["_finished_table"] = table
        return table

    def describe(self) -> str:
        """The status of the points, their failures, and the table in mm, mm/s, nJ and degrees."""
        frame = self._table.frame.drop(columns="run")
        return f"{describe_status(frame)}\n\n{aligned_table(frame, table_width())}"

    def _repr_html_(self) -> str:
        """The table in a notebook."""
        return str(self.table()._repr_html_())  # type: ignore[operator]

    def figure(
        self,
        *,
        x: str | None = None,
        y: str | None = None,
        hue: str | None = None,
        panels: str | None = None,
        log: Log | None = None,
        theory: bool = False,
        data_files: str | Path | Sequence[str | Path] = (),
        width: str | None = None,
        font_size: float | None = None,
        title: str | None = None,
    ) -> Figure:
        """Make a matplotlib figure of a column of the table.

        Parameters
        ----------
        x
            Key or column on the x axis, such as ``drive.frequency``, ``frequency`` or ``gamma0``;
            default: the key with the most values.
        y
            Column of the table; default: velocity, or climbs for piles.
        hue
            Key or column that sets the colour, or ``none``; default: the first key that is not x.
        panels
            Key or column that sets the panel, or ``none`` to draw all values of further keys alike;
            default: no panels, except one for each key of a sample.
        log
            Which axes are logarithmic: ``x``, ``y`` or ``xy``. An x axis of a key that is drawn
            log-uniformly always is.
        theory
            Also draw the predictions of the theory.
        data_files
            Files with points of your own, such as measured ones, each as its path or as
            ``LABEL=PATH``. The header names the columns like the axes, with units that are
            converted to those of the axes: ``peak_acceleration (g)``, ``velocity (mm/s)``; columns
            ``velocity error (mm/s)`` have error bars.
        width
            Width of the figure, such as ``85mm``; default: 7 inches. The height follows.
        font_size
            Size of all texts in points; default: 8, and 7 of tick labels and legends.
        title
            Text above the figure, or ``none``; default: the title of the sweep, and what its bars
            and bands are.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, which can be changed and saved. Its axes are in the units of the sweep file
            for keys, and in mm, mm/s, nJ and degrees for results.

        Raises
        ------
        InputError
            If a key, column or file does not exist, a unit is not understood, or no point is
            finished.

        Examples
        --------
        >>> walkers.sweep("fig4", tmp).figure(x="liquid.name", log="y").axes[0].get_yscale()
        'log'
        """
        options = FigureOptions(
            x=x,
            y=y,
            hue=hue,
            panels=panels,
            log=log,
            theory=theory,
            data_files=[data_files] if isinstance(data_files, (str, Path)) else data_files,
            width=width,
            font_size=font_size,
            title=title,
        )
        if in_notebook():
            import matplotlib.pyplot as plt

            # This tells the notebook how to show figures.
            plt.switch_backend(plt.rcParams["backend"])
        return _figure(self._table, options)

    def plot(
        self,
        to: str | Path | None = None,
        *,
        x: str | None = None,
        y: str | None = None,
        hue: str | None = None,
        panels: str | None = None,
        log: Log | None = None,
        theory: bool = False,
        data_files: str | Path | Sequence[str | Path] = (),
        width: str | None = None,
        font_size: float | None = None,
        title: str | None = None,
    ) -> Pictures:
        """Plot a column of the table to a file.

        Parameters
        ----------
        to
            The file, .png, .svg or .pdf; default: a PNG in the directory of the sweep, named after
            the column.
        x, y, hue, panels, log, theory, data_files, width, font_size, title
            What the figure shows, see `figure`.

        Returns
        -------
        Pictures
            The written file, which a notebook shows.

        Raises
        ------
        InputError
            If a key or column does not exist, no point is finished, or the format is another one.
        """
        options = FigureOptions(
            x=x,
            y=y,
            hue=hue,
            panels=panels,
            log=log,
            theory=theory,
            data_files=[data_files] if isinstance(data_files, (str, Path)) else data_files,
            width=width,
            font_size=font_size,
            title=title,
        )
        table = self._table
        place = _path(to) or self.directory / f"{column_of(table.frame, y)}.png"
        check_place(place, *(f".{form}" for form in FORMATS))
        runs = [Path(run).name for run in table.finished["run"]]
        form = place.suffix.lower()[1:]
        figure = _figure(table, options)
        sweep_name = str(table.frame.attrs["sweep"])
        return Pictures(save_figure(figure, place, runs, form, sweep_name))

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report.

        Parameters
        ----------
        to
            The file; default: ``report.html`` in the directory of the sweep. Missing folders are
            made.

        Returns
        -------
        Path
            The written file.
        """
        return report_sweep(self._table, _path(to) or self.directory / REPORT_NAME)

    def export(
        self,
        form: Export = "archive",
        to: str | Path | None = None,
        *,
        dumps: bool = True,
        authors: Sequence[str] = (),
        licence: str | None = None,
    ) -> Path:
        """Write the sweep and its runs as an archive.

        Parameters
        ----------
        form
            ``archive``, the only form of sweeps.
        to, dumps, authors, licence
            See `Run.export`.

        Returns
        -------
        Path
            The zip file.

        Raises
        ------
        InputError
            If the form is another one, a run is not finished, or the file cannot be written.
        """
        from walkers.archive.writing import write_archive

        if form != "archive":
            text = f"is a sweep: expected one of its runs for {form}, or archive"
            if form != "csv":
                raise input_error(self.directory, text)
            command = f"walkers list {self.directory} --to table.csv"
            raise input_error(
                self.directory,
                f"{text}; its table is given by table()",
                f"{text}; for its table: {command}",
            )
        return write_archive(
            self.directory, _path(to), dumps=dumps, authors=authors, licence=licence
        )


def _figure(table: SweepTable, options: FigureOptions) -> Figure:
    """The figure of a table, with the predictions of the theory if they are asked for."""
    from walkers.theory.prediction import predicted_column

    return figure_of(table, options, predicted_column if options.theory else None)


def sweep(
    sweep: str | Path | Mapping[str, Any],
    out: str | Path = DEFAULT_OUT,
    *,
    jobs: int | None = None,
    changes: Mapping[str, Any] | None = None,
    progress: bool | None = None,
    site: str | Path | None = None,
    executor: Executor | None = None,
    time_limit: float | None = None,
    spread: int = 0,
    engine: str | None = None,
) -> Sweep:
    """Run the missing points of a sweep, on this machine or a cluster.

    Parameters
    ----------
    sweep : str, Path or mapping
        A sweep file, the name of a shipped sweep, or the tables of a sweep file:
        ``{"case": "fig1b", "axes": {"drive.frequency": ["70 Hz", "80 Hz"]}}``. A sweep of tables is
        named ``sweep@`` and a digest of them.
    out : str or Path
        Folder of the run directories, and of that of the sweep.
    jobs : int, optional
        Number of parallel decks, 1 or more; default: one per core.
    changes : mapping, optional
        Values that are added to ``[set]`` or replace those there, by dotted keys.
    progress : bool, optional
        Show the progress; default: only in notebooks.
    site : str or Path, optional
        The site file of a cluster, TOML or Python; see `walkers.sweeps.site.load_site`. Default:
        this machine.
    executor : concurrent.futures.Executor, optional
        Runs the decks instead of threads of this process, ``jobs`` at the same time. All of its
        workers must see the folder ``out``.
    time_limit : float, optional
        Limit of the wall time in s for each deck; default: none.
    spread : int
        Number of runs of each finished point with its uncertain values drawn from their ranges, 2
        to 4096, for bands along the sweep (columns such as ``velocity_low``); 0: none.
    engine : str, optional
        Name or path of the binary; default: the environment variable ``WALKERS_ENGINE``, or the
        installed one.

    Returns
    -------
    Sweep
        The sweep. The ``status`` in its table marks failed points, and its ``failures`` say why
        they failed.

    Raises
    ------
    InputError
        If the sweep, one of its points, or another argument cannot be used.
    EngineFailure
        If there is no engine, or its audit failed. Failures of points do not raise errors.
    SweepStopped
        If a failure affects every point.
    KeyboardInterrupt
        If the user stops the sweep, which the same call continues.

    Warns
    -----
    UnauditedEngineWarning
        If nobody has compared the forces of this engine with the expected ones.
    SweepReplacedWarning
        If another sweep of the same name, without common runs, was in the folder.

    Examples
    --------
    >>> walkers.sweep("fig4", tmp).table()[["liquid.name", "status"]].to_dict("list")
    {'liquid.name': ['Si AK5', 'Si AK10'], 'status': ['finished', 'finished']}
    """
    check_text_or_path("out", out)
    check_limits("jobs", jobs, 1, whole=True)
    check_limits("time_limit", time_limit, 0.0)
    if spread != 0:
        check_number_of_draws(spread, "spread")
    if site is not None:
        check_text_or_path("site", site)
    points = load_sweep(sweep, changes)
    options = SweepOptions(jobs, load_site(Path(site)) if site else None, executor, time_limit)
    folder = Path(out).resolve() if site else Path(out)
    with progress_of(points.name, progress) as advance:
        record, failures = run_sweep(points, folder, options, engine=engine, on_progress=advance)
    if spread:
        failed = {failure.point for failure in failures}
        for point, case in enumerate(points.cases()):
            if point in failed:
                continue
            task = f"{points.name}, spread {point + 1} of {len(points.rows)}"
            with progress_of(task, progress) as advance:
                drawn = run_spread(
                    case, folder, options, points=spread, engine=engine, on_progress=advance
                )
            failures += drawn.failures
    return Sweep(record.directory, tuple(failures))


# --- before a run ---------------------------------------------------------------------------------


def draw_start(
    case: Given | InDirectory | Reference,
    to: str | Path | None = None,
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
    *,
    walker: int | None = None,
) -> Pictures:
    """Draw the start of a case: beads, walls with their names, axes and direction of the drive.

    No engine is needed.

    Parameters
    ----------
    case
        A case (resolved, tables, file or shipped name), or the name or directory of a run.
    to
        The file, a PNG; default: ``NAME-start.png`` in the current folder.
    out
        Folder of the run directories.
    changes
        Other values of the case, by dotted keys.
    walker
        Number of the walker to show by itself, from 0; default: the first of independent walkers,
        otherwise all beads.

    Returns
    -------
    Pictures
        The written file, which a notebook shows.

    Raises
    ------
    InputError
        If the case cannot be used, the file is not a PNG, or the case has no such walker.

    Examples
    --------
    >>> [path.name for path in walkers.draw_start("fig1b", tmp / "start.png")]
    ['start.png']
    """
    drawn = find(case, out, changes).case
    default = Path(f"{run_directory.name_of(drawn.name)}-start.png")
    return Pictures(render_start(drawn, _path(to) or default, walker=walker))


def has_not_begun(reference: Reference) -> bool:
    """Whether a name means a case of which there is no run, finished or begun."""
    if not reference.means_case:
        return False
    try:
        place = run_directory.run_place(reference.case, find_engine(), reference.folder)
    except EngineMissing:
        return True
    return not run_directory.is_finished(place) and not is_begun(place)


# --- several runs ---------------------------------------------------------------------------------


def compare(
    first: Given | InDirectory | Reference,
    second: Given | InDirectory | Reference | None = None,
    out: str | Path = DEFAULT_OUT,
    changes: Mapping[str, Any] | None = None,
) -> Comparison:
    """Compare two runs or cases in parameters and results, or the points of a sweep.

    If both cases have a spread, or the points of the sweep, this gives the bands of the difference
    and of the ratio of the main number, for common and for independent unknowns
    (`walkers.runs.draws`).

    Parameters
    ----------
    first, second
        Runs (`Run`) or cases, or their names as for `load`. The second one is the first by
        default. A sweep by itself: its points are compared with its first one.
    out
        Folder of the run directories.
    changes
        Other values of the second case, by dotted keys.

    Returns
    -------
    walkers.runs.comparison.Comparison
        The differences, as JSON in SI units and as text.

    Raises
    ------
    InputError
        If neither a second run nor changes are given, a case cannot be read, or the points of a
        sweep have no spread.
    """
    if second is None and not changes:
        named = find(first, out)
        if named.kind == "sweep":
            return compare_points(Sweep(named.path)._table)
        example = 'changes={"drive.frequency": "70 Hz"}'
        raise input_error(
            "compare",
            f"expected a second run or case, or changes, such as {example}",
            "expected a second run, or changed values (--set KEY=VALUE)",
        )
    references = [
        find(first, out),
        find(first if second is None else second, out, changes),
    ]
    return compare_runs(*apply_all(_side, references))


def _side(named: Reference) -> ComparedRun:
    """A side of a comparison: a run or a case, with the words that name it."""
    case = named.case
    directory = named.finished_run
    is_run = named.kind == "run" and not named.means_case
    name = directory.name if directory and is_run else str(named.given)
    changes = [f"{key}={written(value)}" for key, value in named.changes.items()]
    draws = draws_of(directory) if directory else None
    origins = None if is_run else case.origins
    return ComparedRun(" ".join([name, *changes]), case, directory, draws, origins)


def climb(
    references: Sequence[Given | InDirectory | Reference],
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
    *,
    within: float | None = None,
    to: str | Path | None = None,
) -> list[dict[str, Any]]:
    """Measure probability, rate and speed of climbs in piles, with confidence intervals.

    A climb is the rise of a cluster of beads, free of the pile, along a wall
    (`walkers.postprocess.measure.clusters`). Runs of a sweep that differ in nothing but their seed
    are a condition; a run by itself is another one. Unfinished points of a sweep are left out, with
    a warning.

    Parameters
    ----------
    references
        Sweeps, runs or cases of piles, named as for `load`.
    out
        Folder of the run directories.
    changes
        Other values of the cases, by dotted keys.
    within
        Count climbs up to this time of the drive, s. None: count all climbs; the probability is
        then that of a climb before the end of the shortest run without one, or before the end of
        the longest run if all runs have climbs.
    to
        Also write the figure (.png, .svg, .pdf) or the table (.csv) to this file.

    Returns
    -------
    list of dict
        Numbers of each condition in SI units, as `walkers.sweeps.climbing.summarise_climbs` gives
        them, and its name, ``condition``.

    Raises
    ------
    InputError
        If a reference does not exist, a run is not one of a pile, or the file has another format.
    """
    check_limits("within", within, 0.0)
    if isinstance(references, (str, Path)):
        raise input_error(references, f'expected a list of names, such as ["{references}"]')
    place = _path(to)
    if place is not None:
        check_place(place, *(f".{form}" for form in FORMATS), ".csv")
    climbs = []
    runs = []
    for run_or_sweep in apply_all(lambda name: load(name, out, changes), references):
        for label, results in _conditions(run_or_sweep):
            words = []
            if len(references) > 1 or not label:
                words.append(run_or_sweep.directory.name)
            if label:
                words.append(label)
            climbs.append(summarise_climbs(results, within) | {"condition": ", ".join(words)})
            runs += [result.directory.name for result in results]
    if place is not None:
        write_climbs(climbs, runs, place)
    return climbs


def _conditions(run_or_sweep: Run | Sweep) -> Iterator[tuple[str, list[Results]]]:
    """The conditions of a sweep, with the results of their runs; a run is one condition.

    The label of a condition names its varied values. It is empty for a run, and for the condition
    of a sweep whose values at least half of the conditions have
    (`walkers.sweeps.climbing.conditions_in`).
    """
    directory = run_or_sweep.directory
    if isinstance(run_or_sweep, Run):
        yield "", [read_results(directory)]
        return
    table = run_or_sweep._table
    missing = len(table.frame) - len(table.finished)
    if missing:
        text = f"{missing} of {len(table.frame)} points are not finished and left out"
        warn_user(f"{directory.name}: {text}")
    for label, rows in conditions_in(table.frame):
        yield label, table.results_of(rows)


def calibrate(
    calibration: str | Path,
    out: str | Path = DEFAULT_OUT,
    *,
    jobs: int | None = None,
    progress: bool | None = None,
    engine: str | None = None,
) -> Outcome:
    """Calibrate unknown parameters to facts. An interrupted calibration continues.

    `walkers.calibration.report.write_outcome` writes tables and figures of the outcome.

    Parameters
    ----------
    calibration
        A calibration file, or the name of a shipped calibration.
    out
        Folder of the run directories.
    jobs
        Number of parallel decks; default: one per core.
    progress
        Show the progress; None: only in notebooks.
    engine
        Name or path of the binary; default: the installed one.

    Returns
    -------
    walkers.calibration.calibrate.Outcome
        The calibrated parameters, with what they predict.

    Raises
    ------
    InputError
        If the calibration or one of its cases cannot be used.
    """
    from walkers.calibration import calibrate
    from walkers.calibration.file import load_calibration

    check_text_or_path("out", out)
    check_limits("jobs", jobs, 1, whole=True)
    return calibrate.calibrate(
        load_calibration(calibration),
        Path(out),
        SweepOptions(jobs),
        progress=progress,
        engine=engine,
    )


def predict(
    case: Given | InDirectory | Reference,
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
) -> dict[str, Any]:
    """Predict the motion of the dimer of a case by the theory.

    Parameters
    ----------
    case
        A case (resolved, tables, file or shipped name), or the name or directory of a run.
    out
        Folder of the run directories.
    changes
        Other values of the case, by dotted keys.

    Returns
    -------
    dict
        Numbers in SI units, as `walkers.theory.prediction.predict` lists them. ``outside`` says
        where the case is outside of the range of the paper's measurements, or None. ``engine`` is
        the result of the finished run of the case, or None.

    Raises
    ------
    InputError
        If the case cannot be used, or the theory does not apply to it.
    """
    from walkers.theory import prediction
    from walkers.theory.paper_range import outside_of_the_paper

    named = find(case, out, changes)
    try:
        predicted = prediction.predict(named.case)
    except prediction.NotApplicable as error:
        raise InputError(named.case.name, [Problem(error.key, None, error.reason)]) from error
    predicted["outside"] = outside_of_the_paper(named.case)
    predicted["engine"] = None
    if named.finished_run:
        with suppress(InputError):  # the result cannot be read
            predicted["engine"] = Run(named.finished_run, requested=named.case).result.as_dict()
    return predicted
