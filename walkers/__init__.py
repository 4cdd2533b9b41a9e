"""Wet granular walkers, simulated with LIGGGHTS.

`load_case` reads a case. `run` runs it and gives a `Run`; `find_run` finds a finished run. `sweep` runs all points of a
sweep and gives its table; `load` reads a table. `sweep_figure` and `plot_sweep` draw a table, `report` writes an HTML
file. `FilmOptions` describes a film for `Run.film`.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.exporting import exporting

if TYPE_CHECKING:
    from walkers.inputs.reading import load_case
    from walkers.pipeline import Run, find_run, report, run, sweep
    from walkers.plotting import plot_sweep, sweep_figure
    from walkers.postprocess.films import FilmOptions
    from walkers.sweeps.table import load

__all__ = [
    "FilmOptions",
    "Run",
    "find_run",
    "load",
    "load_case",
    "plot_sweep",
    "report",
    "run",
    "sweep",
    "sweep_figure",
]

DEFAULT_OUT = Path("runs")
RECORDS = {"run": "manifest.json", "sweep": "sweep.json", "calibration": "calibration.json"}
"""Files by which directories are known, without the imports of those that write them."""
_PACKAGES = (
    *("physics", "inputs", "templates", "runner", "postprocess"),
    *("sweeps", "archive", "check", "theory", "paper", "calibration"),
)
_exported = exporting(
    "walkers",
    **{
        "pipeline": ["Run", "find_run", "report", "run", "sweep"],
        "plotting": ["plot_sweep", "sweep_figure"],
        "postprocess.films": ["FilmOptions"],
        "inputs.reading": ["load_case"],
        "sweeps.table": ["load"],
    },
)


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """The public names and the packages, imported when they are first asked for."""
    return import_module(f"walkers.{name}") if name in _PACKAGES else _exported(name)
