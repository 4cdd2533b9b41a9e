"""Failures of runs.

The engine reports errors unreliably (an ERROR line without an exit status, an exit status without a
line, silence). Failures are therefore detected from its output, mostly in `walkers.runner.launch`.
"""

from __future__ import annotations

import resource
from pathlib import Path
from typing import ClassVar, Literal

from walkers.errors import WalkersError

Affected = Literal["", "every point", "all at first", "one point"]
"""Which points of a sweep a failure affects.

Every point; all at first, until a point is finished; one point; or empty if this is not certain.
"""

AUDITED_VERSION = "LIGGGHTS-PUBLIC 3.8.0"
"""The version of the engine for which the contact model is written, as its banner prints it.

It is the only version that is audited: ``walkers check engine`` compares its forces on a few beads
with the expected ones.
"""


class EngineFailure(WalkersError):
    """Base class of the failures of a run.

    Attributes
    ----------
    message
        What failed, without the directory.
    directory
        Where the files of the failed run are; None if there are none.
    lost
        Number of beads that left the simulation box.

    affects
        Which points of a sweep such a failure affects; the same for all failures of a class.
    """

    affects: ClassVar[Affected] = ""

    def __init__(self, message: str, directory: Path | None = None, *, lost: int = 0) -> None:
        self.message = message
        self.directory = directory
        self.lost = lost
        super().__init__(f"{message} (see {directory})" if directory else message)

    def __init_subclass__(cls, affects: Affected = "") -> None:
        """Note what the failures of a class, and of the classes that derive from it, affect."""
        cls.affects = affects or cls.affects


class EngineMissing(EngineFailure, affects="every point"):
    """No liggghts was found. Detected before anything is written."""


class OtherEngine(EngineFailure, affects="every point"):
    """The contact model was written for another version of the engine."""

    def __init__(self, path: Path, version: str) -> None:
        super().__init__(
            f"{path} is {version}: decks need a contact model that is written for "
            f"{AUDITED_VERSION}, as Debian packages it"
        )


class ContactModelMissing(EngineFailure, affects="every point"):
    """The contact model cannot be compiled. Detected before the engine starts."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"no contact model for the engine: {reason}")


class EngineDiffers(EngineFailure, affects="every point"):
    """A worker of a sweep has another engine than the process that started the sweep."""


class ProgramDiffers(EngineFailure, affects="every point"):
    """A worker gives a run another name than the process that started the sweep.

    Then the resolved cases or the decks differ.
    """


class EngineNeverStarted(EngineFailure, affects="all at first"):
    """The engine ended before it printed its version, also when it was started again."""


class EngineError(EngineFailure):
    """The engine stopped with an ERROR line, which is quoted, or only with a non-zero status."""


class EngineKilled(EngineFailure):
    """A signal ended the engine: a crash (SIGSEGV) or a kill."""


class EngineSilent(EngineFailure):
    """The engine wrote nothing to its log and dump for too long, and was stopped."""


class LogTooLong(EngineFailure):
    """The engine's log exceeded its limit, at which it is cut; the engine was stopped."""


class MissingFrames(EngineFailure):
    """The engine ended normally, but a dump is too short."""


class BeadsLost(EngineFailure, affects="one point"):
    """Beads left the simulation box.

    Detected from the number of atoms, which the engine prints several times a cycle.
    """


class BeadsOverTheTop(BeadsLost):
    """Beads left the simulation box at its top.

    Before, the bead closest to a side of the box was closest to its top.
    """


class BlowUp(EngineFailure, affects="one point"):
    """A bead is faster than the drive can make it, or its speed is NaN.

    The usual cause is a time step that is too long.
    """


class TimeLimitExceeded(EngineFailure, affects="one point"):
    """The run exceeded its time limit."""


class DiskFull(EngineFailure, affects="every point"):
    """The disk has no space for the output.

    Detected before the run from the known size of the dump, or while the engine writes.
    """

    def __init__(self, needed: int | None, free: int, directory: Path) -> None:
        missing = ""
        if needed is not None:
            missing = f"{needed / 1e6:.3g} MB are still to be written, "
        super().__init__(f"disk full: {missing}{free / 1e6:.3g} MB are free", directory)


class FileTooLarge(EngineFailure, affects="every point"):
    """A file of the run exceeds the limit of the shell (``ulimit -f``) or of the file system."""

    def __init__(self, directory: Path) -> None:
        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        if limit == resource.RLIM_INFINITY:
            text = "a file is larger than the file system allows: choose a folder on another one"
        else:
            text = (
                f"a file is larger than the limit of {limit / 1e3:g} kB (ulimit -f): "
                "raise it with ulimit -f unlimited"
            )
        super().__init__(text, directory)


class OutputGone(EngineFailure, affects="every point"):
    """The directory of a run or a sweep was removed during the run."""

    def __init__(self, directory: Path) -> None:
        super().__init__(f"{directory} was removed while it was written")


class WalkersMet(EngineFailure, affects="one point"):
    """Walkers of different cases in a shared deck came close to each other.

    Detected when the output is split.
    """


class RunBusy(EngineFailure, affects="one point"):
    """Another process is writing into this run, perhaps an engine whose launcher was killed."""


class AuditFailed(EngineFailure, affects="every point"):
    """The engine's binary failed its audit: its results cannot be trusted."""


class UnauditedEngineWarning(UserWarning):
    """The engine's binary was never audited."""
