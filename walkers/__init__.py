"""Wet granular walkers, simulated with LIGGGHTS.

`load_case` reads a case. `run` and `sweep` run a case and a sweep, as the commands do. `load` finds
runs and sweeps. A `Run` or a `Sweep` has methods that plot, film, report and export.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from walkers.api import Run, Sweep, calibrate, climb, compare, load, predict, run, sweep
    from walkers.inputs.new import new
    from walkers.inputs.reading import load_case

__all__ = [
    "Run",
    "Sweep",
    "calibrate",
    "climb",
    "compare",
    "load",
    "load_case",
    "new",
    "predict",
    "run",
    "sweep",
]

DEFAULT_OUT = Path("runs")
"""Folder of runs and sweeps, unless the user names another one."""
RECORDS = {"run": "manifest.json", "sweep": "sweep.json", "calibration": "calibration.json"}
"""Files that identify directories; named here to avoid imports."""
_PACKAGES = (
    "physics",
    "inputs",
    "templates",
    "runner",
    "postprocess",
    "runs",
    "sweeps",
    "archive",
    "second_engine",
    "theory",
    "calibration",
)
"""Packages that are attributes of this one without an import by the user."""
_MODULES = {"load_case": "inputs.reading", "new": "inputs.new"}
"""Modules of the public names that are not in ``api``."""


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """The public names and the packages, imported on first use.

    pydantic, jinja2 and numpy take time to load, which ``walkers --help`` does not need.
    """
    if name in _PACKAGES:
        return import_module(f"walkers.{name}")
    if name not in __all__:
        raise AttributeError(f"module 'walkers' has no attribute {name!r}")
    module = _MODULES.get(name, "api")
    return getattr(import_module(f"walkers.{module}"), name)
