"""Wet granular walkers, simulated with LIGGGHTS: the one public name of the project.

`load_case` reads a case, `run` takes it to its result as ``walkers run`` does, `find_run` finds a finished run, `sweep`
makes all points of a sweep, `load` gives its table, `plot_sweep` and `sweep_figure` its figure, `report` writes a file
to mail. The folders of the project are packages below: `physics` (laws), `inputs` (cases), `templates` (decks),
`runner` (run directories), `postprocess` (what runs mean), and on them `sweeps`, `audit`, `theory`, `paper` and
`calibration`.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from walkers.pipeline import DEFAULT_OUT, Run, find_run, run
from walkers.plotting import plot_sweep, sweep_figure
from walkers.reports import report

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case

__all__ = ["Run", "find_run", "load", "load_case", "plot_sweep", "report", "run", "sweep", "sweep_figure"]


_PACKAGES = (
    *("physics", "inputs", "templates", "runner", "postprocess"),
    *("sweeps", "archive", "audit", "theory", "paper", "calibration"),
)


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> ModuleType:
    """The packages, imported when they are first asked for."""
    if name in _PACKAGES:
        return import_module(f"walkers.{name}")
    raise AttributeError(f"module 'walkers' has no attribute {name!r}")


def load_case(case: str | Path, changes: Mapping[str, Any] | None = None) -> Case:
    """Read and resolve a case, with other values than its file's; see `walkers.inputs.reading.load_case`.

    Examples
    --------
    >>> walkers.load_case("climber").boundary.shape
    'plane'
    >>> walkers.load_case("fig1b", {"drive.frequency": "70 Hz"}).drive.frequency
    70.0
    """
    from walkers.inputs.reading import load_case

    return load_case(case, changes)


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
    from walkers.progress import progress_of_sweep, shown_if
    from walkers.sweeps.run import run_sweep
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here

    read = load_sweep(sweep, changes)
    with shown_if(progress, progress_of_sweep(read.name)) as advance:
        record, _ = run_sweep(read, Path(out), Options(jobs or cores_here()), on_progress=advance)
    return load(record.directory)


def load(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep, one row per point; see `walkers.sweeps.table.load`."""
    from walkers.sweeps.table import load

    return load(directory)
