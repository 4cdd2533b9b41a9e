"""Runs and sweeps in Python: their results, and what can be made from them."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from walkers.errors import refused
from walkers.finding import files_of
from walkers.runner.directory import FAILURE_NAME, case_of, is_finished, is_locked
from walkers.runner.files import read_json

if TYPE_CHECKING:
    import k3d
    import pandas as pd
    from matplotlib.figure import Figure

    from walkers.inputs.case import Case
    from walkers.inputs.origins import Origin
    from walkers.postprocess.films import FilmOptions
    from walkers.postprocess.motion import Motion
    from walkers.runner.launch import Progress
    from walkers.sweeps.table import SweepRecord

Export = Literal["deck", "vtk", "paraview", "xyz", "lammps", "archive"]


class Pictures(list[Path]):
    """Paths of pictures; a notebook shows the pictures."""

    def _repr_html_(self) -> str:
        """The PNGs below each other; other files by name."""
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
    """A run: finished, running, interrupted or failed. Its results raise `InputError` until it is finished.

    Attributes
    ----------
    directory
        The run directory. A run that is not finished is in the folder of this name with ``.incomplete`` appended.
    cached
        Whether the run existed before.
    origins
        Sources of the values of the requested case; None: of the case that made the run. The same number may be given
        in one case and come from the library in another.
    """

    directory: Path
    cached: bool = True
    origins: tuple[Origin, ...] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Make a path of the name of a directory."""
        object.__setattr__(self, "directory", Path(self.directory))

    def __repr__(self) -> str:
        """Directory, status and result in a line."""
        from walkers.sweeps.folder import run_text

        return f"Run({self.directory}: {run_text(self._files)})"

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``interrupted`` or ``failed``."""
        from walkers.sweeps.table import state_at, worst_status

        return worst_status([state_at(self.directory).status])

    @property
    def progress(self) -> Progress | None:
        """Progress of a running run, in any process; None between segments, and if it is not running."""
        from walkers.sweeps.making import progress_at

        return progress_at(self.directory) if is_locked(self.directory) else None

    @property
    def finished_directory(self) -> Path:
        """The directory of a finished run; otherwise `InputError`."""
        if not is_finished(self.directory):
            raise refused(self.directory, f"the run is {self._state}")
        return self.directory

    @property
    def _files(self) -> Path:
        """The directory that holds the files now."""
        return files_of(self.directory)

    @property
    def _state(self) -> str:
        """The status of an unfinished run, and what to do."""
        if (status := self.status) == "running":
            return f"running{f': {progress}' if (progress := self.progress) else ''}"
        failure = self._files / FAILURE_NAME
        text = f": {read_json(failure).get('message')}" if failure.is_file() else ""
        return f"{status}{text}; continue it with: walkers run {self.directory}"

    @property
    def case(self) -> Case:
        """The resolved case."""
        return case_of(self._files)

    @property
    def result(self) -> dict[str, Any]:
        """The result in SI units."""
        from walkers.postprocess.analysis import current_result
        from walkers.postprocess.uncertainty import rests_on

        result = current_result(self.finished_directory)
        return result if self.origins is None else {**result, "rests_on": rests_on(self.origins)}

    @property
    def motion(self) -> Motion:
        """Positions, velocities and spins of all beads as arrays; also of an unfinished run."""
        from walkers.postprocess.motion import read_motion

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
        """A table of the run, see `walkers.postprocess.tables.read_table`."""
        from walkers.postprocess.tables import read_table

        return read_table(self.finished_directory, name)

    def describe(self) -> str:
        """The result as text in mm, mm/s and degrees; of an unfinished run, its progress."""
        from walkers.postprocess.analysis import describe_result

        if not is_finished(self.directory):
            return f"{self.directory.name}: {self._state}"
        return describe_result(self.directory, self.result, cached=self.cached)

    def _repr_html_(self) -> str:
        """The result in a notebook: a table with errors, units and warnings, and the parameters."""
        from walkers.postprocess.report.run import result_html

        if not is_finished(self.directory):
            return f"<p>{escape(self.describe())}</p>"
        return result_html(self.directory, self.result, self.origins)

    def plot(self, to: str | Path | None = None, formats: str | Sequence[str] = ("png",)) -> Pictures:
        """Draw the figures and return their paths; see `walkers.postprocess.analysis.plot_run`."""
        from walkers.postprocess.analysis import plot_run

        return Pictures(plot_run(self.finished_directory, _path(to), formats))

    def render(self, to: str | Path | None = None, *, images: int = 6, walker: int | None = None) -> Pictures:
        """Render the first of independent walkers, all beads, or the walker with a number.

        See `walkers.postprocess.series.render_series`.
        """
        from walkers.postprocess.series import render_series

        walker = 0 if walker is None and self.case.apart else walker
        return Pictures(render_series(self.finished_directory, _path(to), images=images, walker=walker))

    def film(
        self,
        to: str | Path | None = None,
        options: FilmOptions | None = None,
        *,
        on_progress: Callable[[int, int], None] | None = None,
    ) -> Path:
        """Render a film; see `walkers.postprocess.films.render_film`."""
        from walkers.postprocess.films import render_film

        return render_film(self.finished_directory, _path(to), options, on_progress=on_progress)

    def view(self, *, height: int = 480) -> k3d.Plot:
        """An interactive 3-D view of the beads for a notebook, ``height`` pixels high.

        Examples
        --------
        >>> len(walkers.run("fig1b", tmp).view().objects)  # two beads, the floor, the lines on it
        4
        """
        from walkers.postprocess.report.player import player_of

        return player_of(self.finished_directory, height=height).plot

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report; see `walkers.postprocess.report.run.report_run`.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).report(tmp / "fig1b.html").name
        'fig1b.html'
        """
        from walkers.postprocess.report.run import report_run

        return report_run(self.finished_directory, _path(to), self.origins)

    def export(self, form: Export, to: str | Path | None = None, **options: Any) -> Path:
        """Write the run for other programs.

        Parameters
        ----------
        form
            ``vtk`` or ``paraview`` (`walkers.postprocess.paraview`), ``xyz`` or ``lammps``
            (`walkers.postprocess.trajectory_files`), ``archive`` (`walkers.archive.writing`), ``deck``
            (`walkers.sweeps.by_hand.write_folder`).
        to
            The file, or the folder for ``vtk``, ``paraview`` and ``deck``. None: in the run directory, for ``archive``
            and ``deck`` in the current folder.
        options
            Arguments of these functions, such as ``every``; for an archive, the fields of its ``ArchiveOptions``.

        Examples
        --------
        >>> walkers.run("fig1b", tmp).export("xyz", tmp / "walk.xyz", every=20).name
        'walk.xyz'
        """
        place = _path(to)
        if form == "deck":
            from walkers.sweeps.by_hand import as_run, write_folder

            return write_folder(as_run(self.case, self.directory), place or Path(f"{self.directory.name}-deck"))
        if form == "archive":
            from walkers.archive.writing import ArchiveOptions, write_archive

            return write_archive(self.finished_directory, place, ArchiveOptions(**options))
        if form in ("vtk", "paraview"):
            from walkers.postprocess.paraview import SCRIPT, write_vtk

            collection = write_vtk(self.finished_directory, place, **options)
            return collection if form == "vtk" else collection.with_name(SCRIPT)
        from walkers.postprocess.trajectory_files import SUFFIXES, write_trajectory

        place = place or self.finished_directory / f"trajectory{SUFFIXES[form][0]}"
        return write_trajectory(self.finished_directory, place, form, **options)


@dataclass(frozen=True)
class Sweep:
    """A sweep: its points, their runs, and the table of results.

    Attributes
    ----------
    directory
        The sweep directory; the runs are in the same folder.
    """

    directory: Path
    _record: SweepRecord = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Read the record of the sweep; `InputError` if the directory is none of a sweep."""
        from walkers.sweeps.table import read_record

        object.__setattr__(self, "directory", Path(self.directory))
        object.__setattr__(self, "_record", read_record(self.directory))

    def __repr__(self) -> str:
        """Name and numbers of points by status in a line."""
        from walkers.sweeps.table import describe_status

        return f"Sweep({describe_status(self._record).splitlines()[0]})"

    @property
    def status(self) -> str:
        """``finished``, ``running``, ``failed`` (some points) or ``interrupted`` (points are missing)."""
        from walkers.sweeps.table import checked_states, worst_status

        return worst_status(state.status for state in checked_states(self._record))

    @property
    def runs(self) -> list[Run]:
        """The runs of all points, finished or not."""
        return [Run(self._record.out / name) for name in self._record.runs]

    def table(self) -> pd.DataFrame:
        """One row per point; see `walkers.sweeps.table.load`."""
        from walkers.sweeps.table import load

        return load(self.directory)

    def describe(self) -> str:
        """The status of the points, their failures, and the table in mm, mm/s, nJ and degrees."""
        from walkers.sweeps.table import describe_status, short_text

        return f"{describe_status(self._record)}\n\n{short_text(self.table().drop(columns='run'))}"

    def _repr_html_(self) -> str:
        """The table in a notebook."""
        return str(self.table()._repr_html_())  # type: ignore[operator]

    def figure(self, **choices: Any) -> Figure:
        """A matplotlib figure of the table; see `walkers.plotting.sweep_figure`."""
        from walkers.plotting import sweep_figure

        return sweep_figure(self.directory, **choices)

    def plot(self, to: str | Path | None = None, **choices: Any) -> Pictures:
        """Plot the table to a file; see `walkers.plotting.plot_sweep`."""
        from walkers.plotting import plot_sweep

        return Pictures([plot_sweep(self.directory, to, **choices)])

    def report(self, to: str | Path | None = None) -> Path:
        """Write a self-contained HTML report; see `walkers.sweeps.report.report_sweep`."""
        from walkers.sweeps.report import report_sweep

        return report_sweep(self.directory, _path(to))

    def export(self, form: Export = "archive", to: str | Path | None = None, **options: Any) -> Path:
        """Write the sweep and its runs as an ``archive``, the only form; see `Run.export`."""
        from walkers.archive.writing import ArchiveOptions, write_archive

        if form != "archive":
            raise refused(self.directory, f"is a sweep: expected one of its runs for {form}, or archive")
        return write_archive(self.directory, _path(to), ArchiveOptions(**options))


def _path(to: str | Path | None) -> Path | None:
    return None if to is None else Path(to)
