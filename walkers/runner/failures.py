"""Failures of runs.

The engine's own signs are unreliable (an ERROR line without an exit status, an exit status without a line, silence), so
each failure is recognised by what it leaves behind, mostly in `walkers.runner.launch`.
"""

from __future__ import annotations

from pathlib import Path

from walkers.inputs.errors import WalkersError
from walkers.templates.engine import AUDITED_VERSION


class EngineFailure(WalkersError):
    """Root of the failures of a run, which ``failure.json`` tells by the names of their classes.

    ``directory`` is where its remains are, ``lost`` the number of beads lost.
    """

    def __init__(self, message: str, directory: Path | None = None, *, lost: int = 0) -> None:
        self.directory, self.lost = directory, lost
        super().__init__(f"{message} (see {directory})" if directory else message)


class EngineMissing(EngineFailure):
    """There is no liggghts to run. Seen before anything is written."""


class OtherEngine(EngineFailure):
    """The engine is another version than the one that the contact model was written for."""

    def __init__(self, path: Path, version: str) -> None:
        needed = f"decks need a contact model that is written for {AUDITED_VERSION}, as Debian packages it"
        super().__init__(f"{path} is {version}: {needed}")


class ContactModelMissing(EngineFailure):
    """The contact model that decks need cannot be compiled. Seen before the engine starts."""

    def __init__(self, why: str) -> None:
        super().__init__(f"no contact model for the engine: {why}")


class EngineDiffers(EngineFailure):
    """A worker of a sweep has another engine than the one that the sweep was started with."""


class ProgramDiffers(EngineFailure):
    """A worker of a sweep names runs otherwise than where it was started: resolved cases or decks differ."""


class EngineNeverStarted(EngineFailure):
    """The engine ended before it named its version: nothing was done. It is tried again before this is raised."""


class EngineError(EngineFailure):
    """The engine stopped with an ERROR line, which is quoted, or with a non-zero status and none."""


class EngineKilled(EngineFailure):
    """A signal ended the engine: a crash of its own (SIGSEGV), or somebody's kill."""


class EngineSilent(EngineFailure):
    """The engine wrote nothing to its log and dump for too long, and was stopped."""


class LogTooLong(EngineFailure):
    """The engine's log exceeded its limit, and the engine was stopped. The log is truncated there."""


class MissingFrames(EngineFailure):
    """The engine ended normally, but a dump is too short."""


class BeadsLost(EngineFailure):
    """Beads left the simulation box. Seen in the number of atoms, which the engine prints every cycle."""


class BeadsOverTheTop(BeadsLost):
    """The beads that were lost were last seen nearest to the top of the box: climbers that outgrow a container."""


class BlowUp(EngineFailure):
    """A bead is faster than the drive can make it, or its speed is NaN; usually the time step is too long."""


class TimeLimitExceeded(EngineFailure):
    """The run took longer than it was allowed to."""


class DiskFull(EngineFailure):
    """No room for the output. Seen beforehand from the known size of the dump, or while the engine writes."""

    def __init__(self, needed: int | None, free: int, directory: Path) -> None:
        wanted = "" if needed is None else f"{needed / 1e6:.3g} MB are still to be written, "
        super().__init__(f"disk full: {wanted}{free / 1e6:.3g} MB are free", directory)


class OutputGone(EngineFailure):
    """The directory of a run or a sweep was removed during the run."""

    def __init__(self, directory: Path) -> None:
        super().__init__(f"{directory} was removed while it was written")


class WalkersMet(EngineFailure):
    """Walkers of different cases that shared a deck came close to each other. Seen when the deck's output is split."""


class RunBusy(EngineFailure):
    """Another process, perhaps an engine whose launcher was killed, is writing into this run."""


class AuditFailed(EngineFailure):
    """The engine's binary failed its audit: what it computes cannot be trusted."""


class UnauditedEngineWarning(UserWarning):
    """The engine's binary was never audited."""
