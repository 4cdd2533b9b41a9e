"""Wet granular walkers, simulated with LIGGGHTS.

`load_case` reads a case. `run` and `sweep` run a case and a sweep, as the commands do. `load` finds
runs and sweeps. A `Run` or a `Sweep` has methods that plot, film, report and export. Errors derive
from `WalkersError`: an `InputError` is a mistake of the call or of a file, an `EngineFailure` one
of a run.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from walkers.api import (
        Run,
        Sweep,
        calibrate,
        climb,
        compare,
        draw_start,
        load,
        predict,
        run,
        sweep,
    )
    from walkers.calibration.calibrate import CalibrationStopped
    from walkers.errors import InputError, InputErrors, WalkersError
    from walkers.extras import ExtraMissing
    from walkers.inputs.bridge_laws import ExecutedLawWarning
    from walkers.inputs.new import new
    from walkers.inputs.reading import load_case
    from walkers.postprocess.measure.dump import DumpError
    from walkers.runner.failures import (
        AuditFailed,
        BeadsLost,
        BeadsOverTheTop,
        BlowUp,
        ContactModelMissing,
        DiskFull,
        EngineDiffers,
        EngineError,
        EngineFailure,
        EngineKilled,
        EngineMissing,
        EngineNeverStarted,
        EngineSilent,
        FileTooLarge,
        LogTooLong,
        MissingFrames,
        OtherEngine,
        OutputGone,
        ProgramDiffers,
        RunBusy,
        TimeLimitExceeded,
        UnauditedEngineWarning,
        WalkersMet,
    )
    from walkers.runner.manifest import FileChanged
    from walkers.sweeps.left_out import LeftOutWarning
    from walkers.sweeps.scheduler import SweepReplacedWarning
    from walkers.sweeps.workers import SweepStopped

__all__ = [
    "AuditFailed",
    "BeadsLost",
    "BeadsOverTheTop",
    "BlowUp",
    "CalibrationStopped",
    "ContactModelMissing",
    "DiskFull",
    "DumpError",
    "EngineDiffers",
    "EngineError",
    "EngineFailure",
    "EngineKilled",
    "EngineMissing",
    "EngineNeverStarted",
    "EngineSilent",
    "ExecutedLawWarning",
    "ExtraMissing",
    "FileChanged",
    "FileTooLarge",
    "InputError",
    "InputErrors",
    "LeftOutWarning",
    "LogTooLong",
    "MissingFrames",
    "OtherEngine",
    "OutputGone",
    "ProgramDiffers",
    "Run",
    "RunBusy",
    "Sweep",
    "SweepReplacedWarning",
    "SweepStopped",
    "TimeLimitExceeded",
    "UnauditedEngineWarning",
    "WalkersError",
    "WalkersMet",
    "calibrate",
    "climb",
    "compare",
    "draw_start",
    "load",
    "load_case",
    "new",
    "predict",
    "run",
    "sweep",
]

DEFAULT_OUT = Path(os.environ.get("WALKERS_RUNS") or "runs")
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
_NAMES_OF_MODULES = {
    "api": (
        "Run",
        "Sweep",
        "calibrate",
        "climb",
        "compare",
        "draw_start",
        "load",
        "predict",
        "run",
        "sweep",
    ),
    "calibration.calibrate": ("CalibrationStopped",),
    "errors": ("InputError", "InputErrors", "WalkersError"),
    "extras": ("ExtraMissing",),
    "inputs.bridge_laws": ("ExecutedLawWarning",),
    "inputs.new": ("new",),
    "inputs.reading": ("load_case",),
    "postprocess.measure.dump": ("DumpError",),
    "runner.failures": (
        "AuditFailed",
        "BeadsLost",
        "BeadsOverTheTop",
        "BlowUp",
        "ContactModelMissing",
        "DiskFull",
        "EngineDiffers",
        "EngineError",
        "EngineFailure",
        "EngineKilled",
        "EngineMissing",
        "EngineNeverStarted",
        "EngineSilent",
        "FileTooLarge",
        "LogTooLong",
        "MissingFrames",
        "OtherEngine",
        "OutputGone",
        "ProgramDiffers",
        "RunBusy",
        "TimeLimitExceeded",
        "UnauditedEngineWarning",
        "WalkersMet",
    ),
    "runner.manifest": ("FileChanged",),
    "sweeps.left_out": ("LeftOutWarning",),
    "sweeps.scheduler": ("SweepReplacedWarning",),
    "sweeps.workers": ("SweepStopped",),
}
"""The public names by the modules that define them."""


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """The public names and the packages, imported on first use.

    pydantic, jinja2 and numpy take time to load, which ``walkers --help`` does not need.
    """
    if name in _PACKAGES:
        return import_module(f"walkers.{name}")
    for module, names in _NAMES_OF_MODULES.items():
        if name in names:
            return getattr(import_module(f"walkers.{module}"), name)
    raise AttributeError(f"module 'walkers' has no attribute {name!r}")
