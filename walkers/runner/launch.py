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
from functools import cache
from pathlib import Path

from walkers.files import open_regular, read_regular
from walkers.runner import failures
from walkers.runner.binary import Engine, version_in
from walkers.runner.compiled_model import plugin_of, write_run_script
from walkers.runner.failures import AUDITED_VERSION
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME, Deck

_POLL_SECONDS = 0.05
# The kernel ends the engine when its launcher dies, even by SIGKILL.
_MORTAL = ("setpriv", "--pdeathsig", "KILL")
# The kernel does not notice a launcher that died before this request; then the parent is another process.
_UNLESS_ORPHAN = ("sh", "-c", '[ "$PPID" = "$0" ] && exec "$@"')
# By default, mpirun refuses root and more ranks than cores, and binds all decks to the same cores.
_TOGETHER = ("mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n")
# mpirun always listens on every address that it finds; with only a loopback, no other machine can reach it.
_LOOPBACK_ALONE = ("sh", "-c", 'PATH="$PATH:/usr/sbin:/sbin" ip link set lo up && exec "$@"', "sh")
_UNSHARED = (("unshare", "--net"), ("unshare", "--net", "--map-current-user", "--keep-caps"))
"""For root, and for other users."""
ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",  # no orted
    "OMPI_MCA_orte_create_session_dirs": "0",  # no folder in TMPDIR
    "OMPI_MCA_btl": "self",  # no network
    "OMPI_MCA_pml": "ob1",  # no search for a network, which takes half of the time
}
"""Environment of an engine of one process; with only the first variable, 14 of 1,500 starts failed."""
# Ranks communicate by shared memory; two start in 0.7 of the time. Waiting ranks yield their core: beside four busy
# processes, a pile took a quarter of the time.
_RANKS = {
    "OMPI_MCA_btl": "self,vader",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_plm": "isolated",  # no ssh, which containers lack
}
_HIDDEN = ("OMPI_MCA_", "SLURM_STEP_ID", "SLURM_STEPID", "SLURM_PROCID", "LD_PRELOAD")
"""Begins of variables of the environment that the engine must not see."""
_PAUSE_SECONDS = 0.2
_GRACE_SECONDS = 2.0
_LONGEST_LOOK = 1.0
"""Longest time between two looks that counts as silence, in s. SLURM may suspend this process and the engine together;
that time is not silence."""
_CHUNK_BYTES = 1 << 20
"""Size of one read of the engine's output; a line is shorter."""
_SPARE_BYTES = 64 * 1024
_TAIL_BYTES = 16 * 1024
"""End of a log that contains a status line."""
_TEMPORARY_BYTES = 16_000_000
"""Room in TMPDIR for mpirun and its processes; with 6 MB they wait for each other forever."""
_STATUS_LINE = re.compile(rb"^ *(\d+) +(\d+) +(\S+)((?: +[-+.\w]+){6}) *$", re.MULTILINE)
"""Step, atoms, speed of the fastest bead (m/s), and the beads' bounds (m: x, x, y, y, z, z)."""
_ERROR_LINE = re.compile(rb"^.*\bERROR\b.*$", re.MULTILINE)
_LOOP_TIME = re.compile(rb"^Loop time of (\S+) on", re.MULTILINE)


@dataclass(frozen=True)
class EngineReport:
    """Cost of a run of the engine: wall time and time in its loop (s), steps; and the version that it printed."""

    version: str
    wall_seconds: float
    loop_seconds: float
    steps: int


def launch(
    deck: Deck,
    directory: Path,
    engine: Engine,
    *,
    on_step: Callable[[int], None] | None = None,
    time_limit: float | None = None,
    keep_open: Sequence[int] = (),
) -> EngineReport:
    """Run a deck in a directory until its end or its first failure, an `EngineFailure`; then the engine has ended.

    A few times per second and at the end ``on_step`` is called with the current step; its exceptions end the engine.
    The run is stopped after ``time_limit`` (wall time, s). The engine inherits the file descriptors ``keep_open`` (the
    lock of the run). If it ends before it prints its version, it is started again, three times in all.
    """
    ranks, temporary = deck.layout.ranks, Path(os.environ.get("TMPDIR", "/tmp"))
    check_free_space(directory, deck.layout.bead_dump_bytes)
    if ranks > 1 and shutil.which("mpirun") is None:
        raise failures.EngineNeverStarted(
            f"run.ranks = {ranks} needs mpirun: apt-get install openmpi-bin", directory
        )
    if ranks > 1 and temporary.is_dir():
        check_free_space(temporary, _TEMPORARY_BYTES)
    plugin = plugin_of(engine)
    write_run_script(directory, engine, plugin, ranks)
    command = [
        *_before(ranks),
        "env",
        f"LD_PRELOAD={plugin}",
        str(engine.path),
        "-log",
        "none",
        "-in",
        DECK_NAME,
    ]
    tell = on_step or (lambda _: None)
    starts_left = 3
    while True:
        starts_left -= 1
        try:
            return _Watch(deck, directory, engine.path, time_limit).run(command, tell, keep_open)
        except failures.EngineNeverStarted:
            if not starts_left:
                raise
            time.sleep(_PAUSE_SECONDS)


def last_step(log: Path) -> int:
    """The step of the last status line in the log of an engine; 0 where there is none."""
    with open_regular(log) as output:
        output.seek(max(0, log.stat().st_size - _TAIL_BYTES))
        lines = _STATUS_LINE.findall(output.read())
    return int(lines[-1][0]) if lines else 0


def judge(deck: Deck, directory: Path, log: Path) -> EngineReport:
    """Check a deck that was run by hand, from its log and dumps; raises the failures of `launch`."""
    watch = _Watch(deck, directory, Path("liggghts"), None)
    watch.log = log
    report = watch.verdict(0)
    if watch.version is None or math.isnan(watch.loop_seconds):
        raise failures.MissingFrames(f"{log.name} is not the whole output of an engine", directory)
    return report


def check_free_space(folder: Path, needed: int) -> None:
    """Raise `DiskFull` unless the disk of a folder has room for the ``needed`` bytes and a reserve."""
    free = shutil.disk_usage(folder).free
    if free < needed + _SPARE_BYTES:
        raise failures.DiskFull(needed, free, folder)


def cores_here() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _before(ranks: int) -> tuple[str, ...]:
    """Command that starts the engine so that it ends with its launcher; several ranks without access to the network."""
    mortal = _MORTAL if shutil.which(_MORTAL[0]) else ()
    unless_orphan = (*_UNLESS_ORPHAN, str(os.getpid())) if mortal else ()
    if ranks == 1:
        return (*mortal, *unless_orphan)
    # With --oversubscribe waiting ranks yield their core, to any program: beside one, steps take 30 times as long.
    yields = int(ranks > cores_here())
    waiting = ("--mca", "mpi_yield_when_idle", str(yields))
    return (*_off_the_network(), *mortal, *unless_orphan, *_TOGETHER, str(ranks), *waiting, *mortal)


@cache
def _off_the_network() -> tuple[str, ...]:
    """Command that starts a program with only a loopback network; empty if the system does not allow it."""
    for unshared in _UNSHARED:
        prefix = (*unshared, *_LOOPBACK_ALONE)
        with suppress(OSError, subprocess.CalledProcessError):
            subprocess.run(
                [*prefix, "true"], stdin=subprocess.DEVNULL, capture_output=True, check=True
            )
            return prefix
    warnings.warn(
        "mpirun listens on all networks: unshare (util-linux) cannot take them away", stacklevel=2
    )
    return ()


@contextmanager
def postponed_interrupts() -> Iterator[None]:
    """Delay signals to the end of the block: in `subprocess.Popen`, they would leave an unknown engine behind."""
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
    """End the engine and all of its children, first with SIGTERM, then with SIGKILL."""
    if process.poll() is None:
        with suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(_GRACE_SECONDS)
    # Children may outlive their parent or ignore SIGTERM.
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


class _Watch:
    """Reads the engine's output as it grows, keeps the values that are needed later, and raises failures."""

    def __init__(self, deck: Deck, directory: Path, engine: Path, time_limit: float | None) -> None:
        self.deck, self.layout, self.directory, self.engine = deck, deck.layout, directory, engine
        self.time_limit = math.inf if time_limit is None else time_limit
        self.begin = self.looked = time.perf_counter()
        self.log = directory / OUTPUT_NAME
        self.step = 0
        self.clearance: float | None = None  # from the outermost bead to the box at that step, m
        self.nearest_is_top = False  # whether that bead is the highest one
        self.version: str | None = None
        self.failure: failures.EngineFailure | None = None
        self.error = self.last_line = self.rest = b""
        self.loop_seconds = math.nan
        self.read = self.grown = 0
        self.silent = 0.0

    @property
    def written(self) -> int:
        """Bytes of the beads' dump."""
        dump = self.directory / self.layout.bead_dump
        return dump.stat().st_size if dump.exists() else 0

    def run(
        self, command: Sequence[str], on_step: Callable[[int], None], keep_open: Sequence[int]
    ) -> EngineReport:
        """Start an engine and watch it to its end."""
        # A user's Open MPI settings for a cluster, such as the network, may not work on one machine. The loader
        # would report the LD_PRELOAD of the user as an ERROR before.
        ours = {name: value for name, value in os.environ.items() if not name.startswith(_HIDDEN)}
        environment = ours | (_RANKS if self.layout.ranks > 1 else ALONE)
        process = None
        try:
            with postponed_interrupts(), self.log.open("wb") as output:
                process = subprocess.Popen(
                    command,
                    cwd=self.directory,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    pass_fds=tuple(keep_open),
                )
            while process.poll() is None:
                try:
                    process.wait(_POLL_SECONDS)
                except subprocess.TimeoutExpired:
                    self.look()
                    self.check()
                    on_step(self.step)
        finally:
            if process is not None:
                _end(process)
                with suppress(OSError):  # a folder that is gone
                    if (
                        self.log.stat().st_size > self.deck.log_limit
                    ):  # written before the engine ended
                        os.truncate(self.log, int(self.deck.log_limit))
        report = self.verdict(process.returncode)
        on_step(self.step)
        return report

    def look(self) -> None:
        """Read the output since the last look, up to the limit of the log, or add to the time of silence."""
        with open_regular(self.log) as output:
            output.seek(self.read)
            while self.read <= self.deck.log_limit and (chunk := output.read(_CHUNK_BYTES)):
                self.read += len(chunk)
                whole, newline, self.rest = (self.rest + chunk).rpartition(b"\n")
                self._take_in(whole + newline)
                self.rest = self.rest[:_CHUNK_BYTES]  # a line without end
        now, grown = time.perf_counter(), self.read + self.written
        self.silent = (
            0.0 if grown != self.grown else self.silent + min(now - self.looked, _LONGEST_LOOK)
        )
        self.looked, self.grown = now, grown

    def _take_in(self, lines: bytes) -> None:
        self.version = self.version or version_in(lines)
        if not self.error and (error := _ERROR_LINE.search(lines)):
            self.error = error[0].strip()
        for match in _STATUS_LINE.finditer(lines):
            bounds = [float(number) for number in match[4].split()]
            failure = self._judge(int(match[1]), int(match[2]), float(match[3]), bounds)
            self.failure = self.failure or failure
        if loops := _LOOP_TIME.findall(lines):
            self.loop_seconds = float(loops[-1])
        if words := lines.strip():
            self.last_line = words.rsplit(b"\n", 1)[-1]

    def _judge(
        self, step: int, atoms: int, speed: float, bounds: Sequence[float]
    ) -> failures.EngineFailure | None:
        """The failure that a status line shows, given the line before; None if there is none."""
        fastest, lost = self.deck.fastest, self.layout.atoms - atoms
        seconds, clearance = (step - self.step) * self.layout.time_step, self.clearance
        sides = list(zip(*self.deck.box, bounds[::2], bounds[1::2], strict=True))
        over = self.nearest_is_top
        self.clearance = min(
            min(low - floor, ceiling - high) for floor, ceiling, low, high in sides
        )
        self.nearest_is_top = sides[2][1] - sides[2][3] == self.clearance
        self.step = step
        if not speed <= fastest:
            return self._blow_up(speed)
        if lost <= 0:
            return None
        if self.deck.beyond_limits:
            return self._blow_up(0.0)
        # A bead that has left the box since the last line was at least as fast as this.
        if clearance is not None and clearance > fastest * seconds:
            return self._blow_up(clearance / seconds if seconds else math.inf)
        left = f"{lost} bead(s) left the simulation box before step {step}"
        if self.layout.walkers:
            cause = (
                "walkers left its sides (increase their spacing, shorten the run, or reduce the acceleration if "
                "beads fly off), or climbers rose above its top, at twice boundary.height"
            )
        else:
            cause = (
                "beads left the vessel over its rim or rose above twice boundary.height (use higher walls, fewer "
                "beads or a lower acceleration), or left the sides of a boundary without a rim"
            )
        sentence = f"{left}: {cause}"
        return (failures.BeadsOverTheTop if over else failures.BeadsLost)(
            sentence, self.directory, lost=lost
        )

    def _blow_up(self, speed: float) -> failures.BlowUp:
        seen = (
            f"moves at {speed:.3g} m/s"
            if math.isfinite(speed)
            else "has a speed or position that is not a number"
        )
        if speed <= self.deck.fastest:
            seen = "left the box at a time step beyond its limits"
        return failures.BlowUp(
            f"blow-up: a bead {seen} after step {self.step}; the drive accelerates beads to at most "
            f"{self.deck.fastest:.3g} m/s; the most frequent cause is a time step that is too long",
            self.directory,
        )

    def check(self) -> None:
        """Raise the failure that shows while the engine runs, if any."""
        deck, at = self.deck, f"step {self.step} of {self.layout.steps}"
        if self.version is not None and self.version != AUDITED_VERSION:
            raise failures.OtherEngine(self.engine, self.version)
        if self.failure is not None:
            raise self.failure
        if self.read > deck.log_limit:
            message = f"the engine's log grew beyond {deck.log_limit / 1e6:g} MB after step {self.step}; it was stopped"
            raise failures.LogTooLong(message, self.directory)
        if self.silent > deck.silence:
            message = f"the engine wrote nothing for {deck.silence:g} s after {at}; it was stopped"
            raise failures.EngineSilent(message, self.directory)
        if time.perf_counter() - self.begin > self.time_limit:
            raise failures.TimeLimitExceeded(
                f"time limit of {self.time_limit:g} s reached at {at}", self.directory
            )
        missing = self.layout.bead_dump_bytes - self.written
        free = shutil.disk_usage(self.directory).free
        if missing > 0 and free < _SPARE_BYTES:
            raise failures.DiskFull(missing, free, self.directory)

    def verdict(self, status: int) -> EngineReport:
        """Judge a run that has ended: raise its failure, or return its cost."""
        wall_seconds, layout, self.time_limit = (
            time.perf_counter() - self.begin,
            self.layout,
            math.inf,
        )
        self.look()
        self._take_in(self.rest)  # the last line may lack its end
        self.check()
        words = f", last line: {_text(self.last_line)}" if self.last_line else ", without output"
        if status > 0 and self.version is None and not self.error.startswith(b"ERROR"):
            raise failures.EngineNeverStarted(
                f"the engine never started: exit status {status}{words}", self.directory
            )
        if b"a bead's position is no number" in self.error:
            raise self._blow_up(math.nan)
        if self.error or status > 0:
            why = _text(self.error) if self.error else f"exit status {status}{words}"
            raise failures.EngineError(f"the engine stopped: {why}", self.directory)
        if status == -signal.SIGXFSZ:
            raise failures.FileTooLarge(self.directory)
        if status < 0:
            name = (
                signal.Signals(-status).name
                if -status in set(signal.Signals)
                else f"signal {-status}"
            )
            raise failures.EngineKilled(f"the engine was killed by {name}", self.directory)
        frames_of_beads = self.written / layout.bead_dump_bytes * layout.frames
        dumps = (layout.pair_bridge_dump, layout.wall_bridge_dump)
        frames_of_bridges = [
            (_complete_frames(self.directory / name), layout.bridge_frames) for name in dumps
        ]
        for frames, expected in [(frames_of_beads, layout.frames), *frames_of_bridges]:
            if frames != expected:
                message = (
                    f"the engine wrote {int(frames)} of {expected} frames and reported no error"
                )
                raise failures.MissingFrames(message, self.directory)
        return EngineReport(
            self.version or "unknown", wall_seconds, self.loop_seconds, layout.steps
        )


def _complete_frames(path: Path) -> int:
    """Number of complete frames of a local dump: the last one counts only with all of its rows."""
    text = read_regular(path) if path.exists() else b""
    frames = text.count(b"ITEM: TIMESTEP")
    last = text[text.rfind(b"ITEM: TIMESTEP") :].split(b"\n")
    # Nine lines of header, the fourth being the number of rows, then the rows, each ended by a newline.
    whole = len(last) > 9 and last[3].isdigit() and len(last) - 10 == int(last[3])
    return frames if whole or not frames else frames - 1


def _text(line: bytes) -> str:
    return line.decode("utf-8", "backslashreplace")
