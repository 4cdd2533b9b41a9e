"""Launch the engine on a deck and watch it until it ends, well or badly.

How its process is started and ended is in `walkers.runner.process`; what can fail is in
`walkers.runner.failures`.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from walkers.files import open_regular, read_regular
from walkers.runner import failures
from walkers.runner.binary import Engine, version_in
from walkers.runner.compiled_model import plugin_of, write_run_script
from walkers.runner.failures import AUDITED_VERSION
from walkers.runner.process import (
    end_process,
    engine_environment,
    postponed_interrupts,
    start_command,
)
from walkers.templates.deck import DECK_NAME, OUTPUT_NAME, Deck

_STARTS = 3
"""How often the engine is started if it ends before it prints its version."""
_PAUSE_SECONDS = 0.2
"""Time between two starts."""
_POLL_SECONDS = 0.05
"""Time between two looks at the output."""
_LONGEST_LOOK = 1.0
"""Longest time between two looks that counts as silence, s.

SLURM may suspend this process and the engine together; that time is not silence.
"""
_CHUNK_BYTES = 1 << 20
"""Size of one read of the engine's output; a line is shorter."""
_TAIL_BYTES = 16 * 1024
"""Size of the end of a log that contains a status line."""
_SPARE_BYTES = 64 * 1024
"""Space on the disk that must stay free."""
_TEMPORARY_BYTES = 16_000_000
"""Space in TMPDIR for mpirun and its processes; with 6 MB they wait for each other forever."""
_STATUS_LINE = re.compile(rb"^ *(\d+) +(\d+) +(\S+)((?: +[-+.\w]+){6}) *$", re.MULTILINE)
"""Step, atoms, speed of the fastest bead (m/s), and the beads' bounds (m: x, x, y, y, z, z)."""
_ERROR_LINE = re.compile(rb"^.*\bERROR\b.*$", re.MULTILINE)
"""A line with the word ERROR, whoever wrote it."""
_LOOP_TIME = re.compile(rb"^Loop time of (\S+) on", re.MULTILINE)
"""Time of a loop over steps, s: ``Loop time of 1.25 on 1 procs for 1000 steps with 2 atoms``."""
_FRAME_START = b"ITEM: TIMESTEP"
"""First line of a frame of a local dump."""
_HEADER_LINES = 9
"""Lines of the header of such a frame."""


@dataclass(frozen=True)
class EngineReport:
    """What a run of the engine cost.

    Attributes
    ----------
    version
        The version that the engine printed.
    wall_seconds
        Wall time of the run, s.
    loop_seconds
        Time in the engine's loop over steps, s.
    steps
        Number of steps.
    """

    version: str
    wall_seconds: float
    loop_seconds: float
    steps: int


def launch(  # noqa: PLR0913
    deck: Deck,
    directory: Path,
    engine: Engine,
    *,
    on_step: Callable[[int], None] | None = None,
    time_limit: float | None = None,
    keep_open: Sequence[int] = (),
) -> EngineReport:
    """Run a deck to its end or to its first failure; then the engine has ended.

    If the engine ends before it prints its version, it is started again, three times in all.

    Parameters
    ----------
    deck
        The deck, whose files are in the directory.
    directory
        Folder in which the engine runs.
    engine
        The engine.
    on_step
        Called with the current step, a few times per second and at the end; its exceptions end the
        engine.
    time_limit
        Wall time after which the run is stopped, s; None: no limit.
    keep_open
        File descriptors that the engine inherits: the lock of the run.

    Returns
    -------
    EngineReport
        What the run cost.

    Raises
    ------
    EngineFailure
        If the run fails.
    """
    ranks = deck.layout.ranks
    check_free_space(directory, deck.layout.bead_dump_bytes)
    if ranks > 1:
        _check_mpi(ranks, directory)
    plugin = plugin_of(engine)
    write_run_script(directory, engine, plugin, ranks)
    command = [
        *start_command(ranks),
        "env",
        f"LD_PRELOAD={plugin}",
        str(engine.path),
        "-log",
        "none",
        "-in",
        DECK_NAME,
    ]
    starts_left = _STARTS
    while True:
        starts_left -= 1
        watch = _Watch(deck, directory, engine.path, time_limit)
        try:
            return watch.run(command, on_step or _ignore_step, keep_open)
        except failures.EngineNeverStarted:
            if not starts_left:
                raise
            time.sleep(_PAUSE_SECONDS)


def _ignore_step(step: int) -> None:
    """Do nothing: nobody wants to know the step."""


def _check_mpi(ranks: int, directory: Path) -> None:
    """Check that mpirun exists and that TMPDIR has space for it."""
    if shutil.which("mpirun") is None:
        needed = f"run.ranks = {ranks} needs mpirun: apt-get install openmpi-bin"
        raise failures.EngineNeverStarted(needed, directory)
    temporary = Path(os.environ.get("TMPDIR", "/tmp"))
    if temporary.is_dir():
        check_free_space(temporary, _TEMPORARY_BYTES)


def check_free_space(folder: Path, needed: int) -> None:
    """Raise `DiskFull` unless the disk of a folder has space for the bytes and a reserve."""
    free = shutil.disk_usage(folder).free
    if free < needed + _SPARE_BYTES:
        raise failures.DiskFull(needed, free, folder)


def last_step(log: Path) -> int:
    """The step of the last status line in the log of an engine; 0 if it has none."""
    with open_regular(log) as output:
        output.seek(max(0, log.stat().st_size - _TAIL_BYTES))
        lines = _STATUS_LINE.findall(output.read())
    return int(lines[-1][0]) if lines else 0


def judge(deck: Deck, directory: Path, log: Path) -> EngineReport:
    """Check a deck that was run by hand, from its log and its dumps.

    Parameters
    ----------
    deck
        The deck.
    directory
        Folder with the dumps.
    log
        The whole output of the engine.

    Returns
    -------
    EngineReport
        What the run cost, as far as the log tells it.

    Raises
    ------
    EngineFailure
        As by `launch`.
    """
    watch = _Watch(deck, directory, Path("liggghts"), None)
    watch.log = log
    report = watch.verdict(0)
    if watch.version is None or math.isnan(watch.loop_seconds):
        raise failures.MissingFrames(f"{log.name} is not the whole output of an engine", directory)
    return report


@dataclass(frozen=True)
class _Status:
    """A status line of the engine.

    Attributes
    ----------
    step
        The step.
    atoms
        Number of beads in the box.
    speed
        Speed of the fastest bead, m/s.
    lowest, highest
        Smallest and largest coordinates of the beads along x, y and z, m.
    """

    step: int
    atoms: int
    speed: float
    lowest: Sequence[float]
    highest: Sequence[float]

    @classmethod
    def of_line(cls, match: re.Match[bytes]) -> _Status:
        """The status of a match of `_STATUS_LINE`."""
        bounds = [float(word) for word in match[4].split()]
        return cls(
            step=int(match[1]),
            atoms=int(match[2]),
            speed=float(match[3]),
            lowest=bounds[::2],
            highest=bounds[1::2],
        )


class _Watch:
    """Reads the engine's output as it grows, and raises the failures that it shows.

    Attributes
    ----------
    deck, layout, directory, engine
        The deck, the layout of its output, the folder in which it runs, and the engine's path.
    time_limit
        Longest wall time, s.
    log
        The file of the engine's output.
    started
        When the watch began, s of the performance counter.
    step
        Step of the last status line.
    clearance
        Distance from the outermost bead to the box at that step, m; None before the first line.
    nearest_is_top
        Whether that bead is the highest one.
    version
        The version that the engine printed; None before.
    failure
        The first failure that a status line showed.
    error
        The first line with ERROR; empty without one.
    last_line
        The last line with letters.
    unfinished_line
        What was read after the last newline.
    loop_seconds
        Time of the last loop over steps, s; NaN before its end.
    bytes_read
        Number of bytes of the log that were read.
    bytes_of_output
        Number of bytes of log and dump at the last look.
    looked
        When the last look was, s of the performance counter.
    silent_seconds
        Time since the output grew, s.
    """

    def __init__(self, deck: Deck, directory: Path, engine: Path, time_limit: float | None) -> None:
        self.deck = deck
        self.layout = deck.layout
        self.directory = directory
        self.engine = engine
        self.time_limit = math.inf if time_limit is None else time_limit
        self.log = directory / OUTPUT_NAME
        self.started = time.perf_counter()
        self.step = 0
        self.clearance: float | None = None
        self.nearest_is_top = False
        self.version: str | None = None
        self.failure: failures.EngineFailure | None = None
        self.error = b""
        self.last_line = b""
        self.unfinished_line = b""
        self.loop_seconds = math.nan
        self.bytes_read = 0
        self.bytes_of_output = 0
        self.looked = self.started
        self.silent_seconds = 0.0

    @property
    def dump_bytes(self) -> int:
        """Size of the beads' dump, bytes."""
        dump = self.directory / self.layout.bead_dump
        return dump.stat().st_size if dump.exists() else 0

    # --- running ----------------------------------------------------------------------------------

    def run(
        self, command: Sequence[str], on_step: Callable[[int], None], keep_open: Sequence[int]
    ) -> EngineReport:
        """Start an engine and watch it to its end; the arguments are those of `launch`."""
        with engine_environment(self.layout.ranks) as environment:
            status = self._run_to_the_end(command, environment, on_step, keep_open)
        report = self.verdict(status)
        on_step(self.step)
        return report

    def _run_to_the_end(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        on_step: Callable[[int], None],
        keep_open: Sequence[int],
    ) -> int:
        """Start an engine, watch it until it ends, and return its exit status."""
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
                end_process(process)
                self._shorten_log()
        return process.returncode

    def _shorten_log(self) -> None:
        """Cut the log at its limit, beyond which the engine may have written before it ended."""
        with suppress(OSError):  # the folder may have been removed
            if self.log.stat().st_size > self.deck.log_limit:
                os.truncate(self.log, int(self.deck.log_limit))

    # --- reading ----------------------------------------------------------------------------------

    def look(self) -> None:
        """Read the output since the last look, and measure for how long there was none.

        Reading stops as soon as the limit of the log is passed, which `check` reports.
        """
        with open_regular(self.log) as output:
            output.seek(self.bytes_read)
            while self.bytes_read <= self.deck.log_limit:
                chunk = output.read(_CHUNK_BYTES)
                if not chunk:
                    break
                self.bytes_read += len(chunk)
                lines, newline, rest = (self.unfinished_line + chunk).rpartition(b"\n")
                self._take_in(lines + newline)
                # A line that does not end must not fill the memory.
                self.unfinished_line = rest[:_CHUNK_BYTES]
        now = time.perf_counter()
        bytes_of_output = self.bytes_read + self.dump_bytes
        if bytes_of_output != self.bytes_of_output:
            self.silent_seconds = 0.0
        else:
            self.silent_seconds += min(now - self.looked, _LONGEST_LOOK)
        self.looked = now
        self.bytes_of_output = bytes_of_output

    def _take_in(self, lines: bytes) -> None:
        """Update what is known of the run from whole lines of the log.

        That is the version, the first error, the first failure, what the last status line has, the
        time of the last loop (s), and the last line with text.
        """
        if self.version is None:
            self.version = version_in(lines)
        error = _ERROR_LINE.search(lines)
        if error is not None and not self.error:
            self.error = error[0].strip()
        for match in _STATUS_LINE.finditer(lines):
            failure = self._follow(_Status.of_line(match))
            self.failure = self.failure or failure
        loop_times = _LOOP_TIME.findall(lines)
        if loop_times:
            self.loop_seconds = float(loop_times[-1])
        text = lines.strip()
        if text:
            self.last_line = text.rsplit(b"\n", 1)[-1]

    def _follow(self, status: _Status) -> failures.EngineFailure | None:
        """Store the step and the clearance of a status line, and return the failure that it shows.

        Step and clearance of the line before are needed for that. None if there is no failure.
        Lost beads are a sign of a blow-up at a time step beyond its limits, and where even the
        fastest bead could not have reached a face of the box.
        """
        seconds = (status.step - self.step) * self.layout.time_step
        clearance = self.clearance
        nearest_was_top = self.nearest_is_top
        lost = self.layout.atoms - status.atoms
        self.step = status.step
        self._measure_clearance(status)
        if not status.speed <= self.deck.fastest:  # true for NaN, too
            return self._blow_up(status.speed)
        if lost <= 0:
            return None
        if self.deck.beyond_limits:
            return self._blow_up(0.0)
        # A bead that has left the box since the line before was at least as fast as this.
        if clearance is not None and clearance > self.deck.fastest * seconds:
            return self._blow_up(clearance / seconds if seconds else math.inf)
        message = self._message_about_lost_beads(lost)
        if nearest_was_top:
            return failures.BeadsOverTheTop(message, self.directory, lost=lost)
        return failures.BeadsLost(message, self.directory, lost=lost)

    def _measure_clearance(self, status: _Status) -> None:
        """Store the smallest distance of a bead's centre from a face of the box (m).

        Store also whether this face is the top.
        """
        lower, upper = self.deck.box
        distances = []
        for axis in range(3):
            distances.append(status.lowest[axis] - lower[axis])
            distances.append(upper[axis] - status.highest[axis])
        self.clearance = min(distances)
        self.nearest_is_top = distances[-1] == self.clearance

    def _message_about_lost_beads(self, lost: int) -> str:
        """The message about beads that left the box, with the likely causes."""
        if self.layout.walkers:
            cause = (
                "walkers left its sides (increase their spacing, shorten the run, or reduce the "
                "acceleration if beads fly off), or climbers rose above its top, at twice "
                "boundary.height"
            )
        else:
            cause = (
                "beads left the vessel over its rim or rose above twice boundary.height (use "
                "higher walls, fewer beads or a lower acceleration), or left the sides of a "
                "boundary without a rim"
            )
        return f"{lost} bead(s) left the simulation box before step {self.step}: {cause}"

    def _blow_up(self, speed: float) -> failures.BlowUp:
        """The failure of a bead that is too fast, for its speed (m/s).

        A speed within the limits stands for a bead that left the box at an unstable time step.
        """
        if speed <= self.deck.fastest:
            event = "left the box at a time step beyond its limits"
        elif math.isfinite(speed):
            event = f"moves at {speed:.3g} m/s"
        else:
            event = "has a speed or position that is not a number"
        return failures.BlowUp(
            f"blow-up: a bead {event} after step {self.step}; the drive accelerates beads to at "
            f"most {self.deck.fastest:.3g} m/s; the most frequent cause is a time step that is too "
            "long",
            self.directory,
        )

    # --- judging ----------------------------------------------------------------------------------

    def check(self) -> None:
        """Raise the failure that shows while the engine runs, if there is one.

        Raises
        ------
        OtherEngine
            If the engine has printed another version than the audited one.
        BlowUp, BeadsLost
            If a status line has shown it.
        LogTooLong, EngineSilent, TimeLimitExceeded
            If the log or a time exceeds its limit.
        DiskFull
            If the dump is not complete, and the disk has no space left but the reserve.
        """
        deck = self.deck
        progress = f"step {self.step} of {self.layout.steps}"
        if self.version is not None and self.version != AUDITED_VERSION:
            raise failures.OtherEngine(self.engine, self.version)
        if self.failure is not None:
            raise self.failure
        if self.bytes_read > deck.log_limit:
            limit = f"{deck.log_limit / 1e6:g} MB"
            message = f"the engine's log grew beyond {limit} after step {self.step}; it was stopped"
            raise failures.LogTooLong(message, self.directory)
        if self.silent_seconds > deck.silence:
            silence = f"the engine wrote nothing for {deck.silence:g} s"
            message = f"{silence} after {progress}; it was stopped"
            raise failures.EngineSilent(message, self.directory)
        if time.perf_counter() - self.started > self.time_limit:
            message = f"time limit of {self.time_limit:g} s reached at {progress}"
            raise failures.TimeLimitExceeded(message, self.directory)
        missing = self.layout.bead_dump_bytes - self.dump_bytes
        free = shutil.disk_usage(self.directory).free
        # The engine does not report a full disk. At the start, the disk had space for the whole
        # dump; if it has less now, other programs may still make space before it is needed.
        if missing > 0 and free < _SPARE_BYTES:
            raise failures.DiskFull(missing, free, self.directory)

    def verdict(self, status: int) -> EngineReport:
        """Judge a run that has ended: raise its failure, or return its cost.

        Parameters
        ----------
        status
            Exit status of the process; negative: the number of the signal that ended it.
        """
        wall_seconds = time.perf_counter() - self.started
        self.time_limit = math.inf
        self.look()
        self._take_in(self.unfinished_line)  # the last line may lack its end
        self.check()
        self._check_exit(status)
        self._check_frames()
        return EngineReport(
            version=self.version or "unknown",
            wall_seconds=wall_seconds,
            loop_seconds=self.loop_seconds,
            steps=self.layout.steps,
        )

    def _check_exit(self, status: int) -> None:
        """Raise the failure that the exit status and the lines with ERROR show."""
        output = f", last line: {_text(self.last_line)}" if self.last_line else ", without output"
        status_words = f"exit status {status}{output}"
        if status > 0 and self.version is None and not self.error.startswith(b"ERROR"):
            message = f"the engine never started: {status_words}"
            raise failures.EngineNeverStarted(message, self.directory)
        if b"a bead's position is no number" in self.error:
            raise self._blow_up(math.nan)
        if self.error or status > 0:
            reason = _text(self.error) if self.error else status_words
            raise failures.EngineError(f"the engine stopped: {reason}", self.directory)
        if status == -signal.SIGXFSZ:
            raise failures.FileTooLarge(self.directory)
        if status < 0:
            message = f"the engine was killed by {_signal_name(-status)}"
            raise failures.EngineKilled(message, self.directory)

    def _check_frames(self) -> None:
        """Raise `MissingFrames` unless each dump has exactly the frames of its layout."""
        layout = self.layout
        bead_frames = self.dump_bytes / layout.bead_dump_bytes * layout.frames
        pair_frames = _complete_frames(self.directory / layout.pair_bridge_dump)
        wall_frames = _complete_frames(self.directory / layout.wall_bridge_dump)
        for frames, expected in (
            (bead_frames, layout.frames),
            (pair_frames, layout.bridge_frames),
            (wall_frames, layout.bridge_frames),
        ):
            if frames != expected:
                count = f"{int(frames)} of {expected} frames"
                message = f"the engine wrote {count} and reported no error"
                raise failures.MissingFrames(message, self.directory)


def _complete_frames(path: Path) -> int:
    """Number of complete frames of a local dump: the last one counts only with all of its rows."""
    text = read_regular(path) if path.exists() else b""
    frames = text.count(_FRAME_START)
    if not frames:
        return 0
    last = text[text.rfind(_FRAME_START) :].split(b"\n")
    # The fourth line of the header is the number of rows; each row ends with a newline, after which
    # an empty text follows.
    is_complete = (
        len(last) > _HEADER_LINES
        and last[3].isdigit()
        and len(last) - _HEADER_LINES - 1 == int(last[3])
    )
    return frames if is_complete else frames - 1


def _signal_name(number: int) -> str:
    """The name of a signal, such as SIGSEGV."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _text(line: bytes) -> str:
    """A line of the engine's output as text."""
    return line.decode("utf-8", "backslashreplace")
