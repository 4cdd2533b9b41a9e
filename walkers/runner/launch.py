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
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from walkers.runner.binary import Engine, version_in
from walkers.runner.failures import (
    BeadsLost,
    BlowUp,
    DiskFull,
    EngineError,
    EngineKilled,
    EngineNeverStarted,
    EngineSilent,
    LogTooLong,
    MissingFrames,
    OtherEngine,
    TimeLimitExceeded,
)
from walkers.runner.plugin import plugin_of, run_script
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME, RUN_NAME, Deck
from walkers.templates.engine import ALONE, AUDITED_VERSION, POSITION_IS_NO_NUMBER, RANKS, STEP_VARIABLES

_POLL_SECONDS = 0.05
# The kernel ends the engine when whoever launched it dies, be it by SIGKILL.
_MORTAL = ("setpriv", "--pdeathsig", "KILL")
# Whoever died before that was asked of the kernel is not noticed by it: then the parent is another one by now.
_UNLESS_ORPHAN = ("sh", "-c", '[ "$PPID" = "$0" ] && exec "$@"')
# Where there is but a loopback nobody reaches mpirun, which listens on every address that it sees, whatever it is told.
_LOOPBACK_ALONE = ("sh", "-c", 'PATH="$PATH:/usr/sbin:/sbin" ip link set lo up && exec "$@"', "sh")
_UNSHARED = (("unshare", "--net"), ("unshare", "--net", "--map-current-user", "--keep-caps"))
"""For root, and for others."""
_PAUSE_SECONDS = 0.2
_GRACE_SECONDS = 2.0
_LONGEST_LOOK = 1.0
"""Between two looks no more than this counts as silence, in s: whoever was stopped meanwhile, as SLURM does with whole
jobs, has heard nothing of an engine that was stopped too."""
_CHUNK_BYTES = 1 << 20
"""Read of the engine's output at once; a line is shorter."""
_SPARE_BYTES = 64 * 1024
_TEMPORARY_BYTES = 16_000_000
"""In TMPDIR, of mpirun and its processes: with 6 MB they wait for each other without end."""
_STATUS_LINE = re.compile(rb"^ *(\d+) +(\d+) +(\S+)((?: +[-+.\w]+){6}) *$", re.MULTILINE)
_ERROR_LINE = re.compile(rb"^.*\bERROR\b.*$", re.MULTILINE)
_LOOP_TIME = re.compile(rb"^Loop time of (\S+) on", re.MULTILINE)


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes
    ----------
    step, steps
        Of the drive, done and in all.
    simulated
        Time, s.
    elapsed, made
        Wall time of this call, s, and the steps that were made in it.
    resting
        Whether the beads still come to rest before the drive.
    """

    step: int
    steps: int
    simulated: float
    elapsed: float
    made: int = 0
    resting: bool = False


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
    starts: int = 3,
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
    starts
        How often an engine is started that ends before it has done anything.

    Raises
    ------
    EngineFailure
        One of the failures of `walkers.runner.failures`; the engine and its children have ended by then.
    """
    check_room(directory, deck.layout.bead_dump_bytes)
    temporary = Path(os.environ.get("TMPDIR", "/tmp"))
    if deck.layout.ranks > 1 and temporary.is_dir():
        check_room(temporary, _TEMPORARY_BYTES)
    plugin = plugin_of(engine)
    (directory / RUN_NAME).write_text(run_script(plugin, deck.layout.ranks), encoding="utf-8")
    start = partial(_start, directory, engine, plugin, deck.layout.ranks, keep_open)
    for _ in range(starts - 1):
        with suppress(EngineNeverStarted):
            return _watched(_Watch(deck, directory, engine.path), start, on_progress, time_limit)
        time.sleep(_PAUSE_SECONDS)
    return _watched(_Watch(deck, directory, engine.path), start, on_progress, time_limit)


def _watched(
    watch: _Watch,
    start: Callable[[], subprocess.Popen[bytes]],
    on_progress: Callable[[Progress], None] | None,
    time_limit: float | None,
) -> EngineReport:
    """Start an engine and watch it to its end."""
    process = None
    try:
        with postponed_interrupts():
            process = start()
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
            watch.cut_log()
    wall_seconds = time.perf_counter() - watch.begin
    watch.end()
    watch.check(None)
    return _verdict(watch, process.returncode, wall_seconds)


def check_room(folder: Path, needed: int) -> None:
    """Raise `DiskFull` unless so many bytes, and some more, are free where a folder is."""
    free = shutil.disk_usage(folder).free
    if free < needed + _SPARE_BYTES:
        raise DiskFull(needed, free, folder)


def _start(
    directory: Path, engine: Engine, plugin: Path, ranks: int, keep_open: Sequence[int]
) -> subprocess.Popen[bytes]:
    # Unless told otherwise mpirun refuses root, more ranks than cores, and binds all decks to the same cores.
    mortal = _MORTAL if shutil.which(_MORTAL[0]) else ()
    unless_orphan = (*_UNLESS_ORPHAN, str(os.getpid())) if mortal else ()
    together = ("mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", str(ranks), *mortal)
    parallel, apart = (together, _off_the_network()) if ranks > 1 else ((), ())
    loading = ("env", f"LD_PRELOAD={plugin}")
    command = [*apart, *mortal, *unless_orphan, *parallel, *loading, str(engine.path), "-log", "none", "-in", DECK_NAME]
    with (directory / OUTPUT_NAME).open("wb") as output:
        return subprocess.Popen(
            command,
            cwd=directory,
            env=_environment(ranks),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=tuple(keep_open),
        )


@cache
def _off_the_network() -> tuple[str, ...]:
    """What starts a program where there is no network but the loopback; nothing where the system lets nobody do so."""
    for unshared in _UNSHARED:
        with suppress(OSError):
            prefix = (*unshared, *_LOOPBACK_ALONE)
            if not subprocess.run(
                [*prefix, "true"], stdin=subprocess.DEVNULL, capture_output=True, check=False
            ).returncode:
                return prefix
    return ()


def _environment(ranks: int) -> dict[str, str]:
    # What a user has Open MPI do on a cluster, such as by which network to meet, may leave no way on one machine.
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in STEP_VARIABLES and not name.startswith("OMPI_MCA_")
    }
    return {**inherited, **(RANKS if ranks > 1 else ALONE)}


@contextmanager
def postponed_interrupts() -> Iterator[None]:
    """Let SIGINT, SIGTERM and SIGHUP take effect at the end of the block only.

    An exception out of `subprocess.Popen` would leave an engine behind that nobody knows of. Handlers are not inherited
    by the engine, as a mask of blocked signals would be.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    kept = {
        number: signal.signal(number, lambda number, _frame: caught.append(number))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
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
    """Reads the engine's output as it grows, and keeps of it what is asked for later."""

    def __init__(self, deck: Deck, directory: Path, engine: Path) -> None:
        self.deck = deck
        self.directory = directory
        self.engine = engine
        self.begin = time.perf_counter()
        self.status: _Status | None = None
        self.failure: BlowUp | BeadsLost | None = None
        self.version: str | None = None
        self.error: bytes | None = None
        self.loop_seconds = math.nan
        self.last_line = b""
        self._read = 0
        self._rest = b""
        self._looked = self.begin
        self._silent = 0.0
        self._grown = 0

    @property
    def step(self) -> int:
        return self.status.step if self.status else 0

    @property
    def progress(self) -> Progress:
        layout = self.deck.layout
        elapsed = time.perf_counter() - self.begin
        return Progress(self.step, layout.steps, self.step * layout.time_step, elapsed, self.step)

    def look(self) -> None:
        """Take in what the engine has written since the last look, as far as its log may go."""
        with self._log.open("rb") as output:
            output.seek(self._read)
            while self._read <= self.deck.log_limit and (chunk := output.read(_CHUNK_BYTES)):
                self._read += len(chunk)
                whole, newline, self._rest = (self._rest + chunk).rpartition(b"\n")
                self._take_in(whole + newline)
                if len(self._rest) > _CHUNK_BYTES:  # a line without end
                    self._rest = b""
        self._listen()

    def _listen(self) -> None:
        """How long the engine has written nothing."""
        now, grown = time.perf_counter(), self._read + self.written
        self._silent = 0.0 if grown != self._grown else self._silent + min(now - self._looked, _LONGEST_LOOK)
        self._looked, self._grown = now, grown

    def cut_log(self) -> None:
        """Cut a log that became too long before its engine had ended."""
        with suppress(OSError):  # a folder that is gone
            if self._log.stat().st_size > self.deck.log_limit:
                os.truncate(self._log, int(self.deck.log_limit))

    def end(self) -> None:
        """Take in the last line, which may lack its end."""
        self.look()
        self._take_in(self._rest)

    def _take_in(self, lines: bytes) -> None:
        self.version = self.version or version_in(lines)
        if self.error is None and (error := _ERROR_LINE.search(lines)):
            self.error = error[0].strip()
        for match in _STATUS_LINE.finditer(lines):
            status = _Status(int(match[1]), int(match[2]), float(match[3]), tuple(map(float, match[4].split())))
            self.failure = self.failure or self._judge(status)
            self.status = status
        if loops := _LOOP_TIME.findall(lines):
            self.loop_seconds = float(loops[-1])
        if words := lines.strip():
            self.last_line = words.rsplit(b"\n", 1)[-1]

    def _judge(self, status: _Status) -> BlowUp | BeadsLost | None:
        """What a status line tells of the beads, given the one before."""
        fastest = self.deck.fastest
        if not status.speed <= fastest:
            return BlowUp(status.speed, fastest, status.step, self.directory)
        lost = self.deck.layout.atoms - status.atoms
        if lost <= 0:
            return None
        if self.deck.beyond_limits:
            return BlowUp(0.0, fastest, status.step, self.directory)
        if self.status is not None:
            # A bead that has left the box since the last line was at least this fast.
            seconds = (status.step - self.status.step) * self.deck.layout.time_step
            needed = self.status.clearance(self.deck.box) / seconds
            if needed > fastest:
                return BlowUp(needed, fastest, status.step, self.directory)
        return BeadsLost(lost, status.step, self.directory)

    def check(self, time_limit: float | None) -> None:
        """Raise the failure that shows while the engine runs, if any."""
        if self.version not in (None, AUDITED_VERSION):
            raise OtherEngine(self.engine, self.version)
        if self.failure is not None:
            raise self.failure
        if self._read > self.deck.log_limit:
            raise LogTooLong(self.deck.log_limit, self.step, self.directory)
        if self._silent > self.deck.silence:
            raise EngineSilent(self.deck.silence, self.step, self.deck.layout.steps, self.directory)
        if time_limit is not None and time.perf_counter() - self.begin > time_limit:
            raise TimeLimitExceeded(time_limit, self.step, self.deck.layout.steps, self.directory)
        missing = self.deck.layout.bead_dump_bytes - self.written
        free = shutil.disk_usage(self.directory).free
        if missing > 0 and free < _SPARE_BYTES:
            raise DiskFull(missing, free, self.directory)

    @property
    def _log(self) -> Path:
        return self.directory / OUTPUT_NAME

    @property
    def written(self) -> int:
        dump = self.directory / self.deck.layout.bead_dump
        return dump.stat().st_size if dump.exists() else 0


def _verdict(watch: _Watch, status: int, wall_seconds: float) -> EngineReport:
    """Judge a run that has ended: raise its failure or report what it took."""
    layout, directory = watch.deck.layout, watch.directory
    if status > 0 and watch.version is None and not (watch.error or b"").startswith(b"ERROR"):
        raise EngineNeverStarted(_ending(status, watch.last_line), directory)
    if watch.error is not None:
        if POSITION_IS_NO_NUMBER.encode() in watch.error:
            raise BlowUp(math.nan, watch.deck.fastest, watch.step, directory)
        raise EngineError(_text(watch.error), directory)
    if status < 0:
        raise EngineKilled(-status, directory)
    if status > 0:
        raise EngineError(_ending(status, watch.last_line), directory)
    if watch.written != layout.bead_dump_bytes:
        raise MissingFrames(watch.written / layout.bead_dump_bytes * layout.frames, layout.frames, directory)
    for name in (layout.pair_bridge_dump, layout.wall_bridge_dump):
        found = complete_local_frames(directory / name)
        if found != layout.bridge_frames:
            raise MissingFrames(found, layout.bridge_frames, directory)
    return EngineReport(watch.version or "unknown", wall_seconds, watch.loop_seconds, layout.steps)


def _ending(status: int, last_line: bytes) -> str:
    return f"exit status {status}" + (f", last words: {_text(last_line)}" if last_line else ", without a word")


def _text(line: bytes) -> str:
    return line.decode("utf-8", "backslashreplace")
