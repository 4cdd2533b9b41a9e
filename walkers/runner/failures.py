"""Every way in which a run is known to fail: what it is called, how it is seen, what the user is told.

The engine's own signs are unreliable (an ERROR line without an exit status, an exit status without a line, silence), so
each failure is recognised by what it leaves behind. `walkers.runner.launch` raises them.
"""

from __future__ import annotations

import platform
import signal
from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from walkers.inputs.errors import WalkersError

INSTALL_COMMAND = "sudo apt-get install liggghts"


class EngineFailure(WalkersError):
    """Root of the failures of a run; ``directory`` is where its remains are, ``lost`` the number of beads lost."""

    lost = 0

    def __init__(self, message: str, directory: Path | None = None) -> None:
        self.directory = directory
        super().__init__(f"{message} (see {directory})" if directory else message)

    @property
    def reason(self) -> str:
        """Name of the failure, as stored in ``failure.json``."""
        return type(self).__name__


class EngineMissing(EngineFailure):
    """There is no liggghts to run. Seen before anything is written."""

    def __init__(self, wanted: str) -> None:
        super().__init__(
            f"no engine: {wanted} is not an executable file on this machine; install it with: {INSTALL_COMMAND}"
        )


class OtherEngine(EngineFailure):
    """The engine is another version than the one that the contact model was written for. Seen before it starts."""

    def __init__(self, path: Path, version: str | None) -> None:
        from walkers.templates.engine import AUDITED_VERSION

        super().__init__(
            f"{path} is {version or 'no LIGGGHTS that names its version'}: decks need a contact model that is written "
            f"for {AUDITED_VERSION}, as Debian packages it"
        )


class ContactModelMissing(EngineFailure):
    """The contact model that decks need cannot be compiled. Seen before the engine starts."""

    def __init__(self, why: str) -> None:
        super().__init__(f"no contact model for the engine: {why}")


class EngineDiffers(EngineFailure):
    """A worker of a sweep has another engine than the one that the sweep was started with."""

    def __init__(self, found: Path) -> None:
        super().__init__(f"the engine on {platform.node()}, {found}, is not the one that this sweep was started with")


class ProgramDiffers(EngineFailure):
    """A worker of a sweep names runs otherwise than where it was started: resolved cases or decks differ."""

    def __init__(self) -> None:
        super().__init__(f"on {platform.node()} this program is another version than where the sweep was started")


class EngineNeverStarted(EngineFailure):
    """The engine ended before it named its version: nothing was done. It is tried again before this is raised."""

    def __init__(self, last_words: str, directory: Path) -> None:
        super().__init__(f"the engine never started: {last_words}", directory)


class EngineError(EngineFailure):
    """The engine stopped with an ERROR line, or with a non-zero status and none. The line is quoted."""

    def __init__(self, line: str, directory: Path) -> None:
        self.line = line
        super().__init__(f"the engine stopped: {line}", directory)


class EngineKilled(EngineFailure):
    """A signal ended the engine: a crash of its own (SIGSEGV), or somebody's kill."""

    def __init__(self, number: int, directory: Path) -> None:
        self.signal = number
        try:
            name = signal.Signals(number).name
        except ValueError:
            name = f"signal {number}"
        super().__init__(f"the engine was ended by {name}", directory)


class EngineSilent(EngineFailure):
    """The engine wrote nothing for too long, neither into its log nor into its dump, and was ended."""

    def __init__(self, silence: float, step: int, steps: int, directory: Path) -> None:
        super().__init__(
            f"the engine wrote nothing for {silence:g} s (run.silence) after step {step} of {steps}, and was ended",
            directory,
        )


class LogTooLong(EngineFailure):
    """The engine's log grew beyond all that a deck has it write, and the engine was ended. The log is cut there."""

    def __init__(self, limit: float, step: int, directory: Path) -> None:
        super().__init__(
            f"the engine's log grew beyond {limit / 1e6:g} MB (run.log_limit) after step {step}, and it was ended",
            directory,
        )


class MissingFrames(EngineFailure):
    """The engine ended without complaint but its dump is short."""

    def __init__(self, found: float, expected: int, directory: Path) -> None:
        super().__init__(f"the engine wrote {int(found)} of {expected} frames and reported no error", directory)


class BeadsLost(EngineFailure):
    """Beads left the simulation box. Seen in the number of atoms, which the engine prints every cycle."""

    def __init__(self, lost: int, step: int, directory: Path) -> None:
        self.lost = lost
        super().__init__(
            f"{lost} bead(s) left the simulation box before step {step}: walkers went further than the box is wide (a "
            "larger dimers.spacing or a shorter run keeps them in), or a pile's beads left over the rim",
            directory,
        )


class BlowUp(EngineFailure):
    """A bead is faster than the drive can make it, or its speed is no number: most often too large a time step."""

    def __init__(self, speed: float, fastest: float, step: int, directory: Path) -> None:
        seen = f"moves at {speed:.3g} m/s" if isfinite(speed) else "has a speed or position that is no number"
        if speed <= fastest:
            seen = "left the box at a time step beyond its limits"
        super().__init__(
            f"blow-up: a bead {seen} after step {step}, "
            f"the drive cannot give more than {fastest:.3g} m/s; most often the time step is too large",
            directory,
        )


class DiskFull(EngineFailure):
    """No room for the output. Seen beforehand from the known size of the dump, or while the engine writes."""

    def __init__(self, needed: int | None, free: int, directory: Path) -> None:
        wanted = "" if needed is None else f"{needed / 1e6:.3g} MB are still to be written, "
        super().__init__(f"disk full: {wanted}{free / 1e6:.3g} MB are free", directory)


class OutputGone(EngineFailure):
    """Somebody removed the directory of a run, or of a sweep, while it was made."""

    def __init__(self, directory: Path) -> None:
        super().__init__(f"{directory} was removed while it was written")


class TimeLimitExceeded(EngineFailure):
    """The run took longer than it was allowed to."""

    def __init__(self, limit: float, step: int, steps: int, directory: Path) -> None:
        super().__init__(f"time limit of {limit:g} s reached at step {step} of {steps}", directory)


class WalkersMet(EngineFailure):
    """Walkers of different cases that shared a deck came close to each other. Seen when the deck's output is split."""

    def __init__(self, directory: Path) -> None:
        super().__init__("walkers of different cases came close to each other in a shared deck", directory)


class RunBusy(EngineFailure):
    """Another process, perhaps an engine whose launcher was killed, is writing into this run."""

    def __init__(self, directory: Path) -> None:
        super().__init__("another process is still running this case", directory)


class AuditFailed(EngineFailure):
    """The engine's binary failed its audit: what it computes cannot be trusted."""

    def __init__(self, failures: Sequence[str]) -> None:
        super().__init__(
            f"this engine failed its audit in {len(failures)} line(s), first: {failures[0]}; "
            "see it with: walkers audit (--allow-failed-audit runs all the same)"
        )


class UnauditedEngineWarning(UserWarning):
    """The engine's binary was never audited."""
