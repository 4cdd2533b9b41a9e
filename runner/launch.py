"""Launch the engine on a deck and watch it until it ends, well or badly."""

from __future__ import annotations

import math
import os
import re
import shutil
import signal
import subprocess
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from runner.binary import Engine, version_in
from runner.failures import (
    BeadsLost,
    BlowUp,
    DiskFull,
    EngineError,
    EngineKilled,
    EngineVersionWarning,
    MissingFrames,
    TimeLimitExceeded,
)
from templates.deck import DECK_NAME, OUTPUT_NAME, Deck
from templates.engine import AUDITED_VERSION, POSITION_IS_NO_NUMBER, STEP_VARIABLES

_POLL_SECONDS = 0.05
# See templates.engine: without this the message of an abort is lost.
_LINE_BUFFERED = ("stdbuf", "-oL")
# The kernel ends the engine when whoever launched it dies, be it by SIGKILL.
_MORTAL = ("setpriv", "--pdeathsig", "KILL")
_GRACE_SECONDS = 2.0
_SPARE_BYTES = 64 * 1024
_STATUS_LINE = re.compile(rb"^ *(\d+) +(\d+) +(\S+)((?: +[-+.\w]+){6}) *$", re.MULTILINE)
_ERROR_LINE = re.compile(rb"^.*\bERROR\b.*$", re.MULTILINE)
_LOOP_TIME = re.compile(rb"^Loop time of (\S+) on", re.MULTILINE)


@dataclass(frozen=True)
class Progress:
    """How far a run is: steps done and in all, simulated time in s, wall time in s since the launch."""

    step: int
    steps: int
    simulated: float
    elapsed: float


@dataclass(frozen=True)
class EngineReport:
    """What a run of the engine took: wall time and time in its loop (s), steps, and the version it named."""

    version: str
    wall_seconds: float
    loop_seconds: float
    steps: int


def launch(
    deck: Deck,
    directory: Path,
    engine: Engine,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    time_limit: float | None = None,
    keep_open: Sequence[int] = (),
) -> EngineReport:
    """Run a deck that has been written into a directory, until its end or its first sign of failure.

    Parameters
    ----------
    deck
        The deck; its files are in ``directory`` already.
    directory
        Working directory of the engine; its output goes to ``engine.log`` there.
    engine
        The binary.
    on_progress
        Called a few times a second.
    time_limit
        Wall time in s after which the run is stopped.
    keep_open
        File descriptors that the engine inherits (the lock of the run).

    Raises
    ------
    EngineFailure
        One of the failures of `runner.failures`; the engine and its children have ended by then.
    """
    check_room(directory, deck.layout.bead_dump_bytes)
    begin = time.perf_counter()
    watch = _Watch(deck, directory, begin)
    process = None
    try:
        with postponed_interrupts():
            process = _start(directory, engine, deck.layout.ranks, keep_open)
        while process.poll() is None:
            try:
                process.wait(_POLL_SECONDS)
            except subprocess.TimeoutExpired:
                watch.look()
                watch.check(time_limit)
                if on_progress:
                    on_progress(watch.progress)
    finally:
        if process is not None:
            _end(process)
    wall_seconds = time.perf_counter() - begin
    watch.look()
    watch.check(None)
    return _verdict(watch, process.returncode, wall_seconds)


def check_room(folder: Path, needed: int) -> None:
    """Raise `DiskFull` unless so many bytes, and some more, are free where a folder is."""
    free = shutil.disk_usage(folder).free
    if free < needed + _SPARE_BYTES:
        raise DiskFull(needed, free, folder)


def _start(directory: Path, engine: Engine, ranks: int, keep_open: Sequence[int]) -> subprocess.Popen[bytes]:
    # Unless told otherwise mpirun refuses root, more ranks than cores, and binds all decks to the same cores.
    mortal = _MORTAL if shutil.which(_MORTAL[0]) else ()
    parallel = (
        ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", str(ranks), *mortal]
        if ranks > 1
        else []
    )
    with (directory / OUTPUT_NAME).open("wb") as output:
        return subprocess.Popen(
            [*mortal, *parallel, *_LINE_BUFFERED, str(engine.path), "-log", "none", "-in", DECK_NAME],
            cwd=directory,
            env={name: value for name, value in os.environ.items() if name not in STEP_VARIABLES},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=tuple(keep_open),
        )


@contextmanager
def postponed_interrupts() -> Iterator[None]:
    """Let SIGINT and SIGTERM take effect at the end of the block only.

    An exception out of `subprocess.Popen` would leave an engine behind that nobody knows of. Handlers are not inherited
    by the engine, as a mask of blocked signals would be.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    kept = {
        number: signal.signal(number, lambda number, _frame: caught.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
        for interrupt in caught:
            signal.raise_signal(interrupt)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the engine and all of its children: politely, then not."""
    if process.poll() is None:
        with suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(_GRACE_SECONDS)
    # Children may outlive their parent, or not care for SIGTERM.
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@dataclass(frozen=True)
class _Status:
    """A line of the engine's status: step, atoms, fastest bead (m/s) and the beads' bounds (m: x, x, y, y, z, z)."""

    step: int
    atoms: int
    speed: float
    bounds: tuple[float, ...]

    def clearance(self, box: tuple[Sequence[float], Sequence[float]]) -> float:
        """Distance from the outermost bead to the nearest face of the box, m."""
        lower, upper = box
        sides = zip(lower, upper, self.bounds[::2], self.bounds[1::2], strict=True)
        return min(min(low - floor, ceiling - high) for floor, ceiling, low, high in sides)


def complete_local_frames(path: Path) -> int:
    """Number of complete frames of a local dump: the last one counts only with all of its rows."""
    text = path.read_bytes() if path.exists() else b""
    frames = text.count(b"ITEM: TIMESTEP")
    last = text[text.rfind(b"ITEM: TIMESTEP") :].split(b"\n")
    # Nine lines of header, the fourth being the number of rows, then the rows, each ended by a newline.
    whole = len(last) > 9 and last[3].isdigit() and len(last) - 10 == int(last[3])
    return frames if whole or not frames else frames - 1


class _Watch:
    """Reads the engine's output as it grows."""

    def __init__(self, deck: Deck, directory: Path, begin: float) -> None:
        self.deck = deck
        self.directory = directory
        self.begin = begin
        self.output = b""
        self.status: _Status | None = None
        self.failure: BlowUp | BeadsLost | None = None
        self._parsed = 0

    @property
    def step(self) -> int:
        return self.status.step if self.status else 0

    @property
    def progress(self) -> Progress:
        layout = self.deck.layout
        return Progress(self.step, layout.steps, self.step * layout.time_step, time.perf_counter() - self.begin)

    def look(self) -> None:
        """Take in what the engine has written since the last look."""
        with (self.directory / OUTPUT_NAME).open("rb") as output:
            output.seek(len(self.output))
            self.output += output.read()
        complete = self.output.rfind(b"\n") + 1
        for match in _STATUS_LINE.finditer(self.output, self._parsed, complete):
            status = _Status(int(match[1]), int(match[2]), float(match[3]), tuple(map(float, match[4].split())))
            self.failure = self.failure or self._judge(status)
            self.status = status
        self._parsed = complete

    def _judge(self, status: _Status) -> BlowUp | BeadsLost | None:
        """What a status line tells of the beads, given the one before."""
        fastest = self.deck.fastest
        if not status.speed <= fastest:
            return BlowUp(status.speed, fastest, status.step, self.directory)
        lost = self.deck.layout.atoms - status.atoms
        if lost <= 0:
            return None
        if self.status is not None:
            # A bead that has left the box since the last line was at least this fast.
            seconds = (status.step - self.status.step) * self.deck.layout.time_step
            needed = self.status.clearance(self.deck.box) / seconds
            if needed > fastest:
                return BlowUp(needed, fastest, status.step, self.directory)
        return BeadsLost(lost, status.step, self.directory)

    def check(self, time_limit: float | None) -> None:
        """Raise the failure that shows while the engine runs, if any."""
        if self.failure is not None:
            raise self.failure
        if time_limit is not None and time.perf_counter() - self.begin > time_limit:
            raise TimeLimitExceeded(time_limit, self.step, self.deck.layout.steps, self.directory)
        missing = self.deck.layout.bead_dump_bytes - self.written
        free = shutil.disk_usage(self.directory).free
        if missing > 0 and free < _SPARE_BYTES:
            raise DiskFull(missing, free, self.directory)

    @property
    def written(self) -> int:
        dump = self.directory / self.deck.layout.bead_dump
        return dump.stat().st_size if dump.exists() else 0


def _verdict(watch: _Watch, status: int, wall_seconds: float) -> EngineReport:
    """Judge a run that has ended: raise its failure or report what it took."""
    layout, directory = watch.deck.layout, watch.directory
    errors = _ERROR_LINE.findall(watch.output)
    if errors:
        line = errors[0].decode("utf-8", "backslashreplace").strip()
        if POSITION_IS_NO_NUMBER in line:
            raise BlowUp(math.nan, watch.deck.fastest, watch.step, directory)
        raise EngineError(line, directory)
    if status < 0:
        raise EngineKilled(-status, directory)
    if status > 0:
        last = watch.output.rstrip().rsplit(b"\n", 1)[-1].decode("utf-8", "backslashreplace")
        raise EngineError(f"exit status {status}, last words: {last}", directory)
    if watch.written != layout.bead_dump_bytes:
        raise MissingFrames(watch.written / layout.bead_dump_bytes * layout.frames, layout.frames, directory)
    for name in (layout.pair_bridge_dump, layout.wall_bridge_dump):
        found = complete_local_frames(directory / name)
        if found != layout.bridge_frames:
            raise MissingFrames(found, layout.bridge_frames, directory)
    version = version_in(watch.output) or "unknown"
    if version != AUDITED_VERSION:
        message = f"the engine is {version}; the decks' remedies were measured on {AUDITED_VERSION}"
        warnings.warn(message, EngineVersionWarning, stacklevel=3)
    loop = _LOOP_TIME.findall(watch.output)
    return EngineReport(version, wall_seconds, float(loop[-1]) if loop else math.nan, layout.steps)
