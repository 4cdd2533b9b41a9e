"""Run cases and sweeps, find their results, and draw, film, report and export them: the commands as functions."""

from __future__ import annotations

import shlex
import warnings
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from inspect import signature
from mimetypes import guess_type
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Literal

from walkers import DEFAULT_OUT
from walkers.errors import InputError, Problem, apply_all, check_utf8, expected_of, input_error
from walkers.files import read_json
from walkers.inputs.sweep import load_sweep
from walkers.postprocess.measure import results
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.measure.results import Results
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.drawing import FORMATS, check_place, save_figure
from walkers.postprocess.show.figures import plot_run
from walkers.postprocess.show.film_options import FilmOptions
from walkers.postprocess.show.films import render_film
from walkers.postprocess.show.report.page import REPORT_NAME
from walkers.postprocess.show.report.player import player_of
from walkers.postprocess.show.report.run import report_run, result_html
from walkers.postprocess.show.series import render_series
from walkers.progress import Progress, in_notebook, progress_of
from walkers.runner import run_directory
from walkers.runner.audit import check_audit
from walkers.runner.binary import find_engine
from walkers.runner.failures import RunBusy
from walkers.runs.by_hand import as_run, take_in
from walkers.runs.comparison import Comparison, Side, compare_runs
from walkers.runs.listing import run_text
from walkers.runs.making import make_runs, progress_at
from walkers.runs.names import (
    Changes,
    Given,
    Reference,
    find,
    is_begun,
    not_a_run,
    readable_case,
    refusing,
)
from walkers.runs.status import state_at, worst_status
from walkers.sweeps import table as of_points
from walkers.sweeps.accuracy import measure_accuracy
from walkers.sweeps.climbing import conditions_in, summarise_climbs
from walkers.sweeps.climbing_output import write_climbs
from walkers.sweeps.figure import column_of, figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.record import SweepRecord, read_sweep_record
from walkers.sweeps.report import report_sweep
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.site import load_site
from walkers.sweeps.spread import Spread, figures_of_spread, run_spread
from walkers.sweeps.workers import Failure

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import k3d
    import pandas as pd
    from matplotlib.figure import Figure

    from walkers.calibration.calibrate import Outcome
    from walkers.inputs.origins import Origin
    from walkers.inputs.tables.case import Case

Export = Literal["deck", "vtk", "lammps", "archive"]
EXPORTS = {
    "deck": "walkers.runs.by_hand:write_folder",
    "vtk": "walkers.postprocess.show.paraview:write_vtk",
    "lammps": "walkers.postprocess.show.lammps:write_trajectory",
    "archive": "walkers.archive.writing:write_archive",
}
"""Functions that write the forms of exports."""


# --- names ------------------------------------------------------------------------------------------------------------


def load(
    reference: Given | Reference, out: str | Path = DEFAULT_OUT, changes: Changes = None
) -> Run | Sweep:
    """Find a sweep, or a run, finished or not.

    `InputError` if it does not exist or cannot be read; `EngineFailure` if a case is given and no engine is installed.

    Parameters
    ----------
    reference
        The directory of a run or a sweep, its name in the folder ``out``, or a case (resolved, tables, file or shipped
        name), which means its run with the installed engine.
    changes
        Other values of the case, by dotted keys.

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
        results.read_results(run.directory)  # refuses a result that cannot be read
    return run


def _run_of_case(named: Reference) -> Run:
    """The run of a case, finished or begun; `InputError` if there is none."""
    case = named.case
    place = run_directory.run_place(case, find_engine(), named.folder)
    if run_directory.is_finished(place) or is_begun(place):
        return Run(place, requested=case)
    name = str(named.given) if isinstance(named.given, (str, Path)) else case.name
    settings = [f"--set {shlex.quote(f'{key}={value}')}" for key, value in named.changes.items()]
    command = " ".join(["walkers run", name, *settings])
    raise input_error(name, f"no finished run in {named.folder}; first do: {command}")


def directory_of(
    reference: str | Path, out: str | Path = DEFAULT_OUT, changes: Changes = None
) -> Path:
    """The directory that a user names, whatever it contains; for a case, the directory of its run."""
    named = find(reference, out, changes)
    return load(named).directory if named.means_case else named.path


# --- runs -------------------------------------------------------------------------------------------------------------


class Pictures(list[Path]):
    """Files of pictures, which a notebook shows."""

    def _repr_html_(self) -> str:
        """The contents of the files: a notebook keeps them. A PDF is shown by its name."""
        shown = (
            (escape(path.name), guess_type(path)[0], b64encode(path.read_bytes()).decode())
            for path in self
        )
        return "".join(
            f'<p><img alt="{name}" src="data:{kind};base64,{content}">'
            for name, kind, content in shown
        )


@dataclass(frozen=True)
class Run:
    """A run: finished, running, interrupted or failed. Its results raise `InputError` until it is finished.

    Attributes
    ----------
    directory
        The run directory. A run that is not finished is in the folder of this name with ``.incomplete`` appended.
    cached
        Whether the run existed before.
    requested
        The requested case; None: the case that made the run, whose numbers may have other sources.
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
        """The run itself; `InputError` if a file that describes it cannot be read."""
        readable_case(self.directory)
        return self

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``interrupted`` or ``failed``."""
        return worst_status([state_at(self.directory).status])

    @property
    def progress(self) -> Progress | None:
        """Progress of a running run, in any process; None between segments, and if it is not running."""
        return progress_at(self.directory) if run_directory.is_locked(self.directory) else None

    @property
    def finished_directory(self) -> Path:
        """The directory of a finished run; otherwise `InputError`."""
        if not run_directory.is_finished(self.directory):
            raise input_error(self.directory, f"the run is {self._state}")
        return self.directory

    @property
    def _files(self) -> Path:
        """The directory that holds the files now."""
        return (
            self.directory
            if run_directory.is_finished(self.directory)
            else run_directory.unfinished(self.directory)
        )

    @property
    def _state(self) -> str:
        """The status of an unfinished run, and how to continue it."""
        if (status := self.status) == "running":
            return f"running{f': {progress.text}' if (progress := self.progress) else ''}"
        failure = self._files / run_directory.FAILURE_NAME
        text = f": {read_json(failure).get('message')}" if failure.is_file() else ""
        return f"{status}{text}; continue it with: walkers run {self.directory}"

    @cached_property
    def case(self) -> Case:
        """The resolved case."""
        return run_directory.case_of(self._files)

    @property
    def origins(self) -> tuple[Origin, ...] | None:
        """Sources of the values of the requested case; None: of the case that made the run."""
        return None if self.requested is None else self.requested.origins

    @property
    def result(self) -> Results:
        """The result: numbers in SI units by name, with bands and numerical errors where these are measured."""
        return results.read_results(self.finished_directory, self.origins)

    @property
    def motion(self) -> Motion:
        """Positions, velocities and spins of all beads as arrays; also of an unfinished run."""
        return read_motion(self._files)

    @property
    def trajectory(self) -> pd.DataFrame:
        """One row per sample and walker, in SI units."""
        return self.table("trajectory")

    @property
    def walkers(self) -> pd.DataFrame:
        """One row per walker, in SI units."""
        return self.table("walkers")

    def table(self, name: str) -> pd.DataFrame:
        """A table of the run, see `walkers.postprocess.measure.tables.read_table`."""
        return read_table(self.finished_directory, name)

    def describe(self) -> str:
        """The result as text in mm, mm/s and degrees; of an unfinished run, its progress."""
        if not run_directory.is_finished(self.directory):
            return f"{self.directory.name}: {self._state}"
        return results.text(self.result, cached=self.cached)

    def _repr_html_(self) -> str:
        """The result in a notebook: a table with errors, units and warnings, and the parameters."""
        if not run_directory.is_finished(self.directory):
            return f"<p>{escape(self.describe())}</p>"
        return result_html(self.result, self.origins)

    def plot(
        self, to: str | Path | None = None, formats: str | Sequence[str] = ("png",)
    ) -> Pictures:
        """Draw the figures and return their files; see `walkers.postprocess.show.figures.plot_run`."""
        return Pictures(plot_run(self.finished_directory, _path(to), formats))

    def render(
        self, to: str | Path | None = None, *, images: int = 6, walker: int | None = None
    ) -> Pictures:
        """Render pictures at several times; see `walkers.postprocess.show.series.render_series`."""
        return Pictures(
            render_series(self.finished_directory, _path(to), images=images, walker=walker)
        )

    def film(
        self, to: str | Path | None = None, *, progress: bool | None = None, **options: Any
    ) -> Path:
        """Render a film with `walkers.postprocess.show.film_options.FilmOptions`, such as ``slowdown``."""
        with progress_of(self.case.name, progress) as advance:
            return render_film(
                self.finished_directory, _path(to), FilmOptions(**options), on_progress=advance
            )

    def view(self, *, height: int = 480) -> k3d.Plot:
        """An interactive 3-D view of the beads for a notebook, ``height`` pixels high.

        Examples
        --------
        >>> len(walkers.run("fig1b", tmp).view().objects)  # two beads, their necks, the floor, the lines on it
        5
        """
        return player_of(read_motion(self.finished_directory), height=height)[0]

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report, with the figure of the run's spread if it has one.

        See `walkers.postprocess.show.report.run.report_run`.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).report(tmp / "fig1b.html").name
        'fig1b.html'
        """
        figures = figures_of_spread(self.finished_directory)
        return report_run(self.finished_directory, _path(to), self.origins, figures=figures)

    def spread(
        self, points: int = 32, *, progress: bool | None = None, engine: str | None = None
    ) -> Spread:
        """Run the case with uncertain values drawn from their ranges; see `walkers.sweeps.spread.run_spread`."""
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

    def accuracy(
        self, *, progress: bool | None = None, engine: str | None = None
    ) -> dict[str, Any]:
        """Measure the numerical errors, for the result; see `walkers.sweeps.accuracy.measure_accuracy`.

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

    def export(self, form: Export, to: str | Path | None = None, **options: Any) -> Path:
        """Write the run for other programs; the functions of `EXPORTS` take the options, such as ``every``.

        ``to`` is a file, for ``vtk`` and ``deck`` a folder. None: in the run directory, for ``archive`` and ``deck`` in
        the current folder.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).export("lammps", tmp / "walk.lammpstrj", every=20).name
        'walk.lammpstrj'
        """
        write, place = writer_of(form, options), _path(to)
        if form == "deck":
            return write(
                as_run(self.case, self.directory), place or Path(f"{self.directory.name}-deck")
            )
        return write(self.finished_directory, place, **options)


def writer_of(form: str, options: Iterable[str] = ()) -> Callable[..., Path]:
    """The function of a form of `EXPORTS`; `InputError` if there is none, or it does not take one of the options."""

    def takes(name: str, option: str) -> bool:
        return option in signature(resolve_name(EXPORTS[name])).parameters

    if form not in EXPORTS:
        raise input_error("form", f"{form!r}: {expected_of(form, EXPORTS)}")
    for option in options:
        if not takes(form, option):
            raise input_error(
                option, f"is for --to {', '.join(name for name in EXPORTS if takes(name, option))}"
            )
    write: Callable[..., Path] = resolve_name(EXPORTS[form])
    return write


def _path(to: str | Path | None) -> Path | None:
    return None if to is None else Path(to)


def run(
    case: Case | str | Path,
    out: str | Path = DEFAULT_OUT,
    *,
    engine: str | None = None,
    force: bool = False,
    progress: bool | None = None,
    time_limit: float | None = None,
) -> Run:
    """Run a case unless a finished run exists. An interrupted run continues; a deck run by hand becomes a run.

    `InputError` if the case cannot be used; `EngineFailure` if the engine fails.

    Parameters
    ----------
    case
        A resolved case, a case file, the name of a shipped case, a run, by its name or directory, or the folder of a
        deck that was run by hand.
    out
        Folder of the run directories.
    engine
        Name or path of the binary (`walkers.runner.binary.find_engine`).
    force
        Run again. The old run is replaced when the new one is finished.
    progress
        Show the progress; None: only in notebooks.
    time_limit
        Limit of the wall time in s for each segment of the run.

    Examples
    --------
    >>> import walkers
    >>> one = walkers.run("fig1b", tmp)
    >>> round(1e3 * one.result["velocity"], 3)  # mm/s
    1.981
    >>> one.walkers[["facing", "steady"]].drop_duplicates("facing").to_dict("list")
    {'facing': [1, -1], 'steady': [True, True]}
    """
    named = find(case, out)
    if not force and (finished := finished_at(named)):
        return finished
    case, out = named.case, named.folder
    for text in (out.absolute(), case.name):
        check_utf8(text)
    binary = find_engine(engine)
    place = run_directory.run_place(case, binary, out)
    if run_directory.is_finished(place) and not force:
        return _measured(Run(place, requested=case))
    check_audit(binary)
    with progress_of(case.name, progress) as advance:
        runs = make_runs(
            [case], out, binary, force=force, on_progress=advance, time_limit=time_limit
        )
    if not runs:
        raise RunBusy("another process is still running this case", run_directory.unfinished(place))
    return Run(place, cached=not runs[place.name], requested=case)


def finished_at(named: Reference) -> Run | None:
    """The finished run with a name or a directory, also of a deck that was run by hand; None for a case."""
    if named.means_case or named.kind not in ("run", "deck"):
        return None
    if run_directory.is_deck_folder(named.path):
        take_in(named.path)
    return _measured(Run(named.path)) if run_directory.is_finished(named.path) else None


def case_to_run(named: tuple[Reference, Run | None]) -> Case:
    """The case of a name, or of the finished run that it means: a deck that was run by hand has no other."""
    reference, run = named
    return reference.case if run is None else run.case


def _measured(run: Run) -> Run:
    """The run; a finished run is measured again if its result or a table cannot be read."""
    if run_directory.is_finished(run.check().directory):
        with refusing(run.directory, "the run"):
            results.ensure_measured(run.directory)
    return run


# --- sweeps -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sweep:
    """A sweep in its directory, beside its runs; ``failures`` are points that failed in this call of `sweep`."""

    directory: Path
    failures: tuple[Failure, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        """Make a path of the name of a directory; `InputError` if it has no sweep."""
        object.__setattr__(self, "directory", Path(self.directory))
        _ = self._record

    def __repr__(self) -> str:
        """Name and numbers of points by status in a line."""
        return f"Sweep({self.summary().splitlines()[0]})"

    def summary(self) -> str:
        """The status of the points and their failures."""
        return of_points.describe_status(self._table.frame)

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``failed`` (some points) or ``interrupted`` (points are missing)."""
        return worst_status(self._table.frame["status"])

    @cached_property
    def runs(self) -> list[Run]:
        """The runs of all points, finished or not."""
        return [Run(self._record.out / name) for name in self._record.runs]

    def table(self) -> pd.DataFrame:
        """One row per point; see `walkers.sweeps.table.load_table`. Kept once all points are finished; see `refresh`."""
        return self._table.frame.copy()

    def refresh(self) -> Sweep:
        """Forget the table, so that it is read again: after runs of a finished sweep were measured again or removed."""
        self.__dict__.pop("_finished_table", None)
        return self

    @cached_property
    def _record(self) -> SweepRecord:
        return read_sweep_record(self.directory)

    @property
    def _table(self) -> of_points.SweepTable:
        """The table with its results, read again as long as points are not finished."""
        table: of_points.SweepTable | None = self.__dict__.get("_finished_table")
        if table is None:
            table = of_points.table_of(self._record)
            if len(table.finished) == len(table.frame):
                self.__dict__["_finished_table"] = table
        return table

    def describe(self) -> str:
        """The status of the points, their failures, and the table in mm, mm/s, nJ and degrees."""
        frame = self._table.frame
        return f"{of_points.describe_status(frame)}\n\n{of_points.short_text(frame.drop(columns='run'))}"

    def _repr_html_(self) -> str:
        """The table in a notebook."""
        return str(self.table()._repr_html_())  # type: ignore[operator]

    def figure(self, **options: Any) -> Figure:
        """A matplotlib figure of the table, with `walkers.sweeps.figure_options.FigureOptions`.

        See `walkers.sweeps.figure.figure_of`.

        Examples
        --------
        >>> walkers.sweep("fig4", tmp).figure(x="liquid.name", log="y").axes[0].get_yscale()
        'log'
        """
        if in_notebook():
            import matplotlib.pyplot as plt

            plt.switch_backend(
                plt.rcParams["backend"]
            )  # which tells the notebook how to show figures
        return _figure(self._table, options)

    def plot(self, to: str | Path | None = None, **options: Any) -> Pictures:
        """Plot the table to a file as in `figure`; by default in the sweep's directory, named after the column."""
        table = self._table
        place = _path(to) or self.directory / f"{column_of(table.frame, options.get('y'))}.png"
        check_place(place, *(f".{form}" for form in FORMATS))
        runs = [Path(run).name for run in table.finished["run"]]
        form = place.suffix.lower()[1:]
        return Pictures(
            save_figure(_figure(table, options), place, runs, form, str(table.frame.attrs["sweep"]))
        )

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report, by default ``report.html`` in the sweep's directory."""
        return report_sweep(self._table, _path(to) or self.directory / REPORT_NAME)

    def export(
        self, form: Export = "archive", to: str | Path | None = None, **options: Any
    ) -> Path:
        """Write the sweep and its runs as an ``archive``, the only form; see `Run.export`."""
        from walkers.archive.writing import write_archive

        if form != "archive":
            raise input_error(
                self.directory, f"is a sweep: expected one of its runs for {form}, or archive"
            )
        return write_archive(self.directory, _path(to), **options)


def _figure(table: of_points.SweepTable, options: Mapping[str, Any]) -> Figure:
    from walkers.theory.prediction import predicted_column

    chosen = FigureOptions(**options)
    return figure_of(table, chosen, predicted_column if chosen.theory else None)


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
    """Run the missing points of a sweep on this machine or a cluster; the ``status`` in its table marks failed points.

    `InputError` if the sweep or one of its points cannot be used.

    Parameters
    ----------
    sweep
        A sweep file, the name of a shipped sweep, or the tables of a sweep file.
    jobs
        Number of parallel decks; default: one per core.
    changes
        Values that replace those in ``[set]``, by dotted keys.
    site
        The site file of a cluster, TOML or Python; see `walkers.sweeps.site.load_site`.
    executor
        Runs the decks instead of threads of this process, ``jobs`` at once; all of its workers must see the folder.
    time_limit
        Limit of the wall time in s for each deck.
    spread
        Number of runs of each finished point with its uncertain values drawn from their ranges, for bands along the
        sweep (columns such as ``velocity_low``); 0: none.
    out, progress, engine
        See `run`.

    Examples
    --------
    >>> walkers.sweep("fig4", tmp).table()[["liquid.name", "status"]].to_dict("list")
    {'liquid.name': ['Si AK5', 'Si AK10'], 'status': ['finished', 'finished']}
    """
    points = load_sweep(sweep, changes)
    options = SweepOptions(jobs, load_site(Path(site)) if site else None, executor, time_limit)
    folder = Path(out).resolve() if site else Path(out)
    with progress_of(points.name, progress) as advance:
        record, failures = run_sweep(points, folder, options, engine=engine, on_progress=advance)
    failed = {failure.point for failure in failures}
    for number, case in enumerate(points.cases(), 1) if spread else ():
        if number - 1 not in failed:
            with progress_of(
                f"{points.name}, spread {number} of {len(points.rows)}", progress
            ) as advance:
                drawn = run_spread(
                    case, folder, options, points=spread, engine=engine, on_progress=advance
                )
            failures += drawn.failures
    return Sweep(record.directory, tuple(failures))


# --- several runs -----------------------------------------------------------------------------------------------------


def compare(
    first: str | Path,
    second: str | Path | None = None,
    out: str | Path = DEFAULT_OUT,
    changes: Mapping[str, Any] | None = None,
) -> Comparison:
    """Compare two runs or cases, named as for `load`, in parameters and results.

    The ``changes`` are of the second case, which by default is the first.
    """
    if second is None and not changes:
        raise input_error(first, "expected a second run, or changed values (--set KEY=VALUE)")

    def side(name: str | Path, changes: Changes) -> Side:
        named = find(name, out, changes)
        case = named.case
        directory = named.finished_run
        is_run = named.kind == "run" and not named.means_case
        words = [directory.name if directory and is_run else str(name)]
        words += [f"{key}={value}" for key, value in named.changes.items()]
        return Side(" ".join(words), case, directory)

    named = ((first, None), (first if second is None else second, changes))
    return compare_runs(*apply_all(lambda of: side(*of), named))


def climb(
    references: Sequence[str | Path],
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
    *,
    within: float | None = None,
    to: str | Path | None = None,
) -> list[dict[str, Any]]:
    """Probability, rate and speed of climbs in piles for each condition, with confidence intervals.

    Runs of a sweep that differ in nothing but their seed are a condition; a run by itself is another one.

    Parameters
    ----------
    references
        Sweeps, runs or cases of piles; further arguments as of `load`.
    within
        Count climbs up to this time of the drive, s; None: the end of the shortest run without a climb.
    to
        Also write the figure (.png, .svg, .pdf) or the table (.csv) to this file.
    """
    if to is not None:
        check_place(Path(to), *(f".{form}" for form in FORMATS), ".csv")
    climbs, runs = [], []
    for run_or_sweep in apply_all(lambda name: load(name, out, changes), references):
        directory = run_or_sweep.directory
        if isinstance(run_or_sweep, Sweep):
            table = run_or_sweep._table
            left = len(table.frame) - len(table.finished)
            if left:
                text = f"{left} of {len(table.frame)} points are not finished and left out"
                warnings.warn(f"{directory.name}: {text}", stacklevel=2)
            conditions = [
                (label, table.results_of(rows)) for label, rows in conditions_in(table.frame)
            ]
        else:
            conditions = [("", [results.read_results(directory)])]
        for label, of_piles in conditions:
            words = [directory.name] if len(references) > 1 or not label else []
            words += [label] if label else []
            climbs.append(summarise_climbs(of_piles, within) | {"condition": ", ".join(words)})
            runs += [result.directory.name for result in of_piles]
    if to is not None:
        write_climbs(climbs, runs, Path(to))
    return climbs


def calibrate(
    calibration: str | Path,
    out: str | Path = DEFAULT_OUT,
    *,
    jobs: int | None = None,
    progress: bool | None = None,
    engine: str | None = None,
) -> Outcome:
    """Calibrate unknown parameters to facts; an interrupted calibration continues. Arguments: see `sweep`.

    `walkers.calibration.report.write_outcome` writes tables and figures of the outcome.
    """
    from walkers.calibration import calibrate
    from walkers.calibration.file import load_calibration

    return calibrate.calibrate(
        load_calibration(calibration),
        Path(out),
        SweepOptions(jobs),
        progress=progress,
        engine=engine,
    )


def predict(case: Given, out: str | Path = DEFAULT_OUT, changes: Changes = None) -> dict[str, Any]:
    """The prediction of the theory for a case, SI units, under ``engine`` with the result of its run if there is one.

    See `walkers.theory.prediction.predict`.
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
        with suppress(InputError):  # a result that cannot be read
            predicted["engine"] = Run(named.finished_run, requested=named.case).result.as_dict()
    return predicted
